"""Charts of a comparison: differences over time, plans, attitudes, rates, cones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from strapdown.ellipsoids import find_ellipsoid
from strapdown.frames import ned_from_geodetic
from strapdown.report import values
from strapdown.report.chart import (
    BLACK,
    BLUE,
    BUCKETS_OVER_TIME,
    GREEN,
    GREY,
    PURPLE,
    SERIES_COLOURS,
    VERMILLION,
    Chart,
    Fill,
    Line,
    Panel,
    break_jumps,
    broken,
    curve,
    kept_rows,
    look,
    thin_fill,
)
from strapdown.report.compare_tracks import QUANTITIES, VEHICLE, Difference, Track
from strapdown.report.plan import PlanView, path_marks
from strapdown.tables import places_of
from strapdown.tables.checks import Array

if TYPE_CHECKING:
    from strapdown.report.compare import RunComparison


#: Colors of the runs, the same in plan and charts.
FIRST_COLOURS = (BLUE, VERMILLION, GREEN, PURPLE)
COLOURS = (*FIRST_COLOURS, *(c for c in SERIES_COLOURS if c not in FIRST_COLOURS))


def in_units(system: str | None, unit: str) -> tuple[float, str]:
    """Factor and unit in which a length or a speed is shown; `system`: of units, of a crash."""
    if system is None or unit not in ("m", "m/s"):
        return 1.0, unit
    with values.shown_in(system):
        if unit == "m":
            return values.length_factor(), values.length_unit()
        return values.speed_factor(), values.speed_unit()


def quantity_words(result: RunComparison, name: str) -> tuple[str, str]:
    """Words and unit of a quantity over time, along the axes of its positions."""
    words, unit = QUANTITIES[name]
    if any(track.frame == VEHICLE for track in result.tracks[0]):
        words = words.replace("north", "forward").replace("east", "right")
    return words, unit


def charts(result: RunComparison) -> tuple[Chart, ...]:
    """Return the charts of a comparison: differences over time, plans, attitudes, cones."""
    found: list[Chart | None] = []
    labels = list(
        dict.fromkeys(t.label for own in result.tracks for t in own if t.kind != "attitude")
    )
    for label in labels:
        end = f"-{label.replace(' ', '-')}" if label else ""
        found.append(_differences_chart(result, label, end))
        found.append(_plan_chart(result, label, end))
    found += [_attitude_chart(result), _sweep_chart(result), _cone_chart(result)]
    return tuple(chart for chart in found if chart is not None)


def _style(k: int) -> tuple[str, str]:
    return COLOURS[k % len(COLOURS)], look(k)["dash"]


def _differences_chart(result: RunComparison, label: str, end: str) -> Chart | None:
    """Differences from the first run with the bounds of both."""
    own = [one for one in result.differences if one.label == label and "horizontal" in one.table]
    if not own:
        return None
    two = len(result.runs) == 2
    panels = []
    for name in ("horizontal", "height", "VN", "VE", "VD", "roll", "pitch", "heading"):
        drawn = [one for one in own if np.isfinite(one.table[name].to_numpy()).any()]
        if drawn:
            panels.append(_panel(result, drawn, name, two))
    if not panels:
        return None
    first = result.runs[0].name
    caption = f"Minus {first}."
    if any("horizontal_combined" in one.table for one in own):
        caption += (
            " Shaded: 95 % bound of the difference. Dashed and dotted: 95 % bounds of the runs."
            if two
            else " Dashed: 95 % bound of each difference."
        )
    title = f"Differences of {label}" if label else "Differences"
    return Chart(f"differences{end}", title, caption, "time, s", tuple(panels))


def _panel(result: RunComparison, own: Sequence[Difference], name: str, two: bool) -> Panel:
    words, unit = quantity_words(result, name)
    factor, unit = in_units(result.units, unit)
    lines: list[Line] = []
    fills: list[Fill] = []
    for one in own:
        colour = BLACK if two else _style(one.run)[0]
        time = one.table.index.to_numpy(dtype=np.float64)
        value = factor * one.table[name].to_numpy(dtype=np.float64)
        if name in ("heading", "roll"):
            value = break_jumps(value)
        other = result.runs[one.run].name
        at, value = broken(time, value)
        text = "difference" if two else other
        lines.append(curve(text, at, value, colour, width=1.5, buckets=BUCKETS_OVER_TIME))
        if f"{name}_combined" not in one.table:
            continue
        combined, first, last = (
            factor * one.table[f"{name}_{key}"].to_numpy(dtype=np.float64)
            for key in ("combined", "first", "other")
        )
        # A distance has no lower bound.
        signs = (1.0,) if name == "horizontal" else (1.0, -1.0)
        if not two:
            for sign in signs:
                bound = sign * combined
                line = curve(other, time, bound, colour, "dash", 1.0, BUCKETS_OVER_TIME)
                lines.append(replace(line, legend=False))
            continue
        low = np.zeros(len(time)) if name == "horizontal" else -combined
        fills.append(
            thin_fill("95 % bound of the difference", time, low, combined, GREY, opacity=0.22)
        )
        for k, bound, dash in ((0, first, "dash"), (1, last, "dot")):
            text = f"95 % bound of {result.runs[k].name}"
            for sign in signs:
                line = curve(text, time, sign * bound, _style(k)[0], dash, 1.1, BUCKETS_OVER_TIME)
                lines.append(line if sign > 0.0 else replace(line, legend=False))
    return Panel(
        f"{words.replace('position, ', '')}, {unit}", tuple(lines), fills=tuple(fills), height=0.75
    )


def _plan_chart(result: RunComparison, label: str, end: str) -> Chart | None:
    """All tracks from above, in the level plane at the begin of the first."""
    own = [[t for t in one if t.label == label and t.kind != "attitude"] for one in result.tracks]
    found = [(k, tracks[0]) for k, tracks in enumerate(own) if tracks]
    if len(found) < 2 or len({one.frame for _, one in found}) > 1:
        return None
    origin = None
    paths: list[tuple[int, Array, Array, Array]] = []
    for k, one in found:
        rows = kept_rows(_plane(one, None)[:2], 700)
        if one.kind == "geodetic" and origin is None:
            origin = places_of(one.table.iloc[:1])[0]
        thinned = replace(one, table=one.table.iloc[rows])
        east, north = _plane(thinned, origin)[:2]
        paths.append((k, thinned.time, east, north))
    reach = max(float(np.ptp(axis)) for _, _, east, north in paths for axis in (east, north))
    if not 0.05 <= reach < 5e6:
        return None
    scale, unit = (1e-3, "km") if reach >= 20e3 else in_units(result.units, "m")
    drawn = [(scale * east, scale * north) for _, _, east, north in paths]
    tight = PlanView.of(drawn, most=0.9)
    margin = 0.04 * (tight.high - tight.low)
    view = PlanView(tight.low - margin, tight.high + margin)
    lines: list[Line] = []
    for (k, time, _, _), (east, north) in zip(paths, drawn, strict=True):
        colour, dash = _style(k)
        width = 2.6 if not lines else 1.6
        name, dash = result.runs[k].name, dash if k else "solid"
        lines.append(Line(name, east, north, colour, dash, width, stamps=time))
    lines += path_marks(paths[0][1], drawn, view, BLACK)
    names = ("forward", "right") if found[0][1].frame == VEHICLE else ("north", "east")
    title = f"Paths of {label}" if label else "Paths"
    caption = "To one scale, about the begin of the first; arrows and times are those of the first."
    panel = Panel(
        f"{names[0]}, {unit}", tuple(lines), x_label=f"{names[1]}, {unit}", height=view.height
    )
    return Chart(f"plan{end}", title, caption, "time, s", (panel,))


def _plane(track: Track, origin: Array | None) -> tuple[Array, Array]:
    """East and north, m; without an origin in any unit, for thinning."""
    if track.kind == "local":
        return track.table["east"].to_numpy(), track.table["north"].to_numpy()
    if origin is None:
        return track.table["lon"].to_numpy(), track.table["lat"].to_numpy()
    ned = ned_from_geodetic(places_of(track.table), origin, ellipsoid=find_ellipsoid(track.frame))
    return ned[:, 1], ned[:, 0]


def _attitude_chart(result: RunComparison) -> Chart | None:
    """Angle between the attitudes of each algorithm and those of the first run."""
    own = [one for one in result.differences if "angle" in one.table]
    if not own:
        return None
    algorithms = list(dict.fromkeys(one.label for one in own))
    panels = []
    for k in dict.fromkeys(one.run for one in own):
        lines = []
        for one in (o for o in own if o.run == k):
            style = look(algorithms.index(one.label))
            time = one.table.index.to_numpy(dtype=np.float64)
            at, angle = broken(time, one.table["angle"].to_numpy())
            colour, dash = style["colour"], style["dash"]
            lines.append(curve(one.label, at, angle, colour, dash, buckets=BUCKETS_OVER_TIME))
        title = result.runs[k].name if len(result.runs) > 2 else ""
        panels.append(Panel("angle between, deg", tuple(lines), title=title))
    caption = f"Against {result.runs[0].name}, by algorithm."
    return Chart("attitude", "Attitudes", caption, "time, s", tuple(panels))


def _sweep_chart(result: RunComparison) -> Chart | None:
    """Errors of the algorithms over the rate, of averaged samples."""
    lines: list[Line] = []
    own = [(k, one) for k, some in enumerate(result.curves) for one in some if one.kind == "sweep"]
    names = list(dict.fromkeys(one.label for _, one in own))
    for k, one in own:
        style, dash = look(names.index(one.label)), ("solid", "dash", "dot", "dashdot")[k % 4]
        text = f"{one.label}, {result.runs[k].name}"
        marks = {"dots": True, "symbol": style["symbol"], "size": 5.0}
        lines.append(Line(text, one.x, one.y, style["colour"], dash, **marks))  # type: ignore[arg-type]
    if not lines:
        return None
    panel = Panel("largest error, deg", tuple(lines), log=True)
    caption = f"Samples averaged to each rate; solid: {result.runs[0].name}."
    return Chart("sweep", "Error by algorithm and rate", caption, "rate, Hz", (panel,), log_x=True)


def _cone_chart(result: RunComparison) -> Chart | None:
    """95 % bounds of the drift in an outage."""
    lines: list[Line] = []
    for k, some in enumerate(result.curves):
        for one in some:
            if one.kind == "cone":
                colour, dash = _style(k)
                lines.append(curve(result.runs[k].name, one.x, one.y, colour, dash, 1.8))
    if not lines:
        return None
    panel = Panel("horizontal drift, 95 %, m", tuple(lines))
    label = "time since the begin of the outage, s"
    return Chart("cone", "Drift in the outage", "", label, (panel,))
