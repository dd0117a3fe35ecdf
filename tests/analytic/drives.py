"""Drives of which everything is drawn from what the filter assumes, and how wrong it was."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from strapdown import rotation
from strapdown.estimation.covariance import COVARIANCES
from strapdown.estimation.error_filter import ErrorFilter
from strapdown.estimation.error_model import QuaternionModel, RotationVectorModel
from strapdown.estimation.sensor_blocks import accel_bias, gauss_markov, gyro_bias
from strapdown.increments import motion_increments
from strapdown.mechanization import NorthEastDown, WanderAzimuth
from strapdown.mechanization.mechanization import state_error
from strapdown.nav_state import NavState
from strapdown.navigation.filter_options import DAMPINGS
from strapdown.navigation.measurements.gnss import Gnss
from strapdown.navigation.navigator import Navigator, with_states
from strapdown.sensors.triad_errors import ImuErrors, TriadErrors
from strapdown.simulation.earth_motion import Origin
from strapdown.simulation.imu import simulate_imu
from strapdown.simulation.motion import Track
from strapdown.simulation.path_motion import PathMotion
from strapdown.tables import ACCEL, GYRO, gnss_table, imu_table

RATE, SECONDS = 20.0, 240.0
GYRO_NOISE, ACCEL_NOISE = 5e-5, 1e-3  # rad/√s, m/s/√s: 0.17 deg/√h, 0.06 m/s/√h
GYRO_BIAS, ACCEL_BIAS = 1e-4, 0.02  # rad/s, m/s²: 20 deg/h, 2 mg
POSITION_SD, VELOCITY_SD = 1.0, 0.1  # m, m/s
# Of the start: m, m/s, rad.
START_SD = np.r_[[3.0] * 3, [0.2] * 3, np.radians([0.3, 0.3, 2.0])]
# The quaternions have no height: its fix has to say nothing.
UNKNOWN = 1e6  # m
MODELS = {
    "rotation_vector on ned": (NorthEastDown, RotationVectorModel),
    "rotation_vector on wander azimuth": (WanderAzimuth, RotationVectorModel),
    "quaternions on wander azimuth": (WanderAzimuth, QuaternionModel),
}

MOTION = PathMotion(
    SECONDS,
    Origin(55.0, 37.0, 150.0),
    heading_deg=30.0,
    speed=Track(
        (0.0, 8.0, 40.0, 46.0, 80.0, 86.0, 130.0, 138.0, 180.0, 186.0),
        (3.0, 15.0, 15.0, 6.0, 6.0, 18.0, 18.0, 8.0, 8.0, 16.0),
    ),
    turn_rate=Track(
        (
            0.0,
            15.0,
            18.0,
            22.0,
            25.0,
            50.0,
            53.0,
            60.0,
            63.0,
            100.0,
            104.0,
            112.0,
            116.0,
            145.0,
            148.0,
            152.0,
            155.0,
            200.0,
            203.0,
            208.0,
            211.0,
        ),
        (
            0.0,
            0.0,
            15.0,
            15.0,
            0.0,
            0.0,
            -14.0,
            -14.0,
            0.0,
            0.0,
            8.0,
            8.0,
            0.0,
            0.0,
            -18.0,
            -18.0,
            0.0,
            0.0,
            15.0,
            15.0,
            0.0,
        ),
    ),
    climb=Track((0.0, 90.0, 95.0, 120.0, 125.0), (0.0, 0.0, 3.0, 3.0, 0.0)),
    sway_roll=0.8,
    sway_pitch=0.5,
)


@dataclass(frozen=True)
class Plan:
    """What is drawn, and what is assumed."""

    model: str = "rotation_vector on ned"
    form: str = "joseph"
    start_sd: tuple[float, ...] = tuple(START_SD)
    step: float = 0.1
    correlation_time: float = 0.0
    rule: object = None
    outliers: float = 0.0
    epochs: tuple[float, ...] = tuple(np.arange(5.0, SECONDS - 0.1, 5.0).tolist())
    damping: str = "feedback"
    # Epochs of the receiver are so much after the full second.
    fix_offset: float = 0.0
    # How many times as much as usual the gyros scatter, which is known.
    # What is wrong: stated over true standard deviation, assumed over true noise of the gyros,
    # stamps that are late, autocorrelation of the fixes from one second to the next.
    grade: float = 1.0
    # How many times as large as usual the biases are, which is known.
    bias: float = 1.0
    stated: float = 1.0
    gyro_noise: float = 1.0
    late: float = 0.0
    colour: float = 0.0
    velocity_bias: float = 0.0
    lever_arm: tuple[float, float, float] = (0.0, 0.0, 0.0)


@cache
def exact():
    """Samples without errors, and the truth at them."""
    nothing = ImuErrors(TriadErrors(), TriadErrors())
    imu, _ = simulate_imu(MOTION, nothing, rate=RATE, sampling="mean")
    return imu, MOTION.trajectory(imu.index.to_numpy())


@cache
def truth_at(time):
    return nav_state(MOTION.trajectory(np.array([time])).iloc[0], time)


@cache
def true_states(offset):
    """Truth at every full second and so much after it."""
    return [truth_at(k + offset) for k in np.arange(1.0, SECONDS, 1.0)]


def nav_state(row, time):
    return NavState.from_degrees(
        row["lat"],
        row["lon"],
        row["alt"],
        v_n=row[["VN", "VE", "VD"]].to_numpy(),
        roll_deg=row["roll"],
        pitch_deg=row["pitch"],
        heading_deg=row["heading"],
        time=time,
    )


def drawn(plan, seed):
    """Increments, fixes, start, and true errors of the sensors at the epochs."""
    rng = np.random.default_rng(seed)
    imu, _ = exact()
    n = len(imu)
    bias = np.zeros((n, 6))
    sd = plan.bias * np.r_[[GYRO_BIAS] * 3, [ACCEL_BIAS] * 3]
    bias[:] = rng.normal(size=6) * sd
    if plan.correlation_time:
        # Means over steps of a process that is followed at their ends.
        keep = np.exp(-1.0 / RATE / plan.correlation_time)
        for k in range(1, n):
            bias[k] = keep * bias[k - 1] + np.sqrt(1 - keep**2) * sd * rng.normal(size=6)
    noise = (
        rng.normal(size=(n, 6))
        * np.repeat([plan.grade * GYRO_NOISE, ACCEL_NOISE], 3)
        * np.sqrt(RATE)
    )
    mean = bias.copy()
    mean[1:] = 0.5 * (bias[1:] + bias[:-1])
    bad = imu_table(
        imu.index.to_numpy(),
        imu[GYRO].to_numpy() + mean[:, :3] + noise[:, :3],
        imu[ACCEL].to_numpy() + mean[:, 3:] + noise[:, 3:],
        sampling="mean",
    )
    inc = motion_increments(bad)
    start = truth_at(0.0)
    error = rng.normal(size=9) * np.array(plan.start_sd)
    held = "quaternions" in plan.model
    if held:
        error[2] = 0.0
    used = NorthEastDown()
    # state = truth corrected by minus the error; the error is of the axes of the state to first
    # order in a displacement of some metres over the radius of the Earth.
    begin = used.nav_state(used.correct(used.begin(start), -error), 0.0)
    at = np.arange(1.0, SECONDS, 1.0) + plan.fix_offset
    states = true_states(plan.fix_offset - plan.late)
    m = len(at)
    arm = np.array(plan.lever_arm)
    noises = rng.normal(size=(m, 6)) * np.repeat([POSITION_SD, VELOCITY_SD], 3)
    for k in range(1, m if plan.colour else 0):
        noises[k] = plan.colour * noises[k - 1] + np.sqrt(1.0 - plan.colour**2) * noises[k]
    noises[:, 3] += plan.velocity_bias * VELOCITY_SD
    if plan.outliers:
        wild = rng.random(m) < plan.outliers
        direction = rng.normal(size=(m, 6))
        for part in (slice(0, 3), slice(3, 6)):
            unit = direction[:, part] / np.linalg.norm(direction[:, part], axis=1)[:, None]
            noises[wild, part] += 50.0 * (POSITION_SD, VELOCITY_SD)[part.start // 3] * unit[wild]
    # The antenna's: what the Earth's own rate adds at its arm is a tenth of a millimetre a second.
    swung = np.cross(MOTION.rate(at - plan.late), arm)
    velocities = np.array(
        [state.v_n + rotation.rotate(state.q_nb, w) for state, w in zip(states, swung, strict=True)]
    )
    shifted = np.empty((m, 3))
    for k, state in enumerate(states):
        apart = np.r_[-noises[k, :3] - rotation.rotate(state.q_nb, arm), np.zeros(6)]
        moved = used.nav_state(used.correct(used.begin(state), apart), at[k])
        shifted[k] = np.degrees(moved.lat), np.degrees(moved.lon), moved.alt
    gnss = gnss_table(
        at,
        shifted,
        velocities + noises[:, 3:],
        plan.stated * np.array([POSITION_SD, POSITION_SD, UNKNOWN if held else POSITION_SD]),
        (plan.stated * VELOCITY_SD,) * 3,
    )
    return inc, gnss, begin, bias


def navigator_of(plan):
    mechanization, model = MODELS[plan.model]
    gyro, accel = gyro_bias(plan.bias * GYRO_BIAS), accel_bias(plan.bias * ACCEL_BIAS)
    if plan.correlation_time:
        gyro, accel = (gauss_markov(one, plan.correlation_time) for one in (gyro, accel))
    made = model(
        (plan.gyro_noise * plan.grade * GYRO_NOISE,) * 3, (ACCEL_NOISE,) * 3, (gyro, accel)
    )
    aids = (Gnss(name="gnss", rule=plan.rule, lever_arm=plan.lever_arm),)
    filter_ = ErrorFilter(mechanization(), made, COVARIANCES[plan.form](), step=plan.step)
    return Navigator(with_states(filter_, aids), aids, damping=DAMPINGS[plan.damping]())


def run(plan, seed):
    """Errors of the physical states and their covariance at the epochs."""
    inc, gnss, begin, bias = drawn(plan, seed)
    navigator = navigator_of(plan)
    biases = plan.bias * np.r_[[GYRO_BIAS] * 3, [ACCEL_BIAS] * 3]
    P = np.diag(np.r_[plan.start_sd, biases] ** 2)
    state = navigator.tell(navigator.begin(begin, P), "gnss", gnss)
    time, rows = inc.index.to_numpy(), inc.to_numpy()
    errors, covariances = [], []
    done = 0
    pieces = []
    for epoch in plan.epochs:
        upto = int(np.searchsorted(time, epoch + 1e-9))
        state, piece = navigator.advance(state, time[done:upto], rows[done:upto])
        pieces.append(piece)
        done = upto
        errors.append(error_of(navigator, state, piece, bias))
        covariances.append(covariance_of(navigator, state.engine.filter))
    return np.array(errors), np.array(covariances), pieces


def error_of(navigator, state, piece, bias):
    """Physical errors of a state at its newest step, at most one group after its covariance."""
    used, now = navigator.filter.mechanization, state.engine
    if navigator.damping.feeds_back:
        computed = used.nav_state(now.mechanization, now.time)
    else:
        shown = used.trajectory([now.time], piece.history[-1:])
        computed = nav_state(shown.iloc[0], now.time)
    estimates = navigator.engine(state.engine).estimates(navigator.filter)
    physical = state_error(computed, truth_at(now.time))
    return np.r_[physical, bias[round(now.time * RATE)] - estimates]


def covariance_of(navigator, now):
    """Covariance of these errors, north-east-down."""
    turn = np.eye(15)
    turn[:9, :9] = np.kron(np.eye(3), navigator.filter.mechanization.level_from_ned(now.row))
    return turn.T @ navigator.filter.physical_covariance(now) @ turn


def nees(errors, covariances, kept):
    e = errors[:, kept]
    P = covariances[:, kept][:, :, kept]
    return np.einsum("ti,ti->t", e, np.linalg.solve(P, e[..., None])[..., 0])
