"""GNSS fixes from files: the registry of readers, and tables with column names."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.constants import TIME_UNITS
from strapdown.errors import ConfigError, DataError, Finding, check_choice
from strapdown.formats import (
    comma2k19,
    csv,
    gnss_logger,
    gnss_nmea,
    gnss_pos,
    kf_gins,
    kitti,
    parquet,
    pyins,
)
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
    "GNSS_READERS",
    "QUANTITIES",
    "GnssOptions",
    "GnssReader",
    "detect",
    "files_of_fixes",
    "read",
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


def detect(path: Path) -> bool:
    """Detect by the suffix."""
    return csv.detect(path) or parquet.detect(path)


def read(path: Path, options: GnssOptions) -> Fixes:
    """Read the fixes of a table by its column names.

    Returns
    -------
    Fixes
        Names may carry a unit, as ``lat_deg``, ``vN [km/h]``, ``sdU_m``; the default units are
        those of a Gnss table. A column ``Q`` has the codes of RTKLIB, ``quality`` those of NMEA.

    Raises
    ------
    DataError
        Time or the position is missing, two columns fit one quantity, a unit is unknown, or the
        only height is above the geoid.
    """
    raw = parquet.read(path) if parquet.detect(path) else csv.read(path)
    return fixes_of_columns(raw, options)


def fixes_of_columns(raw: RawLog, options: GnssOptions) -> Fixes:
    """Convert named columns to fixes; see `read`."""
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


@dataclass(frozen=True)
class GnssReader:
    """How one format of fixes is recognized and read."""

    title: str
    detect: Callable[[Path], bool]
    read: Callable[[Path, GnssOptions], Fixes]


#: In the order of detection.
GNSS_READERS: dict[str, GnssReader] = {
    "comma2k19": GnssReader(
        "receiver of a comma2k19 segment, its folder", comma2k19.detect_fixes, comma2k19.read_fixes
    ),
    "rtklib": GnssReader("solution of RTKLIB (.pos)", gnss_pos.detect, gnss_pos.read),
    "nmea": GnssReader("NMEA 0183: GGA, RMC, VTG, ZDA, GST", gnss_nmea.detect, gnss_nmea.read),
    "gnss-logger": GnssReader(
        "GnssLogger of Android: lines Fix", gnss_logger.detect_fixes, gnss_logger.read_fixes
    ),
    "kitti": GnssReader("KITTI raw, folder oxts", kitti.detect, kitti.read_fixes),
    "kf-gins": GnssReader(
        "KF-GINS fixes, 7 or 13 columns without a header", kf_gins.detect_fixes, kf_gins.read_fixes
    ),
    "python-ins": GnssReader(
        "python-ins arrays: fix_time, fix (.npz)", pyins.detect_fixes, pyins.read_fixes
    ),
    "columns": GnssReader(
        "table with named columns (.csv .txt .tsv .dat .parquet)",
        detect,
        read,
    ),
}


def files_of_fixes(path: str | Path) -> tuple[Path, ...]:
    """List the files that fixes are read from: one, or several of a folder."""
    given = Path(path)
    if kitti.detect(given):
        return kitti.files_of(given)
    return comma2k19.files_of(given) or (given,)


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
    if not path.exists():
        raise ConfigError("io.no-such-file", file=str(path))
    if path.is_file() and comma2k19.belongs(path):
        raise DataError("io.fixes-comma-k-segment-two", file=path.name, parent=path.parent)
    if path.is_file() and path.stat().st_size == 0:
        raise DataError("io.file-empty", file=path.name)
    if asked.format is not None:
        check_choice(
            "io.unknown-format-of-fixes", GNSS_READERS, quantity="format", format=asked.format
        )
    readers = [GNSS_READERS[asked.format]] if asked.format else GNSS_READERS.values()
    for reader in readers:
        if asked.format or reader.detect(path):
            return table_of_fixes(reader.read(path, asked), asked)
    if path.is_dir():
        raise DataError("io.folder-fixes-read-file", file=path.resolve().name)
    kinds = "; ".join(r.title for r in GNSS_READERS.values())
    raise DataError(
        "io.ending-no-known-format-fixes", file=path.name, suffix=path.suffix, kinds=kinds
    )
