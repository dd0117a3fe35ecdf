"""Transition and noise of a step, against dense series of their order and the exact integral."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from scipy.linalg import expm

from strapdown._kernels.compilation import interpreted
from strapdown._kernels.covariance import udu_factor, udu_predict
from strapdown._kernels.growth import (
    CORE,
    compose_growth,
    factor_room,
    grown_covariance,
    grown_factors,
    growth_arrays,
    growth_of_step,
    growth_room,
    padded_width,
    unfold_growth,
)

# Whole panels of sixteen columns and parts of one, in one to three panels.
SIZES = (11, 15, 17, 24, 33, 40)
# None is held, or the height and the velocity down, as of what stays level.
HELD = (0, (1 << 2) | (1 << 5))
EPS = np.finfo(np.float64).eps


@dataclass
class Step:
    """A step of random dynamics, and what it is made of."""

    A: np.ndarray
    S: np.ndarray
    dt: float
    held: int
    arguments: tuple

    @property
    def n(self):
        return len(self.A)

    @property
    def taking(self):
        """Which states take noise, as a diagonal matrix."""
        return np.diag([float(not self.held >> i & 1) for i in range(self.n)])


def step_of(n, held=0, dt=0.05, seed=0, equal=False):
    rng = np.random.default_rng([n, seed])
    f = np.zeros((CORE, padded_width(n)))
    f[:, :n] = rng.normal(size=(CORE, n))
    # What the attitude depends on, and what depends on it.
    f[:3, 6:9] = 0.0
    f[6:9, :6] = 0.0
    # Sensors that fade and that do not, with noise of their own and without.
    decay = np.abs(rng.normal(size=n - CORE)) * (np.arange(n - CORE) % 2)
    drive = np.abs(rng.normal(size=n - CORE)) * (np.arange(n - CORE) % 3 > 0)
    C = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    gyro = np.full(3, 0.2) if equal else np.array([0.1, 0.2, 0.3])
    accel = np.full(3, 0.1) if equal else np.array([0.3, 0.1, 0.2])
    A, S = np.zeros((n, n)), np.zeros((n, n))
    A[:CORE] = f[:, :n]
    A[CORE:, CORE:] = -np.diag(decay)
    S[3:6, 3:6] = C @ np.diag(accel**2) @ C.T
    S[6:9, 6:9] = C @ np.diag(gyro**2) @ C.T
    S[CORE:, CORE:] = np.diag(drive**2)
    return Step(A, S, dt, held, (f, decay, dt, C, gyro, accel, drive, held))


def grown(step):
    growth, room = growth_arrays(step.n), growth_room(step.n)
    growth_of_step(*step.arguments, growth, room)
    return growth, room


def unfolded(step):
    Phi, Q = np.full((step.n, step.n), np.nan), np.full((step.n, step.n), np.nan)
    unfold_growth(grown(step)[0], Phi, Q)
    return Phi, Q


def third_order(A, t):
    """Rows of the core to third order, those of the sensors exactly."""
    X = A * t
    out = np.eye(len(A)) + X + X @ X / 2.0 + X @ X @ X / 6.0
    out[CORE:, CORE:] = np.diag(np.exp(t * np.diag(A)[CORE:]))
    return out


def rounding(n):
    # A number is a sum of n products at most, of numbers that are sums of nine products of ones
    # that are: twice each rounding, as the reference rounds, too.
    return 2.0 * (n + 3 * CORE) * EPS


def largest_part(A, t):
    """Of each number of the series, the sum of the sizes of its parts."""
    return third_order(np.abs(A), t)


@pytest.mark.parametrize("n", SIZES)
def test_the_transition_is_the_series_to_third_order(n):
    step = step_of(n)
    Phi, _ = unfolded(step)
    error = np.abs(Phi - third_order(step.A, step.dt))
    assert (error <= rounding(n) * largest_part(step.A, step.dt)).all()


@pytest.mark.parametrize("n", SIZES)
@pytest.mark.parametrize("dt", [0.02, 0.005])
def test_the_transition_is_the_exponential_to_what_the_series_leaves_out(n, dt):
    step = step_of(n, dt=dt)
    Phi, _ = unfolded(step)
    size = np.linalg.norm(step.A * dt, 2)
    left_out = size**4 / 24.0 * np.exp(size)
    assert np.linalg.norm(Phi - expm(step.A * dt), 2) <= left_out


@pytest.mark.parametrize("equal", [False, True])
@pytest.mark.parametrize("held", HELD)
@pytest.mark.parametrize("n", SIZES)
def test_noise_enters_at_the_middle_of_the_step(n, held, equal):
    step = step_of(n, held, equal=equal)
    _, Q = unfolded(step)
    half = step.taking @ third_order(step.A, 0.5 * step.dt)
    part = largest_part(step.A, 0.5 * step.dt)
    # White noise may be turned: three more products, of a direction of length one.
    sizes = step.dt * part @ turned_sizes(step) @ part.T
    assert (np.abs(Q - step.dt * half @ step.S @ half.T) <= rounding(n + 6) * sizes).all()
    assert (Q == Q.T).all()
    still = [i for i in range(CORE) if held >> i & 1]
    assert not Q[still].any()


def turned_sizes(step):
    """Sums of the sizes of the parts of white noise, before they cancel in a turn."""
    out = np.abs(step.S)
    for at in (3, 6):
        # Of C q C', no part is more than its trace.
        out[at : at + 3, at : at + 3] = np.trace(step.S[at : at + 3, at : at + 3])
    return out


@pytest.mark.parametrize("n", SIZES)
def test_noise_is_the_integral_to_second_order(n):
    """Van Loan's integral, whose middle is what a step takes: half the step, an eighth."""
    apart = []
    for dt in (0.02, 0.01):
        step = step_of(n, dt=dt)
        _, Q = unfolded(step)
        # Van Loan 1978, Eqs. (1.2), (1.4).
        both = expm(dt * np.block([[-step.A, step.S], [np.zeros((n, n)), step.A.T]]))
        exact = both[n:, n:].T @ both[:n, n:]
        size = np.linalg.norm(step.A, 2)
        # Midpoint rule: dt³/24 of the second derivative of exp(A s) S exp(A s)'; and what the
        # series of the half step leaves out, on both sides.
        scale = np.linalg.norm(step.S, 2) * np.exp(2.0 * size * dt)
        bound = dt**3 / 24.0 * 4.0 * size**2 + 2.0 * dt * (0.5 * size * dt) ** 4 / 24.0
        apart.append(np.linalg.norm(Q - exact, 2))
        assert apart[-1] <= scale * bound
    assert 7.0 < apart[0] / apart[1] < 9.0


@pytest.mark.parametrize("held", HELD)
@pytest.mark.parametrize("n", SIZES)
def test_a_covariance_grows_by_both(n, held):
    step = step_of(n, held)
    growth, room = grown(step)
    X = np.random.default_rng(n).normal(size=(n, n))
    P = X @ X.T
    out = P.copy()
    assert grown_covariance(out, growth, room) == -1
    Phi, Q = unfolded(step)
    sizes = np.abs(Phi) @ np.abs(P) @ np.abs(Phi).T
    part = largest_part(step.A, 0.5 * step.dt)
    sizes += step.dt * part @ turned_sizes(step) @ part.T
    assert (np.abs(out - (Phi @ P @ Phi.T + Q)) <= rounding(n + 6) * sizes).all()
    assert (out == out.T).all()


@pytest.mark.parametrize("n", SIZES)
def test_arrays_are_filled_anew_by_each_step(n):
    """A step is no other for what its arrays held: noise, held rows, another covariance."""
    growth, room = growth_arrays(n), growth_room(n)
    before = step_of(n, seed=1)
    growth_of_step(*before.arguments, growth, room)
    grown_covariance(np.eye(n), growth, room)
    step = step_of(n, HELD[1], seed=2)
    growth_of_step(*step.arguments, growth, room)
    P = np.eye(n)
    grown_covariance(P, growth, room)
    fresh, expected = grown(step), np.eye(n)
    grown_covariance(expected, *fresh)
    assert (expected == P).all()


@pytest.mark.parametrize("bad", [0, 4, CORE, "last"])
@pytest.mark.parametrize("n", (11, 33))
def test_the_first_variance_that_is_none_is_told(n, bad):
    bad = n - 1 if bad == "last" else bad
    growth, room = grown(step_of(n, dt=1e-9))
    P = np.eye(n)
    P[bad, bad] = -1.0
    assert grown_covariance(P, growth, room) == bad


def test_a_variance_that_is_no_number_is_told():
    growth, room = grown(step_of(15))
    P = np.eye(15)
    P[14, 14] = np.nan
    # The place, the first state, depends on every sensor.
    assert grown_covariance(P, growth, room) == 0


@pytest.mark.parametrize("n", (11, 24))
def test_two_steps_are_one_after_the_other(n):
    first, second = unfolded(step_of(n, seed=3)), unfolded(step_of(n, seed=4))
    Phi, Q = first[0].copy(), first[1].copy()
    compose_growth(*second, Phi, Q, np.empty((n, n)))
    sizes = np.abs(second[0]) @ np.abs(first[0])
    assert (np.abs(Phi - second[0] @ first[0]) <= rounding(n) * sizes).all()
    expected = second[0] @ first[1] @ second[0].T + second[1]
    sizes = np.abs(second[0]) @ np.abs(first[1]) @ np.abs(second[0]).T + np.abs(second[1])
    assert (np.abs(Q - expected) <= rounding(n) * sizes).all()
    assert (Q == Q.T).all()


def steady(step, first):
    """The step with constant sensors from the given one on, without noise of their own."""
    f, decay, dt, C, gyro, accel, drive, held = step.arguments
    decay, drive = decay.copy(), drive.copy()
    decay[first:] = drive[first:] = 0.0
    step.A[CORE:, CORE:] = -np.diag(decay)
    step.S[CORE:, CORE:] = np.diag(drive**2)
    return Step(step.A, step.S, dt, held, (f, decay, dt, C, gyro, accel, drive, held))


def factored(P):
    ud = np.empty_like(P)
    assert udu_factor(P, ud) == -1
    return ud


def grown_ud(step, ud):
    growth, room = grown(step)
    out = ud.copy()
    assert grown_factors(out, growth, room, *factor_room(step.n)) == -1
    return out


def product(ud):
    """U D U' in twice the precision."""
    wide = np.asarray(ud, dtype=np.longdouble)
    U = np.triu(wide, 1) + np.eye(len(wide))
    return (U * np.diagonal(wide)) @ U.T


def largest_error(step, ud, out):
    """Bound of the error of P by rounding.

    Of each row of [Phi U, G] an operation errs by a rounding of its length, and Gram-Schmidt loses
    in orthogonality what a row loses in length until it is D.
    """
    Phi, _ = unfolded(step)
    U = np.abs(np.triu(ud, 1)) + np.eye(step.n)
    sizes = (np.abs(Phi) @ U) ** 2 @ np.diagonal(ud)
    part = largest_part(step.A, 0.5 * step.dt)
    sizes += step.dt * np.diagonal(part @ turned_sizes(step) @ part.T)
    left = np.diagonal(out)
    lost = np.sqrt((sizes[left > 0.0] / left[left > 0.0]).max())
    columns = step.n + 6 + step.n - CORE
    return rounding(step.n + columns) * lost * np.sqrt(sizes * sizes[:, None])


@pytest.mark.parametrize("first", [0, 1, 2, None])
@pytest.mark.parametrize("held", HELD)
@pytest.mark.parametrize("n", (CORE, *SIZES))
def test_factors_grow_as_the_covariance(n, held, first):
    """Within rounding; and as near as the dense form where units are 10¹² apart."""
    step = step_of(n, held)
    if first is not None:
        step = steady(step, first)
    rng = np.random.default_rng(n)
    Phi, Q = unfolded(step)
    exact = [np.asarray(each, dtype=np.longdouble) for each in (Phi, Q)]
    for spread in (0.0, 6.0):
        X = rng.normal(size=(n, n)) * 10.0 ** rng.uniform(-spread, spread, (n, 1))
        ud = factored(X @ X.T)
        out, reference = grown_ud(step, ud), np.empty((n, n))
        expected = exact[0] @ product(ud) @ exact[0].T + exact[1]
        error = np.abs(product(out) - expected)
        assert (error <= largest_error(step, ud, out)).all()
        assert udu_predict(ud, Phi, Q, reference) == -1
        sd = np.sqrt(np.diagonal(expected))
        dense, blocks = (
            (each / sd / sd[:, None]).max()
            for each in (np.abs(product(reference) - expected), error)
        )
        assert blocks <= dense + rounding(n)
        assert (np.diagonal(out) >= 0.0).all()
        assert not np.tril(out, -1).any()
        if first is not None:
            # Nothing happens to what is constant.
            kept = slice(CORE + first, None)
            assert np.array_equal(out[kept, kept], ud[kept, kept])


@pytest.mark.parametrize("n", SIZES)
def test_factors_are_those_of_the_dense_form(n):
    step = step_of(n)
    ud = factored(np.cov(np.random.default_rng(n).normal(size=(n, 3 * n))))
    out, reference = grown_ud(step, ud), np.empty((n, n))
    assert udu_predict(ud, *unfolded(step), reference) == -1
    # Both have the error of the bound; U and D of P have its condition.
    P = np.asarray(product(reference), dtype=np.float64)
    condition = np.linalg.cond(P / np.sqrt(np.diagonal(P) * np.diagonal(P)[:, None]))
    size = largest_error(step, ud, out) / np.sqrt(np.diagonal(P) * np.diagonal(P)[:, None])
    scale = np.sqrt(np.diagonal(P)[:, None] / np.diagonal(P))
    assert np.abs((out - reference) / scale)[np.triu_indices(n, 1)].max() <= (
        2.0 * condition * size.max()
    )
    np.testing.assert_allclose(
        np.diagonal(out), np.diagonal(reference), rtol=2.0 * condition * size.max()
    )


def test_known_states_stay_known():
    """No variance and no noise: D stays zero, and U has no direction."""
    step = steady(step_of(15, HELD[1]), 0)
    f, decay, dt, C, _, _, drive, held = step.arguments
    still = Step(step.A, 0.0 * step.S, dt, held, (f, decay, dt, C, *np.zeros((2, 3)), drive, held))
    assert not grown_ud(still, np.zeros((15, 15))).any()
    one = np.zeros((15, 15))
    one[14, 14] = 4.0
    out = grown_ud(still, one)
    Phi, _ = unfolded(still)
    assert np.array_equal(out[:14, 14], Phi[:14, 14])
    assert out[14, 14] == 4.0
    assert not out[:, :14].any()


def test_a_sensor_that_forgets_within_a_step_has_its_noise_alone():
    step = step_of(12, dt=0.05)
    step.arguments[1][:] = [0.0, 1e5, 0.0]
    step.arguments[6][:] = [0.0, 3.0, 0.0]
    growth, room = grown(step)
    assert growth[3][1] == 0.0
    ud = factored(np.eye(12) + 0.5)
    out = ud.copy()
    assert grown_factors(out, growth, room, *factor_room(12)) == -1
    assert np.isfinite(out).all()
    Phi, Q = unfolded(step)
    expected = Phi @ (np.eye(12) + 0.5) @ Phi.T + Q
    size = np.sqrt(np.diagonal(expected))
    error = np.abs(np.asarray(product(out), dtype=np.float64) - expected)
    assert (error <= 1e-12 * size * size[:, None]).all()
    assert Q[10, 10] == 0.0
    assert out[10, 10] == 0.0


@pytest.mark.parametrize("n", (15, 24))
def test_factors_are_filled_anew_by_each_step(n):
    growth, room, work = growth_arrays(n), growth_room(n), factor_room(n)
    before = steady(step_of(n, seed=1), 2)
    growth_of_step(*before.arguments, growth, room)
    grown_factors(factored(2.0 * np.eye(n) + 1.0), growth, room, *work)
    step = steady(step_of(n, seed=2), 2)
    growth_of_step(*step.arguments, growth, room)
    out = factored(np.eye(n) + 1.0)
    grown_factors(out, growth, room, *work)
    assert np.array_equal(out, grown_ud(step, factored(np.eye(n) + 1.0)))


@pytest.mark.parametrize("bad", [0, 4, 14])
def test_a_factor_that_is_no_number_is_told(bad):
    step = steady(step_of(15, dt=1e-9), 0)
    growth, room = grown(step)
    ud = np.eye(15)
    ud[bad, bad] = np.nan
    first = grown_factors(ud, growth, room, *factor_room(15))
    # What is not a number spreads to the states that depend on it.
    assert 0 <= first <= bad
    assert np.isnan(ud[first, first])


def test_interpreted_factors_are_the_compiled_ones():
    for step in (step_of(15), steady(step_of(15), 0), steady(step_of(24, HELD[1]), 3)):
        ud = factored(np.cov(np.random.default_rng(3).normal(size=(step.n, 60))))
        growth, room = grown(step)
        out = ud.copy()
        interpreted(grown_factors)(out, growth, room, *factor_room(step.n))
        assert np.array_equal(out, grown_ud(step, ud))
