"""Logs of recorders: PX4 by pyulog, u-blox by pyubx2, MAVLink by pymavlink, FIT, GPX and KML."""

from __future__ import annotations

import io
import struct
import zipfile
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import redirect_stdout
from datetime import UTC
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from strapdown.errors import DataError
from strapdown.parsers.limits import damage, library


def damaged(path: Path) -> Any:
    """Report whatever a library raises as damage of a log."""
    return damage("io.log-damaged", path)


def ulog(path: Path, wanted: Sequence[str], parameter: str) -> dict[str, Any]:
    """Read topics of PX4: ``topics`` of name, instance and fields, and what was lost.

    `parameter`: of the autopilot, whose value is returned, None if it has none.
    """
    reader = library("pyulog", path)
    # The library prints what it finds damaged.
    with damaged(path), path.open("rb") as file, redirect_stdout(io.StringIO()):
        log = reader.ULog(file, list(wanted))
    return {
        "topics": [[d.name, d.multi_id, dict(d.data)] for d in log.data_list],
        "corrupt": bool(log.file_corruption),
        "dropouts": [float(d.duration) for d in log.dropouts],
        "parameter": log.initial_parameters.get(parameter),
    }


# u-blox: frames are found, and their checksums tested, here; pyubx2 takes them apart.

UBX_SYNC, MOST_PAYLOAD = b"\xb5\x62", 8192


def ubx(path: Path, kind: str) -> list[dict[str, Any]]:
    """Return the fields of each message of a kind: class and number, in hexadecimal."""
    reader, wanted = library("pyubx2", path), bytes.fromhex(kind)
    with damaged(path):
        frames = [f for f in ubx_frames(path.read_bytes()) if f[2:4] == wanted]
        parsed = [reader.UBXReader.parse(frame) for frame in frames]
    return [{k: v for k, v in vars(m).items() if not k.startswith("_")} for m in parsed]


def ubx_frames(data: bytes) -> Iterator[bytes]:
    """Yield whole frames with a right checksum."""
    k = 0
    while (k := data.find(UBX_SYNC, k)) >= 0 and k + 8 <= len(data):
        end = k + 8 + struct.unpack_from("<H", data, k + 4)[0]
        body = data[k + 2 : end - 2]
        if end > len(data) or len(body) > MOST_PAYLOAD or _sum(body) != data[end - 2 : end]:
            k += 2
            continue
        yield data[k:end]
        k = end


def _sum(body: bytes) -> bytes:
    """Fletcher's checksum of 8 bits."""
    octets = np.frombuffer(body, dtype=np.uint8).astype(np.int64)
    first = np.cumsum(octets)
    return bytes([int(first[-1]) & 255, int(first.sum()) & 255])


# MAVLink.

#: 2000 to 2045 in µs since 1970; a clock since a start never counts so far.
FIRST, LAST = 946_684_800_000_000, 2_366_841_600_000_000
HEAD = 8  # bytes of a stamp


def mavlink_frames(data: bytes, most: int | None = None) -> Iterator[tuple[int, bytes]]:
    """Yield number and bytes of each frame; what is between records is passed over."""
    k, count = 0, 0
    while k + HEAD + 8 <= len(data) and (most is None or count < most):
        stamp, marker = struct.unpack_from(">QB", data, k)
        size = 0
        if FIRST < stamp < LAST and marker in (0xFD, 0xFE):
            length = data[k + HEAD + 1]
            signed = 13 if marker == 0xFD and data[k + HEAD + 2] & 1 else 0
            size = length + signed + (12 if marker == 0xFD else 8)
        if not size or k + HEAD + size > len(data):
            if most is not None:  # a file of this kind begins with a record
                return
            k += 1
            continue
        frame = data[k + HEAD : k + HEAD + size]
        number = int.from_bytes(frame[7:10], "little") if marker == 0xFD else frame[5]
        yield number, frame
        k, count = k + HEAD + size, count + 1


def mavlink(path: Path, wanted: Sequence[Any]) -> dict[str, Any]:
    """Read the ``fields`` of messages of the system that sends most, by their names.

    `wanted`: pairs of number and name. Also ``system``, the ``others``, and frames ``lost``.
    """
    dialect = library("pymavlink.dialects.v20.ardupilotmega", path, "mavlink")
    names = {int(number): str(name) for number, name in wanted}
    parser, held, lost = dialect.MAVLink(None), [], 0
    with damaged(path):
        for number, frame in mavlink_frames(path.read_bytes()):
            if number in names:
                try:
                    held.append(parser.decode(bytearray(frame)))
                except dialect.MAVError:
                    lost += 1
        systems = Counter(m.get_srcSystem() for m in held)
        vehicle = systems.most_common(1)[0][0] if systems else 0
        held = [m for m in held if m.get_srcSystem() == vehicle]
        fields: dict[str, dict[str, Any]] = {}
        for name in names.values():
            rows = [m for m in held if m.get_type() == name]
            # Several units of a vehicle send the same message; the first that is there counts.
            rows = [m for m in rows if m.get_srcComponent() == rows[0].get_srcComponent()]
            if rows:
                fields[name] = {
                    n: np.array([getattr(m, n) for m in rows]) for n in rows[0].fieldnames
                }
    others = sorted(set(systems) - {vehicle})
    return {"fields": fields, "system": vehicle, "others": others, "lost": lost}


# Garmin FIT and GPX.


def fit(path: Path, wanted: Sequence[str]) -> dict[str, list[dict[str, Any]]]:
    """Return the messages of the wanted kinds, each with its number in the file as ``#``."""
    fitdecode = library("fitdecode", path)
    found: dict[str, list[dict[str, Any]]] = {}
    count = 0
    try:
        with fitdecode.FitReader(path.read_bytes()) as reader:
            for frame in reader:
                if frame.frame_type == fitdecode.FIT_FRAME_DATA:
                    count += 1
                    if frame.name in wanted:
                        fields = {str(f.name): f.value for f in frame.fields}
                        found.setdefault(frame.name, []).append(fields | {"#": count})
    except MemoryError:
        raise
    except Exception as error:  # a damaged file can break the decoder anywhere
        raise DataError(
            "io.fit-unreadable",
            file=path.name,
            count=count,
            error=str(error) or type(error).__name__,
        ) from None
    return found


def gpx(path: Path) -> dict[str, list[Any]]:
    """Return the points of all tracks, by field; ``time`` in s since 1970, None if not stated."""
    gpxpy = library("gpxpy", path)
    with damage("io.track-unreadable", path, title="GPX"):
        tracks = gpxpy.parse(path.read_bytes()).tracks
        points = [p for track in tracks for part in track.segments for p in part.points]
        times = [
            p.time.replace(tzinfo=p.time.tzinfo or UTC).timestamp() if p.time else None
            for p in points
        ]
        names = ("latitude", "longitude", "elevation", "geoid_height", "speed", "course")
        fields: dict[str, list[Any]] = {n: [getattr(p, n) for p in points] for n in names}
        for name in ("speed", "course"):
            if all(value is None for value in fields[name]):
                fields[name] = [_of_extension(p, name) for p in points]
        return fields | {"time": times, "fix": [p.type_of_gpx_fix for p in points]}


def kml(path: Path) -> dict[str, list[Any]]:
    """Return the points of tracks of a KML or KMZ file, by field.

    ``time``: text, None if a point has none. ``place``: longitude, latitude, and height if stated.
    ``mode``: of its altitude. The elements of OGC KML 2.3: ``Track`` with ``when`` and ``coord``,
    and a ``Placemark`` of a ``TimeStamp`` and a ``Point``.
    """
    with damage("io.track-unreadable", path, title="KML"):
        data = path.read_bytes()
        if data[:2] == b"PK":
            with zipfile.ZipFile(path) as archive:
                name = next(n for n in archive.namelist() if n.lower().endswith(".kml"))
                data = archive.read(name)
        out: dict[str, list[Any]] = {"time": [], "place": [], "mode": []}
        for one in ElementTree.fromstring(data).iter():
            kind = _tag(one)
            if kind not in ("Track", "Placemark"):
                continue
            inner = list(one) if kind == "Track" else list(one.iter())
            if kind == "Placemark" and any(_tag(part) in ("Track", "LineString") for part in inner):
                continue
            texts = {
                tag: [str(part.text or "").strip() for part in inner if _tag(part) == tag]
                for tag in ("when", "coord", "coordinates", "altitudeMode")
            }
            places = [
                [float(v) for v in text.replace(",", " ").split()]
                for text in texts["coord"] + texts["coordinates"]
            ]
            places = [p for p in places if len(p) in (2, 3)]
            if kind == "Placemark" and len(places) != 1:
                continue
            mode = next(iter(texts["altitudeMode"]), "clampToGround")
            out["time"] += [*texts["when"], *[None] * len(places)][: len(places)]
            out["place"] += places
            out["mode"] += [mode] * len(places)
        return out


def tcx(path: Path) -> dict[str, list[Any]]:
    """Return the points with a position of all laps of a TCX file, by field; as `kml`.

    The elements of Garmin's TrainingCenterDatabase v2: ``Trackpoint`` with ``Time``, ``Position``
    and ``AltitudeMeters``. A lap begins with the last point of the one before it, which counts
    once. ``Courses`` are planned: their times are of nobody.
    """
    with damage("io.track-unreadable", path, title="TCX"):
        out: dict[str, list[Any]] = {"time": [], "place": []}
        before: Any = None
        parts = [p for p in ElementTree.fromstring(path.read_bytes()) if _tag(p) != "Courses"]
        for point in (one for part in parts for one in part.iter()):
            if _tag(point) != "Trackpoint":
                continue
            said = {_tag(part): str(part.text or "").strip() for part in point.iter()}
            if not {"LatitudeDegrees", "LongitudeDegrees"} <= said.keys():
                continue
            names = ("LongitudeDegrees", "LatitudeDegrees", "AltitudeMeters")
            place = [float(said.get(name) or "nan") for name in names]
            this = (said.get("Time") or None, *place[:2])
            if this != before:
                out["time"].append(this[0])
                out["place"].append(place)
            before = this
        return out


def _tag(one: Any) -> str:
    return str(one.tag).rpartition("}")[2]


def _of_extension(point: Any, name: str) -> float | None:
    """Number of a point in Garmin's extension of GPX 1.1, of any version."""
    for extension in point.extensions:
        for one in extension.iter():
            space, _, tag = str(one.tag).rpartition("}")
            if tag == name and "TrackPointExtension" in space:
                return float(one.text or "nan")
    return None
