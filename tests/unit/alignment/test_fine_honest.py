"""Fine alignment where what is claimed is easily too much: rocking, and a heading hardly known."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))

from resting import Rest, roughly
from stands import with_errors

from strapdown import rotation
from strapdown.alignment.alignment import Site
from strapdown.alignment.fine import FineAlignment
from strapdown.alignment.levelling import KnownHeading
from strapdown.errors import DataError
from strapdown.sensors.catalogue import load_sensor
from strapdown.sensors.uncertainty import ImuUncertainty
from strapdown.simulation import ImuErrors, Origin, StationaryMotion, simulate_imu
from strapdown.simulation.path_motion import PathMotion, Wave
from strapdown.tables import QUATERNION

SENSOR = load_sensor("fog-1000")
UNCERTAINTY = ImuUncertainty.of_sensor(SENSOR)


def rocked(seed, amplitude, roll, pitch, heading=60.0, seconds=200.0):
    """A body that rocks about two axes: periods in s and phases in deg."""
    origin = Origin(55.0, 37.0, 200.0)
    motion = PathMotion(
        seconds,
        origin,
        heading_deg=heading,
        roll_waves=(Wave(amplitude, *roll),),
        pitch_waves=(Wave(amplitude, *pitch),),
    )
    ideal, truth = simulate_imu(motion, ImuErrors(), rate=50.0, sampling="mean")
    still = StationaryMotion(seconds, origin, 0.0, 0.0, heading)
    quiet, _ = simulate_imu(still, ImuErrors(), rate=50.0, sampling="mean")
    drawn = SENSOR.draw(seed)
    assert drawn.accel is not None
    noiseless = replace(
        drawn,
        gyro=replace(drawn.gyro, noise_density=0.0),
        accel=replace(drawn.accel, noise_density=0.0),
    )
    # What the sensors read too much on average: where the body stands, without what rocks.
    off = (with_errors(quiet, noiseless, seed) - quiet).iloc[-500:].mean().to_numpy()
    q = truth[QUATERNION].to_numpy()
    return Rest(with_errors(ideal, drawn, seed), q[0], off[:3], off[3:]), q


@pytest.mark.slow
@pytest.mark.parametrize("amplitude", [0.1, 1.0])
@pytest.mark.parametrize(
    ("roll", "pitch"),
    [
        # One turns the body by nothing from epoch to epoch of 1 s, the other by the most: by the
        # measured turn the one seemed to tell the other's axis, and so the heading.
        ((0.5, 10.0), (0.4, 77.0)),
        # A cone: the integral of the rate in axes that stand still grows by its area.
        ((3.0, 0.0), (3.0, 90.0)),
    ],
)
def test_rocking_tells_nothing_that_is_not_so(amplitude, roll, pitch):
    site = Site(55.0, 37.0, 200.0)
    for seed in range(3):
        rest, q = rocked(seed, amplitude, roll, pitch)
        last = FineAlignment().align(rest.imu, site, UNCERTAINTY, roughly(rest)).alignment
        phi = rotation.rotation_vector_from_quaternion(
            rotation.compose(last.q_nb, rotation.conjugate(q[-1]))
        )
        # Of 108 numbers that are normal one in 30 times one is beyond 3.6.
        assert np.all(np.abs(phi) < 3.6 * np.sqrt(np.diagonal(last.covariance)))
        assert np.all(np.abs(rest.gyro_bias - last.gyro_bias) < 3.6 * last.gyro_bias_sd)
        assert np.all(np.abs(rest.accel_bias - last.accel_bias) < 3.6 * last.accel_bias_sd)


@pytest.mark.parametrize(("lat", "sensor"), [(89.0, "fog-1000"), (55.0, "hg1700")])
def test_a_heading_that_rests_cannot_tell_is_not_learnt_by_correcting_it(lat, sensor):
    """Feeding back a heading of degrees must not turn what no rest can tell into knowledge."""
    made = load_sensor(sensor)
    unsure = ImuUncertainty.of_sensor(made)
    motion = StationaryMotion(300.0, Origin(lat, 37.0, 200.0), 2.0, -1.0, 60.0)
    imu, _ = simulate_imu(motion, made.draw(4), rate=50.0, sampling="mean", seed=4)
    rest = Rest(imu, rotation.quaternion_from_euler([2.0, -1.0, 60.0]), np.zeros(3), np.zeros(3))
    site = Site(lat, 37.0, 200.0)
    found = FineAlignment().align(imu, site, unsure, roughly(rest, heading_off_deg=5.0))
    # Heading from an east drift; the prior of the filter, as the only other thing that is known.
    east = np.hypot(unsure.gyro.axis("bias")[0], unsure.gyro_drift.triad[0])
    limit = np.degrees(east / np.linalg.norm(site.earth_rate[:2]))
    limit = 1.0 / np.hypot(1.0 / limit, 1.0 / found.prior_heading_sd_deg)
    assert found.alignment.sd_deg[2] > 0.95 * limit
    # And the tilt from a horizontal bias.
    tilt = np.degrees(unsure.accel.axis("bias")[0] / 9.81)
    assert np.all(found.alignment.sd_deg[:2] > 0.9 * min(tilt, 10.0))


def test_noise_of_poor_gyros_is_not_taken_for_a_body_that_moves():
    made = load_sensor("hg1700")
    motion = StationaryMotion(500.0, Origin(55.0, 37.0, 200.0), 0.0, 0.0, 60.0)
    imu, _ = simulate_imu(motion, made.draw(1), rate=20.0, sampling="mean", seed=1)
    rest = Rest(imu, rotation.quaternion_from_euler([0.0, 0.0, 60.0]), np.zeros(3), np.zeros(3))
    unsure = ImuUncertainty.of_sensor(made)
    found = FineAlignment().align(imu, Site(55.0, 37.0, 200.0), unsure, roughly(rest))
    # Tilt by the noise of the gyros, and velocity by it: in half a minute 0.05 m/s and more.
    assert found.standing.velocity.max() > 0.05
    assert not any("is not stationary" in one.what for one in found.findings)


def test_a_burst_that_a_free_run_does_not_survive_is_named():
    motion = StationaryMotion(400.0, Origin(55.0, 37.0, 200.0), 0.0, 0.0, 60.0)
    imu, _ = simulate_imu(motion, SENSOR.draw(1), rate=20.0, sampling="mean", seed=1)
    rest = Rest(imu, rotation.quaternion_from_euler([0.0, 0.0, 60.0]), np.zeros(3), np.zeros(3))
    imu.iloc[1000:1010, 1] += 4.0
    with pytest.raises(DataError, match=r"largest rate is 22[89].* deg/s at 50") as raised:
        FineAlignment().align(imu, Site(55.0, 37.0, 200.0), UNCERTAINTY, roughly(rest))
    assert "gyro_y" in str(raised.value)
    assert "outliers" in str(raised.value)


@pytest.mark.slow
def test_a_heading_that_is_given_stays_as_good_as_it_was():
    """Gyros of hundreds of degrees an hour, over a time in which they turn over."""
    made = load_sensor("adis16495-1")
    unsure = ImuUncertainty.of_sensor(made)
    site = Site(55.0, 37.0, 200.0)
    motion = StationaryMotion(400.0, Origin(55.0, 37.0, 200.0), 1.0, -2.0, 60.0)
    for seed in range(3):
        imu, _ = simulate_imu(motion, made.draw(seed), rate=20.0, sampling="mean", seed=seed)
        first, others = imu.iloc[:401], imu.iloc[400:]
        coarse = KnownHeading(heading_deg=61.0, sd_deg=1.0).align(first, site, unsure)
        assert coarse.heading_given
        last = FineAlignment().align(others, site, unsure, coarse).alignment
        # The record tells nothing of it, and takes nothing away.
        assert last.sd_deg[2] == pytest.approx(1.0, rel=0.05)
        assert abs(last.roll_pitch_heading[2] - 60.0) < 3.6
