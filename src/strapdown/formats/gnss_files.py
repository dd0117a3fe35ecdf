"""GNSS fixes from files, and from tables with column names."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.constants import TIME_UNITS
from strapdown.errors import DataError, Finding
from strapdown.formats import comma2k19, open_stream
from strapdown.formats.arrays import numbers, ticks_of
from strapdown.formats.clocks import GPS, RELATIVE, UNIX, WEEK, Clock, clock_of_name
from strapdown.formats.columns import CLOCKS, TIMES
from strapdown.formats.find_columns import Column
from strapdown.formats.gnss_fixes import Fixes, GnssOptions, table_of_fixes
from strapdown.formats.gnss_pos import QUALITY
from strapdown.formats.quantity_columns import (
    GEODETIC_QUANTITIES,
    LENGTHS,
    SPEEDS,
    Found,
    Quantity,
    find_quantities,
)
from strapdown.formats.recording import RawLog
from strapdown.tables.checks import GEODETIC, POSITION_SD, VELOCITY, VELOCITY_SD

__all__ = [
    "QUANTITIES",
    "GnssOptions",
    "fixes_of_columns",
    "read_gnss",
]


# GNSS fixes from tables with column names: text, Parquet.


Array = NDArray[np.float64]
_SD_HEADS = ("sd", "std", "stddev", "stdev", "sigma", "s")


def _sds(*words: str) -> tuple[str, ...]:
    """List names of a standard deviation, with the word for it before or after the quantity."""
    return tuple(h + w for h in _SD_HEADS for w in words) + tuple(
        w + h for h in _SD_HEADS[:-1] for w in words
    )


#: Quantities of a table of fixes, with their possible names.
QUANTITIES: dict[str, Quantity] = {
    "time": Quantity(
        (*TIMES, *CLOCKS, "gpssecondsofweek", "secondsofweek", "utc", "datetime", "date"),
        TIME_UNITS,
    ),
    "week": Quantity(("week", "gpsweek", "weeknumber", "wn"), {}),
    **GEODETIC_QUANTITIES,
    "alt_msl": Quantity(
        (
            "hmsl",
            "altmsl",
            "altitudemsl",
            "heightmsl",
            "mslaltitude",
            "mslheight",
            "orthometricheight",
        ),
        LENGTHS,
    ),
    "geoid": Quantity(
        ("geoid", "undulation", "geoidsep", "geoidseparation", "geoidheight", "geoidundulation"),
        LENGTHS,
    ),
    "north_sd": Quantity(_sds("n", "north", "lat", "latitude"), LENGTHS),
    "east_sd": Quantity(_sds("e", "east", "lon", "longitude"), LENGTHS),
    "down_sd": Quantity(
        _sds("d", "down", "u", "up", "h", "alt", "altitude", "height", "hgt"), LENGTHS
    ),
    "VN_sd": Quantity(_sds("vn", "veln", "velocityn", "northvelocity", "velnorth"), SPEEDS),
    "VE_sd": Quantity(_sds("ve", "vele", "velocitye", "eastvelocity", "veleast"), SPEEDS),
    "VD_sd": Quantity(
        _sds("vd", "veld", "velocityd", "vu", "velu", "velocityu", "veldown", "velup"), SPEEDS
    ),
    "quality": Quantity(("quality", "fixquality", "gpsquality", "gnssquality"), {}),
    "Q": Quantity(("q",), {}),
}
_NEEDED = ("time", *GEODETIC)


def fixes_of_columns(raw: RawLog, options: GnssOptions) -> Fixes:
    """Convert named columns to fixes.

    Names may carry a unit, as ``lat_deg``, ``vN [km/h]``, ``sdU_m``; the default units are those of
    a Gnss table. A column ``Q`` has the codes of RTKLIB, ``quality`` those of NMEA. DataError: time
    or the position is missing, two columns fit one quantity, a unit is unknown, or the only height
    is above the geoid.
    """
    found = find_quantities(raw.columns, QUANTITIES, options.columns, raw.name, raw.units)
    over_sea = "alt" not in found and "alt_msl" in found
    missing = [q for q in _NEEDED if q not in found and not (q == "alt" and over_sea)]
    if missing:
        raise DataError(
            "io.missing-columns-2",
            file=raw.name,
            missing=missing,
            columns=list(raw.columns),
            missing_2=missing[0],
        )
    if over_sea and "geoid" not in found:
        raise DataError(
            "io.height-over-sea-column",
            file=raw.name,
            quantity="alt",
            source=found["alt_msl"].source,
        )

    def values(quantity: str) -> Array:
        column = found[quantity]
        read = numbers(raw, Column(column.source, None, ""), quantity)
        return np.asarray(read, dtype=np.float64) * column.factor

    def block(names: Sequence[str]) -> Array | None:
        there = [name for name in names if name in found]
        if there and len(there) < len(names):
            missing = next(name for name in names if name not in found)
            raise DataError(
                "io.missing-while-column",
                file=raw.name,
                quantity=missing,
                there=there[0],
                source=found[there[0]].source,
            )
        return np.column_stack([values(name) for name in names]) if there else None

    place = np.column_stack([values("lat"), values("lon"), _height(found, values, raw)])
    time, clock = _time(raw, found["time"])
    if "week" in found and clock.name == RELATIVE:
        clock = Clock(GPS)
    if "week" in found and clock.name == GPS:
        week = values("week")
        time = time + WEEK * (week - week[0])
        clock = Clock(GPS, 0.0, int(week[0]))
    return Fixes(
        name=raw.name,
        time=time,
        place=place,
        rows=np.arange(1, time.size + 1) if raw.rows is None else raw.rows,
        clock=clock,
        velocity=_velocity(raw, block(VELOCITY)),
        position_sd=block(POSITION_SD),
        velocity_sd=block(VELOCITY_SD),
        quality=_quality(raw, found, values),
        findings=raw.findings,
    )


def _height(found: dict[str, Found], values: Callable[[str], Array], raw: RawLog) -> Array:
    if "alt_msl" not in found or "geoid" not in found:
        return values("alt")
    raw.findings.append(
        Finding(
            "io.height-over-ellipsoid-over-sea",
            file=raw.name,
            quantity="alt",
            severity="note",
            source=found["alt_msl"].source,
            source_2=found["geoid"].source,
        )
    )
    return np.asarray(values("alt_msl") + values("geoid"))


def _velocity(raw: RawLog, velocity: Array | None) -> Array | None:
    """Return the velocity; note that speed with course is not used: the vertical part is open."""
    words = [w for name in raw.columns for w in re.split(r"[^a-z]+", name.lower())]
    if velocity is None and {"speed", "sog"} & set(words) and {"course", "cog"} & set(words):
        raw.findings.append(
            Finding(
                "io.speed-course-not-used-nothing",
                severity="note",
                file=raw.name,
                quantity=", ".join(VELOCITY),
            )
        )
    return velocity


def _time(raw: RawLog, found: Found) -> tuple[Array, Clock]:
    ticks, dated = ticks_of(raw, Column(found.source, None, ""))
    time = np.asarray(ticks * (1e-9 if dated else found.factor), dtype=np.float64)
    first = float(time[np.isfinite(time)][0]) if np.isfinite(time).any() else 0.0
    name = clock_of_name(found.source, first, dated=dated)
    if name == UNIX and not dated and not found.stated and first > 1e11:
        raise DataError(
            "io.stamp-no-date-clock-tells",
            file=raw.name,
            row=raw.row(0),
            quantity="time",
            first=first,
            source=found.source,
        )
    return time, Clock(name)


def _quality(raw: RawLog, found: dict[str, Found], values: Callable[[str], Array]) -> Array | None:
    if "quality" in found:
        return values("quality")
    if "Q" not in found:
        return None
    codes = values("Q")
    known = np.isin(codes, list(QUALITY))
    if not known.all():
        k = int(np.argmin(known))
        raise DataError(
            "io.solution-kind-unknown", file=raw.name, row=raw.row(k), quantity="Q", codes=codes[k]
        )
    raw.findings.append(
        Finding(
            "io.column-taken-codes-rtklib-fix",
            severity="note",
            file=raw.name,
            quantity="quality",
            source=found["Q"].source,
        )
    )
    return np.array([QUALITY[int(q)] for q in codes], dtype=np.float64)


def read_gnss(path: str | Path, options: GnssOptions | None = None) -> pd.DataFrame:
    """Read the fixes of a GNSS receiver.

    Parameters
    ----------
    options : GnssOptions, optional
        User's statements about the file.

    Returns
    -------
    DataFrame
        A Gnss table with the time of the file; ``attrs`` has the clock (`clocks`), ``source``
        and ``findings``. A missing velocity has an infinite standard deviation.

    Raises
    ------
    ConfigError
        The file or format does not exist, or `options` names a column that it does not have.
    DataError
        The file cannot be used; the message names file, row, quantity and remedy.
    """
    path, asked = Path(path), options or GnssOptions()
    if path.is_file() and comma2k19.belongs(path):
        raise DataError("io.fixes-comma-k-segment-two", file=path.name, parent=path.parent)
    raw = open_stream(path, "gnss", asked.format)
    return table_of_fixes(raw if isinstance(raw, Fixes) else fixes_of_columns(raw, asked), asked)
