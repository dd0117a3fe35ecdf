"""Clock dial of the direction of force about the vehicle, with its 95 % interval."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from strapdown.crash.pdof import AngleInterval
from strapdown.report.chart import BLUE, GREY, ORANGE, VERMILLION
from strapdown.report.crash_moments import interval_words
from strapdown.report.crash_outline import Outline, draw_outline
from strapdown.report.document import Picture
from strapdown.report.svg_drawing import INK, SMALL, Drawing, shortened
from strapdown.report.values import plain

__all__ = ["Direction", "pdof_dial"]

_WIDTH, _SMALL_WIDTH, _RADIUS, _TOP = 330.0, 304.0, 118.0, 142.0
_CAR = 0.53  # distance of the vehicle's farthest corner, as a share of the dial's radius
_RING = 0.86  # inner edge of the interval ring, as a share of the dial's radius
Point = tuple[float, float]
_SOFT = "#4a525c"
_SMALL_CAPTION = "Where the force came from, seen from above: 0° the front, clockwise; wedge: 95 %."
# Smallest interval drawn, deg, to keep the stroke visible.
_LEAST_WEDGE = 1.0


@dataclass(frozen=True)
class Direction:
    """Direction of force of one event.

    Attributes
    ----------
    name : str
    horizontal_deg : float, deg
        Direction from which the force came, clockwise from the front.
    interval : AngleInterval or None
        The 95 % interval.
    clock : int
    delta_v : float, m/s
        Length of the change of velocity.
    main : bool
        Drawn with a strong line; the others thin.
    """

    name: str
    horizontal_deg: float
    interval: AngleInterval | None
    clock: int
    delta_v: float
    main: bool = True


def pdof_dial(
    outline: Outline,
    directions: Sequence[Direction],
    *,
    point: Sequence[float] = (0.0, 0.0),
    point_name: str = "reference point",
    small: bool = False,
) -> Picture:
    """Draw directions of force about a vehicle, seen from above with its front upward.

    Parameters
    ----------
    outline : Outline
        In vehicle axes.
    directions : sequence of Direction
        One per event, in time order.
    point : sequence of float, m
        Reference point in vehicle axes, at the center of the dial.
    point_name : str
    small : bool
        Draw the dial alone, for a page with the numbers beside it.

    Returns
    -------
    Picture
        An arrow from the origin of each force towards the point, its interval as a wedge; a shaded
        ring if the direction is undetermined.
    """
    rows = sorted(directions, key=lambda d: not d.main)
    height = 2.0 * _TOP + 26.0 + sum(64.0 if d.main else 33.0 for d in rows)
    height += 12.0 if not rows else 0.0 if len(rows) > 1 else -12.0
    width = _SMALL_WIDTH if small else _WIDTH
    if small:
        height = 2.0 * _TOP + 14.0
    said = [_words(d) for d in directions]
    alt = "Direction of force on a clock about the vehicle: " + "; ".join(said or ["no event"])
    out = Drawing(width, height, alt)
    centre = (0.5 * width, _TOP)
    for d in sorted(directions, key=lambda d: d.main):
        _wedge(out, centre, d)
    _clock(out, centre)
    _vehicle(out, centre, outline, point)
    for d in sorted(directions, key=lambda d: d.main):
        _arrow(out, centre, outline, point, d)
    out.circle(centre, 3.6, "#ffffff", 1.0, fill=INK)
    at = 2.0 * _TOP + 2.0
    out.circle((14.0, at), 3.6, None, fill=INK)
    name = shortened(point_name, 160.0, SMALL)
    out.text((23.0, at), f"{name}; the front is up", SMALL, _SOFT)
    if small:
        return Picture("pdof-front", out.svg(), "Direction of force", _SMALL_CAPTION, alt, 74.0)
    at += 26.0
    if not rows:
        out.text((14.0, at), "no event, no direction of force", 13.0, INK, bold=True)
    for d in rows:
        at = _numbers(out, at, d, len(directions) > 1)
    caption = (
        "Where the force came from, seen from above, in vehicle axes: 0° the front, positive "
        f"clockwise, +90° the right side. The arrow pushes at the {point_name}; wedge and numbers "
        "in brackets: 95 % interval of the direction, from the change of velocity between time "
        "zero and the end of the event along the turning axes."
    )
    return Picture("pdof", out.svg(), "Direction of force", caption, alt, width_mm=84.0)


def _at(centre: Point, radius: float, angle_deg: float) -> tuple[float, float]:
    a = math.radians(angle_deg)
    return centre[0] + radius * math.sin(a), centre[1] - radius * math.cos(a)


def _arc(centre: Point, radius: float, low: float, high: float) -> list[tuple[float, float]]:
    steps = max(2, math.ceil((high - low) / 3.0) + 1)
    return [_at(centre, radius, a) for a in np.linspace(low, high, steps).tolist()]


def _wedge(out: Drawing, centre: Point, d: Direction) -> None:
    if d.interval is None:
        return
    low, high = d.interval.low_deg, d.interval.high_deg
    inner, strong = _RING * _RADIUS, d.main
    colour = BLUE if strong else GREY
    if d.interval.undetermined:
        ring = _arc(centre, _RADIUS, 0.0, 360.0) + _arc(centre, inner, 0.0, 360.0)[::-1]
        if strong:
            out.shape(ring, None, fill=colour, opacity=0.22)
        return
    short = 0.5 * max(_LEAST_WEDGE - (high - low), 0.0)
    low, high = low - short, high + short
    if strong:
        out.shape([centre, *_arc(centre, _RADIUS, low, high)], None, fill=colour, opacity=0.16)
    ring = _arc(centre, _RADIUS, low, high) + _arc(centre, inner, low, high)[::-1]
    out.shape(ring, None, fill=colour, opacity=0.45 if strong else 0.35)


def _clock(out: Drawing, centre: Point) -> None:
    out.circle(centre, _RADIUS, "#c3cad2", 1.0)
    for angle in range(0, 360, 10):
        at_hour = angle % 30 == 0
        length = 7.0 if at_hour else 3.5
        ends = _at(centre, _RADIUS, angle), _at(centre, _RADIUS - length, angle)
        out.line(*ends, _SOFT if at_hour else "#c3cad2", 1.2 if at_hour else 0.8)
    for hour in range(1, 13):
        at = _at(centre, _RADIUS + 11.0, 30.0 * hour)
        out.text(at, str(hour), 11.5, INK, anchor="middle", bold=hour % 3 == 0)
    for angle, label in ((0, "0°"), (90, "+90°"), (180, "180°"), (-90, "−90°")):
        x, y = _at(centre, _RADIUS + 11.0, angle)
        upright = angle in (0, 180)
        place = (x + 11.0, y) if upright else (x + math.copysign(4.0, angle), y + 14.0)
        anchor = "start" if upright else "middle"
        out.text(place, label, SMALL, _SOFT, anchor=anchor)


def _scale(outline: Outline, point: Sequence[float]) -> float:
    """Pixels per meter about the point."""
    reach = np.abs(outline.body - np.asarray(point, np.float64)[:2])
    return _CAR * _RADIUS / max(float(np.hypot(*reach.T).max()), 1e-3)


def _vehicle(out: Drawing, centre: Point, outline: Outline, point: Sequence[float]) -> None:
    scale = _scale(outline, point)
    origin = np.array(centre)
    # Forward is up the page: a heading of -90 deg in axes x right, y down.
    there = outline.placed((0.0, 0.0), -90.0, point)
    pixels = Outline(
        origin + scale * there.body,
        tuple(origin + scale * w for w in there.windows),
        tuple(origin + scale * f for f in there.folds),
    )
    draw_outline(out, pixels, "#3d5166", 1.4, fill="#e9edf2")


def _arrow(
    out: Drawing, centre: Point, outline: Outline, point: Sequence[float], d: Direction
) -> None:
    if not math.isfinite(d.horizontal_deg):
        return
    edge = _scale(outline, point) * outline.edge(point, d.horizontal_deg)
    tip = min(edge + 3.0, 0.60 * _RADIUS)
    tail = (_RING - 0.01) * _RADIUS
    unsure = d.interval is not None and d.interval.undetermined
    colour = VERMILLION if d.main else ORANGE
    out.line(centre, _at(centre, tip, d.horizontal_deg), colour, 0.9, "dot")
    rim = _at(centre, tail, d.horizontal_deg), _at(centre, _RADIUS, d.horizontal_deg)
    out.line(*rim, colour, 1.4, "dash" if unsure else "solid")
    out.arrow(
        _at(centre, tail, d.horizontal_deg),
        _at(centre, tip, d.horizontal_deg),
        colour,
        4.0 if d.main and not unsure else 1.6,
        "dash" if unsure else "solid",
    )


def _clock_words(d: Direction) -> str:
    return f"{d.clock} o'clock"


def _words(d: Direction) -> str:
    angle, ends = interval_words(d.horizontal_deg, d.interval)
    if ends == "undetermined":
        return f"{d.name}: undetermined"
    around = f" ({ends})" if ends else ""
    return f"{d.name}: {angle}{around}, {_clock_words(d)}"


def _numbers(out: Drawing, at: float, d: Direction, many: bool) -> float:
    angle, ends = interval_words(d.horizontal_deg, d.interval)
    speed = f"{plain(d.delta_v, 1)} m/s ({plain(3.6 * d.delta_v, 1)} km/h)"
    if not d.main:
        out.text((14.0, at), _words(d), SMALL, _SOFT)
        out.text((14.0, at + 14.0), f"change of velocity {speed}", SMALL, _SOFT)
        return at + 33.0
    title = f"{d.name}: " if many else ""
    if ends == "undetermined":
        out.text((14.0, at), f"{title}undetermined", 17.0, INK, bold=True)
        out.text((14.0, at + 20.0), "the change of velocity is within its bound", 11.0, _SOFT)
    else:
        out.text((14.0, at), f"{title}{angle}, {_clock_words(d)}", 17.0, INK, bold=True)
        out.text((14.0, at + 20.0), f"95 %: {ends}" if ends else "", 11.5, INK)
    out.text((14.0, at + 37.0), f"change of velocity {speed}", 11.0, _SOFT)
    return at + 64.0
