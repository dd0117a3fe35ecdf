"""What a recorder really does, drawn from how it is built."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.sensors.crash_unit import Mounting
from strapdown.sensors.error_draws import Seed, child
from strapdown.sensors.triad_errors import Triad, TriadErrors
from strapdown.sensors.uncertainty_draws import draw_errors
from strapdown.simulation.recorder_design import RecorderDesign, RecorderTruth, WarmUp

Array = NDArray[np.float64]

# Places below the seed of a recorder: of errors and noise, each of accelerometers and gyro.
ACCEL_ERRORS, GYRO_ERRORS, ACCEL_NOISE, GYRO_NOISE, MOUNTING, TRIGGER, WARM_UP, HIGH_G = range(8)


def draw_truth(design: RecorderDesign, root: Seed) -> RecorderTruth:
    """Draw errors, mounting and trigger of one recorder.

    Parameters
    ----------
    design : RecorderDesign
    root : int or SeedSequence
        Of the recorder; each part has a stream of its own below it.

    Returns
    -------
    RecorderTruth
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
    """Angles after a small turn about the vehicle's axes, so that none is known better."""
    if told.angles_sd_deg == 0.0:
        return told.angles_deg
    turn = rotation.quaternion_from_rotation_vector(np.radians(told.angles_sd_deg) * by)
    there = rotation.quaternion_from_euler(told.angles_deg)
    return _triad(rotation.euler_from_quaternion(rotation.compose(turn, there)))


def _shifted(triad: Triad, by: Triad) -> Triad:
    x, y, z = (float(a + b) for a, b in zip(triad, by, strict=True))
    return (x, y, z)
