"""What a table's time counts: seconds of a GPS week, seconds since 1970, or since it began.

A table says it in ``attrs``:

``clock``
    ``gps-seconds-of-week``, ``unix`` (seconds since 1970-01-01 UTC without leap seconds), or
    ``relative`` (from an instant that the file does not state).
``clock_origin``
    Seconds on that clock at the table's time zero; 0 where time stands as in the file.
``gps_week``
    Week of the first row, counted from 1980-01-06; None where it is not known.
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
#: 1980-01-06, from which GPS weeks count, in seconds since 1970.
GPS_EPOCH = 315_964_800.0
# Seconds since 1970 from which GPS time is so many seconds before UTC (IERS Bulletin C).
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
# Clocks of 1970 begin there in 2001; a sensor that counts from its start has not run so long.
_MODERN = 1e9  # s


@dataclass(frozen=True)
class Clock:
    """What a table's time counts; see the module.

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
    """What a table's ``attrs`` say of its clock.

    Parameters
    ----------
    table : DataFrame
    """
    said = table.attrs
    return Clock(
        said.get("clock", RELATIVE), float(said.get("clock_origin", 0.0)), said.get("gps_week")
    )


def with_clock(table: pd.DataFrame, clock: Clock) -> pd.DataFrame:
    """Say it in the ``attrs`` of a table that was just made; the same table is returned.

    Parameters
    ----------
    table : DataFrame
    clock : Clock
    """
    table.attrs |= {"clock": clock.name, "clock_origin": clock.origin, "gps_week": clock.week}
    return table


def clock_of_name(name: str, first: float, *, dated: bool = False) -> str:
    """The clock that a column's name and its first stamp tell.

    Parameters
    ----------
    name : str
        As ``gps_sow_s``, ``unix_time_ms``, ``t``.
    first : float, s
        Its first stamp.
    dated : bool
        The stamps are dates.

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
    """By how much GPS time is ahead of UTC at instants.

    Parameters
    ----------
    unix : ndarray, (n,), s
        Since 1970.
    """
    starts = np.array([start for start, _ in _LEAPS])
    ahead = np.array([0.0, *(float(count) for _, count in _LEAPS)])
    return np.asarray(ahead[np.searchsorted(starts, unix, side="right")])


def gps_from_unix(unix: Array) -> Array:
    """Seconds of GPS since 1980-01-06 of instants of UTC.

    Parameters
    ----------
    unix : ndarray, (n,), s
        Since 1970, without leap seconds.
    """
    return np.asarray(unix - GPS_EPOCH + leap_seconds(unix))


def unix_from_gps(seconds: Array) -> Array:
    """The other way.

    Parameters
    ----------
    seconds : ndarray, (n,), s
        Of GPS since 1980-01-06.
    """
    guess = seconds + GPS_EPOCH
    return np.asarray(guess - leap_seconds(guess - leap_seconds(guess)))


def unrolled(time: Array) -> tuple[Array, list[int]]:
    """Undo the fall of seconds of week at the end of a week.

    Parameters
    ----------
    time : ndarray, (n,), s

    Returns
    -------
    time : ndarray, (n,), s
        Counted on from the first row's week. Where no such fall is, the same array.
    rows : list of int
        The rows, counted from 0, that begin a week.

    Notes
    -----
    A fall is one of a week where it is of more than half a week, from within the last hour of
    one to within the first hour of the next.
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
    """Count a table's time as that of the inertial sensors.

    Parameters
    ----------
    table, imu : DataFrame
        Indexed by time; their ``attrs`` say their clocks, and nothing is known where they do not.
    source : str, optional
        Name of `table` for messages; that of its ``attrs`` where it is left out.

    Returns
    -------
    table : DataFrame
        The same where time already counts so, or where one of the clocks is not known.
    finding : Finding or None
        What was added.

    Raises
    ------
    DataError
        One clock is of 1970, the other of a GPS week, and nothing says which week.
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
