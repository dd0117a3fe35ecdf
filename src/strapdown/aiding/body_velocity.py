"""A velocity measured along the axes of an instrument: Doppler log, radar, camera."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.aiding.aid import Epochs, TableAid
from strapdown.aiding.checks import check_block, check_number, check_numbers, check_other_name
from strapdown.aiding.point_velocity import point_velocity
from strapdown.aiding.vehicle_axes import VehicleAxes
from strapdown.aiding.view import View
from strapdown.estimation.observation import Observation
from strapdown.estimation.sensor_blocks import unseen
from strapdown.estimation.sensor_states import SensorStates
from strapdown.tables.body_velocity import BODY_VELOCITY, check_body_velocity
from strapdown.tables.checks import index_of, values_of

__all__ = ["BodyVelocity"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class BodyVelocity(TableAid):
    """Velocity relative to the Earth by an instrument: ``(1 + scale) C_ib v_b + noise``.

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
        """Return an epoch for each row of which an axis was measured; see `TableAid.epochs`."""
        check_body_velocity(table)
        values = values_of(table, BODY_VELOCITY)
        told = np.isfinite(values[:, 3:]).any(axis=1)
        return Epochs(index_of(table)[told], values[told])

    def observe(self, view: View, values: Array) -> list[Observation]:
        """Return the velocity along the axes that were measured, less what was measured."""
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
        labels = tuple(label for label, there in zip(LABELS, told, strict=True) if there)
        return [Observation(f"{self.name}.velocity", z[told], H[told], R[told], labels)]


LABELS = ("forward, m/s", "right, m/s", "down, m/s")
