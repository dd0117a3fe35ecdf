"""A barometer that rides on a motion, in weather that changes."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pandas as pd

from strapdown.sensors.error_draws import Seed, child, normal, random_walk
from strapdown.sensors.triad_errors import ZERO, Triad
from strapdown.simulation.aid_instants import check_numbers, instants, place_of_point
from strapdown.simulation.earth_motion import EarthMotion
from strapdown.tables import barometer_table

_NOISE, _WALK = 0, 1
_HOUR = 3600.0


@dataclass(frozen=True)
class PressureHeight:
    """What a barometer does to the truth: ``height + bias + noise``.

    Attributes
    ----------
    rate : float, Hz
    noise : float, m
        Standard deviation, new with each row.
    bias : float, m
        At time zero.
    walk : float, m/√h
        By which the bias walks.
    point : triad, m
        Of the barometer, from the point that the motion describes, in its body axes.

    Raises
    ------
    ConfigError
        A number is out of range.
    """

    rate: float = 10.0
    noise: float = 0.2
    bias: float = 0.0
    walk: float = 5.0
    point: Triad = ZERO

    def __post_init__(self) -> None:
        check_numbers(self, "rate", "noise", above=True)
        check_numbers(self, "walk")


def simulate_barometer(
    motion: EarthMotion, barometer: PressureHeight, *, seed: Seed = 0, source: str | None = None
) -> pd.DataFrame:
    """Heights of a barometer over a motion.

    Parameters
    ----------
    motion : EarthMotion
    barometer : PressureHeight
    seed : int or SeedSequence
        Of noise and walk.
    source : str, optional
        Name for messages.

    Returns
    -------
    DataFrame
        Barometer table at the instants ``k / rate``.
    """
    time = instants(motion, barometer.rate)
    height = place_of_point(motion, time, barometer.point)[:, 2]
    density = barometer.walk / math.sqrt(_HOUR)
    steps = np.diff(time, prepend=time[0] - 1.0 / barometer.rate)
    walk = random_walk(child(seed, _WALK), steps, (density, 0.0, 0.0), mean=False)[:, 0]
    noise = barometer.noise * normal(seed, _NOISE, len(time), axes=1)[:, 0]
    return barometer_table(time, height + barometer.bias + walk + noise, barometer.noise, source)
