"""The kernels of motion increments against many digits, and their two faces against each other."""

from __future__ import annotations

import math

import mpmath
import numpy as np
import pytest

from strapdown._kernels import motion_increments as kernel

U = 2.0**-53
mp = mpmath.mp.clone()
mp.dps = 50


def steps_from(x, count):
    """Return `count` neighbouring doubles on each side of x, and x."""
    below, above = [x], [x]
    for _ in range(count):
        below.append(math.nextafter(below[-1], -math.inf))
        above.append(math.nextafter(above[-1], math.inf))
    return below[:0:-1] + above


def exact_coefficients(u):
    n = mp.sqrt(mp.mpf(u))
    if n == 0:
        return mp.mpf(1) / 2, mp.mpf(1) / 6, mp.mpf(1) / 24
    # 50 digits, of which the last difference loses 4 at 0.01 rad and all under 1e-12.
    if n < mp.mpf("1e-6"):
        v = n * n
        return 1 / mp.mpf(2) - v / 24, 1 / mp.mpf(6) - v / 120, 1 / mp.mpf(24) - v / 720
    return (1 - mp.cos(n)) / n**2, (n - mp.sin(n)) / n**3, (n**2 / 2 - 1 + mp.cos(n)) / n**4


LIMIT = kernel.SERIES_LIMIT
RNG = np.random.default_rng(7)
SMALL = [0.0, 5e-324, 1e-300, 1e-20, 1e-13, 1e-6, *RNG.uniform(0.0, LIMIT, 200)]
SMALL += steps_from(LIMIT, 20)[:20]
LARGE = [*steps_from(LIMIT, 20)[20:], *RNG.uniform(LIMIT, 1.0, 200), 4.0, math.pi**2, 12.0, 36.0]


@pytest.mark.parametrize("which", range(3))
def test_below_the_switch_the_coefficients_are_correct_to_three_roundings(which):
    # d and the sum beside it: a constant, a difference and a sum, rounded by U of the value at
    # most each; their other terms are under u/16 = 1/250 of them, of a few U: 3.1 U in all. The
    # neglected u^5 24/14! is 3e-16 U. b and c hold a sixteenth of that, and two of theirs.
    for u in SMALL:
        found, true = kernel.integral_coefficients(u)[which], exact_coefficients(u)[which]
        assert abs(found - true) <= 3.2 * U * true


def test_above_the_switch_what_they_multiply_is_correct_to_rounding():
    # b = 2 s^2: s is wrong by 2 U of the library, the root's U (felt at most once here) and
    # the division's U, hence b by 8 U and 2 U of its products. 2 k s is wrong by 6 U likewise
    # (n up to 6: k feels the root by n/2 <= 3 U), and u c = 1 - 2 k s in all by 12 U;
    # u d = 1/2 - b by 10 U of b <= 1/2. They act as b n, c n^2, d n^2.
    for u in LARGE:
        found, true = kernel.integral_coefficients(u), exact_coefficients(u)
        assert abs(found[0] - true[0]) <= 10 * U * true[0] + 3 * U * (u > 4.0)
        assert u * abs(found[1] - true[1]) <= 12 * U
        assert u * abs(found[2] - true[2]) <= 8 * U


def matrix(x):
    """A of the extended pose, 5 by 5, of w, f and one of time."""
    w, f = x[:3], x[3:]
    a = mp.matrix(5)
    a[0, 1], a[0, 2], a[1, 2] = -w[2], w[1], -w[0]
    a[1, 0], a[2, 0], a[2, 1] = w[2], -w[1], w[0]
    for i in range(3):
        a[i, 3] = f[i]
    a[3, 4] = mp.mpf(1)
    return a


def flow(dt, values, terms=40):
    """X at dt of X' = X A(t), A's numbers being polynomials in t: its power series, summed."""
    # values[k]: coefficients of t^k. X = sum X_k t^k, (k + 1) X_(k+1) = sum_j X_j A_(k-j).
    a = [matrix([mp.mpf(float(v)) for v in row]) for row in values]
    for later in a[1:]:
        later[3, 4] = mp.mpf(0)
    x = [mp.eye(5)]
    for k in range(terms):
        total = mp.matrix(5)
        for j in range(max(0, k - len(a) + 1), k + 1):
            total += x[j] * a[k - j]
        x.append(total / (k + 1))
    h = mp.mpf(dt)
    out = mp.matrix(5)
    for k, one in enumerate(x):
        out += one * h**k
    return out


def wrong_by(motion, true):
    """Largest difference of C, dv, dr from the true X."""
    phi, dv, dr = (np.array(motion[i : i + 3]) for i in (0, 3, 6))
    n = [mp.mpf(float(v)) for v in phi]
    skew = mp.matrix([[0, -n[2], n[1]], [n[2], 0, -n[0]], [-n[1], n[0], 0]])
    c = mp.expm(skew)
    turn = max(abs(c[i, j] - true[i, j]) for i in range(3) for j in range(3))
    velocity = max(abs(mp.mpf(float(dv[i])) - true[i, 3]) for i in range(3))
    distance = max(abs(mp.mpf(float(dr[i])) - true[i, 4]) for i in range(3))
    return np.array([float(turn), float(velocity), float(distance)])


W = np.array([[0.7, -1.1, 0.9], [1.3, 0.4, -0.8], [-0.6, 0.9, 1.2]])
F = np.array([[4.0, -3.0, -9.8], [2.0, 5.0, 1.0], [-3.0, 1.5, 2.5]])


@pytest.mark.parametrize("dt", [1e-6, 0.01, 0.2, 0.25, 1.0, 2.0])
def test_constant_rate_and_force_are_exact(dt):
    true = flow(dt, [np.concatenate([W[0], F[0]])], terms=60)
    one = kernel.linear_motion(dt, *W[0], *W[0], *F[0], *F[0])
    mean = kernel.mean_motion(dt, dt, *W[0], *W[0], *F[0], *F[0])
    at = (*W[0], *F[0])
    for motion in (one, mean, kernel.sixth_order_motion(dt, at, at, at)):
        # Some twenty roundings of numbers of the size of the whole: 11 m/s2 and rad of 1.6 dt.
        scale = np.array([max(1.0, 1.6 * dt), 11.0 * dt, 5.5 * dt * dt])
        assert (wrong_by(motion, true) <= 20 * U * scale).all()


def polynomial_at(t, degree):
    return sum(np.concatenate([W[k], F[k]]) * t**k for k in range(degree + 1))


def test_lines_are_right_to_the_fifth_power_of_a_step():
    """The local error: one more than the order."""
    wrong = []
    for dt in (0.1, 0.05, 0.025):
        low, high = polynomial_at(0.0, 1), polynomial_at(dt, 1)
        motion = kernel.linear_motion(dt, *low[:3], *high[:3], *low[3:], *high[3:])
        wrong.append(wrong_by(motion, flow(dt, [np.concatenate([W[k], F[k]]) for k in range(2)])))
    # The next term of the expansion is a step of up to 0.1 s times rates of 2 rad/s.
    slopes = np.log2(np.array(wrong[:-1]) / np.array(wrong[1:]))
    assert slopes[-1] == pytest.approx([5.0, 5.0, 5.0], abs=0.2)


def test_parabolas_are_right_to_the_seventh_power_of_a_step():
    wrong = []
    for dt in (0.2, 0.1, 0.05):
        at = [polynomial_at(dt * g, 2) for g in (kernel_first(), 0.5, kernel_last())]
        motion = kernel.sixth_order_motion(dt, *(tuple(float(v) for v in a) for a in at))
        wrong.append(wrong_by(motion, flow(dt, [np.concatenate([W[k], F[k]]) for k in range(3)])))
    slopes = np.log2(np.array(wrong[:-1]) / np.array(wrong[1:]))
    assert slopes[-1] == pytest.approx([7.0, 7.0, 7.0], abs=0.3)


def kernel_first():
    return kernel.GAUSS_FIRST


def kernel_last():
    return kernel.GAUSS_LAST


def test_one_step_and_the_loop_give_the_same_bits():
    rng = np.random.default_rng(3)
    dt = rng.uniform(0.005, 0.02, 300)
    dt[[50, 51, 200]] = [0.5, 0.001, 0.1]
    rate, force = rng.normal(size=(301, 3)) * 3.0, rng.normal(size=(301, 3)) * 20.0
    out = np.empty((300, 10))
    for mean in (False, True):
        kernel.motion_increments_linear(dt, np.hstack([rate, force]), mean, out)
        before = dt[0]
        for k in range(300):
            pairs = (*rate[k], *rate[k + 1], *force[k], *force[k + 1])
            if mean:
                row = kernel.mean_motion(dt[k], before, *pairs)
            else:
                row = kernel.linear_motion(dt[k], *pairs)
            before = dt[k]
            assert out[k, 0] == dt[k]
            assert tuple(out[k, 1:]) == row


def test_an_unlike_step_before_it_says_nothing_of_a_mean():
    pairs = (*W[0], *W[1], *F[0], *F[1])
    alone = kernel.linear_motion(0.01, *W[1], *W[1], *F[1], *F[1])
    for before in (0.0, 0.0033, 0.0301, 5.0):
        # Constant: the products of equal rates cancel exactly, and half of twice a number is it.
        assert kernel.mean_motion(0.01, before, *pairs) == alone
    for before in (0.0034, 0.0299):
        assert kernel.mean_motion(0.01, before, *pairs) != alone
