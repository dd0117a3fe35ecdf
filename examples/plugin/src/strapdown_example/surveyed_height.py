"""A measurement: heights that are known from a survey."""

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
class SurveyedHeight(TabulatedMeasurement):
    """Heights over the ellipsoid from a survey: ``surveyed`` and ``surveyed_sd`` in m.

    Attributes
    ----------
    offset : float, m
        Sensor above the surveyed mark; in a configuration ``offset_m``.
    """

    offset: float = field(default=0.0, metadata={"unit": "m"})

    kind: ClassVar[str] = "surveyed_height"
    summary: ClassVar[str] = "heights over the ellipsoid from a survey"
    source: ClassVar[str] = "strapdown-example"
    columns: ClassVar[tuple[str, ...]] = ("surveyed", "surveyed_sd")
    units: ClassVar[Mapping[str, str]] = {"surveyed": "m", "surveyed_sd": "m"}

    def epochs(self, table: pd.DataFrame) -> Epochs:
        """An epoch for each height."""
        check_columns(table, self.columns, source_of(table))
        return Epochs(index_of(table), values_of(table, self.columns))

    def observe(self, view: View, values: np.ndarray) -> list[Observation]:
        """Computed height less the measured one, and how it depends on the errors."""
        H = np.zeros((1, view.columns))
        H[0, DISPLACEMENT] = -view.C_ln[:, 2]
        z = np.array([view.here.alt - values[0] - self.offset])
        return [Observation(f"{self.name}.height", z, H, values[1:] ** 2, ("up, m",))]
