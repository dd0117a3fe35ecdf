"""`strapdown simulate FILE.toml`, and the files that come with the manual."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from strapdown import read_gnss, read_log, simulate, verify
from strapdown.config.motions import KINDS, TrajectorySpec
from strapdown.ellipsoids import ELLIPSOIDS
from strapdown.simulation import ImuErrors, Origin, StationaryMotion, simulate_imu
from strapdown.systems.trajectory_source import simulate_trajectory
from strapdown.tables import ACCEL, GYRO

EXAMPLES = Path(__file__).parents[2] / "docs" / "examples"
# Trajectories; an alignment is an example of something else.
NAMES = sorted(
    path.stem
    for path in EXAMPLES.glob("*.toml")
    if "[motion]" in (text := path.read_text(encoding="utf-8")) and "pulses" not in text
)
REST = """sampling = "mean"
rate_hz = 20
ellipsoid = "pz90.11"
[motion]
kind = "stationary"
duration_s = 4
lat_deg = -33.9
lon_deg = 151.2
alt_m = 20
roll_deg = 1
pitch_deg = 2
heading_deg = 3
"""
SINE = """[motion]
kind = "sine_velocity"
duration_s = 10
lat_deg = 55
lon_deg = 37
mean_velocity_m_per_s = [5, 10, 0]
amplitude_m_per_s = [3, 4, 0]
"""


DRIVE = """sensor = "adis16470"
rate_hz = 20
[motion]
kind = "car"
lat_deg = 55.75
lon_deg = 37.62
heading_deg = 30
manoeuvres = [
  { do = "straight", duration_s = 12 },
  { do = "accelerate", to_m_per_s = 12, duration_s = 8 },
  { do = "turn_left", angle_deg = 90, radius_m = 25 },
  { do = "straight", duration_s = 15 },
]
"""


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "rest.toml").write_text(REST)
    (tmp_path / "sine.toml").write_text(SINE)
    return tmp_path


def truth(folder):
    return pd.read_csv(folder / "trajectory.csv", comment="#")


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_an_example_is_simulated_and_its_truth_agrees_with_itself(name):
    spec = TrajectorySpec.read(EXAMPLES / f"{name}.toml")
    motion, _, imu, attitude, trajectory, _ = simulate_trajectory(spec)
    assert len(imu) == len(attitude) == len(trajectory)
    assert trajectory.index[-1] == pytest.approx(motion.duration, abs=1.0 / spec.rate_hz)
    assert np.isfinite(imu[[*GYRO, *ACCEL]].to_numpy()).all()
    # A vehicle's velocity is what its place does, to the step's second order.
    down = np.diff(trajectory["alt"]) / np.diff(trajectory.index)
    middle = 0.5 * (trajectory["VD"].to_numpy()[1:] + trajectory["VD"].to_numpy()[:-1])
    # The trapezium's error is a twelfth of the second difference; a tenth for the next order.
    curved = np.abs(np.diff(trajectory["VD"].to_numpy(), 2)).max() / 12.0
    np.testing.assert_allclose(-down, middle, atol=1.1 * curved + 1e-9)


def test_the_examples_show_the_kinds_that_need_more_than_a_line():
    kinds = {TrajectorySpec.read(EXAMPLES / f"{name}.toml").motion.kind for name in NAMES}
    assert kinds == set(KINDS) - {"stationary", "sine_velocity"}


def test_a_file_becomes_a_sealed_folder(here, run_cli):
    done = run_cli("simulate", "rest.toml")
    assert done.code == 0, done.err
    assert done.out.startswith(
        "rest: fixes.csv, log.csv, manifest.json, scenario.json, trajectory.csv,"
    )
    assert (here / "rest-simulated" / "trajectory.svg").is_file()
    imu = read_log(here / "rest-simulated" / "log.csv").imu
    place = Origin(-33.9, 151.2, 20.0)
    motion = StationaryMotion(4.0, place, 1.0, 2.0, 3.0, ELLIPSOIDS["pz90.11"])
    expected, _ = simulate_imu(motion, ImuErrors(), rate=20.0, sampling="mean")
    np.testing.assert_array_equal(imu[[*GYRO, *ACCEL]], expected[[*GYRO, *ACCEL]])
    table = truth(here / "rest-simulated")
    assert list(table.columns) == [
        "time_s", "lat_deg", "lon_deg", "alt_m", "VN_m_s", "VE_m_s", "VD_m_s",
        "roll_deg", "pitch_deg", "heading_deg",
    ]  # fmt: skip
    assert (table[["lat_deg", "lon_deg", "alt_m"]] == [-33.9, 151.2, 20.0]).all(axis=None)
    about = json.loads((here / "rest-simulated" / "scenario.json").read_text())
    assert about["rate_hz"] == 20.0
    assert about["ellipsoid"]["semi_major_axis_m"] == 6378136.0
    assert about["configuration"]["motion"]["kind"] == "stationary"
    assert about["end"]["time_s"] == 4.0
    assert run_cli("verify", "rest-simulated").out.startswith("identical")


def test_options_replace_what_the_file_says(here, run_cli):
    done = run_cli(
        "simulate", "rest.toml", "--rate", "50", "--sampling", "instantaneous", "--seed", "7",
        "--sensor", "bmi160", "--format", "npz,mat", "--out", "other", "--json",
    )  # fmt: skip
    assert done.code == 0, done.err
    about = json.loads(done.out)
    assert (about["rate_hz"], about["sampling"], about["seed"]) == (50.0, "instantaneous", 7)
    assert about["sensor"] == "bmi160"
    assert about["samples"] == 201
    names = {path.name for path in (here / "other").iterdir()}
    assert {"log.npz", "log.mat"} <= names
    assert "log.csv" not in names


def test_the_next_command_navigates_by_the_fixes(here, run_cli):
    (here / "short.toml").write_text(DRIVE)
    done = run_cli("simulate", "short.toml", "--out", "town")
    assert done.code == 0, done.err
    folder = here / "town"
    about = json.loads((folder / "scenario.json").read_text())
    receiver = about["configuration"]["gnss"]
    assert (receiver["rate_hz"], receiver["position_noise_m"]) == (5.0, 1.0)
    fixes = read_gnss(folder / "fixes.csv")
    table = truth(folder)
    at = fixes.index[fixes.index <= table["time_s"].iloc[-1]]
    assert len(at) == pytest.approx(5.0 * table["time_s"].iloc[-1], abs=1)
    north = np.interp(at, table["time_s"], table["lat_deg"])
    off = (fixes["lat"].to_numpy()[: len(at)] - north) * 111.3e3
    # A share of 1e-4 of normal errors is beyond four times the rms, whose own sd is 2 %.
    assert np.sqrt(np.mean(off**2)) == pytest.approx(1.0, abs=0.1)
    command = done.out.partition("Next  strapdown ")[2]
    done = run_cli(
        *command.split(), "--out", "run", "--truth", folder / "trajectory.csv",
        "--no-report", "-q",
    )  # fmt: skip
    assert done.code == 0, done.err
    found = json.loads((here / "run" / "navigation.json").read_text())
    assert found["against"]["errors"]["horizontal"]["rms_m"] < 1.0
    for out, options, written in (("a", ("--fixes", "none"), False), ("b", (), True)):
        assert run_cli("simulate", "rest.toml", *options, "--out", out, "-q").code == 0
        assert (here / out / "fixes.csv").is_file() == written
        assert run_cli("verify", out).out.startswith("identical")
    for name, given in (("coning", "csv"), ("rest.toml", "gpx")):
        assert run_cli("simulate", name, "--fixes", given, "--out", "c").code == 4


def test_the_same_seed_is_the_same_folder(here):
    first = simulate("sine.toml", sensor="mpu-6050", seed=3).save(here / "a")
    again = simulate("sine.toml", sensor="mpu-6050", seed=3).save(here / "b")
    other = simulate("sine.toml", sensor="mpu-6050", seed=4).save(here / "c")
    assert first.digest == again.digest != other.digest
    assert (here / "a/log.csv").read_bytes() != (here / "c/log.csv").read_bytes()
    assert (here / "a/trajectory.csv").read_bytes() == (here / "c/trajectory.csv").read_bytes()


def test_a_sensor_beside_the_file_is_found_and_kept(here, monkeypatch):
    (here / "lab").mkdir()
    (here / "lab" / "mine.toml").write_text(
        'title = "mine"\nclass = "tactical"\nsummary = "one"\n[sources]\na = "sheet"\n'
        "[gyro]\n"
        'noise_density_deg_per_sqrt_h = { value = 0.1, source = "a", place = "1" }\n'
    )
    (here / "lab" / "sine.toml").write_text('sensor = "mine.toml"\n' + SINE)
    seal = simulate("lab/sine.toml").save(here / "out")
    manifest = json.loads((seal.path / "manifest.json").read_text())
    assert [item["name"].endswith("mine.toml") for item in manifest["inputs"]] == [True]
    (here / "lab" / "mine.toml").unlink()
    assert verify(seal.path).verdict == "identical"


def test_scenarios_are_as_before(here, run_cli):
    assert run_cli("simulate", "alexiev-fig2a", "--rate", "20").code == 0
    about = json.loads((here / "alexiev-fig2a-simulated" / "scenario.json").read_text())
    assert (about["rate_hz"], about["sampling"], about["seed"]) == (20.0, "instantaneous", 0)


def test_a_writer_of_trajectories_is_asked_for_by_name(here, run_cli):
    (here / "sine.toml").write_text('trajectory_formats = "dwg"\n' + SINE)
    done = run_cli("simulate", "sine.toml")
    assert done.code == 4
    assert "sine.toml, trajectory_formats: no writer is named 'dwg'" in done.err
    assert not (here / "sine-simulated").exists()


def test_a_sensor_is_questioned_where_units_of_its_type_do_not_differ_by_so_much(tmp_path, run_cli):
    """A log of the named sensor itself was asked about: 0.17 deg/√h against the sheet's 0.168."""
    assert run_cli("simulate", "drive-town", "--out", tmp_path / "drive").code == 0
    log = tmp_path / "drive" / "log.csv"
    for sensor, asked in (("icm-42688-p", False), ("hg1700", True)):
        out = tmp_path / f"{sensor}.toml"
        done = run_cli("init", "navigate", log, "--sensor", sensor, "--out", out)
        assert ("is it this sensor?" in done.out) == asked, done.out
