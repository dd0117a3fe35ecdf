"""Propose measurements of other sensors that a recording of inertial sensors holds."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.alignment.two_vector import triad
from strapdown.config.logs import LogTable
from strapdown.constants import STANDARD_GRAVITY
from strapdown.dsp.samples import white_sd
from strapdown.earth import FIRST_YEAR, LAST_YEAR, THIS_YEAR, magnetic_field
from strapdown.errors import DataError, Finding
from strapdown.formats import holds
from strapdown.formats.clocks import on_clock_of, year_of
from strapdown.formats.recording import ABSENT
from strapdown.navigation.measurements.barometer import Barometer
from strapdown.navigation.measurements.magnetometer import Magnetometer
from strapdown.navigation.measurements.measurement import TabulatedMeasurement, longer_by
from strapdown.navigation.measurements.vehicle import Odometer
from strapdown.systems.navigation_source import read_measured
from strapdown.tables import ACCEL, GEODETIC, MAG, VELOCITY, VELOCITY_SD
from strapdown.tables.checks import index_of, values_of

Array = NDArray[np.float64]

#: Least number of rows within the samples.
LEAST = 10
#: Error of a height by gusts, doors and fans, m, and that by the wind of travel as a share of the
#: dynamic pressure: an opening that is not flush has a tenth (`Barometer`). How long both last, s.
GUSTS, OF_DYNAMIC, WEATHER = 0.5, 0.1, 30.0
#: Time over which heights are averaged, s: faster they show no more, and cost updates.
MEAN = 1.0
#: Error of a wheel's speed by slip, a bus that is late, and a lever arm that nobody stated, m/s,
#: and how long it lasts, s.
SLIP, TURN = 0.3, 2.0
#: Differences of the Earth's field, as a share of its strength and in dip, deg, that show iron: of
#: hard iron that turns a heading by about as much.
WEAK, DIP = 0.15, 8.0
#: Least standard deviation of a magnetic heading, deg; least horizontal share of the field.
LEAST_SD, LEVEL = 5.0, 0.1
#: Length at the start over which a heading is read, s.
BEGIN = 2.0
#: Parts of it, whose headings show whether the body turns or accelerates.
PARTS = 4


@dataclass(frozen=True)
class Magnetic:
    """A magnetometer of the recording, as a table that a person may switch on.

    Attributes
    ----------
    table : dict
        Of the measurement, with the field by the World Magnetic Model.
    year : float
        Of the model; `THIS_YEAR` if the recording has no date.
    dated : bool
    heading_deg : float
        Of the body at the start, true, as if without hard iron.
    spread_deg : float
        Standard deviation of the headings of the parts of the start, deg: of a body that turns or
        accelerates there.
    measured, expected : tuple of float
        Strength, uT, and dip, deg, of the field at the start, and by the model.
    """

    table: dict[str, Any]
    year: float
    dated: bool
    heading_deg: float
    spread_deg: float
    measured: tuple[float, float]
    expected: tuple[float, float]

    @property
    def disturbed(self) -> bool:
        """Whether the field at the start is not that of the Earth."""
        strength, dip = (a - b for a, b in zip(self.measured, self.expected, strict=True))
        return abs(strength) > WEAK * self.expected[0] or abs(dip) > DIP

    @property
    def heading_sd_deg(self) -> float:
        """Standard deviation of the heading, deg.

        Strength and dip show two components of an error of the field; the third, across it, is
        taken to be as large, and turns the heading by itself over the horizontal field. The motion
        of the heading over the start is added.
        """
        (size, dip), (expected, steep) = self.measured, self.expected
        seen = math.hypot(size / expected - 1.0, math.radians(dip - steep)) / math.sqrt(2.0)
        level = max(math.cos(math.radians(steep)), LEVEL)
        return math.hypot(max(LEAST_SD, math.degrees(seen / level)), self.spread_deg)


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
        size = math.hypot(float(white_sd(values_of(table, aid.columns[:1]))[0]), lasting)
        own = {"height_sd_m": size, "interval_s": MEAN}
        if not isinstance(aid, Barometer):
            own = {"speed_sd_m_per_s": size}
        stated = {key: float(f"{x:.2g}") for key, x in own.items()}
        tables[aid.kind] = {"kind": aid.kind, "path": log.path, **stated}
    return tables, tuple(findings)


def _read(log: LogTable, aid: TabulatedMeasurement, imu: pd.DataFrame) -> pd.DataFrame:
    """Read the rows of a stream within the samples, on their clock."""
    table, _ = on_clock_of(read_measured(aid, log.path, repair=log.repair), imu)
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


def propose_magnetometer(
    log: LogTable,
    imu: pd.DataFrame,
    fixes: pd.DataFrame | None,
    place: tuple[float, float, float] | None,
) -> Magnetic | None:
    """Propose the magnetometer of a recording, at a position; None without either.

    Parameters
    ----------
    imu : DataFrame
        Imu table of the log, with the columns of a field or without.
    fixes : DataFrame, optional
        They may have the date, and the position.
    place : tuple of float, optional
        Latitude and longitude in deg, height in m.
    """
    if place is None and fixes is not None:
        lat, lon, alt = np.median(values_of(fixes, GEODETIC)[:LEAST], axis=0).tolist()
        place = (lat, lon, alt)
    readings, path = _field(log, imu)
    if place is None or readings is None or readings.empty:
        return None
    dates = (year for table in (imu, fixes) if table is not None and (year := year_of(table)))
    year = next(dates, None)
    at = float(np.clip(year or THIS_YEAR, FIRST_YEAR, LAST_YEAR))
    model = magnetic_field(*place, at)
    field = tuple(round(x, 2) for x in model.field_ned)
    table = {"kind": "magnetometer", **path, "field_ned_ut": field}
    down, known = np.array([0.0, 0.0, 1.0]), np.array(model.field_ned)

    def attitude(begin: float, end: float) -> tuple[Array, Array]:
        """C_nb and field of a part of the start; the mean specific force is up."""
        force = values_of(imu.loc[begin:end], ACCEL).mean(axis=0)
        mag = values_of(readings.loc[begin:end], MAG).mean(axis=0)
        return triad(down, known) @ triad(-force, mag).T, mag

    edges = imu.index[0] + np.linspace(0.0, BEGIN, PARTS + 1)
    C_nb, mag = attitude(edges[0], edges[-1])
    heading = float(rotation.euler_from_dcm(C_nb)[2]) % 360.0
    parts = itertools.pairwise(edges)
    held = [(a, b) for a, b in parts if len(readings.loc[a:b]) and len(imu.loc[a:b])]
    own = [rotation.euler_from_dcm(attitude(a, b)[0])[2] - heading for a, b in held]
    spread = float(np.sqrt(np.mean(np.square(rotation.within_half_turn(np.array(own))))))
    size = float(np.linalg.norm(mag))
    dip = math.asin(float(np.clip((C_nb @ mag)[2] / size, -1.0, 1.0)))
    measured = size, math.degrees(dip)
    return Magnetic(
        table,
        at,
        year is not None,
        heading,
        spread,
        measured,
        (model.strength, model.inclination),
    )


def _field(log: LogTable, imu: pd.DataFrame) -> tuple[pd.DataFrame | None, dict[str, str]]:
    """Return the magnetic field along the body, and the path of a stream apart."""
    if set(MAG) <= set(imu.columns):
        seen = np.flatnonzero(np.isfinite(values_of(imu, MAG)).all(axis=1))
        return imu[MAG].iloc[seen], {}
    if not holds(Path(log.path), Magnetometer.stream):
        return None, {}
    try:
        return _read(log, Magnetometer(interval=0.0), imu), {"path": log.path}
    except DataError:
        return None, {}
