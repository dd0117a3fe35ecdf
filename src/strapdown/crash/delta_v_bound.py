"""Uncertainty of a change of velocity, from the same unknowns as the path."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from strapdown.constants import STANDARD_GRAVITY as GRAVITY
from strapdown.constants import TWO_SIDED_95, Triple
from strapdown.crash.acceleration import NOISE, by_contributor
from strapdown.crash.contact import Contact
from strapdown.crash.delta_v import DeltaV
from strapdown.crash.measuring_point import SampleEffects
from strapdown.crash.path import ATTITUDE, VELOCITY, CrashPath
from strapdown.crash.pdof import NedPdof, Pdof, PdofInterval, ned_pdof, pdof, pdof_interval
from strapdown.errors import DataError
from strapdown.rotation import cross_matrix
from strapdown.tables.checks import Array

#: Names of the windows in words.
WINDOWS = {"peak": "peak", "event": "contact"}
#: Line of the error budget: of the mean force before the crash, which is subtracted.
AT_REST = "level before the crash"
#: Names of the windows in words.
WINDOWS = {"peak": "peak", "event": "contact"}
#: Line of the error budget: of the instants that bound the window.
WINDOW_ENDS = "time of the window"


@dataclass(frozen=True, eq=False)
class DeltaVBound:
    """Uncertainty of a change of velocity.

    Attributes
    ----------
    covariance : ndarray, (3, 3), (m/s)²
    by_contributor : DataFrame
        Covariance of each contributor as nine columns ``xx xy … zz``, (m/s)²; they add up to
        `covariance`.
    """

    covariance: Array = field(repr=False)
    by_contributor: pd.DataFrame = field(repr=False)

    @property
    def sd(self) -> Triple:
        """Standard deviations of the components, m/s."""
        x, y, z = np.sqrt(np.diagonal(self.covariance))
        return float(x), float(y), float(z)

    @property
    def half_width(self) -> Triple:
        """Half widths of the 95 % intervals, m/s."""
        x, y, z = (TWO_SIDED_95 * s for s in self.sd)
        return x, y, z

    def along(self, direction: ArrayLike) -> float:
        """Standard deviation along a direction, m/s; along the vector itself, of the resultant.

        Raises
        ------
        DataError
            The direction has zero length.
        """
        d = _direction(direction)
        return float(np.sqrt(d @ self.covariance @ d))

    def shares(self, direction: ArrayLike) -> pd.Series:
        """Fraction of the variance along a direction from each contributor; the sum is one."""
        d = _direction(direction)
        parts = self.by_contributor.to_numpy().reshape(-1, 3, 3) @ d @ d
        total = parts.sum()
        return pd.Series(
            parts / total if total > 0.0 else parts, index=self.by_contributor.index, name="share"
        )


def body_delta_v_bound(
    effects: SampleEffects,
    weights: ArrayLike,
    *,
    rest_sd: ArrayLike = (0.0, 0.0, 0.0),
    at_ends: ArrayLike | None = None,
) -> DeltaVBound:
    """Uncertainty of a change of velocity integrated along the rotating body axes.

    `weights`, (n,), s: the change is their product with specific force minus stationary force;
    `rest_sd`, (3,), m/s²: of the stationary mean, by noise and by what the vehicle accelerates
    steadily; `at_ends`, (e, 3), m/s: effect on the change of one standard deviation of each instant
    that bounds the window.
    """
    w = np.asarray(weights, dtype=np.float64)
    noise = (w[:, None] ** 2 * effects.force_noise**2).sum(axis=0)
    at_rest = (float(w.sum()) * np.asarray(rest_sd, dtype=np.float64)) ** 2
    each = body_effects(effects, w)
    return _bound(each, effects.contributors, np.diag(noise), at_ends, at_rest)


def body_effects(effects: SampleEffects, weights: Array) -> Array:
    """Effect of one standard deviation of each unknown on such a change, (p, 3), m/s."""
    felt = np.einsum("n,pni->pi", weights, effects.force)
    return np.asarray(felt - float(weights.sum()) * effects.rest_force)


def resolved_delta_v_bound(
    path: CrashPath, start: float, end: float, *, at_ends: ArrayLike | None = None
) -> DeltaVBound:
    """Uncertainty of a change of velocity in local level, gravity subtracted by the attitude.

    Between two instants, s, within the path, in its axes; errors are interpolated linearly.
    Independent of the error of the entry speed. `at_ends` as `body_delta_v_bound`. `DataError`: the
    window is not within the path.
    """
    low, high = path.time[0] - 1e-9, path.time[-1] + 1e-9
    if not (low <= start < end <= high):
        raise DataError(
            "crash.window-not-within-path",
            quantity="window",
            start=start,
            end=end,
            time=path.time[0],
            time_2=path.time[-1],
        )
    velocity = path.errors[:, :, VELOCITY]
    each = _at(path.time, velocity, end) - _at(path.time, velocity, start)
    return _bound(each, path.contributors, _noise_between(path, start, end), at_ends)


def _at(time: Array, values: Array, instant: float) -> Array:
    """Values (p, n, …) at an instant between two samples."""
    k = int(np.clip(np.searchsorted(time, instant, side="right") - 1, 0, len(time) - 2))
    part = (instant - time[k]) / (time[k + 1] - time[k])
    return np.asarray((1.0 - part) * values[:, k] + part * values[:, k + 1])


def _noise_between(path: CrashPath, start: float, end: float) -> Array:
    """Covariance of the change of velocity between two instants from noise."""
    noise, entry = path.noise_covariance[None], path.time[path.anchor]
    if end <= entry + 1e-9:
        start, end = end, start
    here, there = _at(path.time, noise, start)[0], _at(path.time, noise, end)[0]
    if start >= entry - 1e-9 or end < start:
        gained = path.table[["VN", "VE", "VD"]].to_numpy()[None]
        felt = (_at(path.time, gained, end) - _at(path.time, gained, start))[0]
        # A rotation of the attitude turns the measured specific force, not gravity.
        felt[2] -= GRAVITY * (end - start)
        tilt = -cross_matrix(felt)
        carried = tilt @ here[ATTITUDE, VELOCITY]
        # var(v1 - v0) = P11 + P00 - P10 - P01, with v1 = v0 + tilt phi0 + new noise.
        both = here[VELOCITY, VELOCITY] + carried
        return np.asarray(there[VELOCITY, VELOCITY] + here[VELOCITY, VELOCITY] - both - both.T)
    # The two sides of the entry have independent noise.
    return np.asarray(there[VELOCITY, VELOCITY] + here[VELOCITY, VELOCITY])


def _bound(
    each: Array,
    contributors: tuple[str, ...],
    noise: Array,
    at_ends: ArrayLike | None,
    at_rest: ArrayLike = (0.0, 0.0, 0.0),
) -> DeltaVBound:
    products = np.einsum("pi,pj->pij", each, each).reshape(-1, 9)
    more = {NOISE: noise.ravel()}
    if np.any(at_rest):
        more[AT_REST] = np.diag(np.asarray(at_rest, dtype=np.float64)).ravel()
    if at_ends is not None:
        ends = np.asarray(at_ends, dtype=np.float64)
        more[WINDOW_ENDS] = (ends.T @ ends).ravel()
    columns = [a + b for a in "xyz" for b in "xyz"]
    table = by_contributor(products, columns, contributors, more)
    return DeltaVBound(table.to_numpy().sum(axis=0).reshape(3, 3), table)


def _direction(given: ArrayLike) -> Array:
    d = np.asarray(given, dtype=np.float64)
    size = float(np.sqrt(d @ d)) if d.shape == (3,) else 0.0
    if not (math.isfinite(size) and size > 0.0):
        raise DataError("crash.no-length-or-not-three", quantity="direction", d=d.tolist())
    return np.asarray(d / size)


# A change of velocity with its direction of force, both with 95 % bounds.


@dataclass(frozen=True, eq=False)
class VelocityChange:
    """Change of velocity over a window, with its direction of force.

    Attributes
    ----------
    window : {'peak', 'event'}
        The trailing window in which the change is largest, or the whole contact of the event; the
        event of 49 CFR 563, from its time zero on, is a third window, of no change here.
    delta_v : DeltaV
        In its frame: ``body``, as recorders integrate, or ``ned``, gravity subtracted by the
        attitude.
    bound : DeltaVBound
    pdof : Pdof or NedPdof
    interval : PdofInterval
        Of the direction, 95 %; for north-east-down, of the azimuth.
    missing : tuple of {'before', 'after', 'clipped'}
        Why the record holds only a part of the change: it begins within the contact, it ends
        within it, or a sensor was at the end of its range. Empty where it holds all, or where what
        it misses is within the bound.
    open_axes : tuple of bool
        Components of which a part is missing.
    """

    window: str
    delta_v: DeltaV
    bound: DeltaVBound = field(repr=False)
    pdof: Pdof | NedPdof
    interval: PdofInterval
    missing: tuple[str, ...] = ()
    open_axes: tuple[bool, bool, bool] = (False, False, False)

    def __repr__(self) -> str:
        return f"<VelocityChange, {change_line(self)}>"

    @property
    def at_least(self) -> bool:
        """Whether the resultant has a lower bound only, and the direction is that of a part."""
        return bool(self.missing)

    @property
    def resultant_range(self) -> tuple[float, float]:
        """95 % bounds of the resultant, m/s; the upper one is infinite where `at_least`."""
        low, high = self.resultant - self.resultant_bound, self.resultant + self.resultant_bound
        return (max(low, 0.0), math.inf) if self.at_least else (low, high)

    @property
    def ranges(self) -> Array:
        """95 % bounds of the components, (3, 2), m/s.

        Infinite on the far side of a component of which a part is missing, and on both sides where
        its sign is not determined.
        """
        half = np.asarray(self.bound.half_width)
        ends = np.column_stack([self.delta_v.vector - half, self.delta_v.vector + half])
        is_open = np.asarray(self.open_axes)
        down, up = is_open & (ends[:, 0] <= 0.0), is_open & (ends[:, 1] >= 0.0)
        ends[down, 0], ends[up, 1] = -math.inf, math.inf
        return ends

    @property
    def resultant(self) -> float:
        """Length of the change, m/s."""
        return self.delta_v.resultant

    @property
    def resultant_bound(self) -> float:
        """Half width of the 95 % interval of the resultant, m/s."""
        return TWO_SIDED_95 * self.bound.along(self.delta_v.vector)


@dataclass(frozen=True, eq=False)
class EventChanges:
    """Changes of velocity of one event.

    Attributes
    ----------
    peak : VelocityChange
        Over the trailing window in which the change is largest.
    event : VelocityChange
        Over the contact.
    contact : Contact
    """

    peak: VelocityChange
    event: VelocityChange
    contact: Contact = field(repr=False)


def velocity_change(
    window: str,
    change: DeltaV,
    bound: DeltaVBound,
    heading_deg: float = 0.0,
    *,
    missing: tuple[str, ...] = (),
    open_axes: tuple[bool, bool, bool] = (False, False, False),
) -> VelocityChange:
    """Combine a change, its bound in the same axes, and its direction of force.

    `heading_deg`: of the vehicle at the impact, for a change in north-east-down. `missing` and
    `open_axes` as `VelocityChange`.
    """
    direction = ned_pdof(change, heading_deg) if change.frame == "ned" else pdof(change)
    interval = pdof_interval(change, bound.covariance)
    return VelocityChange(window, change, bound, direction, interval, missing, open_axes)


def change_line(change: VelocityChange) -> str:
    """One change of velocity as a line of text."""
    axes = "north, east, down" if change.delta_v.frame == "ned" else "forward, right, down"
    parts = ", ".join(
        f"{v:.2f} ± {b:.2f}"
        for v, b in zip(change.delta_v.vector, change.bound.half_width, strict=True)
    )
    at, low, high = direction_bounds(change)
    name = "azimuth" if change.delta_v.frame == "ned" else "PDOF"
    if change.at_least:
        parts = f"recorded part {parts}"
        name += " of the recorded part"
    direction = (
        "not determined"
        if change.interval.horizontal.undetermined
        else f"{at:.1f} deg ({low:.1f} to {high:.1f})"
    )
    window = WINDOWS[change.window]
    return (
        f"{window} {change.delta_v.start:.4f} to {change.delta_v.end:.4f} s: {axes} "
        f"{parts} m/s; {name} {direction}"
    )


def direction_bounds(change: VelocityChange) -> tuple[float, float, float]:
    """Horizontal direction and its bounds, deg; bounds within half a turn of the direction."""
    across = change.interval.horizontal
    at = change.pdof.azimuth_deg if isinstance(change.pdof, NedPdof) else change.pdof.horizontal_deg
    turn = 360.0 * round((at - 0.5 * (across.low_deg + across.high_deg)) / 360.0)
    return at, across.low_deg + turn, across.high_deg + turn
