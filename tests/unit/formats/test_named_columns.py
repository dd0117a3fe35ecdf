"""Tables whose columns have fixed names."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from strapdown.errors import DataError
from strapdown.formats.aid_table import read_reference_path
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
    ("text", "code"),
    [
        ("time,north,east\n0,1,2\n1,1,2\n", "io.missing-columns"),
        (
            "time,north,east,down\n0,1,2,3\n0,1,2,3\n",
            "io.aid-not-later",
        ),
        (
            "time,north,east,down\n0,1,2,3\n1,,2,3\n",
            "io.aid-no-number",
        ),
        (
            "time,north [furlong],east,down\n0,1,2,3\n1,1,2,3\n",
            "io.unit-of-other-quantity",
        ),
        (
            "time,north,east,down,north_sd\n0,1,2,3,1\n1,1,2,3,1\n",
            "io.missing-while-another-standard-deviation",
        ),
        ("time,north,east,down\n0,1,b,3\n1,1,2,3\n", "io.value-not-a-number"),
    ],
)
def test_refused(tmp_path: Path, text: str, code: str) -> None:
    with pytest.raises(DataError, check=lambda refused: refused.finding.code == code):
        read_reference_path(written(tmp_path, text))


def test_a_path_in_json(tmp_path: Path) -> None:
    path = tmp_path / "path.jsonl"
    rows = [{"time": k, "north": k, "east": 0.0, "down": -1.0} for k in range(3)]
    path.write_text("".join(json.dumps(row) + "\n" for row in rows), encoding="utf-8")
    assert read_reference_path(path)["north"].tolist() == [0.0, 1.0, 2.0]
