"""A wheel that rolls along on a motion."""

from __future__ import annotations

from dataclasses import dataclass

import pandas as pd

from strapdown import rotation
from strapdown.sensors.error_draws import Seed, normal
from strapdown.sensors.triad_errors import ZERO, Triad
from strapdown.simulation.aid_instants import check_numbers, instants, velocity_of_point
from strapdown.simulation.earth_motion import EarthMotion
from strapdown.tables import odometer_table

_NOISE = 0


@dataclass(frozen=True)
class WheelSpeed:
    """What a wheel does to the truth: ``(1 + scale) v_forward + noise``.

    Attributes
    ----------
    rate : float, Hz
    noise : float, m/s
        Standard deviation, new with each row.
    scale : float
        Relative error of the scale factor.
    point : triad, m
        Of the wheel, from the point that the motion describes, in its body axes.
    angles_deg : triad, deg
        Roll, pitch, yaw of these body axes in the vehicle (`aiding.vehicle_axes`).

    Raises
    ------
    ConfigError
        A number is out of range.
    """

    rate: float = 10.0
    noise: float = 0.05
    scale: float = 0.0
    point: Triad = ZERO
    angles_deg: Triad = ZERO

    def __post_init__(self) -> None:
        check_numbers(self, "rate", "noise", above=True)


def simulate_odometer(
    motion: EarthMotion, wheel: WheelSpeed, *, seed: Seed = 0, source: str | None = None
) -> pd.DataFrame:
    """Speeds of a wheel over a motion.

    Parameters
    ----------
    motion : EarthMotion
        Of the inertial sensors.
    wheel : WheelSpeed
    seed : int or SeedSequence
        Of the noise.
    source : str, optional
        Name for messages.

    Returns
    -------
    DataFrame
        Odometer table at the instants ``k / rate``.
    """
    time = instants(motion, wheel.rate)
    velocity = velocity_of_point(motion, time, wheel.point)
    forward = velocity @ rotation.dcm_from_euler(wheel.angles_deg)[0]
    noise = wheel.noise * normal(seed, _NOISE, len(time), axes=1)[:, 0]
    return odometer_table(time, (1.0 + wheel.scale) * forward + noise, wheel.noise, source)
