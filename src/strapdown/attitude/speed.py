"""How long a sample takes an algorithm on the machine at hand."""

from __future__ import annotations

from collections.abc import Sequence
from time import perf_counter

import numpy as np
import pandas as pd

from strapdown.attitude.algorithm import AttitudeAlgorithm
from strapdown.attitude.single import single_kernel

COLUMNS = ["algorithm", "float64_ns", "float32_ns"]
_STEPS = 20_000
_ROUNDS = 5


def time_algorithms(algorithms: Sequence[AttitudeAlgorithm]) -> pd.DataFrame:
    """Measure the time of a sample, in double and in single precision.

    Parameters
    ----------
    algorithms : sequence of AttitudeAlgorithm

    Returns
    -------
    DataFrame
        ``algorithm``, ``float64_ns``, ``float32_ns``: of one step in a batch of 20 000, the best
        of five. A figure of this machine at this moment, which is why no sealed result holds
        it.
    """
    rng = np.random.default_rng(0)
    theta = rng.normal(0.0, 0.01, (_STEPS, 3))
    dt, change = np.full(_STEPS, 0.01), 0.1 * theta
    rows = []
    for algorithm in algorithms:
        begun = algorithm.begin(np.array([1.0, 0.0, 0.0, 0.0]))
        row: dict[str, str | float] = {"algorithm": algorithm.label}
        kernels = {"float64_ns": type(algorithm).advance_kernel, "float32_ns": None}
        for column, kernel in kernels.items():
            kind = np.float64 if kernel is not None else np.float32
            run = kernel if kernel is not None else single_kernel(algorithm)
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
