"""Crash reconstruction from Python: from a case file to the results of its vehicle."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from html import escape
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

import pandas as pd

from strapdown.bundle import Seal, check_destination
from strapdown.config.crash_case import CaseSpec
from strapdown.crash.case import CaseResult, run_cases
from strapdown.crash.reconstruction import UnitReconstruction
from strapdown.errors import check_choice
from strapdown.progress import Progress, silent
from strapdown.report.crash_case import CRASH

if TYPE_CHECKING:
    from strapdown.report.chart_svg import ChartFigure


@dataclass(frozen=True, eq=False, repr=False)
class CrashRun(CaseResult):
    """Result of a crash reconstruction.

    It adds the properties below to the attributes of `CaseResult`, which are those of the first
    vehicle. `save` writes the result; until then it is in memory only.

    Attributes
    ----------
    others : tuple of CrashRun
        Runs of the other vehicles of the crash, in the order of their cases.
    """

    others: tuple[CrashRun, ...] = ()

    @property
    def runs(self) -> Mapping[str, CrashRun]:
        """Run of each vehicle by its number, from ``"1"``."""
        runs = (self, *self.others)
        return MappingProxyType({str(k): run for k, run in enumerate(runs, start=1)})

    @property
    def vehicles(self) -> Mapping[str, UnitReconstruction]:
        """Results of each vehicle by its number, from ``"1"``, in the order of the cases.

        With several recorders, these are the results of their mean if they agree, else of the
        first. ``vehicles["1"].delta_v`` is the change of velocity of its severest event.
        """
        return MappingProxyType({k: run.reconstruction.main for k, run in self.runs.items()})

    @property
    def recorders(self) -> Mapping[str, UnitReconstruction]:
        """Results of each recorder of the first vehicle by itself, by name."""
        return MappingProxyType({unit.name: unit for unit in self.reconstruction.units})

    def to_pandas(self) -> pd.DataFrame:
        """Changes of velocity, directions of force and ends of the path.

        Returns
        -------
        DataFrame
            By recorder, event and quantity (with its unit): ``value``, and the 95 % bounds ``low``
            and ``high``. Of several vehicles also by ``vehicle``, before these.
        """
        if not self.others:
            return self.reconstruction.summary()
        tables = {k: run.reconstruction.summary() for k, run in self.runs.items()}
        return pd.concat(tables, names=["vehicle"])

    def plot(self, kind: str = "delta-v") -> ChartFigure:
        """Draw one chart of the report.

        Parameters
        ----------
        kind : str
            Name of a figure in the report's folder ``figures``.

        Returns
        -------
        ChartFigure
            Displays itself in a notebook; `save` writes it as SVG, PNG or PDF.

        Raises
        ------
        ConfigError
            The chart does not exist for this case.
        """
        from strapdown.report.chart import Chart
        from strapdown.report.chart_svg import ChartFigure
        from strapdown.report.crash_document import crash_document
        from strapdown.report.document import drawings

        drawn = drawings(crash_document(self, ""))
        charts = {one.slug: one for one in drawn if isinstance(one, Chart)}
        check_choice("api.unknown-case-chart", charts, quantity="kind", kind=kind)
        return ChartFigure(charts[kind])

    def save(
        self,
        out: str | Path,
        *,
        report: bool = True,
        force: bool = False,
        progress: Progress = silent,
    ) -> Seal:
        """Write the case as a sealed bundle, which `verify` runs again.

        Of several vehicles each is a bundle of its own, in the folders ``1``, ``2``, … of `out`.

        Parameters
        ----------
        out : str or Path
            New folder.
        report : bool
            Whether to write page, PDF and figures as well; without the extra ``pdf`` no PDF,
            of which the logger warns.
        force : bool
            Overwrite an existing bundle.
        progress : callable, optional
            Called with a stage and the completed fraction.

        Returns
        -------
        Seal
            Of the first vehicle.

        Raises
        ------
        ConfigError
            `out` exists and may not be overwritten.
        DataError
            An input file has changed since it was read.
        """
        if not self.others:
            return CRASH.write(self, out, report=report, force=force, progress=progress)
        for number in self.runs:
            check_destination(Path(out) / number, force)
        seals = [
            CRASH.write(run, Path(out) / number, report=report, force=force, progress=progress)
            for number, run in self.runs.items()
        ]
        return seals[0]

    def __repr__(self) -> str:
        shown = [f"<CrashRun {r.spec.name}\n{r.reconstruction!r}>" for r in self.runs.values()]
        return "\n".join(shown)

    def _repr_html_(self) -> str:
        table = self.to_pandas().to_html(float_format="{:.4g}".format)
        return f"<div><b>{escape(self.spec.title or self.spec.name)}</b></div>{table}"


def reconstruct(
    case: str | Path | CaseSpec, *others: str | Path | CaseSpec, progress: Progress = silent
) -> CrashRun:
    """Reconstruct a crash: delta-V, direction of force, severity and path, with 95 % bounds.

    Parameters
    ----------
    case : str, Path or CaseSpec
        Case file in TOML of a vehicle (``strapdown init crash`` writes one), or its specification.
    *others : str, Path or CaseSpec
        Cases of the other vehicles of the crash. Each vehicle is reconstructed from its own
        recorders. Two vehicles are held against each other: momentum, closing speed, restitution
        and energy, in `CrashRun.closure`; their own results do not change. One that met a barrier
        has it, too, and its crush in `CrashRun.deformation`.
    progress : callable, optional
        Called with a stage and the completed fraction.

    Raises
    ------
    ConfigError
        A case is inconsistent; the message names the line.
    DataError
        A record cannot be used.
    DivergenceError
        A path left the range possible for a vehicle.
    """
    specs = [
        (one, None) if isinstance(one, CaseSpec) else (CaseSpec.read(Path(one)), Path(one))
        for one in (case, *others)
    ]
    first, *rest = (vars(run) for run in run_cases(specs, progress))
    return CrashRun(**first, others=tuple(CrashRun(**one) for one in rest))
