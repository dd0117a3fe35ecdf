"""Interval of a direction of force that keeps its coverage where the delta-V is small."""

from __future__ import annotations

import math
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown.crash.delta_v import DeltaV
from strapdown.crash.pdof import covariance_of, vector_of
from strapdown.errors import ConfigError
from strapdown.rotation import within_half_turn

Array = NDArray[np.float64]

__all__ = ["AngleInterval", "PdofInterval", "pdof_interval"]


@dataclass(frozen=True)
class AngleInterval:
    """All directions that the measurement does not contradict.

    Attributes
    ----------
    low_deg, high_deg : float, deg
        Counted on from the estimate, so that ``low <= estimate <= high`` and either may lie
        beyond 180. The whole range where `undetermined`.
    undetermined : bool
        No direction is contradicted: the change of velocity may be zero.
    """

    low_deg: float
    high_deg: float
    undetermined: bool = False

    @property
    def width_deg(self) -> float:
        """From low to high, deg."""
        return self.high_deg - self.low_deg

    def contains(self, angle_deg: float) -> bool:
        """Whether an angle, or that plus full turns, is within."""
        return self.undetermined or (angle_deg - self.low_deg) % 360.0 <= self.width_deg


@dataclass(frozen=True)
class PdofInterval:
    """Intervals of the two angles of a direction of force.

    Attributes
    ----------
    horizontal, vertical : AngleInterval
    level : float
        Share of cases in which each contains the truth.
    """

    horizontal: AngleInterval
    vertical: AngleInterval
    level: float


def pdof_interval(
    change: DeltaV | ArrayLike, covariance: ArrayLike, level: float = 0.95
) -> PdofInterval:
    """Confidence intervals of the direction of force.

    Parameters
    ----------
    change : DeltaV or array_like, (3,), m/s
        In any frame; of north-east-down the horizontal interval is that of the azimuth.
    covariance : array_like, (3, 3), m²/s²
        Of its error, taken as normal.
    level : float
        Between 0 and 1.

    Returns
    -------
    PdofInterval
        The horizontal interval has the coverage `level` for every true change and covariance:
        exactly, but for the chance that the estimate points away from the truth by more than a
        right angle (in the metric of the covariance), which is below 1e-4 where the change is
        four standard deviations long. Where it may be zero the interval is the whole circle and
        says `undetermined`. The vertical interval is the same construction in the vertical plane
        through the estimate, within [-90, 90]; it neglects the error of the horizontal
        direction, of second order.

    Raises
    ------
    ConfigError
        `level` is no probability.
    DataError
        The change is zero or not finite, or the covariance is none.

    Notes
    -----
    Fieller's theorem (Fieller 1954, J. R. Stat. Soc. B 16, 175-185). A direction u, (2,), is
    contradicted where the component of the change m across it, n(u) m, which is normal with
    variance n P n and mean zero if u is the truth, is beyond z standard deviations: the
    interval is ``{u: (n m)² <= z² n P n}``, z = 1.96 for 95 %. This is the angle under which the
    ellipse ``(x - m) P^-1 (x - m) <= z²`` is seen from the origin. Note z² = 3.84, of one degree of
    freedom; the 95 % ellipse of the two components (5.99) would cover 98.6 %. Linearised,
    `pdof_sd` times z is the same for small angles.
    """
    if not 0.0 < level < 1.0:
        raise ConfigError("crash.no-probability", quantity="level", level=level)
    vector = vector_of(change, ("body", "impact", "ned"))
    matrix = covariance_of(covariance)
    z = NormalDist().inv_cdf(0.5 + 0.5 * level)
    # 0 - x and not -x, as for the estimate: from behind is +180 deg.
    horizontal = _fieller(0.0 - vector[:2], matrix[:2, :2], z)
    if horizontal is None:
        across = AngleInterval(-180.0, 180.0, undetermined=True)
    else:
        across = AngleInterval(*horizontal)
    size = float(np.hypot(vector[0], vector[1]))
    ahead = vector[:2] / size if size > 0.0 else np.array([1.0, 0.0])
    turn = np.zeros((2, 3))
    turn[0, :2], turn[1, 2] = ahead, 1.0
    vertical = _fieller(np.array([size, vector[2]]), turn @ matrix @ turn.T, z)
    if vertical is None:
        up = AngleInterval(-90.0, 90.0, undetermined=True)
    else:
        up = AngleInterval(max(vertical[0], -90.0), min(vertical[1], 90.0))
    return PdofInterval(across, up, level)


def _fieller(mean: Array, spread: Array, z: float) -> tuple[float, float] | None:
    """Directions, in deg about that of the mean, that are not contradicted; None where all."""
    # Scaled, so that no square is lost.
    scale = float(max(np.abs(mean).max(), math.sqrt(np.abs(spread).max())))
    if scale == 0.0:
        return None
    m, s = mean / scale, spread / scale**2
    # Normals n with n A n <= 0 belong to directions that are not contradicted.
    a = np.outer(m, m) - z * z * s
    half, part = 0.5 * (a[0, 0] + a[1, 1]), 0.5 * (a[0, 0] - a[1, 1])
    swing = math.hypot(part, a[0, 1])
    most, least = half + swing, half - swing
    if most <= 0.0 or not m.any():
        return None
    # The direction in the middle is the axis of the largest eigenvalue; beside it, the normal
    # turns towards that axis until A vanishes.
    middle = 0.5 * math.degrees(math.atan2(a[0, 1], part))
    reach = math.degrees(math.atan(math.sqrt(max(-least, 0.0) / most)))
    estimate = math.degrees(math.atan2(m[1], m[0]))
    # Of the two opposite directions the one on the estimate's side.
    away = float(within_half_turn(np.array(middle - estimate)))
    if abs(away) > 90.0:
        away -= math.copysign(180.0, away)
    return estimate + min(away - reach, 0.0), estimate + max(away + reach, 0.0)
