"""Where a body is while it is aligned: the site that is stated, or the fixes of a receiver."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.alignment.site import Site
from strapdown.ellipsoids import Ellipsoid
from strapdown.exceptions import DataError
from strapdown.frames import geodetic_from_ned, ned_from_geodetic
from strapdown.nav_state import NavState
from strapdown.tables import GEODETIC, POSITION_SD, VELOCITY, VELOCITY_SD, check_gnss
from strapdown.tables.checks import index_of, source_of, values_of

__all__ = ["Place", "fixes_until", "here_by_fix", "site_of_fixes"]

Array = NDArray[np.float64]

# A vehicle changes its velocity by so much, m/s², as one standard deviation.
MANOEUVRE = 1.0


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
    velocity_delay: float = 0.0,
    time_offset_sd: float = 0.0,
    turn_at: Callable[[float], Array] | None = None,
) -> Place:
    """Return where a vehicle is, by its newest fix.

    Parameters
    ----------
    fixes : DataFrame or None
        Until `time`.
    time : float, s
    q_nb : ndarray, (4,)
    lever_arm : ndarray, (3,), m
        Of the antenna, body axes.
    ellipsoid : Ellipsoid
    velocity_delay : float, s
        By which a stated velocity is older than the place of its row.
    time_offset_sd : float, s
        By which the instants of the fixes may be wrong. What this does to the place, velocity
        times it, is left to `by_antenna.errors_by_antenna`.
    turn_at : callable, optional
        Gives the rate of the body at an instant, (3,), rad/s, body axes: what an antenna on an arm
        moves by it is taken off.

    Returns
    -------
    Place
        Carried from the fix by its velocity; an acceleration of 1 m/s² is taken as unknown.

    Raises
    ------
    DataError
        There is no fix with a place.
    """
    place, sd, stamps = _good(fixes, POSITION_SD, time)
    assert fixes is not None
    v, v_sd, since = np.zeros(3), np.full(3, 10.0), np.inf
    told = np.isfinite(values_of(fixes, VELOCITY_SD)).all(axis=1)
    told &= values_of(fixes, ["quality"])[:, 0] > 0.0
    if told.any():
        k = int(np.flatnonzero(told)[-1])
        v, v_sd = values_of(fixes, VELOCITY)[k], values_of(fixes, VELOCITY_SD)[k]
        since = time - float(index_of(fixes)[k]) + velocity_delay
    elif len(stamps) > 1 and stamps[-1] > stamps[-2]:
        step = float(stamps[-1] - stamps[-2])
        v = ned_from_geodetic(place[-1], place[-2], ellipsoid=ellipsoid) / step
        v_sd = np.sqrt(2.0) * sd[-1] / step + 0.5 * MANOEUVRE * step
        since = time - float(stamps[-1])
    if turn_at is not None and not np.isinf(since):
        v = v - rotation.rotate(q_nb, np.cross(turn_at(time - since), lever_arm))
    after = time - float(stamps[-1])
    off = v * after - rotation.rotate(q_nb, lever_arm)
    lat, lon, alt = geodetic_from_ned(off, place[-1], ellipsoid=ellipsoid).tolist()
    state = NavState(time, np.radians(lat), np.radians(lon), alt, v, q_nb)
    P = np.zeros((6, 6))
    carried = np.square(v_sd * after) + (0.5 * MANOEUVRE * after**2) ** 2
    P[:3, :3] = np.diag(np.square(sd[-1]) + carried)
    unknown = 0.0 if np.isinf(since) else since**2 + time_offset_sd**2
    P[3:, 3:] = np.diag(np.square(v_sd) + MANOEUVRE**2 * unknown)
    return Place(state, P)


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
        f"there is no fix with a place until {time:.9g} s, and no site is stated",
        file=None if fixes is None else source_of(fixes),
        quantity="site",
        remedy="state the site, or align where the receiver has fixes",
    )
