"""The closed loop: errors of the sensors and of the state are taken off, whatever the model."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from tests.coded import coded

from strapdown._kernels.compensation import compensate
from strapdown.errors import DivergenceError
from strapdown.estimation.covariance import COVARIANCES, Joseph, Observation
from strapdown.estimation.error_filter import LARGE, ErrorFilter, is_large
from strapdown.estimation.error_model import ERROR_MODELS, QuaternionModel, RotationVectorModel
from strapdown.estimation.sensor_blocks import (
    accel_bias,
    accel_misalignment,
    accel_scale,
    gauss_markov,
    gyro_bias,
    gyro_misalignment,
    gyro_scale,
)
from strapdown.estimation.sensor_states import stack
from strapdown.increments import motion_increments
from strapdown.mechanization import MECHANIZATIONS, NorthEastDown, WanderAzimuth
from strapdown.mechanization.mechanization import state_error
from strapdown.nav_state import NavState
from strapdown.tables import ACCEL, GYRO, MOTION, imu_table
from strapdown.tables.checks import values_of

START = NavState.from_degrees(
    55.0, 37.0, 300.0, v_n=[30.0, -20.0, 1.0], roll_deg=5.0, pitch_deg=-3.0, heading_deg=200.0
)
SENSORS = (gyro_bias(1e-6), accel_bias(1e-3))
COMBINATIONS = [
    (mechanization, model)
    for mechanization, model in itertools.product(
        (NorthEastDown(), WanderAzimuth()), ERROR_MODELS.values()
    )
    if not (model is QuaternionModel and mechanization.name == "ned")
]


def moving(seconds=10.0, rate=100.0):
    t = np.arange(0.0, seconds + 0.5 / rate, 1.0 / rate)
    gyro = np.column_stack([0.2 * np.sin(1.1 * t), 0.15 * np.cos(0.7 * t), 0.3 * np.sin(0.5 * t)])
    accel = np.column_stack([2.0 * np.sin(0.9 * t), 1.5 * np.cos(0.6 * t), -9.8 + np.sin(1.3 * t)])
    return imu_table(t, gyro, accel)


def increments_of(imu):
    table = motion_increments(imu)
    return table.index.to_numpy(), values_of(table, MOTION)


def test_errors_that_samples_have_are_taken_off_increments():
    biases = [1e-4, -2e-4, 3e-4, 0.02, -0.03, 0.01]
    scales = [1e-3, -2e-3, 1e-3, 2e-3, 1e-3, -1e-3]
    misalignments = [1e-3, -1e-3, 5e-4, 1e-3, 2e-3, -1e-3, 1e-3, 1e-3, -5e-4, 1e-3, -2e-3, 1e-3]
    states = np.array([*biases, *scales, *misalignments])
    blocks = (
        gyro_bias(1.0),
        accel_bias(1.0),
        gyro_scale(1.0),
        accel_scale(1.0),
        gyro_misalignment(1.0),
        accel_misalignment(1.0),
    )
    gyro, accel, *_ = stack(blocks)
    true = moving()
    wrong = true.copy()
    wrong.attrs = dict(true.attrs)
    # The errors are shares of the truth, as in the chain of errors: m = true + b + E true.
    weights = np.column_stack([np.ones(len(true)), true[GYRO].to_numpy(), true[ACCEL].to_numpy()])
    rate = true[GYRO].to_numpy() + np.einsum("ni,ijk,k->nj", weights, gyro, states)
    force = true[ACCEL].to_numpy() + np.einsum("ni,ijk,k->nj", weights, accel, states)
    wrong[GYRO], wrong[ACCEL] = rate, force
    _, wanted = increments_of(true)
    _, given = increments_of(wrong)
    out = np.empty_like(given)
    compensate(given, gyro @ states, accel @ states, out)
    # What is left: the change of the errors within a step of 0.01 s, its twelfth times the turn
    # (0.3 rad/s) times 3e-2 m/s², and the square of the errors in the cross terms, 3e-4 x 9.8
    # times dt²: 1e-8 m/s of 3e-4 m/s that was taken off.
    assert np.abs(out[:, 4:7] - wanted[:, 4:7]).max() < 3e-8
    assert np.abs(given[:, 4:7] - wanted[:, 4:7]).max() > 3e-4
    # A turn: the twelfth of dt² times rate times error, 0.3 x 3e-4 x 1e-4 / 12 = 1e-9 rad.
    assert np.abs(out[:, 1:4] - wanted[:, 1:4]).max() < 1e-9
    assert np.abs(given[:, 1:4] - wanted[:, 1:4]).max() > 3e-6
    # A distance: errors of force that grow by 6e-3 m/s³ put a twelfth of that times dt³ of the
    # distance elsewhere in the step, 5e-10 m of 1.5e-6 m.
    assert np.abs(out[:, 7:10] - wanted[:, 7:10]).max() < 6e-10
    assert np.abs(given[:, 7:10] - wanted[:, 7:10]).max() > 1e-6


@pytest.mark.parametrize(("mechanization", "model"), COMBINATIONS)
def test_a_perfect_observation_takes_an_error_off(mechanization, model):
    """Everything physical is observed without noise to speak of: the state becomes the truth."""
    filter_ = ErrorFilter(mechanization, model(sensors=SENSORS), Joseph())
    P = np.diag(np.repeat([100.0, 1.0, 1e-4, 1e-12, 1e-6], 3))
    state = filter_.begin(START, P)
    error = np.array([30.0, -40.0, 0.0, 0.5, -0.3, 0.2, 1e-3, -2e-3, 3e-3])
    wrong = mechanization.correct(state.mechanization, -error)
    row = mechanization.history_row(wrong)
    state = type(state)(state.time, wrong, row, state.sensors, state.covariance)
    size = filter_.model.physical_size
    rows = [i for i in range(9) if i != 2 or filter_.model.has_height]
    there = mechanization.nav_state(wrong, 0.0)
    turn = np.kron(np.eye(3), mechanization.level_from_ned(row))
    z = turn @ state_error(there, START)
    observation = Observation("all", z[rows], np.eye(size)[rows], np.full(len(rows), 1e-12), ())
    after, _, (seen,) = filter_.observe(state, [observation])
    left = state_error(mechanization.nav_state(after.mechanization, 0.0), START)
    # The second order of 3e-3 rad, 50 m / 6.4e6 m and their products.
    assert np.abs(left[:3]).max() < 1e-3
    assert np.abs(left[3:6]).max() < 1e-5
    assert np.abs(left[6:9]).max() < 1e-5
    np.testing.assert_array_equal(seen.weight, 1.0)


@pytest.mark.parametrize(("mechanization", "model"), COMBINATIONS)
def test_what_is_nothing_physical_stays_at_zero(mechanization, model):
    """Norms and gauge have no variance after prediction and feedback either."""
    time, rows = increments_of(moving())
    filter_ = ErrorFilter(
        mechanization, model((1e-6,) * 3, (1e-4,) * 3, SENSORS), COVARIANCES["ud"]()
    )
    state = filter_.begin(START, np.diag(np.repeat([100.0, 1.0, 1e-2, 1e-12, 1e-6], 3)))
    size = filter_.model.physical_size
    for at in range(0, 1000, 100):
        state, _ = filter_.predict(state, time[at : at + 100], rows[at : at + 100])
        H = np.eye(size)[3:6]
        z = np.array([0.3, -0.2, 0.1])
        state, _, _ = filter_.observe(state, [Observation("v", z, H, np.full(3, 1e-2), ())])
    P = filter_.form.matrix(state.covariance)
    T = filter_.model.to_physical(mechanization, state.time, state.row)
    E = filter_.model.from_physical(mechanization, state.time, state.row)
    # What is left of P without its physical part.
    beside = np.eye(len(P)) - E @ T
    scale = np.sqrt(np.diagonal(P)).max()
    assert np.abs(beside @ P @ beside.T).max() < 1e-12 * scale**2 + 1e-15
    values = np.linalg.eigvalsh(P)
    assert values.min() > -1e-12 * values.max()


@pytest.mark.parametrize("name", COVARIANCES)
def test_a_run_cut_between_steps_of_the_covariance_goes_on(name):
    time, rows = increments_of(moving())
    model = RotationVectorModel((1e-6,) * 3, (1e-4,) * 3, SENSORS)
    filter_ = ErrorFilter(NorthEastDown(), model, COVARIANCES[name]())
    begun = filter_.begin(START, np.diag(np.repeat([100.0, 1.0, 1e-4, 1e-12, 1e-6], 3)))
    whole, _ = filter_.predict(begun, time, rows)
    part, _ = filter_.predict(begun, time[:300], rows[:300])
    part, _ = filter_.predict(part, time[300:], rows[300:])
    # The mechanization to the last bit, the covariance to rounding.
    np.testing.assert_array_equal(part.mechanization, whole.mechanization)
    a, b = filter_.form.matrix(part.covariance), filter_.form.matrix(whole.covariance)
    sd = np.sqrt(np.diagonal(b))
    assert np.abs((a - b) / np.outer(sd, sd)).max() < 1e-9


def test_a_state_that_leaves_the_earth_is_refused():
    time, rows = increments_of(moving())
    rows = rows.copy()
    rows[500, 4] = 1e9
    model = RotationVectorModel(sensors=SENSORS)
    filter_ = ErrorFilter(NorthEastDown(), model, Joseph())
    state = filter_.begin(START, np.eye(15))
    with pytest.raises(DivergenceError, check=coded("estimation.state-diverged-sample", time=5.01)):
        filter_.predict(state, time, rows)


def test_every_mechanization_tells_what_a_filter_needs():
    for name, kind in MECHANIZATIONS.items():
        used = kind()
        row = used.history_row(used.begin(START))
        assert row.shape == (used.row,), name
        level = used.levels(row[None, :])[0]
        C = used.level_from_ned(row)
        np.testing.assert_allclose(C @ C.T, np.eye(3), atol=1e-15)
        np.testing.assert_allclose(level[4:7], C @ START.v_n, atol=1e-12)
        lat = np.radians(55.0)
        axis = C @ [np.cos(lat), 0.0, -np.sin(lat)]
        np.testing.assert_allclose(level[7:10], axis, atol=1e-15)
        assert C[2, 2] == pytest.approx(-used.level_up)


def test_what_a_bias_and_a_scale_factor_share_is_not_seen():
    """By how much an input that stays is corrected is the same wherever the two share it."""
    gyro, accel, *_ = stack((accel_bias(1.0), accel_scale(1.0)))
    force, dt = -9.8, 0.01
    row = np.array([[dt, 0, 0, 0, 0, 0, (force + 0.5) * dt, 0, 0, 0.5 * (force + 0.5) * dt**2]])
    for scale in (0.0, -0.03, 0.05, 0.1):
        states = np.array([0.0, 0.0, 0.5 - scale * force, 0.0, 0.0, scale])
        out = np.empty_like(row)
        compensate(row, gyro @ states, accel @ states, out)
        # The rounds leave the sixth power of the scale factor of the input; shares of the reading
        # would leave the share of what is taken off, 0.1 x 0.5 m/s² and more.
        assert abs(out[0, 6] / dt - force) < 10.0 * 0.1**6 * 16.0 + 1e-12, scale


def test_an_estimate_of_a_drift_fades_and_one_of_a_constant_does_not():
    blocks = (gauss_markov(gyro_bias(1e-6), 50.0), accel_bias(1e-3))
    used = ErrorFilter(NorthEastDown(), RotationVectorModel(sensors=blocks), Joseph(), step=0.1)
    state = used.begin(START, np.eye(used.model.layout.size) * 1e-6)
    known = np.array([1e-6, -2e-6, 3e-6, 1e-3, 2e-3, -1e-3])
    time, rows = increments_of(moving())
    ended, _ = used.predict(replace(state, sensors=known), time, rows)
    faded = np.exp(-(ended.time - state.time) / 50.0)
    assert ended.time - state.time == pytest.approx(10.0, abs=0.02)
    np.testing.assert_allclose(ended.sensors[:3], known[:3] * faded, rtol=1e-9)
    np.testing.assert_allclose(ended.sensors[3:], known[3:], rtol=1e-12)


def test_a_tilt_is_large_by_both_of_its_axes_and_whatever_the_heading():
    P = np.zeros((15, 15))
    P[8, 8] = 1.0
    assert not is_large(P)
    P[6, 6] = P[7, 7] = 0.49 * LARGE**2
    assert not is_large(P)
    P[7, 7] = 0.52 * LARGE**2
    assert is_large(P)
