"""Sensors with stamps of their own, on the stamps of the gyro."""

from __future__ import annotations

import numpy as np
import pytest
from tests.coded import coded

from strapdown.errors import ConfigError, DataError
from strapdown.formats import read_joined, read_log
from strapdown.formats.recording import ReadOptions
from strapdown.tables import ACCEL, GYRO

STEP = 0.01


def line_of(t):
    """Values that are straight lines in time, so that interpolation has no error of its own."""
    return np.column_stack([0.1 * t, 1.0 - t, 9.8 + 0.01 * t])


def table(path, t, values, head="time_s,accel_x_m_s2,accel_y_m_s2,accel_z_m_s2", scale=1):
    rows = [
        ",".join([f"{s:d}" if scale != 1 else f"{s!r}", *(repr(float(v)) for v in row)])
        for s, row in zip(
            (np.round(np.asarray(t) * scale).astype(int).tolist() if scale != 1 else t.tolist()),
            values,
            strict=True,
        )
    ]
    path.write_text("\n".join([head, *rows]) + "\n", encoding="utf-8")
    return path


GYRO_HEAD = "time_s,gyro_x_rad_s,gyro_y_rad_s,gyro_z_rad_s"


@pytest.fixture
def gyro(tmp_path):
    t = np.round(np.arange(300) * STEP, 2)
    return table(tmp_path / "g.csv", t, np.sin(line_of(t)), GYRO_HEAD), t


def said(recording, words):
    return [f for f in recording.findings if words in f.what]


def test_values_between_two_samples_lie_on_the_line_between_them(tmp_path, gyro):
    path, t = gyro
    own = np.linspace(-0.0037, 3.0011, 421)
    recording = read_joined([path, table(tmp_path / "a.csv", own, line_of(own))])
    # Values are a few units large; interpolation rounds to a few of their last places.
    assert np.allclose(recording.imu[ACCEL], line_of(t), rtol=0, atol=1e-14)
    assert np.array_equal(recording.imu.index, t)
    assert np.array_equal(recording.imu[GYRO], np.sin(line_of(t)))
    finding = said(recording, "interpolated to 300 stamps")[0]
    nearest = np.abs(own[:, None] - t).min(axis=0).max()
    assert f"{nearest:.3g} s from the nearest sample" in finding.what
    assert [f.name for f in recording.files] == ["g.csv", "a.csv"]


def test_distances_between_stamps_without_a_unit_are_in_seconds(tmp_path):
    """They are found in the unit of the stamps, ns here, which no name states."""
    t = 81_234.5 + np.arange(300) * STEP
    head = GYRO_HEAD.replace("time_s", "timestamp")
    gyro = table(tmp_path / "g.csv", t, np.sin(line_of(t)), head, 10**9)
    head = "timestamp,accel_x_m_s2,accel_y_m_s2,accel_z_m_s2"
    accel = table(tmp_path / "a.csv", t + 0.0012, line_of(t), head, 10**9)
    recording = read_joined([gyro, accel])
    code = "io.interpolated-stamps-gyro-not-own"
    (finding,) = [f for f in recording.findings if f.code == code]
    assert finding.data["distance"] == pytest.approx(0.0012)


def test_the_order_of_files_and_the_unit_of_time_do_not_matter(tmp_path, gyro):
    path, t = gyro
    own = np.linspace(-0.01, 3.0, 302)
    head = "time_us,accel_x_m_s2,accel_y_m_s2,accel_z_m_s2"
    recording = read_joined([table(tmp_path / "a.csv", own, line_of(own), head, 1_000_000), path])
    # A stamp rounded to a microsecond moves the steepest value, 1 a second, by half of one.
    assert np.allclose(recording.imu[ACCEL], line_of(t), rtol=0, atol=0.6e-6)


def test_nanoseconds_of_1970_lose_nothing(tmp_path):
    first = 1_700_000_000_123_456_789
    ticks = first + np.arange(200) * 10_000_001
    own = first - 3 + np.arange(202) * 10_000_001
    names = {"gyro": ticks, "accel": own}
    for name, stamps in names.items():
        unit = "rad_s" if name == "gyro" else "m_s2"
        rows = [f"{s},{5e-4 * (s - first)},0,1" for s in stamps.tolist()]
        head = "time_ns," + ",".join(f"{name}_{a}_{unit}" for a in "xyz")
        (tmp_path / f"{name}.csv").write_text("\n".join([head, *rows]) + "\n")
    imu = read_joined([tmp_path / "gyro.csv", tmp_path / "accel.csv"]).imu
    # In seconds of 1970 a double is off by up to 120 ns, which is 0.06 of this value. What is left
    # is the rounding of time, up to 2 s, times the slope of 5e5 a second, a few times over.
    assert np.allclose(imu["accel_x"], 5e-4 * (ticks - first), rtol=0, atol=4 * 2.2e-16 * 5e5)


def test_equal_stamps_are_taken_as_they_are(tmp_path, gyro):
    path, t = gyro
    recording = read_joined([path, table(tmp_path / "a.csv", t, line_of(t))])
    assert np.array_equal(recording.imu[ACCEL], line_of(t))
    assert not said(recording, "interpolated")


def test_nothing_is_extrapolated(tmp_path, gyro):
    path, t = gyro
    own = t[10:290] + 0.001
    recording = read_joined([path, table(tmp_path / "a.csv", own, line_of(own))])
    assert recording.imu.index[0] == t[11]
    assert recording.imu.index[-1] == t[289]
    assert said(recording, "21 of 300 rows dropped")


def test_a_sensor_that_covers_half_is_left_out(tmp_path, gyro):
    path, t = gyro
    recording = read_joined([path, table(tmp_path / "a.csv", t[:150], line_of(t[:150]))])
    assert list(recording.imu.columns) == GYRO
    assert len(recording.imu) == 300
    assert said(recording, "left out: values for only 150 of the 300")


def test_clocks_without_common_time_are_refused(tmp_path, gyro):
    path, t = gyro
    other = table(tmp_path / "a.csv", t + 1.7e9, line_of(t))
    with pytest.raises(
        DataError, check=lambda refused: refused.finding.code == "io.stamps-run-after-first-gyro"
    ) as error:
        read_joined([path, other])
    assert error.value.finding.file == "a.csv"
    assert "one clock" in error.value.finding.remedy


def test_a_gap_is_named(tmp_path, gyro):
    path, t = gyro
    own = np.concatenate([t[:100], t[150:]])
    recording = read_joined([path, table(tmp_path / "a.csv", own, line_of(own))])
    assert said(recording, "1 gaps, the longest 0.51 s")
    assert "the farthest is 0.25 s" in said(recording, "interpolated")[0].what


def test_samples_that_are_no_numbers_or_repeat_are_not_used(tmp_path, gyro):
    path, t = gyro
    values = line_of(t)
    values[20, 1] = np.nan
    own = t.copy()
    own[40] = own[39]
    recording = read_joined([path, table(tmp_path / "a.csv", own, values)])
    assert said(recording, "2 of 300 samples not used")
    assert np.allclose(recording.imu[ACCEL], line_of(t), rtol=0, atol=1e-14)


def test_no_gyro_two_gyros_and_mute_clocks_are_refused(tmp_path, gyro):
    path, t = gyro
    accel = table(tmp_path / "a.csv", t, line_of(t))
    with pytest.raises(
        DataError, check=lambda refused: refused.finding.code == "io.no-gyroscope-holds"
    ):
        read_joined([accel, accel])
    with pytest.raises(
        ConfigError, check=lambda refused: refused.finding.code == "io.gyro-in-several-logs"
    ):
        read_joined([path, path])
    mute = table(tmp_path / "m.csv", t, line_of(t), "time,accel_x_g,accel_y_g,accel_z_g")
    with pytest.raises(
        DataError, check=lambda refused: refused.finding.code == "io.stamps-no-unit-those-other"
    ) as error:
        read_joined([path, mute])
    assert error.value.finding.file == "m.csv"


def test_columns_are_named_by_their_log(tmp_path):
    t = np.round(np.arange(50) * STEP, 2)
    for name in ("one", "two"):
        table(tmp_path / f"{name}.csv", t, line_of(t), "time_s,p,q,r")
    named = {f"gyro_{a}": f"one.csv/{c}" for a, c in zip("xyz", "pqr", strict=True)}
    named |= {f"accel_{a}": f"two.csv/{c}" for a, c in zip("xyz", "pqr", strict=True)}
    options = ReadOptions(columns=named, gyro_unit="deg/s", accel_unit="g")
    imu = read_joined([tmp_path / "one.csv", tmp_path / "two.csv"], options).imu
    assert np.allclose(imu[GYRO], np.radians(line_of(t)), rtol=1e-15, atol=0)
    assert np.allclose(imu[ACCEL], 9.80665 * line_of(t), rtol=1e-15, atol=0)
    with pytest.raises(ConfigError, check=coded("io.no-log-with-column")):
        read_joined(
            [tmp_path / "one.csv", tmp_path / "two.csv"], ReadOptions(columns={"gyro_x": "z"})
        )


def test_one_log_alone_is_that_log(gyro):
    path, _ = gyro
    assert read_joined([path]).imu.equals(read_log(path).imu)


def test_a_folder_of_one_table_a_sensor(tmp_path):
    t = np.round(np.arange(100) * STEP, 2)
    folder = tmp_path / "log"
    folder.mkdir()
    own = np.round(np.arange(-1, 101) * STEP + 0.003, 3)
    own[-1] = 1.01
    table(folder / "gyro.csv", t, line_of(t), "time_s,x,y,z")
    table(folder / "accel.csv", own, line_of(own), "time_s,x [m/s^2],y [m/s^2],z [m/s^2]")
    (folder / "notes.txt").write_text("hello")
    with pytest.raises(DataError, check=coded("io.unit-undecided")):
        read_log(folder)
    recording = read_log(folder, ReadOptions(gyro_unit="rad/s"))
    assert np.array_equal(recording.imu[GYRO], line_of(t))
    assert np.allclose(recording.imu[ACCEL], line_of(t), rtol=0, atol=1e-14)
    assert {f.name for f in recording.files} == {"gyro.csv", "accel.csv"}
