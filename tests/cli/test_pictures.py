"""The pictures of the manual are those that the commands draw now.

``make pictures`` writes them anew.
"""

from __future__ import annotations

import os
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest
from tests.cli.test_manual import RUNNER

from strapdown import simulate
from strapdown.api.attitude import compare_attitude
from strapdown.config.logs import LogTable
from strapdown.config.motions import TrajectorySpec
from strapdown.config.navigation import NavigationSpec
from strapdown.ellipsoids import find_ellipsoid
from strapdown.report.attitude_charts import charts
from strapdown.report.chart_svg import ChartFigure
from strapdown.report.document import drawings
from strapdown.report.navigation_document import navigation_document
from strapdown.report.navigation_evaluation import NavigationEvaluation
from strapdown.report.paired_corrections import paired_chart, paired_errors
from strapdown.report.simulation import simulation_chart
from strapdown.report.verdict import heading_chart
from strapdown.systems.navigation_draft import draft_navigation
from strapdown.systems.navigation_run import run_navigation
from strapdown.systems.trajectory_source import make_motion

sys.path.insert(0, str(Path(__file__).parents[1]))
from same_picture import same_picture

ROOT = Path(__file__).parents[2]
EXAMPLES, IMAGES = ROOT / "docs" / "examples", ROOT / "docs" / "images"


def redraw(name, path):
    """The picture without the log, which takes seconds to make."""
    spec = TrajectorySpec.read(EXAMPLES / f"{name}.toml")
    motion = make_motion(spec.motion, find_ellipsoid(spec.ellipsoid))
    time = np.arange(int(motion.duration * spec.rate_hz + 1e-6) + 1) / spec.rate_hz
    ChartFigure(simulation_chart(spec, motion.trajectory(time))).save(path, caption=True)


@pytest.mark.parametrize("name", ["car", "aircraft"])
def test_a_picture_of_the_manual_is_what_is_drawn_now(name, tmp_path):
    shown = IMAGES / f"trajectory_{name}.svg"
    if os.environ.get("STRAPDOWN_WRITE_PICTURES"):
        redraw(name, shown)
    redraw(name, tmp_path / "now.svg")
    assert same_picture(shown, tmp_path / "now.svg"), "make pictures, and look at them"


def drawn_of(spec):
    """The charts of the report of a run, without its page."""
    return drawings(navigation_document(NavigationEvaluation(run_navigation(spec)), ""))


@pytest.fixture(scope="module")
def navigated():
    """The report of the drive of the manual."""
    return drawn_of(NavigationSpec.read(EXAMPLES / "navigate_car.toml"))


@pytest.fixture(scope="module")
def driven():
    """The drive through a tunnel, of the README and of the page of the verdict."""
    return run_navigation(NavigationSpec.read(EXAMPLES / "navigate_drive.toml"))


@pytest.fixture(scope="module")
def smoothed(tmp_path_factory):
    """The report of the drive through a tunnel, smoothed as the manual does it."""
    file = tmp_path_factory.mktemp("smoothed") / "smoothed.toml"
    drive = (EXAMPLES / "navigate_drive.toml").read_text(encoding="utf-8")
    file.write_text(f'{drive}\n[smoother]\nkind = "rts"\n', encoding="utf-8")
    return drawn_of(NavigationSpec.read(file))


@pytest.mark.parametrize("name", ["plan", "bounds"])
def test_a_picture_of_a_run_is_what_is_drawn_now(name, navigated, tmp_path):
    compare(navigated, name, tmp_path)


@pytest.mark.slow
def test_the_picture_of_a_smoothed_run_is_what_is_drawn_now(smoothed, tmp_path):
    compare(smoothed, "smoothing", tmp_path)


def compare(drawings_of_run, name, folder):
    (chart,) = [d for d in drawings_of_run if d.slug == name]
    compare_chart(chart, f"navigate_{name}.svg", folder)


def compare_chart(chart, name, folder):
    """Draw a chart, and hold the picture of that name to it."""
    ChartFigure(chart).save(folder / "now.svg")
    compare_picture(folder / "now.svg", name)


def compare_picture(now, name):
    """Hold the picture of that name to what was drawn now; write it where that is asked for."""
    shown = IMAGES / name
    if os.environ.get("STRAPDOWN_WRITE_PICTURES"):
        shutil.copyfile(now, shown)
    assert same_picture(shown, now), "make pictures, and look at them"


def test_the_rates_of_the_readme_are_what_is_drawn_now(tmp_path):
    (chart,) = [
        c for c in charts(compare_attitude("alexiev-fig6", rate_hz=200)) if c.slug == "sweep"
    ]
    compare_chart(chart, "attitude_rates.svg", tmp_path)


def test_the_crash_of_the_readme_is_what_is_drawn_now(sealed_crash):
    compare_picture(sealed_crash.folder / "figures" / "path.svg", "crash_path.svg")


@pytest.mark.slow
def test_the_crash_of_the_tutorial_is_what_its_commands_draw_now(recordings, tmp_path, monkeypatch):
    monkeypatch.setenv("STRAPDOWN_DATA", str(recordings("crash_nhtsa_10146").parent))
    monkeypatch.setenv("PATH", f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}")
    cells = [cell["code"] for cell in RUNNER.examples(ROOT / "docs" / "crash_tutorial.md")]
    drawing = next(k for k, cell in enumerate(cells) if "--out report" in cell)
    RUNNER.run_cells([(cell, True) for cell in cells[: drawing + 1]], tmp_path)
    compare_picture(tmp_path / "report" / "figures" / "delta-v.svg", "crash_wall.svg")


@pytest.mark.slow
def test_the_drive_of_the_readme_is_what_is_drawn_now(driven, tmp_path):
    drawn = drawings(navigation_document(NavigationEvaluation(driven), ""))
    (chart,) = [d for d in drawn if d.slug == "plan"]
    compare_chart(chart, "drive_plan.svg", tmp_path)


@pytest.mark.slow
def test_the_light_of_the_manual_is_what_is_drawn_now(driven, tmp_path):
    compare_chart(heading_chart(driven), "trust_light.svg", tmp_path)


@pytest.mark.slow
def test_both_corrections_of_the_manual_are_what_is_drawn_now(tmp_path):
    """The whole chain of the SINS-1000, which takes two minutes; and what its page says of it."""
    run = run_navigation(NavigationSpec.read(EXAMPLES / "navigate_sins1000.toml"))
    compare_chart(paired_chart(NavigationEvaluation(run)), "sins1000_paired.svg", tmp_path)
    assert run.record.not_estimated == run.beside.not_estimated == ("down", "VD")
    corrected, left = paired_errors(run)
    for one in (corrected, left):
        # Beyond three root sums of two equal variances at one instant in 8,000 (Rayleigh, exp(-9)),
        # and the instants of one run are correlated.
        assert (one.velocity < 3.0 * one.velocity_sd).all()
        assert (one.position < 3.0 * one.position_sd).all()
    # On the bench; the stated gain is that of the drifts that the alignment has found.
    bench = (corrected.time > 260.0) & (corrected.time < 320.0)
    assert (left.velocity_sd[bench] > 1.3 * corrected.velocity_sd[bench]).all()


def test_the_walk_of_the_manual_is_what_is_drawn_now(recordings, tmp_path):
    """As its page does it: the file that is drafted, the latitude, the control points."""
    path = recordings("foot/SensorConnectData_32_LLIO.mat")
    draft = draft_navigation(LogTable(path=str(path)), folder=tmp_path, foot=True)
    text = draft.text.replace('lat_deg = "?"', "lat_deg = 41.0")
    (tmp_path / "foot.toml").write_text(f"{text}\n[control_points]\npath = '{path}'\n")
    drawn = drawn_of(NavigationSpec.read(tmp_path / "foot.toml"))
    (chart,) = [d for d in drawn if d.slug == "plan"]
    compare_chart(chart, "walking_plan.svg", tmp_path)


def test_the_picture_in_a_bundle_is_that_of_the_manual(tmp_path):
    seal = simulate(str(EXAMPLES / "car.toml")).save(tmp_path / "car")
    redraw("car", tmp_path / "now.svg")
    assert (seal.path / "trajectory.svg").read_bytes() == (tmp_path / "now.svg").read_bytes()
