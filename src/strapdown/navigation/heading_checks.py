"""Independent heading check: a second solution without the first one's heading assumptions.

Small navigators process the same record in parallel, each from some instant on, with a heading
that is practically unknown there, and GNSS fixes alone. The heading of such a check comes from
the motion since then, not from the initial heading, an alignment or a heading measurement.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from strapdown import rotation
from strapdown._kernels.attitude import quaternion_advance
from strapdown.constants import MAD_TO_SD
from strapdown.ellipsoids import Ellipsoid, find_ellipsoid
from strapdown.errors import DataError, DivergenceError
from strapdown.estimation.covariance import Joseph
from strapdown.estimation.error_filter import ErrorFilter, FilterState
from strapdown.estimation.error_model import RotationVectorModel
from strapdown.estimation.robust import Igg3, RobustUpdate
from strapdown.evaluation.trajectory_differences import trajectory_at
from strapdown.frames import q_ne
from strapdown.mechanization.ned import NorthEastDown
from strapdown.mechanization.wander_azimuth import WanderAzimuth
from strapdown.navigation.consistency import ObservationConsistency
from strapdown.navigation.gyrocompass import Compass
from strapdown.navigation.heading_integrity import (
    GROWS,
    RECENT,
    SURE,
    HeadingCheck,
    doubts_of,
    seconds_of,
)
from strapdown.navigation.measurements.gnss import Gnss
from strapdown.navigation.measurements.heading import Heading
from strapdown.navigation.measurements.measurement import Epochs
from strapdown.navigation.navigator import Navigator, NavigatorState
from strapdown.navigation.pipeline import NavigationPipeline
from strapdown.navigation.preprocessing import NEAR as NEAR_FIXES
from strapdown.navigation.preprocessing import joined_steps
from strapdown.navigation.record import (
    GrowingRows,
    InnovationColumns,
    NavigationChunk,
    NavigationRecord,
    state_of_row,
)
from strapdown.rotation import euler_sd
from strapdown.sensors.uncertainty import ImuUncertainty
from strapdown.tables import EULER, TRAJECTORY, on_disk
from strapdown.tables.checks import index_of, values_of, view_of

Array = NDArray[np.float64]

#: Standard deviation of a practically unknown heading, deg; linearization fails beyond it.
UNKNOWN = 20.0
#: Lower limit of the check's heading standard deviation, deg: its steps are joined, its fixes
#: thinned.
LEAST_HEADING = 0.03
#: Factor on the run's standard deviations of all errors but the heading.
LOOSER = 2.0
#: Lower limits of the initial standard deviations: m, m/s, deg of roll and pitch.
LEAST_PLACE, LEAST_VELOCITY, LEAST_TILT = 0.1, 0.05, 0.2
#: The same for roll and pitch after the run became doubtful, deg: the tilt that a velocity change
#: at 0.2 g leaves where the heading is off by 10 deg.
DOUBTED_TILT = 2.0
#: Interval between checks, s, by which the record is processed, and once one is accurate enough.
TURN, RENEWED = 60.0, 180.0
#: Epochs over which the scatter of the innovations is judged, and the fewest needed.
JUDGED, FEWEST = 60, 8
#: Limit of a normalized innovation in the estimate of their scatter.
CLIP = 3.0
#: Stamps within this are equal, s.
NEAR = 1e-6


def run_heading_checks(
    made: HeadingChecks, record: NavigationRecord, enough: float
) -> list[HeadingCheck]:
    """Run heading checks over a record, two at a time at most.

    A new check begins each minute, and each three minutes while one is accurate enough. The older
    of two continues until the younger is accurate enough, or more accurate.

    Sensor and tilt estimates of a faulty run stay wrong long after its innovations are consistent
    again. So after a doubt, a new check starts from the sensor errors at the run's start.

    Parameters
    ----------
    enough : float, deg
        Standard deviation of a heading below which older evidence is not needed: a third of the
        limit.

    Returns
    -------
    list of HeadingCheck
        In order of `since`.
    """
    end = float(made.time[-1])
    cuts = np.arange(made.begun, end, TURN)
    seconds = np.arange(math.ceil(made.begun + NEAR), math.floor(end) + 1.0)
    places = np.clip(np.searchsorted(made.time, seconds - NEAR), 0, len(made.time) - 1)
    firsts = np.searchsorted(made.time, cuts + NEAR, side="right").tolist()
    begun = np.array([made.time[k - 1] if k else made.begun for k in firsts])
    wanted = np.unique(np.concatenate([begun, made.time[places]]))
    run = _Run.of(made.navigator.filter, record, wanted)
    done: list[_Check] = []
    heard: list[_Check] = []
    told: list[_Check] = []
    doubted, doubt = doubts_of(record, 3.0 * enough), False
    for at, first, last in zip(begun.tolist(), firsts, [*firsts[1:], len(made.time)], strict=True):
        if len(heard) > 1 and heard[-1].sd <= enough:
            heard = heard[-1:]
        youngest = at - heard[-1].since if heard else math.inf
        if youngest >= (RENEWED if heard and heard[-1].sd <= enough else TURN) - TURN / 2.0:
            if len(heard) > 1:
                heard = [min(heard, key=lambda one: one.sd)]
            # Samples since the last time: a check may last for hours.
            said = [one.evidence() for one in told if one.marks.count]
            doubt = doubt or doubted(said, at)
            for ended in told:
                if ended not in heard and ended.marks.count:
                    ended.finish()
            fresh = _Check(made, run, at, doubt)
            done.append(fresh)
            heard.append(fresh)
            told = list(heard)
        for one in heard:
            one.over(made.time[first:last], made.rows[first:last])
        on_disk.let_go_of_all()
        heard = [one for one in heard if not one.lost]
    return [one.finish() for one in done if one.result is not None or one.marks.count]


@dataclass(frozen=True, eq=False)
class _Run:
    """Input of a heading check from the run.

    Attributes
    ----------
    time : ndarray, (n,), s
        Ends of steps, of each second and of each part of the record.
    rows : ndarray, (n, 9)
        Rows of a Trajectory table.
    marks : ndarray, (m,), s
    covariance : ndarray, (m, 9, 9)
    sensors, sensors_sd : ndarray, (m, k)
        As of a `NavigationRecord`, of the sensor errors of the check.
    """

    time: Array
    rows: Array
    marks: Array
    covariance: Array
    sensors: Array
    sensors_sd: Array

    @classmethod
    def of(cls, filter_: ErrorFilter, record: NavigationRecord, time: Array) -> _Run:
        """Return what checks by a filter take at some instants."""
        ellipsoid = find_ellipsoid(filter_.mechanization.ellipsoid)
        rows = values_of(trajectory_at(record.trajectory, time, ellipsoid), TRAJECTORY)
        names = list(filter_.model.layout.labels())[9:]
        told = (view_of(table, names) for table in (record.sensors, record.sensors_sd))
        return cls(time, rows, index_of(record.sd), record.covariance, *told)


class _Check:
    """Heading check in progress."""

    def __init__(self, made: HeadingChecks, run: _Run, since: float, doubt: bool) -> None:
        self.navigator, self.run, self.since = made.navigator, run, since
        #: Times with covariances, of each second the row of the history, and innovations: as far
        #: as evidence is still to come from them.
        self.marks, self.seen = GrowingRows.of(1 + 81), GrowingRows.of(3)
        self.history = GrowingRows.of(1 + made.navigator.filter.mechanization.row)
        #: Of each second: time, difference, standard deviation, scale, covariance.
        self.found = GrowingRows.of(4 + 81)
        self.newest, self.second = since, float(math.ceil(since + NEAR))
        self.result: HeadingCheck | None = None
        self.lost = False
        state = self.navigator.begin_from(_begin(self.navigator.filter, run, since, doubt))
        later = {name: _after(since, fixes) for name, fixes in made.fixes.items()}
        self.state: NavigatorState | None = replace(state, queues={**state.queues, **later})

    @property
    def sd(self) -> float:
        """Filter standard deviation of the heading at the newest snapshot, deg."""
        if not self.marks.count:
            return math.inf
        return math.degrees(math.sqrt(max(float(self.marks.rows[-1, -1]), 0.0)))

    def over(self, time: Array, rows: Array) -> None:
        """Process steps; a diverged check gives no more results."""
        assert self.state is not None
        try:
            self.state, piece = self.navigator.advance(self.state, time, rows.copy())
        except (DivergenceError, DataError):
            self.lost = True
            return
        self._take(piece)

    def finish(self) -> HeadingCheck:
        """Return the whole result; what it was made of is not kept."""
        if self.result is None:
            self.evidence()
            self.result, self.state = _result(self.since, self.found.rows), None
            self.found = self.found.without_first(self.found.count)
        return self.result

    def _take(self, piece: NavigationChunk) -> None:
        if len(piece.marks):
            flat = piece.marks.covariance.reshape(-1, 81)
            self.marks = self.marks.and_then(np.column_stack([piece.marks.time, flat]))
        if len(piece.time):
            # The first of each second.
            seconds = np.arange(math.floor(self.newest), math.floor(piece.time[-1]) + 2.0)
            seconds = seconds[seconds - NEAR > self.newest]
            at = np.unique(piece.time.searchsorted(seconds - NEAR))
            at = at[at < len(piece.time)]
            rows = np.column_stack([piece.time[at], piece.history[at]])
            self.history, self.newest = self.history.and_then(rows), float(piece.time[-1])
        if piece.seen:
            # The vertical innovation does not observe the heading.
            rows = np.concatenate([_horizontal(of) for of in piece.seen.by_name()])
            self.seen = self.seen.and_then(rows[np.argsort(rows[:, 0], kind="stable")])

    def evidence(self) -> HeadingCheck:
        """Return the result at each second since the last call."""
        marks, history = self.marks.rows, self.history.rows
        seconds = np.arange(self.second, math.floor(marks[-1, 0]) + 1.0)
        at = np.searchsorted(marks[:, 0], seconds + NEAR, side="right") - 1
        seconds, at = seconds[at >= 0], at[at >= 0]
        if not len(seconds):
            return _result(self.since, self.found.rows[:0])
        near = np.searchsorted(history[:, 0], seconds - NEAR).clip(0, len(history) - 1)
        own = np.empty((len(near), len(TRAJECTORY)))
        rows = np.ascontiguousarray(history[near, 1:])
        self.navigator.filter.mechanization.fill_trajectory(rows, own)
        of_run = self.run.rows[np.searchsorted(self.run.time, history[near, 0] - NEAR), -1]
        covariance, scale = marks[at, 1:], self._scale(seconds)
        sd = euler_sd(own[:, 6:], covariance.reshape(-1, 9, 9)[:, 6:, 6:])[:, 2]
        sd = np.hypot(scale * sd, LEAST_HEADING)
        apart = rotation.within_half_turn(of_run - own[:, -1])
        first = self.found.count
        new = np.column_stack([seconds, apart, sd, scale, covariance])
        self.found, self.second = self.found.and_then(new), float(seconds[-1]) + 1.0
        self.marks = self.marks.without_first(int(at[-1]))
        self.history = self.history.without_first(int(near[-1]))
        self.seen = self.seen.without_first(max(self.seen.count - 2 * JUDGED, 0))
        return _result(self.since, self.found.rows[first:])

    def _scale(self, seconds: Array) -> Array:
        """Factor by which the newest innovations exceed their expected scatter and correlation."""
        seen = self.seen.rows
        upto = np.searchsorted(seen[:, 0], seconds + NEAR, side="right")
        # Fewer than a full window at the start of a check.
        u = np.concatenate([np.full((JUDGED, 2), np.nan), seen[:, 1:]])
        windows = sliding_window_view(u, JUDGED, axis=0)[upto].reshape(len(seconds), 2 * JUDGED)
        return np.where(upto < FEWEST, 1.0, _scatter(windows))


def _result(since: float, found: Array) -> HeadingCheck:
    """Result of a check, of rows of `_Check.found`."""
    time, difference, sd, scale = (on_disk.stored(found[:, k]) for k in range(4))
    covariance = on_disk.stored(found[:, 4:]).reshape(-1, 9, 9)
    return HeadingCheck(since, time, difference, sd, "motion", scale, covariance)


def _horizontal(of: InnovationColumns) -> Array:
    """Times, and innovations of two components over their expected standard deviations, (m, 3)."""
    told = of.innovations
    return np.column_stack([of.time, told.nu[:, :2] / np.sqrt(told.s[:, :2])])


def _after(time: float, fixes: Epochs) -> Epochs:
    """Return the epochs after an instant."""
    first = int(fixes.time.searchsorted(time, side="right"))
    return Epochs(fixes.time[first:], fixes.values[first:])


def _scatter(u: Array) -> Array:
    """Scatter of rows of normalized innovations, 1 or more; a few gross errors count little.

    Values that are not numbers are missing.
    """
    sizes = np.sort(np.abs(u), axis=1)
    count = np.maximum(np.isfinite(sizes).sum(axis=1), 1)
    whole = np.sqrt(np.nansum(np.minimum(sizes, CLIP) ** 2, axis=1) / count)
    halves = np.stack([(count - 1) // 2, count // 2], axis=1)
    middle = MAD_TO_SD * np.take_along_axis(sizes, halves, axis=1).mean(axis=1)
    return np.asarray(np.maximum(1.0, np.fmax(whole, middle)))


def _begin(filter_: ErrorFilter, run: _Run, at: float, doubt: bool) -> FilterState:
    """State at an instant of a run, with a practically unknown heading."""
    start = state_of_row(run.rows[int(np.searchsorted(run.time, at - NEAR))])
    k = max(int(np.searchsorted(run.marks, at + NEAR, side="right")) - 1, 0)
    # Without what the run does not estimate, as its height.
    P = LOOSER**2 * np.nan_to_num(run.covariance[k])
    P[8, :8] = P[:8, 8] = 0.0
    P[8, 8] = max(math.radians(UNKNOWN) ** 2, float(P[8, 8]))
    tilt = DOUBTED_TILT if doubt else LEAST_TILT
    P = P + np.diag(
        np.square(
            np.repeat([LEAST_PLACE, LEAST_VELOCITY, math.radians(tilt)], 3)
            * np.array([1.0] * 8 + [0.0])
        )
    )
    k = 0 if doubt else k
    whole = np.diag(np.concatenate([np.zeros(9), np.square(LOOSER * run.sensors_sd[k])]))
    whole[:9, :9] = P
    return replace(filter_.begin(replace(start, time=at), whole), sensors=np.array(run.sensors[k]))


# Filter, joined increments and thinned fixes of the heading checks.


#: Least interval between fixes, s.
FIXES_APART = 1.0
#: Latitude beyond which the local north is not used, deg.
POLAR = 85.0


@dataclass(frozen=True, eq=False)
class HeadingChecks:
    """Filter, receivers and record of the heading checks.

    Attributes
    ----------
    time : ndarray, (n,), s
        Ends of the joined steps.
    rows : ndarray, (n, 10)
        Motion increments.
    tables : mapping of str to DataFrame
        Fixes of each receiver, thinned.
    fixes : mapping of str to Epochs
        The same.
    begun : float, s
        Start of the first step.
    """

    navigator: Navigator
    time: Array
    rows: Array
    tables: Mapping[str, pd.DataFrame]
    fixes: Mapping[str, Epochs]
    begun: float


def heading_checks_of(
    filter_: ErrorFilter,
    chain: NavigationPipeline,
    imu: pd.DataFrame,
    tables: Mapping[str, pd.DataFrame],
    record: NavigationRecord,
    consistency: Mapping[str, ObservationConsistency],
) -> HeadingChecks | None:
    """Prepare the heading checks of a run.

    Parameters
    ----------
    filter_ : ErrorFilter
        Filter of the run, without the states of its measurements.
    chain : NavigationPipeline
        Pipeline of the run.
    imu : DataFrame
        Samples of the run.
    tables : mapping of str to DataFrame
        By name of the measurement.
    record : NavigationRecord
        Result of the run.
    consistency : mapping of str to ObservationConsistency
        Consistency of its innovations.

    Returns
    -------
    HeadingChecks or None
        None without a GNSS receiver: no other measurement observes a direction independently.
    """
    receivers = [aid for aid in chain.navigator.aids if type(aid) is Gnss and aid.name in tables]
    if not receivers:
        return None
    span = record.trajectory.index
    time, rows = joined_steps(chain.intake, imu, float(span[0]), float(span[-1]))
    if len(time) < 2:
        return None
    robust = filter_.rule is not None or any(_robust(aid, consistency) for aid in receivers)
    aids = tuple(_known(aid, record, robust) for aid in receivers)
    ellipsoid = filter_.mechanization.ellipsoid
    polar = record.trajectory["lat"].abs().max() > POLAR
    model = filter_.model
    small = ErrorFilter(
        (WanderAzimuth if polar else NorthEastDown)(ellipsoid=ellipsoid),
        RotationVectorModel(model.gyro_noise, model.accel_noise, model.sensors),
        Joseph(),
        None,
        step=FIXES_APART,
    )
    thinned = {aid.name: _thinned(tables[aid.name]) for aid in aids}
    fixes = {aid.name: aid.epochs(thinned[aid.name]) for aid in aids}
    begun = float(time[0] - rows[0, 0])
    own = chain.navigator
    alone = Navigator(small, aids, mark_interval=FIXES_APART, warming=own.warming, wrong=own.wrong)
    return HeadingChecks(alone, time, rows, thinned, fixes, begun)


def _known(aid: Gnss, record: NavigationRecord, robust: bool) -> Gnss:
    """A receiver with the run's final lever arm and time offset."""
    found = record.sensors.iloc[-1]
    arm = list(aid.lever_arm)
    for k, axis in enumerate("xyz"):
        arm[k] -= float(found.get(f"{aid.name}.lever_arm_{axis}", 0.0))
    offset = next(
        (float(v) for n, v in found.items() if str(n).startswith(f"{aid.name}.time_offset")), 0.0
    )
    return replace(
        aid,
        rule=(aid.rule or RobustUpdate(Igg3())) if robust else None,
        lever_arm=(arm[0], arm[1], arm[2]),
        lever_arm_sd=0.0,
        time_offset=aid.time_offset - offset,
        time_offset_sd=0.0,
        time_offset_drift=0.0,
        clock_unsure=(),
        position_correlated_share=0.0,
        float_position_sd=0.0,
    )


def _robust(aid: Gnss, consistency: Mapping[str, ObservationConsistency]) -> bool:
    """Whether the fixes of a receiver need robust weighting."""
    return aid.rule is not None or any(
        one.gross
        for name, of in consistency.items()
        if name.partition(".")[0] == aid.name
        for one in of.components
    )


def _thinned(table: pd.DataFrame) -> pd.DataFrame:
    """Rows thinned to the least interval between fixes."""
    time = index_of(table)
    cell = np.floor(time / FIXES_APART + NEAR_FIXES)
    kept = np.concatenate([[True], np.diff(cell) > 0.0]) if len(time) else np.empty(0, bool)
    out = table[kept]
    out.attrs = dict(table.attrs)
    return out


# Heading found at rest and carried forward by the gyros alone.


#: Assumed unobserved change of a gyro since, in standard deviations of its bias.
UNSEEN = 30.0
#: Longest time without an observation of the gyros, s.
LONGEST = 7200.0
#: Length of a step, or time between two, that counts as a gap, s.
GAP = 0.5


def carry_headings(
    compasses: Sequence[Compass],
    doubts: Sequence[float],
    steps: tuple[Array, Array],
    record: NavigationRecord,
    sensors: ImuUncertainty,
    ellipsoid: Ellipsoid,
) -> list[HeadingCheck]:
    """Carry headings forward, each until a later one agrees with it.

    Parameters
    ----------
    compasses : sequence of Compass
        In order of time.
    doubts : sequence of float, s
        Instants at which a gyro change was detected; headings are not carried beyond them.
    steps : tuple of ndarray
        As `joined_steps`, from the first of the compasses on.
    record : NavigationRecord
        Run that gives the position: a kilometer turns north by less than 0.02 deg.

    Notes
    -----
    Between two instants the gyros give the rotation of the body in inertial space; the Earth's
    rotation and the traveled path give that of north. The bound of such a heading combines that
    of the rest, the noise, the residual bias and the scale factors since, and the effect of a gyro
    change by `UNSEEN` standard deviations, which only another rest could reveal.
    """
    if not compasses or not len(steps[0]):
        return []
    rows = record.trajectory
    seconds = seconds_of(record)
    at = np.clip(np.searchsorted(index_of(rows), seconds - 1e-6), 0, len(rows) - 1)
    stamps, own = index_of(rows)[at], values_of(rows, EULER)[at, 2]
    carried = [_Carried(one, steps, rows, ellipsoid, sensors) for one in compasses]
    out = []
    for k, one in enumerate(carried):
        until = min(one.compass.time + LONGEST, one.unbroken)
        until = min([until, *(at for at in doubts if at > one.compass.time)])
        for later in carried[k + 1 :]:
            if later.compass.time <= until and one.agrees(later.compass):
                until = min(until, later.compass.time)
                break
        used = (seconds >= one.compass.time - 1e-6) & (seconds <= until + 1e-6)
        told = stamps[used]
        difference = np.asarray(rotation.within_half_turn(own[used] - one.heading(told)))
        bound, plain = one.bounds(told)
        out.append(
            HeadingCheck(
                one.compass.time,
                seconds[used],
                difference,
                bound / SURE,
                "gyrocompass",
                plain=plain / SURE,
            )
        )
    return [one for one in out if len(one.time)]


class _Carried:
    """Attitude of one rest, at the end of each step after it."""

    def __init__(
        self,
        compass: Compass,
        steps: tuple[Array, Array],
        rows: pd.DataFrame,
        ellipsoid: Ellipsoid,
        sensors: ImuUncertainty,
    ) -> None:
        self.compass, self.sensors = compass, sensors
        # A rest that ends within a step: the body is stationary there.
        time, increments = steps
        after = int(np.searchsorted(time, compass.time + 1e-6))
        dt = np.ascontiguousarray(increments[after:, 0])
        turns = np.ascontiguousarray(increments[after:, 1:4] - dt[:, None] * compass.gyro_bias)
        turned = np.empty((len(dt), 4))
        quaternion_advance(np.array([1.0, 0.0, 0.0, 0.0]), dt, turns, turns, turned, 0.0, 1.0)
        self.time = np.concatenate([[compass.time], time[after:]])
        # No heading is carried through a gap.
        gaps = np.flatnonzero((dt > GAP) | (np.diff(self.time) > dt + GAP))
        self.unbroken = float(self.time[gaps[0]]) if len(gaps) else math.inf
        turned = np.concatenate([[[1.0, 0.0, 0.0, 0.0]], turned])
        known = index_of(rows)
        lat, lon = np.interp(self.time, known, rows["lat"]), _longitude(self.time, rows)
        lon = lon + math.degrees(ellipsoid.rotation_rate) * (self.time - compass.time)
        q_ni = q_ne(lat, rotation.within_half_turn(lon))
        first = rotation.compose(rotation.conjugate(q_ni[0]), compass.q_nb)
        q_nb = rotation.compose(q_ni, rotation.compose(first, turned))
        heading = rotation.euler_from_quaternion(q_nb)[:, 2]
        self.unwrapped = np.degrees(np.unwrap(np.radians(heading)))
        away = np.abs(self.unwrapped - self.unwrapped[0])
        self.turned = np.radians(np.maximum.accumulate(away))

    def heading(self, time: Array) -> Array:
        """Heading at some instants, deg."""
        return np.asarray(np.interp(time, self.time, self.unwrapped))

    def bounds(self, time: Array) -> tuple[Array, Array]:
        """99 % bound of headings at some instants, deg: by the rest, and by the stated errors."""
        gyro, drift = self.sensors.gyro, self.sensors.gyro_drift
        since = np.maximum(time - self.compass.time, 0.0)
        bias = float(np.max(np.hypot(gyro.axis("bias"), drift.triad)))
        noise = float(np.max(gyro.axis("noise_density")))
        scale = float(np.max(np.hypot(gyro.axis("scale"), gyro.axis("misalignment"))))
        turned = np.interp(time, self.time, self.turned)
        chance = np.sqrt(noise**2 * since + (bias * since) ** 2 + (scale * turned) ** 2)
        unseen = UNSEEN * bias + GROWS * self.compass.unsteady
        grown = np.degrees(SURE * chance + unseen * since)
        return self.compass.bound + grown, SURE * self.compass.sd + grown

    def agrees(self, later: Compass) -> bool:
        """Whether a later rest found the carried heading."""
        at = np.array([later.time])
        there = float(rotation.euler_from_quaternion(later.q_nb)[2])
        apart = abs(float(rotation.within_half_turn(self.heading(at)[0] - there)))
        return bool(apart <= math.hypot(float(self.bounds(at)[0][0]), later.bound))


def _longitude(time: Array, rows: pd.DataFrame) -> Array:
    """Longitude at some instants, deg, also across the date line."""
    lon = np.degrees(np.unwrap(np.radians(rows["lon"].to_numpy(dtype=np.float64))))
    return np.asarray(np.interp(time, index_of(rows), lon))


# Agreement of independent heading sources: two or more confirm each other.


#: Fewest readings of a source.
FEWEST_SOURCES = 5


def agreeing_sources(
    chain: NavigationPipeline, record: NavigationRecord, carried: Sequence[HeadingCheck]
) -> list[HeadingCheck]:
    """Combine heading measurements and headings found by gyrocompassing.

    A constant error of a heading measurement is not observable from it alone, and the filter
    becomes overconfident. Independent sources, such as a magnetic compass and two antennas, or two
    antennas and the gyros' north, do not share it: the accuracy of the worse check holds while
    all agree with the run within 2.58 standard deviations. A measurement with an estimated
    misalignment does not count as a source.

    Returns
    -------
    list of HeadingCheck
        One or none.
    """
    seconds = seconds_of(record)
    told = [
        one
        for aid in chain.navigator.aids
        if isinstance(aid, Heading) and aid.misalignment_sd_deg == 0.0
        for one in [_of_aid(record, aid.name, seconds)]
        if one is not None
    ]
    if carried:
        told.append(_of_gyros(carried, seconds))
    if len(told) < 2:
        return []
    d, s = np.array([x for x, _ in told]), np.array([x for _, x in told])
    known = np.isfinite(s)
    bound = np.where(known, np.abs(d) + SURE * s, np.inf)
    own = np.interp(seconds, index_of(record.sd), record.sd["heading"])
    agree = (~known | (np.abs(d) <= SURE * np.hypot(s, own))).all(axis=0)
    good = agree & (known.sum(axis=0) >= 2)
    second = np.argsort(bound, axis=0)[1]
    column = np.arange(len(seconds))
    d, s = d[second, column], s[second, column]
    if not good.any():
        return []
    return [HeadingCheck(float(seconds[good][0]), seconds[good], d[good], s[good], "sources")]


def _of_aid(record: NavigationRecord, name: str, seconds: Array) -> tuple[Array, Array] | None:
    """Run minus measurement, and its standard deviation with a common error of all readings."""
    table = record.innovations.get(f"{name}.heading")
    if table is None or not len(table):
        return None
    time = index_of(table)
    nu, s = (np.degrees(table.iloc[:, 0]), np.degrees(np.sqrt(table.iloc[:, 1])))
    nu, s = nu.to_numpy(dtype=np.float64), s.to_numpy(dtype=np.float64)
    first = np.searchsorted(time, seconds - RECENT, side="right")
    last = np.searchsorted(time, seconds + 1e-6, side="right")
    d, sd = np.full(len(seconds), np.nan), np.full(len(seconds), np.inf)
    for k, (a, b) in enumerate(zip(first.tolist(), last.tolist(), strict=True)):
        if b - a >= FEWEST_SOURCES:
            d[k], sd[k] = np.median(nu[a:b]), np.median(s[a:b])
    return d, sd


def _of_gyros(carried: Sequence[HeadingCheck], seconds: Array) -> tuple[Array, Array]:
    """Run minus the heading carried from the newest rest, by the stated gyro errors."""
    d, sd = np.full(len(seconds), np.nan), np.full(len(seconds), np.inf)
    for one in carried:
        at = np.searchsorted(seconds, one.time - 1e-6)
        inside = at < len(seconds)
        d[at[inside]], sd[at[inside]] = one.difference[inside], one.plain[inside]
    return d, sd
