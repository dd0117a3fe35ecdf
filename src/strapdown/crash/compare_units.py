"""Comparison of several units on one vehicle: whether they agree within stated uncertainty."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from strapdown.crash.at_point import PointKinematics
from strapdown.crash.mounting_checks import (
    AxisMatch,
    LeverArmCheck,
    MountingRotation,
    axis_findings,
    check_lever_arm,
    lever_arm_findings,
    match_axes,
    mounting_rotation,
    rotation_findings,
)
from strapdown.crash.unit_differences import (
    VelocityIncrements,
    chi_square_tail,
    common_edges,
    difference_covariance,
    floored,
    joint_covariance,
    velocity_increments,
)
from strapdown.errors import ConfigError, Finding

__all__ = [
    "UnitAgainstAll",
    "UnitComparison",
    "UnitPair",
    "chi_square_along",
    "clipped_axes",
    "clipped_pieces",
    "compare_units",
    "measured_axes",
    "measured_by_all",
    "measured_by_any",
]


Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

AXES = ("forward", "right", "down")
# Variance of assumed axes, relative to the largest: no weight beside measured ones.
NO_WEIGHT = 1e8


def compare_units(
    units: Sequence[PointKinematics],
    *,
    window: tuple[float, float] | None = None,
    pieces: int = 20,
    level: float = 1e-3,
) -> UnitComparison:
    """Compare units pairwise and against their weighted combination.

    Parameters
    ----------
    units : sequence of PointKinematics
        Two or more, of one rigid vehicle, at one point.
    window : (start, end), s, optional
        Window to compare; by default -0.1 to 0.75 s, as far as all units have samples.
    pieces : int
        Number of equal intervals over which mean forces are compared, reduced so that each has
        two samples. The test is equivalent to one of the delta-V curve at the interval edges.
    level : float
        Probability below which a difference counts as a disagreement.

    Returns
    -------
    UnitComparison

    Notes
    -----
    Only directions that both units measure are compared; assumed axes are excluded. With the
    difference d of the velocity increments and its covariance C from all stated uncertainties,
    ``dᵀ C⁻¹ d`` is chi-square distributed. Common errors (a shared gyro, the common leveling
    attitude) cancel in d and in C. Structural ringing at one position only, and any other unstated
    error, shows as a disagreement; the message gives the interval where it is largest. Intervals
    in which either unit was clipped without a wider range are left out, and a finding reports it.
    Each pair is checked for swapped axes, a rotated mounting and wrong positions.

    Raises
    ------
    There are fewer than two units, or they do not cover the window.
        There are fewer than two units, or they do not cover the window.
    ConfigError
        The window is too short, or an option is out of range.
    """
    if not (pieces >= 3 and 0.0 < level < 1.0):
        raise ConfigError(
            "crash.pieces-level", quantity="pieces, level", pieces=pieces, level=level
        )
    edges = common_edges(units, window, pieces)
    increments = [velocity_increments(u, edges) for u in units]
    cut = [clipped_pieces(u, edges) for u in units]
    pairs = tuple(
        _pair(units[i], units[j], increments[i], increments[j], ~(cut[i] | cut[j]), level)
        for i, j in itertools.combinations(range(len(units)), 2)
    )
    kept = ~np.any(cut, axis=0)
    together = _against_all(units, [v.of_pieces(kept) for v in increments], kept)
    chi, freedom = together.chi_square, together.freedom
    probability = chi_square_tail(chi, freedom)
    findings = [_left_out(u, edges, c) for u, c in zip(units, cut, strict=True) if c.any()]
    findings += [f for p in pairs for f in p.findings]
    findings += _odd_one(units, pairs)
    return UnitComparison(
        edges,
        pairs,
        _curve(together.combined, kept) + together.told,
        _curve_sd(together.covariance, kept) + together.told,
        together.against,
        chi,
        freedom,
        probability,
        probability >= level and all(p.agree for p in pairs),
        tuple(findings),
    )


def _pair(
    first: PointKinematics,
    second: PointKinematics,
    a: VelocityIncrements,
    b: VelocityIncrements,
    kept: Flags,
    level: float,
) -> UnitPair:
    edges = a.edges
    a, b = a.of_pieces(kept), b.of_pieces(kept)
    difference, covariance = (a.values - b.values).ravel(), difference_covariance(a, b)
    basis = measured_by_all((first, second))
    told = np.where(measured_axes(basis), 0.0, np.nan)
    chi, freedom = chi_square_along(basis, difference, covariance)
    probability = chi_square_tail(chi, freedom)
    curve, sd = _curve(difference, kept) + told, _curve_sd(covariance, kept) + told
    lengths = np.diff(edges)[kept, None]
    force = np.full((2, kept.size, 3), np.nan)
    force[0, kept] = difference.reshape(-1, 3) / lengths + told
    force[1, kept] = np.sqrt(np.diag(covariance)).reshape(-1, 3) / lengths + told
    findings: list[Finding] = []
    whole = not (first.assumed_axes or second.assumed_axes) and bool(kept.any())
    if whole:
        axes, turned, lever = match_axes(a, b), mounting_rotation(a, b), check_lever_arm(a, b)
    else:
        # The checks of relative mounting need three measured axes and a gyro on both units.
        axes, turned, lever = AxisMatch.untold(), MountingRotation.untold(), LeverArmCheck.untold()
    agree = probability >= level
    if not kept.any():
        findings.append(_nothing_whole(first, second))
    elif freedom == 0:
        findings.append(_nothing_in_common(first, second))
    elif not agree:
        findings.append(_disagreement(first, second, edges, curve, sd, chi, freedom, probability))
    found = axis_findings(axes, first.name, second.name)
    if whole and not found and first.prepared is not None and second.prepared is not None:
        # A small rotation or a wrong position is not meaningful while axes are swapped.
        mounted = first.prepared.unit.mounting, second.prepared.unit.mounting
        angles = math.radians(math.hypot(*(m.angles_sd_deg for m in mounted)))
        found = rotation_findings(turned, angles, first.name, second.name)
        found += lever_arm_findings(
            lever,
            math.hypot(*(m.position_sd for m in mounted)),
            np.subtract(mounted[0].position, mounted[1].position),
            first.name,
            second.name,
        )
    return UnitPair(
        first.name,
        second.name,
        edges,
        curve,
        sd,
        force[0],
        force[1],
        chi,
        freedom,
        probability,
        agree,
        axes,
        turned,
        lever,
        tuple(findings + found),
    )


@dataclass(frozen=True, eq=False)
class _Together:
    """Weighted mean of the increments, its covariance, chi-square, and each unit against it."""

    combined: Array
    covariance: Array
    told: Array
    chi_square: float
    freedom: int
    against: tuple[UnitAgainstAll, ...]


def _against_all(
    units: Sequence[PointKinematics], increments: Sequence[VelocityIncrements], kept: Flags
) -> _Together:
    """Combine `increments` of the kept intervals and compare each unit with the combination."""
    size = increments[0].values.size
    if size == 0:
        return _nothing_together(units, kept)
    joint = floored(joint_covariance(increments))
    pieces, largest = size // 3, float(np.diagonal(joint).max())
    bases = [measured_by_all((u,)) for u in units]
    for k, basis in enumerate(bases):
        if basis.shape[1] < 3:
            # Assumed axes get no weight beside measured ones.
            rows = slice(k * size, (k + 1) * size)
            unmeasured = np.eye(3) - basis @ basis.T
            joint[rows, rows] += NO_WEIGHT * largest * np.kron(np.eye(pieces), unmeasured)
    whole = np.tile(np.eye(size), (len(units), 1))
    given = np.concatenate([v.values.ravel() for v in increments])
    weighed = np.linalg.solve(joint, np.column_stack([whole, given]))
    covariance = np.linalg.inv(whole.T @ weighed[:, :size])
    combined = covariance @ (whole.T @ weighed[:, size])
    left = given - whole @ combined
    against = []
    for k, (u, basis) in enumerate(zip(units, bases, strict=True)):
        rows = slice(k * size, (k + 1) * size)
        # The unit is part of the combination: their covariance is that of the combination.
        own = joint[rows, rows] - covariance
        chi, freedom = chi_square_along(basis, left[rows], own)
        told = np.where(measured_axes(basis), 0.0, np.nan)
        against.append(
            UnitAgainstAll(
                u.name,
                _curve(left[rows], kept) + told,
                _curve_sd(own, kept) + told,
                chi,
                freedom,
                chi_square_tail(chi, freedom),
            )
        )
    several = measured_by_any(units)
    freedom = pieces * (sum(b.shape[1] for b in bases) - several.shape[1])
    return _Together(
        combined,
        np.asarray(covariance),
        np.where(measured_axes(several), 0.0, np.nan),
        _square(left, joint),
        freedom,
        tuple(against),
    )


def _square(difference: Array, covariance: Array) -> float:
    return float(difference @ np.linalg.solve(floored(covariance), difference))


def _nothing_together(units: Sequence[PointKinematics], kept: Flags) -> _Together:
    """Return the result where all intervals were left out."""
    none = np.full((kept.size + 1, 3), np.nan)
    return _Together(
        np.zeros(0),
        np.zeros((0, 0)),
        np.full(3, np.nan),
        0.0,
        0,
        tuple(UnitAgainstAll(u.name, none, none, 0.0, 0, 1.0) for u in units),
    )


def _curve(increments: Array, kept: Flags) -> Array:
    """Cumulative sums at all edges; left-out intervals contribute zero."""
    whole = np.zeros((kept.size, 3))
    whole[kept] = increments.reshape(-1, 3)
    return np.vstack([np.zeros(3), np.cumsum(whole, axis=0)])


def _curve_sd(covariance: Array, kept: Flags) -> Array:
    m = kept.size
    total = np.kron(np.tril(np.ones((m, m)))[:, kept], np.eye(3))
    variance = np.maximum(np.einsum("ij,jk,ik->i", total, covariance, total), 0.0)
    return np.vstack([np.zeros(3), np.sqrt(variance).reshape(-1, 3)])


def _disagreement(
    first: PointKinematics,
    second: PointKinematics,
    edges: Array,
    curve: Array,
    sd: Array,
    chi: float,
    freedom: int,
    probability: float,
) -> Finding:
    ratio = np.abs(curve[1:]) / np.where(sd[1:] > 0.0, sd[1:], np.inf) + 0.0 * sd[1:]
    row, axis = np.unravel_index(int(np.nanargmax(ratio)), ratio.shape)
    share = f"{probability:.1g}" if probability > 1e-12 else "less than 1e-12"
    return Finding(
        "crash.disagree-their-common-point-chi",
        file=first.name,
        quantity="delta-V",
        name=second.name,
        chi=chi,
        freedom=freedom,
        share=share,
        axes=AXES[axis],
        edges=edges[row + 1],
        curve=curve[row + 1, axis],
        sd=sd[row + 1, axis],
    )


def _left_out(unit: PointKinematics, edges: Array, cut: Flags) -> Finding:
    pieces = np.flatnonzero(cut)
    return Finding(
        "crash.end-range-between-pieces-record",
        file=unit.name,
        quantity="comparison",
        edges=edges[pieces[0]],
        edges_2=edges[pieces[-1] + 1],
        size=pieces.size,
        size_2=cut.size,
    )


def _nothing_whole(first: PointKinematics, second: PointKinematics) -> Finding:
    return Finding(
        "crash.no-piece-record-neither-end",
        file=first.name,
        quantity="comparison",
        name=second.name,
    )


def _nothing_in_common(first: PointKinematics, second: PointKinematics) -> Finding:
    return Finding(
        "crash.measure-no-axis-common-not", file=first.name, quantity="delta-V", name=second.name
    )


def _odd_one(units: Sequence[PointKinematics], pairs: Sequence[UnitPair]) -> list[Finding]:
    """Of three or more units, find the one without which the others agree."""
    if len(units) < 3 or all(p.agree for p in pairs):
        return []
    odd = [
        u.name for u in units if all(p.agree for p in pairs if u.name not in (p.first, p.second))
    ]
    if len(odd) != 1:
        return []
    return [Finding("crash.others-agree-another-not", file=odd[0], quantity="delta-V")]


# Results of a comparison of units.


@dataclass(frozen=True, eq=False)
class UnitPair:
    """Comparison of two units at their common point.

    Attributes
    ----------
    first, second : str
    edges : ndarray, (m + 1,), s
    difference : ndarray, (m + 1, 3), m/s
        Integral of the first unit's specific force minus the second's, vehicle axes, from the
        first edge; intervals in which either was clipped contribute zero.
    sd : ndarray, (m + 1, 3), m/s
        From the uncertainty stated for both. NaN along axes that either assumes, here and below.
    force_difference, force_sd : ndarray, (m, 3), m/s²
        Means over each interval; NaN where either was clipped.
    chi_square, freedom : float, int
        Over the remaining intervals and the axes that both measure, with their covariance.
        Zero if none remain.
    probability : float
        Probability of a chi-square at least this large if the stated uncertainty is right.
    agree : bool
    axes : AxisMatch
    turned : MountingRotation
    lever_arm : LeverArmCheck
        These three are not meaningful where either assumes an axis or the rates.
    findings : tuple of Finding
    """

    first: str
    second: str
    edges: Array = field(repr=False)
    difference: Array = field(repr=False)
    sd: Array = field(repr=False)
    force_difference: Array = field(repr=False)
    force_sd: Array = field(repr=False)
    chi_square: float
    freedom: int
    probability: float
    agree: bool
    axes: AxisMatch = field(repr=False)
    turned: MountingRotation = field(repr=False)
    lever_arm: LeverArmCheck = field(repr=False)
    findings: tuple[Finding, ...]


@dataclass(frozen=True, eq=False)
class UnitAgainstAll:
    """One unit against the combination of all.

    Attributes
    ----------
    name : str
    difference, sd : ndarray, (m + 1, 3), m/s
        Its delta-V minus that of the combination, and the stated standard deviation of the
        difference, which accounts for common errors. NaN along axes that it, or all, assume.
    chi_square, freedom, probability
        As `UnitPair`.
    """

    name: str
    difference: Array = field(repr=False)
    sd: Array = field(repr=False)
    chi_square: float
    freedom: int
    probability: float


@dataclass(frozen=True, eq=False)
class UnitComparison:
    """Comparison of all units of a vehicle at one point.

    Attributes
    ----------
    edges : ndarray, (m + 1,), s
    pairs : tuple of UnitPair
    combined : ndarray, (m + 1, 3), m/s
        Delta-V of the optimally weighted combination, gravity included, body axes; NaN along
        axes that all units assume.
    combined_sd : ndarray, (m + 1, 3), m/s
    against : tuple of UnitAgainstAll
    chi_square, freedom, probability
        All units against the combination.
    agree : bool
    findings : tuple of Finding
    """

    edges: Array = field(repr=False)
    pairs: tuple[UnitPair, ...]
    combined: Array = field(repr=False)
    combined_sd: Array = field(repr=False)
    against: tuple[UnitAgainstAll, ...]
    chi_square: float
    freedom: int
    probability: float
    agree: bool
    findings: tuple[Finding, ...]


# Directions measured by units of which some assume axes.


# Squared cosines closer to 0 or 1 than this are rounding.
ROUNDING = 1e-9
# A vehicle axis counts as measured from this squared cosine on: 18 deg.
MOST = 0.9


def measured_by_all(units: Sequence[PointKinematics]) -> Array:
    """Orthonormal columns spanning the directions that every unit measures, (3, r)."""
    total = sum((_unmeasured(u) for u in units), np.zeros((3, 3)))
    if not total.any():
        return np.eye(3)
    values, vectors = np.linalg.eigh(total)
    return np.asarray(vectors[:, values < ROUNDING])


def measured_by_any(units: Sequence[PointKinematics]) -> Array:
    """Orthonormal columns spanning the directions that at least one unit measures, (3, r)."""
    measured = np.mean([np.eye(3) - _unmeasured(u) for u in units], axis=0)
    values, vectors = np.linalg.eigh(measured)
    return np.asarray(vectors[:, values > ROUNDING])


def measured_axes(basis: Array) -> NDArray[np.bool_]:
    """Which of the vehicle's axes lie within these directions, (3,)."""
    return np.asarray((basis**2).sum(axis=1) > MOST)


def chi_square_along(basis: Array, difference: Array, covariance: Array) -> tuple[float, int]:
    """Chi-square of a difference along some directions, and its degrees of freedom.

    Parameters
    ----------
    basis : ndarray, (3, r)
        Orthonormal columns.
    difference : ndarray, (3 m,)
        By interval, then axis.
    covariance : ndarray, (3 m, 3 m)
    """
    if basis.shape[1] < 3:
        along = np.kron(np.eye(difference.size // 3), basis)
        difference, covariance = along.T @ difference, along.T @ covariance @ along
    if not difference.size:
        return 0.0, 0
    return float(difference @ np.linalg.solve(floored(covariance), difference)), difference.size


def _unmeasured(unit: PointKinematics) -> Array:
    return np.zeros((3, 3)) if unit.unmeasured is None else unit.unmeasured


# Intervals in which a unit was clipped without a wider range.


# Squared cosine below which a sensor axis does not count: within 6 deg of perpendicular.
LEAST_SHARE = 0.01


def clipped_axes(unit: PointKinematics, window: tuple[float, float]) -> Flags:
    """Along which of the vehicle's axes a unit was clipped in a window.

    Parameters
    ----------
    unit : PointKinematics
    window : (float, float), s

    Returns
    -------
    ndarray of bool, (3,)
        All False for a mean of several units. A clipped gyro affects all axes and is not included.
    """
    prepared = unit.prepared
    if prepared is None:
        return np.zeros(3, dtype=bool)
    time = prepared.imu.index.to_numpy(dtype=np.float64)
    within = (time >= window[0]) & (time <= window[1])
    cut = prepared.clipped[within].any(axis=0)
    share = prepared.unit.mounting.C_vs**2 > LEAST_SHARE
    return np.asarray((share & cut).any(axis=1))


def clipped_pieces(unit: PointKinematics, edges: Array) -> Flags:
    """In which time intervals the readings of a unit are affected by clipping.

    Parameters
    ----------
    unit : PointKinematics
    edges : ndarray, (m + 1,), s

    Returns
    -------
    ndarray of bool, (m,)
        Whether a clipped sample of accelerometers or gyro, or a neighbor of one, contributes to
        the interval. Neighbors: the gyro samples that form one angular acceleration, and the
        accelerometer sample up to which the line between samples extends.
    """
    prepared = unit.prepared
    if prepared is None:
        return np.zeros(len(edges) - 1, dtype=bool)
    time = prepared.imu.index.to_numpy(dtype=np.float64)
    arm = unit.moved is not None and bool(unit.moved.lever_arm.any())
    wide = unit.moved.slope.slope.shape[1] // 2 if arm and unit.moved is not None else 0
    cut = _spread(_any(prepared.clipped), 1)
    # A clipped gyro affects the accelerometer readings only through a lever arm.
    cut |= _spread(_any(prepared.gyro_clipped), wide + 1) if arm else False
    at = time[cut]
    return np.asarray(
        np.searchsorted(at, edges[1:], side="right") > np.searchsorted(at, edges[:-1], side="left")
    )


def _any(flags: Flags) -> Flags:
    return np.asarray(flags.any(axis=1))


def _spread(flags: Flags, by: int) -> Flags:
    """Flags extended by so many neighbors on either side."""
    return np.asarray(np.convolve(flags, np.ones(2 * by + 1), mode="same") > 0.5)
