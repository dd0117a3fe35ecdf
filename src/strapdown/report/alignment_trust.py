"""Whether an alignment can be trusted: what its own record says for it and against it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from strapdown.alignment.fine_findings import ROCKS
from strapdown.constants import TWO_SIDED_95
from strapdown.errors import Finding
from strapdown.report.alignment_values import (
    small,
)
from strapdown.rotation import within_half_turn
from strapdown.systems.alignment_readiness import reference_offset
from strapdown.systems.alignment_run import AlignmentResult
from strapdown.tables import EULER
from strapdown.tables.checks import values_of

__all__ = ["ORDER", "Trust", "answer_error", "bounds_hold", "trust"]

Array = NDArray[np.float64]

ORDER = (2, 1, 0)  # heading first: it is the one that is hard
IN_BOUND = "this is in the stated uncertainty"
MOST_SAID = 2  # of what speaks against an answer, in one sentence
WORDS = {
    "trusted": "It can be trusted",
    "reserve": "It can be used with reserve",
    "distrusted": "It should not be trusted",
}


@dataclass(frozen=True)
class Trust:
    """Whether the answer can be trusted, and why.

    Attributes
    ----------
    verdict : {'trusted', 'reserve', 'distrusted'}
    reasons : tuple of (bool, str)
        What speaks for it, and what against.
    short : str
        What speaks for it, in a few words.
    """

    verdict: str
    reasons: tuple[tuple[bool, str], ...]
    short: str = ""

    @property
    def sentence(self) -> str:
        """The verdict in words, with what speaks against it."""
        against = [why for good, why in self.reasons if not good]
        said = WORDS[self.verdict]
        if against:
            more = len(against) - MOST_SAID
            rest = f"; and {more} more, under 'The answer'" if more > 0 else ""
            return f"{said}: {'; '.join(against[:MOST_SAID])}{rest}."
        return f"{said}: {self.short}." if self.short else f"{said}."


def answer_error(result: AlignmentResult) -> tuple[str, Array, float] | None:
    """What the answer is off from the truth or from a reference, deg, with the reference's sd.

    Returns
    -------
    tuple or None
        ``truth`` or the reference's name; roll, pitch, heading; standard deviation in deg.
    """
    if result.source.truth is not None:
        known = result.source.truth
        row = int(np.argmin(np.abs(known.index.to_numpy() - result.end.time)))
        off = result.end.roll_pitch_heading - values_of(known, EULER)[row]
        return "the truth", np.asarray(within_half_turn(off)), 0.0
    stated = result.spec.reference
    if stated is None:
        return None
    off = reference_offset(result.attitude, stated)
    return stated.source or "the reference", off, stated.sd_deg


def trust(result: AlignmentResult) -> Trust:
    """Judge the answer by what its own record says against it."""
    reasons: list[tuple[bool, str]] = []
    known = answer_error(result)
    sd = result.end.sd_deg
    if known is not None:
        name, off, own = known
        bound = TWO_SIDED_95 * np.hypot(sd, own)
        for k in ORDER:
            if math.isfinite(off[k]):
                good = bool(abs(off[k]) <= 3.0 / TWO_SIDED_95 * bound[k])
                within = "within" if abs(off[k]) <= bound[k] else "beyond"
                reasons.append(
                    (
                        good,
                        f"the {EULER[k]} is {small(off[k])}° from {name}, {within} its bound of "
                        f"{small(bound[k])}°",
                    )
                )
    # Causes before what they bring about.
    told = [*result.unread, *result.coarse.findings]
    told += () if result.fine is None else result.fine.findings
    reasons += [(False, _shortly(f)) for f in told if not _allowed(f, result)]
    reasons += _agreement(result)
    reasons += _surprises(result)
    against = [why for good, why in reasons if not good]
    verdict = "trusted" if not against else "reserve"
    # What a bound accounts for does not speak against the bound.
    counted = sum(IN_BOUND in f.what for f in told if not _allowed(f, result))
    if len(against) - counted > 1 or (against and known is not None and not reasons[0][0]):
        verdict = "distrusted"
    return Trust(verdict, tuple(reasons), _short(result, known is not None))


def bounds_hold(result: AlignmentResult) -> bool:
    """Whether nothing that the record itself shows contradicts the bounds."""
    return all(good for good, _ in (*_agreement(result), *_surprises(result)))


def _shortly(finding: Finding) -> str:
    """What a finding says before its numbers."""
    return finding.what.partition(": ")[0]


def _allowed(finding: Finding, result: AlignmentResult) -> bool:
    """Whether the coarse alignment was made for what a finding tells."""
    return finding.quantity == ROCKS and result.coarse.method == "inertial_frame"


def _short(result: AlignmentResult, known: bool) -> str:
    parts = []
    if known:
        parts.append("it is within three standard deviations of what is known from elsewhere")
    if result.fine is not None:
        parts.append("coarse and fine alignment agree")
        parts.append("at rest the sensors showed what was expected of them")
    else:
        parts.append("nothing in the record speaks against it; no fine alignment confirms it")
    return ", and ".join([", ".join(parts[:-1]), parts[-1]]) if len(parts) > 1 else parts[0]


def _agreement(result: AlignmentResult) -> list[tuple[bool, str]]:
    """Coarse and fine alignment beside each other, at the end of the coarse one."""
    if result.fine is None:
        return []
    time = result.attitude.index.to_numpy()
    row = int(np.argmin(np.abs(time - result.coarse.time)))
    here = values_of(result.attitude, EULER)[row]
    off = within_half_turn(result.coarse.roll_pitch_heading - here)
    bound = TWO_SIDED_95 * np.hypot(result.coarse.sd_deg, result.end.sd_deg)
    out = []
    for k in ORDER:
        good = bool(abs(off[k]) <= bound[k])
        word = "agree" if good else "do not agree"
        out.append(
            (
                good,
                f"coarse and fine alignment {word} in {EULER[k]}: they differ by "
                f"{small(off[k])}°, and may by {small(bound[k])}°",
            )
        )
    return out


def _surprises(result: AlignmentResult) -> list[tuple[bool, str]]:
    """Whether the innovations of the fine alignment are as large as they were expected."""
    if result.fine is None:
        return []
    out = []
    for name, table in result.fine.innovations.items():
        labels = [c.removeprefix("nu ") for c in table.columns if c.startswith("nu ")]
        ratios = [float(np.sqrt(np.mean(table[f"nu {x}"] ** 2 / table[f"s {x}"]))) for x in labels]
        worst = max(ratios, default=0.0)
        good = worst < 2.0
        said = "as large as expected" if good else "larger than expected"
        out.append(
            (
                good,
                f"the {name} at rest is {said}: {worst:.2g} of its standard deviation "
                "(root mean square, worst axis)",
            )
        )
    return out
