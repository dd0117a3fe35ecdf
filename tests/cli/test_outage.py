"""`strapdown outage`: what it writes and prints, that it is run again alike, what is refused."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))

from bad_outage import COAST_CASES, DRIVE, navigated_drive, outage_said

import strapdown
from strapdown.formats import read_raw


@pytest.fixture(scope="module")
def drive(tmp_path_factory, run_cli):
    folder = tmp_path_factory.mktemp("drive")
    navigated_drive(folder, run_cli)
    return folder


@pytest.fixture(scope="module")
def tried(drive, run_cli):
    """Outages of 15 s of the drive."""
    done = run_cli("outage", drive / DRIVE, "--outage", "15", "--out", drive / "tried")
    assert done.code == 0, done.err
    return drive / "tried", done


def test_a_sensor_is_told_in_words_and_numbers(tmp_path, run_cli):
    done = run_cli("outage", "adis16470", "--speed", "15", "--out", tmp_path / "out")
    assert done.code == 0, done.err
    assert "95 % of drifts are within" in done.out
    assert "The largest share" in done.out
    assert "total" in done.out
    names = {p.name for p in (tmp_path / "out").iterdir()}
    assert names == {
        "budget.csv",
        "outage.json",
        "cone.csv",
        "figures",
        "manifest.json",
        "report.html",
        "timing.json",
    }
    told = json.loads((tmp_path / "out" / "outage.json").read_text())
    shares = [one["share"]["horizontal"] for one in told["budget"]["sources"]]
    assert sum(shares) == pytest.approx(1.0, abs=1e-9)
    assert shares == sorted(shares, reverse=True)
    cone = read_raw(tmp_path / "out" / "cone.csv").columns
    assert cone["time_s"][[0, -1]] == pytest.approx([0.0, 60.0])
    assert cone["horizontal_95_m"][-1] == pytest.approx(told["at_the_end"]["horizontal_95_m"])
    # Nothing aids it: what is known grows no better.
    assert (np.diff(cone["horizontal_sd_m"]) >= 0.0).all()
    assert "identical" in run_cli("verify", tmp_path / "out").out


def test_it_is_run_again_byte_for_byte(tried, run_cli):
    folder, _ = tried
    again = run_cli("verify", folder)
    assert again.code == 0, again.out + again.err
    assert "identical" in again.out


def test_drifts_that_came_are_laid_over_the_forecast(tried):
    folder, done = tried
    told = json.loads((folder / "outage.json").read_text())
    assert len(told["drifts"]) == 10
    inside = np.array([one["inside_95"] for one in told["drifts"]])
    # Ten overlapping outages of one drive are as good as a few: of a forecast of half the size
    # exp(-0.25 * 3.0) = 47 % of all drifts would be outside.
    assert inside.mean() > 0.7
    assert "of 10 final drifts" in done.out
    drifts = read_raw(folder / "drifts.csv").columns
    assert len(drifts["time_s"]) == sum(one["fixes"] for one in told["drifts"])
    assert {p.stem for p in (folder / "figures").glob("*.svg")} == {
        "cone",
        "parts",
        "budget",
        "plane",
    }


def test_the_file_of_a_run_is_as_good_as_its_folder(drive, tried, run_cli):
    folder, _ = tried
    done = run_cli(
        "outage", drive / "navigate.toml", "--outage", "15", "--json", "--out", drive / "by-file"
    )
    assert done.code == 0, done.err
    by_file, by_folder = json.loads(done.out), json.loads((folder / "outage.json").read_text())
    assert by_file["drifts"] == by_folder["drifts"]
    assert by_file["budget"] == by_folder["budget"]


def test_a_smoother_tells_nothing_of_an_outage(drive, tried, run_cli):
    folder, _ = tried
    file = drive / "smoothed.toml"
    file.write_text((drive / "navigate.toml").read_text() + '\n[smoother]\nkind = "rts"\n')
    done = run_cli("outage", file, "--outage", "15", "--json", "--out", drive / "by-smoothed")
    assert done.code == 0, done.err
    assert (
        json.loads(done.out)["drifts"] == json.loads((folder / "outage.json").read_text())["drifts"]
    )


def test_a_record_that_ends_before_navigation_begins_is_refused(drive, run_cli):
    file = drive / "long.toml"
    text = (drive / "navigate.toml").read_text()
    head, _, rest = text.partition("[start]")
    kept = rest[rest.index("\n[") :]
    coarse = (
        '[coarse]\nkind = "known_heading"\nheading_deg = 30.0\nsd_deg = 1.0\nduration_s = 1000.0\n'
    )
    file.write_text(head + coarse + '[fine]\nkind = "none"\n' + kept)
    done = run_cli("outage", file, "--outage", "15", "--out", drive / "never")
    assert done.code == 3, done.out
    assert "before navigation" in done.err


def test_one_outage_at_a_stamp(drive, run_cli):
    done = run_cli(
        "outage", drive / DRIVE, "--outage", "10", "--at", "50", "-q", "--out", drive / "at"
    )
    assert (done.code, done.out) == (0, ""), done.err
    told = json.loads((drive / "at" / "outage.json").read_text())
    assert [one["begin_s"] for one in told["drifts"]] == [50.0]


def test_an_outage_between_two_covariances_is_refused(drive, run_cli):
    flags = ("--outage", "0.3", "--at", "50.2")
    done = run_cli("outage", drive / DRIVE, *flags, "--out", drive / "short")
    assert done.code == 4
    assert "Traceback" not in done.err and "--outage" in done.err
    assert not (drive / "short").exists()


@pytest.mark.parametrize("end", [("--to", "65"), ("--duration", "20")])
def test_outages_lie_within_the_part_that_flags_name(drive, run_cli, tmp_path, end):
    flags = ("--outage", "10", "--places", "3", "--from", "45", *end)
    done = run_cli("outage", drive / DRIVE, *flags, "-q", "--out", tmp_path / "part")
    assert done.code == 0, done.err
    told = json.loads((tmp_path / "part" / "outage.json").read_text())
    assert [one["begin_s"] for one in told["drifts"]] == [45.0, 50.0, 55.0]


@pytest.mark.parametrize(
    ("flags", "what"),
    [
        (("--from", "45", "--to", "50"), "longer than the 5 s between 45 and 50 s"),
        (("--from", "45", "--at", "50"), "--from: --at already states the start"),
    ],
)
def test_a_part_without_room_for_an_outage_is_refused(drive, run_cli, tmp_path, flags, what):
    done = run_cli("outage", drive / DRIVE, "--outage", "10", *flags, "--out", tmp_path / "none")
    assert done.code == 4
    assert what in done.err
    assert not (tmp_path / "none").exists()


def test_from_python(tmp_path):
    run = strapdown.outage(
        "hg1700",
        20.0,
        start={"aided_s": 0.0, "heading_sd_deg": 1.0},
        motion={"speed_m_per_s": 20.0, "turn_rate_deg_per_s": 3.0},
    )
    seal = run.save(tmp_path / "out")
    assert (seal.path / "report.html").is_file()


@pytest.mark.parametrize("case", COAST_CASES, ids=lambda case: case.title)
def test_what_cannot_be_used_is_said(case, drive, tmp_path, run_cli):
    said, _ = outage_said(case, drive, tmp_path, run_cli)
    assert said.startswith("error: ")
    assert "Remedy: " in said
