"""Azimuth of an axis of the body: a compass, or the baseline of two antennas."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pandas as pd

from strapdown.estimation.covariance import Observation
from strapdown.estimation.sensor_blocks import unseen
from strapdown.estimation.sensor_states import SensorStates
from strapdown.navigation.measurements.measurement import (
    ROTATION,
    Epochs,
    TabulatedMeasurement,
    View,
    check_number,
)
from strapdown.rotation import cross_matrix
from strapdown.tables.aiding import HEADING, check_heading
from strapdown.tables.checks import Array, index_of, values_of


@dataclass(frozen=True)
class Heading(TabulatedMeasurement):
    """Azimuth of an axis of the body, clockwise from north, with a misalignment and noise.

    For a compass the misalignment is the residual of declination and iron; for two antennas, the
    error of the axis. It is observable where another source determines the heading.

    Attributes
    ----------
    axis_deg : float, deg
        Of the axis in the body, from forward to the right: 0 for a compass, 90 for a baseline
        from the left antenna to the right one.
    added_deg : float, deg
        Added to the reading: the declination, east positive, of a magnetic heading.
    heading_sd_deg : float, deg
        Of the noise of each heading, where the file does not state it.
    misalignment_sd_deg : float, deg
        More than zero adds the state ``NAME.misalignment``: reading − truth.
    steepest_deg : float, deg
        No observation while the axis is steeper: an axis that is nearly vertical has no
        azimuth.
    """

    axis_deg: float = 0.0
    added_deg: float = 0.0
    heading_sd_deg: float = 0.0
    misalignment_sd_deg: float = 0.0
    steepest_deg: float = 80.0

    kind: ClassVar[str] = "heading"
    summary: ClassVar[str] = "heading of a compass or of two antennas, with its misalignment"
    source: ClassVar[str] = "Groves (2013), sec. 6.1"
    columns: ClassVar[tuple[str, ...]] = tuple(HEADING)
    stream: ClassVar[str] = "heading"

    def __post_init__(self) -> None:
        for name in ("axis_deg", "added_deg"):
            check_number(self, name, low=-360.0, high=360.0)
        for name in ("heading_sd_deg", "misalignment_sd_deg"):
            check_number(self, name, low=0.0)
        check_number(self, "steepest_deg", low=0.0, high=89.0, above=True)

    def states(self) -> tuple[SensorStates, ...]:
        """Return the state of the misalignment, if it has a standard deviation."""
        if self.misalignment_sd_deg == 0.0:
            return ()
        sd = math.radians(self.misalignment_sd_deg)
        return (unseen(f"{self.name}.misalignment", ("misalignment",), "rad", sd),)

    def epochs(self, table: pd.DataFrame) -> Epochs:
        """Return an epoch for each measured heading; see `TabulatedMeasurement.epochs`."""
        check_heading(table)
        values = np.radians(values_of(table, HEADING))
        told = np.isfinite(values[:, 1])
        return Epochs(index_of(table)[told], values[told])

    def observe(self, view: View, values: Array) -> list[Observation]:
        """Return the azimuth innovation, computed − measured; none if the axis is too steep."""
        angle = math.radians(self.axis_deg)
        axis = view.C_lb @ [math.cos(angle), math.sin(angle), 0.0]
        C_nl = view.C_ln.T
        north, east, down = (C_nl @ axis).tolist()
        if abs(down) > math.sin(math.radians(self.steepest_deg)):
            return []
        H = np.zeros((1, view.columns))
        of_axis = np.array([-east, north, 0.0]) / (north * north + east * east)
        H[0, ROTATION] = -of_axis @ C_nl @ cross_matrix(axis)
        read = values[0] + math.radians(self.added_deg)
        block = f"{self.name}.misalignment"
        if view.has(block):
            read -= float(view.estimate(block)[0])
            H[0, view.place(block)] = -1.0
        z = math.remainder(math.atan2(east, north) - read, 2.0 * math.pi)
        R = values[1:] ** 2
        return [Observation(f"{self.name}.heading", np.array([z]), H, R, ("heading, rad",))]
