"""Generalised least squares with priors, correlated noise and weights against outliers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Rows = NDArray[np.intp]

#: A block keeps its weight where chance alone puts it farther off with more than this
#: probability, and has none where with less than the other.
KEPT, DROPPED = 1e-3, 1e-6
# The variance of a block without weight is so many times its own.
_LARGEST = 1e10


@dataclass(frozen=True, eq=False)
class Problem:
    """Rows and priors about parameters as they are; n rows, p parameters, b blocks.

    Attributes
    ----------
    residuals : ndarray, (n,)
    jacobian : ndarray, (n, p)
    noise : ndarray, (n, n)
        Covariance of the rows.
    prior_sd : ndarray, (p,)
        Infinite where nothing is known before; zero fixes a parameter.
    prior_residuals : ndarray, (p,)
        Where the prior is, from the parameters as they are.
    blocks : list of ndarray of int
        One to three rows each, that keep or lose their weight together.
    """

    residuals: Array
    jacobian: Array
    noise: Array
    prior_sd: Array
    prior_residuals: Array
    blocks: list[Rows]


@dataclass(frozen=True, eq=False)
class Adjustment:
    """A step of least squares.

    Attributes
    ----------
    step : ndarray, (p,)
        To be added to the parameters.
    covariance : ndarray, (p, p)
        Of the parameters.
    chi_square : float
        Of all rows and the priors; of as many degrees of freedom as there are rows more than
        parameters without prior.
    inverse, innovation : ndarray, (n, n), (n,)
        Of the covariance of the innovations, ``M``, and ``M`` times them.
    """

    step: Array
    covariance: Array
    chi_square: float
    inverse: Array
    innovation: Array


def adjust(problem: Problem, weights: Array) -> Adjustment:
    """Solve for a step of the parameters.

    Minimises ``(r - J d)^T N_w^-1 (r - J d) + |(u - d)/s|²``.

    Parameters
    ----------
    problem : Problem
    weights : ndarray, (b,)
        A block of weight w has independent noise of ``1/w - 1`` times its variances added.

    Returns
    -------
    Adjustment
    """
    known = np.isfinite(problem.prior_sd)
    scale = np.where(known, problem.prior_sd, 1.0)
    noise = problem.noise.copy()
    for rows, w in zip(problem.blocks, weights, strict=True):
        if w < 1.0:
            noise[rows, rows] += problem.noise[rows, rows] * _extra(w)
    # Of standard deviations that differ by many orders only the correlation is factored.
    size = np.sqrt(np.diag(noise))
    lower = np.linalg.cholesky(noise / np.outer(size, size))
    inverse = np.linalg.solve(lower, np.diag(1.0 / size))
    white, r = inverse @ (problem.jacobian * scale), inverse @ problem.residuals
    before = np.divide(
        problem.prior_residuals, scale, out=np.zeros_like(scale), where=known & (scale > 0.0)
    )
    normal = white.T @ white + np.diag(known.astype(np.float64))
    # Columns differ in size: metres beside radians over ten seconds.
    unit = 1.0 / np.sqrt(np.diag(normal))
    spread = np.linalg.inv(normal * np.outer(unit, unit)) * np.outer(unit, unit)
    step = spread @ (white.T @ r + before)
    innovation = r - white @ before
    left = innovation - white @ (spread @ (white.T @ innovation))
    return Adjustment(
        scale * step,
        spread * np.outer(scale, scale),
        float(innovation @ left),
        inverse.T @ (inverse - white @ (spread @ (white.T @ inverse))),
        inverse.T @ left,
    )


def weigh(problem: Problem) -> tuple[Array, Array]:
    """Find the weights of the blocks.

    Parameters
    ----------
    problem : Problem

    Returns
    -------
    weights : ndarray, (b,)
    misfits : ndarray, (b,)
        Root of the squared Mahalanobis distance of each block from what all others say; of one
        that lost weight as it then was.

    Notes
    -----
    With M the inverse of the covariance of all innovations ``J P J^T + N``, the misfit of block b
    from the prediction by all others is ``M_bb^-1 (M r)_b``, of covariance ``M_bb^-1``. The
    block that is farthest off gets the weight of the scheme IGG III,
    ``k0/t ((k1 - t)/(k1 - k0))²`` from k0 to k1 (Yang, Song and Xu 2002, Journal of Geodesy 76,
    353), with chi-square quantiles as k0 and k1; M is updated by Woodbury's identity, and the
    next is judged, until none is too far. So one false fix does not pull down its neighbours.
    """
    from scipy.stats import chi2

    plain = adjust(problem, np.ones(len(problem.blocks)))
    full, pull, blocks = plain.inverse.copy(), plain.innovation.copy(), problem.blocks
    variance = np.diag(problem.noise)
    sizes = np.array([len(rows) for rows in blocks])
    kept, dropped = (np.sqrt(chi2.isf(p, sizes)) for p in (KEPT, DROPPED))
    weights, misfits = np.ones(len(blocks)), np.zeros(len(blocks))
    waiting = np.ones(len(blocks), dtype=np.bool_)
    while waiting.any():
        misfits[waiting] = _distances(full, pull, blocks, np.flatnonzero(waiting))
        worst = int(np.argmax(np.where(waiting, misfits / kept, -1.0)))
        t, k0, k1 = misfits[worst], kept[worst], dropped[worst]
        if t <= k0:
            break
        weights[worst] = k0 / t * (max(0.0, k1 - t) / (k1 - k0)) ** 2
        waiting[worst] = False
        rows = blocks[worst]
        _update(full, pull, rows, variance[rows] * _extra(weights[worst]))
    return weights, misfits


def _distances(full: Array, pull: Array, blocks: list[Rows], which: Rows) -> Array:
    out = np.empty(len(which))
    sizes = np.array([len(blocks[b]) for b in which])
    for size in np.unique(sizes):
        same = sizes == size
        rows = np.array([blocks[b] for b in which[same]])
        own = full[rows[:, :, None], rows[:, None, :]]
        part = pull[rows]
        solved = np.linalg.solve(own, part[..., None])[..., 0]
        out[same] = np.sqrt(np.maximum((part * solved).sum(axis=1), 0.0))
    return out


def _update(full: Array, pull: Array, rows: Rows, extra: Array) -> None:
    """Add independent noise of variances `extra` to rows, in the inverse and what it acts on."""
    core = np.linalg.inv(np.diag(1.0 / extra) + full[np.ix_(rows, rows)])
    gain = full[:, rows] @ core
    pull -= gain @ pull[rows]
    full -= gain @ full[rows, :]


def _extra(weight: float) -> float:
    return min(1.0 / weight - 1.0, _LARGEST) if weight > 0.0 else _LARGEST
