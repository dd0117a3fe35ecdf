"""Motions of a body that is carried, and phone-class samples of them, with known truth.

Angles and positions are smooth functions of time; rates and accelerations are their central
differences, which are exact to 1e-7 of their size. Levels of noise, bias, scale factor and
disturbance are drawn from what data sheets of phone sensors and surveys of rooms state.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from strapdown.tables import MAG, imu_table

G = 9.80665
KINDS = ("hand", "walk", "throw", "rest", "fast")


@dataclass(frozen=True)
class Recording:
    """Samples, and the true attitude, (n, 4), and gyro bias, rad/s."""

    imu: pd.DataFrame
    q_nb: np.ndarray
    gyro_bias: np.ndarray


def waves(rng, lowest, highest, rms, of_rate=False):
    """A sum of six sines; `rms` of itself, or of its derivative."""
    frequency = np.exp(rng.uniform(np.log(lowest), np.log(highest), 6))
    size = rng.uniform(0.5, 1.0, 6)
    size *= rms * np.sqrt(2.0 / (size**2).sum())
    if of_rate:
        size = size / (2.0 * np.pi * frequency)
    phase = rng.uniform(0.0, 2.0 * np.pi, 6)
    return lambda t: (size * np.sin(2.0 * np.pi * frequency * t[:, None] + phase)).sum(axis=1)


def smooth(u):
    u = np.clip(u, 0.0, 1.0)
    return u**3 * (10.0 - 15.0 * u + 6.0 * u * u)


def switched(rng, span, on, off, ramp):
    """Alternately 0 and 1."""
    begins, begin = [], rng.uniform(1.0, 4.0)
    while begin < span:
        length = rng.uniform(*on)
        begins.append((begin, begin + length))
        begin += length + rng.uniform(*off)
    return lambda t: sum(smooth((t - a) / ramp) * smooth((b - t) / ramp) for a, b in begins)


def carried(rng, span, kind):
    """In hand: turned and moved about; `fast`, or with rests."""
    bands = [(0.3, 1.2)] * 3 if kind == "fast" else [(0.02, 0.6)] * 3
    sizes = (0.9, 0.6, 0.6) if kind == "fast" else (0.7, 0.4, 0.5)
    turns = [waves(rng, *band, size) for band, size in zip(bands, sizes, strict=True)]
    moves = [waves(rng, 0.15, 2.0, rng.uniform(0.1, 0.5), of_rate=True) for _ in range(3)]
    share = switched(rng, span, (5.0, 20.0), (5.0, 20.0), 1.0) if kind == "rest" else np.ones_like
    return (
        lambda t: np.stack([turn(t) * share(t) for turn in turns], axis=1),
        lambda t: np.stack([move(t) * share(t) for move in moves], axis=1),
    )


def walking(rng, span):
    """A person who walks about at 1.3 m/s, the sensor swinging in a pocket or a hand."""
    fine = np.arange(-1.0, span + 1.0, 0.01)
    course, step = waves(rng, 0.01, 0.1, 1.5), rng.uniform(0.8, 1.05)
    speed = 1.3 + 0.3 * waves(rng, 0.02, 0.2, 1.0)(fine)
    north = CubicSpline(fine, speed * np.cos(course(fine))).antiderivative()
    east = CubicSpline(fine, speed * np.sin(course(fine))).antiderivative()
    swing, phase = np.radians(rng.uniform(3.0, 25.0)), rng.uniform(0.0, 6.0, 3)

    def beat(t, times, at):
        return np.sin(2.0 * np.pi * step * times * t + at)

    def angles(t):
        sway = [0.05 * beat(t, 1, phase[0]), swing * beat(t, 1, phase[1])]
        return np.stack([course(t) + sway[0], sway[1], 0.05 * beat(t, 1, phase[2])], axis=1)

    def position(t):
        side, up = 0.02 * beat(t, 1, 1.0), 0.03 * beat(t, 2, 2.0)
        return np.stack(
            [north(t) - side * np.sin(course(t)), east(t) + side * np.cos(course(t)), up], axis=1
        )

    return angles, position


def throwing(rng, span):
    """In hand, and every 6 to 13 s thrown up with a spin, and caught."""
    fine = np.arange(-1.0, span + 1.0, 0.01)
    angles, position = carried(rng, span, "hand")
    up, spin = np.zeros_like(fine), np.zeros_like(fine)
    begin = rng.uniform(3.0, 6.0)
    while begin < span - 3.0:
        push, flight = rng.uniform(0.2, 0.3), rng.uniform(0.4, 0.9)
        speed = 0.5 * G * flight
        for a, size in ((begin, -speed), (begin + push + flight, -speed)):
            inside = (fine >= a) & (fine < a + push)
            up += np.where(inside, size / push * (1.0 - np.cos(2 * np.pi * (fine - a) / push)), 0.0)
        up += G * ((fine >= begin + push) & (fine < begin + push + flight))
        end = begin + 2.0 * push + flight
        spin += rng.uniform(-12.0, 12.0) * np.clip(
            np.minimum((fine - begin) / push, (end - fine) / push), 0.0, 1.0
        )
        begin = end + rng.uniform(5.0, 12.0)
    height, turn = CubicSpline(fine, up).antiderivative(2), CubicSpline(fine, spin).antiderivative()
    return (
        lambda t: angles(t) + np.stack([0.0 * t, 0.0 * t, turn(t)], axis=1),
        lambda t: position(t) + np.stack([0.0 * t, 0.0 * t, height(t)], axis=1),
    )


def driving(rng, span):
    """A phone on the wheel of a car at 12 m/s, which turns, accelerates and brakes."""
    fine = np.arange(-1.0, span + 1.0, 0.01)
    course = CubicSpline(fine, waves(rng, 0.02, 0.15, 0.15)(fine)).antiderivative()
    speed = 12.0 + np.clip(5.0 * waves(rng, 0.01, 0.08, 1.0)(fine), -10.0, 10.0)
    north = CubicSpline(fine, speed * np.cos(course(fine))).antiderivative()
    east = CubicSpline(fine, speed * np.sin(course(fine))).antiderivative()
    wheel, tilt = waves(rng, 0.05, 0.5, 0.8), [waves(rng, 0.5, 4.0, 0.01) for _ in range(2)]
    shake = [waves(rng, 1.0, 8.0, 0.05, of_rate=True) for _ in range(3)]
    return (
        lambda t: np.stack([course(t), tilt[0](t), wheel(t) + tilt[1](t)], axis=1),
        lambda t: np.stack([north(t) + shake[0](t), east(t) + shake[1](t), shake[2](t)], axis=1),
    )


def record(kind, seed, *, span=90.0, rate=100.0, disturbed=False):
    """Samples of a phone-class sensor; `disturbed`: 10 to 50 µT, for 2 to 40 s at a time."""
    rng = np.random.default_rng([seed, sum(map(ord, kind))])
    makers = {"walk": walking, "throw": throwing, "drive": driving}
    if kind in makers:
        angles, position = makers[kind](rng, span)
    else:
        angles, position = carried(rng, span, kind)
    mounting = Rotation.from_euler("ZYX", rng.uniform([-3.1, -1.0, -3.1], [3.1, 1.0, 3.1]))

    def attitude(t):
        return Rotation.from_euler("ZYX", angles(t)) * mounting

    t, h = np.arange(0.0, span, 1.0 / rate), 1e-3
    nb = attitude(t)
    rates = (attitude(t - h).inv() * attitude(t + h)).as_rotvec() / (2.0 * h)
    pull = (position(t + h) - 2.0 * position(t) + position(t - h)) / h**2
    force = nb.inv().apply(pull - [0.0, 0.0, G])
    dip, size = np.radians(rng.uniform(40.0, 72.0)), rng.uniform(40.0, 55.0)
    field = np.tile(size * np.array([np.cos(dip), 0.0, np.sin(dip)]), (len(t), 1))
    if disturbed:
        for _ in range(3):
            push = rng.normal(size=3)
            push *= rng.uniform(10.0, 50.0) / np.linalg.norm(push)
            field += switched(rng, span, (2.0, 40.0), (20.0, 60.0), 1.0)(t)[:, None] * push
    root = np.sqrt(rate)

    def sensor(true, errors, bias, noise):
        matrix = np.eye(3) + rng.normal(0.0, errors, (3, 3))
        return true @ matrix.T + bias + rng.normal(0.0, noise, true.shape)

    bias = rng.normal(size=3)
    bias *= np.radians(np.exp(rng.uniform(np.log(0.1), np.log(2.0)))) / np.linalg.norm(bias)
    gyro = sensor(rates, 0.004, bias, np.radians(rng.uniform(0.004, 0.02)) * root)
    accel = sensor(force, 0.003, rng.normal(0.0, 0.03, 3), rng.uniform(0.001, 0.004) * root)
    mag = sensor(nb.inv().apply(field), 0.005, rng.normal(0.0, 0.7, 3), 0.5)
    imu = imu_table(t, gyro, accel)
    imu[MAG] = mag
    return Recording(imu, nb.as_quat()[:, [3, 0, 1, 2]], bias)
