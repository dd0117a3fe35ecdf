"""How much memory the whole bench takes over what its log takes."""

from __future__ import annotations

import tracemalloc
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks.measure import Ratio


def ratios() -> Iterator[Ratio]:

    from strapdown import compare_attitude, read_log, simulate

    with TemporaryDirectory() as folder:
        seal = simulate("alexiev-fig2c", rate_hz=20_000).save(Path(folder) / "log", formats=["npz"])
        log = seal.path / "log.npz"
        compare_attitude(log)  # everything is loaded and compiled before memory is counted
        table = read_log(log).imu
        size = table.to_numpy().nbytes + table.index.to_numpy().nbytes
        tracemalloc.start()
        compare_attitude(log)
        _, peak = tracemalloc.get_traced_memory()
        tracemalloc.stop()
    yield Ratio(
        "attitude bench, four algorithms with truth, peak",
        peak / 1e6,
        "the Imu table itself",
        size / 1e6,
        "MB",
        None,
    )
