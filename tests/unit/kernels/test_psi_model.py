"""The psi-angle model's matrix and means against their definitions, each by itself."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from strapdown._kernels import psi_model as kernel
from strapdown._kernels.level import ALT, AXIS, LEVEL, OMEGA_EL
from strapdown.earth import gravity
from strapdown.ellipsoids import WGS84
from strapdown.estimation.sensor_blocks import accel_bias, g_sensitivity, gyro_bias, gyro_scale
from strapdown.estimation.sensor_states import stack
from strapdown.frames import C_ne, ecef_from_geodetic, geodetic_from_ecef

EARTH = WGS84.parameters()
#: Level axes from north-east-down: themselves, and those of a wander azimuth (up is +z).
NED = np.eye(3)
WANDER = np.array([[np.cos(0.7), np.sin(0.7), 0], [np.sin(0.7), -np.cos(0.7), 0], [0, 0, -1.0]])


def minus_cross(v):
    return np.array([[0, v[2], -v[1]], [-v[2], 0, v[0]], [v[1], -v[0], 0.0]])


def level_row(lat, alt, axes, turn=(0.0, 0.0, 0.0)):
    row = np.zeros(LEVEL)
    row[AXIS : AXIS + 3] = axes @ [np.cos(np.radians(lat)), 0.0, -np.sin(np.radians(lat))]
    row[ALT] = alt
    row[OMEGA_EL : OMEGA_EL + 3] = turn
    return row, float(axes[2, 2] * -1.0)


@pytest.mark.parametrize("axes", [NED, WANDER], ids=["ned", "wander"])
@pytest.mark.parametrize("alt", [0.0, 2000.0])
@pytest.mark.parametrize("lat", [-62.0, 5.0, 48.0, 89.0])
def test_gravity_changes_as_its_vector_in_earth_axes_does(lat, alt, axes):
    place = np.array([lat, 30.0, alt])
    at, C = ecef_from_geodetic(place), C_ne(lat, 30.0)
    found = np.zeros((3, 3))
    step = 200.0
    for j in range(3):
        # Displaced along level axis j, both ways.
        there = [
            geodetic_from_ecef(at + sign * step * (axes @ C)[j]).reshape(3) for sign in (1.0, -1.0)
        ]
        vectors = [C_ne(p[0], p[1]).T @ gravity(p[0], p[2]) for p in there]
        found[:, j] = axes @ C @ (vectors[0] - vectors[1]) / (2.0 * step)
    level, up = level_row(lat, alt, axes)
    F = np.zeros((9, 9))
    length = kernel.gravity_gradient(F, 3, 0, level, up, EARTH)
    assert length == pytest.approx(gravity(lat, alt)[2], abs=1e-9)
    # Gravity's formula is not curl-free beyond the first order of the flattening f: (f², 1e-5) of
    # 1.5e-6; above the surface 3 f h / a of it is left out. Central differences: (200 m / a)².
    np.testing.assert_allclose(F[3:6, :3], found, atol=1.5e-6 * (1e-5 + 0.01 * alt / 6.4e6))


@pytest.mark.parametrize("held", [False, True])
@pytest.mark.parametrize("axes", [NED, WANDER], ids=["ned", "wander"])
def test_each_block_is_that_of_the_equations(axes, held):
    rng = np.random.default_rng(5)
    turn, C = rng.normal(0, 1e-5, 3), Rotation.random(random_state=1).as_matrix()
    rate, force, specific = rng.normal(0, 1, 3), rng.normal(0, 5, 3), rng.normal(0, 5, 3)
    blocks = (gyro_bias(1), accel_bias(1), gyro_scale(1), g_sensitivity(1))
    gyro, accel, gyro_terms, accel_terms, *_ = stack(blocks)
    level, up = level_row(48.0, 500.0, axes, turn)
    F = np.full((9, 9 + gyro.shape[2]), 7.0)
    matrix = np.vstack([C, specific, rate, force])
    kernel.psi_dynamics(
        F, level, up, matrix, specific, rate, force, gyro_terms, accel_terms, held, EARTH
    )

    earth = WGS84.rotation_rate * level[AXIS : AXIS + 3]
    gradient = np.zeros((3, 3))
    length = kernel.gravity_gradient(gradient, 0, 0, level, up, EARTH)
    inputs = np.concatenate([[1.0], rate, force])
    expected = np.zeros_like(F)
    expected[:3, :3], expected[:3, 3:6] = minus_cross(turn), np.eye(3)
    expected[3:6, :3], expected[3:6, 3:6] = gradient, minus_cross(2.0 * earth + turn)
    expected[3:6, 6:9] = minus_cross(specific)
    expected[6:9, 6:9] = minus_cross(earth + turn)
    expected[3:6, 9:] = C @ np.einsum("c,cij->ij", inputs, accel)
    expected[6:9, 9:] = C @ np.einsum("c,cij->ij", inputs, gyro)
    if held:
        expected[3:5, :2] *= up * specific[2] / length
        expected[[2, 5]] = 0.0
    np.testing.assert_allclose(F, expected, rtol=1e-14, atol=1e-15)


def test_means_of_steps_are_those_of_the_motion():
    """A body that turns about a fixed axis of the level, with a force fixed in the level."""
    h, count, axis = 0.01, 25, np.array([0.6, -0.64, 0.48])
    turn, f_l, begin = 5.0 * axis, np.array([1.0, -2.0, -9.8]), Rotation.random(random_state=2)
    edges = h * np.arange(count + 1)
    sides = Rotation.from_rotvec(edges[:, None] * turn) * begin
    quats = sides.as_quat()[:, [3, 0, 1, 2]]
    quats[8:] *= -1.0  # the same attitudes
    body = begin.inv().apply(turn)
    rows = np.zeros((count, 7))
    rows[:, 0], rows[:, 1:4] = h, h * body
    # Velocity in the axes of the start of each step: the force is fixed in the level.
    rows[:, 4:7] = sides[:-1].inv().apply(np.tile(h * f_l, (count, 1)))
    matrix = np.empty((6, 3))
    end, dt = kernel.means_of_steps(quats, 0, rows, 3, 0.1, matrix)
    assert (end, dt) == (13, pytest.approx(0.1))
    fine = Rotation.from_rotvec(np.linspace(0.03, 0.13, 20001)[:, None] * turn) * begin
    # Each step has the attitude of its middle, (5 h)² / 24 of which differs from its mean, and the
    # force is turned there to the second order: (5 h / 2)³ / 6 of 10 m/s² is left.
    np.testing.assert_allclose(matrix[:3], fine.as_matrix().mean(axis=0), atol=1.05e-4)
    np.testing.assert_allclose(matrix[3], f_l, atol=2.7e-5)
    np.testing.assert_allclose(matrix[4], body, rtol=1e-12)
    np.testing.assert_allclose(matrix[5], fine.inv().apply(f_l).mean(axis=0), atol=1.05e-3)
    # A step that is longer than asked is a group of its own; the last group is what is left.
    assert kernel.means_of_steps(quats, 0, rows, 3, 0.001, matrix)[0] == 4
    assert kernel.means_of_steps(quats, 0, rows, 20, 1.0, matrix)[0] == count
