"""What the noise of the samples of a unit does to weighted sums of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from strapdown.crash.at_point import AtPoint

Array = NDArray[np.float64]

__all__ = ["NoiseOfSums", "noise_of_sums"]


@dataclass(frozen=True, eq=False)
class NoiseOfSums:
    """Noise of m weighted sums of specific force and rates; rows by sum, then axis.

    Attributes
    ----------
    of_force : ndarray, (3 m, 3 m), (m/s)²
        Covariance of the sums of the specific force from the accelerometers' noise.
    through_arm : ndarray, (3 m, q), m/s
        What one standard deviation of each of q independent numbers, the noise of the gyro, does
        to them through the lever arm.
    turned : ndarray, (3 m, q), rad
        The same to the sums of the rates.
    gyro : str
        Name of the unit that has the gyro: others that borrow it have the same numbers.
    """

    of_force: Array
    through_arm: Array
    turned: Array
    gyro: str

    def of_rows(self, rows: NDArray[np.bool_]) -> NoiseOfSums:
        """Some of the rows, (3 m,)."""
        return NoiseOfSums(
            self.of_force[np.ix_(rows, rows)], self.through_arm[rows], self.turned[rows], self.gyro
        )


def noise_of_sums(at_point: AtPoint, weights: Array) -> NoiseOfSums:
    """Find what the noise of the samples does to weighted sums of them.

    Parameters
    ----------
    at_point : AtPoint
        Of a unit, or of a combination, whose samples are taken as independent.
    weights : ndarray, (m, n), s

    Returns
    -------
    NoiseOfSums
        What the noise of the gyro does through the lever arm keeps its correlation from sample to
        sample: it all but cancels in a change of velocity.
    """
    m = len(weights)
    prepared, moved, effects = at_point.prepared, at_point.moved, at_point.effects
    within = _touched(at_point, weights)
    few = weights[:, within]
    if prepared is None or moved is None:
        own = _diagonal(effects.force_noise[within])
        turning = _root(_diagonal(effects.rate_noise[within]))
    else:
        own = prepared.noise_covariance[within]
        turning = _root(prepared.gyro_noise_covariance[within])
    blocks = np.einsum("an,nij,bn->aibj", few, own, few, optimize=True)
    turned = np.einsum("an,nik->aink", few, turning).reshape(3 * m, -1)
    if moved is None or not moved.lever_arm.any():
        arm = np.zeros_like(turned)
    else:
        by_rate = moved.of_rates_in_sums(weights)[:, within]
        arm = np.einsum("anij,njk->aink", by_rate, turning).reshape(3 * m, -1)
    return NoiseOfSums(blocks.reshape(3 * m, 3 * m), arm, turned, at_point.gyro)


def _touched(at_point: AtPoint, weights: Array) -> slice:
    """The samples that count in a sum, with those from which an angular acceleration is made."""
    used = np.flatnonzero(weights.any(axis=0))
    if not used.size:
        return slice(0, 0)
    wide = 0 if at_point.moved is None else at_point.moved.slope.slope.shape[1]
    return slice(max(int(used[0]) - wide, 0), int(used[-1]) + wide + 1)


def _diagonal(sd: Array) -> Array:
    return np.asarray(sd[:, :, None] ** 2 * np.eye(3))


def _root(covariances: Array) -> Array:
    """Matrices whose product with their transpose is the covariance of each sample."""
    values, vectors = np.linalg.eigh(covariances)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0))[:, None, :])
