"""What a filter leaves for a smoother on its way: how its errors grew, and what was observed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from strapdown._kernels.smoothing_rows import (
    BEGIN,
    CORE,
    COVARIANCE,
    GROWTH,
    KIND,
    TIME,
    TURN,
    UPDATE,
    begin_of_move,
    begin_of_taken,
    pack,
    row_width,
)
from strapdown.estimation.error_filter import ErrorFilter
from strapdown.estimation.filter_state import FilterState

__all__ = ["NodeRows"]

Array = NDArray[np.float64]

#: Nodes that are noted before a compiled loop asks for more room: half a megabyte.
BLOCK = 256
#: Where nothing is noted a sample alone must not pay for it.
NOTHING: Array = np.empty((0, 0))


class NodeRows:
    """Takes the nodes of a piece of a run: instants of its filter, a row each.

    A node is the begin of a filter, the end of a growth, or an update. Errors are the p physical
    ones of its model, in level axes of the mechanization; `_kernels.smoothing_rows` has what is
    where in a row. Compiled loops fill `room` from `used` on; others call `grew` and `updated`.

    Parameters
    ----------
    filter_ : ErrorFilter
    wanted : bool
        Whether nodes are noted at all.

    Attributes
    ----------
    room : ndarray, (m, width)
        Rows, of which `used` are filled; without any where nothing is noted.
    used : int
    """

    def __init__(self, filter_: ErrorFilter, wanted: bool) -> None:
        self._filter = filter_
        self._full: list[Array] = []
        self._size, self.room, self.used = 0, NOTHING, 0
        if wanted:
            self._size = filter_.model.physical_size
            self.room = np.empty((BLOCK, row_width(self._size)))

    @property
    def wanted(self) -> bool:
        """Whether nodes are noted at all."""
        return len(self.room) > 0

    def make_room(self, count: int) -> None:
        """Go on with an empty room where there are fewer rows than these left."""
        if self.wanted and self.used + count > len(self.room):
            self._full.append(self.room[: self.used])
            self.room, self.used = np.empty_like(self.room), 0

    def blocks(self) -> tuple[Array, ...]:
        """Return what was noted, some rows each, (k, width)."""
        return (*self._full, self.room[: self.used].copy()) if self.used else tuple(self._full)

    def began(self, state: FilterState) -> None:
        """Note where a filter begins."""
        if self.wanted:
            self._row(BEGIN, state)

    def grew(self, begun: FilterState, Phi: Array, ended: FilterState) -> None:
        """Note how errors grew from one state of the filter to another.

        Parameters
        ----------
        begun, ended : FilterState
        Phi : ndarray, (n, n)
            Of the states of the model.
        """
        if not self.wanted or ended.time <= begun.time:
            return
        used, model = self._filter.mechanization, self._filter.model
        if not model.states_are_physical:
            E = model.from_physical(used, begun.time, begun.row)
            Phi = model.to_physical(used, ended.time, ended.row) @ Phi @ E
        self._growth(Phi, ended)

    def widened(self, state: FilterState) -> None:
        """Note a state of which less is known than just before: a growth by noise alone."""
        if self.wanted:
            self._growth(np.eye(self._size), state)

    def updated(self, before: FilterState, taken: Array, after: FilterState) -> None:
        """Note what observations did, if they did anything.

        Parameters
        ----------
        before, after : FilterState
        taken : ndarray, (p,)
            The error that was taken off the estimate: fed back, or kept beside.
        """
        if not self.wanted:
            return
        P = self._filter.physical_covariance(before)
        if not taken.any() and np.array_equal(P, self._filter.physical_covariance(after)):
            return
        row, at = self._row(UPDATE, after), begin_of_taken(self._size)
        pack(P, row, begin_of_move(self._size))
        row[at : at + self._size] = taken

    def _growth(self, Phi: Array, ended: FilterState) -> None:
        """A row of a growth of the physical errors."""
        move = self._row(GROWTH, ended)[begin_of_move(self._size) :]
        core = CORE * self._size
        move[:core] = Phi[:CORE].ravel()
        move[core : core + self._size - CORE] = np.diagonal(Phi)[CORE:]

    def _row(self, kind: int, state: FilterState) -> Array:
        """A further row, with all that is not of its kind alone."""
        self.make_room(1)
        row: Array = self.room[self.used]
        self.used += 1
        row[TIME], row[KIND] = state.time, kind
        row[TURN:COVARIANCE] = self._filter.mechanization.level_from_ned(state.row).ravel()
        pack(self._filter.physical_covariance(state), row, COVARIANCE)
        return row
