"""What holds for every rotation. U = 2^-53, and bounds as in the tests of the kernels."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from strapdown import rotation

U = 2.0**-53

# A kernel turns by 19 U at most; degrees add two roundings of each of three angles, which are
# at most 2 pi: 12 pi U = 38 U.
KERNEL = 19 * U
DEGREES = 12 * math.pi * U
# A normalised quaternion: four squares and sums 4 U, halved, root U, division U.
NORM = 4 * U

rules = settings(max_examples=100, deadline=None)


def numbers(limit):
    return st.floats(-limit, limit, allow_subnormal=False)


@st.composite
def quaternions(draw):
    """Unit quaternions; zeros, ones and equal components come up often, so half turns do."""
    q = np.array([draw(numbers(1.0)) for _ in range(4)])
    largest = draw(st.integers(0, 3))
    q[largest] = draw(st.sampled_from([-1.0, 1.0]))
    return q / np.linalg.norm(q)


@st.composite
def rotation_vectors(draw, shortest=0.0, longest=math.pi):
    """Every length between the two, powers of ten of it included."""
    direction = draw(quaternions())[1:]
    size = math.hypot(*direction)
    if size < 1e-3:
        direction, size = np.array([0.0, 0.0, 1.0]), 1.0
    exponent = draw(st.sampled_from([0, -1, -3, -4, -8, -16, -100, -200, -300]))
    length = draw(st.floats(shortest, longest)) * 10.0**exponent
    return direction / size * max(length, shortest)


eulers = st.tuples(numbers(720.0), numbers(720.0), numbers(720.0)).map(np.array)
poles = st.tuples(numbers(180.0), st.sampled_from([-90.0, 90.0]), numbers(360.0)).map(np.array)


def turn(q_1, q_2):
    return np.radians(rotation.rotation_angle(q_1, q_2))


# rotation_angle itself: product 4 U and norms 4 U in three components, felt twice.
ANGLE = 2 * math.sqrt(3) * (4 * U + NORM)


@rules
@given(quaternions())
def test_quaternion_to_matrix_and_back(q):
    back = rotation.quaternion_from_dcm(rotation.dcm_from_quaternion(q))
    assert turn(q, back) <= 2 * KERNEL + ANGLE


@rules
@given(quaternions())
def test_quaternion_to_rotation_vector_and_back(q):
    r = rotation.rotation_vector_from_quaternion(q)
    # 8.5 U of each component's length.
    assert math.hypot(*r) <= math.pi * (1 + 8.5 * U)
    back = rotation.quaternion_from_rotation_vector(r)
    assert turn(q, back) <= 2 * (KERNEL + math.pi * 8.5 * U) + ANGLE


@rules
@given(quaternions())
def test_quaternion_to_euler_angles_and_back(q):
    back = rotation.quaternion_from_euler(rotation.euler_from_quaternion(q))
    assert turn(q, back) <= 2 * (2 * KERNEL + DEGREES) + ANGLE


@rules
@given(st.one_of(eulers, poles))
def test_euler_angles_to_matrix_to_rotation_vector_and_back(angles):
    r = rotation.rotation_vector_from_dcm(rotation.dcm_from_euler(angles))
    back = rotation.quaternion_from_euler(rotation.euler_from_rotation_vector(r))
    q = rotation.quaternion_from_euler(angles)
    # Seven kernels; degrees come in three times, from as much as 4 pi instead of 2 pi.
    assert turn(q, back) <= 7 * (KERNEL + math.pi * 8.5 * U) + 3 * 2 * DEGREES + ANGLE


@rules
@given(rotation_vectors())
def test_logarithm_undoes_the_exponential_below_half_a_turn(r):
    length = math.hypot(*r)
    # Exponential: s is wrong by 5.5 U and a product 6.5 U; cos by U and by 2.5 U of the half
    # angle; norm 4 U, which scales all four, and a division U each. The half angle feels s by
    # half of it and the cosine by up to the sine: 3.3 U + 3.5 U + U. Logarithm: 8.5 U. The
    # direction: 6.5 U and U and a half. All relative; a subnormal product is rounded to the grid.
    bound = 24 * U * length + 2 * 5e-324
    if length < math.pi * (1 - 24 * U):
        back = rotation.rotation_vector_from_quaternion(rotation.quaternion_from_rotation_vector(r))
        assert np.abs(back - r).max() <= bound


@rules
@given(rotation_vectors(longest=12.0))
def test_both_exponentials_are_the_same_turn(r):
    direct = rotation.dcm_from_rotation_vector(r)
    by_quaternion = rotation.dcm_from_quaternion(rotation.quaternion_from_rotation_vector(r))
    # The same rounded half angle and so the same c and s. The matrix: 31 U at most without the
    # angle's (kernel tests); the quaternion: c U, s 5.5 U and a product, felt four times, norm
    # twice, and 5 U of its matrix.
    assert np.abs(direct - by_quaternion).max() <= (31 + 4 * 6.5 + 2 * 4 + 5) * U


@rules
@given(quaternions())
def test_matrix_of_a_quaternion_is_orthogonal_with_determinant_one(q):
    c = rotation.dcm_from_quaternion(q)
    # An entry 5 U, a row of them sqrt 3 times that, twice; the norm of q is 4 U off, its square
    # 8 U, which C^T C feels at most four times; the check's own products 3 U.
    loss = (2 * math.sqrt(3) * 5 + 4 * 8 + 3) * U
    assert np.abs(c.T @ c - np.eye(3)).max() <= loss
    # det^2 = det(I + E): half the trace of E; and the elimination's own roundings, under 10 U.
    assert abs(np.linalg.det(c) - 1.0) <= 1.5 * loss + 10 * U


@rules
@given(rotation_vectors(longest=12.0))
def test_matrix_of_a_rotation_vector_is_orthogonal_with_determinant_one(r):
    c = rotation.dcm_from_rotation_vector(r)
    # An entry 31 U, apart from the angle's rounding, which turns and does not deform.
    loss = (2 * math.sqrt(3) * 31 + 3) * U
    assert np.abs(c.T @ c - np.eye(3)).max() <= loss
    assert abs(np.linalg.det(c) - 1.0) <= 1.5 * loss + 10 * U


@rules
@given(st.one_of(eulers, poles))
def test_matrix_of_euler_angles_is_orthogonal_with_determinant_one(angles):
    c = rotation.dcm_from_euler(angles)
    loss = (2 * math.sqrt(3) * 5 + 4 * 8 + 3) * U
    assert np.abs(c.T @ c - np.eye(3)).max() <= loss
    assert abs(np.linalg.det(c) - 1.0) <= 1.5 * loss + 10 * U


@rules
@given(quaternions())
def test_opposite_quaternions_are_the_same_rotation(q):
    # The same products of the same numbers, bit for bit.
    assert np.array_equal(rotation.dcm_from_quaternion(q), rotation.dcm_from_quaternion(-q))
    assert turn(q, -q) <= ANGLE
    if q[0] != 0.0:
        r, opposite = (rotation.rotation_vector_from_quaternion(p) for p in (q, -q))
        assert np.array_equal(r, opposite)
    e, opposite = (rotation.euler_from_quaternion(p) for p in (q, -q))
    back, other = rotation.quaternion_from_euler([e, opposite])
    assert turn(back, other) <= 2 * (2 * KERNEL + DEGREES) + ANGLE


@rules
@given(quaternions(), numbers(10.0), numbers(10.0))
def test_turns_about_one_axis_add_up(q, a, b):
    axis = q[1:]
    size = math.hypot(*axis)
    if size < 1e-3:
        axis, size = np.array([1.0, 0.0, 0.0]), 1.0
    axis = axis / size
    both = rotation.compose(
        rotation.quaternion_from_rotation_vector(a * axis),
        rotation.quaternion_from_rotation_vector(b * axis),
    )
    once = rotation.quaternion_from_rotation_vector((a + b) * axis)
    # In half angles, each exponential: the square of the length 3 U and the root U: 2.5 U, and the
    # product with the axis U more; c and s x: U and 6.5 U, and a rounded direction U. a + b: U.
    # The axis is 4 U from unit length, alike in all three. Product of quaternions 4 U a component,
    # twice as a vector, and three norms.
    angles = (abs(a) + abs(b) + abs(a + b)) / 2
    bound = 3.5 * angles + abs(a + b) / 2 + 3 * (1 + 6.5 + 1) + 2 * 4 + 3 * 4
    assert np.linalg.norm(both - once) <= bound * U


@rules
@given(quaternions(), quaternions(), quaternions())
def test_composition_is_associative(p, q, r):
    left = rotation.compose(rotation.compose(p, q), r)
    right = rotation.compose(p, rotation.compose(q, r))
    # A product is rounded by 4 U a component, 8 U as a vector; the inputs and the inner product are
    # normalised, 4 U each: two products and four norms a side.
    assert np.linalg.norm(left - right) <= 2 * (2 * 8 + 4 * 4) * U


@rules
@given(quaternions(), quaternions())
def test_reversing_a_composition_reverses_its_order(p, q):
    there = rotation.conjugate(rotation.compose(p, q))
    back = rotation.compose(rotation.conjugate(q), rotation.conjugate(p))
    # One product a side, and the norms of two inputs and of each result.
    assert np.linalg.norm(there - back) <= 2 * (8 + 3 * 4) * U


@rules
@given(quaternions(), st.tuples(numbers(1e3), numbers(1e3), numbers(1e3)).map(np.array))
def test_rotation_keeps_lengths(q, v):
    length = math.hypot(*v)
    # Entries 5 U, three of them met by v: sqrt 3; sums 3 U; as a vector sqrt 3 again; and the
    # norm of q, 4 U, four times.
    bound = (math.sqrt(3) * (math.sqrt(3) * 5 + 3) + 4 * 4) * U
    assert abs(math.hypot(*rotation.rotate(q, v)) - length) <= bound * length + 5 * 5e-324


@rules
@given(st.one_of(quaternions(), eulers.map(rotation.quaternion_from_euler)))
def test_euler_angles_lie_in_their_ranges(q):
    roll, pitch, heading = rotation.euler_from_quaternion(q)
    assert -180.0 < roll <= 180.0
    assert -90.0 <= pitch <= 90.0
    assert 0.0 <= heading < 360.0


@rules
@given(poles)
def test_euler_angles_of_the_poles_lie_in_their_ranges_and_the_attitude_is_kept(angles):
    q = rotation.quaternion_from_euler(angles)
    found = rotation.euler_from_quaternion(q)
    assert -180.0 < found[0] <= 180.0
    assert -90.0 <= found[1] <= 90.0
    assert 0.0 <= found[2] < 360.0
    back = rotation.quaternion_from_euler(found)
    assert turn(q, back) <= 2 * (2 * KERNEL + DEGREES) + ANGLE


@rules
@given(
    st.tuples(
        numbers(179.0),
        numbers(89.0),
        st.floats(0.0, 359.0, allow_subnormal=False),
    ).map(np.array)
)
def test_euler_angles_come_back_as_themselves_away_from_the_poles(angles):
    found = rotation.euler_from_dcm(rotation.dcm_from_euler(angles))
    difference = np.radians(found - angles)
    # Only a heading of zero has a neighbour on the other side of its range.
    difference[2] -= 2 * math.pi * round(difference[2] / (2 * math.pi))
    bound = (4 * KERNEL + 2 * DEGREES) / math.cos(math.radians(angles[1]))
    assert np.abs(difference).max() <= bound
