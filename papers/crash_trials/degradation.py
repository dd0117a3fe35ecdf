"""What becomes of the bounds where something acts that they were not told of."""

from __future__ import annotations

import pandas as pd

from papers.crash_trials.coverage import Trials, coverage
from papers.crash_trials.paper_experiment import RINGINGS
from papers.crash_trials.trial_case import TrialPriors, Untold

#: By name: ringing of each kind, accelerometers that bend more than told, and triggers that are
#: late by more than they say.
UNTOLD: dict[str, Untold] = {
    "nothing": Untold(),
    **{f"ringing, {name}": Untold(ringing=(r,)) for name, r in RINGINGS.items()},
    "nonlinearity of 2 % of full scale": Untold(nonlinearity=0.02),
    "nonlinearity of 5 % of full scale": Untold(nonlinearity=0.05),
    "trigger off by 5 ms": Untold(trigger_sd=0.005),
    "trigger off by 10 ms": Untold(trigger_sd=0.010),
}


def degradation(
    cases: int = 500,
    *,
    seed: int = 0,
    workers: int | None = None,
    priors: TrialPriors | None = None,
    untold: dict[str, Untold] | None = None,
) -> dict[str, Trials]:
    """Run the same cases with what nobody was told of.

    Parameters
    ----------
    cases : int
    seed : int
    workers : int, optional
    priors : TrialPriors, optional
        All as `coverage`.
    untold : dict of str to Untold, optional
        `UNTOLD`, if not given.

    Returns
    -------
    dict of str to Trials
    """
    return {
        name: coverage(cases, seed=seed, workers=workers, priors=priors, untold=what)
        for name, what in (UNTOLD if untold is None else untold).items()
    }


def degradation_table(trials: dict[str, Trials]) -> pd.DataFrame:
    """Put the coverage of every answer side by side.

    Parameters
    ----------
    trials : dict of str to Trials

    Returns
    -------
    DataFrame
        Answers by what was not told: share of the cases that count whose interval holds the truth.
    """
    return pd.DataFrame({name: t.table()["inside"] for name, t in trials.items()})
