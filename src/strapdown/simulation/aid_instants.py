"""When an aid that rides on a motion measures, and how its point of the body moves then."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown import rotation
from strapdown.errors import ConfigError
from strapdown.sensors.antenna import antenna_motion
from strapdown.simulation.earth_motion import EarthMotion
from strapdown.tables import GEODETIC, VELOCITY

__all__ = ["check_numbers", "instants", "place_of_point", "velocity_of_point"]

Array = NDArray[np.float64]

_MOST = 1_000_000


def instants(motion: EarthMotion, rate: float) -> Array:
    """Return the instants ``k / rate`` within a motion, (n,), s.

    Raises
    ------
    ConfigError
        There is no more than one, or there are too many.
    """
    count = math.floor(rate * motion.duration * (1.0 + 1e-12)) + 1
    if not 2 <= count <= _MOST:
        raise ConfigError(
            "simulation.hz-gives-rows",
            quantity="rate",
            rate=rate,
            count=count,
            duration=motion.duration,
            most=_MOST,
        )
    return np.minimum(np.arange(count) / rate, motion.duration)


def place_of_point(motion: EarthMotion, time: Array, arm: ArrayLike) -> Array:
    """Return where a point of the body is, (n, 3): latitude, longitude in deg, height in m."""
    return _point(motion, time, arm)[0]


def velocity_of_point(motion: EarthMotion, time: Array, arm: ArrayLike) -> Array:
    """Return how a point of the body moves relative to the Earth, body axes, (n, 3), m/s."""
    return rotation.rotate(rotation.conjugate(motion.attitude(time)), _point(motion, time, arm)[1])


def check_numbers(sensor: object, *names: str, above: bool = False) -> None:
    """Refuse attributes that are negative or not finite; or zero, if they must be above it."""
    for name in names:
        value = np.asarray(getattr(sensor, name), dtype=np.float64)
        if not np.isfinite(value).all() or (value < 0.0).any() or (above and (value == 0.0).any()):
            raise ConfigError(
                "simulation.sensor-not-positive" if above else "simulation.sensor-negative",
                quantity=name,
                value=getattr(sensor, name),
            )


def _point(motion: EarthMotion, time: Array, arm: ArrayLike) -> tuple[Array, Array]:
    truth = motion.trajectory(time)
    return antenna_motion(
        truth[GEODETIC].to_numpy(dtype=np.float64),
        truth[VELOCITY].to_numpy(dtype=np.float64),
        motion.attitude(time),
        motion.rate(time),
        arm,
        ellipsoid=motion.ellipsoid,
    )
