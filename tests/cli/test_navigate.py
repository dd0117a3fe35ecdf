"""`strapdown navigate`: what it writes, that it is run again alike, what bad input is told."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

sys.path.insert(0, str(Path(__file__).parent))

from bad_command import whole_runs_slow
from bad_navigate import FILE, NAVIGATE_CASES, drive, navigate_said, undrawn, write_drive

from strapdown.config.navigation import NavigationSpec
from strapdown.evaluation.trajectory_differences import trajectory_differences
from strapdown.formats import read_raw
from strapdown.formats.trajectory_readers import read_trajectory

SIMULATED = """title = "A drive with an outage"

[simulation]
rate_hz = 50.0
seed = 3

[simulation.motion]
kind = "car"
lat_deg = 55.75
lon_deg = 37.62
alt_m = 150.0
heading_deg = 30.0
manoeuvres = [
  { do = "accelerate", to_km_per_h = 50.0, duration_s = 10.0 },
  { do = "turn_left", angle_deg = 90.0, radius_m = 60.0 },
  { do = "straight", duration_s = 20.0 },
]

[simulation.gnss.rtk]
position_noise_m = 0.5
outages_s = [[25.0, 30.0]]
outlier_share = 0.1

[start]
lat_deg = 55.75
lon_deg = 37.62
alt_m = 150.0
roll_deg = 0.0
pitch_deg = 0.0
heading_deg = 30.5
heading_sd_deg = 1.0

[sensors]
sensor = "adis16495-1"
states = ["gyro_bias", "accel_bias", "accel_scale"]

[aiding.rtk]
kind = "gnss"
update_rule = "robust"

[aiding.wheels]
kind = "no_slip"

[recorder]
kind = "full"

[withhold]
spans_s = [[20.0, 24.0]]

[output]
files = ["csv", "parquet", "kml", "geojson"]
"""


@pytest.fixture
def undrawn_here(monkeypatch):
    undrawn(monkeypatch)


@pytest.fixture(scope="module")
def navigated(tmp_path_factory, run_cli):
    """The drive by its file, with its truth beside it."""
    folder = tmp_path_factory.mktemp("navigated")
    write_drive(folder, file=lambda text: text + '\n[truth]\npath = "truth.csv"\n')
    from strapdown.formats.writers import write_trajectory

    write_trajectory(folder / "truth.csv", drive()[2])
    with pytest.MonkeyPatch.context() as patch:
        undrawn(patch)
        done = run_cli("navigate", folder / "navigate.toml", "--out", folder / "out")
    assert done.code == 0, done.err
    return folder, done


def test_the_answer_is_within_its_bounds(navigated):
    folder, _ = navigated
    found = json.loads((folder / "out" / "navigation.json").read_text())
    truth = drive()[2]
    got = read_trajectory(folder / "out" / "trajectory.csv")
    off = trajectory_differences(got, truth).iloc[-1]
    # One draw: the error at the end within four of its standard deviations, component by component.
    for name in ("north", "east", "down"):
        assert abs(off[name]) < 4.0 * found["end"][f"{name}_sd_m"], name
    assert abs(off["heading"]) < 4.0 * found["end"]["heading_sd_deg"]
    # Fixes of 0.5 m, taken together: better than a single one.
    errors = found["against"]["errors"]
    assert errors["horizontal"]["rms_m"] < 0.7


def test_what_is_written(navigated):
    folder, done = navigated
    names = {p.name for p in (folder / "out").iterdir()}
    assert names >= {
        "errors.csv",
        "events.csv",
        "innovations",
        "inputs",
        "manifest.json",
        "navigation.json",
        "report.html",
        "sd.csv",
        "sensor_errors.csv",
        "timing.json",
        "trajectory.csv",
        "trajectory.geojson",
        "trajectory.kml",
    }
    table = read_raw(folder / "out" / "trajectory.csv").columns
    # Ten a second, as the recorder says; the step of the samples is 20 ms.
    assert np.allclose(np.diff(table["time_s"]), 0.1, atol=0.021)
    seen = read_raw(folder / "out" / "innovations" / "rtk.position.csv").columns
    assert {"nu_north_m", "s_north_m2", "weight_north"} <= set(seen)
    sensors = read_raw(folder / "out" / "sensor_errors.csv").columns
    assert {"gyro_bias_x_rad_s", "gyro_bias_x_sd_rad_s"} <= set(sensors)
    assert done.out.count("\n") > 10 and "Seal" in done.out


def test_it_is_run_again_to_the_last_byte(navigated, run_cli, undrawn_here):
    folder, _ = navigated
    done = run_cli("verify", folder / "out")
    assert (done.code, done.out.split()[0]) == (0, "identical"), done.out


def test_all_that_was_chosen_is_sealed(navigated):
    folder, _ = navigated
    sealed = json.loads((folder / "out" / "manifest.json").read_text())["configuration"]
    chain = sealed["navigation"]
    assert chain["mechanization"]["height"] == "free"
    assert chain["filter"]["covariance"]["kind"] == "ud"
    assert chain["aiding"]["rtk"]["time_offset_sd_s"] == 0.0
    assert chain["log"]["path"] == "inputs/log/drive.csv"


def test_a_simulation_with_outage_outliers_and_full_rate(run_cli, tmp_path, undrawn_here):
    (tmp_path / "drive.toml").write_text(SIMULATED)
    done = run_cli("navigate", tmp_path / "drive.toml", "--out", tmp_path / "out", "--json")
    assert done.code == 0, done.err
    found = json.loads(done.out)
    # The robust rule bears the outliers of 50 standard deviations.
    assert found["against"]["errors"]["horizontal"]["rms_m"] < 2.0
    assert any(e["kind"] == "outage" for e in found["events"])
    # Not by the fixes, of which there are four, and outliers among them.
    (test,) = found["gnss_outage_tests"]
    assert (test["against"], test["inside"]) == ("truth", True)
    csv = read_raw(tmp_path / "out" / "trajectory.csv").columns
    parquet = read_raw(tmp_path / "out" / "trajectory.parquet").columns
    assert np.allclose(np.diff(csv["time_s"]), 0.02)
    assert np.array_equal(csv["lat_deg"], parquet["lat_deg"])
    assert run_cli("verify", tmp_path / "out").code == 0


def test_fixes_are_kept_back_to_score_by(run_cli, tmp_path, undrawn_here):
    withhold = "\n[withhold]\nspans_s = [[45.0, 55.0], [30.0, 35.0]]\n"
    write_drive(tmp_path, file=lambda text: text + withhold)
    done = run_cli("navigate", tmp_path / "navigate.toml", "--out", tmp_path / "out", "--json")
    assert done.code == 0, done.err
    found = json.loads(done.out)["gnss_outage_tests"]
    assert [(w["measurement"], w["from_s"], w["to_s"]) for w in found] == [
        ("rtk", 45.0, 55.0),
        ("rtk", 30.0, 35.0),
    ]
    assert all(w["inside"] and w["probability"] >= 0.01 for w in found)
    assert [w["against"] for w in found] == ["fixes"] * 2
    # The run itself has had all fixes.
    assert not any(e["kind"] == "outage" for e in json.loads(done.out)["events"])
    # A truth beside the file of the run replaces its own, and scores the outages.
    file = tmp_path / "other.toml"
    file.write_text((tmp_path / "navigate.toml").read_text() + '\n[truth]\npath = "drive.csv"\n')
    truth = tmp_path / "out" / "trajectory.csv"
    done = run_cli("navigate", file, "--truth", truth, "--out", tmp_path / "true", "--json")
    assert done.code == 0, done.err
    told = json.loads(done.out)
    assert told["against"]["name"] == "trajectory.csv"
    assert [w["against"] for w in told["gnss_outage_tests"]] == ["truth"] * 2
    assert run_cli("verify", tmp_path / "true").code == 0


@pytest.mark.slow
def test_a_log_is_navigated_directly_and_as_its_draft_says(run_cli, tmp_path, undrawn_here):
    write_drive(tmp_path)
    log, fixes = tmp_path / "drive.csv", tmp_path / "fixes.csv"
    done = run_cli(
        "navigate", log, "--gnss", fixes, "--sensor", "adis16495-1", "--out", tmp_path / "a", "-q"
    )
    assert done.code == 0, done.err
    path = tmp_path / "own.toml"
    options = ("--gnss", fixes, "--sensor", "adis16495-1", "--out", path)
    done = run_cli("init", "navigate", log, *options)
    assert done.code == 0, done.err
    assert '"?"' not in path.read_text()
    done = run_cli("navigate", path, "--out", tmp_path / "b", "-q")
    assert done.code == 0, done.err
    one, two = (json.loads((tmp_path / n / "navigation.json").read_text()) for n in "ab")
    assert one["end"] == two["end"]
    # It stands for ten seconds, drives off, and its course tells the heading.
    assert one["alignment"]["coarse"]["method"] == "gnss_course"
    again = run_cli("init", "navigate", log, *options)
    assert again.code == 4 and "--force" in again.err
    beside = run_cli("navigate", path, "--lat", "48", "--out", tmp_path / "c")
    assert beside.code == 4 and "lat_deg" in beside.err
    # Smoothing is no other run: the flag goes with a file, too, and is sealed with it.
    flagged = run_cli("navigate", path, "--smooth", "--out", tmp_path / "c", "-q")
    assert flagged.code == 0, flagged.err
    plain, smoothed = (
        json.loads((tmp_path / name / "manifest.json").read_text())["configuration"]["navigation"]
        for name in "bc"
    )
    assert [one.pop("smoother")["kind"] for one in (plain, smoothed)] == ["none", "rts"]
    assert plain == smoothed
    tables = [(tmp_path / name / "trajectory.csv").read_bytes() for name in "bc"]
    assert tables[0] != tables[1]
    assert run_cli("verify", tmp_path / "c").code == 0


def test_a_draft_of_foreign_columns_and_of_fixes_without_standard_deviations(run_cli, tmp_path):
    """What a remedy names can be done: columns are stated, a deviation is assumed and listed."""
    write_drive(tmp_path)
    log, fixes = pd.read_csv(tmp_path / "drive.csv", comment="#"), tmp_path / "bare.csv"
    names = ["time", "gyro_x", "gyro_y", "gyro_z", "accel_x", "accel_y", "accel_z"]
    log = log.iloc[:, :7].set_axis([f"c{k}" for k in range(7)], axis=1)
    log.to_csv(tmp_path / "odd.csv", index=False)
    pd.read_csv(tmp_path / "fixes.csv", comment="#").filter(regex="^(time|lat|lon|alt)").to_csv(
        fixes, index=False
    )
    columns = ",".join(f"{name}=c{k}" for k, name in enumerate(names))
    path = tmp_path / "odd.toml"
    units = ("--gyro-unit", "rad/s", "--accel-unit", "m/s2", "--time-unit", "s")
    done = run_cli(
        "init", "navigate", tmp_path / "odd.csv", "--gnss", fixes, "--columns", columns, *units,
        "--out", path,
    )  # fmt: skip
    assert done.code == 0, done.err
    assert "position_sd_m: standard deviation of the position, m of each fix" in done.out
    assert NavigationSpec.read(path).log.columns["gyro_z"] == "c3"
    assert "\nposition_sd_m = 5.0\n" in path.read_text()
    flags = ("navigate", tmp_path / "odd.csv", "--gnss", fixes, "--columns", columns, *units)
    refused = run_cli(*flags, "--sensor", "mpu-6050", "--out", tmp_path / "out")
    assert refused.code == 4 and "--gnss-position-sd 5" in refused.err


@pytest.mark.slow
def test_the_car_is_navigated_from_its_raw_files(recordings, run_cli, tmp_path, undrawn_here):
    """Alignment, time offset and shaking axes by themselves."""
    folder = recordings("car_rtk")
    done = run_cli(
        "navigate",
        folder / "part1_imu_frd_si.csv",
        "--gnss",
        folder / "part1_gnss_rtk.csv",
        "--sensor",
        "icm-42688-p",
        "--lever-arm",
        "0,-0.05,0",
        "--duration",
        "150",
        "--no-report",
        "--out",
        tmp_path / "out",
        "--json",
    )
    assert done.code == 0, done.err
    found = json.loads(done.out)
    sealed = json.loads((tmp_path / "out" / "manifest.json").read_text())["configuration"]
    aid = sealed["navigation"]["aiding"]["gnss"]
    state = found["sensors"]["gnss.time_offset_t"]
    # Stamps of the sensors are late by 0.12 to 0.15 s, drifting; the velocity by half of 0.25 s.
    assert -0.17 < aid["time_offset_s"] - state["estimate"] < -0.10
    assert aid["velocity_delay_s"] == pytest.approx(0.125, abs=0.02)
    shaking = sealed["navigation"]["sensors"]["gyro"]["noise_density_deg_per_sqrt_h"]
    assert shaking[1] > 5.0 * shaking[2]
    # What is left of the fixes is what was expected of them, to a third.
    assert 0.6 < found["observations"]["gnss.position"]["rms_in_sd"] < 1.4


@pytest.mark.parametrize("case", whole_runs_slow(NAVIGATE_CASES))
def test_bad_input_leaves_nothing_and_says_why(case, run_cli, tmp_path, undrawn_here):
    said, code = navigate_said(case, tmp_path, run_cli)
    if code:
        assert said.startswith("error: ") and "Remedy: " in said
    else:
        assert "note: " in said or "warning: " in said


# The signal comes while the callback of a weak reference runs, as they do in numbers in a long run:
# what is raised there, Python drops.
DROPPED = """
import os, signal, time, weakref
from strapdown.cli import main
from strapdown.report import document_html

# A shell that ignores interrupts hands that on to its jobs.
signal.signal(signal.SIGINT, signal.default_int_handler)

class Thing:
    pass

def gone(_):
    os.kill(os.getpid(), SENT)
    for _ in range(10_000):
        pass

def draw_stills(document):
    thing = Thing()
    kept = weakref.ref(thing, gone)
    del thing
    # What is sent again comes while it is at work; a minute is longer than any machine needs.
    end = time.monotonic() + 60.0
    while time.monotonic() < end:
        found = drawn(document)
    return found

drawn, document_html.draw_stills = document_html.draw_stills, draw_stills
main.run()
"""


@pytest.mark.slow
@pytest.mark.parametrize(("sent", "code"), [(signal.SIGTERM, 143), (signal.SIGINT, 130)])
def test_a_signal_that_python_drops_while_figures_are_drawn(tmp_path, sent, code):
    write_drive(tmp_path)
    before = {p.name for p in tmp_path.iterdir()}
    job = subprocess.run(
        [
            sys.executable,
            "-c",
            DROPPED.replace("SENT", str(int(sent))),
            "navigate",
            "navigate.toml",
            "--out",
            "out",
        ],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
    )
    assert job.returncode == code, job.stderr
    assert "Traceback" not in job.stderr
    assert "ignored" not in job.stderr
    assert {p.name for p in tmp_path.iterdir()} == before


@pytest.mark.slow
@pytest.mark.parametrize("sent", [signal.SIGTERM, signal.SIGINT])
@pytest.mark.parametrize("instant", ["*.partial", "*.partial/innovations"])
def test_stopped_while_it_writes(tmp_path, sent, instant):
    write_drive(tmp_path)
    before = {p.name for p in tmp_path.iterdir()}
    job = subprocess.Popen(
        [sys.executable, "-m", "strapdown", "navigate", "navigate.toml", "--out", "out"],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    deadline = time.monotonic() + 300
    while not any(tmp_path.glob(f".{instant}")) and job.poll() is None:
        assert time.monotonic() < deadline
        time.sleep(0.002)
    job.send_signal(sent)
    _, err = job.communicate(timeout=120)
    assert "Traceback" not in err
    left = {p.name for p in tmp_path.iterdir()} - before
    assert left in (set(), {"out"})
    if "out" in left:
        from strapdown.bundle import read_manifest, unsealed_changes

        assert unsealed_changes(tmp_path / "out", read_manifest(tmp_path / "out")) == []
    else:
        assert job.returncode in (128 + 15, 130)


def test_the_file_of_the_table_of_messages_is_sound(run_cli, tmp_path, undrawn_here):
    write_drive(tmp_path)
    assert (tmp_path / "navigate.toml").read_text() == FILE
    done = run_cli("navigate", tmp_path / "navigate.toml", "--out", tmp_path / "out", "-q")
    assert (done.code, done.err) == (0, "")
