"""Recorders: the output of a run, at the requested rate."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.dsp.samples import true_runs
from strapdown.errors import ConfigError, DataError
from strapdown.estimation.robust import DOUBT, FEW, AdaptiveRule
from strapdown.navigation.measurements.gnss import PLACE, TINY
from strapdown.navigation.navigator import JUST_BEFORE, Navigator
from strapdown.navigation.record import (
    CovarianceSnapshots,
    Event,
    GrowingRows,
    NavigationChunk,
    NavigationRecord,
    Span,
    standard_deviations,
)
from strapdown.tables import EULER, TRAJECTORY, check_trajectory, on_disk
from strapdown.tables.checks import is_number, view_of

if TYPE_CHECKING:
    from strapdown.mechanization.mechanization import Mechanization
    from strapdown.navigation.smoother import Smoothed, Smoothing

Array = NDArray[np.float64]

# A time stamp within this fraction of the interval counts as on the grid.
NEAR = 1e-6
#: Marks before and after an observation are closer than this, s.
PAIR = 2.0 * JUST_BEFORE
#: A longer interval, relative to the usual, is an outage; after so many observations that are taken
#: its position, velocity and acceleration are confirmed. An error swings out within so many.
GAP, CONFIRMED, SETTLES = 5.0, 3, 5
#: Share of a variance that a smoother takes off, from which on it is compared with its correction.
LEAST_GAIN = 0.01


@dataclass(frozen=True)
class Recorder(ABC):
    """Selection of a run's output; stateless."""

    name: ClassVar[str]
    summary: ClassVar[str]
    source: ClassVar[str]

    @property
    @abstractmethod
    def rate(self) -> float:
        """Highest rate of states and marks that are kept, Hz; infinite for all."""

    def begin(self, navigator: Navigator) -> Tape:
        """Return an empty record."""
        return Tape(navigator, self.rate)


@dataclass(frozen=True)
class FullRecorder(Recorder):
    """Every sample: 1 kHz makes 0.5 GB an hour."""

    name: ClassVar[str] = "full"
    summary: ClassVar[str] = "every sample"
    source: ClassVar[str] = "-"

    @property
    def rate(self) -> float:
        """Every state and mark."""
        return math.inf


@dataclass(frozen=True)
class IntervalRecorder(Recorder):
    """The first sample, and the first mark, of each interval of an even grid from time zero.

    Of marks before and after an observation both or none are kept.

    Attributes
    ----------
    rate_hz : float, Hz
    """

    name: ClassVar[str] = "interval"
    summary: ClassVar[str] = "the first sample of each interval; all innovations"
    source: ClassVar[str] = "-"

    rate_hz: float = 10.0

    def __post_init__(self) -> None:
        if not is_number(self.rate_hz) or not 0.0 < self.rate_hz < math.inf:
            raise ConfigError(
                "navigation.recorder-rate-not-positive", quantity="rate_hz", rate_hz=self.rate_hz
            )

    @property
    def rate(self) -> float:
        """States per second."""
        return float(self.rate_hz)


#: A new recorder is a class and a line here.
RECORDERS: dict[str, type[Recorder]] = {"full": FullRecorder, "interval": IntervalRecorder}


@dataclass
class Tape:
    """Recorded output of a run so far.

    Its memory grows with the recorded states and marks, and with every observation: three
    numbers a component, and its time.

    Attributes
    ----------
    rate : float, Hz
        Most states and marks a second; infinite for all.
    """

    navigator: Navigator
    rate: float = math.inf
    _states: GrowingRows = field(init=False, repr=False)
    _marks: GrowingRows = field(init=False, repr=False)
    #: Labels by name of the observation; and its time, innovations, variances, weights.
    _labels: dict[str, tuple[str, ...]] = field(init=False, repr=False, default_factory=dict)
    _seen: dict[str, GrowingRows] = field(init=False, repr=False, default_factory=dict)
    _state_cell: float = field(init=False, repr=False, default=-math.inf)
    _mark_cell: float = field(init=False, repr=False, default=-math.inf)
    #: The newest mark, where it is not among them, (0 or 1, …).
    _newest: Array = field(init=False, repr=False)

    def __post_init__(self) -> None:
        count = self.navigator.filter.model.stacked.sd.size
        self._states = GrowingRows.of(1 + self.navigator.filter.mechanization.row)
        self._marks = GrowingRows.of(1 + 81 + 2 * count)
        self._newest = self._marks.rows

    def take(self, piece: NavigationChunk) -> None:
        """Append the result of a chunk."""
        cells = self._cells(piece.time)
        if len(cells) and cells[-1] > self._state_cell:
            first = np.empty(len(cells), dtype=bool)
            first[0], first[1:] = cells[0] > self._state_cell, cells[1:] > cells[:-1]
            self._state_cell = float(cells[-1])
            rows = np.column_stack([piece.time[first], piece.history[first]])
            self._states = self._states.and_then(rows)
        self._take_marks(piece.marks)
        for of in piece.seen.by_name():
            if of.name not in self._seen:
                self._labels[of.name] = of.labels
                self._seen[of.name] = GrowingRows.of(1 + 3 * len(of.labels))
            told = of.innovations
            rows = np.column_stack([of.time, told.nu, told.s, told.weight])
            self._seen[of.name] = self._seen[of.name].and_then(rows)

    def record(
        self,
        source: str | None = None,
        events: tuple[Event, ...] = (),
        modes: tuple[Span, ...] = (),
        outages: Mapping[str, tuple[Span, ...]] | None = None,
        smoothing: Smoothing | None = None,
    ) -> NavigationRecord:
        """Return the record as tables.

        Parameters
        ----------
        source : str, optional
            Name for messages.
        events, modes, outages
            As of `NavigationRecord`.
        smoothing : Smoothing, optional
            Of the same chunks: states and marks are smoothed; innovations are the filter's.

        Raises
        ------
        DataError
            The record is empty.
        """
        states, marks = self._states.rows, self._marks.rows
        if not len(states):
            raise DataError("navigation.no-step", file=source, quantity="time")
        used, model = self.navigator.filter.mechanization, self.navigator.filter.model
        if len(self._newest):
            # Another value, of which a later mark knows nothing.
            marks = self._marks.and_then(self._newest).rows
        count = model.stacked.sd.size
        at_marks = on_disk.stored(marks[:, 0])
        later = None if smoothing is None else smoothing.smoothed(at_marks)
        trajectory = _trajectory(used, states, later, source)
        # Rows of the marks that are kept, and their times.
        kept, stamps = np.arange(len(marks)), at_marks
        if self.navigator.about is not None:
            stamps = self.navigator.about.marks
            kept = _nearest(at_marks, stamps)
        time = pd.Index(stamps, name="time", copy=False)
        covariance = on_disk.room((len(kept), 9, 9))
        sensors, sensors_sd = (on_disk.room((len(kept), count)) for _ in range(2))
        contradictions = list(self._contradictions())
        factor = None
        if later is not None and contradictions:
            about = [
                (one.begin if one.since is None else one.since, one.believed)
                for _, one in contradictions
            ]
            factor = self._excess(later, marks, kept, about)
            contradictions = [(k, one) for k, one in contradictions if one.since is None]
        without = ~np.array(model.estimated(used))
        for part in on_disk.parts_of(len(kept), marks.shape[1]):
            rows, at = kept[part], stamps[part]
            found = marks[rows]
            filtered = found[:, 1:82].reshape(-1, 9, 9)
            P, sensors[part] = covariance[part], found[:, 82 : 82 + count]
            if later is None:
                P[:], sensors_sd[part] = filtered, found[:, 82 + count :]
            else:
                P[:], sensors_sd[part] = later.covariance[rows], later.sensors_sd[rows]
                sensors[part] += later.sensors[rows]
            if factor is not None:
                P *= factor[part, None, None]
                sensors_sd[part] *= np.sqrt(factor[part, None])
            for component, (begin, end, size, *_) in contradictions:
                within = (at >= begin) & (at <= end)
                # A correction of one position corrects all else by their covariance with it.
                own = filtered[within, component, component, None]
                moved = size * filtered[within, :, component] / np.maximum(own, TINY)
                moved[:, component] = size
                P[within] += moved[:, :, None] * moved[:, None, :]
            P[:, without, :] = P[:, :, without] = np.nan
            on_disk.let_go_of_all()
        nearest = np.clip(trajectory.index.searchsorted(time), 0, len(trajectory) - 1)
        euler = on_disk.stored(view_of(trajectory, EULER), nearest)
        labels = list(model.layout.labels())[model.layout.size - count :]
        units = [one.block.unit for one in model.sensors for _ in one.block.labels]
        return NavigationRecord(
            trajectory=trajectory,
            sd=standard_deviations(time, covariance, euler, source),
            covariance=covariance,
            sensors=pd.DataFrame(sensors, index=time, columns=labels, copy=False),
            sensors_sd=pd.DataFrame(sensors_sd, index=time, columns=labels, copy=False),
            units=dict(zip(labels, units, strict=True)),
            innovations={
                name: _table(rows.rows, self._labels[name]) for name, rows in self._seen.items()
            },
            events=events,
            modes=modes,
            outages=dict(outages or {}),
        )

    def _excess(
        self,
        later: Smoothed,
        marks: Array,
        kept: NDArray[np.intp],
        spans: Sequence[tuple[float, float]],
    ) -> Array:
        """Factors on the smoothed covariance about contradictions, with the outages before them.

        The correction of a filter by its smoother has the variance that the smoother takes off. A
        correction beyond it, as of rejected fixes that are then believed, was not made by the noise
        of the model: as the smoother divides it over the time before by that noise, so much as it
        is larger is the smoothed variance. On both sides to where the correction is within its
        standard deviation.
        """
        stamps = marks[kept, 0]
        nodes = later.nodes_at(stamps)
        correction = later.errors[nodes, :6]
        if len(later.left):
            correction = correction - later.left[nodes, :6]
        square = np.square(correction)
        factor = np.ones(len(kept))
        for part in on_disk.parts_of(len(kept), 81):
            rows = kept[part]
            filtered = marks[rows, 1:82].reshape(-1, 9, 9)
            for own in (slice(0, 2), slice(2, 3), slice(3, 5), slice(5, 6)):
                before, after = (
                    np.einsum("kii->k", P[:, own, own]) for P in (filtered, later.covariance[rows])
                )
                less = before - after
                some = less > LEAST_GAIN * before
                ratio = square[part, own].sum(axis=1) / np.where(some, less, math.inf)
                factor[part] = np.fmax(factor[part], ratio)
            on_disk.let_go_of_all()
        out = np.ones(len(kept))
        for since, end in spans:
            first, stop = np.searchsorted(stamps, [since, end], side="right").tolist()
            while first > 0 and factor[first - 1] > 1.0:
                first -= 1
            while stop < len(stamps) and factor[stop] > 1.0:
                stop += 1
            out[first:stop] = factor[first:stop]
        return out

    def _contradictions(self) -> Iterator[tuple[int, Contradiction]]:
        """Components of the receivers' positions, with their contradictions."""
        general = self.navigator.filter.rule
        rules = {aid.name: aid.rule or general for aid in self.navigator.aids}
        for name, rows in self._seen.items():
            labels, n = self._labels[name], len(self._labels[name])
            rule = rules.get(name.rpartition(".")[0])
            if not isinstance(rule, AdaptiveRule) or not set(labels) <= set(PLACE):
                continue
            time, nu, weight = rows.rows[:, 0], rows.rows[:, 1:], rows.rows[:, 1 + 2 * n :]
            for k, label in enumerate(labels):
                rejected = weight[:, k] == 0.0
                for one in _contradictions(time, nu[:, k], rejected, rule.scale.patience):
                    yield PLACE.index(label), one

    def _cells(self, time: Array) -> Array:
        """Number of the interval of each time stamp."""
        if math.isinf(self.rate):
            return time
        return np.floor(time * self.rate + NEAR)

    def _take_marks(self, marks: CovarianceSnapshots) -> None:
        """Keep the first mark of each interval, and one that is next to it.

        The newest one is kept separately, so that the last of a run is always recorded.
        """
        if not len(marks):
            return
        flat = marks.covariance.reshape(len(marks), -1)
        rows = np.column_stack([marks.time, flat, marks.sensors, marks.sensors_sd])
        cells, newest = [self._mark_cell] * len(self._newest), -1
        cells += self._cells(marks.time).tolist()
        rows = np.concatenate([self._newest, rows])
        kept: list[int] = []
        last = float(self._marks.rows[-1, 0]) if self._marks.count else -math.inf
        for k, (time, cell) in enumerate(zip(rows[:, 0].tolist(), cells, strict=True)):
            if cell > self._mark_cell:
                if newest >= 0 and time <= rows[newest, 0] + PAIR:
                    kept.append(newest)
                kept.append(k)
                self._mark_cell, newest = cell, -1
            elif time == last:
                # Of the chunk before: in one there is one of an instant.
                self._marks.rows[-1] = rows[k]
            elif time <= last + PAIR:
                kept.append(k)
            else:
                newest = k
            last = float(rows[kept[-1], 0]) if kept else last
        self._marks = self._marks.and_then(rows[kept])
        self._newest = rows[newest : newest + 1].copy() if newest >= 0 else self._newest[:0]


def _trajectory(
    used: Mechanization, states: Array, later: Smoothed | None, source: str | None
) -> pd.DataFrame:
    """Trajectory table of recorded states, with the corrections of a smoother."""
    rows, time = on_disk.room((len(states), len(TRAJECTORY))), on_disk.stored(states[:, 0])
    for part in on_disk.parts_of(*states.shape):
        history = np.array(states[part, 1:])
        if later is not None:
            history = later.corrected(time[part], history)
        used.fill_trajectory(history, rows[part])
        on_disk.let_go_of_all()
    index = pd.Index(time, name="time", copy=False)
    table = pd.DataFrame(rows, index=index, columns=TRAJECTORY, copy=False)
    table.attrs["source"] = source
    check_trajectory(table)
    return table


def _nearest(time: Array, wanted: Array) -> NDArray[np.intp]:
    """Indices of the times, increasing, that are nearest to others."""
    after = np.clip(time.searchsorted(wanted), 1, len(time) - 1)
    return np.asarray(after - (wanted - time[after - 1] < time[after] - wanted))


class Contradiction(NamedTuple):
    """A contradiction of a component of a receiver's position and the inertial solution.

    Attributes
    ----------
    begin, end : float, s
        While what separated the two is a part of the uncertainty.
    size : float, m
    believed : float, s
        When the receiver is believed again.
    since : float or None, s
        When the outage before it began, if there was one.
    """

    begin: float
    end: float
    size: float
    believed: float
    since: float | None


def _contradictions(
    time: Array, nu: Array, rejected: NDArray[np.bool_], patience: int
) -> Iterator[Contradiction]:
    """Return the contradictions of a receiver and the inertial solution.

    `nu`, `rejected`: innovations of a component, and those that an adaptive rule rejected.

    A receiver that is rejected so many times in a row is believed again, by and by, and either it
    or the solution was wrong. What separated the two is a part of the uncertainty until it jumps
    back, or for `DOUBT` if it does not; one that returns by itself was wrong until then. After an
    outage the solution was wrong, as it is while an error swings out, and where the receiver is
    believed sooner.
    """
    spans = _long_rejections(rejected, min(FEW, patience))
    if not spans:
        return
    first = [float(nu[span.start]) for span in spans]
    after_gap = np.diff(time, prepend=-math.inf) > GAP * np.median(np.diff(time))
    back, swings, since = False, -1, None
    for j, span in enumerate(spans):
        # The last estimate needs as many observations to settle.
        settled = min(span.stop + patience, len(time))
        size, end = float(np.abs(nu[span]).max()), float(time[settled - 1])
        begin, until = float(time[span.start]), float(time[span.stop - 1])
        long = span.stop - span.start >= patience
        if span.stop < len(time) and abs(nu[span.stop]) < 0.5 * abs(nu[span.stop - 1]):
            if long:
                yield Contradiction(begin, float(time[span.stop]), size, until, None)
            back = False
            continue
        near = max(span.start - CONFIRMED + 1, 0)
        lately = near + np.flatnonzero(after_gap[near : span.start + 1])
        if lately.size or not long or back or span.start <= swings:
            if lately.any():
                since = float(time[lately[0] - 1])
            elif span.start > swings:
                since = None
            yield Contradiction(begin, end, size, end, since)
            back, swings = False, settled + patience
            continue
        end = until + DOUBT
        # One after that time is a fault of its own.
        if j + 1 < len(spans) and time[spans[j + 1].start] <= end:
            back = abs(first[j] + first[j + 1]) < 0.5 * abs(first[j])
            end = float(time[spans[j + 1].stop - 1]) if back else end
        yield Contradiction(begin, end, size, until, None)


def _long_rejections(rejected: NDArray[np.bool_], patience: int) -> list[slice]:
    """Spans that begin with so many rejections in a row.

    Others that follow it, after a few that were taken, are the same: an error swings out.
    """
    spans: list[slice] = []
    for run in true_runs(rejected):
        if spans and run.start - spans[-1].stop <= SETTLES:
            spans[-1] = slice(spans[-1].start, run.stop)
        elif run.stop - run.start >= patience:
            spans.append(run)
    return spans


def record_of(
    navigator: Navigator, pieces: Sequence[NavigationChunk], source: str | None = None
) -> NavigationRecord:
    """Join the chunks of a run, every sample included.

    Parameters
    ----------
    pieces : sequence of NavigationChunk
        At least one sample and one mark.
    source : str, optional
        Name for messages.
    """
    tape = FullRecorder().begin(navigator)
    for piece in pieces:
        tape.take(piece)
    return tape.record(source)


def _table(rows: Array, labels: tuple[str, ...]) -> pd.DataFrame:
    return pd.DataFrame(
        rows[:, 1:].copy(),
        index=pd.Index(rows[:, 0].copy(), name="time"),
        columns=[f"{part} {label}" for part in ("nu", "s", "weight") for label in labels],
    )
