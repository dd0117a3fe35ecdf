"""Gnss tables: fixes of a GNSS receiver with their stated standard deviations."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from strapdown.dsp.samples import running_integral
from strapdown.errors import DataError
from strapdown.frames import place_difference
from strapdown.tables.checks import (
    GEODETIC,
    POSITION_SD,
    VELOCITY,
    VELOCITY_SD,
    check_columns,
    check_latitude,
    check_rows,
    check_time,
    each_row,
    index_of,
    joined,
    refuse_cell,
    refuse_row,
    source_of,
    values_of,
)

Array = NDArray[np.float64]

GNSS = [*GEODETIC, *VELOCITY, *POSITION_SD, *VELOCITY_SD, "quality"]

# Quality indicators of NMEA 0183 GGA: 0 no fix, 1 autonomous, 2 differential, 3 precise, 4 and 5
# carrier phase, 6 estimated, 7 and 8 manual and simulated.
QUALITIES = range(9)
# A step between fixes defines a speed where it exceeds the position uncertainty by this factor and
# is faster than a walk.
CLEAR = 5.0
LEAST_SPEED = 3.0  # m/s
LEAST_STEPS = 4
# Relative misfit above which velocities disagree with the positions, and below which another unit
# or order is taken to be right.
UNLIKE, ALIKE = 0.3, 0.15

# Findings about the positions, not the velocities.
_OF_PLACES = ("tables.places-in-degrees-and-minutes", "tables.places-swapped")


def gnss_table(
    time: ArrayLike,
    place: ArrayLike,
    velocity: ArrayLike,
    position_sd: ArrayLike,
    velocity_sd: ArrayLike,
    quality: ArrayLike | None = None,
    source: str | None = None,
) -> pd.DataFrame:
    """Make a Gnss table.

    Parameters
    ----------
    time : array_like, (n,), s
        Increasing stamps, on the clock of the inertial sensors.
    place : array_like, (n, 3)
        Of the antenna: geodetic latitude and longitude in deg, height over the ellipsoid in m.
    velocity : array_like, (n, 3), m/s
        Of the antenna relative to the Earth: north, east, down.
    position_sd : array_like, (n, 3) or (3,), m
        Standard deviations north, east, down, with errors that persist between fixes; infinite
        where not measured, whatever number the column holds.
    velocity_sd : array_like, (n, 3) or (3,), m/s
        The same for the velocity.
    quality : array_like, (n,), optional
        0 no fix, 1 autonomous, 2 differential, 4 and 5 carrier phase: as field 6 of NMEA 0183
        GGA. 1 if not given.
    source : str, optional
        Name for messages.

    Raises
    ------
    DataError
        Shapes disagree, or as `check_gnss`.
    """
    blocks = {
        "place": (place, 3),
        "velocity": (velocity, 3),
        "position_sd": (each_row(position_sd, time, 3), 3),
        "velocity_sd": (each_row(velocity_sd, time, 3), 3),
        "quality": (np.ones(np.size(time)) if quality is None else quality, None),
    }
    table = joined(time, GNSS, source, **blocks)
    check_gnss(table)
    return table


def check_gnss(table: pd.DataFrame) -> None:
    """Check a Gnss table.

    DataError: a column is missing, a value is not finite, time does not advance, a latitude is
    beyond 90 deg, a standard deviation is negative or not a number, a quality is unknown, or the
    velocity disagrees with the positions but would agree in km/h or knots, with north and east
    exchanged, or with latitude and longitude exchanged.
    """
    source = source_of(table)
    check_columns(table, GNSS, source)
    check_time(index_of(table), source)
    plain = [*GEODETIC, *VELOCITY, "quality"]
    check_rows(values_of(table, plain), plain, source)
    lat, lon = values_of(table, ["lat", "lon"]).T
    check_latitude(lat, lon, source)
    columns = [*POSITION_SD, *VELOCITY_SD]
    sd = values_of(table, columns)
    refuse_cell(~(sd >= 0.0), "tables.no-standard-deviation-2", source, columns, values=sd)
    quality = values_of(table, ["quality"])[:, 0]
    unknown = ~np.isin(quality, list(QUALITIES))
    refuse_row(unknown, "tables.quality-unknown", source, "quality", quality=quality)
    _check_velocity_fits(table, source)


def usable(table: pd.DataFrame, columns: Sequence[str]) -> NDArray[np.bool_]:
    """Return the rows of a Gnss table with a quality and with finite standard deviations, (n,).

    Parameters
    ----------
    table : DataFrame
    columns : sequence of str
        Standard deviations: infinite where a quantity was not measured.
    """
    sound = values_of(table, ["quality"])[:, 0] > 0.0
    return np.asarray(sound & np.isfinite(values_of(table, columns)).all(axis=1))


def _check_velocity_fits(table: pd.DataFrame, source: str | None) -> None:
    """Refuse velocities that match the positions only in another unit or order."""
    good = usable(table, [*POSITION_SD[:2], *VELOCITY_SD[:2]])
    if good.sum() <= LEAST_STEPS:
        return
    time = index_of(table)[good]
    place, velocity = values_of(table, GEODETIC)[good], values_of(table, VELOCITY)[good, :2]
    # Steps long enough for a clear displacement; slow motion is not checked.
    sd = values_of(table, POSITION_SD[:2])[good].max()
    apart = max(1, len(time) // (2 * LEAST_STEPS))
    lasted = (time[apart:] - time[:-apart])[:, None]
    moved = place_difference(place[apart:], place[:-apart])[:, :2]
    mean = _mean_between(velocity, time, apart)
    clear = (np.hypot(*moved.T) > CLEAR * sd) & (np.hypot(*moved.T) > LEAST_SPEED * lasted[:, 0])
    if clear.sum() < LEAST_STEPS:
        return
    track, told = (moved / lasted)[clear], mean[clear]

    def misfit(reading: Array, way: Array = track) -> float:
        return float(np.median(np.hypot(*(reading - way).T) / np.hypot(*way.T)))

    if misfit(told) < UNLIKE:
        return
    kmh, knots = 3.6, 3600.0 / 1852.0
    readings = {
        "tables.velocity-in-km-h": misfit(told / kmh),
        "tables.velocity-in-knots": misfit(told / knots),
        "tables.velocity-north-east-exchanged": misfit(told[:, ::-1]),
        "tables.places-in-degrees-and-minutes": misfit(told, track / 0.6),
    }
    if np.abs(place[:, 1]).max() < 90.0:
        other = place_difference(place[apart:][:, [1, 0, 2]], place[:-apart][:, [1, 0, 2]])[:, :2]
        readings["tables.places-swapped"] = misfit(told, (other / lasted)[clear])
    code = min(readings, key=lambda name: readings[name])
    if readings[code] > ALIKE:
        return
    row = int(np.flatnonzero(good)[np.flatnonzero(clear)[0]])
    raise DataError(
        code,
        file=source,
        row=row + 1,
        quantity="lat, lon" if code in _OF_PLACES else "VN, VE",
        speed=np.hypot(*told.T)[0],
        moved=np.hypot(*track.T)[0],
    )


def _mean_between(velocity: Array, time: Array, apart: int) -> Array:
    """Average the velocity between rows that many apart."""
    way = running_integral(time, velocity)
    return np.asarray((way[apart:] - way[:-apart]) / (time[apart:] - time[:-apart])[:, None])
