"""One step of each attitude algorithm, against matrices and Runge-Kutta done by numpy."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from strapdown._kernels import attitude as kernel

DT = 0.02
# Increment of angle and its change over the step, rad: no two components alike.
THETA, CHANGE = np.array([0.11, -0.07, 0.13]), np.array([0.05, 0.03, -0.02])
# A few tens of additions and products of numbers up to 2.
ROUNDING = 1e-14


def cross(v):
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


def runge_kutta(slope, y):
    """One classical step of unit length, the rate linear over it with THETA as its integral."""
    first, last = THETA - 0.5 * CHANGE, THETA + 0.5 * CHANGE
    k1 = slope(y, first)
    k2 = slope(y + 0.5 * k1, THETA)
    k3 = slope(y + 0.5 * k2, THETA)
    k4 = slope(y + k3, last)
    return y + (k1 + 2.0 * k2 + 2.0 * k3 + k4) / 6.0


def step(name, state, a=0.0, b=0.0):
    after = np.array(state, dtype=np.float64)
    getattr(kernel, f"{name}_step")(after, DT, *THETA, *CHANGE, a, b)
    return after


def some_quaternion():
    x, y, z, w = Rotation.from_rotvec([0.4, -1.1, 0.7]).as_quat()
    return np.array([w, x, y, z])


def euler_slope(angles, rate):
    """Alexiev (8) to (10): the inverse of the matrix that takes the angles' rates to the body's."""
    roll, pitch, _ = angles
    matrix = np.array(
        [
            [1.0, 0.0, -math.sin(pitch)],
            [0.0, math.cos(roll), math.sin(roll) * math.cos(pitch)],
            [0.0, -math.sin(roll), math.cos(roll) * math.cos(pitch)],
        ]
    )
    return np.linalg.solve(matrix, rate)


def quaternion_slope(q, rate):
    """Half q times (0, rate): Hamilton's product as a matrix."""
    x, y, z = rate
    matrix = np.array(
        [[0.0, -x, -y, -z], [x, 0.0, z, -y], [y, -z, 0.0, x], [z, y, -x, 0.0]], dtype=np.float64
    )
    return 0.5 * matrix @ q


def test_naive_sums_the_increments_and_does_not_wrap():
    assert step("naive", [3.1, 0.2, -3.1]) == pytest.approx(
        np.add(THETA, (3.1, 0.2, -3.1)), abs=ROUNDING
    )


@pytest.mark.parametrize("start", [(0.3, -0.8, 2.0), (-2.5, 1.2, -1.0)])
def test_euler_angles(start):
    state = [*start, 1.0, -1.0, 0.0]
    forward = step("euler", state)
    np.testing.assert_allclose(
        forward[:3], start + euler_slope(start, THETA), rtol=0.0, atol=10.0 * ROUNDING
    )
    # The least |cos pitch| of begin and end, at the step that is counted from one.
    ends = [abs(math.cos(start[1])), abs(math.cos(forward[1]))]
    assert forward[3] == pytest.approx(min(ends))
    assert (forward[4], forward[5]) == (float(np.argmin(ends)), 1.0)
    fourth = step("euler", state, 1.0)
    np.testing.assert_allclose(
        fourth[:3], runge_kutta(euler_slope, np.array(start)), rtol=0.0, atol=10.0 * ROUNDING
    )


def test_euler_angles_wrap_and_a_step_across_the_pole_went_through_it():
    wrapped = step("euler", [3.1, 0.0, 0.1, 1.0, -1.0, 4.0])
    assert wrapped[0] == pytest.approx(3.1 + 0.11 - 2.0 * math.pi, abs=ROUNDING)
    assert wrapped[5] == 5.0
    # From pitch 1.56 with no roll, the pitch falls by 0.07; of the other sign it passes 90 deg.
    assert step("euler", [0.0, 1.56, 0.0, 1.0, -1.0, 0.0])[3] > 0.0
    beyond = step("euler", [math.pi, 1.56, 0.0, 1.0, -1.0, 7.0])
    assert beyond[1] > 0.5 * math.pi
    assert (beyond[3], beyond[4]) == (0.0, 8.0)


def test_near_the_pole_the_rates_keep_their_sign_and_are_finite():
    for pitch in (0.5 * math.pi - 1e-13, 0.5 * math.pi + 1e-13):
        roll, _, heading, cosine = kernel.euler_rates(0.2, pitch, *THETA)
        about = math.sin(0.2) * THETA[1] + math.cos(0.2) * THETA[2]
        assert heading == pytest.approx(math.copysign(1e12, cosine) * about)
        assert roll == pytest.approx(heading, rel=1e-9)


def test_direction_cosines_are_multiplied_by_the_exponential():
    C = Rotation.from_rotvec([0.4, -1.1, 0.7]).as_matrix()
    state = [*C.ravel(), 0.0]
    exact = step("dcm", state)
    np.testing.assert_allclose(exact[:9].reshape(3, 3), C @ expm(cross(THETA)), atol=ROUNDING)
    for order in (1, 2, 3, 4):
        series = sum(
            np.linalg.matrix_power(cross(THETA), k) / math.factorial(k) for k in range(order + 1)
        )
        after = step("dcm", state, float(order))
        np.testing.assert_allclose(after[:9].reshape(3, 3), C @ series, atol=ROUNDING)


def test_orthogonalising_is_a_step_of_newton_every_so_many_steps():
    rng = np.random.default_rng(1)
    C = Rotation.from_rotvec([0.4, -1.1, 0.7]).as_matrix() + 0.01 * rng.standard_normal((3, 3))
    state = np.array([*C.ravel(), 0.0])
    kernel.orthogonalise(state)
    newton = 0.5 * C @ (3.0 * np.eye(3) - C.T @ C)
    np.testing.assert_allclose(state[:9].reshape(3, 3), newton, atol=ROUNDING)
    turned = C @ expm(cross(THETA))
    first = step("dcm", [*C.ravel(), 0.0], 0.0, 2.0)
    np.testing.assert_allclose(first[:9].reshape(3, 3), turned, atol=ROUNDING)
    assert first[9] == 1.0
    second = step("dcm", [*C.ravel(), 1.0], 0.0, 2.0)
    newton = 0.5 * turned @ (3.0 * np.eye(3) - turned.T @ turned)
    np.testing.assert_allclose(second[:9].reshape(3, 3), newton, atol=ROUNDING)
    assert second[9] == 0.0


def test_the_quaternion_is_multiplied_by_that_of_the_increment():
    q = some_quaternion()
    product = Rotation.from_quat(np.roll(q, -1)) * Rotation.from_rotvec(THETA)
    exact = np.roll(product.as_quat(), 1)
    for normalise in (0.0, 1.0):
        after = step("quaternion", q, 0.0, normalise)
        np.testing.assert_allclose(after, math.copysign(1.0, exact @ after) * exact, atol=ROUNDING)
    # Twice as long, it is made of length one, and only where that is wanted.
    assert np.linalg.norm(step("quaternion", 2.0 * q, 0.0, 0.0)) == pytest.approx(2.0)
    assert np.linalg.norm(step("quaternion", 2.0 * q, 0.0, 1.0)) == pytest.approx(1.0)


def test_runge_kutta_of_the_quaternion():
    q = 1.5 * some_quaternion()
    expected = runge_kutta(quaternion_slope, q)
    np.testing.assert_allclose(step("rk4", q), expected, atol=ROUNDING)
    np.testing.assert_allclose(
        step("rk4", q, 1.0), expected / np.linalg.norm(expected), atol=ROUNDING
    )


@pytest.mark.parametrize(
    ("name", "state", "width", "options"),
    [
        ("naive", [0.1, 0.2, 0.3], 3, (0.0, 0.0)),
        ("euler", [0.1, 0.2, 0.3, 1.0, -1.0, 0.0], 3, (1.0, 0.0)),
        ("dcm", [*np.eye(3).ravel(), 0.0], 9, (3.0, 2.0)),
        ("quaternion", [1.0, 0.0, 0.0, 0.0], 4, (0.0, 1.0)),
        ("rk4", [1.0, 0.0, 0.0, 0.0], 4, (1.0, 0.0)),
    ],
)
def test_many_steps_are_one_after_another(name, state, width, options):
    rng = np.random.default_rng(3)
    dt, theta, change = (
        np.full(5, DT),
        0.1 * rng.normal(size=(5, 3)),
        0.01 * rng.normal(size=(5, 3)),
    )
    one, history = np.array(state), np.empty((5, width))
    all_at_once = one.copy()
    getattr(kernel, f"{name}_advance")(all_at_once, dt, theta, change, history, *options)
    for k in range(5):
        getattr(kernel, f"{name}_step")(one, DT, *theta[k], *change[k], *options)
        assert np.array_equal(history[k], one[:width])
    assert np.array_equal(all_at_once, one)
