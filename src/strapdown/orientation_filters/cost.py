"""Computational cost of an orientation filter, and its error in single precision."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from functools import lru_cache
from time import perf_counter

import numpy as np
import pandas as pd

from strapdown import rotation
from strapdown._kernels import arithmetic, orientation
from strapdown.attitude_algorithms import Cost
from strapdown.constants import CORTEX_M4F_CYCLES, Array
from strapdown.orientation_filters.filter import OrientationEstimator
from strapdown.tables import ACCEL, GYRO, MAG

#: Samples over which operations are averaged; whole blocks of every usual rate.
SAMPLES = 120


@lru_cache(maxsize=64)
def count_filter_cost(chosen: OrientationEstimator, step: float, magnetometer: bool) -> Cost:
    """Count the operations of one sample of a slowly turning body.

    It takes a fifth of a comparison of short logs, and is the same for each.

    Parameters
    ----------
    step : float, s
        Usual step of the samples: a filter that works in blocks costs less at higher rates.
    magnetometer : bool

    Returns
    -------
    Cost
        `memory` is the size of the record.
    """
    count: Counter[str] = Counter()
    kernel = type(chosen).advance_kernel
    kernels = arithmetic.counted_kernels(arithmetic.kernel_home(kernel))
    sample = getattr(kernels, kernel.__name__.replace("_advance", "_sample"))
    record = chosen.begin()
    record[orientation.SAMPLES], record[orientation.STEP] = 1.0, step
    state = [arithmetic.Counted(float(v), count) for v in record]
    field = (20.0, 1.0, 40.0) if magnetometer else (np.nan,) * 3
    for k in range(SAMPLES):
        # The first leads to a level and a heading, which are not counted.
        if k == 1:
            count.clear()
        values = (step, 0.3, 0.32 - 0.01 * k, 0.2, 0.1, -0.2, -9.8, *field)
        sample(state, *(arithmetic.Counted(v, count) for v in values))
    operations = {kind: count[kind] / (SAMPLES - 1) for kind in CORTEX_M4F_CYCLES}
    return Cost(
        algorithm=chosen.label,
        **operations,
        cycles=sum(operations[kind] * weight for kind, weight in CORTEX_M4F_CYCLES.items()),
        memory=chosen.size,
    )


def single_precision_error_deg(
    chosen: OrientationEstimator, imu: pd.DataFrame, sampling: str, q_nb: Array
) -> float:
    """Largest rotation angle, deg, from the attitudes `q_nb`, (n, 4), to single precision's."""
    kernel = arithmetic.single_kernel(type(chosen).advance_kernel)
    time = imu.index.to_numpy(dtype=np.float64)
    blocks = [
        np.ascontiguousarray(imu[columns].to_numpy(dtype=np.float32))
        if set(columns) <= set(imu.columns)
        else np.empty((0, 3), np.float32)
        for columns in (GYRO, ACCEL, MAG)
    ]
    record = chosen.begin(None, sampling).astype(np.float32)
    history = np.empty((len(time), chosen.row), np.float32)
    kernel(record, np.diff(time, prepend=time[0]).astype(np.float32), *blocks, history)
    single = chosen.attitudes(history[:, :4].astype(np.float64), record.astype(np.float64))
    return float(np.max(rotation.rotation_angle(single, q_nb)))


def time_filters(chosen: Sequence[OrientationEstimator], rate_hz: float = 100.0) -> pd.DataFrame:
    """Measure the time of a sample with a magnetometer in ns, as `time_algorithms`."""
    count, rounds = 20_000, 5
    rng = np.random.default_rng(0)
    gyro = rng.normal(0.0, 0.5, (count, 3))
    accel = rng.normal(0.0, 0.5, (count, 3)) + np.array([0.0, 0.0, -9.8])
    mag = rng.normal(0.0, 0.5, (count, 3)) + np.array([20.0, 0.0, 40.0])
    dt = np.full(count, 1.0 / rate_hz)
    rows = []
    for each in chosen:
        row: dict[str, str | float] = {"algorithm": each.label}
        for column, kind in (("float64_ns", np.float64), ("float32_ns", np.float32)):
            kernel = type(each).advance_kernel
            if kind is np.float32:
                kernel = arithmetic.single_kernel(kernel)
            inputs = [a.astype(kind) for a in (dt, gyro, accel, mag)]
            history = np.empty((count, each.row), kind)
            best = np.inf
            for _ in range(rounds):
                record = each.begin().astype(kind)
                start = perf_counter()
                kernel(record, *inputs, history)
                best = min(best, perf_counter() - start)
            row[column] = best / count * 1e9
        rows.append(row)
    return pd.DataFrame(rows)
