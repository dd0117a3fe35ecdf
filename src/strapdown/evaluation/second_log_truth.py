"""Attitude truth on the first log's clock and axes, from the log of a second sensor."""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from strapdown import rotation
from strapdown.attitude import Quaternion, run_attitude
from strapdown.errors import DataError
from strapdown.evaluation.differences import attitude_at
from strapdown.increments import increments_from_imu
from strapdown.results.second_log import SecondLog
from strapdown.tables import GYRO, attitude_table, check_imu, imu_table

Array = NDArray[np.float64]

__all__ = ["first_clock", "second_clock", "truth_from_second_log"]


def second_clock(aligned: SecondLog, time: ArrayLike) -> Array:
    """Turn instants of the first clock into those of the second.

    Parameters
    ----------
    aligned : SecondLog
    time : array_like, (n,), s

    Returns
    -------
    ndarray, (n,), s
    """
    t = np.asarray(time, dtype=np.float64)
    out: Array = t + aligned.offset + 1e-6 * aligned.drift_ppm * (t - aligned.middle)
    return out


def first_clock(aligned: SecondLog, time: ArrayLike) -> Array:
    """Turn instants of the second clock into those of the first: `second_clock` reversed.

    Parameters
    ----------
    aligned : SecondLog
    time : array_like, (n,), s

    Returns
    -------
    ndarray, (n,), s
    """
    since = np.asarray(time, dtype=np.float64) - aligned.middle - aligned.offset
    out: Array = aligned.middle + since / (1.0 + 1e-6 * aligned.drift_ppm)
    return out


def truth_from_second_log(
    aligned: SecondLog,
    first: pd.DataFrame,
    second: pd.DataFrame,
    *,
    attitude: pd.DataFrame | None = None,
    gyro_bias: ArrayLike = (0.0, 0.0, 0.0),
    q_start: ArrayLike = (1.0, 0.0, 0.0, 0.0),
) -> pd.DataFrame:
    """Attitude of the first sensor's axes at its stamps, as the second log tells it.

    Parameters
    ----------
    aligned : SecondLog
        From `second_log.align_second_log`.
    first, second : DataFrame
        The two Imu tables.
    attitude : DataFrame, optional
        Attitude table of the second sensor on its own clock. If it has one, it is taken; if
        not, the second log's rates are integrated, sample by sample as they are.
    gyro_bias : array_like, (3,), rad/s
        Bias of the second gyro in its own axes, taken off before: what is left of it turns
        the truth by so much in every second. From a rest, or from its calibration.
    q_start : array_like, (4,)
        Attitude of the first sensor at its first stamp that both cover: a gyro tells attitude
        from there on only. Not used where there is an `attitude`.

    Returns
    -------
    DataFrame
        An Attitude table at the stamps of the first log that both cover.

    Raises
    ------
    DataError
        The body turned about one axis only, so that the mounting is not known; or nothing is
        covered by both.

    Notes
    -----
    ``C_n1 = C_n2 C_12^T``. A time error ``dt`` shows as ``omega dt`` and a mounting error as
    itself in an absolute attitude; in one that starts equal, a mounting error ``m`` shows as
    ``m - C^T m``, at most twice itself.
    """
    if aligned.axis is not None:
        raise DataError(
            "evaluation.body-turned-about-axis-only",
            quantity="mounting",
            axis=[f"{v:.2f}" for v in aligned.axis],
        )
    check_imu(second)
    if attitude is None:
        # On the first clock: a second clock that runs fast would count every turn too large.
        imu = imu_table(
            first_clock(aligned, second.index),
            second[GYRO].to_numpy(dtype=np.float64) - np.asarray(gyro_bias),
            sampling=second.attrs["sampling"],
            source=second.attrs.get("source"),
        )
        table = run_attitude(Quaternion(), increments_from_imu(imu)).attitude
    else:
        table = attitude
    stamps = first.index.to_numpy(dtype=np.float64)
    there = stamps if attitude is None else second_clock(aligned, stamps)
    inside = (there >= table.index[0]) & (there <= table.index[-1])
    if inside.sum() < 2:
        raise DataError(
            "evaluation.stamps-first-log-lie-within", quantity="time", inside=int(inside.sum())
        )
    q_n2 = attitude_at(table, there[inside])
    q_21 = rotation.conjugate(aligned.mounting)
    q_n1 = rotation.compose(q_n2, q_21)
    if attitude is None:
        since_start = rotation.compose(rotation.conjugate(q_n1[0]), q_n1)
        q_n1 = rotation.compose(q_start, since_start)
    return attitude_table(stamps[inside], q_n1, source="second log")
