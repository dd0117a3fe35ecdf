"""Where a vehicle is while it is aligned."""

import numpy as np
import pytest
from tests.coded import coded

from strapdown.ellipsoids import WGS84
from strapdown.errors import DataError
from strapdown.frames import geodetic_from_ned, ned_from_geodetic
from strapdown.navigation.handover import fixes_until, here_by_fix, site_of_fixes
from strapdown.rotation import quaternion_from_euler
from strapdown.tables import gnss_table

HERE = np.array([48.0, 11.0, 500.0])
ASIDE = np.array([1e-6, 0.0, 1.0])


def table(time, place=HERE, velocity=(0.0, 0.0, 0.0), velocity_sd=(0.1,) * 3, quality=None):
    n = len(time)
    return gnss_table(
        time,
        np.broadcast_to(place, (n, 3)),
        np.broadcast_to(velocity, (n, 3)),
        (2.0, 2.0, 4.0),
        velocity_sd,
        quality,
        source="fixes.csv",
    )


def test_fixes_of_many_tables_up_to_an_instant():
    joined = fixes_until([table([1.0, 2.0]), table([3.0, 4.0])], 3.0)
    assert joined.index.tolist() == [1.0, 2.0, 3.0] and joined.attrs["source"] == "fixes.csv"
    later = fixes_until([table([1.0, 2.0]), table([3.0, 4.0])], 3.0, 0.5)
    assert later.index.tolist() == [0.5, 1.5, 2.5] and later.index.name == "time"
    assert fixes_until([], 1.0) is None
    assert fixes_until([table([5.0])], 1.0) is None


def test_a_site_is_the_median_of_the_fixes_of_the_rest():
    away = HERE + np.array([0.01, 0.0, 0.0])
    places = np.array([away, HERE, HERE + ASIDE, HERE - ASIDE])
    fixes = table([1.0, 2.0, 3.0, 4.0], places)
    site, sd = site_of_fixes(fixes, 1.5, 5.0, WGS84)
    np.testing.assert_allclose([site.lat_deg, site.lon_deg, site.alt], HERE, atol=1e-12)
    np.testing.assert_array_equal(sd, [2.0, 2.0, 4.0])
    # None in the rest: the newest before it.
    site, _ = site_of_fixes(fixes, 9.0, 10.0, WGS84)
    assert site.alt == 499.0
    bad = table([1.0, 2.0], quality=[0, 0])
    with pytest.raises(
        DataError, check=coded("navigation.no-position-for-alignment", file="fixes.csv", time=5.0)
    ):
        site_of_fixes(bad, 0.0, 5.0, WGS84)
    with pytest.raises(
        DataError, check=coded("navigation.no-position-for-alignment", quantity="site")
    ):
        site_of_fixes(None, 0.0, 5.0, WGS84)


def test_a_vehicle_has_gone_on_since_its_fix_and_its_antenna_is_elsewhere():
    q_nb = quaternion_from_euler([0.0, 0.0, 90.0])
    fixes = table([9.5], velocity=(3.0, 10.0, -1.0))
    v, P = np.array([3.0, 10.0, -1.0]), np.diag([0.01, 0.04, 0.09])
    place, covariance = here_by_fix(fixes, 10.0, q_nb, np.array([2.0, 0.0, -1.0]), WGS84, v, P)
    there = [np.degrees(place.lat), np.degrees(place.lon), place.alt]
    # Half a second of the velocity, less the arm, which points east and up. Metres of a plane:
    # 5 m of the Earth are bent by 2e-6 m.
    ned = ned_from_geodetic(there, HERE)
    np.testing.assert_allclose(ned, [1.5, 5.0 - 2.0, -0.5 + 1.0], atol=1e-5)
    sd = np.sqrt(np.diagonal(covariance))
    # 1 m/s² of acceleration over 0.5 s: 0.125 m.
    np.testing.assert_allclose(sd[:2] ** 2, 4.0 + np.array([0.05, 0.1]) ** 2 + 0.125**2)
    np.testing.assert_allclose(covariance[3:, 3:], P)
    np.testing.assert_allclose(covariance[:3, 3:], 0.5 * P)


@pytest.mark.parametrize("wrong", [-1, -2])
def test_a_place_that_jumped_is_not_where_a_vehicle_begins(wrong):
    v = np.array([8.0, -3.0, 0.5])
    time = np.arange(1.0, 9.0)
    places = np.array([geodetic_from_ned(v * (t - 8.0), HERE) for t in time])
    places[wrong] = geodetic_from_ned(v * (time[wrong] - 8.0) + [0.0, 40.0, 0.0], HERE)
    fixes = table(time, places, velocity=tuple(v))
    unit, still = np.array([1.0, 0, 0, 0]), np.zeros(3)
    place, _ = here_by_fix(fixes, 8.0, unit, still, WGS84, v, np.eye(3) * 1e-4)
    there = [np.degrees(place.lat), np.degrees(place.lon), place.alt]
    # Carried over one second, or there already; the Earth bends 10 m by 1e-5 m.
    np.testing.assert_allclose(ned_from_geodetic(there, HERE), 0.0, atol=1e-4)
