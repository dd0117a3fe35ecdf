"""What the simplifications of Tadic and Vukajlovic (2016) cost: formulas against runs.

The formulas leave out what an error does to itself. Over a time t that is, of the error itself,
up to ``2 w_e t``, by which its velocity and its tilt turn relative to where they were made, and
``(w_s t)²/4``, by which gravity answers to a place that is wrong (Schuler; twice as strong
upward, and of t²/2 it is a twelfth). The runs have in addition the error of a scheme of first
order, which the run with every term has alone: by the triangle's inequality no difference of two
largest errors is larger than that.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from papers.tadic.simplifications import (
    ERRORS,
    SIMPLIFICATIONS,
    TRIPS,
    Trip,
    error_course,
    mechanization_errors,
    predicted_errors,
    sensor_errors,
    straight,
)
from strapdown import earth, rotation
from strapdown.errors import ConfigError
from strapdown.mechanization import NorthEastDown, Tadic

RATE = 7.292115e-5  # of the Earth, rad/s
SCHULER = math.sqrt(9.80 / 6.37e6)  # rad/s


@pytest.fixture(scope="module")
def measured():
    return {name: mechanization_errors(trip) for name, trip in TRIPS.items()}


def feedback(seconds):
    return 2.0 * RATE * seconds + (SCHULER * seconds) ** 2 / 4.0


@pytest.mark.parametrize("simplification", list(SIMPLIFICATIONS)[1:])
@pytest.mark.parametrize("name", ["crash", "10 s", "60 s", "drive"])
def test_a_formula_predicts_what_a_simplification_costs(measured, name, simplification):
    trip = TRIPS[name]
    predicted = predicted_errors(trip, simplification)
    found = measured[name].loc[simplification]
    floor = measured[name].loc["every term"]
    for error in ERRORS:
        allowed = feedback(trip.motion.duration) * predicted[error] + 1.01 * floor[error]
        if predicted[error] > 0.0 or error != "attitude_deg":
            assert abs(found[error] - predicted[error]) <= allowed, error
        else:
            # No rate is left out: the attitude errs by what its own velocity error turns the level.
            turned = math.degrees(found["position_m"] / 6.35e6)
            assert found[error] <= 1.1 * turned + 1.01 * floor[error]


@pytest.mark.parametrize(
    ("simplification", "by_hand"),
    [
        # 2 w v sin(lat) t²/2 and what is felt of it upward, 2 w v_E cos(lat) t²/2.
        ("no Coriolis term", RATE * math.hypot(20 * math.sin(math.pi / 4), 10) * 60**2),
        # w cos(lat) g t³/6: tilt by the Earth's rate.
        ("no transport rate", 9.806 * 20 / 6.378e6 * 60**3 / 6),
        ("gravity 9.80665", (9.80665 - earth.gravity(45.0, 100.0)[2]) * 60**2 / 2),
    ],
)
def test_the_formulas_are_those_of_the_page(simplification, by_hand):
    # 3 %: the transport rate's part of the Coriolis term, 3.1e-6 of 1.5e-4 rad/s, in both of its
    # components; and the Earth's radius.
    predicted = predicted_errors(TRIPS["60 s"], simplification)["position_m"]
    assert predicted == pytest.approx(by_hand, rel=0.03)


def test_every_term_leaves_nothing(measured):
    # 1 um but for sampling: corners at 100 Hz, and on the flight ten times a second over 1 h.
    for name, allowed in (("crash", 1e-6), ("10 s", 1e-7), ("60 s", 1e-7), ("drive", 1e-6)):
        assert measured[name].loc["NorthEastDown", "position_m"] < allowed
    assert measured["flight"].loc["NorthEastDown", "position_m"] < 1e-5


def test_in_a_crash_all_simplifications_together_are_hundreds_of_times_below_the_sensors(measured):
    crash = measured["crash"]["position_m"]
    sensors = sensor_errors(TRIPS["crash"], "mpu-6050", range(3))["position_m"]
    assert 0.03 < sensors.median() < 1.0  # decimetres, as the paper has
    assert crash.max() < 0.003 * sensors.min()
    assert crash["no Coriolis term"] < 100e-6
    # They are below a navigation-grade unit, too.
    assert crash.max() < sensor_errors(TRIPS["crash"], "hg9900", range(3))["position_m"].median()


def test_in_a_minute_they_are_above_a_good_sensor_and_below_a_cheap_one(measured):
    minute = measured["60 s"].loc["all: flat Earth", "position_m"]
    for sensor, cheap in (("mpu-6050", True), ("hg1700", True), ("hg9900", False)):
        of_sensor = sensor_errors(TRIPS["60 s"], sensor, range(3))["position_m"].median()
        assert (minute < of_sensor) == cheap, sensor


def test_gravity_holds_an_error_only_if_the_level_follows_the_place(measured):
    flight, predicted = measured["flight"]["position_m"], {}
    for name in ("no Coriolis term", "no transport rate"):
        predicted[name] = predicted_errors(TRIPS["flight"], name)["position_m"]
    # With transport rate Schuler's loop turns t²/2 into (1 - cos w t)/w²: 0.126 at 1 h; that the
    # error turns with the Earth and the level meanwhile (0.4 rad) may double it.
    assert flight["no Coriolis term"] < 0.252 * predicted["no Coriolis term"]
    # Without, nothing answers but the Coriolis term: 2 w t = 0.5 rad of turning the velocity, of
    # which the length has the second order in thirds of it.
    assert flight["no transport rate"] == pytest.approx(predicted["no transport rate"], rel=0.04)


def printed_sign(seconds, rate):
    motion = straight(seconds, 230.0, lat_deg=60.0, alt=1e4, east=True)
    trip = Trip("", motion, rate, "held")
    used = replace(SIMPLIFICATIONS["every term"], as_printed=True)
    transverse = earth.radii_of_curvature(60.0)[1] + 1e4
    turned = math.degrees(2.0 * 230.0 * math.tan(math.radians(60.0)) / transverse * seconds)
    return error_course(trip, used).max(), turned


def test_the_printed_sign_of_8_turns_the_heading():
    errors, turned = printed_sign(60.0, 100.0)
    assert errors["attitude_deg"] == pytest.approx(turned, rel=feedback(60.0))
    hour, turned = printed_sign(3600.0, 10.0)
    # By then the place is wrong by 344 km, 3.1 deg of latitude, and so is its tangent.
    assert hour["position_m"] < 350e3
    assert hour["attitude_deg"] == pytest.approx(turned, rel=0.14)
    assert turned == pytest.approx(25.66, abs=0.01)


def test_matrix_19_as_printed_is_no_rotation():
    roll, pitch = rotation.quaternion_from_euler([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    up = [0.0, 0.0, -9.8]
    for q, error in ((roll, [0.0, -2 * 9.8 * np.sin(np.radians(1.0)), 0.0]), (pitch, [0, 0, 0])):
        wrong = as_printed(q)
        assert np.abs(wrong @ wrong.T - np.eye(3)).max() > 0.02
        np.testing.assert_allclose(wrong @ up - rotation.rotate(q, up), error, atol=1e-14)
    level = rotation.quaternion_from_euler([0.0, 0.0, 60.0])
    np.testing.assert_allclose(as_printed(level), rotation.dcm_from_quaternion(level), atol=1e-15)


def as_printed(q):
    w, x, y, z = q
    matrix = rotation.dcm_from_quaternion(q)
    matrix[1, 2], matrix[2, 0] = 2.0 * (y * z + w * x), 2.0 * (x * z + w * y)
    return matrix


def test_a_flat_earth_has_every_switch_off_and_the_paper_keeps_the_rates():
    flat = SIMPLIFICATIONS["all: flat Earth"]
    assert not (flat.coriolis or flat.earth_rate or flat.transport_rate)
    assert flat.gravity == 9.80665
    assert Tadic().gravity is None
    assert not Tadic().as_printed


@pytest.mark.parametrize("gravity", [-9.8, 0.0, 980.6, math.nan])
def test_a_gravity_that_is_none_is_refused(gravity):
    with pytest.raises(ConfigError, match="gravity") as refused:
        Tadic(gravity=gravity)
    assert "near 9.8" in str(refused.value)


def test_the_same_every_time():
    trip = TRIPS["10 s"]
    once, again = (error_course(trip, NorthEastDown()) for _ in range(2))
    assert once.equals(again)
