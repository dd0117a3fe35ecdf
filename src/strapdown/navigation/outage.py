"""Predict drift: the filter's covariance over an outage, and the share of each source."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.dsp.chi_square import plane_bound
from strapdown.estimation.error_filter import symmetric
from strapdown.estimation.error_model import ErrorModel
from strapdown.navigation.engine import SAME_INSTANT
from strapdown.navigation.navigator import Navigator, NavigatorState
from strapdown.navigation.record import NavigationChunk
from strapdown.navigation.recorder import record_of
from strapdown.progress import Progress, silent

Array = NDArray[np.float64]

#: Runs a navigator from a state over the samples of an outage.
Go = Callable[[Navigator, NavigatorState], Sequence[NavigationChunk]]

#: Predicted quantities with units.
QUANTITIES = {
    "horizontal": "m",
    "along": "m",
    "across": "m",
    "vertical": "m",
    "speed": "m/s",
    "heading": "rad",
}
#: Relative step of a source's size. Without measurements a variance is quadratic in it, and any
#: step is exact; with measurements the gains change, and the remainder is of second order.
LINEAR_PART, AIDED_PART = 0.5, 0.02
#: Number of instants of a forecast.
INSTANTS = 240
# Speed below which a body has no course, m/s.
STANDS = 0.1


@dataclass(frozen=True, eq=False)
class Share:
    """Contribution of one source.

    Attributes
    ----------
    sd : ndarray, (k,)
        Standard deviation of its errors at the begin of the outage, in SI; empty for white noise.
    variance : mapping of str to ndarray, (n,)
        By quantity: share of the variance. All shares and that of the measurements add up to the
        total. Of initial errors that are correlated, as tilt and accelerometer bias are, each has
        half of their joint contribution, which may be negative: they cancel.
    alone : mapping of str to ndarray, (n,)
        By quantity: standard deviation without other sources; NaN with measurements, whose gains
        would then differ.
    """

    source: Source
    sd: Array
    variance: dict[str, Array]
    alone: dict[str, Array]


#: Shares of the sources, and by quantity what is due to the remaining measurements.
Budget = tuple[tuple[Share, ...], dict[str, Array]]


@dataclass(frozen=True, eq=False)
class Forecast:
    """Predicted drift.

    Attributes
    ----------
    begin : float, s
        Of the outage, on the clock of the samples.
    time : ndarray, (n,), s
        Time since then.
    trajectory : DataFrame
        Trajectory table of the motion over the outage, by time since its begin.
    covariance : ndarray, (n, 9, 9)
        Displacement m, velocity m/s, rotation rad, north-east-down.
    course : ndarray, (n,), rad
        Course; the heading while stationary.
    budget : callable
        Computes `shares` and `aids`, which takes two further runs for each source: they are
        computed when they are first read.
    """

    begin: float
    time: Array
    trajectory: pd.DataFrame
    covariance: Array
    course: Array
    budget: Callable[[], Budget] = field(repr=False)

    @property
    def shares(self) -> tuple[Share, ...]:
        """Contributions of the sources, the largest at the end first."""
        return self._computed[0]

    @property
    def aids(self) -> dict[str, Array]:
        """By quantity: variance by the noise of the remaining measurements, (n,); empty without."""
        return self._computed[1]

    @cached_property
    def _computed(self) -> Budget:
        return self.budget()

    def variance(self, quantity: str) -> Array:
        """Variance of a quantity, (n,); for the plane, the sum of both components."""
        return variances(self.covariance, self.course)[quantity]

    def sd(self, quantity: str) -> Array:
        """Standard deviation of a quantity, (n,)."""
        return np.sqrt(np.maximum(self.variance(quantity), 0.0))

    @property
    def bound(self) -> Array:
        """95 % bound: semi-major axis of the horizontal position ellipse, (n,), m."""
        return plane_bound(self.covariance)


def variances(P: Array, course: Array) -> dict[str, Array]:
    """Return the variances of the predicted quantities.

    Parameters
    ----------
    P : ndarray, (n, 9, 9)
        In north-east-down; any symmetric matrices, such as the share of one source.
    course : ndarray, (n,), rad

    Returns
    -------
    dict of str to ndarray, (n,)
        By `QUANTITIES`; ``along`` and ``across`` the course, ``speed`` of the horizontal velocity.
    """
    c, s = np.cos(course), np.sin(course)
    nn, ee, ne = P[:, 0, 0], P[:, 1, 1], P[:, 0, 1]
    return {
        "horizontal": nn + ee,
        "along": c * c * nn + 2.0 * c * s * ne + s * s * ee,
        "across": s * s * nn - 2.0 * c * s * ne + c * c * ee,
        "vertical": P[:, 2, 2],
        "speed": P[:, 3, 3] + P[:, 4, 4],
        "heading": P[:, 8, 8],
    }


def forecast(
    navigator: Navigator,
    state: NavigatorState,
    go: Go,
    outage: float,
    *,
    aided: bool,
    progress: Progress = silent,
) -> Forecast:
    """Run the filter over an outage, and for its budget with each source larger and smaller.

    The variance at any instant is homogeneous of the second degree in the sizes of all sources,
    including the noise of the remaining measurements: half of its derivatives by the logarithms of
    these sizes add up to it (Euler). Each is a central difference of the filter's own runs.

    Parameters
    ----------
    navigator : Navigator
        Without the missing measurements.
    state : NavigatorState
        At the begin of the outage.
    go : callable
        Processes the samples of the outage; the same for every run.
    outage : float, s
    aided : bool
        Whether measurements remain.
    progress : callable, optional
    """
    navigator = _marked(navigator, outage)
    time, P, trajectory = covariance_over(navigator, state, go, outage)
    at = time + state.time
    course = courses(trajectory, at)
    whole = variances(P, course)

    def budget() -> Budget:
        part = AIDED_PART if aided else LINEAR_PART
        known = physical(navigator, state)
        shares = []
        sources = sources_of(navigator.filter.model)
        for number, source in enumerate(sources):
            progress(f"budget: {source.name.replace('_', ' ')}", number / len(sources))
            more, less = (
                _as_it_would_be(*scaled(navigator, state, source, f), go, at, course)
                for f in (1.0 + part, 1.0 - part)
            )
            own = {q: (more[q] - less[q]) / (4.0 * part) for q in whole}
            curved = {q: (more[q] + less[q] - 2.0 * whole[q]) / (2.0 * part**2) for q in whole}
            none = np.full(len(time), math.nan)
            alone = {q: none if aided else np.sqrt(np.maximum(v, 0.0)) for q, v in curved.items()}
            shares.append(Share(source, source.sd(known), own, alone))
        shares.sort(key=lambda one: -one.variance["horizontal"][-1])
        sums = {q: np.sum([one.variance[q] for one in shares], axis=0) for q in whole}
        return tuple(shares), {q: v - sums[q] for q, v in whole.items()} if aided else {}

    trajectory.index = trajectory.index - state.time
    return Forecast(state.time, time, trajectory, P, course, budget)


def covariance_over(
    navigator: Navigator, state: NavigatorState, go: Go, outage: float
) -> tuple[Array, Array, pd.DataFrame]:
    """Run the filter over an outage.

    Returns
    -------
    time : ndarray, (n,), s
        Since the begin of the outage.
    covariance : ndarray, (n, 9, 9)
        As `Forecast.covariance`.
    trajectory : DataFrame
        On the clock of the samples.
    """
    navigator, begin = _marked(navigator, outage), state.time
    start = _start(navigator, state)
    record = record_of(navigator, go(navigator, state), "outage")
    time = np.concatenate([[0.0], record.sd.index.to_numpy(dtype=np.float64) - begin])
    P = np.concatenate([start[None], record.covariance])
    return time, np.where(np.isnan(P).any(axis=0), np.nan, P), record.trajectory


def _marked(navigator: Navigator, outage: float) -> Navigator:
    """With the covariance at so many instants of an outage."""
    return replace(navigator, mark_interval=max(outage / INSTANTS, navigator.filter.step))


def _as_it_would_be(
    navigator: Navigator, state: NavigatorState, go: Go, at: Array, course: Array
) -> dict[str, Array]:
    """Variances over a run, by quantity, at the instants of another.

    The instants are equal unless a remaining measurement depends on the covariance.
    """
    marks = [(mark.time, mark.covariance) for piece in go(navigator, state) for mark in piece.marks]
    time = np.array([state.time, *(t for t, _ in marks)])
    P = np.array([_start(navigator, state), *(P for _, P in marks)])
    if time.shape != at.shape or np.abs(time - at).max() > SAME_INSTANT:
        P = np.array([[np.interp(at, time, P[:, i, j]) for j in range(9)] for i in range(9)])
        P = P.transpose(2, 0, 1)
    return variances(P, course)


def _start(navigator: Navigator, state: NavigatorState) -> Array:
    """Covariance of the state at the begin of an outage, (9, 9), in north-east-down."""
    row = state.engine.filter.row
    turn = np.kron(np.eye(3), navigator.filter.mechanization.level_from_ned(row))
    P = physical(navigator, state)[:9, :9]
    return np.asarray(turn.T @ P @ turn)


def courses(trajectory: pd.DataFrame, at: Array) -> Array:
    """Course at instants, rad: the heading while stationary."""
    time = trajectory.index.to_numpy(dtype=np.float64)
    near = np.clip(np.searchsorted(time, at), 0, len(time) - 1)
    north, east, heading = (
        trajectory[c].to_numpy(dtype=np.float64)[near] for c in ("VN", "VE", "heading")
    )
    way = np.where(np.hypot(north, east) > STANDS, np.arctan2(east, north), np.radians(heading))
    return np.asarray(way, dtype=np.float64)


# Sources of drift: initial errors and sensor errors, each scaled separately.


@dataclass(frozen=True)
class Source:
    """One source of drift.

    Attributes
    ----------
    name : str
        ``position``, ``velocity``, ``tilt``, ``heading``, ``gyro_noise``, ``accel_noise``;
        ``gyro_bias``, ``accel_bias``: initial biases, including drifting parts;
        ``gyro_instability``, ``accel_instability``: their change during the outage; or the name
        of another block of states.
    rows : tuple of tuple of int
        Indices of physical errors. Those of one row add up to one error.
    driven : tuple of str
        Blocks whose driving noise belongs to it.
    unit : str
        SI unit of these errors; empty for noise.
    """

    name: str
    rows: tuple[tuple[int, ...], ...] = ()
    driven: tuple[str, ...] = ()
    unit: str = ""

    def sd(self, P: Array) -> Array:
        """Standard deviations of its errors, (k,), from a covariance of the physical errors."""
        sums = [P[np.ix_(row, row)].sum() for row in self.rows]
        return np.sqrt(np.maximum(np.array(sums, dtype=np.float64), 0.0))


#: Blocks that form one bias in two parts, by name of the triad.
BIASES = {triad: (f"{triad}_bias", f"{triad}_drift") for triad in ("gyro", "accel")}


def sources_of(model: ErrorModel) -> tuple[Source, ...]:
    """Return the sources of drift of an error model.

    Returns
    -------
    tuple of Source
        Initial errors, white noise, and the state blocks of sensors and measurements.
    """
    units = {one.block.name: one.block.unit for one in model.sensors}
    places = {n: tuple(range(rows.start, rows.stop)) for n, rows in model.columns_of.items()}
    out = [
        Source("position", _each(0, 1, 2), unit="m"),
        Source("velocity", _each(3, 4, 5), unit="m/s"),
        Source("tilt", _each(6, 7), unit="rad"),
        Source("heading", _each(8), unit="rad"),
        Source("gyro_noise"),
        Source("accel_noise"),
    ]
    for triad, names in BIASES.items():
        there = tuple(name for name in names if name in places)
        if there:
            rows = tuple(zip(*(places.pop(name) for name in there), strict=True))
            out += [
                Source(f"{triad}_bias", rows, unit=units[there[0]]),
                Source(f"{triad}_instability", driven=there),
            ]
    out += [Source(n, _each(*rows), (n,), units[n]) for n, rows in places.items()]
    return tuple(out)


def _each(*rows: int) -> tuple[tuple[int, ...], ...]:
    return tuple((row,) for row in rows)


def scaled(
    navigator: Navigator, state: NavigatorState, source: Source, factor: float
) -> tuple[Navigator, NavigatorState]:
    """Return a navigator and its state with one source scaled by a factor.

    The factor multiplies the initial standard deviations of its errors, keeping their correlations
    with others, and the white noise that drives them.

    Parameters
    ----------
    state : NavigatorState
        At the begin of the outage.
    """
    model = navigator.filter.model
    if source.name in ("gyro_noise", "accel_noise"):
        x, y, z = (factor * n for n in getattr(model, source.name))
        noisy = replace(model, **{source.name: (x, y, z)})
        return replace(navigator, filter=replace(navigator.filter, model=noisy)), state
    factors = np.ones(model.physical_size)
    factors[[k for row in source.rows for k in row]] = factor
    P = physical(navigator, state)
    changed = with_physical(navigator, state, factors[:, None] * P * factors)
    sensors = tuple(
        replace(one, drive=factor * one.drive) if one.block.name in source.driven else one
        for one in model.sensors
    )
    filter_ = replace(navigator.filter, model=replace(model, sensors=sensors))
    return replace(navigator, filter=filter_), changed


def physical(navigator: Navigator, state: NavigatorState) -> Array:
    """Return the covariance of the physical errors of a state, (p, p), in level axes."""
    return navigator.filter.physical_covariance(state.engine.filter)


def with_physical(navigator: Navigator, state: NavigatorState, P: Array) -> NavigatorState:
    """Return a state with another covariance of the physical errors, in level axes."""
    filter_, known = navigator.filter, state.engine.filter
    E = filter_.model.from_physical(filter_.mechanization, known.time, known.row)
    covariance = filter_.form.begin(symmetric(E @ P @ E.T))
    engine = replace(state.engine, filter=replace(known, covariance=covariance))
    return replace(state, engine=engine)
