"""Minimum-jerk moves from rest to rest: the quintic."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown.errors import ConfigError

Array = NDArray[np.float64]


def minimum_jerk(x: Array) -> tuple[Array, Array, Array]:
    """Unit move ``10 x³ - 15 x⁴ + 6 x⁵`` and its first two derivatives with respect to `x`.

    `x`: elapsed fraction of the move; at rest outside [0, 1]. Returns `value`, `first`, `second`:
    exactly 0, 0, 0 where ``x <= 0`` and exactly 1, 0, 0 where ``x >= 1``; all three are continuous.

    Flash and Hogan (1985), J. Neurosci. 5(7), 1688-1703: the move between two rests with the least
    mean square third derivative. Its largest rate is 15/8 of its mean rate.
    """
    x = np.clip(x, 0.0, 1.0)
    rest = 1.0 - x
    # In the second half, subtract the mirrored move from one, because the polynomial cancels there.
    y = np.minimum(x, rest)
    moved = y * y * y * (10.0 - y * (15.0 - 6.0 * y))
    return (
        np.where(x > 0.5, 1.0 - moved, moved),
        30.0 * (x * rest) ** 2,
        60.0 * x * rest * (rest - x),
    )


@dataclass(frozen=True)
class Track:
    """One coordinate that moves between values, with a stop at each.

    Attributes
    ----------
    times : tuple of float, s
        Increasing.
    values : tuple of float
        One per time, in any unit. Two equal neighbors are a rest; the first and the last value are
        held before and after.

    Raises
    ------
    ConfigError
        The track is empty, a number is not finite, or the times do not increase.
    """

    times: tuple[float, ...]
    values: tuple[float, ...]

    def __post_init__(self) -> None:
        if not self.times or len(self.times) != len(self.values):
            raise ConfigError(
                "simulation.times-values",
                quantity="track",
                count=len(self.times),
                count_2=len(self.values),
            )
        if not np.isfinite([*self.times, *self.values]).all():
            raise ConfigError("simulation.time-or-value-not-finite", quantity="track")
        falls = np.flatnonzero(np.diff(self.times) <= 0.0)
        if falls.size:
            k = int(falls[0])
            raise ConfigError(
                "simulation.does-not-come-after",
                quantity="track",
                times=self.times[k + 1],
                times_2=self.times[k],
            )

    def evaluate(self, time: ArrayLike) -> tuple[Array, Array, Array]:
        """Value and its first two time derivatives.

        Returns `value`, `first`, `second` ((n,)): unit of the values, that per s and per s². At
        rest the value is bit-identical to the given one, and both derivatives are exactly zero.
        """
        t = np.asarray(time, dtype=np.float64)
        times, values = np.asarray(self.times), np.asarray(self.values)
        if len(times) == 1:
            return np.full(t.shape, values[0]), np.zeros(t.shape), np.zeros(t.shape)
        k = np.searchsorted(times, t, side="right") - 1
        # From the last time on use that value itself, not a rounded sum.
        ended = k == len(times) - 1
        k = np.clip(k, 0, len(times) - 2)
        length, change = np.diff(times)[k], np.diff(values)[k]
        part, first, second = minimum_jerk((t - times[k]) / length)
        value = np.where(ended, values[-1], values[k] + change * part)
        return value, change * first / length, change * second / (length * length)


#: A coordinate that is constantly zero.
STILL = Track((0.0,), (0.0,))
