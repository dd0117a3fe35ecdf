"""Bounds of cars that fold, by kind of crash: points, their mean, direction, position, closure.

`STRAPDOWN_CRASH_DRAWS` draws of each kind: one takes 1 s of processor time, a closure 2 s.
"""

from __future__ import annotations

import math
import os
from collections import Counter
from functools import cache

import numpy as np
import pytest
from scipy.stats import binomtest, chi2
from tests.unit.crash import planar_impact
from tests.unit.crash.folding_crash import END, FIGURES, KINDS, Crash, errors

from strapdown import Entry
from strapdown.config.crash_case import EntrySpec, PointSpec, VehicleSpec
from strapdown.crash.case_contact import impact_vehicle
from strapdown.crash.closure import close_vehicles
from strapdown.crash.deformation import dynamic_crush
from strapdown.dsp.chi_square import normal_quantile

DRAWS = int(os.environ.get("STRAPDOWN_CRASH_DRAWS", "30"))
LEVEL = 0.99
#: Points of a vehicle, draw by draw.
COUNTS = (2, 2, 3, 2, 4, 2, 3, 5, 2, 6)


@cache
def drawn(kind, gyro, draws, seed=2000):
    """Errors over the half widths of single points and of means, and how many had no mean."""
    single, mean, alone = [], [], 0
    for k in range(draws):
        crash = Crash(seed + k, kind)
        units = [crash.unit(j, gyro=gyro) for j in range(COUNTS[k % len(COUNTS)])]
        first, together, _ = crash.answered(units)
        single.append(errors(first, crash))
        if together is None:
            alone += 1
        else:
            mean.append(errors(together, crash))
    return np.array(single), np.array(mean), alone


def test_errors_of_a_point_and_of_a_mean_are_as_large_as_stated():
    z = np.concatenate(drawn("oblique", True, 1)[:2])[:, [0, 1, 4, 5]]
    z = z * normal_quantile(0.975)
    # Not more than a mean of squares can be; the errors of one answer belong together.
    assert np.square(z).sum() < chi2.ppf(1.0 - 1e-4, z.size)


@pytest.mark.slow
@pytest.mark.parametrize("gyro", [True, False])
@pytest.mark.parametrize("kind", KINDS)
def test_bounds_hold_by_kind(kind, gyro):
    single, mean, alone = drawn(kind, gyro, DRAWS)
    assert binomtest(alone, DRAWS).proportion_ci(LEVEL).low <= 0.01
    for who, rows in (("single", single), ("mean", mean)):
        for figure, column in zip(FIGURES, rows.T, strict=True):
            inside = int((np.abs(column) <= 1.0).sum())
            # The level is that of all figures of a kind together.
            level = 1.0 - (1.0 - LEVEL) / (2 * len(FIGURES))
            interval = binomtest(inside, len(column)).proportion_ci(level)
            assert interval.low <= 0.95 <= interval.high, (kind, who, figure, inside, len(column))


#: Standard deviation of the change of yaw rate by kind, deg/s, of which a case states a turning.
TURNS = {"head-on": 51.0, "offset": 99.0, "rear-end": 44.0, "side": 104.0, "sideswipe": 83.0}


def closed(kind, number, gyro):
    """Closure of a drawn impact by the points of both cars, and the impact."""
    impact = planar_impact.draw(np.random.default_rng([11, number]), kind)
    vehicles = []
    for i, (true, said) in enumerate(zip(impact.exact, impact.measured, strict=True)):
        sds = np.radians([20.0, 20.0, TURNS[kind]])
        rates = [[0.0, 0.0, math.radians(x[0])] for x in (true.rate, true.rate_change)]
        crash = Crash.of(2 * number + i, true.delta_v, rates, true.duration, sds)
        units = [crash.unit(j, gyro=gyro) for j in range(COUNTS[number % 5])]
        speed = float(np.hypot(*said.entry))
        slip_sd = min(math.degrees(0.2 / max(speed, 1.0)), 40.0)
        heading, sd = said.heading_deg
        entry = Entry.from_speed(
            speed,
            0.4,
            heading_deg=heading,
            heading_sd_deg=sd,
            slip_deg=math.degrees(math.atan2(said.entry[1], said.entry[0])),
            slip_sd_deg=slip_sd,
        )
        vehicle = VehicleSpec(
            mass_kg=said.mass[0],
            mass_sd_kg=said.mass[1],
            contact_m=said.contact[:2],
            contact_sd_m=said.contact[2],
        )
        stated = EntrySpec(
            speed_m_per_s=speed, speed_sd_m_per_s=0.4, heading_sd_deg=sd, slip_sd_deg=slip_sd
        )
        single, mean, _ = crash.answered(units, entry, until=END - 0.002)
        answer = mean or single
        vehicles.append(impact_vehicle(answer, f"car {i}", vehicle, stated, PointSpec()))
    if None in vehicles:
        return impact, None
    return impact, close_vehicles(
        *vehicles, friction=planar_impact.FRICTION, energy_share=impact.share
    )


def crushed(number, gyro):
    """Errors over the half widths of the crush of a car at a wall, of a point and of the mean."""
    crash = Crash(4000 + number, "front")
    # It comes back with a tenth to a third of its speed.
    crash.speed = crash.size / (1.1 + 0.2 * np.random.default_rng(number).uniform())
    units = [crash.unit(j, gyro=gyro) for j in range(COUNTS[number % len(COUNTS)])]
    out = []
    for answer in crash.answered(units)[:2]:
        if answer is not None:
            found = dynamic_crush("car", answer.path, answer.events.events[0])
            near = found.time + np.linspace(-0.006, 0.006, 13)
            true = max(crash.position(round(t, 4))[0] for t in near)
            assert not found.at_least and found.touch == 0.0
            out.append((found.depth.value - true) / found.depth.half_width)
    return out


@pytest.mark.slow
@pytest.mark.parametrize("gyro", [True, False])
def test_the_bound_of_the_crush_holds(gyro):
    rows = [crushed(number, gyro) for number in range(DRAWS)]
    for answers in ([r[0] for r in rows], [r[1] for r in rows if len(r) > 1]):
        inside = int((np.abs(answers) <= 1.0).sum())
        interval = binomtest(inside, len(answers)).proportion_ci(LEVEL)
        assert interval.low <= 0.95 <= interval.high, (inside, len(answers))


@pytest.mark.slow
@pytest.mark.parametrize("gyro", [True, False])
@pytest.mark.parametrize("kind", TURNS)
def test_closure_by_the_points_of_both_cars_holds(kind, gyro):
    from tests.unit.crash.test_closure import CONSERVATIVE, _held

    held, counted, reported = Counter(), Counter(), 0
    for number in range(DRAWS):
        impact, closure = closed(kind, number, gyro)
        if closure is None:
            # An event needs 8 km/h forward or right: a resultant of no more than √2 times that.
            smaller = min(float(np.linalg.norm(true.delta_v[:2])) for true in impact.exact)
            assert smaller < math.sqrt(2.0) * 8.0 / 3.6, (kind, number)
            continue
        reported += closure.contradicted
        for name, holds in _held(impact, closure).items():
            # Without gyros velocities are those of the centers, and the truth is of the contact.
            if closure.basis == "contact" or name in (*CONSERVATIVE, "direction_deg"):
                held[name] += holds
                counted[name] += 1
    assert binomtest(reported, DRAWS).proportion_ci(LEVEL).low <= 0.01
    for name, number in counted.items():
        interval = binomtest(held[name], number).proportion_ci(LEVEL)
        assert interval.high >= 0.95, (kind, name, held[name], number)
        assert name in CONSERVATIVE or interval.low <= 0.97, (kind, name, held[name], number)
