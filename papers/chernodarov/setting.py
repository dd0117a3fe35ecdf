"""Where and with what Chernodarov (2009) is re-made: place, sensors, stages, modules."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.alignment import FineAlignment, FineResult, Site, TwoVector
from strapdown.ellipsoids import find_ellipsoid
from strapdown.estimation import COVARIANCES, ErrorFilter, ErrorModel, QuaternionModel, RobustUpdate
from strapdown.mechanization import MECHANIZATIONS, Mechanization
from strapdown.sensors import ImuUncertainty, load_sensor

Array = NDArray[np.float64]

#: Of the a and e² of the paper.
ELLIPSOID = find_ellipsoid("krassovsky1940")
#: Zelenograd, of the address of the author: the paper prints no coordinates of its test bed.
SITE = Site(55.98, 37.2, 200.0, ELLIPSOID)
ROLL_DEG, PITCH_DEG, HEADING_DEG = 0.5, -0.8, 40.0
SENSOR = load_sensor("fog-1000")
UNCERTAINTY = ImuUncertainty.of_sensor(SENSOR)
#: Ends of coarse and of fine alignment, s: "(100-600 sec)", "Beginning with the moment t=600 sec".
COARSE_END, FINE_END = 100.0, 600.0
#: Navigated without any aid after that, s; the paper does not say how long.
AUTONOMOUS = 3600.0
END = FINE_END + AUTONOMOUS


def wander(height: str = "free") -> Mechanization:
    """Return the mechanization of the paper."""
    return MECHANIZATIONS["wander_azimuth"](ellipsoid=ELLIPSOID.name, height=height)


def stretch(imu: pd.DataFrame, since: float, until: float) -> pd.DataFrame:
    """Return a part of a record, both ends included."""
    part: pd.DataFrame = imu.loc[since - 1e-6 : until + 1e-6]
    part.attrs = dict(imu.attrs)
    return part


def align(
    imu: pd.DataFrame,
    increments: pd.DataFrame | None = None,
    model: type[ErrorModel] = QuaternionModel,
    form: str = "wd",
    mechanization: Mechanization | None = None,
    ends: tuple[float, float] = (COARSE_END, FINE_END),
) -> FineResult:
    """Align as the paper does: coarsely, then by (16)-(18) at 1 Hz.

    Parameters
    ----------
    imu : DataFrame
        Imu table from time zero on.
    increments : DataFrame, optional
        Of the same record, where a pre-filter has made them.
    model, form, mechanization
        Those of the paper, if not given.
    ends : tuple of float, s
        Of the coarse and of the fine alignment.

    Returns
    -------
    FineResult
    """
    coarse = TwoVector().align(stretch(imu, 0.0, ends[0]), SITE, UNCERTAINTY)
    way = FineAlignment(
        mechanization=wander() if mechanization is None else mechanization,
        model=model,
        form=COVARIANCES[form](),
        rule=RobustUpdate(),
    )
    since = coarse.time
    return way.align(stretch(imu, since, ends[1]), SITE, UNCERTAINTY, coarse, increments=increments)


def autonomous_filter(fine: FineResult) -> ErrorFilter:
    """Return the filter that goes on after an alignment: it does not know that the body rests."""
    return replace(fine.filter, rests=False, mechanization=wander("held"))
