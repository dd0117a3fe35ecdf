"""Integrity of a navigation run: in sentences for terminal and page, and as report sections."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
import pandas as pd

from strapdown.constants import TWO_SIDED_95, Array
from strapdown.dsp.chi_square import plane_bound
from strapdown.navigation.blame import BLAMES
from strapdown.navigation.heading_checks import UNSEEN
from strapdown.navigation.heading_integrity import (
    CHECKS,
    REASONS,
    STATUSES,
    SURE,
)
from strapdown.navigation.integrity import (
    NO_NORTH,
    QUANTITY_REASONS,
    Advice,
    IntegrityReport,
)
from strapdown.navigation.record import Span
from strapdown.report.chart import (
    BLACK,
    BLUE,
    GREY,
    VERMILLION,
    Chart,
    Level,
    Line,
    Panel,
    curve,
    dots,
)
from strapdown.report.document import (
    Block,
    Items,
    Paragraph,
    Section,
    TableBlock,
    blocks,
    capital,
    items_of,
    paragraph,
    section,
    table_of,
)
from strapdown.report.navigation_evaluation import NavigationEvaluation, heading_spans
from strapdown.report.values import (
    GAP,
    duration_words,
    half,
    length_words,
    plain,
    share_words,
    shares_words,
)
from strapdown.report.values import stamp as instant
from strapdown.systems.navigation_run import NavigationRun
from strapdown.tables.checks import index_of

_KINDS = {
    "change": "changes within the run",
    "understated": "scatters more than stated",
    "bias": "has a constant error",
    "correlated": "is correlated in time",
    "gross": "has gross errors",
}


#: Color of each heading status in the terminal.
STATUS_STYLES = {"trusted": "green", "unverified": "yellow", "rejected": "red"}


def answer(evaluation: NavigationEvaluation) -> str:
    """Return the first sentence of a verdict."""
    return f"{bound_words(evaluation)} {heading_words(evaluation.run.trust)}"


def without_arm(result: NavigationRun) -> str:
    """Say what no bound of position has: a lever arm that nobody measured; empty without one."""
    arms = [one.data["name"] for one in result.findings if one.code == "navigation.lever-arm-zero"]
    return f"without the lever arm of {' and '.join(arms)}, taken as zero" if arms else ""


def bound_words(evaluation: NavigationEvaluation) -> str:
    """Return the 95 % bound of the position, at the end and at its worst."""
    result, bounds = evaluation.run, evaluation.bounds
    end, worst = float(bounds[-1]), int(np.argmax(bounds))
    most, at = float(bounds[worst]), float(result.record.sd.index[worst])
    sized = f"Position bound, 95{GAP}%: {length_words(end)} at the end"
    # A run whose bound is largest at the end needs only one number.
    if most > 1.1 * end:
        sized += f", {length_words(most)} at most (at {instant(at)})"
    sized += f", {arm}" if (arm := without_arm(result)) else ""
    first = result.trust.against_bounds
    if not result.trust.consistency:
        return f"{sized}, if the sensor errors are as stated. No measurement confirms it."
    if first is None:
        return f"{sized}. The measurements confirm it."
    return f"{sized}. The measurements contradict it: {first.name} {_KINDS[first.kind]}."


def heading_words(trust: IntegrityReport) -> str:
    """Return the share of time with a trusted heading, and the status at the end."""
    heading = trust.heading
    if not heading.spans:
        return "The run is too short to judge its heading."
    last = heading.spans[-1]
    check = "" if last.status != "trusted" else check_words(trust)
    shares = {status: heading.share(status) for status in STATUSES}
    why_not = "; ".join(one.sentence() for one in trust.unconfirmed)
    return heading_sentence(shares, last.status, last.reason, check, why_not)


def heading_sentence(
    shares: Mapping[str, float], status: str, reason: str, check: str, why_not: str
) -> str:
    """Return the sentence on the heading, from its shares of the time and its final status.

    Parameters
    ----------
    shares : mapping of str to float
        By status, of `STATUSES`.
    status, reason : str
        At the end.
    check, why_not : str
        What confirms a trusted heading, and why no independent check could; empty without one.
    """
    now = f"final status: {status}"
    if status != "trusted":
        now += f" ({REASONS[reason]})"
    elif check:
        now += f", confirmed by {check}"
    if why_not:
        now += f". No independent check: {why_not}"
    return f"Heading: {shares_words(shares)} of the time; {now}."


def worst_words(trust: IntegrityReport) -> str:
    """Return the quantity that its measurements contradict for the longest time; or empty."""
    worst = trust.worst
    if worst is None:
        return ""
    status, reason = worst.at_end
    others = [
        one.name for one in trust.quantities if one is not worst and one.share("rejected") > 0.0
    ]
    why = "" if reason in ("", "apart") else f" ({QUANTITY_REASONS[reason]})"
    more = f"; also rejected at times: {', '.join(others)}" if others else ""
    return (
        f"{capital(worst.name)}: rejected {share_words(worst.share('rejected'))} of the time "
        f"({QUANTITY_REASONS['apart']}); final status: {status}{why}{more}."
    )


def promise(trust: IntegrityReport) -> tuple[tuple[str, str], ...]:
    """Return the definition of each status color, in words and numbers."""
    heading = trust.heading
    trusted, rejected = (plain(x, 1) for x in (heading.trusted_below, heading.rejected_beyond))
    return (
        (
            "Trusted (green)",
            f"the heading error is below {trusted}°. Required: the run's 95{GAP}% bound is below "
            f"{trusted}°; an independent check bounds the error below {trusted}° with 99{GAP}%; "
            "and innovations scatter by at most twice the expected value. The check is a second "
            "navigator driven by fixes that began without a heading (now, or up to a minute ago "
            "plus the growth since); or gyrocompassing at rest, propagated by the gyros; or two "
            "independent heading measurements.",
        ),
        (
            "Unverified (amber)",
            "the heading depends on the stated start, on an alignment without a test of its own, "
            f"or on one measurement; or its 95{GAP}% bound exceeds {trusted}°; or innovations "
            "scatter by more than twice the expected value.",
        ),
        (
            "Rejected (red)",
            f"do not use the heading: its bound exceeds {rejected}°, an independent check "
            "contradicts it, or innovations scatter by more than three times the expected value.",
        ),
    )


#: A maneuver that leaves more of a standard deviation than this share does not help.
HELPS = 0.8


def advice_words(advice: Advice, trust: IntegrityReport) -> str:
    """Return the measures that would have helped at that time."""
    if not advice.options:
        return _without_fixes(trust)
    helpful = [(one, after) for one, after in advice.options if after < HELPS * advice.sd]
    if not helpful:
        return (
            "no maneuver of some seconds would reduce its standard deviation of "
            f"{degrees_words(advice.sd)} much: more accurate fixes would, or more maneuvers"
        )
    (best, sd), *others = helpful
    text = (
        f"{best.what} with fixes would reduce its standard deviation from "
        f"{degrees_words(advice.sd)} to {degrees_words(sd)}"
    )
    more = [f"{one.what} to {degrees_words(after)}" for one, after in others]
    return text + (f"; {', '.join(more)}" if more else "")


def _without_fixes(trust: IntegrityReport) -> str:
    """Return the measures that would confirm a heading without fixes."""
    north = f"these gyros find north to {degrees_words(trust.north_sd)} (1 standard deviation)"
    if trust.north_sd >= NO_NORTH:
        north = "these gyros cannot find north"
    if SURE * trust.north_sd <= trust.heading.trusted_below:
        return (
            f"{north}: a fine alignment, or a stop of some minutes with zero velocity updates "
            '(kind = "zero_velocity"), would confirm it; so would GNSS fixes with a change of '
            "speed or a turn"
        )
    return (
        f"{north}. GNSS fixes with a change of speed or a turn would confirm it, or a second "
        "independent heading measurement, such as a compass beside two antennas"
    )


def check_words(trust: IntegrityReport) -> str:
    """Independent heading checks that confirmed it while trusted, longest first; empty if none."""
    table = trust.heading.table
    confirmed = table[(table["status"] == 0) & (table["check"] != "")]
    kinds = confirmed["check"].value_counts().index
    return "; ".join(CHECKS[str(kind)] for kind in kinds)


def first_words(trust: IntegrityReport) -> str:
    """The first inconsistent measurement, as a sentence."""
    one = trust.first
    if not trust.consistency:
        return "No measurement was processed, so no inconsistency can be found."
    if one is None:
        return "All innovations are consistent, or their inconsistency is too small to matter."
    begin = "from the first epoch, " if one.throughout else ""
    meaning = one.finding.remedy or ""
    return (
        f"First inconsistency: {one.name}, component {one.component.partition(',')[0]}, "
        f"{begin}at {instant(one.since)}: {one.finding.what}. {meaning[:1].upper()}{meaning[1:]}."
    )


def repeated_words(result: NavigationRun) -> str:
    """Return the result of the re-run without it."""
    trust = result.trust
    repeated = trust.repeated
    if repeated is None:
        return "" if trust.first is None else "Not re-run without it: repeat is false in [trust]."
    if repeated.record is None or repeated.differences is None:
        failed = "" if repeated.failed is None else repeated.failed.text()
        return f"Re-run {repeated.change.what}, the run fails: {failed}"
    table = repeated.differences
    place, turn = apart(table)
    before, after = len(trust.inconsistencies), len(repeated.left)
    rest = "the remaining measurements are no more consistent"
    if not after:
        rest = "all remaining measurements are consistent"
    elif after < before:
        rest = f"{after} of {before} inconsistencies remain"
    # The run with more information differs from the other by at most that one's error (Kalman).
    own = np.interp(
        index_of(table), index_of(repeated.record.sd), plane_bound(repeated.record.covariance)
    )
    share = float(np.mean(place > own))
    beyond = f"beyond the re-run's 95{GAP}% bound for {share_words(share)} of the time"
    if share == 0.0:
        beyond = f"always within the re-run's 95{GAP}% bound"
    bound = half(result.filtered.sd["heading"].iloc[-1])
    (usual, most, last), turned = (
        [words(float(x)) for x in (np.median(v), max(v), v[-1])]
        for words, v in ((length_words, place), (degrees_words, turn))
    )
    return (
        f"Re-run {repeated.change.what}: position differs by {usual} (median), {most} at most "
        f"({beyond}), {last} at the end; heading by {turned[0]} (median), {turned[1]} at most, "
        f"{turned[2]} at the end, where its bound is {degrees_words(bound)}; {rest}."
    )


def apart(differences: pd.DataFrame) -> tuple[Array, Array]:
    """Distances in m and angles in deg of a run from its re-run."""
    north, east, heading = (
        differences[c].to_numpy(dtype=np.float64) for c in ("north", "east", "heading")
    )
    return np.hypot(north, east), np.abs(heading)


def terminal_lines(
    evaluation: NavigationEvaluation, *, brief: bool = False
) -> list[tuple[str, str]]:
    """Up to five lines for the terminal, each with its style; brief, without the position.

    Brief, what is named as the cause of all inconsistencies takes the place of the first of them.
    """
    result, trust = evaluation.run, evaluation.run.trust
    last = trust.heading.spans[-1].status if trust.heading.spans else "rejected"
    lines = [(heading_words(trust) if brief else answer(evaluation), STATUS_STYLES[last])]
    if said := worst_words(trust):
        lines.insert(0, (said, STATUS_STYLES["rejected"]))
    first, blamed = trust.first, any(one.code in BLAMES for one in result.findings)
    if first is not None and not (brief and blamed):
        since = "throughout" if first.throughout else f"first at {instant(first.since)}"
        text = f"First inconsistency: {first.name} {_KINDS[first.kind]}, {since}."
        lines.append((text, "yellow"))
        if said := repeated_words(result):
            lines.append((said, ""))
    elif first is None and trust.advice and trust.heading.spans[-1].status != "trusted":
        lines.append((f"For the heading: {advice_words(trust.advice[-1], trust)}.", ""))
    return lines


def degrees_words(value: float) -> str:
    """Format an angle to two or three digits: ``12.4°``, ``0.049°``."""
    if not math.isfinite(value):
        return "unknown"
    places = 0 if value >= 20.0 else 1 if value >= 2.0 else 2 if value >= 0.1 else 3
    return f"{plain(value, places)}°"


# Sections of the report on integrity: whether the run can be trusted, and the evidence against it.


#: Rows per table of the page; the files have all.
_MOST = 12


def integrity_sections(evaluation: NavigationEvaluation) -> tuple[Section, ...]:
    """Return the sections on heading, position and velocity, and the first inconsistency."""
    result = evaluation.run
    return (
        section("integrity", "Integrity", Paragraph(answer(evaluation)), *_heading(result)),
        section(
            "quantities",
            "Status of position and velocity",
            *_quantities(result),
            folded=not worst_words(result.trust),
        ),
        section(
            "first",
            "First inconsistency, and the re-run without it",
            *_first(result),
            folded=not result.trust.inconsistencies,
        ),
    )


def status_words(trust: IntegrityReport) -> str:
    """Return the heading status at the end, and the share of the time with a trusted heading."""
    heading = trust.heading
    last = heading.spans[-1].status if heading.spans else "unknown"
    return f"status at the end: {last}; trusted {share_words(heading.share('trusted'))} of the time"


def _heading(result: NavigationRun) -> tuple[Block, ...]:
    trust = result.trust
    if not len(trust.heading.table):
        return ()
    filtered = (
        "The heading status and the re-run are those of the filter, from the measurements up to "
        "each second, not of the smoothed run."
    )
    alone = (
        f"No independent heading check: {'; '.join(one.sentence() for one in trust.unconfirmed)}. "
        "The heading depends on its start or on one measurement, and is never trusted."
    )
    return blocks(
        heading_chart(result),
        None if result.forward is None else Paragraph(filtered, "note"),
        _reasons(result),
        Paragraph(alone, "warning") if trust.unconfirmed else None,
        *_advice(trust),
        _against_truth(result),
        Items(promise(trust)),
        Paragraph(
            "Not detectable: fixes that are all wrong consistently, as of a spoofed receiver; and, "
            f"in a run without fixes, a gyro that changes by more than {UNSEEN:g} standard "
            "deviations of its bias after the last rest, until the next one.",
            "note",
        ),
    )


def _advice(trust: IntegrityReport) -> tuple[Block, ...]:
    """Return the maneuvers that would have helped, or what else would."""
    if not trust.advice:
        return ()
    if not any(a.options for a in trust.advice):
        return (Paragraph(f"Remedy: {advice_words(trust.advice[-1], trust)}."),)
    rows = tuple(
        (
            f"{a.span.status.capitalize()}, {instant(a.span.begin)} to {instant(a.span.end)} "
            f"({duration_words(a.span.end - a.span.begin)}): {REASONS[a.span.reason]}",
            capital(advice_words(a, trust)),
        )
        for a in trust.advice
    )
    return (
        Paragraph(
            "Maneuvers that would have helped, at the end of the longest periods that are not "
            "trusted (filter covariance propagated through the maneuver, without the assumed "
            "heading):"
        ),
        Items(rows),
    )


def _reasons(result: NavigationRun) -> TableBlock | None:
    table = result.trust.heading.table
    rows = []
    for number, status in enumerate(STATUSES):
        those = table[table["status"] == number]
        for reason, count in those["reason"].value_counts().items():
            why = REASONS[str(reason)]
            if status == "trusted" and (check := check_words(result.trust)):
                why = f"{why}: {check}"
            rows.append((status, why, f"{count}", share_words(count / len(table))))
    columns = "status | reason | seconds | of the time"
    return table_of(columns, rows, "Heading status", text=(0, 1))


def _against_truth(result: NavigationRun) -> TableBlock | None:
    """Sizes of the errors under each status color; None if the truth is not known."""
    heading = result.trust.heading
    error = heading_error(result, index_of(heading.table))
    if error is None:
        return None
    size, number = np.abs(error), heading.table["status"].to_numpy()
    rows = []
    for k, status in enumerate(STATUSES):
        those = size[(number == k) & np.isfinite(size)]
        if len(those):
            within = share_words(float(np.mean(those <= heading.trusted_below)))
            sizes = math.sqrt(float(np.mean(those**2))), float(those.max())
            rows.append((status, f"{len(those)}", within, *(plain(x, 3) for x in sizes)))
    limit = plain(heading.trusted_below, 1)
    return table_of(
        f"status | seconds | within {limit}° | rms, deg | largest, deg",
        rows,
        f"Heading error against {result.source.truth_name}, by status",
    )


def _quantities(result: NavigationRun) -> tuple[Block | None, ...]:
    """Status of position and velocity, horizontal and vertical, with its shares of the time."""
    rows = []
    for one in result.trust.quantities:
        status, reason = one.at_end
        shares = (share_words(one.share(name)) for name in STATUSES)
        rows.append((one.name, *shares, status, QUANTITY_REASONS[reason]))
    if not rows:
        return (Paragraph("The run is shorter than a second."),)
    return (
        paragraph(worst_words(result.trust), "warning"),
        table_of(
            ("quantity", *STATUSES, "at the end", "reason"),
            rows,
            "Status by the measurements of each quantity: its newest innovations, and how many "
            "were rejected",
            text=(0, 4, 5),
        ),
    )


def _first(result: NavigationRun) -> tuple[Block | None, ...]:
    trust, repeated = result.trust, result.trust.repeated
    rows = [
        (instant(i.since), i.name, i.component.partition(",")[0], _KINDS[i.kind])
        for i in trust.inconsistencies[:_MOST]
    ]
    left = () if repeated is None else repeated.left[:_MOST]
    return (
        Paragraph(first_words(trust)),
        table_of(
            "since | measurement | component | inconsistency",
            rows if len(rows) > 1 else (),
            "Inconsistencies, first by time; those that hold throughout come after gross errors of "
            "the same measurement, which may cause them",
            text=(0, 1, 2, 3),
        ),
        paragraph(repeated_words(result)),
        repeated_chart(result),
        Paragraph("Inconsistencies of the re-run:") if left else None,
        items_of((i.name, f"{_KINDS[i.kind]}: {i.finding.what}.") for i in left),
    )


# Charts: heading integrity over time, and the run against its re-run.


BUCKETS = 500


def heading_error(result: NavigationRun, time: Array) -> Array | None:
    """Heading error at given instants, deg; None if the truth is not known."""
    differences = result.filtered_differences
    if differences is None or not len(differences):
        return None
    known = index_of(differences)
    error = differences["heading"].to_numpy(dtype=np.float64)
    return np.asarray(np.interp(time, known, error, left=np.nan, right=np.nan))


def heading_chart(result: NavigationRun) -> Chart:
    """Heading integrity of each second, with the bounds that determine it."""
    from strapdown.report.navigation_charts import STATUS_LOOKS, bar, span_names

    heading = result.trust.heading
    table = heading.table
    time = index_of(table)
    spans = heading_spans(result)
    whole = Span("", float(time[0]), max(float(time[-1]) + 1.0, float(time[0]) + 2.0))
    fills = []
    for name, (colour, half_height) in STATUS_LOOKS.items():
        if those := tuple(one for one in spans if one.name == name):
            fills.append(bar(name, those, 0.0, half_height, colour))
    ends = Line("", np.array([whole.begin, whole.end]), np.full(2, np.nan), GREY, legend=False)
    names = (ends, *span_names(spans, whole))
    strip = Panel("", names, categories=("status",), height=0.22, fills=tuple(fills))
    bound = table["bound"].to_numpy(dtype=np.float64)
    carried = np.where(np.isfinite(table["carried"]), table["carried"], heading.rejected_beyond)
    # Decades from below the smallest bound up to a practically unknown heading.
    known = heading.trusted_below
    if np.isfinite(bound).any():
        known = min(float(np.nanmin(bound)), known)
    shown = [
        ("bound of the run (95 %)", bound, BLUE, "solid", 1.6),
        ("bound by an independent check (99 %)", carried, BLACK, "solid", 2.0),
    ]
    error = heading_error(result, time)
    if error is not None:
        size = np.abs(error)
        shown.append((f"error against {result.source.truth_name}", size, VERMILLION, "dot", 1.4))
        if np.isfinite(error).any():
            known = min(known, max(float(np.nanmedian(size)), 1e-3))
    least = 10.0 ** math.floor(math.log10(max(known, 1e-4)))
    lines = []
    for name, values, colour, dash, width in shown:
        values = np.clip(values, least, heading.rejected_beyond)
        lines.append(curve(name, time, values, colour, dash, width, BUCKETS))
    limit = f"{plain(heading.trusted_below, 1)}°"
    levels = (Level(heading.trusted_below, limit),)
    return Chart(
        "heading-integrity",
        "Heading integrity",
        f"Above: status. Below: its bounds; trusted requires both below {limit} (dashed). A curve "
        "at the top is unknown.",
        "time, s",
        (strip, Panel("heading, deg", tuple(lines), log=True, levels=levels)),
    )


def repeated_chart(result: NavigationRun) -> Chart | None:
    """Difference of a run from its re-run, with the bounds of both; None without a re-run."""
    repeated = result.trust.repeated
    if repeated is None or repeated.differences is None or repeated.record is None:
        return None
    time = index_of(repeated.differences)
    if len(time) < 2:
        return None
    place, turn = apart(repeated.differences)
    panels = []
    for label, difference in (("position, m", place), ("heading, deg", turn)):
        lines = []
        tall = 0.0
        for name, record, look in (
            ("bound of the run (95 %)", result.filtered, (BLUE, "solid", 1.6)),
            ("bound of the re-run (95 %)", repeated.record, (GREY, "dash", 1.4)),
        ):
            values = plane_bound(record.covariance)
            if difference is turn:
                values = TWO_SIDED_95 * record.sd["heading"].to_numpy(dtype=np.float64)
            at = index_of(record.sd)
            within = (at >= time[0]) & (at <= time[-1])
            lines.append((name, at[within], values[within], look))
            finite = values[within & np.isfinite(values)]
            tall = max(tall, float(np.quantile(finite, 0.98)) if finite.size else 0.0)
        # The bounds of a start, and those of an outage, would hide the rest.
        most = max(1.15 * tall, 1.02 * float(np.nanmax(difference)), 1e-6)
        lines.append(("difference", time, difference, (VERMILLION, "solid", 2.0)))
        zero = dots("", time[[0, -1]], np.zeros(2), GREY, size=0.0, legend=False)
        drawn = [
            curve(name, at, np.minimum(values, most), *look, buckets=BUCKETS)
            for name, at, values, look in lines
        ]
        panels.append(Panel(label, (zero, *drawn)))
    return Chart(
        "repeated",
        "Run and re-run",
        f"Difference between the run and its re-run {repeated.change.what}, with both bounds.",
        "time, s",
        tuple(panels),
    )
