"""The answer of the attitude bench, against one run of another library over the same log."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from pathlib import Path

from benchmarks.measure import Ratio, by_turns

RATE = 200.0


def ratios() -> Iterator[Ratio]:
    from strapdown.api.attitude import compare_attitude
    from strapdown.formats.writers import WRITERS
    from strapdown.simulation import ImuErrors, find_scenario, simulate_imu
    from strapdown.tables import GYRO

    # Ten minutes at 200 Hz, nine algorithms, six rates, both ways to come to them.
    imu, truth = simulate_imu(find_scenario("handling").motion, ImuErrors(), rate=RATE)
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "log.csv"
        WRITERS["csv"].write(log, {"imu": imu, "reference": truth})

        def answer() -> None:
            compare_attitude(log, algorithms="all")

        answer()
        try:
            from ahrs.filters import AngularRate
        except ImportError:
            print("ahrs is not installed (the extra 'bench'): left out")
            return
        gyro = imu[GYRO].to_numpy()
        ours, theirs = by_turns(answer, lambda: AngularRate(gyr=gyro, frequency=RATE), rounds=3)
        yield Ratio(
            "an answer: 9 algorithms, 6 rates, 120 000 samples",
            ours,
            "one run of ahrs AngularRate over them",
            theirs,
            "s",
            1.0,
        )
