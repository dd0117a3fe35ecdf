"""Indices of severity on pulses with closed-form answers."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicHermiteSpline
from scipy.optimize import brentq, minimize
from tests.coded import coded

from strapdown.crash.indices import (
    CONDYLE,
    NECK_INTERCEPTS,
    asi,
    exceeded_level,
    first_reach,
    flail_space,
    four_pole,
    hic,
    largest_mean,
    moving_means,
    nij,
    olc,
    thiv,
)
from strapdown.errors import ConfigError, DataError

G = 9.80665
STEP = 1e-4
# Rounding of some thousand sums.
EXACT = 1e-11
DELTA, LENGTH = 15.0, 0.1


def constant(size: float, seconds: float = 0.4):
    time = np.arange(round(seconds / STEP) + 1) * STEP
    return time, np.full(time.size, size)


def haversine(seconds: float = 0.4):
    """Deceleration whose integral is DELTA over LENGTH: (2Δ/T) sin²(πt/T)."""
    time = np.arange(-500, round(seconds / STEP) + 1) * STEP
    within = (time > 0) & (time < LENGTH)
    return time, np.where(within, 2 * DELTA / LENGTH * np.sin(np.pi * time / LENGTH) ** 2, 0.0)


def lost(t):
    t = min(t, LENGTH)
    return DELTA * (t / LENGTH - math.sin(2 * math.pi * t / LENGTH) / (2 * math.pi))


def ahead(t):
    s = min(t, LENGTH)
    part = math.cos(2 * math.pi * s / LENGTH) - 1.0
    within = DELTA * (s * s / (2 * LENGTH) + LENGTH / (4 * math.pi**2) * part)
    return within + DELTA * (t - s)


def plane(x, y=None):
    return np.column_stack([x, np.zeros_like(x) if y is None else y, np.zeros_like(x)])


# The trapezoid of a sine of 1/T over the step h is short by (2πh/T)²/12 = 3.3e-6 of it.
TRAPEZOID = 4e-6


def test_the_first_reach_is_the_root_of_the_cubic():
    rng = np.random.default_rng(9)
    for _ in range(200):
        time = np.cumsum(rng.uniform(1e-4, 1e-2, 4))
        values = np.sort(rng.uniform(0.0, 1.0, 4))
        chords = np.diff(values) / np.diff(time)
        # Not above the lesser of its chords: the cubics rise.
        least = np.minimum(np.r_[chords[0], chords], np.r_[chords, chords[-1]])
        slopes = rng.uniform(0.0, 1.0, 4) * least
        level = float(rng.uniform(values[0], values[-1]))
        found = first_reach(time, values, slopes, level)
        of = CubicHermiteSpline(time, values, slopes)
        k = int(np.argmax(values >= level))
        expected = brentq(lambda at, of=of, u=level: of(at) - u, time[k - 1], time[k], xtol=1e-15)
        # brentq has the root to 4 eps of it; the cubic rounds to eps, and is as steep as that.
        assert found == pytest.approx(expected, rel=1e-13, abs=1e-15 + 4e-16 / abs(of(found, 1)))


class TestMovingMeans:
    def test_is_exact_for_a_record_of_lines_and_any_width(self):
        # A triangle of height 1 on a base of 2: a window w about its top has the mean 1 - w/4.
        time = np.array([0.0, 0.3, 1.0, 1.1, 2.0])
        values = np.interp(time, [0, 1, 2], [0, 1, 0])
        mean, start = largest_mean(time, -values, 0.37)
        assert mean == pytest.approx(-(1 - 0.37 / 4), rel=1e-14)
        assert start == pytest.approx(1 - 0.37 / 2, rel=1e-14)

    def test_is_that_of_a_fine_sum(self):
        rng = np.random.default_rng(5)
        time = np.cumsum(rng.uniform(0.5, 1.5, 40))
        values = rng.standard_normal((40, 2))
        starts, means = moving_means(time, values, 3.3)
        for k in (0, 17, starts.size - 1):
            fine = np.linspace(starts[k], starts[k] + 3.3, 200_001)
            for axis in (0, 1):
                # The trapezoid over 200000 parts misses the corners by 1e-10.
                expected = np.trapezoid(np.interp(fine, time, values[:, axis]), fine) / 3.3
                assert means[k, axis] == pytest.approx(expected, abs=1e-9)

    def test_a_record_as_long_as_its_window_and_a_shorter_one(self):
        time, values = constant(2.0, 0.05)
        assert largest_mean(time, values, 0.05)[0] == pytest.approx(2.0, rel=1e-12)
        with pytest.raises(DataError, check=coded("crash.record-shorter-than-window")):
            largest_mean(time, values, 0.0501)


class TestAsi:
    @pytest.mark.parametrize("axis", [0, 1, 2])
    def test_constant_acceleration_of_the_limit_is_one(self, axis):
        time, a = constant((12.0, 9.0, 10.0)[axis] * G)
        accel = np.zeros((time.size, 3))
        accel[:, axis] = -a
        for average in ("mean_50ms", "butterworth_13hz"):
            # The filter's own transients at the ends die out within the padding.
            found = asi(time, accel, average=average)
            assert found.value == pytest.approx(1.0, rel=1e-6)

    def test_short_rectangle_over_the_window(self):
        time = np.array([-0.1, 0.0, 1e-12, 0.02, 0.02 + 1e-12, 0.2])
        a = np.array([0.0, 0.0, 24.0, 24.0, 0.0, 0.0]) * G
        found = asi(time, plane(-a), average="mean_50ms")
        assert found.value == pytest.approx(2.0 * 0.02 / 0.05, rel=1e-9)

    def test_haversine_by_the_mean(self):
        time, a = haversine()
        w = 0.05
        mean = DELTA * (w / LENGTH + math.sin(math.pi * w / LENGTH) / math.pi) / w
        found = asi(time, plane(-a), average="mean_50ms")
        assert found.value == pytest.approx(mean / (12 * G), rel=TRAPEZOID)
        assert found.at == pytest.approx(LENGTH / 2, abs=STEP)

    def test_filter_at_its_frequency(self):
        # A whole filter is 3 dB down at its cut-off, and two passes of it 6 dB; no phase.
        time = np.arange(-20000, 20001) * STEP
        wave = np.cos(2 * np.pi * 13.0 * time)
        for cutoff, gain in (("whole", math.sqrt(0.5)), ("pass", 0.5)):
            out = four_pole(time, wave, 13.0, cutoff)
            middle = np.abs(time) < 0.5
            # The warping of the bilinear transform, (π 16/10⁴)² / 3 = 8e-6 of the frequency.
            np.testing.assert_allclose(out[middle], gain * wave[middle], atol=2e-5)

    def test_filter_is_that_of_scipy(self):
        from scipy.signal import butter, sosfiltfilt

        rng = np.random.default_rng(8)
        for rate, frequency, size in ((1e3, 13.0, 900), (1e4, 10.0, 4000), (2e3, 60.0, 50)):
            values = np.cumsum(rng.normal(size=(size, 3)), axis=0)
            sections = butter(2, frequency, fs=rate, output="sos")
            n = min(round(0.5 * rate), size - 1)
            expected = sosfiltfilt(sections, values, axis=0, padtype="odd", padlen=n)
            found = four_pole(np.arange(size) / rate, values, frequency, "pass")
            # Five roundings of a sample; the recursion adds those of 1 / (1 - |pole|)² samples.
            lasting = (rate / (math.sqrt(2.0) * math.pi * frequency)) ** 2
            bound = 5 * np.finfo(np.float64).eps * lasting * np.abs(values).max()
            np.testing.assert_allclose(found, expected, rtol=0.0, atol=bound)

    def test_filter_on_a_long_haversine_is_near_the_mean_of_the_older_edition(self):
        time, a = haversine()
        old = asi(time, plane(-a), average="mean_50ms").value
        new = asi(time, plane(-a)).value
        both = asi(time, plane(-a), cutoff="pass").value
        assert both < new
        # To second order a mean over w takes w²/24 of the curvature; the two passes, in series
        # 1/(1 + (f/fc)^4), none. A spectrum within 10 Hz keeps them within a fifth.
        assert abs(both - old) < 0.2 * old

    def test_options_and_steps_are_checked(self):
        time, a = constant(10.0)
        with pytest.raises(ConfigError, check=coded("crash.no-average-asi", quantity="average")):
            asi(time, plane(a), average="mean")
        with pytest.raises(ConfigError, check=coded("crash.no-kind-cut-off")):
            asi(time, plane(a), cutoff="half")
        with pytest.raises(DataError, check=coded("crash.rate-hz-less-than-ten", quantity="time")):
            asi(np.arange(10) * 0.01, np.zeros((10, 3)))
        uneven = np.delete(time, 7)
        with pytest.raises(DataError, match="resample"):
            asi(uneven, plane(a[1:]))


class TestThiv:
    @pytest.mark.parametrize(
        ("x", "y", "surface", "way"),
        [(-100.0, 0.0, "front", 0.6), (0.0, 80.0, "left", 0.3), (0.0, -80.0, "right", 0.3)],
    )
    def test_constant_acceleration(self, x, y, surface, way):
        time, one = constant(1.0)
        found = thiv(time, plane(x * one, y * one))
        size = abs(x + y)
        assert found.surface == surface
        assert found.time_of_flight == pytest.approx(math.sqrt(2 * way / size), rel=EXACT)
        assert found.velocity == pytest.approx(math.sqrt(2 * way * size), rel=EXACT)
        assert found.phd_g == pytest.approx(size / G, rel=EXACT)

    def test_haversine(self):
        time, a = haversine()
        found = thiv(time, plane(-a))
        at = brentq(lambda t: ahead(t) - 0.6, 0.01, 0.4, xtol=1e-15)
        assert found.time_of_flight == pytest.approx(at, rel=TRAPEZOID)
        assert found.velocity == pytest.approx(lost(at), rel=TRAPEZOID)

    def test_vehicle_that_turns_about_its_point(self):
        # The head rests; in the vehicle it runs round the point with the rate times its distance.
        time, one = constant(1.0)
        found = thiv(time, plane(0 * one), 3.0 * one, head=(0.8, 0.0))
        assert found.surface == "left"
        assert found.velocity == pytest.approx(2.4, rel=1e-10)
        # The place between samples is a cubic: h⁴ w⁴ / 384 is far below.
        assert found.time_of_flight == pytest.approx(math.asin(0.3 / 0.8) / 3.0, rel=1e-10)

    def test_braked_in_a_fixed_direction_while_it_turns(self):
        time, one = constant(1.0)
        rate, brake = 2.0, 90.0
        yaw = rate * time
        accel = plane(-brake * np.cos(yaw), brake * np.sin(yaw))
        found = thiv(time, accel, rate * one)
        at = brentq(lambda t: math.cos(rate * t) * brake * t * t / 2 - 0.6, 0.01, 0.3)
        c, s = math.cos(rate * at), math.sin(rate * at)
        vx = c * brake * at - rate * s * brake * at**2 / 2
        vy = -s * brake * at - rate * c * brake * at**2 / 2
        # The ground acceleration is constant and only rounded by the turn there and back.
        assert found.surface == "front"
        assert found.time_of_flight == pytest.approx(at, rel=1e-9)
        assert found.velocity == pytest.approx(math.hypot(vx, vy), rel=1e-9)

    def test_start_within_the_record_leaves_out_what_was_before(self):
        time, one = constant(1.0)
        found = thiv(time, plane(-100.0 * one), start=0.05005)
        assert found.velocity == pytest.approx(math.sqrt(120.0), rel=EXACT)

    def test_filtered_deceleration(self):
        time, one = constant(1.0, 1.0)
        found = thiv(time, plane(-100.0 * one), phd_average="butterworth_10hz")
        assert found.phd_g == pytest.approx(100.0 / G, rel=1e-6)

    def test_weak_impact_has_no_value(self):
        time, one = constant(1.0)
        found = thiv(time, plane(-1.0 * one))
        assert found.velocity is None
        assert found.largest == pytest.approx(0.4, rel=1e-12)
        assert "THIV has no value" in found.findings[0].what

    def test_record_that_ends_with_the_impact_has_no_deceleration(self):
        time, one = constant(1.0, 0.112)
        found = thiv(time, plane(-100.0 * one))
        assert found.velocity is not None
        assert found.phd_g is None
        assert "ends less than 10 ms" in found.findings[0].what

    def test_bad_input(self):
        time, one = constant(1.0)
        with pytest.raises(DataError, match="needed"):
            thiv(time, one)
        with pytest.raises(
            DataError, match=r"start: the start at 7 s is outside the record \(0 to 0\.4 s\)"
        ):
            thiv(time, plane(one), start=7.0)
        with pytest.raises(ConfigError, check=coded("crash.no-way-fly")):
            thiv(time, plane(one), forward=0.0)
        with pytest.raises(ConfigError, check=coded("crash.no-average-phd")):
            thiv(time, plane(one), phd_average="10")
        holed = one.copy()
        holed[9] = np.nan
        with pytest.raises(DataError, match="sample 10"):
            thiv(time, plane(holed))


class TestTogether:
    """What must hold of every record, on random smooth ones."""

    @pytest.fixture(params=range(4))
    def record(self, request):
        rng = np.random.default_rng(request.param)
        time = np.arange(-200, 3001) * STEP
        waves = rng.standard_normal((3, 12)) @ np.sin(
            2 * np.pi * np.outer(np.arange(1, 13), time / 0.35)
        )
        accel = 40.0 * waves.T
        accel[:, 0] -= 120.0
        yaw = 2.0 * np.sin(2 * np.pi * (time / 0.3 + rng.uniform()))
        return time, accel, yaw

    def test_mirrored_left_to_right(self, record):
        time, accel, yaw = record
        flipped = accel * [1.0, -1.0, 1.0]
        one, two = thiv(time, accel, yaw), thiv(time, flipped, -yaw)
        assert two.velocity == pytest.approx(one.velocity, rel=EXACT)
        sides = {"front": "front", "left": "right", "right": "left"}
        assert two.surface == sides[one.surface]
        assert asi(time, flipped).value == pytest.approx(asi(time, accel).value, rel=EXACT)
        a, b = flail_space(time, accel), flail_space(time, flipped)
        assert (b.oiv_x, b.oiv_y) == pytest.approx((a.oiv_x, -a.oiv_y), rel=EXACT)
        assert b.ora_y_g == pytest.approx(-a.ora_y_g, rel=EXACT)

    def test_on_another_clock(self, record):
        time, accel, yaw = record
        late = time + 1000.0
        # Stamps of 1000 s are known to 1e-13 s, steps of 1e-4 so to 1e-9.
        one, two = thiv(time, accel, yaw), thiv(late, accel, yaw, start=1000.0)
        assert two.velocity == pytest.approx(one.velocity, rel=1e-7)
        assert two.phd_g == pytest.approx(one.phd_g, rel=1e-7)
        first, second = olc(time, accel[:, 0]), olc(late, accel[:, 0], start=1000.0)
        assert second.value_g == pytest.approx(first.value_g, rel=1e-7)

    def test_head_against_an_integration_of_the_vehicle_alone(self, record):
        # The vehicle on the ground by a Runge-Kutta integrator; the head stays where it was.
        time, accel, yaw = record
        head = (0.4, -0.35)

        def rate(t, s):
            ax, ay = (np.interp(t, time, accel[:, k]) for k in (0, 1))
            c, n = math.cos(s[0]), math.sin(s[0])
            return [np.interp(t, time, yaw), s[3], s[4], c * ax - n * ay, n * ax + c * ay]

        def flown(t, s):
            c, n = math.cos(s[0]), math.sin(s[0])
            dx, dy = head[0] - s[1], head[1] - s[2]
            return c * dx + n * dy - head[0], c * dy - n * dx - head[1]

        events = [
            lambda t, s: flown(t, s)[0] - 0.6,
            lambda t, s: flown(t, s)[1] - 0.3,
            lambda t, s: flown(t, s)[1] + 0.3,
        ]
        for event in events:
            event.terminal = True
        run = solve_ivp(
            rate, (0.0, 0.3), [0.0] * 5, events=events, rtol=1e-9, atol=1e-11, max_step=STEP
        )
        found = thiv(time, accel, yaw, head=head)
        # The trapezoid's second order: (h w)²/12 of accelerations of up to 12/0.35 Hz, 4e-5.
        assert found.time_of_flight == pytest.approx(run.t[-1], rel=4e-5)
        s = run.y[:, -1]
        c, n, w = math.cos(s[0]), math.sin(s[0]), float(np.interp(run.t[-1], time, yaw))
        x, y = np.add(flown(run.t[-1], s), head)
        vx = -(c * s[3] + n * s[4]) + w * y
        vy = -(c * s[4] - n * s[3]) - w * x
        assert found.velocity == pytest.approx(math.hypot(vx, vy), rel=4e-5)


class TestOlc:
    def test_constant_deceleration(self):
        # t1² = 0.13/A, and A t2 t1/2 - 0.065 = 0.235 gives t2/t1 = 0.6/0.13.
        time, a = constant(-250.0)
        found = olc(time, a)
        ratio = 0.6 / 0.13
        assert found.restraint_from == pytest.approx(math.sqrt(0.13 / 250.0), rel=EXACT)
        assert found.restraint_to == pytest.approx(math.sqrt(0.13 / 250.0) * ratio, rel=EXACT)
        assert found.value_g == pytest.approx(250.0 / G * ratio / (ratio - 1), rel=EXACT)

    def test_haversine(self):
        time, a = haversine()
        found = olc(time, -a)
        begin = brentq(lambda t: ahead(t) - 0.065, 1e-3, 0.4, xtol=1e-15)
        end = brentq(lambda t: ahead(t) - lost(t) * (t - begin) / 2 - 0.3, begin, 0.4, xtol=1e-15)
        assert found.value_g == pytest.approx(lost(end) / (end - begin) / G, rel=2 * TRAPEZOID)

    def test_stop_at_once_is_two_times_that_of_its_energy(self):
        # A vehicle that stops at once: t1 = 0.065/V, and the occupant stops within 0.235 m.
        time = np.array([0.0, 1e-9, 2e-9, 0.1, 0.2])
        speed = 15.0
        a = np.array([0.0, -speed / 1e-9, 0.0, 0.0, 0.0])
        # The nanosecond of the stop is 1.5e-8 m of way.
        assert olc(time, a).value_g == pytest.approx(speed**2 / (2 * 0.235) / G, rel=1e-6)

    def test_weak_and_rear_impacts_have_no_value(self):
        time, a = constant(-0.5)
        weak = olc(time, a)
        assert (weak.value_g, weak.restraint_from) == (None, None)
        assert "less than 0.065 m" in weak.findings[0].what
        between = olc(*constant(-2.0))
        assert between.restraint_from is not None
        assert "less than 0.3 m" in between.findings[0].what
        assert olc(*constant(100.0)).value_g is None

    def test_ways_are_checked(self):
        with pytest.raises(ConfigError, check=coded("crash.olc-ways-out-of-order")):
            olc(*constant(-100.0), free=0.3, whole=0.3)


class TestFlailSpace:
    def test_constant_acceleration(self):
        time, one = constant(1.0)
        found = flail_space(time, plane(-100.0 * one, 20.0 * one))
        at = math.sqrt(1.2 / 100.0)
        assert found.at == pytest.approx(at, rel=EXACT)
        assert (found.oiv_x, found.oiv_y) == pytest.approx((100.0 * at, -20.0 * at), rel=EXACT)
        assert (found.ora_x_g, found.ora_y_g) == pytest.approx((-100.0 / G, 20.0 / G), rel=EXACT)

    def test_haversine_and_the_thiv_of_a_straight_impact(self):
        time, a = haversine()
        found = flail_space(time, plane(-a))
        at = brentq(lambda t: ahead(t) - 0.6, 0.01, 0.4, xtol=1e-15)
        assert found.oiv_x == pytest.approx(lost(at), rel=TRAPEZOID)
        assert found.oiv_x == pytest.approx(thiv(time, plane(-a)).velocity, rel=EXACT)
        w = 0.01
        starts = np.linspace(at, 0.3, 20001)
        mean = max(abs(lost(s + w) - lost(s)) / w for s in starts)
        # The greatest mean begins at the impact, as the pulse is past its top.
        assert abs(found.ora_x_g) * G == pytest.approx(mean, rel=1e-3)

    def test_rear_impact(self):
        time, one = constant(1.0)
        found = flail_space(time, plane(100.0 * one))
        assert found.oiv_x == pytest.approx(-math.sqrt(120.0), rel=EXACT)

    def test_nothing_met_gives_the_change_of_velocity(self):
        time, one = constant(1.0)
        found = flail_space(time, plane(-2.0 * one))
        assert found.at is None
        assert found.oiv_x == pytest.approx(0.8, rel=1e-12)
        assert "largest velocity change" in found.findings[0].what
        with pytest.raises(ConfigError, match=r"sideways: a distance of -0\.3 m is not positive"):
            flail_space(time, plane(one), sideways=-0.3)


class TestHic:
    def test_constant_acceleration(self):
        time, a = constant(50.0 * G, 0.1)
        for longest in (0.015, 0.036):
            found = hic(time, plane(-a), longest=longest)
            assert found.value == pytest.approx(longest * 50.0**2.5, rel=1e-9)
            assert found.end - found.begin == pytest.approx(longest, rel=1e-9)

    def test_haversine_against_a_continuous_maximisation(self):
        time, a = haversine()

        def short(ends):
            b, e = sorted(ends)
            return -(e - b) * ((lost(e) - lost(b)) / ((e - b) * G)) ** 2.5

        best = minimize(short, [0.03, 0.07], method="Nelder-Mead", options={"xatol": 1e-9})
        # At the greatest the ends may be off by half a step without first-order loss: the
        # share lost is of the order of (h/T)² times 2.5·1.5·π², 4e-5.
        found = hic(time, plane(a), longest=0.1)
        assert found.value == pytest.approx(-best.fun, rel=5e-5)
        assert found.value <= -best.fun * (1 + TRAPEZOID)

    def test_window_is_checked(self):
        with pytest.raises(ConfigError, match=r"longest: a window length of 0\.0 s is not valid"):
            hic(*constant(1.0), longest=0.0)


class TestExceededLevel:
    def test_of_a_triangle_and_of_two(self):
        # Rises to 100 at 10 ms and falls: above 100 - 10 x for 2 x ms, so for 3 ms at 85.
        time = np.array([0.0, 0.010, 0.020])
        assert exceeded_level(time, [0.0, 100.0, 0.0]) == pytest.approx(85.0, rel=EXACT)
        # Two of them reach it together for 3 ms at 92.5: the durations add up.
        time = np.array([0.0, 0.010, 0.020, 0.030, 0.040])
        twice = exceeded_level(time, [0.0, 100.0, 0.0, 100.0, 0.0])
        assert twice == pytest.approx(92.5, rel=EXACT)

    def test_of_a_plateau_and_its_spike(self):
        # 50 for 10 ms, with a spike of 1 ms that counts only as part of it.
        time = np.array([0.0, 1e-9, 0.004, 0.0045, 0.005, 0.010, 0.010 + 1e-9, 0.1])
        values = [0.0, 50.0, 50.0, 200.0, 50.0, 50.0, 0.0, 0.0]
        assert exceeded_level(time, values) == pytest.approx(50.0, rel=1e-6)

    def test_of_samples_as_counted(self):
        rng = np.random.default_rng(5)
        time = np.arange(2001) * STEP
        values = np.abs(rng.standard_normal(time.size).cumsum())
        level = exceeded_level(time, values)
        fine = np.linspace(0.0, time[-1], 400_001)
        above = (np.interp(fine, time, values) >= level).mean() * time[-1]
        # Counted to half a step of the fine grid at each of some hundred crossings.
        assert above == pytest.approx(0.003, abs=100 * (fine[1] - fine[0]))

    def test_short_record_and_no_duration(self):
        with pytest.raises(DataError, check=coded("crash.record-shorter-than-window")):
            exceeded_level([0.0, 0.001], [1.0, 1.0])
        with pytest.raises(ConfigError, check=coded("crash.no-length-window", quantity="duration")):
            exceeded_level([0.0, 1.0], [1.0, 1.0], duration=0.0)


class TestNij:
    @pytest.mark.parametrize(
        ("force", "moment", "kind", "value"),
        [
            (3403.0, 155.0, "tension-flexion", 1.0),
            (3403.0, -67.5, "tension-extension", 1.0),
            (-3080.0, 155.0, "compression-flexion", 1.0),
            (-3080.0, -67.5, "compression-extension", 1.0),
        ],
    )
    def test_each_of_the_four(self, force, moment, kind, value):
        pulse = np.array([0.0, 1.0, 0.0])
        shear = 1000.0
        # The moment at the condyle is that of the cell less 0.01778 m times the shear force.
        found = nij(
            [0.0, 0.01, 0.02], shear * pulse, force * pulse, (moment + CONDYLE * shear) * pulse
        )
        assert (found.kind, found.at) == (kind, 0.01)
        assert found.value == pytest.approx(value, rel=EXACT)

    def test_small_woman(self):
        critical = NECK_INTERCEPTS["HF"]
        found = nij([0.0, 1.0], [0.0, 0.0], [0.0, 4287.0], [0.0, 155.0], intercepts=critical)
        assert found.value == pytest.approx(2.0)
