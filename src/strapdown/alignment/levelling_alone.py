"""Roll and pitch alone: the heading stays open."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import ClassVar

import pandas as pd

from strapdown.alignment.alignment import Alignment
from strapdown.alignment.coarse import CoarseAlignment
from strapdown.alignment.rest_level import level_at_rest
from strapdown.alignment.site import Site
from strapdown.errors import Finding
from strapdown.sensors.imu_uncertainty import ImuUncertainty
from strapdown.tables.checks import source_of

__all__ = ["UNKNOWN_HEADING", "Levelling"]

#: Standard deviation of a heading of which nothing is known: uniform over a turn, rad.
UNKNOWN_HEADING = math.pi / math.sqrt(3.0)


@dataclass(frozen=True)
class Levelling(CoarseAlignment):
    """Mean specific force at rest is up; of the heading nothing is known."""

    name: ClassVar[str] = "levelling"
    summary: ClassVar[str] = "roll and pitch from the mean specific force at rest; no heading"
    source: ClassVar[str] = "f_b = C_bn (0, 0, -g)"

    def align(
        self,
        imu: pd.DataFrame,
        site: Site,
        sensors: ImuUncertainty,
        gnss: pd.DataFrame | None = None,
    ) -> Alignment:
        """As `CoarseAlignment.align`; heading 0 stands for any.

        Raises
        ------
        DataError
            As `rest_level.level_at_rest`.
        """
        found = level_at_rest(self.name, imu, site, sensors, 0.0, UNKNOWN_HEADING)
        unknown = Finding(
            "alignment.heading-not-known",
            file=source_of(imu),
            quantity="heading",
            unknown_heading_deg=math.degrees(UNKNOWN_HEADING),
        )
        return replace(found, findings=(*found.findings, unknown))
