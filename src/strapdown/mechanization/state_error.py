"""Difference of two navigation states."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from strapdown import rotation
from strapdown._kernels import geodetic as kernel
from strapdown.ellipsoids import WGS84, Ellipsoid
from strapdown.frames import q_ne
from strapdown.nav_state import NavState

__all__ = ["displacement_between", "state_error"]

Array = NDArray[np.float64]


def state_error(state: NavState, truth: NavState, ellipsoid: Ellipsoid = WGS84) -> Array:
    """Return the error of a state, as defined in the filters.

    Parameters
    ----------
    state, truth : NavState
    ellipsoid : Ellipsoid

    Returns
    -------
    ndarray, (9,)
        State − truth, in north-east-down of `state`: displacement in m (to 1e-9 m), difference
        of the velocities as vectors in m/s, and the rotation vector in rad of the attitude relative
        to the Earth, ``C_state = exp([psi x]) C_true``. `Mechanization.correct` subtracts it.
    """
    apart = displacement_between(state, truth, ellipsoid)
    # From the truth's local level to that of the state.
    between = rotation.compose(_q_ne(state), rotation.conjugate(_q_ne(truth)))
    psi = rotation.rotation_vector_from_quaternion(
        rotation.compose(state.q_nb, rotation.conjugate(rotation.compose(between, truth.q_nb)))
    )
    return np.concatenate([apart, state.v_n - rotation.rotate(between, truth.v_n), psi])


def displacement_between(state: NavState, truth: NavState, ellipsoid: Ellipsoid = WGS84) -> Array:
    """Return the first three numbers of `state_error`, (3,), m."""
    return np.array(
        kernel.displacement(
            state.lat,
            state.lon,
            state.alt,
            truth.lat,
            truth.lon,
            truth.alt,
            ellipsoid.semi_major_axis,
            ellipsoid.eccentricity_squared,
        )
    )


def _q_ne(state: NavState) -> Array:
    return q_ne(math.degrees(state.lat), math.degrees(state.lon))
