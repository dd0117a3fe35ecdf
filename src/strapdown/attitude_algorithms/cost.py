"""Computational cost of an algorithm: operations per step, and memory."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from strapdown import rotation
from strapdown._kernels import arithmetic
from strapdown._kernels.arithmetic import single_precision
from strapdown.attitude_algorithms.algorithm import AttitudeAlgorithm, Restarts, pieces_of
from strapdown.constants import CORTEX_M4F_CYCLES, Array
from strapdown.tables import GYRO

STEPS = 12
TURN = 0.01


@dataclass(frozen=True)
class Cost:
    """Computational cost of one sample.

    Attributes
    ----------
    algorithm : str
    add, multiply, divide, sqrt, trig : float
        Operations, counted on the kernel itself in steps of 0.01 rad, and averaged over the
        samples of a block. Subtractions count as additions.
    cycles : float
        The same in cycles of a Cortex-M4F (`constants.CORTEX_M4F_CYCLES`): a weight for ranking.
    memory : int
        Count of numbers stored between samples.
    """

    algorithm: str
    add: float
    multiply: float
    divide: float
    sqrt: float
    trig: float
    cycles: float
    memory: int


class _State(list[Any]):
    """A state that records which of its elements were used."""

    used = 0

    def __getitem__(self, index: Any) -> Any:
        self.used = max(self.used, index + 1)
        return super().__getitem__(index)

    def __setitem__(self, index: Any, value: Any) -> None:
        self.used = max(self.used, index + 1)
        super().__setitem__(index, value)


def count_cost(algorithm: AttitudeAlgorithm, dt: ArrayLike | None = None) -> Cost:
    """Count the operations of one sample, averaged over steps `dt` in s of a log."""
    lengths = np.full(STEPS, 0.01) if dt is None else np.asarray(dt, dtype=np.float64)
    first = max(0, (len(lengths) - STEPS) // 2)
    middle = np.resize(lengths[first : first + STEPS], STEPS)
    count: Counter[str] = Counter()
    kernel = type(algorithm).advance_kernel
    kernels = arithmetic.counted_kernels(arithmetic.kernel_home(kernel))
    step = getattr(kernels, kernel.__name__.replace("_advance", "_step"))
    start = algorithm.begin(rotation.quaternion_from_euler([20.0, -35.0, 250.0]))
    state = _State(arithmetic.Counted(float(v), count) for v in start)
    for k, length in enumerate(middle.tolist()):
        # The axis changes a little from step to step, as in every motion.
        theta = (0.6 * TURN, (0.64 - 0.01 * k) * TURN, (0.48 + 0.01 * k) * TURN)
        dtheta = (0.0, -0.01 * TURN, 0.01 * TURN)
        numbers = [arithmetic.Counted(v, count) for v in (length, *theta, *dtheta)]
        step(state, *numbers, *algorithm.kernel_options())
    operations = {kind: count[kind] / STEPS for kind in CORTEX_M4F_CYCLES}
    return Cost(
        algorithm=algorithm.label,
        **operations,
        cycles=sum(operations[kind] * weight for kind, weight in CORTEX_M4F_CYCLES.items()),
        memory=state.used,
    )


# Execution time of an algorithm's sample on the current machine.


COLUMNS = ["algorithm", "float64_ns", "float32_ns"]
_STEPS = 20_000
_ROUNDS = 5


def time_algorithms(algorithms: Sequence[AttitudeAlgorithm]) -> pd.DataFrame:
    """Measure the time of a sample in ns, double and single precision: best of five batches."""
    rng = np.random.default_rng(0)
    theta = rng.normal(0.0, 0.01, (_STEPS, 3))
    dt, change = np.full(_STEPS, 0.01), 0.1 * theta
    rows = []
    for algorithm in algorithms:
        begun = algorithm.begin(np.array([1.0, 0.0, 0.0, 0.0]))
        row: dict[str, str | float] = {"algorithm": algorithm.label}
        kernel = type(algorithm).advance_kernel
        for column, kind in (("float64_ns", np.float64), ("float32_ns", np.float32)):
            run = kernel if kind is np.float64 else arithmetic.single_kernel(kernel)
            history = np.empty((_STEPS, algorithm.width), kind)
            inputs = [a.astype(kind) for a in (dt, theta, change)]
            options = [kind(option) for option in algorithm.kernel_options()]
            best = np.inf
            for _ in range(_ROUNDS):
                state = begun.astype(kind)
                start = perf_counter()
                run(state, *inputs, history, *options)
                best = min(best, perf_counter() - start)
            row[column] = best / _STEPS * 1e9
        rows.append(row)
    return pd.DataFrame(rows, columns=COLUMNS)


# An attitude algorithm in single precision, as an embedded processor runs it.


Single = NDArray[np.float32]


def single_increments(imu: pd.DataFrame, interpolation: str = "linear") -> tuple[Single, ...]:
    """Single-precision increments, (n,) s, (n, 3) rad, (n, 3) rad, from rates read as floats."""
    kernel = single_precision("increments")
    dt = np.diff(imu.index.to_numpy(dtype=np.float64)).astype(np.float32)
    rate = np.ascontiguousarray(imu[GYRO].to_numpy(dtype=np.float32))
    theta = np.empty((len(dt), 3), np.float32)
    dtheta = np.empty_like(theta)
    mean = imu.attrs["sampling"] == "mean"
    if interpolation == "cubic" and not mean:
        kernel.increments_cubic(dt, rate, theta, dtheta)
    else:
        kernel.increments(dt, rate, mean, theta, dtheta)
    return dt, theta, dtheta


def run_single(
    algorithm: AttitudeAlgorithm,
    increments: tuple[Single, ...],
    q_nb: ArrayLike,
    restarts: Restarts = (),
) -> Array:
    """Quaternions, (n+1, 4), of an algorithm with every operation in single precision."""
    dt, theta, dtheta = increments
    advance = arithmetic.single_kernel(type(algorithm).advance_kernel)
    options = [np.float32(option) for option in algorithm.kernel_options()]
    out = []
    for part, start in pieces_of(len(dt), q_nb, restarts):
        state = algorithm.begin(rotation.normalise(start)).astype(np.float32)
        first = state[None, : algorithm.width].astype(np.float64)
        history = np.empty((part.stop - part.start, algorithm.width), np.float32)
        advance(state, dt[part], theta[part], dtheta[part], history, *options)
        out.append(algorithm.quaternions(np.vstack([first, history.astype(np.float64)])))
    return np.vstack(out)
