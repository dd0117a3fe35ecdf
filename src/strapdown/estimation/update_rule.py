"""How an observation changes an estimate: how far, and how much of its variance it takes off."""

from __future__ import annotations

from typing import NamedTuple, Protocol


class Step(NamedTuple):
    """One scalar update: ``K = P h' / (slope s + r)``, ``x + K moved``.

    The covariance becomes ``(1 - slope K h) P (1 - slope K h)' + slope r K K'``. A plain update has
    ``moved = nu``, ``slope = 1`` and ``r = R``; one that is believed less has a larger r.

    Attributes
    ----------
    moved : float
        In the unit of the observation.
    slope : float
    r : float
        In the unit of the observation, squared.
    weight : float
        For the record: 1 where the observation is believed, 0 where it is not used. With a weight
        of 0 nothing is changed.
    """

    moved: float
    slope: float
    r: float
    weight: float


class UpdateRule(Protocol):
    """Says what one observation does."""

    def step(self, nu: float, s: float, r: float) -> Step:
        """Return the step of one observation.

        Parameters
        ----------
        nu : float
            Observation less its prediction.
        s : float
            ``h P h'``, the variance of the prediction.
        r : float
            Variance of the observation.
        """
        ...


class FullUpdate:
    """Every observation is believed by its stated variance: Kalman's update."""

    def step(self, nu: float, s: float, r: float) -> Step:
        """Return the whole step, as `UpdateRule.step`."""
        return Step(nu, 1.0, r, 1.0)
