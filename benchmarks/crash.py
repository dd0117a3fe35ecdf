"""Crash reconstruction: the Monte Carlo against the mechanization that it repeats."""

from __future__ import annotations

import os
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np

from benchmarks.measure import Ratio, by_turns

RUNS = 10_000
RATE = 200.0
# Runs that are navigated by one call of the bare mechanization, as many as the Monte Carlo takes.
TOGETHER = 64


def ratios() -> Iterator[Ratio]:
    from strapdown._kernels.ned import ROW, ned_advance
    from strapdown.crash.monte_carlo import sample_paths

    path = _path()
    leg = path.legs[1]
    steps = len(leg.rows)
    nothing = np.empty(0)

    def bare(_: int) -> None:
        history = np.empty((steps, ROW))
        for _ in range(TOGETHER):
            ned_advance(leg.state.copy(), leg.rows, nothing, leg.earth, leg.options, history)

    def mechanization() -> None:
        with ThreadPoolExecutor(os.cpu_count()) as pool:
            list(pool.map(bare, range((RUNS + TOGETHER - 1) // TOGETHER)))

    ours, theirs = by_turns(lambda: sample_paths(path, runs=RUNS), mechanization, rounds=7)
    yield Ratio(
        f"{RUNS} possible paths of 750 ms, {len(path.names)} unknowns, a step",
        ours / RUNS / steps * 1e9,
        "bare mechanization, all cores",
        theirs / RUNS / steps * 1e9,
        "ns",
        3.0,
    )
