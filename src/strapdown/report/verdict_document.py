"""The verdict page of a run: can it be trusted, and if not, what speaks against it."""

from __future__ import annotations

import math

import numpy as np

from strapdown import __version__
from strapdown.evaluation.heading_light import REASONS
from strapdown.evaluation.plane_bound import plane_bound
from strapdown.report.alignment_values import instant
from strapdown.report.crash_values import GAP, plain
from strapdown.report.document import (
    Block,
    Document,
    Items,
    KeyFigure,
    KeyFigures,
    Paragraph,
    Section,
    TableBlock,
)
from strapdown.report.navigation_values import (
    duration_words,
    half,
    length_words,
    share_words,
)
from strapdown.report.verdict_picture import heading_error, light_picture, repeated_picture
from strapdown.report.verdict_words import (
    advice_words,
    answer,
    degrees_words,
    first_words,
    kind_words,
    promise,
    repeated_words,
    span_words,
    unwitnessed_words,
    witness_words,
)
from strapdown.systems.sins.carried_heading import UNSEEN
from strapdown.systems.sins.result import NavigationResult

__all__ = ["light_section", "verdict_document"]

#: Rows of a table of the page; the files have all.
_MOST = 12


def verdict_document(result: NavigationResult, name: str) -> Document:
    """Return the verdict page of a run of navigation.

    Parameters
    ----------
    result : NavigationResult
    name : str
        Of the folder.

    Returns
    -------
    Document
    """
    trust = result.trust
    seen = len(trust.light.table) > 0
    sound = trust.first is None and seen and trust.light.spans[-1].colour == "green"
    sections = (
        Section("heading", "Is the heading to be trusted?", _heading(result)),
        Section("innovations", "Does what was observed agree?", _innovations(result)),
        Section("first", "What is the first that does not, and does it matter?", _first(result)),
        Section("meaning", "What the colours mean", (Items(promise(trust)), _limits())),
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
            *((light_picture(result),) if seen else ()),
        ),
        sections,
        f"Verdict on {name}",
        links=(("report.html", "The whole report"),),
    )


def light_section(result: NavigationResult) -> Section:
    """The light of the heading, as a section of the report."""
    said = Paragraph(answer(result))
    return Section(
        "trust", "Can it be trusted?", (said, light_picture(result), *_of_filter(result))
    )


def _of_filter(result: NavigationResult) -> tuple[Block, ...]:
    """Of a run that was smoothed, what is not."""
    if result.forward is None:
        return ()
    return (
        Paragraph(
            "The light, and the repeated run, are of the filter alone: of what was known at each "
            "second then. Smoothed, the heading is known by what came later, too.",
            "note",
        ),
    )


def _keys(result: NavigationResult) -> tuple[KeyFigure, ...]:
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
            "What was observed",
            _agrees(result),
            _looked_at(len(trust.consistency))
            if first is None
            else f"{first.name} {kind_words(first)}",
            "" if first is None else f"since {instant(first.since)}",
        ),
    )


def _agrees(result: NavigationResult) -> str:
    trust = result.trust
    if not trust.consistency:
        return "nothing"
    if trust.first is None:
        return "agrees"
    # Single gross errors are none of the filter's.
    if trust.against_bounds is None:
        return "agrees, mostly"
    return "does not agree"


def _since(result: NavigationResult, colour: str) -> str:
    seconds = 0.0
    for span in reversed(result.trust.light.spans):
        if span.colour != colour:
            break
        seconds += span.end - span.begin
    return duration_words(seconds)


def _heading(result: NavigationResult) -> tuple[Block, ...]:
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
                _capital(advice_words(a, trust)),
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


def _reasons(result: NavigationResult) -> TableBlock:
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


def _against_truth(result: NavigationResult) -> TableBlock | None:
    """How large errors were under each colour; None where the truth is not known."""
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


def _innovations(result: NavigationResult) -> tuple[Block, ...]:
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
            "What was observed against what was expected of it; a scatter of 1 is as stated",
        )
    ]
    small = [
        (name, v.what)
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


def _first(result: NavigationResult) -> tuple[Block, ...]:
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
    picture = repeated_picture(result)
    if picture is not None:
        blocks.append(picture)
    repeated = trust.repeated
    if repeated is not None and repeated.left:
        rows_left = tuple((i.name, f"{kind_words(i)}: {i.what}.") for i in repeated.left[:_MOST])
        blocks += [Paragraph("What does not agree in the repeated run:"), Items(rows_left)]
    return tuple(blocks)


def _limits() -> Block:
    return Paragraph(
        "What no light can tell: a record whose fixes are all wrong in the same way, as of a "
        "receiver that is led astray with a motion of its own, agrees with itself. And a gyro that "
        f"changes by more than {UNSEEN:g} standard deviations of its bias after the last rest, in "
        "a run without fixes, is seen by nothing before the next one.",
        "note",
    )


def _looked_at(number: int) -> str:
    return "one observation looked at" if number == 1 else f"{number} observations looked at"


def _capital(text: str) -> str:
    return f"{text[:1].upper()}{text[1:]}"
