"""Navigation run from its specification to all results of a report."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import takewhile
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.alignment.alignment import Alignment, Site
from strapdown.alignment.fine import FineResult
from strapdown.alignment.gnss_course import GnssCourse
from strapdown.bundle import InputFiles
from strapdown.config.alignment import sensors_of
from strapdown.config.navigation import (
    CoarseModeSpec,
    FineModeSpec,
    NavigationSpec,
    StartTable,
    WithholdTable,
    make_aids,
    make_filter,
)
from strapdown.constants import Triple
from strapdown.ellipsoids import Ellipsoid, find_ellipsoid
from strapdown.errors import DataError, DivergenceError, Finding, add_note
from strapdown.estimation.robust import DOUBT
from strapdown.evaluation.trajectory_differences import (
    DifferenceSummary,
    summarise_differences,
    trajectory_differences,
)
from strapdown.nav_state import NavState
from strapdown.navigation.blame import CONTINUED, blame, by_stamp, contradicted
from strapdown.navigation.filter_options import DAMPINGS
from strapdown.navigation.integrity import (
    GAIN_EACH,
    LEAST_GAIN,
    IntegrityReport,
    assess_integrity,
    likelihood_gain,
    rejected_percent,
)
from strapdown.navigation.measurements.gnss import LARGEST_OFFSET, Gnss
from strapdown.navigation.measurements.measurement import Measurement
from strapdown.navigation.modes import (
    CoarseMode,
    Command,
    FineMode,
    KnownStart,
    Mode,
    Navigation,
    Until,
)
from strapdown.navigation.navigator import Navigator, with_aids, with_states
from strapdown.navigation.pipeline import NavigationPipeline, with_aid
from strapdown.navigation.preprocessing import GapPolicy, ImuPreprocessor, ends_of
from strapdown.navigation.record import (
    NavigationRecord,
    Span,
    standard_deviations,
)
from strapdown.navigation.recorder import Recorder
from strapdown.navigation.recovery import (
    displaced_stretches,
    fix_steps,
    longest,
    stated_floats,
    wrong_stretches,
)
from strapdown.navigation.replay import PipelineRun, relinearized, run_batch, starts_far
from strapdown.navigation.smoother import RauchTungStriebel
from strapdown.navigation.truth_comparison import SmootherConsistency, smoother_consistency
from strapdown.progress import Progress, silent
from strapdown.rotation import dcm_from_euler
from strapdown.sensors.catalogue import load_sensor
from strapdown.sensors.uncertainty import ImuUncertainty
from strapdown.systems.inputs import Memory, SavedRun, configuration_file
from strapdown.systems.named_sensor import GRADES, unlike_sensor
from strapdown.systems.navigation_checks import channel_findings, look_through, saturated_findings
from strapdown.systems.navigation_proposal import quiet_at_start
from strapdown.systems.navigation_source import (
    UNSTATED,
    NavigationSource,
    in_file,
    read_navigation_source,
    said_of_file,
)
from strapdown.systems.one_thread import one_thread
from strapdown.tables import EULER, GEODETIC, GNSS, POSITION_SD, VELOCITY, usable
from strapdown.tables.checks import index_of, source_of, values_of
from strapdown.tables.on_disk import tidy

if TYPE_CHECKING:
    from strapdown.evaluation.control_points import ControlPointScore
    from strapdown.navigation.outage_test import Withheld
    from strapdown.report.chart_svg import ChartFigure

#: Runs a pipeline over samples and tables, with a recorder and a progress callback.
Drive = Callable[..., PipelineRun]

#: A shorter part without navigation at the start, s, is not reported.
LEAST_LOST = 1.0
#: Shares of a whole run at which its pipeline begins and ends.
BEGUN, ENDED = 0.15, 0.8
#: Grades that may explain a contradiction: coarser than the sensor by this factor of its gyro bias.
COARSE, COARSER = GRADES[1:], 3.0
#: How often a run is repeated at most that is contradicted for longer than receivers are at fault.
RECOVERIES = 4
#: By how many of its standard deviations an estimated time offset over `CONTINUED` differs from
#: zero, with which a run is repeated.
SURELY = 3.0
#: An offset, s, by which two explanations of a record differ at least.
SETTLED = 0.01
#: How often at most: by a second, states of sensors take a part of it, and each run finds some of
#: the rest, of which the part found is taken to be at least the second.
STEPS_OF_OFFSET, LEAST_PART = 10, 0.25
#: Other offsets that a run is begun with, in standard deviations of what is assumed. Of a body that
#: swings, as by its steps, they are so far apart, s, a part of its period, in a record that is
#: shorter than the last, s: each is a run of its own.
STARTS, FINER, BRIEFLY = (-2.0, -1.0, 1.0, 2.0), 0.1, 900.0
#: A body swings where its acceleration about the mean over a second exceeds this, m/s², and that of
#: the mean. Of fewer rows a second a trajectory does not show it.
SWINGS, ROWS = 1.0, 5
#: A heading that was known worse than this, deg, may be another than a linear filter has found. Of
#: the errors of the gyros about the vertical that are tried: the step and the standard deviation
#: about each, rad/s; how many of the deviations of the unit to both sides.
OPEN, DRIFT, ABOUT_DRIFT, DRIFTS = 20.0, math.radians(1.0), math.radians(0.7), 2.5
#: They are tried up to so long after the motion has shown the heading, s.
EARLY = 200.0
#: A run is repeated with the offset that it found, known to so many of its standard deviations,
#: where that is at most this part of what was assumed, and where the assumed one moves the vehicle,
#: at the speed that is exceeded for a tenth of the time, by so many standard deviations of fixes.
ASSUMED, BETTER, MOSTLY, DISPLACED = 3.0, 0.5, 0.9, 3.0
#: Movement of smoothed states by the last pass, in standard deviations, that their bounds do not
#: cover: a tenth more than the bound of 95 %, if the error is independent of it.
UNSETTLED = 0.5
#: Length of a chunk of the record, and interval of progress reports, s.
CHUNK = 20.0
_AT_ONCE = partial(run_batch, chunk=CHUNK)
#: Least interval between the trajectory rows compared with the truth, s: errors change slowly
#: relative to the accuracy of the truth.
APART = 0.1


@one_thread()
def run_navigation(
    spec: NavigationSpec,
    file: Path | None = None,
    progress: Progress = silent,
    drive: Drive = _AT_ONCE,
) -> NavigationRun:
    """Read a record and its measurements, align, and navigate.

    Parameters
    ----------
    spec : NavigationSpec
        With absolute paths.
    file : Path, optional
        Configuration file, listed as an input.
    progress : callable, optional
        Called with a stage and the share that is done.
    drive : callable, optional
        Runs the pipeline, called as `run_batch`: paced, or with earlier results. The numbers must
        equal those of `run_batch`.

    Raises
    ------
    ConfigError
        A file does not exist, or an option is invalid.
    DataError
        A record cannot be read or is not sufficient for navigation; the message names file, row,
        quantity and remedy.
    DivergenceError
        The state left the range of the mechanization.
    """
    progress("reading", 0.02)
    if spec.map is not None:
        from strapdown.formats.map_tiles import open_map

        # Refused before the run, not after it.
        with open_map(spec.map.path):
            pass
    source = read_navigation_source(spec)
    tidy()
    progress("looking through", 0.1)
    sensors = sensors_of(spec)
    tables = (source.imu, *source.tables.values())
    with said_of_file(*tables):
        looked = look_through(spec, source.imu, source.tables)
        tidy()
        # Simulated errors are as specified; but the motion may exceed the range of the sensors.
        if spec.log is None:
            channels = saturated_findings(source.imu, sensors)
        else:
            channels = channel_findings(source.imu, sensors, spec.start, source.tables)
            channels = (*channels, *_unlike_named(spec, sensors, source))
    looked, channels = in_file(looked, *tables), in_file(channels, *tables)
    tidy()
    chain = _switched_on(make_chain(spec, sensors), float(source.imu.index[0]))
    recorder: Recorder = spec.recorder.make(ellipsoid=spec.ellipsoid)

    def show_mode(mode: str, share: float) -> None:
        progress(mode, BEGUN + (ENDED - BEGUN) * share)

    def again(
        other: NavigationPipeline, other_source: NavigationSource | None = None
    ) -> PipelineRun:
        used = other_source or source
        return drive(other, used.imu, used.tables, recorder, show_mode)

    progress("aligning" if spec.start is None else "navigating", BEGUN)
    with said_of_file(*tables):
        run = again(chain)
        chain, run, by_drift = _with_likeliest_drift(chain, run, source, again)
        asked = chain
        chain, run, source, by_offset, by_jumps = _explained(chain, run, source, again)
        if by_jumps:
            asked = _with_jumps_of(chain, asked)
        begun_with = chain
        if not by_offset and run.smoothed is None:
            chain, by_offset = _with_known_offsets(chain, run.record, source.tables)
            if by_offset:
                run = again(chain)
        chain, run, by_recovery = _recovered(chain, run, source.tables, again)
        begun_with = replace(
            begun_with, navigator=replace(begun_with.navigator, wrong=chain.navigator.wrong)
        )
        far = starts_far(run.record, sensors)
        forward = run.record
        # Of one linearization: further passes are about the smoothed states, the filter is not.
        agreement = None if far else _agreement(run, spec)
        if run.smoothed is not None or (far and chain.navigator.damping.feeds_back):

            def show_pass(mode: str, share: float) -> None:
                progress(f"smoothing: {mode}", ENDED)

            run = _about_smoothed(chain, source, recorder, run, far, show_pass)
        agreement = agreement or _agreement(run, spec)
    late = 0.0 if spec.log is None else _late(source)
    if late > 0.0:
        smoothed = None if run.smoothed is None else with_late_samples(run.smoothed, late)
        run = replace(run, record=with_late_samples(run.record, late), smoothed=smoothed)
    beside = None
    if spec.damping.beside is not None:
        with said_of_file(*tables):
            beside = _AT_ONCE(
                _with_correction(chain, spec.damping.beside),
                source.imu,
                source.tables,
                recorder,
                lambda mode, share: progress(f"{spec.damping.beside}: {mode}", ENDED),
            ).record
    tidy()
    progress("comparing", ENDED)
    best = run.smoothed or run.record
    differences, errors = _against_truth(best.trajectory, source, spec)
    forward_differences = None
    if run.smoothed is not None:
        forward_differences, _ = _against_truth(run.record.trajectory, source, spec)
    points = None
    if source.points is not None:
        from strapdown.evaluation.control_points import score_control_points

        points = score_control_points(
            best.trajectory, source.points, find_ellipsoid(spec.ellipsoid)
        )

    def after(stage: str, share: float) -> None:
        progress(stage, ENDED + 0.02 * share)

    withheld: tuple[Withheld, ...] = ()
    if spec.withhold is not None:
        from strapdown.navigation.outage_test import score_withholding

        begun, end = _begun(run.record), float(source.imu.index[-1])
        aid, ellipsoid = withheld_aid(spec), find_ellipsoid(spec.ellipsoid)
        used = run.record.innovations.get(f"{aid}.position", pd.DataFrame())
        lost = (used.filter(like="weight ") <= 0.0).any(axis=1)
        withheld = score_withholding(
            begun_with,  # withheld fixes may not tell of the offset, either
            source.imu,
            source.tables,
            aid,
            _test_outages(spec.withhold, begun, end, source.tables.get(aid)),
            begun,
            after,
            rejected=index_of(used)[lost],
            truth=None if source.truth is None else (source.truth, ellipsoid),
        )
    tidy()
    trust = assess_integrity(
        chain,
        make_filter(spec, sensors),
        source.imu,
        source.tables,
        run,
        (spec.trust.heading_limit_deg, spec.trust.heading_red_deg),
        spec.trust.repeat,
        after,
    )
    blamed: tuple[Finding, ...] = ()
    if trust.inconsistencies and spec.trust.repeat:
        coarser = _coarser(spec, sensors, float(source.imu.index[0]))
        with said_of_file(*tables):
            blamed = blame(
                asked,
                chain,
                coarser,
                spec.sensors.sensor,
                source.imu,
                source.tables,
                forward,
                after,
            )
        by_offset = _not_of_clock(by_offset, blamed)
    tidy()
    aligned = {one.mode: one for one in run.aligned}
    coarse, fine = aligned.get("coarse"), aligned.get("fine")
    findings = [
        *blamed,
        *source.findings,
        *channels,
        *looked,
        *(f for one in run.aligned for f in one.alignment.findings),
        *(() if fine is None or fine.fine is None else fine.fine.findings),
        *_lost_start(chain, source.imu, best.trajectory),
        *_unsettled(run),
        *in_file((*by_drift, *by_offset, *by_jumps, *by_recovery), *tables),
    ]
    return NavigationRun(
        spec=spec,
        source=source,
        ellipsoid=find_ellipsoid(spec.ellipsoid),
        sensors=sensors,
        coarse=None if coarse is None else coarse.alignment,
        fine=None if fine is None else fine.fine,
        record=best,
        forward=None if run.smoothed is None else run.record,
        differences=differences,
        errors=errors,
        forward_differences=forward_differences,
        agreement=agreement,
        points=points,
        beside=beside,
        withheld=withheld,
        trust=trust,
        inputs=(*configuration_file(file), *source.inputs),
        findings=tuple(dict.fromkeys(findings)),
    )


def _agreement(run: PipelineRun, spec: NavigationSpec) -> SmootherConsistency | None:
    """Test the filter against the smoother, where there is one."""
    if run.smoothed is None:
        return None
    return smoother_consistency(run.record, run.smoothed, find_ellipsoid(spec.ellipsoid))


def _late(source: NavigationSource) -> float:
    """Standard deviation of the instant that samples are of, about their stamps, s.

    A reading at an instant is that of the filter before it, which keeps what the rate cannot show:
    one of first order that passes up to 0.32 of the rate is late by half a step, as those are that
    consumer units offer for their rates. Whether a row is such a reading, or the mean since the row
    before, is another half, where nothing states it. Means are those of units that correct it.
    """
    if source.imu.attrs["sampling"] == "mean":
        return 0.0
    half = 0.5 * float(np.median(np.diff(index_of(source.imu))))
    unstated = any(finding.code == UNSTATED for finding in source.findings)
    return half * math.sqrt(2.0) if unstated else half


def with_late_samples(record: NavigationRecord, late: float) -> NavigationRecord:
    """Return a record whose states may be those of another instant than their stamps.

    Fixes do not show it: an offset of their clock is that to the motion that the samples show, and
    velocities show it only as far as they follow the acceleration, a walk's steps not at all. It
    adds to position, velocity and attitude as an error of the size of the velocity, acceleration
    and rate over that time.

    Parameters
    ----------
    late : float, s
        Standard deviation of the instant.
    """
    time = index_of(record.trajectory)
    if len(time) < 2:
        return record
    steps = np.diff(time)
    velocity, euler = (values_of(record.trajectory, names) for names in (VELOCITY, EULER))
    rates = np.hstack([np.diff(velocity, axis=0), _turns(np.radians(euler))]) / steps[:, None]
    # Mean squares over a second: the bound is one of its size, not of its phase.
    sums = np.concatenate([np.zeros((1, 6)), np.cumsum(np.square(rates) * steps[:, None], axis=0)])
    marks = index_of(record.sd)
    begin, end = (np.clip(marks + side, time[0], time[-1]) for side in (-0.5, 0.5))
    length = np.maximum(end - begin, 1e-9)
    moved = np.column_stack([np.interp(marks, time, velocity[:, k]) for k in range(3)])
    covariance = np.array(record.covariance)
    covariance[:, :3, :3] += late**2 * moved[:, :, None] * moved[:, None, :]
    for k in range(6):
        grown = np.interp(end, time, sums[:, k]) - np.interp(begin, time, sums[:, k])
        covariance[:, 3 + k, 3 + k] += late**2 * grown / length
    nearest = np.clip(time.searchsorted(marks), 0, len(time) - 1)
    sd = standard_deviations(marks, covariance, euler[nearest], source_of(record.sd))
    return replace(record, sd=sd, covariance=covariance)


def _turns(euler: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rotations about north, east, down between rows of roll, pitch, heading, rad, (n - 1, 3)."""
    euler = np.unwrap(euler, axis=0)
    roll, pitch, heading = np.diff(euler, axis=0).T
    _, at_pitch, at = 0.5 * (euler[1:] + euler[:-1]).T
    level = roll * np.cos(at_pitch)
    return np.column_stack(
        [
            level * np.cos(at) - pitch * np.sin(at),
            level * np.sin(at) + pitch * np.cos(at),
            heading - roll * np.sin(at_pitch),
        ]
    )


def _with_likeliest_drift(
    chain: NavigationPipeline,
    run: PipelineRun,
    source: NavigationSource,
    drive: Callable[[NavigationPipeline, NavigationSource], PipelineRun],
) -> tuple[NavigationPipeline, PipelineRun, tuple[Finding, ...]]:
    """Repeat a run that lost its heading with the likeliest error of the gyros about the vertical.

    Where the heading drifts away before the motion shows it, several are solutions of a linear
    filter, each with an error of the gyros that belongs to it.
    """
    record, bias = run.record, [f"gyro_bias_{axis}" for axis in "xyz"]
    is_lost = record.sd["heading"].to_numpy() > OPEN
    known = any(one.alignment.gyro_bias is not None for one in run.aligned)
    if not is_lost.any() or known or not set(bias) <= set(record.sensors):
        return chain, run, ()
    after = index_of(record.sd)[int(is_lost.argmax()) :][~is_lost[int(is_lost.argmax()) :]]
    if not len(after):  # its bound says that it is lost
        return chain, run, ()
    down = dcm_from_euler(np.radians(values_of(record.trajectory, EULER)[0]))[2]
    found, unsure = (values_of(of, bias)[0] for of in (record.sensors, record.sensors_sd))
    count = int(DRIFTS * float(np.linalg.norm(down * unsure)) / DRIFT)
    if not count:
        return chain, run, ()
    bare = replace(chain, navigator=replace(chain.navigator, smoother=None))
    begin = source
    if float(source.imu.index[-1]) > after[0] + EARLY:
        early = source.imu[source.imu.index <= after[0] + EARLY]
        early.attrs = dict(source.imu.attrs)
        begin = replace(source, imu=early)
        try:
            record = drive(bare, begin).record
        except (DataError, DivergenceError):  # an alignment by later fixes
            return chain, run, ()
    runs = [(0.0, bare, record)]
    for step in range(-count, count + 1):
        other = replace(bare, drift=(float(down @ found) + step * DRIFT, ABOUT_DRIFT))
        try:
            again = drive(other, begin).record
        except (DataError, DivergenceError):
            continue
        runs.append((likelihood_gain(record.innovations, again.innovations)[0], other, again))
    best = max(runs, key=lambda one: one[0])
    if best[0] < LEAST_GAIN:
        best = runs[0]
    findings: tuple[Finding, ...] = ()
    heading, sd = _last_heading(best[2])
    apart = 0.0
    for gain, _, again in runs:
        other_heading, other_sd = _last_heading(again)
        off = abs((other_heading - heading + 180.0) % 360.0 - 180.0)
        if gain > best[0] - LEAST_GAIN and off > max(OPEN, SURELY * math.hypot(sd, other_sd)):
            apart = max(apart, off)
    if apart > 0.0:
        data: dict[str, float] = {"at": float(best[2].trajectory.index[-1]), "apart": apart}
        findings = (Finding("navigation.heading-ambiguous", quantity="heading", data=data),)
    drift = best[1].drift
    if drift is None:
        return chain, run, findings
    code = "navigation.run-again-with-drift"
    data = {"drift": math.degrees(drift[0]), "gain": best[0], "count": 2 * count + 1}
    findings = (Finding(code, severity="note", quantity="gyro", data=data), *findings)
    chain = replace(chain, drift=drift)
    return chain, drive(chain, source), findings


def _last_heading(record: NavigationRecord) -> tuple[float, float]:
    """Heading at the end of a record and its standard deviation, deg."""
    return float(record.trajectory["heading"].iloc[-1]), float(record.sd["heading"].iloc[-1])


def _explained(
    chain: NavigationPipeline,
    run: PipelineRun,
    source: NavigationSource,
    drive: Callable[..., PipelineRun],
) -> tuple[
    NavigationPipeline, PipelineRun, NavigationSource, tuple[Finding, ...], tuple[Finding, ...]
]:
    """Repeat a run with what its fixes show: time offsets, and positions that jump.

    Positions that are displaced while a body begins to move look like an offset, and beside a run
    with that offset they are not found. Where there is one, what jumps beside the first run is the
    other hypothesis: the likelier of both stays.
    """
    first = chain, run, source
    chain, run, by_offset = _with_settled_offsets(chain, run, drive)
    chain, run, source, by_jumps = _with_jumps(chain, run, source, drive)
    if by_jumps:
        chain, run, _ = _with_settled_offsets(chain, run, partial(drive, other_source=source))
        by_offset = _by_offset(first[0], chain, run)
    if by_offset:
        other, again, changed, jumps = _with_jumps(*first, drive)
        if jumps:
            over = partial(drive, other_source=changed)
            other, again, offsets = _with_settled_offsets(other, again, over)
            if _gain(chain, run, other, again) > 0.0:
                return other, again, changed, offsets, jumps
    return chain, run, source, by_offset, by_jumps


def _gain(
    chain: NavigationPipeline, run: PipelineRun, other: NavigationPipeline, again: PipelineRun
) -> float:
    """By how much another run explains the same fixes better, as `likelihood_gain`."""
    own = by_stamp(run.record.innovations, chain)
    return likelihood_gain(own, by_stamp(again.record.innovations, other))[0]


def _with_settled_offsets(
    chain: NavigationPipeline, run: PipelineRun, drive: Callable[[NavigationPipeline], PipelineRun]
) -> tuple[NavigationPipeline, PipelineRun, tuple[Finding, ...]]:
    """Repeat a run with the time offsets that it estimates until these are small.

    The last run stays if they are: the likelihood of one about a wrong offset is that of the biases
    that hide it. Else the likeliest does. One whose offset is that of a wrong clock, or leads to
    where there is no run, as no fix is left within the alignment, is none.
    """
    asked = chain
    best = _with_likeliest_start(chain, run, drive)
    tried, again = best
    before: dict[str, tuple[float, float]] = {}
    for _ in range(STEPS_OF_OFFSET):
        other, left = _with_offsets(tried, again.smoothed or again.record, before)
        if not left:
            best = tried, again
        if not left or _far(asked, other):
            break
        tried = other
        try:
            again = drive(tried)
        except (DataError, DivergenceError):
            break
        if _gain(*best, tried, again) > -LEAST_GAIN:
            best = tried, again
    return (*best, _by_offset(asked, *best))


def _far(asked: NavigationPipeline, chain: NavigationPipeline) -> bool:
    """Whether a time offset is farther from the stated one than clocks that agree at all."""
    return any(
        isinstance(aid, Gnss) and abs(aid.time_offset - own.time_offset) > LARGEST_OFFSET
        for aid, own in zip(chain.navigator.aids, asked.navigator.aids, strict=True)
        if isinstance(own, Gnss)
    )


def _by_offset(
    asked: NavigationPipeline, chain: NavigationPipeline, run: PipelineRun
) -> tuple[Finding, ...]:
    """Report the time offsets with which a run was repeated, and those that did not settle."""
    findings: list[Finding] = []
    record, before = run.smoothed or run.record, dict[str, tuple[float, float]]()
    for aid, own in zip(chain.navigator.aids, asked.navigator.aids, strict=True):
        if isinstance(aid, Gnss) and isinstance(own, Gnss) and aid.time_offset != own.time_offset:
            name = f"{aid.name}.time_offset_t"
            add_note(
                findings,
                "navigation.run-again-with-offset",
                quantity=name,
                offset=aid.time_offset,
                sd=float(record.sensors_sd[name].iloc[-1]),
            )
    _, left = _with_offsets(chain, record, before)
    names = [str(one.quantity) for one in left]
    code = "navigation.offset-not-settled"
    return (*findings, *(Finding(code, quantity=n, left=before[n][1]) for n in names))


def _with_likeliest_start(
    chain: NavigationPipeline, run: PipelineRun, drive: Callable[[NavigationPipeline], PipelineRun]
) -> tuple[NavigationPipeline, PipelineRun]:
    """Begin a run with the likeliest of other time offsets, if its fixes contradict it.

    Steps of a walk, or waves, are alike every half second or few: about a wrong offset the nearest
    estimate is another wrong one. And of a body that swings, the mean acceleration over which a fix
    is compared does not show by how much: tilts and biases explain it, and nothing contradicts.
    """
    best = chain, run
    for aid in chain.navigator.aids:
        if not isinstance(aid, Gnss) or aid.time_offset_sd <= CONTINUED:
            continue
        starts = np.array(STARTS) * aid.time_offset_sd
        finer: tuple[float, ...] = ()
        if _swings(best[1].record):
            starts = np.linspace(starts[0], starts[-1], 2 * math.ceil(starts[-1] / FINER) + 1)
            finer = (-FINER / 2, FINER / 2, -FINER / 4, FINER / 4)
        elif not contradicted(best[1].record):
            break
        about, found = best[0], aid.time_offset
        tried = [aid.time_offset + step for step in starts[starts != 0.0].tolist()]
        for k in range(len(tried) + len(finer)):
            offset = tried[k] if k < len(tried) else found + finer[k - len(tried)]
            other = with_aid(about, replace(aid, time_offset=offset))
            if _far(chain, other):
                continue
            try:
                again = drive(other)
            except (DataError, DivergenceError):
                continue
            if _gain(*best, other, again) > LEAST_GAIN:
                best, found = (other, again), offset
    return best


def _swings(record: NavigationRecord) -> bool:
    """Whether acceleration changes within a second more than from one to the next, for a while."""
    time, velocity = index_of(record.trajectory), values_of(record.trajectory, VELOCITY)
    rows = round(1.0 / float(np.median(np.diff(time)))) if len(time) > 1 else 0
    if rows < ROWS or not 2.0 < time[-1] - time[0] < BRIEFLY:
        return False
    sums = np.cumsum(np.pad(velocity, ((1, 0), (0, 0))), axis=0)
    slow = (sums[rows:] - sums[:-rows]) / rows
    fast = velocity[rows // 2 : rows // 2 + len(slow)] - slow
    changes = (np.diff(of, axis=0) * rows for of in (fast, slow))
    within, between = (math.sqrt(float(np.square(of).sum(axis=1).mean())) for of in changes)
    return within > max(SWINGS, between)


def _with_offsets(
    chain: NavigationPipeline, record: NavigationRecord, before: dict[str, tuple[float, float]]
) -> tuple[NavigationPipeline, tuple[Finding, ...]]:
    """Return a pipeline that begins with the estimated time offsets, where these are large.

    A fix is compared with the motion at its stamp, continued over the offset by velocity and mean
    acceleration: over `CONTINUED` a walk's steps move by more than a centimeter otherwise. Biases
    and tilt explain a part of a large one, in each run alike: by the error that was left `before`,
    with another offset, the secant says which.
    """
    aids: list[Measurement] = []
    findings: list[Finding] = []
    for aid in chain.navigator.aids:
        if isinstance(aid, Gnss) and aid.time_offset_sd > 0.0:
            name = f"{aid.name}.time_offset_t"
            error, sd = (float(of[name].iloc[-1]) for of in (record.sensors, record.sensors_sd))
            if abs(error) > max(CONTINUED, SURELY * sd):
                part = 1.0
                if name in before:
                    offset, other = before[name]
                    part = (other - error) / (offset - aid.time_offset)
                before[name] = aid.time_offset, error
                step = error / min(max(part, LEAST_PART), 1.0)
                aid = replace(aid, time_offset=aid.time_offset - step)
                add_note(
                    findings,
                    "navigation.run-again-with-offset",
                    quantity=name,
                    offset=aid.time_offset,
                    sd=sd,
                )
        aids.append(aid)
    if findings:
        chain = replace(chain, navigator=replace(chain.navigator, aids=tuple(aids)))
    return chain, tuple(findings)


def _with_known_offsets(
    chain: NavigationPipeline, record: NavigationRecord, tables: Mapping[str, pd.DataFrame]
) -> tuple[NavigationPipeline, tuple[Finding, ...]]:
    """Return a pipeline that begins with the time offsets that the record has determined.

    Along the way an offset is a displacement, until the vehicle turns or changes its speed: a run
    that begins with an uncertain one is as uncertain in position up to its first manoeuvre. It is
    repeated with the last estimate, of standard deviation s, as if it were known to `ASSUMED` = k
    times s (and to its random walk since the start). Its data are then used twice: with information
    1/s² + 1/(k s)² instead of 1/s², so that no variance is understated by more than
    1 + 1/k² (5 % of a standard deviation). Offsets that were not constant are left as they are.
    """
    aids: list[Measurement] = []
    findings: list[Finding] = []
    for aid in chain.navigator.aids:
        if isinstance(aid, Gnss) and aid.time_offset_sd > 0.0 and not aid.clock_unsure:
            name = f"{aid.name}.time_offset_t"
            known = _known_offset(aid, record.sensors[name], record.sensors_sd[name])
            speed = np.linalg.norm(record.trajectory[VELOCITY].to_numpy(), axis=1)
            fix = float(np.nanmedian(values_of(tables[aid.name], POSITION_SD[:2])))
            displaced = float(np.quantile(speed, MOSTLY)) * aid.time_offset_sd
            if known is not None and displaced > DISPLACED * aid.position_sd_factor * fix:
                error, sd = known
                aid = replace(aid, time_offset=aid.time_offset - error, time_offset_sd=sd)
                add_note(
                    findings,
                    "navigation.run-again-with-known-offset",
                    quantity=name,
                    offset=aid.time_offset,
                    sd=sd,
                )
        aids.append(aid)
    if findings:
        chain = replace(chain, navigator=with_aids(chain.navigator, tuple(aids)))
    return chain, tuple(findings)


def _with_jumps(
    chain: NavigationPipeline,
    run: PipelineRun,
    source: NavigationSource,
    drive: Callable[[NavigationPipeline, NavigationSource], PipelineRun],
) -> tuple[NavigationPipeline, PipelineRun, NavigationSource, tuple[Finding, ...]]:
    """Repeat a run over positions that jump away and back, as what explains the measurements best.

    Rejected ones included, and far better than without.
    """
    for aid in chain.navigator.aids:
        if not isinstance(aid, Gnss):
            continue
        before, least = run, LEAST_GAIN
        best: tuple[NavigationPipeline, NavigationSource, Finding] | None = None
        known: list[tuple[Gnss, pd.DataFrame]] = []
        for _ in range(2):  # beside the repeated run, what jumps is clearer
            for other, table, finding in list(_jumping(run.record, source.tables[aid.name], aid)):
                if any(other == one and table.equals(its) for one, its in known):
                    continue
                known.append((other, table))
                tables = {**source.tables, aid.name: table}
                tried = with_aid(chain, other), replace(source, tables=tables)
                try:
                    again = drive(*tried)
                except (DataError, DivergenceError):
                    continue
                gain, count = likelihood_gain(before.record.innovations, again.record.innovations)
                if gain > max(least, GAIN_EACH * count):
                    best, least, run = (*tried, finding), gain, again
            if best is None:
                break
        if best is not None:  # a record may have both, each once
            chain, run, source, more = _with_jumps(best[0], run, best[1], drive)
            return chain, run, source, (best[2], *more)
    return chain, run, source, ()


def _with_jumps_of(chain: NavigationPipeline, other: NavigationPipeline) -> NavigationPipeline:
    """Return another pipeline whose receivers know of jumps what those of a pipeline do."""
    for aid, own in zip(chain.navigator.aids, other.navigator.aids, strict=True):
        if isinstance(aid, Gnss) and isinstance(own, Gnss):
            own = replace(own, float_position_sd=aid.float_position_sd, displaced=aid.displaced)
            other = with_aid(other, own)
    return other


def _jumping(
    record: NavigationRecord, table: pd.DataFrame, aid: Gnss
) -> Iterator[tuple[Gnss, pd.DataFrame, Finding]]:
    """What positions that jump may be: a receiver that knows it, its fixes, and the finding."""
    file, steps = source_of(table), fix_steps(record, table, aid)
    stated = stated_floats(steps)
    if stated is not None:
        changed = values_of(stated[0], POSITION_SD) > values_of(table, POSITION_SD)
        floats = index_of(table)[changed.any(axis=1)]
        finding = Finding(
            "navigation.run-again-with-floats",
            file=file,
            quantity="lat, lon, alt",
            count=len(floats),
            rows=len(table),
            first=float(floats[0]),
            last=float(floats[-1]),
        )
        yield stated[1], stated[0], finding
    if aid.displaced:
        return
    for hidden in (False, True):
        found, size = displaced_stretches(steps, hidden=hidden)
        if found:
            finding = Finding(
                "navigation.run-again-with-displacement",
                file=file,
                quantity="lat, lon, alt",
                size=size,
                listed=[f"{begin:.5g} to {end:.5g} s" for begin, end in found],
                given=str([[round(x, 3) for x in one] for one in found]),
            )
            yield replace(aid, displaced=found), table, finding


def _recovered(
    chain: NavigationPipeline,
    run: PipelineRun,
    tables: Mapping[str, pd.DataFrame],
    drive: Callable[[NavigationPipeline], PipelineRun],
) -> tuple[NavigationPipeline, PipelineRun, tuple[Finding, ...]]:
    """Repeat a run whose solution was contradicted, with the noise that explains where it went.

    The noise belongs to the whole stretch since the last fix that agreed: filter and smoother then
    see its error as one of that stretch, and take the fixes after it. As often as that explains the
    measurements better, rejected ones included.
    """
    findings: tuple[Finding, ...] = ()
    first = run.record
    for _ in range(RECOVERIES):
        found = wrong_stretches(run.record.innovations, tables)
        if not found or (not findings and longest(found) < DOUBT):
            break
        wrong = (*chain.navigator.wrong, *found)
        other = replace(chain, navigator=replace(chain.navigator, wrong=wrong))
        try:
            again = drive(other)
        except DivergenceError:
            break
        gain, _ = likelihood_gain(run.record.innovations, again.record.innovations)
        if gain < LEAST_GAIN:
            break
        chain, run = other, again
        findings = (
            Finding(
                "navigation.run-again-with-noise",
                quantity="position",
                count=len(wrong),
                begin=min(one.begin for one in wrong),
                end=max(one.end for one in wrong),
                rejected=rejected_percent(first),
                left=rejected_percent(run.record),
            ),
        )
    return chain, run, findings


def _about_smoothed(
    chain: NavigationPipeline,
    source: NavigationSource,
    recorder: Recorder,
    run: PipelineRun,
    far: bool,
    progress: Progress,
) -> PipelineRun:
    """Repeat a run about its smoothed states, and of one that starts `far` the filter as well.

    Without a smoother, of which the filter alone is a result, there is none afterwards either.
    """
    again, smooths = run, run.smoothed is not None
    if not smooths:
        navigator = replace(chain.navigator, smoother=RauchTungStriebel())
        chain = replace(chain, navigator=navigator)
        try:
            again = run_batch(chain, source.imu, source.tables, recorder, progress, CHUNK)
        except DivergenceError:
            return run
    again = relinearized(
        chain, source.imu, source.tables, recorder, again, progress, CHUNK, filtered=far
    )
    return again if smooths else replace(run, record=again.record)


def _known_offset(aid: Gnss, error: pd.Series, sd: pd.Series) -> tuple[float, float] | None:
    """Error of an assumed offset and a standard deviation for another run, where that is worth it.

    Estimates on the way differ from the last by the root of the difference of their variances, and
    by what the offset has walked since.
    """
    last, s = float(error.iloc[-1]), float(sd.iloc[-1])
    left = float(error.index[-1]) - error.index.to_numpy(dtype=np.float64)
    walked = aid.time_offset_drift**2 * left
    apart = np.square(error.to_numpy() - last)
    expected = np.maximum(np.square(sd.to_numpy()) - s**2, 0.0) + s**2 + walked
    again = math.hypot(ASSUMED * s, math.sqrt(float(walked[0])))
    if (apart > SURELY**2 * expected).any() or again > BETTER * aid.time_offset_sd:
        return None
    return last, again


def _unlike_named(
    spec: NavigationSpec, sensors: ImuUncertainty, source: NavigationSource
) -> tuple[Finding, ...]:
    """Report a rest that is not of the sensor that is named, however well its noise is stated."""
    named = spec.sensors.sensor
    if named is None:
        return ()
    fixes = next((t for t in source.tables.values() if set(GNSS) <= set(t.columns)), None)
    place = None
    if spec.site is not None:
        place = spec.site.lat_deg, spec.site.lon_deg, spec.site.alt_m
    elif fixes is not None:
        lat, lon, alt = np.median(values_of(fixes, GEODETIC), axis=0).tolist()
        place = lat, lon, alt
    site = None if place is None else Site(*place, find_ellipsoid(spec.ellipsoid))
    return unlike_sensor(source.imu, quiet_at_start(source.imu, fixes), named, sensors, site)


def _coarser(
    spec: NavigationSpec, sensors: ImuUncertainty, begin: float
) -> list[tuple[str, NavigationPipeline]]:
    """Pipelines with coarser grades of sensors than the one that is named, the best first."""
    named = spec.sensors.sensor
    if named is None or named in COARSE:
        return []
    bias = max(sensors.gyro.axis("bias"))
    out = []
    for grade in COARSE:
        if max(ImuUncertainty.of_sensor(load_sensor(grade)).gyro.axis("bias")) > COARSER * bias:
            update = {"sensor": grade, "states": None}
            table = spec.sensors.model_copy(update=update)
            other = spec.model_copy(update={"sensors": table})
            out.append((grade, _switched_on(make_chain(other, sensors_of(other)), begin)))
    return out


def _not_of_clock(
    by_offset: tuple[Finding, ...], blamed: tuple[Finding, ...]
) -> tuple[Finding, ...]:
    """Return what was found of clocks, as no fact where another explanation finds another."""
    for best in blamed:
        if best.code.startswith("navigation.blame-clock"):
            continue
        found, sd = (best.data.get(key, math.nan) for key in ("offset", "offset_sd"))
        by_offset = tuple(
            Finding("navigation.offset-not-of-clock", quantity=one.quantity, data=more)
            if abs((more := {**one.data, "found": found, "sd": sd}).get("offset", math.nan) - found)
            > max(SETTLED, SURELY * sd)
            else one
            for one in by_offset
        )
    return by_offset


def _with_correction(chain: NavigationPipeline, kind: str) -> NavigationPipeline:
    """Return a pipeline with another correction by the estimated errors, without a smoother."""
    navigator = replace(chain.navigator, damping=DAMPINGS[kind](), smoother=None)
    return replace(chain, navigator=navigator)


def _unsettled(run: PipelineRun) -> tuple[Finding, ...]:
    """Report smoothed states that another pass moves by more than their bounds allow for."""
    if run.moved <= UNSETTLED:
        return ()
    return (Finding("navigation.smoother-not-settled", quantity="smoother", moved=run.moved),)


def _lost_start(
    chain: NavigationPipeline, imu: pd.DataFrame, trajectory: pd.DataFrame
) -> tuple[Finding, ...]:
    """Report the samples before navigation of a vehicle that was aligned while it moved."""
    mode = chain.modes[0]
    begin, begun = float(imu.index[0]), float(trajectory.index[0])
    moving = isinstance(mode, CoarseMode) and isinstance(mode.way, GnssCourse)
    if not moving or begun - begin <= LEAST_LOST:
        return ()
    return (
        Finding(
            "navigation.start-lost",
            severity="note",
            file=source_of(imu),
            quantity="time",
            seconds=begun - begin,
            begin=begin,
            begun=begun,
        ),
    )


def _switched_on(chain: NavigationPipeline, time: float) -> NavigationPipeline:
    """Return a pipeline whose unit was switched on at a time, if it warms up at all.

    A navigator that begins later, as the independent ones of the heading do, then knows how warm it
    is.
    """
    warming = chain.navigator.warming
    if warming is None:
        return chain
    warming = replace(warming, begin=time)
    return replace(chain, navigator=replace(chain.navigator, warming=warming))


def withheld_aid(spec: NavigationSpec) -> str:
    """Name of the measurement whose fixes a specification withholds."""
    assert spec.withhold is not None
    named = spec.withhold.aid
    return named or next(name for name, aid in spec.aiding.items() if aid.kind == "gnss")


def _begun(record: NavigationRecord) -> float:
    """Time from which fixes are processed one by one, s: that of the end of the alignment.

    A course that is aligned backward uses those before it as a whole, and navigation then begins
    with the first sample.
    """
    aligned = takewhile(lambda one: one.name != Navigation.name, record.modes)
    return max([float(record.trajectory.index[0]), *(one.end for one in aligned)])


def _test_outages(
    asked: WithholdTable, begun: float, end: float, fixes: pd.DataFrame | None
) -> Sequence[Span]:
    """Spans of the GNSS outage test of a run from `begun` to `end`.

    Of those that are chosen here, spans without a fix to compare with are left out, unless none
    has one.
    """
    from strapdown.navigation.outage_test import SETTLED, spans_to_withhold

    if asked.spans_s:
        return [Span(f"{e - b:g} s", b, e) for b, e in asked.spans_s]
    first = begun + SETTLED if asked.from_s is None else asked.from_s
    spans = [
        span
        for length in asked.lengths_s
        for span in spans_to_withhold(first, end, length, asked.places)
    ]
    if fixes is None or "quality" not in fixes:
        return spans
    time = index_of(fixes)[usable(fixes, POSITION_SD[:2])]
    ends = [np.searchsorted(time, (one.begin, one.end), side="right") for one in spans]
    return [one for one, (a, b) in zip(spans, ends, strict=True) if b > a] or spans


def _against_truth(
    trajectory: pd.DataFrame, source: NavigationSource, spec: NavigationSpec
) -> tuple[pd.DataFrame | None, DifferenceSummary | None]:
    if source.truth is None:
        return None, None
    # Rows at a constant interval, from the last one back.
    time = trajectory.index.to_numpy(dtype=np.float64)
    step = float(np.median(np.diff(time))) if len(time) > 1 else APART
    each = max(1, round(APART / step)) if step > 0.0 else 1
    kept = trajectory.iloc[np.arange(len(time) - 1, -1, -each)[::-1]]
    kept.attrs = dict(trajectory.attrs)
    differences = trajectory_differences(kept, source.truth, find_ellipsoid(spec.ellipsoid))
    return differences, summarise_differences(differences)


# The run as data.


@dataclass(frozen=True, eq=False, repr=False)
class NavigationRun(SavedRun):
    """Result of a navigation run; in memory until `save` writes it.

    Attributes
    ----------
    spec : NavigationSpec
        With every option of every module.
    record : NavigationRecord
        Smoothed, if specified.
    forward : NavigationRecord or None
        Filter solution of a smoothed run.
    differences : DataFrame or None
        From the truth, where it is known (`trajectory_differences`), ten times a second at most.
    errors : DifferenceSummary or None
        Of these.
    forward_differences : DataFrame or None
        Of the filter solution of a smoothed run.
    agreement : SmootherConsistency or None
        Of the filter and the smoother of a smoothed run, about the same states.
    points : ControlPointScore or None
        The path at its control points.
    beside : NavigationRecord or None
        The same record with the other correction of ``[damping]``.
    withheld : tuple of Withheld
        Test outages and their errors.
    memory : Memory
        Tables that are given in memory; files of the bundle.
    """

    bundle = "strapdown.report.navigation:NAVIGATION"

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
    agreement: SmootherConsistency | None
    points: ControlPointScore | None
    beside: NavigationRecord | None
    withheld: tuple[Withheld, ...]
    trust: IntegrityReport
    inputs: tuple[InputFiles, ...]
    findings: tuple[Finding, ...]
    memory: Memory = field(default=Memory({}))

    @property
    def filtered(self) -> NavigationRecord:
        """Filter solution: the estimate at each instant without later measurements."""
        return self.forward or self.record

    @property
    def filtered_differences(self) -> pd.DataFrame | None:
        """Differences of the filter solution from the truth."""
        return self.differences if self.forward is None else self.forward_differences

    @property
    def trajectory(self) -> pd.DataFrame:
        """Trajectory table by time in s; smoothed if the run is.

        ``lat lon`` in deg, ``alt`` in m over the ellipsoid, ``VN VE VD`` in m/s, ``roll pitch
        heading`` in deg.
        """
        return self.record.trajectory

    @property
    def sd(self) -> pd.DataFrame:
        """Standard deviations by time: ``north east down`` m, ``VN VE VD`` m/s, angles deg."""
        return self.record.sd

    @property
    def innovations(self) -> Mapping[str, pd.DataFrame]:
        """By name of the observation (``gnss.position``): innovation, variance, weight."""
        return self.record.innovations

    @property
    def sensor_errors(self) -> pd.DataFrame:
        """Estimates of sensor and measurement errors by time, in SI (`record.units`)."""
        return self.record.sensors

    @property
    def integrity(self) -> IntegrityReport:
        """Whether heading and bounds can be trusted, and the first inconsistency."""
        return self.trust

    def to_pandas(self) -> pd.DataFrame:
        """The trajectory with its standard deviations, linear in time between their instants.

        Returns
        -------
        DataFrame
            Columns of `trajectory`, and those of `sd` with the suffix ``_sd``.
        """
        at, known = self.trajectory.index, self.sd.index
        sd = {f"{name}_sd": np.interp(at, known, self.sd[name]) for name in self.sd}
        return self.trajectory.assign(**sd)

    def plot(self, kind: str = "plan") -> ChartFigure:
        """Draw one chart of the report.

        Parameters
        ----------
        kind : str
            ``plan``, ``bound``, ``height``, ``velocity``, ``attitude``, or the name of an
            observation of `innovations`; with `beside` also ``paired``.

        Returns
        -------
        ChartFigure
            Displays itself in a notebook; `save` writes it as SVG, PNG or PDF.

        Raises
        ------
        ConfigError
            The chart does not exist for this run.
        """
        from strapdown.report.navigation import plot

        return plot(self, kind)

    def __repr__(self) -> str:
        time, smoothed = self.trajectory.index, "" if self.forward is None else ", smoothed"
        last = self.sd.iloc[-1]
        return (
            f"<NavigationRun {self.source.name}: {time[-1] - time[0]:.6g} s{smoothed}; at the end "
            f"sd north {last['north']:.3g} m, east {last['east']:.3g} m, heading "
            f"{last['heading']:.3g}°; {len(self.findings)} findings>"
        )

    def _table_html(self) -> str:
        rows = self.to_pandas().iloc[[0, -1]]
        shown = rows[[*GEODETIC, *VELOCITY, *EULER, "north_sd", "east_sd", "heading_sd"]]
        return str(shown.to_html(float_format="{:.6g}".format))


# The pipeline of a configuration.


def make_chain(spec: NavigationSpec, sensors: ImuUncertainty) -> NavigationPipeline:
    """Build the pipeline of a specification.

    Parameters
    ----------
    spec : NavigationSpec
        Its pipeline takes samples and tables in body axes and on one clock.
    """
    given = {"ellipsoid": spec.ellipsoid}
    aids = make_aids(spec)
    options = spec.filter.make(**given)
    navigator = Navigator(
        with_states(make_filter(spec, sensors), aids),
        aids,
        options.mark_interval,
        spec.damping.make(**given),
        spec.smoother.make(**given),
        warming=spec.sensors.warming.make(),
    )
    prefilter = None
    if spec.prefilter.kind != "none":
        prefilter = spec.prefilter.make(**given)
    gaps = spec.gaps
    site, site_sd, velocity_sd = None, (1.0, 1.0, 1.0), (0.1, 0.1, 0.1)
    if spec.site is not None:
        site = Site(
            spec.site.lat_deg, spec.site.lon_deg, spec.site.alt_m, find_ellipsoid(spec.ellipsoid)
        )
        site_sd = _three(spec.site.position_sd_m)
        velocity_sd = _three(spec.site.velocity_sd_m_per_s)
    return NavigationPipeline(
        navigator=navigator,
        intake=ImuPreprocessor(
            prefilter=prefilter,
            gaps=GapPolicy(gaps.usual, gaps.bridge_s, gaps.beyond),
            ends=ends_of(sensors),
        ),
        modes=_modes(spec),
        start=None if spec.start is None else _known(spec.start),
        sensors=sensors,
        site=site,
        commands=tuple(Command(one.time_s, one.mode) for one in spec.commands),
        site_sd=site_sd,
        velocity_sd=velocity_sd,
    )


def _modes(spec: NavigationSpec) -> tuple[Mode, ...]:
    given = {"ellipsoid": spec.ellipsoid}
    modes: list[Mode] = []
    coarse = spec.coarse.make(**given)
    if coarse is not None:
        window = math.inf if spec.coarse.window_s is None else spec.coarse.window_s
        modes.append(CoarseMode("coarse", _until(spec.coarse), way=coarse, window=window))
    fine = spec.fine.make(**given)
    if fine is not None:
        modes.append(FineMode("fine", _until(spec.fine), fine))
    return (*modes, Navigation())


def _until(mode: CoarseModeSpec | FineModeSpec) -> Until:
    return Until(
        duration=math.inf if mode.duration_s is None else mode.duration_s,
        heading_sd_deg=mode.until_heading_sd_deg,
        tilt_sd_deg=mode.until_tilt_sd_deg,
        least=Until.least if mode.least_s is None else mode.least_s,
    )


def _known(start: StartTable) -> KnownStart:
    return KnownStart(
        NavState.from_degrees(
            start.lat_deg,
            start.lon_deg,
            start.alt_m,
            v_n=start.v_ned_m_per_s,
            roll_deg=start.roll_deg,
            pitch_deg=start.pitch_deg,
            heading_deg=start.heading_deg,
        ),
        position_sd=_three(start.position_sd_m),
        velocity_sd=_three(start.velocity_sd_m_per_s),
        attitude_sd_deg=(start.tilt_sd_deg, start.tilt_sd_deg, start.heading_sd_deg),
        at_first_sample=True,
    )


def _three(value: float | Triple) -> Triple:
    x, y, z = (float(v) for v in np.broadcast_to(value, 3))
    return x, y, z
