"""How far one state of navigation is from another."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.ellipsoids import WGS84, Ellipsoid
from strapdown.frames import C_ne, ecef_from_geodetic, q_ne
from strapdown.nav_state import NavState

__all__ = ["state_error"]

Array = NDArray[np.float64]


def state_error(state: NavState, truth: NavState, ellipsoid: Ellipsoid = WGS84) -> Array:
    """Return the error of a state, as filters have it.

    Parameters
    ----------
    state, truth : NavState
    ellipsoid : Ellipsoid

    Returns
    -------
    ndarray, (9,)
        State less truth, in north-east-down of `state`: displacement in m (to 1e-9 m), difference
        of the velocities as vectors in m/s, and the rotation vector in rad of the attitude relative
        to the Earth, ``C_state = exp([psi x]) C_true``. `Mechanization.correct` takes it off.
    """
    here, there = _degrees(state), _degrees(truth)
    turn = C_ne(here[0], here[1])
    apart = ecef_from_geodetic(here, ellipsoid=ellipsoid) - ecef_from_geodetic(
        there, ellipsoid=ellipsoid
    )
    # Of the truth's local level to that of the state.
    between = rotation.compose(q_ne(here[0], here[1]), rotation.conjugate(q_ne(there[0], there[1])))
    psi = rotation.rotation_vector_from_quaternion(
        rotation.compose(state.q_nb, rotation.conjugate(rotation.compose(between, truth.q_nb)))
    )
    return np.concatenate([turn @ apart, state.v_n - rotation.rotate(between, truth.v_n), psi])


def _degrees(state: NavState) -> list[float]:
    return [math.degrees(state.lat), math.degrees(state.lon), state.alt]
