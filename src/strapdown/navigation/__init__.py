"""The aided navigator: segments between epochs, what it records, how it is watched."""

from __future__ import annotations

from typing import TYPE_CHECKING

from strapdown.lazy_names import load_on_first_use

if TYPE_CHECKING:
    from strapdown.navigation.engine import LostCovarianceError
    from strapdown.navigation.filter_options import Damping, Feedback, Feedforward
    from strapdown.navigation.navigator import Navigator
    from strapdown.navigation.record import NavigationPiece

__all__ = [
    "Damping",
    "Feedback",
    "Feedforward",
    "LostCovarianceError",
    "NavigationPiece",
    "Navigator",
]

load_on_first_use(
    __name__,
    {
        "engine": "LostCovarianceError",
        "filter_options": "Damping Feedback Feedforward",
        "navigator": "Navigator",
        "record": "NavigationPiece",
    },
)
