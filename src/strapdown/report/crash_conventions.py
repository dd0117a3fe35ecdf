"""Picture of the axes, angles, origin and mounting points of a vehicle, in three views."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from strapdown.report.chart import AXIS_COLOURS
from strapdown.report.crash_moments import unit_look
from strapdown.report.crash_outline import Outline, draw_outline
from strapdown.report.document import Picture
from strapdown.report.svg_drawing import INK, SMALL, Drawing, shortened

__all__ = ["MountingPoint", "Project", "conventions_picture", "draw_behind", "draw_side"]


_WIDTH, _HEIGHT = 640.0, 376.0
_TOP_VIEW = (172.0, 196.0)
_SIDE_VIEW, _REAR_VIEW = (458.0, 92.0), (458.0, 272.0)
_LONG, _ACROSS = 196.0, 96.0  # pixels available to the longest side, and to the width
_CLOCK = 150.0
_SOFT, _BODY = "#4a525c", "#3d5166"
_FORWARD, _RIGHT, _DOWN = AXIS_COLOURS
_FORCE = "#882255"
_EXAMPLE = 40.0  # deg, of the example force that shows the sign of the angle


@dataclass(frozen=True)
class MountingPoint:
    """Mounting position of a unit.

    Attributes
    ----------
    name : str
    position : sequence of float, (3,), m
        Vehicle axes, from the vehicle's origin.
    number : int
        Index of the unit, from 0; sets its color.
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

    Parameters
    ----------
    outline : Outline
        In vehicle axes.
    units : sequence of MountingPoint
    point : sequence of float, (3,), m
        Reference point, in vehicle axes from the vehicle's origin.
    point_name : str

    Returns
    -------
    Picture
        The vehicle from above, from its right side and from behind, at one scale.
    """
    where = ", ".join(f"{u.name} at {_place(u.position)}" for u in units)
    alt = (
        "Vehicle axes: forward, right, down from the vehicle's origin; roll right side down, pitch "
        f"nose up, heading clockwise from above; {point_name} at {_place(point)}; {where}"
    )
    rows = -(-(2 + len(units)) // 2)
    out = Drawing(_WIDTH, _HEIGHT + 16.0 * rows + 4.0, alt)
    low, high = outline.low, outline.high
    length, width = (high - low).tolist()
    scale = min(_LONG / length, _ACROSS / width)
    middle = 0.5 * (low + high)

    def above(p: Sequence[float]) -> tuple[float, float]:
        return (
            _TOP_VIEW[0] + scale * (p[1] - float(middle[1])),
            _TOP_VIEW[1] - scale * (p[0] - float(middle[0])),
        )

    def side(p: Sequence[float]) -> tuple[float, float]:
        return _SIDE_VIEW[0] + scale * (p[0] - float(middle[0])), _SIDE_VIEW[1] + scale * p[2]

    def behind(p: Sequence[float]) -> tuple[float, float]:
        return _REAR_VIEW[0] + scale * (p[1] - float(middle[1])), _REAR_VIEW[1] + scale * p[2]

    _draw_above(out, outline, above, point)
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
    values = (f"{v:.2f}" if round(v, 2) else "0.00" for v in position)
    return "(" + ", ".join(values).replace("-", "−") + ") m"


def _draw_above(out: Drawing, outline: Outline, view: Project, point: Sequence[float]) -> None:
    def pixels(points: np.ndarray) -> np.ndarray:
        return np.array([view(p) for p in points.tolist()], dtype=np.float64)

    drawn = Outline(
        pixels(outline.body),
        tuple(pixels(w) for w in outline.windows),
        tuple(pixels(f) for f in outline.folds),
    )
    draw_outline(out, drawn, _BODY, 1.4, fill="#eef1f5", opacity=1.0)
    centre = _TOP_VIEW
    out.circle(centre, _CLOCK, "#c3cad2", 1.0)
    for hour in range(1, 13):
        ends = _polar(centre, _CLOCK, 30.0 * hour), _polar(centre, _CLOCK - 5.0, 30.0 * hour)
        out.line(*ends, _SOFT, 1.0)
        at = _polar(centre, _CLOCK + 11.0, 30.0 * hour)
        out.text(at, str(hour), 10.5, INK, anchor="middle", bold=hour % 3 == 0)
    target = view(point)
    reach = _CLOCK - 9.0
    tail = _polar(centre, reach, _EXAMPLE)
    away = math.hypot(tail[0] - target[0], tail[1] - target[1])
    share = max(0.0, 1.0 - 62.0 / away)
    tip = (tail[0] + share * (target[0] - tail[0]), tail[1] + share * (target[1] - tail[1]))
    out.line(tip, target, _FORCE, 0.9, "dot")
    out.arrow(tail, tip, _FORCE, 3.0)
    _arc(out, centre, _CLOCK - 16.0, 3.0, _EXAMPLE - 3.0, _FORCE)
    out.text((centre[0] + 26.0, centre[1] - _CLOCK + 36.0), "PDOF +", SMALL, _FORCE, halo=True)


def _axes(out: Drawing, outline: Outline, above: Project, side: Project, behind: Project) -> None:
    front, right = float(outline.high[0]), float(outline.high[1])
    x, y = above((0.0, 0.0, 0.0))
    reach = max(y - above((front, 0.0, 0.0))[1], 0.0) + 20.0
    out.arrow((x, y), (x, y - reach), _FORWARD, 2.2)
    out.text((x + 6.0, y - reach + 2.0), "x", 11.0, _FORWARD, bold=True, halo=True)
    _arc(out, (x, y), reach - 8.0, -34.0, -4.0, INK)
    out.text(_polar((x, y), reach + 2.0, -36.0), "heading +", SMALL, INK, anchor="end", halo=True)
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
    _arc(out, (x, y), reach - 8.0, 84.0, 84.0 - turn, INK)
    at = _polar((x, y), reach - 8.0, 84.0 - turn)
    out.text((at[0] + 6.0, at[1] - 4.0), "pitch +", SMALL, INK, halo=True)
    _down(out, side, (x, y))
    _through(out, (x, y), _RIGHT, True)
    x, y = behind((0.0, 0.0, 0.0))
    reach = max(behind((0.0, right, 0.0))[0] - x, 0.0) + 30.0
    out.arrow((x, y), (x + reach, y), _RIGHT, 2.2)
    out.text((x + reach + 4.0, y), "y right", SMALL, _RIGHT, bold=True, halo=True)
    # Seen from behind, the right side goes down: clockwise.
    turn = math.degrees(38.0 / reach)
    _arc(out, (x, y), reach - 8.0, 84.0 - turn, 84.0, INK)
    at = _polar((x, y), reach - 8.0, 84.0 - turn)
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
    out: Drawing, view: Project, units: Sequence[MountingPoint], point: Sequence[float]
) -> None:
    """Number the units at their positions; units at the same position share a label."""
    taken: list[tuple[float, float]] = []
    for unit in units:
        x, y = view(unit.position)
        while any(math.hypot(x - a, y - b) < 13.0 for a, b in taken):
            x += 13.5
        taken.append((x, y))
        _numbered(out, (x, y), unit)
    _target(out, view(point))


def _target(out: Drawing, at: tuple[float, float]) -> None:
    out.circle(at, 4.0, "#ffffff", 1.0, fill=INK)


def _numbered(out: Drawing, at: tuple[float, float], unit: MountingPoint) -> None:
    out.circle(at, 6.8, unit_look(unit.number)["colour"], 2.2, fill="#ffffff")
    out.text(at, str(unit.number + 1), SMALL, INK, anchor="middle", bold=True)


def _legend(
    out: Drawing, units: Sequence[MountingPoint], point: Sequence[float], point_name: str
) -> None:
    for k in range(2 + len(units)):
        x, y = 22.0 + 316.0 * (k % 2), _HEIGHT + 4.0 + 16.0 * (k // 2)
        if k == 0:
            out.circle((x, y), 6.0, _SOFT, 1.8, fill="#ffffff")
            words = "origin of the vehicle, from which positions are"
        elif k == 1:
            _target(out, (x, y))
            words = f"{shortened(point_name, 150.0, SMALL)} {_place(point)}"
        else:
            unit = units[k - 2]
            _numbered(out, (x, y), unit)
            words = f"{shortened(unit.name, 150.0, SMALL)} {_place(unit.position)}"
        out.text((x + 13.0, y), words, SMALL, INK)


def _polar(centre: tuple[float, float], radius: float, angle_deg: float) -> tuple[float, float]:
    a = math.radians(angle_deg)
    return centre[0] + radius * math.sin(a), centre[1] - radius * math.cos(a)


def _arc(
    out: Drawing,
    centre: tuple[float, float],
    radius: float,
    start_deg: float,
    end_deg: float,
    colour: str,
) -> None:
    """Draw an arc with an arrowhead at its end; angles clockwise from up."""
    angles = np.linspace(start_deg, end_deg, 24).tolist()
    points = [_polar(centre, radius, a) for a in angles]
    out.shape(points[:-3], colour, 1.5, closed=False)
    out.arrow(points[-5], points[-1], colour, 1.5)


# Side and rear views of the vehicle.


#: Maps a position in vehicle axes, m, to pixels.
Project = Callable[[Sequence[float]], tuple[float, float]]
_CRASH_SILHOUETTE_BODY = "#3d5166"
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
        out.shape(
            [view((x, 0.0, z)) for x, z in shape], _CRASH_SILHOUETTE_BODY, 1.4, fill="#eef1f5"
        )
        return

    def at(part: tuple[tuple[float, float], ...]) -> list[tuple[float, float]]:
        return [view((low + share * (high - low), 0.0, z)) for share, z in part]

    out.shape(at(_SIDE), _CRASH_SILHOUETTE_BODY, 1.4, fill="#eef1f5")
    out.shape(
        at(_SIDE_GLASS), _CRASH_SILHOUETTE_BODY, 0.6, fill=_CRASH_SILHOUETTE_BODY, opacity=0.35
    )
    for share in (0.19, 0.81):
        wheel = view((low + share * (high - low), 0.0, 0.5 - _WHEEL))
        out.circle(wheel, scale * _WHEEL, _CRASH_SILHOUETTE_BODY, 1.2, fill="#c5cdd6")


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
        out.shape(whole(_BOX), _CRASH_SILHOUETTE_BODY, 1.4, fill="#eef1f5")
        return
    for y in (-0.82, 0.82):
        x = view((0.0, middle + half * y, 0.0))[0]
        top = view((0.0, 0.0, 0.5 - 2.0 * _WHEEL))[1]
        tyre = [(x - 5.0, top), (x + 5.0, top), (x + 5.0, ground), (x - 5.0, ground)]
        out.shape(tyre, _CRASH_SILHOUETTE_BODY, 1.0, fill="#c5cdd6")
    out.shape(whole(_REAR), _CRASH_SILHOUETTE_BODY, 1.4, fill="#eef1f5")
    out.shape(
        whole(_REAR_GLASS), _CRASH_SILHOUETTE_BODY, 0.6, fill=_CRASH_SILHOUETTE_BODY, opacity=0.25
    )
