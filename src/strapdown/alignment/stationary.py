"""Known motion of a stationary body as filter observations: ZUPT, position and Earth rate.

Chernodarov (2009), Eqs. (16)-(18): Earth rate, constant position, zero velocity.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from strapdown import rotation
from strapdown._kernels.earth import RATE
from strapdown._kernels.level import AXIS, OMEGA_EL, Q_LB, V_L
from strapdown.alignment.alignment import Site
from strapdown.constants import STANDARD_GRAVITY
from strapdown.ellipsoids import find_ellipsoid
from strapdown.estimation.covariance import Observation
from strapdown.estimation.error_filter import ErrorFilter, FilterState
from strapdown.estimation.error_model import PHYSICAL, Segment
from strapdown.mechanization.mechanization import Mechanization, displacement_between
from strapdown.nav_state import NavState
from strapdown.sensors.triad_errors import Triad
from strapdown.tables.checks import Array

AXES = ("x", "y", "z")
#: Observations of a rest: Earth rate, constant position, zero velocity.
OBSERVATIONS = ("rate", "position", "velocity")
# Fewer do not determine the variance.
LEAST_STRETCHES = 8
# The largest of several variances of few samples, over the expected one: of eight
# chi-square with 8 degrees of freedom one in a thousand is beyond 3.9.
BY_CHANCE = 4.0
# Assumed rotation of the body where none is found, as a fraction of the noise of its gyros.
LEAST_TURN = 0.3


@dataclass(frozen=True, eq=False)
class Standing:
    """Residual motion of a stationary body, as standard deviations in level axes.

    Attributes
    ----------
    position : ndarray, (3,), m
        Position at an epoch about its mean.
    velocity : ndarray, (3,), m/s
    turn : ndarray, (3,), rad
        Rotation relative to the Earth from one epoch to the next.
    """

    position: Array
    velocity: Array
    turn: Array


def still_observations(
    filter_: ErrorFilter,
    state: FilterState,
    home: NavState,
    standing: Standing,
    names: Sequence[str],
) -> list[Observation]:
    """Return the observations at the end of an epoch: (17) and (18).

    `state`: at the end of the epoch. `home`: the position of alignment. `names`: of `OBSERVATIONS`.
    """
    made = []
    if "position" in names:
        made.append(position_observation(filter_, state, home, standing))
    if "velocity" in names:
        made.append(velocity_observation(filter_, state, standing))
    return made


def position_observation(
    filter_: ErrorFilter, state: FilterState, home: NavState, standing: Standing
) -> Observation:
    """The computed position minus that of alignment: (17), as a displacement in level axes.

    Includes the height, if the mechanization's is free.
    """
    used = filter_.mechanization
    here = used.nav_state(state.mechanization, state.time)
    earth = find_ellipsoid(used.ellipsoid)
    apart = used.level_from_ned(state.row) @ displacement_between(here, home, earth)
    rows = 2 if used.height == "held" or not filter_.model.has_height else 3
    H = np.zeros((rows, filter_.model.physical_size))
    H[:, :rows] = np.eye(rows)
    return Observation(
        "position", apart[:rows], H, standing.position[:rows] ** 2, _labels("m")[:rows]
    )


def velocity_observation(
    filter_: ErrorFilter, state: FilterState, standing: Standing
) -> Observation:
    """The computed velocity, which should be zero: (18)."""
    rows = 2 if filter_.mechanization.height == "held" else 3
    level = filter_.mechanization.levels(state.row[None, :])[0]
    H = np.zeros((rows, filter_.model.physical_size))
    H[:, 3 : 3 + rows] = np.eye(rows)
    return Observation(
        "velocity", level[V_L : V_L + rows], H, standing.velocity[:rows] ** 2, _labels("m/s")[:rows]
    )


def rate_observation(
    filter_: ErrorFilter, segment: Segment, home: NavState, standing: Standing
) -> Observation:
    """The rotation measured by the gyros minus that of the Earth: (16).

    As printed it is an integral of rates rotated into fixed axes. For a body that rocks about two
    axes at once such an integral grows by the area of the cone although the body does not turn:
    66 deg/h for 1 deg at 0.3 Hz. So the rotations are composed to attitudes, and the observation
    is the change of the rotation vector from the attitude of rest between epochs; it does not
    accumulate, because the next epoch subtracts it again.

    The design refers to the errors at the start of the segment and contains the Earth's rotation
    alone: the body's own rotation is noise, and with the measured rotation in it the rocking of
    one axis would be separated from another's as if an attitude error had mixed them. The noise
    of the gyros, which is in the attitude, too, is not in R.
    """
    model = filter_.model
    levels = segment.mechanization.levels(segment.history)
    rows = segment.increments
    matrices = rotation.dcm_from_quaternion(levels[:-1, Q_LB : Q_LB + 4])
    length = float(rows[:, 0].sum())
    earth = filter_.earth[RATE] * levels[:, AXIS : AXIS + 3].mean(axis=0)
    gyro = model.stacked.gyro
    weights = np.concatenate([[1.0], rows[:, 1:7].sum(axis=0) / length])
    H = np.zeros((3, model.physical_size))
    H[:, 6:9] = -rotation.cross_matrix(earth * length)
    mean = np.einsum("k,kij->ij", rows[:, 0], matrices)
    H[:, PHYSICAL:] = mean @ np.einsum("m,mij->ij", weights, gyro)
    return Observation(
        "rate",
        turns_between(filter_.mechanization, segment, home, len(rows))[0],
        H,
        standing.turn**2,
        _labels("rad"),
    )


def turns_between(used: Mechanization, segment: Segment, home: NavState, every: int) -> Array:
    """Changes of the rotation vector from the attitude of rest, from epoch to epoch.

    `every`: steps from epoch to epoch. Returns (k // every, 3), rad: in level axes.
    """
    history = segment.history[::every]
    levels = used.levels(history)
    rest = rotation.quaternion_from_dcm(
        used.level_from_ned(history[0]) @ rotation.dcm_from_quaternion(home.q_nb)
    )
    away = rotation.rotation_vector_from_quaternion(
        rotation.compose(levels[:, Q_LB : Q_LB + 4], rotation.conjugate(rest))
    )
    # The level rotates with the computed velocity, too.
    turned = used.levels(segment.history[:-1])[:, OMEGA_EL : OMEGA_EL + 3]
    turned = _stretches(turned * segment.increments[:, :1], every).sum(axis=1)
    return np.asarray(np.diff(away, axis=0)[: len(turned)] + turned)


def attitude_of_rest(segment: Segment) -> Array:
    """Mean attitude of a run, body to north-east-down, (4,)."""
    used = segment.mechanization
    q = used.levels(segment.history)[:, Q_LB : Q_LB + 4]
    # The sign of a quaternion is arbitrary.
    mean = (q * np.sign(q @ q[0])[:, None]).mean(axis=0)
    mean /= np.sqrt(mean @ mean)
    level = used.level_from_ned(segment.history[0])
    return rotation.quaternion_from_dcm(level.T @ rotation.dcm_from_quaternion(mean))


def without_steady_turn(rows: Array, earth: Array) -> Array:
    """Motion increments minus the mean rate, if that keeps the body's attitude constant.

    Without observations, gyros with a bias of degrees a minute turn the computed attitude over. For
    a coning body the mean rate is not a bias: its unchanged rates return to its attitude.

    `rows` ((k, 10)). `earth` ((3,), rad/s): rate of the Earth in body axes. Returns (k, 10).
    """
    length = float(rows[:, 0].sum())
    excess = rows[:, 1:4].sum(axis=0) / length - earth
    steady = rows.copy()
    steady[:, 1:4] -= excess * rows[:, :1]
    whole_turn = float(np.sqrt(excess @ excess)) * length > 2.0 * math.pi
    return steady if whole_turn or 2.0 * _turned(steady) < _turned(rows) else rows


def _turned(rows: Array) -> float:
    """Angle between the attitudes before and after, rad."""
    from strapdown._kernels.sums import inertial_sums

    n = len(rows)
    turned = np.empty((n + 1, 4))
    sums = np.zeros((1, 3, 3)), np.zeros((1, 3, 3, 3)), np.zeros((1, 3, 3, 3))
    inertial_sums(rows, np.array([n - 1]), turned, np.empty((n + 1, 3)), np.empty((1, 3)), *sums)
    away = rotation.rotation_vector_from_quaternion(turned[-1])
    return float(np.sqrt(away @ away))


def measured_standing(
    segment: Segment, home: NavState, every: int, least: Standing, gyro_noise: Triad
) -> Standing:
    """Estimate the residual motion of a stationary body from a run without observations.

    A filter takes the motion as independent from epoch to epoch. Slow sway or settling is not: so
    the motion is evaluated over stretches of 1, 2, 4 ... epochs, and the result is the independent
    motion that is equivalent at the stretch where it is largest. The drift of the run itself is
    smooth, and removed by differences: the third for velocity, the fourth for the position.

    `segment`: of the whole record. `home`: the position of alignment and the attitude of rest.
    `every`: steps from epoch to epoch. `least`: lower bounds of the result. `gyro_noise` (rad/√s):
    it rotates the level, too, and is not motion of the body: where no significant rotation is
    found, a fraction of this noise is assumed.
    """
    used = segment.mechanization
    levels = used.levels(segment.history)
    velocity = levels[::every, V_L : V_L + 3]
    place = np.cumsum(velocity, axis=0) * float(segment.increments[:every, 0].sum())
    turns = turns_between(used, segment, home, every)
    found = _as_independent(turns, 1) ** 2
    noise = max(gyro_noise) ** 2 * float(segment.increments[:every, 0].sum())
    # With a rotation of exactly zero the attitude would count as known beyond the second order of
    # its errors.
    turn = np.sqrt(np.where(found > BY_CHANCE * noise, found - noise, LEAST_TURN**2 * noise))
    return Standing(
        position=np.maximum(_as_independent(place, 4), least.position),
        velocity=np.maximum(_as_independent(velocity, 3), least.velocity),
        turn=np.maximum(turn, least.turn),
    )


def _as_independent(values: Array, order: int) -> Array:
    """Standard deviation of independent epochs with the same variance of stretch means, (3,)."""
    # For a difference of independent numbers: the sum of the squares of its binomials.
    gain = math.sqrt(math.comb(2 * order, order))
    found = np.zeros(3)
    length = 1
    while len(values) // length >= order + LEAST_STRETCHES:
        means = _stretches(values, length).mean(axis=1)
        apart = np.diff(means, n=order, axis=0)
        spread = np.sqrt(np.square(apart).mean(axis=0)) / gain
        found = np.maximum(found, spread * math.sqrt(length))
        length *= 2
    return found


def velocity_of_noise(gyro: Triad, accel: Triad, interval: float, epochs: int) -> float:
    """Velocity that `measured_standing` finds for a stationary body, by the noise of sensors.

    `gyro`, `accel` (rad/√s and m/s/√s). `interval` (s): from epoch to epoch. `epochs`: number of
    epochs. Returns m/s: of a horizontal axis, with the largest noise of the three.
    """
    order, length, most = 3, 1, 0.0
    signs = [(-1) ** k * math.comb(order, k) for k in range(order + 1)]
    while epochs // length >= order + LEAST_STRETCHES:
        # Effect of an impulse at each epoch on the difference: on velocity, and through tilt.
        weights = np.repeat(signs, length) / length
        velocity = np.cumsum(weights[::-1])[::-1]
        tilt = np.cumsum(velocity[::-1])[::-1] * interval * STANDARD_GRAVITY
        density = max(accel) ** 2 * velocity @ velocity + max(gyro) ** 2 * tilt @ tilt
        spread = density * interval / math.comb(2 * order, order) * length
        most = max(most, math.sqrt(spread))
        length *= 2
    return most


def _stretches(values: Array, length: int) -> Array:
    """Cut into stretches, (m, length, 3); the incomplete stretch at the end is left out."""
    count = len(values) // length
    return values[: count * length].reshape(count, length, values.shape[1])


def home_of(site: Site, time: float) -> NavState:
    """The position of alignment as a state."""
    return NavState.from_degrees(site.lat_deg, site.lon_deg, site.alt, time=time)


def _labels(unit: str) -> tuple[str, ...]:
    return tuple(f"{axis}, {unit}" for axis in AXES)
