"""Differences between attitudes as rotation angles."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from strapdown import rotation
from strapdown.results.runs import AttitudeRun
from strapdown.rotation.angles import unit_rotation_angle
from strapdown.tables import QUATERNION

Array = NDArray[np.float64]

__all__ = ["attitude_at", "error_angles", "largest_differences"]


def attitude_at(attitude: pd.DataFrame, time: ArrayLike) -> Array:
    """Attitude at any instants within a table.

    Parameters
    ----------
    attitude : DataFrame
        An Attitude table.
    time : array_like, (n,), s
        Within the table's span; beyond it the nearest end is returned.

    Returns
    -------
    ndarray, (n, 4)
        The rows themselves where the stamps are in the table; between them, turned at a
        constant rate from one to the next.
    """
    stamps = attitude.index.to_numpy(dtype=np.float64)
    q = attitude[QUATERNION].to_numpy(dtype=np.float64)
    t = np.asarray(time, dtype=np.float64)
    right = np.clip(np.searchsorted(stamps, t, side="left"), 0, len(stamps) - 1)
    out: Array = q[right].copy()
    between = (t < stamps[right]) & (right > 0)
    if between.any():
        k = right[between]
        share = (t[between] - stamps[k - 1]) / (stamps[k] - stamps[k - 1])
        turn = rotation.rotation_vector_from_quaternion(
            rotation.compose(rotation.conjugate(q[k - 1]), q[k])
        )
        part = rotation.quaternion_from_rotation_vector(turn * share[:, None])
        out[between] = rotation.compose(q[k - 1], part)
    return out


def error_angles(attitude: pd.DataFrame, truth: pd.DataFrame) -> pd.Series:
    """Rotation angle between an attitude and the truth, at the stamps of the truth.

    Parameters
    ----------
    attitude, truth : DataFrame
        Attitude tables.

    Returns
    -------
    Series
        In deg, indexed by time: the stamps of `truth` within the span of `attitude`.
    """
    stamps = truth.index.to_numpy(dtype=np.float64)
    inside = (stamps >= attitude.index[0]) & (stamps <= attitude.index[-1])
    known = truth[QUATERNION].to_numpy(dtype=np.float64)[inside]
    angles = unit_rotation_angle(attitude_at(attitude, stamps[inside]), known)
    return pd.Series(angles, index=pd.Index(stamps[inside], name="time"), name="error")


def largest_differences(runs: tuple[AttitudeRun, ...]) -> pd.DataFrame:
    """Largest rotation angle over time between each pair of runs of one log.

    Parameters
    ----------
    runs : tuple of AttitudeRun
        On the same stamps.

    Returns
    -------
    DataFrame
        Square, symmetric, in deg; labelled by algorithm.
    """
    names = [run.algorithm for run in runs]
    table = pd.DataFrame(0.0, index=names, columns=names)
    for a, b in combinations(range(len(runs)), 2):
        angle = unit_rotation_angle(
            runs[a].attitude[QUATERNION].to_numpy(), runs[b].attitude[QUATERNION].to_numpy()
        )
        table.iloc[a, b] = table.iloc[b, a] = float(angle.max())
    return table
