"""An error-state filter around a mechanization, observing at any instant what its aids tell."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown._kernels.split_increment import split_increment
from strapdown.aiding.aid import Aid, Epochs, TableAid, WatchingAid
from strapdown.aiding.view import View
from strapdown.estimation.error_filter import ErrorFilter, FilterState
from strapdown.estimation.observation import Observation
from strapdown.exceptions import ConfigError, nearest
from strapdown.nav_state import NavState
from strapdown.navigation.piece import Mark, NavigationPiece, Seen

__all__ = ["Navigator", "NavigatorState", "with_states"]

Array = NDArray[np.float64]

# An epoch so near to the end of a step is at it, s: stamps are decimal fractions that were rounded.
SAME_INSTANT = 1e-7


@dataclass(frozen=True, eq=False)
class NavigatorState:
    """Everything that a navigator remembers: from here it goes on.

    Attributes
    ----------
    filter : FilterState
        At the last instant to which the covariance was taken.
    time : float, s
        Of the newest sample.
    mechanization, row : ndarray
        State and row of a history at that sample.
    open_time, open_history, open_rows : ndarray
        What followed the last instant of the covariance: ends of the steps, rows of the history,
        increments without the estimated errors.
    queues : mapping of str to Epochs
        Of each aid, the epochs that are still to come.
    memories : mapping of str to object
        Of each aid that watches the sensors.
    marked : float, s
        Time of the last mark.
    """

    filter: FilterState
    time: float
    mechanization: Array
    row: Array
    open_time: Array
    open_history: Array
    open_rows: Array
    queues: Mapping[str, Epochs]
    memories: Mapping[str, Any]
    marked: float


@dataclass(frozen=True)
class Navigator:
    """Navigate by motion increments and by what aids observe.

    The mechanization goes from sample to sample; where an epoch is within a step, the step is cut
    there. The covariance follows at the filter's own `step` and at every epoch. A log may be given
    in pieces of any length, and each aid's table at once or bit by bit, as long as an epoch is told
    before the samples that follow it: the numbers are the same to the last bit.

    Attributes
    ----------
    filter : ErrorFilter
        Its model must have the states of every aid (`with_states`).
    aids : tuple of Aid
        With names of their own.
    mark_interval : float, s
        Longest time between two marks of the covariance.

    Raises
    ------
    ConfigError
        Two aids have one name.
    """

    filter: ErrorFilter
    aids: tuple[Aid, ...] = ()
    mark_interval: float = 1.0

    def __post_init__(self) -> None:
        names = [aid.name for aid in self.aids]
        for name in names:
            if not name or names.count(name) > 1:
                raise ConfigError(
                    f"'{name}' is the name of two aids" if name else "an aid has no name",
                    quantity="aiding",
                    remedy="give each a name of its own",
                )

    @cached_property
    def by_name(self) -> dict[str, Aid]:
        """Aids by their names."""
        return {aid.name: aid for aid in self.aids}

    def begin(self, start: NavState, P: Array) -> NavigatorState:
        """Return the state at a start.

        Parameters
        ----------
        start : NavState
        P : ndarray, (p, p)
            As `ErrorFilter.begin`.

        Returns
        -------
        NavigatorState
        """
        return self.begin_from(self.filter.begin(start, P))

    def begin_from(self, state: FilterState) -> NavigatorState:
        """Return the state at a state of the filter, as where an alignment ended."""
        nothing = Epochs(np.empty(0), np.empty((0, 0)))
        return NavigatorState(
            filter=state,
            time=state.time,
            mechanization=state.mechanization,
            row=state.row,
            open_time=np.empty(0),
            open_history=state.row[None, :],
            open_rows=np.empty((0, 10)),
            queues={aid.name: nothing for aid in self.aids},
            memories={aid.name: aid.begin() for aid in self.aids if isinstance(aid, WatchingAid)},
            marked=-np.inf,
        )

    def tell(self, state: NavigatorState, name: str, table: pd.DataFrame) -> NavigatorState:
        """Take rows of the table of an aid, later than those before.

        Parameters
        ----------
        state : NavigatorState
        name : str
            Of the aid.
        table : DataFrame

        Returns
        -------
        NavigatorState
        """
        aid = self.by_name.get(name)
        if not isinstance(aid, TableAid):
            raise ConfigError(
                f"there is no aid '{name}' with a table",
                quantity="aiding",
                remedy=nearest(name, [a.name for a in self.aids if isinstance(a, TableAid)]),
            )
        more = aid.epochs(table)
        queue = state.queues[name]
        if queue.time.size:
            more = Epochs(
                np.concatenate([queue.time, more.time]), np.concatenate([queue.values, more.values])
            )
        return replace(state, queues={**state.queues, name: more})

    def advance(
        self, state: NavigatorState, time: Array, rows: Array
    ) -> tuple[NavigatorState, NavigationPiece]:
        """Go on over motion increments.

        Parameters
        ----------
        state : NavigatorState
        time : ndarray, (k,), s
            Ends of the steps.
        rows : ndarray, (k, 10)
            Rows of a MotionIncrements table.

        Returns
        -------
        state : NavigatorState
        piece : NavigationPiece

        Raises
        ------
        DivergenceError
            The state has left what the mechanization can do; the sample is named.
        """
        going = _Going(self, state)
        going.over(np.asarray(time, dtype=np.float64), np.ascontiguousarray(rows))
        return going.state(), going.piece()


class _Going:
    """A navigator on its way over one piece."""

    def __init__(self, navigator: Navigator, state: NavigatorState) -> None:
        self.navigator = navigator
        self.used = navigator.filter.mechanization
        self.filter = state.filter
        self.time = state.time
        self.mechanization = state.mechanization.copy()
        self.row = state.row
        self.open_time = list(state.open_time)
        self.open_history = list(state.open_history)
        self.open_rows = list(state.open_rows)
        self.queues = dict(state.queues)
        self.memories = dict(state.memories)
        self.marked = state.marked
        self.times: list[float] = []
        self.history: list[Array] = []
        self.seen: list[Seen] = []
        self.marks: list[Mark] = []
        self.late: list[tuple[str, float]] = []

    def over(self, time: Array, rows: Array) -> None:
        """Go over steps."""
        for aid in self.navigator.aids:
            if isinstance(aid, WatchingAid):
                self.memories[aid.name], seen = aid.watch(self.memories[aid.name], time, rows)
                self.queues[aid.name] = seen
        self._drop_late()
        for end, row in zip(time.tolist(), rows, strict=True):
            left = row
            while True:
                at = self._next_epoch()
                if at > end - SAME_INSTANT:
                    break
                first, second = np.empty(10), np.empty(10)
                split_increment(left, at - self.time, first, second)
                self._step(at, first)
                self._observe(at)
                left = second
            self._step(end, left)
            if self._next_epoch() <= end + SAME_INSTANT:
                self._observe(end)
            self.times.append(end)
            self.history.append(self.row)

    def state(self) -> NavigatorState:
        """Where it is now."""
        return NavigatorState(
            filter=self.filter,
            time=self.time,
            mechanization=self.mechanization,
            row=self.row,
            open_time=np.array(self.open_time),
            open_history=np.array(self.open_history),
            open_rows=np.array(self.open_rows).reshape(-1, 10),
            queues=self.queues,
            memories=self.memories,
            marked=self.marked,
        )

    def piece(self) -> NavigationPiece:
        """What came of it."""
        history = np.array(self.history).reshape(-1, self.used.row)
        return NavigationPiece(
            np.array(self.times), history, tuple(self.seen), tuple(self.marks), tuple(self.late)
        )

    def _next_epoch(self) -> float:
        return min((q.time[0] for q in self.queues.values() if q.time.size), default=np.inf)

    def _drop_late(self) -> None:
        for name, queue in self.queues.items():
            count = int(np.searchsorted(queue.time, self.time - SAME_INSTANT))
            if count:
                self.late += [(name, float(t)) for t in queue.time[:count]]
                self.queues[name] = Epochs(queue.time[count:], queue.values[count:])

    def _step(self, end: float, row: Array) -> None:
        """One step of the mechanization; the covariance follows where enough time has passed."""
        if self.open_time:
            begun = self.filter.time
            if end - begun > self.navigator.filter.step * 1.000001:
                self._close()
        filter_ = self.navigator.filter
        compensated = filter_.compensated(self.filter, row[None, :])
        history = np.empty((1, self.used.row))
        filter_.advance_compensated(self.mechanization, np.array([end]), compensated, history)
        self.time, self.row = end, history[0]
        self.open_time.append(end)
        self.open_history.append(self.row)
        self.open_rows.append(compensated[0])

    def _close(self) -> None:
        """Take the covariance to the newest instant."""
        if not self.open_time:
            return
        self.filter = self.navigator.filter.follow(
            self.filter,
            np.array(self.open_time),
            np.array(self.open_history),
            np.array(self.open_rows),
            self.mechanization,
        )
        self._open_anew()
        if self.filter.time - self.marked >= self.navigator.mark_interval * (1.0 - 1e-9):
            self._mark()

    def _open_anew(self) -> None:
        self.open_time, self.open_rows = [], []
        self.open_history = [self.row]

    def _observe(self, at: float) -> None:
        """Take everything that is observed at an instant."""
        last = self.open_rows[-1] if self.open_rows else None
        self._close()
        filter_ = self.navigator.filter
        dt = 1.0 if last is None else float(last[0])
        zero = np.zeros(3)
        view = View(
            mechanization=self.used,
            model=filter_.model,
            time=at,
            state=self.mechanization,
            row=self.row,
            sensors=self.filter.sensors,
            rate=zero if last is None else last[1:4] / dt,
            force=zero if last is None else last[4:7] / dt,
            covariance_of=partial(filter_.physical_covariance, self.filter),
        )
        told: list[tuple[Aid, Observation]] = []
        for aid in self.navigator.aids:
            queue = self.queues[aid.name]
            count = int(np.searchsorted(queue.time, at + SAME_INSTANT, side="right"))
            for values in queue.values[:count]:
                told += [(aid, one) for one in aid.observe(view, values)]
            self.queues[aid.name] = Epochs(queue.time[count:], queue.values[count:])
        if not told:
            return
        observations = [one for _, one in told]
        rules = [aid.rule or filter_.rule for aid, _ in told]
        self.filter, innovations = filter_.observe(self.filter, observations, rules)
        self.mechanization, self.row = self.filter.mechanization.copy(), self.filter.row
        self._open_anew()
        self.seen += [
            Seen(at, one.name, one.labels, nu)
            for one, nu in zip(observations, innovations, strict=True)
        ]
        self._mark()

    def _mark(self) -> None:
        """Note covariance and estimates."""
        state = self.filter
        P = self.navigator.filter.physical_covariance(state)
        level = self.used.level_from_ned(state.row)
        turn = np.kron(np.eye(3), level)
        mark = Mark(
            state.time,
            turn.T @ P[:9, :9] @ turn,
            state.sensors,
            np.sqrt(np.diagonal(P)[9:]),
        )
        if self.marks and self.marks[-1].time == state.time:
            self.marks.pop()
        self.marks.append(mark)
        self.marked = state.time


def with_states(filter_: ErrorFilter, aids: tuple[Aid, ...]) -> ErrorFilter:
    """Return a filter whose model has the states of the aids, too.

    Parameters
    ----------
    filter_ : ErrorFilter
    aids : tuple of Aid

    Returns
    -------
    ErrorFilter
    """
    more = tuple(state for aid in aids for state in aid.states())
    model = replace(filter_.model, sensors=(*filter_.model.sensors, *more))
    return replace(filter_, model=model)
