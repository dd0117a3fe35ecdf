"""Holes in what the inertial sensors gave: what is done about them, and what is not known then."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from strapdown import rotation
from strapdown._kernels.level import Q_LB
from strapdown.errors import ConfigError
from strapdown.estimation.error_filter import symmetric
from strapdown.navigation.navigator import Navigator, NavigatorState
from strapdown.tables.checks import is_number

__all__ = ["GapPolicy", "Hole", "hole_between", "widened"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class GapPolicy:
    """What is done where samples are missing.

    A step of more than `usual` times the usual one is a gap. Over it rate and force run along the
    line between its sides, and the covariance takes that the body did there what it did over the
    second before: see `hole_between`.

    Attributes
    ----------
    usual : float
        Of the step that 95 % of the first 64 do not exceed.
    coast : float, s
        A longer gap is not bridged.
    beyond : {'refuse', 'align', 'coast'}
        What a longer gap does: it ends the run with an error; it begins the first mode anew; or it
        is bridged like a short one.
    """

    usual: float = field(default=3.0, metadata={"unit": ""})
    coast: float = field(default=1.0, metadata={"unit": "s"})
    beyond: Literal["refuse", "align", "coast"] = "refuse"

    def __post_init__(self) -> None:
        if not is_number(self.usual) or not self.usual > 1.0:
            raise ConfigError("navigation.gap-factor-too-small", quantity="usual", usual=self.usual)
        if not is_number(self.coast) or not self.coast >= 0.0:
            raise ConfigError("navigation.gap-length-negative", quantity="coast", coast=self.coast)
        if self.beyond not in ("refuse", "align", "coast"):
            raise ConfigError(
                "navigation.nothing-do-about-gap", quantity="beyond", beyond=self.beyond
            )


@dataclass(frozen=True, eq=False)
class Hole:
    """A gap in the samples.

    Attributes
    ----------
    begin, end : float, s
        Stamps of its two sides.
    rate_sd, force_sd : ndarray, (3,), rad/s and m/s²
        By how much the mean over it may differ from that of the line between its sides.
    """

    begin: float
    end: float
    rate_sd: Array
    force_sd: Array

    @property
    def length(self) -> float:
        """Length in s."""
        return self.end - self.begin


def hole_between(before: Array, time: tuple[float, float], after: Array) -> Hole:
    """Judge a gap by the samples beside it.

    Parameters
    ----------
    before : ndarray, (k, 6)
        Samples of about a second before it, the last one at its begin.
    time : tuple of float, s
        Stamps of its sides.
    after : ndarray, (6,)
        The sample that ends it.

    Returns
    -------
    Hole
        The mean over it may differ from the mean of its sides by half of their difference, which
        is where all of the change was at one of its ends, and by as much as the samples of the
        second before differ from each other.
    """
    half = 0.5 * (after - before[-1])
    sd = np.sqrt(np.square(half) + before.var(axis=0))
    return Hole(time[0], time[1], sd[:3], sd[3:])


def widened(navigator: Navigator, state: NavigatorState, hole: Hole) -> NavigatorState:
    """Return a state before a gap, with what is not known of the gap in its covariance.

    Parameters
    ----------
    navigator : Navigator
    state : NavigatorState
        At the begin of the gap.
    hole : Hole

    Returns
    -------
    NavigatorState
        A mean rate that is off by d turns the attitude by ``d length``, a mean force the velocity
        by as much, and the place goes on with that velocity: twice what a constant one would do.
    """
    filter_, model = navigator.filter, navigator.filter.model
    at = state.engine.filter
    level = filter_.mechanization.levels(at.row[None, :])[0]
    C = rotation.dcm_from_quaternion(level[Q_LB : Q_LB + 4])
    P = np.zeros((model.physical_size,) * 2)
    P[3:6, 3:6] = C * np.square(hole.force_sd * hole.length) @ C.T
    P[6:9, 6:9] = C * np.square(hole.rate_sd * hole.length) @ C.T
    E = model.from_physical(filter_.mechanization, at.time, at.row)
    more = symmetric(E @ P @ E.T)
    covariance = filter_.form.predict(at.covariance, np.eye(len(more)), more)
    engine = replace(state.engine, filter=replace(at, covariance=covariance))
    return replace(state, engine=engine)
