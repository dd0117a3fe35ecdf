"""Navigation engines: their interface, and the engine for any modules."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown._kernels.filter_loop import BEYOND
from strapdown._kernels.smoothing import (
    BEGIN,
    CARRIED,
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
from strapdown.errors import DivergenceError, Finding
from strapdown.estimation.covariance import Innovations, Observation
from strapdown.estimation.error_filter import ErrorFilter, FilterState, Rules
from strapdown.estimation.error_model import PHYSICAL

Array = NDArray[np.float64]

#: An epoch this close to the end of a step counts as at the end, s: time stamps are rounded decimal
#: fractions.
SAME_INSTANT = 1e-7
#: Largest number of steps between two instants of the covariance.
LARGEST_GROUP = 1024


@dataclass(frozen=True, eq=False)
class EngineState:
    """State of an engine.

    Attributes
    ----------
    filter : FilterState
        At the last instant of the covariance.
    errors : ndarray, (n,)
        States that are estimated and not fed back; zeros where all are.
    time : float, s
        Of the newest step.
    mechanization, row : ndarray
        State and row of a history then, with the corrections applied.
    open_history, open_rows : ndarray
        Since the last instant of the covariance: rows of the history, the one at that instant
        first, and compensated increments.
    last : ndarray, (10,)
        The newest of these increments.
    """

    filter: FilterState
    errors: Array
    time: float
    mechanization: Array
    row: Array
    open_history: Array
    open_rows: Array
    last: Array


def begun(filter_: ErrorFilter, state: FilterState, feeds_back: bool = True) -> EngineState:
    """Return the state of an engine at a state of a filter."""
    errors = np.zeros(filter_.model.layout.size)
    if not feeds_back:
        # Sensor errors from an alignment are treated like estimated ones.
        E = filter_.model.from_physical(filter_.mechanization, state.time, state.row)
        errors = E @ np.concatenate([np.zeros(PHYSICAL), state.sensors])
        state = replace(state, sensors=np.zeros_like(state.sensors))
    return EngineState(
        filter=state,
        errors=errors,
        time=state.time,
        mechanization=state.mechanization,
        row=state.row,
        open_history=state.row[None, :],
        open_rows=np.empty((0, 10)),
        last=np.concatenate([[1.0], np.zeros(9)]),
    )


class Engine(ABC):
    """Mechanization, estimates and covariance while a chunk of a log is processed.

    Attributes
    ----------
    nodes : NodeRows
        Records the propagations and updates of the covariance for a smoother.
    """

    navigation: ErrorFilter
    nodes: NodeRows
    filter: FilterState
    errors: Array
    time: float
    mechanization: Array
    row: Array
    last: Array

    @abstractmethod
    def propagate(self, time: Array, rows: Array, history: Array, note_at: float) -> int:
        """Propagate over steps without observations.

        Parameters
        ----------
        time : ndarray, (k,), s
            Ends of the steps.
        rows : ndarray, (k, 10)
        history : ndarray, (k, row)
            Filled with the rows that are shown.
        note_at : float, s
            It stops before its end where the covariance was taken to this time or beyond.

        Returns
        -------
        int
            Number of steps done.
        """

    @abstractmethod
    def close(self) -> None:
        """Propagate the covariance to the newest step."""

    @abstractmethod
    def observe(
        self, observations: Sequence[Observation], rules: Sequence[Rules]
    ) -> list[Innovations]:
        """Update with the current observations, after `close`; return the innovations."""

    def known(self, observation: Observation) -> Observation:
        """Return an observation of the estimated state, with open-loop estimates subtracted."""
        if not self.errors.any():
            return observation
        used = self.navigation
        T = used.model.to_physical(used.mechanization, self.filter.time, self.filter.row)
        return replace(observation, z=observation.z - observation.H @ (T @ self.errors))

    @abstractmethod
    def carry(self, T: Array, Q: Array, first: int = 0) -> None:
        """Transform the physical errors by T, (p, p), and add a noise Q, (n, n), of the states.

        `first`: of the three errors that T changes.
        """

    @abstractmethod
    def shown(self) -> Array:
        """Return the row of the newest step with the estimated errors subtracted."""

    def left_at_nodes(self) -> Array:
        """Return `NavigationChunk.left`."""
        return np.empty((0, PHYSICAL))

    @abstractmethod
    def state(self) -> EngineState:
        """Return the current state."""

    def left(self) -> Array:
        """Return the estimated errors that are left on the output, (9,), in level axes."""
        return np.zeros(PHYSICAL)

    def estimates(self, filter_: ErrorFilter) -> Array:
        """Return the estimated errors of the sensors, (k,)."""
        T = filter_.model.to_physical(filter_.mechanization, self.filter.time, self.filter.row)
        found: Array = self.filter.sensors + (T @ self.errors)[PHYSICAL:]
        return found


class GeneralEngine(Engine):
    """Engine for any mechanization, error model and form: group by group."""

    def __init__(
        self, filter_: ErrorFilter, state: EngineState, feeds_back: bool, corrects: bool = True
    ) -> None:
        self.navigation = filter_
        self.feeds_back, self.corrects = feeds_back, corrects
        self.filter, self.errors = state.filter, state.errors
        self.time, self.row, self.last = state.time, state.row, state.last
        self.mechanization = state.mechanization.copy()
        self.open_history = list(state.open_history)
        self.open_rows = list(state.open_rows)
        self.nodes = NodeRows(filter_, False)

    def propagate(self, time: Array, rows: Array, history: Array, note_at: float) -> int:
        """Propagate over steps, as `Engine.propagate`."""
        made = 0
        longest = self.navigation.step * BEYOND
        while made < len(time):
            room = LARGEST_GROUP - len(self.open_rows)
            near = time[made : made + room] - self.filter.time <= longest
            count = len(near) if near.all() else int(np.argmin(near))
            if not count and not self.open_rows:
                count = 1
            if not count:
                self.close()
                if self.time >= note_at:
                    return made
                continue
            end = made + count
            self._steps(time[made:end], rows[made:end], history[made:end])
            made = end
        return made

    def close(self) -> None:
        """Propagate the covariance to the newest step."""
        if not self.open_rows:
            return
        ends = self.filter.time + np.cumsum([row[0] for row in self.open_rows])
        ends[-1] = self.time
        begun = self.filter
        self.filter, Phi = self.navigation.follow(
            begun, ends, np.array(self.open_history), np.array(self.open_rows), self.mechanization
        )
        self.nodes.grew(begun, Phi, self.filter)
        if not self.feeds_back:
            self.errors = Phi @ self.errors
        self._open_anew()

    def observe(
        self, observations: Sequence[Observation], rules: Sequence[Rules]
    ) -> list[Innovations]:
        """Update with the observations at the current instant."""
        used, met = self.navigation, self.filter
        if self.feeds_back:
            self.filter, taken, seen = used.observe(met, observations, rules)
            self.mechanization, self.row = self.filter.mechanization.copy(), self.filter.row
            self._open_anew()
        else:
            before = self.errors
            self.filter, self.errors, seen = used.estimate(met, before, observations, rules)
            T = used.model.to_physical(used.mechanization, self.filter.time, self.filter.row)
            taken = T @ (self.errors - before)
        self.nodes.updated(met, taken, self.filter)
        return seen

    def carry(self, T: Array, Q: Array, first: int = 0) -> None:
        """Transform the errors, and add a noise."""
        self.filter = self.navigation.carried(self.filter, T, Q)
        self.nodes.carried(T, first, self.filter)

    def shown(self) -> Array:
        """Return the row of the newest step with the estimated errors subtracted."""
        if self.feeds_back or not self.corrects:
            return self.row
        used = self.navigation.mechanization
        T = self.navigation.model.to_physical(used, self.filter.time, self.filter.row)
        error = (T @ self.errors)[:PHYSICAL]
        # Since the last instant of the covariance the position has moved with the velocity.
        error[:3] += error[3:6] * (self.time - self.filter.time)
        return used.history_row(used.correct(self.mechanization, error))

    def left(self) -> Array:
        """Return the estimates that are not subtracted, as `Engine.left`."""
        if self.corrects:
            return super().left()
        used = self.navigation
        T = used.model.to_physical(used.mechanization, self.filter.time, self.filter.row)
        return np.asarray((T @ self.errors)[:PHYSICAL])

    def state(self) -> EngineState:
        """Return the current state."""
        return EngineState(
            filter=self.filter,
            errors=self.errors,
            time=self.time,
            mechanization=self.mechanization.copy(),
            row=self.row,
            open_history=np.array(self.open_history),
            open_rows=np.array(self.open_rows).reshape(-1, 10),
            last=self.last,
        )

    def _steps(self, time: Array, rows: Array, history: Array) -> None:
        used = self.navigation
        known = (
            self.filter
            if self.feeds_back
            else replace(self.filter, sensors=np.zeros_like(self.filter.sensors))
        )
        compensated = used.compensated(known, rows)
        raw = history if self.feeds_back else np.empty_like(history)
        if self.feeds_back:
            used.advance_compensated(self.mechanization, time, compensated, raw)
        for i in range(len(time)):
            if not self.feeds_back:
                one = slice(i, i + 1)
                used.advance_compensated(self.mechanization, time[one], compensated[one], raw[one])
                self.time, self.row = float(time[i]), raw[i].copy()
                history[i] = self.shown()
            self.open_history.append(raw[i].copy())
            self.open_rows.append(compensated[i])
        self.time, self.row, self.last = float(time[-1]), raw[-1].copy(), compensated[-1]

    def _open_anew(self) -> None:
        self.open_rows, self.open_history = [], [self.row]


# Error of an invalid covariance.


class LostCovarianceError(DivergenceError):
    """A variance became negative.

    Attributes
    ----------
    place : ndarray, (3,), m²
        Values of the variances of position then.
    """

    def __init__(self, code: str | Finding, *, place: Array | None = None, **values: Any) -> None:
        super().__init__(code, **values)
        self.place = np.zeros(3) if place is None else place


# Smoother history of a filter: growth of its errors, and its updates.


#: Number of nodes before a compiled loop asks for more room: half a megabyte.
BLOCK = 256
#: Without a smoother a single sample must not cost more.
NOTHING: Array = np.empty((0, 0))


class NodeRows:
    """Smoother history of a chunk: one row for each node of the filter.

    A node is the begin of a filter, a growth of the errors, or an update. Errors are the p physical
    ones of its model, in level axes of the mechanization; `_kernels.smoothing` has the
    layout of a row. Compiled loops fill `room` from `used` on; others call `grew` and `updated`.

    Parameters
    ----------
    wanted : bool
        Whether nodes are recorded.

    Attributes
    ----------
    room : ndarray, (m, width)
        Rows, of which `used` are filled; empty without a smoother.
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
        """Whether nodes are recorded."""
        return len(self.room) > 0

    def make_room(self, count: int) -> None:
        """Start a new block if fewer rows than these are free."""
        if self.wanted and self.used + count > len(self.room):
            self._full.append(self.room[: self.used])
            self.room, self.used = np.empty_like(self.room), 0

    def since(self, count: int) -> Iterator[Array]:
        """Yield the rows after the first `count`, in blocks."""
        for block in (*self._full, self.room[: self.used]):
            if len(block) > max(count, 0):
                yield block[max(count, 0) :]
            count -= len(block)

    def blocks(self) -> tuple[Array, ...]:
        """Return the recorded rows, in blocks of (k, width)."""
        return (*self._full, self.room[: self.used].copy()) if self.used else tuple(self._full)

    def began(self, state: FilterState) -> None:
        """Record the begin of a filter."""
        if self.wanted:
            self._row(BEGIN, state)

    def grew(self, begun: FilterState, Phi: Array, ended: FilterState) -> None:
        """Record the transition of the errors from one state of the filter to another.

        Parameters
        ----------
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

    def carried(self, T: Array, first: int, state: FilterState) -> None:
        """Record a transformation of the errors by T, (p, p): of three from the first on."""
        if not self.wanted:
            return
        move = self._row(CARRIED, state)[begin_of_move(self._size) :]
        move[0], move[1 : 1 + 3 * self._size] = first, T[first : first + 3].ravel()

    def updated(self, before: FilterState, taken: Array, after: FilterState) -> None:
        """Record the effect of observations, if any.

        Parameters
        ----------
        taken : ndarray, (p,)
            Correction of the estimate: fed back, or kept separately.
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
        """Row of a growth of the physical errors."""
        move = self._row(GROWTH, ended)[begin_of_move(self._size) :]
        core = CORE * self._size
        move[:core] = Phi[:CORE].ravel()
        move[core : core + self._size - CORE] = np.diagonal(Phi)[CORE:]

    def _row(self, kind: int, state: FilterState) -> Array:
        """Append a row with the values common to all kinds."""
        self.make_room(1)
        row: Array = self.room[self.used]
        self.used += 1
        row[TIME], row[KIND] = state.time, kind
        row[TURN:COVARIANCE] = self._filter.mechanization.level_from_ned(state.row).ravel()
        pack(self._filter.physical_covariance(state), row, COVARIANCE)
        return row
