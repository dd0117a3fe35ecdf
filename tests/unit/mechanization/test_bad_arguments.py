"""What navigation cannot use is refused in words, before anything is computed from it."""

import math

import numpy as np
import pytest
from tests.coded import coded

from strapdown.ellipsoids import WGS84
from strapdown.errors import ConfigError, DataError, DivergenceError
from strapdown.increments import motion_increments
from strapdown.mechanization import NavTracker, NorthEastDown, Tadic, run_mechanization
from strapdown.nav_state import NavState
from strapdown.tables import imu_table

HOME = NavState.from_degrees(55.0, 37.0, 150.0)
LEVEL = np.array([0.0, 0.0, -9.8153])


def log(count=50):
    time = np.arange(count) * 0.01
    return imu_table(time, np.zeros((count, 3)), np.tile(LEVEL, (count, 1)), source="drive.csv")


@pytest.mark.parametrize(
    "options",
    [
        {"ellipsoid": None},
        {"ellipsoid": WGS84},
        {"height": None},
        {"height_time_constant": "50"},
        {"latitude_limit_deg": None},
        {"largest_speed": "fast"},
        {"height_limits": None},
        {"height_limits": (1.0,)},
        {"height_limits": (0.0, 1.0, 2.0)},
        {"height_limits": ("a", "b")},
    ],
)
def test_options_of_a_wrong_kind_are_refused(options):
    with pytest.raises(ConfigError) as caught:
        NorthEastDown(**options)
    assert caught.value.finding.quantity == next(iter(options))
    assert caught.value.finding.remedy


def test_an_ellipsoid_in_place_of_its_name_is_told_its_name():
    with pytest.raises(ConfigError, match="did you mean 'wgs84'"):
        NorthEastDown(ellipsoid=WGS84)


@pytest.mark.parametrize("longest", [math.nan, 0.0, -1.0, "1", None])
def test_a_longest_step_that_is_no_time_is_refused(longest):
    increments = motion_increments(log())
    with pytest.raises(
        ConfigError, check=coded("mechanization.longest-step-none", quantity="longest_step")
    ):
        run_mechanization(NorthEastDown(), HOME, increments, longest_step=longest)
    with pytest.raises(
        ConfigError, check=coded("mechanization.longest-step-none", quantity="longest_step")
    ):
        NavTracker(HOME, longest_step=longest)


def test_a_step_that_was_lost_is_named():
    increments = motion_increments(log())
    holed = increments.drop(index=increments.index[20])
    with pytest.raises(
        DataError, check=coded("mechanization.no-increment-body-did-then", ends=0.2, ends_2=0.21)
    ) as caught:
        run_mechanization(NorthEastDown(), HOME, holed)
    assert caught.value.finding.file == "drive.csv"
    assert caught.value.finding.row == 21


def test_stamps_that_were_rounded_leave_no_hole():
    increments = motion_increments(log())
    rounded = increments.set_axis(np.round(increments.index + 0.0004 * (-1.0) ** np.arange(49), 3))
    rounded["dt"] = 0.0099
    run_mechanization(NorthEastDown(), HOME, rounded)


@pytest.mark.parametrize("heights", [["a"] * 49, [[1.0], [2.0, 3.0]]])
def test_heights_that_are_no_numbers_are_refused(heights):
    with pytest.raises(DataError, match="heights"):
        run_mechanization(
            NorthEastDown(height="damped"), HOME, motion_increments(log()), heights=heights
        )


@pytest.mark.parametrize(
    "start",
    [
        NavState.from_degrees(55.0, 37.0, 2e6),
        NavState.from_degrees(55.0, 37.0, 0.0, v_n=(1e5, 0.0, 0.0)),
    ],
)
def test_a_start_outside_of_the_limits_is_not_blamed_on_a_sample(start):
    with pytest.raises(
        DivergenceError, check=coded("mechanization.state-begin-high-outside-or", quantity="state")
    ) as caught:
        run_mechanization(NorthEastDown(), start, motion_increments(log()))
    assert "sample" not in str(caught.value)


@pytest.mark.parametrize(
    ("parts", "quantity"),
    [
        ({"lat": "x"}, "lat"),
        ({"alt": None}, "alt"),
        ({"v_n": "abc"}, "v_n"),
        ({"v_n": [[1.0], 2.0, 3.0]}, "v_n"),
        ({"q_nb": [[1.0, 0.0, 0.0, 0.0]]}, "q_nb"),
        ({"q_nb": "abcd"}, "q_nb"),
    ],
)
def test_a_state_of_what_are_no_numbers_is_refused(parts, quantity):
    whole = {
        "time": 0.0,
        "lat": 0.0,
        "lon": 0.0,
        "alt": 0.0,
        "v_n": [0, 0, 0],
        "q_nb": [1, 0, 0, 0],
    }
    with pytest.raises(DataError) as caught:
        NavState(**whole | parts)
    assert caught.value.finding.quantity == quantity


@pytest.mark.parametrize(
    "given", [{"lat_deg": "x"}, {"lon_deg": None}, {"roll_deg": math.nan}, {"heading_deg": "N"}]
)
def test_angles_of_a_state_are_numbers(given):
    with pytest.raises(DataError) as caught:
        NavState.from_degrees(**{"lat_deg": 1.0, "lon_deg": 2.0} | given)
    assert caught.value.finding.quantity in {*given, next(iter(given)).removesuffix("_deg")}


def test_a_state_is_taken_from_a_row_that_there_is():
    trajectory = HOME.to_trajectory()
    assert NavState.from_trajectory(trajectory, -1).alt == 150.0
    for table, row in ((trajectory, 1), (trajectory, -2), (trajectory.iloc[:0], 0), (log(), 0)):
        with pytest.raises(DataError):
            NavState.from_trajectory(table, row)


def test_a_tracker_says_which_mechanization_it_has():
    with pytest.raises(ConfigError, match="NorthEastDown"):
        NavTracker(HOME, Tadic())


def test_a_tracker_begins_where_its_state_is():
    tracker = NavTracker(NavState.from_degrees(55.0, 37.0, time=3.0))
    with pytest.raises(
        DataError, check=coded("mechanization.state-first-sample", record=3.0, time=50.0)
    ):
        tracker.update(50.0, np.zeros(3), LEVEL)
    tracker.update(3.001, np.zeros(3), LEVEL)


def test_a_tracker_refuses_a_gap_unless_it_is_allowed():
    tracker, patient = NavTracker(HOME), NavTracker(HOME, longest_step=10.0)
    for one in (tracker, patient):
        one.update(0.0, np.zeros(3), LEVEL)
    with pytest.raises(DataError, match=r"a gap of 5 s before 5 s"):
        tracker.update(5.0, np.zeros(3), LEVEL)
    assert tracker.state.time == 0.0
    patient.update(5.0, np.zeros(3), LEVEL)
    assert patient.state.time == 5.0
    with pytest.raises(DataError, check=coded("mechanization.time-does-not-advance-followed")):
        patient.update(-50.0, np.zeros(3), LEVEL)


def test_a_tracker_shows_a_ragged_sample():
    with pytest.raises(DataError, check=coded("mechanization.time-three-finite-rates-three")):
        NavTracker(HOME).update(0.0, [[1.0], [1.0, 2.0], 3.0], LEVEL)
