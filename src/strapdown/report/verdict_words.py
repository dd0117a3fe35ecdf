"""Verdict of a run in sentences, shared by terminal and page."""

from __future__ import annotations

import math

import numpy as np

from strapdown.evaluation.plane_bound import plane_bound
from strapdown.navigation.consistency import Inconsistency
from strapdown.navigation.heading_integrity import REASONS, SURE, WITNESSES, LightSpan
from strapdown.navigation.integrity import NO_NORTH, Advice, IntegrityReport, Repeated
from strapdown.report.values import GAP, duration_words, half, length_words, plain, share_words
from strapdown.report.values import alignment_values_instant as instant
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
            f"The place is known to {sized}, 95{GAP}%, if the sensors are as they were stated to "
            "be: nothing was observed that could bear it out."
        )
    if first is None:
        return f"You can trust the place to {sized}, 95{GAP}%."
    return (
        f"By its own bounds the place is known to {sized}, 95{GAP}%, but not all that was "
        f"observed bears them out: {first.name} {_KINDS[first.kind]}."
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
            f"it may be good, but nothing bears it out: its own bound is below {green}° and rests "
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
            '"zero_velocity"), would bear it out; so would fixes of a satellite receiver, over a '
            "change of speed or a turn"
        )
    return (
        f"{north}, so that no rest bears it out: fixes of a satellite receiver would, over a "
        "change of speed or a turn, or a second source of its own kind beside the first, as a "
        "compass beside two antennas"
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
