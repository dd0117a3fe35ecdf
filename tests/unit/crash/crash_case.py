"""A unit on a vehicle that is struck, as preparation would leave it, with exact samples."""

from __future__ import annotations

import numpy as np

from strapdown.sensors.crash_unit import CrashUnit, Mounting, RecordedTriad
from strapdown.sensors.pre_crash import Levelling, PreparedUnit
from strapdown.sensors.rest import rest_between
from strapdown.sensors.uncertainty import TriadUncertainty
from strapdown.tables import ACCEL, GYRO

RATE = 200.0
LOW = TriadUncertainty(
    noise_density=0.0015, bias=0.2, scale=0.01, misalignment=0.005, full_scale=2 * 9.80665
)
HIGH = TriadUncertainty(
    noise_density=0.03,
    bias=5.0,
    scale=0.02,
    misalignment=0.01,
    nonlinearity_2=0.01,
    vibration_rectification=1e-5,
    full_scale=980.0,
)
TURN = TriadUncertainty(
    noise_density=1e-4,
    bias=0.05,
    scale=0.01,
    misalignment=0.01,
    g_sensitivity=1e-4,
    full_scale=8.7,
)
MOUNTING = Mounting((0.6, -0.5, 0.2), (0.0, 0.0, 0.0), 0.02, 0.5)


def prepared(imu, *, mounting=MOUNTING, low=LOW, high=HIGH, gyro=TURN, rest=(-1.9, -0.1)):
    """What preparation makes of exact samples `imu`, vehicle axes, impact at zero."""
    spoken = (np.abs(imu[ACCEL].to_numpy()) > 18.0).astype(np.int8)
    never = np.zeros((len(imu), 3), dtype=bool)
    noise = np.where(
        spoken > 0, np.asarray(high.noise_density), np.asarray(low.noise_density)
    ) * np.sqrt(RATE)
    unit = CrashUnit(
        "imu1",
        (
            RecordedTriad(imu[ACCEL], low, "low-g"),
            RecordedTriad(imu[ACCEL], high, "high-g"),
        ),
        RecordedTriad(imu[GYRO], gyro, "gyro"),
        mounting,
    )
    return PreparedUnit(
        unit=unit,
        imu=imu,
        range_spoken=spoken,
        clipped=never,
        gyro_clipped=never,
        noise=noise,
        gyro_noise=np.tile(np.asarray(gyro.noise_density) * np.sqrt(RATE), (len(imu), 1)),
        rest=rest_between(imu, *rest),
        rest_accel_sd=0.0,
        levelling=Levelling(0.0, 0.0, 0.02, True),
        gyro_bias_sd=(5e-4, 5e-4, 5e-4),
        bias_from=(None, 0),
        bias_sd=((0.0, 0.0, 0.0), (0.03, 0.03, 0.03)),
        gravity_matched=True,
    )
