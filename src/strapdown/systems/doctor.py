"""Examine logs: streams, clocks, units, channels, rests, faults, and what they suffice for."""

from __future__ import annotations

import math
import shlex
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pandas as pd

from strapdown import rotation
from strapdown.bundle import InputFiles, log_files
from strapdown.config.logs import (
    AxesTable,
    DoctorSpec,
    FixesTable,
    LogTable,
    flags_of,
    flags_of_fixes,
    with_answers,
)
from strapdown.constants import STANDARD_GRAVITY
from strapdown.dsp.samples import running_integral, white_sd
from strapdown.errors import (
    ConfigError,
    DataError,
    Finding,
    Severity,
    StrapdownError,
    add_note,
    add_warning,
)
from strapdown.evaluation.differences import rotation_contradicted
from strapdown.formats import (
    READERS,
    STREAMS,
    TABLE,
    NoStreamError,
    Reader,
    files_of,
    open_stream,
    reader_of,
)
from strapdown.formats.aid_table import read_stream, wheel_table
from strapdown.formats.clocks import clock_of, on_clock_of
from strapdown.formats.crash_record import CrashRecord
from strapdown.formats.gnss_files import read_gnss
from strapdown.formats.gnss_fixes import GnssOptions
from strapdown.formats.recording import ABSENT, PLACEHOLDERS, RawLog, Recording
from strapdown.formats.references import read_truth
from strapdown.formats.trajectory_readers import read_trajectory
from strapdown.frames import ways_between
from strapdown.navigation.measurements.gnss_clock import find_time_offset, sure_delay
from strapdown.navigation.measurements.gnss_readiness import receiver_findings, without_repeats
from strapdown.progress import Progress, silent
from strapdown.sensors.health_log import LEAST_SAMPLES
from strapdown.sensors.imu_health import ImuHealth, check_imu_channels
from strapdown.sensors.rest import (
    LEAST_LENGTH,
    RestStretch,
    begins_at_rest,
    could_be_a_turn,
    field_turned,
    find_rests_of_every_grade,
    rest_between,
)
from strapdown.sensors.sampling_health import check_sampling, quantization_step
from strapdown.systems.alignment_source import body_record, gyro_unit_by_turns
from strapdown.systems.inputs import Memory, SavedRun
from strapdown.systems.navigation_checks import longest_faults, most_unusable, unusable_samples
from strapdown.systems.navigation_proposal import (
    CODE_POSITION_SD,
    CODE_VELOCITY_SD,
    clock_offset,
    first_motion,
)
from strapdown.systems.one_thread import one_thread
from strapdown.tables import ACCEL, GEODETIC, GYRO, MAG, POSITION_SD, find_gaps
from strapdown.tables.checks import index_of, values_of

#: Uses that a log is judged for.
USES = ("attitude", "navigation", "crash")
# What a log is refused for that is in no record of a crash, whatever words its columns have: it is
# a table of positions, or its values are those of no body.
OF_NO_CRASH = frozenset({"io.table-of-positions", "io.rate-impossible", "io.force-impossible"})
# Largest specific force of an impact over the median of its record, at least: a hand swings a phone
# with less.
STRUCK = 4.0
#: Rounds of questions of one file: a unit that is known may open the next question.
ROUNDS = 4
#: Sample rates below which an attitude misses ordinary motion, and all motion, Hz.
LEAST_RATE, USELESS_RATE = 20.0, 4.0
#: Rate of delta-V in 49 CFR 563, Hz; its interval, s, and the change that is an event, m/s.
EVENT_RATE, EVENT, EVENT_DV = 100.0, 0.15, 8.0 / 3.6
#: Fixes before the first that shows a motion in which it may have begun.
MARGIN = 2
#: Mean before an event that is subtracted with gravity, s.
BEFORE = 0.5


@dataclass(frozen=True, eq=False)
class LogDiagnosis:
    """Diagnosis of one log.

    Attributes
    ----------
    log : LogTable
        As it was read: with the answers to its questions as inferred.
    recording : Recording or None
        None if it has no inertial samples, or none that can be read.
    streams : mapping of str to DataFrame
        By name of `formats.STREAMS`; ``imu`` in body axes and SI.
    questions : tuple of Finding
        What the file leaves open.
    answers : mapping of str to str
        To the questions, as inferred.
    refused : Finding or None
        Why inertial samples could not be read.
    faults : tuple of Finding
        Of severity warning or error, the gravest first.
    notes : tuple of Finding
    fit : mapping of str to tuple of Finding
        By use: a note supports it, a warning limits it, an error prevents it.
    health : ImuHealth or None
        Tests of the channels.
    rests : tuple of RestStretch
    data : mapping
        Everything that was measured, as plain data.
    """

    log: LogTable
    recording: Recording | None
    streams: Mapping[str, pd.DataFrame]
    questions: tuple[Finding, ...]
    answers: Mapping[str, str]
    refused: Finding | None
    faults: tuple[Finding, ...]
    notes: tuple[Finding, ...]
    fit: Mapping[str, tuple[Finding, ...]]
    health: ImuHealth | None
    rests: tuple[RestStretch, ...]
    data: Mapping[str, Any]

    @property
    def name(self) -> str:
        """Name of the file or folder."""
        return str(self.data["name"])

    def answer(self, use: str) -> str:
        """``yes``, ``with limits`` or ``no``."""
        worst = {one.severity for one in self.fit[use]}
        return "no" if "error" in worst else "with limits" if "warning" in worst else "yes"


@dataclass(frozen=True, eq=False, repr=False)
class Diagnosis(SavedRun):
    """Result of `doctor`: in memory until `save` writes its page and its JSON.

    Attributes
    ----------
    logs : tuple of LogDiagnosis
        In the order given.
    between : tuple of Finding
        Clocks between the logs.
    findings : tuple of Finding
        Questions, faults and notes of every log, and `between`.
    """

    bundle = "strapdown.report.doctor:DOCTOR"

    configuration: ClassVar[str] = "spec"

    spec: DoctorSpec
    logs: tuple[LogDiagnosis, ...]
    between: tuple[Finding, ...]
    inputs: tuple[InputFiles, ...]
    findings: tuple[Finding, ...]
    memory: Memory = field(default=Memory({}))

    @property
    def data(self) -> dict[str, Any]:
        """Everything that was measured, as plain data."""
        return {"logs": [dict(log.data) for log in self.logs]}

    def to_pandas(self) -> pd.DataFrame:
        """One row per stream: log, name, rows, first and last stamp in s, rate in Hz."""
        rows = [{"log": log.name, **one} for log in self.logs for one in log.data["streams"]]
        return pd.DataFrame(rows)

    def __repr__(self) -> str:
        said = "; ".join(
            f"{log.name}: "
            + ", ".join(f"{use} {log.answer(use)}" for use in USES)
            + f", {len(log.faults)} faults"
            for log in self.logs
        )
        return f"<Diagnosis {said}>"


@one_thread()
def run_doctor(spec: DoctorSpec, progress: Progress = silent) -> Diagnosis:
    """Examine logs.

    Parameters
    ----------
    spec : DoctorSpec
    progress : callable, optional
        Called with a stage and the share that is done.

    Raises
    ------
    ConfigError
        A file does not exist, or an option does not fit it.
    DataError
        No file holds anything that can be read.
    """
    logs: list[LogDiagnosis] = []
    unread: list[tuple[str, DataError]] = []
    unfit: dict[str, ConfigError] = {}
    # A file that the record of a crash names as its own is examined with it.
    named: set[Path] = set()
    if len(spec.logs) > 1:
        from strapdown.formats.crash_records import files_named

        named = files_named([Path(log.path) for log in spec.logs])
    by_path = {fixes.path: fixes for fixes in spec.fixes}
    for k, log in enumerate(spec.logs):
        if named and Path(log.path).resolve() in named:
            continue
        progress(f"examining {Path(log.path).name}", 0.05 + 0.7 * k / len(spec.logs))
        try:
            try:
                logs.append(_diagnose(log, spec.axes_of(k), by_path.get(log.path)))
            except ConfigError as error:
                # Options of the fixes are those of the file of fixes, and not of samples beside it.
                if log.path not in by_path or len(spec.logs) == 1:
                    raise
                without = _diagnose(log, spec.axes_of(k), None)
                if {*without.streams} & {"imu", "gnss"} != {"imu"}:
                    raise
                logs.append(without)
                unfit[log.path] = error
        except DataError as error:
            unread.append((log.path, error))
    if unfit and len(unfit) == len(by_path):
        raise next(iter(unfit.values()))
    if not logs:
        raise unread[0][1]
    alone = [k for k, one in enumerate(logs) if "gnss" in one.streams and "imu" not in one.streams]
    # The positions of a reference are fixes where there are no others.
    alone.sort(key=lambda k: "reference" in logs[k].streams)
    for k, one in enumerate(logs):
        asked = () if one.refused is None else one.refused.data.get("answers", ())
        if alone and "imu" not in one.streams and ("gyro_unit", "UNIT") in asked:
            at = next(j for j, log in enumerate(spec.logs) if log.path == one.log.path)
            gnss = logs[alone[0]].streams["gnss"]
            one = logs[k] = _diagnose(spec.logs[at], spec.axes_of(at), None, gnss)
        if alone and "imu" in one.streams and "gnss" not in one.streams:
            fixes = logs[alone[0]]
            logs[k] = _with_fixes(one, fixes)
            logs[alone[0]] = replace(fixes, data={**fixes.data, "fixes_for": one.name})
    lent = _lend_refused_fixes(logs, unread)
    between = (*(e.finding for _, e in unread if e.finding is not lent), *_between(logs))
    findings = tuple(f for one in logs for f in (*one.questions, *one.faults, *one.notes))
    inputs = tuple(f for x in logs for f in log_files(x.log.path, _files(x), x.log.calibration))
    waiting = [path for path, e in unread if e.finding is lent]
    inputs += tuple(f for path in waiting for f in log_files(path, files_of(path), None))
    read = {*(x.log.path for x in logs), *waiting}
    kept = [k for k, log in enumerate(spec.logs) if log.path in read]
    axes = spec.axes if not isinstance(spec.axes, tuple) else tuple(spec.axes[k] for k in kept)
    asked = spec.model_copy(update={"logs": tuple(spec.logs[k] for k in kept), "axes": axes})
    return Diagnosis(asked, tuple(logs), between, inputs, (*findings, *between))


def _files(one: LogDiagnosis) -> tuple[Path, ...]:
    """List the files of a log; every file of a folder whose samples were not read."""
    read = files_of(one.log.path) if one.recording is None else one.recording.files
    files = [f for p in read for f in (p.rglob("*") if p.is_dir() else (p,)) if f.is_file()]
    return tuple(sorted(files))


def _diagnose(
    log: LogTable,
    axes: str | None,
    fixes: FixesTable | None,
    gnss: pd.DataFrame | None = None,
) -> LogDiagnosis:
    form, reader = _reader(log)
    inertial = _inertial(log, axes, gnss)
    streams = {} if inertial.imu is None else {"imu": inertial.imu}
    findings = list(inertial.findings)
    others, found = _others(log, reader, inertial.recording, fixes)
    streams |= others
    findings += found
    raw = None
    if inertial.imu is None and reader is not None:
        raw = _columns(log.path, form)
    missing = inertial.refused
    record = None if streams or raw is not None or log.format else _stated_record(log.path)
    if not streams and raw is None and record is None:
        assert missing is not None
        lacking = missing.code in ABSENT and not inertial.questions
        raise DataError(next((f for f in findings if lacking and f.severity == "error"), missing))
    health: ImuHealth | None = None
    rests: tuple[RestStretch, ...] = ()
    if inertial.imu is not None:
        health, rests, found = _channels(inertial.imu)
        silent = {f.quantity for f in found if f.data.get("kind") in ("stuck", "dead")}
        findings = [
            f for f in findings if f.code != "io.channel-constant" or f.quantity not in silent
        ]
        rests = _unmoved(rests, streams)
        findings += found
        findings += _reference_against(streams)
    clock, found = _fixes_against(streams, inertial.log)
    findings += found
    if record is not None:
        findings += record.findings
        missing = None
    elif missing is not None and not inertial.questions:
        if not streams:
            findings.append(missing)
        elif missing.code not in ABSENT:
            findings.append(missing.replace(severity="warning"))
    lacks = raw is not None and missing is not None and missing.code in ABSENT
    crash = None if record is None else len(record.channels)
    of_another = inertial.imu is not None or (missing is not None and missing.code in OF_NO_CRASH)
    if record is None and not of_another:
        # A log with all of its sensors is a log first, whose units are asked.
        crash = _crash_record(log.path, lacks, struck=bool(inertial.questions) and not lacks)
    impact = None if inertial.imu is None else _impact(inertial.imu)
    order = {"error": 0, "warning": 1}
    faults = sorted((f for f in findings if f.severity in order), key=lambda f: order[f.severity])
    flags = flags_of(inertial.log, axes)
    data: dict[str, Any] = {
        "name": Path(log.path).resolve().name,
        "format": _format(form, reader, record),
        "options": flags,
        "fixes_options": flags_of_fixes(fixes),
        "answers_inferred": dict(inertial.answers),
        "streams": [_stream(name, streams[name]) for name in STREAMS if name in streams],
        "read_as": [asdict(r) for r in inertial.recording.readings] if inertial.recording else [],
        "columns": [] if raw is None else _ranges(raw),
        "stamps": None if inertial.imu is None else _steps(inertial.imu),
        "channels": {} if health is None else _channel_facts(streams["imu"], health),
        "stationary": [_rest(streams["imu"], rest) for rest in rests],
        "gravity": _gravity(inertial.imu, inertial.findings, rests),
        "receiver_clock": clock,
        "fixes_from": None,
        "fixes_for": None,
        "impact": impact,
        "crash_record": crash,
        "temperature": _temperature(streams),
    }
    one = LogDiagnosis(
        inertial.log,
        inertial.recording,
        streams,
        inertial.questions,
        inertial.answers,
        missing,
        tuple(faults),
        tuple(f for f in findings if f.severity == "note"),
        {},
        health,
        rests,
        data,
    )
    return _judged(one)


def _lend_refused_fixes(
    logs: list[LogDiagnosis], unread: Sequence[tuple[str, DataError]]
) -> Finding | None:
    """Make the question of a file of fixes one of the log that needs them; None if there is none.

    The log is not without fixes: theirs wait for an answer.
    """
    needs = [
        k
        for k, one in enumerate(logs)
        if ("imu" in one.streams or one.questions)
        and "gnss" not in one.streams
        and refused_fixes(one) is None
    ]
    beside = [k for k, one in enumerate(logs) if k not in needs and not one.streams]
    refused = [f for k in beside if (f := refused_fixes(logs[k])) is not None]
    refused += [e.finding for _, e in unread if e.finding.data.get("stream") == "gnss"]
    if not needs or not refused:
        return None
    first = refused[0]
    for k in needs:
        logs[k] = _judged(replace(logs[k], faults=(first, *logs[k].faults)))
    for k in beside:
        if refused_fixes(logs[k]) is first:
            others = tuple(f for f in logs[k].faults if f not in (first, logs[k].refused))
            held = {**logs[k].data, "fixes_for": logs[needs[0]].name}
            logs[k] = _judged(replace(logs[k], faults=others, data=held))
    return first


def _judged(one: LogDiagnosis) -> LogDiagnosis:
    return replace(one, fit={use: tuple(_FIT[use](one)) for use in USES})


def _with_fixes(one: LogDiagnosis, other: LogDiagnosis) -> LogDiagnosis:
    """Return a log with the fixes of another file, and what they are against its samples."""
    streams = {**one.streams, "gnss": other.streams["gnss"]}
    clock, found = _fixes_against(streams, one.log)
    found = [f for f in found if f not in (*other.faults, *other.notes)]
    rests = _unmoved(one.rests, streams)
    more = {
        "receiver_clock": clock,
        "fixes_from": other.name,
        "fixes_options": other.data["fixes_options"],
        "stationary": [_rest(one.streams["imu"], rest) for rest in rests],
        "gravity": _gravity(one.streams["imu"], (*one.faults, *one.notes), rests),
    }
    listed = [*one.data["streams"], *(s for s in other.data["streams"] if s["name"] == "gnss")]
    return _judged(
        replace(
            one,
            streams=streams,
            rests=rests,
            faults=(*one.faults, *(f for f in found if f.severity != "note")),
            notes=(*one.notes, *(f for f in found if f.severity == "note")),
            data={**one.data, **more, "streams": listed},
        )
    )


# Reading: every stream, with the answers to open questions as inferred.


def _reader(log: LogTable) -> tuple[str, Reader | None]:
    path = Path(log.path)
    if log.format in READERS:
        return str(log.format), READERS[str(log.format)]
    if not path.exists():
        return "", None
    return reader_of(path)


@dataclass(frozen=True, eq=False)
class _Inertial:
    """Inertial samples of a log, or why there are none."""

    log: LogTable
    recording: Recording | None
    imu: pd.DataFrame | None
    findings: tuple[Finding, ...]
    questions: tuple[Finding, ...]
    answers: dict[str, str]
    refused: Finding | None


def _inertial(log: LogTable, axes: str | None, gnss: pd.DataFrame | None = None) -> _Inertial:
    """Read inertial samples; open questions are answered as inferred, and listed.

    `gnss`: fixes whose turns may answer the unit of a gyro.
    """
    questions: list[Finding] = []
    answers: dict[str, str] = {}
    refused = None
    for _ in range(ROUNDS):
        try:
            recording, imu, findings = body_record(log, AxesTable(axes=axes), answers)
            return _Inertial(log, recording, imu, findings, tuple(questions), answers, None)
        except DataError as error:
            refused = error.finding
        if "answers" not in refused.data:
            break
        asked = refused.data["questions"] if refused.code == "io.questions" else [refused]
        new = {q: a for q, a in refused.data["answers"] if answers.get(q) != a}
        if gnss is not None and (unit := _by_turns(log, axes, refused, gnss)):
            asked = [unit if one.quantity == "gyro" else one for one in asked]
            new["gyro_unit"] = str(unit.data["unit"])
        questions += [one for one in asked if one not in questions]
        if not new or PLACEHOLDERS & set(new.values()):
            break
        answers |= new
        log = with_answers(log, new)
    return _Inertial(log, None, None, (), tuple(questions), answers, refused)


def _by_turns(
    log: LogTable, axes: str | None, refused: Finding, gnss: pd.DataFrame
) -> Finding | None:
    def fixes_of(recording: Recording) -> pd.DataFrame:
        return on_clock_of(gnss, recording.imu)[0]

    return gyro_unit_by_turns(log, AxesTable(axes=axes), refused, fixes_of)


def _others(
    log: LogTable, reader: Reader | None, recording: Recording | None, fixes: FixesTable | None
) -> tuple[dict[str, pd.DataFrame], list[Finding]]:
    """Read fixes, reference and the streams of other sensors."""
    streams: dict[str, pd.DataFrame] = {}
    findings: list[Finding] = []
    held = {} if reader is None else reader.streams
    if "gnss" in held or TABLE in held:
        options = replace(
            GnssOptions(format=log.format) if fixes is None else fixes.options(),
            unstated_position_sd=CODE_POSITION_SD,
            unstated_velocity_sd=CODE_VELOCITY_SD,
            repair=log.repair,
        )
        try:
            try:
                streams["gnss"] = read_gnss(log.path, options)
            except DataError as error:
                if error.finding.code in ABSENT:
                    raise
                streams["gnss"] = read_gnss(log.path, replace(options, repair=True))
                findings.append(error.finding.replace(severity="warning"))
            findings += streams["gnss"].attrs["findings"]
        except DataError as error:
            # A table of samples need not be one of fixes, unless an answer makes it one.
            certain = "gnss" in held or recording is None or "flags" in error.finding.data
            certain |= error.finding.code == "io.fixes-without-height"
            if error.finding.code not in ABSENT and certain:
                findings.append(error.finding.replace(severity="error", stream="gnss"))
    if recording is not None and recording.truth is not None:
        streams["reference"] = recording.truth
    elif "reference" in held or TABLE in held:
        try:
            streams["reference"] = read_trajectory(log.path)
            findings += streams["reference"].attrs.get("findings", ())
        except DataError as error:
            if "reference" in held and error.finding.code not in ABSENT:
                findings.append(error.finding.replace(severity="warning"))
            if TABLE in held and recording is None and "gnss" not in streams:
                with suppress(DataError):
                    streams["reference"] = read_truth(Path(log.path))
    if recording is not None and recording.wheel is not None:
        streams["wheel"] = wheel_table(recording)
    for name in ("magnetometer", "barometer", "wheel", "heading"):
        if name not in held:
            continue
        try:
            streams[name] = read_stream(log.path, name, log.format)
            findings += streams[name].attrs["findings"]
        except NoStreamError:
            continue
        except DataError as error:
            findings.append(error.finding.replace(severity="warning"))
    # A stream that shares the reading of another has its findings, too.
    return streams, list(dict.fromkeys(findings))


def _stated_record(path: str) -> CrashRecord | None:
    """Return a record whose format says that it is of a crash; None of any other file.

    DataError: it is one, and cannot be read.
    """
    from strapdown.formats.crash_records import read_crash_record, stated_format

    return None if stated_format(Path(path)) is None else read_crash_record(path)


def _format(form: str, reader: Reader | None, record: CrashRecord | None) -> dict[str, str] | None:
    """Return name and title of the format that a log was read by."""
    if record is not None:
        from strapdown.formats.crash_records import CRASH_READERS

        return {"name": record.format, "title": CRASH_READERS[record.format].title}
    return None if reader is None else {"name": form, "title": reader.title}


def _columns(path: str, form: str) -> RawLog | None:
    """Return the raw columns of a table that could not be read as a log."""
    try:
        raw = open_stream(path, "imu", form or None)
    except DataError:
        return None
    return raw if isinstance(raw, RawLog) and raw.columns else None


def _crash_record(path: str, lacks: bool, *, struck: bool) -> int | None:
    """Return the number of channels that the file has as a crash record.

    `lacks`: whether it is a table without the columns of a sensor, of which any may be one of a
    crash; otherwise its channels must say that they are. `struck`: only if its accelerations, in
    whatever unit, exceed their usual size as in an impact. None where no channel can be an
    acceleration, a rate or a velocity, as in a table of attitudes.
    """
    from strapdown.formats.crash_records import read_crash_record

    try:
        channels = read_crash_record(path).channels
        forces = [c.load()[1] for c in channels if struck and c.quantity == "acceleration"]
    except StrapdownError:
        return None
    if struck and forces:
        size = np.sqrt(sum(np.square(force) for force in forces))
        if not size.max() > STRUCK * np.median(size):
            return None
    quantities = {one.quantity for one in channels}
    useful = quantities - {"time", "counter", "other"}
    return len(channels) if (useful if lacks else useful - {""}) else None


# Checks across channels and streams.


def _channels(
    imu: pd.DataFrame,
) -> tuple[ImuHealth | None, tuple[RestStretch, ...], list[Finding]]:
    """Test channels and sampling, and find rests."""
    if len(imu) < LEAST_SAMPLES:
        return None, (), []
    health = check_imu_channels(imu)
    silent = {f.channel for f in health.faults if f.kind in ("missing", "stuck", "dead")}
    sampling = check_sampling(imu, [name for name in health.channels if name not in silent])
    # Samples that are held step, and channels are compared with one another.
    held = any(f.code == "sensors.samples-held" for f in sampling)
    faults = [f for f in health.faults if f.kind != "noisy" or not held]
    return health, find_rests_of_every_grade(imu), [*longest_faults(imu, faults), *sampling]


def _unmoved(
    rests: tuple[RestStretch, ...], streams: Mapping[str, pd.DataFrame]
) -> tuple[RestStretch, ...]:
    """Rests until the fixes in them move, and in which the magnetic field does not turn.

    A steady turn and a constant speed are still to gyros and accelerometers, too.
    """
    imu = streams["imu"]
    rests = tuple(rest for rest in rests if not field_turned(imu, rest))
    if "gnss" not in streams:
        return rests
    fixes = _comparable(streams)
    kept, time = [], index_of(fixes)
    for rest in rests:
        inside = (time >= rest.start) & (time <= rest.end)
        moved = first_motion(fixes[inside])[0] if inside.sum() > 1 else None
        if moved is None:
            kept.append(rest)
            continue
        end = float(time[inside][max(moved - MARGIN, 0)])
        if end - rest.start >= LEAST_LENGTH:
            kept.append(rest_between(imu, rest.start, end, grade=rest.grade))
    return tuple(kept)


def _fixes_against(
    streams: Mapping[str, pd.DataFrame], log: LogTable
) -> tuple[dict[str, float | None] | None, list[Finding]]:
    """Check fixes by themselves and against the samples; return the offset of the clocks, too.

    `log`: which part of the samples was asked for.
    """
    gnss, imu = streams.get("gnss"), streams.get("imu")
    if gnss is None:
        return None, []
    found: list[Finding] = []
    if imu is None:
        try:
            return None, receiver_findings(gnss)
        except DataError as error:
            return None, [error.finding]
    try:
        fixes, shifted = on_clock_of(gnss, imu)
        found += [shifted] if shifted else []
        found += receiver_findings(fixes, imu, part=log.part_s(index_of(imu)[0]))
        # As `init navigate` proposes it.
        offset = clock_offset(without_repeats(fixes)[0], imu, sure_delay(fixes))
        found += find_time_offset(fixes, offset)
    except DataError as error:
        return None, [*found, error.finding]
    if offset is None:
        return None, found
    return {"offset_s": offset.offset, "sd_s": offset.sd, "explained": offset.share}, found


def _reference_against(streams: Mapping[str, pd.DataFrame]) -> list[Finding]:
    """Check whether the reference in a log rotates as its gyro does."""
    if "reference" not in streams:
        return []
    try:
        reference, shifted = on_clock_of(streams["reference"], streams["imu"])
    except DataError as error:
        return [error.finding.replace(severity="warning")]
    contradicted = rotation_contradicted(streams["imu"], reference)
    return [one for one in (shifted, contradicted) if one is not None]


def _between(logs: Sequence[LogDiagnosis]) -> list[Finding]:
    """Compare the clocks of each log of inertial samples with those of the other logs."""
    found: list[Finding] = []
    bases = [one for one in logs if "imu" in one.streams]
    for base in bases:
        for other in logs:
            lent = other.name == base.data["fixes_from"] or other.data["fixes_from"] is not None
            if other is base or lent or "gnss" not in other.streams:
                continue
            with_base = {**other.streams, "imu": base.streams["imu"]}
            _, said = _fixes_against(with_base, base.log)
            own = set(other.faults) | set(other.notes)
            found += [f for f in said if f not in own]
    if len(bases) > 1:
        from strapdown.evaluation.second_log import align_second_log
    for k, base in enumerate(bases):
        for other in bases[k + 1 :]:
            try:
                fit = align_second_log(base.streams["imu"], other.streams["imu"])
            except DataError as error:
                add_note(
                    found,
                    "doctor.logs-not-aligned",
                    file=base.name,
                    quantity="time",
                    other=other.name,
                    reason=error.finding,
                )
                continue
            apart = abs(fit.offset) > max(3.0 * fit.offset_sd, 0.02)
            add_warning(
                found,
                "doctor.logs-apart" if apart else "doctor.logs-on-one-clock",
                severity="warning" if apart else "note",
                offset=fit.offset,
                sd=fit.offset_sd,
                drift_ppm=fit.drift_ppm,
                drift_sd_ppm=fit.drift_sd_ppm,
                file=base.name,
                quantity="time",
                other=other.name,
            )
    return found


def _impact(imu: pd.DataFrame) -> dict[str, float] | None:
    """Find the largest change of velocity within 150 ms, without the mean force before it."""
    time = index_of(imu)
    if ACCEL[0] not in imu.columns or time[-1] - time[0] < BEFORE + EVENT:
        return None
    force = values_of(imu, ACCEL)
    gained = running_integral(time, force, means=imu.attrs["sampling"] == "mean")
    begin = np.flatnonzero(time >= time[0] + BEFORE)
    end = np.searchsorted(time, time[begin] + EVENT, side="right") - 1
    before = np.searchsorted(time, time[begin] - BEFORE)
    begin, end, before = (k[before < begin] for k in (begin, end, before))
    if not begin.size:
        return None
    usual = (gained[begin] - gained[before]) / (time[begin] - time[before])[:, None]
    lasting = (time[end] - time[begin])[:, None]
    change = np.linalg.norm(gained[end] - gained[begin] - usual * lasting, axis=1)
    # A step across a gap integrates what was not measured.
    steps = np.diff(time)
    long = np.concatenate([[0], np.cumsum(steps > EVENT)])
    change[(long[end] > long[before]) | (end <= begin)] = 0.0
    k = int(change.argmax())
    size = np.linalg.norm(force, axis=1)
    return {
        "delta_v_m_per_s": float(change[k]),
        "at_s": float(time[begin[k]]),
        "largest_m_per_s2": float(size.max()),
    }


# The measurements, as plain data.


def _stream(name: str, table: pd.DataFrame) -> dict[str, Any]:
    time = index_of(table)
    gaps = find_gaps(time) if (np.diff(time) > 0.0).all() else []
    lost = math.fsum(g.length - g.usual for g in gaps)
    lasting = float(time[-1] - time[0]) - math.fsum(g.length for g in gaps)
    clock = clock_of(table)
    return {
        "name": name,
        "rows": len(time),
        "from_s": float(time[0]),
        "to_s": float(time[-1]),
        "rate_hz": (len(time) - 1 - len(gaps)) / lasting if lasting > 0.0 else None,
        "gaps": len(gaps),
        "longest_gap_s": max((g.length for g in gaps), default=0.0),
        "lost_s": lost,
        "clock": clock.name,
        "clock_origin_s": clock.origin,
        "columns": [str(c) for c in table.columns],
    }


def _steps(imu: pd.DataFrame) -> dict[str, float]:
    steps = np.diff(index_of(imu))
    quantiles = np.quantile(steps, [0.0, 0.01, 0.5, 0.99, 1.0])
    names = ("least_s", "low_1_percent_s", "median_s", "high_1_percent_s", "largest_s")
    return {**dict(zip(names, quantiles.tolist(), strict=True)), "sd_s": float(steps.std())}


def _channel_facts(imu: pd.DataFrame, health: ImuHealth) -> dict[str, dict[str, Any]]:
    facts: dict[str, dict[str, Any]] = {}
    for name in health.channels:
        values = imu[name].to_numpy(dtype=np.float64)
        facts[name] = {
            "unit": "rad/s" if name in GYRO else "m/s2",
            "least": float(values.min()),
            "mean": float(values.mean()),
            "largest": float(values.max()),
            "noise": health.noise[name],
            "quantization": quantization_step(values),
            "faults": [f.kind for f in health.of(name)],
        }
    return facts


def _rest(imu: pd.DataFrame, rest: RestStretch) -> dict[str, Any]:
    """Describe a rest; densities are of the white noise, by second differences."""
    part = imu[(imu.index >= rest.start) & (imu.index <= rest.end)]
    step = float(np.median(np.diff(index_of(part))))

    def density(columns: list[str]) -> list[float]:
        return [float(x) for x in white_sd(values_of(part, columns)) * math.sqrt(step)]

    force = rest.accel_mean
    return {
        "from_s": rest.start,
        "to_s": rest.end,
        "grade": rest.grade,
        "gyro_mean_rad_per_s": list(rest.gyro_mean),
        "gyro_mean_sd_rad_per_s": list(rest.gyro_mean_sd or ()),
        "gyro_sd_rad_per_s": list(rest.gyro_sd),
        "gyro_density_rad_per_s_per_sqrt_hz": density(GYRO),
        "accel_size_m_per_s2": None if force is None else float(np.linalg.norm(force)),
        "accel_sd_m_per_s2": list(rest.accel_sd or ()),
        "accel_density_m_per_s2_per_sqrt_hz": [] if force is None else density(ACCEL),
    }


def _gravity(
    imu: pd.DataFrame | None, findings: Iterable[Finding], rests: Sequence[RestStretch]
) -> dict[str, Any] | None:
    """Whether the specific force has gravity, with its size at rest."""
    if imu is None or ACCEL[0] not in imu.columns:
        return None
    removed = any(f.code == "io.no-gravity" for f in findings)
    at_rest = [float(np.linalg.norm(r.accel_mean)) for r in rests if r.accel_mean is not None]
    usual = float(np.median(np.linalg.norm(values_of(imu, ACCEL), axis=1)))
    return {
        "included": not removed,
        "median_m_per_s2": usual,
        "at_rest_m_per_s2": float(np.median(at_rest)) if at_rest else None,
    }


def _temperature(streams: Mapping[str, pd.DataFrame]) -> dict[str, float] | None:
    for table in streams.values():
        if "temperature" in table.columns:
            values = table["temperature"].to_numpy(dtype=np.float64)
            values = values[np.isfinite(values)]
            if values.size:
                return {"least_degc": float(values.min()), "largest_degc": float(values.max())}
    return None


def _ranges(raw: RawLog) -> list[dict[str, Any]]:
    """Name, first value and range of each raw column."""
    rows = []
    for name, values in raw.columns.items():
        row: dict[str, Any] = {"name": name, "unit": raw.units.get(name)}
        row["first"] = str(values[0]) if values.size else ""
        if values.dtype.kind in "iuf" and np.isfinite(values.astype(np.float64)).any():
            row |= {"least": float(np.nanmin(values)), "largest": float(np.nanmax(values))}
        rows.append(row)
    return rows


# The uses for which the log suffices.


def _samples(one: LogDiagnosis) -> list[Finding]:
    """Reasons that hold for every use of inertial samples."""
    imu = one.streams.get("imu")
    if imu is None:
        reasons = [q.replace(severity="error") for q in one.questions]
        if not reasons and one.refused is not None and one.refused.code not in ABSENT:
            reasons = [one.refused]
        return reasons or [Finding("doctor.no-rates", severity="error", file=one.name)]
    if inferred := {q: a for q, a in one.answers.items() if q != "repair"}:
        found = [
            Finding(
                "doctor.answers-inferred",
                file=one.name,
                answers=[f"{q} = {a}" for q, a in inferred.items()],
            )
        ]
    else:
        found = []
    return [*found, *_lost_channels(one, imu)]


def _lost_channels(one: LogDiagnosis, imu: pd.DataFrame) -> list[Finding]:
    """Channels that do not read the motion: lost, or the faults of a part of the samples."""
    if one.health is None:
        return []
    most_of = most_unusable(values_of(imu, one.health.channels))
    lost: dict[str, tuple[int, bool]] = {}
    for (name, kind), count in unusable_samples(imu, one.health.faults).items():
        if (most := most_of.get(kind)) is not None:
            before, gone = lost.get(name, (0, False))
            lost[name] = before + count, gone or count > most * len(imu)
    found = [f for f in one.faults if f.code == "io.rate-at-full-scale"]
    for name, (count, gone) in lost.items():
        if gone:
            percent = 100.0 * count / len(imu)
            where: dict[str, Any] = {"file": one.name, "quantity": name}
            found.append(Finding("doctor.channel-lost", severity="error", percent=percent, **where))
            continue
        parts = [f for f in one.faults if f.quantity == name and f.data.get("kind") in most_of]
        found += [f for f in parts if f not in found]
    return found


def _attitude(one: LogDiagnosis) -> list[Finding]:
    found = _samples(one)
    imu = one.streams.get("imu")
    if imu is None:
        return found
    rate = _rate(one)
    if rate < LEAST_RATE:
        severity: Severity = "error" if rate < USELESS_RATE else "warning"
        found.append(Finding("doctor.rate-low", severity=severity, file=one.name, rate_hz=rate))
    else:
        said = Finding("doctor.rates-on-three-axes", severity="note", file=one.name, rate_hz=rate)
        found.append(said)
    gravity = one.data["gravity"]
    if gravity is not None and gravity["included"]:
        said = Finding("doctor.levels-by-gravity", severity="note", file=one.name)
        still = [rest for rest in one.rests if rest.grade == "still"]
        start = begins_at_rest(still, index_of(imu)[0])
        if start is not None and start.accel_mean is not None and "reference" not in one.streams:
            try:
                rotation.level(start.accel_mean)
            except DataError as error:
                said = error.finding.replace(file=one.name)
        found.append(said)
    else:
        found.append(_without_force(one, "doctor.no-leveling", "warning"))
    found.append(_bias(one))
    found += [f for f in one.faults if f.code in _LIMITS]
    return found


def _without_force(one: LogDiagnosis, code: str, severity: Severity) -> Finding:
    """Say that specific force is missing: not logged, or left out for what is open of it."""
    left_out = any(f.code in _OPEN and f.quantity == "accel" for f in one.faults)
    return Finding("doctor.accel-open" if left_out else code, severity=severity, file=one.name)


#: Findings about columns that are, or may be, an accelerometer.
_OPEN = (
    "io.accelerometer-not-read",
    "io.columns-like-accelerometer",
    "io.left-out-unusable",
    "io.left-out-world-axes",
)

#: Motion that is missing, and units and axes that contradict gravity or the course.
_LIMITS = (
    "io.long-gap",
    "io.rows-after-step-back-left-out",
    "io.axes-not-stated-other-up",
    "io.axes-not-stated-y-up",
    "io.axes-not-stated-z-up",
    "io.axes-upside-down",
    "io.force-scale",
    "io.gravity-stood-still",
    "io.gyro-axes-differ",
    "io.gyro-axis-in-other-unit",
    "io.gyro-axis-noise-of-other-unit",
    "io.gyro-scale",
    "io.gyro-turns-against-gravity",
    "navigation.course-shows-gyro-unit",
    "navigation.course-turns",
    "navigation.course-turns-opposite",
    "navigation.forward-axis-elsewhere",
    "navigation.forward-not-along-course",
)


def _rate(one: LogDiagnosis) -> float:
    return next(float(s["rate_hz"]) for s in one.data["streams"] if s["name"] == "imu")


def _decided(one: LogDiagnosis, rest: RestStretch) -> bool:
    """Whether more than gyros and accelerometers show that a rest is one.

    A magnetic field that stays, or fixes over half of it that stay within their errors.
    """
    if set(MAG) <= set(one.streams["imu"].columns):
        return True
    if "gnss" not in one.streams:
        return False
    fixes = _comparable(one.streams)
    time = index_of(fixes)
    inside = (time >= rest.start) & (time <= rest.end)
    if inside.sum() < 2 or np.ptp(time[inside]) < 0.5 * (rest.end - rest.start):
        return False
    way = ways_between(values_of(fixes, GEODETIC)[inside][[0, -1]])
    sd = values_of(fixes, POSITION_SD)[inside][[0, -1], :2].max(axis=1)
    return bool(way[0] <= 2.0 * float(np.hypot(*sd)))


def _comparable(streams: Mapping[str, pd.DataFrame]) -> pd.DataFrame:
    """Fixes on the clock of the samples, with the sd of a code receiver where they state none."""
    fixes = _on_clock(streams["gnss"], streams["imu"])[0].copy()
    sd = values_of(fixes, POSITION_SD)
    fixes[POSITION_SD] = np.where(np.isfinite(sd), sd, CODE_POSITION_SD)
    return fixes


def _bias(one: LogDiagnosis) -> Finding:
    """How well the gyro bias is known from the longest rest."""
    if not one.rests:
        return Finding("doctor.bias-unknown", file=one.name)
    rest = max(one.rests, key=lambda r: r.end - r.start)
    sd = float(np.max(rest.gyro_mean_sd or rest.gyro_sd))
    turn = could_be_a_turn(rest) and not _decided(one, rest)
    return Finding(
        "doctor.bias-or-turn" if turn else "doctor.bias-from-rest",
        severity="warning" if turn else "note",
        file=one.name,
        bias=float(np.degrees(np.linalg.norm(rest.gyro_mean))),
        duration=rest.end - rest.start,
        drift=math.degrees(sd) * 60.0,
    )


def _navigation(one: LogDiagnosis) -> list[Finding]:
    found = _samples(one)
    imu, gnss = one.streams.get("imu"), one.streams.get("gnss")
    gravity = one.data["gravity"]
    if imu is not None and (gravity is None or not gravity["included"]):
        found.append(_without_force(one, "doctor.no-specific-force", "error"))
    if gnss is None and (refused := refused_fixes(one)):
        return [*found, refused]
    if gnss is None:
        log = shlex.quote(one.name)
        return [*found, Finding("doctor.no-fixes", severity="error", file=one.name, log=log)]
    found += [f for f in one.faults if f.code.startswith("navigation.") and f.severity == "error"]
    if imu is None:
        return found
    fixes, _ = _on_clock(gnss, imu)
    stamps, time = index_of(imu), index_of(fixes)
    inside = time[(time >= stamps[0]) & (time <= stamps[-1])]
    if inside.size < 2:
        if not found:
            data = {"count": int(inside.size), "of": len(time)}
            found = [Finding("doctor.too-few-fixes", severity="error", file=one.name, data=data)]
        return found
    sd = values_of(gnss, POSITION_SD)[:, 0]
    finite = sd[np.isfinite(sd)]
    assumed = "position_sd_taken" in gnss.attrs
    add_warning(
        found,
        "doctor.fixes-without-sd" if assumed else "doctor.fixes",
        severity="warning" if assumed else "note",
        file=one.name,
        count=inside.size,
        percent=100.0 * float(inside[-1] - inside[0]) / float(stamps[-1] - stamps[0]),
        sd=float(np.median(finite)) if finite.size else math.inf,
    )
    listed = [f for f in one.faults if f.code.startswith("navigation.") or f.code in _LIMITS]
    found += [f for f in listed if f not in found]
    return found


def refused_fixes(one: LogDiagnosis) -> Finding | None:
    """Return why the fixes in a log could not be read; None if they were, or it has none."""
    if "gnss" in one.streams:
        return None
    return next((f for f in one.faults if f.data.get("stream") == "gnss"), None)


def of_other_file(one: LogDiagnosis, fault: Finding) -> bool:
    """Whether a fault of a log is of the file of fixes beside it, which is refused."""
    return fault.data.get("stream") == "gnss" and fault.file != one.name


def _on_clock(gnss: pd.DataFrame, imu: pd.DataFrame) -> tuple[pd.DataFrame, Finding | None]:
    try:
        return on_clock_of(gnss, imu)
    except DataError:
        return gnss, None


def _crash(one: LogDiagnosis) -> list[Finding]:
    found = _samples(one)
    impact = one.data["impact"]
    if count := one.data["crash_record"]:
        return [Finding("doctor.crash-record", file=one.name, count=count)]
    if "imu" not in one.streams:
        return found
    if impact is None and ACCEL[0] in one.streams["imu"].columns:
        time = index_of(one.streams["imu"])
        data = {"duration": float(time[-1] - time[0]), "needed": BEFORE + EVENT}
        short = Finding("doctor.too-short-for-impact", severity="error", file=one.name, data=data)
        return [*found, short]
    if impact is None:
        return [*found, _without_force(one, "doctor.no-specific-force", "error")]
    change = impact["delta_v_m_per_s"]
    hit = change >= EVENT_DV
    add_warning(
        found,
        "doctor.impact" if hit else "doctor.no-impact",
        severity="warning" if hit else "error",
        file=one.name,
        delta_v=3.6 * change,
        at=impact["at_s"],
        peak=impact["largest_m_per_s2"] / STANDARD_GRAVITY,
    )
    rate = _rate(one)
    if rate < 0.99 * EVENT_RATE:
        found.append(Finding("doctor.rate-low-for-crash", file=one.name, rate_hz=rate))
    found += [f for f in one.faults if f.code == "navigation.channel-fault"]
    return found


_FIT: dict[str, Callable[[LogDiagnosis], list[Finding]]] = {
    "attitude": _attitude,
    "navigation": _navigation,
    "crash": _crash,
}
