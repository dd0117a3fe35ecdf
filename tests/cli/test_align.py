"""`strapdown align`: what it writes, that it is run again alike, what bad input leaves: nothing."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))

from bad_alignment import ALIGNMENT_CASES, FILE, USUAL, alignment_said, record
from bad_command import whole_runs_slow

from strapdown.formats import read_raw


@pytest.fixture
def undrawn(monkeypatch):
    """Without figures and page, which take most of the time and change no number."""
    import strapdown.report.document_html as module

    monkeypatch.setattr(module, "draw_stills", lambda document: [])
    monkeypatch.setattr(module, "write_drawings", lambda *given: None)
    monkeypatch.setattr(module, "document_page", lambda document, stills=(): "<html></html>")


@pytest.fixture(scope="module")
def aligned(tmp_path_factory, run_cli):
    folder = tmp_path_factory.mktemp("aligned")
    record()(folder)
    done = run_cli("align", folder / "rest.csv", "--out", folder / "out", *USUAL)
    assert done.code == 0, done.err
    return folder, done


def test_the_answer_is_within_its_bounds(aligned):
    folder, _ = aligned
    found = json.loads((folder / "out" / "align.json").read_text())
    # One draw of the sensor: the truth within three of the standard deviations that are stated.
    for name, truth in (("roll", 1.0), ("pitch", 2.0), ("heading", 40.0)):
        off = abs(found["end"][f"{name}_deg"] - truth)
        assert off < 3.0 * found["end"][f"{name}_sd_deg"], name
    assert found["trust"]["verdict"] == "trusted"
    assert found["start"]["time_s"] == 0.0
    assert found["end"]["time_s"] == 120.0


def test_what_is_written(aligned):
    folder, done = aligned
    names = {p.name for p in (folder / "out").iterdir()}
    assert names == {
        "align.json",
        "attitude.csv",
        "figures",
        "fine.csv",
        "inputs",
        "manifest.json",
        "report.html",
        "timing.json",
    }
    attitude = read_raw(folder / "out" / "attitude.csv").columns
    assert np.allclose(np.diff(attitude["time_s"]), 0.1)
    page = (folder / "out" / "report.html").read_text()
    assert "Readiness: accuracy against alignment time" in page
    assert (folder / "out" / "figures" / "readiness.svg").is_file()
    assert "heading" in done.out
    assert max(map(len, done.out.splitlines())) < 400


def test_it_is_run_again_to_the_last_byte(aligned, run_cli):
    folder, _ = aligned
    done = run_cli("verify", folder / "out")
    assert (done.code, done.out.split()[0]) == (0, "identical")


@pytest.mark.usefixtures("undrawn")
def test_a_file_says_the_same_as_options(aligned, run_cli, tmp_path):
    folder, _ = aligned
    record()(tmp_path)
    (tmp_path / "align.toml").write_text(FILE)
    done = run_cli("align", tmp_path / "align.toml", "--out", tmp_path / "out", "--json")
    assert done.code == 0, done.err
    one = json.loads(done.out)
    two = json.loads((folder / "out" / "align.json").read_text())
    assert one["end"] == two["end"]


@pytest.mark.usefixtures("undrawn")
def test_a_draft_is_aligned_once_its_questions_are_answered(run_cli, tmp_path):
    record()(tmp_path)
    path = tmp_path / "align.toml"
    done = run_cli("init", "align", tmp_path / "rest.csv", "--out", path)
    assert done.code == 0, done.err
    assert "lat_deg" in done.out and "sensor" in done.out
    open_ = run_cli("align", path, "--out", tmp_path / "out")
    assert open_.code == 4 and "3 values are missing" in open_.err
    text = path.read_text()
    for key, value in (("lat_deg", "55.0"), ("lon_deg", "37.0"), ("sensor", '"fog-1000"')):
        text = text.replace(f'{key} = "?"', f"{key} = {value}")
    path.write_text(text)
    assert run_cli("align", path, "--out", tmp_path / "out", "-q").code == 0
    again = run_cli("init", "align", tmp_path / "rest.csv", "--out", path)
    assert again.code == 4 and "--force" in again.err


@pytest.mark.usefixtures("undrawn")
def test_the_laser_gyro_record(recordings, run_cli, tmp_path):
    """From the first 300 s, with the place that its header states."""
    log = recordings("rlg_static") / "part1_first900s.imu"
    options = ("--sensor", "hg9900", "--duration", "300", "--json")
    done = run_cli("align", log, "--out", tmp_path / "out", *options)
    assert done.code == 0, done.err
    found = json.loads(done.out)
    # What an inertial-frame alignment of 900 s gives is 90.60°; the bounds of this one are wider
    # than a tenth of a degree only by a little.
    assert found["coarse"]["heading_deg"] == pytest.approx(90.6, abs=0.1)
    assert found["end"]["heading_deg"] == pytest.approx(90.6, abs=0.1)
    assert found["end"]["heading_sd_deg"] < 0.1
    assert found["start"]["pitch_deg"] == pytest.approx(0.90, abs=0.05)
    assert found["start"]["roll_deg"] == pytest.approx(0.17, abs=0.05)
    assert found["trust"]["verdict"] == "trusted"


@pytest.mark.usefixtures("undrawn")
@pytest.mark.parametrize("case", whole_runs_slow(ALIGNMENT_CASES))
def test_bad_input_leaves_nothing_and_says_why(case, run_cli, tmp_path):
    said, code = alignment_said(case, tmp_path, run_cli)
    if code:
        assert said.startswith("error: ") and "Remedy: " in said
    else:
        assert "note: " in said or "warning: " in said
