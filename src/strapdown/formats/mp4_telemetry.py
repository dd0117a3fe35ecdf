"""The ``gpmd`` track of an MP4: its payloads and their stamps, without the pictures.

Boxes of ISO/IEC 14496-12: the size and four letters; ``moov`` has a ``trak`` for each track, its
``stbl`` the sizes (``stsz``), places (``stsc`` with ``stco`` or ``co64``) and durations (``stts``)
of its samples, in ticks of ``mdhd``.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["telemetry_of"]

Array = NDArray[np.float64]


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
    """Return sizes, places and durations of the samples of a track."""
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
