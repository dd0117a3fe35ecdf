"""Turns by the gyros against those of the course of fixes."""

import numpy as np
import pandas as pd
import pytest
from tests.coded import coded

import strapdown as sd
from strapdown.config.logs import FixesTable, LogTable, with_answers
from strapdown.errors import DataError
from strapdown.navigation.measurements.gnss_course import (
    check_turns,
    turn_ratio,
    unit_of_turns,
)
from strapdown.simulation.gnss import GnssReceiver
from strapdown.systems.navigation_proposal import propose
from strapdown.tables import ACCEL, GYRO

DEGREES = 180.0 / np.pi


def drive(rate=5.0, speed_noise=0.1, place_noise=0.5, seed=1, **errors):
    receiver = GnssReceiver(
        rate=rate, position_noise=place_noise, velocity_noise=speed_noise, **errors
    )
    made = sd.simulate("drive-town", seed=seed, rate_hz=50.0, receiver=receiver)
    return made.gnss, made.imu


def scaled(imu, columns, by):
    out = imu.copy()
    out.attrs = imu.attrs
    out[columns] = out[columns] * by
    return out


def without_velocities(fixes):
    out = fixes.copy()
    out.attrs = fixes.attrs
    out[["VN_sd", "VE_sd", "VD_sd"]] = np.inf
    return out


@pytest.mark.parametrize("rate", [1.0, 5.0, 10.0])
def test_gyros_turn_as_far_as_the_course(rate):
    """But for sideslip and the lever arm; five standard deviations of its own."""
    found = turn_ratio(*drive(rate))
    assert abs(found.ratio - 1.0) < 5.0 * found.sd < 0.25
    assert found.share > 0.98


def test_positions_alone_at_a_high_rate_suffice():
    """Between fixes 0.1 s apart, 0.2 m of noise are 2.8 m/s."""
    fixes, imu = drive(10.0, place_noise=0.2)
    found = turn_ratio(without_velocities(fixes), imu)
    assert abs(found.ratio - 1.0) < 5.0 * found.sd < 0.5


@pytest.mark.parametrize(("by", "unit"), [(1.0, "rad/s"), (DEGREES, "deg/s"), (6.0, None)])
def test_the_unit_that_a_file_leaves_open_is_that_of_the_turns(by, unit):
    fixes, imu = drive(1.0)
    found = unit_of_turns(fixes, scaled(imu, GYRO, by))
    assert (None if found is None else found.data["unit"]) == unit
    assert unit is None or abs(found.data["ratio"] - 1.0) < 5.0 * found.data["sd"] < 0.75
    assert unit_of_turns(fixes.iloc[:90], imu) is None  # too few windows


@pytest.mark.parametrize("by", [1.0, DEGREES])
def test_a_proposal_asks_for_the_unit_of_the_turns(tmp_path, by):
    """Noise hides the steps of the sensor, which would show the unit, too."""
    fixes, imu = drive(1.0)
    noise = np.random.default_rng(3).normal(0.0, 2e-3, (len(imu), 3))
    table = pd.DataFrame({"time": imu.index})
    table[["wx", "wy", "wz"]] = (imu[GYRO].to_numpy() + noise) * by
    table[[f"acc_{a} (m/s2)" for a in "xyz"]] = imu[ACCEL].to_numpy()
    table.to_csv(tmp_path / "log.csv", index=False)
    places = fixes[["lat", "lon", "alt"]].rename(columns={"alt": "height_ellipsoid"})
    places.to_csv(tmp_path / "fixes.csv", index_label="time")
    unit = "rad/s" if by == 1.0 else "deg/s"
    log, gnss = (LogTable(path=str(tmp_path / "log.csv")), str(tmp_path / "fixes.csv"))
    with pytest.raises(DataError, check=coded("navigation.gyro-unit-by-course", unit=unit)) as it:
        propose(log, gnss=FixesTable(path=gnss))
    assert it.value.finding.data["flags"] == f"--gyro-unit {unit}"
    with pytest.raises(DataError, check=coded("io.unit-undecided")):
        propose(log)
    (one, _) = sd.doctor([log.path, gnss]).logs
    assert [q.code for q in one.questions] == ["navigation.gyro-unit-by-course"]
    assert (one.log.gyro_unit, {*one.streams}) == (unit, {"imu", "gnss"})
    answer = dict(it.value.finding.data["answers"])
    assert propose(with_answers(log, answer), gnss=FixesTable(path=gnss)).table["log"] == {
        "path": log.path,
        "gyro_unit": unit,
        "columns": {},
        "repair": False,
    }


@pytest.mark.parametrize(("by", "unit"), [(DEGREES, "deg/s"), (1.0 / DEGREES, "rad/s")])
def test_gyros_of_another_unit_are_refused(by, unit):
    fixes, imu = drive()
    with pytest.raises(DataError) as caught:
        check_turns(fixes, scaled(imu, GYRO, by))
    assert caught.value.finding.code == "navigation.course-shows-gyro-unit"
    assert caught.value.finding.data["unit"] == unit


@pytest.mark.parametrize(
    ("columns", "by", "code"),
    [
        (GYRO, -1.0, "navigation.course-turns-opposite"),
        (["gyro_z", "accel_z"], -1.0, "navigation.course-turns-opposite"),  # mirrored, as read
        (GYRO, 4.0, "navigation.course-turns"),
        (GYRO, 0.25, "navigation.course-turns"),
        (GYRO, 2.0, "navigation.course-turns"),
    ],
)
def test_gyros_that_turn_otherwise_are_reported(columns, by, code):
    """A left-handed triad turns opposite about the vertical, which gravity does not show."""
    fixes, imu = drive()
    if columns != GYRO:
        imu = scaled(imu, ["accel_z"], -1.0)  # z up, read as a right-handed triad
        columns = []
    (found,) = check_turns(fixes, scaled(imu, columns, by) if columns else imu)
    assert found.code == code


@pytest.mark.parametrize("by", [1.0, 1.3, 0.5])
def test_right_units_and_what_a_bank_makes_of_them_are_not_reported(by):
    """A bank of 60° makes a ratio of a half; 1.3 is within what a file can be trusted to show."""
    fixes, imu = drive()
    assert check_turns(fixes, scaled(imu, GYRO, by)) == []


@pytest.mark.parametrize("seed", [4, 6, 14, 22])
def test_slow_ends_of_a_drive_do_not_hide_its_turns(seed):
    """At 1 m/s noise of 0.05 m/s is 0.05 rad in a course, beside 0.0025 rad at 20 m/s.

    A window with such an end is noisy, and no fault: three of 13 that do not count leave too few.
    """
    rate, hz = 100.0, 5.0
    time = np.arange(0.0, 150.0, 1.0 / rate)

    def ramp(begin, end):
        u = np.clip((time - begin) / (end - begin), 0.0, 1.0)
        return u * u * (3.0 - 2.0 * u)

    speed = 20.0 * (ramp(12, 24) - ramp(136, 146)) - 18.8 * (ramp(40, 46) - ramp(60, 68))
    heading = np.radians(90 * ramp(30, 37) - 120 * ramp(50, 58) + 80 * ramp(72, 80))
    heading += np.radians(170 * ramp(110, 122) - 90 * ramp(94, 100))
    turn = np.gradient(heading, 1.0 / rate)
    force = np.column_stack([np.gradient(speed, 1.0 / rate), speed * turn, 0 * time - 9.81])
    samples = np.column_stack([0 * time, 0 * time, -turn, force])
    imu = sd.read_imu(
        pd.DataFrame({"time": time, **dict(zip([*GYRO, *ACCEL], samples.T, strict=True))}),
        units={"gyro": "rad/s", "accel": "m/s2"},
        axes="x,y,z",
    )
    rows = slice(None, None, round(rate / hz))
    velocity = (speed * [np.cos(heading), np.sin(heading)]).T[rows]
    velocity += np.random.default_rng(seed).normal(0.0, 0.05, velocity.shape)
    place = np.cumsum(velocity, axis=0) / hz
    fixes = sd.read_gnss(
        pd.DataFrame(
            {
                "time": time[rows],
                "lat": 48.0 + place[:, 0] / 111_200.0,
                "lon": 16.0 + place[:, 1] / 74_600.0,
                "alt": 200.0,
                "VN": velocity[:, 0],
                "VE": velocity[:, 1],
                "VD": 0.0,
            }
        ),
        position_sd_m=1.0,
        velocity_sd_m_per_s=0.1,
    )
    (found,) = check_turns(fixes, imu)
    assert found.code == "navigation.course-turns-opposite"
    # The noise of a slow end, 0.06 rad, on the turns of all windows, 3 rad (root sum square).
    assert abs(found.data["ratio"] + 1.0) < 0.02


def test_faults_of_fixes_do_not_count():
    """One fix in twenty is off by 60 m: the ratio is that of the others."""
    fixes, imu = drive(5.0, place_noise=0.5)
    fixes = without_velocities(fixes)
    rows = np.random.default_rng(3).random(len(fixes)) < 0.02
    fixes.loc[rows, "lat"] += 60.0 / 111_000.0
    found = turn_ratio(fixes, imu)
    assert abs(found.ratio - 1.0) < 5.0 * found.sd


def test_no_ratio_without_evidence():
    fixes, imu = drive()
    assert turn_ratio(fixes.iloc[:120], imu) is None  # too few windows
    slow = fixes.copy()
    slow.attrs = fixes.attrs
    slow[["VN", "VE"]] *= 0.01
    assert turn_ratio(slow, imu) is None  # a course of noise
    noisy = scaled(imu, GYRO, 0.0)
    noisy[GYRO] += np.random.default_rng(1).normal(0.0, 0.1, (len(imu), 3))
    assert turn_ratio(fixes, noisy) is None  # gyros that do not measure
    assert turn_ratio(fixes, scaled(imu, ACCEL, 0.02)) is None  # no gravity


@pytest.mark.parametrize("delay", [0.0, 1.0])
def test_an_offset_of_a_second_does_not_matter(delay):
    fixes, imu = drive(5.0)
    late = fixes.copy()
    late.attrs = fixes.attrs
    late.index = late.index + delay
    found = turn_ratio(late, imu)
    assert abs(found.ratio - 1.0) < max(5.0 * found.sd, 0.15)
