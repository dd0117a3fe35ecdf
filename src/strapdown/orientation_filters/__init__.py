"""Orientation filters: gyros with an accelerometer, and with a magnetometer."""

from __future__ import annotations

from strapdown.attitude_algorithms import with_options
from strapdown.errors import check_choice
from strapdown.orientation_filters.complementary import Complementary
from strapdown.orientation_filters.error_state import ErrorState
from strapdown.orientation_filters.filter import (
    FilterRun,
    OrientationEstimator,
    OrientationTracker,
    run_filter,
    run_for_motion,
)

__all__ = [
    "FILTERS",
    "Complementary",
    "ErrorState",
    "FilterRun",
    "OrientationEstimator",
    "OrientationTracker",
    "is_filter",
    "make_filter",
    "run_filter",
    "run_for_motion",
]

FILTERS: dict[str, type[OrientationEstimator]] = {
    "error-state": ErrorState,
    "complementary": Complementary,
}


def is_filter(text: str) -> bool:
    """Whether a name with options, as of `make_filter`, is that of a filter."""
    return text.strip().lower().partition(":")[0] in FILTERS


def make_filter(text: str) -> OrientationEstimator:
    """Make a filter from its name and options.

    Parameters
    ----------
    text : str
        ``name`` or ``name:option=value,option=value``, as in ``error-state:velocity=10``.

    Returns
    -------
    OrientationEstimator

    Raises
    ------
    ConfigError
        The name, an option or a value is unknown or out of range.
    """
    name, _, rest = text.strip().lower().partition(":")
    check_choice("attitude.no-orientation-filter", FILTERS, quantity="algorithm", name=name)
    made: OrientationEstimator = with_options(FILTERS[name], name, rest)
    return made
