"""One matcher reads the names of every kind of file: each knows the clocks and units of all."""

from __future__ import annotations

import numpy as np
import pytest
from tests.coded import coded

from strapdown.errors import DataError
from strapdown.formats.columns import read_name
from strapdown.formats.crash_table import channel_name
from strapdown.formats.find_columns import find_quantities
from strapdown.formats.vocabularies import CRASHES, FIXES, LOGS, TRAJECTORIES

TABLES = (FIXES, TRAJECTORIES)


@pytest.mark.parametrize("of", [LOGS, FIXES, TRAJECTORIES, CRASHES], ids=lambda of: of.of)
@pytest.mark.parametrize(
    ("name", "unit"),
    [
        ("Zeit in ms", "ms"),
        ("TimeUS", "us"),
        ("seconds_elapsed", "s"),
        ("gps_seconds_of_week", None),
        ("time since start (s)", "s"),
        ("Timestamp (UTC)", None),
        ("millis", "ms"),
    ],
)
def test_a_clock_is_a_clock_in_every_file(of, name, unit):
    said = read_name(name, of)
    assert said.quantity == "time"
    assert unit is None or said.unit == unit


@pytest.mark.parametrize("of", TABLES, ids=lambda of: of.of)
@pytest.mark.parametrize(
    ("name", "quantity", "factor"),
    [
        ("latDeg", "lat", 1.0),
        ("lonRad", "lon", np.degrees(1.0)),
        ("Altitude, ft", "alt", 0.3048),
        ("velNorth [km/h]", "VN", 1 / 3.6),
        ("vel_up_m_s", "VD", -1.0),
    ],
)
def test_names_of_positions(of, name, quantity, factor):
    found = find_quantities([name], of, {}, "file")
    assert list(found) == [quantity]
    assert found[quantity].factor == pytest.approx(factor, rel=1e-15)


def test_a_name_that_is_known_precedes_the_words_of_another():
    names = ["time", "gnss_time", "speedMps", "gps_speed", "latDeg", "lat"]
    found = find_quantities(names, FIXES, {}, "file")
    assert {q: f.source for q, f in found.items()} == {
        "time": "time",
        "speed": "gps_speed",
        "lat": "lat",
    }


def test_two_names_of_words_alone_leave_a_quantity_open():
    assert "alt" not in find_quantities(["altM", "altFt"], FIXES, {}, "file")
    with pytest.raises(DataError, check=coded("io.column-names-ambiguous", quantity="alt")):
        find_quantities(["gps_alt", "gnss_alt"], FIXES, {}, "file")


@pytest.mark.parametrize("name", ["lat bias deg", "altAccuracyNoise", "speedErrorMps", "accel"])
def test_the_spread_of_a_quantity_is_not_the_quantity(name):
    assert not {"lat", "alt", "speed"} & find_quantities([name], FIXES, {}, "file").keys()


@pytest.mark.parametrize(
    ("name", "quantity", "axis", "unit"),
    [
        ("Beschl. HD X", "acceleration", "x", ""),
        ("Drehrate Z", "rate", "z", ""),
        ("Angular speed X [deg/s]", "rate", "x", "deg/s"),
        ("delta_v_km_h", "velocity", "", "km/h"),
        ("accuracy", "other", "", ""),
        ("gyro temp", "other", "", ""),
        ("roll angle", "other", "", ""),
        ("left door", "other", "", ""),
        ("Nr", "other", "", ""),
        ("gx", "other", "", ""),
    ],
)
def test_headings_of_crash_records(name, quantity, axis, unit):
    said = channel_name(name)
    assert (said.quantity, said.axis, said.unit) == (quantity, axis, unit)


def test_a_unit_in_the_name_precedes_that_of_a_row_but_in_a_crash_record():
    assert read_name("alt [ft]", FIXES, "m").unit == "ft"
    said = read_name("Delta-V, longitudinal (MPH)", CRASHES, "km/h")
    assert (said.quantity, said.unit) == ("velocity", "km/h")
    said = channel_name("acc x", "deg/s")
    assert (said.quantity, said.axis, said.unit) == ("rate", "x", "deg/s")
    assert said.contradiction
