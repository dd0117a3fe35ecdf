"""Integrity of a navigation run: heading, innovations, and the first inconsistency."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.ellipsoids import Ellipsoid, find_ellipsoid
from strapdown.errors import Finding, StrapdownError
from strapdown.estimation.error_filter import ErrorFilter
from strapdown.evaluation.trajectory_differences import trajectory_differences
from strapdown.navigation.consistency import (
    Inconsistency,
    ObservationConsistency,
    consistency_of_all,
    inconsistencies,
)
from strapdown.navigation.gyrocompass import (
    Manoeuvre,
    compasses_of,
    manoeuvres_from,
    north_within,
    sd_after,
)
from strapdown.navigation.heading_checks import (
    HeadingChecks,
    agreeing_sources,
    carry_headings,
    heading_checks_of,
    run_heading_checks,
)
from strapdown.navigation.heading_integrity import (
    CARRIED,
    CLIP,
    FAR_OFF,
    FEWEST,
    LOST,
    RECENT,
    REFUTED,
    STATUSES,
    SURE,
    HeadingCheck,
    HeadingIntegrity,
    StatusSpan,
    heading_status,
    recent_scatter,
    seconds_of,
)
from strapdown.navigation.measurements.gnss import Gnss
from strapdown.navigation.measurements.measurement import Measurement, TabulatedMeasurement, lasting
from strapdown.navigation.pipeline import NavigationPipeline
from strapdown.navigation.preprocessing import joined_steps
from strapdown.navigation.record import NavigationRecord, innovation_labels, state_of_row
from strapdown.navigation.recorder import IntervalRecorder
from strapdown.navigation.replay import PipelineRun, run_batch
from strapdown.progress import Progress
from strapdown.tables import POSITION_SD, TRAJECTORY, VELOCITY_SD
from strapdown.tables.checks import Array, index_of, values_of, view_of

#: Most spans with advice, and their least length, s.
MOST_ADVISED, LEAST_ADVISED = 4, 5.0
#: Standard deviation beyond which a heading counts as unknown, deg.
NO_NORTH = 45.0
#: Interval between states from which a check can begin, s.
LONGEST_STEP = 0.25
NO_FIXES = "navigation.no-receiver-fixes"
#: Share of the newest measurements of a quantity whose rejection rejects the quantity.
MOSTLY = 0.5


@dataclass(frozen=True)
class Advice:
    """Maneuvers that would have improved an untrusted heading.

    Attributes
    ----------
    time : float, s
        Last second of the span.
    sd : float, deg
        Standard deviation of the heading then, without assumptions about it.
    options : tuple of (Manoeuvre, float)
        Each with the standard deviation after it, deg; the best first. Empty without fixes of a
        receiver to observe one.
    """

    span: StatusSpan
    time: float
    sd: float
    options: tuple[tuple[Manoeuvre, float], ...]


@dataclass(frozen=True, eq=False)
class IntegrityReport:
    """Integrity of a run.

    Attributes
    ----------
    unconfirmed : tuple of Finding
        Why no independent heading check was possible; empty where one was.
    north_sd : float, deg
        Standard deviation of north found by these gyros at rest.
    advice : tuple of Advice
        For the longest spans without a trusted heading.
    consistency : mapping of str to ObservationConsistency
        By name of the observation.
    inconsistencies : tuple of Inconsistency
        In order of time.
    repeated : Repeated or None
        The run without the first inconsistent measurement.
    quantities : tuple of QuantityIntegrity
        Of position and velocity, horizontal and vertical.
    """

    heading: HeadingIntegrity
    unconfirmed: tuple[Finding, ...]
    north_sd: float
    advice: tuple[Advice, ...]
    consistency: Mapping[str, ObservationConsistency]
    inconsistencies: tuple[Inconsistency, ...]
    repeated: Repeated | None
    quantities: tuple[QuantityIntegrity, ...] = ()

    @property
    def worst(self) -> QuantityIntegrity | None:
        """The quantity that was rejected for the longest time; None where none was."""
        rejected = [one for one in self.quantities if one.share("rejected") > 0.0]
        return max(rejected, key=lambda one: one.share("rejected"), default=None)

    @property
    def first(self) -> Inconsistency | None:
        """The first inconsistency."""
        return self.inconsistencies[0] if self.inconsistencies else None

    @property
    def against_bounds(self) -> Inconsistency | None:
        """The first inconsistency other than gross errors, which do not question the filter."""
        return next((one for one in self.inconsistencies if one.kind != "gross"), None)


def assess_integrity(
    chain: NavigationPipeline,
    filter_: ErrorFilter,
    imu: pd.DataFrame,
    tables: Mapping[str, pd.DataFrame],
    run: PipelineRun,
    limits_deg: tuple[float, float],
    repeat: bool,
    progress: Progress,
) -> IntegrityReport:
    """Assess the integrity of a run.

    Parameters
    ----------
    chain : NavigationPipeline
        Pipeline of the run, with the uncertainty of its sensors.
    filter_ : ErrorFilter
        Its filter without states of measurements, for independent solutions.
    tables : mapping of str to DataFrame
        By name of the measurement.
    limits_deg : tuple of float, (2,), deg
        Error limit for a trusted heading, and 95 % bound of a rejected one.
    repeat : bool
        Whether to run again excluding the first inconsistent measurement.
    progress : callable
        Called with a stage and its completed share.
    """
    record = run.record
    trusted_below, rejected_beyond = limits_deg
    ellipsoid = find_ellipsoid(chain.navigator.filter.mechanization.ellipsoid)
    progress("judging the heading", 0.0)
    consistency = consistency_of_all(record.innovations)
    evidence: list[HeadingCheck] = []
    made, why = None, _unable(chain, record)
    try:
        if why is None:
            made = heading_checks_of(filter_, chain, imu, tables, record, consistency)
            why = None if made is not None else Finding(NO_FIXES, severity="note")
        if made is not None:
            evidence = run_heading_checks(made, record, trusted_below / 3.0)
    except StrapdownError as error:
        # Where an independent solution is not possible, the run is reported without it.
        made, evidence = None, []
        why = Finding("navigation.no-second-solution", severity="note", reason=error.finding)
    assert chain.sensors is not None
    north_sd = north_within(chain.sensors, float(record.trajectory["lat"].iloc[0]), ellipsoid)
    carried, no_north = _carried(chain, imu, run, north_sd, trusted_below)
    sources = agreeing_sources(chain, record, carried)
    heard = [*evidence, *carried, *sources]
    heading = heading_status(
        record,
        heard,
        recent_scatter(record),
        trusted_below=trusted_below,
        rejected_beyond=rejected_beyond,
    )
    found = inconsistencies(consistency, record.innovations, lasting(chain.navigator.aids))
    repeated = None
    if found and repeat:
        stage = f"again, without {found[0].aid} where it is not consistent"
        progress(stage, 0.3)
        repeated = repeat_without(
            chain,
            imu,
            tables,
            record,
            found,
            ellipsoid,
            lambda _, share: progress(stage, 0.3 + 0.7 * share),
        )
    return IntegrityReport(
        heading=heading,
        unconfirmed=() if heard or why is None else (why, *no_north),
        north_sd=north_sd,
        advice=_advice(heading, evidence, made, record),
        consistency=consistency,
        inconsistencies=found,
        repeated=repeated,
        quantities=quantity_status(record),
    )


def _carried(
    chain: NavigationPipeline,
    imu: pd.DataFrame,
    run: PipelineRun,
    north_sd: float,
    trusted_below: float,
) -> tuple[list[HeadingCheck], tuple[Finding, ...]]:
    """Headings carried from rests, or why there are none."""
    sensors, record = chain.sensors, run.record
    assert sensors is not None
    ellipsoid = find_ellipsoid(chain.navigator.filter.mechanization.ellipsoid)
    if not SURE * north_sd <= trusted_below:
        if north_sd >= NO_NORTH:
            return [], (Finding("navigation.gyros-find-no-north", severity="note"),)
        code = "navigation.gyros-find-north-coarsely"
        return [], (Finding(code, severity="note", north_sd_deg=north_sd),)
    try:
        found, doubts, why = compasses_of(chain, sensors, imu, record, run.aligned, ellipsoid)
        if not found:
            return [], () if why is None else (why,)
        end = float(record.trajectory.index[-1])
        steps = joined_steps(chain.intake, imu, found[0].time, end)
        return carry_headings(found, doubts, steps, record, sensors, ellipsoid), ()
    except StrapdownError as error:
        code = "navigation.gyros-not-followed"
        return [], (Finding(code, severity="note", reason=error.finding),)


def _unable(chain: NavigationPipeline, record: NavigationRecord) -> Finding | None:
    """Why a record does not allow heading checks by fixes."""
    if not any(type(aid) is Gnss for aid in chain.navigator.aids):
        return Finding(NO_FIXES, severity="note")
    time = record.trajectory.index.to_numpy(dtype=np.float64)
    if len(time) < 2 or float(np.median(np.diff(time))) > LONGEST_STEP:
        return Finding("navigation.recorder-too-slow-for-second-solution", severity="note")
    return None


def _advice(
    heading: HeadingIntegrity,
    evidence: list[HeadingCheck],
    made: HeadingChecks | None,
    record: NavigationRecord,
) -> tuple[Advice, ...]:
    """Advice for the longest spans without a trusted heading."""
    spans = [s for s in heading.spans if s.status != "trusted" and s.end - s.begin >= LEAST_ADVISED]
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
    span: StatusSpan,
    time: float,
    evidence: list[HeadingCheck],
    made: HeadingChecks,
    record: NavigationRecord,
) -> Advice:
    told = [(e, int(np.searchsorted(e.time, time))) for e in evidence]
    told = [(e, k) for e, k in told if k < len(e.time) and e.time[k] == time]
    row = int(np.searchsorted(record.trajectory.index, time - 1e-6))
    start = state_of_row(view_of(record.trajectory, TRAJECTORY)[row])
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


# Position and velocity, horizontal and vertical, beside the measurements of each.


#: Quantities, the labels of the innovations that measure each, and its columns of `sd`.
QUANTITIES: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "horizontal position": (("north, m", "east, m"), ("north", "east")),
    "height": (("down, m", "height, m"), ("down",)),
    "horizontal velocity": (("VN, m/s", "VE, m/s"), ("VN", "VE")),
    "vertical velocity": (("VD, m/s",), ("VD",)),
}
#: Reason of a status of these, by its code.
QUANTITY_REASONS: dict[str, str] = {
    "": "its measurements agree with it",
    "unmeasured": "too few measurements, or none for a minute: inertial sensors alone",
    "not_estimated": "the error model does not estimate it, and no measurement tests it",
    "scatter": "its measurements scatter more than expected",
    "apart": "its measurements contradict it: most are rejected, or far beyond their bounds",
}


@dataclass(frozen=True, eq=False)
class QuantityIntegrity:
    """Status of a quantity at each second of a run, by its measurements.

    Attributes
    ----------
    name : str
        One of `QUANTITIES`.
    table : DataFrame
        By time in s: ``status`` (index in `STATUSES`) and ``reason`` (a key of
        `QUANTITY_REASONS`).
    """

    name: str
    table: pd.DataFrame

    def share(self, status: str) -> float:
        """Share of the seconds with a status."""
        codes = self.table["status"].to_numpy()
        return float(np.mean(codes == STATUSES.index(status))) if len(codes) else 0.0

    @property
    def at_end(self) -> tuple[str, str]:
        """Status and reason of the last second."""
        last = self.table.iloc[-1]
        return STATUSES[int(last["status"])], str(last["reason"])


def quantity_status(record: NavigationRecord) -> tuple[QuantityIntegrity, ...]:
    """Return the status of position and velocity, horizontal and vertical, at each second.

    Trusted: measured within the last minute, and the newest innovations scatter at most twice as
    much as predicted. Rejected: they scatter more than three times as much, or half were
    rejected, which says that the measurement or the run is wrong. Unverified: all else.
    """
    seconds = seconds_of(record)
    if not len(seconds):
        return ()
    return tuple(
        QuantityIntegrity(name, _status_by(record, seconds, labels, set(columns)))
        for name, (labels, columns) in QUANTITIES.items()
    )


def _status_by(
    record: NavigationRecord, seconds: Array, labels: Sequence[str], columns: set[str]
) -> pd.DataFrame:
    """Status at each second, by the worst of the observations with these components."""
    estimated = not columns & set(record.not_estimated)
    status = np.full(len(seconds), STATUSES.index("unverified"))
    reason = np.full(len(seconds), "unmeasured" if estimated else "not_estimated", dtype=object)
    spread, lost = np.full((2, len(seconds)), np.nan)
    for table in record.innovations.values():
        there = [label for label in labels if f"nu {label}" in table.columns]
        if not there or not len(table):
            continue
        nu, s, weight = (
            table[[f"{part} {label}" for label in there]].to_numpy(dtype=np.float64)
            for part in ("nu", "s", "weight")
        )
        with np.errstate(divide="ignore", invalid="ignore"):
            u = np.nan_to_num(np.clip(nu / np.sqrt(s), -CLIP, CLIP))
        # As `recent_scatter`: single rejected measurements did no harm.
        u[weight <= 0.0] = LOST
        time = table.index.to_numpy(dtype=np.float64)
        upto = np.searchsorted(time, seconds + 1e-6, side="right")
        # The last half minute, or the newest epochs of a measurement with fewer in it.
        since = np.minimum(
            np.searchsorted(time, seconds - RECENT, side="right"), np.maximum(upto - FEWEST, 0)
        )
        heard = (upto >= FEWEST) & (seconds - time[np.maximum(upto - 1, 0)] <= CARRIED)
        count = np.maximum(upto - since, 1)
        sums = [
            np.concatenate([[0.0], np.cumsum(x.mean(axis=1))])
            for x in (np.square(u), weight <= 0.0)
        ]
        square, refused = ((x[upto] - x[since]) / count for x in sums)
        spread = np.where(heard, np.fmax(spread, np.sqrt(square)), spread)
        lost = np.where(heard, np.fmax(lost, refused), lost)
    heard = np.isfinite(spread)
    with np.errstate(invalid="ignore"):
        off, apart = spread > FAR_OFF, (spread > REFUTED) | (lost >= MOSTLY)
    if estimated:
        status[heard], reason[heard] = STATUSES.index("trusted"), ""
        status[off], reason[off] = STATUSES.index("unverified"), "scatter"
    status[apart], reason[apart] = STATUSES.index("rejected"), "apart"
    return pd.DataFrame({"status": status, "reason": reason}, index=pd.Index(seconds, name="time"))


# Re-run of the navigation without the inconsistent measurements.


#: Rate at which the two runs are compared, Hz.
RATE = 1.0
#: Tolerance between the stamps of epochs and rows, s.
SAME = 1e-3
#: Where less than this share of the fixes would remain in a run without others, their standard
#: deviations are increased instead.
LEAST_LEFT = 0.5


@dataclass(frozen=True, eq=False)
class Repeated:
    """Re-run excluding an inconsistency, compared with the run itself.

    Attributes
    ----------
    change : Finding
        What was excluded, or given larger standard deviations.
    record : NavigationRecord or None
        None where it could not be run.
    differences : DataFrame or None
        Run minus re-run (`trajectory_differences`), once a second.
    left : tuple of Inconsistency
        Inconsistencies of the re-run.
    failed : Finding or None
        Why it could not be run; None where it could.
    """

    change: Finding
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
    """Re-run a pipeline excluding an inconsistent measurement, or some of its epochs.

    Gross errors are excluded epoch by epoch, a change over its stretch. A measurement that is
    inconsistent throughout is excluded if another one observes position or velocity; otherwise its
    standard deviation is increased by the factor that makes it consistent.

    Parameters
    ----------
    record : NavigationRecord
        Result of the run.
    found : sequence of Inconsistency
        The first is excluded; of gross errors all those of the same measurement.
    """
    aids, told, change = _changed(chain.navigator.aids, tables, found)
    changed = replace(chain, navigator=replace(chain.navigator, aids=aids, smoother=None))
    try:
        run = run_batch(
            changed, imu, told, IntervalRecorder(rate_hz=RATE), progress, chunk=60.0
        ).record
    except StrapdownError as error:
        return Repeated(change, None, None, failed=error.finding)
    rows = run.trajectory
    span = record.trajectory.index
    rows = rows[(rows.index >= span[0]) & (rows.index <= span[-1])]
    rows.attrs = dict(run.trajectory.attrs)
    differences = -trajectory_differences(rows, record.trajectory, ellipsoid)
    left = inconsistencies(consistency_of_all(run.innovations), run.innovations, lasting(aids))
    return Repeated(change, run, differences, left)


#: A squared innovation counts at most so many times its variance in a likelihood.
MOST = 25.0
#: Gain in the logarithm of the likelihood from which another run explains a record: in all, and
#: for each component. Innovations are correlated: a record has fewer independent ones.
LEAST_GAIN, GAIN_EACH = 20.0, 0.05


def likelihood_gain(
    innovations: Mapping[str, pd.DataFrame], other: Mapping[str, pd.DataFrame]
) -> tuple[float, int]:
    """Compare two runs over the same measurements by the likelihood of their innovations.

    Parameters
    ----------
    innovations, other : mapping of str to DataFrame
        By name of the observation. Epochs of both are compared.

    Returns
    -------
    gain : float
        Logarithm of the likelihood of the other less that of the first, rejected measurements
        included: normal, with tails that a gross error does not rule.
    count : int
        Number of components compared.
    """
    gain, count = 0.0, 0
    for name, table in innovations.items():
        if name not in other:
            continue
        labels = innovation_labels(table)
        _, *rows = np.intersect1d(index_of(table), index_of(other[name]), return_indices=True)
        nu, variance = (
            np.stack(
                [
                    values_of(one, [f"{part} {label}" for label in labels])[at]
                    for one, at in zip((table, other[name]), rows, strict=True)
                ]
            )
            for part in ("nu", "s")
        )
        told = (variance > 0.0).all(axis=0)
        size = np.minimum(np.square(nu) / np.where(told, variance, 1.0), MOST)
        size = np.where(told, size + np.log(np.where(told, variance, 1.0)), 0.0)
        gain += 0.5 * float(np.sum(size[0] - size[1]))
        count += int(told.sum())
    return gain, count


def rejected_percent(record: NavigationRecord) -> float:
    """Return the share of the components of all measurements that were rejected, percent."""
    weights = [
        values_of(table, [f"weight {label}" for label in innovation_labels(table)])
        for table in record.innovations.values()
    ]
    flat = np.concatenate([np.empty(0), *(one.ravel() for one in weights)])
    return 100.0 * float(np.mean(flat <= 0.0)) if len(flat) else 0.0


def _changed(
    aids: tuple[Measurement, ...],
    tables: Mapping[str, pd.DataFrame],
    found: Sequence[Inconsistency],
) -> tuple[tuple[Measurement, ...], dict[str, pd.DataFrame], Finding]:
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
            less: dict[str, float] = {"count": int((~kept).sum()), "rows": len(table)}
            if one.kind == "gross":
                return aids, told, _excluded("gross-errors", one, **less)
            less |= {"since": one.since, "until": one.until}
            return aids, told, _excluded("interval", one, **less)
    if isinstance(aid, Gnss):
        both = aid.use_position and aid.use_velocity and _has_both(table)
        if both and one.kind != "gross":
            if part == "position":
                other = _swapped(aids, aid, replace(aid, use_position=False))
                return other, told, _excluded("positions", one)
            if part == "velocity":
                other = _swapped(aids, aid, replace(aid, use_velocity=False))
                return other, told, _excluded("velocities", one)
        if not any(isinstance(a, Gnss) for a in aids if a is not aid):
            factor = max(one.factor, 2.0)
            weaker = replace(
                aid,
                position_sd_factor=factor * aid.position_sd_factor,
                velocity_sd_factor=factor * aid.velocity_sd_factor,
            )
            change = Finding(
                "navigation.rerun-with-larger-sd", severity="note", aid=one.aid, factor=factor
            )
            return _swapped(aids, aid, weaker), told, change
    if isinstance(aid, TabulatedMeasurement):
        told.pop(one.aid, None)
    return tuple(a for a in aids if a is not aid), told, _excluded("measurement", one)


def _excluded(what: str, one: Inconsistency, **values: float) -> Finding:
    code = f"navigation.rerun-without-{what}"
    return Finding(code, severity="note", data={"aid": one.aid, **values})


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
