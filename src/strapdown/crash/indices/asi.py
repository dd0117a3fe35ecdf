"""Acceleration severity index."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown.constants import STANDARD_GRAVITY
from strapdown.crash.indices.pulse import checked, four_pole, moving_means
from strapdown.errors import ConfigError

__all__ = ["ASI_AVERAGES", "Asi", "asi"]

Array = NDArray[np.float64]
#: Smoothing of the accelerations, by edition of EN 1317-1.
ASI_AVERAGES: dict[str, str] = {
    "mean_50ms": "EN 1317-1:1998, mean over a moving window of 50 ms",
    "butterworth_13hz": "EN 1317-1:2010, four-pole Butterworth low-pass without phase, 13 Hz",
}
LIMITS_G = (12.0, 9.0, 10.0)
WINDOW = 0.05  # s
FREQUENCY = 13.0  # Hz


@dataclass(frozen=True, eq=False)
class Asi:
    """Acceleration severity index of a record.

    Attributes
    ----------
    value : float
        Maximum; dimensionless.
    at : float, s
        Center of the window.
    average : str
        One of `ASI_AVERAGES`.
    time, history : ndarray, (m,)
        The index over time.
    """

    value: float
    at: float
    average: str
    time: Array = field(repr=False)
    history: Array = field(repr=False)


def asi(
    time: ArrayLike,
    accel: ArrayLike,
    *,
    average: str = "butterworth_13hz",
    cutoff: str = "whole",
) -> Asi:
    """Acceleration severity index of the vehicle at a point near its occupants.

    Parameters
    ----------
    time : array_like, (n,), s
    accel : array_like, (n, 3), m/s²
        Acceleration in vehicle axes, without gravity, of class CFC 180.
    average : {'butterworth_13hz', 'mean_50ms'}
        Edition of 2010 or of 1998.
    cutoff : {'whole', 'pass'}
        Meaning of the 13 Hz: `phaseless.four_pole`. The standard gives the frequency; its plain
        meaning is -3 dB there for the whole filter. Two passes of 13 Hz each smooth more and
        give smaller values on short pulses.

    Returns
    -------
    Asi

    Raises
    ------
    DataError
        As `pulse.checked`; the record is shorter than 50 ms, or its steps are not uniform.
    ConfigError
        An option is unknown.

    Notes
    -----
    ``ASI(t) = sqrt((ax/12 g)² + (ay/9 g)² + (az/10 g)²)`` of the smoothed components (EN 1317-1,
    the clause on impact severity; limits, both editions and their averages as the manual of
    T/HIS 22.1 states them, page "Acceleration Severity Index").
    """
    t, a = checked(time, accel, 3, "accel")
    if average == "mean_50ms":
        starts, smooth = moving_means(t, a, WINDOW)
        stamps = starts + 0.5 * WINDOW
    elif average == "butterworth_13hz":
        stamps, smooth = t, four_pole(t, a, FREQUENCY, cutoff)
    else:
        raise ConfigError(
            "crash.no-average-asi",
            quantity="average",
            average=average,
            word=average,
            known=ASI_AVERAGES,
        )
    shares = smooth / (np.array(LIMITS_G) * STANDARD_GRAVITY)
    history = np.sqrt((shares * shares).sum(axis=1))
    k = int(np.argmax(history))
    return Asi(float(history[k]), float(stamps[k]), average, stamps, history)
