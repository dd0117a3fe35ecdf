"""Maps for tests: MBTiles and PMTiles of pictures made here."""

from __future__ import annotations

import gzip
import json
import sqlite3
import struct
import zlib
from pathlib import Path

from strapdown.formats.map_tiles import tile_number

Tiles = dict[tuple[int, int, int], bytes]


def png(side: int = 256, grey: int = 200, height: int | None = None) -> bytes:
    """A picture of one grey."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        whole = kind + data
        return struct.pack(">I", len(data)) + whole + struct.pack(">I", zlib.crc32(whole))

    rows = side if height is None else height
    head = struct.pack(">IIBBBBB", side, rows, 8, 0, 0, 0, 0)
    pixels = zlib.compress((b"\0" + bytes([grey]) * side) * rows, 9)
    return (
        b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", pixels) + chunk(b"IEND", b"")
    )


def mbtiles(path: Path, tiles: Tiles, **metadata: str) -> Path:
    """Write MBTiles; tiles by zoom, column, row from the north."""
    connection = sqlite3.connect(path)
    connection.execute("CREATE TABLE metadata (name TEXT, value TEXT)")
    connection.execute(
        "CREATE TABLE tiles (zoom_level INTEGER, tile_column INTEGER, tile_row INTEGER, "
        "tile_data BLOB)"
    )
    connection.execute("CREATE INDEX place ON tiles (zoom_level, tile_column, tile_row)")
    connection.executemany("INSERT INTO metadata VALUES (?, ?)", metadata.items())
    connection.executemany(
        "INSERT INTO tiles VALUES (?, ?, ?, ?)",
        [(z, x, (1 << z) - 1 - y, data) for (z, x, y), data in tiles.items()],
    )
    connection.commit()
    connection.close()
    return path


def varint(value: int) -> bytes:
    out = b""
    while value > 127:
        out += bytes([value & 127 | 128])
        value >>= 7
    return out + bytes([value])


def directory(entries: list[tuple[int, int, int, int]]) -> bytes:
    """Serialize (number, offset, length, repeats), in order."""
    out = varint(len(entries))
    last = 0
    for number, *_ in entries:
        out += varint(number - last)
        last = number
    out += b"".join(varint(e[3]) for e in entries) + b"".join(varint(e[2]) for e in entries)
    after = -1
    for _, offset, length, _ in entries:
        out += varint(0 if offset == after else offset + 1)
        after = offset + length
    return out


def archive(
    root: bytes,
    leaves: bytes = b"",
    data: bytes = b"",
    about: bytes = b"{}",
    *,
    kind: int = 2,
    inner: int = 2,
    outer: int = 1,
    version: int = 3,
) -> bytes:
    """Join the sections of a PMTiles archive; the metadata are packed here."""
    about = gzip.compress(about, mtime=0) if inner == 2 else about
    offsets, at = [], 127
    for part in (root, about, leaves, data):
        offsets += [at, len(part)]
        at += len(part)
    head = struct.pack(
        "<7sB11QBBBBBB4iB2i",
        *(b"PMTiles", version, *offsets, 0, 0, 0, 1, inner, outer, kind, 0, 24),
        *(0, 0, 0, 0, 0, 0, 0),
    )
    return head + root + about + leaves + data


def pmtiles(path: Path, tiles: Tiles, *, leaf: int = 0, **metadata: str) -> Path:
    """Write PMTiles; with so many entries a leaf directory, or all in the root."""
    entries, data = [], b""
    for at in sorted(tiles, key=lambda k: tile_number(*k)):
        entries.append((tile_number(*at), len(data), len(tiles[at]), 1))
        data += tiles[at]
    leaves = b""
    if leaf:
        parts = [entries[k : k + leaf] for k in range(0, len(entries), leaf)]
        entries = []
        for part in parts:
            packed = gzip.compress(directory(part), mtime=0)
            entries.append((part[0][0], len(leaves), len(packed), 0))
            leaves += packed
    about = json.dumps(metadata).encode()
    path.write_bytes(archive(gzip.compress(directory(entries), mtime=0), leaves, data, about))
    return path
