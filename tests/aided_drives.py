"""Short drives with stops and turns, their sensors, and navigators that are told of them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from strapdown import rotation
from strapdown.estimation.covariance import COVARIANCES
from strapdown.estimation.error_filter import ErrorFilter
from strapdown.estimation.error_model import RotationVectorModel
from strapdown.estimation.sensor_blocks import accel_bias, gyro_bias
from strapdown.increments import motion_increments
from strapdown.mechanization import MECHANIZATIONS
from strapdown.mechanization.mechanization import state_error
from strapdown.nav_state import NavState
from strapdown.navigation.navigator import Navigator, with_states
from strapdown.simulation import ImuErrors, Origin, PathMotion, Track, TriadErrors, simulate_imu
from strapdown.simulation.earth_motion import EarthMotion
from strapdown.simulation.gnss import GnssReceiver, simulate_gnss

# A good MEMS unit.
GYRO_NOISE, ACCEL_NOISE = 1e-4, 5e-4  # rad/s/√Hz, m/s²/√Hz
GYRO_BIAS, ACCEL_BIAS = 5e-4, 0.02  # rad/s, m/s²
START = {"place": 1.0, "velocity": 0.1, "tilt": np.radians(0.3), "heading": np.radians(1.0)}
RATE = 50.0


@dataclass(frozen=True)
class CarriedMotion(EarthMotion):
    """A body that goes where another motion goes, and stands otherwise."""

    motion: PathMotion

    @property
    def duration(self):
        return self.motion.duration

    @property
    def origin(self):
        return self.motion.origin

    @property
    def ellipsoid(self):
        return self.motion.ellipsoid

    @property
    def breaks(self):
        return self.motion.breaks


@dataclass(frozen=True)
class TurnedMotion(CarriedMotion):
    """A motion as seen from axes that are turned in its body, at the same point."""

    angles_deg: tuple[float, float, float]

    def kinematics(self, time):
        k = self.motion.kinematics(time)
        turn = rotation.quaternion_from_euler(self.angles_deg)
        return replace(
            k,
            q_nb=rotation.compose(k.q_nb, turn),
            turning=rotation.rotate(rotation.conjugate(turn), k.turning),
            angles=None,
            swinging=None,
        )


@cache
def drive(duration=120.0, angles_deg=(0.0, 0.0, 0.0)):
    """A stop, a start, turns to both sides, changes of speed, a hill, and a stop again."""
    motion = PathMotion(
        duration,
        Origin(48.0, 11.0, 500.0),
        heading_deg=60.0,
        speed=Track(
            (0.0, 12.0, 20.0, 40.0, 45.0, 70.0, 78.0, 100.0, 108.0),
            (0.0, 0.0, 12.0, 12.0, 6.0, 6.0, 15.0, 15.0, 0.0),
        ),
        turn_rate=Track(
            (0.0, 24.0, 26.0, 30.0, 32.0, 50.0, 52.0, 60.0, 62.0, 84.0, 86.0, 92.0, 94.0),
            (0.0, 0.0, 15.0, 15.0, 0.0, 0.0, -18.0, -18.0, 0.0, 0.0, 10.0, 10.0, 0.0),
        ),
        climb=Track((0.0, 30.0, 35.0, 60.0, 66.0), (0.0, 0.0, 3.0, 3.0, 0.0)),
    )
    return motion if not any(angles_deg) else TurnedMotion(motion, angles_deg)


@cache
def increments_of(motion, seed):
    rng = np.random.default_rng([seed, 1])
    errors = ImuErrors(
        TriadErrors(noise_density=GYRO_NOISE, bias=tuple(GYRO_BIAS * rng.standard_normal(3))),
        TriadErrors(noise_density=ACCEL_NOISE, bias=tuple(ACCEL_BIAS * rng.standard_normal(3))),
    )
    imu, _ = simulate_imu(motion, errors, rate=RATE, sampling="mean", seed=seed)
    table = motion_increments(imu)
    return table.index.to_numpy(), np.ascontiguousarray(table.to_numpy())


def truth_at(motion, time):
    return NavState.from_trajectory(motion.trajectory(np.array([time])))


def navigator_of(aids, mechanization="ned", form="joseph"):
    model = RotationVectorModel(
        (GYRO_NOISE,) * 3, (ACCEL_NOISE,) * 3, (gyro_bias(GYRO_BIAS), accel_bias(ACCEL_BIAS))
    )
    filter_ = ErrorFilter(MECHANIZATIONS[mechanization](), model, COVARIANCES[form](), step=0.1)
    return Navigator(with_states(filter_, aids), aids)


def begin(navigator, motion, seed, time=0.0):
    """At the truth, less what was drawn of its uncertainty."""
    rng = np.random.default_rng([seed, 2])
    sd = np.repeat([START["place"], START["velocity"], START["tilt"]], 3)
    sd[8] = START["heading"]
    truth = truth_at(motion, time)
    used = navigator.filter.mechanization
    state = used.correct(used.begin(truth), sd * rng.standard_normal(9))
    start = used.nav_state(state, time)
    P = np.diag(np.concatenate([sd, navigator.filter.model.stacked.sd]) ** 2)
    return navigator.begin(start, P)


def gnss_of(motion, seed, until=np.inf, since=np.inf):
    receiver = GnssReceiver(
        rate=1.0, position_noise=0.5, velocity_noise=0.05, on_excess="unaffected"
    )
    table = simulate_gnss(motion, receiver, seed=seed)
    return table[(table.index <= until) | (table.index >= since)]


def run(navigator, motion, seed, tables, until=None, pieces=1):
    """State and pieces after a drive of which the navigator is told by tables."""
    time, rows = increments_of(motion, seed)
    state = begin(navigator, motion, seed, time[0] - rows[0, 0])
    for name, table in tables.items():
        state = navigator.tell(state, name, table[table.index > state.time])
    last = len(time) if until is None else int(np.searchsorted(time, until))
    out = []
    for cut in np.array_split(np.arange(last), pieces):
        state, piece = navigator.advance(state, time[cut], rows[cut])
        out.append(piece)
    return state, out


def error_now(navigator, motion, state):
    used = navigator.filter.mechanization
    return state_error(
        used.nav_state(state.engine.mechanization, state.time), truth_at(motion, state.time)
    )


def estimate(navigator, state, name):
    """Estimates of a block, and their covariance."""
    at = navigator.filter.model.columns_of[name]
    P = navigator.filter.physical_covariance(state.engine.filter)
    return state.engine.filter.sensors[at.start - 9 : at.stop - 9], P[at, at]
