"""The loop closed: a sensor is simulated at rest, fitted, and given to the filter of its drives.

The Allan deviation of the record is that of the specification, and the normalized error squared
(NEES) of drives with the fitted file is that of a consistent filter.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.stats import chi2
from tests.reference.test_allan_coverage import flicker

import strapdown as sd
from strapdown.navigation.truth_comparison import compare_with_truth
from strapdown.sensors.error_chain import apply
from strapdown.sensors.noise_terms import allan_model
from strapdown.sensors.triad_errors import ImuErrors, TriadErrors
from strapdown.simulation import Origin, PathMotion, Track, simulate_imu
from strapdown.simulation.gnss import GnssReceiver, simulate_gnss

pytestmark = pytest.mark.slow
RATE, REST, DRIVE = 50.0, 3600.0, 300.0
SEEDS = range(8)
# Gyro and accelerometer, flicker of the gyros, and standard deviation of the biases; SI.
GRADES = {
    "phone": (
        TriadErrors(noise_density=1.2e-4, random_walk=1.5e-5),
        TriadErrors(noise_density=2e-3, random_walk=2e-4),
        *(0.0, 3e-3, 0.1),
    ),
    "industrial": (
        TriadErrors(noise_density=1.4e-4),
        TriadErrors(noise_density=1e-3, random_walk=2e-5),
        *(4e-5, 1e-3, 0.03),
    ),
    "tactical": (
        TriadErrors(noise_density=2.5e-5, bias_instability=1e-5, correlation_time=300.0),
        TriadErrors(noise_density=5e-4, bias_instability=3e-4, correlation_time=300.0),
        *(0.0, 1e-5, 0.01),
    ),
    "navigation": (
        TriadErrors(noise_density=3e-7, random_walk=6e-9),
        TriadErrors(noise_density=1e-4, random_walk=1e-6),
        *(0.0, 1e-8, 5e-4),
    ),
    "crash": (
        TriadErrors(noise_density=2e-4),
        TriadErrors(noise_density=2e-3),
        *(0.0, 3e-3, 0.1),
    ),
}


@cache
def motion():
    """A stop of half a minute, then minutes with changes of speed and turns to both sides."""
    speed, turn = [(0.0, 0.0), (30.0, 0.0)], [(0.0, 0.0), (30.0, 0.0)]
    for k, begin in enumerate(np.arange(30.0, DRIVE - 55.0, 60.0)):
        side = (-1.0) ** k
        speed += [(begin + t, v) for t, v in ((8, 14.0), (25, 14.0), (33, 7.0), (55, 7.0))]
        turn += [(begin + t, side * v) for t, v in ((26, 0), (28, 15), (33, 15), (35, 0))]
        turn += [(begin + t, -side * v) for t, v in ((45, 0), (47, 12), (49, 12), (51, 0))]
    tracks = [Track(*map(tuple, zip(*track, strict=True))) for track in (speed, turn)]
    origin = Origin(48.0, 11.0, 500.0)
    return PathMotion(DRIVE, origin, heading_deg=60.0, speed=tracks[0], turn_rate=tracks[1])


def unit(grade, seed):
    gyro, accel, slow, gyro_sd, accel_sd = GRADES[grade]
    draw = np.random.default_rng([seed, 5])
    gyro = replace(gyro, bias=tuple(gyro_sd * draw.standard_normal(3)))
    return gyro, replace(accel, bias=tuple(accel_sd * draw.standard_normal(3))), slow


def with_flicker(rate, slow, *seed):
    draw = np.random.default_rng(seed)
    if not slow:
        return rate
    return rate + slow * np.column_stack([flicker(len(rate), 1.0 / RATE, draw) for _ in range(3)])


@cache
def fitted(grade, seed):
    """The unit at rest, level, in the Earth's rotation."""
    gyro, accel, slow = unit(grade, seed)
    count = int(RATE * REST)
    time = np.arange(1, count + 1) / RATE
    rate, force = np.tile([4.88e-5, 0.0, -5.42e-5], (count, 1)), np.zeros((count, 3))
    force[:, 2] = -9.80665
    rate = with_flicker(apply(gyro, time, rate, seed=seed, sampling="mean"), slow, seed, 9)
    return sd.allan((time, rate, apply(accel, time, force, seed=seed + 1, sampling="mean")))


def nees_at_the_end(grade, seed, sensor):
    """Normalized error squared of the nine states after a drive with the unit."""
    gyro, accel, slow = unit(grade, seed)
    errors = ImuErrors(gyro, accel)
    imu, _ = simulate_imu(motion(), errors, rate=RATE, sampling="mean", seed=seed + 1000)
    columns = [f"gyro_{axis}" for axis in "xyz"]
    attrs = dict(imu.attrs)
    imu[columns] = with_flicker(imu[columns].to_numpy(), slow, seed, 10)
    imu.attrs = attrs
    receiver = GnssReceiver(rate=1.0, position_noise=1.0, velocity_noise=0.05)
    fixes = simulate_gnss(motion(), replace(receiver, on_excess="unaffected"), seed=seed)
    run = sd.navigate(imu, [sd.Gnss(fixes)], sensor=sensor)
    marks, covariance = run.sd.index, run.record.covariance
    found = compare_with_truth(run.trajectory, marks, covariance, motion())
    assert found.freedom["all"] == 9
    return float(found.nees["all"].iloc[-1])


@pytest.mark.parametrize("grade", GRADES)
def test_the_deviation_is_that_of_the_specification(grade):
    gyro, _, slow, *_ = GRADES[grade]
    terms = {"N": "noise_density", "GM": "bias_instability", "K": "random_walk"}
    truth = {term: gyro.axis(name)[0] for term, name in terms.items()} | {"B": slow}
    truth = {term: value for term, value in truth.items() if value}
    for channel, table in fitted(grade, 0).deviations.groupby("channel"):
        if channel.startswith("gyro"):
            model = allan_model(truth, table["tau"], gyro.correlation_time)
            # A chi-square of eight degrees at the longest time, whose root has this skewness.
            off = (table["allan"] / model - 1.0) / table["relative_sd"]
            assert np.abs(off).max() < 4.0


@pytest.mark.parametrize("grade", GRADES)
def test_the_filter_with_the_fitted_sensor_is_consistent(grade):
    total = sum(nees_at_the_end(grade, seed, fitted(grade, seed).sensor) for seed in SEEDS)
    # 99.9 % of the sums of squares of a consistent filter.
    low, high = chi2.ppf([5e-4, 1.0 - 5e-4], 9 * len(SEEDS))
    assert low < total < high, total / len(SEEDS)


def test_a_filter_that_takes_the_bias_for_constant_is_surer_than_it_may_be(tmp_path):
    """The test above sees the file: without the random walk of the phone each error is larger in P.

    By chance all of them are in 1 of 256. Navigation adapts to innovations, so that even a tenth of
    the noise gives 11 for the 9 of a consistent filter.
    """
    for seed in SEEDS:
        text = fitted("phone", seed).sensor_text()
        path = tmp_path / f"constant-{seed}.toml"
        lines = text.splitlines(keepends=True)
        path.write_text("".join(line for line in lines if not line.startswith("random_walk")))
        whole = nees_at_the_end("phone", seed, fitted("phone", seed).sensor)
        assert nees_at_the_end("phone", seed, path) > whole
