"""Numbers of a crash report as a reader sees them: rounded by their bound, with their unit."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    # Reports of other kinds write their numbers by this, and load no crash for it.
    from strapdown.crash.pdof_interval import AngleInterval
    from strapdown.crash.unit_reconstruction import UnitReconstruction
    from strapdown.systems.crash_case import CaseResult

__all__ = [
    "GAP",
    "KMH",
    "MEAN",
    "about",
    "angle_range",
    "axis_names",
    "instant",
    "moment",
    "over_ground",
    "plain",
    "recorder",
    "side_words",
    "spaced",
    "speed",
    "speed_range",
]

#: m/s in km/h.
KMH = 3.6
#: Name of what is combined of all recorders, in every table and chart.
MEAN = "mean of the recorders"
MINUS = "\u2212"
# Between a number, its bound and their unit: they stay in one line.
GAP = "\u00a0"
# A bound is told to this many digits, and its value to the same place.
DIGITS = 2


def plain(value: float, places: int) -> str:
    """Write a number to so many places, with a real minus, and zero without a sign.

    Parameters
    ----------
    value : float
    places : int

    Returns
    -------
    str
        A dash for what is no number.
    """
    if not math.isfinite(value):
        return "–"
    text = f"{value:.{places}f}"
    if float(text) == 0.0:
        text = text.removeprefix("-")
    return text.replace("-", MINUS)


def _places(half: float) -> int:
    """Places at which a bound has its second digit, at most four."""
    if not (math.isfinite(half) and half > 0.0):
        return 2
    return min(4, max(0, DIGITS - 1 - math.floor(math.log10(half))))


def about(value: float, half: float, unit: str) -> str:
    """Write a value with the half width of its bound.

    Parameters
    ----------
    value, half : float
        In the unit.
    unit : str

    Returns
    -------
    str
        As ``7.34 ± 0.27 m/s``, with spaces at which no line breaks.
    """
    places = _places(half)
    both = f"{plain(value, places)}{GAP}±{GAP}{plain(half, places)}"
    return both + (unit if unit == "°" else GAP + unit if unit else "")


def speed(value: float, half: float) -> str:
    """Write a speed in m/s with its bound, in km/h."""
    return about(KMH * value, KMH * half, "km/h")


def speed_range(value: float, half: float) -> str:
    """Write the bound of a speed in m/s as a range, in km/h and m/s."""
    places = _places(KMH * half)
    low, high = KMH * (value - half), KMH * (value + half)
    ends = f"{plain(low, places)} to {plain(high, places)}{GAP}km/h with 95{GAP}%"
    return f"{ends}; {about(value, half, 'm/s')}"


def instant(time: float) -> str:
    """Write an instant or a length of time in s, to a tenth of a millisecond."""
    text = plain(time, 4).rstrip("0").rstrip(".")
    return f"{'0' if text == MINUS + '0' else text}{GAP}s"


def angle_range(interval: AngleInterval) -> str:
    """Write the bound of a direction."""
    if interval.undetermined:
        return "not determined: no direction is excluded with 95 %"
    return f"{plain(interval.low_deg, 1)}° to {plain(interval.high_deg, 1)}° with 95{GAP}%"


def moment(time: float) -> str:
    """Say when an instant is: ``0.7 ms before the trigger``."""
    if abs(time) < 5e-5:
        return "the trigger"
    return f"{plain(1e3 * abs(time), 1)}{GAP}ms {'before' if time < 0.0 else 'after'} the trigger"


def recorder(unit: UnitReconstruction, result: CaseResult) -> str:
    """Name whose answer it is: a recorder's, or the mean's."""
    return MEAN if unit is result.reconstruction.combined else unit.name


def side_words(forward: float, right: float) -> str:
    """Say in words which way a change of velocity is, or a displacement: ``backward``."""
    ahead = "forward" if forward > 0.0 else "backward"
    aside = "to the right" if right > 0.0 else "to the left"
    if abs(forward) > 2.5 * abs(right):
        return ahead
    if abs(right) > 2.5 * abs(forward):
        return aside
    return f"{ahead} and {aside}"


def over_ground(result: CaseResult) -> bool:
    """Whether a heading is known, so that the path is told over ground."""
    entry = result.spec.entry
    return entry.kind == "gnss" or bool(entry.heading_deg)


def axis_names(result: CaseResult) -> tuple[str, str, str]:
    """Return the names of the axes of the path."""
    return ("north", "east", "down") if over_ground(result) else ("forward", "right", "down")


def spaced(text: str) -> str:
    """Return a text with ordinary spaces, for what is searched and not set on a page."""
    return text.replace(GAP, " ")
