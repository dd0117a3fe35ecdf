"""Events found live are those found in retrospect, wherever the record was cut."""

import numpy as np
import pytest
from tests.coded import coded

from strapdown.crash.acceleration import Acceleration
from strapdown.crash.events import PART_563, EventDetector, EventRule, detect_events
from strapdown.errors import DataError

RULES = {
    "part 563": PART_563,
    "longitudinal": EventRule(lateral=False),
    "quiet": EventRule(quiet=0.03),
    "wake-up": EventRule(wake_acceleration=20.0),
}


def rough_record(seed, spacing=(0.0002, 0.001, 0.005, 0.03)):
    """Irregular in time, with pulses of all sizes in both axes, spikes and noise."""
    rng = np.random.default_rng(seed)
    time = np.cumsum(rng.choice(spacing, 4000))
    values = rng.normal(0.0, 2.0, (len(time), 3))
    for _ in range(30):
        start, length = rng.uniform(0.0, time[-1]), rng.uniform(0.01, 0.2)
        x = np.clip((time - start) / length, 0.0, 1.0)
        values[:, :2] += np.outer((1.0 - np.cos(2 * np.pi * x)) / length, rng.normal(0.0, 4.0, 2))
    return time, values


@pytest.mark.parametrize("sampling", ["instantaneous", "mean"])
@pytest.mark.parametrize("name", list(RULES))
def test_cut_anywhere_and_continued_gives_the_same_bits(name, sampling):
    rng = np.random.default_rng(2)
    for seed in range(6):
        time, values = rough_record(seed)
        whole = EventDetector(RULES[name], sampling=sampling, noise=2.0)
        whole.extend(time, values)
        assert whole.events, "a record without events would show nothing"
        single = EventDetector(RULES[name], sampling=sampling, noise=2.0)
        for t, a in zip(time, values, strict=True):
            single.update(t, a)
        pieces = EventDetector(RULES[name], sampling=sampling, noise=2.0)
        cuts = np.sort(rng.integers(0, len(time), 9))
        for part in np.split(np.arange(len(time)), cuts):
            pieces.extend(time[part], values[part])
        for other in (single, pieces):
            assert repr(other.events) == repr(whole.events)
            assert repr(other.current) == repr(whole.current)
            assert other.largest_change == whole.largest_change
            assert other.woken == whole.woken


def test_retrospect_and_live_agree_and_no_sample_of_the_future_counts():
    time, values = rough_record(9)
    search = detect_events(Acceleration(time, values))
    live = EventDetector()
    seen = {}
    for k, (t, a) in enumerate(zip(time, values, strict=True)):
        for event in live.update(t, a):
            seen[event] = k
    assert [*seen] == [e for e in search.events if not e.lasts_beyond_record]
    for event, k in seen.items():
        # It is known at the first sample after its end, and not before.
        assert time[k - 1] <= event.end <= time[k]


def test_a_refused_sample_leaves_the_detector_as_it_was():
    time, values = rough_record(1)
    plain, disturbed = EventDetector(), EventDetector()
    for t, a in zip(time[:300], values[:300], strict=True):
        plain.update(t, a)
        disturbed.update(t, a)
        with pytest.raises(
            DataError,
            check=lambda refused: refused.finding.code == "crash.time-does-not-advance-not",
        ):
            disturbed.update(t, a)
        with pytest.raises(DataError, check=coded("crash.time-acceleration-not-finite")):
            disturbed.update(t + 1e-5, [np.nan, 0.0, 0.0])
        for odd in ([0.0, 0.0], 1.0, "abc", None):
            with pytest.raises(DataError, check=coded("crash.stamps-shape-accelerations-shape")):
                disturbed.update(t + 1e-5, odd)
    assert plain.events == disturbed.events and plain.largest_change == disturbed.largest_change


def test_an_event_is_seen_while_it_lasts():
    time = np.arange(-0.1, 0.3, 0.001)
    x = np.clip(time / 0.1, 0.0, 1.0)
    live = EventDetector()
    first = None
    for t, ax in zip(time, -60.0 * (1.0 - np.cos(2 * np.pi * x)), strict=True):
        live.update(t, [ax, 0.0, 0.0])
        if first is None and live.triggered:
            first = t
            assert live.current is not None and live.current.trigger <= t
    (event,) = live.events
    # Known by the sample after it.
    assert first is not None and event.trigger <= first <= event.trigger + 0.001


def changes_on(grid, time, values):
    """Changes over 150, 20 and 5 ms that end on a grid, and the velocity itself."""
    rise = 0.5 * (values[1:, :2] + values[:-1, :2]) * np.diff(time)[:, None]
    velocity = np.concatenate([np.zeros((1, 2)), np.cumsum(rise, axis=0)])

    def at(t):
        t = np.clip(t, time[0], time[-1])
        k = np.clip(np.searchsorted(time, t, side="right") - 1, 0, len(time) - 2)
        u = (t - time[k])[:, None]
        slope = (values[k + 1, :2] - values[k, :2]) / (time[k + 1] - time[k])[:, None]
        return velocity[k] + values[k, :2] * u + 0.5 * slope * u * u

    return at, at(grid), *(at(grid) - at(grid - w) for w in (0.020, 0.005))


def from_the_text(time, values, step, rule=PART_563):
    """Time zero, trigger and end of all events, on a grid, written again from 49 CFR 563.5(b)."""
    grid = np.arange(time[0], time[-1], step)
    at, velocity, wake, side = changes_on(grid, time, values)
    large = np.hypot(*wake.T) > rule.wake
    found, floor, k = [], time[0], 0
    while k < len(grid):
        change = velocity - at(np.maximum(grid - rule.trigger_window, floor))
        hit = np.flatnonzero((np.abs(change) >= rule.trigger).any(axis=1) & (grid > floor))
        if not hit.size:
            break
        trigger = hit[0]
        # The last stretch of a large resultant that had begun by then.
        small = np.flatnonzero(~large[:trigger])
        begin = small[-1] + 1 if large[trigger] else np.flatnonzero(large[:trigger])[-1]
        while begin > 0 and large[begin - 1]:
            begin -= 1
        quiet = np.flatnonzero(~large[trigger:])
        end = trigger + quiet[0] if quiet.size else len(grid) - 1
        woke = np.flatnonzero(np.abs(wake[begin : trigger + 1, 0]) > rule.wake)
        aside = np.flatnonzero(np.abs(side[begin : trigger + 1, 1]) > rule.wake)
        firsts = [grid[begin + w[0]] - d for w, d in ((woke, 0.020), (aside, 0.005)) if w.size]
        zero = min(firsts) if firsts else grid[begin] - 0.020
        found.append((max(zero, time[0]), grid[trigger], grid[end]))
        floor, k = grid[end], end + 1
    return found


def test_against_a_grid_written_again_from_the_text():
    events = 0
    for seed in range(8):
        rng = np.random.default_rng(100 + seed)
        time = np.cumsum(rng.choice([0.0005, 0.002, 0.005], 900))
        values = np.zeros((len(time), 3))
        for _ in range(5):
            start, length = rng.uniform(0.05, 0.9) * time[-1], rng.uniform(0.05, 0.15)
            x = np.clip((time - start) / length, 0.0, 1.0)
            angle = rng.uniform(0.0, 2.0 * np.pi)
            rise = rng.uniform(1.0, 8.0) * (1.0 - np.cos(2 * np.pi * x)) / length
            values[:, :2] += np.outer(rise, [np.cos(angle), np.sin(angle)])
        step = 5e-5
        known = from_the_text(time, values, step)
        search = detect_events(Acceleration(time, values))
        assert len(search.events) == len(known)
        for event, (zero, trigger, end) in zip(search.events, known, strict=True):
            events += 1
            # A step of the grid late, and another for its rounding.
            assert event.trigger == pytest.approx(trigger, abs=2 * step)
            assert event.end == pytest.approx(end, abs=2 * step)
            assert event.time_zero == pytest.approx(zero, abs=2 * step)
    assert events > 12
