"""The figures of the ellipsoids: as published, and consistent with each other."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from mpmath import mp

from strapdown import earth
from strapdown._kernels import earth as kernel
from strapdown.ellipsoids import ELLIPSOIDS, WGS84, find_ellipsoid
from strapdown.errors import ConfigError

sys.path.insert(0, str(Path(__file__).parent))

from normal_field import NormalField

LEVEL = ("wgs84", "grs80", "pz90.11")


# Derived constants in the standards of each system, with all the digits that they print:
# b in m, e², normal gravity at equator and pole in m/s², Somigliana's k, J2, U0 in m²/s².
PUBLISHED = {
    # NGA.STND.0036, tables 3.5 and 3.6.
    "wgs84": {
        "b": "6356752.3142",
        "e2": "6.694379990141e-3",
        "equator": "9.7803253359",
        "pole": "9.8321849379",
        "k": "1.931852652458e-3",
        "u0": "62636851.7146",
    },
    # Moritz 2000.
    "grs80": {
        "b": "6356752.3141",
        "e2": "0.00669438002290",
        "equator": "9.7803267715",
        "pole": "9.8321863685",
        "k": "0.001931851353",
        "j2": "1.0826300000e-3",
        "u0": "62636860.850",
    },
    # GLONASS ICD L1, L2 (2008), table 3.2.
    "pz90.11": {"equator": "9.7803284", "j2": "1082625.75e-9", "u0": "62636861.4"},
}


def calculated(ellipsoid):
    """The derived constants from a, f, GM and rate, of the exact field."""
    field = NormalField(ellipsoid)
    equator, pole = field.gravity(0, 0)[1], field.gravity(90, 0)[1]
    m = field.rate**2 * field.a**2 * field.b / field.gm
    q0 = field._q(field.b)
    # Heiskanen and Moritz 1967, Eq. (2-90).
    j2 = field.e2 / 3 * (1 - 2 * m * (field.linear / field.b) / (15 * q0))
    return {
        "b": field.b,
        "e2": field.e2,
        "equator": equator,
        "pole": pole,
        "k": field.b * pole / (field.a * equator) - 1,
        "j2": j2,
        "u0": field.attraction_potential(field.a, 0) + (field.rate * field.a) ** 2 / 2,
    }


@pytest.mark.parametrize("name", LEVEL)
def test_defining_figures_give_the_published_derived_ones(name):
    found = calculated(ELLIPSOIDS[name])
    for key, printed in PUBLISHED[name].items():
        mantissa, _, exponent = printed.partition("e")
        digits = len(mantissa.partition(".")[2]) - int(exponent or 0)
        # Half a unit of the last printed digit. J2 defines GRS-80; that 1/f is given to 5e-10
        # makes 4e-15 of it.
        assert abs(found[key] - mp.mpf(printed)) <= mp.mpf("0.5") * mp.mpf(10) ** -digits, key


@pytest.mark.parametrize("name", LEVEL)
def test_gravity_of_the_data_is_that_of_its_defining_figures(name):
    ellipsoid, found = ELLIPSOIDS[name], calculated(ELLIPSOIDS[name])
    # The data have ten decimals.
    assert ellipsoid.gravity_at_equator == pytest.approx(float(found["equator"]), abs=0.51e-10)
    assert ellipsoid.gravity_at_pole == pytest.approx(float(found["pole"]), abs=0.51e-10)


@pytest.mark.parametrize("name", LEVEL)
def test_properties_are_those_of_the_geometry(name):
    ellipsoid, found = ELLIPSOIDS[name], calculated(ELLIPSOIDS[name])
    assert ellipsoid.semi_minor_axis == pytest.approx(float(found["b"]), rel=3e-16)
    # f (2 - f) keeps the relative rounding of f.
    assert ellipsoid.eccentricity_squared == pytest.approx(float(found["e2"]), rel=5e-16)
    # Gravity to 0.5e-10 m/s² twice, of 9.8.
    assert ellipsoid.somigliana == pytest.approx(float(found["k"]), abs=1.1e-11)


def test_krassovsky_has_helmerts_gravity_and_the_published_eccentricity():
    krassovsky = ELLIPSOIDS["krassovsky1940"]
    # Chernodarov (2009), Eq. (7), prints 0.0066934.
    assert krassovsky.eccentricity_squared == pytest.approx(0.006693421623, abs=5e-13)
    lat = np.radians(np.linspace(-90.0, 90.0, 181))
    helmert = 9.78030 * (1.0 + 0.005302 * np.sin(lat) ** 2 - 0.000007 * np.sin(2.0 * lat) ** 2)
    ours = earth.gravity(np.degrees(lat), 0.0, ellipsoid=krassovsky)[:, 2]
    # What the note says: 1.2 mGal in between, and nothing at the ends.
    assert 1e-5 < np.abs(ours - helmert).max() < 1.2e-5
    assert ours[[0, 90, 180]] == pytest.approx(helmert[[0, 90, 180]], abs=1e-10)
    assert np.abs(ours - earth.gravity(np.degrees(lat), 0.0)[:, 2]).max() < 3.3e-5


def test_every_figure_has_a_source_or_is_named_as_derived():
    for name, ellipsoid in ELLIPSOIDS.items():
        assert ellipsoid.name == name
        assert ellipsoid.source
        assert all(isinstance(getattr(ellipsoid, one), float) for one in ellipsoid.derived)
    assert next(iter(ELLIPSOIDS)) == WGS84.name


def test_the_array_has_the_numbers_in_the_places_of_the_kernels():
    array = WGS84.parameters()
    assert array.shape == (kernel.SIZE,)
    assert array[kernel.A] == WGS84.semi_major_axis
    assert array[kernel.E2] == WGS84.eccentricity_squared
    assert array[kernel.GAMMA] == WGS84.gravity_at_equator
    assert array[kernel.K] == WGS84.somigliana
    assert array[kernel.RATE] == WGS84.rotation_rate
    assert array[kernel.F] == WGS84.flattening
    # Centrifugal acceleration over gravity, both from the public face.
    ratio = -earth.centrifugal(0.0, 0.0)[2] / earth.gravity(0.0, 0.0)[2]
    assert array[kernel.M] == pytest.approx(ratio, rel=1e-15)


def test_a_name_is_found_whatever_its_case_and_a_wrong_one_is_refused():
    assert find_ellipsoid("WGS84") is WGS84
    with pytest.raises(ConfigError, match=r"did you mean 'grs80'"):
        find_ellipsoid("grs-80")
