"""The pictures of the manual are those that the commands draw now.

``make pictures`` writes them anew.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

import numpy as np
import pytest

from strapdown import simulate
from strapdown.config import read_trajectory_spec
from strapdown.config.navigation_file import read_navigation_spec
from strapdown.ellipsoids import find_ellipsoid
from strapdown.report.document_files import drawings
from strapdown.report.navigation_document import navigation_document
from strapdown.report.navigation_result import told_of
from strapdown.report.svg_chart import draw
from strapdown.report.trajectory_simulation import simulation_chart
from strapdown.systems.sins.run import run_navigation
from strapdown.systems.trajectory_source import make_motion

sys.path.insert(0, str(Path(__file__).parents[1]))
from same_picture import PINNED, same_picture

ROOT = Path(__file__).parents[2]
EXAMPLES, IMAGES = ROOT / "docs" / "examples", ROOT / "docs" / "images"


def redraw(name, path):
    """The picture without the log, which takes seconds to make."""
    spec = read_trajectory_spec(EXAMPLES / f"{name}.toml")
    motion = make_motion(spec.motion, find_ellipsoid(spec.ellipsoid))
    time = np.arange(int(motion.duration * spec.rate_hz + 1e-6) + 1) / spec.rate_hz
    draw(simulation_chart(spec, motion.trajectory(time)), path, caption=True)


@pytest.mark.skipif(not PINNED, reason="another matplotlib than that of constraints.txt")
@pytest.mark.parametrize("name", ["car", "aircraft"])
def test_a_picture_of_the_manual_is_what_is_drawn_now(name, tmp_path):
    shown = IMAGES / f"trajectory_{name}.svg"
    if os.environ.get("STRAPDOWN_WRITE_PICTURES"):
        redraw(name, shown)
    redraw(name, tmp_path / "now.svg")
    assert same_picture(shown, tmp_path / "now.svg"), "make pictures, and look at them"


@pytest.fixture(scope="module")
def navigated():
    """The report of the drive of the manual, without its page."""
    result = run_navigation(read_navigation_spec(EXAMPLES / "navigate_car.toml"))
    return drawings(navigation_document(told_of(result), ""))


@pytest.mark.skipif(not PINNED, reason="another matplotlib than that of constraints.txt")
@pytest.mark.parametrize("name", ["plan", "bounds"])
def test_a_picture_of_a_run_is_what_is_drawn_now(name, navigated, tmp_path):
    (chart,) = [d.chart for d in navigated if d.chart.slug == name]
    shown = IMAGES / f"navigate_{name}.svg"
    if os.environ.get("STRAPDOWN_WRITE_PICTURES"):
        draw(chart, shown)
    draw(chart, tmp_path / "now.svg")
    assert same_picture(shown, tmp_path / "now.svg"), "make pictures, and look at them"


def test_the_picture_in_a_bundle_is_that_of_the_manual(tmp_path):
    seal = simulate(str(EXAMPLES / "car.toml"), tmp_path / "car")
    redraw("car", tmp_path / "now.svg")
    assert (seal.path / "trajectory.svg").read_bytes() == (tmp_path / "now.svg").read_bytes()
