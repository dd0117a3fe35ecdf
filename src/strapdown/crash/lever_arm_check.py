"""The distance of two units on one vehicle, from how their forces differ while it turns."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from strapdown.crash.sample_effects import LEVER_ARM
from strapdown.crash.unit_differences import (
    VelocityIncrements,
    difference_covariance,
    floored,
)
from strapdown.errors import Finding

Array = NDArray[np.float64]

__all__ = ["LeverArmCheck", "check_lever_arm", "lever_arm_findings"]

SIGMAS = 4.0
# A direction that is known worse than this is not told by the motion.
MOST_SD = 0.1  # m


@dataclass(frozen=True, eq=False)
class LeverArmCheck:
    """By how much the true distance of two units differs from the stated.

    Attributes
    ----------
    correction : ndarray, (3,), m
        To be added to the stated (position of the first minus position of the second), vehicle
        axes; meaningful along `told` only.
    directions : ndarray, (3, 3)
        Columns: directions in which the estimate is uncorrelated, the best known first.
    sd : ndarray, (3,), m
        Along each of them; infinite where the vehicle did not turn.
    told : ndarray of bool, (3,)
        Whether that is better than 0.1 m.
    misfit : float
        Root of the residuals' chi-square over its degrees of freedom; where it exceeds one, the
        sds were multiplied by it.
    """

    correction: Array
    directions: Array
    sd: Array
    told: NDArray[np.bool_]
    misfit: float

    @classmethod
    def untold(cls) -> LeverArmCheck:
        """Of units whose motion says nothing of their distance."""
        return cls(np.zeros(3), np.eye(3), np.full(3, np.inf), np.zeros(3, dtype=bool), 0.0)


def check_lever_arm(first: VelocityIncrements, second: VelocityIncrements) -> LeverArmCheck:
    """Estimate how far the stated positions of two units are off.

    Parameters
    ----------
    first, second : VelocityIncrements
        Moved to one point with the stated positions, between the same edges.

    Returns
    -------
    LeverArmCheck

    Notes
    -----
    Units that were moved with positions that are off by e₁ and e₂ (true minus stated) differ by
    ``([α×] + [ω×]²) (e₁ - e₂)``: generalised least squares, with noise and every unknown of
    both but for the positions as covariance. ``[α×] + [ω×]²`` has no word on the axis of a turn
    that keeps its direction: the normal matrix tells which directions are seen. Noise of the
    angular acceleration pulls the estimate towards zero by its share of the signal's power.
    """
    shares = [v.lever for v in (first, second) if v.lever.any()]
    if not shares:
        return LeverArmCheck.untold()
    lever = np.mean(shares, axis=0)
    difference = (first.values - second.values).ravel()
    covariance = floored(difference_covariance(first, second, without=(LEVER_ARM,)))
    weighed = np.linalg.solve(covariance, np.column_stack([lever, difference]))
    normal = lever.T @ weighed[:, :3]
    values, vectors = np.linalg.eigh(0.5 * (normal + normal.T))
    values, vectors = values[::-1], vectors[:, ::-1]
    seen = values > 1e-9 * max(float(values[0]), 1e-30)
    along = np.where(seen, vectors.T @ (lever.T @ weighed[:, 3]) / np.where(seen, values, 1.0), 0.0)
    correction = vectors @ along
    left = difference - lever @ correction
    freedom = max(left.size - int(seen.sum()), 1)
    misfit = float(np.sqrt(max(left @ np.linalg.solve(covariance, left), 0.0) / freedom))
    sd = np.where(seen, max(1.0, misfit) / np.sqrt(np.where(seen, values, 1.0)), np.inf)
    return LeverArmCheck(correction, vectors, sd, sd < MOST_SD, misfit)


def lever_arm_findings(
    check: LeverArmCheck, stated_sd: float, stated: Array, first: str, second: str
) -> list[Finding]:
    """Positions that the motion contradicts; silent where it does not tell.

    Parameters
    ----------
    check : LeverArmCheck
    stated_sd : float, m
        Of each coordinate of the distance.
    stated : ndarray, (3,), m
        Position of the first minus that of the second.
    first, second : str

    Returns
    -------
    list of Finding
    """
    found = []
    along = check.directions.T @ check.correction
    for k in np.flatnonzero(check.told):
        ratio = abs(float(along[k])) / float(np.hypot(check.sd[k], stated_sd))
        if ratio <= SIGMAS:
            continue
        d = check.directions[:, k] * np.sign(along[k])
        found.append(
            Finding(
                "crash.direction-their-forces-stated",
                file=first,
                quantity="position",
                d=d[0],
                d_2=d[1],
                d_3=d[2],
                d_4=float(d @ stated) + abs(float(along[k])),
                sd=check.sd[k],
                second=second,
                d_5=float(d @ stated),
                stated_sd=stated_sd,
            )
        )
    return found
