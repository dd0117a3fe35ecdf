"""A run of navigation as JSON: where it ended, how well, what was estimated, and how."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import Any

import numpy as np
import pandas as pd

from strapdown.alignment.alignment import Alignment
from strapdown.exceptions import Finding
from strapdown.systems.sins.result import NavigationResult
from strapdown.tables import EULER, GEODETIC, NED, VELOCITY

__all__ = ["navigation_json"]

MODULES = (
    "prefilter",
    "coarse",
    "fine",
    "mechanization",
    "filter",
    "damping",
    "recorder",
    "aiding",
)

POSITION_SD = [f"{name}_sd" for name in NED]


def navigation_json(result: NavigationResult) -> dict[str, Any]:
    """Return everything that a program would ask of a run of navigation.

    Parameters
    ----------
    result : NavigationResult

    Returns
    -------
    dict
        Angles and their standard deviations in degrees; estimates of the sensors in SI.
    """
    record, source = result.record, result.source
    time = record.trajectory.index
    return {
        "record": {
            "name": source.name,
            "what": source.what,
            "samples": len(source.imu),
            "from_s": float(source.imu.index[0]),
            "to_s": float(source.imu.index[-1]),
            "read_as": [asdict(reading) for reading in source.readings],
        },
        "ellipsoid": result.ellipsoid.name,
        "trajectory": {
            "rows": len(time),
            "from_s": float(time[0]),
            "to_s": float(time[-1]),
            "travelled_m": _travelled(record.trajectory),
        },
        "alignment": {
            "coarse": _alignment(result.coarse),
            "fine": None if result.fine is None else _alignment(result.fine.alignment),
        },
        "start": _state(record.trajectory, record.sd, 0),
        "end": _state(record.trajectory, record.sd, -1),
        "sensors": {
            str(name): {
                "unit": record.units.get(str(name), ""),
                "estimate": _number(record.sensors[name].iloc[-1]),
                "sd": _number(record.sensors_sd[name].iloc[-1]),
            }
            for name in record.sensors.columns
        },
        "aids": {name: _innovations(table) for name, table in record.innovations.items()},
        "outages": {
            name: [{"from_s": s.begin, "to_s": s.end} for s in spans]
            for name, spans in record.outages.items()
        },
        "modes": [{"mode": s.name, "from_s": s.begin, "to_s": s.end} for s in record.modes],
        "events": [{"time_s": e.time, "kind": e.kind, "what": e.what} for e in record.events],
        "against": None
        if result.errors is None
        else {
            "name": source.truth_name,
            "from_s": result.errors.start,
            "to_s": result.errors.end,
            "instants": result.errors.samples,
            "errors": {
                e.quantity: {
                    "unit": e.unit,
                    "rms": _number(e.rms),
                    "largest": _number(e.largest),
                    "largest_at_s": _number(e.largest_at),
                    "final": _number(e.final),
                }
                for e in result.errors.errors
            },
        },
        "method": _method(result),
        "findings": [_finding(f) for f in result.findings],
    }


def _method(result: NavigationResult) -> dict[str, Any]:
    """The modules and their options; where files stand is no part of it."""
    chosen: dict[str, Any] = result.spec.model_dump(
        mode="json",
        include=set(MODULES),
        exclude_none=True,
        serialize_as_any=True,
    )
    for aid in chosen["aiding"].values():
        aid.pop("path", None)
    return chosen


def _travelled(trajectory: pd.DataFrame) -> float:
    """Way over the ground, by the velocity, m."""
    speed = np.hypot(trajectory["VN"].to_numpy(), trajectory["VE"].to_numpy())
    time = trajectory.index.to_numpy(dtype=np.float64)
    return float(np.trapezoid(speed, time))


def _state(trajectory: pd.DataFrame, sd: pd.DataFrame, row: int) -> dict[str, Any]:
    """Place, velocity and attitude with the standard deviations of the nearest mark."""
    at, how = trajectory.iloc[row], sd.iloc[row]
    units = dict.fromkeys(VELOCITY, "m_per_s") | dict.fromkeys(EULER, "deg")
    units |= {"lat": "deg", "lon": "deg", "alt": "m"} | dict.fromkeys(NED, "m")
    names = [*GEODETIC, *VELOCITY, *EULER]
    return {
        "time_s": float(trajectory.index[row]),
        **{f"{n}_{units[n]}": _number(at[n]) for n in names},
        "sd_at_s": float(sd.index[row]),
        **{f"{n}_sd_{units[n]}": _number(how[n]) for n in [*NED, *VELOCITY, *EULER]},
    }


def _alignment(one: Alignment | None) -> dict[str, Any] | None:
    if one is None:
        return None
    angles, sd = one.roll_pitch_heading, one.sd_deg
    return {
        "method": one.method,
        "time_s": one.time,
        **{f"{a}_deg": float(angles[k]) for k, a in enumerate(EULER)},
        **{f"{a}_sd_deg": float(sd[k]) for k, a in enumerate(EULER)},
    }


def _innovations(table: pd.DataFrame) -> dict[str, Any]:
    """How often an aid was taken, and how its innovations lie to what was expected of them."""
    labels = [str(c)[3:] for c in table.columns if str(c).startswith("nu ")]
    nu, s, weight = (
        table[[f"{part} {label}" for label in labels]].to_numpy(dtype=np.float64)
        for part in ("nu", "s", "weight")
    )
    used = (weight > 0.0).all(axis=1)
    nis = np.square(nu) / s
    return {
        "epochs": len(table),
        "rejected": int((~used).sum()),
        "mean_nis_per_component": _number(nis[used].mean() if used.any() else math.nan),
        "rms": {
            label: _number(math.sqrt(np.square(nu[used, k]).mean()) if used.any() else math.nan)
            for k, label in enumerate(labels)
        },
    }


def _number(value: Any) -> float | None:
    number = float(value)
    return number if math.isfinite(number) else None


def _finding(finding: Finding) -> dict[str, Any]:
    return {k: v for k, v in asdict(finding).items() if v is not None}
