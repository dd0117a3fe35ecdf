"""Motions of a hand: from rest to rest, in rotation and in place."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown.errors import ConfigError
from strapdown.simulation.euler_motion import Quaternion, euler_attitude, euler_body_rate
from strapdown.simulation.flat_motion import FlatMotion
from strapdown.simulation.minimum_jerk import STILL, Track
from strapdown.simulation.rate_integral import RateIntegral, integrate_rate

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Gesture(FlatMotion):
    """Six coordinates, each moving from value to value with least jerk.

    Where all tracks hold, the rate, the velocity and the acceleration are exactly zero, and
    wherever the values are those of another rest, or whole turns away, the pose is that pose to
    the last bit (the quaternion apart from its sign).

    Attributes
    ----------
    duration : float, s
    roll, pitch, heading : Track, deg
        3-2-1 angles from the initial attitude; any number of turns.
    north, east, down : Track, m
    q_nb : tuple of float
        Initial attitude, scalar first.

    Raises
    ------
    ConfigError
        The duration is not positive.
    """

    duration: float
    roll: Track = STILL
    pitch: Track = STILL
    heading: Track = STILL
    north: Track = STILL
    east: Track = STILL
    down: Track = STILL
    q_nb: Quaternion = (1.0, 0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        if not 0.0 < self.duration < np.inf:
            raise ConfigError(
                "simulation.motion-cannot-last", quantity="duration", duration=self.duration
            )

    def rate(self, time: ArrayLike) -> Array:
        """Body rate.

        Parameters
        ----------
        time : array_like, (n,), s

        Returns
        -------
        ndarray, (n, 3), rad/s
        """
        angles, rates, _ = self._turned(time)
        return euler_body_rate(angles, rates)

    def angle(self, time: ArrayLike) -> Array:
        """Integral of the body rate from time zero.

        Parameters
        ----------
        time : array_like, (n,), s
            Before zero and after the end the integral stays as it is there.

        Returns
        -------
        ndarray, (n, 3), rad
            Within 1e-14 rad and rounding (`rate_integral.integrate_rate`); exactly constant at
            rest.
        """
        return self._integral(time)

    def attitude(self, time: ArrayLike) -> Array:
        """Exact attitude.

        Parameters
        ----------
        time : array_like, (n,), s

        Returns
        -------
        ndarray, (n, 4)
            ``q_nb``, continuous in sign.
        """
        return euler_attitude(self._turned(time)[0], self.q_nb)

    def acceleration(self, time: ArrayLike) -> Array:
        """Acceleration without gravity; (n, 3), north-east-down, m/s²."""
        return self._moved(time)[2]

    def velocity(self, time: ArrayLike) -> Array:
        """Velocity; (n, 3), north-east-down, m/s."""
        return self._moved(time)[1]

    def position(self, time: ArrayLike) -> Array:
        """Position; (n, 3), north-east-down, m."""
        return self._moved(time)[0]

    def _turned(self, time: ArrayLike) -> tuple[Array, Array, Array]:
        return _evaluate((self.roll, self.pitch, self.heading), time)

    def _moved(self, time: ArrayLike) -> tuple[Array, Array, Array]:
        return _evaluate((self.north, self.east, self.down), time)

    @cached_property
    def _integral(self) -> RateIntegral:
        knots = [*self.roll.times, *self.pitch.times, *self.heading.times]
        inside = [t for t in knots if 0.0 < t < self.duration]
        return integrate_rate(self.rate, [0.0, *inside, self.duration])


def gesture(poses: Sequence[Sequence[float]], duration: float) -> Gesture:
    """Make a gesture from a list of poses at which everything stops.

    Parameters
    ----------
    poses : sequence of (time, roll, pitch, heading, north, east, down)
        s, deg, m; rising times.
    duration : float, s

    Returns
    -------
    Gesture

    Raises
    ------
    ConfigError
        As `Track` and `Gesture`.
    """
    times, *columns = (tuple(float(x) for x in column) for column in zip(*poses, strict=True))
    roll, pitch, heading, north, east, down = (Track(times, values) for values in columns)
    return Gesture(duration, roll, pitch, heading, north, east, down)


def _evaluate(tracks: tuple[Track, Track, Track], time: ArrayLike) -> tuple[Array, Array, Array]:
    values, first, second = zip(*(track.evaluate(time) for track in tracks), strict=True)
    return np.column_stack(values), np.column_stack(first), np.column_stack(second)
