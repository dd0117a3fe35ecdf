"""Crash recorders: design, drawn errors, and simulated records."""

from __future__ import annotations

import math
import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from strapdown import rotation
from strapdown.errors import ConfigError
from strapdown.sensors.catalogue import load_sensor
from strapdown.sensors.crash_unit import CrashUnit, Mounting, RecordedTriad
from strapdown.sensors.error_chain import Seed, child
from strapdown.sensors.triad_errors import Triad, TriadErrors
from strapdown.sensors.uncertainty import TriadUncertainty, draw_errors, uncertainty_of
from strapdown.simulation.imu import mean_over, sample_accelerometer, sample_gyro
from strapdown.simulation.motion import Motion, check_numbers
from strapdown.tables import ACCEL, GYRO, check_sampling_kind
from strapdown.tables.checks import Array
from strapdown.units import GYRO_UNITS

# The low-pass treats the motion as linear between samples where it is so within this tolerance: a
# hundredth of the finest quantization step of a recorder.
STRAIGHT_FORCE = 1e-4  # m/s²
STRAIGHT_RATE = 1e-6  # rad/s
# A sample that rounding puts just outside is kept.
SLACK = 1e-6  # of an interval


def record_crash(
    motion: Motion,
    design: RecorderDesign,
    *,
    impact: float,
    seed: int,
    start: float | None = None,
    end: float | None = None,
    ringing: Sequence[Any] = (),
    sampling: str = "instantaneous",
) -> tuple[CrashUnit, RecorderTruth]:
    """Simulate the record of a crash recorder on a vehicle.

    Parameters
    ----------
    motion : Motion
        Motion of the vehicle's origin in vehicle axes.
    design : RecorderDesign
    impact : float, s
        Instant of the trigger on the motion's clock.
    seed : int
        Seed of all random draws: errors, noise, mounting, trigger. Recorders with different names
        draw independently from one seed, and every part has its own stream.
    start, end : float, s, optional
        Interval of the record on the motion's clock; default, the whole motion.
    ringing : sequence of Ringing
        Ringing of the structure at the mounting point.
    sampling : {'instantaneous', 'mean'}

    Returns
    -------
    unit : CrashUnit
        Samples fall on integer multiples of the interval on the unit's own clock. Its mounting and
        uncertainties are those stated in the design.
    truth : RecorderTruth

    Raises
    ------
    ConfigError
        The record or the impact is not within the motion, or the record is shorter than two
        samples; the message names the recorder.
    """
    begin, stop = _bounds(motion, design, impact, start, end, sampling)
    root = child(seed, zlib.crc32(design.name.encode()))
    truth = draw_truth(design, root)
    felt, vibration = _felt(motion, truth.mounting, tuple(ringing))
    felt = RememberedMotion(felt)

    def record(
        triad: TriadDesign,
        told: TriadUncertainty,
        columns: list[str],
        sample: Callable[[Array], Array],
    ) -> RecordedTriad:
        stamps, at = _stamps(felt, design, triad, truth, begin, stop)
        table = pd.DataFrame(sample(at), index=pd.Index(stamps, name="time"), columns=columns)
        table.attrs = {"sampling": sampling, "source": f"{design.name} {triad.part}"}
        return RecordedTriad(table, told, triad.part)

    def forces(k: int, errors: TriadErrors, at: Array) -> Array:
        shaken = None
        if vibration is not None and any(errors.axis("vibration_rectification")):
            shaken = _mean_square(vibration, at, felt.duration)
        return sample_accelerometer(
            felt,
            errors,
            at,
            sampling=sampling,
            seed=child(root, ACCEL_NOISE, k),
            straight=STRAIGHT_FORCE,
            vibration=shaken,
        )

    def rates(errors: TriadErrors, at: Array) -> Array:
        seed = child(root, GYRO_NOISE)
        return sample_gyro(felt, errors, at, sampling=sampling, seed=seed, straight=STRAIGHT_RATE)

    accelerometers = tuple(
        record(triad, design.told(k), ACCEL, partial(forces, k, truth.accelerometers[k]))
        for k, triad in enumerate(design.accelerometers)
    )
    gyro, told = None, design.told_gyro()
    if design.gyro is not None and truth.gyro is not None and told is not None:
        gyro = record(design.gyro, told, GYRO, partial(rates, truth.gyro))
    unit = CrashUnit(
        design.name,
        accelerometers,
        gyro,
        design.mounting,
        design.gyro_from,
        truth.clock(impact) + truth.trigger_error,
        design.trigger_sd,
    )
    return unit, truth


def _bounds(
    motion: Motion,
    design: RecorderDesign,
    impact: float,
    start: float | None,
    end: float | None,
    sampling: str,
) -> tuple[float, float]:
    begin = 0.0 if start is None else float(start)
    stop = motion.duration if end is None else float(end)
    check_sampling_kind(sampling)
    if not 0.0 <= begin < stop <= motion.duration:
        raise ConfigError(
            "simulation.recorder-record-not-within-motion",
            quantity="start, end",
            name=design.name,
            begin=begin,
            stop=stop,
            duration=motion.duration,
        )
    if not 0.0 <= impact <= motion.duration:
        raise ConfigError(
            "simulation.recorder-impact-not-within-motion",
            quantity="impact",
            name=design.name,
            impact=impact,
            duration=motion.duration,
        )
    return begin, stop


def _felt(
    motion: Motion, mounting: Mounting, ringing: tuple[Any, ...]
) -> tuple[Motion, Callable[[Array], Array] | None]:
    """Motion of the sensors, and the vibration it contains."""
    if not ringing and not any(mounting.position) and not any(mounting.angles_deg):
        return motion, None
    from strapdown.simulation.mounted_motion import MountedMotion

    vehicle: Any = motion
    felt = MountedMotion(vehicle, mounting, ringing)
    if not ringing:
        return felt, None
    still = MountedMotion(vehicle, mounting, ())

    first = min(float(r.start) for r in ringing)

    def vibration(time: Array) -> Array:
        square = np.zeros((time.size, 3))
        rings = time > first
        if rings.any():
            at = time[rings]
            square[rings] = (felt.specific_force(at) - still.specific_force(at)) ** 2
        return square

    return felt, vibration


def _mean_square(vibration: Callable[[Array], Array], at: Array, duration: float) -> Array:
    """Mean square over an interval about each sample, in two halves: to 1e-3 up to four periods."""
    half = 0.5 * (at[1] - at[0])
    low, high = np.maximum(at - half, 0.0), np.minimum(at + half, duration)
    middle = 0.5 * (low + high)
    return 0.5 * (mean_over(vibration, low, middle) + mean_over(vibration, middle, high))


def _stamps(
    motion: Motion,
    design: RecorderDesign,
    triad: TriadDesign,
    truth: RecorderTruth,
    begin: float,
    stop: float,
) -> tuple[Array, Array]:
    """Stamps on the recorder's clock, and the equally spaced instants of the motion."""
    first = math.ceil(truth.clock(begin) * triad.rate - SLACK)
    last = math.floor(truth.clock(stop) * triad.rate + SLACK)
    if last - first < 1:
        raise ConfigError(
            "simulation.recorder-hz-gives-fewer-than",
            quantity="rate",
            name=design.name,
            part=triad.part,
            rate=triad.rate,
            begin=begin,
            stop=stop,
        )
    stamps = np.arange(first, last + 1) / triad.rate
    at = (stamps - truth.clock_offset) / (1.0 + 1e-6 * truth.clock_drift_ppm)
    return stamps, np.clip(at, 0.0, motion.duration)


# True errors of a recorder, drawn from its design.


# Stream keys below a recorder's seed: errors and noise, each for accelerometers and gyro.
ACCEL_ERRORS, GYRO_ERRORS, ACCEL_NOISE, GYRO_NOISE, MOUNTING, TRIGGER, WARM_UP, HIGH_G = range(8)


def draw_truth(design: RecorderDesign, root: Seed) -> RecorderTruth:
    """Draw errors, mounting and trigger error of one recorder.

    `root`: seed of the recorder; each part has its own stream below it.
    """
    accelerometers = []
    for k, triad in enumerate(design.accelerometers):
        errors = triad.errors
        if errors is None:
            errors = draw_errors(triad.uncertainty, root, ACCEL_ERRORS, k)
            if k > 0 and design.high_g_bias > 0.0:
                draw = np.random.Generator(np.random.PCG64(child(root, HIGH_G, k)))
                bias = draw.uniform(-design.high_g_bias, design.high_g_bias, 3)
                errors = replace(errors, bias=_triad(bias))
        sd = design.warm_up.accel if design.warm_up else 0.0
        accelerometers.append(_warmed(errors, design.warm_up, sd, root, k))
    gyro = None
    if design.gyro is not None:
        gyro = design.gyro.errors
        if gyro is None:
            gyro = draw_errors(design.gyro.uncertainty, root, GYRO_ERRORS)
        sd = design.warm_up.gyro if design.warm_up else 0.0
        gyro = _warmed(gyro, design.warm_up, sd, root, len(accelerometers))
    told = design.mounting
    moved = _normal(6, root, MOUNTING)
    return RecorderTruth(
        tuple(accelerometers),
        gyro,
        Mounting(
            _triad(np.add(told.position, told.position_sd * moved[:3])),
            _turned(told, moved[3:]),
        ),
        design.clock_offset,
        design.clock_drift_ppm,
        float(design.trigger_sd * _normal(1, root, TRIGGER)[0]),
    )


def _warmed(
    errors: TriadErrors, warm_up: WarmUp | None, sd: float, root: Seed, which: int
) -> TriadErrors:
    if warm_up is None or sd == 0.0:
        return errors
    drift = sd * warm_up.left * _normal(3, root, WARM_UP, which)
    return replace(errors, warm_up=_triad(drift), warm_up_time=warm_up.time_constant)


def _normal(count: int, root: Seed, *place: int) -> Array:
    generator = np.random.Generator(np.random.PCG64(child(root, *place)))
    return generator.standard_normal(count)


def _triad(values: Array) -> Triad:
    x, y, z = (float(v) for v in values)
    return (x, y, z)


def _turned(told: Mounting, by: Array) -> Triad:
    """Euler angles after a small rotation about vehicle axes, equally uncertain about each axis."""
    if told.angles_sd_deg == 0.0:
        return told.angles_deg
    turn = rotation.quaternion_from_rotation_vector(np.radians(told.angles_sd_deg) * by)
    there = rotation.quaternion_from_euler(told.angles_deg)
    return _triad(rotation.euler_from_quaternion(rotation.compose(turn, there)))


class RememberedMotion:
    """A motion that caches its samples for several triads."""

    def __init__(self, motion: Motion) -> None:
        self.motion = motion
        self.duration = motion.duration
        self.cuts = tuple(getattr(motion, "cuts", ()))
        self.found: dict[tuple[str, bytes], Array] = {}

    def _ask(self, name: str, time: ArrayLike) -> Array:
        key = (name, np.asarray(time).tobytes())
        if key not in self.found:
            self.found[key] = getattr(self.motion, name)(time)
        return self.found[key]

    def rate(self, time: ArrayLike) -> Array:
        """Body rate, as of `Motion`."""
        return self._ask("rate", time)

    def specific_force(self, time: ArrayLike) -> Array:
        """Specific force, as of `Motion`."""
        return self._ask("specific_force", time)

    def angle(self, time: ArrayLike) -> Array:
        """Integral of the body rate, as of `Motion`."""
        return self.motion.angle(time)

    def attitude(self, time: ArrayLike) -> Array:
        """Attitude, as of `Motion`."""
        return self.motion.attitude(time)


# A larger clock drift means a defective crystal.
MOST_DRIFT = 1000.0  # ppm


@dataclass(frozen=True)
class TriadDesign:
    """One triad of a recorder.

    Attributes
    ----------
    part : str
        Name, for messages.
    uncertainty : TriadUncertainty
        Stated uncertainty, written to the record.
    rate : float, Hz
    errors : TriadErrors, optional
        True errors; drawn from the uncertainty if not given.

    Raises
    ------
    ConfigError
        The rate is not positive.
    """

    part: str
    uncertainty: TriadUncertainty
    rate: float
    errors: TriadErrors | None = None

    def __post_init__(self) -> None:
        check_numbers(self, positive="rate", file=self.part)


@dataclass(frozen=True)
class WarmUp:
    """Biases that decay after a recorder is switched on.

    Attributes
    ----------
    accel : float, m/s²
        Standard deviation at switch-on, for every axis and triad.
    gyro : float, rad/s
        The same for the gyro.
    time_constant : float, s
    elapsed : float, s
        From switch-on to the start of the motion; stated, not simulated.
    """

    accel: float
    gyro: float
    time_constant: float
    elapsed: float = 0.0

    def __post_init__(self) -> None:
        check_numbers(
            self,
            positive="time_constant",
            not_negative="accel gyro elapsed",
            file="warm-up",
        )

    @property
    def left(self) -> float:
        """Fraction of the warm-up bias left when the motion starts."""
        return math.exp(-self.elapsed / self.time_constant)


@dataclass(frozen=True)
class RecorderDesign:
    """A recorder on a vehicle.

    Attributes
    ----------
    name : str
        Also selects the random stream: two recorders with one seed differ by it.
    accelerometers : tuple of TriadDesign
        One or more, in order of increasing range.
    gyro : TriadDesign, optional
    mounting : Mounting
        Stated mounting; the true one is drawn with its standard deviations.
    gyro_from : str, optional
        Recorder that supplies the gyro, for a recorder without one.
    warm_up : WarmUp, optional
    trigger_sd : float, s
        Standard deviation of the trigger stamp.
    clock_offset : float, s
        Reading of the recorder's clock when the motion starts.
    clock_drift_ppm : float
        Rate by which the clock runs fast.
    high_g_bias : float, m/s²
        Half-width of the uniform bias distribution of every accelerometer except the first; zero
        leaves them to their own uncertainty.

    Raises
    ------
    ConfigError
        No accelerometer is given, or a number is out of range.
    """

    name: str
    accelerometers: tuple[TriadDesign, ...]
    gyro: TriadDesign | None = None
    mounting: Mounting = field(default_factory=Mounting)
    gyro_from: str | None = None
    warm_up: WarmUp | None = None
    trigger_sd: float = 0.0
    clock_offset: float = 0.0
    clock_drift_ppm: float = 0.0
    high_g_bias: float = 0.0

    def __post_init__(self) -> None:
        if not self.accelerometers:
            raise ConfigError("simulation.recorder-none", quantity="accelerometers", name=self.name)
        check_numbers(
            self,
            not_negative="trigger_sd high_g_bias",
            finite="clock_offset",
            file=self.name,
        )
        if not abs(self.clock_drift_ppm) <= MOST_DRIFT:
            raise ConfigError(
                "simulation.recorder-drift",
                quantity="clock_drift_ppm",
                name=self.name,
                value=self.clock_drift_ppm,
                most=MOST_DRIFT,
            )

    def told(self, which: int) -> TriadUncertainty:
        """Stated uncertainty of an accelerometer, with high-g bias and residual warm-up bias."""
        own = self.accelerometers[which].uncertainty
        if which > 0 and self.high_g_bias > 0.0:
            own = replace(own, bias=self.high_g_bias / math.sqrt(3.0))
        return self._warm(own, self.warm_up.accel if self.warm_up else 0.0)

    def told_gyro(self) -> TriadUncertainty | None:
        """Stated uncertainty of the gyro, likewise."""
        if self.gyro is None:
            return None
        return self._warm(self.gyro.uncertainty, self.warm_up.gyro if self.warm_up else 0.0)

    def _warm(self, own: TriadUncertainty, sd: float) -> TriadUncertainty:
        if self.warm_up is None:
            return own
        return replace(own, bias=_triad(np.hypot(own.axis("bias"), sd * self.warm_up.left)))


@dataclass(frozen=True)
class RecorderTruth:
    """True errors of a simulated recorder.

    Attributes
    ----------
    gyro : TriadErrors, optional
    mounting : Mounting
        True mounting, without standard deviations.
    clock_offset : float, s
    trigger_error : float, s
        Delay of the trigger stamp.
    """

    accelerometers: tuple[TriadErrors, ...]
    gyro: TriadErrors | None
    mounting: Mounting
    clock_offset: float
    clock_drift_ppm: float
    trigger_error: float

    def clock(self, time: float) -> float:
        """Reading of the recorder's clock at an instant of the motion, s."""
        return self.clock_offset + (1.0 + 1e-6 * self.clock_drift_ppm) * time


# The four recorders of the crash test of Tadic and Vukajlovic (2016).


# Section 3 of the paper: the largest bias found in a high-g part; the warm-up; Table 1.
HIGH_G_BIAS = 11.91  # m/s²
ELAPSED = 600.0  # s
IMU_RATE, LAB_RATE = 200.0, 10_000.0  # Hz
# Chosen, because the paper gives no positions. Relative to the vehicle's origin, taken 0.5 m above
# the ground in the middle of the car: on the floor before the front seats, and halfway up the
# B-pillars.
FLOOR: Triad = (0.6, 0.5, 0.2)
PILLAR: Triad = (-0.3, 0.7, -0.3)
# Chosen: a 12-bit converter over 3.3 V with 20, 40 and 40 mV/g.
HIGH_G_STEP: Triad = (0.4, 0.2, 0.2)  # m/s²


def paper_units(scale_sd: float = 0.02) -> tuple[RecorderDesign, ...]:
    """Return the platforms of the paper: LAB1, LAB2, IMU1, IMU2; 1 is left, 2 is right.

    Parameters
    ----------
    scale_sd : float
        Scale factor standard deviation of every MEMS triad after calibration; the data sheets alone
        allow up to ±10 %.

    Returns
    -------
    tuple of RecorderDesign
        From the paper: parts, rates and ranges (but see the catalogue's note on ±100 g), the high-g
        bias of up to 11.91 m/s², the low-g bias of 0.2 m/s², 10 minutes of warm-up, the common
        trigger, laboratory units without gyros (here they use IMU1's), B-pillars and floor. Chosen
        here: positions and their standard deviations, converters, clocks, warm-up drift, and
        stamping a trigger with the sample in which it falls.

    Raises
    ------
    ConfigError
        The scale factor's standard deviation is negative or not finite.
    """
    return (
        _lab("LAB1", -1.0),
        _lab("LAB2", 1.0),
        _imu("IMU1", -1.0, scale_sd, 3.7, 18.0),
        _imu("IMU2", 1.0, scale_sd, -1.3, -25.0),
    )


def _imu(name: str, side: float, scale: float, offset: float, drift: float) -> RecorderDesign:
    low, high, gyro = (
        load_sensor(part) for part in ("lis302dlh", "mma3202-mma1213", "idg-500-isz-500")
    )
    return RecorderDesign(
        name,
        (
            TriadDesign(low.name, uncertainty_of(low, "accel", scale=scale), IMU_RATE),
            TriadDesign(
                high.name,
                uncertainty_of(high, "accel", scale=scale, quantization=HIGH_G_STEP),
                IMU_RATE,
            ),
        ),
        TriadDesign(gyro.name, uncertainty_of(gyro, "gyro", scale=scale), IMU_RATE),
        Mounting(_beside(FLOOR, side), position_sd=0.01, angles_sd_deg=1.0),
        warm_up=WarmUp(0.5, 1.0 * GYRO_UNITS["deg/s"], 150.0, ELAPSED),
        trigger_sd=_one_sample(IMU_RATE),
        clock_offset=offset,
        clock_drift_ppm=drift,
        high_g_bias=HIGH_G_BIAS,
    )


def _lab(name: str, side: float) -> RecorderDesign:
    part = load_sensor("endevco-7264b-500")
    return RecorderDesign(
        name,
        (TriadDesign(part.name, uncertainty_of(part, "accel"), LAB_RATE),),
        mounting=Mounting(_beside(PILLAR, side), position_sd=0.005, angles_sd_deg=0.5),
        gyro_from="IMU1",
        trigger_sd=_one_sample(LAB_RATE),
        clock_drift_ppm=2.0 * side,
    )


def _beside(position: Triad, side: float) -> Triad:
    return (position[0], side * position[1], position[2])


def _one_sample(rate: float) -> float:
    """Standard deviation of an instant uniformly distributed over a sample interval, s."""
    return 1.0 / rate / math.sqrt(12.0)
