"""Interface of the orientation filters, and their run over a record or sample by sample."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field, fields, replace
from math import cos, isfinite, radians, sin
from typing import Any, ClassVar, NoReturn, Self

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from strapdown import rotation
from strapdown._kernels import orientation as kernel
from strapdown._kernels.compilation import ARGUMENT_ERRORS
from strapdown._kernels.increments import LARGEST
from strapdown.attitude_algorithms.algorithm import refuse_sample
from strapdown.constants import Array
from strapdown.errors import ConfigError, DataError, DivergenceError
from strapdown.tables import ACCEL, GYRO, MAG, check_sampling_kind
from strapdown.tables.checks import values_of

_MISSING = np.full(3, np.nan)


@dataclass(frozen=True)
class OrientationEstimator(ABC):
    """One orientation filter with its options; stateless.

    Attributes
    ----------
    name, title, source, summary : str
        The word for it on the command line, in a report, its publication, and what it does.
    size : int
        Numbers of the record.
    row : int
        Numbers of a row of the history; the first four are the quaternion.
    declination : float, deg
        Of magnetic north, east positive: added to headings found with a magnetometer.
    advance_kernel, update_kernel : callable
        The compiled loop over many samples, and one sample.
    may_be_zero : tuple of str
        Options with a meaning at zero; every other one is positive.
    """

    name: ClassVar[str]
    title: ClassVar[str]
    source: ClassVar[str]
    summary: ClassVar[str]
    size: ClassVar[int]
    row: ClassVar[int]
    advance_kernel: ClassVar[Any]
    update_kernel: ClassVar[Callable[..., Any]]
    may_be_zero: ClassVar[tuple[str, ...]] = ()

    declination: float = 0.0

    def __post_init__(self) -> None:
        for option in fields(self):
            value = getattr(self, option.name)
            if option.name == "declination":
                allowed = abs(value) <= 180.0
            else:
                zero = value == 0.0 and option.name in self.may_be_zero
                allowed = isfinite(value) and (value > 0.0 or zero)
            if not allowed:
                raise ConfigError(
                    "attitude.filter-option-out-of-range",
                    quantity=f"{self.name}:{option.name}",
                    value=value,
                )

    @abstractmethod
    def kernel_options(self) -> tuple[float, ...]:
        """Return at most five options for the kernels, as numbers."""

    def begin(self, q_nb: ArrayLike | None = None, sampling: str = "instantaneous") -> Array:
        """Return the record before the first sample.

        Parameters
        ----------
        q_nb : array_like, (4,), optional
            Initial attitude. By default the first usable specific force levels the body, with
            heading zero. The first magnetometer sample replaces the heading in both cases.
        sampling : {'instantaneous', 'mean'}
            Whether a sample is the value at its stamp or the mean over the step that ends there.

        Returns
        -------
        ndarray, (size,)

        Raises
        ------
        ConfigError
            `sampling` is unknown.
        DataError
            `q_nb` is not a rotation.
        """
        check_sampling_kind(sampling)
        record = np.zeros(self.size)
        record[kernel.Q : kernel.Q + 4] = (
            (1.0, 0.0, 0.0, 0.0) if q_nb is None else rotation.normalise(q_nb)
        )
        record[kernel.LEVELED] = float(q_nb is not None)
        record[kernel.MEAN] = float(sampling == "mean")
        options = self.kernel_options()
        record[kernel.OPTIONS : kernel.OPTIONS + len(options)] = options
        self.begin_state(record, q_nb is not None)
        return record

    def begin_state(self, record: Array, given: bool) -> None:
        """Set what the filter has beyond the common part of the record."""
        return

    def row_of(self, record: Array) -> Array:
        """Row of the history, (row,), of a record."""
        row: Array = record[kernel.Q : kernel.Q + 4]
        return row

    def covariance(self, history: Array, record: Array) -> Array | None:
        """Covariance of the attitude error in north-east-down, (n, 3, 3), rad², or None."""
        return None

    def bias_sd(self, record: Array) -> Array | None:
        """Return the standard deviation of the gyro bias, (3,), rad/s, or None."""
        return None

    def advance(self, record: Array, imu: pd.DataFrame) -> tuple[Array, Array]:
        """Process a segment of samples.

        Parameters
        ----------
        record : ndarray
            From `begin`, or from an earlier segment; it is not changed.
        imu : DataFrame
            An Imu table of any length, with ``mag_x..z`` or without; rows with NaN in the
            accelerometer or the magnetometer are missing samples of these.

        Returns
        -------
        record : ndarray
            After the last sample.
        history : ndarray, (n, row)
        """
        time = imu.index.to_numpy(dtype=np.float64)
        history = np.empty((len(time), self.row))
        after = record.copy()
        if len(time):
            before = time[0] if record[kernel.SAMPLES] == 0 else record[kernel.TIME]
            blocks = [
                values_of(imu, columns) if set(columns) <= set(imu.columns) else np.empty((0, 3))
                for columns in (GYRO, ACCEL, MAG)
            ]
            type(self).advance_kernel(after, np.diff(time, prepend=before), *blocks, history)
            after[kernel.TIME] = time[-1]
        return after, history

    def attitudes(self, q: Array, record: Array) -> Array:
        """Unit quaternions ``q_nb`` of raw ones, (n, 4), of true north if the field was used."""
        if self.declination and record[kernel.HEADED] != 0.0:
            half = 0.5 * radians(self.declination)
            q = rotation.compose([cos(half), 0.0, 0.0, sin(half)], q)
        return np.asarray(q / np.sqrt((q * q).sum(axis=1, keepdims=True)))

    def check_interpolation(self, interpolation: str) -> None:
        """Raise ConfigError unless rates are to be linear between their stamps."""
        if interpolation != "linear":
            raise ConfigError(
                "attitude.filter-takes-linear",
                quantity="interpolation",
                name=self.name,
                interpolation=interpolation,
            )

    def check_sensors(self, imu: pd.DataFrame) -> None:
        """Raise DataError unless an Imu table has the accelerometer that every filter needs."""
        if not set(ACCEL) <= set(imu.columns):
            raise DataError(
                "attitude.filter-needs-accelerometer",
                file=imu.attrs.get("source"),
                quantity="accel",
                name=self.name,
            )

    def of_motion(self, imu: pd.DataFrame, run: FilterRun) -> Self:
        """Return the same filter for the motion of a record, which `run` is a first run over.

        Options that the user chose stay.
        """
        return self

    def with_heading(self, declination: float, sd: float) -> Self:
        """The same filter with a declination, deg, unless it has one.

        Parameters
        ----------
        sd : float, deg
            By which magnetic headings are less certain than the filter takes them to be; one that
            states no covariance has no use for it.
        """
        return self if self.declination else replace(self, declination=round(declination, 3))

    @property
    def label(self) -> str:
        """The name with every option that is not at its default."""
        changed = [
            f"{f.name}={getattr(self, f.name):g}"
            for f in fields(self)
            if getattr(self, f.name) != f.default
        ]
        return f"{self.name}:{','.join(changed)}" if changed else self.name


@dataclass(frozen=True)
class FilterRun:
    """One filter over one record.

    Attributes
    ----------
    q_nb : ndarray, (n, 4)
        Attitude after each sample.
    covariance : ndarray, (n, 3, 3), rad², or None
        Of the attitude error in north-east-down, if the filter states it.
    bias, bias_sd : ndarray, (3,), rad/s
        Gyro bias at the end; its standard deviation is None if it is not stated.
    disturbed : float
        Share of the time with a magnetometer in which the field was disturbed; NaN without one.
    stationary : float
        Share of the time in which the body was stationary.
    gaps : int
        Number of gaps.
    """

    q_nb: Array = field(repr=False)
    covariance: Array | None = field(repr=False)
    bias: Array
    bias_sd: Array | None
    disturbed: float
    stationary: float
    gaps: int

    def euler_sd(self) -> Array | None:
        """Standard deviations of roll, pitch and heading, (n, 3), deg, as `euler_sd`, or None."""
        return None if self.covariance is None else euler_sd(self.q_nb, self.covariance)


def euler_sd(q_nb: Array, covariance: Array) -> Array:
    """Standard deviations of 3-2-1 angles, to first order.

    Parameters
    ----------
    q_nb : ndarray, (n, 4)
    covariance : ndarray, (n, 3, 3), rad²
        Of the attitude error in north-east-down.

    Returns
    -------
    ndarray, (n, 3), deg
        Of roll, pitch, heading; at most 180. Near ±90° pitch, roll and heading are not separate,
        and theirs are large.
    """
    out = np.empty((len(q_nb), 3))
    kernel.euler_deviations(np.ascontiguousarray(q_nb), np.ascontiguousarray(covariance), out)
    return np.degrees(out)


def run_filter(
    chosen: OrientationEstimator,
    imu: pd.DataFrame,
    q_nb: ArrayLike | None = None,
    sampling: str | None = None,
) -> FilterRun:
    """Run a filter over a record.

    Parameters
    ----------
    chosen : OrientationEstimator
    imu : DataFrame
        An Imu table with an accelerometer; ``mag_x..z``, in any unit, are used if present. NaN in
        accelerometer or magnetometer rows are missing samples.
    q_nb : array_like, (4,), optional
        Initial attitude; by default from the samples.
    sampling : {'instantaneous', 'mean'}, optional
        By default that of `imu`.

    Returns
    -------
    FilterRun
        With a magnetometer, headings are magnetic, or true by the filter's declination.

    Raises
    ------
    DataError
        An accelerometer is missing, or a rate is not finite.
    DivergenceError
        The filter left the range of floating point.
    """
    source = imu.attrs.get("source")
    chosen.check_sensors(imu)
    rate = imu[GYRO].to_numpy(dtype=np.float64)
    bad = np.flatnonzero(~(np.abs(rate) < LARGEST).all(axis=1))
    if bad.size:
        row = int(bad[0])
        raise DataError(
            "attitude.time-rate-time-three-finite",
            file=source,
            row=row + 1,
            quantity="gyro",
            time=float(imu.index[row]),
            asarray=rate[row].tolist(),
            largest=LARGEST,
        )
    record = chosen.begin(q_nb, sampling or imu.attrs.get("sampling", "instantaneous"))
    record, history = chosen.advance(record, imu)
    bad = np.flatnonzero(~np.isfinite(history).all(axis=1))
    if bad.size:
        raise DivergenceError(
            "attitude.numbers-left-range-floating-point",
            row=int(bad[0]) + 1,
            quantity=chosen.label,
        )
    seen = record[kernel.MAG_TIME]
    span = float(imu.index[-1] - imu.index[0])
    return FilterRun(
        q_nb=chosen.attitudes(history[:, :4], record),
        covariance=chosen.covariance(history, record),
        bias=record[kernel.BIAS : kernel.BIAS + 3].copy(),
        bias_sd=chosen.bias_sd(record),
        disturbed=float(record[kernel.DISTURBED_TIME] / seen) if seen > 0.0 else float("nan"),
        stationary=float(record[kernel.REST_TIME] / span) if span > 0.0 else 0.0,
        gaps=int(record[kernel.GAPS]),
    )


def run_for_motion(
    chosen: OrientationEstimator,
    imu: pd.DataFrame,
    q_nb: ArrayLike | None = None,
    sampling: str | None = None,
) -> tuple[OrientationEstimator, FilterRun]:
    """Run a filter over a record as `run_filter`, with the options that its motion asks for.

    Returns
    -------
    chosen : OrientationEstimator
        The filter that was run: sample by sample it gives the same result.
    run : FilterRun
    """
    run = run_filter(chosen, imu, q_nb, sampling)
    fitted = chosen.of_motion(imu, run)
    return (chosen, run) if fitted == chosen else (fitted, run_filter(fitted, imu, q_nb, sampling))


class OrientationTracker:
    """Estimate an attitude from samples, one call per sample.

    Its result equals that of a batch over the same samples to the last bit.

    Parameters
    ----------
    chosen : OrientationEstimator
    q_nb : array_like, (4,), optional
        Initial attitude; by default from the first samples.
    sampling : {'instantaneous', 'mean'}

    Raises
    ------
    ConfigError
        `sampling` is unknown.
    DataError
        `q_nb` is not a rotation.
    """

    __slots__ = ("_filter", "_record", "_update")

    def __init__(
        self,
        chosen: OrientationEstimator,
        q_nb: ArrayLike | None = None,
        sampling: str = "instantaneous",
    ) -> None:
        self._filter = chosen
        self._record = chosen.begin(q_nb, sampling)
        self._update = type(chosen).update_kernel

    def update(
        self,
        time: float,
        gyro: ArrayLike,
        accel: ArrayLike | None = None,
        mag: ArrayLike | None = None,
    ) -> None:
        """Process one sample.

        Parameters
        ----------
        time : float, s
            Later than that of the sample before.
        gyro : array_like, (3,), rad/s
            Body rate, forward-right-down.
        accel : array_like, (3,), m/s², optional
            Specific force; None or NaN without a new sample.
        mag : array_like, (3,), optional
            Magnetic field in any unit; None or NaN without a new sample.

        Raises
        ------
        DataError
            Time does not advance, or the rate is not three finite numbers. The sample is then not
            taken, and the state is as before.
        """
        try:
            rate = np.asarray(gyro, dtype=np.float64)
            force = _MISSING if accel is None else np.asarray(accel, dtype=np.float64)
            field_b = _MISSING if mag is None else np.asarray(mag, dtype=np.float64)
            if self._update(self._record, time, rate, force, field_b) >= 0.0:
                return
        except ARGUMENT_ERRORS:
            self._refuse(float("nan"), gyro)
        self._refuse(time, gyro)

    def _refuse(self, time: float, gyro: ArrayLike) -> NoReturn:
        taken, last = self._record[kernel.SAMPLES], self._record[kernel.TIME]
        refuse_sample(int(taken), float(last), time, gyro)

    @property
    def quaternion(self) -> Array:
        """The attitude ``q_nb``, (4,), unit norm."""
        q = self._record[None, kernel.Q : kernel.Q + 4]
        unit: Array = self._filter.attitudes(q, self._record)[0]
        return unit

    @property
    def roll_pitch_heading(self) -> Array:
        """The attitude as 3-2-1 angles, (3,), deg."""
        return rotation.euler_from_quaternion(self.quaternion)

    @property
    def roll_pitch_heading_sd(self) -> Array | None:
        """Standard deviations of these angles, (3,), deg; None if the filter states none."""
        row = self._filter.row_of(self._record)[None, :]
        covariance = self._filter.covariance(row, self._record)
        return None if covariance is None else euler_sd(self.quaternion[None, :], covariance)[0]

    @property
    def gyro_bias(self) -> Array:
        """The estimated gyro bias, (3,), rad/s."""
        bias: Array = self._record[kernel.BIAS : kernel.BIAS + 3].copy()
        return bias
