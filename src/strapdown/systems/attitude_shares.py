"""Whose the error is: the sensor's, the algorithm's, or single precision's."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.attitude import (
    AttitudeAlgorithm,
    RotationVector,
    attitude_history,
)
from strapdown.attitude.single import run_single, single_increments
from strapdown.evaluation.known import Errors, Known, angles_to_errors
from strapdown.increments import increments_from_imu
from strapdown.results.answer import Share
from strapdown.results.runs import AttitudeRun
from strapdown.rotation.angles import unit_rotation_angle
from strapdown.tables import QUATERNION

Array = NDArray[np.float64]

#: What stands for the truth of the algorithm alone on a log: of fourth order from rates and of
#: sixth from increments, whatever the steps.
MOST_ACCURATE = RotationVector(samples=4, coefficients="fit")


@dataclass(frozen=True)
class OwnTruth:
    """What an algorithm without error, on a sensor without error or with it, would say.

    Attributes
    ----------
    known : Known
        On a simulation the exact attitude, turned to begin where the run does; on a log that of
        the most accurate algorithm.
    clean : DataFrame or None
        The Imu table without the sensor's errors, on a simulation.
    """

    known: Known
    clean: pd.DataFrame | None

    @property
    def exact(self) -> bool:
        """Whether it is the truth itself, and not an estimate."""
        return self.clean is not None


def own_truth(
    imu: pd.DataFrame,
    clean: pd.DataFrame | None,
    truth: Known | None,
    q_nb: Array,
    interpolation: str,
) -> OwnTruth:
    """Find what the algorithms' own errors are to be measured against.

    Parameters
    ----------
    imu : DataFrame
        The samples as used.
    clean : DataFrame or None
        The same without the sensor's errors, for a simulation.
    truth : Known or None
    q_nb : ndarray, (4,)
        Attitude at the start.
    interpolation : str

    Returns
    -------
    OwnTruth
    """
    if clean is not None and truth is not None:
        # An algorithm is not to blame for a start that was given otherwise: the truth is turned
        # to begin there.
        start = rotation.compose(q_nb, rotation.conjugate(truth.q_nb[0]))
        return OwnTruth(replace(truth, q_nb=rotation.compose(start, truth.q_nb)), clean)
    increments = increments_from_imu(imu, interpolation)
    best = attitude_history(MOST_ACCURATE, increments, q_nb)
    return OwnTruth(Known(best, np.ones(len(best), dtype=bool)), None)


def between_samples(imu: pd.DataFrame, q_nb: Array) -> tuple[float, float] | None:
    """Estimate what the course of the rate between the samples matters.

    Parameters
    ----------
    imu : DataFrame
    q_nb : ndarray, (4,)

    Returns
    -------
    tuple of float, or None
        Rotation angle at the end, and the largest, in deg, between the attitude from rates that
        run along chords and from rates that run along cubics; None for mean rates, between
        which nothing runs.
    """
    if imu.attrs["sampling"] == "mean":
        return None
    chord, cubic = (
        attitude_history(MOST_ACCURATE, increments_from_imu(imu, how), q_nb)
        for how in ("linear", "cubic")
    )
    final, _, largest = angles_to_errors(unit_rotation_angle(chord, cubic))
    return final, largest


def find_shares(
    algorithms: Sequence[AttitudeAlgorithm],
    runs: Sequence[AttitudeRun],
    imu: pd.DataFrame,
    own: OwnTruth,
    truth: Known | None,
    q_nb: Array,
    interpolation: str,
) -> tuple[Share, ...]:
    """Split the error of each run.

    Parameters
    ----------
    algorithms : sequence of AttitudeAlgorithm
    runs : sequence of AttitudeRun
        In the same order.
    imu : DataFrame
        The samples that they ran on.
    own : OwnTruth
    truth : Known or None
    q_nb : ndarray, (4,)
    interpolation : str

    Returns
    -------
    tuple of Share
        On a simulation an error is exactly the algorithm's own, turned on by the sensor's:
        ``q_true^-1 q = (q_true^-1 q_clean)(q_clean^-1 q)``, so that their rotation vectors add up
        to within half their product.
    """
    clean = None if own.clean is None else increments_from_imu(own.clean, interpolation)
    rounded = single_increments(imu, interpolation)
    # On a log the sensor's share is what the most accurate algorithm is off by.
    of_sensor = None if truth is None or own.exact else truth.errors(own.known.q_nb)
    shares = []
    for algorithm, run in zip(algorithms, runs, strict=True):
        q = run.attitude[QUATERNION].to_numpy()
        if clean is None:
            mine, sensor = own.known.errors(q), of_sensor
        else:
            q_clean = attitude_history(algorithm, clean, q_nb)
            mine = own.known.errors(q_clean)
            sensor = angles_to_errors(unit_rotation_angle(q, q_clean))
        assert mine is not None
        apart = unit_rotation_angle(run_single(algorithm, rounded, q_nb), q)
        shares.append(Share(run.algorithm, mine, sensor, angles_to_errors(apart)))
    return tuple(shares)


def best_error(
    own: OwnTruth, truth: Known | None, imu: pd.DataFrame, q_nb: Array, interpolation: str
) -> Errors | None:
    """Error against the truth that no algorithm can do away with: that of sensor and start.

    Parameters
    ----------
    own : OwnTruth
    truth : Known or None
    imu : DataFrame
    q_nb : ndarray, (4,)
    interpolation : str

    Returns
    -------
    tuple of float, or None
        Final, RMS and largest, deg.
    """
    if truth is None:
        return None
    if own.clean is None:
        return truth.errors(own.known.q_nb)
    with_errors, without = (
        attitude_history(MOST_ACCURATE, increments_from_imu(table, interpolation), q_nb)
        for table in (imu, own.clean)
    )
    sensor = rotation.compose(rotation.conjugate(without), with_errors)
    return truth.errors(rotation.compose(own.known.q_nb, sensor))
