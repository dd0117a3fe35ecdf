"""Everything that came of a run of navigation."""

from __future__ import annotations

from dataclasses import dataclass

import pandas as pd

from strapdown.alignment.alignment import Alignment
from strapdown.alignment.fine_result import FineResult
from strapdown.config.navigation import NavigationSpec
from strapdown.ellipsoids import Ellipsoid
from strapdown.evaluation.trajectory_summary import DifferenceSummary
from strapdown.evaluation.withheld import WithheldScore
from strapdown.exceptions import Finding
from strapdown.navigation.record import NavigationRecord
from strapdown.results import InputFiles
from strapdown.sensors.imu_uncertainty import ImuUncertainty
from strapdown.systems.sins.source import NavigationSource

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
    differences : DataFrame or None
        From the truth, where it is known (`trajectory_differences`), ten times a second at most.
    errors : DifferenceSummary or None
        Of these.
    withheld : tuple of WithheldScore
        Stretches over which fixes were kept back, and how far it then was from them.
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
    differences: pd.DataFrame | None
    errors: DifferenceSummary | None
    withheld: tuple[WithheldScore, ...]
    inputs: tuple[InputFiles, ...]
    findings: tuple[Finding, ...]
