"""A body at rest whose every error is known."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from strapdown import rotation
from strapdown.alignment.alignment import Alignment, Site
from strapdown.sensors.catalogue import load_sensor
from strapdown.sensors.uncertainty import ImuUncertainty
from strapdown.simulation import ImuErrors, Origin, StationaryMotion, TriadErrors, simulate_imu

SITE = Site(55.0, 37.0, 200.0)
SENSOR = load_sensor("fog-1000")
UNCERTAINTY = ImuUncertainty.of_sensor(SENSOR)
RATE = 50.0  # Hz


@dataclass(frozen=True, eq=False)
class Rest:
    """A record, and what its sensors read too much at its end."""

    imu: pd.DataFrame
    q_nb: np.ndarray
    gyro_bias: np.ndarray
    accel_bias: np.ndarray


def resting(seed: int, seconds: float = 600.0) -> Rest:
    """A unit of the FOG-1000 class in an attitude of its own."""
    draw = np.random.default_rng(seed)
    roll, pitch, heading = draw.uniform(-5, 5), draw.uniform(-5, 5), draw.uniform(0, 360)
    motion = StationaryMotion(seconds, Origin(55.0, 37.0, 200.0), roll, pitch, heading)
    errors = SENSOR.draw(seed)

    def sampled(what: ImuErrors) -> pd.DataFrame:
        return simulate_imu(motion, what, rate=RATE, sampling="mean", seed=seed)[0]

    assert errors.accel is not None
    quiet = replace(
        errors,
        gyro=replace(errors.gyro, noise_density=0.0),
        accel=replace(errors.accel, noise_density=0.0),
    )
    ideal = sampled(ImuErrors(TriadErrors(), TriadErrors()))
    off = (sampled(quiet) - ideal).iloc[-1].to_numpy()
    q_nb = rotation.quaternion_from_euler([roll, pitch, heading])
    return Rest(sampled(errors), q_nb, off[:3], off[3:])


def roughly(rest: Rest, heading_off_deg: float = 0.5, at: str = "start") -> Alignment:
    """An attitude that is off by what a coarse one is off by."""
    phi = np.array([2e-4, -1e-4, np.radians(heading_off_deg)])
    off = rotation.quaternion_from_rotation_vector(phi)
    sd = np.array([2e-4, 2e-4, max(abs(phi[2]), 1e-3)])
    time = float(rest.imu.index[0 if at == "start" else -1])
    return Alignment("given", time, rotation.compose(off, rest.q_nb), np.diag(sd**2))
