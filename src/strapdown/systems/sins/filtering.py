"""A pre-filter within a chain: real stamps on its even grid, lost samples along lines."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown.dsp.samples import even_step
from strapdown.errors import ConfigError, DataError
from strapdown.prefilter.prefilter import Grid, Prefilter

__all__ = ["Filtered", "Filtering", "FilteringState"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class FilteringState:
    """Between pieces.

    Attributes
    ----------
    grid : Grid
        From zero: its numbers count steps since the first sample.
    inner : object
        State of the pre-filter.
    numbers, stamps : ndarray, (k,)
        Of samples around the next output: count of the grid, and stamp.
    newest : ndarray, (0 or 1, 6)
        The newest sample.
    """

    grid: Grid
    inner: Any
    numbers: Array = field(default_factory=lambda: np.empty(0))
    stamps: Array = field(default_factory=lambda: np.empty(0))
    newest: Array = field(default_factory=lambda: np.empty((0, 6)))


@dataclass(frozen=True, eq=False)
class Filtered:
    """What came out.

    Attributes
    ----------
    time : ndarray, (m,), s
        On the clock of the samples: the delay of the filter is taken off.
    values : ndarray, (m, 6)
    rows : ndarray, (m, 10) or (0, 10)
        Motion increments, of a pre-filter that makes them itself.
    """

    time: Array
    values: Array
    rows: Array


@dataclass(frozen=True)
class Filtering:
    """A pre-filter of samples whose stamps may drift against an even grid.

    Attributes
    ----------
    prefilter : Prefilter
    """

    prefilter: Prefilter

    def begin(self, first: Array, means: bool, source: str | None) -> FilteringState:
        """Return the state before the first sample.

        Parameters
        ----------
        first : ndarray, s
            Stamps that tell the step: the first ones of the record.
        means : bool
            Whether samples are means over the step before them.
        source : str, optional
            Name for messages.

        Raises
        ------
        DataError
            The stamps are not even.
        """
        try:
            grid = Grid(0.0, even_step(first), means)
        except DataError as error:
            f = error.finding
            raise DataError(
                "navigation.prefilter-needs-even-stamps",
                file=source,
                row=f.row,
                quantity=f.quantity,
                reason=f,
            ) from None
        try:
            return FilteringState(grid, self.prefilter.begin(grid, 6))
        except ConfigError as error:
            if error.finding.quantity != "rate":
                raise
            raise error.replaced(file=source, quantity="prefilter, rate_hz") from None

    def advance(
        self, state: FilteringState, time: Array, values: Array, last: bool, source: str | None
    ) -> tuple[FilteringState, Filtered]:
        """Take further samples; `last` says that none follows."""
        numbers = self._numbered(state, time, source)
        all_numbers = np.concatenate([state.numbers, numbers])
        all_stamps = np.concatenate([state.stamps, time])
        known = len(state.newest)
        nodes = np.concatenate([state.newest, values])
        at = all_numbers[len(all_numbers) - len(nodes) :]
        if len(nodes) > 1 and np.diff(at).max() > 1.0:
            every = np.arange(at[0], at[-1] + 1.0)
            nodes = np.column_stack([np.interp(every, at, column) for column in nodes.T])
        inner, portion = self.prefilter.advance(
            state.inner, np.ascontiguousarray(nodes[known:]), last
        )
        # Of means some filters answer between two samples.
        wanted = np.rint(2.0 * portion.time / state.grid.step) / 2.0
        stamps = np.interp(wanted, all_numbers, all_stamps) if wanted.size else np.empty(0)
        keep = min(len(all_numbers), 1) - 1
        if wanted.size:
            keep = int(np.searchsorted(all_numbers, wanted[-1], side="right")) - 1
        keep = max(keep, 0)
        after = FilteringState(
            state.grid,
            inner,
            all_numbers[keep:].copy(),
            all_stamps[keep:].copy(),
            values[-1:].copy() if len(values) else state.newest,
        )
        return after, Filtered(stamps, portion.values, portion.rows)

    def _numbered(self, state: FilteringState, time: Array, source: str | None) -> Array:
        """Places of stamps on the grid."""
        stamps = np.concatenate([state.stamps[-1:], time])
        steps = np.rint(np.diff(stamps) / state.grid.step)
        if steps.size and not steps.min() >= 1.0:
            row = int(np.argmin(steps))
            raise DataError(
                "navigation.samples-uneven",
                file=source,
                quantity="time",
                stamps=stamps[row],
                stamps_2=stamps[row + 1],
                step=state.grid.step,
            )
        if state.numbers.size:
            return np.asarray(state.numbers[-1] + np.cumsum(steps))
        return np.concatenate([np.zeros(min(1, len(time))), np.cumsum(steps)])
