"""The clock behind stamps: known instants of sampling, and stamps as drivers and programs give."""

from __future__ import annotations

import numpy as np
import pytest

from strapdown.tables.sample_clock import sample_clock

RATES = (25.0, 100.0, 285.7, 1000.0)
SECONDS = 40.0


def motion(time, rng):
    rate = np.column_stack(
        [
            np.sin(2 * np.pi * 0.7 * time) + 0.3 * np.sin(2 * np.pi * 3.1 * time),
            np.cos(2 * np.pi * 1.1 * time),
            np.sin(2 * np.pi * 0.3 * time + 1.0),
        ]
    )
    return rate + rng.normal(0.0, 2e-3, rate.shape)


@pytest.fixture(params=RATES, ids=lambda r: f"{r:g}Hz")
def taken(request):
    """Step, instants of a clock that is 50 ppm slow, and a generator."""
    step = 1.0 / request.param
    count = int(SECONDS * request.param)
    return step, 5.0 + step * (1.0 + 50e-6) * np.arange(count), np.random.default_rng(count)


def rate_error(clock, step):
    return abs(clock.step / (step * (1.0 + 50e-6)) - 1.0)


def test_even_stamps_stay_to_the_last_bit(taken):
    step, time, rng = taken
    clock = sample_clock(time, motion(time, rng))
    assert (clock.kind, clock.repaired, clock.lost, clock.gaps) == ("even", False, 0, ())
    assert clock.time is time
    np.testing.assert_array_equal(clock.number, np.arange(time.size))
    assert rate_error(clock, step) < 1e-9


@pytest.mark.parametrize("pause", [2.0, 20.0])
def test_a_pause_does_not_change_the_rate_and_begins_a_stretch(taken, pause):
    step, time, rng = taken
    here = (time < 15.0) | (time > 15.0 + pause)
    clock = sample_clock(time[here], motion(time[here], rng))
    assert rate_error(clock, step) < 1e-6
    (gap,) = clock.gaps
    first = int((time < 15.0).sum())
    assert gap.sample == first
    assert gap.length == pytest.approx(pause, abs=2.0 * step)
    assert clock.stretches == [(0, first), (first, int(here.sum()))]
    assert clock.lost == 0
    # A lower rate has the ends of both stretches.
    assert {0, first - 1, first, int(here.sum()) - 1} <= set(clock.every(4).tolist())


@pytest.mark.parametrize("share", [0.01, 0.1, 0.2])
@pytest.mark.parametrize("jitter", [0.0, 0.3])
def test_lost_samples_are_counted_whatever_the_jitter(taken, share, jitter):
    step, time, rng = taken
    here = rng.random(time.size) > share
    here[[0, -1]] = True
    stamps = (time + step * rng.uniform(-jitter, jitter, time.size))[here]
    clock = sample_clock(stamps, motion(time[here], rng))
    assert rate_error(clock, step) < 1e-3
    # Of the losses at both ends of a tracked record one may be taken for jitter.
    assert clock.lost == pytest.approx(int((~here).sum()), abs=0 if jitter == 0.0 else 2)
    number = np.flatnonzero(here)
    assert np.mean(np.diff(clock.number) == np.diff(number)) > 0.999


@pytest.mark.parametrize("jitter", [0.1, 0.2, 0.4])
def test_jitter_of_arrival_is_taken_out(taken, jitter):
    step, time, rng = taken
    stamps = time + step * rng.uniform(-jitter, jitter, time.size)
    clock = sample_clock(stamps, motion(time, rng))
    assert clock.repaired
    assert clock.lost == 0
    assert rate_error(clock, step) < 1e-4
    # A mean over 101 stamps leaves a tenth of their scatter.
    assert np.std(clock.time - time) < 0.13 * np.std(stamps - time)


def test_a_program_that_reads_late_and_stamps_right_is_believed(taken):
    step, time, rng = taken
    stamps = time + step * rng.uniform(-0.3, 0.3, time.size)
    clock = sample_clock(stamps, motion(stamps, rng))
    assert (clock.kind, clock.repaired) == ("irregular", False)
    assert clock.time is stamps
    assert rate_error(clock, step) < 2e-3


def test_a_loop_without_a_clock_is_believed(taken):
    step, time, rng = taken
    stamps = 5.0 + np.cumsum(step * rng.uniform(0.7, 1.3, time.size))
    clock = sample_clock(stamps, motion(stamps, rng))
    assert (clock.kind, clock.repaired) == ("irregular", False)
    assert clock.step == pytest.approx(float(np.diff(stamps).mean()), rel=1e-9)


def test_without_motion_scattered_stamps_stay(taken):
    step, time, rng = taken
    stamps = time + step * rng.uniform(-0.3, 0.3, time.size)
    clock = sample_clock(stamps, rng.normal(0.0, 1e-3, (time.size, 3)))
    assert not clock.repaired
    assert clock.kind in ("jitter", "irregular")


def delivered(time, size, rng, late):
    """Stamps of packets: those of the last sample, and the delay of the delivery."""
    count = time.size // size * size
    ends = time[:count][size - 1 :: size] + rng.exponential(late, count // size)
    return np.repeat(ends, size) + np.tile(np.arange(size) * 1e-6, count // size), count


@pytest.mark.parametrize(("size", "late"), [(4, 0.05), (10, 0.05), (20, 0.05), (10, 0.0)])
def test_packets_are_spread_over_their_interval(taken, size, late):
    """Also of deliveries that are never late: those are at the steps of a clock."""
    step, time, rng = taken
    stamps, count = delivered(time, size, rng, late * step)
    clock = sample_clock(stamps, motion(time[:count], rng))
    assert (clock.kind, clock.repaired, clock.lost) == ("bursts", True, 0)
    assert rate_error(clock, step) < 1e-3
    off = clock.time - time[:count]
    assert np.std(off) < 0.05 * step
    # Delays of delivery are not seen; they are shorter than a step.
    assert abs(np.mean(off)) < 0.2 * step


@pytest.mark.parametrize("held_up", [0.0, 60.0])
def test_samples_lost_from_packets_are_counted(taken, held_up):
    step, time, rng = taken
    stamps, count = delivered(time, 10, rng, 0.05 * step)
    # What came in that time comes at its end, one packet after the other.
    end = time[0] + 15.0 + held_up * step
    late = (stamps > time[0] + 15.0) & (stamps < end)
    stamps[late] = end - 0.1 * (end - stamps[late])
    here = rng.random(count) > 0.05
    clock = sample_clock(stamps[here], motion(time[:count][here], rng))
    # Beside a delay losses are seen, but not their number: deliveries that catch up may be some.
    assert clock.lost > 0
    if held_up == 0.0:
        assert rate_error(clock, step) < 1e-3
        # Of a burst whose last sample is lost the end is not seen.
        assert clock.lost == pytest.approx(int((~here).sum()), rel=0.05)


@pytest.mark.parametrize("count", [1, 2, 5])
def test_few_samples_have_the_rate_of_their_steps(count):
    clock = sample_clock(np.arange(count) * 0.02)
    assert clock.number.tolist() == list(range(count))
    assert clock.rate_hz == pytest.approx(50.0 if count > 1 else 1.0)


@pytest.mark.parametrize("count", [5, 50])
def test_stamps_that_do_not_advance_have_a_rate(count):
    """One per second, so that no rate is infinite."""
    clock = sample_clock(np.full(count, 3.0))
    assert (clock.step, clock.kind, clock.rate_hz) == (1.0, "even", 1.0)


def test_a_part_of_a_record_keeps_its_gaps_and_numbers():
    time = np.concatenate([np.arange(100), 500 + np.arange(100)]) * 0.01
    clock = sample_clock(time)
    part = clock.of(time[40:150])
    assert [g.sample for g in part.gaps] == [60]
    np.testing.assert_array_equal(part.number, clock.number[40:150])
    assert clock.of(time[120:]).gaps == ()


def test_a_clock_that_was_set_is_one_gap():
    time = np.concatenate([np.arange(500) * 0.01, 1.7e9 + np.arange(500) * 0.01])
    clock = sample_clock(time)
    assert clock.rate_hz == pytest.approx(100.0, rel=1e-6)
    assert [gap.sample for gap in clock.gaps] == [500]
    assert not clock.repaired


def test_a_timer_without_a_whole_number_of_samples_loses_none():
    """A delivery each 0.104 s of 100 Hz: ten samples, or eleven."""
    step, count = 0.01, 6000
    time = 5.0 + step * np.arange(count)
    deliveries = 0.104 * np.ceil(time / 0.104)
    clock = sample_clock(deliveries)
    assert clock.step == pytest.approx(step, rel=1e-3)
    assert clock.lost == 0


def read_by_a_program(time, interval, stalls, rng):
    """Stamps of a program that reads a buffer, at uneven intervals and late at some instants.

    It takes at most three intervals' samples at once, and reads again at once until none is left.
    """
    step = time[1] - time[0]
    stamps, row, now, stalls = np.empty(time.size), 0, time[0] + interval, list(stalls)
    while row < time.size:
        if stalls and now >= stalls[0][0]:
            now += stalls.pop(0)[1]
        here = int(np.searchsorted(time, now, "right")) - row
        count = min(here, round(3 * interval / step))
        stamps[row : row + count] = now + 0.05 * step * np.arange(count)
        row += count
        now += interval * (0.3 if here > count else rng.uniform(0.9, 1.1))
    return stamps


#: When a program is held up, as a part of the record, and for how many of its intervals.
STALLS = {
    "none": [],
    "at the start": [(0.0, 4.0)],
    "three": [(0.0, 4.0), (0.6, 6.0), (0.8, 10.0)],
}


@pytest.mark.parametrize("rate", RATES)
@pytest.mark.parametrize("interval", [7.3, 13.0])
@pytest.mark.parametrize("resumed", [0, 100, 1000])
@pytest.mark.parametrize("stalls", STALLS)
def test_turns_are_as_large_on_the_clock_of_bursts_as_on_that_of_the_sensor(
    rate, interval, resumed, stalls
):
    """A program that is held up delivers late and loses nothing; a pause is no delay."""
    count, step = 4000, 1.0 / rate
    number = np.arange(count)
    pause = 1000 if resumed else 0
    time = 5.0 + step * (1.0 + 50e-6) * (number + pause * (number >= resumed))
    rng = np.random.default_rng(1)
    late = [(time[0] + at * count * step, n * interval * step) for at, n in STALLS[stalls]]
    rates = motion(time, rng) + np.array([0.5, 0.0, 0.0])
    clock = sample_clock(read_by_a_program(time, interval * step, late, rng), rates)
    assert (clock.kind, clock.repaired, clock.lost) == ("bursts", True, 0)
    assert clock.begins.tolist() == ([0, resumed] if resumed else [0])
    # A delivery comes at any instant in the step after its last sample.
    off = clock.time - time
    off -= np.median(off)
    assert np.abs(off).max() < 0.5 * step
    for a, b in clock.stretches:
        on_clock, true = (np.trapezoid(rates[a:b], t[a:b], axis=0) for t in (clock.time, time))
        # Integrated by parts: that error of the clock times all changes of the rate, ends included.
        ends = np.abs(rates[[a, b - 1]]).sum(axis=0)
        change = ends + np.abs(np.diff(rates[a:b], axis=0)).sum(axis=0)
        assert (np.abs(on_clock - true) < 0.5 * step * change).all()


def test_bursts_of_samples_that_were_taken_so_keep_their_stamps(taken):
    """Five samples a fifth of a step apart, and a pause: stamps that are right and uneven."""
    step, time, rng = taken
    stamps = time[: time.size // 5 * 5 : 5, None] + 0.2 * step * np.arange(5)
    stamps = stamps.ravel()
    clock = sample_clock(stamps, motion(stamps, rng))
    assert not clock.repaired
    assert clock.time is stamps
