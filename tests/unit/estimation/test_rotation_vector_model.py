"""The 15-state model against finite differences of the mechanizations themselves."""

from __future__ import annotations

import numpy as np
import pytest

from strapdown.ellipsoids import WGS84
from strapdown.errors import ConfigError
from strapdown.estimation.error_model import PHYSICAL, RotationVectorModel, Segment
from strapdown.estimation.sensor_blocks import (
    accel_bias,
    accel_scale,
    gauss_markov,
    gyro_bias,
    gyro_scale,
)
from strapdown.increments import motion_increments
from strapdown.mechanization import NorthEastDown, WanderAzimuth
from strapdown.mechanization.mechanization import state_error
from strapdown.nav_state import NavState
from strapdown.tables import ACCEL, GYRO, MOTION, imu_table
from strapdown.tables.checks import values_of

RATE = 100.0
SENSORS = (gyro_bias(1e-5), accel_bias(1e-2), gyro_scale(1e-3), accel_scale(1e-3))
# Of what is perturbed: metres, m/s, rad, rad/s, m/s², and two shares.
SIZES = np.repeat([100.0, 1.0, 1e-3, 1e-5, 1e-2, 1e-4, 1e-4], 3)
OF_STATE = np.repeat([100.0, 1.0, 1e-3], 3)


def _imu(seconds):
    """Turns of 0.3 rad/s and forces of 2 m/s² about gravity, all smooth."""
    t = np.arange(0.0, seconds + 0.5 / RATE, 1.0 / RATE)
    rate = np.column_stack([0.2 * np.sin(1.1 * t), 0.15 * np.cos(0.7 * t), 0.3 * np.sin(0.5 * t)])
    force = np.column_stack(
        [2.0 * np.sin(0.9 * t), 1.5 * np.cos(0.6 * t), -9.8 + 2.0 * np.sin(1.3 * t)]
    )
    return imu_table(t, rate, force)


def _run(mechanization, start, imu):
    increments = motion_increments(imu)
    begun = mechanization.begin(start)
    end, history = mechanization.advance(begun, increments)
    rows = np.vstack([mechanization.history_row(begun), history])
    time = imu.index.to_numpy()
    return end, Segment(mechanization, time, rows, values_of(increments, MOTION))


def _differences(mechanization, start, imu, columns):
    """Central differences of the end of a run by each physical error, in level axes of the end."""
    end, segment = _run(mechanization, start, imu)
    reference = mechanization.nav_state(end, 0.0)
    begun = mechanization.begin(start)
    out = np.empty((PHYSICAL, columns))
    for j in range(columns):
        ends = []
        for sign in (1.0, -1.0):
            error = np.zeros(len(SIZES))
            error[j] = sign * SIZES[j]
            wrong = imu.copy()
            wrong.attrs = dict(imu.attrs)
            # Measured with scale and bias: the model's couplings are of what is measured.
            wrong[GYRO] = (imu[GYRO] + error[9:12]) / (1.0 - error[15:18])
            wrong[ACCEL] = (imu[ACCEL] + error[12:15]) / (1.0 - error[18:21])
            state, _ = mechanization.advance(
                mechanization.correct(begun, -error[:PHYSICAL]), motion_increments(wrong)
            )
            found = state_error(mechanization.nav_state(state, 0.0), reference, WGS84)
            # From north-east-down of the run that is off, which near a pole is not that of the
            # reference, to its level axes, which differ by 1e-5 rad.
            level = mechanization.level_from_ned(mechanization.history_row(state))
            ends.append(np.kron(np.eye(3), level) @ found)
        out[:, j] = (ends[0] - ends[1]) / (2.0 * SIZES[j])
    return out, segment


@pytest.mark.slow
@pytest.mark.parametrize(
    ("mechanization", "lat"),
    [
        (NorthEastDown(), 55.0),
        (NorthEastDown(), -20.0),
        (WanderAzimuth(), 55.0),
        (WanderAzimuth(), 89.95),
        (WanderAzimuth(height="held"), 40.0),
        (NorthEastDown(height="held"), 40.0),
    ],
    ids=lambda value: getattr(value, "name", value),
)
def test_transition_is_the_derivative_of_the_mechanization(mechanization, lat):
    start = NavState.from_degrees(
        lat,
        37.0,
        1000.0,
        v_n=[150.0, 100.0, 0.0],
        roll_deg=5.0,
        pitch_deg=4.0,
        heading_deg=30.0,
    )
    found, segment = _differences(mechanization, start, _imu(5.0), len(SIZES))
    model = RotationVectorModel(sensors=SENSORS)
    phi, _ = model.transition(segment, 0.05)
    # Means over h = 0.05 s leave out of a product, as of attitude and force, a part of h²/12 of
    # what both change in a second (0.3 and 2 rad/s): 1e-4, of a scale factor that adds 5e-3 m/s
    # and 1e-4 rad; central differences leave the third order of 1e-3 rad, and axes that differ by
    # 1e-5 rad what that does to 2e-1 of an error. Against the size of each error: 4e-6.
    held = mechanization.height == "held"
    rows = [i for i in range(PHYSICAL) if not (held and i in (2, 5))]
    columns = [j for j in range(len(SIZES)) if not (held and j in (2, 5))]
    apart = ((phi[:PHYSICAL] - found) * SIZES / OF_STATE[:, None])[np.ix_(rows, columns)]
    assert np.abs(apart).max() < 4e-6
    # The test can fail: without any one block of the model the difference is far larger.
    whole = np.abs(phi[:PHYSICAL] * SIZES / OF_STATE[:, None])
    for at in range(6, len(SIZES), 3):
        assert whole[:PHYSICAL, at : at + 3].max() > 1e-4


def test_the_error_of_a_step_falls_with_its_square():
    start = NavState.from_degrees(55.0, 37.0, 1000.0, v_n=[150.0, 100.0, -5.0])
    _, segment = _run(NorthEastDown(), start, _imu(6.0))
    model = RotationVectorModel(sensors=SENSORS)
    exact, _ = model.transition(segment, 0.01)
    steps = np.array([0.1, 0.2, 0.3])
    apart = []
    for step in steps:
        phi, _ = model.transition(segment, step)
        apart.append(np.abs((phi - exact)[3:6, 6:12]).max())
    order = np.polyfit(np.log(steps), np.log(apart), 1)[0]
    assert 1.7 < order < 2.4


@pytest.mark.slow
def test_noise_adds_what_brownian_motion_of_a_body_at_rest_does():
    gyro, accel = 1e-5, 1e-4
    start = NavState.from_degrees(55.0, 37.0, 0.0)
    t = np.arange(0.0, 10.005, 0.01)
    imu = imu_table(t, np.zeros((t.size, 3)), np.tile([0.0, 0.0, -9.8], (t.size, 1)))
    _, segment = _run(NorthEastDown(), start, imu)
    model = RotationVectorModel((gyro,) * 3, (accel,) * 3)
    _, q = model.transition(segment, 0.1)
    np.testing.assert_allclose(np.diagonal(q)[6:9], gyro**2 * 10.0, rtol=1e-5)
    # Of a velocity: its own noise, and that of the tilt, integrated: g² gyro² T³/3. Steps of 0.1 s
    # at their middles leave a part of 1/4 (0.1/10)² of it.
    tilt = (9.8 * gyro) ** 2 * 10.0**3 / 3.0
    np.testing.assert_allclose(np.diagonal(q)[3:5], accel**2 * 10.0 + tilt, rtol=1e-3)
    assert np.linalg.eigvalsh(q).min() > -1e-18
    np.testing.assert_array_equal(q, q.T)


@pytest.mark.slow
def test_a_gauss_markov_state_fades_and_is_driven():
    block = gauss_markov(gyro_bias(1e-6), 20.0)
    start = NavState.from_degrees(55.0, 37.0, 0.0)
    _, segment = _run(NorthEastDown(), start, _imu(10.0))
    phi, q = RotationVectorModel(sensors=(block,)).transition(segment, 0.1)
    kept = np.exp(-10.0 / 20.0)
    np.testing.assert_allclose(np.diagonal(phi)[9:], kept, rtol=1e-12)
    # Stationary: what is lost comes back, but for the middle of each step, (0.1/20)²/24.
    np.testing.assert_allclose(np.diagonal(q)[9:], 1e-12 * (1.0 - kept**2), rtol=1e-5)


def test_a_damped_height_has_no_model():
    start = NavState.from_degrees(55.0, 37.0, 0.0)
    used = NorthEastDown(height="damped")
    rows = np.vstack([used.history_row(used.begin(start))] * 2)
    segment = Segment(used, np.array([0.0, 0.01]), rows, np.full((1, 10), 0.01))
    with pytest.raises(
        ConfigError,
        check=lambda refused: refused.finding.code == "estimation.error-model-no-states-loop",
    ):
        RotationVectorModel().transition(segment, 0.1)
