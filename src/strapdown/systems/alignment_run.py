"""An alignment, from its specification to everything that a report tells."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd

from strapdown.alignment.alignment import Alignment
from strapdown.alignment.carry import carried_attitude, carry
from strapdown.alignment.coarse import CoarseAlignment
from strapdown.alignment.fine import FineAlignment
from strapdown.alignment.fine_result import FineResult
from strapdown.alignment.observability import Manoeuvre, manoeuvres_after
from strapdown.alignment.site import Site
from strapdown.config.alignment import AlignmentSpec
from strapdown.config.choice import make_choice
from strapdown.config.navigation_modules import sensors_of
from strapdown.config.slots import SLOTS
from strapdown.ellipsoids import find_ellipsoid
from strapdown.errors import DataError, Finding
from strapdown.prefilter import Prefilter, PrefilterReport
from strapdown.results.inputs import InputFiles
from strapdown.sensors.imu_uncertainty import ImuUncertainty
from strapdown.systems.alignment_health import channel_findings
from strapdown.systems.alignment_outliers import saying_outliers
from strapdown.systems.alignment_readiness import AlignmentReadiness, alignment_readiness
from strapdown.systems.alignment_source import AlignmentSource, read_alignment_source
from strapdown.systems.attitude_source import input_files
from strapdown.systems.one_thread import one_thread
from strapdown.systems.progress import Progress, silent
from strapdown.tables.checks import source_of

__all__ = ["AlignmentResult", "run_alignment"]


@dataclass(frozen=True, eq=False)
class AlignmentResult:
    """Everything that came of an alignment.

    Attributes
    ----------
    spec : AlignmentSpec
        Resolved: every option of every module.
    source : AlignmentSource
    imu : DataFrame
        Imu table as it was aligned, after the pre-filter.
    prefilter : PrefilterReport or None
    site : Site
    sensors : ImuUncertainty
    coarse : Alignment
    fine : FineResult or None
    start, end : Alignment
        The answer at the first and at the last sample.
    attitude : DataFrame
        Attitude table over the record: the answer, carried by the gyros.
    readiness : AlignmentReadiness
    manoeuvres : tuple of Manoeuvre
        What a turn and a further rest would make known; empty without a fine alignment.
    inputs : tuple of InputFiles
    unread : tuple of Finding
        Of channels that read nothing for a while.
    findings : tuple of Finding
        Of reading, channels, pre-filter, coarse and fine alignment, in this order.
    """

    spec: AlignmentSpec
    source: AlignmentSource
    imu: pd.DataFrame
    prefilter: PrefilterReport | None
    site: Site
    sensors: ImuUncertainty
    coarse: Alignment
    fine: FineResult | None
    start: Alignment
    end: Alignment
    attitude: pd.DataFrame
    readiness: AlignmentReadiness
    manoeuvres: tuple[Manoeuvre, ...]
    inputs: tuple[InputFiles, ...]
    unread: tuple[Finding, ...]
    findings: tuple[Finding, ...]


@one_thread()
def run_alignment(
    spec: AlignmentSpec, file: Path | None = None, progress: Progress = silent
) -> AlignmentResult:
    """Read a record and align it.

    Parameters
    ----------
    spec : AlignmentSpec
        With absolute paths.
    file : Path, optional
        Where it was read from: an input, too.
    progress : callable, optional
        Called with a stage and the share that is done.

    Returns
    -------
    AlignmentResult

    Raises
    ------
    ConfigError
        A file is not there, or an option cannot be.
    DataError
        The record cannot be read, or it cannot give the attitude; the message names file, row,
        quantity and remedy.
    DivergenceError
        The filter left what a body at rest can do.
    """
    progress("reading", 0.02)
    source = read_alignment_source(spec)
    site = Site(
        spec.site.lat_deg, spec.site.lon_deg, spec.site.alt_m, find_ellipsoid(spec.site.ellipsoid)
    )
    sensors = sensors_of(spec)
    given = {"ellipsoid": spec.site.ellipsoid}
    coarse_way: CoarseAlignment = make_choice(spec.coarse, SLOTS["coarse"], given)
    fine_way: FineAlignment | None = make_choice(spec.fine, SLOTS["fine"], given)
    imu, report, increments = source.imu, None, None
    unread = channel_findings(imu, sensors) if source.truth is None else ()
    # Samples as they come may have any stamps.
    if spec.prefilter.kind != "none":
        prefilter: Prefilter = make_choice(spec.prefilter, SLOTS["prefilter"], given)
        progress("pre-filter", 0.08)
        filtered = prefilter.apply(imu)
        imu, report, increments = filtered.imu, filtered.report, filtered.increments
    progress("coarse alignment", 0.15)
    part = imu if spec.coarse.duration_s is None else _first(imu, spec.coarse.duration_s)
    fine: FineResult | None = None
    with saying_outliers(imu, report):
        coarse = coarse_way.align(part, site, sensors, source.gnss)
        if fine_way is not None:
            rest = imu if spec.coarse.duration_s is None else _after(imu, part)
            if spec.fine.duration_s is not None:
                rest = _first(rest, spec.fine.duration_s)
            fine = fine_way.align(
                rest,
                site,
                sensors,
                coarse,
                lambda share: progress("fine alignment", 0.25 + 0.3 * share),
                increments,
            )
    progress("carrying the attitude over the record", 0.55)
    answer = coarse if fine is None else fine.alignment
    attitude = carried_attitude(answer, imu, site)
    first = coarse if fine is None else fine.at_start
    start = _at(first, float(attitude.index[0]), imu, site, sensors)
    end = _at(answer, float(attitude.index[-1]), imu, site, sensors)
    progress("trying shorter alignments", 0.6)
    readiness = alignment_readiness(
        coarse_way,
        imu,
        site,
        sensors,
        source.gnss,
        attitude,
        fine,
        source.truth,
        spec.reference,
    )
    progress("looking for what a turn would tell", 0.66)
    manoeuvres = () if fine is None else manoeuvres_after(fine, site)
    files = () if file is None else (input_files("configuration", str(file), (file,)),)
    of_filter = () if report is None else report.findings
    findings = [
        *source.findings,
        *unread,
        *of_filter,
        *coarse.findings,
        *(() if fine is None else fine.findings),
    ]
    return AlignmentResult(
        spec=spec,
        source=source,
        imu=imu,
        prefilter=report,
        site=site,
        sensors=sensors,
        coarse=coarse,
        fine=fine,
        start=start,
        end=end,
        attitude=attitude,
        readiness=readiness,
        manoeuvres=manoeuvres,
        inputs=(*files, *source.inputs),
        unread=unread,
        findings=tuple(dict.fromkeys(findings)),
    )


def _first(imu: pd.DataFrame, duration: float) -> pd.DataFrame:
    """The first part of a record, from its first stamp."""
    time = imu.index.to_numpy(dtype=np.float64)
    step = float(np.median(np.diff(time)))
    kept = time <= time[0] + duration + 1e-6 * step
    if kept.sum() < 2:
        raise DataError(
            "alignment.duration-too-short", file=source_of(imu), quantity="time", duration=duration
        )
    out: pd.DataFrame = imu.loc[kept]
    out.attrs = dict(imu.attrs)
    return out


def _after(imu: pd.DataFrame, part: pd.DataFrame) -> pd.DataFrame:
    """What follows a first part, its last sample included."""
    out = imu.iloc[len(part) - 1 :]
    out.attrs = dict(imu.attrs)
    if len(out) < 2:
        raise DataError(
            "alignment.no-record-left-for-fine",
            file=source_of(imu),
            quantity="coarse, duration_s",
            index=float(imu.index[-1] - imu.index[0]),
        )
    return out


def _at(
    answer: Alignment, time: float, imu: pd.DataFrame, site: Site, sensors: ImuUncertainty
) -> Alignment:
    """The answer at an end of the record: as it is where it holds there, else carried."""
    step = float(np.median(np.diff(imu.index.to_numpy(dtype=np.float64))))
    if abs(answer.time - time) < 0.5 * step:
        return replace(answer, findings=())
    return replace(carry(imu, answer, time, site, sensors), findings=())
