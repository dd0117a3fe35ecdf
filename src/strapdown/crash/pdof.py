"""Principal direction of force: where it came from, and its first-order uncertainty."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown.crash.delta_v import DeltaV
from strapdown.crash.pdof_convention import clock_of
from strapdown.errors import ConfigError, DataError
from strapdown.rotation import within_half_turn

Array = NDArray[np.float64]

__all__ = [
    "NedPdof",
    "Pdof",
    "ned_pdof",
    "pdof",
    "pdof_gradient",
    "pdof_sd",
]


@dataclass(frozen=True)
class Pdof:
    """Direction that a force came from, seen from the vehicle.

    Attributes
    ----------
    horizontal_deg : float, deg
        In (-180, 180]: 0 from the front, positive clockwise seen from above, so that 90 is from
        the right.
    vertical_deg : float, deg
        In [-90, 90]: positive from above.
    """

    horizontal_deg: float
    vertical_deg: float

    @property
    def clock(self) -> int:
        """Hour, 1 to 12, each 30 deg wide; 12 is the front."""
        return clock_of(self.horizontal_deg)


@dataclass(frozen=True)
class NedPdof:
    """Direction that a force came from, over ground.

    Attributes
    ----------
    azimuth_deg : float, deg
        In [0, 360): the force came from that side; 0 north, 90 east.
    relative_deg : float, deg
        In (-180, 180]: the same, clockwise from the heading at the impact.
    vertical_deg : float, deg
        In [-90, 90]: positive from above.
    """

    azimuth_deg: float
    relative_deg: float
    vertical_deg: float

    @property
    def clock(self) -> int:
        """Hour of the relative direction."""
        return clock_of(self.relative_deg)


def vector_of(change: DeltaV | ArrayLike, frames: Sequence[str]) -> Array:
    """Three components of a delta-V that have a direction.

    Raises
    ------
    ConfigError
        It is in another frame.
    DataError
        They are not three finite numbers, or all zero.
    """
    if isinstance(change, DeltaV) and change.frame not in frames:
        raise ConfigError(
            "crash.delta-v-frame-needed", quantity="frame", frame=change.frame, frames=frames
        )
    vector = np.asarray(change.vector if isinstance(change, DeltaV) else change, dtype=np.float64)
    if vector.shape != (3,) or not np.isfinite(vector).all() or not vector.any():
        raise DataError("crash.no-direction", quantity="delta-V", vector=vector.tolist())
    return vector


def _angles(vector: Array) -> tuple[float, float]:
    x, y, z = vector.tolist()
    # 0 - y and not -y: a change without a lateral part is from behind at +180 deg, not -180.
    horizontal = math.degrees(math.atan2(0.0 - y, 0.0 - x))
    return horizontal, math.degrees(math.atan2(z, math.hypot(x, y)))


def pdof(change: DeltaV | ArrayLike) -> Pdof:
    """Direction of force from a change of velocity along vehicle axes.

    Parameters
    ----------
    change : DeltaV or array_like, (3,), m/s
        Forward, right, down, free of gravity.

    Returns
    -------
    Pdof
        ``horizontal = atan2(-dV_y, -dV_x)``, ``vertical = atan2(dV_z, hypot(dV_x, dV_y))``.
        Where the change is vertical the horizontal direction is 0 and means nothing;
        `pdof_interval` says so.

    Raises
    ------
    ConfigError
        The change is in north-east-down.
    DataError
        It is zero, or no three finite numbers.
    """
    return Pdof(*_angles(vector_of(change, ("body", "impact"))))


def ned_pdof(change: DeltaV | ArrayLike, heading_deg: float) -> NedPdof:
    """Direction of force from a change of velocity over ground.

    Parameters
    ----------
    change : DeltaV or array_like, (3,), m/s
        North, east, down.
    heading_deg : float, deg
        Of the vehicle at the impact.

    Returns
    -------
    NedPdof

    Raises
    ------
    ConfigError
        The change is along vehicle axes.
    DataError
        It is zero, or no three finite numbers; or the heading is not finite.
    """
    if not math.isfinite(heading_deg):
        raise DataError("crash.no-heading", quantity="heading", heading_deg=heading_deg)
    azimuth, vertical = _angles(vector_of(change, ("ned",)))
    relative = float(within_half_turn(np.array([azimuth - heading_deg]))[0])
    full = azimuth % 360.0
    # A tiny negative angle is rounded up to 360 by the remainder.
    return NedPdof(0.0 if full >= 360.0 else full, relative, vertical)


def pdof_gradient(change: DeltaV | ArrayLike) -> Array:
    """Gradient of the two angles with respect to the change of velocity.

    Parameters
    ----------
    change : DeltaV or array_like, (3,), m/s
        In any frame.

    Returns
    -------
    ndarray, (2, 3), deg per m/s
        Of the horizontal and the vertical angle.

    Raises
    ------
    DataError
        The change is vertical: its horizontal direction has no gradient.
    """
    x, y, z = vector_of(change, ("body", "impact", "ned")).tolist()
    h2 = x * x + y * y
    if h2 == 0.0:
        raise DataError("crash.change-velocity-vertical-no-horizontal", quantity="delta-V", z=z)
    h, r2 = math.sqrt(h2), h2 + z * z
    return np.degrees([[-y / h2, x / h2, 0.0], [-z * x / (h * r2), -z * y / (h * r2), h / r2]])


def pdof_sd(change: DeltaV | ArrayLike, covariance: ArrayLike) -> tuple[float, float]:
    """Standard deviations of the two angles, to first order.

    Parameters
    ----------
    change : DeltaV or array_like, (3,), m/s
    covariance : array_like, (3, 3), m²/s²
        Of the change.

    Returns
    -------
    horizontal_sd, vertical_sd : float, deg
        ``sqrt(G P G^T)``. Right while the change is large against its uncertainty; `pdof_interval`
        needs no such condition.

    Raises
    ------
    DataError
        As `pdof_gradient`; or `covariance` is none.
    """
    gradient = pdof_gradient(change)
    spread = gradient @ covariance_of(covariance) @ gradient.T
    return math.sqrt(max(spread[0, 0], 0.0)), math.sqrt(max(spread[1, 1], 0.0))


def covariance_of(given: ArrayLike) -> Array:
    """Return a covariance of three components.

    Raises
    ------
    DataError
        It is not (3, 3), symmetric, finite and without a negative variance.
    """
    matrix = np.asarray(given, dtype=np.float64)
    good = matrix.shape == (3, 3) and bool(np.isfinite(matrix).all())
    if good:
        scale = float(np.abs(matrix).max())
        good = bool(np.abs(matrix - matrix.T).max() <= 1e-9 * scale)
        good = good and bool(np.linalg.eigvalsh(matrix).min() >= -1e-9 * scale)
    if not good:
        raise DataError(
            "crash.no-covariance", quantity="covariance", asarray=np.asarray(given).tolist()
        )
    return 0.5 * (matrix + matrix.T)
