"""Layouts in which sensors and datasets are published; every log here is synthetic.

The sources of each layout stand in its reader. A body turns about three axes under gravity; what is
written is known, numbers are written with all their digits, and so must come back within the
rounding of a few operations.
"""

from __future__ import annotations

import h5py
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from tests.coded import coded

from strapdown import rotation
from strapdown.constants import STANDARD_GRAVITY
from strapdown.errors import DataError
from strapdown.formats import READERS, read_log
from strapdown.formats.gnss_files import GnssOptions, read_gnss
from strapdown.formats.recording import ReadOptions
from strapdown.formats.references import read_truth
from strapdown.formats.trajectory_readers import read_trajectory
from strapdown.tables import ACCEL, GYRO, MAG

N = 600
NS = 10_000_000  # between samples
T = np.arange(N) * NS * 1e-9
# Sensor axes x, y, z to a world x, y, z up.
TURN = Rotation.from_euler("zyx", np.column_stack([0.9 * T, 0.4 * np.sin(T), 0.3 * np.sin(2 * T)]))
RATE = np.vstack([(TURN[:-1].inv() * TURN[1:]).as_rotvec() / (NS * 1e-9), np.zeros(3)])
FORCE = TURN.inv().apply([0.0, 0.0, 9.81])
FIELD = TURN.inv().apply([20.0, 0.0, -43.0])
FLU = np.array([1.0, -1.0, -1.0])
START = 1_403_636_579_758_555_392
TIGHT = {"rtol": 1e-12, "atol": 1e-12}


def reader_of(path):
    return next(name for name, reader in READERS.items() if reader.detect(path))


def line(*values, between=","):
    return between.join(str(v.item() if hasattr(v, "item") else v) for v in values)


def phone(values):
    """Forward is the phone's y, right its x, down its -z."""
    return np.column_stack([values[:, 1], values[:, 0], -values[:, 2]])


def said(recording, words):
    return [f for f in recording.findings if words in f.what]


# --- EuRoC, TUM VI ----------------------------------------------------------------------

IMU = ["#timestamp [ns]"]
IMU += [f"w_RS_S_{a} [rad s^-1]" for a in "xyz"] + [f"a_RS_S_{a} [m s^-2]" for a in "xyz"]
TRUTH = ["#timestamp", " p_RS_R_x [m]", " p_RS_R_y [m]", " p_RS_R_z [m]"]
TRUTH += [f" q_RS_{a} []" for a in "wxyz"]


def mav0(folder, world=None, every=1):
    """Rates at every sample, poses at every so many of them."""
    turn = TURN if world is None else world * TURN
    q = turn.as_quat(scalar_first=True)
    imu = [",".join(IMU)] + [line(START + k * NS, *RATE[k], *FORCE[k]) for k in range(N)]
    truth = [",".join(TRUTH)]
    truth += [line(START + k * NS, 0.0, 0.0, 0.0, *q[k]) for k in range(100, N - 100, every)]
    for name, lines in (("imu0", imu), ("state_groundtruth_estimate0", truth)):
        (folder / "mav0" / name).mkdir(parents=True)
        (folder / "mav0" / name / "data.csv").write_text("\n".join(lines) + "\n")
    return folder / "mav0"


def test_euroc_table_and_folder(tmp_path):
    folder = mav0(tmp_path)
    for path in (folder, tmp_path, folder / "imu0", folder / "imu0" / "data.csv"):
        assert reader_of(path) == "asl"
        recording = read_log(path)
        np.testing.assert_allclose(recording.imu[GYRO], RATE, **TIGHT)
        np.testing.assert_allclose(recording.imu[ACCEL], FORCE, **TIGHT)
        np.testing.assert_allclose(recording.imu.index, T, **TIGHT)


@pytest.mark.parametrize("axes", [None, "x,-y,-z"])
def test_euroc_truth_turns_the_body_to_a_level_world(tmp_path, axes):
    folder = mav0(tmp_path)
    options = ReadOptions(axes=axes)
    recording = read_log(folder, options)
    assert len(recording.truth) == N - 200
    # Of a body at rest specific force in the world is gravity's reaction, straight up.
    q = recording.truth[["q_w", "q_x", "q_y", "q_z"]].to_numpy()
    up = rotation.rotate(q, recording.imu[ACCEL].to_numpy()[100 : N - 100])
    np.testing.assert_allclose(up, np.tile([0.0, 0.0, -9.81], (len(q), 1)), atol=1e-9)
    file = folder / "state_groundtruth_estimate0" / "data.csv"
    alone = read_truth(file, options, recording.origin)
    np.testing.assert_allclose(alone, recording.truth, atol=1e-9)


def test_euroc_truth_between_poses_is_interpolated(tmp_path):
    recording = read_log(mav0(tmp_path, every=2), ReadOptions(axes="x,-y,-z"))
    exact = read_log(mav0(tmp_path / "all"), ReadOptions(axes="x,-y,-z")).truth
    names = ["q_w", "q_x", "q_y", "q_z"]
    # The rate changes by less than 4 rad/s² here; over a step h of 20 ms a constant one leaves h²/8
    # of that in the middle.
    at = exact.loc[recording.truth.index, names]
    off = rotation.rotation_angle(recording.truth[names], at)
    assert 0.0 < off.max() < np.degrees(2e-4)


def test_euroc_truth_whose_z_is_not_up_is_left_out(tmp_path):
    recording = read_log(mav0(tmp_path, world=Rotation.from_euler("x", 90, degrees=True)))
    assert recording.truth is None
    assert said(recording, "is inclined by 90")


# --- Xsens ------------------------------------------------------------------------------

NAMES = [f"{t}_{a}" for t in ("Acc", "Gyr", "Mag") for a in "XYZ"]


def xsens(path, clock, stamps, top="// Update Rate: 100.0Hz\n", gyro=RATE):
    rows = ["\t".join([clock, *NAMES])]
    rows += [line(stamps[k], *FORCE[k], *gyro[k], *FIELD[k], between="\t") for k in range(N)]
    path.write_text("// Start Time: Unknown\n" + top + "\n".join(rows) + "\n")
    return path


@pytest.mark.parametrize(
    ("clock", "stamps"),
    [
        ("SampleTimeFine", np.arange(N) * 100),
        ("SampleTimeFine", (2**32 - 1000 + np.arange(N) * 100) % 2**32),
        ("PacketCounter", (65500 + np.arange(N)) % 65536),
    ],
)
def test_xsens_export(tmp_path, clock, stamps):
    path = xsens(tmp_path / "MT.txt", clock, stamps)
    assert reader_of(path) == "xsens"
    recording = read_log(path)
    np.testing.assert_allclose(recording.imu[GYRO], RATE, **TIGHT)
    np.testing.assert_allclose(recording.imu[ACCEL], FORCE, **TIGHT)
    np.testing.assert_allclose(recording.imu.index - recording.imu.index[0], T, atol=1e-9)
    assert bool(said(recording, "wrapped")) == (stamps[-1] < stamps[0])
    assert MAG[0] not in recording.imu


def test_xsens_packet_that_is_missing_is_a_gap(tmp_path):
    count = np.arange(N) + 7 * (np.arange(N) > 300)
    recording = read_log(xsens(tmp_path / "MT.txt", "PacketCounter", count))
    assert np.diff(recording.imu.index)[300] == pytest.approx(0.08)


def test_xsens_dot_counts_microseconds(tmp_path):
    path = xsens(
        tmp_path / "dot.txt", "SampleTimeFine", np.arange(N) * 10_000, gyro=np.degrees(RATE)
    )
    recording = read_log(path, ReadOptions(gyro_unit="deg/s"))
    np.testing.assert_allclose(recording.imu.index, T, atol=1e-9)
    np.testing.assert_allclose(recording.imu[GYRO], RATE, **TIGHT)


def test_xsens_clock_that_nothing_tells_is_asked(tmp_path):
    # 1000 ticks are 10 Hz of an MTi and 1000 Hz of a DOT.
    path = xsens(tmp_path / "MT.txt", "SampleTimeFine", np.arange(N) * 1000, top="")
    with pytest.raises(DataError, match="10 Hz in ticks of 100 µs or 1000 Hz in ticks of 1 µs"):
        read_log(path)


# --- SensorLog --------------------------------------------------------------------------


def three(kind, unit):
    return [f"{kind}{a}({unit})" for a in "XYZ"]


@pytest.mark.parametrize("split", [False, True])
def test_sensorlog_of_ios(tmp_path, split):
    # Core Motion has the sign opposite to specific force, in g.
    g = -FORCE / STANDARD_GRAVITY
    user = 0.1 * np.column_stack([np.sin(T), np.cos(T), T])
    names = ["loggingTime(txt)", "motionTimestamp_sinceReboot(s)"]
    names += three("motionRotationRate", "rad/s")
    names += three("motionUserAcceleration", "G") + three("motionGravity", "G")
    names += ["accelerometerTimestamp_sinceReboot(s)", *three("accelerometerAcceleration", "G")]
    names += three("motionMagneticField", "\u00b5T")
    rows = []
    for k in range(N):
        parts = (*user[k], *(g[k] - user[k])) if split else ("",) * 6
        when = f"2026-01-01T10:00:{T[k]:06.3f}+02:00"
        # Without a calibration the field is zero.
        field = FIELD[k] if split else (0.0, 0.0, 0.0)
        row = line(when, 5000.0 + T[k], *RATE[k], *parts, 5000.0 + T[k], *g[k], *field)
        rows += [row] * (2 if k % 50 == 0 else 1)
    if not split:
        names = [n for n in names if "User" not in n and "Gravity" not in n]
        rows = [row.replace(",,,,,,", "") for row in rows]
    path = tmp_path / "my_iOS_device.csv"
    path.write_text("\n".join([",".join(names), *rows]) + "\n")
    assert reader_of(path) == "sensorlog"
    recording = read_log(path)
    np.testing.assert_allclose(recording.imu[GYRO], phone(RATE), **TIGHT)
    np.testing.assert_allclose(recording.imu[ACCEL], phone(FORCE), atol=1e-12)
    assert (set(MAG) <= set(recording.imu)) == split
    if split:
        np.testing.assert_allclose(recording.imu[MAG], phone(FIELD), **TIGHT)
    assert said(recording, "12 of 612 rows repeat")


# --- GnssLogger -------------------------------------------------------------------------

ELAPSED = 65_972_053_803_181
BOOT = 1_619_650_832_445 * 1_000_000 - ELAPSED  # ns of 1970 at the start of the phone
LOGGER = """# Fix,Provider,LatitudeDegrees,LongitudeDegrees,AltitudeMeters,SpeedMps,AccuracyMeters,\
BearingDegrees,UnixTimeMillis,SpeedAccuracyMps,BearingAccuracyDegrees,elapsedRealtimeNanos,\
VerticalAccuracyMeters,MockLocation
# UncalGyro,utcTimeMillis,elapsedRealtimeNanos,UncalGyroXRadPerSec,UncalGyroYRadPerSec,\
UncalGyroZRadPerSec,DriftXRadPerSec,DriftYRadPerSec,DriftZRadPerSec
"""


def samples(kind, values, shift=0):
    out = []
    for k in range(N):
        at = ELAPSED + k * NS + shift
        out.append(line(kind, (BOOT + at) // 1_000_000, at, *values[k], 0.0, 0.0, 0.0))
    return out


def sensors():
    return samples("UncalGyro", RATE) + samples("UncalAccel", FORCE) + samples("UncalMag", FIELD)


def fix(second, provider="GPS"):
    at = ELAPSED + int(second * 1e9)
    utc = (BOOT + at) // 1_000_000 + 137  # of the satellites; the phone's clock is late
    place = (37.4 + 1e-5 * second, -122.1, 25.5)
    return line("Fix", provider, *place, 1.1, 4.53, 90.0, utc, 0.1, 5.0, at, 3.0, 0)


@pytest.mark.parametrize("table", [False, True])
def test_gnss_logger_and_smartphone_decimeter_challenge(tmp_path, table):
    top = (
        "MessageType,utcTimeMillis,elapsedRealtimeNanos,MeasurementX,MeasurementY,MeasurementZ,"
        "BiasX,BiasY,BiasZ\n"
        if table
        else LOGGER
    )
    path = tmp_path / ("device_imu.csv" if table else "gnss_log.txt")
    path.write_text(top + "\n".join(sensors()) + "\n")
    assert reader_of(path) == "gnss-logger"
    recording = read_log(path)
    np.testing.assert_allclose(recording.imu[GYRO], phone(RATE), **TIGHT)
    np.testing.assert_allclose(recording.imu[ACCEL], phone(FORCE), **TIGHT)
    np.testing.assert_allclose(recording.imu[MAG], phone(FIELD), **TIGHT)
    np.testing.assert_allclose(recording.imu.index, T, atol=1e-9)
    assert recording.imu.attrs["clock"] == "unix"


def test_gnss_logger_fixes_are_on_the_clock_of_its_sensors(tmp_path):
    path = tmp_path / "gnss_log.txt"
    fixes = [fix(1.0), fix(2.0), fix(2.5, "FLP"), fix(3.0)]
    path.write_text(LOGGER + "\n".join(sensors() + fixes) + "\n")
    table = read_gnss(path)
    assert len(table) == 3
    imu = read_log(path).imu
    # Stamps of the phone's clock are whole milliseconds, and a double holds them to 0.2 µs.
    since = table.index.to_numpy() - imu.attrs["clock_origin"]
    np.testing.assert_allclose(since, [1.0, 2.0, 3.0], atol=1e-6)
    np.testing.assert_allclose(table["lat"], 37.4 + 1e-5 * np.array([1.0, 2.0, 3.0]), atol=1e-12)
    # 68 % of a circular normal distribution lie within 1.5096 standard deviations.
    np.testing.assert_allclose(table["north_sd"], 4.53 / 1.5096, rtol=1e-4)
    np.testing.assert_allclose(table["down_sd"], 3.0)
    assert any(
        "3 of 4 fixes are used, of gps; not those of flp" in f.what for f in table.attrs["findings"]
    )


def test_ground_truth_of_the_challenge_asks_how_well_it_is_known(tmp_path):
    top = "MessageType,Provider,LatitudeDegrees,LongitudeDegrees,AltitudeMeters,SpeedMps,"
    top += "AccuracyMeters,BearingDegrees,UnixTimeMillis\n"
    rows = [line("Fix", "GT", 37.4, -122.1, 33.2, 1.0, "", 0.5, 1_619_650_832_000 + 1000 * k)
            for k in range(5)]  # fmt: skip
    path = tmp_path / "ground_truth.csv"
    path.write_text(top + "\n".join(rows) + "\n")
    with pytest.raises(
        DataError, check=lambda refused: refused.finding.code == "io.position-sd-not-stated"
    ):
        read_gnss(path)
    table = read_gnss(path, GnssOptions(position_sd=0.1))
    np.testing.assert_allclose(np.diff(table.index), 1.0, atol=1e-6)
    assert np.isinf(table["VN_sd"]).all()


# --- KITTI ------------------------------------------------------------------------------


def kitti(folder):
    data = folder / "oxts" / "data"
    data.mkdir(parents=True)
    stamps = [f"2011-09-26 13:02:{t:012.9f}" for t in T]
    (folder / "oxts" / "timestamps.txt").write_text("\n".join(stamps) + "\n")
    roll_pitch_yaw = TURN.as_euler("ZYX")[:, ::-1]
    for k in range(N):
        row = [49.0 + 1e-6 * k, 8.4, 112.8, *roll_pitch_yaw[k], 1.0, 2.0, 0.0, 0.0, 0.5]
        row += [*FORCE[k], 0.0, 0.0, 0.0, *RATE[k], 0.0, 0.0, 0.0, 0.05, 0.02, 4, 10, 4, 4, 0]
        (data / f"{k:010d}.txt").write_text(line(*row, between=" ") + "\n")
    return folder


def test_kitti_oxts(tmp_path):
    folder = kitti(tmp_path / "drive")
    for path in (folder, folder / "oxts"):
        assert reader_of(path) == "kitti"
    recording = read_log(folder)
    np.testing.assert_allclose(recording.imu[GYRO], RATE * FLU, **TIGHT)
    np.testing.assert_allclose(recording.imu[ACCEL], FORCE * FLU, **TIGHT)
    # East, north, up to north, east, down, and forward, left, up to forward, right, down.
    C_ne, C_sb = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]]), np.diag(FLU)
    names = ["q_w", "q_x", "q_y", "q_z"]
    C_nb = rotation.dcm_from_quaternion(recording.truth[names])
    np.testing.assert_allclose(C_nb, C_ne @ TURN.as_matrix() @ C_sb, atol=1e-12)
    trajectory = read_trajectory(folder)
    euler = rotation.euler_from_dcm(C_nb)
    np.testing.assert_allclose(trajectory[["roll", "pitch"]], euler[:, :2], atol=1e-9)
    turned = (trajectory["heading"].to_numpy() - euler[:, 2] + 180.0) % 360.0 - 180.0
    np.testing.assert_allclose(turned, 0.0, atol=1e-9)
    fixes = read_gnss(folder / "oxts")
    np.testing.assert_allclose(fixes[["VN", "VE", "VD"]], np.tile([1.0, 2.0, -0.5], (N, 1)))
    np.testing.assert_allclose(fixes[["north_sd", "VD_sd"]], np.tile([0.05, 0.02], (N, 1)))
    assert "independent" in fixes.attrs["findings"][0].what


def test_kitti_file_that_is_cut(tmp_path):
    folder = kitti(tmp_path / "drive")
    (folder / "oxts" / "data" / f"{17:010d}.txt").write_text("49.0 8.4")
    with pytest.raises(DataError, check=coded("io.fields-numbers-expected", count=2, fields=30)):
        read_log(folder)


# --- RoNIN ------------------------------------------------------------------------------


def test_ronin(tmp_path):
    path = tmp_path / "data.hdf5"
    with h5py.File(path, "w") as file:
        file["synced/time"], file["synced/gyro"], file["synced/acce"] = 5000.0 + T, RATE, FORCE
        file["synced/magnet"] = FIELD
        file["raw/imu/gyro"] = np.ones((2 * N, 4))
        file["pose/tango_ori"] = TURN.as_quat(scalar_first=True)
    assert reader_of(path) == "ronin"
    recording = read_log(path)
    np.testing.assert_allclose(recording.imu[GYRO], phone(RATE), **TIGHT)
    np.testing.assert_allclose(recording.imu[ACCEL], phone(FORCE), **TIGHT)
    np.testing.assert_allclose(recording.imu[MAG], phone(FIELD), **TIGHT)
    assert recording.truth is None
    assert said(recording, "another phone, on the chest")
