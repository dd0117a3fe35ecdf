"""An attitude algorithm in single precision, as an embedded processor runs it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from strapdown import rotation
from strapdown._kernels.arithmetic import single_precision
from strapdown.attitude.algorithm import Array, AttitudeAlgorithm
from strapdown.tables import GYRO

Single = NDArray[np.float32]


def single_increments(imu: pd.DataFrame, interpolation: str = "linear") -> tuple[Single, ...]:
    """Form increments in single precision from rates that a device reads as floats.

    Parameters
    ----------
    imu : DataFrame
        An Imu table. The steps are differences of its stamps, rounded once: a device counts
        its clock in whole numbers.
    interpolation : {'linear', 'cubic'}

    Returns
    -------
    dt, theta, dtheta : ndarray of float32
        (n,) s, (n, 3) rad, (n, 3) rad.
    """
    kernel = single_precision("increments")
    dt = np.diff(imu.index.to_numpy(dtype=np.float64)).astype(np.float32)
    rate = np.ascontiguousarray(imu[GYRO].to_numpy(dtype=np.float32))
    theta = np.empty((len(dt), 3), np.float32)
    dtheta = np.empty_like(theta)
    mean = imu.attrs["sampling"] == "mean"
    if interpolation == "cubic" and not mean:
        kernel.increments_cubic(dt, rate, theta, dtheta)
    else:
        kernel.increments(dt, rate, mean, theta, dtheta)
    return dt, theta, dtheta


def single_kernel(algorithm: AttitudeAlgorithm) -> Any:
    """Return the loop of an algorithm over many steps, compiled in single precision."""
    function = type(algorithm).advance_kernel.py_func
    module = single_precision(function.__module__.rpartition(".")[2])
    return getattr(module, function.__name__)


def run_single(
    algorithm: AttitudeAlgorithm, increments: tuple[Single, ...], q_nb: ArrayLike
) -> Array:
    """Run an algorithm with every operation in single precision.

    Parameters
    ----------
    algorithm : AttitudeAlgorithm
    increments : tuple of ndarray
        From `single_increments`.
    q_nb : array_like, (4,)
        Attitude at the start, body to local level.

    Returns
    -------
    ndarray, (n+1, 4)
        Quaternions at the start and after each step, read from the algorithm's own numbers in
        double precision.
    """
    dt, theta, dtheta = increments
    state = algorithm.begin(rotation.normalise(q_nb)).astype(np.float32)
    first = state[None, : algorithm.width].astype(np.float64)
    history = np.empty((len(dt), algorithm.width), np.float32)
    options = (np.float32(option) for option in algorithm.kernel_options())
    single_kernel(algorithm)(state, dt, theta, dtheta, history, *options)
    return algorithm.quaternions(np.vstack([first, history.astype(np.float64)]))
