"""How a unit sits, as far as gravity at rest tells it: roll and pitch, and no heading."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.constants import STANDARD_GRAVITY

Array = NDArray[np.float64]

__all__ = ["Sitting", "sitting_at_rest"]

# A housing is bolted along the vehicle's axes; a floor, a bracket and a bias lean it no more.
MOST_LEAN = 20.0  # deg
# What a sensor at rest may read: scale and bias of a cheap part, or none that can be told.
LEAST_LENGTH, MOST_LENGTH = 0.8, 1.2  # g


@dataclass(frozen=True)
class Sitting:
    """What gravity at rest says of a mounting.

    Attributes
    ----------
    roll_deg, pitch_deg : float, deg
        Of `Mounting.angles_deg`, with a heading that gravity does not tell.
    along : str
        Sensor axis that points up, as ``-z``; empty where none does.
    lean_deg : float, deg
        Between that axis and the vertical.
    length : float, m/s²
        Of the specific force at rest.
    """

    roll_deg: float
    pitch_deg: float
    along: str
    lean_deg: float
    length: float

    def into_vehicle(self, vectors: Array, heading_deg: float = 0.0) -> Array:
        """Turn vectors from sensor into vehicle axes.

        Parameters
        ----------
        vectors : ndarray, (n, 3)
        heading_deg : float, deg
        """
        C_vs = rotation.dcm_from_euler((self.roll_deg, self.pitch_deg, heading_deg))
        return np.asarray(vectors @ C_vs.T)


def sitting_at_rest(force: Array) -> Sitting | None:
    """Find roll and pitch of a mounting from the specific force at rest.

    Parameters
    ----------
    force : ndarray, (3,), m/s²
        Mean over a rest, in sensor axes; it points up.

    Returns
    -------
    Sitting or None
        None where its length is not that of gravity. An axis within 20° of the vertical is
        taken to be along it: what is left is the lean of vehicle and sensor together, which the
        levelling finds.

    Notes
    -----
    The vehicle's up, ``(0, 0, -1)``, is in sensor axes
    ``C_vsᵀ (0, 0, -1) = (sin p, -sin r cos p, -cos r cos p)`` whatever the heading; so
    ``p = asin u_x`` and ``r = atan2(-u_y, -u_z)``. With x along the vertical, roll and heading
    turn about one axis, and roll is zero.
    """
    length = float(np.linalg.norm(force))
    if not LEAST_LENGTH <= length / STANDARD_GRAVITY <= MOST_LENGTH:
        return None
    up = force / length
    k = int(np.argmax(np.abs(up)))
    lean = math.degrees(math.acos(min(1.0, float(abs(up[k])))))
    along = ""
    if lean <= MOST_LEAN:
        along = f"{'-' if up[k] < 0.0 else ''}{'xyz'[k]}"
        up = np.where(np.arange(3) == k, np.sign(up), 0.0)
    pitch = math.degrees(math.asin(float(np.clip(up[0], -1.0, 1.0))))
    roll = 0.0 if along.endswith("x") else math.degrees(math.atan2(-up[1], -up[2]))
    if not along:
        roll, pitch = round(roll, 1), round(pitch, 1)
    # A turn by -180 is one by 180.
    return Sitting(180.0 if roll == -180.0 else roll + 0.0, pitch + 0.0, along, lean, length)
