"""What is written, by the readers of other libraries, and by the descriptions of the formats."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

import numpy as np
import pandas as pd
import pytest
from tests.contracts.test_writers import FIRST_NS, ROWS, streams

from strapdown.formats.writers import WRITERS
from strapdown.tables import ACCEL, GYRO
from strapdown.tables.checks import GEODETIC, POSITION_SD, VELOCITY, VELOCITY_SD

FIRST = datetime(1970, 1, 1, tzinfo=UTC) + timedelta(microseconds=FIRST_NS // 1000)


@pytest.fixture(scope="module")
def made():
    """Eight degrees a second to the right at 5 m/s: in axes to the left and up, negative."""
    return streams()


def test_gpxpy_reads_the_track(tmp_path, made):
    gpxpy = pytest.importorskip("gpxpy")
    WRITERS["gpx"].write(tmp_path / "a.gpx", {"gnss": made["gnss"]})
    points = gpxpy.parse((tmp_path / "a.gpx").read_text()).tracks[0].segments[0].points
    assert len(points) == len(made["gnss"])
    for point, (_, row) in zip(points, made["gnss"].iterrows(), strict=True):
        assert [point.latitude, point.longitude, point.elevation] == row[GEODETIC].tolist()
    # GPX 1.1 has speed and course in an extension, which gpxpy leaves as XML.
    moves = [{e.tag.rpartition("}")[2]: e.text for e in p.extensions[0]} for p in points]
    assert [float(m["speed"]) for m in moves] == pytest.approx([5.0] * len(points))
    assert [float(m["course"]) for m in moves[:2]] == pytest.approx([350.0, 351.6], abs=0.1)
    assert abs(points[0].time - FIRST) <= timedelta(microseconds=1)


def test_pynmeagps_reads_the_sentences(tmp_path, made):
    pynmeagps = pytest.importorskip("pynmeagps")
    gnss = made["gnss"]
    WRITERS["nmea"].write(tmp_path / "a.nmea", {"gnss": gnss})
    found: dict[str, list] = {"GGA": [], "RMC": [], "GST": []}
    with (tmp_path / "a.nmea").open("rb") as stream:
        # Every checksum is validated.
        for _, message in pynmeagps.NMEAReader(stream, quitonerror=2):
            found[message.msgID].append(message)
    assert {len(v) for v in found.values()} == {len(gnss)}
    gga, rmc, gst = (found[k][0] for k in found)
    first = gnss.iloc[0]
    assert [gga.lat, gga.lon] == pytest.approx(first[["lat", "lon"]].tolist(), abs=1e-9)
    assert (gga.alt + gga.sep, gga.quality) == pytest.approx((first["alt"], first["quality"]), 1e-6)
    assert datetime.combine(rmc.date, rmc.time, UTC) == FIRST.replace(microsecond=123457)
    assert (rmc.spd * 1852 / 3600, rmc.cog) == pytest.approx((5.0, 350.0), abs=1e-4)
    assert [gst.stdLat, gst.stdLong, gst.stdAlt] == pytest.approx(
        first[POSITION_SD].tolist(), abs=1e-6
    )


def test_rosbags_reads_the_messages(tmp_path, made):
    highlevel = pytest.importorskip("rosbags.highlevel")
    typesys = pytest.importorskip("rosbags.typesys")
    WRITERS["mcap"].write(tmp_path / "a.mcap", {k: made[k] for k in WRITERS["mcap"].streams})
    store = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
    topics: dict[str, list] = {}
    times = []
    with highlevel.AnyReader([tmp_path / "a.mcap"], default_typestore=store) as bag:
        for connection, at, data in bag.messages():
            times.append(at)
            topics.setdefault(connection.topic, []).append(
                bag.deserialize(data, connection.msgtype)
            )
    assert times == sorted(times)
    counts = {topic: len(messages) for topic, messages in topics.items()}
    assert counts == {
        "/imu/data_raw": ROWS,
        "/imu/mag": ROWS,
        "/gnss/fix": len(made["gnss"]),
        "/gnss/vel": len(made["gnss"]),
        "/air_pressure": len(made["barometer"]),
    }
    imu = topics["/imu/data_raw"][0]
    stamp = imu.header.stamp
    assert (stamp.sec * 10**9 + stamp.nanosec, imu.header.frame_id) == (FIRST_NS, "base_link")
    assert imu.linear_acceleration.z == -made["imu"][ACCEL[2]].iloc[0] > 9.0
    assert imu.angular_velocity.z == -made["imu"][GYRO[2]].iloc[0] < -0.1
    assert imu.orientation_covariance[0] == -1.0
    fix, velocity = topics["/gnss/fix"][1], topics["/gnss/vel"][1]
    row = made["gnss"].iloc[1]
    assert [fix.latitude, fix.longitude, fix.altitude] == row[GEODETIC].tolist()
    assert np.sqrt(fix.position_covariance[[4, 0, 8]]) == pytest.approx(row[POSITION_SD].tolist())
    linear = velocity.twist.twist.linear
    assert [linear.y, linear.x, -linear.z] == row[VELOCITY].tolist()
    covariance = velocity.twist.covariance[[7, 0, 14]]
    assert np.sqrt(covariance) == pytest.approx(row[VELOCITY_SD].tolist())
    # The field points down and north: in axes to the left and up, z is negative.
    assert topics["/imu/mag"][0].magnetic_field.z < -30e-6
    assert topics["/air_pressure"][0].fluid_pressure == made["barometer"]["pressure"].iloc[0]


def test_pandas_reads_euroc(tmp_path, made):
    WRITERS["euroc"].write(tmp_path / "out", {k: made[k] for k in ("imu", "reference")})
    table = pd.read_csv(tmp_path / "out" / "mav0" / "imu0" / "data.csv")
    assert list(table.columns[:2]) == ["#timestamp [ns]", "w_RS_S_x [rad s^-1]"]
    assert table.iloc[0, 0] == FIRST_NS
    assert np.array_equal(table.iloc[:, 1:], made["imu"][[*GYRO, *ACCEL]])
    truth = pd.read_csv(tmp_path / "out" / "mav0" / "state_groundtruth_estimate0" / "data.csv")
    assert truth.columns[1] == "p_RS_R_x [m]"
    assert truth.shape == (ROWS, 11)


def test_kitti_by_its_description(tmp_path, made):
    WRITERS["kitti"].write(tmp_path / "a", {k: made[k] for k in ("imu", "reference")})
    files = sorted((tmp_path / "a" / "oxts" / "data").iterdir())
    rows = np.array([np.loadtxt(f) for f in files])
    assert rows.shape == (ROWS, 30)
    lines = (tmp_path / "a" / "oxts" / "timestamps.txt").read_text().splitlines()
    assert lines[0] == "2026-02-03 11:22:33.123456789"
    # lat lon alt roll pitch yaw vn ve vf vl vu ax ay az af al au wx wy wz wf wl wu ...
    assert rows[0, :3].tolist() == made["reference"][GEODETIC].iloc[0].tolist()
    roll, pitch, yaw = rows[0, 3:6]
    # Roll 3 deg with the left side up, the nose 2 deg down (positive), yaw from east to north.
    assert np.degrees([roll, pitch, yaw]) == pytest.approx([3.0, 2.0, 100.0])
    assert rows[:, 8] == pytest.approx(5.0)
    assert rows[:, 9] == pytest.approx(0.0, abs=1e-12)
    assert rows[:, 10] == pytest.approx(0.1)
    assert (rows[:, 13] > 9.5).all()
    # Level axes: gravity is up alone, but for the noise of 0.02 m/s², five times.
    assert rows[:, 14:16] == pytest.approx(0.0, abs=0.1)
    assert rows[:, 16] == pytest.approx(9.81, abs=0.1)
    assert rows[:, 19] == pytest.approx(-np.radians(8.0), abs=5e-3)
    # Rz(yaw) Ry(pitch) Rx(roll) rotates the specific force upright.
    force = rows[0, 11:14]
    cr, sr, cp, sp = np.cos(roll), np.sin(roll), np.cos(pitch), np.sin(pitch)
    turned = np.array([[cp, sp * sr, sp * cr], [0, cr, -sr], [-sp, cp * sr, cp * cr]]) @ force
    assert turned == pytest.approx(rows[0, 14:17])


def test_tum_by_its_description(tmp_path, made):
    WRITERS["tum"].write(tmp_path / "a.tum", {"reference": made["reference"]})
    lines = (tmp_path / "a.tum").read_text().splitlines()
    first = next(line for line in lines if not line.startswith("#"))
    assert first.split()[0] == "1770117753.123456789"
    rows = np.loadtxt(tmp_path / "a.tum")
    assert rows.shape == (ROWS, 8)
    # North-west at first, then to the right, and up by 0.1 m/s.
    assert rows[5, 2] > 0.0 > rows[5, 1]
    assert rows[-1, 3] == pytest.approx(0.1 * made["reference"].index[-1], abs=1e-4)
    x, y, z, w = rows[0, 4:]
    yaw = np.degrees(np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)))
    assert yaw == pytest.approx(100.0)


def test_kf_gins_by_its_description(tmp_path, made):
    tables = {k: made[k] for k in ("imu", "gnss", "reference")}
    tables["imu"].attrs["sampling"] = "mean"
    WRITERS["kf-gins"].write(tmp_path / "out", tables)
    tables["imu"].attrs["sampling"] = "instantaneous"
    imu, gnss, truth = (
        np.loadtxt(tmp_path / "out" / f) for f in ("imu.txt", "gnss.txt", "truth.nav")
    )
    # 18 leap seconds after the same time of day on Tuesday, the third day of a week of GPS.
    sow = 2 * 86400 + 11 * 3600 + 22 * 60 + 33.123456789 + 18.0
    assert (imu[0, 0], gnss[0, 0]) == pytest.approx((sow, sow), abs=1e-9)
    assert truth[0, :2] == pytest.approx([2404, sow], abs=1e-8)
    step = np.diff(imu[:, 0])
    assert imu[1:, 6].sum() / step.sum() == pytest.approx(-9.8, abs=0.1)
    assert imu[1:, 3].sum() / step.sum() == pytest.approx(np.radians(8.0), abs=1e-3)
    assert gnss.shape[1] == 13
    assert truth[0, 8:] == pytest.approx([3.0, -2.0, 350.0])
