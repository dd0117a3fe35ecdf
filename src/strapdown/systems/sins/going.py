"""A chain on its way over one piece: modes, holes, and navigation."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import DataError, DivergenceError
from strapdown.estimation.filter_state import FilterState
from strapdown.navigation.growing_rows import GrowingRows
from strapdown.navigation.piece import NavigationPiece
from strapdown.navigation.record import Event, Span
from strapdown.systems.sins.aligning import align, handed_over, unused_fixes
from strapdown.systems.sins.gaps import Hole, widened
from strapdown.systems.sins.handover import from_state
from strapdown.systems.sins.intake import Steps
from strapdown.systems.sins.modes import CoarseMode
from strapdown.systems.sins.piece import Aligned, ChainPiece

if TYPE_CHECKING:
    import pandas as pd

    from strapdown.systems.sins.chain import Chain, ChainState

__all__ = ["Going"]

Array = NDArray[np.float64]

# Stamps are decimal fractions that were rounded: an instant is come to within this, s.
INSTANT = 1e-7
# An attitude that is known so well must stay so for as long, s, until fixes tell the biases.
AHEAD = 3.0
#: Columns of a step as it is kept.
TIME, VALUES, ROWS = 0, slice(1, 7), slice(7, 17)


class Going:
    """A chain on its way.

    Parameters
    ----------
    chain : Chain
    state : ChainState
    """

    def __init__(self, chain: Chain, state: ChainState) -> None:
        self._chain = chain
        self._state = state
        self._navigation: list[NavigationPiece] = []
        self._aligned: list[Aligned] = []
        self._events: list[Event] = []
        self._modes: list[Span] = []
        self._outages: list[tuple[str, Span]] = []

    def over(self, steps: Steps) -> None:
        """Go over what the samples of a piece made."""
        for hole in steps.holes:
            self._found(hole)
        gaps = {hole.begin for hole in steps.holes}
        cut_off = [hole for hole in steps.cut_off if hole.begin not in gaps]
        if cut_off:
            both = sorted((*self._state.holes, *cut_off), key=lambda hole: hole.begin)
            self._state = replace(self._state, holes=tuple(both))
        kept = np.empty((len(steps.time) + (steps.opening is not None), 17))
        if steps.opening is not None:
            kept[0, TIME], kept[0, VALUES] = steps.opening
            kept[0, ROWS] = 0.0
        own = kept[len(kept) - len(steps.time) :]
        own[:, TIME], own[:, VALUES], own[:, ROWS] = steps.time, steps.values, steps.rows
        while len(kept):
            kept = self._some(kept)

    def state(self) -> ChainState:
        """Where it is now."""
        return self._state

    def piece(self, last: bool) -> ChainPiece:
        """What came of it."""
        state = self._state
        mode = self._chain.modes[state.mode]
        if last:
            self._end(mode.name)
        return ChainPiece(
            mode=mode.name,
            time=state.time,
            navigation=tuple(self._navigation),
            aligned=tuple(self._aligned),
            events=tuple(self._events),
            modes=tuple(self._modes),
            outages=tuple(self._outages),
        )

    def _end(self, mode: str) -> None:
        state = self._state
        if state.navigator is None:
            raise DataError(
                "navigation.samples-end-mode-before-navigation",
                file=state.intake.source,
                quantity="time",
                time=state.time,
                mode=mode,
            )
        self._navigation.append(self._chain.navigator.finish(state.navigator))
        self._modes.append(Span(mode, state.begun, state.time))
        events, outages = self._chain.deliveries.finish(state.deliveries, state.time)
        self._events += events
        self._outages += outages

    def _found(self, hole: Hole) -> None:
        policy = self._chain.intake.gaps
        where = f"{hole.length:.4g} s without samples, from {hole.begin:.9g} to {hole.end:.9g} s"
        if hole.length > policy.coast and policy.beyond == "refuse":
            raise DataError(
                "navigation.gap",
                file=self._state.intake.source,
                quantity="time",
                length=hole.length,
                begin=hole.begin,
                end=hole.end,
            )
        anew = hole.length > policy.coast and policy.beyond == "align"
        done = "alignment begins anew" if anew else "bridged along a line, and not well known since"
        self._events.append(Event(hole.begin, "gap", f"{where}: {done}"))
        self._state = replace(self._state, holes=(*self._state.holes, hole))

    def _some(self, kept: Array) -> Array:
        """Go on to where the next thing happens; return what is left."""
        if np.isnan(self._state.begun):
            self._begin_mode(0, float(kept[0, TIME]))
        state = self._state
        due = self._due()
        count = len(kept)
        if due < np.inf:
            count = min(count, int(np.searchsorted(kept[:, TIME], due - INSTANT)) + 1)
        if state.holes:
            # Steps that end by the begin of a hole come before it.
            before = int(np.searchsorted(kept[:, TIME], state.holes[0].begin + INSTANT))
            if before == 0:
                self._over_hole()
                return kept
            count = min(count, before)
        now = kept[:count]
        self._state = replace(state, time=float(now[-1, TIME]))
        if state.navigator is None:
            self._keep(now)
        else:
            self._navigate(now)
        if self._state.time >= due - INSTANT:
            self._at_due()
        return kept[count:]

    def _begin_mode(self, place: int, time: float) -> None:
        mode = self._chain.modes[place]
        self._state = replace(
            self._state,
            mode=place,
            begun=time,
            next_try=mode.until.next_try(0.0),
            kept=GrowingRows.of(ROWS.stop),
        )
        self._events.append(Event(time, "mode", mode.name))

    def _due(self) -> float:
        """When the next thing happens that is no sample."""
        state, chain = self._state, self._chain
        mode = chain.modes[state.mode]
        due = state.commands[0].time if state.commands else np.inf
        if mode.kind != "navigation":
            return min(due, state.begun + min(mode.until.duration, state.next_try))
        if state.navigator is None and chain.start is not None:
            return -np.inf if chain.start.at_first_sample else chain.start.state.time
        return due

    def _over_hole(self) -> None:
        """Come to the step over a hole."""
        state, policy = self._state, self._chain.intake.gaps
        hole, *others = state.holes
        state = replace(state, holes=tuple(others))
        if hole.length > policy.coast and policy.beyond == "align":
            mode = self._chain.modes[state.mode]
            self._modes.append(Span(mode.name, state.begun, hole.begin))
            if state.navigator is not None:
                self._navigation.append(self._chain.navigator.finish(state.navigator))
            self._state = replace(
                state,
                begun=np.nan,
                kept=GrowingRows.of(ROWS.stop),
                aligned=None,
                navigator=None,
            )
            return
        if state.navigator is not None:
            state = replace(state, navigator=widened(self._chain.navigator, state.navigator, hole))
        self._state = state

    def _keep(self, now: Array) -> None:
        """Keep steps for an alignment."""
        state = self._state
        mode = self._chain.modes[state.mode]
        if mode.kind == "navigation":
            return
        kept = state.kept.and_then(now)
        if isinstance(mode, CoarseMode):
            old = int(np.searchsorted(kept.rows[:, TIME], state.time - mode.window - INSTANT))
            if 2 * old > kept.count:
                kept = kept.without_first(old)
        self._state = replace(state, kept=kept)

    def _navigate(self, now: Array) -> None:
        state, chain = self._state, self._chain
        assert state.navigator is not None
        after, piece = chain.navigator.advance(
            state.navigator, now[:, TIME], np.ascontiguousarray(now[:, ROWS])
        )
        self._navigation.append(piece)
        told = chain.deliveries.over(state.deliveries, piece, float(now[-1, TIME]))
        deliveries, events, outages = told
        self._events += events
        self._outages += outages
        self._state = replace(state, navigator=after, deliveries=deliveries)

    def _at_due(self) -> None:
        """Do what is to be done now."""
        state = self._state
        mode = self._chain.modes[state.mode]
        if mode.kind == "navigation" and state.navigator is None:
            self._start_known()
            return
        if state.commands and state.commands[0].time <= state.time + INSTANT:
            self._obey()
            return
        elapsed = state.time - state.begun
        if elapsed >= mode.until.duration - INSTANT:
            found = align(self._chain, state)
            self._aligned_to(found, state.mode + 1, f"after {elapsed:.6g} s")
            return
        self._state = replace(state, next_try=mode.until.next_try(elapsed))
        try:
            found = align(self._chain, state)
        except (DataError, DivergenceError):
            # Not yet; the longest duration says it.
            return
        roll, pitch, heading = found.alignment.sd_deg_after(AHEAD).tolist()
        if mode.until.met(heading, max(roll, pitch)):
            roll, pitch, heading = found.alignment.sd_deg.tolist()
            words = f"heading known to {heading:.3g}°, level to {max(roll, pitch):.3g}°"
            self._aligned_to(found, state.mode + 1, words)

    def _obey(self) -> None:
        """Take the next command."""
        state, chain = self._state, self._chain
        command, *others = state.commands
        self._state = state = replace(state, commands=tuple(others))
        names = [mode.name for mode in chain.modes]
        place = state.mode + 1 if command.word == "next" else names.index(command.word)
        if place <= state.mode or place >= len(names):
            self._events.append(
                Event(state.time, "command", f"{command.word}: nothing to do, it is past")
            )
            return
        try:
            found = align(chain, state)
        except (DataError, DivergenceError) as error:
            self._events.append(
                Event(
                    state.time,
                    "command",
                    f"{command.word}: not possible yet, {names[state.mode]} goes on: "
                    f"{error.finding.what}",
                )
            )
            return
        self._events.append(Event(state.time, "command", command.word))
        self._aligned_to(found, place, "by command")

    def _aligned_to(self, found: Aligned, place: int, why: str) -> None:
        """End a mode of alignment, and begin another mode."""
        state, chain = self._state, self._chain
        self._aligned.append(found)
        self._modes.append(Span(found.mode, state.begun, state.time))
        self._events.append(Event(state.time, "mode", f"{found.mode} ends {why}"))
        kept = state.kept.rows
        if chain.modes[place].kind == "navigation":
            begun = handed_over(chain, state, found)
            self._begin_mode(place, state.time)
            self._begin_navigation(begun, without=unused_fixes(chain, state, begun.time))
            rest = kept[kept[:, TIME] > begun.time + INSTANT]
            if len(rest):
                self._navigate(rest)
            return
        # The last sample of an alignment is the first of the next.
        last = kept[-1:].copy()
        self._begin_mode(place, state.time)
        self._state = replace(
            self._state, aligned=found, kept=GrowingRows.of(ROWS.stop).and_then(last)
        )

    def _start_known(self) -> None:
        """Begin navigation with the state that is known."""
        state, start = self._state, self._chain.start
        assert start is not None
        slack = 0.5 * state.intake.usual
        if not start.at_first_sample and abs(state.time - start.state.time) > slack:
            raise DataError(
                "navigation.state-known-samples-begin",
                file=state.intake.source,
                quantity="start",
                time=start.state.time,
                time_2=state.time,
            )
        known = replace(start.state, time=state.time)
        self._state = replace(state, begun=state.time)
        self._begin_navigation(from_state(self._chain.navigator.filter, known, start.covariance))

    def _begin_navigation(
        self, begun: FilterState, without: dict[str, tuple[pd.DataFrame, ...]] | None = None
    ) -> None:
        chain, state = self._chain, self._state
        anew = chain.intake.gaps.beyond == "align"
        navigator = chain.navigator.begin_from(begun)
        for name, tables in {**state.told, **(without or {})}.items():
            for table in tables:
                navigator = chain.navigator.tell(navigator, name, table)
        self._state = replace(
            state,
            navigator=navigator,
            told=state.told if anew else dict.fromkeys(state.told, ()),
            deliveries=chain.deliveries.started(state.deliveries, begun.time),
        )
