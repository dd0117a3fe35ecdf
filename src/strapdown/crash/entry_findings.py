"""What a person should know of an entry state."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd

from strapdown.crash.entry_estimate import Estimate
from strapdown.crash.entry_priors import EntryPriors
from strapdown.exceptions import Finding

# A heading that is known less well is told.
WIDE_HEADING = 5.0  # deg
# Misfits of all fixes that chance makes more seldom are told.
UNLIKELY = 1e-4


def say_outliers(record: pd.DataFrame) -> None:
    """Say of each fix that lost weight how far it is off."""
    for name in ("position", "velocity"):
        lower = record["used"] & (record[f"{name}_weight"] < 1.0)
        misfits = record.loc[lower, f"{name}_misfit"].to_numpy(dtype=np.float64)
        before = record.loc[lower, "why"].tolist()
        record.loc[lower, "why"] = [
            f"{said}{'; ' if said else ''}{name} {t:.3g} sd from what the others say"
            for said, t in zip(before, misfits.tolist(), strict=True)
        ]


def findings(
    best: Estimate, record: pd.DataFrame, source: str | None, priors: EntryPriors, impact: float
) -> list[Finding]:
    """What a person should know of an estimate."""
    found = []
    late = record["why"].str.contains("after the anchor|impact")
    refused = record[~record["used"] & ~late]
    if len(refused):
        found.append(
            Finding(
                f"{len(refused)} fixes before the impact are not believed; the first, at "
                f"{refused.index[0]:.6g} s: {refused['why'].iloc[0]}",
                file=source,
                quantity="fixes",
                remedy="look at EntryState.fixes; a receiver is not believed under such motion",
            )
        )
    lower = record[record["used"] & (record["why"] != "")]
    if len(lower):
        found.append(
            Finding(
                f"{len(lower)} fixes have less weight or none; the first, at "
                f"{lower.index[0]:.6g} s: {lower['why'].iloc[0]}",
                file=source,
                quantity="fixes",
                remedy="look at EntryState.fixes; reflections from buildings make such fixes",
            )
        )
    used = record.index[record["used"]]
    if impact - used[-1] > 2.0:
        found.append(
            Finding(
                f"the last fix that is used is {impact - used[-1]:.3g} s before the anchor: the "
                "inertial sensors alone carry the state from there",
                file=source,
                quantity="fixes",
                remedy="nothing, if this is expected: the standard deviations have grown with it",
            )
        )
    if priors.side_slip_sd_deg is not None and not best.slip_fixes:
        found.append(
            Finding(
                "the side slip was not used: at no fix is the vehicle faster than 3 m/s and nearly "
                "straight",
                file=source,
                quantity="heading",
                remedy="use a longer window, or a heading from elsewhere",
            )
        )
    heading_sd = math.degrees(math.sqrt(best.covariance[8, 8]))
    if heading_sd > WIDE_HEADING:
        found.append(
            Finding(
                f"the heading is known to {min(heading_sd, 180.0):.3g} deg only: in this drive the "
                "vehicle hardly speeds up, brakes or turns",
                file=source,
                quantity="heading",
                remedy="if it travels along its axis, say so (side_slip_sd_deg); give a heading "
                "from elsewhere; or use a longer window",
            )
        )
    if unlikely(best.chi_square, best.degrees_of_freedom):
        found.append(
            Finding(
                f"the fixes fit worse than their standard deviations say: chi-square "
                f"{best.chi_square:.4g} of {best.degrees_of_freedom} degrees of freedom",
                file=source,
                quantity="fixes",
                remedy="the covariance is too small by up to "
                f"{best.chi_square / best.degrees_of_freedom:.3g}: look for a wrong antenna, time "
                "offset or axes, vibration, or a receiver that claims too much",
            )
        )
    return found


def unlikely(chi_square: float, degrees_of_freedom: int) -> bool:
    """Whether chance hardly makes a misfit as large as this."""
    from scipy.stats import chi2

    return bool(chi2.sf(chi_square, degrees_of_freedom) < UNLIKELY)
