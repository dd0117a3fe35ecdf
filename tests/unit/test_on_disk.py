"""Arrays of a long log on the disk: the same numbers, and only what is in use in memory."""

from __future__ import annotations

import mmap
import sys

import numpy as np
import pandas as pd
import pytest
from tests.resident import resident

from strapdown.formats import csv
from strapdown.formats.assemble import assemble
from strapdown.formats.recording import ReadOptions
from strapdown.navigation.record import GrowingRows
from strapdown.sensors.health_log import equal_runs
from strapdown.sensors.imu_health import check_imu_channels
from strapdown.tables import imu_table, on_disk
from strapdown.tables.checks import all_finite


@pytest.mark.skipif(sys.platform != "linux", reason="other systems keep arrays in memory")
def test_what_is_let_go_takes_no_memory_and_is_read_again():
    rows = on_disk.room((3, 1 << 23))
    assert isinstance(rows.base, mmap.mmap)
    assert isinstance(on_disk.room((3, 5), large=120, most=1).base, mmap.mmap)
    assert on_disk.room((3, 5), large=121).base is None
    before = resident()
    rows[:] = np.arange(rows.shape[1])
    filled = resident()
    assert filled - before > 0.9 * rows.nbytes
    on_disk.let_go(rows[1, 5:].T)
    # Within a twentieth: libraries are files, too.
    assert abs(resident() - before) < 0.05 * rows.nbytes
    assert rows[2, -1] == rows.shape[1] - 1
    table = pd.DataFrame(rows.T, columns=list("abc"), copy=False)
    table["a"].sum()
    on_disk.let_go(table)
    assert abs(resident() - before) < 0.05 * rows.nbytes
    assert table["b"].iloc[1000] == 1000.0


def test_small_arrays_and_those_without_a_place_are_in_memory(monkeypatch):
    assert on_disk.room((2, 10)).base is None

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(on_disk.os, "posix_fallocate", full)
    rows = on_disk.room((1, on_disk.LARGE // 8))
    assert rows.base is None
    assert on_disk.room((3, 5), most=120).base is None
    for large in (1, 1000):
        with pytest.raises(MemoryError):
            on_disk.room((3, 5), large=large, most=119)
    assert rows.shape == (1, on_disk.LARGE // 8)
    on_disk.let_go(rows)
    on_disk.let_go(pd.DataFrame({"word": ["a", "b"]}))


def test_a_log_on_the_disk_is_the_log_in_memory(tmp_path, monkeypatch):
    rng, n = np.random.default_rng(3), 5000
    names = [f"{s}_{a}" for s in ("gyro", "accel") for a in "xyz"]
    columns = {"t": 0.01 * np.arange(n)} | {name: rng.normal(size=n) for name in names}
    columns["accel_z"] += 9.8
    csv.write(tmp_path / "log.csv", columns, {})
    options = ReadOptions(gyro_unit="rad/s", accel_unit="m/s2", axes="x,-y,-z")
    whole = assemble(csv.read(tmp_path / "log.csv"), options).imu
    monkeypatch.setattr(on_disk, "LARGE", 1)
    imu = assemble(csv.read(tmp_path / "log.csv"), options).imu
    base = imu["gyro_x"].to_numpy()
    while isinstance(base, np.ndarray):
        base = base.base
    assert isinstance(base, mmap.mmap)
    pd.testing.assert_frame_equal(imu, whole, check_exact=True)


@pytest.mark.skipif(sys.platform != "linux", reason="other systems keep arrays in memory")
def test_rows_that_grow_leave_the_memory():
    rows, before, some = GrowingRows.of(64), resident(), np.arange(64.0 * 1024).reshape(-1, 64)
    for _ in range(160):
        rows = rows.and_then(some)
    # The newest part, and a part of a page table's reach about it; of 80 MB in all.
    assert resident() - before < 4 * on_disk.PART
    assert rows.count == 160 * 1024
    np.testing.assert_array_equal(rows.rows[-1024:], some)
    np.testing.assert_array_equal(rows.rows[:1024], some)
    on_disk.let_go_of_all()
    assert abs(resident() - before) < on_disk.PART


def test_arrays_made_in_parts_are_those_of_the_whole(monkeypatch):
    monkeypatch.setattr(on_disk, "LARGE", 1)
    monkeypatch.setattr(on_disk, "PART", 8 * 7)
    rng = np.random.default_rng(5)
    time = np.cumsum(rng.random(100))
    steps = on_disk.filled(99, lambda part: np.diff(time[part.start : part.stop + 1]))
    np.testing.assert_array_equal(steps, np.diff(time))
    assert on_disk.step_range(time) == (np.diff(time).min(), np.diff(time).max())
    assert np.isnan(on_disk.step_range(np.where(time == time[50], np.nan, time))).all()
    assert on_disk.step_range(time[:1]) == (np.inf, -np.inf)
    table, rows = rng.random((100, 3)), rng.permutation(100)[:31]
    np.testing.assert_array_equal(on_disk.stored(table), table)
    np.testing.assert_array_equal(on_disk.stored(table, rows), table[rows])
    whole = on_disk.filled(20, lambda part: np.arange(part.start, part.stop), np.int64)
    assert whole.dtype == np.int64
    on_disk.tidy()
    assert whole.tolist() == list(range(20))
    values = rng.random((100, 3))
    assert all_finite(values)
    values[99, 2] = np.inf
    assert not all_finite(values)
    assert all_finite(np.full(3, 1e308))


@pytest.mark.parametrize(
    "values",
    [[1, 1, 2, 3, 3, 3, 4], [1, 2, 3], [5, 5, 5], [1, np.nan, np.nan, 2, 2], [0.0, -0.0, 1]],
)
def test_runs_of_equal_values(monkeypatch, values):
    monkeypatch.setattr(on_disk, "PART", 8 * 2)
    v = np.array(values, dtype=float)
    starts = [0, *(k for k in range(1, v.size) if v[k] != v[k - 1])]
    lengths = np.diff([*starts, v.size])
    runs = [(a, n) for a, n in zip(starts, lengths.tolist(), strict=True) if n > 1]
    found = equal_runs(v)
    assert list(zip(*(of.tolist() for of in found[:2]), strict=True)) == runs
    assert found[2] == len(starts)


def test_the_health_of_channels_on_the_disk_is_that_in_memory(monkeypatch):
    rng, n = np.random.default_rng(6), 20_000
    values = np.round(rng.normal(size=(n, 6)), 2)
    values[4000:4300, 1] = values[4000, 1]
    values[9000:9004, 4] = 20.0
    imu = imu_table(0.01 * np.arange(n), values[:, :3], values[:, 3:] - [0.0, 0.0, 9.8])
    whole = check_imu_channels(imu)
    assert {fault.kind for fault in whole.faults} >= {"stuck", "saturated"}
    monkeypatch.setattr(on_disk, "LARGE", 1)
    monkeypatch.setattr(on_disk, "PART", 8 * 250)
    assert vars(check_imu_channels(imu)) == vars(whole)
