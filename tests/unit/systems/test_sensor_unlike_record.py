"""A rest that is not of the sensor that is named is told; one of the right sensor is not."""

from __future__ import annotations

import itertools
import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import butter, sosfilt

import strapdown as sd
from strapdown.alignment.alignment import Site
from strapdown.config.logs import FixesTable, LogTable
from strapdown.sensors.catalogue import load_sensor
from strapdown.sensors.uncertainty import UNIT_FACTOR, stated_imu
from strapdown.simulation import Origin, car, simulate_imu
from strapdown.simulation.earth_motion import StationaryMotion
from strapdown.simulation.gnss import GnssReceiver, simulate_gnss
from strapdown.simulation.vehicles import Accelerate, Straight, Turn
from strapdown.systems.named_sensor import LEAST, unlike_sensor
from strapdown.systems.navigation_draft import draft_navigation
from strapdown.tables import ACCEL, GYRO

CODE = "navigation.sensor-unlike-record"
#: One of each grade, the best first.
GRADES = {
    "navigation": "hg9900",
    "tactical": "adis16495-1",
    "industrial": "adis16470",
    "phone": "mpu-6050",
}
PLACE, RATE, LENGTH, SEEDS = (48.0, 11.0, 500.0), 100.0, 30.0, 20


def at_rest(real, seed, body="still"):
    """A record of a unit at rest: its errors are beyond its sheet as those of units of a type are.

    `body`: still; shaken by an engine, as the drawn drives of a car are; or rocking on its springs.
    """
    rng = np.random.default_rng([seed, sum(map(ord, real))])
    roll, pitch, heading = rng.uniform([-5, -5, 0], [5, 5, 360])
    motion = StationaryMotion(LENGTH, Origin(*PLACE), roll, pitch, heading)
    errors = load_sensor(real).draw(seed)
    # Student's t of 4 degrees of freedom, of each unit.
    wide = float(np.sqrt(4.0 / rng.chisquare(4)))
    gyro, accel = (
        replace(one, bias=tuple(wide * np.broadcast_to(one.bias, 3)))
        for one in (errors.gyro, errors.accel)
    )
    errors = replace(errors, gyro=gyro, accel=accel)
    imu, _ = simulate_imu(motion, errors, rate=RATE, sampling="mean", seed=seed)
    time = imu.index.to_numpy()[:, None]
    if body == "shaken":
        tones = 2.0 * np.pi * rng.uniform(15, 45, 6)
        sieve = butter(2, 15.0, "highpass", fs=RATE, output="sos")
        hum = rng.normal(size=6) * np.sin(tones * time + rng.uniform(0, 6, 6))
        hum += 0.7 * sosfilt(sieve, rng.normal(size=hum.shape), axis=0)
        imu[[*GYRO, *ACCEL]] += hum * np.repeat([np.radians(0.1), 0.3], 3)
    elif body == "rocking":
        tones = 2.0 * np.pi * rng.uniform(0.7, 2.0, 3)
        sway = np.radians(0.05) * rng.normal(size=3) * tones
        imu[GYRO] += sway * np.cos(tones * time + rng.uniform(0, 6, 3))
        imu[ACCEL[:2]] += 9.8 * np.radians(0.05) * np.sin(tones[:2] * time)
    return imu


def told(imu, named, length=LENGTH):
    stated = stated_imu(load_sensor(named), {}, {}, unit_factor=UNIT_FACTOR)
    return unlike_sensor(imu, [(0.0, length)], named, stated, Site(*PLACE))


@pytest.mark.slow
def test_no_right_sensor_is_doubted():
    """Twenty units of each of four grades, still, shaken and rocking: one in 80 is allowed.

    It is one, the same each time: its gyro bias, of Student's t, is 12 standard deviations of the
    sheet.
    """
    for body in ("still", "shaken", "rocking"):
        false = [
            (name, seed, found[0].data["figures"])
            for name in GRADES.values()
            for seed in range(SEEDS)
            if (found := told(at_rest(name, seed, body), name))
        ]
        assert len(false) <= 1, (body, false)


@pytest.mark.parametrize(("named", "real"), list(itertools.combinations(GRADES.values(), 2)))
def test_a_unit_of_a_lower_grade_is_told(named, real):
    """All six pairs of grades, ten units each: all 60 are told, with a grade that fits."""
    for seed in range(10):
        found = told(at_rest(real, seed), named)
        assert [f.code for f in found] == [CODE], seed
        data = found[0].data
        assert (data["named"], found[0].severity) == (named, "warning")
        assert data["seen"] > 3.0 * data["stated"]
        better = [g for g, name in GRADES.items() if name == named]
        assert not data["grade"].startswith(better[0])


def test_a_shaken_unit_of_a_lower_grade_is_told():
    """Of 40 units named two grades too good all are told; those of a phone by their biases."""
    pairs = [("hg9900", "adis16470"), ("adis16495-1", "mpu-6050")]
    found = [
        told(at_rest(real, seed, "shaken"), named) for named, real in pairs for seed in range(20)
    ]
    assert all(found)
    assert {one[0].data["what"] for one in found[20:]} == {"gyro bias"}


def test_a_short_rest_a_grade_and_a_worse_name_say_nothing():
    imu = at_rest("mpu-6050", 1)
    assert told(imu, "hg9900")
    assert not told(imu, "hg9900", LEAST - 0.1)
    assert not told(imu, "tactical-grade")
    assert not told(at_rest("hg9900", 1), "mpu-6050")
    # Without a site the size of gravity is not known; the other figures are.
    stated = stated_imu(load_sensor("hg9900"), {}, {})
    figures = unlike_sensor(imu, [(0.0, LENGTH)], "hg9900", stated, None)[0].data["figures"]
    assert len(figures) == 3 and not any("along gravity" in one for one in figures)


@pytest.mark.slow
@pytest.mark.parametrize(("named", "told_of"), [("adis16495-1", True), ("mpu-6050", False)])
def test_init_and_the_trust_verdict_say_it(tmp_path, named, told_of):
    """A phone's unit in a car that stands for 20 s first; the innovations agree with either."""
    motion = car(
        Origin(*PLACE),
        [
            ("rest", Straight(20.0)),
            ("off", Accelerate(12.0, 8.0)),
            *[
                leg
                for k in range(4)
                for leg in ((f"{k}", Turn(90.0 * (-1) ** k, 30.0)), (f"{k} on", Straight(5.0)))
            ],
        ],
        speed=0.0,
    )
    imu, _ = simulate_imu(
        motion, load_sensor("mpu-6050").draw(3), rate=50.0, sampling="mean", seed=3
    )
    fixes = simulate_gnss(
        motion, GnssReceiver(rate=1.0, position_noise=2.0, velocity_noise=0.1), seed=3
    )
    names = [*(f"gyro_{a}_rad_s" for a in "xyz"), *(f"accel_{a}_m_s2" for a in "xyz")]
    log = imu[[*GYRO, *ACCEL]].set_axis(names, axis=1).rename_axis("time_s")
    (tmp_path / "log.csv").write_text("# sampling: mean\n" + log.to_csv())
    sd.write({"gnss": fixes}, tmp_path / "fixes.csv")
    draft = draft_navigation(
        LogTable(path=str(tmp_path / "log.csv")),
        folder=tmp_path,
        axes="forward-right-down",
        gnss=FixesTable(path=str(tmp_path / "fixes.csv")),
        sensor=named,
    )
    assert [f.code for f in draft.findings if f.code == CODE] == [CODE] * told_of
    (tmp_path / "navigate.toml").write_text(draft.text)
    run = sd.navigate(tmp_path / "navigate.toml")
    run.save(tmp_path / "run", report=False)
    trust = json.loads((tmp_path / "run" / "navigation.json").read_text())["trust"]
    assert (CODE in [one["code"] for one in trust["against"]]) == told_of
