"""Navigation of a body at rest without any aid: what comes of it, and what should."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from papers.chernodarov.setting import ELLIPSOID, SITE
from strapdown.earth import radii_of_curvature
from strapdown.estimation import ErrorFilter, FilterState
from strapdown.tables import MOTION, values_of

Array = NDArray[np.float64]

EVERY = 1.0  # s


@dataclass(frozen=True, eq=False)
class Course:
    """Errors of a body that stands where it stood.

    Attributes
    ----------
    time : ndarray, (n,), s
    velocity : ndarray, (n, 2), m/s
        North, east.
    angles : ndarray, (n, 2), rad
        Latitude and longitude less those of the place.
    alt : ndarray, (n,), m
        Height less that of the place.
    """

    time: Array
    velocity: Array
    angles: Array
    alt: Array

    @property
    def speed(self) -> Array:
        """Delta V of Figs. 8 and 9, (n,), m/s."""
        return np.asarray(np.hypot(*self.velocity.T))

    @property
    def place(self) -> Array:
        """North and east, (n, 2), m."""
        meridian, transverse = radii_of_curvature(SITE.lat_deg, ellipsoid=ELLIPSOID)
        parallel = (transverse + SITE.alt) * np.cos(np.radians(SITE.lat_deg))
        return np.asarray(self.angles * np.array([meridian + SITE.alt, parallel]))

    @property
    def circular(self) -> Array:
        """Delta S of Figs. 10 and 11 as a distance, (n,), m."""
        return np.asarray(np.hypot(*self.place.T))

    def at(self, time: float) -> int:
        """Row of an instant."""
        return int(np.searchsorted(self.time, time - 1e-6).clip(max=len(self.time) - 1))


def after(increments: pd.DataFrame, time: float) -> tuple[Array, Array]:
    """Ends and rows of the increments after an instant."""
    ends = increments.index.to_numpy(dtype=np.float64)
    since = int(np.searchsorted(ends, time + 1e-6))
    return ends[since:], np.ascontiguousarray(values_of(increments, MOTION)[since:])


def go(filter_: ErrorFilter, state: FilterState, increments: pd.DataFrame) -> Course:
    """Navigate on from a state to the end of a record, without observations.

    Parameters
    ----------
    filter_ : ErrorFilter
    state : FilterState
        The estimates of the sensors' errors that it holds are taken off, as (6) predicts them.
    increments : DataFrame

    Returns
    -------
    Course
    """
    ends, rows = after(increments, state.time)
    history = np.empty((len(ends), filter_.mechanization.row))
    filter_.advance_compensated(
        state.mechanization.copy(), ends, filter_.compensated(state, rows), history
    )
    every = max(1, round(EVERY / float(np.median(np.diff(ends)))))
    kept = slice(every - 1, None, every)
    path = filter_.mechanization.trajectory(ends[kept], history[kept])
    home = np.radians([SITE.lat_deg, SITE.lon_deg])
    return Course(
        ends[kept],
        path[["VN", "VE"]].to_numpy(),
        np.radians(path[["lat", "lon"]].to_numpy()) - home,
        path["alt"].to_numpy() - SITE.alt,
    )
