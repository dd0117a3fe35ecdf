"""What the answer of a bench rests on: of one source, and the worst of several."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pandas as pd

from strapdown.attitude import AttitudeAlgorithm, RotationVector
from strapdown.results.answer import Cost
from strapdown.results.rests import RestStretch
from strapdown.rotation.angles import unit_rotation_angle
from strapdown.systems.attitude_answer import Evidence
from strapdown.systems.attitude_shares import MOST_ACCURATE, best_error
from strapdown.systems.attitude_sweep import Grounds, error_at_full_rate
from strapdown.tables import GYRO


def find_evidence(
    grounds: Grounds,
    algorithms: Sequence[AttitudeAlgorithm],
    costs: Sequence[Cost],
    sweep: pd.DataFrame,
    bias: dict[str, object],
    rests: tuple[RestStretch, ...],
    between_deg: float | None,
) -> Evidence:
    """Gather what the answer for one source rests on.

    Parameters
    ----------
    grounds : Grounds
    algorithms : sequence of AttitudeAlgorithm
    costs : sequence of Cost
        In the same order.
    sweep : DataFrame
        As `results.AttitudeBench.sweep`.
    bias : dict
        As `results.AttitudeBench.gyro_bias`.
    rests : tuple of RestStretch
    between_deg : float or None, deg
        How far the course of the rate between its stamps may matter.

    Returns
    -------
    Evidence
    """
    own, known, references = grounds.own, grounds.truth, grounds.references
    return Evidence(
        algorithms=algorithms,
        costs=costs,
        sweep=sweep,
        sensor=best_error(own, known, grounds.imu, grounds.q_nb, grounds.interpolation),
        known=known is not None or bool(len(references)),
        exact=own.exact,
        without_bias=_without_bias(grounds, bias, rests),
        with_cubic=_with_cubic(grounds),
        start=_start_error(grounds),
        sampling=0.0 if own.exact or between_deg is None else between_deg,
        reference_sd=_reference_sd(grounds),
    )


def worst_evidence(evidence: Sequence[Evidence], sweep: pd.DataFrame) -> Evidence:
    """Gather what an answer for several trials rests on: the worst of them.

    Parameters
    ----------
    evidence : sequence of Evidence
        Of each trial, over the same algorithms.
    sweep : DataFrame
        Of all of them (`attitude_trials.worst_sweep`).

    Returns
    -------
    Evidence
    """
    sensors = [e.sensor for e in evidence if e.sensor is not None]
    return replace(
        evidence[0],
        sweep=sweep,
        sensor=max(sensors, key=lambda e: e[2]) if sensors else None,
        known=any(e.known for e in evidence),
        exact=all(e.exact for e in evidence),
        without_bias=_worst([e.without_bias for e in evidence]),
        with_cubic=_worst([e.with_cubic for e in evidence]),
        start=max(e.start for e in evidence),
        sampling=max(e.sampling for e in evidence),
        reference_sd=max(e.reference_sd for e in evidence),
    )


def _worst(errors: Sequence[float | None]) -> float | None:
    """The largest, where all of them are known."""
    known = [e for e in errors if e is not None]
    return max(known) if len(known) == len(errors) else None


def _reference_sd(grounds: Grounds) -> float:
    """What the best reference point is known to, where there is no truth."""
    if grounds.truth is not None or grounds.references.empty:
        return 0.0
    return float(np.nan_to_num(grounds.references["sd"].to_numpy(dtype=np.float64)).min())


def _start_error(grounds: Grounds) -> float:
    """What the run's first attitude is off by, in deg, where that is known."""
    known = grounds.truth
    if known is None or not known.counts[0]:
        return 0.0
    return float(unit_rotation_angle(grounds.q_nb[None], known.q_nb[:1])[0])


def _without_bias(
    grounds: Grounds, bias: dict[str, object], rests: tuple[RestStretch, ...]
) -> float | None:
    """Error that the most accurate algorithm would leave with the bias of a rest removed."""
    nothing_known = grounds.truth is None and grounds.references.empty
    if bias["rad_per_s"] is not None or not rests or nothing_known:
        return None
    imu = grounds.imu.copy()
    imu[GYRO] = imu[GYRO].to_numpy() - np.asarray(rests[0].gyro_mean)
    return error_at_full_rate(MOST_ACCURATE, replace(grounds, imu=imu))


def _with_cubic(grounds: Grounds) -> float | None:
    """Error that would be left with rates as cubics, where they were taken as chords."""
    if grounds.interpolation == "cubic" or grounds.imu.attrs["sampling"] == "mean":
        return None
    if grounds.truth is None and grounds.references.empty:
        return None
    return error_at_full_rate(RotationVector(samples=1), replace(grounds, interpolation="cubic"))
