"""Sensors at the end of their range: what they cut off is not known from there on."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from strapdown.sensors.imu_uncertainty import ImuUncertainty
from strapdown.sensors.saturation import ROUNDING
from strapdown.systems.sins.gaps import Hole

__all__ = ["RangeEnds", "RangeState", "ends_of"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class RangeState:
    """Between pieces.

    Attributes
    ----------
    time, values : ndarray, (m,) and (m, 6)
        The last samples, two at most.
    since : ndarray, (6,), s
        Of each channel at its end, the last sample before it; NaN of the others.
    slope : ndarray, (6,)
        By which it came there.
    """

    time: Array = field(default_factory=lambda: np.empty(0))
    values: Array = field(default_factory=lambda: np.empty((0, 6)))
    since: Array = field(default_factory=lambda: np.full(6, np.nan))
    slope: Array = field(default_factory=lambda: np.zeros(6))


@dataclass(frozen=True, eq=False)
class RangeEnds:
    """Ends of the ranges of six channels.

    What a channel would read beyond its end is taken for a parabola: it came there with a slope s,
    the steepest of the two steps before, and were it to turn around midway and come back within a
    time T, it would have been ``s T²/6`` above the end, as an integral. That is the standard
    deviation of what is missing; as nobody knows T before the end, it grows over the samples: by
    ``(s t²/6)²`` in variance after a time t, the steps on both sides of the end included. A turn of
    which so large an angle is missing turns about the wrong axes, too: half its square is not known
    about each.

    Attributes
    ----------
    least, most : ndarray, (6,), rad/s and m/s²
        A reading of that size is at the end; what is larger belongs to another sensor.
    """

    least: Array
    most: Array

    def advance(
        self, state: RangeState, time: Array, values: Array
    ) -> tuple[RangeState, tuple[Hole, ...]]:
        """Look at further samples; pieces of any length give the same as the whole.

        Parameters
        ----------
        state : RangeState
        time : ndarray, (k,), s
        values : ndarray, (k, 6)

        Returns
        -------
        state : RangeState
        holes : tuple of Hole
            A step each, with what it adds to what is not known.
        """
        size = np.abs(values)
        at = (size >= self.least) & (size <= self.most)
        t, v = np.concatenate([state.time, time]), np.concatenate([state.values, values])
        new, rows = len(state.time), np.atleast_1d(at.any(axis=1))
        holes = []
        if rows.any() or not np.isnan(state.since).all():
            # A sample at an end, and the one after it.
            after = ~np.isnan(state.since).all()
            open_ = rows | np.concatenate([[after], rows[:-1]])
            since, slope = state.since.copy(), state.slope.copy()
            for k in np.flatnonzero(open_).tolist():
                i = new + k
                if i == 0:
                    # A record that begins at an end: how long it stood there is not in it.
                    since[at[0]] = t[0]
                    continue
                begun = at[k] & np.isnan(since)
                if begun.any():
                    since[begun] = t[i - 1]
                    near = t[max(i - 2, 0) : i + 1]
                    steps = np.abs(np.diff(v[max(i - 2, 0) : i + 1], axis=0))
                    slope[begun] = (steps / np.diff(near)[:, None]).max(axis=0)[begun]
                here, before = t[i] - since, np.maximum(t[i - 1] - since, 0.0)
                missed = np.where(
                    np.isnan(since), 0.0, slope / 6.0 * np.array([before**2, here**2])
                )
                missed[np.isnan(missed)] = 0.0
                more = np.diff(np.square(missed), axis=0)[0]
                more[:3] += np.diff(np.square(0.5 * np.square(missed[:, :3])).sum(axis=1))
                sd = np.sqrt(more) / (t[i] - t[i - 1])
                holes.append(Hole(float(t[i - 1]), float(t[i]), sd[:3], sd[3:]))
                since[~at[k]] = np.nan
            state = replace(state, since=since, slope=slope)
        kept = max(len(t) - 2, 0)
        state = replace(state, time=t[kept:].copy(), values=v[kept:].copy())
        return state, tuple(holes)


def ends_of(sensors: ImuUncertainty) -> RangeEnds | None:
    """Return the ends of the ranges that are stated; None where none is.

    Parameters
    ----------
    sensors : ImuUncertainty
        A reading within a step of the converter of the stated end is at it.
    """
    triads = (sensors.gyro, sensors.accel)
    full = np.concatenate([np.asarray(one.axis("full_scale"), dtype=float) for one in triads])
    step = np.concatenate([np.asarray(one.axis("quantization"), dtype=float) for one in triads])
    if np.isinf(full).all():
        return None
    with np.errstate(invalid="ignore"):
        slack = np.where(np.isfinite(full), np.maximum(step, ROUNDING * full), 0.0)
    return RangeEnds(full - slack, np.where(np.isfinite(full), full + slack, 0.0))
