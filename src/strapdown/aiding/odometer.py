"""A wheel that rolls: how fast a point of the vehicle goes forward."""

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
from strapdown.tables.checks import index_of, values_of
from strapdown.tables.odometer import ODOMETER, check_odometer

__all__ = ["Odometer"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Odometer(TableAid):
    """Speed of a wheel that is not steered: ``reading = (1 + scale) v_forward + noise``.

    Attributes
    ----------
    lever_arm : tuple of float, m
        From the inertial sensors to the wheel, or to the middle of the axle whose two wheels are
        averaged; body axes.
    roll_deg, pitch_deg, yaw_deg : float, deg
        Of the inertial sensors in the vehicle (`VehicleAxes`). What is wrong with them is hardly
        seen along the wheel.
    mounting_of : str
        Name of another aid, as one of kind no_slip, whose estimated mounting is used.
    scale_sd : float
        Of the scale factor, as by wear, pressure and load of a tyre; more than zero adds the state
        ``NAME.scale``.
    least_speed : float, m/s
        Slower readings are not used: many sensors read zero where they do not see a wheel turn.
    """

    lever_arm: tuple[float, float, float] = (0.0, 0.0, 0.0)
    roll_deg: float = 0.0
    pitch_deg: float = 0.0
    yaw_deg: float = 0.0
    mounting_of: str = ""
    scale_sd: float = 0.02
    least_speed: float = 0.0

    kind: ClassVar[str] = "odometer"
    summary: ClassVar[str] = "speed of a wheel, with its scale factor"
    source: ClassVar[str] = "Groves (2013), sec. 16.2"
    columns: ClassVar[tuple[str, ...]] = tuple(ODOMETER)

    def __post_init__(self) -> None:
        check_numbers(self, "lever_arm", 3)
        for name in ("roll_deg", "pitch_deg", "yaw_deg"):
            check_number(self, name, low=-360.0, high=360.0)
        for name in ("scale_sd", "least_speed"):
            check_number(self, name, low=0.0)
        check_other_name(self, "mounting_of")

    def states(self) -> tuple[SensorStates, ...]:
        """Return the state of the scale factor, if it has a standard deviation: reading/true-1."""
        if self.scale_sd == 0.0:
            return ()
        return (unseen(f"{self.name}.scale", ("scale",), "1", self.scale_sd),)

    def epochs(self, table: pd.DataFrame) -> Epochs:
        """Return an epoch for each speed that was measured; see `TableAid.epochs`."""
        check_odometer(table)
        values = values_of(table, ODOMETER)
        told = np.isfinite(values[:, 1]) & (np.abs(values[:, 0]) >= self.least_speed)
        return Epochs(index_of(table)[told], values[told])

    def observe(self, view: View, values: Array) -> list[Observation]:
        """Return the forward velocity less the speed."""
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
