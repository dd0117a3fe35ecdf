"""Position during an alignment: the stated site, or the fixes of a receiver."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.alignment.alignment import Site
from strapdown.constants import MAD_TO_SD
from strapdown.dsp.running_integral import running_integral
from strapdown.ellipsoids import Ellipsoid
from strapdown.errors import DataError
from strapdown.frames import geodetic_from_ned, ned_from_geodetic
from strapdown.nav_state import NavState
from strapdown.tables import GEODETIC, POSITION_SD, VELOCITY, VELOCITY_SD, check_gnss
from strapdown.tables.checks import index_of, source_of, values_of

__all__ = ["Place", "fixes_until", "here_by_fix", "site_of_fixes"]

Array = NDArray[np.float64]

# Standard deviation of a vehicle's acceleration, m/s².
MANOEUVRE = 1.0
# Fixes considered for outliers: most, longest time, s, and fewest.
LOOKED_AT, LOOKED_BACK, LEAST_LOOKED_AT = 9, 10.0, 4
# Standard deviations that make a fix an outlier.
CLEAR = 5.0


@dataclass(frozen=True, eq=False)
class Place:
    """Position and velocity of the sensors at an instant.

    Attributes
    ----------
    state : NavState
        With the given attitude.
    covariance : ndarray, (6, 6)
        Displacement and velocity, north-east-down.
    """

    state: NavState
    covariance: Array


def fixes_until(
    tables: Sequence[pd.DataFrame], time: float, offset: float = 0.0
) -> pd.DataFrame | None:
    """Concatenate the fixes up to an instant.

    Parameters
    ----------
    tables : sequence of DataFrame
        Gnss tables, one after the other.
    time : float, s
    offset : float, s
        Stamps minus the time of the inertial sensors.

    Returns
    -------
    DataFrame or None
        By the time of the inertial sensors; None without fixes.
    """
    if not tables:
        return None
    joined = tables[0] if len(tables) == 1 else pd.concat(tables)
    out: pd.DataFrame = joined[joined.index - offset <= time]
    if offset:
        out = out.set_axis(out.index - offset)
    out.attrs = dict(tables[0].attrs)
    if out.empty:
        return None
    check_gnss(out)
    return out


def site_of_fixes(
    fixes: pd.DataFrame | None, begin: float, time: float, ellipsoid: Ellipsoid
) -> tuple[Site, Array]:
    """Return the position of a stationary body, by the median of its fixes.

    Parameters
    ----------
    fixes : DataFrame or None
        Fixes until `time`.
    begin, time : float, s
        Of the rest. If it holds no fix, the newest one before is taken.
    ellipsoid : Ellipsoid

    Returns
    -------
    site : Site
    sd : ndarray, (3,), m
        The smallest stated by a fix: correlated errors do not average out.

    Raises
    ------
    DataError
        No fix has a position.
    """
    place, sd, stamps = _good(fixes, POSITION_SD, time)
    first = min(int(np.searchsorted(stamps, begin)), len(stamps) - 1)
    lat, lon, alt = np.median(place[first:], axis=0).tolist()
    return Site(lat, lon, alt, ellipsoid), np.asarray(sd[first:].min(axis=0))


def here_by_fix(
    fixes: pd.DataFrame | None,
    time: float,
    q_nb: Array,
    lever_arm: Array,
    ellipsoid: Ellipsoid,
    velocity: Array,
    velocity_covariance: Array,
) -> Place:
    """Return the position of a vehicle, by its newest fix that agrees with those before.

    Parameters
    ----------
    fixes : DataFrame or None
        Fixes until `time`.
    time : float, s
    q_nb : ndarray, (4,)
    lever_arm : ndarray, (3,), m
        Lever arm of the antenna, body axes.
    ellipsoid : Ellipsoid
    velocity : ndarray, (3,), m/s
        Velocity of the sensors at `time`, north, east, down.
    velocity_covariance : ndarray, (3, 3), (m/s)²

    Returns
    -------
    Place
        Propagated from the fix by the velocity; the acceleration is unknown, 1 m/s². The effect of
        a wrong stamp of the fix is left to `by_antenna.errors_by_antenna`.

    Raises
    ------
    DataError
        No fix has a position.
    """
    place, sd, stamps = _good(fixes, POSITION_SD, time)
    assert fixes is not None
    k = _newest_that_agrees(fixes, place, sd, stamps, ellipsoid)
    after = time - float(stamps[k])
    off = velocity * after - rotation.rotate(q_nb, lever_arm)
    lat, lon, alt = geodetic_from_ned(off, place[k], ellipsoid=ellipsoid).tolist()
    state = NavState(time, np.radians(lat), np.radians(lon), alt, velocity, q_nb)
    P = np.zeros((6, 6))
    unknown = np.square(sd[k]) + (0.5 * MANOEUVRE * after**2) ** 2
    P[:3, :3] = np.diag(unknown) + velocity_covariance * after**2
    P[:3, 3:] = P[3:, :3] = velocity_covariance * after
    P[3:, 3:] = velocity_covariance
    return Place(state, P)


def _newest_that_agrees(
    fixes: pd.DataFrame, place: Array, sd: Array, stamps: Array, ellipsoid: Ellipsoid
) -> int:
    """Newest position that agrees with the positions before it, propagated by velocities.

    Each velocity is the median of three; the expected position is the median of the predictions
    by the newest fixes.
    """
    rows = np.flatnonzero(stamps >= stamps[-1] - LOOKED_BACK)[-LOOKED_AT:]
    told = np.isfinite(values_of(fixes, VELOCITY_SD)).all(axis=1)
    told &= values_of(fixes, ["quality"])[:, 0] > 0.0
    if len(rows) < LEAST_LOOKED_AT or told.sum() < LEAST_LOOKED_AT:
        return len(stamps) - 1
    v, v_time = values_of(fixes, VELOCITY)[told], index_of(fixes)[told]
    near = np.clip(np.arange(len(v))[:, None] + np.arange(-1, 2), 0, len(v) - 1)
    v = np.median(v[near], axis=1)
    v = np.column_stack([np.interp(stamps[rows], v_time, one) for one in v.T])
    way = running_integral(stamps[rows], v)
    at = np.array([ned_from_geodetic(one, place[-1], ellipsoid=ellipsoid) for one in place[rows]])
    off = at - way
    off -= np.median(off, axis=0)
    usual = np.maximum(sd[rows], MAD_TO_SD * np.median(np.abs(off), axis=0))
    good = (np.abs(off) <= CLEAR * usual).all(axis=1)
    return int(rows[np.flatnonzero(good)[-1]]) if good.any() else len(stamps) - 1


def _good(
    fixes: pd.DataFrame | None, columns: Sequence[str], time: float
) -> tuple[Array, Array, Array]:
    """Positions, standard deviations and stamps of the fixes that have them."""
    if fixes is not None:
        sd = values_of(fixes, columns)
        good = np.isfinite(sd).all(axis=1) & (values_of(fixes, ["quality"])[:, 0] > 0.0)
        if good.any():
            return values_of(fixes, GEODETIC)[good], sd[good], index_of(fixes)[good]
    raise DataError(
        "navigation.no-position-for-alignment",
        file=None if fixes is None else source_of(fixes),
        quantity="site",
        time=time,
    )
