"""Instants and spans of a crash that several pictures share."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from strapdown.crash.events import CrashEvent
from strapdown.crash.path import CrashPath
from strapdown.crash.pdof import AngleInterval
from strapdown.crash.reconstruction import UnitReconstruction
from strapdown.report.chart import BLACK, Mark, look
from strapdown.report.values import plain

Array = NDArray[np.float64]

__all__ = [
    "AROUND",
    "angle_words",
    "assumed_axes",
    "crash_span",
    "event_marks",
    "interval_words",
    "marks_apart",
    "path_moments",
    "unit_look",
]

#: Time drawn before time zero and after the end of an event, s.
AROUND = (0.05, 0.10)
# For a record without an event: time about the trigger.
_NO_EVENT = (-0.1, 0.3)
# Share of the drawn span; closer labels would overlap.
_CLOSE = 0.06
# Dashes distinguish the units without color; the mean is solid.
_DASHES = ("dash", "dashdot", "longdash", "dot")


def unit_look(number: int | None, alone: bool = False) -> dict[str, str]:
    """Color, dash and symbol of a unit in every picture of a report.

    Parameters
    ----------
    number : int or None
        Index of the unit, from 0; None for the mean of the units.
    alone : bool
        Whether this is the only unit, drawn solid.
    """
    if number is None:
        return {"colour": BLACK, "dash": "solid", "symbol": "circle"}
    found = look(number)
    return {**found, "dash": "solid" if alone else _DASHES[number % len(_DASHES)]}


def assumed_axes(unit: UnitReconstruction) -> tuple[str, ...]:
    """Axes of forward, right, down, roll, pitch, heading that no sensor of a unit measured."""
    return unit.at_point.assumed_axes


def crash_span(events: Sequence[CrashEvent], begin: float, end: float) -> tuple[float, float]:
    """Span drawn to show the crash, s: all its events with a margin."""
    if events:
        low, high = events[0].time_zero - AROUND[0], events[-1].end + AROUND[1]
    else:
        low, high = _NO_EVENT
    low, high = max(low, begin), min(high, end)
    return (low, high) if high > low else (begin, end)


def path_moments(path: CrashPath, events: Sequence[CrashEvent]) -> list[tuple[str, float]]:
    """Name the key instants of a path in time order; each is within the path.

    Returns
    -------
    list of (str, float)
        ``begin`` (of the window), ``entry``, ``time zero`` and ``event end`` of each event,
        ``end``; names of instants at the same sample are joined by commas.
    """
    many = len(events) > 1
    begin, end = float(path.time[0]), float(path.time[-1])
    found = [("begin", begin), ("entry", path.entry.time)]
    for k, event in enumerate(events, start=1):
        which = f" {k}" if many else ""
        found.append((f"time zero{which}", event.time_zero))
        if not event.lasts_beyond_record:
            found.append((f"event end{which}", event.end))
    found.append(("end", end))
    step = float(np.median(np.diff(path.time))) if len(path.time) > 1 else 0.0
    out: list[tuple[str, float]] = []
    for name, at in sorted(found, key=lambda one: one[1]):
        if not begin - 1e-9 <= at <= end + 1e-9:
            continue
        if out and at - out[-1][1] < step:
            out[-1] = (f"{out[-1][0]}, {name}", out[-1][1])
        else:
            out.append((name, at))
    return out


def event_marks(
    events: Sequence[CrashEvent], begin: float, end: float, scale: float = 1e3
) -> tuple[Mark, ...]:
    """Marks at time zero and at the end of each event, as `marks_apart`."""
    named = [(e.time_zero, "time zero") for e in events] + [(e.end, "event end") for e in events]
    return marks_apart(named, begin, end, scale)


def marks_apart(
    named: Sequence[tuple[float, str]], begin: float, end: float, scale: float = 1e3
) -> tuple[Mark, ...]:
    """Marks at instants, with labels that do not overlap.

    Parameters
    ----------
    named : sequence of (float, str)
        Instants in s; those outside are dropped.
    begin, end : float, s
        Ends of the drawn span.
    scale : float
        Of the axis: 1000 for ms.

    Returns
    -------
    tuple of Mark
        Of marks close to each other, the last carries all names.
    """
    out: list[Mark] = []
    for at, name in sorted(named):
        if not begin <= at <= end:
            continue
        if out and at - out[-1].x / scale < _CLOSE * (end - begin):
            name = f"{out[-1].label}, {name}"
            out[-1] = Mark(out[-1].x, "")
        out.append(Mark(scale * at, name))
    return tuple(out)


def angle_words(angle_deg: float, digits: int) -> str:
    """Format an angle in degrees, in (-180, 180]."""
    wrapped = -math.remainder(-angle_deg, 360.0)
    text = plain(wrapped, digits)
    return f"{text.removeprefix('−') if wrapped <= -179.9999 else text}°"


def interval_words(angle_deg: float, interval: AngleInterval | None) -> tuple[str, str]:
    """Format a direction and its interval: ``−8.3°``, ``−12.1° to −4.2°`` or ``undetermined``."""
    if interval is None:
        return angle_words(angle_deg, 1), ""
    if interval.undetermined:
        return angle_words(angle_deg, 0), "undetermined"
    digits = 1 if interval.width_deg < 20.0 else 0
    ends = (angle_words(v, digits) for v in (interval.low_deg, interval.high_deg))
    return angle_words(angle_deg, digits), " to ".join(ends)
