"""Faults put into a sound made-up channel are found, and the sound channel has none."""

from __future__ import annotations

import numpy as np
import pytest

from strapdown.errors import ConfigError, DataError
from strapdown.sensors.channel_health import check_channel, check_peers
from strapdown.sensors.redundant_channels import compare_redundant

STEP = 1e-4
TIME = np.arange(-500, 3000) * STEP
NOISE = 1.0
ENTRY = 15.0


def sound(seed=0, noise=NOISE):
    """A stop from 15 m/s within 80 ms, with ringing and noise."""
    within = (TIME > 0) & (TIME < 0.08)
    pulse = np.where(within, -2 * ENTRY / 0.08 * np.sin(np.pi * TIME / 0.08) ** 2, 0.0)
    ring = np.where(TIME > 0, 80 * np.sin(2 * np.pi * 180 * TIME) * np.exp(-TIME / 0.02), 0.0)
    return pulse + ring + noise * np.random.default_rng(seed).standard_normal(TIME.size)


def check(values, time=TIME, **options):
    return check_channel(time, values, "ch", entry_speed=ENTRY, **options)


def test_sound_channels_have_no_faults():
    # Fifty of them: an alarm in a thousand would show once in twenty such tests.
    for seed in range(50):
        health = check(sound(seed), full_scale=2000.0)
        assert health.kinds == ()
        # The sd of 500 samples is known to 3 %.
        assert health.noise == pytest.approx(NOISE, rel=0.15)


def test_stuck():
    values = sound()
    values[1500:1600] = values[1500]
    (fault,) = check(values).faults
    assert (fault.kind, fault.size) == ("stuck", pytest.approx(0.01))
    assert fault.at == pytest.approx(TIME[1500])


def test_coarse_steps_at_rest_are_not_stuck():
    # Noise of 0.8 m/s² in steps of 2: four of five samples at rest are zero.
    values = 2.0 * np.round(sound(noise=0.8) / 2.0)
    assert check(values).kinds == ()


def test_dead_from_the_beginning_is_stuck():
    health = check(np.zeros(TIME.size))
    assert "stuck" in health.kinds
    assert "velocity" in health.kinds


def test_saturation_by_the_range_and_by_a_flat_top():
    values = sound()
    clipped = np.clip(values, -200.0, 200.0)
    by_range = [f for f in check(clipped, full_scale=200.0).faults if f.kind == "saturation"]
    by_shape = [f for f in check(clipped).faults if f.kind == "saturation"]
    first = TIME[np.flatnonzero(np.abs(values) >= 196.0)[0]]
    assert by_range[0].at == pytest.approx(first)
    assert "constant over" in by_shape[0].finding.what
    assert "a range of 200" in by_range[0].finding.what


def test_jump_between_quiet_levels():
    values = sound() + np.where(TIME > 0.2, 12.0, 0.0)
    faults = {f.kind: f for f in check(values).faults}
    # 12 m/s² for 0.1 s and at the end are an offset and 1.2 m/s, which is not yet too much.
    assert set(faults) == {"jump", "offset"}
    assert faults["jump"].size == pytest.approx(12.0, abs=1.0)
    assert faults["jump"].at == pytest.approx(0.2, abs=0.006)


def test_ramp_is_no_jump():
    values = sound() + np.where(TIME > 0.15, 250.0 * (TIME - 0.15), 0.0)
    assert "jump" not in check(values).kinds


def test_offset_and_velocity_that_does_not_come_to_rest():
    drift = sound() + np.where(TIME > 0.02, 30.0, 0.0)
    health = check(drift)
    assert {"offset", "velocity"} <= set(health.kinds)
    # The stop to zero and 30 m/s² over 0.28 s; noise adds sqrt(3500) 1e-4 = 6 mm/s, the zero
    # from 500 samples 0.3 s * 0.045, the ringing's integral 80/(2π 180) = 0.07 at most.
    assert health.velocity == pytest.approx(8.4, abs=0.15)
    assert health.offset == pytest.approx(30.0, abs=0.3)
    assert check(drift, acceleration=False).kinds == ()


def test_peers_tell_noise_and_records_that_end_early():
    channels = [check(sound(k)) for k in range(4)]
    loud = check(sound(7, noise=4.0))
    short = check(sound(8)[:1200], time=TIME[:1200])
    out = check_peers([*channels, loud, short])
    assert [c.kinds for c in out[:4]] == [()] * 4
    assert out[4].kinds == ("noise",)
    assert "cut" in out[5].kinds
    assert check_peers([]) == ()


def test_bad_input_is_refused():
    values = sound()
    with pytest.raises(DataError, match="too few for the noise"):
        check(values[495:], time=TIME[495:])
    with pytest.raises(DataError, match="shape"):
        check(values[:-1])
    values[7] = np.nan
    with pytest.raises(DataError, match="not a finite number") as error:
        check(values)
    assert error.value.finding.row == 8
    with pytest.raises(DataError, match="does not increase"):
        check(sound(), time=TIME[::-1])


class TestRedundant:
    def test_two_that_agree(self):
        result = compare_redundant(sound(1), 1.02 * sound(2), TIME, rest_until=0.0)
        assert result.agree
        # Noise of 1 after 300 Hz is 0.3, of a signal of 100: 1e-5 of the gain's square.
        assert result.gain == pytest.approx(1.02, abs=1e-3)
        assert result.correlation > 0.9999
        assert result.apart_at is None

    def test_gain_turned_sign_and_zero_that_moves(self):
        gain = compare_redundant(sound(1), 1.1 * sound(2), TIME, rest_until=0.0)
        assert "gain" in gain.findings[0].what
        turned = compare_redundant(sound(1), -sound(2), TIME, rest_until=0.0)
        assert turned.gain == pytest.approx(-1.0, abs=1e-3)
        moved = sound(2) + np.where(TIME > 0.1, 20.0, 0.0)
        drift = compare_redundant(sound(1), moved, TIME, rest_until=0.0)
        (finding,) = [f for f in drift.findings if "integrals" in f.what]
        # 20 m/s² make 5 % of 15 m/s in 37 ms.
        assert drift.apart_at == pytest.approx(0.1375, abs=0.003)
        assert "permanently from" in finding.what

    def test_failure_is_dated(self):
        failed = sound(2)
        failed[TIME > 0.03] = 0.0
        result = compare_redundant(sound(1), failed, TIME, rest_until=0.0)
        assert not result.agree
        assert 0.03 < result.apart_at < 0.035

    def test_bad_input_is_refused(self):
        a = sound()
        with pytest.raises(DataError, match="zero throughout"):
            compare_redundant(a, np.zeros_like(a), TIME)
        with pytest.raises(DataError, match="shapes"):
            compare_redundant(a, a[1:], TIME)
        with pytest.raises(DataError, match="no sample before"):
            compare_redundant(a, a, TIME, rest_until=-1.0)
        with pytest.raises(ConfigError, match="bandwidth"):
            compare_redundant(a, a, TIME, bandwidth=0.0)
        a[3] = np.inf
        with pytest.raises(DataError, match="not a finite"):
            compare_redundant(a, a, TIME)
