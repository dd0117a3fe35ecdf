"""What readers take columns for, by name, by statement, and by layout."""

from __future__ import annotations

import dataclasses

import h5py
import numpy as np
import pytest
from scipy.io import savemat

from strapdown import rotation
from strapdown.errors import ConfigError, DataError
from strapdown.formats import read_log
from strapdown.formats.columns import parse_axes, parse_column_option, read_name
from strapdown.formats.recording import ReadOptions
from strapdown.formats.references import read_truth
from strapdown.tables import ACCEL, GYRO, QUATERNION

TIME = np.arange(30) * 0.02
RATES = np.random.default_rng(2).normal(size=(30, 3))


@pytest.mark.parametrize(
    ("name", "quantity", "unit"),
    [
        ("time_s", "time", "s"),
        ("t", "time", None),
        ("Time (ms)", "time", "ms"),
        ("timestamp_ns", "time", "ns"),
        ("gyro_x_rad_s", "gyro_x", "rad/s"),
        ("Gyroscope x (rad/s)", "gyro_x", "rad/s"),
        ("gyr_y [dps]", "gyro_y", "deg/s"),
        ("wz", "gyro_z", None),
        ("omega_z [deg/s]", "gyro_z", "deg/s"),
        ("angular_velocity.x", "gyro_x", None),
        ("rotationRate_x_deg_s", "gyro_x", "deg/s"),
        ("acc_y [g]", "accel_y", "g"),
        ("accelerometer_z_m_s2", "accel_z", "m/s2"),
        ("ax (m/s^2)", "accel_x", "m/s2"),
        ("a_x (m/s²)", "accel_x", "m/s2"),
        ("q_w", "q_w", None),
        ("yaw_deg", "heading", "deg"),
        ("Roll [rad]", "roll", "rad"),
        ("linear_acceleration_x", "accel_x", None),  # used only where the numbers show gravity
        ("magnetometer_x", "mag_x", None),
        ("mag_y (µT)", "mag_y", "uT"),
        ("mz [mG]", "mag_z", "mG"),
        ("magnetic_field_z [G]", "mag_z", "gauss"),
        ("temperature", None, None),
    ],
)
def test_what_a_name_says(name, quantity, unit):
    said = read_name(name)
    assert (said.quantity, said.unit) == (quantity, unit)


def csv(path, header, columns, separator=",", decimal="."):
    lines = [separator.join(header)] if header else []
    for row in np.column_stack(columns):
        lines.append(separator.join(repr(float(v)).replace(".", decimal) for v in row))
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.mark.parametrize(
    ("separator", "decimal"), [(",", "."), (";", "."), (";", ","), ("\t", "."), ("   ", ".")]
)
def test_separators_and_decimal_marks(tmp_path, separator, decimal):
    path = csv(
        tmp_path / "log.csv",
        ["t_s", "wx_dps", "wy_dps", "wz_dps"],
        [TIME, RATES],
        separator,
        decimal,
    )
    imu = read_log(path).imu
    assert np.array_equal(imu.index, TIME)
    assert np.array_equal(imu[GYRO].to_numpy(), RATES * (np.pi / 180.0))


def test_without_a_header_columns_are_numbered(tmp_path):
    path = csv(tmp_path / "log.txt", None, [RATES, TIME], " ")
    options = ReadOptions(
        columns=parse_column_option(["time=4,gyro_x=1,gyro_y=2,gyro_z=3"]),
        gyro_unit="rad/s",
        time_unit="s",
    )
    log = read_log(path, options)
    assert np.array_equal(log.imu[GYRO].to_numpy(), RATES)
    assert [r.source for r in log.readings[1:]] == ["column 1", "column 2", "column 3"]


def test_what_the_user_says_goes_before_what_names_say(tmp_path):
    header = ["time_ms", "gyro_x_deg_s", "gyro_y_deg_s", "gyro_z_deg_s"]
    path = csv(tmp_path / "log.csv", header, [TIME, RATES])
    log = read_log(
        path,
        ReadOptions(gyro_unit="rad/s", time_unit="s", columns={"gyro_x": "gyro_y_deg_s"}),
    )
    assert np.array_equal(log.imu["gyro_x"], RATES[:, 1])
    assert np.array_equal(log.imu.index, TIME)


def test_axes_are_permuted_and_reversed_for_both_triads(tmp_path):
    header = ["time_s", "wx_rad_s", "wy_rad_s", "wz_rad_s", "ax_g", "ay_g", "az_g"]
    path = csv(tmp_path / "log.csv", header, [TIME, RATES, 2 * RATES])
    imu = read_log(path, ReadOptions(axes="y,x,-z")).imu
    turned = np.column_stack([RATES[:, 1], RATES[:, 0], -RATES[:, 2]])
    assert np.array_equal(imu[GYRO].to_numpy(), turned)
    assert np.allclose(imu[ACCEL].to_numpy(), 2 * 9.80665 * turned, rtol=1e-15)


def test_the_first_row_is_shown_as_read(tmp_path):
    path = csv(tmp_path / "log.csv", ["time_s", "wx_dps", "wy_dps", "wz_dps"], [TIME, RATES])
    readings = read_log(path, ReadOptions(axes="x,-y,-z")).readings
    assert [(r.source, r.quantity, r.unit, r.first) for r in readings] == [
        ("time_s", "time", "s", TIME[0]),
        ("wx_dps", "gyro_x", "deg/s", RATES[0, 0]),
        ("wy_dps", "-gyro_y", "deg/s", RATES[0, 1]),
        ("wz_dps", "-gyro_z", "deg/s", RATES[0, 2]),
    ]


def test_nanoseconds_of_1970_keep_their_differences(tmp_path):
    start = 1_700_000_000_123_456_789
    ticks = start + np.arange(30) * 5_000_001
    lines = ["time_ns,wx_rad_s,wy_rad_s,wz_rad_s"] + [f"{t},0,0,0.1" for t in ticks]
    (tmp_path / "log.csv").write_text("\n".join(lines) + "\n")
    imu = read_log(tmp_path / "log.csv").imu
    # A double of 1.7e18 is only good to 256 ns; counted from the first stamp nothing is lost.
    assert np.array_equal(imu.index, np.arange(30) * 5_000_001 * 1e-9)


def test_dates_of_iso_8601(tmp_path):
    lines = ["timestamp,wx_rad_s,wy_rad_s,wz_rad_s"]
    lines += [f"2026-03-29T00:59:59.{990 + k:03d}456Z,0,0,0.1" for k in range(10)]
    lines += [f"2026-03-29 01:00:00.{k:03d}456+00:00,0,0,0.1" for k in range(10)]
    (tmp_path / "log.csv").write_text("\n".join(lines) + "\n")
    imu = read_log(tmp_path / "log.csv").imu
    assert np.allclose(imu.index, np.arange(20) * 1e-3, atol=1e-12)
    lines[3] = "yesterday,0,0,0.1"
    (tmp_path / "log.csv").write_text("\n".join(lines) + "\n")
    with pytest.raises(DataError, match=r"row 4, time: 'yesterday' is not a date"):
        read_log(tmp_path / "log.csv")


def test_an_attitude_of_unknown_origin_is_no_truth(tmp_path):
    header = ["time_s", "wx_rad_s", "wy_rad_s", "wz_rad_s", "roll_deg", "pitch_deg", "yaw_deg"]
    path = csv(tmp_path / "log.csv", header, [TIME, RATES, RATES])
    log = read_log(path)
    assert log.truth is None
    assert any("its source are not stated" in f.what for f in log.findings)
    assert len(read_truth(path)) == 30


def test_a_log_without_stamps_takes_a_stated_rate(tmp_path):
    path = csv(tmp_path / "log.csv", ["wx_rad_s", "wy_rad_s", "wz_rad_s"], [RATES])
    with pytest.raises(
        DataError, check=lambda refused: refused.finding.code == "io.time-column-missing"
    ):
        read_log(path)
    assert np.array_equal(read_log(path, ReadOptions(rate=50.0)).imu.index, np.arange(30) / 50.0)


def test_repair_leaves_out_and_says_how_many(tmp_path):
    lines = ["time_s,wx_rad_s,wy_rad_s,wz_rad_s"]
    lines += [f"{0.01 * k:.2f},0.1,0.2,0.3" for k in range(20)]
    lines[5] = "0.04,nan,0.2,0.3"
    lines[9] = lines[8]
    lines[12] = "0.02,0.1,0.2,0.3"
    (tmp_path / "log.csv").write_text("\n".join(lines) + "\n")
    log = read_log(tmp_path / "log.csv", ReadOptions(repair=True))
    assert len(log.imu) == 17
    left_out = {f.code: f.data["count"] for f in log.findings if f.code.endswith("left-out")}
    assert left_out == {"io.rows-without-number-left-out": 1, "io.rows-not-later-left-out": 2}


def test_a_wrapped_counter_is_undone(tmp_path):
    ticks = (np.arange(100) * 700 + 65000) % 65536
    lines = ["time_ms,wx_rad_s,wy_rad_s,wz_rad_s"] + [f"{t},0,0,0.1" for t in ticks]
    (tmp_path / "log.csv").write_text("\n".join(lines) + "\n")
    imu = read_log(tmp_path / "log.csv", ReadOptions(repair=True)).imu
    assert np.allclose(np.diff(imu.index), 0.7, rtol=1e-12)


@pytest.mark.parametrize("layout", ["rows", "columns"])
@pytest.mark.parametrize("kind", ["v5", "v7.3"])
def test_matlab_of_both_kinds_and_both_layouts(tmp_path, kind, layout):
    path = tmp_path / "log.mat"
    block = RATES if layout == "rows" else RATES.T
    if kind == "v5":
        savemat(path, {"t": TIME, "gyro": block})
    else:
        with h5py.File(path, "w", userblock_size=512) as file:
            file["t"], file["gyro"] = TIME[None, :], block
    imu = read_log(path, ReadOptions(gyro_unit="deg/s")).imu
    assert np.array_equal(imu.index, TIME)
    assert np.array_equal(imu[GYRO].to_numpy(), RATES * (np.pi / 180.0))


def test_an_array_of_three_is_named_as_a_group(tmp_path):
    np.savez(tmp_path / "log.npz", stamp=TIME, body=RATES)
    options = ReadOptions(
        columns={"time": "stamp", "gyro": "body"}, gyro_unit="rad/s", time_unit="s"
    )
    assert np.array_equal(read_log(tmp_path / "log.npz", options).imu[GYRO].to_numpy(), RATES)


def test_three_columns_of_a_wider_array_must_be_chosen(tmp_path):
    np.savez(tmp_path / "log.npz", time_s=TIME, imu=np.hstack([9 + RATES, RATES]))
    with pytest.raises(ConfigError, match=r"\{\"gyro\": 'imu\[3\]'\}"):
        read_log(tmp_path / "log.npz", ReadOptions(columns={"gyro": "imu"}, gyro_unit="rad/s"))
    options = ReadOptions(columns={"gyro": "imu[3]", "accel": "imu[0]"}, gyro_unit="rad/s")
    without = read_log(tmp_path / "log.npz", options)
    assert list(without.imu.columns) == GYRO
    assert any("left out: the unit is not stated" in f.what for f in without.findings)
    log = read_log(tmp_path / "log.npz", dataclasses.replace(options, accel_unit="m/s2"))
    assert np.array_equal(log.imu[GYRO].to_numpy(), RATES)
    assert np.array_equal(log.imu[ACCEL].to_numpy(), 9 + RATES)


def test_a_comment_above_the_numbers_may_be_the_header(tmp_path):
    lines = [
        "# made by hand",
        "# gps_sow_s, gx_rad_s, gy_rad_s, gz_rad_s (nominal; not calibrated)",
    ]
    lines += [f"{243000.5 + t},0,0,0.1" for t in TIME]
    (tmp_path / "log.csv").write_text("\n".join(lines) + "\n")
    log = read_log(tmp_path / "log.csv")
    assert log.imu.index[0] == 243000.5
    assert log.readings[0].source == "gps_sow_s"


def test_a_rate_for_a_log_with_stamps_is_said_to_be_unused(tmp_path):
    path = csv(tmp_path / "log.csv", ["time_s", "wx_dps", "wy_dps", "wz_dps"], [TIME, RATES])
    log = read_log(path, ReadOptions(rate=10.0))
    assert np.array_equal(log.imu.index, TIME)
    assert any(f.code == "io.rate-not-used" for f in log.findings)


def synthetic_broad(path):
    """Layout of the BROAD data set (Laidig et al., Data 2021 6(7):72, section 3)."""
    q = rotation.quaternion_from_rotation_vector(np.cumsum(RATES, axis=0) * 0.01)
    q[:4] = np.nan
    with h5py.File(path, "w") as file:
        file.attrs["sampling_rate"] = 50.0
        file["imu_gyr"], file["imu_acc"] = RATES, RATES + np.array([0, 0, 9.8])
        file["opt_quat"] = q
        file["movement"] = np.arange(30) > 10
    return q


def test_broad_truth_is_turned_into_our_frames(tmp_path):
    q_enu = synthetic_broad(tmp_path / "synthetic.hdf5")
    log = read_log(tmp_path / "synthetic.hdf5")
    assert np.array_equal(log.imu.index, np.arange(30) / 50.0)
    assert log.scored.sum() == 19
    # A vector along the sensor's forward axis, seen in east-north-up and in north-east-down.
    ahead_enu = rotation.rotate(q_enu[4:], [1.0, 0.0, 0.0])
    ahead_ned = rotation.rotate(log.truth[QUATERNION].to_numpy(), [1.0, 0.0, 0.0])
    assert np.allclose(ahead_ned, ahead_enu[:, [1, 0, 2]] * [1, 1, -1], atol=1e-14)
    up_enu = rotation.rotate(q_enu[4:], [0.0, 0.0, 1.0])
    down_ned = rotation.rotate(log.truth[QUATERNION].to_numpy(), [0.0, 0.0, 1.0])
    assert np.allclose(down_ned, -up_enu[:, [1, 0, 2]] * [1, 1, -1], atol=1e-14)


def test_other_axes_turn_broad_truth_alike(tmp_path):
    """Errors must not depend on what the user calls forward."""
    synthetic_broad(tmp_path / "synthetic.hdf5")
    a = read_log(tmp_path / "synthetic.hdf5").truth[QUATERNION].to_numpy()
    b = (
        read_log(tmp_path / "synthetic.hdf5", ReadOptions(axes="y,x,-z"))
        .truth[QUATERNION]
        .to_numpy()
    )
    turn = rotation.rotation_angle(a, b)
    assert np.allclose(turn, turn[0], atol=1e-12)
    with pytest.raises(
        ConfigError, check=lambda refused: refused.finding.code == "io.truth-axes-mirrored"
    ):
        read_log(tmp_path / "synthetic.hdf5", ReadOptions(axes="x,y,-z"))


def test_the_unused_tail_of_a_buffer_is_left_out(tmp_path):
    """Layout of https://github.com/sunsided/sensor-fusion; synthetic numbers."""
    folder = tmp_path / "synthetic-mpu6050"
    folder.mkdir()
    buffer = np.zeros((4, 40))
    buffer[0, :30], buffer[1:, :30] = TIME + 0.5, RATES.T
    savemat(folder / "mpu6050_gyroscope.mat", {"gyroBuffer": buffer})
    log = read_log(folder)
    assert len(log.imu) == 30
    assert any("unfilled buffer" in f.what for f in log.findings)
    expected = RATES * [-1, 1, -1] * (np.pi / 180.0)
    assert np.array_equal(log.imu[GYRO].to_numpy(), expected)


@pytest.mark.parametrize("text", ["x,y", "x,y,y", "a,b,c", "x,--y,z", ""])
def test_axes_that_are_none(text):
    with pytest.raises(ConfigError):
        parse_axes(text)
