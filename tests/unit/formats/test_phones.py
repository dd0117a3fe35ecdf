"""What applications on phones export; every log here is synthetic, written as documented.

Sensor Logger: README.md, UNITS.md, COORDINATES.md, CROSSPLATFORM.md of
https://github.com/tszheichoi/awesome-sensor-logger. phyphox: docs/file-format/input.md of
https://github.com/phyphox/phyphox-docs. Sensorstream IMU+GPS: ``timestamp, id, v1, v2, v3, id, …``.
"""

from __future__ import annotations

import json
import zipfile

import numpy as np
import pytest
from tests.coded import coded

from strapdown.constants import STANDARD_GRAVITY
from strapdown.errors import ConfigError, DataError
from strapdown.formats import READERS, join, read_log, read_raw
from strapdown.formats.recording import ReadOptions
from strapdown.tables import ACCEL, GYRO, MAG

N = 120
T = np.round(np.arange(N) * 0.01, 2)
RATE = np.column_stack([0.1 + T, -0.2 * T, 0.3 * np.ones(N)])  # about the phone's x, y, z
FORCE = np.column_stack([0.4 * T, 0.2 - T, 9.8 + 0.1 * T])
GRAVITY = np.column_stack([0.0 * T, 0.1 + 0.0 * T, 9.8 + 0.0 * T])


def body(values):
    """Forward is the phone's y, right its x, down its -z."""
    return np.column_stack([values[:, 1], values[:, 0], -values[:, 2]])


def reader_of(path):
    return next(name for name, reader in READERS.items() if reader.detect(path))


def zipped(path, members):
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, text in members.items():
            archive.writestr(name, text)
    return path


def in_folder(path, members):
    for name, text in members.items():
        (path / name).parent.mkdir(parents=True, exist_ok=True)
        (path / name).write_text(text, encoding="utf-8")
    return path


def said(recording, words):
    return [f for f in recording.findings if words in f.what]


# --- Sensor Logger ----------------------------------------------------------------------

EPOCH = 1_707_663_721_345_109_200


def sl_csv(values, shift_ns=0):
    lines = ["time,seconds_elapsed,z,y,x"]
    for t, (x, y, z) in zip(T, values.tolist(), strict=True):
        ns = EPOCH + round(t * 1e9) + shift_ns
        lines.append(f"{ns},{t + shift_ns * 1e-9!r},{z!r},{y!r},{x!r}")
    return "\n".join(lines)


def sl_meta(platform, standardisation=None):
    head, row = "version,device name,platform,appVersion", f"3,phone,{platform},1.30"
    if standardisation is not None:
        head, row = head + ",standardisation", row + f",{standardisation}"
    return f"{head}\n{row}"


def test_sensor_logger_on_android(tmp_path):
    members = {
        "Gyroscope.csv": sl_csv(RATE),
        "TotalAcceleration.csv": sl_csv(FORCE),
        "Accelerometer.csv": sl_csv(FORCE - GRAVITY),
        "Gravity.csv": sl_csv(GRAVITY),
        "Magnetometer.csv": sl_csv(FORCE),
        "Metadata.csv": sl_meta("android"),
        "Location.csv": "time,seconds_elapsed,latitude\n1,2,3",
    }
    sources = zipped(tmp_path / "rec.zip", members), in_folder(tmp_path / "rec", members)
    for source in sources:
        assert reader_of(source) == "sensor-logger"
        recording = read_log(source)
        assert np.array_equal(recording.imu[GYRO], body(RATE))
        assert np.array_equal(recording.imu[ACCEL], body(FORCE))
        # A nanosecond of 1970 is exact; seconds from it round once.
        assert np.allclose(recording.imu.index, T, rtol=0, atol=1e-15)
        assert recording.origin.stamp == EPOCH
    assert recording.files == tuple(
        sources[1] / n for n in sorted(members) if n not in ("Location.csv",)
    )


@pytest.mark.parametrize("platform", ["iOS", "ios"])
@pytest.mark.parametrize("standard", [None, "false", "true"])
def test_sensor_logger_on_ios_turns_the_sign_unless_standardised(tmp_path, platform, standard):
    sign = 1.0 if standard == "true" else -1.0
    recording = read_log(
        zipped(
            tmp_path / "rec.zip",
            {
                "2024-02-11/Gyroscope.csv": sl_csv(RATE),
                "2024-02-11/Accelerometer.csv": sl_csv(sign * (FORCE - GRAVITY)),
                "2024-02-11/Gravity.csv": sl_csv(sign * GRAVITY),
                "2024-02-11/Metadata.csv": sl_meta(platform, standard),
            },
        )
    )
    assert np.array_equal(recording.imu[GYRO], body(RATE))
    # The difference and the sum of numbers below 10 round to half a place of 16 each.
    assert np.allclose(recording.imu[ACCEL], body(FORCE), rtol=0, atol=4e-15)
    # A phone on its back: down is -z of the phone, and specific force points up.
    assert (recording.imu["accel_z"] < -9.7).all()
    assert bool(said(recording, "the sign was inverted")) == (sign < 0)


@pytest.mark.parametrize(("standard", "unit"), [("false", -1 / 9.80665), ("true", 1.0)])
def test_sensor_logger_uncalibrated_on_ios_is_in_g_unless_standardised(tmp_path, standard, unit):
    recording = read_log(
        in_folder(
            tmp_path / "rec",
            {
                "GyroscopeUncalibrated.csv": sl_csv(RATE),
                "AccelerometerUncalibrated.csv": sl_csv(FORCE * unit),
                "Metadata.csv": sl_meta("ios", standard),
            },
        )
    )
    assert np.allclose(recording.imu[ACCEL], body(FORCE), rtol=1e-15, atol=1e-15)
    assert said(recording, "GyroscopeUncalibrated is read")


def test_sensor_logger_without_metadata_leaves_the_sign_to_the_user(tmp_path):
    members = {
        "Gyroscope.csv": sl_csv(RATE),
        "Accelerometer.csv": sl_csv(GRAVITY - FORCE),
        "Gravity.csv": sl_csv(-GRAVITY),
    }
    folder = in_folder(tmp_path / "rec", members)
    recording = read_log(folder)
    assert list(recording.imu.columns) == GYRO
    assert "-m/s2" in said(recording, "the platform is not known")[0].remedy
    recording = read_log(folder, ReadOptions(accel_unit="-m/s2"))
    assert np.allclose(recording.imu[ACCEL], body(FORCE), rtol=0, atol=4e-15)


def test_sensor_logger_sums_sensors_with_stamps_of_their_own(tmp_path):
    late = 3_000_000  # ns
    members = {
        "Gyroscope.csv": sl_csv(RATE),
        "Accelerometer.csv": sl_csv(FORCE - GRAVITY, late),
        "Gravity.csv": sl_csv(GRAVITY, 2 * late),
        "Metadata.csv": sl_meta("android"),
    }
    recording = read_log(in_folder(tmp_path / "rec", members))
    expected = body(np.column_stack([np.interp(T, T + 0.003, FORCE[:, k]) for k in range(3)]))[
        1 + 1 :
    ]
    # Stamps in seconds carry a rounding of 2e-16; slopes are up to 1 a second.
    assert np.allclose(recording.imu[ACCEL], expected, rtol=0, atol=2e-14)
    assert np.allclose(recording.imu.index, T[2:] - T[2], rtol=0, atol=1e-15)
    assert said(recording, "is the sum of rec/Accelerometer.csv and rec/Gravity.csv, interpolated")
    assert said(recording, "2 of 120 rows dropped")


def test_sensor_logger_json(tmp_path):
    records = [{"sensor": "Metadata", "platform": "ios", "version": "3"}]
    for sensor, values in {
        "Accelerometer": GRAVITY - FORCE,
        "Gravity": -GRAVITY,
        "Gyroscope": RATE,
        "Location": FORCE,
    }.items():
        for t, row in zip(T, values.tolist(), strict=True):
            stamps = {"time": str(EPOCH + round(t * 1e9)), "seconds_elapsed": str(t)}
            xyz = {a: str(v) for a, v in zip("zyx", row[::-1], strict=True)}
            records.append({"sensor": sensor, **stamps, **xyz})
    path = tmp_path / "rec.json"
    path.write_text(json.dumps(records))
    assert reader_of(path) == "sensor-logger"
    recording = read_log(path)
    assert np.array_equal(recording.imu[GYRO], body(RATE))
    assert np.allclose(recording.imu[ACCEL], body(FORCE), rtol=0, atol=4e-15)

    records[1 + 2 * N + 4]["x"] = "n/a"
    path.write_text(json.dumps(records))
    with pytest.raises(DataError, match=r"rec\.json/Gyroscope, row 246, x: 'n/a' is not a number"):
        read_log(path)
    path.write_text(json.dumps(records)[:5000])
    with pytest.raises(DataError, check=lambda refused: refused.finding.code == "io.no-json"):
        read_log(path)
    path.write_text(json.dumps(records[:N]))
    with pytest.raises(
        DataError, check=lambda refused: refused.finding.code == "io.no-gyroscope-read-here-holds"
    ):
        read_log(path)


def test_sensor_logger_single_file(tmp_path):
    path = tmp_path / "Gyroscope (1).csv"
    path.write_text(sl_csv(RATE))
    assert reader_of(path) == "sensor-logger"
    assert np.array_equal(read_log(path).imu[GYRO], body(RATE))
    alone = tmp_path / "Accelerometer.csv"
    alone.write_text(sl_csv(RATE))
    with pytest.raises(
        DataError, check=lambda refused: refused.finding.code == "io.no-gyroscope-read-here-holds"
    ):
        read_log(alone)
    # Under another name nothing says which sensor it is.
    other = path.rename(tmp_path / "log.csv")
    assert reader_of(other) == "csv"


# --- phyphox ----------------------------------------------------------------------------

SHAPES = {"comma": (",", "."), "tab": ("\t", "."), "semicolon": (";", "."), "german": (";", ",")}


def px_csv(head, t, values, shape="comma"):
    separator, point = SHAPES[shape]
    lines = [separator.join(f'"{h}"' for h in ["Time (s)", *head])]
    for s, row in zip(t, values, strict=True):
        lines.append(separator.join(f"{v:.15E}".replace(".", point) for v in [s, *row]))
    return "\n".join(lines) + "\n"


def px_gyro(shape="comma"):
    head = [*(f"Gyroscope {a} (rad/s)" for a in "xyz"), "Absolute (rad/s)"]
    return px_csv(head, T, np.column_stack([RATE, np.linalg.norm(RATE, axis=1)]), shape)


def px_accel(t, values, name="Acceleration", shape="comma"):
    return px_csv([f"{name} {a} (m/s^2)" for a in "xyz"], t, values, shape)


@pytest.mark.parametrize("shape", SHAPES)
def test_phyphox(tmp_path, shape):
    own = np.round(np.arange(-1, N + 1) * 0.01 + 0.004, 3)
    force = np.column_stack([np.interp(own, T, FORCE[:, k]) for k in range(3)])
    inner = slice(1, N - 1)
    members = {
        "Gyroscope.csv": px_gyro(shape),
        "Accelerometer.csv": px_accel(own, force, shape=shape),
        "Linear Accelerometer.csv": px_accel(T, FORCE - GRAVITY, "Linear Acceleration", shape),
        "meta/device.csv": '"property","value"\n"version","1.1.13"\n',
        "meta/time.csv": '"event","experiment time","system time","system time text"\n'
        '"START",0.0E0,1706981087.059,"2024-02-03 19:24:47.059 UTC+02:00"\n'
        '"PAUSE",6.0E-1,1706981087.659,"2024-02-03 19:24:47.659 UTC+02:00"\n'
        '"START",6.0E-1,1706981092.659,"2024-02-03 19:24:52.659 UTC+02:00"\n'
        '"PAUSE",1.2E0,1706981093.259,"2024-02-03 19:24:53.259 UTC+02:00"\n',
    }
    for source in (zipped(tmp_path / "raw.zip", members), in_folder(tmp_path / "raw", members)):
        assert reader_of(source) == "phyphox"
        recording = read_log(source)
        assert np.array_equal(recording.imu.index, T)
        # Sixteen digits were written, and one more would be needed.
        assert np.allclose(recording.imu[GYRO], body(RATE), rtol=1e-15, atol=0)
        assert np.allclose(recording.imu[ACCEL][inner], body(FORCE)[inner], rtol=0, atol=1e-13)
        assert said(recording, "paused for 5 s at 0.6 s")
        assert said(recording, "without gravity")
    assert tmp_path / "raw" / "meta" / "time.csv" in recording.files


def test_phyphox_single_file(tmp_path):
    path = tmp_path / "Raw Data.csv"
    path.write_text(px_gyro("german"))
    assert reader_of(path) == "phyphox"
    imu = read_log(path).imu
    assert np.allclose(imu[GYRO], body(RATE), rtol=1e-15, atol=0)
    path.write_text(px_accel(T, FORCE))
    with pytest.raises(
        DataError, check=lambda refused: refused.finding.code == "io.no-gyroscope-holds"
    ) as error:
        read_log(path)
    assert "gyroscope switched on" in error.value.finding.remedy


# --- Sensorstream -----------------------------------------------------------------------


def ss_lines(ids=(3, 4, 5), space=" "):
    blocks = {3: FORCE, 4: RATE, 5: 10 * FORCE, 82: FORCE - GRAVITY, 83: GRAVITY}
    lines = []
    for k in range(N):
        fields = [f"{T[k] + 890.71:.5f}"]
        for kind in ids:
            fields.append(str(kind))
            if kind in (85, 86):
                fields.append("1013.25")
            elif kind in blocks:
                fields += [repr(v) for v in blocks[kind][k].tolist()]
            else:
                fields += ["52.1", "13.2", "80.0"]
        lines.append(f",{space}".join(fields))
    return lines


@pytest.mark.parametrize("space", ["", " ", "   "])
@pytest.mark.parametrize("ids", [(3, 4, 5), (1, 3, 4, 5, 81, 84, 85, 86), (85, 4, 3), (4, 82, 83)])
def test_sensorstream(tmp_path, ids, space):
    path = tmp_path / "log.csv"
    path.write_text("\n".join(ss_lines(ids, space)) + "\n")
    assert reader_of(path) == "sensorstream"
    recording = read_log(path)
    assert np.array_equal(recording.imu[GYRO], body(RATE))
    assert np.allclose(recording.imu[ACCEL], body(FORCE), rtol=0, atol=4e-15)
    assert np.array_equal(recording.imu.index, np.round(T + 890.71, 5))


def test_sensorstream_lines_without_a_block(tmp_path):
    lines = ss_lines((3, 4))
    for k in range(0, N, 4):
        lines[k] = ss_lines((3,))[k]
    for k in (9, 10):
        lines[k] = ss_lines((4,))[k]
    lines[5] = lines[5] + ","
    path = tmp_path / "udp.txt"
    path.write_text("\n\n".join(lines[:-1]) + "\n" + lines[-1][:20])
    recording = read_log(path)
    rows = [k for k in range(N - 1) if k % 4]
    assert np.array_equal(recording.imu[GYRO], body(RATE)[rows])
    # Values are straight lines in time, so that the missing ones are those of the line; time
    # itself is known to 1e-13 s here.
    assert np.allclose(recording.imu[ACCEL], body(FORCE)[rows], rtol=0, atol=1e-12)
    assert said(recording, "lines have no gyroscope")
    assert said(recording, "the last line is incomplete")
    assert said(recording, "interpolated to 89 stamps")


def test_sensorstream_faults(tmp_path):
    path = tmp_path / "log.csv"
    lines = ss_lines()
    lines[40] = lines[40].replace(", 4, ", ", 44, ")
    path.write_text("\n".join(lines) + "\n")
    with pytest.raises(DataError, match=r"log\.csv, row 41: '891\.11.*' is not a stamp and blocks"):
        read_log(path)
    path.write_text("\n".join(ss_lines((3, 5))) + "\n")
    with pytest.raises(
        DataError, check=lambda refused: refused.finding.code == "io.no-line-gyroscope-id-ids"
    ):
        read_log(path)
    path.write_bytes(b"\xff\xfe\x00" + "\n".join(ss_lines()).encode())
    with pytest.raises(DataError):
        read_log(path)


@pytest.mark.parametrize(
    "lines",
    [
        ["time_s,gyro_x_rad_s,gyro_y_rad_s,gyro_z_rad_s"] + [f"{t},3,0,0" for t in T],
        [f"{t},{0.1 * t},0,0.25" for t in T],
        [f"{t},3,{k},0.2,0.25,7" for k, t in enumerate(T)],
        [f"{t},3.0,0.1,0.2,0.25" for t in T],
    ],
)
def test_a_plain_table_is_not_taken_for_sensorstream(tmp_path, lines):
    path = tmp_path / "log.csv"
    path.write_text("\n".join(lines) + "\n")
    assert reader_of(path) == "csv"


# --- MetaBase ---------------------------------------------------------------------------

BOARD = "MetaWear_2019-11-08T21.48.43.456_C9228E7A1F3D_{}_100.000Hz_1.4.5.csv"


def of_board(values, unit, first_ms, clock="epoch"):
    """Seconds elapsed begin with the sensor's own first sample."""
    axes = ",".join(f"{a}-axis ({unit})" for a in "xyz")
    rows = [
        f"{1_573_246_123_000 + first_ms + 10 * k},2019-11-08T21.48.43.{k:03d},{k / 100:.3f},"
        + ",".join(map(repr, v.tolist()))
        for k, v in enumerate(values)
    ]
    return "\n".join([f"{clock} (ms),time (01:00),elapsed (s),{axes}", *rows]) + "\n"


@pytest.mark.parametrize("clock", ["epoch", "epoc"])
def test_the_tables_of_a_board_are_joined_by_the_clock_that_they_share(tmp_path, clock):
    tables = {
        "Accelerometer": of_board(FORCE / STANDARD_GRAVITY, "g", 3, clock),
        "Gyroscope": of_board(np.degrees(RATE), "deg/s", 8, clock),
        "Magnetometer": of_board(np.tile([2e-5, -1e-5, 4e-5], (N, 1)), "T", 8, clock),
        "Linear_Acceleration": of_board(RATE, "g", 8, clock),
        "Pressure": "epoch (ms),pressure (Pa)\n1573246123000,101325\n",
    }
    folder = in_folder(tmp_path / "run", {BOARD.format(k): text for k, text in tables.items()})
    recording = read_log(folder)
    imu = recording.imu
    # Of N samples at 100 Hz the last of the gyro is after that of the accelerometer, and the force,
    # half a step later, is in the middle of two that lie on a line.
    assert len(imu) == N - 1
    np.testing.assert_allclose(imu[GYRO], RATE[:-1], atol=1e-15)
    np.testing.assert_allclose(imu[ACCEL], 0.5 * (FORCE[1:] + FORCE[:-1]), atol=1e-14)
    np.testing.assert_allclose(imu[MAG], np.tile([20.0, -10.0, 40.0], (N - 1, 1)), atol=1e-12)
    assert imu.attrs["clock"] == "unix"
    (unused,) = [f for f in recording.findings if f.code == "io.tables-not-used"]
    assert unused.data["names"] == tuple(
        BOARD.format(k) for k in ("Linear_Acceleration", "Pressure")
    )


def test_a_folder_of_two_boards_is_a_question(tmp_path):
    names = ("Left_Gyroscope.csv", "Right_Gyroscope.csv")
    folder = in_folder(tmp_path / "both", dict.fromkeys(names, of_board(RATE, "deg/s", 0)))
    with pytest.raises(ConfigError, check=coded("io.gyro-in-several-logs")) as refused:
        read_log(folder)
    assert len(refused.value.finding.data["have"]) == 2


def test_a_table_that_only_has_the_name_of_a_sensor_in_its_own_is_none_of_it(tmp_path):
    text = of_board(RATE, "deg/s", 0)
    of_names = text.replace("-axis (deg/s)", " offset")
    assert reader_of(in_folder(tmp_path / "a", {"my_gyroscope_1.csv": text})) == "sensor-folder"
    other = in_folder(tmp_path / "b", {"my_gyroscope_1.csv": of_names})
    assert not READERS["sensor-folder"].detect(other)
    for names in ("{}_value", "value {}", "{}"):
        of_axes = text
        for axis in "xyz":
            of_axes = of_axes.replace(f"{axis}-axis (deg/s)", names.format(axis.upper()))
        named = in_folder(tmp_path / names.replace("{}", "c"), {"kinetics_gyro.csv": of_axes})
        assert reader_of(named) == "sensor-folder"


# --- archives ---------------------------------------------------------------------------


def test_archives_that_cannot_be_used_are_refused_by_name(tmp_path):
    path = zipped(tmp_path / "rec.zip", {"Gyroscope.csv": sl_csv(RATE)})
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(DataError, check=coded("io.zip-unreadable", file="rec.zip")):
        read_log(path)
    broken = bytearray(whole)
    broken[200] ^= 0xFF
    path.write_bytes(bytes(broken))
    with pytest.raises(
        DataError,
        match=r"rec\.zip/Gyroscope\.csv",
        check=lambda refused: refused.finding.code == "io.member-unreadable",
    ):
        read_log(path)
    with pytest.raises(
        DataError, check=lambda refused: refused.finding.code == "io.no-table-gyro-holds"
    ):
        read_log(zipped(tmp_path / "other.zip", {"notes.txt": "hello"}))
    with pytest.raises(DataError, check=coded("io.file-empty", file="Gyroscope.csv")):
        read_log(zipped(tmp_path / "empty.zip", {"Gyroscope.csv": ""}))
    two = {"a/Gyroscope.csv": sl_csv(RATE), "b/Gyroscope.csv": sl_csv(RATE)}
    with pytest.raises(DataError, check=coded("io.two-of-a-kind")):
        read_log(zipped(tmp_path / "two.zip", two))


def test_a_bomb_is_refused_before_it_unfolds(tmp_path):
    members = {"Gyroscope.csv": sl_csv(RATE)[:200] + "0" * 80_000_000}
    with pytest.raises(
        DataError, check=lambda refused: refused.finding.code == "io.claims-bytes-stored"
    ):
        read_raw(zipped(tmp_path / "rec.zip", members))


def test_a_faulty_row_of_a_member_is_named_by_member_and_row(tmp_path):
    lines = sl_csv(RATE).splitlines()
    lines[7] = lines[7].rsplit(",", 1)[0] + ",nan"
    with pytest.raises(
        DataError, match=r"rec\.zip/Gyroscope\.csv, row 8, gyro_x: nan .*'Gyroscope\.csv/x'"
    ):
        read_log(zipped(tmp_path / "rec.zip", {"Gyroscope.csv": "\n".join(lines)}))
    lines[7] = lines[7] + ",1"
    with pytest.raises(DataError, match=r"rec\.zip/Gyroscope\.csv, row 8: 6 fields"):
        read_log(zipped(tmp_path / "rec.zip", {"Gyroscope.csv": "\n".join(lines)}))


def test_a_folder_of_an_export_runs_and_runs_again_from_its_copy(tmp_path, run_cli):
    members = {
        "Gyroscope.csv": px_gyro(),
        "meta/time.csv": '"event","experiment time","system time"\n"START",0,1\n"PAUSE",1.2,2.2\n',
    }
    source = in_folder(tmp_path / "raw", members)
    assert run_cli("attitude", source, "--out", tmp_path / "out").code == 0
    copy = tmp_path / "out" / "inputs" / "log" / "raw"
    assert {p.relative_to(copy).as_posix() for p in copy.rglob("*.csv")} == set(members)
    assert run_cli("verify", tmp_path / "out").code == 0


@pytest.mark.parametrize("known", [False, True])
def test_a_magnetometer_is_handed_through_and_stated_where_it_is_a_quantity(
    tmp_path, monkeypatch, known
):
    mag = [f"mag_{a}" for a in "xyz"]
    others = [q for q in join.QUANTITIES if q not in mag]
    monkeypatch.setattr(join, "QUANTITIES", [*others, *(mag if known else [])])
    path = tmp_path / "log.csv"
    path.write_text("\n".join(ss_lines((4, 5))) + "\n")
    raw = read_raw(path)
    field = [f"magnetic field/{a}" for a in "xyz"]
    assert np.array_equal(np.column_stack([raw.columns[f] for f in field]), 10 * FORCE)
    said_of = dict(raw.stated.values())
    assert {q: u for q, u in said_of.items() if q in mag} == (
        dict.fromkeys(mag, "uT") if known else {}
    )
