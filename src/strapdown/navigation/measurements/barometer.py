"""Heights from barometric pressure."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.estimation.covariance import Observation
from strapdown.estimation.sensor_blocks import gauss_markov, random_walk, unseen
from strapdown.estimation.sensor_states import SensorStates
from strapdown.navigation.measurements.measurement import (
    DISPLACEMENT,
    ROTATION,
    Epochs,
    TabulatedMeasurement,
    View,
    check_number,
    check_numbers,
)
from strapdown.rotation import cross_matrix
from strapdown.tables.aiding import BAROMETER, barometer_from_pressure, check_barometer
from strapdown.tables.checks import index_of, source_of, values_of

Array = NDArray[np.float64]

HOUR = 3600.0


@dataclass(frozen=True)
class Barometer(TabulatedMeasurement):
    """Barometric height: height above the ellipsoid, a bias, and noise.

    The bias is the height of the sea above the ellipsoid plus the deviation of the weather from the
    standard, or the offset of the heights' reference; it is a state ``NAME.bias``, a random walk
    with the weather or a Gauss-Markov process. Not modeled: air of another temperature, an error of
    0.4 percent a kelvin in heights over the start, and the wind of travel, up to 0.5 m at 10 m/s
    and nine times that at 30 m/s.

    Attributes
    ----------
    lever_arm : tuple of float, m
        From the inertial sensors to the barometer, body axes.
    height_sd : float, m
        Of the noise of each height, where the file does not state it.
    interval : float, s
        More than zero: the rows of a file within each such time are one, their mean. Errors that
        last are not averaged away, and each row costs an update of the filter.
    bias_sd : float, m
        At the start; by default of an absolute pressure: 10 hPa of weather, 84 m, and a geoid that
        is up to 106 m from the ellipsoid, usually 30 m.
    walk : float, m/√h
        How the weather changes: 1 hPa in three hours, by default.
    correlation_time : float, s
        More than zero: a Gauss-Markov process of `bias_sd` instead of a walk.
    """

    lever_arm: tuple[float, float, float] = (0.0, 0.0, 0.0)
    height_sd: float = field(default=0.0, metadata={"unit": "m"})
    interval: float = field(default=0.0, metadata={"unit": "s"})
    bias_sd: float = field(default=90.0, metadata={"unit": "m"})
    walk: float = field(default=5.0, metadata={"unit": "m_per_sqrt_h"})
    correlation_time: float = field(default=0.0, metadata={"unit": "s"})

    kind: ClassVar[str] = "barometer"
    summary: ClassVar[str] = "heights by the pressure of the air, with their bias"
    source: ClassVar[str] = "Groves (2013), sec. 6.2; US Standard Atmosphere (1976)"
    columns: ClassVar[tuple[str, ...]] = tuple(BAROMETER)
    instead: ClassVar[tuple[str, str] | None] = ("pressure", "Pa")
    stream: ClassVar[str] = "barometer"

    def __post_init__(self) -> None:
        check_numbers(self, "lever_arm", 3)
        for name in ("height_sd", "interval", "bias_sd", "walk", "correlation_time"):
            check_number(self, name, low=0.0)

    def states(self) -> tuple[SensorStates, ...]:
        """Return the state of the bias: height reading − true."""
        bias = unseen(f"{self.name}.bias", ("bias",), "m", self.bias_sd)
        if self.correlation_time > 0.0:
            return (gauss_markov(bias, self.correlation_time),)
        return (random_walk(bias, self.walk / HOUR**0.5),)

    def converted(self, table: pd.DataFrame) -> pd.DataFrame:
        """Return a file's table with heights, by the standard atmosphere where it has pressures."""
        if "height" in table:
            out = super().converted(table)
        else:
            pressure = values_of(table, ["pressure"])[:, 0]
            out = barometer_from_pressure(index_of(table), pressure, 1.0, source_of(table))
            # In metres, as of the option, whatever the pressure is.
            out = out.assign(height_sd=np.asarray(table.get("height_sd", self.height_sd)))
        if self.interval > 0.0:
            time = index_of(out)
            of = np.floor((time - time[0]) / self.interval)
            out = out.assign(time=time).groupby(of).mean().set_index("time")
        out.attrs = {**table.attrs}
        return out

    def epochs(self, table: pd.DataFrame) -> Epochs:
        """Return an epoch for each measured height; see `TabulatedMeasurement.epochs`."""
        check_barometer(table)
        values = values_of(table, BAROMETER)
        told = np.isfinite(values[:, 1])
        return Epochs(index_of(table)[told], values[told])

    def observe(self, view: View, values: Array) -> list[Observation]:
        """Return the innovation of the height: computed minus measured."""
        arm = view.C_lb @ np.asarray(self.lever_arm)
        # Up, in level axes.
        up = -view.C_ln[:, 2]
        bias = view.place(f"{self.name}.bias")
        height = view.here.alt + up @ arm
        H = np.zeros((1, view.columns))
        H[0, DISPLACEMENT] = up
        H[0, ROTATION] = -up @ cross_matrix(arm)
        H[0, bias] = -1.0
        z = height - (values[0] - view.estimate(f"{self.name}.bias"))
        return [Observation(f"{self.name}.height", z, H, values[1:] ** 2, ("up, m",))]
