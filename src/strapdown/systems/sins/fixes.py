"""Where a body is while it is aligned: the site that is stated, or the fixes of a receiver."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.alignment.site import Site
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

# A vehicle changes its velocity by so much, m/s², as one standard deviation.
MANOEUVRE = 1.0
# Fixes among which one stands out, of how long, s, and how few tell it.
LOOKED_AT, LOOKED_BACK, LEAST_LOOKED_AT = 9, 10.0, 4
# It stands out by so many standard deviations.
CLEAR = 5.0


@dataclass(frozen=True, eq=False)
class Place:
    """Place and velocity of the sensors at an instant.

    Attributes
    ----------
    state : NavState
        Its attitude is the one that was given.
    covariance : ndarray, (6, 6)
        Displacement and velocity, north-east-down.
    """

    state: NavState
    covariance: Array


def fixes_until(
    tables: Sequence[pd.DataFrame], time: float, offset: float = 0.0
) -> pd.DataFrame | None:
    """Return the fixes up to an instant as one table.

    Parameters
    ----------
    tables : sequence of DataFrame
        Gnss tables, one after the other.
    time : float, s
    offset : float, s
        Stamps less the time of the inertial sensors.

    Returns
    -------
    DataFrame or None
        By the time of the inertial sensors; None where there is none.
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
    """Return where a body stands, by the median of its fixes.

    Parameters
    ----------
    fixes : DataFrame or None
        Until `time`.
    begin, time : float, s
        Of the rest. Without a fix in it the newest one before is taken.
    ellipsoid : Ellipsoid

    Returns
    -------
    site : Site
    sd : ndarray, (3,), m
        The least that a fix states: what stays the same from fix to fix is not averaged away.

    Raises
    ------
    DataError
        There is no fix with a place.
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
    """Return where a vehicle is, by its newest fix that agrees with those before.

    Parameters
    ----------
    fixes : DataFrame or None
        Until `time`.
    time : float, s
    q_nb : ndarray, (4,)
    lever_arm : ndarray, (3,), m
        Of the antenna, body axes.
    ellipsoid : Ellipsoid
    velocity : ndarray, (3,), m/s
        Of the sensors at `time`, north, east, down.
    velocity_covariance : ndarray, (3, 3), (m/s)²

    Returns
    -------
    Place
        Carried from the fix by the velocity; an acceleration of 1 m/s² is taken as unknown. By
        which a wrong instant of the fix moves it is left to `by_antenna.errors_by_antenna`.

    Raises
    ------
    DataError
        There is no fix with a place.
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
    """The newest place that is where the places before it, carried by velocities, say.

    Places are carried by velocities of which each is the middle one of three; where they should
    be is the middle of what the newest ones say.
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
    """Places, standard deviations and stamps of the fixes that have them."""
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
