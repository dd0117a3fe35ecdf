"""Write the attitude bench as a sealed bundle: page, figures, JSON, CSV."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.attitude_algorithms import make_algorithm
from strapdown.attitude_comparison.comparison import AttitudeComparison
from strapdown.bundle import Seal, write_bundle, write_json
from strapdown.errors import ConfigError
from strapdown.evaluation.reference_points import Score
from strapdown.formats import csv
from strapdown.formats.columns import parse_axes
from strapdown.increments import increments_from_imu
from strapdown.report import attitude_tables as words
from strapdown.report.attitude_charts import charts
from strapdown.report.attitude_document import attitude_document
from strapdown.report.attitude_tables import (
    budget_json,
    clock_json,
    places_json,
    share_basis,
    source_of,
)
from strapdown.report.chart_svg import ChartFigure
from strapdown.report.document import finding_json
from strapdown.report.report_bundle import as_comments, finite, write_report
from strapdown.tables import EULER, GYRO, QUATERNION, THETA, imu_table
from strapdown.tables.checks import index_of
from strapdown.units import GYRO_SUMS, GYRO_UNITS, factor_of


def write_attitude(
    bench: AttitudeComparison,
    out: str | Path,
    *,
    report: bool = True,
    force: bool = False,
    png: bool = False,
) -> Seal:
    """Write a bench as a sealed bundle.

    Parameters
    ----------
    out : str or Path
        Folder to create.
    report : bool
        Whether to write the page and the figures.
    force : bool
        Overwrite an existing bundle.
    png : bool
        Also write each figure as PNG.

    Raises
    ------
    ConfigError
        `out` exists and may not be replaced.
    DataError
        An input has changed since it was read.
    """
    seals: list[Seal] = []
    with write_bundle(
        Path(out),
        command="attitude",
        configuration={**bench.specification, **({} if report else {"report": False})},
        inputs=bench.inputs,
        force=force,
        seals=seals,
    ) as folder:
        write_json(folder / "attitude.json", attitude_json(bench))
        _write_csv(bench, folder / "attitude.csv")
        if len(bench.sweep):
            _write_sweep(bench, folder / "sweep.csv")
        if report:
            drawn = charts(bench)
            write_report(attitude_document(bench, drawn), folder)
            for chart in drawn if png else ():
                ChartFigure(chart).save(folder / "figures" / f"{chart.slug}.png")
    return seals[0]


def _write_csv(bench: AttitudeComparison, path: Path) -> None:
    """Write the attitude of every algorithm side by side, to 1e-9 and to 1e-6 deg."""
    columns: dict[str, NDArray[Any]] = {"time_s": index_of(bench.runs[0].attitude)}
    for run in bench.runs:
        # Neither a comma nor a semicolon, which a reader may take for a column separator.
        name = run.algorithm.replace(",", " ")
        columns |= {f"{name} {q}": np.round(run.attitude[q].to_numpy(), 9) for q in QUATERNION}
        columns |= {f"{name} {e}_deg": np.round(run.attitude[e].to_numpy(), 6) for e in EULER}
    csv.write(path, columns, as_comments(words.CONVENTIONS))


def _write_sweep(bench: AttitudeComparison, path: Path) -> None:
    """Write the errors at every rate; unknown values are empty fields."""
    columns: dict[str, NDArray[Any]] = {}
    for name in bench.sweep.columns:
        values = bench.sweep[name].to_numpy()
        if values.dtype.kind == "f":
            # Missing values are written as empty fields, not as NaN.
            values = np.array([None if np.isnan(v) else v for v in values.tolist()], dtype=object)
        columns[str(name)] = values
    csv.write(
        path,
        columns,
        {
            "meaning": "drop: samples are left out; sum: increments are summed",
            "error_deg": "what the answer judges: against the truth, else at the reference "
            "points, else own_deg",
            "own_deg": share_basis(bench),
        }
        | as_comments(words.CONVENTIONS),
    )


# Plain data of the attitude bench.


def attitude_json(bench: AttitudeComparison) -> dict[str, Any]:
    """Return a bench as plain data; every key carries its unit."""
    # Operations and cycles are per sample; memory is in numbers.
    costs = {
        cost.algorithm: {
            "add_per_sample": cost.add,
            "multiply_per_sample": cost.multiply,
            "divide_per_sample": cost.divide,
            "sqrt_per_sample": cost.sqrt,
            "trig_per_sample": cost.trig,
            "cortex_m4f_cycles_per_sample": cost.cycles,
            "memory_numbers": cost.memory,
        }
        for cost in bench.costs
    }
    three = ("final", "rms", "max")
    shares = {
        s.algorithm: {
            key: None if values is None else dict(zip(three, values, strict=True))
            for key, values in (
                ("own_deg", s.own_deg),
                ("sensor_deg", s.sensor_deg),
                ("single_deg", s.single_deg),
            )
        }
        for s in bench.shares
    }
    data = {
        "schema": "strapdown attitude 1",
        "source": bench.source,
        "description": bench.description,
        "conventions": dict(words.CONVENTIONS),
        "initial": bench.initial,
        "gyro_bias": bench.gyro_bias,
        "clock": clock_json(bench),
        "sensor_error_parts": budget_json(bench),
        "headline": f"{bench.answer.sentence} {words.standing(bench)}",
        "answer": asdict(bench.answer),
        "algorithms": [
            {
                "algorithm": run.algorithm,
                "title": run.title,
                "equations": source_of(run),
                "final": _final(run.attitude.iloc[-1], float(run.attitude.index[-1])),
                "diagnostics": run.diagnostics,
                "scores": [_score(s) for s in bench.scores if s.algorithm == run.algorithm],
                "cost": costs.get(run.algorithm),
                "share": shares.get(run.algorithm),
            }
            for run in bench.runs
        ],
        "share_basis": share_basis(bench),
        "sweep": bench.sweep.to_dict("records"),
        "trials": None
        if bench.trials is None
        else {
            "names": list(bench.trials.names),
            "errors": bench.trials.errors.to_dict("records"),
            "ranking": bench.trials.ranking.to_dict("records"),
        },
        "peers": [
            {
                "peer": peer.peer,
                "aiding": peer.aiding,
                "final": _final(peer.attitude.iloc[-1], float(peer.attitude.index[-1])),
                "scores": [_score(s) for s in peer.scores],
                "errors": None if peer.errors is None else vars(peer.errors),
                "cost": None if peer.cost is None else vars(peer.cost),
                "single_precision_deg": peer.single_deg,
            }
            for peer in bench.peers
        ],
        **places_json(bench),
        "sampling_error_deg": None
        if bench.sampling_error_deg is None
        else dict(zip(("final", "max"), bench.sampling_error_deg, strict=True)),
        "largest_difference_deg": {
            name: {other: float(v) for other, v in row.items()}
            for name, row in bench.differences_deg.iterrows()
        },
        "rests": [
            {
                "start_s": r.start,
                "end_s": r.end,
                "gyro_mean_rad_per_s": r.gyro_mean,
                "gyro_sd_rad_per_s": r.gyro_sd,
                "accel_mean_m_per_s2": r.accel_mean,
            }
            for r in bench.rests
        ],
        "readings": [vars(r) for r in bench.readings],
        "findings": [finding_json(f, "python") for f in bench.findings],
    }
    return finite(data)


def _final(row: Any, time: float) -> dict[str, float]:
    return (
        {"time_s": time}
        | {q: float(row[q]) for q in QUATERNION}
        | {f"{e}_deg": float(row[e]) for e in EULER}
    )


def _score(score: Score) -> dict[str, Any]:
    return {
        "against": score.against,
        "time_s": score.time,
        "error_deg": score.error_deg,
        "rms_deg": score.rms_deg,
        "max_deg": score.max_deg,
        "turned_deg": score.turned_deg,
        "expected_deg": score.expected_deg,
        "sd_deg": score.sd_deg,
    }


# C export of the chosen algorithm.


# Samples of the test vector: about a second of motion, in a file of readable length.
VECTOR = 64


def check_c(path: Path | None, force: bool) -> None:
    """Reject a path that cannot be written, before the run starts.

    Raises
    ------
    ConfigError
        The file name does not end in .c or .h, the file exists without `force`, or its folder does
        not exist.
    """
    if path is None:
        return
    if path.suffix.lower() not in (".c", ".h"):
        # Otherwise --force could overwrite the log itself.
        raise ConfigError("report.no-name-c-file", file=str(path), quantity="--export-c")
    if path.is_dir() or (path.exists() and not force):
        raise ConfigError("report.already", file=str(path), quantity="--export-c")
    if not path.parent.is_dir():
        raise ConfigError("report.no-such-folder", file=str(path.parent), quantity="--export-c")


def chosen_for_c(bench: AttitudeComparison) -> str:
    """Return the algorithm to export: the recommended one, or else the only one.

    Raises
    ------
    ConfigError
        No algorithm is recommended among several.
    """
    labels = [run.algorithm for run in bench.runs]
    chosen = labels[0] if len(labels) == 1 else bench.answer.algorithm
    if chosen is None:
        raise ConfigError("report.no-algorithm-accurate-enough-chosen", quantity="--export-c")
    return chosen


def write_c(bench: AttitudeComparison, path: Path, *, force: bool = False) -> str:
    """Write one algorithm of a bench as C99, with a test vector from its log.

    Parameters
    ----------
    path : Path
        File to write.
    force : bool
        Overwrite an existing file.

    Returns
    -------
    str
        The exported algorithm: the recommended one, or else the only one.

    Raises
    ------
    ConfigError
        No algorithm is recommended among several, or the file may not be written.
    """
    from strapdown.export_c import export_c

    check_c(path, force)
    chosen = chosen_for_c(bench)
    configuration, each, mean = _configuration(bench, chosen)
    first = bench.runs[0].attitude[QUATERNION].to_numpy()
    start = _liveliest(bench, each)
    imu = _at_rate(bench.imu.iloc[start : start + VECTOR * each + 1], each, mean)
    text = export_c(
        make_algorithm(chosen),
        interpolation=str(bench.specification["interpolation"]),
        q_nb=first[start],
        imu=imu,
        configuration=configuration,
    )
    partial = path.with_name(path.name + ".partial")
    partial.write_text(text, encoding="utf-8", newline="\n")
    partial.replace(path)
    return chosen


def _configuration(bench: AttitudeComparison, chosen: str) -> tuple[Any, int, bool]:
    """Configuration of the exported sensor, samples of the log to one of its own, their mean."""
    from strapdown.export_c import SensorConfiguration

    answer, imu = bench.answer, bench.imu
    full = bench.clock.rate_hz
    recommended = answer.rate_hz if answer.algorithm == chosen else None
    each = 1 if recommended is None else max(1, round(full / float(recommended)))
    rate = full / each  # a last, shorter step is in what the answer states
    mean = imu.attrs["sampling"] == "mean" or (each > 1 and answer.meaning != "drop")
    by = "by the answer" if recommended is not None else "of the log; the answer names no other"
    made_of = "as in the log" if each == 1 else f"one in {each} of the log"
    if mean and each > 1:
        made_of = f"the mean over {each} steps of the log"
    sources = [f"Rate: {by}. A sample: {made_of}."]
    gyro = {r.quantity.lstrip("-"): r for r in bench.readings if r.quantity.lstrip("-") in GYRO}
    axis, sign, unit, scale = [0, 1, 2], [1.0, 1.0, 1.0], "rad/s", 1.0
    if len(gyro) == len(GYRO):
        reading = gyro[GYRO[0]]
        names = ", ".join(gyro[name].source for name in GYRO)
        if reading.unit in GYRO_SUMS:
            sources.append(f"Unit: the log has increments in {reading.unit}; give their rates.")
        else:
            unit, scale = reading.unit, factor_of(reading.unit, GYRO_UNITS)
        axis, sign = parse_axes(str(imu.attrs.get("sensor_axes") or "x,y,z"))
        sources.append(f"Unit and axes: forward, right, down are {names}: {reading.why}.")
    bias = bench.gyro_bias.get("rad_per_s")
    if bias is not None:
        sources.append(f"Bias: {bench.gyro_bias['from']}.")
    sources.append(f"Log: {bench.source}.")
    made = SensorConfiguration(
        rate, unit, scale, axis, sign, (0.0, 0.0, 0.0) if bias is None else bias, tuple(sources)
    )
    return made, each, mean


def _at_rate(imu: pd.DataFrame, each: int, mean: bool) -> pd.DataFrame:
    """Samples of a lower rate: one in so many, or their means, with the first for the start."""
    if each == 1 or not mean:
        return imu.iloc[::each]
    steps = increments_from_imu(imu)
    count = len(steps) // each
    ends = index_of(steps).reshape(-1)[each - 1 : count * each : each]
    sums = steps[THETA].to_numpy()[: count * each].reshape(count, each, 3).sum(axis=1)
    time = np.concatenate([index_of(imu)[:1], ends])
    rates = sums / np.diff(time)[:, None]
    return imu_table(time, np.vstack([rates[:1], rates]), sampling="mean")


def _liveliest(bench: AttitudeComparison, each: int) -> int:
    """Start of the test vector: the stretch with the most rotation, which exercises the code."""
    rate = bench.imu[GYRO].to_numpy()
    energy = (rate * rate).sum(axis=1).cumsum()
    length = VECTOR * each
    if len(energy) <= length:
        return 0
    return int((energy[length:] - energy[:-length]).argmax())
