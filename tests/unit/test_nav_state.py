"""A navigation state: what it takes, what it gives back, and what it says of nonsense."""

from __future__ import annotations

import math

import numpy as np
import pytest
from tests.coded import coded

from strapdown import rotation
from strapdown.errors import DataError
from strapdown.nav_state import NavState

LEVEL = np.array([1.0, 0.0, 0.0, 0.0])


def state(**parts):
    given = {
        "time": 3.0,
        "lat": 0.9,
        "lon": -2.0,
        "alt": 120.0,
        "v_n": [1.0, 2.0, 3.0],
        "q_nb": LEVEL,
    }
    return NavState(**(given | parts))


def row(**parts):
    """Numbers of a kernel, of which more than ten may follow."""
    given = {"lat": 0.9, "lon": -2.0, "alt": 120.0, "v_n": (1.0, 2.0, 3.0), "q_nb": LEVEL}
    return np.hstack([*(given | parts).values(), 0.5, 0.5])


def test_numbers_of_a_kernel_are_what_the_constructor_makes_of_them():
    q_nb = np.array([0.8, -0.3, 0.5, 0.1]) * 1.001
    made, known = NavState.of_numbers(3.0, row(q_nb=q_nb)), state(q_nb=q_nb)
    assert made.numbers.tolist() == known.numbers.tolist()
    assert repr(made) == repr(known)
    assert not (made.v_n.flags.writeable or made.q_nb.flags.writeable)


@pytest.mark.parametrize("turns", [-2, -1, 0, 1, 2])
def test_a_longitude_of_any_turn_is_within_half_a_turn(turns):
    lon = NavState.of_numbers(0.0, row(lon=-2.0 + 2.0 * math.pi * turns)).lon
    assert lon == pytest.approx(-2.0, abs=4e-15)
    assert NavState.of_numbers(0.0, row(lon=-math.pi)).lon == math.pi


@pytest.mark.parametrize(
    "parts",
    [
        {"alt": math.nan},
        {"lat": math.nan},
        {"v_n": (0.0, math.inf, 0.0)},
        {"lat": 1.6},
        {"q_nb": 0.98 * LEVEL},
        {"q_nb": 0.0 * LEVEL},
    ],
)
def test_numbers_of_a_kernel_that_are_no_state(parts):
    with pytest.raises(DataError) as refused:
        state(**parts)
    with pytest.raises(DataError, check=coded(refused.value.finding.code)):
        NavState.of_numbers(3.0, row(**parts))
    with pytest.raises(DataError, check=coded("mechanization.not-finite-number")):
        NavState.of_numbers(math.inf, row())


def test_degrees_and_tables_come_back():
    made = NavState.from_degrees(
        55.5,
        -37.25,
        150.0,
        v_n=[1.0, -2.0, 0.5],
        roll_deg=-5.0,
        pitch_deg=10.0,
        heading_deg=110.0,
        time=12.5,
    )
    assert made.lat == math.radians(55.5)
    assert made.roll_pitch_heading == pytest.approx([-5.0, 10.0, 110.0], abs=1e-13)
    table = made.to_trajectory()
    assert table.index[0] == 12.5
    expected = [55.5, -37.25, 150.0, 1.0, -2.0, 0.5, -5.0, 10.0, 110.0]
    assert table.to_numpy()[0] == pytest.approx(expected, rel=1e-15, abs=1e-13)
    again = NavState.from_trajectory(table)
    assert (again.time, again.alt) == (12.5, 150.0)
    assert rotation.rotation_angle(again.q_nb, made.q_nb) < 1e-13


def test_a_row_of_a_trajectory_by_its_position():
    rows = [NavState.from_degrees(k, 2.0 * k, 3.0, time=float(k)).to_trajectory() for k in (1, 2)]
    import pandas as pd

    table = pd.concat(rows)
    assert NavState.from_trajectory(table).time == 1.0
    assert NavState.from_trajectory(table, -1).lat == pytest.approx(math.radians(2.0))
    with pytest.raises(
        DataError, check=lambda refused: refused.finding.code == "mechanization.no-row-among"
    ):
        NavState.from_trajectory(table, 5)


def test_it_cannot_be_changed():
    velocity, q = np.array([1.0, 2.0, 3.0]), LEVEL.copy()
    made = state(v_n=velocity, q_nb=q)
    velocity[0], q[1] = 9.0, 9.0
    assert np.array_equal(made.v_n, [1.0, 2.0, 3.0])
    assert np.array_equal(made.q_nb, LEVEL)
    with pytest.raises(ValueError, match="read-only"):
        made.v_n[0] = 1.0
    with pytest.raises(ValueError, match="read-only"):
        made.q_nb[0] = 0.5
    with pytest.raises(AttributeError):
        made.lat = 0.0


@pytest.mark.parametrize("name", ["time", "lat", "lon", "alt"])
@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_every_number_is_finite(name, value):
    with pytest.raises(DataError, match=f"^{name}: not a finite number"):
        state(**{name: value})


def test_velocity_is_three_finite_numbers():
    with pytest.raises(
        DataError, check=coded("mechanization.not-finite-number", quantity="v_n east")
    ):
        state(v_n=[0.0, math.nan, 0.0])
    with pytest.raises(
        DataError, match="v_n", check=lambda refused: refused.finding.code == "mechanization.shape"
    ):
        state(v_n=[0.0, 1.0])
    with pytest.raises(
        DataError, match="v_n", check=lambda refused: refused.finding.code == "mechanization.shape"
    ):
        state(v_n=[[0.0, 1.0, 2.0]])


@pytest.mark.parametrize("q", [[0.0, 0.0, 0.0, 0.0], [1.0, math.nan, 0.0, 0.0], [1.0, 0.0, 0.0]])
def test_an_attitude_that_is_none(q):
    with pytest.raises(DataError):
        state(q_nb=q)


@pytest.mark.parametrize(
    ("lat", "lon", "quantity", "remedy"),
    [
        (55.0, 37.0, "lat", "seem to be degrees"),
        (1.0, 37.0, "lon", "seem to be degrees"),
        (2.5, 0.9, "lat", "swapped"),
        (-3.0, -0.5, "lat", "swapped"),
    ],
)
def test_radians_that_are_none(lat, lon, quantity, remedy):
    with pytest.raises(DataError) as caught:
        state(lat=lat, lon=lon)
    assert caught.value.finding.quantity == quantity
    assert remedy in caught.value.finding.remedy


@pytest.mark.parametrize(
    ("lat", "lon", "quantity", "remedy"),
    [
        (91.0, 170.0, "lat_deg", "within -90 to 90"),
        (-123.0, 49.0, "lat_deg", "swapped"),
        (49.0, 361.0, "lon_deg", "within -180 to 360"),
    ],
)
def test_degrees_that_are_none(lat, lon, quantity, remedy):
    with pytest.raises(DataError) as caught:
        NavState.from_degrees(lat, lon)
    assert caught.value.finding.quantity == quantity
    assert remedy in caught.value.finding.remedy


def test_nan_in_degrees_is_named():
    with pytest.raises(
        DataError, check=coded("mechanization.not-finite-number-2", quantity="lat_deg")
    ):
        NavState.from_degrees(math.nan, 0.0)


def test_the_poles_themselves_are_places():
    for lat in (90.0, -90.0):
        assert abs(NavState.from_degrees(lat, 0.0).lat) == 0.5 * math.pi
