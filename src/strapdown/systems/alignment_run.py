"""Alignment from its specification to all results of a report."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from strapdown.alignment.alignment import Alignment, CoarseAlignment, Site
from strapdown.alignment.fine import FineAlignment, FineResult
from strapdown.alignment.readiness import (
    Manoeuvre,
    carried_attitude,
    carry,
    manoeuvres_after,
    readiness,
)
from strapdown.bundle import InputFiles
from strapdown.config.alignment import AlignmentSpec, ReferenceTable, sensors_of
from strapdown.dsp.outliers import REPLACED, OutlierDesign
from strapdown.dsp.samples import even_step
from strapdown.ellipsoids import find_ellipsoid
from strapdown.errors import ConfigError, DataError, Finding
from strapdown.prefilter import Prefilter, PrefilterReport
from strapdown.prefilter.prefilter import LOW_RATE
from strapdown.progress import Progress, silent
from strapdown.rotation import within_half_turn
from strapdown.sensors.health_log import LEAST_SAMPLES, ChannelFault
from strapdown.sensors.imu_health import check_imu_channels
from strapdown.sensors.uncertainty import ImuUncertainty
from strapdown.systems.alignment_source import AlignmentSource, read_alignment_source
from strapdown.systems.inputs import Memory, SavedRun, configuration_file
from strapdown.systems.one_thread import one_thread
from strapdown.tables import ACCEL, EULER, GYRO
from strapdown.tables.checks import Array, index_of, source_of, values_of

if TYPE_CHECKING:
    from strapdown.report.chart_svg import ChartFigure


@dataclass(frozen=True, eq=False, repr=False)
class AlignmentRun(SavedRun):
    """Result of an alignment; in memory until `save` writes it.

    Attributes
    ----------
    spec : AlignmentSpec
        With every option of every module.
    imu : DataFrame
        Aligned Imu table, after the pre-filter.
    start, end : Alignment
        The result at the first and at the last sample.
    attitude : DataFrame
        Attitude table over the record: the result, propagated by the gyros.
    manoeuvres : tuple of Manoeuvre
        Accuracy after a turn and a further rest; empty without a fine alignment.
    unread : tuple of Finding
        Intervals in which channels are silent.
    findings : tuple of Finding
        From reading, channels, pre-filter, coarse and fine alignment, in this order.
    memory : Memory
        Tables that are given in memory; files of the bundle.
    """

    bundle = "strapdown.report.alignment:ALIGNMENT"

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
    memory: Memory = field(default=Memory({}))

    def to_pandas(self) -> pd.DataFrame:
        """Attitude table over the record by time in s: quaternion, and angles in deg."""
        return self.attitude.copy()

    def plot(self, kind: str = "attitude") -> ChartFigure:
        """Draw roll, pitch and heading over time.

        Parameters
        ----------
        kind : {'attitude', 'roll', 'pitch', 'heading'}

        Returns
        -------
        ChartFigure
            Displays itself in a notebook; `save` writes it as SVG, PNG or PDF.

        Raises
        ------
        ConfigError
            The chart does not exist.
        """
        from strapdown.report.alignment_document import attitude_chart
        from strapdown.report.chart_svg import ChartFigure

        if kind not in ("attitude", *EULER):
            raise ConfigError("api.unknown-chart", quantity="kind", kind=kind)
        chart = attitude_chart(self)
        if kind != "attitude":
            chart = replace(chart, panels=(chart.panels[EULER.index(kind)],))
        return ChartFigure(chart)

    def __repr__(self) -> str:
        last = self.attitude.iloc[-1]
        sd = self.end.sd_deg
        angles = ", ".join(
            f"{name} {last[name]:.4g}° ± {s:.2g}°" for name, s in zip(EULER, sd, strict=True)
        )
        return f"<AlignmentRun {self.source.name}: at the end {angles} (1 sd)>"


@one_thread()
def run_alignment(
    spec: AlignmentSpec, file: Path | None = None, progress: Progress = silent
) -> AlignmentRun:
    """Read a record and align it.

    Parameters
    ----------
    spec : AlignmentSpec
        With absolute paths.
    file : Path, optional
        Configuration file, listed as an input.
    progress : callable, optional
        Called with a stage and the share that is done.

    Raises
    ------
    ConfigError
        A file does not exist, or an option is invalid.
    DataError
        The record cannot be read, or does not determine the attitude; the message names file, row,
        quantity and remedy.
    DivergenceError
        The filter state is not that of a stationary body.
    """
    progress("reading", 0.02)
    source = read_alignment_source(spec)
    site = Site(
        spec.site.lat_deg, spec.site.lon_deg, spec.site.alt_m, find_ellipsoid(spec.site.ellipsoid)
    )
    sensors = sensors_of(spec)
    given = {"ellipsoid": spec.site.ellipsoid}
    coarse_way: CoarseAlignment = spec.coarse.make(**given)
    fine_way: FineAlignment | None = spec.fine.make(**given)
    imu, report, increments = source.imu, None, None
    unread = channel_findings(imu, sensors) if source.truth is None else ()
    # Without a pre-filter, stamps need not be even.
    if spec.prefilter.kind != "none":
        prefilter: Prefilter = spec.prefilter.make(**given)
        progress("pre-filter", 0.08)
        filtered = prefilter.apply(imu)
        imu, report, increments = filtered.imu, filtered.report, filtered.increments
    progress("coarse alignment", 0.15)
    part = imu if spec.coarse.duration_s is None else _first(imu, spec.coarse.duration_s)
    fine: FineResult | None = None
    with with_record_as_reason(imu, report):
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
    curve = alignment_readiness(
        lambda piece: coarse_way.align(piece, site, sensors, source.gnss),
        imu,
        attitude,
        fine,
        source.truth,
        spec.reference,
    )
    progress("predicting the effect of a rotation", 0.66)
    manoeuvres = () if fine is None else manoeuvres_after(fine, site)
    of_filter = () if report is None else report.findings
    findings = [
        *source.findings,
        *unread,
        *of_filter,
        *coarse.findings,
        *(() if fine is None else fine.findings),
    ]
    return AlignmentRun(
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
        readiness=curve,
        manoeuvres=manoeuvres,
        inputs=(*configuration_file(file), *source.inputs),
        unread=unread,
        findings=tuple(dict.fromkeys(findings)),
    )


def _first(imu: pd.DataFrame, duration: float) -> pd.DataFrame:
    """First part of a record, from its first stamp."""
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
    """Remainder after a first part, including its last sample."""
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
    """Result at an end of the record: unchanged where it holds there, else propagated."""
    step = float(np.median(np.diff(imu.index.to_numpy(dtype=np.float64))))
    if abs(answer.time - time) < 0.5 * step:
        return replace(answer, findings=())
    return replace(carry(imu, answer, time, site, sensors), findings=())


# Silent channels of a record: reported or refused before the alignment.


#: Faults visible in the samples themselves. Noise, jumps and levels are left to the alignments:
#: people who enter a vehicle cause them, too.
SILENT = ("missing", "stuck", "dead", "saturated")
#: Largest share of a record without a channel.
MOST = 0.01


def channel_findings(imu: pd.DataFrame, sensors: ImuUncertainty) -> tuple[Finding, ...]:
    """Find channels that are silent over a part of a record.

    Parameters
    ----------
    imu : DataFrame
        Recorded Imu table, body axes.

    Returns
    -------
    tuple of Finding
        Short stretches; or that no channel ever changes.
    """
    if len(imu) < LEAST_SAMPLES:
        # The alignments refuse a record this short, and state the length needed.
        return _made_up(imu)
    faults = [f for f in check_imu_channels(imu, sensors).faults if f.kind in SILENT]
    for channel in dict.fromkeys(f.channel for f in faults):
        own = [f for f in faults if f.channel == channel]
        lost = sum(f.last - f.first + 1 for f in own)
        # The alignments refuse a channel that is dead throughout.
        whole = lost == len(imu)
        if lost > MOST * len(imu) and not (whole and _alone(channel, faults)):
            worst = max(own, key=lambda f: f.last - f.first)
            time = index_of(imu)
            before, after = worst.begin - float(time[0]), float(time[-1]) - worst.end
            part = (
                "alignment.channel-lost-align-before"
                if before >= after
                else "alignment.channel-lost-align-after"
            )
            raise DataError(
                worst.finding.explains(
                    "alignment.channel-lost" if whole else part,
                    share=lost / len(imu),
                    before=before,
                    end=worst.end,
                )
            )
    return (*(f.finding for f in faults), *_made_up(imu))


def _alone(channel: str, faults: Sequence[ChannelFault]) -> bool:
    """Whether another channel of its triad still changes."""
    triad = channel.split("_")[0]
    return len({f.channel for f in faults if f.channel.startswith(triad)}) < len(GYRO)


def _made_up(imu: pd.DataFrame) -> tuple[Finding, ...]:
    columns = [c for c in [*GYRO, *ACCEL] if c in imu.columns]
    if np.ptp(values_of(imu, columns), axis=0).any():
        return ()
    return (
        Finding(
            "alignment.no-channel-changes",
            file=source_of(imu),
            quantity="gyro, accel",
            count=len(imu),
        ),
    )


# Outliers as a possible reason for a failed alignment.


#: Share of a channel's samples that count as outliers: fewer are irrelevant, more are normal.
LEAST, ALIGNMENT_OUTLIERS_MOST = 1e-3, 0.03

#: Ratio of a loud channel's scatter over a second to its usual one; share of a record beyond which
#: this is normal.
LOUD, MOST_LOUD = 10.0, 0.25
LEAST_SECONDS = 8


@contextmanager
def with_record_as_reason(imu: pd.DataFrame, report: PrefilterReport | None) -> Iterator[None]:
    """Add outliers to an error message: those after the pre-filter, or all without one.

    Parameters
    ----------
    imu : DataFrame
        Imu table of the alignment inside.
    report : PrefilterReport or None
        Report of its pre-filter.
    """
    try:
        yield
    except DataError as error:
        reason = error.finding
        if report is None:
            screened = _outliers(imu)
            if screened is not None:
                channel, rows = screened
                first = float(imu.index[rows[0]])
                values = {"count": len(rows), "channel": channel, "first": first}
                raise DataError(reason.explains("alignment.outliers", **values)) from None
        # A low rate is a caution, not a fault.
        elif fault := next((f for f in report.findings if f.code != LOW_RATE), None):
            raise DataError(
                reason.explains(
                    "alignment.fails-after-prefilter",
                    row=reason.row if fault.row is None else fault.row,
                    of_what=fault.quantity,
                    reason_2=fault,
                )
            ) from None
        loud = _unquiet(imu)
        if loud is None:
            raise
        values = dict(zip(("channel", "begin", "end", "ratio"), loud, strict=True))
        raise DataError(reason.explains("alignment.channel-scatters", **values)) from None


def _unquiet(imu: pd.DataFrame) -> tuple[str, float, float, float] | None:
    """Channel with a scatter far above its usual one: begin, end and ratio."""
    columns = [c for c in [*GYRO, *ACCEL] if c in imu.columns]
    time = index_of(imu)
    size = max(2, round(1.0 / float(np.median(np.diff(time)))))
    count = len(imu) // size
    if count < LEAST_SECONDS:
        return None
    blocks = values_of(imu, columns)[: count * size].reshape(count, size, len(columns))
    scatter = blocks.std(axis=1)
    usual = np.median(scatter, axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(usual > 0.0, scatter / usual, 0.0)
    second, channel = (int(k) for k in np.unravel_index(ratio.argmax(), ratio.shape))
    worst = float(ratio[second, channel])
    loud = ratio[:, channel] > LOUD
    if worst < LOUD or loud.mean() > MOST_LOUD:
        return None
    first, last = second, second
    while first > 0 and loud[first - 1]:
        first -= 1
    while last + 1 < count and loud[last + 1]:
        last += 1
    begin, end = float(time[first * size]), float(time[(last + 1) * size - 1])
    return columns[channel], begin, end, worst


def _outliers(imu: pd.DataFrame) -> tuple[str, np.ndarray] | None:
    """Channel with the most outliers, and its outlier samples."""
    columns = [c for c in [*GYRO, *ACCEL] if c in imu.columns]
    try:
        even_step(index_of(imu))
    except DataError:
        return None
    design = OutlierDesign()
    values = np.ascontiguousarray(values_of(imu, columns))
    _, screened = design.advance(design.begin(len(columns)), values, True)
    flagged = screened.flags == REPLACED
    share = flagged.mean(axis=0)
    share[share > ALIGNMENT_OUTLIERS_MOST] = 0.0
    worst = int(share.argmax())
    if share[worst] < LEAST:
        return None
    return columns[worst], np.flatnonzero(flagged[:, worst]) + screened.first


# Accuracy over alignment time: coarse over shorter parts, fine epoch by epoch.


#: Shortest length to try, s, and number of lengths, evenly spaced in their logarithm.
ALIGNMENT_READINESS_LEAST, TRIES = 15.0, 16


@dataclass(frozen=True, eq=False)
class AlignmentReadiness:
    """Alignment time against accuracy.

    Attributes
    ----------
    against : {'truth', 'reference', 'answer'}
        What the differences refer to: the truth of a simulation, a stated reference, or the
        result of the whole record.
    coarse, fine : DataFrame
        By time since the start in s: ``roll_sd``, ``pitch_sd``, ``heading_sd`` and
        ``roll_off``, ``pitch_off``, ``heading_off``, deg; NaN where unknown. ``fine`` is empty
        without a fine alignment.
    refused : tuple of (float, Finding)
        Lengths for which the coarse alignment failed, and why.
    """

    against: str
    coarse: pd.DataFrame
    fine: pd.DataFrame
    refused: tuple[tuple[float, Finding], ...]


def alignment_readiness(
    align: Callable[[pd.DataFrame], Alignment],
    imu: pd.DataFrame,
    attitude: pd.DataFrame,
    fine: FineResult | None,
    truth: pd.DataFrame | None,
    reference: ReferenceTable | None,
) -> AlignmentReadiness:
    """Align over shorter parts of a record, and compare the errors with their bounds.

    Parameters
    ----------
    align : callable
        Coarse alignment of a part of the record.
    imu : DataFrame
        Imu table of the whole record.
    attitude : DataFrame
        Attitude table of the result over the record.
    fine : FineResult, optional
    truth : DataFrame, optional
        Attitude table.
    reference : ReferenceTable, optional
    """
    begin = float(imu.index[0])
    against = "answer" if truth is None else "truth"
    offset = np.zeros(3)
    if truth is None and reference is not None:
        against = "reference"
        offset = reference_offset(attitude, reference)
    known = attitude if truth is None else truth
    lengths = _lengths(float(imu.index[-1]) - begin)
    found = readiness(align, imu, lengths, known).table
    refused = found["refused"].notna().to_numpy()
    coarse = found[~refused]
    sd = coarse[[f"{a}_sd" for a in EULER]].to_numpy(dtype=np.float64)
    off = coarse[[f"{a}_error" for a in EULER]].to_numpy(dtype=np.float64) + offset
    return AlignmentReadiness(
        against,
        _table(coarse.index.to_numpy(dtype=np.float64), np.hstack([sd, off])),
        _fine(fine, begin, known, offset),
        tuple(zip(found.index[refused].tolist(), found["refused"][refused].tolist(), strict=True)),
    )


def reference_offset(attitude: pd.DataFrame, reference: ReferenceTable) -> Array:
    """Result minus a stated attitude, (3,), deg; NaN where it is not stated."""
    stated = np.array(
        [
            np.nan if x is None else x
            for x in (reference.roll_deg, reference.pitch_deg, reference.heading_deg)
        ]
    )
    row = 0 if reference.at == "start" else -1
    return np.asarray(within_half_turn(values_of(attitude, EULER)[row] - stated))


def _lengths(whole: float) -> list[float]:
    if whole <= ALIGNMENT_READINESS_LEAST:
        return [whole]
    return [float(x) for x in np.geomspace(ALIGNMENT_READINESS_LEAST, whole, TRIES)]


def _fine(
    fine: FineResult | None, begin: float, known: pd.DataFrame, offset: Array
) -> pd.DataFrame:
    if fine is None:
        return _table(np.empty(0), np.empty((0, 6)))
    # The first row is the assumption before the first epoch.
    history = fine.history.iloc[1:]
    time = history.index.to_numpy(dtype=np.float64)
    sd = history[[f"{a}_sd" for a in EULER]].to_numpy(dtype=np.float64)
    off = _off(history[EULER].to_numpy(dtype=np.float64), time, known) + offset
    return _table(time - begin, np.hstack([sd, off]))


def _off(angles: Array, time: Array, known: pd.DataFrame) -> Array:
    """Angles minus the known ones at the nearest stamps, deg."""
    stamps = known.index.to_numpy(dtype=np.float64)
    at = np.clip(np.searchsorted(stamps, time), 1, len(stamps) - 1)
    at -= (time - stamps[at - 1] < stamps[at] - time).astype(np.int64)
    return np.asarray(within_half_turn(angles - values_of(known, EULER)[at]))


def _table(time: Array, rows: Array) -> pd.DataFrame:
    columns = [f"{a}_{what}" for what in ("sd", "off") for a in EULER]
    return pd.DataFrame(rows, index=pd.Index(time, name="time"), columns=columns)
