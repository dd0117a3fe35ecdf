"""Detectors of a standstill: by hand, at rest and on the move, and where the window begins."""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[3]))

from aided_drives import drive, gnss_of, increments_of, navigator_of, run
from strapdown.errors import ConfigError
from strapdown.navigation.measurements.gnss import Gnss
from strapdown.navigation.measurements.standstill import (
    STANDSTILL_DETECTORS,
    ZeroRate,
    ZeroVelocity,
)

RATE_SD, FORCE_SD = 0.01, 0.1
STEP = 0.01


def rest(count, seed=0, gravity=9.81):
    rng = np.random.default_rng(seed)
    force = np.tile([0.3 * gravity, 0.0, -math.sqrt(1.0 - 0.09) * gravity], (count, 1))
    return (
        RATE_SD * rng.standard_normal((count, 3)),
        force + FORCE_SD * rng.standard_normal((count, 3)),
    )


def steps(rate, force, step=STEP):
    """Rows of increments, and their ends."""
    rows = np.zeros((len(rate), 10))
    rows[:, 0], rows[:, 1:4], rows[:, 4:7] = step, rate * step, force * step
    return step * np.arange(1, len(rate) + 1), rows


def times_of(aid, time, rows):
    return aid.watch(aid.begin(), time, rows)[1].time


@pytest.mark.parametrize("name", list(STANDSTILL_DETECTORS))
def test_it_is_one_at_a_rest_of_the_stated_noise(name):
    """Of 2000 samples the mean square of one component is within 3.2 percent, one sigma."""
    detector = STANDSTILL_DETECTORS[name]
    assert detector.summary and detector.source
    found = detector.statistic(*rest(2000), RATE_SD, FORCE_SD, 9.81)
    # The direction of gravity that is estimated takes two of 6000 squares.
    assert found == pytest.approx(1.0, abs=0.05)


def test_they_are_what_was_published():
    """Sums by hand, sample by sample, of Skog et al. (2010), before the root of n squares."""
    rate, force = rest(7, 3)
    mean, g, w = force.mean(axis=0), 9.81, len(rate)
    up = g * mean / np.linalg.norm(mean)
    energy = sum(r @ r for r in rate) / RATE_SD**2 / w
    sums = {
        "shoe": sum((f - up) @ (f - up) for f in force) / FORCE_SD**2 / w + energy,
        "rate_energy": energy,
        "force_magnitude": sum((np.linalg.norm(f) - g) ** 2 for f in force) / FORCE_SD**2 / w,
        # Theirs is over w; an unbiased variance is over w - 1.
        "force_variance": sum((f - mean) @ (f - mean) for f in force) / FORCE_SD**2 / (w - 1),
    }
    for name, total in sums.items():
        detector = STANDSTILL_DETECTORS[name]
        found = detector.statistic(rate, force, RATE_SD, FORCE_SD, g)
        assert found**2 * detector.squares == pytest.approx(total, rel=1e-12)


@pytest.mark.parametrize(
    ("name", "sees"),
    [
        ("shoe", {"bias of rate", "scale of force", "swing", "knock"}),
        ("rate_energy", {"bias of rate", "swing"}),
        ("force_variance", {"swing", "knock"}),
        ("force_magnitude", {"scale of force", "knock"}),
        ("variance", {"swing", "knock"}),
        ("force_spread", {"swing"}),
    ],
)
def test_what_each_takes_for_a_motion(name, sees):
    rate, force = rest(200, 5)
    t = STEP * np.arange(200)
    swing = 0.2 * np.sin(2.0 * np.pi * t)
    knocked = force.copy()
    knocked[100:104, 2] += 8.0
    cases = {
        "bias of rate": (rate + 0.05, force),
        "scale of force": (rate, force * 1.1),
        "swing": (
            rate + np.outer(0.2 * 2.0 * np.pi * np.cos(2.0 * np.pi * t), [0.0, 1.0, 0.0]),
            force + 9.81 * np.outer(swing, [1.0, 0.0, 0.0]),
        ),
        "knock": (rate, knocked),
    }
    if name == "force_magnitude":
        del cases["swing"]
    found = {
        case
        for case, signals in cases.items()
        if STANDSTILL_DETECTORS[name].statistic(*signals, RATE_SD, FORCE_SD, 9.81) > 3.0
    }
    assert found == sees & set(cases)


def test_a_window_is_as_long_as_it_says_and_of_the_past():
    """A knock of one sample at 3.005 s: 1 s of windows see it, and none before it."""
    rate, force = rest(600, 7)
    force[300] += 20.0
    aid = ZeroVelocity(
        name="stop",
        window=1.0,
        interval=0.0,
        force_sd=FORCE_SD,
        rate_sd_deg_per_s=math.degrees(RATE_SD),
    )
    time, rows = steps(rate, force)
    found = times_of(aid, time, rows)
    expected = [t for t in time if t > 0.995 and not 3.005 < t < 4.005]
    np.testing.assert_allclose(found, expected, atol=1e-9)


def test_a_log_that_has_just_begun_or_has_a_hole_is_no_rest():
    rate, force = rest(400, 9)
    time, rows = steps(rate, force)
    aid = ZeroVelocity(name="stop", interval=0.0, force_sd=FORCE_SD)
    assert times_of(aid, time, rows)[0] == pytest.approx(1.0)
    keep = (time < 2.0) | (time > 2.5)
    found = times_of(aid, time[keep], rows[keep])
    # Half a second is missing of these windows, and a fifth may be.
    assert not ((found > 2.5) & (found < 3.29)).any()
    assert ((found > 3.31) & (found < 3.5)).any()


def test_epochs_are_an_interval_apart_on_the_multiples_of_it():
    rate, force = rest(1000, 11)
    time, rows = steps(rate, force)
    aid = ZeroRate(name="still", interval=0.3, force_sd=FORCE_SD)
    np.testing.assert_allclose(times_of(aid, time, rows), np.arange(1.2, 9.95, 0.3), atol=1e-9)


def test_stops_of_a_drive_are_found():
    """On multiples of half a second, of which the window is within the rest."""
    aid = ZeroVelocity(name="stop", force_sd=0.01, rate_sd_deg_per_s=0.1)
    found = times_of(aid, *increments_of(drive(), 0))
    expected = np.concatenate([np.arange(1.5, 12.1, 0.5), np.arange(109.5, 119.9, 0.5)])
    assert np.isin(np.round(expected, 6), np.round(found, 6)).all()


def test_steady_travel_is_not_taken_for_a_rest():
    """Along a straight road at constant speed the detector is satisfied, and the velocity not."""
    aid = ZeroVelocity(name="stop", force_sd=0.01, rate_sd_deg_per_s=0.1)
    time, rows = increments_of(drive(), 0)
    assert ((times_of(aid, time, rows) > 62.0) & (times_of(aid, time, rows) < 70.0)).sum() > 5
    navigator = navigator_of((Gnss(name="gnss"), aid))
    _, pieces = run(navigator, drive(), 0, {"gnss": gnss_of(drive(), 0)})
    seen = [one.time for one in pieces[0].seen if one.name == "stop.velocity"]
    assert len(seen) > 40
    assert all(t < 13.0 or t > 107.0 for t in seen)


def test_a_velocity_that_is_known_badly_may_be_a_rest():
    """After 68 s without GNSS the drift is some m/s, and so is its standard deviation."""
    navigator = navigator_of((Gnss(name="gnss"), ZeroVelocity(name="stop", largest_speed=0.01)))
    _, pieces = run(navigator, drive(), 3, {"gnss": gnss_of(drive(), 3, until=41.0)})
    seen = [one.time for one in pieces[0].seen if one.name == "stop.velocity"]
    assert any(t > 108.0 for t in seen)


@pytest.mark.parametrize(
    ("options", "quantity"),
    [
        ({"detector": "shoo"}, "detector"),
        ({"window": 0.0}, "window"),
        ({"threshold": -1.0}, "threshold"),
        ({"interval": math.inf}, "interval"),
        ({"sd": 0.0}, "sd"),
        ({"largest_speed": math.nan}, "largest_speed"),
        ({"force_sd": "0.1"}, "force_sd"),
    ],
)
def test_options_that_mean_nothing_are_refused(options, quantity):
    with pytest.raises(ConfigError) as refused:
        ZeroVelocity(name="stop", **options)
    assert refused.value.finding.quantity == quantity
    assert refused.value.finding.remedy


@pytest.mark.parametrize(("gate_time", "taken"), [(0.0, False), (5.0, True), (7.0, False)])
def test_the_gate_opens_where_nothing_was_observed_for_long(gate_time, taken):
    class Wrong:
        """20 m/s, and known to 1 cm/s."""

        velocity = np.array([20.0, 0.0, 0.0])
        covariance = 1e-4 * np.eye(9)
        unobserved = 6.0

    aid = ZeroVelocity(name="stance", gate_time=gate_time)
    assert aid.near_rest(Wrong()) is taken
