"""Crash reconstruction from Python: from a case file to the results of its vehicle."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from html import escape
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

import pandas as pd

from strapdown.bundle.seal import Seal
from strapdown.config.crash_case import CaseSpec
from strapdown.config.crash_case_file import read_case_spec
from strapdown.crash.unit_reconstruction import UnitReconstruction
from strapdown.errors import ConfigError
from strapdown.report.crash_case import write_crash
from strapdown.systems.crash_case import CaseResult, run_case
from strapdown.systems.progress import Progress, silent

if TYPE_CHECKING:
    from strapdown.report.chart_figure import ChartFigure

__all__ = ["CrashRun", "reconstruct"]


@dataclass(frozen=True, eq=False, repr=False)
class CrashRun(CaseResult):
    """Result of a crash reconstruction.

    It adds the properties below to the attributes of `CaseResult`. `save` writes the result; until
    then it is in memory only.
    """

    @property
    def vehicles(self) -> Mapping[str, UnitReconstruction]:
        """Results of each vehicle by its number; currently a case has one, ``"1"``.

        With several recorders, these are the results of their mean if they agree, else of the
        first. ``vehicles["1"].delta_v`` is the change of velocity of its severest event.
        """
        return MappingProxyType({"1": self.reconstruction.main})

    @property
    def recorders(self) -> Mapping[str, UnitReconstruction]:
        """Results of each recorder by itself, by name."""
        return MappingProxyType({unit.name: unit for unit in self.reconstruction.units})

    def to_pandas(self) -> pd.DataFrame:
        """Changes of velocity, directions of force and ends of the path.

        Returns
        -------
        DataFrame
            By recorder, event and quantity (with its unit): ``value``, and the 95 % bounds ``low``
            and ``high``.
        """
        return self.reconstruction.summary()

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
        from strapdown.report.chart_figure import ChartFigure
        from strapdown.report.crash_document import crash_document
        from strapdown.report.crash_figures import crash_figures
        from strapdown.report.document import ChartBlock

        document = crash_document(self, crash_figures(self), "")
        blocks = [*document.front, *(b for s in document.sections for b in s.blocks)]
        charts = {b.chart.slug: b.chart for b in blocks if isinstance(b, ChartBlock)}
        if kind not in charts:
            raise ConfigError(
                "api.unknown-case-chart", quantity="kind", kind=kind, word=kind, known=charts
            )
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

        Parameters
        ----------
        out : str or Path
            New folder.
        report : bool
            Whether to write page, PDF and figures as well.
        force : bool
            Overwrite an existing bundle.
        progress : callable, optional
            Called with a stage and the completed fraction.

        Returns
        -------
        Seal

        Raises
        ------
        ConfigError
            `out` exists and may not be overwritten.
        DataError
            An input file has changed since it was read.
        """
        return write_crash(self, out, report=report, force=force, progress=progress)

    def __repr__(self) -> str:
        return f"<CrashRun {self.spec.name}\n{self.reconstruction!r}>"

    def _repr_html_(self) -> str:
        table = self.to_pandas().to_html(float_format="{:.4g}".format)
        return f"<div><b>{escape(self.spec.title or self.spec.name)}</b></div>{table}"


def reconstruct(
    case: str | Path | CaseSpec,
    *,
    progress: Progress = silent,
) -> CrashRun:
    """Reconstruct a crash: delta-V, direction of force, severity and path, with 95 % bounds.

    Parameters
    ----------
    case : str, Path or CaseSpec
        Case file in TOML (``strapdown init crash`` writes one), or its specification.
    progress : callable, optional
        Called with a stage and the completed fraction.

    Returns
    -------
    CrashRun

    Raises
    ------
    ConfigError
        The case is inconsistent; the message names the line.
    DataError
        A record cannot be used.
    DivergenceError
        A path left the range possible for a vehicle.
    """
    file = None if isinstance(case, CaseSpec) else Path(case)
    spec = case if isinstance(case, CaseSpec) else read_case_spec(Path(case))
    result = run_case(spec, file, progress)
    return CrashRun(**{f.name: getattr(result, f.name) for f in fields(result)})
