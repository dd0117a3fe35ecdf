"""Write an alignment as a sealed bundle: page, JSON, tables and figures."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from strapdown.alignment.alignment import Alignment
from strapdown.bundle import write_json
from strapdown.config.alignment import AlignmentSpec
from strapdown.report import report_bundle
from strapdown.report.alignment_document import (
    CONVENTIONS,
    alignment_document,
    answer_error,
    limits,
    trust,
)
from strapdown.systems.alignment_run import AlignmentRun, run_alignment
from strapdown.tables import EULER
from strapdown.tables.checks import index_of


def _configuration(result: AlignmentRun) -> dict[str, Any]:
    return report_bundle.with_file({"alignment": result.spec.plain()}, result)


def _run(configuration: dict[str, Any]) -> AlignmentRun:
    spec = AlignmentSpec.checked(configuration["alignment"])
    return run_alignment(spec, report_bundle.file_of(configuration))


def _write_data(result: AlignmentRun, folder: Path) -> None:
    write_json(folder / "align.json", alignment_json(result))
    comments = report_bundle.as_comments(CONVENTIONS)
    report_bundle.write_table(_attitude(result), folder / "attitude.csv", comments)
    if result.fine is not None:
        report_bundle.write_table(_history(result.fine.history), folder / "fine.csv", comments)


#: Page, JSON, tables and figures of an alignment.
ALIGNMENT = report_bundle.ReportBundle(
    "align", _configuration, _run, report_bundle.with_page(_write_data, alignment_document)
)


def _attitude(result: AlignmentRun) -> pd.DataFrame:
    """Attitude at the requested rate; column names carry units."""
    table = result.attitude
    rate = result.spec.output.rate_hz
    if rate is not None:
        time = index_of(table)
        cell = np.floor((time - time[0]) * rate + 1e-6)
        kept = np.concatenate([[True], np.diff(cell) > 0])
        kept[-1] = True
        table = table[kept]
    return table.rename(columns={a: f"{a}_deg" for a in EULER})


def _history(history: pd.DataFrame) -> pd.DataFrame:
    """Estimates and standard deviations of the fine alignment; column names carry units."""
    units = dict.fromkeys(EULER, "deg")
    units |= {f"gyro_bias_{a}": "rad_per_s" for a in "xyz"}
    units |= {f"accel_bias_{a}": "m_per_s2" for a in "xyz"}
    names = {n + of: f"{n}{of}_{u}" for n, u in units.items() for of in ("", "_sd")}
    return history.rename(columns=names)


# JSON of an alignment: attitude, bounds, findings and method.


def alignment_json(result: AlignmentRun) -> dict[str, Any]:
    """Return an alignment as plain data for programs.

    Returns
    -------
    dict
        Angles and their standard deviations in degrees, biases in rad/s and m/s².
    """
    error, spec = answer_error(result), result.spec
    fine, prefilter = result.fine, result.prefilter
    data = {
        "record": {
            "name": result.source.name,
            "what": result.source.what,
            "samples": len(result.source.imu),
            "from_s": float(result.source.imu.index[0]),
            "to_s": float(result.source.imu.index[-1]),
            "read_as": [asdict(reading) for reading in result.source.readings],
        },
        "site": {
            "lat_deg": result.site.lat_deg,
            "lon_deg": result.site.lon_deg,
            "alt_m": result.site.alt,
            "ellipsoid": spec.site.ellipsoid,
        },
        "start": _attitude_alignment_json(result.start),
        "end": _attitude_alignment_json(result.end),
        "trust": trust(result).json(),
        "limits": [f"{head}: {text}" for head, text in limits(result)],
        "coarse": {"method": result.coarse.method, **_attitude_alignment_json(result.coarse)},
        "fine": fine
        and {
            **_attitude_alignment_json(fine.alignment),
            **{
                f"{triad}{of}_{unit}": None if value is None else value.tolist()
                for triad, unit in (("gyro_bias", "rad_per_s"), ("accel_bias", "m_per_s2"))
                for of in ("", "_sd")
                for value in (getattr(fine.alignment, f"{triad}{of}"),)
            },
            "stationary": {
                "position_sd_m": fine.standing.position.tolist(),
                "velocity_sd_m_per_s": fine.standing.velocity.tolist(),
                "turn_sd_rad": fine.standing.turn.tolist(),
            },
        },
        "compared_with": error
        and {
            "name": error[0],
            "sd_deg": error[2],
            "off_deg": dict(zip(EULER, error[1], strict=True)),
        },
        "prefilter": prefilter
        and {
            "name": prefilter.name,
            "delay_s": prefilter.delay,
            "replaced": len(prefilter.replaced),
            "share": {k: float(v) for k, v in prefilter.share.items()},
        },
        "readiness": {
            "against": result.readiness.against,
            "coarse": _rows(result.readiness.coarse),
            "fine": _rows(_thinned(result.readiness.fine)),
            "refused": [
                {"time_s": t, "finding": f.plain("file")} for t, f in result.readiness.refused
            ],
        },
        "after_a_turn": [
            {
                "turn": one.name,
                "rest_s": one.rest,
                "tilt_sd_deg": list(one.sd_deg[:2]),
                "heading_sd_deg": one.sd_deg[2],
                "gyro_bias_sd_rad_per_s": list(one.gyro_bias_sd),
                "accel_bias_sd_m_per_s2": list(one.accel_bias_sd),
            }
            for one in result.manoeuvres
        ],
        "method": spec.model_dump(
            mode="json", include={"prefilter", "coarse", "fine"}, serialize_as_any=True
        ),
        "findings": [f.plain("file") for f in result.findings],
    }
    return report_bundle.finite(data)


def _attitude_alignment_json(one: Alignment) -> dict[str, Any]:
    data = report_bundle.alignment_data(one)
    del data["method"]
    covariance = [list(row) for row in one.covariance]
    return {**data, "q_nb": list(one.q_nb), "covariance_ned_rad2": covariance}


def _thinned(table: pd.DataFrame) -> pd.DataFrame:
    """Decimate a history to at most 32 epochs; fine.csv holds the whole."""
    if len(table) <= 32:
        return table
    rows = np.unique(np.linspace(0, len(table) - 1, 32).round().astype(int))
    return table.iloc[rows]


def _rows(table: pd.DataFrame) -> list[dict[str, float | None]]:
    return [
        {"time_s": time} | {f"{k}_deg": v for k, v in row.items()}
        for time, row in zip(table.index.tolist(), table.to_dict("records"), strict=True)
    ]
