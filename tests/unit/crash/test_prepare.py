"""A crash unit, from what it recorded to what can be navigated with."""

from __future__ import annotations

import importlib.util
import itertools
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.coded import coded

from strapdown.crash.consistency import compare_units
from strapdown.crash.measuring_point import at_point
from strapdown.crash.preparation import Preparation, prepare_unit
from strapdown.errors import ConfigError, DataError
from strapdown.sensors.crash_unit import Mounting
from strapdown.sensors.pre_crash import FROM_GRAVITY
from strapdown.sensors.synchronise import synchronise
from strapdown.sensors.uncertainty import TriadUncertainty
from strapdown.tables import ACCEL, GYRO

_spec = importlib.util.spec_from_file_location(
    "made_units", Path(__file__).with_name("made_units.py")
)
_made = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(_made)
G, GYRO_PART, HIGH, LOW, unit = _made.G, _made.GYRO, _made.HIGH, _made.LOW, _made.unit

MOUNTED = Mounting((0.0, 0.0, 0.0), (10.0, 20.0, 170.0))


def force_of(prepared):
    return prepared.imu[ACCEL].to_numpy()


def words(prepared):
    return " ".join(str(f) for f in prepared.findings)


def changed(made, part, edit):
    """The unit with one triad's table changed: part is 0, 1 or 'gyro'."""
    triad = made.gyro if part == "gyro" else made.accelerometers[part]
    table = triad.table.copy()
    table.attrs = dict(triad.table.attrs)
    table = edit(table)
    triad = replace(triad, table=table)
    if part == "gyro":
        return replace(made, gyro=triad)
    both = list(made.accelerometers)
    both[part] = triad
    return replace(made, accelerometers=tuple(both))


def test_without_noise_the_truth_comes_back_in_vehicle_axes():
    made, force, turn = unit(noisy=False, mounting=MOUNTED)
    out = prepare_unit(made)
    # Biases put on and taken off, two rotations: some dozen roundings of 130 m/s².
    assert np.abs(force_of(out) - force).max() <= 50 * np.spacing(130.0)
    assert np.abs(out.imu[GYRO].to_numpy() - turn).max() <= 1e-14
    assert (out.levelling.roll_deg, out.levelling.pitch_deg) == pytest.approx((1.0, -2.0))
    assert out.levelling.from_rest
    assert out.bias_from == (None, 0)
    assert out.gravity_matched
    assert (out.range_spoken == 1).any(axis=0).tolist() == [True, False, True]
    assert not out.findings


def test_with_noise_each_number_is_within_what_it_states():
    z_force, z_tilt, z_gyro, z_high = [], [], [], []
    for seed in range(12):
        made, force, turn = unit(seed=seed, mounting=MOUNTED)
        out = prepare_unit(made)
        C = MOUNTED.C_vs
        error = (force_of(out) - force) @ C
        low = out.range_spoken == 0
        z_force.append((error / out.noise)[low])
        z_high += list((error[:, 0] / out.noise[:, 0])[~low[:, 0]])
        level = np.array([out.levelling.roll_deg - 1.0, out.levelling.pitch_deg + 2.0])
        z_tilt += list(level / out.levelling.sd_deg)
        # After the rest, so that its noise is another.
        later = out.imu.index > -4.0
        rate = ((out.imu[GYRO].to_numpy() - turn) @ C)[later]
        noise = out.gyro_noise[0] / math.sqrt(later.sum())
        z_gyro += list(rate.mean(axis=0) / np.hypot(out.gyro_bias_sd, noise))
    z = np.concatenate(z_force)
    # Normal deviates: variances to five times sqrt(2/n).
    assert z.var() == pytest.approx(1.0, abs=5 * math.sqrt(2 / z.size))
    assert np.var(z_high) == pytest.approx(1.0, abs=5 * math.sqrt(2 / len(z_high)))
    # The sd of a mean is the larger of two estimates, and the tilt's is that of the worse angle.
    assert np.mean(np.square(z_tilt)) < 1.0 + 5 * math.sqrt(2 / 24)
    assert np.mean(np.square(z_gyro)) < 1.0 + 5 * math.sqrt(2 / 36)


def test_a_bias_of_the_low_range_along_the_vertical_is_gone_and_the_others_stay():
    made, force, _ = unit(noisy=False, low_bias=(0.0, 0.0, 0.15), roll=0.0, pitch=0.0)
    out = prepare_unit(made)
    assert out.gravity_correction == pytest.approx(0.15)
    assert np.abs(force_of(out) - force).max() <= 1e-12
    out = prepare_unit(made, Preparation(match_gravity=False))
    assert not out.gravity_matched
    assert force_of(out)[0, 2] == pytest.approx(-G + 0.15)


def test_a_stated_attitude_gives_the_bias_of_the_lowest_range():
    poor = replace(LOW, bias=8.0)
    made, force, _ = unit(
        noisy=False, low=poor, low_bias=(1.0, -2.0, 9.0), start=-0.1, driven=False
    )
    with pytest.raises(DataError, check=coded("crash.rest-not-level", quantity="levelling")):
        prepare_unit(made)
    out = prepare_unit(made, Preparation(levelling=(1.0, -2.0, 0.2), steady_acceleration=0.0))
    assert out.bias_from == (FROM_GRAVITY, 0)
    assert not out.levelling.from_rest
    assert out.levelling.sd_deg == 0.2
    # The range clips at 2 g with its bias in it, where the high range speaks with the same.
    assert np.abs(force_of(out) - force).max() <= 1e-12


def test_zeroed_channels_get_gravity_back():
    made, force, _ = unit(noisy=False, start=-0.1, driven=False, low=replace(LOW, bias=8.0))
    at_rest = force[0]
    made = changed(made, 0, lambda t: t - at_rest)
    out = prepare_unit(made, Preparation(levelling=(1.0, -2.0, 0.5)))
    # Clipped at 2 g after the zero: the high range speaks there and hangs on the low one.
    assert np.abs(force_of(out) - force).max() <= 1e-12


def test_a_better_known_sensor_is_not_corrected_by_a_poor_attitude():
    made, _, _ = unit()
    out = prepare_unit(made, Preparation(levelling=(0.0, 0.0, 5.0)))
    assert out.bias_from == (None, 0)
    assert out.levelling.roll_deg == 0.0


def test_a_steady_stretch_says_so_and_is_graded():
    made, _, _ = unit(start=-3.0, driven=False)
    out = prepare_unit(made)
    assert out.rest.grade == "steady"
    assert out.rest_accel_sd == 0.3
    assert out.levelling.sd_deg == pytest.approx(math.degrees(0.3 / G), rel=0.01)
    assert "may be at speed" in words(out)
    assert prepare_unit(made, Preparation(moving_at_impact=False)).levelling.sd_deg < 0.1


def test_a_record_that_starts_in_the_crash():
    made, _, _ = unit(start=0.01)
    with pytest.raises(
        DataError,
        check=coded("crash.record-starts-in-crash", file="IMU1", quantity="rest", begin=0.01),
    ):
        prepare_unit(made)
    out = prepare_unit(made, Preparation(levelling=(0.0, 0.0, 1.5)))
    assert out.rest is None
    assert out.gyro_bias_sd == (0.05,) * 3
    assert out.bias_from == (None, None)
    assert "starts at 0.01 s" in words(out)
    assert "its bias is not known" in words(out)


def test_no_quiet_stretch():
    made, _, _ = unit(start=-3.0, driven=False)
    rng = np.random.default_rng(0)
    shaken = changed(made, "gyro", lambda t: t + 0.3 * rng.normal(size=t.shape))
    with pytest.raises(DataError, check=coded("crash.no-rest")):
        prepare_unit(shaken)


def test_a_stated_rest_is_taken():
    made, _, _ = unit()
    out = prepare_unit(made, Preparation(rest=(-8.0, -6.0)))
    assert out.rest.grade == "stated"
    assert out.rest.end == -6.0


def test_the_last_range_and_the_gyro_at_their_ends():
    made, _, _ = unit(peak=150 * G, gyro=replace(GYRO_PART, full_scale=1.0))
    out = prepare_unit(made)
    assert out.clipped[:, 0].any()
    assert out.gyro_clipped[:, 2].any()
    text = words(out)
    assert "IMU1, high-G, accel_x" in text
    assert "lower bound" in text
    assert "IMU1, gyro, gyro_z: " in text


def test_an_end_that_is_not_where_it_is_stated():
    made, _, _ = unit(peak=120 * G, high=replace(HIGH, full_scale=100 * G))
    wrong = replace(made.accelerometers[1], uncertainty=replace(HIGH, full_scale=500 * G))
    out = prepare_unit(replace(made, accelerometers=(made.accelerometers[0], wrong)))
    assert out.clipped[:, 0].any()
    assert "clipped between -980.66" in words(out)


def test_swapped_axes_between_the_ranges():
    made, _, _ = unit(roll=0.0, pitch=0.0)

    def swap(table):
        out = table.copy()
        out.attrs = dict(table.attrs)
        out["accel_x"], out["accel_y"] = table["accel_y"], -table["accel_x"]
        return out

    text = words(prepare_unit(changed(made, 1, swap)))
    assert "IMU1, high-G, accel_y: it corresponds to -x of low-G" in text
    assert "the source changes between" in text


def test_a_low_range_that_is_never_clear():
    made, _, _ = unit(low_bias=(40.0, 40.0, 40.0))
    with pytest.raises(DataError, match="levelling"):
        prepare_unit(made)
    assert "the two cannot be compared" in words(
        prepare_unit(made, Preparation(levelling=(0, 0, 1)))
    )


def test_gravity_in_g():
    made, _, _ = unit()
    with pytest.raises(DataError, check=coded("crash.specific-force-rest-long-gravity")):
        prepare_unit(changed(made, 0, lambda t: t / G))


def test_a_length_that_contradicts_what_is_stated():
    made, _, _ = unit(low_bias=(0.0, 0.0, -1.4))
    assert "from gravity" in words(prepare_unit(made))


def test_on_its_roof():
    made, _, _ = unit(roll=180.0)
    assert "is upside down" in words(prepare_unit(made))


def with_value(table, row, column, value):
    table.iloc[row, table.columns.get_loc(column)] = value
    return table


@pytest.mark.parametrize(
    ("edit", "part", "says"),
    [
        (lambda t: with_value(t, 6, "accel_y", np.nan), 0, "IMU1, low-G, row 7, accel_y"),
        (lambda t: t.iloc[::-1], 1, "IMU1, high-G, row 2, time"),
        (
            lambda t: t.iloc[1:],
            "gyro",
            r"IMU1, gyro, time: the 2200 stamps from -9\.995 to 1 s are not the",
        ),
        (
            lambda t: t.drop(columns="accel_z"),
            1,
            "IMU1, high-G, accel_z: the part has no accel_z; a motion in space",
        ),
    ],
)
def test_bad_input_names_the_part_the_row_and_the_quantity(edit, part, says):
    def keep(table):
        attrs = dict(table.attrs)
        out = edit(table)
        out.attrs = attrs
        return out

    made, _, _ = unit()
    with pytest.raises(DataError, match=says):
        prepare_unit(changed(made, part, keep))


def test_parts_that_are_missing():
    made, _, _ = unit()
    with pytest.raises(
        DataError, check=coded("sensors.no-gyro-path-needs-turning", quantity="gyro")
    ):
        prepare_unit(replace(made, gyro=None))
    with pytest.raises(DataError, check=coded("sensors.no-accelerometer")):
        prepare_unit(replace(made, accelerometers=()))


def test_a_gap_is_told():
    made, _, _ = unit()

    def cut(table):
        out = table[(table.index < 0.2) | (table.index > 0.3)]
        out.attrs = dict(table.attrs)
        return out

    for part in (0, 1, "gyro"):
        made = changed(made, part, cut)
    assert "from 0.2" in words(prepare_unit(made)) or "from 0.195" in words(prepare_unit(made))


@pytest.mark.parametrize(("offset", "drift"), [(0.0013, 0.0), (0.0, 5e-4)])
def test_perfect_sensors_off_the_common_stamps_are_not_blamed(offset, drift):
    # Their standard deviations are zero, and what interpolation leaves is infinitely many.
    made, *_ = unit(
        noisy=False,
        low=TriadUncertainty(full_scale=8 * G),
        high=TriadUncertainty(full_scale=100 * G),
        gyro=TriadUncertainty(),
        high_bias=(0.0, 0.0, 0.0),
        gyro_bias=(0.0, 0.0, 0.0),
    )

    def late(table):
        table.index = table.index * (1.0 + drift) + offset
        return table

    for part in (0, 1, "gyro"):
        made = changed(made, part, late)
    (at,) = synchronise([made]).units
    out = prepare_unit(at.unit)
    assert (out.range_spoken[:, 0] > 0).any()
    assert not out.findings


@pytest.mark.parametrize("sampling", ["instantaneous", "mean"])
def test_a_low_range_that_rings_into_its_end_does_not_speak_behind_a_low_pass(sampling):
    # 12 g at 195 Hz, which dies away in 30 ms, come to a pulse of 13 g: the low range is cut on
    # either side, and what a low-pass leaves of that is well within it.
    made, force, _ = unit(rate=2000.0, noisy=False, low_bias=(0.0,) * 3, high_bias=(0.0,) * 3)
    time = made.accelerometers[0].table.index.to_numpy()
    after = np.maximum(time - 0.001, 0.0)
    rings = 12 * G * np.exp(-after / 0.030) * np.sin(2 * np.pi * 195.0 * after)

    def ringing(full):
        def edit(table):
            table["accel_x"] = np.clip(force[:, 0] + rings, -full, full)
            return table

        return edit

    made = changed(changed(made, 0, ringing(2 * G)), 1, ringing(100 * G))
    # The integral of a damped sine, w / (w² + 1/tau²).
    turning = 2 * np.pi * 195.0
    left = 12 * G * turning / (turning**2 + 0.030**-2)
    (at,) = synchronise([made], sampling=sampling).units
    out = prepare_unit(at.unit)
    stamps, cut = at.accelerometers[0].triad.table.index.to_numpy(), np.abs(force[:, 0] + rings)
    for first, last in itertools.pairwise(stamps[np.abs(stamps) < 0.2]):
        within = cut[(time > first) & (time < last)]
        if within.max() > 2 * G:
            row = int(np.searchsorted(stamps, last - 1e-9))
            assert out.range_spoken[row - 1 : row + 1, 0].all() or sampling == "mean"
            assert out.range_spoken[row, 0] == 1
    assert "exceeds its stated" not in words(out)
    changed_by = np.trapezoid((out.imu["accel_x"] - force[0, 0])[-0.2:0.4], dx=0.005)
    if sampling == "mean":
        changed_by = (out.imu["accel_x"] - force[0, 0])[-0.2:0.4].sum() * 0.005
    truth = np.trapezoid((force[:, 0] - force[0, 0])[np.abs(time - 0.1) < 0.3], dx=5e-4) + left
    # Of 7.2 m/s; speaking where it was cut, the low range took a metre per second of it.
    assert changed_by == pytest.approx(truth, abs=0.01)


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"gravity": 32.0}, "gravity"),
        ({"rest": "all"}, "rest"),
        ({"levelling": (0.0, 100.0, 1.0)}, "levelling"),
        ({"steady_rate": -1.0}, "steady_rate"),
        ({"margin": 1.5}, "margin"),
    ],
)
def test_options_out_of_range(options, says):
    made, _, _ = unit()
    with pytest.raises(ConfigError, match=says):
        prepare_unit(made, Preparation(**options))


def test_two_prepared_units_agree_at_a_common_point():
    units = []
    for seed in (1, 2):
        made, _, _ = unit(seed=seed, name=f"IMU{seed}", mounting=MOUNTED)
        units.append(at_point(prepare_unit(made), (0.0, 0.0, 0.0)))
    out = compare_units(units)
    assert out.agree
    assert not out.findings
    shared = set(units[0].effects.names) & set(units[1].effects.names)
    assert shared == {"vehicle levelling north", "vehicle levelling east"}
