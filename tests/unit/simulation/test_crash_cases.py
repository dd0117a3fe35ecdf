"""Crashes with their recorders: who writes, from when, and what is told of the entry."""

from __future__ import annotations

import numpy as np
import pytest

from strapdown.errors import ConfigError
from strapdown.simulation.crash_cases import CASES, SPEED_SD, find_case, record_case
from strapdown.simulation.crash_motion import CRASHES
from strapdown.simulation.crash_recording import record_crash
from strapdown.tables import NED, POSITION_SD


def names(case, units=()):
    return [r.design.name for r in case.chosen(units)]


def test_every_crash_is_a_case_of_the_papers_recorders():
    for name in CRASHES:
        assert names(CASES[name]) == ["IMU1", "IMU2"]
        assert names(CASES[name], ["all"]) == ["IMU1", "IMU2", "LAB1", "LAB2"]


def test_recorders_are_named_in_any_case_and_any_order():
    assert names(CASES["pole"], ["lab2", "imu1"]) == ["IMU1", "LAB2"]
    assert names(CASES["tadic-pole"]) == ["IMU1", "IMU2", "LAB1", "LAB2"]


@pytest.mark.parametrize(
    ("case", "units", "what", "remedy"),
    [
        ("pole", ["IMU3"], "'pole' has no recorder 'IMU3'", "IMU2"),
        ("pole", ["LAB1"], "LAB1 has no gyro and uses that of IMU1", "give IMU1 too"),
        ("no-gyro", ["IMU2"], "'no-gyro' has no recorder 'IMU2'", "IMU1"),
    ],
)
def test_a_choice_that_cannot_be_is_answered_with_what_can(case, units, what, remedy):
    with pytest.raises(ConfigError) as told:
        CASES[case].chosen(units)
    assert what in str(told.value)
    assert remedy in str(told.value)


def test_an_unknown_case_is_answered_with_the_nearest():
    with pytest.raises(ConfigError, match="saturated"):
        find_case("saturate")


@pytest.mark.parametrize("sampling", ["instantaneous", "mean"])
def test_the_records_are_those_of_the_recorder_alone(sampling):
    # Neither the other recorders nor cameras and light gate change what one draws.
    case = CASES["pole"]
    recorded = record_case(case, ["IMU2", "IMU1"], seed=5, sampling=sampling)
    of = recorded.units[1]
    alone, truth = record_crash(
        case.crash.motion,
        of.recorder.design,
        impact=case.crash.start,
        seed=5,
        end=case.crash.start + 0.85,
        sampling=sampling,
    )
    assert of.truth == truth
    assert of.unit.trigger == alone.trigger
    for ours, theirs in zip(
        (*of.unit.accelerometers, of.unit.gyro),
        (*alone.accelerometers, alone.gyro),
        strict=True,
    ):
        assert ours.table.equals(theirs.table)
        assert ours.uncertainty == theirs.uncertainty


def test_a_rate_is_that_of_the_recorders_and_not_of_the_laboratory():
    recorded = record_case(CASES["pole"], ["all"], rate=1000.0)
    steps = {
        of.unit.name: float(np.median(np.diff(of.unit.accelerometers[0].table.index)))
        for of in recorded.units
    }
    assert steps == pytest.approx({"IMU1": 1e-3, "IMU2": 1e-3, "LAB1": 1e-4, "LAB2": 1e-4})
    # Anywhere in an interval between samples.
    assert recorded.units[0].unit.trigger_sd == pytest.approx(1e-3 / np.sqrt(12.0))


def test_what_is_told_of_a_mounting_can_be_wrong():
    first, second = record_case(CASES["side-disagree"]).units
    # 1 deg of a small turn about each axis is drawn on top: six of them.
    assert second.unit.mounting.angles_deg == (0.0, 0.0, 0.0)
    assert second.truth.mounting.angles_deg[2] == pytest.approx(20.0, abs=6.0)
    assert abs((first.truth.mounting.angles_deg[2] + 180.0) % 360.0 - 180.0) < 6.0


def test_the_high_range_of_the_saturated_records_ends_at_16_g():
    for of in record_case(CASES["saturated"]).units:
        high = of.unit.accelerometers[1].table.to_numpy()
        assert np.abs(high).max() == pytest.approx(16.0 * 9.80665, abs=0.4)  # a step


def test_records_begin_where_the_case_says():
    short = record_case(CASES["short-rest"])
    crash = short.case.crash
    towed = min(p.start for p in crash.motion.pulses)
    for of in short.units:
        begins = of.unit.accelerometers[0].table.index[0]
        rest = of.truth.clock(towed) - begins
        assert 0.2 < rest < 0.6


@pytest.mark.parametrize("name", ["pole", "side", "rollover", "hard-braking", "saturated"])
def test_cameras_see_the_whole_path_within_what_they_state(name):
    recorded = record_case(CASES[name], seed=2)
    seen = recorded.camera_path
    # Each ms from 0.1 s before to 0.75 s after.
    assert len(seen) == 851
    exact = recorded.truth[NED].to_numpy()[: len(seen)]
    assert np.abs(seen.index.to_numpy() - recorded.truth.index.to_numpy()[: len(seen)]).max() < 1e-9
    apart = (seen[NED].to_numpy() - exact) / seen[POSITION_SD].to_numpy()
    # 2553 normal numbers of unit variance at most: beyond 5 one in 700 such records.
    assert np.abs(apart).max() < 5.0


@pytest.mark.slow
@pytest.mark.parametrize("name", [n for n, c in CRASHES.items() if c.kind])
def test_the_entry_is_the_motions_own(name):
    recorded = record_case(CASES[name], seed=4)
    entry, at = recorded.entry, recorded.truth.loc[0.0]
    assert entry.speed == pytest.approx(np.hypot(at["VN"], at["VE"]), rel=1e-9)
    assert abs(entry.told_speed - entry.speed) < 5.0 * SPEED_SD
    # Heading and slip together are the direction of travel.
    course = np.radians(entry.heading_deg + entry.slip_deg)
    travel = np.array([at["VN"], at["VE"]]) / entry.speed
    assert np.allclose(travel, [np.cos(course), np.sin(course)], atol=1e-9)


def test_a_seed_is_another_crash_record_and_the_same_crash():
    one, two = (record_case(CASES["pole"], ["IMU1"], seed=s) for s in (1, 2))
    assert one.truth.equals(two.truth)
    assert one.entry.told_speed != two.entry.told_speed
    assert one.units[0].truth != two.units[0].truth
