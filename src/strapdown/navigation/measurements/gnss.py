"""Positions and velocities of a GNSS receiver."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown._kernels.antenna import ACCELERATION, POSITION, VELOCITY, antenna
from strapdown._kernels.earth import displacement
from strapdown.errors import ConfigError, DataError
from strapdown.estimation.covariance import Observation
from strapdown.estimation.sensor_blocks import (
    gauss_markov,
    lever_arm,
    random_walk,
    time_offset,
    unseen,
)
from strapdown.estimation.sensor_states import SensorStates
from strapdown.navigation.measurements.measurement import (
    Epochs,
    TabulatedMeasurement,
    View,
    check_number,
)
from strapdown.tables import GEODETIC, GNSS, POSITION_SD, VELOCITY_SD, check_gnss
from strapdown.tables import VELOCITY as VELOCITY_COLUMNS
from strapdown.tables.checks import Array, index_of, is_number, source_of, values_of
from strapdown.tables.gnss import QUALITIES

#: Kind of an epoch: the first of its values. The last is a position that is displaced.
POSITION_CODE, VELOCITY_CODE, HORIZONTAL_CODE, DISPLACED_CODE = 0.0, 1.0, 2.0, 3.0
POSITIONS = (POSITION_CODE, DISPLACED_CODE)
PLACE = ("north, m", "east, m", "down, m")
SPEED = ("VN, m/s", "VE, m/s", "VD, m/s")
#: Beyond this, s, a time offset is a wrong clock, and the second-order arc is not valid.
LARGEST_OFFSET = 2.0
#: Correlation time of the errors of positions by code: reflections last for tens of seconds to
#: minutes, the atmosphere and orbits for longer, s.
LASTING = 100.0
#: Share of the variance of a float solution that lasts, and how long, s: wrong ambiguities are the
#: same from fix to fix until the receiver loses a signal.
FLOAT_SHARE, FLOAT_LASTING = 0.9, 30.0
#: Standard deviation of a displacement of positions before any of them, m: reflections in a town.
DISPLACEMENT_SD = 100.0
#: A velocity or acceleration is clear of its error from so many of its standard deviations.
CLEAR = 3.0
TINY = 1e-300


def _in(unit: str, default: float = 0.0) -> float:
    made: float = field(default=default, metadata={"unit": unit})
    return made


@dataclass(frozen=True)
class Gnss(TabulatedMeasurement):
    """A GNSS receiver: positions of its antenna, velocities, or both.

    A time offset as a state is modeled by the antenna's position, velocity and acceleration at the
    epoch; the neglected term is a sixth of its jerk times the offset's third power. If the
    estimated state exceeds 0.1 s, start again with the estimate as `time_offset`.

    The acceleration is that of `View.steady`. An accelerometer reading at an instant is mostly
    vibration that a receiver does not see: as acceleration, it would make every velocity falsely
    confirm a zero offset.

    Attributes
    ----------
    lever_arm : tuple of float, (3,), m
        Of the antenna from the inertial sensors, body axes.
    lever_arm_sd : float or tuple of float, (3,), m
        Its standard deviation. Above zero it is estimated: states ``NAME.lever_arm``, assumed −
        true.
    time_offset : float, s
        Time stamps of the aid minus the time of the inertial sensors: a stamp t means
        ``t - time_offset``.
    time_offset_sd : float, s
        Its standard deviation. Above zero it is estimated: state ``NAME.time_offset``, assumed −
        true.
    time_offset_drift : float, s/√s
        By which that state walks.
    clock_unsure : tuple of pairs of float, s
        Times, of the stamps, at which the clock of the receiver may have stepped, each with the
        standard deviation of that step: the state is as uncertain afterwards.
    velocity_delay : float, s
        Delay of the velocity against the position of the same row: half of the interval for a
        mean over the preceding interval.
    position_correlated_share : float
        Share of the variance of a position that lasts from fix to fix, as errors of orbits,
        atmosphere and reflections do. Above zero it is estimated: states ``NAME.position_error``,
        north, east, down, in standard deviations of that share. As white errors it would average
        out in the bounds, and not in the fixes.
    position_correlation_time : float, s
        For which it lasts: autocorrelation ``exp(-|t| / position_correlation_time)``.
    float_position_sd : float, m
        Stated horizontal standard deviation, mean of both components, from which a position is a
        float solution, whose carrier-phase ambiguities are not integers. Its errors are not those
        of fixed solutions in another size, and most of them last: states ``NAME.float_error``, in
        standard deviations of `FLOAT_SHARE`, for `FLOAT_LASTING`. Zero: none is.
    displaced : tuple of pairs of float, s
        Stretches of stamps, from the first to before the second, whose positions are all displaced
        by the same: wrong ambiguities, or a reflection. By how much is estimated: states
        ``NAME.displacement``, north, east, down, `DISPLACEMENT_SD` for each stretch.
    position_sd_factor, velocity_sd_factor : float
        Factors on the stated standard deviations.
    least_position_sd, least_velocity_sd : float, m and m/s
        Lower bounds of the standard deviations.
    qualities : tuple of int
        Fix qualities to be used, as in NMEA 0183 GGA; 6 is dead reckoning by the receiver
        without satellites.

    Raises
    ------
    ConfigError
        An option is out of range.
    """

    lever_arm: tuple[float, float, float] = field(default=(0.0, 0.0, 0.0), metadata={"unit": "m"})
    lever_arm_sd: float | tuple[float, float, float] = field(default=0.0, metadata={"unit": "m"})
    time_offset: float = _in("s")
    time_offset_sd: float = _in("s")
    time_offset_drift: float = _in("s_per_sqrt_s")
    clock_unsure: tuple[tuple[float, float], ...] = field(default=(), metadata={"unit": "s"})
    velocity_delay: float = _in("s")
    position_correlated_share: float = 0.0
    position_correlation_time: float = _in("s", LASTING)
    float_position_sd: float = _in("m")
    displaced: tuple[tuple[float, float], ...] = field(default=(), metadata={"unit": "s"})
    use_position: bool = True
    use_velocity: bool = True
    position_sd_factor: float = 1.0
    velocity_sd_factor: float = 1.0
    least_position_sd: float = _in("m")
    least_velocity_sd: float = _in("m_per_s")
    qualities: tuple[int, ...] = (1, 2, 3, 4, 5, 7, 8)

    kind: ClassVar[str] = "gnss"
    summary: ClassVar[str] = "positions and velocities of a satellite receiver"
    source: ClassVar[str] = (
        "Groves (2013), secs. 14.3.1 and 14.3.2; Chernodarov (2009), Eqs. (19), (20)"
    )
    columns: ClassVar[tuple[str, ...]] = tuple(GNSS)

    def __post_init__(self) -> None:
        arm = self.lever_arm
        if len(arm) != 3 or not all(is_number(x) and math.isfinite(x) for x in arm):
            raise ConfigError(
                "navigation.lever-arm-not-three-numbers", quantity="lever_arm", arm=arm
            )
        check_number(self, "time_offset")
        check_number(self, "time_offset_sd", low=0.0, high=LARGEST_OFFSET)
        for name in ("time_offset_drift", "velocity_delay"):
            check_number(self, name, low=0.0)
        for name in ("least_position_sd", "least_velocity_sd", "float_position_sd"):
            check_number(self, name, low=0.0)
        check_number(self, "position_correlated_share", low=0.0, high=0.999)
        check_number(self, "position_correlation_time", low=0.0, above=True)
        for name in ("position_sd_factor", "velocity_sd_factor"):
            check_number(self, name, low=1e-6)
        if not (self.use_position or self.use_velocity):
            raise ConfigError(
                "navigation.nothing-of-fixes-used", quantity="use_position, use_velocity"
            )
        if not set(self.qualities) <= set(QUALITIES) - {0}:
            raise ConfigError(
                "navigation.no-qualities-fixes", quantity="qualities", qualities=self.qualities
            )
        if self.time_offset_drift and not self.time_offset_sd:
            raise ConfigError(
                "navigation.time-offset-walks-not-estimated", quantity="time_offset_drift"
            )
        for _, sd in self.clock_unsure:
            if not 0.0 < sd <= LARGEST_OFFSET:
                raise ConfigError("navigation.clock-unsure-sd", quantity="clock_unsure", sd=sd)
        if self.clock_unsure and not self.time_offset_sd:
            raise ConfigError("navigation.time-offset-walks-not-estimated", quantity="clock_unsure")
        if not all(begin < end for begin, end in self.displaced):
            raise ConfigError(
                "navigation.displaced-not-stretches", quantity="displaced", given=self.displaced
            )
        lever_arm(self.lever_arm_sd)

    def states(self) -> tuple[SensorStates, ...]:
        """Errors of lever arm and time offset, if uncertain, and of positions that last."""
        out = []
        if np.any(np.asarray(self.lever_arm_sd) > 0.0):
            out.append(lever_arm(self.lever_arm_sd).named(self._arm))
        if self.time_offset_sd > 0.0:
            offset = time_offset(self.time_offset_sd).named(self._offset)
            out.append(random_walk(offset, self.time_offset_drift))
        if self.position_correlated_share > 0.0:
            lasting = unseen("position_error", ("north", "east", "down"), "1", 1.0)
            out.append(gauss_markov(lasting.named(self._error), self.position_correlation_time))
        if self.float_position_sd > 0.0:
            lasting = unseen("float_error", ("north", "east", "down"), "1", 1.0)
            out.append(gauss_markov(lasting.named(self._float), FLOAT_LASTING))
        if self.displaced:
            axes = ("north", "east", "down")
            beside = unseen("displacement", axes, "m", DISPLACEMENT_SD)
            out.append(beside.named(self._displacement))
        return tuple(out)

    def forgotten(self, since: float, until: float) -> list[tuple[str, float]]:
        """Return what changes at an instant: the time offset, and what displaces positions."""
        steps = [(self._offset, stamp, sd) for stamp, sd in self.clock_unsure]
        steps += [(self._displacement, stamp, DISPLACEMENT_SD) for stamp, _ in self.displaced[1:]]
        return [
            (name, sd) for name, stamp, sd in steps if since < stamp - self.time_offset <= until
        ]

    @property
    def lasts(self) -> bool:
        """As `Measurement.lasts`: with a share of the positions' errors that is correlated."""
        return self.position_correlated_share > 0.0 or self.float_position_sd > 0.0

    def lasting_sd(self, sd: Array) -> Array:
        """Return the standard deviation of the correlated errors of a position, by that stated.

        Zero of a float solution, whose errors are another state.
        """
        if self._floats(np.square(self.position_sd_factor * sd)):
            return np.zeros_like(sd)
        used = np.maximum(self.position_sd_factor * sd, self.least_position_sd)
        return np.asarray(math.sqrt(self.position_correlated_share) * used)

    @property
    def wants_steady(self) -> bool:
        """Only with an estimated time offset, which needs the acceleration."""
        return self.time_offset_sd > 0.0

    def epochs(self, table: pd.DataFrame) -> Epochs:
        """Return an epoch for each position and velocity; see `TabulatedMeasurement.epochs`.

        A velocity without a vertical component has two components.
        """
        check_gnss(table)
        stamps = index_of(table)
        time = stamps - self.time_offset
        good = np.isin(values_of(table, ["quality"])[:, 0], self.qualities)
        times, rows = [], []
        for code, used, columns, sds, delay, factor, least in (
            (
                POSITION_CODE,
                self.use_position,
                GEODETIC,
                POSITION_SD,
                0.0,
                self.position_sd_factor,
                self.least_position_sd,
            ),
            (
                VELOCITY_CODE,
                self.use_velocity,
                VELOCITY_COLUMNS,
                VELOCITY_SD,
                self.velocity_delay,
                self.velocity_sd_factor,
                self.least_velocity_sd,
            ),
        ):
            value, sd = values_of(table, columns), values_of(table, sds)
            measured = np.isfinite(sd)
            told = good & measured.all(axis=1) & used
            codes = np.full(len(value), code)
            if code == POSITION_CODE:
                value = np.column_stack([np.radians(value[:, :2]), value[:, 2]])
                for begin, end in self.displaced:
                    codes[(stamps >= begin) & (stamps < end)] = DISPLACED_CODE
            elif used:
                # Many receivers output speed and course only.
                level = good & measured[:, :2].all(axis=1) & ~measured[:, 2]
                codes[level], told = HORIZONTAL_CODE, told | level
                value, sd = np.where(measured, value, 0.0), np.where(measured, sd, np.inf)
            sd = np.maximum(factor * sd, least)
            _refuse_certain(table, told, sd, sds, code)
            times.append(time[told] - delay)
            rows.append(np.column_stack([codes, value, sd**2])[told])
        at = np.concatenate(times)
        order = np.argsort(at, kind="stable")
        return Epochs(at[order], np.concatenate(rows)[order])

    def observe(self, view: View, values: Array) -> list[Observation]:
        """Return the innovation of a position or velocity, NED: computed − measured.

        None of a displaced position without the state of its displacement.
        """
        if values[0] == DISPLACED_CODE and not view.has(self._displacement):
            return []
        arm = arm_of(view, self._arm, np.asarray(self.lever_arm))
        of_place, late_by = values[0] in POSITIONS, view.has(self._offset)
        upto = ACCELERATION if late_by else POSITION if of_place else VELOCITY
        motion = moving(view, arm, self._arm, upto)
        computed = motion[POSITION if of_place else VELOCITY]
        C_nl, variance = view.C_ln.T, values[4:]
        if late_by:
            place, velocity, acceleration = motion
            late = float(view.estimate(self._offset)[0])
            speed = velocity.after(acceleration, late)
            shift = speed if of_place else acceleration
            computed = velocity.after(acceleration, late)
            if of_place:
                computed = place.after(velocity, late).after(acceleration, 0.5 * late**2)
        z, H = C_nl @ computed.value, C_nl @ computed.H
        unclear = np.zeros(3)
        if late_by:
            of, dof = C_nl @ shift.value, C_nl @ shift.H
            by_offset, unclear = _by_offset(view, self._offset, of_place, of, dof)
            H[:, view.place(self._offset)] = -by_offset[:, None]
        if of_place:
            here, figure = view.here, view.ellipsoid
            a, e2 = figure.semi_major_axis, figure.eccentricity_squared
            z += displacement(here.lat, here.lon, here.alt, *values[1:4].tolist(), a, e2)
            error, share = self._error, self.position_correlated_share
            if self._floats(variance):
                error, share = self._float, FLOAT_SHARE
            if view.has(error):
                lasting = np.sqrt(share * variance)
                z += lasting * view.estimate(error)
                H[:, view.place(error)] = -np.diag(lasting)
                variance = (1.0 - share) * variance
            if values[0] == DISPLACED_CODE:
                z += view.estimate(self._displacement)
                H[:, view.place(self._displacement)] = -np.eye(3)
        else:
            z -= values[1:4]
        name, labels = self.names(float(values[0]))
        n = len(labels)
        return [Observation(name, z[:n], H[:n], (variance + unclear)[:n], labels)]

    def names(self, code: float) -> tuple[str, tuple[str, ...]]:
        """Return the name of the observation of an epoch, and the labels of its components."""
        if code in POSITIONS:
            return f"{self.name}.position", PLACE
        return f"{self.name}.velocity", SPEED[:2] if code == HORIZONTAL_CODE else SPEED

    @property
    def _arm(self) -> str:
        return f"{self.name}.lever_arm"

    @property
    def _offset(self) -> str:
        return f"{self.name}.time_offset"

    @property
    def _error(self) -> str:
        return f"{self.name}.position_error"

    @property
    def _float(self) -> str:
        return f"{self.name}.float_error"

    @property
    def _displacement(self) -> str:
        return f"{self.name}.displacement"

    def _floats(self, variance: Array) -> bool:
        """Whether a position with these variances, m², as used, is a float solution."""
        least = self.position_sd_factor * self.float_position_sd
        return least > 0.0 and 0.5 * float(variance[0] + variance[1]) >= least**2


def _by_offset(
    view: View, name: str, of_place: bool, shift: Array, of_shift: Array
) -> tuple[Array, Array]:
    """Derivative of what is observed by the time offset, and variance of what that leaves out.

    The derivative is the velocity (of a position) or the acceleration, and as uncertain as the
    state is. At rest it is error alone, and in steady motion its changes are: as a derivative they
    would make the errors of the state observe the offset, whose standard deviation falls falsely.
    So it stays what it was at the last epoch as far as its change is not clear of its own error;
    the rest is noise, in proportion to the offset's variance. And a velocity that the last fixes
    corrected has their errors, with which the innovation is correlated, by more than the filter
    knows where the noise of its sensors is overstated, as that of a unit that shakes is: times the
    offset, that is a drift of the offset. The latest corrections are not in it, as far as they are
    not clear of its error.

    Parameters
    ----------
    of_place : bool
        Of a position; of a velocity otherwise. Each keeps a derivative of its own.
    shift : ndarray, (3,)
        Velocity, m/s, or acceleration, m/s², north-east-down.
    of_shift : ndarray, (3, p)
        Its error by the physical errors.
    """
    P = view.covariance
    at = view.place(name).start
    own = np.einsum("ij,jk,ik->i", of_shift, P, of_shift)
    kept = f"{name}.{'velocity' if of_place else 'acceleration'}"
    before = view.kept.get(kept, np.zeros(3))
    change = shift - before
    if of_place:
        recent = view.corrected
        change = change - recent * np.minimum(1.0, CLEAR**2 * own / np.maximum(recent**2, TINY))
    clear = before + change * np.maximum(1.0 - CLEAR**2 * own / np.maximum(change**2, TINY), 0.0)
    view.kept[kept] = clear
    return clear, P[at, at] * (np.square(shift - clear) + own)


def _refuse_certain(
    table: pd.DataFrame, told: NDArray[np.bool_], sd: Array, columns: list[str], code: float
) -> None:
    certain = np.argwhere((sd == 0.0) & told[:, None])
    if len(certain):
        row, column = certain[0].tolist()
        what = "least_position_sd_m" if code == POSITION_CODE else "least_velocity_sd_m_per_s"
        raise DataError(
            "navigation.sd-zero-in-rows",
            file=source_of(table),
            row=row + 1,
            quantity=columns[column],
            count=len(np.unique(certain[:, 0])),
            what=what,
        )


# Motion of an antenna by the navigator's state, and its sensitivity to the navigator's errors.


@dataclass(frozen=True, eq=False)
class Moving:
    """A vector of the antenna in level axes, and its sensitivity to the physical errors.

    Attributes
    ----------
    value : ndarray, (3,)
    H : ndarray, (3, p)
        Its error by the physical errors, to first order.
    """

    value: Array
    H: Array

    def after(self, other: Moving, time: float) -> Moving:
        """Return this with `time` times the other added."""
        return Moving(self.value + time * other.value, self.H + time * other.H)


def arm_of(view: View, name: str, assumed: Array) -> Array:
    """Return an arm in body axes, (3,), m, minus the filter's estimate of its error."""
    return assumed - view.estimate(name) if view.has(name) else assumed


def moving(view: View, arm: Array, arm_name: str, upto: int = ACCELERATION) -> list[Moving]:
    """Return position, velocity and acceleration of the antenna relative to the body.

    Parameters
    ----------
    arm : ndarray, (3,), m
        Body axes, minus the estimate of its error.
    arm_name : str
        Name of the block of states of its error, which may be absent.
    upto : int
        `antenna.POSITION`, `VELOCITY` or `ACCELERATION`: the last that is computed.

    Returns
    -------
    list of Moving
        Position, m: the value is the arm, antenna minus body position, and H includes the position
        error, too. Velocity, m/s, and acceleration, m/s², relative to the Earth; that is of
        `View.steady`, if known.
    """
    used, stacked = view.mechanization, view.model.stacked
    felt = np.concatenate([view.rate, view.force])
    steady = felt if view.steady is None else view.without_errors(view.steady)
    value, H = np.empty((3, 3)), np.empty((3, 3, view.columns))
    antenna(
        view.level,
        used.level_up,
        view.ellipsoid.parameters(),
        arm,
        view.place(arm_name).start if view.has(arm_name) else -1,
        stacked.gyro_terms,
        stacked.accel_terms,
        felt,
        steady,
        upto,
        value,
        H,
    )
    return [Moving(value[i], H[i]) for i in range(upto + 1)]
