"""Datasets of campaigns: frozen specification, cases and curves, made without a run."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pandas as pd

SENSORS = {"mpu-6050": 8e-3, "icm-42688-p": 2e-3, "adis16505": 3e-4}
DURATIONS = (10.0, 30.0, 60.0, 120.0)
GRID_SCALARS = ("horizontal_end_m", "north_error_m", "north_bound_m", "nees_position")
FLEET_SCALARS = ("lost_share", "gyro_bias_deg_per_h", "duration_s")
AXIS = np.linspace(0.0, 60.0, 31)


def frozen(**given: Any) -> dict[str, Any]:
    """A frozen campaign with the least that one has."""
    least = {
        "title": "A campaign",
        "base": {"kind": "navigate", "file": "tunnel.toml"},
        "cases": {"draws": 1, "method": "random", "seed": 1},
        "parameters": [],
        "keep": {"scalars": {}, "curves": []},
        "coverage": [],
        "rate": [],
        "consistency": [],
        "stop": None,
        "cells": [{}],
        "total": None,
    }
    return {**least, **given}


def grid(draws: int = 60, seed: int = 1) -> tuple[dict[str, Any], pd.DataFrame, pd.DataFrame]:
    """Three sensors by four durations; the bounds of the first sensor are too small."""
    cells = [{"sensor": s, "outage_s": d} for s in SENSORS for d in DURATIONS]
    spec = frozen(
        title="How good must the gyro be?",
        cases={"draws": draws, "method": "random", "seed": seed},
        parameters=[
            {"name": "sensor", "key": "sensors.sensor", "values": list(SENSORS)},
            {"name": "outage_s", "key": "outage.outage_s", "values": list(DURATIONS)},
            {
                "name": "noise_m",
                "key": "gnss.noise_m",
                "draw": "log-uniform",
                "low": 0.01,
                "high": 1.0,
            },
        ],
        keep={"scalars": dict.fromkeys(GRID_SCALARS, "x"), "curves": ["horizontal_m"]},
        coverage=[{"name": "north", "error": "north_error_m", "bound": "north_bound_m"}],
        rate=[{"name": "beyond 10 m", "scalar": "horizontal_end_m", "above": 10.0}],
        consistency=[{"name": "position", "scalar": "nees_position", "dof": 3}],
        cells=cells,
        total=draws * len(cells),
    )
    rows, curves = [], []
    for draw in range(draws):
        rng = np.random.default_rng([seed, draw])
        noise, unit = 10.0 ** rng.uniform(-2.0, 0.0), rng.normal(0.0, 1.0, 3)
        luck, note = rng.random(2)
        for c, cell in enumerate(cells):
            sd = 0.5 * SENSORS[cell["sensor"]] * cell["outage_s"] ** 2 + noise
            error = unit * sd * (2.0 if cell["sensor"] == "mpu-6050" else 1.0)
            row = {
                "case": draw * len(cells) + c,
                "cell": c,
                "draw": draw,
                "seed": 7 * draw,
                **cell,
                "noise_m": noise,
                "status": "refused" if luck < 0.05 else "done",
                "code": "navigation.too-short" if luck < 0.05 else "",
                "findings": "sensors.vibration" if note < 0.1 else "",
                "horizontal_end_m": np.hypot(error[0], error[1]),
                "north_error_m": error[0],
                "north_bound_m": 1.96 * sd,
                "nees_position": error @ error / sd**2,
            }
            if row["status"] != "done":
                row |= dict.fromkeys(GRID_SCALARS, np.nan)
            else:
                curves.append((row["case"], row["horizontal_end_m"]))
            rows.append(row)
    case, end = np.array(curves).T
    table = pd.DataFrame(
        {
            "case": np.repeat(case.astype(int), AXIS.size),
            "x": np.tile(AXIS, case.size),
            "horizontal_m": np.outer(end, (AXIS / 60.0) ** 2).ravel(),
        }
    )
    return spec, pd.DataFrame(rows), table


def fleet(logs: int = 80, seed: int = 2) -> tuple[dict[str, Any], pd.DataFrame]:
    """One case a log, some of which are refused, with two values far out."""
    rng = np.random.default_rng(seed)
    bias = rng.normal(0.0, 10.0, logs)
    bias[[11, 30]] = 500.0, -700.0
    table = pd.DataFrame(
        {
            "case": np.arange(logs),
            "cell": 0,
            "draw": np.arange(logs),
            "seed": 1,
            "log": [f"drives/log-{k:03d}.csv" for k in range(logs)],
            "status": ["refused" if k % 20 == 7 else "done" for k in range(logs)],
            "code": ["log.no-gyro" if k % 20 == 7 else "" for k in range(logs)],
            "findings": ["log.gaps sensors.vibration" if k % 10 == 3 else "" for k in range(logs)],
            "lost_share": rng.exponential(0.004, logs),
            "gyro_bias_deg_per_h": bias,
            "duration_s": rng.lognormal(7.0, 1.0, logs),
        }
    )
    table.loc[table["status"] != "done", list(FLEET_SCALARS)] = np.nan
    spec = frozen(
        title="All logs of the winter",
        base={"kind": "doctor"},
        keep={"scalars": dict.fromkeys(FLEET_SCALARS, "x"), "curves": []},
        rate=[{"name": "more than 1 % lost", "scalar": "lost_share", "above": 0.01}],
        total=logs,
    )
    return spec, table


#: Exact indices of the function of Ishigami and Homma (1990) with a = 7, b = 0.1.
_V1, _V2 = 0.5 * (1.0 + 0.1 * np.pi**4 / 5.0) ** 2, 7.0**2 / 8.0
_V13 = 0.1**2 * np.pi**8 * (1.0 / 18.0 - 1.0 / 50.0)
ISHIGAMI_FIRST = np.array([_V1, _V2, 0.0]) / (_V1 + _V2 + _V13)
ISHIGAMI_TOTAL = np.array([_V1 + _V13, _V2, _V13]) / (_V1 + _V2 + _V13)


def ishigami(samples: int, seed: int) -> tuple[dict[str, Any], pd.DataFrame]:
    """Saltelli's design of the function of Ishigami."""
    rng = np.random.default_rng(seed)
    a, b = rng.uniform(-np.pi, np.pi, (2, samples, 3))
    x = np.stack([a, b, a, a, a], axis=1)
    for i in range(3):
        x[:, 2 + i, i] = b[:, i]
    x = x.reshape(-1, 3)
    y = np.sin(x[:, 0]) + 7.0 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0])
    case = np.arange(len(x))
    names = ("a", "b", "c")
    table = pd.DataFrame(
        {
            "case": case,
            "cell": 0,
            "draw": case,
            "seed": case // 5,
            **dict(zip(names, x.T, strict=True)),
            "status": "done",
            "code": "",
            "findings": "",
            "y": y,
        }
    )
    spec = frozen(
        cases={"draws": samples, "method": "sensitivity", "seed": seed},
        parameters=[
            {"name": n, "key": f"x.{n}", "draw": "uniform", "low": -np.pi, "high": np.pi}
            for n in names
        ],
        keep={"scalars": {"y": "y"}, "curves": []},
        total=len(x),
    )
    return spec, table


def batches(table: pd.DataFrame, rows: int) -> Callable[[], Iterator[pd.DataFrame]]:
    """A function that returns the table in batches, as often as it is called."""
    return lambda: (table.iloc[k : k + rows] for k in range(0, len(table), rows))
