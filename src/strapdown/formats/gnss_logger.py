"""GnssLogger of Android, and ``device_imu.csv`` of the Google Smartphone Decimeter Challenge.

One line per sample, the kind first: ``UncalGyro,1663164669189,65972053803181,…``. The fields are
defined in LOGGING_FORMAT.md of https://github.com/google/gps-measurement-tools: ``utcTimeMillis``
(the phone's clock), ``elapsedRealtimeNanos`` since the phone was started, three values in rad/s,
m/s² or µT about the axes of the phone, and three biases estimated by Android, which are not
subtracted. ``device_imu.csv`` is the same table with a header (kaggle.com/competitions/
smartphone-decimeter-2022/data). ``Fix`` is a position, with height above the ellipsoid of WGS 84
(Android, Location.getAltitude).

``ground_truth.csv`` of 2021 (kaggle.com/competitions/google-smartphone-decimeter-challenge/data):
``millisSinceGpsEpoch`` without leap seconds, ``latDeg``, ``lngDeg``,
``heightAboveWgs84EllipsoidM``, ``speedMps``, ``courseDegree`` from north. Its stamps are turned to
Unix time, the clock of ``device_imu.csv``. That of 2022 and later is a table of ``Fix`` lines.
``device_gnss.csv`` and ``…_derived.csv`` have pseudoranges, which are not positions.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import DataError, Finding, add_note
from strapdown.formats import csv
from strapdown.formats.arrays import numbers
from strapdown.formats.clocks import UNIX, Clock, unix_from_gps
from strapdown.formats.gnss_fixes import RADIUS, UNSTATED_VERTICAL, Fixes
from strapdown.formats.join import join
from strapdown.formats.known_formats import column, optional, sensor_log, stated_by, under
from strapdown.formats.recording import RawLog
from strapdown.formats.signs import Signs, head
from strapdown.formats.text_columns import decoded, parsed

Array = NDArray[np.float64]

KINDS = {
    "gyro": (("Gyro", "UncalGyro"), "rad/s"),
    "accel": (("Accel", "UncalAccel"), "m/s2"),
    "mag": (("Mag", "UncalMag"), "uT"),
}
SENSOR = ("kind", "utcTimeMillis", "elapsedRealtimeNanos", "x", "y", "z")
HEADER = "MessageType,utcTimeMillis,elapsedRealtimeNanos,MeasurementX,MeasurementY,MeasurementZ"
FIX = "Fix"
FIX_FIELDS = {
    "provider": ("Provider",),
    "lat": ("LatitudeDegrees", "Latitude"),
    "lon": ("LongitudeDegrees", "Longitude"),
    "alt": ("AltitudeMeters", "Altitude"),
    "radius": ("AccuracyMeters", "Accuracy"),
    "utc": ("UnixTimeMillis", "(UTC)TimeInMs"),
    "elapsed": ("elapsedRealtimeNanos",),
    "vertical": ("VerticalAccuracyMeters",),
    "speed": ("SpeedMps", "Speed"),
    "speed_sd": ("SpeedAccuracyMps",),
    "bearing": ("BearingDegrees",),
    "bearing_sd": ("BearingAccuracyDegrees",),
}
# Providers of positions, in order of preference: the receiver before sensor fusion.
PROVIDERS = ("gps", "gt", "flp", "fused")
# Largest drift of the phone's two clocks, or setting of its wall clock, within a log.
MOST_DRIFT = 0.05  # s
HEAD = 1 << 16  # bytes


def _has_header(path: Path) -> bool:
    """Whether there is the header of a table, or comments that define the fields."""
    return csv.detect(path) and any(
        line.startswith(HEADER)
        or _is_description(line, ("UncalGyro", "Gyro", FIX))
        or _is_fix_header(line)
        for line in head(path, HEAD).splitlines()
    )


detect = Signs(text=rf"^(?:MessageType,|#.*(?:Gyro|{FIX}))", also=_has_header)


def _is_description(line: str, kinds: tuple[str, ...]) -> bool:
    fields = line.lstrip("# ").split(",")
    times = {"utcTimeMillis", *FIX_FIELDS["utc"]}
    return line.startswith("#") and fields[0].strip() in kinds and bool(times & set(fields))


def _is_fix_header(line: str) -> bool:
    return line.startswith("MessageType,Provider,LatitudeDegrees,")


def read(path: Path) -> RawLog:
    """Read gyro, accelerometer and magnetometer, joined on the stamps of the gyro.

    Stamps in ns since 1970: the evenly advancing time since the phone's start, plus the median
    offset of its wall clock.
    """
    findings: list[Finding] = []
    lines = _lines(path)
    ahead = _ahead(path, lines, findings)
    logs = []
    for triad, (kinds, unit) in KINDS.items():
        kind = next((k for k in kinds if lines.get(k)), None)
        if kind is None:
            continue
        if kind == "UncalGyro":
            add_note(findings, "io.uncalibrated-gyro", file=path.name, quantity=triad)
        table, rows = _table(path, lines[kind], SENSOR)
        table["time"] = _whole(table["elapsedRealtimeNanos"], path, rows) + ahead
        log = sensor_log(
            f"{path.name}/{kind}",
            path,
            {n: table[n] for n in ("time", "x", "y", "z")},
            triad,
            unit,
            time=("time", "ns"),
            rows=rows,
        )
        logs.append(log)
    if not lines.get("UncalGyro") and not lines.get("Gyro"):
        raise DataError(
            "io.no-line-gyroscope-holds",
            file=path.name,
            quantity="gyro",
            lines=", ".join(lines) or "nothing",
        )
    raw = join(logs, path.name, (path,))
    return dataclasses.replace(raw, findings=[*findings, *raw.findings], clock=UNIX)


def read_fixes(path: Path) -> Fixes:
    """Read the fixes of the receiver.

    Returns stamps in s since 1970, on the clock of the sensors if the log has it.
    """
    findings: list[Finding] = []
    lines = _lines(path)
    names = _fix_names(path)
    if not lines.get(FIX):
        raise DataError(
            "io.no-line-fix-holds",
            file=path.name,
            quantity="lat, lon",
            lines=", ".join(lines) or "nothing",
        )
    table, rows = _table(path, lines[FIX], names)
    at = {q: next((n for n in known if n in table), None) for q, known in FIX_FIELDS.items()}
    missing = [FIX_FIELDS[q][0] for q in ("provider", "lat", "lon", "alt", "utc") if not at[q]]
    if missing:
        raise DataError("io.fixes-no-field", file=path.name, row=int(rows[0]), missing=missing)
    keep = _of_one_provider(path, table[str(at["provider"])], findings)

    def values(quantity: str) -> Array:
        name = at[quantity]
        if name is None:
            return np.full(int(keep.sum()), np.nan)
        raw = RawLog(path.name, (path,), {name: table[name]}, rows=rows)
        return numbers(raw, name, quantity).astype(np.float64)[keep]

    time = values("utc") * 1e-3
    if at["elapsed"] and any(lines.get(k) for k in ("UncalGyro", "Gyro")):
        elapsed = _whole(table[str(at["elapsed"])], path, rows)[keep]
        time = np.asarray((elapsed + _ahead(path, lines, findings)) * 1e-9, dtype=np.float64)
        add_note(findings, "io.fixes-since-start", file=path.name, quantity="time")
    horizontal = values("radius") / RADIUS
    vertical = values("vertical")
    if np.isnan(vertical).any() and np.isfinite(horizontal).any():
        vertical = np.where(np.isnan(vertical), UNSTATED_VERTICAL * horizontal, vertical)
        add_note(
            findings,
            "io.how-well-heights-known-not",
            file=path.name,
            quantity="down_sd",
            unstated_vertical=UNSTATED_VERTICAL,
        )
    # Velocity needs both speed and bearing; the vertical velocity is never known.
    speed, speed_sd = values("speed"), values("speed_sd")
    bearing, bearing_sd = np.radians(values("bearing")), np.radians(values("bearing_sd"))
    down = np.full(speed.size, np.nan)
    sd = np.hypot(speed_sd, speed * bearing_sd)
    moves = np.isfinite(sd * np.cos(bearing)).any()
    return Fixes(
        name=path.name,
        time=time,
        velocity=np.column_stack([speed * np.cos(bearing), speed * np.sin(bearing), down])
        if moves
        else None,
        velocity_sd=np.column_stack([np.where(sd > 0.0, sd, np.nan)] * 2 + [down]),
        place=np.column_stack([values("lat"), values("lon"), values("alt")]),
        rows=rows[keep],
        clock=Clock(UNIX),
        position_sd=np.column_stack([horizontal, horizontal, vertical])
        if np.isfinite(horizontal).any()
        else None,
        findings=findings,
    )


def _lines(path: Path) -> dict[str, list[tuple[int, str]]]:
    """Group lines by their kind, each with its row; drop a truncated last line."""
    text, _ = decoded(path.read_bytes(), path.name)
    found: dict[str, list[tuple[int, str]]] = {}
    wanted = {k for kinds, _ in KINDS.values() for k in kinds} | {FIX}
    for row, line in enumerate(text.splitlines(), 1):
        kind = line.partition(",")[0]
        if kind in wanted:
            found.setdefault(kind, []).append((row, line))
    if found and not text.endswith("\n"):
        kind = max(found, key=lambda k: found[k][-1][0])
        last, before = found[kind][-1], found[kind][0]
        if last[1].count(",") < before[1].count(","):
            found[kind].pop()
    return found


def _table(
    path: Path, lines: list[tuple[int, str]], names: Iterable[str]
) -> tuple[dict[str, NDArray[Any]], NDArray[np.int64]]:
    """Return the fields of lines of one kind by name; fields after the named ones are ignored."""
    known = list(names)
    width = lines[0][1].count(",") + 1
    odd = next(((row, ln) for row, ln in lines if ln.count(",") + 1 != width), None)
    if odd is not None or width < min(len(known), len(SENSOR)):
        row, line = odd or lines[0]
        raise DataError(
            "io.fields-expected",
            file=path.name,
            row=row,
            count=line.count(",") + 1,
            width=max(width, len(SENSOR)),
        )
    columns = parsed("\n".join(line for _, line in lines).encode(), width, ",")
    return dict(zip(known, columns, strict=False)), np.array([row for row, _ in lines])


def _whole(stamps: NDArray[Any], path: Path, rows: NDArray[np.int64]) -> NDArray[np.int64]:
    if stamps.dtype.kind in "iu":
        return stamps.astype(np.int64)
    bad = np.flatnonzero([not str(s).strip().isdecimal() for s in stamps])
    raise DataError(
        "io.no-whole-number-nanoseconds",
        file=path.name,
        row=int(rows[bad[0]]),
        quantity="elapsedRealtimeNanos",
        stamps=stamps[bad[0]],
    )


def _ahead(path: Path, lines: dict[str, list[tuple[int, str]]], findings: list[Finding]) -> int:
    """Compute how far the wall clock is ahead of the time since the phone's start, in ns."""
    kind = next((k for k in ("Gyro", "UncalGyro") if lines.get(k)), None)
    if kind is None:
        return 0
    table, rows = _table(path, lines[kind], SENSOR)
    utc = _whole(table["utcTimeMillis"], path, rows)
    ahead = utc * 1_000_000 - _whole(table["elapsedRealtimeNanos"], path, rows)
    middle = int(np.sort(ahead)[ahead.size // 2])
    if (drift := float(np.ptp(ahead)) * 1e-9) > MOST_DRIFT:
        add_note(
            findings,
            "io.phone-clock-day-moves-against",
            file=path.name,
            quantity="time",
            drift=drift,
        )
    return middle


def _fix_names(path: Path) -> list[str]:
    line = next(
        (
            n
            for n in head(path, HEAD).splitlines()
            if _is_description(n, (FIX,)) or _is_fix_header(n)
        ),
        "",
    )
    return [name.strip() for name in line.lstrip("# ").split(",")]


def _of_one_provider(
    path: Path, providers: NDArray[Any], findings: list[Finding]
) -> NDArray[np.bool_]:
    said = np.array([str(p).strip().lower() for p in providers])
    chosen = next((p for p in PROVIDERS if (said == p).any()), None)
    if chosen is None:
        raise DataError(
            "io.no-gnss-fix", file=path.name, quantity="Provider", said=sorted(set(said))
        )
    keep: NDArray[np.bool_] = np.asarray(said == chosen)
    if not keep.all():
        add_note(
            findings,
            "io.fixes-of-one-provider",
            file=path.name,
            quantity="Provider",
            used=int(keep.sum()),
            count=keep.size,
            provider=chosen,
            others=sorted(set(said[~keep])),
        )
    return keep


# Google Smartphone Decimeter Challenge: `ground_truth.csv` of 2021, and what cannot be read.


CHALLENGE_TRUTH = "collectionName,phoneName,millisSinceGpsEpoch,latDeg,lngDeg,"
PSEUDORANGES = ("ReceivedSvTimeNanos", "receivedSvTimeInGpsNanos", "rawPrM")


detect_challenge = Signs(text=rf"\A{CHALLENGE_TRUTH}")


detect_pseudoranges = Signs(
    text=rf"\A(?:MessageType|collectionName),.*(?:{'|'.join(PSEUDORANGES)})"
)


def read_challenge_fixes(path: Path) -> RawLog:
    """Read the positions of the reference receiver."""
    raw = under(path)
    held = {"time": (unix_from_gps(column(raw, "millisSinceGpsEpoch") * 1e-3), "s")}
    names = {
        "lat": ("latDeg", "deg"),
        "lon": ("lngDeg", "deg"),
        "alt": ("heightAboveWgs84EllipsoidM", "m"),
        "speed": ("speedMps", "m/s"),
        "course": ("courseDegree", "deg"),
    }
    return stated_by(raw, held | optional(raw, names), clock=UNIX)


def refuse_pseudoranges(path: Path) -> RawLog:
    """Refuse pseudoranges."""
    raise DataError("io.pseudoranges", file=path.name)
