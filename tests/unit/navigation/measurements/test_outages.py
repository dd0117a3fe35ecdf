"""Each aid keeps a navigator nearer to the truth where GNSS is gone."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[3]))

from tests.aiding_sensors import (
    Compass,
    PressureHeight,
    VelocityLog,
    WheelSpeed,
    simulate_barometer,
    simulate_body_velocity,
    simulate_heading,
    simulate_odometer,
)

from aided_drives import drive, error_now, gnss_of, navigator_of, run
from strapdown.navigation.measurements.barometer import Barometer
from strapdown.navigation.measurements.gnss import Gnss
from strapdown.navigation.measurements.heading import Heading
from strapdown.navigation.measurements.standstill import ZeroRate, ZeroVelocity
from strapdown.navigation.measurements.vehicle import BodyVelocity, NoSlip, Odometer

SEEDS = range(5)
LOST = 40.0


def horizontal(error):
    return float(np.hypot(*error[:2]))


def vertical(error):
    return abs(float(error[2]))


def speed(error):
    return float(np.linalg.norm(error[3:6]))


def attitude(error):
    return float(np.linalg.norm(error[6:9]))


#: The aid, what it is told, the end of the outage, what is compared, and the part that is left of
#: it at most: median of the runs, over that without the aid.
CASES = {
    "no_slip": (
        NoSlip(name="aid", slip_deg_per_g=0.0, dive_deg_per_g=0.0),
        None,
        100.0,
        horizontal,
        0.7,
    ),
    "odometer": (
        Odometer(name="aid"),
        lambda seed: simulate_odometer(drive(), WheelSpeed(2.0, scale=0.01), seed=seed),
        100.0,
        horizontal,
        0.7,
    ),
    "body_velocity": (
        BodyVelocity(name="aid"),
        lambda seed: simulate_body_velocity(drive(), VelocityLog(2.0), seed=seed),
        100.0,
        horizontal,
        0.3,
    ),
    "barometer": (
        Barometer(name="aid"),
        lambda seed: simulate_barometer(drive(), PressureHeight(2.0, bias=40.0), seed=seed),
        100.0,
        vertical,
        # The weather itself walks by 0.65 m in that minute.
        0.6,
    ),
    "zero_velocity": (ZeroVelocity(name="aid"), None, 115.0, speed, 0.1),
}


def medians(aids, told, until, measure, lost=LOST):
    out = []
    navigator = navigator_of(aids)
    for seed in SEEDS:
        tables = {"gnss": gnss_of(drive(), seed, until=lost)}
        if told is not None:
            tables["aid"] = told(seed)
        state, _ = run(navigator, drive(), seed, tables, until=until)
        out.append(measure(error_now(navigator, drive(), state)))
    return float(np.median(out))


@pytest.mark.slow
@pytest.mark.parametrize("kind", list(CASES))
def test_it_helps_while_gnss_is_lost(kind):
    aid, told, until, measure, part = CASES[kind]
    gnss = Gnss(name="gnss")
    alone = medians((gnss,), None, until, measure)
    aided = medians((gnss, aid), told, until, measure)
    assert aided < part * alone, (aided, alone)


def test_a_compass_keeps_a_heading_that_nothing_else_tells():
    """At rest, with the heading known to 1 deg: 12 s of 0.5 deg each 0.2 s are worth 0.06 deg."""
    compass = Heading(name="aid")

    def told(seed):
        return simulate_heading(drive(), Compass(5.0, noise_deg=0.5), seed=seed)

    def off(error):
        return abs(float(error[8]))

    gnss = Gnss(name="gnss")
    alone = medians((gnss,), None, 12.0, off)
    aided = medians((gnss, compass), told, 12.0, off)
    assert aided < 0.3 * alone, (aided, alone)


def test_the_rates_of_a_rest_keep_the_attitude_of_what_follows():
    gnss = Gnss(name="gnss")
    still = ZeroRate(name="aid", sd_deg_per_s=1e-4)
    alone = medians((gnss,), None, 60.0, attitude, lost=11.0)
    aided = medians((gnss, still), None, 60.0, attitude, lost=11.0)
    assert aided < 0.8 * alone, (aided, alone)
