"""Each entry of F against the complex step of the paper's equations, written plainly."""

import numpy as np
import pytest

from strapdown._kernels import earth as earth_kernel
from strapdown._kernels import wander_errors as kernel
from strapdown._kernels.compilation import interpreted
from strapdown._kernels.level import LEVEL
from strapdown.ellipsoids import WGS84
from strapdown.estimation.sensor_blocks import (
    accel_bias,
    accel_misalignment,
    g_sensitivity,
    gyro_bias,
    gyro_scale,
)
from strapdown.estimation.sensor_states import stack

EARTH = WGS84.parameters()
RATE = WGS84.rotation_rate
STEP = 1e-30


def times(p, q):
    """Hamilton's product; complex numbers allowed."""
    a, u = p[0], p[1:]
    b, v = q[0], q[1:]
    return np.concatenate([[a * b - u @ v], a * v + b * u + np.cross(u, v)])


def conj(q):
    return q * [1, -1, -1, -1]


def matrix(q):
    """Direction cosines of a quaternion of any norm."""
    w, v = q[0], q[1:]
    cross = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    return ((w * w - v @ v) * np.eye(3) + 2 * np.outer(v, v) + 2 * w * cross) / (q @ q)


def of_earth(t):
    return np.array([np.cos(0.5 * RATE * t), 0, 0, np.sin(0.5 * RATE * t)])


def equations(Y, t, alt, rate, force):
    """Right-hand sides of (1), (2) and (4), with the skew-symmetric matrix in (1)."""
    V, q0, q1 = Y[:3], Y[3:7], Y[7:]
    axis = matrix(q1).T @ [0, 0, 1]
    k, s = axis[:2], axis[2]
    e2 = WGS84.eccentricity_squared
    w = 1 / np.sqrt(1 - e2 * s * s)
    N, M = WGS84.semi_major_axis * w, WGS84.semi_major_axis * (1 - e2) * w**3
    # Curvatures along and across the meridian, as a tensor: N - M has the factor |k|².
    between = N * w * w * e2 / ((M + alt) * (N + alt))
    turn = V[:2] / (N + alt) + between * k * (k @ V[:2])
    omega = np.array([-turn[1], turn[0], 0])
    slope, down, _, _, _ = interpreted(earth_kernel.gravity_parts)(
        s * s, alt, w, 1 / (M + alt), *EARTH[:4], *EARTH[5:7]
    )
    g = np.array([-s * slope * alt * k[0], -s * slope * alt * k[1], -down])
    q_wb = times(conj(q1), times(conj(of_earth(t)), q0))
    fall = matrix(q_wb) @ force + g - np.cross(2 * RATE * axis + omega, V)
    still = np.zeros(1)
    return np.concatenate(
        [
            fall,
            0.5 * times(q0, np.concatenate([still, rate])),
            0.5 * times(q1, np.concatenate([still, omega])),
        ]
    )


def variables(Y, t):
    """What the errors of Y are of theta, dV, eps (9 columns) and of the two norms."""
    q0, q1 = Y[3:7], Y[7:]
    q_iw = times(of_earth(t), q1)
    q_wb = times(conj(q_iw), q0)
    S = np.zeros((11, 11), dtype=Y.dtype)
    S[:3, 3:6] = np.eye(3)
    for j, unit in enumerate(np.eye(4)):
        S[3:7, 9 if j == 0 else 5 + j] = 0.5 * times(q_iw, times(unit, q_wb))
        S[7:, 10 if j == 0 else j - 1] = 0.5 * times(q1, unit)
    return S


def drawn(seed, pole):
    rng = np.random.default_rng(seed)
    Y = np.concatenate([rng.normal(0, 200, 3), rng.normal(0, 1, 8)])
    if pole:
        Y[7:] = [1, 1e-7, -2e-7, 0.7]
    for part in (slice(3, 7), slice(7, 11)):
        Y[part] /= np.linalg.norm(Y[part])
    return Y, 5e4 * rng.random(), rng.normal(0, 1, 3), rng.normal(0, 10, 3)


def level_row(Y, t, alt):
    q_wb = times(conj(Y[7:]), times(conj(of_earth(t)), Y[3:7]))
    row = np.zeros(LEVEL)
    row[:4], row[4:7], row[7:10] = q_wb, Y[:3], matrix(Y[7:]).T @ [0, 0, 1]
    row[10] = alt
    row[11:] = 2 * times(conj(Y[7:]), equations(Y, t, alt, np.zeros(3), np.zeros(3))[7:])[1:]
    return row, matrix(q_wb)


@pytest.mark.parametrize("pole", [False, True])
@pytest.mark.parametrize("alt", [0.0, 9000.0])
@pytest.mark.parametrize("seed", range(4))
def test_every_entry_is_the_derivative_of_the_equations(seed, alt, pole):
    Y, t, rate, force = drawn(seed, pole)
    blocks = (gyro_bias(1), accel_bias(1), gyro_scale(1), accel_misalignment(1), g_sensitivity(1))
    k = sum(len(b.block) for b in blocks)
    gyro, accel, gyro_terms, accel_terms, *_ = stack(blocks)
    level, C = level_row(Y, t, alt)
    F = np.empty((9, 9 + k))
    rooms = [np.empty((3, 3)) for _ in range(3)]
    kernel.wander_dynamics(
        F, level, C, C @ force, rate, force, gyro_terms, accel_terms, False, EARTH, *rooms
    )

    S = variables(Y, t)
    dY = equations(Y, t, alt, rate, force)
    dS = variables(Y + 1j * STEP * dY, t + 1j * STEP).imag / STEP
    AS = np.stack(
        [equations(Y + 1j * STEP * S[:, j], t, alt, rate, force).imag / STEP for j in range(11)],
        axis=1,
    )
    expected = np.linalg.solve(S, AS - dS)
    # Of the core: the two norms neither grow nor act. Rounding: 1e-15 of forces of 10 and of
    # body rates of 1, which cancel.
    np.testing.assert_allclose(expected[9:], 0.0, atol=2e-14)
    np.testing.assert_allclose(expected[:, 9:], 0.0, atol=2e-14)
    # Above the ellipsoid the change with latitude of what bends gravity's direction is left out,
    # 1e-2 of 8e-9 alt.
    left_out = 1e-10 * alt
    np.testing.assert_allclose(F[:, :9], expected[:9, :9], atol=2e-14 + left_out)
    # dw by V and place, which are as small as 1/R and V/R: to their own size.
    np.testing.assert_allclose(F[:3, 3:6], expected[:3, 3:6], rtol=1e-9, atol=1e-21)
    np.testing.assert_allclose(F[:3, :3], expected[:3, :3], rtol=1e-9, atol=1e-14)

    inputs = np.concatenate([[1.0], rate, force])
    for j in range(k):
        dw = np.einsum("c,ci->i", inputs, gyro[:, :, j])
        df = np.einsum("c,ci->i", inputs, accel[:, :, j])
        moved = equations(Y, t, alt, rate + 1j * STEP * dw, force + 1j * STEP * df).imag / STEP
        np.testing.assert_allclose(
            F[:, 9 + j], np.linalg.solve(S, moved)[:9], atol=1e-14 * np.abs(inputs).max()
        )


def test_matrix_of_the_paper_is_not_skew_symmetric_and_the_one_used_is():
    """(1) as printed, element (1, 4), lets the norm of the quaternion grow."""
    x, y, z = 0.3, -0.2, 0.5
    printed = np.array([[0, y, -x, z], [-y, 0, z, -x], [x, -z, 0, -y], [z, x, y, 0]])
    assert np.abs(printed + printed.T).max() == 2 * abs(z)
    mended = printed.copy()
    mended[0, 3] = -z
    np.testing.assert_array_equal(mended, -mended.T)
    # It is that of q (x) w with w = (-y, x, z): a sensor's axes turned by 90 degrees about z.
    q = np.array([0.5, -0.1, 0.7, 0.2])
    np.testing.assert_allclose(mended @ q, times(q, np.array([0, -y, x, z])), atol=1e-16)
    # The printed one changes the norm by 2 z q0 q3.
    assert q @ printed @ q == pytest.approx(2 * z * q[0] * q[3])


def test_with_a_held_height_nothing_moves_vertically():
    Y, t, rate, force = drawn(0, pole=False)
    level, C = level_row(Y, t, 0.0)
    blocks = (gyro_bias(1), accel_bias(1))
    _, _, gyro, accel, *_ = stack(blocks)
    free, held = np.empty((9, 15)), np.empty((9, 15))
    for F, hold in ((free, False), (held, True)):
        rooms = [np.empty((3, 3)) for _ in range(3)]
        kernel.wander_dynamics(
            F, level, C, C @ force, rate, force, gyro, accel, hold, EARTH, *rooms
        )
    assert not held[5].any()
    assert not held[:, 5].any()
    rest = np.ix_([0, 1, 2, 3, 4, 6, 7, 8], [0, 1, 2, 3, 4, *range(6, 15)])
    np.testing.assert_array_equal(held[rest], free[rest])
