"""Files of what aids measured: by names of columns, with units, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from strapdown.errors import DataError
from strapdown.formats.aid_tables import AID_READERS
from strapdown.navigation.measurements import AIDS
from strapdown.navigation.measurements.measurement import TabulatedMeasurement

ROWS = np.column_stack([np.arange(5.0), np.full(5, 36.0), np.full(5, 0.36)])


def written(tmp_path, header, rows=ROWS):
    path = tmp_path / "log.csv"
    lines = [header, *(",".join(f"{x:.9g}" for x in row) for row in rows)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def test_every_kind_with_a_table_has_a_reader():
    assert set(AID_READERS) == {
        name for name, aid in AIDS.items() if issubclass(aid, TabulatedMeasurement)
    }


@pytest.mark.parametrize(
    ("kind", "header", "expected"),
    [
        ("odometer", "time,speed,speed_sd", (36.0, 0.36)),
        ("odometer", "time [s],speed [km/h],speed_sd [km/h]", (10.0, 0.1)),
        ("odometer", "time,speed_km_per_h,speed_sd_km_per_h", (10.0, 0.1)),
        ("barometer", "time,height_m,height_sd_m", (36.0, 0.36)),
        ("heading", "time,heading_deg,heading_sd_deg", (36.0, 0.36)),
    ],
)
def test_columns_are_read_by_name_and_unit(tmp_path, kind, header, expected):
    table = AID_READERS[kind](written(tmp_path, header))
    np.testing.assert_allclose(table.to_numpy(), [expected] * 5, rtol=1e-12)
    assert table.attrs["source"] == "log.csv"


def test_velocities_along_three_axes(tmp_path):
    rows = np.column_stack([np.arange(5.0), np.ones((5, 3)), np.full((5, 3), 0.1)])
    table = AID_READERS["body_velocity"](written(tmp_path, "time,vx,vy,vz,vx_sd,vy_sd,vz_sd", rows))
    np.testing.assert_array_equal(table.to_numpy(), rows[:, 1:])


def test_pressures_become_heights(tmp_path):
    rows = np.column_stack([np.arange(5.0), np.full(5, 1013.25), np.full(5, 0.12)])
    path = written(tmp_path, "time,pressure [hPa],pressure_sd [hPa]", rows)
    table = AID_READERS["barometer"](path)
    np.testing.assert_allclose(table["height"], 0.0, atol=1e-6)
    np.testing.assert_allclose(table["height_sd"], 1.0, atol=0.01)


def test_a_row_is_that_of_the_file(tmp_path):
    """The header is the first."""
    rows = ROWS.copy()
    rows[3, 2] = -1.0
    with pytest.raises(DataError) as error:
        AID_READERS["odometer"](written(tmp_path, "time,speed,speed_sd", rows))
    found = error.value.finding
    assert (found.file, found.row, found.quantity) == ("log.csv", 5, "speed_sd")
    assert found.remedy


def test_a_column_that_is_missing_is_named(tmp_path):
    with pytest.raises(DataError, match="speed_sd"):
        AID_READERS["odometer"](written(tmp_path, "time,speed,quality"))
