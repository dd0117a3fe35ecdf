"""A recorder on a vehicle: its triads, where it sits, and how its clock relates to the others'."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.exceptions import ConfigError
from strapdown.sensors.triad_errors import ZERO, Triad
from strapdown.sensors.triad_uncertainty import TriadUncertainty

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Mounting:
    """Where a unit sits on the vehicle, and how it is turned.

    Attributes
    ----------
    position : triad, m
        Of the sensors, in vehicle axes (forward, right, down), from the vehicle's origin: any
        point that all positions of a case share.
    angles_deg : triad, deg
        Roll, pitch, heading (3-2-1) that turn vehicle axes into sensor axes.
    position_sd : float, m
        Standard deviation of each coordinate.
    angles_sd_deg : float, deg
        Standard deviation of a small turn about each of the vehicle's axes.
    """

    position: Triad = ZERO
    angles_deg: Triad = ZERO
    position_sd: float = 0.0
    angles_sd_deg: float = 0.0

    def __post_init__(self) -> None:
        for name in ("position", "angles_deg"):
            value = tuple(float(x) for x in getattr(self, name))
            if len(value) != 3 or not all(math.isfinite(x) for x in value):
                raise ConfigError(
                    f"{getattr(self, name)!r} are not three finite numbers",
                    quantity=name,
                    remedy="give forward, right, down in m, and roll, pitch, heading in deg",
                )
            object.__setattr__(self, name, value)
        for name in ("position_sd", "angles_sd_deg"):
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) >= 0.0):
                raise ConfigError(
                    f"{getattr(self, name):g} is no standard deviation",
                    quantity=name,
                    remedy="give zero or more",
                )

    @property
    def C_vs(self) -> Array:  # noqa: N802
        """Turns vectors from sensor into vehicle axes, (3, 3)."""
        return rotation.dcm_from_quaternion(rotation.quaternion_from_euler(self.angles_deg))


@dataclass(frozen=True, eq=False)
class RecordedTriad:
    """One triad of a unit, as recorded.

    Attributes
    ----------
    table : DataFrame
        Index ``time``, s, on the unit's clock; columns ``accel_x accel_y accel_z``, m/s², or
        ``gyro_x gyro_y gyro_z``, rad/s, in sensor axes; ``attrs["sampling"]`` as of an Imu table.
    uncertainty : TriadUncertainty
    name : str
        Of the part, for messages.
    """

    table: pd.DataFrame
    uncertainty: TriadUncertainty
    name: str


@dataclass(frozen=True, eq=False)
class CrashUnit:
    """A recorder on a vehicle.

    Attributes
    ----------
    name : str
    accelerometers : tuple of RecordedTriad
        One or more, the lowest range first.
    gyro : RecordedTriad, optional
    mounting : Mounting
    gyro_from : str, optional
        Name of the unit whose gyro is borrowed, where there is none: a rigid vehicle turns
        everywhere alike.
    trigger : float, s, optional
        Instant of the common trigger on this unit's clock.
    trigger_sd : float, s
        How well that instant is known.
    lender : CrashUnit, optional
        The unit of that name, once its gyro stands in `gyro`, turned into these sensor axes.
    """

    name: str
    accelerometers: tuple[RecordedTriad, ...]
    gyro: RecordedTriad | None = None
    mounting: Mounting = Mounting()
    gyro_from: str | None = None
    trigger: float | None = None
    trigger_sd: float = 0.0
    lender: CrashUnit | None = None
