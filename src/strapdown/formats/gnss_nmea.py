"""NMEA 0183 sentences: fixes of GGA, with RMC, VTG, ZDA and GST, and headings of two antennas.

Sentences of one instant are consecutive. GGA has the position, its quality, the height above the
geoid and the geoid undulation; RMC and ZDA the date; GST the standard deviations of latitude,
longitude and height; RMC or VTG speed and true course over ground, for the velocity north and east.
The vertical velocity is not stated.

Headings, deg from true north, of the first of these kinds with one that can be used:

- ``$PASHR,time,heading,T,roll,pitch,heave,sd of roll,sd of pitch,sd of heading,quality,alignment``
  (Trimble, help.fieldsystems.trimble.com/sps/nmea0183-messages-pashr.htm; Hemisphere without the
  last). Quality 0 is no fix. An alignment other than 0 is of an inertial unit, whose heading is
  its own solution.
- ``$PSAT,HPR,time,heading,pitch,roll,type`` (Hemisphere; DGPS MAX manual, section 2.14): type N is
  of the satellites, G of a gyro.
- THS, heading and mode: A autonomous, E dead reckoning, M manual, S simulator, V not valid
  (IEC 61162-1), and HDT, heading and T, which it replaces. Neither has a time.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import reduce
from operator import xor
from pathlib import Path

import numpy as np

from strapdown.errors import DataError, Finding, add_note
from strapdown.formats.clocks import RELATIVE, UNIX, Clock
from strapdown.formats.gnss_fixes import Fixes
from strapdown.formats.recording import NoStreamError, RawLog
from strapdown.formats.signs import HEAD, Signs, first_bytes
from strapdown.formats.text_columns import are_data, decoded, fields_of
from strapdown.formats.writing import (
    FileOptions,
    Tables,
    dates,
    fixes_not_held,
    fixes_of,
    heights_of,
    iso_dates,
    over_ground,
)
from strapdown.tables.checks import POSITION_SD, values_of
from strapdown.units import SPEEDS

_SENTENCE = re.compile(
    r"\$([A-Z]{2}|PSAT,)([A-Z]{3}),([^*]*)\*([0-9A-Fa-f]{2})(?:[,;\s][\d\s.,:-]*)?$"
)
TITLE = "NMEA 0183: GGA, RMC, VTG, ZDA, GST; HDT, THS, PASHR, PSAT,HPR"
#: Kinds of sentences with a heading, the first with one of use counts, and fields that they have.
HEADINGS = {"SHR": 3, "HPR": 5, "THS": 2, "HDT": 1}
_OF_HEADING = re.compile(rf"\$(?:[A-Z]{{2}}|PSAT,)(?:{'|'.join(HEADINGS)}),")
_DAY = 86400.0
#: Longest time that a sentence comes after one of a later instant, s.
_LATE = 60.0
_KNOT = SPEEDS["kn"]
_NAN3 = (np.nan, np.nan, np.nan)


#: Fewest fields of a line that may be of a gyro.
LEAST_FIELDS = 4
# A sentence among the first lines, which may have a stamp or a word before and a stamp behind it.
detect = Signs(first=rb"(?m:^[^$\r\n]{0,64}\$G[PNLAB][A-Z]{3},[^*\r\n]*\*[0-9A-Fa-f]{2})")


@dataclass
class _Epoch:
    """Sentences of one time of day."""

    row: int
    time: float
    place: tuple[float, float, float] = _NAN3
    sd: tuple[float, float, float] = _NAN3
    velocity: tuple[float, float, float] = _NAN3
    quality: float = np.nan
    satellites: float = np.nan
    over_sea: bool = False
    day: float | None = None


def rows_beside(path: Path) -> int:
    """Count the lines, of the first, that are not sentences and hold the numbers of a sensor."""
    text, _ = decoded(first_bytes(path, HEAD), path.name)
    others = [line for line in text.splitlines() if line.strip() and "$" not in line]
    rows = [fields_of(line) for line in others]
    return sum(len(row) >= LEAST_FIELDS and are_data(row) for row in rows)


def read(path: Path) -> Fixes:
    """Read the fixes of NMEA sentences.

    In seconds since 1970 if a date is stated, otherwise in seconds of the first day. Sentences with
    a wrong checksum are dropped and counted.
    """
    epochs: list[_Epoch] = []
    wrong: dict[int, str] = {}
    sentences, findings = _sentences(path, wrong)
    for row, kind, fields in sentences:
        _take(epochs, kind, fields, row, path.name)
    fixed = [e for e in epochs if np.isfinite(e.quality)]
    if not fixed:
        raise DataError("io.holds-no-gga-sentence-whole", file=path.name)
    if wrong:
        row = next(iter(wrong))
        add_note(findings, "io.nmea-lines-left-out", file=path.name, row=row, count=len(wrong))
    time, clock = _times(fixed)
    sd = np.array([e.sd for e in fixed])
    placed = [e for e in fixed if np.isfinite(e.place[2])]
    over_sea = [e for e in placed if e.over_sea]
    if over_sea and len(over_sea) < len(placed):
        raise DataError(
            "io.height-over-sea-geoid-not",
            file=path.name,
            row=over_sea[0].row,
            quantity="GGA height of the geoid",
        )
    velocity = np.array([e.velocity for e in fixed])
    return Fixes(
        name=path.name,
        time=time,
        place=np.array([e.place for e in fixed]),
        rows=np.array([e.row for e in fixed], dtype=np.int64),
        clock=clock,
        velocity=velocity if np.isfinite(velocity).any() else None,
        position_sd=sd if np.isfinite(sd).any() else None,
        quality=np.array([e.quality for e in fixed]),
        satellites=np.array([e.satellites for e in fixed]),
        zero_is_unknown=True,
        heights_from="sea" if over_sea else "",
        height_source="GGA, field 9",
        findings=findings,
    )


def _sentences(
    path: Path, wrong: dict[int, str]
) -> tuple[Iterator[tuple[int, str, list[str]]], list[Finding]]:
    """Return the sentences, each with its row, kind and fields; damaged ones go to `wrong`."""
    text, findings = decoded(path.read_bytes(), path.name)

    def whole() -> Iterator[tuple[int, str, list[str]]]:
        for row, line in enumerate(text.splitlines(), 1):
            start = line.find("$")
            if start < 0:
                continue
            match = _SENTENCE.match(line[start:])
            if match is None or not _whole(match):
                wrong[row] = line[start:]
                continue
            yield row, match[2], match[3].split(",")

    return whole(), findings


def read_heading(path: Path) -> RawLog:
    """Read the headings of two antennas, deg, with standard deviations where all have one.

    On the clock of `read`. A heading without a time of its own has that of the sentence before it,
    the first of several: receivers write one instant under two talkers. Those that are marked as
    not valid, or as not of the antennas, or are not within 0 and 360 deg, are left out and counted,
    as are those with a wrong checksum.
    """
    epochs: list[_Epoch] = []
    found: dict[str, list[tuple[int, int, float, float]]] = {}
    without: dict[str, int] = {}
    wrong: dict[int, str] = {}
    sentences, findings = _sentences(path, wrong)
    for row, kind, fields in sentences:
        if kind not in HEADINGS:
            _take(epochs, kind, fields, row, path.name)
            continue
        if len(fields) < HEADINGS[kind] or (kind == "SHR" and fields[2] != "T"):
            continue  # a sentence of Ashtech under the same name has letters
        timed = bool(epochs)
        if kind in ("SHR", "HPR"):
            time = _number(fields, 0, kind, "time", row, path.name)
            timed = bool(np.isfinite(time))
            time = _time_of_day(time) if timed else np.nan
            if timed and (not epochs or epochs[-1].time != time):
                epochs.append(_Epoch(row, time))
        heading = _number(fields, int(kind in ("SHR", "HPR")), kind, "heading", row, path.name)
        sd = np.nan
        if kind == "SHR" and len(fields) > 8:
            sd = _number(fields, 8, kind, "standard deviation", row, path.name)
        known = found.setdefault(kind, [])
        if not (timed and 0.0 <= heading <= 360.0 and _of_antennas(kind, fields)):
            without[kind] = without.get(kind, 0) + 1
        else:
            known.append((len(epochs) - 1, row, heading, sd))
    damaged = [row for row, line in wrong.items() if _OF_HEADING.match(line)]
    spoiled = {"file": path.name, "quantity": "heading", "count": len(damaged)}
    if damaged and not found:
        raise DataError("io.holds-no-heading-whole", row=damaged[0], **spoiled)
    chosen = min(found, key=lambda kind: (not found[kind], [*HEADINGS].index(kind)), default=None)
    if chosen is None:
        raise NoStreamError(path.name, "heading", TITLE, ["gnss"])
    if damaged:
        add_note(findings, "io.nmea-lines-left-out", row=damaged[0], **spoiled)
    if count := without.get(chosen, 0):
        add_note(findings, "io.headings-left-out", file=path.name, quantity="heading", count=count)
    if not found[chosen]:
        raise DataError("io.no-usable-heading", file=path.name, quantity="heading", count=count)
    if chosen in ("THS", "HDT"):
        add_note(findings, "io.heading-without-time", file=path.name, quantity="time", kind=chosen)
    times, clock = _times(epochs)
    at, rows, heading_deg, sd_deg = (np.array(part) for part in zip(*found[chosen], strict=True))
    _, order = np.unique(times[at], return_index=True)  # in time, the first of each instant
    out = {"time": (times[at[order]], "s"), "heading": (heading_deg[order], "deg")}
    if (sd_deg[order] > 0.0).all():
        out["heading_sd"] = (sd_deg[order], "deg")
    return RawLog.of(path, out, clock=clock.name, rows=rows[order], findings=findings)


def _of_antennas(kind: str, fields: list[str]) -> bool:
    """Whether a heading is marked as valid, and as one by satellites alone."""
    if kind == "SHR":
        by_unit = len(fields) > 10 and fields[10] not in ("", "0")
        return not by_unit and (len(fields) < 10 or fields[9] != "0")
    if kind == "HPR":
        return fields[4] == "N"
    return kind == "HDT" or fields[1] == "A"


def _time_of_day(clock: float) -> float:
    """Compute seconds of the day from hhmmss.ss."""
    return float(3600.0 * (clock // 1e4) + 60.0 * (clock // 1e2 % 1e2) + round(clock % 1e2, 6))


def _number(fields: list[str], k: int, kind: str, what: str, row: int, file: str) -> float:
    try:
        return float(fields[k]) if fields[k] else np.nan
    except ValueError:
        raise DataError(
            "io.not-number", file=file, row=row, quantity=f"{kind} {what}", fields=fields[k]
        ) from None


def _whole(match: re.Match[str]) -> bool:
    body = f"{match[1]}{match[2]},{match[3]}"
    return reduce(xor, body.encode("latin-1", "replace"), 0) == int(match[4], 16)


def _take(epochs: list[_Epoch], kind: str, fields: list[str], row: int, file: str) -> None:
    needed = {"GGA": 11, "GST": 8, "RMC": 9, "VTG": 5, "ZDA": 4}.get(kind)
    if needed is None:
        return
    if len(fields) < needed:
        raise DataError(
            "io.fields-or-more",
            file=file,
            row=row,
            quantity=kind,
            kind=kind,
            count=len(fields),
            needed=needed,
        )
    if not fields[0] and kind != "VTG":
        return

    def number(k: int, what: str) -> float:
        return _number(fields, k, kind, what, row, file)

    if kind == "VTG":
        # Without a time: belongs to the epoch before it, if that has no velocity yet.
        if epochs and np.isnan(epochs[-1].velocity[0]):
            epochs[-1].velocity = _over_ground(number(4, "speed"), number(0, "course"))
        return
    time = _time_of_day(number(0, "time"))
    if not epochs or epochs[-1].time != time:
        epochs.append(_Epoch(row, time))
    epoch = epochs[-1]
    if kind == "GGA":
        epoch.row, epoch.quality = row, number(5, "quality")
        epoch.satellites = float(fields[6]) if fields[6].isdecimal() else np.nan
        if epoch.quality > 0:
            epoch.place = (
                _angle(number(1, "latitude"), fields[2], "S"),
                _angle(number(3, "longitude"), fields[4], "W"),
                number(8, "height") + (number(10, "height of the geoid") if fields[10] else 0.0),
            )
            epoch.over_sea = not fields[10]
    elif kind == "GST":
        epoch.sd = (number(5, "latitude"), number(6, "longitude"), number(7, "height"))
    elif kind == "RMC":
        if fields[1] == "A":
            epoch.velocity = _over_ground(number(6, "speed"), number(7, "course"))
        if len(fields[8]) != 6:
            return
        date = int(number(8, "date"))
        year = date % 100
        epoch.day = _day(year + (2000 if year < 80 else 1900), date // 100 % 100, date // 10000)
    elif kind == "ZDA" and fields[3]:
        epoch.day = _day(*(int(number(k, "date")) for k in (3, 2, 1)))


def _over_ground(knots: float, course_deg: float) -> tuple[float, float, float]:
    """Compute velocity north and east, m/s; a stationary receiver has no course."""
    speed, course = _KNOT * knots, np.radians(course_deg)
    if speed == 0.0:
        return (0.0, 0.0, np.nan)
    return (float(speed * np.cos(course)), float(speed * np.sin(course)), np.nan)


def _angle(value: float, letter: str, negative: str) -> float:
    degrees = value // 100.0
    angle = degrees + (value - 100.0 * degrees) / 60.0
    return -angle if letter == negative else angle


def _day(year: int, month: int, day: int) -> float | None:
    try:
        return datetime(year, month, day, tzinfo=UTC).timestamp()
    except ValueError:
        return None


def _times(fixed: list[_Epoch]) -> tuple[np.ndarray, Clock]:
    """Return seconds since 1970 if a date is stated, unwrapped at midnight, and the clock."""
    time = np.array([e.time for e in fixed])
    step = np.diff(time, prepend=time[:1])
    # A late sentence goes back over midnight. A longer step forward is a pause within the day.
    days = np.cumsum(1.0 * (step < -0.5 * _DAY) - 1.0 * (step > _DAY - _LATE))
    dated = next((k for k, e in enumerate(fixed) if e.day is not None), None)
    if dated is None:
        return time + _DAY * days, Clock(RELATIVE)
    first = fixed[dated].day or 0.0
    return time + first + _DAY * (days - days[dated]), Clock(UNIX)


# Writing.

# Decimals of minutes (0.1 mm), of heights and their standard deviations, of knots and degrees.
_MINUTES, _HEIGHT, _SD, _SPEED = 7, 4, 6, 5


def write(path: Path, tables: Tables, options: FileOptions) -> list[Finding]:
    """Write GGA, RMC and, with known standard deviations, GST of each fix or position.

    Angles have seven decimals of a minute, 0.1 mm; times of day microseconds; heights 0.1 mm, over
    the sea by the stated height of the geoid; without one they are those over the ellipsoid, with a
    height of the geoid of 0 and a warning. RMC has the date.

    DataError: the clock is not related to UTC, or there are neither fixes nor a trajectory.
    """
    options.require_wgs84("NMEA 0183")
    gnss, findings = fixes_of(tables, "NMEA 0183")
    stamps, said = dates(gnss, options, "NMEA 0183")
    over_sea, geoid, warned = heights_of(gnss, options)
    findings += [*said, *warned, *fixes_not_held("NMEA 0183", gnss, position_sd=True)]
    speed, course = over_ground(gnss)
    quality = values_of(gnss, ["quality"])[:, 0].astype(int).tolist()
    lat, lon = values_of(gnss, ["lat", "lon"]).T.tolist()
    sd = values_of(gnss, POSITION_SD)
    lines = []
    separation = f"{geoid:.{_HEIGHT}f}" if np.isfinite(geoid) else ""
    for k, date in enumerate(iso_dates(stamps)):
        time = date[11:-1].replace(":", "")
        day = date[8:10] + date[5:7] + date[2:4]
        place = f"{_minutes(lat[k], 2, 'NS')},{_minutes(lon[k], 3, 'EW')}"
        height = f"{over_sea[k]:.{_HEIGHT}f},M,{separation},M"
        lines.append(_sentence(f"GPGGA,{time},{place},{quality[k]},,,{height},,"))
        moves = ","
        if np.isfinite(speed[k]):
            moves = f"{speed[k] / _KNOT:.{_SPEED}f},{course[k]:.{_SPEED}f}"
        state = "A" if quality[k] else "V"
        lines.append(_sentence(f"GPRMC,{time},{state},{place},{moves},{day},,"))
        if np.isfinite(sd[k]).any():
            fields = ",".join(f"{v:.{_SD}f}" if np.isfinite(v) else "" for v in sd[k].tolist())
            lines.append(_sentence(f"GPGST,{time},,,,,{fields}"))
    path.write_bytes("".join(lines).encode())
    return findings


def _minutes(angle: float, width: int, letters: str) -> str:
    """Return degrees and minutes with the letter of the half; never 60 minutes."""
    ticks = round(abs(angle) * 60 * 10**_MINUTES)
    degrees, rest = divmod(ticks, 60 * 10**_MINUTES)
    whole, part = divmod(rest, 10**_MINUTES)
    letter = letters[1] if angle < 0.0 else letters[0]
    return f"{degrees:0{width}d}{whole:02d}.{part:0{_MINUTES}d},{letter}"


def _sentence(body: str) -> str:
    return f"${body}*{reduce(xor, body.encode(), 0):02X}\r\n"
