"""The studio driven in a browser as a person would: `studio/test/flow.mjs`, with its pictures."""

from __future__ import annotations

import math
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from tests.map_files import mbtiles, png
from tests.studio.two_recorders import write_two_recorders

ROOT = Path(__file__).parents[2]
STUDIO = ROOT / "studio"
LOGS = ROOT / "src" / "strapdown" / "demo_data" / "comma2k19"
CHROMIUM = os.environ.get("CHROMIUM", "/usr/bin/chromium")

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(shutil.which("node") is None, reason="no node"),
    pytest.mark.skipif(not Path(CHROMIUM).is_file(), reason="no chromium: set CHROMIUM"),
    pytest.mark.skipif(
        not (STUDIO / "node_modules" / "playwright-core").is_dir(),
        reason="nothing installed: cd studio && npm ci",
    ),
]


def tile_of(lat: float, lon: float, zoom: int) -> tuple[int, int]:
    """Column and row, from the north, of the tile of web Mercator that holds a place."""
    north = math.asinh(math.tan(math.radians(lat))) / math.pi
    return int((lon + 180.0) / 360.0 * 2**zoom), int((1.0 - north) / 2.0 * 2**zoom)


@pytest.fixture
def address(tmp_path: Path) -> Iterator[str]:
    """Address of a studio of an empty folder."""
    folder = tmp_path / "records"
    folder.mkdir()
    # The drive of the demo, on a map of greys.
    town = [(z, *tile_of(37.7255, -122.4721, z)) for z in range(10, 17)]
    tiles = {
        (z, x + i, y + j): png(grey=235 if (i + j) % 2 else 205)
        for z, x, y in town
        for i in range(-4, 5)
        for j in range(-4, 5)
    }
    about = {"format": "png", "minzoom": "10", "maxzoom": "16", "attribution": "© Town"}
    mbtiles(folder / "town.mbtiles", tiles, **about)
    command = [sys.executable, "-m", "strapdown", "studio", str(folder), "--no-browser"]
    with (
        (tmp_path / "errors").open("wb") as errors,
        subprocess.Popen(command, stdout=subprocess.PIPE, stderr=errors) as server,
    ):
        assert server.stdout is not None
        try:
            for line in server.stdout:
                if found := re.search(rb"http://\S+", line):
                    yield found[0].decode()
                    break
            else:
                pytest.fail((tmp_path / "errors").read_text(errors="replace"))
        finally:
            server.terminate()


def drive(script: str, address: str, tmp_path: Path, *words: Path) -> str:
    """Run a script of studio/test; its output. Pictures stay in the folder STRAPDOWN_SHOTS."""
    shots = Path(os.environ.get("STRAPDOWN_SHOTS", tmp_path / "shots"))
    ran = subprocess.run(
        ["node", f"test/{script}", address, str(shots), *map(str, words)],
        cwd=STUDIO,
        env={**os.environ, "CHROMIUM": CHROMIUM},
        capture_output=True,
        text=True,
        timeout=1200,
        check=False,
    )
    assert ran.returncode == 0, ran.stdout + ran.stderr
    assert "no error in the console" in ran.stdout
    assert len(list(shots.glob("*.png"))) >= 8
    return ran.stdout


def test_from_files_to_a_comparison(address: str, tmp_path: Path) -> None:
    files = [LOGS / name for name in ("imu.csv", "gnss.csv", "reference.csv")]
    said = drive("flow.mjs", address, tmp_path, *files)
    assert "map" in said


def test_a_crash(address: str, tmp_path: Path) -> None:
    assert "questions answered" in drive("crash.mjs", address, tmp_path)


def test_a_newcomer_with_the_sample_and_two_recorders(address: str, tmp_path: Path) -> None:
    files = [tmp_path / name for name in write_two_recorders(tmp_path)]
    assert "two recorders" in drive("newcomer.mjs", address, tmp_path, *files)


def test_a_phone_sends(address: str, tmp_path: Path) -> None:
    assert "seen: " in drive("live.mjs", address, tmp_path)
