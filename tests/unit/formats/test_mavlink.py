"""Telemetry logs of MAVLink, as the library itself writes their frames."""

from __future__ import annotations

import importlib
import json
import struct

import numpy as np
import pandas as pd
import pytest
from tests.coded import coded

from strapdown.errors import DataError
from strapdown.formats import NoStreamError, ardupilot, open_stream, read_log, reader_of, readers_of
from strapdown.formats.gnss_files import GnssOptions, read_gnss
from strapdown.formats.trajectory_readers import read_trajectory
from strapdown.parsers import in_place

T0 = 1_700_000_000_000_000  # arrival of the first message, µs since 1970
BOOT = 60_000  # ms since the start of the autopilot at the first message
G = 9.80665


@pytest.fixture(scope="module")
def dialect():
    return importlib.import_module("pymavlink.dialects.v20.ardupilotmega")


def tlog(path, dialect, messages, *, version=2, system=1):
    """Messages as (arrival in ms, message), in the order given."""
    out = b""
    link = dialect.MAVLink(None, srcSystem=system, srcComponent=1)
    for at, message in messages:
        frame = message.pack(link, force_mavlink1=version == 1)
        assert frame[0] == (0xFE if version == 1 else 0xFD)
        out += struct.pack(">Q", T0 + 1000 * at) + bytes(frame)
    path.write_bytes(out)
    return path


def flight(dialect, count=200, height=True, scaled=False):
    """Level, turning right at 0.1 rad/s, at 10 m/s to the east: 50 Hz, and five fixes a second."""
    d, out = dialect, []
    for k in range(count):
        at = 20 * k
        boot = BOOT + at
        if scaled:
            imu = d.MAVLink_scaled_imu_message(boot, 10, -20, -1000, 1, -2, 100, 200, 0, 400)
        else:
            imu = d.MAVLink_highres_imu_message(
                1000 * boot,
                0.1,
                -0.2,
                -G,
                0.001,
                -0.002,
                0.1,
                0.2,
                0.0,
                0.4,
                950.0,
                0.0,
                540.0,
                21.0,
                0xFFFF,
            )
        out.append((at, imu))
        if k % 10 == 0:
            lon = 85_000_000 + k
            more = (547_250 if height else 0, 1500, 2500, 200) if height else ()
            out.append(
                (
                    at,
                    d.MAVLink_gps_raw_int_message(
                        1000 * boot, 3, 470_000_000, lon, 500_000, 80, 120, 1000, 9000, 12, *more
                    ),
                )
            )
            out.append(
                (at, d.MAVLink_attitude_message(boot, 0.02, -0.01, 1.5 + 0.002 * k, 0, 0, 0.1))
            )
            out.append(
                (
                    at,
                    d.MAVLink_global_position_int_message(
                        boot, 470_000_000, lon, 500_000, 0, 0, 1000, -50, 9000
                    ),
                )
            )
            out.append((at, d.MAVLink_scaled_pressure_message(boot, 954.5, 0.0, 2100)))
    return out


@pytest.mark.parametrize("version", [1, 2])
def test_sensors_in_body_axes(tmp_path, dialect, version):
    path = tlog(tmp_path / "flight.tlog", dialect, flight(dialect), version=version)
    assert next(readers_of(path))[0] == "mavlink"
    imu = read_log(path).imu
    assert len(imu) == 200 and imu.index[0] == BOOT / 1e3
    np.testing.assert_allclose(np.diff(imu.index), 0.02, atol=1e-9)
    # Single precision in the message.
    np.testing.assert_allclose(imu.iloc[3, :3], [0.001, -0.002, 0.1], rtol=1e-7)
    np.testing.assert_allclose(imu.iloc[3, 3:6], [0.1, -0.2, -G], rtol=1e-7)
    np.testing.assert_allclose(imu["mag_z"], 40.0, rtol=1e-7)  # 0.4 gauss in µT
    assert open_stream(path, "barometer").columns["pressure"][0] == pytest.approx(954.5)


def test_milli_g_and_milliradians(tmp_path, dialect):
    path = tlog(tmp_path / "a", dialect, flight(dialect, scaled=True))
    imu = read_log(path).imu
    np.testing.assert_allclose(imu.iloc[0, :3], [0.001, -0.002, 0.1], rtol=1e-15)
    np.testing.assert_allclose(imu.iloc[0, 3:6], np.array([0.01, -0.02, -1.0]) * G, rtol=1e-15)


def test_fixes_and_the_own_solution(tmp_path, dialect):
    path = tlog(tmp_path / "flight.tlog", dialect, flight(dialect))
    fixes = read_gnss(path)
    assert len(fixes) == 20 and fixes.index[1] - fixes.index[0] == pytest.approx(0.2)
    first = fixes.iloc[0]
    np.testing.assert_allclose(first[["lat", "lon", "alt"]], [47.0, 8.5, 547.25], rtol=1e-14)
    np.testing.assert_allclose(first[["VN", "VE"]], [0.0, 10.0], atol=1e-14)
    assert np.isinf(first["VD_sd"]) and first["VE_sd"] == pytest.approx(0.2)
    assert first["down_sd"] == 2.5 and first["quality"] == 1.0
    table = read_trajectory(path)
    np.testing.assert_allclose(table["alt"], 547.25, rtol=1e-14)
    np.testing.assert_allclose(table[["VN", "VE", "VD"]].iloc[0], [0.0, 10.0, -0.5], atol=1e-14)
    angles = np.degrees([0.02, -0.01, 1.5])
    np.testing.assert_allclose(table[["roll", "pitch", "heading"]].iloc[0], angles, rtol=1e-6)


def test_heights_over_the_sea_are_asked(tmp_path, dialect):
    path = tlog(tmp_path / "a.tlog", dialect, flight(dialect, height=False), version=1)
    with pytest.raises(DataError, check=coded("io.height-over-sea-column")):
        read_gnss(path, GnssOptions(position_sd=3.0))
    fixes = read_gnss(path, GnssOptions(position_sd=3.0, datum_height=47.25))
    assert fixes["alt"].iloc[0] == 547.25
    with pytest.raises(DataError, check=coded("io.reference-height-over-sea")):
        ardupilot.read_mavlink_reference(path)


def test_fixes_on_a_clock_of_1970(tmp_path, dialect):
    d, ahead = dialect, 1_600_000_000_000_000
    messages = flight(d, 30)
    moved = []
    for at, m in messages:
        if m.get_type() == "GPS_RAW_INT":
            m.time_usec += ahead
        moved.append((at, m))
    with pytest.raises(DataError, check=coded("io.mavlink-two-clocks")):
        ardupilot.read_mavlink_fixes(tlog(tmp_path / "a.tlog", d, moved))
    system = d.MAVLink_system_time_message(ahead + 1000 * (BOOT + 5), BOOT + 5)
    fixes = ardupilot.read_mavlink_fixes(tlog(tmp_path / "b.tlog", d, [*moved, (600, system)]))
    assert fixes.columns["time"][0] == 1000 * BOOT


def test_the_ground_station_and_damage(tmp_path, dialect):
    messages = flight(dialect)
    path = tlog(tmp_path / "a.tlog", dialect, messages)
    whole = path.read_bytes()
    other = tlog(tmp_path / "b.tlog", dialect, messages[:5], system=255).read_bytes()
    broken = bytearray(whole)
    broken[8 + 15] ^= 1  # in the first message
    path.write_bytes(bytes(broken) + b"\0\1\2" + other + whole[:17])
    raw = ardupilot.read_mavlink(path)
    assert raw.columns["time"].size == 199
    said = [f.code for f in raw.findings]
    assert said == ["io.mavlink-one-of-systems", "io.mavlink-frames-left-out"]
    assert raw.findings[0].data["system"] == 1


def printed(form, messages):
    """Messages as mavlogdump of pymavlink prints them, by the texts of pymavlink."""
    if form == "text":
        return [
            f"2023-11-14 22:13:{20 + at // 1000}.{at % 1000 // 10:02d}: {m}" for at, m in messages
        ]
    if form == "json":
        return [
            json.dumps(
                {
                    "meta": {"type": m.get_type(), "timestamp": T0 / 1e6 + at / 1e3},
                    "data": {n: v for n, v in m.to_dict().items() if n != "mavpackettype"},
                }
            )
            for at, m in messages
        ]
    kinds = {m.get_type(): m.fieldnames for _, m in messages}
    rows = ["timestamp," + ",".join(f"{k}.{n}" for k, names in kinds.items() for n in names)]
    for at, m in messages:
        cells = (
            str(getattr(m, n)) if k == m.get_type() else "" for k, f in kinds.items() for n in f
        )
        rows.append(f"{T0 / 1e6 + at / 1e3:.8f},{','.join(cells)}")
    return rows


@pytest.mark.parametrize("form", ["text", "json", "csv"])
@pytest.mark.parametrize("scaled", [True, False])
def test_messages_as_mavlogdump_prints_them(tmp_path, dialect, form, scaled):
    messages = flight(dialect, 60, scaled=scaled)
    # Another kind of message, with an array, a text and a comma in it.
    messages.insert(0, (0, dialect.MAVLink_statustext_message(6, b"EKF3, ready {1 : 2}")))
    if form == "csv":
        messages = messages[1:]
    path = tmp_path / f"flight.{form}"
    path.write_text("\n".join(printed(form, messages)) + "\n")
    assert reader_of(path)[0] == "mavlogdump"
    whole = tlog(tmp_path / "flight.tlog", dialect, messages)
    pd.testing.assert_frame_equal(read_log(path).imu, read_log(whole).imu)
    pd.testing.assert_frame_equal(read_gnss(path), read_gnss(whole))
    pd.testing.assert_frame_equal(read_trajectory(path), read_trajectory(whole))
    np.testing.assert_array_equal(open_stream(path, "barometer").columns["pressure"], 954.5)
    assert [f.code for f in read_log(path).findings] == [f.code for f in read_log(whole).findings]


@pytest.mark.parametrize("form", ["text", "json"])
def test_records_of_dataflash_as_mavlogdump_prints_them(tmp_path, form):
    """Positions of the autopilot's own solution, and of its commands, are no fixes."""
    rows = []
    for k in range(40):
        us = 1_000_000 + 20_000 * k
        imu = dict(zip(("GyrX", "GyrY", "GyrZ", "AccX", "AccY", "AccZ"), IMU_ROW, strict=True))
        rows.append(("IMU", {"TimeUS": us, **imu, "T": 40.5 + k}))
        if k % 10 == 0:
            place = {"Lat": 47.0 + 1e-6 * k, "Lng": 8.5, "Alt": 500.0 + k}
            gps = {"Status": 3, "NSats": 9, **place, "Spd": 10.0, "GCrs": 90.0, "VZ": -0.5}
            rows.append(("GPS", {"TimeUS": us, **gps}))
            rows.append(("POS", {"TimeUS": us, "Lat": 47.1, "Lng": 8.6, "Alt": 1.0}))
            rows.append(("CMD", {"TimeUS": us, "Lat": 0.0, "Lng": 0.0, "Alt": 0.0}))
    path = tmp_path / "flight.txt"
    if form == "text":
        said = [
            f"2017-10-29 01:47:09.86: {kind} {{{', '.join(f'{n} : {v}' for n, v in one.items())}}}"
            for kind, one in rows
        ]
    else:
        said = [json.dumps({"meta": {"type": k, "timestamp": 1.5e9}, "data": v}) for k, v in rows]
    path.write_text("\n".join(said) + "\n")
    assert reader_of(path)[0] == "dataflash"
    imu = read_log(path).imu
    assert len(imu) == 40
    np.testing.assert_array_equal(imu.iloc[7, :6], IMU_ROW)
    fixes = read_gnss(path, GnssOptions(position_sd=3.0, velocity_sd=1.0, datum_height=0.0))
    np.testing.assert_array_equal(fixes["lat"], 47.0 + 1e-6 * np.arange(0, 40, 10))
    np.testing.assert_array_equal(fixes["alt"], 500.0 + np.arange(0, 40, 10))
    np.testing.assert_allclose(fixes[["VN", "VE", "VD"]].iloc[0], [0.0, 10.0, -0.5], atol=1e-12)


#: Rates in rad/s and specific force in m/s².
IMU_ROW = [0.125, -0.25, 0.5, 0.1, -0.2, -9.75]


def test_what_is_not_in_it(tmp_path, dialect):
    beat = [(k, dialect.MAVLink_heartbeat_message(2, 3, 0, 0, 0, 3)) for k in range(4)]
    path = tlog(tmp_path / "a.tlog", dialect, beat)
    assert next(readers_of(path))[0] == "mavlink"
    with pytest.raises(NoStreamError):
        ardupilot.read_mavlink(path)
    assert not ardupilot.detect_mavlink(tmp_path)
    (tmp_path / "c").write_bytes(struct.pack(">Q", T0) + b"\xfd" + bytes(40))
    assert not ardupilot.detect_mavlink(tmp_path / "c")


def test_without_the_library_the_message_names_the_extra(tmp_path, dialect, monkeypatch):
    path = tlog(tmp_path / "a.tlog", dialect, flight(dialect, 10))
    ardupilot._messages.cache_clear()
    real = importlib.import_module

    def missing(name, *args):
        if name.startswith("pymavlink"):
            raise ImportError(name)
        return real(name, *args)

    monkeypatch.setattr(importlib, "import_module", missing)
    with in_place(), pytest.raises(DataError, check=coded("io.library-missing", extra="mavlink")):
        ardupilot.read_mavlink(path)
