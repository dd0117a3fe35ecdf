"""Coarse alignments of sensors that do not err: only the method's own error is left."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

sys.path.insert(0, str(Path(__file__).parent))

from stands import IDEAL, ORIGIN, SITE, ideal, phi, rocking, still

from strapdown.alignment.alignment import Site
from strapdown.alignment.inertial_frame import InertialFrame, _wahba
from strapdown.alignment.levelling import KnownHeading, Levelling
from strapdown.alignment.two_vector import TwoVector
from strapdown.simulation.earth_motion import Origin

ATTITUDES = [(0.0, 0.0, 0.0), (-2.0, 1.0, 60.0), (170.0, -60.0, 200.0), (40.0, 88.0, 359.0)]


@pytest.mark.parametrize("angles", ATTITUDES)
@pytest.mark.parametrize("lat", [55.0, -33.0, 0.0, 80.0])
def test_a_body_that_stands(lat, angles):
    origin, site = Origin(lat, 10.0, 500.0), Site(lat, 10.0, 500.0)
    imu, truth = ideal(still(120.0, *angles, origin=origin), 10.0)
    # North of normal gravity at a height, 4e-6 m/s² at 500 m, is in both; what is left is
    # rounding of 1e-16 in a mean rate of 7e-5 rad/s whose sums are of 1200 samples.
    assert np.abs(phi(TwoVector().align(imu, site, IDEAL), truth[-1])).max() < 1e-9
    for at, row in (("start", 0), ("end", -1)):
        found = InertialFrame(at).align(imu, site, IDEAL)
        # The ramp of gravity is 1.7e-4 of gravity at 80 deg in 120 s; the trapezoidal rule over
        # 1200 steps errs by 1e-6 of what degrees 2 and 3 share: known and measured share it.
        assert np.abs(phi(found, truth[row])).max() < 1e-7
        assert found.time == (0.0 if at == "start" else 120.0)


def test_a_body_that_rocks_and_heaves():
    imu, truth = ideal(rocking(600.0), 100.0)
    for at, row in (("start", 0), ("end", -1)):
        error = phi(InertialFrame(at).align(imu, SITE, IDEAL), truth[row])
        # The heave of 0.1 m in 6 s is 1.7 mm of degree 3 over 600 s at the most (amplitude over
        # the square of its 628 rad), against the 14.7 km of w x g t³/6: far below a microradian
        # of heading and of tilt (g t²/2 = 1.8e6 m).
        assert np.abs(error).max() < 2e-6


def test_levelling_and_a_stated_heading():
    imu, truth = ideal(still(60.0), 10.0)
    # Gravity leans by 8e-9 * 150 * sin(110 deg)/9.8 = 1.2e-7 rad there.
    assert np.abs(phi(KnownHeading(60.0, 0.1).align(imu, SITE, IDEAL), truth[-1])).max() < 1.3e-7
    found = Levelling().align(imu, SITE, IDEAL)
    assert np.allclose(found.roll_pitch_heading, [-2.0, 1.0, 0.0], atol=1e-5)
    assert found.sd_deg[2] == pytest.approx(180.0 / np.sqrt(3.0), rel=1e-3)
    assert any("heading is not known" in f.what for f in found.findings)


def test_instantaneous_samples_do_as_well_as_means():
    from strapdown.simulation import ImuErrors, simulate_imu
    from strapdown.tables import QUATERNION

    imu, truth = simulate_imu(rocking(300.0), ImuErrors(), rate=100.0)
    error = phi(InertialFrame().align(imu, SITE, IDEAL), truth[QUATERNION].to_numpy()[-1])
    # Rocking of 2 deg in 7.3 s turns by 1e-4 rad a step: its chord is good to 1e-9 of it.
    assert np.abs(error).max() < 1e-5


def test_the_attitude_of_wahbas_problem_is_scipys():
    rng = np.random.default_rng(3)
    known = rng.normal(0.0, 1.0, (21, 3))
    true = Rotation.from_rotvec([0.4, -1.0, 2.0])
    measured = true.inv().apply(known) + rng.normal(0.0, 0.1, (21, 3))
    weights = rng.uniform(0.1, 2.0, 21)
    other, _ = Rotation.align_vectors(known, measured, weights=weights)
    assert np.allclose(_wahba(measured, known, weights), other.as_matrix(), atol=1e-12)


def test_a_height_and_a_latitude_are_used():
    imu, truth = ideal(still(120.0, origin=Origin(ORIGIN.lat_deg, 0.0, 9000.0)), 10.0)
    site = Site(ORIGIN.lat_deg, 0.0, 9000.0)
    assert np.abs(phi(TwoVector().align(imu, site, IDEAL), truth[-1])).max() < 1e-9
