"""What errors of gyros and accelerometers do to the attitude and velocity of a drive, backward."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.alignment.course_unknowns import (
    ACCEL_MATRIX,
    ACCEL_NOISE,
    GYRO_BY_FORCE,
    GYRO_MATRIX,
    GYRO_NOISE,
    OF_SENSORS,
    STRETCHES,
)
from strapdown.alignment.inertial_sums import InertialSums, sum_inertially
from strapdown.increments import motion_increments
from strapdown.tables import ACCEL, DV, GYRO

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

__all__ = ["DriveSums", "drive_sums"]

#: Over so much before and after it the rate at an instant is a mean, s.
STEADY = 0.1


@dataclass(frozen=True, eq=False)
class DriveSums:
    """A record summed from the instants of fixes to its end, k fixes, m nodes, s stretches.

    Attributes
    ----------
    until_end : ndarray, (k,), s
        From the fixes to the end of the record.
    turned : ndarray, (k, 3, 3)
        From the body's axes at a fix to those at the end, held still in inertial space.
    gained : ndarray, (k, 3), m/s
        Integral of the specific force from a fix to the end, in the axes at the end.
    rate : ndarray, (k, 3), rad/s
        Of the body at the fixes, without its shaking; body axes.
    stretch : ndarray, (s,), s
        Lengths of the stretches.
    by_gyro : ndarray, (k, 3, 21 + 3 s)
        What errors of the gyros add to that of the attitude at a fix, in the axes at the end, rad:
        a bias of each axis, the nine elements (i, j) of an error of axis i in proportion to what
        axis j has above its mean rate, nine in proportion to the specific force above its mean,
        and a bias of each axis in each stretch alone. Signs: bias is reading less truth, what is
        added is truth less computed.
    by_turn : ndarray, (k, 3, 21 + 3 s)
        What they add to the velocity at a fix, in the axes at the end, m/s.
    by_accel : ndarray, (k, 3, 12 + 3 s)
        What errors of the accelerometers add to the velocity: likewise, nine in proportion to the
        specific force.
    """

    until_end: Array
    turned: Array
    gained: Array
    rate: Array
    stretch: Array
    by_gyro: Array
    by_accel: Array
    by_turn: Array


def drive_sums(imu: pd.DataFrame, time: Array, means: Array, errors: Array) -> DriveSums:
    """Sum a record between fixes and its end.

    Parameters
    ----------
    imu : DataFrame
    time : ndarray, (k,), s
        Of fixes, within the record.
    means : ndarray, (6,)
        Of rate and force, about which errors in proportion to the input are counted.
    errors : ndarray
        The columns `course_unknowns.OF_SENSORS`, which are taken off.

    Returns
    -------
    DriveSums

    Notes
    -----
    With theta the rotation by which the true attitude is off the computed one,
    ``C_true = exp([theta x]) C``, and the true rate and force less by db and da than taken, it is
    ``theta(t) = theta_e + int_t^e C db`` and
    ``v(t) = v_e - int_t^e (C f + theta x C f - C da)``.
    """
    stamps = imu.index.to_numpy(dtype=np.float64)
    table = imu.copy()
    table.attrs = dict(imu.attrs)
    table[[*GYRO, *ACCEL]] = _mended(imu[[*GYRO, *ACCEL]].to_numpy(), stamps, means, errors)
    n = len(stamps) - 1
    before = np.clip(np.searchsorted(stamps, time, side="right") - 1, 0, n - 1)
    even = np.searchsorted(stamps, np.linspace(stamps[0], stamps[-1], 2 * STRETCHES + 1)[1:-1])
    ends = np.unique(np.concatenate([before, np.clip(even, 1, n), [n]]))
    ends = ends[ends > 0].astype(np.int64)
    sums = sum_inertially(table, ends)
    dv = np.ascontiguousarray(motion_increments(table)[DV].to_numpy(dtype=np.float64))
    steps = rotation.rotate(sums.turned[:-1], dv)
    gained = np.vstack([np.zeros((1, 3)), np.cumsum(steps, axis=0)])
    end = rotation.dcm_from_quaternion(sums.turned[-1]).T
    part = ((time - stamps[before]) / (stamps[before + 1] - stamps[before]))[:, None]
    there = gained[before] + part * steps[before]
    turn = rotation.rotation_vector_from_quaternion(
        rotation.compose(rotation.conjugate(sums.turned[before]), sums.turned[before + 1])
    )
    turned = rotation.dcm_from_quaternion(sums.turned[before])
    turned = turned @ rotation.dcm_from_rotation_vector(part * turn)
    stretch, by_gyro, by_accel, by_turn = _partials(
        sums, end, gained[np.r_[0, ends]], means - errors[:6]
    )
    edge = np.searchsorted(np.r_[0, ends], before)
    return DriveSums(
        stamps[-1] - time,
        end @ turned,
        (gained[-1] - there) @ end.T,
        _rate(sums.turned, stamps, time),
        stretch,
        by_gyro[edge],
        by_accel[edge],
        by_turn[edge],
    )


def _stretch_of(since: Array, length: float) -> Indices:
    """Stretch in which instants after the beginning lie."""
    return np.clip((since / length * STRETCHES).astype(np.int64), 0, STRETCHES - 1)


def _mended(values: Array, stamps: Array, means: Array, errors: Array) -> Array:
    """Rates and forces without errors."""
    x = np.concatenate([np.zeros(OF_SENSORS.start), errors])
    matrix, by_force = x[GYRO_MATRIX].reshape(3, 3), x[GYRO_BY_FORCE].reshape(3, 3)
    before = np.diff(stamps, prepend=stamps[0] - (stamps[1] - stamps[0]))
    here = _stretch_of(stamps - 0.5 * before - stamps[0], stamps[-1] - stamps[0])
    out = np.array(values, dtype=np.float64) - errors[:6]
    above = out - (means - errors[:6])
    rate, force = above[:, :3], above[:, 3:]
    out[:, :3] -= rate @ matrix.T + force @ by_force.T + x[GYRO_NOISE].reshape(-1, 3)[here]
    out[:, 3:] -= force @ x[ACCEL_MATRIX].reshape(3, 3).T + x[ACCEL_NOISE].reshape(-1, 3)[here]
    return out


def _partials(
    sums: InertialSums, end: Array, gained: Array, means: Array
) -> tuple[Array, Array, Array, Array]:
    """Lengths of the stretches, and what errors add at the beginning of each node."""
    m = len(sums.node_length)
    times = end @ sums.times
    middle = sums.middles
    of = _stretch_of(middle, sums.length)
    mine = (of[:, None] == np.arange(STRETCHES)).astype(np.float64)
    alone = np.einsum("mhi,ms->mhsi", times, mine).reshape(m, 3, 3 * STRETCHES)

    def above(products: Array, mean: Array) -> Array:
        out = np.einsum("gh,mhij->mgij", end, products) - times[:, :, :, None] * mean
        return np.asarray(out.reshape(m, 3, 9))

    by_rate, by_force = above(sums.turns, means[:3]), above(sums.pushes, means[3:])
    by_gyro = np.concatenate([times, by_rate, by_force, alone], axis=2)
    by_accel = np.concatenate([times, by_force, alone], axis=2)
    at_edge = _from_end(by_gyro)
    push = np.diff(gained, axis=0) @ end.T
    by_turn = rotation.cross_matrix(push) @ (at_edge[1:] + 0.5 * by_gyro)
    stretch = np.bincount(of, sums.node_length, STRETCHES).astype(np.float64)
    return stretch, at_edge, _from_end(by_accel), _from_end(by_turn)


def _from_end(nodes: Array) -> Array:
    """Sums of nodes from the beginning of each to the end, and nothing at the end."""
    nothing = np.zeros((1, *nodes.shape[1:]))
    return np.concatenate([np.cumsum(nodes[::-1], axis=0)[::-1], nothing])


def _rate(turned: Array, stamps: Array, time: Array) -> Array:
    """Mean rates about instants; body axes."""
    last = len(stamps) - 1
    first = np.clip(np.searchsorted(stamps, time - STEADY), 0, last - 1)
    past = np.clip(np.searchsorted(stamps, time + STEADY), first + 1, last)
    turn = rotation.compose(rotation.conjugate(turned[first]), turned[past])
    length = (stamps[past] - stamps[first])[:, None]
    return np.asarray(rotation.rotation_vector_from_quaternion(turn) / length)
