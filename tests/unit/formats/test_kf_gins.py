"""Increments of KF-GINS: recognised by their numbers, read to the bit, refused in words."""

from __future__ import annotations

import numpy as np
import pytest
from tests.coded import coded

from strapdown.errors import ConfigError, DataError
from strapdown.formats import READERS, ReadOptions, read_log
from strapdown.formats.gnss_files import read_gnss
from strapdown.tables import ACCEL, GYRO

STEP = 0.005


def increments(n=40, first=456300.005):
    rng = np.random.default_rng(3)
    time = np.round(first + STEP * np.arange(n), 4)
    theta = 1e-5 * rng.standard_normal((n, 3))
    dv = [0.0, 0.0, -9.79 * STEP] + 1e-4 * rng.standard_normal((n, 3))
    return np.column_stack([time, theta, dv])


def lines(rows, form="%.4f" + " %.12f" * 6):
    return [form % tuple(row) for row in rows]


def written(path, rows, form="%.4f" + " %.12f" * 6):
    path.write_text("\n".join(lines(rows, form)) + "\n")
    return path


def test_read_to_the_bit(tmp_path):
    path = written(tmp_path / "imu.txt", increments())
    rows = np.array([[float(f) for f in line.split()] for line in path.read_text().splitlines()])
    recording = read_log(path)
    steps = np.r_[np.median(np.diff(rows[:, 0])), np.diff(rows[:, 0])][:, None]
    assert np.array_equal(recording.imu.index, rows[:, 0])
    assert np.array_equal(recording.imu[GYRO].to_numpy(), rows[:, 1:4] / steps)
    assert np.array_equal(recording.imu[ACCEL].to_numpy(), rows[:, 4:] / steps)
    attrs = recording.imu.attrs
    assert attrs["sampling"] == "mean" and attrs["clock"] == "gps-seconds-of-week"
    assert any("KF-GINS" in f.what for f in recording.findings)


@pytest.mark.parametrize("name", ["imu.txt", "imu.csv", "imu.dat", "imu.imu"])
def test_any_ending_and_any_blanks(tmp_path, name):
    path = written(tmp_path / name, increments(), form="%14.4f" + "   %18.12f" * 6)
    assert READERS["kf-gins"].detect(path)
    plain = read_log(written(tmp_path / "plain.txt", increments())).imu
    assert np.array_equal(read_log(path).imu.to_numpy(), plain.to_numpy())


def test_rates_and_other_orders_are_not_taken_for_it(tmp_path):
    rows = increments()
    rates = np.column_stack([rows[:, 0], rows[:, 1:] / STEP])
    other = rows[:, [0, 4, 5, 6, 1, 2, 3]]
    for k, table in enumerate((rates, other, rows[:, 1:])):
        path = written(tmp_path / f"{k}.txt", table, form=" ".join(["%.12f"] * table.shape[1]))
        assert not READERS["kf-gins"].detect(path)
        with pytest.raises(DataError) as refused:
            read_log(path)
        finding = refused.value.finding
        told = [finding.code, *(q.code for q in finding.data.get("questions", ()))]
        known = {f"io.nameless-{k}" for k in ("seven-columns", "columns", "columns-open")}
        assert known & set(told)


def test_asked_for_it_is_read_though_it_does_not_look_so(tmp_path):
    rows = increments()
    rows[:, 4:] *= 0.1  # a unit in free fall, say
    path = written(tmp_path / "fall.txt", rows)
    imu = read_log(path, ReadOptions(format="kf-gins", axes="x,y,z")).imu
    assert imu["accel_z"].mean() == pytest.approx(-0.979, rel=0.01)
    with pytest.raises(
        ConfigError, check=lambda refused: refused.finding.code == "io.unknown-format-of-log"
    ):
        read_log(path, ReadOptions(format="kfgins"))


def test_the_end_of_a_week(tmp_path):
    rows = increments(first=604799.9)
    rows[rows[:, 0] >= 604800.0 - 1e-6, 0] -= 604800.0
    rows[:, 0] = np.abs(np.round(rows[:, 0], 4))
    recording = read_log(written(tmp_path / "imu.txt", rows))
    assert recording.imu.index[-1] == pytest.approx(604799.9 + 39 * STEP, abs=1e-9)
    assert np.diff(recording.imu.index) == pytest.approx(STEP, abs=1e-9)
    said = [f for f in recording.findings if "seconds of week start again" in f.what]
    assert said[0].row == 21


def spoiled(tmp_path, change, name="imu.txt"):
    rows = lines(increments())
    change(rows)
    path = tmp_path / name
    path.write_bytes(("\n".join(rows) + "\n").encode())
    return path


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda r: r.__setitem__(9, r[9] + " 1.0"), "row 10: 8 fields, where the first line has 7"),
        (lambda r: r.__setitem__(9, r[9].rsplit(" ", 1)[0]), "row 10: 6 fields"),
        (
            lambda r: r.__setitem__(9, r[9].replace("0.0", "o.o", 1)),
            "row 10, time: '45630o.o500' is not a number",
        ),
        (lambda r: r.__setitem__(9, r[8]), "row 10, time: the stamp 456300.045 repeats"),
        (lambda r: r.insert(20, r[5]), "row 21, time: time decreases from 456300.1 to 456300.03"),
        (lambda r: r.__setitem__(9, "nan" + r[9][11:]), "row 10, time: nan is not a finite number"),
    ],
)
def test_bad_rows_are_named(tmp_path, change, message):
    with pytest.raises(DataError) as error:
        read_log(spoiled(tmp_path, change), ReadOptions(format="kf-gins"))
    assert f"imu.txt, {message}" in str(error.value)
    assert error.value.finding.remedy


def test_a_file_that_is_cut(tmp_path):
    text = "\n".join(lines(increments()))
    (tmp_path / "imu.txt").write_text(text[:-40])
    recording = read_log(tmp_path / "imu.txt")
    assert len(recording.imu) == 39
    assert any("the last line is incomplete" in f.what and f.row == 40 for f in recording.findings)


@pytest.mark.parametrize(
    ("encode", "decimal"),
    [("utf-16", "."), ("utf-8-sig", "."), ("utf-8", ",")],
)
def test_other_encodings_and_decimal_commas(tmp_path, encode, decimal):
    text = "\n".join(lines(increments())).replace(".", decimal) + "\n"
    (tmp_path / "imu.txt").write_bytes(text.encode(encode))
    imu = read_log(tmp_path / "imu.txt", ReadOptions(format="kf-gins")).imu
    plain = read_log(written(tmp_path / "plain.txt", increments())).imu
    assert np.array_equal(imu.to_numpy(), plain.to_numpy())


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"", "the file is empty"),
        (bytes(range(256)) * 20, "the file has zero bytes and is not text"),
    ],
)
def test_no_text(tmp_path, data, message):
    (tmp_path / "imu.txt").write_bytes(data)
    with pytest.raises(DataError, match=message):
        read_log(tmp_path / "imu.txt")


def test_another_width_is_refused(tmp_path):
    path = written(tmp_path / "imu.txt", increments()[:, :6], form=" ".join(["%.9f"] * 6))
    with pytest.raises(
        DataError, check=lambda refused: refused.finding.code == "io.kf-gins-column-count"
    ):
        read_log(path, ReadOptions(format="kf-gins"))


def test_increments_are_no_fixes(tmp_path):
    with pytest.raises(DataError, check=coded("io.no-stream")):
        read_gnss(written(tmp_path / "imu.txt", increments()))


def test_a_third_axis_up_is_said(tmp_path):
    rows = increments(4000)
    rows[:, 6] *= -1.0
    recording = read_log(written(tmp_path / "imu.txt", rows))
    assert any("the specific force of the third axis is 9.7" in f.what for f in recording.findings)
    assert any("points up" in f.what for f in recording.findings)
