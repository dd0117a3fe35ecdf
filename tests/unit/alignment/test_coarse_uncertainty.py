"""Stated uncertainties: against what theory gives, and against the errors of many units."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import chi2
from tests.coded import coded

sys.path.insert(0, str(Path(__file__).parent))

from stands import IDEAL, SITE, chi_square, ideal, phi, rocking, still, unit, with_errors

from strapdown.alignment.inertial_frame import InertialFrame
from strapdown.alignment.levelling import KnownHeading, Levelling
from strapdown.alignment.two_vector import TwoVector
from strapdown.errors import DataError
from strapdown.sensors.triad_errors import ImuErrors, TriadErrors
from strapdown.sensors.uncertainty import BiasDrift, ImuUncertainty, TriadUncertainty

STATIC = [TwoVector(), InertialFrame("start"), InertialFrame("end")]
DEG_H = np.radians(1.0) / 3600.0
NORTH = SITE.earth_rate[0]
G = float(np.linalg.norm(SITE.gravity))
RUNS = 30


def known(gyro=1e-12, accel=1e-10, **more):
    return ImuUncertainty(
        TriadUncertainty(noise_density=1e-12, bias=gyro),
        TriadUncertainty(noise_density=1e-10, bias=accel),
        **more,
    )


@pytest.mark.parametrize("method", STATIC, ids=str)
def test_a_bias_of_the_gyros_is_told_in_the_heading(method):
    imu, _ = ideal(still(300.0), 10.0)
    found = method.align(imu, SITE, known(gyro=0.01 * DEG_H))
    # b/(w cos(lat)); at the other end of the record, w T = 0.022 rad later, another axis has a
    # part of it, and the gyros carry 0.01 deg/h for 300 s: 4e-6 rad.
    assert np.sqrt(found.covariance[2, 2]) == pytest.approx(0.01 * DEG_H / NORTH, rel=0.03)


@pytest.mark.parametrize("method", [*STATIC, Levelling(), KnownHeading(60.0, 1e-6)], ids=str)
def test_a_bias_of_the_accelerometers_is_told_in_the_tilt(method):
    imu, _ = ideal(still(300.0), 10.0)
    found = method.align(imu, SITE, known(accel=4.9e-4))
    # b/g; the level turns by 0.013 rad about north in between.
    assert np.sqrt(np.diagonal(found.covariance)[:2]) == pytest.approx(4.9e-4 / G, rel=0.01)


@pytest.mark.parametrize("method", STATIC, ids=str)
@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("triad", ["gyro", "accel"])
def test_what_a_bias_does_is_what_is_stated(method, axis, triad):
    """One bias in the data against the covariance of that bias alone: phi phi^T = P."""
    motion = still(300.0)
    imu, truth = ideal(motion, 10.0)
    size = {"gyro": 0.01 * DEG_H, "accel": 1e-4}[triad]
    bias = np.eye(3)[axis] * size
    errors = {t: TriadErrors(bias=tuple(bias) if t == triad else 0.0) for t in ("gyro", "accel")}
    sd = {t: TriadUncertainty(bias=tuple(bias) if t == triad else 0.0) for t in ("gyro", "accel")}
    sd = {
        t: TriadUncertainty(noise_density=1e-16, bias=tuple(np.maximum(sd[t].axis("bias"), 1e-18)))
        for t in sd
    }
    wrong = with_errors(imu, ImuErrors(**errors))
    found = method.align(wrong, SITE, ImuUncertainty(**sd))
    row = 0 if getattr(method, "at", "end") == "start" else -1
    error = phi(found, truth[row])
    # To first order; 240 nodes are good to 1e-4, and errors of 1e-3 rad leave 1e-6 rad.
    assert np.allclose(np.outer(error, error), found.covariance, atol=3e-3 * (error @ error))


def test_the_null_directions():
    """A tilt, a heading with the biases that hide it: the record is the same, and so the answer."""
    imu, truth = ideal(still(300.0, 0.0, 0.0, 0.0), 10.0)
    hidden = np.array([1e-5, -2e-5, 3e-4])
    # Readings less truth of a body whose attitude is wrong by that: at rest no sensor tells.
    gyro, accel = np.cross(SITE.earth_rate, hidden), np.cross(-SITE.gravity, hidden)
    errors = ImuErrors(TriadErrors(bias=tuple(gyro)), TriadErrors(bias=tuple(accel)))
    imu = with_errors(imu, errors)
    for method in STATIC:
        row = 0 if getattr(method, "at", "end") == "start" else -1
        error = phi(method.align(imu, SITE, known(1e-6, 1e-2)), truth[row])
        # The axes turn by up to 0.022 rad against the level in between.
        assert np.allclose(error, hidden, atol=0.03 * np.abs(hidden).max())


def check_units(method, motion, rate, sensor="fog-1000"):
    """Chi-square of three physical errors, unit by unit, and all together."""
    row = 0 if getattr(method, "at", "end") == "start" else -1
    found = []
    for seed in range(RUNS):
        imu, truth, sensors = unit(motion, rate, seed, sensor)
        result = method.align(imu, SITE, sensors)
        assert not result.findings, result.findings[0]
        found.append(chi_square(result, truth[row]))
    # The chance that a test fails of a right covariance is 1e-4 a unit set and 1e-6 a unit.
    assert max(found) < chi2.isf(1e-6, 3)
    low, high = chi2.isf([1 - 1e-4, 1e-4], 3 * RUNS)
    assert low < sum(found) < high
    return found


@pytest.mark.slow
@pytest.mark.parametrize("method", STATIC, ids=str)
def test_units_that_stand(method):
    check_units(method, still(600.0), 20.0)


@pytest.mark.slow
@pytest.mark.parametrize("method", STATIC[1:], ids=str)
def test_units_that_rock(method):
    check_units(method, rocking(600.0), 50.0)


def test_gyros_of_a_tactical_class_that_find_north_to_degrees():
    check_units(TwoVector(), still(300.0), 20.0, "hg9900")


def test_a_rocking_body_is_no_case_for_two_vectors():
    """It refuses, and says why."""
    imu, _, sensors = unit(rocking(900.0), 50.0, 1)
    with pytest.raises(DataError, check=coded("alignment.heading-lost")) as refused:
        TwoVector().align(imu, SITE, sensors)
    assert "rocks by" in str(refused.value)


def test_what_levels_a_rocking_body_covers_the_angle_at_the_end():
    for seed, end in enumerate((30_000, 27_113, 21_777, 15_555)):
        imu, truth, sensors = unit(rocking(600.0), 50.0, seed)
        found = KnownHeading(60.0, 3.0).align(imu.iloc[:end], SITE, sensors)
        # A sine is at most sqrt(2) of its root mean square from its middle, on three axes.
        assert chi_square(found, truth[end - 1]) < 3 * 2.0 * 1.5
        assert any("is not stationary" in f.what for f in found.findings)


def test_a_drift_of_the_gyros_is_told():
    imu, _ = ideal(still(300.0), 10.0)
    drifting = known(gyro_drift=BiasDrift(0.01 * DEG_H, 1e9))
    constant = known(gyro=0.01 * DEG_H)
    for method in STATIC:
        a, b = (method.align(imu, SITE, s).covariance for s in (drifting, constant))
        sd = np.sqrt(np.diagonal(b))
        # The sum over 240 pieces, and 300 s of 1e9, leave a thousandth of a small component.
        assert np.allclose(a, b, rtol=1e-6, atol=2e-3 * np.outer(sd, sd))
    # Where it forgets itself within a second, it is noise of density sd sqrt(2 tau).
    fast = known(gyro_drift=BiasDrift(0.01 * DEG_H, 1.0))
    white = ImuUncertainty(
        TriadUncertainty(noise_density=0.01 * DEG_H * np.sqrt(2.0), bias=1e-12), known().accel
    )
    two = [TwoVector().align(imu, SITE, s).covariance[2, 2] for s in (fast, white)]
    assert two[0] == pytest.approx(two[1], rel=0.01)


def test_an_ideal_sensor_states_next_to_nothing():
    imu, _ = ideal(still(120.0), 10.0)
    for method in STATIC:
        assert np.sqrt(np.diagonal(method.align(imu, SITE, IDEAL).covariance)).max() < 1e-6


@pytest.mark.slow
@pytest.mark.parametrize("method", [TwoVector(), InertialFrame()], ids=str)
def test_the_latitude_is_told_by_the_sensors(method):
    ratios = []
    for seed in range(RUNS):
        imu, _, sensors = unit(still(600.0), 20.0, seed)
        found = method.align(imu, SITE, sensors)
        ratios.append((found.measured_latitude_deg - 55.0) / found.measured_latitude_sd_deg)
    low, high = chi2.isf([1 - 1e-4, 1e-4], RUNS)
    assert low < np.sum(np.square(ratios)) < high
    # The bias along the meridian, against the rate: 0.0104 of 15 deg/h; across the vertical
    # alone, against 15 sin(lat). The noise of gyros and accelerometers adds a fifth at the most.
    part = 1.0 if method.name == "two_vector" else np.sin(np.radians(55.0))
    least = np.degrees(0.0104 / 15.04) / part
    assert 0.99 * least < found.measured_latitude_sd_deg < 1.25 * least
