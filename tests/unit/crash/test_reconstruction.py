"""A crash from the record of a unit: its summary, what is asked of it, what contradicts itself."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.coded import coded

from strapdown import (
    CrashOptions,
    CrashUnit,
    Entry,
    Mounting,
    TriadUncertainty,
    reconstruct_crash,
    sample_paths,
)
from strapdown.crash.path import compare_with_reference
from strapdown.errors import ConfigError, DataError
from strapdown.simulation.crash_motion import CRASHES, CrashMotion, HaversinePulse
from strapdown.simulation.crash_recording import paper_units, record_crash
from strapdown.simulation.earth_motion import Origin
from strapdown.simulation.mounted_motion import MountedMotion
from strapdown.tables import NED

DESIGNS = {d.name: d for d in paper_units()}
ENTRY = Entry.from_speed(7.1, 0.1)


def record(name, seed=1):
    crash = CRASHES[name]
    return record_crash(crash.motion, DESIGNS["IMU1"], impact=crash.start, seed=seed)[0]


@pytest.fixture(scope="module")
def unit():
    return record("pole")


@pytest.fixture(scope="module")
def crash(unit):
    return reconstruct_crash([unit], ENTRY)


class TestSummary:
    def test_has_what_the_objects_have(self, crash):
        table = crash.summary()
        event = table.loc[("IMU1", "1 front")]
        (whole,) = (changes.event for changes in crash.main.body)
        assert event.loc["delta-V forward m/s", "value"] == whole.delta_v.vector[0]
        half = event["high"] - event["value"]
        assert half["delta-V right m/s"] == pytest.approx(whole.bound.half_width[1])
        assert half["delta-V resultant m/s"] == pytest.approx(whole.resultant_bound)
        assert event.loc["PDOF deg", "low"] == whole.interval.horizontal.low_deg
        end = table.loc[("IMU1", "path", "end east m")]
        assert end["value"] == crash.main.path.table["east"].iloc[-1]
        assert end["high"] - end["low"] == pytest.approx(
            2.0 * 1.96 * crash.main.path.sd["east"].iloc[-1], rel=1e-4
        )
        assert crash.main.summary().equals(table)

    def test_holds_the_truth(self, crash):
        # One seed of one crash: four standard deviations, where a bound of 95 % has 1.96.
        table = crash.summary()
        pole = CRASHES["pole"]
        motion = MountedMotion(pole.motion, Mounting())
        truth = motion.kinematics_from(np.array([pole.start + 0.75]), epoch=pole.start).position[0]
        for axis, value in zip(NED, truth, strict=True):
            row = table.loc[("IMU1", "path", f"end {axis} m")]
            assert abs(row["value"] - value) < 2.05 * (row["high"] - row["value"])
        row = table.loc[("IMU1", "1 front", "delta-V forward m/s")]
        assert abs(row["value"] - pole.delta_v[0][0]) < 2.05 * (row["high"] - row["value"])

    def test_is_told_in_a_few_lines(self, crash):
        assert len(repr(crash).splitlines()) == 4
        assert "IMU1, event 1, front: delta-V 7." in repr(crash)
        assert "ends north, east, down" in repr(crash.main.path)
        ned = repr(crash.main.ned[0].event)
        # Azimuth and its bounds on the same turn.
        assert "azimuth 35" in ned and "(35" in ned
        assert len(repr(crash.main.body[0])) < 500

    def test_without_an_event_has_the_path_alone(self):
        found = reconstruct_crash([record("pothole")], Entry.from_speed(14.0, 0.3))
        assert set(found.summary().index.get_level_values("part")) == {"path"}
        assert "no event, at most" in repr(found)


class TestEntry:
    def test_a_speed_that_the_record_contradicts_is_told(self, unit):
        (finding,) = reconstruct_crash([unit], Entry.from_speed(25.6, 0.3)).findings
        assert finding.quantity == "entry speed"
        assert "25.6" in finding.what and "divide km/h by 3.6" in finding.remedy

    def test_an_instant_in_the_crash_is_told(self, unit):
        late = replace(unit, trigger=unit.trigger + 0.05)
        findings = reconstruct_crash([late], ENTRY, CrashOptions(window=(-0.2, 0.5))).findings
        assert any(f.quantity == "entry" and "50.46 ms before" in f.what for f in findings)

    @pytest.mark.parametrize(("late", "told"), [(0.018, False), (0.022, True)])
    def test_time_zero_may_be_a_window_before_the_touch(self, unit, late, told):
        # Time zero of this record is 0.5 ms before its trigger, and the window has 20 ms: an
        # entry at the touch, 18.5 ms after, is in order; one 22.5 ms after is not.
        late = replace(unit, trigger=unit.trigger + late)
        findings = reconstruct_crash([late], ENTRY, CrashOptions(window=(-0.2, 0.5))).findings
        said = [f for f in findings if f.quantity == "entry" and "ms before" in f.what]
        assert bool(said) == told
        if said:
            assert "a rest that ends before that" in said[0].remedy

    def test_a_quiet_drive_is_no_rest_to_begin_at(self, unit):
        def late(triad):
            table = triad.table.loc[unit.trigger - 0.3 :]
            table.attrs = dict(triad.table.attrs)
            return replace(triad, table=table)

        short = replace(
            unit, accelerometers=tuple(map(late, unit.accelerometers)), gyro=late(unit.gyro)
        )
        with pytest.raises(
            DataError, check=coded("crash.entry-speed-unknown-quiet", quantity="entry")
        ):
            reconstruct_crash([short], None)
        reconstruct_crash([short], None, CrashOptions(preparation={"moving_at_impact": False}))
        reconstruct_crash([short], ENTRY)

    def test_a_level_velocity_on_a_slope_is_told(self):
        # 10 deg up: 1.2 m/s that the entry leaves out.
        slope = np.radians(10.0)
        up = np.array([np.cos(slope), 0.0, -np.sin(slope)])
        motion = CrashMotion(
            4.0,
            Origin(45.0, 20.0, 100.0),
            tuple(7.1 * up),
            (HaversinePulse(2.0, 0.113, tuple(-7.2 * up)),),
            pitch_deg=10.0,
        )
        unit, _ = record_crash(motion, DESIGNS["IMU1"], impact=2.0, seed=1)
        # It coasts, and so is level to what the sensors leave: 2 deg.
        options = {"preparation": {"steady_acceleration": 0.0}}
        level = reconstruct_crash([unit], ENTRY, CrashOptions(**options)).findings
        (told,) = (f for f in level if f.quantity == "entry")
        assert "is 0 m/s upward" in told.what
        assert "the vehicle pitches" in told.what
        climbing = Entry(0.0, tuple(7.1 * up), 0.0)
        assert not any(f.quantity == "entry" for f in reconstruct_crash([unit], climbing).findings)

    @pytest.mark.parametrize(
        ("make", "words"),
        [
            (lambda: Entry.from_speed("7.1", 0.1), r"entry, speed: '7\.1' is out of range"),
            (lambda: Entry.from_speed(7.1, None), "entry, speed_sd: None is out of range"),
            (
                lambda: Entry.from_speed(7.1, 0.1, latitude=50.0),
                "entry: unknown key of an entry: 'latitude'",
            ),
            (lambda: Entry(0.0, 7.1, 0.0), "three finite numbers are needed"),
            (lambda: Entry(np.nan, (7.1, 0.0, 0.0), 0.0), "entry, time: nan is not a number"),
        ],
    )
    def test_bad_numbers(self, make, words):
        with pytest.raises(ConfigError, match=words):
            make()


class TestArguments:
    @pytest.mark.parametrize(
        ("options", "words"),
        [
            ({"units": None}, "units: no unit is given"),
            ({"units": "IMU1"}, "units: a value of type str is not accepted here"),
            ({"units": ["IMU1"]}, "units: a value of type str is not accepted here"),
            ({"entry": 7.1}, "entry: a value of type float"),
            ({"point": (0.0, 0.0)}, "point: .* three"),
            ({"point": "cg"}, "point: 'cg'"),
            ({"point": (1600.0, 0.0, 0.0)}, "1600 m from the vehicle's origin"),
            ({"window": 0.75}, r"window: 0\.75 is not a window"),
            ({"window": (0.75, -0.1)}, r"\) is not a window"),
            ({"window": (-0.1, np.nan)}, r"\) is not a window"),
            ({"rate": "200"}, "rate of '200' Hz is not positive"),
            ({"clock": "triger"}, "did you mean 'trigger'"),
            ({"preparation": ["rest"]}, "preparation: a value of type list is not accepted here"),
            ({"preparation": {"IMU1": 5}}, "preparation, IMU1: a value of type int"),
            ({"preparation": {"leveling": (0, 0, 1)}}, "did you mean 'levelling'"),
            ({"preparation": {"levelling": 1.5}}, "levelling: 1.5: three finite"),
            ({"preparation": {"levelling": (0, 0, -1)}}, "IMU1, levelling"),
            ({"preparation": {"rest": 5}}, "IMU1, rest: 5 is not an interval"),
            ({"preparation": {"rest": (-3, -5)}}, r"IMU1, rest: \(-3, -5\) is not an interval"),
            ({"preparation": {"margin": "x"}}, "IMU1, margin: 'x'"),
            ({"preparation": {"impact": np.nan}}, "IMU1, impact: nan"),
            ({"preparation": {"IMU9": {}}}, "preparation: unknown unit 'IMU9'"),
            ({"preparation": {"IMU1": 3}}, "preparation, IMU1: a value of type int"),
            ({"peak_window": "30"}, "peak_window: a length of '30' is not positive"),
            ({"peak_window": 0.0}, r"peak_window: a length of 0\.0 is not positive"),
            ({"rate": 1e6}, "1e\\+06 Hz is more than 10 times the 200 Hz"),
            ({"rule": None}, "rule: a value of type NoneType"),
            ({"gravity": "9.8"}, "gravity: a value of type str"),
            ({"gravity": 1.0}, "gravity of"),
            ({"mechanization": "ned"}, "mechanization: a value of type str"),
        ],
    )
    def test_are_named(self, unit, options, words):
        own = dict(options)
        units, entry = own.pop("units", [unit]), own.pop("entry", ENTRY)
        with pytest.raises((ConfigError, DataError), match=words) as error:
            reconstruct_crash(units, entry, CrashOptions(**own))
        assert error.value.finding.remedy

    def test_one_unit_is_no_list(self, unit):
        with pytest.raises(ConfigError, check=coded("crash.unit-list-needed")):
            reconstruct_crash(unit, ENTRY)

    @pytest.mark.parametrize(
        ("options", "words"),
        [
            ({"runs": "10"}, "'10' runs"),
            ({"runs": 10.5}, "10.5 runs"),
            ({"runs": 1}, "1 runs"),
            ({"seed": -1}, "seed: -1"),
            ({"seed": None}, "seed: None"),
            ({"workers": 0}, "workers: 0"),
        ],
    )
    def test_of_the_runs(self, crash, options, words):
        with pytest.raises(ConfigError, match=words):
            sample_paths(crash.main.path, **{"runs": 10, **options})

    def test_runs_need_a_path(self, crash):
        with pytest.raises(ConfigError, check=coded("crash.path-of-wrong-type", quantity="path")):
            sample_paths(crash, runs=10)

    def test_a_sample_that_there_is_not(self, crash):
        with pytest.raises(ConfigError, match="sample 10000"):
            crash.main.path.variances(10_000)


class TestUnits:
    @pytest.mark.parametrize(
        ("make", "words"),
        [
            (
                lambda u: replace(u, accelerometers=u.gyro),
                "IMU1, accelerometers: a value of type RecordedTriad is not accepted",
            ),
            (lambda u: replace(u, gyro=u.gyro.table), "IMU1, gyro: .* DataFrame"),
            (lambda u: replace(u, mounting=None), "IMU1, mounting"),
            (lambda u: replace(u, trigger="10.7"), "IMU1, trigger: .* str"),
            (lambda u: replace(u.gyro, table=None), "table: a value of type NoneType"),
            (lambda u: replace(u.gyro, uncertainty=0.1), "uncertainty: a value of type float"),
            (lambda u: Mounting(None), "position: None"),
            (lambda u: Mounting(("a", 0, 0)), "position: \\('a', 0, 0\\)"),
            (lambda u: Mounting((600.0, 0.0, 0.0)), "divide mm by 1000"),
            (lambda u: Mounting(position_sd="1"), "position_sd: '1'"),
            (lambda u: Mounting(angles_sd_deg=-1.0), "angles_sd_deg: -1.0"),
            (lambda u: TriadUncertainty(bias="0.1"), r"bias: '0\.1' is not a number"),
            (lambda u: TriadUncertainty(bias=None), "bias: None is not a number"),
            (lambda u: TriadUncertainty(full_scale=0.0), r"full_scale: 0\.0 is not positive"),
            (lambda u: TriadUncertainty(bandwidth=0.0), r"bandwidth: 0\.0 is not positive"),
        ],
    )
    def test_parts_of_another_kind_are_named(self, unit, make, words):
        with pytest.raises(ConfigError, match=words):
            make(unit)

    def test_a_list_of_triads_is_a_tuple(self, unit):
        assert CrashUnit("X", list(unit.accelerometers)).accelerometers == unit.accelerometers

    def test_numbers_of_numpy_are_numbers(self):
        found = TriadUncertainty(bias=np.float32(0.5), scale=np.array([1, 2, 3]))
        assert (found.bias, found.scale) == ((0.5, 0.5, 0.5), (1.0, 2.0, 3.0))


class TestReference:
    @pytest.mark.parametrize(
        ("make", "words"),
        [
            (lambda t: None, "reference path: a value of type NoneType is not accepted here"),
            (lambda t: t[["north", "east"]], "reference path: missing column down"),
            (lambda t: t.assign(north_sd=1.0), "reference path: missing column east_sd, down_sd"),
            (lambda t: t.iloc[:0], "no rows"),
            (lambda t: t.iloc[::-1], "row 2, .* time does not increase"),
            (lambda t: t.astype(object).replace(t.iloc[5, 0], "x"), "the table is not numeric"),
            (lambda t: t.mask(t.index.to_series() > 0.5), "row 122, .* not finite"),
            (
                lambda t: t.assign(north_sd=-1.0, east_sd=1.0, down_sd=1.0),
                "standard deviation is negative",
            ),
        ],
    )
    def test_what_it_lacks_is_named(self, crash, make, words):
        with pytest.raises(DataError, match=words):
            compare_with_reference(crash.main.path, make(crash.main.path.table[NED]))
