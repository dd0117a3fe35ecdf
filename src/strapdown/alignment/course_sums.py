"""Effect of gyro and accelerometer errors on attitude and velocity of a drive, backward."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.alignment.inertial_sums import InertialSums, sum_increments
from strapdown.constants import Indices
from strapdown.errors import DataError
from strapdown.frames import geodetic_from_ned, ned_from_geodetic
from strapdown.sensors.rest import RestStretch, find_rests_of_every_grade, rest_between
from strapdown.sensors.uncertainty import ImuUncertainty
from strapdown.tables import (
    ACCEL,
    GEODETIC,
    GYRO,
    MOTION,
    POSITION_SD,
    VELOCITY,
    VELOCITY_SD,
    check_gnss,
    usable,
)
from strapdown.tables.checks import Array, check_rows, index_of, source_of, view_of

#: The rate at an instant is a mean over so much before and after it, s: little against the swaying
#: of a vehicle, which its antenna follows.
STEADY = 0.05


@dataclass(frozen=True, eq=False)
class DriveSums:
    """A record integrated from the fixes to its end: k fixes, m nodes, s stretches.

    `until_end` ((k,), s): from the fixes to the end of the record. `turned` ((k, 3, 3)): from the
    body axes at a fix to those at the end, in inertial space. `gained` ((k, 3), m/s): integral of
    the specific force from a fix to the end, in the axes at the end. `rate` ((k, 3), rad/s): of the
    body at the fixes, without vibration; body axes. `stretch` ((s,), s): lengths of the stretches.
    `by_gyro` ((k, 3, 21 + 3 s)): attitude error at a fix by errors of the gyros, in the axes at the
    end, rad: a bias of each axis, the nine elements (i, j) of an error of axis i in proportion to
    the rate of axis j above its mean, nine in proportion to the specific force above its mean, and
    a bias of each axis in each stretch alone. Signs: bias is reading − truth, the attitude error is
    true − computed. `by_turn` ((k, 3, 21 + 3 s)): velocity error at a fix by the same errors, in
    the axes at the end, m/s. `by_accel` ((k, 3, 12 + 3 s)): velocity error at a fix by errors of
    the accelerometers: likewise, nine in proportion to the specific force. `moved`,
    `moved_by_turn`, `moved_by_accel`: integrals over time of `gained`, `by_turn` and `by_accel`
    from a fix to the end, m.
    """

    until_end: Array
    turned: Array
    gained: Array
    rate: Array
    stretch: Array
    by_gyro: Array
    by_accel: Array
    by_turn: Array
    moved: Array
    moved_by_turn: Array
    moved_by_accel: Array


def drive_sums(imu: pd.DataFrame, time: Array, means: Array, errors: Array) -> DriveSums:
    """Integrate a record from its fixes to its end.

    `time` ((k,), s): of fixes, within the record. `means` ((6,)): of rate and force, about which
    errors in proportion to the input are counted. `errors`: the columns
    `OF_SENSORS`, which are subtracted.

    With theta the rotation from the computed attitude to the true one,
    ``C_true = exp([theta x]) C``, and the true rate and force less by db and da than taken, it is
    ``theta(t) = theta_e + int_t^e C db`` and ``v(t) = v_e - int_t^e (C f + theta x C f - C da)``.
    """
    from strapdown._kernels.motion_increments import motion_increments_linear

    stamps = index_of(imu)
    mended = _mended(view_of(imu, [*GYRO, *ACCEL]), stamps, means, errors)
    n = len(stamps) - 1
    rows = np.empty((n, len(MOTION)))
    motion_increments_linear(np.diff(stamps), mended, imu.attrs["sampling"] == "mean", rows)
    check_rows(rows, MOTION, source_of(imu))
    before = np.clip(np.searchsorted(stamps, time, side="right") - 1, 0, n - 1)
    even = np.searchsorted(stamps, np.linspace(stamps[0], stamps[-1], 2 * STRETCHES + 1)[1:-1])
    ends = np.unique(np.concatenate([before, before + 1, np.clip(even, 1, n), [n]]))
    ends = ends[ends > 0].astype(np.int64)
    sums = sum_increments(stamps, rows, ends)
    steps = rotation.rotate(sums.turned[:-1], sums.dv)
    gained = np.vstack([np.zeros((1, 3)), np.cumsum(steps, axis=0)])
    end = rotation.dcm_from_quaternion(sums.turned[-1]).T
    part = ((time - stamps[before]) / (stamps[before + 1] - stamps[before]))[:, None]
    there = gained[before] + part * steps[before]
    since = part * (stamps[before + 1] - stamps[before])[:, None]
    fallen = sums.fallen[before] + since * (gained[before] + 0.5 * part * steps[before])
    until_end = (stamps[-1] - time)[:, None]
    turn = rotation.rotation_vector_from_quaternion(
        rotation.compose(rotation.conjugate(sums.turned[before]), sums.turned[before + 1])
    )
    turned = rotation.dcm_from_quaternion(sums.turned[before])
    turned = turned @ rotation.dcm_from_rotation_vector(part * turn)
    stretch, by_gyro, by_accel, by_turn = _partials(
        sums, end, gained[np.r_[0, ends]], means - errors[:6]
    )
    nodes = np.r_[0, ends]
    edge, next_edge = np.searchsorted(nodes, before), np.searchsorted(nodes, before + 1)
    edges = sums.stamps[nodes]

    def at(values: Array) -> Array:
        """Values at the fixes, between two samples."""
        share = part[:, :, None]
        return np.asarray((1.0 - share) * values[edge] + share * values[next_edge])

    return DriveSums(
        stamps[-1] - time,
        end @ turned,
        (gained[-1] - there) @ end.T,
        _rate(sums.turned, stamps, time),
        stretch,
        at(by_gyro),
        at(by_accel),
        at(by_turn),
        (gained[-1] * until_end - (sums.fallen[-1] - fallen)) @ end.T,
        at(_integral_to_end(edges, by_turn)),
        at(_integral_to_end(edges, by_accel)),
    )


def _stretch_of(since: Array, length: float) -> Indices:
    """Index of the stretch that contains each instant; times from the beginning."""
    return np.clip((since / length * STRETCHES).astype(np.int64), 0, STRETCHES - 1)


def _mended(values: Array, stamps: Array, means: Array, errors: Array) -> Array:
    """Rates and forces with the errors subtracted."""
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
    """Lengths of the stretches, and the contribution of errors at the beginning of each node."""
    m = len(sums.node_length)
    times = end @ sums.times
    of = _stretch_of(sums.middles, sums.length)
    alone = 3 * of[:, None, None] + np.arange(3)
    nodes, axes = np.arange(m)[:, None, None], np.arange(3)[:, None]

    def above(products: Array, mean: Array) -> Array:
        out = (end @ products.reshape(m, 3, 9)).reshape(m, 3, 3, 3) - times[:, :, :, None] * mean
        return np.asarray(out.reshape(m, 3, 9))

    by_force = above(sums.pushes, means[3:])
    by_gyro, by_accel = (np.zeros((m, 3, width + 3 * STRETCHES)) for width in (21, 12))
    by_gyro[:, :, :3] = by_accel[:, :, :3] = times
    by_gyro[:, :, 3:12] = above(sums.turns, means[:3])
    by_gyro[:, :, 12:21] = by_accel[:, :, 3:12] = by_force
    by_gyro[nodes, axes, 21 + alone] = by_accel[nodes, axes, 12 + alone] = times
    at_edge = _from_end(by_gyro)
    push = np.diff(gained, axis=0) @ end.T
    by_gyro *= 0.5
    by_gyro += at_edge[1:]
    by_turn = rotation.cross_matrix(push) @ by_gyro
    stretch = np.bincount(of, sums.node_length, STRETCHES).astype(np.float64)
    return stretch, at_edge, _from_end(by_accel), _from_end(by_turn)


def _from_end(nodes: Array) -> Array:
    """Sums of nodes from the beginning of each to the end, zero at the end."""
    out = np.empty((len(nodes) + 1, *nodes.shape[1:]))
    out[-1] = 0.0
    np.cumsum(nodes[::-1], axis=0, out=out[-2::-1])
    return out


def _integral_to_end(edges: Array, values: Array) -> Array:
    """Integral over time from each edge to the last, by the trapezoidal rule."""
    steps = values[1:] + values[:-1]
    steps *= 0.5 * np.diff(edges)[:, None, None]
    return _from_end(steps)


def _rate(turned: Array, stamps: Array, time: Array) -> Array:
    """Mean rates about instants; body axes."""
    turns = rotation.compose(rotation.conjugate(turned[:-1]), turned[1:])
    steps = rotation.rotation_vector_from_quaternion(turns)
    angles = np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])
    # At the ends of a record the mean is over the available part.
    begin = np.maximum(time - STEADY, stamps[0])
    end = np.minimum(time + STEADY, stamps[-1])
    turned_by = [np.interp(end, stamps, x) - np.interp(begin, stamps, x) for x in angles.T]
    return np.asarray(np.stack(turned_by, axis=1) / (end - begin)[:, None])


# Velocities of the fixes of a drive, and the fixes with a valid course.

#: Lower bound of the standard deviation of a velocity, m/s, and of a position, m.
LEAST_SD = 1e-6
#: Positions are differentiated over the shortest of these times, s, over which the median course
#: of the moving vehicle has a third of the largest standard deviation; else over the last.
BASELINES = (1.0, 2.0, 4.0, 8.0, 12.0)
#: Vertical velocities by heights are differences over this time, s.
CLIMBS = 4.0
#: Fewer positions alone determine neither velocity nor level.
LEAST_PLACES = 4


@dataclass(frozen=True)
class Antenna:
    """Lever arm and clock of a receiver.

    `lever_arm` (m): from the inertial sensors, body axes; `lever_arm_sd` (m) of each element.
    `velocity_delay` (s): by which a stated velocity is older than its stamp. `time_offset_sd` (s):
    by which all stamps may be wrong.
    """

    lever_arm: tuple[float, float, float] = (0.0, 0.0, 0.0)
    velocity_delay: float = 0.0
    time_offset_sd: float = 0.0
    correlated_share: float = 0.0
    correlation_time: float = 1.0
    lever_arm_sd: float = 0.0

    def position_sd_factor(self, step: float, length: float) -> float:
        """Factor on positions each `step` whose changes over `length` (s) are to be fitted.

        At the frequency of one over that length Gauss-Markov errors of variance s² have the
        spectral density ``2 T s² / (1 + (2 pi T / length)²)``, white ones ``s² step``. Slower
        errors shift the path; they are left to the owner of that error.
        """
        share, time = self.correlated_share, self.correlation_time
        slow = 2.0 * time / (step * (1.0 + (2.0 * math.pi * time / length) ** 2))
        return math.sqrt(max(1.0, 1.0 - share + share * slow))


@dataclass(frozen=True, eq=False)
class CourseFixes:
    """Fixes with a velocity, or with a position alone, during an inertial record.

    `time` ((k,), s): at which the fixes hold. `velocity`, `sd` ((k, 3), m/s): North, east,
    down. The standard deviation of the last may be infinite. `fast` ((k,)): whether they are fast
    enough to have a course. `row` ((k,)): of the table, from 1. `source`: of the fixes. Of
    positions alone the velocities are differences over the time `baseline` (s), for a first guess;
    the observations are then `place`, `place_sd` ((k, 3), m): north, east, down of `origin` (deg,
    deg, m), which is near the end of the record.
    """

    time: Array
    velocity: Array
    sd: Array
    fast: NDArray[np.bool_]
    row: NDArray[np.int64]
    source: str | None
    baseline: float = 0.0
    place: Array | None = None
    place_sd: Array | None = None
    origin: Array | None = None

    def only(self, rows: NDArray[np.bool_]) -> CourseFixes:
        """Select fixes."""
        names = ["time", "velocity", "sd", "fast", "row"]
        names += [] if self.place is None else ["place", "place_sd"]
        return replace(self, **{name: getattr(self, name)[rows] for name in names})

    def independent(self) -> NDArray[np.bool_]:
        """Fixes whose velocities have no position in common."""
        at = np.floor((self.time[-1] - self.time) / max(self.baseline, 1e-9))
        return np.append(np.diff(at) != 0.0, True) if self.baseline else np.full(len(at), True)


def course_fixes(
    imu: pd.DataFrame,
    gnss: pd.DataFrame | None,
    least_speed: float,
    largest_sd: float,
    antenna: Antenna = Antenna(),
) -> CourseFixes:
    """Select the fixes of a record that ends in motion, with a velocity or a position alone.

    Positions are the observations where more fixes of the record have them alone than with a
    velocity. `least_speed` (m/s). `largest_sd` (rad): of a course by the noise of the receiver.
    `antenna`: its delay, and its correlated errors. DataError: the Gnss table is missing, it has
    fewer than two fixes with a velocity and fewer than `LEAST_PLACES` with a position during the
    record, or the last two are too slow.
    """
    if gnss is None:
        raise DataError("alignment.no-fixes-for-course", file=source_of(imu), quantity="gnss")
    check_gnss(gnss)
    source = source_of(gnss)
    first, last = float(imu.index[0]), float(imu.index[-1])
    stamps = index_of(gnss)
    velocity, sd = view_of(gnss, VELOCITY), view_of(gnss, VELOCITY_SD)
    sound = view_of(gnss, ["quality"])[:, 0] > 0.0
    measured = np.isfinite(sd[:, :2]).all(axis=1)
    placed = usable(gnss, POSITION_SD)
    time = stamps - antenna.velocity_delay
    within = (time >= first) & (time <= last)
    good = sound & within & measured
    alone = placed & ~measured & (stamps >= first) & (stamps <= last)
    if alone.sum() >= LEAST_PLACES and alone.sum() > good.sum():
        rows = np.flatnonzero(placed & (stamps >= first) & (stamps <= last))
        return _by_places(gnss, rows, antenna, last, least_speed, largest_sd)
    if good.sum() < 2:
        raise DataError(
            "alignment.too-few-fix-velocities",
            file=source,
            quantity="VN, VE",
            first=first,
            last=last,
            timely=int((sound & within).sum()),
            good=int(good.sum()),
        )
    rows = np.flatnonzero(good)
    if not np.isfinite(sd[rows, 2]).any():
        velocity, sd = _climbs(gnss, rows[placed[rows]], velocity, sd)
    time, velocity, sd = time[rows], velocity[rows], np.maximum(sd[rows], LEAST_SD)
    fast = _fast(time, velocity, sd, rows, source, least_speed, largest_sd)
    return CourseFixes(time, velocity, sd, fast, rows + 1, source)


def _climbs(gnss: pd.DataFrame, rows: Indices, velocity: Array, sd: Array) -> tuple[Array, Array]:
    """Vertical velocities by the heights, of fixes with speed and course alone."""
    if len(rows) < LEAST_PLACES:
        return velocity, sd
    time = index_of(gnss)[rows]
    down = -view_of(gnss, ["alt"])[rows, 0]
    own = np.maximum(view_of(gnss, POSITION_SD[2:])[rows, 0], LEAST_SD)
    baseline = max(CLIMBS, 2.0 * float(np.median(np.diff(time))))
    climb, climb_sd = _differences(time, down[:, None], own[:, None], baseline)
    velocity, sd = velocity.copy(), sd.copy()
    velocity[rows, 2], sd[rows, 2] = climb[:, 0], climb_sd[:, 0]
    return velocity, sd


def _by_places(
    gnss: pd.DataFrame,
    rows: Indices,
    antenna: Antenna,
    last: float,
    least_speed: float,
    largest_sd: float,
) -> CourseFixes:
    """Positions of fixes without velocities, and their differences."""
    time, geodetic = index_of(gnss)[rows], view_of(gnss, GEODETIC)[rows]
    sd = np.maximum(view_of(gnss, POSITION_SD)[rows], LEAST_SD)
    place = ned_from_geodetic(geodetic, geodetic[-1])
    step = float(np.median(np.diff(time)))
    if antenna.correlated_share > 0.0:
        sd = sd * antenna.position_sd_factor(step, float(time[-1] - time[0]))
    for baseline in np.maximum(BASELINES, 2.0 * step).tolist():
        velocity, velocity_sd = _differences(time, place, sd, baseline)
        speed = np.hypot(velocity[:, 0], velocity[:, 1])
        courses = velocity_sd[:, :2].max(axis=1) / np.maximum(speed, 1e-9)
        moving = speed >= least_speed
        if moving.any() and np.median(courses[moving]) <= largest_sd / 3.0:
            break
    # The axes are those of the end: a plane through a place a second before is tilted there.
    newest = np.median(velocity[-5:], axis=0)
    origin = geodetic_from_ned(place[-1] + newest * (last - time[-1]), geodetic[-1])
    fast = _fast(time, velocity, velocity_sd, rows, source_of(gnss), least_speed, largest_sd)
    return CourseFixes(
        time,
        velocity,
        velocity_sd,
        fast,
        rows + 1,
        source_of(gnss),
        baseline,
        ned_from_geodetic(geodetic, origin),
        sd,
        origin,
    )


def _differences(time: Array, place: Array, sd: Array, baseline: float) -> tuple[Array, Array]:
    """Velocities by differences over a time about each fix, at the ends beside it, and their sd.

    At least the two neighbors are taken.
    """
    k, end = np.arange(len(time)), len(time) - 1
    middle = np.clip(time, time[0] + 0.5 * baseline, max(time[-1] - 0.5 * baseline, time[0]))
    before = np.searchsorted(time, middle - 0.5 * baseline - 1e-6)
    after = np.searchsorted(time, middle + 0.5 * baseline + 1e-6, side="right") - 1
    before = np.minimum(before, np.maximum(k - 1, 0))
    after = np.maximum(after, np.minimum(k + 1, end))
    apart = (time[after] - time[before])[:, None]
    return (place[after] - place[before]) / apart, np.hypot(sd[after], sd[before]) / apart


def _fast(
    time: Array,
    velocity: Array,
    sd: Array,
    rows: Indices,
    source: str | None,
    least_speed: float,
    largest_sd: float,
) -> NDArray[np.bool_]:
    """Fixes fast enough for a course; DataError if the last two are not."""
    speed = np.hypot(velocity[:, 0], velocity[:, 1])
    course_sd = sd[:, :2].max(axis=1) / np.maximum(speed, 1e-9)
    fast = (speed >= least_speed) & (course_sd <= largest_sd)
    if not fast[-2:].all():
        k = len(fast) - 2 + int(np.flatnonzero(~fast[-2:])[-1])
        raise DataError(
            "alignment.vehicle-too-slow-for-course",
            file=source,
            row=int(rows[k]) + 1,
            quantity="VN, VE",
            speed=speed[k],
            time=time[k],
            sd=sd[k, :2].max(),
            course_sd_deg=np.degrees(min(course_sd[k], np.pi)),
            least_speed=least_speed,
            largest_sd_deg=np.degrees(largest_sd),
        )
    return np.asarray(fast)


# Gyro means while the fixes of a drive show the vehicle stationary.

#: A velocity within so many standard deviations counts as zero, or one below any driving speed.
CLEAR, CREEP = 4.0, 0.1
#: A shorter rest, s, determines the bias less well than the fixes of the drive.
LEAST = 1.0


@dataclass(frozen=True, eq=False)
class RestRate:
    """Mean rate of a rest.

    `time` (s): middle of the rest. `rate`, `sd` ((3,), rad/s): the mean, and its standard deviation
    as a measure of the bias at the end of the record: scatter within the rest, and bias drift
    since.
    """

    time: float
    rate: Array
    sd: Array


def rest_rates(
    imu: pd.DataFrame, fixes: CourseFixes, sensors: ImuUncertainty
) -> tuple[RestRate, ...]:
    """Find the rests of a record in which the receiver was stationary, too.

    A gyro cannot distinguish a stationary vehicle from one on a straight road; the fixes can.

    Empty if no fix lies in a rest.
    """
    speed = np.hypot(fixes.velocity[:, 0], fixes.velocity[:, 1])
    slow = speed <= np.maximum(CLEAR * fixes.sd[:, :2].max(axis=1), CREEP)
    if not slow.any():
        return ()
    # A single outlier neither ends a rest nor makes one.
    near = np.clip(np.arange(len(slow))[:, None] + np.arange(-1, 2), 0, len(slow) - 1)
    slow = slow[near].sum(axis=1) >= 2
    drift, out = sensors.gyro_drift, []
    for found in find_rests_of_every_grade(imu):
        rest = _while_slow(imu, found, fixes.time, slow)
        if rest is None:
            continue
        assert rest.gyro_mean_sd is not None
        since = float(imu.index[-1]) - 0.5 * (rest.start + rest.end)
        white = np.square(sensors.gyro.axis("noise_density")) / (rest.end - rest.start)
        sd = np.sqrt(np.maximum(np.square(rest.gyro_mean_sd), white) + drift.moved(since))
        middle = 0.5 * (rest.start + rest.end)
        out.append(RestRate(middle, np.array(rest.gyro_mean), sd))
    return tuple(out)


def _while_slow(
    imu: pd.DataFrame, rest: RestStretch, time: Array, slow: NDArray[np.bool_]
) -> RestStretch | None:
    """The longest part of a rest between stationary fixes: gyros rest on a straight road, too."""
    inside = np.flatnonzero((time >= rest.start) & (time <= rest.end))
    runs = np.split(inside, np.flatnonzero(np.diff(slow[inside].astype(np.int64))) + 1)
    runs = [run for run in runs if len(run) > 1 and slow[run[0]]]
    if not runs:
        return None
    run = max(runs, key=lambda one: float(time[one[-1]] - time[one[0]]))
    start = rest.start if run[0] == inside[0] else float(time[run[0]])
    end = rest.end if run[-1] == inside[-1] else float(time[run[-1]])
    return rest_between(imu, start, end) if end - start >= LEAST else None


# Unknowns of the least squares of a drive, in the order of their columns.

#: Stretches of a record with a noise of their own: the sum of white noise is known at their ends.
STRETCHES: Final = 24

# At the end of the record: velocity, rotation from the computed attitude to the true one, biases of
# gyros and accelerometers.
END_VELOCITY, TURN, GYRO_BIAS, ACCEL_BIAS = (slice(0, 3), slice(3, 6), slice(6, 9), slice(9, 12))
ASKED: Final = 12
# Errors of gyros in proportion to rates and to forces, of accelerometers in proportion to forces,
# elements (i, j) of axis i by input j; and of both in each stretch alone, (stretch, axis).
GYRO_MATRIX, GYRO_BY_FORCE = slice(12, 21), slice(21, 30)
GYRO_NOISE = slice(30, 30 + 3 * STRETCHES)
ACCEL_MATRIX = slice(GYRO_NOISE.stop, GYRO_NOISE.stop + 9)
ACCEL_NOISE = slice(ACCEL_MATRIX.stop, ACCEL_MATRIX.stop + 3 * STRETCHES)
# Heading minus course; distance of the unit ahead of the axle; offset of the stamps of the fixes;
# error of the lever arm.
YAW: Final = ACCEL_NOISE.stop
AXLE: Final = YAW + 1
OFFSET: Final = YAW + 2
ARM = slice(YAW + 3, YAW + 6)
COUNT: Final = YAW + 6
# Displacement at the end of the record: an unknown of positions alone.
END_PLACE = slice(COUNT, COUNT + 3)

#: In the order of `DriveSums.by_gyro` and `DriveSums.by_accel`.
OF_GYROS = np.r_[GYRO_BIAS, GYRO_MATRIX, GYRO_BY_FORCE, GYRO_NOISE]
OF_ACCELS = np.r_[ACCEL_BIAS, ACCEL_MATRIX, ACCEL_NOISE]
OF_SENSORS = slice(GYRO_BIAS.start, ACCEL_NOISE.stop)
#: Known beyond the record: all but its own noise and the unknowns of the vehicle and the fixes.
HANDED = np.r_[:ASKED, GYRO_MATRIX, GYRO_BY_FORCE, ACCEL_MATRIX]
