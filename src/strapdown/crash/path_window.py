"""The samples of a record that a path is given at."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.errors import DataError

Array = NDArray[np.float64]

#: Where a path is wanted if nothing is said, s from the trigger: Tadic and Vukajlovic (2016).
WINDOW = (-0.1, 0.75)


def path_rows(imu: pd.DataFrame, at: float, window: Sequence[float] | None) -> tuple[int, int, int]:
    """Find the first, the entry's and the last sample of a path.

    Parameters
    ----------
    imu : DataFrame
    at : float, s
        Instant of the entry.
    window : (float, float), s, optional
        `WINDOW`, as far as there is a record, if not given.

    Returns
    -------
    first, anchor, last : int
        The entry's is the sample nearest to it, and within the path in any case.

    Raises
    ------
    DataError
        The record does not hold the entry or the window.
    """
    time = imu.index.to_numpy(dtype=np.float64)
    slack = 1e-9 + 0.5 * float(np.median(np.diff(time))) if len(time) > 1 else 0.0
    if not time[0] - slack <= at <= time[-1] + slack:
        raise DataError(
            "crash.entry-not-within-record",
            file=imu.attrs.get("source"),
            quantity="entry",
            at=at,
            time=time[0],
            time_2=time[-1],
        )
    begin, end = (float(x) for x in (_usual(time, at) if window is None else window))
    if not begin < end or begin < time[0] - slack or end > time[-1] + slack:
        # What both have, in whole ms.
        low = max(begin, math.ceil(1e3 * float(time[0])) / 1e3)
        high = min(end, math.floor(1e3 * float(time[-1])) / 1e3)
        raise DataError(
            "crash.window-partly-in-record" if low < high else "crash.window-not-in-record",
            file=imu.attrs.get("source"),
            quantity="window",
            begin=begin,
            end=end,
            first=time[0],
            last=time[-1],
            low=low,
            high=high,
        )
    anchor = int(np.argmin(np.abs(time - at)))
    first = min(int(np.searchsorted(time, begin - 1e-9)), anchor)
    last = max(int(np.searchsorted(time, end + 1e-9, side="right")) - 1, anchor)
    return first, anchor, last


def _usual(time: Array, at: float) -> tuple[float, float]:
    """The usual window, as far as there is a record; the entry is within in any case."""
    return (
        min(max(WINDOW[0], float(time[0])), at),
        max(min(WINDOW[1], float(time[-1])), at + 1e-6),
    )
