"""Kinds of cases: from a configuration to a result, its numbers, and its sealed folder."""

from __future__ import annotations

import copy
import json
import math
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from strapdown.config.reading import absolute_table
from strapdown.config.spec import specify
from strapdown.config.toml_file import KeyPath, read_toml
from strapdown.constants import TWO_SIDED_95
from strapdown.errors import ConfigError
from strapdown.lazy_names import named

Table = dict[str, Any]


@dataclass(frozen=True)
class Kind:
    """How the cases of one kind are run.

    Attributes
    ----------
    run : callable
        From the configuration of a case, as a table, and its name, to the result.
    view : callable
        From a result to what its data and curves are taken from: the result itself, or with what is
        computed once for both.
    data : callable
        From a view to the plain data of its JSON, to which numbers for campaigns are added.
    save : callable
        From a result and a folder to its sealed folder.
    scalars : mapping of str to str
        What is kept if a campaign does not say: names, and paths in the data.
    seed : tuple of str
        Path of the seed in the configuration; empty without one.
    log : tuple
        Key of the path of a log.
    curves : callable, optional
        From a view to a table over the time from its start, s.
    """

    run: Callable[[Table, str], Any]
    data: Callable[[Any], Table]
    scalars: Mapping[str, str]
    seed: KeyPath = ()
    log: KeyPath = ()
    curves: Callable[[Any], pd.DataFrame] | None = None
    curve_names: tuple[str, ...] = field(default=())
    view: Callable[[Any], Any] = field(default=lambda run: run)
    save: Callable[[Any, Path, bool], Any] = field(
        default=lambda run, out, force: run.save(out, force=force)
    )


# --- paths in plain data ------------------------------------------------------------------


def at_path(node: Any, path: Iterable[str | int]) -> Any:
    """Return the value at a path, or None: numbers are indices of a list, from 0.

    A function on the way is computed: what nobody asks for costs no time.
    """
    for part in path:
        if isinstance(node, dict):
            node = node.get(part, node.get(str(part)))
        elif isinstance(node, list | tuple) and isinstance(part, int) and part < len(node):
            node = node[part]
        else:
            return None
        node = node() if callable(node) else node
    return node


def with_value(table: Table, path: KeyPath, value: Any) -> Table:
    """Return a table with a value at a path; tables on the way are made.

    KeyError: a part of the path is not a table, or is beyond the end of a list.
    """
    out = copy.copy(table)
    node: Any = out
    for k, part in enumerate(path):
        last = k + 1 == len(path)
        if isinstance(node, list):
            if not isinstance(part, int) or part >= len(node):
                raise KeyError(part)
        elif not isinstance(node, dict):
            raise KeyError(part)
        key: Any = part if isinstance(node, list) else str(part)
        if last:
            node[key] = value
        else:
            inner = copy.copy(node[key] if isinstance(node, list) else node.get(key, {}))
            node[key] = inner
            node = inner
    return out


def _by_form(form: str, run: str) -> Callable[[Table, str], Any]:
    """The run of a configuration file of a form, each as `named`."""
    return lambda table, name: named(run)(named(form).checked({**table, "name": name}))


def _from_result(data: str) -> Callable[[Any], Table]:
    """The plain data of a result by a function, as `named`."""
    return lambda run: dict(named(data)(run))


# --- navigation and alignment -------------------------------------------------------------


def _navigate(table: Table, name: str) -> Any:
    from strapdown.config.navigation import NavigationSpec
    from strapdown.systems.navigation_run import run_navigation

    if set(table) <= {"log", "gnss"}:
        table = _proposed(table)
    return run_navigation(NavigationSpec.checked({**table, "name": name}))


def _proposed(table: Table) -> Table:
    """As `strapdown init navigate` proposes it, for a log and its fixes."""
    from strapdown.config.logs import FixesTable, LogTable
    from strapdown.systems.navigation_proposal import propose

    fixes = table.get("gnss")
    proposal = propose(
        specify(LogTable, **table["log"]),
        gnss=None if fixes is None else specify(FixesTable, **fixes),
    )
    return proposal.table


def _navigation_data(evaluation: Any) -> Table:
    from strapdown.report.navigation import navigation_json

    data = navigation_json(evaluation)
    data["trusted"] = float(data["trust"]["verdict"] == "trusted")
    errors = evaluation.errors
    if errors is not None:
        data["at_the_end"] = _at_the_end(errors)
    return data


def _at_the_end(errors: Any) -> Table:
    """Errors, 95 % bounds and normalized squares at the last instant: one draw of a run."""
    from strapdown.tables import EULER, NED, VELOCITY

    units = (
        dict.fromkeys(NED, "m") | dict.fromkeys(VELOCITY, "m_per_s") | dict.fromkeys(EULER, "deg")
    )
    out: Table = {}
    for name, unit in units.items():
        out[f"{name}_error_{unit}"] = float(errors.error(name)[-1])
        out[f"{name}_bound_{unit}"] = float(errors.bound(name)[-1])
    out["horizontal_error_m"] = math.hypot(out["north_error_m"], out["east_error_m"])
    for part, squares in errors.nees.items():
        out[f"nees_{part}"] = float(squares.iloc[-1])
    return out


def _navigation_curves(evaluation: Any) -> pd.DataFrame:
    run, errors = evaluation.run, evaluation.errors
    begin = float(run.source.imu.index[0])
    sd = run.record.sd
    stamps = sd.index.to_numpy(dtype=np.float64)
    plane = np.hypot(sd["north"], sd["east"])
    if errors is None:
        return pd.DataFrame({"horizontal_sd_m": plane.to_numpy()}, index=stamps - begin)
    size = np.hypot(errors.error("north"), errors.error("east"))
    return pd.DataFrame(
        {
            "horizontal_error_m": size,
            "horizontal_sd_m": np.interp(errors.time, stamps, plane),
            "height_error_m": np.abs(errors.error("down")),
            "heading_error_deg": np.abs(errors.error("heading")),
        },
        index=errors.time - begin,
    )


def _alignment_data(run: Any) -> Table:
    from strapdown.report.alignment import alignment_json
    from strapdown.tables import EULER

    data = alignment_json(run)
    data["trusted"] = float(data["trust"]["verdict"] == "trusted")
    against = data["compared_with"]
    if against is not None:
        sd = dict(zip(EULER, against["sd_deg"], strict=True))
        data["at_the_end"] = {f"{a}_error_deg": against["off_deg"][a] for a in EULER} | {
            f"{a}_bound_deg": TWO_SIDED_95 * float(sd[a]) for a in EULER
        }
    return data


# --- attitude -----------------------------------------------------------------------------


def _attitude(table: Table, name: str) -> Any:
    from strapdown.attitude_comparison.comparison import run_comparison
    from strapdown.attitude_comparison.options import AttitudeOptions
    from strapdown.simulation import SCENARIOS

    keys = {key: value for key, value in table.items() if key != "source"}
    if "source" not in table:
        raise ConfigError("campaign.no-source", quantity="base, configuration, source")
    unknown = [key for key in keys if key not in AttitudeOptions.__dataclass_fields__]
    if unknown:
        known = ["source", *AttitudeOptions.__dataclass_fields__]
        raise ConfigError("campaign.unknown-key", word=unknown[0], known=known, kind="attitude")
    source = table["source"]
    if not isinstance(source, dict):
        return run_comparison(AttitudeOptions(**keys).specify(source))
    scenario = scenario_of(source, keys.pop("seed", None), name)
    asked = AttitudeOptions(**keys).specify(next(iter(SCENARIOS)))
    return run_comparison(asked.model_copy(update={"source": scenario}))


def scenario_of(source: Table, seed: int | None, name: str) -> Any:
    """Return the scenario that is written as a table, whose motion can vary."""
    from strapdown.config.sources import ScenarioFile, ScenarioSpec

    own = ScenarioFile.checked({**source, "name": name})
    return ScenarioSpec(
        name=own.name,
        own=own,
        rate_hz=own.rate_hz,
        sampling=own.sampling,
        seed=own.seed if seed is None else seed,
        sensor=own.sensor,
    )


def _attitude_data(run: Any) -> Table:
    from strapdown.report.attitude import attitude_json

    data = attitude_json(run)
    # By name, since the order of the algorithms is not a key.
    data["by_algorithm"] = {one["algorithm"]: one for one in data["algorithms"]}
    first = data["algorithms"][0]["scores"]
    data["first"] = first[0] if first else {}
    return data


# --- outage, calibration, logs ------------------------------------------------------------


def _outage(table: Table, name: str) -> Any:
    from strapdown.config.outage import OutageSpec
    from strapdown.systems.outage_run import run_outage

    return run_outage(specify(OutageSpec, **table), budget=False)


def _outage_curves(run: Any) -> pd.DataFrame:
    time, bound, _ = run.cone
    return pd.DataFrame({"horizontal_95_m": bound}, index=time - time[0])


def _doctor_data(run: Any) -> Table:
    from strapdown.report.doctor import diagnosis_json

    data = diagnosis_json(run)
    first = data["logs"][0]
    imu: Table = next((one for one in first["streams"] if one.get("name") == "imu"), {})
    data["log"] = {
        "samples": imu.get("rows"),
        "rate_hz": imu.get("rate_hz"),
        "duration_s": imu["to_s"] - imu["from_s"] if imu else None,
        "questions": len(first["questions"]),
        "faults": len(first["faults"]),
        "notes": len(first["notes"]),
        **{
            f"fit_for_{use}": {"yes": 1.0, "with limits": 0.5, "no": 0.0}.get(one["answer"])
            for use, one in first["fit"].items()
        },
    }
    return data


# --- crash --------------------------------------------------------------------------------


@dataclass(frozen=True)
class _SimulatedCrash:
    """Reconstruction of a simulated crash, with what really happened."""

    result: Any
    truth: Table
    table: Table

    @property
    def findings(self) -> Any:
        return self.result.findings


def _crash(table: Table, name: str) -> Any:
    with crash_case(table, name) as (spec, truth):
        run = _reconstructed(spec)
    return run if truth is None else _SimulatedCrash(run, truth, table)


def _reconstructed(spec: Any) -> Any:
    from strapdown.api.crash import CrashRun
    from strapdown.crash.case import run_cases

    return CrashRun(**vars(run_cases([(spec, None)])[0]))


@contextmanager
def crash_case(table: Table, name: str) -> Iterator[tuple[Any, Table | None]]:
    """Yield the specification of a crash, and what really happened if it is a simulated one.

    The records of a simulated crash are written as its user has them, and read from their case;
    other keys of the table replace those of the case.
    """
    from strapdown.config.crash_case import CaseSpec
    from strapdown.config.sources import CrashSimulationSpec
    from strapdown.report.crash_simulation import write_crash_simulation

    if "simulate" not in table:
        yield CaseSpec.checked({**table, "name": name}), None
        return
    spec = specify(CrashSimulationSpec, **table["simulate"])
    with tempfile.TemporaryDirectory(prefix="strapdown-") as folder:
        place = Path(folder).resolve() / "records"
        write_crash_simulation(spec, place)
        case: Table = absolute_table(read_toml(place / "case.toml"))
        for key, value in table.items():
            own = case.get(key)
            if key != "simulate":
                both = isinstance(own, dict) and isinstance(value, dict)
                case[key] = {**own, **value} if both else value  # type: ignore[dict-item]
        truth = json.loads((place / "scenario.json").read_text(encoding="utf-8"))
        yield CaseSpec.checked({**case, "name": "case"}), truth


def _crash_data(run: Any) -> Table:
    from strapdown.report.crash_case import crash_json

    truth: Table | None = None
    if isinstance(run, _SimulatedCrash):
        run, truth = run.result, run.truth
    data = crash_json(run)
    answer = next(one for one in data["answers"] if one["recorder"] == data["main"])
    number = answer["main_event"]
    event = next((one for one in answer["events"] if one["event"] == number), None)
    data["main_answer"], data["main_event"] = answer, event
    data["agree"] = at_path(data, ("comparison", "agree"))
    if truth is not None and event is not None:
        data["truth"] = truth
        data["at_the_end"] = _crash_errors(answer, event, truth)
        # Of each recorder by its name, beside the answer that is their mean.
        data["by_recorder"] = {
            one["recorder"]: _crash_errors(one, own, truth)
            for one in data["answers"]
            for own in one["events"]
            if own["event"] == one["main_event"]
        }
    return data


def _crash_errors(answer: Table, event: Table, truth: Table) -> Table:
    """Errors and 95 % half widths: delta-V and direction along turning axes, end of the path."""
    impacts = truth["impacts"]
    begin = float(event["onset_s"] or event["time_zero_s"])
    impact = min(impacts, key=lambda one: abs(one["time_s"] - begin))
    true = impact["delta_v_along_turning_axes_m_per_s"]
    found = event["body"]["event"]
    out: Table = {}

    def put(name: str, unit: str, value: Mapping[str, float], exact: float) -> None:
        half = 0.5 * (value["high"] - value["low"]) if value["high"] is not None else math.inf
        out[f"{name}_error_{unit}"] = value["value"] - exact
        out[f"{name}_bound_{unit}"] = half

    for k, axis in enumerate(("forward", "right", "down")):
        put(f"delta_v_{axis}", "m_per_s", found[f"{axis}_m_per_s"], true[k])
    put("delta_v", "m_per_s", found["resultant_m_per_s"], float(np.linalg.norm(true)))
    force = found["direction_of_force"]
    if force["horizontal_deg"] is not None and force["low_deg"] is not None:
        off = force["horizontal_deg"] - impact["pdof_along_turning_axes_deg"]
        out["pdof_error_deg"] = (off + 180.0) % 360.0 - 180.0
        out["pdof_bound_deg"] = 0.5 * (force["high_deg"] - force["low_deg"])
    end = answer["path"]["end"]
    if abs(answer["path"]["end_s"] - truth["end"]["time_s"]) < 1e-3:
        for axis in ("north", "east", "down"):
            put(f"end_{axis}", "m", end[f"{axis}_m"], truth["end"][f"{axis}_m"])
    return out


def _crash_curves(run: Any) -> pd.DataFrame:
    result = run.result if isinstance(run, _SimulatedCrash) else run
    path = result.reconstruction.main.path
    table = path.table
    return pd.DataFrame(
        {
            "north_m": table["north"].to_numpy(),
            "east_m": table["east"].to_numpy(),
            "speed_m_per_s": np.hypot(table["VN"], table["VE"]).to_numpy(),
        },
        index=path.time,
    )


# --- saving a case ------------------------------------------------------------------------


def _save_crash(run: Any, out: Path, force: bool) -> Any:
    if not isinstance(run, _SimulatedCrash):
        return run.save(out, force=force)
    # Its records went with the run: they are the same again.
    with crash_case(run.table, "case") as (spec, _):
        return _reconstructed(spec).save(out, force=force)


def _ends(names: Iterable[str], unit: str) -> dict[str, str]:
    """Errors and bounds at the end of a case, by name."""
    return {
        f"{name}_{what}_{unit}": f"at_the_end.{name}_{what}_{unit}"
        for name in names
        for what in ("error", "bound")
    }


KINDS: dict[str, Kind] = {
    "navigate": Kind(
        _navigate,
        _navigation_data,
        {
            **_ends(("north", "east", "down"), "m"),
            **_ends(("VN", "VE", "VD"), "m_per_s"),
            **_ends(("roll", "pitch", "heading"), "deg"),
            "horizontal_error_m": "at_the_end.horizontal_error_m",
            "horizontal_rms_m": "against.errors.horizontal.rms_m",
            "horizontal_largest_m": "against.errors.horizontal.largest_m",
            "horizontal_bound_m": "end.horizontal_bound_95_m",
            "nees_position": "at_the_end.nees_position",
            "trusted": "trusted",
            "travelled_m": "trajectory.travelled_m",
        },
        ("simulation", "seed"),
        ("log", "path"),
        _navigation_curves,
        ("horizontal_error_m", "horizontal_sd_m", "height_error_m", "heading_error_deg"),
        view=lambda run: named("strapdown.report.navigation_evaluation:NavigationEvaluation")(run),
    ),
    "align": Kind(
        _by_form(
            "strapdown.config.alignment:AlignmentSpec",
            "strapdown.systems.alignment_run:run_alignment",
        ),
        _alignment_data,
        {
            **_ends(("roll", "pitch", "heading"), "deg"),
            "heading_sd_deg": "end.heading_sd_deg",
            "trusted": "trusted",
        },
        ("simulation", "seed"),
        ("log", "path"),
    ),
    "attitude": Kind(
        _attitude,
        _attitude_data,
        {
            "final_deg": "first.error_deg",
            "rms_deg": "first.rms_deg",
            "largest_deg": "first.max_deg",
            "lowest_rate_hz": "answer.rate_hz",
        },
        ("seed",),
        ("source",),
    ),
    "outage": Kind(
        _outage,
        _from_result("strapdown.report.outage:outage_parts"),
        {
            key: f"at_the_end.{key}"
            for key in (
                *("horizontal_95_m", "along_sd_m", "across_sd_m", "vertical_sd_m"),
                *("speed_sd_m_per_s", "heading_sd_deg"),
            )
        },
        curves=_outage_curves,
        curve_names=("horizontal_95_m",),
    ),
    "crash": Kind(
        _crash,
        _crash_data,
        {
            **_ends(("delta_v", "delta_v_forward", "delta_v_right"), "m_per_s"),
            **_ends(("pdof",), "deg"),
            **_ends(("end_north", "end_east", "end_down"), "m"),
            "delta_v_m_per_s": "main_event.body.event.resultant_m_per_s.value",
            "pdof_deg": "main_event.body.event.direction_of_force.horizontal_deg",
            "agree": "agree",
        },
        ("simulate", "seed"),
        curves=_crash_curves,
        curve_names=("north_m", "east_m", "speed_m_per_s"),
        save=_save_crash,
    ),
    "calibrate": Kind(
        _by_form(
            "strapdown.config.logs:CalibrateSpec", "strapdown.systems.calibrate_run:run_calibrate"
        ),
        _from_result("strapdown.report.calibrate:calibrate_json"),
        {"rests": "rests", "excess": "excess"},
        log=("logs", 0, "path"),
    ),
    "doctor": Kind(
        _by_form("strapdown.config.logs:DoctorSpec", "strapdown.systems.doctor:run_doctor"),
        _doctor_data,
        {
            key: f"log.{key}"
            for key in (
                *("samples", "rate_hz", "duration_s", "questions", "faults"),
                *(f"fit_for_{use}" for use in ("attitude", "navigation", "crash")),
            )
        },
        log=("logs", 0, "path"),
    ),
}
