"""Plan of a navigation run: its path from above with 95 % ellipses."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.constants import Array
from strapdown.dsp.samples import running_integral, true_runs
from strapdown.ellipsoids import WGS84
from strapdown.formats.trajectory_writers import thin
from strapdown.frames import geodetic_from_ned, ned_from_geodetic
from strapdown.navigation.record import NavigationRecord, Span
from strapdown.report.chart import (
    BLACK,
    BLUE,
    GREY,
    PURPLE,
    VERMILLION,
    Backdrop,
    Chart,
    Line,
    Panel,
    Picture,
    dots,
)
from strapdown.report.chart_svg import plane_view
from strapdown.report.navigation_charts import TIME, mode_colour
from strapdown.report.navigation_evaluation import NavigationEvaluation, rejected_times
from strapdown.report.plan import PlanView, ellipse, path_marks, place_labels
from strapdown.report.svg_drawing import nice_step
from strapdown.report.values import GAP, duration_words, length_words, plain
from strapdown.rotation import within_half_turn
from strapdown.tables import GEODETIC, places_of
from strapdown.tables.checks import index_of

if TYPE_CHECKING:
    from strapdown.formats.map_tiles import MapBox, MapFile, Tile

MOST_POINTS, MOST_FIXES, MOST_SAMPLES = 1500, 600, 100_000
# Plans of at least this size, m, are in kilometers.
_FAR = 20e3
# Scale bar, north arrow and their free corner, as shares of the view.
_BAR, _ARROW, _CORNER = 0.12, 0.05, 0.22
# Largest ratio of the plan's height to its width.
_TALL = 0.9
# A run that moves less has no plan, m.
NO_PATH = 0.05


def plan_chart(evaluation: NavigationEvaluation) -> Chart | None:
    """Draw the path to one scale, with its fixes and 95 % ellipses.

    Returns
    -------
    Chart or None
        None for a run without motion.
    """
    drawn = _drawn(evaluation)
    if drawn is None or evaluation.run.spec.map is None:
        return None if drawn is None else drawn[0]
    chart, plane = drawn
    backdrop, said = _backdrop(plane, evaluation.run.spec.map.path, *plane_view(chart))
    panels = (replace(chart.panels[0], backdrop=backdrop),)
    return replace(chart, caption=f"{chart.caption} {said}", panels=panels)


def _drawn(evaluation: NavigationEvaluation) -> tuple[Chart, Plane] | None:
    """The chart without a map, and its plane; None without motion."""
    record = evaluation.record
    table = record.trajectory
    # Rows that preserve the course, and those at the ends of modes and outages.
    spans = [*record.modes, *(s for v in record.outages.values() for s in v)]
    edges = np.searchsorted(table.index.to_numpy(), [t for s in spans for t in (s.begin, s.end)])
    edges = np.clip(edges, 0, len(table) - 1)
    kept = table.iloc[np.unique(np.concatenate([_course(table, evaluation), edges]))]
    origin = places_of(table.iloc[:1])[0]
    ned = ned_from_geodetic(places_of(kept), origin, ellipsoid=evaluation.run.ellipsoid)
    reach = float(np.ptp(ned[:, :2], axis=0).max())
    if reach < NO_PATH:
        return None
    plane = Plane(origin, evaluation, *(("km", 1e-3) if reach >= _FAR else ("m", 1.0)))
    path = (plane.scale * ned[:, 1], plane.scale * ned[:, 0])
    time = index_of(kept)
    tight = PlanView.of([path, *_around(plane)], most=_TALL)
    margin = 0.04 * (tight.high - tight.low)
    view = PlanView(tight.low - margin, tight.high + margin)
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
    east, north = (f"{side} of the start, {plane.unit}" for side in ("east", "north"))
    panel = Panel(north, tuple(lines), x_label=east, height=view.height)
    return Chart("plan", "Path", " ".join(filter(None, words)), TIME, (panel,)), plane


def plan_tiles(evaluation: NavigationEvaluation, opened: MapFile) -> list[Tile]:
    """Return the tiles of a map that are under the plan."""
    from strapdown.formats.map_tiles import chosen_tiles

    drawn = _drawn(evaluation)
    if drawn is None:
        return []
    chart, plane = drawn
    return [tile for tile, _ in chosen_tiles(opened, map_box(plane, *plane_view(chart))).tiles]


def _course(table: pd.DataFrame, evaluation: NavigationEvaluation) -> NDArray[np.intp]:
    """Rows that preserve the course, including the last one."""
    # At this sampling no vehicle leaves its course between samples.
    step = max(1, len(table) // MOST_SAMPLES)
    rows = step * thin(table.iloc[::step], MOST_POINTS, evaluation.run.ellipsoid).rows
    return np.append(rows, len(table) - 1) if rows[-1] < len(table) - 1 else rows


def _around(plane: Plane) -> list[tuple[Array, Array]]:
    """Corners about the ellipses, which may be larger than the path."""
    along, ends = ellipse_rows(plane.found)
    rows = [*along, *(k for k, _ in ends)]
    if not rows:
        return []
    bounds = plane.found.bounds[rows] * plane.scale
    east, north = centres(plane, rows).T
    return [(east + side * bounds, north + side * bounds) for side in (-1.0, 1.0)]


def _path(record: NavigationRecord, time: Array, path: tuple[Array, Array]) -> list[Line]:
    """Segments of the path by mode and by outage."""
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
        # Stretches of its steps, with NaN between them.
        runs, gap = true_runs(what == name), np.array([np.nan])
        x, y, stamps = (
            np.concatenate([part for r in runs for part in (column[r.start : r.stop + 1], gap)])[
                :-1
            ]
            for column in (*path, time)
        )
        width = 3.2 if name in lost else 2.0
        out.append(Line(str(name), x, y, colour, width=width, stamps=stamps))
    # Outages are drawn on top.
    return sorted(out, key=lambda line: line.name in lost)


def _fixes(plane: Plane, view: PlanView) -> tuple[list[Line], str]:
    """Fixes as faint points; text on those outside of the view."""
    out: list[Line] = []
    beyond = 0
    for aid, table in plane.found.run.source.tables.items():
        if table.empty or not {*GEODETIC} <= {*table.columns}:
            continue
        time = index_of(table)
        east, north = plane.of(table)
        inside = (east >= view.low[0]) & (east <= view.high[0])
        inside &= (north >= view.low[1]) & (north <= view.high[1])
        beyond += int((~inside).sum())
        innovations = plane.found.record.innovations.get(f"{aid}.position")
        rejected = np.empty(0) if innovations is None else rejected_times(innovations)
        lost = np.isin(np.round(time, 6), np.round(rejected, 6))
        used = np.flatnonzero(inside & ~lost)
        used = used[:: max(1, -(-used.size // MOST_FIXES))]
        gone = np.flatnonzero(lost & inside)[:MOST_FIXES]
        for name, rows, colour, symbol, size in (
            (f"fixes of {aid}", used, GREY, "circle", 4.0),
            ("rejected", gone, VERMILLION, "x", 6.0),
        ):
            if rows.size or name != "rejected":
                out.append(dots(name, east[rows], north[rows], colour, symbol, size))
    if not beyond:
        return out, ""
    return out, f"{beyond} {'fix is' if beyond == 1 else 'fixes are'} outside of the plan."


def _truth(plane: Plane) -> list[Line]:
    truth = plane.found.run.source.truth
    if truth is None:
        return []
    time = plane.found.record.trajectory.index
    within = truth[(truth.index >= time[0]) & (truth.index <= time[-1])]
    if within.empty:
        return []
    rows = _course(within, plane.found)
    return [Line("truth", *plane.of(within.iloc[rows]), BLACK, "dot", 1.2)]


def _points(plane: Plane) -> list[Line]:
    """Control points, rotated and shifted to the path, and the distance of the path from each."""
    score = plane.found.run.points
    if score is None:
        return []
    placed, there = plane.scale * score.points, plane.scale * (score.points + score.error)
    gap = np.full(len(placed), np.nan)
    x = np.column_stack([placed[:, 1], there[:, 1], gap]).reshape(-1)[:-1]
    y = np.column_stack([placed[:, 0], there[:, 0], gap]).reshape(-1)[:-1]
    east, north = placed[:, 1], placed[:, 0]
    return [
        Line("error at a control point", x, y, VERMILLION, width=1.2),
        dots("control points", east, north, BLACK, "circle", 5.0, hollow=True),
    ]


def _scale(view: PlanView, path: tuple[Array, Array], unit: str) -> list[Line]:
    """Scale bar of round length and north arrow, in the emptiest corner."""
    size = view.high - view.low
    counts = {}
    for side in ((0, 0), (0, 1), (1, 0), (1, 1)):
        near = np.abs(np.column_stack(path) - view.low - size * side) < _CORNER * size[0]
        counts[side] = int(near.all(axis=1).sum())
    best = min(counts, key=lambda side: counts[side])
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
    words, places = (f"{length:g}{GAP}{unit}", "N"), ((0, 1), (0, 1))
    named = dots("scale", [x, x], [low, foot + 0.8 * up], BLACK, size=0.0, labels=words)
    return [
        Line("scale", bar_x, bar_y, BLACK, width=1.8, legend=False),
        Line("north", arrow_x, arrow_y, BLACK, width=1.6, legend=False),
        replace(named, places=places, legend=False),
    ]


# A local map under the plan.


# Least part of a tile that is fitted.
_PART = 1.0 / 16.0


def map_box(plane: Plane, low: Array, high: Array) -> MapBox:
    """Return the part of the map between two corners of a plan, (2,) each."""
    from strapdown.formats.map_tiles import NORTHERNMOST, MapBox

    share = np.linspace(0.0, 1.0, 9)
    across, up = np.meshgrid(*(low + np.outer(share, high - low)).T)
    ned = np.column_stack([up.ravel(), across.ravel(), np.zeros(up.size)]) / plane.scale
    lat, lon, _ = geodetic_from_ned(ned, plane.origin, ellipsoid=WGS84).T
    x = (plane.origin[1] + (lon - plane.origin[1] + 180.0) % 360.0) / 360.0
    clipped = np.radians(np.clip(lat, -NORTHERNMOST, NORTHERNMOST))
    y = 0.5 - np.arcsinh(np.tan(clipped)) / (2.0 * math.pi)
    west, east, north, south = (float(v) for v in (x.min(), x.max(), y.min(), y.max()))
    return MapBox(west, east, north, south, float(np.abs(lat).max()))


def _backdrop(plane: Plane, path: str, low: Array, high: Array) -> tuple[Backdrop | None, str]:
    """The map under the plan, and a sentence on it."""
    from strapdown.formats.map_tiles import chosen_tiles, open_map

    if plane.found.run.ellipsoid != WGS84:
        name = plane.found.run.ellipsoid.name
        return None, f"No map: maps are on WGS 84, and positions on {name}."
    box = map_box(plane, low, high)
    with open_map(path) as opened:
        chosen = chosen_tiles(opened, box)
    if not chosen.tiles:
        return None, f"No map: {opened.name} has no tiles here that suit the plan."
    pictures = tuple(tile_picture(plane, box, tile, column) for tile, column in chosen.tiles)
    part = "" if len(pictures) == chosen.count else f", {len(pictures)} of {chosen.count} tiles"
    whose = f"; {opened.attribution}" if opened.attribution else ""
    said = f"Map: {opened.name}, zoom {chosen.zoom}{part}{whose}."
    return Backdrop(pictures, opened.attribution or opened.name), said


def tile_picture(plane: Plane, box: MapBox, tile: Tile, column: int) -> Picture:
    """Place a tile by the affine map that fits the corners of its part on the plan best."""
    n = 1 << tile.zoom
    left, right = _part(n * box.west - column, n * box.east - column)
    top, bottom = _part(n * box.north - tile.row, n * box.south - tile.row)
    lon = (column + np.array([left, right, left, right])) / n * 360.0 - 180.0
    y = (tile.row + np.array([top, top, bottom, bottom])) / n
    lat = np.degrees(np.arctan(np.sinh(math.pi * (1.0 - 2.0 * y))))
    corners = np.column_stack([lat, within_half_turn(lon), np.full(4, plane.origin[2])])
    ned = ned_from_geodetic(corners, plane.origin, ellipsoid=WGS84)
    nw, ne, sw, se = plane.scale * ned[:, 1::-1]
    across = 0.5 * (ne + se - nw - sw) / (right - left)
    down = 0.5 * (sw + se - nw - ne) / (bottom - top)
    middle = 0.25 * (nw + ne + sw + se)
    corner = middle - 0.5 * (left + right) * across - 0.5 * (top + bottom) * down
    return Picture(tile.data, tile.media, corner, across, down)


def _part(low: float, high: float) -> tuple[float, float]:
    """Ends of a part of a tile, as shares of its side."""
    begin = min(max(low, 0.0), 1.0 - _PART)
    return begin, max(min(high, 1.0), begin + _PART)


# 95 % ellipses on the plan of a run, and their labels.


# Number of ellipses at ends of outages, and along the path; the largest, as a share of the view.
_AT_OUTAGES, _ALONG, _LARGEST = 8, 6, 0.05
# Width of a letter and height of a line of text, as shares of the view.
_LETTER, _TEXT = 0.0082, 0.04


def ellipse_rows(evaluation: NavigationEvaluation) -> tuple[list[int], list[tuple[int, Span]]]:
    """Covariance marks at which ellipses are drawn: along the path, and at the ends of outages.

    Returns
    -------
    along : list of int
        Evenly spaced along the path, including its end; none in an outage.
    at_outages : list of (int, Span)
        The last mark before the end of each; if there are many, those of largest uncertainty.
    """
    record, bounds = evaluation.record, evaluation.bounds
    time = index_of(record.sd)
    ends: list[tuple[int, Span]] = []
    for span in sorted({s for v in record.outages.values() for s in v}, key=lambda s: s.begin):
        inside = np.flatnonzero((time >= span.begin) & (time < span.end - 1e-6))
        if inside.size:
            ends.append((int(inside[-1]), span))
    ends = sorted(sorted(ends, key=lambda e: -bounds[e[0]])[:_AT_OUTAGES])
    spans = [s for v in record.outages.values() for s in v]
    lost = np.zeros(time.size, dtype=bool)
    for span in spans:
        lost |= within_span(time, span)
    rows = np.flatnonzero(~lost)
    if not rows.size:
        return [], ends
    table = record.trajectory
    speed = np.hypot(table["VN"].to_numpy(), table["VE"].to_numpy())
    at = index_of(table)
    way = running_integral(at, speed)
    gone = np.interp(time[rows], at, way)
    picked = np.searchsorted(gone, np.linspace(0.0, gone[-1], _ALONG + 1)[1:])
    picked = np.clip(picked, 0, rows.size - 1)
    return [int(k) for k in np.unique(rows[picked])], ends


def ellipses(plane: Plane, view: PlanView) -> tuple[list[Line], str, list[tuple[int, Span]]]:
    """Return ellipses, magnified by one factor to be visible, and their caption.

    Returns
    -------
    said : str
        Caption text; empty without ellipses.
    at_outages : list of (int, Span)
        As in `ellipse_rows`.
    """
    record = plane.found.record
    along, ends = ellipse_rows(plane.found)
    rows = [*along, *(k for k, _ in ends)]
    bounds = plane.found.bounds[rows] * plane.scale
    if not rows or not bounds.max() > 0.0:
        return [], "", []
    # The largest of 1, 2, 5 times a power of ten with which none is too large.
    most = _LARGEST * view.width / float(bounds.max())
    power = 10.0 ** math.floor(math.log10(most))
    rounded = next(f * power for f in (5.0, 2.0, 1.0) if f * power <= most * (1.0 + 1e-9))
    factor = max(1.0, rounded)
    middles = centres(plane, rows)
    out = []
    count = len(along)
    times = f"{factor:,.0f}".replace(",", GAP)
    named = "" if factor == 1.0 else f" × {times}"
    drawn = "" if factor == 1.0 else f", enlarged {times} times"
    for name, colour, part in (
        (f"95{GAP}% ellipse{named}", BLUE, slice(0, count)),
        (f"95{GAP}% ellipse{named} at the end of an outage", VERMILLION, slice(count, None)),
    ):
        if not rows[part]:
            continue
        rings = []
        for k, centre in zip(rows[part], middles[part], strict=True):
            ring = ellipse(
                centre[::-1], (factor * plane.scale) ** 2 * record.covariance[k, :2, :2], 48
            )
            rings.append(np.vstack([ring, ring[:1], [[np.nan, np.nan]]]))
        ned = np.vstack(rings)[:-1]
        out.append(Line(name, ned[:, 1], ned[:, 0], colour, width=1.4, inside=0.16))
    return out, f"Ellipses: 95 % of the horizontal position{drawn}.", ends


def centres(plane: Plane, rows: list[int]) -> Array:
    """Return east and north of marks, (k, 2), in the unit of the plan."""
    record = plane.found.record
    time = index_of(record.trajectory)
    at = np.searchsorted(time, index_of(record.sd)[rows] - 1e-9)
    near = record.trajectory.iloc[np.clip(at, 0, len(time) - 1)]
    return np.column_stack(plane.of(near))


def bound_labels(
    plane: Plane,
    view: PlanView,
    path: tuple[Array, Array],
    marks: list[Line],
    ends: list[tuple[int, Span]],
) -> list[Line]:
    """Return labels of the bound reached at the end of each outage, `ends` from `ellipses`.

    They avoid `path`, east and north, (n,), and the labels of `marks`.
    """
    if not ends:
        return []
    bounds = plane.found.bounds
    points = centres(plane, [k for k, _ in ends])
    words = tuple(
        f"{length_words(float(bounds[k]))} after {duration_words(s.end - s.begin)}" for k, s in ends
    )
    taken = [_text(m, view) for m in marks if m.labels]
    obstacles = np.vstack([view.corners, np.column_stack(path)[:: max(1, path[0].size // 150)]])
    east, north = points.T
    places = place_labels(east, north, words, np.vstack([obstacles, *taken]))
    named = dots("bound", east, north, VERMILLION, "circle", 3.0, labels=words, places=places)
    return [replace(named, legend=False)]


def _text(mark: Line, view: PlanView) -> Array:
    """Points on the labels of marks, (n, 2), approximately."""
    letter, line = _LETTER * view.width, _TEXT * float(view.high[1] - view.low[1])
    found = [np.column_stack([mark.x, mark.y])]
    for x, y, label, (side, rise) in zip(mark.x, mark.y, mark.labels, mark.places, strict=True):
        length = letter * len(label)
        left = x + side * 1.5 * letter - 0.5 * (1 - side) * length
        along = np.linspace(left, left + length, 5)
        found.append(np.column_stack([along, np.full(5, y + rise * line)]))
    return np.vstack(found)


# Level plane at the start of a run, in the unit of its plan.


@dataclass(frozen=True)
class Plane:
    """East and north about the start, in the unit of the plan.

    Attributes
    ----------
    origin : ndarray, (3,)
        The start: latitude and longitude in deg, height in m.
    unit : str
        ``m`` or ``km``.
    scale : float
        Plan units per m.
    """

    origin: Array
    found: NavigationEvaluation
    unit: str
    scale: float

    def of(self, table: pd.DataFrame) -> tuple[Array, Array]:
        """East and north of the rows of a table of positions, each (n,)."""
        ned = ned_from_geodetic(places_of(table), self.origin, ellipsoid=self.found.run.ellipsoid)
        return self.scale * ned[:, 1], self.scale * ned[:, 0]


def within_span(time: Array, span: Span) -> NDArray[np.bool_]:
    """Mask of the instants within a span."""
    return np.asarray((time >= span.begin) & (time <= span.end))
