"""Loggers, applications on phones, simulators and data sets with layouts of their own.

Samples against an independent parse by pandas; other files are written here as documented.
"""

from __future__ import annotations

import dataclasses
import importlib
import json

import h5py
import numpy as np
import pandas as pd
import pytest
from scipy.io import savemat
from tests.coded import coded

from strapdown.constants import STANDARD_GRAVITY
from strapdown.errors import DataError
from strapdown.formats import READERS, NoStreamError, open_stream, read_log
from strapdown.formats.clocks import unix_from_gps
from strapdown.formats.find_columns import find_columns
from strapdown.formats.gnss_files import GnssOptions, fixes_of_columns, read_gnss
from strapdown.formats.recording import ReadOptions
from strapdown.formats.trajectory_readers import read_trajectory
from strapdown.parsers import in_place, matlab
from strapdown.rotation import dcm_from_euler
from strapdown.tables import ACCEL, GYRO, MAG

N = 60
T = np.round(np.arange(N) * 0.01, 2)
RATE = np.column_stack([0.1 + T, -0.2 * T, 0.3 * np.ones(N)])
FORCE = np.column_stack([0.4 * T, 0.2 - T, -9.8 + 0.1 * T])


def columns(raw):
    return {q: (np.asarray(raw.columns[c]), u) for c, (q, u) in raw.stated.items()}


def triad(raw, name):
    found = columns(raw)
    return np.column_stack([found[f"{name}_{a}"][0] for a in "xyz"])


def reader_of(path):
    return next(name for name, reader in READERS.items() if reader.detect(path))


def written(path, lines):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def rows(*blocks):
    return [",".join(repr(float(v)) for v in row) for row in np.column_stack(blocks)]


def truncations(path, tmp_path, stream, cuts=25):
    """Every cut file is read in part, or refused; nothing else is raised."""
    data = path.read_bytes()
    for k in range(1, cuts):
        cut = tmp_path / f"cut{path.suffix}"
        cut.write_bytes(data[: len(data) * k // cuts + k])
        try:
            open_stream(cut, stream)
        except DataError as error:
            assert str(error)


# --- gnss-ins-sim -----------------------------------------------------------------------


def simulated(folder, *, along_body):
    """Drive a curve: 10 m/s, heading from 20° on."""
    heading = 20.0 + 30.0 * T
    euler = np.column_stack([heading, 0 * T, 0 * T])
    body = np.column_stack([10.0 + 0 * T, 0 * T, 0 * T])
    turn = dcm_from_euler(np.radians(np.column_stack([0 * T, 0 * T, heading])))
    ned = np.einsum("nij,nj->ni", turn, body)
    moved = np.cumsum(ned, axis=0) * 0.01
    lat = 48.0 + np.degrees(moved[:, 0] / 6.37e6)
    lon = 11.0 + np.degrees(moved[:, 1] / (6.37e6 * np.cos(np.radians(48.0))))
    place = np.column_stack([lat, lon, 500.0 + 0 * T])
    folder.mkdir()
    written(folder / "time.csv", ["time (sec)", *rows(T)])
    for run in (0, 1):
        names = ["gyro_x (deg/s),gyro_y (deg/s),gyro_z (deg/s)"]
        written(folder / f"gyro-{run}.csv", [*names, *rows(np.degrees(RATE) + run)])
        names = ["accel_x (m/s^2),accel_y (m/s^2),accel_z (m/s^2)"]
        written(folder / f"accel-{run}.csv", [*names, *rows(FORCE + run)])
    names = "gps_lat (deg),gps_lon (deg),gps_alt (m),gps_vN (m/s),gps_vE (m/s),gps_vD (m/s)"
    written(folder / "gps-0.csv", [names, *rows(place[::10], ned[::10])])
    written(folder / "gps_time.csv", ["gps_time (sec)", *rows(T[::10])])
    names = ["ref_pos_lat (deg),ref_pos_lon (deg),ref_pos_alt (m)"]
    written(folder / "ref_pos.csv", [*names, *rows(place)])
    names = ["ref_vel_x (m/s),ref_vel_y (m/s),ref_vel_z (m/s)"]
    written(folder / "ref_vel.csv", [*names, *rows(body if along_body else ned)])
    names = ["ref_Yaw (deg),ref_Pitch (deg),ref_Roll (deg)"]
    written(folder / "ref_att_euler.csv", [*names, *rows(euler)])
    return folder, place, ned, heading


@pytest.mark.parametrize("along_body", [False, True])
def test_a_folder_of_gnss_ins_sim_gives_everything(tmp_path, along_body):
    folder, place, ned, heading = simulated(tmp_path / "sim", along_body=along_body)
    recording = read_log(folder)
    np.testing.assert_allclose(recording.imu[GYRO].to_numpy(), RATE, atol=1e-12)
    np.testing.assert_allclose(recording.imu[ACCEL].to_numpy(), FORCE, atol=1e-12)
    assert any(f.code == "io.first-of-runs" for f in recording.findings)
    fixes = fixes_of_columns(open_stream(folder, "gnss"), GnssOptions())
    np.testing.assert_allclose(fixes.place, place[::10])
    np.testing.assert_allclose(fixes.velocity, ned[::10])
    reference = read_trajectory(folder)
    np.testing.assert_allclose(reference[["VN", "VE", "VD"]].to_numpy(), ned, atol=1e-9)
    np.testing.assert_allclose(reference["heading"], heading)


def test_a_damaged_or_short_table_of_a_simulation_is_refused(tmp_path):
    folder, *_ = simulated(tmp_path / "sim", along_body=False)
    text = (folder / "accel-0.csv").read_text()
    (folder / "accel-0.csv").write_text("\n".join(text.splitlines()[:-4]) + "\n")
    with pytest.raises(DataError, check=coded("io.rows-not-those-of-stamps", size=N - 4, count=N)):
        open_stream(folder, "imu")
    (folder / "accel-0.csv").write_text(text.replace(",0.19", ",abc"))
    with pytest.raises(DataError, check=coded("io.value-not-a-number")):
        open_stream(folder, "imu")


def test_a_simulation_in_an_inertial_frame_has_no_place(tmp_path):
    folder, *_ = simulated(tmp_path / "sim", along_body=False)
    text = (folder / "ref_pos.csv").read_text().partition("\n")[2]
    names = "ref_pos_x (m),ref_pos_y (m),ref_pos_z (m)"
    (folder / "ref_pos.csv").write_text(f"{names}\n{text}")
    with pytest.raises(DataError, check=coded("io.sim-without-place")):
        open_stream(folder, "reference")
    (folder / "gps_time.csv").unlink()
    with pytest.raises(NoStreamError):
        open_stream(folder, "gnss")


def test_the_folder_of_the_simulator(recordings):
    folder = recordings("zoo/gnss_ins_sim")
    imu = read_log(folder).imu
    gyro = pd.read_csv(folder / "gyro-0.csv").to_numpy()
    np.testing.assert_allclose(imu[GYRO].to_numpy(), np.radians(gyro))
    assert imu["accel_z"].mean() == pytest.approx(-9.8, abs=0.02)
    assert len(read_trajectory(folder)) == len(imu) == 1000
    # One of its tables stands for the folder.
    assert len(read_log(folder / "gyro-0.csv").imu) == 1000


# --- NaveGo -----------------------------------------------------------------------------


def navego_fields():
    imu = {"t": T[:, None], "fb": FORCE, "wb": RATE, "freq": 100.0}
    lat, lon = np.full((6, 1), 0.8), np.full((6, 1), -0.2)
    gnss = {
        "t": T[::10, None],
        "lat": lat,
        "lon": lon,
        "h": np.full((6, 1), 100.0),
        "vel": np.tile([1.0, 2.0, 3.0], (6, 1)),
        "stdm": np.array([[1.0, 2.0, 3.0]]),
        "stdv": np.array([[0.1, 0.2, 0.3]]),
    }
    ref = {**gnss, "roll": lat * 0.1, "pitch": lat * 0.2, "yaw": lat}
    return {"mpu_imu": imu, "gnss": gnss, "ref": ref}


def test_structures_of_navego(tmp_path):
    path = tmp_path / "data.mat"
    savemat(path, navego_fields())
    assert reader_of(path) == "navego"
    recording = read_log(path)
    np.testing.assert_allclose(recording.imu[GYRO].to_numpy(), RATE)
    np.testing.assert_allclose(recording.imu[ACCEL].to_numpy(), FORCE)
    fixes = read_gnss(path)
    np.testing.assert_allclose(fixes["lat"], np.degrees(0.8))
    np.testing.assert_allclose(fixes[["VN", "VE", "VD"]], np.tile([1.0, 2.0, 3.0], (6, 1)))
    np.testing.assert_allclose(fixes["east_sd"], 2.0)
    np.testing.assert_allclose(fixes["VD_sd"], 0.3)
    reference = read_trajectory(path)
    np.testing.assert_allclose(reference["heading"], np.degrees(0.8))
    np.testing.assert_allclose(reference["roll"], np.degrees(0.08))
    truncations(path, tmp_path, "imu")


def test_structures_of_navego_in_hdf5(tmp_path):
    path = tmp_path / "data.mat"
    with h5py.File(path, "w") as file:
        for name, fields in navego_fields().items():
            for field, values in fields.items():
                file[f"{name}/{field}"] = np.atleast_2d(values).T
    assert reader_of(path) == "navego"
    np.testing.assert_allclose(read_log(path).imu[ACCEL].to_numpy(), FORCE)


def test_a_structure_of_navego_without_a_receiver(tmp_path):
    path = tmp_path / "imu.mat"
    savemat(path, {"imu": navego_fields()["mpu_imu"]})
    with pytest.raises(NoStreamError):
        open_stream(path, "gnss")
    savemat(path, {"imu": {"t": T, "fb": FORCE[:-1], "wb": RATE}})
    with pytest.raises(DataError, check=coded("io.rows-not-those-of-stamps", quantity="imu.fb")):
        open_stream(path, "imu")


# --- data sets --------------------------------------------------------------------------


def test_positions_of_smartloc_once_an_epoch(recordings):
    path = recordings("zoo/smartloc/tu_chemnitz_berlin_1_raw.csv")
    found = columns(raw := open_stream(path, "gnss"))
    table = pd.read_csv(path, sep=";").drop_duplicates("GPSSecondsOfWeek [s]")
    np.testing.assert_array_equal(found["time"][0], table["GPSSecondsOfWeek [s]"])
    np.testing.assert_array_equal(found["lat"][0], table["Latitude (GT Lat) [deg]"])
    np.testing.assert_array_equal(raw.rows, table.index + 2)
    heading = table.filter(like="(GT Heading) [rad]").iloc[:, 0]
    fixes = read_gnss(path, GnssOptions(position_sd=1.0, velocity_sd=0.1))
    speed = table["Velocity (GT Velocity) [m/s]"].to_numpy()
    np.testing.assert_allclose(fixes["VE"], speed * np.cos(heading), atol=1e-9)
    np.testing.assert_allclose(fixes["VN"], speed * np.sin(heading), atol=1e-9)
    # The velocity is that of the positions.
    north = np.gradient(np.radians(fixes["lat"].to_numpy()) * 6.37e6, fixes.index.to_numpy())
    assert np.median(np.abs(north - fixes["VN"])) < 0.3
    assert fixes.attrs["clock"] == "gps-seconds-of-week" and fixes.attrs["gps_week"] == 1900


def test_ground_truth_of_2021(recordings):
    path = recordings("zoo/gsdc/Pixel4_ground_truth.csv")
    found = columns(raw := open_stream(path, "gnss"))
    table = pd.read_csv(path)
    np.testing.assert_array_equal(found["lat"][0], table["latDeg"])
    np.testing.assert_array_equal(found["alt"][0], table["heightAboveWgs84EllipsoidM"])
    # 18 leap seconds from 2017 on.
    unix = table["millisSinceGpsEpoch"] * 1e-3 + 315_964_800.0 - 18.0
    np.testing.assert_allclose(found["time"][0], unix, rtol=0, atol=1e-6)
    np.testing.assert_allclose(
        found["time"][0], unix_from_gps(table["millisSinceGpsEpoch"].to_numpy() * 1e-3)
    )
    assert raw.clock == "unix"


def test_pseudoranges_are_refused_with_the_way_in(recordings):
    path = recordings("zoo/gsdc/device_gnss.csv")
    for stream in ("imu", "gnss"):
        with pytest.raises(DataError, check=coded("io.pseudoranges")) as caught:
            open_stream(path, stream)
        assert "ground_truth.csv" in str(caught.value)


# --- APDM -------------------------------------------------------------------------------


def test_the_first_monitor_of_apdm(recordings):
    path = recordings("zoo/apdm/imuData01.csv")
    raw = open_stream(path, "imu")
    lines = path.read_text().splitlines()
    table = np.array([line.split(",")[:60] for line in lines[4:]], dtype=np.float64)
    found = columns(raw)
    np.testing.assert_array_equal(found["time"][0], table[:, 0])
    np.testing.assert_array_equal(triad(raw, "accel"), table[:, 1:4])
    np.testing.assert_array_equal(triad(raw, "gyro"), table[:, 4:7])
    assert found["gyro_x"][1] == "rad/s" and found["accel_x"][1] == "m/s2"
    assert raw.rows[0] == 5
    told = next(f for f in raw.findings if f.code == "io.first-of-monitors")
    assert told.data["monitors"][:2] == ("Static", "Upper")


def test_another_monitor_of_apdm_by_its_columns(recordings):
    path = recordings("zoo/apdm/imuData01.csv")
    # Of one triad: the others are not those of the first monitor.
    recording = read_log(path, ReadOptions(columns={"gyro": "Upper/Angular Velocity"}))
    table = np.array([ln.split(",")[:60] for ln in path.read_text().splitlines()[4:]], dtype=float)
    for triad, first in ((ACCEL, 16), (GYRO, 19), (MAG, 22)):
        np.testing.assert_allclose(
            np.sort(np.abs(recording.imu[triad].iloc[0])),
            np.sort(np.abs(table[0, first : first + 3])),
        )
    assert not any(f.code == "io.first-of-monitors" for f in recording.findings)


@pytest.mark.parametrize("new", [True, False])
def test_hdf5_of_apdm(tmp_path, new):
    path = tmp_path / "walk.h5"
    stamps = 1_600_000_000_000_000 + np.arange(N) * 7812
    names = {"Gyroscope": RATE, "Accelerometer": FORCE, "Magnetometer": RATE}
    with h5py.File(path, "w") as file:
        file.attrs["FileFormatVersion"] = 5 if new else 3
        for monitor, factor in (("1044", 1.0), ("2011", 2.0)):
            top = f"Sensors/{monitor}" if new else f"SI-{monitor}"
            file[f"{top}/Time"] = stamps.astype(np.uint64)
            for name, values in names.items():
                file[f"{top}/{name}" if new else f"{top}/Calibrated/{name}s"] = factor * values
    assert reader_of(path) == "apdm"
    raw = open_stream(path, "imu")
    np.testing.assert_array_equal(triad(raw, "gyro"), RATE)
    np.testing.assert_array_equal(triad(raw, "accel"), FORCE)
    assert columns(raw)["time"][1] == "us" and raw.clock == "unix"
    first = next(f for f in raw.findings if f.code == "io.first-of-monitors")
    # All triads are those of the monitor whose gyro is asked for.
    found = find_columns(raw, ReadOptions(columns={"gyro": first.data["other"]}))
    for triad_name, values in (("gyro", RATE), ("accel", FORCE), ("mag", RATE)):
        held = [raw.columns[found[f"{triad_name}_{a}"].source] for a in "xyz"]
        np.testing.assert_array_equal(np.column_stack(held), 2.0 * values)
    # So they are if the file is read as any other of its kind.
    gyro = "Sensors/2011/Gyroscope" if new else "SI-2011/Calibrated/Gyroscopes"
    asked = {"gyro": gyro, "time": "Sensors/2011/Time" if new else "SI-2011/Time"}
    plain = find_columns(open_stream(path, "imu", "hdf5"), ReadOptions(columns=asked))
    assert all("2011" in plain[f"{t}_x"].source for t in ("gyro", "accel", "mag"))
    truncations(path, tmp_path, "imu")


# --- MicroStrain, RaceChrono, x-IMU3, Xsens ---------------------------------------------


def test_microstrain_with_gps_time(tmp_path):
    names = "GPS TFlags,GPS Week,GPS TOW," + ",".join(
        [f"{a} Accel [x8004]" for a in "XYZ"] + [f"{a} Gyro [x8005]" for a in "XYZ"]
    )
    tow = np.concatenate([604_799.7 + T[:30], T[:30]])
    week = np.repeat([2100.0, 2101.0], 30)
    lines = ["SESSION_NAME,walk", "SAMPLES,60", "", "DATA_START", names]
    path = written(
        tmp_path / "log.csv", [*lines, *rows(np.full(N, 7.0), week, tow, FORCE / 9.8, RATE)]
    )
    raw = open_stream(path, "imu")
    found = columns(raw)
    np.testing.assert_allclose(triad(raw, "gyro"), RATE)
    np.testing.assert_allclose(triad(raw, "accel"), FORCE / 9.8)
    assert found["accel_x"][1] == "g" and raw.clock == "gps-seconds-of-week"
    assert found["time"][0][30] == pytest.approx(604_800.0) and raw.rows[0] == 6
    truncations(path, tmp_path, "imu")


def test_sensor_connect_with_dates_and_increments(tmp_path):
    dates = [f"2019-03-12 15:23:42.{k:03d}000000" for k in range(0, 600, 10)]
    names = [f"6253.4220:delta{w}{a}" for w in ("Theta", "Vel") for a in "XYZ"]
    body = [
        f"{d},{r}" for d, r in zip(dates, rows(RATE * 0.01, FORCE * 0.01 / 9.80665), strict=True)
    ]
    path = written(tmp_path / "log.csv", ["DATA_START", "Time," + ",".join(names), *body])
    recording = read_log(path)
    np.testing.assert_allclose(recording.imu[GYRO].to_numpy()[1:, 2], 0.3, rtol=1e-6)
    assert recording.imu["accel_z"].iloc[-1] == pytest.approx(FORCE[-1, 2], rel=1e-6)


NAMES = "timestamp,lap_number,accuracy,altitude,bearing,latitude,longitude,speed,speed,"
NAMES += "x_acc,y_acc,z_acc,x_rate_of_rotation,y_rate_of_rotation,z_rate_of_rotation"
SOURCES = ",".join(["", "", *["100: gps"] * 6, "calc", *["101: acc"] * 3, *["102: gyro"] * 3])
RACE = f"""This file is created using RaceChrono v9.1.3 ( http://racechrono.com/ ).
Format,3
Session title,"Test, Track"

{NAMES}
unix time,,m,m,deg,deg,deg,m/s,m/s,G,G,G,deg/s,deg/s,deg/s
{SOURCES}
"""


def racechrono(path):
    lines = []
    for k in range(N):
        time = f"{1.7e9 + 0.01 * k:.3f},1"
        if k % 10 == 0:
            lines.append(f"{time},4,200,90.0,47.{k:02d},9.5,20.0,20.1,,,,,,")
        lines.append(f"{time},,,,,,,20.1,{FORCE[k, 0]},{FORCE[k, 1]},1.0,,,")
        lines.append(f"{time},,,,,,,20.1,,,,{RATE[k, 0]},{RATE[k, 1]},{RATE[k, 2]}")
    path.write_text(RACE + "\n".join(lines) + "\n")
    return path


def test_racechrono_takes_sensors_apart(tmp_path):
    path = racechrono(tmp_path / "session.csv")
    raw = open_stream(path, "imu")
    found = columns(raw)
    np.testing.assert_allclose(triad(raw, "gyro"), RATE)
    np.testing.assert_allclose(triad(raw, "accel")[:, 1], FORCE[:, 1])
    assert found["gyro_x"][1] == "deg/s" and found["accel_x"][1] == "g or -g" and raw.axes is None
    assert raw.clock == "unix" and raw.rows[0] == 10
    fixes = open_stream(path, "gnss")
    held = columns(fixes)
    np.testing.assert_allclose(held["lat"][0], [47.0, 47.1, 47.2, 47.3, 47.4, 47.5])
    # The altitude has no stated reference, so it is not over the ellipsoid.
    assert (
        "alt" not in held
        and set(held["alt_unstated"][0]) == {200.0}
        and set(held["speed"][0]) == {20.0}
    )
    assert held["horizontal_accuracy"][1] == "m"
    truncations(path, tmp_path, "imu")
    truncations(path, tmp_path, "gnss")


def test_racechrono_of_another_receiver_is_not_called_a_log_of_sensors(tmp_path):
    lines = [RACE.replace("100: gps", "200: obd").replace("102: gyro", "300: can").rstrip()]
    lines += [f"{1.7e9 + k:.3f},1,4,200,90.0,47.0,9.5,20.0,20.1,,,,1.0,2.0,3.0" for k in range(9)]
    path = written(tmp_path / "session.csv", lines)
    for stream in ("gnss", "imu"):
        with pytest.raises(DataError, check=coded("io.no-known-stream")):
            open_stream(path, stream)


def test_doubled_rows_of_an_x_imu3(recordings):
    path = recordings("zoo/xio/short_walk.csv")
    table = pd.read_csv(path).drop_duplicates()
    recording = read_log(path)
    assert len(recording.imu) == len(table)
    norm = np.sort(np.linalg.norm(recording.imu[GYRO].to_numpy(), axis=1))
    np.testing.assert_allclose(
        norm, np.sort(np.linalg.norm(np.radians(table.iloc[:, 1:4]), axis=1))
    )
    told = next(f for f in recording.findings if f.code == "io.rows-repeat-sample-before-stamp")
    assert told.data["repeated"] == 205 and told.row == 4


def test_a_folder_of_an_x_imu3(tmp_path):
    names = ["Timestamp (us)"] + [f"Gyroscope {a} (deg/s)" for a in "XYZ"]
    names += [f"Accelerometer {a} (g)" for a in "XYZ"]
    stamps = [str(1_000_000 + 10_000 * k) for k in range(N)]
    body = [f"{t},{r}" for t, r in zip(stamps, rows(RATE, FORCE / 9.8), strict=True)]
    written(tmp_path / "x" / "Inertial.csv", [",".join(names), *body])
    recording = read_log(tmp_path / "x", ReadOptions(axes="x,y,z"))
    np.testing.assert_allclose(recording.imu[GYRO].to_numpy(), np.radians(RATE))
    assert recording.imu.index[-1] - recording.imu.index[0] == pytest.approx(0.59)
    truncations(tmp_path / "x" / "Inertial.csv", tmp_path, "imu")


def test_an_empty_clock_of_xsens_leaves_the_counter(tmp_path):
    names = "PacketCounter\tSampleTimeFine\t" + "\t".join(
        [f"Acc_{a}" for a in "XYZ"] + [f"Gyr_{a}" for a in "XYZ"]
    )
    count = np.r_[65530:65536, 0:20, 22:40]  # wraps, and two packets are lost
    body = [
        f"{c:05d}\t\t" + "\t".join(f"{v:.6f}" for v in (*FORCE[k], *RATE[k]))
        for k, c in enumerate(count)
    ]
    path = written(
        tmp_path / "MT_1.txt", ["// Start Time: Unknown", "// Update Rate: 100.0Hz", names, *body]
    )
    recording = read_log(path, ReadOptions(axes="x,y,z"))
    steps = np.diff(recording.imu.index.to_numpy())
    np.testing.assert_allclose(np.sort(steps)[-2:], [0.01, 0.03], atol=1e-9)
    np.testing.assert_allclose(recording.imu[GYRO].to_numpy(), RATE[: len(count)], atol=1e-6)


def test_xsens_without_rates_says_what_is_missing(recordings):
    path = recordings("zoo/xsens_mtw/MT_012005D6_009-001_00B421ED.txt")
    with pytest.raises(DataError, check=coded("io.xsens-columns-missing")):
        open_stream(path, "imu")


# --- phones -----------------------------------------------------------------------------


def test_the_custom_experiment_of_phyphox(recordings):
    folder = recordings("zoo/sensorlogger_dr")
    assert reader_of(folder) == "phyphox"
    raw = open_stream(folder, "imu")
    gyro = pd.read_csv(folder / "Gyroscope.csv").to_numpy()
    np.testing.assert_array_equal(triad(raw, "gyro"), gyro[raw.rows - 2, 1:])
    assert np.linalg.norm(triad(raw, "accel").mean(axis=0)) == pytest.approx(9.8, abs=0.1)
    assert raw.axes == "y,x,-z"
    found = columns(open_stream(folder, "gnss"))
    table = pd.read_csv(folder / "Location.csv").to_numpy()
    np.testing.assert_array_equal(found["lat"][0], table[:, 1])
    np.testing.assert_array_equal(found["alt_msl"][0], table[:, 3])
    np.testing.assert_array_equal(found["vertical_accuracy"][0], table[:, 7])
    assert "alt" not in found
    with pytest.raises(DataError, check=coded("io.height-over-sea-column")):
        read_gnss(folder)
    with pytest.raises(NoStreamError):
        open_stream(folder / "Location.csv", "imu")
    with pytest.raises(NoStreamError):
        open_stream(folder / "Gyroscope.csv", "gnss")


def test_linear_acceleration_of_a_custom_experiment_is_not_specific_force(tmp_path):
    header = '"Time (s)","X ({0})","Y ({0})","Z ({0})"'
    written(tmp_path / "p" / "Gyroscope.csv", [header.format("rad/s"), *rows(T, RATE)])
    written(tmp_path / "p" / "Linear Accelerometer.csv", [header.format("m/s^2"), *rows(T, RATE)])
    written(tmp_path / "p" / "Pressure.csv", ['"Time (s)","Pressure (hPa)"', *rows(T, 1000 + T)])
    recording = read_log(tmp_path / "p")
    assert not set(ACCEL) & set(recording.imu.columns)
    assert any(f.code == "io.left-out-acceleration-without-gravity" for f in recording.findings)
    found = columns(open_stream(tmp_path / "p", "barometer"))
    assert found["pressure"][1] == "hPa"


LOCATION = "time,seconds_elapsed,bearingAccuracy,speedAccuracy,verticalAccuracy,horizontalAccuracy,"
LOCATION += "speed,bearing,altitude,longitude,latitude"
EPOCH = 1_707_663_721_345_109_200


def sensor_logger(folder):
    def table(values):
        return [
            f"{EPOCH + 10_000_000 * k},{T[k]},{z},{y},{x}" for k, (x, y, z) in enumerate(values)
        ]

    header = "time,seconds_elapsed,z,y,x"
    written(folder / "Gyroscope.csv", [header, *table(RATE)])
    written(folder / "Magnetometer.csv", [header, *table(RATE)])
    fixes = [
        f"{EPOCH + 10**9 * k},{k},5,0.5,3,{r},{v},90,500,9.5,47.5"
        for k, (r, v) in enumerate([(4, 2), (5, -1), (-1, 2)])
    ]
    written(folder / "Location.csv", [LOCATION, *fixes])
    written(
        folder / "Barometer.csv",
        ["time,seconds_elapsed,relativeAltitude,pressure", f"{EPOCH},0,0,1000.5"],
    )
    return folder


def test_locations_of_sensor_logger(tmp_path):
    folder = sensor_logger(tmp_path / "walk")
    fixes = read_gnss(folder, GnssOptions(unstated_position_sd=20.0, unstated_velocity_sd=1.0))
    np.testing.assert_allclose(fixes["alt"], 500.0)
    np.testing.assert_allclose(fixes["VE"].iloc[0], 2.0)
    assert fixes.attrs["clock"] == "unix"
    assert fixes.index[0] + fixes.attrs["clock_origin"] == pytest.approx(EPOCH * 1e-9, abs=1e-3)
    found = columns(open_stream(folder, "gnss"))
    assert found["time"][0].dtype.kind == "i" and found["speed_sd"][0][0] == 0.5
    assert columns(open_stream(folder, "barometer"))["pressure"][1] == "hPa"
    np.testing.assert_array_equal(triad(open_stream(folder, "magnetometer"), "mag"), RATE)
    assert reader_of(folder / "Location.csv") == "sensor-logger"
    with pytest.raises(NoStreamError):
        open_stream(folder / "Location.csv", "imu")
    truncations(folder / "Location.csv", tmp_path, "gnss")


def test_locations_of_sensor_logger_in_json(tmp_path):
    records = [
        {
            "sensor": "Location",
            "time": str(EPOCH + k),
            "latitude": "47.5",
            "longitude": "9.5",
            "altitude": "500",
        }
        for k in range(3)
    ]
    path = tmp_path / "walk.json"
    path.write_text(json.dumps(records))
    found = columns(open_stream(path, "gnss"))
    assert list(found["time"][0]) == [EPOCH, EPOCH + 1, EPOCH + 2]
    assert set(found["alt"][0]) == {500.0}


def test_locations_of_sensorlog_come_on_the_clock_of_its_sensors(tmp_path):
    names = [
        "loggingTime(txt)",
        "locationTimestamp_since1970(s)",
        "locationLatitude(WGS84)",
        "locationLongitude(WGS84)",
        "locationAltitude(m)",
        "motionTimestamp_sinceReboot(s)",
    ]
    names += [f"motionRotationRate{a}(rad/s)" for a in "XYZ"]
    start = pd.Timestamp("2021-04-14T13:33:42Z").timestamp()
    lines = []
    for k in range(N):
        wall = pd.Timestamp(start + 7200 + T[k], unit="s").strftime("%Y-%m-%d %H:%M:%S.%f")[:-3]
        lines.append(
            f"{wall},{start - 0.4 + (k // 20):.3f},47.5,9.5,500,{1000 + T[k]:.3f}," + rows(RATE)[k]
        )
    path = written(tmp_path / "log.csv", [",".join(names), *lines])
    raw = open_stream(path, "gnss")
    # The time of day is two hours ahead of UTC; fixes are as old as they say.
    np.testing.assert_allclose(columns(raw)["time"][0], 999.6 + np.arange(3), atol=2e-3)
    assert raw.clock == "relative" and "alt" not in columns(raw)


def test_core_motion_sums_gravity_and_user_acceleration(tmp_path):
    names = "timestamp(unix),rotation_rate_x(radians/s),rotation_rate_y(radians/s),"
    names += "rotation_rate_z(radians/s),gravity_x(G),gravity_y(G),gravity_z(G),"
    names += "user_acc_x(G),user_acc_y(G),user_acc_z(G)"
    gravity, user = np.tile([0.0, 0.0, -1.0], (N, 1)), np.tile([0.1, 0.0, 0.0], (N, 1))
    path = written(tmp_path / "a.csv", [names, *rows(1.6e9 + T, RATE, gravity, user)])
    assert reader_of(path) == "core-motion"
    recording = read_log(path)
    # The phone lies on its back: specific force is upward and along -x of the phone.
    force = recording.imu[ACCEL].to_numpy()
    np.testing.assert_allclose(force, np.tile([0.0, -0.980665, -9.80665], (N, 1)), atol=1e-9)
    np.testing.assert_allclose(recording.imu["gyro_z"], -RATE[:, 2])
    truncations(path, tmp_path, "imu")


def test_core_motion_without_stamps_needs_a_rate(tmp_path):
    names = [f"{v}.{a}" for v in ("gravity", "rotationRate", "userAcceleration") for a in "xyz"]
    gravity = np.tile([0.0, 0.0, -1.0], (N, 1))
    path = written(tmp_path / "a.csv", [",".join(names), *rows(gravity, RATE, 0 * RATE)])
    with pytest.raises(DataError, check=coded("io.time-column-missing")):
        read_log(path)
    assert read_log(path, ReadOptions(rate=50.0)).imu.index[1] == pytest.approx(0.02)


def test_physics_toolbox(tmp_path):
    names = "time,gFx,gFy,gFz,ax,ay,az,wx,wy,wz,p,Bx,By,Bz"
    force = np.tile([0.0, 0.0, 1.0], (N, 1))
    path = written(tmp_path / "a.csv", [names, *rows(T, force, 0 * RATE, RATE, 1000 + T, RATE)])
    assert reader_of(path) == "physics-toolbox"
    told = next(f for f in read_log(path).findings if f.code == "io.left-out-unusable")
    assert told.data["reason"].code == "io.file-leaves-open-whether"
    recording = read_log(path, ReadOptions(accel_unit="g"))
    np.testing.assert_allclose(recording.imu["accel_z"], -9.80665)
    np.testing.assert_allclose(recording.imu["gyro_x"], RATE[:, 1])
    assert columns(open_stream(path, "barometer"))["pressure"][1] == "hPa"
    body = [f"23:59:59:{990 + k}" if k < 10 else f"00:00:00:{k - 10:03d}" for k in range(N)]
    lines = [f"{t},{r}" for t, r in zip(body, rows(force, RATE), strict=True)]
    path = written(tmp_path / "b.csv", ["time,gFx,gFy,gFz,wx,wy,wz", *lines])
    np.testing.assert_allclose(
        np.diff(columns(open_stream(path, "imu"))["time"][0]), 0.001, atol=1e-9
    )
    truncations(path, tmp_path, "imu")


def events(kinds, *, swapped=False, header=None):
    lines = [header] if header else []
    for k in range(N):
        for kind, values in kinds.items():
            first = [kind, str(65_972_053_803_181 + 10_000_000 * k)]
            lines.append(
                ",".join(
                    [
                        *(first[::-1] if swapped else first),
                        *(repr(float(v)) for v in values[k]),
                        "3",
                    ]
                )
            )
    return lines


@pytest.mark.parametrize(
    ("gyro", "accel", "swapped", "header"),
    [
        ("4", "1", False, None),
        ("GYR", "ACC", True, "timestamp_ns,sensor,x,y,z,accuracy"),
        ("android.sensor.gyroscope", "android.sensor.accelerometer", False, None),
    ],
)
def test_android_events(tmp_path, gyro, accel, swapped, header):
    kinds = {gyro: RATE, accel: -FORCE, "5": RATE}
    path = written(tmp_path / "a.csv", events(kinds, swapped=swapped, header=header))
    assert reader_of(path) == "android-events"
    raw = open_stream(path, "imu")
    np.testing.assert_array_equal(triad(raw, "gyro"), RATE)
    np.testing.assert_array_equal(triad(raw, "accel"), -FORCE)
    found = columns(raw)
    assert found["time"][0][0] == 65_972_053_803_181
    assert found["time"][1] == ("ns" if header else None)
    # Loggers of other kinds write short names, too.
    android = gyro != "GYR"
    assert found["accel_x"][1] == ("m/s2" if android else None)
    assert raw.axes == ("y,x,-z" if android else None)
    assert "5" in next(f for f in raw.findings if f.code == "io.events-not-used").data["kinds"]
    imu = read_log(path, ReadOptions(gyro_unit="rad/s", accel_unit="m/s2", axes="y,x,-z")).imu
    assert imu["accel_z"].iloc[0] == pytest.approx(-9.8)
    assert imu.index[1] - imu.index[0] == pytest.approx(0.01)
    truncations(path, tmp_path, "imu")


@pytest.mark.parametrize(
    ("gyro", "accel"),
    [
        ("android.sensor.gyroscope", "android.sensor.accelerometer"),
        ("TYPE_GYROSCOPE (deg/s)", "TYPE_ACCELEROMETER (g)"),
        ("Gyroscope [deg/s]", "Accelerometer [g]"),
    ],
)
def test_android_events_in_degrees_and_g(tmp_path, gyro, accel):
    kinds = {gyro: np.degrees(RATE), accel: -FORCE / STANDARD_GRAVITY}
    path = written(tmp_path / "a.csv", events(kinds))
    assert reader_of(path) == "android-events"
    raw = open_stream(path, "imu")
    found, stated = columns(raw), "(" in gyro or "[" in gyro
    assert found["gyro_x"][1] == ("deg/s" if stated else None)
    assert found["accel_x"][1] == ("g" if stated else None)
    assert raw.axes == (None if gyro.startswith("Gyroscope") else "y,x,-z")
    options = ReadOptions(axes="y,x,-z", time_unit="ns")
    if not stated:
        with pytest.raises(DataError) as caught:
            read_log(path, options)
        assert "gyro_unit" in dict(caught.value.finding.data["answers"])
        options = dataclasses.replace(options, gyro_unit="deg/s", accel_unit="g")
    imu = read_log(path, options).imu
    np.testing.assert_allclose(imu[GYRO], RATE[:, [1, 0, 2]] * [1.0, 1.0, -1.0], atol=1e-15)
    np.testing.assert_allclose(imu[ACCEL], -FORCE[:, [1, 0, 2]] * [1.0, 1.0, -1.0])


def test_steps_of_a_sensor_in_deg_s_speak_against_the_unit_of_android(tmp_path):
    # At rest, gravity turns with no gyro; 0.061 rad/s would be the step of no sensor.
    rng, count, step = np.random.default_rng(8), 400, 2000.0 / 32768.0
    rate = np.round(step * np.round(rng.normal(0.0, 30.0, (count, 3))), 5)
    force = rng.normal((0.0, 0.0, 9.81), 0.02, (count, 3))

    def log(rate, names):
        lines = [
            f"{names[k]},{10_000_000 * row},{','.join(map(repr, values.tolist()))}"
            for row in range(count)
            for k, values in enumerate((rate[row], force[row]))
        ]
        return written(tmp_path / "a.csv", lines)

    android = ("android.sensor.gyroscope", "android.sensor.accelerometer")
    options = ReadOptions(time_unit="ns")
    recording = read_log(log(rate, android), options)
    np.testing.assert_allclose(recording.imu["gyro_x"], np.radians(rate[:, 1]))
    assert any(f.code == "io.unit-inferred" for f in recording.findings)
    recording = read_log(log(np.radians(rate), android), options)
    np.testing.assert_allclose(recording.imu["gyro_x"], np.radians(rate[:, 1]))
    assert not any(f.code == "io.unit-inferred" for f in recording.findings)
    stated = ("Gyroscope (rad/s)", "Accelerometer (m/s2)")
    with pytest.raises(DataError, check=coded("io.contradicts-unit")) as caught:
        read_log(log(rate, stated), options)
    assert dict(caught.value.finding.data["answers"]) == {"gyro_unit": "deg/s"}


def test_android_events_without_an_accelerometer_sum_or_warn(tmp_path):
    kinds = {"gyroscope": RATE, "gravity": -FORCE, "linear_acceleration": RATE}
    path = written(tmp_path / "a.csv", events(kinds))
    np.testing.assert_allclose(triad(open_stream(path, "imu"), "accel"), RATE - FORCE)
    del kinds["gravity"]
    raw = open_stream(written(tmp_path / "b.csv", events(kinds)), "imu")
    assert "accel_x" not in columns(raw)
    assert any(f.code == "io.left-out-without-gravity-no" for f in raw.findings)


@pytest.mark.parametrize(
    ("gyro", "accel", "separator", "header"),
    [("G", "A", ",", None), ("w", "f", " ", None), ("R", "A", ";", "time_ms;kind;x;y;z")],
)
def test_rows_of_two_sensors_by_a_letter(tmp_path, gyro, accel, separator, header):
    """Each at its own stamps: a quarter of a step apart, from a straight line through the force."""
    time, swing = 0.01 * np.arange(500), np.sin(0.03 * np.arange(500))
    rate = np.degrees(np.outer(swing, (0.3, -0.2, 0.5))) + 0.1
    force = np.column_stack([0.2 * time, 0.0 * time, 9.8 + 0.01 * time])
    rows = []
    for k in range(time.size):
        for kind, stamp, values in ((accel, 10 * k, force[k]), (gyro, 10 * k + 2.5, rate[k])):
            fields = [kind, f"{stamp:.1f}", *map(repr, values.tolist())]
            fields[:2] = fields[1::-1] if header else fields[:2]
            rows.append(separator.join(fields))
    path = written(tmp_path / "a.csv", [*([header] if header else []), *rows])
    assert reader_of(path) == "android-events"
    options = ReadOptions(gyro_unit="deg/s", accel_unit="m/s2", time_unit="ms")
    imu = read_log(path, options).imu
    assert len(imu) == time.size - 1
    np.testing.assert_allclose(imu[GYRO], np.radians(rate[:-1]), atol=1e-15)
    between = force[:-1] + 0.25 * np.diff(force, axis=0)
    np.testing.assert_allclose(imu[ACCEL], between, atol=1e-12)
    # Letters whose force is unsteady beside the rates are of something else.
    turned = [r.replace(gyro, "?").replace(accel, gyro).replace("?", accel) for r in rows]
    assert reader_of(written(tmp_path / "b.csv", turned)) == "csv"


def test_a_table_with_a_counter_is_no_log_of_events(tmp_path):
    names = "time,count,gyro_x,gyro_y,gyro_z"
    lines = [f"{1_000_000 + 10_000 * k},{k + 1},0.1,0.2,0.3" for k in range(20)]
    assert reader_of(written(tmp_path / "a.csv", [names, *lines])) == "csv"


def test_tables_of_matlab_mobile(tmp_path):
    dates = [f"14-Apr-2021 15:33:42.{10 * k:03d}" for k in range(N)]
    for name, values in (("AngularVelocity", RATE), ("Acceleration", -FORCE)):
        body = [f"{d},{r}" for d, r in zip(dates, rows(values), strict=True)]
        written(tmp_path / "m" / f"{name}.csv", ["Timestamp,X,Y,Z", *body])
    header = "Timestamp,latitude,longitude,altitude,speed,course,hacc"
    written(tmp_path / "m" / "Position.csv", [header, f"{dates[0]},47.5,9.5,500,1,90,4"])
    assert reader_of(tmp_path / "m") == "matlab-mobile"
    recording = read_log(tmp_path / "m")
    np.testing.assert_allclose(recording.imu["accel_z"], FORCE[:, 2])
    np.testing.assert_allclose(np.diff(recording.imu.index), 0.01, atol=1e-9)
    found = columns(open_stream(tmp_path / "m", "gnss"))
    assert "alt" not in found and found["alt_unstated"][0][0] == 500.0
    written(
        tmp_path / "m" / "AngularVelocity.csv",
        ["Timestamp,X,Y,Z", f"{dates[0]},1,2,3", "14-,1,2,3"],
    )
    with pytest.raises(DataError, check=coded("io.not-date-time-like-those", row=3)):
        read_log(tmp_path / "m")


def test_objects_of_matlab_are_refused_with_the_way_in(tmp_path, monkeypatch):
    path = tmp_path / "sensorlog_20210414.mat"
    savemat(path, {"a": np.arange(3.0)})
    monkeypatch.setattr(matlab, "whosmat", lambda _: [("None", (1,), "opaque")])
    with in_place(), pytest.raises(DataError, check=coded("io.matlab-objects")) as caught:
        open_stream(path, "imu")
    assert "writetimetable" in str(caught.value)


# --- JSON and Excel ---------------------------------------------------------------------


def objects():
    return [
        {
            "time": float(T[k]),
            "gyro": {a: RATE[k, j] for j, a in enumerate("xyz")},
            "accel": list(FORCE[k]),
        }
        for k in range(N)
    ]


@pytest.mark.parametrize("name", ["a.jsonl", "a.json", "a.ndjson"])
def test_json_of_samples(tmp_path, name):
    path = tmp_path / name
    whole = (
        json.dumps(objects()) if name == "a.json" else "\n".join(map(json.dumps, objects())) + "\n"
    )
    path.write_text(whole)
    assert reader_of(path) == "json"
    recording = read_log(path, ReadOptions(gyro_unit="rad/s", accel_unit="m/s2", axes="x,y,z"))
    np.testing.assert_allclose(recording.imu[GYRO].to_numpy(), RATE)
    np.testing.assert_allclose(recording.imu[ACCEL].to_numpy(), FORCE)
    truncations(path, tmp_path, "imu")


def test_a_broken_line_of_json_is_named(tmp_path):
    lines = [json.dumps(o) for o in objects()]
    lines[4] = lines[4][:-3]
    with pytest.raises(DataError, check=coded("io.no-json", row=5)):
        open_stream(written(tmp_path / "a.jsonl", lines), "imu")


def test_events_in_json(tmp_path):
    lines = []
    for k in range(N):
        stamp = 1_000_000_000_000 + 10_000_000 * k
        lines.append(
            json.dumps({"sensor": "gyroscope", "timestamp_ns": stamp, "values": list(RATE[k])})
        )
        force = dict(zip("xyz", (-FORCE[k]).tolist(), strict=True))
        lines.append(json.dumps({"sensor": "accelerometer", "timestamp_ns": stamp, **force}))
    raw = open_stream(written(tmp_path / "a.jsonl", lines), "imu")
    np.testing.assert_array_equal(triad(raw, "gyro"), RATE)
    np.testing.assert_array_equal(triad(raw, "accel"), -FORCE)
    assert columns(raw)["time"][1] == "ns"


def workbook(path):
    import openpyxl

    book = openpyxl.Workbook()
    book.active.title = "Notes"
    book.active.append(["recorded on a bench"])
    sheet = book.create_sheet("Data")
    sheet.append(
        ["time (s)", *(f"gyro_{a} (rad/s)" for a in "xyz"), *(f"accel_{a} (m/s2)" for a in "xyz")]
    )
    for row in np.column_stack([T, RATE, FORCE]).tolist():
        sheet.append(row)
    book.save(path)
    return path


def test_the_sheet_with_the_most_numbers(tmp_path):
    path = workbook(tmp_path / "a.xlsx")
    recording = read_log(path, ReadOptions(axes="x,y,z"))
    np.testing.assert_allclose(recording.imu[GYRO].to_numpy(), RATE, rtol=1e-15, atol=1e-15)
    np.testing.assert_allclose(recording.imu[ACCEL].to_numpy(), FORCE, rtol=1e-15, atol=1e-15)
    told = next(f for f in recording.findings if f.code == "io.sheet-read")
    assert told.data["names"] == ("Data",) and told.data["others"] == ("Notes",)
    truncations(path, tmp_path, "imu", 8)


def test_a_missing_library_of_excel_is_named(tmp_path, monkeypatch):
    path = workbook(tmp_path / "a.xlsx")

    real = importlib.import_module

    def missing(module):
        if module == "openpyxl":
            raise ImportError(module)
        return real(module)

    monkeypatch.setattr("importlib.import_module", missing)
    with (
        in_place(),
        pytest.raises(DataError, check=coded("io.library-missing", library="openpyxl")),
    ):
        open_stream(path, "imu")


def test_poses_of_kitti_odometry(tmp_path):
    """Ten meters a second to the east, then a turn to the right about the camera's own y, down."""
    time = 0.1 * np.arange(20)
    turn = np.radians(np.where(time < 1.0, 0.0, 30.0 * (time - 1.0)))
    rows = np.zeros((20, 3, 4))
    rows[:, 0, 0] = rows[:, 2, 2] = np.cos(turn)
    rows[:, 0, 2] = np.sin(turn)
    rows[:, 2, 0] = -np.sin(turn)
    rows[:, 1, 1] = 1.0
    rows[:, 2, 3] = 10.0 * time  # forward
    rows[:, 1, 3] = 0.5 * time  # down
    lines = [" ".join(f"{v:.9e}" for v in row.ravel()) for row in rows]
    said = ["# origin lat lon deg, height m: 49.0 8.4 116.0", "# roll pitch heading deg: 0 0 90"]
    path = written(tmp_path / "poses" / "00.txt", lines)
    assert reader_of(path) == "kitti-odometry"
    with pytest.raises(DataError, check=coded("io.poses-without-origin")):
        read_trajectory(path)
    written(path, [*said, *lines])
    with pytest.raises(DataError, check=coded("io.poses-without-times")):
        read_trajectory(path)
    written(tmp_path / "sequences" / "00" / "times.txt", [f"{t:e}" for t in time])
    track = read_trajectory(path)
    np.testing.assert_allclose(track.index, time, atol=1e-9)
    np.testing.assert_allclose(track["VE"], 10.0, rtol=1e-4)
    np.testing.assert_allclose(track["VN"], 0.0, atol=1e-3)
    np.testing.assert_allclose(track["alt"], 116.0 - 0.5 * time, atol=1e-4)
    np.testing.assert_allclose(track["heading"], 90.0 + np.degrees(turn), atol=1e-3)
    np.testing.assert_allclose(track[["roll", "pitch"]], 0.0, atol=1e-3)
    assert track["lon"].iloc[-1] > 8.4
    written(path, [*said, *lines[:5], lines[5].replace("1.000000000e+00", "2.0"), *lines[6:]])
    with pytest.raises(DataError, check=coded("io.pose-without-rotation", row=8)):
        read_trajectory(path)
    truncations(path, tmp_path, "reference", cuts=8)
