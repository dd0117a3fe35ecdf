"""Hand motions of the scenarios, pose by pose."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown.errors import ConfigError
from strapdown.simulation.minimum_jerk import STILL, Track
from strapdown.simulation.motion import FlatMotion, Quaternion, euler_attitude, euler_body_rate
from strapdown.simulation.rate_integral import RateIntegral, integrate_rate

# Hand motions from rest to rest, in rotation and position.


Array = NDArray[np.float64]


@dataclass(frozen=True)
class Gesture(FlatMotion):
    """Six coordinates, each following a minimum-jerk profile from value to value.

    Where all tracks are constant, rate, velocity and acceleration are exactly zero. Where the
    values equal those of another rest, or differ by whole turns, the pose is identical to the last
    bit (the quaternion except for its sign).

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
        """Body rate; (n, 3), rad/s."""
        angles, rates, _ = self._turned(time)
        return euler_body_rate(angles, rates)

    def angle(self, time: ArrayLike) -> Array:
        """Integral of the body rate from time zero.

        `time` ((n,), s): before zero and after the end the integral is held constant. Returns (n,
        3), rad, within 1e-14 rad, plus rounding (`rate_integral.integrate_rate`); exactly constant
        at rest.
        """
        return self._integral(time)

    def attitude(self, time: ArrayLike) -> Array:
        """Exact attitude.

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
    """Make a gesture from a list of poses with a stop at each.

    Parameters
    ----------
    poses : sequence of (time, roll, pitch, heading, north, east, down)
        s, deg, m; rising times.
    duration : float, s
    """
    times, *columns = (tuple(float(x) for x in column) for column in zip(*poses, strict=True))
    roll, pitch, heading, north, east, down = (Track(times, values) for values in columns)
    return Gesture(duration, roll, pitch, heading, north, east, down)


def _evaluate(tracks: tuple[Track, Track, Track], time: ArrayLike) -> tuple[Array, Array, Array]:
    values, first, second = zip(*(track.evaluate(time) for track in tracks), strict=True)
    return np.column_stack(values), np.column_stack(first), np.column_stack(second)


# Rests for 5 s, is rotated about as fast as a hand can, and rests again from 9 s on. The three
# angles change at different times, so that the rotation axis never stays constant.
TABLE_TO_TABLE = Gesture(
    11.0,
    roll=Track((5.0, 5.5, 6.1, 6.8, 7.4, 8.2, 9.0), (0, 110, -80, 140, -60, 90, 0)),
    pitch=Track((5.0, 5.4, 6.0, 6.5, 7.2, 7.8, 8.5, 9.0), (0, -60, 70, -40, 60, -75, 30, 0)),
    heading=Track((5.0, 5.7, 6.3, 7.0, 7.6, 8.4, 9.0), (0, 130, -70, 160, 330, 270, 360)),
    north=Track((5.0, 6.2, 7.5, 9.0), (0, 0.15, -0.1, 0)),
    east=Track((5.0, 6.6, 8.0, 9.0), (0, -0.2, 0.15, 0)),
    down=Track((5.0, 5.6, 8.3, 9.0), (0, -0.3, -0.25, 0)),
)

# Ten turns of roll, two of heading forward and three back, with large pitch swings.
INTENSIVE = Gesture(
    10.0,
    roll=Track((2.0, 8.0), (0, 3600)),
    pitch=Track((2.0, 3.0, 4.2, 5.0, 6.1, 7.0, 8.0), (0, -75, 60, -80, 70, -50, 0)),
    heading=Track((2.5, 5.0, 7.5), (0, 720, -360)),
)

# Time s; roll, pitch, heading deg; north, east, down m.
PHONE = gesture(
    [
        (0.0, 0, 0, 0, 0, 0, 0),
        # Picked up, looked at, put back.
        (2.0, 0, 0, 0, 0, 0, 0),
        (3.0, 10, 50, -20, -0.15, 0.05, -0.30),
        (4.0, -5, 60, -10, -0.20, 0.05, -0.35),
        (5.2, 0, 0, 0, 0, 0, 0),
        # Picked up, turned to landscape and back.
        (7.2, 0, 0, 0, 0, 0, 0),
        (8.2, 0, 45, 0, -0.10, 0, -0.30),
        (9.0, -40, 30, 80, -0.10, 0.05, -0.30),
        (10.0, -40, 30, 80, -0.10, 0.05, -0.30),
        (10.7, 5, 45, 0, -0.10, 0, -0.30),
        (11.8, 0, 0, 0, 0, 0, 0),
        # Rotated a quarter turn to the right, moved half a meter, and back.
        (14.0, 0, 0, 0, 0, 0, 0),
        (14.8, 0, 20, 40, 0.20, 0.20, -0.15),
        (15.8, 0, 0, 90, 0.30, 0.40, 0),
        (17.8, 0, 0, 90, 0.30, 0.40, 0),
        (18.6, -15, 15, 50, 0.20, 0.20, -0.15),
        (19.6, 0, 0, 0, 0, 0, 0),
        # Turned over, face down and around: a full turn of roll.
        (21.6, 0, 0, 0, 0, 0, 0),
        (22.4, 90, 10, 0, 0, 0.05, -0.20),
        (23.0, 180, 0, 0, 0, 0.05, -0.20),
        (23.7, 270, -10, 5, 0, 0.05, -0.20),
        (24.6, 360, 0, 0, 0, 0, 0),
        # To the ear and back.
        (26.6, 360, 0, 0, 0, 0, 0),
        (27.8, 290, 65, -60, -0.30, 0.20, -0.50),
        (29.0, 295, 60, -55, -0.30, 0.20, -0.50),
        (30.4, 360, 0, 0, 0, 0, 0),
    ],
    33.0,
)


# A phone that is repeatedly picked up and put back, randomly from a seed.


@dataclass(frozen=True)
class Handling(FlatMotion):
    """Random gestures, each from a pose on the table and back to exactly that pose.

    Between gestures the phone rests for 1.5 to 5 s. A gesture has three to seven minimum-jerk moves
    of 0.6 to 1.6 s, to rolls of up to ±60°, pitches of up to ±70°, headings of up to ±120°, and
    positions up to 0.3 m north or south, east or west, and 0.1 to 0.5 m above the table; then it
    returns in 1 to 1.5 s.

    Attributes
    ----------
    duration : float, s
        At least 5; the last rest takes the time that no gesture fits into.
    seed : int
        The same seed gives the same motion on every machine.

    Raises
    ------
    ConfigError
        The duration is under 5 s.
    """

    duration: float
    seed: int

    def __post_init__(self) -> None:
        if not 5.0 <= self.duration < np.inf:
            raise ConfigError(
                "simulation.no-gesture-fits-into", quantity="duration", duration=self.duration
            )

    @cached_property
    def gestures(self) -> Gesture:
        """The generated motion."""
        draw = np.random.Generator(np.random.PCG64(self.seed)).integers
        home = (0.0,) * 6
        poses: list[tuple[float, ...]] = [(0.0, *home)]
        tenths = 0  # integers, so that times are identical on every machine
        while True:
            tenths += int(draw(15, 51))
            rows: list[tuple[float, ...]] = [(tenths / 10, *home)]
            for _ in range(int(draw(3, 8))):
                tenths += int(draw(6, 17))
                turned = (draw(-60, 61), draw(-70, 71), draw(-120, 121))
                moved = (draw(-30, 31) / 100, draw(-30, 31) / 100, draw(-50, -9) / 100)
                rows.append((tenths / 10, *(float(x) for x in (*turned, *moved))))
            tenths += int(draw(10, 16))
            rows.append((tenths / 10, *home))
            if tenths / 10 > self.duration - 1.5:
                return gesture(poses, self.duration)
            poses += rows

    def rate(self, time: ArrayLike) -> Array:
        """Body rate; (n, 3), rad/s, exactly zero at rest."""
        return self.gestures.rate(time)

    def angle(self, time: ArrayLike) -> Array:
        """Integral of the body rate from time zero; (n, 3), rad, as `Gesture.angle`."""
        return self.gestures.angle(time)

    def attitude(self, time: ArrayLike) -> Array:
        """Exact attitude ``q_nb``; (n, 4)."""
        return self.gestures.attitude(time)

    def acceleration(self, time: ArrayLike) -> Array:
        """Acceleration without gravity; (n, 3), north-east-down, m/s²."""
        return self.gestures.acceleration(time)

    def velocity(self, time: ArrayLike) -> Array:
        """Velocity; (n, 3), north-east-down, m/s."""
        return self.gestures.velocity(time)

    def position(self, time: ArrayLike) -> Array:
        """Position; (n, 3), north-east-down, m."""
        return self.gestures.position(time)
