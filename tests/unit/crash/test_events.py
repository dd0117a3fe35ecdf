"""Time zero, trigger and end against closed forms; what is a crash and what is not."""

import math
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.coded import coded

sys.path.insert(0, str(Path(__file__).parent))

from pulses import KMH, Pulse, means, stamps

from strapdown.crash.acceleration import Acceleration
from strapdown.crash.events import PART_563, EventRule, detect_events
from strapdown.errors import ConfigError, DataError

FRONT = Pulse((-7.2, 0.0, 0.0))


def found(pulses, rate=1000.0, rule=PART_563, sampling="instantaneous", **more):
    time = stamps(rate)
    values = means(pulses, time) if sampling == "mean" else sum(p.accel(time) for p in pulses)
    return detect_events(Acceleration(time, values, sampling=sampling), rule, **more)


def time_bound(pulse, t, w, rate):
    """Error of an instant from the trapezoid: that of the change, over its slope.

    The change over a window is off by at most h²/12 times the difference of the jerks at its ends,
    2 max|a'|; a line between two samples adds as much again at most (h³/12 a'' within one step).
    """
    h = 1.0 / rate
    return 2.0 * (h * h / 12.0) * 2.0 * pulse.jerk_most() / abs(pulse.slope(t, w))


@pytest.mark.parametrize("rate", [200.0, 1000.0, 10000.0])
def test_time_zero_trigger_and_end_of_a_haversine_are_those_of_its_closed_form(rate):
    (event,) = found([FRONT], rate).events
    size = 7.2
    woke, trigger = FRONT.up(0.020, 0.8 * KMH / size), FRONT.up(0.150, 8.0 * KMH / size)
    end = FRONT.down(0.020, 0.8 * KMH / size)
    assert event.woken == pytest.approx(woke, abs=time_bound(FRONT, woke, 0.020, rate))
    assert event.time_zero == pytest.approx(woke - 0.020, abs=time_bound(FRONT, woke, 0.020, rate))
    assert event.trigger == pytest.approx(trigger, abs=time_bound(FRONT, trigger, 0.150, rate))
    assert event.end == pytest.approx(end, abs=time_bound(FRONT, end, 0.020, rate))
    assert (event.basis, event.trigger_axis) == ("longitudinal", "longitudinal")
    assert not event.starts_before_record and not event.lasts_beyond_record
    # The crest, 2 D/T, is within half a step of a sample.
    crest = 2.0 * size / FRONT.length
    drop = crest * (np.pi * 0.5 / rate / FRONT.length) ** 2
    assert crest - drop <= event.peak <= crest * (1.0 + 1e-12)
    assert abs(event.peak_time - FRONT.length / 2.0) <= 0.5 / rate + 1e-12


def test_the_error_of_time_zero_is_of_the_second_order_in_the_step():
    woke = FRONT.up(0.020, 0.8 * KMH / 7.2)
    # Rates at which the pulse begins on a sample and the window is whole samples, so that the
    # constant of the order does not change.
    rates = np.array([200.0, 400.0, 800.0, 1600.0])
    errors = [abs(found([FRONT], r).events[0].woken - woke) for r in rates]
    order = -np.polyfit(np.log(rates), np.log(errors), 1)[0]
    # A line within the step changes the constant from rate to rate: a quarter of an order.
    assert order == pytest.approx(2.0, abs=0.25)


def test_means_give_crossings_that_fall_on_stamps_exactly():
    # 1250 Hz: the window of 20 ms is 25 samples; with the level set to what the closed form has
    # at a stamp, nothing is left between the stamps, and means are exact there.
    time = stamps(1250.0)
    k = int(np.searchsorted(time, 0.030))
    rule = EventRule(wake=7.2 * float(FRONT.window(time[k], 0.020)))
    (event,) = found([FRONT], 1250.0, rule, "mean").events
    # Rounding of a running sum of a thousand terms of 1e-2 m/s, over a slope of 60 m/s².
    assert event.woken == pytest.approx(time[k], abs=1e-14)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_side_impact_is_told_within_five_milliseconds(side):
    pulse = Pulse((0.0, side * 6.0, 0.0), length=0.080)
    (event,) = found([pulse], 10000.0).events
    woke = pulse.up(0.005, 0.8 * KMH / 6.0)
    assert event.woken == pytest.approx(woke, abs=time_bound(pulse, woke, 0.005, 1e4))
    assert event.time_zero == pytest.approx(woke - 0.005, abs=time_bound(pulse, woke, 0.005, 1e4))
    assert (event.basis, event.trigger_axis) == ("lateral", "lateral")


def test_a_slow_side_impact_takes_time_zero_from_the_resultant():
    # 30 m/s² at its crest: never 0.8 km/h within 5 ms, yet 8 km/h within 150 ms.
    pulse = Pulse((0.0, 2.4, 0.0), length=0.160)
    (event,) = found([pulse], 10000.0).events
    woke = pulse.up(0.020, 0.8 * KMH / 2.4)
    assert event.basis == "resultant"
    assert event.woken == pytest.approx(woke, abs=time_bound(pulse, woke, 0.020, 1e4))
    assert not found([pulse], 10000.0, EventRule(lateral=False)).events


def test_the_end_is_that_of_the_resultant():
    ahead, aside = Pulse((-6.0, 0.0, 0.0)), Pulse((0.0, -4.0, 0.0), 0.05, 0.12)
    (event,) = found([ahead, aside], 10000.0).events
    level = 0.8 * KMH
    grid = np.arange(0.1, 0.2, 1e-6)
    size = np.hypot(6.0 * ahead.window(grid, 0.02), 4.0 * aside.window(grid, 0.02))
    end = grid[np.flatnonzero(size > level)[-1]]
    assert event.end == pytest.approx(end, abs=2e-6)


def test_a_wake_up_system_takes_its_own_level():
    level = 20.0
    (event,) = found([FRONT], 10000.0, EventRule(wake_acceleration=level)).events
    x = np.arccos(1.0 - level * FRONT.length / 7.2) / (2.0 * np.pi)
    # A chord lies at most h²/8 max|a''| off, over the slope there.
    bound = (
        1e-8
        / 8.0
        * (2.0 * np.pi / FRONT.length) ** 2
        / (2.0 * np.pi / FRONT.length * np.sin(2.0 * np.pi * x))
    )
    assert event.basis == "acceleration"
    assert event.time_zero == pytest.approx(x * FRONT.length, abs=bound)


def test_time_zero_is_where_the_threshold_is_reached_on_demand():
    begin, late = (
        found([FRONT], rule=EventRule(zero_at=z)).events[0] for z in ("interval", "threshold")
    )
    assert late.time_zero == late.woken == begin.woken
    # 20 ms apart, but for the rounding of one subtraction.
    assert late.time_zero - begin.time_zero == pytest.approx(0.020, abs=1e-16)
    assert late.time_zero_sd == begin.time_zero_sd and late.end == begin.end


def test_two_impacts_are_two_events_of_one_crash_and_a_dip_is_held_together_on_demand():
    pulses = [Pulse((-5.0, 0.0, 0.0), 0.0, 0.08), Pulse((-5.0, 0.0, 0.0), 0.13, 0.08)]
    search = found(pulses, 2000.0)
    assert len(search.events) == 2 and [len(c) for c in search.crashes] == [2]
    # The same pulse 0.13 s later, on the same phase of the samples (0.13 s are 260 of them).
    first, second = (e.time_zero for e in search.events)
    assert second - first == pytest.approx(0.13, abs=1e-12)
    small = search.events[1].woken - search.events[0].end
    (held,) = found(pulses, 2000.0, EventRule(quiet=small + 1e-9)).events
    assert len(found(pulses, 2000.0, EventRule(quiet=small - 1e-9)).events) == 2
    assert held.time_zero == search.events[0].time_zero
    assert held.end == pytest.approx(search.events[1].end, abs=1e-12)


def test_events_of_two_crashes_are_kept_apart():
    time = np.arange(0.0, 12.0, 1e-3)
    pulses = [Pulse((-5.0, 0.0, 0.0), s, 0.1) for s in (1.0, 5.5, 6.2, 10.9)]
    search = detect_events(Acceleration(time, sum(p.accel(time) for p in pulses)))
    assert [len(c) for c in search.crashes] == [2, 2]


def not_a_crash(name):
    time = np.arange(-1.0, 8.0, 1e-3)
    values = np.zeros((len(time), 3))
    inside = lambda start, length: np.clip((time - start) / length, 0.0, 1.0)  # noqa: E731
    half_sine = lambda start, length: np.sin(np.pi * inside(start, length))  # noqa: E731
    g = 9.80665
    if name == "hard braking":
        values[:, 0] = -0.9 * g * inside(0.0, 0.1) * (1.0 - inside(4.0, 0.1))
    elif name == "pothole":
        values[:, 0], values[:, 2] = -5.0 * g * half_sine(1.0, 0.015), 8.0 * g * half_sine(1, 0.02)
    elif name == "kerb":
        values[:, 1] = 6.0 * g * half_sine(1.0, 0.030) - 2.0 * g * half_sine(1.03, 0.04)
    elif name == "door slam":
        values[:, 1] = 20.0 * g * half_sine(1.0, 0.003) - 20.0 * g * half_sine(1.004, 0.003)
    return Acceleration(time, values, source="unit 1")


@pytest.mark.parametrize("name", ["hard braking", "pothole", "kerb", "door slam"])
def test_what_is_no_crash_is_none_and_says_how_far_it_went(name):
    search = detect_events(not_a_crash(name))
    assert search.events == ()
    (finding,) = search.findings
    assert finding.file == "unit 1" and "no crash was found" in finding.what and finding.remedy
    if name == "hard braking":
        # 0.9 g for 150 ms, exactly; and 0.64 km/h within 20 ms wakes nothing.
        assert search.largest_change == pytest.approx(0.9 * 9.80665 * 0.15, rel=1e-12)
        assert search.woken == 0 and search.largest_time == pytest.approx(0.25, abs=2e-3)
    else:
        assert search.woken >= (0 if name == "door slam" else 1)
    with pytest.raises(DataError, check=coded("crash.no-event-perhaps-in-g")):
        search.first  # noqa: B018


@pytest.mark.parametrize("sampling", ["instantaneous", "mean"])
def test_a_record_that_ends_within_a_blow_is_at_least_what_it_has(sampling):
    # Constant 60 m/s² from 0 s, at 40 deg: neither component reaches 8 km/h within 45 ms.
    time = np.arange(-1.0, 0.045 + 5e-4, 1e-3)
    direction = np.array([math.cos(math.radians(40.0)), math.sin(math.radians(40.0)), 0.0])
    values = 60.0 * (time > 5e-4)[:, None] * direction
    search = detect_events(Acceleration(time, values, sampling=sampling))
    assert search.events == ()
    # Trapezoids count half of the step at the onset.
    length = 0.045 - (0.0005 if sampling == "instantaneous" else 0.0)
    assert search.cut_change == pytest.approx(60.0 * length, rel=1e-9)
    (finding,) = search.findings
    assert finding.code == "crash.no-event-yet" and finding.severity == "warning"
    assert finding.data["cut"] == pytest.approx(3.6 * search.cut_change)
    # Only what the regulation's end would end is over: 30 ms later the record says nothing of it.
    later = np.arange(-1.0, 0.075 + 5e-4, 1e-3)
    over = np.where((later < 0.0305)[:, None], 60.0 * (later > 5e-4)[:, None] * direction, 0.0)
    whole = detect_events(Acceleration(later, over, sampling=sampling))
    assert whole.cut_change == 0.0 and whole.findings[0].code != "crash.no-event-yet"


def test_a_trigger_reached_after_the_spike_is_told_by_the_spike():
    # Braking at 10 m/s² wakes nothing; a spike within it does, and the two together are 8 km/h.
    time = np.arange(-1.0, 1.0, 1e-4)
    values = np.zeros((len(time), 3))
    values[time >= -0.08, 0] = -10.0
    spike = Pulse((-0.8, 0.0, 0.0), 0.0, 0.015)
    values += spike.accel(time)
    (event,) = detect_events(Acceleration(time, values)).events
    assert event.woken < 0.02 < event.trigger
    assert event.end == event.trigger and np.isnan(event.end_sd)
    (held,) = detect_events(Acceleration(time, values), EventRule(quiet=0.2)).events
    assert held.end == held.trigger == event.trigger and np.isnan(held.end_sd)


@pytest.mark.parametrize("sampling", ["instantaneous", "mean"])
def test_the_uncertainty_of_time_zero_is_that_of_noisy_records(sampling):
    rng = np.random.default_rng(3)
    time, noise, runs = stamps(1000.0), 1.0, 400
    values = FRONT.accel(time)
    zeros, ends = [], []
    for _ in range(runs):
        noisy = values + rng.normal(0.0, noise, values.shape)
        search = detect_events(Acceleration(time, noisy, sampling=sampling), noise=noise)
        zeros.append(search.events[0].time_zero)
        ends.append(search.events[-1].end)
    event = found([FRONT], sampling=sampling, noise=noise).events[0]
    # A standard deviation of 400 runs is known to 3.5 %; four of these.
    assert np.std(zeros) == pytest.approx(event.time_zero_sd, rel=0.14)
    assert np.std(ends) == pytest.approx(event.end_sd, rel=0.14)


def test_a_bias_moves_time_zero_by_its_change_over_the_slope():
    bias = 0.05
    event = found([FRONT], 1000.0, bias_sd=bias).events[0]
    time = stamps(1000.0)
    moved = detect_events(Acceleration(time, FRONT.accel(time) - [bias, 0.0, 0.0])).events[0]
    # The slope changes over the shift by its own relative change, under one part in a hundred.
    assert event.time_zero - moved.time_zero == pytest.approx(event.time_zero_sd, rel=0.01)


def test_a_record_that_begins_or_ends_in_the_crash_says_so():
    time = np.arange(0.03, 0.3, 1e-3)
    search = detect_events(Acceleration(time, FRONT.accel(time), source="unit 2"))
    event = search.first
    assert event.starts_before_record and event.time_zero == time[0]
    assert "the record begins within the event" in str(search.findings[0])
    time = stamps(1000.0, end=0.08)
    search = detect_events(Acceleration(time, FRONT.accel(time), source="unit 2"))
    assert search.first.lasts_beyond_record and search.first.end == time[-1]
    assert np.isnan(search.first.end_sd)
    assert "the record ends at 0.08 s" in str(search.findings[0])


def test_a_gap_in_the_event_is_named():
    time = stamps(1000.0)
    time = time[(time < 0.040) | (time > 0.055)]
    search = detect_events(Acceleration(time, FRONT.accel(time), source="unit 3"))
    (finding,) = search.findings
    # Samples at -0.100 … 0.040 less one: the one after the gap is the 141st or 142nd.
    assert finding.code == "crash.no-sample-ms-within-event" and finding.row in (141, 142)
    # From the last sample before 40 ms to the first after 55 ms, each within a step.
    assert 15.0 <= finding.data["length"] <= 17.0


def test_bad_input_is_refused_with_its_row():
    time = stamps(1000.0)
    values = FRONT.accel(time)
    values[17, 1] = np.nan
    with pytest.raises(
        DataError,
        check=coded("tables.not-finite-number", row=18, file="unit 4", quantity="accel_y"),
    ):
        Acceleration(time, values, source="unit 4")
    with pytest.raises(DataError, check=coded("crash.sample-change-velocity-needs-least")):
        Acceleration(time[:1], values[:1])
    ned = Acceleration(time, FRONT.accel(time), "ned")
    with pytest.raises(ConfigError, match="along"):
        detect_events(ned)
    assert detect_events(ned.along(0.0)).events == detect_events(replace(ned, frame="body")).events
    with pytest.raises(ConfigError, check=coded("crash.no-place-time-zero")):
        EventRule(zero_at="treshold")
    with pytest.raises(
        ConfigError, check=coded("crash.not-longer-than-windows-time", quantity="trigger_window")
    ):
        EventRule(trigger_window=0.01)


def test_a_record_in_g_gets_a_hint():
    time = stamps(1000.0)
    search = detect_events(Acceleration(time, FRONT.accel(time) / 9.80665))
    assert not search.events and "in g" in str(search.findings[0].remedy)


def test_a_record_that_is_too_short_says_so():
    time = np.arange(0.0, 0.05, 1e-3)
    search = detect_events(Acceleration(time, np.zeros((len(time), 3)), source="unit 5"))
    (finding,) = search.findings
    assert "only 49 ms long" in finding.what and "the velocity does not change" in finding.what
