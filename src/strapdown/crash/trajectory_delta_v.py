"""Change of velocity of a navigated trajectory."""

from __future__ import annotations

import numpy as np
import pandas as pd

from strapdown.crash.delta_v import DeltaV
from strapdown.crash.window_weights import check_within
from strapdown.errors import DataError
from strapdown.tables.checks import index_of, source_of, values_of
from strapdown.tables.columns import VELOCITY
from strapdown.tables.trajectory import check_trajectory

__all__ = ["trajectory_delta_v"]


def trajectory_delta_v(trajectory: pd.DataFrame, start: float, end: float) -> DeltaV:
    """Change of velocity between two instants of a navigated trajectory.

    Parameters
    ----------
    trajectory : DataFrame
        Trajectory table, at the reference point; gravity is out of its velocities already.
    start, end : float, s
        Within it; between stamps the velocity is taken for a line.

    Returns
    -------
    DeltaV
        In the frame ``ned``; the weights are those of the velocities.

    Raises
    ------
    DataError
        The window is empty or reaches beyond the trajectory.
    """
    check_trajectory(trajectory)
    time, source = index_of(trajectory), source_of(trajectory)
    check_within(time, start, end, source)
    if not end > start:
        raise DataError("crash.window-empty", file=source, quantity="time", start=start, end=end)
    velocity = values_of(trajectory, VELOCITY)
    weights = np.zeros(len(time))
    rates = []
    for instant, sign in ((start, -1.0), (end, 1.0)):
        k = int(np.clip(np.searchsorted(time, instant, side="right"), 1, len(time) - 1))
        step = time[k] - time[k - 1]
        u = (instant - time[k - 1]) / step
        weights[k - 1] += sign * (1.0 - u)
        weights[k] += sign * u
        rates.append((velocity[k] - velocity[k - 1]) / step)
    vector = weights @ velocity
    return DeltaV(float(start), float(end), vector, "ned", weights, rates[0], rates[1])
