"""A car through a town with gyros of tens of degrees an hour, and a navigator for it."""

from __future__ import annotations

from functools import cache

import numpy as np

from strapdown import rotation
from strapdown.estimation.covariance import COVARIANCES
from strapdown.estimation.error_filter import ErrorFilter
from strapdown.estimation.error_model import RotationVectorModel
from strapdown.estimation.sensor_blocks import accel_bias, gyro_bias
from strapdown.frames import place_difference
from strapdown.increments import motion_increments
from strapdown.mechanization import MECHANIZATIONS
from strapdown.nav_state import NavState
from strapdown.navigation.measurements.gnss import Gnss
from strapdown.navigation.navigator import Navigator, with_states
from strapdown.sensors.triad_errors import ImuErrors, TriadErrors
from strapdown.simulation import Origin, car, simulate_imu
from strapdown.simulation.gnss import GnssReceiver, simulate_gnss
from strapdown.simulation.vehicles import Accelerate, Brake, Straight, Turn

DEG = np.pi / 180.0
GYRO_NOISE, ACCEL_NOISE = 0.005 * DEG, 1e-3
GYRO_BIAS, ACCEL_BIAS = 0.01 * DEG, 0.02
ARM = (1.0, -0.4, -1.2)
POSITION_SD, VELOCITY_SD = 1.0, 0.1
RATE = 50.0


@cache
def motion():
    legs = [("begin", Straight(4.0))]
    for k in range(5):
        legs += [
            (f"{k} bend", Turn(90.0 if k % 2 else -90.0, 25.0, ramp=2.0)),
            (f"{k} faster", Accelerate(14.0, 5.0)),
            (f"{k} on", Straight(8.0)),
            (f"{k} slower", Brake(10.0, 4.0)),
            (f"{k} bend back", Turn(-100.0 if k % 2 else 80.0, 30.0, ramp=2.0)),
            (f"{k} and on", Straight(6.0)),
        ]
    return car(Origin(45.0, 20.0, 80.0), legs, speed=10.0)


@cache
def increments(seed=3):
    """Ends of the steps, and rows of motion increments."""
    errors = ImuErrors(
        TriadErrors(noise_density=GYRO_NOISE, bias=(GYRO_BIAS, -GYRO_BIAS, 0.5 * GYRO_BIAS)),
        TriadErrors(noise_density=ACCEL_NOISE, bias=(ACCEL_BIAS, -ACCEL_BIAS, ACCEL_BIAS)),
    )
    imu, _ = simulate_imu(motion(), errors, rate=RATE, sampling="mean", seed=seed)
    table = motion_increments(imu)
    return table.index.to_numpy(), np.ascontiguousarray(table.to_numpy())


def fixes(seed=5, **more):
    receiver = {
        "rate": 2.0,
        "position_noise": POSITION_SD,
        "velocity_noise": VELOCITY_SD,
        "antenna": ARM,
        **more,
    }
    # At the start nothing is known yet of how the body turns: the first fix is after it.
    table = simulate_gnss(motion(), GnssReceiver(**receiver), seed=seed)
    return table[table.index > 0.3]


def begun(*aids, name="ned"):
    """A navigator, and its state at the start."""
    model = RotationVectorModel(
        (GYRO_NOISE,) * 3, (ACCEL_NOISE,) * 3, (gyro_bias(GYRO_BIAS), accel_bias(ACCEL_BIAS))
    )
    filter_ = ErrorFilter(MECHANIZATIONS[name](), model, COVARIANCES["ud"]())
    filter_ = with_states(filter_, aids)
    truth = motion().trajectory([0.0]).iloc[0]
    start = NavState.from_degrees(
        truth["lat"],
        truth["lon"],
        truth["alt"],
        v_n=truth[["VN", "VE", "VD"]].to_numpy(),
        roll_deg=truth["roll"] + 0.2,
        pitch_deg=truth["pitch"] - 0.2,
        heading_deg=truth["heading"] + 1.0,
    )
    sd = np.r_[[1.0] * 3, [0.1] * 3, np.array([0.3, 0.3, 1.5]) * DEG, filter_.model.stacked.sd]
    navigator = Navigator(filter_, aids)
    return navigator, navigator.begin(start, np.diag(sd**2))


def run(navigator, state, table, name="gnss", piece=None):
    """The state at the end, and the piece of the whole run."""
    time, rows = increments()
    return navigator.advance(navigator.tell(state, name, table), time, rows)


def gnss(**options):
    return Gnss(name="gnss", **{"lever_arm": ARM, **options})


def off(piece):
    """Place less truth at the ends of the steps, north, east, down, m."""
    truth = motion().trajectory(piece.time)[["lat", "lon", "alt"]].to_numpy()
    place = piece.history[:, :3].copy()
    place[:, :2] = np.degrees(place[:, :2])
    return place_difference(place, truth)


def heading_off(piece):
    """Heading less truth, deg."""
    found = rotation.euler_from_quaternion(np.ascontiguousarray(piece.history[:, 6:10]))[:, 2]
    truth = motion().trajectory(piece.time)["heading"].to_numpy()
    return rotation.within_half_turn(found - truth)
