"""Angular increments from samples of angular rate."""

from __future__ import annotations

import numpy as np
import pandas as pd

from strapdown._kernels import increments as kernel
from strapdown.errors import check_choice
from strapdown.tables import GYRO, check_imu, increments_table

INTERPOLATIONS = ("linear", "cubic")


def increments_from_imu(imu: pd.DataFrame, interpolation: str = "linear") -> pd.DataFrame:
    """Form the angular increments between the samples of a log.

    Parameters
    ----------
    imu : DataFrame
        An Imu table; any spacing, each step has its own length.
    interpolation : {'linear', 'cubic'}
        Rate between the stamps. ``linear``: the trapezoid rule (Alexiev 2021, Eq. (2)), second
        order in the step. ``cubic``: the cubic through the two samples and their neighbors, fourth
        order on smooth motion; beside a gap or in a burst only neighbors whose steps agree within a
        factor of two are used. The cubic needs the sample after the step, which delays live output
        by one sample. Ignored for mean rates.

    Returns
    -------
    DataFrame
        An Increments table with one row less than `imu`. A mean rate is multiplied by its step; its
        first row is omitted because that interval begins before the log.

    Raises
    ------
    DataError
        As `tables.check_imu`.
    ConfigError
        `interpolation` is unknown.
    """
    check_choice(
        "mechanization.no-interpolation",
        INTERPOLATIONS,
        quantity="interpolation",
        interpolation=interpolation,
    )
    check_imu(imu)
    time = np.ascontiguousarray(imu.index.to_numpy(dtype=np.float64))
    rate = np.ascontiguousarray(imu[GYRO].to_numpy(dtype=np.float64))
    dt = np.diff(time)
    theta = np.empty((len(dt), 3))
    dtheta = np.empty_like(theta)
    mean = imu.attrs["sampling"] == "mean"
    if interpolation == "cubic" and not mean:
        kernel.increments_cubic(dt, rate, theta, dtheta)
    else:
        kernel.increments(dt, rate, mean, theta, dtheta)
    table = increments_table(time[1:], dt, theta, dtheta)
    table.attrs["source"] = imu.attrs.get("source")
    return table
