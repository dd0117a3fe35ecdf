"""Iterated least squares of an entry state from believed fixes."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.crash.entry_adjust import Adjustment, Problem, Rows, adjust, weigh
from strapdown.crash.entry_priors import EntryPriors, FixCorrelation
from strapdown.crash.entry_sensitivity import (
    Course,
    at_fixes,
    between,
    noise_at_fixes,
    sensor_errors,
    skew,
)
from strapdown.crash.entry_state import ACCEL_BIAS, GYRO_BIAS, STATES, biases_off, rotated
from strapdown.ellipsoids import find_ellipsoid
from strapdown.evaluation.trajectory_at import trajectory_at
from strapdown.exceptions import DivergenceError
from strapdown.frames import geodetic_from_ned, place_difference
from strapdown.increments import motion_increments
from strapdown.mechanization import NavigationRun, NorthEastDown, run_mechanization
from strapdown.nav_state import NavState
from strapdown.sensors.antenna import antenna_motion
from strapdown.tables import ACCEL, EULER, GEODETIC, GYRO, VELOCITY
from strapdown.tables.checks import values_of

Array = NDArray[np.float64]

MOST_ITERATIONS = 30
# Steps below this share of a standard deviation change nothing.
CONVERGED = 1e-3
# And for data without noise, m, m/s, rad.
_TINY = 1e-10
# Of a heading of which nothing is known: a uniform one over the circle.
ANY_HEADING = 180.0 / math.sqrt(3.0)  # deg
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
class Guess:
    """A state at the anchor to begin with."""

    state: NavState


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
    slip_fixes: int | None
    cost: float


def estimate(
    mechanization: NorthEastDown,
    imu: pd.DataFrame,
    fixes: Fixes,
    guess: Guess,
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
    guess : Guess
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
    weights, settled = np.ones(len(search.blocks)), 0
    misfits = np.zeros(len(weights))
    for iteration in range(1, MOST_ITERATIONS + 1):
        problem = search.problem()
        # Outliers are told where the rest is nearly linear; weights that go on changing are
        # those of fixes at the brink, and are kept as they are after a while.
        if search.near and settled < 4:
            found, misfits = weigh(problem)
            settled = 4 if np.abs(found - weights).max(initial=0.0) < 0.01 else settled + 1
            weights = found
        step = adjust(problem, weights)
        if search.take(step) and settled >= 4:
            return search.result(weights, misfits, iteration)
    raise DivergenceError(
        f"the search for the entry state has not come to rest in {MOST_ITERATIONS} iterations",
        file=imu.attrs.get("source"),
        quantity="entry state",
        remedy="look at the fixes (EntryState.fixes of a shorter window), the axes of the Imu table "
        "(-9.8 on z at level rest), and whether both tables have the same clock",
    )


class _Search:
    """The parameters as they are, and what follows from them."""

    def __init__(
        self,
        mechanization: NorthEastDown,
        imu: pd.DataFrame,
        fixes: Fixes,
        guess: Guess,
        priors: EntryPriors,
        arm: Array,
    ) -> None:
        self.mechanization, self.imu, self.fixes = mechanization, imu, fixes
        self.priors, self.arm = priors, arm
        self.ellipsoid = find_ellipsoid(mechanization.ellipsoid)
        self.state, self.at_first = guess.state, guess.state.q_nb
        self.bias = np.zeros(6)
        self.measured = np.isfinite(fixes.sd)
        self.blocks, self.block_of = _blocks(self.measured)
        self.near = False
        self._fresh = True

    def problem(self) -> Problem:
        """Rows and priors at the parameters as they are."""
        course, now = self._run()
        if self._fresh:
            self._linearise(course, now)
        residuals = self._residuals(now)
        if self.slip is not None:
            residuals = np.append(residuals, -_slips(now, self.priors)[self.slip].mean())
        residuals -= self.jacobian[:, STATES:] @ self.further
        away = rotation.rotation_vector_from_quaternion(
            rotation.compose(self.at_first, rotation.conjugate(self.state.q_nb))
        )
        before = np.concatenate([np.zeros(6), away, -self.bias, -self.further])
        return Problem(residuals, self.jacobian, self.noise, self.prior_sd, before, self.blocks)

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
        self.last = adjustment
        sd = np.sqrt(np.diag(adjustment.covariance))
        # Away from the solution the sensitivities are made anew.
        self._fresh = turn > 1e-3
        self.near = turn < 0.05
        return bool((np.abs(step) <= np.maximum(CONVERGED * sd, _TINY)).all())

    def result(self, weights: Array, misfits: Array, iterations: int) -> Estimate:
        """Return what was found; biases at the mean rate and force."""
        self._fresh = True
        problem = self.problem()
        last, plain = adjust(problem, weights), adjust(problem, np.ones(len(weights)))
        to = np.eye(STATES, len(self.prior_sd))
        q = len(self.errors.sd)
        to[GYRO_BIAS, STATES : STATES + q] = self.errors.gyro.mean(axis=0)
        to[ACCEL_BIAS, STATES : STATES + q] = self.errors.accel.mean(axis=0)
        bias = self.bias + to[9:15, STATES:] @ self.further
        means = values_of(self.imu, [*GYRO, *ACCEL]).mean(axis=0) - bias
        shown = np.ones((len(self.measured), 2)), np.full((len(self.measured), 2), np.nan)
        for b, (fix, group) in enumerate(self.block_of):
            shown[0][fix, group], shown[1][fix, group] = weights[b], misfits[b]
        return Estimate(
            state=self.state,
            gyro_bias=bias[:3],
            accel_bias=bias[3:],
            covariance=to @ last.covariance @ to.T,
            mean_rate=means[:3],
            mean_force=means[3:],
            weights=shown[0],
            misfits=shown[1],
            chi_square=last.chi_square,
            degrees_of_freedom=len(problem.residuals) - int(np.isinf(self.prior_sd).sum()),
            iterations=iterations,
            slip_fixes=None if self.slip is None else int(self.slip.sum()),
            cost=plain.chi_square,
        )

    def _run(self) -> tuple[Course, _AtFixes]:
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
        return course, _at_fixes(run, course, self.fixes.instants)

    def _residuals(self, now: _AtFixes) -> Array:
        place, velocity = antenna_motion(
            now.place, now.velocity, now.q_nb, now.rate, self.arm, ellipsoid=self.ellipsoid
        )
        off = np.hstack(
            [
                place_difference(self.fixes.place, place, ellipsoid=self.ellipsoid),
                self.fixes.velocity - velocity,
            ]
        )
        return np.asarray(off[self.measured])

    def _linearise(self, course: Course, now: _AtFixes) -> None:
        """Sensitivities, noise and priors at the parameters as they are."""
        p, fixes = self.priors, self.fixes
        self.errors = sensor_errors(p.gyro, p.accel, course)
        q, m = len(self.errors.sd), len(fixes.instants)
        grown = at_fixes(course, self.errors, fixes.instants)
        noise = noise_at_fixes(course, p.gyro, p.accel, fixes.instants)
        C_nb = rotation.dcm_from_quaternion(now.q_nb)
        look = np.zeros((m, 6, 9))
        look[:, :3, :3] = look[:, 3:, 3:6] = np.eye(3)
        look[:, :3, 6:] = -skew(C_nb @ self.arm)
        turning = np.cross(now.rate, self.arm)
        look[:, 3:, 6:] = -skew(np.einsum("mij,mj->mi", C_nb, turning))
        own = np.zeros((m, 6, STATES + q + 4))
        own[:, :, : STATES + q] = look @ grown
        own[:, 3:, 9:12] += C_nb @ skew(self.arm)
        own[:, :3, STATES + q : -1] = C_nb
        own[:, 3:, STATES + q : -1] = C_nb @ skew(now.rate)
        own[:, :3, -1] = -now.velocity
        own[:, 3:, -1] = -now.acceleration
        rows, shaken = own[self.measured], (look @ noise)[self.measured]
        white = np.zeros(len(rows))
        # The gyro sample beside a fix moves the antenna, too.
        swing = (max(p.gyro.axis("noise_density")) * float(np.linalg.norm(self.arm))) ** 2
        sample = swing / float(np.median(np.diff(course.time)))
        white += np.broadcast_to([0.0] * 3 + [sample] * 3, (m, 6))[self.measured]
        self.slip = self._slip(now)
        if self.slip is not None:
            seen = _slip_look(now, C_nb, p)[self.slip]
            row = np.zeros(rows.shape[1])
            row[: STATES + q] = np.einsum("mi,mik->mk", seen, grown[self.slip]).mean(axis=0)
            rows = np.vstack([rows, row])
            shaken = np.vstack(
                [shaken, np.einsum("mi,mik->mk", seen, noise[self.slip]).mean(axis=0)]
            )
            white = np.append(white, math.radians(p.side_slip_sd_deg or 0.0) ** 2)
        self.jacobian = rows
        self.noise = shaken @ shaken.T + np.diag(white)
        count = int(self.measured.sum())
        self.noise[:count, :count] += fix_noise(fixes, p)
        self.prior_sd = np.concatenate(
            [
                np.full(6, np.inf),
                np.radians([p.tilt_sd_deg, p.tilt_sd_deg, p.heading_sd_deg or ANY_HEADING]),
                p.gyro.axis("bias"),
                p.accel.axis("bias"),
                self.errors.sd,
                [p.antenna_sd] * 3,
                [p.time_offset_sd],
            ]
        )
        if not hasattr(self, "further"):
            self.further = np.zeros(q + 4)

    def _slip(self, now: _AtFixes) -> NDArray[np.bool_] | None:
        if self.priors.side_slip_sd_deg is None:
            return None
        speed = np.linalg.norm(now.velocity, axis=1)
        steady = (speed > LEAST_SLIP_SPEED) & (np.abs(speed * now.rate[:, 2]) < MOST_LATERAL)
        return steady if steady.any() else None


@dataclass(frozen=True, eq=False)
class _AtFixes:
    """The vehicle's point at the instants of the fixes."""

    place: Array
    velocity: Array
    acceleration: Array
    q_nb: Array
    rate: Array


def _at_fixes(run: NavigationRun, course: Course, instants: Array) -> _AtFixes:
    """Between two samples: place by Hermite's cubic, velocity and attitude by their rates."""
    there = trajectory_at(run.trajectory, instants, find_ellipsoid(run.mechanization.ellipsoid))
    pushed = np.gradient(run.history[:, 3:6], run.time, axis=0)
    return _AtFixes(
        there[GEODETIC].to_numpy(dtype=np.float64),
        there[VELOCITY].to_numpy(dtype=np.float64),
        between(run.time, pushed, instants),
        rotation.quaternion_from_euler(there[EULER].to_numpy(dtype=np.float64)),
        between(course.time, course.rate, instants),
    )


def _slips(now: _AtFixes, priors: EntryPriors) -> Array:
    """Side-slip angle at the point that does not slip, (m,), rad."""
    v = _point_velocity(now, priors)
    return np.asarray(np.arctan2(v[:, 1], v[:, 0]))


def _point_velocity(now: _AtFixes, priors: EntryPriors) -> Array:
    own = rotation.rotate(rotation.conjugate(now.q_nb), now.velocity)
    return np.asarray(own + np.cross(now.rate, np.asarray(priors.no_slip_point)))


def _slip_look(now: _AtFixes, C_nb: Array, priors: EntryPriors) -> Array:
    """Derivative of the side-slip angle by position, velocity and attitude, (m, 9)."""
    v = _point_velocity(now, priors)
    by_v = np.zeros((len(v), 1, 3))
    by_v[:, 0, 0], by_v[:, 0, 1] = -v[:, 1], v[:, 0]
    by_v /= (v[:, 0] ** 2 + v[:, 1] ** 2)[:, None, None]
    back = by_v @ C_nb.transpose(0, 2, 1)
    out = np.zeros((len(v), 9))
    out[:, 3:6] = back[:, 0]
    out[:, 6:9] = (back @ skew(now.velocity))[:, 0]
    return out


def fix_noise(fixes: Fixes, priors: EntryPriors) -> Array:
    """Covariance of what was measured, row by row of ``sd``, infinite ones left out."""
    m = len(fixes.instants)
    apart = np.abs(np.subtract.outer(fixes.instants, fixes.instants))
    full = np.zeros((m, 6, m, 6))
    sd = np.where(np.isfinite(fixes.sd), fixes.sd, 0.0)
    for axis in range(6):
        spec: FixCorrelation = (
            priors.position_correlation if axis < 3 else priors.velocity_correlation
        )
        shape = spec.share * np.exp(-apart / spec.time) + (1.0 - spec.share) * np.eye(m)
        full[:, axis, :, axis] = np.outer(sd[:, axis], sd[:, axis]) * shape
    kept = np.isfinite(fixes.sd).ravel()
    return np.asarray(full.reshape(6 * m, 6 * m)[np.ix_(kept, kept)])


def _blocks(measured: NDArray[np.bool_]) -> tuple[list[Rows], list[tuple[int, int]]]:
    """Rows of place and of velocity of each fix, and which they are."""
    number = np.full(measured.shape, -1, dtype=np.intp)
    number[measured] = np.arange(int(measured.sum()))
    blocks, which = [], []
    for fix in range(len(measured)):
        for group in (0, 1):
            rows = number[fix, 3 * group : 3 * group + 3]
            rows = rows[rows >= 0]
            if rows.size:
                blocks.append(rows)
                which.append((fix, group))
    return blocks, which
