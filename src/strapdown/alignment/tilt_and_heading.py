"""Attitude errors where a force is known in both frames, and the heading is stated."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.errors import DataError

Array = NDArray[np.float64]

__all__ = ["error_of_force_and_heading"]

#: Beyond this pitch, deg, heading and roll turn about one axis to within a minute of arc.
STEEPEST = 89.9


def error_of_force_and_heading(
    force: Array, pitch_deg: float, heading_deg: float, source: str | None = None
) -> tuple[Array, Array]:
    """Sensitivities of an attitude that lays a force on a force and has a stated heading.

    Parameters
    ----------
    force : ndarray, (3,), m/s²
        North-east-down, as known: minus gravity at rest.
    pitch_deg, heading_deg : float, deg
    source : str, optional
        For messages.

    Returns
    -------
    by_force : ndarray, (3, 3), rad per m/s²
        Of ``phi`` per error of the known force less that of the measured one, north-east-down.
    by_heading : ndarray, (3,), rad/rad

    Raises
    ------
    DataError
        The body points to the zenith or the nadir: it has no heading.

    Notes
    -----
    ``phi x F = e`` leaves the turn about F free: ``phi = F x e/F² + l F``. The heading turns by
    ``phi_D + tan(pitch) (cos(heading) phi_N + sin(heading) phi_E)``, which gives l. At rest this
    is ``phi_N = -df_E/g``, ``phi_E = df_N/g``.
    """
    if not abs(pitch_deg) <= STEEPEST:
        raise DataError(
            "alignment.pitch-vertical",
            file=source,
            quantity="pitch",
            pitch_deg=pitch_deg,
        )
    steep, heading = np.tan(np.radians(pitch_deg)), np.radians(heading_deg)
    row = np.array([steep * np.cos(heading), steep * np.sin(heading), 1.0])
    along = force / (row @ force)
    by_force = (np.eye(3) - np.outer(along, row)) @ rotation.cross_matrix(force) / (force @ force)
    return np.asarray(by_force), np.asarray(along)
