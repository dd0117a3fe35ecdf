"""A run of navigation with everything that its report works out of it once."""

from __future__ import annotations

from dataclasses import dataclass, replace

from strapdown.errors import Finding
from strapdown.evaluation.smoother_consistency import SmootherConsistency, smoother_consistency
from strapdown.navigation.record import NavigationRecord
from strapdown.report.navigation_agreement import Agreement, agreements
from strapdown.report.navigation_errors import NavigationErrors, navigation_errors
from strapdown.report.navigation_told import NavigationTold

__all__ = ["NavigationFound", "examine"]


@dataclass(frozen=True, eq=False)
class NavigationFound:
    """What was told of a run, and what it shows.

    Attributes
    ----------
    told : NavigationTold
    agreements : tuple of Agreement
        One a name of an observation.
    errors : NavigationErrors or None
        Against the truth.
    smoother : SmootherConsistency or None
    forward_errors : NavigationErrors or None
        Of a run that was smoothed: the filter beside its smoother, and against the truth.
    """

    told: NavigationTold
    agreements: tuple[Agreement, ...]
    errors: NavigationErrors | None
    smoother: SmootherConsistency | None = None
    forward_errors: NavigationErrors | None = None

    @property
    def record(self) -> NavigationRecord:
        """Of the run."""
        return self.told.record

    @property
    def filtered(self) -> NavigationRecord:
        """Of the filter alone, by which it is seen how sensors and aids came to be known."""
        return self.told.forward or self.told.record

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Of the run and of its comparison."""
        return (*self.told.findings, *(() if self.errors is None else self.errors.findings))


def examine(told: NavigationTold) -> NavigationFound:
    """Work out what a report says of a run.

    Parameters
    ----------
    told : NavigationTold

    Returns
    -------
    NavigationFound

    Raises
    ------
    DataError
        The truth has no instant in common with the run.
    """
    smoother = before = None
    if told.forward is not None:
        smoother = smoother_consistency(told.forward, told.record, told.ellipsoid)
        before = navigation_errors(replace(told, record=told.forward))
    agreed = agreements(told.record, told.lasting)
    return NavigationFound(told, agreed, navigation_errors(told), smoother, before)
