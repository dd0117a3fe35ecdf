"""What the covariance of an alignment says of the errors of the hour after it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from papers.chernodarov.autonomous import after
from papers.chernodarov.setting import UNCERTAINTY, wander
from strapdown.alignment import FineResult
from strapdown.estimation import (
    COVARIANCES,
    PHYSICAL,
    ErrorFilter,
    RotationVectorModel,
    gyro_misalignment,
    gyro_scale,
)

Array = NDArray[np.float64]

#: Estimates taken off; left on; taken off, and errors taken as independent of each other.
KINDS = ("damped", "undamped", "independent")
EVERY = 10.0  # s
# Attitude and force by their means, s: the table turns by a few degrees in it at most.
STEP = 0.5


@dataclass(frozen=True, eq=False)
class Predicted:
    """Standard deviations, north and east together: the root of the sum of the variances.

    Attributes
    ----------
    time : ndarray, (n,), s
    speed : ndarray, (n,), m/s
    place : ndarray, (n,), m
    last : ndarray, (p, p)
        Covariance of the physical errors at the end, level axes.
    """

    time: Array
    speed: Array
    place: Array
    last: Array


def covariance_after(fine: FineResult, kind: str = "damped") -> Array:
    """Return the covariance of the physical errors at the end of an alignment.

    What is estimated and what its estimate is off by are independent of each other. So errors of
    sensors that are left as they are have the covariance of what is off, and that of the estimate
    besides: what was known before less what is not known after.

    Parameters
    ----------
    fine : FineResult
    kind : str
        Of `KINDS`.

    Returns
    -------
    ndarray, (15, 15)
        North-east-down; the biases in body axes.
    """
    filter_, state = fine.filter, fine.state
    level = filter_.mechanization.level_from_ned(state.row)
    turn = np.eye(filter_.model.physical_size)
    for at in (0, 3, 6):
        turn[at : at + 3, at : at + 3] = level.T
    P = np.asarray(turn @ filter_.physical_covariance(state) @ turn.T)
    if kind == "independent":
        return np.diag(np.diagonal(P))
    if kind == "undamped":
        stacked = filter_.model.stacked
        since = state.time - float(fine.history.index[0])
        before = np.diag(np.square(stacked.sd) + np.square(stacked.drive) * since)
        P[PHYSICAL:, PHYSICAL:] = before
    return P


def predict(fine: FineResult, increments: pd.DataFrame, kind: str) -> Predicted:
    """Take the covariance at the end of an alignment over the record after it.

    Parameters
    ----------
    fine : FineResult
    increments : DataFrame
    kind : str
        Of `KINDS`.

    Returns
    -------
    Predicted
        Scale factors and misalignments of the gyros are in it, which a rest does not show and a
        turn does.
    """
    P = covariance_after(fine, kind)
    gyro = UNCERTAINTY.gyro
    model = RotationVectorModel(
        fine.filter.model.gyro_noise,
        fine.filter.model.accel_noise,
        (
            *fine.filter.model.sensors,
            gyro_scale(gyro.axis("scale")),
            gyro_misalignment(max(gyro.axis("misalignment"))),
        ),
    )
    whole = np.zeros((model.physical_size,) * 2)
    whole[: len(P), : len(P)] = P
    more = slice(len(P), None)
    whole[more, more] = np.diag(np.square(model.stacked.sd[len(P) - PHYSICAL :]))
    used = ErrorFilter(wander("held"), model, COVARIANCES["joseph"](), step=STEP)
    start = fine.filter.mechanization.nav_state(fine.state.mechanization, fine.state.time)
    state = used.begin(start, whole)
    ends, rows = after(increments, state.time)
    rows = fine.filter.compensated(fine.state, rows)
    every = max(1, round(EVERY / float(np.median(np.diff(ends)))))
    found = []
    for k in range(0, len(ends) - every + 1, every):
        state, _ = used.predict(state, ends[k : k + every], rows[k : k + every])
        variance = np.diagonal(used.physical_covariance(state))
        found.append((state.time, variance[3] + variance[4], variance[0] + variance[1]))
    time, speed, place = np.array(found).T
    return Predicted(time, np.sqrt(speed), np.sqrt(place), used.physical_covariance(state))
