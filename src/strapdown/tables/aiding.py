"""Tables of aiding sensors: barometer, body velocity, heading, odometer."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from strapdown.errors import DataError
from strapdown.tables.checks import (
    Array,
    as_array,
    check_rows,
    checked_values,
    each_row,
    joined,
    refuse_cell,
    refuse_row,
    source_of,
    values_of,
)

BAROMETER = ["height", "height_sd"]

# US Standard Atmosphere (1976), identical to ISO 2533 up to 11 km: 288.15 K and 1013.25 hPa at sea
# level, lapse rate 6.5 K/km of geopotential height; gas constant of air, standard gravity, and the
# Earth radius that relates geopotential and geometric height.
TEMPERATURE, PRESSURE, LAPSE = 288.15, 101325.0, 0.0065
GAS, GRAVITY, RADIUS = 287.05287, 9.80665, 6_356_766.0
EXPONENT = GAS * LAPSE / GRAVITY
# Top of that layer, m, and the pressure there, Pa.
TOP, LEAST_PRESSURE = 11_000.0, 22_632.0
# Upper limit of open air (1085 hPa has been measured), with room for mines and tanks, Pa.
MOST_PRESSURE = 120_000.0
# Limits of barometric height, m.
LOWEST, HIGHEST = -2_000.0, 50_000.0


def standard_height(pressure_pa: ArrayLike) -> Array:
    """Compute the height at which the standard atmosphere has a pressure.

    `pressure_pa` ((n,), Pa): 22 632 (at 11 km of geopotential height) to 120 000. Returns (n,), m:
    geometric, above mean sea level. ``H = T0 / L (1 - (p / p0)^(R L / g))``, ``h = r H / (r - H)``:
    US Standard Atmosphere (1976), Eqs. (33a), (19).
    """
    ratio = np.asarray(pressure_pa, dtype=np.float64) / PRESSURE
    geopotential = TEMPERATURE / LAPSE * (1.0 - ratio**EXPONENT)
    return np.asarray(RADIUS * geopotential / (RADIUS - geopotential))


def standard_slope(pressure_pa: ArrayLike) -> Array:
    """Compute the derivative of that height by pressure, (n,), m/Pa; negative."""
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
        Positive up, above any constant reference such as sea level or the start.
    height_sd : array_like, (n,) or float, m
        Standard deviation of the noise of each height; infinite where not measured.
    source : str, optional
        Name for messages.

    Raises
    ------
    DataError
        Shapes disagree, or as `check_barometer`.
    """
    sd = each_row(height_sd, time)
    table = joined(time, BAROMETER, source, height=(height, None), height_sd=(sd, None))
    check_barometer(table)
    return table


def barometer_from_pressure(
    time: ArrayLike, pressure_pa: ArrayLike, pressure_sd_pa: ArrayLike, source: str | None = None
) -> pd.DataFrame:
    """Make a Barometer table from pressures, by the standard atmosphere.

    Parameters
    ----------
    time : array_like, (n,), s
    pressure_pa : array_like, (n,), Pa
        Static; 22 632 to 120 000.
    pressure_sd_pa : array_like, (n,) or float, Pa
    source : str, optional
        Name for messages.

    Raises
    ------
    DataError
        A pressure is not that of open air below 11 km; the message names hPa or kPa if that fits.
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
        raise DataError(code, file=source, row=row + 1, quantity="pressure_pa", pressure=p[row])
    spread = as_array(each_row(pressure_sd_pa, p), None, "pressure_sd_pa", source)
    return barometer_table(time, standard_height(p), -standard_slope(p) * spread, source)


def check_barometer(table: pd.DataFrame) -> None:
    """Check a Barometer table.

    DataError: a column is missing, a value is not finite, time does not advance, a standard
    deviation is not above zero, or a height is outside -2000 m to 50 000 m.
    """
    height = checked_values(table, ["height"], ["height_sd"])[:, 0]
    beyond = (height < LOWEST) | (height > HIGHEST)
    over = (height[beyond][:1] > HIGHEST).any()
    code = "tables.no-height-barometer" if over else "tables.no-height-barometer-2"
    refuse_row(beyond, code, source_of(table), "height", height=height)


# BodyVelocity tables: velocity along the axes of an instrument, for example a Doppler sensor.


BODY_VELOCITY = ["vx", "vy", "vz", "vx_sd", "vy_sd", "vz_sd"]

# Upper limit of a velocity by Doppler or camera, m/s.
FASTEST = 400.0


def body_velocity_table(
    time: ArrayLike, velocity: ArrayLike, velocity_sd: ArrayLike, source: str | None = None
) -> pd.DataFrame:
    """Make a BodyVelocity table.

    Parameters
    ----------
    time : array_like, (n,), s
        On the clock of the inertial sensors.
    velocity : array_like, (n, 3), m/s
        Relative to the Earth, along the instrument's forward, right, down.
    velocity_sd : array_like, (n, 3) or (3,), m/s
        Infinite where an axis was not measured.
    source : str, optional
        Name for messages.

    Raises
    ------
    DataError
        Shapes disagree, or as `check_body_velocity`.
    """
    blocks = {"velocity": (velocity, 3), "velocity_sd": (each_row(velocity_sd, time, 3), 3)}
    table = joined(time, BODY_VELOCITY, source, **blocks)
    check_body_velocity(table)
    return table


def check_body_velocity(table: pd.DataFrame) -> None:
    """Check a BodyVelocity table.

    DataError: a column is missing, a value is not finite, time does not advance, a standard
    deviation is not above zero, or a velocity is beyond 400 m/s.
    """
    velocity = checked_values(table, BODY_VELOCITY[:3], BODY_VELOCITY[3:])
    code, columns = "tables.faster-than-such-instrument-measures", BODY_VELOCITY[:3]
    refuse_cell(np.abs(velocity) > FASTEST, code, source_of(table), columns, velocity=velocity)


# Heading tables: from a compass or the baseline of two antennas.


HEADING = ["heading", "heading_sd"]

TURN = 2.0 * math.pi
# To detect headings in rad: fraction of a turn that the record covers, and that two rows jump.
FILLED, LEAPT = 0.97, 0.9
# Upper limit of a standard deviation of heading, deg: a uniform distribution has 104.
MOST_SD = 110.0


def heading_table(
    time: ArrayLike, heading: ArrayLike, heading_sd: ArrayLike, source: str | None = None
) -> pd.DataFrame:
    """Make a Heading table.

    Parameters
    ----------
    time : array_like, (n,), s
        On the clock of the inertial sensors.
    heading : array_like, (n,), deg
        Clockwise from north, -360 to 360.
    heading_sd : array_like, (n,) or float, deg
        Standard deviation of the noise of each heading; infinite where not measured.
    source : str, optional
        Name for messages.

    Raises
    ------
    DataError
        Shapes disagree, or as `check_heading`.
    """
    blocks = {"heading": (heading, None), "heading_sd": (each_row(heading_sd, time), None)}
    table = joined(time, HEADING, source, **blocks)
    check_heading(table)
    return table


def check_heading(table: pd.DataFrame) -> None:
    """Check a Heading table.

    DataError: a column is missing, a value is not finite, time does not advance, a standard
    deviation is not above zero or finite beyond 110 deg, a heading is beyond a turn, or all
    headings are within a turn in rad and jump by one.
    """
    heading = checked_values(table, ["heading"], ["heading_sd"])[:, 0]
    sd = values_of(table, ["heading_sd"])[:, 0]
    source = source_of(table)
    beyond = np.abs(heading) > 360.0
    refuse_row(beyond, "tables.heading-more-than-turn", source, "heading", heading=heading)
    wide, code = np.isfinite(sd) & (sd > MOST_SD), "tables.standard-deviation-says-nothing-heading"
    refuse_row(wide, code, source, "heading_sd", sd=sd)
    leaps = np.abs(np.diff(heading))
    in_radians = np.ptp(heading) <= 1.001 * TURN if len(heading) else False
    if in_radians and np.ptp(heading) > FILLED * TURN and leaps.max() > LEAPT * TURN:
        row = int(np.argmax(leaps)) + 1
        raise DataError(
            "tables.all-headings-within-leap-radians",
            file=source,
            row=row + 1,
            quantity="heading",
            heading=heading.min(),
            heading_2=heading.max(),
            heading_3=heading[row - 1],
            heading_4=heading[row],
        )


# Odometer tables: speed of a wheel.


ODOMETER = ["speed", "speed_sd"]

# Upper limit of wheel speed for road vehicles and trains, m/s; beyond, it is likely in km/h.
ODOMETER_FASTEST = 100.0


def odometer_table(
    time: ArrayLike, speed: ArrayLike, speed_sd: ArrayLike, source: str | None = None
) -> pd.DataFrame:
    """Make an Odometer table.

    Parameters
    ----------
    time : array_like, (n,), s
        On the clock of the inertial sensors.
    speed : array_like, (n,), m/s
        Along the wheel, forward positive.
    speed_sd : array_like, (n,) or float, m/s
        Standard deviation of the noise, without the scale factor; infinite where not measured.
    source : str, optional
        Name for messages.

    Raises
    ------
    DataError
        Shapes disagree, or as `check_odometer`.
    """
    blocks = {"speed": (speed, None), "speed_sd": (each_row(speed_sd, time), None)}
    table = joined(time, ODOMETER, source, **blocks)
    check_odometer(table)
    return table


def check_odometer(table: pd.DataFrame) -> None:
    """Check an Odometer table.

    DataError: a column is missing, a value is not finite, time does not advance, a standard
    deviation is not above zero, or a speed is beyond 100 m/s.
    """
    speed = checked_values(table, ["speed"], ["speed_sd"])[:, 0]
    in_km_h = np.abs(speed).max(initial=0.0) < 3.6 * ODOMETER_FASTEST
    code = "tables.faster-than-wheel-rolls" if in_km_h else "tables.faster-than-wheel-rolls-2"
    beyond = np.abs(speed) > ODOMETER_FASTEST
    refuse_row(beyond, code, source_of(table), "speed", speed=speed)
