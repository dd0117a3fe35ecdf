"""Crash case from its file to all results of a report."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import pandas as pd

from strapdown.bundle.seal import InputFiles, sha256
from strapdown.config.crash_case import CaseSpec, ReferenceSpec, TriadSpec, UnitSpec
from strapdown.constants import TWO_SIDED_95
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
from strapdown.formats.aid_table import read_reference_path
from strapdown.formats.crash_record import CrashRecord
from strapdown.formats.crash_records import read_crash_record
from strapdown.formats.crash_triad import triad_of_channels
from strapdown.formats.gnss_files import read_gnss
from strapdown.progress import Progress, silent
from strapdown.sensors.catalogue import SENSORS, load_sensor
from strapdown.sensors.crash_unit import Assumed, CrashUnit, Mounting, RecordedTriad
from strapdown.sensors.uncertainty import stated_uncertainty
from strapdown.systems.one_thread import one_thread

if TYPE_CHECKING:
    from strapdown.crash.gnss_entry import GnssEntry

# Most numbers of a Monte Carlo in memory: half a gigabyte.
MOST_NUMBERS = 64_000_000


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
    tables = {r.path: read_reference_path(r.path) for r in spec.references if r.path is not None}
    entry = _entry(spec)
    inputs = _inputs(spec, case_file, records)
    progress("reconstructing", 0.15)
    options = spec.options
    made = reconstruct_crash(
        units,
        entry,
        CrashOptions(
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
        ),
    )
    findings += made.findings
    progress("drawing possible paths", 0.4)
    samples, said = _samples(made.main.path, options.monte_carlo_runs, options.seed)
    findings += said
    references = tuple(
        compare_reference(reference, unit, options.gravity_m_per_s2, tables)
        for reference in spec.references
        for unit in dict.fromkeys((made.main, *made.units))
    )
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
    )


def whole_records(spec: CaseSpec) -> tuple[dict[str, CrashRecord], CaseSpec]:
    """Read the records of a case, and name each of several files by its folder."""
    read = {t.path: read_crash_record(t.path) for t in _triads(spec)}
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
    others = [("reference", r.path) for r in spec.references if r.path is not None]
    others += [("fixes", spec.entry.path)] if spec.entry.path is not None else []
    given += [(role, path, files_of(path)) for role, path in dict.fromkeys(others)]
    return tuple(
        InputFiles(role, Path(path), files, tuple(sha256(file) for file in files))
        for role, path, files in given
    )


def _entry(spec: CaseSpec) -> Entry | GnssEntry | None:
    entry = spec.entry
    if entry.kind == "standstill":
        return None
    if entry.kind == "gnss":
        from strapdown.crash.gnss_entry import GnssEntry

        assert entry.path is not None
        return GnssEntry(
            read_gnss(entry.path),
            impact=entry.time_s,
            antenna=entry.antenna_m or (0.0, 0.0, 0.0),
            priors={"antenna_sd": entry.antenna_sd_m},
        )
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


def _samples(path: CrashPath, runs: int, seed: int) -> tuple[PathSamples | None, list[Finding]]:
    if runs == 0:
        return None, []
    most = max(2, MOST_NUMBERS // (9 * len(path.time)))
    if runs <= most:
        return sample_paths(path, runs=runs, seed=seed), []
    return sample_paths(path, runs=most, seed=seed), [
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
    several = len(spec.accelerometers) > 1
    accelerometers = tuple(
        _triad(
            spec,
            triad,
            records,
            "acceleration",
            f"accelerometer {k}" if several else "accelerometer",
        )
        for k, triad in enumerate(spec.accelerometers, start=1)
    )
    assumed = spec.assumed
    gyro = None
    if spec.gyro is not None:
        gyro = _triad(spec, spec.gyro, records, "rate", "gyro")
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
    name = spec.name or name
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


AXES = {"forward": (1.0, 0.0, 0.0), "right": (0.0, 1.0, 0.0)}


@dataclass(frozen=True, eq=False)
class ReferenceAnswer:
    """Comparison of one unit's answer with a reference: a path, or a delta-V over a span in s.

    `delta_v` and `sd`, m/s, are NaN for a path. `consistent`: the difference is within the 95 %
    bound of both together.
    """

    spec: ReferenceSpec
    unit: str
    table: pd.DataFrame | None
    path: PathComparison | None
    span: tuple[float, float]
    delta_v: float
    sd: float
    consistent: bool


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
    number = main_event(unit)
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
        axis = AXES[spec.axis]
        value = float(change.vector @ axis)
        sd = bound.along(axis)
    together = TWO_SIDED_95 * math.hypot(sd, spec.delta_v_sd_m_per_s)
    more = spec.delta_v_m_per_s - value
    near = abs(more) <= together
    along = (1.0, 1.0, 1.0) if spec.axis == "resultant" else AXES[spec.axis]
    if any(o and a for o, a in zip(is_open, along, strict=True)):
        # A part is consistent with every change that continues it.
        near |= more * value >= 0.0
    return ReferenceAnswer(spec, unit.name, None, None, (start, end), value, sd, near)


# Severity of a case by published models.


@dataclass(frozen=True, eq=False)
class SeverityAnswer:
    """Severity by one model, or the finding because of which it does not apply.

    `at_least`: delta-V is a lower bound, and so is the probability; its upper bound does not hold.
    """

    model: SeverityModel
    risk: InjuryRisk | None
    because: Finding | None = None
    at_least: bool = False


def main_event(unit: UnitReconstruction) -> int | None:
    """Number, from 0, of the event with the largest delta-V; None without an event."""
    if not unit.body:
        return None
    return max(range(len(unit.body)), key=lambda k: unit.body[k].event.resultant)


def case_severity(spec: CaseSpec, unit: UnitReconstruction) -> tuple[SeverityAnswer, ...]:
    """Evaluate the models that the case names, or all that fit the type of the severest event.

    Empty without an event. A model that is not valid here, or lacks an input, states why.
    `ConfigError`: a model is unknown.
    """
    number = main_event(unit)
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
            answers.append(SeverityAnswer(model, None, error.finding))
        else:
            least = whole.at_least and "delta_v" in model.inputs
            answers.append(SeverityAnswer(model, risk, at_least=least))
    return tuple(answers)
