"""A crash detected while samples arrive: the same bits however cut, the truth in bounds."""

import json
import math

import numpy as np
import pytest
from tests.coded import coded

from strapdown._kernels import crash_trigger as kernel
from strapdown.crash.events import PART_563, EventDetector
from strapdown.crash.watch import Z95, CrashLog, WatchOptions
from strapdown.errors import DataError
from strapdown.report.crash_live import watch_rows

GRAVITY = 9.80665
OPTIONS = WatchOptions(
    errors=(0.02, 0.01, 0.005, 0.01, 0.01, 0.02), full_scale=(500.0, 500.0, None), gyro=True
)


def drive(seconds, rate, rng, noise=0.0):
    """Stamps and rows of rates and forces of a level vehicle at constant speed."""
    time = np.arange(round(seconds * rate)) / rate
    rows = np.zeros((len(time), 6))
    rows[:, 3:] = rng.normal((0.0, 0.0, -GRAVITY), noise, (len(time), 3))
    return time, rows


def pulse(time, begin, length, change):
    """Mean forces over the steps of a half sine, so that their integral has no error."""
    u = np.clip((time - begin) / length, 0.0, 1.0)
    velocity = np.outer(0.5 - 0.5 * np.cos(np.pi * u), change)
    return (
        np.diff(velocity, axis=0, prepend=0.0) / np.diff(time, prepend=time[0] - time[1])[:, None]
    )


def estimates(options, time, rows, every=0.0):
    return watch_rows(options, np.column_stack([time, rows]).tolist(), every).lines


def crash(seed=1, change=(-12.0, 4.0), rate=1000, mean=True):
    time, rows = drive(4.0, rate, np.random.default_rng(seed), 0.3)
    rows[:, 3:5] += pulse(time, 3.0, 0.1, change)
    return time, rows


def test_thresholds_are_those_of_the_regulation():
    assert (PART_563.trigger, PART_563.trigger_window) == (kernel.TRIGGER, kernel.WINDOW)
    assert (PART_563.wake, PART_563.wake_window) == (kernel.WAKE, kernel.WAKE_WINDOW)


def test_no_later_sample_counts_and_a_cut_anywhere_gives_the_same_bits():
    time, rows = crash()
    whole = json.dumps(estimates(OPTIONS, time, rows))
    for end in (3040, 3060, 3100, 3200):
        part = json.dumps(estimates(OPTIONS, time[:end], rows[:end]))
        assert whole.startswith(part[:-1]), end
    log = CrashLog(OPTIONS, 0.0)
    rng = np.random.default_rng(0)
    for piece in np.split(np.arange(len(time)), np.sort(rng.integers(0, len(time), 9))):
        for k in piece:
            log.take(float(time[k]), rows[k].tolist())
    assert json.dumps(log.lines) == whole


def test_delta_v_of_a_mean_sampled_pulse_is_exact_and_so_is_its_direction():
    time, rows = drive(4.0, 1000, np.random.default_rng(0))
    rows[:, 3:5] += pulse(time, 3.0, 0.1, (-12.0, 4.0))
    options = WatchOptions(mean=True, gyro=True)
    found = estimates(options, time, rows)
    assert [found[0]["status"], found[-1]["status"]] == ["trigger", "ended"]
    last = found[-1]
    # Rounding of some 4000 additions of numbers up to 12 m/s.
    assert last["delta_v_forward_m_per_s"] == pytest.approx(-12.0, abs=1e-11)
    assert last["delta_v_right_m_per_s"] == pytest.approx(4.0, abs=1e-11)
    # Time zero is at most 20 ms before the first sample of the pulse: nothing is lost.
    assert last["pdof_deg"] == pytest.approx(math.degrees(math.atan2(-4.0, 12.0)), abs=1e-9)
    assert last["pdof_clock"] == 11
    assert found[-1]["time_s"] - found[0]["time_s"] < 0.25


@pytest.mark.parametrize("seed", range(5))
def test_the_trigger_is_the_first_sample_after_that_of_the_regulation(seed):
    rng = np.random.default_rng(seed)
    time, rows = drive(4.0, 1000, rng)
    rows[:, 3:5] += pulse(time, 3.0, rng.uniform(0.02, 0.14), rng.uniform(-12.0, -4.0, 2))
    detector = EventDetector(sampling="mean")
    detector.extend(time, rows[:, 3:] + (0.0, 0.0, GRAVITY))
    event = (*detector.events, detector.current)[0]
    found = estimates(WatchOptions(mean=True, gyro=True), time, rows)[0]
    # The window of 150 ms ends within a slot, of which it takes the same share: one step apart.
    assert -1e-9 <= found["time_s"] - event.trigger <= 0.001 + 1e-9


def test_yaw_is_taken_out_and_without_a_gyro_it_widens_the_bound():
    """A vehicle that turns at 2 rad/s while a constant force over ground pushes it rearward."""
    time, rows = drive(4.0, 1000, np.random.default_rng(0))
    since = np.clip(time - 3.0, 0.0, 0.1)
    yaw, push = 2.0 * since, np.diff(since, prepend=0.0) * 1000 * -100.0
    middle = yaw - np.diff(yaw, prepend=0.0) / 2
    rows[:, 2] = np.diff(yaw, prepend=0.0) * 1000
    rows[:, 3], rows[:, 4] = push * np.cos(middle), -push * np.sin(middle)
    straight = estimates(WatchOptions(mean=True, gyro=True), time, rows)[-1]
    # What turned before time zero was known, at most 20 ms, is not turned back.
    assert straight["pdof_deg"] == pytest.approx(0.0, abs=math.degrees(2.0 * 0.02))
    blind = estimates(WatchOptions(mean=True), time, rows[:, 3:])[-1]
    low, high = blind["pdof_deg_bound"]
    assert low <= 0.0 <= high
    assert abs(blind["pdof_deg"]) > 4.0


def test_a_clipped_axis_makes_at_least():
    time, rows = crash(change=(-30.0, 6.0))
    options = WatchOptions(full_scale=(300.0, None, None), gyro=True)
    rows[:, 3] = np.clip(rows[:, 3], -300.0, 300.0)
    last = estimates(options, time, rows)[-1]
    assert last["at_least"]
    assert last["delta_v_m_per_s_bound"][1] is None
    assert last["delta_v_forward_m_per_s_bound"][0] is None
    assert None not in last["delta_v_right_m_per_s_bound"]
    low, high = last["pdof_deg_bound"]
    assert low <= math.degrees(math.atan2(-6.0, 30.0)) <= high
    first = estimates(options, time, rows)[0]
    assert not first["at_least"], "it was not clipped yet"
    before = rows.copy()
    before[:2000, 3] = 300.0 * np.where(np.arange(2000) % 2, 1.0, -1.0)
    before[3000:, 3] = rows[3000:, 3].clip(-290.0, 290.0)
    assert not estimates(options, time, before)[-1]["at_least"], "what was clipped is long past"


@pytest.mark.parametrize("length", [0.02, 0.04])
def test_a_gap_in_the_pulse_widens_the_bound_and_a_long_one_interrupts(length):
    time, rows = crash(change=(-12.0, 0.0))
    there = (time < 3.05) | (time > 3.05 + length)
    whole = estimates(OPTIONS, time, rows)[-1]
    last = estimates(OPTIONS, time[there], rows[there])[-1]
    low, high = last["delta_v_m_per_s_bound"]
    assert low <= 12.0 <= high
    assert high - low > 2.0 * np.ptp(whole["delta_v_m_per_s_bound"])
    there = (time < 3.05) | (time > 3.05 + 0.16)
    lost = estimates(OPTIONS, time[there], rows[there])
    assert [line["status"] for line in lost if line["status"] != "event"][-1] == "interrupted"


def test_wrong_stamps_change_nothing_and_a_new_clock_is_taken_after_three():
    time, rows = crash()
    plain, disturbed = CrashLog(OPTIONS), CrashLog(OPTIONS)
    for k in range(len(time)):
        plain.take(float(time[k]), rows[k].tolist())
        disturbed.take(float(time[k]), rows[k].tolist())
        with pytest.raises(DataError, check=coded("crash.time-does-not-advance-not")):
            disturbed.take(float(time[k]), rows[k].tolist())
        with pytest.raises(DataError, check=coded("crash.time-acceleration-not-finite")):
            disturbed.take(float(time[k]) + 1e-5, [math.nan] * 6)
    assert disturbed.lines == plain.lines
    # One stamp far ahead; then the clock goes on as before.
    rows_ahead = np.column_stack([time, rows]).tolist()
    rows_ahead[1000][0] += 1e4
    log = watch_rows(OPTIONS, rows_ahead, 0.0)
    assert log.watch.resets == 1
    assert [len(record) for record in log.records(np.array(rows_ahead))] == [1001, len(time) - 1003]
    assert log.lines[-1]["status"] == "ended"
    assert log.watch.events == 1


@pytest.mark.parametrize("rate", [100, 1000])
def test_what_is_no_crash_does_not_trigger(rate):
    time, rows = drive(12.0, rate, np.random.default_rng(5), 0.3)
    # Full braking on dry asphalt, built up in 0.1 s, and released.
    braking = np.interp(time, [2.0, 2.1, 4.0, 4.1], [0.0, -1.1 * GRAVITY, -1.1 * GRAVITY, 0.0])
    rows[:, 3] += braking
    # Doors: 10 g at 40 Hz, dying away within 30 ms, from the side.
    since = np.clip(time - 6.0, 0.0, None)
    rows[:, 4] += 10.0 * GRAVITY * np.sin(2 * np.pi * 40.0 * since) * np.exp(-since / 0.03)
    # A pothole at 15 m/s: the wheel's edge takes 1 m/s of velocity, and gives 0.5 back; 5 g down.
    rows[:, 3:5] += pulse(time, 8.0, 0.02, (-1.0, 0.3)) + pulse(time, 8.05, 0.03, (0.5, -0.3))
    rows[:, 5] += 5.0 * GRAVITY * np.sin(np.pi * np.clip((time - 8.0) / 0.04, 0.0, 1.0))
    watch = watch_rows(WatchOptions(gyro=True), np.column_stack([time, rows]).tolist(), 0.01).watch
    assert watch.events == 0
    # Braking comes nearest: 1.1 g over 150 ms, and noise.
    assert watch.largest_change < 1.1 * GRAVITY * 0.150 + 0.2


@pytest.mark.slow
@pytest.mark.parametrize("rate", [200, 1000])
def test_the_bounds_hold_the_truth_in_95_percent(rate):
    """Drawn crashes with the errors that are stated and assumed: coverage of 1000 draws.

    The record begins 0.1 s before: nothing was learnt of bias and slope, so that their bound is
    that of the draw.
    """
    from scipy.stats import binom

    rng = np.random.default_rng(20)
    density, scale, cross, lean, face, gyro = OPTIONS.errors
    options = WatchOptions(errors=OPTIONS.errors, gyro=True, mean=True)
    inside, count = np.zeros(4), 1000
    for _ in range(count):
        time, rows = drive(0.4, rate, rng)
        angle, size = rng.uniform(0.0, 2 * np.pi), rng.uniform(6.0, 18.0)
        change = size * np.array([math.cos(angle), math.sin(angle), rng.uniform(-0.2, 0.2)])
        rows[:, 3:] += pulse(time, 0.1, rng.uniform(0.05, 0.13), change)
        rows[:, 2] += rng.normal(0.0, gyro)
        tilt, yaw = rng.normal(0.0, lean, 2), rng.normal(0.0, face)
        misaligned = rng.normal(0.0, cross, (3, 3)) * (1.0 - np.eye(3))
        turn = np.array([[0, yaw, -tilt[1]], [-yaw, 0, tilt[0]], [tilt[1], -tilt[0], 0]])
        errors = np.eye(3) + np.diag(rng.normal(0.0, scale, 3)) + misaligned + turn
        bias = rng.normal(0.0, math.sqrt(OPTIONS.variance), 2)
        rows[:, 3:] = rows[:, 3:] @ errors.T
        rows[:, 3:5] += bias
        # Pitching and rolling from the contact on.
        rates = rng.normal(0.0, kernel.TILTING, 2)
        rows[:, 3:5] += GRAVITY * np.clip(time - 0.1, 0.0, None)[:, None] * rates
        rows[:, 3:] += rng.normal(0.0, density * math.sqrt(rate), (len(time), 3))
        last = estimates(options, time, rows, 1.0)[-1]
        off = (math.degrees(math.atan2(-change[1], -change[0])) - last["pdof_deg_bound"][0]) % 360
        within = [off <= np.ptp(last["pdof_deg_bound"])]
        truth = (change[0], change[1], math.hypot(change[0], change[1]))
        for name, true in zip(("forward_", "right_", ""), truth, strict=True):
            low, high = last[f"delta_v_{name}m_per_s_bound"]
            within.append(low <= true <= high)
        inside += within
    low, high = binom.interval(0.99, count, 0.95)
    print(rate, inside / count)
    assert ((low <= inside) & (inside <= high)).all(), (inside, low, high)
    assert pytest.approx(1.959964, abs=1e-6) == Z95
