"""What is known of a body that stands still, as observations of a filter.

Chernodarov (2009), Eqs. (16)-(18): the rate of the Earth, the place, no velocity.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from strapdown import rotation
from strapdown._kernels.earth import RATE
from strapdown._kernels.level import AXIS, OMEGA_EL, Q_LB, V_L
from strapdown.alignment.alignment import Site
from strapdown.constants import STANDARD_GRAVITY
from strapdown.ellipsoids import find_ellipsoid
from strapdown.estimation.covariance import Observation
from strapdown.estimation.error_filter import ErrorFilter, FilterState
from strapdown.estimation.error_model import PHYSICAL, Segment
from strapdown.mechanization.mechanization import Mechanization
from strapdown.mechanization.state_error import displacement_between
from strapdown.nav_state import NavState
from strapdown.sensors.triad_errors import Triad

Array = NDArray[np.float64]

AXES = ("x", "y", "z")
#: What a rest tells: the Earth's rate, the place, no velocity.
OBSERVATIONS = ("rate", "position", "velocity")
# Fewer say little of how much they vary.
LEAST_STRETCHES = 8
# The largest of several variances of as few numbers, over the one that is expected: of eight
# chi-square with 8 degrees of freedom one in a thousand is beyond 3.9.
BY_CHANCE = 4.0
# What a body is taken to turn by where nothing is found, as a part of the noise of its gyros.
LEAST_TURN = 0.3


@dataclass(frozen=True, eq=False)
class Standing:
    """How still a body stands, as standard deviations in level axes.

    Attributes
    ----------
    position : ndarray, (3,), m
        Of the place at an epoch about its mean.
    velocity : ndarray, (3,), m/s
    turn : ndarray, (3,), rad
        Of the turn relative to the Earth from one epoch to the next.
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
    """Make the observations of the end of an epoch: (17) and (18).

    Parameters
    ----------
    filter_ : ErrorFilter
    state : FilterState
        At the end of the epoch.
    home : NavState
        The place of alignment.
    standing : Standing
    names : sequence of str
        Of `OBSERVATIONS`.

    Returns
    -------
    list of Observation
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
    """The computed place less that of alignment: (17), as a displacement in level axes.

    In height, too, where the mechanization's is free.
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
        "velocity",
        level[V_L : V_L + rows],
        H,
        standing.velocity[:rows] ** 2,
        _labels("m/s")[:rows],
    )


def rate_observation(
    filter_: ErrorFilter, segment: Segment, home: NavState, standing: Standing
) -> Observation:
    """The turn that the gyros have measured less that of the Earth: (16).

    As printed it is an integral of rates turned into axes that stand still. Of a body that rocks
    about two axes at once such an integral grows by the area of the cone, while the body stays
    where it is: 1 deg at 0.3 Hz make 66 deg/h. So the turns are composed to attitudes, and what
    counts is how the rotation vector from the attitude of rest changes: from epoch to epoch, and
    nothing is left over, because of the next epoch it is taken off again.

    Of the errors at the start of the segment. They count by the turn of the Earth alone: what the
    body turns by is noise, and by the measured turn one axis' rocking would be told from another's
    as if an error of the attitude had mixed them. The noise of the gyros, which is in the attitude
    too, is not in R.
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

    Parameters
    ----------
    used : Mechanization
    segment : Segment
    home : NavState
    every : int
        Steps from epoch to epoch.

    Returns
    -------
    ndarray, (k // every, 3), rad
        In level axes.
    """
    history = segment.history[::every]
    levels = used.levels(history)
    rest = rotation.quaternion_from_dcm(
        used.level_from_ned(history[0]) @ rotation.dcm_from_quaternion(home.q_nb)
    )
    away = rotation.rotation_vector_from_quaternion(
        rotation.compose(levels[:, Q_LB : Q_LB + 4], rotation.conjugate(rest))
    )
    # The level turns, too, with the velocity that is computed.
    turned = used.levels(segment.history[:-1])[:, OMEGA_EL : OMEGA_EL + 3]
    turned = _stretches(turned * segment.increments[:, :1], every).sum(axis=1)
    return np.asarray(np.diff(away, axis=0)[: len(turned)] + turned)


def attitude_of_rest(segment: Segment) -> Array:
    """Mean attitude of a run, body to north-east-down, (4,)."""
    used = segment.mechanization
    q = used.levels(segment.history)[:, Q_LB : Q_LB + 4]
    # The sign of a quaternion is not its own.
    mean = (q * np.sign(q @ q[0])[:, None]).mean(axis=0)
    mean /= np.sqrt(mean @ mean)
    level = used.level_from_ned(segment.history[0])
    return rotation.quaternion_from_dcm(level.T @ rotation.dcm_from_quaternion(mean))


def without_steady_turn(rows: Array, earth: Array) -> Array:
    """Motion increments less the mean rate, where that makes the body stay as it stands.

    A run without observations over gyros with a bias of degrees a minute turns over. Of a body that
    cones the mean rate is no bias: by its rates as they are it comes back to its attitude.

    Parameters
    ----------
    rows : ndarray, (k, 10)
    earth : ndarray, (3,), rad/s
        Rate of the Earth in body axes.

    Returns
    -------
    ndarray, (k, 10)
    """
    length = float(rows[:, 0].sum())
    excess = rows[:, 1:4].sum(axis=0) / length - earth
    steady = rows.copy()
    steady[:, 1:4] -= excess * rows[:, :1]
    whole_turn = float(np.sqrt(excess @ excess)) * length > 2.0 * math.pi
    return steady if whole_turn or 2.0 * _turned(steady) < _turned(rows) else rows


def _turned(rows: Array) -> float:
    """Angle between the attitudes before and after, rad."""
    from strapdown._kernels.inertial_sums import inertial_sums

    n = len(rows)
    turned = np.empty((n + 1, 4))
    sums = np.zeros((1, 3, 3)), np.zeros((1, 3, 3, 3)), np.zeros((1, 3, 3, 3))
    inertial_sums(rows, np.array([n - 1]), turned, np.empty((n + 1, 3)), np.empty((1, 3)), *sums)
    away = rotation.rotation_vector_from_quaternion(turned[-1])
    return float(np.sqrt(away @ away))


def measured_standing(
    segment: Segment, home: NavState, every: int, least: Standing, gyro_noise: Triad
) -> Standing:
    """Find from a run without observations how still a body stands.

    A filter takes what moves the body as independent from epoch to epoch. What sways slowly, or
    settles, is not: so the motion is looked at over stretches of 1, 2, 4 ... epochs, and that
    counts which independent motion would have to be for the stretch where it is largest. The drift
    of the run itself is smooth, and left out by differences: the third for velocity, the fourth
    for the place.

    Parameters
    ----------
    segment : Segment
        Of the whole record.
    home : NavState
        The place of alignment and the attitude of rest.
    every : int
        Steps from epoch to epoch.
    least : Standing
        No body is taken to stand more still than this.
    gyro_noise : triad, rad/√s
        It turns the level, too, and is not the body's motion: where no more is found than chance
        makes of it, the body is taken to turn by a part of it.

    Returns
    -------
    Standing
    """
    used = segment.mechanization
    levels = used.levels(segment.history)
    velocity = levels[::every, V_L : V_L + 3]
    place = np.cumsum(velocity, axis=0) * float(segment.increments[:every, 0].sum())
    turns = turns_between(used, segment, home, every)
    found = _as_independent(turns, 1) ** 2
    noise = max(gyro_noise) ** 2 * float(segment.increments[:every, 0].sum())
    # By a turn of exactly nothing the attitude would count as known to what the second order of its
    # errors belies.
    turn = np.sqrt(np.where(found > BY_CHANCE * noise, found - noise, LEAST_TURN**2 * noise))
    return Standing(
        position=np.maximum(_as_independent(place, 4), least.position),
        velocity=np.maximum(_as_independent(velocity, 3), least.velocity),
        turn=np.maximum(turn, least.turn),
    )


def _as_independent(values: Array, order: int) -> Array:
    """Deviation of independent epochs whose means over stretches would vary as much, (3,)."""
    # Of a difference of independent numbers: the sum of the squares of its binomials.
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
    """Velocity that `measured_standing` finds where a body stands still, by the noise of sensors.

    Parameters
    ----------
    gyro, accel : triad, rad/√s and m/s/√s
    interval : float, s
        From epoch to epoch.
    epochs : int
        How many there are.

    Returns
    -------
    float, m/s
        Of a horizontal axis, with the largest noise of the three.
    """
    order, length, most = 3, 1, 0.0
    signs = [(-1) ** k * math.comb(order, k) for k in range(order + 1)]
    while epochs // length >= order + LEAST_STRETCHES:
        # What an impulse at each epoch does to the difference: on velocity, and through tilt.
        weights = np.repeat(signs, length) / length
        velocity = np.cumsum(weights[::-1])[::-1]
        tilt = np.cumsum(velocity[::-1])[::-1] * interval * STANDARD_GRAVITY
        density = max(accel) ** 2 * velocity @ velocity + max(gyro) ** 2 * tilt @ tilt
        spread = density * interval / math.comb(2 * order, order) * length
        most = max(most, math.sqrt(spread))
        length *= 2
    return most


def _stretches(values: Array, length: int) -> Array:
    """Cut into stretches, (m, length, 3); what is left over at the end is left out."""
    count = len(values) // length
    return values[: count * length].reshape(count, length, values.shape[1])


def home_of(site: Site, time: float) -> NavState:
    """The place of alignment as a state."""
    return NavState.from_degrees(site.lat_deg, site.lon_deg, site.alt, time=time)


def _labels(unit: str) -> tuple[str, ...]:
    return tuple(f"{axis}, {unit}" for axis in AXES)
