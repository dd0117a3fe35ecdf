"""References for the attitude besides a truth: reference points, rests, positions, second log."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from strapdown import rotation
from strapdown.attitude_algorithms import Cost
from strapdown.attitude_algorithms.algorithm import AttitudeRun
from strapdown.attitude_comparison.options import AttitudeSpec
from strapdown.attitude_comparison.source import AttitudeSource
from strapdown.bundle import input_files
from strapdown.config.sources import ScenarioSpec
from strapdown.constants import TWO_SIDED_95
from strapdown.errors import ConfigError, DivergenceError, Finding, add_note, add_warning
from strapdown.evaluation.differences import error_angles, known_at
from strapdown.evaluation.reference_points import (
    SamePose,
    Score,
    reference_errors,
    references_from_words,
    same_pose_candidates,
    score_references,
    tilt_references,
)
from strapdown.formats import read_log
from strapdown.sensors.rest import RestStretch, find_rests
from strapdown.tables import ACCEL, GYRO, MAG, QUATERNION, THETA, attitude_table, find_gaps
from strapdown.tables.checks import Array, index_of

if TYPE_CHECKING:
    from strapdown.attitude_comparison.sweep import Grounds
    from strapdown.evaluation.position_references import PlaceReference
    from strapdown.evaluation.second_log import SecondLog
    from strapdown.orientation_filters import OrientationEstimator


#: The word that makes every rest a reference point.
RESTS = "rests"


@dataclass(frozen=True)
class FilterErrors:
    """Errors of an aided filter against the truth, deg.

    Attributes
    ----------
    rms_deg, final_deg : float
        Of the whole rotation.
    inclination_deg, heading_deg : float
        Root mean square of its parts: about a level axis, and about the vertical.
    most_inclination_deg : float
        Largest inclination.
    drift_deg_per_min : float
        Root mean square change of the heading error over a minute, or of the longest window that
        half of the record holds, per minute.
    covered : tuple of float or None
        Share of the samples within the stated 95 % bounds: of inclination, by its two axes, and of
        heading. None if the filter states none.
    """

    rms_deg: float
    final_deg: float
    inclination_deg: float
    heading_deg: float
    most_inclination_deg: float
    drift_deg_per_min: float
    covered: tuple[float, float] | None


@dataclass(frozen=True)
class PeerRun:
    """A filter over the same log, of another library or one of `orientation_filters`.

    Attributes
    ----------
    peer : str
        Name and version; the name of a filter of the project.
    aiding : str
        ``gyro``, ``gyro+accel`` or ``gyro+accel+mag``; compare only equal aidings.
    attitude : DataFrame
        Attitude table.
    scores : tuple of Score
    errors : FilterErrors or None
        Of an aided filter, if there is a truth.
    cost : Cost or None
        Of a filter of the project.
    single_deg : float or None
        Largest difference between its results in single and in double precision.
    ran : OrientationEstimator or None
        Filter of the project with all options, those that the log gave included.
    lowest_hz, lowest_level_hz : float or None
        Lowest rate of averaged samples at which its largest error is within the tolerance, as at
        every higher rate; and that of roll and pitch alone. None if there is none.
    """

    peer: str
    aiding: str
    attitude: pd.DataFrame = field(repr=False)
    scores: tuple[Score, ...]
    errors: FilterErrors | None = None
    cost: Cost | None = None
    single_deg: float | None = None
    ran: OrientationEstimator | None = field(default=None, repr=False)
    lowest_hz: float | None = None
    lowest_level_hz: float | None = None


def gather_references(
    spec: AttitudeSpec,
    source: AttitudeSource,
    span: tuple[float, float],
    rests: tuple[RestStretch, ...],
    levelled: bool,
    findings: list[Finding],
) -> tuple[pd.DataFrame, tuple[PlaceReference, ...], tuple[SamePose, ...]]:
    """Reference points of attitude and position, and poses that are offered as such.

    `span` is the meaning of the words start and end, s. A rest at which the run is leveled is
    not a reference; where it is the only one, `findings` says that no error can be stated.
    """
    words = list(spec.references)
    whole = spec.from_s is spec.to_s is spec.duration_s is None
    if isinstance(spec.source, ScenarioSpec) and not words and whole:
        from strapdown.systems.trajectory_source import scenario_of

        words = list(scenario_of(spec.source).references)
    asked = [w for w in words if w.strip().lower() == RESTS]
    words = [w for w in words if w.strip().lower() != RESTS]
    positions: tuple[PlaceReference, ...] = ()
    if words:
        from strapdown.evaluation.position_references import is_place, parse_place

        positions = tuple(parse_place(w, *span) for w in words if is_place(w))
        words = [w for w in words if not is_place(w)]
    points = references_from_words(words, *span)
    usable = [r for r in rests if r.accel_mean is not None and r.start >= span[0]]
    if asked:
        asks = "--reference rests"
        if not usable:
            raise ConfigError("attitude.no-rest", file=source.name, quantity=asks)
        tilts = tilt_references(usable, levelled_from=usable[0] if levelled else None)
        if tilts.empty:
            rest = {"start": usable[0].start, "end": usable[0].end}
            add_warning(findings, "attitude.one-rest", file=source.name, quantity=asks, data=rest)
        points = pd.concat([points, tilts], ignore_index=True) if len(points) else tilts
    return points, positions, same_pose_candidates(usable) if points.empty else ()


def read_second(
    spec: AttitudeSpec, source: AttitudeSource
) -> tuple[AttitudeSource, SecondLog | None]:
    """Cut the source to the part that the log of a second sensor covers, and align the two."""
    if spec.reference_log_path is None:
        return source, None
    if spec.truth_path is not None:
        raise ConfigError("attitude.attitude-truth-given-too", quantity="--reference-log")
    from strapdown.evaluation.second_log import (
        align_second_log,
        second_clock,
        truth_from_second_log,
    )

    recording = read_log(spec.reference_log_path)
    aligned = align_second_log(source.imu, recording.imu)
    inside = (source.imu.index >= aligned.start) & (source.imu.index <= aligned.end)
    findings = tuple(f.replace(file=f.file or recording.name) for f in recording.findings)
    inputs = input_files("reference-log", spec.reference_log_path, recording.files)
    imu = source.imu[inside]
    truth = scored = None
    if recording.truth is not None and recording.scored is not None:
        # Its truth includes the initial attitude, which gyros alone do not observe.
        truth = truth_from_second_log(aligned, imu, recording.imu, attitude=recording.truth)
        there = second_clock(aligned, truth.index)
        scored = known_at(recording.truth, recording.scored, there).counts
    return replace(
        source,
        imu=imu,
        truth=truth,
        scored=scored,
        # A second sensor is not an exact truth.
        clean=None,
        findings=source.findings + findings,
        inputs=(*source.inputs, inputs),
        second=recording,
    ), aligned


def truth_of_second(
    source: AttitudeSource, aligned: SecondLog, imu: pd.DataFrame, q_nb: Array
) -> AttitudeSource:
    """Use the attitude by the second log's rates as the truth."""
    from strapdown.evaluation.second_log import truth_from_second_log

    assert source.second is not None
    second = source.second
    rests = find_rests(second.imu)
    bias = rests[0].gyro_mean if rests else (0.0, 0.0, 0.0)
    findings = source.findings
    if not rests:
        code = "attitude.no-rest-found-bias-truth"
        findings += (Finding(code, file=second.name, quantity="gyro bias"),)
    truth = truth_from_second_log(aligned, imu, second.imu, gyro_bias=bias, q_start=q_nb)
    return replace(source, truth=truth, scored=np.ones(len(truth), dtype=bool), findings=findings)


# Within this of ±90° pitch the kinematics of Euler angles amplify every error tenfold.
NEAR_POLE = 5.7  # deg: 1/cos = 10
# A larger rotation within a step hides the motion within it.
LARGE_STEP = 0.5  # rad


def passed_pole(run: AttitudeRun) -> bool:
    """Whether a run came too near to ±90° pitch for reliable angles."""
    return run.diagnostics.get("closest_to_pole_deg", 90.0) < NEAR_POLE


def truth_score(run: AttitudeRun, source: AttitudeSource) -> list[Score]:
    """Compare a run with the truth, if there is one."""
    if source.truth is None or source.scored is None:
        return []
    errors = error_angles(run.attitude, source.truth[source.scored])
    if errors.empty:
        return []
    return [
        Score(
            algorithm=run.algorithm,
            against="truth",
            time=float(errors.index[-1]),
            error_deg=float(errors.iloc[-1]),
            rms_deg=float(np.sqrt((errors**2).mean())),
            max_deg=float(errors.max()),
        )
    ]


def judge(
    runs: Sequence[AttitudeRun],
    imu: pd.DataFrame,
    increments: pd.DataFrame,
    scores: Sequence[Score],
    source: AttitudeSource,
) -> list[Finding]:
    """Report unreliable parts of the runs, their steps, stated turns and the truth."""
    findings = []
    for run in runs:
        if passed_pole(run):
            apart = run.diagnostics["closest_to_pole_deg"]
            code = "attitude.near-vertical-pitch" if apart else "attitude.through-vertical-pitch"
            time = run.diagnostics["closest_to_pole_time_s"]
            findings.append(Finding(code, quantity=run.algorithm, apart_deg=apart, time=time))
    turn = np.sqrt((increments[THETA].to_numpy() ** 2).sum(axis=1))
    # Gaps are reported by the reader.
    turn[[gap.sample - 1 for gap in find_gaps(runs[0].attitude.index)]] = 0.0
    largest = int(turn.argmax())
    if turn[largest] > LARGE_STEP:
        add_warning(
            findings,
            "attitude.single-step-turns-rate-says",
            quantity="gyro",
            turn_deg=np.degrees(turn[largest]),
            index=increments.index[largest],
        )
    wrong = {}
    for score in scores:
        if score.turned_deg is None or score.expected_deg is None:
            continue
        if abs((score.turned_deg - score.expected_deg) / 360.0) > 0.5:
            wrong[score.against] = Finding(
                "attitude.says-turns-gyro-turned",
                quantity="reference",
                against=score.against,
                expected_deg=score.expected_deg / 360.0,
                turned_deg=score.turned_deg / 360.0,
            )
    findings += wrong.values()
    if source.truth is not None and source.scored is not None and source.scored.any():
        counted = source.truth.index[source.scored]
        covered = float(counted[-1] - counted[0])
        span = float(imu.index[-1]) - float(imu.index[0])
        if covered < 0.5 * span:
            add_note(
                findings,
                "attitude.covers-rest-nothing-known",
                file=source.name,
                quantity="truth",
                covered=covered,
                span=span,
            )
    return findings


# Filters on the log of the bench.


#: A filter that would take longer is skipped with a finding.
LONGEST = 60.0  # s
#: A disturbed field is reported from this share of the time on.
DISTURBED = 0.01


def run_beside(
    names: Sequence[str],
    source: AttitudeSource,
    imu: pd.DataFrame,
    q_nb: Array,
    references: pd.DataFrame,
    findings: list[Finding],
    north: tuple[float, float] = (0.0, 0.0),
) -> tuple[PeerRun, ...]:
    """Run the filters of the project and those of other libraries, and compare with references.

    `north`: declination, and by how much headings by the field are less certain than usual, deg.

    The filters of the project run whenever there is an accelerometer. Without a magnetometer the
    heading is not observed: it is rotated to the truth's first one.
    """
    out = list(_own_filters(source, imu, references, findings, north))
    if not names:
        return tuple(out)
    from strapdown.peers import PEERS, run_peers

    wanted = list(PEERS) if [n.lower() for n in names] == ["all"] else list(names)
    runs, found = run_peers(wanted, imu, q_nb, longest_s=LONGEST)
    findings += found
    for label, aiding, attitude in runs:
        if aiding == "gyro+accel":
            q = _with_first_heading(attitude[QUATERNION].to_numpy(), attitude.index, source)
            attitude = attitude_table(attitude.index.to_numpy(), q)
        elif aiding == "gyro+accel+mag" and north[0]:
            turn = rotation.quaternion_from_euler([0.0, 0.0, north[0]])
            q = rotation.compose(turn, attitude[QUATERNION].to_numpy(dtype=np.float64))
            attitude = attitude_table(attitude.index.to_numpy(), q)
        scores, errors = _judged(label, attitude, source, imu, references)
        out.append(PeerRun(label, aiding, attitude, scores, None if aiding == "gyro" else errors))
    return tuple(out)


def _own_filters(
    source: AttitudeSource,
    imu: pd.DataFrame,
    references: pd.DataFrame,
    findings: list[Finding],
    north: tuple[float, float],
) -> Iterator[PeerRun]:
    """Run the filters of the project, with their cost.

    Like the other libraries they take each row as the mean over its step.
    """
    from strapdown.orientation_filters import FILTERS, run_for_motion
    from strapdown.orientation_filters.cost import count_filter_cost, single_precision_error_deg

    if not set(ACCEL) <= set(imu.columns):
        return
    step = float(np.median(np.diff(imu.index.to_numpy())))
    for aiding, columns in (("gyro+accel", GYRO + ACCEL), ("gyro+accel+mag", GYRO + ACCEL + MAG)):
        if not set(columns) <= set(imu.columns):
            continue
        part = imu[columns]
        for cls in FILTERS.values():
            chosen = cls()
            label = chosen.label
            if aiding == "gyro+accel+mag":
                chosen = chosen.with_heading(*north)
            asked, (chosen, run) = chosen, run_for_motion(chosen, part, sampling="mean")
            if chosen != asked:
                label = chosen.label
                moved = motion_finding(chosen, imu)
                findings += [] if moved in findings else [moved]
            q = run.q_nb
            if aiding == "gyro+accel":
                q = _with_first_heading(q, imu.index, source)
            elif run.disturbed >= DISTURBED:
                add_note(
                    findings,
                    "attitude.field-disturbed",
                    file=source.name,
                    quantity="mag",
                    share=run.disturbed,
                )
            attitude = attitude_table(imu.index.to_numpy(), q)
            scores, errors = _judged(label, attitude, source, imu, references, run.covariance)
            yield PeerRun(
                f"strapdown {label}",
                aiding,
                attitude,
                scores,
                errors,
                count_filter_cost(chosen, step, aiding == "gyro+accel+mag"),
                single_precision_error_deg(chosen, part, "mean", run.q_nb),
                chosen,
            )


def with_lowest_rates(
    run: PeerRun, imu: pd.DataFrame, grounds: Grounds, factors: Sequence[int], tolerance: float
) -> PeerRun:
    """Find down to which rate a filter of the project suffices, by the rule of the algorithms.

    `imu`: the log's samples. `factors`: ascending divisors of its rate. A lower rate is that of a
    sensor which averages: a row is the mean over its step.
    """
    if run.ran is None or not run.scores:
        return run
    from strapdown.orientation_filters import run_filter
    from strapdown.peers import align_heading

    columns = GYRO + ACCEL + (MAG if run.aiding == "gyro+accel+mag" else [])
    time, values = index_of(imu), imu[columns].to_numpy(dtype=np.float64)
    # Missing samples have no weight.
    weight = np.diff(time)[:, None] * np.isfinite(values[1:])
    weighted = np.where(weight > 0.0, values[1:], 0.0) * weight
    rates: dict[str, float | None] = {"lowest_hz": None, "lowest_level_hz": None}
    passing = set(rates)
    for factor in factors:
        samples = grounds.clock.every(factor)
        sums, weights = (np.add.reduceat(x, samples[:-1], axis=0) for x in (weighted, weight))
        with np.errstate(invalid="ignore"):
            rows = np.vstack([values[:1], sums / weights])
        part = pd.DataFrame(rows, index=imu.index[samples], columns=columns)
        try:
            q = run_filter(run.ran, part, sampling="mean").q_nb
        except DivergenceError:
            break
        tilt = np.inf
        if grounds.truth is None:
            attitude = pd.DataFrame(q, index=part.index, columns=QUATERNION)
            whole = max(reference_errors(attitude, grounds.references))
        else:
            known = grounds.truth.at(samples)
            if not known.counts.any():
                break
            if run.aiding == "gyro+accel":
                first = int(known.counts.argmax())
                q = align_heading(q, known.q_nb[first], first)
            tilts, _, wholes = _parts(q[known.counts], known.q_nb[known.counts])
            tilt, whole = float(tilts.max()), float(wholes.max())
        for name, error in zip(rates, (whole, tilt), strict=True):
            # A lower rate that passes where a higher one does not is chance.
            if error > tolerance:
                passing.discard(name)
            if name in passing:
                rates[name] = grounds.clock.rate_hz / factor
        if not passing:
            break
    return replace(run, lowest_hz=rates["lowest_hz"], lowest_level_hz=rates["lowest_level_hz"])


def motion_finding(chosen: OrientationEstimator, imu: pd.DataFrame) -> Finding:
    """Say which options a filter took from the motion of a record."""
    return Finding(
        "attitude.velocity-of-motion",
        file=imu.attrs.get("source"),
        quantity=chosen.name,
        severity="note",
        velocity=getattr(chosen, "velocity", float("nan")),
    )


def _with_first_heading(q: Array, stamps: pd.Index, source: AttitudeSource) -> Array:
    """Attitudes rotated about the vertical to the first known one."""
    if source.truth is None or source.scored is None:
        return q
    known = source.truth[source.scored]
    known = known[(known.index >= stamps[0]) & (known.index <= stamps[-1])]
    if known.empty:
        return q
    from strapdown.peers import align_heading

    first = known[QUATERNION].to_numpy(dtype=np.float64)[0]
    return align_heading(q, first, int(np.searchsorted(stamps.to_numpy(), float(known.index[0]))))


def _judged(
    label: str,
    attitude: pd.DataFrame,
    source: AttitudeSource,
    imu: pd.DataFrame,
    references: pd.DataFrame,
    covariance: Array | None = None,
) -> tuple[tuple[Score, ...], FilterErrors | None]:
    """Scores against the references, and errors by parts if there is a truth."""
    run = AttitudeRun(label, label, "", attitude, {})
    scores = (*truth_score(run, source), *score_references(run, references, imu))
    if source.truth is None or source.scored is None:
        return scores, None
    known = known_at(source.truth, source.scored, attitude.index.to_numpy(dtype=np.float64))
    if not known.counts.any():
        return scores, None
    counts = known.counts
    q = attitude[QUATERNION].to_numpy(dtype=np.float64)[counts]
    tilt, error, whole = _parts(q, known.q_nb[counts])
    heading = np.degrees(np.unwrap(2.0 * np.arctan2(error[:, 3], error[:, 0]), period=2.0 * np.pi))
    heading -= 360.0 * np.round(heading[0] / 360.0)
    covered = None
    if covariance is not None:
        sd = np.sqrt(np.diagonal(covariance[counts], axis1=1, axis2=2))
        inside = np.abs(2.0 * error[:, 1:]) <= TWO_SIDED_95 * sd
        covered = float(inside[:, :2].mean()), float(inside[:, 2].mean())
    return scores, FilterErrors(
        rms_deg=float(np.sqrt(np.mean(whole**2))),
        final_deg=float(whole[-1]),
        inclination_deg=float(np.sqrt(np.mean(tilt**2))),
        heading_deg=float(np.sqrt(np.mean(((heading + 180.0) % 360.0 - 180.0) ** 2))),
        most_inclination_deg=float(tilt.max()),
        drift_deg_per_min=_drift(index_of(attitude)[counts], heading),
        covered=covered,
    )


def _parts(q: Array, truth: Array) -> tuple[Array, Array, Array]:
    """Error about level axes, deg, as a quaternion in north-east-down, and as a whole, deg."""
    error = rotation.compose(q, rotation.conjugate(truth))
    level = np.hypot(error[:, 0], error[:, 3])
    tilt = 2.0 * np.degrees(np.arctan2(np.hypot(error[:, 1], error[:, 2]), level))
    whole = np.degrees(2.0 * np.arctan2(np.linalg.norm(error[:, 1:], axis=1), np.abs(error[:, 0])))
    return tilt, error, whole


def _drift(time: Array, heading: Array) -> float:
    """Root mean square change of a heading error over a minute, deg, or as `FilterErrors`."""
    window = min(60.0, 0.5 * float(time[-1] - time[0]))
    later = np.searchsorted(time, time + window)
    first = np.flatnonzero(later < len(time))
    if window <= 0.0 or not first.size:
        return float("nan")
    change = heading[later[first]] - heading[first]
    return float(np.sqrt(np.mean(change**2)) * 60.0 / window)
