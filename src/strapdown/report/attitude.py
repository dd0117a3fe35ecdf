"""Write the attitude bench as a sealed bundle: page, figures, JSON, CSV."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown.attitude_comparison.comparison import AttitudeComparison
from strapdown.bundle import Seal, write_bundle, write_json
from strapdown.evaluation.reference_points import Score
from strapdown.formats import csv
from strapdown.report import attitude_words as words
from strapdown.report.attitude_words import (
    share_basis,
    source_of,
)
from strapdown.report.report_bundle import as_comments, finite
from strapdown.tables import EULER, QUATERNION
from strapdown.tables.checks import index_of


def write_attitude(
    bench: AttitudeComparison,
    out: str | Path,
    *,
    report: bool = True,
    force: bool = False,
    png: bool = False,
) -> Seal:
    """Write a bench as a sealed bundle; arguments and errors: as of `AttitudeComparison.save`."""
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
        # Side by side, to 1e-9 and to 1e-6 deg.
        columns: dict[str, NDArray[Any]] = {"time_s": index_of(bench.runs[0].attitude)}
        for run in bench.runs:
            # Neither a comma nor a semicolon, which a reader may take for a column separator.
            name, angles = run.algorithm.replace(",", " "), run.attitude
            columns |= {f"{name} {q}": np.round(angles[q].to_numpy(), 9) for q in QUATERNION}
            columns |= {f"{name} {e}_deg": np.round(angles[e].to_numpy(), 6) for e in EULER}
        conventions = as_comments(words.CONVENTIONS)
        csv.write(folder / "attitude.csv", columns, conventions)
        if len(bench.sweep):
            columns = {str(name): bench.sweep[name].to_numpy() for name in bench.sweep.columns}
            for name, values in columns.items():
                if values.dtype.kind == "f":
                    # Missing values are written as empty fields, not as NaN.
                    known = [None if np.isnan(v) else v for v in values.tolist()]
                    columns[name] = np.array(known, dtype=object)
            comments = {
                "meaning": "drop: samples are left out; sum: increments are summed",
                "error_deg": "what the answer judges: against the truth, else at the reference "
                "points, else own_deg",
                "own_deg": share_basis(bench),
            }
            csv.write(folder / "sweep.csv", columns, comments | conventions)
        if report:
            from strapdown.report.attitude_charts import charts
            from strapdown.report.attitude_document import attitude_document
            from strapdown.report.chart_svg import ChartFigure
            from strapdown.report.document_html import write_report

            drawn = charts(bench)
            write_report(attitude_document(bench, drawn), folder)
            for chart in drawn if png else ():
                ChartFigure(chart).save(folder / "figures" / f"{chart.slug}.png")
    return seals[0]


# Plain data of the attitude bench.


# Each key of a second log carries the unit of its value.
_UNITS = {
    **dict.fromkeys(("start", "end", "middle", "offset", "offset_sd", "smoothing"), "_s"),
    **dict.fromkeys(("bias", "bias_sd", "residual"), "_rad_per_s"),
}


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
    clock, budget, three = bench.clock, bench.budget, ("final", "rms", "max")
    shares = {
        s.algorithm: {
            key: values and dict(zip(three, values, strict=True))
            for key in ("own_deg", "sensor_deg", "single_deg")
            for values in (getattr(s, key),)
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
        "clock": {
            "rate_hz": clock.rate_hz,
            "stamps": clock.kind,
            "repaired": clock.repaired,
            "spread_s": clock.spread,
            "lost_samples": clock.lost,
            "gaps": [{"start_s": g.start, "end_s": g.end} for g in clock.gaps],
        },
        "sensor_error_parts": budget
        and {
            "delay_s": budget.delay_s,
            "delay_sd_s": budget.delay_sd,
            "drift_ppm": budget.drift_ppm,
            "drift_sd_ppm": budget.drift_sd_ppm,
            "bias_rad_per_s": budget.bias.tolist(),
            "matrix": budget.matrix.tolist(),
            "parts": budget.parts.to_dict("records"),
        },
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
        "trials": bench.trials
        and {
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
                "errors": peer.errors and vars(peer.errors),
                "cost": peer.cost and vars(peer.cost),
                "single_precision_deg": peer.single_deg,
                "lowest_rate_hz": peer.lowest_hz,
                "lowest_rate_of_roll_and_pitch_hz": peer.lowest_level_hz,
            }
            for peer in bench.peers
        ],
        "positions": [asdict(place) for place in bench.places],
        "offered_references": [asdict(offer) for offer in bench.offers],
        "second_log": bench.second
        and {key + _UNITS.get(key, ""): value for key, value in asdict(bench.second).items()},
        "sampling_error_deg": bench.sampling_error_deg
        and dict(zip(("final", "max"), bench.sampling_error_deg, strict=True)),
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
        "findings": [f.plain("python") for f in bench.findings],
    }
    return finite(data)


def _final(row: Any, time: float) -> dict[str, float]:
    return (
        {"time_s": time}
        | {q: float(row[q]) for q in QUATERNION}
        | {f"{e}_deg": float(row[e]) for e in EULER}
    )


def _score(score: Score) -> dict[str, Any]:
    data = {"against": score.against, "time_s": score.time}
    keys = ("error_deg", "rms_deg", "max_deg", "turned_deg", "expected_deg", "sd_deg")
    return data | {key: getattr(score, key) for key in keys}
