"""Units of different rates, starts and mountings on one clock, against the motion they felt."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from tests.coded import coded

from strapdown import rotation
from strapdown.errors import ConfigError, DataError
from strapdown.sensors.crash_unit import CrashUnit, Mounting, RecordedTriad
from strapdown.sensors.synchronise import synchronise
from strapdown.sensors.uncertainty import TriadUncertainty
from strapdown.tables import ACCEL, GYRO

AT_REST = np.array([0.0, 0.0, -9.8])
# A crash of two unlike pulses on the vehicle, and its turning, as functions of common time.
PULSES = [((-120.0, 15.0, 5.0), 0.0, 0.1), ((40.0, 60.0, -10.0), 0.15, 0.08)]
TURNS = [((0.2, -0.3, 2.0), 0.0, 0.12), ((-0.5, 0.4, -0.7), 0.13, 0.1)]


def haversines(parts, time):
    out = np.zeros((len(time), 3))
    for size, begin, length in parts:
        s = np.clip((time - begin) / length, 0.0, 1.0)
        out += np.outer(np.sin(np.pi * s) ** 2, size)
    return out


def force(time):
    return haversines(PULSES, time) + AT_REST


def turning(time):
    return haversines(TURNS, time)


def mean_of(parts, time, length):
    """Exact mean over the interval that ends at each stamp."""

    def integral(t):
        total = np.zeros((len(t), 3))
        for size, begin, long in parts:
            s = np.clip((t - begin) / long, 0.0, 1.0)
            total += np.outer(long * (0.5 * s - np.sin(2 * np.pi * s) / (4 * np.pi)), size)
        return total

    return (integral(time) - integral(time - length)) / length


def triad(columns, function, rate, begin, end, shift, mounting, *, noise=0.0, seed=1, **facts):
    """Samples of a function of common time, on a clock that stands at common time + shift."""
    time = np.arange(round((end - begin) * rate) + 1) / rate + begin
    values = function(time) @ mounting.C_vs
    if noise:
        values = values + noise * np.random.default_rng(seed).normal(size=values.shape)
    table = pd.DataFrame(values, index=pd.Index(time + shift, name="time"), columns=columns)
    table.attrs["sampling"] = "instantaneous"
    density = noise / np.sqrt(rate)
    return RecordedTriad(
        table, TriadUncertainty(noise_density=density, **facts), columns[0].split("_")[0]
    )


IMU_MOUNT = Mounting(angles_deg=(3.0, -5.0, 20.0))
LAB_MOUNT = Mounting(angles_deg=(0.0, 10.0, -90.0))


def imu(name="IMU1", shift=5.0, rate=200.0, begin=-1.0, end=1.0, noise=0.0, **keys):
    return CrashUnit(
        name,
        (triad(ACCEL, force, rate, begin, end, shift, IMU_MOUNT, noise=noise, seed=2),),
        triad(GYRO, turning, rate, begin, end, shift, IMU_MOUNT, noise=noise / 100, seed=3),
        mounting=IMU_MOUNT,
        **{"trigger": shift, "trigger_sd": 1e-4, **keys},
    )


def lab(name="LAB1", shift=-2.0, begin=-0.4, end=0.6, noise=0.0, **keys):
    return CrashUnit(
        name,
        (triad(ACCEL, force, 1e4, begin, end, shift, LAB_MOUNT, noise=noise, seed=4),),
        mounting=LAB_MOUNT,
        **{"trigger": shift, "trigger_sd": 2e-5, "gyro_from": "IMU1", **keys},
    )


def with_table(unit, change, *, gyro=False):
    """The unit with one table changed."""
    part = unit.gyro if gyro else unit.accelerometers[0]
    table = change(part.table.copy())
    table.attrs = dict(part.table.attrs)
    part = replace(part, table=table)
    return replace(unit, gyro=part) if gyro else replace(unit, accelerometers=(part,))


def with_text(table):
    table = table.astype(object)
    table.iloc[200, 1] = "n/a"
    return table


def with_inf(table):
    table.iloc[200, 1] = np.inf
    return table


def test_everything_lands_on_one_clock_and_common_stamps():
    both = synchronise([lab(), imu()])
    assert [u.unit.name for u in both.units] == ["LAB1", "IMU1"]
    # Whole multiples of the step within what both cover.
    np.testing.assert_allclose(both.time, np.arange(-80, 121) / 200.0, atol=1e-12)
    one, two = both.unit("LAB1"), both.unit("IMU1")
    for u in both.units:
        for part in (*u.unit.accelerometers, u.unit.gyro):
            np.testing.assert_array_equal(part.table.index, both.time)
    # The recorder's own stamps are common ones: its samples are as they were.
    assert two.accelerometers[0].method == "as recorded"
    np.testing.assert_allclose(
        two.unit.accelerometers[0].table, force(both.time) @ IMU_MOUNT.C_vs, atol=1e-9
    )
    # A haversine begins and ends with a jump J = 2 (π/T)² A of its second derivative, with the
    # spectrum J/(2π f)³. What lies above the passband's 50 Hz is at most 2 ∫ of it, J/((2π)³ 50²)
    # a corner, some 0.4 m/s² for each; and 1e-4 of the rest.
    got = one.unit.accelerometers[0].table.to_numpy()
    truth = force(both.time) @ LAB_MOUNT.C_vs
    jumps = sum(2.0 * 2.0 * (np.pi / t) ** 2 * np.linalg.norm(a) for a, _, t in PULSES)
    bound = jumps / ((2.0 * np.pi) ** 3 * 50.0**2) + 1e-4 * 130.0
    assert np.abs(got - truth).max() < bound
    assert one.accelerometers[0].method == "decimated"
    assert (one.offset, one.time_sd, one.how) == (-2.0, 2e-5, "trigger")


def test_borrowed_gyro_is_turned_through_both_mountings():
    both = synchronise([lab(), imu()])
    borrower = both.unit("LAB1")
    # What a gyro on the laboratory's block would have read.
    np.testing.assert_allclose(
        borrower.unit.gyro.table, turning(both.time) @ LAB_MOUNT.C_vs, atol=1e-12
    )
    assert borrower.lender == "IMU1"
    assert borrower.gyro_time_sd == pytest.approx(np.hypot(1e-4, 2e-5))
    assert both.unit("IMU1").gyro_time_sd == 0.0


def test_borrowed_uncertainty_is_turned_with_it():
    lender = imu()
    lender = replace(
        lender,
        mounting=Mounting(),
        gyro=replace(
            lender.gyro,
            uncertainty=TriadUncertainty(bias=(1.0, 2.0, 3.0), full_scale=(8.0, 9.0, 30.0)),
        ),
    )
    borrower = replace(lab(), mounting=Mounting(angles_deg=(0.0, 0.0, 90.0)))
    got = synchronise([lender, borrower]).unit("LAB1").unit.gyro.uncertainty
    # The borrower's forward is the vehicle's right.
    np.testing.assert_allclose(got.bias, (2.0, 1.0, 3.0), rtol=1e-12)
    np.testing.assert_allclose(got.full_scale, (9.0, 8.0, 30.0), rtol=1e-12)


def test_means_keep_the_velocity_change():
    both = synchronise([lab(), imu()], sampling="mean")
    one = both.unit("LAB1")
    assert one.accelerometers[0].method == "averaged"
    assert one.unit.accelerometers[0].table.attrs["sampling"] == "mean"
    got = one.unit.accelerometers[0].table.to_numpy() @ LAB_MOUNT.C_vs.T - AT_REST
    # Trapezoids over 0.1 ms: a''h²/12 with a'' = 2 (π/T)² A.
    jump = max(2.0 * (np.pi / t) ** 2 * np.linalg.norm(a) for a, _, t in PULSES)
    np.testing.assert_allclose(got, mean_of(PULSES, both.time, 0.005), atol=jump * 1e-8 / 12)
    # The recorder's means are integrals of polynomials of degree 5 through samples 5 ms apart: at
    # the pulses' ends, where the second derivative jumps, off by no more than jump h²/8.
    two = both.unit("IMU1").unit.accelerometers[0].table.to_numpy() @ IMU_MOUNT.C_vs.T
    np.testing.assert_allclose(
        two - AT_REST, mean_of(PULSES, both.time, 0.005), atol=jump * 0.005**2 / 8
    )


def test_correlation_finds_clocks_that_nothing_states():
    # Noise of 0.5 m/s²; the laboratory's clock is 7.0123 s behind, its trigger unknown.
    off = 5.0 - 12.0123
    units = [imu(noise=0.5), lab(shift=off, trigger=None, noise=2.0)]
    both = synchronise(units, method="correlation")
    found = both.unit("LAB1")
    assert both.reference == "IMU1"
    assert both.trigger_sd == 1e-4
    assert both.unit("IMU1").time_sd == 0.0
    assert found.how == "correlation of the specific force"
    # Of the bound of Cramér and Rao for noise of 0.5 at 200 Hz over pulses of some 100 m/s²:
    # sqrt(Σ f'²) is about 120 · π/T · sqrt(T/2 · 200) = 12000: 0.04 ms.
    assert 1e-5 < found.time_sd < 2e-4
    assert abs(found.offset - off) < 4.0 * found.time_sd


def test_correlation_takes_off_the_lag_of_a_part_s_own_low_pass():
    """A single pole of 100 Hz is 1.59 ms late."""
    from strapdown.sensors.error_chain import low_pass

    unit = lab(shift=0.7, trigger=None)
    part = unit.accelerometers[0]
    time = part.table.index.to_numpy()
    values = low_pass(time, part.table.to_numpy(), 100.0)
    late = pd.DataFrame(values, index=part.table.index, columns=ACCEL)
    late.attrs = dict(part.table.attrs)
    told = replace(part, table=late, uncertainty=TriadUncertainty(bandwidth=100.0))
    both = synchronise([imu(), replace(unit, accelerometers=(told,))], method="correlation")
    # The pole's delay is τ/(1 + (ω τ)²): at the pulses' 10 Hz a hundredth less, and at their
    # harmonics up to a tenth of it.
    assert both.unit("LAB1").offset == pytest.approx(0.7, abs=0.1 * 1.6e-3)


def test_correlation_uses_rates_where_they_say_more():
    second = imu("IMU2", shift=1.0, trigger=None)
    flat = replace(
        second.accelerometers[0],
        table=second.accelerometers[0].table + np.random.default_rng(5).normal(0, 200, (401, 3)),
    )
    flat.table.attrs["sampling"] = "instantaneous"
    both = synchronise(
        [imu(), replace(second, accelerometers=(flat,))], method="correlation", reference="IMU1"
    )
    found = both.unit("IMU2")
    assert found.how == "correlation of the rates"
    # No noise: what the fit leaves is the interpolation.
    assert found.offset == pytest.approx(1.0, abs=1e-6)


def test_a_trigger_that_contradicts_the_correlation_is_told():
    both = synchronise([imu(noise=0.2), lab(trigger=-2.0 + 0.02, noise=0.2)], method="correlation")
    said = [f for f in both.findings if f.quantity == "trigger"]
    assert len(said) == 1
    assert said[0].file == "LAB1"
    assert "the trigger is 20" in said[0].what


def test_noise_factor_is_what_noise_becomes():
    quiet, loud = lab(), lab(noise=3.0)
    for sampling in ("instantaneous", "mean"):
        a, b = (
            synchronise([imu(), u], sampling=sampling).unit("LAB1").accelerometers[0]
            for u in (quiet, loud)
        )
        noise = (b.triad.table - a.triad.table).to_numpy()
        np.testing.assert_allclose(b.noise, 3.0 * b.noise_factor, rtol=1e-12)
        scaled = noise / b.noise
        # 600 numbers, neighbours correlated by up to a half: some 300 free ones, four sigmas.
        assert np.mean(scaled**2) == pytest.approx(1.0, abs=4.0 * np.sqrt(2.0 / 300))
        if sampling == "mean":
            # 51 samples, the outer ones half: 49.5 squares over 50².
            np.testing.assert_allclose(b.noise_factor, np.sqrt(49.5) / 50.0, rtol=1e-9)


def test_stamps_that_do_not_coincide_are_interpolated():
    both = synchronise([imu(), imu("IMU2", shift=1.0, begin=-0.998, rate=200.0)])
    moved = both.unit("IMU2")
    assert moved.accelerometers[0].method == "interpolated"
    assert not [f for f in both.findings if f.file == "IMU2, accel"]
    jump = max(2.0 * (np.pi / t) ** 2 * np.linalg.norm(a) for a, _, t in PULSES)
    np.testing.assert_allclose(
        moved.unit.accelerometers[0].table,
        force(both.time) @ IMU_MOUNT.C_vs,
        atol=jump * 0.005**2 / 8,
    )


def test_a_slower_gyro_is_interpolated_and_told():
    unit = imu()
    slow = triad(GYRO, turning, 100.0, -1.0, 1.0, 5.0, IMU_MOUNT)
    both = synchronise([replace(unit, gyro=slow)])
    assert both.unit("IMU1").gyro.method == "interpolated"
    assert any("slower than the common stamps" in f.what for f in both.findings)
    np.testing.assert_allclose(
        both.unit("IMU1").unit.gyro.table,
        turning(both.time) @ IMU_MOUNT.C_vs,
        atol=2.0 * (np.pi / 0.1) ** 2 * 2.2 * 0.01**2 / 8,
    )


def test_axes_of_different_rates_and_starts_are_told_and_brought_together():
    def change(table):
        table.iloc[1::2, 2] = np.nan
        table.iloc[:40, 1] = np.nan
        return table

    both = synchronise([with_table(imu(), change)])
    said = [f for f in both.findings if "not sampled together" in f.what]
    assert said[0].file == "IMU1, accel"
    assert "accel_z 100 Hz" in said[0].what
    assert both.time[0] == pytest.approx(-0.8)
    got = both.unit("IMU1").unit.accelerometers[0].table.to_numpy()
    jump = max(2.0 * (np.pi / t) ** 2 * np.linalg.norm(a) for a, _, t in PULSES)
    np.testing.assert_allclose(got, force(both.time) @ IMU_MOUNT.C_vs, atol=jump * 0.01**2 / 8)


def test_mean_samples_count_at_the_middle_of_their_step():
    """A recorder of means at 200 Hz, asked for values: 2.5 ms would be 10 m/s² on a flank."""
    unit = imu()
    time = unit.accelerometers[0].table.index.to_numpy() - 5.0
    values = (mean_of(PULSES, time, 0.005) + AT_REST) @ IMU_MOUNT.C_vs

    def change(table):
        table[:] = values
        return table

    unit = with_table(unit, change)
    unit.accelerometers[0].table.attrs["sampling"] = "mean"
    both = synchronise([unit])
    jump = max(2.0 * (np.pi / t) ** 2 * np.linalg.norm(a) for a, _, t in PULSES)
    # A mean over h is off by a'' h²/24, and interpolation by a'' h²/8.
    np.testing.assert_allclose(
        both.unit("IMU1").unit.accelerometers[0].table,
        force(both.time) @ IMU_MOUNT.C_vs,
        atol=jump * 0.005**2 * (1 / 8 + 1 / 24),
    )


def test_clipping_is_seen_through_the_low_pass():
    unit = lab()

    def change(table):
        return table.clip(-60.0, 60.0)

    unit = with_table(unit, change)
    part = replace(unit.accelerometers[0], uncertainty=TriadUncertainty(full_scale=60.0))
    both = synchronise([imu(), replace(unit, accelerometers=(part,))])
    clipped = both.unit("LAB1").accelerometers[0].clipped
    raw = np.abs(force(both.time) @ LAB_MOUNT.C_vs) >= 60.0
    assert clipped[raw].all()
    assert not clipped[np.abs(both.time - 0.05) > 0.2].any()


def test_a_range_that_ends_before_it_is_said_to_is_seen_between_stamps_and_through_the_low_pass():
    # Samples that are held at an end are equal to the last bit; interpolated ones are not.
    for unit, name in ((imu(), "IMU1"), (lab(), "LAB1")):
        held = with_table(unit, lambda table: table.clip(-60.0, 60.0))
        part = replace(held.accelerometers[0], uncertainty=TriadUncertainty(full_scale=490.0))
        both = synchronise([imu(), replace(held, name="HELD", accelerometers=(part,))])
        clipped = both.unit("HELD").accelerometers[0].clipped
        C = LAB_MOUNT.C_vs if name == "LAB1" else IMU_MOUNT.C_vs
        raw = np.abs(force(both.time) @ C) >= 70.0
        assert raw.any() and clipped[raw].all()
        assert not clipped[np.abs(both.time - 0.05) > 0.2].any()
        said = [f for f in both.findings if f.code.endswith("clipped-before-resampling")]
        assert bool(said) == (name == "LAB1")
        assert all(f.file.startswith("HELD") and "delta-V" in f.remedy for f in said)


def test_what_a_shorter_record_takes_from_the_others_is_told():
    short = with_table(imu("IMU2"), lambda t: t[(t.index > t.index[0] + 0.5)])
    both = synchronise([imu(), short])
    found = [f for f in both.findings if "begins last" in f.what]
    assert len(found) == 1 and found[0].file.startswith("IMU2, ")
    assert not any("begins last" in f.what for f in synchronise([imu()]).findings)


@pytest.mark.parametrize(
    ("units", "words"),
    [
        (lambda: [imu(trigger=None)], ["IMU1", "no trigger", "by correlation"]),
        (lambda: [lab(), imu("IMU9")], ["LAB1", "'IMU1'", "did you mean 'IMU9'"]),
        (lambda: [lab(), replace(imu(), gyro=None)], ["LAB1", "has no gyro"]),
        (
            lambda: [with_table(imu(), lambda t: t.drop(columns="accel_y"))],
            ["IMU1, accel, accel_y", "no accel_y"],
        ),
        (lambda: [imu(), imu("IMU2", trigger=50.0)], ["IMU2", "50 s is not within the record"]),
        (lambda: [imu(trigger="5.0")], ["IMU1", "trigger", "a value of type str"]),
        (
            lambda: [imu(trigger=6.8), imu("IMU2", trigger=3.2)],
            ["IMU1", "IMU2", "do not overlap"],
        ),
        (
            lambda: [with_table(imu(), lambda t: t.set_axis(1000.0 * t.index))],
            ["IMU1, accel, row 2, time", "5 s apart", "ms by 1000"],
        ),
        (
            lambda: [with_table(imu(), lambda t: t.set_axis([f"{x} s" for x in t.index]))],
            ["IMU1, accel, time", "not seconds"],
        ),
        (
            lambda: [with_table(imu(), with_text)],
            ["IMU1, accel, row 201, accel_y", "'n/a' is not a number"],
        ),
        (
            lambda: [with_table(imu(), lambda t: t.iloc[[0, 2, 1, *range(3, 401)]])],
            ["IMU1, accel, row 3, time", "time does not increase"],
        ),
        (
            lambda: [with_table(imu(), lambda t: t.drop(t.index[77]).reindex(t.index))],
            ["IMU1, accel, row 78", "nan at"],
        ),
        (
            lambda: [with_table(imu(), with_inf)],
            ["IMU1, accel, row 201, accel_y", "not a finite number (inf)"],
        ),
        (
            lambda: [with_table(imu(), lambda t: t.drop(t.index[100:110]), gyro=True)],
            ["IMU1, gyro, row 101", "a gap of 55 ms"],
        ),
        (
            lambda: [with_table(imu(), lambda t: t / 9.80665)],
            ["IMU1, accel, accel", "gravity in g", "multiply by 9.80665"],
        ),
        (
            lambda: [with_table(imu(), lambda t: t * 57.29578, gyro=True)],
            ["IMU1, gyro, gyro", "far beyond", "π/180"],
        ),
        (
            lambda: [
                with_table(imu(), lambda t: t * 0.3, gyro=True),
                with_table(imu("IMU2"), lambda t: t * 0.3 * 57.29578, gyro=True),
            ],
            ["IMU2, gyro, gyro", "57.3 times", "π/180"],
        ),
        (lambda: [imu(), imu()], ["two units have the name 'IMU1'"]),
        (lambda: [CrashUnit("X", (), trigger=0.0)], ["X", "neither accelerometers nor a gyro"]),
        (lambda: [imu(trigger_sd=-1.0)], ["IMU1, trigger_sd"]),
        (list, ["no unit"]),
    ],
)
def test_bad_input_is_refused_by_name(units, words):
    with pytest.raises((DataError, ConfigError)) as error:
        synchronise(units())
    for word in words:
        assert word in str(error.value)
    assert "Remedy:" in str(error.value)


@pytest.mark.parametrize(
    ("keys", "word"),
    [
        ({"method": "triger"}, "did you mean 'trigger'"),
        ({"rate": 0.0}, "not positive"),
        ({"reference": "IMU"}, "did you mean 'IMU1'"),
        ({"sampling": "means"}, "did you mean 'mean'"),
    ],
)
def test_options_that_are_not_understood(keys, word):
    with pytest.raises(ConfigError, match=word):
        synchronise([imu()], **keys)


def test_correlation_needs_one_trigger_and_something_in_common():
    with pytest.raises(
        DataError, check=coded("sensors.no-unit-trigger-time-counted", quantity="trigger")
    ):
        synchronise([imu(trigger=None)], method="correlation")
    noise = np.random.default_rng(6).normal(size=(401, 3))
    other = with_table(
        replace(imu("IMU2"), gyro=None), lambda t: pd.DataFrame(noise, t.index, t.columns)
    )
    with pytest.raises(DataError, match=r"IMU2.*(?s:.*)cannot be synchronized with IMU1"):
        synchronise([imu(), other], method="correlation")


def test_zeroed_channels_are_told():
    both = synchronise([imu(), with_table(lab(), lambda t: t - t.iloc[:1000].mean())])
    said = [f for f in both.findings if "gravity is not included" in f.what]
    assert [f.file for f in said] == ["LAB1, accel"]


def test_inputs_stay_as_they_are_and_rotation_is_the_project_s():
    unit = imu()
    before = unit.accelerometers[0].table.copy()
    synchronise([unit, lab()])
    pd.testing.assert_frame_equal(unit.accelerometers[0].table, before)
    C = rotation.dcm_from_quaternion(rotation.quaternion_from_euler(LAB_MOUNT.angles_deg))
    np.testing.assert_array_equal(C, LAB_MOUNT.C_vs)
