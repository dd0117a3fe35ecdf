"""Changes of velocity against antiderivatives."""

import sys
from pathlib import Path

import numpy as np
import pytest
from tests.coded import coded

sys.path.insert(0, str(Path(__file__).parent))

from pulses import Pulse, means, stamps

from strapdown import rotation
from strapdown.crash.acceleration import (
    Acceleration,
    body_acceleration,
    resolved_acceleration,
    window_weights,
)
from strapdown.crash.delta_v import (
    VelocityCourse,
    cumulative_delta_v,
    delta_v,
    recorder_delta_v,
    trailing_delta_v,
)
from strapdown.crash.events import detect_events
from strapdown.errors import ConfigError, DataError
from strapdown.tables import imu_table

OBLIQUE = Pulse((-7.2, 2.5, -0.8))


def record(rate, sampling="instantaneous", begin=-0.1, end=0.75, pulse=OBLIQUE):
    time = stamps(rate, begin, end)
    values = means([pulse], time) if sampling == "mean" else pulse.accel(time)
    return Acceleration(time, values, sampling=sampling, source="unit 1")


def trapezoid_bound(rate, pulse=OBLIQUE):
    """h²/12 times the difference of the jerks at the ends, at most 2 max|a'|; twice for the ends.

    The ends inside a step add a chord's error, h³/12 max|a''| each, less than that at h < T/2 pi.
    """
    return 2.0 * 2.0 * np.abs(pulse.change) * pulse.jerk_most() / rate**2 / 12.0


@pytest.mark.parametrize("rate", [200.0, 1000.0, 10000.0])
@pytest.mark.parametrize("window", [(0.0, 0.113), (-0.0123, 0.0377), (0.0501, 0.0502)])
def test_a_window_anywhere_is_the_antiderivatives_difference(rate, window):
    change = delta_v(record(rate), *window)
    exact = OBLIQUE.velocity(window[1]) - OBLIQUE.velocity(window[0])
    # And the rounding of a sum over the record.
    assert np.all(np.abs(change.vector - exact) <= trapezoid_bound(rate) + 1e-13)
    assert change.resultant == pytest.approx(np.linalg.norm(change.vector), rel=1e-15)
    assert change.horizontal == pytest.approx(np.hypot(*change.vector[:2]), rel=1e-15)


def test_means_are_exact_between_stamps():
    made = record(200.0, "mean")
    for a, b in ((20, 43), (0, 170), (31, 32)):
        change = delta_v(made, made.time[a], made.time[b])
        exact = OBLIQUE.velocity(made.time[b]) - OBLIQUE.velocity(made.time[a])
        # Rounding of 170 terms of at most 0.65 m/s.
        assert np.abs(change.vector - exact).max() < 1e-13


@pytest.mark.parametrize(("sampling", "order"), [("instantaneous", 2.0), ("mean", 2.0)])
def test_windows_off_the_samples_are_of_the_second_order(sampling, order):
    rates = np.array([250.0, 500.0, 1000.0, 2000.0])
    errors = []
    for rate in rates:
        h = 1.0 / rate
        # Ends half a step off a sample at every rate.
        start, end = 0.02 + 0.5 * h, 0.06 + 0.5 * h
        change = delta_v(record(rate, sampling), start, end).vector
        errors.append(np.abs(change - OBLIQUE.velocity(end) + OBLIQUE.velocity(start)).max())
    assert -np.polyfit(np.log(rates), np.log(errors), 1)[0] == pytest.approx(order, abs=0.15)


@pytest.mark.parametrize(
    ("sampling", "velocity", "rate", "slope"),
    [
        # 1 · 5 + 200 · 5² / 2000, and (1 + 3) / 2 · 10 + 3 · 5 + 100 · 5² / 2000.
        ("instantaneous", [7.5, 36.25], [2.0, 3.5], [200.0, 100.0]),
        ("mean", [15.0, 50.0], [3.0, 4.0], [0.0, 0.0]),
    ],
)
def test_the_course_within_each_step_is_that_of_its_two_samples(sampling, velocity, rate, slope):
    """Acceleration 1, 3, 4 m/s² at 0, 10, 20 ms: lines between them, or means of each step."""
    values = np.outer([1.0, 3.0, 4.0], [1.0, 0.0, -1.0])
    course = VelocityCourse(Acceleration(np.array([0.0, 0.01, 0.02]), values, sampling=sampling))
    at = np.array([0.005, 0.015])
    velocity = np.array(velocity) * 1e-3
    found = (course.velocity(at), course.rate(at), course.slope(at))
    for each, expected in zip(found, (velocity, rate, slope), strict=True):
        np.testing.assert_allclose(each, np.outer(expected, [1.0, 0.0, -1.0]), rtol=1e-12)


def test_weights_are_the_gradient():
    made = record(333.0)
    change = delta_v(made, 0.0111, 0.0888)
    assert np.array_equal(change.weights @ made.values, change.vector)
    assert np.array_equal(change.weights, window_weights(made.time, 0.0111, 0.0888))
    # A constant is integrated to the window's length.
    assert change.weights.sum() == pytest.approx(0.0777, rel=1e-13)
    backward = window_weights(made.time, 0.0888, 0.0111)
    assert np.array_equal(backward, -change.weights)


@pytest.mark.parametrize("sampling", ["instantaneous", "mean"])
def test_windows_add_up(sampling):
    rng = np.random.default_rng(4)
    time = np.cumsum(rng.choice([0.001, 0.003, 0.02], 200))
    for _ in range(50):
        a, b, c = np.sort(rng.uniform(time[0], time[-1], 3))
        parts = window_weights(time, a, b, sampling) + window_weights(time, b, c, sampling)
        # Rounding of weights of up to 20 ms beside stamps of up to 2 s.
        assert np.abs(parts - window_weights(time, a, c, sampling)).max() < 1e-15


def test_ends_move_the_change_by_their_rates():
    made = record(1000.0)
    change, d = delta_v(made, 0.0104, 0.0613), 1e-6
    later = delta_v(made, 0.0104, 0.0613 + d)
    sooner = delta_v(made, 0.0104 + d, 0.0613)
    # The quadratic within a step: half its slope, 0.5 · 3.6e3 m/s³ · 1e-6 s.
    assert np.allclose((later.vector - change.vector) / d, change.end_rate, atol=2e-3)
    assert np.allclose((sooner.vector - change.vector) / d, -change.start_rate, atol=2e-3)


def test_noise_covariance_is_that_of_noisy_records():
    made, rng = record(200.0), np.random.default_rng(5)
    change = delta_v(made, -0.011, 0.1234)
    sds = np.array([0.4, 1.0, 2.0])
    noise = rng.normal(0.0, 1.0, (4000, len(made.time), 3)) * sds
    drawn = np.einsum("k,rki->ri", change.weights, noise)
    expected = change.noise_covariance(sds)
    # A variance of 4000 draws is known to sqrt(2/4000) = 2.2 %; four of these.
    assert np.allclose(np.cov(drawn.T), expected, rtol=0.09, atol=0.09 * expected.max())


def test_the_trailing_window_of_no_whole_number_of_samples_and_its_peak():
    # 30 ms at 333 Hz are 9.99 samples.
    made = record(333.0)
    trailing = trailing_delta_v(made)
    assert trailing.time[0] >= made.time[0] + 0.030 > trailing.time[0] - 1.0 / 333.0
    exact = OBLIQUE.velocity(trailing.time) - OBLIQUE.velocity(trailing.time - 0.030)
    assert np.all(np.abs(trailing.vector - exact) <= trapezoid_bound(333.0) + 1e-13)
    # The peak is symmetric about the crest of the pulse, at T/2.
    peak, half = trailing.peak, 0.5 * OBLIQUE.length
    size = OBLIQUE.window(half + 0.015, 0.030) * np.linalg.norm(OBLIQUE.change)
    bound = np.linalg.norm(trapezoid_bound(333.0))
    assert peak.resultant == pytest.approx(size, abs=bound)
    # An error of the size moves a maximum by no more than sqrt(2 error / curvature).
    curve = (
        np.linalg.norm(OBLIQUE.change)
        * 2
        * OBLIQUE.jerk_most()
        * np.sin(2 * np.pi * 0.015 / OBLIQUE.length)
    )
    assert peak.end == pytest.approx(half + 0.015, abs=np.sqrt(2.0 * 2.0 * bound / curve))
    assert peak.end - peak.start == pytest.approx(0.030, abs=1e-15)


def test_the_peak_is_no_less_than_that_of_any_window():
    rng = np.random.default_rng(6)
    time = np.cumsum(rng.choice([0.001, 0.004, 0.011], 300))
    for sampling in ("instantaneous", "mean"):
        made = Acceleration(time, rng.normal(0.0, 50.0, (300, 3)), sampling=sampling)
        peak = trailing_delta_v(made, 0.0303).peak.resultant
        at = np.linspace(time[0] + 0.0303, time[-1], 1500)
        sizes = [delta_v(made, t - 0.0303, t, across_gaps=True).resultant for t in at]
        assert max(sizes) <= peak * (1.0 + 1e-12)
        # The finest of 1500 windows is near it: half their step, 0.4 ms, times 200 m/s².
        assert max(sizes) == pytest.approx(peak, abs=0.2)


def test_the_course_of_the_change_and_what_a_recorder_gives():
    made = record(1000.0)
    course = cumulative_delta_v(made, 0.0004, 0.2)
    exact = OBLIQUE.velocity(0.0004 + course.index.to_numpy()) - OBLIQUE.velocity(0.0004)
    assert np.all(np.abs(course[["dv_x", "dv_y", "dv_z"]] - exact) <= trapezoid_bound(1e3) + 1e-13)
    assert course.index[0] == 0.0 and course.iloc[0].abs().max() == 0.0
    tenths = cumulative_delta_v(made, 0.0004, 0.2504, every=0.010)
    for no_step in (0.0, -0.010):
        with pytest.raises(ConfigError):
            cumulative_delta_v(made, 0.0004, 0.2504, every=no_step)
    assert np.allclose(tenths.index, np.arange(26) * 0.01, atol=1e-12)
    event = detect_events(made).first
    kept = recorder_delta_v(made, event)
    # To the last whole 10 ms before 30 ms after the end, which is before 250 ms.
    assert len(kept) == int((event.duration + 0.030) / 0.010) + 1 < 26
    # What came before time zero is less than the threshold.
    assert kept["dv_x"].iloc[-1] == pytest.approx(-7.2, abs=0.8 / 3.6)


def test_resolved_in_ned_a_turning_vehicle_has_the_change_that_it_had():
    # A vehicle that yaws at 90 deg/s through the pulse, at 5 deg of pitch.
    time, g = stamps(2000.0), 9.81
    euler = np.column_stack(
        [np.zeros_like(time), np.full_like(time, 5.0), 40.0 + 90.0 * (time + 0.1)]
    )
    q = rotation.quaternion_from_euler(euler)
    force = rotation.rotate(rotation.conjugate(q), OBLIQUE.accel(time) - np.array([0.0, 0.0, g]))
    imu = imu_table(time, np.zeros((len(time), 3)), force, source="unit 1")
    change = delta_v(resolved_acceleration(imu, q, g), -0.05, 0.2)
    exact = np.array(OBLIQUE.change)
    assert np.all(np.abs(change.vector - exact) <= trapezoid_bound(2000.0) + 1e-12)
    # Along turning axes it is another: that of a recorder, by the turn over the pulse.
    body = delta_v(body_acceleration(imu, force[0]), -0.05, 0.2)
    assert abs(body.horizontal - np.hypot(7.2, 2.5)) < 0.1
    assert np.linalg.norm(body.vector[:2] - exact[:2]) > 1.0


def test_means_are_turned_by_the_attitude_in_the_middle():
    errors = []
    for rate in (200.0, 400.0):
        time = stamps(rate)
        fine = np.arange(0.5, 50.0) / 50.0

        def attitude(t):
            t = np.asarray(t)
            euler = np.stack([0 * t, 0 * t, 90.0 * t], axis=-1)
            return rotation.quaternion_from_euler(euler)

        h = 1.0 / rate
        inner = (time[:, None] - h) + h * fine
        body = rotation.rotate(rotation.conjugate(attitude(inner)), OBLIQUE.accel(inner))
        imu = imu_table(time, np.zeros((len(time), 3)), body.mean(axis=1), sampling="mean")
        made = resolved_acceleration(imu, attitude(time), 0.0)
        errors.append(np.abs(delta_v(made, -0.05, 0.2).vector - OBLIQUE.change).max())
    # Second order: a quarter at half the step.
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.2)


def test_a_yaw_turns_a_resolved_change_exactly():
    time = stamps(500.0)
    ned = Acceleration(time, OBLIQUE.accel(time), "ned")
    change, turned = delta_v(ned, 0.0, 0.1), delta_v(ned.along(30.0), 0.0, 0.1)
    c, s = np.cos(np.radians(30.0)), np.sin(np.radians(30.0))
    x, y, z = change.vector
    assert np.allclose(turned.vector, [c * x + s * y, c * y - s * x, z], rtol=0, atol=1e-13)
    assert turned.frame == "impact"
    with pytest.raises(ConfigError, check=coded("crash.record-frame-heading-turns-north")):
        ned.along(30.0).along(1.0)


def test_a_whole_event_has_nearly_the_whole_change():
    made = record(1000.0)
    event = detect_events(made).first
    change = delta_v(made, event.time_zero, event.end)
    # What lies outside the bounds changes the velocity by less than the threshold, twice.
    assert 0.0 <= 7.2 + change.vector[0] < 2.0 * 0.8 / 3.6


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda a: delta_v(a, -0.5, 0.1), "s is outside the record, -"),
        (lambda a: delta_v(a, 0.1, 0.1), "is empty"),
        (lambda a: trailing_delta_v(a, 2.0), "does not fit"),
        (lambda a: trailing_delta_v(a, 0.03, 0.8, 0.9), "does not fit"),
        (lambda a: cumulative_delta_v(a, 0.0, 3.0), "s is outside the record, -"),
    ],
)
def test_windows_that_cannot_be_are_refused_by_name(call, message):
    with pytest.raises(DataError, match=message) as caught:
        call(record(1000.0))
    assert caught.value.finding.file == "unit 1" and caught.value.finding.remedy


def test_a_gap_in_the_window_is_refused_unless_bridged():
    time = stamps(1000.0)
    time = time[(time < 0.0395) | (time > 0.0555)]
    made = Acceleration(time, OBLIQUE.accel(time), source="unit 1")
    with pytest.raises(DataError, match=r"unit 1, row 141, acceleration: a gap of 17 ms"):
        delta_v(made, 0.0, 0.1)
    assert delta_v(made, 0.06, 0.1).resultant > 0.0
    bridged = delta_v(made, 0.0, 0.1, across_gaps=True).vector
    exact = OBLIQUE.velocity(0.1) - OBLIQUE.velocity(0.0)
    # A chord over 17 ms: L³/12 max|a''|, with |a''| <= D/T (2 pi/T)².
    chord = 0.017**3 / 12.0 * np.abs(OBLIQUE.change) / 0.113 * (2 * np.pi / 0.113) ** 2
    assert np.all(np.abs(bridged - exact) <= chord + trapezoid_bound(1000.0))
