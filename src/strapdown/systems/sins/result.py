"""Everything that came of a run of navigation."""

from __future__ import annotations

from dataclasses import dataclass

import pandas as pd

from strapdown.alignment.alignment import Alignment
from strapdown.alignment.fine_result import FineResult
from strapdown.config.navigation import NavigationSpec
from strapdown.ellipsoids import Ellipsoid
from strapdown.errors import Finding
from strapdown.evaluation.control_points import ControlPointScore
from strapdown.evaluation.trajectory_summary import DifferenceSummary
from strapdown.navigation.record import NavigationRecord
from strapdown.results.inputs import InputFiles
from strapdown.sensors.imu_uncertainty import ImuUncertainty
from strapdown.systems.sins.source import NavigationSource
from strapdown.systems.sins.trust import Trust
from strapdown.systems.sins.withholding import Withheld

__all__ = ["NavigationResult"]


@dataclass(frozen=True, eq=False)
class NavigationResult:
    """Everything that came of a run of navigation.

    Attributes
    ----------
    spec : NavigationSpec
        Resolved: every option of every module.
    source : NavigationSource
    ellipsoid : Ellipsoid
    sensors : ImuUncertainty
    coarse : Alignment or None
    fine : FineResult or None
    record : NavigationRecord
        Smoothed, where the run was to be.
    forward : NavigationRecord or None
        What the filter alone said, of a run that was smoothed.
    differences : DataFrame or None
        From the truth, where it is known (`trajectory_differences`), ten times a second at most.
    errors : DifferenceSummary or None
        Of these.
    forward_differences : DataFrame or None
        Of what the filter alone said, of a run that was smoothed.
    points : ControlPointScore or None
        The path at its control points.
    withheld : tuple of Withheld
        Stretches over which fixes were kept back, and how far it then was from them.
    trust : Trust
        How far it can be trusted.
    inputs : tuple of InputFiles
    findings : tuple of Finding
    """

    spec: NavigationSpec
    source: NavigationSource
    ellipsoid: Ellipsoid
    sensors: ImuUncertainty
    coarse: Alignment | None
    fine: FineResult | None
    record: NavigationRecord
    forward: NavigationRecord | None
    differences: pd.DataFrame | None
    errors: DifferenceSummary | None
    forward_differences: pd.DataFrame | None
    points: ControlPointScore | None
    withheld: tuple[Withheld, ...]
    trust: Trust
    inputs: tuple[InputFiles, ...]
    findings: tuple[Finding, ...]

    @property
    def filtered(self) -> NavigationRecord:
        """What the filter alone said: what was known at each instant then."""
        return self.forward or self.record

    @property
    def filtered_differences(self) -> pd.DataFrame | None:
        """From the truth, of what the filter alone said."""
        return self.differences if self.forward is None else self.forward_differences
