"""A second reckoning of the heading that is not told what the first one assumed of it.

Beside a run small navigators go over the same record, each from some instant on, with a heading
that is as good as unknown there, and with fixes of satellites alone. What such a witness says of
the heading it has from the motion since then: from no start, no alignment, no heading aid.
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
from strapdown.aiding.gnss import Gnss
from strapdown.constants import MAD_TO_SD
from strapdown.ellipsoids import Ellipsoid, find_ellipsoid
from strapdown.errors import DataError, DivergenceError
from strapdown.estimation.covariance import Joseph
from strapdown.estimation.error_filter import ErrorFilter, FilterState
from strapdown.estimation.error_model import RotationVectorModel
from strapdown.estimation.robust import Igg3, RobustUpdate
from strapdown.evaluation.heading_light import GROWS, SURE, doubted, seconds_of
from strapdown.evaluation.trajectory_differences import trajectory_at
from strapdown.frames import q_ne
from strapdown.mechanization.ned import NorthEastDown
from strapdown.mechanization.wander_azimuth import WanderAzimuth
from strapdown.nav_state import NavState
from strapdown.navigation.consistency import ObservationConsistency
from strapdown.navigation.navigator import Navigator, NavigatorState
from strapdown.navigation.record import CovarianceSnapshot, NavigationChunk, NavigationRecord
from strapdown.rotation.euler_angles import euler_sd
from strapdown.sensors.uncertainty import ImuUncertainty
from strapdown.systems.sins.chain import NavigationPipeline
from strapdown.systems.sins.gyrocompass import Compass
from strapdown.systems.sins.intake import NEAR as NEAR_FIXES
from strapdown.systems.sins.intake import JoinedSteps, joined_steps
from strapdown.tables import EULER, GEODETIC, VELOCITY
from strapdown.tables.checks import index_of, values_of

__all__ = [
    "LONGEST",
    "UNSEEN",
    "CarriedHeading",
    "Evidence",
    "Witnesses",
    "carry_headings",
    "hear_witnesses",
    "witnesses_of",
]


Array = NDArray[np.float64]

#: Of a heading that is as good as unknown, deg: beyond it equations of the first order are none.
UNKNOWN = 20.0
#: It knows a heading no better than this, deg: its steps are joined, its fixes thinned.
LEAST_HEADING = 0.03
#: What the run says of everything but its heading is taken so many times less well.
LOOSER = 2.0
#: Known no better than this at its start: m, m/s, deg of roll and pitch.
LEAST_PLACE, LEAST_VELOCITY, LEAST_TILT = 0.1, 0.05, 0.2
#: The same of roll and pitch of a run that was doubted, deg: what a change of velocity by 0.2 g
#: leaves in them where the heading is off by 10 deg.
DOUBTED_TILT = 2.0
#: A new witness begins so often, s, and so often where one knows enough; the record is gone over in
#: parts of the last.
TURN, RENEWED, HEARD = 60.0, 180.0, 20.0
#: Epochs over which the scatter of what a witness observes is judged, and fewest that tell.
JUDGED, FEWEST = 60, 8
#: So large an innovation counts no more.
CLIP = 3.0
#: Stamps are the same within this, s.
NEAR = 1e-6


@dataclass(frozen=True, eq=False)
class Evidence:
    """What one witness said.

    Attributes
    ----------
    since : float, s
        When it began.
    time : ndarray, (n,), s
        Seconds of the run, after `since`.
    difference : ndarray, (n,), deg
        Heading of the run less that of the witness.
    sd : ndarray, (n,), deg
        Standard deviation of the heading of the witness, times `scale`.
    scale : ndarray, (n,)
        By how much more its innovations scatter, and last, than it expected: 1 or more.
    covariance : ndarray, (n, 9, 9)
        As `NavigationRecord.covariance`, of the witness.
    kind : str
    """

    since: float
    time: Array
    difference: Array
    sd: Array
    scale: Array
    covariance: Array
    kind: str = "motion"


def hear_witnesses(made: Witnesses, record: NavigationRecord, enough: float) -> list[Evidence]:
    """Let witnesses go over a record, two at a time at most.

    A new one begins each minute, and each three minutes while one knows as much as is enough. The
    older of two is heard on until the younger knows that by itself, or knows it better.

    What was wrong with a run stays in what it believes of its sensors and of its tilt, long after
    its observations agree again. So once it was doubted, a new witness takes the sensors for what
    they were at its start.

    Parameters
    ----------
    made : Witnesses
    record : NavigationRecord
    enough : float, deg
        Standard deviation of a heading from which on older evidence is not needed: a third of the
        limit.

    Returns
    -------
    list of Evidence
        In the order of their begins.
    """
    end = float(made.time[-1])
    cuts = np.arange(made.begun, end, HEARD)
    seconds = np.arange(math.ceil(made.begun + NEAR), math.floor(end) + 1.0)
    places = np.clip(np.searchsorted(made.time, seconds - NEAR), 0, len(made.time) - 1)
    firsts = np.searchsorted(made.time, cuts + NEAR, side="right").tolist()
    begun = np.array([made.time[k - 1] if k else made.begun for k in firsts])
    wanted = np.unique(np.concatenate([begun, made.time[places]]))
    run = trajectory_at(record.trajectory, wanted, _ellipsoid(made.navigator))
    done: list[_Witness] = []
    heard: list[_Witness] = []
    told: list[_Witness] = []
    doubt = False
    for at, first, last in zip(begun.tolist(), firsts, [*firsts[1:], len(made.time)], strict=True):
        if len(heard) > 1 and heard[-1].sd <= enough:
            heard = heard[-1:]
        youngest = at - heard[-1].since if heard else math.inf
        if youngest >= (RENEWED if heard and heard[-1].sd <= enough else TURN) - HEARD / 2.0:
            if len(heard) > 1:
                heard = [min(heard, key=lambda one: one.sd)]
            if not doubt:
                said = [one.evidence() for one in told if one.marks]
                doubt = doubted(record, said, at, 3.0 * enough)
            fresh = _Witness(made, record, run, at, doubt)
            done.append(fresh)
            heard.append(fresh)
            told = list(heard)
        for one in heard:
            one.over(made.time[first:last], made.rows[first:last])
        heard = [one for one in heard if not one.lost]
    return [one.evidence() for one in done if one.marks]


class _Witness:
    """One witness on its way."""

    def __init__(
        self,
        made: Witnesses,
        record: NavigationRecord,
        run: pd.DataFrame,
        since: float,
        doubt: bool,
    ) -> None:
        self.navigator, self.run, self.since = made.navigator, run, since
        self.marks: list[CovarianceSnapshot] = []
        self.times: list[Array] = []
        self.history: list[Array] = []
        self.seen: list[tuple[float, Array]] = []
        self.lost = False
        state = self.navigator.begin_from(_begin(self.navigator.filter, record, run, since, doubt))
        for aid in self.navigator.aids:
            assert isinstance(aid, Gnss)
            table = made.tables[aid.name]
            later = table[index_of(table) > since + aid.time_offset + aid.velocity_delay]
            if len(later):
                later.attrs = dict(table.attrs)
                state = self.navigator.tell(state, aid.name, later)
        self.state: NavigatorState = state

    @property
    def sd(self) -> float:
        """Standard deviation of the heading at the newest mark, deg, as it says itself."""
        if not self.marks:
            return math.inf
        return math.degrees(math.sqrt(max(float(self.marks[-1].covariance[8, 8]), 0.0)))

    def over(self, time: Array, rows: Array) -> None:
        """Go over steps; who is lost says nothing any more."""
        try:
            self.state, piece = self.navigator.advance(self.state, time, rows.copy())
        except (DivergenceError, DataError):
            self.lost = True
            return
        self._take(piece)

    def _take(self, piece: NavigationChunk) -> None:
        self.marks += piece.marks
        self.times.append(piece.time)
        self.history.append(piece.history)
        for one in piece.seen:
            # The vertical tells nothing of a heading.
            nu, s = one.innovations.nu[:2], one.innovations.s[:2]
            self.seen.append((one.time, nu / np.sqrt(s)))

    def evidence(self) -> Evidence:
        """What it said at each second."""
        marked = np.array([mark.time for mark in self.marks])
        seconds = np.arange(math.ceil(self.since + NEAR), math.floor(marked[-1]) + 1.0)
        at = np.searchsorted(marked, seconds + NEAR, side="right") - 1
        seconds, at = seconds[at >= 0], at[at >= 0]
        covariance = np.array([self.marks[k].covariance for k in at]).reshape(-1, 9, 9)
        times, rows = np.concatenate(self.times), np.concatenate(self.history)
        near = np.clip(np.searchsorted(times, seconds - NEAR), 0, len(times) - 1)
        near, back = np.unique(near, return_inverse=True)
        own = self.navigator.filter.mechanization.trajectory(times[near], rows[near], None)
        heading = self.run["heading"].to_numpy(dtype=np.float64)
        heading = heading[np.searchsorted(index_of(self.run), times[near] - NEAR)]
        apart = rotation.within_half_turn(heading - own["heading"].to_numpy(dtype=np.float64))[back]
        euler = own[EULER].to_numpy(dtype=np.float64)[back]
        scale = self._scale(seconds)
        sd = euler_sd(euler, covariance[:, 6:, 6:])[:, 2] if len(seconds) else seconds
        sd = np.hypot(scale * sd, LEAST_HEADING)
        return Evidence(self.since, seconds, apart, sd, scale, covariance)

    def _scale(self, seconds: Array) -> Array:
        """How much more than expected its newest innovations scatter and last."""
        if not self.seen:
            return np.ones(len(seconds))
        time = np.array([t for t, _ in self.seen])
        u = np.array([x for _, x in self.seen])
        # As many epochs are looked at as there are, up to a full window.
        size = np.minimum(u.shape[0], JUDGED)
        upto = np.searchsorted(time, seconds + NEAR, side="right")
        out = np.ones(len(seconds))
        full = upto >= size
        every = sliding_window_view(u, size, axis=0).reshape(len(u) - size + 1, -1)
        if size >= FEWEST:
            out[full] = _scatter(every)[upto[full] - size]
        for k in np.flatnonzero(~full & (upto >= FEWEST)).tolist():
            out[k] = _scatter(u[: upto[k]].reshape(1, -1))[0]
        return out


def _scatter(u: Array) -> Array:
    """Scatter of rows of normalised innovations, 1 or more; a few gross errors count little."""
    whole = np.sqrt(np.minimum(u * u, CLIP**2).mean(axis=1))
    middle = MAD_TO_SD * np.median(np.abs(u), axis=1)
    return np.asarray(np.maximum(1.0, np.maximum(whole, middle)))


def _begin(
    filter_: ErrorFilter, record: NavigationRecord, run: pd.DataFrame, at: float, doubt: bool
) -> FilterState:
    """State at an instant of a run, with a heading that is as good as unknown."""
    model = filter_.model
    row = run.iloc[int(np.searchsorted(index_of(run), at - NEAR))]
    lat, lon, alt = (float(row[c]) for c in GEODETIC)
    roll, pitch, heading = (float(row[c]) for c in EULER)
    start = replace(
        NavState.from_degrees(
            lat,
            lon,
            alt,
            v_n=row[VELOCITY].to_numpy(dtype=np.float64),
            roll_deg=roll,
            pitch_deg=pitch,
            heading_deg=heading,
        ),
        time=at,
    )
    marks = record.sd.index.to_numpy(dtype=np.float64)
    k = max(int(np.searchsorted(marks, at + NEAR, side="right")) - 1, 0)
    P = LOOSER**2 * record.covariance[k]
    P[8, :8] = P[:8, 8] = 0.0
    P[8, 8] = max(math.radians(UNKNOWN) ** 2, float(P[8, 8]))
    tilt = DOUBTED_TILT if doubt else LEAST_TILT
    P = P + np.diag(
        np.square(
            np.repeat([LEAST_PLACE, LEAST_VELOCITY, math.radians(tilt)], 3)
            * np.array([1.0] * 8 + [0.0])
        )
    )
    names = list(model.layout.labels())[9:]
    k = 0 if doubt else k
    sd = LOOSER * record.sensors_sd[names].iloc[k].to_numpy(dtype=np.float64)
    whole = np.diag(np.concatenate([np.zeros(9), np.square(sd)]))
    whole[:9, :9] = P
    told = record.sensors[names].iloc[k].to_numpy(dtype=np.float64)
    return replace(filter_.begin(start, whole), sensors=told)


def _ellipsoid(navigator: Navigator) -> Ellipsoid:
    return find_ellipsoid(navigator.filter.mechanization.ellipsoid)


# What witnesses of a heading are made of: their filter, joined increments, thinned fixes.


#: Fixes are taken no denser, s.
FIXES_APART = 1.0
#: Nearer to a pole the local north is none.
POLAR = 85.0


@dataclass(frozen=True, eq=False)
class Witnesses:
    """What witnesses are made of: their filter, their receivers, and the record.

    Attributes
    ----------
    navigator : Navigator
    time : ndarray, (n,), s
        Ends of the joined steps.
    rows : ndarray, (n, 10)
        Motion increments.
    tables : mapping of str to DataFrame
        Fixes, thinned.
    begun : float, s
        Begin of the first step.
    """

    navigator: Navigator
    time: Array
    rows: Array
    tables: Mapping[str, pd.DataFrame]
    begun: float


def witnesses_of(
    filter_: ErrorFilter,
    chain: NavigationPipeline,
    imu: pd.DataFrame,
    tables: Mapping[str, pd.DataFrame],
    record: NavigationRecord,
    consistency: Mapping[str, ObservationConsistency],
) -> Witnesses | None:
    """Return what witnesses of a run are made of.

    Parameters
    ----------
    filter_ : ErrorFilter
        Of the run, without the states of its aids.
    chain : Chain
        Of the run.
    imu : DataFrame
        Its samples.
    tables : mapping of str to DataFrame
        By name of the aid.
    record : NavigationRecord
        What came of it.
    consistency : mapping of str to ObservationConsistency
        Of its innovations.

    Returns
    -------
    Witnesses or None
        None where there is no satellite receiver: nothing else tells a direction of its own.
    """
    receivers = [aid for aid in chain.navigator.aids if type(aid) is Gnss and aid.name in tables]
    if not receivers:
        return None
    span = record.trajectory.index
    steps = joined_steps(chain.intake, imu, float(span[0]), float(span[-1]))
    time, rows = steps.time, steps.rows
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
    thinned = {aid.name: _thinned(tables[aid.name]) for aid in receivers}
    begun = float(time[0] - rows[0, 0])
    return Witnesses(Navigator(small, aids, mark_interval=FIXES_APART), time, rows, thinned, begun)


def _known(aid: Gnss, record: NavigationRecord, robust: bool) -> Gnss:
    """A receiver with arm and time offset as the run found them in the end."""
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
    )


def _robust(aid: Gnss, consistency: Mapping[str, ObservationConsistency]) -> bool:
    """Whether fixes of a receiver are to be believed with care."""
    return aid.rule is not None or any(
        one.gross
        for name, of in consistency.items()
        if name.partition(".")[0] == aid.name
        for one in of.components
    )


def _thinned(table: pd.DataFrame) -> pd.DataFrame:
    """Rows that are as far apart as fixes are taken."""
    time = index_of(table)
    cell = np.floor(time / FIXES_APART + NEAR_FIXES)
    kept = np.concatenate([[True], np.diff(cell) > 0.0]) if len(time) else np.empty(0, bool)
    out = table[kept]
    out.attrs = dict(table.attrs)
    return out


# A heading that was found at rest, carried on by the gyros alone.


#: A gyro may have changed by so many standard deviations of its bias since, and nobody saw it.
UNSEEN = 30.0
#: Longer than this nobody has looked at the gyros, s.
LONGEST = 7200.0
#: A step that is so long, or so much time between two, is a gap, s.
GAP = 0.5


@dataclass(frozen=True, eq=False)
class CarriedHeading:
    """What one rest tells of the headings of a run after it; as `heading_light.Heard`.

    Attributes
    ----------
    since : float, s
        When the rest ended.
    time : ndarray, (n,), s
        Seconds of the run after it.
    difference : ndarray, (n,), deg
        Heading of the run less the carried one.
    sd : ndarray, (n,), deg
        What bounds 99 of 100 of the errors of the carried one, over `heading_light.SURE`.
    plain : ndarray, (n,), deg
        The same by what is stated of the gyros, without what the rest itself showed of them.
    kind : str
    """

    since: float
    time: Array
    difference: Array
    sd: Array
    plain: Array
    kind: str = "gyrocompass"


def carry_headings(
    compasses: Sequence[Compass],
    doubts: Sequence[float],
    steps: JoinedSteps,
    record: NavigationRecord,
    sensors: ImuUncertainty,
    ellipsoid: Ellipsoid,
) -> list[CarriedHeading]:
    """Carry headings on, each until a later one agrees with it.

    Parameters
    ----------
    compasses : sequence of Compass
        In the order of time.
    doubts : sequence of float, s
        Instants at which gyros were found to have changed: nothing is carried beyond.
    steps : JoinedSteps
        From the first of them on.
    record : NavigationRecord
        Of the run, which tells the place: a kilometre turns north by less than 0.02 deg.
    sensors : ImuUncertainty
    ellipsoid : Ellipsoid

    Returns
    -------
    list of CarriedHeading

    Notes
    -----
    From one instant to another the gyros turn the body in inertial space, and the Earth and the way
    over it turn north; nothing else is needed. The bound of such a heading is that of the rest, the
    noise, the bias that the rest left and the scale factors since, and what a change of a gyro by
    `UNSEEN` of its standard deviations adds, which nothing but another rest would show.
    """
    if not compasses or not len(steps.time):
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
            CarriedHeading(one.compass.time, seconds[used], difference, bound / SURE, plain / SURE)
        )
    return [one for one in out if len(one.time)]


class _Carried:
    """The attitude of one rest, at the end of each step after it."""

    def __init__(
        self,
        compass: Compass,
        steps: JoinedSteps,
        rows: pd.DataFrame,
        ellipsoid: Ellipsoid,
        sensors: ImuUncertainty,
    ) -> None:
        self.compass, self.sensors = compass, sensors
        # A rest that ends within a step: the body stands there.
        after = int(np.searchsorted(steps.time, compass.time + 1e-6))
        dt = np.ascontiguousarray(steps.rows[after:, 0])
        turns = np.ascontiguousarray(steps.rows[after:, 1:4] - dt[:, None] * compass.gyro_bias)
        turned = np.empty((len(dt), 4))
        quaternion_advance(np.array([1.0, 0.0, 0.0, 0.0]), dt, turns, turns, turned, 0.0, 1.0)
        self.time = np.concatenate([[compass.time], steps.time[after:]])
        # Through a gap the gyros carry nothing.
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
        """At some instants, deg."""
        return np.asarray(np.interp(time, self.time, self.unwrapped))

    def bounds(self, time: Array) -> tuple[Array, Array]:
        """Of 99 of 100 headings at some instants, deg: by the rest, and by what is stated."""
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
        """Whether a later rest found what was carried to it."""
        at = np.array([later.time])
        there = float(rotation.euler_from_quaternion(later.q_nb)[2])
        apart = abs(float(rotation.within_half_turn(self.heading(at)[0] - there)))
        return bool(apart <= math.hypot(float(self.bounds(at)[0][0]), later.bound))


def _longitude(time: Array, rows: pd.DataFrame) -> Array:
    """Longitude at some instants, deg, also over the date line."""
    lon = np.degrees(np.unwrap(np.radians(rows["lon"].to_numpy(dtype=np.float64))))
    return np.asarray(np.interp(time, index_of(rows), lon))
