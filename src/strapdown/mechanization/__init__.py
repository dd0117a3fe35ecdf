"""Strapdown mechanizations: one file each, and the table of all."""

from __future__ import annotations

from collections.abc import MutableMapping
from typing import TYPE_CHECKING

from strapdown._kernels.level import OMEGA_EL, V_L
from strapdown.lazy_names import Choices, load_on_first_use
from strapdown.mechanization.mechanization import HEIGHTS, Mechanization
from strapdown.mechanization.ned import NorthEastDown

if TYPE_CHECKING:
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

load_on_first_use(
    __name__,
    {
        "run": "NavTracker NavigationRun navigate_segments run_mechanization",
        "tadic": "Tadic",
        "wander_azimuth": "WanderAzimuth",
    },
)

MECHANIZATIONS: MutableMapping[str, type[Mechanization]] = Choices(
    {
        "ned": "strapdown.mechanization.ned:NorthEastDown",
        "tadic": "strapdown.mechanization.tadic:Tadic",
        "wander_azimuth": "strapdown.mechanization.wander_azimuth:WanderAzimuth",
    }
)
