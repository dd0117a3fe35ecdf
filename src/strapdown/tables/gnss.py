"""Gnss tables: fixes of a GNSS receiver with their stated standard deviations."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from strapdown.constants import Array
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
from strapdown.units import SPEEDS

GNSS = [*GEODETIC, *VELOCITY, *POSITION_SD, *VELOCITY_SD, "quality"]

# Quality indicators of NMEA 0183 GGA: 0 no fix, 1 autonomous, 2 differential, 3 precise, 4 and 5
# carrier phase, 6 estimated, 7 and 8 manual and simulated.
QUALITIES = range(9)
#: Kinds of fix by this quality, from the best.
FIX_KINDS = {
    4: "fixed", 5: "float", 3: "precise", 2: "differential", 1: "autonomous", 6: "estimated",
    7: "manual", 8: "simulated",
}  # fmt: skip
# A step between fixes defines a velocity where it exceeds the position uncertainty by this factor
# and is faster than a standing receiver wanders.
CLEAR = 5.0
LEAST_SPEED = 0.5  # m/s
LEAST_STEPS = 4
# Relative misfit above which velocities disagree with the positions, and below which another unit,
# order or direction is taken to be right; the same of heights, whose errors are larger.
UNLIKE, ALIKE = 0.3, 0.15
UNLIKE_DOWN, ALIKE_DOWN, LEAST_CLIMB = 1.0, 0.3, 0.05
# Heights that follow the integral of the velocity down: share explained, and in each half of the
# fixes; how far the factor may be from that of a unit, and those of the halves from each other; the
# fewest fixes, and the least root mean square of heights without their trend, m.
FOLLOWS, FOLLOWS_HALF, OF_UNIT, OF_HALVES, LEAST_FIXES, LEAST_RISE = 0.95, 0.9, 0.05, 0.1, 20, 1.0
# Share of the steps that are so long where velocities are said to be unlike, with twice the misfit:
# a few of a receiver that stands are by chance.
MOST = 0.5
# Steps of such parts of the fixes are compared, and those from fix to fix: a drive may come back to
# where it was.
PARTS = (8, 32, 128)

# Findings about the positions, not the velocities.
_OF_PLACES = (
    "tables.places-in-degrees-and-minutes",
    "tables.places-in-radians",
    "tables.places-swapped",
)
#: Units that velocities may be in.
SPEEDS_OF_OTHERS = ("km/h", "kn", "mph", "cm/s", "mm/s")


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
    velocity disagrees with the positions but would agree in another unit, with other signs or north
    and east exchanged, by a course in rad, or with latitude and longitude in rad or exchanged.
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
    check_velocity(table)


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


class Fit(NamedTuple):
    """The reading of velocities that agrees with the positions; empty if none does.

    `row`: of the first step that shows it. `speed`, `moved` (m/s): by the table and its positions.
    """

    name: str
    row: int
    speed: float
    moved: float


def fitting(
    time: Array,
    sd: Array,
    readings: Mapping[str, tuple[Array, Array]],
    limits: tuple[float, float, float] = (UNLIKE, ALIKE, LEAST_SPEED),
) -> Fit | None:
    """Find which of several readings of a velocity agrees with the positions.

    Parameters
    ----------
    time : ndarray, (n,), s
    sd : ndarray, (n,), m
        Standard deviation of each position.
    readings : mapping of str to (ndarray, ndarray)
        By name: velocity north and east, (n, 2), m/s, or down, (n, 1); and the geodetic positions,
        (n, 3), deg, deg, m. The first is that of the table.
    limits : (3,)
        Relative misfit beyond which the table's own reading is not right, and below which another
        one is; the least speed that is compared, m/s.

    Returns
    -------
    Fit or None
        None if the positions do not move enough to decide. Another reading has to agree where the
        table's own does not, in steps longer than `CLEAR` standard deviations.
    """
    unlike, alike, slowest = limits
    (first, (velocity, place)), *others = readings.items()
    axes = slice(2, 3) if velocity.shape[1] == 1 else slice(0, 2)
    fit = None
    for apart in sorted({max(1, len(time) // p) for p in (*PARTS, len(time))}, reverse=True):
        lasted = (time[apart:] - time[:-apart])[:, None]
        least = np.maximum(CLEAR * np.maximum(sd[apart:], sd[:-apart]), slowest * lasted[:, 0])
        moved = place_difference(place[apart:], place[:-apart])[:, axes] / lasted
        plain = _mean_between(velocity, time, apart)
        fits: dict[str, tuple[float, int]] = {}
        for name, (reading, at) in [(first, readings[first]), *others]:
            way = moved
            if at is not place:
                way = place_difference(at[apart:], at[:-apart])[:, axes] / lasted
            clear = np.linalg.norm(way * lasted, axis=1) > least
            if clear.sum() < LEAST_STEPS:
                continue
            own, row = _misfit(plain[clear], moved[clear]), int(np.argmax(clear))
            if name == first:
                speeds = [float(np.linalg.norm(v[row])) for v in (plain, moved)]
                if own < unlike:
                    return Fit(first, row, *speeds)
                if clear.mean() > MOST and own > 2.0 * unlike:
                    fit = fit or Fit("", row, *speeds)
            elif own >= unlike:
                told = _mean_between(reading, time, apart)[clear]
                fits[name] = _misfit(told, way[clear]), row
        name = min(fits, key=lambda one: fits[one][0], default="")
        if name and fits[name][0] < alike:
            row = fits[name][1]
            return Fit(name, row, *(float(np.linalg.norm(v[row])) for v in (plain, moved)))
    return fit


def _misfit(told: Array, way: Array) -> float:
    """Return the median difference of velocities, relative to those by the positions."""
    with np.errstate(divide="ignore", invalid="ignore"):
        off = np.linalg.norm(told - way, axis=1) / np.linalg.norm(way, axis=1)
    return float(np.median(np.where(np.isnan(off), 0.0, off)))


def turned(velocity: Array) -> dict[tuple[str, str], Array]:
    """Return velocities north and east, (n, 2), with other signs and in the other order."""
    named = {s + n: k * velocity[:, j] for j, n in enumerate(("VN", "VE")) for s, k in _SIGNS}
    pairs = [(a, b) for a, b in itertools.permutations(named, 2) if a[-1] != b[-1]]
    return {p: np.column_stack([named[n] for n in p]) for p in pairs if p != ("VN", "VE")}


_SIGNS = (("", 1.0), ("-", -1.0))


def along_course(speed: Array, course: Array) -> Array:
    """Return velocities north and east, (n, 2), by speeds in m/s and courses in rad, (n,)."""
    return np.column_stack([speed * np.cos(course), speed * np.sin(course)])


def check_velocity(table: pd.DataFrame) -> Fit | None:
    """Refuse velocities that match the positions only in another unit, order or direction.

    Returns the reading that agrees, as of `fitting`: its name is empty if the velocities are others
    than those of the positions, in every reading.
    """
    source, time = source_of(table), index_of(table)
    places, sds = values_of(table, GEODETIC), values_of(table, POSITION_SD)
    velocities, fit = values_of(table, VELOCITY), None
    good = usable(table, [*POSITION_SD[:2], *VELOCITY_SD[:2]])
    if good.sum() > LEAST_STEPS:
        readings = _readings(velocities[good, :2], places[good])
        sd = sds[good, :2].max(axis=1)
        fit = fitting(time[good], sd, readings)
        if fit is None or not fit.name:
            factor = clock_factor(time[good], sd, *readings["told"])
            if factor != 1.0:
                raise DataError(
                    "tables.time-in-other-unit", file=source, quantity="time", factor=factor
                )
        if fit is not None and fit.name not in ("", "told"):
            code, pair = fit.name, fit.name.split(",")
            north, east = pair if len(pair) == 2 else ("", "")
            if pair == ["VE", "VN"]:
                code = "tables.velocity-north-east-exchanged"
            elif north:
                code = "tables.velocity-turned"
            elif code in SPEEDS:
                code = "tables.velocity-in-other-unit"
            raise DataError(
                code,
                file=source,
                row=int(np.flatnonzero(good)[fit.row]) + 1,
                quantity="lat, lon" if code in _OF_PLACES else "VN, VE",
                speed=fit.speed,
                moved=fit.moved,
                north=north,
                east=east,
                unit=fit.name,
                factor=SPEEDS.get(fit.name, 1.0),
            )
    good = usable(table, [POSITION_SD[2], VELOCITY_SD[2]])
    if good.sum() > LEAST_STEPS:
        at, down = places[good], velocities[good, 2:]
        limits = (UNLIKE_DOWN, ALIKE_DOWN, LEAST_CLIMB)
        climb = fitting(time[good], sds[good, 2], {"": (down, at), "up": (-down, at)}, limits)
        if climb is not None and climb.name == "up":
            row = int(np.flatnonzero(good)[climb.row]) + 1
            data = {"speed": climb.speed, "moved": climb.moved}
            raise DataError("tables.velocity-up", file=source, row=row, quantity="VD", **data)
        _check_climb(source, time[good], at[:, 2], down[:, 0])
    return fit


#: Units of heights and of velocities down that other tables have, with the factors to m and m/s.
_HEIGHTS = {"m": 1.0, "ft": 0.3048}
_CLIMBS = {
    sign + u: k * SPEEDS[u]
    for u in ("m/s", "ft/s", "ft/min", "km/h", "kn", "cm/s", "mm/s")
    for sign, k in (("", 1.0), ("-", -1.0))
}


def _check_climb(source: str | None, time: Array, alt: Array, down: Array) -> None:
    """Refuse heights, and velocities down, of another unit or sign, by how one follows the other.

    Heights are fitted by the integral of the velocity, a constant and a trend, in all and in each
    half, so that it is their own scatter that decides, and no stated standard deviation.

    Parameters
    ----------
    time : ndarray, (n,), s
    alt : ndarray, (n,), m
    down : ndarray, (n,), m/s
    """
    if time.size < LEAST_FIXES:
        return
    fallen = running_integral(time, down[:, None])[:, 0]
    half = time.size // 2
    parts = [slice(None), slice(None, half), slice(half, None)]
    (factor, share), *halves = [_rise(time[p], alt[p], -fallen[p]) for p in parts]
    if share < FOLLOWS or min(s for _, s in halves) < FOLLOWS_HALF:
        return
    if any(abs(k / factor - 1.0) > OF_HALVES for k, _ in halves):
        return
    pairs = {(h, c): k / hk for h, hk in _HEIGHTS.items() for c, k in _CLIMBS.items()}
    best = min(pairs, key=lambda one: abs(pairs[one] / factor - 1.0))
    if abs(factor - 1.0) < UNLIKE or abs(pairs[best] / factor - 1.0) > OF_UNIT:
        return
    stated = {"alt": best[0]} if best[0] != "m" else {}
    stated |= {"VD": best[1]} if best[1] != "m/s" else {}
    raise DataError(
        "tables.heights-unlike-climb",
        file=source,
        quantity="alt" if "alt" in stated else "VD",
        factor=factor,
        percent=100.0 * share,
        units=[f"{quantity} in {unit}" for quantity, unit in stated.items()],
        python="{" + ", ".join(f'"{q}": "{u}"' for q, u in stated.items()) + "}",
        flags="--gnss-units " + ",".join(f"{q}={u}" for q, u in stated.items()),
        keys="units = {" + ", ".join(f'{q} = "{u}"' for q, u in stated.items()) + "}",
    )


def _rise(time: Array, alt: Array, risen: Array) -> tuple[float, float]:
    """Return the factor of the integral of a velocity by which heights follow it, and the share."""
    trend = np.column_stack([np.ones(time.size), time - time.mean()])
    both = np.column_stack([alt, risen])
    both = both - trend @ np.linalg.lstsq(trend, both, rcond=None)[0]
    whole, size = float(both[:, 0] @ both[:, 0]), float(both[:, 1] @ both[:, 1])
    if whole < time.size * LEAST_RISE**2 or size == 0.0:
        return 1.0, 0.0
    factor = float(both[:, 0] @ both[:, 1]) / size
    return factor, factor**2 * size / whole


#: Factors to s of stamps that count in another unit than the one that is stated.
_CLOCKS = (1e-3, 1e-6, 1e-9, 1e3, 1e6)


def clock_factor(time: Array, sd: Array, velocity: Array, place: Array) -> float:
    """Return the factor to s of stamps of another unit, with which velocity and positions agree.

    Parameters
    ----------
    time : ndarray, (n,)
    sd : ndarray, (n,), m
    velocity : ndarray, (n, 2), m/s
        North and east.
    place : ndarray, (n, 3), deg, deg, m

    Returns
    -------
    float
        1 if the stamps agree as they are, in any reading of the velocity, or if none of `_CLOCKS`
        does.
    """
    own, limits = {"told": (velocity, place)}, (ALIKE, ALIKE, LEAST_SPEED)
    fits = (k for k in _CLOCKS if (f := fitting(k * time, sd, own, limits)) and f.name)
    factor = next(fits, 1.0)
    if factor == 1.0:
        return factor
    plain = fitting(time, sd, _readings(velocity, place))
    return 1.0 if plain is not None and plain.name else factor


def _readings(velocity: Array, place: Array) -> dict[str, tuple[Array, Array]]:
    """Return readings of velocities, (n, 2), and positions, (n, 3), by the code of each."""
    readings = {"told": (velocity, place)}
    readings |= {unit: (velocity * SPEEDS[unit], place) for unit in SPEEDS_OF_OTHERS}
    readings |= {",".join(pair): (other, place) for pair, other in turned(velocity).items()}
    course = np.degrees(np.arctan2(velocity[:, 1], velocity[:, 0]))
    if np.abs(course).max() < 1.001 * 2.0 * np.pi:  # radians that were taken for degrees
        speed = np.hypot(*velocity.T)
        readings["tables.course-in-radians"] = along_course(speed, course), place
    readings["tables.places-in-degrees-and-minutes"] = 0.6 * velocity, place
    if (np.abs(place[:, :2]) < [0.5 * np.pi, np.pi]).all():
        degrees = place * [np.degrees(1.0), np.degrees(1.0), 1.0]
        readings["tables.places-in-radians"] = velocity, degrees
    if np.abs(place[:, 1]).max() < 90.0:
        readings["tables.places-swapped"] = velocity, place[:, [1, 0, 2]]
    return readings


def _mean_between(velocity: Array, time: Array, apart: int) -> Array:
    """Average the velocity between rows that many apart."""
    way = running_integral(time, velocity)
    return np.asarray((way[apart:] - way[:-apart]) / (time[apart:] - time[:-apart])[:, None])
