"""How often the intervals of 95 % hold the truth."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import partial

import numpy as np
import pandas as pd

from papers.crash_trials.many_cases import each_case
from papers.crash_trials.trial_case import TrialPriors, Untold, draw_case
from papers.crash_trials.trial_outcome import TrialOutcome, judge_case

LEVEL = 0.95


@dataclass(frozen=True, eq=False)
class Trials:
    """Outcomes of many cases.

    Attributes
    ----------
    kinds : Series
        Of crash, by case.
    excluded : Series of str
        By case: why it does not count; empty for those that do.
    errors, sds, inside : DataFrame
        Cases that count by answers: answer less truth, told standard deviation, whether the
        interval of 95 % holds the truth.
    """

    kinds: pd.Series
    excluded: pd.Series
    errors: pd.DataFrame = field(repr=False)
    sds: pd.DataFrame = field(repr=False)
    inside: pd.DataFrame = field(repr=False)

    def table(self) -> pd.DataFrame:
        """Coverage of every answer.

        Returns
        -------
        DataFrame
            By answer: ``cases``; ``inside``, share; ``low high``, between which a share lies that
            is 95 % in truth, but for three in a thousand such shares: three standard errors;
            ``rms``, ``mean`` and ``largest`` error; ``sd``, quadratic mean of what was told;
            ``ratio``, quadratic mean of error over sd: one, if the bound is right.
        """
        count = self.errors.notna().sum()
        slack = 3.0 * np.sqrt(LEVEL * (1.0 - LEVEL) / count)
        return pd.DataFrame(
            {
                "cases": count,
                "inside": self.inside.astype(np.float64).mean(),
                "low": LEVEL - slack,
                "high": LEVEL + slack,
                "rms": np.sqrt((self.errors**2).mean()),
                "mean": self.errors.mean(),
                "largest": self.errors.abs().max(),
                "sd": np.sqrt((self.sds**2).mean()),
                "ratio": np.sqrt(((self.errors / self.sds) ** 2).mean()),
            }
        )


def coverage(
    cases: int = 2000,
    *,
    seed: int = 0,
    workers: int | None = None,
    priors: TrialPriors | None = None,
    untold: Untold | None = None,
) -> Trials:
    """Reconstruct many crashes that are drawn, and see whether the bounds hold the truth.

    Parameters
    ----------
    cases : int
    seed : int
    workers : int, optional
        As `many_cases.each_case`; the outcomes do not depend on it.
    priors : TrialPriors, optional
    untold : Untold, optional
        What acts and is in no bound.

    Returns
    -------
    Trials
    """
    one = partial(_judged, seed=seed, priors=priors or TrialPriors(), untold=untold or Untold())
    return gather(each_case(one, cases, workers))


def gather(outcomes: Iterable[TrialOutcome]) -> Trials:
    """Put outcomes side by side.

    Parameters
    ----------
    outcomes : iterable of TrialOutcome
    """
    known = {o.number: o for o in outcomes}
    counted = {n: o.answers for n, o in known.items() if not o.excluded}

    def table(name: str) -> pd.DataFrame:
        rows = {n: {k: getattr(a, name) for k, a in each.items()} for n, each in counted.items()}
        return pd.DataFrame.from_dict(rows, orient="index")

    return Trials(
        pd.Series({n: o.kind for n, o in known.items()}, name="kind"),
        pd.Series({n: o.excluded for n, o in known.items()}, name="excluded"),
        table("error"),
        table("sd"),
        table("inside"),
    )


def _judged(number: int, *, seed: int, priors: TrialPriors, untold: Untold) -> TrialOutcome:
    return judge_case(draw_case(number, seed, priors, untold))
