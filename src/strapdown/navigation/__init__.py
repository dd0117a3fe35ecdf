"""Aided navigation: filter, engine, recorder, smoother and consistency tests."""

from __future__ import annotations

from typing import TYPE_CHECKING

from strapdown.lazy_names import load_on_first_use

if TYPE_CHECKING:
    from strapdown.navigation.engine import LostCovarianceError
    from strapdown.navigation.filter_options import (
        ClosedLoop,
        Correction,
        NoCorrection,
        OpenLoop,
    )
    from strapdown.navigation.measurements.gnss import Gnss
    from strapdown.navigation.navigator import Navigator
    from strapdown.navigation.record import NavigationChunk

__all__ = [
    "ClosedLoop",
    "Correction",
    "Gnss",
    "LostCovarianceError",
    "NavigationChunk",
    "Navigator",
    "NoCorrection",
    "OpenLoop",
]

load_on_first_use(
    __name__,
    {
        "engine": "LostCovarianceError",
        "filter_options": "ClosedLoop Correction NoCorrection OpenLoop",
        "measurements.gnss": "Gnss",
        "navigator": "Navigator",
        "record": "NavigationChunk",
    },
)
