"""The vehicle from above: its outline, the marking of its front, and its position."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike

from strapdown.config.crash_case import VehicleSpec
from strapdown.constants import Array
from strapdown.crash.events import CrashEvent
from strapdown.crash.path import CrashPath
from strapdown.crash.pdof import AngleInterval
from strapdown.report.chart import BLACK, Mark, look
from strapdown.report.svg_drawing import Drawing
from strapdown.report.values import plain

# Half of a generic car, along (0 the rear, 1 the front) and to the side (1 the widest): its
# body, and the details that mark its front.
_BODY = (
    *((0.000, 0.55), (0.004, 0.72), (0.016, 0.86), (0.045, 0.95), (0.120, 0.99), (0.300, 1.00)),
    *((0.620, 1.00), (0.800, 0.985), (0.880, 0.955), (0.940, 0.890), (0.975, 0.780)),
    *((0.993, 0.620), (1.000, 0.380)),
)
_WINDSCREEN = ((0.565, 0.70), (0.700, 0.86), (0.722, 0.55), (0.728, 0.0))
_SCREEN_FOOT = ((0.565, 0.0),)
_REAR_WINDOW = ((0.085, 0.0), (0.092, 0.60), (0.105, 0.78), (0.185, 0.68), (0.190, 0.0))
_BONNET = ((0.745, 0.80), (0.965, 0.58))
# Size of the arrow that marks the front of a stated outline, as a share of its smaller side.
_ARROW = 0.28


@dataclass(frozen=True, eq=False)
class Outline:
    """A vehicle from above in some plane.

    `body`, (n, 2), m: corners in order around the body, in vehicle axes forward and right, or as
    placed. `windows`, (k, 2), m: filled shapes: the windscreen first, or an arrow towards the front
    of a stated outline. `folds`, (k, 2), m: lines on the body. `stated`: whether the outline is
    stated in the case, instead of a car of its length and width.
    """

    body: Array = field(repr=False)
    windows: tuple[Array, ...] = field(repr=False)
    folds: tuple[Array, ...] = field(repr=False)
    stated: bool = False

    @property
    def low(self) -> Array:
        """Minimum coordinates, (2,), m."""
        return np.asarray(self.body.min(axis=0))

    @property
    def high(self) -> Array:
        """Maximum coordinates, (2,), m."""
        return np.asarray(self.body.max(axis=0))

    def placed(self, at: ArrayLike, heading_deg: float, point: ArrayLike = (0.0, 0.0)) -> Outline:
        """Turn and move the vehicle into a level plane.

        `at`, (2,), m: position of `point`: north and east, or the axes of headings of zero and of
        90 deg. `heading_deg`, deg: clockwise from above. Roll and pitch are not shown. `point`,
        (2,), m: of the vehicle, forward and right from its origin.
        """
        c, s = math.cos(math.radians(heading_deg)), math.sin(math.radians(heading_deg))
        turn = np.array([[c, s], [-s, c]])
        origin, there = np.asarray(point, np.float64)[:2], np.asarray(at, np.float64)[:2]

        def moved(points: Array) -> Array:
            return np.asarray((points - origin) @ turn + there)

        return self.mapped(moved)

    def mapped(self, move: Callable[[Array], Array]) -> Outline:
        """Map every point, (n, 2), such as to pixels."""
        return replace(
            self,
            body=move(self.body),
            windows=tuple(move(w) for w in self.windows),
            folds=tuple(move(f) for f in self.folds),
        )

    def edge(self, point: ArrayLike, direction_deg: float) -> float:
        """Distance from a point to the outline in a direction, m; zero if it does not intersect.

        `point`, (2,), m. `direction_deg`, deg: clockwise from forward.
        """
        u = np.array([math.cos(math.radians(direction_deg)), math.sin(math.radians(direction_deg))])
        a = self.body - np.asarray(point, dtype=np.float64)[:2]
        b = np.roll(a, -1, axis=0)
        across = np.array([-u[1], u[0]])
        da, db = a @ across, b @ across
        meets = (da <= 0.0) != (db <= 0.0)
        share = np.where(meets, da / np.where(meets, da - db, 1.0), 0.0)
        reach = ((a + share[:, None] * (b - a)) @ u)[meets]
        return float(max(reach.max(initial=0.0), 0.0))


def vehicle_outline(vehicle: VehicleSpec) -> Outline:
    """Outline of a vehicle from above, in vehicle axes from its origin.

    `vehicle`: ``outline_m`` as stated; else a car of ``length_m`` and ``width_m`` whose front is
    ``front_m`` ahead of the origin, half its length where that is not given.
    """
    if len(vehicle.outline_m) >= 3:
        body = np.array(vehicle.outline_m, dtype=np.float64)
        low, high = body.min(axis=0), body.max(axis=0)
        size = _ARROW * float((high - low).min())
        tip = np.array([high[0] - 0.35 * size, 0.5 * (low[1] + high[1])])
        wings = [[-1.2 * size, -0.6 * size], [-0.85 * size, 0.0], [-1.2 * size, 0.6 * size]]
        return Outline(body, (np.vstack([tip, tip + np.array(wings)]),), (), stated=True)
    front = 0.5 * vehicle.length_m if vehicle.front_m is None else vehicle.front_m
    scale = np.array([vehicle.length_m, 0.5 * vehicle.width_m])

    def whole(half: tuple[tuple[float, float], ...]) -> Array:
        right = np.array(half, dtype=np.float64)
        both = np.vstack([right, (right * [1.0, -1.0])[::-1]])
        return np.asarray(both * scale + np.array([front - vehicle.length_m, 0.0]))

    sides = [np.array(_BONNET) * [1.0, sign] for sign in (1.0, -1.0)]
    return Outline(
        whole(_BODY),
        (whole(_SCREEN_FOOT + _WINDSCREEN), whole(_REAR_WINDOW)),
        tuple(side * scale + np.array([front - vehicle.length_m, 0.0]) for side in sides),
    )


def draw_outline(
    drawing: Drawing,
    pixels: Outline,
    colour: str,
    width: float = 1.2,
    dash: str = "solid",
    *,
    fill: str | None = None,
    opacity: float = 1.0,
    details: bool = True,
) -> None:
    """Draw a vehicle whose points are already in pixels.

    `colour`, `width`, `dash`: style of its edge. `fill`, `opacity`: style of its body. `details`:
    whether all windows and folds are drawn, or only the marking of the front.
    """
    drawing.shape(pixels.body, colour, width, dash, fill=fill, opacity=opacity)
    for k, window in enumerate(pixels.windows):
        if k == 0 or details:
            drawing.shape(window, colour, 0.6, fill=colour, opacity=0.55 if k == 0 else 0.25)
    if details:
        for fold in pixels.folds:
            drawing.shape(fold, colour, 0.6, closed=False)


# Instants and spans of a crash that several pictures share.


#: Horizontal axis of charts over the crash.
SINCE_TRIGGER = "time from the trigger, ms"
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

    `number`: index of the unit, from 0; None for the mean of the units. `alone`: whether this is
    the only unit, drawn solid.
    """
    if number is None:
        return {"colour": BLACK, "dash": "solid", "symbol": "circle"}
    found = look(number)
    return {**found, "dash": "solid" if alone else _DASHES[number % len(_DASHES)]}


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

    Returns: ``begin`` (of the window), ``entry``, ``time zero`` and ``563 event end`` of each
    event, ``end``; names of instants at the same sample are joined by commas.
    """
    many = len(events) > 1
    begin, end = float(path.time[0]), float(path.time[-1])
    found = [("begin", begin), ("entry", path.entry.time)]
    for k, event in enumerate(events, start=1):
        which = f" {k}" if many else ""
        found.append((f"time zero{which}", event.time_zero))
        if not event.lasts_beyond_record:
            found.append((f"563 event end{which}", event.end))
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
    named = [(e.time_zero, "time zero") for e in events]
    named += [(e.end, "563 event end") for e in events]
    return marks_apart(named, begin, end, scale)


def marks_apart(
    named: Sequence[tuple[float, str]], begin: float, end: float, scale: float = 1e3
) -> tuple[Mark, ...]:
    """Marks at instants, with labels that do not overlap.

    `named`: instants in s; those outside are dropped. `begin`, `end`, s: ends of the drawn span.
    `scale`: of the axis: 1000 for ms. Of marks close to each other, the last carries all names.
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
