"""Earth against the exact normal field, against moving frames, and against pyins."""

from __future__ import annotations

import datetime
import math
import sys
from pathlib import Path

import numpy as np
import pyins.earth
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mpmath import mp

from strapdown import earth, frames, rotation
from strapdown.ellipsoids import ELLIPSOIDS, WGS84
from strapdown.errors import DataError

sys.path.insert(0, str(Path(__file__).parent))

from normal_field import NormalField

LEVEL = ("wgs84", "grs80", "pz90.11")
LATITUDES = np.array([-90.0, -63.0, -45.0, -20.0, 0.0, 10.0, 35.0, 45.0, 55.0, 75.0, 89.9, 90.0])
FIELDS = {name: NormalField(ELLIPSOIDS[name]) for name in LEVEL}


def exact(name, alt, kind="gravity"):
    """North, east, down of the exact field at all latitudes."""
    rows = [getattr(FIELDS[name], kind)(lat, alt) for lat in LATITUDES]
    return np.array([[float(north), 0.0, float(down)] for north, down in rows])


# --- gravity ----------------------------------------------------------------------------


@pytest.mark.parametrize("name", LEVEL)
def test_on_the_surface_gravity_is_that_of_the_exact_field(name):
    ours = earth.gravity(LATITUDES, 0.0, ellipsoid=ELLIPSOIDS[name])
    assert ours == pytest.approx(exact(name, 0.0), rel=1e-9, abs=1e-15)


# Height in m, and largest errors down and north: the table of the docstring.
DOMAIN = [
    (-1e4, 3e-9, 2e-9),
    (1e3, 2e-10, 1e-10),
    (1e4, 3e-9, 2e-9),
    (2e4, 1.1e-8, 5e-9),
    (5e4, 7e-8, 3e-8),
    (1e5, 3e-7, 2e-7),
    (4e5, 5e-6, 3e-6),
    (1e6, 4e-5, 4e-5),
]


@pytest.mark.parametrize(("alt", "down", "north"), DOMAIN)
@pytest.mark.parametrize("name", LEVEL)
def test_above_the_surface_gravity_is_within_what_the_manual_says(name, alt, down, north):
    error = np.abs(earth.gravity(LATITUDES, alt, ellipsoid=ELLIPSOIDS[name]) - exact(name, alt))
    assert error[:, 2].max() < down
    assert error[:, 0].max() < north
    # And not much better either, or the table would be out of date.
    if abs(alt) >= 1e4:
        assert error[:, 2].max() > 0.5 * down
        assert error[:, 0].max() > 0.3 * north


@pytest.mark.parametrize("name", LEVEL)
@pytest.mark.parametrize("alt", [0.0, 150.0, 1e4])
def test_gravitation_is_the_gradient_of_the_attraction_alone(name, alt):
    ours = earth.gravitation(LATITUDES, alt, ellipsoid=ELLIPSOIDS[name])
    # As gravity: 1e-9 of its size, and what the continuation leaves at 10 km.
    assert ours == pytest.approx(exact(name, alt, "gravitation"), rel=0, abs=9.8e-9)


@pytest.mark.parametrize("name", list(ELLIPSOIDS))
def test_gravitation_and_centrifugal_acceleration_make_gravity(name):
    ellipsoid = ELLIPSOIDS[name]
    parts = [
        function(LATITUDES, 1234.5, ellipsoid=ellipsoid)
        for function in (earth.gravitation, earth.centrifugal)
    ]
    whole = earth.gravity(LATITUDES, 1234.5, ellipsoid=ellipsoid)
    # One rounding of 9.8.
    assert sum(parts) == pytest.approx(whole, rel=0, abs=2e-15)


def test_centrifugal_acceleration_is_that_of_a_circle():
    lat, alt = 35.0, 2000.0
    q = frames.q_ne(lat, 20.0)
    position = frames.ecef_from_geodetic([lat, 20.0, alt])
    rate = np.array([0.0, 0.0, WGS84.rotation_rate])
    outward = -np.cross(rate, np.cross(rate, position))
    assert earth.centrifugal(lat, alt) == pytest.approx(rotation.rotate(q, outward), abs=1e-16)


def test_gravitation_leans_by_5_6_minutes_of_arc_at_55_degrees():
    north, east, down = earth.gravitation(55.0, 0.0)
    assert north == pytest.approx(0.016, abs=5e-5)
    assert east == 0.0
    assert math.degrees(math.atan2(north, down)) * 60.0 == pytest.approx(5.6, abs=0.05)


def test_gravity_has_no_curl_and_only_the_divergence_of_the_rotation():
    """Of the field itself, in geodetic coordinates: that its two components belong together."""
    lat, alt, step = 40.0, 5e3, 200.0
    meridian, transverse = (float(r) + alt for r in earth.radii_of_curvature(lat))
    turn = math.degrees(step / meridian)
    along_north = (earth.gravity(lat + turn, alt) - earth.gravity(lat - turn, alt)) / (2.0 * step)
    along_up = (earth.gravity(lat, alt + step) - earth.gravity(lat, alt - step)) / (2.0 * step)
    north, _, down = earth.gravity(lat, alt)
    curl = along_up[0] + north / meridian + along_north[2]
    divergence = (
        along_north[0]
        - along_up[2]
        - down * (1.0 / meridian + 1.0 / transverse)
        - north * math.tan(math.radians(lat)) / transverse
    )
    # Derivatives of errors of 1e-9 m/s² over 5 km, and of the differences: 3e-6 1/s² times
    # (200 / 6.4e6)². The terms of the divergence are 3e-6 1/s², its value is 1e-8.
    assert abs(curl) < 1e-12
    assert divergence == pytest.approx(2.0 * WGS84.rotation_rate**2, abs=1e-12)


def test_radii_gravity_and_rate_are_those_of_pyins():
    lat, alt = LATITUDES[1:-1], 800.0
    meridian, transverse = earth.radii_of_curvature(lat)
    # e² of pyins has 14 digits: 1e-14 of the radius.
    north, east, _ = pyins.earth.principal_radii(lat, alt)
    assert meridian + alt == pytest.approx(north, rel=1e-13)
    assert transverse + alt == pytest.approx(east, rel=1e-13)
    assert earth.earth_rate(lat) == pytest.approx(pyins.earth.rate_n(lat), abs=1e-19)
    # Its gravity at the pole ends in 8 and not in 9.
    on_surface = pyins.earth.gravity_n(lat, np.zeros(lat.size))
    assert earth.gravity(lat, 0.0) == pytest.approx(on_surface, abs=1.1e-10)
    # It falls by 2 alt/a alone; ours by (f + m) 2 alt/a more at most, which is 1.7e-5 here.
    assert np.abs(earth.gravity(lat, alt) - pyins.earth.gravity_n(lat, alt + 0 * lat)).max() < 2e-5
    v_n = np.column_stack([np.linspace(-200, 200, lat.size), np.linspace(90, -300, lat.size)])
    v_n = np.column_stack([v_n, np.ones(lat.size)])
    curvature = pyins.earth.curvature_matrix(lat, alt)
    assert earth.transport_rate(lat, alt, v_n) == pytest.approx(
        np.einsum("nij,nj->ni", curvature, v_n), rel=1e-12
    )


def test_radii_are_those_of_the_ellipse_itself():
    """Curvature of the meridian by derivatives of its parameter form, in 40 digits."""
    field = FIELDS["wgs84"]
    for lat in (0.0, 30.0, 77.0):
        beta = mp.atan(field.b / field.a * mp.tan(mp.radians(lat)))
        speed2 = (field.a * mp.sin(beta)) ** 2 + (field.b * mp.cos(beta)) ** 2
        meridian, transverse = earth.radii_of_curvature(lat)
        assert meridian == pytest.approx(float(speed2**1.5 / (field.a * field.b)), rel=1e-15)
        # Meusnier: the radius of the parallel over the cosine.
        parallel = field.a * mp.cos(beta)
        assert transverse == pytest.approx(float(parallel / mp.cos(mp.radians(lat))), rel=1e-15)


# --- rates of the local level -----------------------------------------------------------


def rate_of_axes(before, after, duration):
    """Rate, in its own axes, of a frame n that turns: C_ne -> C_ne' is exp(-[w x] t)."""
    turn = rotation.compose(before, rotation.conjugate(after))
    return rotation.rotation_vector_from_quaternion(turn) / duration


@pytest.mark.parametrize("lat", [-80.0, -33.0, 0.0, 20.0, 55.0, 85.0])
def test_transport_rate_is_that_of_the_moving_axes(lat):
    """The axes at two places 0.2 s apart; with the sign of Tadic (8) as printed this fails."""
    lon, alt, v_n = 12.0, 9000.0, np.array([150.0, -230.0, 7.0])
    half = 0.1
    v_e = rotation.rotate(rotation.conjugate(frames.q_ne(lat, lon)), v_n)
    middle = frames.ecef_from_geodetic([lat, lon, alt])
    before, after = (frames.geodetic_from_ecef(middle + t * v_e) for t in (-half, half))
    found = rate_of_axes(frames.q_ne(*before[:2]), frames.q_ne(*after[:2]), 2.0 * half)
    expected = earth.transport_rate(lat, alt, v_n)
    # The rate times (rate times half)², 6e-13 at 85 deg, and rounding: angles of 4e-16 rad of
    # places to 1e-9 m, over 0.2 s and the cosine of the latitude.
    assert found == pytest.approx(expected, abs=1e-12 if abs(lat) > 70.0 else 1e-14)
    assert abs(expected[2]) > 1e-6 or lat == 0.0


@pytest.mark.parametrize("lat", [-90.0, -33.0, 0.0, 55.0, 90.0])
def test_earth_rate_is_that_of_axes_that_turn_with_the_earth(lat):
    """North-east-down relative to inertial axes: as if the longitude grew with the Earth."""
    duration = 100.0
    turned = math.degrees(WGS84.rotation_rate * duration)
    found = rate_of_axes(frames.q_ne(lat, 30.0), frames.q_ne(lat, 30.0 + turned), duration)
    # The turn is about a fixed axis: rounding over 100 s.
    assert found == pytest.approx(earth.earth_rate(lat), abs=1e-17)


# --- properties -------------------------------------------------------------------------

latitudes = st.floats(-90.0, 90.0)
heights = st.floats(-1e4, 1e5)


@settings(max_examples=100, deadline=None)
@given(lat=latitudes, alt=heights)
def test_north_and_south_are_alike(lat, alt):
    north, south = earth.gravity(lat, alt), earth.gravity(-lat, alt)
    assert np.array_equal(south, north * [-1.0, 1.0, 1.0])
    assert np.array_equal(earth.earth_rate(-lat), earth.earth_rate(lat) * [1.0, 1.0, -1.0])


@settings(max_examples=100, deadline=None)
@given(lat=latitudes, alt=heights)
def test_gravity_falls_with_height_and_leans_to_the_equator(lat, alt):
    g, above = earth.gravity(lat, alt), earth.gravity(lat, alt + 10.0)
    # 3.086e-6 1/s² at the surface, 4.5 % less at 100 km.
    assert g[2] - above[2] == pytest.approx(3.0e-5, abs=1.2e-6)
    assert g[0] * lat * alt <= 0.0


# --- shapes and refusals ----------------------------------------------------------------


def test_numbers_and_arrays_go_together():
    assert earth.gravity(50.0, 0.0).shape == (3,)
    assert earth.gravity([50.0, 51.0], 0.0).shape == (2, 3)
    assert earth.gravity(np.zeros((4, 1)), np.zeros(5)).shape == (4, 5, 3)
    assert earth.radii_of_curvature(50.0)[0].shape == ()
    assert earth.earth_rate([]).shape == (0, 3)
    rates = earth.transport_rate([10.0, 20.0], 5.0, [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])
    assert np.array_equal(rates[1], earth.transport_rate(20.0, 5.0, [4.0, 5.0, 6.0]))


REFUSED = [
    (lambda: earth.gravity([0.0, 90.5], 0.0), "row 2, lat_deg: .*latitude beyond the pole"),
    (lambda: earth.earth_rate(math.nan), "row 1, lat_deg: not a finite number"),
    (lambda: earth.radii_of_curvature(["north"]), "lat_deg: .*numbers are needed"),
    (lambda: earth.centrifugal(0.0, [0.0, 0.0, math.inf]), "row 3, alt: not a finite number"),
    (
        lambda: earth.centrifugal(0.0, -6.4e6),
        "row 1, alt: .*height over the ellipsoid out of range",
    ),
    (lambda: earth.gravity(0.0, 2e6), "normal gravity is limited to 1000 km from the ellipsoid"),
    (lambda: earth.gravity([1.0, 2.0], [1.0, 2.0, 3.0]), "do not match"),
    (
        lambda: earth.transport_rate(90.0, 0.0, [1.0, 0.0, 0.0]),
        "north and east are not defined at a pole",
    ),
    (lambda: earth.transport_rate(0.0, 0.0, [1.0, 0.0]), "the velocity has the shape"),
    (lambda: earth.transport_rate(0.0, 0.0, [1.0, math.nan, 0.0]), "v_n_east: not a finite"),
]


@pytest.mark.parametrize(("call", "message"), REFUSED)
def test_what_cannot_be_is_refused_by_row_and_name(call, message):
    with pytest.raises(DataError, match=message) as caught:
        call()
    assert caught.value.finding.remedy


# --- the magnetic field -------------------------------------------------------------------


@pytest.mark.parametrize(
    ("lat", "lon", "alt", "day"),
    [
        (48.2, 16.3, 200.0, (2022, 7, 2)),
        (64.1, -21.9, 1000.0, (2023, 1, 1)),
        (-33.9, 151.2, 0.0, (2024, 1, 1)),
        (40.0, -105.0, 1600.0, (2026, 1, 1)),
    ],
)
def test_the_magnetic_field_is_that_of_another_library(lat, lon, alt, day):
    wmm = pytest.importorskip("ahrs.utils.wmm")
    date = datetime.date(*day)
    length = 366.0 if day[0] % 4 == 0 else 365.0
    year = day[0] + (date.timetuple().tm_yday - 1) / length
    theirs = wmm.WMM(date, latitude=lat, longitude=lon, height=1e-3 * alt)
    ours = earth.magnetic_field(lat, lon, alt, year)
    # A decimal year by either rule differs by a day, in which a field changes by 0.5 nT at most.
    assert ours.declination == pytest.approx(theirs.D, abs=2e-3)
    assert ours.inclination == pytest.approx(theirs.I, abs=2e-3)
    assert ours.strength == pytest.approx(1e-3 * theirs.F, abs=1e-3)
    north, east, down = ours.field_ned
    assert math.degrees(math.atan2(east, north)) == pytest.approx(ours.declination)
    assert math.degrees(math.atan2(down, math.hypot(north, east))) == pytest.approx(
        ours.inclination
    )


def test_a_declination_is_uncertain_by_the_model_and_more_where_the_field_is_steep():
    """0.26° and 5417 nT over the horizontal field."""
    at_equator, near_pole = (earth.magnetic_field(lat, 0.0) for lat in (0.0, 85.0))
    flat = 1e3 * math.hypot(*at_equator.field_ned[:2])
    assert at_equator.declination_sd == pytest.approx(math.hypot(0.26, 5417.0 / flat))
    assert near_pole.declination_sd > 3.0 * at_equator.declination_sd


@pytest.mark.parametrize(
    ("place", "quantity"),
    [
        ((91.0, 0.0, 0.0, 2025.0), "lat"),
        ((0.0, 400.0, 0.0, 2025.0), "lon"),
        ((0.0, 0.0, 1e6, 2025.0), "alt"),
        ((0.0, 0.0, 0.0, 2031.0), "year"),
        ((float("nan"), 0.0, 0.0, 2025.0), "lat"),
    ],
)
def test_outside_the_field_model_is_refused(place, quantity):
    with pytest.raises(DataError) as raised:
        earth.magnetic_field(*place)
    assert raised.value.finding.quantity == quantity
