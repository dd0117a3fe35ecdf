"""Barometer tables: heights of a sensor by the pressure of the air."""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from strapdown.errors import DataError
from strapdown.tables.checks import (
    as_array,
    check_rows,
    checked_values,
    each_row,
    joined,
    source_of,
)

Array = NDArray[np.float64]

BAROMETER = ["height", "height_sd"]

# US Standard Atmosphere (1976), up to 11 km that of ISO 2533: at the height of the sea 288.15 K and
# 1013.25 hPa, 6.5 K less a km of geopotential height; the gas constant of air, the gravity of that
# height, the radius by which geopotential height is made of height.
TEMPERATURE, PRESSURE, LAPSE = 288.15, 101325.0, 0.0065
GAS, GRAVITY, RADIUS = 287.05287, 9.80665, 6_356_766.0
EXPONENT = GAS * LAPSE / GRAVITY
# Of that layer, m, and the pressure at its top, Pa.
TOP, LEAST_PRESSURE = 11_000.0, 22_632.0
# No pressure of open air is higher: 1085 hPa was measured; and mines and tanks beside.
MOST_PRESSURE = 120_000.0
# Heights of a barometer are within, m.
LOWEST, HIGHEST = -2_000.0, 50_000.0


def standard_height(pressure_pa: ArrayLike) -> Array:
    """Return the height at which the standard atmosphere has a pressure.

    Parameters
    ----------
    pressure_pa : array_like, (n,), Pa
        22 632 (at 11 km of geopotential height) to 120 000.

    Returns
    -------
    ndarray, (n,), m
        Geometric, over the sea. ``H = T0 / L (1 - (p / p0)^(R L / g))``, ``h = r H / (r - H)``:
        US Standard Atmosphere (1976), Eqs. (33a), (19).
    """
    ratio = np.asarray(pressure_pa, dtype=np.float64) / PRESSURE
    geopotential = TEMPERATURE / LAPSE * (1.0 - ratio**EXPONENT)
    return np.asarray(RADIUS * geopotential / (RADIUS - geopotential))


def standard_slope(pressure_pa: ArrayLike) -> Array:
    """Return how that height falls with pressure, (n,), m/Pa; negative."""
    p = np.asarray(pressure_pa, dtype=np.float64)
    geopotential = TEMPERATURE / LAPSE * (1.0 - (p / PRESSURE) ** EXPONENT)
    slope = -(TEMPERATURE - LAPSE * geopotential) * GAS / (GRAVITY * p)
    return np.asarray(slope * (RADIUS / (RADIUS - geopotential)) ** 2)


def barometer_table(
    time: ArrayLike, height: ArrayLike, height_sd: ArrayLike, source: str | None = None
) -> pd.DataFrame:
    """Make a Barometer table.

    Parameters
    ----------
    time : array_like, (n,), s
        On the clock of the inertial sensors.
    height : array_like, (n,), m
        Upward; over anything that stays the same, as the sea or the place of the start.
    height_sd : array_like, (n,) or float, m
        Of the noise of each; infinite where nothing was measured.
    source : str, optional
        Name for messages.

    Returns
    -------
    DataFrame

    Raises
    ------
    DataError
        Shapes disagree, or as `check_barometer`.
    """
    blocks = {"height": (height, None), "height_sd": (each_row(height_sd, time), None)}
    table = joined(time, BAROMETER, source, **blocks)
    check_barometer(table)
    return table


def barometer_from_pressure(
    time: ArrayLike, pressure_pa: ArrayLike, pressure_sd_pa: ArrayLike, source: str | None = None
) -> pd.DataFrame:
    """Make a Barometer table of pressures, by the standard atmosphere.

    Parameters
    ----------
    time : array_like, (n,), s
    pressure_pa : array_like, (n,), Pa
        Static; 22 632 to 120 000.
    pressure_sd_pa : array_like, (n,) or float, Pa
    source : str, optional
        Name for messages.

    Returns
    -------
    DataFrame

    Raises
    ------
    DataError
        A pressure is not that of open air below 11 km; what is in hPa or kPa is told so.
    """
    p = as_array(pressure_pa, None, "pressure_pa", source)
    check_rows(p[:, None], ["pressure_pa"], source)
    wrong = np.flatnonzero((p < LEAST_PRESSURE) | (p > MOST_PRESSURE))
    if wrong.size:
        row = int(wrong[0])
        middle = float(np.median(p))
        code = "tables.pressure-of-no-air"
        for other, factor in (("tables.pressure-in-hpa", 100.0), ("tables.pressure-in-kpa", 1e3)):
            if LEAST_PRESSURE <= factor * middle <= MOST_PRESSURE:
                code = other
                break
        raise DataError(
            code,
            file=source,
            row=row + 1,
            quantity="pressure_pa",
            pressure=p[row],
        )
    spread = as_array(each_row(pressure_sd_pa, p), None, "pressure_sd_pa", source)
    return barometer_table(time, standard_height(p), -standard_slope(p) * spread, source)


def check_barometer(table: pd.DataFrame) -> None:
    """Check a Barometer table.

    Parameters
    ----------
    table : DataFrame

    Raises
    ------
    DataError
        A column is missing, a value is not finite, time does not advance, a standard deviation is
        not above zero, or a height is none.
    """
    height = checked_values(table, ["height"], ["height_sd"])[:, 0]
    beyond = np.flatnonzero((height < LOWEST) | (height > HIGHEST))
    if beyond.size:
        row = int(beyond[0])
        raise DataError(
            "tables.no-height-barometer"
            if height[row] > HIGHEST
            else "tables.no-height-barometer-2",
            file=source_of(table),
            row=row + 1,
            quantity="height",
            height=height[row],
        )
