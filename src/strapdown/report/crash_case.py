"""Write a crash case as a sealed bundle: page, PDF, JSON, tables and figures."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from strapdown import __version__
from strapdown.bundle import with_paths, write_json
from strapdown.config.crash_case import CaseSpec
from strapdown.constants import STANDARD_GRAVITY, TWO_SIDED_95
from strapdown.crash.case import CaseResult, ReferenceAnswer, SeverityAnswer, run_cases
from strapdown.crash.case_contact import Deformation, main_event
from strapdown.crash.case_indices import CrashIndex
from strapdown.crash.consistency import UnitComparison
from strapdown.crash.crash_type import CrashType
from strapdown.crash.delta_v_bound import EventChanges, VelocityChange
from strapdown.crash.entry import EntryState, determined
from strapdown.crash.events import CrashEvent
from strapdown.crash.path import CrashPath
from strapdown.crash.pdof import NedPdof
from strapdown.crash.reconstruction import UnitReconstruction
from strapdown.formats.crash_record import CrashChannel, CrashRecord
from strapdown.progress import Progress
from strapdown.report import crash_words
from strapdown.report.report_bundle import (
    ReportBundle,
    as_comments,
    file_of,
    finite,
    with_file,
    write_table,
)
from strapdown.report.values import AXES, shown_in, spaced
from strapdown.tables import ACCEL, EULER, GYRO, NED, VELOCITY
from strapdown.tables.checks import Array, index_of
from strapdown.units import FORCES, LENGTHS, MOMENTS, SPEEDS

if TYPE_CHECKING:
    from strapdown.crash.closure import Closure, Figure


def _configuration(result: CaseResult) -> dict[str, Any]:
    stated: dict[str, Any] = {"case": result.spec.plain()}
    if result.partners:
        stated["number"] = result.number
        stated["partners"] = [spec.plain() for spec in result.partners]
    return with_file(stated, result, "case", "case_path")


def _run(configuration: dict[str, Any]) -> CaseResult:
    own = CaseSpec.model_validate(configuration["case"])
    cases: list[tuple[CaseSpec, Path | None]]
    cases = [(CaseSpec.model_validate(one), None) for one in configuration.get("partners", ())]
    number = int(configuration.get("number", 1))
    cases.insert(number - 1, (own, file_of(configuration, "case_path")))
    return run_cases(cases)[number - 1]


def _write(
    result: CaseResult, folder: Path, name: str, forms: tuple[str, ...], progress: Progress
) -> None:
    system = result.spec.options.units
    write_json(folder / "crash.json", crash_json(result))
    with shown_in(system):
        told = as_comments(crash_words.conventions())
    main = result.reconstruction.main
    table = table_in(system, trajectory_table(main.path))
    write_table(table, folder / "trajectory.csv", told)
    answers, formats = result.reconstruction.answers, result.spec.options.formats
    made: set[str] = set()
    for unit in answers if "csv" in formats else ():
        own = file_name(unit.name, made)
        write_table(table_in(system, signals_table(unit)), folder / f"signals-{own}.csv", told)
    if "mme" in formats:
        from strapdown.formats.crash_writers import write_mme

        spec = result.spec
        record = signal_record(spec.title, spec.point.name, answers, spec.options.rate_hz)
        write_mme(folder / "mme", record)
    if forms:
        from strapdown.report.crash_document import crash_document
        from strapdown.report.document_html import write_report

        if result.samples is not None:
            progress("bounds of the possible paths", 0.82)
        document = crash_document(result, name)
        stills = write_report(document, folder, progress)
    if "pdf" in forms:
        from strapdown.report.document_pdf import write_pdf

        progress("setting the PDF", 0.95)
        write_pdf(document, folder / "report.pdf", stills=stills)


#: Page, PDF, JSON, tables and figures of a crash case.
CRASH = ReportBundle("crash", _configuration, _run, _write, pdf=True)


def file_name(name: str, made: set[str]) -> str:
    """Return a valid file name that differs from those already made.

    `made`: the new name is added.
    """
    plain = "".join(c if c.isascii() and c.isalnum() else "-" for c in name.lower()).strip("-")
    plain = plain[:60] or "recorder"
    own, number = plain, 2
    while own in made:
        own, number = f"{plain}-{number}", number + 1
    made.add(own)
    return own


# A crash case as plain data; every key carries its unit.


def crash_json(result: CaseResult) -> dict[str, Any]:
    """Return a case as plain data.

    Returns
    -------
    dict
        Bounds are 95 % bounds. NaN and infinity are null: ``high`` where a change of velocity is
        ``at_least`` so much.
    """
    with shown_in(result.spec.options.units):
        made = result.reconstruction
        found = {
            "schema": "strapdown crash 1",
            "strapdown": __version__,
            "title": result.spec.title,
            "number": result.spec.number,
            "units": result.spec.options.units,
            "conventions": dict(crash_words.conventions()),
            "headline": spaced(crash_words.headline(result)),
            "main": made.main.name,
            "answers": [_unit(unit) for unit in made.answers],
            "comparison": None if made.comparison is None else _comparison(made.comparison),
            "closure": None if result.closure is None else _closure(result, result.closure),
            "deformation": _deformation(result.deformation) if result.deformation else None,
            "severity": [_severity(s) for s in result.severity],
            "indices": [_index(one, result.spec.options.units) for one in result.indices],
            "references": [_reference(r) for r in result.references],
            # Numbers of the main result whose bound is by assumptions for the most part.
            "on_assumption": list(crash_words.on_assumption(result)),
            "assumptions": _pairs(crash_words.assumptions(result)),
            "limitations": _pairs([one[1:] for one in crash_words.limitations(result)]),
            "contradictions": _pairs(crash_words.contradictions(result)),
            "not_shown": _pairs(crash_words.not_shown(result)),
            "findings": [f.plain("file") for f in result.findings],
            # With the names of files instead of their paths.
            "case": with_paths(
                result.spec.model_dump(mode="json", exclude_none=True),
                lambda path: path.replace("\\", "/").rstrip("/").rsplit("/", 1)[-1],
            ),
        }
    case = found.pop("case")
    return finite({**_labelled(_endings(result.spec.options.units), found), "case": case})


# Endings of keys and columns, with those in which a system of units has them and their factors; the
# longest first. Of other systems they are SI.
_LABELS: dict[str, dict[str, tuple[str, float]]] = {
    "us": {
        "_m_per_s2": ("_g", 1.0 / STANDARD_GRAVITY),
        "_m_per_s": ("_mph", 1.0 / SPEEDS["mph"]),
        "_m2": ("_ft2", 1.0 / LENGTHS["ft"] ** 2),
        "_n_s": ("_lbf_s", 1.0 / FORCES["lbf"]),
        "_j": ("_ft_lbf", 1.0 / MOMENTS["lbf*ft"]),
        "_m": ("_ft", 1.0 / LENGTHS["ft"]),
    }
}


def _endings(system: str, *, back: bool = False) -> Mapping[str, tuple[str, float]]:
    """Endings in SI with those of a system of units and their factors; or `back` to SI."""
    found = _LABELS.get(system, {})
    return {other: (own, 1.0 / f) for own, (other, f) in found.items()} if back else found


def _label(endings: Mapping[str, tuple[str, float]], key: str) -> tuple[str, float]:
    """Key with another ending, and the factor of its values."""
    ending = max((e for e in endings if key.endswith(e)), key=len, default="")
    other, factor = endings.get(ending, ("", 1.0))
    return key.removesuffix(ending) + other, factor


def _labelled(endings: Mapping[str, tuple[str, float]], value: Any, factor: float = 1.0) -> Any:
    """Data with other endings of their keys, and their numbers."""
    if isinstance(value, dict):
        found = {}
        for key, item in value.items():
            name, own = _label(endings, key)
            found[name] = _labelled(endings, item, factor * own)
        return found
    if isinstance(value, list):
        return [_labelled(endings, item, factor) for item in value]
    if isinstance(value, float) and factor != 1.0:
        return factor * value
    return value


def in_si(data: dict[str, Any]) -> dict[str, Any]:
    """Return the plain data of a case, as `crash_json`, with SI keys and numbers."""
    back = _endings(str(data.get("units")), back=True)
    return {k: value if k == "case" else _labelled(back, value) for k, value in data.items()}


def table_in(system: str, table: pd.DataFrame, *, back: bool = False) -> pd.DataFrame:
    """Return a table with the columns of a system of units; or one of that system `back` in SI."""
    endings = _endings(system, back=back)
    labels = {str(column): _label(endings, str(column)) for column in table.columns}
    factors = {column: factor for column, (_, factor) in labels.items() if factor != 1.0}
    changed = table.assign(**{column: f * table[column] for column, f in factors.items()})
    return changed.rename(columns={column: name for column, (name, _) in labels.items()})


def _pairs(rows: Sequence[tuple[str, str]]) -> list[dict[str, str]]:
    return [{"what": spaced(head), "text": spaced(text)} for head, text in rows]


def _about(value: float, half: float) -> dict[str, float]:
    return {"value": value, "low": value - half, "high": value + half}


def _between(value: float, low: float, high: float) -> dict[str, float]:
    return {"value": value, "low": low, "high": high}


def _unit(unit: UnitReconstruction) -> dict[str, Any]:
    number = main_event(unit)
    path = unit.path
    table, sd = path.table.iloc[-1], path.sd.iloc[-1]
    return {
        "recorder": unit.name,
        "main_event": None if number is None else number + 1,
        "events": [
            _event(unit, k, event, changes, kind)
            for k, (event, changes, kind) in enumerate(
                zip(unit.events.events, unit.body, unit.types, strict=True)
            )
        ],
        "largest_change_without_event_m_per_s": unit.events.largest_change,
        "drive": None if unit.drive is None else _drive(unit.drive),
        "path": {
            "start_s": float(path.time[0]),
            "end_s": float(path.time[-1]),
            "entry_s": path.entry.time,
            "entry_velocity_north_east_down_m_per_s": list(path.entry.velocity),
            "end": {
                **{f"{a}_m": _about(float(table[a]), TWO_SIDED_95 * float(sd[a])) for a in NED},
                **{
                    f"{a}_m_per_s": _about(float(table[a]), TWO_SIDED_95 * float(sd[a]))
                    for a in VELOCITY
                },
                **{f"{a}_deg": _about(float(table[a]), TWO_SIDED_95 * float(sd[a])) for a in EULER},
            },
            "variances_at_the_end_m2": {
                str(name): {a: float(row[a]) for a in NED}
                for name, row in path.variances()[NED].iterrows()
            },
        },
    }


def _drive(drive: EntryState) -> dict[str, Any]:
    """Estimates from the drive; ``determined``: its sd is below nine tenths of the stated one."""
    rows = []
    table = drive.calibration
    for what in () if table is None else table.to_dict("records"):
        key, _, size, _ = crash_words.DRIVE_QUANTITIES[what["quantity"]]
        half, stated, kept = (
            TWO_SIDED_95 * x / size for x in (what["sd"], what["stated"], what["in_crash"])
        )
        rows.append(
            {
                "quantity": key,
                "of": what["of"],
                "axis": "xyz"[what["axis"]],
                "by_drive": _about(what["error"] / size, half),
                "stated_half_width": stated,
                "in_crash_half_width": kept,
                "determined": determined(what),
            }
        )
    fixes, speeds = drive.fixes, drive.speeds
    of_fixes = "position_weight" in fixes
    return {
        "fixes_used": int(fixes["used"].sum()) if of_fixes else 0,
        "fixes_not_used": int((~fixes["used"]).sum()) if of_fixes else 0,
        "speeds_used": 0 if speeds is None else int(speeds["used"].sum()),
        "speeds_not_used": 0 if speeds is None else int((~speeds["used"]).sum()),
        "errors": rows,
    }


def _event(
    unit: UnitReconstruction, k: int, event: CrashEvent, changes: EventChanges, kind: CrashType
) -> dict[str, Any]:
    ned = unit.ned[k]
    return {
        "event": k + 1,
        "type": kind.name,
        "because": "; ".join(reason.sentence("file") for reason in kind.reasons),
        "time_zero_s": event.time_zero,
        "time_zero_sd_s": event.time_zero_sd,
        "time_zero_by": event.basis,
        "onset_s": changes.contact.start.time,
        "onset_sd_s": changes.contact.start.sd,
        "contact_end_s": changes.contact.end.time,
        "contact_end_sd_s": changes.contact.end.sd,
        "end_s": event.end,
        "lasts_beyond_record": event.lasts_beyond_record,
        "starts_before_record": event.starts_before_record,
        "peak_m_per_s2": event.peak,
        "peak_time_s": event.peak_time,
        "body": {"event": _change(changes.event), "peak": _change(changes.peak)},
        "over_ground": None
        if ned is None
        else {"event": _change(ned.event), "peak": _change(ned.peak)},
    }


def _change(change: VelocityChange) -> dict[str, Any]:
    axes = NED if change.delta_v.frame == "ned" else AXES
    across, angle = change.interval.horizontal, change.pdof
    return {
        "start_s": change.delta_v.start,
        "end_s": change.delta_v.end,
        **{
            f"{axis}_m_per_s": _between(float(v), *ends)
            for axis, v, ends in zip(
                axes, change.delta_v.vector, change.ranges.tolist(), strict=True
            )
        },
        "resultant_m_per_s": _between(change.resultant, *change.resultant_range),
        "at_least": change.at_least,
        "missing": list(change.missing),
        "direction_of_force": {
            **(
                {"azimuth_deg": angle.azimuth_deg, "relative_deg": angle.relative_deg}
                if isinstance(angle, NedPdof)
                else {"horizontal_deg": angle.horizontal_deg}
            ),
            "low_deg": across.low_deg,
            "high_deg": across.high_deg,
            "undetermined": across.undetermined,
            "vertical_deg": angle.vertical_deg,
            "vertical_low_deg": change.interval.vertical.low_deg,
            "vertical_high_deg": change.interval.vertical.high_deg,
            "clock": angle.clock,
        },
    }


def _comparison(comparison: UnitComparison) -> dict[str, Any]:
    return {
        "agree": comparison.agree,
        "probability": comparison.probability,
        "chi_square": comparison.chi_square,
        "freedom": comparison.freedom,
        "contradicted": list(comparison.doubted),
        "structure": {
            "sd_forward_right_down_m_per_s": comparison.structure.sd.tolist(),
            "share_of_delta_v": comparison.structure.expected.tolist(),
            "correlation_time_s": comparison.structure.expected_time,
            "turning_of_assumed": comparison.structure.turning,
        },
        "turning_by_points": None
        if comparison.turned is None
        else {
            "time_s": comparison.turned.edges.tolist(),
            "rate_roll_pitch_heading_deg_per_s": comparison.turned.rate.tolist(),
            "rate_sd_deg_per_s": comparison.turned.rate_sd.tolist(),
            "angle_roll_pitch_heading_deg": comparison.turned.angle.tolist(),
            "angle_sd_deg": comparison.turned.angle_sd.tolist(),
        },
        "pairs": [
            {
                "first": pair.first,
                "second": pair.second,
                "difference_m_per_s": pair.difference[-1].tolist(),
                "sd_m_per_s": pair.sd[-1].tolist(),
                "chi_square": pair.chi_square,
                "freedom": pair.freedom,
                "probability": pair.probability,
                "agree": pair.agree,
            }
            for pair in comparison.pairs
        ],
    }


def _bounded(figure: Figure | None) -> dict[str, float] | None:
    return None if figure is None else asdict(figure)


def _deformation(found: Deformation) -> dict[str, Any]:
    return {
        "crush": [
            {
                "recorder": one.unit,
                "depth_m": asdict(one.depth) | ({"high": None} if one.at_least else {}),
                "first_touch_s": one.touch,
                "time_s": one.time,
                "at_least": one.at_least,
            }
            for one in found.crush
        ],
        "energy_of_residual_crush_j": _bounded(found.energy),
        "energy_equivalent_speed_m_per_s": _bounded(found.equivalent_speed),
        "measured_forces": [
            {"reference": name, "impulse_n_s": _bounded(impulse)}
            for name, impulse in found.impulses
        ],
    }


def _closure(result: CaseResult, closure: Closure) -> dict[str, Any]:
    return {
        "vehicles": list(result.vehicle_names),
        "contradicted": closure.contradicted,
        "velocities_hold_at": closure.basis,
        "residual_n_s": closure.residual.tolist(),
        "chi_square": closure.chi_square,
        "freedom": closure.freedom,
        "probability": closure.probability,
        "impulse_difference_n_s": _bounded(closure.magnitude),
        "mass_ratio_second_to_first": _bounded(closure.mass_ratio),
        "relative_heading_deg": _bounded(closure.relative_heading_deg),
        "direction_of_impulse_on_first_deg": _bounded(closure.direction_deg),
        "closing_speed_m_per_s": _bounded(closure.closing_speed),
        "separation_speed_m_per_s": _bounded(closure.separation_speed),
        "restitution": _bounded(closure.restitution),
        "common_velocity_m_per_s": _bounded(closure.common_velocity),
        "impulse_n_s": _bounded(closure.impulse),
        "energy_lost_j": _bounded(closure.energy),
        "energy_equivalent_speed_m_per_s": [_bounded(f) for f in closure.energy_equivalent_speed],
        "explained_by": []
        if result.blame is None
        else [one.finding.plain("file") for one in result.blame.candidates],
    }


def _severity(answer: SeverityAnswer) -> dict[str, Any]:
    risk = answer.risk
    return {
        "model": answer.model.name,
        "outcome": answer.model.outcome,
        "source": answer.model.source,
        "of": answer.of,
        "model_uncertainty_in_bound": risk is not None and risk.model_sd is not None,
        "logit": None if risk is None else risk.logit,
        "logit_sd": None if risk is None else risk.logit_sd,
        "logit_sd_of_model": None if risk is None else risk.model_sd,
        "probability": None if risk is None else risk.probability,
        "low": None if risk is None else risk.low,
        "high": None if risk is None or answer.at_least else risk.high,
        "at_least": answer.at_least,
        "because": "" if answer.because is None else answer.because.sentence("file"),
    }


def _index(index: CrashIndex, system: str) -> dict[str, Any]:
    unit, factor = index.unit, 1.0
    if unit == "m/s" and system in _LABELS:
        label, factor = _label(_endings(system), "_m_per_s")
        unit = label.removeprefix("_")
    return {
        "index": index.name,
        "of": index.of,
        **{
            name: None if value is None else factor * value
            for name, value in (("value", index.value), ("low", index.low), ("high", index.high))
        },
        "at_least": index.at_least,
        "unit": unit,
        "limit": index.limit,
        "standard": index.standard,
        "detail": index.detail,
        "channels": list(index.channels),
        "because": "" if index.because is None else index.because.sentence("file"),
    }


def _reference(answer: ReferenceAnswer) -> dict[str, Any]:
    found, spec = answer.path, answer.spec
    return {
        "reference": spec.name,
        "kind": spec.kind,
        "source": spec.source,
        "recorder": answer.unit,
        "start_s": answer.span[0],
        "end_s": answer.span[1],
        "delta_v_m_per_s": answer.delta_v,
        "sd_m_per_s": answer.sd,
        "reference_delta_v_m_per_s": spec.delta_v_m_per_s,
        "reference_sd_m_per_s": None if spec.kind == "path" else spec.delta_v_sd_m_per_s,
        "rms_m": None if found is None else list(found.rms),
        "largest_m": None if found is None else list(found.largest),
        "consistent": answer.consistent,
    }


# CSV tables of a crash case: the path, and the signals at the reference point.


UNITS = dict.fromkeys(NED, "m") | dict.fromkeys(VELOCITY, "m_per_s") | dict.fromkeys(EULER, "deg")


def trajectory_table(path: CrashPath) -> pd.DataFrame:
    """Return the path with its standard deviations; column names carry units.

    Returns: by time in s: position, velocity, attitude, then their standard deviations.
    """
    values = path.table.rename(columns={c: f"{c}_{u}" for c, u in UNITS.items()})
    sd = path.sd.rename(columns={c: f"{c}_sd_{u}" for c, u in UNITS.items()})
    return pd.concat([values, sd], axis=1).set_index(pd.Index(path.time, name="time"))


def signals_table(unit: UnitReconstruction) -> pd.DataFrame:
    """Return the signals of one recorder at the reference point, including gravity.

    Returns: specific force forward, right, down in m/s² and rates in deg/s at the common stamps;
    for a recorder of several ranges also the selected range (0 the lowest) and the samples at the
    end of its range, by sensor axis.
    """
    imu = unit.at_point.imu
    table = pd.DataFrame(index=imu.index)
    for axis, column in zip(AXES, ACCEL, strict=True):
        table[f"force_{axis}_m_per_s2"] = imu[column].to_numpy()
    for axis, column in zip(("roll", "pitch", "yaw"), GYRO, strict=True):
        table[f"rate_{axis}_deg_per_s"] = np.degrees(imu[column].to_numpy())
    prepared = unit.at_point.prepared
    if prepared is not None:
        for k, axis in enumerate("xyz"):
            table[f"range_{axis}"] = prepared.range_spoken[:, k].astype(np.int64)
            table[f"at_end_{axis}"] = prepared.clipped[:, k].astype(np.int64)
    return table


# Signals of the recorders at the reference point, as one crash record for ISO MME.


def signal_record(
    title: str, point: str, answers: Sequence[UnitReconstruction], rate_hz: float
) -> CrashRecord:
    """Return the signals of all answers at the reference point.

    `title`: of the case. `point`: name of the reference point. `rate_hz`, Hz: sample rate of the
    common stamps. Returns: specific force (including gravity) and rates of each recorder and of
    their mean, along the vehicle's axes.
    """
    channels = []
    for unit in answers:
        imu = unit.at_point.imu
        time = index_of(imu)
        for columns, quantity, symbol in ((ACCEL, "acceleration", "m/s2"), (GYRO, "rate", "rad/s")):
            for column, axis in zip(columns, "xyz", strict=True):
                channels.append(
                    CrashChannel(
                        f"{unit.name} {column}",
                        quantity,
                        axis,
                        symbol,
                        _load(time, imu[column].to_numpy(dtype=np.float64)),
                        sampling=str(imu.attrs["sampling"]),
                        place=f"{point}, by {unit.name}",
                        low_pass=f"brought to {rate_hz:g} Hz",
                    )
                )
    return CrashRecord(
        Path("signals"), "mme", title, {"reference point": point}, tuple(channels), ()
    )


def _load(time: Array, values: Array) -> Callable[[], tuple[Array, Array]]:
    return lambda: (time, values)
