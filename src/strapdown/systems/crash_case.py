"""A crash case, from its file to everything that a report tells."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from strapdown.config.crash_case import CaseSpec, TriadSpec
from strapdown.crash.entry import Entry
from strapdown.crash.event_rule import EventRule
from strapdown.crash.gnss_start import GnssEntry
from strapdown.crash.monte_carlo import PathSamples, sample_paths
from strapdown.crash.path import CrashPath
from strapdown.errors import Finding
from strapdown.formats.crash_record import CrashRecord
from strapdown.formats.crash_records import read_crash_record
from strapdown.formats.gnss_files import files_of_fixes, read_gnss
from strapdown.formats.named_columns import read_reference_path
from strapdown.results.inputs import InputFiles
from strapdown.sensors.crash_unit import CrashUnit
from strapdown.systems.attitude_source import input_files, sensor_file
from strapdown.systems.case_references import ReferenceAnswer, compare_reference
from strapdown.systems.case_severity import SeverityAnswer, case_severity
from strapdown.systems.case_units import case_unit
from strapdown.systems.crash_reconstruction import CrashReconstruction, reconstruct_crash
from strapdown.systems.one_thread import one_thread
from strapdown.systems.progress import Progress, silent

__all__ = ["CaseResult", "run_case", "whole_records"]

# Numbers that a Monte Carlo may hold at once: half a gigabyte.
MOST_NUMBERS = 64_000_000


@dataclass(frozen=True, eq=False)
class CaseResult:
    """Everything that came of a case.

    Attributes
    ----------
    spec : CaseSpec
        Resolved; a record of several files is named by its folder.
    inputs : tuple of InputFiles
        The case file (role ``case``), records (``record``), sensors, references, fixes.
    records : dict of str to CrashRecord
        By path as the case names it.
    units : tuple of CrashUnit
        As read from the records.
    reconstruction : CrashReconstruction
    samples : PathSamples or None
        Of the main path's Monte Carlo.
    severity : tuple of SeverityAnswer
    references : tuple of ReferenceAnswer
        Of the main answer, then of every unit by itself.
    findings : tuple of Finding
        Of reading and reconstruction, in this order.
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
        Where it was read from: an input, too.
    progress : callable, optional
        Called with a stage and the share that is done.

    Returns
    -------
    CaseResult

    Raises
    ------
    ConfigError
        A file is not there, or an option cannot be.
    DataError
        A record cannot be used; the message names file, row, quantity and remedy.
    DivergenceError
        A path left what a vehicle can do.
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
    """Read the records of a case, and name each of several files by its folder.

    Raises
    ------
    ConfigError, DataError
        As `read_crash_record`.
    """
    read = {t.path: read_crash_record(t.path) for t in _triads(spec)}
    moved = {path: str(_whole(path, record)) for path, record in read.items()}
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
    # A record has one name, by whichever of its files it was given: the bundle has the folder.
    records = {
        moved[path]: replace(record, path=Path(moved[path])) for path, record in read.items()
    }
    return records, spec.model_copy(update={"units": units})


def _whole(path: str, record: CrashRecord) -> Path:
    """The file, or the folder that holds all files of the record."""
    given = Path(path)
    return given.parent if given.is_file() and len(record.files) > 1 else given


def _triads(spec: CaseSpec) -> Iterator[TriadSpec]:
    for unit in spec.units:
        yield from unit.accelerometers
        if unit.gyro is not None:
            yield unit.gyro


def _inputs(
    spec: CaseSpec, case_file: Path | None, records: dict[str, CrashRecord]
) -> tuple[InputFiles, ...]:
    found = [] if case_file is None else [input_files("case", str(case_file), (case_file,))]
    found += [input_files("record", path, record.files) for path, record in records.items()]
    for sensor in dict.fromkeys(t.sensor for t in _triads(spec)):
        found += sensor_file(sensor)
    others = [("reference", r.path) for r in spec.references if r.path is not None]
    others += [("fixes", spec.entry.path)] if spec.entry.path is not None else []
    found += [input_files(role, path, files_of_fixes(path)) for role, path in dict.fromkeys(others)]
    return tuple(found)


def _entry(spec: CaseSpec) -> Entry | GnssEntry | None:
    entry = spec.entry
    if entry.kind == "standstill":
        return None
    if entry.kind == "gnss":
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
            # What is quiet was at rest, and not at a constant speed.
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
