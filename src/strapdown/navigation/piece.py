"""What a navigator gives for a piece of a log."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from strapdown.estimation.covariance import Innovations
from strapdown.estimation.observation import Observation

__all__ = ["Mark", "NavigationPiece", "Seen"]

Array = NDArray[np.float64]


class Seen(NamedTuple):
    """One observation at an epoch.

    Attributes
    ----------
    time : float, s
    name : str
        Of the observation: ``rtk.position``.
    labels : tuple of str
        Of its components, with units.
    innovations : Innovations
        Computed less observed less what was expected of it; variance that was expected; weight.
    observation : Observation, optional
        Of the state before anything of this epoch was taken, estimates that are kept beside taken
        off; none of a lone receiver in a compiled loop.
    """

    time: float
    name: str
    labels: tuple[str, ...]
    innovations: Innovations
    observation: Observation | None = None


class Mark(NamedTuple):
    """Covariance and estimates at an instant, after what was observed then.

    Where nothing was observed for a while there is one before the observation, too, with a stamp
    that is a microsecond earlier: there an outage ends, and what is known is least.

    Attributes
    ----------
    time : float, s
    covariance : ndarray, (9, 9)
        Of the errors of the state in north-east-down: displacement m, velocity m/s, rotation rad
        (`mechanization.state_error.state_error`).
    sensors : ndarray, (k,)
        Estimates of the errors of the sensors and of the aids.
    sensors_sd : ndarray, (k,)
    """

    time: float
    covariance: Array
    sensors: Array
    sensors_sd: Array


@dataclass(frozen=True, eq=False)
class NavigationPiece:
    """What came of a piece of a log.

    Attributes
    ----------
    time : ndarray, (n,), s
        Ends of the steps.
    history : ndarray, (n, row)
        Rows of the mechanization then, what was estimated taken off.
    seen : tuple of Seen
        In the order in which they were taken.
    marks : tuple of Mark
        At every epoch, and at least as often as the navigator's `mark_interval`; where an outage
        ends, before it, too. The newest sample has one by `Navigator.finish`.
    late : tuple of (str, float)
        Epochs of aids that came when the navigator was beyond their time, and were not used.
    nodes : tuple of ndarray, (k, width)
        For a smoother, where the navigator is to be smoothed: rows of `NodeRows`.
    """

    time: Array
    history: Array
    seen: tuple[Seen, ...]
    marks: tuple[Mark, ...]
    late: tuple[tuple[str, float], ...] = ()
    nodes: tuple[Array, ...] = ()
