"""Coordinates against 40 digits, pymap3d and SciPy, and there and back."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pymap3d
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from strapdown import earth, frames, rotation
from strapdown._kernels import earth as kernel
from strapdown.ellipsoids import ELLIPSOIDS
from strapdown.errors import DataError

sys.path.insert(0, str(Path(__file__).parent))

from normal_field import NormalField

LATITUDES = [
    -90.0,
    -89.9999999,
    -60.0,
    -1e-9,
    0.0,
    1e-7,
    33.3,
    45.0,
    55.0,
    89.9,
    89.999999999,
    90.0,
]
LONGITUDES = [-180.0, -179.9999999999, -90.0, -1e-9, 0.0, 37.0, 90.0, 179.9999999999, 180.0]
HEIGHTS = [-1e4, 0.0, 8848.0, 1e5, 1e6, 3.6e7]


def grid(alt):
    lat, lon = np.meshgrid(LATITUDES, LONGITUDES, indexing="ij")
    return np.column_stack([lat.ravel(), lon.ravel(), np.full(lat.size, alt)])


def rounding(alt):
    """What doubles leave of a coordinate: three roundings of 6.4e6 m + height, and at least."""
    return 3.0 * (6.4e6 + abs(alt)) * 2.0**-53


@pytest.mark.parametrize("alt", HEIGHTS)
@pytest.mark.parametrize("name", list(ELLIPSOIDS))
def test_ecef_is_that_of_40_digits(name, alt):
    places, ellipsoid = grid(alt), ELLIPSOIDS[name]
    exact = np.array([NormalField(ellipsoid).ecef(*place) for place in places])
    found = frames.ecef_from_geodetic(places, ellipsoid=ellipsoid)
    # The angles in rad are rounded, too, which is half of 2^-53 of up to pi, on both axes.
    assert np.abs(found - exact).max() < 2.5 * rounding(alt)
    a, e2 = ellipsoid.semi_major_axis, ellipsoid.eccentricity_squared
    lat, lon = np.radians(places[:, :2]).T
    trig = np.column_stack([np.sin(lat), np.cos(lat), np.sin(lon), np.cos(lon), places[:, 2]])
    of_kernel = [kernel.ecef_from_geodetic(*row, a, e2) for row in trig.tolist()]
    assert np.abs(of_kernel - exact).max() < 2.5 * rounding(alt)


@pytest.mark.parametrize("alt", HEIGHTS)
@pytest.mark.parametrize("name", list(ELLIPSOIDS))
def test_there_and_back_is_within_rounding_everywhere(name, alt):
    places, ellipsoid = grid(alt), ELLIPSOIDS[name]
    exact = np.array([NormalField(ellipsoid).ecef(*place) for place in places])
    found = frames.geodetic_from_ecef(exact, ellipsoid=ellipsoid)
    radius = 6.4e6 + alt
    north = np.radians(found[:, 0] - places[:, 0]) * radius
    # At the pole and the date line longitude jumps; as a length it does not.
    turn = (found[:, 1] - places[:, 1] + 180.0) % 360.0 - 180.0
    turn = np.where(np.abs(turn) < 1e-6, turn, np.where(np.abs(places[:, 0]) == 90.0, 0.0, turn))
    east = np.radians(turn) * radius * np.cos(np.radians(places[:, 0]))
    # 1e-9 m, the rounding of one coordinate, three times.
    assert np.abs(north).max() < 2.0 * rounding(alt)
    assert np.abs(east).max() < 2.0 * rounding(alt)
    assert np.abs(found[:, 2] - alt).max() < 2.0 * rounding(alt)


def test_each_formula_has_the_bits_of_pymap3d():
    drawn = np.random.default_rng(8)
    places = drawn.uniform([-90.0, -180.0, -1e3], [90.0, 180.0, 1e5], (500, 3))
    origin = [47.3, 8.5, 420.0]
    wgs84 = frames.WGS84
    theirs = pymap3d.Ellipsoid(wgs84.semi_major_axis, wgs84.semi_minor_axis, name="wgs84")
    ecef = np.column_stack(pymap3d.geodetic2ecef(*places.T, theirs))
    np.testing.assert_array_equal(frames.ecef_from_geodetic(places), ecef)
    ned = np.column_stack(pymap3d.ecef2ned(*ecef.T, *origin, theirs))
    np.testing.assert_array_equal(frames.ned_from_ecef(ecef, origin), ned)
    back = np.column_stack(pymap3d.ned2ecef(*ned.T, *origin, theirs))
    np.testing.assert_array_equal(frames.ecef_from_ned(ned, origin), back)


def test_near_the_surface_pymap3d_says_the_same():
    places = grid(1500.0)
    ecef = frames.ecef_from_geodetic(places)
    ellipsoid = pymap3d.Ellipsoid.from_name("wgs84")
    lat, lon, alt = pymap3d.ecef2geodetic(*ecef.T, ellipsoid)
    found = frames.geodetic_from_ecef(ecef)
    # Its b is rounded to 1e-8 m, and both have a rounding or two of their own.
    inner = np.abs(places[:, 0]) < 89.99
    assert np.radians(np.abs(found[inner, 0] - lat[inner])).max() * 6.4e6 < 1e-8
    assert np.array_equal(found[:, 1], lon)
    assert np.abs(found[inner, 2] - alt[inner]).max() < 2e-8


@pytest.mark.parametrize("name", list(ELLIPSOIDS))
def test_heights_are_those_over_the_own_ellipsoid(name):
    ellipsoid = ELLIPSOIDS[name]
    assert frames.ecef_from_geodetic([0.0, 0.0, 0.0], ellipsoid=ellipsoid) == pytest.approx(
        [ellipsoid.semi_major_axis, 0.0, 0.0], abs=1e-9
    )
    assert frames.geodetic_from_ecef(
        [0.0, 0.0, ellipsoid.semi_minor_axis + 7.0], ellipsoid=ellipsoid
    ) == pytest.approx([90.0, 0.0, 7.0], abs=2e-9)


# --- axes -------------------------------------------------------------------------------


def test_axes_are_those_of_scipy():
    lat, lon = np.meshgrid(LATITUDES, LONGITUDES)
    lat, lon = lat.ravel(), lon.ravel()
    # About z by the longitude, then about y by -(latitude + 90 deg), takes ECEF to NED axes.
    turns = Rotation.from_euler("ZY", np.column_stack([lon, -lat - 90.0]), degrees=True).inv()
    # Two products of sines and cosines, each rounded, and their squares.
    assert frames.C_ne(lat, lon) == pytest.approx(turns.as_matrix(), abs=2e-15)
    unit = rotation.rotation_angle(frames.q_ne(lat, lon), turns.as_quat(scalar_first=True))
    assert unit.max() < 1e-13


def test_north_east_and_down_point_there():
    """By differences of places: where one gets that goes a metre north, east, down."""
    place = np.array([48.0, 11.0, 500.0])
    meridian, transverse = (float(r) + place[2] for r in earth.radii_of_curvature(place[0]))
    steps = np.diag(
        [np.degrees(1 / meridian), np.degrees(1 / transverse / np.cos(np.radians(48.0))), -1.0]
    )
    moved = frames.ecef_from_geodetic(place + 0.5 * steps) - frames.ecef_from_geodetic(
        place - 0.5 * steps
    )
    # Central differences of 1 m: rounding of 2e-9 m.
    assert frames.C_ne(place[0], place[1]) == pytest.approx(moved, abs=5e-9)


# --- local coordinates ------------------------------------------------------------------


@pytest.mark.parametrize("origin", [(52.0, 13.0, 40.0), (-90.0, 30.0, 2800.0), (0.0, 180.0, -5.0)])
def test_local_coordinates_are_those_of_the_axes_and_come_back(origin):
    rng = np.random.default_rng(3)
    ned = rng.uniform(-1.0, 1.0, (50, 3)) * [8e4, 8e4, 1e4]
    place = frames.geodetic_from_ned(ned, origin)
    again = frames.ned_from_geodetic(place, origin)
    # Two coordinates of 6.4e6 m, their difference turned: some 1e-9 m each.
    assert np.abs(again - ned).max() < 8e-9
    line = frames.ecef_from_ned(ned, origin) - frames.ecef_from_geodetic(origin)
    assert np.abs(line @ frames.C_ne(*origin[:2]).T - ned).max() < 8e-9


def test_the_ground_falls_away_below_the_local_level():
    ned = frames.ned_from_geodetic([[10.0, 20.0, 0.0], [10.1, 20.0, 0.0]], [10.0, 20.0, 0.0])
    meridian, _ = earth.radii_of_curvature(10.05)
    angle = np.radians(0.1)
    assert np.abs(ned[0]).max() < 3e-9
    # A circle with the radius of the middle; the ellipse differs by e² of the third order.
    assert ned[1, 0] == pytest.approx(meridian * np.sin(angle), abs=0.01)
    assert ned[1, 2] == pytest.approx(meridian * (1.0 - np.cos(angle)), abs=0.01)


# --- differences of places --------------------------------------------------------------


def test_small_differences_are_those_of_the_radii():
    place = np.array([55.0, 37.0, 150.0])
    meridian, transverse = (float(r) + place[2] for r in earth.radii_of_curvature(place[0]))
    moved = place + np.array([2e-5, -3e-5, 4.0])
    expected = [
        np.radians(2e-5) * meridian,
        np.radians(-3e-5) * transverse * np.cos(np.radians(55.0)),
        -4.0,
    ]
    # Second order, 2 m x 4 m / 6.4e6 m.
    assert frames.place_difference(moved, place) == pytest.approx(expected, abs=3e-6)


def test_differences_at_the_date_line_and_at_the_pole_are_small():
    across = frames.place_difference([10.0, -179.99999, 0.0], [10.0, 179.99999, 0.0])
    assert across == pytest.approx([0.0, 2.192, 0.0], abs=1e-3)
    over = frames.place_difference([89.99999, 180.0, 0.0], [89.99999, 0.0, 0.0])
    assert np.linalg.norm(over) == pytest.approx(2.2339, abs=1e-3)
    assert abs(over[2]) < 4e-9


places = st.tuples(st.floats(-90.0, 90.0), st.floats(-180.0, 180.0), st.floats(-1e3, 2e4))
offsets = st.tuples(st.floats(-0.2, 0.2), st.floats(-0.2, 0.2), st.floats(-1e3, 1e3))


@settings(max_examples=100, deadline=None)
@given(place=places, offset=offsets)
def test_a_difference_turns_with_its_order_and_is_as_long_as_the_line(place, offset):
    place = np.array(place)
    other = place + offset
    other[0] = np.clip(other[0], -90.0, 90.0)
    there, back = frames.place_difference(other, place), frames.place_difference(place, other)
    # Coordinates of 6.4e6 m to 1e-9 m each, turned by axes that are right to 4e-16.
    assert np.abs(there + back).max() < 1e-9
    ecef = frames.ecef_from_geodetic([place, other])
    assert np.linalg.norm(there) == pytest.approx(np.linalg.norm(ecef[1] - ecef[0]), abs=1e-9)
    # Down is the difference of heights, but for the cosine of half the angle between (2e-6) and
    # the change of curvature along the way (e² of the cube: 30 km³/R² e² = 5 mm).
    assert there[2] == pytest.approx(-(other[2] - place[2]), abs=0.01)


@settings(max_examples=200, deadline=None)
@given(place=places)
def test_any_place_comes_back(place):
    found = frames.geodetic_from_ecef(frames.ecef_from_geodetic(place))
    line = frames.place_difference(found, place)
    assert np.abs(line).max() < 8e-9


# --- refusals ---------------------------------------------------------------------------

NAN = float("nan")
REFUSED = [
    (
        lambda: frames.ecef_from_geodetic([[0, 0, 0], [91, 0, 0]]),
        "row 2, lat_deg: .*latitude beyond the pole",
    ),
    (
        lambda: frames.ecef_from_geodetic([0.0, 361.0, 0.0]),
        "lon_deg: .*longitude of more than a full turn",
    ),
    (
        lambda: frames.ecef_from_geodetic([0.0, 0.0, 6.4e9]),
        "alt: .*height over the ellipsoid out of range",
    ),
    (lambda: frames.ecef_from_geodetic([0.0, 0.0]), r"place: .*does not end in \(3"),
    (lambda: frames.geodetic_from_ecef([6.4e6, NAN, 0.0]), "y: not a finite number"),
    (lambda: frames.geodetic_from_ecef([[6.4e6, 0, 0], [0, 0, 0]]), "row 2, position: not within"),
    (lambda: frames.geodetic_from_ecef([1e200, 0.0, 0.0]), "position: not within"),
    (lambda: frames.q_ne([0.0, -90.1], 0.0), "row 2, lat_deg: .*latitude beyond the pole"),
    (lambda: frames.ned_from_ecef([6.4e6, 0, 0], [[0, 0, 0]] * 2), "origin: shape"),
    (lambda: frames.place_difference(np.zeros((2, 3)), np.zeros((3, 3))), "do not match"),
    (lambda: frames.place_difference([0, 0, 0], [0, 180, 0]), "not within"),
]


@pytest.mark.parametrize(("call", "message"), REFUSED)
def test_what_is_no_place_is_refused_by_row_and_name(call, message):
    with pytest.raises(DataError, match=message) as caught:
        call()
    assert caught.value.finding.remedy
