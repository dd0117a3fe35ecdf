"""`strapdown doctor`: what it prints and writes, and how it ends."""

from __future__ import annotations

import json
import shlex

import numpy as np
import pytest

from strapdown.formats import csv

NAMES = ["time_s", *(f"gyro_{a}" for a in "xyz"), *(f"accel_{a}_m_s2" for a in "xyz")]


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    """A unit at rest for a minute, with rates in an unknown unit, and one row twice."""
    rng = np.random.default_rng(4)
    time = np.arange(0.0, 60.0, 0.01)
    time[3000] = time[2999]
    values = rng.normal(0.0, 1e-3, (time.size, 6)) - np.array([0.0, 0.0, 0.0, 0.0, 0.0, 9.81])
    path = tmp_path_factory.mktemp("doctor") / "log.csv"
    columns = dict(zip(NAMES, [time, *values.T], strict=True))
    csv.write(path, columns, {"axes": "forward-right-down", "sampling": "instantaneous"})
    return path


def test_a_log_with_questions_gets_a_page_that_asks_them_together(log, run_cli, tmp_path):
    done = run_cli("doctor", log, "--out", tmp_path / "out")
    assert done.code == 0, done.err
    assert len(done.out.splitlines()) < 40
    assert "--gyro-unit rad/s --repair" in done.out
    found = json.loads((tmp_path / "out" / "doctor.json").read_text())
    (one,) = found["logs"]
    assert {"io.unit-undecided", "io.stamp-repeated"} == {q["code"] for q in one["questions"]}
    assert one["fit"]["attitude"]["answer"] == "with limits"
    assert one["answers_inferred"] == {"gyro_unit": "rad/s", "repair": "true"}
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "--gyro-unit rad/s --repair" in page
    assert len(page) < 2_000_000


def test_the_answers_are_options_and_the_clean_log_needs_none(log, run_cli, tmp_path):
    clean = tmp_path / "clean.csv"
    done = run_cli(
        *("doctor", log, "--gyro-unit", "rad/s", "--fix", clean, "--json"),
        *("--out", tmp_path / "out"),
    )
    assert done.code == 0, done.err
    (one,) = json.loads(done.out)["logs"]
    assert one["fit"]["attitude"]["answer"] == "yes"
    assert one["options"] == "--gyro-unit rad/s --repair"
    assert json.loads((tmp_path / "clean.json").read_text())["files"] == {"imu": "clean.csv"}
    done = run_cli("attitude", clean, "--quiet", "--out", tmp_path / "attitude")
    assert (done.code, done.err) == (0, "")
    done = run_cli("doctor", clean, "--out", tmp_path / "again")
    assert done.code == 0
    assert "No fault" in (tmp_path / "again" / "report.html").read_text(encoding="utf-8")
    assert run_cli("verify", tmp_path / "again").code == 0


def test_nothing_is_written_of_a_log_whose_unit_is_open(log, run_cli, tmp_path):
    done = run_cli("doctor", log, "--fix", tmp_path / "clean.csv", "--out", tmp_path / "out")
    assert done.code == 3
    assert not (tmp_path / "clean.csv").exists()
    done = run_cli("doctor", log, log, "--fix", tmp_path / "clean.csv", "--out", tmp_path / "two")
    assert done.code == 4


def test_the_rate_of_a_log_without_a_clock_is_a_placeholder(run_cli, tmp_path):
    path = tmp_path / "log.csv"
    names = ",".join(f"gyro_{a}_rad_s" for a in "xyz")
    path.write_text(names + "\n" + "0.001,0.002,0.003\n0.002,0.001,0.003\n" * 200)
    done = run_cli("doctor", path, "--out", tmp_path / "out")
    assert done.code == 0, done.err
    (proposed,) = [line for line in done.out.splitlines() if line.endswith("csv --rate HZ")]
    assert "HZ of --rate (" in proposed


def test_what_cannot_be_read_at_all_is_refused(run_cli, tmp_path):
    (tmp_path / "noise.dat").write_bytes(bytes(range(256)) * 8)
    done = run_cli("doctor", tmp_path / "noise.dat", "--out", tmp_path / "out")
    assert done.code == 3
    assert not (tmp_path / "out").exists()
    assert run_cli("doctor", tmp_path / "none.csv").code == 4


@pytest.fixture(scope="module")
def with_fixes(log):
    """Fixes of the minute of the log, with a latitude of another name and no unit of the speed."""
    path = log.parent / "fixes.csv"
    rows = (f"{k},{50 + 1e-5 * k:.6f},30,100,{4.0:.1f},0" for k in range(60))
    path.write_text("\n".join(["time,latE7,lon,alt,speed,course", *rows]) + "\n")
    return path


def test_options_of_fixes_are_those_of_the_file_of_fixes(log, with_fixes, run_cli, tmp_path):
    """They were refused of the samples beside it, which have no such column."""
    options = ("--gnss-columns", "lat=latE7", "--gnss-units", "lat=deg,speed=km/h")
    for logs in ((log, with_fixes), (with_fixes, log)):
        out = tmp_path / logs[0].stem
        done = run_cli("doctor", *logs, *options, "--out", out)
        assert done.code == 0, done.err
        found = {one["name"]: one for one in json.loads((out / "doctor.json").read_text())["logs"]}
        assert found["log.csv"]["fixes_from"] == "fixes.csv"
        flags = "--gnss-columns=lat=latE7 --gnss-units=lat=deg,speed=km/h"
        assert found["log.csv"]["fixes_options"] == flags
        # The answers as inferred are asked of both files again.
        names = " ".join(map(str, logs))
        _, _, asked = next(x for x in done.out.splitlines() if ": strapdown" in x).partition(": ")
        assert asked == f"strapdown doctor {names} --gyro-unit rad/s --repair {flags}"
        again = run_cli(*shlex.split(asked)[1:], "--json", "--out", tmp_path / f"{logs[0].stem}-2")
        assert [one["questions"] for one in json.loads(again.out)["logs"]] == [[], []]
        page = (out / "report.html").read_text(encoding="utf-8")
        assert f"strapdown doctor {logs[0].name} {logs[1].name} --gyro-unit" in page
    done = run_cli("doctor", with_fixes, *options, "--out", tmp_path / "alone")
    assert done.code == 0, done.err


@pytest.mark.parametrize("form", ["gpx", "csv"])
def test_what_fixes_leave_open_is_asked_of_the_log_that_needs_them(log, run_cli, tmp_path, form):
    """A height over the sea alone was open, and `doctor` said that the log had no fixes."""
    path = tmp_path / f"walk.{form}"
    if form == "gpx":
        points = "".join(
            f'<trkpt lat="{50 + 1e-5 * k:.6f}" lon="30"><ele>100</ele>'
            f"<time>2024-03-05T12:00:{k:02d}Z</time></trkpt>"
            for k in range(60)
        )
        path.write_text(
            '<gpx version="1.1" xmlns="http://www.topografix.com/GPX/1/1"><trk><trkseg>'
            f"{points}</trkseg></trk></gpx>"
        )
    else:
        rows = (f"{k},{50 + 1e-5 * k:.6f},30,100" for k in range(60))
        path.write_text("\n".join(["time,lat,lon,alt_msl", *rows]) + "\n")
    done = run_cli("doctor", log, path, "--out", tmp_path / "out")
    assert done.code == 0, done.err
    assert f"{path.name}, alt: " in done.out and " FIXES" not in done.out
    found = {
        one["name"]: one for one in json.loads((tmp_path / "out/doctor.json").read_text())["logs"]
    }
    reasons = [reason["code"] for reason in found["log.csv"]["fit"]["navigation"]["reasons"]]
    assert "io.height-over-sea-column" in reasons and "doctor.no-fixes" not in reasons
    assert run_cli("verify", tmp_path / "out").code == 0
    asked = [x.partition(": ")[2] for x in done.out.splitlines() if ": strapdown doctor" in x]
    inferred = "--gyro-unit rad/s --repair --gnss-datum-height 0"
    assert asked == [f"strapdown doctor {log} {path} {inferred}"]
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert f"strapdown doctor log.csv {path.name} {inferred}" in page
    again = run_cli(*shlex.split(asked[0])[1:], "--json", "--out", tmp_path / "again")
    first = json.loads(again.out)["logs"][0]
    assert first["fixes_from"] == path.name and not first["questions"]


def test_options_of_fixes_that_no_file_has_are_refused(log, with_fixes, run_cli, tmp_path):
    for logs in ((log,), (log, with_fixes), (with_fixes, log)):
        done = run_cli("doctor", *logs, "--gnss-columns", "lat=y", "--out", tmp_path / "out")
        assert done.code == 4
        assert logs[-1 if logs[0] == log else 0].name in done.err
    other = tmp_path / "other.csv"
    other.write_bytes(log.read_bytes())
    done = run_cli("doctor", log, other, "--gnss-columns", "lat=y", "--out", tmp_path / "out")
    assert done.code == 4 and "log.csv" in done.err
