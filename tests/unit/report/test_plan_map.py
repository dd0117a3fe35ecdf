"""A local map under the plan: where its tiles are, which are chosen, and what is sealed."""

from __future__ import annotations

import json
import math
import re
import sys
from pathlib import Path

import numpy as np
import pytest
from tests.map_files import mbtiles, pmtiles, png

sys.path.insert(0, str(Path(__file__).parents[2] / "cli"))

from bad_navigate import undrawn, write_drive

import strapdown as sd
from strapdown.formats.map_tiles import (
    MOST_BYTES,
    MOST_PIXELS,
    MOST_TILES,
    Tile,
    chosen_tiles,
)
from strapdown.frames import ned_from_geodetic
from strapdown.report.navigation_plan import Plane, map_box, tile_picture

#: Where the drive begins.
LAT, LON = 55.75, 37.62


def mercator(lat, lon, zoom):
    """Column and row, as numbers with a fraction."""
    n = 1 << zoom
    up = math.asinh(math.tan(math.radians(lat)))
    return (lon + 180.0) / 360.0 * n, (0.5 - up / (2.0 * math.pi)) * n


class Everywhere:
    """A map of the whole Earth, of tiles of one size."""

    def __init__(self, side=256, size=1000, zooms=range(25)):
        self.side, self.size, self.zooms = side, size, zooms
        self.asked = 0

    def tile(self, zoom, column, row):
        assert 0 <= column < 1 << zoom and 0 <= row < 1 << zoom
        self.asked += 1
        if zoom not in self.zooms:
            return None
        return Tile(zoom, column, row, bytes(self.size), "png", self.side)


def plane(lat=LAT, lon=LON, unit="m", scale=1.0):
    return Plane(np.array([lat, lon, 100.0]), None, unit, scale)


@pytest.mark.parametrize("side", [256, 512, 1024])
@pytest.mark.parametrize("lat", [-80.0, -52.0, 0.0, 0.5, 30.0, 55.0, 70.0, 82.0])
@pytest.mark.parametrize("width", [80.0, 2e3, 15e3, 50e3, 700e3])
def test_tiles_are_within_a_pixel_of_where_they_belong(lat, width, side):
    """Against Mercator's own formulas at every part of every tile."""
    here = plane(lat)
    half = 0.5 * np.array([width, 0.6 * width])
    box = map_box(here, -half, half)
    chosen = chosen_tiles(Everywhere(side), box)
    # Where a plan is too large for the plane, or for so large tiles, there is no map.
    assert chosen.tiles or width > (10e3 if side == 1024 or abs(lat) > 75.0 else 60e3)
    seen = 0
    for tile, column in chosen.tiles:
        picture = tile_picture(here, box, tile, column)
        n = 1 << tile.zoom
        for right in np.linspace(0.0, 1.0, 9):
            for down in np.linspace(0.0, 1.0, 9):
                y = math.pi * (1.0 - 2.0 * (tile.row + down) / n)
                place = [
                    math.degrees(math.atan(math.sinh(y))),
                    (column + right) / n * 360.0 - 180.0,
                    100.0,
                ]
                north, east, _ = ned_from_geodetic(place, here.origin)
                drawn = picture.corner + right * picture.across + down * picture.down
                # What is on the plan; a page is 868 pixels wide.
                if (np.abs([east, north]) <= half).all():
                    assert np.hypot(*(drawn - [east, north])) < width / 868.0
                    seen += 1
    assert (seen > 5) == bool(chosen.tiles)


@pytest.mark.parametrize("lon", [LON, 179.9999, -180.0])
@pytest.mark.parametrize("width", [30.0, 900.0, 40e3])
def test_the_zoom_is_within_its_limits(lon, width):
    half = np.array([0.5 * width, 0.4 * width])
    box = map_box(plane(lon=lon), -half, half)
    chosen = chosen_tiles(Everywhere(), box)
    assert 0 < len(chosen.tiles) == chosen.count <= MOST_TILES
    pixels = (box.east - box.west) * 256 * (1 << chosen.zoom)
    assert 0.5 * MOST_PIXELS < pixels <= MOST_PIXELS or chosen.zoom == 24
    # They cover it, across the date line, too.
    columns = [column for _, column in chosen.tiles]
    n = 1 << chosen.zoom
    assert min(columns) <= n * box.west and max(columns) + 1 >= n * box.east
    heavy = chosen_tiles(Everywhere(size=MOST_BYTES // 5), box)
    assert sum(len(tile.data) for tile, _ in heavy.tiles) <= MOST_BYTES
    assert heavy.zoom < chosen.zoom


def test_a_lower_zoom_is_taken_where_the_map_has_no_other():
    half = np.array([500.0, 400.0])
    box = map_box(plane(), -half, half)
    assert chosen_tiles(Everywhere(zooms=range(13)), box).zoom == 12
    assert chosen_tiles(Everywhere(zooms=range(18, 20)), box).tiles == []
    nothing = Everywhere(zooms=())
    assert chosen_tiles(nothing, box).tiles == []
    assert nothing.asked <= 2 * 25 * MOST_TILES


def test_near_a_pole_there_is_no_map():
    half = np.array([500.0, 400.0])
    assert chosen_tiles(Everywhere(), map_box(plane(lat=88.0), -half, half)).tiles == []


# --- a run --------------------------------------------------------------------------------


def around(zooms, reach=3):
    """Tiles around the start of the drive."""
    found = {}
    for zoom in zooms:
        column, row = (int(v) for v in mercator(LAT, LON, zoom))
        for x in range(column - reach, column + reach + 1):
            for y in range(row - reach, row + reach + 1):
                found[zoom, x, y] = png(grey=(31 * zoom + 7 * x + y) % 256)
    return found


@pytest.fixture(scope="module")
def drive(tmp_path_factory):
    folder = tmp_path_factory.mktemp("drive")
    write_drive(folder)
    whose = '<a href="https://example.org/">© A & B</a><img src=x onerror=alert(1)>&lt;b&gt;'
    mbtiles(folder / "city.mbtiles", around((14, 15)), name="City <i>", attribution=whose)
    pmtiles(folder / "city.pmtiles", around((14, 15)), name="City <i>", attribution=whose)
    return folder


@pytest.fixture(scope="module")
def mapped(drive, run_cli):
    flags = ("--map", drive / "city.mbtiles", "-q", "--out", drive / "mapped")
    done = run_cli("navigate", drive / "navigate.toml", *flags)
    assert done.code == 0, done.err
    return drive / "mapped"


def test_the_tiles_of_the_plan_are_sealed_and_the_page_is_made_again(drive, mapped, run_cli):
    manifest = json.loads((mapped / "manifest.json").read_text())
    assert manifest["configuration"]["navigation"]["map"] == {"path": "inputs/map/tiles"}
    files = [one for one in manifest["inputs"] if one["role"] == "map"]
    tiles = [one["name"] for one in files if one["name"].endswith(".png")]
    assert 0 < len(tiles) <= MOST_TILES
    assert not list(mapped.rglob("*.mbtiles"))
    # The map itself is not needed again.
    (drive / "city.mbtiles").rename(drive / "away.mbtiles")
    try:
        again = run_cli("verify", mapped)
    finally:
        (drive / "away.mbtiles").rename(drive / "city.mbtiles")
    assert again.code == 0 and "identical" in again.out, again.out + again.err


def test_the_page_shows_the_map_and_whose_it_is(mapped):
    page = (mapped / "report.html").read_text()
    shown = re.findall(r'<image [^>]*href="([^"]{30})', page)
    manifest = json.loads((mapped / "manifest.json").read_text())
    count = sum(one["name"].endswith(".png") for one in manifest["inputs"])
    assert len(shown) == count and all(one.startswith("data:image/png;base64,") for one in shown)
    assert "© A &amp; B" in page and "City" in page
    # Its tags are gone, and what stands for a tag stays text.
    assert "onerror" not in page and "example.org" not in page
    assert "© A &amp; B&lt;b&gt;" in page
    assert len(page) < 2_000_000
    assert "<image" in (mapped / "figures" / "plan.svg").read_text()


def test_both_kinds_of_file_give_one_page(drive, mapped, run_cli):
    flags = ("--map", drive / "city.pmtiles", "-q", "--out", drive / "other" / "mapped")
    (drive / "other").mkdir()
    done = run_cli("navigate", drive / "navigate.toml", *flags)
    assert done.code == 0, done.err
    one, two = (folder / "report.html" for folder in (mapped, drive / "other" / "mapped"))
    assert one.read_bytes() == two.read_bytes()


def test_without_a_report_there_is_no_map(drive, run_cli):
    flags = ("--map", drive / "city.mbtiles", "--no-report", "-q", "--out", drive / "bare")
    assert run_cli("navigate", drive / "navigate.toml", *flags).code == 0
    manifest = json.loads((drive / "bare" / "manifest.json").read_text())
    assert "map" not in manifest["configuration"]["navigation"]
    assert "identical" in run_cli("verify", drive / "bare").out


def test_a_map_of_another_place_is_said(drive, tmp_path, run_cli):
    away = mbtiles(tmp_path / "away.mbtiles", {(14, 1, 1): png()}, name="Elsewhere")
    flags = ("--map", away, "-q", "--out", tmp_path / "out")
    assert run_cli("navigate", drive / "navigate.toml", *flags).code == 0
    page = (tmp_path / "out" / "report.html").read_text()
    assert "Elsewhere has no tiles here" in page and "<image" not in page
    assert "identical" in run_cli("verify", tmp_path / "out").out


@pytest.mark.parametrize("content", [b"", b"PMTiles\x03", b"SQLite format 3\0", b"notes"])
def test_a_bad_map_is_refused_before_the_run(drive, tmp_path, run_cli, content):
    bad = tmp_path / "bad.pmtiles"
    bad.write_bytes(content)
    with pytest.MonkeyPatch.context() as patch:
        undrawn(patch)
        done = run_cli("navigate", drive / "navigate.toml", "--map", bad, "--out", tmp_path / "out")
    assert done.code == 3
    assert "bad.pmtiles" in done.err and "Remedy" in done.err and "Traceback" not in done.err
    assert not (tmp_path / "out").exists()


def test_a_run_in_python_draws_its_map(drive, tmp_path):
    spec = drive / "with-map.toml"
    text = (drive / "navigate.toml").read_text()
    spec.write_text(text + '\n[map]\npath = "city.pmtiles"\n')
    sd.navigate(spec).plot("plan").save(tmp_path / "plan.svg")
    assert "<image" in (tmp_path / "plan.svg").read_text()
