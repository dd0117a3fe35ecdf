"""Positions of watches, receivers, drones: Garmin FIT and TCX, GPX, KML, IGC, GeoJSON, DJI."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Mapping
from datetime import UTC, datetime
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.errors import DataError, Finding, add_note
from strapdown.formats.clocks import RELATIVE, UNIX
from strapdown.formats.join import join
from strapdown.formats.known_formats import from_json, lacking, selected
from strapdown.formats.recording import RawLog
from strapdown.formats.signs import Signs, head
from strapdown.formats.text_columns import decoded
from strapdown.formats.writing import (
    FileOptions,
    Tables,
    dates_if_known,
    fixes_not_held,
    fixes_of,
    heights_of,
    iso_dates,
    over_ground,
)
from strapdown.parsers import parse
from strapdown.tables.checks import values_of

# GPX tracks (https://www.topografix.com/GPX/1/1/): fixes, read by gpxpy.
#
# Every ``trkpt`` of every track and segment, in their order: latitude and longitude in degrees of
# WGS 84, ``time`` in UTC. ``ele`` is over the sea, and ``geoidheight`` the height of the geoid
# over the ellipsoid, as in NMEA GGA; ``fix`` is the kind of solution. ``speed`` in m/s and
# ``course`` in degrees from north are elements of a point of GPX 1.0, and in 1.1 of Garmin's
# extension (https://www8.garmin.com/xmlschemas/TrackPointExtensionv2.xsd).


QUALITY = {"none": 0.0, "dgps": 2.0, "pps": 3.0}


detect_gpx = Signs(text=r"\A[\s\S]{0,4092}?<gpx")


def read_gpx_fixes(path: Path) -> RawLog:
    """Read the points that have a time."""
    points = parse("recorders.gpx", path)
    times = points["time"]
    timed = np.array([t is not None for t in times], dtype=bool)
    if not timed.any():
        raise DataError("io.track-without-time", file=path.name, quantity="time", count=len(times))

    def values(name: str) -> np.ndarray:
        return np.array(points[name], dtype=np.float64)

    held = {
        "time": (np.array([0.0 if t is None else t for t in times]), "s"),
        "lat": (values("latitude"), "deg"),
        "lon": (values("longitude"), "deg"),
        "alt_msl": (values("elevation"), "m"),
        "quality": (np.array([QUALITY.get(f or "", 1.0) for f in points["fix"]]), None),
    }
    if np.isfinite(values("geoid_height")[timed]).all():
        held["geoid"] = (values("geoid_height"), "m")
    if np.isfinite(values("speed") * values("course")).any():
        held |= {"speed": (values("speed"), "m/s"), "course": (values("course"), "deg")}
    return _points_with_time(RawLog.of(path, held, clock=UNIX), timed)


def _points_with_time(log: RawLog, timed: NDArray[np.bool_]) -> RawLog:
    """Keep the points that have a time; others are reported."""
    if not timed.all():
        add_note(
            log.findings,
            "io.points-without-time",
            file=log.name,
            quantity="time",
            lost=int((~timed).sum()),
            count=timed.size,
        )
    return selected(log, timed)


# KML and KMZ (OGC 12-007r2, KML 2.3): recorded tracks, and places with a time stamp.
#
# Longitude, latitude and height; the height is over the sea (EGM96) where its mode is absolute, and
# else not stated: it is that over the ground, or not used.


# An archive is a KMZ by its ending; a text is KML by what is found in it.
detect_kml = Signs(
    suffixes=(".kml", ".kmz", ".xml"),
    first=rb"\APK\x03\x04|<kml[\s>]",
    also=lambda path: path.suffix.lower() == ".kmz" or not head(path).startswith("PK"),
)


def read_kml_fixes(path: Path) -> RawLog:
    """Read the points that have a time.

    Raises
    ------
    DataError
        The XML is damaged, or no point has a time.
    """
    points = parse("recorders.kml", path)
    timed = np.array([t is not None for t in points["time"]], dtype=bool)
    if not timed.any():
        raise DataError("io.track-without-time", file=path.name, quantity="time", count=timed.size)
    places = np.array([[*p, np.nan][:3] for p in points["place"]], dtype=np.float64)
    absolute = all(mode == "absolute" for mode in points["mode"])
    held = {
        "lat": (places[:, 1], "deg"),
        "lon": (places[:, 0], "deg"),
        "alt_msl" if absolute else "alt_unstated": (places[:, 2], "m"),
    }
    return _of_track(path, points["time"], held, timed)


def _of_track(
    path: Path,
    times: list[Any],
    held: Mapping[str, tuple[NDArray[Any], str]],
    timed: NDArray[np.bool_],
) -> RawLog:
    """Make a log of the points with a time, which is a text or seconds since 1970.

    DataError: a time is not a date.
    """
    stamps = np.array(["" if t is None else str(t) for t in times], dtype=object)
    dates = pd.to_datetime(pd.Series(stamps[timed]), format="ISO8601", utc=True, errors="coerce")
    if dates.isna().any():
        at = int(np.flatnonzero(timed)[int(np.argmax(dates.isna()))])
        raise DataError("io.track-time-no-date", file=path.name, row=at + 1, text=stamps[at])
    seconds = np.zeros(timed.size)
    ticks = dates.dt.tz_localize(None).to_numpy().astype("datetime64[ns]").astype(np.int64)
    seconds[timed] = ticks / 1e9
    return _points_with_time(RawLog.of(path, {"time": (seconds, "s"), **held}, clock=UNIX), timed)


# TCX (https://www8.garmin.com/xmlschemas/TrainingCenterDatabasev2.xsd): points of laps. The schema
# does not say from which level heights count; devices take them from the sea, or a barometer.


detect_tcx = Signs(text=r"\A[\s\S]{0,4092}?<(?:\w+:)?TrainingCenterDatabase[\s>]")


def read_tcx_fixes(path: Path) -> RawLog:
    """Read the points that have a position and a time.

    Raises
    ------
    DataError
        The XML is damaged, or no point has a position and a time.
    """
    points = parse("recorders.tcx", path)
    timed = np.array([t is not None for t in points["time"]], dtype=bool)
    if not timed.any():
        raise DataError("io.track-without-time", file=path.name, quantity="time", count=timed.size)
    places = np.array(points["place"], dtype=np.float64)
    held = {"lat": (places[:, 1], "deg"), "lon": (places[:, 0], "deg")}
    if np.isfinite(places[:, 2]).any():
        held["alt_unstated"] = (places[:, 2], "m")
    return _of_track(path, points["time"], held, timed)


# IGC (FAI, Technical Specification for GNSS Flight Recorders, appendix A): a line ``B`` a fix: time
# of day in UTC, degrees and thousandths of minutes, validity, pressure and GNSS altitude. A line
# ``HFDTE`` has the date, and ``HFALG`` says whether altitudes are over the ellipsoid or the geoid.


detect_igc = Signs(text=r"\AA[A-Z0-9]{3}[\s\S]*?^HFDTE")
_DATE_OF_IGC = re.compile(r"^HFDTE(?:DATE:)?(\d\d)(\d\d)(\d\d)", re.M)
_FIX_OF_IGC = re.compile(
    r"^B(\d\d)(\d\d)(\d\d)(\d\d)(\d{5})([NS])(\d{3})(\d{5})([EW])([AV])(-?\d{4,5})(-?\d{4,5})", re.M
)
_LEVEL_OF_IGC = re.compile(r"^HFALG[^:\n]*:\s*(ELL|GEO)", re.M)


def read_igc_fixes(path: Path) -> RawLog:
    """Read the fixes with an altitude of the receiver; the others are left out with a note.

    Raises
    ------
    DataError
        The file has no date, or no such fix.
    """
    text = path.read_bytes().decode("latin-1")
    date, fixes = _DATE_OF_IGC.search(text), [m.groups() for m in _FIX_OF_IGC.finditer(text)]
    whole = [fix for fix in fixes if fix[9] == "A"]
    if date is None or not whole:
        raise DataError("io.track-without-time", file=path.name, quantity="time", count=len(fixes))
    day, month, year = map(int, date.groups())
    century = 1900 if year >= 80 else 2000  # the first recorders are of the eighties
    try:
        midnight = datetime(century + year, month, day, tzinfo=UTC).timestamp()
    except ValueError:
        text = date[0]
        raise DataError("io.track-time-no-date", file=path.name, row=1, text=text) from None
    hour, minute, second = np.array([fix[:3] for fix in whole], dtype=np.float64).T
    time = 3600.0 * hour + 60.0 * minute + second
    days = np.concatenate([[0], np.cumsum(np.diff(time) < -43200.0)])

    def angle(degrees: int, negative: str) -> NDArray[np.float64]:
        parts = np.array([fix[degrees : degrees + 2] for fix in whole], dtype=np.float64)
        signs = np.where([fix[degrees + 2] == negative for fix in whole], -1.0, 1.0)
        return np.asarray(signs * (parts[:, 0] + parts[:, 1] / 60e3))

    level = _LEVEL_OF_IGC.search(text)
    height = {"ELL": "alt", "GEO": "alt_msl", "": "alt_unstated"}[level[1] if level else ""]
    held = {
        "time": (midnight + 86400.0 * days + time, "s"),
        "lat": (angle(3, "S"), "deg"),
        "lon": (angle(6, "W"), "deg"),
        height: (np.array([fix[11] for fix in whole], dtype=np.float64), "m"),
    }
    log = RawLog.of(path, held, clock=UNIX)
    if lost := len(fixes) - len(whole):
        code = "io.fixes-without-position-left-out"
        add_note(log.findings, code, file=path.name, count=lost)
    return log


# GeoJSON (RFC 7946): points with a time among their properties, or paths with the times of their
# positions in the property ``coordTimes`` (of togeojson). Heights are over the ellipsoid (4).

#: Properties with the time of a point, and with the times of the positions of a path.
_TIMES = ("time", "timestamp", "datetime", "date", "when", "utc")
_TIMES_OF_PATH = ("coordTimes", "times", "timestamps")


detect_geojson = Signs(text=r'\A\s*\{[\s\S]{0,2000}?"(?:FeatureCollection|Feature)"')


def read_geojson_fixes(path: Path) -> RawLog:
    """Read the points that have a time.

    Raises
    ------
    DataError
        It is not JSON, a coordinate is not a number, or no point has a time.
    """
    content = from_json(path)
    times: list[Any] = []
    places: list[list[float]] = []
    features = content.get("features", [content]) if isinstance(content, dict) else []
    for feature in features if isinstance(features, list) else []:
        if not isinstance(feature, dict):
            continue
        said, shape = feature.get("properties") or {}, feature.get("geometry") or {}
        where: Any = shape.get("coordinates")
        stamps = [next((said[n] for n in said if n.lower() in _TIMES), None)]
        if shape.get("type") == "Point":
            where = [where]
        elif shape.get("type") == "LineString":
            nested = said.get("coordinateProperties") or {}
            stamps = next((d[n] for d in (said, nested) for n in _TIMES_OF_PATH if n in d), [])
        else:
            continue
        try:
            places += [[*map(float, p), np.nan][:3] for p in where]
        except (TypeError, ValueError):
            row = len(places) + 1
            raise DataError("io.track-place-no-number", file=path.name, row=row) from None
        times += stamps if len(stamps) == len(where) else [None] * len(where)
    timed = np.array([t is not None for t in times], dtype=bool)
    if not timed.any():
        raise DataError("io.track-without-time", file=path.name, quantity="time", count=timed.size)
    table = np.array(places, dtype=np.float64)
    held = {quantity: (table[:, k], unit) for quantity, k, unit in _GEOJSON}
    return _of_track(path, times, held, timed)


_GEOJSON = (("lat", 1, "deg"), ("lon", 0, "deg"), ("alt", 2, "m"))


# Writing: GPX 1.1, speed and course in Garmin's extension.

_FIX = {1: "3d", 2: "dgps", 3: "pps", 4: "dgps", 5: "dgps"}
_BEGIN = """<?xml version="1.0" encoding="UTF-8"?>
<gpx version="1.1" creator="strapdown" xmlns="http://www.topografix.com/GPX/1/1" \
xmlns:e="http://www.garmin.com/xmlschemas/TrackPointExtension/v2">
<metadata><name>{name}</name><desc>{heights}</desc></metadata>
<trk><name>{name}</name><trkseg>
"""
_HEIGHTS = (
    "Elevations (ele) are over the WGS 84 ellipsoid, not over mean sea level as GPX has them: the "
    "height of the geoid is not stated, and geoidheight is 0 so that their sum is the height over "
    "the ellipsoid."
)
_OVER_SEA = (
    "Elevations (ele) are over the geoid: {geoid:.9g} m (geoidheight), the same everywhere, is "
    "taken off the heights over the WGS 84 ellipsoid."
)


_AS_STATED = "Elevations (ele) are {height}."


def write_gpx(path: Path, tables: Tables, options: FileOptions) -> list[Finding]:
    """Write one track of the fixes, or of the positions of a trajectory.

    Latitude and longitude have the fewest digits that reproduce each; dates microseconds, as far
    as readers go. ``ele`` is over the sea by the stated height of the geoid; without one it is that
    over the ellipsoid, with ``geoidheight`` 0 and a warning; the description of the file says
    which. Points of a clock that is not related to UTC are written without a time, with a warning.

    DataError: there are neither fixes nor a trajectory.
    """
    from strapdown.formats.trajectory_writers import one_line

    options.require_wgs84("GPX")
    gnss, findings = fixes_of(tables, "GPX")
    stamps, said = dates_if_known(gnss, options, "GPX")
    over_sea, geoid, warned = heights_of(gnss, options)
    findings += [*said, *warned, *fixes_not_held("GPX", gnss, position_sd=False)]
    speed, course = (v.tolist() for v in over_ground(gnss))
    heights = _HEIGHTS if options.geoid_undulation is None else _OVER_SEA.format(geoid=geoid)
    if options.heights_as_stated:
        heights = _AS_STATED.format(height=options.height)
    geoid_text = f"<geoidheight>{_decimal(geoid)}</geoidheight>" if np.isfinite(geoid) else ""
    name = escape(one_line(options.name), quote=False)
    lines = [_BEGIN.format(name=name, heights=heights)]
    times = [""] * len(gnss)
    if stamps is not None:
        times = [f"<time>{date}</time>" for date in iso_dates(stamps)]
    quality = values_of(gnss, ["quality"])[:, 0].astype(int).tolist()
    places = zip(*values_of(gnss, ["lat", "lon"]).T.tolist(), over_sea.tolist(), strict=True)
    for k, ((lat, lon, ele), time) in enumerate(zip(places, times, strict=True)):
        moves = ""
        if np.isfinite(speed[k]):
            moves = (
                f"<extensions><e:TrackPointExtension><e:speed>{_decimal(speed[k])}</e:speed>"
                f"<e:course>{_decimal(course[k])}</e:course></e:TrackPointExtension></extensions>"
            )
        fix = f"<fix>{_FIX[quality[k]]}</fix>" if quality[k] in _FIX else ""
        lines.append(
            f'<trkpt lat="{_decimal(lat)}" lon="{_decimal(lon)}"><ele>{_decimal(ele)}</ele>{time}'
            f"{geoid_text}{fix}{moves}</trkpt>\n"
        )
    lines.append("</trkseg></trk>\n</gpx>\n")
    path.write_bytes("".join(lines).encode())
    return findings


def _decimal(value: float) -> str:
    """The fewest digits that reproduce a number, as a decimal of XML, which has no exponent."""
    text = repr(value)
    return np.format_float_positional(value, trim="0") if "e" in text else text


# Garmin FIT (``.fit``): activities with fixes, and cameras and watches with a gyro; by fitdecode.
#
# The messages and their fields are those of the FIT profile (https://developer.garmin.com/fit):
# ``record`` has positions in semicircles (2³¹ are 180°), ``enhanced_altitude`` over the sea,
# speed in m/s and ``gps_accuracy`` in m; ``gyroscope_data``, ``accelerometer_data`` and
# ``magnetometer_data`` have arrays of samples, each with its offset in ms from the stamp of the
# message. Where a device did not calibrate them, ``three_d_sensor_calibration`` converts counts:
# less ``level_shift`` and ``offset_cal``, times ``calibration_factor`` over
# ``calibration_divisor``, turned by ``orientation_matrix`` (FIT SDK, "calibration adjustment").
# The profile does not say where the axes of a device point.


FIT_TITLE = "Garmin FIT"
#: Degrees of a semicircle.
SEMICIRCLE = 180.0 / 2**31
SENSORS = {
    "gyro": ("gyroscope_data", "gyro", "deg/s", "gyroscope"),
    "accel": ("accelerometer_data", "accel", "g", "accelerometer"),
    "mag": ("magnetometer_data", "mag", "gauss", "compass"),
}
KINDS = (*(kind for kind, *_ in SENSORS.values()), "three_d_sensor_calibration", "record")
Message = dict[str, Any]


detect_fit = Signs(first=rb"\A[\x0c\x0e].{7}\.FIT")


def read_fit(path: Path) -> RawLog:
    """Read the gyro, with accelerometer and magnetometer interpolated to its stamps."""
    messages = _messages(path)
    logs = [_sensor(path, messages, triad) for triad in SENSORS if messages[SENSORS[triad][0]]]
    if not messages["gyroscope_data"]:
        raise lacking(path, "imu", FIT_TITLE, _streams(messages))
    raw = join(logs, path.name, (path,))
    raw.clock = logs[0].clock
    return raw


def read_fit_fixes(path: Path) -> RawLog:
    """Read the positions of the records."""
    messages = _messages(path)
    records = [m for m in messages["record"] if isinstance(m.get("position_lat"), int)]
    if not records:
        raise lacking(path, "gnss", FIT_TITLE, _streams(messages))

    def values(*names: str) -> NDArray[np.float64]:
        said = [
            next((m[n] for n in names if isinstance(m.get(n), int | float)), np.nan)
            for m in records
        ]
        return np.array(said, dtype=np.float64)

    time, clock = _stamps(records)
    held: dict[str, tuple[NDArray[Any], str | None]] = {
        "time": (time, "s"),
        "lat": (values("position_lat") * SEMICIRCLE, "deg"),
        "lon": (values("position_long") * SEMICIRCLE, "deg"),
        "alt_msl": (values("enhanced_altitude", "altitude"), "m"),
        "speed": (values("enhanced_speed", "speed"), "m/s"),
    }
    if np.isfinite(accuracy := values("gps_accuracy")).any():
        held["horizontal_accuracy"] = (accuracy, "m")
    rows = np.array([m["#"] for m in records])
    findings: list[Finding] = []
    if lost := len(messages["record"]) - len(records):
        add_note(
            findings,
            "io.records-without-place",
            file=path.name,
            lost=lost,
            count=len(messages["record"]),
        )
    return RawLog.of(path, held, clock=clock, rows=rows, findings=findings)


def _messages(path: Path) -> defaultdict[str, list[Message]]:
    """Return the messages of each kind, each with its number in the file as ``#``."""
    return defaultdict(list, parse("recorders.fit", path, wanted=KINDS))


def _streams(messages: defaultdict[str, list[Message]]) -> list[str]:
    there = {
        "imu": messages["gyroscope_data"],
        "gnss": [m for m in messages["record"] if m.get("position_lat") is not None],
    }
    return [stream for stream, has in there.items() if has]


def _stamps(messages: list[Message]) -> tuple[NDArray[np.float64], str]:
    """Return seconds since 1970; since the start of the device if it did not know the date."""
    said = [m.get("timestamp") for m in messages]
    dated = all(isinstance(s, datetime) for s in said)
    seconds = [
        s.replace(tzinfo=s.tzinfo or UTC).timestamp() if isinstance(s, datetime) else s
        for s in said
    ]
    clock = UNIX if dated else RELATIVE
    return np.array([np.nan if s is None else s for s in seconds], dtype=np.float64), clock


def _sensor(path: Path, messages: defaultdict[str, list[Message]], triad: str) -> RawLog:
    kind, prefix, stated, sensor = SENSORS[triad]
    unit: str | None = stated
    own = messages[kind]
    names = [f"calibrated_{prefix}_{a}" for a in "xyz"]
    calibrated = all(m.get(n) is not None for m in own for n in names)
    names = names if calibrated else [f"{prefix}_{a}" for a in "xyz"]
    base, clock = _stamps(own)
    times, samples = [], []
    for message, start in zip(own, base, strict=True):
        axes = [np.atleast_1d(np.array(message.get(n) or [], dtype=np.float64)) for n in names]
        offsets = np.atleast_1d(np.array(message.get("sample_time_offset") or 0, dtype=np.float64))
        if any(a.shape != offsets.shape for a in axes):
            raise DataError(
                "io.fit-samples-and-offsets",
                file=path.name,
                row=message["#"],
                quantity=triad,
                count=offsets.size,
                counts=[a.size for a in axes],
            )
        times.append(start + ((message.get("timestamp_ms") or 0) + offsets) * 1e-3)
        samples.append(np.column_stack(axes))
    values = np.concatenate(samples)
    if not calibrated:
        applied = _calibrated(path, messages, sensor, values)
        values, unit = (values, None) if applied is None else (applied, unit)
    held: dict[str, tuple[NDArray[Any], str | None]] = {"time": (np.concatenate(times), "s")}
    held |= {f"{triad}_{a}": (values[:, k], unit) for k, a in enumerate("xyz")}
    log = RawLog.of(path, held, clock=clock)
    log.name = f"{path.name}/{kind}"
    return log


def _calibrated(
    path: Path, messages: defaultdict[str, list[Message]], sensor: str, counts: NDArray[np.float64]
) -> NDArray[np.float64] | None:
    """Convert counts by the first calibration of their sensor; None if there is none."""
    for one in messages["three_d_sensor_calibration"]:
        factor = next(
            (one[n] for n in one if n.endswith("cal_factor") or n == "calibration_factor"), None
        )
        divisor = one.get("calibration_divisor")
        if one.get("sensor_type") != sensor or not factor or not divisor:
            continue
        offset = np.array(one.get("offset_cal") or (0, 0, 0), dtype=np.float64)
        matrix = np.array(one.get("orientation_matrix") or np.eye(3).ravel(), dtype=np.float64)
        if offset.size != 3 or matrix.size != 9:
            raise DataError(
                "io.fit-samples-and-offsets",
                file=path.name,
                row=one["#"],
                quantity=sensor,
                count=offset.size,
                counts=[matrix.size],
            )
        shifted = counts - float(one.get("level_shift") or 0) - offset
        return np.asarray(shifted * (factor / divisor) @ matrix.reshape(3, 3).T)
    return None


# Subtitles of DJI drones (``.SRT``): the position at each frame or second of a video.
#
# Two families, as in the samples of https://github.com/JuanIrache/DJI_SRT_Parser (MIT):
#
# - ``[latitude: 59.30] [longitude: 18.20] [rel_alt: 1.3 abs_alt: 132.8]`` (older: ``[latitude : …]
#   [longtitude : …] [altitude: …]``): degrees; ``rel_alt`` is over the point of take-off;
#   ``abs_alt`` and ``altitude`` are over the ellipsoid in drones with RTK, and by the air pressure
#   over the sea in others, which the file does not say (DJI Onboard SDK, "Altitude": fused altitude
#   from the sea level at standard pressure, GPS and RTK altitude over the ellipsoid);
# - ``GPS (13.37, 52.50, 15) … H 85.80m``: longitude, latitude, and a third number that is a count
#   of satellites or a height, depending on the drone, and is not used; ``H`` and ``BAROMETER`` are
#   heights over the point of take-off.
#
# Of both families the absolute height is read if it is there, else that over the take-off.
#
# Stamps are those of the subtitles, from the start of the video; the printed date has no time
# zone.


_TIME = re.compile(r"(\d+):(\d\d):(\d\d)[,.](\d{1,3})\s*-->")
_NUMBER = r"\s*([+-]?\d+(?:\.\d+)?)\s*"
_LAT = re.compile(r"\[\s*latitude\s*:" + _NUMBER, re.I)
_LON = re.compile(r"\[\s*long?t?itude\s*:" + _NUMBER, re.I)
_ALT = re.compile(r"\b(?:abs_alt|altitude)\s*:" + _NUMBER, re.I)
_UP = re.compile(r"\b(?:rel_alt\s*:|H(?=\s)|BAROMETER\s*:)" + _NUMBER, re.I)
_PAIR = re.compile(r"\bGPS\s*\(" + _NUMBER + "," + _NUMBER + ",")


def _has_positions(path: Path) -> bool:
    text = head(path, 4096)
    return bool(_TIME.search(text) and (_LAT.search(text) or _PAIR.search(text)))


detect_dji = Signs(text=r"\A[\s\S]{0,4080}?\d:\d\d:\d\d[,.]\d{1,3}\s*-->", also=_has_positions)


def read_dji_fixes(path: Path) -> RawLog:
    """Read the positions."""
    text, findings = decoded(path.read_bytes(), path.name)
    starts = list(_TIME.finditer(text))
    ends = [*(m.start() for m in starts[1:]), len(text)]
    rows, values, lost = [], [], 0
    for start, end in zip(starts, ends, strict=True):
        block = text[start.end() : end]
        hours, minutes, seconds, rest = (int(g) for g in start.groups())
        time = 3600 * hours + 60 * minutes + seconds + int(f"{rest:03d}") * 1e-3
        pair, lat, lon = _PAIR.search(block), _LAT.search(block), _LON.search(block)
        alt, up = _ALT.search(block), _UP.search(block)
        place = (pair[2], pair[1]) if pair else (lat[1], lon[1]) if lat and lon else None
        if place is None:
            lost += 1
            continue
        rows.append(text.count("\n", 0, start.start()) + 1)
        heights = (float(one[1]) if one else np.nan for one in (alt, up))
        values.append((time, float(place[0]), float(place[1]), *heights))
    if not values:
        raise DataError("io.srt-without-places", file=path.name, quantity="lat, lon")
    time, lats, lons, alts, ups = np.array(values).T
    none = (lats == 0.0) & (lons == 0.0)
    if np.abs(lats).max() <= np.pi / 2 and np.abs(lons).max() <= np.pi and not none.all():
        raise DataError(
            "io.srt-degrees-or-radians",
            file=path.name,
            quantity="lat, lon",
            lat=lats[~none][0],
            lon=lons[~none][0],
        )
    if lost:
        add_note(
            findings, "io.subtitles-without-place", file=path.name, lost=lost, count=len(starts)
        )
    held = {
        "time": (time, "s"),
        "lat": (lats, "deg"),
        "lon": (lons, "deg"),
        **({"alt_take_off": (ups, "m")} if np.isnan(alts).all() else {"alt_unstated": (alts, "m")}),
        "quality": (np.where(none, 0.0, 1.0), None),
    }
    return RawLog.of(path, held, rows=np.array(rows), clock=RELATIVE, findings=findings)
