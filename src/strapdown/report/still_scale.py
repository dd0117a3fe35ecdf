"""Axes of a still: their ends, and where they have ticks."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown.report.plan_view import nice_step, tick_words

__all__ = ["Scale", "Tick", "fitted", "ticks"]

Array = NDArray[np.float64]

# Numbers beyond are written with a power of ten beside the axis.
_SMALL, _LARGE = 1e-3, 1e6


@dataclass(frozen=True)
class Scale:
    """An axis from `low` to `high`."""

    low: float
    high: float
    log: bool = False

    def share(self, values: ArrayLike) -> Array:
        """Return where values lie, from 0 at the low end to 1; NaN where a log axis has none."""
        v = np.asarray(values, dtype=np.float64)
        if not self.log:
            return np.asarray((v - self.low) / (self.high - self.low))
        low, high = math.log10(self.low), math.log10(self.high)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray((np.log10(np.where(v > 0.0, v, np.nan)) - low) / (high - low))

    @property
    def power(self) -> int:
        """Power of ten by which labels are divided."""
        largest = max(abs(self.low), abs(self.high))
        if self.log or _SMALL <= largest < _LARGE:
            return 0
        return math.floor(math.log10(largest))


@dataclass(frozen=True)
class Tick:
    """A place on an axis; without a grid line, if it is between others."""

    at: float
    text: str
    grid: bool = True


def fitted(values: Sequence[ArrayLike], log: bool = False, margin: float = 0.05) -> Scale:
    """Make an axis that holds values, with a margin at both ends.

    Parameters
    ----------
    values : sequence of array_like
        What is not finite, or not positive on a logarithmic axis, is left out.
    log : bool
    margin : float
        Of what the values span.

    Returns
    -------
    Scale
    """
    v = np.concatenate([np.empty(0), *(np.asarray(x, dtype=np.float64).ravel() for x in values)])
    v = v[np.isfinite(v) & ((v > 0.0) if log else True)]
    if not v.size:
        return Scale(0.1, 1.0, True) if log else Scale(0.0, 1.0)
    low, high = float(v.min()), float(v.max())
    if log:
        low, high = math.log10(low), math.log10(high)
    room = margin * (high - low)
    if not room > 1e-12 * max(abs(low), abs(high)):
        room = 0.3 if log else 0.05 * abs(low) or 0.05
    low, high = low - room, high + room
    return Scale(10.0**low, 10.0**high, True) if log else Scale(low, high)


def ticks(scale: Scale, most: int, *, step: float = 0.0, between: float = 30.0) -> list[Tick]:
    """Choose the ticks of an axis.

    Parameters
    ----------
    scale : Scale
    most : int
        Steps that it has room for.
    step : float
        Between them, where it is asked for; not of a logarithmic axis.
    between : float
        A logarithmic axis that spans less has labels at twice and five times powers of ten.

    Returns
    -------
    list of Tick
    """
    if not scale.log:
        return _even(scale, step or nice_step((scale.high - scale.low) / max(most, 1)))
    found: list[Tick] = []
    first, last = math.floor(math.log10(scale.low)), math.ceil(math.log10(scale.high))
    stride = -(-(last - first) // max(most, 1))
    for power in range(first, last + 1):
        for digit in range(1, 10):
            at = digit * 10.0**power
            if not scale.low <= at <= scale.high * (1.0 + 1e-12):
                continue
            if digit == 1:
                found.append(Tick(at, _short(at) if power % stride == 0 else ""))
            elif stride == 1:
                said = digit in (2, 5) and scale.high < between * scale.low
                found.append(Tick(at, _short(at) if said else "", grid=False))
    if sum(bool(tick.text) for tick in found) < 2:
        return _even(scale, nice_step((scale.high - scale.low) / max(most, 1)))
    return found


def _even(scale: Scale, step: float) -> list[Tick]:
    unit = 10.0**scale.power
    first, last = math.ceil(scale.low / step - 1e-9), math.floor(scale.high / step + 1e-9)
    return [
        Tick(k * step, tick_words(k * step / unit, step / unit)) for k in range(first, last + 1)
    ]


def _short(value: float) -> str:
    return f"{value:g}".replace("-", "−")
