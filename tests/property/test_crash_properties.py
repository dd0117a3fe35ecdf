"""What holds for every record of a crash."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from strapdown import rotation
from strapdown.crash.acceleration import (
    Acceleration,
    body_acceleration,
    force_at_rest,
    window_weights,
)
from strapdown.crash.delta_v import delta_v, trailing_delta_v
from strapdown.crash.events import EventRule, detect_events
from strapdown.crash.pdof import pdof, pdof_interval
from strapdown.tables import imu_table

samplings = st.sampled_from(["instantaneous", "mean"])
seeds = st.integers(0, 2**32 - 1)


def record(seed, sampling="instantaneous"):
    rng = np.random.default_rng(seed)
    time = rng.uniform(-5.0, 5.0) + np.cumsum(rng.choice([0.0005, 0.001, 0.005, 0.01], 150))
    values = rng.normal(0.0, 3.0, (150, 3))
    x = np.clip((time - time[40]) / 0.11, 0.0, 1.0)
    values += np.outer((1.0 - np.cos(2.0 * np.pi * x)) / 0.11, rng.normal(0.0, 6.0, 3))
    return Acceleration(time, values, sampling=sampling), rng


@given(seeds, samplings)
@settings(deadline=None, max_examples=50)
def test_windows_add_up_and_weigh_their_length(seed, sampling):
    made, rng = record(seed, sampling)
    a, b, c = np.sort(rng.uniform(made.begin, made.end, 3))
    first, second = (window_weights(made.time, s, e, sampling) for s, e in ((a, b), (b, c)))
    whole = window_weights(made.time, a, c, sampling)
    # Rounding of stamps of up to 7 s.
    assert np.abs(first + second - whole).max() < 1e-14
    assert abs(whole.sum() - (c - a)) < 1e-14


@given(seeds, st.floats(-180.0, 180.0))
@settings(deadline=None, max_examples=50)
def test_a_turned_sensor_sees_a_turned_direction(seed, yaw):
    made, _ = record(seed)
    q = rotation.conjugate(rotation.quaternion_from_euler([0.0, 0.0, yaw]))
    turned = Acceleration(made.time, rotation.rotate(q, made.values))
    one, other = (trailing_delta_v(a).peak for a in (made, turned))
    # The peak is found between rounded sizes: its place to the root of the rounding.
    assert one.resultant == pytest.approx(other.resultant, rel=1e-12)
    before = delta_v(made, one.start, one.end)
    after = delta_v(turned, one.start, one.end)
    off = pdof(before).horizontal_deg - yaw - pdof(after).horizontal_deg
    # Rounding of a sum of 150 terms, seen from the length of the horizontal change.
    assert abs((off + 180.0) % 360.0 - 180.0) < 1e-11 / min(before.horizontal, 1.0)
    wide = 0.2 * np.eye(3)
    a, b = (pdof_interval(d, wide).horizontal for d in (before, after))
    assert a.undetermined == b.undetermined
    assert a.width_deg == pytest.approx(b.width_deg, rel=1e-9)


@given(seeds, samplings, st.floats(-100.0, 100.0))
@settings(deadline=None, max_examples=50)
def test_events_move_with_the_clock_and_turn_over_with_the_sign(seed, sampling, shift):
    made, _ = record(seed, sampling)
    events = detect_events(made).events
    moved = detect_events(Acceleration(made.time + shift, made.values, sampling=sampling)).events
    mirrored = detect_events(Acceleration(made.time, -made.values, sampling=sampling)).events
    assert repr(events) == repr(mirrored)
    assert len(events) == len(moved)
    for one, other in zip(events, moved, strict=True):
        for name in ("time_zero", "trigger", "end"):
            # Stamps of 100 s are rounded to 1e-14 s, their steps of 0.5 ms so to 3e-11; a change
            # of 2 m/s so rounded is 1e-10 s late at a slope of 1 m/s².
            assert getattr(other, name) - shift == pytest.approx(getattr(one, name), abs=1e-8)
        assert (one.basis, one.trigger_axis) == (other.basis, other.trigger_axis)


@given(seeds)
@settings(deadline=None, max_examples=50)
def test_times_of_an_event_are_in_order(seed):
    made, _ = record(seed)
    for rule in (EventRule(), EventRule(quiet=0.02), EventRule(lateral=False)):
        last = made.begin
        for event in detect_events(made, rule, noise=3.0).events:
            assert event.time_zero <= event.woken <= event.end
            assert event.time_zero <= event.trigger <= event.end <= made.end
            assert event.woken >= last and event.time_zero_sd > 0.0
            last = event.end


@given(st.floats(-180.0, 180.0), st.floats(-80.0, 80.0))
def test_what_rests_has_no_acceleration(roll, pitch):
    time = np.arange(5) * 0.01
    force = np.tile(force_at_rest(roll, pitch, 9.81), (5, 1))
    rest = body_acceleration(imu_table(time, np.zeros((5, 3)), force), force[0])
    assert np.array_equal(rest.values, np.zeros((5, 3)))
    # As levelling reads it: g sin(pitch), -g cos(pitch) sin(roll), -g cos(pitch) cos(roll).
    r, p = np.radians([roll, pitch])
    known = 9.81 * np.array([np.sin(p), -np.cos(p) * np.sin(r), -np.cos(p) * np.cos(r)])
    assert np.abs(force[0] - known).max() < 1e-13
