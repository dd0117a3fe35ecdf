"""Paths through places: the spline is the truth, and is felt as in inertial axes."""

from __future__ import annotations

import sys
from pathlib import Path

import mpmath
import numpy as np
import pytest
from mpmath import mpf

sys.path.insert(0, str(Path(__file__).parent))

from earth_truth import felt

from strapdown import rotation
from strapdown.errors import ConfigError
from strapdown.simulation import (
    ImuErrors,
    Origin,
    SineVelocityMotion,
    SplineMotion,
    simulate_imu,
    through_waypoints,
)
from strapdown.simulation.spline_motion import quintic

PLACES = [
    (43.5850, 39.7203, 80.0),
    (43.5861, 39.7215, 95.0),
    (43.5868, 39.7242, 110.0),
    (43.5860, 39.7271, 110.0),
    (43.5843, 39.7280, 100.0),
]


def mp_spline(spline, instant):
    """The piece of a spline that holds an instant, as functions of the time since it."""
    k = min(int(np.searchsorted(spline.knots, instant, side="right")) - 1, len(spline.knots) - 2)
    since = mpf(instant) - mpf(spline.knots[k])
    rows = [[mpf(c) for c in column] for column in spline.coefficients[k].T]
    return lambda t: [mpmath.polyval(row[::-1], since + t, asc=True) for row in rows]


def about(motion, instant):
    """Place of a spline motion in rad and m, in many digits."""
    moved = mp_spline(motion._course, instant)
    lat, lon, alt = motion.place[0]
    start = [mpmath.radians(mpf(lat)), mpmath.radians(mpf(lon)), mpf(alt)]
    return lambda t: [a + b for a, b in zip(start, moved(t), strict=True)]


def mp_along(motion, place):
    """Angles along the velocity of a place."""
    e2 = mpf(motion.ellipsoid.eccentricity_squared)
    a = mpf(motion.ellipsoid.semi_major_axis)

    def angles(t):
        lat, _, alt = place(t)
        d_lat, d_lon, d_alt = (mpmath.diff(lambda x, k=k: place(x)[k], t) for k in range(3))
        w2 = 1 - e2 * mpmath.sin(lat) ** 2
        n = a / mpmath.sqrt(w2)
        north = (n * (1 - e2) / w2 + alt) * d_lat
        east = (n + alt) * mpmath.cos(lat) * d_lon
        return [mpf(0), mpmath.atan2(d_alt, mpmath.hypot(north, east)), mpmath.atan2(east, north)]

    return angles


@pytest.mark.parametrize("instant", [0.0, 7.3, 20.0, 41.0])
def test_a_path_through_places_is_felt_as_in_inertial_axes(instant):
    motion = through_waypoints(PLACES, speeds=[12.0] * 4)
    with mpmath.workdps(40):
        place = about(motion, instant)
        rate, force = felt(motion.ellipsoid, place, mp_along(motion, place))
    # Rates of latitude are 1e-6 rad/s with 1e-16 of that, times the Earth's radius, in each of a
    # dozen terms; angles' rates are quotients of those.
    assert np.abs(motion.specific_force([instant])[0] - force).max() < 3e-14
    assert np.abs(motion.rate([instant])[0] - rate).max() < 1e-15


def test_the_path_meets_its_places_at_its_times():
    times = [0.0, 10.0, 25.0, 40.0, 58.0]
    motion = through_waypoints(PLACES, times=times)
    assert motion.duration == 58.0
    found = motion.trajectory(times)[["lat", "lon", "alt"]].to_numpy()
    # A place in deg is rounded to 7e-15 deg, which is 1e-9 m.
    assert np.abs(found - PLACES).max(axis=0) == pytest.approx([0.0, 0.0, 0.0], abs=2e-14)


def test_a_speed_makes_the_times():
    # One minute of arc of the meridian at 45 deg is 1852.2 m: its radius is 6367.4 km.
    motion = through_waypoints([(45.0, 9.0, 0.0), (45.0 + 1.0 / 60.0, 9.0, 0.0)], speeds=[10.0])
    assert motion.duration == pytest.approx(185.22, abs=0.01)
    speed = np.linalg.norm(motion.kinematics(np.array([90.0])).velocity)
    assert speed == pytest.approx(10.0, rel=1e-5)


def test_a_path_over_the_date_line_goes_the_short_way():
    places = [(10.0, 179.99, 0.0), (10.001, -179.999, 0.0), (10.002, -179.99, 0.0)]
    motion = through_waypoints(places, speeds=[20.0, 20.0])
    assert motion.trajectory([motion.duration]).iloc[0]["lon"] == pytest.approx(180.01, abs=1e-12)
    assert motion.duration < 200.0


def test_the_spline_has_four_continuous_derivatives():
    rng = np.random.default_rng(1)
    t = np.cumsum(rng.uniform(0.5, 2.0, 12)) - 0.5
    spline = quintic(t, rng.normal(size=(12, 3)))
    for k in range(1, len(spline.knots) - 1):
        h = spline.knots[k] - spline.knots[k - 1]
        for order in range(5):
            left = [
                np.polyval(np.polyder(spline.coefficients[k - 1, :, j], order), h) for j in range(3)
            ]
            right = [
                np.polyval(np.polyder(spline.coefficients[k, :, j], order), 0.0) for j in range(3)
            ]
            # Values of one over steps of 0.5 s to the fourth power, in which the largest
            # coefficients of 500 are rounded.
            np.testing.assert_allclose(left, right, rtol=0.0, atol=1e-10)


def test_a_recorded_trajectory_is_followed():
    sine = SineVelocityMotion(60.0, Origin(55.0, 37.0, 150.0), (5.0, 10.0, -1.0), (3.0, 4.0, 0.5))
    motion = SplineMotion.from_trajectory(sine.trajectory(np.arange(0.0, 60.01, 0.25)))
    t = np.arange(6.0, 54.0, 0.37)
    # Away from the ends, whose third derivative the spline sets to zero: h^4 of the sixth
    # derivative for what is felt, 4e-3 s^4 of 5e-5 m/s^6, and 1e-9 m of the places by h².
    assert np.abs(motion.specific_force(t) - sine.specific_force(t)).max() < 1e-6
    assert np.abs(motion.rate(t) - sine.rate(t)).max() < 1e-7
    assert rotation.rotation_angle(motion.attitude(t), sine.attitude(t)).max() < 1e-7
    with mpmath.workdps(40):
        place, turned = about(motion, 33.3), mp_spline(motion._turn, 33.3)
        rate, force = felt(
            motion.ellipsoid, place, lambda x: [mpmath.radians(a) for a in turned(x)]
        )
    assert np.abs(motion.specific_force([33.3])[0] - force).max() < 5e-14
    assert np.abs(motion.rate([33.3])[0] - rate).max() < 1e-15


def test_a_path_is_sampled():
    motion = through_waypoints(PLACES, speeds=[12.0] * 4)
    imu, truth = simulate_imu(motion, ImuErrors(), rate=50.0, sampling="mean")
    assert len(imu) == len(truth) == int(motion.duration * 50.0) + 1


def euler(pitch):
    return np.column_stack([np.zeros(3), pitch, np.zeros(3)])


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"time": [0.0, 5.0, 5.0]}, "place 3, time: 5 s is not after 5 s"),
        ({"time": [1.0, 5.0, 6.0]}, "place 1, time: the first time is 1 s"),
        ({"time": [0.0, 5.0]}, "times have the shape"),
        ({"time": [0.0, np.nan, 6.0]}, "not finite"),
        ({"place": [(1, 2, 0), (91, 2, 0), (1, 4, 0)]}, "place 2, lat_deg: a latitude of 91"),
        ({"place": [(88.5, 0, 0), (88.9, 0, 0), (89.3, 0, 0)]}, "reaches a latitude of 89.3"),
        ({"place": [(1, 2, 0), (1.01, 2, 0), (1, 2, 0)]}, "stops or reverses at"),
        ({"place": [(1, 2, 0), (1.0001, 2, 9e3), (1.0002, 2, 2e4)]}, "the pitch reaches 8"),
        ({"euler": euler([0.0, 81.0, 0.0])}, "the pitch reaches 84.32 deg"),
        ({"euler": euler([0.0, np.nan, 0.0])}, "not finite"),
        ({"most_acceleration": 1e-6}, "more than the 1e-06 m/s² allowed"),
    ],
)
def test_a_path_that_cannot_be_is_refused(change, words):
    values = {"time": [0.0, 100.0, 250.0], "place": [(1, 2, 0), (1.01, 2, 0), (1.02, 2.01, 0)]}
    with pytest.raises(ConfigError) as error:
        SplineMotion(**(values | change))
    assert words in str(error.value)


@pytest.mark.parametrize(
    ("places", "how", "words"),
    [
        (
            [PLACES[0], PLACES[1], PLACES[1]],
            {"speeds": [9.0, 9.0]},
            "place 3: the position repeats the previous one",
        ),
        (PLACES, {}, "either times or speeds"),
        (PLACES, {"times": [0.0] * 5, "speeds": [1.0] * 4}, "give either times or speeds"),
        (PLACES, {"speeds": [1.0] * 3}, "3 speeds are given for 4 legs"),
        (
            PLACES,
            {"speeds": [1.0, 0.0, 1.0, 1.0]},
            "place 3, speed: a speed of 0 m/s is not positive",
        ),
        (PLACES, {"speeds": [300.0] * 4}, "more than the 30 m/s² allowed"),
    ],
)
def test_waypoints_that_cannot_be_are_refused(places, how, words):
    with pytest.raises(ConfigError) as error:
        through_waypoints(places, **how)
    assert words in str(error.value)
