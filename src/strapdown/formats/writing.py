"""Common part of the writers: stamps on the clock of a format, axes, and what it cannot hold."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from datetime import UTC as UTC_ZONE
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.ellipsoids import WGS84, Ellipsoid
from strapdown.errors import ConfigError, DataError, Finding, add_note, check_choice
from strapdown.formats.clocks import (
    GPS,
    GPS_EPOCH,
    UNIX,
    WEEK,
    clock_of,
    gps_from_unix,
    own_ns,
    unix_from_gps,
)
from strapdown.tables import ACCEL, QUATERNION
from strapdown.tables.checks import (
    GEODETIC,
    MAG,
    POSITION_SD,
    VELOCITY,
    VELOCITY_SD,
    Array,
    height_words,
    values_of,
)

#: Axes of a TUM file: name to (world axes, body axes).
TUM_FRAMES = {
    "enu": ("east, north, up at the origin", "forward, left, up"),
    "ned": ("north, east, down at the origin", "forward, right, down"),
    "ecef": ("earth-centered, earth-fixed", "forward, right, down"),
}

DIGITS = ("exact", "fixed")


@dataclass(frozen=True)
class FileOptions:
    """Options of files; each format uses those that apply to it.

    Attributes
    ----------
    name : str
        Title for people who open the file.
    ellipsoid : Ellipsoid
        Reference of the positions. KML and GeoJSON only support WGS 84.
    epoch : datetime, optional
        With time zone: the instant of time zero of a clock that does not say so. Without it no
        dates are written.
    geoid_undulation : float, optional, m
        Height of the geoid above the ellipsoid, for formats with heights over the sea.
    most_points : int
        Most points of a KML or GeoJSON file; a longer trajectory is thinned.
    tum_frame : {'enu', 'ned', 'ecef'}
        Axes of a TUM file.
    origin : tuple of float, optional
        Latitude and longitude in deg, height over the ellipsoid in m: origin of local axes; by
        default the first position.
    digits : {'exact', 'fixed'}
        For CSV: the fewest that reproduce each number, or a fixed number of decimals, which is
        faster.
    heights_as_stated : bool
        Whether the heights count from the level of the fixes, and not from the ellipsoid.

    Raises
    ------
    ConfigError
        An option is out of its range.
    """

    name: str = "trajectory"
    ellipsoid: Ellipsoid = WGS84
    epoch: datetime | None = None
    geoid_undulation: float | None = None
    most_points: int = 10_000
    tum_frame: str = "enu"
    origin: tuple[float, float, float] | None = None
    digits: str = "exact"
    heights_as_stated: bool = False

    def __post_init__(self) -> None:
        if not isinstance(self.ellipsoid, Ellipsoid):
            raise ConfigError("io.no-ellipsoid", quantity="ellipsoid", ellipsoid=self.ellipsoid)
        if self.epoch is not None and not isinstance(self.epoch, datetime):
            raise ConfigError("io.no-datetime", quantity="epoch", epoch=self.epoch)
        if self.epoch is not None and self.epoch.utcoffset() is None:
            raise ConfigError("io.no-time-zone", quantity="epoch", isoformat=self.epoch.isoformat())
        # The geoid is within 110 m of the ellipsoid.
        if self.geoid_undulation is not None and not abs(self.geoid_undulation) < 200.0:
            raise ConfigError(
                "io.geoid-ellipsoid-none",
                quantity="geoid_undulation",
                geoid_undulation=self.geoid_undulation,
            )
        if not isinstance(self.most_points, int) or self.most_points < 2:
            raise ConfigError(
                "io.line-cannot-drawn-through-points",
                quantity="most_points",
                most_points=self.most_points,
            )
        check_choice(
            "io.no-frame-tum-file", TUM_FRAMES, quantity="tum_frame", tum_frame=self.tum_frame
        )
        if self.origin is not None and not (
            len(self.origin) == 3 and np.isfinite(self.origin).all() and abs(self.origin[0]) <= 90.0
        ):
            raise ConfigError("io.no-origin", quantity="origin", origin=list(self.origin))
        check_choice("io.digits-unknown", DIGITS, quantity="digits", digits=self.digits)

    @property
    def height(self) -> str:
        """Level from which the heights count, in words."""
        return height_words(as_stated=self.heights_as_stated)

    def require_wgs84(self, form: str) -> None:
        """Refuse positions that a format would misinterpret.

        ConfigError: the ellipsoid is not WGS 84.
        """
        if self.ellipsoid != WGS84:
            raise ConfigError(
                "io.holds-places-wgs-alone-these",
                quantity="ellipsoid",
                form=form,
                name=self.ellipsoid.name,
            )

    def date(self, time: float) -> str:
        """Return date and time of day of an instant in UTC, to the microsecond.

        ConfigError: no epoch was given. DataError: the date is out of range.
        """
        if self.epoch is None:
            raise ConfigError("io.without-epoch-no-dates", quantity="epoch")
        try:
            at = self.epoch.astimezone(UTC) + timedelta(seconds=time)
        except (OverflowError, ValueError):
            at = None
        if at is None or not math.isfinite(time):
            raise DataError(
                "io.after-no-date", quantity="epoch", time=time, isoformat=self.epoch.isoformat()
            )
        return at.strftime("%Y-%m-%dT%H:%M:%S.%fZ")


# Tables as their files have them.


Stamps = NDArray[np.int64]
#: Streams by their names (`formats.STREAMS`).
Tables = Mapping[str, pd.DataFrame]

#: Forward, left, up of a vector of forward, right, down, and the way back.
FLU = np.array([1.0, -1.0, -1.0])
SECOND = 1_000_000_000  # ns
_1970 = datetime(1970, 1, 1, tzinfo=UTC_ZONE)


def unix_ns(table: pd.DataFrame, options: FileOptions) -> tuple[Stamps, list[Finding]]:
    """Return stamps in ns since 1970 (UTC without leap seconds), for formats with whole stamps.

    Those of a clock that is not related to UTC are written as they are, with a warning.
    """
    found = _utc(table, options)
    if found is not None:
        return found
    clock = clock_of(table)
    said = _note(table, "io.written-on-own-clock", severity="warning", clock=clock.name)
    return own_ns(table), [said]


def dates(table: pd.DataFrame, options: FileOptions, form: str) -> tuple[Stamps, list[Finding]]:
    """Return stamps in ns since 1970, for formats whose stamps are dates.

    `form`: for messages. DataError: the clock is not related to UTC.
    """
    found = _utc(table, options)
    if found is None:
        raise DataError(
            "io.written-needs-date",
            file=table.attrs.get("source"),
            quantity="time",
            form=form,
            clock=clock_of(table).name,
        )
    return found


def dates_if_known(
    table: pd.DataFrame, options: FileOptions, form: str
) -> tuple[Stamps | None, list[Finding]]:
    """Return stamps in ns since 1970, for formats that can do without; None and a warning then."""
    found = _utc(table, options)
    if found is not None:
        return found
    clock = clock_of(table).name
    return None, [
        _note(table, "io.written-without-dates", severity="warning", form=form, clock=clock)
    ]


def gps_ns(
    table: pd.DataFrame, options: FileOptions, form: str
) -> tuple[Stamps, int | None, list[Finding]]:
    """Return stamps in ns of the GPS week of the first row, that week if known, and findings.

    `form`: for messages. DataError: the clock is not known, and counts beyond a week.
    """
    clock = clock_of(table)
    if clock.name == GPS:
        return own_ns(table), clock.week, []
    found = _utc(table, options)
    if found is None:
        stamps = own_ns(table)
        if stamps[0] < 0 or stamps[-1] >= WEEK * SECOND:
            raise DataError(
                "io.written-needs-week",
                file=table.attrs.get("source"),
                quantity="time",
                form=form,
                clock=clock.name,
                first=stamps[0] / SECOND,
            )
        said = _note(table, "io.written-on-own-clock", severity="warning", clock=clock.name)
        return stamps, None, [said]
    utc, findings = found
    seconds = utc // SECOND
    ahead = np.rint(gps_from_unix(seconds.astype(np.float64)) - seconds).astype(np.int64)
    gps = utc + ahead * SECOND
    week = int(gps[0] // int(WEEK * SECOND))
    shift = float(ahead[0] + GPS_EPOCH)
    findings.append(_note(table, "io.written-utc-as-gps", leap=shift, week=week))
    return gps - week * int(WEEK * SECOND), week, findings


def _utc(table: pd.DataFrame, options: FileOptions) -> tuple[Stamps, list[Finding]] | None:
    """Return ns since 1970, by the clock or by the stated epoch; None if neither relates to UTC."""
    clock, own = clock_of(table), own_ns(table)
    if clock.name == UNIX:
        return own, []
    if clock.name == GPS and clock.week is not None:
        gps = own + int(clock.week * WEEK) * SECOND
        seconds = gps // SECOND
        back = np.rint(seconds - unix_from_gps(seconds.astype(np.float64))).astype(np.int64)
        leap = float(back[0] + GPS_EPOCH)
        return gps - back * SECOND, [_note(table, "io.written-gps-as-utc", leap=leap)]
    if options.epoch is None:
        return None
    since = options.epoch.astimezone(UTC_ZONE) - _1970
    zero = (since // timedelta(microseconds=1)) * 1000
    date = options.epoch.isoformat()
    return own + zero, [_note(table, "io.written-by-epoch", clock=clock.name, epoch=date)]


def _note(table: pd.DataFrame, code: str, severity: Any = "note", **data: Any) -> Finding:
    source = table.attrs.get("source")
    return Finding(code, file=source, quantity="time", severity=severity, **data)


def not_held(form: str, stream: str, what: str, table: pd.DataFrame, **data: Any) -> Finding:
    """Make the finding for a part of a stream that a format cannot hold.

    `what`: ``sampling``, ``magnetic field``, ``standard deviations`` and so on.
    """
    source = table.attrs.get("source")
    more = {"form": form, "stream": stream, "what": what} | data
    return Finding("io.written-without", file=source, quantity=stream, severity="note", **more)


def mark_not_held(form: str, imu: pd.DataFrame) -> list[Finding]:
    """List that a format loses the mark of samples whose sensor's errors were taken off."""
    if "calibrated" not in imu.attrs:
        return []
    source = imu.attrs.get("source")
    return [Finding("io.written-without-calibration-mark", file=source, quantity="imu", form=form)]


def imu_not_held(
    form: str, imu: pd.DataFrame, *, mag: bool = False, mark: bool = False
) -> list[Finding]:
    """List what a format of instantaneous samples loses of an Imu table.

    `mag`, `mark`: whether it holds the magnetic field, and the mark of a calibration.
    """
    lost = [] if mark else mark_not_held(form, imu)
    if imu.attrs.get("sampling") == "mean":
        source = imu.attrs.get("source")
        add_note(lost, "io.written-means", file=source, quantity="sampling", form=form)
    if MAG[0] in imu.columns and not mag:
        lost.append(not_held(form, "imu", "the magnetic field", imu))
    return lost


def accel_needed(imu: pd.DataFrame, form: str) -> None:
    """Refuse samples without specific force for a format that always has it."""
    if ACCEL[0] not in imu.columns:
        raise DataError(
            "io.written-needs-accel", file=imu.attrs.get("source"), quantity="accel", form=form
        )


def is_trajectory(table: pd.DataFrame) -> bool:
    """Whether a ``reference`` is a Trajectory table, and not an attitude alone."""
    return GEODETIC[0] in table.columns or QUATERNION[0] not in table.columns


def fixes_of(tables: Tables, form: str) -> tuple[pd.DataFrame, list[Finding]]:
    """Return the fixes of the streams, or the positions of their trajectory as such.

    `form`: for messages. DataError: there is neither.
    """
    if "gnss" in tables:
        left = [k for k in ("reference",) if k in tables]
        return tables["gnss"], [stream_not_held(form, k, tables[k]) for k in left]
    reference = tables.get("reference")
    if reference is None or not is_trajectory(reference):
        raise DataError("io.written-needs-stream", form=form, needed=["gnss", "a trajectory"])
    out = reference[[*GEODETIC, *VELOCITY]].copy()
    out[POSITION_SD] = np.inf
    out[VELOCITY_SD] = 0.0  # known, though not how well
    out["quality"] = float(ESTIMATED)
    out.attrs = dict(reference.attrs)
    return out, [not_held(form, "reference", "the attitude", reference)]


#: Quality of NMEA 0183 GGA of a position that was computed, not measured.
ESTIMATED = 6


def stream_not_held(form: str, stream: str, table: pd.DataFrame) -> Finding:
    """Make the finding for a stream that is not written at all."""
    return Finding(
        "io.stream-not-written",
        file=table.attrs.get("source"),
        quantity=stream,
        form=form,
        stream=stream,
        rows=len(table),
    )


def fixes_not_held(form: str, gnss: pd.DataFrame, *, position_sd: bool) -> list[Finding]:
    """List what a format of positions with speed and course loses of fixes.

    `position_sd`: whether it holds the standard deviations of positions.
    """
    velocity_sd = values_of(gnss, VELOCITY_SD)
    lost = []
    if not position_sd and np.isfinite(values_of(gnss, POSITION_SD)).any():
        lost.append(not_held(form, "gnss", "the standard deviations of the positions", gnss))
    if (np.isfinite(velocity_sd) & (velocity_sd > 0.0)).any():
        lost.append(not_held(form, "gnss", "the standard deviations of the velocities", gnss))
    if np.isfinite(velocity_sd[:, 2]).any():
        lost.append(not_held(form, "gnss", "the vertical velocity", gnss))
    return lost


def heights_of(gnss: pd.DataFrame, options: FileOptions) -> tuple[Array, float, list[Finding]]:
    """Return heights over the sea, the height of the geoid, and a warning if it is not stated.

    Heights as the fixes state them stay so; the height of the geoid is NaN if it is not stated.
    """
    heights = gnss["alt"].to_numpy(dtype=np.float64)
    if options.heights_as_stated:
        geoid = options.geoid_undulation
        return heights, np.nan if geoid is None else float(geoid), []
    if options.geoid_undulation is None:
        source = gnss.attrs.get("source")
        return heights, 0.0, [Finding("io.written-height-over-ellipsoid", file=source)]
    return heights - options.geoid_undulation, float(options.geoid_undulation), []


def over_ground(gnss: pd.DataFrame) -> tuple[Array, Array]:
    """Return speed, m/s, and course, deg from 0 to 360; NaN where velocity is not measured."""
    north, east = values_of(gnss, VELOCITY[:2]).T
    known = np.isfinite(values_of(gnss, VELOCITY_SD[:2])).all(axis=1)
    speed = np.where(known, np.hypot(north, east), np.nan)
    course = np.degrees(np.arctan2(east, north)) % 360.0
    return speed, np.where(course == 360.0, 0.0, course)  # of -1e-17


def iso_dates(ns: Stamps) -> list[str]:
    """Write ns since 1970 as dates of UTC, rounded to the microsecond."""
    return [f"{date}Z" for date in ((ns + 500) // 1000).astype("datetime64[us]").astype(str)]


def write_numbers(
    path: Path, columns: Sequence[NDArray[Any]], head: str = "", *, separator: str = ","
) -> None:
    """Write columns of numbers as lines, each with the fewest digits that reproduce it.

    `columns` ((n,)): integers or floats. `head`: header text, with its line feeds.
    """
    import pyarrow as pa
    import pyarrow.csv as pa_csv

    with path.open("wb") as stream:
        stream.write(head.encode())
        pa_csv.write_csv(
            pa.table({str(k): pa.array(v) for k, v in enumerate(columns)}),
            stream,
            pa_csv.WriteOptions(include_header=False, delimiter=separator),
        )


def decimal_seconds(ns: Stamps) -> list[str]:
    """Write whole ns as seconds with the fewest decimals."""
    size = np.abs(ns)
    parts = zip((ns < 0).tolist(), (size // SECOND).tolist(), (size % SECOND).tolist(), strict=True)
    return [
        ("-" if negative else "") + (f"{s}.{r:09d}".rstrip("0") if r else f"{s}")
        for negative, s, r in parts
    ]
