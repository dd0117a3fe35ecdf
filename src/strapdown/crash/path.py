"""Path of the reference point near a crash, with linear covariance and by Monte Carlo."""

from __future__ import annotations

import math
import os
import tempfile
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import frames, rotation
from strapdown._kernels.crash_errors import grow_errors, grow_noise, perturbed_runs
from strapdown._kernels.earth import RATE
from strapdown._kernels.ned import ALT, LAT, LON, ROW, Q, V, reverse_increments
from strapdown.constants import STANDARD_GRAVITY as GRAVITY
from strapdown.constants import TWO_SIDED_95
from strapdown.crash.acceleration import NOISE, by_contributor, window_weights
from strapdown.crash.entry import Entry, angles_sd
from strapdown.crash.measuring_point import SampleEffects
from strapdown.dsp.chi_square import chi_square_quantile
from strapdown.dsp.samples import hermite
from strapdown.earth import earth_rate
from strapdown.ellipsoids import find_ellipsoid
from strapdown.errors import ConfigError, DataError, DivergenceError
from strapdown.increments import motion_increments
from strapdown.mechanization import NorthEastDown
from strapdown.nav_state import NavState
from strapdown.progress import Progress, silent
from strapdown.rotation import cross_matrix
from strapdown.sensors.pre_crash import Levelling
from strapdown.sensors.triad_errors import triad_of
from strapdown.tables import ACCEL, EULER, GYRO, MOTION, NED, POSITION_SD
from strapdown.tables import VELOCITY as VELOCITIES
from strapdown.tables.checks import Array
from strapdown.tables.on_disk import let_go, parts_of, room, tidy

# Columns of an error: rotation vector in level, velocity, position.
ATTITUDE, VELOCITY, PLACE = slice(0, 3), slice(3, 6), slice(6, 9)


@dataclass(frozen=True, eq=False)
class IntegrationSegment:
    """Increments of a segment, the effects of the unknowns on them, and the resulting states.

    A backward segment is a motion of its own, with opposite velocity on an Earth that rotates the
    other way; `errors`, `noise_covariance` and values read from `nominal` are reversed by the code
    that joins them. `time`, (k + 1,), s, is in the order of integration; `rows`, (k, 10), and
    `nominal`, (k + 1, 10), are the kernel's increments and states; `effects`, (p, 6, k): of one
    standard deviation of each unknown on angle and velocity of each step; `noise_sd`, (6, k).
    """

    backward: bool
    time: Array
    state: Array
    rows: Array
    nominal: Array
    effects: Array
    noise_sd: Array
    earth: Array
    options: Array

    def errors(self, start: Array) -> Array:
        """Propagate the errors of the unknowns from (p, 9) at the start to (p, k + 1, 9)."""
        out = np.empty((len(start), len(self.time), 9))
        theta = self.effects[:, :3].transpose(0, 2, 1)
        # An error of the rotation vector rotates the end of the step by this.
        theta = theta + 0.5 * np.cross(self.rows[:, 1:4], theta)
        grow_errors(
            self._attitude(),
            self.rows,
            self._met(start),
            np.ascontiguousarray(theta.transpose(0, 2, 1)),
            np.ascontiguousarray(self.effects[:, 3:]),
            out,
        )
        return self._met(out)

    def noise_covariance(self) -> Array:
        """Covariance from the noise of the steps, (k + 1, 9, 9)."""
        out = np.empty((len(self.time), 9, 9))
        grow_noise(
            self._attitude(),
            self.rows,
            self.noise_sd[:3].copy(),
            self.noise_sd[3:].copy(),
            np.zeros((9, 9)),
            out,
        )
        if self.backward:
            out[:, VELOCITY] *= -1.0
            out[:, :, VELOCITY] *= -1.0
        return out

    def _attitude(self) -> Array:
        return np.ascontiguousarray(rotation.dcm_from_quaternion(self.nominal[:-1, Q : Q + 4]))

    def _met(self, errors: Array) -> Array:
        """Errors in the order of integration from those of the motion, or the reverse."""
        if not self.backward:
            return np.ascontiguousarray(errors)
        met = errors.copy()
        met[..., VELOCITY] *= -1.0
        return met


def make_leg(
    mechanization: NorthEastDown,
    start: NavState,
    imu: pd.DataFrame,
    effects: SampleEffects,
    rows: slice,
    *,
    backward: bool,
) -> IntegrationSegment:
    """Cut a segment out of a record and navigate it.

    `start` is at the first sample of `rows`, or at the last where the segment runs backward; one
    sample is a segment without a step. `DivergenceError`: the path left the range of the
    mechanization.
    """
    part = imu.iloc[rows]
    part.attrs = dict(imu.attrs)
    mean = imu.attrs.get("sampling") == "mean"
    time = part.index.to_numpy(dtype=np.float64)
    state = mechanization.begin(start)
    earth = find_ellipsoid(mechanization.ellipsoid).parameters()
    steps = len(time) - 1
    increments = np.empty((steps, len(MOTION)))
    if steps:
        increments[:] = motion_increments(part)[MOTION].to_numpy(dtype=np.float64)
    theta = _over_steps(effects.rate[:, rows], time, mean)
    force = _over_steps(effects.force[:, rows], time, mean)
    dv = increments[:, 4:7]
    # Half of the rotation precedes the middle of the velocity increment.
    force = force + 0.5 * np.cross(theta, dv)
    # A sample has the same noise in the step before it: over steps it adds up as if each step
    # had the noise of one sample alone.
    noise = np.concatenate([effects.rate_noise[rows], effects.force_noise[rows]], axis=1)
    noise = noise[1:] * np.diff(time)[:, None]
    if backward:
        increments, theta, force, noise = _reversed(increments, theta, force, noise)
        earth[RATE] *= -1.0
        state[V : V + 3] *= -1.0
        time = time[::-1].copy()
    nominal = np.empty((steps + 1, ROW))
    nominal[0] = state[:ROW]
    own = state.copy()
    made, _ = mechanization.advance_rows(own, increments, np.empty(0), earth, nominal[1:])
    if made < steps:
        raise DivergenceError(
            "crash.path-leaves-vehicle-can-do",
            file=imu.attrs.get("source"),
            quantity="path",
            time=time[made],
        )
    return IntegrationSegment(
        backward,
        time,
        state,
        increments,
        nominal,
        np.ascontiguousarray(np.concatenate([theta, force], axis=2).transpose(0, 2, 1)),
        np.ascontiguousarray(noise.T),
        earth,
        mechanization.kernel_options(),
    )


def _over_steps(values: Array, time: Array, mean: bool) -> Array:
    """Integrate (p, n, 3) samples over the n - 1 steps between them."""
    dt = np.diff(time)[:, None]
    if mean:
        return np.asarray(values[:, 1:] * dt)
    return np.asarray(0.5 * (values[:, 1:] + values[:, :-1]) * dt)


def _reversed(
    increments: Array, theta: Array, force: Array, noise: Array
) -> tuple[Array, Array, Array, Array]:
    """As `reverse_increments`, including the effects on the steps."""
    out = np.empty_like(increments)
    reverse_increments(increments, out)
    if not len(increments):
        return out, theta, force, noise
    back = rotation.dcm_from_rotation_vector(-increments[:, 1:4])
    felt = np.einsum("kij,pkj->pki", back, force)
    felt -= np.cross(theta, np.einsum("kij,kj->ki", back, increments[:, 4:7]))
    return out, -theta[:, ::-1], felt[:, ::-1], noise[::-1]


# Path and attitude of the reference point near a crash, with linear covariance.


#: Columns of an error, in order.
ERROR = ["phi_n", "phi_e", "phi_d", *VELOCITIES, *NED]


@dataclass(frozen=True, eq=False)
class CrashPath:
    """Path over a window, with its linear covariance and integration segments.

    Attributes
    ----------
    time : ndarray, (n,), s
        Time from the common trigger.
    anchor : int
        Index of the sample nearest to the entry; integration runs forward and backward from it.
    entry : Entry
    table : DataFrame
        Indexed by time: ``north east down`` m, relative to the reference point at the entry;
        ``VN VE VD`` m/s; ``roll pitch heading`` deg.
    q_nb : ndarray, (n, 4)
    names, contributors : tuple of str
        Of the p unknowns, and the line of the error budget that each belongs to.
    errors : ndarray, (p, n, 9)
        Effect of one standard deviation of each on attitude (rotation vector in local level,
        rad), velocity (m/s) and position (m).
    noise_covariance : ndarray, (n, 9, 9)
        Part that is independent from sample to sample.
    start : ndarray, (p, 9)
        `errors` at the entry.
    legs : tuple of IntegrationSegment
        Backward and forward.
    """

    time: Array
    anchor: int
    entry: Entry
    table: pd.DataFrame
    q_nb: Array = field(repr=False)
    names: tuple[str, ...] = field(repr=False)
    contributors: tuple[str, ...] = field(repr=False)
    errors: Array = field(repr=False)
    noise_covariance: Array = field(repr=False)
    start: Array = field(repr=False)
    legs: tuple[IntegrationSegment, IntegrationSegment] = field(repr=False)

    def __repr__(self) -> str:
        return f"<CrashPath, {path_line(self)}>"

    @cached_property
    def covariance(self) -> Array:
        """Covariance of attitude (rad), velocity (m/s) and position (m), (n, 9, 9)."""
        by_time = np.ascontiguousarray(self.errors.transpose(1, 2, 0))
        systematic = by_time @ by_time.transpose(0, 2, 1)
        return np.asarray(systematic + self.noise_covariance)

    def positions(self, time: Array) -> Array:
        """North, east, down at instants, (k, 3), m: the cubics that match the velocities."""
        place, velocity = self.table[NED].to_numpy(), self.table[VELOCITIES].to_numpy()
        return hermite(self.time, place, velocity)(time)

    @property
    def sd(self) -> pd.DataFrame:
        """Standard deviations: ``north east down`` m, ``VN VE VD`` m/s, ``roll pitch heading`` deg.

        Angles to first order, away from a pitch of 90 deg.
        """
        root = np.sqrt(np.diagonal(self.covariance, axis1=1, axis2=2))
        angles = angles_sd(self.table[EULER], self.covariance[:, ATTITUDE, ATTITUDE])
        values = np.concatenate([root[:, PLACE], root[:, VELOCITY], angles], axis=1)
        return pd.DataFrame(values, index=self.table.index, columns=[*NED, *VELOCITIES, *EULER])

    def variances(self, row: int = -1) -> pd.DataFrame:
        """Variance by contributor at a sample, columns as `ERROR`: rad², (m/s)², m².

        The column sums are the diagonal of `covariance`. `ConfigError`: the sample does not exist.
        """
        if not -len(self.time) <= row < len(self.time):
            raise ConfigError("crash.no-sample", quantity="row", at_row=row, count=len(self.time))
        noise = {NOISE: np.diagonal(self.noise_covariance[row])}
        return by_contributor(self.errors[:, row] ** 2, ERROR, self.contributors, noise)


def at_instant(path: CrashPath, instant: float, columns: Sequence[str]) -> Array:
    """Values of columns of a path at an instant, s, linear between its samples."""
    return np.array([np.interp(instant, path.time, path.table[name]) for name in columns])


def path_line(path: CrashPath) -> str:
    """End point of a path as a line of text."""
    sd = TWO_SIDED_95 * path.sd[NED].iloc[-1].to_numpy()
    ends = ", ".join(
        f"{v:.2f} ± {s:.2f}" for v, s in zip(path.table[NED].iloc[-1], sd, strict=True)
    )
    return (
        f"path {path.time[0]:.4g} to {path.time[-1]:.4g} s, ends north, east, down {ends} m from "
        f"its entry at {path.entry.time:.4g} s"
    )


def reconstruct_path(
    imu: pd.DataFrame,
    effects: SampleEffects,
    levelling: Levelling,
    level_time: float | None,
    entry: Entry | None,
    *,
    window: Sequence[float] | None = None,
    mechanization: NorthEastDown | None = None,
    zeroed_at_rest: bool = False,
) -> CrashPath:
    """Navigate from the entry forward and backward, and propagate the uncertainty.

    Parameters
    ----------
    imu : DataFrame
        Imu table of the reference point, vehicle axes, time from the common trigger.
    effects : SampleEffects
        Effects of the unknowns, on the same samples.
    levelling : Levelling
        Roll and pitch at `level_time`.
    level_time : float, s, or None
        End of the interval used for leveling; the gyros carry the attitude from there to the
        entry. None: roll and pitch are those at the entry.
    entry : Entry or None
        None: the vehicle was stationary until `level_time`, which gives the velocity; the path
        starts at time zero, in axes of the vehicle at that time.
    window : (float, float), s, optional
        The path covers the samples within, and those from there to the entry; by default -0.1
        to 0.75 s, as far as recorded.
    mechanization : NorthEastDown, optional
    zeroed_at_rest : bool
        The mean rate up to `level_time` was subtracted as bias, and with it the Earth rate
        in the attitude at that time.

    Raises
    ------
    DataError
        The record does not contain the window or the entry, or the initial velocity is unknown.
    DivergenceError
        As `make_leg`.

    Notes
    -----
    Error = true - computed, ``C_true = (I + [phi x]) C`` (Tadic and
    Vukajlovic 2016, Eq. (20)). Heading is defined at the entry: earlier gyro errors do not
    affect it. A specific-force error df while stationary tilts the level by
    ``phi_e = df_n / g, phi_n = -df_e / g``: its horizontal part returns with the opposite sign
    and appears in the path only as far as the vehicle turns.
    """
    time = imu.index.to_numpy(dtype=np.float64)
    mechanization = mechanization or NorthEastDown()
    origin = entry or STANDING
    first, anchor, last = path_rows(imu, origin.time, window)
    # Without an entry the velocity belongs to the sample, at whatever instant.
    there = to_stamp(imu, effects, float(time[anchor]) if entry is None else origin.time, anchor)
    if origin.attitude_deg is not None:
        stated = _state(origin, *origin.attitude_deg, float(time[anchor]))
        stated = replace(stated, q_nb=there.attitude_after(stated.q_nb))
        begin = _Begin(stated, *_NOTHING)
    else:
        begin = _carried(
            imu,
            effects,
            levelling,
            level_time,
            entry,
            there,
            mechanization,
            zeroed_at_rest and level_time is not None,
        )
        imu = _turning(imu, begin.missing)
    # Unknowns of one name are one unknown.
    known = {name: k for k, name in enumerate(effects.names)}
    own = [u for u in origin.unknowns if u[0] not in known]
    names = (*effects.names, *begin.names, *(u[0] for u in own))
    contributors = (*effects.contributors, *begin.contributors, *(u[1] for u in own))
    known |= {u[0]: len(names) - len(own) + k for k, u in enumerate(own)}
    start = np.zeros((len(names), 9))
    start[: len(begin.errors)] = begin.errors
    for name, _, effect in origin.unknowns:
        start[known[name]] += effect
    q_nb = begin.state.q_nb
    start = there.carried(start, q_nb, turned=origin.attitude_deg is not None)
    state = replace(begin.state, v_n=begin.state.v_n + there.gained(q_nb))
    # Effects extended by unknowns that act on no sample.
    more = len(names) - len(effects.names)
    none = np.zeros((more, len(effects.force_noise), 3))
    padded = replace(
        effects,
        force=np.concatenate([effects.force, none]),
        rate=np.concatenate([effects.rate, none]),
    )
    back = make_leg(mechanization, state, imu, padded, slice(first, anchor + 1), backward=True)
    ahead = make_leg(mechanization, state, imu, padded, slice(anchor, last + 1), backward=False)
    origin = replace(origin, velocity=triad_of(begin.state.v_n))
    return _joined((back, ahead), origin, names, contributors, start)


@dataclass(frozen=True, eq=False)
class _Begin:
    """State at the entry, its errors from sensors and leveling, and their names."""

    state: NavState
    names: tuple[str, ...]
    contributors: tuple[str, ...]
    errors: Array
    missing: Array


#: The entry of a vehicle that was stationary, in its axes at time zero.
STANDING = Entry(time=0.0, velocity=(0.0, 0.0, 0.0), heading_deg=0.0)
_NO_NAMES: tuple[str, ...] = ()
_NOTHING = (_NO_NAMES, _NO_NAMES, np.zeros((0, 9)), np.zeros(3))


def _state(entry: Entry, roll: float, pitch: float, time: float) -> NavState:
    return NavState.from_degrees(
        entry.lat_deg,
        entry.lon_deg,
        entry.alt,
        v_n=entry.velocity,
        roll_deg=roll,
        pitch_deg=pitch,
        heading_deg=entry.heading_deg,
        time=time,
    )


def _carried(
    imu: pd.DataFrame,
    effects: SampleEffects,
    levelling: Levelling,
    level_time: float | None,
    entry: Entry | None,
    there: ToStamp,
    mechanization: NorthEastDown,
    zeroed: bool,
) -> _Begin:
    """Propagate the attitude and its errors from the leveling to the entry."""
    origin, anchor = entry or STANDING, there.row
    time = imu.index.to_numpy(dtype=np.float64)
    at = anchor if level_time is None else int(np.searchsorted(time, level_time - 1e-9))
    if at > anchor:
        raise DataError(
            "crash.vehicle-levelled-after-entry",
            file=imu.attrs.get("source"),
            quantity="entry",
            level_time=level_time,
            time=time[anchor],
        )
    if entry is None and level_time is None:
        raise DataError(
            "crash.entry-speed-unknown", file=imu.attrs.get("source"), quantity="entry speed"
        )
    still = replace(origin, velocity=(0.0, 0.0, 0.0), heading_deg=0.0)
    begin = _state(still, levelling.roll_deg, levelling.pitch_deg, float(time[at]))
    turning = earth_rate(origin.lat_deg, ellipsoid=find_ellipsoid(mechanization.ellipsoid))
    # The mean stationary rate that was subtracted contains the Earth rate.
    felt = rotation.rotate(rotation.conjugate(begin.q_nb), turning) if zeroed else np.zeros(3)
    leg = make_leg(
        mechanization, begin, _turning(imu, felt), effects, slice(at, anchor + 1), backward=False
    )
    start = np.concatenate([effects.tilt, np.zeros((len(effects.names), 6))], axis=1)
    errors = leg.errors(start)[:, -1]
    noise = leg.noise_covariance()[-1]
    back = rotation.quaternion_from_rotation_vector(-there.turn)
    at_entry = rotation.compose(leg.nominal[-1, Q : Q + 4], back)
    heading = float(rotation.euler_from_quaternion(at_entry)[2])
    turn = rotation.dcm_from_euler([0.0, 0.0, origin.heading_deg - heading])
    twist = np.kron(np.eye(3), turn)
    errors, noise = errors @ twist.T, twist @ noise @ twist.T
    velocity = turn @ leg.nominal[-1, V : V + 3] if entry is None else np.array(origin.velocity)
    # The path is expressed relative to the heading here: a heading error rotates its axes.
    own = np.eye(9)
    own[3:6, 2] = -np.cross([0.0, 0.0, 1.0], velocity)
    own[2, 2] = 0.0
    own[PLACE] = 0.0
    if entry is not None:
        own[VELOCITY] = 0.0
    errors, noise = errors @ own.T, own @ noise @ own.T
    values, vectors = np.linalg.eigh(noise)
    columns = (vectors * np.sqrt(np.maximum(values, 0.0))).T
    columns = columns[values > 1e-12 * max(values[-1], 1e-300)]
    turned = rotation.quaternion_from_dcm(turn)
    q_nb = rotation.compose(turned, leg.nominal[-1, Q : Q + 4])
    at_rest = rotation.conjugate(rotation.compose(turned, begin.q_nb))
    state = NavState(
        time=float(time[anchor]),
        lat=begin.lat,
        lon=begin.lon,
        alt=begin.alt,
        v_n=velocity,
        q_nb=q_nb,
    )
    return _Begin(
        state,
        tuple(f"noise before the entry {k + 1}" for k in range(len(columns))),
        tuple(NOISE for _ in columns),
        np.concatenate([errors, columns]),
        rotation.rotate(at_rest, turning) if zeroed else np.zeros(3),
    )


def _turning(imu: pd.DataFrame, rate: Array) -> pd.DataFrame:
    """An Imu table with a constant rate added, (3,), rad/s."""
    if not rate.any():
        return imu
    out = imu.copy()
    out.attrs = dict(imu.attrs)
    out[GYRO] += rate
    return out


def _joined(
    legs: tuple[IntegrationSegment, IntegrationSegment],
    entry: Entry,
    names: tuple[str, ...],
    contributors: tuple[str, ...],
    start: Array,
) -> CrashPath:
    back, ahead = legs
    time = np.concatenate([back.time[::-1], ahead.time[1:]])
    states = np.concatenate([_states(back)[::-1], _states(ahead)[1:]])
    anchor = len(back.time) - 1
    place = np.column_stack(
        [np.degrees(states[:, LAT]), np.degrees(states[:, LON]), states[:, ALT]]
    )
    moved = frames.place_difference(place, np.broadcast_to(place[anchor], place.shape))
    # The entry may be between two samples.
    between = 0.5 * (np.asarray(entry.velocity) + states[anchor, V : V + 3])
    moved = moved + (time[anchor] - entry.time) * between
    q_nb = states[:, Q : Q + 4]
    table = pd.DataFrame(
        np.concatenate([moved, states[:, V : V + 3], rotation.euler_from_quaternion(q_nb)], axis=1),
        index=pd.Index(time, name="time"),
        columns=[*NED, *VELOCITIES, *EULER],
    )
    errors = np.concatenate([back.errors(start)[:, ::-1], ahead.errors(start)[:, 1:]], axis=1)
    noise = np.concatenate([back.noise_covariance()[::-1], ahead.noise_covariance()[1:]])
    return CrashPath(
        time, anchor, entry, table, q_nb, names, contributors, errors, noise, start, legs
    )


def _states(leg: IntegrationSegment) -> Array:
    states = leg.nominal.copy()
    if leg.backward:
        states[:, V : V + 3] *= -1.0
    return states


# Range of samples that a path covers.


#: Default window of a path, s from the trigger: Tadic and Vukajlovic (2016).
WINDOW = (-0.1, 0.75)


def path_rows(imu: pd.DataFrame, at: float, window: Sequence[float] | None) -> tuple[int, int, int]:
    """Find the first sample, the sample nearest to the entry, and the last sample of a path.

    `at`, s, is the instant of the entry; the window is by default `WINDOW`, as far as recorded.
    `DataError`: the record does not contain the entry or the window.
    """
    time = imu.index.to_numpy(dtype=np.float64)
    slack = 1e-9 + 0.5 * float(np.median(np.diff(time))) if len(time) > 1 else 0.0
    if not time[0] - slack <= at <= time[-1] + slack:
        raise DataError(
            "crash.entry-not-within-record",
            file=imu.attrs.get("source"),
            quantity="entry",
            at=at,
            time=time[0],
            time_2=time[-1],
        )
    if window is None:
        # As far as recorded, and with the entry.
        window = (
            min(max(WINDOW[0], float(time[0])), at),
            max(min(WINDOW[1], float(time[-1])), at + 1e-6),
        )
    begin, end = (float(x) for x in window)
    if not begin < end or begin < time[0] - slack or end > time[-1] + slack:
        # Intersection of record and window, in whole ms.
        low = max(begin, math.ceil(1e3 * float(time[0])) / 1e3)
        high = min(end, math.floor(1e3 * float(time[-1])) / 1e3)
        raise DataError(
            "crash.window-partly-in-record" if low < high else "crash.window-not-in-record",
            file=imu.attrs.get("source"),
            quantity="window",
            begin=begin,
            end=end,
            first=time[0],
            last=time[-1],
            low=low,
            high=high,
        )
    anchor = int(np.argmin(np.abs(time - at)))
    first = min(int(np.searchsorted(time, begin - 1e-9)), anchor)
    last = max(int(np.searchsorted(time, end + 1e-9, side="right")) - 1, anchor)
    return first, anchor, last


# Integration from the instant of an entry to the nearest sample: at most half a step.


@dataclass(frozen=True, eq=False)
class ToStamp:
    """Motion from the instant of an entry to a sample, `row`, `length` s later (or earlier).

    `turn`, (3,), rad, rotation vector in body axes; `push`, (3,), m/s, integral of the specific
    force in body axes at mid-interval; with the effect of one standard deviation of each unknown on
    them, (p, 3).
    """

    row: int
    length: float
    turn: Array
    push: Array
    turn_errors: Array
    push_errors: Array

    def attitude_after(self, q_nb: Array) -> Array:
        """Attitude at the sample from that at the entry, (4,)."""
        return rotation.compose(q_nb, rotation.quaternion_from_rotation_vector(self.turn))

    def felt(self, q_nb: Array) -> Array:
        """Integral of the specific force in local level, (3,), m/s; `q_nb` at the sample."""
        half = rotation.quaternion_from_rotation_vector(-0.5 * self.turn)
        return rotation.rotate(rotation.compose(q_nb, half), self.push)

    def gained(self, q_nb: Array) -> Array:
        """Change of the velocity in local level, (3,), m/s; `q_nb` at the sample."""
        return np.asarray(self.felt(q_nb) + np.array([0.0, 0.0, GRAVITY * self.length]))

    def carried(self, errors: Array, q_nb: Array, *, turned: bool) -> Array:
        """Propagate errors, (p, 9), from the entry to the sample, unknowns of the samples first.

        `turned`: the attitude error is that at the entry, otherwise that at the sample. First
        order; position growth within half a step is neglected.
        """
        out, own = errors.copy(), slice(0, len(self.turn_errors))
        C = rotation.dcm_from_quaternion(q_nb)
        # phi x f, for every row.
        out[:, 3:6] += errors[:, :3] @ cross_matrix(self.felt(q_nb))
        out[own, 3:6] += self.push_errors @ C.T
        if turned:
            out[own, :3] += self.turn_errors @ C.T
        return out


def to_stamp(imu: pd.DataFrame, effects: SampleEffects, instant: float, row: int) -> ToStamp:
    """Integrate from an instant between two samples to one of these, `row`.

    Interpolated as in `window_weights`; beyond the record its first or last value is held.
    """
    time = imu.index.to_numpy(dtype=np.float64)
    length = float(time[row] - instant)
    inside = min(max(instant, float(time[0])), float(time[-1]))
    sampling = str(imu.attrs.get("sampling", "instantaneous"))
    weights = window_weights(time, inside, float(time[row]), sampling)
    weights[row] += inside - instant
    near = np.flatnonzero(weights)
    few = weights[near]
    return ToStamp(
        row,
        length,
        few @ imu[GYRO].to_numpy(dtype=np.float64)[near],
        few @ imu[ACCEL].to_numpy(dtype=np.float64)[near],
        np.einsum("n,pni->pi", few, effects.rate[:, near]),
        np.einsum("n,pni->pi", few, effects.force[:, near]),
    )


# Monte Carlo paths of one crash, with errors drawn from the error budget.


# Number of runs that share one stream of random numbers: part of the meaning of a seed,
# unlike the number of cores.
TOGETHER = 64
# Of 750 ms at 200 Hz, 11 GB of paths.
MOST_RUNS = 1_000_000
# Bytes of paths from which on they are in a file, and that are made in memory at the most.
LARGE, MOST_IN_MEMORY = 1 << 27, 1 << 31
# Streams after which memory is given back: some 40 MB of paths in a file.
STREAMS = 64


@dataclass(frozen=True, eq=False)
class PathSamples:
    """Simulated paths, as differences from the reconstructed one.

    Many runs are in an unnamed file in the folder for temporary files, of which the part in use is
    in memory; the numbers of all runs at one sample are together.

    Attributes
    ----------
    time : ndarray, (n,), s
    errors : ndarray, (runs, n, 9)
        Rotation vector in local level, rad; velocity, m/s; position, m: true minus computed,
        for the drawn errors.
    draws : ndarray, (runs, p)
        Standard normal numbers, one for each unknown of the path.
    """

    time: Array
    errors: Array = field(repr=False)
    draws: Array = field(repr=False)

    @property
    def covariance(self) -> Array:
        """About their mean, (n, 9, 9)."""
        runs, count, width = self.errors.shape
        out = np.empty((count, width, width))
        for part in parts_of(count, width * runs):
            # In the order of the runs, in which the sums are taken.
            centred = self.errors[:, part].copy(order="C")
            let_go(self.errors)
            centred -= centred.mean(axis=0)
            out[part] = np.einsum("rni,rnj->nij", centred, centred) / (runs - 1)
        return out

    def interval(self, share: float = 0.95, columns: slice = slice(None)) -> tuple[Array, Array]:
        """Bounds of the central fraction `share` of the runs, each (n, 9), or of some columns."""
        edges = [0.5 * (1.0 - share), 1.0 - 0.5 * (1.0 - share)]
        runs, count, _ = self.errors.shape
        values = self.errors[:, :, columns].transpose(2, 1, 0)
        out = np.empty((2, count, len(values)))
        for part in parts_of(count, runs):
            for column, rows in enumerate(values):
                out[:, part, column] = np.quantile(rows[part], edges, axis=1)
                let_go(self.errors)
        return out[0], out[1]


@dataclass(frozen=True, eq=False)
class PathStream:
    """Numbers of one stream of runs.

    `draws`, (r, p): standard normal numbers, one for each unknown of the path. `noise`, (TOGETHER,
    6, k): of each segment of the path: standard normal numbers for angle and velocity of each step.
    `generator`: gives what follows them in the stream.
    """

    draws: Array
    noise: tuple[NDArray[np.float32], ...]
    generator: np.random.Generator


@dataclass(frozen=True, eq=False)
class PathSampler:
    """Monte Carlo runs of a path, stream by stream: a stream depends on seed and number alone.

    `rows`: samples of the path at which the runs are wanted, increasing; by default all.
    """

    path: CrashPath
    seed: int
    rows: Sequence[int] | None = None

    def stream(self, number: int, out: Array) -> PathStream:
        """Draw the first runs of a stream and navigate them.

        `out`, (r, m, 9), takes their errors, as `PathSamples.errors`, at the `rows`; r is at most
        `TOGETHER`.
        """
        generator = np.random.Generator(
            np.random.SFC64(np.random.SeedSequence(self.seed, spawn_key=(number,)))
        )
        draws = generator.standard_normal((TOGETHER, len(self.path.names)))[: len(out)]
        noises = []
        for leg, part, kept, active, start, effects, used in self._legs:
            # Single precision suffices for noise and halves the memory.
            noise = generator.standard_normal((TOGETHER, 6, len(leg.rows)), dtype=np.float32)
            noises.append(noise)
            if not len(kept):
                continue
            view = out[:, part]
            perturbed_runs(
                leg.state,
                leg.rows,
                leg.nominal,
                start,
                effects,
                used,
                leg.noise_sd,
                np.ascontiguousarray(draws[:, active]),
                noise,
                leg.earth,
                leg.options,
                kept,
                view,
            )
            if leg.backward:
                view[..., VELOCITY] *= -1.0
        return PathStream(draws, tuple(noises), generator)

    @cached_property
    def _legs(self) -> list[tuple[Any, ...]]:
        """Each segment, which of the `rows` it has and after how many steps, and its unknowns."""
        path = self.path
        rows = np.arange(len(path.time)) if self.rows is None else np.asarray(self.rows)
        out: list[tuple[Any, ...]] = []
        for leg in path.legs:
            start = path.start.copy()
            if leg.backward:
                start[:, VELOCITY] *= -1.0
                part = slice(0, int(np.searchsorted(rows, path.anchor, side="right")))
            else:
                part = slice(int(np.searchsorted(rows, path.anchor)), len(rows))
            used = np.abs(leg.effects).max(axis=2, initial=0.0) > 0.0
            active = (np.abs(start).max(axis=1) > 0.0) | (used.sum(axis=1) > 0)
            out.append(
                (
                    leg,
                    part,
                    np.abs(rows[part] - path.anchor).astype(np.int64),
                    active,
                    start[active],
                    np.ascontiguousarray(leg.effects[active]),
                    np.ascontiguousarray(used[active]),
                )
            )
        return out


def sample_paths(
    path: CrashPath,
    *,
    runs: int = 10_000,
    seed: int = 0,
    workers: int | None = None,
    progress: Progress = silent,
) -> PathSamples:
    """Draw Monte Carlo paths.

    The same unknowns with the same standard deviations as in the linear covariance are drawn and
    applied to start and increments, and each path is navigated in full.

    Parameters
    ----------
    path : CrashPath
    runs : int
        Up to a million, in 72 bytes of the disk a sample of each; memory does not grow with them.
    seed : int
        The same seed gives bitwise the same runs on any number of cores; a larger number of
        runs extends a smaller one with the same seed.
    workers : int, optional
        Threads; by default all cores.
    progress : callable, optional
        Called with a stage and the share that is done.

    Raises
    ------
    ConfigError
        `runs` is less than 2, too large, or more than the disk has room for; or a seed or a number
        of workers is not valid.
    """
    _check(path, runs, seed, workers)
    unknowns = len(path.names)
    numbers = 9 * len(path.time)
    kept = _room(runs, numbers + unknowns)
    errors = kept[:numbers, :runs].T.reshape(runs, -1, 9)
    draws = kept[numbers:, :runs].T
    sampler = PathSampler(path, seed)

    def chunk(number: int) -> None:
        rows = slice(number * TOGETHER, min((number + 1) * TOGETHER, runs))
        draws[rows] = sampler.stream(number, errors[rows]).draws
        if (number + 1) % STREAMS == 0:
            let_go(kept)

    chunks = range((runs + TOGETHER - 1) // TOGETHER)
    with ThreadPoolExecutor(workers or os.cpu_count()) as pool:
        for number, _ in enumerate(pool.map(chunk, chunks), start=1):
            if number % STREAMS == 0:
                progress("drawing possible paths", number / len(chunks))
    tidy()
    return PathSamples(path.time, errors, draws)


def _room(runs: int, numbers: int) -> Array:
    """Room for so many numbers of each run, (numbers, at least runs)."""
    # A run writes all its numbers. Were their distance even in lines of the cache, they would share
    # a few places there.
    width = 8 * (math.ceil(runs / 8) | 1)
    try:
        return room((numbers, width), large=LARGE, most=MOST_IN_MEMORY)
    except MemoryError:
        raise ConfigError(
            "crash.runs-have-no-place",
            quantity="runs",
            runs=runs,
            size=8e-9 * numbers * width,
            folder=tempfile.gettempdir(),
        ) from None


def _check(path: object, runs: object, seed: object, workers: object) -> None:
    if not isinstance(path, CrashPath):
        raise ConfigError("crash.path-of-wrong-type", quantity="path", name=type(path).__name__)
    whole = int | np.integer
    if not (isinstance(runs, whole) and 2 <= runs <= MOST_RUNS):
        raise ConfigError(
            "crash.runs-out-of-range", quantity="runs", runs=runs, most_runs=MOST_RUNS
        )
    for name, given, least in (("seed", seed, 0), ("workers", workers, 1)):
        if name == "workers" and given is None:
            continue
        if not (isinstance(given, whole) and given >= least):
            raise ConfigError("crash.count-not-whole", quantity=name, given=given, least=least)


# A reconstructed path against a reference: cameras, or the truth of a simulation.


@dataclass(frozen=True, eq=False)
class PathComparison:
    """Reconstructed minus reference path.

    Attributes
    ----------
    errors : DataFrame
        ``north east down``, m, indexed by the reference's instants, s.
    bound : DataFrame
        Half width of the 95 % interval of such errors, m: path and reference together.
    rms, largest : tuple of float, m
        Over the instants, per axis; the largest by size.
    within : tuple of float
        Fraction of the instants at which the error is within the bound. Errors of neighboring
        instants are highly correlated, so the instants are not independent trials.
    chi_square : float
        For the three components at the last instant, to compare with `chi_square_95`.
    chi_square_95 : float
        95 % limit for three degrees of freedom.
    consistent : bool
        Whether the chi-square of the last instant is below the limit.
    """

    errors: pd.DataFrame = field(repr=False)
    bound: pd.DataFrame = field(repr=False)
    rms: tuple[float, float, float]
    largest: tuple[float, float, float]
    within: tuple[float, float, float]
    chi_square: float
    chi_square_95: float

    @property
    def consistent(self) -> bool:
        """Whether the covariances are consistent with the last error."""
        return self.chi_square <= self.chi_square_95


def compare_with_reference(path: CrashPath, reference: pd.DataFrame) -> PathComparison:
    """Compare a path with a reference.

    Parameters
    ----------
    path : CrashPath
    reference : DataFrame
        Indexed by time from the common trigger, s; ``north east down`` of the same point, m, in
        the axes of the path, from any origin: it is shifted so that both agree at the entry. With
        ``north_sd east_sd down_sd``, m, where it is not exact.

    Returns
    -------
    PathComparison
        At the reference's instants within the path. The path is interpolated by the cubic that
        matches its velocities, so that a reference of 1000 frames a second is not compared with
        chords.

    Raises
    ------
    DataError
        A column is missing, a value is not finite, or the two do not share the entry and at
        least one instant after it.
    """
    if not isinstance(reference, pd.DataFrame):
        raise DataError(
            "crash.reference-of-wrong-type",
            quantity="reference path",
            name=type(reference).__name__,
        )
    time, values, sd = _columns(reference)
    inside = (time >= path.time[0] - 1e-9) & (time <= path.time[-1] + 1e-9)
    entry = path.entry.time
    if not (inside.any() and time[0] <= entry + 1e-9 and time[inside][-1] > entry):
        raise DataError(
            "crash.path-entry",
            file=reference.attrs.get("source"),
            quantity="reference path",
            time=time[0],
            time_2=time[-1],
            time_3=path.time[0],
            time_4=path.time[-1],
            entry=entry,
        )
    origin = np.array([np.interp(entry, time, values[:, k]) for k in range(3)])
    at_origin = np.array([np.interp(entry, time, sd[:, k]) for k in range(3)])
    origin = origin - path.positions(np.array([entry]))[0]
    difference = path.positions(time[inside]) - (values[inside] - origin)
    place = path.covariance[:, PLACE, PLACE].reshape(len(path.time), 9)
    rows = np.column_stack([np.interp(time[inside], path.time, place[:, k]) for k in range(9)])
    # The reading at the origin is a further independent one.
    own_noise = sd[inside] ** 2 + at_origin**2
    covariance = rows.reshape(-1, 3, 3) + np.einsum("ni,ij->nij", own_noise, np.eye(3))
    bound = TWO_SIDED_95 * np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
    largest = difference[np.abs(difference).argmax(axis=0), range(3)]
    index = pd.Index(time[inside], name="time")
    return PathComparison(
        pd.DataFrame(difference, index=index, columns=NED),
        pd.DataFrame(bound, index=index, columns=NED),
        triad_of(np.sqrt((difference**2).mean(axis=0))),
        triad_of(largest),
        triad_of((np.abs(difference) <= bound).mean(axis=0)),
        float(difference[-1] @ np.linalg.pinv(covariance[-1]) @ difference[-1]),
        chi_square_quantile(0.95, 3),
    )


def _columns(reference: pd.DataFrame) -> tuple[Array, Array, Array]:
    some = any(c in reference.columns for c in POSITION_SD)
    wanted = [*NED, *(POSITION_SD if some else ())]
    missing = [c for c in wanted if c not in reference.columns]
    if missing:
        raise DataError(
            "crash.no-column",
            file=reference.attrs.get("source"),
            quantity="reference path",
            missing=missing,
        )
    try:
        time = reference.index.to_numpy(dtype=np.float64)
        both = reference[wanted].to_numpy(dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise DataError(
            "crash.not-all-numbers",
            file=reference.attrs.get("source"),
            quantity="reference path",
            error=error,
        ) from None
    values, sd = both[:, :3], both[:, 3:] if some else np.zeros((len(both), 3))
    bad = ~(np.isfinite(values).all(axis=1) & np.isfinite(sd).all(axis=1) & np.isfinite(time))
    stuck = np.r_[False, np.diff(time) <= 0.0]
    for code, rows in (
        ("crash.reference-not-finite", bad),
        ("crash.reference-sd-negative", (sd < 0.0).any(axis=1)),
        ("crash.reference-time-does-not-advance", stuck),
    ):
        if rows.any():
            raise DataError(
                code,
                file=reference.attrs.get("source"),
                row=int(np.argmax(rows)) + 1,
                quantity="reference path",
            )
    if not len(time):
        raise DataError(
            "crash.no-rows", file=reference.attrs.get("source"), quantity="reference path"
        )
    return time, values, sd
