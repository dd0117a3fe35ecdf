"""Simulated records of a crash recorder."""

from __future__ import annotations

import math
import zlib
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from strapdown import rotation
from strapdown.errors import ConfigError
from strapdown.sensors.crash_unit import CrashUnit, Mounting, RecordedTriad
from strapdown.sensors.error_chain import Seed, child
from strapdown.sensors.triad_errors import Triad, TriadErrors
from strapdown.sensors.uncertainty import draw_errors
from strapdown.simulation.imu import mean_over, sample_accelerometer, sample_gyro
from strapdown.simulation.motion import Motion
from strapdown.simulation.recorder_design import RecorderDesign, RecorderTruth, TriadDesign, WarmUp
from strapdown.tables import ACCEL, GYRO, SAMPLINGS

Array = NDArray[np.float64]

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
    mounted: bool = False,
) -> tuple[CrashUnit, RecorderTruth]:
    """Simulate the record of a crash recorder on a vehicle.

    Parameters
    ----------
    motion : Motion
        Motion of the vehicle's origin in vehicle axes, or (`mounted`) of the sensors in sensor
        axes.
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
    mounted : bool
        The motion is that of the sensors and already includes mounting and ringing.

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
    felt, vibration = _felt(motion, truth.mounting, tuple(ringing), mounted)
    felt = RememberedMotion(felt)
    accelerometers = tuple(
        _record_accelerometer(
            felt, design, k, truth, (begin, stop), sampling, child(root, ACCEL_NOISE, k), vibration
        )
        for k in range(len(design.accelerometers))
    )
    gyro = None
    if design.gyro is not None and truth.gyro is not None:
        told = design.told_gyro()
        assert told is not None
        stamps, at = _stamps(motion, design, design.gyro, truth, begin, stop)
        values = sample_gyro(
            felt,
            truth.gyro,
            at,
            sampling=sampling,
            seed=child(root, GYRO_NOISE),
            straight=STRAIGHT_RATE,
        )
        table = _table(stamps, values, GYRO, sampling, design, design.gyro)
        gyro = RecordedTriad(table, told, design.gyro.part)
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
    if sampling not in SAMPLINGS:
        raise ConfigError(
            "simulation.no-kind-sampling",
            quantity="sampling",
            sampling=sampling,
            samplings=SAMPLINGS,
        )
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
    motion: Motion, mounting: Mounting, ringing: tuple[Any, ...], mounted: bool
) -> tuple[Motion, Callable[[Array], Array] | None]:
    """Motion of the sensors, and the vibration it contains."""
    plain = not ringing and not any(mounting.position) and not any(mounting.angles_deg)
    if mounted or plain:
        return motion, None
    from strapdown.simulation.mounted_motion import (  # type: ignore[import-not-found,unused-ignore]
        MountedMotion,
    )

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


def _record_accelerometer(
    felt: Motion,
    design: RecorderDesign,
    which: int,
    truth: RecorderTruth,
    bounds: tuple[float, float],
    sampling: str,
    seed: Seed,
    vibration: Callable[[Array], Array] | None,
) -> RecordedTriad:
    triad, errors = design.accelerometers[which], truth.accelerometers[which]
    stamps, at = _stamps(felt, design, triad, truth, *bounds)
    shaken = None
    if vibration is not None and any(errors.axis("vibration_rectification")):
        shaken = _mean_square(vibration, at, felt.duration)
    values = sample_accelerometer(
        felt,
        errors,
        at,
        sampling=sampling,
        seed=seed,
        straight=STRAIGHT_FORCE,
        vibration=shaken,
    )
    table = _table(stamps, values, ACCEL, sampling, design, triad)
    return RecordedTriad(table, design.told(which), triad.part)


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


def _table(
    stamps: Array,
    values: Array,
    columns: list[str],
    sampling: str,
    design: RecorderDesign,
    triad: TriadDesign,
) -> pd.DataFrame:
    table = pd.DataFrame(values, index=pd.Index(stamps, name="time"), columns=columns)
    table.attrs = {"sampling": sampling, "source": f"{design.name} {triad.part}"}
    return table


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
                errors = replace(errors, bias=_uniform(design.high_g_bias, root, k))
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
            _shifted(told.position, _triad(told.position_sd * moved[:3])),
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


def _uniform(bound: float, root: Seed, which: int) -> Triad:
    generator = np.random.Generator(np.random.PCG64(child(root, HIGH_G, which)))
    return _triad(generator.uniform(-bound, bound, 3))


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


def _shifted(triad: Triad, by: Triad) -> Triad:
    x, y, z = (float(a + b) for a, b in zip(triad, by, strict=True))
    return (x, y, z)


# Cache of a motion's samples.


class RememberedMotion:
    """A motion that caches its samples for several triads.

    Parameters
    ----------
    motion : Motion
        Its rates and specific forces are cached for each array of instants.
    """

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
