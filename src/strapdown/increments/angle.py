"""From samples of a rate to the angular increments of the steps between them."""

from __future__ import annotations

import numpy as np
import pandas as pd

from strapdown._kernels import increments as kernel
from strapdown.errors import ConfigError
from strapdown.tables import GYRO, check_imu, increments_table

__all__ = ["increments_from_imu"]


INTERPOLATIONS = ("linear", "cubic")


def increments_from_imu(imu: pd.DataFrame, interpolation: str = "linear") -> pd.DataFrame:
    """Form the angular increments between the samples of a log.

    Parameters
    ----------
    imu : DataFrame
        An Imu table; any spacing, each step has its own length.
    interpolation : {'linear', 'cubic'}
        How rates at the stamps run between them: along the chord (the trapezoid, Alexiev 2021,
        Eq. (2); second order in the step), or along the cubic through the two samples and
        their neighbours (fourth order on smooth motion; a step beside a gap or in a burst
        uses the neighbours whose steps are like it, within a factor of two). The cubic of a
        step needs the sample after it, so that live it is known one sample late. A mean rate
        has nothing between stamps to interpolate.

    Returns
    -------
    DataFrame
        An Increments table of one row less; a mean rate is multiplied by its step. The first
        row of a mean rate belongs to an interval that begins before the log, and is left out.

    Raises
    ------
    DataError
        As `tables.check_imu`.
    ConfigError
        `interpolation` is unknown.
    """
    if interpolation not in INTERPOLATIONS:
        raise ConfigError(
            "mechanization.no-interpolation",
            quantity="interpolation",
            interpolation=interpolation,
            interpolations=INTERPOLATIONS,
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
