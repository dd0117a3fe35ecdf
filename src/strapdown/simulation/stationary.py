"""A body that does not move on an Earth that turns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown import rotation
from strapdown.ellipsoids import WGS84, Ellipsoid
from strapdown.simulation.earth_motion import EarthMotion, Kinematics, Origin, check_duration

Array = NDArray[np.float64]


@dataclass(frozen=True)
class StationaryMotion(EarthMotion):
    """Rest: the gyros read the Earth's rate, the accelerometers normal gravity.

    Attributes
    ----------
    duration : float, s
    origin : Origin
    roll_deg, pitch_deg, heading_deg : float, deg
    ellipsoid : Ellipsoid

    Raises
    ------
    ConfigError
        The duration is not positive.
    """

    duration: float
    origin: Origin
    roll_deg: float = 0.0
    pitch_deg: float = 0.0
    heading_deg: float = 0.0
    ellipsoid: Ellipsoid = WGS84

    def __post_init__(self) -> None:
        check_duration(self.duration)

    @property
    def breaks(self) -> Sequence[float]:
        """Start and end, s."""
        return (0.0, self.duration)

    def kinematics(self, time: Array) -> Kinematics:
        """The same at every instant; as `EarthMotion.kinematics`."""
        still = np.zeros((time.size, 3))
        angles = np.array([self.roll_deg, self.pitch_deg, self.heading_deg])
        q_nb = np.tile(rotation.quaternion_from_euler(angles), (time.size, 1))
        turned = np.tile(angles, (time.size, 1))
        return Kinematics(still, still, still, q_nb, still, turned, still)

    def angle(self, time: ArrayLike) -> Array:
        """Integral of the body rate from time zero; (n, 3), rad: the constant rate, times time."""
        t = np.asarray(time, dtype=np.float64)
        return np.asarray(self.rate(np.zeros(1)) * t[:, None])
