"""Maps of raster tiles: the same tiles of every kind of file; damaged and hostile ones refused."""

from __future__ import annotations

import gzip
import random
import sqlite3
import struct
from itertools import pairwise

import pytest
from tests.map_files import archive, directory, mbtiles, pmtiles, png, varint

from strapdown.errors import DataError
from strapdown.formats.map_tiles import LARGEST_TILE, Tile, open_map, tile_number, write_tiles

SAID = {"name": "City", "attribution": '<a href="https://example.org">© They &amp; us</a>'}
TILES = {(z, x, y): png(grey=40 * z + 3 * x + y) for z in (1, 2) for x in (0, 1) for y in (0, 1)}


def refused(path, code, at=(1, 0, 0)):
    with pytest.raises(DataError) as caught, open_map(path) as opened:
        opened.tile(*at)
    assert caught.value.finding.code == code
    assert caught.value.finding.remedy


@pytest.fixture(params=["mbtiles", "pmtiles", "leaves", "folder"])
def city(request, tmp_path):
    if request.param == "mbtiles":
        return mbtiles(tmp_path / "city.mbtiles", TILES, **SAID)
    if request.param == "folder":
        with open_map(mbtiles(tmp_path / "city.mbtiles", TILES, **SAID)) as opened:
            write_tiles(tmp_path / "tiles", opened, [opened.tile(*at) for at in TILES])
        return tmp_path / "tiles"
    return pmtiles(tmp_path / "city.pmtiles", TILES, leaf=3 * (request.param == "leaves"), **SAID)


def test_every_kind_of_file_has_the_same_tiles(city):
    with open_map(city) as opened:
        assert (opened.name, opened.attribution) == ("City", "© They & us")
        for (zoom, column, row), data in TILES.items():
            assert opened.tile(zoom, column, row) == Tile(zoom, column, row, data, "png", 256)
        for away in ((0, 0, 0), (2, 3, 3), (20, 5, 5)):
            assert opened.tile(*away) is None


def test_numbers_of_tiles_follow_the_hilbert_curve():
    # An example of the specification's own tests, and the four tiles of zoom 1.
    assert tile_number(12, 3423, 1763) == 19078479
    assert [tile_number(1, *at) for at in ((0, 0), (0, 1), (1, 1), (1, 0))] == [1, 2, 3, 4]
    for zoom in range(6):
        n = 1 << zoom
        places = {tile_number(zoom, x, y): (x, y) for x in range(n) for y in range(n)}
        first = (4**zoom - 1) // 3
        assert sorted(places) == list(range(first, first + n * n))
        steps = [places[k] for k in sorted(places)]
        # Each tile of the curve touches the next one.
        assert all(abs(a - c) + abs(b - d) == 1 for (a, b), (c, d) in pairwise(steps))


def test_a_repeated_tile_is_there_for_each_of_its_numbers(tmp_path):
    data = png()
    path = tmp_path / "sea.pmtiles"
    path.write_bytes(archive(directory([(1, 0, len(data), 3)]), data=data, inner=1))
    with open_map(path) as opened:
        found = [opened.tile(1, x, y) is not None for x, y in ((0, 0), (0, 1), (1, 1), (1, 0))]
    assert found == [True, True, True, False]


JPEG = b"\xff\xd8\xff\xe0\x00\x04ab\xff\xc0\x00\x11\x08" + struct.pack(">HH", 512, 512) + b"\x03"
VP8 = b"RIFF\0\0\0\0WEBPVP8 \0\0\0\0\0\0\0\x9d\x01\x2a" + struct.pack("<HH", 256, 256)
VP8L = b"RIFF\0\0\0\0WEBPVP8L\0\0\0\0\x2f" + struct.pack("<I", 255 | 255 << 14) + bytes(9)
VP8X = b"RIFF\0\0\0\0WEBPVP8X\0\0\0\0\0\0\0\0\xff\x00\x00\xff\x00\x00"
ANIMATED = VP8X[:20] + b"\x02" + VP8X[21:]
SVG = b'<svg xmlns="http://www.w3.org/2000/svg" width="256" height="256"><script/></svg>'


@pytest.mark.parametrize(
    ("data", "kind"),
    [(JPEG, ("jpeg", 512)), (VP8, ("webp", 256)), (VP8L, ("webp", 256)), (VP8X, ("webp", 256))],
)
def test_kind_and_size_of_a_picture_are_those_of_its_bytes(tmp_path, data, kind):
    with open_map(mbtiles(tmp_path / "a.mbtiles", {(1, 0, 0): data})) as opened:
        tile = opened.tile(1, 0, 0)
    assert (tile.media, tile.side) == kind


@pytest.mark.parametrize(
    ("data", "code"),
    [
        (SVG, "io.map-tile-no-picture"),
        (gzip.compress(b"\x1a\x05vector", mtime=0), "io.map-tile-no-picture"),
        (b"", "io.map-tile-no-picture"),
        (ANIMATED, "io.map-tile-no-picture"),
        (b"\xff\xd8\xff\xe0\x00\x00" * 9, "io.map-tile-no-picture"),
        (png()[:24], "io.map-tile-no-picture"),
        (png(256, height=128), "io.map-tile-size"),
        (png(2048), "io.map-tile-size"),
        (png(1), "io.map-tile-size"),
        (png() + bytes(LARGEST_TILE), "io.map-tile-too-large"),
    ],
)
def test_what_is_no_tile_is_refused(tmp_path, data, code):
    refused(mbtiles(tmp_path / "a.mbtiles", {(1, 0, 0): data}), code)


def test_other_files_are_refused(tmp_path):
    text = tmp_path / "notes.txt"
    text.write_text("no map")
    empty = tmp_path / "empty.pmtiles"
    empty.write_bytes(b"")
    other = tmp_path / "other.db"
    connection = sqlite3.connect(other)
    connection.execute("CREATE TABLE a (b)")
    connection.close()
    for path in (text, empty, other):
        refused(path, "io.map-unknown")
    refused(tmp_path / "nowhere.pmtiles", "io.map-unreadable")
    refused(tmp_path, "io.map-unreadable")
    refused(mbtiles(tmp_path / "v.mbtiles", {}, format="pbf"), "io.map-vector")
    for content, code in (
        (archive(b"", kind=1), "io.map-vector"),
        (archive(b"", version=2), "io.map-version"),
        (archive(b"")[:100], "io.map-damaged"),
        (b"SQLite format 3\0" + bytes(4096), "io.map-damaged"),
    ):
        path = tmp_path / "a.bin"
        path.write_bytes(content)
        refused(path, code)


TILE = png()
HOSTILE = {
    "a directory of a billion entries": archive(b"\xff\xff\xff\xff\x0f", inner=1),
    "a directory that unpacks to a gigabyte": archive(gzip.compress(bytes(1 << 27))),
    "metadata that unpack to much": archive(
        directory([(0, 0, 1, 1)]), data=TILE, about=b" " * (1 << 24)
    ),
    "an endless number": archive(b"\x01" + b"\xff" * 30, inner=1),
    "numbers beyond what is counted": archive(
        b"\x02" + b"\xff" * 8 + b"\x3f" + b"\x01" * 7, inner=1
    ),
    "a tile beyond the file": archive(directory([(1, 1 << 40, 1 << 40, 1)]), inner=1),
    "a tile beyond its section": archive(directory([(1, 0, 99, 1)]), data=b"a", inner=1),
    "numbers that do not increase": archive(
        b"\x02\x01\x00\x01\x01\x01\x01\x01\x01", data=TILE, inner=1
    ),
    "a compression that is not read": archive(directory([(1, 0, 5, 1)]), data=TILE, inner=4),
    "no entries": archive(b"\x00", inner=1),
}


@pytest.mark.parametrize("what", HOSTILE)
def test_a_hostile_archive_is_refused(tmp_path, what):
    path = tmp_path / "a.pmtiles"
    path.write_bytes(HOSTILE[what])
    refused(path, "io.map-damaged")


def test_a_directory_that_is_its_own_leaf_ends(tmp_path):
    leaf = directory([(0, 0, 5, 0)])
    assert len(leaf) == 5
    path = tmp_path / "a.pmtiles"
    path.write_bytes(archive(leaf, leaf, inner=1))
    refused(path, "io.map-damaged")


def test_directories_together_are_bounded(tmp_path):
    # A leaf of 3.6 MB at each of some zooms: four of them are read, the fifth is too much.
    count = 900_000
    leaf = gzip.compress(varint(count) + b"\x01" * 3 * count + b"\x01" + bytes(count - 1), mtime=0)
    entries = [(tile_number(12 + k, 0, 0), k * len(leaf), len(leaf), 0) for k in range(5)]
    path = tmp_path / "a.pmtiles"
    path.write_bytes(archive(gzip.compress(directory(entries)), 5 * leaf, TILE))
    with open_map(path) as opened:
        for zoom in range(12, 16):
            # Beyond what the leaf has.
            assert opened.tile(zoom, (1 << zoom) - 1, 0) is None
        with pytest.raises(DataError) as caught:
            opened.tile(16, 0, 0)
    assert caught.value.finding.code == "io.map-damaged"


@pytest.mark.parametrize(
    "view",
    [
        # Counts without end.
        "WITH RECURSIVE n(k) AS (SELECT 1 UNION ALL SELECT k + 1 FROM n) "
        "SELECT 1 AS zoom_level, 0 AS tile_column, k + 9 AS tile_row, 'x' AS tile_data FROM n",
        # A blob of a gigabyte.
        "SELECT 1 AS zoom_level, 0 AS tile_column, 1 AS tile_row, zeroblob(1000000000) "
        "AS tile_data",
        "SELECT 1 AS zoom_level, 0 AS tile_column, 1 AS tile_row, 'text' AS tile_data",
    ],
)
def test_a_hostile_view_is_stopped(tmp_path, view):
    path = tmp_path / "a.mbtiles"
    connection = sqlite3.connect(path)
    connection.execute("CREATE TABLE metadata (name, value)")
    connection.execute(f"CREATE VIEW tiles AS {view}")
    connection.close()
    refused(path, "io.map-damaged")


def test_a_file_is_only_read(city, tmp_path):
    before = {p: p.read_bytes() for p in tmp_path.rglob("*") if p.is_file()}
    with open_map(city) as opened:
        opened.tile(1, 0, 0)
    assert {p: p.read_bytes() for p in tmp_path.rglob("*") if p.is_file()} == before


@pytest.mark.parametrize("form", ["pmtiles", "leaves", "mbtiles"])
def test_damaged_files_are_read_or_refused(tmp_path, form):
    draw = random.Random(7)
    path = tmp_path / "a.bin"
    if form == "mbtiles":
        whole = mbtiles(tmp_path / "city.mbtiles", TILES, **SAID).read_bytes()
    else:
        whole = pmtiles(
            tmp_path / "city.pmtiles", TILES, leaf=2 * (form == "leaves"), **SAID
        ).read_bytes()
    read = 0
    for _ in range(150):
        data = bytearray(whole)
        for _ in range(draw.randint(1, 4)):
            # Most of what steers is at the beginning.
            at = draw.randrange(draw.choice([130, 400, len(data)]))
            data[at] = draw.choice([0, 1, 127, 128, 255, draw.randrange(256)])
        if draw.random() < 0.2:
            del data[draw.randrange(len(data)) :]
        path.write_bytes(data)
        try:
            with open_map(path) as opened:
                for at in TILES:
                    tile = opened.tile(*at)
                    assert tile is None or len(tile.data) <= LARGEST_TILE
                read += 1
        except DataError as error:
            assert error.finding.code.startswith("io.map-")
    assert 0 < read < 150
