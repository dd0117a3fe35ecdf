"""Sensitivity of a direction of force to the length of the window and to time zero."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pandas as pd

from strapdown.crash.acceleration import Acceleration
from strapdown.crash.delta_v import delta_v
from strapdown.crash.pdof import ned_pdof, pdof
from strapdown.errors import DataError

__all__ = ["pdof_by_shift", "pdof_by_window"]

#: Lengths of the windows of a sensitivity table, s.
WINDOWS = (0.010, 0.020, 0.030, 0.040, 0.050, 0.075, 0.100, 0.125, 0.150)
#: Shifts of time zero of a sensitivity table, s.
SHIFTS = (-0.010, -0.005, -0.002, -0.001, 0.0, 0.001, 0.002, 0.005, 0.010)


def _row(acceleration: Acceleration, start: float, end: float, heading_deg: float) -> list[float]:
    change = delta_v(acceleration, start, end, across_gaps=True)
    if not change.vector.any():
        return [*change.vector.tolist(), math.nan, math.nan]
    if acceleration.frame == "ned":
        over_ground = ned_pdof(change, heading_deg)
        return [*change.vector.tolist(), over_ground.relative_deg, over_ground.vertical_deg]
    angles = pdof(change)
    return [*change.vector.tolist(), angles.horizontal_deg, angles.vertical_deg]


def _table(rows: list[list[float]], name: str, at: Sequence[float]) -> pd.DataFrame:
    columns = ["dv_x", "dv_y", "dv_z", "horizontal_deg", "vertical_deg"]
    return pd.DataFrame(
        np.array(rows, dtype=np.float64).reshape(-1, 5),
        index=pd.Index(list(at), name=name, dtype=np.float64),
        columns=columns,
    )


def pdof_by_window(
    acceleration: Acceleration,
    time_zero: float,
    windows: Sequence[float] = WINDOWS,
    *,
    heading_deg: float = 0.0,
) -> pd.DataFrame:
    """Direction of force versus the length of the window from time zero.

    Parameters
    ----------
    acceleration : Acceleration
    time_zero : float, s
    windows : sequence of float, s
    heading_deg : float, deg
        At the impact; for a record in north-east-down, the direction is relative to this
        heading.

    Returns
    -------
    DataFrame
        Index ``window``, s; ``dv_x dv_y dv_z``, m/s, ``horizontal_deg``, ``vertical_deg``; NaN
        for a zero change of velocity. Windows that extend beyond the record are left out.

    Raises
    ------
    DataError
        None of the windows is within the record.
    """
    fit = [w for w in windows if w > 0.0 and _fits(acceleration, time_zero, time_zero + w)]
    if not fit:
        raise _no_window(acceleration, time_zero, windows)
    rows = [_row(acceleration, time_zero, time_zero + w, heading_deg) for w in fit]
    return _table(rows, "window", fit)


def pdof_by_shift(
    acceleration: Acceleration,
    time_zero: float,
    end: float,
    shifts: Sequence[float] = SHIFTS,
    *,
    keep_length: bool = False,
    heading_deg: float = 0.0,
) -> pd.DataFrame:
    """Direction of force versus an error of time zero.

    Parameters
    ----------
    acceleration : Acceleration
    time_zero, end : float, s
        The detected window.
    shifts : sequence of float, s
        Added to `time_zero`.
    keep_length : bool
        Whether the end is shifted as well.
    heading_deg : float, deg
        As `pdof_by_window`.

    Returns
    -------
    DataFrame
        Index ``shift``, s; columns as `pdof_by_window`.

    Raises
    ------
    DataError
        None of the windows is within the record.
    """
    ends = [end + (s if keep_length else 0.0) for s in shifts]
    pairs = [(s, time_zero + s, e) for s, e in zip(shifts, ends, strict=True)]
    fit = [(s, a, b) for s, a, b in pairs if b > a and _fits(acceleration, a, b)]
    if not fit:
        raise _no_window(acceleration, time_zero, [end - time_zero])
    rows = [_row(acceleration, a, b, heading_deg) for _, a, b in fit]
    return _table(rows, "shift", [s for s, _, _ in fit])


def _fits(acceleration: Acceleration, start: float, end: float) -> bool:
    return acceleration.begin <= start and end <= acceleration.end


def _no_window(acceleration: Acceleration, zero: float, windows: Sequence[float]) -> DataError:
    shortest = min(windows, default=0.0)
    return DataError(
        "crash.no-window-shortest-ms-within",
        file=acceleration.source,
        quantity="window",
        zero=zero,
        shortest=shortest * 1000.0,
        begin=acceleration.begin,
        end=acceleration.end,
    )
