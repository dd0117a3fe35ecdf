"""Several logs or seeds together, so that a rank is not luck."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.config import LogSpec, ScenarioSpec
from strapdown.errors import ConfigError, Finding
from strapdown.results.answer import Trials
from strapdown.results.attitude_bench import AttitudeBench

Array = NDArray[np.float64]

#: Decimals of a degree beyond which two errors differ by rounding alone.
ROUNDED = 9
CONFIDENCE = 0.95
_KIND = ["algorithm", "meaning"]
_NUMBERS = [
    *("rate_hz", "own_deg", "final_deg", "rms_deg"),
    *("max_deg", "reference_deg", "error_deg"),
]
# Rates halve from cell to cell: one that is nearer than the root of two is the same.
NEAR = 2.0**0.5


def trial_names(sources: Sequence[ScenarioSpec | LogSpec]) -> list[str]:
    """Names of trials: of logs their path's last part, of a scenario its seed.

    Parameters
    ----------
    sources : sequence of ScenarioSpec or LogSpec

    Returns
    -------
    list of str
        All different.
    """
    names = [
        f"{s.name}, seed {s.seed}" if isinstance(s, ScenarioSpec) else Path(s.path).name
        for s in sources
    ]
    return [n if names.count(n) == 1 else f"{n} ({k + 1})" for k, n in enumerate(names)]


def gather(benches: Sequence[AttitudeBench], names: Sequence[str]) -> Trials:
    """Put the errors of several benches together.

    Parameters
    ----------
    benches : sequence of AttitudeBench
        Of the same algorithms.
    names : sequence of str
        Of the trials.

    Returns
    -------
    Trials
        The interval of the mean is Student's; `luck` is the one-sided probability, by
        Student's test of paired differences, that the next algorithm is in truth no worse.
    """
    rows = []
    for name, bench in zip(names, benches, strict=True):
        full = bench.sweep[(bench.sweep["factor"] == 1) & (bench.sweep["meaning"] == "drop")]
        for _, cell in full.iterrows():
            rows.append(
                {"trial": name}
                | {key: cell[key] for key in ("algorithm", "error_deg", "own_deg")}
                | {key: cell[key] for key in ("rms_deg", "final_deg")}
            )
    errors = pd.DataFrame(rows)
    return Trials(tuple(names), errors, rank(errors))


def rank(errors: pd.DataFrame) -> pd.DataFrame:
    """Rank algorithms by their mean error over trials.

    Parameters
    ----------
    errors : DataFrame
        ``trial``, ``algorithm``, ``error_deg``.

    Returns
    -------
    DataFrame
        As `results.Trials.ranking`.
    """
    from scipy import stats

    by = errors.pivot(index="trial", columns="algorithm", values="error_deg")
    order = by.mean().round(ROUNDED).sort_values(kind="stable").index
    count = len(by)
    rows = []
    for k, name in enumerate(order):
        values = by[name].to_numpy(dtype=np.float64)
        mean, spread = float(values.mean()), np.nan
        if count > 1:
            spread = float(stats.t.ppf(0.5 + CONFIDENCE / 2.0, count - 1) * stats.sem(values))
        luck = np.nan
        if k + 1 < len(order) and count > 1:
            luck = _luck(by[order[k + 1]].to_numpy(dtype=np.float64) - values)
        rows.append(
            {
                "algorithm": name,
                "mean_deg": mean,
                # An angle between attitudes lies between 0 and 180 deg, and so does its mean.
                "low_deg": float(np.maximum(0.0, mean - spread)),
                "high_deg": min(180.0, mean + spread),
                "luck": luck,
            }
        )
    return pd.DataFrame(rows)


def _luck(worse_by: Array) -> float:
    """Probability that differences with this mean come of a mean that is not positive."""
    from scipy import stats

    spread = float(worse_by.std(ddof=1))
    # Rounding alone tells nothing apart.
    if float(np.abs(worse_by).max()) < 10.0**-ROUNDED:
        return 0.5
    if spread <= 1e-12 * max(1.0, float(np.abs(worse_by).max())):
        return float(worse_by.mean() < 0.0)
    t = float(worse_by.mean()) / (spread / np.sqrt(len(worse_by)))
    return float(stats.t.sf(t, len(worse_by) - 1))


def worst_sweep(sweeps: Sequence[pd.DataFrame]) -> pd.DataFrame:
    """Cell by cell the largest errors of several sweeps.

    Parameters
    ----------
    sweeps : sequence of DataFrame
        As `results.AttitudeBench.sweep`, over the same algorithms.

    Returns
    -------
    DataFrame
        The cells of the first for which each of the others has a rate that is no more than
        `NEAR` times higher; its highest such is taken. The rate of a cell is the highest among
        those taken: each trial is judged at that rate or below.

    Raises
    ------
    ConfigError
        There is none.
    """
    first, *others = sweeps
    rows = []
    by_kind = [dict(list(other.groupby(_KIND))) for other in others]
    for cell in first.to_dict("records"):
        taken = [cell]
        for kinds in by_kind:
            cells = kinds[cell["algorithm"], cell["meaning"]]
            near = cells[cells["rate_hz"] <= NEAR * cell["rate_hz"]]
            if len(near):
                taken.append(near.loc[near["rate_hz"].idxmax()])
        if len(taken) == len(sweeps):
            numbers = pd.DataFrame([[float(row[name]) for name in _NUMBERS] for row in taken])
            rows.append(cell | dict(zip(_NUMBERS, numbers.max(), strict=True)))
    if not rows:
        raise ConfigError("attitude.no-rate-common-all-trials", quantity="--rates")
    return pd.DataFrame(rows)[list(first.columns)]


def not_judged(known: Sequence[bool], names: Sequence[str]) -> tuple[Finding, ...]:
    """Say which trials have nothing known, where others have.

    Parameters
    ----------
    known : sequence of bool
        Whether anything is known of the attitude, trial by trial.
    names : sequence of str

    Returns
    -------
    tuple of Finding
    """
    if not any(known):
        return ()
    return tuple(
        Finding(
            "attitude.nothing-known-attitude-algorithms-own",
            file=name,
            quantity="reference",
            severity="note",
        )
        for there, name in zip(known, names, strict=True)
        if not there
    )
