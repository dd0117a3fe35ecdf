"""The public rotations against scipy's, their shapes, their conventions and their refusals.

U = 2^-53, as in the tests of the kernels, whose bounds are used here: no kernel turns an
attitude by more than 19 U.
"""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from strapdown import rotation
from strapdown._kernels.attitude import euler_rates
from strapdown.errors import DataError

U = 2.0**-53

FORMS = ("quaternion", "dcm", "euler", "rotation_vector")
SHAPES = {"quaternion": (4,), "dcm": (3, 3), "euler": (3,), "rotation_vector": (3,)}
PAIRS = [(a, b) for a, b in itertools.product(FORMS, FORMS) if a != b]

# Two kernels at most on the way there, and as many of scipy's to make the input and to read
# the output: 4 x 19 U. Degrees: three angles, each at most 2 pi, rounded by U when they are
# scaled and by U for the constant: 12 pi U for the input and again for the output.
TURN = (4 * 19 + 2 * 12 * math.pi) * U


def convert(source, target, values):
    return getattr(rotation, f"{target}_from_{source}")(values)


def to_form(form, turns):
    if form == "quaternion":
        return turns.as_quat()[..., [3, 0, 1, 2]]
    if form == "dcm":
        return turns.as_matrix()
    if form == "rotation_vector":
        return turns.as_rotvec()
    return turns.as_euler("ZYX", degrees=True)[..., ::-1]


def from_form(form, values):
    if form == "quaternion":
        return Rotation.from_quat(values[..., [1, 2, 3, 0]])
    if form == "dcm":
        return Rotation.from_matrix(values)
    if form == "rotation_vector":
        return Rotation.from_rotvec(values)
    return Rotation.from_euler("ZYX", values[..., ::-1], degrees=True)


def random_turns(count, seed=7):
    q = np.random.default_rng(seed).standard_normal((count, 4))
    return Rotation.from_quat(q)


def random_quaternions(count, seed=7):
    return to_form("quaternion", random_turns(count, seed))


# Roll, pitch, heading: identity, half and quarter turns about each axis, and the poles.
SPECIAL = np.array(
    [
        [0.0, 0.0, 0.0],
        [180.0, 0.0, 0.0],
        [0.0, 180.0, 0.0],
        [0.0, 0.0, 180.0],
        [90.0, 0.0, 0.0],
        [0.0, 0.0, 90.0],
        [0.0, 0.0, 270.0],
        [0.0, 90.0, 0.0],
        [0.0, -90.0, 0.0],
        [30.0, 90.0, 100.0],
        [-170.0, -90.0, 350.0],
        [0.0, 90.0 - 1e-9, 200.0],
        [120.0, -90.0 + 1e-7, 10.0],
    ]
)
HALF_TURNS = np.array([[0.0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1], [0, 0.6, 0.8, 0]])


def special_input(form):
    if form == "euler":
        return SPECIAL
    turns = Rotation.concatenate(
        [from_form("euler", SPECIAL), Rotation.from_quat(HALF_TURNS[:, [1, 2, 3, 0]])]
    )
    return to_form(form, turns)


def angle_between(a, b):
    return (a.inv() * b).magnitude()


# --- conversions --------------------------------------------------------------------------


@pytest.mark.parametrize(("source", "target"), PAIRS)
def test_conversion_is_the_same_turn_as_scipys(source, target):
    for values in (to_form(source, random_turns(400)), special_input(source)):
        found = convert(source, target, values)
        assert found.shape == values.shape[:1] + SHAPES[target]
        assert angle_between(from_form(source, values), from_form(target, found)).max() <= TURN


@pytest.mark.parametrize(("source", "target"), PAIRS)
def test_conversion_gives_the_same_numbers_as_scipys(source, target):
    turns = random_turns(400)
    found = convert(source, target, to_form(source, turns))
    wanted = to_form(target, turns)
    if target == "quaternion":
        error = np.abs(found - np.sign((found * wanted).sum(1))[:, None] * wanted).max(1)
        stretch = 0.5
    elif target == "dcm":
        error = np.abs(found - wanted).max(axis=(1, 2))
        stretch = 1.0
    elif target == "rotation_vector":
        # A turn of e moves the vector by e (|r|/2) / sin(|r|/2), at most pi/2, while it does
        # not cross half a turn, which none of these 400 does.
        assert np.linalg.norm(wanted, axis=1).max() < math.pi - 1e-4
        error = np.abs(found - wanted).max(1)
        stretch = math.pi / 2
    else:
        difference = found - wanted
        difference -= 360.0 * np.round(difference / 360.0)
        error = np.radians(np.abs(difference)).max(1)
        stretch = 1.0 / np.cos(np.radians(wanted[:, 1]))
    # The output in degrees is rounded once more by U of 2 pi when it is compared.
    assert (error <= stretch * (TURN + 4 * math.pi * U)).all()


@pytest.mark.parametrize("source", ["quaternion", "dcm", "rotation_vector"])
def test_euler_angles_lie_in_their_ranges(source):
    for values in (to_form(source, random_turns(400)), special_input(source)):
        roll, pitch, heading = convert(source, "euler", values).T
        assert ((roll > -180.0) & (roll <= 180.0)).all()
        assert (np.abs(pitch) <= 90.0).all()
        assert ((heading >= 0.0) & (heading < 360.0)).all()


def test_heading_a_hair_west_of_north_is_zero_and_not_360():
    roll, pitch, heading = rotation.euler_from_quaternion([1.0, 0.0, 0.0, -1e-18])
    assert (roll, pitch, heading) == (0.0, 0.0, 0.0)


def test_heading_west_is_270():
    # Both components are the same double, so the turn is a quarter exactly.
    q = [math.sqrt(0.5), 0.0, 0.0, -math.sqrt(0.5)]
    heading = rotation.euler_from_quaternion(q)[2]
    assert abs(heading - 270.0) <= math.degrees(TURN)


@pytest.mark.parametrize("pitch", [90.0, -90.0])
def test_at_the_pole_roll_is_zero(pitch):
    half = math.sqrt(0.5)
    side = math.copysign(1.0, pitch)
    for phi in np.radians([0.0, 20.0, 75.0, 100.0, 170.0]):
        c, s = half * math.cos(phi), half * math.sin(phi)
        found = rotation.euler_from_quaternion([c, -side * s, side * c, s])
        assert found[0] == 0.0
        assert found[1] == pitch
        # Heading is twice phi; phi came from degrees and went through cos and sin (2 U).
        assert abs(found[2] - 2 * math.degrees(phi)) <= math.degrees(TURN)


@pytest.mark.parametrize("target", ["quaternion", "dcm", "euler"])
def test_rotation_vectors_longer_than_half_a_turn_come_back_as_the_same_attitude(target):
    r = random_turns(100).as_rotvec()
    longer = r * (1.0 + 4.0 * math.pi / np.linalg.norm(r, axis=1))[:, None]
    found = convert("rotation_vector", target, longer)
    # Lengthening by two turns rounds each component by 3 U of up to 5 pi, and the exponential
    # feels the rounding of the angle as 2.5 U of that.
    bound = TURN + (3 + 2.5) * 5 * math.pi * U
    assert angle_between(Rotation.from_rotvec(r), from_form(target, found)).max() <= bound


def test_quaternions_within_one_percent_are_normalised():
    q = random_quaternions(50)
    for scale in (0.991, 1.009):
        turn = rotation.dcm_from_quaternion(scale * q) - rotation.dcm_from_quaternion(q)
        # Scaling, norm and division: five roundings in each component, which an entry feels
        # four times at most; each matrix its 5 U.
        assert np.abs(turn).max() <= (4 * 5 + 2 * 5) * U
        assert np.linalg.norm(rotation.conjugate(scale * q), axis=1) == pytest.approx(1, abs=4 * U)


# --- what the letters and signs mean ------------------------------------------------------


@pytest.mark.parametrize(
    ("euler", "v_b", "v_n"),
    [
        ([0, 0, 90], [1, 0, 0], [0, 1, 0]),  # heading east: the nose looks east
        ([0, 0, 90], [0, 1, 0], [-1, 0, 0]),  # and the right side south
        ([0, 90, 0], [1, 0, 0], [0, 0, -1]),  # pitch up: the nose looks up
        ([90, 0, 0], [0, 1, 0], [0, 0, 1]),  # roll right: the right side looks down
        ([0, 90, 90], [1, 0, 0], [0, 0, -1]),  # heading turns first, about the vertical
        ([90, 0, 90], [0, 1, 0], [0, 0, 1]),
    ],
)
def test_positive_angles_turn_the_way_of_north_east_down(euler, v_b, v_n):
    turned = rotation.dcm_from_euler(euler) @ v_b
    assert np.abs(turned - v_n).max() <= TURN
    assert np.abs(rotation.rotate(rotation.quaternion_from_euler(euler), v_b) - v_n).max() <= TURN


def printed(roll, pitch, heading):
    """Alexiev (2021), Eqs. (4)-(6), letter by letter; angles in rad."""
    c, s = math.cos(roll), math.sin(roll)
    cx = np.array([[1, 0, 0], [0, c, s], [0, -s, c]])
    c, s = math.cos(pitch), math.sin(pitch)
    cy = np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]])
    c, s = math.cos(heading), math.sin(heading)
    cz = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
    return cx, cy, cz


def as_read(roll, pitch, heading):
    cx, cy, cz = printed(roll, pitch, heading)
    return cz.T @ cy.T @ cx.T


def as_printed(roll, pitch, heading):
    cx, cy, cz = printed(roll, pitch, heading)
    return cz @ cy @ cx


ATTITUDES = np.random.default_rng(3).uniform([-180, -60, 0], [180, 60, 360], (50, 3))


def test_equation_3_needs_the_transposes_of_the_printed_matrices():
    found = rotation.dcm_from_euler(ATTITUDES)
    for attitude, c_nb in zip(ATTITUDES, found, strict=True):
        angles = np.radians(attitude)
        # Three factors of cos and sin, 2 U each, two products and sums: under 19 U, as scipy's.
        assert np.abs(c_nb - as_read(*angles)).max() <= TURN
    # C_nb = Cz Cy Cx is another attitude, tens of degrees away for most.
    wrong = np.array([as_printed(*np.radians(a)) for a in ATTITUDES])
    apart = np.degrees(angle_between(Rotation.from_matrix(found), Rotation.from_matrix(wrong)))
    assert np.median(apart) > 45.0


def skew(w):
    return np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])


def growth(matrix, angles, w):
    """Return the derivative of `matrix` along the kinematics (8)-(10), minus C [w x]."""
    rates = np.array(euler_rates(angles[0], angles[1], *w)[:3])
    h = 1e-5
    slope = (matrix(*(angles + h * rates)) - matrix(*(angles - h * rates))) / (2 * h)
    return np.abs(slope - matrix(*angles) @ skew(w)).max()


def test_the_kinematics_agree_with_the_transposes_and_not_with_the_print():
    rng = np.random.default_rng(4)
    for angles in np.radians(ATTITUDES):
        w = rng.uniform(-1.0, 1.0, 3)
        # |w| <= sqrt 3 and cos(pitch) >= 1/2: pitch changes by 1.42 rad/s at most, heading by 2.83
        # and roll by 1 + 0.87 x 2.83 = 3.45. Along a straight line in the angles the third
        # derivative is at most (3.45 + 1.42 + 2.83)^3 = 457: h^2/6 of it is 7.7e-9. The
        # matrices' roundings, 19 U / h, are 2.2e-10.
        assert growth(as_read, angles, w) <= 7.9e-9
    wrong = [growth(as_printed, a, rng.uniform(-1.0, 1.0, 3)) for a in np.radians(ATTITUDES)]
    assert min(wrong) > 1e-3
    assert np.median(wrong) > 0.5


def test_euler_angles_of_a_slightly_turned_body_change_at_the_rates_of_the_kinematics():
    rng = np.random.default_rng(5)
    h = 1e-5
    for attitude in ATTITUDES:
        w = rng.uniform(-1.0, 1.0, 3)
        ends = []
        for step in (-h, h):
            q = rotation.compose(
                rotation.quaternion_from_euler(attitude),
                rotation.quaternion_from_rotation_vector(step * w),
            )
            ends.append(np.radians(rotation.euler_from_quaternion(q)))
        change = ends[1] - ends[0]
        change -= 2 * math.pi * np.round(change / (2 * math.pi))
        roll, pitch = np.radians(attitude[:2])
        rates = np.array(euler_rates(roll, pitch, *w)[:3])
        # With the first derivatives of the test above, (8)-(10) give at most 16.6 (roll), 4.9 and
        # 16.8 (heading) for the second and 234 (roll) for the third: h^2/6 of it is 3.9e-9.
        # Each end is wrong by TURN / cos(pitch).
        assert np.abs(change / (2 * h) - rates).max() <= 3.9e-9 + 2 * (2 * TURN) / (2 * h)


# --- shapes -------------------------------------------------------------------------------


@pytest.mark.parametrize(("source", "target"), PAIRS)
@pytest.mark.parametrize("leading", [(), (1,), (6,), (2, 5), (0,), (3, 0, 2)])
def test_leading_dimensions_are_kept_and_rows_do_not_mix(source, target, leading):
    count = int(np.prod(leading))
    flat = to_form(source, random_turns(12))[:count]
    found = convert(source, target, flat.reshape(leading + SHAPES[source]))
    assert found.shape == leading + SHAPES[target]
    assert found.dtype == np.float64
    alone = [convert(source, target, row) for row in flat]
    assert np.array_equal(
        found.reshape((count, *SHAPES[target])), np.array(alone).reshape((count, *SHAPES[target]))
    )


def test_lists_integers_and_strided_arrays_are_accepted():
    assert np.array_equal(rotation.dcm_from_quaternion([1, 0, 0, 0]), np.eye(3))
    q = random_quaternions(20)
    wide = np.repeat(q, 2, axis=1)[:, ::2]
    assert np.array_equal(rotation.dcm_from_quaternion(wide), rotation.dcm_from_quaternion(q))
    fortran = np.asfortranarray(q)
    assert np.array_equal(rotation.dcm_from_quaternion(fortran), rotation.dcm_from_quaternion(q))
    backwards = rotation.dcm_from_quaternion(q[::-1])
    assert np.array_equal(backwards[::-1], rotation.dcm_from_quaternion(q))


@pytest.mark.parametrize(
    ("left", "right", "leading"),
    [
        ((), (), ()),
        ((5,), (), (5,)),
        ((), (5,), (5,)),
        ((5,), (5,), (5,)),
        ((2, 1), (5,), (2, 5)),
        ((2, 5), (1, 5), (2, 5)),
        ((0,), (), (0,)),
        ((0,), (1,), (0,)),
    ],
)
def test_compose_rotate_and_angle_broadcast_as_numpy_does(left, right, leading):
    a = random_quaternions(10, 1)[: int(np.prod(left))].reshape((*left, 4))
    b = random_quaternions(10, 2)[: int(np.prod(right))].reshape((*right, 4))
    v = np.random.default_rng(3).standard_normal((10, 3))[: int(np.prod(right))]
    v = v.reshape((*right, 3))
    product = rotation.compose(a, b)
    turned = rotation.rotate(a, v)
    angle = rotation.rotation_angle(a, b)
    assert product.shape == (*leading, 4)
    assert turned.shape == (*leading, 3)
    assert angle.shape == leading
    full_a = np.broadcast_to(a, (*leading, 4))
    full_b = np.broadcast_to(b, (*leading, 4))
    full_v = np.broadcast_to(v, (*leading, 3))
    for at in np.ndindex(leading):
        assert np.array_equal(product[at], rotation.compose(full_a[at], full_b[at]))
        assert np.array_equal(turned[at], rotation.rotate(full_a[at], full_v[at]))
        assert angle[at] == rotation.rotation_angle(full_a[at], full_b[at])


# --- composition --------------------------------------------------------------------------


def test_neighbouring_letters_cancel():
    q_ab, q_bc = random_quaternions(300, 1), random_quaternions(300, 2)
    q_ac = rotation.compose(q_ab, q_bc)
    chain = rotation.dcm_from_quaternion(q_ab) @ rotation.dcm_from_quaternion(q_bc)
    # Three matrices of 5 U, each of two met by a row of length one (sqrt 3), and their product's
    # 3 U; the product of quaternions 4 U, which an entry feels four times; its norm 4 U, twice.
    bound = (5 + 2 * math.sqrt(3) * 5 + 3 + 4 * 4 + 2 * 4) * U
    assert np.abs(rotation.dcm_from_quaternion(q_ac) - chain).max() <= bound


def test_rotate_is_the_matrix_times_the_vector():
    q_nb = random_quaternions(300)
    v_b = 10.0 * np.random.default_rng(8).standard_normal((300, 3))
    found = rotation.rotate(q_nb, v_b)
    wanted = np.einsum("nij,nj->ni", rotation.dcm_from_quaternion(q_nb), v_b)
    # The same matrix; three products and two sums of each, in whatever order: 3 U of
    # |c1 v1| + |c2 v2| + |c3 v3| <= |v|, twice.
    assert (np.abs(found - wanted) <= 6 * U * np.linalg.norm(v_b, axis=1)[:, None]).all()
    scipys = from_form("quaternion", q_nb).apply(v_b)
    assert (np.abs(found - scipys) <= TURN * np.linalg.norm(v_b, axis=1)[:, None]).all()


def test_compose_is_scipys_product():
    a, b = random_turns(300, 1), random_turns(300, 2)
    found = rotation.compose(to_form("quaternion", a), to_form("quaternion", b))
    assert angle_between(from_form("quaternion", found), a * b).max() <= TURN


def test_conjugate_reverses():
    q_ab = random_quaternions(300)
    product = rotation.compose(rotation.conjugate(q_ab), q_ab)
    # Two norms of 4 U each, and the product's 4 U.
    assert np.abs(product - [1, 0, 0, 0]).max() <= 12 * U
    v = np.random.default_rng(8).standard_normal((300, 3))
    back = rotation.rotate(rotation.conjugate(q_ab), rotation.rotate(q_ab, v))
    # Each rotation: 5 U of a matrix entry, three of them met by |v|: sqrt 3, 3 U of the sums, and
    # the norm's 4 U, twice.
    bound = 2 * (5 * math.sqrt(3) + 3 + 2 * 4) * U
    assert (np.abs(back - v) <= bound * np.linalg.norm(v, axis=1)[:, None]).all()


# --- rotation_angle -----------------------------------------------------------------------


@pytest.mark.parametrize("angle", [1e-12, 1e-9, 1e-6, 1e-3, 1.0, 3.0, math.pi])
def test_rotation_angle_of_tiny_turns(angle):
    q_1 = random_quaternions(200, 1)
    axis = np.random.default_rng(2).standard_normal((200, 3))
    axis /= np.linalg.norm(axis, axis=1)[:, None]
    step = rotation.quaternion_from_rotation_vector(angle * axis)
    found = np.radians(rotation.rotation_angle(q_1, rotation.compose(q_1, step)))
    # In a component: norms are radial and their divisions U, three times; products 4 U, twice:
    # 11 U. Its vector, sqrt 3 of it, is felt twice. An arccosine would be wrong by 1e-8.
    # The size of the turn itself: exponential and logarithm, 20 U of it.
    assert np.abs(found - angle).max() <= (2 * math.sqrt(3) * 11 + 20 * angle) * U


@pytest.mark.parametrize("angle", [1e-100, 1e-30, 1e-12, 1e-5, 0.1, 2.0])
def test_rotation_angle_from_the_identity_keeps_its_relative_accuracy(angle):
    for axis in np.eye(3):
        q = rotation.quaternion_from_rotation_vector(angle * axis)
        found = rotation.rotation_angle([1.0, 0.0, 0.0, 0.0], q)
        # Exponential 6.5 U, two norms 4 U, logarithm 8.5 U, length 3 U, degrees 2 U.
        assert found == pytest.approx(math.degrees(angle), rel=28 * U, abs=0.0)


def test_rotation_angle_is_symmetric_and_blind_to_the_sign():
    a, b = random_quaternions(200, 1), random_quaternions(200, 2)
    angle = np.radians(rotation.rotation_angle(a, b))
    assert (
        np.abs(angle - angle_between(*(from_form("quaternion", q) for q in (a, b)))).max() <= TURN
    )
    assert np.abs(np.radians(rotation.rotation_angle(b, a)) - angle).max() <= TURN
    assert np.abs(np.radians(rotation.rotation_angle(a, -b)) - angle).max() <= TURN
    assert (angle <= math.pi * (1 + 8.5 * U)).all()


def test_rotation_angle_of_the_same_attitude_is_rounding():
    q = random_quaternions(200)
    # Nothing but the product's 4 U in three components, twice.
    assert np.radians(rotation.rotation_angle(q, q)).max() <= 2 * math.sqrt(3) * 4 * U
    assert np.radians(rotation.rotation_angle(q, -q)).max() <= 2 * math.sqrt(3) * 4 * U


# --- what is refused ----------------------------------------------------------------------

ONE = np.array([1.0, 0.0, 0.0, 0.0])
TAKERS = {
    **{f"{b}_from_{a}": (getattr(rotation, f"{b}_from_{a}"), a) for a, b in PAIRS},
    "conjugate": (rotation.conjugate, "quaternion"),
    "compose, first": (lambda q: rotation.compose(q, ONE), "quaternion"),
    "compose, second": (lambda q: rotation.compose(ONE, q), "quaternion"),
    "rotate, quaternion": (lambda q: rotation.rotate(q, [1.0, 2.0, 3.0]), "quaternion"),
    "rotate, vector": (lambda v: rotation.rotate(ONE, v), "rotation_vector"),
    "rotation_angle, first": (lambda q: rotation.rotation_angle(q, ONE), "quaternion"),
    "rotation_angle, second": (lambda q: rotation.rotation_angle(ONE, q), "quaternion"),
}
QUATERNION_TAKERS = [name for name, (_, form) in TAKERS.items() if form == "quaternion"]
MATRIX_TAKERS = [name for name, (_, form) in TAKERS.items() if form == "dcm"]


def refused(function, values, row=None):
    with pytest.raises(DataError) as caught:
        function(values)
    assert caught.value.finding.row == row
    if row is not None:
        assert f"row {row}" in str(caught.value)
    assert caught.value.finding.quantity
    return str(caught.value)


@pytest.mark.parametrize("name", TAKERS)
def test_a_wrong_shape_is_refused(name):
    function, form = TAKERS[name]
    width = SHAPES[form][-1]
    good = to_form(form, random_turns(2))
    for shape in ((), (width + 1,), (2, width - 1), (0, width + 1), (width, 2)):
        message = refused(function, np.ones(shape))
        assert str(shape) in message
        assert "Remedy" in message
    refused(function, good[..., :-1])
    if form == "dcm":
        refused(function, np.ones(3))
        refused(function, np.ones(9))
        refused(function, np.ones((3, 4)))


@pytest.mark.parametrize("name", TAKERS)
@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_a_value_that_is_not_finite_is_refused_and_its_row_named(name, value):
    function, form = TAKERS[name]
    values = to_form(form, random_turns(6))
    last = (-1,) * len(SHAPES[form])
    values[(3, *last)] = value
    assert "not a finite number" in refused(function, values, row=4)
    # In a stack the rows are counted through, last leading dimension fastest.
    refused(function, values.reshape((2, 3, *SHAPES[form])), row=4)
    refused(function, values[3], row=1)
    # The first bad row is the one named.
    values[1] = value
    refused(function, values, row=2)


@pytest.mark.parametrize("name", QUATERNION_TAKERS)
def test_a_quaternion_whose_norm_is_not_one_is_refused_and_its_row_named(name):
    function, _ = TAKERS[name]
    for scale, shown in ((2.0, "2"), (1.011, "1.011"), (0.989, "0.989"), (0.0, "0")):
        values = random_quaternions(5)
        values[2] *= scale
        message = refused(function, values, row=3)
        assert f"norm 1, not {shown}" in message
        assert "scalar first" in message
    values[4] *= 3.0
    refused(function, values, row=3)
    refused(function, 2.0 * random_quaternions(1)[0], row=1)


def test_the_message_says_which_of_two_arguments_is_wrong():
    assert "q_ab" in refused(lambda q: rotation.compose(q, ONE), 2 * ONE, row=1)
    assert "q_bc" in refused(lambda q: rotation.compose(ONE, q), 2 * ONE, row=1)
    assert "vector" in refused(lambda v: rotation.rotate(ONE, v), [0.0, math.nan, 0.0], row=1)
    assert "quaternion" in refused(lambda q: rotation.rotate(q, [1.0, 0.0, 0.0]), 2 * ONE, row=1)


@pytest.mark.parametrize("name", MATRIX_TAKERS)
def test_a_matrix_that_is_no_rotation_is_refused_and_its_row_named(name):
    function, _ = TAKERS[name]
    good = random_turns(5).as_matrix()
    shear = np.eye(3)
    shear[0, 1] = 0.02
    for spoil in (
        np.diag([1.0, 1.0, -1.0]),
        -np.eye(3),
        1.006 * np.eye(3),
        shear,
        np.zeros((3, 3)),
    ):
        values = good.copy()
        values[2] = values[2] @ spoil
        message = refused(function, values, row=3)
        assert "not a rotation" in message
        refused(function, values[2], row=1)
        values[4] = -values[4]
        refused(function, values, row=3)


def test_a_matrix_within_one_percent_is_accepted():
    good = random_turns(20).as_matrix()
    found = rotation.quaternion_from_dcm(1.004 * good)
    # Off by 0.4 % of length and by nothing in direction. The three small components grow by that,
    # and the largest, from 1 + trace, by less: by up to 0.004 less, in a vector of length 2 at
    # least. That is a turn of twice 0.002 rad at most.
    turn = angle_between(Rotation.from_matrix(good), from_form("quaternion", found))
    assert turn.max() <= 0.004


@pytest.mark.parametrize(
    "call",
    [
        lambda: rotation.compose(np.tile(ONE, (2, 1)), np.tile(ONE, (3, 1))),
        lambda: rotation.rotate(np.tile(ONE, (2, 1)), np.ones((3, 3))),
        lambda: rotation.rotation_angle(np.tile(ONE, (2, 1)), np.tile(ONE, (3, 1))),
    ],
    ids=["compose", "rotate", "rotation_angle"],
)
def test_leading_shapes_that_do_not_broadcast_are_refused(call):
    with pytest.raises(DataError):
        call()


def test_a_rotation_vector_whose_square_overflows_is_refused():
    q = rotation.quaternion_from_rotation_vector([1e149, 0.0, 0.0])
    assert abs(np.linalg.norm(q) - 1.0) <= 4 * U
    with pytest.raises(DataError, match="1e\\+150"):
        rotation.quaternion_from_rotation_vector([1e160, 0.0, 0.0])


# --- inputs -------------------------------------------------------------------------------


@pytest.mark.parametrize("name", TAKERS)
def test_inputs_are_never_mutated(name):
    function, form = TAKERS[name]
    values = to_form(form, random_turns(6))
    if form == "quaternion":
        values[::2] *= -1.003
    for given in (
        values,
        values[2],
        np.asfortranarray(values),
        values.reshape((2, 3, *SHAPES[form])),
    ):
        before = given.copy()
        function(given)
        assert np.array_equal(given, before)


def test_outputs_share_no_memory_with_inputs():
    q = random_quaternions(3)
    for out in (
        rotation.conjugate(q),
        rotation.compose(q, ONE),
        rotation.quaternion_from_dcm(rotation.dcm_from_quaternion(q)),
    ):
        assert not np.shares_memory(out, q)


def test_read_only_inputs_are_accepted():
    q = random_quaternions(3)
    q.flags.writeable = False
    r = random_turns(3).as_rotvec()
    r.flags.writeable = False
    assert rotation.rotate(q, r).shape == (3, 3)
    assert rotation.compose(q, q).shape == (3, 4)
    assert rotation.quaternion_from_rotation_vector(r).shape == (3, 4)


def test_every_public_name_is_exported_and_documented():
    for a, b in PAIRS:
        assert f"{b}_from_{a}" in rotation.__all__
    for name in rotation.__all__:
        assert getattr(rotation, name).__doc__


def test_cross_matrix_is_the_cross_product():
    v, u = np.random.default_rng(8).normal(size=(2, 5, 2, 3))
    assert np.array_equal(
        np.einsum("...ij,...j->...i", rotation.cross_matrix(v), u).round(14),
        np.cross(v, u).round(14),
    )
