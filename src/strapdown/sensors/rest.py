"""Stretches of a log in which the sensor did not turn."""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.results import RestStretch
from strapdown.tables import ACCEL, GYRO

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

# A window is judged as a whole: long enough for a standard deviation that means something,
# short enough that a pause of a second shows.
WINDOW = 0.5  # s
LEAST_SAMPLES = 5
LEAST_LENGTH = 1.0  # s
# The quietest twentieth of the windows sets the noise of this sensor; rest is what stays
# within three times that.
QUIET_QUANTILE = 0.05
QUIET_FACTOR = 3.0
# What no consumer sensor exceeds at rest, and every hand does: so that a log that is never at
# rest does not have its least busy moment taken for one.
MAX_GYRO_SD = 0.03  # rad/s, of the three axes together
MAX_ACCEL_SD = 0.3  # m/s²
# The zero-rate output of a cheap gyro may be 20 deg/s off (MPU-6050 data sheet, revision 3.4,
# section 6.1).
MAX_MEAN_RATE = 0.36  # rad/s
SAME_BIAS = 0.01  # rad/s: rests of one log share their bias to within this
# A sensor without noise (a simulation) is at rest where it reads a constant, to rounding.
ROUNDING = 1e-9  # rad/s


def find_rests(imu: pd.DataFrame) -> tuple[RestStretch, ...]:
    """Find the stationary stretches of a log, from its own noise.

    Parameters
    ----------
    imu : DataFrame
        An Imu table.

    Returns
    -------
    tuple of RestStretch
        In order of time, each at least 1 s long. A slow turn at a constant rate about the
        vertical cannot be told from a bias by a single stretch; it is refused here only where
        another stretch of the log shows a bias that differs by more than 0.01 rad/s.
    """
    time = imu.index.to_numpy(dtype=np.float64)
    gyro = imu[GYRO].to_numpy(dtype=np.float64)
    accel = imu[ACCEL].to_numpy(dtype=np.float64) if set(ACCEL) <= set(imu.columns) else None
    starts, ends = _windows(time)
    if not len(starts):
        return ()
    gyro_sd = _window_sd(gyro, starts, ends)
    quiet = max(QUIET_FACTOR * float(np.quantile(gyro_sd, QUIET_QUANTILE)), ROUNDING)
    still = gyro_sd <= min(quiet, MAX_GYRO_SD)
    still &= np.linalg.norm(_window_mean(gyro, starts, ends), axis=1) <= MAX_MEAN_RATE
    if accel is not None:
        still &= _window_sd(accel, starts, ends) <= MAX_ACCEL_SD
    rests = [
        _stretch(time, gyro, accel, int(starts[a]), int(ends[b]))
        for a, b in _runs(still, time[starts[1:]] - time[ends[:-1] - 1] < LEAST_LENGTH)
        if time[ends[b] - 1] - time[starts[a]] >= LEAST_LENGTH
    ]
    return _of_one_bias(rests)


def _windows(time: Array) -> tuple[Indices, Indices]:
    """First and one-past-last sample of windows that overlap by half."""
    first: list[Indices] = [np.empty(0, dtype=np.int64)]
    past: list[Indices] = [np.empty(0, dtype=np.int64)]
    # Piece by piece: a grid across a clock that was set would have no end.
    holes = np.flatnonzero(np.diff(time) > LEAST_LENGTH) + 1
    for piece in np.split(np.arange(time.size), holes):
        end = time[piece[-1]]
        grid = np.arange(time[piece[0]], end - WINDOW, 0.5 * WINDOW)
        last = max(int(np.searchsorted(time, end - WINDOW)), int(piece[0]))
        first += [np.searchsorted(time, grid), np.array([last])]
        past += [np.searchsorted(time, grid + WINDOW), piece[-1:] + 1]
    starts, ends = np.concatenate(first), np.concatenate(past)
    enough = ends - starts >= LEAST_SAMPLES
    return starts[enough].astype(np.int64), ends[enough].astype(np.int64)


def _window_mean(values: Array, starts: Indices, ends: Indices) -> Array:
    return np.array([values[a:b].mean(axis=0) for a, b in zip(starts, ends, strict=True)])


def _window_sd(values: Array, starts: Indices, ends: Indices) -> Array:
    """Root of the summed variances of the axes, per window.

    Window by window, and not by running sums, whose rounding would look like noise in a
    record that has none.
    """
    variances = [values[a:b].var(axis=0).sum() for a, b in zip(starts, ends, strict=True)]
    return np.asarray(np.sqrt(variances), dtype=np.float64)


def _runs(still: NDArray[np.bool_], joined: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First and last window of each run of still windows, no hole of a second between them."""
    runs: list[tuple[int, int]] = []
    for k in np.flatnonzero(still).tolist():
        if runs and runs[-1][1] == k - 1 and joined[k - 1]:
            runs[-1] = (runs[-1][0], k)
        else:
            runs.append((k, k))
    return runs


def _stretch(time: Array, gyro: Array, accel: Array | None, a: int, b: int) -> RestStretch:
    mean, sd = gyro[a:b].mean(axis=0), gyro[a:b].std(axis=0)
    level = None if accel is None else accel[a:b].mean(axis=0)
    return RestStretch(
        float(time[a]),
        float(time[b - 1]),
        (float(mean[0]), float(mean[1]), float(mean[2])),
        (float(sd[0]), float(sd[1]), float(sd[2])),
        None if level is None else (float(level[0]), float(level[1]), float(level[2])),
    )


def _of_one_bias(rests: list[RestStretch]) -> tuple[RestStretch, ...]:
    if not rests:
        return ()
    least = min(rests, key=lambda r: float(np.linalg.norm(r.gyro_mean)))
    return tuple(
        r for r in rests if np.linalg.norm(np.subtract(r.gyro_mean, least.gyro_mean)) <= SAME_BIAS
    )
