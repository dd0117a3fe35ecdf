"""Layouts that loggers and data sets publish, met for the first time; every log here is synthetic.

A body turns about three axes under gravity and stays in its place; its samples are written as each
layout has them, and what is read is compared with what was written.
"""

from __future__ import annotations

import json
import zlib
from datetime import UTC, datetime, timedelta
from functools import reduce
from operator import xor

import numpy as np
import pandas as pd
import pytest
from scipy.spatial.transform import Rotation
from tests.coded import coded

import strapdown as sd
from strapdown.constants import STANDARD_GRAVITY
from strapdown.errors import DataError
from strapdown.formats import printed_lines, reader_of
from strapdown.formats.arrays import nanoseconds_of
from strapdown.formats.clocks import on_clock_of
from strapdown.formats.columns import UNKNOWN_WORDS, read_name
from strapdown.formats.csv import of_arrays
from strapdown.formats.find_columns import rates_and_force
from strapdown.formats.novatel import SCALES
from strapdown.formats.printed_lines import as_rows
from strapdown.formats.vocabularies import FIXES, TRAJECTORIES
from strapdown.tables import ACCEL, GYRO

N, STEP = 1500, 0.01
T = STEP * np.arange(N)
TURN = Rotation.from_euler(
    "zyx", np.column_stack([0.7 * T, 0.5 * np.sin(0.8 * T), 0.6 * np.sin(1.3 * T)])
)
RATE = np.vstack([(TURN[:-1].inv() * TURN[1:]).as_rotvec() / STEP, np.zeros(3)])
FORCE = TURN.inv().apply([0.0, 0.0, STANDARD_GRAVITY])
DEG = np.degrees(1.0)
DAY = datetime(2024, 3, 5, 12, tzinfo=UTC)
LAT, LON = 55.75 + 1e-6 * np.arange(60), 37.62 - 2e-6 * np.arange(60)


def written(tmp_path, name, lines, end="\n"):
    path = tmp_path / name
    path.write_text(end.join(lines) + end, encoding="utf-8")
    return path


def line(*values, separator=","):
    return separator.join(str(v) for v in values)


def many(values, digits=6):
    return [f"{v:.{digits}f}" for v in values]


def check(imu, rate=RATE, force=FORCE, *, digits=1e-4, start=None):
    np.testing.assert_allclose(imu[GYRO], rate, atol=digits)
    np.testing.assert_allclose(imu[ACCEL], force, atol=50 * digits)
    np.testing.assert_allclose(np.diff(imu.index), STEP, atol=1e-6)
    if start is not None:
        assert imu.attrs["clock"] == "unix"
        assert imu.index[0] + imu.attrs["clock_origin"] == pytest.approx(start, abs=1e-3)


# Clocks and names.


def test_names_of_a_device_in_rows_that_end_with_a_tab(tmp_path):
    """ConsensysPRO: a word on the separator, units below the names, a tab at each end."""
    names = ["Timestamp_Unix", *(f"Gyro_{a}" for a in "XYZ"), *(f"Accel_LN_{a}" for a in "XYZ")]
    rows = ["sep=\t", "".join(f"Shimmer_B5A1_{name}_CAL\t" for name in names)]
    rows.append("\t".join(["ms", *["deg/s"] * 3, *["m/(s^2)"] * 3, ""]))
    for k in range(N):
        stamp = f"{1e3 * (DAY.timestamp() + T[k]):.3f}"
        rows.append(line(stamp, *many(RATE[k] * DEG), *many(FORCE[k]), "", separator="\t"))
    check(sd.read_imu(written(tmp_path, "shimmer.csv", rows)), start=DAY.timestamp())


def test_a_clock_of_a_logger_in_two_columns_with_milli_g(tmp_path):
    """OpenLog Artemis: rtcDate, rtcTime; accelerometer in mg; a comma ends each row."""
    rows = ["rtcDate,rtcTime,aX,aY,aZ,gX,gY,gZ,imu_degC,output_Hz,"]
    for k in range(N):
        at = DAY + timedelta(seconds=float(T[k]))
        stamp = f"{at:%m/%d/%Y},{at:%H:%M:%S}.{at.microsecond // 10000:02d}"
        values = many(1000 * FORCE[k] / STANDARD_GRAVITY, 2) + many(RATE[k] * DEG, 2)
        rows.append(line(stamp, *values, "25.10", "100.000", ""))
    imu = sd.read_imu(written(tmp_path, "dataLog00001.csv", rows))
    check(imu, digits=2e-4)


def test_milliseconds_without_leading_zeros(tmp_path):
    """WitMotion's Python SDK joins numbers: 12:0:1.5 is 5 ms after the second; T(°) is no clock."""
    rows = ["Chiptime\tax(g)\tay(g)\taz(g)\twx(deg/s)\twy(deg/s)\twz(deg/s)\tT(°)"]
    for k in range(N):
        at = DAY + timedelta(seconds=float(T[k]), milliseconds=5)
        stamp = f"{at.year}-{at.month}-{at.day} {at.hour}:{at.minute}:{at.second}"
        stamp += f".{at.microsecond // 1000}"
        values = many(FORCE[k] / STANDARD_GRAVITY) + many(RATE[k] * DEG)
        rows.append(line(stamp, *values, "25.3", separator="\t"))
    imu = sd.read_imu(written(tmp_path, "20240305.txt", rows, "\r\n"))
    check(imu, start=DAY.timestamp() + 0.005)


@pytest.mark.parametrize(
    ("texts", "steps"),
    [
        # Eighths of a second without trailing zeros are decimals: they never go back.
        (["10:00:01", "10:00:01.125", "10:00:01.25", "10:00:01.375", "10:00:01.5"], [0.125] * 4),
        (["10:00:01.9", "10:00:01.95", "10:00:02.0"], [0.05, 0.05]),
        (["10:00:01.90", "10:00:01.100", "10:00:01.110"], [0.010, 0.010]),
        (["10:00:01.090", "10:00:01.100", "10:00:01.110"], [0.010, 0.010]),
    ],
)
def test_digits_behind_seconds(texts, steps):
    found = nanoseconds_of(texts)
    assert found is not None
    np.testing.assert_allclose(np.diff(found) * 1e-9, steps, atol=1e-12)


@pytest.mark.parametrize(
    ("text", "date"),
    [
        ("22-May-2015 07:00:25.730", datetime(2015, 5, 22, 7, 0, 25, 730000, tzinfo=UTC)),
        ("05-Mar-24 12:00:00.20", datetime(2024, 3, 5, 12, 0, 0, 200000, tzinfo=UTC)),
        ("Fri May 22 07:00:26 UTC 2015", datetime(2015, 5, 22, 7, 0, 26, tzinfo=UTC)),
    ],
)
def test_months_in_letters(text, date):
    found = nanoseconds_of([text])
    assert found is not None and found[0] == int(date.timestamp() * 1000) * 10**6


def test_letters_of_a_local_zone_are_no_stamp():
    assert nanoseconds_of(["Fri May 22 07:00:26 EDT 2015"]) is None


@pytest.mark.parametrize(
    ("name", "quantity", "unit"),
    [
        ("utime", "time", "us"),
        ("Clock:offsetTime", "time", None),
        ("IMU_ATTI(0):gyroX", "gyro_x", None),
        ("IMU_ATTI(0):accelZ", "accel_z", None),
        ("gyroADC[1]", "gyro_y", None),
        ("accSmooth[2]", "accel_z", None),
        ("InlineAcc", "accel_x", None),
        ("Rotation X [rad/s]", "gyro_x", "rad/s"),
        ("Rotation X [deg]", None, "deg"),
        ("T(°)", None, "deg"),
    ],
)
def test_names_of_columns(name, quantity, unit):
    said = read_name(name)
    assert (said.quantity, said.unit) == (quantity, unit)


def test_a_part_of_an_array_is_no_quantity_of_fixes():
    """It was a column q in the unit 0, and refused the whole table."""
    assert read_name("q[0]", FIXES).quantity is None
    assert read_name("theta[0]", TRAJECTORIES).quantity is None
    assert read_name("T(°)", FIXES).quantity is None


# Rows of several sensors, samples of several lines, rows in blocks.


def test_rows_of_two_sensors_are_not_one_log(tmp_path):
    """mavlogdump writes the rows of all inertial sensors under one header; they were mixed."""
    rows = ["timestamp,TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ,T"]
    for k in range(N):
        for which in (0, 1):
            stamp = f"{1.7e9 + T[k]:.6f},{int(1e6 * T[k]) + 55_000_000 + 40 * which},{which}"
            rows.append(line(stamp, *many(RATE[k] + which, 8), *many(FORCE[k] - which), "41.2"))
    imu = sd.read_imu(written(tmp_path, "imu.csv", rows))
    check(imu)
    finding = next(f for f in imu.findings if f.code == "io.rows-of-several-sensors")
    assert (finding.severity, finding.data["name"], finding.data["first"]) == ("warning", "I", "0")


@pytest.mark.parametrize("order", [(0, 0, 1), (0,) * 8 + (1,) * 8, (2, 0, 1)])
def test_sensors_may_differ_in_rate_or_come_in_blocks(tmp_path, order):
    """One row in fifty is lost: the stamps of the first sensor stay its own."""
    rows = ["time_s,sensor,gx_dps,gy_dps,gz_dps,ax_g,ay_g,az_g"]
    for k in range(N):
        if k % 50 != 49:
            values = many(RATE[k] * DEG) + many(FORCE[k] / STANDARD_GRAVITY)
            rows.append(line(f"{T[k]:.2f}", order[k % len(order)], *values))
    imu = sd.read_imu(written(tmp_path, "log.csv", rows))
    assert "io.rows-of-several-sensors" in {f.code for f in imu.findings}
    of_first = [k for k in range(N) if k % 50 != 49 and order[k % len(order)] == order[0]]
    np.testing.assert_allclose(imu.index, T[of_first] - T[of_first[0]] + imu.index[0], atol=1e-9)


@pytest.mark.parametrize(
    "numbers",
    [
        np.zeros(N, int),
        np.arange(N),
        np.arange(N) // 500,
        np.random.default_rng(1).integers(0, 2, N),
        np.random.default_rng(2).integers(0, 5, N),
    ],
)
def test_a_number_that_rarely_changes_or_has_no_order_tells_no_sensors_apart(tmp_path, numbers):
    rows = ["time_s,id,gx_dps,gy_dps,gz_dps,ax_g,ay_g,az_g"]
    for k in range(N):
        values = many(RATE[k] * DEG) + many(FORCE[k] / STANDARD_GRAVITY)
        rows.append(line(f"{T[k]:.2f}", int(numbers[k]), *values))
    imu = sd.read_imu(written(tmp_path, "log.csv", rows))
    check(imu)
    assert "io.rows-of-several-sensors" not in {f.code for f in imu.findings}


def three(name, values, unit):
    return f"{name} X: {values[0]:.4f}, Y: {values[1]:.4f}, Z: {values[2]:.4f} {unit}"


def test_a_sample_in_several_lines(tmp_path):
    """The serial output of Adafruit's examples: a line a sensor, and a blank line."""
    rows = []
    for k in range(N):
        rows += [three("Acceleration", FORCE[k], "m/s^2"), three("Rotation", RATE[k], "rad/s")]
        rows += ["Temperature: 25.31 degC", ""]
    path = written(tmp_path, "monitor.txt", rows, "\r\n")
    check(sd.read_imu(path, rate_hz=100.0))
    # Without a line a sample is not whole: it is left out, and no other is mixed with it.
    del rows[4 * 700 + 1]
    imu = sd.read_imu(written(tmp_path, "monitor.txt", rows, "\r\n"), rate_hz=100.0)
    check(imu, np.delete(RATE, 700, axis=0), np.delete(FORCE, 700, axis=0))


G = STANDARD_GRAVITY
#: What a program prints of a sample: t in s, w in deg/s, f in m/s².
PRINTED = {
    "stamp with a unit": "{ms:.0f} ms  ax: {f[0]:.6f} ay: {f[1]:.6f} az: {f[2]:.6f} "
    "gx_dps: {w[0]:.5f} gy_dps: {w[1]:.5f} gz_dps: {w[2]:.5f}",
    "log of a framework": "I ({ms:.0f}) IMU: acc=[{f[0]:8.5f}, {f[1]:8.5f}, {f[2]:8.5f}] m/s^2 "
    "gyro=[{w[0]:9.5f}, {w[1]:9.5f}, {w[2]:9.5f}] dps",
    "tuples, time last": "Gyro: ({w[0]:.5f}, {w[1]:.5f}, {w[2]:.5f}) deg/s Accel: ({f[0]:.6f}, "
    "{f[1]:.6f}, {f[2]:.6f}) m/s^2 t={t:.3f}",
    "line protocol": "imu,host=pi ax={f[0]:.6f},ay={f[1]:.6f},az={f[2]:.6f},gx_dps={w[0]:.5f},"
    "gy_dps={w[1]:.5f},gz_dps={w[2]:.5f} {ns:.0f}",
    "log of another framework": "[{clock},{us:03.0f}] <inf> main: accel x:{f[0]:.6f} y:{f[1]:.6f} "
    "z:{f[2]:.6f} (m/s^2)\n[{clock},{us:03.0f}] <inf> main: gyro x:{r[0]:.7f} y:{r[1]:.7f} "
    "z:{r[2]:.7f} (rad/s)",
    "bars": "{t:.2f}s | gx {w[0]:.5f}°/s | gy {w[1]:.5f}°/s | gz {w[2]:.5f}°/s | ax {g[0]:.7f}g | "
    "ay {g[1]:.7f}g | az {g[2]:.7f}g",
    "lines in turn": "{t:.4f} accelerometer: x={f[0]:.6f} y={f[1]:.6f} z={f[2]:.6f}\n"
    "{t:.4f} gyroscope: x={r[0]:.7f} y={r[1]:.7f} z={r[2]:.7f}",
    "log of a phone": "03-05 {clock}  1234  1250 D App: TYPE_GYROSCOPE x={r[0]:.7f} y={r[1]:.7f} "
    "z={r[2]:.7f} TYPE_ACCELEROMETER x={f[0]:.6f} y={f[1]:.6f} z={f[2]:.6f}",
    "numpy": "{{'t': np.float64({t:.3f}), 'acc': {{'x': np.float64({f[0]:.6f}), 'y': "
    "np.float64({f[1]:.6f}), 'z': np.float64({f[2]:.6f})}}, 'gyro': {{'x': np.float64({r[0]:.7f}), "
    "'y': np.float64({r[1]:.7f}), 'z': np.float64({r[2]:.7f})}}}}",
    "dictionary": "{{'t': {t:.3f}, 'accel': {{'x': {f[0]:.6f}, 'y': {f[1]:.6f}, 'z': {f[2]:.6f}}}, "
    "'gyro (deg/s)': {{'x': {w[0]:.5f}, 'y': {w[1]:.5f}, 'z': {w[2]:.5f}}}}}",
    "message in lines": "header:\n  stamp:\n    sec: {s:.0f}\n    nanosec: {rest:.0f}\n"
    "  frame_id: imu\nangular_velocity:\n  x: {r[0]:.7f}\n  y: {r[1]:.7f}\n  z: {r[2]:.7f}\n"
    "angular_velocity_covariance:\n- 0.0\n- 0.0\nlinear_acceleration:\n  x: {f[0]:.6f}\n"
    "  y: {f[1]:.6f}\n  z: {f[2]:.6f}\n---",
}


@pytest.mark.parametrize("form", PRINTED)
def test_lines_as_programs_print_them(tmp_path, form):
    rows = []
    for k in range(N):
        ns = 1_709_640_000_000_000_000 + round(1e9 * T[k])
        numbers = {"t": T[k], "ms": 1e3 * T[k], "ns": ns, "s": ns // 10**9, "rest": ns % 10**9}
        day = DAY + timedelta(milliseconds=round(1e3 * T[k]))
        numbers |= {"clock": f"{day:%H:%M:%S}.{day.microsecond // 1000:03d}", "us": 0}
        sensors = {"w": RATE[k] * DEG, "r": RATE[k], "f": FORCE[k], "g": FORCE[k] / G}
        rows.append(PRINTED[form].format(**numbers, **sensors))
    check(sd.read_imu(written(tmp_path, "capture.log", rows)))


@pytest.mark.parametrize(
    "form",
    [
        # A sign that may be a hyphen, and a comma that may be decimal: no guess.
        "t: {t:.3f} gx-{a:.3f} gy-{a:.3f} gz-{a:.3f} ax-{a:.3f} ay-{a:.3f} az-{a:.3f}",
        "t: {k},{k} gx: {k},{k} gy: {k},{k} gz: {k},{k}",
    ],
)
def test_printed_lines_that_may_be_read_in_two_ways_are_not(form):
    lines = [(k, form.format(t=0.01 * k, a=0.3 + 0.01 * k, k=k)) for k in range(20)]
    assert as_rows(lines) is lines


def test_a_line_is_parted_once_to_see_whether_it_is_printed(monkeypatch):
    parted, part = [], printed_lines._printed
    monkeypatch.setattr(printed_lines, "_printed", lambda line: parted.append(line) or part(line))
    lines = [(k, f"{k},{0.1 * k:.3f},1.0") for k in range(20)]
    assert as_rows(lines) is lines
    assert len(parted) == 20


def test_columns_of_a_sensor_are_members_of_it(tmp_path):
    members = {"time": T.tolist()}
    for name, values, unit in (("gyro", RATE * DEG, "deg/s"), ("accelerometer", FORCE, "m/s2")):
        members[name] = {a: values[:, k].tolist() for k, a in enumerate("xyz")} | {"unit": unit}
    check(sd.read_imu(written(tmp_path, "log.json", [json.dumps(members)])))


def test_six_numbers_of_one_label(tmp_path):
    """The example for MPU-6050 that most copies begin with: accelerations before rates."""
    counts = np.rint(np.column_stack([FORCE / G * 16384, RATE * DEG * 131])).astype(int)
    rows = ["a/g:\t" + "\t".join(map(str, row)) for row in counts.tolist()]
    units = {"accel": "g/16384", "gyro": "deg/s/131"}
    imu = sd.read_imu(written(tmp_path, "mpu.log", rows), rate_hz=100.0, units=units)
    check(imu, digits=1e-4)


def test_the_clock_of_lines_in_turn_is_that_of_the_gyro(tmp_path):
    rows = []
    for k in range(N):
        rows.append(
            "{:.4f} accelerometer: x={:.6f} y={:.6f} z={:.6f}".format(T[k] - 0.003, *FORCE[k])
        )
        rows.append("{:.4f} gyroscope: x={:.7f} y={:.7f} z={:.7f}".format(T[k], *RATE[k]))
    imu = sd.read_imu(written(tmp_path, "turns.log", rows))
    np.testing.assert_allclose(imu.index, T, atol=1e-9)


def by_axis(rows, digits=7):
    return [dict(zip("xyz", (round(float(v), digits) for v in row), strict=True)) for row in rows]


@pytest.mark.parametrize("kind", ["apart", "together", "columns", "rows"])
def test_blocks_of_samples_under_one_stamp(tmp_path, kind):
    """A sensor on a belt (Movesense), and a watch (Garmin): a list of samples a stamp."""
    many_at, records, rate = 5, [], RATE * DEG
    for k in range(0, N, many_at):
        stamp, part = round(1e3 * T[k]), slice(k, k + many_at)
        acc, gyro = by_axis(FORCE[part]), by_axis(rate[part])
        if kind == "apart":
            records.append({"acc": {"Timestamp": stamp, "ArrayAcc": acc}})
            records.append({"gyro": {"Timestamp": stamp, "ArrayGyro": gyro}})
        elif kind == "together":
            both = {"Timestamp": stamp, "ArrayAcc": acc, "ArrayGyro": gyro}
            records.append({"imu6": both})
        elif kind == "rows":
            gyro, acc = rate[part].round(7).tolist(), FORCE[part].round(7).tolist()
            records.append({"timestamp": stamp, "gyro": gyro, "accel": acc})
        else:
            columns = {a: [one[a] for one in acc] for a in "xyz"}
            turns = {a: [one[a] for one in gyro] for a in "xyz"}
            records.append({"timestamp": stamp, "accelerometer": columns, "gyroscope": turns})
    if kind == "apart":
        del records[2 * 100 : 2 * 110]  # a gap does not stretch the block before it
    about = {"device": "X", "units": {"gyro": "deg/s"}} if kind == "rows" else {}
    path = written(tmp_path, "blocks.json", [json.dumps({**about, "data": records})])
    imu = sd.read_imu(path)
    assert "io.stamps-of-blocks" in {f.code for f in imu.findings}
    if kind == "apart":
        kept = np.r_[0:500, 550:N]
        np.testing.assert_allclose(imu.index, T[kept], atol=1e-9)
        np.testing.assert_allclose(imu[GYRO], RATE[kept], atol=1e-6)
    else:
        check(imu)


def test_sentences_whose_fields_are_known(tmp_path):
    rows = []
    for k in range(N):
        values = [*many((0.2, -0.03, 0.4), 4), *many(FORCE[k], 3), *many(RATE[k], 6)]
        text = line("VNIMU", *values, "+20.7", "+084.322")
        check_sum = 0
        for letter in text:
            check_sum ^= ord(letter)
        rows.append(f"${text}*{check_sum:02X}")
    imu = sd.read_imu(written(tmp_path, "vn.txt", rows, "\r\n"), rate_hz=100.0)
    check(imu)
    np.testing.assert_allclose(imu["mag_x"], 20.0)  # gauss


def test_blank_lines_between_recordings_are_warned_of(tmp_path):
    rows = ["aX,aY,aZ,gX,gY,gZ"]
    for k in range(N):
        rows += [""] if k and k % 119 == 0 else []
        rows.append(line(*many(FORCE[k] / STANDARD_GRAVITY, 4), *many(RATE[k] * DEG, 3)))
    units = {"gyro": "deg/s", "accel": "g"}
    path = written(tmp_path, "punch.csv", rows)
    findings = {f.code: f for f in sd.read_imu(path, rate_hz=100.0, units=units).findings}
    assert findings["io.rows-in-blocks"].data["count"] == 13
    assert findings["io.rows-in-blocks"].severity == "warning"
    path = written(tmp_path, "punch.csv", [row for row in rows if row])
    codes = {f.code for f in sd.read_imu(path, rate_hz=100.0, units=units).findings}
    assert "io.rows-in-blocks" not in codes


# Columns without names.


def test_columns_without_names_by_the_motion():
    """A quaternion and Euler angles before the rates, as in xsens_imu.csv of KAIST and MulRan."""
    noise = np.random.default_rng(5).standard_normal((N, 3))
    others = [np.full(N, 0.5), *TURN.as_quat().T, *TURN.as_euler("xyz").T]
    table = [1.56e18 + 1e7 * np.arange(N), *others[1:], *RATE.T, *FORCE.T, *noise.T]
    assert rates_and_force([np.asarray(c) for c in table]) == (8, 11)
    # Rates of another body explain nothing.
    table[8:11] = list(np.roll(RATE, 500, axis=0).T)
    assert rates_and_force([np.asarray(c) for c in table]) is None


def test_an_order_that_nothing_shows_is_not_proposed_as_known(tmp_path):
    noise = np.random.default_rng(6).standard_normal((200, 8))
    rows = [line(f"{0.1 * k:.1f}", *many(noise[k])) for k in range(200)]
    with pytest.raises(DataError, check=coded("io.nameless-columns-open")):
        sd.read_imu(written(tmp_path, "bare.csv", rows))


# Formats with a head of their own.


@pytest.mark.parametrize("hour", [8, 23])
def test_vbo_of_racelogic(tmp_path, hour):
    """Minutes of an arc, longitude to the west, km/h, UTC of the day, on the date of the head."""
    top = "File created on 05/03/2024 at 14:00:00\n\n[header]\nsatellites\ntime\nvelocity kmh\n\n"
    top += "[channel units]\n\n[comments]\n(c) Racelogic\n\n[column names]\n"
    top += "sats time lat long velocity heading height\n\n[data]"
    rows = top.split("\n")
    begin = DAY.replace(hour=hour, minute=59, second=50)
    for k in range(60):
        at = begin + timedelta(seconds=k / 2)
        sats = 0 if k == 3 else 73  # 9, and 64 for a differential fix
        place = f"{60 * LAT[k]:+012.6f} {-60 * LON[k]:+012.6f}"
        stamp = f"{at:%H%M%S}.{at.microsecond // 10000:02d}"
        rows.append(f"{sats:03d} {stamp} {place} 036.000 090.00 +00160.00")
    path = written(tmp_path, "lap.vbo", rows, "\r\n")
    assert reader_of(path)[0] == "vbo"
    with pytest.raises(DataError, check=coded("io.height-level-not-stated")):
        sd.read_gnss(path, position_sd_m=1.0)
    fixes = sd.read_gnss(path, position_sd_m=1.0, velocity_sd_m_per_s=0.1, datum_height_m=0.0)
    keep = np.arange(60) != 3
    np.testing.assert_allclose(fixes["lat"], LAT[keep], atol=2e-8)
    np.testing.assert_allclose(fixes["lon"], LON[keep], atol=2e-8)
    np.testing.assert_allclose(fixes[["VN", "VE"]], np.tile([0.0, 10.0], (59, 1)), atol=1e-9)
    assert set(fixes["quality"]) == {2.0}
    # The last row of the day is followed by the next day.
    since = fixes.index + fixes.attrs["clock_origin"] - begin.timestamp()
    np.testing.assert_allclose(since, np.arange(60)[keep] / 2, atol=1e-6)


FLYS = ["$FLYS,1", "$VAR,FIRMWARE_VER,v2023.09.22"]


def test_sensors_of_flysight(tmp_path):
    rows = [*FLYS, "$COL,BARO,time,pressure,temperature", "$UNIT,BARO,s,Pa,deg C"]
    rows += ["$COL,IMU,time,wx,wy,wz,ax,ay,az,temperature"]
    rows += ["$UNIT,IMU,s,deg/s,deg/s,deg/s,g,g,g,deg C"]
    rows += ["$COL,TIME,time,tow,week", "$UNIT,TIME,s,s,", "$DATA"]
    for k in range(N):
        rows += [f"$BARO,{150 + T[k]:.3f},76997.26,31.04"] if k % 10 == 0 else []
        rows += [f"$TIME,{150 + T[k]:.3f},{1000 + T[k]:.3f},2304"] if k % 100 == 0 else []
        values = many(RATE[k] * DEG, 4) + many(FORCE[k] / STANDARD_GRAVITY)
        rows.append(line("$IMU", f"{150 + T[k]:.3f}", *values, "30.64"))
    path = written(tmp_path, "SENSOR.CSV", rows)
    assert reader_of(path)[0] == "flysight"
    # Week 2304 began on 2024-03-03; GPS is 18 s ahead of UTC.
    begin = datetime(2024, 3, 3, tzinfo=UTC).timestamp() + 1000 - 18
    check(sd.read_imu(path), start=begin)


def test_fixes_of_flysight(tmp_path):
    rows = [*FLYS, "$COL,GNSS,time,lat,lon,hMSL,velN,velE,velD,hAcc,vAcc,sAcc,numSV"]
    rows += ["$UNIT,GNSS,,deg,deg,m,m/s,m/s,m/s,m,m,m/s,", "$DATA"]
    for k in range(60):
        at = DAY + timedelta(seconds=k / 5)
        stamp = f"{at:%Y-%m-%dT%H:%M:%S}.{at.microsecond // 1000:03d}Z"
        place = [f"{LAT[k]:.7f}", f"{LON[k]:.7f}", "160.0"]
        rows.append(line("$GNSS", stamp, *place, "0.1", "0.2", "0.3", "1.5", "2.0", "0.4", "9"))
    path = written(tmp_path, "TRACK.CSV", rows)
    with pytest.raises(DataError, check=coded("io.height-over-sea-column")):
        sd.read_gnss(path)
    fixes = sd.read_gnss(path, datum_height_m=0.0)
    np.testing.assert_allclose(fixes["lat"], LAT, atol=1e-7)
    np.testing.assert_allclose(fixes[["VN", "VE", "VD"]], np.tile([0.1, 0.2, 0.3], (60, 1)))
    # The accuracy of the speed is that of each part; it was not used, and the velocity neither.
    np.testing.assert_allclose(fixes[["VN_sd", "VE_sd", "VD_sd"]], 0.4)
    assert fixes.index[0] + fixes.attrs["clock_origin"] == DAY.timestamp()


@pytest.mark.parametrize("ending", ["gcsv", "csv"])
def test_counts_of_gyroflow(tmp_path, ending):
    rows = ["GYROFLOW IMU LOG", "version,1.3", "orientation,YxZ", "tscale,0.001"]
    gyro, accel = 0.00122173047, 0.00048828125
    rows += [f"gscale,{gyro}", f"ascale,{accel}", "t,gx,gy,gz,ax,ay,az"]
    rates = np.round(RATE / gyro).astype(int)
    forces = np.round(FORCE / STANDARD_GRAVITY / accel).astype(int)
    rows += [line(10 * k, *rates[k], *forces[k]) for k in range(N)]
    path = written(tmp_path, f"clip.{ending}", rows)
    assert reader_of(path)[0] == "gyroflow"
    check(sd.read_imu(path), rates * gyro, forces * accel * STANDARD_GRAVITY, digits=1e-9)


def test_json_with_names_apart_from_values(tmp_path):
    names = [{"name": f"acc{a}", "units": "m/s2"} for a in "XYZ"]
    names += [{"name": f"gyr{a}", "units": "dps"} for a in "XYZ"]
    values = np.column_stack([FORCE, RATE * DEG]).tolist()
    payload = {"device_type": "NANO33BLE", "interval_ms": 10, "sensors": names, "values": values}
    path = tmp_path / "wave.json"
    path.write_text(json.dumps({"protected": {"ver": "v1"}, "signature": "0", "payload": payload}))
    check(sd.read_imu(path), digits=1e-9)
    payload["values"] = [row[:5] for row in values]
    path.write_text(json.dumps({"payload": payload}))
    with pytest.raises(DataError, check=coded("io.not-list-records")):
        sd.read_imu(path)


def crc(text):
    """CRC of 32 bits of NovAtel, by its printed example: c3194e35."""
    return f"{zlib.crc32(text.encode(), 0xFFFFFFFF) ^ 0xFFFFFFFF:08x}"


BESTPOSA = (
    "BESTPOSA,COM1,0,83.5,FINESTEERING,2163,329760.000,02400000,b1f6,65535;SOL_COMPUTED,SINGLE,"
    '51.15043874397,-114.03066788586,1097.6822,-17.0000,WGS84,1.3648,1.1806,3.1112,"",0.000,0.000,'
    "18,18,18,0,00,02,11,01"
)


def test_fixes_of_novatel_as_text(tmp_path):
    assert crc(BESTPOSA) == "c3194e35"
    lines = []
    for k in range(10):
        text = BESTPOSA.replace("329760.000", f"{329760 + k}.000")
        lines.append(f"#{text}*{crc(text)}")
        text = f"BESTVELA,COM1,0,0,FINE,2163,{329760 + k}.000,0,0,0;SOL_COMPUTED,"
        text += "DOPPLER_VELOCITY,0.000,0.000,2.0,90.0,0.5,0.0"
        lines.append(f"#{text}*{crc(text)}")
    lines[4] = lines[4].replace("51.15", "61.15")  # a damaged line
    path = written(tmp_path, "rover.gps", lines, "\r\n")
    assert reader_of(path)[0] == "novatel"
    fixes = sd.read_gnss(path, velocity_sd_m_per_s=0.1)
    assert len(fixes) == 9
    first = fixes.iloc[0]
    assert (first["lat"], first["lon"]) == (51.15043874397, -114.03066788586)
    assert first["alt"] == pytest.approx(1080.6822, abs=1e-4)  # undulation is added
    np.testing.assert_allclose(first[["VN", "VE", "VD"]].to_numpy(float), [0, 2, -0.5], atol=1e-9)
    assert (first["north_sd"], fixes.attrs["gps_week"]) == (pytest.approx(1.3648, abs=1e-6), 2163)


def test_counts_of_novatel_as_text(tmp_path):
    angle, speed = SCALES[11]
    lines = []
    for k in range(N):
        f, w = FORCE[k] * STEP / speed, RATE[k] * STEP / angle
        counts = np.round([f[2], -f[1], f[0], w[2], -w[1], w[0]]).astype(int)
        text = f"RAWIMUSXA,2163,{329760 + T[k]:.3f};00,11,2163,{329760 + T[k]:.9f},00801503,"
        text += line(*counts)
        lines.append(f"%{text}*{crc(text)}")
    check(sd.read_imu(written(tmp_path, "rover.asc", lines, "\r\n")))


def test_an_export_of_inertial_explorer_without_its_preamble(tmp_path):
    """UrbanNav: names, units of degrees, minutes and seconds; the quality has no unit."""
    names = "UTCTime Week GPSTime Latitude Longitude H-Ell VelBdyX VelBdyY VelBdyZ Roll Pitch"
    units = "(sec) (weeks) (sec) (+/-D M S) (+/-D M S) (m) (m/s) (m/s) (m/s) (deg) (deg) (deg)"
    rows = [f"{names} Heading Q", units]
    rows += [f"{k}.0 2158 {95575 + k}.0 22 18 04.5 114 10 44.1 3.0 0 5 0 0 0 90 1" for k in (0, 1)]
    table = sd.read_trajectory(written(tmp_path, "truth.txt", rows))
    np.testing.assert_allclose(table["lat"], 22 + 18 / 60 + 4.5 / 3600, atol=1e-12)
    np.testing.assert_allclose(table[["VN", "VE"]], [[0.0, 5.0]] * 2, atol=1e-9)


def test_solutions_of_emlid_have_another_ending(tmp_path):
    rows = [
        f"2024/03/05 12:00:{k:02d}.000   {LAT[k]:.9f}   {LON[k]:.9f}   160.0000   1  12   0.0100"
        "   0.0100   0.0200   0.0000   0.0000   0.0000   0.00    0.0"
        for k in range(30)
    ]
    fixes = sd.read_gnss(written(tmp_path, "solution.LLH", rows))
    np.testing.assert_allclose(fixes["lat"], LAT[:30], atol=1e-9)
    assert set(fixes["quality"]) == {4.0}


# Fixes by names.


def test_one_quantity_in_two_units(tmp_path):
    """Harry's LapTimer: SPEED_KPH and SPEED_MPH, HEIGHT_M and HEIGHT_FT, a date in letters."""
    head = "INDEX,DATE,TIME,LATITUDE,LONGITUDE,SPEED_KPH,SPEED_MPH,HEIGHT_M,HEIGHT_FT,BEARING"
    rows = [head]
    for k in range(30):
        stamp = f"05-Mar-24,12:00:{k // 5:02d}.{20 * (k % 5):02d}"
        place = f"{LAT[k]:.7f},{LON[k]:.7f}"
        rows.append(line(k, stamp, place, "36.00", "22.37", "160.0", "524.9", "90.0"))
    path = written(tmp_path, "laps.csv", rows)
    fixes = sd.read_gnss(path, position_sd_m=1.0, velocity_sd_m_per_s=0.1)
    assert fixes["alt"].iloc[0] == 160.0
    np.testing.assert_allclose(fixes["VE"], 10.0)
    assert fixes.index[0] + fixes.attrs["clock_origin"] == DAY.timestamp()


def test_two_columns_of_one_quantity_in_one_unit_are_asked(tmp_path):
    rows = ["time_s,lat,lon,alt,height"]
    rows += [line(k, LAT[k], LON[k], 160.0, 175.0) for k in range(30)]
    with pytest.raises(DataError, check=coded("io.column-names-ambiguous")):
        sd.read_gnss(written(tmp_path, "track.csv", rows), position_sd_m=1.0)


def test_of_two_clocks_the_one_that_is_a_stamp(tmp_path):
    """Torque: a GPS time with the letters of a local zone, and the time of the device."""
    rows = ["GPS Time, Device Time, Longitude, Latitude, Altitude"]
    for k in range(30):
        at = DAY + timedelta(seconds=k)
        zone = f"{at:%a %b %d %H:%M:%S} EDT {at.year}"
        rows.append(line(zone, f"{at:%d-%b-%Y %H:%M:%S}.000", LON[k], LAT[k], "160.0"))
    fixes = sd.read_gnss(written(tmp_path, "trackLog.csv", rows), position_sd_m=5.0)
    assert fixes.index[0] + fixes.attrs["clock_origin"] == DAY.timestamp()


def test_microseconds_since_1970_of_fast_fixes(tmp_path):
    """ins.csv of Oxford RobotCar: steps of 20 ms, whose ticks would be 20 s as milliseconds."""
    rows = ["timestamp,latitude,longitude,altitude"]
    begin = int(DAY.timestamp() * 1e6)
    rows += [line(begin + 20_000 * k, LAT[k], LON[k], "160.0") for k in range(60)]
    fixes = sd.read_gnss(written(tmp_path, "ins.csv", rows), position_sd_m=1.0)
    np.testing.assert_allclose(np.diff(fixes.index), 0.02, atol=1e-6)


# What is said.


def test_one_fix_does_not_suffice(tmp_path, run_cli):
    rows = ["time_s,gx_dps,gy_dps,gz_dps,ax_g,ay_g,az_g,lat,lon,alt"]
    for k in range(N):
        values = many(RATE[k] * DEG) + many(FORCE[k] / STANDARD_GRAVITY)
        rows.append(line(f"{T[k]:.2f}", *values, "55.75", "37.62", "160.0"))
    path = written(tmp_path, "log.csv", rows)
    diagnosis = sd.doctor(path)
    fit = diagnosis.logs[0].fit["navigation"]
    assert [(f.code, f.severity, f.data["count"]) for f in fit] == [
        ("doctor.too-few-fixes", "error", 1)
    ]


def test_a_track_is_no_crash_record(tmp_path):
    rows = ["time_s,lat,lon,alt,velN,velE,velD"]
    rows += [line(k, LAT[k], LON[k], 160.0, 0.1, 0.2, 0.0) for k in range(60)]
    diagnosis = sd.doctor(written(tmp_path, "track.csv", rows))
    assert diagnosis.logs[0].answer("crash") == "no"


def test_what_a_refusal_names_is_an_argument_of_read(tmp_path):
    rows = ["t,ax,ay,az,gx,gy,gz"]
    rows += [
        line(f"{T[k]:.2f}", 0.01, 0.02, 1.0, *many(RATE[0] * DEG + 0.1 * (k % 3), 2))
        for k in range(N)
    ]
    path = written(tmp_path, "log.csv", rows)
    with pytest.raises(DataError):
        sd.read(path)
    imu = sd.read(path, units={"gyro": "deg/s", "accel": "g"})["imu"]
    assert isinstance(imu, pd.DataFrame) and len(imu) == N


# Sensors of parts, parts of a force, and text that was encoded twice.


def tabled(tmp_path, names, columns, code="utf-8"):
    rows = [many(row) for row in np.column_stack(columns)]
    path = tmp_path / "log.csv"
    text = "\n".join([line(*names), *(line(*row) for row in rows)]) + "\n"
    path.write_bytes(text.encode(code))
    return path


def of(sensor, unit=""):
    return [f"{sensor}_{a}{unit}" for a in "xyz"]


@pytest.mark.parametrize("names", [("linear_acceleration", "gravity"), ("lin_acc", "grav")])
def test_linear_acceleration_and_gravity_are_summed(tmp_path, names):
    shaken = 0.4 * np.sin(5.0 * T)[:, None] * np.array([1.0, 0.5, -0.2])
    heads = [*of("gyro", "_rad_s"), *of(names[0], "_m_s2"), *of(names[1], "_m_s2")]
    path = tabled(tmp_path, ["time_s", *heads], [T, RATE, shaken, FORCE])
    imu = sd.read_imu(path)
    check(imu, force=FORCE + shaken)
    assert "io.force-of-linear-and-gravity" in {f.code for f in imu.findings}


def test_an_accelerometer_of_its_own_is_not_summed(tmp_path):
    heads = [*of("gyro", "_rad_s"), *of("lin_acc", "_m_s2"), *of("grav", "_m_s2")]
    own = of("accel", "_m_s2")
    path = tabled(tmp_path, ["time_s", *heads, *own], [T, RATE, 0 * FORCE, 0 * FORCE, FORCE])
    check(sd.read_imu(path))


def test_a_gyro_and_an_accelerometer_of_two_parts_are_asked_about(tmp_path):
    names = ["time_s", *of("foot_gyro", "_rad_s"), *of("shank_acc", "_m_s2")]
    path = tabled(tmp_path, names, [T, RATE, FORCE])
    with pytest.raises(DataError, check=coded("io.sensors-of-different-parts")) as refused:
        sd.read_imu(path)
    check(sd.read_imu(path, columns=dict(refused.value.finding.data["answers"])))


def test_of_several_parts_the_one_with_both_sensors_is_read(tmp_path):
    heads = [of("foot_gyro", "_rad_s"), of("shank_gyro", "_rad_s"), of("shank_acc", "_m_s2")]
    names = ["time_s", *heads[0], *heads[1], *heads[2]]
    check(sd.read_imu(tabled(tmp_path, names, [T, 2.0 * RATE, RATE, FORCE])))


@pytest.mark.parametrize("code", ["cp1251", "cp1252", "latin-1"])
def test_names_that_were_encoded_twice(tmp_path, code):
    names = [*of("gyro", " (°/s)"), *of("acc", " (м/с²)" if code == "cp1251" else " (m/s²)")]
    names += ["Ускорение"] if code == "cp1251" else []
    twice = [name.encode("utf-8").decode(code) for name in names]
    more = [0 * T] if code == "cp1251" else []
    imu = sd.read_imu(tabled(tmp_path, ["time_s", *twice], [T, RATE * DEG, FORCE, *more]))
    check(imu, digits=2e-4)
    assert "io.text-decoded-twice" in {f.code for f in imu.findings}


def test_right_names_are_not_decoded_again(tmp_path):
    names = ["time_s", *of("gyro", " (°/s)"), *of("Ускорение", " (м/с²)")]
    imu = sd.read_imu(tabled(tmp_path, names, [T, RATE * DEG, FORCE]))
    check(imu, digits=2e-4)
    assert "io.text-decoded-twice" not in {f.code for f in imu.findings}


# Programs that write one sensor a sheet, letters of other codes, and clocks and names of their own.


def test_sheets_of_single_sensors_are_one_log(tmp_path):
    import openpyxl

    book = openpyxl.Workbook()
    book.remove(book.active)
    axes = [f"{a} (rad/s)" for a in "xyz"]
    later = np.vstack([FORCE, FORCE[-1]])
    for title, names, values in (
        ("Gyroscope", axes, RATE),
        ("Accelerometer", [f"Acceleration {a} (m/s^2)" for a in "xyz"], later),
        ("Linear", [f"Linear Acceleration {a} (m/s^2)" for a in "xyz"], 0 * later),
    ):
        sheet = book.create_sheet(title)
        sheet.append(["Time (s)", *names])
        for row in np.column_stack([STEP * np.arange(len(values)), values]).tolist():
            sheet.append(row)
    sheet = book.create_sheet("Location")
    sheet.append(["Time (s)", "Latitude (°)", "Longitude (°)", "Height over ellipsoid (m)"])
    for k in range(14):
        sheet.append([float(k), LAT[k], LON[k], 100.0])
    book.create_sheet("Metadata").append(["deviceModel", "x"])
    path = tmp_path / "raw.xlsx"
    book.save(path)
    imu = sd.read_imu(path)
    check(imu)
    told = next(f for f in imu.findings if f.code == "io.sheet-read")
    assert told.data["names"] == ("Gyroscope", "Accelerometer", "Location")
    assert told.data["others"] == ("Linear", "Metadata")
    fixes = sd.read_gnss(path, position_sd_m=3.0, columns={"alt": "4"})
    np.testing.assert_allclose(fixes[["lat", "lon"]], np.column_stack([LAT, LON])[:14], atol=1e-12)


@pytest.mark.parametrize(
    ("encoding", "title", "time", "gyro", "accel"),
    [
        ("gb18030", "GB 18030", "时间(s)", "角速度{}(°/s)", "加速度{}(g)"),
        ("cp1251", "Windows-1251", "Время, с", "Угл. скорость {}, град/с", "Ускорение {}, g"),
        ("cp1252", "Windows-1252", "Zeit [s]", "Drehrate {} [°/s]", "Beschl {} [g]"),
    ],
)
def test_codes_of_texts_before_unicode(tmp_path, encoding, title, time, gyro, accel):
    names = [time, *(gyro.format(a) for a in "XYZ"), *(accel.format(a) for a in "XYZ")]
    lines = [";".join(names)]
    for t, row in zip(T, np.column_stack([RATE * DEG, FORCE / STANDARD_GRAVITY]), strict=True):
        lines.append(line(f"{t:.3f}", *many(row), separator=";"))
    path = tmp_path / "log.csv"
    path.write_bytes("\n".join([*lines, ""]).encode(encoding))
    imu = sd.read_imu(path)
    check(imu)
    assert next(f for f in imu.findings if f.code == "io.not-utf-8").data["encoding"] == title


def test_a_counter_of_microseconds_that_is_written_in_ms_wraps(tmp_path):
    ms = (2**32 - 5_000_000 + np.arange(N) * 10_000) % 2**32 / 1e3
    path = tabled(
        tmp_path, ["time_ms", *of("gyro", "_rads"), *of("acc", "_mss")], [ms, RATE, FORCE]
    )
    with pytest.raises(DataError, check=coded("io.time-counter-wraps", bits=32)):
        sd.read_imu(path)
    check(sd.read_imu(path, repair=True))


def test_a_report_of_a_receiver_beside_its_positions(tmp_path):
    """As of gpsd: objects of another class have neither a time nor a position."""
    lines = []
    for k in range(20):
        at = f"{DAY + timedelta(seconds=k):%Y-%m-%dT%H:%M:%S.000Z}"
        fix = {"class": "TPV", "time": at, "lat": LAT[k], "lon": LON[k], "altHAE": 100.0 + k}
        lines += [json.dumps(fix), json.dumps({"class": "SKY", "hdop": 0.8})]
    fixes = sd.read_gnss(written(tmp_path, "gpsd.json", lines), position_sd_m=3.0)
    np.testing.assert_allclose(fixes[["lat", "lon"]], np.column_stack([LAT, LON])[:20], atol=1e-12)
    np.testing.assert_allclose(np.diff(fixes.index), 1.0)


@pytest.mark.parametrize("form", ["{}", "NMEA,{},1709640000123", "[2024-03-05 12:00:00.1] {}"])
def test_sentences_between_stamps_of_a_program(tmp_path, form):
    lines = []
    for k in range(5):
        body = f"GNGGA,12000{k}.00,4807.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,"
        lines.append(form.format(f"${body}*{reduce(xor, body.encode()):02X}"))
    fixes = sd.read_gnss(written(tmp_path, "nmea.txt", lines), position_sd_m=3.0)
    assert len(fixes) == 5
    np.testing.assert_allclose(fixes[["lat", "lon"]].iloc[0], [48 + 7.038 / 60, 11 + 31 / 60])


@pytest.mark.parametrize(
    ("name", "quantity", "unit"),
    [
        ("field.latitude", "lat", None),
        ("OSD.altitude [m]", "alt", "m"),
        ("locationLatitude(WGS84)", "lat", None),
        ("Alt (HAE)", "alt_hae", None),
        ("Alt (MSL)", "alt_msl", None),
        ("Alt (bananas)", "alt", "bananas"),
        ("alt_ellipsoid", "alt_hae", None),
        ("Time (GPS s)", "time", "s"),
        ("locationTimestamp_since1970(s)", "time", "s"),
        ("position_long(semicircles)", "lon", "semicircles"),
        ("orientation.x", None, None),
    ],
)
def test_names_of_fixes_as_programs_write_them(name, quantity, unit):
    said = read_name(name, FIXES)
    assert (said.quantity, said.unit) == (quantity, unit)


def test_semicircles(tmp_path):
    lines = ["time_s,lat (semicircles),lon (semicircles),alt_hae"]
    for k in range(9):
        lines.append(f"{k},{LAT[k] * 2**31 / 180:.0f},{LON[k] * 2**31 / 180:.0f},100")
    fixes = sd.read_gnss(written(tmp_path, "fit.csv", lines), position_sd_m=3.0)
    # Half a unit.
    np.testing.assert_allclose(fixes[["lat", "lon"]], np.column_stack([LAT, LON])[:9], atol=4.2e-8)


@pytest.mark.parametrize("name", ["acc_{} (m/s2)", "G({})"])
def test_an_accelerometer_alone_is_the_reason(tmp_path, name):
    force = FORCE / (STANDARD_GRAVITY if name[0] == "G" else 1.0)
    more = ["time_s", *(name.format(a) for a in "xyz"), *(["G(calibrated)"] * (name[0] == "G"))]
    path = tabled(tmp_path, more, [T, force, *([0 * T] * (name[0] == "G"))])
    names = tuple(name.format(a) for a in "xyz")
    with pytest.raises(DataError, check=coded("io.accelerometer-alone", names=names)):
        sd.read_imu(path)


def test_rates_of_the_letter_g_alone_are_rates(tmp_path):
    path = tabled(tmp_path, ["time_s", *of("g")], [T, 3.0 * RATE])
    np.testing.assert_allclose(
        sd.read_imu(path, units={"gyro": "rad/s"})[GYRO], 3 * RATE, atol=1e-5
    )


def test_angles_that_go_on_are_proposed_as_no_clock(tmp_path):
    turn = np.column_stack([T, 0 * T, 0 * T])
    names = [*(f"Orientation {a}" for a in "xyz"), *of("gyro", "_rads"), *of("acc", "_mss")]
    with pytest.raises(DataError, check=coded("io.time-column-missing")) as refused:
        sd.read_imu(tabled(tmp_path, names, [turn, RATE, FORCE]))
    assert refused.value.finding.data["flags"] == "--rate HZ"


def test_stamps_behind_a_blank(tmp_path):
    lines = ["Time(s)\t" + "\t".join([*of("w", "(deg/s)"), *of("a", "(g)")])]
    for t, row in zip(T, np.column_stack([RATE * DEG, FORCE / STANDARD_GRAVITY]), strict=True):
        stamp = f" {DAY + timedelta(seconds=t):%H:%M:%S.%f}"[:-3]
        lines.append(line(stamp, *many(row), separator="\t"))
    check(sd.read_imu(written(tmp_path, "wit.txt", lines)))


def test_a_stamp_before_a_colon_and_numbers_of_numpy(tmp_path):
    """As of mavlogdump, and of a dictionary that Python prints."""
    lines = []
    for t, w, f in zip(T, RATE, FORCE, strict=True):
        said = " ".join(f"Gyr{a} : {v:.6f}," for a, v in zip("XYZ", w, strict=True))
        said += " ".join(f" Acc{a} : {v:.6f}," for a, v in zip("XYZ", f, strict=True))
        lines.append(f"2024-03-05 12:00:00.00: IMU {{TimeUS : {1e6 + 1e6 * t:.0f}, {said} T : 35}}")
    check(sd.read_imu(written(tmp_path, "dump.txt", lines)))
    lines = []
    for t, w, f in zip(T, RATE, FORCE, strict=True):
        acc, gyro = (", ".join(f"np.float64({v:.6f})" for v in three) for three in (f, w))
        lines.append(f"{{'t': {t:.2f}, 'acc': ({acc}), 'gyro': ({gyro})}}")
    check(sd.read_imu(written(tmp_path, "print.txt", lines)))


@pytest.mark.parametrize(
    ("name", "quantity", "unit"),
    [
        ("Gyro-X (d/s)", "gyro_x", "deg/s"),
        ("ax_ftps2", "accel_x", "ft/s2"),
        ("rotationRateUnbiased.x", "gyro_x", None),
        ("TimeStartup", "time", None),
        ("head_d_s", None, "s"),
        ("Angular velocity X in degrees per second", "gyro_x", "deg/s"),
        ("Acceleration X (meters per second squared)", "accel_x", "m/s2"),
    ],
)
def test_further_names_of_columns(name, quantity, unit):
    said = read_name(name)
    assert (said.quantity, said.unit) == (quantity, unit)


def test_a_part_of_a_second_beside_a_time_of_day_before_noon(tmp_path):
    lines = [",".join(["Date", "Time", "ms", *of("gyro", " (deg/s)"), *of("acc", " (g)")])]
    begin = DAY.replace(hour=9) + timedelta(milliseconds=123)
    for t, row in zip(T, np.column_stack([RATE * DEG, FORCE / STANDARD_GRAVITY]), strict=True):
        at = begin + timedelta(seconds=t)
        stamp = f"{at:%Y-%m-%d},{at:%I:%M:%S %p},{round(at.microsecond / 1e3)}"
        lines.append(line(stamp, *many(row)))
    imu = sd.read_imu(written(tmp_path, "log.csv", lines))
    check(imu)
    assert imu.attrs["clock_origin"] == pytest.approx(begin.timestamp(), abs=1e-6)


def test_a_repair_that_loses_most_of_a_log_is_not_proposed(tmp_path):
    """Stamps that begin anew each second go back 14 times, and few are later than all before."""
    cycle = np.round(1e3 * T) % 1000
    path = tabled(
        tmp_path, ["time_ms", *of("gyro", "_rads"), *of("acc", "_mss")], [cycle, RATE, FORCE]
    )
    with pytest.raises(DataError, check=coded("io.time-goes-back", count=14)) as refused:
        sd.read_imu(path)
    assert "flags" not in refused.value.finding.data or "repair" not in str(
        refused.value.finding.data["flags"]
    )
    assert refused.value.finding.data["lost"] == N - 100


@pytest.mark.parametrize("name", ["body spin rate {}", "gyrX{}", "omega {} of it"])
def test_names_that_may_be_of_rates_are_listed(tmp_path, name):
    names = ["time_s", *of("acc", "_mss"), *(name.format(a) for a in "abc")]
    with pytest.raises(DataError, check=coded("io.no-gyro-columns")):
        sd.read_imu(tabled(tmp_path, names, [T, FORCE, RATE]))


# Layouts that were met on a further round.


@pytest.mark.parametrize("form", ["letters", "numbers"])
def test_a_folder_of_tables_of_a_camera(tmp_path, form, run_cli):
    """gopro-telemetry (toCsv, deduceHeaders): a table a stream, its name and unit in each heading.

    Where the camera names no axes, the first value has the name, and the others are numbered.
    """

    def table(stream, name, unit, values):
        bare = f"{name} [{unit}],1,2"
        heads = ",".join(f"{name} ({a}) [{unit}]" for a in "zxy") if form == "letters" else bare
        rows = [f"cts,date,{heads},temperature [°C]"]
        for k in range(N):
            order = values[k][[2, 0, 1]] if form == "letters" else values[k]
            stamp = (DAY + timedelta(seconds=float(T[k]))).isoformat(timespec="milliseconds")
            stamp = stamp.replace("+00:00", "Z")
            rows.append(line(1e3 * T[k] + 35.5, stamp, *many(order), "25.3"))
        written(tmp_path, f"GH010042_HERO9 Black-{stream}.csv", rows)

    table("ACCL", "Accelerometer", "m/s2", FORCE)
    table("GYRO", "Gyroscope", "rad/s", RATE)
    heads = "cts,date,GPS (Lat.) [deg],GPS (Long.) [deg],GPS (Alt.) [m],GPS (2D speed) [m/s]"
    rows = [f"{heads},GPS (3D speed) [m/s],fix,precision,altitude system"]
    for k in range(15):
        stamp = (DAY + timedelta(seconds=k)).isoformat().replace("+00:00", ".000Z")
        rows.append(line(1e3 * k, stamp, LAT[k], LON[k], 520.25, 1.5, 1.6, 3, 120, "MSLV"))
    gps = written(tmp_path, "GH010042_HERO9 Black-GPS5.csv", rows)
    imu = sd.read_imu(tmp_path)
    check(imu, start=DAY.timestamp())
    assert not {f.code for f in imu.findings} & {"io.tables-not-used"}
    for path in (tmp_path, gps):
        fixes = sd.read_gnss(path, position_sd_m=5.0)
        np.testing.assert_allclose(fixes[["lat", "lon"]], np.column_stack([LAT, LON])[:15])
        np.testing.assert_array_equal(fixes["alt"], 520.25)
        np.testing.assert_allclose(np.diff(fixes.index), 1.0)
    done = run_cli("init", "navigate", tmp_path, "--out", tmp_path / "drive.toml")
    assert "15 of 15 fixes" in done.out + done.err


@pytest.mark.parametrize(
    ("names", "read"),
    [
        (["Gyro [deg/s]", "1", "2"], ["gyro_x", "gyro_y", "gyro_z"]),
        (["CameraOrientation", "1", "2", "3"], [None, None, None, None]),
        (["Gyro", "1", "2", "3"], ["gyro", None, None, None]),
        (["count", "1", "2"], [None, None, None]),
    ],
)
def test_values_of_which_the_first_has_the_name(names, read):
    assert [read_name(name).quantity for name in of_arrays(names)] == read


@pytest.mark.parametrize(
    ("name", "quantity", "unit"),
    [
        ("GPS (Lat.) [deg]", "lat", "deg"),
        ("GPS (Long.) [deg]", "lon", "deg"),
        ("GPS (2D speed) [m/s]", "speed", "m/s"),
        ("GPS (3D speed) [m/s]", None, "m/s"),
        ("Altitude (AGL) [m]", None, "m"),
        ("Speed (OBD)(km/h)", None, "km/h"),
    ],
)
def test_words_in_brackets_before_a_unit(name, quantity, unit):
    said = read_name(name, FIXES)
    assert (said.quantity, said.unit) == (quantity, unit)


def test_names_between_tabs_over_rows_between_commas(tmp_path):
    """Sketches for the Nano 33 BLE print both, below what the library says of its sensor."""
    top = ["Started", "Gyroscope sample rate = 100.00 Hz", "", "Gyroscope in degrees/second"]
    rows = [*top, "aX\taY\taZ\tgX\tgY\tgZ"]
    rows += [line(*many(FORCE[k] / STANDARD_GRAVITY), *many(RATE[k] * DEG)) for k in range(N)]
    imu = sd.read_imu(written(tmp_path, "nano.txt", rows))
    check(imu)


def of_world(rng, tilt, time=T):
    """Rates in rad/s, attitude to axes of the world (w first), and forces in both."""
    u = np.maximum(time - 3.0, 0.0)
    angles = [0.9 * np.sin(0.5 * u), tilt * np.sin(0.7 * u) ** 3, tilt * np.sin(0.9 * u) ** 3]
    turn = Rotation.from_euler("ZYX", np.column_stack(angles))
    rate = np.vstack([(turn[:-1].inv() * turn[1:]).as_rotvec() / STEP, np.zeros(3)])
    world = 0.5 * np.sin(np.outer(u, [1.1, 2.2, 3.3])) + [0.0, 0.0, STANDARD_GRAVITY]
    world += rng.normal(0.0, 0.01, world.shape)
    q = turn.as_quat()[:, [3, 0, 1, 2]]
    return rate + rng.normal(0.0, 1e-3, rate.shape), q, turn.inv().apply(world), world


@pytest.mark.parametrize("way", ["to the world", "from the world"])
@pytest.mark.parametrize("tilt", [0.2, 1.2])
def test_an_acceleration_in_axes_of_the_world_beside_a_quaternion(tmp_path, way, tilt):
    """Applications turn it by the attitude: with gravity in it, it looks like a specific force."""
    rate, q, body, world = of_world(np.random.default_rng(4), tilt)
    q = q if way == "to the world" else q * [1.0, -1.0, -1.0, -1.0]
    names = "time_s,gx_dps,gy_dps,gz_dps,ax_m_s2,ay_m_s2,az_m_s2,qw,qx,qy,qz"
    for force, left_out in ((world, True), (body, False)):
        rows = [names]
        for k in range(N):
            rows.append(line(*many([T[k]]), *many(rate[k] * DEG), *many(force[k]), *many(q[k])))
        imu = sd.read_imu(written(tmp_path, "log.csv", rows))
        assert ("accel_x" not in imu) == left_out
        found = [f for f in imu.findings if f.code == "io.left-out-world-axes"]
        assert len(found) == left_out
        np.testing.assert_allclose(imu[GYRO], rate, atol=1e-6)


@pytest.mark.parametrize("motion", ["roundabout", "banked"])
def test_a_steady_force_of_a_body_in_a_turn(tmp_path, motion):
    """Across the axis of the turn it is steady as it stands; banked it looks as if of the world."""
    heading = 0.5 * T
    bank = 0.5 * np.sin(0.25 * heading) if motion == "banked" else 0.0 * T
    turn = Rotation.from_euler("ZYX", np.column_stack([heading, 0.0 * T, bank]))
    rate = np.vstack([(turn[:-1].inv() * turn[1:]).as_rotvec() / STEP, np.zeros(3)])
    across = 3.0 if motion == "roundabout" else 0.0
    force = np.column_stack([0.0 * T, across + 0.0 * T, -STANDARD_GRAVITY / np.cos(bank)])
    force += np.random.default_rng(2).normal(0.0, 0.05, force.shape)
    q = turn.as_quat()[:, [3, 0, 1, 2]]
    rows = ["time_s,gx_dps,gy_dps,gz_dps,ax_m_s2,ay_m_s2,az_m_s2,qw,qx,qy,qz"]
    for k in range(N):
        rows.append(line(*many([T[k]]), *many(rate[k] * DEG), *many(force[k]), *many(q[k])))
    path = written(tmp_path, "log.csv", rows)
    assert ("accel_x" in sd.read_imu(path)) == (motion == "roundabout")
    imu = sd.read_imu(path, columns={"accel": "a"})
    np.testing.assert_allclose(imu[ACCEL], force, atol=1e-5)


def test_a_force_that_stands_still_where_the_gyro_turns(tmp_path):
    time = STEP * np.arange(4 * N)
    rate, _, body, world = of_world(np.random.default_rng(4), 1.2, time)
    names = "time_s,gx_dps,gy_dps,gz_dps,ax_m_s2,ay_m_s2,az_m_s2"
    for force, still in ((world, True), (body, False)):
        rows = [names]
        for k in range(len(time)):
            rows.append(line(*many([time[k]]), *many(rate[k] * DEG), *many(force[k])))
        imu = sd.read_imu(written(tmp_path, "log.csv", rows))
        assert [f.quantity for f in imu.findings if f.code == "io.gravity-stood-still"] == (
            ["accel"] * still
        )


def test_fixes_that_are_held_beside_an_accelerometer_alone(tmp_path):
    """TrackAddict: a row a sample, each with the last fix again."""
    heads = "Time,UTC Time,Latitude,Longitude,Altitude (m),Altitude (ft),Speed (Km/h),Speed (MPH)"
    rows = ["# RaceRender Data: TrackAddict 4.7.0", f"{heads},Heading,Accel X,Accel Y,Accel Z"]
    for k in range(N):
        last = k // 100
        fix = [f"{LAT[last]:.7f}", f"{LON[last]:.7f}", 520.0, 1706.0, 10.8 + last, 6.711, 45.0]
        clocks = [f"{T[k]:.3f}", f"{DAY.timestamp() + T[k]:.3f}"]
        rows.append(line(*clocks, *fix, *many(FORCE[k] / STANDARD_GRAVITY, 3)))
    stated = {"position_sd_m": 3.0, "velocity_sd_m_per_s": 1.0}
    path = written(tmp_path, "log.csv", rows)
    got = sd.read_gnss(path, columns={"time": "UTC Time"}, **stated)
    assert got.attrs["clock"] == "unix"
    np.testing.assert_allclose(
        got.index + got.attrs["clock_origin"], DAY.timestamp() + np.arange(15)
    )
    np.testing.assert_allclose(got["lat"], LAT[:15], atol=1e-7)


@pytest.mark.parametrize(
    ("name", "quantity"),
    [("session_gyro.csv", "gyro_x"), ("Polar_ACC.txt", "accel_x"), ("walk.csv", None)],
)
def test_a_table_of_one_sensor_that_its_name_says(tmp_path, name, quantity):
    rows = ["timestamp [ms],x,y,z"]
    rows += [line(1000 * T[k], *many(RATE[k] * DEG)) for k in range(N)]
    path = written(tmp_path, name, rows)
    if quantity == "gyro_x":
        imu = sd.read_imu(path, units={"gyro": "deg/s"})
        np.testing.assert_allclose(imu[GYRO], RATE, atol=1e-6)
        return
    code = "io.accelerometer-alone" if quantity else "io.no-gyro-columns"
    with pytest.raises(DataError, check=coded(code)):
        sd.read_imu(path)


def test_a_quaternion_among_columns_without_names_is_no_force():
    """Three of its four parts had the norm of gravity in g, and turned."""
    q = TURN.as_quat()
    columns = [T, *q.T, *TURN.as_euler("xyz").T, *RATE.T, *FORCE.T]
    assert rates_and_force(columns) == (8, 11)
    assert rates_and_force([*q.T, *RATE.T]) is None


# Logs of strangers: whose numbers were taken for others, or whose plain words were not understood.


SIX = [f"{s}_{a}" for s in ("gyro", "acc") for a in "xyz"]


def samples(k, rate=1.0, force=1.0, digits=6):
    return [*many(RATE[k] * rate, digits), *many(FORCE[k] * force, digits)]


def test_a_clock_that_steps_by_one_may_number_the_samples(tmp_path):
    """The stated rate was ignored, and 1000 Hz proposed."""
    rows = [line("Timestamp", *(f"{n}_rad_s" if n[0] == "g" else f"{n}_mps2" for n in SIX))]
    rows += [line(k, *samples(k)) for k in range(250)]
    path = written(tmp_path, "log.csv", rows)
    with pytest.raises(DataError, check=coded("io.time-unit-undecided")) as refused:
        sd.read_imu(path)
    assert refused.value.finding.data["flags"] == "--rate HZ"
    imu = sd.read_imu(path, rate_hz=100.0)
    check(imu, RATE[:250], FORCE[:250])
    assert "io.time-from-counter" in {f.code for f in imu.findings}


def test_a_specific_force_of_many_g_for_long_has_another_unit(tmp_path):
    rows = [line("time_s", *(f"{n}_dps" if n[0] == "g" else f"{n}_g" for n in SIX))]
    rows += [line(f"{T[k]:.3f}", *samples(k, DEG, 5.0 / STANDARD_GRAVITY)) for k in range(N)]
    imu = sd.read_imu(written(tmp_path, "log.csv", rows))
    (said,) = [f for f in imu.findings if f.code == "io.force-absurd-for-long"]
    assert (said.severity, said.quantity) == ("warning", "accel")
    assert said.data["ratio"] == pytest.approx(5.0, rel=0.01)


@pytest.mark.parametrize("columns", [{}, {f"gyro_{a}": f"{a.upper()}-Axis" for a in "xyz"}])
def test_rows_of_sensors_of_several_kinds_are_not_mixed(tmp_path, columns):
    """UMAFall: under three names of axes stand rows of each sensor, told apart by its number."""
    rows = ["TimeStamp;Sample No;X-Axis;Y-Axis;Z-Axis;Sensor Type;Sensor ID"]
    for k in range(N):
        for kind, three in ((0, FORCE[k] / STANDARD_GRAVITY), (1, RATE[k] * DEG)):
            rows.append(line(f"{1e3 * T[k]:.0f}", k, *many(three), kind, 3, separator=";"))
    with pytest.raises(DataError, check=coded("io.rows-of-kinds")) as refused:
        sd.read_imu(written(tmp_path, "walk.csv", rows), columns=columns, units={"gyro": "deg/s"})
    data = refused.value.finding.data
    assert (data["name"], data["kinds"]) == ("Sensor Type", (f"0 ({N} rows)", f"1 ({N} rows)"))


def test_a_copy_of_the_force_under_the_letter_g_is_no_gyro(tmp_path):
    """Torque: G(x) has the whole force beside that of a sensor; it was asked for as a rate."""
    names = [f"Acceleration Sensor({a} axis)(g)" for a in "XYZ"]
    rows = [line(" Device Time", " G(x)", " G(y)", " G(z)", *names)]
    for k in range(N):
        stamp = f"{DAY + timedelta(seconds=float(T[k])):%d-%b-%Y %H:%M:%S.%f}"[:-3]
        rows.append(line(stamp, *many(FORCE[k], 4), *many(FORCE[k] / STANDARD_GRAVITY, 4)))
    path = written(tmp_path, "trackLog.csv", rows)
    with pytest.raises(DataError, check=coded("io.accelerometer-alone")):
        sd.read_imu(path)
    # Rates under that letter are rates, of a turn at 10 deg/s about the vertical, too.
    noise = np.random.default_rng(4).normal(0.0, 0.02, (N, 6))
    rows = [line("time_s", "gx", "gy", "gz", "ax_g", "ay_g", "az_g")]
    for k in range(N):
        rows.append(line(T[k], *many(noise[k, :3] + [0, 0, 10]), *many(noise[k, 3:] + [0, 0, 1])))
    imu = sd.read_imu(written(tmp_path, "table.csv", rows), units={"gyro": "deg/s"})
    assert imu["gyro_z"].mean() == pytest.approx(10.0 / DEG, rel=0.01)


def test_a_remedy_names_no_column_that_is_not_there(tmp_path):
    rows = [line(*many(RATE[k], 2)) for k in range(N)]
    with pytest.raises(DataError, check=coded("io.nameless-columns-open")) as refused:
        sd.read_imu(written(tmp_path, "rates.csv", rows))
    assert refused.value.finding.data["example"] == "gyro_x=1,gyro_y=2,gyro_z=3"


def test_the_rate_that_a_flight_controller_demands_is_no_gyro(tmp_path):
    """INAV: axisRate was proposed as the gyro; the position is GPS_coord."""
    names = [f"{n}[{j}]" for n in ("axisRate", "gyroADC", "accSmooth") for j in range(3)]
    rows = [line("time (us)", *names, "GPS_coord[0]", "GPS_coord[1]", "GPS_altitude")]
    for k in range(N):
        at = [f"{LAT[k // 50]:.7f}", f"{LON[k // 50]:.7f}", 41]
        rows.append(line(round(1e6 * T[k]), 0, 0, 0, *samples(k, DEG), *at))
    path = written(tmp_path, "LOG00001.csv", rows)
    imu = sd.read_imu(path, units={"gyro": "deg/s", "accel": "m/s2"})
    check(imu)
    assert read_name("GPS_coord[0]", FIXES).quantity == "lat"
    assert read_name("GPS_coord[1]", FIXES).quantity == "lon"
    assert read_name("coord[0]", FIXES).quantity is None


@pytest.mark.parametrize(
    ("name", "quantity", "unit"),
    [
        ("AngleRate Xv (deg/s)", "gyro_x", "deg/s"),
        ("Accel Zv (m/s²)", "accel_z", "m/s2"),
        ("UnCompGyroY [rad/s]", "gyro_y", "rad/s"),
        ("Yaw [deg/s]", "gyro_z", "deg/s"),
        ("Roll (Deg/Sec)", "gyro_x", "deg/s"),
        ("Yaw [deg]", "heading", "deg"),
        ("esp_timestamp_us", "time", "us"),
        ("unified_time_s", "time", "s"),
    ],
)
def test_names_of_strangers(name, quantity, unit):
    said = read_name(name)
    assert (said.quantity, said.unit) == (quantity, unit)
    assert said.loose != UNKNOWN_WORDS


def test_channels_of_racecapture(tmp_path):
    """The first line has name, unit, range and rate of each channel; rows are between commas."""
    cells = ['"Interval"|"ms"|0|0|1', '"Utc"|"ms"|0|0|1']
    cells += [f'"Accel{a}"|"G"|-3.0|3.0|25' for a in "XYZ"]
    cells += [f'"{n}"|"Deg/Sec"|-120|120|25' for n in ("Yaw", "Pitch", "Roll")]
    rows = [line(*cells)]
    for k in range(N):
        three = many(FORCE[k] / STANDARD_GRAVITY)
        rows.append(line(402 + round(1e3 * T[k]), 0, *three, *many(RATE[k, ::-1] * DEG)))
    check(sd.read_imu(written(tmp_path, "rc_0.log", rows)))


def test_a_unit_at_the_end_of_a_line_is_that_of_its_axes(tmp_path):
    """Examples for the MPU-9250: ax = 12 ay = -3 az = 998 mg, and the rates below."""
    rows = []
    for k in range(N):
        for label, unit, three in (
            ("a", "mg", 1e3 * FORCE[k] / STANDARD_GRAVITY),
            ("g", "deg/s", RATE[k] * DEG),
        ):
            words = " ".join(
                f"{label}{a} = {v:.3f}" for a, v in zip("xyz", three.tolist(), strict=True)
            )
            rows.append(f"{words} {unit}")
    imu = sd.read_imu(written(tmp_path, "serial.txt", rows), rate_hz=100.0)
    check(imu, digits=1e-3)
    assert "io.unit-inferred" not in {f.code for f in imu.findings}


def test_clocks_that_are_the_same_are_one(tmp_path):
    """Two stamps of a program beside that of a device, which is not rounded, were a question."""
    names = ["Timestamp_ms", "DeviceTime_ms", "SystemTime_ms", *SIX]
    rows = [line(*names[:3], *(f"{n}_rad_s" if n[0] == "g" else f"{n}_mps2" for n in SIX))]
    for k in range(N):
        at = 1e3 * T[k] * 100.0 / 51.2
        rows.append(line(round(1.7e12 + at), f"{5021.3 + at:.3f}", round(1.7e12 + at), *samples(k)))
    imu = sd.read_imu(written(tmp_path, "log.csv", rows))
    assert imu.index[-1] == pytest.approx((N - 1) / 51.2, abs=1e-3)
    np.testing.assert_allclose(imu[GYRO], RATE, atol=1e-5)


def test_a_file_of_one_sensor_that_every_row_names(tmp_path):
    rows = ["Attribute,Time stamp,x,y,z"]
    rows += [line("Gyroscope", 156496 + 10 * k, *many(RATE[k] * DEG)) for k in range(N)]
    path = written(tmp_path, "run.csv", rows)
    imu = sd.read_imu(path, units={"gyro": "deg/s", "time": "ms"})
    np.testing.assert_allclose(imu[GYRO], RATE, atol=1e-6)


def test_bare_axes_under_lines_that_speak_of_one_sensor(tmp_path):
    """Examples of Arduino print the rate and the unit, then X, Y and Z."""
    top = ["Started", "Gyroscope sample rate = 100.00 Hz", "", "Gyroscope in degrees/second"]
    body = [line(*many(RATE[k] * DEG), separator="\t") for k in range(N)]
    imu = sd.read_imu(written(tmp_path, "serial.txt", [*top, "X\tY\tZ", *body]))
    np.testing.assert_allclose(imu[GYRO], RATE, atol=1e-6)
    np.testing.assert_allclose(np.diff(imu.index), STEP)
    top = ["Started", "Accelerometer sample rate = 100.00 Hz", "", "Acceleration in g's"]
    with pytest.raises(DataError, check=coded("io.accelerometer-alone")):
        sd.read_imu(written(tmp_path, "force.txt", [*top, "X\tY\tZ", *body]))


@pytest.mark.parametrize("keyed", [True, False])
def test_streams_of_strava(tmp_path, keyed):
    """Each stream is an object with its numbers as ``data``, under its name or with its type."""
    count = len(LAT)
    streams = {
        "heartrate": [120] * count,
        "altitude": [450.0] * count,
        "latlng": [[float(a), float(b)] for a, b in zip(LAT, LON, strict=True)],
        "time": list(range(count)),
    }
    said = {n: {"data": v, "original_size": count} for n, v in streams.items()}
    whole = said if keyed else [{"type": n, **one} for n, one in said.items()]
    path = tmp_path / "activity.json"
    path.write_text(json.dumps(whole), encoding="utf-8")
    table = sd.read_gnss(path, datum_height_m=0.0, position_sd_m=5.0)
    np.testing.assert_allclose(table[["lat", "lon"]], np.column_stack([LAT, LON]))
    np.testing.assert_allclose(np.diff(table.index), 1.0)


def test_a_sensor_of_empatica_says_why_it_is_refused(tmp_path):
    rows = [line(*["1574669480.000000"] * 3), line(*["32.000000"] * 3)]
    rows += [line(*(round(v) for v in 64 * FORCE[k] / STANDARD_GRAVITY)) for k in range(N)]
    with pytest.raises(DataError, check=coded("io.of-empatica")) as refused:
        sd.read_imu(written(tmp_path, "ACC.csv", rows))
    data = refused.value.finding.data
    assert (data["start"], data["rate"]) == (1574669480.0, 32.0)


def test_an_accelerometer_whose_axes_are_words_is_the_reason(tmp_path):
    names = ["up/down", "right/left", "forward/back"]
    rows = [line('"cts"', *(f'"Accelerometer ({n}) [m/s2]"' for n in names))]
    rows += [line(f"{1e3 * T[k]:.3f}", *many(FORCE[k])) for k in range(N)]
    with pytest.raises(DataError, check=coded("io.accelerometer-alone")):
        sd.read_imu(written(tmp_path, "HERO.csv", rows))


def test_fixes_by_the_clock_of_the_receiver_beside_that_since_the_start(tmp_path):
    """TrackAddict: Time and UTC Time were a question."""
    rows = ["Time,UTC Time,Latitude,Longitude,Altitude (m)"]
    for k, (lat, lon) in enumerate(zip(LAT, LON, strict=True)):
        rows.append(line(k, f"{1.7e9 + k:.3f}", f"{lat:.7f}", f"{lon:.7f}", 100))
    table = sd.read_gnss(written(tmp_path, "log.csv", rows), datum_height_m=0.0, position_sd_m=5.0)
    assert table.attrs["clock_origin"] + table.index[0] == pytest.approx(1.7e9)


def test_names_behind_the_word_that_begins_every_row(tmp_path):
    names = ["Time [ms]", *(f"{n[:-2]} {n[-1].upper()}" for n in SIX)]
    rows = [f"imu: {line(*names[:1], *(f'{n} [rad/s]' for n in names[1:4]), *names[4:])}"]
    rows += [f"imu: {line(round(1e3 * T[k]), *samples(k))}" for k in range(N)]
    check(sd.read_imu(written(tmp_path, "serial.txt", rows)))


def test_a_sentence_after_each_line_of_labels(tmp_path):
    rows = ["Initializing MPU6050...", "MPU6050 connected"]
    for k in range(N):
        labels = zip(("GyroX", "GyroY", "GyroZ", "AccX", "AccY", "AccZ"), samples(k), strict=True)
        rows += [" ".join(f"{n}: {v}" for n, v in labels), "Gyroscope data looks good."]
    path = written(tmp_path, "serial.txt", rows)
    check(sd.read_imu(path, rate_hz=100.0, units={"gyro": "rad/s"}))


def test_the_rate_of_a_heart_is_no_gyro(tmp_path):
    rows = ["unix_timestamp,heart_rate_voltage,accelerometer_x,accelerometer_y,accelerometer_z"]
    rows += [line(round(1.5e12 + 1e3 * T[k]), 517, *many(FORCE[k], 2)) for k in range(N)]
    with pytest.raises(DataError, check=coded("io.accelerometer-alone")):
        sd.read_imu(written(tmp_path, "heart.csv", rows))


def test_of_a_simulation_the_sensor_is_proposed(tmp_path):
    names = [f"{b}{n}_{a}" for b in ("", "imu_") for n in ("accel", "gyro") for a in "xyz"]
    rows = [line("time_s", *names)]
    for k in range(N):
        truth = [0.0, 0.0, 0.0, *many(RATE[k] * 0.9)]
        rows.append(line(T[k], *truth, *many(FORCE[k]), *many(RATE[k])))
    path = written(tmp_path, "simulation.csv", rows)
    with pytest.raises(DataError, check=coded("io.questions")) as refused:
        sd.read_imu(path)
    assert refused.value.finding.data["flags"] == "--columns gyro=imu_gyro,accel=imu_accel"


def test_gravity_in_three_letters_is_summed_with_linear_acceleration(tmp_path):
    names = [f"{n}{a}" for n in ("Gra", "LinearAcc", "Gyro") for a in "XYZ"]
    rows = [line("t_s", *names)]
    for k in range(N):
        rows.append(line(T[k], *many(FORCE[k] - 0.5), *many([0.5] * 3), *many(RATE[k])))
    check(sd.read_imu(written(tmp_path, "walk.csv", rows)))


def test_units_that_columns_in_json_state(tmp_path):
    """They were left out, and inferred or asked for."""
    held: dict = {"time": T.tolist()}
    for name, unit, values in (("gyro", "deg/s", 1e-3 * RATE * DEG), ("accel", "m/s2", FORCE)):
        held[name] = {a: values[:, k].tolist() for k, a in enumerate("xyz")} | {"unit": unit}
    path = tmp_path / "log.json"
    path.write_text(json.dumps(held), encoding="utf-8")
    imu = sd.read_imu(path)
    np.testing.assert_allclose(imu[GYRO], 1e-3 * RATE, atol=1e-12)
    assert "io.unit-inferred" not in {f.code for f in imu.findings}


@pytest.mark.parametrize("names", [("wx", "wy", "wz"), ("p", "q", "r"), ("gx", "gy", "gz")])
def test_rates_of_angles_beside_rates_are_not_the_gyro(tmp_path, names):
    """Those of a reference, in deg/s, took the place of a gyro that is named by letters."""
    others = ("Roll (deg/s)", "Pitch (deg/s)", "Yaw (deg/s)")
    force = [f"a{a} [m/s2]" for a in "xyz"]
    rows = [line("time [s]", *(f"{n} [rad/s]" for n in names), *force, *others)]
    rows += [line(T[k], *many(RATE[k]), *many(FORCE[k]), 7.0, 8.0, 9.0) for k in range(N)]
    check(sd.read_imu(written(tmp_path, "reference.csv", rows)))


def test_columns_that_are_written_in_parts_are_not_one_part(tmp_path):
    """Of objects of one type the last took the place of all before it."""
    held = {"time": T, "gyro_x": RATE[:, 0], "accel_x": FORCE[:, 0]}
    parts = [
        {"type": name, "data": values[k : k + 500].tolist()}
        for k in range(0, N, 500)
        for name, values in held.items()
    ]
    path = tmp_path / "parts.json"
    path.write_text(json.dumps(parts), encoding="utf-8")
    with pytest.raises(DataError):
        sd.read_imu(path)


def test_streams_state_their_units(tmp_path):
    held = {"time": {"data": T.tolist(), "unit": "s"}}
    for name, unit, values in (("gyro", "deg/s", 1e-3 * RATE * DEG), ("accel", "m/s2", FORCE)):
        for k, a in enumerate("xyz"):
            held[f"{name}_{a}"] = {"data": values[:, k].tolist(), "unit": unit}
    path = tmp_path / "streams.json"
    path.write_text(json.dumps(held), encoding="utf-8")
    np.testing.assert_allclose(sd.read_imu(path)[GYRO], 1e-3 * RATE, atol=1e-12)


def test_the_number_of_a_sample_in_its_packet_is_no_kind_of_sensor(tmp_path):
    rows = [line("t_s", "i", *(f"{n}{a}" for n in "uv" for a in "xyz"))]
    rows += [line(T[k], k % 10, *many(RATE[k]), *many(FORCE[k])) for k in range(N)]
    path = written(tmp_path, "packets.csv", rows)
    columns = {f"{t}_{a}": f"{n}{a}" for t, n in (("gyro", "u"), ("accel", "v")) for a in "xyz"}
    check(sd.read_imu(path, columns=columns, units={"gyro": "rad/s", "accel": "m/s2"}))


@pytest.mark.parametrize(
    ("name", "words", "force"),
    [
        ("kind", ("gyro", "acc"), False),
        ("type", ("0", "1"), False),
        ("sensor", ("Gyroscope", "Accelerometer"), True),
    ],
)
def test_rows_of_kinds_under_the_name_of_a_gyro_are_refused(tmp_path, name, words, force):
    rows = [
        line("t_s", name, *(f"gyro_{a}" for a in "xyz"), *(["ax", "ay", "az"] if force else []))
    ]
    for k in range(N):
        for word, three in zip(words, (RATE[k], FORCE[k]), strict=True):
            rows.append(line(T[k], word, *many(three), *(many(FORCE[k]) if force else [])))
    with pytest.raises(DataError, check=coded("io.rows-of-kinds")):
        sd.read_imu(written(tmp_path, "log.csv", rows))


@pytest.mark.parametrize(
    ("name", "words"),
    [("type", ("left", "right")), ("mac", ("D4:CA:6E:F1:00:01", "D4:CA:6E:F1:00:02"))],
)
@pytest.mark.parametrize("blocks", [False, True])
def test_rows_of_two_devices_are_read_of_the_first(tmp_path, name, words, blocks):
    if blocks and name == "type":
        return  # a kind of motion
    rows = [
        line(f"{T[k] + later:.3f}", word, *samples(k, sign, sign))
        for word, sign, later in ((words[0], 1.0, 0.0), (words[1], -1.0, 20.0 * blocks + 0.004))
        for k in range(N)
    ]
    rows = (
        rows if blocks else [row for pair in zip(rows[:N], rows[N:], strict=True) for row in pair]
    )
    path = written(tmp_path, "log.csv", [line("t_s", name, *SIX), *rows])
    imu = sd.read_imu(path, units={"gyro": "rad/s"})
    check(imu)
    assert "io.rows-of-several-sensors" in {f.code for f in imu.findings}


def test_a_kind_of_motion_tells_no_sensors_apart(tmp_path):
    rows = [line("t_s", "type", *(f"g{a}_rad_s" for a in "xyz"))]
    rows += [line(T[k], "walk" if k < 700 else "run", *many(RATE[k])) for k in range(N)]
    assert len(sd.read_imu(written(tmp_path, "log.csv", rows))) == N


@pytest.mark.parametrize("name", ["tag", "placement", "device"])
def test_words_of_what_was_done_tell_no_sensors_apart_while_time_goes_on(tmp_path, name):
    rows = [line("t_s", name, *SIX)]
    rows += [line(T[k], "hand" if k < 700 else "bag", *samples(k)) for k in range(N)]
    path = written(tmp_path, "log.csv", rows)
    assert len(sd.read_imu(path, units={"gyro": "rad/s"})) == N


def test_gravity_beside_an_accelerometer_leaves_its_sign_known(tmp_path):
    rows = [line("t_s", *SIX, "grx", "gry", "grz")]
    rows += [line(T[k], *samples(k), *samples(k)[3:]) for k in range(N)]
    path = written(tmp_path, "log.csv", rows)
    assert {*ACCEL} <= {*sd.read_imu(path, units={"gyro": "rad/s"})}


def test_stamps_with_three_decimals_are_not_grouped(tmp_path):
    rows = ["\t".join(("t_s", *SIX))]
    for k in range(N):
        time = 5.0 + 0.125 * k
        stamp = f"{time:.0f}" if time == int(time) else f"{time:.3f}"
        rows.append("\t".join((stamp, *map(str, samples(k)))))
    path = written(tmp_path, "log.tsv", rows)
    imu = sd.read_imu(path, units={"gyro": "rad/s", "time": "s"})
    assert imu.index[-1] - imu.index[0] == pytest.approx(0.125 * (N - 1))


@pytest.mark.parametrize("name", ["PacketCounter", "time"])
def test_a_count_of_which_samples_are_lost_is_a_count(tmp_path, name):
    rows = [line(name, *SIX)]
    kept = [k for k in range(N) if k not in (700, 701, 1100)]
    rows += [line(k, *samples(k)) for k in kept]
    path = written(tmp_path, "log.csv", rows)
    imu = sd.read_imu(path, units={"gyro": "rad/s"}, rate_hz=100.0)
    np.testing.assert_allclose(imu.index, STEP * np.array(kept), atol=1e-9)
    (said,) = [f for f in imu.findings if f.code == "io.time-from-counter"]
    assert said.data["lost"] == 3
    with pytest.raises(DataError) as refused:
        sd.read_imu(path)
    assert f'time = "{name}"' not in str(refused.value)


@pytest.mark.parametrize(
    "names",
    [
        [f"Gyroscope ({a}) [rad/s]" for a in ("up/down", "right/left", "forward/back")],
        ["Gyroscope (z,x,y) [rad/s]", "1", "2"],
    ],
)
def test_axes_of_a_camera_in_words(tmp_path, names):
    stamps = [(DAY + timedelta(seconds=float(t))).isoformat() for t in T]
    rows = [",".join(["cts", "date", *(f'"{n}"' for n in names), "temperature [°C]"])]
    rows += [line(10.0 * k, stamps[k], *many(RATE[k][[2, 0, 1]]), 25.3) for k in range(N)]
    imu = sd.read_imu(written(tmp_path, "GH01-GYRO.csv", rows))
    np.testing.assert_allclose(imu[GYRO], RATE, atol=1e-6)


def test_short_names_of_core_motion_are_summed_and_leave_the_sign_open(tmp_path):
    """An application of a watch: user acceleration as ax, gravity as grx."""
    linear = np.column_stack([0.1 * np.sin(7.0 * T), 0.2 * np.cos(5.0 * T), 0.1 * np.sin(3.0 * T)])
    gravity = -FORCE / STANDARD_GRAVITY
    rows = ["timestamp," + ",".join(f"{n}{a}" for n in ("a", "g", "gr") for a in "xyz")]
    for k in range(N):
        rows.append(
            line(DAY.timestamp() + T[k], *many(linear[k]), *many(RATE[k]), *many(gravity[k]))
        )
    path = written(tmp_path, "watch.csv", rows)
    left = {f.code for f in sd.read_imu(path, units={"gyro": "rad/s"}).findings}
    assert left >= {"io.force-of-linear-and-gravity", "io.left-out-unusable"}
    imu = sd.read_imu(path, units={"gyro": "rad/s", "accel": "-g"})
    check(imu, force=FORCE - STANDARD_GRAVITY * linear)


@pytest.mark.parametrize("name", ["lists", "objects", "columns", "lines", "batches"])
def test_samples_in_several_parts_are_one_log(tmp_path, name):
    rows = [
        {"t": DAY.timestamp() + T[k], "gyro": list(RATE[k]), "accel": list(FORCE[k])}
        for k in range(N)
    ]
    parts = [rows[k : k + 300] for k in range(0, N, 300)]
    held = [{"id": k, "samples": one} for k, one in enumerate(parts)]
    table = {"time": DAY.timestamp() + T}
    table |= {f"g{a}": RATE[:, k] for k, a in enumerate("xyz")}
    table |= {f"a{a}": FORCE[:, k] for k, a in enumerate("xyz")}
    columns = [{n: v[k : k + 300].tolist() for n, v in table.items()} for k in range(0, N, 300)]
    # A server that appends each message of an application: its payload has both sensors.
    events = [
        {
            "name": s,
            "time": 10**7 * int(1e2 * row["t"] + 0.5),
            "values": dict(zip("xyz", row[m], strict=True)),
        }
        for row in rows
        for s, m in (("gyroscope", "gyro"), ("accelerometer", "accel"))
    ]
    batches = [{"messageId": k, "payload": events[k : k + 600]} for k in range(0, 2 * N, 600)]
    text = {
        "lists": json.dumps(parts),
        "objects": json.dumps({"session": "a", "chunks": held}),
        "columns": json.dumps({"parts": columns}),
        "lines": "\n".join(map(json.dumps, held)),
        "batches": "\n".join(map(json.dumps, batches)),
    }[name]
    check(sd.read_imu(written(tmp_path, "log.json", [text]), units={"gyro": "rad/s"}))


@pytest.mark.parametrize(
    "lines",
    [
        ["(1709640000.010000) can0 1A0#FEFF0200", "(1709640000.020000) can0 1A0#FEFF0200"],
        [" can0  1A0   [4]  FE FF 02 00", " can0  1A0   [4]  FE FF 02 01"],
        [
            "date Tue Mar 5 12:00:00 pm 2024",
            "base hex  timestamps absolute",
            "0.01 1 1A0 Rx d 1 FE",
        ],
        [";$FILEVERSION=2.1", ";   Message   Time", "1 0.010 DT 1 01A0 Rx - 1 FE"],
        ["timestamp,arbitration_id,extended,remote,error,dlc,data", "1.0,0x1A0,0,0,0,1,/v8="],
    ],
)
def test_a_log_of_a_bus_is_named(tmp_path, lines):
    with pytest.raises(DataError, check=coded("io.foreign-format")) as refused:
        sd.read_imu(written(tmp_path, "bus.log", lines))
    assert "CAN" in str(refused.value)


@pytest.mark.parametrize("mark", [".", ","])
def test_marks_of_thousands_are_no_decimals(tmp_path, mark):
    rows = [
        "time (ms);"
        + ";".join([f"gyro {a} (mdps)" for a in "xyz"] + [f"acc {a} (mg)" for a in "xyz"])
    ]
    for k in range(N):
        whole = [*(1e3 * RATE[k] * DEG), *(1e3 * FORCE[k] / STANDARD_GRAVITY)]
        rows.append(
            line(10 * k, *(f"{round(v):,}".replace(",", mark) for v in whole), separator=";")
        )
    imu = sd.read_imu(written(tmp_path, "log.csv", rows))
    check(imu, digits=2e-4)
    assert "io.thousands-grouped" in {f.code for f in imu.findings}


def test_three_decimals_are_no_thousands(tmp_path):
    rows = [
        line("time_s", *(f"{n}_dps" if n[0] == "g" else f"{n}_m_s2" for n in SIX), separator=";")
    ]
    for k in range(N):
        rows.append(line(f"{T[k]:.3f}", *samples(k, DEG, digits=3), separator=";"))
    check(sd.read_imu(written(tmp_path, "log.csv", rows)), digits=2e-3)


@pytest.mark.parametrize(
    ("text", "second"),
    [
        ("Tue Mar 05 2024 13:00:00.250 GMT+0100 (Central European Standard Time)", 0.25),
        ("2024-03-05 13:00:00.250 GMT+01:00", 0.25),
    ],
)
def test_stamps_with_a_zone_behind_letters(text, second):
    (found,) = nanoseconds_of([text])
    assert found == int(DAY.timestamp()) * 10**9 + round(second * 1e9)


def test_durations_of_pandas():
    found = nanoseconds_of(["0 days 23:59:59.990000", "1 days 00:00:00", "1 days 00:00:00.010000"])
    np.testing.assert_array_equal(np.diff(found), [10**7, 10**7])


def test_an_export_of_influxdb(tmp_path):
    rows = ["#group,false,false,false,false,true,true", "#default,_result,,,,,"]
    rows.append(",result,table,_time,_value,_field,_measurement")
    columns = [
        (f"{n}_{a}", v[:, k])
        for n, v in (("gyro", RATE), ("accel", FORCE))
        for k, a in enumerate("xyz")
    ]
    for table, (name, values) in enumerate(columns):
        for k in range(N):
            at = DAY + timedelta(seconds=float(T[k]))
            rows.append(
                line("", "", table, f"{at:%Y-%m-%dT%H:%M:%S.%f}Z", f"{values[k]:.6f}", name, "imu")
            )
    check(sd.read_imu(written(tmp_path, "export.csv", rows), units={"gyro": "rad/s"}))


@pytest.mark.parametrize(
    ("clocks", "of_log"),
    [
        (("timestamp", "time_utc_ms"), "relative"),
        (("t_ms", "utc"), "relative"),
        (("elapsed_s", "time_utc"), "unix"),
    ],
)
def test_fixes_of_two_clocks_are_read_by_that_of_the_log(tmp_path, clocks, of_log):
    at = np.arange(15.0)
    since = [f"{t:.1f}" if clocks[0].endswith("_s") else f"{1e3 * t:.0f}" for t in at]
    utc = [
        f"{1e3 * (DAY.timestamp() + t):.0f}"
        if clocks[1].endswith("ms")
        else (DAY + timedelta(seconds=float(t))).isoformat()
        for t in at
    ]
    rows = [line(*clocks, "lat", "lon", "altHAE")]
    rows += [line(since[k], utc[k], LAT[k], LON[k], 520.0) for k in range(at.size)]
    fixes = sd.read_gnss(written(tmp_path, "fixes.csv", rows), position_sd_m=2.0)
    imu = pd.DataFrame({"gyro_x": 0.0}, index=T + (of_log == "unix") * 0.0)
    imu.attrs = {"clock": of_log, "clock_origin": DAY.timestamp() * (of_log == "unix")}
    moved, _ = on_clock_of(fixes, imu)
    np.testing.assert_allclose(moved.index, at, atol=1e-6)


def test_rows_with_a_stamp_alone_are_no_fixes(tmp_path):
    rows = ["time_s,lat,lon,altHAE,speed_ms,course"]
    for k in range(150):
        fix = [LAT[k // 10], LON[k // 10], 520.0, 1.5, 30.0] if k % 10 == 0 else [""] * 5
        rows.append(line(0.1 * k, *fix))
    fixes = sd.read_gnss(written(tmp_path, "fixes.csv", rows), position_sd_m=2.0)
    np.testing.assert_allclose(fixes.index, np.arange(15.0))
    assert "io.fixes-without-position-left-out" in {f.code for f in fixes.attrs["findings"]}


def test_a_count_of_parts_of_a_unit(tmp_path):
    rows = ["TOW [0.001 s],WNc [week],Latitude [deg],Longitude [deg],Height [m],HAccuracy [0.01 m]"]
    rows += [line(216018000 + 1000 * k, 2304, LAT[k], LON[k], 520.0, 80) for k in range(15)]
    fixes = sd.read_gnss(written(tmp_path, "fixes.csv", rows), datum_height_m=0.0)
    assert fixes["north_sd"].max() < 0.8


def test_velocities_beside_the_samples_say_what_they_need(tmp_path):
    rows = [line("t_s", *SIX, "Vel North (m/s)", "Vel East (m/s)")]
    rows += [line(T[k], *samples(k), 1.0, 2.0) for k in range(N)]
    imu = sd.read_imu(written(tmp_path, "log.csv", rows), units={"gyro": "rad/s"})
    (said,) = [f for f in imu.findings if f.code == "io.velocities-in-log"]
    assert said.data["names"] == ("Vel North (m/s)", "Vel East (m/s)")
