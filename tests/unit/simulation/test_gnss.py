"""A simulated receiver is right where it has no errors, and as wrong as it says elsewhere."""

from __future__ import annotations

import numpy as np
import pytest
from tests.coded import coded

from strapdown.errors import ConfigError
from strapdown.frames import place_difference
from strapdown.simulation import Origin, StationaryMotion, car
from strapdown.simulation.crash_motion import CrashMotion, HaversinePulse
from strapdown.simulation.gnss import FALSE_POSITION, GnssReceiver, simulate_gnss
from strapdown.simulation.vehicles import Straight, Turn
from strapdown.tables import GEODETIC, VELOCITY

TURNING = car(
    Origin(45.0, 20.0, 80.0), [("in", Straight(1.0)), ("bend", Turn(120.0, 30.0))], speed=12.0
)
CRASH = CrashMotion(
    10.0,
    Origin(45.0, 20.0, 80.0),
    (14.0, 0.0, 0.0),
    (HaversinePulse(5.0, 0.1, (-14.0, 0.0, 0.0)),),
)
LONG = StationaryMotion(4000.0, Origin(45.0, 20.0, 80.0))


def test_without_errors_it_is_the_truth():
    fixes = simulate_gnss(TURNING, GnssReceiver(rate=5.0))
    truth = TURNING.trajectory(fixes.index.to_numpy())
    # The places are written once more from what moved them by nothing.
    np.testing.assert_allclose(fixes[GEODETIC], truth[GEODETIC], rtol=0, atol=1e-13)
    np.testing.assert_array_equal(fixes[VELOCITY], truth[VELOCITY])
    np.testing.assert_allclose(np.diff(fixes.index), 0.2, rtol=1e-12)


def test_the_antenna_moves_as_its_places_do():
    arm = (0.8, -0.5, -1.4)
    fixes = simulate_gnss(TURNING, GnssReceiver(rate=100.0, antenna=arm))
    # Distance from the reference point: the arm, to the 4e-9 m of a place in float64.
    truth = TURNING.trajectory(fixes.index.to_numpy())
    apart = place_difference(fixes[GEODETIC].to_numpy(), truth[GEODETIC].to_numpy())
    np.testing.assert_allclose(np.linalg.norm(apart, axis=1), np.linalg.norm(arm), atol=2e-8)
    # The velocity is the central difference of the places: its error is h²/6 times the third
    # derivative, at most v w² + r w³ + v w'' of this turn (w = 0.4 rad/s, w'' below 3 rad/s³).
    place = fixes[GEODETIC].to_numpy()
    middle = place_difference(place[2:], place[:-2]) / 0.02
    np.testing.assert_allclose(
        middle, fixes[VELOCITY].to_numpy()[1:-1], atol=0.01**2 / 6.0 * 50.0 + 1e-6
    )


def test_errors_have_the_size_and_the_memory_that_were_asked_for():
    receiver = GnssReceiver(
        rate=1.0,
        position_noise=(0.5, 0.6, 1.0),
        position_drift=2.0,
        correlation_time=5.0,
        velocity_noise=0.1,
    )
    fixes = simulate_gnss(LONG, receiver, seed=3)
    truth = LONG.trajectory(fixes.index.to_numpy())
    off = place_difference(fixes[GEODETIC].to_numpy(), truth[GEODETIC].to_numpy())
    n = len(off)
    # The relative error of a variance: √(2/n) for white noise, and √(2 tau/n) for a process of
    # correlation time tau in samples; four of them.
    sd = np.hypot([0.5, 0.6, 1.0], 2.0)
    np.testing.assert_allclose(off.std(axis=0), sd, rtol=4.0 * 0.5 * np.sqrt(2.0 * 5.0 / n))
    np.testing.assert_allclose(fixes["north_sd"], sd[0])
    np.testing.assert_allclose(fixes[VELOCITY].std(), 0.1, rtol=4.0 * np.sqrt(0.5 / n))
    # Of the north error 4/4.25 wander; after 5 s 1/e of that is left.
    lagged = (off[5:, 0] * off[:-5, 0]).mean() / off[:, 0].var()
    assert lagged == pytest.approx(4.0 / 4.25 / np.e, abs=4.0 * np.sqrt(5.0 / n))


def test_stamps_may_be_late():
    late = simulate_gnss(TURNING, GnssReceiver(rate=5.0, time_offset=0.13))
    plain = simulate_gnss(TURNING, GnssReceiver(rate=5.0))
    np.testing.assert_array_equal(late.to_numpy(), plain.to_numpy())
    np.testing.assert_allclose(late.index - plain.index, 0.13, atol=1e-14)


def test_a_crash_takes_the_fixes_or_makes_them_false():
    receiver = {"rate": 10.0, "position_noise": 0.5, "velocity_noise": 0.05, "outage": 2.0}
    usual = simulate_gnss(CRASH, GnssReceiver(**receiver, on_excess="unaffected"), seed=4)
    lost = simulate_gnss(CRASH, GnssReceiver(**receiver), seed=4)
    gone = np.setdiff1d(usual.index, lost.index)
    # 140 m/s² on average within 5.0 to 5.1 s, which the loops forget 50 to 100 ms later.
    assert 5.0 < gone[0] <= 5.1
    assert 7.0 <= gone[-1] <= 7.2
    np.testing.assert_array_equal(lost, usual.loc[lost.index])
    false = simulate_gnss(CRASH, GnssReceiver(**receiver, on_excess="garbage"), seed=4)
    np.testing.assert_array_equal(false.loc[lost.index], lost)
    off = place_difference(
        false.loc[gone, GEODETIC].to_numpy(), usual.loc[gone, GEODETIC].to_numpy()
    )
    # Of 60 normal numbers the standard deviation is right to 9 %; four of that.
    assert off.std() == pytest.approx(FALSE_POSITION, rel=0.4)
    # It claims to be as good as ever.
    assert (false["north_sd"] == 0.5).all()


def test_a_seed_is_a_receiver():
    receiver = GnssReceiver(rate=2.0, position_noise=1.0)
    a, b, c = (simulate_gnss(TURNING, receiver, seed=s) for s in (1, 1, 2))
    np.testing.assert_array_equal(a, b)
    assert (a["lat"] != c["lat"]).all()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"rate": 0.0}, "rate"),
        ({"position_noise": -1.0}, "position_noise"),
        ({"antenna": (1.0, 2.0)}, "wrong shape"),
        ({"on_excess": "explode"}, "lost, garbage, unaffected"),
        ({"correlation_time": np.nan}, "correlation_time"),
    ],
)
def test_what_is_no_receiver_is_refused(changes, message):
    with pytest.raises(ConfigError, match=message):
        GnssReceiver(**changes)


def test_a_rate_without_two_fixes_is_refused():
    with pytest.raises(ConfigError, check=coded("simulation.hz-gives-fixes")):
        simulate_gnss(CRASH, GnssReceiver(rate=0.05))
