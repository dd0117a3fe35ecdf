"""Numbers of an alignment as a reader sees them."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from strapdown.alignment.alignment import Alignment
from strapdown.constants import DEG_PER_HOUR, MICRO_G, TWO_SIDED_95
from strapdown.report.crash_values import GAP, about, plain

__all__ = [
    "ANY",
    "NOT_KNOWN",
    "angle_bound",
    "force_words",
    "instant",
    "rate_words",
    "small",
]

Array = NDArray[np.float64]

#: Bounds of roll, pitch and heading, in deg, that leave no angle out.
ANY = (180.0, 90.0, 180.0)
NOT_KNOWN = "not known"


def angle_bound(alignment: Alignment, which: int) -> str:
    """An angle with its bound: ``90.60° ± 0.12°``; in words where it may be any."""
    value = float(alignment.roll_pitch_heading[which])
    half = TWO_SIDED_95 * float(alignment.sd_deg[which])
    if not half < ANY[which]:
        return NOT_KNOWN
    if which == 2:
        value %= 360.0
    return about(value, half, "°")


def instant(time: float) -> str:
    """Say a stamp to a hundredth of a second: ``243298.01 s``."""
    return f"{plain(time, 2).rstrip('0').rstrip('.')}{GAP}s"


def rate_words(rate: float) -> str:
    """A rate in rad/s in deg/h, or in deg/s where that is a large number."""
    if rate * DEG_PER_HOUR < 3600.0:
        return f"{small(rate * DEG_PER_HOUR)} deg/h"
    return f"{small(math.degrees(rate))} deg/s"


def force_words(force: float) -> str:
    """A specific force in m/s² in µg, or in mg where that is a large number."""
    micro = force * MICRO_G
    return f"{micro:.3g} µg" if micro < 1e4 else f"{1e-3 * micro:.3g} mg"


def small(value: float) -> str:
    """Two digits of a small number."""
    size = abs(value)
    if not math.isfinite(size):
        return "–"
    places = 2 if size == 0 else min(5, max(1, 1 - math.floor(math.log10(size))))
    return plain(value, places)
