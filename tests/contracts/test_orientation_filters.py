"""What every orientation filter promises, held for every entry of the table."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
import pytest
from tests.coded import coded

from strapdown import rotation
from strapdown._kernels import orientation as kernel
from strapdown.errors import ConfigError, DataError
from strapdown.orientation_filters import FILTERS, OrientationTracker, make_filter, run_filter
from strapdown.tables import GYRO, MAG, imu_table

VARIANTS = [*FILTERS, "error-state:velocity=10,block=0.03", "complementary:tilt=1,declination=4"]
START = rotation.quaternion_from_euler([20.0, -35.0, 250.0])
NONE = np.full(3, np.nan)


def log(samples=900, *, mag=True, sampling="instantaneous"):
    """Bursts, gaps, a rest, a fall, missing samples of force and field, and fast turns."""
    rng = np.random.default_rng(7)
    step = rng.choice([0.004, 0.01, 0.012], samples)
    step[[400, 700]] = 0.4, 2.5
    time = np.cumsum(step) + 17.0
    gyro = rng.normal(0.0, 1.0, (samples, 3)) * (np.arange(samples) > 600)[:, None]
    accel = np.array([1.0, -2.0, -9.5]) + gyro
    accel[500:520] = 0.01
    table = imu_table(time, gyro, accel, sampling=sampling)
    if mag:
        table[MAG] = np.array([20.0, 3.0, 40.0]) + 5.0 * gyro
        table.iloc[200:300, 6:] += [0.0, 30.0, -40.0]
        table.iloc[::3, 6:] = np.nan
    table.iloc[5::7, 3:6] = np.nan
    table.iloc[750:770, 3:6] = np.nan
    return table


def test_the_log_takes_every_path():
    """Rests, gaps, a new leveling and a disturbed field are in the log of these tests."""
    chosen = make_filter("error-state")
    record, _ = chosen.advance(chosen.begin(), log())
    assert record[kernel.REST_TIME] > 0.5
    assert record[kernel.GAPS] == 2.0
    assert record[kernel.DISTURBED_TIME] > 0.0
    assert record[kernel.LEVELED] == record[kernel.HEADED] == 1.0


@pytest.mark.parametrize("given", [None, START])
@pytest.mark.parametrize("sampling", ["instantaneous", "mean"])
@pytest.mark.parametrize("mag", [True, False])
@pytest.mark.parametrize("variant", VARIANTS)
def test_sample_by_sample_gives_the_bits_of_the_batch(variant, mag, sampling, given):
    chosen, table = make_filter(variant), log(mag=mag, sampling=sampling)
    run = run_filter(chosen, table, given)
    tracker = OrientationTracker(chosen, given, sampling)
    sd = run.euler_sd()
    for k, (time, row) in enumerate(zip(table.index, table.to_numpy(), strict=True)):
        tracker.update(time, row[:3], row[3:6], row[6:] if mag else None)
        # In the first rows a declination belongs to a heading that is not yet found.
        if k > 10:
            assert np.array_equal(tracker.quaternion, run.q_nb[k])
            if sd is not None:
                assert np.allclose(tracker.roll_pitch_heading_sd, sd[k], rtol=1e-12)
    assert np.array_equal(tracker.gyro_bias, run.bias)
    if sd is None:
        assert tracker.roll_pitch_heading_sd is None


@pytest.mark.parametrize("mag", [True, False])
@pytest.mark.parametrize("variant", VARIANTS)
def test_a_run_cut_anywhere_and_continued_gives_the_same_bits(variant, mag):
    chosen, table = make_filter(variant), log(mag=mag)
    whole_record, whole = chosen.advance(chosen.begin(), table)
    record, parts, at = chosen.begin(), [], 0
    for length in (1, 1, 2, 57, 0, 390, 1, 249, len(table)):
        record, part = chosen.advance(record, table.iloc[at : at + length])
        parts.append(part)
        at += length
    assert np.array_equal(np.vstack(parts), whole)
    assert np.array_equal(record, whole_record)


@pytest.mark.parametrize("variant", VARIANTS)
def test_advance_leaves_its_inputs_alone(variant):
    chosen, table = make_filter(variant), log()
    record, copy = chosen.begin(), table.copy()
    before = record.copy()
    chosen.advance(record, table)
    assert np.array_equal(record, before)
    assert table.equals(copy)


@pytest.mark.parametrize("variant", VARIANTS)
def test_a_bad_sample_is_refused_and_changes_nothing(variant):
    tracker = OrientationTracker(make_filter(variant))
    good = ([0.1, 0.2, 0.3], [0.0, 0.0, -9.8], [20.0, 0.0, 40.0])
    tracker.update(1.0, *good)
    tracker.update(1.1, *good)
    before = tracker._record.copy()
    for time, code in (
        (1.1, "attitude.time-does-not-advance-followed"),
        (0.5, "attitude.time-does-not-advance-followed"),
        (np.nan, "attitude.time-rate-time-three-finite"),
        (None, "attitude.time-rate-time-three-finite"),
    ):
        with pytest.raises(DataError, check=coded(code)):
            tracker.update(time, *good)
    for gyro in ([np.nan, 0.2, 0.3], [0.1, np.inf, 0.3], [0.1, 0.2], [0.1, 0.2, 1e200], "abc"):
        with pytest.raises(DataError, check=coded("attitude.time-rate-time-three-finite")):
            tracker.update(1.2, gyro, *good[1:])
    with pytest.raises(DataError, check=coded("attitude.time-rate-time-three-finite")):
        tracker.update(1.2, good[0], [0.0, -9.8])
    assert np.array_equal(tracker._record, before)
    tracker.update(1.2, *good)
    assert not np.array_equal(tracker._record, before)


@pytest.mark.parametrize("variant", VARIANTS)
def test_no_accelerometer_and_no_finite_rate_are_refused(variant):
    chosen, table = make_filter(variant), log()
    with pytest.raises(DataError, check=coded("attitude.filter-needs-accelerometer")):
        run_filter(chosen, table[GYRO])
    table.iloc[9, 1] = np.nan
    with pytest.raises(DataError, check=coded("attitude.time-rate-time-three-finite")) as caught:
        run_filter(chosen, table)
    assert caught.value.finding.row == 10


@pytest.mark.parametrize("variant", VARIANTS)
def test_the_label_makes_the_same_filter_again(variant):
    chosen = make_filter(variant)
    assert make_filter(chosen.label) == chosen


@pytest.mark.parametrize("name", FILTERS)
def test_every_option_is_checked(name):
    for option in (field.name for field in fields(FILTERS[name])):
        wrong = {"declination": "-181", "velocity": "-1"}
        for value in ("nan", wrong.get(option, "0")):
            with pytest.raises(ConfigError, check=coded("attitude.filter-option-out-of-range")):
                make_filter(f"{name}:{option}={value}")
        with pytest.raises(ConfigError, check=coded("attitude.option-not-number")):
            make_filter(f"{name}:{option}=much")
    with pytest.raises(ConfigError, check=coded("attitude.no-orientation-filter")):
        make_filter("madgwik")


@pytest.mark.parametrize("variant", FILTERS)
def test_it_levels_and_heads_with_the_first_sample(variant):
    """From any attitude, upside down and steep ones included, to rounding."""
    rng = np.random.default_rng(3)
    for euler in np.column_stack(
        [rng.uniform(-180, 180, 20), rng.uniform(-85, 85, 20), rng.uniform(0, 360, 20)]
    ):
        q = rotation.quaternion_from_euler(euler)
        back = rotation.conjugate(q)
        tracker = OrientationTracker(make_filter(variant))
        force = rotation.rotate(back, [0.0, 0.0, -9.8])
        # Any unit of the field.
        tracker.update(0.0, [0.0, 0.0, 0.0], force, rotation.rotate(back, [0.2, 0.0, 0.43]))
        assert rotation.rotation_angle(tracker.quaternion, q) < 1e-12


@pytest.mark.parametrize("variant", FILTERS)
def test_missing_forces_and_fields_are_no_samples(variant):
    """A force or field of NaN leaves the attitude to the gyros alone."""
    chosen = make_filter(variant)
    tracker, alone = OrientationTracker(chosen), OrientationTracker(chosen)
    for each in (tracker, alone):
        each.update(0.0, [0.0, 0.0, 1.0], [0.0, 0.0, -9.8])
    for k in range(1, 101):
        tracker.update(k * 0.01, [0.0, 0.0, 1.0], [0.0, np.nan, -9.8], [np.nan, 1.0, 1.0])
        alone.update(k * 0.01, [0.0, 0.0, 1.0])
    assert np.array_equal(tracker.quaternion, alone.quaternion)
    about = np.degrees(1.0)
    assert np.allclose(tracker.roll_pitch_heading, [0.0, 0.0, about], atol=1e-9)


@pytest.mark.parametrize("variant", FILTERS)
def test_a_weightless_start_levels_later(variant):
    tracker = OrientationTracker(make_filter(variant))
    for k in range(50):
        tracker.update(k * 0.01, [0.0, 0.0, 0.0], [0.0, 0.01, 0.0])
    assert np.array_equal(tracker.quaternion, [1.0, 0.0, 0.0, 0.0])
    tracker.update(0.5, [0.0, 0.0, 0.0], [0.0, -9.8, 0.0])
    assert np.allclose(tracker.roll_pitch_heading[:2], [90.0, 0.0], atol=1e-9)
