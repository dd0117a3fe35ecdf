"""Seventeen states by components and fifteen by vectors tell the same of physical errors."""

import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import expm

sys.path.insert(0, str(Path(__file__).parents[2]))

from strapdown._kernels import psi_model
from strapdown._kernels.compensation import compensate
from strapdown._kernels.level import Q_LB
from strapdown.ellipsoids import WGS84, find_ellipsoid
from strapdown.estimation.covariance import Joseph, Observation
from strapdown.estimation.error_filter import ErrorFilter
from strapdown.estimation.error_model import QuaternionModel, RotationVectorModel
from strapdown.estimation.sensor_blocks import accel_bias, gauss_markov, gyro_bias, gyro_scale
from strapdown.estimation.sensor_states import stack
from strapdown.mechanization.wander_azimuth import WanderAzimuth
from wander_runs import history_of, made_up, physical_error, segment_of, start

BLOCKS = (gauss_markov(gyro_bias(1e-6), 50.0), accel_bias(1e-3), gyro_scale(1e-4))
NOISE = {"gyro_noise": (1e-5, 2e-5, 3e-5), "accel_noise": (1e-3, 2e-3, 3e-3), "sensors": BLOCKS}
# m, m/s, rad, and the sensors': what each is compared to.
SIZE = np.concatenate([np.repeat([100.0, 0.1, 1e-4, 1e-6, 1e-3, 1e-4], 3)])


def some_run(lat, alt, duration, dt=0.02):
    mechanization = WanderAzimuth()
    begin = mechanization.begin(start(lat, alt, (60.0, -150.0, 1.0)))
    rows = made_up(begin[8:12], duration, dt)
    return segment_of(mechanization, history_of(mechanization, begin, rows), rows)


def by_components(segment, step):
    """T Phi E and T Q T'."""
    model = QuaternionModel(**NOISE)
    used, time, history = segment.mechanization, segment.time, segment.history
    Phi, Q = model.transition(segment, step)
    T = model.to_physical(used, time[-1], history[-1])
    return T @ Phi @ model.from_physical(used, time[0], history[0]), T @ Q @ T.T


def by_vectors(segment, step):
    """The psi-angle model with a vertical displacement of zero, each group by expm (Van Loan)."""
    used, rows = segment.mechanization, segment.increments
    n = len(SIZE)
    _, _, gyro, accel, decay, drive, _ = stack(BLOCKS)
    earth, levels = find_ellipsoid(used.ellipsoid).parameters(), used.levels(segment.history)
    Phi, Q, matrix, at = np.eye(n), np.zeros((n, n)), np.empty((6, 3)), 0
    while at < len(rows):
        end, dt = psi_model.means_of_steps(levels, Q_LB, rows, at, step, matrix)
        F = np.zeros((n, n))
        psi_model.psi_dynamics(
            F[:9],
            0.5 * (levels[at] + levels[end]),
            1.0,
            matrix,
            matrix[3],
            matrix[4],
            matrix[5],
            gyro,
            accel,
            False,
            earth,
        )
        F[9:, 9:] = -np.diag(decay)
        F[2] = 0.0
        F[:, 2] = 0.0
        G = np.zeros((n, n))
        for block, noise in ((slice(3, 6), "accel_noise"), (slice(6, 9), "gyro_noise")):
            G[block, block] = matrix[:3] @ np.diag(np.square(NOISE[noise])) @ matrix[:3].T
        G[9:, 9:] = np.diag(drive**2)
        big = expm(np.block([[-F, G], [np.zeros((n, n)), F.T]]) * dt)
        step_phi = big[n:, n:].T
        Phi = step_phi @ Phi
        Q = step_phi @ Q @ step_phi.T + step_phi @ big[:n, n:]
        at = end
    return Phi, Q


def without_height(Phi):
    out = Phi.copy()
    out[2] = 0.0
    out[:, 2] = 0.0
    return out


def largest(difference):
    return np.abs(difference * SIZE / SIZE[:, None]).max()


@pytest.mark.slow
@pytest.mark.parametrize("lat", [-40.0, 0.0, 52.0, 89.9999])
def test_transitions_agree_and_better_with_the_cube_of_the_step(lat):
    segment = some_run(lat, 0.0, 25.6)
    steps = np.array([1.6, 0.8, 0.4])
    off = [
        largest(by_components(segment, s)[0] - without_height(by_vectors(segment, s)[0]))
        for s in steps
    ]
    # Both are of the same means; one has exp(F dt) to the third order, the other all of it. What
    # turns in 1.6 s by 1e-4 is all that differs: (1e-3 of the sensors' decay over 0.4 s)³.
    assert off[-1] < 1e-8
    assert np.polyfit(np.log(steps), np.log(off), 1)[0] > 2.8


def test_they_agree_where_steps_are_short():
    segment = some_run(52.0, 0.0, 10.0)
    ours, theirs = by_components(segment, 0.02)[0], by_vectors(segment, 0.02)[0]
    # Means are alike in both; the level turns by 1e-4 in a second, in parts of 0.02 s.
    assert largest(ours - without_height(theirs)) < 1e-8


def test_noise_agrees_with_the_square_of_the_step():
    segment = some_run(52.0, 0.0, 25.6)
    off = []
    for step in (0.8, 0.4, 0.2):
        ours, theirs = by_components(segment, step)[1], by_vectors(segment, step)[1]
        sd = np.sqrt(np.diag(theirs)) + (np.diag(theirs) == 0.0)
        off.append(np.abs((ours - without_height(theirs)) / np.outer(sd, sd)).max())
    # A group's noise enters in its middle: of the variance of a displacement that is
    # dt²/12 of 3 / t² (of a velocity by tilt the same), at t = 25.6 s.
    assert off[-1] < 1e-4
    np.testing.assert_allclose(np.array(off[:-1]) / off[1:], 4.0, rtol=0.1)


@pytest.mark.parametrize("lat", [52.0, 89.9999])
def test_the_two_models_as_they_are(lat):
    segment = some_run(lat, 3000.0, 4.0)
    model = RotationVectorModel(**NOISE)
    Phi, Q = model.transition(segment, 0.1)
    ours, noise = by_components(segment, 0.1)
    # That has the height: h = v t changes gravity by 3e-6 h, half v t² of it 2.5e-5.
    assert largest(ours - without_height(Phi)) < 3e-5
    sd = np.sqrt(np.diag(Q)) + (np.diag(Q) == 0.0)
    assert np.abs((noise - without_height(Q)) / np.outer(sd, sd)).max() < 1e-4


def test_two_filters_tell_the_same():
    mechanization = WanderAzimuth(height="held")
    first = start(70.0, 50.0, (20.0, -10.0, 0.0))
    rows = made_up(mechanization.begin(first)[8:12], 40.0, 0.02)
    truth = history_of(mechanization, mechanization.begin(first), rows)
    gyro, accel, *_ = stack(BLOCKS)
    wrong = np.empty_like(rows)
    put_on = np.array([1e-6, -2e-6, 1e-6, 1e-3, 2e-3, -1e-3, 1e-4, -2e-4, 1e-4])
    compensate(rows, -gyro @ put_on, -accel @ put_on, wrong)
    sd = np.concatenate([[20.0, 20.0, 0.0, 0.2, 0.2, 0.0], [1e-3] * 3, [1e-6] * 3, [1e-3] * 3])
    P = np.diag(np.concatenate([sd, [1e-4] * 3]) ** 2)
    seen = [0, 1, 3, 4]
    R = np.array([1.0, 1.0, 0.01, 0.01])
    noise = np.random.default_rng(4).normal(0.0, np.sqrt(R), (40, 4))
    ends = []
    for model in (QuaternionModel(**NOISE), RotationVectorModel(**NOISE)):
        used = ErrorFilter(mechanization, model, Joseph(), step=0.1)
        state = used.begin(first, P)
        for k in range(40):
            part = slice(50 * k, 50 * (k + 1))
            state, _ = used.predict(state, 0.02 * np.arange(50 * k + 1, 50 * k + 51), wrong[part])
            z = physical_error(state.row, truth[50 * (k + 1)], WGS84)[seen] + noise[k]
            H = np.eye(model.physical_size)[seen]
            state, _, _ = used.observe(state, [Observation("receiver", z, H, R, ("",) * 4)])
        P_end = used.physical_covariance(state)
        ends.append((state, np.sqrt(np.diag(P_end))))
    (ours, sd), (theirs, sd_theirs) = ends
    keep = [0, 1, 3, 4, *range(6, 18)]
    # The 15 states take the vertical velocity to be zero in the computed level, and it is so in
    # the true one: 2 W V r / R, 1e-8 m/s² for 20 m, beside a noise of 1e-3 m/s².
    np.testing.assert_allclose(sd[keep], sd_theirs[keep], rtol=1e-4)
    apart = physical_error(ours.row, theirs.row, WGS84)
    both = [0, 1, 3, 4, 6, 7, 8]
    assert np.abs(apart[both] / sd[both]).max() < 1e-3
    assert np.abs((ours.sensors - theirs.sensors) / sd[9:]).max() < 1e-3
    # And both are about the truth.
    error = np.concatenate([physical_error(ours.row, truth[-1], WGS84), ours.sensors - put_on])
    assert np.abs(error[keep] / sd[keep]).max() < 4.0
