"""Generalised least squares over fixes whose errors are correlated, fix by fix.

The unknown constants and the two processes that join the errors of the fixes, what the noise of
the inertial sensors has added since and what wanders in the receiver, are one state of a linear
filter, which goes from the last fix to the first. For normal errors that is the batch solution
with the full covariance of all rows, at a cost that grows with their number instead of its cube.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: A block keeps its weight where chance alone puts it farther off with more than this
#: probability, and has none where with less than the other.
KEPT, DROPPED = 1e-3, 1e-6
# The variance of a block without weight is so many times its own.
_LARGEST = 1e8
# Blocks lose weight together whose misfits are no smaller than this share of the largest: the
# others may be misled by it.
_TOGETHER = 0.7


@dataclass(frozen=True, eq=False)
class Problem:
    """Fixes and priors about parameters as they are.

    m fixes in the order of the filter, with up to w rows each; p constants, s states.

    Attributes
    ----------
    residuals : ndarray, (m, w)
    by_constants : ndarray, (m, w, p)
        Derivatives by the constants.
    by_states : ndarray, (m, w, s)
        And by the states.
    noise : ndarray, (m, w)
        Variances of what is new with each fix.
    variance : ndarray, (m, w)
        Of the whole error of the fix, of which weights make more.
    there : ndarray of bool, (m, w)
        What was measured.
    groups : ndarray of int, (w,)
        0 or more for rows that keep or lose their weight together, -1 for those that keep it.
    carry : ndarray, (m, s, s)
        From the state at the fix before to that at this one; of the first from zero time.
    driven : ndarray, (m, s, s)
        Covariance of what is added on the way.
    first : ndarray, (s, s)
        Covariance of the states at zero time.
    prior_sd : ndarray, (p,)
    prior_residuals : ndarray, (p,)
        Where the prior is, from the parameters as they are.
    """

    residuals: Array
    by_constants: Array
    by_states: Array
    noise: Array
    variance: Array
    there: NDArray[np.bool_]
    groups: NDArray[np.int64]
    carry: Array
    driven: Array
    first: Array
    prior_sd: Array
    prior_residuals: Array


@dataclass(frozen=True, eq=False)
class Adjustment:
    """A step of least squares.

    Attributes
    ----------
    step : ndarray, (p,)
        To be added to the constants.
    covariance : ndarray, (p, p)
    chi_square : float
        Of all rows and the priors; of as many degrees of freedom as there are rows more than
        constants without prior.
    apart : ndarray, (m, w)
        How far each row is from what all others and the priors say, times `certainty`.
    certainty : ndarray, (m, w, w)
        Inverse of the covariance of that difference.
    """

    step: Array
    covariance: Array
    chi_square: float
    apart: Array
    certainty: Array


def adjust(problem: Problem, weights: Array) -> Adjustment:
    """Solve for a step of the constants.

    Parameters
    ----------
    problem : Problem
    weights : ndarray, (m, g)
        A group of weight w has independent noise of ``1/w - 1`` times its variances added.

    Returns
    -------
    Adjustment

    Notes
    -----
    Filter in the form of covariances; `apart` and `certainty` by the backward recursion of the
    smoothations (de Jong 1989, Journal of the American Statistical Association 84, 1085): with
    innovation v of covariance F, gain K and ``L = I - K H``,
    ``u = F^-1 v - K^T r``, ``M = F^-1 + K^T N K``, ``r <- H^T F^-1 v + L^T r``,
    ``N <- H^T F^-1 H + L^T N L``, r and N carried back by the transposed transition.
    """
    m, _, p = problem.by_constants.shape
    s = problem.by_states.shape[2]
    state = np.concatenate([problem.prior_residuals, np.zeros(s)])
    P = np.zeros((p + s, p + s))
    P[:p, :p] = np.diag(problem.prior_sd**2)
    P[p:, p:] = problem.first
    noise = problem.noise + problem.variance * extra_noise(problem.groups, weights)
    kept, chi_square = [], 0.0
    for k in range(m):
        T = problem.carry[k]
        state[p:] = T @ state[p:]
        P[p:] = T @ P[p:]
        P[:, p:] = P[:, p:] @ T.T
        P[p:, p:] += problem.driven[k]
        rows = problem.there[k]
        H = np.hstack([problem.by_constants[k, rows], problem.by_states[k, rows]])
        PH = P @ H.T
        inverse = np.linalg.inv(H @ PH + np.diag(noise[k, rows]))
        v = problem.residuals[k, rows] - H @ state
        K = PH @ inverse
        state = state + K @ v
        P -= K @ PH.T
        P = 0.5 * (P + P.T)
        kept.append((H, K, inverse, v))
        chi_square += float(v @ inverse @ v)
    r, N = np.zeros(p + s), np.zeros((p + s, p + s))
    apart = np.zeros(problem.residuals.shape)
    certainty = np.zeros((*problem.residuals.shape, problem.residuals.shape[1]))
    for k in range(m - 1, -1, -1):
        H, K, inverse, v = kept[k]
        rows = np.flatnonzero(problem.there[k])
        u = inverse @ v - K.T @ r
        apart[k, rows] = u
        certainty[k, rows[:, None], rows] = inverse + K.T @ N @ K
        r = r + H.T @ u
        # In the form that cannot lose its sign.
        L = np.eye(p + s) - K @ H
        N = L.T @ N @ L + H.T @ inverse @ H
        T = problem.carry[k]
        r[p:] = T.T @ r[p:]
        N[p:] = T.T @ N[p:]
        N[:, p:] = N[:, p:] @ T
    return Adjustment(state[:p], P[:p, :p], chi_square, apart, certainty)


def weigh(problem: Problem, adjustment: Adjustment, weights: Array) -> tuple[Array, Array]:
    """Find the weights of the groups.

    Parameters
    ----------
    problem : Problem
    adjustment : Adjustment
        With the weights so far.
    weights : ndarray, (m, g)

    Returns
    -------
    weights : ndarray, (m, g)
        To be used for the next step; they are final when they do not change any more.
    misfits : ndarray, (m, g)
        Root of the squared Mahalanobis distance of each group, with full weight, from what all
        others say with theirs; NaN where nothing was measured.

    Notes
    -----
    The scheme IGG III (Yang, Song and Xu 2002, Journal of Geodesy 76, 353),
    ``k0/t ((k1 - t)/(k1 - k0))²`` from k0 to k1, with chi-square quantiles as k0 and k1. A group
    that lost no weight yet loses some only if none is much farther off: so a false fix does not
    take its neighbours with it.
    """
    from scipy.stats import chi2

    more = problem.variance * extra_noise(problem.groups, weights)
    misfits = np.full(weights.shape, np.nan)
    wanted = np.ones(weights.shape)
    sizes = np.array([1, 2, 3])
    kept, dropped = (np.sqrt(chi2.isf(q, sizes)) for q in (KEPT, DROPPED))
    excess = np.zeros(weights.shape)
    for k, g in np.ndindex(*weights.shape):
        rows = np.flatnonzero((problem.groups == g) & problem.there[k])
        if not rows.size:
            continue
        spread = np.linalg.inv(adjustment.certainty[k][np.ix_(rows, rows)])
        off = spread @ adjustment.apart[k, rows]
        # Without the noise that its own weight has added.
        t = float(np.sqrt(off @ np.linalg.solve(spread - np.diag(more[k, rows]), off)))
        k0, k1 = kept[rows.size - 1], dropped[rows.size - 1]
        misfits[k, g], excess[k, g] = t, t / k0
        if t > k0:
            wanted[k, g] = k0 / t * (max(0.0, k1 - t) / (k1 - k0)) ** 2
    fresh = (weights == 1.0) & (wanted < 1.0)
    fresh &= excess < _TOGETHER * np.max(excess, where=fresh, initial=0.0)
    return np.where(fresh, 1.0, wanted), misfits


def extra_noise(groups: NDArray[np.int64], weights: Array) -> Array:
    """Noise that weights add, in variances of the row, (m, w)."""
    with np.errstate(divide="ignore"):
        more = np.minimum(1.0 / weights - 1.0, _LARGEST)
    return np.asarray(np.where(groups >= 0, more[:, np.maximum(groups, 0)], 0.0))
