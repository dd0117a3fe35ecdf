"""Whether a satellite receiver says that a vehicle stood."""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.alignment.site import Site
from strapdown.earth import radii_of_curvature
from strapdown.errors import DataError, Finding
from strapdown.tables import VELOCITY, VELOCITY_SD, check_gnss
from strapdown.tables.checks import source_of

Array = NDArray[np.float64]

__all__ = ["still_by_gnss"]

#: A velocity that errs by more than this many standard deviations is a velocity.
CLEAR = 5.0


def still_by_gnss(
    gnss: pd.DataFrame | None, imu: pd.DataFrame, site: Site, heading_sd: float
) -> tuple[Finding, ...]:
    """Refuse a steady motion, which inertial sensors cannot tell from rest.

    Parameters
    ----------
    gnss : DataFrame, optional
        Gnss table; without one nothing is said.
    imu : DataFrame
    site : Site
    heading_sd : float, rad
        What is stated; an error that is small against it is borne.

    Returns
    -------
    tuple of Finding
        One, where the vehicle moves and the heading bears it.

    Raises
    ------
    DataError
        The vehicle moves, and the heading found as if it stood errs by more than its standard
        deviation: the level of a vehicle that goes north turns like one on an Earth that turns
        faster about east, by ``v_N/(R w cos(lat))``.
    """
    if gnss is None:
        return ()
    check_gnss(gnss)
    time = gnss.index.to_numpy(dtype=np.float64)
    during = (time >= imu.index[0]) & (time <= imu.index[-1])
    good = during & (gnss["quality"].to_numpy() > 0.0)
    velocity = gnss.loc[good, VELOCITY].to_numpy(dtype=np.float64)[:, :2]
    sd = gnss.loc[good, VELOCITY_SD].to_numpy(dtype=np.float64)[:, :2]
    told = np.isfinite(sd).all(axis=1)
    if not told.any():
        return ()
    # Errors of fixes are not independent: the mean is taken for no better than one of them.
    mean, spread = velocity[told].mean(axis=0), float(sd[told].mean())
    speed = float(np.hypot(*mean))
    if not speed > CLEAR * max(spread, 1e-3):
        return ()
    meridian, _ = radii_of_curvature(site.lat_deg, ellipsoid=site.ellipsoid)
    rate = float(np.hypot(*mean)) / (float(meridian) + site.alt)
    error = rate / max(float(abs(site.earth_rate[0])), 1e-12)
    moves = Finding(
        "alignment.vehicle-moves",
        file=source_of(gnss),
        row=int(np.flatnonzero(good)[0]) + 1,
        quantity="VN, VE",
        speed=speed,
        fixes=int(told.sum()),
        heading_deg=np.degrees(error),
    )
    if error > heading_sd:
        raise DataError(moves)
    return (moves,)
