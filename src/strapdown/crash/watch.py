"""Crash detection while samples arrive: delta-V so far, direction of force, severity, bounds."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from statistics import NormalDist
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from strapdown._kernels import crash_trigger as kernel
from strapdown.constants import STANDARD_GRAVITY
from strapdown.crash.pdof import clock_of, pdof, pdof_interval
from strapdown.crash.severity import SEVERITY_MODELS, find_severity_model, injury_risk
from strapdown.errors import ConfigError, DataError
from strapdown.sensors.uncertainty import TriadUncertainty
from strapdown.tables.checks import Array

#: Slope of a road, and lean of a vehicle on its springs, as a standard deviation, rad.
SLOPE = math.radians(6.0)
#: Yaw rate in a crash where no gyro measures it, as a standard deviation, rad/s.
UNMEASURED_YAW = math.radians(100.0)
#: Share of the full scale at which a sample may be clipped.
NEAR_END = 0.995
#: Share of a clipped sensor axis that a vehicle axis feels.
FEELS = 0.1
#: Refused stamps in order of time after which the clock is taken to have been reset.
RESET = 3
#: 95 % of a normal distribution.
Z95 = NormalDist().inv_cdf(0.975)
STATUS = {
    kernel.TRIGGERED: "event",
    kernel.ENDED: "ended",
    kernel.INTERRUPTED: "interrupted",
}


@dataclass(frozen=True)
class WatchOptions:
    """Recorder of a live detection, as plain numbers.

    Attributes
    ----------
    axes : nine numbers
        Rotation from the axes of the recorder to those of the vehicle, row by row.
    errors : six numbers
        Standard deviations: noise density, m/s²/√Hz; scale; misalignment, rad; mounting about
        forward and right, rad; mounting about down, rad; yaw rate, rad/s.
    variance : float, (m/s²)²
        Of a horizontal component of the mean specific force before any sample: bias and slope.
    full_scale : three numbers, m/s²
        Of the accelerometers; None where not known.
    gyro : bool
        Whether yaw rates are measured.
    mean : bool
        Whether a sample is the mean over the interval that ends with it.
    severity : tuple of str
        Models of injury risk, evaluated for delta-V so far.
    bias, scale : six numbers
        What the recorder reads too much, known by a calibration, and taken off: rad/s and m/s²,
        and shares of the truth; x, y, z of the gyro, then of the accelerometers.
    """

    axes: tuple[float, ...] = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
    errors: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0, 0.0, UNMEASURED_YAW)
    variance: float = (STANDARD_GRAVITY * SLOPE) ** 2
    full_scale: tuple[float | None, ...] = (None, None, None)
    gyro: bool = False
    mean: bool = False
    severity: tuple[str, ...] = ()
    bias: tuple[float, ...] = (0.0,) * 6
    scale: tuple[float, ...] = (0.0,) * 6


def watch_options(
    accel: TriadUncertainty,
    gyro: TriadUncertainty | None,
    C: ArrayLike,
    angles_sd: ArrayLike,
    *,
    mean: bool = False,
    severity: tuple[str, ...] | None = None,
) -> WatchOptions:
    """Options of a recorder from its stated uncertainty; the worse of forward and right is taken.

    `C`, (3, 3): rotates vectors from the axes of the recorder to those of the vehicle. `angles_sd`,
    (3,), rad: standard deviations of the mounting about forward, right and down. `severity`: by
    default the models of all crashes.
    """
    if severity is None:
        severity = tuple(n for n, m in SEVERITY_MODELS.items() if not m.applies)
    # A model that needs more than delta-V cannot be evaluated during a crash.
    names = tuple(n for n in severity if find_severity_model(n).inputs == ("delta_v",))
    C = np.asarray(C, dtype=np.float64)
    level = accel.turned(C)
    *leans, facing = np.asarray(angles_sd, dtype=np.float64).tolist()
    lean = max(leans)
    # At the end of the range nonlinearity is that share of the reading, below it less.
    scale = np.hypot(level.axis("scale"), level.axis("nonlinearity_2"))[:2].max()
    return WatchOptions(
        tuple(float(v) for v in C.ravel()),
        (
            max(level.axis("noise_density")[:2]),
            float(scale),
            max(level.axis("misalignment")[:2]),
            lean,
            facing,
            UNMEASURED_YAW if gyro is None else gyro.turned(C).axis("bias")[2],
        ),
        max(level.axis("bias")[:2]) ** 2 + STANDARD_GRAVITY**2 * (SLOPE**2 + lean**2),
        tuple(v if math.isfinite(v) else None for v in accel.axis("full_scale")),
        gyro is not None,
        mean,
        names,
    )


class CrashWatch:
    """Detect crashes sample by sample.

    The estimates are bitwise independent of how a record is cut, and no later sample counts.

    Notes
    -----
    Trigger: 8 km/h forward or right within 150 ms (49 CFR 563.5(b)), less the mean specific force
    before, at the first sample at which it is met: at most one step late. Time zero: the first
    point of the first 20 ms in which the horizontal change exceeds 0.8 km/h, at most 150 ms before
    the trigger. Delta-V of the recorder's position, in the axes of the vehicle at time zero.
    """

    def __init__(self, options: WatchOptions = WatchOptions()) -> None:
        self.options = options
        self._C = np.array(options.axes).reshape(3, 3)
        self._errors = np.array(options.errors)
        self._bias, self._scale = np.array(options.bias), 1.0 + np.array(options.scale)
        limits = [math.inf if v is None else NEAR_END * v for v in options.full_scale]
        self._limits = np.array(limits)
        self._felt = np.abs(self._C[:2]) > FEELS
        self._state = np.zeros(kernel.SIZE)
        kernel.begin(self._state, options.variance)
        self._sample = np.zeros(6)
        self._time = math.nan
        self._refused: list[float] = []
        self._step = 0.0
        #: Events, samples, refused samples, and resets of the clock so far.
        self.events, self.samples, self.refused, self.resets = 0, 0, 0, 0

    @property
    def newest(self) -> float | None:
        """Stamp of the newest accepted sample, s; None before the first."""
        return self._time if self.samples else None

    @property
    def largest_change(self) -> float:
        """Largest change forward or right within 150 ms outside events, m/s."""
        return float(self._state[kernel.MOST])

    def take(self, time: float, values: ArrayLike) -> str | None:
        """Process a sample.

        Parameters
        ----------
        time : float, s
        values : array_like, (6,) or (3,)
            Rates in rad/s, if any, and specific forces in m/s², in the axes of the recorder.

        Returns
        -------
        {'trigger', 'event', 'ended', 'interrupted'} or None
            None outside an event. Interrupted: no sample for more than 150 ms, or a new clock.

        Raises
        ------
        DataError
            The stamp is not later than the one before, or a number is not finite; the sample is
            not processed. After three such stamps in order, time goes on from there.
        """
        time, numbers = float(time), np.asarray(values, dtype=np.float64)
        wanted = (6,) if self.options.gyro else (3,)
        if numbers.shape not in ((6,), wanted) or not (
            np.isfinite(numbers).all() and math.isfinite(time)
        ):
            self.refused += 1
            raise DataError(
                "crash.time-acceleration-not-finite",
                row=self.samples + self.refused,
                quantity="acceleration",
                time=time,
                accel=numbers.tolist(),
            )
        dt = time - self._time if self.samples else 1.0
        if not dt > 0.0:
            dt = self._reset(time)
        self._refused.clear()
        self._time, self._step = time, float(dt)
        self.samples += 1
        force = numbers[-3:]
        self._sample[:3] = self._C @ ((force - self._bias[3:]) / self._scale[3:])
        rate = (numbers[:3] - self._bias[:3]) / self._scale[:3]
        self._sample[kernel.SPIN] = self._C[2] @ rate if self.options.gyro else 0.0
        clipped = np.abs(force) >= self._limits
        self._sample[kernel.CLIPPED :] = (self._felt & clipped).any(axis=1)
        before = self._state[kernel.MODE]
        code = kernel.take(self._state, self.options.mean, dt, self._sample)
        if code == kernel.TRIGGERED and before < kernel.TRIGGERED:
            self.events += 1
            return "trigger"
        return STATUS.get(code)

    def _reset(self, time: float) -> float:
        """Refuse a stamp that is not later, or accept the clock after several in order."""
        if self._refused and time <= self._refused[-1]:
            self._refused.clear()
        self._refused.append(time)
        if len(self._refused) < RESET:
            self.refused += 1
            raise DataError(
                "crash.time-does-not-advance-not",
                row=self.samples + self.refused,
                quantity="time",
                time=time,
            )
        self.resets += 1
        # As a gap of unknown length.
        return 2.0 * kernel.WINDOW

    def estimate(self) -> Mapping[str, Any]:
        """Delta-V so far, direction of force and severity, each with its 95 % bound.

        Valid from a trigger to the sample that ends the event. Names end in their unit. A bound of
        a delta-V that a clipped or missing sample makes too small has no upper end.
        """
        state, errors = self._state, self._errors
        change = state[kernel.DELTA : kernel.DELTA + 3].copy()
        change[2] = 0.0
        var_x, var_y, both = kernel.spread(state, errors)
        covariance = np.array([[var_x, both, 0.0], [both, var_y, 0.0], [0.0, 0.0, 0.0]])
        size = math.hypot(change[0], change[1])
        sd = math.sqrt(float(change @ covariance @ change)) / size if size > 0.0 else math.nan
        since = float(state[kernel.SINCE])
        clipped = [bool(state[kernel.SAFE + i] <= since) for i in range(2)]
        names = ("delta_v_forward_m_per_s", "delta_v_right_m_per_s")
        told: dict[str, Any] = {
            "since_time_zero_s": since,
            "since_trigger_s": float(state[kernel.AGE]),
            "latency_samples": 1,
            "latency_ms": 1e3 * self._step,
        }
        for name, value, variance, cut in zip(
            names, change[:2].tolist(), (var_x, var_y), clipped, strict=True
        ):
            low, high = value - Z95 * math.sqrt(variance), value + Z95 * math.sqrt(variance)
            told[name] = value
            told[f"{name}_bound"] = [
                None if cut and value < 0.0 else low,
                None if cut and value >= 0.0 else high,
            ]
        least = any(clipped)
        low, high = max(size - Z95 * sd, 0.0), size + Z95 * sd
        told["delta_v_m_per_s"] = size
        told["delta_v_m_per_s_bound"] = [low, None if least else high]
        told["at_least"] = least
        told |= _direction(change, covariance, clipped)
        told["risk"] = {
            name: _risk(name, size, sd, least) for name in self.options.severity if size > 0.0
        }
        return told


class CrashLog:
    """Detections as plain data, and the samples that were used.

    `every`, s: least interval between estimates of an event, besides its trigger and its end.
    `lines`: one for each estimate. `accepted`: of each clock, begin and end of each run of accepted
    samples, counted among all that were taken.
    """

    def __init__(self, options: WatchOptions, every: float = 0.01) -> None:
        if not 0.0 <= every < math.inf:
            raise ConfigError("live.bad-interval", quantity="--every", every=every)
        self.watch, self._every, self._next = CrashWatch(options), every, 0.0
        self.lines: list[Mapping[str, Any]] = []
        self.accepted: list[list[list[int]]] = [[]]
        self._taken = 0

    def take(self, time: float, values: Sequence[float]) -> Mapping[str, Any] | None:
        """Process a sample, as `CrashWatch.take`; return the estimate that is due, if any."""
        resets, number = self.watch.resets, self._taken
        self._taken += 1
        status = self.watch.take(time, values)
        if self.watch.resets > resets:
            self.accepted.append([])
        spans = self.accepted[-1]
        if spans and spans[-1][1] == number:
            spans[-1][1] = number + 1
        else:
            spans.append([number, number + 1])
        # Stamps are rounded decimal fractions.
        if status is None or (status == "event" and time < self._next - 1e-9):
            return None
        self._next = time + self._every
        line = {"time_s": time, "event": self.watch.events, "status": status}
        line |= self.watch.estimate()
        self.lines.append(line)
        return line

    def records(self, rows: Array) -> list[Array]:
        """Return the accepted ones among all samples that were taken, of one clock each.

        `rows`, (n, k): every sample that was taken, refused ones included.
        """
        return [
            np.concatenate([rows[:0], *(rows[first:end] for first, end in spans)])
            for spans in self.accepted
        ]

    def summary(self) -> Mapping[str, Any]:
        """Samples processed, and the margin below the trigger of all others."""
        watch = self.watch
        return {
            "events": watch.events,
            "samples": watch.samples,
            "samples_refused": watch.refused,
            "clock_resets": watch.resets,
            "largest_change_outside_events_m_per_s": watch.largest_change,
            "trigger_m_per_s": kernel.TRIGGER,
            "trigger_window_s": kernel.WINDOW,
        }


def _direction(change: Array, covariance: Array, clipped: list[bool]) -> dict[str, Any]:
    """PDOF, deg clockwise from the front, whence the force came, with its bound and hour."""
    unknown = {"pdof_deg": None, "pdof_deg_bound": None, "pdof_clock": None}
    if not change.any():
        return unknown
    horizontal = pdof(change).horizontal_deg
    interval = pdof_interval(change, covariance).horizontal
    low, high = interval.low_deg, interval.high_deg
    for axis in range(2):
        if clipped[axis]:
            # The component may be any larger one: up to the direction of that axis.
            way = np.zeros(3)
            way[axis] = math.copysign(1.0, change[axis])
            off = math.remainder(pdof(way).horizontal_deg - horizontal, 360.0)
            low, high = min(low, horizontal + off), max(high, horizontal + off)
    bound = None if interval.undetermined else [low, high]
    return {
        "pdof_deg": horizontal,
        "pdof_deg_bound": bound,
        "pdof_clock": clock_of(horizontal),
    }


def _risk(name: str, size: float, sd: float, least: bool) -> dict[str, Any] | None:
    """Probability for the delta-V so far, with its bound; None where the model is not valid."""
    try:
        risk = injury_risk(find_severity_model(name), {"delta_v": size}, {"delta_v": sd})
    except DataError:
        return None
    high = None if least else risk.high
    return {"probability": risk.probability, "bound": [risk.low, high]}
