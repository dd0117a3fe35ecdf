"""Correlation of a position and velocity from fixes with lever arm and time offset."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.aiding.aid import DISPLACEMENT, ROTATION, VELOCITY
from strapdown.estimation.error_filter import ErrorFilter

__all__ = ["errors_by_antenna"]

Array = NDArray[np.float64]


def errors_by_antenna(
    filter_: ErrorFilter,
    name: str,
    q_nb: Array,
    lever_arm: Array,
    velocity: Array,
    turn: Array,
) -> Array:
    """Return the errors of position and velocity from fixes per physical error.

    Parameters
    ----------
    filter_ : ErrorFilter
    name : str
        Name of the measurement with the fixes.
    q_nb : ndarray, (4,)
    lever_arm : ndarray, (3,), m
        Lever arm of the antenna, body axes.
    velocity : ndarray, (3,), m/s
        North, east, down.
    turn : ndarray, (3,), rad/s
        Rate of the body relative to the Earth, body axes.

    Returns
    -------
    ndarray, (6, p)
        Displacement and velocity, north-east-down, per physical error.

    Notes
    -----
    A time offset that is assumed too large by tau shifts a fix in time, so that the position is
    wrong by ``v tau``. With arm r and rate W in north-east-down, the position ``p - r``
    is wrong by ``[r x] psi - C e``, and the velocity ``v - W x r`` by
    ``[(W x r) x] psi - W x C e``, where psi is the error of the attitude and e that of the arm.
    Without these correlations the first fixes would count as independent of the position that was
    made from them, and would confirm a zero time offset.
    """
    columns = filter_.model.columns_of
    C = rotation.dcm_from_quaternion(q_nb)
    out = np.zeros((6, filter_.model.physical_size))
    out[DISPLACEMENT, ROTATION] = rotation.cross_matrix(C @ lever_arm)
    out[VELOCITY, ROTATION] = rotation.cross_matrix(C @ np.cross(turn, lever_arm))
    if f"{name}.lever_arm" in columns:
        arm = columns[f"{name}.lever_arm"]
        out[DISPLACEMENT, arm] = -C
        out[VELOCITY, arm] = -C @ rotation.cross_matrix(turn)
    if f"{name}.time_offset" in columns:
        out[DISPLACEMENT, columns[f"{name}.time_offset"]] = velocity[:, None]
    return out
