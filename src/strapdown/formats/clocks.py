"""Clock of a table's time: seconds of a GPS week, seconds since 1970, or relative time.

``attrs`` of a table hold:

``clock``
    ``gps-seconds-of-week``, ``unix`` (seconds since 1970-01-01 UTC without leap seconds), or
    ``relative`` (from an instant that the file does not state).
``clock_origin``
    Seconds on that clock at the table's time zero; 0 where time is as in the file.
``gps_week``
    Week of the first row, counted from 1980-01-06; None if unknown.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.errors import DataError, Finding

__all__ = [
    "GPS",
    "RELATIVE",
    "UNIX",
    "WEEK",
    "Clock",
    "clock_of",
    "clock_of_name",
    "gps_from_unix",
    "leap_seconds",
    "on_clock_of",
    "unix_from_gps",
    "unrolled",
    "with_clock",
]

Array = NDArray[np.float64]
GPS, UNIX, RELATIVE = "gps-seconds-of-week", "unix", "relative"
WEEK = 604_800.0  # s
#: 1980-01-06, the origin of GPS weeks, in seconds since 1970.
GPS_EPOCH = 315_964_800.0
# Seconds since 1970 from which on GPS time is this many seconds ahead of UTC (IERS Bulletin C).
_LEAPS = (
    (362_793_600.0, 1),
    (394_329_600.0, 2),
    (425_865_600.0, 3),
    (489_024_000.0, 4),
    (567_993_600.0, 5),
    (631_152_000.0, 6),
    (662_688_000.0, 7),
    (709_948_800.0, 8),
    (741_484_800.0, 9),
    (773_020_800.0, 10),
    (820_454_400.0, 11),
    (867_715_200.0, 12),
    (915_148_800.0, 13),
    (1_136_073_600.0, 14),
    (1_230_768_000.0, 15),
    (1_341_100_800.0, 16),
    (1_435_708_800.0, 17),
    (1_483_228_800.0, 18),
)
_WORDS = {GPS: {"sow", "tow", "gpssow", "gpstow", "gpst", "gps"}, UNIX: {"unix", "utc", "unixtime"}}
# Lower limit of Unix time (2001); no sensor has counted that long since its start.
_MODERN = 1e9  # s


@dataclass(frozen=True)
class Clock:
    """Clock of a table's time; see the module.

    Attributes
    ----------
    name : str
    origin : float, s
    week : int or None
    """

    name: str
    origin: float = 0.0
    week: int | None = None


def clock_of(table: pd.DataFrame) -> Clock:
    """Return the clock stated in a table's ``attrs``.

    Parameters
    ----------
    table : DataFrame
    """
    said = table.attrs
    return Clock(
        said.get("clock", RELATIVE), float(said.get("clock_origin", 0.0)), said.get("gps_week")
    )


def with_clock(table: pd.DataFrame, clock: Clock) -> pd.DataFrame:
    """Write a clock to the ``attrs`` of a new table; return the same table.

    Parameters
    ----------
    table : DataFrame
    clock : Clock
    """
    table.attrs |= {"clock": clock.name, "clock_origin": clock.origin, "gps_week": clock.week}
    return table


def clock_of_name(name: str, first: float, *, dated: bool = False) -> str:
    """Infer the clock from a column's name and its first stamp.

    Parameters
    ----------
    name : str
        As ``gps_sow_s``, ``unix_time_ms``, ``t``.
    first : float, s
        Its first stamp.
    dated : bool
        Whether the stamps are dates.

    Returns
    -------
    str
        `GPS`, `UNIX` or `RELATIVE`.
    """
    words = set(re.split(r"[^a-z]+", name.lower()))
    if dated or words & _WORDS[UNIX]:
        return UNIX
    if words & _WORDS[GPS] and 0.0 <= first <= WEEK + 1.0:
        return GPS
    return UNIX if first > _MODERN and not words & _WORDS[GPS] else RELATIVE


def leap_seconds(unix: Array) -> Array:
    """Return GPS time minus UTC at given instants.

    Parameters
    ----------
    unix : ndarray, (n,), s
        Since 1970.
    """
    starts = np.array([start for start, _ in _LEAPS])
    ahead = np.array([0.0, *(float(count) for _, count in _LEAPS)])
    return np.asarray(ahead[np.searchsorted(starts, unix, side="right")])


def gps_from_unix(unix: Array) -> Array:
    """Convert UTC to GPS seconds since 1980-01-06.

    Parameters
    ----------
    unix : ndarray, (n,), s
        Since 1970, without leap seconds.
    """
    return np.asarray(unix - GPS_EPOCH + leap_seconds(unix))


def unix_from_gps(seconds: Array) -> Array:
    """Convert GPS seconds to UTC, seconds since 1970.

    Parameters
    ----------
    seconds : ndarray, (n,), s
        GPS time since 1980-01-06.
    """
    guess = seconds + GPS_EPOCH
    return np.asarray(guess - leap_seconds(guess - leap_seconds(guess)))


def unrolled(time: Array) -> tuple[Array, list[int]]:
    """Unwrap seconds of week across the end of a week.

    Parameters
    ----------
    time : ndarray, (n,), s

    Returns
    -------
    time : ndarray, (n,), s
        Counted on from the first row's week. The same array if there is no rollover.
    rows : list of int
        Rows, from 0, that begin a week.

    Notes
    -----
    A rollover is a decrease of more than half a week, from the last hour of a week to the
    first hour of the next.
    """
    steps = np.diff(time)
    falls = np.flatnonzero(
        (steps < -0.5 * WEEK) & (time[:-1] > WEEK - 3600.0) & (time[1:] < 3600.0)
    )
    if not falls.size or time.max() > WEEK:
        return time, []
    added = np.zeros(time.size)
    added[falls + 1] = WEEK
    return np.asarray(time + np.cumsum(added)), [int(k) + 1 for k in falls]


def on_clock_of(
    table: pd.DataFrame, imu: pd.DataFrame, source: str | None = None
) -> tuple[pd.DataFrame, Finding | None]:
    """Convert a table's time to that of the inertial sensors.

    Parameters
    ----------
    table, imu : DataFrame
        Indexed by time; ``attrs`` state their clocks, which are unknown otherwise.
    source : str, optional
        Name of `table` for messages; by default that in its ``attrs``.

    Returns
    -------
    table : DataFrame
        The same table if its time is already on that clock, or if one of the clocks is unknown.
    finding : Finding or None
        The offset that was added.

    Raises
    ------
    DataError
        One clock counts from 1970, the other is a GPS week, and the week is not stated.
    """
    own, other = clock_of(table), clock_of(imu)
    file = source or table.attrs.get("source")
    if RELATIVE in (own.name, other.name):
        return table, None
    time = table.index.to_numpy(dtype=np.float64)
    absolute = time + own.origin
    if own.name == other.name == UNIX:
        shift, code = own.origin - other.origin, "io.time-from-1970-shifted"
    elif own.name == other.name:
        weeks = 0.0 if None in (own.week, other.week) else WEEK * (own.week - other.week)  # type: ignore[operator]
        shift, code = own.origin - other.origin + weeks, "io.time-of-gps-week-shifted"
    else:
        if own.name == UNIX:
            gps = gps_from_unix(absolute[:1])[0]
            week = other.week if other.week is not None else int(gps // WEEK)
            shift = float(gps - WEEK * week) - time[0] - other.origin
        elif own.week is None:
            raise DataError("io.gps-week-not-stated", file=file, quantity="time")
        else:
            unix = unix_from_gps(absolute[:1] + WEEK * own.week)[0]
            shift = float(unix) - time[0] - other.origin
        code = "io.time-shifted-by-leap-seconds"
    if shift == 0.0:
        return table, None
    out = table.copy()
    out.index = pd.Index(time + shift, name=table.index.name)
    out.attrs = {**table.attrs, "clock": other.name, "clock_origin": other.origin}
    out.attrs["gps_week"] = other.week
    return out, Finding(
        code,
        file=file,
        quantity="time",
        severity="note",
        shift=shift,
    )
