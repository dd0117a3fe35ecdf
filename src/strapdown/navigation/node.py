"""What a smoother needs of a filter: how its errors grew, and what was observed."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from strapdown.estimation.error_filter import ErrorFilter, FilterState

__all__ = ["Node", "physical_transition"]

Array = NDArray[np.float64]


class Node(NamedTuple):
    """An instant of a filter: its begin, the end of a growth, or an update.

    Errors are the p physical ones of its model, in level axes of the mechanization.

    Attributes
    ----------
    time : float, s
    covariance : ndarray, (p, p)
        Then; of an update, after it.
    transition : ndarray, (p, p), or None
        Of a growth, from the node before.
    before : ndarray, (p, p), or None
        Of an update, the covariance before it.
    taken : ndarray, (p,), or None
        Of an update, the error that was taken off the estimate: fed back, or kept beside.
    turn : ndarray, (3, 3)
        From north-east-down to the level axes.
    """

    time: float
    covariance: Array
    transition: Array | None
    before: Array | None
    taken: Array | None
    turn: Array


def physical_transition(
    filter_: ErrorFilter, begun: FilterState, Phi: Array, ended: FilterState
) -> Array:
    """Return how the physical errors went from one state of a filter to another.

    Parameters
    ----------
    filter_ : ErrorFilter
    begun, ended : FilterState
    Phi : ndarray, (n, n)
        Of the states of the model.

    Returns
    -------
    ndarray, (p, p)
    """
    model, used = filter_.model, filter_.mechanization
    if model.states_are_physical:
        return Phi
    E = model.from_physical(used, begun.time, begun.row)
    out: Array = model.to_physical(used, ended.time, ended.row) @ Phi @ E
    return out
