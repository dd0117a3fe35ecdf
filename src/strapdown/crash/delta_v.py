"""Change of velocity over a window, a trailing window and an event."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from strapdown.crash.acceleration import Acceleration, check_within, window_weights
from strapdown.crash.events import CrashEvent
from strapdown.dsp.samples import running_integral
from strapdown.errors import ConfigError, DataError
from strapdown.tables.checks import Array

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
        ``vector = weights @ values`` of the acceleration; for a trajectory, the dimensionless
        weights of its velocities.
    start_rate, end_rate : ndarray, (3,), m/s²
        Acceleration at the two ends: the change of the vector per error of `end` and, with the
        opposite sign, of `start`.
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
        """Covariance, (3, 3), m²/s², from white noise alone: sd, m/s², one, (3,) or (n, 3)."""
        sds = np.broadcast_to(np.asarray(noise, dtype=np.float64), (len(self.weights), 3))
        return np.diag(self.weights**2 @ sds**2)


@dataclass(frozen=True, eq=False)
class TrailingDeltaV:
    """Change of velocity, (m, 3), m/s, over a window, s, that trails each sample.

    `time`, (m,), s: ends of the windows, samples with a full window before them; `peak`: the window
    with the largest resultant, which may end between samples.
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
        `body_acceleration` for the recorder's result (integrated along the rotating axes), or
        `resolved_acceleration` for the change in north-east-down.
    start, end : float, s
        Anywhere within the record; interpolated between samples as in `window_weights`.
    across_gaps : bool
        Bridge gaps of the record by linear interpolation.

    Raises
    ------
    DataError
        The window is empty, extends beyond the record, or contains a gap.
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


def cumulative_delta_v(
    acceleration: Acceleration, start: float, end: float, every: float | None = None
) -> pd.DataFrame:
    """Change of velocity since an instant, over time.

    From `start` to `end`, s, within the record, in steps of `every`, s, or at the samples and both
    ends. Returns ``dv_x dv_y dv_z``, ``horizontal``, ``resultant``, m/s, by ``time``, s, from
    `start` on, in the frame of the acceleration. `DataError`, `ConfigError`: the window or the step
    is not possible.
    """
    check_within(acceleration.time, start, end, acceleration.source)
    if every is None:
        time = acceleration.time
        at = np.r_[start, time[(time > start) & (time < end)], end]
    elif every > 0.0:
        # A step that equals the end up to rounding is the end.
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
        By default the 30 ms of Tadic and Vukajlovic (2016), section 4; if not an integer
        number of samples, its start is interpolated.
    start, end : float, s, optional
        Range of the window ends; by default wherever the record reaches back far enough.

    Raises
    ------
    ConfigError
        The window is not positive.
    DataError
        The record, or the requested range, is shorter than the window.
    """
    if not (math.isfinite(window) and window > 0.0):
        raise ConfigError("crash.peak-window-not-positive", quantity="window", window=window)
    time = acceleration.time
    # A record exactly as long as the window may be shorter by rounding.
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


# Velocity at any instant of a record, and the window with the largest change.


#: Value, slope and half the curvature of each component at some instants, (m, k) each.
Polynomials = tuple[Array, Array, Array]


class VelocityCourse:
    """Integral of an acceleration since its first stamp, at any instant.

    The acceleration is linear between instantaneous samples and constant over the interval of a
    mean; the velocity is the same as from `window_weights`.
    """

    def __init__(self, acceleration: Acceleration) -> None:
        self._time, values = acceleration.time, acceleration.values
        # The acceleration just after each step's start, and its slope over the step.
        steps = np.diff(self._time)[:, None]
        mean = acceleration.sampling == "mean"
        self._first = values[1:] if mean else values[:-1]
        self._slope = (values[1:] - self._first) / steps
        self._velocity = running_integral(self._time, values, means=mean)

    def _place(self, instants: Array) -> tuple[NDArray[np.int64], Array]:
        time = self._time
        k = np.clip(np.searchsorted(time, instants, side="right") - 1, 0, len(time) - 2)
        return k.astype(np.int64), (instants - time[k])[:, None]

    def velocity(self, instants: Array) -> Array:
        """Velocity at instants, (m, 3), m/s, zero at the first stamp."""
        k, u = self._place(instants)
        moved: Array = self._velocity[k] + u * (self._first[k] + 0.5 * u * self._slope[k])
        return moved

    def rate(self, instants: Array) -> Array:
        """Acceleration at instants, (m, 3), m/s²."""
        k, u = self._place(instants)
        rate: Array = self._first[k] + u * self._slope[k]
        return rate

    def slope(self, instants: Array) -> Array:
        """Slope of the acceleration at instants between stamps, (m, 3), m/s³."""
        k, _ = self._place(instants)
        slope: Array = self._slope[k]
        return slope

    def largest_change(self, low: float, high: float, window: float) -> float:
        """End in [low, high] of the window in which the velocity changes most, s."""
        time, begin = self._time, self._time[0]

        def course(at: Array) -> Polynomials:
            before = np.maximum(at - window, begin)
            return (
                self.velocity(at) - self.velocity(before),
                self.rate(at) - self.rate(before),
                0.5 * (self.slope(at) - self.slope(before)),
            )

        # Between these breaks the change is a single polynomial.
        return _largest(course, np.r_[time, time + window], low, high)


def _largest(
    course: Callable[[Array], Polynomials], breaks: Array, low: float, high: float
) -> float:
    """Instant in an interval at which the length of a vector of quadratics is largest."""
    nodes = np.unique(np.r_[low, breaks[(breaks > low) & (breaks < high)], high])
    sizes = np.sqrt((course(nodes)[0] ** 2).sum(axis=1))
    best = int(np.argmax(sizes))
    at, most = float(nodes[best]), float(sizes[best])
    if len(nodes) < 2:
        return at
    # Expanded about midpoints, where rounding of a break cannot select the neighboring polynomial.
    middle, half = 0.5 * (nodes[1:] + nodes[:-1]), 0.5 * np.diff(nodes)
    c0, c1, c2 = course(middle)
    # Within an interval the length exceeds that at the nearer end by at most half the interval
    # times the greatest slope, which is at an end.
    steep = np.sqrt(
        np.maximum(
            ((c1 - 2.0 * c2 * half[:, None]) ** 2).sum(axis=1),
            ((c1 + 2.0 * c2 * half[:, None]) ** 2).sum(axis=1),
        )
    )
    reach = np.maximum(sizes[1:], sizes[:-1]) + half * steep
    for k in np.flatnonzero(reach > most).tolist():
        a, b, c = c0[k], c1[k], c2[k]
        # Derivative of half the squared length: a cubic.
        cubic = [2.0 * c @ c, 3.0 * b @ c, b @ b + 2.0 * a @ c, a @ b]
        roots = np.roots(cubic)
        for u in roots[np.abs(roots.imag) <= 1e-6 * half[k]].real:
            if abs(u) <= half[k]:
                found = float(np.sqrt((((c * u + b) * u + a) ** 2).sum()))
                # On a plateau its beginning is taken, independent of rounding.
                if found > most * (1.0 + 1e-12):
                    at, most = float(middle[k] + u), found
    return at


# Change of velocity of an event as 49 CFR Part 563 requires of a recorder.


#: 563.7, Table I: delta-V every 10 ms, for 250 ms or to 30 ms after the end of the event, whichever
#: is shorter.
RECORDED, BEYOND_END, EVERY = 0.250, 0.030, 0.010


def recorder_delta_v(acceleration: Acceleration, event: CrashEvent) -> pd.DataFrame:
    """Cumulative change of velocity as a recorder stores it.

    Parameters
    ----------
    acceleration : Acceleration
        In the frame ``body`` or ``impact``.
    event : CrashEvent

    Returns
    -------
    DataFrame
        As `cumulative_delta_v`, every 10 ms from time zero: for 250 ms, to 30 ms after the end of
        the event, or to the end of the record, whichever is least. Not rounded; a recorder
        rounds to 1 km/h.

    Raises
    ------
    DataError
        Time zero is not within the record.
    """
    zero = event.time_zero
    stop = min(zero + RECORDED, event.end + BEYOND_END, acceleration.end)
    return cumulative_delta_v(acceleration, zero, stop, every=EVERY)
