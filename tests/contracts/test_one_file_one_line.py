"""A new module is one new file and one line of its table; a configuration names it at once.

The files are those in `one_file`; the lines are those of the fixture.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from tests.coded import coded

sys.path.insert(0, str(Path(__file__).parent))

from one_file.cauchy import Cauchy
from one_file.half_steps import HalfSteps
from one_file.staff import Staff

from strapdown.config.navigation import NavigationSpec
from strapdown.errors import ConfigError
from strapdown.estimation.robust import INFLUENCES
from strapdown.mechanization import MECHANIZATIONS
from strapdown.navigation.measurements import AIDS
from strapdown.systems.navigation_run import run_navigation

FILE = """[simulation]
rate_hz = 50.0
seed = 5
[simulation.motion]
kind = "stationary"
lat_deg = 55.0
lon_deg = 37.0
alt_m = 150.0
duration_s = 40.0

[start]
lat_deg = 55.0
lon_deg = 37.0
alt_m = 153.0
roll_deg = 0.0
pitch_deg = 0.0
heading_deg = 0.0

[sensors]
sensor = "adis16495-1"
"""
HALVES = '\n[mechanization]\nkind = "half_steps"\npart = 0.4\n'
HEIGHTS = """
[aiding.rod]
kind = "staff"
path = "heights.csv"
offset_cm = 50.0
update_rule = { kind = "robust", influence = "cauchy" }
"""


@pytest.fixture
def added(monkeypatch):
    """One line of each table."""
    monkeypatch.setitem(MECHANIZATIONS, "half_steps", HalfSteps)
    monkeypatch.setitem(AIDS, "staff", Staff)
    monkeypatch.setitem(INFLUENCES, "cauchy", Cauchy)


def navigated(folder, text):
    (folder / "run.toml").write_text(text)
    return run_navigation(NavigationSpec.read(folder / "run.toml"))


def test_a_mechanization(added, tmp_path):
    plain = navigated(tmp_path, FILE).record.trajectory
    halves = navigated(tmp_path, FILE + HALVES).record.trajectory
    # The kernel's error is of the fourth order of the step: 20 ms of a body at rest in two parts
    # are the same as in one to far below a millimetre; and rounding differs.
    assert np.abs(halves - plain).max().max() < 1e-6
    assert not np.array_equal(halves, plain)


def test_a_measurement_and_an_influence_function(added, tmp_path):
    rng = np.random.default_rng(1)
    heights = 149.5 + 0.1 * rng.normal(size=39)
    heights[[7, 20, 33]] += 30.0
    rows = [f"{k + 1},{h:.4f},0.1" for k, h in enumerate(heights)]
    (tmp_path / "heights.csv").write_text("\n".join(["time_s,mark_m,mark_sd_m", *rows]) + "\n")
    result = navigated(tmp_path, FILE + HEIGHTS)
    end = result.record.trajectory.iloc[-1]
    # Of 36 sound heights of 0.1 m with the noise of the sensors: within 0.1 m; three of 30 m, each
    # with the whole of its weight, would be 2.5 m.
    assert abs(end["alt"] - 150.0) < 0.1
    seen = result.record.innovations["rod.height"]
    weight = seen["weight up, m"].to_numpy()
    assert weight[[20, 33]].max() < 0.01 and np.median(weight) > 0.8
    # All that was chosen is told, with the unit of each.
    chosen = result.spec.model_dump(mode="json", serialize_as_any=True)["aiding"]["rod"]
    assert chosen["offset_m"] == 0.5
    assert chosen["update_rule"]["influence"] == {"kind": "cauchy", "c": 2.385}


def test_they_are_listed_with_their_options(added, run_cli):
    told = run_cli("modules").out
    for words in (
        "half_steps",
        "heights over the ellipsoid by a staff",
        "never nothing, ever less",
    ):
        assert words in " ".join(told.split()), words


def test_without_the_line_there_is_no_such_module(tmp_path):
    with pytest.raises(ConfigError, check=coded("config.unknown-choice")):
        navigated(tmp_path, FILE + HALVES)
