"""Verdict of a run in sentences, shared by terminal and page."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from strapdown import __version__
from strapdown.constants import TWO_SIDED_95
from strapdown.evaluation.plane_bound import plane_bound
from strapdown.navigation.consistency import Inconsistency
from strapdown.navigation.heading_integrity import (
    REASONS,
    SURE,
    WITNESSES,
    LightSpan,
)
from strapdown.navigation.heading_witness import UNSEEN
from strapdown.navigation.integrity import NO_NORTH, Advice, IntegrityReport, Repeated
from strapdown.navigation.record import Span
from strapdown.report.chart import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    VERMILLION,
    Array,
    Chart,
    Level,
    Line,
    Panel,
    curve,
)
from strapdown.report.document import (
    Block,
    Document,
    Items,
    KeyFigure,
    KeyFigures,
    Paragraph,
    Section,
    TableBlock,
    capital,
)
from strapdown.report.navigation_charts import bar, span_names
from strapdown.report.values import GAP, duration_words, half, length_words, plain, share_words
from strapdown.report.values import stamp as instant
from strapdown.systems.navigation_run import NavigationRun

_KINDS = {
    "change": "changes within the run",
    "understated": "scatters more than stated",
    "bias": "is off by a constant",
    "correlated": "follows itself from epoch to epoch",
    "gross": "has gross errors",
}


def answer(result: NavigationRun) -> str:
    """Return the first sentence of a verdict."""
    return f"{place_words(result)} {heading_words(result.trust)}"


def place_words(result: NavigationRun) -> str:
    """Return the 95 % bound of the position, at the end and at its worst."""
    bounds = plane_bound(result.record.covariance)
    end, worst = float(bounds[-1]), int(np.argmax(bounds))
    most = float(bounds[worst])
    # A run whose bound is largest at the end needs only one number.
    same = most <= 1.1 * end
    sized = f"{length_words(end)} at the end" + (
        "" if same else f" and to {length_words(most)} at its worst ({_at(result, worst)})"
    )
    first = result.trust.against_bounds
    if not result.trust.consistency:
        return (
            f"The place is known to {sized}, 95{GAP}%, if the sensor errors are as "
            "stated: no measurement confirms it."
        )
    if first is None:
        return f"You can trust the place to {sized}, 95{GAP}%."
    return (
        f"By its own bounds the place is known to {sized}, 95{GAP}%, but not all "
        f"measurements are consistent: {first.name} {_KINDS[first.kind]}."
    )


def heading_words(trust: IntegrityReport) -> str:
    """Return the share of time with a trusted heading, and the status at the end."""
    light = trust.light
    if not len(light.table):
        return "The run is too short to judge its heading."
    shares = [(c, light.share(c)) for c in ("green", "amber", "red")]
    said = ", ".join(f"{c} {share_words(s)}" for c, s in shares if s > 0.0)
    last = light.spans[-1]
    now = "at the end it is " + (
        "green." if last.colour == "green" else f"{last.colour}: {REASONS[last.reason]}."
    )
    witness = witness_words(trust)
    if witness and last.colour == "green":
        now = f"{now[:-1]}, confirmed by {witness}."
    if trust.unwitnessed:
        now += f" Nothing could confirm it: {unwitnessed_words(trust)}."
    return f"Heading: {said} of the time; {now}"


def unwitnessed_words(trust: IntegrityReport) -> str:
    """Return the reasons why no independent check could confirm the heading."""
    return "; ".join(one.sentence() for one in trust.unwitnessed)


def _failed(repeated: Repeated) -> str:
    return "" if repeated.failed is None else repeated.failed.text()


def promise(trust: IntegrityReport) -> tuple[tuple[str, str], ...]:
    """Return the definition of each status color, in words and numbers."""
    green, red = plain(trust.light.green, 1), plain(trust.light.red, 1)
    return (
        (
            "Green",
            f"the heading is within {green}°. Two reckonings say so that share no assumption of "
            f"it: the run's own bound of 95{GAP}% is below {green}°, and a witness puts the run "
            f"within {green}° with 99{GAP}%: a second reckoning that began with no heading at all "
            "and was told fixes alone (now, or within the last minute with what the gyros may have "
            "added since); or north as the gyros found it at rest, where the rest itself shows "
            "how good they are, with what they may have added since; or two sources that share "
            "nothing. And what was observed scatters as it should.",
        ),
        (
            "Amber",
            f"unverified: its own bound is below {green}° and rests "
            "on the start, on an alignment that does not show how good it is, or on one aid; or "
            "that bound is beyond "
            f"{green}°; or observations scatter more than twice as much as they should.",
        ),
        (
            "Red",
            f"do not use it: its bound is beyond {red}°, a witness contradicts it, or "
            "observations scatter more than three times as much as they should.",
        ),
    )


def span_words(span: LightSpan) -> str:
    """A stretch of one color, in words."""
    return (
        f"{instant(span.begin)} to {instant(span.end)} ({duration_words(span.end - span.begin)}): "
        f"{REASONS[span.reason]}"
    )


def advice_words(advice: Advice, trust: IntegrityReport) -> str:
    """Return the measures that would have helped at that time."""
    if not advice.options:
        return _without_fixes(trust)
    best, sd = advice.options[0]
    text = (
        f"{best.what} with fixes would bring its standard deviation from "
        f"{degrees_words(advice.sd)} to {degrees_words(sd)}"
    )
    others = [f"{one.what} to {degrees_words(after)}" for one, after in advice.options[1:]]
    return text + (f"; {', '.join(others)}" if others else "")


def _without_fixes(trust: IntegrityReport) -> str:
    """Return the measures that would confirm a heading without fixes."""
    north = f"these gyros find north to ±{GAP}{degrees_words(trust.north_sd)} (one sd)"
    if trust.north_sd >= NO_NORTH:
        north = "these gyros find no north"
    if SURE * trust.north_sd <= trust.light.green:
        return (
            f"{north}: a fine alignment, or a stop of some minutes that an aid sees (kind = "
            '"zero_velocity"), would confirm it; so would GNSS fixes, over a '
            "change of speed or a turn"
        )
    return (
        f"{north}, so that no rest confirms it: GNSS fixes would, over a change of speed or a "
        "turn, or a second independent source, such as a compass beside two antennas"
    )


def witness_words(trust: IntegrityReport) -> str:
    """Independent heading checks that confirmed it while green, longest first; empty if none."""
    table = trust.light.table
    green = table[(table["light"] == 0) & (table["witness"] != "")]
    kinds = green["witness"].value_counts().index
    return "; ".join(WITNESSES[str(kind)] for kind in kinds)


def kind_words(one: Inconsistency) -> str:
    """Return the kind of an inconsistency in a few words."""
    return _KINDS[one.kind]


def first_words(trust: IntegrityReport) -> str:
    """The first inconsistent measurement, as a sentence."""
    one = trust.first
    if not trust.consistency:
        return "Nothing was observed, and so nothing could speak against the run."
    if one is None:
        return (
            "Everything that was observed is as it was expected to be, or off by too little to "
            "matter."
        )
    when = (
        f"from the first epoch on, at {instant(one.since)}"
        if one.throughout
        else f"at {instant(one.since)}"
    )
    where = one.component.partition(",")[0]
    meaning = one.finding.remedy or ""
    return (
        f"The first that does not agree is {one.name}, component {where}, {when}: "
        f"{one.finding.what}. "
        f"{meaning[:1].upper()}{meaning[1:]}."
    )


def repeated_words(result: NavigationRun) -> str:
    """Return the result of the re-run without it."""
    trust = result.trust
    repeated = trust.repeated
    if repeated is None:
        if trust.first is None:
            return ""
        return "It was not repeated without it: repeat is false in [trust]."
    if repeated.record is None or repeated.differences is None:
        return f"Repeated {repeated.change.what}, the run fails: {_failed(repeated)}"
    table = repeated.differences
    place = np.hypot(table["north"].to_numpy(), table["east"].to_numpy())
    turn = np.abs(table["heading"].to_numpy(dtype=np.float64))
    before, after = len(trust.inconsistencies), len(repeated.left)
    rest = (
        "everything that is left is then consistent"
        if not after
        else f"of {before} {_plural('doubt', before)} {after} {_plural('remains', after, 'remain')}"
        if after < before
        else "what is left is no more consistent than before"
    )
    beyond = _beyond(
        table.index.to_numpy(dtype=np.float64),
        place,
        repeated.record.sd.index.to_numpy(dtype=np.float64),
        plane_bound(repeated.record.covariance),
    )
    bound = half(result.filtered.sd["heading"].iloc[-1])
    usual, most, last = (length_words(float(x)) for x in (np.median(place), max(place), place[-1]))
    turned = [degrees_words(float(x)) for x in (np.median(turn), max(turn), turn[-1])]
    return (
        f"Repeated {repeated.change.what}, the place differs by {usual} in the middle and {most} "
        f"at most ({beyond}), at the end by {last}; the heading by {turned[0]} in the middle and "
        f"{turned[1]} at most, at the end by {turned[2]} where its bound is "
        f"{degrees_words(bound)}; {rest}."
    )


def terminal_lines(result: NavigationRun, *, brief: bool = False) -> list[tuple[str, str]]:
    """Up to four lines for the terminal, each with its style; brief, without the position."""
    trust = result.trust
    lines = [(heading_words(trust) if brief else answer(result), _style(trust))]
    if trust.first is not None:
        first = trust.first
        since = "throughout" if first.throughout else f"first at {instant(first.since)}"
        lines.append((f"First doubt: {first.name} {kind_words(first)}, {since}.", "yellow"))
        said = repeated_words(result)
        if said:
            lines.append((said, ""))
    elif trust.advice and trust.light.spans[-1].colour != "green":
        lines.append((f"For the heading: {advice_words(trust.advice[-1], trust)}.", ""))
    return lines


def _style(trust: IntegrityReport) -> str:
    spans = trust.light.spans
    last = spans[-1].colour if spans else "red"
    return {"green": "green", "amber": "yellow", "red": "red"}[last]


def _beyond(time: np.ndarray, apart: np.ndarray, marks: np.ndarray, bound: np.ndarray) -> str:
    # The run with more information differs from the other by at most that one's error (Kalman).
    share = float(np.mean(apart > np.interp(time, marks, bound)))
    if share == 0.0:
        return f"always within the repeated run's bound of 95{GAP}%"
    return f"beyond the repeated run's bound of 95{GAP}% for {share_words(share)} of the time"


def _at(result: NavigationRun, mark: int) -> str:
    return f"at {instant(float(result.record.sd.index[mark]))}"


def degrees_words(value: float) -> str:
    """Format an angle to two or three digits: ``12.4°``, ``0.049°``."""
    if not math.isfinite(value):
        return "unknown"
    places = 0 if value >= 20.0 else 1 if value >= 2.0 else 2 if value >= 0.1 else 3
    return f"{plain(value, places)}°"


def _plural(word: str, count: int, many: str | None = None) -> str:
    return word if count == 1 else many or f"{word}s"


# Verdict page of a run: whether it can be trusted, and the evidence against it.


#: Rows per table of the page; the files have all.
_MOST = 12


def verdict_document(result: NavigationRun, name: str) -> Document:
    """Return the verdict page of a navigation run.

    Parameters
    ----------
    name : str
        Folder name.
    """
    trust = result.trust
    seen = len(trust.light.table) > 0
    sound = trust.first is None and seen and trust.light.spans[-1].colour == "green"
    sections = (
        Section("heading", "Is the heading to be trusted?", _heading(result)),
        Section("innovations", "Does what was observed agree?", _innovations(result)),
        Section("first", "What is the first that does not, and does it matter?", _first(result)),
        Section("meaning", "Meaning of the colors", (Items(promise(trust)), _limits())),
    )
    return Document(
        "Can it be trusted?",
        result.spec.title or f"Verdict on the navigation of {result.source.name}",
        (
            ("Record", f"{result.source.name}, {result.source.what}"),
            ("Made with", f"strapdown {__version__}"),
        ),
        (
            KeyFigures(_keys(result)),
            Paragraph(answer(result), "lead" if sound else "warning"),
            *((light_chart(result),) if seen else ()),
        ),
        sections,
        f"Verdict on {name}",
        links=(("report.html", "The whole report"),),
    )


def light_section(result: NavigationRun) -> Section:
    """Heading integrity, as a section of the report."""
    said = Paragraph(answer(result))
    return Section("trust", "Can it be trusted?", (said, light_chart(result), *_of_filter(result)))


def _of_filter(result: NavigationRun) -> tuple[Block, ...]:
    """Note for a smoothed run on the parts that use the filter alone."""
    if result.forward is None:
        return ()
    return (
        Paragraph(
            "The light, and the repeated run, are of the filter alone: of what was known at each "
            "second then. Smoothed, the heading is known by what came later, too.",
            "note",
        ),
    )


def _keys(result: NavigationRun) -> tuple[KeyFigure, ...]:
    trust, light = result.trust, result.trust.light
    bounds = plane_bound(result.record.covariance)
    heading = half(result.record.sd["heading"].iloc[-1])
    spans = light.spans
    last = spans[-1].colour if spans else "unknown"
    since = next((s.begin for s in reversed(spans) if s.colour != last), None)
    begun = "all of the run" if since is None else f"for the last {_since(result, last)}"
    first = trust.first
    return (
        KeyFigure(
            "Heading at the end",
            last,
            f"{begun}; own bound {degrees_words(heading)}",
            REASONS[spans[-1].reason] if spans else "",
        ),
        KeyFigure(
            "Heading is green",
            share_words(light.share("green")),
            f"of the time: within {plain(light.green, 1)}°",
            f"amber {share_words(light.share('amber'))}, red {share_words(light.share('red'))}",
        ),
        KeyFigure(
            "Place at the end",
            f"±{GAP}{length_words(float(bounds[-1]))}",
            f"horizontal, 95{GAP}%",
            f"at its worst {length_words(float(bounds.max()))}",
        ),
        KeyFigure(
            "Observations",
            _agrees(result),
            _looked_at(len(trust.consistency))
            if first is None
            else f"{first.name} {kind_words(first)}",
            "" if first is None else f"since {instant(first.since)}",
        ),
    )


def _agrees(result: NavigationRun) -> str:
    trust = result.trust
    if not trust.consistency:
        return "nothing"
    if trust.first is None:
        return "agrees"
    # Single outliers are not inconsistencies of the filter.
    if trust.against_bounds is None:
        return "agrees, mostly"
    return "does not agree"


def _since(result: NavigationRun, colour: str) -> str:
    seconds = 0.0
    for span in reversed(result.trust.light.spans):
        if span.colour != colour:
            break
        seconds += span.end - span.begin
    return duration_words(seconds)


def _heading(result: NavigationRun) -> tuple[Block, ...]:
    trust, light = result.trust, result.trust.light
    if not len(light.table):
        return (Paragraph("The run is shorter than a second."),)
    blocks: list[Block] = [*_of_filter(result), _reasons(result)]
    if trust.unwitnessed:
        blocks.append(
            Paragraph(
                f"Nothing could confirm the heading: {unwitnessed_words(trust)}. It rests on its "
                "start, or on one source alone, and is not green at any time.",
                "warning",
            )
        )
    if any(a.options for a in trust.advice):
        rows = tuple(
            (
                f"{a.span.colour.capitalize()}, {span_words(a.span)}",
                capital(advice_words(a, trust)),
            )
            for a in trust.advice
        )
        blocks += [
            Paragraph(
                "What would have helped, at the end of the longest stretches that were not green "
                "(by the covariance of the filter, taken over the manoeuvre, without what was "
                "assumed of the heading):"
            ),
            Items(rows),
        ]
    elif trust.advice:
        said = advice_words(trust.advice[-1], trust)
        blocks.append(Paragraph(f"What would have helped: {said}."))
    table = _against_truth(result)
    return (*blocks, *(() if table is None else (table,)))


def _reasons(result: NavigationRun) -> TableBlock:
    table = result.trust.light.table
    rows = []
    for colour, number in (("green", 0), ("amber", 1), ("red", 2)):
        those = table[table["light"] == number]
        for reason, count in those["reason"].value_counts().items():
            share = share_words(count / len(table))
            why = REASONS[str(reason)]
            if colour == "green" and witness_words(result.trust):
                why = f"{why}: the run, and {witness_words(result.trust)}"
            rows.append((colour, why, f"{count}", share))
    return TableBlock(
        ("light", "why", "seconds", "of the time"), tuple(rows), (0, 1), "The light, and why"
    )


def _against_truth(result: NavigationRun) -> TableBlock | None:
    """Sizes of the errors under each status color; None if the truth is not known."""
    light = result.trust.light
    error = heading_error(result, light.table.index.to_numpy(dtype=np.float64))
    if error is None:
        return None
    size, number = np.abs(error), light.table["light"].to_numpy()
    rows = []
    for colour, k in (("green", 0), ("amber", 1), ("red", 2)):
        those = size[(number == k) & np.isfinite(size)]
        if len(those):
            within = share_words(float(np.mean(those <= light.green)))
            largest, rms = float(those.max()), math.sqrt(float(np.mean(those**2)))
            rows.append(
                (colour, f"{len(those)}", within, f"{plain(rms, 3)}", f"{plain(largest, 3)}")
            )
    if not rows:
        return None
    return TableBlock(
        ("light", "seconds", f"within {plain(light.green, 1)}°", "rms, deg", "largest, deg"),
        tuple(rows),
        (0,),
        f"The heading against {result.source.truth_name}, by what the light showed",
    )


def _innovations(result: NavigationRun) -> tuple[Block, ...]:
    trust = result.trust
    if not trust.consistency:
        return (Paragraph("Nothing was observed."),)
    rows = []
    for name, one in trust.consistency.items():
        doubts = [i for i in trust.inconsistencies if i.name == name]
        kinds = ", ".join(dict.fromkeys(kind_words(i) for i in doubts)) or "agrees"
        scales = [c.scale for c in one.components if math.isfinite(c.scale)]
        worst = max(scales, key=lambda x: abs(math.log(max(x, 1e-9))), default=math.nan)
        gross = sum(c.gross for c in one.components)
        rows.append((name, kinds, f"{len(one.nis)}", plain(worst, 2), f"{gross}"))
    blocks: list[Block] = [
        TableBlock(
            ("observation", "verdict", "epochs", "scatter, sd", "gross errors"),
            tuple(rows),
            (0, 1),
            "Observed against expected innovations; a scatter of 1 is as stated",
        )
    ]
    small = [
        (name, v.finding.what)
        for name, one in trust.consistency.items()
        for v in one.verdicts
        if v.kind != "few"
        and not any(
            i.name == name and i.component == v.component and i.kind == v.kind
            for i in trust.inconsistencies
        )
    ]
    if small:
        blocks += [
            Paragraph("More than chance, but too little to matter, or on the safe side:"),
            Items(tuple((name, f"{what}.") for name, what in small[:_MOST])),
        ]
    return tuple(blocks)


def _first(result: NavigationRun) -> tuple[Block, ...]:
    trust = result.trust
    blocks: list[Block] = [Paragraph(first_words(trust))]
    if len(trust.inconsistencies) > 1:
        rows = tuple(
            (instant(i.since), i.name, i.component.partition(",")[0], kind_words(i))
            for i in trust.inconsistencies[:_MOST]
        )
        blocks.append(
            TableBlock(
                ("since", "observation", "component", "what"),
                rows,
                (0, 1, 2, 3),
                "All doubts in the order in which they count: what holds throughout has no begin, "
                "and comes after gross errors of its aid, which may be its cause",
            )
        )
    said = repeated_words(result)
    if said:
        blocks.append(Paragraph(said))
    chart = repeated_chart(result)
    if chart is not None:
        blocks.append(chart)
    repeated = trust.repeated
    if repeated is not None and repeated.left:
        rows_left = tuple(
            (i.name, f"{kind_words(i)}: {i.finding.what}.") for i in repeated.left[:_MOST]
        )
        blocks += [Paragraph("What does not agree in the repeated run:"), Items(rows_left)]
    return tuple(blocks)


def _limits() -> Block:
    return Paragraph(
        "Not detectable: a record whose fixes are all wrong in the same way, as of a "
        "receiver that is led astray with a motion of its own, agrees with itself. And a gyro that "
        f"changes by more than {UNSEEN:g} standard deviations of its bias after the last rest, in "
        "a run without fixes, is seen by nothing before the next one.",
        "note",
    )


def _looked_at(number: int) -> str:
    return "one observation looked at" if number == 1 else f"{number} observations looked at"


# Charts of a verdict: heading integrity over time, and the run against its re-run.


#: Colors of the heading status, and the half height of its bar, which shows it without color.
LIGHTS = {"green": (GREEN, 0.45), "amber": (ORANGE, 0.3), "red": (VERMILLION, 0.18)}
BUCKETS = 500


def heading_error(result: NavigationRun, time: Array) -> Array | None:
    """Heading error at given instants, deg; None if the truth is not known."""
    differences = result.filtered_differences
    if differences is None or not len(differences):
        return None
    known = differences.index.to_numpy(dtype=np.float64)
    error = differences["heading"].to_numpy(dtype=np.float64)
    return np.asarray(np.interp(time, known, error, left=np.nan, right=np.nan))


def light_chart(result: NavigationRun) -> Chart:
    """Heading integrity of each second, with the bounds that determine it."""
    light = result.trust.light
    table = light.table
    time = table.index.to_numpy(dtype=np.float64)
    spans: list[Span] = []
    for one in light.spans:
        if spans and spans[-1].name == one.colour:
            spans[-1] = replace(spans[-1], end=one.end)
        else:
            spans.append(Span(one.colour, one.begin, one.end))
    whole = Span("", float(time[0]), max(float(time[-1]) + 1.0, float(time[0]) + 2.0))
    fills = []
    for name, (colour, half_height) in LIGHTS.items():
        those = tuple(one for one in spans if one.name == name)
        if those:
            fills.append(bar(name, those, 0.0, half_height, colour))
    ends = Line("", np.array([whole.begin, whole.end]), np.full(2, np.nan), GREY, legend=False)
    strip = Panel(
        "",
        (ends, *span_names(tuple(spans), whole)),
        categories=("light",),
        height=0.22,
        fills=tuple(fills),
    )
    bound = table["bound"].to_numpy(dtype=np.float64)
    carried = np.where(np.isfinite(table["carried"]), table["carried"], light.red)
    # Decades from below the smallest bound up to a practically unknown heading.
    known = min(float(np.nanmin(bound)), light.green) if np.isfinite(bound).any() else light.green
    shown = [
        ("bound of the run itself (95 %)", bound, BLUE, "solid", 1.6),
        ("bound confirmed by a check (99 %)", carried, BLACK, "solid", 2.0),
    ]
    error = heading_error(result, time)
    if error is not None:
        shown.append(
            (f"error against {result.source.truth_name}", np.abs(error), VERMILLION, "dot", 1.4)
        )
        if np.isfinite(error).any():
            known = min(known, max(float(np.nanmedian(np.abs(error))), 1e-3))
    least = 10.0 ** math.floor(math.log10(max(known, 1e-4)))
    lines = tuple(
        curve(name, time, np.clip(values, least, light.red), colour, dash, width, BUCKETS)
        for name, values, colour, dash, width in shown
    )
    green = f"{plain(light.green, 1)}°"
    return Chart(
        "heading-light",
        "The heading, second by second",
        f"Above: the light. Below: what it goes by. Green needs both curves below {green} (the "
        "dashed line); what is at the top is unknown there. The scale is one of decades.",
        "time, s",
        (strip, Panel("heading, deg", lines, log=True, levels=(Level(light.green, green),))),
    )


def repeated_chart(result: NavigationRun) -> Chart | None:
    """Difference of a run from its re-run, with the bounds of both; None without a re-run."""
    repeated = result.trust.repeated
    if repeated is None or repeated.differences is None or repeated.record is None:
        return None
    table = repeated.differences
    time = table.index.to_numpy(dtype=np.float64)
    if len(time) < 2:
        return None
    place = np.hypot(table["north"].to_numpy(), table["east"].to_numpy())
    turn = np.abs(table["heading"].to_numpy(dtype=np.float64))
    both = (result.filtered, repeated.record)
    panels = []
    for label, difference, bounds in (
        ("place, m", place, [plane_bound(r.covariance) for r in both]),
        (
            "heading, deg",
            turn,
            [TWO_SIDED_95 * r.sd["heading"].to_numpy(dtype=np.float64) for r in both],
        ),
    ):
        lines = []
        tall = 0.0
        for name, record, values, look in (
            ("bound of the run (95 %)", both[0], bounds[0], (BLUE, "solid", 1.6)),
            ("bound of the repeated run (95 %)", both[1], bounds[1], (GREY, "dash", 1.4)),
        ):
            at = record.sd.index.to_numpy(dtype=np.float64)
            within = (at >= time[0]) & (at <= time[-1])
            lines.append((name, at[within], values[within], look))
            finite = values[within & np.isfinite(values)]
            tall = max(tall, float(np.quantile(finite, 0.98)) if finite.size else 0.0)
        # The bounds of a start, and those of an outage, would hide the rest.
        most = max(1.15 * tall, 1.02 * float(np.nanmax(difference)), 1e-6)
        lines.append(("run and repeated run apart", time, difference, (VERMILLION, "solid", 2.0)))
        zero = Line("", time[[0, -1]], np.zeros(2), GREY, points=True, size=0.0, legend=False)
        drawn = [
            curve(name, at, np.minimum(values, most), *look, buckets=BUCKETS)
            for name, at, values, look in lines
        ]
        panels.append(Panel(label, (zero, *drawn)))
    return Chart(
        "repeated",
        "The run and its repetition",
        f"How far the run is from the same run {repeated.change.what}, beside the bounds of both.",
        "time, s",
        tuple(panels),
    )
