"""The epochs of a fine alignment: where it begins, and how it goes from one to the next."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from strapdown.alignment.alignment import Alignment
from strapdown.alignment.stationary import Standing, rate_observation, still_observations
from strapdown.estimation.covariance import Innovations
from strapdown.estimation.error_filter import ErrorFilter
from strapdown.estimation.error_model import PHYSICAL, Segment
from strapdown.estimation.filter_state import FilterState
from strapdown.estimation.observation import Observation
from strapdown.nav_state import NavState

Array = NDArray[np.float64]

# Tilt and heading before the filter: much more than a coarse alignment leaves, for it was made of
# the same rests, by the same biases, and says nothing that the filter does not find by itself.
WIDER = 10.0
LEAST_TILT, LEAST_HEADING = math.radians(0.1), math.radians(1.0)
MOST_TILT, MOST_HEADING = math.radians(5.0), math.radians(20.0)
Seen = dict[str, tuple[Observation, Innovations]]


def settled_epoch(
    filter_: ErrorFilter,
    state: FilterState,
    time: Array,
    rows: Array,
    home: NavState,
    standing: Standing,
    observe: tuple[str, ...],
) -> tuple[FilterState, Seen]:
    """Go over one epoch of a rest: predict, and take what is known at its end."""
    seen: Seen = {}
    if "rate" in observe:
        made: list[Observation] = []

        def turn(segment: Segment) -> Observation:
            made.append(rate_observation(filter_, segment, home, standing))
            return made[0]

        state, _, innovations = filter_.predict_observing(state, time, rows, turn)
        seen["rate"] = (made[0], innovations)
    else:
        state, _ = filter_.predict(state, time, rows)
    others = still_observations(filter_, state, home, standing, observe)
    state, _, several = filter_.observe(state, others)
    seen |= {one.name: (one, of) for one, of in zip(others, several, strict=True)}
    return state, seen


def settled(
    filter_: ErrorFilter,
    state: FilterState,
    time: Array,
    rows: Array,
    ends: NDArray[np.int64],
    home: NavState,
    standing: Standing,
    observe: tuple[str, ...],
) -> Iterator[tuple[FilterState, Seen]]:
    """Go from epoch to epoch over a rest.

    Parameters
    ----------
    filter_ : ErrorFilter
    state : FilterState
    time : ndarray, (k,), s
        Ends of the steps.
    rows : ndarray, (k, 10)
        Motion increments.
    ends : ndarray of int
        Number of steps before the end of each epoch.
    home : NavState
        The place of alignment and the attitude of rest.
    standing : Standing
    observe : tuple of str

    Yields
    ------
    state : FilterState
    seen : dict
        By name, each observation and its innovations.
    """
    at = 0
    for end in ends.tolist():
        state, seen = settled_epoch(
            filter_, state, time[at:end], rows[at:end], home, standing, observe
        )
        yield state, seen
        at = end


def epoch_ends(begin: float, time: Array, interval: float) -> NDArray[np.int64]:
    """Number of steps before the end of each whole interval, (m,)."""
    count = math.floor((float(time[-1]) - begin) / interval + 1e-6)
    wanted = begin + interval * np.arange(1, count + 1)
    half = 0.5 * float(np.median(np.diff(time))) if time.size > 1 else 0.0
    return np.unique(np.searchsorted(time, wanted - half) + 1).clip(max=time.size)


def prior_heading_sd(coarse: Alignment) -> float:
    """Standard deviation of the heading before the first epoch, rad."""
    heading = float(np.sqrt(coarse.covariance[2, 2]))
    if coarse.heading_given:
        return heading
    return min(max(WIDER * heading, LEAST_HEADING), MOST_HEADING)


def initial_covariance(filter_: ErrorFilter, coarse: Alignment, standing: Standing) -> Array:
    """Covariance of the physical errors before the first epoch, in north-east-down."""
    P = np.zeros((filter_.model.physical_size,) * 2)
    P[0:3, 0:3] = np.diag(standing.position**2)
    P[3:6, 3:6] = np.diag(standing.velocity**2)
    tilt = float(np.sqrt(np.diagonal(coarse.covariance)[:2].max()))
    P[6, 6] = P[7, 7] = min(max(WIDER * tilt, LEAST_TILT), MOST_TILT) ** 2
    P[8, 8] = prior_heading_sd(coarse) ** 2
    at = PHYSICAL
    for block in filter_.model.sensors:
        end = at + len(block.block)
        P[at:end, at:end] = np.diag(block.sd**2)
        at = end
    return P
