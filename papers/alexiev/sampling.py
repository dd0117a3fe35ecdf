"""Samples of a motion, algorithms over them, and the errors that come of it."""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from strapdown import rotation
from strapdown.attitude import AttitudeAlgorithm, attitude_history, make_algorithm
from strapdown.increments import increments_from_imu
from strapdown.simulation import ImuErrors, Motion, find_scenario, simulate_imu
from strapdown.tables import QUATERNION

Array = NDArray[np.float64]

__all__ = ["algorithm_history", "errors_over_time", "final_error", "scenario_motion", "sweep"]

NONE = ImuErrors()
FOUR = ("naive", "euler", "dcm", "quaternion")


def scenario_motion(name: str) -> Motion:
    """Return the motion of a scenario."""
    return find_scenario(name).motion


def algorithm_history(
    algorithm: str | AttitudeAlgorithm, increments: pd.DataFrame, q_nb: ArrayLike
) -> Array:
    """Return quaternions at the start and after each step, (n+1, 4)."""
    made = make_algorithm(algorithm) if isinstance(algorithm, str) else algorithm
    return attitude_history(made, increments, q_nb)


def errors_over_time(
    motion: Motion,
    algorithm: str | AttitudeAlgorithm,
    rate: float,
    *,
    sampling: str = "instantaneous",
    interpolation: str = "linear",
    errors: ImuErrors = NONE,
    seed: int = 0,
) -> tuple[Array, Array]:
    """Run an algorithm over samples of a motion, from its true attitude at time zero.

    Parameters
    ----------
    motion : Motion
    algorithm : str or AttitudeAlgorithm
    rate : float, Hz
    sampling, interpolation : str
        As `simulate_imu` and `increments_from_imu`.
    errors : ImuErrors
    seed : int

    Returns
    -------
    time : ndarray, (n,), s
    error : ndarray, (n,), deg
        Rotation angle from the exact attitude.
    """
    imu, truth = simulate_imu(
        motion, errors, rate=rate, sampling=sampling, seed=seed, accelerometer=False
    )
    known = truth[QUATERNION].to_numpy()
    found = algorithm_history(algorithm, increments_from_imu(imu, interpolation), known[0])
    return truth.index.to_numpy(dtype=np.float64), rotation.rotation_angle(found, known)


def final_error(
    motion: Motion, algorithm: str | AttitudeAlgorithm, rate: float, **how: object
) -> float:
    """Return the error in deg at the end; options as `errors_over_time`."""
    return float(errors_over_time(motion, algorithm, rate, **how)[1][-1])  # type: ignore[arg-type]


def sweep(
    motion: Motion, algorithm: str | AttitudeAlgorithm, rates: ArrayLike, **how: object
) -> Array:
    """Return the final error in deg at each of the rates; options as `errors_over_time`."""
    return np.array([final_error(motion, algorithm, float(r), **how) for r in np.asarray(rates)])
