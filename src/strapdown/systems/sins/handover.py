"""From an alignment to navigation: the state, and what is known of it and of the sensors."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown import rotation
from strapdown.alignment.alignment import Alignment
from strapdown.alignment.fine_result import FineResult
from strapdown.ellipsoids import find_ellipsoid
from strapdown.estimation.error_filter import ErrorFilter, symmetric
from strapdown.estimation.error_model import PHYSICAL
from strapdown.estimation.filter_state import FilterState
from strapdown.frames import geodetic_from_ned
from strapdown.nav_state import NavState

__all__ = ["from_alignment", "from_fine", "from_state"]

Array = NDArray[np.float64]

# Errors of sensors that go together to this part of them are one.
SAME = 1e-9


def from_state(filter_: ErrorFilter, start: NavState, P: Array) -> FilterState:
    """Begin a filter with a state and the covariance of its nine errors.

    Parameters
    ----------
    filter_ : ErrorFilter
    start : NavState
    P : ndarray, (9, 9)
        Displacement, velocity, rotation in north-east-down; the sensors are as the model says.

    Returns
    -------
    FilterState
    """
    return filter_.begin(start, _with_sensors(filter_, P))


def from_alignment(
    filter_: ErrorFilter,
    found: Alignment,
    start: NavState,
    P: Array,
    rest: Array,
    by_others: Array | None = None,
) -> FilterState:
    """Begin a filter with a coarse alignment.

    Parameters
    ----------
    filter_ : ErrorFilter
    found : Alignment
        Its biases, where it tells any, are taken off.
    start : NavState
        Place and velocity; the attitude is that of the alignment.
    P : ndarray, (6, 6)
        Of displacement and velocity, north-east-down; that of the velocity is the alignment's,
        where it tells it.
    rest : ndarray, (6,)
        Mean rate and force of the record, which say what scale factors do.
    by_others : ndarray, (6, p), optional
        What every physical error adds to those of place and velocity, north-east-down
        (`by_antenna.errors_by_antenna`); they are correlated with them from the start.

    Returns
    -------
    FilterState
        Where the alignment does not tell biases, its tilt goes together with what accelerometers
        read too much at rest (`_levelled`): were they independent, the first zero velocity would
        take each for a witness of the other, and both for better known than they are.
    """
    whole = np.zeros((PHYSICAL, PHYSICAL))
    whole[:6, :6] = P
    whole[6:9, 6:9] = found.covariance
    start = replace(start, time=found.time, q_nb=found.q_nb)
    if found.gyro_bias is None or found.accel_bias is None:
        P = _levelled(filter_, whole, found.q_nb, rest)
        return filter_.begin(start, _added(P, by_others))
    assert found.gyro_bias_sd is not None and found.accel_bias_sd is not None
    told = np.concatenate([found.gyro_bias, found.accel_bias])
    sd = np.concatenate([found.gyro_bias_sd, found.accel_bias_sd])
    if found.by_input is not None:
        told = np.concatenate([told, found.by_input])
        sd = np.concatenate([sd, np.zeros(len(found.by_input))])
    joint = np.zeros((PHYSICAL + len(told), PHYSICAL + len(told)))
    joint[:PHYSICAL, :PHYSICAL] = whole
    joint[PHYSICAL:, PHYSICAL:] = np.diag(np.square(sd))
    if found.joint is not None:
        joint[3:, 3:] = found.joint
        # What is wrong of the velocity moved the place since its fix, and with it goes whatever
        # the alignment knows to go with the velocity.
        joint[:3, 3:] = np.linalg.solve(P[3:, 3:], P[3:, :3]).T @ found.joint[:3]
        joint[3:, :3] = joint[:3, 3:].T
    return _with_biases(filter_, start, joint, told, rest, by_others)


def from_fine(
    filter_: ErrorFilter,
    fine: FineResult,
    rest: Array,
    site_sd: ArrayLike = (0.0, 0.0, 0.0),
    shift: ArrayLike = (0.0, 0.0, 0.0),
    by_others: Array | None = None,
) -> FilterState:
    """Begin a filter where a fine alignment ended, with everything that it learned.

    The fine alignment has one bias for all that a sensor reads too much at rest: its covariance
    with the attitude goes on. Where the filter has more states that read as a bias at rest (a
    drift, a scale factor under gravity), each takes its part of it in proportion to its variance,
    as a Kalman filter that is told their sum: with x of covariance P0 before, and ``b = A x``,
    ``K = P0 A' (A P0 A')^-1``, the estimate is ``K b``, the covariance ``K P_b K' + (1 - K A) P0``
    and that with an attitude ``K P_ba``. Of biases alone K is 1.

    Parameters
    ----------
    filter_ : ErrorFilter
        Of navigation; any mechanization, error model and form.
    fine : FineResult
    rest : ndarray, (6,)
        Mean rate in rad/s and force in m/s² of the rest, body axes.
    site_sd : array_like, (3,), m
        How well the place of alignment itself is known, north, east, down.
    shift : array_like, (3,), m
        By which the place is to be moved, north, east, down: what a better attitude does to the
        arm of the antenna by which it was found.
    by_others : ndarray, (6, p), optional
        As of `from_alignment`.

    Returns
    -------
    FilterState
    """
    old, state = fine.filter, fine.state
    P = old.physical_covariance(state)
    level = old.mechanization.level_from_ned(state.row)
    turn = np.eye(len(P))
    for at in (0, 3, 6):
        turn[at : at + 3, at : at + 3] = level.T
    P = turn @ P @ turn.T
    P[0:3, 0:3] += np.diag(np.square(np.asarray(site_sd, dtype=np.float64)))
    start = old.mechanization.nav_state(state.mechanization, state.time)
    moved = np.asarray(shift, dtype=np.float64)
    if moved.any():
        here = np.array([math.degrees(start.lat), math.degrees(start.lon), start.alt])
        ellipsoid = find_ellipsoid(old.mechanization.ellipsoid)
        lat, lon, alt = geodetic_from_ned(moved, here, ellipsoid=ellipsoid).tolist()
        start = replace(start, lat=math.radians(lat), lon=math.radians(lon), alt=alt)
    return _with_biases(filter_, start, P, state.sensors, np.asarray(rest), by_others)


def _added(P: Array, by_others: Array | None) -> Array:
    """Covariance with what every error adds to those of place and velocity."""
    if by_others is None:
        return P
    T = np.eye(len(P))
    T[:6] += by_others
    return symmetric(T @ P @ T.T)


def _with_sensors(filter_: ErrorFilter, P: Array) -> Array:
    """Covariance of all physical errors: the sensors as their model says."""
    out = np.diag(np.concatenate([np.zeros(PHYSICAL), np.square(filter_.model.stacked.sd)]))
    out[:PHYSICAL, :PHYSICAL] = P
    return out


def _levelled(filter_: ErrorFilter, P: Array, q_nb: Array, rest: Array) -> Array:
    """Covariance of all physical errors after levelling by accelerometers.

    What they read too much, ``e = A x`` of the states x, tilts what is taken for gravity: by
    ``psi_x = -(C e)_east / g``, ``psi_y = (C e)_north / g``. A heading that goes with the tilt goes
    with x by that. Where x may be larger than the tilt is said to be, they go together as far as
    both can be.
    """
    out = _with_sensors(filter_, P)
    P0 = out[PHYSICAL:, PHYSICAL:]
    north_east = rotation.dcm_from_quaternion(q_nb)[:2] / float(np.linalg.norm(rest[3:]))
    T = np.array([[0.0, -1.0], [1.0, 0.0]]) @ north_east @ _read_at_rest(filter_, rest)[3:]
    attitude = P[6:9, 6:9]
    root = np.linalg.cholesky(attitude[:2, :2])
    own = np.linalg.solve(root, T @ np.sqrt(P0))
    part = min(1.0, 1.0 / max(float(np.linalg.norm(own, 2)), 1e-300))
    by_tilt = attitude[:, :2] @ np.linalg.inv(attitude[:2, :2])
    out[6:9, PHYSICAL:] = part * by_tilt @ T @ P0
    out[PHYSICAL:, 6:9] = out[6:9, PHYSICAL:].T
    return symmetric(out)


def _with_biases(
    filter_: ErrorFilter,
    start: NavState,
    joint: Array,
    told: Array,
    rest: Array,
    by_others: Array | None = None,
) -> FilterState:
    """Begin with a state whose errors are correlated with errors of sensors that were found.

    Of these the first six are what is read too much at the mean, and any more are by input.
    """
    P0 = np.diag(np.square(filter_.model.stacked.sd))
    A = _read_at_rest(filter_, rest - told[:6])
    if len(told) > len(A):
        A = np.vstack([A, _read_by_input(filter_)])
    size = np.sqrt(np.diagonal(A @ P0 @ A.T))
    known = size > 0.0
    A, at, size = A[known], PHYSICAL + np.flatnonzero(known), size[known]
    # Where scale factors are all that a channel errs by, its bias is one of them.
    parts = np.linalg.pinv(A @ P0 @ A.T / np.outer(size, size), SAME, hermitian=True)
    K = P0 @ A.T @ (parts / np.outer(size, size))
    P = _with_sensors(filter_, joint[:PHYSICAL, :PHYSICAL])
    left = symmetric(P0 - K @ A @ P0)
    P[PHYSICAL:, PHYSICAL:] = symmetric(K @ joint[np.ix_(at, at)] @ K.T) + left
    P[PHYSICAL:, :PHYSICAL] = K @ joint[at, :PHYSICAL]
    P[:PHYSICAL, PHYSICAL:] = P[PHYSICAL:, :PHYSICAL].T
    state = filter_.begin(start, _added(symmetric(P), by_others))
    return replace(state, sensors=K @ told[at - PHYSICAL])


def _read_at_rest(filter_: ErrorFilter, rest: Array) -> Array:
    """What each state of the sensors adds to the six channels of a body at rest, (6, k)."""
    stacked = filter_.model.stacked
    inputs = np.concatenate([[1.0], rest])
    return np.vstack([np.tensordot(inputs, of, axes=1) for of in (stacked.gyro, stacked.accel)])


def _read_by_input(filter_: ErrorFilter) -> Array:
    """What each state of the sensors adds to `Alignment.by_input`, (27, k)."""
    stacked = filter_.model.stacked
    parts = (stacked.gyro[1:4], stacked.gyro[4:7], stacked.accel[4:7])
    return np.concatenate([one.transpose(1, 0, 2).reshape(9, -1) for one in parts])
