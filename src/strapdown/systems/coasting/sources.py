"""What a drift comes from: the errors of the start and of the sensors, each made larger alone."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from strapdown.estimation.error_filter import symmetric
from strapdown.estimation.error_model import ErrorModel
from strapdown.navigation.navigator import Navigator, NavigatorState

__all__ = ["Source", "scaled", "sources_of"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Source:
    """One source of drift.

    Attributes
    ----------
    name : str
        ``position``, ``velocity``, ``tilt``, ``heading``, ``gyro_noise``, ``accel_noise``;
        ``gyro_bias``, ``accel_bias``: as they are at the start, with what of them drifts;
        ``gyro_instability``, ``accel_instability``: by how much they change after it; or the name
        of another block of states.
    rows : tuple of tuple of int
        Places among the physical errors. What stands in one row of it adds up to one error.
    driven : tuple of str
        Blocks whose driving noise belongs to it.
    unit : str
        Of these errors in SI; empty for noise.
    """

    name: str
    rows: tuple[tuple[int, ...], ...] = ()
    driven: tuple[str, ...] = ()
    unit: str = ""

    def sd(self, P: Array) -> Array:
        """Standard deviations of its errors, (k,), of a covariance of the physical errors."""
        sums = [P[np.ix_(row, row)].sum() for row in self.rows]
        return np.sqrt(np.maximum(np.array(sums, dtype=np.float64), 0.0))


#: Blocks that are one bias in two parts, by name of the triad.
BIASES = {triad: (f"{triad}_bias", f"{triad}_drift") for triad in ("gyro", "accel")}


def sources_of(model: ErrorModel) -> tuple[Source, ...]:
    """Return the sources of drift of an error model.

    Parameters
    ----------
    model : ErrorModel

    Returns
    -------
    tuple of Source
        The errors of the start, white noise, and the blocks of states of the sensors and aids.
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
    """Return a navigator and its state as they would be, were one source so many times as large.

    Standard deviations of its errors at the start, with what binds them to others, and the white
    noise that drives them, are multiplied by the factor.

    Parameters
    ----------
    navigator : Navigator
    state : NavigatorState
        Where the coasting begins.
    source : Source
    factor : float

    Returns
    -------
    navigator : Navigator
    state : NavigatorState
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
