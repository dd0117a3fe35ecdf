"""Stretches of a log in which the sensor did not turn."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.errors import DataError
from strapdown.results.rests import RestStretch
from strapdown.sensors.triad_errors import triad_of
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
# Parts of a rest whose means tell how well the mean of the whole is known.
LEAST_PARTS, MOST_PARTS = 4, 20


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
    still &= np.abs(_window_mean(gyro, starts, ends)).max(axis=1) <= MAX_MEAN_RATE
    if accel is not None:
        still &= _window_sd(accel, starts, ends) <= MAX_ACCEL_SD
    rests = [
        _stretch(time, gyro, accel, int(starts[a]), int(ends[b]))
        for a, b in _runs(still, time[starts[1:]] - time[ends[:-1] - 1] < LEAST_LENGTH)
        if time[ends[b] - 1] - time[starts[a]] >= LEAST_LENGTH
    ]
    return of_one_bias(rests)


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


def rest_between(
    imu: pd.DataFrame, start: float, end: float, *, grade: str = "stated"
) -> RestStretch:
    """Take a stretch of a log for a rest, whatever it looks like.

    Parameters
    ----------
    imu : DataFrame
        An Imu table.
    start, end : float, s
        The samples from the one to the other, both included.
    grade : str, optional
        What to call it.

    Returns
    -------
    RestStretch
        Its ``*_mean_sd`` tell how far the means can be trusted: a hand that holds the sensor
        shows there.

    Raises
    ------
    DataError
        There are fewer than five samples in it.
    """
    time = imu.index.to_numpy(dtype=np.float64)
    a, b = int(np.searchsorted(time, start)), int(np.searchsorted(time, end, side="right"))
    if b - a < LEAST_SAMPLES:
        raise DataError(
            "sensors.samples-between-too-few-mean",
            file=imu.attrs.get("source"),
            quantity="rest",
            b=max(b - a, 0),
            start=start,
            end=end,
            least_samples=LEAST_SAMPLES,
        )
    gyro = imu[GYRO].to_numpy(dtype=np.float64)
    accel = imu[ACCEL].to_numpy(dtype=np.float64) if set(ACCEL) <= set(imu.columns) else None
    return replace(_stretch(time, gyro, accel, a, b), grade=grade)


def sd_of_mean(time: Array, values: Array) -> Array:
    """How well the mean of a stretch is known.

    Parameters
    ----------
    time : ndarray, (n,), s
    values : ndarray, (n, k)

    Returns
    -------
    ndarray, (k,)
        The larger of ``sd / sqrt(n)``, which is right for white noise, and the same from the
        means of 4 to 20 parts of at least half a second, which is right for noise that is
        correlated over less than a part (batch means; Law and Kelton 1984,
        doi:10.1287/opre.32.6.1241). A stretch of less than 2 s has the first only.
    """
    white = values.std(axis=0, ddof=1) / np.sqrt(len(values))
    parts = min(MOST_PARTS, int((time[-1] - time[0]) / WINDOW))
    if parts < LEAST_PARTS:
        return np.asarray(white, dtype=np.float64)
    edges = np.linspace(0, len(values), parts + 1).astype(np.int64)
    if np.diff(edges).min() < 1:
        return np.asarray(white, dtype=np.float64)
    means = _window_mean(values, edges[:-1], edges[1:])
    return np.asarray(np.maximum(white, means.std(axis=0, ddof=1) / np.sqrt(parts)))


def _stretch(time: Array, gyro: Array, accel: Array | None, a: int, b: int) -> RestStretch:
    force = None if accel is None else accel[a:b]
    return RestStretch(
        float(time[a]),
        float(time[b - 1]),
        triad_of(gyro[a:b].mean(axis=0)),
        triad_of(gyro[a:b].std(axis=0)),
        None if force is None else triad_of(force.mean(axis=0)),
        triad_of(sd_of_mean(time[a:b], gyro[a:b])),
        None if force is None else triad_of(force.std(axis=0)),
        None if force is None else triad_of(sd_of_mean(time[a:b], force)),
    )


def of_one_bias(rests: list[RestStretch]) -> tuple[RestStretch, ...]:
    """Rests whose bias is like the least of them: a steady slow turn is no rest."""
    if not rests:
        return ()
    least = min(rests, key=lambda r: float(np.linalg.norm(r.gyro_mean)))
    return tuple(
        r for r in rests if np.linalg.norm(np.subtract(r.gyro_mean, least.gyro_mean)) <= SAME_BIAS
    )
