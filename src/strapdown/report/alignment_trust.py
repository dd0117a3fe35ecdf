"""Judge whether an alignment can be trusted, from the evidence in its own record."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown.alignment.fine import ROCKS
from strapdown.constants import TWO_SIDED_95
from strapdown.errors import Finding
from strapdown.rotation import within_half_turn
from strapdown.systems.alignment_run import AlignmentRun, reference_offset
from strapdown.tables import EULER
from strapdown.tables.checks import values_of

Array = NDArray[np.float64]

ORDER = (2, 1, 0)  # heading first: it is the hardest to determine
MOST_SAID = 2  # reasons against an answer in one sentence
WORDS = {
    "trusted": "It can be trusted",
    "reserve": "It can be used with reserve",
    "distrusted": "It should not be trusted",
}


@dataclass(frozen=True)
class Trust:
    """Verdict on an answer, with its reasons.

    Attributes
    ----------
    verdict : {'trusted', 'reserve', 'distrusted'}
    reasons : tuple of Finding
        A note supports the answer, a warning contradicts it.
    short : tuple of Finding
        Supporting reasons in short form.
    """

    verdict: str
    reasons: tuple[Finding, ...]
    short: tuple[Finding, ...] = ()

    @property
    def supporting(self) -> tuple[Finding, ...]:
        """Reasons that support the answer."""
        return tuple(one for one in self.reasons if one.severity == "note")

    @property
    def against(self) -> tuple[Finding, ...]:
        """Reasons against the answer."""
        return tuple(one for one in self.reasons if one.severity != "note")

    @property
    def sentence(self) -> str:
        """The verdict in words, with the reasons against the answer."""
        against = [one.sentence() for one in self.against]
        said = WORDS[self.verdict]
        if against:
            more = len(against) - MOST_SAID
            rest = f"; and {more} more, under 'The answer'" if more > 0 else ""
            return f"{said}: {'; '.join(against[:MOST_SAID])}{rest}."
        short = [one.sentence() for one in self.short]
        if len(short) > 1:
            short = [f"{', '.join(short[:-1])}, and {short[-1]}"]
        return f"{said}: {short[0]}." if short else f"{said}."


def reason(good: bool, code: str, **data: Any) -> Finding:
    """Return a reason for an answer or against it."""
    return Finding(code, severity="note" if good else "warning", data=data)


def answer_error(result: AlignmentRun) -> tuple[str, Array, float] | None:
    """Return the error against the truth or a reference, deg, with the reference's sd.

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


def trust(result: AlignmentRun) -> Trust:
    """Judge the answer by the evidence in its own record."""
    reasons: list[Finding] = []
    known = answer_error(result)
    sd = result.end.sd_deg
    if known is not None:
        name, off, own = known
        bound = TWO_SIDED_95 * np.hypot(sd, own)
        for k in ORDER:
            if math.isfinite(off[k]):
                good = bool(abs(off[k]) <= 3.0 / TWO_SIDED_95 * bound[k])
                within = bool(abs(off[k]) <= bound[k])
                reasons.append(
                    reason(
                        good,
                        "alignment.error-within-bound"
                        if within
                        else "alignment.error-beyond-bound",
                        angle=EULER[k],
                        reference=name,
                        off_deg=off[k],
                        bound_deg=bound[k],
                    )
                )
    # Causes come before their effects.
    told = [*result.unread, *result.coarse.findings]
    told += () if result.fine is None else result.fine.findings
    reasons += [f for f in told if f.severity == "warning" and not _allowed(f, result)]
    reasons += _agreement(result)
    reasons += _surprises(result)
    against = [one for one in reasons if one.severity == "warning"]
    verdict = "trusted" if not against else "reserve"
    # A finding that the bound already includes does not contradict the bound.
    counted = sum(bool(one.data.get("in_bound")) for one in against)
    wrong = known is not None and bool(against) and reasons[0].severity == "warning"
    if len(against) - counted > 1 or wrong:
        verdict = "distrusted"
    return Trust(verdict, tuple(reasons), _short(result, known is not None))


def bounds_hold(result: AlignmentRun) -> bool:
    """Whether the record is consistent with the bounds."""
    return all(one.severity == "note" for one in (*_agreement(result), *_surprises(result)))


def _allowed(finding: Finding, result: AlignmentRun) -> bool:
    """Whether the coarse alignment method is designed for the condition of a finding."""
    return finding.code == ROCKS and result.coarse.method == "inertial_frame"


def _short(result: AlignmentRun, known: bool) -> tuple[Finding, ...]:
    codes = ["alignment.near-known"] if known else []
    if result.fine is not None:
        codes += ["alignment.coarse-and-fine-agree", "alignment.sensors-as-expected"]
    else:
        codes.append("alignment.not-contradicted")
    return tuple(reason(True, code) for code in codes)


def _agreement(result: AlignmentRun) -> list[Finding]:
    """Compare coarse and fine alignment at the end of the coarse alignment."""
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
        out.append(
            reason(
                good,
                "alignment.angle-agrees" if good else "alignment.angle-disagrees",
                angle=EULER[k],
                off_deg=off[k],
                bound_deg=bound[k],
            )
        )
    return out


def _surprises(result: AlignmentRun) -> list[Finding]:
    """Check the size of the fine-alignment innovations against their expected covariance."""
    if result.fine is None:
        return []
    out = []
    for name, table in result.fine.innovations.items():
        labels = [c.removeprefix("nu ") for c in table.columns if c.startswith("nu ")]
        ratios = [float(np.sqrt(np.mean(table[f"nu {x}"] ** 2 / table[f"s {x}"]))) for x in labels]
        worst = max(ratios, default=0.0)
        good = worst < 2.0
        out.append(
            reason(
                good,
                "alignment.innovations-as-expected"
                if good
                else "alignment.innovations-larger-than-expected",
                name=name,
                ratio=worst,
            )
        )
    return out
