"""The rotation kernels against 60 digits, on both sides of every switch-over.

U = 2^-53: one rounded operation is wrong by at most U of its result. A function of the math
library is granted one unit in the last place, at most 2 U of its value. Every bound below is
the sum of such roundings along the formula, each multiplied by how much of it the result
feels; "1 ulp of [a, b)" is the spacing of doubles in that interval.
"""

from __future__ import annotations

import itertools
import math

import mpmath
import numpy as np
import pytest

from strapdown._kernels import attitude as attitude_kernel
from strapdown._kernels import rotation as kernel

U = 2.0**-53
TINY = 5e-324

mp = mpmath.mp.clone()
mp.dps = 60

RNG_SEED = 20210


def exact(values):
    return [mp.mpf(float(v)) for v in values]


def steps_from(x, count):
    """Return `count` neighbouring doubles on each side of x, and x."""
    below, above = [x], [x]
    for _ in range(count):
        below.append(math.nextafter(below[-1], -math.inf))
        above.append(math.nextafter(above[-1], math.inf))
    return below[:0:-1] + above


def hamilton(a, b):
    """i^2 = j^2 = k^2 = ijk = -1, multiplied out term by term."""
    table = {
        (0, 0): (0, 1), (0, 1): (1, 1), (0, 2): (2, 1), (0, 3): (3, 1),
        (1, 0): (1, 1), (1, 1): (0, -1), (1, 2): (3, 1), (1, 3): (2, -1),
        (2, 0): (2, 1), (2, 1): (3, -1), (2, 2): (0, -1), (2, 3): (1, 1),
        (3, 0): (3, 1), (3, 1): (2, 1), (3, 2): (1, -1), (3, 3): (0, -1),
    }  # fmt: skip
    out = [mp.mpf(0)] * 4
    for (i, j), (unit, sign) in table.items():
        out[unit] += sign * a[i] * b[j]
    return out


def norm(values):
    return mp.sqrt(mp.fsum(v * v for v in values))


def sandwich(q):
    """Row by row, the matrix that turns v as q v q* does, for q of any length."""
    w, x, y, z = q
    n2 = mp.fsum(c * c for c in q)
    columns = []
    for axis in range(3):
        v = [mp.mpf(0)] * 4
        v[axis + 1] = mp.mpf(1)
        turned = hamilton(hamilton(q, v), [w, -x, -y, -z])
        columns.append([c / n2 for c in turned[1:]])
    return [columns[j][i] for i in range(3) for j in range(3)]


def exp_skew(r, order=160):
    """Row by row, the sum of [r x]^k / k! up to k = order: exp by its definition.

    For |r| <= 13 the terms past 160 are under 13^161 / 161! < 1e-107.
    """
    x, y, z = exact(r)
    skew = mp.matrix([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    total = mp.eye(3)
    term = mp.eye(3)
    for k in range(1, order + 1):
        term = term * skew / k
        total += term
    return [total[i, j] for i in range(3) for j in range(3)]


def exp_half(r, order):
    """Sum of (r/2)^k / k! up to k = order, as a power series of quaternions."""
    half = [mp.mpf(0)] + [c / 2 for c in exact(r)]
    total = [mp.mpf(1), mp.mpf(0), mp.mpf(0), mp.mpf(0)]
    term = list(total)
    for k in range(1, order + 1):
        term = [c / k for c in hamilton(term, half)]
        total = [a + b for a, b in zip(total, term, strict=True)]
    return total


def unit_quaternions(count, seed=RNG_SEED):
    q = np.random.default_rng(seed).standard_normal((count, 4))
    return q / np.linalg.norm(q, axis=1)[:, None]


def directions(count, seed=RNG_SEED):
    v = np.random.default_rng(seed).standard_normal((count, 3))
    return v / np.linalg.norm(v, axis=1)[:, None]


# --- half_angle: cos(x) and sin(x)/(2x) of u = x^2 ---------------------------------------


def half_angle_exact(u):
    x = mp.sqrt(mp.mpf(u))
    return mp.cos(x), (mp.sin(x) / x if u else mp.mpf(1)) / 2


SERIES_POINTS = [
    0.0,
    TINY,
    1e-320,
    2.2250738585072014e-308,
    1e-300,
    1e-100,
    1e-20,
    1e-16,
    1e-12,
    1e-8,
    1e-4,
    *np.random.default_rng(RNG_SEED).uniform(0.0, kernel.SERIES_LIMIT, 300),
    *steps_from(kernel.SERIES_LIMIT, 20)[:20],
]


def test_half_angle_below_the_switch_is_correct_to_one_rounding():
    # c = 1 - u p, where u <= 1/16 and p = 1/2 - ... was rounded three times at most (constant,
    # difference, and u's multiple): 3 U of u p <= 1/32. The last difference lies in [1/2, 1]:
    # half of 1 ulp there, U/2. The neglected u^7/14! is 5e-20. Sum: 0.6 U.
    # 2 s = 1 - u p with u p <= 1/96: 3 U/96 + U/2, and u^6/13! = 9.6e-18 = 0.09 U. Sum: 0.63 U.
    for u in SERIES_POINTS:
        assert u < kernel.SERIES_LIMIT
        c, s = kernel.half_angle(u)
        exact_c, exact_s = half_angle_exact(u)
        assert abs(c - exact_c) <= 0.63 * U
        assert abs(2 * s - 2 * exact_s) <= 0.63 * U


DIRECT_POINTS = [
    *steps_from(kernel.SERIES_LIMIT, 20)[20:],
    0.0626,
    0.1,
    0.5,
    1.0,
    *np.random.default_rng(RNG_SEED).uniform(kernel.SERIES_LIMIT, 40.0, 300),
    *steps_from((math.pi / 2) ** 2, 2),
    *steps_from(math.pi**2, 2),
    1e3,
    1e6,
]


def test_half_angle_above_the_switch_is_correct_to_the_rounding_of_the_angle():
    # The root is wrong by U x, which cos feels by x |sin x| U and sin(x) by x |cos x| U. Library:
    # cos 1 ulp of [1/2, 1) = U; sin 2 U of its value. The divisor and the division: U each of
    # the quotient, which the root's error reaches as U |cos x|.
    for u in DIRECT_POINTS:
        assert u >= kernel.SERIES_LIMIT
        c, s = kernel.half_angle(u)
        exact_c, exact_s = half_angle_exact(u)
        x = math.sqrt(u)
        assert abs(c - exact_c) <= U * (x * abs(math.sin(x)) + 1.0)
        assert abs(2 * s - 2 * exact_s) <= U * (abs(math.cos(x)) + 4.0 * abs(2 * s))


def test_half_angle_is_continuous_across_the_switch():
    # Below: 0.63 U, as derived above; on the limit x = 1/4 is exact, and cos and sin are the
    # library's, 1 ulp = U each. u moves by 7e-18, which neither value feels. Differences are
    # whole ulps of [1/2, 1), U apart: at most one.
    below = math.nextafter(kernel.SERIES_LIMIT, 0.0)
    c_below, s_below = kernel.half_angle(below)
    c_at, s_at = kernel.half_angle(kernel.SERIES_LIMIT)
    assert abs(c_below - c_at) <= U
    assert abs(2 * s_below - 2 * s_at) <= U


def test_half_angle_of_zero_and_of_subnormals_is_exact():
    for u in (0.0, TINY, 1e-310):
        assert kernel.half_angle(u) == (1.0, 0.5)


# --- the truncated series ----------------------------------------------------------------

# Lengths and components are short binary fractions, so that squares and their sums are exact.
DYADIC = [(1.5, -0.75, 0.5), (0.25, 0.5, -1.25), (0.0, 0.0, 1.0), (-1.0, 1.0, 1.0), (2.0, 0.0, 0.0)]


def c_terms(u, order):
    return [(k, (-mp.mpf(u)) ** (k // 2) / mp.factorial(k)) for k in range(2, order + 1, 2)]


def s_terms(u, order):
    return [(k, (-mp.mpf(u)) ** (k // 2) / mp.factorial(k)) for k in range(3, order + 1, 2)]


def half_angle_truncated_bound(terms):
    # Term k went through k divisions and k/2 products. Adding it to a partial sum in [0, 1]
    # rounds by U at most, or loses the term.
    return sum(1.5 * k * U * abs(t) + min(U, abs(t)) for k, t in terms)


@pytest.mark.parametrize("order", range(1, 9))
def test_half_angle_truncated_keeps_every_power_of_the_angle_up_to_its_order(order):
    for u in (0.0, TINY, 1e-9, 0.0625, 0.25, 0.3, 0.7, 1.0):
        c, s = kernel.half_angle_truncated(u, order)
        exact_c = 1 + mp.fsum(t for _, t in c_terms(u, order))
        exact_2s = 1 + mp.fsum(t for _, t in s_terms(u, order))
        assert abs(c - exact_c) <= half_angle_truncated_bound(c_terms(u, order))
        assert abs(2 * s - exact_2s) <= half_angle_truncated_bound(s_terms(u, order))


@pytest.mark.parametrize("order", range(1, 9))
def test_truncated_increment_is_the_power_series_of_the_quaternion_exponential(order):
    for r in DYADIC:
        u = 0.25 * (r[0] ** 2 + r[1] ** 2 + r[2] ** 2)
        c, s = kernel.half_angle_truncated(u, order)
        found = (c, s * r[0], s * r[1], s * r[2])
        wanted = exp_half(r, order)
        assert abs(found[0] - wanted[0]) <= half_angle_truncated_bound(c_terms(u, order))
        bound = half_angle_truncated_bound(s_terms(u, order)) / 2
        for i in range(3):
            # One product more than s itself.
            assert abs(found[i + 1] - wanted[i + 1]) <= bound * abs(r[i]) + U * abs(found[i + 1])


def test_truncated_at_order_20_agrees_with_the_exact_half_angle_up_to_one_radian():
    # What order 20 neglects is (1/2)^21 / 21! < 1e-26. half_angle's own bound is at most that
    # of its branch above the switch, for x <= 1/2: U (x sin x + 1) <= 1.24 U for the cosine,
    # and U (cos x + 4) <= 5 U for 2 s.
    for u in (0.0, TINY, 1e-12, *np.linspace(0.0, 0.25, 101), *steps_from(kernel.SERIES_LIMIT, 2)):
        c, s = kernel.half_angle_truncated(u, 20)
        limit_c, limit_s = kernel.half_angle(u)
        assert abs(c - limit_c) <= half_angle_truncated_bound(c_terms(u, 20)) + 1.24 * U
        assert abs(2 * s - 2 * limit_s) <= half_angle_truncated_bound(s_terms(u, 20)) + 5.0 * U


def dcm_terms(n2, order):
    a = [(k, (-mp.mpf(n2)) ** k / mp.factorial(2 * k + 1)) for k in range(1, (order + 1) // 2)]
    b = [(k, (-mp.mpf(n2)) ** k / mp.factorial(2 * k + 2)) for k in range(1, order // 2)]
    return a, b


def dcm_coefficient_bound(terms):
    # Each factor of a term is a quotient and a product: 2 U. Adding to a partial sum in [0, 1]
    # rounds by U at most, or loses the term.
    return sum(2.0 * k * U * abs(t) + min(U, abs(t)) for k, t in terms)


@pytest.mark.parametrize("order", range(1, 9))
def test_dcm_coefficients_truncated_are_those_of_exp_up_to_their_order(order):
    for n2 in (0.0, TINY, 1e-9, 0.25, 0.7, 1.0, 2.5, 4.0):
        a, b = kernel.dcm_coefficients_truncated(n2, order)
        a_terms, b_terms = dcm_terms(n2, order)
        first_b = mp.mpf("0.5") if order >= 2 else mp.mpf(0)
        assert abs(a - 1 - mp.fsum(t for _, t in a_terms)) <= dcm_coefficient_bound(a_terms)
        assert abs(b - first_b - mp.fsum(t for _, t in b_terms)) <= dcm_coefficient_bound(b_terms)


@pytest.mark.parametrize("order", range(1, 9))
def test_truncated_dcm_is_the_sum_of_the_powers_of_the_skew_matrix_up_to_its_order(order):
    for r in DYADIC:
        x, y, z = r
        n2 = x * x + y * y + z * z
        a, b = kernel.dcm_coefficients_truncated(n2, order)
        found = kernel.dcm_from_coefficients(x, y, z, a, b)
        wanted = exp_skew(r, order)
        a_terms, b_terms = dcm_terms(n2, order)
        a_bound, b_bound = dcm_coefficient_bound(a_terms), dcm_coefficient_bound(b_terms)
        for i, j in itertools.product(range(3), repeat=2):
            # Sums of squares are exact here. Off the diagonal: b x y has 2 products, a z one,
            # and their sum one rounding; on it: b times the sum one, and the difference one.
            square = n2 - r[i] ** 2 if i == j else abs(r[i] * r[j])
            lever = 0.0 if i == j else abs(r[3 - i - j])
            entry = found[3 * i + j]
            bound = (b_bound + 2 * U * abs(b)) * square + (a_bound + U * abs(a)) * lever
            assert abs(entry - wanted[3 * i + j]) <= bound + U * abs(entry)


def test_dcm_coefficients_at_order_20_agree_with_the_half_angle_up_to_one_radian():
    # a = 2 c s with c to 1.24 U and 2 s to 5 U (above), b = 2 s^2 to twice 5 U of 1/2, and one
    # or two products more; what order 20 neglects is under 1/21! = 2e-20.
    for n2 in (0.0, 1e-12, *np.linspace(0.0, 1.0, 101), *steps_from(4 * kernel.SERIES_LIMIT, 2)):
        a, b = kernel.dcm_coefficients_truncated(n2, 20)
        c, s = kernel.half_angle(0.25 * n2)
        a_terms, b_terms = dcm_terms(n2, 20)
        assert abs(a - 2.0 * c * s) <= dcm_coefficient_bound(a_terms) + 7.24 * U
        assert abs(b - 2.0 * s * s) <= dcm_coefficient_bound(b_terms) + 5.5 * U


# --- rotvec_from_quat ---------------------------------------------------------------------


def log_exact(q):
    w, x, y, z = exact(q)
    if w < 0:
        w, x, y, z = -w, -x, -y, -z
    v = norm([x, y, z])
    return [2 * mp.atan2(v, w) / v * c for c in (x, y, z)]


def assert_logarithm(q, bound):
    for found, wanted in zip(kernel.rotvec_from_quat(*q), log_exact(q), strict=True):
        # A product that ends among the subnormals is rounded to their grid.
        assert abs(found - wanted) <= bound * abs(wanted) + TINY


def half_turned(h, direction):
    return (math.cos(h), *(math.sin(h) * direction))


SWITCH = math.sqrt(kernel.ATAN_SERIES_LIMIT)

# |v|: the largest of a, b, c is exactly 1, the others carry 3 U in their squares, sums 2 U, all
# halved by the root, then root and product: 4.5 U. atan2 feels that by w |v| / (|q|^2 angle) <= 1
# of it, and the division by |v| takes it back in part: 4.5 U in the quotient. atan2 itself
# 2 U, division U, last product U.
DIRECT_LOG = 8.5 * U
# Here |v| matters by t/3 < 4e-7 of its error only. 1 - t/3: U/2; division U; product U; and
# the neglected t^3/7 = 1.4e-19.
SERIES_LOG = 2.51 * U


def test_logarithm_below_the_switch_keeps_relative_accuracy():
    halves = [1e-300, 1e-160, 1e-100, 1e-20, 1e-10, 1e-6, 1e-4, 5e-4, 9.9e-4, 0.999999 * SWITCH]
    for h, direction in itertools.product(halves, directions(25)):
        assert_logarithm(half_turned(h, direction), SERIES_LOG)


def test_logarithm_above_the_switch_keeps_relative_accuracy():
    halves = [1.000001 * SWITCH, 1.1e-3, 0.01, 0.3, 0.8, 1.2, 1.5, 1.57]
    halves += [math.pi / 2 - 1e-8, math.pi / 2 - 1e-15, math.pi / 2]
    for h, direction in itertools.product(halves, directions(25)):
        assert_logarithm(half_turned(h, direction), DIRECT_LOG)


def test_logarithm_on_the_switch_itself_is_accurate_and_continuous():
    # With q = (1, x, 0, 0) the length is x exactly, and the switch is where x^2 crosses the limit.
    line = steps_from(SWITCH, 20)
    assert line[0] ** 2 < kernel.ATAN_SERIES_LIMIT < line[-1] ** 2
    found = [kernel.rotvec_from_quat(1.0, x, 0.0, 0.0)[0] for x in line]
    for x in line:
        assert_logarithm((1.0, x, 0.0, 0.0), DIRECT_LOG)
    # Neighbouring arguments differ by at most 2 U. With |v| exact, the upper branch has atan2,
    # division and product, 4 U, and the lower 2.51 U.
    for low, high in itertools.pairwise(found):
        assert abs(high - low) <= (2.0 + 4.0 + 2.51) * U * high


def test_logarithm_of_a_negative_scalar_part_is_that_of_the_opposite_quaternion():
    for q in [*unit_quaternions(100), (1.0, 1e-5, 0.0, 0.0), (0.0, 0.6, 0.8, 0.0)]:
        up = tuple(-c for c in q) if q[0] < 0 else tuple(q)
        down = tuple(-c for c in up)
        if up[0] > 0:
            assert kernel.rotvec_from_quat(*down) == kernel.rotvec_from_quat(*up)
        assert_logarithm(down, DIRECT_LOG)


def test_logarithm_of_a_pure_vector_quaternion_is_half_a_turn_about_it():
    for w, direction in itertools.product((0.0, -0.0), directions(50)):
        assert_logarithm((w, *direction), DIRECT_LOG)
    assert kernel.rotvec_from_quat(0.0, 0.0, 1.0, 0.0) == (0.0, math.pi, 0.0)


def test_logarithm_is_never_longer_than_half_a_turn():
    # The length feels the three components' 8.5 U, and the double pi lies under pi.
    for q in [
        *unit_quaternions(200),
        *((w, *d) for w in (TINY, 1e-300, 0.0) for d in directions(20)),
    ]:
        assert norm(exact(kernel.rotvec_from_quat(*q))) <= mp.pi * (1 + DIRECT_LOG)


def test_logarithm_of_no_rotation_is_zero():
    for w in (1.0, -1.0, 0.99):
        assert kernel.rotvec_from_quat(w, 0.0, 0.0, 0.0) == (0.0, 0.0, 0.0)
        assert kernel.rotvec_from_quat(w, -0.0, 0.0, 0.0) == (0.0, 0.0, 0.0)


def test_logarithm_of_tiny_components_is_twice_them():
    # Doubling is exact, and 1 - t/3 rounds to one.
    for scale in (1e-200, 1e-160, 1e-300):
        x, y, z = scale, -2.0 * scale, 3.0 * scale
        assert kernel.rotvec_from_quat(1.0, x, y, z) == (2 * x, 2 * y, 2 * z)
    assert kernel.rotvec_from_quat(1.0, TINY, 0.0, -3 * TINY) == (2 * TINY, 0.0, -6 * TINY)
    assert kernel.rotvec_from_quat(1.0, 0.0, 1e-310, 0.0) == (0.0, 2e-310, 0.0)


def test_logarithm_with_one_tiny_component_keeps_it():
    # k x is one product of the tiny one, as of the others.
    for q in [(math.cos(1.0), math.sin(1.0), 1e-200, 0.0), (math.cos(1e-4), 0.0, 1e-4, 1e-200)]:
        assert_logarithm(q, DIRECT_LOG)


# --- the exponentials ---------------------------------------------------------------------


def exponential_lengths():
    switch = 2.0 * math.sqrt(kernel.SERIES_LIMIT)
    return [
        1e-9,
        1e-3,
        0.1,
        0.4,
        *(switch * (1 + k * 4 * U) for k in (-3, -1, 0, 1, 3)),
        0.6,
        1.5,
        3.0,
        math.pi,
        5.0,
        2 * math.pi,
        9.0,
        12.5,
    ]


def test_matrix_exponential_is_correct_on_both_sides_of_the_switch():
    for n, direction in itertools.product(exponential_lengths(), directions(4)):
        r = n * direction
        found = kernel.dcm_from_rotvec(*r)
        # The square of the angle carries 3 U, its root U more: the angle is wrong by 2.5 U |r|,
        # and every entry turns by no more. The rounding of cos is U, which sin(h) scales twice;
        # s = sin(h)/(2h) has 2 U from sin, U from the division, 2.5 U from the divisor: 5.5 U.
        # a z: 5.5 U + 2 products of sin(n); b: 11 U + a product; b (y^2 + z^2): three more, of
        # 1 - cos(n). Last sum: U.
        turn = 1.0 - math.cos(n)
        bound = 2.5 * n + 2 * abs(math.sin(n / 2)) + 7.5 * abs(math.sin(n)) + 15.0 * turn + 1.0
        for entry, wanted in zip(found, exp_skew(r), strict=True):
            assert abs(entry - wanted) <= U * bound


def test_matrix_exponential_of_a_small_turn_keeps_the_relative_accuracy_of_each_angle():
    # u < 1e-10 is felt by nobody: c and 2 s are 1 to half an ulp, U/2 each; product 2 c s: U;
    # times z: U; sum with b x y: U. Together 4 U. b x y <= n^2/4 carries 4 U, and may hide as much
    # of a z in the sum, with its 3 U: under 2 U n^2.
    for n, direction in itertools.product((1e-5, 1e-9, 1e-100, 1e-300), directions(10)):
        x, y, z = r = n * direction
        found = kernel.dcm_from_rotvec(x, y, z)
        wanted = exp_skew(r, 12)
        for at in (1, 2, 3, 5, 6, 7):
            assert abs(found[at] - wanted[at]) <= 4.0 * U * abs(wanted[at]) + 2.0 * U * n * n


def test_exponentials_of_zero_are_exactly_the_identity():
    assert kernel.dcm_from_rotvec(0.0, 0.0, 0.0) == (1, 0, 0, 0, 1, 0, 0, 0, 1)
    assert kernel.quat_from_rotvec(0.0, 0.0, 0.0) == (1.0, 0.0, 0.0, 0.0)


def test_quaternion_exponential_is_correct_on_both_sides_of_the_switch():
    for n, direction in itertools.product(exponential_lengths(), directions(10)):
        r = n * direction
        half = norm(exact(r)) / 2
        wanted = [mp.cos(half), *(mp.sin(half) / (2 * half) * c for c in exact(r))]
        found = kernel.quat_from_rotvec(*r)
        # The half angle is wrong by 2.5 U of it; cos by 1 ulp = U more; sin(h)/h by 2 U + U +
        # 2.5 U, and a product.
        h = n / 2
        assert abs(found[0] - wanted[0]) <= U * (2.5 * h * abs(math.sin(h)) + 1.0)
        for i in range(3):
            bound = U * (2.5 * h * abs(math.cos(h)) + 6.5 * abs(math.sin(h)))
            assert abs(found[i + 1] - wanted[i + 1]) <= bound * abs(direction[i])


def test_quaternion_exponential_keeps_tiny_vectors():
    # s is 1/2 exactly, and halving is exact.
    for n in (1e-200, 1e-160, 1e-300):
        assert kernel.quat_from_rotvec(n, -2 * n, 4 * n) == (1.0, n / 2, -n, 2 * n)


# --- products and matrices ----------------------------------------------------------------


def test_product_of_the_units_is_hamiltons():
    units = np.eye(4)
    for a, b in itertools.product(units, repeat=2):
        assert kernel.quat_multiply(*a, *b) == tuple(float(c) for c in hamilton(a, b))


def test_product_is_rounded_four_times():
    # Each of the four terms meets its own product and up to three sums; their sizes add up to
    # at most one (Cauchy-Schwarz).
    for a, b in zip(unit_quaternions(200, 1), unit_quaternions(200, 2), strict=True):
        wanted = hamilton(exact(a), exact(b))
        for found, component in zip(kernel.quat_multiply(*a, *b), wanted, strict=True):
            assert abs(found - component) <= 4.0 * U


def test_matrix_of_a_quaternion_turns_as_the_sandwich_product_does():
    for q in unit_quaternions(200):
        n2 = mp.fsum(c * c for c in exact(q))
        # 2 (y^2 + z^2) <= 2 is rounded twice and the difference from one once: 5 U. The formula
        # takes |q|^2 for one, which 2 (y^2 + z^2) feels by twice the deviation.
        bound = 5.0 * U + 2 * abs(n2 - 1)
        for found, wanted in zip(kernel.dcm_from_quat(*q), sandwich(exact(q)), strict=True):
            assert abs(found - wanted) <= bound


# The matrix arrives rounded: U/2 in each entry. Twice-four products of the largest component
# (4 w x and so on, at most 2): two entries and a difference, 3 U each. 4 w^2 = 1 + trace: three
# entries 1.5 U, sums of at most 2, 3 and 4: 9 U. As a vector sqrt(10.5^2 + 3 * 3^2) U = 11.7 U on
# a length of at least 2: 5.9 U. Normalising: four squares and their sums 4 U, halved by the root,
# root U, reciprocal U, product U: 5 U.
SHEPPERD = 10.9 * U


def assert_quaternion_of_matrix(q):
    length = norm(q)
    q = [c / length for c in q]
    matrix = [float(c) for c in sandwich(q)]
    found = kernel.quat_from_dcm(*matrix)
    sign = mp.sign(mp.fsum(a * b for a, b in zip(found, q, strict=True)))
    assert norm([a - sign * b for a, b in zip(found, q, strict=True)]) <= SHEPPERD
    return matrix


@pytest.mark.parametrize("largest", range(4), ids=["w", "x", "y", "z"])
def test_quaternion_of_a_matrix_from_each_of_its_four_branches(largest):
    rng = np.random.default_rng(largest)
    for _ in range(60):
        q = rng.uniform(-0.9, 0.9, 4)
        q[largest] = rng.choice([-1.0, 1.0])
        m = assert_quaternion_of_matrix(exact(q))
        # The branch that ran is the one meant.
        assert int(np.argmax([m[0] + m[4] + m[8], m[0], m[4], m[8]])) == largest


def test_quaternion_of_a_matrix_where_two_or_more_branches_meet():
    for signs in itertools.product((-1.0, 1.0), repeat=3):
        assert_quaternion_of_matrix(exact((1.0, *signs)))
        for i in range(4):
            near = [1.0, *signs]
            near[i] *= 1 + 1e-15
            assert_quaternion_of_matrix(exact(near))
    for i, j in itertools.combinations(range(4), 2):
        for nudge in (-1e-15, 0.0, 1e-15):
            q = [0.0] * 4
            q[i], q[j] = 1.0 + nudge, -1.0
            assert_quaternion_of_matrix(exact(q))


def test_quaternion_of_a_half_turn_is_exactly_its_axis():
    for axis in range(3):
        c = -np.ones(3)
        c[axis] = 1.0
        wanted = np.zeros(4)
        wanted[axis + 1] = 1.0
        found = np.array(kernel.quat_from_dcm(*np.diag(c).ravel()))
        assert np.array_equal(found * np.sign(found[axis + 1]), wanted)


def test_quaternion_of_a_small_turn_keeps_the_angle_that_the_matrix_holds():
    # An arccosine of the trace would return zero.
    for angle in (1e-9, 1e-12, 1e-100):
        w, x, y, z = kernel.quat_from_dcm(1.0, -angle, 0.0, angle, 1.0, 0.0, 0.0, 0.0, 1.0)
        # 2 angle / 4, scaled by the square root of 16: exact but for the last reciprocal,
        # its root and product.
        assert (w, x, y) == (1.0, 0.0, 0.0)
        assert z == pytest.approx(angle / 2, rel=3 * U)


# --- Euler angles -------------------------------------------------------------------------


def euler_exact(q):
    """Textbook arctangents of the matrix entries; 60 digits leave enough at every pitch."""
    w, x, y, z = exact(q)
    level = 2 * (y * z + w * x), w * w - x * x - y * y + z * z
    return (
        mp.atan2(*level),
        mp.atan2(2 * (w * y - x * z), mp.hypot(*level)),
        mp.atan2(2 * (x * y + w * z), w * w + x * x - y * y - z * z),
    )


def quat_of_euler_exact(roll, pitch, heading):
    zero = mp.mpf(0)
    r, p, h = (mp.mpf(angle) / 2 for angle in (roll, pitch, heading))
    return hamilton(
        hamilton([mp.cos(h), zero, zero, mp.sin(h)], [mp.cos(p), zero, mp.sin(p), zero]),
        [mp.cos(r), mp.sin(r), zero, zero],
    )


def apart(a, b):
    """Return the distance of two angles on the circle."""
    return abs(a - b - 2 * mp.pi * mp.nint((a - b) / (2 * mp.pi)))


# Half sum and half difference: both arguments are rounded once, which turns the angle by U at
# most; atan2 1 ulp of [2, 4) = 4 U. Two of them: 10 U; their sum lies under 2 pi: 4 U; wrapping
# takes off a 2 pi that is wrong by 2.45e-16 = 2.2 U, and rounds by 2 U.
EULER_TURN = 18.2 * U
# up and down: arguments U, hypot 2 U, so 6 U in the ratio and 3 U in its arctangent; atan2 1 ulp of
# [1, 2) = 2 U; doubled: 10 U. The double pi/2 is wrong by 0.55 U; the difference U.
EULER_PITCH = 11.6 * U


def assert_euler(q):
    roll, pitch, heading = kernel.euler_from_quat(*q)
    wanted = euler_exact(q)
    assert -math.pi < roll <= math.pi
    assert -math.pi < heading <= math.pi
    assert -math.pi / 2 <= pitch <= math.pi / 2
    assert apart(roll, wanted[0]) <= EULER_TURN
    assert abs(pitch - wanted[1]) <= EULER_PITCH
    assert apart(heading, wanted[2]) <= EULER_TURN


def test_euler_angles_of_random_attitudes():
    for q in unit_quaternions(400):
        assert_euler(q)


@pytest.mark.parametrize("side", [-1, 1])
@pytest.mark.parametrize("distance", [0.1, 1e-3, 1e-6, 1e-9, 1e-12, 3e-14])
def test_euler_angles_near_the_pole_are_as_accurate_as_elsewhere(side, distance):
    # down = sqrt(2) sin(distance / 2): at 3e-14 it is twice GIMBAL_LOCK. The quaternion is
    # rounded to doubles first; these doubles are what the angles are asked of.
    for roll, heading in itertools.product((-3.1, -1.0, 0.0, 0.7, 2.9), (-2.0, 0.0, 1.3, 3.1)):
        pitch = side * (mp.pi / 2 - mp.mpf(distance))
        q = [float(c) for c in quat_of_euler_exact(roll, pitch, heading)]
        assert_euler(q)
        assert_euler([-c for c in q])


@pytest.mark.parametrize("side", [-1, 1])
def test_at_the_pole_roll_is_zero_and_heading_takes_the_whole_turn(side):
    # w = y and z = -x (pitch up), or w = -y and z = x: exactly the pole.
    for phi in (*np.linspace(-3.1, 3.1, 41), 0.0, math.pi / 4, math.pi / 2):
        c, s = math.sqrt(0.5) * math.cos(phi), math.sqrt(0.5) * math.sin(phi)
        q = (c, -side * s, side * c, s)
        roll, pitch, heading = kernel.euler_from_quat(*q)
        assert roll == 0.0
        assert pitch == side * math.pi / 2
        # heading -+ roll = 2 phi. atan2 of exact doubles 4 U, doubled, and the wrap as above.
        wanted = 2 * mp.atan2(mp.mpf(s), mp.mpf(c))
        assert apart(heading, wanted) <= (8.0 + 4.0 + 2.2 + 2.0) * U
        assert -math.pi < heading <= math.pi


@pytest.mark.parametrize("side", [-1, 1])
def test_the_lock_begins_where_it_says(side):
    # Pitch up: w - y = gap and z + x = 0, so down = gap, the half sum is 0 and the half difference
    # atan2(sqrt(2), 0) = pi/2. Pitch down: the same of up, with both halves exchanged.
    for gap, locked in ((0.99 * kernel.GIMBAL_LOCK, True), (1.01 * kernel.GIMBAL_LOCK, False)):
        large = math.sqrt(0.5)
        q = (gap / 2, -side * large, -side * gap / 2, large)
        roll, _, heading = kernel.euler_from_quat(*q)
        assert (roll == 0.0) is locked
        if locked:
            assert apart(heading, mp.pi) <= EULER_TURN
        else:
            assert_euler(q)


def test_pitch_beyond_the_pole_comes_back_on_the_other_side():
    q = kernel.quat_from_euler(0.0, math.radians(100.0), 0.0)
    roll, pitch, heading = kernel.euler_from_quat(*q)
    assert_euler(q)
    # The quaternion's four components carry 9 U each (below), 18 U together: a turn of 36 U,
    # which roll and heading feel divided by cos(pitch).
    assert abs(pitch - math.radians(80.0)) <= EULER_PITCH + 36.0 * U
    bound = EULER_TURN + 36.0 * U / math.cos(math.radians(80.0))
    assert apart(roll, mp.pi) <= bound
    assert apart(heading, mp.pi) <= bound


def test_quaternion_of_euler_angles_is_heading_then_pitch_then_roll():
    rng = np.random.default_rng(RNG_SEED)
    # Cosine and sine 2 U each, three factors 6 U, two products 2 U; the sizes of both terms add
    # up to one at most; their sum U.
    for angles in rng.uniform(-7.0, 7.0, (200, 3)):
        found = kernel.quat_from_euler(*angles)
        for component, wanted in zip(found, quat_of_euler_exact(*angles), strict=True):
            assert abs(component - wanted) <= 9.0 * U


# --- wrap_pi ------------------------------------------------------------------------------


def test_wrap_leaves_angles_in_range_untouched():
    above_minus_pi = math.nextafter(-math.pi, 0.0)
    for angle in (0.0, TINY, 1.0, -3.0, math.pi, math.nextafter(math.pi, 0.0), above_minus_pi):
        assert kernel.wrap_pi(angle) == angle
    assert math.copysign(1.0, kernel.wrap_pi(-0.0)) == -1.0


def test_wrap_takes_minus_pi_to_pi():
    assert kernel.wrap_pi(-math.pi) == math.pi


def test_wrap_moves_by_whole_turns():
    rng = np.random.default_rng(RNG_SEED)
    for angle in [*rng.uniform(-7.0, 7.0, 200), *rng.uniform(-1e4, 1e4, 200), 1e9 / 7]:
        wrapped = kernel.wrap_pi(angle)
        # The double 2 pi is wrong by 0.35 U of it, and its multiple by U; the difference, at
        # most pi, by 2 U.
        assert apart(wrapped, mp.mpf(angle)) <= 1.35 * U * (abs(angle) + math.pi) + 2.0 * U


def test_wrap_of_one_turn_more_stays_in_range_at_the_seam():
    # Differences and sums of two half turns, as euler_from_quat makes them.
    seam = [math.pi, -math.pi, 2 * math.pi, -2 * math.pi]
    for angle in itertools.chain.from_iterable(steps_from(a, 10) for a in seam):
        assert -math.pi < kernel.wrap_pi(angle) <= math.pi


def test_wrap_stays_in_range_at_every_seam():
    odd = [(2 * n + 1) * math.pi for n in range(-1000, 1000)]
    for angle in itertools.chain.from_iterable(steps_from(a, 3) for a in odd):
        assert -math.pi < kernel.wrap_pi(angle) <= math.pi


def test_wrap_brings_every_finite_angle_into_range():
    for angle in (1e9, -1e12, 1e17, -1e17, 1e300, -1e300):
        assert -math.pi < kernel.wrap_pi(angle) <= math.pi


# --- orthogonalise ------------------------------------------------------------------------


def loss(matrix):
    """C^T C - I of the doubles in `matrix`, exactly."""
    m = mp.matrix([[mp.mpf(float(v)) for v in row] for row in np.reshape(matrix, (3, 3))])
    return m.T * m - mp.eye(3)


def spectral(symmetric):
    return max(abs(v) for v in mp.eigsy(symmetric, eigvals_only=True))


def disturbed(scale, seed):
    rng = np.random.default_rng(seed)
    turn = np.array(kernel.dcm_from_quat(*unit_quaternions(1, seed)[0])).reshape(3, 3)
    return turn + scale * rng.uniform(-1.0, 1.0, (3, 3))


# A factor S = (3 I - C^T C)/2: on the diagonal three squares and their sums 3 U of one, halved,
# and the difference U: 2.5 U; off it 1.5 U. An entry of C S: 2.5 U + 1.5 U sqrt(2), and product and
# sums 3 U of it: 8 U. Nine of them: 24 U in the Frobenius norm, which C^T C feels twice.
NEWTON_ENTRY = 8.0 * U
NEWTON_LOSS = 48.0 * U


@pytest.mark.parametrize("scale", [1e-1, 1e-2, 1e-3, 1e-5, 1e-7])
def test_orthogonalise_squares_the_loss(scale):
    # With E = C^T C - I one Newton step leaves exactly -3/4 E^2 + 1/4 E^3.
    for seed in range(5):
        state = disturbed(scale, seed).ravel()
        before = loss(state)
        attitude_kernel.orthogonalise(state)
        after = loss(state)
        size = spectral(before)
        assert size > scale / 10
        wanted = -before * before * 3 / 4 + before * before * before / 4
        # Entries beyond one scale the rounding with them; 1.3 covers a disturbance of 0.1.
        assert spectral(after - wanted) <= (1.3 if scale > 0.01 else 1.05) * NEWTON_LOSS
        assert spectral(after) <= size**2 + NEWTON_LOSS


def orthogonal_factor(state):
    """Return the rotation nearest to C, by Newton's iteration C <- (C + C^-T) / 2."""
    m = mp.matrix([[mp.mpf(float(v)) for v in row] for row in np.reshape(state, (3, 3))])
    # From a disturbance of 1e-2 each step squares it: 2^7 times two digits.
    for _ in range(7):
        m = (m + (m**-1).T) / 2
    return m


def test_orthogonalise_turns_the_matrix_by_nothing():
    # C S with S symmetric has the orthogonal factor of C; what is left is the step's rounding.
    for scale, seed in itertools.product((1e-2, 1e-4), range(5)):
        state = disturbed(scale, seed).ravel()
        before = orthogonal_factor(state)
        attitude_kernel.orthogonalise(state)
        assert norm(orthogonal_factor(state) - before) <= 3.0 * NEWTON_ENTRY


def test_orthogonalise_leaves_a_rotation_where_it_is():
    for seed in range(20):
        state = disturbed(0.0, seed).ravel()
        before = state.copy()
        # dcm_from_quat rounds its entries by 5 U and takes |q|^2 for one (4 U): the loss is under
        # 2 sqrt(3) times that, and the step takes off half of it.
        attitude_kernel.orthogonalise(state)
        assert np.abs(state - before).max() <= math.sqrt(3) * (5 + 2 * 4) * U + NEWTON_ENTRY


def test_orthogonalise_touches_the_nine_entries_only():
    state = np.append(disturbed(1e-3, 0).ravel(), [7.0, 9.0])
    attitude_kernel.orthogonalise(state)
    assert np.array_equal(state[9:], [7.0, 9.0])


@pytest.mark.parametrize(
    ("turn", "heading"),
    [(0.0, 0.0), (90.0, 90.0), (-90.0, 270.0), (179.0, 179.0), (-1e-3, 359.999), (-1e-15, 0.0)],
)
def test_a_heading_in_degrees_is_at_least_zero_and_below_360(turn, heading):
    half = 0.5 * math.radians(turn)
    q = math.cos(half), 0.0, 0.0, math.sin(half)
    told = kernel.euler_degrees_from_quat(*q)
    # Rounding of an angle up to pi, in degrees, twice.
    assert told == pytest.approx((0.0, 0.0, heading), abs=2.0 * 360.0 * U)
    assert 0.0 <= told[2] < 360.0
