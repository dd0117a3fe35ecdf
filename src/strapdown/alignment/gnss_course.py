"""Alignment of a moving vehicle from its GNSS course and accelerations."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import ClassVar, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from strapdown import rotation
from strapdown.alignment.alignment import Alignment, CoarseAlignment, Site
from strapdown.alignment.course_sums import (
    ACCEL_BIAS,
    ACCEL_MATRIX,
    ACCEL_NOISE,
    ARM,
    ASKED,
    AXLE,
    COUNT,
    END_PLACE,
    END_VELOCITY,
    GYRO_BIAS,
    GYRO_BY_FORCE,
    GYRO_MATRIX,
    GYRO_NOISE,
    HANDED,
    LEAST_SD,
    OF_ACCELS,
    OF_GYROS,
    OF_SENSORS,
    OFFSET,
    STRETCHES,
    TURN,
    YAW,
    Antenna,
    CourseFixes,
    DriveSums,
    RestRate,
    course_fixes,
    drive_sums,
    rest_rates,
)
from strapdown.alignment.record_checks import check_record
from strapdown.constants import MAD_TO_SD, STANDARD_GRAVITY, Indices
from strapdown.dsp.samples import running_integral
from strapdown.earth import transport_rate
from strapdown.errors import ConfigError, DataError, Finding
from strapdown.estimation.robust import Huber, Igg3, Influence
from strapdown.frames import geodetic_from_ned, ned_from_geodetic
from strapdown.sensors.uncertainty import FREEDOM, ImuUncertainty
from strapdown.tables import ACCEL, GEODETIC, GYRO, POSITION_SD, usable
from strapdown.tables.checks import Array, index_of, is_number, source_of, view_of

#: Largest allowed tilt error, rad: beyond it attitude errors are no longer small.
LARGEST_TILT_SD = 0.35
#: Sideslip that varies from second to second, relative to the constant part (standard deviations).
SLIP_SHARE = 0.5


@dataclass(frozen=True)
class GnssCourse(CoarseAlignment):
    """A vehicle points along its course; its specific force minus its acceleration is up.

    Attributes
    ----------
    mounting_yaw_deg : float, deg
        Heading of the unit's forward axis minus that of the vehicle's.
    mounting_yaw_sd_deg, sideslip_sd_deg : float, deg
        Standard deviation of that angle, unless it is measured 5 deg; accelerations and turns
        reduce it. And of the sideslip: 1 deg for a car that does not turn hard; an
        aircraft or a ship drifts more with wind and current.
    least_speed : float, m/s
        Below it no course is taken.
    largest_sd_deg : float, deg
        Of a course by the noise of the receiver; more is refused.
    reverse : bool
        It drives backward.
    axle_sd : float, m
        Distance of the unit ahead of or behind the unsteered axle: a unit off the axle moves
        sideways while the vehicle turns.
    backtrack : bool
        The state is carried back to the first sample, too, for a navigation that begins there
        (`Alignment.earlier`).

    Raises
    ------
    ConfigError
        A number is out of range.
    """

    name: ClassVar[str] = "gnss_course"
    summary: ClassVar[str] = "course over ground, and specific force less GNSS acceleration"
    source: ClassVar[str] = "Groves 2013, sec. 5.6.2 and 6.1.1; window and weights: derived here"

    mounting_yaw_deg: float = 0.0
    mounting_yaw_sd_deg: float = 5.0
    sideslip_sd_deg: float = 1.0
    least_speed: float = 2.0
    largest_sd_deg: float = 10.0
    reverse: bool = False
    axle_sd: float = field(default=1.0, metadata={"unit": "m"})
    backtrack: bool = False

    def __post_init__(self) -> None:
        for name, least in (
            ("mounting_yaw_deg", -math.inf),
            ("mounting_yaw_sd_deg", 0.0),
            ("sideslip_sd_deg", 0.0),
            ("least_speed", 0.0),
            ("largest_sd_deg", 0.0),
            ("axle_sd", 0.0),
        ):
            value = getattr(self, name)
            if not (is_number(value) and math.isfinite(value) and value >= least):
                raise ConfigError(
                    "alignment.not-finite" if least else "alignment.not-finite-or-negative",
                    quantity=name,
                    value=value,
                )

    def align(
        self,
        imu: pd.DataFrame,
        site: Site,
        sensors: ImuUncertainty,
        gnss: pd.DataFrame | None = None,
        antenna: Antenna = Antenna(),  # noqa: B008
    ) -> Alignment:
        """As `CoarseAlignment.align`, with velocity, biases, and the receiver's `antenna`.

        DataError: the Gnss table is missing or has fewer than two fixes with a velocity within the
        record, the vehicle is too slow, or the accelerometers are too uncertain for a level.
        """
        findings = check_record(imu)
        fit = self.fit(imu, site, sensors, gnss, antenna)
        fixes, found = fit.fixes, fit.search()
        sd = np.sqrt(np.linalg.eigvalsh(found.covariance[3:5, 3:5])[-1])
        if not sd < LARGEST_TILT_SD:
            raise DataError(
                "alignment.level-not-known-from-fixes",
                file=fixes.source,
                quantity="VN, VE",
                time=fixes.time[-1] - fixes.time[0],
                sd_deg=np.degrees(sd),
            )
        findings += left_out(fixes, found)
        place = None
        if fixes.origin is not None:
            place = geodetic_from_ned(found.place, fixes.origin)
        earlier = None
        if self.backtrack:
            assert gnss is not None
            first = fit.at_first_sample(found, gnss)
            if first is not None:
                earlier = self._of(float(imu.index[0]), *first)
        return replace(
            self._of(float(imu.index[-1]), found, place), findings=findings, earlier=earlier
        )

    def _of(self, time: float, found: CourseEstimate, place: Array | None) -> Alignment:
        joint = found.covariance
        return Alignment(
            self.name,
            time,
            rotation.quaternion_from_dcm(found.C),
            joint[3:6, 3:6],
            gyro_bias=found.bias[:3],
            accel_bias=found.bias[3:],
            gyro_bias_sd=np.sqrt(np.diagonal(joint)[6:9]),
            accel_bias_sd=np.sqrt(np.diagonal(joint)[9:12]),
            heading_given=True,
            velocity=found.velocity,
            joint=joint,
            by_input=found.by_input,
            place=place,
        )

    def fit(
        self,
        imu: pd.DataFrame,
        site: Site,
        sensors: ImuUncertainty,
        gnss: pd.DataFrame | None,
        antenna: Antenna,
    ) -> CourseFit:
        """The least squares over a record; parameters and errors of `align`."""
        slowest, widest = self.least_speed, math.radians(self.largest_sd_deg)
        fixes = course_fixes(imu, gnss, slowest, widest, antenna)
        assert gnss is not None  # refused otherwise
        newest = _placed(gnss, imu)[-NEWEST:]
        if newest.size:
            # Axes and rate of the Earth are those of the end: of a place 4 km before, the start
            # would be 2 cm/s off in five minutes.
            places = view_of(gnss, GEODETIC)[newest]
            lat_deg, lon_deg, alt = np.median(places, axis=0).tolist()
            site = Site(lat_deg, lon_deg, alt, site.ellipsoid)
        rests = rest_rates(imu, fixes, sensors)
        yaw = math.radians(self.mounting_yaw_deg) + (math.pi if self.reverse else 0.0)
        slip = math.radians(self.sideslip_sd_deg)
        yaw_sd = math.hypot(slip, math.radians(self.mounting_yaw_sd_deg))
        model = CourseModel(self.reverse, yaw, yaw_sd, SLIP_SHARE * slip, self.axle_sd, antenna)
        means = view_of(imu, [*GYRO, *ACCEL]).mean(axis=0)
        return CourseFit(imu, means, fixes, rests, site, sensors, model)


# Attitude, velocity and biases at the end of a drive, by least squares over its fixes.

# Errors of velocity and attitude are estimate − truth, of sensors truth − estimate.
SIGN = np.where(OF_SENSORS.start > HANDED, 1.0, -1.0)
# Prior standard deviations of an unknown velocity, m/s, and of an unknown attitude, rad.
UNKNOWN = (100.0, 3.0)
# And of a vertical velocity of a moving body that no fix measures, m/s.
CLIMB = 1.0
# Rows of the biases in all covariances.
BIASES = np.arange(GYRO_BIAS.start, ACCEL_BIAS.stop)
# Prior standard deviation of the position at the end, m, against that by the newest fixes.
UNKNOWN_PLACE = 1e4
# The scatter of the fixes is judged from so many velocities beyond the number of unknowns.
LEAST_FREE = 12.0
# Number of updates of weights and scale with one linearization.
SWEEPS = 3
# A factor of the biases that counts as one.
NEAR = 1.05
# Share of the weight of fixes and rests in a state from which a filter meets them again.
ONCE = 0.1
# Number of newest positions, whose median is the place of the end.
NEWEST = 5
# Number of first positions, the first of which to agree with the others gives the position.
ANCHORS = 9
# A course error beyond this, rad, is that of a reversing vehicle.
GROSS = 0.8
# Courses closer than this, s, have the same sideslip.
APART = 1.0
# Ways are integrals of velocities at instants not farther apart than this, s: over an outage of the
# fixes in which the vehicle drives off, those at its ends say nothing of the way.
RESOLVED = 2.0
# Variance of a random walk about its mean, of that at its end, 1/6, for stretches that are
# independent, and of which a quarter of the whole has the same.
WALK = 1.0 / 24.0
# Lower bounds of standard deviations: of a slip, rad, of a mean rate, rad/s.
LEAST_SLIP, LEAST_RATE_SD = 1e-6, 1e-10


@dataclass(frozen=True)
class CourseModel:
    """Prior uncertainty of a vehicle's motion and of its fixes.

    `reverse`: it drives backward. `yaw` (rad): heading of the unit's forward axis minus the course.
    `yaw_sd`, `slip_sd` (rad): the part that stays over a drive, and the part that changes from
    second to second. `axle_sd` (m): uncertainty of the distance of the unit from the unsteered
    axle, ahead or behind.
    """

    reverse: bool
    yaw: float
    yaw_sd: float
    slip_sd: float
    axle_sd: float
    antenna: Antenna


@dataclass(frozen=True, eq=False)
class CourseEstimate:
    """Current estimates of the least squares.

    `C` ((3, 3)): attitude at the end of the record. `velocity` ((3,), m/s): at the end. `errors`
    (rad/s, m/s² and relative): of the sensors, the columns `OF_SENSORS`; reading −
    truth. `covariance` ((39, 39)): as `Alignment.joint`. `fitted` ((k, 3), m/s): velocities at the
    fixes, north, east, down, near which courses are linear. `weight` ((k,)): weight of each fix.
    `scale`: factor of the scatter of the velocities over their stated one; at least 1. `onward`:
    share of the courses that agree with the assumed direction of driving. `slip`: factor of the
    variance of the courses over that stated; at least 1. `place` ((3,), m): of
    positions alone, at the end; its covariance follows the 39 rows. `offset` (s): of the stamps of
    the fixes from those that were taken, later is positive, and its standard deviation. `beyond`:
    factor of the biases of the accelerometers over their stated sd; at least 1.
    """

    C: Array
    velocity: Array
    errors: Array
    covariance: Array
    fitted: Array
    weight: Array
    scale: float
    onward: float = 1.0
    slip: float = 1.0
    place: Array = field(default_factory=lambda: np.zeros(3))
    offset: tuple[float, float] = (0.0, 0.0)
    beyond: float = 1.0

    @property
    def bias(self) -> Array:
        """Biases of gyros and accelerometers, (6,), rad/s and m/s²."""
        return self.errors[:6]

    @property
    def by_input(self) -> Array:
        """Errors in proportion to the input, (27,), as `Alignment.by_input`."""
        return np.asarray(self.errors[HANDED[ASKED:] - OF_SENSORS.start])


class Observed(NamedTuple):
    """Predictions of a fit at its fixes, its rests and more instants, and residuals of the fixes.

    `sums`: from the instants to the end. `prior`: sd of each unknown. `level`, `C` ((n, 3, 3)): the
    level axes from those of the end, and the attitude. `turns`, `velocity`, `by_velocity` ((n, 3),
    (n, 3, unknowns)): derivative of the rotation; velocity in the level axes of the end, and its
    derivative. `gap`, `rows`, `told`, `sd` ((k, 3), with the unknowns for `rows`): residuals of
    the fixes, derivatives, whether they are stated, and sd. `courses`, `rests`: residuals,
    derivatives and weights.
    """

    sums: DriveSums
    prior: Array
    level: Array
    C: Array
    turns: Array
    velocity: Array
    by_velocity: Array
    gap: Array
    rows: Array
    told: NDArray[np.bool_]
    sd: Array
    courses: tuple[Array, Array, Array]
    rests: tuple[tuple[Array, Array, Array], ...]

    @property
    def parts(self) -> tuple[tuple[Array, Array, Array], ...]:
        """Residuals, derivatives and weights of the fixes, one by one, the courses, the rests."""
        fixes = self.gap.ravel(), self.rows.reshape(self.gap.size, -1), np.zeros(self.gap.size)
        return (fixes, self.courses, *self.rests)


@dataclass(frozen=True, eq=False)
class CourseFit:
    """Least squares over the fixes of a record, or of a part that reaches to its end.

    `imu`: of that part. `means` ((6,)): means of rate and force, at which the biases are estimated.
    `fixes`: in that part, two at least.
    """

    imu: pd.DataFrame
    means: Array
    fixes: CourseFixes
    rests: tuple[RestRate, ...]
    site: Site
    sensors: ImuUncertainty
    model: CourseModel

    def step(self, found: CourseEstimate, influence: Influence) -> CourseEstimate:
        """Solve once, about the last estimates, with weights by the residuals.

        `found`: its covariance is not used. `influence`: of the velocities of fixes, by the largest
        residual of the three.
        """
        seen = self._observed(found)
        told, stated, courses = seen.told, seen.sd, seen.courses
        weight, scale, slip, k = found.weight, found.scale, found.slip, len(self.fixes.time)
        onward, of_courses = np.ones(len(courses[0])), slice(3 * k, 3 * k + len(courses[0]))
        gap, rows, sure = (np.concatenate(each) for each in zip(*seen.parts, strict=True))
        scaled = rows * seen.prior
        for _ in range(SWEEPS):
            sure[: 3 * k] = (told * weight[:, None] / np.square(scale * stated)).ravel()
            sure[of_courses] = onward * courses[2] / slip
            x, root, spent = _solve(gap, scaled, sure, seen.prior, found.errors)
            residuals = gap - scaled @ x
            left = np.where(told, np.abs(residuals[: 3 * k]).reshape(k, 3) / stated, 0.0)
            used = left[told & (weight > 0.0)[:, None]]
            free = len(used) + len(onward) - spent
            if free >= LEAST_FREE:
                middle = float(np.median(used)) * math.sqrt((len(used) + len(onward)) / free)
                scale = max(1.0, MAD_TO_SD * middle)
            weight = _weights(left.max(axis=1) / scale, influence)
            aside = residuals[of_courses]
            onward = (np.abs(aside) < GROSS).astype(np.float64)
            slip = _excess((aside * np.sqrt(courses[2]))[onward > 0.0])
        x, root = seen.prior * x, root * seen.prior
        inverse = root.T @ root
        offset = -float(x[OFFSET]), float(np.sqrt(inverse[OFFSET, OFFSET]))
        handed, sign = HANDED, SIGN
        if self.by_places:
            handed, sign = np.r_[HANDED, END_PLACE], np.r_[SIGN, np.ones(3)]
            # The displacement by a wrong clock is left to the owner of that error.
            shift = found.velocity + x[END_VELOCITY]
            inverse[END_PLACE] += np.outer(shift, inverse[OFFSET])
            inverse[:, END_PLACE] += np.outer(inverse[:, OFFSET], shift)
        inverse = self._at_an_end(inverse, seen.sums)
        return CourseEstimate(
            rotation.dcm_from_rotation_vector(x[TURN]) @ found.C,
            found.velocity + x[END_VELOCITY],
            found.errors + x[OF_SENSORS],
            inverse[np.ix_(handed, handed)] * np.outer(sign, sign),
            np.einsum("kij,kj->ki", seen.level[:k], (seen.velocity + seen.by_velocity @ x)[:k]),
            weight,
            scale,
            float(onward.mean()) if len(onward) else 0.0,
            slip,
            found.place + x[END_PLACE] if self.by_places else found.place,
            offset,
            found.beyond,
        )

    def _observed(self, found: CourseEstimate, more: ArrayLike = ()) -> Observed:
        """Predict the fixes, the rests and `more` instants from the estimates, with residuals."""
        fixes, rests = self.fixes, self.rests
        parts = fixes.time, [rest.time for rest in rests], self._between(), np.asarray(more, float)
        time = np.concatenate(parts)
        sums = drive_sums(self.imu, time, self.means, found.errors)
        there, by, level = self._velocities(found, sums)
        C = level @ found.C @ sums.turned
        turns = np.zeros((len(time), 3, self.unknowns))
        turns[:, :, TURN] = np.eye(3)
        turns[:, :, OF_GYROS] = found.C @ sums.by_gyro
        k = len(fixes.time)
        if self.by_places:
            assert fixes.place is not None and fixes.place_sd is not None
            way, by_way = self._displacements(found, sums, there, by)
            arm, by_arm = self._arms(found, sums, turns, slice(k))
            rows = by_way[:k] + by_arm
            rows[:, :, OFFSET] = there[:k]
            gap, fix_sd = fixes.place - (found.place + (way[:k] + arm)), fixes.place_sd
            within = self._walk(sums)
        else:
            arm = np.cross(sums.rate[:k], self.model.antenna.lever_arm)
            read = fixes.velocity - np.einsum("kij,kj->ki", C[:k], arm)
            gap = np.einsum("kji,kj->ki", level[:k], read) - there[:k]
            rows, fix_sd, within = by[:k].copy(), fixes.sd, self._within(sums)[1]
            rows[:, :, ARM] = found.C @ sums.turned[:k] @ rotation.cross_matrix(sums.rate[:k])
        told = np.isfinite(fix_sd)
        return Observed(
            sums,
            self._prior(found, sums),
            level,
            C,
            turns,
            there,
            by,
            gap,
            rows,
            told,
            np.sqrt(np.where(told, np.square(fix_sd), 1.0) + within),
            self._courses(found, sums, C[:k], there[:k], level[:k], by[:k], turns[:k]),
            tuple(self._rest(rest, found, C[k + i], turns[k + i]) for i, rest in enumerate(rests)),
        )

    def at_first_sample(
        self, found: CourseEstimate, gnss: pd.DataFrame
    ) -> tuple[CourseEstimate, Array | None] | None:
        """State at the first sample of the record, and its position (deg, deg, m).

        A navigation that begins there meets all fixes again: they count by a part of their weight
        (`ONCE`), so that its covariance owes next to nothing to them. `found`: by `search`. `gnss`:
        whose first position that agrees with the others gives the position. None without one; of
        fixes that all have velocities alone the state has no position.
        """
        fixes, first = self.fixes, float(self.imu.index[0])
        if first < fixes.time[0]:
            # The stretches with a noise of their own are those of another part.
            errors = found.errors.copy()
            errors[NOISE] = 0.0
            found = _converged(self, replace(found, errors=errors), Igg3())
        anchors = self._anchors(found, gnss)
        if anchors is None and usable(gnss, POSITION_SD).any():
            return None
        stamps = np.zeros(0) if anchors is None else anchors[0]
        seen = self._observed(found, np.append(stamps, first))
        k = len(fixes.time)
        gap, rows, sure = (np.concatenate(each) for each in zip(*seen.parts, strict=True))
        of_rests = 3 * k + len(seen.courses[0])
        sure[: 3 * k] = (seen.told * found.weight[:, None]).ravel()
        sure[: 3 * k] /= np.square(found.scale * seen.sd).ravel()
        sure[3 * k : of_rests] *= (np.abs(seen.courses[0]) < GROSS) / found.slip
        sure[: 3 * k] *= ONCE
        sure[of_rests:] *= ONCE
        _, root, _ = _solve(gap, rows * seen.prior, sure, seen.prior, found.errors)
        root *= seen.prior
        here = len(seen.level) - 1
        level = seen.level[here]
        J = np.zeros((len(HANDED) + 3, self.unknowns))
        J[END_VELOCITY] = -level @ seen.by_velocity[here]
        J[TURN] = -level @ seen.turns[here]
        J[np.arange(GYRO_BIAS.start, len(HANDED)), HANDED[GYRO_BIAS.start :]] = 1.0
        geodetic = None
        if anchors is None:
            J = J[: len(HANDED)]
        else:
            at, by_at, own = self._first_place(found, seen, anchors)
            geodetic = geodetic_from_ned(at, anchors[3], ellipsoid=self.site.ellipsoid)
            J[len(HANDED) :] = -by_at
        # The shift by a wrong clock is left to the owner of that error.
        J[:, OFFSET] = 0.0
        moved = root @ J.T
        covariance = self._at_an_end(moved.T @ moved, seen.sums)
        if anchors is not None:
            covariance[len(HANDED) :, len(HANDED) :] += np.diag(own)
        state = CourseEstimate(
            seen.C[here],
            level @ seen.velocity[here],
            found.errors,
            covariance,
            found.fitted,
            found.weight,
            found.scale,
            found.onward,
            found.slip,
        )
        return state, geodetic

    def _first_place(
        self, found: CourseEstimate, seen: Observed, anchors: tuple[Array, Array, Array, Array]
    ) -> tuple[Array, Array, Array]:
        """Position at the first sample, its derivative, and the variance of the fix that gives it.

        North, east, down of the origin of `anchors`, which are as of `_anchors`; `seen` ends with
        them and the first sample.
        """
        stamps, place, place_sd, _ = anchors
        here = len(seen.level) - 1
        way, by_way = self._displacements(found, seen.sums, seen.velocity, seen.by_velocity)
        if self.by_places:
            return found.place + way[here], by_way[here], np.zeros(3)
        near = slice(here - len(stamps), here)
        arm, by_arm = self._arms(found, seen.sums, seen.turns, near)
        guess = place - (way[near] + arm) + way[here]
        apart = guess - np.median(guess, axis=0)
        usual = np.maximum(place_sd, MAD_TO_SD * np.median(np.abs(apart), axis=0))
        j = int(np.argmax((np.abs(apart) <= CLEAR * usual).all(axis=1)))
        return guess[j], by_way[here] - (by_way[near] + by_arm)[j], np.square(place_sd[j])

    def _anchors(
        self, found: CourseEstimate, gnss: pd.DataFrame
    ) -> tuple[Array, Array, Array, Array] | None:
        """Stamps, positions and sd of the first fixes with one, north-east-down of an origin."""
        fixes = self.fixes
        stamps, sd = index_of(gnss), view_of(gnss, POSITION_SD)
        placed = _placed(gnss, self.imu)
        if not placed.size:
            return None
        places = view_of(gnss, GEODETIC)
        origin, newest = fixes.origin, int(placed[-1])
        if origin is None:
            ahead = found.velocity * (self.imu.index[-1] - stamps[newest])
            origin = geodetic_from_ned(ahead, places[newest], ellipsoid=self.site.ellipsoid)
        rows = placed[:ANCHORS]
        here = ned_from_geodetic(places[rows], origin, ellipsoid=self.site.ellipsoid)
        return stamps[rows], here, np.maximum(sd[rows], LEAST_SD), origin

    @property
    def by_places(self) -> bool:
        """Whether positions alone are the observations."""
        return self.fixes.place is not None

    @property
    def unknowns(self) -> int:
        """Number of unknowns."""
        return COUNT + 3 * self.by_places

    def _prior(self, found: CourseEstimate, sums: DriveSums) -> Array:
        """Standard deviation of each unknown before the fixes."""
        gyro, accel, model = self.sensors.gyro, self.sensors.accel, self.model
        inputs = self.means - found.bias
        rate, force = inputs[:3], inputs[3:]
        sd = np.zeros(self.unknowns)
        sd[END_VELOCITY], sd[TURN] = UNKNOWN
        if not (self.by_places or np.isfinite(self.fixes.sd[:, 2]).any()):
            sd[END_VELOCITY.start + 2] = CLIMB
        sd[COUNT:] = UNKNOWN_PLACE
        still = self.sensors.gyro_bias_variance()
        still = still + np.square(gyro.axis("g_sensitivity")) * float(force @ force)
        sd[GYRO_BIAS] = np.sqrt(still + gyro.variance_by_input(rate))
        sd[ACCEL_BIAS] = found.beyond * np.sqrt(self._accel_variance(found))
        apart = np.sqrt(np.maximum(sums.stretch, 1e-9))[:, None]
        for triad, drift, matrix, noise in (
            (gyro, self.sensors.gyro_drift, GYRO_MATRIX, GYRO_NOISE),
            (accel, self.sensors.accel_drift, ACCEL_MATRIX, ACCEL_NOISE),
        ):
            skew = np.repeat(np.array(triad.axis("misalignment"))[:, None], 3, axis=1)
            np.fill_diagonal(skew, triad.axis("scale"))
            sd[matrix] = skew.ravel()
            white = np.array(triad.axis("noise_density")) / apart
            # A drift changes by so much over the whole, and stays for quarters of it.
            length = float(sums.stretch.sum())
            walk = WALK * STRETCHES * drift.moved(length)
            sd[noise] = np.sqrt(white**2 + walk).ravel()
        sd[GYRO_BY_FORCE] = np.repeat(gyro.axis("g_sensitivity"), 3)
        sd[YAW], sd[AXLE] = model.yaw_sd, model.axle_sd
        sd[OFFSET], sd[ARM] = model.antenna.time_offset_sd, model.antenna.lever_arm_sd
        return sd

    def _velocities(self, found: CourseEstimate, sums: DriveSums) -> tuple[Array, Array, Array]:
        """Velocities at instants, in the level axes of the end, derivatives, and axes from there.

        The Earth turns, and gravity points down where the vehicle is, W the transport rate of a
        velocity and s the way to the end:
        ``v = v_e - C int f - int g + w_ie x s + int (W s) x g``.
        """
        gained = sums.gained @ found.C.T
        v = found.velocity - gained - self._fallen(sums.until_end)[0]
        by = np.zeros((len(v), 3, self.unknowns))
        by[:, :, END_VELOCITY] = np.eye(3)
        by[:, :, TURN] = rotation.cross_matrix(gained)
        by[:, :, OF_GYROS] = found.C @ sums.by_turn
        by[:, :, OF_ACCELS] = found.C @ sums.by_accel
        from_end = np.argsort(-sums.until_end, kind="stable")[::-1]
        past = np.append(0.0, sums.until_end[from_end])
        spun, bent, of_way, fallen = self._spun, self._bent, self._of_way, v[from_end]
        for _ in range(2):  # the way by what is left out is its second order
            ways = running_integral(past, np.vstack([found.velocity, v[from_end]]))
            v[from_end] = fallen + (ways @ spun.T + running_integral(past, ways @ bent.T))[1:]
        # A tilt and a bias that cancel each other do so to the last digit that the fixes resolve:
        # without these terms, 0.4 % over a minute, fixes of a centimetre seem to separate the two.
        end = np.eye(self.unknowns)[None, END_VELOCITY]
        along = running_integral(past, np.concatenate([end, by[from_end]]))
        by[from_end] += (spun @ along + running_integral(past, bent @ along))[1:]
        k = len(self.fixes.time)
        by[:k, :, OFFSET] = np.gradient(v[:k], -sums.until_end[:k], axis=0)
        turn = self._earth_rate * sums.until_end[:, None]
        turn[from_end] += ways[1:] @ of_way.T
        return v, by, rotation.dcm_from_rotation_vector(turn)

    def _fallen(self, until_end: Array) -> tuple[Array, Array]:
        """Integral of gravity, as the Earth turns it, over times to the end, and that once more.

        A series in the turn of the Earth: of 300 s, 0.02 rad, the first order leaves 0.1 m/s.
        """
        T = until_end[:, None]
        term, power = self._gravity, T
        once, twice = np.zeros((len(T), 3)), np.zeros((len(T), 3))
        for order in range(2, 7):
            once += power * term
            power = power * T / order
            twice += power * term
            term = -self._spun @ term
        return once, twice

    @cached_property
    def _earth_rate(self) -> Array:
        """Rate of the Earth, level axes, (3,), rad/s."""
        return self.site.earth_rate

    @cached_property
    def _gravity(self) -> Array:
        """Gravity, level axes, (3,), m/s²."""
        return self.site.gravity

    @cached_property
    def _spun(self) -> Array:
        """Matrix of the cross product with the rate of the Earth, (3, 3)."""
        return np.asarray(rotation.cross_matrix(self._earth_rate[None])[0])

    @cached_property
    def _bent(self) -> Array:
        """Change of gravity's direction by a way, (3, 3): ``(W s) x g`` of the transport rate."""
        return np.asarray(-rotation.cross_matrix(self._gravity[None])[0] @ self._of_way)

    @cached_property
    def _of_way(self) -> Array:
        """Turn of the level axes by a way, (3, 3), rad/m: W of the transport rate."""
        site = self.site
        rates = transport_rate(site.lat_deg, site.alt, np.eye(3), ellipsoid=site.ellipsoid)
        return np.asarray(rates.T, dtype=np.float64)

    def _between(self) -> Array:
        """Instants between fixes that are farther apart than `RESOLVED`, s."""
        begin, end = float(self.imu.index[0]), float(self.imu.index[-1])
        nodes = np.concatenate([[begin], self.fixes.time, [end]])
        count = np.ceil(np.diff(nodes) / RESOLVED).clip(1).astype(np.intp)
        part = np.concatenate([np.arange(1.0, n) / n for n in count])
        begun, length = (np.repeat(of, count - 1) for of in (nodes[:-1], np.diff(nodes)))
        return np.asarray(begun + part * length)

    def _displacements(
        self, found: CourseEstimate, sums: DriveSums, there: Array, by: Array
    ) -> tuple[Array, Array]:
        """Positions at instants less that at the end, and their derivatives.

        In Earth-fixed axes, level at the end, ``s = s_e - int (1 + [w_ie x] T) v``: the axes have
        turned by ``w_ie T`` since. `there`, `by`: velocities, and their derivatives.
        """
        until, T = sums.until_end, sums.until_end[:, None]
        moved = sums.moved @ found.C.T
        way = found.velocity * T - moved - self._fallen(until)[1]
        # By integrals from fix to fix: the Earth turns the way and the velocity, and gravity points
        # down where the vehicle is, not where it ends.
        from_end = np.argsort(-until, kind="stable")[::-1]
        past = np.append(0.0, until[from_end])
        spun, bent = self._spun, self._bent

        def turned(along: Array) -> Array:
            """Way by these turns, of velocities from the end on, (n + 1, 3, m)."""
            ways = running_integral(past, along)
            spread = past[:, None, None] * along
            return running_integral(
                past, spun @ (ways + spread) + running_integral(past, bent @ ways)
            )

        along = np.vstack([found.velocity, there[from_end]])
        way[from_end] += turned(along[:, :, None])[1:, :, 0]
        out = np.zeros((len(until), 3, self.unknowns))
        out[:, :, COUNT:] = np.eye(3)[:, : self.unknowns - COUNT]
        out[:, :, END_VELOCITY] = -T[:, :, None] * np.eye(3)
        out[:, :, TURN] = -rotation.cross_matrix(moved)
        out[:, :, OF_GYROS] = -found.C @ sums.moved_by_turn
        out[:, :, OF_ACCELS] = -found.C @ sums.moved_by_accel
        end = np.eye(self.unknowns)[None, END_VELOCITY]
        out[from_end] -= turned(np.concatenate([end, by[from_end]]))[1:]
        return -way, out

    def _arms(
        self, found: CourseEstimate, sums: DriveSums, turns: Array, rows: slice
    ) -> tuple[Array, Array]:
        """Lever arm of the antenna at instants, in the same axes, and its derivatives."""
        fixed = rotation.dcm_from_rotation_vector(self._earth_rate * sums.until_end[rows, None])
        axes = fixed @ found.C @ sums.turned[rows]
        arm = axes @ np.array(self.model.antenna.lever_arm)
        by_arm = -(rotation.cross_matrix(arm) @ turns[rows])
        by_arm[:, :, ARM] = axes
        return arm, by_arm

    def _at_an_end(self, covariance: Array, sums: DriveSums) -> Array:
        """Covariance with the biases at an end of the record, instead of their means over it.

        A random walk there differs from its mean by a third of the variance of its change.
        """
        out, length = covariance.copy(), float(sums.stretch.sum())
        drifts = self.sensors.gyro_drift, self.sensors.accel_drift
        out[BIASES, BIASES] += np.concatenate([drift.moved(length) for drift in drifts]) / 3.0
        return out

    def _walk(self, sums: DriveSums) -> float:
        """Variance of a position within stretches, whose noise is modeled as a bias of each.

        A white noise that is modeled as a bias of each of n stretches L leaves a random walk of the
        position of ``N² L³ / 12`` a stretch, of which a bridge of n has a quarter at most.
        """
        stretch = float(sums.stretch.max())
        push = max(self.sensors.accel.axis("noise_density")) ** 2
        lean = (max(self.sensors.gyro.axis("noise_density")) * STANDARD_GRAVITY * stretch) ** 2
        walk = (push + lean / 12.0) * stretch**3 / 12.0
        return float(walk * len(sums.stretch) / 4.0)

    def _courses(
        self,
        found: CourseEstimate,
        sums: DriveSums,
        C: Array,
        there: Array,
        level: Array,
        by: Array,
        turns: Array,
    ) -> tuple[Array, Array, Array]:
        """Heading minus course at fixes a second apart: residuals, derivatives, weights."""
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
        """Variances of attitude and velocity within a stretch, whose noise is modeled as a bias.

        A random walk between two instants L apart at which it is known has a variance of at most
        ``N² L/4``, and its integral less than ``N² L³/48``.
        """
        length = float(sums.stretch.max())
        turning = max(self.sensors.gyro.axis("noise_density")) ** 2 * length / 4.0
        pushing = max(self.sensors.accel.axis("noise_density")) ** 2 * length / 4.0
        return turning, pushing + turning * (STANDARD_GRAVITY * length) ** 2 / 12.0

    def _rest(
        self, rest: RestRate, found: CourseEstimate, C: Array, turns: Array
    ) -> tuple[Array, Array, Array]:
        """The gyros read their bias and the Earth's rate, ``C' exp(-[theta x]) w_ie``."""
        earth, inputs = self._earth_rate, self.means - found.bias
        A = C.T @ self._spun @ turns
        A[:, GYRO_BIAS] += np.eye(3)
        A[:, GYRO_MATRIX] -= np.kron(np.eye(3), inputs[:3])
        force = -C.T @ self._gravity
        A[:, GYRO_BY_FORCE] += np.kron(np.eye(3), force - inputs[3:])
        gap = rest.rate - found.bias[:3] - C.T @ earth
        return gap, A, 1.0 / np.square(np.maximum(rest.sd, LEAST_RATE_SD))

    def search(self, near: CourseEstimate | None = None) -> CourseEstimate:
        """Solve over increasing parts that end with the record, up to the whole.

        Gross errors among the fixes are excluded. `near`: of nearly the same record, from which the
        whole is solved at once.
        """
        fixes = self.fixes
        end, begin = float(self.imu.index[-1]), float(fixes.time[0])
        bias, length = self._begin() if near is None else (near.errors, end - begin)
        found = None
        while True:
            # What is left beside the whole is no part of its own.
            begin_here = begin if WHOLE * length > end - begin else end - length
            fit = self._part(begin_here)
            if found is None:
                found = fit._guess(bias)
                if near is not None:
                    found = replace(found, C=near.C, velocity=near.velocity)
            else:
                older = len(fit.fixes.time) - len(found.weight)
                errors = found.errors.copy()
                errors[NOISE] = 0.0
                found = replace(
                    found,
                    errors=errors,
                    fitted=np.vstack([_smooth(fit.fixes)[:older], found.fitted]),
                    weight=np.concatenate([_near_neighbours(fit.fixes)[:older], found.weight]),
                )
            found = _converged(fit, found, Huber())
            if begin_here <= begin:
                break
            sd = float(np.sqrt(np.diagonal(found.covariance)[6:9].max()))
            length = max(GROWTH * length, LINEAR / max(sd, 1e-12))
        found = _converged(fit, found, Igg3())
        for _ in range(SWEEPS):
            before, found = found.beyond, replace(found, beyond=fit.beyond(found))
            if found.beyond <= NEAR * before:
                break
            found = _converged(fit, found, Igg3())
        if found.onward < MOST:
            raise DataError(
                "alignment.course-contradicts-forward",
                file=fixes.source,
                quantity="VN, VE",
                count=len(fixes.time),
                onward=1.0 - found.onward,
            )
        return found

    def _begin(self) -> tuple[Array, float]:
        """Errors of the sensors to begin with, and length of the first part, s."""
        fixes, end = self.fixes, float(self.imu.index[-1])
        newest = fixes.time[-min(LEAST_FIXES, len(fixes.time))]
        length = end - min(newest, fixes.time[-1] - LEAST_LENGTH)
        errors, sd = self._bias_of_rests()
        least = min(LEAST_BASELINES * fixes.baseline, end - float(fixes.time[0]))
        if sd * least > LINEAR:
            # Fixes may be missing at the end.
            part = self._part(end - max(length, least))
            errors[:3], sd = part._bias_of_courses(errors[:3], sd)
        return errors, max(length, LINEAR / max(sd, 1e-12), least)

    def beyond(self, found: CourseEstimate) -> float:
        """Factor of the biases of the accelerometers over their stated standard deviation.

        A data sheet states that of a type: a unit, soldered, aged and warm, may lie far outside,
        and then all its axes may. Student's t distribution of `FREEDOM` for the three together: an
        expectation step for the factor, by the biases and what they are unsure of.
        """
        known = self._accel_variance(found)
        square = np.square(found.bias[3:]) + np.diagonal(found.covariance)[ACCEL_BIAS]
        part = np.divide(square, known, out=np.zeros(3), where=known > 0.0)
        return max(1.0, math.sqrt((FREEDOM + float(part.sum())) / (FREEDOM + 3.0)))

    def _accel_variance(self, found: CourseEstimate) -> Array:
        """Stated variances of the accelerometer biases at the mean input, (3,)."""
        accel = self.sensors.accel
        force = self.means[3:] - found.bias[3:]
        return self.sensors.accel_bias_variance() + accel.variance_by_input(force)

    def _bias_of_rests(self) -> tuple[Array, float]:
        """Bias of the gyros from the rests, and the largest standard deviation."""
        gyro, rate = self.sensors.gyro, np.zeros(3)
        known = np.hypot(gyro.axis("bias"), self.sensors.gyro_drift.triad)
        if self.rests:
            best = min(self.rests, key=lambda rest: float(rest.sd.max()))
            rate, known = best.rate, np.minimum(known, best.sd)
        errors = np.zeros(OF_SENSORS.stop - OF_SENSORS.start)
        errors[:3] = rate
        return errors, float(known.max())

    def _bias_of_courses(self, bias: Array, sd: float) -> tuple[Array, float]:
        """Bias of the gyros of a vehicle whose tilt stays and whose heading follows its course.

        If that is more accurate than `sd`, the accuracy of `bias`.
        """
        fixes = self.fixes
        fast = fixes.only(fixes.fast & fixes.independent())
        if len(fast.time) < 3:
            return bias, sd
        mean = view_of(self.imu, [*GYRO, *ACCEL]).mean(axis=0)
        down = -mean[3:] / np.linalg.norm(mean[3:])
        course = np.unwrap(np.arctan2(fast.velocity[:, 1], fast.velocity[:, 0]))
        length = float(fast.time[-1] - fast.time[0])
        found = mean[:3] - down * float(course[-1] - course[0]) / length
        found_sd = TILTS / length
        return (found, found_sd) if found_sd < sd else (bias, sd)

    def _part(self, begin: float) -> CourseFit:
        time = index_of(self.imu)
        fixes = self.fixes.only(self.fixes.time >= begin - 1e-9)
        first = max(int(np.searchsorted(time, fixes.time[0], side="right")) - 1, 0)
        for rest in self.rests:
            first = min(first, max(int(np.searchsorted(time, rest.time)) - 1, 0))
        part = self.imu.iloc[first:]
        part.attrs = dict(self.imu.attrs)
        return replace(self, imu=part, fixes=fixes)

    def _guess(self, bias: Array) -> CourseEstimate:
        """Level by mean force minus acceleration from the velocities, heading by median course."""
        fixes = self.fixes
        sums = drive_sums(self.imu, fixes.time, bias[:6], bias)
        check_forward(self.imu, fixes, sums, self.model.reverse)
        first, last = _ends(fixes)
        length = float(fixes.time[last].mean() - fixes.time[first].mean())
        v0 = np.median(fixes.velocity[first], axis=0)
        v1 = np.median(fixes.velocity[last], axis=0)
        gained = sums.gained[first].mean(axis=0) - sums.gained[last].mean(axis=0)
        force_n = (v1 - v0) / length - self._gravity
        fast = np.flatnonzero(fixes.fast & (fixes.time >= fixes.time[-1] - HEADING_SPAN))
        course = np.arctan2(fixes.velocity[fast, 1], fixes.velocity[fast, 0]) + self.model.yaw
        heading = float(course[-1])
        for _ in range(2):
            back = _attitude(gained / length, force_n, heading) @ sums.turned[fast]
            off = np.degrees(course - np.arctan2(back[:, 1, 0], back[:, 0, 0]))
            heading += math.radians(_middle_turn(off))
        C = _attitude(gained / length, force_n, heading)
        nothing = np.zeros((len(HANDED), len(HANDED)))
        return CourseEstimate(C, v1, bias, nothing, _smooth(fixes), _near_neighbours(fixes), 1.0)


def _weights(residuals: Array, influence: Influence) -> Array:
    """Weights of residuals, (k,): 1 in the linear range, where most are."""
    out = np.ones(len(residuals))
    for k in np.flatnonzero(residuals > influence.linear).tolist():
        out[k] = influence.weight(float(residuals[k]))
    return out


def _solve(
    gap: Array, scaled: Array, weight: Array, sd: Array, errors: Array
) -> tuple[Array, Array, float]:
    """Least squares: unknowns, a root R of their covariance R'R, and parameters spent.

    In units of their standard deviations `sd`, as the columns of `scaled` are, the unknowns have a
    prior of unit variance; for sensor errors it applies to the total, including the part already
    subtracted. `gap`, `weight`: residuals, and their weights.
    """
    root = np.sqrt(weight)
    known = np.where(sd[OF_SENSORS] > 0.0, sd[OF_SENSORS], np.inf)
    half = root[:, None] * scaled
    right = half.T @ (root * gap)
    right[OF_SENSORS] -= errors / known
    normal = half.T @ half
    normal[np.diag_indices(len(sd))] += 1.0
    size = 1.0 / np.sqrt(np.diagonal(normal))
    inverse = _root_of_inverse(size[:, None] * normal * size) * size
    return (right @ inverse.T) @ inverse, inverse, float(len(sd) - np.square(inverse).sum())


def _root_of_inverse(matrix: Array) -> Array:
    """R, with R'R the inverse of a positive matrix, which rounding may make singular."""
    try:
        return _inverse_of_lower(np.asarray(np.linalg.cholesky(matrix), dtype=np.float64))
    except np.linalg.LinAlgError:
        values, vectors = np.linalg.eigh(matrix)
        least = len(matrix) * float(np.finfo(np.float64).eps)
        return np.asarray((vectors / np.sqrt(np.maximum(values, least))).T)


#: Rows up to which a triangle is inverted as any other matrix.
SMALL_TRIANGLE = 24


def _inverse_of_lower(lower: Array) -> Array:
    """Inverse of a lower triangular matrix, by halves: numpy has that of any matrix alone."""
    if len(lower) <= SMALL_TRIANGLE:
        return np.asarray(np.linalg.inv(lower), dtype=np.float64)
    half, out = len(lower) // 2, np.zeros_like(lower)
    out[:half, :half] = _inverse_of_lower(lower[:half, :half])
    out[half:, half:] = _inverse_of_lower(lower[half:, half:])
    out[half:, :half] = -out[half:, half:] @ (lower[half:, :half] @ out[:half, :half])
    return out


def _excess(residuals: Array) -> float:
    """Factor of the variance of the courses by their residuals, in stated sd, newest first.

    Wind, current and waves turn a course from the heading for seconds: residuals that keep their
    sign count as ``(1 - r) / (1 + r)`` of their number, with their autocorrelation r.
    """
    n, power = len(residuals), float(residuals @ residuals)
    if n < 2 or power == 0.0:
        return 1.0
    r = min(max(float(residuals[1:] @ residuals[:-1]) / power, 0.0), 1.0 - 2.0 / n)
    return max(1.0, power / n * (1.0 + r) / (1.0 - r))


# Initial attitude of a drive: over a short end of the record first, then over more.


# Attitude error by a bias over the part that is solved, rad, one standard deviation: the second
# order is a hundredth.
LINEAR = 0.2
# Number of fixes and their duration, s, of the first part, and least factor of its growth; one by
# less, to the whole, is taken with it.
LEAST_FIXES, LEAST_LENGTH, GROWTH, WHOLE = 4, 1.0, 1.5, 1.1
# Gauss-Newton steps over each part: iteration ends when the largest step is below a part of its
# standard deviation.
STEPS, SMALL = 8, 0.02
# Of positions alone the first part is as many times the baseline of their differences.
LEAST_BASELINES = 3.0
# Change of the tilt of a vehicle, and error of a change of its course, rad.
TILTS = 0.2
# Errors that belong to a stretch of one part alone.
NOISE = np.r_[GYRO_NOISE, ACCEL_NOISE] - OF_SENSORS.start
# A velocity is an outlier beyond so many of its standard deviations, or of the usual ones.
CLEAR = 6.0
# Number of courses that determine the direction of the drive.
MOST = 0.5
# The heading is the median of the courses over this duration, s.
HEADING_SPAN = 5.0


def _placed(gnss: pd.DataFrame, imu: pd.DataFrame) -> Indices:
    """Rows of the fixes with a position within the samples."""
    stamps = index_of(gnss)
    within = (stamps >= imu.index[0]) & (stamps <= imu.index[-1])
    return np.flatnonzero(usable(gnss, POSITION_SD) & within)


def left_out(fixes: CourseFixes, found: CourseEstimate) -> tuple[Finding, ...]:
    """Report the outliers among the fixes."""
    out = np.flatnonzero(found.weight == 0.0)
    if not len(out):
        return ()
    times = "it is" if len(out) == 1 else "they are"
    return (
        Finding(
            "alignment.fix-velocities-rejected",
            file=fixes.source,
            row=int(fixes.row[out[0]]),
            quantity="VN, VE, VD",
            count=len(out),
            count_2=len(fixes.time),
            times=times,
        ),
    )


def _converged(fit: CourseFit, found: CourseEstimate, influence: Influence) -> CourseEstimate:
    """Iterate to convergence."""
    for _ in range(STEPS):
        before, found = found, fit.step(found, influence)
        sd = np.sqrt(np.diagonal(found.covariance)[:ASKED])
        turn = rotation.rotation_vector_from_dcm(found.C @ before.C.T)
        moved = [found.velocity - before.velocity, turn, found.bias - before.bias]
        if (np.abs(np.concatenate(moved)) <= SMALL * sd).all():
            break
    return found


def _ends(fixes: CourseFixes) -> tuple[Indices, Indices]:
    """Indices of the first and of the last third of the fixes."""
    count = len(fixes.time)
    third = max(1, count // 3)
    return np.arange(third), np.arange(count - third, count)


def _smooth(fixes: CourseFixes) -> Array:
    """Median of each velocity and its neighbors: without outliers."""
    k = np.arange(len(fixes.time))[:, None] + np.arange(-2, 3)
    return np.asarray(np.median(fixes.velocity[np.clip(k, 0, len(k) - 1)], axis=1))


def _near_neighbours(fixes: CourseFixes) -> Array:
    """One for a velocity close to its neighbors, zero for an evident outlier.

    Its residual decides later in any case.
    """
    off = np.abs(fixes.velocity - _smooth(fixes))
    told = np.isfinite(fixes.sd)
    usual = np.maximum(np.where(told, fixes.sd, 0.0), MAD_TO_SD * np.median(off, axis=0))
    return np.where(((off <= CLEAR * usual) | ~told).all(axis=1), 1.0, 0.0)


def _middle_turn(off_deg: Array) -> float:
    """Median of angles, about the angle nearest to all others; deg."""
    apart = rotation.within_half_turn(off_deg[:, None] - off_deg)
    nearest = off_deg[int(np.argmin(np.abs(apart).sum(axis=1)))]
    return float(nearest + np.median(rotation.within_half_turn(off_deg - nearest)))


def _attitude(force_b: Array, force_n: Array, heading: float) -> Array:
    """``C_nb`` of a heading (rad) that maps the one force onto the other."""
    c, s = math.cos(heading), math.sin(heading)
    size = float(np.linalg.norm(force_b) / np.linalg.norm(force_n))
    x, y, z = size * np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]) @ force_n
    pitch = math.asin(max(-1.0, min(1.0, force_b[0] / math.hypot(x, z)))) - math.atan2(x, -z)
    lifted = math.sin(pitch) * x + math.cos(pitch) * z
    roll = math.atan2(lifted, y) - math.atan2(force_b[2], force_b[1])
    return rotation.dcm_from_euler(np.degrees([roll, pitch, heading]))


# Check that a vehicle drives along its forward axis.

#: A slope of more standard deviations is significant.
CLEAR_SLOPE = 5.0
LEAST_STEPS = 6


def check_forward(imu: pd.DataFrame, fixes: CourseFixes, sums: DriveSums, reverse: bool) -> None:
    """Compare the force along the forward axis with the change of the speed.

    `imu`: for its name. `sums`: at the fixes. `reverse`: whether the drive was taken for a reverse
    one. DataError: the force falls while the vehicle gains speed. Fewer than six steps from fix to
    fix, or no changes of speed, allow no check.
    """
    fast = fixes.fast & fixes.independent()
    if fast.sum() <= LEAST_STEPS:
        return
    fixes, gained, turned = fixes.only(fast), sums.gained[fast], sums.turned[fast]
    steps = np.diff(fixes.time)
    speed = np.hypot(fixes.velocity[:, 0], fixes.velocity[:, 1])
    gain = np.diff(speed) / steps * (-1.0 if reverse else 1.0)
    force = -np.diff(gained, axis=0) / steps[:, None]
    # Body axes at the end of each step, accurate enough for a sign.
    forward = np.einsum("ki,ki->k", turned[1:, :, 0], force)
    x, y = gain - gain.mean(), forward - forward.mean()
    power = float(x @ x)
    if power == 0.0:
        return
    slope = float(x @ y) / power
    left = y - slope * x
    sd = float(np.sqrt(left @ left / (len(x) - 2) / power))
    if not (slope < 0.0 and abs(slope) > CLEAR_SLOPE * sd):
        return
    raise DataError(
        "alignment.drives-other-way",
        file=source_of(imu),
        quantity="heading",
        slope=-slope,
        sd=sd,
        value="false" if reverse else "true",
    )
