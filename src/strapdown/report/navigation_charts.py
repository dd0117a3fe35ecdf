"""Charts of a navigation run over time: the state with its bounds, and the bounds alone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.constants import TWO_SIDED_95, Array
from strapdown.dsp.chi_square import chi_square_exceeded, normal_above
from strapdown.navigation.record import NavigationRecord, Span
from strapdown.navigation.truth_comparison import bounds
from strapdown.report.chart import (
    AXIS_COLOURS,
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    SKY,
    VERMILLION,
    Band,
    Chart,
    Fill,
    Level,
    Line,
    Panel,
    break_jumps,
    broken,
    curve,
    dots,
    kept_rows,
    thin_fill,
)
from strapdown.report.chart import BUCKETS_OVER_TIME as BUCKETS
from strapdown.report.navigation_evaluation import Agreement, NavigationEvaluation, rejected_times
from strapdown.report.values import NOT_ESTIMATED, plain
from strapdown.tables import EULER, NED, POSITION_SD, VELOCITY
from strapdown.tables.checks import height_words, index_of
from strapdown.tables.gnss import FIX_KINDS
from strapdown.tables.on_disk import stored

TIME = "time, s"
BOUND = "95 % bound"
SHADED = "Shaded: outages."
#: Bounds that vary by a larger factor have a logarithmic axis; else it has at most one label.
WIDE = 3.0


def over_time(
    of: NavigationEvaluation | NavigationRecord,
    slug: str,
    title: str,
    caption: str,
    panels: Sequence[Panel],
    statuses: tuple[Span, ...] = (),
) -> Chart:
    """Put panels over time below the strip of modes, measurements and heading status."""
    record = of.record if isinstance(of, NavigationEvaluation) else of
    above = strip(record, of.heading_spans if isinstance(of, NavigationEvaluation) else statuses)
    # Shaded bands of the outages.
    spans = {(s.begin, s.end) for spans in record.outages.values() for s in spans}
    bands = tuple(Band(begin, end, "outage") for begin, end in sorted(spans))
    told = f"{caption} {SHADED}" if bands else caption
    drawn = panels if above is None else (above, *panels)
    return Chart(slug, title, told.strip(), TIME, tuple(drawn), bands=bands)


def bound_chart(evaluation: NavigationEvaluation) -> Chart:
    """95 % bounds of position, velocity and attitude over the run."""
    sd = evaluation.record.sd
    time = index_of(sd)
    panels = []
    for title, unit, curves in (
        ("position", "m", (("horizontal", "", BLUE), ("height", "down", AXIS_COLOURS[0]))),
        ("velocity", "m/s", zip(NED, VELOCITY, AXIS_COLOURS, strict=True)),
        ("attitude", "deg", zip(EULER, EULER, AXIS_COLOURS, strict=True)),
    ):
        lines, every = [], []
        for (name, column, colour), dash in zip(curves, ("solid", "dash", "dot"), strict=False):
            value = evaluation.bounds
            if column:
                value = TWO_SIDED_95 * sd[column].to_numpy(dtype=np.float64)
            every.append(value[value > 0.0])
            if np.isnan(value).all():
                title += f" ({name} {NOT_ESTIMATED})"
                continue
            shown = np.where(value > 0.0, value, np.nan)
            lines.append(curve(name, time, shown, colour, dash, 1.6, buckets=BUCKETS))
        sizes = np.concatenate(every)
        log = bool(sizes.size and sizes.max() > WIDE * sizes.min())
        panels.append(Panel(f"{title}, {unit}", tuple(lines), log=log))
    return over_time(
        evaluation,
        "bounds",
        "95 % bounds",
        "1.96 standard deviations; of the horizontal position the semi-major axis of its 95 % "
        "ellipse.",
        panels,
    )


def height_chart(evaluation: NavigationEvaluation) -> Chart:
    """Height with its bound."""
    level = f"Above the ellipsoid ({evaluation.run.ellipsoid.name})."
    if evaluation.run.source.heights_as_stated:
        level = f"Heights are {height_words(as_stated=True)}."
    panel = _state_panel(evaluation, "alt", "down", "height, m")
    return over_time(evaluation, "height", "Height", level, (panel,))


def velocity_chart(evaluation: NavigationEvaluation) -> Chart:
    """Velocity over ground with its bounds."""
    panels = [
        _state_panel(evaluation, name, name, f"{words}, m/s")
        for name, words in zip(VELOCITY, NED, strict=True)
    ]
    return over_time(evaluation, "velocity", "Velocity", "Relative to the Earth.", panels)


def attitude_chart(evaluation: NavigationEvaluation) -> Chart:
    """Roll, pitch and heading with their bounds."""
    heading, marks, said = heading_shown(evaluation.record)
    panels = [_state_panel(evaluation, name, name, f"{name}, deg") for name in EULER[:2]]
    panels.append(_state_panel(evaluation, "heading", "heading", "heading, deg", (heading, marks)))
    return over_time(evaluation, "attitude", "Attitude", said, panels)


#: A heading that turns by more is drawn within 0 to 360 deg.
MOST_TURN = 900.0


def unwrapped(heading: Array) -> Array:
    """Headings in deg without jumps, starting within 0 to 360."""
    if not heading.size:
        return heading
    whole = np.unwrap(heading, period=360.0)
    return np.asarray(whole - 360.0 * np.floor(whole[0] / 360.0))


def heading_shown(record: NavigationRecord) -> tuple[Array, Array, str]:
    """Heading over the trajectory and at the marks, deg, for display, with its caption.

    It continues through north, unless it turns too often to be readable; then NaN breaks it at
    north.
    """
    time = index_of(record.trajectory)
    values = unwrapped(record.trajectory["heading"].to_numpy(dtype=np.float64))
    marks = np.interp(index_of(record.sd), time, values)
    if np.ptp(values) <= MOST_TURN:
        return values, marks, "The heading continues through north without a jump."
    return (
        break_jumps(values % 360.0),
        break_jumps(marks % 360.0),
        f"The heading turns by {plain(float(np.ptp(values)) / 360.0, 1)} full turns in all.",
    )


def at_marks(record: NavigationRecord, column: str) -> Array:
    """A trajectory column, other than heading, at the covariance marks."""
    time = index_of(record.trajectory)
    values = record.trajectory[column].to_numpy(dtype=np.float64)
    return np.asarray(np.interp(index_of(record.sd), time, values))


def _state_panel(
    evaluation: NavigationEvaluation,
    column: str,
    error: str,
    label: str,
    shown: tuple[Array, Array] | None = None,
) -> Panel:
    """Panel of a trajectory quantity, its bound at the marks, and the truth if there is one.

    `shown` holds the values over the trajectory and at the marks, if not those of the column.
    """
    record = evaluation.record
    time = index_of(record.trajectory)
    if shown is None:
        shown = _column(record.trajectory, column), at_marks(record, column)
    values, here = shown
    lines = [curve("navigated", time, values, BLUE, width=1.3, buckets=BUCKETS)]
    if evaluation.run.source.truth is not None:
        lines.append(_true(evaluation, column, values))
    at = index_of(record.sd)
    half = TWO_SIDED_95 * _column(record.sd, error)
    if np.isnan(half).all():
        return Panel(f"{label} ({NOT_ESTIMATED})", tuple(lines), height=0.8)
    fill = thin_fill(BOUND, at, here - half, here + half, BLUE, opacity=0.25)
    return Panel(label, tuple(lines), fills=(fill,), height=0.8)


def _column(table: pd.DataFrame, name: str) -> Array:
    """A column of a long table, whose pages in memory would hold all the columns."""
    return stored(table[name].to_numpy(dtype=np.float64))


def _true(evaluation: NavigationEvaluation, column: str, navigated: Array) -> Line:
    truth = evaluation.run.source.truth
    assert truth is not None
    time = evaluation.record.trajectory.index
    within = truth[(truth.index >= time[0]) & (truth.index <= time[-1])]
    values = within[column].to_numpy(dtype=np.float64)
    if column == "heading" and np.isnan(navigated).any():
        values = break_jumps(values % 360.0)
    elif column == "heading" and values.size:
        values = unwrapped(values)
        # Same number of turns as the navigated heading.
        values = values + 360.0 * np.round((navigated[0] - values[0]) / 360.0)
    stamps = index_of(within)
    return curve("truth", stamps, values, BLACK, "dot", 1.1, buckets=BUCKETS)


def state_charts(evaluation: NavigationEvaluation) -> tuple[Chart, ...]:
    """Estimated sensor and measurement errors that the run observed, with their bounds."""
    record, out = evaluation.run.filtered, []
    time = index_of(record.sensors)
    for block in evaluation.states:
        several = len(block.columns) > 1
        if len(evaluation.unobserved(block)) == len(block.columns):
            continue
        panels = []
        for k, (column, label) in enumerate(zip(block.columns, block.labels, strict=True)):
            told, sd = (_column(table, column) for table in (record.sensors, record.sensors_sd))
            value, reach = block.factor * told, TWO_SIDED_95 * block.factor * sd
            colour = AXIS_COLOURS[k % 3]
            line = curve("estimate", time, value, colour, width=1.6, buckets=BUCKETS)
            fill = thin_fill(BOUND, time, value - reach, value + reach, colour)
            name = f"{label if several else block.name}, {block.unit}"
            panels.append(Panel(name, (line,), fills=(fill,), height=0.7))
        out.append(
            over_time(
                record,
                f"state-{block.slug}",
                f"{block.name[0].upper()}{block.name[1:]}",
                "Measured or assumed − true. A state whose bound does not decrease is not "
                "observable in this motion.",
                panels,
                evaluation.heading_spans,
            )
        )
    return tuple(out)


# Strip above charts over time: modes, and availability of each measurement source.


_MODES = {"coarse": GREY, "fine": SKY, "navigation": BLUE}
_MORE = (PURPLE, ORANGE)
#: Color of each heading status, and the half height of its bar, which shows it without color.
STATUS_LOOKS = {
    "trusted": (GREEN, 0.45),
    "unverified": (ORANGE, 0.3),
    "rejected": (VERMILLION, 0.18),
}
_ROW, _PAD = 0.115, 0.05  # of a panel
_LETTER = 0.0085  # of the axis
_MOST_ROWS, _MOST_MARKS = 7, 200
# A step of more than this many usual steps ends a stretch; with fewer epochs than this no step is
# usual. Width of a single epoch, as a share of the whole.
_PAUSE, _FEW, _ALONE = 5.0, 4, 1.0 / 300.0


def mode_colour(name: str, names: tuple[str, ...]) -> str:
    """Color of a mode among those of a run."""
    for known, colour in _MODES.items():
        if name.startswith(known):
            return colour
    others = [n for n in names if not n.startswith(tuple(_MODES))]
    return _MORE[others.index(name) % len(_MORE)]


def strip(record: NavigationRecord, statuses: tuple[Span, ...] = ()) -> Panel | None:
    """Rows of modes, measurement sources and heading status; None if there are none.

    `statuses`: stretches of one heading status each.
    """
    time = index_of(record.trajectory)
    begins = [float(time[0]), *(m.begin for m in record.modes)]
    finishes = [float(time[-1]), *(m.end for m in record.modes)]
    whole = Span("", min(begins), max(finishes))
    # Earlier measurements were used for an alignment, not for navigation.
    going = Span("", float(time[0]), float(time[-1]))
    rows: list[str] = []
    fills: list[Fill] = []
    # Spans the whole axis, whatever the rows contain.
    ends = np.array([whole.begin, whole.end])
    lines = [Line("", ends, np.full(2, np.nan), GREY, points=True, size=0.0, legend=False)]
    if record.modes:
        rows.append("mode")
        names = tuple(dict.fromkeys(m.name for m in record.modes))
        for name in names:
            those = tuple(m for m in record.modes if m.name == name)
            fills.append(bar(name, those, 0.0, 0.45, mode_colour(name, names), 0.3))
        lines += span_names(record.modes, whole)
    # Sources with outages first.
    tables: dict[str, list[pd.DataFrame]] = {aid: [] for aid in record.outages}
    for name, table in record.innovations.items():
        tables.setdefault(name.rpartition(".")[0] or name, []).append(table)
    for aid in [*tables][: _MOST_ROWS - len(rows) - bool(statuses)]:
        at = float(len(rows))
        rows.append(aid)
        out = record.outages.get(aid, ())
        used = (
            _between(out, going)
            if aid in record.outages
            else _stretches(_joined([index_of(table) for table in tables[aid]]), going)
        )
        fills.append(bar("used", used, at, 0.3, GREEN))
        if out:
            fills.append(bar("outage", out, at, 0.13, VERMILLION))
        lost = _joined([rejected_times(table) for table in tables[aid]])
        cell = (whole.end - whole.begin) / _MOST_MARKS
        if lost.size > _MOST_MARKS and cell > 0.0:
            # As many as can be distinguished.
            _, first = np.unique(np.floor((lost - whole.begin) / cell), return_index=True)
            lost = lost[first]
        if lost.size:
            lines.append(dots("rejected", lost, np.full(lost.size, at), VERMILLION, "x", 6.0))
    if statuses:
        for status, (colour, half_height) in STATUS_LOOKS.items():
            # A status holds for a whole second, the last one beyond the end.
            those = tuple(
                Span(status, max(one.begin, whole.begin), min(one.end, whole.end))
                for one in statuses
                if one.name == status and one.begin < whole.end and one.end > whole.begin
            )
            if those:
                thick = 0.85 * half_height
                fills.append(bar(f"heading {status}", those, float(len(rows)), thick, colour))
        rows.append("heading")
    if not rows:
        return None
    return Panel(
        "",
        tuple(lines),
        categories=tuple(rows),
        height=_PAD + _ROW * len(rows),
        fills=tuple(fills),
    )


def _joined(times: list[Array]) -> Array:
    return np.unique(np.concatenate(times)) if times else np.empty(0)


def _stretches(time: Array, whole: Span) -> tuple[Span, ...]:
    """Stretches of epochs at their usual steps, widened to be visible."""
    if not time.size:
        return ()
    steps = np.diff(time)
    usual = float(np.median(steps)) if time.size >= _FEW else 0.0
    ends = np.flatnonzero(steps > _PAUSE * usual)
    begins = time[np.concatenate([[0], ends + 1])]
    lasts = time[np.append(ends, time.size - 1)]
    least = _ALONE * (whole.end - whole.begin)
    more = np.maximum(0.5 * (least - (lasts - begins)), 0.0)
    return tuple(
        Span("used", float(a), float(b))
        for a, b in zip(
            np.maximum(begins - more, whole.begin), np.minimum(lasts + more, whole.end), strict=True
        )
    )


def _between(out: tuple[Span, ...], whole: Span) -> tuple[Span, ...]:
    """Return the remainder of a span outside of other spans."""
    found, at = [], whole.begin
    for span in sorted(out, key=lambda s: s.begin):
        if span.begin > at:
            found.append(Span("used", at, span.begin))
        at = max(at, span.end)
    if at < whole.end:
        found.append(Span("used", at, whole.end))
    return tuple(found)


def bar(
    name: str, spans: tuple[Span, ...], at: float, thick: float, colour: str, opacity: float = 0.75
) -> Fill:
    """Bars of a row of a strip over spans: its number from the top, and their half height."""
    x = [v for s in spans for v in (s.begin, s.end, np.nan)][:-1]
    y = [v for _ in spans for v in (at, at, np.nan)][:-1]
    rows = np.array(y)
    return Fill(name, np.array(x), rows - thick, rows + thick, colour, opacity)


def span_names(modes: tuple[Span, ...], whole: Span) -> list[Line]:
    """Names of spans in their bars, where they fit."""
    length = max(whole.end - whole.begin, 1e-9)
    fit = [m for m in modes if (m.end - m.begin) / length > _LETTER * (len(m.name) + 2)]
    if not fit:
        return []
    x = [0.5 * (m.begin + m.end) for m in fit]
    labels, places = tuple(m.name for m in fit), ((0, 0),) * len(fit)
    named = dots("mode", x, np.zeros(len(fit)), GREY, size=0.0, labels=labels, places=places)
    return [replace(named, legend=False)]


# Charts of a navigation run against its truth.


_LEAST = 1e-2
_NAMES = dict(zip(VELOCITY, NED, strict=True))


def error_charts(evaluation: NavigationEvaluation) -> tuple[Chart, ...]:
    """Errors of position, velocity and attitude within their bounds; none without a truth."""
    errors = evaluation.errors
    if errors is None:
        return ()
    out = []
    for slug, title, columns, unit in (
        ("errors-position", "Position errors", NED, "m"),
        ("errors-velocity", "Velocity errors", VELOCITY, "m/s"),
        ("errors-attitude", "Attitude errors", EULER, "deg"),
    ):
        panels = []
        for k, column in enumerate(columns):
            half, error = errors.bound(column), errors.error(column)
            label = f"{_NAMES.get(column, column)}, {unit}"
            lines = (curve("error", errors.time, error, AXIS_COLOURS[k], buckets=BUCKETS),)
            if np.isnan(half).all():
                panels.append(Panel(f"{label} ({NOT_ESTIMATED})", lines, height=0.8))
                continue
            fills = (thin_fill(BOUND, errors.time, -half, half, AXIS_COLOURS[k]),)
            panels.append(Panel(label, lines, fills=fills, height=0.8))
        caption = f"Computed − {evaluation.truth_name}, with the run's 95 % bounds."
        out.append(over_time(evaluation, slug, title, caption, panels))
    return tuple(out)


def nees_chart(evaluation: NavigationEvaluation) -> Chart | None:
    """NEES of position, velocity and attitude; None without a truth or without bounds."""
    errors = evaluation.errors
    freedom = 0 if errors is None else errors.freedom.get("all", 0)
    if errors is None or not freedom:
        return None
    low, high = bounds(freedom)
    nees = np.maximum(errors.nees["all"].to_numpy(), _LEAST)
    panel = Panel(
        "NEES",
        (curve("position, velocity and attitude", errors.time, nees, BLUE, buckets=BUCKETS),),
        log=True,
        levels=(Level(low, "2.5 %"), Level(high, "97.5 %")),
    )
    return over_time(
        evaluation,
        "nees",
        "Normalized estimation error squared (NEES)",
        f"Expected value {freedom}; at one instant 95 % of many runs lie between the "
        "levels. The errors of one run are correlated in time.",
        (panel,),
    )


# Innovation charts.


# Innovations beyond this multiple of the usual bound are drawn at the edge.
_REACH, _USUAL = 2.5, 0.97
# Epochs of a mean.
_WINDOW = 20
# Points per panel; innovations within this many standard deviations are thinned to it.
_POINTS, _FAR = 500, 3.0


def innovation_chart(
    record: NavigationRecord, agreement: Agreement, statuses: tuple[Span, ...] = ()
) -> Chart:
    """Innovations of one observation with their expected 95 % bounds."""
    panels = []
    beyond = 0
    step = max(1, agreement.epochs // _POINTS)
    for k, label in enumerate(agreement.labels):
        nu, bound = agreement.nu[:, k], TWO_SIDED_95 * agreement.sd[:, k]
        edge = _REACH * float(np.quantile(bound, _USUAL))
        low, high = np.clip(-bound, -edge, edge), np.clip(bound, -edge, edge)
        time, low, high = broken(agreement.time, low, high)
        fill = thin_fill("95 % expected", time, low, high, GREY, opacity=0.22)
        lost = agreement.weight[:, k] <= 0.0
        out = np.abs(nu) > edge
        beyond += int(out.sum())
        colour = AXIS_COLOURS[k % 3]
        # All large innovations, and the others thinned evenly in time.
        with np.errstate(divide="ignore", invalid="ignore"):
            far = np.abs(nu) > _FAR * agreement.sd[:, k]
        drawn = ~lost & ~out & (far | (np.arange(agreement.epochs) % step == 0))
        lines = [
            *_points("used", agreement.time, nu, drawn, colour, "circle", 3.4),
            *_points("rejected", agreement.time, nu, lost & ~out, VERMILLION, "x", 6.0),
        ]
        for sign, symbol in ((1.0, "triangle-up"), (-1.0, "triangle-down")):
            some = out & ((nu > 0.0) == (sign > 0.0))
            at = np.full(nu.size, sign * edge)
            lines += _points("beyond the axis", agreement.time, at, some, BLACK, symbol, 6.0)
        panels.append(Panel(label, tuple(lines), fills=(fill,), height=0.7))
    more = f" {beyond} are beyond the axis and drawn at its end." if beyond else ""
    if step > 1:
        more += f" Of those within {_FAR:g} standard deviations one in {step} is drawn."
    slug = f"innovations-{agreement.name.replace('.', '-').replace('_', '-')}"
    title = f"Innovations of {agreement.name}"
    caption = f"Measured − predicted; 95 % are expected in the band.{more}"
    return over_time(record, slug, title, caption, panels, statuses)


def fix_charts(evaluation: NavigationEvaluation) -> tuple[Chart, ...]:
    """Kind, satellites and stated accuracy of the fixes of each receiver; none if all constant."""
    found = [
        _fix_chart(evaluation, aid, table)
        for aid, table in evaluation.run.source.tables.items()
        if "quality" in table and len(table) > 1
    ]
    return tuple(chart for chart in found if chart is not None)


def _fix_chart(evaluation: NavigationEvaluation, aid: str, table: pd.DataFrame) -> Chart | None:
    record = evaluation.record
    time = index_of(table)
    going = (time >= record.trajectory.index[0]) & (time <= record.trajectory.index[-1])
    time = time[going]

    def column(name: str) -> Array:
        return np.asarray(table[name].to_numpy(dtype=np.float64)[going])

    panels = []
    quality = column("quality")
    kinds = [k for k in FIX_KINDS if (quality == k).any()]
    if len(kinds) > 1:
        at = np.full(quality.size, np.nan)
        for row, kind in enumerate(kinds):
            at[quality == kind] = row
        rows = kept_rows((at,), BUCKETS)
        drawn = dots("fix", time[rows], at[rows], BLUE, "circle", 3.2)
        names = tuple(FIX_KINDS[k] for k in kinds)
        panels.append(Panel("", (drawn,), categories=names, height=0.12 * len(names) + 0.05))
    if "satellites" in table and np.isfinite(satellites := column("satellites")).any():
        line = curve("satellites", time, satellites, GREEN, buckets=BUCKETS)
        panels.append(Panel("satellites", (line,), height=0.6, steady=1.0))
    lines = []
    for name, columns, colour, dash in (
        ("horizontal", POSITION_SD[:2], BLUE, "solid"),
        ("vertical", POSITION_SD[2:], VERMILLION, "dash"),
    ):
        sd = np.sqrt(np.sum([np.square(column(c)) for c in columns], axis=0))
        sd = np.where(np.isfinite(sd) & (sd > 0.0), sd, np.nan)
        if np.isfinite(sd).any() and np.nanmax(sd) > np.nanmin(sd):
            lines.append(curve(name, time, sd, colour, dash, buckets=BUCKETS))
    if lines:
        panels.append(Panel("stated sd, m", tuple(lines), log=True, height=0.8))
    if not panels:
        return None
    return over_time(
        evaluation,
        f"fixes-{aid.replace('_', '-')}",
        f"Fixes of {aid}",
        "As the receiver states them: kind of fix, satellites used, and one standard deviation of "
        "position.",
        panels,
    )


def _points(
    name: str,
    time: Array,
    value: Array,
    some: NDArray[np.bool_],
    colour: str,
    symbol: str,
    size: float,
) -> list[Line]:
    if not some.any():
        return []
    time, value = time[some], value[some]
    rows = kept_rows((value,), BUCKETS)
    return [dots(name, time[rows], value[rows], colour, symbol, size)]


def nis_chart(
    record: NavigationRecord, found: tuple[Agreement, ...], statuses: tuple[Span, ...] = ()
) -> Chart | None:
    """NIS of every observation, with its expected range."""
    panels = []
    thin = any(one.epochs >= 2 * _POINTS for one in found)
    for k, one in enumerate(found):
        if not one.used.any():
            continue
        low, high = bounds(len(one.labels))
        nis = np.maximum(one.nis, _LEAST)
        colour = AXIS_COLOURS[(2 + k) % 3]
        step = max(1, one.epochs // _POINTS)
        # Quantile of chi-square with the two-sided exceedance probability of three sigma.
        drawn = (np.arange(one.epochs) % step == 0) | (
            one.nis > float(chi_square_exceeded(2.0 * normal_above(3.0), len(one.labels)))
        )
        lines = _points("epoch", one.time, nis, one.used & drawn, colour, "circle", 3.2)
        lines += _points("rejected", one.time, nis, ~one.used, VERMILLION, "x", 6.0)
        lines += _mean(one)
        levels = (Level(low, "2.5 %"), Level(high, "97.5 %"))
        panels.append(Panel(f"{one.name}", tuple(lines), log=True, levels=levels, height=0.8))
    if not panels:
        return None
    return over_time(
        record,
        "nis",
        "Normalized innovations squared (NIS)",
        "95 % are expected between the levels. Line: mean of "
        f"{_WINDOW} processed epochs."
        + (" Points are thinned, except the largest." if thin else ""),
        panels,
        statuses,
    )


def _mean(one: Agreement) -> list[Line]:
    nis, time = one.nis[one.used], one.time[one.used]
    if nis.size < 2 * _WINDOW:
        return []
    total = np.cumsum(np.concatenate([[0.0], nis]))
    mean = (total[_WINDOW:] - total[:-_WINDOW]) / _WINDOW
    middle = time[_WINDOW // 2 : _WINDOW // 2 + mean.size]
    middle, mean = broken(middle, mean)
    rows = kept_rows((mean,), BUCKETS // 2)
    return [Line("mean", middle[rows], mean[rows], BLACK, width=1.4)]
