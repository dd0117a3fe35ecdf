"""Kinds of runs: the configuration of each, how it is proposed, and its command.

``navigate``, ``align`` and ``crash`` have configuration files of their own. The others take
options; their file here has the same keys under ``[log]``, and becomes these options word by word.
"""

from __future__ import annotations

import math
import shlex
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, StrictBool

from strapdown.config import toml_text
from strapdown.config.alignment import AlignmentSpec
from strapdown.config.crash_case import CaseSpec
from strapdown.config.logs import AxesTable, FixesTable, LogTable, flags_of
from strapdown.config.navigation import NavigationSpec
from strapdown.config.reading import FileSpec
from strapdown.config.spec import (
    FileName,
    Latitude,
    Number,
    Positive,
    Spec,
    Word,
    accepted_by,
    specify,
)
from strapdown.config.toml_text import Page, inline, string
from strapdown.errors import DataError, Finding
from strapdown.formats.crash_record import CrashRecord
from strapdown.sensors.bridge import target_of
from strapdown.studio import questions


@dataclass(frozen=True)
class Draft(toml_text.Draft):
    """A proposed configuration in the studio.

    `choose`: questions about the files, without whose answers it has no text; `again`: questions
    whose answers are proposed anew.
    """

    choose: tuple[dict[str, Any], ...] = ()
    again: tuple[dict[str, Any], ...] = ()


Paths = Sequence[Path]
Keys = Mapping[str, Any]


@dataclass(frozen=True)
class Kind:
    """One kind of run.

    Attributes
    ----------
    title, what, needs : str
        For people: name, what is found, and what is needed.
    form : type of FileSpec
    draft : callable
        Paths, keys of ``[log]`` and axes to drafts.
    command : callable
        Specification and name of the run to the words of the command, and the name of the file that
        it reads, empty if none.
    options : tuple of str
        Flags that may be added.
    """

    title: str
    what: str
    needs: str
    form: type[FileSpec]
    draft: Callable[[Paths, Keys, str | None], list[Draft]]
    command: Callable[[Any, str], tuple[list[str], str]]
    options: tuple[str, ...] = ("--no-report", "--force", "--verbose")


# --- kinds with a configuration file ------------------------------------------------------


def _log_table(path: Path, keys: Keys) -> LogTable:
    own, _ = questions.of_file(keys, None, path.as_posix())
    return specify(LogTable, path=str(path), **questions.of_each(own)[0])


def _axes_of(path: Path, keys: Keys, axes: str | None) -> str | None:
    """Axes of a log, as stated of it alone or of all."""
    return questions.of_file(keys, axes, path.as_posix())[1]


@dataclass(frozen=True)
class Roles:
    """Role of each of several files.

    Attributes
    ----------
    samples : Path
        The log of inertial samples.
    fixes, reference : Path or None
        The file of fixes, and the one of a reference, which may be the log itself.
    within : bool
        Whether the reference is the attitude in the log itself, which is read with its samples.
    asked : tuple of dict
        Questions, where several files could be meant and none was said to be.
    findings : tuple of Finding
        Of files that are not used.
    """

    samples: Path
    fixes: Path | None = None
    reference: Path | None = None
    within: bool = False
    asked: tuple[dict[str, Any], ...] = ()
    findings: tuple[Finding, ...] = ()


#: Kinds whose results are compared with a reference.
COMPARED = ("navigate", "attitude")


def _compared(kind: str, path: Path, columns: set[str], *, within: bool) -> bool:
    """Whether a kind can be compared with a reference that has these columns.

    `within`: whether it is in the log itself, whose attitude is read with its samples.
    """
    from strapdown.formats.references import read_truth

    if kind != "attitude":
        return kind == "navigate" and {"lat", "lon"} <= columns
    if within and "q_w" in columns:
        return True
    with suppress(DataError):
        return path.is_file() and not read_truth(path).empty
    return False


def _roles(kind: str, paths: Paths, keys: Keys, axes: str | None) -> Roles:
    """Return what each file is for, by what `look` found in it; a person may have said it."""
    from strapdown.studio.look import files_of_recorders, files_read, look, unused_files

    own = {path.as_posix(): path for path in files_of_recorders(paths)}
    found = look(Path.cwd(), list(own), keys, axes)
    held: dict[str, dict[str, set[str]]] = {name: {} for name in own}
    for one in found["streams"]:
        held[one["file"]][one["name"]] = {column["name"] for column in one["columns"]}
    asks = [(q["file"], q["key"]) for q in found["questions"] if not q.get("optional")]
    # An open question about heights is one about fixes.
    of_fixes = {file for file, key in asks if key == questions.HEIGHTS}
    of_samples = {file for file, key in asks if key != questions.HEIGHTS}
    inertial = [name for name in own if "imu" in held[name] or name in of_samples]
    asked: list[dict[str, Any]] = []

    def one_of(role: str, names: list[str], none: str = "") -> str | None:
        said = keys.get(questions.ROLES[role])
        if said is not None and (said in own or said == ""):
            return said or None
        if len(names) > 1:
            asked.append(questions.role_question(role, names, none=none))
        return names[0] if names else None

    samples = one_of("samples", inertial) or next(iter(own))
    others = [name for name in own if name not in inertial]
    references: list[str] = []
    other: list[str] = []
    for name in (samples, *others):
        if "reference" in held[name]:
            fits = _compared(kind, own[name], held[name]["reference"], within=name == samples)
            (references if fits else other).append(name)
    fixes = reference = None
    if kind == "navigate":
        # A trajectory is fixes, too, if one reads its positions alone: where there are no others.
        with_fixes = [n for n in (samples, *others) if "gnss" in held[n] or n in of_fixes]
        plain = [name for name in with_fixes if name == samples or name not in references]
        if not plain and len(with_fixes) == 1 and questions.ROLES["fixes"] not in keys:
            asked.append(questions.either_question(with_fixes[0]))
        fixes = one_of("fixes", plain or with_fixes)
    if kind in COMPARED:
        left = [name for name in references if name != fixes or name == samples]
        reference = one_of("reference", left, none="None of them")
    used = {samples, fixes, reference}
    if kind in ("allan", "calibrate"):
        used |= set(inertial)
    findings = [
        Finding("studio.file-not-used", severity="note", file=name)
        for name in own
        if name not in used and not (kind in COMPARED and name in other)
    ]
    findings += unused_files(paths, files_read(list(own.values())))
    if kind in COMPARED:
        data = {"kind": KINDS[kind].title.lower()}
        findings += [
            Finding("studio.reference-not-used", severity="note", file=name, data=data)
            for name in other
        ]
    return Roles(
        own[samples],
        None if fixes is None else own[fixes],
        None if reference is None else own[reference],
        reference == samples and "q_w" in held[samples].get("reference", set()),
        tuple(asked),
        tuple(findings),
    )


def _draft_navigation(paths: Paths, keys: Keys, axes: str | None) -> list[Draft]:
    from strapdown.systems.navigation_draft import draft_navigation

    roles = _roles("navigate", paths, keys, axes)
    if roles.asked:
        return [Draft("", choose=roles.asked)]
    log = roles.samples
    fixes = None if roles.fixes == log else roles.fixes
    of_fixes = questions.of_each(questions.of_file(keys, None, (fixes or log).as_posix())[0])[1]
    axes = _axes_of(log, keys, axes)
    known = fixes is not None or of_fixes
    gnss = specify(FixesTable, path=str(fixes or log), **of_fixes) if known else None
    truth = roles.reference
    table = _log_table(log, keys)
    foot = bool(keys.get(questions.FOOT))
    made = draft_navigation(table, folder=Path(), axes=axes, gnss=gnss, truth=truth, foot=foot)
    # Whoever walks with a receiver is followed by its fixes.
    ask = foot or roles.fixes is None
    return [replace(_drafted(made, roles), again=(questions.foot_question(foot),) if ask else ())]


def _draft_alignment(paths: Paths, keys: Keys, axes: str | None) -> list[Draft]:
    from strapdown.systems.alignment_draft import draft_alignment

    roles = _roles("align", paths, keys, axes)
    if roles.asked:
        return [Draft("", choose=roles.asked)]
    log = roles.samples
    made = draft_alignment(_log_table(log, keys), folder=Path(), axes=_axes_of(log, keys, axes))
    return [_drafted(made, roles)]


def _drafted(made: Any, roles: Roles) -> Draft:
    """A proposed configuration, with what is said of the files that it does not use."""
    draft = Draft(**vars(made))
    return replace(draft, findings=(*draft.findings, *roles.findings))


def _draft_crash(paths: Paths, keys: Keys, axes: str | None) -> list[Draft]:
    from strapdown.crash.record_parts import StatedReading
    from strapdown.crash.template import draft_cases
    from strapdown.formats.crash_records import read_crash_record
    from strapdown.studio.look import files_of_recorders, unused_files

    records: list[CrashRecord] = []
    unread: list[DataError] = []
    seen: set[Path] = set()
    for path in files_of_recorders(paths):
        # A record of several files is one, whichever are chosen.
        if path.resolve() not in seen:
            try:
                record = read_crash_record(path)
            except DataError as error:
                unread.append(error)
            else:
                records.append(record)
                seen |= {file.resolve() for file in record.files}
            seen.add(path.resolve())
    if unread and not records:
        raise unread[0]
    unused = (*(error.finding for error in unread), *unused_files(paths, seen))
    stated, beside = {}, []
    for record in records:
        own, own_axes = questions.of_file(keys, axes, record.path.as_posix())
        taken = {k: str(own[k]) for k in ("accel_unit", "gyro_unit") if k in own}
        stated[record.path] = StatedReading(axes=own_axes or "", **taken)
        if left := [k for k in questions.of_each(own)[0] if k not in taken and k not in PART]:
            name = record.path.as_posix()
            beside.append(Finding("studio.reading-not-used", file=name, data={"keys": left}))
    begin, end = keys.get("from_s"), keys.get("to_s")
    part: tuple[Finding, ...] = ()
    if begin is not None or end is not None:
        data = {"begin": begin or 0.0, "end": math.inf if end is None else end}
        part = (Finding("studio.part-not-used", data=data),)
    more = (*beside, *unused, *part)
    return [
        Draft(**{**vars(one), "findings": (*one.findings, *more), "name": one.vehicle})
        for one in draft_cases(records, folder=Path(), stated=stated)
    ]


#: Keys of the part of a log to use.
PART = ("from_s", "to_s", "duration_s")


def _by_file(command: str) -> Callable[[Any, str], tuple[list[str], str]]:
    """The command that runs a configuration file, which is named after the run."""

    def words(_: Any, name: str) -> tuple[list[str], str]:
        return [command, f"{name}.toml"], f"{name}.toml"

    return words


# --- kinds with options -------------------------------------------------------------------


class LogsTable(LogTable):
    """Logs that are read in the same way."""

    also: tuple[FileName, ...] = Field(default=(), description="further logs of the same sensor")


class AttitudeTable(Spec):
    """What is compared, and how."""

    tolerance_deg: Positive = Field(default=1.0, description="the largest acceptable error")
    rates_hz: tuple[Positive, ...] = Field(
        default=(), description="lower rates to try; the full rate and its halves, if empty"
    )
    algorithms: tuple[Word, ...] = Field(
        default=(), description="names with options, or all; one of each, if empty"
    )
    interpolation: Literal["linear", "cubic"] = Field(
        default="linear", description="how rates run between their stamps"
    )
    reference: tuple[Word, ...] = Field(
        default=(),
        description="what is known of the motion: 'end same as start', 'rests', "
        "'12.5 roll 0 pitch 0 heading 90', or a file of such lines or of an attitude truth",
    )
    initial: Word = Field(
        default="auto", description="auto, truth, level, zero, or roll,pitch,heading in deg"
    )
    gyro_bias: Word = Field(default="auto", description="auto, none, rest, rests, or 'x,y,z deg/s'")
    magnetometer: Word = Field(
        default="auto", description="auto, raw, or a log turned through all directions"
    )
    lat_deg: Latitude | None = Field(default=None, description="latitude, for true headings")
    lon_deg: Annotated[Number, Field(ge=-180.0, le=360.0)] | None = Field(
        default=None, description="longitude, for true headings"
    )
    peers: tuple[Word, ...] = Field(
        default=(), description="other libraries to lay beside: vqf, imufusion, ahrs, or all"
    )


class AttitudeFile(FileSpec):
    """A comparison of attitude algorithms over a log."""

    called = "attitude"

    log: LogTable
    axes: AxesTable = AxesTable()
    attitude: AttitudeTable = AttitudeTable()


class AllanTable(Spec):
    """How the logs are taken."""

    at_rest: StrictBool = Field(
        default=False, description="take the whole part as at rest, without a test"
    )
    program: Annotated[Word, accepted_by(target_of)] | None = Field(
        default=None, description="program whose noise parameters are given, too, such as KF-GINS"
    )


class AllanFile(FileSpec):
    """Logs at rest, for the noise of their sensor."""

    called = "allan"

    log: LogsTable
    axes: AxesTable = AxesTable()
    allan: AllanTable = AllanTable()


class CalibrateTable(Spec):
    """What was done with the sensor, and what is known of it."""

    procedure: Literal["positions", "six-position", "turns", "rate-table"] | None = Field(
        default=None, description="what was done; by the logs, if not stated"
    )
    turns: Word | None = Field(
        default=None, description="known turns: 360, or 'x 720, y 720' in order"
    )
    turn_sd_deg: Positive = Field(default=3.0, description="standard deviation of the known angles")
    pose_sd_deg: Positive = Field(
        default=2.0, description="standard deviation of the faces in six positions"
    )
    gravity_m_per_s2: Annotated[Number, Field(ge=9.5, le=10.0)] | None = Field(
        default=None, description="local gravity; by latitude and height, if not stated"
    )
    lat_deg: Latitude | None = Field(default=None, description="latitude, for gravity")
    alt_m: Number | None = Field(default=None, description="height, for gravity")
    sensor: FileName | None = Field(
        default=None, description="a sensor of the catalogue, or a .toml file of your own"
    )


class CalibrateFile(FileSpec):
    """Logs of one sensor at rest in poses, and turned."""

    called = "calibrate"

    log: LogsTable
    calibrate: CalibrateTable = CalibrateTable()


def _draft_of_options(table: str, what: str, example: Iterable[tuple[str, str, str]]) -> Any:
    """Return the draft of a kind with options: the log as it was read, and keys with defaults."""

    def draft(paths: Paths, keys: Keys, axes: str | None) -> list[Draft]:
        from strapdown.studio.look import files_of_recorders

        paths = files_of_recorders(paths)
        roles = _roles(table, paths, keys, axes)
        if table == "attitude" and roles.asked:
            return [Draft("", choose=roles.asked)]
        unused = {f.file for f in roles.findings}
        first = roles.samples
        stated_axes, axes = axes, _axes_of(first, keys, axes)
        others = [one for one in paths if one != first and one.as_posix() not in unused]
        spec = _log_table(first, keys)
        page = Page()
        page.say(what.format(name=first.name))
        page.table("[log]")
        page.key("path", string(first.as_posix()))
        if others and table != "attitude":
            listed = ", ".join(string(one.as_posix()) for one in others)
            page.key("also", f"[{listed}]", "further logs of the same sensor")
        for key, value in spec.plain().items():
            if key not in ("path", "columns") and value is not False:
                page.key(key, string(value) if isinstance(value, str) else _toml(value))
        if spec.columns:
            page.key("columns", inline(spec.columns))
        if axes is not None:
            page.table("[axes]")
            page.key("axes", string(axes))
        page.table(f"[{table}]")
        for key, value, remark in example:
            page.key(key, value, remark)
        alike = questions.of_file(keys, axes, first.as_posix())
        apart = [] if table == "attitude" else others
        findings = [
            Finding(
                "studio.read-as-the-first",
                file=one.as_posix(),
                data={"first": first.as_posix()},
            )
            for one in apart
            if questions.of_file(keys, stated_axes, one.as_posix()) != alike
        ]
        found = []
        if roles.reference is not None and not roles.within:
            listed = string(roles.reference.as_posix())
            page.key("reference", f"[{listed}]", "the attitude to compare with")
            found.append(
                f"{roles.reference.as_posix()}: a reference, to compare the attitudes with"
            )
        return [Draft(page.text, tuple(found), findings=(*roles.findings, *findings))]

    return draft


def _toml(value: Any) -> str:
    return str(value).lower() if isinstance(value, bool) else repr(value)


def _logs(spec: Any) -> list[str]:
    return [_as_argument(path) for path in (spec.log.path, *getattr(spec.log, "also", ()))]


def _as_argument(path: str) -> str:
    """Path as a word of a command, from the folder of the studio; never an option."""
    there = Path(path)
    own = there.relative_to(Path.cwd()) if there.is_relative_to(Path.cwd()) else there
    return f"./{own.as_posix()}" if str(own).startswith("-") else own.as_posix()


def _reading(spec: Any) -> list[str]:
    log, axes = spec.log, getattr(spec, "axes", None)
    if log.calibration is not None:
        log = log.model_copy(update={"calibration": _as_argument(log.calibration)})
    return shlex.split(flags_of(log, None if axes is None else axes.axes))


def _flags(values: Mapping[str, Any]) -> list[str]:
    """Options with values; those that are None, False or empty are left out.

    One that begins with a minus sign is joined to its option, and is none itself.
    """
    words: list[str] = []
    for flag, value in values.items():
        if value is None or value is False or value == "":
            continue
        words.append(flag if value is True else f"{flag}={value}")
    return words


def _attitude_words(spec: Any, _: str) -> tuple[list[str], str]:
    own, usual = spec.attitude, AttitudeTable()
    flags: dict[str, Any] = {
        f"--{key.replace('_', '-')}": getattr(own, key)
        for key in ("tolerance_deg", "interpolation", "initial", "gyro_bias", "magnetometer")
        if getattr(own, key) != getattr(usual, key)
    }
    flags |= {
        "--algorithms": " ".join(own.algorithms),
        "--rates": " ".join(f"{rate:g}" for rate in own.rates_hz),
        "--lat": own.lat_deg,
        "--lon": own.lon_deg,
        "--peers": " ".join(own.peers),
    }
    words = ["attitude", *_logs(spec), *_reading(spec), *_flags(flags)]
    words += [f"--reference={one}" for one in own.reference]
    return words, ""


def _allan_words(spec: Any, _: str) -> tuple[list[str], str]:
    flags = {"--for": spec.allan.program, "--at-rest": spec.allan.at_rest}
    return ["allan", *_logs(spec), *_reading(spec), *_flags(flags)], ""


def _calibrate_words(spec: Any, _: str) -> tuple[list[str], str]:
    own = spec.calibrate
    flags = {
        "--procedure": own.procedure,
        "--turns": own.turns,
        "--turn-sd": None if own.turn_sd_deg == 3.0 else own.turn_sd_deg,
        "--pose-sd": None if own.pose_sd_deg == 2.0 else own.pose_sd_deg,
        "--gravity": own.gravity_m_per_s2,
        "--lat": own.lat_deg,
        "--alt": own.alt_m,
        "--sensor": own.sensor and _as_argument(own.sensor),
    }
    return ["calibrate", *_logs(spec), *_reading(spec), *_flags(flags)], ""


USUAL = Kind.options
KINDS: dict[str, Kind] = {
    "navigate": Kind(
        "Navigation",
        "Position, velocity and attitude over a record, with their uncertainty.",
        "a log of gyros and accelerometers, and satellite fixes in it or in a file of their own.",
        NavigationSpec,
        _draft_navigation,
        _by_file("navigate"),
        (*USUAL, "--smooth"),
    ),
    "attitude": Kind(
        "Attitude",
        "The simplest attitude algorithm, and the lowest sample rate, that are accurate enough.",
        "a log of gyros and, if possible, what is known of the motion: that it ends as it began.",
        AttitudeFile,
        _draft_of_options(
            "attitude",
            "Attitude algorithms compared over {name}.",
            (("tolerance_deg", "1.0", "the largest acceptable error"),),
        ),
        _attitude_words,
        (*USUAL, "--png", "--timing"),
    ),
    "align": Kind(
        "Alignment",
        "Roll, pitch and heading of a body that does not move.",
        "a log of gyros and accelerometers at rest, and the place.",
        AlignmentSpec,
        _draft_alignment,
        _by_file("align"),
    ),
    "crash": Kind(
        "Crash",
        "Delta-V, direction of force, severity and path of a crash, each with its bound.",
        "records of accelerometers on the vehicle, and how it moved before the crash.",
        CaseSpec,
        _draft_crash,
        _by_file("crash"),
    ),
    "allan": Kind(
        "Sensor noise",
        "Allan deviation and noise terms of a sensor, and its file for the other commands.",
        "a log of the unmoved sensor, an hour or more.",
        AllanFile,
        _draft_of_options(
            "allan",
            "Noise of the sensor in {name}, which lay still.",
            (("at_rest", "false", "true: take the whole part as at rest, without a test"),),
        ),
        _allan_words,
    ),
    "calibrate": Kind(
        "Calibration",
        "Bias, scale, misalignment and g-sensitivity of a sensor, each with its bound.",
        "a log of the sensor at rest in nine or more poses, turned quickly between them.",
        CalibrateFile,
        _draft_of_options(
            "calibrate",
            "Calibration of the sensor in {name}: rests in poses, and turns between them.",
            (
                ("turn_sd_deg", "3.0", "standard deviation of known angles"),
                ("pose_sd_deg", "2.0", "standard deviation of the faces in six positions"),
            ),
        ),
        _calibrate_words,
    ),
}
