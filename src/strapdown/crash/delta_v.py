"""Change of velocity over a window, a trailing window and an event."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from strapdown.crash.acceleration import Acceleration
from strapdown.crash.crash_event import CrashEvent
from strapdown.crash.velocity_course import VelocityCourse
from strapdown.crash.window_weights import check_within, window_weights
from strapdown.errors import ConfigError, DataError

Array = NDArray[np.float64]

__all__ = [
    "DeltaV",
    "TrailingDeltaV",
    "cumulative_delta_v",
    "delta_v",
    "event_delta_v",
    "trailing_delta_v",
]

#: The window of Tadic and Vukajlovic (2016), section 4.
WINDOW = 0.030


@dataclass(frozen=True, eq=False)
class DeltaV:
    """Change of velocity over one window.

    Attributes
    ----------
    start, end : float, s
    vector : ndarray, (3,), m/s
    frame : {'body', 'ned', 'impact'}
        As `strapdown.crash.acceleration.FRAMES`.
    weights : ndarray, (n,), s
        ``vector = weights @ values`` of the acceleration; of a trajectory, the weights of its
        velocities, without unit.
    start_rate, end_rate : ndarray, (3,), m/s²
        Acceleration at the two ends: what an error of `end` moves the vector by, and, with the
        other sign, one of `start`.
    """

    start: float
    end: float
    vector: Array
    frame: str
    weights: Array = field(repr=False)
    start_rate: Array = field(repr=False)
    end_rate: Array = field(repr=False)

    @property
    def resultant(self) -> float:
        """Length of the vector, m/s."""
        return float(np.sqrt(self.vector @ self.vector))

    @property
    def horizontal(self) -> float:
        """Length of its first two components, m/s: the resultant of 49 CFR 563.5(b)."""
        return math.hypot(float(self.vector[0]), float(self.vector[1]))

    def noise_covariance(self, noise: ArrayLike) -> Array:
        """Covariance from white noise of the samples alone.

        Parameters
        ----------
        noise : array_like, m/s²
            Standard deviation of a sample: one number, (3,), or (n, 3).

        Returns
        -------
        ndarray, (3, 3), m²/s²
            Diagonal: ``sum(weights² noise²)``. Everything else that is not known of a sensor is
            the error budget's.
        """
        sds = np.broadcast_to(np.asarray(noise, dtype=np.float64), (len(self.weights), 3))
        return np.diag(self.weights**2 @ sds**2)


@dataclass(frozen=True, eq=False)
class TrailingDeltaV:
    """Change of velocity over a window that trails each sample.

    Attributes
    ----------
    window : float, s
    time : ndarray, (m,), s
        Ends of the windows: the samples for which the record reaches back that far.
    vector : ndarray, (m, 3), m/s
    peak : DeltaV
        The window in which the resultant is largest, wherever it ends: between samples too.
    frame : {'body', 'ned', 'impact'}
    """

    window: float
    time: Array
    vector: Array = field(repr=False)
    peak: DeltaV
    frame: str


def delta_v(
    acceleration: Acceleration, start: float, end: float, *, across_gaps: bool = False
) -> DeltaV:
    """Change of velocity from one instant to another.

    Parameters
    ----------
    acceleration : Acceleration
        `body_acceleration` for what a recorder gives (integrated along the turning axes), or
        `resolved_acceleration` for the change in north-east-down.
    start, end : float, s
        Anywhere within the record; between samples as `window_weights` says.
    across_gaps : bool
        Bridge holes of the record by a straight line.

    Returns
    -------
    DeltaV

    Raises
    ------
    DataError
        The window is empty, reaches beyond the record, or has a hole in it.
    """
    time, source = acceleration.time, acceleration.source
    check_within(time, start, end, source)
    if not end > start:
        raise DataError("crash.window-empty", file=source, quantity="time", start=start, end=end)
    holes = [] if across_gaps else acceleration.gaps(start, end)
    if holes:
        raise DataError(
            "crash.no-sample-ms-between-within",
            file=source,
            row=holes[0].sample + 1,
            quantity="acceleration",
            length=holes[0].length * 1000.0,
            start=holes[0].start,
            end=holes[0].end,
            start_2=start,
            end_2=end,
        )
    weights = window_weights(time, start, end, acceleration.sampling)
    course = VelocityCourse(acceleration)
    return DeltaV(
        float(start),
        float(end),
        weights @ acceleration.values,
        acceleration.frame,
        weights,
        course.rate(np.array([start]))[0],
        course.rate(np.array([end]))[0],
    )


def event_delta_v(
    acceleration: Acceleration, event: CrashEvent, *, across_gaps: bool = False
) -> DeltaV:
    """Change of velocity over a whole event, from time zero to its end.

    Parameters
    ----------
    acceleration : Acceleration
    event : CrashEvent
    across_gaps : bool
        As `delta_v`.

    Returns
    -------
    DeltaV

    Raises
    ------
    DataError
        As `delta_v`.
    """
    return delta_v(acceleration, event.time_zero, event.end, across_gaps=across_gaps)


def cumulative_delta_v(
    acceleration: Acceleration, start: float, end: float, every: float | None = None
) -> pd.DataFrame:
    """Course of the change of velocity since an instant.

    Parameters
    ----------
    acceleration : Acceleration
    start, end : float, s
        Within the record.
    every : float, s, optional
        Step of the course; by default the samples and the two ends. Recorders give 0.010 s.

    Returns
    -------
    DataFrame
        Index ``time``, s, from `start` on, at zero there; columns ``dv_x dv_y dv_z`` in the
        frame of the acceleration, ``horizontal`` and ``resultant``, m/s.

    Raises
    ------
    DataError
        The window reaches beyond the record.
    ConfigError
        `every` is not positive.
    """
    check_within(acceleration.time, start, end, acceleration.source)
    if every is None:
        time = acceleration.time
        at = np.r_[start, time[(time > start) & (time < end)], end]
    elif every > 0.0:
        # A step that falls on the end but for rounding is the end.
        at = np.minimum(start + np.arange(int((end - start) / every + 1e-9) + 1) * every, end)
    else:
        raise ConfigError("crash.no-step", quantity="every", every=every)
    course = VelocityCourse(acceleration)
    change = course.velocity(at) - course.velocity(np.array([start]))
    size = np.sqrt((change**2).sum(axis=1))
    table = pd.DataFrame(
        np.column_stack([change, np.hypot(change[:, 0], change[:, 1]), size]),
        index=pd.Index(at - start, name="time"),
        columns=["dv_x", "dv_y", "dv_z", "horizontal", "resultant"],
    )
    table.attrs = {"frame": acceleration.frame, "source": acceleration.source, "start": start}
    return table


def trailing_delta_v(
    acceleration: Acceleration,
    window: float = WINDOW,
    start: float | None = None,
    end: float | None = None,
) -> TrailingDeltaV:
    """Change of velocity over a trailing window, and its peak.

    Parameters
    ----------
    acceleration : Acceleration
    window : float, s
        By default the 30 ms of Tadic and Vukajlovic (2016), section 4; where it is no whole
        number of samples, its start is interpolated.
    start, end : float, s, optional
        Where windows may end; by default wherever the record reaches back far enough.

    Returns
    -------
    TrailingDeltaV

    Raises
    ------
    ConfigError
        The window is not positive.
    DataError
        The record, or what was asked of it, is shorter than the window.
    """
    if not (math.isfinite(window) and window > 0.0):
        raise ConfigError("crash.peak-window-not-positive", quantity="window", window=window)
    time = acceleration.time
    # A record of just the window's length may lack a rounding of it.
    slack = 8.0 * float(np.spacing(np.abs(time[[0, -1]]).max()))
    low = max(acceleration.begin + window, acceleration.begin if start is None else start)
    high = acceleration.end if end is None else min(end, acceleration.end)
    if low > high + slack:
        raise DataError(
            "crash.window-ms-ends-between-does",
            file=acceleration.source,
            quantity="window",
            window=window * 1000.0,
            low=low,
            high=high,
            begin=acceleration.begin,
            end=acceleration.end,
        )
    high = max(low, high)
    course = VelocityCourse(acceleration)
    at = time[(time >= low - slack) & (time <= high + slack)]
    before = np.maximum(at - window, acceleration.begin)
    vector = course.velocity(at) - course.velocity(before)
    best = course.largest_change(low, high, window)
    peak = delta_v(acceleration, max(best - window, acceleration.begin), best, across_gaps=True)
    return TrailingDeltaV(window, at, vector, peak, acceleration.frame)
