"""The robust digital filter against the low-pass alone, of scipy."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from benchmarks.measure import Ratio, by_turns

SAMPLES, CHANNELS = 360_000, 6


def ratios() -> Iterator[Ratio]:
    from scipy.signal import upfirdn

    from strapdown.prefilter import Grid, RobustFir, Summed
    from strapdown.tables import imu_table

    x = np.random.default_rng(0).standard_normal((SAMPLES, CHANNELS))
    imu = imu_table(np.arange(SAMPLES) / 1000.0, x[:, :3], x[:, 3:])
    fir = RobustFir()
    low_pass = fir.low_pass(Grid(0.0, 1e-3, means=False))

    def theirs_all() -> object:
        return upfirdn(low_pass.weights, x, 1, low_pass.factor, axis=0)

    for what, job, limit in (
        (
            f"low-pass and every {low_pass.factor}th, a sample of a channel",
            lambda: low_pass.advance(low_pass.begin(CHANNELS), x),
            2.0,
        ),
        ("outliers as well, from table to tables", lambda: fir.apply(imu), None),
        ("outliers and joined increments", lambda: Summed().apply(imu), None),
    ):
        ours, theirs = by_turns(job, theirs_all, rounds=5)
        yield Ratio(
            what,
            ours / (SAMPLES * CHANNELS) * 1e9,
            "scipy.signal.upfirdn, same weights",
            theirs / (SAMPLES * CHANNELS) * 1e9,
            "ns",
            limit,
        )
