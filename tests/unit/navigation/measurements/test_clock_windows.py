"""Offset of a receiver's clock in windows of a drive."""

from __future__ import annotations

import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[3]))

import town_drive as town
from strapdown.frames import geodetic_from_ned
from strapdown.navigation.measurements.clock_windows import (
    Offsets,
    stamp_step,
    step_finding,
    window_offsets,
)
from strapdown.navigation.measurements.gnss_clock import time_offset, velocity_delay
from strapdown.navigation.measurements.gnss_readiness import gnss_readiness
from strapdown.sensors.triad_errors import ImuErrors, TriadErrors
from strapdown.sensors.uncertainty import ImuUncertainty, TriadUncertainty
from strapdown.simulation import Origin, car, simulate_imu
from strapdown.simulation.gnss import GnssReceiver, simulate_gnss
from strapdown.simulation.motion import Track
from strapdown.simulation.path_motion import PathMotion, Wave
from strapdown.simulation.vehicles import Accelerate, Brake, Straight, Turn
from strapdown.tables import GEODETIC, POSITION_SD, VELOCITY, VELOCITY_SD, gnss_table

SENSORS = ImuUncertainty(
    TriadUncertainty(noise_density=town.GYRO_NOISE, bias=town.GYRO_BIAS),
    TriadUncertainty(noise_density=town.ACCEL_NOISE, bias=town.ACCEL_BIAS),
)


@cache
def motion():
    """Ten minutes around blocks."""
    legs = [("begin", Straight(4.0))]
    for k in range(20):
        legs += [
            (f"{k} bend", Turn(90.0 if k % 2 else -90.0, 25.0, ramp=2.0)),
            (f"{k} faster", Accelerate(11.0 + k % 4, 5.0)),
            (f"{k} on", Straight(5.0 + k % 3)),
            (f"{k} slower", Brake(8.0 + k % 3, 4.0)),
            (f"{k} bend back", Turn(-100.0 if k % 2 else 80.0, 30.0, ramp=2.0)),
            (f"{k} and on", Straight(4.0)),
        ]
    return car(Origin(45.0, 20.0, 80.0), legs, speed=10.0)


@cache
def imu(seed):
    rng = np.random.default_rng(seed)
    errors = ImuErrors(
        TriadErrors(noise_density=town.GYRO_NOISE, bias=tuple(rng.normal(0, town.GYRO_BIAS, 3))),
        TriadErrors(noise_density=town.ACCEL_NOISE, bias=tuple(rng.normal(0, town.ACCEL_BIAS, 3))),
    )
    return simulate_imu(motion(), errors, rate=20.0, sampling="mean", seed=seed)[0]


def fixes(seed, *, offset=0.0, velocities=False, noise=0.5, late=0.0):
    """Fixes by a clock that is so much ahead; velocities late by so much."""
    receiver = GnssReceiver(rate=1.0, position_noise=noise, velocity_noise=0.05)
    table = simulate_gnss(motion(), receiver, seed=seed)
    time = table.index.to_numpy()
    speed = table[VELOCITY].to_numpy()
    if late:
        speed = np.column_stack([np.interp(time - late, time, one) for one in speed.T])
    sd = table[VELOCITY_SD].to_numpy() if velocities else np.full((len(time), 3), np.inf)
    place = table[GEODETIC].to_numpy()
    return gnss_table(time + offset, place, speed, table[POSITION_SD].to_numpy(), sd, source="g")


def moved(table, stamps=None, place=None):
    """The same fixes at other stamps or places."""
    return gnss_table(
        table.index.to_numpy() if stamps is None else stamps,
        table[GEODETIC].to_numpy() if place is None else place,
        *(table[names].to_numpy() for names in (VELOCITY, POSITION_SD, VELOCITY_SD)),
        source="g",
    )


def faulty(table):
    """Five seconds 50 m to the north."""
    place = table[GEODETIC].to_numpy().copy()
    for k in range(200, 205):
        place[k] = geodetic_from_ned([50.0, 0.0, 0.0], place[k])
    return moved(table, place=place)


@pytest.mark.slow
@pytest.mark.parametrize("true", [0.0, 0.3])
def test_an_offset_does_not_depend_on_where_it_starts(true):
    table = fixes(7101, offset=true)
    found = [window_offsets(table, imu(7101), SENSORS, s).joint() for s in (-0.2, 0.0, 0.1)]
    values, sds = np.array(found).T
    assert np.ptp(values) < 0.3 * sds.max()
    assert (np.abs(values - true) < 3.0 * sds).all()


@pytest.mark.slow
def test_offsets_of_drives_are_within_their_bounds():
    errors = []
    for seed in range(7201, 7207):
        velocities = seed % 2 == 0
        offset, sd = window_offsets(fixes(seed, velocities=velocities), imu(seed), SENSORS).joint()
        errors.append(offset / sd)
    # Of six, none beyond three standard deviations, and their mean square not that of a bound
    # that is a third of the error.
    assert np.abs(errors).max() < 3.0
    assert np.mean(np.square(errors)) < 2.8


@pytest.mark.slow
@pytest.mark.parametrize("true", [0.0, -0.3])
def test_the_swaying_of_a_roof_is_no_offset(true):
    """Rolling of a rough road turns the course of an antenna on the roof, a quarter wave ahead.

    With a velocity of centimetres a highway drive had an offset of -0.13 ± 0.02 s, and ran 8 m
    beside its road within a bound of 0.7 m.
    """
    road = PathMotion(
        180.0,
        Origin(45.0, 20.0, 80.0),
        heading_deg=40.0,
        speed=Track(tuple(np.arange(0.0, 181.0, 9.0)), tuple(27.0 + 4.0 * np.sin(np.arange(21)))),
        turn_rate=Track(
            tuple(np.arange(0.0, 181.0, 6.0)), tuple(3.0 * np.cos(1.7 * np.arange(31)))
        ),
        roll_waves=(Wave(0.6, 0.83), Wave(0.5, 0.61, 70.0)),
    )
    imu, _ = simulate_imu(road, ImuErrors(), rate=50.0, sampling="mean", seed=1)
    receiver = GnssReceiver(
        rate=10.0,
        position_noise=0.5,
        velocity_noise=0.02,
        antenna=(0.4, 0.0, -1.2),
        time_offset=true,
    )
    table = simulate_gnss(road, receiver, seed=2)
    scanned = time_offset(table, imu)
    assert abs(scanned.offset - true) < 3.0 * scanned.sd
    assert scanned.sd < 0.05
    offset, sd = window_offsets(table, imu, SENSORS, scanned.offset).joint()
    assert abs(offset - true) < 3.0 * sd
    assert sd < 0.05


@pytest.mark.slow
def test_five_seconds_of_a_fault_move_neither_offset_nor_delay():
    table = fixes(7301)
    plain = window_offsets(table, imu(7301), SENSORS)
    other = window_offsets(faulty(table), imu(7301), SENSORS)
    assert abs(other.joint()[0] - plain.joint()[0]) < 0.5 * plain.joint()[1]
    assert other.step() is None
    delayed = fixes(7302, velocities=True, late=0.25)
    for one in (delayed, faulty(delayed)):
        found = velocity_delay(one)
        assert abs(found.delay - 0.25) < 4.0 * found.sd
        assert found.delay > 4.0 * found.sd


@pytest.mark.slow
@pytest.mark.parametrize(("at", "size"), [(211.5, 1.0), (390.5, -1.0)])
def test_a_step_of_the_receivers_clock_is_found_and_dated(at, size):
    table = fixes(7401)
    stamps = table.index.to_numpy()
    kept = (stamps < at) | (stamps > at + 2.0)
    table, stamps = table[kept], stamps[kept]
    stepped = moved(table, stamps=stamps + np.where(stamps > at, size, 0.0))
    step = window_offsets(stepped, imu(7401), SENSORS).step()
    assert step is not None
    assert abs(step.size - size) < 3.0 * step.sd
    finding = step_finding(stepped, imu(7401), step)
    assert finding.code == "navigation.clock-step-of-receiver"
    assert finding.data["begin"] <= at + 1.0
    assert finding.data["end"] >= at - 1.0
    assert finding.data["end"] - finding.data["begin"] < 5.0


@pytest.mark.slow
def test_a_step_of_the_sensors_clock_is_found_and_dated():
    record = imu(7501)
    time = record.index.to_numpy()
    late = record.set_axis(time + np.where(time > 300.02, 1.0, 0.0))
    late.index.name, late.attrs = "time", dict(record.attrs)
    table = fixes(7501)
    step = window_offsets(table, late, SENSORS).step()
    assert step is not None
    assert abs(step.size + 1.0) < 3.0 * step.sd
    finding = step_finding(table, late, step)
    assert finding.code == "navigation.clock-step-of-sensors"
    assert 300.0 <= finding.data["end"] <= 301.1


def on_the_way(speed, rate=1.0, noise=1.0, *, size=0.0, at=100.0, lost=(), later=0.0, seed=1):
    """Fixes on a winding road, by a clock that steps, or by a receiver that then measures later."""
    time = np.arange(0.0, 200.0, 1.0 / rate)
    time = time + np.where(time >= at, later, 0.0)
    course = 0.8 * np.sin(time / 15.0)
    way = speed * (time + 3.0 * np.sin(time / 7.0))
    rng = np.random.default_rng(seed)
    north = way * np.cos(0.2 * course) + noise * rng.normal(size=len(time))
    east = way * np.sin(0.2 * course) + noise * rng.normal(size=len(time))
    place = geodetic_from_ned(np.column_stack([north, east, 0.0 * north]), [45.0, 20.0, 80.0])
    stamps = time + np.where(time >= at, size, 0.0)
    latest = np.concatenate([[-1.0], np.maximum.accumulate(stamps)[:-1]])
    keep = stamps > latest
    for begin, end in lost:
        keep &= (time < begin) | (time >= end)
    flat = np.full((keep.sum(), 3), noise)
    none = np.full_like(flat, np.inf)
    return gnss_table(stamps[keep], place[keep], 0.0 * flat, flat, none, source="g")


@pytest.mark.parametrize(
    ("rate", "noise", "size"),
    [
        (1.0, 1.0, 0.6),
        (1.0, 1.0, -0.5),
        (5.0, 0.02, 0.471),
        (5.0, 0.02, -0.9),
        (10.0, 0.01, 0.788),
        (1.0, 0.1, 1.0),
        (10.0, 0.01, 0.7),
        (4.0, 0.01, -0.059),
        (4.0, 0.3, -0.222),
    ],
)
def test_the_stamps_and_the_way_show_a_step_to_the_microsecond(rate, noise, size):
    step = stamp_step(on_the_way(15.0, rate, noise, size=size))
    assert step is not None
    assert step.certain
    assert step.size == pytest.approx(size, abs=1e-9)
    assert step.after < 100.0
    assert step.before > 99.999 + size
    table = on_the_way(15.0, rate, noise, size=size)
    inertial = imu(7501)
    assert [f.data["size"] for f in gnss_readiness(table, inertial) if "step" in f.code] == [
        step.size
    ]


@pytest.mark.parametrize("seed", range(20))
def test_what_is_no_step_of_a_clock_is_none(seed):
    for table in (
        on_the_way(15.0, seed=seed),
        # Lost fixes, one of them alone; a receiver that begins anew at other instants.
        on_the_way(15.0, lost=[(40.0, 41.0), (60.0, 63.0), (90.0, 97.0)], seed=seed),
        on_the_way(15.0, 10.0, 0.02, lost=[(40.0, 40.7), (60.0, 62.3), (90.0, 92.8)], seed=seed),
        on_the_way(15.0, 10.0, 0.5, lost=[(40.0, 40.7), (60.0, 62.3), (90.0, 92.8)], seed=seed),
        on_the_way(15.0, noise=0.5, later=0.6, seed=seed),
        on_the_way(15.0, 5.0, 0.02, later=0.07, seed=seed),
    ):
        assert stamp_step(table) is None
    # Stamps by a busy computer show no step.
    table = on_the_way(15.0, size=0.4, seed=seed)
    late = np.random.default_rng(seed).uniform(0.0, 0.3, len(table))
    assert stamp_step(moved(table, stamps=table.index.to_numpy() + late)) is None
    # One late stamp is no step.
    late = np.where(np.arange(len(table)) == 50, 0.3, 0.0)
    table = on_the_way(15.0, seed=seed)
    assert stamp_step(moved(table, stamps=table.index.to_numpy() + late)) is None


def test_where_the_way_does_not_decide_the_windows_do_or_nothing_does():
    table = on_the_way(0.1, noise=2.0, size=0.4)
    step = stamp_step(table)
    assert step is not None
    assert not step.certain
    assert step.sd >= 0.4
    assert step_finding(table, imu(7501), step).code == "navigation.clock-step-of-receiver"
    spans = np.array([[0.0, 45.0], [45.0, 90.0], [105.0, 150.0], [150.0, 199.0]])

    def windows(size):
        offset = np.where(spans[:, 0] > 100.0, size, 0.0)
        return lambda: Offsets(spans, offset, np.full(4, 0.03))

    found = stamp_step(table, windows(0.4))
    assert found is not None
    assert found.certain
    assert found.size == pytest.approx(0.4)
    assert stamp_step(table, windows(0.0)) is None


def test_windows_of_which_most_stray_show_neither_an_offset_nor_a_step():
    """As of a boat in a stream: offsets that differ by ten of their standard deviations."""
    begin = np.arange(5.0) * 65.0
    spans = np.column_stack([begin, begin + 60.0])
    sd = np.array([0.041, 0.038, 0.018, 0.032, 0.075])
    scattered = Offsets(spans, np.array([-0.231, -0.561, -0.470, -0.125, -0.024]), sd)
    assert scattered.joint() is None
    assert scattered.step() is None
    # One that strays has a fault of its own; a step is one to which all others agree.
    stray = Offsets(spans, np.array([0.9, 0.49, 0.51, 0.5, 0.5]), sd)
    assert stray.joint()[0] == pytest.approx(0.5, abs=0.02)
    step = Offsets(spans, np.array([0.01, 0.0, -0.01, 0.61, 0.6]), sd).step()
    assert step.size == pytest.approx(0.61, abs=0.02)
    assert (step.after, step.before) == (130.0, 255.0)
