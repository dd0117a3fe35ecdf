"""Ringing: bounded, from rest, and its derivatives are its own."""

from __future__ import annotations

import math

import mpmath
import numpy as np
import pytest
from mpmath import mpf

from strapdown.errors import ConfigError
from strapdown.simulation import Ringing

PAPER = Ringing(0.15, 98.0665, 195.0, 0.03, (1.0, 0.0, 0.0))
OTHERS = [
    PAPER,
    Ringing(0.0, 49.0, 300.0, 0.03),
    Ringing(2.0, -5.0, 12.0, 0.4, (1.0, -2.0, 2.0)),
]


@pytest.mark.parametrize("ringing", OTHERS)
@pytest.mark.parametrize("since", [1e-5, 1e-3, 0.004, 0.05, 0.3])
def test_derivatives_are_those_of_the_definition(ringing, since):
    time = np.array([ringing.start + since])
    with mpmath.workdps(30):
        w, decay = 2 * mpmath.pi * mpf(ringing.frequency), mpf(ringing.decay)
        size = mpf(ringing.amplitude) / (w**2 + 1 / decay**2)

        def place(t):
            return size * (1 - mpmath.exp(-w * t)) ** 2 * mpmath.exp(-t / decay) * mpmath.sin(w * t)

        t = mpf(time[0]) - mpf(ringing.start)
        exact = [float(mpmath.diff(place, t, k)) for k in range(3)]
    found = [ringing.displacement(time), ringing.velocity(time), ringing.acceleration(time)]
    # The three parts are of the size of the amplitude and cancel at the start.
    scale, w = abs(ringing.amplitude), 2.0 * math.pi * ringing.frequency
    for k in range(3):
        # Time itself is rounded by 4e-16 s, of which the phase turns by w; and a dozen roundings.
        bound = 20.0 * scale * w ** (k - 2) * (3e-16 + 4e-16 * w)
        expected = np.multiply(exact[k], ringing.direction)
        np.testing.assert_allclose(found[k][0], expected, rtol=0.0, atol=bound)


@pytest.mark.parametrize("ringing", OTHERS)
def test_it_begins_without_a_jump_and_moves_nothing_for_good(ringing):
    before, start, end = ringing.start - 0.1, ringing.start, ringing.start + 40.0 * ringing.decay
    for derivative in (ringing.displacement, ringing.velocity, ringing.acceleration):
        first = np.abs(derivative([before, start])).max()
        # Three parts that cancel: 4 times their rounding.
        assert first <= 4.0 * 2.3e-16 * abs(ringing.amplitude)
        # exp(-40) is 4e-18.
        assert np.abs(derivative([end])).max() <= 5e-18 * abs(ringing.amplitude)


@pytest.mark.parametrize("ringing", OTHERS)
def test_its_acceleration_has_no_net_velocity_and_its_velocity_no_net_way(ringing):
    x, w = np.polynomial.legendre.leggauss(20)
    edges = np.arange(0.0, 40.0 * ringing.decay, 0.25 / ringing.frequency)
    half = 0.125 / ringing.frequency
    at = (edges[:, None] + half * (1.0 + x)).ravel() + ringing.start
    weight = np.tile(half * w, edges.size)
    size = abs(ringing.amplitude) / (2.0 * math.pi * ringing.frequency)
    # The sum of what cancels is some ten decays times w of the result's size; rounding of that.
    bound = 1e-13 * size * ringing.frequency * ringing.decay + 1e-15
    assert np.abs(weight @ ringing.acceleration(at)).max() <= bound
    assert np.abs(weight @ ringing.velocity(at)).max() <= (
        np.abs(ringing.displacement([at[-1]])).max() + bound
    )


def test_the_amplitude_is_that_of_the_acceleration():
    # A period after the start the onset is over to 4e-3, and the envelope is the amplitude's.
    t = np.linspace(0.15 + 2.0 / 195.0, 0.15 + 3.0 / 195.0, 2001)
    envelope = 98.0665 * np.exp(-(t - 0.15) / 0.03)
    seen = np.abs(PAPER.acceleration(t)[:, 0]) / envelope
    assert seen.max() == pytest.approx(1.0, abs=1e-4)
    # The onset itself: of (1 - exp(-x))² sin x the second derivative comes to 1.054, less damping.
    t = np.linspace(0.15, 0.4, 100_001)
    assert 0.96 < np.abs(PAPER.acceleration(t)).max() / 98.0665 < 1.06


@pytest.mark.parametrize(
    ("changes", "names"),
    [
        ({"frequency": 0.0}, "frequency"),
        ({"decay": -1.0}, "decay"),
        ({"decay": math.nan}, "decay"),
        ({"amplitude": math.inf}, "amplitude"),
        ({"direction": (0.0, 0.0, 0.0)}, "direction"),
        ({"direction": (1.0, 0.0)}, "direction"),
    ],
)
def test_what_does_not_ring_is_refused(changes, names):
    values = {"start": 0.0, "amplitude": 1.0, "frequency": 100.0, "decay": 0.03}
    with pytest.raises(ConfigError, match=names):
        Ringing(**(values | changes))
