"""What a person should know of an entry state."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd

from strapdown.crash.entry_estimate import Estimate
from strapdown.crash.entry_priors import EntryPriors
from strapdown.errors import Finding

# A heading that is known less well is told.
WIDE_HEADING = 5.0  # deg
# Misfits of all fixes that chance makes more seldom are told.
UNLIKELY = 1e-4
#: Reasons that need no word: such fixes are not of the drive before the impact.
LATE = frozenset(
    ("crash.fix-after-impact", "crash.fix-perhaps-after-impact", "crash.fix-after-anchor")
)


def say_outliers(record: pd.DataFrame) -> None:
    """Say of each fix that lost weight how far it is off."""
    why: list[tuple[Finding, ...]] = record["why"].tolist()
    for name in ("position", "velocity"):
        lower = record["used"] & (record[f"{name}_weight"] < 1.0)
        misfits = record.loc[lower, f"{name}_misfit"].to_numpy(dtype=np.float64)
        for row, misfit in zip(np.flatnonzero(lower), misfits.tolist(), strict=True):
            reason = Finding(f"crash.fix-{name}-misfit", severity="note", misfit=misfit)
            why[row] = (*why[row], reason)
    record["why"] = pd.Series(why, index=record.index, dtype=object)


def findings(
    best: Estimate, record: pd.DataFrame, source: str | None, priors: EntryPriors, impact: float
) -> list[Finding]:
    """What a person should know of an estimate."""
    found = []
    late = record["why"].map(lambda why: any(f.code in LATE for f in why))
    refused = record[~record["used"] & ~late]
    if len(refused):
        found.append(
            Finding(
                "crash.fixes-before-impact-not-believed",
                file=source,
                quantity="fixes",
                count=len(refused),
                time=refused.index[0],
                reasons=refused["why"].iloc[0],
            )
        )
    lower = record[record["used"] & (record["why"].map(len) > 0)]
    if len(lower):
        found.append(
            Finding(
                "crash.fixes-less-weight-or-none",
                file=source,
                quantity="fixes",
                count=len(lower),
                time=lower.index[0],
                reasons=lower["why"].iloc[0],
            )
        )
    used = record.index[record["used"]]
    if impact - used[-1] > 2.0:
        found.append(
            Finding(
                "crash.last-fix-used-before-anchor",
                severity="note",
                file=source,
                quantity="fixes",
                impact=impact - used[-1],
            )
        )
    if priors.side_slip_sd_deg is not None and not best.slip_fixes:
        found.append(Finding("crash.side-slip-not-used-no", file=source, quantity="heading"))
    heading_sd = math.degrees(math.sqrt(best.covariance[8, 8]))
    if heading_sd > WIDE_HEADING:
        found.append(
            Finding(
                "crash.heading-known-only-drive-vehicle",
                file=source,
                quantity="heading",
                heading_sd=min(heading_sd, 180.0),
            )
        )
    if unlikely(best.chi_square, best.degrees_of_freedom):
        found.append(
            Finding(
                "crash.fixes-fit-worse-than-their",
                file=source,
                quantity="fixes",
                chi_square=best.chi_square,
                degrees_of_freedom=best.degrees_of_freedom,
                variance_factor=best.chi_square / best.degrees_of_freedom,
                sd_factor=math.sqrt(best.chi_square / best.degrees_of_freedom),
            )
        )
    return found


def unlikely(chi_square: float, degrees_of_freedom: int) -> bool:
    """Whether chance hardly makes a misfit as large as this."""
    from scipy.stats import chi2

    return bool(chi2.sf(chi_square, degrees_of_freedom) < UNLIKELY)
