"""How late the velocity of a receiver is against its own places."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.errors import Finding
from strapdown.frames import place_difference
from strapdown.tables import GEODETIC, POSITION_SD, VELOCITY, VELOCITY_SD
from strapdown.tables.checks import index_of, source_of, values_of

__all__ = ["VelocityDelay", "find_velocity_delay", "velocity_delay"]

Array = NDArray[np.float64]

#: Delays that are looked at, s.
LARGEST = 2.0
#: Steps from fix to fix that are needed, and the longest of them, s: beyond, a velocity says little
#: of what is between.
LEAST_STEPS, LONGEST_STEP = 20, 1.5
#: Length of the pieces over which places and velocities are compared, s: long beside their noise,
#: short beside what the errors of places are correlated over.
PIECE = 2.0
#: A delay is told where it is so many standard deviations, and matters: where it makes the velocity
#: wrong by this part of its stated standard deviation.
SURE, MATTERS = 4.0, 0.5


@dataclass(frozen=True)
class VelocityDelay:
    """How late the velocity is against the places of the same rows.

    Attributes
    ----------
    delay, sd : float, s
    changing : float, m/s²
        Root mean square of the acceleration, by which it was found.
    steps : int
    """

    delay: float
    sd: float
    changing: float
    steps: int


def velocity_delay(table: pd.DataFrame) -> VelocityDelay | None:
    """Find the delay at which the integral of the velocity goes from place to place best.

    Parameters
    ----------
    table : DataFrame
        Gnss table.

    Returns
    -------
    VelocityDelay or None
        None where there are no 20 steps of no more than 1.5 s with both, or nothing accelerates.

    Notes
    -----
    A place moves by ``V(t_k + d) - V(t_j + d)``, V the integral of the velocity by its stamps (a
    cubic spline), d the delay, and k as many steps after j as make 2 s. The sum of the squares of
    what is left is least where d is right, by Gauss-Newton from the best of a grid. The standard
    deviation allows for what is correlated, as pieces that overlap are (Newey and West,
    Econometrica 55 (1987) 703).
    """
    good = values_of(table, ["quality"])[:, 0] > 0.0
    good &= np.isfinite(values_of(table, [*POSITION_SD, *VELOCITY_SD])).all(axis=1)
    if good.sum() <= LEAST_STEPS:
        return None
    time = index_of(table)[good]
    time = time - time[0]
    place, velocity = values_of(table, GEODETIC)[good], values_of(table, VELOCITY)[good]
    steps = np.diff(time)
    apart = max(1, round(PIECE / float(np.median(steps))))
    if len(time) <= LEAST_STEPS + apart:
        return None
    from scipy.interpolate import CubicSpline

    moved = place_difference(place[apart:], place[:-apart])
    speed = CubicSpline(time, velocity)
    way = speed.antiderivative()
    # Where the spline goes over a gap, or would be asked beyond its end, nothing is known.
    holes = time[:-1][steps > LONGEST_STEP], time[1:][steps > LONGEST_STEP]
    begin, end = time[:-apart] - LARGEST, time[apart:] + LARGEST
    near = (begin >= time[0]) & (end <= time[-1])
    for left_of, right_of in zip(*holes, strict=True):
        near &= (end <= left_of) | (begin >= right_of)
    if near.sum() < LEAST_STEPS:
        return None

    def between(values: Array) -> Array:
        return np.asarray((values[apart:] - values[:-apart])[near])

    def left(delay: float) -> Array:
        return np.asarray(moved[near] - between(way(time + delay)))

    grid = np.arange(-LARGEST, LARGEST + 1e-9, 0.05)
    delay = float(grid[np.argmin([np.square(left(d)).sum() for d in grid])])
    for _ in range(6):
        gained = between(speed(time + delay))
        power = float(np.square(gained).sum())
        if power == 0.0:
            return None
        delay += float((gained * left(delay)).sum()) / power
        delay = min(max(delay, -LARGEST), LARGEST)
    score = (gained * left(delay)).sum(axis=1)
    variance, lags = float(score @ score), 2 * apart
    # Where what is left is correlated against itself, the sum may come to nothing.
    least = 0.05 * variance
    for lag in range(1, min(lags, len(score) - 1) + 1):
        variance += 2.0 * (1.0 - lag / (lags + 1)) * float(score[lag:] @ score[:-lag])
    changing = float(np.sqrt(power / np.square(between(time)).sum()))
    return VelocityDelay(
        delay, float(np.sqrt(max(variance, least))) / power, changing, int(near.sum())
    )


def find_velocity_delay(table: pd.DataFrame, assumed: float = 0.0) -> list[Finding]:
    """Tell a delay that is sure and matters.

    Parameters
    ----------
    table : DataFrame
        Gnss table.
    assumed : float, s
        What is configured already.

    Returns
    -------
    list of Finding
        With the option that takes it away; empty where there is nothing to tell.
    """
    found = velocity_delay(table)
    if found is None:
        return []
    off = found.delay - assumed
    sds = values_of(table, VELOCITY_SD)
    stated = float(np.median(sds[np.isfinite(sds)]))
    if abs(off) < SURE * found.sd or abs(off) * found.changing < MATTERS * stated:
        return []
    return [
        Finding(
            "navigation.velocity-later-than-position"
            if found.delay > 0.0
            else "navigation.velocity-earlier-than-position",
            file=source_of(table),
            quantity="VN, VE, VD",
            delay=abs(found.delay),
            sd=found.sd,
            configured=assumed,
            steps=found.steps,
        )
    ]
