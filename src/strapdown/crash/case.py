"""Crash case from its file to all results of a report."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pandas as pd

from strapdown.bundle import InputFiles, sha256
from strapdown.config.crash_case import (
    CaseSpec,
    EntrySpec,
    ReferenceSpec,
    TriadSpec,
    UnitSpec,
)
from strapdown.constants import TWO_SIDED_95
from strapdown.crash import case_contact as contact
from strapdown.crash.case_indices import CrashIndex, occupant_indices, vehicle_indices
from strapdown.crash.delta_v import delta_v
from strapdown.crash.delta_v_bound import body_delta_v_bound
from strapdown.crash.entry import Entry
from strapdown.crash.events import EventRule
from strapdown.crash.path import (
    CrashPath,
    PathComparison,
    PathSamples,
    compare_with_reference,
    sample_paths,
)
from strapdown.crash.reconstruction import (
    CrashOptions,
    CrashReconstruction,
    UnitReconstruction,
    reconstruct_crash,
)
from strapdown.crash.severity import (
    SEVERITY_MODELS,
    InjuryRisk,
    SeverityModel,
    find_severity_model,
    injury_risk,
)
from strapdown.errors import ConfigError, DataError, Finding
from strapdown.formats import files_of
from strapdown.formats.aid_table import read_aid_table, read_reference_path
from strapdown.formats.crash_record import CrashRecord
from strapdown.formats.crash_records import read_crash_record
from strapdown.formats.crash_triad import triad_of_channels
from strapdown.formats.gnss_files import read_gnss
from strapdown.progress import Progress, silent
from strapdown.sensors.catalogue import SENSORS, load_sensor
from strapdown.sensors.crash_unit import Assumed, CrashUnit, Mounting, RecordedTriad
from strapdown.sensors.uncertainty import stated_uncertainty
from strapdown.systems.one_thread import one_thread
from strapdown.units import FORCES, SPEEDS, unit_of

if TYPE_CHECKING:
    from strapdown.crash.closure import Blame, Closure
    from strapdown.crash.drive_entry import DriveEntry

# Standard deviation of a speed of the wheels, and of the position of an axle that is stated.
SPEED_SD, AXLE_SD = 0.1, 0.05  # m/s, m
# Most numbers of a Monte Carlo, in a file: 16 GB.
MOST_NUMBERS = 2_000_000_000


@dataclass(frozen=True, eq=False)
class CaseResult:
    """Result of a case.

    Attributes
    ----------
    spec : CaseSpec
        Resolved; a record of several files is named by its folder.
    inputs : tuple of InputFiles
        The case file (role ``case``), records (``record``), sensors, references, fixes.
    records : dict of str to CrashRecord
        By path as in the case.
    units : tuple of CrashUnit
        As read from the records.
    reconstruction : CrashReconstruction
    samples : PathSamples or None
        Monte Carlo samples of the main path.
    severity : tuple of SeverityAnswer
    references : tuple of ReferenceAnswer
        Of the main answer, then of every unit by itself.
    findings : tuple of Finding
        From reading and reconstruction, in this order.
    number : int
        Of its vehicle in the crash, from 1.
    partners : tuple of CaseSpec
        Cases of the other vehicles of the crash, in order.
    closure : Closure or None
        With the other vehicle, the first being that of the first case.
    blame : Blame or None
        What would explain that the two do not close.
    deformation : Deformation
    indices : tuple of CrashIndex
        Of the vehicle in its severest event, by the main answer; then of the occupants whose
        channels the records have.
    """

    spec: CaseSpec
    inputs: tuple[InputFiles, ...]
    records: dict[str, CrashRecord]
    units: tuple[CrashUnit, ...]
    reconstruction: CrashReconstruction
    samples: PathSamples | None
    severity: tuple[SeverityAnswer, ...]
    references: tuple[ReferenceAnswer, ...]
    findings: tuple[Finding, ...]
    number: int = 1
    partners: tuple[CaseSpec, ...] = ()
    closure: Closure | None = None
    blame: Blame | None = None
    deformation: contact.Deformation = field(default_factory=contact.Deformation)
    indices: tuple[CrashIndex, ...] = ()

    @property
    def vehicle_names(self) -> tuple[str, ...]:
        """Name of every vehicle of the crash, in order; unique."""
        specs = list(self.partners)
        specs.insert(self.number - 1, self.spec)
        names = [s.vehicle.name or f"vehicle {k}" for k, s in enumerate(specs, start=1)]
        if len(set(names)) < len(names):
            names = [f"{name} ({k})" for k, name in enumerate(names, start=1)]
        return tuple(names)


@one_thread()
def run_cases(
    cases: Sequence[tuple[CaseSpec, Path | None]], progress: Progress = silent
) -> tuple[CaseResult, ...]:
    """Reconstruct every vehicle of a crash by its own case, and close two vehicles.

    `cases`: of each vehicle, as `run_case`. Each with the inputs of all, since its closure depends
    on them.
    """
    if len(cases) > 1:
        _refuse_one_vehicle(cases)
    alone = []
    for k, (spec, file) in enumerate(cases):

        def part(stage: str, share: float, k: int = k) -> None:
            progress(stage, (k + share) / len(cases))

        alone.append(run_case(spec, file, part))
    if len(alone) == 1:
        at_barrier = alone[0].spec.vehicle.against == "barrier"
        return (contact.closed_against_barrier(alone[0]),) if at_barrier else tuple(alone)
    specs = [one.spec for one in alone]
    together = [
        replace(
            one,
            number=k + 1,
            partners=tuple(specs[:k] + specs[k + 1 :]),
            inputs=_with_inputs_of(one, alone[:k] + alone[k + 1 :]),
        )
        for k, one in enumerate(alone)
    ]
    if len(together) == 2:
        return contact.closed_together(*together)
    only_two = Finding("crash.closure-of-two-only", severity="note", quantity="closure")
    return tuple(replace(one, findings=(*one.findings, only_two)) for one in together)


def _refuse_one_vehicle(cases: Sequence[tuple[CaseSpec, Path | None]]) -> None:
    """Refuse cases of several vehicles of which one met a barrier, or two have one record."""
    used: set[tuple[str, str]] = set()
    for spec, file in cases:
        name = None if file is None else file.name
        if spec.vehicle.against == "barrier":
            raise ConfigError(
                "crash.barrier-and-other-vehicle", file=name, quantity="vehicle, against"
            )
        own = {(t.path, c.lstrip("-")) for t in _triads(spec) for c in t.channels.values()}
        if shared := sorted(used & own):
            path, channel = shared[0]
            raise ConfigError(
                "crash.vehicles-share-record",
                file=name,
                quantity="channels",
                channel=channel,
                record=Path(path).name,
            )
        used |= own


def _with_inputs_of(own: CaseResult, others: Sequence[CaseResult]) -> tuple[InputFiles, ...]:
    known = {(i.role, i.path) for i in own.inputs}
    more = [i for other in others for i in other.inputs if i.role != "case"]
    return (*own.inputs, *(i for i in more if (i.role, i.path) not in known))


@one_thread()
def run_case(
    spec: CaseSpec, case_file: Path | None = None, progress: Progress = silent
) -> CaseResult:
    """Read the records of a case and reconstruct it.

    Parameters
    ----------
    spec : CaseSpec
        With absolute paths.
    case_file : Path, optional
        Case file, listed as an input.
    progress : callable, optional
        Called with a stage and the share that is done.

    Raises
    ------
    ConfigError
        A file does not exist, or an option is invalid.
    DataError
        A record cannot be used; the message names file, row, quantity and remedy.
    DivergenceError
        A path left the range of vehicle motion.
    """
    progress("reading", 0.02)
    records, spec = whole_records(spec)
    findings = [f for record in records.values() for f in record.findings]
    units = tuple(case_unit(unit, records) for unit in spec.units)
    triads = [t for u in units for t in (*u.accelerometers, u.gyro) if t is not None]
    read = [f for triad in triads for f in triad.table.attrs.get("findings", ())]
    findings += [f for f in read if f.severity == "warning"]
    tables = {r.path: _reference_table(r) for r in spec.references if r.path is not None}
    entry = _entry(spec)
    inputs = _inputs(spec, case_file, records)
    progress("reconstructing", 0.15)
    options = spec.options
    made = reconstruct_crash(units, entry, _options(spec))
    findings += made.findings
    progress("drawing possible paths", 0.4)
    samples, said = _samples(made.main.path, options.monte_carlo_runs, options.seed, progress)
    findings += said
    deformation, stated = contact.deformed(spec, made, tables)
    references = tuple(
        compare_reference(reference, unit, options.gravity_m_per_s2, tables)
        for reference in stated
        for unit in dict.fromkeys((made.main, *made.units))
    )
    # Indices of the vehicle, and of the occupants of that vehicle in its records.
    number = contact.main_event(made.main)
    of_vehicle = () if number is None else vehicle_indices(made.main, number)
    names = {(t.path, name.lstrip("-")) for t in _triads(spec) for name in t.channels.values()}
    channels = [c for path, r in records.items() for c in r.channels if (path, c.name) in names]
    vehicles = {c.vehicle for c in channels}
    return CaseResult(
        spec,
        inputs,
        records,
        units,
        made,
        samples,
        case_severity(spec, made.main),
        references,
        tuple(dict.fromkeys(findings)),
        deformation=deformation,
        indices=of_vehicle + occupant_indices(tuple(records.values()), tuple(vehicles)),
    )


@one_thread()
def reconstruct_case(spec: CaseSpec) -> CrashReconstruction:
    """Reconstruct a case alone, without its severity, indices, references and possible paths.

    Errors as of `run_case`.
    """
    records, spec = whole_records(spec)
    units = tuple(case_unit(unit, records) for unit in spec.units)
    return reconstruct_crash(units, _entry(spec), _options(spec))


def _options(spec: CaseSpec) -> CrashOptions:
    options = spec.options
    return CrashOptions(
        point=spec.point.position_m,
        window=options.window_s,
        rate=options.rate_hz,
        sampling=options.sampling,
        clock=options.clock,
        combine=options.combine,
        preparation=_preparation(spec),
        peak_window=options.peak_window_s,
        rule=EventRule(zero_at=options.zero_at),
        gravity=options.gravity_m_per_s2,
    )


def reconstruct_recorder(
    spec: CaseSpec, records: Mapping[str, CrashRecord], number: int = 0
) -> UnitReconstruction:
    """Reconstruct a crash by one of its recorders alone, with linear bounds: a part of `run_case`.

    `records`: both as of `whole_records`. `number`: of the recorder, from 0. `ConfigError,
    DataError, DivergenceError`: as `run_case`.
    """
    unit = case_unit(spec.units[number], records)
    options = _options(spec)
    own = {k: v for k, v in (options.preparation or {}).items() if k == unit.name}
    return reconstruct_crash((unit,), _entry(spec), replace(options, preparation=own)).main


def whole_records(
    spec: CaseSpec, read_record: Callable[[str], CrashRecord] = read_crash_record
) -> tuple[dict[str, CrashRecord], CaseSpec]:
    """Read the records of a case, and name each of several files by its folder."""
    read = {t.path: read_record(t.path) for t in _triads(spec)}
    several = {path for path, r in read.items() if len(r.files) > 1 and Path(path).is_file()}
    moved = {path: str(Path(path).parent if path in several else Path(path)) for path in read}
    units = tuple(
        unit.model_copy(
            update={
                "accelerometers": tuple(
                    t.model_copy(update={"path": moved[t.path]}) for t in unit.accelerometers
                ),
                "gyro": None
                if unit.gyro is None
                else unit.gyro.model_copy(update={"path": moved[unit.gyro.path]}),
            }
        )
        for unit in spec.units
    )
    # A record has one name, whichever of its files is given: the bundle has the folder.
    records = {
        moved[path]: replace(record, path=Path(moved[path])) for path, record in read.items()
    }
    return records, spec.model_copy(update={"units": units})


def _triads(spec: CaseSpec) -> Iterator[TriadSpec]:
    for unit in spec.units:
        yield from unit.accelerometers
        if unit.gyro is not None:
            yield unit.gyro


def _inputs(
    spec: CaseSpec, case_file: Path | None, records: dict[str, CrashRecord]
) -> tuple[InputFiles, ...]:
    sensors = (t.sensor for t in _triads(spec) if t.sensor is not None)
    given: list[tuple[str, str, tuple[Path, ...]]] = []
    if case_file is not None:
        given.append(("case", str(case_file), (case_file,)))
    given += [("record", path, record.files) for path, record in records.items()]
    # Only the files of sensors that are not of the catalogue.
    given += [("sensor", s, (Path(s),)) for s in dict.fromkeys(sensors) if s.lower() not in SENSORS]
    models = (m for m in spec.options.severity or () if m not in SEVERITY_MODELS)
    given += [("severity", m, (Path(m),)) for m in dict.fromkeys(models)]
    others = [("reference", r.path) for r in spec.references if r.path is not None]
    others += [("fixes", spec.entry.path)] if spec.entry.path is not None else []
    others += [("speeds", spec.entry.speed_path)] if spec.entry.speed_path is not None else []
    given += [(role, path, files_of(path)) for role, path in dict.fromkeys(others)]
    return tuple(
        InputFiles(role, Path(path), files, tuple(sha256(file) for file in files))
        for role, path, files in given
    )


def _entry(spec: CaseSpec) -> Entry | DriveEntry | None:
    entry = spec.entry
    if entry.kind == "standstill":
        return None
    if entry.kind in contact.OF_DRIVES:
        return _drive(spec)
    assert entry.speed_m_per_s is not None and entry.speed_sd_m_per_s is not None
    return Entry.from_speed(
        entry.speed_m_per_s,
        entry.speed_sd_m_per_s,
        time=entry.time_s,
        heading_deg=entry.heading_deg,
        heading_sd_deg=entry.heading_sd_deg,
        slip_deg=entry.slip_deg,
        slip_sd_deg=entry.slip_sd_deg,
        climb_sd=entry.climb_sd_m_per_s,
        source=entry.source,
    )


def _drive(spec: CaseSpec) -> DriveEntry:
    """Fixes and speeds of the drive before the crash, on the clock of the trigger."""
    from strapdown.crash.drive_entry import CAR, DriveEntry

    entry, vehicle = spec.entry, spec.vehicle
    fixes = speeds = None
    if entry.path is not None:
        fixes = read_gnss(entry.path)
        fixes.index = fixes.index - entry.trigger_s
    if entry.speed_path is not None:
        speeds = _speeds(entry)
        speeds.index = speeds.index - entry.trigger_s
    priors: dict[str, Any] = {
        "antenna_sd": entry.antenna_sd_m,
        "speed_scale_sd": entry.speed_scale_sd_percent / 100.0,
        "speed_delay": entry.speed_delay_s,
        "speed_delay_sd": entry.speed_delay_sd_s,
    }
    if entry.slip_sd_deg or speeds is not None:
        # The middle of the rear axle does not slip. Of a car that is at a fifth of its length from
        # the back, within a twentieth.
        front = vehicle.length_m / 2.0 if vehicle.front_m is None else vehicle.front_m
        axle, sd = (front - 0.8 * vehicle.length_m, 0.0), 0.05 * vehicle.length_m
        if vehicle.rear_axle_m is not None:
            axle, sd = vehicle.rear_axle_m, AXLE_SD
        ahead, aside, _ = spec.point.position_m
        priors |= CAR | {
            "no_slip_point": (axle[0] - ahead, axle[1] - aside, 0.0),
            "no_slip_point_sd": sd,
        }
        if entry.slip_sd_deg:
            priors["side_slip_sd_deg"] = entry.slip_sd_deg
    if entry.heading_sd_deg:
        priors |= {"heading_deg": entry.heading_deg, "heading_sd_deg": entry.heading_sd_deg}
    return DriveEntry(
        fixes,
        impact=entry.time_s,
        window=entry.window_s,
        antenna=entry.antenna_m or (0.0, 0.0, 0.0),
        priors=priors,
        speeds=speeds,
        speed_sd=entry.speed_sd_m_per_s or SPEED_SD,
    )


def _speeds(entry: EntrySpec) -> pd.DataFrame:
    """Speeds of the wheels, m/s; `DataError`: their unit is not stated."""
    assert entry.speed_path is not None
    names = {} if entry.speed_column is None else {"speed": entry.speed_column}
    table = read_aid_table(entry.speed_path, {"speed": "m/s"}, names=names)
    found = table.attrs["findings"]
    if any(f.code == "io.unit-assumed" for f in found):
        if entry.speed_unit is None:
            raise DataError(
                "crash.speed-without-unit", file=table.attrs["source"], quantity="speed"
            )
        unit = unit_of(entry.speed_unit, ("velocity",))
        if unit is None:
            raise ConfigError(
                "crash.speed-unit-unknown",
                quantity="entry, speed_unit",
                given=entry.speed_unit,
                known=list(SPEEDS),
            )
        table["speed"] *= SPEEDS[unit]
    return table


def _preparation(spec: CaseSpec) -> dict[str, dict[str, object]]:
    made: dict[str, dict[str, object]] = {}
    for unit in spec.units:
        own: dict[str, object] = {}
        if spec.entry.kind == "standstill":
            # A quiet start was at rest, not at a constant speed.
            own["moving_at_impact"] = False
        if unit.rest_s is not None:
            own["rest"] = unit.rest_s
        if unit.levelling_deg is not None:
            own["levelling"] = (*unit.levelling_deg, unit.levelling_sd_deg)
        if own:
            made[unit.name] = own
    return made


def _samples(
    path: CrashPath, runs: int, seed: int, progress: Progress
) -> tuple[PathSamples | None, list[Finding]]:
    if runs == 0:
        return None, []
    most = max(2, MOST_NUMBERS // (9 * len(path.time)))
    samples = sample_paths(
        path,
        runs=min(runs, most),
        seed=seed,
        progress=lambda stage, share: progress(stage, 0.4 + 0.35 * share),
    )
    if runs <= most:
        return samples, []
    return samples, [
        Finding(
            "crash.runs-samples-would-need-more",
            quantity="options, monte_carlo_runs",
            runs=runs,
            count=len(path.time),
            most=most,
        )
    ]


# Recorders of a case, from its file and the records.


# Quantity of a record's channels, and the triad of the catalogue.
TRIADS = {"acceleration": "accel", "rate": "gyro"}


def case_unit(spec: UnitSpec, records: Mapping[str, CrashRecord]) -> CrashUnit:
    """Build a unit from its specification in the case, and the records by path.

    Raises `DataError` for a channel that is missing or unusable, `ConfigError` for an invalid
    sensor, key or number.
    """
    accelerometers = tuple(
        _triad(spec, triad, records, "acceleration", name)
        for name, triad in zip(spec.accelerometer_names, spec.accelerometers, strict=True)
    )
    assumed = spec.assumed
    gyro = None
    if spec.gyro is not None:
        gyro = _triad(spec, spec.gyro, records, "rate", spec.gyro.name or "gyro")
    return CrashUnit(
        spec.name,
        accelerometers,
        gyro,
        Mounting(spec.position_m, spec.angles_deg, spec.position_sd_m, spec.angles_sd_deg),
        gyro_from=spec.gyro_from,
        trigger=spec.trigger_s,
        trigger_sd=spec.trigger_sd_s,
        assumed=None
        if assumed is None
        else Assumed(
            assumed.turn_sd_deg, assumed.delta_v_sd_m_per_s, assumed.over_s, assumed.because
        ),
    )


def _triad(
    unit: UnitSpec, spec: TriadSpec, records: Mapping[str, CrashRecord], quantity: str, name: str
) -> RecordedTriad:
    table = triad_of_channels(
        records[spec.path],
        {axis: spec.channels[axis] for axis in ("x", "y", "z") if axis in spec.channels},
        quantity=quantity,
        unit=spec.unit,
        time=spec.time,
        time_unit=spec.time_unit,
        rate_hz=spec.rate_hz,
        sampling=spec.sampling,
    )
    sensor = None if spec.sensor is None else load_sensor(spec.sensor)
    try:
        uncertainty = stated_uncertainty(TRIADS[quantity], spec.uncertainty, sensor)
    except ConfigError as error:
        raise error.replaced(file=f"{unit.name}, {name}") from None
    return RecordedTriad(table, uncertainty, name)


# Comparison of a case's answers with references.


@dataclass(frozen=True, eq=False)
class ReferenceAnswer:
    """Comparison of one unit's answer with a reference: a path, or a delta-V over a span in s.

    `delta_v` and `sd`, m/s, are NaN for a path. `consistent`: the difference is within the 95 %
    bound of both together, or a record of a part of the change leaves it open.
    """

    spec: ReferenceSpec
    unit: str
    table: pd.DataFrame | None
    path: PathComparison | None
    span: tuple[float, float]
    delta_v: float
    sd: float
    consistent: bool

    @property
    def difference(self) -> tuple[float, float]:
        """Delta-V of the unit less that of the reference, and its 95 % bound, m/s."""
        assert self.spec.delta_v_m_per_s is not None
        together = TWO_SIDED_95 * math.hypot(self.sd, self.spec.delta_v_sd_m_per_s)
        return self.delta_v - self.spec.delta_v_m_per_s, together


def _reference_table(spec: ReferenceSpec) -> pd.DataFrame:
    """Read the file of a reference: a path, or a force in N."""
    assert spec.path is not None
    if spec.kind == "path":
        return read_reference_path(spec.path)
    names = {} if spec.force_column is None else {"force": spec.force_column}
    try:
        table = read_aid_table(spec.path, {"force": "N"}, names=names)
    except DataError as error:
        if error.finding.code != "io.missing-columns":
            raise
        raise DataError(
            "crash.force-without-column",
            file=error.finding.file,
            quantity="force_column",
            columns=error.finding.data["columns"],
        ) from None
    source = table.attrs["source"]
    if any(f.code == "io.unit-assumed" for f in table.attrs["findings"]):
        if spec.force_unit is None:
            raise DataError("crash.force-without-unit", file=source, quantity="force_unit")
        table["force"] *= FORCES[spec.force_unit]
    elif spec.force_unit is not None:
        raise DataError("crash.force-unit-stated-twice", file=source, quantity="force_unit")
    return table


def compare_reference(
    spec: ReferenceSpec,
    unit: UnitReconstruction,
    gravity: float,
    tables: Mapping[str, pd.DataFrame],
) -> ReferenceAnswer:
    """Compare one unit with one reference; `tables` are reference paths as read, by path.

    `DataError`: path and reference do not overlap.
    """
    if spec.path is not None:
        table = tables[spec.path]
        found = compare_with_reference(unit.path, table)
        return ReferenceAnswer(
            spec,
            unit.name,
            table,
            found,
            (unit.path.time[0], unit.path.time[-1]),
            math.nan,
            math.nan,
            found.consistent,
        )
    assert spec.delta_v_m_per_s is not None
    number = contact.main_event(unit)
    if spec.over_s is not None:
        start, end = spec.over_s
        try:
            change = delta_v(unit.acceleration, start, end, across_gaps=True)
        except DataError as error:
            raise DataError(
                "crash.reference-span-outside-record",
                file=unit.name,
                quantity="over_s",
                name=spec.name,
                reason=error.finding,
            ) from None
        _, rest_sd = unit.at_point.resting_force(gravity)
        bound = body_delta_v_bound(unit.at_point.effects, change.weights, rest_sd=rest_sd)
        is_open = (False, False, False)
    elif number is not None:
        whole = unit.body[number].event
        change, bound, is_open = whole.delta_v, whole.bound, whole.open_axes
        start, end = change.start, change.end
    else:
        raise ConfigError(
            "crash.no-event-no-span-stated",
            quantity=f"references, {spec.name}, over_s",
            name=unit.name,
        )
    if spec.axis == "resultant":
        value, sd = change.resultant, bound.along(change.vector)
    else:
        axis = contact.AXES[spec.axis]
        value = float(change.vector @ axis)
        sd = bound.along(axis)
    answer = ReferenceAnswer(spec, unit.name, None, None, (start, end), value, sd, False)
    less, together = answer.difference
    along = (1.0, 1.0, 1.0) if spec.axis == "resultant" else contact.AXES[spec.axis]
    # A part is consistent with every change that continues it.
    continued = any(o and a for o, a in zip(is_open, along, strict=True)) and less * value <= 0.0
    return replace(answer, consistent=abs(less) <= together or continued)


# Severity of a case by published models.


@dataclass(frozen=True, eq=False)
class SeverityAnswer:
    """Severity by one model, or the finding because of which it does not apply.

    `at_least`: delta-V is a lower bound, and so is the probability; its upper bound does not hold.
    `of`: the recorder, or the mean, whose delta-V it takes.
    """

    model: SeverityModel
    risk: InjuryRisk | None
    because: Finding | None = None
    at_least: bool = False
    of: str = ""


def case_severity(spec: CaseSpec, unit: UnitReconstruction) -> tuple[SeverityAnswer, ...]:
    """Evaluate the models that the case names, or all that fit the type of the severest event.

    Empty without an event. A model that is not valid here, or lacks an input, states why.
    `ConfigError`: a model is unknown.
    """
    number = contact.main_event(unit)
    if number is None:
        return ()
    whole, kind = unit.body[number].event, unit.types[number].name
    inputs: dict[str, float | str] = {"delta_v": whole.resultant, "crash_type": kind}
    inputs |= spec.options.severity_inputs
    names = spec.options.severity
    if names is not None:
        models = [find_severity_model(name) for name in names]
    else:
        # Models of this type alone, or those of all crashes if there are none.
        known = SEVERITY_MODELS.values()
        models = [m for m in known if kind in m.applies.get("crash_type", ())]
        models = models or [m for m in known if not m.applies]
    sd = {"delta_v": whole.bound.along(whole.delta_v.vector)}
    answers = []
    for model in models:
        try:
            risk = injury_risk(model, inputs, sd)
        except DataError as error:
            answers.append(SeverityAnswer(model, None, error.finding, of=unit.name))
        else:
            least = whole.at_least and "delta_v" in model.inputs
            answers.append(SeverityAnswer(model, risk, at_least=least, of=unit.name))
    return tuple(answers)
