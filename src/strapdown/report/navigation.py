"""Write a navigation run as a sealed bundle: page, JSON, tables, paths for maps."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np

from strapdown.bundle import input_files, write_json
from strapdown.config.navigation import STAGES, NavigationSpec
from strapdown.constants import Array
from strapdown.errors import ConfigError
from strapdown.formats import csv
from strapdown.formats.clocks import clock_of
from strapdown.formats.writers import write_trajectory
from strapdown.formats.writing import FileOptions
from strapdown.lazy_names import Choices
from strapdown.navigation.consistency import Inconsistency
from strapdown.navigation.heading_integrity import REASONS, STATUSES
from strapdown.navigation.integrity import QUANTITY_REASONS, Repeated
from strapdown.navigation.record import NavigationRecord
from strapdown.progress import Progress
from strapdown.report.navigation_document import (
    cautions,
    conventions,
    headline,
    navigation_document,
)
from strapdown.report.navigation_evaluation import (
    Agreement,
    NavigationEvaluation,
    distance_over_ground,
    rms,
    trust,
)
from strapdown.report.report_bundle import (
    ReportBundle,
    alignment_data,
    as_comments,
    file_of,
    finite,
    with_file,
    write_table,
)
from strapdown.report.values import spaced
from strapdown.report.verdict import (
    answer,
    apart,
    check_words,
    first_words,
    promise,
    repeated_words,
)
from strapdown.systems.navigation_run import NavigationRun, run_navigation, withheld_aid
from strapdown.tables import EULER, GEODETIC, NED, VELOCITY
from strapdown.tables.checks import index_of
from strapdown.tables.on_disk import tidy

if TYPE_CHECKING:
    from strapdown.navigation.truth_comparison import SolutionScore
    from strapdown.report.chart_svg import ChartFigure


def _configuration(result: NavigationRun) -> dict[str, Any]:
    return with_file({"navigation": result.spec.plain()}, result)


def _run(configuration: dict[str, Any]) -> NavigationRun:
    spec = NavigationSpec.checked(configuration["navigation"])
    return run_navigation(spec, file_of(configuration))


def _write_all(
    result: NavigationRun, folder: Path, name: str, forms: tuple[str, ...], progress: Progress
) -> None:
    evaluation = NavigationEvaluation(result)
    write_json(folder / "navigation.json", navigation_json(evaluation))
    tidy()
    write_navigation_files(evaluation, folder)
    write_integrity(evaluation, folder)
    tidy()
    if forms:
        from strapdown.report.document_html import write_report

        document = navigation_document(evaluation, name)
        tidy()
        write_report(document, folder, progress, figures=result.spec.output.figures)


@contextmanager
def _with_tiles(result: NavigationRun, report: bool) -> Iterator[NavigationRun]:
    """The run with the tiles that its plan shows, as files, instead of the map that has them."""
    if result.spec.map is None:
        yield result
        return
    if not report:
        yield replace(result, spec=result.spec.with_path("map", None))
        return
    from strapdown.formats.map_tiles import open_map, write_tiles
    from strapdown.report.navigation_plan import plan_tiles

    with (
        open_map(result.spec.map.path) as opened,
        TemporaryDirectory(prefix="strapdown-") as name,
    ):
        folder = Path(name).resolve() / "tiles"
        files = write_tiles(folder, opened, plan_tiles(NavigationEvaluation(result), opened))
        used = replace(input_files("map", str(folder), files), copied=True)
        spec = result.spec.with_path("map", folder)
        yield replace(result, spec=spec, inputs=(*result.inputs, used))


#: Pages, JSON, tables and paths for maps of a navigation run.
NAVIGATION = ReportBundle("navigate", _configuration, _run, _write_all, prepared=_with_tiles)


# Charts of a navigation run as figures for a notebook.


KINDS = Choices(
    {
        "plan": "strapdown.report.navigation_plan:plan_chart",
        "bound": "strapdown.report.navigation_charts:bound_chart",
        "height": "strapdown.report.navigation_charts:height_chart",
        "velocity": "strapdown.report.navigation_charts:velocity_chart",
        "attitude": "strapdown.report.navigation_charts:attitude_chart",
        "paired": "strapdown.report.paired_corrections:paired_chart",
    }
)


def plot(result: NavigationRun, kind: str) -> ChartFigure:
    """Draw one chart of a run, as its report shows it.

    Parameters
    ----------
    kind : str
        One of `KINDS`, or the name of an observation.

    Raises
    ------
    ConfigError
        The chart does not exist.
    """
    from strapdown.report.chart_svg import ChartFigure
    from strapdown.report.navigation_charts import innovation_chart

    evaluation = NavigationEvaluation(result)
    observed = {one.name: one for one in evaluation.agreements}
    if kind in observed:
        return ChartFigure(innovation_chart(result.record, observed[kind]))
    known = [one for one in KINDS if one != "paired" or evaluation.pair]
    if kind not in known:
        known += observed
        raise ConfigError("report.unknown-chart", quantity="kind", word=kind, known=known)
    chart = KINDS[kind](evaluation)
    if chart is None:
        raise ConfigError("report.no-path-to-draw", quantity=f"kind '{kind}'")
    return ChartFigure(chart)


# A navigation run as JSON: final state, bounds, estimated errors, and method.


MODULES = (*STAGES, "aiding")


def navigation_json(evaluation: NavigationEvaluation) -> dict[str, Any]:
    """Return a navigation run as plain data for programs.

    Returns
    -------
    dict
        Angles and their standard deviations in degrees; estimated sensor errors in SI.
    """
    result, record, source = evaluation.run, evaluation.record, evaluation.run.source
    time = record.trajectory.index
    clock, smoother, points = clock_of(source.imu), result.agreement, result.points
    data = {
        "conventions": as_comments(conventions(result)),
        "answer": spaced(headline(evaluation)),
        "trust": trust(evaluation).json(),
        "cautions": [spaced(f"{head}: {text}") for head, text in cautions(evaluation)],
        "record": {
            "name": source.name,
            "what": source.what,
            "samples": len(source.imu),
            "from_s": float(source.imu.index[0]),
            "to_s": float(source.imu.index[-1]),
            "clock": {"name": clock.name, "origin_s": clock.origin, "gps_week": clock.week},
            "read_as": [asdict(reading) for reading in source.readings],
        },
        "ellipsoid": result.ellipsoid.name,
        "trajectory": {
            "rows": len(time),
            "from_s": float(time[0]),
            "to_s": float(time[-1]),
            "travelled_m": distance_over_ground(record.trajectory),
        },
        "alignment": {
            "coarse": result.coarse and alignment_data(result.coarse),
            "fine": result.fine and alignment_data(result.fine.alignment),
        },
        "start": _state(evaluation, 0),
        "end": _state(evaluation, -1),
        "not_estimated": list(record.not_estimated),
        "sensors": {
            str(name): {
                "unit": record.units.get(str(name), ""),
                "estimate": record.sensors[name].iloc[-1],
                "sd": record.sensors_sd[name].iloc[-1],
            }
            for name in record.sensors.columns
        },
        "smoothing": smoother
        and {
            name: {
                "instants": int(smoother.instants[k]),
                "share_within_3_sd": smoother.share[k],
                "rms_in_sd": smoother.rms[k],
            }
            for k, name in enumerate(smoother.columns)
        },
        "observations": {one.name: _innovations(one) for one in evaluation.agreements},
        "outages": [
            {
                "measurement": aid,
                "from_s": span.begin,
                "to_s": span.end,
                "largest_horizontal_bound_95_m": bound,
            }
            for aid, span, bound in evaluation.outages
        ],
        "gnss_outage_tests": _outage_tests(result) if result.withheld else [],
        "modes": [{"mode": s.name, "from_s": s.begin, "to_s": s.end} for s in record.modes],
        "events": [
            {"time_s": e.time, "kind": e.kind, "what": e.finding.what} for e in record.events
        ],
        "against": _against(evaluation),
        # After the best fit of origin and heading.
        "control_points": points
        and {
            "points": len(points.time),
            "points_given": points.given,
            "path_length_m": points.way,
            "rms_m": points.rms,
            "median_m": points.median,
            "largest_m": points.largest,
            "largest_at_s": points.largest_at,
            "turn_deg": points.turn_deg,
        },
        "paired": _paired(evaluation) if evaluation.pair else None,
        "method": _method(result),
        "findings": [f.plain("file") for f in result.findings],
    }
    return finite(data)


def _paired(evaluation: NavigationEvaluation) -> dict[str, Any]:
    from strapdown.report.paired_corrections import paired_json

    return paired_json(evaluation)


def _outage_tests(result: NavigationRun) -> list[dict[str, Any]]:
    """Return each test by withheld fixes: the error at their end beside its bound."""
    from strapdown.navigation.outage_test import judge_outages

    return [
        {
            "measurement": withheld_aid(result.spec),
            "from_s": w.result.span.begin,
            "to_s": w.result.span.end,
            "largest_horizontal_error_m": w.result.largest,
            "bound_95_m": w.result.bound_at_largest,
            "against": w.result.against,
            "instants": len(w.result.time),
            "share_inside": float(w.result.inside.mean()),
            "probability": verdict.probability,
            "inside": verdict.consistent,
            "largest_horizontal_error_forward_m": None if w.smoothed is None else w.forward.largest,
        }
        for w in result.withheld
        for verdict in (judge_outages([w.result]),)
    ]


def _method(result: NavigationRun) -> dict[str, Any]:
    """The modules and their options, without file paths."""
    chosen: dict[str, Any] = result.spec.model_dump(
        mode="json",
        include=set(MODULES),
        exclude_none=True,
        serialize_as_any=True,
    )
    for aid in chosen["aiding"].values():
        aid.pop("path", None)
    return chosen


def _against(evaluation: NavigationEvaluation) -> dict[str, Any] | None:
    """Errors against the truth, at the samples after the covariance marks."""
    errors = evaluation.errors
    if errors is None:
        return None
    freedom = errors.freedom.get("all", 0)
    return {
        "name": evaluation.truth_name,
        "instants": len(errors.time),
        "from_s": float(errors.time[0]),
        "to_s": float(errors.time[-1]),
        "mean_nees": errors.nees["all"].to_numpy().mean() if freedom else None,
        "nees_of": freedom,
        "errors": {score.quantity: _score(score) for score in errors.scores},
    }


def _score(score: SolutionScore) -> dict[str, Any]:
    unit = {"m": "m", "m/s": "m_per_s", "deg": "deg"}[score.unit]
    return {
        f"rms_{unit}": score.rms,
        f"largest_{unit}": score.largest,
        "largest_at_s": score.largest_at,
        f"bound_95_rms_{unit}": score.bound,
        "share_within_bound": score.share,
    }


def _state(evaluation: NavigationEvaluation, row: int) -> dict[str, Any]:
    """Position, velocity and attitude with the standard deviations of the nearest mark."""
    record = evaluation.record
    at, how = record.trajectory.iloc[row], record.sd.iloc[row]
    units = dict.fromkeys(VELOCITY, "m_per_s") | dict.fromkeys(EULER, "deg")
    units |= {"lat": "deg", "lon": "deg", "alt": "m"} | dict.fromkeys(NED, "m")
    names = [*GEODETIC, *VELOCITY, *EULER]
    return {
        "time_s": float(record.trajectory.index[row]),
        **{f"{n}_{units[n]}": at[n] for n in names},
        "sd_at_s": float(record.sd.index[row]),
        **{f"{n}_sd_{units[n]}": how[n] for n in [*NED, *VELOCITY, *EULER]},
        "horizontal_bound_95_m": evaluation.bounds[row],
    }


def _innovations(one: Agreement) -> dict[str, Any]:
    """Counts of used and rejected epochs, and innovation statistics, of one observation."""
    return {
        "components": list(one.labels),
        "epochs": one.epochs,
        "rejected": one.rejected,
        "weakened": one.weakened,
        "rms_in_sd": one.ratio,
        "mean_nis": one.mean_nis,
        "mean_nis_expected_95": list(one.band),
        "correlation_next_epoch": one.correlation,
        "correlation_by_chance_95": one.correlation_bound,
        "verdicts": [
            {"kind": v.kind, "component": v.component, "since_s": v.since, "what": v.finding.what}
            for v in one.consistency.verdicts
        ],
        "rms": {label: rms(one.nu[one.used, k]) for k, label in enumerate(one.labels)},
    }


# Files of a navigation run beside its report: tables over time, and paths for maps.


UNITS = {"lat": "deg", "lon": "deg", "alt": "m"}
UNITS |= dict.fromkeys(NED, "m") | dict.fromkeys(VELOCITY, "m_s") | dict.fromkeys(EULER, "deg")
#: Units in column names.
_WORDS = {"rad/s": "rad_s", "m/s²": "m_s2", "1": "", "(rad/s)/(m/s²)": "rad_s_per_m_s2"}
#: Largest number of points of a map path.
MOST_POINTS = 10_000


def write_navigation_files(evaluation: NavigationEvaluation, folder: Path) -> None:
    """Write the tables of a run.

    Parameters
    ----------
    folder : Path
        ``trajectory.*`` in the requested formats, ``sd.csv``, ``sensor_errors.csv``,
        ``innovations/NAME.csv``, ``events.csv``, and ``errors.csv`` if the truth is known; for a
        smoothed run also the first three from the filter alone, in ``forward``.
    """
    result, record = evaluation.run, evaluation.record
    comments = {"run": result.source.name, "ellipsoid": result.ellipsoid.name}
    _write_states(result, record, folder, comments)
    if result.forward is not None:
        (folder / "forward").mkdir()
        alone = {**comments, "by": "filter alone"}
        _write_states(result, result.forward, folder / "forward", alone)
    if record.innovations:
        (folder / "innovations").mkdir()
        for name, table in record.innovations.items():
            renamed = table.rename(columns={c: _column(str(c)) for c in table.columns})
            write_table(renamed, folder / "innovations" / f"{name}.csv", {**comments, "of": name})
    events = record.events
    csv.write(
        folder / "events.csv",
        {
            "time_s": np.array([e.time for e in events], dtype=np.float64),
            "kind": np.array([e.kind for e in events], dtype=np.str_),
            "what": np.array([e.finding.what for e in events], dtype=np.str_),
        },
        comments,
    )
    if result.points is not None:
        score = result.points
        columns = {
            "time_s": score.time,
            "north_m": score.points[:, 0],
            "east_m": score.points[:, 1],
            "north_error_m": score.error[:, 0],
            "east_error_m": score.error[:, 1],
        }
        sign = "computed minus point, after the fit of origin and heading"
        csv.write(folder / "control_points.csv", columns, {**comments, "sign": sign})
    if result.differences is not None:
        errors = result.differences.rename(
            columns={c: f"{c}_{UNITS.get(str(c), 'deg')}" for c in result.differences.columns}
        )
        against = {**comments, "against": result.source.truth_name, "sign": "computed minus truth"}
        write_table(errors, folder / "errors.csv", against)
    if evaluation.pair:
        from strapdown.report.paired_corrections import write_paired

        write_paired(evaluation, folder, comments)


def _write_states(
    result: NavigationRun, record: NavigationRecord, folder: Path, comments: dict[str, str]
) -> None:
    """Write a trajectory, its standard deviations, and the estimated sensor errors."""
    options = FileOptions(
        ellipsoid=result.ellipsoid,
        most_points=MOST_POINTS,
        heights_as_stated=result.source.heights_as_stated,
    )
    for form in result.spec.output.files:
        path = folder / f"trajectory.{form}"
        write_trajectory(path, record.trajectory, name=result.source.name, options=options)
        tidy()
    sd = record.sd.rename(columns={c: f"{c}_sd_{UNITS[str(c)]}" for c in record.sd.columns})
    without = {"not_estimated": " ".join(record.not_estimated)} if record.not_estimated else {}
    write_table(sd, folder / "sd.csv", {**comments, **without})
    csv.write(folder / "sensor_errors.csv", _sensors(record), comments)


def _sensors(record: NavigationRecord) -> dict[str, Array]:
    """Times, and estimates with their standard deviations, by names with units."""
    units = {n: _WORDS.get(u, u.replace("/", "_per_")) for n, u in record.units.items()}
    ends = {n: f"_{u}" if u else "" for n, u in units.items()}
    estimates = {f"{n}{e}": record.sensors[n].to_numpy() for n, e in ends.items()}
    sd = {f"{n}_sd{e}": record.sensors_sd[n].to_numpy() for n, e in ends.items()}
    return {"time_s": index_of(record.sensors), **estimates, **sd}


def _column(name: str) -> str:
    """Convert ``nu VN, m/s`` to ``nu_VN_m_s``, variances to ``s_VN_m2_s2``; no unit of weights."""
    part, _, rest = name.partition(" ")
    label, _, unit = rest.replace("²", "2").partition(", ")
    if part == "s":
        unit = re.sub(r"\w+", lambda u: f"{u.group()}2", unit)
    return re.sub(r"\W+", "_", f"{part} {label} {'' if part == 'weight' else unit}").strip("_")


# Integrity as files: its values for programs, and the heading status over time.


def write_integrity(evaluation: NavigationEvaluation, folder: Path) -> None:
    """Write ``verdict.json`` and ``heading_integrity.csv``."""
    write_json(folder / "verdict.json", verdict_json(evaluation))
    heading = evaluation.run.trust.heading
    table = heading.table

    def words(values: Iterable[Any]) -> Any:
        return np.array([str(value) for value in values], dtype=np.str_)

    def numbers(column: str) -> Array:
        return table[column].to_numpy(dtype=np.float64)

    csv.write(
        folder / "heading_integrity.csv",
        {
            "time_s": index_of(table),
            "status": words(STATUSES[k] for k in table["status"].to_numpy(dtype=np.int64)),
            "reason": words(table["reason"]),
            "bound_95_deg": numbers("bound"),
            "confirmed_99_deg": numbers("carried"),
            "check": words(table["check"]),
            "check_difference_deg": numbers("difference"),
            "check_sd_deg": numbers("check_sd"),
            "check_since_s": numbers("check_since"),
            "innovation_scatter": numbers("scatter"),
        },
        {
            "run": evaluation.run.source.name,
            "trusted_below_deg": f"{heading.trusted_below:g}",
            "rejected_beyond_deg": f"{heading.rejected_beyond:g}",
        },
    )


def verdict_json(evaluation: NavigationEvaluation) -> dict[str, Any]:
    """Return a verdict for programs; angles in degrees, lengths in meters, times in s."""
    result, trust = evaluation.run, evaluation.run.trust
    heading = trust.heading
    spans = heading.spans
    data = {
        "answer": spaced(answer(evaluation)),
        "position": {
            "bound_95_at_end_m": evaluation.bounds[-1],
            "largest_bound_95_m": evaluation.bounds.max(),
            "confirmed": bool(trust.consistency) and trust.against_bounds is None,
        },
        "heading": {
            "meaning": {
                status: spaced(v) for status, (_, v) in zip(STATUSES, promise(trust), strict=True)
            },
            "trusted_below_deg": heading.trusted_below,
            "rejected_beyond_deg": heading.rejected_beyond,
            "confirmed": not trust.unconfirmed,
            "why_not": [f.plain("file") for f in trust.unconfirmed],
            "confirmed_by": check_words(trust) or None,
            "share": {one: heading.share(one) for one in STATUSES},
            "at_end": spans[-1].status if spans else None,
            "spans": [
                {
                    "from_s": s.begin,
                    "to_s": s.end,
                    "status": s.status,
                    "reason": s.reason,
                    "why": REASONS[s.reason],
                }
                for s in spans
            ],
            "advice": [
                {
                    "time_s": a.time,
                    "status": a.span.status,
                    "sd_deg": a.sd,
                    "manoeuvres": [
                        {
                            "what": m.what,
                            "forward_m_per_s2": m.forward,
                            "aside_m_per_s2": m.aside,
                            "duration_s": m.duration,
                            "sd_after_deg": sd,
                        }
                        for m, sd in a.options
                    ],
                }
                for a in trust.advice
            ],
        },
        "quantities": {
            one.name.replace(" ", "_"): {
                "share": {status: one.share(status) for status in STATUSES},
                "at_end": one.at_end[0],
                "reason": one.at_end[1],
                "why": QUANTITY_REASONS[one.at_end[1]],
            }
            for one in trust.quantities
        },
        "innovations": {name: one.consistent for name, one in trust.consistency.items()},
        "inconsistencies": [_doubt(i) for i in trust.inconsistencies],
        "first": spaced(first_words(trust)),
        "repeated": None if trust.repeated is None else _repeated(trust.repeated, result),
    }
    return finite(data)


def _repeated(repeated: Repeated, result: NavigationRun) -> dict[str, Any]:
    out: dict[str, Any] = {
        "without": repeated.change.what,
        "answer": spaced(repeated_words(result)),
        "failed": None if repeated.failed is None else repeated.failed.plain("file"),
        "left": [_doubt(i) for i in repeated.left],
    }
    if repeated.differences is not None:
        place, turn = apart(repeated.differences)
        for name, unit, values in (("position", "m", place), ("heading", "deg", turn)):
            out[f"{name}_difference"] = {
                f"median_{unit}": np.median(values),
                f"largest_{unit}": values.max(),
                f"at_end_{unit}": values[-1],
            }
    return out


def _doubt(one: Inconsistency) -> dict[str, Any]:
    return {
        "observation": one.name,
        "measurement": one.aid,
        "component": one.component,
        "kind": one.kind,
        "since_s": one.since,
        "until_s": one.until,
        "epochs_s": one.epochs.tolist(),
        "what": one.finding.what,
        "meaning": one.finding.remedy,
    }
