"""How errors go where the body is known to stay where it is (`ErrorFilter.rests`)."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from strapdown import rotation
from strapdown._kernels.level import ALT, AXIS, Q_LB
from strapdown.earth import gravity
from strapdown.ellipsoids import find_ellipsoid
from strapdown.estimation.error_model import Segment
from strapdown.estimation.states import StateLayout
from strapdown.mechanization.mechanization import Mechanization

__all__ = ["biases_in_level", "resting"]

Array = NDArray[np.float64]

# Place of the attitude in a level row.
ATTITUDE = slice(Q_LB, Q_LB + 4)
# Blocks of states that are vectors of the body.
BIASES = ("gyro_bias", "accel_bias")


def resting(segment: Segment) -> Segment:
    """Return a segment whose forces are gravity in the attitude that it has.

    Parameters
    ----------
    segment : Segment

    Returns
    -------
    Segment
    """
    used = segment.mechanization
    levels = used.levels(segment.history[:-1])
    rows = segment.increments.copy()
    up = np.zeros((len(rows), 3))
    up[:, 2] = used.level_up * _gravity(used, levels[0])
    up = rotation.rotate(rotation.conjugate(levels[:, ATTITUDE]), up)
    rows[:, 4:7] = up * rows[:, :1]
    return replace(segment, increments=rows)


def biases_in_level(
    mechanization: Mechanization, layout: StateLayout, before: Array, after: Array
) -> Array:
    """Return how states go on where a correction leaves the errors of biases in level axes.

    Parameters
    ----------
    mechanization : Mechanization
    layout : StateLayout
        Of n states.
    before, after : ndarray, (row,)
        Of a history, before and after the correction of the attitude.

    Returns
    -------
    ndarray, (n, n)
    """
    q_before, q_after = mechanization.levels(np.stack([before, after]))[:, ATTITUDE]
    turn = rotation.dcm_from_quaternion(rotation.compose(rotation.conjugate(q_after), q_before))
    out = np.eye(layout.size)
    for name in BIASES:
        if name in layout:
            at = layout[name]
            out[at, at] = turn
    return out


def _gravity(mechanization: Mechanization, level: Array) -> float:
    """Gravity at a level row, m/s²."""
    sine = float(level[AXIS + 2]) * mechanization.level_up
    lat = math.degrees(math.asin(min(max(sine, -1.0), 1.0)))
    found = gravity(lat, float(level[ALT]), ellipsoid=find_ellipsoid(mechanization.ellipsoid))
    return float(np.linalg.norm(found))
