"""Attitude, velocity and biases at the end of a drive, by least squares over its fixes."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.alignment.course_fixes import Antenna, CourseFixes
from strapdown.alignment.course_rests import RestRate
from strapdown.alignment.course_unknowns import (
    ACCEL,
    ACCEL_MATRIX,
    ACCEL_NOISE,
    ASKED,
    AXLE,
    COUNT,
    GYRO,
    GYRO_BY_FORCE,
    GYRO_MATRIX,
    GYRO_NOISE,
    HANDED,
    OF_ACCELS,
    OF_GYROS,
    OF_SENSORS,
    OFFSET,
    TURN,
    VELOCITY,
    YAW,
)
from strapdown.alignment.drive_sums import DriveSums, drive_sums
from strapdown.alignment.site import Site
from strapdown.constants import MAD_TO_SD, STANDARD_GRAVITY
from strapdown.dsp.running_integral import running_integral
from strapdown.earth import transport_rate
from strapdown.estimation.influence import Influence
from strapdown.sensors.imu_uncertainty import ImuUncertainty

Array = NDArray[np.float64]

__all__ = ["CourseFit", "CourseModel", "Found"]

# Errors of velocity and attitude are estimate less truth, of sensors truth less estimate.
SIGN = np.where(OF_SENSORS.start > HANDED, 1.0, -1.0)
# Nothing is known of a velocity, m/s, or of an attitude, rad.
UNKNOWN = (100.0, 3.0)
# The scatter of the fixes is judged by so many velocities more than what is asked for takes.
LEAST_FREE = 12.0
# Weights and scale are found anew so many times with one linearization.
SWEEPS = 3
# A course that is off by more, rad, is that of a vehicle that backs.
GROSS = 0.8
# Courses nearer to one another, s, slip alike.
APART = 1.0
# No number is known better: a slip, rad, a mean rate, rad/s.
LEAST_SLIP, LEAST_RATE_SD = 1e-6, 1e-10


@dataclass(frozen=True)
class CourseModel:
    """What is known of a vehicle beside its fixes.

    Attributes
    ----------
    reverse : bool
        It drives backward.
    yaw : float, rad
        Heading of the unit's forward axis less the course.
    yaw_sd, slip_sd : float, rad
        What of it stays over a drive, and what changes from second to second.
    axle_sd : float, m
        How far the unit may be ahead of the axle that goes where it points, or behind it.
    antenna : Antenna
    """

    reverse: bool
    yaw: float
    yaw_sd: float
    slip_sd: float
    axle_sd: float
    antenna: Antenna


@dataclass(frozen=True, eq=False)
class Found:
    """Where the least squares stand.

    Attributes
    ----------
    C : ndarray, (3, 3)
        Attitude at the end of the record.
    velocity : ndarray, (3,), m/s
        At the end.
    errors : ndarray, rad/s, m/s² and relative
        Of the sensors, the columns `course_unknowns.OF_SENSORS`; reading less truth.
    covariance : ndarray, (39, 39)
        As `Alignment.joint`.
    fitted : ndarray, (k, 3), m/s
        Velocities at the fixes, north, east, down, near which courses are linear.
    weight : ndarray, (k,)
        Share of each fix that counts.
    scale : float
        By which the velocities of the fixes scatter more than they state; at least 1.
    onward : float
        Share of the courses that are those of a vehicle that drives as taken.
    """

    C: Array
    velocity: Array
    errors: Array
    covariance: Array
    fitted: Array
    weight: Array
    scale: float
    onward: float = 1.0

    @property
    def bias(self) -> Array:
        """Of gyros and accelerometers, (6,), rad/s and m/s²."""
        return self.errors[:6]

    @property
    def by_input(self) -> Array:
        """Errors in proportion to what is sensed, (27,), as `Alignment.by_input`."""
        return np.asarray(self.errors[HANDED[ASKED:] - OF_SENSORS.start])


@dataclass(frozen=True, eq=False)
class CourseFit:
    """Least squares over the fixes of a part of a record that reaches to its end.

    Attributes
    ----------
    imu : DataFrame
        Of that part.
    means : ndarray, (6,)
        Of rate and force, at which the biases are asked for.
    fixes : CourseFixes
        In that part, two at least.
    rests : tuple of RestRate
    site : Site
    sensors : ImuUncertainty
    model : CourseModel
    """

    imu: pd.DataFrame
    means: Array
    fixes: CourseFixes
    rests: tuple[RestRate, ...]
    site: Site
    sensors: ImuUncertainty
    model: CourseModel

    def step(self, found: Found, influence: Influence) -> Found:
        """Solve once, about what was found before, with weights by its residuals.

        Parameters
        ----------
        found : Found
            Its covariance does not count.
        influence : Influence
            Of the velocities of fixes, by the largest residual of the three.

        Returns
        -------
        Found
        """
        fixes, rests = self.fixes, self.rests
        time = np.concatenate([fixes.time, [rest.time for rest in rests]])
        sums = drive_sums(self.imu, time, self.means, found.errors)
        sd = self._prior(found, sums)
        rate = _level_rate(found.velocity, self.site)
        level = rotation.dcm_from_rotation_vector(rate * sums.until_end[:, None])
        C = level @ found.C @ sums.turned
        turns = np.zeros((len(time), 3, COUNT))
        turns[:, :, TURN] = np.eye(3)
        turns[:, :, OF_GYROS] = found.C @ sums.by_gyro
        there, by = self._velocities(found, sums, rate)
        k = len(fixes.time)
        arm = np.cross(sums.rate[:k], self.model.antenna.lever_arm)
        read = fixes.velocity - np.einsum("kij,kj->ki", C[:k], arm)
        gap = np.einsum("kji,kj->ki", level[:k], read) - there[:k]
        courses = self._courses(found, sums, C[:k], there[:k], level[:k], by[:k], turns[:k])
        told = np.isfinite(fixes.sd)
        _, pushed = self._within(sums)
        stated = np.sqrt(np.where(told, np.square(fixes.sd), 1.0) + pushed)
        weight, scale = found.weight, found.scale
        fixed = []
        fixed += [self._rest(rest, found, C[k + i], turns[k + i]) for i, rest in enumerate(rests)]
        onward = np.ones(len(courses[0]))
        for _ in range(SWEEPS):
            share = told * weight[:, None] / np.square(scale * stated)
            parts = [
                (gap.ravel(), by[:k].reshape(3 * k, -1), share.ravel()),
                (courses[0], courses[1], onward * courses[2]),
                *fixed,
            ]
            x, inverse, spent = _solve(parts, sd, found.errors)
            left = np.where(told, np.abs(gap - by[:k] @ x) / stated, 0.0)
            used = left[told & (weight > 0.0)[:, None]]
            free = len(used) + len(onward) - spent
            if free >= LEAST_FREE:
                middle = float(np.median(used)) * math.sqrt((len(used) + len(onward)) / free)
                scale = max(1.0, MAD_TO_SD * middle)
            weight = np.array([influence.weight(float(u)) for u in left.max(axis=1) / scale])
            onward = (np.abs(courses[0] - courses[1] @ x) < GROSS).astype(np.float64)
        return Found(
            rotation.dcm_from_rotation_vector(x[TURN]) @ found.C,
            found.velocity + x[VELOCITY],
            found.errors + x[OF_SENSORS],
            inverse[np.ix_(HANDED, HANDED)] * np.outer(SIGN, SIGN),
            np.einsum("kij,kj->ki", level[:k], there[:k] + by[:k] @ x),
            weight,
            scale,
            float(onward.mean()) if len(onward) else 0.0,
        )

    def _prior(self, found: Found, sums: DriveSums) -> Array:
        """Standard deviation of each unknown before the fixes."""
        gyro, accel, model = self.sensors.gyro, self.sensors.accel, self.model
        inputs = self.means - found.bias
        rate, force = inputs[:3], inputs[3:]
        sd = np.zeros(COUNT)
        sd[VELOCITY], sd[TURN] = UNKNOWN
        still = np.square(gyro.axis("bias")) + np.square(self.sensors.gyro_drift.triad)
        still = still + np.square(gyro.axis("g_sensitivity")) * float(force @ force)
        sd[GYRO] = np.sqrt(still + gyro.variance_by_input(rate))
        still = np.square(accel.axis("bias")) + np.square(self.sensors.accel_drift.triad)
        sd[ACCEL] = np.sqrt(still + accel.variance_by_input(force))
        apart = np.sqrt(np.maximum(sums.stretch, 1e-9))[:, None]
        for triad, matrix, noise in (
            (gyro, GYRO_MATRIX, GYRO_NOISE),
            (accel, ACCEL_MATRIX, ACCEL_NOISE),
        ):
            skew = np.repeat(np.array(triad.axis("misalignment"))[:, None], 3, axis=1)
            np.fill_diagonal(skew, triad.axis("scale"))
            sd[matrix] = skew.ravel()
            sd[noise] = (np.array(triad.axis("noise_density")) / apart).ravel()
        sd[GYRO_BY_FORCE] = np.repeat(gyro.axis("g_sensitivity"), 3)
        sd[YAW], sd[AXLE] = model.yaw_sd, model.axle_sd
        sd[OFFSET] = model.antenna.time_offset_sd
        return sd

    def _velocities(self, found: Found, sums: DriveSums, rate: Array) -> tuple[Array, Array]:
        """Velocities at the fixes, in the level at the end held still, and by the unknowns.

        The level turns by w: ``v = v_e - C int f - g T + w x g T²/2 + w_ie x int v``.
        """
        T, g = sums.until_end[:, None], self.site.gravity
        gained = sums.gained @ found.C.T
        v = found.velocity - gained - g * T + np.cross(rate, g) * 0.5 * T * T
        from_end = np.argsort(-sums.until_end, kind="stable")[::-1]
        way = np.empty_like(v)
        way[from_end] = running_integral(
            np.append(0.0, sums.until_end[from_end]), np.vstack([found.velocity, v[from_end]])
        )[1:]
        v = v + np.cross(self.site.earth_rate, way)
        by = np.zeros((len(v), 3, COUNT))
        by[:, :, VELOCITY] = np.eye(3)
        by[:, :, TURN] = rotation.cross_matrix(gained)
        by[:, :, OF_GYROS] = found.C @ sums.by_turn
        by[:, :, OF_ACCELS] = found.C @ sums.by_accel
        time = -sums.until_end[: len(self.fixes.time)]
        by[: len(time), :, OFFSET] = np.gradient(v[: len(time)], time, axis=0)
        return v, by

    def _courses(
        self,
        found: Found,
        sums: DriveSums,
        C: Array,
        there: Array,
        level: Array,
        by: Array,
        turns: Array,
    ) -> tuple[Array, Array, Array]:
        """Headings less courses at fixes a second apart: gaps, by the unknowns, weights."""
        fixes, model = self.fixes, self.model
        rows, newest = [], math.inf
        for k in range(len(fixes.time) - 1, -1, -1):
            if fixes.fast[k] and found.weight[k] > 0.0 and newest - fixes.time[k] >= APART:
                rows.append(k)
                newest = float(fixes.time[k])
        at = np.array(rows, dtype=np.int64)
        here = np.einsum("kij,kj->ki", level[at], there[at])
        v = found.fitted[at]
        square = np.maximum(v[:, 0] ** 2 + v[:, 1] ** 2, 1e-12)
        aside = np.stack([-v[:, 1] / square, v[:, 0] / square, np.zeros(len(at))], axis=1)
        heading = np.arctan2(C[at, 1, 0], C[at, 0, 0])
        steep = -C[at, 2, 0] / np.maximum(1.0 - C[at, 2, 0] ** 2, 1e-9)
        row = np.stack([steep * C[at, 0, 0], steep * C[at, 1, 0], np.ones(len(at))], axis=1)
        off = np.arctan2(v[:, 1], v[:, 0]) + model.yaw - heading
        off += np.einsum("ki,ki->k", aside, here - v)
        gap = np.radians(rotation.within_half_turn(np.degrees(off)))
        A = np.einsum("ki,kij->kj", row, turns[at]) - np.einsum("ki,kij->kj", aside, by[at])
        A[:, OFFSET] = 0.0
        A[:, YAW] = 1.0
        A[:, AXLE] = np.einsum("ki,ki->k", C[at, 2], sums.rate[at]) / np.sqrt(square)
        turned, pushed = self._within(sums)
        return gap, A, 1.0 / (model.slip_sd**2 + LEAST_SLIP**2 + turned + pushed / square)

    def _within(self, sums: DriveSums) -> tuple[float, float]:
        """Variances of attitude and velocity within a stretch, whose noise is taken as a bias.

        Of a random walk between two instants L apart at which it is known at most ``N² L/4`` is
        left, and of its integral less than ``N² L³/48``.
        """
        length = float(sums.stretch.max())
        turning = max(self.sensors.gyro.axis("noise_density")) ** 2 * length / 4.0
        pushing = max(self.sensors.accel.axis("noise_density")) ** 2 * length / 4.0
        return turning, pushing + turning * (STANDARD_GRAVITY * length) ** 2 / 12.0

    def _rest(
        self, rest: RestRate, found: Found, C: Array, turns: Array
    ) -> tuple[Array, Array, Array]:
        """The gyros read their bias and the Earth's rate, ``C' exp(-[theta x]) w_ie``."""
        earth, inputs = self.site.earth_rate, self.means - found.bias
        A = C.T @ rotation.cross_matrix(earth[None])[0] @ turns
        A[:, GYRO] += np.eye(3)
        A[:, GYRO_MATRIX] -= np.kron(np.eye(3), inputs[:3])
        force = -C.T @ self.site.gravity
        A[:, GYRO_BY_FORCE] += np.kron(np.eye(3), force - inputs[3:])
        gap = rest.rate - found.bias[:3] - C.T @ earth
        return gap, A, 1.0 / np.square(np.maximum(rest.sd, LEAST_RATE_SD))


def _solve(
    parts: list[tuple[Array, Array, Array]], sd: Array, errors: Array
) -> tuple[Array, Array, float]:
    """Least squares of gaps, rows and weights: unknowns, their covariance, how many are spent.

    In units of their standard deviations the unknowns are known to one before; of errors of the
    sensors what was taken off already counts.
    """
    normal = np.zeros((len(sd), len(sd)))
    right = np.zeros(len(sd))
    for gap, rows, weight in parts:
        scaled = rows * sd
        normal += scaled.T @ (weight[:, None] * scaled)
        right += scaled.T @ (weight * gap)
    normal[np.diag_indices(len(sd))] += 1.0
    known = np.where(sd[OF_SENSORS] > 0.0, sd[OF_SENSORS], np.inf)
    right[OF_SENSORS] -= errors / known
    size = 1.0 / np.sqrt(np.diagonal(normal))
    inverse = np.linalg.inv(size[:, None] * normal * size) * np.outer(size, size)
    inverse = 0.5 * (inverse + inverse.T)
    spent = float(len(sd) - np.trace(inverse))
    return sd * (inverse @ right), sd[:, None] * inverse * sd, spent


def _level_rate(velocity: Array, site: Site) -> Array:
    """Rate of the local level against inertial space, rad/s."""
    moving = transport_rate(site.lat_deg, site.alt, velocity, ellipsoid=site.ellipsoid)
    return np.asarray(site.earth_rate + moving)
