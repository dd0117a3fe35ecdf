"""A file under the wrong option, too slow, or half readable: what it is, and its way in."""

from __future__ import annotations

import numpy as np
import pytest
from tests.coded import coded

import strapdown as sd
from strapdown.errors import DataError
from strapdown.formats import ReadOptions, read_log

SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6}


def table(path, names, rows):
    path.write_text(names + "\n" + "\n".join(",".join(map(repr, row)) for row in rows) + "\n")
    return path


@pytest.mark.parametrize(
    ("names", "code"),
    [
        ("time,lat,lon,alt,VN,VE,VD", "io.table-of-positions"),
        ("t,Latitude (deg),Longitude (deg),h", "io.table-of-positions"),
        ("time,roll_deg,pitch_deg,yaw_deg", "io.table-of-attitudes"),
        ("time,q_w,q_x,q_y,q_z", "io.table-of-attitudes"),
        ("Time,X,Y,Z", "io.no-gyro-columns"),
    ],
)
def test_a_table_without_a_gyro_says_where_it_belongs(tmp_path, names, code):
    rows = [[float(k)] + [0.1 * k] * names.count(",") for k in range(5)]
    with pytest.raises(DataError, check=coded(code)):
        read_log(table(tmp_path / "a.csv", names, rows))


def test_a_log_with_positions_in_it_is_a_log(tmp_path):
    names = "time_s,gyro_x_rad_s,gyro_y_rad_s,gyro_z_rad_s,lat,lon"
    rows = [[0.01 * k, 0.1, 0.0, 0.0, 47.0, 8.0] for k in range(50)]
    assert len(read_log(table(tmp_path / "a.csv", names, rows)).imu) == 50


@pytest.mark.parametrize(("step", "refused"), [(1.9, False), (2.1, True), (56.0, True)])
def test_a_gyro_that_is_too_slow_is_refused_unless_the_unit_is_stated(tmp_path, step, refused):
    names = "time_s,gyro_x_rad_s,gyro_y_rad_s,gyro_z_rad_s"
    path = table(tmp_path / "a.csv", names, [[step * k, 0.01, 0.0, 0.0] for k in range(12)])
    if refused:
        with pytest.raises(DataError, check=coded("io.too-slow-for-a-gyro")):
            read_log(path)
    else:
        read_log(path)
    assert len(read_log(path, ReadOptions(time_unit="s")).imu) == 12
    assert len(read_log(path, ReadOptions(time_unit="ms")).imu) == 12


@pytest.mark.parametrize(
    ("unit", "step", "likely"),
    [
        ("ms", 0.01, "s"),
        ("ms", 0.04, "s"),
        ("us", 0.01, "s"),
        ("us", 10, "ms"),
        ("ms", 0.05, None),  # 20 kHz, as of a crash unit
        ("ms", 10, None),
        ("us", 125, None),
        ("s", 0.01, None),
    ],
)
def test_a_clock_named_in_a_unit_of_no_such_sensor_is_asked_about(tmp_path, unit, step, likely):
    """Seconds under the name of milliseconds are 100 kHz at 100 Hz."""
    rng = np.random.default_rng(3)
    names = f"time_{unit},gyro_x_rad_s,gyro_y_rad_s,gyro_z_rad_s"
    rows = [[round(step * k, 3), *rng.normal(0.0, 0.01, 3).round(5).tolist()] for k in range(3000)]
    path = table(tmp_path / "a.csv", names, rows)
    if likely is None:
        assert read_log(path).imu.index[-1] == pytest.approx(2999 * step * SECONDS[unit])
        return
    with pytest.raises(DataError, check=coded("io.time-unit-named-too-fast")) as error:
        read_log(path)
    assert error.value.finding.data["likely"] == likely
    for stated in (likely, unit):
        end = read_log(path, ReadOptions(time_unit=stated)).imu.index[-1]
        assert end == pytest.approx(2999 * step * SECONDS[stated])


def test_a_stream_that_cannot_be_read_is_named(tmp_path, recordings):
    """An autopilot's log with heights over the sea alone."""
    streams = sd.read(recordings("zoo/ardupilot/test.BIN"))
    assert list(streams) == ["imu", "magnetometer", "barometer"]
    said = {f.quantity: f for f in streams.left_out}
    assert said["gnss"].code == "api.stream-left-out"
    assert said["gnss"].data["reason"].code == "io.height-over-sea-column"
    assert streams.findings[: len(said)] == streams.left_out
    # Positions alone: the gyro that is not there is no fault.
    names = "time,lat,lon,alt,north_sd,east_sd,down_sd"
    fixes = sd.read(table(tmp_path / "a.csv", names, [[0.0, 1.0, 2.0, 3.0, 1.0, 1.0, 1.0]] * 1))
    assert list(fixes) == ["gnss"] and fixes.left_out == ()


def test_the_tables_of_a_folder_are_its_files(recordings, run_cli, tmp_path):
    """A bundle seals files, which a folder is not."""
    folder = recordings("zoo/gnss_ins_sim")
    for source in (folder, folder / "gyro-0.csv"):
        names = {p.name for p in read_log(source).files}
        assert {"time.csv", "gyro-0.csv", "accel-0.csv"} <= names
    done = run_cli("attitude", folder, "--algorithms", "quaternion", "--out", tmp_path / "out")
    assert done.code == 0, done.err


def test_an_accelerometer_without_gravity_is_the_reason(recordings, run_cli, tmp_path):
    bag = recordings("zoo/novatel_span/ins2.bag")
    done = run_cli("init", "navigate", bag, "--out", tmp_path / "a.toml")
    assert done.code == 3 and "gravity" in done.err


def test_the_way_of_fixes_and_of_a_trajectory(recordings, run_cli, tmp_path):
    for name, way in (
        ("zoo/gpx/around-visnjan-with-car.gpx", "--gnss around-visnjan-with-car.gpx"),
        ("zoo/sbet/2-points.sbet", "--truth 2-points.sbet"),
    ):
        done = run_cli("init", "navigate", recordings(name), "--out", tmp_path / "a.toml")
        assert done.code == 3 and way in done.err
