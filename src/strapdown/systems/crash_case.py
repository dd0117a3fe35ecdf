"""A crash case, from its file to everything that a report tells."""

from __future__ import annotations

from dataclasses import dataclass

import pandas as pd

from strapdown.config.crash_case import CaseSpec, ReferenceSpec
from strapdown.crash.monte_carlo import PathSamples
from strapdown.crash.reference_path import PathComparison
from strapdown.crash.severity_model import InjuryRisk
from strapdown.exceptions import Finding
from strapdown.formats.crash_record import CrashRecord
from strapdown.results import InputFiles
from strapdown.sensors.crash_unit import CrashUnit
from strapdown.systems.crash_reconstruction import CrashReconstruction

__all__ = ["CaseResult", "ReferenceAnswer", "SeverityAnswer"]


@dataclass(frozen=True, eq=False)
class SeverityAnswer:
    """What one model says, or why it says nothing."""

    model: str
    source: str
    outcome: str
    risk: InjuryRisk | None
    because: str = ""


@dataclass(frozen=True, eq=False)
class ReferenceAnswer:
    """The answers beside something else that is known.

    Attributes
    ----------
    spec : ReferenceSpec
    table : DataFrame or None
        Of a path, as read.
    path : PathComparison or None
    delta_v, sd : float, m/s
        Of ours over the same span; NaN for a path.
    consistent : bool
        Whether the difference is within the bounds of both.
    """

    spec: ReferenceSpec
    table: pd.DataFrame | None
    path: PathComparison | None
    delta_v: float
    sd: float
    consistent: bool


@dataclass(frozen=True, eq=False)
class CaseResult:
    """Everything that came of a case.

    Attributes
    ----------
    spec : CaseSpec
        Resolved.
    inputs : tuple of InputFiles
        The case file (role ``case``), the records (``record``), sensors, references.
    records : dict of str to CrashRecord
        By path as the case names it.
    units : tuple of CrashUnit
        As read from the records.
    reconstruction : CrashReconstruction
    samples : PathSamples or None
        Of the main path's Monte Carlo.
    severity : tuple of SeverityAnswer
    references : tuple of ReferenceAnswer
    findings : tuple of Finding
        Of reading and reconstruction, in this order.
    """

    spec: CaseSpec
    inputs: tuple[InputFiles, ...]
    records: dict[str, CrashRecord]
    units: tuple[CrashUnit, ...]
    reconstruction: CrashReconstruction
    samples: PathSamples | None
    severity: tuple[SeverityAnswer, ...]
    references: tuple[ReferenceAnswer, ...]
    findings: tuple[Finding, ...]
