"""Measurements of a wheeled vehicle: NHC, odometer, and velocity along instrument axes."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from strapdown import rotation
from strapdown._kernels.level import AXIS
from strapdown._kernels.sums import MEMORY, interval_sums
from strapdown.constants import STANDARD_GRAVITY
from strapdown.estimation.covariance import Observation
from strapdown.estimation.error_model import PHYSICAL
from strapdown.estimation.sensor_blocks import unseen
from strapdown.estimation.sensor_states import SensorStates
from strapdown.navigation.measurements.measurement import (
    ROTATION,
    VELOCITY,
    Epochs,
    ImuDerivedMeasurement,
    TabulatedMeasurement,
    View,
    check_block,
    check_number,
    check_numbers,
    check_other_name,
    longer_by,
)
from strapdown.rotation import cross_matrix
from strapdown.tables.aiding import BODY_VELOCITY, ODOMETER, check_body_velocity, check_odometer
from strapdown.tables.checks import Array, index_of, values_of

# Index of the rotation about the vertical among the physical errors.
HEADING = 8


@dataclass(frozen=True)
class NoSlip(ImuDerivedMeasurement):
    """Non-holonomic constraint (NHC): a point of the unsteered axle moves along the vehicle.

    Lateral and vertical velocity of the point, in axes of the vehicle, are zero except for

    * the effect of road and suspension, `lateral_sd` and `vertical_sd`;
    * the slip angle of the tires, which grows with their lateral force, by `slip_deg_per_g`:
      a lateral velocity of ``slip v f_y``;
    * the pitch of the body on its springs, which grows with the longitudinal force, by
      `dive_deg_per_g`: a vertical velocity of ``dive v f_x``.

    These errors are correlated over `correlation_time`, but the filter takes observations as
    independent. So their variance is multiplied by ``(1 + rho) / (1 - rho)``,
    ``rho = exp(-interval / correlation_time)``, which makes the variance of a mean over many
    observations right, whatever the `interval`.

    Slip and dive are mostly systematic: tires and springs yield by a constant angle per g as long
    as load and tires are the same. With `compliance_sd_deg_per_g` that constant is estimated, and
    `slip_deg_per_g` and `dive_deg_per_g` refer to the remainder.

    Valid at rest and in motion, forward and backward.

    Attributes
    ----------
    lever_arm : tuple of float, m
        From the inertial sensors to the middle of the rear axle, at the height of the sensors,
        body axes. An error of x m is a lateral velocity of x times the yaw rate.
    roll_deg, pitch_deg, yaw_deg : float, deg
        Of the inertial sensors in the vehicle (`VehicleAxes`).
    mounting_sd_deg : tuple of float, deg
        Of pitch and of yaw: more than zero adds the states ``NAME.mounting``, which are
        observable in motion with GNSS.
    lateral_sd, vertical_sd : float, m/s
        Of the velocities at an instant, straight on. A body that rises and falls by 15 mm at
        1.5 Hz on its springs has a vertical one of 0.1 m/s.
    slip_deg_per_g : float, deg/g
        Slip angle of the rear tires by lateral force.
    dive_deg_per_g : float, deg/g
        Pitch of the body by longitudinal force.
    compliance_sd_deg_per_g : tuple of float, deg/g
        Of constants of the vehicle: above zero adds the states ``NAME.compliance``, the rotation
        of the direction of travel to the right by force to the right (`slip`: below zero by
        tires alone; an arm that is x m too far forward adds ``x g / v²``), and down by force
        forward (`dive`).
    correlation_time : float, s
    interval : float, s
        Between observations: they are at its multiples, or the first sample after.
    largest_rate_deg_per_s : float, deg/s
        No observation while the vehicle turns faster about its vertical, as it does in a skid.
    largest_heading_sd_deg : float, deg
        No observation at a larger standard deviation of the heading: its effect is not linear.
    """

    lever_arm: tuple[float, float, float] = (0.0, 0.0, 0.0)
    roll_deg: float = 0.0
    pitch_deg: float = 0.0
    yaw_deg: float = 0.0
    mounting_sd_deg: tuple[float, float] = (0.0, 0.0)
    lateral_sd: float = field(default=0.03, metadata={"unit": "m_per_s"})
    vertical_sd: float = field(default=0.1, metadata={"unit": "m_per_s"})
    slip_deg_per_g: float = 4.0
    dive_deg_per_g: float = 2.0
    compliance_sd_deg_per_g: tuple[float, float] = (0.0, 0.0)
    correlation_time: float = field(default=0.5, metadata={"unit": "s"})
    interval: float = 0.5
    largest_rate_deg_per_s: float = 45.0
    largest_heading_sd_deg: float = 20.0

    kind: ClassVar[str] = "no_slip"
    summary: ClassVar[str] = "wheels that do not slip: no lateral and vertical velocity"
    source: ClassVar[str] = "Dissanayake et al. (2001); single-track model of the slip"

    def __post_init__(self) -> None:
        check_numbers(self, "lever_arm", 3)
        check_numbers(self, "mounting_sd_deg", 2, low=0.0)
        check_numbers(self, "compliance_sd_deg_per_g", 2, low=0.0)
        for name in ("roll_deg", "pitch_deg", "yaw_deg"):
            check_number(self, name, low=-360.0, high=360.0)
        for name in ("lateral_sd", "vertical_sd", "interval"):
            check_number(self, name, low=0.0, above=True)
        for name in ("largest_rate_deg_per_s", "largest_heading_sd_deg"):
            check_number(self, name, low=0.0, above=True)
        for name in ("slip_deg_per_g", "dive_deg_per_g", "correlation_time"):
            check_number(self, name, low=0.0)

    @property
    def axes(self) -> VehicleAxes:
        """Axes of the vehicle."""
        angles = (self.roll_deg, self.pitch_deg, self.yaw_deg)
        return VehicleAxes(angles, (0.0, *self.mounting_sd_deg))

    def states(self) -> tuple[SensorStates, ...]:
        """Return the states of mounting and compliance that have standard deviations."""
        mounting = self.axes.states(self.name)
        sds = dict(zip(YIELDING, self.compliance_sd_deg_per_g, strict=True))
        if not any(sds.values()):
            return mounting
        labels = [label for label, sd in sds.items() if sd > 0.0]
        block = f"{self.name}.compliance"
        return (*mounting, unseen(block, labels, "rad/g", [math.radians(sds[x]) for x in labels]))

    def begin(self) -> Array:
        """Return an empty window."""
        return np.concatenate([[np.nan], np.zeros(MEMORY - 1)])

    def watch(self, memory: Array, time: Array, rows: Array) -> tuple[Array, Epochs]:
        """Return an epoch per interval, with the mean rate and force over it."""
        memory = memory.copy()
        at, means = np.empty(len(time), dtype=np.int64), np.empty((len(time), 6))
        count = interval_sums(time, rows, self.interval, memory, at, means)
        return memory, Epochs(time[at[:count]], means[:count])

    @property
    def lasts(self) -> bool:
        """As `Aid.lasts`: with a stated correlation time."""
        return self.correlation_time > 0.0

    def observe(self, view: View, values: Array) -> list[Observation]:
        """Return the lateral and the vertical velocity, if within the limits."""
        # About the third level axis, which is vertical.
        heading_sd = math.sqrt(view.covariance[HEADING, HEADING])
        if heading_sd > math.radians(self.largest_heading_sd_deg):
            return []
        axes = self.axes
        velocity, H = point_velocity(view, self.lever_arm)
        velocity, H = axes.of_vehicle(view, self.name, velocity, H)
        rate = axes.now(view, self.name) @ values[:3]
        force, of_force = axes.of_vehicle(view, self.name, values[3:6], np.zeros_like(H))
        if abs(rate[2]) > math.radians(self.largest_rate_deg_per_s):
            return []
        # Slip is proportional to the lateral force, dive to the longitudinal one.
        load = force[[1, 0]] / STANDARD_GRAVITY
        of_load = of_force[[1, 0]] / STANDARD_GRAVITY
        yields = velocity[0] * load
        z, dz = velocity[1:], H[1:]
        block = f"{self.name}.compliance"
        if view.has(block):
            rows = [YIELDING.index(label) for label in view.labels(block)]
            found = np.zeros(2)
            found[rows] = view.estimate(block)
            z = z - found * yields
            dz = dz - found[:, None] * (load[:, None] * H[0] + velocity[0] * of_load)
            dz[rows, view.place(block)] += np.diag(yields[rows])
        left = np.radians([self.slip_deg_per_g, self.dive_deg_per_g]) * yields
        sd = np.hypot([self.lateral_sd, self.vertical_sd], left)
        R = sd**2 * longer_by(self.interval, self.correlation_time)
        return [Observation(f"{self.name}.velocity", z, dz, R, LABELS)]


#: Compliant parts: tires sideways, springs along.
YIELDING = ("slip", "dive")
LABELS = ("lateral, m/s", "vertical, m/s")


# Odometer: forward speed of a point of the vehicle.


@dataclass(frozen=True)
class Odometer(TabulatedMeasurement):
    """Speed of an unsteered wheel: ``reading = (1 + scale) v_forward + noise``.

    Attributes
    ----------
    lever_arm : tuple of float, m
        From the inertial sensors to the wheel, or to the middle of the axle whose two wheels are
        averaged; body axes.
    roll_deg, pitch_deg, yaw_deg : float, deg
        Of the inertial sensors in the vehicle (`VehicleAxes`). Their error is hardly observable
        along the wheel.
    mounting_of : str
        Name of another aid, as one of kind no_slip, whose estimated mounting is used.
    speed_sd : float, m/s
        Of the noise of each speed, where the file does not state it.
    scale_sd : float
        Of the scale factor, as by wear, pressure and load of a tire; more than zero adds the
        state ``NAME.scale``.
    least_speed : float, m/s
        Slower readings are not used: many sensors read zero for a slow wheel.
    """

    lever_arm: tuple[float, float, float] = (0.0, 0.0, 0.0)
    roll_deg: float = 0.0
    pitch_deg: float = 0.0
    yaw_deg: float = 0.0
    mounting_of: str = ""
    speed_sd: float = field(default=0.0, metadata={"unit": "m_per_s"})
    scale_sd: float = 0.02
    least_speed: float = 0.0

    kind: ClassVar[str] = "odometer"
    summary: ClassVar[str] = "speed of a wheel, with its scale factor"
    source: ClassVar[str] = "Groves (2013), sec. 16.2"
    columns: ClassVar[tuple[str, ...]] = tuple(ODOMETER)
    stream: ClassVar[str] = "wheel"
    of_samples: ClassVar[bool] = True

    def __post_init__(self) -> None:
        check_numbers(self, "lever_arm", 3)
        for name in ("roll_deg", "pitch_deg", "yaw_deg"):
            check_number(self, name, low=-360.0, high=360.0)
        for name in ("speed_sd", "scale_sd", "least_speed"):
            check_number(self, name, low=0.0)
        check_other_name(self, "mounting_of")

    def states(self) -> tuple[SensorStates, ...]:
        """Return the state of the scale factor, if it has a standard deviation: reading/true-1."""
        if self.scale_sd == 0.0:
            return ()
        return (unseen(f"{self.name}.scale", ("scale",), "1", self.scale_sd),)

    def epochs(self, table: pd.DataFrame) -> Epochs:
        """Return an epoch for each measured speed; see `TabulatedMeasurement.epochs`."""
        check_odometer(table)
        values = values_of(table, ODOMETER)
        told = np.isfinite(values[:, 1]) & (np.abs(values[:, 0]) >= self.least_speed)
        return Epochs(index_of(table)[told], values[told])

    def observe(self, view: View, values: Array) -> list[Observation]:
        """Return the forward velocity minus the speed."""
        if self.mounting_of:
            check_block(view, f"{self.mounting_of}.mounting")
        velocity, H = point_velocity(view, self.lever_arm)
        axes = VehicleAxes((self.roll_deg, self.pitch_deg, self.yaw_deg))
        velocity, H = axes.of_vehicle(view, self.mounting_of, velocity, H)
        factor = 1.0
        H = H[:1]
        block = f"{self.name}.scale"
        if view.has(block):
            factor += float(view.estimate(block)[0])
            H[0, view.place(block)] = -values[0] / factor**2
        z = velocity[:1] - values[0] / factor
        R = np.array([(values[1] / factor) ** 2])
        return [Observation(f"{self.name}.speed", z, H, R, ("forward, m/s",))]


# A velocity measured along the axes of an instrument: Doppler log, radar, camera.


@dataclass(frozen=True)
class BodyVelocity(TabulatedMeasurement):
    """Velocity relative to the Earth from an instrument: ``(1 + scale) C_ib v_b + noise``.

    Attributes
    ----------
    lever_arm : tuple of float, m
        From the inertial sensors to the instrument, body axes.
    roll_deg, pitch_deg, yaw_deg : float, deg
        Of the inertial sensors in the instrument (`VehicleAxes`).
    mounting_sd_deg : tuple of float, deg
        Of roll, pitch, yaw; each that is more than zero is a state of ``NAME.mounting``.
    mounting_of : str
        Name of another aid whose estimated mounting is used, instead.
    scale_sd : float
        Of the scale factor, as by the speed of sound; more than zero adds ``NAME.scale``.
    """

    lever_arm: tuple[float, float, float] = (0.0, 0.0, 0.0)
    roll_deg: float = 0.0
    pitch_deg: float = 0.0
    yaw_deg: float = 0.0
    mounting_sd_deg: tuple[float, float, float] = (0.0, 0.0, 0.0)
    mounting_of: str = ""
    scale_sd: float = 0.0

    kind: ClassVar[str] = "body_velocity"
    summary: ClassVar[str] = "velocity along the axes of an instrument, as a Doppler log's"
    source: ClassVar[str] = "Groves (2013), sec. 16.3"
    columns: ClassVar[tuple[str, ...]] = tuple(BODY_VELOCITY)

    def __post_init__(self) -> None:
        check_numbers(self, "lever_arm", 3)
        check_numbers(self, "mounting_sd_deg", 3, low=0.0)
        for name in ("roll_deg", "pitch_deg", "yaw_deg"):
            check_number(self, name, low=-360.0, high=360.0)
        check_number(self, "scale_sd", low=0.0)
        check_other_name(self, "mounting_of")

    @property
    def axes(self) -> VehicleAxes:
        """Axes of the instrument."""
        angles = (self.roll_deg, self.pitch_deg, self.yaw_deg)
        return VehicleAxes(angles, self.mounting_sd_deg)

    def states(self) -> tuple[SensorStates, ...]:
        """Return the states of mounting and scale factor that have a standard deviation."""
        scale = (unseen(f"{self.name}.scale", ("scale",), "1", self.scale_sd),)
        mounting = () if self.mounting_of else self.axes.states(self.name)
        return mounting + (scale if self.scale_sd > 0.0 else ())

    def epochs(self, table: pd.DataFrame) -> Epochs:
        """Return an epoch for each row with a measured axis; see `TabulatedMeasurement.epochs`."""
        check_body_velocity(table)
        values = values_of(table, BODY_VELOCITY)
        told = np.isfinite(values[:, 3:]).any(axis=1)
        return Epochs(index_of(table)[told], values[told])

    def observe(self, view: View, values: Array) -> list[Observation]:
        """Return the innovation of the velocity along the measured axes: computed − measured."""
        if self.mounting_of:
            check_block(view, f"{self.mounting_of}.mounting")
        velocity, H = point_velocity(view, self.lever_arm)
        velocity, H = self.axes.of_vehicle(view, self.mounting_of or self.name, velocity, H)
        factor = 1.0
        block = f"{self.name}.scale"
        if view.has(block):
            factor += float(view.estimate(block)[0])
            H[:, view.place(block)] = -values[:3, None] / factor**2
        z = velocity - values[:3] / factor
        R = (values[3:] / factor) ** 2
        told = np.isfinite(R)
        labels = tuple(
            label for label, there in zip(BODY_VELOCITY_LABELS, told, strict=True) if there
        )
        return [Observation(f"{self.name}.velocity", z[told], H[told], R[told], labels)]


BODY_VELOCITY_LABELS = ("forward, m/s", "right, m/s", "down, m/s")


# Mounting of the inertial sensors in a vehicle or an instrument: assumed angles, and their error.


ANGLES = ("roll", "pitch", "yaw")


@dataclass(frozen=True)
class VehicleAxes:
    """Axes of a vehicle, forward, right, down, along which its wheels roll; or of an instrument.

    Attributes
    ----------
    angles_deg : tuple of float, deg
        Roll, pitch, yaw of the inertial sensors in the vehicle, 3-2-1, as `Mounting.angles_deg`:
        with a level vehicle that drives north they are roll, pitch and heading of the sensors.
        ``C_vb`` rotates the axes of the sensors to those of the vehicle.
    sd_deg : tuple of float, deg
        Of three angular errors, about the axes of the vehicle:
        ``C_vb true = R_z(-yaw) R_y(-pitch) R_x(-roll) C_vb assumed``. For assumed angles of zero
        they are assumed − true, and otherwise nearly. An angle with zero standard deviation is
        exact and has no state. A rotation about the direction of travel is not observable by a
        velocity along it.
    """

    angles_deg: tuple[float, float, float] = (0.0, 0.0, 0.0)
    sd_deg: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def states(self, name: str) -> tuple[SensorStates, ...]:
        """Return the mounting states of an aid, if any: errors of the angles, rad."""
        labels = [label for label, sd in zip(ANGLES, self.sd_deg, strict=True) if sd > 0.0]
        if not labels:
            return ()
        sds = [math.radians(sd) for sd in self.sd_deg if sd > 0.0]
        return (unseen(f"{name}.mounting", labels, "rad", sds),)

    def now(self, view: View, name: str) -> Array:
        """Return ``C_vb``, (3, 3), with its estimated errors subtracted."""
        # Estimates are subtracted from the roll, then the pitch, then the yaw.
        return self._back(view, name)[0] @ rotation.dcm_from_euler(self.angles_deg)

    def of_vehicle(self, view: View, name: str, velocity: Array, H: Array) -> tuple[Array, Array]:
        """Rotate a velocity in body axes, and its error sensitivities, into axes of the vehicle.

        Parameters
        ----------
        name : str
            Of the aid that has the states: ``NAME.mounting``.
        velocity : ndarray, (3,)
        H : ndarray, (3, columns)

        Returns
        -------
        velocity : ndarray, (3,)
        H : ndarray, (3, columns)
        """
        back, axes, labels = self._back(view, name)
        C_vb = back @ rotation.dcm_from_euler(self.angles_deg)
        out, H = C_vb @ velocity, C_vb @ H
        if labels:
            at = view.place(f"{name}.mounting")
            H[:, at] = np.column_stack([np.cross(axes[ANGLES.index(x)], out) for x in labels])
        return out, H

    def _back(self, view: View, name: str) -> tuple[Array, Array, tuple[str, ...]]:
        """Rotation that subtracts the estimates, the axes of the remaining angles, their names."""
        if not view.has(f"{name}.mounting"):
            return np.eye(3), np.eye(3), ()
        labels = view.labels(f"{name}.mounting")
        found = dict(zip(labels, view.estimate(f"{name}.mounting").tolist(), strict=True))
        roll, pitch, yaw = (math.degrees(found.get(label, 0.0)) for label in ANGLES)
        back = rotation.dcm_from_euler([-roll, -pitch, -yaw])
        axes = np.eye(3)
        axes[0] = rotation.dcm_from_euler([0.0, -pitch, -yaw])[:, 0]
        axes[1] = rotation.dcm_from_euler([0.0, 0.0, -yaw])[:, 1]
        return back, axes, labels


# Computed motion of a point of the body, and its sensitivity to the errors.


def rate_columns(view: View, rate: Array, force: Array) -> Array:
    """Return the sensitivity of a measured rate to the errors of the gyros.

    Parameters
    ----------
    rate, force : ndarray, (3,), rad/s and m/s²
        Measured values.

    Returns
    -------
    ndarray, (3, columns)
        Body axes.
    """
    gyro = view.model.stacked.gyro
    weights = np.concatenate([[1.0], rate, force])
    H = np.zeros((3, view.columns))
    H[:, PHYSICAL:] = np.tensordot(weights, gyro, axes=1)
    return H


def turn_of_body(view: View) -> tuple[Array, Array]:
    """Return the rate of the body relative to the Earth, and its errors.

    Returns
    -------
    rate : ndarray, (3,), rad/s
        Body axes: ``w_ib - C_bl w_ie``.
    H : ndarray, (3, columns)
        Of the errors of the gyros, and of the attitude that rotates the Earth's rate:
        ``-C_bl [w_ie x] psi``.
    """
    earth = view.ellipsoid.rotation_rate * view.level[AXIS : AXIS + 3]
    C_bl = view.C_lb.T
    H = rate_columns(view, view.rate, view.force)
    H[:, ROTATION] = -C_bl @ cross_matrix(earth)
    return view.rate - C_bl @ earth, H


def point_velocity(view: View, arm: ArrayLike) -> tuple[Array, Array]:
    """Return the velocity relative to the Earth of a point fixed to the body.

    Parameters
    ----------
    arm : array_like, (3,), m
        From the inertial sensors to the point, body axes.

    Returns
    -------
    velocity : ndarray, (3,), m/s
        Body axes: ``C_bl v + w_eb x r``.
    H : ndarray, (3, columns)
        ``C_bl (dv + [v x] psi) - [r x] dw_eb``, with ``C_computed = exp([psi x]) C_true``.
    """
    r = np.asarray(arm, dtype=np.float64)
    C_bl = view.C_lb.T
    velocity = C_bl @ view.velocity
    H = np.zeros((3, view.columns))
    if r.any():
        turn, of_turn = turn_of_body(view)
        velocity = velocity + np.cross(turn, r)
        H -= cross_matrix(r) @ of_turn
    H[:, VELOCITY] += C_bl
    H[:, ROTATION] += C_bl @ cross_matrix(view.velocity)
    return velocity, H
