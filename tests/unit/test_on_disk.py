"""Arrays of a long log on the disk: the same numbers, and only what is in use in memory."""

from __future__ import annotations

import mmap
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from strapdown.formats import csv
from strapdown.formats.assemble import assemble
from strapdown.formats.recording import ReadOptions
from strapdown.tables import on_disk


def resident():
    """Bytes of mapped files in memory."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return 1024 * next(int(line.split()[1]) for line in lines if line.startswith("RssFile"))


@pytest.mark.skipif(sys.platform != "linux", reason="other systems keep arrays in memory")
def test_what_is_let_go_takes_no_memory_and_is_read_again():
    rows = on_disk.room((3, 1 << 23))
    assert isinstance(rows.base, mmap.mmap)
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
