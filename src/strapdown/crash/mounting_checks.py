"""Relative mounting of two units on one vehicle: rotation, lever arm, swapped axes."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.crash.unit_differences import (
    VelocityIncrements,
    chi_square_tail,
    difference_covariance,
    floored,
)
from strapdown.crash.unit_effects import LEVER_ARM, MOUNTING
from strapdown.errors import Finding

__all__ = [
    "AxisMatch",
    "LeverArmCheck",
    "MountingRotation",
    "axis_findings",
    "check_lever_arm",
    "lever_arm_findings",
    "match_axes",
    "mounting_rotation",
    "rotation_findings",
    "signed_permutations",
]


Array = NDArray[np.float64]

SIGMAS = 4.0
ROUNDS = 3
TINY = 1e-30
# The mounting rotation is the estimated quantity, so its prior uncertainty is excluded.
_TURN = (MOUNTING,)
# Directions with a larger standard deviation count as unknown.
MOST_SD = 0.2  # rad


@dataclass(frozen=True, eq=False)
class MountingRotation:
    """Rotation from the axes of the second unit to those of the first.

    Attributes
    ----------
    matrix : ndarray, (3, 3)
    vector_deg : ndarray, (3,), deg
        The same as a rotation vector.
    covariance : ndarray, (3, 3), rad²
        Of a small rotation about the axes of the first unit; unobserved directions have a
        variance of pi².
    misfit : float
        Root of the residuals' chi-square over its degrees of freedom; where it exceeds one, the
        covariance has been multiplied by its square.
    """

    matrix: Array
    vector_deg: Array
    covariance: Array
    misfit: float

    @classmethod
    def untold(cls) -> MountingRotation:
        """Return the result where the rotation is not observable."""
        return cls(np.eye(3), np.zeros(3), np.pi**2 * np.eye(3), 0.0)

    @property
    def sd_deg(self) -> Array:
        """Standard deviation about each axis of the first unit, (3,), deg."""
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
    The least-squares rotation (Wahba 1965, doi:10.1137/1007077) by singular values (Markley
    1988, J. Astronaut. Sci. 36, 245), forces and rates weighted by their stated variances; then
    Gauss-Newton steps with the full covariances, since a bias is common to all intervals. The
    covariance of the estimate is the inverse of the normal matrix. Rates of a shared gyro are
    left out.
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
    """Return forces, and rates unless both units share one gyro."""
    rates = [] if first.borrows(second) else [(first.turned, second.turned, "rate")]
    return [(first.values, second.values, "force"), *rates]


def _wahba(first: VelocityIncrements, second: VelocityIncrements) -> Array:
    """Least-squares rotation with one variance for each kind of vector."""
    product = np.zeros((3, 3))
    for a, b, of in _observed(first, second):
        variance = float(np.trace(difference_covariance(first, second, of=of, without=_TURN)))
        product += a.T @ b / max(variance / a.size, TINY)
    u, _, vt = np.linalg.svd(product)
    return np.asarray(u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt)


def _refine(
    first: VelocityIncrements, second: VelocityIncrements, C: Array
) -> tuple[Array, Array, float]:
    """Normal matrix, small rotation and chi-square of the residuals, with full covariances."""
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
    """Report a rotation between the units beyond the stated mounting uncertainty.

    Parameters
    ----------
    found : MountingRotation
    stated_sd : float, rad
        Stated standard deviation of each angle between the two.
    first, second : str

    Returns
    -------
    list of Finding
        Empty where it is within four standard deviations, or unknown.
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


# Lever arm between two units, from the difference of their forces while the vehicle turns.

# Directions with a larger standard deviation count as unobserved.
LEVER_ARM_CHECK_MOST_SD = 0.1  # m


@dataclass(frozen=True, eq=False)
class LeverArmCheck:
    """Correction of the stated lever arm between two units.

    Attributes
    ----------
    correction : ndarray, (3,), m
        To be added to the stated (position of the first minus position of the second), vehicle
        axes; meaningful along `told` only.
    directions : ndarray, (3, 3)
        Columns: directions in which the estimate is uncorrelated, the most certain first.
    sd : ndarray, (3,), m
        Along each of these; infinite where the vehicle did not turn.
    told : ndarray of bool, (3,)
        Whether the standard deviation is below 0.1 m.
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
        """Return the result where the lever arm is not observable."""
        return cls(np.zeros(3), np.eye(3), np.full(3, np.inf), np.zeros(3, dtype=bool), 0.0)


def check_lever_arm(first: VelocityIncrements, second: VelocityIncrements) -> LeverArmCheck:
    """Estimate the error of the stated relative position of two units.

    Parameters
    ----------
    first, second : VelocityIncrements
        Moved to one point with the stated positions, between the same edges.

    Returns
    -------
    LeverArmCheck

    Notes
    -----
    Units moved with position errors e₁ and e₂ (true minus stated) differ by
    ``([α×] + [ω×]²) (e₁ - e₂)``: generalized least squares, with noise and all unknowns of
    both except the positions as covariance. The component along a fixed axis of rotation is not
    observable; the normal matrix shows which directions are. Noise of the angular acceleration
    biases the estimate toward zero by its share of the signal power.
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
    return LeverArmCheck(correction, vectors, sd, sd < LEVER_ARM_CHECK_MOST_SD, misfit)


def lever_arm_findings(
    check: LeverArmCheck, stated_sd: float, stated: Array, first: str, second: str
) -> list[Finding]:
    """Report positions that the motion contradicts; empty where they are not observable.

    Parameters
    ----------
    check : LeverArmCheck
    stated_sd : float, m
        Stated standard deviation of each coordinate of the relative position.
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


# Swapped and inverted axes, detected with a second unit on the same vehicle.


# Differences of chi-square to the best candidate: below the first another is still possible,
# above the second it is excluded (3 and 5 standard deviations).
POSSIBLE, EXCLUDED = 9.0, 25.0
# Where the stated axes fit with this probability, others are not searched: without rotation, one
# of 48 candidates fits noise better by chance.
FITS = 1e-3
AXES = ("forward", "right", "down")


@dataclass(frozen=True, eq=False)
class AxisMatch:
    """Signed permutation of a unit's axes that agrees best with another unit.

    Attributes
    ----------
    accelerometers, gyro : ndarray, (3, 3)
        Maps the readings of the second unit to the axes of the first; the identity where they
        agree or where the motion cannot decide.
    accelerometers_lead, gyro_lead : float
        Excess chi-square of the identity over this permutation; zero for the identity.
    accelerometers_sure, gyro_sure : float
        Posterior probability among all 48 with equal priors.
    ambiguous : tuple of str
        Axes of the first unit that the accelerometers leave ambiguous: other permutations fit
        within three standard deviations.
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
        """Return the result where the axes are not observable."""
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
    """All 48 matrices with one ±1 in each row and column; 24 are rotations."""
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
        Between the same edges; gravity is included, so that a stationary interval separates up
        from down.

    Returns
    -------
    AxisMatch

    Notes
    -----
    Least squares over the intervals with the full covariance of the difference, since a bias is
    common to all intervals. The excess of the smallest residuals is added to every interval alike:
    after moving with wrong rates, or forces that were wrong before moving, no permutation fits.
    Among indistinguishable permutations the one nearest to the identity is taken, and the identity
    where it fits with a probability of 1e-3 or more. Accelerometers and gyros are judged
    separately, since either may be wired wrong: the angular rate of a rigid body is the same
    everywhere, while forces agree only after both are moved to one point, which a wrong gyro axis
    also disturbs. A shared gyro is not judged.
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
    """Report swapped or inverted axes; empty where they agree.

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
