"""Crash reconstruction: the Monte Carlo against the mechanization that it repeats."""

from __future__ import annotations

import os
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np

from benchmarks.measure import Ratio, by_turns

RUNS = 10_000
RATE = 200.0
# Runs that are navigated by one call of the bare mechanization, as many as the Monte Carlo takes.
TOGETHER = 64


def ratios() -> Iterator[Ratio]:
    from numba import njit

    from strapdown._kernels.ned import ROW, ned_advance
    from strapdown.crash.path import sample_paths

    path = _path()
    leg = path.legs[1]
    steps = len(leg.rows)
    nothing = np.empty(0)

    @njit(nogil=True, error_model="numpy")
    def many(state, rows, reference, earth, options, history, runs):
        own = state.copy()
        for _ in range(runs):
            own[:] = state
            ned_advance(own, rows, reference, earth, options, history)

    def bare(_: int) -> None:
        history = np.empty((steps, ROW))
        many(leg.state, leg.rows, nothing, leg.earth, leg.options, history, TOGETHER)

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


def _path() -> Any:
    """Path of a simulated pole impact from its entry on, with everything that is not known."""
    from strapdown.crash.entry import Entry
    from strapdown.crash.reconstruction import CrashOptions, reconstruct_crash
    from strapdown.simulation.crash_motion import find_crash
    from strapdown.simulation.crash_recording import paper_units, record_crash

    crash = find_crash("pole")
    design = next(d for d in paper_units() if d.gyro is not None)
    unit, _ = record_crash(crash.motion, design, impact=crash.impacts[0], seed=1)
    entry = Entry.from_speed(7.1, 0.05, slip_sd_deg=1.0)
    options = CrashOptions(rate=RATE, window=(0.0, 0.75))
    return reconstruct_crash([unit], entry, options).main.path
