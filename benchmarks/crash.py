"""Crash reconstruction: the Monte Carlo beside the mechanization that it repeats, its memory."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Iterator
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
    from strapdown.crash.path import sample_paths

    path = _unit().path

    def mechanization() -> None:
        with ThreadPoolExecutor(os.cpu_count()) as pool:
            list(pool.map(_bare(path), range((RUNS + TOGETHER - 1) // TOGETHER)))

    steps = sum(len(one.rows) for one in path.legs)
    per = 1e9 / (RUNS * steps)
    ours, theirs = by_turns(lambda: sample_paths(path, runs=RUNS), mechanization, rounds=7, per=per)
    # The bare mechanization runs forward alone.
    share = steps / len(path.legs[1].rows)
    what = f"crash, {RUNS} possible paths, {len(path.names)} unknowns, a step"
    theirs = tuple(share * t for t in theirs)
    yield Row(what, ours, "bare mechanization", theirs, "ns", 2.5, 2.9)
    yield from memory()


def bulk() -> Iterator[Row]:
    """Many cases in one call and one thread, beside the bare steps that they repeat."""
    from strapdown.campaign.bulk import BulkCrash, bulk_attitude, bulk_outage
    from strapdown.config.outage import OutageSpec
    from strapdown.config.sources import ScenarioSpec
    from strapdown.systems.outage_run import drift_of_sensor

    unit = _unit()
    path, crashes = unit.path, BulkCrash(unit, 1)
    bare, many = _bare(path), 32 * TOGETHER
    steps = len(path.legs[1].rows)
    ours, theirs = by_turns(
        lambda: crashes.run(0, many),
        lambda: [bare(k) for k in range(many // TOGETHER)],
        rounds=7,
        per=1e9 / (many * steps),
    )
    what = f"crash in bulk, {len(path.names)} unknowns, a step"
    yield Row(what, ours, "bare mechanization", theirs, "ns", 2.5, 3.5)
    scenario = ScenarioSpec(name="gestures")
    for algorithm in ("quaternion", "rotvec"):
        yield _attitude(algorithm, bulk_attitude(scenario, "icm-42688-p", algorithm))
    spec = OutageSpec(outage_s=60.0, sensor="icm-42688-p", start={"aided_s": 0.0})
    ranges = {"outage_s": (5.0, 60.0), "speed_m_per_s": (5.0, 40.0), "gyro.bias": (0.5, 2.0)}
    drifts = bulk_outage(spec, ranges)
    ours, theirs = by_turns(
        lambda: drifts.run(0, 1000 * TOGETHER),
        lambda: [drift_of_sensor(drifts.spec, drifts.sensors) for _ in range(10)],
        rounds=3,
        per=1e6,
    )
    ours = tuple(t / (1000 * TOGETHER) for t in ours)
    theirs = tuple(t / 10 for t in theirs)
    yield Row("predicted drift in bulk, a case", ours, "one by one", theirs, "µs", 1.0)


def _attitude(name: str, units: Any) -> Row:
    from strapdown.attitude_algorithms.algorithm import steps_of
    from strapdown.increments import increments_from_imu
    from strapdown.tables import imu_table

    rates = imu_table(units.time, units.rate.T, sampling="instantaneous")
    steps = steps_of(increments_from_imu(rates))
    algorithm, start = units.algorithm, units.truth[0]
    history = np.empty((len(steps.dt), algorithm.width))
    options, many = algorithm.kernel_options(), 4 * TOGETHER

    def bare() -> None:
        for _ in range(many):
            state = algorithm.begin(start)
            type(algorithm).advance_kernel(
                state, steps.dt, steps.theta, steps.dtheta, history, *options
            )

    per = 1e9 / (many * len(steps.dt))
    ours, theirs = by_turns(lambda: units.run(0, many), bare, rounds=7, per=per)
    return Row(
        f"attitude in bulk, {name}, a unit, a step", ours, "bare algorithm", theirs, "ns", 2.5, 3.5
    )


def _bare(path: Any) -> Callable[[int], None]:
    """As many runs by the mechanization alone as the Monte Carlo takes in a call."""
    from strapdown._kernels.ned import ROW, ned_advance
    from strapdown.mechanization import NorthEastDown

    leg = path.legs[1]
    nothing, rows = np.empty(0), np.tile(leg.rows, (TOGETHER, 1))
    # One crash after the other, which no vehicle can do.
    options = NorthEastDown(height_limits=(-1e9, 1e9), largest_speed=30_000.0).kernel_options()

    def bare(_: int) -> None:
        history = np.empty((len(rows), ROW))
        made, _ = ned_advance(leg.state.copy(), rows, nothing, leg.earth, options, history)
        assert made == len(rows)

    return bare


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


def _unit() -> Any:
    """A simulated pole impact from its entry on, with everything that is not known."""
    from strapdown.crash.entry import Entry
    from strapdown.crash.reconstruction import CrashOptions, reconstruct_crash
    from strapdown.simulation.crash_motion import find_crash
    from strapdown.simulation.crash_recording import paper_units, record_crash

    crash = find_crash("pole")
    design = next(d for d in paper_units() if d.gyro is not None)
    unit, _ = record_crash(crash.motion, design, impact=crash.impacts[0], seed=1)
    entry = Entry.from_speed(7.1, 0.05, slip_sd_deg=1.0)
    options = CrashOptions(rate=RATE, window=(0.0, 0.75))
    return reconstruct_crash([unit], entry, options).main
