"""Iterated least squares of an entry state from believed fixes."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.crash.entry_adjust import Adjustment, Problem, adjust, weigh
from strapdown.crash.entry_at_fixes import AtFixes, by_state, side_slips, state_at_fixes
from strapdown.crash.entry_priors import EntryPriors
from strapdown.crash.entry_sensitivity import (
    Course,
    at_fixes,
    noise_between_fixes,
    sensor_errors,
)
from strapdown.crash.entry_state import ACCEL_BIAS, GYRO_BIAS, STATES, biases_off, rotated
from strapdown.ellipsoids import find_ellipsoid
from strapdown.errors import DivergenceError
from strapdown.frames import geodetic_from_ned, place_difference
from strapdown.increments import motion_increments
from strapdown.mechanization import NorthEastDown, run_mechanization
from strapdown.nav_state import NavState
from strapdown.sensors.antenna import antenna_motion
from strapdown.tables import ACCEL, GYRO
from strapdown.tables.checks import values_of

Array = NDArray[np.float64]

MOST_ITERATIONS = 30
# Steps below this share of a standard deviation change nothing.
CONVERGED = 1e-3
# And for data without noise, m, m/s, rad.
_TINY = 1e-10
# Of a heading of which nothing is known: a uniform one over the circle.
ANY_HEADING = 180.0 / math.sqrt(3.0)  # deg
# Sensitivities are made anew when the attitude has turned by this since, rad: they are wrong by
# that share.
STALE = 0.01
# Of weights.
MOST_WEIGHINGS, SAME_WEIGHT = 15, 0.01
# What is not known before, in standard deviations of the fixes: no more than rounding bears, and
# about the parameters as they are, so that it draws them nowhere.
UNKNOWN = 1e3
# Where the side slip is looked at.
LEAST_SLIP_SPEED, MOST_LATERAL = 3.0, 2.0  # m/s, m/s²
# A longer step of attitude is cut, rad: beyond, the linear model says nothing.
LONGEST_TURN = 0.5


@dataclass(frozen=True, eq=False)
class Fixes:
    """Fixes that are believed.

    Attributes
    ----------
    instants : ndarray, (m,), s
    place : ndarray, (m, 3), deg, deg, m
    velocity : ndarray, (m, 3), m/s
    sd : ndarray, (m, 6), m, m/s
    """

    instants: Array
    place: Array
    velocity: Array
    sd: Array


@dataclass(frozen=True, eq=False)
class Estimate:
    """What came of a guess; attributes as of `EntryState`, weights and misfits (m, 2)."""

    state: NavState
    gyro_bias: Array
    accel_bias: Array
    covariance: Array
    mean_rate: Array
    mean_force: Array
    weights: Array
    misfits: Array
    chi_square: float
    degrees_of_freedom: int
    iterations: int
    slip_fixes: int
    cost: float


def estimate(
    mechanization: NorthEastDown,
    imu: pd.DataFrame,
    fixes: Fixes,
    guess: NavState,
    priors: EntryPriors,
    arm: Array,
) -> Estimate:
    """Search the state at the end of a record, and what else is unknown, from a guess.

    Parameters
    ----------
    mechanization : NorthEastDown
    imu : DataFrame
        Up to the anchor.
    fixes : Fixes
        Within the record.
    guess : NavState
        At the anchor.
    priors : EntryPriors
    arm : ndarray, (3,), m
        Of the antenna.

    Returns
    -------
    Estimate

    Raises
    ------
    DivergenceError
        The search does not come to rest, or a run diverges.
    """
    search = _Search(mechanization, imu, fixes, guess, priors, arm)
    weights, settled = np.ones((len(fixes.instants), 2)), 0
    for iteration in range(1, MOST_ITERATIONS + 1):
        problem = search.problem()
        step = adjust(problem, weights)
        # Far from the solution weights only keep gross errors out; those at the brink of another
        # are kept as they are after a while.
        changed = not search.near
        if not search.near or settled < MOST_WEIGHINGS:
            found, _ = weigh(problem, step, weights)
            changed |= bool(np.abs(found - weights).max() > SAME_WEIGHT)
            settled += search.near
            if (found != weights).any():
                weights = found
                step = adjust(problem, weights)
        if search.take(step) and not changed:
            return search.result(weights, iteration)
    raise DivergenceError(
        "crash.search-entry-state-not-come",
        file=imu.attrs.get("source"),
        quantity="entry state",
        most_iterations=MOST_ITERATIONS,
    )


class _Search:
    """The parameters as they are, and what follows from them."""

    def __init__(
        self,
        mechanization: NorthEastDown,
        imu: pd.DataFrame,
        fixes: Fixes,
        guess: NavState,
        priors: EntryPriors,
        arm: Array,
    ) -> None:
        self.mechanization, self.imu = mechanization, imu
        # From the anchor backward, as the errors grow.
        self.fixes = Fixes(
            *(x[::-1] for x in (fixes.instants, fixes.place, fixes.velocity, fixes.sd))
        )
        self.priors, self.arm = priors, arm
        self.ellipsoid = find_ellipsoid(mechanization.ellipsoid)
        self.state, self.at_first = guess, guess.q_nb
        self.bias = np.zeros(6)
        self.near = False
        self.further = np.zeros(0)
        self._moved = math.inf

    def problem(self) -> Problem:
        """Rows and priors at the parameters as they are."""
        course, now = self._run()
        if self._moved > STALE:
            self._linearise(course, now)
            self._moved = 0.0
        residuals = np.hstack([self._residuals(now), -side_slips(now, self.priors)[:, None]])
        residuals -= self.linear.by_constants[:, :, STATES:] @ self.further
        away = rotation.rotation_vector_from_quaternion(
            rotation.compose(self.at_first, rotation.conjugate(self.state.q_nb))
        )
        before = np.concatenate([np.zeros(6), away, -self.bias, -self.further])
        return replace(self.linear, residuals=residuals, prior_residuals=before)

    def take(self, adjustment: Adjustment) -> bool:
        """Add a step; return whether it was too small to go on."""
        step = adjustment.step.copy()
        turn = float(np.linalg.norm(step[6:9]))
        if turn > LONGEST_TURN:
            step *= LONGEST_TURN / turn
        lat_deg, lon_deg = math.degrees(self.state.lat), math.degrees(self.state.lon)
        place = geodetic_from_ned(
            step[:3], [lat_deg, lon_deg, self.state.alt], ellipsoid=self.ellipsoid
        )
        self.state = NavState(
            time=self.state.time,
            lat=math.radians(place[0]),
            lon=math.radians(place[1]),
            alt=float(place[2]),
            v_n=self.state.v_n + step[3:6],
            q_nb=rotated(self.state.q_nb, step[6:9]),
        )
        self.bias = self.bias + step[9:15]
        self.further = self.further + step[STATES:]
        sd = np.sqrt(np.diag(adjustment.covariance))
        self._moved += turn
        self.near = turn < 0.05
        return bool((np.abs(step) <= np.maximum(CONVERGED * sd, _TINY)).all())

    def result(self, weights: Array, iterations: int) -> Estimate:
        """Return what was found; biases at the mean rate and force."""
        self._moved = math.inf
        problem = self.problem()
        last = adjust(problem, weights)
        _, misfits = weigh(problem, last, weights)
        plain = last if (weights == 1.0).all() else adjust(problem, np.ones(weights.shape))
        q = len(self.errors.sd)
        to = np.eye(STATES, len(problem.prior_sd))
        to[GYRO_BIAS, STATES : STATES + q] = self.errors.gyro.mean(axis=0)
        to[ACCEL_BIAS, STATES : STATES + q] = self.errors.accel.mean(axis=0)
        bias = self.bias + to[9:15, STATES:] @ self.further
        means = values_of(self.imu, [*GYRO, *ACCEL]).mean(axis=0) - bias
        return Estimate(
            state=self.state,
            gyro_bias=bias[:3],
            accel_bias=bias[3:],
            covariance=to @ last.covariance @ to.T,
            mean_rate=means[:3],
            mean_force=means[3:],
            weights=weights[::-1],
            misfits=misfits[::-1],
            chi_square=last.chi_square,
            degrees_of_freedom=int(problem.there.sum()) - 6,
            iterations=iterations,
            slip_fixes=int(problem.there[:, 6].sum()),
            cost=plain.chi_square,
        )

    def _run(self) -> tuple[Course, AtFixes]:
        imu = biases_off(self.imu, self.bias[:3], self.bias[3:])
        run = run_mechanization(
            self.mechanization, self.state, motion_increments(imu), backward=True
        )
        kept = slice(len(imu) - len(run.time), None)
        sensed = values_of(imu, [*GYRO, *ACCEL])[kept]
        course = Course(
            run.time,
            rotation.dcm_from_quaternion(run.history[:, 6:10]),
            sensed[:, :3],
            sensed[:, 3:],
        )
        # A mean is, on average, what was half a step before its stamp.
        late = 0.5 * float(np.median(np.diff(run.time))) * (imu.attrs["sampling"] == "mean")
        return course, state_at_fixes(run, course, self.fixes.instants, late)

    def _residuals(self, now: AtFixes) -> Array:
        place, velocity = antenna_motion(
            now.place, now.velocity, now.q_nb, now.rate, self.arm, ellipsoid=self.ellipsoid
        )
        return np.hstack(
            [
                place_difference(self.fixes.place, place, ellipsoid=self.ellipsoid),
                self.fixes.velocity - velocity,
            ]
        )

    def _linearise(self, course: Course, now: AtFixes) -> None:
        """Sensitivities, noise and priors at the parameters as they are."""
        p, fixes = self.priors, self.fixes
        self.errors = sensor_errors(p.gyro, p.accel, course)
        q, m = len(self.errors.sd), len(fixes.instants)
        C_nb = rotation.dcm_from_quaternion(now.q_nb)
        look = np.zeros((m, 7, 9))
        look[:, 0:3, 0:3] = look[:, 3:6, 3:6] = np.eye(3)
        look[:, 0:3, 6:] = -rotation.cross_matrix(C_nb @ self.arm)
        look[:, 3:6, 6:] = -rotation.cross_matrix(
            np.einsum("mij,mj->mi", C_nb, np.cross(now.rate, self.arm))
        )
        look[:, 6] = by_state(now, C_nb, p)
        # Of the antenna, of the clock, and the side slip that stays.
        own = np.zeros((m, 7, STATES + q + 5))
        own[:, :, : STATES + q] = look @ at_fixes(course, self.errors, fixes.instants)
        own[:, 3:6, GYRO_BIAS] += C_nb @ rotation.cross_matrix(self.arm)
        own[:, 0:3, STATES + q : -2] = C_nb
        own[:, 3:6, STATES + q : -2] = C_nb @ rotation.cross_matrix(now.rate)
        own[:, 0:3, -2], own[:, 3:6, -2] = -now.velocity, -now.acceleration
        own[:, 6, -1] = 1.0

        there = np.column_stack([np.isfinite(fixes.sd), self._slides(now)])
        slip_sd = math.radians(p.side_slip_sd_deg or 0.0)
        sd = np.column_stack([np.where(there[:, :6], fixes.sd, 0.0), np.full(m, slip_sd)])
        spec = (p.position_correlation,) * 3 + (p.velocity_correlation,) * 3
        share = np.array([c.share for c in spec])
        noise = sd**2
        noise[:, :6] *= 1.0 - share
        # The gyro sample beside a fix moves the antenna, too.
        swing = (max(p.gyro.axis("noise_density")) * float(np.linalg.norm(self.arm))) ** 2
        noise[:, 3:6] += swing / float(np.median(np.diff(course.time)))
        by_states = np.concatenate([look, np.zeros((m, 7, 6))], axis=2)
        for axis in range(6):
            by_states[:, axis, 9 + axis] = sd[:, axis] * math.sqrt(share[axis])

        grown, shaken = noise_between_fixes(course, p.gyro, p.accel, fixes.instants)
        carry, driven = np.zeros((2, m, 15, 15))
        carry[:, :9, :9], driven[:, :9, :9] = grown, shaken
        lasted = -np.diff(fixes.instants, prepend=course.time[-1])
        for axis in range(6):
            a = np.exp(-lasted / spec[axis].time)
            carry[:, 9 + axis, 9 + axis], driven[:, 9 + axis, 9 + axis] = a, 1.0 - a * a
        bounded = np.where(np.isfinite(fixes.sd), fixes.sd, 0.0).max(axis=0)
        loose = UNKNOWN * np.where(bounded > 0.0, bounded, np.tile(bounded[:3].max(), 6))
        prior_sd = np.concatenate(
            [
                loose,
                np.radians([p.tilt_sd_deg, p.tilt_sd_deg, p.heading_sd_deg or ANY_HEADING]),
                p.gyro.axis("bias"),
                p.accel.axis("bias"),
                self.errors.sd,
                [p.antenna_sd] * 3,
                [p.time_offset_sd, slip_sd],
            ]
        )
        self.further = self.further if self.further.size else np.zeros(q + 5)
        self.linear = Problem(
            np.zeros((m, 7)),
            own,
            by_states,
            noise,
            sd**2,
            there,
            np.array([0, 0, 0, 1, 1, 1, -1]),
            carry,
            driven,
            np.diag([0.0] * 9 + [1.0] * 6),
            prior_sd,
            np.zeros_like(prior_sd),
        )

    def _slides(self, now: AtFixes) -> NDArray[np.bool_]:
        """Where the vehicle travels along its axis."""
        speed = np.linalg.norm(now.velocity, axis=1)
        steady = (speed > LEAST_SLIP_SPEED) & (np.abs(speed * now.rate[:, 2]) < MOST_LATERAL)
        return np.asarray(steady & (self.priors.side_slip_sd_deg is not None))
