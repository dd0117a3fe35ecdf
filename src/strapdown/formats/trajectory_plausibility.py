"""Consistency of a trajectory's positions, velocities and headings."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.dsp.running_integral import running_integral
from strapdown.errors import DataError, Finding
from strapdown.rotation import within_half_turn
from strapdown.tables import EULER, VELOCITY

Array = NDArray[np.float64]

__all__ = ["judge_trajectory"]

# A spherical Earth suffices to detect factors of 57.
EARTH = 6.371e6  # m
# Least motion for a conclusion.
LEAST_MOTION = 5.0  # m, root mean square
MOVING = 1.0  # m/s
# Misfit of positions and integrated velocity, as a fraction of the motion: above which they
# disagree, and below which another reading is accepted.
DISAGREE, AGREE = 0.5, 0.1


def judge_trajectory(
    table: pd.DataFrame, *, angles_stated: bool, euler_stated: bool
) -> list[Finding]:
    """Compare positions with the integral of velocity, and heading with the course.

    Parameters
    ----------
    table : DataFrame
        A Trajectory table.
    angles_stated, euler_stated : bool
        Whether the file states the unit of latitude and longitude, and of the attitude; radians
        are then not considered.

    Returns
    -------
    list of Finding
        Positions and velocities that disagree without an apparent reason.

    Raises
    ------
    DataError
        They disagree but agree with latitude and longitude exchanged, or taken as radians; or
        heading disagrees with the course but agrees if taken as radians.
    """
    file = table.attrs.get("source")
    if len(table) < 3:
        return []
    time = table.index.to_numpy(dtype=np.float64)
    velocity = table[VELOCITY[:2]].to_numpy(dtype=np.float64)
    if not euler_stated:
        _refuse_radians_of_attitude(table[EULER].to_numpy(dtype=np.float64), velocity, file)
    moved = running_integral(time, velocity)
    moved -= moved.mean(axis=0)
    size = float(np.sqrt(np.square(moved).sum(axis=1).mean()))
    if not size > LEAST_MOTION:
        return []
    lat, lon = table["lat"].to_numpy(dtype=np.float64), table["lon"].to_numpy(dtype=np.float64)

    def misfit(lat_deg: Array, lon_deg: Array) -> float:
        phi, lam = np.radians(lat_deg), np.unwrap(np.radians(lon_deg))
        place = EARTH * np.column_stack([phi, (lam - lam[0]) * np.cos(phi.mean())])
        place -= place.mean(axis=0)
        return float(np.sqrt(np.square(place - moved).sum(axis=1).mean())) / size

    plain = misfit(lat, lon)
    if plain < DISAGREE:
        return []
    readings: list[tuple[str, Callable[[], float], bool]] = [
        (
            "io.lat-lon-exchanged",
            lambda: misfit(lon, lat),
            bool(np.abs(lon).max() <= 90.0),
        ),
        (
            "io.lat-lon-in-radians",
            lambda: misfit(np.degrees(lat), np.degrees(lon)),
            not angles_stated and bool(np.abs(lat).max() < 1.6 and np.abs(lon).max() < 6.3),
        ),
    ]
    for code, of, possible in readings:
        if possible and (other := of()) < AGREE:
            raise DataError(code, file=file, quantity="lat, lon", misfit=plain, other=other)
    return [
        Finding(
            "io.positions-and-velocities-disagree",
            file=file,
            quantity="lat, lon",
            plain=plain,
        )
    ]


def _refuse_radians_of_attitude(euler: Array, velocity: Array, file: str | None) -> None:
    fast = np.hypot(velocity[:, 0], velocity[:, 1]) > MOVING
    if fast.sum() < 3 or np.abs(euler).max() > 6.3:
        return
    course = np.degrees(np.arctan2(velocity[fast, 1], velocity[fast, 0]))

    def apart(heading_deg: Array) -> float:
        return float(np.median(np.abs(within_half_turn(course - heading_deg))))

    heading = euler[fast, 2]
    plain, radians = apart(heading), apart(np.degrees(heading))
    # No vehicle moves 20 deg off its heading and, by coincidence, along 57 times its heading.
    if plain > 20.0 and radians < 5.0:
        raise DataError(
            "io.heading-in-radians",
            file=file,
            quantity="heading",
            plain=plain,
            radians=radians,
        )
