"""A text table of 10⁶ rows and 7 columns, against `pandas.read_csv`, in fresh processes.

Processor time is that of the call, after the imports, which a table of some rows has caused; memory
is the largest of the process, with its imports. pandas rounds numbers nearly; ours are the nearest
doubles.
"""

from __future__ import annotations

import json
import statistics
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pandas as pd

from benchmarks.measure import Ratio

ROWS, SMALL = 1_000_000, 300
ROUNDS = 5
_CHILD = """
import json, resource, sys, time
{imports}
read = {call}
read(sys.argv[2])
start = time.process_time()
table = read(sys.argv[1])
taken = time.process_time() - start
print(json.dumps([taken, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024]))
"""
PANDAS = ("import pandas", "pandas.read_csv")
COLUMNS = ("import pandas; from strapdown.formats import read_raw", "read_raw")
IMU = ("import pandas; from strapdown import read_imu", "read_imu")


def _write(path: Path, rows: int = ROWS) -> None:
    rng = np.random.default_rng(20)
    time = np.arange(rows) * 0.01
    rates = 0.3 * np.sin(time[:, None] * [0.5, 0.7, 0.3]) + rng.normal(0.0, 0.01, (rows, 3))
    force = rng.normal(0.0, 0.05, (rows, 3)) - [0.0, 0.0, 9.80665]
    names = ["time_s", *(f"gyro_{a}_rad_s" for a in "xyz"), *(f"accel_{a}_m_s2" for a in "xyz")]
    table = pd.DataFrame(np.column_stack([time, rates, force]), columns=names)
    table.to_csv(path, index=False, float_format="%.9f")


def _measured(job: tuple[str, str], *paths: Path) -> tuple[float, float]:
    code = _CHILD.format(imports=job[0], call=job[1])
    said = subprocess.run(
        [sys.executable, "-c", code, *map(str, paths)], check=True, capture_output=True, text=True
    )
    taken, peak = json.loads(said.stdout)
    return float(taken), float(peak)


def ratios() -> Iterator[Ratio]:
    jobs = {"pandas": PANDAS, "columns": COLUMNS, "imu": IMU}
    held: dict[str, list[tuple[float, float]]] = {name: [] for name in jobs}
    with TemporaryDirectory() as folder:
        path, small = Path(folder) / "log.csv", Path(folder) / "small.csv"
        _write(path)
        _write(small, SMALL)
        for _ in range(ROUNDS):
            for name, job in jobs.items():
                held[name].append(_measured(job, path, small))
    time = {n: 1e3 * statistics.median(t for t, _ in v) for n, v in held.items()}
    peak = {n: statistics.median(p for _, p in v) for n, v in held.items()}
    against = "pandas.read_csv"
    yield Ratio(
        "columns of a CSV, 10⁶ × 7", time["columns"], against, time["pandas"], "ms (CPU)", 2.0
    )
    yield Ratio("the same, peak memory", peak["columns"], against, peak["pandas"], "MB", 1.5)
    yield Ratio(
        "read_imu of it, with inference and checks",
        time["imu"],
        against,
        time["pandas"],
        "ms (CPU)",
        2.5,
    )
    yield Ratio("the same, peak memory", peak["imu"], against, peak["pandas"], "MB", 1.5)
