"""An error-state filter around a mechanization, observing at any instant what its aids tell."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.aiding.aid import Aid, Epochs, TableAid, WatchingAid
from strapdown.aiding.gnss import Gnss
from strapdown.errors import ConfigError
from strapdown.estimation.error_filter import ErrorFilter
from strapdown.estimation.filter_state import FilterState
from strapdown.estimation.large_tilt import is_large
from strapdown.nav_state import NavState
from strapdown.navigation.compiled_engine import CompiledEngine, compiled
from strapdown.navigation.damping import Damping, Feedback
from strapdown.navigation.engine import SAME_INSTANT, Engine, EngineState, GeneralEngine, begun
from strapdown.navigation.going import Going
from strapdown.navigation.navigator_state import NavigatorState
from strapdown.navigation.piece import NavigationPiece

if TYPE_CHECKING:
    from strapdown.navigation.smoother import Smoother

__all__ = ["Navigator", "NavigatorState", "with_states"]

Array = NDArray[np.float64]


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
    damping : Damping
        Whether what is estimated is fed back.
    smoother : Smoother, optional
        With one, its pieces have what the run is smoothed by, too; the filter's numbers are the
        same to the last bit.

    Raises
    ------
    ConfigError
        Two aids have one name.
    """

    filter: ErrorFilter
    aids: tuple[Aid, ...] = ()
    mark_interval: float = 1.0
    damping: Damping = field(default_factory=Feedback)
    smoother: Smoother | None = None

    def __post_init__(self) -> None:
        names = [aid.name for aid in self.aids]
        for name in names:
            if not name or names.count(name) > 1:
                raise ConfigError(
                    "navigation.aid-name-taken" if name else "navigation.aid-without-name",
                    quantity="aiding",
                    name=name,
                )

    @cached_property
    def lone_receiver(self) -> Gnss | None:
        """The only aid, where it is a receiver whose errors are noise, believed as it says."""
        if len(self.aids) != 1 or type(self.aids[0]) is not Gnss:
            return None
        aid = self.aids[0]
        plain = aid.rule is None and self.filter.rule is None and not aid.states()
        return aid if plain else None

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
            engine=begun(self.filter, state, self.damping.feeds_back),
            queues={aid.name: nothing for aid in self.aids},
            memories={aid.name: aid.begin() for aid in self.aids if isinstance(aid, WatchingAid)},
            marked=-np.inf,
            observed=state.time,
            tilted=is_large(self.filter.physical_covariance(state)),
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
                "navigation.no-aid-table",
                quantity="aiding",
                name=name,
                word=name,
                known=[a.name for a in self.aids if isinstance(a, TableAid)],
            )
        more = aid.epochs(table)
        queue = state.queues[name]
        if queue.time.size:
            # An epoch may be before those of an earlier row: a velocity that comes late.
            both = np.concatenate([queue.time, more.time])
            order = np.argsort(both, kind="stable")
            more = Epochs(both[order], np.concatenate([queue.values, more.values])[order])
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
        going = Going(self, state)
        # What is writeable is one type for compiled code, and what is not another.
        stamps = np.require(time, np.float64, ["C", "W"])
        going.over(stamps, np.require(rows, np.float64, ["C", "W"]))
        return going.state(), going.piece()

    def finish(self, state: NavigatorState) -> NavigationPiece:
        """Return the mark of the newest sample, which no epoch follows; the state stays.

        Parameters
        ----------
        state : NavigatorState

        Returns
        -------
        NavigationPiece
            Without samples; without a mark where there is one already.
        """
        going = Going(self, state)
        if state.time > state.marked + SAME_INSTANT:
            going.end()
        return going.piece()

    def engine(self, state: EngineState) -> Engine:
        """Return what goes on from a state: compiled, where the modules have that."""
        if self.damping.feeds_back and compiled(self.filter):
            return CompiledEngine.going_on(self.filter, state)
        return GeneralEngine(self.filter, state, self.damping.feeds_back)


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
