"""Readings of other aids, by the names of their columns."""

from __future__ import annotations

import numpy as np
import pytest

from strapdown.errors import ConfigError, DataError
from strapdown.formats.aid_table import read_aid_table

SPEED = {"speed": "m/s", "speed_sd": "m/s"}


def written(folder, text, name="odometer.csv"):
    (folder / name).write_text(text)
    return folder / name


@pytest.mark.parametrize(
    ("head", "columns", "row", "values"),
    [
        ("time,speed,speed_sd", SPEED, "1.5,10,0.2", [10.0, 0.2]),
        (
            "time_ms,Speed [km/h],sd_speed_km_h",
            SPEED,
            "1500,36,0.36",
            [36 * (1 / 3.6), 0.36 * (1 / 3.6)],
        ),
        ("t,wheel_speed_kn,speed_sigma", SPEED, "1.5,10,0.2", [10 * (1852 / 3600), 0.2]),
        ("time,Pressure (hPa)", {"pressure": "Pa"}, "1.5,1013.25", [101325.0]),
        ("time,baro_altitude_ft", {"height": "m"}, "1.5,1000", [1000 * 0.3048]),
        ("time,yaw_rad", {"heading": "deg"}, "1.5,0.5", [0.5 * (180 / np.pi)]),
        ("time;heading", {"heading": "deg"}, "1,5;90,25", [90.25]),
        ("time,pulses", {"pulses": ""}, "1.5,17", [17.0]),
    ],
)
def test_names_and_units(tmp_path, head, columns, row, values):
    table = read_aid_table(written(tmp_path, f"{head}\n{row}\n"), columns)
    assert list(table.columns) == list(columns)
    assert table.index.tolist() == [1.5]
    assert table.iloc[0].tolist() == values


def test_parquet_optional_columns_and_other_names(tmp_path):
    path = written(tmp_path, "time,a\n0,1\n1,2\n")
    table = read_aid_table(path, SPEED, optional=["speed_sd"], names={"speed": "2"})
    assert table["speed"].tolist() == [1.0, 2.0]
    table.attrs = {}
    table.reset_index().to_parquet(tmp_path / "a.parquet")
    again = read_aid_table(tmp_path / "a.parquet", {"speed": "m/s"})
    assert again["speed"].tolist() == [1.0, 2.0]
    assert any("the unit is not stated; m/s is assumed" in f.what for f in again.attrs["findings"])


def test_repair(tmp_path):
    path = written(tmp_path, "time,speed\n0,1\n1,nan\n2,3\n1,4\n3,5\n")
    table = read_aid_table(path, {"speed": "m/s"}, repair=True)
    assert table.index.tolist() == [0.0, 2.0, 3.0]
    assert table["speed"].tolist() == [1.0, 3.0, 5.0]
    rows = [f.row for f in table.attrs["findings"] if "left out" in f.what]
    assert rows == [3, 5]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("time,speed\n0,1\n1,x\n", "row 3, speed: 'x' is not a number"),
        ("time,speed\n0,1\n1,\n", "row 3, speed: not a number"),
        ("time,speed\n1,1\n1,1\n", "row 3, time: not later than every previous row"),
        ("time,speed\n2,1\n1,1\n", "row 3, time: not later than every previous row"),
        ("time,speed,speed_sd\n1,1,0\n", "row 2, speed_sd: a standard deviation is not positive"),
        ("time,speed_m\n0,1\n", "speed: 'm' is not a unit of this quantity (column 'speed_m')"),
        ("time,pace\n0,1\n", "missing columns: speed; the file has time, pace"),
        ("speed\n1\n", "missing columns: time"),
        ("time,speed,v\n0,1,1\n", "speed: the quantity matches columns 'speed' and 'v'"),
        ("time,speed\n0,1,2\n", "row 2: 3 fields, where the first line has 2"),
        ("time,speed\n", "row 1: the file has a header and no data"),
        ("", "the file is empty"),
    ],
)
def test_refused(tmp_path, text, message):
    with pytest.raises(DataError) as error:
        read_aid_table(written(tmp_path, text), SPEED, optional=["speed_sd"])
    assert message in str(error.value) and "odometer.csv" in str(error.value)
    assert error.value.finding.remedy


def test_no_table(tmp_path):
    with pytest.raises(
        ConfigError, check=lambda refused: refused.finding.code == "io.no-such-file"
    ):
        read_aid_table(tmp_path / "a.csv", SPEED)
    with pytest.raises(DataError, check=lambda refused: refused.finding.code == "io.folder"):
        read_aid_table(tmp_path, SPEED)
    with pytest.raises(
        DataError, check=lambda refused: refused.finding.code == "io.aid-file-ending"
    ):
        read_aid_table(written(tmp_path, "x", "a.docx"), SPEED)
    with pytest.raises(ConfigError, check=lambda refused: refused.finding.code == "io.no-column-3"):
        read_aid_table(written(tmp_path, "time,a\n0,1\n"), SPEED, names={"speed": "w"})
