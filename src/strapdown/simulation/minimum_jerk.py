"""Moves from rest to rest as a hand makes them: the quintic of least jerk."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown.errors import ConfigError

Array = NDArray[np.float64]


def minimum_jerk(x: Array) -> tuple[Array, Array, Array]:
    """Unit move ``10 x³ - 15 x⁴ + 6 x⁵`` and its first two derivatives by `x`.

    Parameters
    ----------
    x : ndarray
        Part of the move's time that has passed; at rest outside [0, 1].

    Returns
    -------
    value, first, second : ndarray
        Exactly 0, 0, 0 where ``x <= 0`` and exactly 1, 0, 0 where ``x >= 1``; all three are
        continuous.

    Notes
    -----
    Flash and Hogan (1985), J. Neurosci. 5(7), 1688-1703: the move between two rests that has the
    least mean square of the third derivative. Its largest rate is 15/8 of its mean rate.
    """
    x = np.clip(x, 0.0, 1.0)
    rest = 1.0 - x
    # Past the middle the mirrored move is taken from one: the polynomial cancels there.
    y = np.minimum(x, rest)
    moved = y * y * y * (10.0 - y * (15.0 - 6.0 * y))
    return (
        np.where(x > 0.5, 1.0 - moved, moved),
        30.0 * (x * rest) ** 2,
        60.0 * x * rest * (rest - x),
    )


@dataclass(frozen=True)
class Track:
    """One coordinate that moves from value to value and comes to rest at each.

    Attributes
    ----------
    times : tuple of float, s
        Rising.
    values : tuple of float
        One a time, in any unit. Two equal neighbours are a rest between them, and the first
        and the last value hold before and after.

    Raises
    ------
    ConfigError
        There is nothing in it, a number is not finite, or the times do not rise.
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
        """Value and its first two derivatives by time.

        Parameters
        ----------
        time : array_like, (n,), s

        Returns
        -------
        value, first, second : ndarray, (n,)
            Unit of the values, that per s and per s². At rest the value is to the last bit the
            one that was given, and both derivatives are exactly zero.
        """
        t = np.asarray(time, dtype=np.float64)
        times, values = np.asarray(self.times), np.asarray(self.values)
        if len(times) == 1:
            return np.full(t.shape, values[0]), np.zeros(t.shape), np.zeros(t.shape)
        k = np.searchsorted(times, t, side="right") - 1
        # From the last time on that value itself holds, not what a sum rounds it to.
        ended = k == len(times) - 1
        k = np.clip(k, 0, len(times) - 2)
        length, change = np.diff(times)[k], np.diff(values)[k]
        part, first, second = minimum_jerk((t - times[k]) / length)
        value = np.where(ended, values[-1], values[k] + change * part)
        return value, change * first / length, change * second / (length * length)


#: A coordinate that stays at zero.
STILL = Track((0.0,), (0.0,))
