"""Clock dial of the direction of force about the vehicle, with its 95 % interval."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from strapdown.crash.pdof import AngleInterval
from strapdown.report.chart import AXIS_COLOURS, BLUE, GREY, ORANGE, VERMILLION
from strapdown.report.crash_outline import Outline, draw_outline, interval_words, unit_look
from strapdown.report.document import Picture
from strapdown.report.plan import ellipse
from strapdown.report.svg_drawing import INK, SMALL, Drawing, nice_step, shortened
from strapdown.report.values import (
    length_factor,
    length_unit,
    plain,
    speed_both,
    speed_factor,
    speed_unit,
)

_WIDTH, _SMALL_WIDTH, _RADIUS, _TOP = 330.0, 304.0, 118.0, 142.0
_CAR = 0.53  # distance of the vehicle's farthest corner, as a share of the dial's radius
_RING = 0.86  # inner edge of the interval ring, as a share of the dial's radius
Point = tuple[float, float]
_SOFT = "#4a525c"
_SMALL_CAPTION = "Principal direction of force from above: 0° the front, clockwise; wedge: 95 %."
# Smallest interval drawn, deg, to keep the stroke visible.
_LEAST_WEDGE = 1.0


@dataclass(frozen=True)
class Direction:
    """Direction of force of one event.

    `horizontal_deg`, deg: direction from which the force came, clockwise from the front.
    `interval`: the 95 % interval. `delta_v`, m/s: length of the change of velocity. `main`: drawn
    with a strong line; the others thin. `number`: index of the unit whose answer it is, from 0;
    None for the main answer. `vertical_deg`, deg: positive from above. `vertical`: its 95 %
    interval.
    """

    name: str
    horizontal_deg: float
    interval: AngleInterval | None
    clock: int
    delta_v: float
    main: bool = True
    number: int | None = None
    vertical_deg: float = math.nan
    vertical: AngleInterval | None = None


def pdof_dial(
    outline: Outline,
    directions: Sequence[Direction],
    *,
    recorders: Sequence[Direction] = (),
    point: Sequence[float] = (0.0, 0.0),
    point_name: str = "reference point",
    small: bool = False,
) -> Picture:
    """Draw directions of force about a vehicle, seen from above with its front upward.

    `outline`: in vehicle axes. `directions`: one per event, in time order. `recorders`: of the main
    event by each recorder, marked by its number. `point`, m: reference point in vehicle axes, at
    the center of the dial. `small`: draw the dial alone, for a page with the numbers beside it.
    Returns: an arrow from the origin of each force towards the point, its interval as a wedge; a
    shaded ring if the direction is undetermined.
    """
    rows = sorted(directions, key=lambda d: not d.main)
    height = 2.0 * _TOP + 26.0 + sum(64.0 if d.main else 33.0 for d in rows)
    height += 12.0 if not rows else 0.0 if len(rows) > 1 else -12.0
    width = _SMALL_WIDTH if small else _WIDTH
    if small:
        height = 2.0 * _TOP + 14.0
    height += _KEY_ROW * len(recorders) + (14.0 if recorders and not small else 0.0)
    said = [f"{d.name}: {_where(d)}" for d in (*directions, *recorders)]
    alt = "Direction of force on a clock about the vehicle: " + "; ".join(said or ["no event"])
    out = Drawing(width, height, alt)
    centre = (0.5 * width, _TOP)
    for d in sorted(directions, key=lambda d: d.main):
        _wedge(out, centre, d)
    _clock(out, centre)
    # Pixels per meter about the point.
    reach = np.abs(outline.body - np.asarray(point, np.float64)[:2])
    scale = _CAR * _RADIUS / max(float(np.hypot(*reach.T).max()), 1e-3)
    origin = np.array(centre)
    # Forward is up the page: a heading of -90 deg in axes x right, y down.
    there = outline.placed((0.0, 0.0), -90.0, point)
    pixels = there.mapped(lambda points: origin + scale * points)
    draw_outline(out, pixels, _BODY, 1.4, fill="#e9edf2")
    for d in sorted(directions, key=lambda d: d.main):
        _arrow(out, centre, scale * outline.edge(point, d.horizontal_deg), d)
    _recorders(out, centre, [(d, d.horizontal_deg, d.interval) for d in recorders])
    out.circle(centre, 3.6, "#ffffff", 1.0, fill=INK)
    at = 2.0 * _TOP + 2.0
    out.circle((14.0, at), 3.6, None, fill=INK)
    name = shortened(point_name, 160.0, SMALL)
    out.text((23.0, at), f"{name}; the front is up", SMALL, _SOFT)
    if small:
        _key(out, at + 17.0, [(d.number or 0, d.name, _where(d)) for d in recorders])
        return Picture("pdof-front", out.svg(), "Direction of force", _SMALL_CAPTION, alt, 74.0)
    at += 26.0
    if not rows:
        out.text((14.0, at), "no event, no direction of force", 13.0, INK, bold=True)
    for d in rows:
        at = _numbers(out, at, d, len(directions) > 1)
    _key(out, at, [(d.number or 0, d.name, _where(d)) for d in recorders])
    caption = (
        "Where the force came from, seen from above, in vehicle axes: 0° the front, positive "
        f"clockwise, +90° the right side. The arrow pushes at the {point_name}; wedge and numbers "
        "in brackets: 95 % interval of the direction, from the change of velocity over the contact "
        "along the turning axes."
    )
    return Picture("pdof", out.svg(), "Direction of force", caption, alt, width_mm=84.0)


# Recorders on a face: one beside another of nearly the same direction is further inside.
_KEY_ROW, _FARTHEST, _BESIDE = 29.0, 0.76, 15.0


def _recorders(
    out: Drawing, centre: Point, marks: Sequence[tuple[Direction, float, AngleInterval | None]]
) -> None:
    """Mark the direction of each recorder by its number, with its interval as an arc."""
    taken: list[Point] = []
    for d, angle, interval in marks:
        if not math.isfinite(angle) or (interval is not None and interval.undetermined):
            continue
        radius = _FARTHEST * _RADIUS
        while radius > 20.0 and any(
            math.dist(_at(centre, radius, angle), other) < _BESIDE for other in taken
        ):
            radius -= _BESIDE
        colour = unit_look(d.number)["colour"]
        if interval is not None:
            arc = _arc(centre, radius, interval.low_deg, interval.high_deg)
            out.shape(arc, colour, 1.6, closed=False)
        at = _at(centre, radius, angle)
        taken.append(at)
        _numbered(out, at, d.number or 0)


def _key(out: Drawing, at: float, rows: Iterable[tuple[int, str, str]]) -> None:
    """List the recorders below a drawing: their numbers, names and what is said of each."""
    for number, name, words in rows:
        _numbered(out, (14.0, at + 6.0), number)
        out.text((25.0, at), shortened(name, out.width - 30.0, SMALL), SMALL, INK)
        out.text((25.0, at + 12.0), shortened(words, out.width - 30.0, SMALL), SMALL, _SOFT)
        at += _KEY_ROW


def elevation_dial(
    outline: Outline, main: Direction, recorders: Sequence[Direction] = ()
) -> Picture:
    """Draw the vertical angle of a force in its own vertical plane.

    `outline`: in vehicle axes; drawn from the right for a force from the front or the rear, and
    from behind for one from a side. `recorders`: of the same event, marked by their numbers.
    Returns: the angle above the horizontal, with its 95 % interval as a wedge.
    """
    angle = math.remainder(main.horizontal_deg, 360.0)
    aside = 45.0 < abs(angle) < 135.0
    # From the right of the picture: the front from the right side, the right from behind.
    sign = 1.0 if (angle > 0.0 if aside else abs(angle) <= 45.0) else -1.0
    words = _elevation_words(main)
    alt = f"Vertical angle of the force: {words}"
    alt += "".join(f"; {d.name}: {_elevation_words(d)}" for d in recorders)
    height = 2.0 * _TOP + 52.0 + _KEY_ROW * len(recorders)
    out = Drawing(_WIDTH, height, alt)
    centre = (0.5 * _WIDTH, _TOP)
    low, high = outline.low, outline.high
    scale = _CAR * _RADIUS / (0.5 * float((high - low)[1 if aside else 0]))

    def view(p: Sequence[float]) -> tuple[float, float]:
        middle = 0.5 * (low + high)
        across = p[1] - float(middle[1]) if aside else p[0] - float(middle[0])
        return centre[0] + scale * across, centre[1] + scale * (p[2] + 0.2)

    def turned(elevation: float) -> float:
        """Clock angle of the picture at which an elevation is drawn."""
        return sign * (90.0 - elevation)

    (draw_behind(out, outline, view) if aside else draw_side(out, outline, view, scale))
    interval = main.vertical
    unsure = interval is None or interval.undetermined
    if interval is not None and not unsure:
        ends = sorted((turned(interval.low_deg), turned(interval.high_deg)))
        wedge = [centre, *_arc(centre, _RADIUS, *ends)]
        out.shape(wedge, None, fill=BLUE, opacity=0.18)
    arc = sorted((turned(-90.0), turned(90.0)))
    out.shape(_arc(centre, _RADIUS, *arc), "#c3cad2", 1.0, closed=False)
    for elevation in range(-90, 91, 10):
        long = elevation % 30 == 0
        rim = _at(centre, _RADIUS - (7.0 if long else 3.5), turned(elevation))
        out.line(_at(centre, _RADIUS, turned(elevation)), rim, _SOFT if long else "#c3cad2")
        if long:
            at = _at(centre, _RADIUS + 14.0, turned(elevation))
            out.text(at, f"{plain(elevation, 0)}°", SMALL, _SOFT, anchor="middle")
    out.line(centre, _at(centre, _RADIUS, turned(0.0)), "#c3cad2", 1.0, "dash")
    if math.isfinite(main.vertical_deg):
        there = turned(main.vertical_deg)
        tail, tip = (_at(centre, share * _RADIUS, there) for share in (0.85, 0.15))
        out.arrow(tail, tip, VERMILLION, 4.0)
    _recorders(
        out,
        centre,
        [(d, turned(d.vertical_deg), _mirrored(d.vertical, turned)) for d in recorders],
    )
    side = ("right" if sign > 0.0 else "left") if aside else ("front" if sign > 0.0 else "rear")
    seen = "from behind" if aside else "from the right"
    where = f"seen {seen}; the {side} is on the {'right' if sign > 0.0 else 'left'}"
    out.text((14.0, 2.0 * _TOP + 2.0), where, SMALL, _SOFT)
    out.text((14.0, 2.0 * _TOP + 22.0), words, 15.0, INK, bold=True)
    rows = [(d.number or 0, d.name, _elevation_words(d)) for d in recorders]
    _key(out, 2.0 * _TOP + 46.0, rows)
    caption = (
        "Vertical angle of the force in the axes of the vehicle, in the vertical plane of its "
        "horizontal direction: 0° level, positive from above; wedge and brackets: 95 %."
    )
    return Picture("pdof-elevation", out.svg(), "Elevation of the force", caption, alt, 84.0)


def _mirrored(
    interval: AngleInterval | None, turned: Callable[[float], float]
) -> AngleInterval | None:
    if interval is None or interval.undetermined:
        return interval
    low, high = sorted((turned(interval.low_deg), turned(interval.high_deg)))
    return AngleInterval(low, high)


def _elevation_words(d: Direction) -> str:
    if d.vertical is None or d.vertical.undetermined or not math.isfinite(d.vertical_deg):
        return "undetermined"
    ends = f"{plain(d.vertical.low_deg, 1)}° to {plain(d.vertical.high_deg, 1)}°"
    above = "from above" if d.vertical_deg > 0.0 else "from below"
    return f"{plain(d.vertical_deg, 1)}° ({ends}), {above}"


@dataclass(frozen=True)
class PointChange:
    """Change of velocity at a measuring point.

    `delta_v`, (3,), m/s: at the point itself, along the axes of the vehicle. `covariance`, (3, 3).
    `at_least`: the record holds a part only.
    """

    unit: MountingPoint
    delta_v: tuple[float, float, float]
    covariance: np.ndarray
    at_least: bool = False


# Pixels of the vehicle's longer side, and of the largest change beside it.
_POINTS_CAR, _POINTS_ARROW = 210.0, 96.0


def points_picture(outline: Outline, changes: Sequence[PointChange]) -> Picture:
    """Draw the measuring points on the vehicle, each with its change of velocity as an arrow.

    `outline`: in vehicle axes, drawn with its front upward. Returns: arrows at one scale, with the
    95 % ellipse of each at its tip; numbers below.
    """
    low, high = outline.low, outline.high
    scale = _POINTS_CAR / float(max(high - low))
    sizes = [math.hypot(*one.delta_v[:2]) for one in changes]
    per = _POINTS_ARROW / max(*sizes, 1e-3, 1e-3)
    middle = 0.5 * (low + high)
    half = 0.5 * scale * float((high - low)[0])
    # Above and below the vehicle as far as an arrow reaches, with room for its ellipse.
    tips = [
        -scale * (one.unit.position[0] - float(middle[0])) - per * one.delta_v[0] for one in changes
    ]
    top, bottom = max(half, -min(tips) + 20.0) + 8.0, max(half, *tips, 0.0) + 28.0
    centre = (0.5 * _WIDTH, top)
    told = [_change_words(one) for one in changes]
    alt = "Change of velocity at the measuring points: "
    alt += "; ".join(f"{name}: {words}" for name, words in told)
    out = Drawing(_WIDTH, top + bottom + _KEY_ROW * len(changes) + 28.0, alt)
    above = _from_above(out, outline, centre, scale)
    for one in changes:
        x, y = above(one.unit.position)
        tip = (x + per * one.delta_v[1], y - per * one.delta_v[0])
        colour = unit_look(one.unit.number)["colour"]
        # Right and up of the picture, from forward and right.
        turn = per * np.array([[0.0, 1.0], [-1.0, 0.0]])
        around = ellipse(np.array(tip), turn @ one.covariance[:2, :2] @ turn.T)
        out.shape(around, colour, 0.8, fill=colour, opacity=0.14)
        out.arrow((x, y), tip, colour, 2.6)
    _points(out, above, [one.unit for one in changes], None)
    at = top + bottom + 18.0
    step = nice_step(0.35 * _POINTS_ARROW * speed_factor() / per)
    length = per * step / speed_factor()
    out.line((20.0, at - 14.0), (20.0 + length, at - 14.0), INK, 2.0)
    out.text((26.0 + length, at - 14.0), f"{step:g} {speed_unit()}", SMALL, INK)
    rows = zip((one.unit.number for one in changes), *zip(*told, strict=True), strict=True)
    _key(out, at + 8.0, rows)
    caption = (
        "The vehicle from above with its measuring points. Arrows: change of velocity over the "
        "contact at each point itself, along the axes of the vehicle, with its 95 % ellipse. "
        "Points of a vehicle that turns do not gain the same."
    )
    return Picture("measuring-points", out.svg(), "Measuring points", caption, alt, 84.0)


def _change_words(one: PointChange) -> tuple[str, str]:
    x, y, z = (speed_factor() * v for v in one.delta_v)
    least = "at least " if one.at_least else ""
    size = plain(math.sqrt(x * x + y * y + z * z), 1)
    parts = ", ".join(plain(v, 1) for v in (x, y, z))
    words = f"{least}{size} {speed_unit()}; forward, right, down {parts}"
    return f"{one.unit.name} {_place(one.unit.position)}", words


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


def _arrow(out: Drawing, centre: Point, edge: float, d: Direction) -> None:
    """Draw a force to the vehicle's `edge`, pixels from the center."""
    if not math.isfinite(d.horizontal_deg):
        return
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


def _where(d: Direction) -> str:
    angle, ends = interval_words(d.horizontal_deg, d.interval)
    if ends == "undetermined":
        return "undetermined"
    around = f" ({ends})" if ends else ""
    return f"{angle}{around}, {d.clock} o'clock"


def _numbers(out: Drawing, at: float, d: Direction, many: bool) -> float:
    angle, ends = interval_words(d.horizontal_deg, d.interval)
    speed = speed_both(d.delta_v)
    if not d.main:
        out.text((14.0, at), f"{d.name}: {_where(d)}", SMALL, _SOFT)
        out.text((14.0, at + 14.0), f"change of velocity {speed}", SMALL, _SOFT)
        return at + 33.0
    title = f"{d.name}: " if many else ""
    if ends == "undetermined":
        out.text((14.0, at), f"{title}undetermined", 17.0, INK, bold=True)
        out.text((14.0, at + 20.0), "the change of velocity is within its bound", 11.0, _SOFT)
    else:
        out.text((14.0, at), f"{title}{angle}, {d.clock} o'clock", 17.0, INK, bold=True)
        out.text((14.0, at + 20.0), f"95 %: {ends}" if ends else "", 11.5, INK)
    out.text((14.0, at + 37.0), f"change of velocity {speed}", 11.0, _SOFT)
    return at + 64.0


# Picture of the axes, angles, origin and mounting points of a vehicle, in three views.


_PICTURE_WIDTH, _HEIGHT = 640.0, 376.0
_TOP_VIEW = (172.0, 196.0)
_SIDE_VIEW, _REAR_VIEW = (458.0, 92.0), (458.0, 272.0)
_LONG, _ACROSS = 196.0, 96.0  # pixels available to the longest side, and to the width
_CLOCK = 150.0
_BODY = "#3d5166"
_FORWARD, _RIGHT, _DOWN = AXIS_COLOURS
_FORCE = "#882255"
_EXAMPLE = 40.0  # deg, of the example force that shows the sign of the angle


@dataclass(frozen=True)
class MountingPoint:
    """Mounting position of a unit.

    `position`, (3,), m: vehicle axes, from the vehicle's origin. `number`: index of the unit, from
    0; sets its color.
    """

    name: str
    position: tuple[float, float, float]
    number: int


def conventions_picture(
    outline: Outline,
    units: Sequence[MountingPoint],
    *,
    point: Sequence[float] = (0.0, 0.0, 0.0),
    point_name: str = "reference point",
) -> Picture:
    """Draw the sign conventions of axes, roll, pitch, heading and direction of force.

    `outline`: in vehicle axes. `point`, (3,), m: reference point, in vehicle axes from the
    vehicle's origin. Returns: the vehicle from above, from its right side and from behind, at one
    scale.
    """
    where = ", ".join(f"{u.name} at {_place(u.position)}" for u in units)
    alt = (
        "Vehicle axes: forward, right, down from the vehicle's origin; roll right side down, pitch "
        f"nose up, heading clockwise from above; {point_name} at {_place(point)}; {where}"
    )
    rows = -(-(2 + len(units)) // 2)
    out = Drawing(_PICTURE_WIDTH, _HEIGHT + 16.0 * rows + 4.0, alt)
    low, high = outline.low, outline.high
    length, width = (high - low).tolist()
    scale = min(_LONG / length, _ACROSS / width)
    middle = 0.5 * (low + high)

    def side(p: Sequence[float]) -> tuple[float, float]:
        return _SIDE_VIEW[0] + scale * (p[0] - float(middle[0])), _SIDE_VIEW[1] + scale * p[2]

    def behind(p: Sequence[float]) -> tuple[float, float]:
        return _REAR_VIEW[0] + scale * (p[1] - float(middle[1])), _REAR_VIEW[1] + scale * p[2]

    above = _from_above(out, outline, _TOP_VIEW, scale)
    _draw_clock(out, above(point))
    draw_side(out, outline, side, scale)
    draw_behind(out, outline, behind)
    for words, x, y in (
        ("from above", 14.0, 12.0),
        ("from the right", 348.0, 12.0),
        ("from behind", 348.0, 198.0),
    ):
        out.text((x, y), words, 12.0, INK, bold=True)
    _axes(out, outline, above, side, behind)
    for view in (above, side, behind):
        _points(out, view, units, point)
    _legend(out, units, point, point_name)
    caption = (
        "Vehicle axes: x forward, y right, z down, from the vehicle's origin (ring), which all "
        "positions share. Positive: roll right side down, pitch nose up, heading clockwise from "
        "above. The direction of force is where it came from: 0° the front, positive clockwise, "
        "12 o'clock the front, 3 the right. Positions are forward, right, down from the origin; "
        "a ring with a point is an axis towards the eye, one with a cross away from it."
    )
    return Picture("conventions", out.svg(), "Axes and signs", caption, alt)


def _place(position: Sequence[float]) -> str:
    scaled = (length_factor() * v for v in position)
    values = (f"{v:.2f}" if round(v, 2) else "0.00" for v in scaled)
    return "(" + ", ".join(values).replace("-", "−") + f") {length_unit()}"


def _from_above(out: Drawing, outline: Outline, centre: Point, scale: float) -> Project:
    """Draw a vehicle from above, its front upward, in pixels per m; return where positions are."""
    middle = 0.5 * (outline.low + outline.high)

    def above(p: Sequence[float]) -> tuple[float, float]:
        return (
            centre[0] + scale * (p[1] - float(middle[1])),
            centre[1] - scale * (p[0] - float(middle[0])),
        )

    def pixels(points: np.ndarray) -> np.ndarray:
        return np.array([above(p) for p in points.tolist()], dtype=np.float64)

    draw_outline(out, outline.mapped(pixels), _BODY, 1.4, fill="#eef1f5", opacity=1.0)
    return above


def _draw_clock(out: Drawing, target: Point) -> None:
    """Draw the clock of the direction of force, with an example that pushes at a point."""
    centre = _TOP_VIEW
    out.circle(centre, _CLOCK, "#c3cad2", 1.0)
    for hour in range(1, 13):
        ends = _at(centre, _CLOCK, 30.0 * hour), _at(centre, _CLOCK - 5.0, 30.0 * hour)
        out.line(*ends, _SOFT, 1.0)
        at = _at(centre, _CLOCK + 11.0, 30.0 * hour)
        out.text(at, str(hour), 10.5, INK, anchor="middle", bold=hour % 3 == 0)
    reach = _CLOCK - 9.0
    tail = _at(centre, reach, _EXAMPLE)
    away = math.hypot(tail[0] - target[0], tail[1] - target[1])
    share = max(0.0, 1.0 - 62.0 / away)
    tip = (tail[0] + share * (target[0] - tail[0]), tail[1] + share * (target[1] - tail[1]))
    out.line(tip, target, _FORCE, 0.9, "dot")
    out.arrow(tail, tip, _FORCE, 3.0)
    _turn_arrow(out, centre, _CLOCK - 16.0, 3.0, _EXAMPLE - 3.0, _FORCE)
    out.text((centre[0] + 26.0, centre[1] - _CLOCK + 36.0), "PDOF +", SMALL, _FORCE, halo=True)


def _axes(out: Drawing, outline: Outline, above: Project, side: Project, behind: Project) -> None:
    front, right = float(outline.high[0]), float(outline.high[1])
    x, y = above((0.0, 0.0, 0.0))
    reach = max(y - above((front, 0.0, 0.0))[1], 0.0) + 20.0
    out.arrow((x, y), (x, y - reach), _FORWARD, 2.2)
    out.text((x + 6.0, y - reach + 2.0), "x", 11.0, _FORWARD, bold=True, halo=True)
    _turn_arrow(out, (x, y), reach - 8.0, -34.0, -4.0, INK)
    out.text(_at((x, y), reach + 2.0, -36.0), "heading +", SMALL, INK, anchor="end", halo=True)
    wide = max(above((0.0, right, 0.0))[0] - x, 0.0) + 26.0
    out.arrow((x, y), (x + wide, y), _RIGHT, 2.2)
    out.text((x + wide + 4.0, y), "y right", SMALL, _RIGHT, bold=True, halo=True)
    _through(out, (x, y), _DOWN, False)
    x, y = side((0.0, 0.0, 0.0))
    reach = max(side((front, 0.0, 0.0))[0] - x, 0.0) + 24.0
    out.arrow((x, y), (x + reach, y), _FORWARD, 2.2)
    out.text((x + reach + 4.0, y), "x forward", SMALL, _FORWARD, bold=True, halo=True)
    # Seen from the right, with the nose on the right, a nose-up pitch is counterclockwise.
    turn = math.degrees(34.0 / reach)
    _turn_arrow(out, (x, y), reach - 8.0, 84.0, 84.0 - turn, INK)
    at = _at((x, y), reach - 8.0, 84.0 - turn)
    out.text((at[0] + 6.0, at[1] - 4.0), "pitch +", SMALL, INK, halo=True)
    _down(out, side, (x, y))
    _through(out, (x, y), _RIGHT, True)
    x, y = behind((0.0, 0.0, 0.0))
    reach = max(behind((0.0, right, 0.0))[0] - x, 0.0) + 30.0
    out.arrow((x, y), (x + reach, y), _RIGHT, 2.2)
    out.text((x + reach + 4.0, y), "y right", SMALL, _RIGHT, bold=True, halo=True)
    # Seen from behind, the right side goes down: clockwise.
    turn = math.degrees(38.0 / reach)
    _turn_arrow(out, (x, y), reach - 8.0, 84.0 - turn, 84.0, INK)
    at = _at((x, y), reach - 8.0, 84.0 - turn)
    out.text((at[0] + 6.0, at[1] - 4.0), "roll +", SMALL, INK, halo=True)
    _down(out, behind, (x, y))
    _through(out, (x, y), _FORWARD, False)


def _down(out: Drawing, view: Project, origin: tuple[float, float]) -> None:
    ground = max(view((0.0, 0.0, 0.5))[1], origin[1])
    out.arrow(origin, (origin[0], ground + 24.0), _DOWN, 2.2)
    out.text((origin[0] + 7.0, ground + 19.0), "z down", SMALL, _DOWN, bold=True, halo=True)


def _through(out: Drawing, at: tuple[float, float], colour: str, towards: bool) -> None:
    """Draw an axis through the page: a dot towards the viewer, a cross away from the viewer."""
    out.circle(at, 7.0, colour, 1.8, fill="#ffffff")
    if towards:
        out.circle(at, 2.0, None, fill=colour)
        return
    for s in (-1.0, 1.0):
        out.line((at[0] - 4.6, at[1] - 4.6 * s), (at[0] + 4.6, at[1] + 4.6 * s), colour, 1.6)


def _points(
    out: Drawing,
    view: Project,
    units: Sequence[MountingPoint],
    point: Sequence[float] | None,
) -> None:
    """Number the units at their positions; units at the same position share a label."""
    taken: list[tuple[float, float]] = []
    for unit in units:
        x, y = view(unit.position)
        while any(math.hypot(x - a, y - b) < 13.0 for a, b in taken):
            x += 13.5
        taken.append((x, y))
        _numbered(out, (x, y), unit.number)
    if point is not None:
        out.circle(view(point), 4.0, "#ffffff", 1.0, fill=INK)


def _numbered(out: Drawing, at: tuple[float, float], number: int) -> None:
    out.circle(at, 6.8, unit_look(number)["colour"], 2.2, fill="#ffffff")
    out.text(at, str(number + 1), SMALL, INK, anchor="middle", bold=True)


def _legend(
    out: Drawing, units: Sequence[MountingPoint], point: Sequence[float], point_name: str
) -> None:
    for k in range(2 + len(units)):
        x, y = 22.0 + 316.0 * (k % 2), _HEIGHT + 4.0 + 16.0 * (k // 2)
        if k == 0:
            out.circle((x, y), 6.0, _SOFT, 1.8, fill="#ffffff")
            words = "origin of the vehicle, from which positions are"
        elif k == 1:
            out.circle((x, y), 4.0, "#ffffff", 1.0, fill=INK)
            words = f"{shortened(point_name, 150.0, SMALL)} {_place(point)}"
        else:
            unit = units[k - 2]
            _numbered(out, (x, y), unit.number)
            words = f"{shortened(unit.name, 150.0, SMALL)} {_place(unit.position)}"
        out.text((x + 13.0, y), words, SMALL, INK)


def _turn_arrow(
    out: Drawing,
    centre: tuple[float, float],
    radius: float,
    start_deg: float,
    end_deg: float,
    colour: str,
) -> None:
    """Draw an arc with an arrowhead at its end; angles clockwise from up."""
    angles = np.linspace(start_deg, end_deg, 24).tolist()
    points = [_at(centre, radius, a) for a in angles]
    out.shape(points[:-3], colour, 1.5, closed=False)
    out.arrow(points[-5], points[-1], colour, 1.5)


# Side and rear views of the vehicle.


#: Maps a position in vehicle axes, m, to pixels.
Project = Callable[[Sequence[float]], tuple[float, float]]
# Generic car from its side, along its length (0 the rear) and down from its origin, m; from
# behind, in half widths.
_SIDE = (
    *((0.0, 0.30), (0.0, -0.22), (0.03, -0.33), (0.13, -0.39), (0.24, -0.91), (0.30, -0.95)),
    *((0.50, -0.95), (0.56, -0.92), (0.70, -0.37), (0.93, -0.24), (0.99, -0.10), (1.0, 0.08)),
    (1.0, 0.30),
)
_SIDE_GLASS = ((0.185, -0.42), (0.265, -0.84), (0.545, -0.84), (0.655, -0.42))
_REAR = ((1.0, 0.30), (1.0, -0.25), (0.95, -0.38), (0.74, -0.90), (0.62, -0.95))
_REAR_GLASS = ((0.84, -0.42), (0.68, -0.82))
_BOX = ((1.0, 0.50), (1.0, -0.95))
_WHEEL = 0.31  # m


def draw_side(out: Drawing, outline: Outline, view: Project, scale: float) -> None:
    """Draw a vehicle from its right side: `view` maps positions to pixels, `scale` is pixels/m."""
    low, high = float(outline.low[0]), float(outline.high[0])
    ground = view((low, 0.0, 0.5))[1]
    out.line(
        (view((low, 0, 0))[0] - 22.0, ground), (view((high, 0, 0))[0] + 22.0, ground), "#c3cad2"
    )
    if outline.stated:
        shape = [(low, z) for _, z in _BOX] + [(high, z) for _, z in reversed(_BOX)]
        out.shape([view((x, 0.0, z)) for x, z in shape], _BODY, 1.4, fill="#eef1f5")
        return

    def at(part: tuple[tuple[float, float], ...]) -> list[tuple[float, float]]:
        return [view((low + share * (high - low), 0.0, z)) for share, z in part]

    out.shape(at(_SIDE), _BODY, 1.4, fill="#eef1f5")
    out.shape(at(_SIDE_GLASS), _BODY, 0.6, fill=_BODY, opacity=0.35)
    for share in (0.19, 0.81):
        wheel = view((low + share * (high - low), 0.0, 0.5 - _WHEEL))
        out.circle(wheel, scale * _WHEEL, _BODY, 1.2, fill="#c5cdd6")


def draw_behind(out: Drawing, outline: Outline, view: Project) -> None:
    """Draw a vehicle from behind; `view` maps positions to pixels."""
    middle = 0.5 * float(outline.low[1] + outline.high[1])
    half = 0.5 * float(outline.high[1] - outline.low[1])
    ground = view((0.0, 0.0, 0.5))[1]
    ends = (view((0, middle - half, 0))[0] - 40.0, view((0, middle + half, 0))[0] + 40.0)
    out.line((ends[0], ground), (ends[1], ground), "#c3cad2")

    def whole(part: tuple[tuple[float, float], ...]) -> list[tuple[float, float]]:
        both = [*part, *((-y, z) for y, z in reversed(part))]
        return [view((0.0, middle + half * y, z)) for y, z in both]

    if outline.stated:
        out.shape(whole(_BOX), _BODY, 1.4, fill="#eef1f5")
        return
    for y in (-0.82, 0.82):
        x = view((0.0, middle + half * y, 0.0))[0]
        top = view((0.0, 0.0, 0.5 - 2.0 * _WHEEL))[1]
        tire = [(x - 5.0, top), (x + 5.0, top), (x + 5.0, ground), (x - 5.0, ground)]
        out.shape(tire, _BODY, 1.0, fill="#c5cdd6")
    out.shape(whole(_REAR), _BODY, 1.4, fill="#eef1f5")
    out.shape(whole(_REAR_GLASS), _BODY, 0.6, fill=_BODY, opacity=0.25)
