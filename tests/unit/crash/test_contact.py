"""The whole contact of drawn crashes: coverage by kind, and records that hold only a part."""

from __future__ import annotations

import math
import zlib
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import binomtest
from tests.unit.crash import drawn_crashes
from tests.unit.crash.drawn_crashes import FIGURES, KINDS, STATED, draw, errors, reconstruct
from tests.unit.crash.pulses import Pulse, means, stamps

from strapdown.crash.acceleration import Acceleration
from strapdown.crash.contact import find_contact
from strapdown.crash.delta_v import delta_v
from strapdown.crash.entry import Entry
from strapdown.crash.events import PART_563, detect_events
from strapdown.crash.reconstruction import reconstruct_crash

#: Of the binomial intervals of coverages.
LEVEL = 0.99


def drawn(kind, number):
    rng = np.random.default_rng([zlib.crc32(kind.encode()), number])
    return draw(kind, rng), rng


def felt(crash, rate_hz, rng, *, end=0.6, noise=0.5, begin=-0.6):
    """The acceleration of a drawn crash in the vehicle's axes, with white noise."""
    time = np.arange(round(begin * rate_hz), round(end * rate_hz) + 1) / rate_hz
    values = crash.motion(time)[0] + rng.normal(scale=noise, size=(time.size, 3))
    return Acceleration(time, values, "body", "instantaneous", "drawn")


def contact_of(acceleration, noise=0.0):
    event = detect_events(acceleration, noise=noise).strongest
    return event, find_contact(acceleration, event, PART_563, noise=noise)


@pytest.mark.parametrize("kind", KINDS)
def test_contacts_of_drawn_crashes_are_found_and_miss_no_velocity(kind):
    """Noise alone: what the ends contribute to the error of delta-V is as large as stated."""
    late, onset, z, missed = [], [], [], []
    for number in range(100):
        crash, rng = drawn(kind, number)
        rate = float(rng.choice([200.0, 500.0, 1000.0]))
        made = felt(crash, rate, rng)
        event, contact = contact_of(made, 0.5)
        late.append(event.time_zero)
        onset.append(abs(contact.start.time) <= 1.96 * contact.start.sd)
        change = delta_v(made, contact.start.time, contact.end.time)
        covariance = change.noise_covariance(0.5) + contact.moved.T @ contact.moved
        off = change.vector - crash.change
        z.append(off[:2] / np.sqrt(np.diagonal(covariance)[:2]))
        missed.append(off @ crash.change / np.linalg.norm(crash.change))
        assert contact.start.missing == contact.end.missing == 0.0
    # One side only: the effect of an end is an upper bound.
    inside = (np.abs(z) <= 1.96).mean(axis=0)
    least = binomtest(95, 100, 0.95).proportion_ci(LEVEL).low
    assert np.mean(onset) >= least and (inside >= least).all()
    # A hundredth of a meter per second, where the regulation's time zero cost 0.2.
    assert abs(np.median(missed)) < 0.03
    if kind == "side":
        # That of the regulation opens late: that was the bias.
        assert 0.008 < np.median(late) < 0.025


def test_a_side_impact_is_not_biased_by_the_lateral_threshold():
    pulse = Pulse((0.0, 7.02, 0.0), 0.0, 0.1)
    time = stamps(1000.0, -0.5, 0.5)
    made = Acceleration(time, pulse.accel(time), "body", "instantaneous", "side")
    event, contact = contact_of(made)
    told = delta_v(made, event.time_zero, event.end).vector[1]
    assert event.basis == "lateral" and event.time_zero > 0.010 and told < 7.02 - 0.1
    whole = delta_v(made, contact.start.time, contact.end.time).vector[1]
    # The pulse below the allowance: nu t / 2 at each end.
    assert whole == pytest.approx(7.02, abs=0.02)
    assert abs(contact.start.time) < contact.start.sd * 2.0


@pytest.mark.parametrize("rate", [100.0, 1000.0])
def test_means_over_the_step_have_the_same_contact(rate):
    pulse = Pulse((-12.0, 0.0, 0.0), 0.0, 0.1)
    time = stamps(rate, -0.5, 0.5)
    made = Acceleration(time, means([pulse], time), "body", "mean", "front")
    _, contact = contact_of(made)
    assert abs(contact.start.time) <= 1.0 / rate + 2.0 * contact.start.sd
    whole = delta_v(made, contact.start.time, contact.end.time).vector[0]
    assert whole == pytest.approx(-12.0, abs=0.02 + 2.0 * np.abs(contact.moved).sum())


def test_braking_before_the_contact_is_not_of_it():
    pulse = Pulse((-6.0, 0.0, 0.0), 0.0, 0.1)
    time = stamps(1000.0, -0.5, 0.5)
    braking = np.where(time < 0.1, -8.0, -3.0)
    values = pulse.accel(time) + np.outer(braking, [1.0, 0.0, 0.0])
    _, contact = contact_of(Acceleration(time, values, "body", "instantaneous", "braked"))
    assert abs(contact.start.time) < 2.0 * contact.start.sd + 1e-3
    assert contact.start.rate[0] == pytest.approx(-8.0, abs=1.2)
    assert contact.end.time == pytest.approx(0.1, abs=2.0 * contact.end.sd + 1e-3)


def cut(pulse, end, *, begin=-0.5, ring=0.0):
    time = stamps(1000.0, begin, end)
    values = pulse.accel(time)
    if ring:
        tail = np.where(time > 0.1, np.exp(-(time - 0.1) / 0.05), 0.0)
        values[:, 0] += ring * tail * np.sin(2.0 * np.pi * 60.0 * (time - 0.1))
    return contact_of(Acceleration(time, values, "body", "instantaneous", "cut"))


def test_what_a_cut_record_misses_is_at_least_what_follows():
    pulse = Pulse((-12.3, 0.0, 0.0), 0.0, 0.1)
    for end in np.arange(0.045, 0.1, 0.005):
        event, contact = cut(pulse, end)
        after = 12.3 * (1.0 - pulse.share(contact.end.time))
        # Beyond an end that is found, nu t / 3 is left.
        assert event.lasts_beyond_record and contact.end.missing >= 0.9 * after - 1e-3
        # Nothing limits it before the peak of the acceleration has passed.
        assert math.isinf(contact.end.missing) or end > 0.05
    _, early = cut(pulse, 0.5, begin=0.03)
    assert early.start.missing > 12.3 * pulse.share(0.03)
    assert early.start.time == pytest.approx(0.03) and early.end.missing == 0.0


def test_a_tail_that_rings_misses_nothing():
    pulse = Pulse((-12.3, 0.0, 0.0), 0.0, 0.1)
    for end in np.arange(0.112, 0.16, 0.003):
        _, contact = cut(pulse, end, ring=60.0)
        # Half a period of what is left of it: 60 m/s² / (pi 60 Hz), and its 20 ms mean.
        assert contact.end.missing < 0.35


def test_a_cut_or_clipped_record_has_a_lower_bound_only():
    crash, _ = drawn("front", 0)
    size = np.linalg.norm(crash.change)

    def of(**options):
        return reconstruct(crash, np.random.default_rng(1), **options)

    whole = of().main.delta_v
    assert not whole.at_least and whole.missing == () and whole.resultant_range[1] > size
    made = of(end=round(0.7 * crash.end, 3))
    for unit in made.answers:
        part = unit.delta_v
        assert part.missing == ("after",) and part.at_least
        low, high = part.resultant_range
        assert low < part.resultant < size and math.isinf(high)
        assert part.resultant_bound < 0.1 * part.resultant
        assert "at least" in repr(unit)
    assert any(f.code == "crash.delta-v-at-least" for f in made.findings)
    clipped = of(full_scale=60.0)
    for unit in clipped.answers:
        part = unit.delta_v
        assert part.missing == ("clipped",) and part.resultant < size
        assert part.open_axes[0] and not part.open_axes[2]
        # Backward and beyond; downward it was not clipped.
        assert part.ranges[0, 0] == -math.inf and part.ranges[0, 1] < 0.0
        assert np.isfinite(part.ranges[2]).all()


def test_a_mean_counts_as_clipped_where_all_units_were():
    crash, rng = drawn("front", 0)
    ranges = (60.0, None)
    units = [
        crash.unit(f"IMU{k}", mounting, rng, rate_hz=500.0, full_scale=full)
        for k, (mounting, full) in enumerate(zip(STATED, ranges, strict=True), start=1)
    ]
    made = reconstruct_crash(units, Entry.from_speed(3.5, 0.05))
    first, second = made.units
    assert first.delta_v.at_least and not second.delta_v.at_least
    if made.combined is not None:
        assert not made.combined.delta_v.at_least


def covered(kind, count):
    """Errors over half widths, (n, 4) each, of a single unit and of the mean of two."""
    single, mean = [], []
    for number in range(count):
        crash, rng = drawn(kind, number)
        made = reconstruct(crash, rng)
        single.append(np.divide(*errors(made.units[0], crash)))
        if made.combined is not None:
            mean.append(np.divide(*errors(made.combined, crash)))
    return np.array(single), np.array(mean)


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_bounds_cover_500_drawn_crashes_of_each_kind(kind):
    for who, found in zip(("single", "mean"), covered(kind, 500), strict=True):
        for k, figure in enumerate(FIGURES):
            inside = int((np.abs(found[:, k]) <= 1.0).sum())
            interval = binomtest(inside, len(found)).proportion_ci(LEVEL)
            said = f"{kind} {who} {figure}: {inside} of {len(found)}"
            assert interval.low <= 0.95 <= interval.high, said
            # No bias: the mean of normal deviates, at the same level.
            assert abs(1.96 * found[:, k].mean()) < 3.0 / math.sqrt(len(found)) + 0.1, said


def test_the_draws_have_the_direction_of_their_kind():
    for kind, ((low, high), _) in KINDS.items():
        crash = replace(drawn(kind, 3)[0], braking=0.0)
        angle = abs(math.degrees(math.atan2(-crash.change[1], -crash.change[0])))
        assert min(abs(low), abs(high), 0.0 if low < 0.0 else 360.0) - 1e-9 <= angle
        assert angle <= max(abs(low), abs(high))
    assert drawn_crashes.course(1.0) == 1.0
