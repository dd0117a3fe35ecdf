"""What every coarse alignment promises, held for every entry of the table."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from strapdown.alignment.alignment import Alignment, CoarseAlignment, Site
from strapdown.alignment.coarse_alignments import COARSE_ALIGNMENTS
from strapdown.errors import ConfigError, DataError
from strapdown.sensors.catalogue import load_sensor
from strapdown.sensors.uncertainty import ImuUncertainty
from strapdown.simulation import Origin, simulate_imu
from strapdown.simulation.gnss import GnssReceiver, simulate_gnss
from strapdown.simulation.motion import Track
from strapdown.simulation.path_motion import PathMotion
from strapdown.tables import GYRO, QUATERNION

OPTIONS = {"known_heading": {"heading_deg": 60.0, "sd_deg": 0.1}}
SENSOR = load_sensor("fog-1000")
SENSORS = ImuUncertainty.of_sensor(SENSOR)
SITE = Site(55.0, 37.0, 150.0)


@pytest.fixture(params=sorted(COARSE_ALIGNMENTS))
def method(request):
    return COARSE_ALIGNMENTS[request.param](**OPTIONS.get(request.param, {}))


@pytest.fixture(scope="module")
def cases():
    """By whether the body drives: log, truth and fixes."""
    made = {}
    for drives in (False, True):
        motion = PathMotion(
            120.0,
            Origin(55.0, 37.0, 150.0),
            heading_deg=60.0,
            roll_deg=2.0,
            attack_deg=0.0 if drives else 3.0,
            speed=Track((0.0,), (15.0 if drives else 0.0,)),
        )
        imu, truth = simulate_imu(
            motion, SENSOR.draw(1), rate=50.0, sampling="mean", seed=1, source="log.csv"
        )
        fixes = simulate_gnss(motion, GnssReceiver(rate=5.0, velocity_noise=0.05), seed=1)
        made[drives] = (imu, truth[QUATERNION].to_numpy(), fixes)
    return made


def case_of(method, cases):
    return cases[method.name == "gnss_course"]


def test_the_table_names_each_by_its_name():
    for name, cls in COARSE_ALIGNMENTS.items():
        assert issubclass(cls, CoarseAlignment)
        assert cls.name == name
        assert cls.summary
        assert cls.source


def test_what_comes_back(method, cases):
    imu, truth, fixes = case_of(method, cases)
    found = method.align(imu, SITE, SENSORS, fixes)
    assert isinstance(found, Alignment)
    assert found.method == method.name
    assert found.time == imu.index[-1]
    assert np.linalg.norm(found.q_nb) == pytest.approx(1.0, abs=1e-12)
    assert found.covariance.shape == (3, 3)
    assert np.allclose(found.covariance, found.covariance.T, rtol=0, atol=1e-18)
    assert np.linalg.eigvalsh(found.covariance).min() > 0.0
    assert np.isfinite(found.sd_deg).all()
    from strapdown import rotation

    true = rotation.euler_from_quaternion(truth[-1])
    error = (found.roll_pitch_heading - true + 180.0) % 360.0 - 180.0
    assert (np.abs(error) < 5.0 * found.sd_deg).all()


def test_it_has_no_state_and_leaves_its_inputs_alone(method, cases):
    imu, _, fixes = case_of(method, cases)
    before, fixed = imu.copy(), fixes.copy()
    first = method.align(imu, SITE, SENSORS, fixes)
    method.align(imu.iloc[: len(imu) // 2], SITE, SENSORS, fixes)
    again = method.align(imu, SITE, SENSORS, fixes)
    assert np.array_equal(first.q_nb, again.q_nb)
    assert np.array_equal(first.covariance, again.covariance)
    assert imu.equals(before)
    assert imu.attrs == before.attrs
    assert fixes.equals(fixed)
    with pytest.raises(dataclasses.FrozenInstanceError):
        method.name = "other"


def test_a_stamp_of_any_origin_is_as_good(method, cases):
    """Seconds of an epoch: the same answer within what their rounding leaves."""
    imu, _, fixes = case_of(method, cases)
    late, late_fixes = imu.copy(), fixes.copy()
    late.index, late_fixes.index = imu.index + 1.7e9, fixes.index + 1.7e9
    late.index.name = late_fixes.index.name = "time"
    a = method.align(imu, SITE, SENSORS, fixes)
    b = method.align(late, SITE, SENSORS, late_fixes)
    # 1.2e-7 s of 0.02 s of a step, among 6000.
    assert np.allclose(a.q_nb, b.q_nb, rtol=0, atol=1e-6)
    assert np.allclose(a.covariance, b.covariance, rtol=1e-2)


def test_a_table_that_is_none_is_refused(method, cases):
    imu, _, fixes = case_of(method, cases)
    with pytest.raises(DataError):
        method.align(imu[GYRO], SITE, SENSORS, fixes)
    with pytest.raises(DataError):
        method.align(None, SITE, SENSORS, fixes)
    with pytest.raises(DataError):
        method.align(imu.iloc[:1], SITE, SENSORS, fixes)


def test_an_unknown_option_is_no_option():
    with pytest.raises((TypeError, ConfigError)):
        COARSE_ALIGNMENTS["two_vector"](block=3)
