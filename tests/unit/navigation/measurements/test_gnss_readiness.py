"""What fixes show to be wrong is told, with what helps; what is right is not."""

from __future__ import annotations

import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from tests.coded import coded

sys.path.insert(0, str(Path(__file__).parents[3]))

from tests.gnss_faults import Frozen, Outage, Outliers, inject_gnss_faults

import town_drive as town
from strapdown.config.logs import LogTable
from strapdown.errors import DataError
from strapdown.frames import geodetic_from_ned
from strapdown.navigation.measurements import gnss_clock
from strapdown.navigation.measurements.gnss import Gnss
from strapdown.navigation.measurements.gnss_clock import (
    check_overlap,
    find_time_offset,
    find_velocity_delay,
    time_offset,
    velocity_delay,
)
from strapdown.navigation.measurements.gnss_readiness import gnss_readiness, without_repeats
from strapdown.sensors.triad_errors import ImuErrors
from strapdown.simulation import simulate_imu
from strapdown.tables import GEODETIC, POSITION_SD, VELOCITY, VELOCITY_SD, gnss_table, imu_table


@cache
def imu():
    return simulate_imu(town.motion(), ImuErrors(), rate=20.0, sampling="mean")[0]


def remade(table, time=None, place=None, velocity=None, velocity_sd=None, position_sd=None):
    """The table with some of it exchanged, checked anew."""
    return gnss_table(
        table.index.to_numpy() if time is None else time,
        table[GEODETIC].to_numpy() if place is None else place,
        table[VELOCITY].to_numpy() if velocity is None else velocity,
        table[POSITION_SD].to_numpy() if position_sd is None else position_sd,
        table[VELOCITY_SD].to_numpy() if velocity_sd is None else velocity_sd,
        source="receiver.csv",
    )


def late(delay, rate=4.0, seed=5, **noise):
    """Fixes whose velocity is of an instant so much before that of their place."""
    noise = {"position_noise": 0.02, "velocity_noise": 0.03, **noise}
    table = town.fixes(seed=seed, rate=rate, **noise)
    shifted = town.fixes(seed=seed, rate=rate, time_offset=delay, **noise)
    time = table.index.to_numpy()
    keep = (time > 3.0) & (time < time[-1] - 3.0)
    velocity = np.column_stack(
        [np.interp(time, shifted.index, shifted[c].to_numpy()) for c in VELOCITY]
    )
    return remade(table[keep], velocity=velocity[keep])


def test_nothing_is_said_of_fixes_that_are_as_they_should_be():
    assert gnss_readiness(remade(town.fixes()), imu()) == ()


def test_the_delay_of_a_mean_velocity_is_half_of_its_interval():
    # A mean over the 0.25 s before the stamp, from places: their difference.
    table = town.fixes(rate=4.0, position_noise=0.01, velocity_noise=0.03)
    mean = town.fixes(rate=4.0, position_noise=0.0, velocity_noise=0.0)
    from strapdown.frames import place_difference

    place = mean[GEODETIC].to_numpy()
    noise = np.random.default_rng(1).normal(0.0, 0.03, (len(place) - 1, 3))
    velocity = place_difference(place[1:], place[:-1]) / 0.25 + noise
    table = remade(table.iloc[1:], velocity=velocity)
    found = velocity_delay(table)
    assert found.sd < 0.003
    assert found.delay == pytest.approx(0.125, abs=4.0 * found.sd)
    (told,) = find_velocity_delay(table)
    assert f"velocity_delay_s = {found.delay:.3g}" in told.remedy
    assert not find_velocity_delay(table, 0.125)


@pytest.mark.slow
def test_the_stated_deviation_of_a_delay_is_that_of_its_errors():
    off = []
    for seed in range(8):
        for more in ({}, {"rate": 10.0}, {"rate": 1.0}):
            table = town.fixes(seed=seed, **more)
            found = velocity_delay(table)
            off.append(found.delay / found.sd)
    # 24 that are normal have a root mean square within 0.5 to 1.5 but for one of 2000 times.
    assert 0.5 < float(np.sqrt(np.mean(np.square(off)))) < 1.5


def test_places_that_are_later_than_velocities_have_a_remedy_too():
    (told,) = find_velocity_delay(late(-0.2))
    assert "earlier" in told.what
    assert "two measurements" in told.remedy


@pytest.mark.parametrize("offset", [pytest.param(0.15, marks=pytest.mark.slow), -0.4, 4.0, 18.0])
def test_the_offset_of_the_clocks_is_found_to_a_tenth_of_a_second(offset):
    table = remade(town.fixes(time_offset=offset, velocity_noise=0.02))
    found = time_offset(table, imu())
    assert found.offset == pytest.approx(offset, abs=0.05)
    assert found.offset == pytest.approx(offset, abs=3.0 * found.sd)
    (told,) = find_time_offset(table, found)
    assert "time_offset_s" in told.remedy
    leap = told.code == "navigation.receiver-clock-off-leap-seconds"
    assert leap == (offset == 18.0)
    # What the filter is to find is not told again.
    assert not find_time_offset(table, found, found.offset)
    assert not find_time_offset(table, found, 0.0, assumed_sd=abs(offset))


@pytest.mark.parametrize("decimals", [16, 12, 9])
def test_nothing_is_divided_by_where_nothing_is_left_to_explain(decimals):
    """Integrals of the sensors are course and speed to the last digit, as of a toy simulation.

    Each gives the offset to 1e-4 s and says 1e-6 s: they may disagree, and there is no answer.
    """
    time = np.arange(0.0, 120.0, 0.02)
    course, speed = 0.6 * np.sin(0.2 * time), 12.0 + 3.0 * np.sin(0.13 * time)
    rate, force = np.zeros((2, len(time), 3))
    rate[1:, 2], force[1:, 0] = np.diff(course) / 0.02, np.diff(speed) / 0.02
    flat = imu_table(time, rate, force, sampling="mean")
    velocity = np.column_stack([speed * np.cos(course), speed * np.sin(course), 0.0 * time])
    place = np.tile([50.0, 8.0, 100.0], (len(time), 1))
    sds = (0.05,) * 3
    table = gnss_table(time, place, velocity.round(decimals), sds, sds).iloc[::50]
    found = time_offset(table, flat)
    assert found is None or abs(found.offset) < 1e-3


def test_the_first_steps_are_enough_for_the_offset_of_a_long_record(monkeypatch):
    table = remade(town.fixes(time_offset=0.15, velocity_noise=0.02))
    whole = time_offset(table, imu())
    monkeypatch.setattr(gnss_clock, "MOST_STEPS", len(table) // 2)
    half = time_offset(table, imu())
    assert half.offset != whole.offset
    assert half.offset == pytest.approx(0.15, abs=3.0 * half.sd)
    # What comes later is not looked at.
    later = table.copy()
    later.attrs = dict(table.attrs)
    later.iloc[-20:, later.columns.get_loc("VN")] += 30.0
    assert time_offset(later, imu()) == half


@pytest.mark.parametrize("offset", [0.0, -0.43])
def test_precise_velocities_show_the_offset_of_a_walk(offset):
    """At 1 to 1.8 m/s, with corners; velocities of 0.3 m/s do not."""
    time = np.arange(0.0, 150.0, 0.02)
    rate, force = np.zeros((2, len(time), 3))
    for k in range(1, 15):
        rate[:, 2] += (-1) ** (k // 3) * 0.9 * np.exp(-np.square((time - 9.7 * k) / 0.9))
    speed = 1.4 + 0.25 * np.sin(0.9 * time) + 0.15 * np.sin(2.3 * time)
    force[:, 0], force[:, 2] = np.gradient(speed, time), -9.81
    course = np.append(0.0, np.cumsum(rate[:-1, 2] * 0.02))
    flat = imu_table(time, rate, force)
    rng = np.random.default_rng(4)
    walks = speed[:, None] * np.column_stack([np.cos(course), np.sin(course), 0.0 * time])
    place = np.tile([50.0, 8.0, 100.0], (len(time), 1))
    for sd in (0.03, 0.3):
        sds = np.full((len(time), 3), sd)
        velocity = walks + sd * rng.standard_normal(walks.shape)
        table = gnss_table(time + offset, place, velocity, 5.0 + 0.0 * sds, sds).iloc[::25]
        found = time_offset(table, flat)
        if sd == 0.3:
            assert found is None
        else:
            assert found.offset == pytest.approx(offset, abs=min(0.15, 3.0 * found.sd))
            assert found.sd < 0.15  # of 0.2 s that are assumed otherwise


def test_places_alone_are_enough_for_the_offset():
    table = town.fixes(time_offset=0.3, position_noise=0.1)
    table = remade(table, velocity_sd=(np.inf,) * 3, velocity=np.zeros((len(table), 3)))
    # By the course, which is ahead of the heading by an arm of 1 m over 12 m/s.
    found = time_offset(table, imu())
    assert found.offset == pytest.approx(0.3 - 1.0 / 12.0, abs=0.06)
    assert found.offset == pytest.approx(0.3, abs=2.0 * found.sd)
    assert velocity_delay(table) is None


@pytest.mark.parametrize(
    ("time", "stamps", "words"),
    [
        (lambda t: t + 1_700_000_000.0, lambda t: t, "Unix time"),
        (lambda t: t + 1_700_000_000.0, lambda t: t + 1_384_035_218.0, "GPS time since 1980"),
        (lambda t: t + 1_700_000_000.0, lambda t: t + 252_818.0, "subtract 1699747182"),
        (lambda t: t + 252_818.0, lambda t: t, "seconds from its own start"),
        (lambda t: t + 400_000.0 + 7200.0, lambda t: t + 400_000.0, "hours (2)"),
        (lambda t: (t + 300_000.0) * 1000.0, lambda t: t + 300_000.0, "in ms"),
        (lambda t: t + 300_000.0 + 1234.0, lambda t: t + 300_000.0, "1234"),
    ],
)
def test_two_clocks_are_told_apart(time, stamps, words):
    table = town.fixes()
    table = remade(table, time=time(table.index.to_numpy()), velocity_sd=(np.inf,) * 3)
    record = imu().copy()
    record.attrs = dict(imu().attrs)
    record.index = stamps(record.index.to_numpy())
    with pytest.raises(DataError) as error:
        check_overlap(table, record)
    assert words in str(error.value)
    assert "receiver.csv" in str(error.value)


def test_the_second_of_the_week_is_what_is_left():
    # 2023-11-14 22:13:20 UTC is Unix time 1700000000, and with 18 leap seconds the second 252818
    # of the GPS week that began at Unix time 1699747182.
    assert (1_700_000_000 - 315_964_800 + 18) % 604_800 == 252_818


def test_an_outage_at_the_start_is_told_with_its_row():
    table = remade(inject_gnss_faults(town.fixes(), [Outage(0.0, 25.0)]))
    (told,) = check_overlap(table, imu())
    assert "after its start" in told.what
    assert told.row == 1


def test_fixes_beyond_the_part_that_was_asked_for_are_not_counted():
    table, record = remade(town.fixes()), imu()
    first, last = record.index[0], table.index[-1]
    asked = first + 0.4 * (last - first)
    cut = record[record.index <= asked]
    cut.attrs = dict(record.attrs)
    code = "navigation.fixes-outside-inertial-record"
    told = {one.code: one for one in check_overlap(table, cut)}
    assert told[code].data["count"] == len(table)
    part = LogTable(path="log.csv", to_s=asked).part_s(first)
    assert code not in {one.code for one in check_overlap(table, cut, 0.0, part)}
    # What was asked for, and is not in the record, counts.
    later = LogTable(path="log.csv", from_s=first, duration_s=2.0 * (asked - first)).part_s(first)
    told = {one.code: one for one in check_overlap(table, cut, 0.0, later)}
    within = table.index <= first + 2.0 * (asked - first)
    assert told[code].data["count"] == within.sum()
    assert told[code].data["outside"] == (within & (table.index > cut.index[-1])).sum()


def test_gaps_jumps_and_repeats_are_told_with_their_rows():
    table = town.fixes()
    (gap,) = gnss_readiness(remade(inject_gnss_faults(table, [Outage(50.0, 80.0)])))
    assert "1 outage of fixes, 30.5 s" in gap.what
    place = table[GEODETIC].to_numpy().copy()
    place[100, 0] += 500.0 / 111_000.0
    (jump,) = gnss_readiness(remade(table, place=place))
    assert jump.row in (101, 102)
    assert "jumps in rows 101, 102" in jump.what
    (frozen,) = gnss_readiness(remade(inject_gnss_faults(table, [Frozen(60.0, 61.6)])))
    assert "repeats its fixes in rows" in frozen.what
    wild = inject_gnss_faults(table, [Outliers(share=0.1, size=50.0)])
    assert any("jumps" in one.what for one in gnss_readiness(remade(wild)))


def test_a_frozen_receiver_is_found_by_positions_alone_and_one_that_stands_is_not():
    alone = {"velocity_sd": (np.inf,) * 3}
    table = remade(inject_gnss_faults(town.fixes(), [Frozen(60.0, 68.0)]), **alone)
    left, (found,) = without_repeats(table)
    assert found.code == "navigation.receiver-repeats"
    time, dropped = table.index.to_numpy(), left["quality"].to_numpy() == 0.0
    assert dropped.sum() >= 14
    assert ((time[dropped] > 60.0) & (time[dropped] < 68.5)).all()
    assert (table["quality"] > 0.0).all()
    # It stops within 10 s, its receiver holds the position, and it drives off.
    fresh = town.fixes()[GEODETIC].to_numpy()
    place = fresh.copy()
    ahead = np.linspace(0.0, 1.0, 21)[:, None]
    place[100:121] = fresh[100] + (fresh[120] - fresh[100]) * (2.0 * ahead - ahead**2)
    place[120:140] = place[120]
    off = np.clip(np.arange(len(place) - 140) / 60.0, 0.0, 1.0)[:, None]
    place[140:] = place[120] + (fresh[140:] - fresh[140]) * off
    assert without_repeats(remade(town.fixes(), place=place, **alone))[1] == ()


@pytest.mark.parametrize("walk", ["goes on", "ends in it", "begins in it", "rests meanwhile"])
def test_a_walk_is_less_than_what_a_receiver_may_be_off_and_more_than_its_scatter(walk):
    """18 equal fixes of a phone, whose errors of metres last: 1.3 m/s, or at rest."""
    time, walks = np.arange(120.0), walk != "rests meanwhile"
    way = (
        1.3
        * {
            "goes on": time,
            "ends in it": np.minimum(time, 77.0),
            "begins in it": np.maximum(time, 61.0),
            "rests meanwhile": np.where(time < 60.0, time, np.maximum(60.0, time - 18.0)),
        }[walk]
    )
    random = np.random.default_rng(11)
    off = 0.3 * random.standard_normal((len(time), 3)) + [2.0, -1.0, 1.0]
    off[:, 0] += way
    off[60:78] = off[60]
    here = np.array([50.0, -90.0, 500.0])
    place = np.array([geodetic_from_ned(one, here) for one in off])
    nothing = np.full((len(time), 3), np.inf)
    table = gnss_table(time, place, 0.0 * place, 0.0 * place + 2.5, nothing, source="phone.csv")
    left, found = without_repeats(table)
    dropped = np.flatnonzero(left["quality"].to_numpy() == 0.0)
    assert dropped.tolist() == (list(range(61, 78)) if walks else [])
    assert [one.code for one in found] == ["navigation.receiver-repeats"] * walks


def test_jumps_are_found_in_places_alone():
    table = town.fixes()
    place = table[GEODETIC].to_numpy().copy()
    place[100, 1] += 500.0 / 78_000.0
    told = gnss_readiness(
        remade(table, place=place, velocity_sd=(np.inf,) * 3, velocity=0.0 * place)
    )
    assert "101" in told[0].what


def test_a_deviation_of_zero_is_told_with_the_option_that_helps():
    table = remade(town.fixes(), position_sd=(0.0, 1.0, 1.0))
    (told,) = gnss_readiness(table)
    assert "least_position_sd_m" in told.remedy
    assert "row" in str(told)


def test_units_of_places_are_told_by_their_speed():
    table = town.fixes()
    place = table[GEODETIC].to_numpy().copy()
    place[:, :2] = np.radians(place[:, :2])
    with pytest.raises(DataError, match="radians"):
        gnss_readiness(remade(table, place=place))
    place = table[GEODETIC].to_numpy().copy()
    minutes = np.floor(place[:, :2]) + (place[:, :2] % 1.0) * 0.6
    place[:, :2] = minutes
    with pytest.raises(DataError, check=coded("tables.places-in-degrees-and-minutes")):
        gnss_readiness(remade(table, place=place))


def test_places_that_move_faster_than_anything_are_refused():
    table = town.fixes()
    place = table[GEODETIC].to_numpy().copy()
    place[:, 1] *= 100.0 * (np.arange(len(place)) % 2)
    place[:, 1] %= 180.0
    with pytest.raises(DataError, check=coded("navigation.places-move-fix-fix-steps")):
        gnss_readiness(remade(table, place=place, velocity_sd=(np.inf,) * 3))


def test_no_fix_at_all_is_refused():
    table = town.fixes()
    table = remade(table, position_sd=(np.inf,) * 3, velocity_sd=(np.inf,) * 3)
    with pytest.raises(DataError, check=coded("navigation.none-rows-fix-quality-or")):
        gnss_readiness(table)


def test_what_is_configured_is_not_told_again():
    table = remade(town.fixes(time_offset=0.3, velocity_noise=0.02))
    assert gnss_readiness(table, imu())
    assert not gnss_readiness(table, imu(), Gnss(name="rtk", time_offset=0.3))
    assert not gnss_readiness(table, imu(), Gnss(name="rtk", time_offset_sd=0.2))


@pytest.mark.parametrize("delay", [0.0, 0.5])
def test_speed_and_course_alone_show_their_delay(delay):
    """A phone and a receiver's RMC sentence have no vertical velocity."""
    table = late(delay, rate=1.0)
    level = table[VELOCITY_SD].to_numpy().copy()
    level[:, 2] = np.inf
    found, whole = velocity_delay(remade(table, velocity_sd=level)), velocity_delay(table)
    assert found.sd < 1.5 * whole.sd
    assert found.delay == pytest.approx(delay, abs=4.0 * found.sd)
