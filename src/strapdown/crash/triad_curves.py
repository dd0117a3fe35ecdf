"""Errors of a triad that follow from its input: one standard deviation of each."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from strapdown.sensors.crash_unit import RecordedTriad

Array = NDArray[np.float64]
#: From what a triad feels, (n, 3), to what is added to the output of one axis, (n,).
Curve = Callable[[Array], Array]
#: The axis it is added to, the end of the unknown's name, the curve.
AxisCurve = tuple[int, str, Curve]

AXES = "xyz"


def triad_curves(triad: RecordedTriad) -> Iterator[tuple[str, str, list[AxisCurve]]]:
    """List scale factor, misalignment and nonlinearity of a triad.

    Parameters
    ----------
    triad : RecordedTriad

    Yields
    ------
    name : str
    contributor : str
        Line of the error budget.
    curves : list of (axis, end of the name, curve)
        Those that have a standard deviation.
    """
    sd = triad.uncertainty
    scale, skew = sd.axis("scale"), sd.axis("misalignment")
    bend, full = sd.axis("nonlinearity_2"), sd.axis("full_scale")
    yield (
        "scale",
        "scale factor",
        [(a, f" {AXES[a]}", _part(scale[a], a)) for a in range(3) if scale[a] > 0.0],
    )
    yield (
        "misalignment",
        "misalignment",
        [
            (a, f" {AXES[j]}→{AXES[a]}", _part(skew[a], j))
            for a in range(3)
            for j in range(3)
            if j != a and skew[a] > 0.0
        ],
    )
    yield (
        "nonlinearity",
        "nonlinearity",
        [(a, f" {AXES[a]}", _square(bend[a] / full[a], a)) for a in range(3) if bend[a] > 0.0],
    )


def _part(gain: float, axis: int) -> Curve:
    def curve(felt: Array) -> Array:
        return np.asarray(gain * felt[:, axis])

    return curve


def _square(gain: float, axis: int) -> Curve:
    def curve(felt: Array) -> Array:
        return np.asarray(gain * felt[:, axis] ** 2)

    return curve


def constant(value: float) -> Curve:
    """Return a curve that does not depend on the input."""

    def curve(felt: Array) -> Array:
        return np.full(len(felt), value)

    return curve
