"""What a tilt that is corrected leaves unknown of the vertical force, which is of second order."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from strapdown import rotation
from strapdown._kernels.level import Q_LB
from strapdown.constants import STANDARD_GRAVITY
from strapdown.estimation.error_filter import ErrorFilter
from strapdown.estimation.error_model import PHYSICAL
from strapdown.estimation.filter_state import FilterState

__all__ = ["is_large", "unlearnt_force"]

Array = NDArray[np.float64]

# Root of the summed variances of both tilts, rad, below which all this is no more than
# 1 mm/s², as an accelerometer of the cheapest class drifts.
LARGE = math.radians(0.8)
# Places of both tilts among the physical errors.
TILTS = slice(6, 8)
# Blocks of states that read as a bias of the accelerometers, the one that is asked first.
BIASES = ("accel_bias", "accel_drift")


def is_large(P: Array) -> bool:
    """Return whether a tilt may be so large that its second order counts.

    Parameters
    ----------
    P : ndarray, (p, p)
        Covariance of the physical errors, level axes.

    Returns
    -------
    bool
    """
    return float(np.trace(P[TILTS, TILTS])) > LARGE**2


def unlearnt_force(
    filter_: ErrorFilter, state: FilterState, before: Array, after: Array
) -> Array | None:
    """Return the variance by which less is known of the accelerometers after a correction of tilt.

    While a vehicle goes straight on, fixes tell the sum of a tilt and of the accelerometers' bias
    that hides it, and of the vertical bias all, about the attitude that was computed then. Once the
    tilt is told by something else, a turn mostly, and corrected by x and y, gravity along the body
    is another by ``g (x² + y²)/2``, of which a linear filter knows nothing. Its variance is
    ``g² tr(T²)/2`` with the covariance T of the tilts that are tied to the bias; of an update it is
    that before less that after, so that it does not count by how many updates a tilt was told.

    Its mean is left out: taken off, it changed nothing of how far bounds held in 60 drives.

    Parameters
    ----------
    filter_ : ErrorFilter
    state : FilterState
        Before the observation.
    before, after : ndarray, (p, p)
        Covariance of the physical errors before and after it, level axes.

    Returns
    -------
    ndarray, (n, n), or None
        For the states of the model. None where the tilt is not large, nothing of it is tied, or
        the model has no bias of the accelerometers.

    Notes
    -----
    Tied is what the bias goes with the tilt: ``T = M P M'/g²`` with the regression M of the force
    that the accelerometers read too much, level axes, on the tilts. Of an accelerometer that is
    known M is zero, and so is all of this. Jazwinski, Stochastic Processes and Filtering Theory
    (1970), sec. 9.3, has the variance of a second order; when it comes in is derived here.
    """
    layout = filter_.model.layout
    names = [name for name in BIASES if name in layout]
    if not is_large(before) or not names:
        return None
    used = filter_.mechanization
    C = rotation.dcm_from_quaternion(used.levels(state.row[None])[0, Q_LB : Q_LB + 4])
    up = used.level_up * STANDARD_GRAVITY * C[2]
    inputs = np.concatenate([[1.0, 0.0, 0.0, 0.0], up])
    read = C[:2] @ np.tensordot(inputs, filter_.model.stacked.accel, axes=1)
    tilt = before[TILTS, TILTS]
    M = np.linalg.solve(tilt, (read @ before[PHYSICAL:, TILTS]).T).T / STANDARD_GRAVITY
    was, now = M @ tilt @ M.T, M @ after[TILTS, TILTS] @ M.T
    variance = 0.5 * STANDARD_GRAVITY**2 * float(np.sum(was * was) - np.sum(now * now))
    if not variance > 0.0:
        return None
    along = np.zeros(len(before))
    first = layout[names[0]].start - layout.size + len(before)
    along[first : first + 3] = C[2]
    along = filter_.model.from_physical(used, state.time, state.row) @ along
    return variance * np.outer(along, along)
