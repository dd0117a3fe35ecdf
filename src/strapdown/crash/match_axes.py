"""Swapped and inverted axes, seen by a second unit on the same vehicle."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from strapdown.crash.unit_differences import (
    VelocityIncrements,
    chi_square_tail,
    difference_covariance,
    floored,
)
from strapdown.errors import Finding

Array = NDArray[np.float64]

__all__ = ["AxisMatch", "axis_findings", "match_axes", "signed_permutations"]

# What the best is ahead of another by: of this much the other is still possible, of this much
# it is not (differences of chi-square, 3 and 5 standard deviations).
POSSIBLE, EXCLUDED = 9.0, 25.0
# Where the stated axes fit this well, no others are looked for: where nothing turns, one of 48
# fits noise better by chance.
FITS = 1e-3
AXES = ("forward", "right", "down")


@dataclass(frozen=True, eq=False)
class AxisMatch:
    """Which signed permutation of a unit's axes agrees best with another unit.

    Attributes
    ----------
    accelerometers, gyro : ndarray, (3, 3)
        Turns what the second one reads into what the first one reads; the identity where they
        agree, or where the motion does not tell.
    accelerometers_lead, gyro_lead : float
        Chi-square by which the identity is worse than that; zero for the identity.
    accelerometers_sure, gyro_sure : float
        Probability of it among all 48, each as likely before.
    ambiguous : tuple of str
        Axes of the first unit about which the accelerometers do not tell: others fit within
        three standard deviations.
    """

    accelerometers: Array
    gyro: Array
    accelerometers_lead: float
    gyro_lead: float
    accelerometers_sure: float
    gyro_sure: float
    ambiguous: tuple[str, ...]

    @classmethod
    def untold(cls) -> AxisMatch:
        """Of units whose motion says nothing of it."""
        return cls(np.eye(3), np.eye(3), 0.0, 0.0, 0.0, 0.0, AXES)

    @property
    def kind(self) -> str:
        """``agree``, ``unit`` (turned as a whole), ``accelerometers``, ``gyro``, or ``both``."""
        accel = self.accelerometers_lead > EXCLUDED
        gyro = self.gyro_lead > EXCLUDED
        proper = float(np.linalg.det(self.accelerometers)) > 0.0
        if accel and gyro:
            return "unit" if proper and np.array_equal(self.accelerometers, self.gyro) else "both"
        if accel:
            return "accelerometers"
        return "gyro" if gyro else "agree"


def signed_permutations() -> Array:
    """All 48 matrices with one ±1 in each row and column; 24 of them are rotations."""
    found = []
    for order in itertools.permutations(range(3)):
        for signs in itertools.product((1.0, -1.0), repeat=3):
            matrix = np.zeros((3, 3))
            matrix[range(3), order] = signs
            found.append(matrix)
    return np.array(found)


def match_axes(first: VelocityIncrements, second: VelocityIncrements) -> AxisMatch:
    """Find the signed permutation of the second unit's axes that agrees with the first.

    Parameters
    ----------
    first, second : VelocityIncrements
        Between the same edges; gravity is in them, so that a rest within tells up from down.

    Returns
    -------
    AxisMatch

    Notes
    -----
    Least squares over the pieces with the whole covariance of the difference, since a bias is the
    same in every piece. What the least residuals exceed it by is added to every piece alike: moved
    by wrong rates, or with forces that were wrong before they were moved, nothing fits. Among
    permutations that cannot be told apart the one nearest to the identity is taken, and the
    identity where it fits with a probability of 1e-3 or more. Accelerometers
    and gyros are judged apart, since either may be wired wrong; a rigid body turns everywhere
    alike, and its forces agree after both are moved to one point, to which a wrong axis of the
    gyro does harm, too. A gyro that both share is not judged.
    """
    accel, lead, sure, other = _best(first, second, "force")
    if first.borrows(second):
        return AxisMatch(accel, np.eye(3), lead, 0.0, sure, 0.0, other)
    gyro, gyro_lead, gyro_sure, _ = _best(first, second, "rate")
    return AxisMatch(accel, gyro, lead, gyro_lead, sure, gyro_sure, other)


def _best(
    first: VelocityIncrements, second: VelocityIncrements, of: str
) -> tuple[Array, float, float, tuple[str, ...]]:
    candidates = signed_permutations()
    a, b = (v.values if of == "force" else v.turned for v in (first, second))
    left = (a[None] - b @ candidates.transpose(0, 2, 1)).reshape(len(candidates), -1, 1)
    covariance = floored(difference_covariance(first, second, of=of, turn=candidates))
    stated = np.trace(covariance, axis1=1, axis2=2) / a.size
    identity = int(np.flatnonzero((candidates == np.eye(3)).all(axis=(1, 2)))[0])
    as_stated = left[identity, :, 0]
    fit = float(as_stated @ np.linalg.solve(covariance[identity], as_stated))
    unstated = max(float(((left**2).mean(axis=(1, 2)) - stated).min()), 0.0)
    covariance = covariance + unstated * np.eye(a.size)
    cost = (left * np.linalg.solve(covariance, left)).sum(axis=(1, 2))
    behind = (cost - cost.min()) / max(1.0, float(cost.min()) / a.size)
    possible = np.flatnonzero(behind <= POSSIBLE)
    # Nearest to the identity: most ones on the diagonal.
    near = np.trace(candidates[possible], axis1=1, axis2=2)
    best = int(possible[np.lexsort((behind[possible], -near))[0]])
    if chi_square_tail(fit, a.size) >= FITS:
        best = identity
    weights = np.exp(-0.5 * behind)
    differs = (candidates[possible] != candidates[best]).any(axis=2).any(axis=0)
    return (
        candidates[best],
        float(max(behind[identity] - behind[best], 0.0)) if best != identity else 0.0,
        float(weights[best] / weights.sum()),
        tuple(name for name, d in zip(AXES, differs, strict=True) if d),
    )


def axis_findings(match: AxisMatch, first: str, second: str) -> list[Finding]:
    """Axes that are swapped or inverted, in words; empty where they agree.

    Parameters
    ----------
    match : AxisMatch
    first, second : str
        Names of the units.

    Returns
    -------
    list of Finding
    """
    kind = match.kind
    if kind == "agree":
        return []
    parts = {
        "unit": [("unit", match.accelerometers, match.accelerometers_lead)],
        "accelerometers": [("accelerometers", match.accelerometers, match.accelerometers_lead)],
        "gyro": [("gyro", match.gyro, match.gyro_lead)],
        "both": [
            ("accelerometers", match.accelerometers, match.accelerometers_lead),
            ("gyro", match.gyro, match.gyro_lead),
        ],
    }[kind]
    found = []
    for part, matrix, lead in parts:
        moved = [
            Finding(
                "crash.axis-opposite" if matrix[i, j] < 0 else "crash.axis-along",
                severity="note",
                name=first,
                axis=AXES[i],
                other=AXES[j],
            )
            for i in range(3)
            for j in [int(np.argmax(np.abs(matrix[i])))]
            if matrix[i, j] != 1.0 or i != j
        ]
        doubt = []
        if match.ambiguous and part != "gyro":
            doubt = [Finding("crash.axes-ambiguous", severity="note", axes=match.ambiguous)]
        found.append(
            Finding(
                f"crash.{part}-axes-differ",
                file=second,
                quantity="axes",
                moved=moved,
                lead=math.sqrt(lead),
                doubt=doubt,
            )
        )
    return found
