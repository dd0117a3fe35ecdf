"""Strapdown mechanizations: one file each, and the table of all."""

from __future__ import annotations

from strapdown._kernels.level import OMEGA_EL, V_L
from strapdown.mechanization.mechanization import HEIGHTS, Mechanization
from strapdown.mechanization.ned import NorthEastDown
from strapdown.mechanization.run import (
    NavigationRun,
    NavTracker,
    navigate_segments,
    run_mechanization,
)
from strapdown.mechanization.tadic import Tadic
from strapdown.mechanization.wander_azimuth import WanderAzimuth

__all__ = [
    "HEIGHTS",
    "MECHANIZATIONS",
    "OMEGA_EL",
    "V_L",
    "Mechanization",
    "NavTracker",
    "NavigationRun",
    "NorthEastDown",
    "Tadic",
    "WanderAzimuth",
    "navigate_segments",
    "run_mechanization",
]

MECHANIZATIONS: dict[str, type[Mechanization]] = {
    "ned": NorthEastDown,
    "tadic": Tadic,
    "wander_azimuth": WanderAzimuth,
}
