"""A vehicle that stands, drives off, coasts and is struck; and units that feel it."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd

from strapdown import rotation
from strapdown.sensors.crash_unit import CrashUnit, Mounting, RecordedTriad
from strapdown.sensors.uncertainty import TriadUncertainty

G = 9.80665
LOW = TriadUncertainty(
    noise_density=0.003, bias=0.2, scale=0.02, full_scale=2 * G, quantization=0.0, bandwidth=1e4
)
HIGH = TriadUncertainty(noise_density=0.05, bias=5.0, scale=0.02, full_scale=100 * G)
GYRO = TriadUncertainty(noise_density=2.5e-4, bias=0.05, full_scale=math.radians(500.0))


def haversine(x):
    """Of unit area over x from 0 to 1."""
    return np.where((x > 0) & (x < 1), 2 * np.sin(np.pi * np.clip(x, 0, 1)) ** 2, 0.0)


def vehicle(time, *, roll=1.0, pitch=-2.0, peak=13 * G, yaw_rate=1.52, driven=True):
    """Specific force and rates in vehicle axes; the trigger is at zero, the crash 113 ms.

    The vehicle drives off at -4 s for 2 s, and turns by nothing before the crash; roll and
    pitch stay (the yaw of the crash is about the vehicle's down axis).
    """
    gravity = rotation.dcm_from_euler([roll, pitch, 0.0]).T @ [0.0, 0.0, -G]
    force = np.tile(gravity, (time.size, 1))
    if driven:
        force[:, 0] += 3.5 * haversine((time + 4.0) / 2.0)
    pulse = haversine(time / 0.113) / 2
    force[:, 0] -= peak * pulse
    force[:, 1] += 0.3 * peak * pulse
    x = np.clip(time / 0.113, 0.0, 1.0)
    rate = np.zeros_like(force)
    rate[:, 2] = yaw_rate * (x - np.sin(2 * np.pi * x) / (2 * np.pi))
    return force, rate


def table(time, values, kind):
    out = pd.DataFrame(
        values, index=pd.Index(time, name="time"), columns=[f"{kind}_{a}" for a in "xyz"]
    )
    out.attrs = {"sampling": "instantaneous"}
    return out


def record(time, truth, uncertainty, rng, *, bias=(0.0, 0.0, 0.0), noisy=True):
    """What a triad with this noise and full scale makes of the truth."""
    step = time[1] - time[0]
    sd = np.asarray(uncertainty.noise_density) / math.sqrt(step)
    y = truth + bias + noisy * sd * rng.normal(size=truth.shape)
    full, q = np.asarray(uncertainty.full_scale), np.asarray(uncertainty.quantization)
    y = np.clip(y, -full, full)
    coarse = q > 0
    y[:, coarse] = np.rint(y[:, coarse] / q[coarse]) * q[coarse]
    return y


def unit(
    *,
    start=-10.0,
    end=1.0,
    rate=200.0,
    seed=0,
    noisy=True,
    low=LOW,
    high=HIGH,
    gyro=GYRO,
    low_bias=(0.0, 0.0, 0.0),
    high_bias=(3.0, -11.91, 2.0),
    gyro_bias=(0.02, -0.03, 0.01),
    mounting=None,
    name="IMU1",
    **motion,
):
    """A unit with two ranges; returns it with the true force and rates in vehicle axes."""
    rng = np.random.default_rng(seed)
    time = np.arange(round(start * rate), round(end * rate) + 1) / rate
    force, turn = vehicle(time, **motion)
    mounting = mounting or Mounting()
    f, w = force @ mounting.C_vs, turn @ mounting.C_vs
    made = CrashUnit(
        name,
        (
            RecordedTriad(
                table(time, record(time, f, low, rng, bias=low_bias, noisy=noisy), "accel"),
                low,
                "low-G",
            ),
            RecordedTriad(
                table(time, record(time, f, high, rng, bias=high_bias, noisy=noisy), "accel"),
                high,
                "high-G",
            ),
        ),
        RecordedTriad(
            table(time, record(time, w, gyro, rng, bias=gyro_bias, noisy=noisy), "gyro"),
            gyro,
            "gyro",
        ),
        mounting,
        trigger=0.0,
    )
    return made, force, turn
