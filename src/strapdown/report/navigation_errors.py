"""A run of navigation beside its truth: errors, their bounds, and the two together."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from strapdown.constants import TWO_SIDED_95
from strapdown.errors import Finding
from strapdown.evaluation.plane_bound import plane_bound, plane_reach
from strapdown.evaluation.truth_comparison import TruthComparison, compare_with_truth
from strapdown.report.navigation_told import NavigationTold
from strapdown.tables import EULER, NED, VELOCITY

__all__ = ["NavigationErrors", "Score", "navigation_errors"]

Array = NDArray[np.float64]


#: An instant stands for no more than so long, s, or than three of the usual steps.
LONGEST = 1.5


@dataclass(frozen=True)
class Score:
    """Errors of one quantity over a run.

    Attributes
    ----------
    quantity, unit : str
    rms : float
        Over time: instants stand close where much is observed and wide apart in an outage.
    largest : float
    largest_at : float, s
    bound : float
        Root mean square of the bounds of 95 %.
    share : float
        Of the time in which the error is within its bound.
    """

    quantity: str
    unit: str
    rms: float
    largest: float
    largest_at: float
    bound: float
    share: float


@dataclass(frozen=True, eq=False)
class NavigationErrors:
    """Errors beside what the run itself claims of them.

    Attributes
    ----------
    comparison : TruthComparison
    """

    comparison: TruthComparison

    @property
    def time(self) -> Array:
        """Of the samples that are compared, (n,), s."""
        return self.comparison.time

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Of the comparison."""
        return self.comparison.findings

    @property
    def nees(self) -> Array:
        """Normalised error squared of place, velocity and attitude, (n,)."""
        if not self.freedom:
            return np.full(len(self.time), np.nan)
        return self.comparison.nees["all"].to_numpy(dtype=np.float64)

    @property
    def freedom(self) -> int:
        """Errors that it is of: those of which the run has states."""
        return self.comparison.freedom.get("all", 0)

    def error(self, column: str) -> Array:
        """Errors of a quantity, (n,): m, m/s, deg."""
        return self.comparison.differences[column].to_numpy(dtype=np.float64)

    def bound(self, column: str) -> Array:
        """Bounds of 95 % of them, (n,)."""
        return TWO_SIDED_95 * self.comparison.sd[column].to_numpy(dtype=np.float64)

    @cached_property
    def scores(self) -> tuple[Score, ...]:
        """Errors of each quantity, and of the horizontal place."""
        units = (
            dict.fromkeys(NED, "m") | dict.fromkeys(VELOCITY, "m/s") | dict.fromkeys(EULER, "deg")
        )
        found = [self._score(n, u, self.error(n), self.bound(n)) for n, u in units.items()]
        size = np.hypot(*(self.error(n) for n in NED[:2]))
        return self._score("horizontal", "m", size, self._plane(size)), *found

    def score(self, quantity: str) -> Score:
        """That of one quantity."""
        return next(s for s in self.scores if s.quantity == quantity)

    def _plane(self, size: Array) -> Array:
        """Reach of the ellipse of 95 % in the direction of the horizontal error, (n,), m.

        The error is within it if and only if it is within the ellipse.
        """
        covariance = self.comparison.covariance
        if "horizontal" not in self.comparison.nees:
            return plane_bound(covariance)
        distance = np.sqrt(self.comparison.nees["horizontal"].to_numpy(dtype=np.float64))
        return plane_reach(size, distance, covariance)

    @cached_property
    def _weight(self) -> Array:
        """Share of the time that each instant stands for, (n,)."""
        steps = np.diff(self.time)
        if not steps.size:
            return np.ones(len(self.time)) / len(self.time)
        # Where the truth is missing for long, nothing stands for that.
        steps = np.minimum(steps, max(LONGEST, 3.0 * float(np.median(steps))))
        about = 0.5 * (np.append(steps, 0.0) + np.insert(steps, 0, 0.0))
        return np.asarray(about / about.sum())

    def _score(self, name: str, unit: str, error: Array, bound: Array) -> Score:
        worst = int(np.argmax(np.abs(error)))
        return Score(
            name,
            unit,
            float(np.sqrt(self._weight @ np.square(error))),
            float(abs(error[worst])),
            float(self.time[worst]),
            float(np.sqrt(self._weight @ np.square(bound))),
            float(min(1.0, self._weight[np.abs(error) <= bound].sum())),
        )


def navigation_errors(told: NavigationTold) -> NavigationErrors | None:
    """Compare a run with its truth.

    Parameters
    ----------
    told : NavigationTold

    Returns
    -------
    NavigationErrors or None
        None without a truth.

    Raises
    ------
    DataError
        As `truth_comparison.compare_with_truth`: they have no instant in common.
    """
    if told.truth is None:
        return None
    record = told.record
    return NavigationErrors(
        compare_with_truth(
            record.trajectory, record.sd.index, record.covariance, told.truth, told.ellipsoid
        )
    )
