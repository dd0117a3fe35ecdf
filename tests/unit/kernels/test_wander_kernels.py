"""Geometry of a wander azimuth, against the closed form in many digits."""

from __future__ import annotations

import math

import mpmath
import numpy as np
import pytest
from mpmath import mpf

from strapdown import rotation
from strapdown._kernels import level
from strapdown._kernels import wander as kernel
from strapdown.ellipsoids import ELLIPSOIDS, WGS84

ROUNDING = 1.1e-16


def axes_in_earth(lat, lon, angle):
    """xi, eta, zeta as columns, by the definition: xi is east turned anticlockwise by the angle."""
    s, c = math.sin(lat), math.cos(lat)
    north = np.array([-s * math.cos(lon), -s * math.sin(lon), c])
    east = np.array([-math.sin(lon), math.cos(lon), 0.0])
    up = np.array([c * math.cos(lon), c * math.sin(lon), s])
    xi = east * math.cos(angle) + north * math.sin(angle)
    return np.column_stack([xi, np.cross(up, xi), up])


@pytest.mark.parametrize("lat_deg", [-90.0, -89.9999, -30.0, 0.0, 60.0, 89.9999999, 90.0])
@pytest.mark.parametrize("angle_deg", [0.0, 33.0, -120.0, 179.0])
def test_the_place_quaternion_holds_place_and_wander_angle(lat_deg, angle_deg):
    lat, lon, angle = (math.radians(x) for x in (lat_deg, -155.0, angle_deg))
    q = level.wander_from_geodetic(lat, lon, angle)
    found = rotation.dcm_from_quaternion(np.array(q))
    assert found == pytest.approx(axes_in_earth(lat, lon, angle), abs=8.0 * ROUNDING)
    assert np.linalg.norm(q) == pytest.approx(1.0, abs=4.0 * ROUNDING)
    back = level.geodetic_from_wander(*q)
    assert back[0] == pytest.approx(lat, abs=4.0 * ROUNDING)
    if abs(lat_deg) < 90.0:
        turned = rotation.dcm_from_quaternion(np.array(level.wander_from_geodetic(*back)))
        assert turned == pytest.approx(found, abs=12.0 * ROUNDING)
        # Angles at a pole are as uncertain as a rounding is wide there.
        width = 8.0 * ROUNDING / math.cos(lat)
        assert math.remainder(back[1] - lon, 2.0 * math.pi) == pytest.approx(0.0, abs=width)
        assert math.remainder(back[2] - angle, 2.0 * math.pi) == pytest.approx(0.0, abs=width)
    else:
        # What is known of the two is their sum, or the difference, and the wander angle is zero.
        known = lon + angle if lat_deg > 0.0 else lon - angle
        assert back[2] == 0.0
        assert math.remainder(back[1] - known, 2.0 * math.pi) == pytest.approx(0.0, abs=2e-15)


@pytest.mark.parametrize("angle_deg", [0.0, 30.0, 90.0, -135.0])
def test_north_and_east_of_a_velocity_are_a_rotation_of_it(angle_deg):
    """``V_N = V_xi sin A + V_eta cos A``: with the minus of the print it would be no rotation."""
    angle = math.radians(angle_deg)
    s, c = math.sin(angle), math.cos(angle)
    xi, eta, zeta = 7.0, -3.0, 0.5
    turn = rotation.quaternion_from_rotation_vector([0.3, -0.2, 1.0])
    north, east, down, *q = level.level_from_north(angle, xi, eta, zeta, *turn)
    assert east == pytest.approx(xi * c - eta * s, abs=1e-15)
    assert north == pytest.approx(xi * s + eta * c, abs=1e-15)
    assert down == -zeta
    assert math.hypot(north, east) == pytest.approx(math.hypot(xi, eta), rel=1e-15)
    if abs(s * c) > 0.1:
        assert math.hypot(xi * s - eta * c, east) != pytest.approx(math.hypot(xi, eta), rel=1e-3)
    # The quaternion turns vectors as the components are turned.
    given = rotation.rotate(turn, [1.0, 2.0, 3.0])
    expected = level.level_from_north(angle, *given, *turn)[:3]
    assert rotation.rotate(q, [1.0, 2.0, 3.0]) == pytest.approx(expected, abs=2e-15)
    # Xi lies from east towards north.
    assert level.level_from_north(angle, 1.0, 0.0, 0.0, *turn)[:2] == pytest.approx((s, c))


def exact_shift(ellipsoid, lat, alt, r):
    """Tangents along xi and eta of the normal and the rise, at A = 0, in 40 digits."""
    with mpmath.workdps(40):
        a = mpf(ellipsoid.semi_major_axis)
        e2 = mpf(ellipsoid.eccentricity_squared)
        s, c = mpmath.sin(lat), mpmath.cos(lat)
        n = a / mpmath.sqrt(1 - e2 * s * s)
        # Meridian of the start: x outward, y east, z along the axis.
        x = (n + alt) * c - r[1] * s + r[2] * c
        y = mpf(r[0])
        z = (n * (1 - e2) + alt) * s + r[1] * c + r[2] * s
        across = mpmath.sqrt(x * x + y * y)
        new = mpmath.atan2(z, across * (1 - e2))
        for _ in range(60):
            n1 = a / mpmath.sqrt(1 - e2 * mpmath.sin(new) ** 2)
            new = mpmath.atan2(z + e2 * n1 * mpmath.sin(new), across)
        n1 = a / mpmath.sqrt(1 - e2 * mpmath.sin(new) ** 2)
        height = across * mpmath.cos(new) + z * mpmath.sin(new) - a * a / n1
        cn, sn = mpmath.cos(new), mpmath.sin(new)
        up = [cn * x / across, cn * y / across, sn]
        north, east = -s * up[0] + c * up[2], up[1]
        vertical = c * up[0] + s * up[2]
        return east / vertical, north / vertical, height - alt


def found_shift(ellipsoid, lat, alt, r):
    e2, a = ellipsoid.eccentricity_squared, ellipsoid.semi_major_axis
    s, c = math.sin(lat), math.cos(lat)
    w = 1.0 / math.sqrt(1.0 - e2 * s * s)
    far, slope, across, curvature = kernel.curving(w, alt, a, e2)
    tx, ty, _, rise = kernel.shift(0.0, c, s, w, far, slope, across, curvature, e2, *r)
    return tx, ty, rise


@pytest.mark.parametrize("name", ELLIPSOIDS)
@pytest.mark.parametrize("lat", [0.0, 0.7, -1.2, 1.5707, 0.5 * math.pi])
@pytest.mark.parametrize("alt", [0.0, 20_000.0])
def test_a_displacement_is_geometry_to_its_third_order(name, lat, alt):
    """What is left out: ``e² (r/R)⁴`` and ``e⁴ (r/R)³`` of the tilt."""
    ellipsoid = ELLIPSOIDS[name]
    e2, radius = ellipsoid.eccentricity_squared, 6.3e6
    for length in (100.0, 3e3, 3e4):
        for way in ([0.6, 0.7, 0.3], [-0.5, 0.8, -0.1], [0.9, -0.4, 0.0]):
            r = [length * x for x in way]
            exact = [float(x) for x in exact_shift(ellipsoid, mpf(lat), alt, r)]
            found = found_shift(ellipsoid, lat, alt, r)
            part = length / radius
            # Of the size of the terms left out, and of the series of the inverse distance.
            order = e2 * part**4 + e2**2 * part**3
            tilted = 0.5 * order + 2.0 * part**5 + 20.0 * ROUNDING * part
            assert found[:2] == pytest.approx(exact[:2], abs=tilted)
            assert found[2] == pytest.approx(
                exact[2], abs=0.25 * order * radius + 20.0 * ROUNDING * length
            )


def test_the_turn_of_the_level_is_horizontal_and_the_shortest():
    for tx, ty in ((1e-3, -2e-3), (3e-8, 1e-7), (0.0, 0.0), (5e-3, 5e-3)):
        t2 = tx * tx + ty * ty
        d, x, y = kernel.tilt(tx, ty, t2)
        q = np.array([1.0 + d, x, y, 0.0])
        assert np.linalg.norm(q) == pytest.approx(1.0, abs=2.0 * ROUNDING + t2**3)
        normal = np.array([tx, ty, 1.0]) / math.sqrt(1.0 + t2)
        assert rotation.rotate(q, [0.0, 0.0, 1.0]) == pytest.approx(normal, abs=3e-16 + t2**3)
        # The same turn of a vector, without the quaternion.
        v = np.array([200.0, -90.0, 3.0])
        back = rotation.rotate(rotation.conjugate(q), v)
        # An error of t^6, 5/16 of it, and roundings.
        bound = 220.0 * (4.0 * ROUNDING + t2**3)
        assert kernel.level_with(tx, ty, t2, *v) == pytest.approx(back, abs=bound)


def test_what_rounding_leaves_is_not_lost():
    """1e7 steps of a part of the last digit: as many roundings would lose them all."""
    total, low = 1.0, 0.0
    for _ in range(100_000):
        total, low = kernel.add(total, low, 1e-17)
    assert total - 1.0 == pytest.approx(1e-12, rel=1e-3)
    assert total + low - 1.0 == pytest.approx(1e-12, rel=3e-4)


def test_the_rate_of_the_level_at_a_pole_is_that_of_its_circle():
    row = np.zeros((1, kernel.ROW))
    row[0, :4] = level.wander_from_geodetic(0.5 * math.pi, 0.3, 0.0)
    row[0, 5:8], row[0, 8] = [3.0, -4.0, 1.0], 1.0
    out = np.empty((1, 14))
    level.wander_levels(row, WGS84.parameters(), out)
    polar = WGS84.semi_major_axis**2 / WGS84.semi_minor_axis
    assert out[0, 11:] == pytest.approx([4.0 / polar, 3.0 / polar, 0.0], rel=1e-13)
    assert out[0, 7:10] == pytest.approx([0.0, 0.0, 1.0], abs=1e-16)
