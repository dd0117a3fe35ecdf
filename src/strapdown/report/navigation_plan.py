"""Where a run of navigation went, seen from above, and how well that is known."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.evaluation.plane_bound import plane_bound
from strapdown.formats.trajectory_thinning import thin
from strapdown.frames import ned_from_geodetic
from strapdown.navigation.record import NavigationRecord
from strapdown.report.chart import BLACK, BLUE, GREY, PURPLE, VERMILLION, Chart, Line, Panel
from strapdown.report.crash_values import GAP, plain
from strapdown.report.navigation_plan_bounds import bound_labels, centres, ellipse_rows, ellipses
from strapdown.report.navigation_plane import Plane, within_span
from strapdown.report.navigation_strip import mode_colour
from strapdown.report.navigation_told import NavigationTold
from strapdown.report.path_marks import View, path_marks
from strapdown.report.plan_view import nice_step
from strapdown.tables import places_of

__all__ = ["plan_chart"]

Array = NDArray[np.float64]

MOST_POINTS, MOST_FIXES, MOST_SAMPLES = 1500, 600, 100_000
# From here on a plan is in kilometres.
_FAR = 20e3
# Bar of the scale and arrow to the north, as shares of the view, and what they keep off.
_BAR, _ARROW, _CORNER = 0.12, 0.05, 0.22
# Height of the plan over its width, at most.
_TALL = 0.9
# What moves less has no path, m.
NO_PATH = 0.05


def plan_chart(told: NavigationTold) -> Chart | None:
    """Draw the path to one scale, what it was fixed by, and ellipses of 95 %.

    Parameters
    ----------
    told : NavigationTold

    Returns
    -------
    Chart or None
        None where nothing moves.
    """
    record = told.record
    table = record.trajectory
    rows = _rows(told)
    kept = table.iloc[rows]
    origin = places_of(table.iloc[:1])[0]
    ned = ned_from_geodetic(places_of(kept), origin, ellipsoid=told.ellipsoid)
    reach = float(np.ptp(ned[:, :2], axis=0).max())
    if reach < NO_PATH:
        return None
    plane = Plane(origin, told, *(("km", 1e-3) if reach >= _FAR else ("m", 1.0)))
    path = (plane.scale * ned[:, 1], plane.scale * ned[:, 0])
    time = kept.index.to_numpy(dtype=np.float64)
    view = _with_margin(View.of([path, *_around(plane)], most=_TALL))
    fixes, beyond = _fixes(plane, view)
    lines = [*fixes, *_truth(plane), *_path(record, time, path), *_points(plane)]
    round_, said, obstacles = ellipses(plane, view)
    lines += round_
    marks = path_marks(time, [path], view, BLACK)
    lines += marks
    lines += bound_labels(plane, view, path, marks, obstacles)
    lines += _scale(view, path, plane.unit)
    at = f"{plain(origin[0], 6)}°, {plain(origin[1], 6)}°"
    words = [
        f"In the level plane at the start ({at}), to one scale; arrows show the direction of "
        "motion.",
        said,
        beyond,
    ]
    return Chart(
        "plan",
        "Where it went",
        " ".join(w for w in words if w),
        "",
        (
            Panel(
                f"north of the start, {plane.unit}",
                tuple(lines),
                x_label=f"east of the start, {plane.unit}",
                height=view.height,
            ),
        ),
    )


def _rows(told: NavigationTold) -> NDArray[np.intp]:
    """Rows that keep the course, and those at which a mode or an outage begins or ends."""
    table = told.record.trajectory
    rows = _course(table, told)
    spans = [*told.record.modes, *(s for v in told.record.outages.values() for s in v)]
    edges = np.searchsorted(table.index.to_numpy(), [t for s in spans for t in (s.begin, s.end)])
    return np.unique(np.concatenate([rows, np.clip(edges, 0, len(table) - 1)]))


def _course(table: pd.DataFrame, told: NavigationTold) -> NDArray[np.intp]:
    """Rows that keep the course, the last among them."""
    # No vehicle leaves its course between samples of so many a run.
    step = max(1, len(table) // MOST_SAMPLES)
    rows = step * thin(table.iloc[::step], MOST_POINTS, told.ellipsoid).rows
    return np.append(rows, len(table) - 1) if rows[-1] < len(table) - 1 else rows


def _with_margin(view: View) -> View:
    room = 0.04 * (view.high - view.low)
    return View(view.low - room, view.high + room)


def _around(plane: Plane) -> list[tuple[Array, Array]]:
    """Corners about the ellipses, which may be larger than the path is long."""
    along, ends = ellipse_rows(plane.told.record)
    rows = [*along, *(k for k, _ in ends)]
    if not rows:
        return []
    bounds = plane_bound(plane.told.record.covariance)[rows] * plane.scale
    east, north = centres(plane, rows).T
    return [(east + side * bounds, north + side * bounds) for side in (-1.0, 1.0)]


def _path(record: NavigationRecord, time: Array, path: tuple[Array, Array]) -> list[Line]:
    """The path in pieces: by mode, and by what was missing."""
    middle = 0.5 * (time[1:] + time[:-1])
    names = tuple(dict.fromkeys(m.name for m in record.modes))
    what = np.full(middle.size, "path", dtype=object)
    for mode in record.modes:
        what[within_span(middle, mode)] = mode.name
    missing: dict[str, NDArray[np.bool_]] = {
        aid: np.any([within_span(middle, s) for s in spans], axis=0)
        for aid, spans in record.outages.items()
        if spans
    }
    for k in np.flatnonzero(np.any(list(missing.values()), axis=0)) if missing else ():
        what[k] = "without " + " and ".join(a for a, gone in missing.items() if gone[k])
    out = []
    lost = [n for n in dict.fromkeys(what.tolist()) if n.startswith("without ")]
    for name in dict.fromkeys(what.tolist()):
        if name in lost:
            colour = (VERMILLION, PURPLE)[lost.index(name) % 2]
        else:
            colour = mode_colour(name, names) if name in names else BLUE
        x, y = _pieces(what == name, path)
        out.append(Line(str(name), x, y, colour, width=3.2 if name in lost else 2.0))
    # What is missing lies on top.
    return sorted(out, key=lambda line: line.name in lost)


def _pieces(of: NDArray[np.bool_], path: tuple[Array, Array]) -> tuple[Array, Array]:
    """Stretches of a path over some of its steps, with NaN between them."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], of.astype(np.int8), [0]])))
    x: list[Array] = []
    y: list[Array] = []
    for begin, end in edges.reshape(-1, 2):
        x += [path[0][begin : end + 1], np.array([np.nan])]
        y += [path[1][begin : end + 1], np.array([np.nan])]
    return np.concatenate(x)[:-1], np.concatenate(y)[:-1]


def _fixes(plane: Plane, view: View) -> tuple[list[Line], str]:
    """What was measured, as faint points; words on what lies outside of the view."""
    out: list[Line] = []
    beyond = 0
    for aid, table in plane.told.fixes.items():
        if table.empty:
            continue
        time = table.index.to_numpy(dtype=np.float64)
        east, north = plane.of(table)
        inside = (east >= view.low[0]) & (east <= view.high[0])
        inside &= (north >= view.low[1]) & (north <= view.high[1])
        beyond += int((~inside).sum())
        lost = np.isin(np.round(time, 6), np.round(_rejected(plane.told.record, aid), 6))
        some = np.flatnonzero(inside & ~lost)
        some = some[:: max(1, -(-some.size // MOST_FIXES))]
        out.append(
            Line(
                f"fixes of {aid}",
                east[some],
                north[some],
                GREY,
                points=True,
                symbol="circle",
                size=4.0,
            )
        )
        if (lost & inside).any():
            gone = np.flatnonzero(lost & inside)[:MOST_FIXES]
            out.append(
                Line(
                    "rejected",
                    east[gone],
                    north[gone],
                    VERMILLION,
                    points=True,
                    symbol="x",
                    size=6.0,
                )
            )
    if not beyond:
        return out, ""
    return out, f"{beyond} {'fix lies' if beyond == 1 else 'fixes lie'} outside of the picture."


def _rejected(record: NavigationRecord, aid: str) -> Array:
    table = record.innovations.get(f"{aid}.position")
    if table is None:
        return np.empty(0)
    weights = table[[c for c in table.columns if str(c).startswith("weight ")]].to_numpy()
    return table.index.to_numpy(dtype=np.float64)[(weights <= 0.0).any(axis=1)]


def _truth(plane: Plane) -> list[Line]:
    truth = plane.told.truth
    if truth is None:
        return []
    time = plane.told.record.trajectory.index
    within = truth[(truth.index >= time[0]) & (truth.index <= time[-1])]
    if within.empty:
        return []
    rows = _course(within, plane.told)
    return [Line("truth", *plane.of(within.iloc[rows]), BLACK, "dot", 1.2)]


def _points(plane: Plane) -> list[Line]:
    """Control points, turned and shifted onto the path, and how far it is from each."""
    score = plane.told.points
    if score is None:
        return []
    placed, there = plane.scale * score.points, plane.scale * (score.points + score.error)
    drawn: dict[str, Any] = {"points": True, "symbol": "circle", "size": 5.0, "hollow": True}
    gap = np.full(len(placed), np.nan)
    x = np.column_stack([placed[:, 1], there[:, 1], gap]).reshape(-1)[:-1]
    y = np.column_stack([placed[:, 0], there[:, 0], gap]).reshape(-1)[:-1]
    east, north = placed[:, 1], placed[:, 0]
    return [
        Line("error at a control point", x, y, VERMILLION, width=1.2),
        Line("control points", east, north, BLACK, **drawn),
    ]


def _scale(view: View, path: tuple[Array, Array], unit: str) -> list[Line]:
    """A bar of round length and an arrow to the north, in the emptiest corner."""
    size = view.high - view.low
    best, fewest = view.low, math.inf
    for x_side in (0, 1):
        for y_side in (0, 1):
            corner = view.low + size * np.array([x_side, y_side])
            near = np.abs(np.column_stack(path) - corner) < _CORNER * size[0]
            count = float(near.all(axis=1).sum())
            if count < fewest:
                best, fewest = np.array([x_side, y_side], dtype=np.float64), count
    length = nice_step(0.5 * _BAR * view.width)
    up = _ARROW * view.width
    inset = 0.01 * view.width
    left = view.low[0] + inset if not best[0] else view.high[0] - inset - length
    low = view.low[1] + inset if not best[1] else view.high[1] - inset - 2.3 * up
    tick = 0.12 * up
    bar_x = np.array([left, left, left, left + length, left + length, left + length])
    bar_y = low + tick * np.array([1.0, -1.0, 0.0, 0.0, 1.0, -1.0])
    x, foot = left + 0.5 * length, low + 1.15 * up
    arrow_x = x + up * np.array([0.0, 0.0, -0.18, 0.0, 0.18])
    arrow_y = foot + up * np.array([0.0, 0.8, 0.5, 0.8, 0.5])
    words = f"{length:g}{GAP}{unit}"
    return [
        Line("scale", bar_x, bar_y, BLACK, width=1.8, legend=False),
        Line("north", arrow_x, arrow_y, BLACK, width=1.6, legend=False),
        Line(
            "scale",
            np.array([x, x]),
            np.array([low, foot + 0.8 * up]),
            BLACK,
            points=True,
            size=0.0,
            labels=(words, "N"),
            places=((0, 1), (0, 1)),
            legend=False,
        ),
    ]
