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
from strapdown.report.alignment_document import (
    CONVENTIONS,
    alignment_document,
    answer_error,
    limits,
    trust,
)
from strapdown.report.report_bundle import (
    ReportBundle,
    as_comments,
    file_of,
    finite,
    with_file,
    with_page,
    write_table,
)
from strapdown.systems.alignment_run import AlignmentRun, run_alignment
from strapdown.tables import EULER
from strapdown.tables.checks import index_of


def _configuration(result: AlignmentRun) -> dict[str, Any]:
    return with_file({"alignment": result.spec.plain()}, result)


def _run(configuration: dict[str, Any]) -> AlignmentRun:
    spec = AlignmentSpec.checked(configuration["alignment"])
    return run_alignment(spec, file_of(configuration))


def _write_data(result: AlignmentRun, folder: Path) -> None:
    write_json(folder / "align.json", alignment_json(result))
    comments = as_comments(CONVENTIONS)
    write_table(_attitude(result), folder / "attitude.csv", comments)
    if result.fine is not None:
        write_table(_history(result.fine.history), folder / "fine.csv", comments)


#: Page, JSON, tables and figures of an alignment.
ALIGNMENT = ReportBundle("align", _configuration, _run, with_page(_write_data, alignment_document))


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
    names = {n: f"{n}_{u}" for n, u in units.items()}
    names |= {f"{n}_sd": f"{n}_sd_{u}" for n, u in units.items()}
    return history.rename(columns=names)


# JSON of an alignment: attitude, bounds, findings and method.


def alignment_json(result: AlignmentRun) -> dict[str, Any]:
    """Return an alignment as plain data for programs.

    Returns
    -------
    dict
        Angles and their standard deviations in degrees, biases in rad/s and m/s².
    """
    error = answer_error(result)
    spec = result.spec
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
        "fine": None if result.fine is None else _fine(result),
        "compared_with": None
        if error is None
        else {
            "name": error[0],
            "sd_deg": error[2],
            "off_deg": dict(zip(EULER, error[1], strict=True)),
        },
        "prefilter": _prefilter(result),
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
                "tilt_sd_deg": [float(x) for x in one.sd_deg[:2]],
                "heading_sd_deg": float(one.sd_deg[2]),
                "gyro_bias_sd_rad_per_s": [float(x) for x in one.gyro_bias_sd],
                "accel_bias_sd_m_per_s2": [float(x) for x in one.accel_bias_sd],
            }
            for one in result.manoeuvres
        ],
        "method": spec.model_dump(
            mode="json", include={"prefilter", "coarse", "fine"}, serialize_as_any=True
        ),
        "findings": [f.plain("file") for f in result.findings],
    }
    return finite(data)


def _attitude_alignment_json(one: Alignment) -> dict[str, Any]:
    angles, sd = one.roll_pitch_heading, one.sd_deg
    return {
        "time_s": one.time,
        **{f"{a}_deg": float(angles[k]) for k, a in enumerate(EULER)},
        **{f"{a}_sd_deg": float(sd[k]) for k, a in enumerate(EULER)},
        "q_nb": [float(x) for x in one.q_nb],
        "covariance_ned_rad2": [[float(x) for x in row] for row in one.covariance],
    }


def _fine(result: AlignmentRun) -> dict[str, Any]:
    assert result.fine is not None
    end = result.fine.alignment
    return {
        **_attitude_alignment_json(end),
        **{
            name: None if value is None else [float(x) for x in value]
            for name, value in (
                ("gyro_bias_rad_per_s", end.gyro_bias),
                ("gyro_bias_sd_rad_per_s", end.gyro_bias_sd),
                ("accel_bias_m_per_s2", end.accel_bias),
                ("accel_bias_sd_m_per_s2", end.accel_bias_sd),
            )
        },
        "stationary": {
            "position_sd_m": result.fine.standing.position.tolist(),
            "velocity_sd_m_per_s": result.fine.standing.velocity.tolist(),
            "turn_sd_rad": result.fine.standing.turn.tolist(),
        },
    }


def _prefilter(result: AlignmentRun) -> dict[str, Any] | None:
    report = result.prefilter
    if report is None:
        return None
    return {
        "name": report.name,
        "delay_s": report.delay,
        "replaced": len(report.replaced),
        "share": {k: float(v) for k, v in report.share.items()},
    }


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
