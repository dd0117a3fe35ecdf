"""A sensor that sums: increments of angle and velocity as means over their steps."""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from strapdown.errors import DataError
from strapdown.tables import imu_table
from strapdown.tables.checks import as_array, check_same_length, check_time

__all__ = ["imu_from_increments"]


def imu_from_increments(
    time: ArrayLike,
    theta: ArrayLike,
    dv: ArrayLike | None = None,
    dt: float | None = None,
    source: str | None = None,
) -> pd.DataFrame:
    """Make an Imu table of the increments that a sensor summed since its last sample.

    Parameters
    ----------
    time : array_like, (n,), s
        Stamps: the end of the interval of each sample, which begins at the stamp before it.
    theta : array_like, (n, 3), rad
        Integral of the rate over the interval, axis by axis, without coning correction.
    dv : array_like, (n, 3), m/s, optional
        Integral of the specific force, axis by axis, without sculling correction.
    dt : float, s, optional
        Length of the first interval, which no stamp tells; else the median step.
    source : str, optional
        Name for messages.

    Returns
    -------
    DataFrame
        An Imu table of means: each increment divided by its step.

    Raises
    ------
    DataError
        As `tables.imu_table`; `dt` is not positive.
    """
    stamps = as_array(time, None, "time", source)
    angle = as_array(theta, 3, "theta", source)
    velocity = None if dv is None else as_array(dv, 3, "dv", source)
    check_same_length(source, time=stamps, theta=angle)
    if velocity is not None:
        check_same_length(source, time=stamps, dv=velocity)
    check_time(stamps, source)
    if len(stamps) < 2 and dt is None:
        # The table says what is wrong with a single sample.
        return imu_table(stamps, angle, velocity, sampling="mean", source=source)
    first = float(np.median(np.diff(stamps))) if dt is None else float(dt)
    if not (np.isfinite(first) and first > 0.0):
        raise DataError(
            "mechanization.first-step-none", file=source, row=1, quantity="dt", first=first
        )
    steps = np.concatenate([[first], np.diff(stamps)])[:, None]
    return imu_table(
        stamps,
        angle / steps,
        None if velocity is None else velocity / steps,
        sampling="mean",
        source=source,
    )
