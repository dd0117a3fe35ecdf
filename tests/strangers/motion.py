"""Physically consistent motions of a body, as a cheap inertial sensor on it would report them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

G = 9.80665
MOTIONS = ("rest", "hand", "walk", "drive", "shake", "carry", "put-down")


@dataclass
class Motion:
    """Samples of one sensor, in its own axes and SI; accel is the specific force."""

    name: str
    t: np.ndarray
    gyro: np.ndarray
    accel: np.ndarray
    linear: np.ndarray  # acceleration without gravity, sensor axes
    attitude: Rotation  # sensor to east-north-up
    upright: bool  # mounted with a face up or down
    turned: bool  # gravity turned enough in the sensor to compare the gyro with


def _bumps(rng: np.random.Generator, t: np.ndarray, count: int, width: float) -> np.ndarray:
    """Smooth pulses at random instants, largest value about 1."""
    out = np.zeros(len(t))
    for _ in range(count):
        w = width * rng.uniform(0.5, 2.0)
        at = rng.uniform(t[0] + min(1.5, t[-1] / 6), t[-1])
        out += rng.choice([-1, 1]) * rng.uniform(0.4, 1.0) * np.exp(-0.5 * ((t - at) / w) ** 2)
    return out


def _tones(
    rng: np.random.Generator, t: np.ndarray, low: float, high: float, count: int = 4
) -> np.ndarray:
    out = np.zeros(len(t))
    for _ in range(count):
        out += np.sin(2 * np.pi * rng.uniform(low, high) * t + rng.uniform(0, 6.28)) / count
    return out


def _envelope(rng: np.random.Generator, t: np.ndarray) -> np.ndarray:
    """Nought, then one, then nought: most people begin and end with the thing on the table."""
    if rng.random() < 0.2:
        return np.ones(len(t))
    a, b = t[-1] * rng.uniform(0.05, 0.2), t[-1] * rng.uniform(0.8, 0.95)
    w = min(0.5, t[-1] / 20)
    return 1 / (1 + np.exp(-(t - a) / w * 4)) / (1 + np.exp((t - b) / w * 4))


def simulate(rng: np.random.Generator, t: np.ndarray) -> Motion:
    """Simulate one motion at these instants, with the errors of a cheap sensor."""
    name = str(rng.choice(MOTIONS, p=[0.08, 0.27, 0.18, 0.17, 0.08, 0.12, 0.10]))
    n, span = len(t), t[-1]
    rate, acc = np.zeros((n, 3)), np.zeros((n, 3))  # body rates; acceleration in the world
    e = _envelope(rng, t)
    if name == "hand":
        for k in range(3):
            rate[:, k] = rng.uniform(0.6, 4) * _bumps(rng, t, 2 + int(span / 6), 0.4)
            acc[:, k] = 0.7 * e * _tones(rng, t, 0.3, 2.0)
        rate *= e[:, None]
    elif name == "walk":
        f = rng.uniform(1.5, 2.1)
        for k in range(3):
            rate[:, k] = e * rng.uniform(0.3, 1.5) * np.sin(np.pi * f * t * (1 + k % 2) + k)
            acc[:, k] = e * rng.uniform(0.6, 2.0) * np.sin(2 * np.pi * f * t + 2 * k)
        acc[:, 2] += e * 2.0 * np.sin(4 * np.pi * f * t)
        rate[:, 2] += 0.6 * e * _bumps(rng, t, 1 + int(span / 10), 0.6)
    elif name == "drive":
        rate[:, 2] = e * 0.35 * _bumps(rng, t, 1 + int(span / 8), 1.5)
        rate[:, :2] = 0.02 * e[:, None] * np.column_stack([_tones(rng, t, 0.5, 3) for _ in "xy"])
        acc[:, 0] = e * 2.0 * _bumps(rng, t, 1 + int(span / 8), 1.5)
        acc[:, 1] = e * 1.5 * _bumps(rng, t, 1 + int(span / 8), 1.2)
        acc[:, 2] = 0.5 * e * _tones(rng, t, 1.0, 12.0)
    elif name == "shake":
        for k in range(3):
            acc[:, k] = e * rng.uniform(3, 15) * _tones(rng, t, 2.0, 5.0, 2)
            rate[:, k] = e * rng.uniform(1, 5) * _tones(rng, t, 2.0, 5.0, 2)
    elif name == "carry":
        for k in range(3):
            rate[:, k] = 0.5 * _tones(rng, t, 0.05, 0.6) + 0.7 * _bumps(rng, t, 2, 0.8)
            acc[:, k] = 0.8 * _tones(rng, t, 0.5, 2.5)
    elif name == "put-down":
        half = t < span * rng.uniform(0.3, 0.6)
        for k in range(3):
            rate[:, k] = half * rng.uniform(0.5, 2) * _tones(rng, t, 0.2, 1.2)
            acc[:, k] = half * 1.5 * _tones(rng, t, 0.3, 2.5)

    upright = bool(rng.random() < 0.65)
    if upright:
        start = rng.choice(
            ["flat", "down", "front", "side"], p=[0.7, 0.14, 0.08, 0.08]
        )  # which face is up
        base = {"flat": [0, 0], "down": [180, 0], "front": [90, 0], "side": [0, 90]}[str(start)]
        first = Rotation.from_euler(
            "zxy", [rng.uniform(-180, 180), *(np.array(base) + rng.normal(0, 2, 2))], degrees=True
        )
    else:
        first = Rotation.random(random_state=int(rng.integers(1 << 30)))
    # A body in the street turns about the vertical whatever way the sensor is mounted on it.
    if name in ("drive", "walk"):
        rate = first.inv().apply(rate)
        flat = Rotation.from_euler("z", rng.uniform(-180, 180), degrees=True)
        acc = flat.apply(acc)
    attitude, quats = first, np.empty((n, 4))
    steps = Rotation.from_rotvec(
        0.5 * (rate[1:] + rate[:-1]) * np.diff(t)[:, None] if n > 1 else np.zeros((0, 3))
    ).as_quat()
    q = attitude.as_quat()
    quats[0] = q
    for i in range(1, n):
        x, y, z, w = q
        a, b, c, d = steps[i - 1]
        q = np.array(
            [
                w * a + x * d + y * c - z * b,
                w * b - x * c + y * d + z * a,
                w * c + x * b - y * a + z * d,
                w * d - x * a - y * b - z * c,
            ]
        )
        quats[i] = q
    attitude = Rotation.from_quat(quats)
    linear = attitude.inv().apply(acc)
    up = attitude.inv().apply([0.0, 0.0, 1.0])
    turned = bool(np.degrees(np.arccos(np.clip(up @ up[0], -1, 1)).max()) > 35)

    gyro = rate + np.radians(rng.normal(0, 1.2, 3) * rng.choice([0.1, 1.0], p=[0.3, 0.7]))
    gyro = gyro * (1 + rng.normal(0, 0.008, 3))
    gyro += np.radians(rng.uniform(0.03, 0.25)) * rng.normal(size=(n, 3))
    force = linear + G * up
    force = force * (1 + rng.normal(0, 0.005, 3)) + rng.normal(0, 0.12, 3)
    force += rng.uniform(0.01, 0.06) * rng.normal(size=(n, 3))
    return Motion(name, t, gyro, force, linear, attitude, upright, turned)


def as_counts(
    values: np.ndarray, per_count: float, limit: int = 32767
) -> tuple[np.ndarray, np.ndarray]:
    """Counts of a converter, and the values that they stand for."""
    counts = np.clip(np.rint(values / per_count), -limit - 1, limit)
    return counts, counts * per_count
