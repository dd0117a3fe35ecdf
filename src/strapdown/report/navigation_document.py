"""Results of a navigation run in sentences, shared by terminal and page."""

from __future__ import annotations

import math

import numpy as np

from strapdown.config.choice import ChoiceSpec
from strapdown.constants import TWO_SIDED_95, Array
from strapdown.evaluation.trajectory_differences import trajectory_differences
from strapdown.navigation.record import NavigationRecord, Span
from strapdown.navigation.truth_comparison import SmootherConsistency
from strapdown.report.chart import AXIS_COLOURS, BLUE, GREY, Chart, Panel, curve, thin_fill
from strapdown.report.chart import BUCKETS_OVER_TIME as BUCKETS
from strapdown.report.document import (
    Block,
    Document,
    Facts,
    KeyFigure,
    KeyFigures,
    Paragraph,
    TableBlock,
    assumed,
    capital,
    document_of,
    findings_list,
    items_of,
    paragraph,
    run_again,
    section,
    table_of,
)
from strapdown.report.navigation_evaluation import (
    FELL,
    NavigationEvaluation,
    distance_over_ground,
    horizontal_bounds,
    state_groups,
    trust,
)
from strapdown.report.values import (
    GAP,
    NOT_ESTIMATED,
    about,
    decimals,
    duration_words,
    half,
    heading_shown,
    length_words,
    plain,
    plus_minus,
    share_words,
)
from strapdown.report.values import stamp as instant
from strapdown.report.verdict import integrity_sections, status_words, without_arm
from strapdown.rotation import within_half_turn
from strapdown.systems.navigation_run import NavigationRun, withheld_aid
from strapdown.tables import EULER, NED, VELOCITY
from strapdown.tables.checks import height_words, index_of

# Outages whose largest bound exceeds the median by less do not limit the result.
_WORSE = 1.5
# 95 % bound in deg from which a heading is unknown.
_NO_HEADING = 180.0


def headline(evaluation: NavigationEvaluation) -> str:
    """Return the end position, the distance traveled, and the bounds."""
    record, arm = evaluation.record, without_arm(evaluation.run)
    bound = half(record.sd["heading"].iloc[-1])
    said = "unknown" if bound >= _NO_HEADING else plus_minus(bound, "°").removeprefix(f"±{GAP}")
    return (
        f"Ended at {position_words(evaluation)} after {duration_words(_duration(evaluation))} and "
        f"{length_words(distance_over_ground(record.trajectory))}; 95 % bounds: position "
        f"{length_words(float(evaluation.bounds[-1]))}{f' ({arm})' if arm else ''}, "
        f"heading {said}."
    )


def position_words(evaluation: NavigationEvaluation, row: int = -1) -> str:
    """Latitude, longitude and height of a row: ``40.096627°, −105.147448°, 1601.5 m``."""
    last = evaluation.record.trajectory.iloc[row]
    lon = float(within_half_turn(last["lon"]))
    return (
        f"{plain(float(last['lat']), 6)}°, {plain(lon, 6)}°, {plain(float(last['alt']), 1)}{GAP}m"
    )


def key_figures(evaluation: NavigationEvaluation) -> tuple[KeyFigure, ...]:
    """Return the key figures at the top of the page."""
    record = evaluation.record
    sd = record.sd.iloc[-1]
    last = record.trajectory.iloc[-1]
    plane, arm = float(evaluation.bounds[-1]), without_arm(evaluation.run)
    heading = half(sd["heading"])
    out = [
        KeyFigure(
            "Distance and time",
            length_words(distance_over_ground(record.trajectory)),
            f"in {duration_words(_duration(evaluation))}",
            f"from {instant(float(record.trajectory.index[0]))} to "
            f"{instant(float(record.trajectory.index[-1]))}",
        ),
        KeyFigure(
            "Final position",
            f"±{GAP}{length_words(plane)}",
            f"horizontal, 95{GAP}%{arm and f', {arm}'}; "
            f"height {_stated(float(last['alt']), sd['down'], 'm')}",
            position_words(evaluation),
        ),
        KeyFigure(
            "Final heading",
            "unknown"
            if heading >= _NO_HEADING
            else about(heading_shown(float(last["heading"]), heading), heading, "°"),
            f"95{GAP}% bound; {status_words(evaluation.run.trust)}",
            f"roll {about(float(last['roll']), half(sd['roll']), '°')}, pitch "
            f"{about(float(last['pitch']), half(sd['pitch']), '°')}",
        ),
    ]
    out.append(_known(evaluation))
    return tuple(out)


def _known(evaluation: NavigationEvaluation) -> KeyFigure:
    """The main figure besides the end: the error, the worst outage, or the worst bound."""
    if evaluation.errors is not None:
        score = evaluation.errors.score("horizontal")
        up = evaluation.errors.score("down")
        return KeyFigure(
            f"Error against {evaluation.truth_name}",
            length_words(score.rms),
            f"horizontal, RMS; at most {length_words(score.largest)}",
            f"height {length_words(up.rms)}, at most {length_words(up.largest)}",
        )
    outages = longest_outages(evaluation)
    if outages:
        aid, span, bound = max(outages, key=lambda o: o[2])
        return KeyFigure(
            "Largest bound in an outage",
            f"±{GAP}{length_words(bound)}",
            f"horizontal, 95{GAP}%, after {duration_words(span.end - span.begin)} without {aid}",
            f"{len(outages)} {'outage' if len(outages) == 1 else 'outages'} in all",
        )
    bounds = evaluation.bounds
    worst = int(np.argmax(bounds))
    return KeyFigure(
        "Largest bound",
        f"±{GAP}{length_words(float(bounds[worst]))}",
        f"horizontal, 95{GAP}%, at {instant(float(evaluation.record.sd.index[worst]))}",
        "no outage",
    )


def longest_outages(evaluation: NavigationEvaluation) -> list[tuple[str, Span, float]]:
    """Source, span and largest horizontal bound in m of each outage, in time order."""
    known = [(aid, span, bound) for aid, span, bound in evaluation.outages if bound is not None]
    return sorted(known, key=lambda o: (o[1].begin, o[0]))


def cautions(
    evaluation: NavigationEvaluation, *, brief: bool = False
) -> tuple[tuple[str, str], ...]:
    """Return the cautions, each with its number; brief, without those that the tables show."""
    shown = () if brief else _of_tables(evaluation)
    end = float(evaluation.record.trajectory.index[-1])
    late = [(a, s) for a, s, _ in longest_outages(evaluation) if s.end >= end - 1e-6]
    return (
        *_outages(evaluation),
        *(
            (
                f"It ended without {aid}",
                f"the last {duration_words(span.end - span.begin)} are by the inertial sensors "
                "alone; a fix would correct them.",
            )
            for aid, span in late
        ),
        *_heading_caution(evaluation),
        *shown,
        *agreement_words(evaluation),
    )


def _outages(evaluation: NavigationEvaluation) -> list[tuple[str, str]]:
    outages = longest_outages(evaluation)
    if not outages:
        return []
    total = math.fsum(s.end - s.begin for _, s, _ in outages)
    aid, span, bound = max(outages, key=lambda o: o[2])
    if bound < _WORSE * float(np.median(evaluation.bounds)):
        return []
    count = "one outage" if len(outages) == 1 else f"{len(outages)} outages"
    text = (
        f"{count}, {duration_words(total)} in all; the largest bound of 95{GAP}% is "
        f"{length_words(bound)}, within {duration_words(span.end - span.begin)} without {aid} "
        f"from {instant(span.begin)}."
    )
    return [("In outages the position is less accurate", text)]


def _heading_caution(evaluation: NavigationEvaluation) -> list[tuple[str, str]]:
    bound = half(evaluation.record.sd["heading"].iloc[-1])
    if bound < 2.0:
        return []
    how = "is unknown" if bound >= _NO_HEADING else f"has a 95 % bound of {plain(bound, 1)}°"
    text = (
        "without fixes the cross-track error grows by "
        f"{plain(min(100.0, 100.0 * math.radians(min(bound, 90.0))), 1)}{GAP}% of the "
        "distance. Acceleration and turns with fixes determine the heading, or two antennas."
    )
    return [(f"The heading {how}", text)]


def _of_tables(evaluation: NavigationEvaluation) -> list[tuple[str, str]]:
    """Cautions that tables show as well: innovations, and states whose bounds hardly decreased."""
    out = [
        (
            f"Innovations of {one.name} are correlated",
            f"lag 1: {plain(one.correlation, 2)}; 95 % limit {plain(one.correlation_bound, 2)}. "
            "Its errors are time-correlated, and the bounds are too small. Look for a time "
            "offset, a lever arm, or sensor noise that is stated too small.",
        )
        for one in evaluation.agreements
        if one.remembers
    ]
    rejected = [
        f"{one.rejected} of {one.epochs} epochs of {one.name}"
        for one in evaluation.agreements
        if one.rejected
    ]
    if rejected:
        out.append(("Rejected", f"{', '.join(rejected)}; shown as crosses."))
    return [*out, *_not_told(evaluation)]


def _not_told(evaluation: NavigationEvaluation) -> list[tuple[str, str]]:
    """States whose bounds hardly decreased."""
    names = []
    for block in evaluation.states:
        some = ", ".join(evaluation.unobserved(block))
        if some:
            names.append(f"{block.name} {some}" if len(block.labels) > 1 else block.name)
    text = f"bound reduced by less than {plain(100.0 * FELL, 0)}{GAP}%: {'; '.join(names)}."
    return [("Not observable in this run", text)] if names else []


def _duration(evaluation: NavigationEvaluation) -> float:
    time = evaluation.record.trajectory.index
    return float(time[-1] - time[0])


# Effect of the smoother: bounds and errors beside those of the filter alone.


# Instants of the chart of separations.
_SEPARATIONS = 2000
#: A smaller share of the differences within three standard deviations is not due to chance.
SHARE = 0.95
UNITS = dict.fromkeys(NED, "m") | dict.fromkeys(VELOCITY, "m/s") | dict.fromkeys(EULER, "°")


def smoothing_chart(evaluation: NavigationEvaluation) -> Chart | None:
    """Bounds of position, height and heading over time, filter and smoother."""
    from strapdown.report.navigation_charts import over_time

    forward, record = evaluation.run.forward, evaluation.record
    if forward is None:
        return None
    panels = []
    for column, label in (
        ("horizontal", "horizontal, m"),
        ("down", "height, m"),
        ("heading", "heading, deg"),
    ):
        if column in record.not_estimated:
            continue
        lines = []
        for name, one, colour, width in (
            ("filter", forward, GREY, 1.2),
            ("smoothed", record, BLUE, 1.6),
        ):
            time, bound = one.sd.index.to_numpy(), _bound(one, column)
            lines.append(curve(name, time, bound, colour, width=width, buckets=BUCKETS))
        panels.append(Panel(label, tuple(lines), log=True))
    return over_time(
        evaluation,
        "smoothing",
        "Filter and smoother",
        "95 % bounds: of the filter, from the measurements up to each instant; smoothed, from all "
        "measurements.",
        panels,
    )


def separation_chart(evaluation: NavigationEvaluation) -> Chart | None:
    """Filter − smoothed solution in position, with the bound of a consistent smoother."""
    from strapdown.report.navigation_charts import over_time

    forward, record = evaluation.run.forward, evaluation.record
    if forward is None:
        return None
    marks = index_of(forward.sd)
    rows = np.searchsorted(index_of(forward.trajectory), marks - 1e-7)
    # Of several marks before one row the last is that of the row.
    kept = np.flatnonzero(np.append(rows[1:] > rows[:-1], True) & (rows < len(forward.trajectory)))
    kept = kept[:: max(1, -(-kept.size // _SEPARATIONS))]
    before, after = (one.trajectory.iloc[rows[kept]] for one in (forward, record))
    apart = trajectory_differences(before, after, evaluation.run.ellipsoid)
    panels = []
    for column, colour in zip(NED, AXIS_COLOURS, strict=True):
        if column in record.not_estimated:
            continue
        less, more = (one.sd[column].to_numpy()[kept] for one in (record, forward))
        # Filter less smoother has the difference of both covariances (`smoother_consistency`).
        reach = TWO_SIDED_95 * np.sqrt(np.maximum(np.square(more) - np.square(less), 0.0))
        line = curve("separation", marks[kept], apart[column], colour, buckets=BUCKETS)
        fill = thin_fill("95 % expected", marks[kept], -reach, reach, GREY, opacity=0.25)
        panels.append(Panel(f"{column}, m", (line,), fills=(fill,), height=0.8))
    return over_time(
        evaluation,
        "separation",
        "Separation of filter and smoother",
        "Filter − smoothed position. The separation exceeds its band where later measurements "
        "contradict the filter by more than it states, or where the smoother's passes about its "
        "own states correct the linearization.",
        panels,
    )


def smoothing_table(evaluation: NavigationEvaluation) -> TableBlock | None:
    """Median bounds and errors against the truth, filter and smoother."""
    run, errors = evaluation.run, evaluation.errors
    forward, agreement = run.forward, run.agreement
    if forward is None or agreement is None:
        return None
    rows = []
    for k, column in enumerate(agreement.columns):
        before, after = (
            float(np.median(_bound(one, column))) for one in (forward, evaluation.record)
        )
        share = share_words(float(agreement.share[k])) if agreement.instants[k] else "–"
        known = () if errors is None else (evaluation.forward_errors, errors)
        rows.append(
            (
                f"{column}, {UNITS[column]}",
                _figure(before),
                _figure(after),
                plain(before / after, 1) if after > 0.0 else "–",
                *(_figure(one.score(column).rms) for one in known if one is not None),
                NOT_ESTIMATED if column in evaluation.record.not_estimated else share,
            )
        )
    return table_of(
        "| filter | smoothed | ratio |"
        + ("" if errors is None else "error of filter | smoothed |")
        + "consistent",
        rows,
        "95 % bounds, medians over the run"
        + ("" if errors is None else "; RMS errors against the truth")
        + ". Consistent: share of the differences within three standard deviations by both "
        "covariances, of one linearization (99.7 % for a correct model).",
        strong=(k for k in range(len(rows)) if _apart(agreement, k)),
    )


def smoothing_words(evaluation: NavigationEvaluation) -> str | None:
    """Effect of the smoother in a sentence."""
    forward = evaluation.run.forward
    if forward is None:
        return None
    before, after = (
        float(np.median(horizontal_bounds(one))) for one in (forward, evaluation.record)
    )
    heading = [float(np.median(_bound(one, "heading"))) for one in (forward, evaluation.record)]
    return (
        "Smoothed: every state is estimated from all measurements. Median 95 % bounds, filter and "
        f"smoothed: position {_figure(before)} m and {_figure(after)} m, heading "
        f"{_figure(heading[0])}° and {_figure(heading[1])}°."
    )


def agreement_words(evaluation: NavigationEvaluation) -> tuple[tuple[str, str], ...]:
    """Cautions where filter and smoother are inconsistent."""
    agreement = evaluation.run.agreement
    if agreement is None:
        return ()
    apart = [k for k in range(len(agreement.columns)) if _apart(agreement, k)]
    if not apart:
        return ()
    worst = min(apart, key=lambda k: agreement.share[k])
    text = (
        f"in {', '.join(agreement.columns[k] for k in apart)}: "
        f"{share_words(agreement.share[worst])} of the differences of "
        f"{agreement.columns[worst]} are within three standard deviations. Later measurements "
        "contradict the model: look for time-correlated sensor errors that are not stated "
        "([sensors], [states.NAME])."
    )
    return (("Filter and smoother are inconsistent", text),)


def _apart(agreement: SmootherConsistency, k: int) -> bool:
    return bool(agreement.instants[k] > 0 and agreement.share[k] < SHARE)


def _bound(record: NavigationRecord, column: str) -> Array:
    """95 % bound of a component, or of the horizontal position, at the covariance marks."""
    if column == "horizontal":
        return horizontal_bounds(record)
    return TWO_SIDED_95 * record.sd[column].to_numpy(dtype=np.float64)


def _figure(value: float) -> str:
    if math.isnan(value):
        return "–"
    return f"{value:.3g}" if value < 1000.0 else f"{value:.0f}"


# Tables of a navigation run: start and end, states, observations, outages, errors.


_MOST_EVENTS = 40


def end_table(evaluation: NavigationEvaluation) -> TableBlock:
    """Position, velocity and attitude at the start and at the end, with bounds."""
    record = evaluation.record
    rows = [
        ("time", *(instant(float(record.trajectory.index[k])) for k in (0, -1))),
        ("position", *(position_words(evaluation, k) for k in (0, -1))),
        ("horizontal ±", *(length_words(float(evaluation.bounds[k])) for k in (0, -1))),
    ]
    for name, column, sd, unit in (
        ("height", "alt", "down", "m"),
        *((f"velocity {w}", v, v, "m/s") for v, w in zip(VELOCITY, NED, strict=True)),
        *((a, a, a, "°") for a in reversed(EULER)),
    ):
        cells = []
        for k in (0, -1):
            value, its_sd = float(record.trajectory[column].iloc[k]), record.sd[sd].iloc[k]
            value = heading_shown(value, half(its_sd)) if column == "heading" else value
            cells.append(_stated(value, its_sd, unit))
        rows.append((name, *cells))
    caption = "Start and end, with 95 % bounds."
    return TableBlock(("", "start", "end"), tuple(rows), caption=caption)


def _stated(value: float, sd: float, unit: str) -> str:
    """Format a value with its 95 % bound, or as one of which the run estimates no error."""
    if math.isnan(sd):
        return f"{plain(value, 2)}{GAP}{unit}, {NOT_ESTIMATED}"
    return about(value, half(sd), unit)


def state_table(evaluation: NavigationEvaluation) -> TableBlock | None:
    """Sensor and measurement errors: uncertainty before and after the run."""
    record = evaluation.run.filtered
    rows = []
    for block in () if record.sensors.empty else evaluation.states:
        for column, label in zip(block.columns, block.labels, strict=True):
            value = block.factor * float(record.sensors[column].iloc[-1])
            first, last = (block.factor * half(record.sensors_sd[column].iloc[k]) for k in (0, -1))
            rows.append(
                (
                    f"{block.name} {label}" if len(block.columns) > 1 else block.name,
                    about(value, last, block.unit),
                    plus_minus(first, block.unit),
                    share_words(1.0 - last / first) if first > 0.0 and last <= first else "–",
                )
            )
    return table_of(
        "state | final estimate | initial bound | bound reduced by",
        rows,
        "Estimated sensor and measurement errors, with 95 % bounds.",
    )


def observation_table(evaluation: NavigationEvaluation) -> TableBlock | None:
    """Observations with their innovation statistics and rejected epochs."""
    rows = []
    for one in evaluation.agreements:
        band = memory = "–"
        if one.used.any():
            band = f"{plain(one.band[0], 2)} to {plain(one.band[1], 2)}"
        if math.isfinite(one.correlation):
            memory = f"{plain(one.correlation, 2)} (±{GAP}{plain(one.correlation_bound, 2)})"
        counts = map(str, (one.epochs, one.rejected, one.weakened))
        rows.append((one.name, *counts, plain(one.ratio, 2), plain(one.mean_nis, 2), band, memory))
    return table_of(
        "measurement | epochs | rejected | weakened | rms, sd | mean NIS | expected, 95 % "
        "| correlation",
        rows,
        "Processed innovations: RMS in predicted standard deviations, mean normalized "
        "innovation squared (NIS) with its 95 % interval, and the largest lag-1 autocorrelation "
        "of a component with its 95 % limit.",
    )


def outage_table(evaluation: NavigationEvaluation) -> TableBlock | None:
    """Outages, each with its largest bound."""
    return table_of(
        "measurement | from | for | largest bound",
        (
            (aid, instant(s.begin), duration_words(s.end - s.begin), length_words(bound))
            for aid, s, bound in longest_outages(evaluation)
        ),
        "Outages, with the largest horizontal 95 % bound in each.",
    )


def withheld_table(evaluation: NavigationEvaluation) -> TableBlock | None:
    """GNSS outage tests with the resulting errors."""
    tests = evaluation.run.withheld
    if not tests:
        return None
    from strapdown.navigation.outage_test import judge_outages

    verdicts = [judge_outages([w.result]) for w in tests]
    rows = [
        (
            withheld_aid(evaluation.run.spec),
            instant(w.result.span.begin),
            duration_words(w.result.span.end - w.result.span.begin),
            length_words(w.result.largest),
            length_words(w.result.bound_at_largest),
            f"{share_words(float(w.result.inside.mean()))} of {len(w.result.time)}",
            "yes" if verdict.consistent else "no",
            *(() if w.smoothed is None else (length_words(w.forward.largest),)),
        )
        for w, verdict in zip(tests, verdicts, strict=True)
    ]
    smoothed = evaluation.run.forward is not None
    known = "true positions" if tests and tests[0].result.against == "truth" else "fixes"
    return table_of(
        "GNSS outage test | from | for | largest error | 95 % bound | within bounds | consistent"
        + (" | filter alone" if smoothed else ""),
        rows,
        "Measurements withheld on purpose: the largest horizontal error, the run's 95 % bound at "
        f"that instant, and the share of the {known} within their bounds; consistent unless such "
        "a share or error is less probable than 1 %"
        + ("; smoothed, and by the filter alone." if smoothed else "."),
        text=(0, 6),
        strong=(k for k, verdict in enumerate(verdicts) if not verdict.consistent),
    )


def point_table(evaluation: NavigationEvaluation) -> TableBlock | None:
    """Errors at the control points."""
    score = evaluation.run.points
    if score is None:
        return None
    row = (
        f"{len(score.time)} of {score.given}",
        *map(length_words, (score.way, score.rms, score.median, score.largest)),
        instant(score.largest_at),
        f"{plain(100.0 * score.rms / score.way, 2)} %",
    )
    return table_of(
        "control points | path length | rms | median | largest | at | rms / path length",
        (row,),
        "Horizontal distance from the control points, after a fit of origin and heading "
        f"(no scale): the run's heading minus theirs is {plain(score.turn_deg, 2)} deg.",
    )


def error_table(evaluation: NavigationEvaluation) -> TableBlock | None:
    """Errors against the truth with their bounds."""
    if evaluation.errors is None:
        return None
    names = {"horizontal": "horizontal", "down": "down (height)"}
    names |= {v: f"velocity {w}" for v, w in zip(VELOCITY, NED, strict=True)}
    rows = []
    for score in evaluation.errors.scores:
        places = decimals(score.rms) if score.rms > 0.0 else 3
        rows.append(
            (
                f"{names.get(score.quantity, score.quantity)}, {score.unit}",
                plain(score.rms, places),
                plain(score.largest, places),
                instant(score.largest_at),
                NOT_ESTIMATED if math.isnan(score.bound) else plain(score.bound, places),
                share_words(score.share),
            )
        )
    return table_of(
        "error | rms | largest | at | 95 % bound, rms | within bound",
        rows,
        f"Errors against {evaluation.truth_name}, at {len(evaluation.errors.time)} instants.",
        strong=(0,),
    )


def event_table(evaluation: NavigationEvaluation) -> TableBlock | None:
    """Events; only the first ones if there are many."""
    events = evaluation.record.events
    rest = len(events) - _MOST_EVENTS
    more = f"; {rest} more are in navigation.json" if rest > 0 else ""
    return table_of(
        "at | event | description",
        ((instant(e.time), e.kind, e.finding.what) for e in events[:_MOST_EVENTS]),
        f"Events in order of time{more}.",
        text=(0, 1, 2),
    )


# Report of a navigation run: the answer first, then its basis.


def navigation_document(evaluation: NavigationEvaluation, name: str) -> Document:
    """Return the report of a run; `name`: of its folder, to verify it; no command if empty."""
    from strapdown.report import navigation_charts as charts
    from strapdown.report.navigation_plan import plan_chart

    run = evaluation.run
    verdict = trust(evaluation)
    plan = plan_chart(evaluation)
    aids = dict.fromkeys(
        [*evaluation.record.outages, *(a.name.partition(".")[0] for a in evaluation.agreements)]
    )
    states = section(
        "state",
        "Height, velocity, attitude",
        charts.height_chart(evaluation),
        charts.velocity_chart(evaluation),
        charts.attitude_chart(evaluation),
    )
    errors = section(
        "truth",
        f"Against {evaluation.truth_name}",
        error_table(evaluation),
        *charts.error_charts(evaluation),
        charts.nees_chart(evaluation),
    )
    pair: tuple[Block | None, ...] = ()
    if evaluation.pair:
        from strapdown.report.paired_corrections import paired_chart, paired_table

        pair = paired_table(evaluation), paired_chart(evaluation)
    compared = () if evaluation.errors is None else evaluation.errors.findings
    findings = (*run.findings, *compared)
    sections = (
        section("answer", "The answer", end_table(evaluation), *verdict.blocks),
        *integrity_sections(evaluation),
        section("points", "At the control points", point_table(evaluation)),
        section("outages", "Outages", withheld_table(evaluation), outage_table(evaluation)),
        section(
            "paired",
            "With two corrections of the estimated errors",
            *pair,
        ),
        # Errors matter more than the state, where they are known.
        *((errors, states) if errors.blocks else (states,)),
        section(
            "smoothing",
            "Smoothed",
            paragraph(smoothing_words(evaluation)),
            smoothing_table(evaluation),
            smoothing_chart(evaluation),
            separation_chart(evaluation),
            figures=1,
        ),
        section("observations", "Innovations", *_observations(evaluation)),
        section(
            "components",
            "Fixes, and innovations of each measurement",
            *charts.fix_charts(evaluation),
            *(
                charts.innovation_chart(evaluation.record, one, evaluation.heading_spans)
                for one in evaluation.agreements
            ),
            folded=True,
        ),
        section(
            "sensors",
            "Sensor and measurement errors",
            state_table(evaluation),
            *charts.state_charts(evaluation),
            *(Paragraph(f"{head}: {text}") for head, text in _not_told(evaluation)),
            folded=True,
        ),
        section("events", "Events", event_table(evaluation), folded=True),
        section(
            "findings",
            "Findings",
            findings_list(findings),
            folded=all(one.severity == "note" for one in findings),
        ),
        section(
            "method",
            "Method and assumptions",
            Facts(_method(run)),
            *assumed(
                "Sensor and measurement errors are as stated. Biases that are not among the states "
                "are zero, and measurement errors are white. Every bound depends on this.",
                "Normal gravity of the ellipsoid: a deflection of the vertical is not in the "
                "bounds.",
            ),
            *run_again(name),
            folded=True,
        ),
        section("conventions", "Conventions", Facts(conventions(run)), folded=True),
    )
    title = run.spec.title or f"Navigation of {run.source.name}"
    start = position_words(evaluation, 0)
    return document_of(
        title,
        headline(evaluation),
        (
            ("Record", f"{run.source.name}, {run.source.what}"),
            ("Start", start),
            ("Measurements", ", ".join(aids) or "none"),
        ),
        (
            KeyFigures(key_figures(evaluation)),
            verdict.paragraph,
            items_of(cautions(evaluation)),
            Paragraph(f"Stationary at {start}.") if plan is None else None,
            plan,
            charts.bound_chart(evaluation),
        ),
        sections,
        footer=title,
    )


def _method(run: NavigationRun) -> tuple[tuple[str, str], ...]:
    """Stages with their modules, in words."""
    spec = run.spec
    filter_rule = _kind(spec.filter, "update_rule")
    aids = (
        (f"Measurement {name}", aid.kind + (f", update rule {rule}" if rule else ""))
        for name, aid in spec.aiding.items()
        for rule in (_kind(aid, "update_rule"),)
    )
    chain = (
        ("Record", f"{run.source.name}: {run.source.what}"),
        ("Pre-filter", spec.prefilter.kind),
        ("Coarse alignment", "" if run.coarse is None else spec.coarse.kind),
        ("Fine alignment", "" if run.fine is None else spec.fine.kind),
        ("Mechanization", spec.mechanization.kind),
        ("Filter", spec.filter.kind),
        ("Error model", _kind(spec.filter, "error_model")),
        ("Update rule", filter_rule or "none: full weight, but for measurements with their own"),
        ("Smoother", "" if run.forward is None else spec.smoother.kind),
        *aids,
        ("States", ", ".join(state_groups(run.record))),
    )
    return tuple((stage, what) for stage, what in chain if what)


def _kind(module: ChoiceSpec, slot: str) -> str:
    """Kind of the module in a slot of another; empty without one."""
    return str(getattr(getattr(module, slot, None), "kind", ""))


def _observations(evaluation: NavigationEvaluation) -> tuple[Block | None, ...]:
    from strapdown.report.navigation_charts import nis_chart

    if not evaluation.agreements:
        return (Paragraph("No measurement was processed: inertial sensors alone."),)
    rows: list[tuple[str, str]] = []
    for one in evaluation.agreements:
        for kind in dict.fromkeys(v.kind for v in one.consistency.verdicts):
            alike = [v for v in one.consistency.verdicts if v.kind == kind]
            said = "; ".join(v.finding.what for v in alike)
            rows.append((one.name, f"{said}. {capital(alike[0].finding.remedy or '')}."))
    against = "Inconsistencies that exceed chance, and their possible causes:"
    agree = "The innovations are consistent with the stated sensor and measurement errors."
    return (
        observation_table(evaluation),
        Paragraph(against if rows else agree),
        items_of(rows),
        nis_chart(evaluation.record, evaluation.agreements, evaluation.heading_spans),
    )


# Conventions of the report of a navigation run.


def conventions(run: NavigationRun) -> tuple[tuple[str, str], ...]:
    """Return axes, signs and levels of what a run states."""
    position = (
        "of the inertial sensors: geodetic latitude north and longitude east in deg, height "
        f"{height_words(as_stated=run.source.heights_as_stated)}, in m"
    )
    return (
        ("Body axes", "forward, right, down; local level: north, east, down"),
        ("Position", position),
        *_CONVENTIONS,
    )


_CONVENTIONS = (
    ("Velocity", "relative to the Earth, in m/s: north, east, down"),
    ("Attitude", "roll, pitch, heading (3-2-1): right side down, nose up, clockwise are positive"),
    ("Heading", "from true north, clockwise seen from above"),
    ("Errors", "error = computed − true; sensor error = measured − true"),
    (
        "Rotation errors",
        "vector psi about north, east, down: C_computed = exp([psi x]) C_true",
    ),
    (
        "Innovations",
        "measured − predicted; components of one epoch are processed one after the other",
    ),
    (
        "Bounds",
        "95 % bounds: 1.96 standard deviations, 2.45 for an ellipse in a plane, if sensor and "
        "measurement errors are as stated",
    ),
    ("Time", "s, on the record's own clock"),
)
