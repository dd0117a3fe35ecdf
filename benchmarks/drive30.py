"""Half an hour at 100 Hz with a fix a second: the navigator against the same filter in C.

The drive is that of python-ins's sine velocity, in closed form; what is drawn is drawn as usual.
"""

from __future__ import annotations

import ctypes
import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from benchmarks.c_library import c_library
from benchmarks.measure import Ratio, by_turns

SECONDS, RATE, EACH = 1800.0, 100.0, 100
GYRO_NOISE, ACCEL_NOISE = math.radians(0.1) / 60.0, 0.05 / 60.0  # rad/√s, m/s/√s
GYRO_BIAS, ACCEL_BIAS = math.radians(100.0) / 3600.0, 0.03  # rad/s, m/s²
# What the filters are told of the start: m, m/s, deg of the level, deg of the heading.
START_SD = (5.0, 0.5, 0.5, 3.0)
#: Samples of a piece: 50 s.
PIECE = 5000
# The fastest form of the covariance first: it alone has a limit, the others are told.
FORMS = ("joseph", "ud", "wd")
LIMIT = 3.0


class Drive(NamedTuple):
    """What was measured, what is true, and where a filter begins."""

    imu: Any
    truth: Any
    fix_time: np.ndarray
    fix: np.ndarray
    start: Any


def drive(seed: int) -> Drive:
    """Draw a drive."""
    from strapdown.mechanization import NorthEastDown
    from strapdown.nav_state import NavState
    from strapdown.sensors.triad_errors import ImuErrors, TriadErrors
    from strapdown.simulation import simulate_imu
    from strapdown.simulation.earth_motion import Origin
    from strapdown.simulation.spline_motion import SineVelocityMotion
    from strapdown.tables import ACCEL, GYRO, imu_table

    rng = np.random.default_rng(seed)
    motion = SineVelocityMotion(
        SECONDS, Origin(55.0, 37.0, 150.0), (5.0, -3.0, 0.0), (8.0, 8.0, 0.3), 60.0
    )
    exact, _ = simulate_imu(motion, ImuErrors(TriadErrors(), TriadErrors()), rate=RATE)
    time = exact.index.to_numpy()
    n = len(time)
    gyro = exact[GYRO].to_numpy() + GYRO_BIAS * rng.normal(size=3)
    accel = exact[ACCEL].to_numpy() + ACCEL_BIAS * rng.normal(size=3)
    gyro += GYRO_NOISE * math.sqrt(RATE) * rng.normal(size=(n, 3))
    accel += ACCEL_NOISE * math.sqrt(RATE) * rng.normal(size=(n, 3))
    truth = motion.trajectory(time)
    fixes = truth[["lat", "lon", "alt"]].to_numpy()[EACH::EACH].copy()
    fixes += rng.normal(size=fixes.shape) / [111_200.0, 111_200.0 * math.cos(0.96), 1.0]
    used = NorthEastDown()
    first = truth.iloc[0]
    true = NavState.from_degrees(
        first["lat"],
        first["lon"],
        first["alt"],
        v_n=first[["VN", "VE", "VD"]].to_numpy(),
        roll_deg=first["roll"],
        pitch_deg=first["pitch"],
        heading_deg=first["heading"],
    )
    error = rng.normal(size=9) * np.r_[[3.0] * 3, [0.2] * 3, np.radians([0.3, 0.3, 2.0])]
    start = used.nav_state(used.correct(used.begin(true), error), 0.0)
    return Drive(imu_table(time, gyro, accel), truth, time[EACH::EACH], fixes, start)


def navigator(form: str) -> Any:
    from strapdown.estimation.covariance import COVARIANCES
    from strapdown.estimation.error_filter import ErrorFilter
    from strapdown.estimation.error_model import RotationVectorModel
    from strapdown.estimation.sensor_blocks import accel_bias, gyro_bias
    from strapdown.mechanization import NorthEastDown
    from strapdown.navigation.measurements.gnss import Gnss
    from strapdown.navigation.navigator import Navigator, with_states

    model = RotationVectorModel(
        (GYRO_NOISE,) * 3, (ACCEL_NOISE,) * 3, (gyro_bias(GYRO_BIAS), accel_bias(ACCEL_BIAS))
    )
    aids = (Gnss(name="gnss"),)
    filter_ = ErrorFilter(NorthEastDown(), model, COVARIANCES[form](), step=0.1)
    return Navigator(with_states(filter_, aids), aids)


def ratios() -> Iterator[Ratio]:
    from strapdown.increments import IncrementStream
    from strapdown.rotation import dcm_from_quaternion
    from strapdown.tables import ACCEL, GYRO, gnss_table

    library = c_library("filter_limit.c")
    if library is None:
        return
    made = drive(1)
    n = len(made.imu)
    gyro, accel = (np.ascontiguousarray(made.imu[c].to_numpy()) for c in (GYRO, ACCEL))
    stamps, samples = made.imu.index.to_numpy(), np.hstack([gyro, accel])
    stream = IncrementStream()
    s = made.start
    initial = np.r_[s.lat, s.lon, s.alt, s.v_n, dcm_from_quaternion(s.q_nb).ravel()]
    radians = np.column_stack([np.radians(made.fix[:, :2]), made.fix[:, 2]])
    out, variances = np.empty((n, 15)), np.empty((len(made.fix), 15))
    place, speed, level, heading = START_SD

    def pointer(values: np.ndarray) -> ctypes.c_void_p:
        return ctypes.c_void_p(values.ctypes.data)

    numbers = (1.0, place, speed, math.radians(level), math.radians(heading))
    numbers += (GYRO_BIAS, ACCEL_BIAS, GYRO_NOISE, ACCEL_NOISE)
    library.kf_run.restype = None

    def theirs() -> None:
        library.kf_run(
            ctypes.c_long(n),
            pointer(gyro),
            pointer(accel),
            ctypes.c_double(1.0 / RATE),
            pointer(initial),
            pointer(radians),
            EACH,
            10,
            *(ctypes.c_double(x) for x in numbers),
            pointer(out),
            pointer(variances),
        )

    fixes = gnss_table(
        made.fix_time, made.fix, np.zeros((len(made.fix), 3)), (1.0,) * 3, (np.inf,) * 3
    )
    nine = np.r_[[place] * 3, [speed] * 3, np.radians([level, level, heading])]
    for form in FORMS:
        used = navigator(form)
        P = np.diag(np.r_[nine, [GYRO_BIAS] * 3, [ACCEL_BIAS] * 3] ** 2)
        found = []

        def ours(used: Any = used, P: np.ndarray = P, found: list[Any] = found) -> None:
            # As the C filter, from rates to every state; in pieces, as a command does.
            state = used.tell(used.begin(made.start, P), "gnss", fixes)
            states, at = np.empty((n - 1, 10)), 0
            waiting = stream.begin("instantaneous")
            for first in range(0, n, PIECE):
                end = min(first + PIECE, n)
                waiting, ends, rows = stream.advance(
                    waiting, stamps[first:end], samples[first:end], end == n
                )
                state, piece = used.advance(state, ends, rows)
                states[at : at + len(ends)] = piece.history
                at += len(ends)
            found[:] = [states]

        taken, limit = by_turns(ours, theirs, rounds=7)
        # Both must have done the same work: nearer to each other than either is to the truth.
        apart = (found[0][30_000:, :3] - out[30_001:, :3]) * [6.37e6, 3.65e6, 1.0]
        assert np.sqrt((apart**2).sum(axis=1).mean()) < 0.1
        yield Ratio(
            f"30 min at 100 Hz, a fix a second, covariance at 10 Hz, {form}",
            taken * 1e3,
            "the same filter in C, plain",
            limit * 1e3,
            "ms",
            LIMIT if form == FORMS[0] else None,
        )
