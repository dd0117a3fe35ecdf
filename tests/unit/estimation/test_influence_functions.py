"""rho, psi and psi' belong together; defaults have the efficiency that is said of them."""

import itertools
import math

import numpy as np
import pytest
from scipy.integrate import quad

from strapdown.errors import ConfigError
from strapdown.estimation.robust import INFLUENCES, Hampel, Huber, Igg3, Tukey

ALL = [made() for made in INFLUENCES.values()]
ROBUST = [f for f in ALL if f.name != "none"]


def named(functions):
    return {"argvalues": functions, "ids": [f.name for f in functions]}


def test_names_are_those_of_the_table():
    assert [f.name for f in ALL] == list(INFLUENCES)
    assert all(f.summary and f.source for f in ALL)


@pytest.mark.parametrize("f", **named(ALL))
def test_derivatives_symmetry_and_bounds(f):
    step = 1e-6
    for u in np.linspace(-9.0, 9.0, 1801) + 0.00123:
        u = float(u)
        # Central differences of functions whose third derivative is at most about 1.
        assert (f.rho(u + step) - f.rho(u - step)) / (2 * step) == pytest.approx(f.psi(u), abs=1e-8)
        if min(abs(abs(u) - knot) for knot in (*f.knots, math.inf)) > 2 * step:
            slope = (f.psi(u + step) - f.psi(u - step)) / (2 * step)
            assert slope == pytest.approx(f.psi_prime(u), abs=1e-8)
        assert f.rho(-u) == f.rho(u) >= 0.0
        assert f.psi(-u) == -f.psi(u)
        assert f.weight(u) == pytest.approx(f.psi(u) / u, abs=1e-15)
        assert 0.0 <= f.weight(u) <= 1.0
        if abs(u) <= f.linear:
            assert f.psi(u) == u
    assert f.weight(0.0) == 1.0
    assert f.psi(0.0) == f.rho(0.0) == 0.0
    assert f.psi_prime(0.0) == 1.0


@pytest.mark.parametrize("f", **named(ALL))
def test_rho_and_psi_are_continuous_and_psi_bends_one_way_between_knots(f):
    for knot in f.knots:
        assert f.rho(math.nextafter(knot, 0.0)) == pytest.approx(
            f.rho(math.nextafter(knot, 99.0)), abs=1e-13
        )
        assert f.psi(math.nextafter(knot, 0.0)) == pytest.approx(
            f.psi(math.nextafter(knot, 99.0)), abs=1e-14
        )
    for lo, hi in zip((0.0, *f.knots), (*f.knots, 20.0), strict=True):
        inside = np.linspace(lo, hi, 203)[1:-1].tolist()
        bends = np.diff([f.psi_prime(u) for u in inside])
        assert (bends <= 1e-15).all() or (bends >= -1e-15).all()


@pytest.mark.parametrize("f", **named(ROBUST))
def test_default_has_95_percent_efficiency(f):
    """(E psi')^2 / E psi^2 for normal errors; Huber 1981, Eq. (3.2.9)."""

    def mean(g):
        ends = [0.0, *f.knots, max(12.0, f.knots[-1])]
        density = [
            quad(lambda u: g(u) * math.exp(-0.5 * u * u), a, b, epsabs=1e-12)[0]
            for a, b in itertools.pairwise(ends)
        ]
        return math.sqrt(2.0 / math.pi) * sum(density)

    efficiency = mean(f.psi_prime) ** 2 / mean(lambda u: f.psi(u) ** 2)
    # The published constants are rounded to four digits.
    assert efficiency == pytest.approx(0.95, abs=1e-4)


@pytest.mark.parametrize("f", **named([f for f in ROBUST if f.name != "huber"]))
def test_redescending_ones_give_nothing_to_what_is_far(f):
    far = f.knots[-1]
    assert f.psi(far * 1.0001) == f.weight(1e6) == f.psi_prime(1e6) == 0.0
    assert f.rho(1e6) == f.rho(far) < math.inf


def test_huber_never_rejects():
    assert Huber().psi(1e9) == 1.345
    assert Huber().weight(1e9) > 0.0


@pytest.mark.parametrize(
    ("make", "what"),
    [
        (lambda: Huber(0.0), "k = 0.0"),
        (lambda: Huber(math.inf), "k = inf"),
        (lambda: Hampel(1.0, 0.5, 2.0), "b = 0.5 .* not above a = 1"),
        (lambda: Hampel(1.0, 1.5, 1.5), "c = 1.5 .* not above b = 1.5"),
        (lambda: Tukey(-1.0), "c = -1.0"),
        (lambda: Igg3(3.0, 2.0), "k1 = 2.0 .* not above k0 = 3"),
        (lambda: Igg3(math.nan, 2.0), "k0 = nan"),
    ],
)
def test_parameters_are_checked(make, what):
    with pytest.raises(ConfigError, match=what) as told:
        make()
    assert "increasing in the order" in told.value.finding.remedy
