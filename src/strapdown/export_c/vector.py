"""A short record and the attitudes that the kernels find for it, in double and single precision."""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown._kernels import arithmetic
from strapdown.attitude import AttitudeAlgorithm
from strapdown.attitude.cost import step_kernel
from strapdown.tables import GYRO

Array = NDArray[np.float64]
SAMPLES = 48
# Roundings of a step that another compiler may make otherwise (fused products, its own sine): a
# product of quaternions is four sums of four products, 4 roundings of half an eps each, and so
# 2 eps a component, 4 eps in the vector of four, 8 eps as an angle; as much again for the
# quaternion of the increment; and both runs may have them.
ROUNDINGS = 32


@dataclass(frozen=True)
class Vector:
    """A test vector.

    Attributes
    ----------
    samples : ndarray, (n, 4)
        dt in s and the rates in rad/s, each a number that single precision holds exactly.
    double, single : ndarray, (n, 4)
        The attitude at each sample by the kernels in either precision.
    condition : float
        By how much the algorithm magnifies an error near its singularity.
    """

    samples: Array
    double: Array
    single: Array
    condition: float

    @property
    def roundings(self) -> float:
        """Largest difference between two right implementations, in eps of the precision."""
        return len(self.samples) * ROUNDINGS * self.condition


def motion() -> Array:
    """Turns that grow from nothing to 0.8 rad a step, in equal steps and then in unequal ones.

    So both the series and the functions are used, and both kinds of blocks.
    """
    k = np.arange(SAMPLES)
    dt = np.where((k > SAMPLES / 2) & (k % 5 > 2), 0.09375, 0.0625)
    grow = 0.2 * k
    # Most of it about one axis, so that pitch stays away from its pole.
    rates = [grow, 0.4 * grow * np.sin(0.9 * k), 0.4 * grow * np.cos(0.7 * k)]
    return np.column_stack([dt, *rates])


def _rows(imu: pd.DataFrame) -> Array:
    part = imu.iloc[:SAMPLES]
    time = part.index.to_numpy(dtype=np.float64)
    return np.column_stack([np.diff(time, prepend=time[0]), part[GYRO].to_numpy(dtype=np.float64)])


def make_vector(
    algorithm: AttitudeAlgorithm, q_nb: Array, kind: str, imu: pd.DataFrame | None
) -> Vector:
    """Run the kernels in both precisions over the same samples.

    Parameters
    ----------
    algorithm : AttitudeAlgorithm
    q_nb : ndarray, (4,)
        Where it starts.
    kind : {'linear', 'cubic', 'mean'}
    imu : DataFrame, optional
        Its first 48 samples; a motion of its own where not given.
    """
    rows = motion() if imu is None else _rows(imu)
    rows = rows.astype(np.float32).astype(np.float64)
    if kind == "mean" and imu is not None:
        rows = rows[1:]  # the first mean belongs to an interval that begins before the log
    elif kind != "mean":
        rows[0, 0] = 0.0
    double, state = _run(algorithm, rows, q_nb, kind, single=False)
    single, _ = _run(algorithm, rows, q_nb, kind, single=True)
    # The angles' rates have 1/cos(pitch) as a factor, and so have errors in them.
    condition = 1.0 / max(float(state[3]), 1e-3) if algorithm.name == "euler" else 1.0
    return Vector(rows, double, single, condition)


def _run(
    algorithm: AttitudeAlgorithm, rows: Array, q_nb: Array, kind: str, single: bool
) -> tuple[Array, Array]:
    number: Any = np.float32 if single else np.float64
    home = step_kernel(algorithm)[0]

    def module(name: str) -> Any:
        if single:
            return arithmetic.single_precision(name)
        return importlib.import_module(f"{arithmetic.PACKAGE}.{name}")

    dt, rate = rows[:, 0].astype(number), rows[:, 1:].astype(number)
    if kind == "mean":
        # A mean has no sample at the start; what stands there is not used.
        rate = np.vstack([rate[:1], rate])
    else:
        dt = dt[1:]
    dt, rate = np.ascontiguousarray(dt), np.ascontiguousarray(rate)
    theta = np.empty((len(dt), 3), number)
    dtheta = np.empty_like(theta)
    if kind == "cubic":
        module("increments").increments_cubic(dt, rate, theta, dtheta)
    else:
        module("increments").increments(dt, rate, kind == "mean", theta, dtheta)
    state = algorithm.begin(q_nb).astype(number)
    history = np.empty((len(dt), algorithm.width), number)
    first = state[None, : algorithm.width].copy()
    name = type(algorithm).advance_kernel.__name__
    options = [number(o) for o in algorithm.kernel_options()]
    getattr(module(home), name)(state, dt, theta, dtheta, history, *options)
    if kind != "mean":
        history = np.vstack([first, history])
    return algorithm.quaternions(np.ascontiguousarray(history, dtype=np.float64)), state
