"""Plan of the reference point's path with its bound and the vehicle at a few instants."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from strapdown import rotation
from strapdown.constants import Array
from strapdown.crash.events import CrashEvent
from strapdown.crash.path import PLACE, CrashPath
from strapdown.report.chart import BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, VERMILLION
from strapdown.report.crash_outline import Outline, draw_outline, path_moments
from strapdown.report.document import Animation, Picture
from strapdown.report.plan import envelope, hull
from strapdown.report.scene import Scene, SceneBody, SceneLine, SceneWord
from strapdown.report.svg_drawing import (
    INK,
    SMALL,
    Box,
    Drawing,
    nice_step,
    number,
    text_width,
    tick_words,
)
from strapdown.report.values import SHOWN, plain, speed_both, speed_words
from strapdown.tables import NED

_WIDTH, _SMALL_WIDTH, _LEFT, _TOP = 640.0, 370.0, 58.0, 12.0
_HEIGHTS = (170.0, 380.0)
_UNDER = 36.0  # ticks and name of the axis
_ENLARGED = 270.0  # width of the second view
# A path shorter than this share of the vehicle's length is also drawn enlarged.
_SHORT = 0.6
_BAND, _BAND_EDGE = "#d3e8f6", SKY
_LOOKS = (
    *((BLUE, "solid"), (GREEN, "dash"), (PURPLE, "solid"), (ORANGE, "dash")),
    *(("#882255", "solid"), ("#7f6000", "dash")),
)
_ARROW = 44.0  # pixels
_SMALL_CAPTION = "The vehicle at the named instants, in m from its position at the entry."
_SLOW, _EVERY = 0.05, 0.1  # m/s, slower entries have no arrow; s between dots


@dataclass(frozen=True, eq=False)
class _Moment:
    name: str
    at: float
    place: Array
    heading_deg: float
    colour: str
    dash: str


@dataclass(frozen=True, eq=False)
class _Plan:
    path: CrashPath
    places: Array
    areas: list[Array]
    moments: list[_Moment]
    reference: Array | None
    lines: list[Array]


def path_plan(
    path: CrashPath,
    outline: Outline,
    *,
    events: Sequence[CrashEvent] = (),
    point: Sequence[float] = (0.0, 0.0),
    names: tuple[str, str] = ("forward", "right"),
    reference: pd.DataFrame | None = None,
    reference_name: str = "reference",
    small: bool = False,
) -> Picture:
    """Draw a path from above.

    `outline`: in vehicle axes. `point`, m: reference point of the path, in vehicle axes. `names`:
    of the first two axes of the path. `reference`: ``north east`` of the point in the axes of the
    path, m, indexed by time. `small`: draw for half a page width, with letters as large as at the
    whole width. A path short against the vehicle is also drawn enlarged, if the width permits.
    """
    plan = _plan(path, events, reference)
    whole = _SMALL_WIDTH if small else _WIDTH
    cars = [outline.placed(m.place, m.heading_deg, point) for m in plan.moments]
    short = not small and float(np.ptp(np.vstack(plan.areas), axis=0).max()) < _SHORT * float(
        np.ptp(outline.body, axis=0).max()
    )
    width = whole - _LEFT - 8.0 - (_ENLARGED + 62.0 if short else 0.0)
    points = np.vstack([*plan.areas, *(c.body for c in cars), *plan.lines])
    tail = np.empty((0, 2))
    for _ in range(3):
        view = PlanFrame.of(np.vstack([points, tail]), names, (_LEFT, _TOP), width, _HEIGHTS)
        arrow = _entry_arrow(plan, outline, point, view.scale)
        tail = np.empty((0, 2)) if arrow is None else arrow
    beside = None
    if short:
        heights = (view.height, max(view.height, 0.7 * _ENLARGED))
        near = np.vstack([*plan.areas, *plan.lines])
        left = _LEFT + width + 62.0
        beside = PlanFrame.of(near, names, (left, _TOP), _ENLARGED, heights, 22.0)
        view = replace(view, height=beside.height)
    legend = _legend_rows(plan, reference_name, whole)
    bottom = _TOP + view.height + _UNDER
    end = path.table[NED].iloc[-1]
    alt = (
        f"Path of the reference point from above: it ends {plain(float(end['north']), 2)} m "
        f"{names[0]}, {plain(float(end['east']), 2)} m {names[1]} of its position at the entry"
    )
    out = Drawing(whole, bottom + 17.0 * len(legend) + 4.0, alt)
    view.draw_grid(out)
    _draw_band(out, view, plan)
    for k, (moment, car) in enumerate(zip(plan.moments, cars, strict=True)):
        last = k == len(cars) - 1
        draw_outline(
            out,
            car.mapped(view.pixels),
            moment.colour,
            1.5 if last else 1.2,
            moment.dash,
            fill="#5b6570" if last else None,
            opacity=0.06,
            details=last,
        )
    _draw_path(out, view, plan, beside is not None)
    view.draw_bar(out)
    if arrow is not None:
        tail_at, tip = view.pixels(arrow)
        out.arrow(tail_at.tolist(), tip.tolist(), VERMILLION, 2.6)
        middle = (0.5 * (tail_at + tip)).tolist()
        bodies = [_box(view.pixels(car.body)) for car in cars]
        words = speed_words(math.hypot(*path.entry.velocity[:2]), SHOWN.get().beside)
        out.label(middle, words, 10.5, VERMILLION, away=9.0, avoid=bodies)
    if beside is not None:
        beside.draw_grid(out)
        _draw_band(out, beside, plan)
        _draw_path(out, beside, plan, False)
        beside.draw_bar(out)
        line = beside.pixels(plan.places)
        avoid = [_box(line[k : k + 2], 4.0) for k in range(0, len(line) - 1, 2)]
        for moment in plan.moments:
            at = beside.pixels(moment.place)[0].tolist()
            out.label(at, moment.name, SMALL, INK, away=9.0, avoid=avoid)
        told = f"the path alone, {beside.scale / view.scale:.2g} times larger"
        out.text((beside.left + 5.0, _TOP + 9.0), told, SMALL, "#4a525c", halo=True)
    _draw_legend(out, legend, bottom + 8.0)
    if small:
        return Picture("path-front", out.svg(), "Path from above", _SMALL_CAPTION, alt, 92.0)
    axes = (
        "north up" if names[0] == "north" else "axes forward and right of the vehicle at the entry"
    )
    return Picture(
        "path",
        out.svg(),
        "Path from above",
        f"Path of the reference point from above, {axes}, in m from its position at the entry; "
        "equal scales. Shaded: 95 % ellipses along the path; they grow from the entry, where the "
        "position is zero by definition. Outlines: the vehicle at the named instants, turned by "
        "its heading. Dots every 100 ms." + (" Right: the path alone, enlarged." if short else ""),
        alt,
    )


def _plan(path: CrashPath, events: Sequence[CrashEvent], reference: pd.DataFrame | None) -> _Plan:
    places = path.table[NED[:2]].to_numpy(dtype=np.float64)
    block = path.covariance[:, PLACE, PLACE][:, :2, :2]
    course = np.unwrap(path.table["heading"].to_numpy(dtype=np.float64), period=360.0)
    moments = []
    named = path_moments(path, events)
    between = iter(_LOOKS * (1 + len(named) // len(_LOOKS)))
    for k, (name, at) in enumerate(named):
        if name == "begin":
            continue
        place = np.array([np.interp(at, path.time, places[:, j]) for j in (0, 1)])
        heading = float(np.interp(at, path.time, course))
        colour, dash = (INK, "solid") if k == len(named) - 1 else next(between)
        moments.append(_Moment(name, at, place, heading, colour, dash))
    given = None if reference is None else reference[NED[:2]].to_numpy(dtype=np.float64)
    lines = [places] if given is None else [places, given]
    return _Plan(path, places, envelope(places, block), moments, given, lines)


def _box(points: Array, rim: float = 0.0) -> Box:
    (x0, y0), (x1, y1) = points.min(axis=0).tolist(), points.max(axis=0).tolist()
    return x0 - rim, y0 - rim, x1 + rim, y1 + rim


def _entry_arrow(
    plan: _Plan, outline: Outline, point: Sequence[float], scale: float
) -> Array | None:
    """Tail and tip of the arrow of the entry, behind the vehicle, m."""
    velocity = np.array(plan.path.entry.velocity[:2])
    speed = float(np.hypot(*velocity))
    if speed < _SLOW:
        return None
    ahead = velocity / speed
    at = plan.path.entry.time
    place = np.array([np.interp(at, plan.path.time, plan.places[:, j]) for j in (0, 1)])
    behind = math.degrees(math.atan2(-ahead[1], -ahead[0])) - plan.path.entry.heading_deg
    tip = place - ahead * (outline.edge(point, behind) + 5.0 / scale)
    return np.vstack([tip - ahead * _ARROW / scale, tip])


def _draw_band(out: Drawing, view: PlanFrame, plan: _Plan) -> None:
    """Draw the outer edge of all areas: first each with its edge, then all insides over it."""
    areas = [view.pixels(area) for area in plan.areas]
    for area in areas:
        out.shape(area, _BAND_EDGE, 1.6, fill=_BAND)
    for area in areas:
        out.shape(area, _BAND, 0.4, fill=_BAND)


def _draw_path(out: Drawing, view: PlanFrame, plan: _Plan, faint: bool) -> None:
    if plan.reference is not None:
        out.shape(view.pixels(plan.reference), VERMILLION, 1.6, "dash", closed=False)
    pixels = view.pixels(plan.places)
    keep = np.unique(np.linspace(0, len(pixels) - 1, min(len(pixels), 400)).astype(int))
    out.shape(pixels[keep], INK, 1.4 if faint else 2.0, closed=False)
    time = plan.path.time
    dots = np.arange(math.ceil(time[0] / _EVERY - 1e-6), math.floor(time[-1] / _EVERY + 1e-6) + 1)
    if not faint:
        for at in (_EVERY * dots).tolist():
            place = [np.interp(at, time, plan.places[:, j]) for j in (0, 1)]
            out.circle(view.pixels(place)[0].tolist(), 1.9, "#ffffff", 0.7, fill=INK)
    for moment in plan.moments:
        at = view.pixels(moment.place)[0].tolist()
        out.circle(at, 2.6 if faint else 4.2, "#ffffff", 1.0, fill=moment.colour)


def _legend_rows(
    plan: _Plan, reference_name: str, width: float
) -> list[list[tuple[float, str, str, str]]]:
    """Rows of legend entries: position from the left, kind, color, text."""
    speed = math.hypot(*plan.path.entry.velocity[:2])
    told = speed_both(speed) if speed >= _SLOW else "at rest"
    entries = [
        ("path", INK, "path of the reference point"),
        ("band", _BAND_EDGE, "95 % bound"),
        ("arrow", VERMILLION, f"entry {told}"),
    ]
    if plan.reference is not None:
        entries.append(("dash", VERMILLION, reference_name))
    for m in plan.moments:
        kind = f"moment {m.dash}"
        entries.append((kind, m.colour, f"{m.name}, {plain(1e3 * m.at, 0)} ms"))
    rows: list[list[tuple[float, str, str, str]]] = [[]]
    x = _LEFT
    for kind, colour, words in entries:
        wide = 26.0 + text_width(words, 10.0) + 14.0
        if rows[-1] and x + wide > width:
            rows.append([])
            x = _LEFT
        rows[-1].append((x, kind, colour, words))
        x += wide
    return rows


def _draw_legend(out: Drawing, rows: list[list[tuple[float, str, str, str]]], top: float) -> None:
    for k, row in enumerate(rows):
        y = top + 17.0 * k
        for x, kind, colour, words in row:
            if kind == "band":
                box = [(x, y - 5.0), (x + 20.0, y - 5.0), (x + 20.0, y + 5.0), (x, y + 5.0)]
                out.shape(box, colour, 1.2, fill=_BAND)
            elif kind.startswith("moment"):
                out.line((x, y), (x + 20.0, y), colour, 1.6, kind.split()[1])
                out.circle((x + 10.0, y), 4.0, "#ffffff", 1.0, fill=colour)
            elif kind == "arrow":
                out.arrow((x, y), (x + 20.0, y), colour, 2.0)
            else:
                out.line((x, y), (x + 20.0, y), colour, 2.0, kind)
            out.text((x + 26.0, y), words, 10.0)


# A level plane in a picture: equal scale on both axes, ticks with units, a scale bar.


_SOFT, _GRID = "#4a525c", "#e6e9ed"
# Minimum pixels between neighboring ticks, and of the scale bar.
_TICK, _BAR = 40.0, 60.0
# Height below the points for the scale bar.
_FOOT = 18.0


@dataclass(frozen=True)
class PlanFrame:
    """Mapping of a level plane to a picture.

    `left`, `top`, `width`, `height`: of the frame, in pixels. `middle`, m: first and second
    coordinate (north and east, or forward and right) of the frame's middle. `scale`: pixels per
    meter. `names`: of the two coordinates. North is drawn up and east to the right; forward to the
    right and right downward, which is the same plane rotated by a quarter turn, seen from above.
    """

    left: float
    top: float
    width: float
    height: float
    middle: tuple[float, float]
    scale: float
    names: tuple[str, str]

    @property
    def north_up(self) -> bool:
        """Whether the first coordinate points up the page."""
        return self.names[0] == "north"

    @classmethod
    def of(
        cls,
        points: Array,
        names: tuple[str, str],
        at: tuple[float, float],
        width: float,
        heights: tuple[float, float],
        margin: float = 14.0,
    ) -> PlanFrame:
        """The largest view that contains all points.

        `points`, (n, 2), m. `at`: upper left corner of the frame. `heights`: minimum and maximum
        height of the frame. `margin`: pixels around the points.
        """
        finite = points[np.isfinite(points).all(axis=1)]
        low, high = (finite.min(axis=0), finite.max(axis=0)) if len(finite) else (-np.ones(2),) * 2
        across, up = (high - low)[::-1] if names[0] == "north" else (high - low)
        # Points without extent are shown in a square of one centimeter.
        across, up = max(float(across), 0.01), max(float(up), 0.01)
        edges = 2.0 * margin + _FOOT
        scale = min((width - 2.0 * margin) / across, (heights[1] - edges) / up)
        height = min(max(up * scale + edges, heights[0]), heights[1])
        a, b = (0.5 * (low + high)).tolist()
        if names[0] == "north":
            a -= 0.5 * _FOOT / scale
        else:
            b += 0.5 * _FOOT / scale
        return cls(at[0], at[1], width, height, (a, b), scale, names)

    def pixels(self, points: ArrayLike) -> Array:
        """Pixel positions, (n, 2), of points, (n, 2), m."""
        a, b = (np.asarray(points, dtype=np.float64).reshape(-1, 2) - self.middle).T
        x, y = (b, -a) if self.north_up else (a, b)
        centre = self.left + 0.5 * self.width, self.top + 0.5 * self.height
        return np.column_stack([centre[0] + self.scale * x, centre[1] + self.scale * y])

    @property
    def corners(self) -> Array:
        """Minimum and maximum coordinates within the frame, (2, 2), m."""
        half = 0.5 * np.array([self.width, self.height]) / self.scale
        half = half[::-1] if self.north_up else half
        return np.vstack([np.array(self.middle) - half, np.array(self.middle) + half])

    def draw_grid(self, out: Drawing) -> None:
        """Draw the frame, its ticks and axis names."""
        step = nice_step(_TICK / self.scale)
        low, high = self.corners
        right, bottom = self.left + self.width, self.top + self.height
        box = [(self.left, self.top), (right, self.top), (right, bottom), (self.left, bottom)]
        for axis in (0, 1):
            across = (axis == 1) == self.north_up
            first = math.ceil(low[axis] / step - 1e-9)
            for k in range(first, math.floor(high[axis] / step + 1e-9) + 1):
                point = np.array(self.middle)
                point[axis] = k * step
                x, y = self.pixels(point)[0].tolist()
                words = tick_words(k * step, step)
                if across:
                    out.line((x, self.top), (x, bottom), _GRID, 0.8)
                    if self.left + 8.0 < x < right - 8.0:
                        out.text((x, bottom + 9.0), words, SMALL, _SOFT, anchor="middle")
                else:
                    out.line((self.left, y), (right, y), _GRID, 0.8)
                    if self.top + 5.0 < y < bottom - 5.0:
                        out.text((self.left - 4.0, y), words, SMALL, _SOFT, anchor="end")
            name = f"{self.names[axis]}, m"
            if across:
                at = (0.5 * (self.left + right), bottom + 23.0)
                out.text(at, f"{name} →", 10.5, INK, anchor="middle")
            else:
                at = (self.left - 40.0, 0.5 * (self.top + bottom))
                arrow = "→" if self.north_up else "←"
                told = f"{name} {arrow}" if self.north_up else f"{arrow} {name}"
                out.text(at, told, 10.5, INK, anchor="middle", turn=-90.0)
        out.shape(box, "#c3cad2", 1.0)

    def draw_bar(self, out: Drawing) -> None:
        """Draw a scale bar of round length."""
        length = nice_step(_BAR / self.scale)
        x, y = self.left + 10.0, self.top + self.height - 10.0
        end = x + length * self.scale
        out.line((x, y), (end, y), INK, 2.0)
        for at in (x, end):
            out.line((at, y - 3.5), (at, y + 3.5), INK, 1.4)
        size, unit = (1e3, "mm") if length < 0.01 else (1e2, "cm") if length < 1.0 else (1.0, "m")
        words = f"{number(size * length)} {unit}"
        out.text((0.5 * (x + end), y - 9.0), words, SMALL, INK, anchor="middle", halo=True)


# --- animation of the vehicle along its path in 3D, and still instants ------------------

#: A slider on a page cannot resolve more frames.
MOST_FRAMES = 120
_FRAME = 60.0  # ms


def path_animation(
    path: CrashPath,
    outline: Outline,
    *,
    events: Sequence[CrashEvent] = (),
    point: Sequence[float] = (0.0, 0.0, 0.0),
    names: tuple[str, str] = ("forward", "right"),
    reference: pd.DataFrame | None = None,
    reference_name: str = "reference",
) -> Animation:
    """Animate the vehicle along its path with its attitude.

    `outline`: in vehicle axes. `point`, (3,), m: reference point of the path, in vehicle axes.
    `names`: of the first two axes of the path. `reference`: ``north east down`` of the point in the
    axes of the path, m. Returns: at most `MOST_FRAMES` frames, at samples of the path.
    """
    body = vehicle_body(outline)
    rows = np.unique(
        np.linspace(0, len(path.time) - 1, min(MOST_FRAMES, len(path.time))).round().astype(int)
    )
    places = path.table[NED].to_numpy(dtype=np.float64)
    corners = [body.placed(places[k], path.q_nb[k], point) for k in rows]
    given = None if reference is None else reference[NED].to_numpy(dtype=np.float64)
    ground = body.bottom - float(point[2]) + places[path.anchor, 2]
    low, high = _space([*corners, places, *([] if given is None else [given])], ground)
    lines, words = _ground(low, high, ground, names)
    lines.append(SceneLine("path of the reference point", _few(places), GREY, 1.5))
    if given is not None:
        lines.append(SceneLine(reference_name, _few(given), VERMILLION, 2.0, True))
    scene = Scene(
        (
            SceneBody(
                body.corners - np.asarray(point, dtype=np.float64),
                body.faces,
                body.colours,
                path.q_nb[rows],
                places[rows],
            ),
        ),
        tuple(lines),
        tuple(words),
        tuple(f"{1e3 * path.time[row]:.0f} ms".replace("-", "−") for row in rows.tolist()),
        low,
        high,
        _FRAME,
        (path.entry.heading_deg + 90.0 - _AHEAD, _ABOVE),
        ("up to now", BLUE),
    )
    slower = 1e-3 * _FRAME * len(rows) / max(float(path.time[-1] - path.time[0]), 1e-3)
    caption = (
        f"The vehicle on its path; {names[0]}, {names[1]} and down in m from the position of the "
        "reference point at the entry, one scale for all axes. Orange: front. Length and width are "
        "the vehicle's, the height is illustrative; the ground is drawn half a meter below the "
        "vehicle's origin at the entry."
    )
    return Animation(
        "motion",
        "Motion in 3D",
        caption,
        scene,
        crash_stills(path, body, events=events, point=point, ground=ground),
        f"Played {slower:.2g} times slower; drag to turn the view.",
    )


def _space(points: Sequence[Array], ground: float) -> tuple[Array, Array]:
    """Minimum and maximum north, east, down of all points, with a margin."""
    every = np.vstack(points)
    every = every[np.isfinite(every).all(axis=1)]
    low, high = every.min(axis=0), every.max(axis=0)
    low[:2] -= 0.5
    high[:2] += 0.5
    high[2] = max(high[2], ground) + 0.05
    low[2] -= 0.2
    return low, high


def _few(points: Array) -> Array:
    rows = np.unique(np.linspace(0, len(points) - 1, min(len(points), 300)).astype(int))
    return np.asarray(points[rows])


def _ground(
    low: Array, high: Array, down: float, names: tuple[str, str]
) -> tuple[list[SceneLine], list[SceneWord]]:
    """Grid on the ground, with the names and numbers of its axes along two edges."""
    step = nice_step(float((high - low)[:2].max()) / 16.0)
    rows: list[list[float]] = []
    words = []
    gap = [math.nan] * 3
    for axis in (0, 1):
        other = 1 - axis
        edge = float(low[other] if axis else high[other]) + (-0.6 if axis else 0.6) * step
        first, last = math.ceil(low[axis] / step), math.floor(high[axis] / step)
        for k in range(first, last + 1):
            at = [0.0, 0.0, down]
            at[axis] = k * step
            for end in (low[other], high[other]):
                at[other] = float(end)
                rows.append(list(at))
            rows.append(gap)
            if k % 2 == 0:
                at[other] = edge
                words.append(SceneWord(tick_words(k * step, step), (at[0], at[1], down), _SOFT))
        at = [0.0, 0.0, down]
        at[axis] = 0.5 * float(low[axis] + high[axis])
        at[other] = edge + (-1.2 if axis else 1.2) * step
        words.append(SceneWord(f"{names[axis]}, m", (at[0], at[1], down), INK))
    return [SceneLine(f"ground, {step:g} m", np.array(rows), "#c3cad2", 0.8)], words


# Still instants of the motion in 3D, in parallel projection from right, ahead and above.


_STILLS, _GAP, _HEAD = 640.0, 10.0, 20.0
_MOST = 6
# Direction of the viewer: angle ahead of the right side, and elevation, deg.
_AHEAD, _ABOVE = 28.0, 30.0
_GROUND = "#dfe4ea"
# Above this ratio of width to height, a row has two views instead of three.
_WIDE = 2.0


def crash_stills(
    path: CrashPath,
    body: VehicleBody,
    *,
    events: Sequence[CrashEvent] = (),
    point: Sequence[float] = (0.0, 0.0, 0.0),
    ground: float = 0.5,
) -> Picture:
    """Draw the vehicle at up to six instants of its path.

    `point`, (3,), m: reference point in vehicle axes. `ground`, m: down coordinate of the drawn
    ground, in the axes of the path. All views have one scale.
    """
    places = path.table[NED].to_numpy(dtype=np.float64)
    instants = _instants(path, events)
    rows = [int(np.abs(path.time - at).argmin()) for _, at in instants]
    flat, away = _projection(path.entry.heading_deg)
    corners = [body.placed(places[k], path.q_nb[k], point) for k in rows]
    shown = np.vstack([*corners, places]) @ flat
    low, high = shown.min(axis=0), shown.max(axis=0)
    size = np.maximum(high - low, 0.5)
    columns = 2 if size[0] > _WIDE * size[1] else 3
    width = (_STILLS - _GAP * (columns - 1)) / columns
    scale = min((width - 16.0) / size[0], 240.0 / size[1])
    height = scale * float(size[1]) + 16.0
    lines = -(-len(rows) // columns)
    words = ", ".join(f"{name} {plain(1e3 * at, 0)} ms" for name, at in instants)
    spanned = np.vstack([places, *corners])[:, :2]
    step = nice_step(float(np.ptp(spanned, axis=0).max()) / 12.0)
    out = Drawing(_STILLS, lines * (height + _HEAD + _GAP), f"The vehicle in space at {words}")
    for k, (row, (name, at)) in enumerate(zip(rows, instants, strict=True)):
        left = (k % columns) * (width + _GAP)
        top = (k // columns) * (height + _HEAD + _GAP)
        centre = np.array([left + 0.5 * width, top + _HEAD + 0.5 * height])

        def pixels(points: Array, centre: Array = centre) -> Array:
            page = points @ flat - 0.5 * (low + high)
            return np.asarray(centre + scale * page * [1.0, -1.0])

        _cell(out, (left, top, width, height), f"{plain(1e3 * at, 0)} ms", name)
        shadow = places.copy()
        shadow[:, 2] = ground
        with out.group((left, top + _HEAD, left + width, top + _HEAD + height)):
            _ground_lines(out, pixels, spanned, step, ground)
            out.shape(pixels(shadow), "#8a939e", 1.0, "dash", closed=False)
            out.shape(pixels(shadow[: row + 1]), BLUE, 2.2, closed=False)
            for f in body.seen(corners[k], away):
                face = pixels(corners[k][list(body.faces[f])])
                out.shape(face, "#3d5166", 0.6, fill=body.colours[f])
    return Picture(
        "motion",
        out.svg(),
        "Motion in 3D",
        "The vehicle at instants of its path, in parallel projection from the right, ahead and "
        "above of its attitude at the entry. Blue: path of the reference point up to that instant, "
        "projected onto the ground; dashed: the whole path. Lines on the ground are "
        f"{step:g} m apart.",
        out.alt,
    )


def _projection(heading_deg: float) -> tuple[Array, Array]:
    """Right and up of a page that is projected onto, (3, 2), and the direction away from it."""
    heading, around = math.radians(heading_deg), -math.radians(_AHEAD)
    above = math.radians(_ABOVE)
    ahead = np.array([math.cos(heading), math.sin(heading), 0.0])
    right = np.array([-math.sin(heading), math.cos(heading), 0.0])
    up = np.array([0.0, 0.0, -1.0])
    away = math.sin(around) * ahead - math.cos(around) * right
    across = math.cos(around) * ahead + math.sin(around) * right
    page = np.column_stack([across, math.cos(above) * up + math.sin(above) * away])
    return page, math.cos(above) * away - math.sin(above) * up


def _instants(path: CrashPath, events: Sequence[CrashEvent]) -> list[tuple[str, float]]:
    """The key instants, with others added in the longest intervals between them."""
    found = path_moments(path, events)
    if len(found) > _MOST:
        found = [one for one in found if one[0] != "begin"]
    while len(found) > _MOST:
        gaps = [found[k + 1][1] - found[k - 1][1] for k in range(1, len(found) - 1)]
        found.pop(1 + int(np.argmin(gaps)))
    step = float(np.median(np.diff(path.time))) if len(path.time) > 1 else 0.0
    while 2 <= len(found) < _MOST:
        gaps = [b[1] - a[1] for a, b in pairwise(found)]
        k = int(np.argmax(gaps))
        if gaps[k] < 4.0 * step:
            break
        found.insert(k + 1, ("", 0.5 * (found[k][1] + found[k + 1][1])))
    return found


def _cell(out: Drawing, box: tuple[float, float, float, float], when: str, name: str) -> None:
    left, top, width, height = box
    low, high = top + _HEAD, top + _HEAD + height
    rim = [(left, low), (left + width, low), (left + width, high), (left, high)]
    out.shape(rim, "#c3cad2", 0.8, fill="#fbfcfd")
    after = out.text((left + 2.0, top + 10.0), when, 11.5, INK, bold=True)[2]
    out.text((after + 6.0, top + 10.0), name, SMALL, "#4a525c")


def _ground_lines(
    out: Drawing, pixels: Callable[[Array], Array], spanned: Array, step: float, ground: float
) -> None:
    """Lines on the ground, `step` m apart, under the points (n, 2) that it is to span."""
    low = np.floor(spanned.min(axis=0) / step) * step
    high = np.ceil(spanned.max(axis=0) / step) * step
    for axis in (0, 1):
        other = 1 - axis
        for k in range(round((high[axis] - low[axis]) / step) + 1):
            ends = np.full((2, 3), ground)
            ends[:, axis] = low[axis] + k * step
            ends[:, other] = low[other], high[other]
            out.shape(pixels(ends), _GROUND, 0.7, closed=False)


# The vehicle as a 3D body: its outline with a height, its front marked.


# Typical heights, m, down from the vehicle's origin; the origin of a car is taken half a meter
# above the ground.
_SILL, _BELT, _ROOF = 0.50, -0.30, -0.95
_RING = 16  # corners kept of the outline
# Shares of length and width: the cabin at the belt and at the roof.
_CABIN = ((0.09, 0.735, 0.90), (0.19, 0.565, 0.72))
_CABIN_FACES = 5
_SIDE, _COVER, _GLASS, _FRONT = "#9fb3c8", "#cdd8e2", "#3d5166", "#D55E00"


@dataclass(frozen=True, eq=False)
class VehicleBody:
    """Corners and faces of a vehicle body.

    `corners`, (n, 3), m: vehicle axes forward, right, down, from the vehicle's origin. `faces`:
    corner indices of each face. `colours`: one per face. `cabin`: number of faces, at the end, that
    belong to a cabin on top of the body.
    """

    corners: Array = field(repr=False)
    faces: tuple[tuple[int, ...], ...] = field(repr=False)
    colours: tuple[str, ...] = field(repr=False)
    cabin: int = 0

    @property
    def bottom(self) -> float:
        """Down coordinate of the lowest corner, from the origin, m."""
        return float(self.corners[:, 2].max())

    def seen(self, corners: Array, away: Array) -> list[int]:
        """Visible faces, farthest first, for any attitude of the body.

        `corners`, (n, 3), m: as returned by `placed`. `away`, (3,): viewing direction, in the same
        axes.
        """
        lower = range(len(self.faces) - self.cabin)
        upper = range(len(self.faces) - self.cabin, len(self.faces))
        order: list[list[int]] = [[], []]
        for part, faces in enumerate((lower, upper)):
            used = sorted({c for f in faces for c in self.faces[f]})
            middle = corners[used].mean(axis=0) if used else np.zeros(3)
            for f in faces:
                a, b, c = corners[list(self.faces[f][:3])]
                normal = np.cross(b - a, c - a)
                outward = normal if normal @ (a - middle) > 0.0 else -normal
                if outward @ away < 0.0:
                    order[part].append(f)
        # Both parts are convex and separated by the top of the lower one.
        cap = lower[-1]
        above = cap in order[0]
        return [*order[0], *order[1]] if above else [*order[1], *order[0]]

    def placed(self, at: ArrayLike, q_nb: ArrayLike, point: ArrayLike) -> Array:
        """Corners in the axes of the path, (n, 3), m.

        `at`, (3,), m: position of `point`. `q_nb`, (4,). `point`, (3,), m: of the vehicle, in
        vehicle axes.
        """
        arms = self.corners - np.asarray(point, dtype=np.float64)
        return np.asarray(rotation.rotate(q_nb, arms) + np.asarray(at, dtype=np.float64))


def vehicle_body(outline: Outline) -> VehicleBody:
    """Make a body from an outline: a car with a cabin, or a plain body for a stated outline.

    `outline`: in vehicle axes.
    """
    ring = hull(outline.body)
    if len(ring) > _RING:
        ring = ring[np.unique(np.linspace(0, len(ring), _RING, endpoint=False).astype(int))]
    low, high = outline.low, outline.high
    n, top = len(ring), _ROOF if outline.stated else _BELT
    levels = [np.column_stack([ring, np.full(n, z)]) for z in (_SILL, top)]
    faces: list[tuple[int, ...]] = []
    colours: list[str] = []
    front = float(high[0] - 0.06 * (high[0] - low[0]))
    for k in range(n):
        j = (k + 1) % n
        faces.append((k, j, n + j, n + k))
        ahead = min(ring[k, 0], ring[j, 0]) > front
        colours.append(_FRONT if ahead else _SIDE)
    faces.append(tuple(range(n, 2 * n)))
    colours.append(_COVER)
    if not outline.stated:
        length, width = (high - low).tolist()
        middle = 0.5 * float(low[1] + high[1])
        for (rear, fore, wide), z in zip(_CABIN, (_BELT, _ROOF), strict=True):
            x = low[0] + length * np.array([rear, fore, fore, rear])
            y = middle + 0.5 * width * wide * np.array([-1.0, -1.0, 1.0, 1.0])
            levels.append(np.column_stack([x, y, np.full(4, z)]))
        a, b = 2 * n, 2 * n + 4
        faces += [(a + k, a + (k + 1) % 4, b + (k + 1) % 4, b + k) for k in range(4)]
        faces.append((b, b + 1, b + 2, b + 3))
        colours += [_GLASS] * 4 + [_COVER]
    cabin = 0 if outline.stated else _CABIN_FACES
    return VehicleBody(np.vstack(levels), tuple(faces), tuple(colours), cabin)
