"""The studio driven in a browser as a person would: `studio/test/flow.mjs`, with its pictures."""

from __future__ import annotations

import json
import math
import os
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from tests.map_files import mbtiles, png
from tests.studio.test_recordings import EVERY, PART, chosen, copied
from tests.studio.two_recorders import write_two_recorders

from strapdown.bundle import MANIFEST, UNSEALED

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


def drive(script: str, address: str, tmp_path: Path, *words: object, of: str = "") -> str:
    """Run a script of studio/test; its output. Pictures stay in the folder STRAPDOWN_SHOTS."""
    shots = Path(os.environ.get("STRAPDOWN_SHOTS", tmp_path / "shots")) / of
    ran = subprocess.run(
        ["node", f"test/{script}", address, str(shots), *map(str, words)],
        cwd=STUDIO,
        env={**os.environ, "CHROMIUM": CHROMIUM},
        capture_output=True,
        text=True,
        timeout=3600,
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


@pytest.mark.parametrize("fresh", ["page"], indirect=True)
@pytest.mark.parametrize("name", EVERY)
def test_a_recording_gives_what_its_command_gives(fresh: Any, tmp_path: Path, name: str) -> None:
    """All pages over a recording; each result is that of the command on it, byte by byte."""
    place = copied(name, fresh)
    sets = [json.dumps(files) for files in chosen(place, fresh)]
    said = drive("recording.mjs", fresh.url, tmp_path, PART, *sets, of=name)
    twin = tmp_path / "twin"
    twin.mkdir()
    shutil.copytree(place, twin / place.name)
    for one in map(json.loads, re.findall(r"^result (.*)$", said, re.MULTILINE)):
        command, result = shlex.split(one["command"]), one["name"]
        # Both pages propose it with another folder, by which its page would differ.
        assert command[0] == "strapdown" and command[-2:] == ["--out", f"{result}-again"]
        assert shlex.split(one["again"]) == command
        command[-1] = result
        for file in fresh.folder.glob(f"{result}.toml"):
            shutil.copy(file, twin)
        subprocess.run([sys.executable, "-m", *command], cwd=twin, check=True, timeout=900)
        made, again = contents(fresh.folder / result), contents(twin / result)
        assert made.keys() == again.keys() and MANIFEST in made
        assert not [file for file in made if made[file] != again[file]], command


def contents(place: Path) -> dict[str, bytes]:
    """Files of a result by their names: all that is sealed, and the seal."""
    files = [path for path in place.rglob("*") if path.is_file() and path.name not in UNSEALED]
    return {path.relative_to(place).as_posix(): path.read_bytes() for path in files}
