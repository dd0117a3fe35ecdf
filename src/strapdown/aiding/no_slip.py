"""Wheels that roll where they point: no velocity to the side, none up or down."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from strapdown._kernels.interval_sums import MEMORY, interval_sums
from strapdown.aiding.aid import Epochs, WatchingAid
from strapdown.aiding.checks import check_number, check_numbers
from strapdown.aiding.correlated import longer_by
from strapdown.aiding.point_velocity import point_velocity
from strapdown.aiding.vehicle_axes import VehicleAxes
from strapdown.aiding.view import View
from strapdown.constants import STANDARD_GRAVITY
from strapdown.estimation.observation import Observation
from strapdown.estimation.sensor_blocks import unseen
from strapdown.estimation.sensor_states import SensorStates

__all__ = ["NoSlip"]

Array = NDArray[np.float64]

# Place of the rotation about the vertical among the physical errors.
HEADING = 8


@dataclass(frozen=True)
class NoSlip(WatchingAid):
    """A vehicle on wheels: a point of an axle that is not steered moves along the vehicle.

    Lateral and vertical velocity of the point, in axes of the vehicle, are zero but for

    * what road and suspension do, `lateral_sd` and `vertical_sd`;
    * the slip angle of the tyres, which grows with the force to the side that they bear, by
      `slip_deg_per_g`: a lateral velocity of ``slip v f_y``;
    * the pitch of the body on its springs, which grows with the force along it, by
      `dive_deg_per_g`: a vertical one of ``dive v f_x``.

    These last over `correlation_time`, and to a filter every observation is new: its variance is
    that of the errors times ``(1 + rho) / (1 - rho)``, ``rho = exp(-interval / correlation_time)``,
    so that a mean over many is as good as it is, whatever the `interval`.

    Slip and dive are mostly no noise: tyres and springs yield by so much a g as long as load and
    tyres are the same. With `compliance_sd_deg_per_g` that constant is estimated, and
    `slip_deg_per_g` and `dive_deg_per_g` are of what is left.

    At rest it holds as well as on the move, and backwards as well as forwards.

    Attributes
    ----------
    lever_arm : tuple of float, m
        From the inertial sensors to the middle of the rear axle, at the height of the sensors,
        body axes. An error of x m is a lateral velocity of x times the rate of turn.
    roll_deg, pitch_deg, yaw_deg : float, deg
        Of the inertial sensors in the vehicle (`VehicleAxes`).
    mounting_sd_deg : tuple of float, deg
        Of pitch and of yaw: more than zero adds the states ``NAME.mounting``, which are seen while
        the vehicle moves and GNSS tells where to.
    lateral_sd, vertical_sd : float, m/s
        Of the velocities at an instant, straight on. A body that rises and falls by 15 mm at
        1.5 Hz on its springs has a vertical one of 0.1 m/s.
    slip_deg_per_g : float, deg/g
        Slip angle of the rear tyres by lateral force.
    dive_deg_per_g : float, deg/g
        Pitch of the body by longitudinal force.
    compliance_sd_deg_per_g : tuple of float, deg/g
        Of constants of the vehicle: above zero adds the states ``NAME.compliance``, by how much
        the direction of travel turns to the right by force to the right (`slip`: below zero by
        tyres alone; an arm that is x m too far forward adds ``x g / v²``), and down by force
        forward (`dive`).
    correlation_time : float, s
    interval : float, s
        Between observations: they are at its multiples, or the first sample after.
    largest_rate_deg_per_s : float, deg/s
        While the vehicle turns faster about its vertical, as it does when it skids, nothing is
        observed.
    largest_heading_sd_deg : float, deg
        Nor while the heading is less known than so: a wrong one by so much has no linear errors.
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
        """Return the states of mounting and compliance, where they have standard deviations."""
        mounting = self.axes.states(self.name)
        sds = dict(zip(YIELDING, self.compliance_sd_deg_per_g, strict=True))
        if not any(sds.values()):
            return mounting
        labels = [label for label, sd in sds.items() if sd > 0.0]
        block = f"{self.name}.compliance"
        return (*mounting, unseen(block, labels, "rad/g", [math.radians(sds[x]) for x in labels]))

    def begin(self) -> Array:
        """Return nothing seen."""
        return np.concatenate([[np.nan], np.zeros(MEMORY - 1)])

    def watch(self, memory: Array, time: Array, rows: Array) -> tuple[Array, Epochs]:
        """Return an epoch an interval, with the mean rate and force over it."""
        memory = memory.copy()
        at, means = np.empty(len(time), dtype=np.int64), np.empty((len(time), 6))
        count = interval_sums(time, rows, self.interval, memory, at, means)
        return memory, Epochs(time[at[:count]], means[:count])

    @property
    def lasts(self) -> bool:
        """As `Aid.lasts`: where a correlation time is stated."""
        return self.correlation_time > 0.0

    def observe(self, view: View, values: Array) -> list[Observation]:
        """Return the lateral and the vertical velocity, or nothing, as the limits say."""
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
        # Slip goes with the force to the side, dive with that along.
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


#: What yields: tyres to the side, springs along.
YIELDING = ("slip", "dive")
LABELS = ("lateral, m/s", "vertical, m/s")
