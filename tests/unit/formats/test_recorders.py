"""Logs of autopilots, bags and receivers: files made from the public layouts, and recorded ones.

Expected values come from the layout (struct, by hand) or from the library's own reading.
"""

from __future__ import annotations

import importlib
import struct
from datetime import UTC, datetime

import numpy as np
import pytest
from tests.coded import coded

from strapdown.errors import ConfigError, DataError
from strapdown.formats import (
    READERS,
    NoStreamError,
    ReadOptions,
    ardupilot,
    novatel,
    open_stream,
    px4,
    read_log,
    receivers,
    ros,
)
from strapdown.formats.gnss_files import GnssOptions, read_gnss
from strapdown.formats.trajectory_readers import read_trajectory
from strapdown.parsers import in_place

G = 9.80665


def kind(path):
    return next(name for name, reader in READERS.items() if reader.detect(path))


def written(path, data):
    path.write_bytes(data)
    return path


# PX4


def ulog(messages, parameters=()):
    """A ULog of (name, fields with types, rows)."""

    def one(letter, body):
        return struct.pack("<HB", len(body), ord(letter)) + body

    out = px4.MAGIC + b"\x01" + struct.pack("<Q", 0)
    out += one("B", bytes(40))
    for name, fields, _ in messages:
        out += one("F", f"{name}:{''.join(f'{t} {n};' for n, t in fields)}".encode())
    for name, value in parameters:
        key = f"float {name}".encode()
        out += one("P", bytes([len(key)]) + key + struct.pack("<f", value))
    codes = {"uint64_t": "Q", "int32_t": "i", "uint32_t": "I", "uint8_t": "B", "bool": "?"}
    codes |= {"float": "f", "double": "d"}
    for k, (name, _, _) in enumerate(messages):
        out += one("A", struct.pack("<BH", 0, k) + name.encode())
    for k, (_, fields, rows) in enumerate(messages):
        form = "<H"
        for _, t in fields:
            base, _, count = t.partition("[")
            form += (count.rstrip("]") or "1") + codes[base]
        for row in rows:
            out += one("D", struct.pack(form, k, *row))
    return out


COMBINED = [("timestamp", "uint64_t"), ("gyro_rad", "float[3]"), ("gyro_integral_dt", "uint32_t")]
COMBINED += [("accelerometer_timestamp_relative", "int32_t"), ("accelerometer_m_s2", "float[3]")]
COMBINED += [("accelerometer_integral_dt", "uint32_t")]
TAIL = [("s_variance_m_s", "float"), ("eph", "float"), ("epv", "float")]
TAIL += [(f"vel_{a}_m_s", "float") for a in "ned"]
TAIL += [("fix_type", "uint8_t"), ("vel_ned_valid", "bool")]
OLD = [("timestamp", "uint64_t"), *((n, "int32_t") for n in ("lat", "lon", "alt", "alt_ellipsoid"))]
NEW = [("timestamp", "uint64_t"), ("latitude_deg", "double"), ("longitude_deg", "double")]
NEW += [("altitude_msl_m", "double"), ("altitude_ellipsoid_m", "double")]
STATE = (0.5, 1.5, 2.5, 1.0, 2.0, 3.0)


def combined(late=0, step=4000, dt=4000):
    return [
        (step * (k + 1), 0.1, 0.2, 0.3 + k, dt, late, 1.0, 2.0, -G + 0.01 * k, dt)
        for k in range(50)
    ]


def flight(tmp_path, **options):
    fixes = [
        (200_000 * (k + 1), 473_977_418 + k, 85_455_939, 488_000, 535_310, *STATE, f, True)
        for k, f in enumerate((1, 3, 4, 6))
    ]
    return written(
        tmp_path / "flight.ulg",
        ulog(
            [
                ("sensor_combined", COMBINED, combined(**options)),
                ("vehicle_gps_position", OLD + TAIL, fixes),
            ],
            [("EKF2_GPS_DELAY", 110.0)],
        ),
    )


def test_px4_body_axes_means_and_microseconds(tmp_path):
    path = flight(tmp_path)
    assert kind(path) == "px4"
    raw = px4.read(path)
    assert (raw.axes, raw.sampling, raw.clock) == ("x,y,z", "mean", "relative")
    assert raw.columns["time"].dtype.kind == "i"
    imu = read_log(path).imu
    assert imu.index[1] - imu.index[0] == pytest.approx(0.004)
    np.testing.assert_allclose(imu.iloc[0], [0.1, 0.2, 0.3, 1.0, 2.0, -G], rtol=1e-6)


def test_px4_increments_of_vehicle_imu(tmp_path):
    fields = [("timestamp", "uint64_t"), ("timestamp_sample", "uint64_t")]
    fields += [("delta_angle", "float[3]"), ("delta_velocity", "float[3]")]
    fields += [("delta_angle_dt", "uint32_t"), ("delta_velocity_dt", "uint32_t")]
    rows = [
        (5000 * k + 90, 5000 * k, 5e-4, 0.0, 1e-3, 0.0, 5e-3, -G * 0.004, 5000, 4000)
        for k in range(1, 9)
    ]
    imu = read_log(written(tmp_path / "imu.ulg", ulog([("vehicle_imu", fields, rows)]))).imu
    np.testing.assert_allclose(imu.iloc[0], [0.1, 0.0, 0.2, 0.0, 1.25, -G], rtol=1e-6)
    assert imu.attrs["sampling"] == "mean"
    assert imu.index[0] == pytest.approx(0.005)


def test_px4_accelerometer_on_its_own_stamps_is_interpolated(tmp_path):
    raw = px4.read(flight(tmp_path, late=-2000))
    # Half a sample later than written: between two values 0.01 apart.
    np.testing.assert_allclose(
        raw.columns["flight.ulg/accel_z"][:3], -G + 0.01 * np.arange(3) + 0.005, atol=1e-5
    )


def test_px4_a_thinned_log_is_not_called_means(tmp_path):
    raw = px4.read(flight(tmp_path, step=20_000))
    assert raw.sampling == "instantaneous"
    assert raw.findings[-1].code == "io.means-of-a-part"
    assert raw.findings[-1].data["share"] == pytest.approx(0.2)


def test_px4_fixes_in_old_and_new_fields_agree(tmp_path):
    old = read_gnss(flight(tmp_path))
    rows = [
        (200_000 * (k + 1), (473_977_418 + k) * 1e-7, 8.5455939, 488.0, 535.31, *STATE, f, True)
        for k, f in enumerate((1, 3, 4, 6))
    ]
    path = written(tmp_path / "new.ulg", ulog([("sensor_gps", NEW + TAIL, rows)]))
    new = read_gnss(path)
    np.testing.assert_allclose(old, new, rtol=1e-12)
    assert old.index.tolist() == pytest.approx([0.4, 0.6, 0.8])
    first = old.iloc[0]
    assert first["lat"] == pytest.approx(47.3977419, abs=1e-12)
    assert first["alt"] == pytest.approx(535.31)
    assert first[["VN", "VE", "VD"]].tolist() == [1.0, 2.0, 3.0]
    assert first["VN_sd"] == 0.5
    assert first["down_sd"] == pytest.approx(2.5)
    assert first["north_sd"] == pytest.approx(1.5 / np.sqrt(-2 * np.log(0.32)))
    assert old["quality"].tolist() == [1, 2, 4]
    late = [f for f in old.attrs["findings"] if f.code == "io.fixes-late-by-parameter"]
    assert late[0].data["delay"] == 110.0


def test_px4_own_solution(tmp_path):
    place = [("timestamp", "uint64_t"), ("lat", "double"), ("lon", "double"), ("alt", "float")]
    local = [("timestamp", "uint64_t"), ("vx", "float"), ("vy", "float"), ("vz", "float")]
    q = [("timestamp", "uint64_t"), ("q", "float[4]")]
    half = np.radians(45.0)  # of a heading of 90 deg
    messages = [
        ("vehicle_global_position", place, [(10**6 * k, 47.0, 8.0, 488.0) for k in (1, 2, 3)]),
        ("vehicle_local_position", local, [(10**6 * k, 1.0 * k, 2.0, 3.0) for k in (1, 3)]),
        (
            "vehicle_attitude",
            q,
            [(10**6 * k, np.cos(half), 0.0, 0.0, np.sin(half)) for k in (1, 4)],
        ),
    ]
    path = written(tmp_path / "solution.ulg", ulog(messages))
    with pytest.raises(DataError, check=coded("io.reference-height-over-sea")):
        read_trajectory(path)
    fixes = [(10**6, 470_000_000, 80_000_000, 488_000, 536_000, *STATE, 3, True)]
    path.write_bytes(ulog([*messages, ("vehicle_gps_position", OLD + TAIL, fixes)]))
    table = read_trajectory(path)
    assert table["alt"].tolist() == [536.0] * 3
    assert table["VN"].tolist() == [1.0, 2.0, 3.0]
    np.testing.assert_allclose(table[["roll", "pitch", "heading"]], [[0, 0, 90]] * 3, atol=1e-5)


def test_px4_barometer_of_either_unit(tmp_path):
    fields = [("timestamp", "uint64_t"), ("pressure", "float"), ("temperature", "float")]
    for value, unit in ((1002.5, "mbar"), (100250.0, "Pa")):
        path = written(
            tmp_path / f"{unit}.ulg", ulog([("sensor_baro", fields, [(10, value, 20.0)])])
        )
        raw = px4.read_barometer(path)
        assert raw.stated["pressure"] == ("pressure", unit)


def test_px4_recorded(recordings):
    pyulog = importlib.import_module("pyulog")
    path = recordings("zoo/px4_ulg/sample_log_small.ulg")
    theirs = {d.name: d.data for d in pyulog.ULog(str(path)).data_list if d.multi_id == 0}
    imu = read_log(path).imu
    log = theirs["sensor_combined"]
    for k, a in enumerate("xyz"):
        np.testing.assert_array_equal(imu[f"gyro_{a}"], log[f"gyro_rad[{k}]"])
        np.testing.assert_array_equal(imu[f"accel_{a}"], log[f"accelerometer_m_s2[{k}]"])
    assert imu["accel_z"].median() == pytest.approx(-9.62, abs=0.01)
    assert imu.attrs["sampling"] == "mean"
    table = read_gnss(path)
    np.testing.assert_allclose(table["lat"], theirs["vehicle_gps_position"]["lat"] * 1e-7)
    np.testing.assert_allclose(table["alt"], theirs["vehicle_gps_position"]["alt_ellipsoid"] * 1e-3)
    assert px4.read_magnetometer(path).stated["mag_x"] == ("mag_x", "gauss")
    with pytest.raises(NoStreamError):
        open_stream(path, "wheel")


# Bags of ROS

T0 = 1_600_000_000


def bag(path, version, topics, stamps=True):
    """Write a bag of (topic, short type, [(offset in s, fields)])."""
    typesys = importlib.import_module("rosbags.typesys")
    if version == 1:
        writer = importlib.import_module("rosbags.rosbag1").Writer(path)
        store = typesys.get_typestore(typesys.Stores.ROS1_NOETIC)
    else:
        module = importlib.import_module("rosbags.rosbag2")
        plugin = module.StoragePlugin[version.upper()]
        writer = module.Writer(path, version=9, storage_plugin=plugin)
        store = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
    types = store.types
    time, header = types["builtin_interfaces/msg/Time"], types["std_msgs/msg/Header"]
    with writer:
        connections = {
            topic: writer.add_connection(topic, name, typestore=store) for topic, name, _ in topics
        }
        for topic, name, rows in topics:
            for k, (offset, frame, fields) in enumerate(rows):
                at = T0 * 10**9 + round(offset * 1e9)
                own = at if stamps else 0
                stamp = time(sec=own // 10**9, nanosec=own % 10**9)
                extra = {"seq": k} if version == 1 else {}
                message = types[name](
                    header=header(stamp=stamp, frame_id=frame, **extra), **fields(types)
                )
                pack = store.serialize_ros1 if version == 1 else store.serialize_cdr
                # Recorded 20 ms later than measured.
                writer.write(connections[topic], at + 20_000_000, bytes(pack(message, name)))
    return path


def imu_fields(gyro, accel, none=0.0):
    def fields(types):
        vector = types["geometry_msgs/msg/Vector3"]
        none_or = np.array([none, *[0.0] * 8])
        return {
            "orientation": types["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=0.0, w=1.0),
            "orientation_covariance": np.zeros(9),
            "angular_velocity": vector(*map(float, gyro)),
            "angular_velocity_covariance": none_or,
            "linear_acceleration": vector(*map(float, accel)),
            "linear_acceleration_covariance": none_or,
        }

    return fields


def fix_fields(lat, status=0, covariance_type=2):
    def fields(types):
        made = types["sensor_msgs/msg/NavSatStatus"](status=status, service=1)
        return {
            "status": made,
            "latitude": lat,
            "longitude": 8.0,
            "altitude": 500.0,
            "position_covariance": np.diag([4.0, 9.0, 16.0]).ravel(),  # east, north, up
            "position_covariance_type": covariance_type,
        }

    return fields


def twist_fields(types):
    vector = types["geometry_msgs/msg/Vector3"]
    twist = types["geometry_msgs/msg/Twist"](
        linear=vector(1.0, 2.0, 3.0), angular=vector(0.0, 0.0, 0.0)
    )
    covariance = np.zeros(36)
    covariance[[0, 7, 14]] = 0.01, 0.04, 0.09
    with_covariance = types["geometry_msgs/msg/TwistWithCovariance"]
    return {"twist": with_covariance(twist=twist, covariance=covariance)}


IMU, FIX = "sensor_msgs/msg/Imu", "sensor_msgs/msg/NavSatFix"
TWIST = "geometry_msgs/msg/TwistWithCovarianceStamped"


def samples(accel=(0.0, 0.0, G), none=0.0):
    return [(0.01 * k, "imu_link", imu_fields((0.1, 0.2, 0.1 * k), accel, none)) for k in range(9)]


@pytest.mark.parametrize("version", [1, "sqlite3", "mcap"])
def test_ros_header_stamps_open_axes_and_velocity_of_the_fixes(tmp_path, version):
    path = bag(
        tmp_path / ("log.bag" if version == 1 else "log"),
        version,
        [
            ("/imu", IMU, samples()),
            (
                "/fix",
                FIX,
                [
                    (0.0, "gps", fix_fields(47.0)),
                    (1.0, "gps", fix_fields(47.1)),
                    (2.0, "gps", fix_fields(47.2, -1)),
                ],
            ),
            ("/vel", TWIST, [(0.0, "gps", twist_fields), (1.0, "gps", twist_fields)]),
        ],
    )
    one = path if version == 1 else next(p for p in path.iterdir() if p.suffix != ".yaml")
    moved = written(tmp_path / "renamed.log", one.read_bytes())
    for file in {path, one, moved}:
        assert kind(file) == "ros"
        raw = ros.read(file)
        assert raw.axes is None
        assert all(f.is_file() for f in raw.files)
        assert raw.columns["time"].tolist() == [T0 * 10**9 + 10_000_000 * k for k in range(9)]
        np.testing.assert_allclose(raw.columns["gyro_z"], 0.1 * np.arange(9))
        table = read_gnss(file)
        assert table.index.tolist() == [T0, T0 + 1.0, T0 + 2.0]
        assert table["alt"].tolist() == [500.0] * 3
        assert table["quality"].tolist() == [1, 1, 0]
        first = table.iloc[0]
        assert first[["north_sd", "east_sd", "down_sd"]].tolist() == [3.0, 2.0, 4.0]
        assert first[["VN", "VE", "VD"]].tolist() == [2.0, 1.0, -3.0]
        np.testing.assert_allclose(first[["VN_sd", "VE_sd", "VD_sd"]], [0.2, 0.1, 0.3])


def test_ros_stamps_of_the_record_where_headers_have_none(tmp_path):
    raw = ros.read(bag(tmp_path / "log.bag", 1, [("/imu", IMU, samples())], stamps=False))
    assert raw.columns["time"][0] == T0 * 10**9 + 20_000_000
    assert [f.code for f in raw.findings] == ["io.ros-stamps-of-record"]


def test_ros_several_topics_are_refused_unless_one_is_raw(tmp_path):
    two = bag(tmp_path / "two.bag", 1, [("/a/imu", IMU, samples()), ("/b/imu", IMU, samples())])
    with pytest.raises(
        DataError, check=coded("io.ros-topics-of-one-kind", topics=("/a/imu", "/b/imu"))
    ):
        ros.read(two)
    raw = ros.read(
        bag(
            tmp_path / "raw.bag",
            1,
            [("/imu/data", IMU, samples((0, 0, 5))), ("/imu/data_raw", IMU, samples())],
        )
    )
    assert raw.columns["accel_z"][0] == G
    assert raw.findings[0].data["topic"] == "/imu/data_raw"


def test_ros_the_topic_that_the_user_names(tmp_path, run_cli):
    fast = samples()
    slow = fast[::2]
    path = bag(tmp_path / "two.bag", 1, [("/a/imu", IMU, slow), ("/b/imu", IMU, fast)])
    assert len(read_log(path, ReadOptions(format="ros:/a/imu")).imu) == len(slow)
    with pytest.raises(ConfigError, check=coded("io.unknown-topic")):
        read_log(path, ReadOptions(format="ros:/c/imu"))
    refused = run_cli("attitude", path, "--out", tmp_path / "out")
    # That with the most messages is proposed.
    assert refused.code == 3 and refused.err.rstrip().endswith("--format ros:/b/imu")
    csv = written(tmp_path / "log.csv", b"time,gyro_x\n0,1\n")
    with pytest.raises(ConfigError, check=coded("io.format-without-parts")):
        read_log(csv, ReadOptions(format="csv:part"))


def test_ros_what_is_not_measured_is_not_read(tmp_path):
    flat = [(0.01 * k, "i", imu_fields((0, 0, 0), (0, 0, 0), -1.0)) for k in range(5)]
    with pytest.raises(DataError, check=coded("io.ros-not-measured", quantity="gyro")):
        ros.read(bag(tmp_path / "none.bag", 1, [("/imu", IMU, flat)]))
    raw = ros.read(bag(tmp_path / "free.bag", 1, [("/imu", IMU, samples((0.1, 0.0, 0.2)))]))
    assert "accel_x" not in raw.columns
    assert raw.findings[0].code == "io.force-without-gravity"


def test_ros_a_covariance_of_unknown_kind_is_not_a_standard_deviation(tmp_path):
    rows = [(0.0, "gps", fix_fields(47.0, 0, 0)), (1.0, "gps", fix_fields(47.0, 0, 0))]
    raw = ros.read_fixes(bag(tmp_path / "fix.bag", 1, [("/fix", FIX, rows)]))
    assert "north_sd" not in raw.columns


def test_ros_field_and_pressure(tmp_path):
    def field(types):
        vector = types["geometry_msgs/msg/Vector3"](2e-5, 0.0, 4e-5)
        return {"magnetic_field": vector, "magnetic_field_covariance": np.zeros(9)}

    path = bag(
        tmp_path / "log.bag",
        1,
        [
            ("/mag", "sensor_msgs/msg/MagneticField", [(0.0, "m", field)]),
            (
                "/baro",
                "sensor_msgs/msg/FluidPressure",
                [(0.0, "b", lambda _: {"fluid_pressure": 1e5, "variance": 0.0})],
            ),
        ],
    )
    assert ros.read_magnetometer(path).stated["mag_z"] == ("mag_z", "T")
    assert ros.read_magnetometer(path).columns["mag_z"].tolist() == [4e-5]
    assert ros.read_barometer(path).columns["pressure"].tolist() == [1e5]
    with pytest.raises(NoStreamError):
        ros.read(path)


def test_ros_recorded(recordings):
    path = recordings("zoo/rosbag1_loc/test1.bag")
    raw, table = ros.read(path), read_gnss(path)
    assert raw.columns["time"][0] == 1432235497988949113
    assert raw.columns["accel_y"][0] == 9.608219431498647
    assert len(raw.columns["time"]) == 11865
    assert table["lat"].iloc[0] == 42.375812
    np.testing.assert_allclose(table[["north_sd", "down_sd"]].iloc[0], [0.9, 1.8])
    span = recordings("zoo/novatel_span/ins2.bag")
    both = [read_trajectory(span), read_trajectory(recordings("zoo/novatel_span/ins2.gps"))]
    # One by messages of ROS with the height over the sea, one by the receiver's log without.
    assert both[0]["alt"].iloc[0] == pytest.approx(both[1]["alt"].iloc[0], abs=0.01)
    assert both[0]["heading"].mean() == pytest.approx(both[1]["heading"].mean(), abs=0.05)
    assert "accel_x" not in ros.read(span).columns


# ArduPilot


def flash(messages):
    """A DataFlash log of (name, letters, names, rows); letters c C e E L are written raw."""
    codes = {"Q": "Q", "B": "B", "I": "I", "H": "H", "f": "f", "c": "h", "C": "H", "e": "i"}
    codes |= {"L": "i", "h": "h", "N": "16s", "Z": "64s", "b": "b", "d": "d"}

    def fmt(number, name, letters, names, length):
        body = struct.pack(
            "<BB4s16s64s", number, length, name.encode(), letters.encode(), names.encode()
        )
        return b"\xa3\x95\x80" + body

    out = fmt(128, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns", 89)
    for number, (name, letters, names, _) in enumerate(messages, 130):
        form = "<" + "".join(codes[c] for c in letters)
        out += fmt(number, name, letters, names, struct.calcsize(form) + 3)
    for number, (_, letters, _, rows) in enumerate(messages, 130):
        form = "<" + "".join(codes[c] for c in letters)
        for row in rows:
            out += b"\xa3\x95" + bytes([number]) + struct.pack(form, *row)
    return out


FLASH_IMU = ("IMU", "QBffffff", "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ")
FLASH_GPS = ("GPS", "QBBIHBcLLeffffB")
FLASH_GPS += ("TimeUS,I,Status,GMS,GWk,NSats,HDop,Lat,Lng,Alt,Spd,GCrs,VZ,Yaw,U",)


def arducopter(tmp_path, accuracy=None, name="log.bin", unit=b"rad/s"):
    imu = [
        (1000 * k, i, 0.1, 0.2, 0.3, 1.0, 2.0, -G - 10 * i) for k in range(1, 30) for i in (0, 1)
    ]
    motion = (5.0, 90.0, -0.5, 0.0)
    fixes = [
        (200_000 * k, 0, s, 0, 2000, 9, 80, -353_626_000 - k, 1_491_652_000, 58_800, *motion, 1)
        for k, s in enumerate((1, 3, 4, 5, 6))
    ]
    messages = [(*FLASH_IMU, imu), (*FLASH_GPS, fixes)]
    if accuracy:
        field, letter, value = accuracy
        rows = [(200_000 * k, 0, 150, 250, 30, value) for k in range(5)]
        messages.append(
            ("GPA", f"QBCCC{letter}", f"TimeUS,I,HAcc,VAcc,SAcc,{field}", rows),
        )
    messages.append(("UNIT", "QbZ", "TimeUS,Id,Label", [(0, ord("E"), unit), (0, ord("s"), b"s")]))
    messages.append(("FMTU", "QBNN", "TimeUS,FmtType,UnitIds,MultIds", [(0, 130, b"s#EEEo", b"")]))
    return written(tmp_path / name, flash(messages))


def test_dataflash_first_instance_in_body_axes(tmp_path):
    path = arducopter(tmp_path)
    assert kind(path) == "dataflash"
    imu = read_log(path).imu
    np.testing.assert_allclose(imu.iloc[0], [0.1, 0.2, 0.3, 1.0, 2.0, -G], rtol=1e-6)
    assert imu.index[1] - imu.index[0] == pytest.approx(1e-3)
    raw = ardupilot.read_dataflash(path)
    assert (raw.axes, raw.clock, len(raw.columns["time"])) == ("x,y,z", "relative", 29)
    assert [f.code for f in raw.findings] == ["io.first-of-instances"]


def test_dataflash_a_stated_unit_that_differs_is_refused(tmp_path):
    with pytest.raises(DataError, check=coded("io.log-unit-unknown", unit="deg/s")):
        ardupilot.read_dataflash(arducopter(tmp_path, unit=b"deg/s"))


@pytest.mark.parametrize("accuracy", [("Und", "f", -19.5), ("AEl", "e", 60_750)])
def test_dataflash_height_over_the_ellipsoid(tmp_path, accuracy):
    # The sea is 19.5 m over the ellipsoid; Und has the opposite sign.
    table = read_gnss(arducopter(tmp_path, accuracy))
    np.testing.assert_allclose(table["alt"], 607.5)
    assert table["quality"].tolist() == [1, 2, 5, 4]
    assert table.index.tolist() == pytest.approx([0.2, 0.4, 0.6, 0.8])
    first = table.iloc[0]
    np.testing.assert_allclose(first[["lat", "lon"]], [-35.3626001, 149.1652], rtol=1e-12)
    np.testing.assert_allclose(first[["VN", "VE", "VD"]], [0.0, 5.0, -0.5], atol=1e-12)
    np.testing.assert_allclose(first[["VN_sd", "down_sd"]], [0.3, 2.5])


def test_dataflash_height_over_the_sea_alone_is_not_one_over_the_ellipsoid(tmp_path):
    path = arducopter(tmp_path)
    raw = ardupilot.read_dataflash_fixes(path)
    assert "alt" not in raw.columns
    np.testing.assert_allclose(raw.columns["alt_msl"], 588.0)
    with pytest.raises(DataError, check=coded("io.height-over-sea-column")):
        read_gnss(path, GnssOptions(position_sd=1.0))
    with pytest.raises(NoStreamError):
        ardupilot.read_dataflash_reference(path)


def test_dataflash_garbage_between_records_is_counted(tmp_path):
    path = arducopter(tmp_path)
    path.write_bytes(path.read_bytes() + b"\xa3\x95\xf0" + bytes(7))
    raw = ardupilot.read_dataflash(path)
    assert len(raw.columns["time"]) == 29
    assert raw.findings[0].code == "io.bytes-left-out"


def as_text(path):
    """The log as ground stations write it: names and values, which are scaled."""
    log, _ = ardupilot._records(path.resolve(), path.stat().st_mtime_ns)
    letters = {"IMU": FLASH_IMU[1], "GPS": FLASH_GPS[1], "GPA": "QBCCCe"}
    lines = ["FMT, 128, 89, FMT, BBnNZ, Type,Length,Name,Format,Columns"]
    for name, form in letters.items():
        names = [n for n in log[name] if n != "#"]
        lines.append(f"FMT, {log[name]['#'][0]}, 45, {name}, {form}, {','.join(names)}")
        for row in zip(*(log[name][n].tolist() for n in names), strict=True):
            lines.append(f"{name}, " + ", ".join(map(str, row)))
    lines.append("MSG, 100, ArduCopter V4.5.1, and more")
    return written(path.with_suffix(".log"), "\n".join(lines).encode())


def test_dataflash_as_text_is_the_same_log(tmp_path):
    path = arducopter(tmp_path, ("AEl", "e", 60_750))
    text = as_text(path)
    assert kind(text) == "dataflash"
    for read in (ardupilot.read_dataflash, ardupilot.read_dataflash_fixes):
        binary, said = read(path), read(text)
        assert said.axes == binary.axes and list(said.columns) == list(binary.columns)
        for name, values in binary.columns.items():
            np.testing.assert_allclose(said.columns[name], values, rtol=1e-12)
    assert ardupilot.read_dataflash(text).columns["time"].dtype.kind == "i"
    with text.open("ab") as stream:
        stream.write(b"\nIMU, 99000, 0, 0.1, cut")
    assert len(ardupilot.read_dataflash(text).columns["time"]) == 29


def test_dataflash_recorded(recordings):
    path = recordings("zoo/ardupilot/test.BIN")
    data = path.read_bytes()
    raw = ardupilot.read_dataflash(path)
    # By hand: the number of IMU in its FMT, then the rows.
    at = data.find(b"IMU\0Qfff")
    number, length = data[at - 2], data[at - 1]
    rows, k = [], 0
    while (k := data.find(b"\xa3\x95" + bytes([number]), k)) >= 0:
        if k + length <= len(data):
            rows.append(struct.unpack_from("<Q6f", data, k + 3))
        k += length
    rows = np.array(rows)
    assert len(rows) == 45
    for k, name in enumerate(["time", *(f"{t}_{a}" for t in ("gyro", "accel") for a in "xyz")]):
        np.testing.assert_array_equal(raw.columns[name], rows[:, k])
    assert np.median(rows[:, 6]) == pytest.approx(-9.89, abs=0.01)
    with pytest.raises(DataError, check=coded("io.reference-height-over-sea")):
        read_trajectory(path)


# NovAtel


def crc32(data):
    """Bit by bit, as the receiver's manual has it."""
    crc = 0
    for octet in data:
        value = (crc ^ octet) & 0xFF
        for _ in range(8):
            value = (value >> 1) ^ 0xEDB88320 if value & 1 else value >> 1
        crc = (crc >> 8) ^ value
    return crc


def long_frame(number, week, ms, body):
    head = b"\xaa\x44\x12\x1c" + struct.pack(
        "<HbBHHBBHIIHH", number, 0, 32, len(body), 0, 0, 180, week, ms, 0, 0, 0
    )
    return head + body + struct.pack("<I", crc32(head + body))


def short_frame(number, week, ms, body):
    head = b"\xaa\x44\x13" + bytes([len(body)]) + struct.pack("<HHI", number, week, ms)
    return head + body + struct.pack("<I", crc32(head + body))


def test_novatel_the_printed_example_of_rawimusx(tmp_path):
    """Counts of the receiver's manual, RAWIMUSX: an EG320N at 125 Hz, standing still."""
    counts = (329308016, -2706935, 4508389, 196192, 417138, -1000837)
    frames = b"".join(
        short_frame(
            1462,
            2209,
            491674014 + 8 * k,
            struct.pack("<BBHdI6i", 4, 41, 2209, 491674.013699 + 0.008 * k, 0, *counts),
        )
        for k in range(5)
    )
    path = written(tmp_path / "imu.gps", frames)
    assert kind(path) == "novatel"
    raw = novatel.read(path)
    assert (raw.axes, raw.sampling, raw.clock) == (None, "mean", "gps-seconds-of-week")
    imu = read_log(path).imu
    scale = 0.2e-3 / 65536 * G
    np.testing.assert_allclose(
        imu.iloc[2, 3:6], np.array([4508389, 2706935, 329308016]) * scale, rtol=1e-6
    )
    assert imu.iloc[2]["accel_z"] == pytest.approx(9.855, abs=0.001)
    rate = np.radians(0.008 / 65536)
    np.testing.assert_allclose(
        imu.iloc[2, :3], np.array([-1000837, -417138, 196192]) * rate, rtol=1e-6
    )


def test_novatel_short_raw_log_needs_the_type_of_its_unit(tmp_path):
    def body(k):
        return struct.pack("<IdI6i", 2209, 100.0 + 0.01 * k, 0, 1 << 29, 0, 0, 1, 2, 3)

    frames = b"".join(short_frame(325, 2209, 100_000 + 10 * k, body(k)) for k in range(5))
    path = written(tmp_path / "imu.gps", frames)
    with pytest.raises(DataError, check=coded("io.novatel-unit-unknown", unit=0)):
        novatel.read(path)
    path.write_bytes(frames + long_frame(1945, 2209, 100_000, struct.pack("<II", 58, 0)))
    raw = novatel.read(path)
    assert raw.columns["dv_z"][0] == pytest.approx(1.0)  # 2^29 counts of 2^-29 m/s
    assert raw.columns["dtheta_y"][0] == pytest.approx(-2.0 * 2.0**-33)


def bestpos(ms, kind_of=50, state=0):
    body = struct.pack(
        "<IIdddfI3f4s2f8B",
        *(state, kind_of, 51.1, -114.0, 1097.0, -17.0, 61, 0.01, 0.02, 0.03),
        *(b"", 1.0, 0.0, *[0] * 8),
    )
    return long_frame(42, 2209, ms, body)


def test_novatel_fixes_over_the_ellipsoid(tmp_path):
    velocity = struct.pack("<IIff3df", 0, 8, 0.15, 0.0, 10.0, 30.0, 2.0, 0.0)
    data = b"noise" + bestpos(1000, 16) + long_frame(99, 2209, 1000, velocity)
    path = written(tmp_path / "fix.gps", data + bestpos(2000) + bestpos(3000, 0, 1))
    table = read_gnss(path)
    assert table.index.tolist() == [1.0, 2.0]
    assert table.attrs["gps_week"] == 2209
    np.testing.assert_allclose(table["alt"], 1080.0)
    assert table["quality"].tolist() == [1, 4]
    first = table.iloc[0]
    np.testing.assert_allclose(first[["VN", "VE", "VD"]], [10 * np.sqrt(0.75), 5.0, -2.0])
    np.testing.assert_allclose(first[["north_sd", "east_sd", "down_sd"]], [0.01, 0.02, 0.03])
    assert {f.code for f in table.attrs["findings"]} >= {"io.velocity-late", "io.bytes-left-out"}


def test_novatel_recorded(recordings):
    path = recordings("zoo/novatel_span/ins2.gps")
    data = path.read_bytes()
    table = read_trajectory(path)
    # By hand: the first INSPVAS, which has its number after the sync and the length.
    at = data.find(b"\xaa\x44\x13\x58" + struct.pack("<H", 508)) + 12
    week, second, *values = struct.unpack_from("<Id9d", data, at)
    assert (table.index[0], table.attrs["gps_week"]) == (second, week)
    np.testing.assert_array_equal(table.iloc[0, :5], [*values[:5]])
    assert table["VD"].iloc[0] == -values[5]
    np.testing.assert_allclose(table.iloc[0, 6:], values[6:])
    with pytest.raises(DataError, check=coded("io.novatel-corrected-only")):
        open_stream(path, "imu")
    with pytest.raises(NoStreamError):
        open_stream(path, "gnss")


# u-blox


def ubx_frame(group, number, body):
    head = bytes([group, number]) + struct.pack("<H", len(body))
    a = b = 0
    for octet in head + body:
        a = (a + octet) & 255
        b = (b + a) & 255
    return b"\xb5\x62" + head + body + bytes([a, b])


def nav_pvt(second, flags=0x01 | 0x02 | 2 << 6, fix=3):
    tow = (136_153 + second) * 1000
    when = (2026, 4, 20, 13, 48, 55 + second, 7, 20, 0, fix, flags, 0, 12)
    place = (80_000_000, 470_000_000, 500_000, 450_000, 1500, 2500, 1000, -2000, 300)
    rest = struct.pack("<iiIIHH4xihH", 0, 0, 200, 0, 0, 0, 0, 0, 0)
    body = struct.pack("<IHBBBBBBIiBBBB", tow, *when) + struct.pack("<iiiiIIiii", *place) + rest
    return ubx_frame(1, 7, body)


def esf_meas(tag, values):
    flags = len(values) << 11
    words = [(kind_of << 24) | (value & 0xFFFFFF) for kind_of, value in values]
    return ubx_frame(16, 2, struct.pack(f"<IHH{len(words)}I", tag, flags, 0, *words))


def drive(tmp_path, sentences=b"$GNTXT,01,01,02,ANTSTATUS=OK*25\r\n"):
    out = b""
    for k in range(4):
        out += sentences + nav_pvt(k) if k else nav_pvt(0, 0, 0)
        for j in range(10):
            tag = 5000 + 1000 * k + 100 * j
            out += esf_meas(tag, [(14, 4096), (13, -8192), (5, 2048), (12, 2500)])
            out += esf_meas(tag + 3, [(16, 512), (17, -1024), (18, round(G * 1024))])
            out += esf_meas(tag + 5, [(11, -2500)])
    return written(tmp_path / "drive.ubx", out)


def test_ubx_fixes_in_gps_time(tmp_path):
    path = drive(tmp_path)
    assert kind(path) == "ubx"
    table = read_gnss(path)
    assert table.index.tolist() == [136_154.0, 136_155.0, 136_156.0]
    # 20 April 2026 is a Monday: 2415 weeks and a day after 6 January 1980.
    days = (datetime(2026, 4, 19, tzinfo=UTC) - datetime(1980, 1, 6, tzinfo=UTC)).days
    assert table.attrs["gps_week"] == days // 7 == 2415
    first = table.iloc[0]
    np.testing.assert_allclose(first[["lat", "lon", "alt"]], [47.0, 8.0, 500.0])
    np.testing.assert_allclose(first[["VN", "VE", "VD"]], [1.0, -2.0, 0.3])
    np.testing.assert_allclose(first[["VD_sd", "down_sd"]], [0.2, 2.5])
    assert first["quality"] == 4
    assert table.attrs["findings"][0].code == "io.fixes-without-position-left-out"


def test_ubx_the_finer_position_of_the_same_instant(tmp_path):
    fine = (136_154_000, 80_000_000, 470_000_000, 500_000, 450_000, 12, -34, 5, 6, 123, 456)
    frame = ubx_frame(1, 0x14, struct.pack("<B2xBIiiiibbbbII", 0, 0, *fine))
    path = written(tmp_path / "rtk.ubx", nav_pvt(1) + frame + nav_pvt(2))
    table = read_gnss(path)
    np.testing.assert_allclose(
        table.iloc[0][["lat", "lon", "alt"]], [47.0 - 34e-9, 8.0 + 12e-9, 500.0005], rtol=1e-14
    )
    assert table["down_sd"].tolist() == pytest.approx([0.0456, 2.5])
    assert table["alt"].iloc[1] == 500.0


def test_ubx_sensors_in_ms_of_the_receiver(tmp_path):
    path = drive(tmp_path)
    raw = receivers.read_ubx(path)
    assert (raw.axes, raw.clock) == (None, "gps-seconds-of-week")
    assert "io.ubx-clock-by-order" in [f.code for f in raw.findings]
    # The fix at 136 154 s follows the sample with the tag 5900, each further one a second later.
    # The second sample of the gyro is the first between two of the accelerometer.
    assert read_log(path).imu.index[0] == pytest.approx(136_154.0 - 0.8, abs=1e-9)
    alone = written(
        tmp_path / "alone.ubx", b"".join(esf_meas(k, [(14, 0), (13, 0), (5, 9)]) for k in range(9))
    )
    assert receivers.read_ubx(alone).clock == "relative"
    assert "io.ubx-own-clock" in [f.code for f in receivers.read_ubx(alone).findings]
    imu = read_log(path).imu
    np.testing.assert_allclose(imu.iloc[1, :3], np.radians([1.0, -2.0, 0.5]))
    np.testing.assert_allclose(imu.iloc[1, 3:6], [0.5, -1.0, G], atol=1e-3)
    assert imu.index[1] - imu.index[0] == pytest.approx(0.1)
    wheel = receivers.read_ubx_wheel(path)
    assert wheel.columns["speed"][0] == -2.5
    with pytest.raises(NoStreamError):
        open_stream(path, "reference")


def test_ubx_raw_alone_is_refused(tmp_path):
    path = written(tmp_path / "raw.ubx", ubx_frame(16, 3, bytes(12)) * 3)
    with pytest.raises(DataError, check=coded("io.ubx-raw-only")):
        open_stream(path, "imu")


def test_sentences_of_a_stream_without_own_fixes(tmp_path):
    out = b""
    for k in range(5):
        body = f"GNGGA,12{k:02d}00.00,4730.0,N,00830.0,E,4,12,0.8,500.0,M,47.0,M,,"
        total = 0
        for octet in body.encode():
            total ^= octet
        out += ubx_frame(2, 0x15, b"$\xff\0" * 40) + f"${body}*{total:02X}\r\n".encode()
    path = written(tmp_path / "raw.ubx", out)
    assert kind(path) == "ubx"
    table = read_gnss(path, GnssOptions(position_sd=1.0))
    assert len(table) == 5
    assert table.iloc[0][["lat", "lon", "alt"]].tolist() == [47.5, 8.5, 547.0]
    assert table.attrs["findings"][-1].code == "io.fixes-of-sentences"
    with pytest.raises(NoStreamError):
        open_stream(written(tmp_path / "none.ubx", ubx_frame(2, 0x15, bytes(40))), "gnss")


def test_ubx_recorded(recordings):
    path = recordings("zoo/ubx/pygpsdata-SF-calibration.log")
    data = path.read_bytes()
    table, truth = read_gnss(path), read_trajectory(path)
    assert len(table) == len(truth) == 527
    at = data.find(b"\xb5\x62\x01\x17\x74\x00") + 6  # NAV-PVAT
    tow = struct.unpack_from("<I", data, at)[0]
    lon, lat, height = struct.unpack_from("<iii", data, at + 28)
    assert table.index[0] == truth.index[0] == tow * 1e-3
    np.testing.assert_allclose(
        table.iloc[0][["lat", "lon", "alt"]], [lat * 1e-7, lon * 1e-7, height * 1e-3], rtol=1e-12
    )
    assert table.attrs["gps_week"] == 2415
    # The vehicle drives forward: its heading is the course.
    fast = np.hypot(truth["VN"], truth["VE"]) > 5.0
    course = np.degrees(np.arctan2(truth["VE"], truth["VN"]))[fast]
    apart = (course - truth["heading"][fast] + 180.0) % 360.0 - 180.0
    assert np.abs(apart).median() < 2.0


# Septentrio


def sbf_block(number, tow, week, body):
    body = struct.pack("<IH", tow, week) + body
    body += bytes(-(len(body) + 8) % 4)
    rest = struct.pack("<HH", number, len(body) + 8) + body
    crc = 0
    for octet in rest:
        crc ^= octet << 8
        for _ in range(8):
            crc = (crc << 1) ^ 0x1021 if crc & 0x8000 else crc << 1
        crc &= 0xFFFF
    return b"$@" + struct.pack("<H", crc) + rest


def asterx(tmp_path):
    out = b""
    for k in range(4):
        tow = 1000 * k
        place = (np.radians(50.0), np.radians(4.0), 120.0, 47.0, 1.0, 2.0, 3.0, 60.0)
        out += sbf_block(4007, tow, 2300, struct.pack("<BBdddfffff", 4 if k else 0, 0, *place))
        out += sbf_block(
            5906, tow, 2300, struct.pack("<BB10f", 4, 0, 4.0, 9.0, 16.0, 1.0, *[0.0] * 6)
        )
        out += sbf_block(
            5908, tow, 2300, struct.pack("<BB10f", 4, 0, 0.04, 0.09, 0.16, 1.0, *[0.0] * 6)
        )
        for j in range(10):
            sets = struct.pack("<4B3d", 0, 0, 0, 0, 0.1, 0.2, -G)
            sets += struct.pack("<4B3d", 0, 0, 1, 0, 10.0, 20.0, 30.0 + j)
            out += sbf_block(4050, tow + 100 * j, 2300, struct.pack("<BB", 2, 28) + sets)
    return written(tmp_path / "log.sbf", out)


def test_sbf_geodetic_and_sensors_in_one_time(tmp_path):
    path = asterx(tmp_path)
    assert kind(path) == "sbf"
    table = read_gnss(path)
    assert table.index.tolist() == [1.0, 2.0, 3.0]
    assert (table.attrs["gps_week"], table["quality"].iloc[0]) == (2300, 4)
    first = table.iloc[0]
    np.testing.assert_allclose(first[["lat", "lon", "alt"]], [50.0, 4.0, 120.0])
    np.testing.assert_allclose(first[["VN", "VE", "VD"]], [1.0, 2.0, -3.0])
    np.testing.assert_allclose(first[["north_sd", "east_sd", "down_sd"]], [2.0, 3.0, 4.0])
    np.testing.assert_allclose(first[["VN_sd", "VE_sd", "VD_sd"]], [0.2, 0.3, 0.4], rtol=1e-6)
    imu = read_log(path).imu
    assert imu.attrs["clock"] == "gps-seconds-of-week"
    np.testing.assert_allclose(imu.iloc[1, :3], np.radians([10.0, 20.0, 31.0]))
    np.testing.assert_allclose(imu.iloc[1, 3:6], [0.1, 0.2, -G])
    assert receivers.read_sbf(path).axes is None


def test_sbf_recorded(recordings):
    pysbf2 = importlib.import_module("pysbf2")
    pymap3d = importlib.import_module("pymap3d")
    path = recordings("zoo/sbf/sbfdata.log")
    table = read_gnss(path)
    with path.open("rb") as stream:
        theirs = [m for _, m in pysbf2.SBFReader(stream) if m.identity == "PVTCartesian"]
    assert len(table) == len(theirs) == 58
    place = [pymap3d.ecef2geodetic(m.X, m.Y, m.Z) for m in theirs]
    np.testing.assert_allclose(table[["lat", "lon", "alt"]], place, rtol=1e-9)
    one = theirs[5]
    east, north, up = pymap3d.uvw2enu(one.Vx, one.Vy, one.Vz, place[5][0], place[5][1])
    np.testing.assert_allclose(table[["VN", "VE", "VD"]].iloc[5], [north, east, -up], rtol=1e-6)
    assert table["north_sd"].between(1.0, 10.0).all()
    with pytest.raises(NoStreamError):
        open_stream(path, "imu")


# SBET


def sbet_file(path, plain=False, wander=0.3, count=50):
    """A circle at 30 m/s; `plain`: velocity is written north, east, down."""
    time = 1000.0 + 0.1 * np.arange(count)
    speed, turn = 30.0, 0.2
    course = turn * (time - time[0])
    north = speed / turn * np.sin(course)
    east = speed / turn * (1.0 - np.cos(course))
    up = 2.0 * (time - time[0])
    lat = np.radians(48.0) + north / 6_370_600.0
    lon = np.radians(11.0) + east / (6_390_300.0 * np.cos(lat))
    vn, ve, vu = speed * np.cos(course), speed * np.sin(course), np.full(count, 2.0)
    rows = np.zeros((count, 17))
    rows[:, 0], rows[:, 1], rows[:, 2], rows[:, 3] = time, lat, lon, 500.0 + up
    if plain:
        rows[:, 4:7] = np.column_stack([vn, ve, -vu])
        wander = 0.0
    else:
        # x points north, turned by the wander angle toward the west.
        rows[:, 4] = vn * np.cos(wander) - ve * np.sin(wander)
        rows[:, 5] = -vn * np.sin(wander) - ve * np.cos(wander)
        rows[:, 6] = vu
    rows[:, 7], rows[:, 8] = np.radians(1.0), np.radians(2.0)
    rows[:, 9], rows[:, 10] = course + wander, wander
    return written(path, rows.astype("<f8").tobytes()), vn, ve, np.degrees(course)


@pytest.mark.parametrize("plain", [False, True])
def test_sbet_velocity_and_heading_without_the_wander_angle(tmp_path, plain):
    path, vn, ve, course = sbet_file(tmp_path / "sbet.out", plain)
    assert kind(path) == "sbet"
    table = read_trajectory(path)
    np.testing.assert_allclose(table["VN"], vn, atol=1e-9)
    np.testing.assert_allclose(table["VE"], ve, atol=1e-9)
    np.testing.assert_allclose(table["VD"], -2.0)
    np.testing.assert_allclose(table["heading"], course, atol=1e-9)
    np.testing.assert_allclose(table[["roll", "pitch"]], [[1.0, 2.0]] * 50)
    codes = [f.code for f in table.attrs["findings"]]
    assert ("io.sbet-north-east-down" in codes) == plain


def test_sbet_velocities_of_no_known_axes_are_refused(tmp_path):
    path, *_ = sbet_file(tmp_path / "sbet.out", True)
    rows = np.frombuffer(path.read_bytes(), dtype="<f8").reshape(-1, 17).copy()
    rows[:, 4] *= -1.0
    path.write_bytes(rows.tobytes())
    with pytest.raises(DataError, check=coded("io.sbet-velocity")):
        read_trajectory(path)


def test_sbet_a_damaged_record_is_named(tmp_path):
    path, *_ = sbet_file(tmp_path / "sbet.out")
    data = bytearray(path.read_bytes())
    data[136 * 20 + 8 : 136 * 20 + 16] = struct.pack("<d", 5.0)
    path.write_bytes(data)
    with pytest.raises(DataError, check=coded("io.sbet-value", row=21)):
        read_trajectory(path)


def test_sbet_recorded(recordings):
    path = recordings("zoo/sbet/2-points.sbet")
    data = path.read_bytes()
    table = read_trajectory(path)
    time, lat, lon, alt = struct.unpack_from("<4d", data)
    assert table.index[0] == time
    np.testing.assert_allclose(table.iloc[0, :3], [np.degrees(lat), np.degrees(lon), alt])
    # The positions move 2.3 m/s to the south and a little east and down.
    moved = np.radians(np.diff(table[["lat", "lon"]].to_numpy(), axis=0)[0]) / 0.004996
    assert table["VN"].mean() == pytest.approx(moved[0] * 6.36e6, rel=0.02)
    assert table["VE"].mean() == pytest.approx(moved[1] * 6.38e6 * np.cos(lat), rel=0.05)
    assert table["VD"].mean() == pytest.approx(0.0306, rel=0.01)


# Inertial Explorer

PREAMBLE = """Project:     drive
Program:     Inertial Explorer Version 8.90.6611
Profile:     own
Datum:       WGS84, (processing datum)
Master 1:    Name base, Status ENABLED
             Position 30 27 23.39873, -114 23 49.23157, 77.631 m (WGS84, Ellipsoidal hgt)

"""


@pytest.mark.parametrize("dms", ["(+/-D M S)", "(D M S)"])
def test_inertial_explorer_degrees_and_velocity_of_the_body(tmp_path, dms):
    names = "UTCDate Week GPSTime Latitude Longitude H-Ell VelBdyX VelBdyY VelBdyZ "
    names += "Roll Pitch Heading Q"
    units = "(MDY) (weeks) (sec) (+/-D M S) (+/-D M S) (m) (m/s) (m/s) (m/s) (deg) (deg) (deg)   "
    units = units.replace("(+/-D M S)", dms)
    rows = "04/03/2019 2254 604799.00 30 30 36.0 -0 30 36.0 12.5 0.5 10 -0.25 0.0 0.0 270.0 1\n"
    rows += "04/03/2019 2255 0.00  30 30 36.0  -0 30 37.0  12.5  0.5 10.0 -0.25  0.0 0.0 90.0 1\n"
    path = tmp_path / "truth.txt"
    path.write_text(PREAMBLE + names + "\n" + units + "(-)\n" + rows + "\nEnd of file\n")
    assert kind(path) == "inertial-explorer"
    table = read_trajectory(path)
    assert table.index.tolist() == [604799.0, 604800.0]
    assert table.attrs["gps_week"] == 2254
    np.testing.assert_allclose(table["lat"], 30.51)
    np.testing.assert_allclose(table["lon"], [-0.51, -0.51 - 1 / 3600], rtol=1e-12)
    assert table["alt"].tolist() == [12.5, 12.5]
    # Heading west: forward is west, right is north; up is -0.25.
    np.testing.assert_allclose(table[["VN", "VE", "VD"]].iloc[0], [0.5, -10.0, 0.25], atol=1e-9)
    np.testing.assert_allclose(table[["VN", "VE", "VD"]].iloc[1], [-0.5, 10.0, 0.25], atol=1e-9)
    assert table["heading"].tolist() == pytest.approx([-90.0, 90.0])


def test_inertial_explorer_faults_are_named(tmp_path):
    names = "GPSTime Latitude Longitude H-Ell VNorth VEast VUp Roll Pitch Heading\n"
    units = "(sec) (deg) (deg) (m) (m/s) (m/s) (m/s) (deg) (deg) (deg)\n"
    row = "10.0 47.0 8.0 500.0 1.0 2.0 3.0 4.0 5.0 6.0\n"
    path = tmp_path / "truth.txt"
    path.write_text(PREAMBLE + names + units + row + row.replace("10.0", "11.0"))
    table = read_trajectory(path)
    assert table.iloc[1].tolist() == [47.0, 8.0, 500.0, 1.0, 2.0, -3.0, 4.0, 5.0, 6.0]
    path.write_text(PREAMBLE + names + units + row + row[:-5] + "\n")
    with pytest.raises(DataError, check=coded("io.inertial-explorer-row", row=11)):
        read_trajectory(path)
    path.write_text(PREAMBLE + names + units.replace("(m/s)", "(knots)") + row)
    with pytest.raises(DataError, check=coded("io.inertial-explorer-unit", quantity="vnorth")):
        read_trajectory(path)
    path.write_text(PREAMBLE + names.replace("VNorth", "COG") + units + row)
    with pytest.raises(DataError, check=coded("io.missing-columns-3", missing=("vnorth",))):
        read_trajectory(path)
    path.write_text(PREAMBLE + row)
    with pytest.raises(DataError, check=coded("io.inertial-explorer-header")):
        read_trajectory(path)


# Damage, missing libraries, foreign formats


def everything(tmp_path):
    yield flight(tmp_path), "px4"
    yield arducopter(tmp_path), "dataflash"
    yield drive(tmp_path), "ubx"
    yield asterx(tmp_path), "sbf"
    yield written(tmp_path / "fix.gps", bestpos(1000) + bestpos(2000) + bestpos(3000)), "novatel"
    yield sbet_file(tmp_path / "sbet.out")[0], "sbet"
    yield bag(tmp_path / "log.bag", 1, [("/imu", IMU, samples())]), "ros"
    folder = bag(tmp_path / "log", "mcap", [("/imu", IMU, samples())])
    yield next(p for p in folder.iterdir() if p.suffix == ".mcap"), "ros"
    folder = bag(tmp_path / "base", "sqlite3", [("/imu", IMU, samples())])
    yield next(p for p in folder.iterdir() if p.suffix == ".db3"), "ros"


def test_a_cut_or_overwritten_file_is_refused_or_read_in_part(tmp_path):
    """What is left of a log is read; nothing but a DataError is raised."""
    random = np.random.default_rng(4)
    for path, reader in ((path, READERS[name]) for path, name in everything(tmp_path)):
        data = path.read_bytes()
        cuts = [data[:n] for n in (7, 40, len(data) // 2, len(data) - 3)]
        for _ in range(3):
            noise = bytearray(data)
            at = int(random.integers(20, len(data) - 30))
            noise[at : at + 20] = random.bytes(20)
            cuts.append(bytes(noise))
        for k, content in enumerate(cuts):
            bad = written(tmp_path / f"bad_{k}{path.suffix}", content)
            reader.detect(bad)
            for read in reader.streams.values():
                try:
                    read(bad)
                except DataError as error:
                    assert error.finding.file == bad.name


@pytest.mark.parametrize(
    ("name", "make"),
    [
        ("pyulog", flight),
        ("rosbags", lambda folder: bag(folder / "log.bag", 1, [("/imu", IMU, samples())])),
        ("pyubx2", drive),
    ],
)
def test_a_missing_library_names_the_extra(tmp_path, monkeypatch, name, make):
    path, real = make(tmp_path), importlib.import_module

    def without(module, *rest):
        if module.partition(".")[0] == name:
            raise ImportError(module)
        return real(module, *rest)

    monkeypatch.setattr(importlib, "import_module", without)
    expected = coded("io.library-missing", library=name, extra="logs")
    with in_place(), pytest.raises(DataError, check=expected):
        open_stream(path, "imu")


@pytest.mark.parametrize(
    ("name", "data", "word"),
    [
        ("log.bbl", b"H Product:Blackbox flight data recorder by Nicholas Sherlock\n", "blackbox"),
        ("z1.raw", b"UUz1(" + bytes(60), "openimu"),
        ("flight.7z", b"7z\xbc\xaf\x27\x1c" + bytes(30), "unpacked"),
        ("base.obs", b"     3.04           O".ljust(60) + b"RINEX VERSION / TYPE\n", "RTKLIB"),
        ("ride.mp4", bytes(4) + b"ftypmp42" + bytes(20), "exiftool"),
    ],
)
def test_a_foreign_format_is_told_how_it_gets_in(tmp_path, name, data, word):
    path = written(tmp_path / name, data)
    with pytest.raises(DataError, check=coded("io.foreign-format", file=name)) as refused:
        open_stream(path, "imu")
    assert word in refused.value.finding.data["way"]


def test_zoo_files_of_foreign_formats(recordings):
    for name in ("zoo/betaflight/error-recovery.bbl", "zoo/openimu/z1.raw"):
        with pytest.raises(DataError, check=coded("io.foreign-format")):
            read_log(recordings(name))
