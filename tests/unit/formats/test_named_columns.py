"""Tables whose columns have fixed names."""

from __future__ import annotations

from pathlib import Path

import pytest

from strapdown.errors import DataError
from strapdown.formats.named_columns import read_reference_path
from strapdown.tables import NED


def written(folder: Path, text: str) -> Path:
    path = folder / "cameras.csv"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    "head",
    [
        "time,north,east,down",
        "time_s,north_m,east_m,down_m",
        "Time [s],North [m],East [m],Down [m]",
    ],
)
def test_reference_path(tmp_path: Path, head: str) -> None:
    table = read_reference_path(written(tmp_path, f"{head}\n0,1,2,3\n0.5,1.5,2,3\n"))
    assert list(table.columns) == NED
    assert table.index.tolist() == [0.0, 0.5]
    assert table["north"].tolist() == [1.0, 1.5]
    assert table.attrs["source"] == "cameras.csv"


def test_units_and_deviations(tmp_path: Path) -> None:
    path = written(
        tmp_path,
        "time_ms,north_mm,east_mm,down_mm,north_sd_mm,east_sd_mm,down_sd_mm,frame\n"
        "0,1000,2000,3000,5,6,7,1\n500,1500,2000,3000,5,6,7,2\n",
    )
    table = read_reference_path(path)
    assert table.index.tolist() == [0.0, 0.5]
    assert table.iloc[1].tolist() == pytest.approx([1.5, 2.0, 3.0, 0.005, 0.006, 0.007], rel=1e-15)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("time,north,east\n0,1,2\n1,1,2\n", "cameras.csv, columns: unknown column 'down'"),
        (
            "time,north,east,down\n0,1,2,3\n0,1,2,3\n",
            "cameras.csv, row 3, time: time decreases from 0 s to 0 s",
        ),
        (
            "time,north,east,down\n0,1,2,3\n1,,2,3\n",
            "cameras.csv, row 3, north: nan is not a number",
        ),
        (
            "time,north [furlong],east,down\n0,1,2,3\n1,1,2,3\n",
            "the unit is 'furlong', and m is needed",
        ),
        (
            "time,north,east,down,north_sd\n0,1,2,3,1\n1,1,2,3,1\n",
            "east_sd: the column is missing, and another standard deviation is given",
        ),
        ("time,north,east,down\n0,1,b,3\n1,1,2,3\n", "east: the column has text"),
    ],
)
def test_refused(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(DataError) as error:
        read_reference_path(written(tmp_path, text))
    assert message in str(error.value)
