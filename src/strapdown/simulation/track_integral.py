"""Integral of a track, in closed form."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from strapdown.simulation.minimum_jerk import Track

Array = NDArray[np.float64]


def integrate_track(track: Track, time: Array) -> Array:
    """Integral of a track from its first time.

    Parameters
    ----------
    track : Track
    time : ndarray, (n,), s
        Not before the track's first time.

    Returns
    -------
    ndarray, (n,), unit of the track times s

    Notes
    -----
    The integral of the quintic of least jerk is ``5/2 x^4 - 3 x^5 + x^6``, one half over the whole.
    """
    times, values = np.asarray(track.times), np.asarray(track.values)
    if len(times) == 1:
        return np.asarray(values[0] * (time - times[0]))
    lengths, changes = np.diff(times), np.diff(values)
    before = np.r_[0.0, np.cumsum(lengths * (values[:-1] + 0.5 * changes))]
    k = np.searchsorted(times, time, side="right") - 1
    inner = np.clip(k, 0, len(lengths) - 1)
    since = time - times[inner]
    x = np.clip(since / lengths[inner], 0.0, 1.0)
    moved = x * x * x * x * (2.5 - x * (3.0 - x))
    within = values[inner] * since + changes[inner] * lengths[inner] * moved
    after = before[-1] + values[-1] * (time - times[-1])
    return np.asarray(np.where(k >= len(lengths), after, before[inner] + within))
