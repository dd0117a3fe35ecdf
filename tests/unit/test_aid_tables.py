"""Tables of aids: what is refused names the row, the quantity and the remedy."""

from __future__ import annotations

import math

import numpy as np
import pytest
from tests.coded import coded

from strapdown.errors import DataError
from strapdown.tables import (
    barometer_from_pressure,
    barometer_table,
    body_velocity_table,
    check_odometer,
    heading_table,
    odometer_table,
)
from strapdown.tables.aiding import standard_height, standard_slope

TIME = np.arange(6.0)
GOOD = {
    odometer_table: (np.full(6, 12.0), np.full(6, 0.1)),
    barometer_table: (np.full(6, 300.0), np.full(6, 0.5)),
    heading_table: (np.full(6, 90.0), np.full(6, 1.0)),
    body_velocity_table: (np.full((6, 3), 2.0), np.full((6, 3), 0.1)),
}
MAKERS = list(GOOD)


def refused(make, *given):
    with pytest.raises(DataError) as error:
        make(*given, source="log.csv")
    found = error.value.finding
    assert found.file == "log.csv"
    assert found.remedy
    return found


@pytest.mark.parametrize("make", MAKERS)
def test_what_is_good_is_taken(make):
    table = make(TIME, *GOOD[make], source="log.csv")
    assert table.attrs["source"] == "log.csv"
    np.testing.assert_array_equal(table.index, TIME)


@pytest.mark.parametrize("make", MAKERS)
def test_one_standard_deviation_stands_for_all(make):
    value, sd = GOOD[make]
    table = make(TIME, value, sd[0])
    assert (table.iloc[:, -1] == table.iloc[0, -1]).all()


@pytest.mark.parametrize("make", MAKERS)
def test_an_unmeasured_row_is_infinitely_uncertain(make):
    value, sd = (x.copy() for x in GOOD[make])
    sd[2] = math.inf
    make(TIME, value, sd)


@pytest.mark.parametrize("make", MAKERS)
@pytest.mark.parametrize("bad", [0.0, -0.5, math.nan])
def test_a_standard_deviation_is_above_zero(make, bad):
    value, sd = (x.copy() for x in GOOD[make])
    sd[3] = bad
    found = refused(make, TIME, value, sd)
    assert found.row == 4
    assert found.quantity.endswith("_sd")


@pytest.mark.parametrize("make", MAKERS)
def test_a_value_that_is_none_is_named(make):
    value, sd = (x.copy() for x in GOOD[make])
    value[1] = math.nan
    assert refused(make, TIME, value, sd).row == 2


@pytest.mark.parametrize("make", MAKERS)
def test_time_advances(make):
    time = TIME.copy()
    time[4] = time[3]
    found = refused(make, time, *GOOD[make])
    assert (found.row, found.quantity) == (5, "time")


@pytest.mark.parametrize("make", MAKERS)
def test_as_many_rows_of_each(make):
    value, sd = GOOD[make]
    assert "lengths" in refused(make, TIME, value[:-1], sd).what


def test_a_column_that_is_missing_is_named():
    table = odometer_table(TIME, *GOOD[odometer_table]).drop(columns="speed_sd")
    with pytest.raises(DataError, check=coded("tables.missing-columns")):
        check_odometer(table)


# --- units ------------------------------------------------------------------------------


def test_a_speed_in_km_per_hour_is_told():
    found = refused(odometer_table, TIME, [0.0, 50.0, 90.0, 120.0, 130.0, 110.0], 0.1)
    assert (found.row, found.quantity) == (4, "speed")
    assert "km/h" in found.remedy
    assert "km/h" not in refused(odometer_table, TIME, [0, 0, 0, 0, 0, 5000.0], 0.1).remedy


def test_a_pressure_in_hectopascals_is_told():
    for factor, unit in ((100.0, "hPa"), (1000.0, "kPa")):
        pressure = np.full(6, 101_325.0) / factor
        found = refused(barometer_from_pressure, TIME, pressure, 1.0)
        assert (found.row, found.quantity) == (1, "pressure_pa")
        assert unit in found.remedy
    found = refused(barometer_from_pressure, TIME, [1e5, 1e5, 0.0, 1e5, 1e5, 1e5], 1.0)
    assert found.row == 3


def test_pressures_that_were_given_as_heights_are_told():
    found = refused(barometer_table, TIME, np.full(6, 101_325.0), 1.0)
    assert "barometer_from_pressure" in found.remedy


def test_a_heading_in_radians_is_told_where_it_leaps():
    heading = np.array([5.9, 6.1, 6.27, 0.02, 0.3, 3.0])
    found = refused(heading_table, TIME, heading, 1.0)
    assert (found.row, found.quantity) == (4, "heading")
    assert "57.29578" in found.remedy
    # A road to the north has such headings in degrees, and they do not leap.
    heading_table(TIME, [0.1, 2.0, 6.2, 3.0, 0.3, 0.0], 1.0)
    heading_table(TIME, [359.0, 1.0, 6.2, 358.0, 0.3, 0.0], 1.0)


def test_a_heading_is_within_a_turn_and_worth_something():
    assert refused(heading_table, TIME, [0, 0, 9000.0, 0, 0, 0], 1.0).row == 3
    found = refused(heading_table, TIME, np.zeros(6), np.array([1, 1, 1, 1, 200.0, 1]))
    assert (found.row, found.quantity) == (5, "heading_sd")


def test_a_velocity_in_millimetres_is_told():
    velocity = np.full((6, 3), 2.0)
    velocity[2, 1] = 1500.0
    found = refused(body_velocity_table, TIME, velocity, [0.1, 0.1, 0.1])
    assert (found.row, found.quantity) == (3, "vy")
    assert "mm/s" in found.remedy


# --- what is made of something else -------------------------------------------------------


def test_the_standard_atmosphere():
    """Of the tables of ISO 2533 and of the US Standard Atmosphere (1976), geometric height.

    They give five figures of the pressure: half of the last is 0.5 m at 5 km, 2 m at 10 km.
    """
    for height, pressure in (
        (0.0, 101325.0),
        (1000.0, 89876.0),
        (5000.0, 54048.0),
        (10000.0, 26500.0),
    ):
        assert standard_height([pressure])[0] == pytest.approx(height, abs=2.0)


def test_the_slope_is_the_derivative_of_the_height():
    p = np.array([101_325.0, 60_000.0, 25_000.0])
    small = 10.0
    slope = (standard_height(p + small) - standard_height(p - small)) / (2.0 * small)
    # The third derivative over the first is about 1/p²: 2e-7 / 6 at the last.
    np.testing.assert_allclose(standard_slope(p), slope, rtol=1e-6)
    # 8.3 m a hPa, by the sea.
    assert standard_slope([101_325.0])[0] == pytest.approx(-0.0832, abs=1e-4)
    table = barometer_from_pressure(TIME, np.full(6, 101_325.0), 12.0)
    assert table["height_sd"].iloc[0] == pytest.approx(1.0, abs=0.01)
