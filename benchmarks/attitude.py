"""Attitude: a batch against C and against vqf, one sample a call against vqf."""

from __future__ import annotations

import ctypes
from collections.abc import Iterator

import numpy as np

from benchmarks.c_library import c_library
from benchmarks.measure import Ratio, by_turns

SAMPLES = 200_000
STEP = 0.01


def rates() -> np.ndarray:
    t = np.arange(SAMPLES) * STEP
    return np.column_stack([0.3 * np.sin(t), 0.2 * np.cos(0.7 * t), np.full(SAMPLES, 0.1)])


def ratios() -> Iterator[Ratio]:
    import strapdown as sd
    from strapdown._kernels import attitude as kernel
    from strapdown.attitude_algorithms import AttitudeTracker, Quaternion, run_attitude
    from strapdown.increments import increments_from_imu
    from strapdown.tables import imu_table

    gyro = rates()
    theta = np.ascontiguousarray(gyro * STEP)
    dtheta = np.zeros_like(theta)
    dt = np.full(SAMPLES, STEP)
    history = np.empty((SAMPLES, 4))

    def batch() -> None:
        start = np.array([1.0, 0.0, 0.0, 0.0])
        kernel.quaternion_advance(start, dt, theta, dtheta, history, 0.0, 1.0)

    pointer = ctypes.POINTER(ctypes.c_double)
    library = c_library("attitude_limit.c")
    if library is not None:
        library.att_exact.argtypes = [ctypes.c_long, pointer, ctypes.c_double, pointer]
        library.att_exact.restype = None
        out = np.zeros((SAMPLES + 1, 4))
        out[0, 0] = 1.0
        g, q = gyro.ctypes.data_as(pointer), out.ctypes.data_as(pointer)
        ours, theirs = by_turns(batch, lambda: library.att_exact(SAMPLES, g, STEP, q))
        # Both must have done the same work for the ratio to mean anything: rounding apart.
        assert np.abs(history - out[1:]).max() < 1e-9
        yield Ratio(
            "exact quaternion, batch, a sample",
            ours / SAMPLES * 1e9,
            "the same in C",
            theirs / SAMPLES * 1e9,
            "ns",
            1.3,
        )

    try:
        from vqf import VQF
    except ImportError:
        print("vqf is not installed (the extra 'bench'): left out")
        return
    accel = np.tile([0.0, 0.0, 9.81], (SAMPLES, 1))
    ours, theirs = by_turns(batch, lambda: VQF(STEP).updateBatch(gyro, accel), rounds=7)
    yield Ratio(
        "exact quaternion, batch, a sample",
        ours / SAMPLES * 1e9,
        "vqf updateBatch",
        theirs / SAMPLES * 1e9,
        "ns",
        1 / 5,
    )

    part = 20_000
    stamps = (np.arange(part) * STEP).tolist()
    samples = list(gyro[:part])

    def one_by_one() -> None:
        update = AttitudeTracker(Quaternion()).update
        for time, rate in zip(stamps, samples, strict=True):
            update(time, rate)

    def vqf_one_by_one() -> None:
        update = VQF(STEP).updateGyr
        for rate in samples:
            update(rate)

    ours, theirs = by_turns(one_by_one, vqf_one_by_one)
    yield Ratio(
        "exact quaternion, one sample a call",
        ours / part * 1e9,
        "vqf updateGyr",
        theirs / part * 1e9,
        "ns",
        4.0,
    )

    imu = imu_table(np.arange(SAMPLES) * STEP, gyro)

    def from_table() -> None:
        run_attitude(Quaternion(), increments_from_imu(imu))

    ours, theirs = by_turns(from_table, batch, rounds=7)
    yield Ratio(
        "from Imu table to Attitude table, a sample",
        ours / SAMPLES * 1e9,
        "the kernel alone",
        theirs / SAMPLES * 1e9,
        "ns",
        None,
    )

    time = np.arange(SAMPLES) * STEP
    ours, theirs = by_turns(lambda: sd.attitude(time, gyro), batch, rounds=7)
    yield Ratio(
        "sd.attitude of arrays, a sample",
        ours / SAMPLES * 1e9,
        "the kernel alone",
        theirs / SAMPLES * 1e9,
        "ns",
        3.0,
    )

    tracker = AttitudeTracker(Quaternion())
    tracker.update(0.0, gyro[0])

    def angles() -> None:
        for _ in range(part):
            tracker.roll_pitch_heading  # noqa: B018

    ours, theirs = by_turns(angles, one_by_one)
    yield Ratio(
        "angles of a tracker, a read",
        ours / part * 1e9,
        "its update with one sample",
        theirs / part * 1e9,
        "ns",
        2.5,
    )
