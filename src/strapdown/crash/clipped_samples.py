"""Where a unit was at the end of its range with nothing behind it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from strapdown.crash.at_point import AtPoint

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

__all__ = ["clipped_axes", "clipped_pieces"]

# Of a squared cosine: an axis of the sensor within 6 deg of across does not count in one.
LEAST_SHARE = 0.01


def clipped_axes(unit: AtPoint, window: tuple[float, float]) -> Flags:
    """Along which of the vehicle's axes a unit was clipped in a window.

    Parameters
    ----------
    unit : AtPoint
    window : (float, float), s

    Returns
    -------
    ndarray of bool, (3,)
        False all, for a mean of several. A clipped gyro turns all axes, and is not told here.
    """
    prepared = unit.prepared
    if prepared is None:
        return np.zeros(3, dtype=bool)
    time = prepared.imu.index.to_numpy(dtype=np.float64)
    within = (time >= window[0]) & (time <= window[1])
    cut = prepared.clipped[within].any(axis=0)
    share = prepared.unit.mounting.C_vs**2 > LEAST_SHARE
    return np.asarray((share & cut).any(axis=1))


def clipped_pieces(unit: AtPoint, edges: Array) -> Flags:
    """In which pieces of time a unit's readings are not what it felt.

    Parameters
    ----------
    unit : AtPoint
    edges : ndarray, (m + 1,), s

    Returns
    -------
    ndarray of bool, (m,)
        Whether a clipped sample of the accelerometers or the gyro, or a neighbour of one, counts
        in a piece. Neighbours: as many as make an angular acceleration of the gyro's samples, and
        the one into which a line is drawn of the accelerometers'.
    """
    prepared = unit.prepared
    if prepared is None:
        return np.zeros(len(edges) - 1, dtype=bool)
    time = prepared.imu.index.to_numpy(dtype=np.float64)
    arm = unit.moved is not None and bool(unit.moved.lever_arm.any())
    wide = unit.moved.slope.slope.shape[1] // 2 if arm and unit.moved is not None else 0
    cut = _spread(_any(prepared.clipped), 1)
    # What one reads along axes that turned unseen is not affected, but where an arm moves it.
    cut |= _spread(_any(prepared.gyro_clipped), wide + 1) if arm else False
    at = time[cut]
    return np.asarray(
        np.searchsorted(at, edges[1:], side="right") > np.searchsorted(at, edges[:-1], side="left")
    )


def _any(flags: Flags) -> Flags:
    return np.asarray(flags.any(axis=1))


def _spread(flags: Flags, by: int) -> Flags:
    """Flags and so many neighbours on either side."""
    return np.asarray(np.convolve(flags, np.ones(2 * by + 1), mode="same") > 0.5)
