"""How units on one vehicle compare: what a comparison found."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from strapdown.crash.lever_arm_check import LeverArmCheck
from strapdown.crash.match_axes import AxisMatch
from strapdown.crash.mounting_rotation import MountingRotation
from strapdown.errors import Finding

Array = NDArray[np.float64]

__all__ = ["UnitAgainstAll", "UnitComparison", "UnitPair"]


@dataclass(frozen=True, eq=False)
class UnitPair:
    """Two units at their common point.

    Attributes
    ----------
    first, second : str
    edges : ndarray, (m + 1,), s
    difference : ndarray, (m + 1, 3), m/s
        Integral of the first one's specific force minus that of the second's, vehicle axes,
        from the first edge; pieces in which either was at the end of its range add nothing.
    sd : ndarray, (m + 1, 3), m/s
        As both state it. NaN along axes that either assumes, here and in what follows.
    force_difference, force_sd : ndarray, (m, 3), m/s²
        Means over each piece; NaN in pieces in which either was at the end of its range.
    chi_square, freedom : float, int
        Of all other pieces and axes together, with their covariance; of those axes that both
        measure. Zero, where there is none.
    probability : float
        Of a chi-square as large or larger, where the statements are right.
    agree : bool
    axes : AxisMatch
    turned : MountingRotation
    lever_arm : LeverArmCheck
        These three tell nothing where either assumes an axis or the turning.
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
        Its delta-V minus the combination's, and as stated: what it shares with the combination
        is taken into account. NaN along axes that it, or that all, assume.
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
    """All units of a vehicle at one point.

    Attributes
    ----------
    edges : ndarray, (m + 1,), s
    pairs : tuple of UnitPair
    combined : ndarray, (m + 1, 3), m/s
        Delta-V of the best weighted combination, gravity still in it, body axes; NaN along axes
        that all units assume.
    combined_sd : ndarray, (m + 1, 3), m/s
    against : tuple of UnitAgainstAll
    chi_square, freedom, probability
        Of all units against the combination.
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
