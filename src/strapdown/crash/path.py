"""Path and attitude of the reference point near a crash, with linear covariance."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import frames, rotation
from strapdown._kernels.ned import ALT, LAT, LON, Q, V
from strapdown.constants import STANDARD_GRAVITY as GRAVITY
from strapdown.crash.entry import Entry, angles_sd
from strapdown.crash.leg import ATTITUDE, PLACE, VELOCITY, IntegrationSegment, make_leg
from strapdown.crash.reconstruction_summary import path_line
from strapdown.crash.unit_effects import SampleEffects
from strapdown.crash.window_weights import NOISE, by_contributor, window_weights
from strapdown.earth import earth_rate
from strapdown.ellipsoids import find_ellipsoid
from strapdown.errors import ConfigError, DataError
from strapdown.mechanization import NorthEastDown
from strapdown.nav_state import NavState
from strapdown.rotation import cross_matrix
from strapdown.sensors.pre_crash import Levelling
from strapdown.sensors.triad_errors import triad_of
from strapdown.tables import ACCEL, EULER, GYRO, NED
from strapdown.tables import VELOCITY as VELOCITIES

Array = NDArray[np.float64]

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
    legs : tuple of Leg
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
        systematic = np.einsum("pni,pnj->nij", self.errors, self.errors)
        return np.asarray(systematic + self.noise_covariance)

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
        """Variance contributed by each contributor at a sample.

        Parameters
        ----------
        row : int

        Returns
        -------
        DataFrame
            Indexed by contributor, columns as `ERROR`: rad², (m/s)², m². The column sums are
            the diagonal of `covariance`.

        Raises
        ------
        ConfigError
            The sample does not exist.
        """
        if not -len(self.time) <= row < len(self.time):
            raise ConfigError("crash.no-sample", quantity="row", at_row=row, count=len(self.time))
        noise = {NOISE: np.diagonal(self.noise_covariance[row])}
        return by_contributor(self.errors[:, row] ** 2, ERROR, self.contributors, noise)


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

    Returns
    -------
    CrashPath

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
    origin = entry or Entry(time=0.0, velocity=(0.0, 0.0, 0.0), heading_deg=0.0)
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
            origin,
            anchor,
            there,
            mechanization,
            zeroed_at_rest and level_time is not None,
        )
        imu = _turning(imu, begin.missing)
    names = (*effects.names, *begin.names, *(u[0] for u in origin.unknowns))
    contributors = (
        *effects.contributors,
        *begin.contributors,
        *(u[1] for u in origin.unknowns),
    )
    start = np.zeros((len(names), 9))
    start[: len(begin.errors)] = begin.errors
    if origin.unknowns:
        start[-len(origin.unknowns) :] = [u[2][:9] for u in origin.unknowns]
    q_nb = begin.state.q_nb
    start = there.carried(start, q_nb, turned=origin.attitude_deg is not None)
    state = replace(begin.state, v_n=begin.state.v_n + there.gained(q_nb))
    padded = _padded(effects, len(begin.names), [u[2][9:] for u in origin.unknowns])
    back = make_leg(mechanization, state, imu, padded, slice(first, anchor + 1), backward=True)
    ahead = make_leg(mechanization, state, imu, padded, slice(anchor, last + 1), backward=False)
    origin = replace(origin, velocity=triad_of(begin.state.v_n))
    return _joined((back, ahead), origin, names, contributors, start)


@dataclass(frozen=True, eq=False)
class _Begin:
    """State at the entry, its errors from sensors and leveling, and their names.

    Includes the rate missing from all samples, vehicle axes.
    """

    state: NavState
    names: tuple[str, ...]
    contributors: tuple[str, ...]
    errors: Array
    missing: Array


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
    origin: Entry,
    anchor: int,
    there: ToStamp,
    mechanization: NorthEastDown,
    zeroed: bool,
) -> _Begin:
    """Propagate the attitude and its errors from the leveling to the entry."""
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
            "crash.entry-speed-unknown",
            file=imu.attrs.get("source"),
            quantity="entry speed",
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
    at_entry = there.attitude_before(leg.nominal[-1, Q : Q + 4])
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


def _padded(
    effects: SampleEffects, more: int, constants: Sequence[Sequence[float]]
) -> SampleEffects:
    """Effects extended by unknowns that act on no sample, and by ones common to all samples."""
    n = len(effects.force_noise)
    each = np.array([c if len(c) else (0.0,) * 6 for c in constants]).reshape(-1, 1, 6)
    none, rest = np.zeros((more, n, 3)), np.tile(each, (1, n, 1))
    return replace(
        effects,
        force=np.concatenate([effects.force, none, rest[:, :, 3:]]),
        rate=np.concatenate([effects.rate, none, rest[:, :, :3]]),
    )


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
    """Find the first sample, the entry sample and the last sample of a path.

    Parameters
    ----------
    imu : DataFrame
    at : float, s
        Instant of the entry.
    window : (float, float), s, optional
        By default `WINDOW`, as far as recorded.

    Returns
    -------
    first, anchor, last : int
        The entry sample is the one nearest to the entry, and always within the path.

    Raises
    ------
    DataError
        The record does not contain the entry or the window.
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
    begin, end = (float(x) for x in (_usual(time, at) if window is None else window))
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


def _usual(time: Array, at: float) -> tuple[float, float]:
    """The default window as far as recorded; always contains the entry."""
    return (
        min(max(WINDOW[0], float(time[0])), at),
        max(min(WINDOW[1], float(time[-1])), at + 1e-6),
    )


# Integration from the instant of an entry to the nearest sample: at most half a step.


@dataclass(frozen=True, eq=False)
class ToStamp:
    """Motion from the instant of an entry to a sample.

    Attributes
    ----------
    length : float, s
        Negative where the sample is earlier.
    turn : ndarray, (3,), rad
        Rotation vector of the body, body axes.
    push : ndarray, (3,), m/s
        Integral of the specific force, in body axes at mid-interval.
    turn_errors, push_errors : ndarray, (p, 3)
        Effect of one standard deviation of each unknown on them.
    """

    length: float
    turn: Array
    push: Array
    turn_errors: Array
    push_errors: Array

    def attitude_before(self, q_nb: Array) -> Array:
        """Attitude at the entry from that at the sample, (4,)."""
        return rotation.compose(q_nb, rotation.quaternion_from_rotation_vector(-self.turn))

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
        """Propagate errors from the entry to the sample.

        Parameters
        ----------
        errors : ndarray, (p, 9)
            Rotation vector in local level, velocity, position; unknowns of the samples first.
        q_nb : ndarray, (4,)
            Attitude at the sample.
        turned : bool
            Whether the attitude error is that at the entry; otherwise it is that at the sample.

        Returns
        -------
        ndarray, (p, 9)
            First order. Position growth within half a step is neglected.
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
    """Integrate from an instant between two samples to one of these samples.

    Parameters
    ----------
    imu : DataFrame
        Imu table; interpolated as in `window_weights`.
    effects : SampleEffects
        On the same samples.
    instant : float, s
        Before the first or after the last sample, its values are held.
    row : int
        Of the sample.
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
        length,
        few @ imu[GYRO].to_numpy(dtype=np.float64)[near],
        few @ imu[ACCEL].to_numpy(dtype=np.float64)[near],
        np.einsum("n,pni->pi", few, effects.rate[:, near]),
        np.einsum("n,pni->pi", few, effects.force[:, near]),
    )
