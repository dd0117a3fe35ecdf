"""From samples of sensors to steps of a navigator: axes, holes, pre-filter, increments."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import DataError
from strapdown.increments.stream import IncrementStream, IncrementStreamState
from strapdown.navigation.growing_rows import GrowingRows
from strapdown.prefilter.prefilter import CHANNELS, Prefilter
from strapdown.systems.sins.filtering import Filtering, FilteringState
from strapdown.systems.sins.gaps import GapPolicy, Hole, hole_between
from strapdown.systems.sins.saturated import RangeEnds, RangeState

__all__ = ["Intake", "IntakeState", "Steps"]

Array = NDArray[np.float64]

#: Samples at the start that tell the step of a record.
FIRST = 64
#: Over which the motion before a gap is judged, s.
BEFORE = 1.0
# Stamps are rounded: a step of exactly so many usual ones is no gap.
ROUNDED = 1.01


@dataclass(frozen=True, eq=False)
class Steps:
    """What the samples of a piece make.

    Attributes
    ----------
    time : ndarray, (n,), s
        Ends of the steps.
    values : ndarray, (n, 6)
        Rates and forces there, in body axes.
    rows : ndarray, (n, 10)
        Motion increments.
    opening : tuple of (float, ndarray), or None
        Stamp and values of the sample at which the first step begins, once.
    holes : tuple of Hole
        That were found; steps over them may still be to come.
    cut_off : tuple of Hole
        Steps with a sensor at the end of its range; they may be to come, too.
    """

    time: Array
    values: Array
    rows: Array
    opening: tuple[float, Array] | None
    holes: tuple[Hole, ...]
    cut_off: tuple[Hole, ...] = ()


def _no_time() -> Array:
    return np.empty(0)


def _no_values() -> Array:
    return np.empty((0, 6))


@dataclass(frozen=True, eq=False)
class IntakeState:
    """Between pieces.

    Attributes
    ----------
    sampling : str
        Of the samples.
    source : str, optional
    count : int
        Samples so far.
    usual : float, s
        Longest usual step; nought until it is known.
    newest : float, s
        Stamp of the newest sample.
    tail : GrowingRows
        Stamp and values, in body axes, of the samples that wait for that; then of at least the
        last second.
    filtering : FilteringState or None
    stream : IncrementStreamState or None
        None where the pre-filter makes the increments, and until it is known whether it does.
    own : bool
        Whether it does.
    first : tuple of (float, ndarray), or None
        The first sample, until it is known who makes the increments.
    waiting_time, waiting : ndarray
        Samples that no step has ended at yet.
    ranges : RangeState
        Which sensors are at the end of their range.
    """

    sampling: str
    source: str | None
    count: int = 0
    usual: float = 0.0
    newest: float = -np.inf
    tail: GrowingRows = field(default_factory=lambda: GrowingRows.of(7))
    filtering: FilteringState | None = None
    stream: IncrementStreamState | None = None
    own: bool = False
    first: tuple[float, Array] | None = None
    waiting_time: Array = field(default_factory=_no_time)
    waiting: Array = field(default_factory=_no_values)
    ranges: RangeState = field(default_factory=RangeState)


@dataclass(frozen=True, eq=False)
class Intake:
    """Makes steps of samples; it holds no state.

    Attributes
    ----------
    gyro_axes, accel_axes : ndarray, (3, 3), optional
        From the axes of the sensors to those of the body (`sensors.axes_matrix`).
    prefilter : Prefilter, optional
        Its delay is taken off by the stamps of what comes out; it comes later by that.
    stream : IncrementStream, optional
        Linear for samples as they come, cubic after a pre-filter, if not given.
    gaps : GapPolicy
    ends : RangeEnds, optional
        Of the sensors, in the axes of the body.
    """

    gyro_axes: Array | None = None
    accel_axes: Array | None = None
    prefilter: Prefilter | None = None
    stream: IncrementStream | None = None
    gaps: GapPolicy = field(default_factory=GapPolicy)
    ends: RangeEnds | None = None

    @property
    def increments(self) -> IncrementStream:
        """The stream that is used."""
        if self.stream is not None:
            return self.stream
        return IncrementStream("linear" if self.prefilter is None else "cubic")

    def sampling(self, state: IntakeState) -> str:
        """What the values of its steps are: 'instantaneous' or 'mean'."""
        if self.prefilter is None or state.filtering is None:
            return state.sampling
        return self.prefilter.sampling(state.filtering.grid)

    def begin(self, sampling: str = "instantaneous", source: str | None = None) -> IntakeState:
        """Return the state before the first sample.

        Parameters
        ----------
        sampling : {'instantaneous', 'mean'}
        source : str, optional
            Name for messages.
        """
        return IntakeState(sampling, source)

    def advance(
        self, state: IntakeState, time: Array, values: Array, last: bool = False
    ) -> tuple[IntakeState, Steps]:
        """Take further samples.

        Parameters
        ----------
        state : IntakeState
        time : ndarray, (k,), s
        values : ndarray, (k, 6)
            rad/s and m/s².
        last : bool
            Whether no sample follows.

        Returns
        -------
        state : IntakeState
        steps : Steps

        Raises
        ------
        DataError
            Time does not advance, a value is not finite, or the stamps are not even where a
            pre-filter needs them so.
        """
        _check(state, time, values)
        values = self._turned(values)
        known, tail = state.tail.count, state.tail
        if len(time):
            both = np.empty((len(time), 7))
            both[:, 0], both[:, 1:] = time, values
            tail = tail.and_then(both)
            state = replace(state, count=state.count + len(time), newest=float(time[-1]), tail=tail)
        if not state.usual:
            if tail.count < FIRST and not last:
                return state, _NOTHING
            known = 0
            time, values = tail.rows[:, 0].copy(), tail.rows[:, 1:].copy()
            state = self._judged(state, time[:FIRST])
        found = _NOTHING
        if len(time):
            state, holes = self._holes(state, known)
            cut_off: tuple[Hole, ...] = ()
            if self.ends is not None:
                ranges, cut_off = self.ends.advance(state.ranges, time, values)
                state = replace(state, ranges=ranges)
            found = replace(_NOTHING, holes=holes, cut_off=cut_off)
        return self._stepped(state, time, values, found, last)

    def _turned(self, values: Array) -> Array:
        out = values.copy()
        for at, matrix in ((0, self.gyro_axes), (3, self.accel_axes)):
            if matrix is not None:
                # Term by term: a product of matrices may add in an order that depends on its size.
                x, y, z = (values[:, at + k, None] for k in range(3))
                out[:, at : at + 3] = x * matrix[:, 0] + y * matrix[:, 1] + z * matrix[:, 2]
        return out

    def _judged(self, state: IntakeState, time: Array) -> IntakeState:
        """Learn the usual step from the first samples, and begin what needs it."""
        if len(time) < 2:
            raise DataError(
                "navigation.sample-navigation-goes-sample-sample",
                file=state.source,
                quantity="time",
                count=len(time),
            )
        state = replace(
            state,
            usual=float(np.quantile(np.diff(time), 0.95, method="lower")),
        )
        if self.prefilter is None:
            return replace(state, stream=self.increments.begin(state.sampling))
        means = state.sampling == "mean"
        return replace(state, filtering=Filtering(self.prefilter).begin(time, means, state.source))

    def _holes(self, state: IntakeState, known: int) -> tuple[IntakeState, tuple[Hole, ...]]:
        """Find gaps after the `known` rows of the tail, and drop what is long past."""
        rows = state.tail.rows
        time, begin = rows[:, 0], max(known - 1, 0)
        found = []
        longest = self.gaps.usual * ROUNDED * state.usual
        wide = np.flatnonzero(time[begin + 1 :] - time[begin:-1] > longest) + begin
        for k in wide.tolist():
            first = int(np.searchsorted(time, time[k] - BEFORE))
            sides = (float(time[k]), float(time[k + 1]))
            found.append(hole_between(rows[first : k + 1, 1:], sides, rows[k + 1, 1:]))
        # Half of it at least is given back at a time: what is kept is seldom copied.
        past = int(time.searchsorted(time[-1] - BEFORE))
        if 2 * past > state.tail.count and state.tail.count > FIRST:
            state = replace(state, tail=state.tail.without_first(past))
        return state, tuple(found)

    def _stepped(
        self,
        state: IntakeState,
        time: Array,
        values: Array,
        found: Steps,
        last: bool,
    ) -> tuple[IntakeState, Steps]:
        """Make the increments; to them comes what was found of the samples."""
        if self.prefilter is not None:
            before = state.filtering
            assert before is not None
            if len(time) and state.stream is None and not state.own and state.first is None:
                state = replace(state, first=(float(time[0]), values[0].copy()))
            filtering, out = Filtering(self.prefilter).advance(
                before, time, values, last, state.source
            )
            state = replace(state, filtering=filtering)
            time, values = out.time, out.values
            if not len(time) and (state.stream is None or not last):
                return state, found
            if len(out.rows):
                # Rows that a pre-filter makes begin with the first sample.
                opening = state.first
                state = replace(state, own=True, first=None)
                return state, Steps(time, values, out.rows, opening, found.holes, found.cut_off)
            if state.stream is None:
                begun = self.increments.begin(self.sampling(state))
                state = replace(state, stream=begun, first=None)
        assert state.stream is not None
        opening = None
        if len(time) and not len(state.stream.time):
            opening = (float(time[0]), values[0].copy())
        stream, ends, rows = self.increments.advance(state.stream, time, values, last)
        if opening is not None:
            time, values = time[1:], values[1:]
        values = np.concatenate([state.waiting, values])
        time = np.concatenate([state.waiting_time, time])
        n = len(ends)
        state = replace(
            state, stream=stream, waiting_time=time[n:].copy(), waiting=values[n:].copy()
        )
        return state, Steps(ends, values[:n], rows, opening, found.holes, found.cut_off)


_NOTHING = Steps(_no_time(), _no_values(), np.empty((0, 10)), None, ())


def _check(state: IntakeState, time: Array, values: Array) -> None:
    """Refuse samples that cannot be used; rows count from 1 over the whole record."""
    # The sum of an infinity and its opposite is none, either.
    alone = len(time) == 1 and math.isfinite(sum(values[0].tolist()))
    if alone and state.newest < time[0] < math.inf:
        return
    if not np.isfinite(time).all():
        row = int(np.argmin(np.isfinite(time)))
        raise DataError(
            "navigation.not-finite-number",
            file=state.source,
            row=state.count + row + 1,
            quantity="time",
            time=time[row],
        )
    before = [state.newest] if state.count else []
    stamps = np.concatenate([before, time])
    steps = np.diff(stamps)
    if steps.size and not steps.min() > 0.0:
        k = int(np.argmax(~(steps > 0.0)))
        raise DataError(
            "navigation.time-decreases",
            file=state.source,
            row=state.count + k + 2 - (len(stamps) - len(time)),
            quantity="time",
            stamps=stamps[k],
            stamps_2=stamps[k + 1],
        )
    with np.errstate(invalid="ignore", over="ignore"):
        total = values.sum()
    if not np.isfinite(total) and not np.isfinite(values).all():
        row, column = (int(k) for k in np.argwhere(~np.isfinite(values))[0])
        raise DataError(
            "navigation.values-time",
            file=state.source,
            row=state.count + row + 1,
            quantity=CHANNELS[column],
            values=values[row, column],
            time=time[row],
        )
