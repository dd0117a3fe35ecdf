"""Levelling with a heading that somebody knows."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import ClassVar

import pandas as pd

from strapdown.alignment.alignment import Alignment
from strapdown.alignment.coarse import CoarseAlignment
from strapdown.alignment.levelling_alone import UNKNOWN_HEADING
from strapdown.alignment.rest_level import level_at_rest
from strapdown.alignment.site import Site
from strapdown.errors import ConfigError
from strapdown.sensors.imu_uncertainty import ImuUncertainty
from strapdown.tables.checks import is_number

__all__ = ["KnownHeading"]


@dataclass(frozen=True)
class KnownHeading(CoarseAlignment):
    """Roll and pitch from the mean specific force at rest; the heading as stated.

    Attributes
    ----------
    heading_deg : float, deg
        Of the body's forward axis at the last sample, from true north, clockwise.
    sd_deg : float, deg
        Its standard deviation, above zero.

    Raises
    ------
    ConfigError
        The heading is not a number, or its standard deviation not one above zero and below 104.
    """

    name: ClassVar[str] = "known_heading"
    summary: ClassVar[str] = "roll and pitch from the mean specific force at rest; stated heading"
    source: ClassVar[str] = "f_b = C_bn (0, 0, -g)"

    heading_deg: float
    sd_deg: float

    def __post_init__(self) -> None:
        if not (is_number(self.heading_deg) and math.isfinite(self.heading_deg)):
            raise ConfigError(
                "alignment.heading-not-finite", quantity="heading_deg", heading_deg=self.heading_deg
            )
        if not (is_number(self.sd_deg) and 0.0 < self.sd_deg < math.degrees(UNKNOWN_HEADING)):
            raise ConfigError(
                "alignment.heading-sd-not-positive", quantity="sd_deg", sd_deg=self.sd_deg
            )

    def align(
        self,
        imu: pd.DataFrame,
        site: Site,
        sensors: ImuUncertainty,
        gnss: pd.DataFrame | None = None,
    ) -> Alignment:
        """As `CoarseAlignment.align`.

        Raises
        ------
        DataError
            As `rest_level.level_at_rest`.
        """
        found = level_at_rest(
            self.name, imu, site, sensors, self.heading_deg, math.radians(self.sd_deg)
        )
        return replace(found, heading_given=True)
