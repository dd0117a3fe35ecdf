"""Poisson's equation for the direction cosine matrix, Alexiev (2021), Eqs. (11)-(13)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from strapdown import rotation
from strapdown._kernels import attitude as kernel
from strapdown._kernels import rotation as kernel_rotation
from strapdown.attitude_algorithms.algorithm import Accuracy, AttitudeAlgorithm
from strapdown.constants import Array
from strapdown.errors import ConfigError


@dataclass(frozen=True)
class DirectionCosine(AttitudeAlgorithm):
    """The matrix, multiplied at each step by the exponential of the increment.

    Exact wherever the direction of the rate is constant within each step; on general motion
    of order 2, because the increment alone has no information on the change of direction.

    Parameters
    ----------
    order : int
        Highest power of the increment in the series of the exponential, 1 to 20; 0 for the
        closed form (12).
    orthogonalise_every : int
        Steps between re-orthogonalizations, 0 for never. A truncated exponential is not
        orthogonal, and the loss accumulates; the closed form loses only rounding.
    """

    name = "dcm"
    title = "Direction cosines"
    equations = "(11)-(13)"
    summary = "the 3x3 matrix times the exponential of each increment"
    width = 9
    advance_kernel = staticmethod(kernel.dcm_advance)
    update_kernel = staticmethod(kernel.dcm_update)

    order: int = 0
    orthogonalise_every: int = 0

    def __post_init__(self) -> None:
        if not 0 <= self.order <= 20:
            raise ConfigError("attitude.out-range", quantity="dcm:order", order=self.order)
        if self.orthogonalise_every < 0:
            raise ConfigError(
                "attitude.negative",
                quantity="dcm:orthogonalise_every",
                orthogonalise_every=self.orthogonalise_every,
            )

    def begin(self, q_nb: Array) -> Array:
        """Return the matrix row by row and the steps since its orthogonalization."""
        return np.append(rotation.dcm_from_quaternion(q_nb).ravel(), 0.0)

    def quaternions(self, history: Array) -> Array:
        """Read the matrices as rotations; those that have lost orthogonality, as the nearest."""
        rows = history
        if self.order:
            # The nearest rotation in Frobenius norm; a truncated series is not orthogonal.
            left, _, right = np.linalg.svd(history.reshape(-1, 3, 3))
            rows = (left @ right).reshape(-1, 9)
        q = np.empty((len(rows), 4))
        kernel_rotation.quats_from_dcms(np.ascontiguousarray(rows), q)
        return q

    @property
    def accuracy(self) -> Accuracy:
        """Two, whatever the order of the series: truncation only scales the matrix."""
        return Accuracy(increments=2, rates=2, coning=2)

    def diagnostics(self, state: Array, time: Array) -> dict[str, float]:
        """Return the largest element of C^T C - I at the end."""
        matrix = state[:9].reshape(3, 3)
        return {"orthogonality_loss": float(np.abs(matrix.T @ matrix - np.eye(3)).max())}
