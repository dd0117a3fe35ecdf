"""The units against each other at the reference point."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from strapdown.constants import STANDARD_GRAVITY, TWO_SIDED_95
from strapdown.crash.crash_event import CrashEvent
from strapdown.crash.unit_comparison import UnitComparison
from strapdown.crash.unit_reconstruction import UnitReconstruction
from strapdown.dsp.channel_class import LEAST_RATE, cfc_filter
from strapdown.report.chart import Band, Chart, Fill, Line, Panel, curve
from strapdown.report.crash_moments import crash_span, event_marks, unit_look
from strapdown.report.crash_values import MEAN

Array = NDArray[np.float64]

__all__ = ["accelerations_chart", "differences_chart"]

_AXES = ("forward", "right", "down")
_CLASS = 60
_X = "time from the trigger, ms"


def differences_chart(comparison: UnitComparison, names: Sequence[str]) -> Chart | None:
    """Chart how far the change of velocity of each unit is from that of all together.

    Parameters
    ----------
    comparison : UnitComparison
    names : sequence of str
        Of all units in the order of the report, for their colours.

    Returns
    -------
    Chart or None
        Of the axes that two or more units measure; None where there are none.
    """
    edges = 1e3 * comparison.edges
    panels = []
    named: set[str] = set()
    for k, axis in enumerate(_AXES):
        lines: list[Line] = []
        fills: list[Fill] = []
        measured = [one for one in comparison.against if np.isfinite(one.difference[:, k]).any()]
        for one in measured:
            look = unit_look(list(names).index(one.name))
            y, half = one.difference[:, k], TWO_SIDED_95 * one.sd[:, k]
            made = curve(one.name, edges, y, look["colour"], look["dash"], 1.8)
            lines.append(replace(made, legend=one.name not in named))
            named.add(one.name)
            for edge in (half, -half):
                made = curve(one.name, edges, edge, look["colour"], "dot", 0.9)
                lines.append(replace(made, legend=False))
            fills.append(Fill(one.name, edges, -half, half, look["colour"], 0.05, legend=False))
        if measured:
            panels.append(Panel(f"{axis}, m/s", tuple(lines), fills=tuple(fills), height=0.9))
    if not panels:
        return None
    said = "agree within" if comparison.agree else "do NOT agree within"
    return Chart(
        "units",
        "Recorders against each other",
        "Change of velocity at the reference point by each recorder less that of their best "
        "weighted mean, vehicle axes, since the first instant shown. Dotted, in its colour: what "
        "holds 95 % of such a difference, as stated of the recorders; what a recorder shares with "
        "the mean is taken into account. "
        f"Together they {said} their bounds (chi-square {comparison.chi_square:.4g} of "
        f"{comparison.freedom} degrees of freedom, probability {comparison.probability:.2g}).",
        _X,
        tuple(panels),
    )


def accelerations_chart(
    units: Sequence[UnitReconstruction],
    combined: UnitReconstruction | None,
    events: Sequence[CrashEvent] = (),
) -> Chart:
    """Chart the acceleration of the reference point by every unit, one over the other.

    Parameters
    ----------
    units : sequence of UnitReconstruction
    combined : UnitReconstruction or None
    events : sequence of CrashEvent

    Returns
    -------
    Chart
        After a low-pass of class CFC 60 where the common rate carries it.
    """
    main = units[0] if combined is None else combined
    span = crash_span(events, main.acceleration.begin, main.acceleration.end)
    rows: list[list[Line]] = [[], [], []]
    filtered = False
    drawn: list[tuple[UnitReconstruction, int | None]] = [(u, k) for k, u in enumerate(units)]
    if combined is not None:
        drawn.append((combined, None))
    for unit, number in drawn:
        time, values = unit.acceleration.time, unit.acceleration.values / STANDARD_GRAVITY
        step = float(np.median(np.diff(time)))
        if step * LEAST_RATE * _CLASS <= 1.0 and not unit.acceleration.gaps(time[0], time[-1]):
            values, filtered = cfc_filter(values, step, _CLASS), True
        inside = (time >= span[0]) & (time <= span[1])
        look = unit_look(number, len(units) == 1)
        name = MEAN if number is None else unit.name
        for k in range(3):
            made = curve(
                name,
                1e3 * time[inside],
                values[inside, k],
                look["colour"],
                look["dash"],
                2.0 if number is None else 1.3,
            )
            rows[k].append(replace(made, legend=k == 0))
    how = f"after a phaseless low-pass of class CFC {_CLASS}" if filtered else "as sampled"
    return Chart(
        "accelerations",
        "Acceleration of the reference point by every recorder",
        "Along the turning axes of the vehicle, forward, right, down, what was felt at rest taken "
        f"off, {how}; 1 g = 9.80665 m/s². Shaded: the event.",
        _X,
        tuple(Panel(f"{axis}, g", tuple(rows[k]), height=0.9) for k, axis in enumerate(_AXES)),
        marks=event_marks(events, *span),
        bands=tuple(Band(1e3 * e.time_zero, 1e3 * e.end, "event") for e in events),
    )
