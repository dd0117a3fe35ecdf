"""Simulated barometer, velocity log, compass, odometer and magnetometer on a motion."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pandas as pd

from strapdown import rotation
from strapdown.sensors.error_chain import Seed, child, normal, random_walk
from strapdown.sensors.triad_errors import ZERO, Triad
from strapdown.simulation.earth_motion import EarthMotion
from strapdown.simulation.gnss import instants, motion_of_point, velocity_of_point
from strapdown.tables import (
    EULER,
    MAG,
    barometer_table,
    body_velocity_table,
    heading_table,
    odometer_table,
)

# Barometer with noise and a wandering bias.


_NOISE, _WALK = 0, 1
_HOUR = 3600.0


@dataclass(frozen=True)
class PressureHeight:
    """Error model of a barometer: ``height + bias + noise``.

    Attributes
    ----------
    rate : float, Hz
    noise : float, m
        Standard deviation, independent for each row.
    bias : float, m
        At time zero.
    walk : float, m/√h
        Random walk of the bias.
    point : triad, m
        Position of the barometer relative to the motion's reference point, body axes.
    """

    rate: float = 10.0
    noise: float = 0.2
    bias: float = 0.0
    walk: float = 5.0
    point: Triad = ZERO


def simulate_barometer(
    motion: EarthMotion, barometer: PressureHeight, *, seed: Seed = 0, source: str | None = None
) -> pd.DataFrame:
    """Simulate barometric heights over a motion.

    `seed`: of noise and walk. Returns barometer table at the instants ``k / rate``.
    """
    time = instants(motion, barometer.rate)
    height = motion_of_point(motion, time, barometer.point)[0][:, 2]
    density = barometer.walk / math.sqrt(_HOUR)
    steps = np.diff(time, prepend=time[0] - 1.0 / barometer.rate)
    walk = random_walk(child(seed, _WALK), steps, (density, 0.0, 0.0), mean=False)[:, 0]
    noise = barometer.noise * normal(seed, _NOISE, len(time), axes=1)[:, 0]
    return barometer_table(time, height + barometer.bias + walk + noise, barometer.noise, source)


# Doppler log or another instrument that measures the velocity in its own axes.


_BODY_VELOCITY_NOISE = 0


@dataclass(frozen=True)
class VelocityLog:
    """Error model of a velocity log: ``(1 + scale) C_ib v_b + noise``.

    Attributes
    ----------
    rate : float, Hz
    noise : triad, m/s
        Standard deviation along each instrument axis, independent for each row.
    scale : float
        Relative scale factor error.
    point : triad, m
        Position of the instrument relative to the motion's reference point, body axes.
    angles_deg : triad, deg
        Roll, pitch, yaw of the body axes in the instrument axes (`aiding.vehicle_axes`).
    """

    rate: float = 2.0
    noise: Triad = (0.02, 0.02, 0.02)
    scale: float = 0.0
    point: Triad = ZERO
    angles_deg: Triad = ZERO


def simulate_body_velocity(
    motion: EarthMotion, log: VelocityLog, *, seed: Seed = 0, source: str | None = None
) -> pd.DataFrame:
    """Simulate the velocities of an instrument over a motion.

    `motion`: motion of the inertial sensors. `seed`: of the noise. Returns BodyVelocity table at
    the instants ``k / rate``.
    """
    time = instants(motion, log.rate)
    velocity = velocity_of_point(motion, time, log.point)
    along = (1.0 + log.scale) * velocity @ rotation.dcm_from_euler(log.angles_deg).T
    noise = normal(seed, _BODY_VELOCITY_NOISE, len(time)) * np.asarray(log.noise)
    return body_velocity_table(time, along + noise, log.noise, source)


# Compass, or baseline of two antennas.


_HEADING_NOISE = 0


@dataclass(frozen=True)
class Compass:
    """Error model of a compass: ``azimuth of an axis + misalignment + noise``.

    Attributes
    ----------
    rate : float, Hz
    noise_deg : float, deg
        Standard deviation, independent for each row.
    misalignment_deg : float, deg
    axis_deg : float, deg
        Direction of the axis in the body, from forward to the right.
    """

    rate: float = 5.0
    noise_deg: float = 1.0
    misalignment_deg: float = 0.0
    axis_deg: float = 0.0


def simulate_heading(
    motion: EarthMotion, compass: Compass, *, seed: Seed = 0, source: str | None = None
) -> pd.DataFrame:
    """Simulate the headings of a compass over a motion.

    `seed`: of the noise. Returns heading table at the instants ``k / rate``; 0 to 360 deg.
    """
    time = instants(motion, compass.rate)
    angle = math.radians(compass.axis_deg)
    axis = np.array([math.cos(angle), math.sin(angle), 0.0])
    north, east, _ = rotation.rotate(motion.attitude(time), axis).T
    noise = compass.noise_deg * normal(seed, _HEADING_NOISE, len(time), axes=1)[:, 0]
    read = np.degrees(np.arctan2(east, north)) + compass.misalignment_deg + noise
    return heading_table(time, np.mod(read, 360.0), compass.noise_deg, source)


# Odometer on a rolling wheel.


_ODOMETER_NOISE = 0


@dataclass(frozen=True)
class WheelSpeed:
    """Error model of a wheel odometer: ``(1 + scale) v_forward + noise``.

    Attributes
    ----------
    rate : float, Hz
    noise : float, m/s
        Standard deviation, independent for each row.
    scale : float
        Relative scale factor error.
    point : triad, m
        Position of the wheel relative to the motion's reference point, body axes.
    angles_deg : triad, deg
        Roll, pitch, yaw of the body axes in the vehicle axes (`aiding.vehicle_axes`).
    """

    rate: float = 10.0
    noise: float = 0.05
    scale: float = 0.0
    point: Triad = ZERO
    angles_deg: Triad = ZERO


def simulate_odometer(
    motion: EarthMotion, wheel: WheelSpeed, *, seed: Seed = 0, source: str | None = None
) -> pd.DataFrame:
    """Simulate the speeds of a wheel over a motion.

    `motion`: motion of the inertial sensors. `seed`: of the noise. Returns odometer table at the
    instants ``k / rate``.
    """
    time = instants(motion, wheel.rate)
    velocity = velocity_of_point(motion, time, wheel.point)
    forward = velocity @ rotation.dcm_from_euler(wheel.angles_deg)[0]
    noise = wheel.noise * normal(seed, _ODOMETER_NOISE, len(time), axes=1)[:, 0]
    return odometer_table(time, (1.0 + wheel.scale) * forward + noise, wheel.noise, source)


# Magnetometer.

_FIELD_NOISE = 0


@dataclass(frozen=True)
class FieldSensor:
    """Error model of a magnetometer: ``C_bn (field + deviation) + hard iron + noise``, body axes.

    Attributes
    ----------
    rate : float, Hz
    field_ned : triad, uT
    hard_iron : triad, uT
    noise : float, uT
        Standard deviation along each axis, independent for each row.
    deviation_sd, deviation_time : float, uT, s
        Of a Gauss-Markov process of the field where the body is, north, east, down.
    """

    rate: float = 5.0
    field_ned: Triad = (20.0, 1.5, 43.0)
    hard_iron: Triad = ZERO
    noise: float = 0.5
    deviation_sd: float = 0.0
    deviation_time: float = 30.0


def simulate_magnetometer(
    motion: EarthMotion, sensor: FieldSensor, *, seed: Seed = 0, source: str | None = None
) -> pd.DataFrame:
    """Simulate the field along the axes of the body over a motion.

    `seed`: of noise and deviation. Returns columns ``mag_x mag_y mag_z`` in uT, by time.
    """
    time = instants(motion, sensor.rate)
    draws = normal(seed, _FIELD_NOISE, len(time), axes=6)
    kept = np.exp(-1.0 / (sensor.rate * sensor.deviation_time))
    deviation = np.empty((len(time), 3))
    now = sensor.deviation_sd * draws[0, 3:]
    for k in range(len(time)):
        deviation[k] = now
        now = kept * now + sensor.deviation_sd * np.sqrt(1.0 - kept**2) * draws[k, 3:]
    q_nb = motion.trajectory(time, source=source)[EULER].to_numpy()
    C_nb = rotation.dcm_from_euler(q_nb)
    field = np.einsum("kji,kj->ki", C_nb, np.asarray(sensor.field_ned) + deviation)
    readings = field + np.asarray(sensor.hard_iron) + sensor.noise * draws[:, :3]
    table = pd.DataFrame(readings, index=pd.Index(time, name="time"), columns=MAG)
    table.attrs["source"] = source
    return table
