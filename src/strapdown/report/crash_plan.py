"""Plan of the reference point's path with its bound and the vehicle at a few instants."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from strapdown.constants import Array
from strapdown.crash.events import CrashEvent
from strapdown.crash.path import PLACE, CrashPath
from strapdown.report.chart import BLUE, GREEN, ORANGE, PURPLE, SKY, VERMILLION
from strapdown.report.crash_outline import Outline, draw_outline, path_moments
from strapdown.report.document import Picture
from strapdown.report.plan import envelope
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
