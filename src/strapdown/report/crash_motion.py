"""Charts of position, velocity and attitude over time with bounds, and against references."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.constants import TWO_SIDED_95
from strapdown.crash.events import CrashEvent
from strapdown.crash.path import CrashPath, PathComparison, PathSamples
from strapdown.report.chart import (
    BLACK,
    BLUE,
    ORANGE,
    VERMILLION,
    Chart,
    Fill,
    Line,
    Panel,
    curve,
)
from strapdown.report.crash_moments import marks_apart, path_moments
from strapdown.tables import EULER, NED, VELOCITY

Array = NDArray[np.float64]

__all__ = ["attitude_chart", "place_chart", "reference_chart", "velocity_chart"]

_X = "time from the trigger, ms"
# Instants at which the Monte Carlo bounds are taken; they are as smooth as the path.
_INSTANTS = 160
_STEADY = 1e-3


def place_chart(
    path: CrashPath,
    names: tuple[str, str] = ("forward", "right"),
    *,
    samples: PathSamples | None = None,
    events: Sequence[CrashEvent] = (),
    reference: pd.DataFrame | None = None,
    reference_name: str = "reference",
) -> Chart:
    """Chart the position of the reference point over time.

    Parameters
    ----------
    path : CrashPath
    names : (str, str)
        Of the first two axes of the path.
    samples : PathSamples, optional
        Monte Carlo samples, whose 95 % bounds are drawn beside the linear ones.
    events : sequence of CrashEvent
    reference : DataFrame, optional
        ``north east down`` in the axes of the path, m, indexed by time.
    reference_name : str
    """
    labels = [f"{name}, m" for name in (*names, "down")]
    panels = _panels(path, NED, labels, _sampled(samples, 6))
    if reference is not None:
        at = 1e3 * reference.index.to_numpy(dtype=np.float64)
        for k, column in enumerate(NED):
            y = reference[column].to_numpy(dtype=np.float64)
            line = replace(curve(reference_name, at, y, VERMILLION, "dash", 1.6), legend=k == 0)
            panels[k] = replace(panels[k], lines=(*panels[k].lines, line))
    return _chart(
        "place",
        "Place over time",
        f"Place of the reference point, {names[0]}, {names[1]}, down, from where it was at the "
        "entry, which is without error by definition.",
        panels,
        (path, events),
        samples,
    )


def velocity_chart(
    path: CrashPath,
    names: tuple[str, str] = ("forward", "right"),
    *,
    samples: PathSamples | None = None,
    events: Sequence[CrashEvent] = (),
) -> Chart:
    """Chart the velocity of the reference point over time; parameters as `place_chart`."""
    labels = [f"{name}, m/s" for name in (*names, "down")]
    return _chart(
        "velocity",
        "Velocity over time",
        f"Velocity of the reference point over ground, {names[0]}, {names[1]}, down, in axes that "
        "do not turn with the vehicle; 1 m/s = 3.6 km/h.",
        _panels(path, VELOCITY, labels, _sampled(samples, 3)),
        (path, events),
        samples,
    )


def attitude_chart(
    path: CrashPath,
    *,
    samples: PathSamples | None = None,
    events: Sequence[CrashEvent] = (),
) -> Chart:
    """Chart roll, pitch and heading over time; parameters as `place_chart`."""
    return _chart(
        "attitude",
        "Attitude over time",
        "Roll (right side down is positive), pitch (nose up) and heading (clockwise from above), "
        "3-2-1 angles of the vehicle against the axes of the path; the heading runs on beyond a "
        "full turn.",
        _panels(path, EULER, [f"{a}, deg" for a in EULER], _sampled_angles(path, samples)),
        (path, events),
        samples,
    )


def reference_chart(
    comparison: PathComparison,
    name: str,
    names: tuple[str, str] = ("forward", "right"),
    number: int = 1,
) -> Chart:
    """Chart the difference of the path from a reference, with its bound.

    Parameters
    ----------
    comparison : PathComparison
    name : str
        Of the reference.
    names : (str, str)
        Of the first two axes of the path.
    number : int
        Index of the reference, for the file name.
    """
    time = 1e3 * comparison.errors.index.to_numpy(dtype=np.float64)
    panels = []
    for k, axis in enumerate(NED):
        y = comparison.errors[axis].to_numpy(dtype=np.float64)
        half = comparison.bound[axis].to_numpy(dtype=np.float64)
        line = replace(curve("path less reference", time, y, BLUE, width=1.8), legend=k == 0)
        fill = Fill("95 % of path and reference", time, -half, half, BLUE, legend=k == 0)
        label = f"{(*names, 'down')[k]}, m"
        panels.append(Panel(label, (line,), fills=(fill,), height=0.8))
    return Chart(
        f"reference-{number}",
        f"Path against {name}",
        f"Place by the reconstruction less that by {name}, moved so that both agree at the entry. "
        "Shaded: what holds 95 % of such differences, from the bounds of both; "
        + ("they are consistent" if comparison.consistent else "they are NOT consistent")
        + f" at the last instant (chi-square {comparison.chi_square:.3g}, limit "
        f"{comparison.chi_square_95:.3g}).",
        _X,
        tuple(panels),
    )


def _sampled(samples: PathSamples | None, first: int) -> list[Array] | None:
    """Low and high ends of the Monte Carlo 95 % interval for three columns of its errors."""
    if samples is None:
        return None
    low, high = samples.interval(0.95)
    return [np.stack([low[:, k], high[:, k]]) for k in range(first, first + 3)]


def _sampled_angles(path: CrashPath, samples: PathSamples | None) -> list[Array] | None:
    if samples is None:
        return None
    rows = np.unique(np.linspace(0, len(path.time) - 1, _INSTANTS).astype(int))
    out = [np.full((2, len(path.time)), np.nan) for _ in EULER]
    nominal = rotation.euler_from_quaternion(path.q_nb)
    for row in rows.tolist():
        # The error angles are applied after the computed attitude.
        turned = rotation.quaternion_from_rotation_vector(samples.errors[:, row, :3])
        true = rotation.euler_from_quaternion(rotation.compose(turned, path.q_nb[row]))
        off = rotation.within_half_turn(true - nominal[row])
        for k in range(3):
            out[k][:, row] = np.quantile(off[:, k], [0.025, 0.975])
    return out


def _panels(
    path: CrashPath, columns: Sequence[str], labels: Sequence[str], sampled: list[Array] | None
) -> list[Panel]:
    time, sd = 1e3 * path.time, path.sd
    panels = []
    for k, (column, label) in enumerate(zip(columns, labels, strict=True)):
        y = path.table[column].to_numpy(dtype=np.float64)
        if column == "heading":
            y = np.unwrap(y, period=360.0)
            # A heading of 359.9 deg at the entry is shown as -0.1 deg.
            y = y - 360.0 * np.round(y[path.anchor] / 360.0)
        half = TWO_SIDED_95 * sd[column].to_numpy(dtype=np.float64)
        first = k == 0
        lines = [replace(curve("reconstructed", time, y, BLACK, width=1.8), legend=first)]
        fill = Fill("95 %, linear", time, y - half, y + half, BLUE, legend=first)
        if sampled is not None:
            for j, edge in enumerate(sampled[k]):
                there = np.isfinite(edge)
                lines.append(
                    Line(
                        "95 %, Monte Carlo",
                        time[there],
                        (y + edge)[there],
                        ORANGE,
                        "dash",
                        1.2,
                        legend=first and j == 0,
                    )
                )
        panels.append(Panel(label, tuple(lines), fills=(fill,), height=0.8, steady=_STEADY))
    return panels


def _chart(
    slug: str,
    title: str,
    caption: str,
    panels: list[Panel],
    when: tuple[CrashPath, Sequence[CrashEvent]],
    samples: PathSamples | None,
) -> Chart:
    path, events = when
    named = [(at, name) for name, at in path_moments(path, events) if name not in ("begin", "end")]
    said = " Shaded: 95 % by the linear covariance"
    if samples is not None:
        said += f"; dashed: the middle 95 % of {len(samples.errors)} runs of the Monte Carlo"
    return Chart(
        slug,
        title,
        f"{caption}{said}.",
        _X,
        tuple(panels),
        marks=marks_apart(named, path.time[0], path.time[-1]),
    )
