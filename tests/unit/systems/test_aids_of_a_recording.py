"""Streams of other sensors in a recording: read with it, proposed, and used."""

from __future__ import annotations

import re
import tomllib
from datetime import UTC, datetime
from functools import cache, reduce
from operator import xor

import numpy as np
import pandas as pd
import pytest
from scipy.stats import chi2
from tests.aiding_sensors import PressureHeight, simulate_barometer
from tests.coded import coded
from tests.town_drive import RATE, motion

import strapdown as sd
from strapdown import rotation
from strapdown.config.choice import Kinds
from strapdown.config.logs import FixesTable, LogTable
from strapdown.config.navigation import AidSpec, NavigationSpec
from strapdown.errors import DataError
from strapdown.formats import files_of
from strapdown.formats.aid_table import read_stream
from strapdown.sensors.triad_errors import ImuErrors, TriadErrors
from strapdown.simulation import simulate_imu
from strapdown.simulation.gnss import GnssReceiver, simulate_gnss
from strapdown.systems import navigation_draft
from strapdown.systems.navigation_draft import draft_navigation, propose_aids, propose_magnetometer
from strapdown.systems.navigation_proposal import propose
from strapdown.systems.navigation_run import run_navigation
from strapdown.systems.navigation_source import read_aid
from strapdown.tables import ACCEL, EULER, GYRO, MAG, imu_table
from strapdown.tables.aiding import standard_slope

#: Scatter of a pressure, Pa, and of positions, m: that of the height is what a code receiver has.
SCATTER, PLACE_SD = 3.0, (2.0, 2.0, 6.0)


def pressure_at(height):
    """Invert the standard atmosphere of Groves (2013), Eq. (6.18), by its geopotential height."""
    height = np.asarray(height)
    return 101325.0 * (1.0 - 0.0065 * 6_356_766.0 * height / (6_356_766.0 + height) / 288.15) ** (
        9.80665 / (287.05287 * 0.0065)
    )


def measured():
    return simulate_barometer(motion(), PressureHeight(rate=10.0, noise=0.01, bias=-40.0), seed=3)


@cache
def streams():
    errors = ImuErrors(
        TriadErrors(noise_density=1e-4, bias=(1e-4, -1e-4, 1e-4)),
        TriadErrors(noise_density=1e-3, bias=(0.02, -0.01, 0.02)),
    )
    imu, _ = simulate_imu(motion(), errors, rate=RATE, sampling="mean", seed=1)
    receiver = GnssReceiver(rate=1.0, position_noise=PLACE_SD, velocity_noise=(0.1, 0.1, 0.2))
    fixes = simulate_gnss(motion(), receiver, seed=2)
    heights = measured()
    pressure = pressure_at(heights["height"].to_numpy())
    pressure += SCATTER * np.random.default_rng(4).standard_normal(len(pressure))
    barometer = pd.DataFrame({"pressure": pressure}, index=heights.index)
    return {"imu": imu, "gnss": fixes, "barometer": barometer}


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    path = tmp_path_factory.mktemp("bag") / "drive.mcap"
    sd.write(streams(), path, epoch=datetime(2024, 5, 1, tzinfo=UTC))
    return path


def test_every_stream_is_read_with_the_recording(recording):
    read = sd.read(recording)
    assert list(read) == ["imu", "gnss", "barometer"]
    assert read["barometer"].attrs["units"] == {"pressure": "Pa"}
    made = streams()["barometer"]
    np.testing.assert_array_equal(read["barometer"]["pressure"], made["pressure"])
    since = read["barometer"].index - read["barometer"].index[0]
    np.testing.assert_allclose(since, made.index - made.index[0], atol=1e-6)


def test_the_noise_of_a_height_is_its_scatter_and_what_lasts(recording):
    log = LogTable(path=str(recording))
    imu = sd.read_imu(recording)
    tables, findings = propose_aids(log, imu, None)
    assert list(tables) == ["barometer"]
    assert not findings
    # Means of ten rows of 3 Pa, 0.08 m; gusts of 0.5 m over 30 s, in rows of 1 s, are 0.5 m √60.
    scatter = -SCATTER / np.sqrt(10.0) * standard_slope(streams()["barometer"]["pressure"]).mean()
    expected = np.hypot(scatter, 0.5 * np.sqrt(2.0 * 30.0 / 1.0))
    assert tables["barometer"]["height_sd_m"] == pytest.approx(expected, rel=0.05)


@pytest.mark.slow
def test_a_barometer_is_proposed_and_holds_the_height(recording, tmp_path, monkeypatch):
    proposed = []
    monkeypatch.setattr(
        navigation_draft,
        "propose",
        lambda *a, **o: proposed.append(propose(*a, **o)) or proposed[0],
    )
    draft = draft_navigation(LogTable(path=str(recording)), folder=tmp_path, axes="x,-y,-z")
    made = tmp_path / "navigate.toml"
    made.write_text(draft.text, encoding="utf-8")
    spec = NavigationSpec.read(made)
    assert {name: aid.kind for name, aid in spec.aiding.items()} == {
        "gnss": "gnss",
        "barometer": "barometer",
    }
    without = spec.model_copy(update={"aiding": {"gnss": spec.aiding["gnss"]}})
    alone, run = run_navigation(without), run_navigation(spec)
    at = np.linspace(45.0, 180.0, 10)
    truth = motion().trajectory(at)["alt"].to_numpy()
    error = np.interp(at, run.trajectory.index, run.trajectory["alt"]) - truth
    bound = np.interp(at, run.sd.index, run.sd["down"])
    # At most ten independent instants: errors of the height last.
    assert np.square(error / bound).sum() < chi2.ppf(1.0 - 1e-4, at.size)
    assert bound.mean() < np.interp(at, alone.sd.index, alone.sd["down"]).mean()
    assert proposed[0].drives


def test_a_table_of_pressures_needs_its_noise_and_nothing_else(tmp_path):
    table = streams()["barometer"]
    path = tmp_path / "air.csv"
    hectopascals = pd.DataFrame({"time_s": table.index, "p (hPa)": table["pressure"] / 100.0})
    hectopascals.to_csv(path, index=False)
    aid = {"kind": "barometer", "path": str(path)}
    made = Kinds("aiding", base=AidSpec)
    heights = read_aid(made({**aid, "height_sd_m": 2.0}))
    assert (heights["height_sd"] == 2.0).all()
    # 3 Pa are 0.25 m: of 1817 rows none is five of its standard deviations off.
    np.testing.assert_allclose(heights["height"], measured()["height"], atol=5.0 * 0.26)
    with pytest.raises(DataError, check=coded("navigation.aid-without-sd")) as error:
        read_aid(made(aid))
    assert error.value.finding.data["key"] == "height_sd_m"


def test_a_stream_that_is_not_there_is_left_out(recording):
    with pytest.raises(DataError, check=coded("io.no-stream")):
        read_stream(recording, "wheel")


def test_rows_are_averaged_over_an_interval(tmp_path):
    path = tmp_path / "air.csv"
    time = np.arange(20) / 4.0
    pd.DataFrame({"time_s": time, "height_m": 3.0 + 2.0 * time, "height_sd_m": 0.5}).to_csv(
        path, index=False
    )
    made = Kinds("aiding", base=AidSpec)
    table = read_aid(made({"kind": "barometer", "path": str(path), "interval_s": 1.0}))
    np.testing.assert_allclose(table.index, np.arange(5) + 0.375, rtol=1e-15)
    np.testing.assert_allclose(table["height"], 3.0 + 2.0 * table.index, rtol=1e-15)
    assert (table["height_sd"] == 0.5).all()


def phone(heading_deg, tilt_deg, field_ned=(23.9, 0.7, 40.0)):
    """A phone log at rest, with the field of the Earth at Toulouse along its axes."""
    C_nb = rotation.dcm_from_euler([*tilt_deg, heading_deg])
    time = np.arange(300) / 50.0
    return imu_table(
        time,
        np.zeros((300, 3)),
        np.tile(C_nb.T @ [0.0, 0.0, -9.80665], (300, 1)),
        mag=np.tile(C_nb.T @ field_ned, (300, 1)),
    )


@pytest.mark.parametrize("heading", [0.0, 59.0, 200.0, 330.0])
def test_a_magnetometer_gives_the_heading_and_the_field_of_the_model(heading, tmp_path):
    imu = phone(heading, (20.0, -35.0))
    log = LogTable(path=str(tmp_path / "none.csv"))
    (tmp_path / "none.csv").write_text("t\n", encoding="utf-8")
    found = propose_magnetometer(log, imu, None, (43.57, 1.39, 150.0))
    # WMM2025 by pygeomag 1.1, for 2025.0.
    np.testing.assert_allclose(found.table["field_ned_ut"], (23.89, 0.7, 40.0), atol=0.02)
    assert rotation.within_half_turn(found.heading_deg - heading) == pytest.approx(0.0, abs=0.05)
    assert not found.dated
    assert not found.disturbed
    # A magnet of 20 uT along the body.
    near = imu.assign(mag_x=imu["mag_x"] + 20.0)
    assert propose_magnetometer(log, near, None, (43.57, 1.39, 150.0)).disturbed
    assert propose_magnetometer(log, imu, None, None) is None
    assert propose_magnetometer(log, imu.drop(columns=MAG), None, (43.57, 1.39, 150.0)) is None


@pytest.mark.parametrize("iron", [0.0, 3.0, 20.0])
def test_a_heading_that_would_be_asked_is_the_magnetometers(iron, tmp_path):
    imu = phone(59.0, (2.0, -3.0))
    rng = np.random.default_rng(4)
    imu[[*GYRO, *ACCEL]] += rng.normal(scale=[*[1e-3] * 3, *[0.01] * 3], size=(300, 6))
    imu["mag_y"] += iron
    path = tmp_path / "rest.csv"
    units = ["rad_s"] * 3 + ["m_s2"] * 3 + ["uT"] * 3
    imu.columns = [f"{k}_{u}" for k, u in zip([*GYRO, *ACCEL, *MAG], units, strict=True)]
    imu.to_csv(path, index_label="time_s")
    fixes = pd.DataFrame({"time_s": np.arange(6.0), "lat": 43.57, "lon": 1.39, "alt": 150.0})
    fixes.to_csv(tmp_path / "fixes.csv", index=False)
    draft = draft_navigation(
        LogTable(path=str(path)), folder=tmp_path, axes="x,y,z",
        gnss=FixesTable(path=str(tmp_path / "fixes.csv")),
    )  # fmt: skip
    asked, check = ({one.key for one in of} for of in (draft.asked, draft.to_check))
    known = tomllib.loads(draft.text)["coarse"]
    if iron > 10.0:  # not a field like the Earth's
        assert "heading_deg" in asked and known["heading_deg"] == "?"
        return
    assert "heading_deg" not in asked and "heading_deg" in check
    # An error of the horizontal field of 24 uT by 3 uT turns it by 7 deg at most.
    assert abs(known["heading_deg"] - 59.0) < (7.2 if iron else 0.2)
    assert abs(known["heading_deg"] - 59.0) < 2.0 * known["sd_deg"]
    assert known["sd_deg"] >= 5.0


def test_a_magnetometer_along_the_samples_holds_the_heading(recording, tmp_path):
    imu, fixes = streams()["imu"], streams()["gnss"]
    time = np.asarray(imu.index, dtype=np.float64)
    C_nb = rotation.dcm_from_euler(motion().trajectory(time)[EULER].to_numpy())
    iron = np.array([6.0, -9.0, 12.0])
    field = np.einsum("kji,j->ki", C_nb, [22.0, 1.5, 43.0]) + iron
    field += np.random.default_rng(7).standard_normal(field.shape)
    samples = sd.Imu(imu.assign(**dict(zip(MAG, field.T, strict=True))))
    samples.attrs = dict(imu.attrs)
    gnss = sd.Gnss(fixes, position_correlated_share=0.5)
    mag = sd.Magnetometer(field_ned_ut=(22.0, 1.5, 43.0))
    path = tmp_path / "drive.csv"
    sd.write({"imu": samples}, path)
    run = sd.navigate(path, [gnss, mag], sensor="icm-42688-p")
    at = np.linspace(60.0, 175.0, 8)
    truth = motion().trajectory(at)["heading"].to_numpy()
    found = np.interp(at, run.trajectory.index, np.unwrap(run.trajectory["heading"], period=360.0))
    error = rotation.within_half_turn(found - truth)
    bound = np.interp(at, run.sd.index, run.sd["heading"])
    assert np.square(error / bound).sum() < chi2.ppf(1.0 - 1e-4, at.size)
    estimate = run.sensor_errors
    assert any(column.startswith("magnetometer.hard_iron") for column in estimate.columns)


def test_a_folder_of_a_phone_is_navigated_with_the_fixes_in_it(tmp_path):
    folder = tmp_path / "phone"
    folder.mkdir()
    imu, fixes = streams()["imu"], streams()["gnss"]
    for name, columns, unit in (("Gyroscope", GYRO, "rad/s"), ("Accelerometer", ACCEL, "m/s^2")):
        table = pd.DataFrame({"Time (s)": imu.index})
        for axis, column, sign in zip("XYZ", columns, (1.0, -1.0, -1.0), strict=True):
            table[f"{axis} ({unit})"] = sign * imu[column].to_numpy()
        table.to_csv(folder / f"{name}.csv", index=False)
    course = np.degrees(np.arctan2(fixes["VE"], fixes["VN"])) % 360.0
    place = {
        "Time (s)": fixes.index,
        "Latitude (°)": fixes["lat"],
        "Longitude (°)": fixes["lon"],
        "Height (m)": fixes["alt"],
        "Velocity (m/s)": np.hypot(fixes["VN"], fixes["VE"]),
        "Direction (°)": course,
        "Horizontal Accuracy (m)": 3.0,
        "Vertical Accuracy (°)": 6.0,
    }
    pd.DataFrame(place).to_csv(folder / "Location.csv", index=False)
    assert sorted(p.name for p in files_of(folder)) == [
        "Accelerometer.csv",
        "Gyroscope.csv",
        "Location.csv",
    ]
    fixes_of = FixesTable(path=str(folder), datum_height_m=0.0)
    log = LogTable(path=str(folder), duration_s=90.0)
    draft = draft_navigation(log, folder=tmp_path, axes="x,-y,-z", gnss=fixes_of)
    made = tmp_path / "navigate.toml"
    made.write_text(draft.text.replace('"?"', "0.3"), encoding="utf-8")
    run = sd.navigate(made)
    run.save(tmp_path / "out", report=False)
    assert sd.verify(tmp_path / "out").verdict == "identical"


# Two antennas, and wheels.

EPOCH = datetime(2024, 5, 1, 10, tzinfo=UTC)
#: From the antenna on the left to that on the right, and the noise of its heading, deg.
ACROSS, OF_ANTENNAS = 90.0, 0.3


def summed(body):
    return f"${body}*{reduce(xor, body.encode(), 0):02X}"


def receiver_of_two_antennas(path):
    """Sentences of a receiver: its fixes, and behind each the heading of its antennas."""
    fixes = streams()["gnss"]
    sd.write({"gnss": fixes}, path, epoch=EPOCH)
    heading = motion().trajectory(np.asarray(fixes.index))["heading"].to_numpy() + ACROSS
    heading += OF_ANTENNAS * np.random.default_rng(7).standard_normal(len(fixes))
    lines, k = [], 0
    for line in path.read_text().splitlines():
        lines.append(line)
        if line.startswith("$GPRMC"):
            clock = line.split(",")[1]
            body = f"PASHR,{clock},{heading[k] % 360.0:.3f},T,,,,,,{OF_ANTENNAS},2,0"
            lines.append(summed(body))
            k += 1
    path.write_text("\r\n".join([*lines, ""]))
    return path


@pytest.fixture(scope="module")
def two_antennas(tmp_path_factory):
    folder = tmp_path_factory.mktemp("antennas")
    sd.write({"imu": streams()["imu"]}, folder / "imu.mcap", epoch=EPOCH)
    receiver_of_two_antennas(folder / "rover.nmea")
    return folder


def drafted(folder):
    draft = draft_navigation(
        LogTable(path=str(folder / "imu.mcap")), folder=folder, axes="x,-y,-z",
        gnss=FixesTable(path=str(folder / "rover.nmea")), sensor="icm-42688-p",
    )  # fmt: skip
    return draft, tomllib.loads(draft.text)["aiding"]


def test_the_angle_of_two_antennas_is_found_by_the_course(two_antennas):
    draft, aiding = drafted(two_antennas)
    assert draft.asked == ()
    assert aiding["heading"] == {
        "kind": "heading",
        "path": "rover.nmea",
        "axis_deg": pytest.approx(ACROSS, abs=0.5),
        "misalignment_sd_deg": 5.0,
    }
    found = next(f for f in draft.findings if f.code == "navigation.baseline-angle")
    assert found.data["angle"] == pytest.approx(ACROSS, abs=4.0 * found.data["sd"])
    assert found.data["duration"] > 100.0
    (shown,) = sd.doctor(two_antennas / "rover.nmea").data["logs"]
    assert [stream["name"] for stream in shown["streams"]] == ["gnss", "heading"]


def test_without_driving_the_angle_is_asked(two_antennas):
    log, path = LogTable(path=str(two_antennas / "imu.mcap")), two_antennas / "rover.nmea"
    parked = streams()["gnss"].assign(VN=0.0, VE=0.0)
    tables, findings = propose_aids(log, sd.read_imu(log.path), parked, beside=str(path))
    expected = {"kind": "heading", "path": str(path), "axis_deg": "?", "misalignment_sd_deg": 2.0}
    assert (tables, findings) == ({"heading": expected}, ())
    # Without standard deviations: 0.3° of noise, and 0.3° for 20 s in rows of a second.
    bare = two_antennas / "bare.nmea"
    other = r"\$PASHR,([^,]*),([^,]*),T[^*]*\*.."
    lines = re.sub(other, lambda m: summed(f"PSAT,HPR,{m[1]},{m[2]},,,N"), path.read_text())
    bare.write_text(lines)
    tables, _ = propose_aids(log, sd.read_imu(log.path), None, beside=str(bare))
    assert tables["heading"]["heading_sd_deg"] == pytest.approx(
        np.hypot(OF_ANTENNAS, 0.3 * np.sqrt(40.0)), rel=0.1
    )


@pytest.mark.slow
def test_two_antennas_hold_the_heading(two_antennas):
    made = two_antennas / "navigate.toml"
    made.write_text(drafted(two_antennas)[0].text, encoding="utf-8")
    spec = NavigationSpec.read(made)
    without = spec.model_copy(update={"aiding": {"gnss": spec.aiding["gnss"]}})
    at = np.linspace(45.0, 178.0, 12)
    truth = motion().trajectory(at)["heading"].to_numpy()
    errors, bounds = [], []
    for run in (run_navigation(without), run_navigation(spec)):
        time = np.asarray(run.trajectory.index)
        found = np.interp(at, time, np.unwrap(run.trajectory["heading"], period=360.0))
        errors.append(rotation.within_half_turn(found - truth))
        bounds.append(np.interp(at, run.sd.index, run.sd["heading"]))
    assert np.square(errors[1] / bounds[1]).sum() < chi2.ppf(1.0 - 1e-4, at.size)
    rms = np.sqrt(np.square(errors).mean(axis=1))
    assert rms[1] < 0.7 * rms[0]
    assert bounds[1].mean() < 0.7 * bounds[0].mean()


@pytest.mark.slow
def test_wheels_in_columns_of_the_log_hold_an_outage(tmp_path):
    imu, fixes = streams()["imu"], streams()["gnss"]
    table = pd.DataFrame({"time_s": imu.index})
    for column, unit in zip([*GYRO, *ACCEL], ["rad_s"] * 3 + ["m_s2"] * 3, strict=True):
        table[f"{column}_{unit}"] = imu[column].to_numpy()
    moving = motion().trajectory(np.asarray(imu.index))
    speed = 1.01 * np.hypot(moving["VN"], moving["VE"]).to_numpy()
    table["vehicle_speed_kmh"] = np.repeat(3.6 * speed[::5], 5)[: len(table)]
    table.to_csv(tmp_path / "drive.csv", index=False)
    fixes.to_parquet(tmp_path / "fixes.parquet")
    draft = draft_navigation(
        LogTable(path=str(tmp_path / "drive.csv")), folder=tmp_path, axes="x,y,z",
        gnss=FixesTable(path=str(tmp_path / "fixes.parquet")), sensor="icm-42688-p",
    )  # fmt: skip
    made = tmp_path / "navigate.toml"
    spans = "\n[withhold]\nspans_s = [[100.0, 130.0]]\n"
    made.write_text(draft.text + spans, encoding="utf-8")
    spec = NavigationSpec.read(made)
    assert spec.aiding["odometer"].path is None
    without = spec.model_copy(update={"aiding": {"gnss": spec.aiding["gnss"]}})
    alone, run = run_navigation(without), run_navigation(spec)
    scale = run.sensor_errors.filter(like="odometer.scale_scale").iloc[-1]
    assert scale.iloc[0] == pytest.approx(0.01, abs=0.005)
    wide, narrow = (one.withheld[0].forward.horizontal.max() for one in (alone, run))
    assert narrow < 0.6 * wide
