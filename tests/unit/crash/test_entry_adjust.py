"""The adjustment fix by fix is the batch solution with the full covariance of all rows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from strapdown.crash.entry_estimate import Problem, adjust, weigh

M, W, P, S = 12, 4, 5, 3
GROUPS = np.array([0, 0, 1, -1])


@pytest.fixture(scope="module")
def problem():
    g = np.random.default_rng(3)
    root = 0.3 * g.standard_normal((M, S, S))
    there = g.random((M, W)) > 0.2
    return Problem(
        residuals=g.standard_normal((M, W)),
        by_constants=g.standard_normal((M, W, P)),
        by_states=g.standard_normal((M, W, S)),
        noise=0.2 + g.random((M, W)),
        variance=1.5 + g.random((M, W)),
        there=there,
        groups=GROUPS,
        carry=0.5 * g.standard_normal((M, S, S)),
        driven=root @ root.transpose(0, 2, 1),
        first=np.diag([0.0, 1.0, 2.0]),
        prior_sd=np.array([5.0, 1.0, 0.3, 0.0, 2.0]),
        prior_residuals=np.array([0.0, 0.4, -0.1, 0.0, 1.0]),
    )


def dense(p, weights):
    """Step, covariance, chi-square, inverse of the covariance of all rows and its product."""
    rows = np.flatnonzero(p.there.ravel())
    # Covariance of the states of each two fixes.
    own, C = p.first, np.zeros((M, S, M, S))
    for k in range(M):
        own = p.carry[k] @ own @ p.carry[k].T + p.driven[k]
        C[k, :, k] = own
        for j in range(k):
            C[k, :, j] = p.carry[k] @ C[k - 1, :, j]
            C[j, :, k] = C[k, :, j].T
    H = np.zeros((M, W, M, S))
    for k in range(M):
        H[k, :, k] = p.by_states[k]
    H = H.reshape(M * W, M * S)[rows]
    more = np.column_stack([1.0 / weights - 1.0, np.zeros(M)])[:, GROUPS]
    noise = (p.noise + p.variance * more).ravel()[rows]
    N = H @ C.reshape(M * S, M * S) @ H.T + np.diag(noise)
    J = p.by_constants.reshape(M * W, P)[rows]
    prior = np.diag(p.prior_sd**2)
    full = np.linalg.inv(J @ prior @ J.T + N)
    innovation = p.residuals.ravel()[rows] - J @ p.prior_residuals
    gain = prior @ J.T @ full
    return (
        p.prior_residuals + gain @ innovation,
        prior - gain @ J @ prior,
        innovation @ full @ innovation,
        full,
        full @ innovation,
        rows,
    )


@pytest.mark.parametrize("seed", [None, 4])
def test_it_is_the_batch_solution(problem, seed):
    weights = np.ones((M, 2))
    if seed is not None:
        weights = np.random.default_rng(seed).uniform(0.05, 1.0, (M, 2))
    found = adjust(problem, weights)
    step, covariance, chi_square, full, pulled, rows = dense(problem, weights)
    # Differences of numbers of 25 that leave 0.02, in some ten steps, at conditions of thousands.
    near = {"rtol": 1e-9, "atol": 1e-9}
    np.testing.assert_allclose(found.step, step, **near)
    np.testing.assert_allclose(found.covariance, covariance, **near)
    np.testing.assert_allclose(found.chi_square, chi_square, **near)
    np.testing.assert_allclose(found.apart.ravel()[rows], pulled, **near)
    for k in range(M):
        own = np.flatnonzero(rows // W == k)
        at = rows[own] % W
        np.testing.assert_allclose(
            found.certainty[k][np.ix_(at, at)], full[np.ix_(own, own)], **near
        )


def test_a_misfit_is_the_distance_from_all_others(problem):
    weights = np.ones((M, 2))
    weights[4, 0] = 0.01
    _, misfits = weigh(problem, adjust(problem, weights), weights)
    for k, group in ((4, 0), (7, 0), (7, 1)):
        rows = np.flatnonzero((group == GROUPS) & problem.there[k])
        assert rows.size
        # Predicted from the others, and compared with full weight.
        there = problem.there.copy()
        there[k, rows] = False
        others = weights.copy()
        others[k, group] = 1.0
        *_, full, _, all_rows = dense(problem, others)
        p = problem
        innovation = (p.residuals - p.by_constants @ p.prior_residuals).ravel()[all_rows]
        cov = np.linalg.inv(full)
        own = np.isin(all_rows, k * W + rows)
        across = cov[own][:, ~own] @ np.linalg.inv(cov[~own][:, ~own])
        apart = innovation[own] - across @ innovation[~own]
        spread = cov[own][:, own] - across @ cov[~own][:, own]
        expected = np.sqrt(apart @ np.linalg.solve(spread, apart))
        assert misfits[k, group] == pytest.approx(expected, rel=1e-8)


def test_the_farthest_loses_its_weight_first(problem):
    wrong = problem.residuals.copy()
    there = np.ones((M, W), dtype=bool)
    wrong[5, :2] += 200.0
    spoiled = replace(problem, residuals=wrong, there=there)
    weights = np.ones((M, 2))
    found, misfits = weigh(spoiled, adjust(spoiled, weights), weights)
    assert np.nanargmax(misfits) == 10
    assert found[5, 0] == 0.0
    for _ in range(10):
        found, misfits = weigh(spoiled, adjust(spoiled, found), found)
    # What it had misled is believed again.
    assert found[5, 0] == 0.0
    assert (np.delete(found.ravel(), 10) == 1.0).all()
