"""What a place and a velocity owe to the antenna by whose fixes they were found."""

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
    """Return what every error adds to those of a place and velocity that are of fixes.

    Parameters
    ----------
    filter_ : ErrorFilter
    name : str
        Of the aid whose fixes they are.
    q_nb : ndarray, (4,)
    lever_arm : ndarray, (3,), m
        Of the antenna, body axes.
    velocity : ndarray, (3,), m/s
        North, east, down.
    turn : ndarray, (3,), rad/s
        Of the body relative to the Earth, body axes.

    Returns
    -------
    ndarray, (6, p)
        Of displacement and velocity, north-east-down, by the physical errors.

    Notes
    -----
    A fix is of an instant that is later by what the time offset is assumed too large, tau, so that
    the place is wrong by ``v tau``. With arm r and rate W in north-east-down, the place ``p - r``
    is wrong by ``[r x] psi - C e``, and the velocity ``v - W x r`` by
    ``[(W x r) x] psi - W x C e``, where psi is the error of the attitude and e that of the arm.
    Without these correlations the first fixes would be taken for independent of the place that
    they made, and prove that no time is off.
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
