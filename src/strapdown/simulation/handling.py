"""A phone that is taken up and put back again and again, as drawn by a seed."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown.errors import ConfigError
from strapdown.simulation.flat_motion import FlatMotion
from strapdown.simulation.gesture import Gesture, gesture

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Handling(FlatMotion):
    """Random gestures, each from a place on the table back to that very pose.

    Between two gestures it lies for 1.5 to 5 s. A gesture has three to seven moves of 0.6 to 1.6 s
    with least jerk, to rolls of up to ±60°, pitches of up to ±70°, headings of up to ±120°, and
    places up to 0.3 m north or south, east or west, and 0.1 to 0.5 m above the table; then 1 to
    1.5 s back to where it lay.

    Attributes
    ----------
    duration : float, s
        At least 5; the last rest takes what no gesture fits into.
    seed : int
        The same seed is the same motion on every machine.

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
        """The motion that was drawn."""
        draw = np.random.Generator(np.random.PCG64(self.seed)).integers
        home = (0.0,) * 6
        poses: list[tuple[float, ...]] = [(0.0, *home)]
        tenths = 0  # whole numbers, so that no machine rounds a time otherwise
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
