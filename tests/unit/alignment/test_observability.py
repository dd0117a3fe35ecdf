"""What no rest can tell, and which turn would tell it."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))

from resting import SITE, UNCERTAINTY, resting, roughly

from strapdown import rotation
from strapdown.alignment.fine import FineAlignment
from strapdown.alignment.readiness import STAY, manoeuvres_after
from strapdown.alignment.stationary import (
    LEAST_STRETCHES,
    Standing,
    home_of,
    rate_observation,
    still_observations,
)
from strapdown.estimation.covariance import Joseph
from strapdown.estimation.error_filter import ErrorFilter
from strapdown.estimation.error_model import RotationVectorModel
from strapdown.estimation.sensor_blocks import resting_states
from strapdown.increments import motion_increments
from strapdown.mechanization import NorthEastDown
from strapdown.simulation import ImuErrors, Origin, StationaryMotion, TriadErrors, simulate_imu
from strapdown.tables import MOTION
from strapdown.tables.checks import values_of

ANGLES = (3.0, -4.0, 70.0)
# Sizes by which columns are made comparable: m, m/s, rad, rad/s, m/s².
SIZES = np.repeat([1.0, 1e-2, 1e-3, 1e-7, 1e-2], 3)
STANDING = Standing(np.full(3, 1e-3), np.full(3, 1e-4), np.full(3, 1e-6))


def _observed(names, seconds=600, every=20):
    """Every observation of a rest without errors, as rows over the errors of its start."""
    motion = StationaryMotion(float(seconds), Origin(55.0, 37.0, 200.0), *ANGLES)
    imu, _ = simulate_imu(
        motion, ImuErrors(TriadErrors(), TriadErrors()), rate=10.0, sampling="mean"
    )
    increments = motion_increments(imu)
    rows, time = values_of(increments, MOTION), increments.index.to_numpy()
    model = RotationVectorModel(sensors=resting_states(UNCERTAINTY, np.zeros(3), [0, 0, -9.8]))
    filter_ = ErrorFilter(NorthEastDown(), model, Joseph())
    home = home_of(SITE, 0.0)
    q_nb = rotation.quaternion_from_euler(ANGLES)
    start = type(home)(0.0, home.lat, home.lon, home.alt, np.zeros(3), q_nb)
    state = filter_.begin(start, np.eye(15))
    so_far = np.eye(15)
    found = []
    each = every * 10
    for at in range(0, len(rows) - each + 1, each):
        state, segment = filter_.predict(state, time[at : at + each], rows[at : at + each])
        phi, _ = model.transition(segment, 0.1)
        if "rate" in names:
            one = rate_observation(filter_, segment, start, STANDING)
            found.append(one.H @ so_far / np.sqrt(one.R)[:, None])
        so_far = phi @ so_far
        for one in still_observations(filter_, state, home, STANDING, names):
            found.append(one.H @ so_far / np.sqrt(one.R)[:, None])
    return np.vstack(found), q_nb


def _null_space(lat_deg, q_nb, gravity, earth_rate):
    """Errors of computed attitude and biases that leave velocity and attitude constant at rest.

    Any constant rotation psi of the computed attitude, with ``C_nb b_a = f x psi`` and ``C_nb b_g =
    omega_ie x psi``; (15, 3): columns for psi about north, east, down.
    """
    lat = np.radians(lat_deg)
    spin = earth_rate * np.array([np.cos(lat), 0.0, -np.sin(lat)])
    force = np.array([0.0, 0.0, -gravity])
    C = rotation.dcm_from_quaternion(q_nb)
    out = np.zeros((15, 3))
    for i in range(3):
        psi = np.eye(3)[i]
        out[6:9, i] = psi
        out[9:12, i] = C.T @ np.cross(spin, psi)
        out[12:15, i] = C.T @ np.cross(force, psi)
    return out


@pytest.mark.parametrize(
    "names", [("velocity",), ("position", "velocity"), ("rate", "position", "velocity")]
)
def test_three_combinations_leave_no_trace(names):
    rows, q_nb = _observed(names)
    nothing = _null_space(55.0, q_nb, float(SITE.gravity[2]), 7.292115e-5)
    # A velocity increment is in the axes of the start of its step of 0.1 s, from which the Earth
    # has turned by half of 7.3e-6 rad in the mean: so exactly is its force known.
    size = np.linalg.norm(rows * SIZES, axis=0).max()
    for column in nothing.T:
        scaled = column / np.abs(column / SIZES).max()
        assert np.linalg.norm(rows @ scaled) < 4e-6 * size
    assert size > 1e5


def test_the_rate_of_the_earth_adds_no_rank_but_strength():
    without, _ = _observed(("position", "velocity"))
    with_rate, _ = _observed(("rate", "position", "velocity"))
    assert _rank(without) == _rank(with_rate) == 12
    # North and down drifts are what it is about: their part of the information grows.
    drift = slice(9, 12)
    before = np.linalg.norm(without[:, drift] * SIZES[drift])
    after = np.linalg.norm(with_rate[:, drift] * SIZES[drift])
    assert after > before


def _rank(rows):
    values = np.linalg.svd(rows * SIZES, compute_uv=False)
    return int(np.sum(values > 1e-7 * values[0]))


def test_half_a_turn_about_the_vertical_tells_heading_from_drift():
    rest = resting(3, 200.0)
    result = FineAlignment().align(rest.imu, SITE, UNCERTAINTY, roughly(rest))
    found = {one.name: one for one in manoeuvres_after(result, SITE)}
    best = next(iter(found))
    assert best == "heading-180"
    stay, turned = found[STAY], found[best]
    assert stay.rest == pytest.approx(200.0)
    # Two opposite positions: the drift turns with the body and the rate of the Earth does not.
    # What then limits the heading is the noise of two means of 200 s, and the drift's own walk.
    noise = np.radians(0.001 / 60.0) / np.sqrt(200.0) / np.sqrt(2.0)
    walk = np.radians(0.003 / 3600.0) * np.sqrt(2.0 * 200.0 / 3600.0)
    horizontal = 7.292115e-5 * np.cos(np.radians(55.0))
    wanted = np.degrees(np.hypot(noise, walk / np.sqrt(2.0)) / horizontal)
    assert turned.sd_deg[2] == pytest.approx(wanted, rel=0.5)
    assert turned.sd_deg[2] < 0.5 * stay.sd_deg[2]
    # And a tilt from a bias.
    assert np.all(turned.accel_bias_sd[:2] < 0.3 * stay.accel_bias_sd[:2])
    assert stay.sd_deg[2] == pytest.approx(result.alignment.sd_deg[2], rel=0.1)


def test_least_stretches_is_enough_to_tell_a_deviation():
    # Of n stretches the deviation is known to a share of 1/sqrt(2 n): a quarter.
    assert 1.0 / np.sqrt(2.0 * LEAST_STRETCHES) <= 0.25
