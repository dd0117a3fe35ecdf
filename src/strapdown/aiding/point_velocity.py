"""How a point of the body moves, as it is computed, and what the errors do to it."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown._kernels.level import AXIS
from strapdown.aiding.view import ROTATION, VELOCITY, View
from strapdown.estimation.error_model import PHYSICAL
from strapdown.rotation import cross_matrix

__all__ = ["point_velocity", "rate_columns", "turn_of_body"]

Array = NDArray[np.float64]


def rate_columns(view: View, rate: Array, force: Array) -> Array:
    """Return what the errors of the gyros do to a rate that they measure.

    Parameters
    ----------
    view : View
    rate, force : ndarray, (3,), rad/s and m/s²
        What is measured.

    Returns
    -------
    ndarray, (3, columns)
        Body axes.
    """
    gyro = view.model.stacked.gyro
    weights = np.concatenate([[1.0], rate, force])
    H = np.zeros((3, view.columns))
    H[:, PHYSICAL:] = np.tensordot(weights, gyro, axes=1)
    return H


def turn_of_body(view: View) -> tuple[Array, Array]:
    """Return the rate of the body relative to the Earth, and its errors.

    Parameters
    ----------
    view : View

    Returns
    -------
    rate : ndarray, (3,), rad/s
        Body axes: ``w_ib - C_bl w_ie``.
    H : ndarray, (3, columns)
        Of the errors of the gyros, and of the attitude that turns the Earth's rate:
        ``-C_bl [w_ie x] psi``.
    """
    earth = view.ellipsoid.rotation_rate * view.level[AXIS : AXIS + 3]
    C_bl = view.C_lb.T
    H = rate_columns(view, view.rate, view.force)
    H[:, ROTATION] = -C_bl @ cross_matrix(earth)
    return view.rate - C_bl @ earth, H


def point_velocity(view: View, arm: ArrayLike) -> tuple[Array, Array]:
    """Return the velocity relative to the Earth of a point that is fixed to the body.

    Parameters
    ----------
    view : View
    arm : array_like, (3,), m
        From the inertial sensors to the point, body axes.

    Returns
    -------
    velocity : ndarray, (3,), m/s
        Body axes: ``C_bl v + w_eb x r``.
    H : ndarray, (3, columns)
        ``C_bl (dv + [v x] psi) - [r x] dw_eb``, with ``C_computed = exp([psi x]) C_true``.
    """
    r = np.asarray(arm, dtype=np.float64)
    C_bl = view.C_lb.T
    velocity = C_bl @ view.velocity
    H = np.zeros((3, view.columns))
    if r.any():
        turn, of_turn = turn_of_body(view)
        velocity = velocity + np.cross(turn, r)
        H -= cross_matrix(r) @ of_turn
    H[:, VELOCITY] += C_bl
    H[:, ROTATION] += C_bl @ cross_matrix(view.velocity)
    return velocity, H
