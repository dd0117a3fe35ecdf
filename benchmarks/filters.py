"""Filter: half an hour at 100 Hz with a fix a second beside C, smoothed, and single epochs.

The drive is that of python-ins's sine velocity, in closed form; what is drawn is drawn as usual.
"""

from __future__ import annotations

import ctypes
import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from benchmarks.measure import NO_COMPILER, Row, by_turns, c_library, pointer

RATE, EACH = 100.0, 100
GYRO_NOISE, ACCEL_NOISE = math.radians(0.1) / 60.0, 0.05 / 60.0  # rad/√s, m/s/√s
GYRO_BIAS, ACCEL_BIAS = math.radians(100.0) / 3600.0, 0.03  # rad/s, m/s²
# What the filters are told of the start: m, m/s, deg of the level, deg of the heading.
START_SD = (5.0, 0.5, 0.5, 3.0)
#: Samples of a chunk: 50 s.
CHUNK = 5000
#: Forms of the covariance, with the goal and the limit of each beside the plain form in C.
FORMS = {"joseph": (2.0, 2.6), "ud": (2.0, 2.4), "wd": (2.0, 2.5)}
# An epoch is short enough for a turn of the processor.
EPOCHS = 200
BLOCKS = {
    # Rows and columns of what is not zero: position, velocity, attitude, drifts, biases; and the 17
    # states of Chernodarov: velocity, two quaternions, drifts, biases.
    15: ((0, 3, 3, 6), (3, 6, 3, 9), (3, 6, 12, 15), (6, 9, 3, 9), (6, 9, 9, 12)),
    17: ((0, 3, 0, 7), (0, 3, 14, 17), (3, 7, 3, 7), (3, 7, 11, 14), (7, 11, 0, 3), (7, 11, 7, 11)),
}


class Drive(NamedTuple):
    """What was measured, what is true, and where a filter begins."""

    imu: Any
    truth: Any
    fix_time: np.ndarray
    fix: np.ndarray
    start: Any

    @property
    def fixes(self) -> Any:
        """Table of the fixes: positions alone, 1 m."""
        from strapdown.tables import gnss_table

        none = np.zeros((len(self.fix), 3))
        return gnss_table(self.fix_time, self.fix, none, (1.0,) * 3, (np.inf,) * 3)


def drive(seed: int, seconds: float = 1800.0) -> Drive:
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
        seconds, Origin(55.0, 37.0, 150.0), (5.0, -3.0, 0.0), (8.0, 8.0, 0.3), 60.0
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
    """15 states, covariance at 10 Hz."""
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


def initial_covariance() -> np.ndarray:
    place, speed, level, heading = START_SD
    nine = np.r_[[place] * 3, [speed] * 3, np.radians([level, level, heading])]
    return np.diag(np.r_[nine, [GYRO_BIAS] * 3, [ACCEL_BIAS] * 3] ** 2)


def filter_in_c(made: Drive) -> tuple[Callable[[], None], np.ndarray] | None:
    """Run of the C filter over a drive, and its states (n, 15); None without a compiler."""
    from strapdown.rotation import dcm_from_quaternion
    from strapdown.tables import ACCEL, GYRO

    library = c_library("filter_limit.c")
    if library is None:
        return None
    run, n, s = library.kf_run, len(made.imu), made.start
    run.restype = None
    gyro, accel = (np.ascontiguousarray(made.imu[c].to_numpy()) for c in (GYRO, ACCEL))
    initial = np.r_[s.lat, s.lon, s.alt, s.v_n, dcm_from_quaternion(s.q_nb).ravel()]
    radians = np.column_stack([np.radians(made.fix[:, :2]), made.fix[:, 2]])
    out, variances = np.empty((n, 15)), np.empty((len(made.fix), 15))
    place, speed, level, heading = START_SD
    numbers = (1.0, place, speed, math.radians(level), math.radians(heading))
    numbers += (GYRO_BIAS, ACCEL_BIAS, GYRO_NOISE, ACCEL_NOISE)

    def in_c() -> None:
        run(
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

    return in_c, out


def half_hour() -> Iterator[Row]:
    from strapdown.increments import IncrementStream
    from strapdown.tables import ACCEL, GYRO

    made = drive(1)
    beside = filter_in_c(made)
    n, fixes, P = len(made.imu), made.fixes, initial_covariance()
    stamps, samples = made.imu.index.to_numpy(), made.imu[[*GYRO, *ACCEL]].to_numpy()
    stream = IncrementStream()
    states = np.empty((n - 1, 10))

    def ours(used: Any) -> None:
        # As the C filter, from rates to every state; in chunks, as a command does.
        state, at = used.tell(used.begin(made.start, P), "gnss", fixes), 0
        waiting = stream.begin("instantaneous")
        for first in range(0, n, CHUNK):
            end = min(first + CHUNK, n)
            waiting, ends, rows = stream.advance(
                waiting, stamps[first:end], samples[first:end], end == n
            )
            state, piece = used.advance(state, ends, rows)
            states[at : at + len(ends)] = piece.history
            at += len(ends)

    for form, (goal, limit) in FORMS.items():
        what, against = f"filter, 30 min at 100 Hz, {form}", "the same in C, plain form"
        if beside is None:
            yield Row(what, against=against, missing=NO_COMPILER)
            continue
        in_c, out = beside
        used = navigator(form)
        taken, theirs = by_turns(lambda used=used: ours(used), in_c, rounds=9, per=1e3)
        # Both must have done the same work: nearer to each other than either is to the truth.
        apart = (states[30_000:, :3] - out[30_001:, :3]) * [6.37e6, 3.65e6, 1.0]
        assert np.sqrt((apart**2).sum(axis=1).mean()) < 0.1
        yield Row(what, taken, against, theirs, "ms", goal, limit)
    yield smoothed(made)


def smoothed(made: Drive) -> Row:
    """What smoothing costs beside the filter alone."""
    from strapdown.increments import motion_increments
    from strapdown.navigation.recorder import IntervalRecorder
    from strapdown.navigation.smoother import RauchTungStriebel

    table = motion_increments(made.imu)
    time, rows = table.index.to_numpy(), np.ascontiguousarray(table.to_numpy())
    fixes, P = made.fixes, initial_covariance()
    alone = navigator("ud")
    both = replace(alone, smoother=RauchTungStriebel())

    def forward() -> None:
        tape = IntervalRecorder().begin(alone)
        start = alone.tell(alone.begin(made.start, P), "gnss", fixes)
        state, piece = alone.advance(start, time, rows)
        tape.take(piece)
        tape.take(alone.finish(state))
        tape.record()

    def and_back() -> None:
        tape, later = IntervalRecorder().begin(both), RauchTungStriebel().begin(both)
        start = both.tell(both.begin(made.start, P), "gnss", fixes)
        state, piece = both.advance(start, time, rows)
        for one in (piece, both.finish(state)):
            tape.take(one)
            later.take(one)
        tape.record(smoothing=later)

    ours, theirs = by_turns(and_back, forward, rounds=5, per=1e3)
    what = "filter and smoother, 30 min at 100 Hz, ud"
    return Row(what, ours, "the filter alone", theirs, "ms", 2.5, 3.1)


def problem(n: int) -> tuple[np.ndarray, ...]:
    """P, Phi, Q, z, H and R of an inertial filter: zeros where it has them."""
    rng = np.random.default_rng(n)
    Phi = np.eye(n)
    for top, bottom, left, right in BLOCKS[n]:
        Phi[top:bottom, left:right] += 0.003 * rng.normal(size=(bottom - top, right - left))
    driven = np.zeros(n)
    driven[3:9] = 1e-3
    return np.eye(n), Phi, np.diag(driven), np.ones(3), np.eye(n)[:3].copy(), np.ones(3)


def dense(P: Any, Phi: Any, Q: Any, x: Any, z: Any, H: Any, R: Any) -> tuple[Any, Any]:
    """Joseph's form as it stands in a textbook."""
    one = np.eye(len(x))
    P = Phi @ P @ Phi.T + Q
    for h, value, r in zip(H, z, R, strict=True):
        g = P @ h
        K = g / (h @ g + r)
        x = x + K * (value - h @ x)
        A = one - np.outer(K, h)
        P = A @ P @ A.T + r * np.outer(K, K)
    return P, x


def both_sides(n: int, form: Any) -> tuple[Callable[[], None], Callable[[], None]]:
    """Epochs of a form and of numpy, after a comparison of their results."""
    P, Phi, Q, z, H, R = problem(n)
    results: dict[str, Any] = {}

    def ours() -> None:
        state, x = form.begin(P), np.zeros(n)
        for _ in range(EPOCHS):
            state, x, _ = form.epoch(state, Phi, Q, x, z, H, R)
        results["ours"] = form.matrix(state)

    def theirs() -> None:
        matrix, x = P, np.zeros(n)
        for _ in range(EPOCHS):
            matrix, x = dense(matrix, Phi, Q, x, z, H, R)
        results["theirs"] = matrix

    ours()
    theirs()
    np.testing.assert_allclose(results["ours"], results["theirs"], rtol=1e-9, atol=1e-12)
    return ours, theirs


def epochs() -> Iterator[Row]:
    """A prediction and three observations from Python; and what asking a robust rule costs."""
    from strapdown.estimation.covariance import COVARIANCES
    from strapdown.estimation.robust import Hampel, RobustUpdate

    per = 1e6 / EPOCHS
    for n in BLOCKS:
        for name in FORMS:
            ours, theirs = by_turns(*both_sides(n, COVARIANCES[name]()), rounds=9, per=per)
            what = f"epoch of {n} states, 3 observations, {name}"
            yield Row(what, ours, "numpy, Joseph's form", theirs, "µs", 0.3)
    P, _, _, z, H, R = problem(15)
    form, rule, x = COVARIANCES["ud"](), RobustUpdate(Hampel()), np.zeros(15)
    state = form.begin(P)

    def asked() -> None:
        for _ in range(EPOCHS):
            form.update(state, x, z, H, R, rule)

    def plain() -> None:
        for _ in range(EPOCHS):
            form.update(state, x, z, H, R)

    ours, theirs = by_turns(asked, plain, per=per)
    what = "update of 15 states, 3 observations, robust"
    yield Row(what, ours, "the plain update", theirs, "µs", 4.0)
