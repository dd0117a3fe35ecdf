"""A body that is moved while it is aligned: what its sensors read then."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pandas as pd

from strapdown import rotation
from strapdown.tables import ACCEL, GYRO

Array = np.ndarray
#: Roll, pitch, yaw (n, 3), deg, and acceleration (n, 3), m/s², at some instants.
Sway = Callable[[Array], tuple[Array, Array]]

# Three points of Gauss within a sample, which is a mean over its step.
POINTS = 0.5 + 0.5 * np.array([-np.sqrt(0.6), 0.0, np.sqrt(0.6)])
WEIGHTS = np.array([5.0, 8.0, 5.0]) / 18.0
H = 1e-4  # s, of a derivative


def rocking_body(rng: np.random.Generator, end: float) -> tuple[Sway, float]:
    """Rock about a place in three angles until shortly before the end."""
    size = rng.uniform(0.05, 1.0) * rng.uniform(0.3, 1.0, 3)
    rate = rng.uniform(0.2, 1.0, 3)
    phase = rng.uniform(0.0, 2.0 * np.pi, 3)

    def sway(t: Array) -> tuple[Array, Array]:
        fades = np.clip((end - t) / 10.0, 0.0, 1.0) * np.clip(t / 10.0, 0.0, 1.0)
        fades = fades * fades * (3.0 - 2.0 * fades)
        angle = size * np.sin(2.0 * np.pi * rate * t[:, None] + phase) * fades[:, None]
        return angle, np.zeros((len(t), 3))

    return sway, 0.0


def pushed_body(rng: np.random.Generator, end: float) -> tuple[Sway, float]:
    """One to three pushes that turn the body within seconds, and move it by centimetres."""
    count = int(rng.integers(1, 4))
    at, lasts = rng.uniform(5.0, end - 15.0, count), rng.uniform(1.0, 8.0, count)
    turn = np.column_stack(
        [rng.uniform(-0.5, 0.5, (count, 2)), rng.uniform(0.3, 6.0, count) * rng.choice([-1, 1])]
    )
    shift = rng.uniform(-0.1, 0.1, (count, 3)) * [1.0, 1.0, 0.1]

    def sway(t: Array) -> tuple[Array, Array]:
        angle, acceleration = np.zeros((len(t), 3)), np.zeros((len(t), 3))
        for begin, over, by, along in zip(at, lasts, turn, shift, strict=True):
            x = np.clip((t - begin) / over, 0.0, 1.0)[:, None]
            angle += by * (x**3 * (10.0 - 15.0 * x + 6.0 * x * x))
            # The second derivative of the same quintic: from rest to rest.
            acceleration += along / over**2 * (60.0 * x - 180.0 * x**2 + 120.0 * x**3)
        return angle, acceleration

    return sway, float(turn[:, 2].sum())


def swayed(
    rng: np.random.Generator,
    end: float,
    kind: Callable[[np.random.Generator, float], tuple[Sway, float]],
) -> tuple[Callable[[pd.DataFrame], pd.DataFrame], float]:
    """What turns the samples of a body into those of one that sways, and its turn at the end."""
    sway, turned = kind(rng, end)

    def imu(table: pd.DataFrame) -> pd.DataFrame:
        table = table.copy()
        time = table.index.to_numpy(dtype=np.float64)
        dt = float(np.median(np.diff(time)))
        rate, force = table[GYRO].to_numpy(), table[ACCEL].to_numpy()
        rates, forces = np.zeros_like(rate), np.zeros_like(force)
        for point, weight in zip(POINTS, WEIGHTS, strict=True):
            t = time - dt + point * dt
            angle, push = sway(t)
            C = np.swapaxes(rotation.dcm_from_euler(angle), -1, -2)
            before = rotation.quaternion_from_euler(sway(t - H)[0])
            after = rotation.quaternion_from_euler(sway(t + H)[0])
            turn = rotation.compose(rotation.conjugate(before), after)
            own = rotation.rotation_vector_from_quaternion(turn) / (2.0 * H)
            rates += weight * (np.einsum("nij,nj->ni", C, rate) + own)
            forces += weight * np.einsum("nij,nj->ni", C, force + push)
        table[GYRO], table[ACCEL] = rates, forces
        return table

    return imu, turned
