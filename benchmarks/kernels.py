"""Attitude, mechanization and pre-filter: from table to table, their kernels, one sample a call."""

from __future__ import annotations

import tracemalloc
from collections.abc import Iterator
from ctypes import c_double, c_long, c_void_p
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from benchmarks.measure import NO_COMPILER, Row, by_turns, c_library, pointer

SAMPLES = 200_000
# Of rows with one call a sample.
PART = 20_000
STEP = 0.01
# The motion of a hand that waves for half an hour has no reason to stay near the ground.
LIMITS = {"height_limits": (-1e9, 1e9), "largest_speed": 30_000.0}
NS = 1e9


def rates(count: int = SAMPLES) -> np.ndarray:
    t = np.arange(count) * STEP
    return np.column_stack([0.3 * np.sin(t), 0.2 * np.cos(0.7 * t), np.full(count, 0.1)])


def forces(count: int = SAMPLES) -> np.ndarray:
    t = np.arange(count) * STEP
    return np.column_stack([0.1 * np.sin(t), 0.2 * np.cos(t), np.full(count, -9.8)])


def attitude() -> Iterator[Row]:
    import strapdown as sd
    from strapdown._kernels import attitude as kernel
    from strapdown.attitude_algorithms import AttitudeTracker, Quaternion
    from strapdown.tables import imu_table

    gyro, per = rates(), NS / SAMPLES
    theta = np.ascontiguousarray(gyro * STEP)
    dtheta, dt = np.zeros_like(theta), np.full(SAMPLES, STEP)
    history = np.empty((SAMPLES, 4))

    def batch() -> None:
        start = np.array([1.0, 0.0, 0.0, 0.0])
        kernel.quaternion_advance(start, dt, theta, dtheta, history, 0.0, 1.0)

    library = c_library("attitude_limit.c")
    what = "attitude, kernel of the quaternion, a sample"
    if library is None:
        yield Row(what, against="the same in C", missing=NO_COMPILER)
    else:
        run = library.att_exact
        run.argtypes = [c_long, c_void_p, c_double, c_void_p]
        run.restype = None
        out = np.zeros((SAMPLES + 1, 4))
        out[0, 0] = 1.0
        ours, theirs = by_turns(
            batch, lambda: run(SAMPLES, pointer(gyro), STEP, pointer(out)), per=per
        )
        # Both must have done the same work for the ratio to mean anything: rounding apart.
        assert np.abs(history - out[1:]).max() < 1e-9
        yield Row(what, ours, "the same in C", theirs, "ns", 1.15)

    time = np.arange(SAMPLES) * STEP
    imu = imu_table(time, gyro)
    for what, job, limit in (
        ("attitude, `sd.attitude` from table to table, a sample", lambda: sd.attitude(imu), 4.6),
        ("attitude, `sd.attitude` of arrays, a sample", lambda: sd.attitude(time, gyro), 3.0),
    ):
        ours, theirs = by_turns(job, batch, rounds=9, per=per)
        yield Row(what, ours, "its kernel", theirs, "ns", 3.0, limit)

    def one_by_one() -> None:
        update = AttitudeTracker(Quaternion()).update
        for t, rate in zip(stamps, samples, strict=True):
            update(t, rate)

    stamps, samples = time[:PART].tolist(), list(gyro[:PART])
    yield from against_vqf(gyro, batch, one_by_one, samples)
    yield from against_imufusion(stamps, samples)

    tracker = AttitudeTracker(Quaternion())
    tracker.update(0.0, gyro[0])

    def angles() -> None:
        for _ in range(PART):
            tracker.roll_pitch_heading  # noqa: B018

    ours, theirs = by_turns(angles, one_by_one, rounds=9, per=NS / PART)
    what = "attitude, angles of a tracker, a read"
    yield Row(what, ours, "its update with one sample", theirs, "ns", 2.5)
    yield from comparison()


def against_vqf(gyro: np.ndarray, batch: Any, one_by_one: Any, samples: Any) -> Iterator[Row]:
    whole = "attitude, kernel of the quaternion, a sample", "vqf updateBatch"
    single = "attitude, one sample a call", "vqf updateGyr"
    try:
        from vqf import VQF
    except ImportError:
        for what, against in (whole, single):
            yield Row(what, against=against, missing="vqf is not installed")
        return
    accel = np.tile([0.0, 0.0, 9.81], (SAMPLES, 1))
    ours, theirs = by_turns(
        batch, lambda: VQF(STEP).updateBatch(gyro, accel), rounds=7, per=NS / SAMPLES
    )
    yield Row(whole[0], ours, whole[1], theirs, "ns", 0.2)

    def vqf_one_by_one() -> None:
        update = VQF(STEP).updateGyr
        for rate in samples:
            update(rate)

    ours, theirs = by_turns(one_by_one, vqf_one_by_one, rounds=9, per=NS / PART)
    yield Row(single[0], ours, single[1], theirs, "ns", 4.0)


def against_imufusion(stamps: Any, samples: Any) -> Iterator[Row]:
    from strapdown.orientation_filters import FILTERS, OrientationTracker

    what, against = "orientation filter, one sample a call", "imufusion update_no_magnetometer"
    try:
        import imufusion
    except ImportError:
        yield Row(what, against=against, missing="imufusion is not installed")
        return
    force, weight = np.array([0.0, 0.0, -9.81]), np.array([0.0, 0.0, 1.0])
    turning = [np.degrees(rate) for rate in samples]

    def ours_all() -> None:
        update = OrientationTracker(FILTERS["complementary"]()).update
        for t, rate in zip(stamps, samples, strict=True):
            update(t, rate, force)

    def theirs_all() -> None:
        update = imufusion.Ahrs().update_no_magnetometer
        for rate in turning:
            update(rate, weight)

    ours, theirs = by_turns(ours_all, theirs_all, rounds=9, per=NS / PART)
    yield Row(what, ours, against, theirs, "ns", 1.0)


def comparison() -> Iterator[Row]:
    """An answer of the attitude comparison over 120 000 samples: nine algorithms, six rates."""
    from strapdown import compare_attitude
    from strapdown.formats.writers import WRITERS
    from strapdown.simulation import ImuErrors, find_scenario, simulate_imu
    from strapdown.tables import GYRO

    what, against = "attitude, an answer: 9 algorithms, 6 rates", "one run of ahrs AngularRate"
    try:
        from ahrs.filters import AngularRate
    except ImportError:
        yield Row(what, against=against, missing="ahrs is not installed")
        return
    rate = 200.0
    imu, truth = simulate_imu(find_scenario("handling").motion, ImuErrors(), rate=rate)
    gyro = imu[GYRO].to_numpy()
    with TemporaryDirectory() as folder:
        log = Path(folder) / "log.csv"
        WRITERS["csv"].write(log, {"imu": imu, "reference": truth})
        ours, theirs = by_turns(
            lambda: compare_attitude(log, algorithms="all"),
            lambda: AngularRate(gyr=gyro, frequency=rate),
            rounds=3,
        )
    yield Row(what, ours, against, theirs, "s", 1.0, 1.4)


def mechanization() -> Iterator[Row]:
    from strapdown._kernels import motion_increments as increments
    from strapdown._kernels import ned as kernel
    from strapdown._kernels import wander
    from strapdown.ellipsoids import WGS84
    from strapdown.increments import motion_increments
    from strapdown.mechanization import NavTracker, NorthEastDown, WanderAzimuth, run_mechanization
    from strapdown.nav_state import NavState
    from strapdown.tables import imu_table

    gyro, accel, per = rates(), forces(), NS / SAMPLES
    dt = np.full(SAMPLES - 1, STEP)
    used = NorthEastDown(**LIMITS)
    start = NavState.from_degrees(51.5, 34.0, 100.0, v_n=[10.0, 0.0, 0.0])
    begin = used.begin(start)
    rows, history = np.empty((SAMPLES - 1, 10)), np.empty((SAMPLES - 1, 10))
    none, earth, options = np.empty(0), WGS84.parameters(), used.kernel_options()
    imu = imu_table(np.arange(SAMPLES) * STEP, gyro, accel)
    samples = np.hstack([gyro, accel])

    def batch() -> None:
        increments.motion_increments_linear(dt, samples, False, rows)
        kernel.ned_advance(begin.copy(), rows, none, earth, options, history)

    def from_table() -> Any:
        return run_mechanization(used, start, motion_increments(imu)).trajectory

    tracker = NavTracker(start, used)
    tracker.update(0.0, gyro[0], accel[0])

    def states() -> None:
        for _ in range(PART):
            tracker.state  # noqa: B018

    library = c_library("navigation_limit.c")
    of_batch = "mechanization, kernels from rates to states, a sample"
    of_table = "mechanization, from table to table, a sample"
    of_state = "mechanization, `state` of a tracker, a read"
    if library is None:
        for what in (of_batch, of_table, of_state):
            yield Row(what, against="the same in C", missing=NO_COMPILER)
    else:
        run = library.mech_run
        run.argtypes = [c_long, c_void_p, c_void_p, c_double, c_void_p, c_void_p]
        run.restype = None
        turn = np.eye(3).ravel()
        initial = np.array([start.lat, start.lon, start.alt, *start.v_n, *turn])
        out = np.empty((SAMPLES, 15))
        sides = (pointer(gyro), pointer(accel), STEP, pointer(initial), pointer(out))

        def in_c() -> None:
            run(SAMPLES, *sides)

        ours, theirs = by_turns(batch, in_c, per=per)
        # Both must have done the same work: a minute apart by less than their methods differ.
        assert np.abs(history[5998, 3:6] - out[5999, 3:6]).max() < 1e-2
        yield Row(of_batch, ours, "the same in C", theirs, "ns", 1.15, 1.35)
        ours, theirs = by_turns(from_table, in_c, rounds=9, per=per)
        yield Row(of_table, ours, "the same in C", theirs, "ns", 1.7, 3.4)
        ours, theirs = by_turns(states, in_c, rounds=9)
        ours = tuple(NS / PART * t for t in ours)
        theirs = tuple(NS / SAMPLES * t for t in theirs)
        # Two microseconds beside 84 ns, as both were on one machine.
        yield Row(of_state, ours, "a step in C", theirs, "ns", 24.0)

    what, against = of_table, "python-ins, its public functions"
    try:
        from pyins.strapdown import Integrator, compute_increments_from_imu
    except ImportError:
        yield Row(what, against=against, missing="python-ins is not installed")
    else:
        initial = start.to_trajectory().iloc[0]
        ours, theirs = by_turns(
            from_table,
            lambda: Integrator(initial).integrate(compute_increments_from_imu(imu, "rate")),
            rounds=7,
            per=per,
        )
        yield Row(what, ours, against, theirs, "ns", 0.2, 0.32)

    wandering = WanderAzimuth(**LIMITS)
    at_start = wandering.begin(start)
    wandered = np.empty((SAMPLES - 1, wandering.row))
    batch()
    ours, theirs = by_turns(
        lambda: wander.wander_advance(at_start.copy(), rows, none, earth, options, wandered),
        lambda: kernel.ned_advance(begin.copy(), rows, none, earth, options, history),
        per=per,
    )
    # The same motion, to what the two methods differ by.
    assert np.abs(wandered[5998, 4] - history[5998, 2]) < 1e-3
    # 126 ns beside 91, which were 99 before its quaternion was inlined.
    what = "mechanization, wander azimuth, a step"
    yield Row(what, ours, "north-east-down", theirs, "ns", 1.5, 1.6)

    stamps = (np.arange(PART) * STEP).tolist()
    turned, felt = list(gyro[:PART]), list(accel[:PART])

    def one_by_one() -> None:
        update = NavTracker(start, used).update
        for time, rate, force in zip(stamps, turned, felt, strict=True):
            update(time, rate, force)

    ours, theirs = by_turns(one_by_one, batch, rounds=7)
    ours, theirs = (
        tuple(NS / count * t for t in side) for count, side in ((PART, ours), (SAMPLES, theirs))
    )
    what = "mechanization, one sample a call"
    yield Row(what, ours, "the batch, a sample", theirs, "ns", 3.0)
    yield segments(NorthEastDown(height="held", **LIMITS), start)


def segments(used: Any, start: Any) -> Row:
    """Peak of memory over a log of an hour against one of five minutes, both in segments."""
    from strapdown.mechanization import navigate_segments
    from strapdown.tables import imu_table

    length = 3_000
    gyro, accel = 0.001 * rates(length), forces(length)

    def peak(count: int) -> float:
        pieces = (
            imu_table((np.arange(length) + k * length) * STEP, gyro, accel) for k in range(count)
        )
        tracemalloc.start()
        for _ in navigate_segments(used, start, pieces):
            pass
        _, most = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        return most / 2.0**20

    peak(2)
    what = "mechanization, peak memory of an hour in segments"
    return Row(what, (peak(120),), "of five minutes", (peak(10),), "MiB", 1.1)


def prefilter() -> Iterator[Row]:
    from scipy.signal import upfirdn

    from strapdown.prefilter import Grid, RobustFir, Summed
    from strapdown.tables import imu_table

    count, channels = 360_000, 6
    x = np.random.default_rng(0).standard_normal((count, channels))
    imu = imu_table(np.arange(count) / 1000.0, x[:, :3], x[:, 3:])
    fir = RobustFir()
    low_pass = fir.low_pass(Grid(0.0, 1e-3, means=False))
    for what, job, goal in (
        (
            f"pre-filter, low-pass and every {low_pass.factor}th, a value",
            lambda: low_pass.advance(low_pass.begin(channels), x),
            2.0,
        ),
        ("pre-filter, outliers as well, from table to tables", lambda: fir.apply(imu), None),
        ("pre-filter, outliers and joined increments", lambda: Summed().apply(imu), None),
    ):
        ours, theirs = by_turns(
            job,
            lambda: upfirdn(low_pass.weights, x, 1, low_pass.factor, axis=0),
            rounds=5,
            per=NS / (count * channels),
        )
        yield Row(what, ours, "scipy upfirdn, same weights", theirs, "ns", goal)
