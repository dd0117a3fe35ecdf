"""A record that is played by a clock: the numbers of a run at once, and what each sample took."""

from __future__ import annotations

import math

import numpy as np
import pytest
from tests.contracts.test_chain_cuts import assert_same, drive, driving, navigation, tables

from strapdown.errors import ConfigError
from strapdown.live.replay import KEPT, LatencyTape, Replay, parse_pace
from strapdown.navigation.recorder import FullRecorder
from strapdown.navigation.replay import run_batch

RATE = 50.0


class TurnedClock:
    """Stands still but while a sample is navigated: then it goes on by what that costs.

    It is asked once when a run begins, and before and after each sample.
    """

    def __init__(self, costs):
        self.time, self.asked, self.costs = 1000.0, 0, costs
        self.waited = []

    def now(self):
        if self.asked and self.asked % 2 == 0:
            self.time += self.costs(self.asked // 2 - 1)
        self.asked += 1
        return self.time

    def wait_until(self, instant):
        self.waited.append(instant - 1000.0)
        self.time = max(self.time, instant)


def record(length):
    imu = drive()
    out = imu.iloc[:length]
    out.attrs = dict(imu.attrs)
    return out


@pytest.mark.parametrize("pace", [1.0, 10.0, math.inf])
def test_the_numbers_are_those_of_a_run_at_once(pace):
    chain, told = driving(navigation()), {"gnss": tables()["gnss"]}
    played = Replay(pace, TurnedClock(lambda k: 1e-4))
    one = played(chain, drive(), told, FullRecorder())
    assert_same(one, run_batch(chain, drive(), told))
    assert played.tape.latency().samples == len(drive())


def test_samples_are_delivered_when_they_are_due():
    clock, imu = TurnedClock(lambda k: 0.0), record(85)  # none is lost among these
    Replay(2.0, clock)(driving(navigation()), imu, {})
    # At twice the pace half of the time passes; stamps are decimals, to 1e-9 s.
    np.testing.assert_allclose(clock.waited, np.arange(85) / RATE / 2.0, atol=1e-9)


def test_a_slow_sample_is_late_and_makes_the_next_one_late():
    # Due every 20 ms. Sample 10 takes 50 ms: done at 250 ms, and 11 was due at 220: 30 late. That
    # one is delivered at 250, done at 251, and 12 was due at 240: 11 late. 12 is in time.
    clock = TurnedClock(lambda k: 0.05 if k == 10 else 0.001)
    played = Replay(1.0, clock)
    played(driving(navigation()), record(80), {})
    found = played.tape.latency()
    assert (found.samples, found.missed) == (80, 2)
    np.testing.assert_allclose(
        [found.median, found.largest, found.behind, found.mean],
        [0.001, 0.05, 0.03, (79 * 0.001 + 0.05) / 80],
        atol=1e-9,
    )


def test_as_fast_as_it_goes_nothing_is_due():
    played = Replay(math.inf, TurnedClock(lambda k: 0.5))
    played(driving(navigation()), record(80), {})
    found = played.tape.latency()
    assert (found.missed, found.behind) == (None, None)
    assert found.told()["missed_deadlines"] is None


def test_of_nothing_there_is_no_latency():
    assert LatencyTape().latency() is None


def test_quantiles():
    tape = LatencyTape()
    for k in range(101):
        tape.take(0.0, 0.001 * k, 0.0955)
    found = tape.latency()
    np.testing.assert_allclose([found.median, found.most, found.largest], [0.05, 0.099, 0.1])
    assert found.missed == 5  # 96 to 100 ms
    np.testing.assert_allclose(found.behind, 0.0045)


def test_of_many_samples_a_part_is_kept_that_has_their_quantiles():
    tape, draw = LatencyTape(), np.random.default_rng(1)
    took = draw.exponential(1e-3, 300_000)
    for value in took.tolist():
        tape.take(0.0, value, 0.005)
    assert len(tape._took) <= KEPT
    found = tape.latency()
    assert (found.samples, found.missed) == (len(took), (took > 0.005).sum())
    assert (found.largest, found.behind) == (took.max(), took.max() - 0.005)
    assert found.mean == pytest.approx(took.mean(), rel=1e-12)
    # A quantile of 37 500 draws: its own standard deviation is 0.5 % and 1.1 %; four of them.
    assert len(tape._took) == 37_500
    assert found.median == pytest.approx(np.median(took), rel=0.03)
    assert found.most == pytest.approx(np.percentile(took, 99.0), rel=0.05)


@pytest.mark.parametrize("text", ["0", "-1", "nan", "inf", "fast", ""])
def test_what_is_no_pace(text):
    with pytest.raises(ConfigError, match="--pace"):
        parse_pace(text)


def test_paces():
    assert (parse_pace("1"), parse_pace("2.5"), parse_pace("Max")) == (1.0, 2.5, math.inf)
