"""A compass, or a baseline of two antennas, on a motion."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pandas as pd

from strapdown import rotation
from strapdown.sensors.error_draws import Seed, normal
from strapdown.simulation.aid_instants import check_numbers, instants
from strapdown.simulation.earth_motion import EarthMotion
from strapdown.tables import heading_table

_NOISE = 0


@dataclass(frozen=True)
class Compass:
    """What a compass does to the truth: ``azimuth of an axis + misalignment + noise``.

    Attributes
    ----------
    rate : float, Hz
    noise_deg : float, deg
        Standard deviation, new with each row.
    misalignment_deg : float, deg
    axis_deg : float, deg
        Of the axis in the body, from forward to the right.

    Raises
    ------
    ConfigError
        A number is out of range.
    """

    rate: float = 5.0
    noise_deg: float = 1.0
    misalignment_deg: float = 0.0
    axis_deg: float = 0.0

    def __post_init__(self) -> None:
        check_numbers(self, "rate", "noise_deg", above=True)


def simulate_heading(
    motion: EarthMotion, compass: Compass, *, seed: Seed = 0, source: str | None = None
) -> pd.DataFrame:
    """Headings of a compass over a motion.

    Parameters
    ----------
    motion : EarthMotion
    compass : Compass
    seed : int or SeedSequence
        Of the noise.
    source : str, optional
        Name for messages.

    Returns
    -------
    DataFrame
        Heading table at the instants ``k / rate``; 0 to 360 deg.
    """
    time = instants(motion, compass.rate)
    angle = math.radians(compass.axis_deg)
    axis = np.array([math.cos(angle), math.sin(angle), 0.0])
    north, east, _ = rotation.rotate(motion.attitude(time), axis).T
    noise = compass.noise_deg * normal(seed, _NOISE, len(time), axes=1)[:, 0]
    read = np.degrees(np.arctan2(east, north)) + compass.misalignment_deg + noise
    return heading_table(time, np.mod(read, 360.0), compass.noise_deg, source)
