"""A monitor that runs along: cut anywhere it says the same, and it seldom cries for nothing."""

from __future__ import annotations

import math

import numpy as np
import pytest

from strapdown.errors import ConfigError
from strapdown.navigation.consistency import InnovationMonitor


def alarms_of(monitor, u):
    return monitor.advance(monitor.begin(u.shape[1]), np.arange(float(len(u))), u)[1]


def test_pieces_give_the_same_as_the_whole_to_the_last_bit():
    rng = np.random.default_rng(0)
    u = rng.normal(size=(500, 3))
    u[300:, 2] -= 1.0
    monitor, time = InnovationMonitor(), np.arange(500.0)
    whole, alarms = monitor.advance(monitor.begin(3), time, u)
    state, told, at = monitor.begin(3), [], 0
    for cut in (1, 2, 77, 299, 300, 301, 340, 500):
        state, more = monitor.advance(state, time[at:cut], u[at:cut])
        told += more
        at = cut
    assert tuple(told) == alarms
    assert np.array_equal(state.sums, whole.sums)
    assert np.array_equal(state.since, whole.since, equal_nan=True)


def test_false_alarms_are_as_rare_as_is_proved():
    # Three sums over 200 epochs of one component: at most 600 exp(-threshold), one in fifty.
    monitor = InnovationMonitor(threshold=math.log(600.0 * 50.0))
    rng = np.random.default_rng(1)
    state = monitor.begin(1500)
    _, alarms = monitor.advance(state, np.arange(200.0), rng.normal(size=(200, 1500)))
    wrong = len({one.component for one in alarms})
    # 30 of 1500 at most; five standard deviations of that.
    assert wrong < 30 + 5 * math.sqrt(30)


@pytest.mark.parametrize(
    ("change", "what"), [((0.0, 2.0), "larger"), ((1.0, 1.0), "high"), ((-1.0, 1.0), "low")]
)
def test_a_change_is_seen_soon_and_dated(change, what):
    shift, scale = change
    rng = np.random.default_rng(2)
    monitor = InnovationMonitor()
    away = []
    for _ in range(20):
        u = rng.normal(size=(400, 1))
        u[200:] = shift + scale * u[200:]
        first = min((a for a in alarms_of(monitor, u) if a.what == what), key=lambda a: a.known)
        # The mean drift of the sum after the change is 0.7 an epoch for the scatter, 3/8 for a
        # mean; 13.8 is the threshold.
        assert 200.0 <= first.known < 300.0
        away.append(abs(first.since - 200.0))
    # An excursion of the sum may have begun by chance before; most have not.
    assert np.median(away) < 8.0


def test_one_gross_error_raises_no_alarm_and_none_is_told_twice():
    u = np.zeros((100, 1))
    u[50] = 1000.0
    assert alarms_of(InnovationMonitor(), u) == ()
    steady = np.full((400, 1), 1.0)
    assert len(alarms_of(InnovationMonitor(), steady)) == 1


def test_what_is_missing_says_nothing():
    u = np.full((100, 2), np.nan)
    state, alarms = InnovationMonitor().advance(InnovationMonitor().begin(2), np.arange(100.0), u)
    assert alarms == ()
    assert np.array_equal(state.sums, np.zeros((3, 2)))


def test_a_monitor_that_makes_no_sense_is_refused():
    with pytest.raises(ConfigError, match="larger"):
        InnovationMonitor(larger=1.0)


@pytest.mark.parametrize(
    ("u", "what", "ratio"),
    [
        # Of a mean of half a deviation: u/2 - 1/8.
        ([1.0], "high", 0.375),
        ([-1.0], "low", 0.375),
        # Of a deviation of 1.5: (1 - 1/2.25) u²/2 - ln 1.5, with 4 for what is beyond it.
        ([2.0, -2.0], "larger", 4.0 * 5.0 / 18.0 - math.log(1.5)),
        ([1000.0, -1000.0], "larger", 16.0 * 5.0 / 18.0 - math.log(1.5)),
    ],
)
def test_an_alarm_is_raised_where_the_sum_of_the_ratios_comes_to_a_million(u, what, ratio):
    u = np.resize(u, (200, 1))
    first = min(alarms_of(InnovationMonitor(), u), key=lambda a: a.known)
    assert (first.component, first.what, first.since) == (0, what, 0.0)
    # The epoch k makes the sum (k + 1) ratios.
    assert first.known == math.ceil(math.log(1e6) / ratio) - 1


def test_a_sum_that_comes_to_zero_begins_anew():
    u = np.concatenate([np.full(40, 1.0), np.full(200, -0.5), np.full(60, 1.0)])[:, None]
    high = [a for a in alarms_of(InnovationMonitor(), u) if a.what == "high"]
    # 40 ratios of 3/8 are 15; each epoch of -1/2 takes 3/8 off; 37 of 3/8 are 13.8 and more.
    assert [(a.since, a.known) for a in high] == [(0.0, 36.0), (240.0, 276.0)]


@pytest.mark.parametrize(
    "wrong", [{"threshold": 0.0}, {"larger": 1.0}, {"apart": 0.0}, {"clip": 0.0}]
)
def test_each_setting_is_above_its_limit(wrong):
    (name,) = wrong
    with pytest.raises(ConfigError) as refused:
        InnovationMonitor(**wrong)
    assert refused.value.finding.quantity == name
    InnovationMonitor(**{name: wrong[name] + 1e-3})
