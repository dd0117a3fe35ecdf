"""Mean accelerations from a table of cumulative velocity changes."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown.errors import DataError
from strapdown.formats.crash_record import CrashChannel

Array = NDArray[np.float64]

__all__ = ["mean_acceleration", "mean_accelerations_of"]

# A table that begins one step after time zero omits the row of zeros.
ONE_STEP = 1.5


def mean_acceleration(channel: CrashChannel) -> tuple[Array, Array]:
    """Compute the mean acceleration over each interval of a velocity channel.

    Parameters
    ----------
    channel : CrashChannel
        Of quantity ``velocity``.

    Returns
    -------
    time : ndarray, (n,), s
        End of each interval, as for sampling ``mean``.
    acceleration : ndarray, (n,), m/s²
        Change of velocity over the interval divided by its length; exact for any motion within
        it.

    Raises
    ------
    DataError
        The quantity is not velocity, there are fewer than two samples, or a value is missing.
    """
    if channel.quantity != "velocity":
        raise DataError(
            "io.holds-change-velocity-needed",
            file=channel.file or None,
            quantity=channel.name,
            of_what=channel.quantity,
        )
    time, velocity = channel.load()
    bad = np.flatnonzero(~np.isfinite(velocity))
    if bad.size or velocity.size < 2:
        k = int(bad[0]) if bad.size else None
        raise DataError(
            "io.not-finite-number-2" if k is not None else "io.fewer-than-two-samples",
            file=channel.file or None,
            row=channel.row(k) if k is not None else None,
            quantity=channel.name,
            velocity=velocity[k] if k is not None else None,
        )
    return mean_accelerations_of(time, velocity, from_zero=starts_at_zero(time, channel))


def starts_at_zero(time: Array, channel: CrashChannel) -> bool:
    """Whether the table begins one step after the time zero of its changes."""
    counted = any("time zero" in r for r in channel.remarks)
    return counted and time.size > 1 and 0.0 < time[0] <= ONE_STEP * (time[1] - time[0])


def mean_accelerations_of(
    time: ArrayLike, velocity: ArrayLike, *, from_zero: bool = False
) -> tuple[Array, Array]:
    """Compute the mean acceleration over each interval.

    Parameters
    ----------
    time : array_like, (n,), s
        Increasing.
    velocity : array_like, (n,), m/s
    from_zero : bool
        Whether the velocity is a change since time zero: the interval from there to the first
        stamp then counts, too.

    Returns
    -------
    time : ndarray, (n - 1,) or (n,), s
        End of each interval.
    acceleration : ndarray, m/s²
    """
    t = np.asarray(time, dtype=np.float64)
    v = np.asarray(velocity, dtype=np.float64)
    if from_zero:
        t, v = np.concatenate([[0.0], t]), np.concatenate([[0.0], v])
    return t[1:], np.diff(v) / np.diff(t)
