"""Rows that are named are those of the file, not of the table that was made of it."""

from __future__ import annotations

import sys
from pathlib import Path

import pandas as pd
import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / "cli"))

from bad_navigate import write_drive

from strapdown.config.logs import AxesTable, LogTable
from strapdown.errors import DataError, DivergenceError, Finding
from strapdown.formats.gnss_files import read_gnss
from strapdown.systems.alignment_source import body_record
from strapdown.systems.navigation_source import in_file, said_of_file


def table(**attrs):
    out = pd.DataFrame({"a": [1.0, 2.0]})
    out.attrs |= {"source": "log.csv", **attrs}
    return out


def test_rows_are_moved_by_what_stands_before_them():
    said = (Finding("noisy", file="log.csv", row=5), Finding("late", file="fixes.csv", row=5))
    moved = in_file((*said, Finding("all of it", file="log.csv")), table(first_row=4))
    assert [f.row for f in moved] == [8, 5, None]
    assert [f.row for f in in_file(said, table(first_row=None))] == [None, 5]
    assert in_file(said, table()) == said


def test_errors_are_moved_too():
    with pytest.raises(DataError) as caught, said_of_file(table(first_row=4)):
        raise DataError("sensors.stuck", file="log.csv", row=2, quantity="gyro_x", value=1.0)
    assert caught.value.finding == Finding(
        "sensors.stuck", severity="error", file="log.csv", row=5, quantity="gyro_x", value=1.0
    )


def test_a_state_that_diverges_is_of_the_first_table():
    with pytest.raises(DivergenceError) as caught, said_of_file(table(first_row=4)):
        raise DivergenceError("estimation.diverged", quantity="state")
    assert caught.value.finding.file == "log.csv"


def test_readers_say_where_their_first_row_stands(tmp_path):
    write_drive(tmp_path)
    path = str(tmp_path / "drive.csv")
    lines = (tmp_path / "drive.csv").read_text().splitlines()
    for from_s in (None, 20.0):
        _, imu, _ = body_record(LogTable(path=path, from_s=from_s), AxesTable())
        stands = lines[imu.attrs["first_row"] - 1]  # two comments and a header come before
        assert float(stands.split(",")[0]) == imu.index[0]
    fixes = read_gnss(tmp_path / "fixes.csv")
    assert fixes.attrs["first_row"] == 2
