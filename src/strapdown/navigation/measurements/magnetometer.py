"""The Earth's magnetic field along the axes of the body."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.errors import ConfigError
from strapdown.estimation.covariance import Observation
from strapdown.estimation.sensor_blocks import gauss_markov, random_walk, unseen
from strapdown.estimation.sensor_states import SensorStates
from strapdown.navigation.measurements.measurement import (
    ROTATION,
    Epochs,
    TabulatedMeasurement,
    View,
    check_number,
    check_numbers,
)
from strapdown.rotation import cross_matrix
from strapdown.tables import MAG
from strapdown.tables.checks import checked_values, index_of, values_of

Array = NDArray[np.float64]

#: Field of the Earth at its surface, at least and at most, uT.
WEAKEST, STRONGEST = 20.0, 70.0


@dataclass(frozen=True)
class Magnetometer(TabulatedMeasurement):
    """Magnetic field: ``reading = C_bn (field + disturbance) + hard iron + noise``, body axes.

    Two blocks of states: ``NAME.hard_iron``, the field of magnetized parts that turn with the body,
    three axes, a random walk; and ``NAME.field``, the deviation of the field where the body is from
    the stated one, north, east, down, a Gauss-Markov process. Hard iron is observable as the body
    turns, the heading wherever the hard iron is known. Not modeled: soft iron, which changes the
    field by some percent with the heading; a room of steel.

    Attributes
    ----------
    field_ned : tuple of float, (3,), uT
        The Earth's field north, east, down, as of the World Magnetic Model; a run needs it.
    axes : str
        Sensor axes that point forward, right, down, as ``x,-y,-z``, or the directions of x, y, z;
        of a file that does not state them. The samples' own columns are along the body.
    noise_sd : float, uT
        Of a reading along each axis, new each time.
    hard_iron_sd, hard_iron_walk : float, uT, uT/√h
        At the start, and how it changes.
    field_sd, field_time : float, uT, s
        Of the deviation of the field, and its correlation time.
    interval : float, s
        Of the readings of a file, the first in each such time is used.
    """

    field_ned: tuple[float, float, float] = field(default=(0.0, 0.0, 0.0), metadata={"unit": "ut"})
    axes: str = ""
    noise_sd: float = field(default=1.0, metadata={"unit": "ut"})
    hard_iron_sd: float = field(default=20.0, metadata={"unit": "ut"})
    hard_iron_walk: float = field(default=1.0, metadata={"unit": "ut_per_sqrt_h"})
    field_sd: float = field(default=3.0, metadata={"unit": "ut"})
    field_time: float = field(default=30.0, metadata={"unit": "s"})
    interval: float = field(default=0.2, metadata={"unit": "s"})

    kind: ClassVar[str] = "magnetometer"
    summary: ClassVar[str] = "the Earth's magnetic field, with hard iron and its deviation"
    source: ClassVar[str] = "Groves (2013), sec. 6.1.1; derived here"
    columns: ClassVar[tuple[str, ...]] = tuple(MAG)
    stream: ClassVar[str] = "magnetometer"
    of_samples: ClassVar[bool] = True

    def __post_init__(self) -> None:
        check_numbers(self, "field_ned", 3)
        for name in ("noise_sd", "field_time"):
            check_number(self, name, low=0.0, above=True)
        for name in ("hard_iron_sd", "hard_iron_walk", "field_sd", "interval"):
            check_number(self, name, low=0.0)
        strength = math.hypot(*self.field_ned)
        if any(self.field_ned) and not WEAKEST <= strength <= STRONGEST:
            raise ConfigError(
                "navigation.no-field-of-the-earth",
                file=self.name or None,
                quantity="field_ned",
                strength=strength,
            )

    def states(self) -> tuple[SensorStates, ...]:
        """Return the states of hard iron, reading − true, and of the field, true − stated."""
        iron = unseen(f"{self.name}.hard_iron", tuple("xyz"), "uT", self.hard_iron_sd)
        about = ("north", "east", "down")
        deviation = unseen(f"{self.name}.field", about, "uT", self.field_sd)
        return (
            random_walk(iron, self.hard_iron_walk / 60.0),
            gauss_markov(deviation, self.field_time),
        )

    def converted(self, table: pd.DataFrame) -> pd.DataFrame:
        """Return the first reading of each interval, of a table along the axes of the body."""
        table = table.iloc[np.flatnonzero(np.isfinite(values_of(table, MAG)).all(axis=1))]
        if self.interval == 0.0 or table.empty:
            return table
        of = np.floor(index_of(table) / self.interval + 1e-9)
        return table.iloc[np.flatnonzero(np.diff(of, prepend=-np.inf) > 0.0)]

    def epochs(self, table: pd.DataFrame) -> Epochs:
        """Return an epoch for each reading; see `TabulatedMeasurement.epochs`."""
        checked_values(table, MAG)
        return Epochs(index_of(table), values_of(table, MAG))

    def observe(self, view: View, values: Array) -> list[Observation]:
        """Return the innovation of the field along the axes of the body: computed − measured."""
        iron, deviation = f"{self.name}.hard_iron", f"{self.name}.field"
        there = view.C_ln @ (np.asarray(self.field_ned) + view.estimate(deviation))
        C_bl = view.C_lb.T
        H = np.zeros((3, view.columns))
        H[:, ROTATION] = C_bl @ cross_matrix(there)
        H[:, view.place(iron)] = -np.eye(3)
        H[:, view.place(deviation)] = -C_bl @ view.C_ln
        z = C_bl @ there - (values - view.estimate(iron))
        R = np.full(3, self.noise_sd**2)
        return [Observation(f"{self.name}.field", z, H, R, tuple(f"{a}, uT" for a in "xyz"))]
