"""A Doppler log, or another instrument that measures its velocity, on a motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from strapdown import rotation
from strapdown.sensors.error_draws import Seed, normal
from strapdown.sensors.triad_errors import ZERO, Triad
from strapdown.simulation.aid_instants import check_numbers, instants, velocity_of_point
from strapdown.simulation.earth_motion import EarthMotion
from strapdown.tables import body_velocity_table

_NOISE = 0


@dataclass(frozen=True)
class VelocityLog:
    """What an instrument does to the truth: ``(1 + scale) C_ib v_b + noise``.

    Attributes
    ----------
    rate : float, Hz
    noise : triad, m/s
        Standard deviation along each of its axes, new with each row.
    scale : float
        Relative error of the scale factor.
    point : triad, m
        Of the instrument, from the point that the motion describes, in its body axes.
    angles_deg : triad, deg
        Roll, pitch, yaw of these body axes in the instrument (`aiding.vehicle_axes`).

    Raises
    ------
    ConfigError
        A number is out of range.
    """

    rate: float = 2.0
    noise: Triad = (0.02, 0.02, 0.02)
    scale: float = 0.0
    point: Triad = ZERO
    angles_deg: Triad = ZERO

    def __post_init__(self) -> None:
        check_numbers(self, "rate", "noise", above=True)


def simulate_body_velocity(
    motion: EarthMotion, log: VelocityLog, *, seed: Seed = 0, source: str | None = None
) -> pd.DataFrame:
    """Velocities of an instrument over a motion.

    Parameters
    ----------
    motion : EarthMotion
        Of the inertial sensors.
    log : VelocityLog
    seed : int or SeedSequence
        Of the noise.
    source : str, optional
        Name for messages.

    Returns
    -------
    DataFrame
        BodyVelocity table at the instants ``k / rate``.
    """
    time = instants(motion, log.rate)
    velocity = velocity_of_point(motion, time, log.point)
    along = (1.0 + log.scale) * velocity @ rotation.dcm_from_euler(log.angles_deg).T
    noise = normal(seed, _NOISE, len(time)) * np.asarray(log.noise)
    return body_velocity_table(time, along + noise, log.noise, source)
