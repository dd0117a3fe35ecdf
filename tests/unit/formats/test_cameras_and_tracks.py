"""GoPro telemetry, Garmin FIT, GPX and DJI subtitles.

Samples against an independent parse of their bytes; other cases are written here as documented:
GPMF by the README of https://github.com/gopro/gpmf-parser, FIT by its profile and protocol
(https://developer.garmin.com/fit).
"""

from __future__ import annotations

import importlib
import json
import struct
import xml.etree.ElementTree as ET
from datetime import UTC, datetime

import numpy as np
import pytest
from tests.coded import coded

from strapdown.errors import DataError
from strapdown.formats import NoStreamError, open_stream, read_log
from strapdown.formats.gnss_files import GnssOptions, fixes_of_columns, read_gnss
from strapdown.parsers import in_place


def without_library(monkeypatch, name):
    real = importlib.import_module

    def missing(module, *args):
        if module.partition(".")[0] == name:
            raise ImportError(module)
        return real(module, *args)

    monkeypatch.setattr(importlib, "import_module", missing)


def columns(raw):
    """Values of a log by quantity, with their units."""
    return {q: (np.asarray(raw.columns[c]), u) for c, (q, u) in raw.stated.items()}


def truncations(path, tmp_path, stream, cuts=12):
    """Every cut file is read in part, or refused; nothing else is raised."""
    data = path.read_bytes()
    for k in range(1, cuts):
        cut = tmp_path / f"cut{path.suffix}"
        cut.write_bytes(data[: len(data) * k // cuts + k])
        try:
            open_stream(cut, stream)
        except DataError as error:
            assert str(error)


# --- GoPro ------------------------------------------------------------------------------


def klv(key, letter, size, values):
    data = b"".join(values) if isinstance(values, list) else values
    count = len(data) // size
    return struct.pack(">4scBH", key, letter, size, count) + data + b"\0" * (-len(data) % 4)


def nest(key, *parts):
    data = b"".join(parts)
    while len(data) // 1 > 0xFFFF:
        raise AssertionError
    return struct.pack(">4sBBH", key, 0, 1, len(data)) + data + b"\0" * (-len(data) % 4)


def shorts(rows):
    return b"".join(struct.pack(">3h", *row) for row in rows)


def sensor(key, rows, scale, unit, order=b"YxZ", stamp=None, name=None):
    parts = [klv(b"STMP", b"J", 8, struct.pack(">Q", stamp))] if stamp is not None else []
    parts += [klv(b"STNM", b"c", len(name), name)] if name else []
    parts += [klv(b"SIUN", b"c", len(unit), unit), klv(b"SCAL", b"s", 2, struct.pack(">h", scale))]
    parts += [klv(b"ORIN", b"c", 3, order)] if order else []
    return nest(b"STRM", *parts, klv(key, b"s", 6, shorts(rows)))


def gps5(rows, utc=b"210415153342.500", fix=3, system=None):
    parts = [klv(b"GPSF", b"L", 4, struct.pack(">L", fix)), klv(b"GPSU", b"U", 16, utc)]
    parts += [klv(b"GPSA", b"F", 4, system)] if system else []
    scale = struct.pack(">5l", 10_000_000, 10_000_000, 1000, 1000, 100)
    data = b"".join(struct.pack(">5l", *row) for row in rows)
    return nest(b"STRM", *parts, klv(b"SCAL", b"l", 4, scale), klv(b"GPS5", b"l", 20, data))


def payloads(*, order=b"YxZ", stamps=True, name=None):
    """Two payloads of a second: 20 rates, 10 accelerations, 2 fixes each."""
    out = []
    for k in range(2):
        stamp = 5_000_000 + 1_000_000 * k if stamps else None
        gyro = [(10 * (20 * k + j), -20, 30) for j in range(20)]
        accel = [(100, -200, 300 + j) for j in range(10)]
        place = [(473_000_000 + j, -87_000_000, 500_000, 1500, 160) for j in range(2)]
        out.append(
            nest(
                b"DEVC",
                klv(b"DVNM", b"c", 4, b"Hero"),
                sensor(b"GYRO", gyro, 10, b"rad/s", order, stamp, name),
                sensor(b"ACCL", accel, 100, b"m/s\xb2", order, stamp, name),
                gps5(place, b"2104151533%02d.500" % (42 + k)),
            )
        )
    return out


def in_mp4(parts, ticks=1000, duration=1001):
    """Wrap payloads in the boxes of an MP4 with a ``gpmd`` track alone."""

    def box(kind, *content):
        data = b"".join(content)
        return struct.pack(">I4s", 8 + len(data), kind) + data

    ftyp, start = box(b"ftyp", b"mp42\0\0\0\0"), 0
    offsets = []
    mdat = box(b"mdat", *parts)
    start = len(ftyp) + 8
    for part in parts:
        offsets.append(start)
        start += len(part)
    n = len(parts)
    stbl = box(
        b"stbl",
        box(b"stsd", struct.pack(">II", 0, 1), struct.pack(">I4s", 16, b"gpmd"), b"\0" * 8),
        box(b"stts", struct.pack(">IIII", 0, 1, n, duration)),
        box(b"stsc", struct.pack(">IIIII", 0, 1, 1, 1, 1)),
        box(b"stsz", struct.pack(">III", 0, 0, n), *(struct.pack(">I", len(p)) for p in parts)),
        box(b"stco", struct.pack(">II", 0, n), *(struct.pack(">I", o) for o in offsets)),
    )
    mdhd = box(b"mdhd", struct.pack(">IIIII", 0, 0, 0, ticks, n * duration))
    moov = box(b"moov", box(b"trak", box(b"mdia", mdhd, box(b"minf", stbl))))
    return ftyp + mdat + moov


def test_gpmf_scales_orders_and_stamps(tmp_path):
    path = tmp_path / "one.raw"
    path.write_bytes(b"".join(payloads()))
    found = columns(open_stream(path, "imu"))
    # YxZ: the first channel is y, the second -x, the third z.
    np.testing.assert_allclose(found["gyro_y"][0], np.arange(len(found["gyro_y"][0])))
    np.testing.assert_allclose(found["gyro_x"][0], 2.0)
    np.testing.assert_allclose(found["gyro_z"][0], 3.0)
    np.testing.assert_allclose(found["accel_x"][0], 2.0)
    assert found["gyro_x"][1] == "rad/s" and found["accel_x"][1] == "m/s2"
    # STMP is that of the first sample; the last payload is as long as those before.
    np.testing.assert_allclose(found["time"][0], 5.0 + 0.05 * np.arange(len(found["time"][0])))


def test_gps5_has_degrees_heights_and_speed_on_the_clock_of_the_sensors(tmp_path):
    path = tmp_path / "one.raw"
    path.write_bytes(b"".join(payloads()))
    found = columns(open_stream(path, "gnss"))
    assert found["lat"][0][0] == pytest.approx(47.3) and found["lon"][0][0] == pytest.approx(-8.7)
    assert found["alt"][0][0] == 500.0 and found["speed"][0][0] == 1.5
    np.testing.assert_allclose(found["time"][0], [5.0, 5.5, 6.0, 6.5])
    assert set(found["quality"][0]) == {1.0}


def test_heights_over_the_sea_are_not_over_the_ellipsoid_and_no_fix_has_quality_0(tmp_path):
    one = gps5([(473_000_000, -87_000_000, 500_000, 0, 0)], fix=0, system=b"MSLV")
    gyro = sensor(b"GYRO", [(1, 2, 3)] * 4, 10, b"rad/s", stamp=0)
    later = sensor(b"GYRO", [(1, 2, 3)] * 4, 10, b"rad/s", stamp=1_000_000)
    path = tmp_path / "one.raw"
    path.write_bytes(nest(b"DEVC", gyro, one) + nest(b"DEVC", later, one))
    found = columns(open_stream(path, "gnss"))
    assert "alt" not in found and found["alt_msl"][0][0] == 500.0
    assert set(found["quality"][0]) == {0.0}


def test_gps9_states_its_time_and_fix(tmp_path):
    layout = struct.pack(
        ">7lHH", 473_000_000, -87_000_000, 500_000, 1500, 160, 8000, 3_600_500, 120, 3
    )
    scale = struct.pack(">9l", 10_000_000, 10_000_000, 1000, 1000, 100, 1, 1000, 100, 1)
    path = tmp_path / "one.raw"
    parts = []
    for k in range(2):
        parts.append(
            nest(
                b"DEVC",
                sensor(b"GYRO", [(1, 2, 3)] * 4, 10, b"rad/s", stamp=1_000_000 * k),
                nest(
                    b"STRM",
                    klv(b"TYPE", b"c", 9, b"lllllllSS"),
                    klv(b"SCAL", b"l", 4, scale),
                    klv(b"GPS9", b"?", 32, layout),
                ),
            )
        )
    path.write_bytes(b"".join(parts))
    found = columns(open_stream(path, "gnss"))
    assert found["lat"][0][0] == pytest.approx(47.3) and found["quality"][0][0] == 1.0


def test_the_mp4_gives_the_stamps_that_the_payload_lacks(tmp_path):
    path = tmp_path / "GX010001.MP4"
    path.write_bytes(in_mp4(payloads(stamps=False)))
    found = columns(open_stream(path, "imu"))
    np.testing.assert_allclose(found["time"][0], 1.001 / 20 * np.arange(len(found["time"][0])))
    np.testing.assert_allclose(columns(open_stream(path, "gnss"))["time"][0], 0.5005 * np.arange(4))


def test_an_mp4_without_telemetry_is_no_recording(tmp_path):
    path = tmp_path / "a.mp4"
    path.write_bytes(in_mp4(payloads()).replace(b"gpmd", b"text"))
    with pytest.raises(DataError):
        open_stream(path, "imu")


def test_utc_of_the_fixes_gives_stamps_where_there_are_no_others(tmp_path):
    path = tmp_path / "one.raw"
    path.write_bytes(b"".join(payloads(stamps=False)))
    raw = open_stream(path, "imu")
    start = datetime(2021, 4, 15, 15, 33, 42, 500_000, tzinfo=UTC).timestamp()
    np.testing.assert_allclose(columns(raw)["time"][0][:5] - start, 0.05 * np.arange(5), atol=1e-6)
    assert raw.clock == "unix"


def test_payloads_without_any_stamp_are_refused(tmp_path):
    path = tmp_path / "one.raw"
    path.write_bytes(payloads(stamps=False)[0])
    with pytest.raises(DataError, check=coded("io.gpmf-without-stamps")):
        open_stream(path, "imu")


@pytest.mark.parametrize("name", [None, b"Gyroscope"])
def test_an_unknown_order_of_axes_is_refused(tmp_path, name):
    path = tmp_path / "one.raw"
    path.write_bytes(b"".join(payloads(order=None, name=name)))
    with pytest.raises(DataError, check=coded("io.gopro-order-of-axes")):
        open_stream(path, "imu")


@pytest.mark.parametrize("order", [b"(z,x,y)", b"(up/down, right/left, forward/back)"])
def test_the_order_may_stand_in_the_name(tmp_path, order):
    path = tmp_path / "one.raw"
    path.write_bytes(b"".join(payloads(order=None, name=b"Gyroscope " + order)))
    found = columns(open_stream(path, "imu"))
    np.testing.assert_allclose(found["gyro_z"][0], np.arange(len(found["gyro_z"][0])))
    np.testing.assert_allclose(found["gyro_x"][0], -2.0)


def test_telemetry_cut_anywhere_is_read_in_part_or_refused(tmp_path):
    whole = tmp_path / "whole.raw"
    whole.write_bytes(b"".join(payloads()))
    truncations(whole, tmp_path, "imu", 60)
    film = tmp_path / "whole.mp4"
    film.write_bytes(in_mp4(payloads()))
    truncations(film, tmp_path, "imu", 60)


def test_json_of_gopro_telemetry(tmp_path):
    def samples(rows):
        return [{"value": list(r), "cts": 5.0 * k, "date": "…"} for k, r in enumerate(rows)]

    gps = samples([(47.3, -8.7, 500.0, 1.5, 1.6)] * 3)
    gps[0]["sticky"] = {"fix": 0}
    gps[2]["sticky"] = {"fix": 3, "altitude system": "MSLV"}
    streams = {
        "GYRO": {
            "samples": samples([(0.1, 0.2, 0.3)] * 4),
            "name": "Gyroscope (z,x,y)",
            "units": "rad/s",
        },
        "ACCL": {
            "samples": samples([(9.8, 0.2, 0.3)] * 4),
            "name": "Accelerometer (z,x,y)",
            "units": "m/s2",
        },
        "GPS5": {"samples": gps, "name": "GPS (Lat., Long., Alt., 2D speed, 3D speed)"},
    }
    path = tmp_path / "one.json"
    path.write_text(json.dumps({"1": {"streams": streams}, "frames/second": 25}))
    found = columns(open_stream(path, "imu"))
    np.testing.assert_allclose(found["accel_z"][0], 9.8)
    np.testing.assert_allclose(found["gyro_y"][0], 0.3)
    np.testing.assert_allclose(found["time"][0], [0.0, 0.005, 0.010, 0.015])
    fixes = columns(open_stream(path, "gnss"))
    assert "alt" not in fixes
    assert list(fixes["quality"][0]) == [0.0, 0.0, 1.0]
    truncations(path, tmp_path, "imu", 30)


def test_a_sample_of_the_json_without_a_value_is_named(tmp_path):
    path = tmp_path / "one.json"
    content = {"1": {"streams": {"GYRO": {"samples": [{"cts": 0}], "name": "Gyroscope (z,x,y)"}}}}
    path.write_text(json.dumps(content))
    with pytest.raises(DataError, check=coded("io.gopro-json-damaged", quantity="GYRO")):
        open_stream(path, "imu")


def shorts_of(data, key):
    """Find the samples of a sensor by their key, with the divisor before them."""
    out, at = [], 0
    while (at := data.find(key, at)) >= 0:
        letter, size, count = struct.unpack_from(">cBH", data, at + 4)
        scale = struct.unpack_from(">h", data, data.rfind(b"SCAL", 0, at) + 8)[0]
        assert letter == b"s" and size == 6
        values = np.frombuffer(data, ">i2", 3 * count, at + 8).reshape(count, 3)
        out.append(values / scale)
        at += 8
    return np.concatenate(out)


def test_the_payload_of_a_camera(recordings):
    path = recordings("zoo/gopro/hero7.raw")
    found = columns(open_stream(path, "imu"))
    gyro = shorts_of(path.read_bytes(), b"GYRO")
    np.testing.assert_allclose(found["gyro_y"][0], gyro[:, 0])
    np.testing.assert_allclose(found["gyro_x"][0], -gyro[:, 1])
    np.testing.assert_allclose(found["gyro_z"][0], gyro[:, 2])
    accel = np.column_stack([found[f"accel_{a}"][0] for a in "xyz"])
    assert np.linalg.norm(accel.mean(axis=0)) == pytest.approx(9.8, rel=0.3)
    steps = np.diff(found["time"][0])
    assert 1.0 / steps.mean() == pytest.approx(198.0, abs=2.0) and steps.min() > 0.0
    assert read_log(path).imu.shape[0] == len(gyro)


def test_the_json_of_a_camera_without_a_gyro_says_so(recordings):
    with pytest.raises(DataError, check=coded("io.no-gyroscope-read-here-holds")):
        open_stream(recordings("zoo/gopro/merged.json"), "imu")


# --- Garmin FIT -------------------------------------------------------------------------

FIT_TYPES = {
    "enum": (0x00, "B"),
    "u8": (0x02, "B"),
    "u16": (0x84, "H"),
    "s32": (0x85, "i"),
    "u32": (0x86, "I"),
    "f32": (0x88, "f"),
}


def crc_of(data):
    table = [
        0x0000,
        0xCC01,
        0xD801,
        0x1400,
        0xF001,
        0x3C00,
        0x2800,
        0xE401,
        0xA001,
        0x6C00,
        0x7800,
        0xB401,
        0x5000,
        0x9C01,
        0x8801,
        0x4400,
    ]
    crc = 0
    for byte in data:
        for part in (byte & 15, byte >> 4):
            crc = (crc >> 4) & 0x0FFF ^ table[crc & 15] ^ table[part]
    return crc


def fit(*messages):
    """Encode messages: (global number, [(field, type, values)])."""
    body = b""
    for number, fields in messages:
        body += struct.pack("<BBBHB", 0x40, 0, 0, number, len(fields))
        data = b"\0"
        for field, kind, values in fields:
            base, letter = FIT_TYPES[kind]
            packed = struct.pack(f"<{len(values)}{letter}", *values)
            body += struct.pack("<BBB", field, len(packed), base)
            data += packed
        body += data
    head = struct.pack("<BBHI4s", 14, 0x20, 2132, len(body), b".FIT")
    head += struct.pack("<H", crc_of(head))
    return head + body + struct.pack("<H", crc_of(head + body))


EPOCH_FIT = datetime(1989, 12, 31, tzinfo=UTC).timestamp()
STAMP = 1_000_000_000


def moving():
    def record(k):
        return (
            20,
            [
                (253, "u32", [STAMP + k]),
                (0, "s32", [564_000_000 + k]),
                (1, "s32", [-100_000_000]),
                (78, "u32", [(500 + 500) * 5]),
                (73, "u32", [1500]),
                (31, "u8", [4]),
            ],
        )

    return [record(k) for k in range(4)] + [(20, [(253, "u32", [STAMP + 9])])]


def samples(number, first, values, calibrated=None):
    offsets = [0, 10, 20]
    fields = [(253, "u32", [STAMP]), (0, "u16", [250]), (1, "u16", offsets)]
    fields += [(first + k, "u16", list(v)) for k, v in enumerate(values)]
    if calibrated is not None:
        fields += [(5 + k, "f32", list(v)) for k, v in enumerate(calibrated)]
    return number, fields


def test_records_of_fit(tmp_path):
    path = tmp_path / "ride.fit"
    path.write_bytes(fit(*moving()))
    raw = open_stream(path, "gnss")
    found = columns(raw)
    np.testing.assert_allclose(found["lat"][0][0], 564_000_000 * 180 / 2**31)
    np.testing.assert_allclose(found["lon"][0][0], -100_000_000 * 180 / 2**31)
    np.testing.assert_allclose(found["time"][0], EPOCH_FIT + STAMP + np.arange(4))
    assert "alt" not in found and found["alt_msl"][0][0] == 500.0
    assert found["speed"][0][0] == 1.5 and found["horizontal_accuracy"][0][0] == 4.0
    assert [f.data["lost"] for f in raw.findings] == [1]
    with pytest.raises(NoStreamError):
        open_stream(path, "imu")


def test_calibrated_sensors_of_fit(tmp_path):
    path = tmp_path / "camera.fit"
    rates = [(1.0, 2.0, 3.0), (4.0, 5.0, 6.0), (7.0, 8.0, 9.0)]
    forces = [(0.0, 0.1, 0.2), (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)]
    path.write_bytes(
        fit(samples(164, 2, [(0, 0, 0)] * 3, rates), samples(165, 2, [(0, 0, 0)] * 3, forces))
    )
    raw = open_stream(path, "imu")
    found = columns(raw)
    np.testing.assert_allclose(found["gyro_x"][0], rates[0])
    np.testing.assert_allclose(found["accel_x"][0], forces[0], atol=1e-7)
    assert found["gyro_x"][1] == "deg/s" and found["accel_x"][1] == "g"
    stamps = EPOCH_FIT + STAMP + 0.25 + np.array([0.0, 0.01, 0.02])
    np.testing.assert_allclose(found["time"][0], stamps, rtol=0, atol=1e-6)
    assert raw.axes is None and raw.clock == "unix"


def test_counts_of_fit_are_calibrated(tmp_path):
    matrix = [0, 65535, 0, 65535, 0, 0, 0, 0, -65535]
    calibration = (
        167,
        [
            (253, "u32", [STAMP]),
            (0, "enum", [1]),
            (1, "u32", [5]),
            (2, "u32", [2]),
            (3, "u32", [32768]),
            (4, "s32", [1, 2, 3]),
            (5, "s32", matrix),
        ],
    )
    counts = [(32779, 32779, 32779), (32770, 32772, 32774), (32768, 32768, 32768)]
    path = tmp_path / "camera.fit"
    path.write_bytes(fit(calibration, samples(164, 2, counts)))
    found = columns(open_stream(path, "imu"))
    # (counts - level - offset) times 5/2, x and y exchanged, z reversed.
    np.testing.assert_allclose(found["gyro_y"][0], [25.0] * 3)
    np.testing.assert_allclose(found["gyro_x"][0], [0.0, 5.0, 10.0])
    np.testing.assert_allclose(found["gyro_z"][0], [7.5] * 3)


def test_counts_of_fit_without_a_calibration_have_no_unit(tmp_path):
    path = tmp_path / "camera.fit"
    path.write_bytes(fit(samples(164, 2, [(1, 2, 3)] * 3)))
    assert columns(open_stream(path, "imu"))["gyro_x"][1] is None


def test_fit_cut_anywhere_is_refused(tmp_path):
    data = fit(*moving())
    for size in range(14, len(data) - 1, 7):
        path = tmp_path / "cut.fit"
        path.write_bytes(data[:size])
        with pytest.raises(DataError):
            open_stream(path, "gnss")


def test_a_ride_against_fitdecode(recordings):
    fitdecode = pytest.importorskip("fitdecode")
    path = recordings("zoo/garmin_fit/garmin-edge-820-bike.fit")
    found = columns(open_stream(path, "gnss"))
    with fitdecode.FitReader(str(path)) as reader:
        frames = [f for f in reader if f.frame_type == fitdecode.FIT_FRAME_DATA]
    rows = [f for f in frames if f.name == "record" and f.get_value("position_lat", fallback=None)]
    np.testing.assert_allclose(
        found["lat"][0], [f.get_value("position_lat") * 180 / 2**31 for f in rows]
    )
    np.testing.assert_allclose(
        found["time"][0], [f.get_value("timestamp").timestamp() for f in rows]
    )
    np.testing.assert_allclose(
        found["alt_msl"][0], [f.get_value("enhanced_altitude") for f in rows]
    )


def test_a_dive_has_nothing_to_read(recordings):
    with pytest.raises(DataError, check=coded("io.no-known-stream")):
        open_stream(recordings("zoo/garmin_fit/garmin-fr935-cr.fit"), "gnss")


@pytest.mark.parametrize(
    ("name", "library", "stream"),
    [
        ("garmin_fit/garmin-edge-820-bike.fit", "fitdecode", "gnss"),
        ("gpx/around-visnjan-with-car.gpx", "gpxpy", "gnss"),
    ],
)
def test_a_missing_library_is_named(recordings, monkeypatch, name, library, stream):
    path = recordings(f"zoo/{name}")
    without_library(monkeypatch, library)
    expected = coded("io.library-missing", library=library)
    with in_place(), pytest.raises(DataError, check=expected) as caught:
        open_stream(path, stream)
    assert "strapdown[logs]" in str(caught.value)


# --- GPX --------------------------------------------------------------------------------

GPX = """<?xml version="1.0"?>
<gpx version="1.1" creator="test" xmlns="http://www.topografix.com/GPX/1/1"><trk><trkseg>{}</trkseg>
</trk></gpx>"""


def point(k, more="", time=True):
    stamp = f"<time>2020-12-18T06:15:{k:02d}Z</time>" if time else ""
    return f'<trkpt lat="45.{k:02d}" lon="13.5"><ele>{200 + k}</ele>{stamp}{more}</trkpt>'


def test_a_track_against_its_xml(recordings):
    path = recordings("zoo/gpx/around-visnjan-with-car.gpx")
    found = columns(raw := open_stream(path, "gnss"))
    name = "{http://www.topografix.com/GPX/1/1}"
    points = list(ET.parse(path).iter(f"{name}trkpt"))
    np.testing.assert_array_equal(found["lat"][0], [float(p.get("lat")) for p in points])
    np.testing.assert_array_equal(
        found["alt_msl"][0], [float(p.find(f"{name}ele").text) for p in points]
    )
    times = [datetime.fromisoformat(p.find(f"{name}time").text).timestamp() for p in points]
    np.testing.assert_array_equal(found["time"][0], times)
    assert raw.clock == "unix" and "alt" not in found


def test_a_geoid_gives_the_height_over_the_ellipsoid(tmp_path):
    path = tmp_path / "a.gpx"
    more = "<geoidheight>44.5</geoidheight><fix>dgps</fix>"
    path.write_text(GPX.format("".join(point(k, more) for k in range(3))))
    fixes = fixes_of_columns(open_stream(path, "gnss"), GnssOptions())
    np.testing.assert_allclose(fixes.place[:, 2], 244.5 + np.arange(3))
    assert set(fixes.quality) == {2.0}
    assert len(read_gnss(path, GnssOptions(position_sd=5.0))) == 3


def test_points_without_a_time_are_left_out_and_counted(tmp_path):
    path = tmp_path / "a.gpx"
    path.write_text(GPX.format(point(1) + point(2, time=False) + point(3)))
    raw = open_stream(path, "gnss")
    assert list(columns(raw)["lat"][0]) == [45.01, 45.03]
    assert list(raw.rows) == [1, 3] and raw.findings[0].code == "io.points-without-time"
    path.write_text(GPX.format(point(2, time=False)))
    with pytest.raises(DataError, check=coded("io.track-without-time")):
        open_stream(path, "gnss")


def test_a_damaged_track_is_refused(tmp_path, recordings):
    data = recordings("zoo/gpx/around-visnjan-with-car.gpx").read_bytes()
    for size in (1500, 4000, len(data) - 3):
        path = tmp_path / "cut.gpx"
        path.write_bytes(data[:size])
        with pytest.raises(DataError, check=coded("io.track-unreadable")):
            open_stream(path, "gnss")


# --- DJI --------------------------------------------------------------------------------


def subtitles(lines):
    return "\n".join(
        f"{k + 1}\n00:00:{k:02d},500 --> 00:00:{k + 1:02d},000\n{line}\n"
        for k, line in enumerate(lines)
    )


def test_heights_over_the_take_off_are_refused(recordings):
    path = recordings("zoo/dji/p4_rtk.SRT")
    with pytest.raises(DataError, check=coded("io.heights-over-take-off")):
        read_gnss(path, GnssOptions(position_sd=2.0))
    fixes = read_gnss(path, GnssOptions(position_sd=2.0, datum_height=30.0))
    # The first two subtitles: H 85.80m, H 85.83m.
    assert fixes["alt"].iloc[:2].to_list() == [115.8, 115.83]


def test_subtitles_with_an_absolute_height(tmp_path):
    path = tmp_path / "DJI_0001.SRT"
    line = '<font size="28">FrameCnt: 1, DiffTime: 33ms\n2022-05-01 10:11:12.345\n[iso: 100] '
    line += "[latitude: 59.3{}] [longitude: 18.2] [rel_alt: 1.300 abs_alt: 132.860] </font>"
    path.write_text(subtitles([line.format(k) for k in range(4)] + ["HOME"]))
    raw = open_stream(path, "gnss")
    found = columns(raw)
    np.testing.assert_allclose(found["time"][0], 0.5 + np.arange(4))
    np.testing.assert_allclose(found["lat"][0], [59.30, 59.31, 59.32, 59.33])
    assert set(found["lon"][0]) == {18.2} and set(found["alt_unstated"][0]) == {132.86}
    assert raw.clock == "relative" and raw.rows[1] == 8
    assert [f.code for f in raw.findings] == ["io.subtitles-without-place"]


def test_the_older_spelling_and_a_place_of_zeros(tmp_path):
    path = tmp_path / "DJI_0001.SRT"
    line = "[latitude : {}] [longtitude : {}] [altitude: 213.98]"
    path.write_text(subtitles([line.format(0.0, 0.0), line.format(31.45, 74.4)]))
    found = columns(open_stream(path, "gnss"))
    assert list(found["lon"][0]) == [0.0, 74.4] and list(found["quality"][0]) == [0.0, 1.0]


def test_angles_that_may_be_radians_are_refused(tmp_path):
    path = tmp_path / "DJI_0001.SRT"
    path.write_text(
        subtitles(["[latitude: 0.608553] [longtitude: -1.963763] [altitude: 1429.7]"] * 2)
    )
    with pytest.raises(DataError, check=coded("io.srt-degrees-or-radians")):
        open_stream(path, "gnss")


def test_subtitles_cut_anywhere_are_read_or_refused(tmp_path):
    path = tmp_path / "DJI_0001.SRT"
    path.write_text(subtitles(["[latitude: 59.3] [longitude: 18.2] [abs_alt: 132.860]"] * 5))
    truncations(path, tmp_path, "gnss", 40)
