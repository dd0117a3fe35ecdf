"""Crash reconstruction: the Monte Carlo beside the mechanization that it repeats, its memory."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.commands import FLAT, MOST_MEMORY
from benchmarks.measure import Row, by_turns, strapdown

RUNS = 10_000
RATE = 200.0
# Runs that are navigated by one call of the bare mechanization, as many as the Monte Carlo takes.
TOGETHER = 64
# Runs of a case as `init` proposes it, and fifty times as many.
PROPOSED, MANY = 2_000, 100_000


def monte_carlo() -> Iterator[Row]:
    from strapdown._kernels.ned import ROW, ned_advance
    from strapdown.crash.path import sample_paths
    from strapdown.mechanization import NorthEastDown

    path = _path()
    leg = path.legs[1]
    steps = len(leg.rows)
    nothing, rows = np.empty(0), np.tile(leg.rows, (TOGETHER, 1))
    # One crash after the other, which no vehicle can do.
    options = NorthEastDown(height_limits=(-1e9, 1e9), largest_speed=30_000.0).kernel_options()

    def bare(_: int) -> None:
        history = np.empty((len(rows), ROW))
        made, _ = ned_advance(leg.state.copy(), rows, nothing, leg.earth, options, history)
        assert made == len(rows)

    def mechanization() -> None:
        with ThreadPoolExecutor(os.cpu_count()) as pool:
            list(pool.map(bare, range((RUNS + TOGETHER - 1) // TOGETHER)))

    per = 1e9 / (RUNS * sum(len(one.rows) for one in path.legs))
    ours, theirs = by_turns(lambda: sample_paths(path, runs=RUNS), mechanization, rounds=7, per=per)
    # The bare mechanization runs forward alone.
    share = sum(len(one.rows) for one in path.legs) / steps
    what = f"crash, {RUNS} possible paths, {len(path.names)} unknowns, a step"
    theirs = tuple(share * t for t in theirs)
    yield Row(what, ours, "bare mechanization", theirs, "ns", 2.5, 2.9)
    yield from memory()


def memory() -> Iterator[Row]:
    """Memory of a whole case, report and PDF included."""
    peaks = {}
    with tempfile.TemporaryDirectory(prefix="strapdown-") as name:
        folder = Path(name)
        strapdown("simulate", "pole", "-q", "--out", "pole", folder=folder)
        case = folder / "pole" / "case.toml"
        text = case.read_text(encoding="utf-8")
        said = f"monte_carlo_runs = {PROPOSED}"
        assert said in text
        for runs in (PROPOSED, MANY):
            case.write_text(text.replace(said, f"monte_carlo_runs = {runs}"), encoding="utf-8")
            used = strapdown("crash", str(case), "-q", "--force", "--out", "out", folder=folder)
            peaks[runs] = (used.peak,)
    what = f"crash, a case with {MANY} possible paths: peak memory"
    yield Row(what, peaks[MANY], "the aim", (MOST_MEMORY,), "MiB", 1.0)
    yield Row(what, peaks[MANY], f"of {PROPOSED}", peaks[PROPOSED], "MiB", FLAT)


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
