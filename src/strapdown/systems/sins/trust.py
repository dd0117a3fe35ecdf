"""Integrity of a navigation run: heading, innovations, and the first inconsistency."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.aiding.aid import Measurement, TabulatedMeasurement, lasting
from strapdown.aiding.gnss import Gnss
from strapdown.config.navigation import NavigationSpec, make_filter
from strapdown.ellipsoids import Ellipsoid, find_ellipsoid
from strapdown.errors import Finding, StrapdownError
from strapdown.evaluation.heading_light import (
    SURE,
    HeadingIntegrity,
    Heard,
    LightSpan,
    heading_light,
    recent_scatter,
)
from strapdown.evaluation.trajectory_differences import trajectory_differences
from strapdown.nav_state import NavState
from strapdown.navigation.consistency import (
    Inconsistency,
    ObservationConsistency,
    consistency_of_all,
    inconsistencies,
)
from strapdown.navigation.record import NavigationRecord
from strapdown.navigation.recorder import IntervalRecorder
from strapdown.sensors.uncertainty import ImuUncertainty
from strapdown.systems.progress import Progress
from strapdown.systems.sins.chain import NavigationPipeline
from strapdown.systems.sins.drive import run_batch
from strapdown.systems.sins.gyrocompass import (
    Manoeuvre,
    compasses_of,
    manoeuvres_from,
    north_within,
    sd_after,
)
from strapdown.systems.sins.heading_sources import agreeing_sources
from strapdown.systems.sins.heading_witness import (
    CarriedHeading,
    Evidence,
    Witnesses,
    carry_headings,
    hear_witnesses,
    witnesses_of,
)
from strapdown.systems.sins.intake import joined_steps
from strapdown.systems.sins.modes import Aligned
from strapdown.tables import EULER, GEODETIC, POSITION_SD, VELOCITY, VELOCITY_SD
from strapdown.tables.checks import index_of, values_of

__all__ = ["Advice", "IntegrityReport", "Repeated", "repeat_without", "trust_of"]


Array = NDArray[np.float64]

#: Most spans with advice, and their least length, s.
MOST_ADVISED, LEAST_ADVISED = 4, 5.0
#: Standard deviation beyond which a heading counts as unknown, deg.
NO_NORTH = 45.0
#: Interval between states from which a check can begin, s.
LONGEST_STEP = 0.25
NO_FIXES = "navigation.no-receiver-fixes"


@dataclass(frozen=True)
class Advice:
    """Maneuvers that would have improved an untrusted heading.

    Attributes
    ----------
    span : LightSpan
    time : float, s
        Last second of the span.
    sd : float, deg
        Standard deviation of the heading then, without assumptions about it.
    options : tuple of (Manoeuvre, float)
        Each with the standard deviation after it, deg; the best first. Empty without fixes of a
        receiver to observe one.
    """

    span: LightSpan
    time: float
    sd: float
    options: tuple[tuple[Manoeuvre, float], ...]


@dataclass(frozen=True, eq=False)
class IntegrityReport:
    """Integrity of a run.

    Attributes
    ----------
    light : HeadingIntegrity
    unwitnessed : tuple of Finding
        Why no independent heading check was possible; empty where one was.
    north_sd : float, deg
        Standard deviation of north found by these gyros at rest.
    advice : tuple of Advice
        For the longest spans that are not green.
    consistency : mapping of str to ObservationConsistency
        By name of the observation.
    inconsistencies : tuple of Inconsistency
        In order of time.
    repeated : Repeated or None
        The run without the first of them.
    """

    light: HeadingIntegrity
    unwitnessed: tuple[Finding, ...]
    north_sd: float
    advice: tuple[Advice, ...]
    consistency: Mapping[str, ObservationConsistency]
    inconsistencies: tuple[Inconsistency, ...]
    repeated: Repeated | None

    @property
    def first(self) -> Inconsistency | None:
        """The first inconsistency."""
        return self.inconsistencies[0] if self.inconsistencies else None

    @property
    def against_bounds(self) -> Inconsistency | None:
        """The first inconsistency other than gross errors, which do not question the filter."""
        return next((one for one in self.inconsistencies if one.kind != "gross"), None)


def trust_of(
    spec: NavigationSpec,
    chain: NavigationPipeline,
    sensors: ImuUncertainty,
    imu: pd.DataFrame,
    tables: Mapping[str, pd.DataFrame],
    record: NavigationRecord,
    aligned: Sequence[Aligned],
    progress: Progress,
) -> IntegrityReport:
    """Assess the integrity of a run.

    Parameters
    ----------
    spec : NavigationSpec
    chain : NavigationPipeline
        Pipeline of the run.
    sensors : ImuUncertainty
    imu : DataFrame
    tables : mapping of str to DataFrame
        By name of the measurement.
    record : NavigationRecord
        Result of the run.
    aligned : sequence of Aligned
        Its alignments.
    progress : callable
        Called with a stage and the share of it that is done.

    Returns
    -------
    IntegrityReport
    """
    asked = spec.trust
    progress("judging the heading", 0.0)
    consistency = consistency_of_all(record.innovations)
    evidence: list[Evidence] = []
    made, why = None, _unable(chain, record)
    try:
        if why is None:
            made = witnesses_of(make_filter(spec, sensors), chain, imu, tables, record, consistency)
            why = None if made is not None else Finding(NO_FIXES, severity="note")
        if made is not None:
            evidence = hear_witnesses(made, record, asked.heading_limit_deg / 3.0)
    except StrapdownError as error:
        # Where an independent solution is not possible, the run is reported without it.
        made, evidence = None, []
        why = Finding("navigation.no-second-solution", severity="note", reason=error.finding)
    carried, no_north = _carried(spec, chain, sensors, imu, record, aligned)
    sources = agreeing_sources(chain, record, carried)
    heard: list[Heard] = [*evidence, *carried, *sources]
    light = heading_light(
        record,
        heard,
        recent_scatter(record),
        green=asked.heading_limit_deg,
        red=asked.heading_red_deg,
    )
    found = inconsistencies(consistency, record.innovations, lasting(chain.navigator.aids))
    repeated = None
    if found and asked.repeat:
        stage = f"again, without {found[0].aid} where it is not consistent"
        progress(stage, 0.3)
        repeated = repeat_without(
            chain,
            imu,
            tables,
            record,
            found,
            find_ellipsoid(spec.ellipsoid),
            lambda _, share: progress(stage, 0.3 + 0.7 * share),
        )
    return IntegrityReport(
        light=light,
        unwitnessed=() if heard or why is None else (why, *no_north),
        north_sd=_north_sd(spec, sensors, record),
        advice=_advice(light, evidence, made, record),
        consistency=consistency,
        inconsistencies=found,
        repeated=repeated,
    )


def _carried(
    spec: NavigationSpec,
    chain: NavigationPipeline,
    sensors: ImuUncertainty,
    imu: pd.DataFrame,
    record: NavigationRecord,
    aligned: Sequence[Aligned],
) -> tuple[list[CarriedHeading], tuple[Finding, ...]]:
    """Headings carried from rests, or why there are none."""
    ellipsoid = find_ellipsoid(spec.ellipsoid)
    north = _north_sd(spec, sensors, record)
    if not SURE * north <= spec.trust.heading_limit_deg:
        if north >= NO_NORTH:
            return [], (Finding("navigation.gyros-find-no-north", severity="note"),)
        code = "navigation.gyros-find-north-coarsely"
        return [], (Finding(code, severity="note", north_sd_deg=north),)
    try:
        found, doubts, why = compasses_of(chain, sensors, imu, record, aligned, ellipsoid)
        if not found:
            return [], () if why is None else (why,)
        end = float(record.trajectory.index[-1])
        steps = joined_steps(chain.intake, imu, found[0].time, end)
        return carry_headings(found, doubts, steps, record, sensors, ellipsoid), ()
    except StrapdownError as error:
        code = "navigation.gyros-not-followed"
        return [], (Finding(code, severity="note", reason=error.finding),)


def _north_sd(spec: NavigationSpec, sensors: ImuUncertainty, record: NavigationRecord) -> float:
    lat_deg = float(record.trajectory["lat"].iloc[0])
    return north_within(sensors, lat_deg, find_ellipsoid(spec.ellipsoid))


def _unable(chain: NavigationPipeline, record: NavigationRecord) -> Finding | None:
    """Why a record does not allow heading checks by fixes."""
    if not any(type(aid) is Gnss for aid in chain.navigator.aids):
        return Finding(NO_FIXES, severity="note")
    time = record.trajectory.index.to_numpy(dtype=np.float64)
    if len(time) < 2 or float(np.median(np.diff(time))) > LONGEST_STEP:
        return Finding("navigation.recorder-too-slow-for-second-solution", severity="note")
    return None


def _advice(
    light: HeadingIntegrity,
    evidence: list[Evidence],
    made: Witnesses | None,
    record: NavigationRecord,
) -> tuple[Advice, ...]:
    """Advice for the longest spans that are not green."""
    spans = [s for s in light.spans if s.colour != "green" and s.end - s.begin >= LEAST_ADVISED]
    longest = sorted(spans, key=lambda s: s.begin - s.end)[:MOST_ADVISED]
    out = []
    for span in sorted(longest, key=lambda s: s.begin):
        if made is None:
            out.append(Advice(span, span.end - 1.0, math.nan, ()))
            continue
        # The newest instant with a check: there is none at the very end of a run.
        times = [e.time[(e.time >= span.begin) & (e.time < span.end)] for e in evidence]
        heard = np.concatenate([*times, []])
        if heard.size:
            out.append(_advised(span, float(heard.max()), evidence, made, record))
    return tuple(out)


def _advised(
    span: LightSpan,
    time: float,
    evidence: list[Evidence],
    made: Witnesses,
    record: NavigationRecord,
) -> Advice:
    told = [(e, int(np.searchsorted(e.time, time))) for e in evidence]
    told = [(e, k) for e, k in told if k < len(e.time) and e.time[k] == time]
    start = _state(record, time)
    best, at = min(told, key=lambda pair: pair[0].sd[pair[1]])
    filter_ = made.navigator.filter
    mark = max(int(np.searchsorted(index_of(record.sd), time + 1e-6)) - 1, 0)
    names = list(filter_.model.layout.labels())[9:]
    sd = record.sensors_sd[names].iloc[mark].to_numpy(dtype=np.float64)
    P = np.diag(np.concatenate([np.zeros(9), np.square(sd)]))
    # By the factor by which its innovations exceed their expected scatter.
    P[:9, :9] = best.covariance[at] * best.scale[at] ** 2
    aid = made.navigator.aids[0]
    assert isinstance(aid, Gnss)
    table = made.tables[aid.name]
    place = _typical(table, POSITION_SD, aid.position_sd_factor) if aid.use_position else None
    speed = _typical(table, VELOCITY_SD, aid.velocity_sd_factor) if aid.use_velocity else None
    steps = np.diff(index_of(table))
    interval = float(np.clip(np.median(steps), 0.2, 2.0)) if steps.size else 1.0
    options = [
        (one, sd_after(filter_, start, P, one, place, speed, interval))
        for one in manoeuvres_from(float(np.hypot(*start.v_n[:2])))
    ]
    options.sort(key=lambda pair: pair[1])
    return Advice(span, time, float(best.sd[at]), tuple(options))


def _typical(table: pd.DataFrame, columns: list[str], factor: float) -> Array | None:
    """Standard deviations of the middle row; None where it has none."""
    sd = values_of(table, columns)
    sd = sd[np.isfinite(sd).all(axis=1) & (sd > 0.0).all(axis=1)]
    return np.asarray(factor * np.median(sd, axis=0)) if len(sd) else None


def _state(record: NavigationRecord, time: float) -> NavState:
    row = record.trajectory.iloc[int(np.searchsorted(record.trajectory.index, time - 1e-6))]
    lat, lon, alt = (float(row[c]) for c in GEODETIC)
    roll, pitch, heading = (float(row[c]) for c in EULER)
    v_n = row[VELOCITY].to_numpy(dtype=np.float64)
    return NavState.from_degrees(
        lat, lon, alt, v_n=v_n, roll_deg=roll, pitch_deg=pitch, heading_deg=heading
    )


# Re-run of the navigation without the inconsistent measurements.


#: Rate at which the two runs are compared, Hz.
RATE = 1.0
#: Tolerance between the stamps of epochs and rows, s.
SAME = 1e-3
#: Measured quantities of a receiver, in words.
PARTS = {"position": "places", "velocity": "velocities"}
#: Where less than this share of the fixes would remain in a run without others, their standard
#: deviations are increased instead.
LEAST_LEFT = 0.5


@dataclass(frozen=True, eq=False)
class Repeated:
    """Re-run excluding an inconsistency, compared with the run itself.

    Attributes
    ----------
    without : str
        The change, in words.
    record : NavigationRecord or None
        None where it could not be run.
    differences : DataFrame or None
        Run minus re-run (`trajectory_differences`), once a second.
    left : tuple of Inconsistency
        Inconsistencies of the re-run.
    failed : Finding or None
        Why it could not be run; None where it could.
    """

    without: str
    record: NavigationRecord | None
    differences: pd.DataFrame | None
    left: tuple[Inconsistency, ...] = ()
    failed: Finding | None = None


def repeat_without(
    chain: NavigationPipeline,
    imu: pd.DataFrame,
    tables: Mapping[str, pd.DataFrame],
    record: NavigationRecord,
    found: Sequence[Inconsistency],
    ellipsoid: Ellipsoid,
    progress: Progress,
) -> Repeated:
    """Re-run a pipeline excluding an inconsistent measurement, its epochs or a stretch of it.

    Gross errors are excluded epoch by epoch, a change over its stretch. A measurement that is
    inconsistent throughout is excluded if another one observes position or velocity; otherwise its
    standard deviation is increased by the factor that makes it consistent.

    Parameters
    ----------
    chain : NavigationPipeline
    imu : DataFrame
    tables : mapping of str to DataFrame
    record : NavigationRecord
        Result of the run.
    found : sequence of Inconsistency
        The first is excluded; of gross errors all those of the same measurement.
    ellipsoid : Ellipsoid
    progress : callable

    Returns
    -------
    Repeated
    """
    aids, told, words = _changed(chain.navigator.aids, tables, found)
    changed = replace(chain, navigator=replace(chain.navigator, aids=aids, smoother=None))
    try:
        run = run_batch(
            changed, imu, told, IntervalRecorder(rate_hz=RATE), progress, chunk=60.0
        ).record
    except StrapdownError as error:
        return Repeated(words, None, None, failed=error.finding)
    rows = run.trajectory
    span = record.trajectory.index
    rows = rows[(rows.index >= span[0]) & (rows.index <= span[-1])]
    rows.attrs = dict(run.trajectory.attrs)
    differences = -trajectory_differences(rows, record.trajectory, ellipsoid)
    left = inconsistencies(consistency_of_all(run.innovations), run.innovations, lasting(aids))
    return Repeated(words, run, differences, left)


def _changed(
    aids: tuple[Measurement, ...],
    tables: Mapping[str, pd.DataFrame],
    found: Sequence[Inconsistency],
) -> tuple[tuple[Measurement, ...], dict[str, pd.DataFrame], str]:
    """Measurements and tables after an exclusion, and its description."""
    one = found[0]
    aid = next(a for a in aids if a.name == one.aid)
    told = dict(tables)
    part = one.name.rpartition(".")[2]
    table = tables.get(one.aid)
    if table is not None and not one.throughout:
        alike = [x for x in found if x.aid == one.aid and x.kind == "gross"]
        kept = np.ones(len(table), dtype=np.bool_)
        for each in alike if one.kind == "gross" else [one]:
            kept &= _kept(table, each, aid)
        others = [a for a in aids if a is not aid and isinstance(a, Gnss)]
        if kept.any() and (others or kept.mean() >= LEAST_LEFT):
            out = table[kept]
            out.attrs = dict(table.attrs)
            told[one.aid] = out
            count = int((~kept).sum())
            many = f"{count} of the {len(table)} rows of {one.aid}"
            if one.kind == "gross":
                return aids, told, f"without {many}: its gross errors"
            return aids, told, f"without {many}, from {one.since:.9g} to {one.until:.9g} s"
    if isinstance(aid, Gnss):
        both = aid.use_position and aid.use_velocity and _has_both(table)
        if both and part in PARTS and one.kind != "gross":
            less = (
                replace(aid, use_position=False)
                if part == "position"
                else replace(aid, use_velocity=False)
            )
            return _swapped(aids, aid, less), told, f"without the {PARTS[part]} of {one.aid}"
        if not any(isinstance(a, Gnss) for a in aids if a is not aid):
            factor = max(one.factor, 2.0)
            less = replace(
                aid,
                position_sd_factor=factor * aid.position_sd_factor,
                velocity_sd_factor=factor * aid.velocity_sd_factor,
            )
            words = (
                f"with {one.aid}, of which nothing can be spared, believed {factor:.2g} times less"
            )
            return _swapped(aids, aid, less), told, words
    if isinstance(aid, TabulatedMeasurement):
        told.pop(one.aid, None)
    return tuple(a for a in aids if a is not aid), told, f"without {one.aid}"


def _swapped(
    aids: tuple[Measurement, ...], old: Measurement, new: Measurement
) -> tuple[Measurement, ...]:
    return tuple(new if a is old else a for a in aids)


def _has_both(table: pd.DataFrame | None) -> bool:
    """Whether fixes hold positions and velocities."""
    return table is not None and all(
        bool(np.isfinite(values_of(table, sd)).all(axis=1).any())
        for sd in (POSITION_SD, VELOCITY_SD)
    )


def _kept(table: pd.DataFrame, one: Inconsistency, aid: Measurement) -> NDArray[np.bool_]:
    """Rows of a table other than the given epochs."""
    time = index_of(table) - float(getattr(aid, "time_offset", 0.0))
    if one.name.endswith(".velocity"):
        time = time - float(getattr(aid, "velocity_delay", 0.0))
    if one.kind == "change":
        return np.asarray((time < one.since - SAME) | (time > one.until + SAME))
    near = np.searchsorted(one.epochs, time)
    apart = np.full(len(time), np.inf)
    for k in (near - 1, near):
        good = (k >= 0) & (k < len(one.epochs))
        apart[good] = np.minimum(apart[good], np.abs(one.epochs[k[good]] - time[good]))
    return np.asarray(apart > SAME)
