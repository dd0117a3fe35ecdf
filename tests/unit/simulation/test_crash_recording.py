"""A recorder writes what its motion, its errors, its clock and its trigger make of a crash."""

from __future__ import annotations

import sys
import types
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import chi2

sys.path.insert(0, str(Path(__file__).parent))

from pushed_motion import Pushed

from strapdown.errors import ConfigError
from strapdown.sensors.crash_unit import Mounting
from strapdown.sensors.error_chain import compensate
from strapdown.sensors.triad_errors import TriadErrors
from strapdown.sensors.uncertainty import TriadUncertainty
from strapdown.simulation.crash_recording import (
    HIGH_G_BIAS,
    RecorderDesign,
    TriadDesign,
    WarmUp,
    paper_units,
    record_crash,
)
from strapdown.simulation.imu import low_passed

G = 9.80665
MOTION = Pushed()
PERFECT = TriadUncertainty()
ACCEL = ["accel_x", "accel_y", "accel_z"]


def design(accel=PERFECT, gyro=PERFECT, rate=200.0, **more):
    return RecorderDesign(
        "one", (TriadDesign("part", accel, rate),), TriadDesign("gyro", gyro, rate), **more
    )


def record(what, motion=MOTION, **more):
    return record_crash(motion, what, impact=2.0, **{"seed": 0, **more})


def test_a_perfect_recorder_writes_the_motion():
    unit, truth = record(design())
    table = unit.accelerometers[0].table
    np.testing.assert_array_equal(table[ACCEL], MOTION.specific_force(table.index.to_numpy()))
    np.testing.assert_array_equal(unit.gyro.table, MOTION.rate(unit.gyro.table.index.to_numpy()))
    assert table.attrs["sampling"] == "instantaneous"
    assert len(table) == 601
    assert unit.trigger == 2.0 == truth.clock(2.0)


def test_means_are_those_of_the_motion():
    unit, _ = record(design(), sampling="mean")
    time = unit.gyro.table.index.to_numpy()
    turned = np.diff(MOTION.angle(time), axis=0) * 200.0
    np.testing.assert_allclose(unit.gyro.table.to_numpy()[1:], turned, atol=1e-12)


def test_samples_fall_on_the_units_own_clock():
    clock = {"clock_offset": 3.7, "clock_drift_ppm": 50.0}
    unit, truth = record(design(**clock), start=0.5, end=2.5)
    table = unit.accelerometers[0].table
    stamps = table.index.to_numpy()
    np.testing.assert_allclose(stamps * 200.0, np.rint(stamps * 200.0), atol=1e-9)
    at = (stamps - 3.7) / (1.0 + 50e-6)
    # 1e-13 s of rounding of the instants, times the steepest specific force, 7000 m/s³.
    np.testing.assert_allclose(table[ACCEL], MOTION.specific_force(at), atol=1e-9)
    assert 0.5 <= at[0] < 0.505
    assert 2.495 < at[-1] <= 2.5
    assert unit.trigger == truth.clock(2.0) == pytest.approx(3.7 + 2.0 * (1 + 50e-6), abs=1e-15)


def test_the_trigger_is_stamped_with_its_error():
    late = [
        record(design(trigger_sd=0.002), seed=seed, start=1.9, end=2.0)[0].trigger - 2.0
        for seed in range(200)
    ]
    low, high = chi2.ppf([5e-7, 1 - 5e-7], 200) / 200
    assert low < np.mean(np.square(late)) / 0.002**2 < high


def test_drawn_errors_are_told_and_can_be_taken_off_again():
    accel = TriadUncertainty(bias=0.2, scale=0.02, misalignment=0.01)
    gyro = TriadUncertainty(bias=0.005, g_sensitivity=1e-4)
    warm = WarmUp(0.5, 0.02, 100.0, 60.0)
    what = design(accel, gyro, warm_up=warm)
    unit, truth = record(what, seed=5)
    table = unit.accelerometers[0].table
    time = table.index.to_numpy()
    force = compensate(truth.accelerometers[0], time, table[ACCEL])
    np.testing.assert_allclose(force, MOTION.specific_force(time), atol=1e-11)
    rate = compensate(truth.gyro, time, unit.gyro.table, specific_force=MOTION.specific_force(time))
    np.testing.assert_allclose(rate, MOTION.rate(time), atol=1e-13)
    assert truth.accelerometers[0].warm_up_time == 100.0
    assert max(map(abs, truth.accelerometers[0].warm_up)) < 5 * 0.5 * np.exp(-0.6)
    expected = np.hypot(0.2, 0.5 * np.exp(-0.6))
    assert unit.accelerometers[0].uncertainty.bias[0] == pytest.approx(expected)


def test_known_errors_take_the_place_of_the_drawn():
    known = TriadErrors(bias=(0.1, 0.2, 0.3))
    what = RecorderDesign("one", (TriadDesign("part", PERFECT, 200.0, known),))
    unit, truth = record(what)
    assert truth.accelerometers[0] == known
    assert unit.accelerometers[0].uncertainty == PERFECT
    assert unit.gyro is None


def test_a_range_ends_and_steps_are_seen():
    low = TriadUncertainty(full_scale=2 * G, quantization=4 * G / 4096)
    unit, _ = record(design(low))
    values = unit.accelerometers[0].table[ACCEL].to_numpy()
    # Held within the range, and then rounded to the step, of which the range is a whole number.
    assert np.abs(values[:, 0]).max() == pytest.approx(2 * G, rel=1e-12)
    steps = values / (4 * G / 4096)
    np.testing.assert_allclose(steps, np.rint(steps), atol=1e-9)


def test_high_g_biases_fill_their_bound_and_leave_the_low_range_alone():
    two = RecorderDesign(
        "two",
        (TriadDesign("low", PERFECT, 200.0), TriadDesign("high", PERFECT, 200.0)),
        high_g_bias=11.91,
    )
    drawn = [record(two, seed=s, start=1.9, end=2.0)[1].accelerometers for s in range(100)]
    biases = np.array([high.bias for _, high in drawn])
    assert 11.5 < np.abs(biases).max() <= 11.91
    # Uniform: the mean square is b²/3, with the standard deviation b² √(4/45/n).
    assert (biases**2).mean() / 11.91**2 == pytest.approx(1 / 3, abs=5 * np.sqrt(4 / 45 / 300))
    assert all(low.bias == (0.0, 0.0, 0.0) for low, _ in drawn)
    assert two.told(1).bias[0] == pytest.approx(11.91 / np.sqrt(3.0))


@pytest.mark.parametrize("ringing", [(0.0, 0.0, 0.0), (98.0, 30.0, 10.0)])
def test_the_low_pass_saves_evaluations_without_changing_what_it_reads(ringing):
    motion = Pushed(ringing=ringing)
    time = np.arange(601) / 200.0
    exact = low_passed(motion.specific_force, time, 292.0)
    counted = []

    def force(at):
        counted.append(at.size)
        return motion.specific_force(at)

    found = low_passed(force, time, 292.0, 1e-4)
    # The tolerance, and 5e-7 of 140 m/s² of the quadrature; a ringing that begins with a kink
    # within a stretch, of 1.2e5 m/s³, is spread by up to its quadrature either way.
    kink = 0.0 if not any(ringing) else 0.15
    quiet = np.abs(time - motion.start) > 0.02
    np.testing.assert_allclose(found[quiet], exact[quiet], atol=3e-4)
    np.testing.assert_allclose(found, exact, atol=3e-4 + kink)
    assert sum(counted) < 0.45 * 600 * 60


def test_vibration_shifts_the_output(monkeypatch):
    """With a ringing that the mounted motion adds, the mean square of it is rectified."""

    class Mounted:
        def __init__(self, motion, mounting, ringing):
            self.motion = (
                replace(motion, ringing=(80.0, 0.0, 0.0), decay=1e3) if ringing else motion
            )
            self.duration = motion.duration
            self.rate, self.angle = self.motion.rate, self.motion.angle
            self.specific_force = self.motion.specific_force

    module = types.ModuleType("strapdown.simulation.mounted_motion")
    module.MountedMotion = Mounted
    monkeypatch.setitem(sys.modules, "strapdown.simulation.mounted_motion", module)
    errors = TriadErrors(vibration_rectification=1e-4)
    what = RecorderDesign("one", (TriadDesign("part", PERFECT, 200.0, errors),))
    none = RecorderDesign("one", (TriadDesign("part", PERFECT, 200.0, TriadErrors()),))
    # 400 Hz has two whole periods in an interval; eight nodes in each half of it.
    motion = Pushed(turn=0.0, frequency=400.0)
    kw = {"impact": 2.0, "seed": 0, "ringing": (types.SimpleNamespace(start=2.0),)}
    read, free = (
        record_crash(motion, d, **kw)[0].accelerometers[0].table[ACCEL].to_numpy()
        for d in (what, none)
    )
    late = np.arange(601) / 200.0 > 2.2
    np.testing.assert_allclose((read - free)[late, 0], 1e-4 * 80.0**2 / 2, rtol=2e-3)
    np.testing.assert_array_equal((read - free)[:, 1:], 0.0)


def test_the_true_mounting_is_drawn_about_the_told(monkeypatch):
    seen = []

    class Mounted:
        def __init__(self, motion, mounting, ringing):
            seen.append(mounting)
            self.duration = motion.duration
            self.rate, self.specific_force = motion.rate, motion.specific_force

    module = types.ModuleType("strapdown.simulation.mounted_motion")
    module.MountedMotion = Mounted
    monkeypatch.setitem(sys.modules, "strapdown.simulation.mounted_motion", module)
    told = Mounting((0.6, -0.5, 0.2), (1.0, 2.0, 90.0), position_sd=0.01, angles_sd_deg=1.5)
    for seed in range(60):
        unit, truth = record(design(mounting=told), seed=seed, start=1.9, end=2.0)
        assert unit.mounting is told
        assert truth.mounting is seen[-1]
    low, high = chi2.ppf([5e-7, 1 - 5e-7], 180) / 180
    off = np.array([m.position for m in seen]) - told.position
    assert low < (off**2).mean() / 0.01**2 < high
    turned = np.array([m.angles_deg for m in seen]) - told.angles_deg
    assert low < (turned**2).mean() / 1.5**2 < high


def test_the_platforms_of_the_paper():
    units = {d.name: d for d in paper_units()}
    assert list(units) == ["LAB1", "LAB2", "IMU1", "IMU2"]
    assert units["IMU1"].mounting.position[1] == -units["IMU2"].mounting.position[1] < 0.0
    # The motion is that of the sensors.
    units = {name: replace(d, mounting=Mounting()) for name, d in units.items()}
    for d in units.values():
        kw = {"start": 1.9} if d.gyro is None else {}
        unit, truth = record(d, seed=2, **kw)
        first = unit.accelerometers[0].table
        assert np.isfinite(first.to_numpy()).all()
        if d.gyro is None:
            assert unit.gyro_from == "IMU1"
            assert np.diff(first.index)[0] == pytest.approx(1e-4)
        else:
            assert [a.name for a in unit.accelerometers] == ["lis302dlh", "mma3202-mma1213"]
            assert np.abs(first["accel_x"]).max() == pytest.approx(2 * G, rel=1e-9)
            high = unit.accelerometers[1].table["accel_x"]
            assert -200.0 < high.min() < -80.0
            assert np.abs(truth.accelerometers[1].bias).max() <= HIGH_G_BIAS
    imu1, imu2 = (record(units[name], seed=2)[1] for name in ("IMU1", "IMU2"))
    assert imu1.accelerometers[0].bias != imu2.accelerometers[0].bias


def test_the_same_seed_writes_the_same_and_a_part_does_not_move_another():
    imu1 = replace(paper_units()[2], mounting=Mounting())
    one, _ = record(imu1, seed=4)
    two, _ = record(replace(imu1, gyro=None, high_g_bias=0.0), seed=4)
    first, again = (u.accelerometers[0].table for u in (one, two))
    assert first.equals(again)


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ({"start": 2.5, "end": 2.0}, "recorder 'one': a record from 2.5 s to 2 s"),
        ({"end": 4.0}, "outside the motion of 3 s"),
        ({"impact": 5.0}, "an impact at 5 s"),
        ({"start": 1.0, "end": 1.004}, "fewer than two samples"),
        ({"sampling": "some"}, "unknown kind of sampling '"),
    ],
)
def test_what_cannot_be_recorded_is_refused(more, message):
    with pytest.raises(ConfigError, match=message):
        record_crash(MOTION, design(), **{"impact": 2.0, "seed": 0, **more})


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: RecorderDesign("one", ()), "' has no ranges"),
        (lambda: TriadDesign("part", PERFECT, 0.0), "part, rate: 0 is not above zero"),
        (lambda: design(trigger_sd=-1.0), "one, trigger_sd"),
        (lambda: design(clock_drift_ppm=5000.0), "clock_drift_ppm"),
        (lambda: design(clock_offset=np.inf), "one, clock_offset"),
        (lambda: WarmUp(0.1, 0.1, 0.0), "warm-up, time_constant"),
        (lambda: WarmUp(-0.1, 0.1, 1.0), "warm-up, accel"),
    ],
)
def test_a_design_that_cannot_be_is_refused(make, message):
    with pytest.raises(ConfigError, match=message):
        make()
