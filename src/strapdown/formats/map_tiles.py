"""Raster tiles of local map files: MBTiles, PMTiles version 3, and a folder of the tiles used.

Nothing is fetched: a file of the user's is read, which may be hostile. Every length is checked
against the file and a limit before it is read, so that time and memory are bounded.

MBTiles 1.3 (https://github.com/mapbox/mbtiles-spec) is a SQLite database with rows counted from the
south. PMTiles 3 (https://github.com/protomaps/PMTiles) has a header of 127 bytes and directories of
varints, by the number of a tile on a Hilbert curve. Tiles are square pictures in Web Mercator.
"""

from __future__ import annotations

import html
import json
import math
import re
import sqlite3
import struct
import zlib
from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, BinaryIO, Protocol
from urllib.parse import quote

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import DataError, printable

#: Largest tile, bytes; least and largest side, pixels.
LARGEST_TILE, SIDES = 1 << 20, (64, 1024)
#: Characters of a name or an attribution that are shown.
LONGEST = 200
_METADATA = 1 << 20  # bytes
# Bytes of a directory, and of all that are read: each may take 20 in memory. How deep they lie.
_DIRECTORY, _DIRECTORIES, _DEEP = 4 << 20, 16 << 20, 4
_DATABASE, _PMTILES = b"SQLite format 3\0", b"PMTiles"
_HEADER = struct.Struct("<7sB 11Q B BBB BB 4i B 2i")
_NONE, _GZIP, _VECTOR = 1, 2, 1
# Steps of SQLite's machine for one query: a look-up by an index takes a few hundred.
_STEPS = 2_000_000
_PARTS = {"png": "png", "jpeg": "jpg", "webp": "webp"}
LIST = "tiles.json"


@dataclass(frozen=True)
class Tile:
    """A picture of a map.

    `zoom`, `column`, `row`: row from the north. `media` ({'png', 'jpeg', 'webp'}). `side`: pixels.
    """

    zoom: int
    column: int
    row: int
    data: bytes
    media: str
    side: int


class _Archive(Protocol):
    """Content of each format."""

    def metadata(self) -> dict[str, Any]:
        """Names and texts; any values."""

    def tile(self, zoom: int, column: int, row: int) -> bytes | None:
        """Bytes of a tile, its row from the north; None if there is none."""


@dataclass(frozen=True)
class MapFile:
    """An open map.

    `name`, `attribution`: plain text in one line, as the file states it; empty if it states none.
    `zooms` ((int, int)): least and largest zoom, as the file states them.
    """

    path: Path
    archive: _Archive
    name: str
    attribution: str
    zooms: tuple[int, int] = (0, 24)

    def tile(self, zoom: int, column: int, row: int) -> Tile | None:
        """Return a tile; None if there is none.

        `zoom`, `column`, `row`: row from the north. DataError: the file is damaged, or the tile is
        not a PNG, JPEG or WebP within the limits.
        """
        with _damage(self.path):
            data = self.archive.tile(zoom, column, row)
        if data is None:
            return None
        at = {"zoom": zoom, "column": column, "row": row}
        if len(data) > LARGEST_TILE:
            raise DataError("io.map-tile-too-large", file=self.path.name, most=LARGEST_TILE, **at)
        found = _picture(data)
        if found is None:
            raise DataError("io.map-tile-no-picture", file=self.path.name, **at)
        media, width, height = found
        if width != height or not SIDES[0] <= width <= SIDES[1]:
            raise DataError(
                "io.map-tile-size",
                file=self.path.name,
                width=width,
                height=height,
                least=SIDES[0],
                most=SIDES[1],
                **at,
            )
        return Tile(zoom, column, row, data, media, width)


@contextmanager
def open_map(path: str | Path) -> Iterator[MapFile]:
    """Open a map by its content.

    `path`: MBTiles, PMTiles, or a folder that `write_tiles` wrote. DataError: the file is missing,
    damaged, of another kind, or has vector tiles.
    """
    path = Path(path)
    with ExitStack() as kept:
        with _damage(path):
            archive = _opened(path, kept)
            said = archive.metadata()
        name = _plain(said.get("name")) or _plain(path.stem)
        least, most = _zoom(said.get("minzoom"), 0), _zoom(said.get("maxzoom"), _LARGEST_ZOOM)
        zooms = (min(least, most), max(least, most))
        yield MapFile(path, archive, name, _plain(said.get("attribution")), zooms)


def _opened(path: Path, kept: ExitStack) -> _Archive:
    if path.is_dir() and (path / LIST).is_file():
        return TileFolder(path)
    stream = kept.enter_context(path.open("rb"))
    head = stream.read(len(_DATABASE))
    if head.startswith(_PMTILES):
        return _Pmtiles(stream, path.name)
    if head == _DATABASE:
        return _Mbtiles(kept.enter_context(closing(_connected(path))), path.name)
    raise DataError("io.map-unknown", file=path.name)


def _plain(value: Any) -> str:
    """Text of a hostile file in one line: without tags, marks of direction and controls."""
    if not isinstance(value, str):
        return ""
    text = html.unescape(re.sub(r"<[^<>]*>", "", value[: 20 * LONGEST]))
    return printable(" ".join(text.split()))[:LONGEST]


def _zoom(value: Any, usual: int) -> int:
    """Zoom that a file states, as a number or as text; the usual one if it states none."""
    try:
        found = int(str(value)[:4])
    except ValueError:
        return usual
    return min(max(found, 0), _LARGEST_ZOOM)


@contextmanager
def _damage(path: Path) -> Iterator[None]:
    """Say of a damaged file what is wrong, once."""
    try:
        yield
    except DataError:
        raise
    except OSError as error:
        raise DataError(
            "io.map-unreadable", file=path.name, reason=error.strerror or str(error)
        ) from None
    except (ValueError, KeyError, TypeError, OverflowError, RecursionError) as error:
        raise DataError("io.map-damaged", file=path.name, reason=_reason(error)) from None
    except (sqlite3.Error, struct.error, zlib.error) as error:
        raise DataError("io.map-damaged", file=path.name, reason=_reason(error)) from None


def _reason(error: Exception) -> str:
    return printable(str(error))[:LONGEST] or type(error).__name__


# Pictures by their signatures: media type, width and height.


def _picture(data: bytes) -> tuple[str, int, int] | None:
    """Kind and size of a still PNG, JPEG or WebP; None for anything else."""
    if data[:8] == b"\x89PNG\r\n\x1a\n" and data[12:16] == b"IHDR" and len(data) > 33:
        return ("png", *struct.unpack(">II", data[16:24]))
    if data[:3] == b"\xff\xd8\xff":
        size = _jpeg_size(data)
        return None if size is None else ("jpeg", *size)
    if data[:4] == b"RIFF" and data[8:12] == b"WEBP" and len(data) >= 30:
        size = _webp_size(data)
        return None if size is None else ("webp", *size)
    return None


def _jpeg_size(data: bytes) -> tuple[int, int] | None:
    """Size by the first start of frame (ITU T.81, B.2.2)."""
    at = 2
    while at + 9 <= len(data) and data[at] == 0xFF:
        kind = data[at + 1]
        if kind == 0xFF:
            at += 1
            continue
        length = int.from_bytes(data[at + 2 : at + 4], "big")
        if 0xC0 <= kind <= 0xCF and kind not in (0xC4, 0xC8, 0xCC):
            height, width = struct.unpack(">HH", data[at + 5 : at + 9])
            return width, height
        if length < 2:
            return None
        at += 2 + length
    return None


def _webp_size(data: bytes) -> tuple[int, int] | None:
    """Size of the lossy, lossless and extended form (RFC 9649), without animation."""
    kind = data[12:16]
    if kind == b"VP8 " and data[23:26] == b"\x9d\x01\x2a":
        width, height = struct.unpack("<HH", data[26:30])
        return width & 0x3FFF, height & 0x3FFF
    if kind == b"VP8L" and data[20] == 0x2F:
        bits = int.from_bytes(data[21:25], "little")
        return (bits & 0x3FFF) + 1, (bits >> 14 & 0x3FFF) + 1
    if kind == b"VP8X" and not data[20] & 2:
        return int.from_bytes(data[24:27], "little") + 1, int.from_bytes(data[27:30], "little") + 1
    return None


# MBTiles: SQLite, opened without a journal and read alone; its views are the file's own queries.


def _connected(path: Path) -> sqlite3.Connection:
    connection = sqlite3.connect(
        f"file:{quote(str(path.absolute()))}?mode=ro&immutable=1", uri=True
    )
    for pragma in ("trusted_schema=OFF", "query_only=ON", "cell_size_check=ON", "mmap_size=0"):
        connection.execute(f"PRAGMA {pragma}")
    connection.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, 4 * LARGEST_TILE)
    return connection


@dataclass(frozen=True)
class _Mbtiles:
    connection: sqlite3.Connection
    name: str

    def _row(self, query: str, *values: int) -> Any:
        """First row of a query of a bounded number of steps."""
        steps = iter(range(_STEPS // 1000))
        # Stops once the iterator ends.
        self.connection.set_progress_handler(lambda: next(steps, None) is None, 1000)
        return self.connection.execute(query, values).fetchone()

    def metadata(self) -> dict[str, Any]:
        names = ("name", "attribution", "format", "minzoom", "maxzoom")
        if self._row("SELECT 1 FROM sqlite_master WHERE name = 'tiles'") is None:
            raise DataError("io.map-unknown", file=self.name)
        found = {
            name: self._row(f"SELECT value FROM metadata WHERE name = '{name}' LIMIT 1")
            for name in names
        }
        said = {name: row[0] for name, row in found.items() if row is not None}
        if said.get("format") in ("pbf", "mvt"):
            raise DataError("io.map-vector", file=self.name)
        return said

    def tile(self, zoom: int, column: int, row: int) -> bytes | None:
        found = self._row(
            "SELECT tile_data FROM tiles WHERE zoom_level = ? AND tile_column = ? AND tile_row = ? "
            "LIMIT 1",
            *(zoom, column, (1 << zoom) - 1 - row),
        )
        if found is None or found[0] is None:
            return None
        if not isinstance(found[0], bytes):
            raise ValueError("a tile is not a blob")
        return found[0]


# PMTiles.

Numbers = NDArray[np.int64]


@dataclass
class _Pmtiles:
    stream: BinaryIO
    name: str
    read: int = 0
    kept: dict[tuple[int, int], tuple[Numbers, Numbers, Numbers, Numbers]] = field(
        default_factory=dict
    )

    def __post_init__(self) -> None:
        self.stream.seek(0, 2)
        self.size = self.stream.tell()
        fields = _HEADER.unpack(self._bytes(0, _HEADER.size, _HEADER.size))
        if fields[1] != 3:
            raise DataError("io.map-version", file=self.name, version=fields[1])
        self.root, self.about, self.leaves, self.tiles = zip(
            fields[2:10:2], fields[3:10:2], strict=True
        )
        self.inner, self.outer, kind = fields[14:17]
        self.zooms = {"minzoom": fields[17], "maxzoom": fields[18]}
        if kind == _VECTOR:
            raise DataError("io.map-vector", file=self.name)

    def _bytes(self, offset: int, length: int, most: int) -> bytes:
        if length > most or offset + length > self.size:
            raise ValueError(f"{length} bytes at {offset} of {self.size}")
        self.stream.seek(offset)
        return self.stream.read(length)

    def metadata(self) -> dict[str, Any]:
        if not self.about[1]:
            return self.zooms
        said = json.loads(_unpacked(self._bytes(*self.about, _METADATA), self.inner, _METADATA))
        return {**said, **self.zooms} if isinstance(said, dict) else self.zooms

    def tile(self, zoom: int, column: int, row: int) -> bytes | None:
        wanted = tile_number(zoom, column, row)
        place = self.root
        for _ in range(_DEEP):
            numbers, repeats, lengths, offsets = self._directory(*place)
            k = int(np.searchsorted(numbers, wanted, side="right")) - 1
            if k < 0:
                return None
            offset, length = int(offsets[k]), int(lengths[k])
            if repeats[k]:
                if wanted >= numbers[k] + repeats[k]:
                    return None
                if offset + length > self.tiles[1]:
                    raise ValueError("a tile is outside of the archive")
                data = self._bytes(self.tiles[0] + offset, length, LARGEST_TILE)
                return _unpacked(data, self.outer or _NONE, LARGEST_TILE)
            if offset + length > self.leaves[1]:
                raise ValueError("a directory is outside of the archive")
            place = (self.leaves[0] + offset, length)
        raise ValueError(f"directories are more than {_DEEP} deep")

    def _directory(self, offset: int, length: int) -> tuple[Numbers, Numbers, Numbers, Numbers]:
        """Numbers of tiles, how often each is repeated, lengths and offsets."""
        if (offset, length) not in self.kept:
            most = min(_DIRECTORY, _DIRECTORIES - self.read)
            data = _unpacked(self._bytes(offset, length, most), self.inner, most)
            self.read += len(data)
            self.kept[offset, length] = _directory(data)
        return self.kept[offset, length]


def _unpacked(data: bytes, how: int, most: int) -> bytes:
    """Bytes as they are or of gzip, up to a limit."""
    if how == _NONE:
        return data
    if how != _GZIP:
        raise ValueError(f"compression {how} is not read: gzip or none are")
    unpacker = zlib.decompressobj(31)
    found = unpacker.decompress(data, most + 1)
    if len(found) > most or not unpacker.eof:
        raise ValueError("a compressed part is damaged or too large")
    return found


def _directory(data: bytes) -> tuple[Numbers, Numbers, Numbers, Numbers]:
    values = _varints(data)
    count = int(values[0])
    if count < 1 or values.size != 1 + 4 * count:
        raise ValueError(f"a directory of {count} entries has {values.size} numbers")
    steps, repeats, lengths, codes = values[1:].reshape(4, count)
    if float(steps.sum(dtype=np.float64)) >= 2.0**62 or (steps[1:] == 0).any():
        raise ValueError("numbers of tiles do not increase")
    if (lengths == 0).any() or codes[0] == 0 or codes.max() >= 2**62:
        raise ValueError("an entry has no place")
    if float(lengths.sum(dtype=np.float64)) >= 2.0**62:
        raise ValueError("lengths are beyond the file")
    # Offset + 1, or 0 for what follows the entry before.
    stated = np.maximum.accumulate(np.where(codes > 0, np.arange(count), 0))
    ends = np.cumsum(lengths)
    starts = ends - lengths
    return np.cumsum(steps), repeats, lengths, codes[stated] - 1 + starts - starts[stated]


def _varints(data: bytes) -> Numbers:
    """Numbers of 7 bits a byte, the lowest first; each below 2**62."""
    octets = np.frombuffer(data, dtype=np.uint8)
    ends = np.flatnonzero(octets < 128)
    if not ends.size or ends[-1] != octets.size - 1:
        raise ValueError("a directory is cut")
    starts = np.concatenate([[0], ends[:-1] + 1])
    if (ends - starts).max() > 8:
        raise ValueError("a number is too long")
    shifts = 7 * (np.arange(octets.size) - np.repeat(starts, ends - starts + 1))
    parts = (octets & 127).astype(np.int64) << shifts
    found = np.add.reduceat(parts, starts)
    if found.min() < 0 or found.max() >= 2**62:
        raise ValueError("a number is too large")
    return found


def tile_number(zoom: int, column: int, row: int) -> int:
    """Number of a tile: after all of lower zooms, along the Hilbert curve of its own.

    `zoom`, `column`, `row`: row from the north.
    """
    number = ((1 << 2 * zoom) - 1) // 3
    x, y, half = column, row, (1 << zoom) >> 1
    while half:
        right, down = bool(x & half), bool(y & half)
        number += half * half * ((3 * right) ^ down)
        x, y = x & (half - 1), y & (half - 1)
        if not down:
            if right:
                x, y = half - 1 - x, half - 1 - y
            x, y = y, x
        half >>= 1
    return number


# The tiles under a plan.


#: Most tiles, most of their bytes together, and most pixels from west to east; twice as many pixels
#: where a lower zoom would be bent too much.
MOST_TILES, MOST_BYTES, MOST_PIXELS = 30, 800_000, 1300.0
# A tile is placed by an affine fit to the corners of its part on the plan, which is d rad wide. The
# second derivatives of the plane by Mercator's coordinates are sin(latitude) d of that: the inside
# is off by up to sin(latitude) d/4 of it. On a page of so many pixels from west to east that is to
# be below the limit. Half a page from the origin the plane itself adds 60 d² pixels: 0.15 from 128
# tiles round the Earth on.
_PAGE, _LIMIT, _ROUND_EARTH = 870.0, 0.8, 128
#: Latitude up to which Web Mercator has tiles, deg.
NORTHERNMOST = 85.0
_LARGEST_ZOOM = 24  # tiles of two meters


@dataclass(frozen=True)
class ChosenTiles:
    """Tiles of one zoom, each with its column counted on across the date line.

    `count`: how many tiles cover the plan.
    """

    zoom: int
    count: int
    tiles: list[tuple[Tile, int]]


@dataclass(frozen=True)
class MapBox:
    """A part of Web Mercator: ends from west to east and from north to south, as shares.

    `west`, `east`: of the whole Earth; may be below 0 or beyond 1 at the date line. `lat` (deg): of
    the corner nearest to a pole, without a sign.
    """

    west: float
    east: float
    north: float
    south: float
    lat: float


def chosen_tiles(opened: MapFile, box: MapBox) -> ChosenTiles:
    """Choose the largest zoom within the limits at which most of a plan is covered."""
    sine, width = math.sin(math.radians(box.lat)), box.east - box.west
    for most in (MOST_PIXELS, 2.0 * MOST_PIXELS):
        best = ChosenTiles(0, 0, [])
        for zoom in range(_LARGEST_ZOOM, -1, -1):
            n = 1 << zoom
            bent = sine * 0.5 * math.pi * _PAGE / width * min(1.0 / n, width) ** 2
            if n < _ROUND_EARTH or bent > _LIMIT or box.lat > NORTHERNMOST:
                break
            columns = range(math.floor(n * box.west), math.floor(n * box.east) + 1)
            rows = range(math.floor(n * box.north), math.floor(n * box.south) + 1)
            count = len(columns) * len(rows)
            if count > MOST_TILES:
                continue
            found = _tiles(opened, zoom, columns, rows, most / (n * width))
            if found and len(found) / count > len(best.tiles) / max(best.count, 1):
                best = ChosenTiles(zoom, count, found)
            if len(best.tiles) == best.count > 0:
                break
        if best.tiles:
            break
    return best


def _tiles(
    opened: MapFile, zoom: int, columns: range, rows: range, most: float
) -> list[tuple[Tile, int]]:
    """Tiles of a zoom; none if they have too many bytes, or one more than `most` pixels a side."""
    found: list[tuple[Tile, int]] = []
    size = 0
    for row in rows:
        for column in columns:
            tile = opened.tile(zoom, column % (1 << zoom), row)
            if tile is None:
                continue
            size += len(tile.data)
            if size > MOST_BYTES or tile.side > most:
                return []
            found.append((tile, column))
    return found


# The tiles that a page has used, as files: an input of its bundle.


@dataclass(frozen=True)
class TileFolder:
    """Folder with a list of tiles, and each at ZOOM/COLUMN/ROW with the ending of its kind."""

    path: Path

    def metadata(self) -> dict[str, Any]:
        """Name and attribution."""
        with (self.path / LIST).open("rb") as stream:
            said = json.loads(stream.read(_METADATA))
        return said if isinstance(said, dict) else {}

    def tile(self, zoom: int, column: int, row: int) -> bytes | None:
        """Bytes of a tile."""
        for ending in _PARTS.values():
            file = self.path / f"{zoom}/{column}/{row}.{ending}"
            if file.is_file():
                with file.open("rb") as stream:
                    return stream.read(LARGEST_TILE + 1)
        return None


def write_tiles(folder: Path, of: MapFile, tiles: list[Tile]) -> tuple[Path, ...]:
    """Write tiles of a map as a folder that `open_map` opens; return its files.

    `folder`: does not exist. `of`: for name and attribution.
    """
    folder.mkdir()
    files = [folder / LIST]
    # As HTML, so that the same text is read again.
    texts = {"name": html.escape(of.name), "attribution": html.escape(of.attribution)}
    said = json.dumps(texts, indent=2)
    files[0].write_bytes(f"{said}\n".encode())
    for tile in tiles:
        file = folder / f"{tile.zoom}/{tile.column}/{tile.row}.{_PARTS[tile.media]}"
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(tile.data)
        files.append(file)
    return tuple(files)
