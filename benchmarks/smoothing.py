"""Half an hour at 100 Hz with a fix a second, smoothed: against the filter alone."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from benchmarks.drive30 import ACCEL_BIAS, GYRO_BIAS, START_SD, drive, navigator
from benchmarks.measure import Ratio, by_turns


def ratios() -> Iterator[Ratio]:
    from strapdown.increments import motion_increments
    from strapdown.navigation.recorder import IntervalRecorder
    from strapdown.navigation.smoother import RauchTungStriebel
    from strapdown.tables import gnss_table

    made = drive(1)
    fixes = gnss_table(
        made.fix_time, made.fix, np.zeros((len(made.fix), 3)), (1.0,) * 3, (np.inf,) * 3
    )
    table = motion_increments(made.imu)
    time, rows = table.index.to_numpy(), np.ascontiguousarray(table.to_numpy())
    place, speed, level, heading = START_SD
    nine = np.r_[[place] * 3, [speed] * 3, np.radians([level, level, heading])]
    P = np.diag(np.r_[nine, [GYRO_BIAS] * 3, [ACCEL_BIAS] * 3] ** 2)
    alone = navigator("joseph")
    both = replace(alone, smoother=RauchTungStriebel())

    def forward() -> None:
        tape = IntervalRecorder().begin(alone)
        state, piece = alone.advance(
            alone.tell(alone.begin(made.start, P), "gnss", fixes), time, rows
        )
        tape.take(piece)
        tape.take(alone.finish(state))
        tape.record()

    def smoothed() -> None:
        tape, later = IntervalRecorder().begin(both), RauchTungStriebel().begin(both)
        state, piece = both.advance(both.tell(both.begin(made.start, P), "gnss", fixes), time, rows)
        for one in (piece, both.finish(state)):
            tape.take(one)
            later.take(one)
        tape.record(smoothing=later)

    ours, theirs = by_turns(smoothed, forward, rounds=5)
    yield Ratio(
        "30 min at 100 Hz, covariance at 10 Hz, forward and smoothed",
        ours * 1e3,
        "the filter alone",
        theirs * 1e3,
        "ms",
        None,
    )
