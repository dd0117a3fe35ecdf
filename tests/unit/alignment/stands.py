"""Bodies that stand, rock and drive, and units that read them."""

from __future__ import annotations

import functools

import numpy as np

from strapdown import rotation
from strapdown.alignment.alignment import Site
from strapdown.sensors.catalogue import load_sensor
from strapdown.sensors.error_chain import apply, child
from strapdown.sensors.uncertainty import ImuUncertainty, TriadUncertainty
from strapdown.simulation import ImuErrors, StationaryMotion, simulate_imu
from strapdown.simulation.earth_motion import Origin
from strapdown.simulation.path_motion import PathMotion, Wave
from strapdown.tables import ACCEL, GYRO, QUATERNION, imu_table

ORIGIN = Origin(55.0, 37.0, 150.0)
SITE = Site(55.0, 37.0, 150.0)
# No sensor errs by so little: what is left of an answer is the method's own.
IDEAL = ImuUncertainty(
    TriadUncertainty(noise_density=1e-12, bias=1e-12),
    TriadUncertainty(noise_density=1e-10, bias=1e-10),
)


def still(duration, roll=-2.0, pitch=1.0, heading=60.0, origin=ORIGIN):
    return StationaryMotion(duration, origin, roll, pitch, heading)


def rocking(duration, origin=ORIGIN):
    """A ship at its berth: rocks by degrees, heaves by a decimetre."""
    return PathMotion(
        duration,
        origin,
        heading_deg=60.0,
        attack_deg=1.0,
        roll_deg=-2.0,
        roll_waves=(Wave(2.0, 7.3, 10.0),),
        pitch_waves=(Wave(1.0, 5.1, 70.0),),
        heading_waves=(Wave(1.5, 11.0, 33.0),),
        heave_waves=(Wave(0.1, 6.0, 0.0),),
    )


@functools.cache
def ideal(motion, rate):
    """Imu table without errors, and the true attitudes (n, 4)."""
    imu, truth = simulate_imu(motion, ImuErrors(), rate=rate, sampling="mean", source="log.csv")
    return imu, truth[QUATERNION].to_numpy()


def with_errors(imu, errors, seed=0):
    """Read an ideal table with errors: the drawing of a unit costs less than the motion."""
    time, rate, force = imu.index.to_numpy(), imu[GYRO].to_numpy(), imu[ACCEL].to_numpy()
    gyro = apply(
        errors.gyro,
        time,
        rate,
        sampling="mean",
        seed=child(seed, 0),
        specific_force=force,
        sampled=True,
    )
    accel = apply(
        errors.accel,
        time,
        force,
        sampling="mean",
        seed=child(seed, 1),
        specific_force=force,
        sampled=True,
    )
    return imu_table(time, gyro, accel, sampling="mean", source="log.csv")


def unit(motion, rate, seed, sensor="fog-1000"):
    """Record of one unit of a sensor, the true attitudes, and what is known of the unit."""
    imu, truth = ideal(motion, rate)
    made = load_sensor(sensor)
    return with_errors(imu, made.draw(seed), seed), truth, ImuUncertainty.of_sensor(made)


def phi(alignment, q_true):
    """Error in north-east-down, rad: C_estimated = exp([phi x]) C_true."""
    return rotation.rotation_vector_from_quaternion(
        rotation.compose(alignment.q_nb, rotation.conjugate(q_true))
    )


def changed(imu, **columns):
    """A copy of a table with other columns."""
    out = imu.assign(**columns)
    out.attrs = dict(imu.attrs)
    return out


def chi_square(alignment, q_true):
    error = phi(alignment, q_true)
    return float(error @ np.linalg.solve(alignment.covariance, error))
