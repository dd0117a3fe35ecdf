"""The recorders of the paper on one car: each for itself, compared, and together."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from strapdown.crash.combine_units import combine_units
from strapdown.crash.entry import Entry
from strapdown.crash.measuring_point import at_point, unit_effects
from strapdown.crash.path import reconstruct_path
from strapdown.crash.preparation import Preparation, prepare_unit
from strapdown.crash.reconstruction import CrashOptions, reconstruct_crash, reconstruct_unit
from strapdown.sensors.crash_unit import Mounting
from strapdown.sensors.lever_arm import move_unit
from strapdown.sensors.synchronise import synchronise
from strapdown.simulation.crash_motion import CRASHES
from strapdown.simulation.crash_recording import paper_units, record_crash
from strapdown.simulation.mounted_motion import MountedMotion
from strapdown.tables import ACCEL, NED

POLE = CRASHES["pole"]
IMPACT = POLE.impacts[0]
# Of 10 000 Hz, only for the time of the test.
LAB_RATE = 2000.0
ENTRY = Entry.from_speed(
    float(np.hypot(*POLE.motion.trajectory(np.array([IMPACT]))[["VN", "VE"]].to_numpy()[0])),
    0.0,
)


def designs(*names):
    found = [d for d in paper_units() if d.name in names]
    return [
        replace(d, accelerometers=tuple(replace(t, rate=LAB_RATE) for t in d.accelerometers))
        if d.name.startswith("LAB")
        else d
        for d in found
    ]


def recorded(*names, seed=0):
    return [record_crash(POLE.motion, d, impact=IMPACT, seed=seed)[0] for d in designs(*names)]


def error(path):
    """Computed less true place."""
    exact = MountedMotion(POLE.motion, Mounting()).kinematics_from(path.time + IMPACT, epoch=IMPACT)
    return path.table[NED].to_numpy() - exact.position


def column(triad, edit):
    table = edit(triad.table.copy())
    table.attrs = dict(triad.table.attrs)
    return replace(triad, table=table)


@pytest.fixture(scope="module")
def four():
    units = recorded("LAB1", "LAB2", "IMU1", "IMU2")
    return units, reconstruct_crash(units, ENTRY)


@pytest.mark.slow
def test_four_units_end_to_end(four):
    _, found = four
    assert [u.name for u in found.units] == ["LAB1", "LAB2", "IMU1", "IMU2"]
    assert found.main.name == "weighted mean of LAB1, LAB2, IMU1, IMU2"
    for unit in (*found.units, found.combined):
        z = error(unit.path)[-1] / unit.path.sd[NED].iloc[-1].to_numpy()
        # Fifteen normal deviates: one beyond four has a chance of 1e-3.
        assert np.abs(z).max() < 4.0
        assert len(unit.body) == 1
    sds = np.array([u.path.sd[NED].iloc[-1].to_numpy() for u in found.units])
    # Weights are the best sample by sample, not for the path: no better than by a little worse.
    assert (found.combined.path.sd[NED].iloc[-1].to_numpy() < 1.02 * sds.min(axis=0)).all()


def test_healthy_units_agree(four):
    _, found = four
    assert found.comparison.agree
    assert not found.comparison.findings
    assert len(found.comparison.pairs) == 6


def test_a_combination_is_levelled_at_the_mean_of_its_rests(four):
    _, found = four
    both = found.combined.at_point
    mean, _ = both.resting_force(9.80665)
    roll, pitch = np.radians([both.levelling.roll_deg, both.levelling.pitch_deg])
    up = np.array([np.sin(pitch), -np.sin(roll) * np.cos(pitch), -np.cos(roll) * np.cos(pitch)])
    assert mean / np.linalg.norm(mean) == pytest.approx(up, abs=1e-12)
    # An unknown tilts the level by what it adds to that mean, but for the levelling itself.
    level = [n.startswith("vehicle levelling") for n in both.effects.names]
    felt = both.effects.rest_force @ both_level(both).T / 9.80665
    expected = np.column_stack([-felt[:, 1], felt[:, 0], np.zeros(len(felt))])
    assert both.effects.tilt[~np.array(level)] == pytest.approx(
        expected[~np.array(level)], abs=1e-6
    )


def both_level(at):
    from strapdown import rotation

    return rotation.dcm_from_euler([at.levelling.roll_deg, at.levelling.pitch_deg, 0.0])


@pytest.mark.parametrize("preparation", [None, {"levelling": (0.0, 0.0, 0.5)}])
def test_stated_attitudes_are_reconstructed_too(four, preparation):
    units, _ = four
    there = [
        at_point(
            prepare_unit(u.unit, Preparation(**(preparation or {}))),
            (0.0, 0.0, 0.0),
            time_sd=u.time_sd,
        )
        for u in synchronise(units).units
    ]
    both = combine_units(there)
    found = reconstruct_unit(both, ENTRY)
    left = error(found.path)[-1]
    # Three normal deviates: their chi-square exceeds 21 with a chance of 1e-4.
    assert left @ np.linalg.solve(found.path.covariance[-1][6:, 6:], left) < 21.0
    assert both.levelling.from_rest == (preparation is None)


def test_one_unknown_of_two_units_stands_once(four):
    _, found = four
    names = found.combined.at_point.effects.names
    assert len(set(names)) == len(names)
    # The laboratory units borrow the gyro of IMU1.
    assert sum("gyro bias" in n for n in names) == 6
    assert "LAB1 gyro bias x" not in names
    # So that the clock of that gyro, too, is one unknown of three units.
    lab = next(u for u in found.units if u.name == "LAB1").at_point.effects
    assert {"LAB1 timing", "IMU1 timing"} <= set(lab.names)
    k = lab.names.index("IMU1 timing")
    assert lab.rate[k].any() and lab.force[k].any()
    assert not lab.rate[lab.names.index("LAB1 timing")].any()


@pytest.mark.slow
def test_errors_of_combined_paths_are_what_they_state():
    squares = []
    for seed in range(20):
        there = [
            at_point(prepare_unit(u.unit), (0.0, 0.0, 0.0), time_sd=u.time_sd)
            for u in synchronise(recorded("IMU1", "IMU2", seed=seed)).units
        ]
        both = combine_units(there)
        path = reconstruct_path(both.imu, both.effects, both.levelling, both.rest.end, ENTRY)
        left = error(path)[-1]
        squares.append(left @ np.linalg.solve(path.covariance[-1][6:, 6:], left))
    # Chi-square of three degrees of freedom: a mean over 20 scatters by sqrt(6/20).
    assert np.mean(squares) == pytest.approx(3.0, abs=4 * np.sqrt(6 / 20))


def test_swapped_axes_are_found(four):
    units, _ = four

    def swap(table):
        return table.rename(columns={"accel_x": "accel_y", "accel_y": "accel_x"})[ACCEL]

    wrong = replace(
        units[3], accelerometers=tuple(column(t, swap) for t in units[3].accelerometers)
    )
    # The axes differ by 31 standard deviations at this rate, and by 32 at 200 Hz.
    found = reconstruct_crash([units[2], wrong], ENTRY, CrashOptions(rate=50.0, combine=False))
    assert not found.comparison.agree
    words = [str(f) for f in found.comparison.findings]
    assert any("IMU2, axes: the axes of its accelerometers differ" in w for w in words)
    assert any("forward of IMU1 is its right, right of IMU1 is its forward" in w for w in words)


@pytest.mark.parametrize(
    "off", [(0.0, 0.5, 0.0), pytest.param((0.5, 0.0, 0.0), marks=pytest.mark.slow)]
)
def test_a_wrong_lever_arm_is_found(four, off):
    units, _ = four
    right = units[3].mounting
    position = tuple(float(x) for x in np.add(right.position, off))
    wrong = replace(units[3], mounting=replace(right, position=position))
    found = reconstruct_crash([units[2], wrong], ENTRY, CrashOptions(rate=100.0, combine=False))
    assert any(f.quantity == "position" for f in found.comparison.findings)
    check = found.comparison.pairs[0].lever_arm
    told = check.directions[:, check.told]
    # (true minus stated) of the first less that of the second.
    left = told.T @ (check.correction - np.array(off))
    assert np.abs(left / check.sd[check.told]).max() < 4.0


def test_a_borrowed_gyro_has_its_own_axes():
    lab, imu = designs("LAB1", "IMU1")
    turned = replace(lab.mounting, angles_deg=(0.0, 0.0, 90.0))
    units = [
        record_crash(POLE.motion, d, impact=IMPACT, seed=1)[0]
        for d in (replace(lab, mounting=turned), imu)
    ]
    effects = []
    for u in synchronise(units).units:
        prepared = prepare_unit(u.unit)
        effects.append(unit_effects(prepared, move_unit(prepared, (0.0, 0.0, 0.0))))
    borrowed, own = effects
    for name in own.names:
        if name.startswith("IMU1 gyro") and "g-sensitivity" not in name:
            a, b = borrowed.names.index(name), own.names.index(name)
            # The bias at rest is the mean of the same samples.
            assert borrowed.rate[a] == pytest.approx(own.rate[b], abs=1e-12)
    assert not any(n.startswith("LAB1 gyro") for n in borrowed.names)
