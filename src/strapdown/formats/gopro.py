"""GoPro telemetry: GPMF as a raw payload or as the ``gpmd`` track of an MP4, and as JSON.

GPMF (https://github.com/gopro/gpmf-parser, README): key, type, size and count in eight bytes, then
big-endian values padded to four bytes; type 0 nests. ``DEVC`` is a payload of about a second with a
``STRM`` for each sensor; ``SCAL`` divides what follows it. ``GYRO`` (rad/s) and ``ACCL`` (m/s²,
specific force) name the axis of each channel in ``ORIN``, small letters reversed (``YxZ``: y, -x,
z), older cameras in the name of the stream (``Accelerometer (z,x,y)``; up/down, right/left and
forward/back are z, x, y). ``GPS5`` has latitude,
longitude, height, speed over ground and in space, ``GPS9`` also days since 2000, seconds of the
day, dilution and kind of fix; the height is over the sea if ``GPSA`` says MSLV, else over the
ellipsoid of WGS 84. ``STMP`` counts µs at the first sample of a payload; without it the stamps of
the MP4 count, or the UTC of ``GPSU``. Samples are even between. Where the camera's axes point is
not stated. JSON: ``streams`` of gopro-telemetry (https://github.com/JuanIrache/gopro-telemetry),
with ``cts`` in ms from the start of the video.
"""

from __future__ import annotations

import calendar
import re
import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import DataError
from strapdown.formats.clocks import RELATIVE, UNIX
from strapdown.formats.join import join
from strapdown.formats.known_formats import from_json, lacking
from strapdown.formats.recording import RawLog
from strapdown.formats.signs import Signs, first_bytes, head, json_beginning
from strapdown.formats.vocabularies import CAMERA
from strapdown.tables.checks import Array
from strapdown.units import unit_of

TITLE = "GoPro telemetry"
TYPES = {
    "b": "i1",
    "B": "u1",
    "d": ">f8",
    "f": ">f4",
    "j": ">i8",
    "J": ">u8",
    "l": ">i4",
    "L": ">u4",
    "s": ">i2",
    "S": ">u2",
}
SENSORS = {"GYRO": "gyro", "ACCL": "accel", "MAGN": "mag"}
DAYS_2000 = 946_684_800.0  # 2000-01-01 in seconds since 1970
_BRACKETS = re.compile(r"\(\s*([xyz])\s*,\s*([xyz])\s*,\s*([xyz])\s*\)", re.I)


@dataclass
class Stream:
    """Samples of one sensor, and its number of samples and stamp at the start of each payload."""

    values: list[Array] = field(default_factory=list)
    counts: list[int] = field(default_factory=list)
    stamps: dict[int, float] = field(default_factory=dict)
    payloads: list[int] = field(default_factory=list)
    said: dict[str, Any] = field(default_factory=dict)
    fixed: list[Array] = field(default_factory=list)
    time: Array | None = None


def _has_telemetry(path: Path) -> bool:
    """Whether a video has a ``gpmd`` track, or a JSON the streams."""
    first = first_bytes(path, 8)
    if first[:4] == b"DEVC" or first[4:] == b"ftyp":
        return first[:4] == b"DEVC" or telemetry_of(path) is not None
    text = head(path, 4096) if path.suffix.lower() == ".json" else ""
    devices, _ = json_beginning(text.lstrip())
    return isinstance(devices, dict) and any(
        isinstance(device, dict) and "streams" in device for device in devices.values()
    )


# Text in UTF-16 too.
detect = Signs(
    first=rb"\A(?:DEVC|.{4}ftyp|(?:\xef\xbb\xbf)?\s*\{|\xff\xfe|\xfe\xff)", also=_has_telemetry
)


def read(path: Path) -> RawLog:
    """Read the gyro, with the accelerometer interpolated to its stamps."""
    streams, clock = _streams(path)
    if "GYRO" not in streams:
        if "ACCL" in streams and len(_held(streams)) == 0:
            raise DataError(
                "io.no-gyroscope-read-here-holds",
                file=path.name,
                quantity="gyro",
                sensors="the accelerometer",
            )
        raise lacking(path, "imu", TITLE, _held(streams))
    logs = [_sensor(path, key, streams[key]) for key in SENSORS if key in streams]
    raw = join(logs, path.name, (path,))
    raw.clock = clock
    return raw


def read_fixes(path: Path) -> RawLog:
    """Read the positions; those without a fix have quality 0."""
    streams, clock = _streams(path)
    key = next((k for k in ("GPS9", "GPS5") if k in streams), None)
    if key is None:
        raise lacking(path, "gnss", TITLE, _held(streams))
    one = streams[key]
    values, time = np.concatenate(one.values), one.time
    if values.shape[1] < (9 if key == "GPS9" else 5):
        raise DataError("io.gpmf-damaged", file=path.name, quantity=key, byte=0)
    fixed = values[:, 8] if key == "GPS9" else np.concatenate(one.fixed)
    height = "alt_msl" if one.said.get("GPSA") == "MSLV" else "alt"
    held: dict[str, tuple[NDArray[Any], str | None]] = {
        "time": (np.asarray(time), "s"),
        "lat": (values[:, 0], "deg"),
        "lon": (values[:, 1], "deg"),
        height: (values[:, 2], "m"),
        "speed": (values[:, 3], "m/s"),
        "quality": (np.where(fixed >= 2, 1.0, 0.0), None),
    }
    return RawLog.of(path, held, clock=clock)


def _held(streams: dict[str, Stream]) -> list[str]:
    keys = {"imu": {"GYRO"}, "gnss": {"GPS5", "GPS9"}}
    return [stream for stream, wanted in keys.items() if wanted & set(streams)]


def _sensor(path: Path, key: str, one: Stream) -> RawLog:
    """Return one sensor about the axes of the camera."""
    triad, values = SENSORS[key], np.concatenate(one.values)
    name = str(one.said.get("STNM", ""))
    for words, axis in CAMERA.items():
        name = name.replace(words, axis)
    named = _BRACKETS.search(name)
    order = str(one.said.get("ORIN", "")) or ("".join(named.groups()).upper() if named else "")
    if sorted(order.upper()) != ["X", "Y", "Z"] or values.shape[1] != 3:
        raise DataError("io.gopro-order-of-axes", file=path.name, quantity=triad, order=order)
    unit = unit_of(str(one.said.get("SIUN", "")).replace("²", "2").replace("µ", "u"))
    held: dict[str, tuple[NDArray[Any], str | None]] = {"time": (np.asarray(one.time), "s")}
    for axis in "xyz":
        k = order.upper().index(axis.upper())
        sign = -1.0 if order[k].islower() else 1.0
        held[f"{triad}_{axis}"] = (sign * values[:, k], unit)
    log = RawLog.of(path, held)
    log.name = f"{path.name}/{key}"
    return log


def _streams(path: Path) -> tuple[dict[str, Stream], str]:
    """Return the sensors with stamps in s, and their clock."""
    with path.open("rb") as stream:
        first = stream.read(4)
    if first.strip()[:1] == b"{":
        return _from_json(path), RELATIVE
    starts = None
    if first == b"DEVC":
        payloads = [path.read_bytes()]
    else:
        payloads, starts = telemetry_of(path) or ([], None)
    streams: dict[str, Stream] = {}
    count = 0
    for data in payloads:
        for key, _, block in _items(data, path):
            if key == "DEVC":
                _payload(block, count, streams, path)
                count += 1
    own = next((s for k in ("GYRO", "ACCL") if (s := streams.get(k)) and s.stamps), None)
    clock = RELATIVE
    if own is not None and len(own.stamps) > 1:
        at, when = np.array(list(own.stamps)), np.array(list(own.stamps.values())) * 1e-6
    elif starts is not None and len(starts) == count + 1:
        at, when = np.arange(count + 1), starts
    else:
        gps = next((s for k in ("GPS9", "GPS5") if (s := streams.get(k)) and s.stamps), None)
        if gps is None or len(gps.stamps) < 2:
            raise DataError("io.gpmf-without-stamps", file=path.name, quantity="time", count=count)
        at, when = np.array(list(gps.stamps)), np.array(list(gps.stamps.values()))
        # The delay of a fix varies; the payloads follow a crystal.
        when, clock = (
            np.polyval(np.polyfit(at - at[0], when - when[0], 1), at - at[0]) + when[0],
            UNIX,
        )
    for one in streams.values():
        one.time = _times(one, at, when)
    return streams, clock


def _times(one: Stream, at: NDArray[Any], when: Array) -> Array:
    """Return stamps of samples: even in each payload; some payloads state their start."""
    step = (when[-1] - when[0]) / (at[-1] - at[0])
    ends = np.array([*one.payloads, one.payloads[-1] + 1], dtype=np.float64)
    starts = np.interp(ends, at, when)
    starts += step * (np.minimum(ends - at[0], 0.0) + np.maximum(ends - at[-1], 0.0))
    first = np.array([*one.counts, one.counts[-1] + len(one.values[-1])], dtype=np.float64)
    return np.asarray(np.interp(np.arange(first[0], first[-1]), first, starts))


def _payload(data: bytes, count: int, streams: dict[str, Stream], path: Path) -> None:
    for key, _, block in _items(data, path):
        if key != "STRM":
            continue
        said: dict[str, Any] = {}
        for name, kind, content in _items(block, path):
            if name in ("GYRO", "ACCL", "MAGN", "GPS5", "GPS9"):
                one = streams.setdefault(name, Stream())
                values = _scaled(kind, content, said, path)
                if len(values):
                    one.counts.append(sum(len(v) for v in one.values))
                    one.payloads.append(count)
                    one.values.append(values)
                    one.fixed.append(np.full(len(values), float(said.get("GPSF", 3))))
                    one.said |= said
                    stamp = said.get("STMP", said.get("GPSU") if said.get("GPSF", 0) >= 2 else None)
                    if (
                        name == "GPS9"
                        and stamp is None
                        and values.shape[1] > 8
                        and values[0, 8] >= 2
                    ):
                        stamp = DAYS_2000 + 86400.0 * values[0, 5] + values[0, 6]
                    if stamp is not None and (name[:3] != "GPS" or "STMP" not in said):
                        one.stamps[count] = float(stamp)
            elif kind[0] in ("c", "U", "F"):
                text = content.rstrip(b"\0").decode("latin-1")
                said[name] = _utc(text) if name == "GPSU" else text
            elif kind[0] in TYPES:
                layout = np.dtype(TYPES[kind[0]])
                whole = len(content) // layout.itemsize * layout.itemsize
                raw = np.frombuffer(content[:whole], layout)
                said[name] = raw.astype(np.float64) if name == "SCAL" else raw[0] if raw.size else 0


def _utc(text: str) -> float | None:
    """Convert ``yymmddhhmmss.sss`` to seconds since 1970."""
    if not re.fullmatch(r"\d{12}\.\d{3}", text.strip()):
        return None
    part = [int(text[k : k + 2]) for k in range(0, 12, 2)]
    return calendar.timegm((2000 + part[0], *part[1:])) + float(text[12:16])


def _scaled(kind: tuple[str, int, int], content: bytes, said: dict[str, Any], path: Path) -> Array:
    letter, size, repeat = kind
    letters = (
        str(said.get("TYPE", ""))
        if letter == "?"
        else letter * (size // max(np.dtype(TYPES.get(letter, "u1")).itemsize, 1))
    )
    if not letters or any(c not in TYPES for c in letters):
        raise DataError("io.gpmf-damaged", file=path.name, quantity="TYPE", byte=0)
    layout = np.dtype([(f"{k}", TYPES[c]) for k, c in enumerate(letters)])
    if layout.itemsize != size or len(content) < size * repeat:
        raise DataError("io.gpmf-damaged", file=path.name, quantity=letters, byte=0)
    table = np.frombuffer(content[: size * repeat], layout)
    values = np.column_stack([table[n].astype(np.float64) for n in layout.names or ()])
    scale = np.atleast_1d(said.get("SCAL", 1.0))
    if scale.size not in (1, values.shape[1]) or not scale.all():
        raise DataError("io.gpmf-damaged", file=path.name, quantity="SCAL", byte=0)
    return np.asarray(values / scale)


def _items(data: bytes, path: Path) -> Iterator[tuple[str, tuple[str, int, int], bytes]]:
    """Yield key, (type, size, count) and content of each item of a block."""
    at = 0
    while at + 8 <= len(data):
        key, letter, size, repeat = struct.unpack_from(">4scBH", data, at)
        length = size * repeat
        if at + 8 + length > len(data):
            raise DataError(
                "io.gpmf-damaged", file=path.name, quantity=key.decode("latin-1"), byte=at
            )
        if key != b"\0\0\0\0":
            yield (
                key.decode("latin-1"),
                (letter.decode("latin-1"), size, repeat),
                data[at + 8 : at + 8 + length],
            )
        at += 8 + (length + 3) // 4 * 4


def _from_json(path: Path) -> dict[str, Stream]:
    """Return the streams of the device that has most."""
    content = from_json(path)
    devices = [
        d for d in content.values() if isinstance(d, dict) and isinstance(d.get("streams"), dict)
    ]
    found: dict[str, Any] = max((d["streams"] for d in devices), key=len, default={})
    streams = {}
    for key in ("GYRO", "ACCL", "MAGN", "GPS5", "GPS9"):
        samples = found[key].get("samples") if isinstance(found.get(key), dict) else None
        if not samples:
            continue
        one = streams[key] = Stream(
            said={"STNM": found[key].get("name"), "SIUN": found[key].get("units")}
        )
        try:
            one.values = [np.array([s["value"] for s in samples], dtype=np.float64)]
            one.time = np.array([s["cts"] for s in samples], dtype=np.float64) * 1e-3
            fixed = [s.get("sticky", {}).get("fix", np.nan) for s in samples]
            systems = {
                s["sticky"]["altitude system"]
                for s in samples
                if "altitude system" in s.get("sticky", {})
            }
        except (KeyError, TypeError, ValueError, AttributeError, OverflowError):
            raise DataError("io.gopro-json-damaged", file=path.name, quantity=key) from None
        if one.values[0].ndim != 2:
            raise DataError("io.gopro-json-damaged", file=path.name, quantity=key)
        if systems:
            one.said["GPSA"] = systems.pop()
        # A sticky value holds until the next.
        known = np.where(np.isnan(fixed), 0, np.arange(len(fixed)))
        held = np.array(fixed)[np.maximum.accumulate(known)]
        one.fixed = [np.where(np.isnan(held), 3.0, held)]
    return streams


# The ``gpmd`` track of an MP4: its payloads and their stamps, without the pictures. Boxes of
# ISO/IEC 14496-12: the size and four letters; ``moov`` has a ``trak`` for each track, its ``stbl``
# the sizes (``stsz``), places (``stsc`` with ``stco`` or ``co64``) and durations (``stts``) of its
# samples, in ticks of ``mdhd``.


def telemetry_of(path: Path) -> tuple[list[bytes], Array] | None:
    """Return the payloads of the ``gpmd`` track and their starts and end in s; None without one."""
    try:
        with path.open("rb") as stream:
            moov = _box(stream, path.stat().st_size, b"moov")
            for trak in _boxes(moov, b"trak"):
                mdia = next(_boxes(trak, b"mdia"))
                table = next(_boxes(next(_boxes(mdia, b"minf")), b"stbl"))
                if next(_boxes(table, b"stsd"))[12:16] != b"gpmd":
                    continue
                mdhd = next(_boxes(mdia, b"mdhd"))
                ticks = struct.unpack_from(">I", mdhd, 20 if mdhd[0] else 12)[0]
                sizes, places, steps = _samples(table)
                data = []
                for size, place in zip(sizes, places, strict=True):
                    stream.seek(place)
                    data.append(stream.read(size))
                return data, np.concatenate([[0.0], np.cumsum(steps)]) / ticks
    except (
        OSError,
        struct.error,
        StopIteration,
        ValueError,
        IndexError,
        ZeroDivisionError,
        RuntimeError,
    ):
        return None
    return None


def _samples(table: bytes) -> tuple[list[int], list[int], Array]:
    """Return sizes, offsets and durations of the samples of a track."""
    stsz, stsc, stts = (next(_boxes(table, k)) for k in (b"stsz", b"stsc", b"stts"))
    size, count = struct.unpack_from(">II", stsz, 4)
    sizes = [size] * count if size else list(struct.unpack_from(f">{count}I", stsz, 12))
    wide = next(_boxes(table, b"co64"), None)
    chunks = wide if wide is not None else next(_boxes(table, b"stco"))
    number = struct.unpack_from(">I", chunks, 4)[0]
    offsets = struct.unpack_from(f">{number}{'Q' if wide is not None else 'I'}", chunks, 8)
    runs = [
        struct.unpack_from(">III", stsc, 8 + 12 * k)
        for k in range(struct.unpack_from(">I", stsc, 4)[0])
    ]
    places: list[int] = []
    for chunk, offset in enumerate(offsets, 1):
        per = [r[1] for r in runs if r[0] <= chunk][-1]
        for _ in range(per):
            if len(places) < count:
                places.append(offset)
                offset += sizes[len(places) - 1]
    pairs = [
        struct.unpack_from(">II", stts, 8 + 8 * k)
        for k in range(struct.unpack_from(">I", stts, 4)[0])
    ]
    return sizes, places, np.repeat([p[1] for p in pairs], [p[0] for p in pairs]).astype(np.float64)


def _boxes(data: bytes, kind: bytes) -> Iterator[bytes]:
    at = 0
    while at + 8 <= len(data):
        size, name = struct.unpack_from(">I4s", data, at)
        start = 8
        if size == 1:
            size, start = struct.unpack_from(">Q", data, at + 8)[0], 16
        if size < start:
            return
        if name == kind:
            yield data[at + start : at + size]
        at += size


def _box(stream: Any, end: int, kind: bytes) -> bytes:
    """Return the content of a box of the file, without reading the pictures before it."""
    at = 0
    while at + 8 <= end:
        stream.seek(at)
        size, name = struct.unpack(">I4s", stream.read(8))
        start = 8
        if size == 1:
            size, start = struct.unpack(">Q", stream.read(8))[0], 16
        size = size or end - at
        if size < start:
            break
        if name == kind:
            stream.seek(at + start)
            return bytes(stream.read(size - start))
        at += size
    raise ValueError(kind)
