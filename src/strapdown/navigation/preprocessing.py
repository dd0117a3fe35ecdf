"""Preprocess sensor samples to navigation steps: axes, gaps, pre-filter, increments."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown._kernels.level import Q_LB
from strapdown._kernels.motion_increments import join_blocks
from strapdown.dsp.samples import even_step
from strapdown.errors import ConfigError, DataError
from strapdown.estimation.error_filter import symmetric
from strapdown.increments import IncrementStream, IncrementStreamState
from strapdown.navigation.navigator import Navigator, NavigatorState
from strapdown.navigation.record import GrowingRows
from strapdown.prefilter.prefilter import CHANNELS, Grid, Portion, Prefilter
from strapdown.sensors.saturation import ROUNDING
from strapdown.sensors.uncertainty import ImuUncertainty
from strapdown.tables import ACCEL, GYRO
from strapdown.tables.checks import index_of, is_number, values_of
from strapdown.tables.on_disk import let_go

# The steps of a record, unchanged or joined to tenths of a second.


#: Length of joined increments, s.
JOINED = 0.1
#: Length of a chunk of a record, s.
AT_ONCE = 60.0
#: Stamps within this are equal, s.
NEAR = 1e-6


def steps_of(
    intake: ImuPreprocessor, imu: pd.DataFrame, begin: float, end: float
) -> Iterator[tuple[Array, Array]]:
    """Yield the motion increments within a span, a minute at a time: ends, s, and rows, (n, 10)."""
    time = index_of(imu)
    state = intake.begin(imu.attrs["sampling"], None)
    cuts = np.searchsorted(
        time, [*np.arange(time[0] + AT_ONCE, time[-1], AT_ONCE), np.inf]
    ).tolist()
    at = 0
    for cut in cuts:
        values = values_of(imu.iloc[at:cut], [*GYRO, *ACCEL])
        let_go(imu)
        state, steps = intake.advance(state, time[at:cut], values, cut == len(time))
        at = cut
        used = (steps.time > begin + NEAR) & (steps.time <= end + NEAR)
        if used.any():
            yield steps.time[used], np.ascontiguousarray(steps.rows[used])


def joined_steps(
    intake: ImuPreprocessor, imu: pd.DataFrame, begin: float, end: float
) -> tuple[Array, Array]:
    """Return the motion increments within a span, as `steps_of`, joined to a tenth of a second."""
    ends, joined = GrowingRows.of(1), GrowingRows.of(10)
    for time, rows in steps_of(intake, imu, begin, end):
        dt = np.ascontiguousarray(rows[:, 0])
        last, out = np.empty(len(dt), dtype=np.int64), np.empty_like(rows)
        samples = max(1, round(JOINED / float(np.median(dt))))
        count = int(join_blocks(dt, samples, rows, last, out))
        ends = ends.and_then(time[last[:count], None])
        joined = joined.and_then(out[:count])
    return ends.rows[:, 0], joined.rows


# Pre-filter of a pipeline: drifting stamps on its even grid, lost samples interpolated.


@dataclass(frozen=True, eq=False)
class FilteringState:
    """State between chunks.

    Attributes
    ----------
    grid : Grid
        From zero: its numbers count steps since the first sample.
    inner : object
        State of the pre-filter.
    numbers, stamps : ndarray, (k,)
        Grid index and stamp of the samples around the next output.
    newest : ndarray, (0 or 1, 6)
        The newest sample.
    """

    grid: Grid
    inner: Any
    numbers: Array = field(default_factory=lambda: np.empty(0))
    stamps: Array = field(default_factory=lambda: np.empty(0))
    newest: Array = field(default_factory=lambda: np.empty((0, 6)))


def begin_filtering(
    prefilter: Prefilter, first: Array, means: bool, source: str | None
) -> FilteringState:
    """Return the state before the first sample; the first stamps, s, give the step."""
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
        return FilteringState(grid, prefilter.begin(grid, 6))
    except ConfigError as error:
        if error.finding.quantity != "rate":
            raise
        raise error.replaced(file=source, quantity="prefilter, rate_hz") from None


def advance_filtering(
    prefilter: Prefilter,
    state: FilteringState,
    time: Array,
    values: Array,
    last: bool,
    source: str | None,
) -> tuple[FilteringState, Portion]:
    """Process samples whose stamps may drift against an even grid; `last` ends the input.

    The stamps of the output are on the clock of the samples, corrected for the delay of the filter.
    """
    numbers = _numbered(state, time, source)
    all_numbers = np.concatenate([state.numbers, numbers])
    all_stamps = np.concatenate([state.stamps, time])
    known = len(state.newest)
    nodes = np.concatenate([state.newest, values])
    at = all_numbers[len(all_numbers) - len(nodes) :]
    if len(nodes) > 1 and np.diff(at).max() > 1.0:
        every = np.arange(at[0], at[-1] + 1.0)
        nodes = np.column_stack([np.interp(every, at, column) for column in nodes.T])
    inner, portion = prefilter.advance(state.inner, np.ascontiguousarray(nodes[known:]), last)
    # For means, some filters have outputs midway between two samples.
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
    return after, replace(portion, time=stamps)


def _numbered(state: FilteringState, time: Array, source: str | None) -> Array:
    """Grid indices of stamps."""
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


# Gaps in the inertial data: policy and added uncertainty.


@dataclass(frozen=True)
class GapPolicy:
    """Policy for missing samples.

    A step of more than `usual` times the usual one is a gap. Rate and force are interpolated
    linearly over it, and the covariance assumes motion as over the second before: see
    `hole_between`.

    Attributes
    ----------
    usual : float
        Ratio to the step that 95 % of the first 64 do not exceed.
    bridge : float, s
        Longest gap that is bridged.
    beyond : {'refuse', 'align', 'bridge'}
        Action at a longer gap: end the run with an error; begin the first mode anew; or bridge it
        like a short one.
    """

    usual: float = field(default=3.0, metadata={"unit": ""})
    bridge: float = field(default=1.0, metadata={"unit": "s"})
    beyond: Literal["refuse", "align", "bridge"] = "refuse"

    def __post_init__(self) -> None:
        if not is_number(self.usual) or not self.usual > 1.0:
            raise ConfigError("navigation.gap-factor-too-small", quantity="usual", usual=self.usual)
        if not is_number(self.bridge) or not self.bridge >= 0.0:
            raise ConfigError(
                "navigation.gap-length-negative", quantity="bridge", bridge=self.bridge
            )
        if self.beyond not in ("refuse", "align", "bridge"):
            raise ConfigError(
                "navigation.nothing-do-about-gap", quantity="beyond", beyond=self.beyond
            )


@dataclass(frozen=True, eq=False)
class Hole:
    """A gap in the samples.

    Attributes
    ----------
    begin, end : float, s
        Stamps of its two sides.
    rate_sd, force_sd : ndarray, (3,), rad/s and m/s²
        Standard deviation of the mean over the gap from the linear interpolation.
    """

    begin: float
    end: float
    rate_sd: Array
    force_sd: Array

    @property
    def length(self) -> float:
        """Length in s."""
        return self.end - self.begin


def hole_between(before: Array, time: tuple[float, float], after: Array) -> Hole:
    """Describe a gap by the samples beside it.

    Parameters
    ----------
    before : ndarray, (k, 6)
        Samples of about a second before it, the last one at its begin.
    time : tuple of float, s
        Stamps of its sides.
    after : ndarray, (6,)
        The sample that ends it.

    Returns
    -------
    Hole
        The uncertainty of the mean is half of the difference between the sides, as if all of the
        change occurred at one end, combined with the scatter of the samples of the second before.
    """
    half = 0.5 * (after - before[-1])
    sd = np.sqrt(np.square(half) + before.var(axis=0))
    return Hole(time[0], time[1], sd[:3], sd[3:])


def widened(navigator: Navigator, state: NavigatorState, hole: Hole) -> NavigatorState:
    """Return a state before a gap, with the gap's uncertainty added to its covariance.

    Parameters
    ----------
    state : NavigatorState
        At the begin of the gap.

    Returns
    -------
    NavigatorState
        A mean rate error d turns the attitude by ``d length``, a mean force error changes the
        velocity accordingly, and the position moves with that velocity: twice the effect of a
        constant error.
    """
    filter_, model = navigator.filter, navigator.filter.model
    at = state.engine.filter
    level = filter_.mechanization.levels(at.row[None, :])[0]
    C = rotation.dcm_from_quaternion(level[Q_LB : Q_LB + 4])
    P = np.zeros((model.physical_size,) * 2)
    P[3:6, 3:6] = C * np.square(hole.force_sd * hole.length) @ C.T
    P[6:9, 6:9] = C * np.square(hole.rate_sd * hole.length) @ C.T
    E = model.from_physical(filter_.mechanization, at.time, at.row)
    more = symmetric(E @ P @ E.T)
    covariance = filter_.form.predict(at.covariance, np.eye(len(more)), more)
    engine = replace(state.engine, filter=replace(at, covariance=covariance))
    return replace(state, engine=engine)


# Saturated sensors: the lost part of the signal as uncertainty.


@dataclass(frozen=True, eq=False)
class RangeState:
    """State between chunks.

    Attributes
    ----------
    time, values : ndarray, (m,) and (m, 6)
        The last samples, two at most.
    since : ndarray, (6,), s
        For each saturated channel, the last sample before saturation; NaN for others.
    slope : ndarray, (6,)
        Slope at the begin of saturation.
    """

    time: Array = field(default_factory=lambda: np.empty(0))
    values: Array = field(default_factory=lambda: np.empty((0, 6)))
    since: Array = field(default_factory=lambda: np.full(6, np.nan))
    slope: Array = field(default_factory=lambda: np.zeros(6))


@dataclass(frozen=True, eq=False)
class RangeEnds:
    """Range ends of six channels.

    The signal beyond the end of the range is modeled as a parabola: with a slope s at the begin,
    the steepest of the two steps before, and a return within a time T, its integral above the end
    is ``s T²/6``. That is the standard deviation of the lost part; as T is unknown before the end
    of saturation, it grows over the samples: by ``(s t²/6)²`` in variance after a time t,
    including the steps on both sides. After a lost angle this large the axes of rotation are
    wrong, too: half its square is added about each.

    Attributes
    ----------
    least, most : ndarray, (6,), rad/s and m/s²
        Smallest and largest saturated reading; a larger one belongs to another sensor.
    """

    least: Array
    most: Array

    def advance(
        self, state: RangeState, time: Array, values: Array
    ) -> tuple[RangeState, tuple[Hole, ...]]:
        """Process further samples; chunks of any length give the same as the whole.

        Parameters
        ----------
        time : ndarray, (k,), s
        values : ndarray, (k, 6)

        Returns
        -------
        state : RangeState
        holes : tuple of Hole
            One per step, with its added uncertainty.
        """
        size = np.abs(values)
        at = (size >= self.least) & (size <= self.most)
        t, v = np.concatenate([state.time, time]), np.concatenate([state.values, values])
        new, rows = len(state.time), np.atleast_1d(at.any(axis=1))
        holes = []
        if rows.any() or not np.isnan(state.since).all():
            # A saturated sample, and the one after it.
            after = ~np.isnan(state.since).all()
            open_ = rows | np.concatenate([[after], rows[:-1]])
            since, slope = state.since.copy(), state.slope.copy()
            for k in np.flatnonzero(open_).tolist():
                i = new + k
                if i == 0:
                    # A record that begins in saturation does not contain its begin.
                    since[at[0]] = t[0]
                    continue
                begun = at[k] & np.isnan(since)
                if begun.any():
                    since[begun] = t[i - 1]
                    near = t[max(i - 2, 0) : i + 1]
                    steps = np.abs(np.diff(v[max(i - 2, 0) : i + 1], axis=0))
                    slope[begun] = (steps / np.diff(near)[:, None]).max(axis=0)[begun]
                here, before = t[i] - since, np.maximum(t[i - 1] - since, 0.0)
                missed = np.where(
                    np.isnan(since), 0.0, slope / 6.0 * np.array([before**2, here**2])
                )
                missed[np.isnan(missed)] = 0.0
                more = np.diff(np.square(missed), axis=0)[0]
                more[:3] += np.diff(np.square(0.5 * np.square(missed[:, :3])).sum(axis=1))
                sd = np.sqrt(more) / (t[i] - t[i - 1])
                holes.append(Hole(float(t[i - 1]), float(t[i]), sd[:3], sd[3:]))
                since[~at[k]] = np.nan
            state = replace(state, since=since, slope=slope)
        kept = max(len(t) - 2, 0)
        state = replace(state, time=t[kept:].copy(), values=v[kept:].copy())
        return state, tuple(holes)


def ends_of(sensors: ImuUncertainty) -> RangeEnds | None:
    """Return the stated range ends; None if none is stated.

    Parameters
    ----------
    sensors : ImuUncertainty
        Readings within a converter step of the stated end count as saturated.
    """
    triads = (sensors.gyro, sensors.accel)
    full = np.concatenate([np.asarray(one.axis("full_scale"), dtype=float) for one in triads])
    step = np.concatenate([np.asarray(one.axis("quantization"), dtype=float) for one in triads])
    if np.isinf(full).all():
        return None
    with np.errstate(invalid="ignore"):
        slack = np.where(np.isfinite(full), np.maximum(step, ROUNDING * full), 0.0)
    return RangeEnds(full - slack, np.where(np.isfinite(full), full + slack, 0.0))


Array = NDArray[np.float64]

#: Number of first samples that give the usual step of a record.
FIRST = 64
#: Time over which the motion before a gap is assessed, s.
BEFORE = 1.0
# Stamps are rounded: a step of exactly the limit is not a gap.
ROUNDED = 1.01


@dataclass(frozen=True, eq=False)
class ImuIncrements:
    """Navigation steps of a chunk of samples.

    Attributes
    ----------
    time : ndarray, (n,), s
        Ends of the steps.
    values : ndarray, (n, 6)
        Rates and specific forces at them, in body axes.
    rows : ndarray, (n, 10)
        Motion increments.
    opening : tuple of (float, ndarray), or None
        Stamp and values of the sample at which the first step begins, once.
    holes : tuple of Hole
        Gaps found; steps over them may still follow.
    cut_off : tuple of Hole
        Steps with a saturated sensor; they may follow later, too.
    """

    time: Array
    values: Array
    rows: Array
    opening: tuple[float, Array] | None
    holes: tuple[Hole, ...]
    cut_off: tuple[Hole, ...] = ()


@dataclass(frozen=True, eq=False)
class ImuPreprocessorState:
    """State between chunks.

    Attributes
    ----------
    sampling : str
        Of the samples.
    source : str, optional
    count : int
        Samples so far.
    usual : float, s
        Longest usual step; 0 until it is known.
    newest : float, s
        Stamp of the newest sample.
    tail : GrowingRows
        Stamp and values, in body axes, of the samples held until then; afterwards of at least the
        last second.
    stream : IncrementStreamState or None
        None if the pre-filter computes the increments, and until this is known.
    own : bool
        Whether it does.
    first : tuple of (float, ndarray), or None
        The first sample, until it is known what computes the increments.
    waiting_time, waiting : ndarray
        Samples after the end of the last step.
    ranges : RangeState
        Saturation of the sensors.
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
    waiting_time: Array = field(default_factory=lambda: np.empty(0))
    waiting: Array = field(default_factory=lambda: np.empty((0, 6)))
    ranges: RangeState = field(default_factory=RangeState)


@dataclass(frozen=True, eq=False)
class ImuPreprocessor:
    """Convert samples to navigation steps; the state is kept by the caller.

    Attributes
    ----------
    gyro_axes, accel_axes : ndarray, (3, 3), optional
        From the axes of the sensors to those of the body (`sensors.axes_matrix`).
    prefilter : Prefilter, optional
        The stamps of its output are corrected for its delay; the output is later by it.
    stream : IncrementStream, optional
        Linear for raw samples, cubic after a pre-filter, if not given.
    ends : RangeEnds, optional
        Range ends of the sensors, in body axes.
    """

    gyro_axes: Array | None = None
    accel_axes: Array | None = None
    prefilter: Prefilter | None = None
    stream: IncrementStream | None = None
    gaps: GapPolicy = field(default_factory=GapPolicy)
    ends: RangeEnds | None = None

    @property
    def increments(self) -> IncrementStream:
        """The increment stream in use."""
        if self.stream is not None:
            return self.stream
        return IncrementStream("linear" if self.prefilter is None else "cubic")

    def sampling(self, state: ImuPreprocessorState) -> str:
        """Kind of the values of its steps: 'instantaneous' or 'mean'."""
        if self.prefilter is None or state.filtering is None:
            return state.sampling
        return self.prefilter.sampling(state.filtering.grid)

    def begin(
        self, sampling: str = "instantaneous", source: str | None = None
    ) -> ImuPreprocessorState:
        """Return the state before the first sample.

        Parameters
        ----------
        sampling : {'instantaneous', 'mean'}
        source : str, optional
            Name for messages.
        """
        return ImuPreprocessorState(sampling, source)

    def advance(
        self, state: ImuPreprocessorState, time: Array, values: Array, last: bool = False
    ) -> tuple[ImuPreprocessorState, ImuIncrements]:
        """Process further samples.

        Parameters
        ----------
        time : ndarray, (k,), s
        values : ndarray, (k, 6)
            rad/s and m/s².
        last : bool
            Whether no sample follows.

        Raises
        ------
        DataError
            Time does not advance, a value is not finite, or the stamps are uneven and a pre-filter
            needs them even.
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
                # Term by term: the order of additions in a matrix product may depend on its size.
                x, y, z = (values[:, at + k, None] for k in range(3))
                out[:, at : at + 3] = x * matrix[:, 0] + y * matrix[:, 1] + z * matrix[:, 2]
        return out

    def _judged(self, state: ImuPreprocessorState, time: Array) -> ImuPreprocessorState:
        """Determine the usual step from the first samples, and initialize what depends on it."""
        if len(time) < 2:
            raise DataError(
                "navigation.sample-navigation-goes-sample-sample",
                file=state.source,
                quantity="time",
                count=len(time),
            )
        state = replace(state, usual=float(np.quantile(np.diff(time), 0.95, method="lower")))
        if self.prefilter is None:
            return replace(state, stream=self.increments.begin(state.sampling))
        means = state.sampling == "mean"
        return replace(state, filtering=begin_filtering(self.prefilter, time, means, state.source))

    def _holes(
        self, state: ImuPreprocessorState, known: int
    ) -> tuple[ImuPreprocessorState, tuple[Hole, ...]]:
        """Find gaps after the `known` rows of the tail, and drop expired rows."""
        rows = state.tail.rows
        time, begin = rows[:, 0], max(known - 1, 0)
        found = []
        longest = self.gaps.usual * ROUNDED * state.usual
        wide = np.flatnonzero(time[begin + 1 :] - time[begin:-1] > longest) + begin
        for k in wide.tolist():
            first = int(np.searchsorted(time, time[k] - BEFORE))
            sides = (float(time[k]), float(time[k + 1]))
            found.append(hole_between(rows[first : k + 1, 1:], sides, rows[k + 1, 1:]))
        # Dropped in at least half of the buffer, so that it is seldom copied.
        past = int(time.searchsorted(time[-1] - BEFORE))
        if 2 * past > state.tail.count and state.tail.count > FIRST:
            state = replace(state, tail=state.tail.without_first(past))
        return state, tuple(found)

    def _stepped(
        self,
        state: ImuPreprocessorState,
        time: Array,
        values: Array,
        found: ImuIncrements,
        last: bool,
    ) -> tuple[ImuPreprocessorState, ImuIncrements]:
        """Compute the increments, and attach the gaps and saturations found."""
        if self.prefilter is not None:
            before = state.filtering
            assert before is not None
            if len(time) and state.stream is None and not state.own and state.first is None:
                state = replace(state, first=(float(time[0]), values[0].copy()))
            filtering, out = advance_filtering(
                self.prefilter, before, time, values, last, state.source
            )
            state = replace(state, filtering=filtering)
            time, values = out.time, out.values
            if not len(time) and (state.stream is None or not last):
                return state, found
            if len(out.rows):
                # Increments by a pre-filter begin with the first sample.
                opening = state.first
                state = replace(state, own=True, first=None)
                return state, ImuIncrements(
                    time, values, out.rows, opening, found.holes, found.cut_off
                )
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
        return state, ImuIncrements(ends, values[:n], rows, opening, found.holes, found.cut_off)


_NOTHING = ImuIncrements(np.empty(0), np.empty((0, 6)), np.empty((0, 10)), None, ())


def _check(state: ImuPreprocessorState, time: Array, values: Array) -> None:
    """Refuse invalid samples; rows count from 1 over the whole record."""
    # The sum of an infinity and its opposite is NaN, too.
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
