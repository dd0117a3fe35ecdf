"""Numbers of a bench that several tables and charts share."""

from __future__ import annotations

import math
from collections.abc import Sequence

import pandas as pd

from strapdown.attitude_algorithms.algorithm import AttitudeRun
from strapdown.attitude_comparison.comparison import AttitudeComparison
from strapdown.attitude_comparison.references import PeerRun
from strapdown.evaluation.reference_points import Score

__all__ = [
    "MEANINGS",
    "chosen_run",
    "full_rate_errors",
    "largest_known",
    "like_with_like",
    "sweep_grid",
]

#: Methods of lowering the sample rate, with their labels.
MEANINGS = {
    "drop": "samples left out",
    "sum": "increments summed",
}


def largest_known(scores: Sequence[Score]) -> float | None:
    """Largest finite error against a known attitude, deg; None if there is none."""
    found = [s.error_deg if s.max_deg is None else s.max_deg for s in scores]
    return max((e for e in found if math.isfinite(e)), default=None)


def full_rate_errors(bench: AttitudeComparison) -> dict[str, float]:
    """Return the error by which each algorithm is judged, at the log's own rate.

    Parameters
    ----------
    bench : AttitudeComparison

    Returns
    -------
    dict of str to float
        In deg, in the order of the runs: the largest error against known attitudes, else the
        algorithm error.
    """
    own = {share.algorithm: share.own_deg[2] for share in bench.shares}
    swept: dict[str, float] = {}
    if len(bench.sweep):
        rows = bench.sweep[bench.sweep["factor"] == 1]
        swept = dict(zip(rows["algorithm"].tolist(), rows["error_deg"].tolist(), strict=True))
    errors = {}
    for run in bench.runs:
        name = run.algorithm
        known = largest_known([s for s in bench.scores if s.algorithm == name])
        errors[name] = swept.get(name, own.get(name, math.nan) if known is None else known)
    return errors


def chosen_run(bench: AttitudeComparison) -> AttitudeRun:
    """Return the run of the recommended algorithm, else that with the smallest error."""
    for run in bench.runs:
        if run.algorithm == bench.answer.algorithm:
            return run
    errors = full_rate_errors(bench)
    return min(
        bench.runs,
        key=lambda r: errors[r.algorithm] if math.isfinite(errors[r.algorithm]) else math.inf,
    )


def sweep_grid(bench: AttitudeComparison, meaning: str) -> pd.DataFrame:
    """Return the errors of one method of lowering the rate.

    Parameters
    ----------
    bench : AttitudeComparison
    meaning : {'drop', 'sum'}

    Returns
    -------
    DataFrame
        In deg: algorithms in the order of the runs, rates in Hz from high to low; NaN where an
        algorithm did not run.
    """
    names = [run.algorithm for run in bench.runs]
    if not len(bench.sweep):
        return pd.DataFrame(index=names)
    part = bench.sweep[bench.sweep["meaning"] == meaning]
    grid = part.pivot_table(
        index="algorithm", columns="rate_hz", values="error_deg", aggfunc="max", dropna=False
    )
    return grid.reindex(index=names)[sorted(grid.columns, reverse=True)]


def like_with_like(bench: AttitudeComparison) -> tuple[list[PeerRun], list[PeerRun]]:
    """Split the other libraries into gyro-only ones, as the bench's own are, and aided ones."""
    alone = [p for p in bench.peers if p.aiding == "gyro"]
    return alone, [p for p in bench.peers if p.aiding != "gyro"]
