"""Propose measurements of other sensors that a recording of inertial sensors holds."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.config.alignment import LogTable
from strapdown.constants import STANDARD_GRAVITY
from strapdown.errors import DataError, Finding
from strapdown.formats import holds
from strapdown.formats.aid_table import read_aid_table
from strapdown.formats.clocks import on_clock_of
from strapdown.formats.recording import ABSENT
from strapdown.navigation.measurements.barometer import Barometer
from strapdown.navigation.measurements.measurement import TabulatedMeasurement, longer_by
from strapdown.navigation.measurements.vehicle import Odometer
from strapdown.tables import VELOCITY, VELOCITY_SD
from strapdown.tables.checks import index_of, values_of

__all__ = ["propose_aids"]


Array = NDArray[np.float64]

#: Least number of rows within the samples.
LEAST = 10
#: Error of a height by gusts, doors and fans, m, and that by the wind of travel as a share of the
#: dynamic pressure: an opening that is not flush has a tenth (`Barometer`). How long both last, s.
GUSTS, OF_DYNAMIC, WEATHER = 0.5, 0.1, 30.0
#: Time over which heights are averaged, s: faster they tell no more, and cost updates.
MEAN = 1.0
#: Error of a wheel's speed by slip, a bus that is late, and a lever arm that nobody stated, m/s,
#: and how long it lasts, s.
SLIP, TURN = 0.3, 2.0


def propose_aids(
    log: LogTable, imu: pd.DataFrame, fixes: pd.DataFrame | None
) -> tuple[dict[str, dict[str, Any]], tuple[Finding, ...]]:
    """Propose a table for each stream of a recording that can aid navigation.

    Parameters
    ----------
    log : LogTable
        With a path that can be opened.
    imu : DataFrame
        Imu table of the log.
    fixes : DataFrame, optional
        Gnss table; its speed says how much the wind of travel disturbs a pressure.

    Returns
    -------
    tables : dict of str to dict
        By name of the measurement.
    findings : tuple of Finding
        Of reading; a stream that cannot be read is a warning.
    """
    tables: dict[str, dict[str, Any]] = {}
    findings: list[Finding] = []
    for aid in (Barometer(height_sd=1.0, interval=MEAN), Odometer(speed_sd=1.0)):
        if not holds(Path(log.path), aid.stream):
            continue
        try:
            table = _read(log, aid, imu)
        except DataError as error:
            if error.finding.code not in ABSENT:
                findings.append(error.finding.replace(severity="warning", stream=aid.stream))
            continue
        findings += table.attrs["findings"]
        if len(table) < LEAST:
            continue
        errors = _error_of(aid, fixes)
        step = float(np.median(np.diff(index_of(table))))
        # The filter takes errors as new in each row; those that last have the variance of a mean.
        lasting = errors[0] * math.sqrt(longer_by(step, errors[1]))
        size = math.hypot(_scatter(values_of(table, aid.columns[:1])[:, 0]), lasting)
        own = {"height_sd_m": size, "interval_s": MEAN}
        if not isinstance(aid, Barometer):
            own = {"speed_sd_m_per_s": size}
        stated = {key: float(f"{x:.2g}") for key, x in own.items()}
        tables[aid.kind] = {"kind": aid.kind, "path": log.path, **stated}
    return tables, tuple(findings)


def _read(log: LogTable, aid: TabulatedMeasurement, imu: pd.DataFrame) -> pd.DataFrame:
    """Read the rows of a stream within the samples, on their clock."""
    table = read_aid_table(
        log.path,
        aid.column_units(),
        optional=tuple(aid.sd_options()),
        instead=aid.instead,
        repair=log.repair,
        stream=aid.stream,
    )
    table, _ = on_clock_of(aid.converted(table), imu)
    begin, end = np.searchsorted(index_of(table), index_of(imu)[[0, -1]])
    return table.iloc[begin:end]


def _error_of(aid: TabulatedMeasurement, fixes: pd.DataFrame | None) -> tuple[float, float]:
    """Standard deviation of the errors that last, and how long they do, s."""
    if not isinstance(aid, Barometer):
        return SLIP, TURN
    square = 0.0
    if fixes is not None:
        known = np.isfinite(values_of(fixes, VELOCITY_SD)).all(axis=1)
        speed = np.linalg.norm(values_of(fixes, VELOCITY)[known], axis=1)
        square = float(np.sqrt(np.mean(speed**4))) if known.any() else 0.0
    return math.hypot(GUSTS, OF_DYNAMIC * square / (2.0 * STANDARD_GRAVITY)), WEATHER


def _scatter(values: Array) -> float:
    """Standard deviation from row to row: second differences have six times its variance."""
    return float(np.sqrt(np.square(np.diff(values, n=2)).mean() / 6.0))
