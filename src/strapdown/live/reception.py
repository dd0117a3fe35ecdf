"""From lines to the pipeline: timely, late and invalid lines; and again, from the journal."""

from __future__ import annotations

import math
from collections import Counter, deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial

import numpy as np

from strapdown.config.alignment import sensors_of
from strapdown.config.navigation import CommandTable, LiveTable, NavigationSpec
from strapdown.errors import ConfigError, DataError, Finding, StrapdownError
from strapdown.formats.clocks import EPOCH
from strapdown.formats.columns import parse_axes
from strapdown.formats.stamp_gate import StampGate
from strapdown.live.journal import Journal, SpooledRows
from strapdown.live.lines import (
    END,
    AidRows,
    BadLineError,
    Measured,
    Sample,
    Word,
    check_token,
    count_unused,
    parse_line,
)
from strapdown.live.replay import LatencyTape, RunClock
from strapdown.live.sources import ReceivedLine
from strapdown.navigation.engine import SAME_INSTANT
from strapdown.navigation.measurements.measurement import TabulatedMeasurement
from strapdown.navigation.modes import PipelineChunk
from strapdown.navigation.pipeline import NavigationPipeline
from strapdown.navigation.replay import Recording
from strapdown.sensors.uncertainty import ImuUncertainty
from strapdown.systems.alignment_source import axes_matrices
from strapdown.tables.checks import Array

# --- values that no sensor can give, which are refused -----------------------------------

#: Largest stamp, s: the year 2286, where a double resolves 2 µs.
LATEST = 1e10
#: The ranges of a sensor family, as ±2 to ±16 g or ±250 to ±2000 deg/s, differ at most eightfold.
FAMILY = 8.0
#: Beyond any gyro, rad/s, and accelerometer, m/s².
FASTEST, STRONGEST = 1e4, 1e6


@dataclass(frozen=True)
class ValueLimits:
    """Largest readings that a sensor can give, rad/s and m/s²."""

    rate: float = FASTEST
    force: float = STRONGEST

    def check(self, said: Sample) -> None:
        """Refuse a stamp or a reading beyond the limits."""
        if not abs(said.time) <= LATEST:
            raise BadLineError("stamp", "live.stamp-beyond-limit", time=said.time, most=LATEST)
        force, rate = said.values[-3:], said.values[:-3]
        for values, most, unit in ((rate, self.rate, "rad/s"), (force, self.force, "m/s²")):
            for value in values:
                if not abs(value) <= most:
                    raise BadLineError(
                        "value", "live.value-beyond-limit", value=value, most=most, unit=unit
                    )


def value_limits(sensors: ImuUncertainty) -> ValueLimits:
    """Return the limits by the stated full scale; a sensor may be set to its family's largest."""
    rate, force = (
        min(FAMILY * max(triad.axis("full_scale")), most)
        for triad, most in ((sensors.gyro, FASTEST), (sensors.accel, STRONGEST))
    )
    return ValueLimits(rate, force)


#: Samples in a row that confirm a gap: without a delay of the states from 50 Hz on, as `hold_s`
#: is 0.2 s by default. So many older stamps in a row are a clock that went back.
CONFIRM = 10
#: Most samples that wait for late measurements, whatever their stamps.
WAITING = 100_000
#: Most rows of a measurement, and commands, that wait for the sample of their stamp.
ROWS_WAITING, WORDS_WAITING = 1000, 100
#: Rows so much after the last sample are part of the record at its end, s.
AFTER_END = 1.0


#: A sample, and the line that it came in; None for one of the journal.
Arrived = tuple[Sample, ReceivedLine | None]


@dataclass(frozen=True)
class Row:
    """Valid measurement row.

    Attributes
    ----------
    time : float, s
        As received.
    lead : float, s
        By how much its stamp is later than the first instant that it measures.
    """

    name: str
    time: float
    lead: float
    values: list[float]
    line: int | None


class Reception:
    """Pass the samples of lines to a pipeline, and record its input.

    A sample waits until one arrives that is `hold_s` later, by the stamps, not by a clock:
    measurements that arrive meanwhile are still in time, and the numbers do not depend on the load
    of the machine. Later ones are counted, not used; so a run over the recorded input gives the
    same numbers. A measurement row waits for the sample of its stamp, so that a wrong stamp far
    ahead does not refuse the rows after it.

    Parameters
    ----------
    spec : NavigationSpec
        With `live`.
    show : callable
        Called with the output chunk of each sample.
    warn : callable
        Called with a finding for each first unused line of its kind.
    journal : Journal, optional
        Takes what lines said before it is used, and holds the recorded input; in memory without it.

    Attributes
    ----------
    tape : LatencyTape
        From the line that made a sample due to its state.
    unused : Counter
        Unused lines, by kind.
    late : Counter
        Measurement rows that arrived too late, by name.
    gaps : int
        Confirmed gaps that are longer than the pipeline bridges.
    replayed : int
        Records that came from the journal.
    token : str or None
        That commands need.
    error : StrapdownError or None
        Error of the pipeline at a sample: the run ends before it.
    """

    def __init__(
        self,
        chain: NavigationPipeline,
        spec: NavigationSpec,
        recording: Recording,
        clock: RunClock,
        show: Callable[[PipelineChunk], None],
        warn: Callable[[Finding], None],
        journal: Journal | None = None,
    ) -> None:
        self._live = spec.live or LiveTable()
        self._chain, self._recording, self._clock = chain, recording, clock
        self._show, self._warn, self._journal = show, warn, journal
        self._gyro, self._accel = _turns(spec)
        self._limits = value_limits(sensors_of(spec))
        self._gate: StampGate[Arrived] = StampGate(CONFIRM, chain.intake.gaps.usual)
        self._state = chain.begin(self._live.sampling, "received.csv")
        given = spec.aiding
        self.rows = {
            aid.name: AidRows(aid, given[aid.name], partial(self._spool, f"aid-{aid.name}"))
            for aid in chain.navigator.aids
            if isinstance(aid, TabulatedMeasurement)
        }
        self._early: dict[str, deque[Row]] = {name: deque() for name in self.rows}
        self._origin = self._first = math.nan
        self._waiting: deque[tuple[float, Array]] = deque()
        self._newest = self._done = -math.inf
        self._behind, self._last_behind = 0, -math.inf
        self._samples = self._spool("samples", 7)
        self._words: list[str] = []
        self.commands: list[CommandTable] = []
        self.tape = LatencyTape()
        self.lines = self.gaps = self.replayed = 0
        self.unused: Counter[str] = Counter()
        self.late: Counter[str] = Counter()
        self.token: str | None = None
        self.error: StrapdownError | None = None

    @property
    def samples(self) -> Array:
        """Stamps and values passed to the pipeline, body axes, (n, 7)."""
        return self._samples.rows

    @property
    def count(self) -> int:
        """Number of samples passed to the pipeline."""
        return self._samples.count

    @property
    def sampling(self) -> str:
        """Kind of the samples: 'instantaneous' or 'mean'."""
        return self._live.sampling

    def take(self, line: ReceivedLine) -> bool:
        """Process a line.

        Returns
        -------
        bool
            Whether the run continues.
        """
        self.lines += 1
        try:
            said = parse_line(line.text, tuple(self.rows))
            if isinstance(said, Word):
                check_token(said, self.token)
                if said.word == END:
                    return False
            if said is not None:
                self._use(said, line, self._journal)
        except BadLineError as bad:
            self._not_used(bad, line.number)
        return self.error is None

    def accept(self, said: Sample | Measured | Word, line: ReceivedLine | None = None) -> bool:
        """Process what was said, and is in a journal already; return whether the run continues."""
        try:
            self._use(said, line)
        except BadLineError as bad:
            self._not_used(bad, None if line is None else line.number)
        return self.error is None

    def replay(self, said: Iterable[Sample | Measured | Word]) -> None:
        """Process what a journal has."""
        for one in said:
            self.replayed += 1
            if not self.accept(one):
                return

    def finish(self) -> None:
        """Process the waiting samples, and end the run of the pipeline."""
        self._pass(self._gate.finish())
        self._tell_early(self._newest + AFTER_END)
        for name in self.rows:
            self._drop_early(name)
        while self._waiting and self.error is None:
            self._advance(math.nan)
        self._state, piece = self._chain.finish(self._state)
        self._recording.take(piece)

    def _spool(self, name: str, columns: int) -> SpooledRows:
        if self._journal is None:
            return SpooledRows(columns)
        return self._journal.spool(name, columns)

    def _use(
        self,
        said: Sample | Measured | Word,
        line: ReceivedLine | None,
        journal: Journal | None = None,
    ) -> None:
        """Use what a line said, after it is written to the journal; refuse it before."""
        if isinstance(said, Sample):
            self._check_sample(said)
            if journal is not None:
                journal.append(said)
            self._pass(self._gate.take(said.time, (said, line)))
            return
        number = None if line is None else line.number
        row = self._row(said, number) if isinstance(said, Measured) else None
        if isinstance(said, Word):
            self._check_word(said.word)
        if journal is not None:
            journal.append(said)
        if row is not None:
            self._take_row(row)
        elif isinstance(said, Word):
            self._words.append(said.word)

    # Samples.

    def _check_sample(self, said: Sample) -> None:
        """Refuse a sample without effect."""
        self._limits.check(said)
        if said.time > self._gate.newest:
            self._behind = 0
            return
        self._behind = self._behind + 1 if said.time > self._last_behind else 1
        self._last_behind = said.time
        if self._behind == CONFIRM:
            newest = self._gate.newest
            raise BadLineError("clock", "live.clock-back", time=said.time, newest=newest)
        raise BadLineError("time", "live.sample-not-later", time=said.time)

    def _pass(self, items: list[tuple[float, Arrived]]) -> None:
        """Let samples that passed the gate wait for late measurements, and advance older ones."""
        for stamp, (_, line) in self._gate.dropped:
            newest = None if math.isnan(self._origin) else self._newest + self._origin
            code = "live.stamp-not-first" if newest is None else "live.stamp-not-confirmed"
            bad = BadLineError("stamp", code, time=stamp, newest=newest)
            self._not_used(bad, None if line is None else line.number)
        if len(items) > 1 and math.isfinite(self._newest):
            begin, end, before = self._newest + self._origin, items[0][0], self.gaps
            self.gaps += end - begin > self._chain.intake.gaps.bridge
            if self.gaps == 1 and not before:
                self._warn(Finding("live.gap", severity="note", begin=begin, end=end))
        for _, (said, line) in items:
            try:
                self._wait(said, math.nan if line is None else line.arrived)
            except BadLineError as bad:
                self._not_used(bad, None if line is None else line.number)
            if self.error is not None:
                return

    def _wait(self, said: Sample, arrived: float) -> None:
        time = self._own(said.time)
        # Stamps that differ by a bit may be the same from their origin.
        if not time > self._newest:
            raise BadLineError("time", "live.sample-not-later", time=said.time)
        values = np.array(said.values)
        for part, turn in ((slice(0, 3), self._gyro), (slice(3, 6), self._accel)):
            if turn is not None:
                values[part] = turn @ values[part]
        self._waiting.append((time, values))
        self._newest = time
        self._tell_early(time)
        # Stamps are rounded decimal fractions.
        due = time - self._live.hold_s + SAME_INSTANT
        while self._waiting and (self._waiting[0][0] <= due or len(self._waiting) > WAITING):
            self._advance(arrived)
            if self.error is not None:
                return

    def _own(self, stamp: float) -> float:
        """A stamp as the record's reader will parse it, to the last bit."""
        if math.isnan(self._origin):
            self._origin = stamp if abs(stamp) > EPOCH else 0.0
            self._first = stamp - self._origin
        return self._first + ((stamp - self._origin) - self._first)

    def _advance(self, arrived: float) -> None:
        """Pass the oldest waiting sample to the pipeline."""
        stamp, values = self._waiting[0]
        state = self._state
        for word in self._words:
            state = self._chain.command(state, word, stamp)
        try:
            state, piece = self._chain.advance(state, np.array([stamp]), values[None, :])
        except StrapdownError as error:
            self.error = error
            return
        self._recording.take(piece)
        self._show(piece)
        step = stamp - self._done
        if math.isfinite(arrived):
            done = self._clock.now()
            self.tape.take(arrived, done, arrived + step if math.isfinite(step) else math.nan)
        self.commands += [CommandTable(time_s=stamp, mode=word) for word in self._words]  # type: ignore[arg-type]
        self._words.clear()
        self._state, self._done = state, stamp
        self._waiting.popleft()
        self._samples.append((stamp, *values.tolist()))

    # Measurements.

    def _row(self, said: Measured, line: int | None) -> Row:
        """Check a row; refuse one without effect."""
        rows, name = self.rows[said.name], said.name
        if not abs(said.time) <= LATEST:
            raise BadLineError(
                f"{name} stamp", "live.stamp-beyond-limit", time=said.time, most=LATEST
            )
        values = rows.row(said.values)
        origin = self._origin
        if math.isnan(origin):
            if not self._gate.holding:
                raise BadLineError(f"{name} before the first sample", "live.before-first-sample")
            origin = 0.0
        time = said.time - origin
        if not time > rows.newest:
            raise BadLineError(f"{name} time", "live.row-not-later", time=said.time)
        try:
            at = rows.aid.epochs(rows.table(time, values)).time
        except DataError as error:
            raise BadLineError(name, error.finding) from None
        return Row(name, said.time, time - min([time, *at.tolist()]), values, line)

    def _take_row(self, row: Row) -> None:
        """Use a row, or let it wait for the sample of its stamp."""
        early = self._early[row.name]
        if early and row.time == early[-1].time:
            raise BadLineError(f"{row.name} time", "live.row-not-later", time=row.time)
        if early and row.time < early[-1].time:
            self._drop_early(row.name, row.time)
        if math.isnan(self._origin) or self._earliest(row) > self._newest + SAME_INSTANT:
            if len(early) >= ROWS_WAITING:
                raise BadLineError(f"{row.name} ahead", "live.row-ahead", time=row.time)
            early.append(row)
            return
        self._tell(row)

    def _earliest(self, row: Row) -> float:
        return (row.time - self._origin) - row.lead

    def _tell_early(self, until: float) -> None:
        """Use the rows up to a time."""
        for early in self._early.values():
            while early and self._earliest(early[0]) <= until + SAME_INSTANT:
                row = early.popleft()
                try:
                    self._tell(row)
                except BadLineError as bad:
                    self._not_used(bad, row.line)

    def _drop_early(self, name: str, since: float = -math.inf) -> None:
        """Drop rows that wait, from a stamp on: an older one contradicts them."""
        early = self._early[name]
        while early and early[-1].time >= since:
            row = early.pop()
            self._not_used(BadLineError(f"{name} ahead", "live.row-ahead", time=row.time), row.line)

    def _tell(self, row: Row) -> None:
        rows, time = self.rows[row.name], row.time - self._origin
        if not time > rows.newest:
            raise BadLineError(f"{row.name} time", "live.row-not-later", time=row.time)
        if self._earliest(row) <= self._done + SAME_INSTANT:
            self.late[row.name] += 1
            if self.late[row.name] == 1:
                delay = self._newest - time
                self._warn(Finding("live.late", quantity=row.name, time=row.time, delay=delay))
            return
        try:
            table = rows.table(time, row.values)
            self._state = self._chain.tell(self._state, row.name, table)
        except DataError as error:
            raise BadLineError(row.name, error.finding) from None
        rows.keep(time, row.values)

    # Commands, and what is not used.

    def _check_word(self, word: str) -> None:
        if len(self._words) >= WORDS_WAITING:
            raise BadLineError("command", "live.commands-waiting", count=WORDS_WAITING)
        try:
            self._chain.command(self._state, word)
        except ConfigError as error:
            raise BadLineError("command", error.finding) from None

    def _not_used(self, bad: BadLineError, line: int | None = None) -> None:
        count_unused(self.unused, bad, line, self._warn)


def _turns(spec: NavigationSpec) -> tuple[Array | None, Array | None]:
    """Rotation from sensor to body axes, of gyros and accelerometers."""
    gyro, accel = axes_matrices(spec.axes)
    if gyro is None and spec.axes.axes is not None:
        axis, sign = parse_axes(spec.axes.axes)
        gyro = accel = np.eye(3)[axis] * np.array(sign)[:, None]
    return gyro, accel
