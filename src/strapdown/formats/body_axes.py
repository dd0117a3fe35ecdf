"""Mapping of sensor axes to body axes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import Finding
from strapdown.formats.columns import parse_axes
from strapdown.formats.find_columns import AXES
from strapdown.formats.inference import Inference
from strapdown.formats.judge import axes_against_gravity, report_upside_down
from strapdown.formats.recording import RawLog, ReadOptions

__all__ = ["Axes", "axes_matrix", "body_axes", "mirrored"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Axes:
    """Sensor axis of each body axis, with its sign and the reason."""

    axis: list[int]
    sign: list[float]
    why: str


def axes_matrix(axis: list[int], sign: list[float]) -> Array:
    """Return the matrix ``C_bs`` from sensor axes to body axes."""
    return np.asarray(np.eye(3)[axis] * np.array(sign)[:, None])


def mirrored(axis: list[int], sign: list[float]) -> bool:
    """Whether axes are a mirror image of the sensor's."""
    return bool(np.linalg.det(axes_matrix(axis, sign)) < 0)


def body_axes(
    raw: RawLog, options: ReadOptions, said: dict[str, Inference], findings: list[Finding]
) -> Axes:
    """Return the axes stated by the user, else by the file, else the sensor's own.

    Parameters
    ----------
    raw : RawLog
    options : ReadOptions
    said : dict of str to Inference
        Inferences from the numbers.
    findings : list of Finding
        Assumptions and doubts are appended.
    """
    text = options.axes or raw.axes
    if text is None:
        doubt = None if options.accel_unit else axes_against_gravity(said)
        taken = doubt or Finding("io.axes-not-stated", severity="note")
        findings.append(taken.replace(file=raw.name, quantity="axes"))
        return Axes([0, 1, 2], [1.0, 1.0, 1.0], "as they are")
    axis, sign = parse_axes(text)
    if options.axes and not options.accel_unit:
        down = ("-" if sign[2] < 0 else "") + AXES[axis[2]]
        report_upside_down(said, down, raw.name, findings)
    if options.axes and mirrored(axis, sign):
        findings.append(
            Finding(
                "io.axes-mirrored",
                file=raw.name,
                quantity="axes",
                severity="note",
                text=text,
            )
        )
    why = f"{text} {'by --axes' if options.axes else 'of this kind of recording'}"
    return Axes(axis, sign, why)
