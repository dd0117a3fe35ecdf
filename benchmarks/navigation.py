"""Navigation: the kernels against C and python-ins, one sample a call, a log in segments."""

from __future__ import annotations

import ctypes
import tracemalloc
from collections.abc import Iterator
from typing import Any

import numpy as np

from benchmarks.c_library import c_library
from benchmarks.measure import Ratio, by_turns

SAMPLES = 200_000
STEP = 0.01
# The motion of a hand that waves for half an hour has no reason to stay near the ground.
LIMITS = {"height_limits": (-1e9, 1e9), "largest_speed": 30_000.0}


def samples(count: int) -> tuple[np.ndarray, np.ndarray]:
    t = np.arange(count) * STEP
    gyro = np.column_stack([0.3 * np.sin(t), 0.2 * np.cos(0.7 * t), np.full(count, 0.1)])
    accel = np.column_stack([0.1 * np.sin(t), 0.2 * np.cos(t), np.full(count, -9.8)])
    return gyro, accel


def ratios() -> Iterator[Ratio]:
    from strapdown._kernels import motion_increments as increments
    from strapdown._kernels import ned as kernel
    from strapdown._kernels import wander
    from strapdown.ellipsoids import WGS84
    from strapdown.increments import motion_increments
    from strapdown.mechanization import NavTracker, NorthEastDown, WanderAzimuth, run_mechanization
    from strapdown.nav_state import NavState
    from strapdown.tables import imu_table

    gyro, accel = samples(SAMPLES)
    dt = np.full(SAMPLES - 1, STEP)
    mechanization = NorthEastDown(**LIMITS)
    start = NavState.from_degrees(51.5, 34.0, 100.0, v_n=[10.0, 0.0, 0.0])
    begin = mechanization.begin(start)
    rows = np.empty((SAMPLES - 1, 10))
    history = np.empty((SAMPLES - 1, 10))
    none = np.empty(0)
    earth, options = WGS84.parameters(), mechanization.kernel_options()

    def batch() -> None:
        increments.motion_increments_linear(dt, gyro, accel, False, rows)
        kernel.ned_advance(begin.copy(), rows, none, earth, options, history)

    pointer = ctypes.POINTER(ctypes.c_double)
    library = c_library("navigation_limit.c")
    if library is not None:
        library.mech_run.argtypes = [
            ctypes.c_long,
            pointer,
            pointer,
            ctypes.c_double,
            pointer,
            pointer,
        ]
        library.mech_run.restype = None
        initial = np.array(
            [start.lat, start.lon, start.alt, *start.v_n, 1, 0, 0, 0, 1, 0, 0, 0, 1.0]
        )
        out = np.empty((SAMPLES, 15))
        g, f, i, o = (a.ctypes.data_as(pointer) for a in (gyro, accel, initial, out))
        ours, theirs = by_turns(batch, lambda: library.mech_run(SAMPLES, g, f, STEP, i, o))
        # Both must have done the same work: a minute apart by less than their methods differ.
        assert np.abs(history[5998, 3:6] - out[5999, 3:6]).max() < 1e-2
        yield Ratio(
            "rates to states, batch, a sample",
            ours / SAMPLES * 1e9,
            "the same in C",
            theirs / SAMPLES * 1e9,
            "ns",
            1.25,
        )

    wandering = WanderAzimuth(**LIMITS)
    at_start = wandering.begin(start)
    wandered = np.empty((SAMPLES - 1, wandering.row))

    def steps() -> None:
        kernel.ned_advance(begin.copy(), rows, none, earth, options, history)

    def wander_steps() -> None:
        wander.wander_advance(at_start.copy(), rows, none, earth, options, wandered)

    batch()
    ours, theirs = by_turns(wander_steps, steps)
    # The same motion, to what the two methods differ by.
    assert np.abs(wandered[5998, 4] - history[5998, 2]) < 1e-3
    yield Ratio(
        "wander azimuth, a step",
        ours / SAMPLES * 1e9,
        "north-east-down",
        theirs / SAMPLES * 1e9,
        "ns",
        1.5,
    )

    imu = imu_table(np.arange(SAMPLES) * STEP, gyro, accel)

    def from_table() -> Any:
        return run_mechanization(mechanization, start, motion_increments(imu)).trajectory

    yield from against_python_ins(imu, start, batch, from_table)

    part = 20_000
    stamps = (np.arange(part) * STEP).tolist()
    rates, forces = list(gyro[:part]), list(accel[:part])

    def one_by_one() -> None:
        update = NavTracker(start, mechanization).update
        for time, rate, force in zip(stamps, rates, forces, strict=True):
            update(time, rate, force)

    ours, theirs = by_turns(one_by_one, batch, rounds=7)
    yield Ratio(
        "navigation, one sample a call",
        ours / part * 1e9,
        "the batch, a sample",
        theirs / SAMPLES * 1e9,
        "ns",
        60.0,
    )

    yield segments(NorthEastDown(height="held", **LIMITS), start)


def against_python_ins(imu: Any, start: Any, batch: Any, from_table: Any) -> Iterator[Ratio]:
    try:
        from pyins.strapdown import Integrator, compute_increments_from_imu
    except ImportError:
        print("python-ins is not installed (the extra 'test'): left out")
        return
    initial = start.to_trajectory().iloc[0]

    def theirs_all() -> None:
        Integrator(initial).integrate(compute_increments_from_imu(imu, "rate"))

    for what, job, limit in (
        ("rates to states, batch, a sample", batch, 1 / 10),
        ("from Imu table to Trajectory table, a sample", from_table, None),
    ):
        ours, theirs = by_turns(job, theirs_all, rounds=7)
        yield Ratio(
            what,
            ours / SAMPLES * 1e9,
            "python-ins, its public functions",
            theirs / SAMPLES * 1e9,
            "ns",
            limit,
        )


def segments(mechanization: Any, start: Any) -> Ratio:
    """Peak of memory over a log of an hour against one of five minutes, both in segments."""
    from strapdown.mechanization import navigate_segments
    from strapdown.tables import imu_table

    length = 3_000
    gyro, accel = samples(length)
    gyro = 0.001 * gyro

    def peak(count: int) -> float:
        pieces = (
            imu_table((np.arange(length) + k * length) * STEP, gyro, accel) for k in range(count)
        )
        tracemalloc.start()
        for _ in navigate_segments(mechanization, start, pieces):
            pass
        _, most = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        return most / 1e6

    peak(2)
    return Ratio(
        "an hour at 100 Hz in segments, peak", peak(120), "five minutes", peak(10), "MB", 1.1
    )
