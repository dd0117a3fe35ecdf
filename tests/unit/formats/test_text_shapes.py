"""Text tables in the shapes that loggers, boards and spreadsheets give them."""

from __future__ import annotations

import numpy as np
import pytest
from tests.coded import coded

from strapdown.errors import DataError
from strapdown.formats import csv, read_log, read_raw, text_columns
from strapdown.formats.arrays import epoch_of, nanoseconds_of, nanoseconds_of_epoch
from strapdown.formats.clocks import counted
from strapdown.formats.csv import stated_rate, stated_units
from strapdown.formats.recording import ReadOptions
from strapdown.formats.text_columns import BLOCK, columns_at_once
from strapdown.tables import ACCEL, GYRO

N = 40
RATES, FORCE = (131, -262, 393), (0, 0, 16384)
SENSORS = "gx,gy,gz,ax,ay,az"
NAMED = "gx_dps,gy_dps,gz_dps,ax_g,ay_g,az_g"


def written(tmp_path, lines, name="log.csv", encoding="utf-8"):
    path = tmp_path / name
    path.write_bytes(("\n".join(lines) + "\n").encode(encoding))
    return path


def table(names, stamps, values=(1, -2, 3, 0, 0, 1)):
    return [names, *(",".join([s, *map(str, values)]) for s in stamps)]


MILLIS = [str(10 * k) for k in range(N)]


@pytest.mark.parametrize(
    "said",
    [
        "Gyro scale: 131 LSB/dps, Accel scale: 16384 LSB/g",
        "raw LSB; gyro sensitivity 131 LSB/(deg/s); accel sensitivity 16384 LSB/g",
        "angular rate 131 counts per deg/s; acceleration 16384 digits/g",
    ],
)
def test_counts_per_unit_above_the_table(tmp_path, said):
    imu = read_log(
        written(tmp_path, [said, *table("time_ms," + SENSORS, MILLIS, RATES + FORCE)])
    ).imu
    assert np.allclose(np.degrees(imu[GYRO].to_numpy()[0]), (1, -2, 3), rtol=1e-12)
    assert np.allclose(imu[ACCEL].to_numpy()[0], (0, 0, 9.80665), rtol=1e-12)


@pytest.mark.parametrize(
    ("above", "unit"),
    [
        (["gyro: deg/s, accel: g"], {"gyro": "deg/s", "accel": "g"}),
        (
            ["Units: angular rate in rad/s; acceleration in m/s^2"],
            {"gyro": "rad/s", "accel": "m/s2"},
        ),
        (["Gyroscope unit = deg/s", "Accelerometer unit = g"], {"gyro": "deg/s", "accel": "g"}),
        (["Gyro: rad s^-1, accel in m s⁻²"], {"gyro": "rad/s", "accel": "m/s2"}),
        (
            ["acceleration m/s2, angular velocity deg/s, magnetic field uT"],
            {"gyro": "deg/s", "accel": "m/s2", "mag": "uT"},
        ),
        (["gyro ±250 deg/s, accel ±2 g, 16 bit"], {"gyro": "deg/s/131.072", "accel": "g/16384"}),
        (
            ["GYRO_FS_500 ACCEL_FS_4 raw int16"],
            {"gyro": "deg/s/65.536", "accel": "g/8192"},
        ),
        (["acc 0.061 mg/LSB"], {"accel": "0.061 mg"}),
        (["acc 6.1e-5 g/LSB"], {"accel": "6.1e-5 g"}),
        # Not statements of a unit.
        (["gyro ±250 deg/s, accel ±2 g"], {}),
        (["sensors: gyro, accel, mag"], {}),
        (["accuracy g: 0.1"], {}),
        (["gyro bias in deg/s: 0.1 0.2 0.3", "accel: 2.5 g max"], {}),
    ],
)
def test_what_a_preamble_states_of_units(above, unit):
    assert stated_units(above, {"gx": np.arange(5), "ax": np.arange(5)}) == unit


def test_a_range_is_no_unit_of_numbers_with_decimals():
    columns = {"gx": np.array([0.5, 1.0])}
    assert stated_units(["gyro ±250 deg/s, 16 bit"], columns) == {}


def test_a_name_of_a_column_is_no_statement(tmp_path):
    lines = table("t,mag,T,gyro,dps,x,y", MILLIS)
    assert read_raw(written(tmp_path, lines)).triad_units == {}


@pytest.mark.parametrize(
    ("line", "rate"),
    [
        ("Sampling frequency (Hz): 50", 50.0),
        ("SampleRate=100", 100.0),
        ("ODR 104 Hz", 104.0),
        ("output rate .5 Hz", 0.5),
        ("simulation output, dt = 0.02 s", 50.0),
        ("data rate: 9600 baud", None),
    ],
)
def test_rates_above_a_table(line, rate):
    assert stated_rate([line]) == rate


@pytest.mark.parametrize("sign", [": ", "=", " = ", ":"])
@pytest.mark.parametrize("between", [", ", " ", "\t", " | "])
def test_lines_of_labelled_values(tmp_path, sign, between):
    names = ["t_ms", *NAMED.split(",")]
    lines = ["board v2"] + [
        between.join(
            f"{n}{sign}{v}" for n, v in zip(names, (10 * k, 1, -2, 3, 0, 0, 1), strict=True)
        )
        for k in range(N)
    ]
    imu = read_log(written(tmp_path, [*lines[:20], "--- pause ---", *lines[20:]])).imu
    assert len(imu) == N
    assert np.allclose(np.degrees(imu[GYRO].to_numpy()), (1, -2, 3))
    assert imu.index[-1] == pytest.approx(0.39)


def test_units_of_labelled_values(tmp_path):
    lines = [f"t: {10 * k} ms, gx: 1 dps, gy: -2 dps, gz: 3 dps" for k in range(N)]
    imu = read_log(written(tmp_path, lines)).imu
    assert np.allclose(np.degrees(imu[GYRO].to_numpy()), (1, -2, 3))


def test_the_arrival_at_a_serial_monitor_is_a_clock(tmp_path):
    stamps = [f"23:59:59.{800 + 10 * k:03d}" if k < 20 else f"00:00:00.{10 * (k - 20):03d}"
              for k in range(N)]  # fmt: skip
    rows = [NAMED] + ["1,-2,3,0,0,1"] * N
    lines = [f"{s} -> {r}" for s, r in zip([stamps[0], *stamps], rows, strict=True)]
    imu = read_log(written(tmp_path, lines, "log.txt")).imu
    assert np.allclose(np.diff(imu.index), 0.01)
    # The board's own clock is the better one.
    own = [f"{stamps[0]} -> time_ms,{NAMED}"]
    own += [f"{s} -> {20 * k},1,-2,3,0,0,1" for k, s in enumerate(stamps)]
    assert np.allclose(np.diff(read_log(written(tmp_path, own)).imu.index), 0.02)


STAMPS = ("2024-06-19 15:27:08.500", "2024-06-19 15:27:08.510")
BASE = int(np.datetime64("2024-06-19T15:27:08.5", "ns").astype(np.int64))


@pytest.mark.parametrize(
    ("first", "origin"),
    [
        ("2024-06-19 15:27:08:500", BASE),
        ("2024/06/19 15:27:08,500", BASE),
        ("19.06.2024 15:27:08.5", BASE),
        ("19.06.24 15:27:08.5", BASE),
        ("06/19/2024 3:27:08.5 PM", BASE),
        ("19/06/2024T15:27:08.5Z", BASE),
        ("2024-06-19 17:27:08.5+02:00", BASE),
        # Day and month cannot be told apart; a time of day alone.
        ("01/06/2024 15:27:08.5", (15 * 3600 + 27 * 60 + 8.5) * 1e9),
        ("15:27:08:500", (15 * 3600 + 27 * 60 + 8.5) * 1e9),
    ],
)
def test_orders_of_dates(first, origin):
    assert nanoseconds_of([first]) == [origin]


@pytest.mark.parametrize("text", ["32.13.2024 12:00:00", "25:00:00", "12:61:00", "x", None])
def test_what_is_neither_date_nor_time_of_day(text):
    found = nanoseconds_of([text])
    assert found is None or found[0] == 12 * 3600 * 10**9


def test_a_date_and_a_time_in_two_columns(tmp_path):
    stamps = [f"19.06.2024,23:59:59.{800 + 10 * k:03d}" if k < 20
              else f"20.06.2024,00:00:00.{10 * (k - 20):03d}" for k in range(N)]  # fmt: skip
    imu = read_log(written(tmp_path, table(f"Date,Time,{NAMED}", stamps))).imu
    assert np.allclose(np.diff(imu.index), 0.01)
    assert imu.attrs["clock"] == "unix"


def test_a_time_of_day_is_no_clock_of_1970(tmp_path):
    stamps = [f"12:30:01,{10 * k:03d}".replace(",", ":") for k in range(N)]
    imu = read_log(written(tmp_path, table(f"time,{NAMED}", stamps))).imu
    assert np.allclose(np.diff(imu.index), 0.01)
    assert imu.attrs["clock"] == "relative"


def test_days_of_a_spreadsheet():
    days = 45000.25 + np.arange(5) * 0.01 / 86400
    ns = nanoseconds_of_epoch(days, epoch_of(days))
    assert ns[0] == np.datetime64("2023-03-15T06:00:00", "ns").astype(np.int64)
    assert np.allclose(np.diff(ns), 1e7, atol=2e3)
    assert epoch_of(45000.25 + np.arange(5) * 0.01) is None  # seconds since a start
    assert epoch_of(np.arange(45000, 45005)) is None


def test_seconds_and_nanoseconds_in_two_columns(tmp_path):
    stamps = [f"1612345678,{10_000_000 * k + 5}" for k in range(N)]
    names = "header.stamp.secs,header.stamp.nsecs," + NAMED
    imu = read_log(written(tmp_path, table(names, stamps))).imu
    assert np.allclose(np.diff(imu.index), 0.01, atol=1e-12)


def test_a_packet_counter_counts_lost_samples(tmp_path):
    count = np.delete((np.arange(N + 3) + 250) % 256, [10, 11, 30])
    lines = ["# Sample rate: 100 Hz", *table("PacketCounter," + NAMED, map(str, count))]
    log = read_log(written(tmp_path, lines))
    assert log.imu.index[-1] == pytest.approx((N + 2) / 100.0)
    assert [f.data["lost"] for f in log.findings if f.code == "io.time-from-counter"] == [3]


def test_a_packet_counter_is_never_a_time(tmp_path):
    lines = table("PacketCounter," + NAMED, map(str, range(N)))
    with pytest.raises(DataError, check=coded("io.time-column-missing")):
        read_log(written(tmp_path, lines))
    lines.insert(15, lines[14])
    with pytest.raises(DataError, check=coded("io.stamp-repeated", row=16)):
        read_log(written(tmp_path, lines), ReadOptions(rate=100.0))
    assert counted({"sample": np.arange(0, 90, 3)}) is None
    assert counted({"sample": np.arange(9) * 0.5}) is None


def test_bars_between_fields(tmp_path):
    names = "time_s,_x | gx,rad/s | gy,rad/s | gz,rad/s|"
    lines = [names] + [f"{0.01 * k:.2f} | 0.1 | 0.2 | 0.3|" for k in range(N)]
    raw = read_raw(written(tmp_path, lines))
    assert [c.dtype.kind for c in raw.columns.values()] == ["f"] * 4
    assert csv.separator_of("t,ax,ay,|a|") == ","


@pytest.mark.parametrize("encoding", ["utf-16-le", "utf-16-be", "utf-16", "utf-8-sig", "cp1252"])
def test_encodings_with_and_without_a_mark(tmp_path, encoding):
    lines = table("time (ms)," + ",".join(f"g{a} (°/s)" for a in "xyz") + ",ax_g,ay_g,az_g", MILLIS)
    encoded = "".join(line + "\n" for line in lines).encode(encoding)
    if encoding.startswith("utf-16-"):
        encoded = encoded.replace("°".encode(encoding), "d".encode(encoding))
        encoded = encoded.replace("d/s".encode(encoding), "dps".encode(encoding))
    path = tmp_path / "log.log"
    path.write_bytes(encoded)
    assert np.allclose(np.degrees(read_log(path).imu[GYRO].to_numpy()), (1, -2, 3))


def test_too_many_columns_are_refused(tmp_path):
    lines = [",".join(["1.0"] * (text_columns.MOST_COLUMNS + 1))] * 3
    with pytest.raises(DataError, check=coded("io.csv-too-many-columns", row=1)):
        read_log(written(tmp_path, lines))


@pytest.mark.parametrize(
    "damage", [b'"', b"\0", b"\r", b"\x85", b"1" * 400, b'"' + b"x" * 200_000, b"0xFF", b"\n\n"]
)
@pytest.mark.parametrize("at", [0, 30, 400, -1])
def test_damaged_bytes_end_in_numbers_or_in_an_error_of_the_package(tmp_path, damage, at):
    data = ("\n".join(table("time_ms," + NAMED, MILLIS)) + "\n").encode()
    at = at % len(data)
    path = tmp_path / "log.csv"
    path.write_bytes(data[:at] + damage + data[at:])
    try:
        imu = read_log(path).imu
    except DataError as error:
        assert error.finding.code != "io.not-of-format"
    else:
        assert len(imu) >= N - 2


def labview(mark=".", units=("g",) * 3 + ("deg/s",) * 3, x="X_Value"):
    end = "***End_of_Header***"
    names = [*([x] if x else []), *(f"Acc {a}" for a in "XYZ"), *(f"Gyro {a}" for a in "XYZ")]
    rows = [
        "\t".join([*([f"{0.01 * k:.2f}"] if x else []), "0.0", "0.0", "1.0", "1.0", "-2.0", "3.5"])
        for k in range(N)
    ]
    return [
        "LabVIEW Measurement\t", f"Decimal_Separator\t{mark}", "Time\t13:05:22,44", end, "\t",
        "Channels\t6", "Y_Unit_Label\t" + "\t".join(units), "Delta_X" + "\t0,010000" * 6, end,
        "\t".join([*names, "Comment"]), *(r.replace(".", mark) for r in rows),
    ]  # fmt: skip


@pytest.mark.parametrize("mark", [".", ","])
@pytest.mark.parametrize("x", ["X_Value", ""])
def test_a_measurement_of_labview(tmp_path, mark, x):
    imu = read_log(written(tmp_path, labview(mark, x=x), "run.lvm")).imu
    assert np.allclose(np.degrees(imu[GYRO].to_numpy()), (1, -2, 3.5))
    assert np.allclose(imu[ACCEL].to_numpy(), (0, 0, 9.80665))
    assert imu.index[-1] == pytest.approx(0.39)


def test_a_second_measurement_of_labview_is_refused(tmp_path):
    lines = labview()
    with pytest.raises(DataError, check=coded("io.labview-headers", count=3)):
        read_log(written(tmp_path, [*lines, *lines[5:]], "run.lvm"))


# Blocks.


def long_text(last=b"", rows=BLOCK // 8):
    body = b"".join(b"%d,%d.25,7\n" % (k, k) for k in range(rows))
    assert len(body) > BLOCK
    return body + last


def both(tmp_path, data):
    path = tmp_path / "long.csv"
    path.write_bytes(data)
    of_bytes, of_file = columns_at_once(data, 3, ","), columns_at_once(path, 3, ",")
    if of_bytes is None:
        assert of_file is None
        return None
    for one, other in zip(of_bytes, of_file, strict=True):
        assert one.dtype == other.dtype
        np.testing.assert_array_equal(one, other)
    return of_file


def test_blocks_of_a_long_text(tmp_path):
    rows = BLOCK // 8
    columns = both(tmp_path, long_text())
    assert [c.dtype.kind for c in columns] == ["i", "f", "i"]
    np.testing.assert_array_equal(columns[0], np.arange(rows))
    np.testing.assert_array_equal(columns[1], np.arange(rows) + 0.25)


@pytest.mark.parametrize("last", [b"1,2,7.5\n", b"1,,nan\n", b"1,2,7.5"])
def test_numbers_that_come_late(tmp_path, last):
    columns = both(tmp_path, long_text(last))
    assert columns[2].dtype == np.float64
    assert columns[2][0] == 7.0
    assert np.isnan(columns[2][-1]) if b"nan" in last else columns[2][-1] == 7.5


@pytest.mark.parametrize(
    "last",
    [b"1,2\n", b"1,2,3,4\n", b"\n", b"1,2,0xFF\n", b'1,2,"3"\n', b"1,2,word\n", b"\n1,2,3\n"],
)
def test_oddities_that_come_late_are_not_read_at_once(tmp_path, last):
    assert both(tmp_path, long_text(last)) is None


def test_a_preamble_filled_up_with_separators(tmp_path):
    """As spreadsheets write it: every line has as many fields as the rows."""
    above = ["Made by,logger 3,,,,,", "Sample Rate:,100,Hz,,,,", "Time,gx,gy,gz,ax,ay,az"]
    units = ["s,deg/s,deg/s,deg/s,m/s^2,m/s^2,m/s^2"]
    rows = [f"{k / 100},1.5,2,3.25,0.1,0.2,-9.8" for k in range(20)]
    for lines in (above + rows, above + units + rows):
        path = tmp_path / "a.csv"
        path.write_text("\n".join(lines) + "\n")
        raw = csv.read(path)
        assert list(raw.columns) == above[2].split(",")
        assert raw.rate == 100.0
        assert raw.columns["gz"].tolist() == [3.25] * 20
        assert raw.units.get("gx") == ("deg/s" if units[0] in lines else None)
        assert raw.row(0) == len(lines) - 19


@pytest.mark.parametrize("end", ["", "\n", "\n7,8"])
@pytest.mark.parametrize("wide", [3, 70])
def test_blocks_of_a_file_are_its_whole_lines(tmp_path, monkeypatch, wide, end):
    """Each byte once, also of lines longer than a block, and of a last one without a break."""
    monkeypatch.setattr(text_columns, "BLOCK", 32)
    path = tmp_path / "log.csv"
    text = "head\n" + "\n".join(f"{k:0{wide}},{k}" for k in range(40)) + end
    path.write_bytes(text.encode())
    blocks = list(text_columns._blocks(path, 5))
    assert b"".join(blocks).decode() == text[5:].rstrip("\n") + "\n"
    assert all(block.endswith(b"\n") for block in blocks)
    assert len(blocks) > 5
