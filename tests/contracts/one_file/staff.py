"""A measurement in one file: heights by a surveyor's staff."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
import pandas as pd

from strapdown.estimation.covariance import Observation
from strapdown.navigation.measurements.measurement import (
    DISPLACEMENT,
    Epochs,
    TabulatedMeasurement,
    View,
)
from strapdown.tables.checks import check_columns, index_of, source_of, values_of


@dataclass(frozen=True)
class Staff(TabulatedMeasurement):
    """Heights over the ellipsoid, with noise and nothing else.

    Attributes
    ----------
    offset : float, m
        Added to each.
    """

    offset: float = field(default=0.0, metadata={"unit": "m"})

    kind: ClassVar[str] = "staff"
    summary: ClassVar[str] = "heights over the ellipsoid by a staff"
    source: ClassVar[str] = "a test"
    columns: ClassVar[tuple[str, ...]] = ("mark", "mark_sd")
    units: ClassVar[Mapping[str, str]] = {"mark": "m", "mark_sd": "m"}

    def epochs(self, table: pd.DataFrame) -> Epochs:
        """Return an epoch for each height; see `TabulatedMeasurement.epochs`."""
        check_columns(table, self.columns, source_of(table))
        return Epochs(index_of(table), values_of(table, self.columns))

    def observe(self, view: View, values: np.ndarray) -> list[Observation]:
        """Return the height less what was measured."""
        H = np.zeros((1, view.columns))
        H[0, DISPLACEMENT] = -view.C_ln[:, 2]
        z = np.array([view.here.alt - values[0] - self.offset])
        return [Observation(f"{self.name}.height", z, H, values[1:] ** 2, ("up, m",))]
