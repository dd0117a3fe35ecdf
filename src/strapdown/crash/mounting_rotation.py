"""How one unit is turned against another on the same vehicle."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.crash.sample_effects import MOUNTING
from strapdown.crash.unit_differences import (
    VelocityIncrements,
    difference_covariance,
    floored,
)
from strapdown.errors import Finding

Array = NDArray[np.float64]

__all__ = ["MountingRotation", "mounting_rotation", "rotation_findings"]

SIGMAS = 4.0
ROUNDS = 3
TINY = 1e-30
# What is looked for is not taken for known to be small.
_TURN = (MOUNTING,)
# A direction about which less is known than this is not known.
MOST_SD = 0.2  # rad


@dataclass(frozen=True, eq=False)
class MountingRotation:
    """The rotation that turns what the second unit reads into what the first one reads.

    Attributes
    ----------
    matrix : ndarray, (3, 3)
    vector_deg : ndarray, (3,), deg
        The same as a rotation vector.
    covariance : ndarray, (3, 3), rad²
        Of a small rotation about the axes of the first unit; directions about which the motion
        says nothing have a variance of pi².
    misfit : float
        Root of the residuals' chi-square over its degrees of freedom; where it exceeds one the
        covariance was multiplied by its square.
    """

    matrix: Array
    vector_deg: Array
    covariance: Array
    misfit: float

    @classmethod
    def untold(cls) -> MountingRotation:
        """Of units whose motion says nothing of it."""
        return cls(np.eye(3), np.zeros(3), np.pi**2 * np.eye(3), 0.0)

    @property
    def sd_deg(self) -> Array:
        """About each axis of the first unit, (3,), deg."""
        return np.asarray(np.degrees(np.sqrt(np.diag(self.covariance))), dtype=np.float64)


def mounting_rotation(first: VelocityIncrements, second: VelocityIncrements) -> MountingRotation:
    """Estimate the rotation between two units from forces and rates.

    Parameters
    ----------
    first, second : VelocityIncrements
        Between the same edges.

    Returns
    -------
    MountingRotation

    Notes
    -----
    The rotation of least squares (Wahba 1965, doi:10.1137/1007077) by singular values (Markley
    1988, J. Astronaut. Sci. 36, 245), forces and rates weighed by their stated variances; then
    steps of Gauss and Newton with the whole covariances, since a bias is the same in every
    piece. Its covariance is the inverse of their normal matrix. Rates of a gyro that both share
    are left out.
    """
    C = _wahba(first, second)
    normal, step, square = np.eye(3), np.zeros(3), 0.0
    for _ in range(ROUNDS):
        normal, step, square = _refine(first, second, C)
        C = rotation.dcm_from_rotation_vector(step) @ C
    size = first.values.size + (0 if first.borrows(second) else first.turned.size)
    misfit = float(np.sqrt(max(square, 0.0) / (size - 3)))
    values, vectors = np.linalg.eigh(normal)
    variances = np.minimum(max(1.0, misfit) ** 2 / np.maximum(values, 1e-12), np.pi**2)
    return MountingRotation(
        C,
        np.degrees(rotation.rotation_vector_from_dcm(C)),
        np.asarray((vectors * variances) @ vectors.T),
        misfit,
    )


def _observed(
    first: VelocityIncrements, second: VelocityIncrements
) -> list[tuple[Array, Array, str]]:
    """Forces, and rates where they are not of one gyro."""
    rates = [] if first.borrows(second) else [(first.turned, second.turned, "rate")]
    return [(first.values, second.values, "force"), *rates]


def _wahba(first: VelocityIncrements, second: VelocityIncrements) -> Array:
    """Rotation of least squares, each kind of vector with one variance."""
    product = np.zeros((3, 3))
    for a, b, of in _observed(first, second):
        variance = float(np.trace(difference_covariance(first, second, of=of, without=_TURN)))
        product += a.T @ b / max(variance / a.size, TINY)
    u, _, vt = np.linalg.svd(product)
    return np.asarray(u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt)


def _refine(
    first: VelocityIncrements, second: VelocityIncrements, C: Array
) -> tuple[Array, Array, float]:
    """Normal matrix, small rotation and chi-square of the residuals, by all covariances."""
    normal, right, square = np.zeros((3, 3)), np.zeros(3), 0.0
    for a, b, of in _observed(first, second):
        turned = b @ C.T
        covariance = floored(difference_covariance(first, second, of=of, without=_TURN, turn=C))
        # (1 + [φ×]) v = v - [v×] φ.
        effect, left = -rotation.cross_matrix(turned).reshape(-1, 3), (a - turned).ravel()
        weighed = np.linalg.solve(covariance, np.column_stack([effect, left]))
        normal += effect.T @ weighed[:, :3]
        right += effect.T @ weighed[:, 3]
        square += float(left @ weighed[:, 3])
    step = np.linalg.lstsq(normal, right, rcond=1e-9)[0]
    return normal, np.asarray(step, dtype=np.float64), square - float(right @ step)


def rotation_findings(
    found: MountingRotation, stated_sd: float, first: str, second: str
) -> list[Finding]:
    """A rotation between the units that their mounting does not explain.

    Parameters
    ----------
    found : MountingRotation
    stated_sd : float, rad
        Of each angle between the two, as stated.
    first, second : str

    Returns
    -------
    list of Finding
        Empty where it is within four standard deviations, or not known.
    """
    vector = np.radians(found.vector_deg)
    values, vectors = np.linalg.eigh(found.covariance)
    along = vectors.T @ vector
    told = np.sqrt(values) < MOST_SD
    ratio = np.abs(along) / np.sqrt(values + stated_sd**2)
    if not (told & (ratio > SIGMAS)).any():
        return []
    x, y, z = found.vector_deg
    sd = found.sd_deg
    return [
        Finding(
            "crash.turned-against-about-forward-right",
            file=second,
            quantity="mounting angles",
            first=first,
            x=x,
            y=y,
            z=z,
            sd=sd[0],
            sd_2=sd[1],
            sd_3=sd[2],
            stated_sd_deg=np.degrees(stated_sd),
        )
    ]
