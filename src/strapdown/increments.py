"""From samples of a rate to the angular increments of the steps between them."""

from __future__ import annotations

import numpy as np
import pandas as pd

from strapdown._kernels import increments as kernel
from strapdown.tables import GYRO, check_imu, increments_table

__all__ = ["increments_from_imu"]


def increments_from_imu(imu: pd.DataFrame) -> pd.DataFrame:
    """Form the angular increments between the samples of a log.

    Parameters
    ----------
    imu : DataFrame
        An Imu table; any spacing, each step has its own length.

    Returns
    -------
    DataFrame
        An Increments table of one row less: a rate at the stamp is integrated by the
        trapezoid (Alexiev 2021, Eq. (2); second order in the step), a mean rate is multiplied
        by its step. The first row of a mean rate belongs to an interval that begins before
        the log, and is left out.

    Raises
    ------
    DataError
        As `tables.check_imu`.
    """
    check_imu(imu)
    time = np.ascontiguousarray(imu.index.to_numpy(dtype=np.float64))
    rate = np.ascontiguousarray(imu[GYRO].to_numpy(dtype=np.float64))
    theta = np.empty((len(time) - 1, 3))
    dtheta = np.empty_like(theta)
    kernel.increments(time, rate, imu.attrs["sampling"] == "mean", theta, dtheta)
    table = increments_table(time[1:], np.diff(time), theta, dtheta)
    table.attrs["source"] = imu.attrs.get("source")
    return table
