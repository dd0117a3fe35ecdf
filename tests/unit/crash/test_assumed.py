"""Units that do not measure all of a motion, from the record to the answers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from tests.coded import coded
from tests.unit.crash.assumed_case import (
    ASSUMED,
    CHANGE,
    SPEED,
    drawn_motion,
    move,
    path_of,
    pushed,
    unit_of,
)

from strapdown.crash.consistency import compare_units
from strapdown.crash.delta_v import delta_v
from strapdown.crash.drive_entry import DriveEntry, start_from_drive
from strapdown.crash.entry import Entry
from strapdown.crash.measuring_point import MISSING_AXIS, NO_TURNING, TURNED_AXIS, slow_part
from strapdown.crash.path import sample_paths
from strapdown.crash.preparation import Preparation, prepare_unit
from strapdown.crash.reconstruction import CrashOptions, reconstruct_crash
from strapdown.errors import DataError
from strapdown.sensors.crash_unit import (
    TURN_SHAPES,
    TURNS,
    Assumed,
    CrashUnit,
    Mounting,
    RecordedTriad,
    turning_shapes,
)
from strapdown.sensors.uncertainty import TriadUncertainty
from strapdown.simulation.crash_motion import CRASHES
from strapdown.simulation.crash_recording import paper_units, record_crash
from strapdown.tables import NED, VELOCITY

ENTRY = Entry.from_speed(SPEED, 0.05)
PREPARATION = {"levelling": (0.0, 0.0, 1.0)}
CHANNEL = TriadUncertainty(noise_density=0.01, bias=0.2, scale=0.01, full_scale=1000.0)


@pytest.fixture(scope="module")
def straight():
    """One vehicle that neither turns nor slides."""
    return move(lambda time: np.zeros((1, time.size, 3)), lambda time: np.zeros((1, time.size)))


def reconstruct(*units, **options):
    settings = {"rate": 200.0, "sampling": "mean", "preparation": PREPARATION, **options}
    return reconstruct_crash(list(units), ENTRY, CrashOptions(**settings))


def edr(*, axes="xy", name="EDR", assumed=ASSUMED, rate=100.0, pulse=(-11.0, 3.0, 0.0), **options):
    """A module of an airbag: means of 10 ms, no gravity in them, and the true sums."""
    time = np.arange(-5, 31) / rate
    edges = np.r_[time[0] - 1.0 / rate, time]
    u = np.clip(edges / 0.1, 0.0, 1.0)
    gained = np.outer(u - np.sin(2.0 * np.pi * u) / (2.0 * np.pi), pulse)
    table = pd.DataFrame(np.diff(gained, axis=0) * rate, columns=["accel_x", "accel_y", "accel_z"])
    table = table[[f"accel_{a}" for a in axes]].set_index(pd.Index(time, name="time"))
    table.attrs = {"sampling": "mean"}
    triad = RecordedTriad(table, CHANNEL, "module")
    return CrashUnit(name, (triad,), trigger=0.0, assumed=assumed, **options), gained[1:]


class TestTables:
    def test_the_change_of_velocity_of_an_edr_comes_back_exactly(self):
        unit, gained = edr()
        found = reconstruct(unit, rate=100.0, window=(-0.03, 0.25))
        acceleration, time = found.main.acceleration, found.main.acceleration.time
        assert acceleration.sampling == "mean"
        given = gained[np.searchsorted(unit.accelerometers[0].table.index, time - 1e-9)]
        for k in range(1, len(time)):
            change = delta_v(acceleration, float(time[0]), float(time[k])).vector
            # Sums of the means, to the rounding of what gravity is put on and taken off.
            assert change == pytest.approx(given[k] - given[0], abs=1e-12)
        path = found.main.path
        # Resolved, the vehicle is taken not to turn: the same again.
        at_end = path.table[VELOCITY].iloc[-1].to_numpy() - [SPEED, 0.0, 0.0]
        # The Earth turns below it: 15 m/s and 0.25 s make 0.5 mm/s.
        assert at_end == pytest.approx(gained[-1] * [1.0, 1.0, 0.0], abs=2e-3)

    def test_one_axis_is_enough_for_an_answer(self):
        unit, _ = edr(axes="x")
        found = reconstruct(unit, rate=100.0, window=(-0.03, 0.25))
        assert found.main.at_point.assumed_axes == ("right", "down", *TURNS)
        (changes,) = found.main.body
        assert changes.event.delta_v.vector[1] == pytest.approx(0.0, abs=1e-12)
        assert found.main.types[0].name == "front"

    def test_the_levelling_must_be_stated(self):
        unit, _ = edr()
        with pytest.raises(DataError, match="accel_z") as error:
            reconstruct(unit, preparation={})
        assert error.value.finding.quantity == "levelling"
        assert "levelling=(roll, pitch, sd)" in error.value.finding.remedy

    @pytest.mark.parametrize(
        ("axes", "said"), [("xy", "Assumed(delta_v_sd"), ("xyz", "Assumed(turn_sd_deg")]
    )
    def test_without_a_statement_the_remedy_names_it(self, axes, said):
        unit, _ = edr(axes=axes, assumed=None)
        with pytest.raises(DataError) as error:
            reconstruct(unit)
        assert said in error.value.finding.remedy

    def test_gravity_is_put_where_the_attitude_says(self):
        unit, _ = edr(axes="x")
        roll, pitch = np.radians([3.0, -2.0])
        made = prepare_unit(unit, Preparation(levelling=(3.0, -2.0, 0.5))).imu
        expected = 9.80665 * np.array(
            [-np.cos(pitch) * np.sin(roll), -np.cos(pitch) * np.cos(roll)]
        )
        assert made[["accel_y", "accel_z"]].to_numpy() == pytest.approx(
            np.tile(expected, (len(made), 1))
        )


class TestEffects:
    @pytest.mark.slow
    @pytest.mark.parametrize("axis", range(3))
    def test_a_turn_does_what_its_unknown_says(self, axis):
        # One thousandth of a standard deviation in truth, against the row of the path.
        part = 1e-3

        def rates(time):
            out = np.zeros((2, time.size, 3))
            # As the moving mean of a recorder has the force.
            felt = slow_part(pushed(time)[:, None], time)[:, 0]
            profiles = turning_shapes(time, (0, 0.15), "mean", felt)
            out[:, :, axis] = np.radians(4.0) * part * profiles
            return out

        truth = move(rates, lambda time: np.zeros((2, time.size)))
        for k, how in enumerate(TURN_SHAPES):
            _, path = path_of(unit_of(truth, k, "xyz", ASSUMED))
            row = path.errors[path.names.index(f"vehicle assumed {TURNS[axis]} {how}")]
            rows = np.searchsorted(truth.time, path.time - 1e-9)
            place = truth.place[k][rows] - path.table[NED].to_numpy()
            speed = truth.velocity[k][rows] - path.table[VELOCITY].to_numpy()
            # The Earth's rate takes 0.2 mm and 1.5 mm/s in 0.3 s; the rest is of first order.
            flat = move(
                lambda time: np.zeros((1, time.size, 3)), lambda time: np.zeros((1, time.size))
            )
            _, still = path_of(unit_of(flat, 0, "xyz", ASSUMED))
            place -= flat.place[0][rows] - still.table[NED].to_numpy()
            speed -= flat.velocity[0][rows] - still.table[VELOCITY].to_numpy()
            # In the middle of a step of 5 ms an instant may be 2.5 ms off: 2 % of the largest.
            for got, expected in ((place, row[:, 6:9]), (speed, row[:, 3:6])):
                assert got / part == pytest.approx(expected, abs=0.02 * np.abs(expected).max())

    def test_a_missing_axis_has_its_change_of_velocity(self, straight):
        at, path = path_of(unit_of(straight, 0, "xz", ASSUMED))
        lines = path.variances()
        # Both shapes together, at the end: one of them has come back.
        assert np.sqrt(lines.loc[MISSING_AXIS, "VE"]) == pytest.approx(0.8, rel=1e-3)
        assert lines.loc[MISSING_AXIS, ["VN", "VD"]].to_numpy() == pytest.approx(0.0, abs=1e-9)
        row = int(np.searchsorted(path.time, 0.15 - 1e-9))
        turned = [
            error[row, 2]
            for name, error in zip(path.names, path.errors, strict=True)
            if "assumed heading" in name
        ]
        assert np.square(turned).sum() == pytest.approx(np.radians(4.0) ** 2, rel=1e-3)
        assert at.assumed_axes == ("right", *TURNS)

    def test_monte_carlo_has_it_too(self, straight):
        _, path = path_of(unit_of(straight, 0, "xz", ASSUMED))
        runs = sample_paths(path, runs=2000, seed=3)
        # 2000 runs know a standard deviation to 1.6 %; three of that.
        for k, name in ((4, "VE"), (5, "VD"), (7, "east")):
            drawn = np.sqrt(runs.covariance[-1, k, k])
            assert drawn == pytest.approx(path.sd[name].iloc[-1], rel=0.05)

    def test_no_sensor_and_no_arm_adds_to_what_is_assumed(self, straight):
        told = TriadUncertainty(noise_density=0.01, bias=0.5, scale=0.01, misalignment=0.02)
        unit = replace(
            unit_of(straight, 0, "xz", ASSUMED, uncertainty=told),
            mounting=Mounting((0.5, -0.4, 0.2), position_sd=0.1, angles_sd_deg=1.0),
        )
        at, _ = path_of(unit)
        for name, contributor, force in zip(
            at.effects.names, at.effects.contributors, at.effects.force, strict=True
        ):
            if contributor not in (MISSING_AXIS, TURNED_AXIS, "levelling"):
                assert np.abs(force[:, 1]).max() == pytest.approx(0.0, abs=1e-12), name
        assert (at.effects.force_noise[:, 1] == 0.0).all()

    def test_the_statement_is_in_the_findings_once_a_unit(self):
        found = reconstruct(edr()[0], rate=100.0, window=(-0.03, 0.25))
        told = [f.what for f in found.findings if "is assumed to be" in f.what]
        assert len(told) == 2


@pytest.fixture(scope="module")
def both(straight):
    left = unit_of(straight, 0, "xz", ASSUMED, "LEFT", CHANNEL)
    right = unit_of(straight, 0, "xz", ASSUMED, "RIGHT", CHANNEL)
    return reconstruct(left, right)


class TestSeveral:
    def test_they_share_what_is_assumed(self, both):
        names = both.combined.at_point.effects.names
        assert sum(name.startswith("vehicle assumed heading") for name in names) == 3
        # Shared, it does not average out; the scale factors do.
        for unit in both.units:
            single, mean = unit.path.variances(), both.combined.path.variances()
            for line, column in ((MISSING_AXIS, "VE"), (NO_TURNING, "VE")):
                assert mean.loc[line, column] == pytest.approx(single.loc[line, column], rel=1e-6)
            assert mean.loc["scale factor", "VN"] == pytest.approx(
                0.5 * single.loc["scale factor", "VN"], rel=0.01
            )
        assert both.combined.at_point.assumed_axes == ("right", *TURNS)

    def test_they_are_compared_along_what_both_measure(self, both):
        (pair,) = both.comparison.pairs
        assert np.isnan(pair.difference[:, 1]).all()
        assert np.isnan(both.comparison.combined[:, 1]).all()
        assert np.isfinite(pair.difference[:, [0, 2]]).all()
        assert pair.freedom == 2 * (len(pair.edges) - 1)
        assert both.comparison.freedom == pair.freedom
        assert pair.axes.kind == "agree"
        assert pair.agree

    def test_what_they_both_measure_is_compared_indeed(self, straight):
        left = unit_of(straight, 0, "xz", ASSUMED, "LEFT", CHANNEL)
        right = unit_of(straight, 0, "x", ASSUMED, "RIGHT", CHANNEL)
        right.accelerometers[0].table.iloc[:] *= 1.2
        (pair,) = reconstruct(left, right).comparison.pairs
        assert not pair.agree
        assert pair.freedom == len(pair.edges) - 1
        assert "along forward" in pair.findings[0].what

    def test_without_an_axis_in_common_nothing_is_claimed(self, straight):
        ahead = unit_of(straight, 0, "x", ASSUMED, "AHEAD", CHANNEL)
        aside = unit_of(straight, 0, "yz", ASSUMED, "ASIDE", CHANNEL)
        found = reconstruct(ahead, aside)
        (pair,) = found.comparison.pairs
        assert (pair.freedom, pair.chi_square, pair.probability) == (0, 0.0, 1.0)
        assert pair.findings[0].code == "crash.measure-no-axis-common-not"
        # Each axis of the mean is that of the one which measures it.
        assert found.combined.at_point.assumed_axes == TURNS
        assert found.combined.at_point.force[:, 0] == pytest.approx(
            found.unit("AHEAD").at_point.force[:, 0], abs=1e-6
        )
        assert found.combined.at_point.force[:, 2] == pytest.approx(
            found.unit("ASIDE").at_point.force[:, 2], abs=1e-6
        )

    def test_a_gyro_goes_before_an_assumption(self, straight):
        time = pd.Index(straight.time, name="time")
        still = pd.DataFrame(np.zeros((len(time), 3)), time, ["gyro_x", "gyro_y", "gyro_z"])
        still.attrs = {"sampling": "mean"}
        gyro = RecordedTriad(still, TriadUncertainty(noise_density=1e-3, bias=0.05), "gyro")
        whole = replace(unit_of(straight, 0, "xyz", None, "IMU", CHANNEL), gyro=gyro)
        part = unit_of(straight, 0, "xz", ASSUMED, "PART", CHANNEL)
        found = reconstruct(part, whole)
        assert found.combined.at_point.assumed_axes == ()
        lines = found.combined.path.variances()
        # Through the arm there is nothing, the rates are those of the gyro alone.
        assert lines.loc[NO_TURNING, ["phi_n", "phi_e", "phi_d"]].max() == 0.0
        assert lines.loc[MISSING_AXIS].max() == pytest.approx(0.0, abs=1e-12)
        # Nothing of what is assumed is told to disagree with what is measured.
        assert found.comparison.agree

    def test_three_of_them_are_compared(self, straight):
        units = [
            path_of(unit_of(straight, 0, axes, ASSUMED, name, CHANNEL))[0]
            for axes, name in (("xz", "A"), ("xyz", "B"), ("x", "C"))
        ]
        found = compare_units(units)
        pieces = len(found.edges) - 1
        # 2 + 3 + 1 axes, less the three of the mean.
        assert found.freedom == 3 * pieces
        assert found.agree
        assert [a.freedom for a in found.against] == [2 * pieces, 3 * pieces, pieces]
        assert np.isfinite(found.combined).all()
        assert np.isnan(found.against[2].difference[:, 1:]).all()


class TestAnswers:
    def test_a_rollover_cannot_be_told(self, straight):
        found = reconstruct(unit_of(straight, 0, "xz", ASSUMED, uncertainty=CHANNEL))
        (kind,) = found.main.types
        assert kind.name == "front"
        assert kind.roll is None
        assert [r.code for r in kind.reasons] == ["crash.type-by-direction", "crash.type-no-roll"]

    def test_an_impact_along_an_assumed_axis_is_no_event(self):
        # All of it to the side, where the unit has no accelerometer.
        unit, _ = edr(axes="xz", pulse=(0.0, 9.0, 0.0))
        found = reconstruct(unit, rate=100.0, window=(-0.03, 0.25))
        assert found.main.events.events == ()
        assert any("along right cannot be detected" in f.what for f in found.findings)

    def test_the_largest_change_is_of_the_axis_that_is_measured(self, straight):
        (changes,) = reconstruct(unit_of(straight, 0, "xz", ASSUMED)).main.body
        assert changes.event.resultant == pytest.approx(CHANGE, rel=1e-3)
        assert changes.event.delta_v.vector[1] == pytest.approx(0.0, abs=1e-12)

    def test_an_entry_from_a_receiver_needs_the_turning(self, straight):
        at, _ = path_of(unit_of(straight, 0, "xyz", ASSUMED))
        with pytest.raises(DataError, check=coded("crash.assumed-not-measured-nothing-carries")):
            start_from_drive(at, DriveEntry(pd.DataFrame()), (0.0, 0.0, 0.0))

    def test_three_axes_need_no_stated_levelling(self, straight):
        unit = unit_of(straight, 0, "xyz", Assumed(turn_sd_deg=3.0), uncertainty=CHANNEL)
        found = reconstruct(unit, preparation={"rest": (-0.045, -0.005)})
        assert found.main.at_point.levelling.from_rest
        assert found.main.at_point.assumed_axes == TURNS

    def test_a_drawn_motion_is_another_than_a_straight_one(self, straight):
        other = drawn_motion(2, seed=1)
        assert np.abs(other.place[0][-1] - straight.place[0][-1]).max() > 0.01
        assert np.abs(other.place[0][-1] - other.place[1][-1]).max() > 0.01


@pytest.mark.parametrize("stated", [True, False])
def test_a_gyro_on_the_same_vehicle_is_named_where_none_is_borrowed(stated):
    crash = CRASHES["frontal"]
    own, other = (
        record_crash(crash.motion, d, impact=crash.start, seed=1)[0]
        for d in paper_units()
        if d.name.startswith("IMU")
    )
    assumed = Assumed(turn_sd_deg=2.0, because="a wall across") if stated else None
    without = replace(other, gyro=None, assumed=assumed)
    # What is said does not depend on the rate, and the comparison of units grows with it.
    options = CrashOptions(rate=50.0, combine=False)
    if stated:
        found = reconstruct_crash([own, without], Entry.from_speed(15.65, 0.05), options)
        (said,) = (f for f in found.findings if f.code == "crash.gyro-not-borrowed")
        assert said.file == "IMU2"
        words = said.remedy
    else:
        with pytest.raises(DataError) as error:
            reconstruct_crash([own, without], Entry.from_speed(15.65, 0.05), options)
        words = error.value.finding.remedy
    assert "gyro_from = 'IMU1'" in words
