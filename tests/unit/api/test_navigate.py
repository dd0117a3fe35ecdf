"""`strapdown.navigate`: arrays, DataFrames and files alike, and a run that is sealed as it was."""

from __future__ import annotations

import dataclasses
import json
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from tests.coded import coded

sys.path.insert(0, str(Path(__file__).parents[2] / "cli"))

from bad_navigate import write_drive

import strapdown as sd
from strapdown.config.navigation import NavigationSpec
from strapdown.errors import ConfigError, DataError
from strapdown.systems.inputs import NOWHERE
from strapdown.systems.navigation_run import run_navigation

SENSOR = "adis16495-1"


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    made = tmp_path_factory.mktemp("drive")
    write_drive(made)
    return made


@pytest.fixture(scope="module")
def of_files(folder) -> sd.NavigationRun:
    imu = sd.read_imu(folder / "drive.csv")
    gnss = sd.read_gnss(folder / "fixes.csv")
    return sd.navigate(imu, [sd.Gnss(gnss), sd.NonHolonomic()], sensor=SENSOR)


@pytest.fixture(scope="module")
def of_tables(folder) -> sd.NavigationRun:
    """The same numbers, of tables that no longer know their files."""
    imu = sd.read_imu(folder / "drive.csv")
    gnss = sd.read_gnss(folder / "fixes.csv")
    plain = pd.DataFrame(imu)
    plain.attrs = {"sampling": "mean"}
    fixes = pd.DataFrame(gnss).reset_index()
    fixes.attrs = {}
    before = plain.copy(), fixes.copy()
    run = sd.navigate(plain, [sd.Gnss(fixes), sd.NonHolonomic()], sensor=SENSOR)
    assert plain.equals(before[0]) and fixes.equals(before[1])
    return run


def same(one: sd.NavigationRun, two: sd.NavigationRun) -> None:
    for name in ("trajectory", "sd", "sensor_errors"):
        pd.testing.assert_frame_equal(getattr(one, name), getattr(two, name), check_exact=True)
    assert one.innovations.keys() == two.innovations.keys() != set()
    for name, table in one.innovations.items():
        pd.testing.assert_frame_equal(table, two.innovations[name], check_exact=True)


def test_tables_in_memory_give_the_bits_of_files(of_files, of_tables):
    same(of_files, of_tables)
    assert of_tables.memory.tables.keys() == {"imu.npz", "gnss.csv"}
    assert not of_files.memory.tables
    # No path of a folder that is gone stays in the run.
    assert of_tables.spec.log.path == str(NOWHERE / "imu.npz")


@pytest.fixture(scope="module")
def short(folder):
    """The first 40 s of the log as instantaneous samples, and their run."""
    imu = sd.read_imu(folder / "drive.csv", sampling="instantaneous", span_s=(None, 40.0))
    return imu, sd.navigate(imu, [sd.Gnss(folder / "fixes.csv")], sensor=SENSOR)


def test_arrays_give_the_bits_of_a_table_of_instantaneous_samples(folder, short):
    imu, one = short
    arrays = (imu.index.to_numpy(), imu.filter(like="gyro").to_numpy(), imu.filter(like="accel"))
    two = sd.navigate(arrays, [sd.Gnss(folder / "fixes.csv")], sensor=SENSOR)
    same(one, two)


def test_a_configuration_is_run_as_before(folder):
    """The engine itself, asked by its own specification, gives the same bits."""
    path = folder / "navigate.toml"
    one = sd.navigate(path)
    two = run_navigation(NavigationSpec.read(path), path)
    pd.testing.assert_frame_equal(one.trajectory, two.record.trajectory, check_exact=True)
    pd.testing.assert_frame_equal(one.sd, two.record.sd, check_exact=True)
    with pytest.raises(ConfigError, match="configuration"):
        sd.navigate(path, sensor=SENSOR)


def test_a_run_from_memory_is_saved_and_verified(of_tables, tmp_path):
    seal = of_tables.save(tmp_path / "out", report=False)
    assert seal.path == tmp_path / "out"
    manifest = json.loads((tmp_path / "out" / "manifest.json").read_text())
    assert {i["name"] for i in manifest["inputs"]} == {
        "inputs/log/imu.npz",
        "inputs/aid-gnss/gnss.csv",
    }
    assert manifest["configuration"]["navigation"]["log"]["path"] == "inputs/log/imu.npz"
    assert not (tmp_path / "out" / "report.html").exists()
    assert sd.verify(tmp_path / "out").verdict == "identical"
    kept = sd.read_imu(tmp_path / "out" / "inputs" / "log" / "imu.npz")
    assert np.array_equal(kept.to_numpy(), of_tables.memory.tables["imu.npz"].to_numpy())
    written = pd.read_csv(tmp_path / "out" / "trajectory.csv", comment="#")
    assert np.array_equal(written["lat_deg"], of_tables.trajectory["lat"])
    with pytest.raises(ConfigError):
        of_tables.save(tmp_path / "out")
    # One digit of what was sealed.
    path = tmp_path / "out" / "inputs" / "aid-gnss" / "gnss.csv"
    path.write_text(path.read_text().replace("1", "2", 1))
    assert sd.verify(tmp_path / "out").verdict == "changed"


def test_a_run_of_files_seals_these(of_files, folder, tmp_path):
    of_files.save(tmp_path / "out", report=False)
    kept = tmp_path / "out" / "inputs"
    for name, path in (("drive.csv", "log"), ("fixes.csv", "aid-gnss")):
        assert (kept / path / name).read_bytes() == (folder / name).read_bytes()


def test_a_table_that_was_changed_no_longer_stands_for_its_file(folder, short):
    imu, one = short
    changed = imu.copy()
    changed["gyro_x"] += 1e-6
    two = sd.navigate(changed, [sd.Gnss(folder / "fixes.csv")], sensor=SENSOR)
    assert not one.memory.tables and two.memory.tables.keys() == {"imu.npz"}
    assert not one.trajectory["roll"].equals(two.trajectory["roll"])


def test_a_run_shows_itself_and_cannot_be_changed(of_files):
    assert repr(of_files).startswith("<NavigationRun drive.csv: ")
    assert len(repr(of_files)) < 200
    assert "<table" in of_files._repr_html_()
    table = of_files.to_pandas()
    assert {"lat", "heading", "north_sd", "heading_sd"} <= set(table.columns)
    assert table.index.equals(of_files.trajectory.index)
    common = table.index.intersection(of_files.sd.index)
    assert len(common) > 100
    assert table.loc[common, "north_sd"].equals(of_files.sd.loc[common, "north"].rename("north_sd"))
    with pytest.raises(dataclasses.FrozenInstanceError):
        of_files.record = None
    for kind in ("plan", "bound", "gnss.position"):
        assert of_files.plot(kind).panels
    with pytest.raises(ConfigError, check=coded("report.unknown-chart")):
        of_files.plot("gnss.positoin")


def test_a_run_whose_epochs_are_between_its_samples_shows_itself(short):
    imu, run = short
    fixes = sd.GnssFixes(run.trajectory.assign(north_sd=1.0, east_sd=1.0, down_sd=1.0))
    between = fixes.set_axis(fixes.index + 0.0041)
    off = sd.navigate(imu, [sd.Gnss(between)], sensor=SENSOR, start={"heading_deg": 30.0})
    assert "<table" in off._repr_html_()
    assert off.to_pandas().index.equals(off.trajectory.index)
    assert off.to_pandas()["north_sd"].notna().all()


def test_a_lever_arm_reaches_the_filter(folder, short):
    run = sd.navigate(
        short[0],
        [sd.Gnss(folder / "fixes.csv", lever_arm_m=(1.0, 0.0, -1.0))],
        sensor=SENSOR,
        smooth=True,
    )
    assert run.spec.aiding["gnss"].lever_arm_m == (1.0, 0.0, -1.0)
    assert run.forward is not None and "smoothed" in repr(run)


@pytest.mark.parametrize(
    ("ask", "error", "words"),
    [
        (lambda f: sd.navigate(f / "drive.csv"), ConfigError, "sensor"),
        (lambda f: sd.navigate(f / "drive.csv", sensor=SENSOR), ConfigError, "heading"),
        (lambda f: sd.navigate(3.0), ConfigError, "a float"),
        (lambda f: sd.navigate(pd.DataFrame({"time": [0.0, 1.0]})), DataError, "gyro_x"),
        (
            lambda f: sd.navigate(f / "drive.csv", ["gnss"], sensor=SENSOR),
            ConfigError,
            "measurement",
        ),
        (
            lambda f: sd.navigate(f / "drive.csv", sensor=SENSOR, start={"lat_deg": 1.0}),
            ConfigError,
            "lon",
        ),
        (
            lambda f: sd.navigate(f / "drive.csv", sensor=SENSOR, start={"latitude": 1.0}),
            ConfigError,
            "latitude",
        ),
        (
            lambda f: sd.navigate(
                f / "drive.csv", [sd.Gnss(f / "fixes.csv", leverarm_m=1)], sensor=SENSOR
            ),
            ConfigError,
            "leverarm_m",
        ),
    ],
)
def test_what_cannot_be_is_said_clearly(folder, ask, error, words):
    with pytest.raises(error) as caught:
        ask(folder)
    assert words in str(caught.value)
    assert "--" not in str(caught.value)


def test_one_measurement_need_not_be_in_a_list(folder, short):
    imu, one = short
    same(one, sd.navigate(imu, sd.Gnss(folder / "fixes.csv"), sensor=SENSOR))


@pytest.mark.parametrize("changed", [False, True])
def test_fixes_that_were_read_are_the_fixes_of_a_diagnosis(folder, tmp_path, changed):
    """They are read as they were: by the options of their own, in memory if they changed."""
    text = (folder / "fixes.csv").read_text().replace("lat", "breite", 1)
    (tmp_path / "fixes.csv").write_text(text)
    name = text.split(",")[1]
    gnss = sd.read_gnss(tmp_path / "fixes.csv", columns={"lat": name})
    if changed:
        gnss = gnss.iloc[1:]
    imu = sd.read_imu(folder / "drive.csv")
    made = sd.doctor([imu, gnss], sampling="mean")
    log, fixes = made.logs
    assert log.data["fixes_from"] == fixes.name == ("fixes-2.csv" if changed else "fixes.csv")
    found = log.streams["gnss"]
    assert np.array_equal(found[["lat", "lon", "alt"]], gnss[["lat", "lon", "alt"]])
    assert np.array_equal(found.index, gnss.index)
    made.save(tmp_path / "out", report=False)
    assert sd.verify(tmp_path / "out").verdict == "identical"
    (alone,) = sd.doctor(gnss).logs
    assert {*alone.streams} == {"gnss"}


def test_a_diagnosis_takes_tables_of_other_libraries_and_no_dictionary(folder):
    """Their columns were taken as logs, and the keys as names of files."""
    polars = pytest.importorskip("polars")
    imu = pd.DataFrame(sd.read_imu(folder / "drive.csv"))
    imu.attrs = {}
    (one,) = sd.doctor(polars.from_pandas(imu.reset_index())).logs
    assert np.array_equal(one.streams["imu"].to_numpy(), imu.to_numpy())
    with pytest.raises(ConfigError, check=coded("api.not-imu-samples", name="dict")):
        sd.doctor(imu.to_dict("list"))
