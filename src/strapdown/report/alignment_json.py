"""An alignment as JSON: the answer, its bounds, what was found and how."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import Any

import numpy as np
import pandas as pd

from strapdown.alignment.alignment import Alignment
from strapdown.report.alignment_trust import answer_error, trust
from strapdown.report.alignment_words import limits
from strapdown.systems.alignment_run import AlignmentResult
from strapdown.tables import EULER

__all__ = ["alignment_json"]


def alignment_json(result: AlignmentResult) -> dict[str, Any]:
    """Return everything that a program would ask of an alignment.

    Parameters
    ----------
    result : AlignmentResult

    Returns
    -------
    dict
        Angles and their standard deviations in degrees, biases in rad/s and m/s².
    """
    found = trust(result)
    known = answer_error(result)
    spec = result.spec
    return {
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
        "start": _attitude(result.start),
        "end": _attitude(result.end),
        "trust": {
            "verdict": found.verdict,
            "for": [f.plain() for f in found.supporting],
            "against": [f.plain() for f in found.against],
        },
        "limits": [f"{head}: {text}" for head, text in limits(result)],
        "coarse": {"method": result.coarse.method, **_attitude(result.coarse)},
        "fine": None if result.fine is None else _fine(result),
        "compared_with": None
        if known is None
        else {
            "name": known[0],
            "sd_deg": known[2],
            "off_deg": {a: _number(x) for a, x in zip(EULER, known[1], strict=True)},
        },
        "prefilter": _prefilter(result),
        "readiness": {
            "against": result.readiness.against,
            "coarse": _rows(result.readiness.coarse),
            "fine": _rows(_thinned(result.readiness.fine)),
            "refused": [{"time_s": t, "finding": f.plain()} for t, f in result.readiness.refused],
        },
        "what_a_turn_would_tell": [
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
        "findings": [f.plain() for f in result.findings],
    }


def _attitude(one: Alignment) -> dict[str, Any]:
    angles, sd = one.roll_pitch_heading, one.sd_deg
    return {
        "time_s": one.time,
        **{f"{a}_deg": float(angles[k]) for k, a in enumerate(EULER)},
        **{f"{a}_sd_deg": float(sd[k]) for k, a in enumerate(EULER)},
        "q_nb": [float(x) for x in one.q_nb],
        "covariance_ned_rad2": [[float(x) for x in row] for row in one.covariance],
    }


def _fine(result: AlignmentResult) -> dict[str, Any]:
    assert result.fine is not None
    end = result.fine.alignment
    return {
        **_attitude(end),
        **{
            name: None if value is None else [float(x) for x in value]
            for name, value in (
                ("gyro_bias_rad_per_s", end.gyro_bias),
                ("gyro_bias_sd_rad_per_s", end.gyro_bias_sd),
                ("accel_bias_m_per_s2", end.accel_bias),
                ("accel_bias_sd_m_per_s2", end.accel_bias_sd),
            )
        },
        "standing": {
            "position_sd_m": result.fine.standing.position.tolist(),
            "velocity_sd_m_per_s": result.fine.standing.velocity.tolist(),
            "turn_sd_rad": result.fine.standing.turn.tolist(),
        },
    }


def _prefilter(result: AlignmentResult) -> dict[str, Any] | None:
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
    """A history at some thirty of its epochs; all of it stands in fine.csv."""
    if len(table) <= 32:
        return table
    rows = np.unique(np.linspace(0, len(table) - 1, 32).round().astype(int))
    return table.iloc[rows]


def _rows(table: pd.DataFrame) -> list[dict[str, float | None]]:
    return [
        {"time_s": time} | {f"{k}_deg": _number(v) for k, v in row.items()}
        for time, row in zip(table.index.tolist(), table.to_dict("records"), strict=True)
    ]


def _number(value: Any) -> float | None:
    number = float(value)
    return number if math.isfinite(number) else None
