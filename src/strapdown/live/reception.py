"""Lines to a chain: what is in time, what is late, and what cannot be used."""

from __future__ import annotations

import math
from collections import Counter, deque
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from strapdown.aiding.aid import TableAid
from strapdown.config.navigation import CommandTable, LiveTable, NavigationSpec, aids_of
from strapdown.errors import ConfigError, DataError, Finding, StrapdownError
from strapdown.formats.columns import parse_axes
from strapdown.formats.stamps import EPOCH
from strapdown.live.aid_rows import AidRows
from strapdown.live.clock import Clock
from strapdown.live.latency import LatencyTape
from strapdown.live.lines import END, BadLineError, Measured, Sample, Word, parse_line
from strapdown.live.sources import Line
from strapdown.navigation.engine import SAME_INSTANT
from strapdown.navigation.growing_rows import GrowingRows
from strapdown.systems.alignment_source import axes_matrices
from strapdown.systems.sins.chain import Chain
from strapdown.systems.sins.drive import Recording
from strapdown.systems.sins.piece import ChainPiece

__all__ = ["Reception"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class _Waiting:
    time: float
    values: Array


class Reception:
    """Gives a chain the samples of lines, and keeps what it was given.

    A sample waits until one comes that is `hold_s` later, by the stamps and not by a clock: what
    an aid sends meanwhile is still in time, and the numbers do not depend on how busy the machine
    is. What comes later than that is counted, and not used; so a run over what was kept gives the
    same numbers.

    Parameters
    ----------
    chain : Chain
    spec : NavigationSpec
        With `live`.
    recording : Recording
    clock : Clock
    show : callable
        Given the piece of each sample.
    warn : callable
        Given a finding for each first line of its kind that is not used.

    Attributes
    ----------
    tape : LatencyTape
        From the line that made a sample due to its state.
    unused : Counter
        Lines that were not used, by kind.
    late : Counter
        Rows of aids that came too late, by name.
    error : StrapdownError or None
        What the chain refused a sample with: the run ends before it.
    """

    def __init__(
        self,
        chain: Chain,
        spec: NavigationSpec,
        recording: Recording,
        clock: Clock,
        show: Callable[[ChainPiece], None],
        warn: Callable[[Finding], None],
    ) -> None:
        self._live = spec.live or LiveTable()
        self._chain, self._recording, self._clock = chain, recording, clock
        self._show, self._warn = show, warn
        self._gyro, self._accel = _turns(spec)
        self._state = chain.begin(self._live.sampling, "received.csv")
        given = aids_of(spec)
        self.rows = {
            aid.name: AidRows(aid, given[aid.name])
            for aid in chain.navigator.aids
            if isinstance(aid, TableAid)
        }
        self._origin = self._first = math.nan
        self._waiting: deque[_Waiting] = deque()
        self._newest = self._done = -math.inf
        self._samples = GrowingRows.of(7)
        self._words: list[str] = []
        self.commands: list[CommandTable] = []
        self.tape = LatencyTape()
        self.lines = 0
        self.unused: Counter[str] = Counter()
        self.late: Counter[str] = Counter()
        self.error: StrapdownError | None = None

    @property
    def samples(self) -> Array:
        """Stamps and values that the chain was given, body axes, (n, 7)."""
        return self._samples.rows

    @property
    def sampling(self) -> str:
        """Of the samples."""
        return self._live.sampling

    def take(self, line: Line) -> bool:
        """Take a line.

        Returns
        -------
        bool
            Whether the run goes on.
        """
        self.lines += 1
        try:
            said = parse_line(line.text, tuple(self.rows))
            if isinstance(said, Sample):
                self._sample(said, line.arrived)
            elif isinstance(said, Measured):
                self._measured(said)
            elif isinstance(said, Word):
                if said.word == END:
                    return False
                self._word(said.word)
        except BadLineError as bad:
            self._not_used(bad, line)
        return self.error is None

    def finish(self) -> None:
        """Navigate what waits, and end the run of the chain.

        Raises
        ------
        DataError
            Navigation never began.
        """
        while self._waiting and self.error is None:
            self._advance(math.nan)
        self._state, piece = self._chain.finish(self._state)
        self._recording.take(piece)

    def _sample(self, said: Sample, arrived: float) -> None:
        time = self._own(said.time)
        if not time > self._newest:
            raise BadLineError("time", "live.sample-not-later", time=said.time)
        values = np.array(said.values)
        for part, turn in ((slice(0, 3), self._gyro), (slice(3, 6), self._accel)):
            if turn is not None:
                values[part] = turn @ values[part]
        self._waiting.append(_Waiting(time, values))
        self._newest = time
        # Stamps are decimal fractions that were rounded.
        while self._waiting and self._waiting[0].time <= time - self._live.hold_s + SAME_INSTANT:
            self._advance(arrived)
            if self.error is not None:
                return

    def _own(self, stamp: float) -> float:
        """A stamp as the reader of the record will have it, to the last bit."""
        if math.isnan(self._origin):
            self._origin = stamp if abs(stamp) > EPOCH else 0.0
            self._first = stamp - self._origin
        return self._first + ((stamp - self._origin) - self._first)

    def _advance(self, arrived: float) -> None:
        """Give the chain the sample that has waited longest."""
        one = self._waiting[0]
        state = self._state
        for word in self._words:
            state = self._chain.command(state, word, one.time)
        try:
            state, piece = self._chain.advance(state, np.array([one.time]), one.values[None, :])
        except StrapdownError as error:
            self.error = error
            return
        self._recording.take(piece)
        self._show(piece)
        step = one.time - self._done
        if math.isfinite(arrived):
            done = self._clock.now()
            self.tape.take(arrived, done, arrived + step if math.isfinite(step) else math.nan)
        self.commands += [CommandTable(time_s=one.time, mode=word) for word in self._words]  # type: ignore[arg-type]
        self._words.clear()
        self._state, self._done = state, one.time
        self._waiting.popleft()
        self._samples = self._samples.and_then(np.concatenate([[one.time], one.values])[None, :])

    def _measured(self, said: Measured) -> None:
        rows = self.rows[said.name]
        row = rows.row(said.values)
        if math.isnan(self._origin):
            raise BadLineError(f"{said.name} before the first sample", "live.before-first-sample")
        time = said.time - self._origin
        if not time > rows.newest:
            raise BadLineError(f"{said.name} time", "live.row-not-later", time=said.time)
        table = rows.table(time, row)
        try:
            at = rows.aid.epochs(table).time
            if min([time, *at.tolist()]) <= self._done + SAME_INSTANT:
                self.late[said.name] += 1
                if self.late[said.name] == 1:
                    self._warn(
                        Finding(
                            "live.late",
                            quantity=said.name,
                            time=said.time,
                            delay=self._newest - time,
                        )
                    )
                return
            self._state = self._chain.tell(self._state, said.name, table)
        except DataError as error:
            raise BadLineError(said.name, error.finding) from None
        rows.keep(time, row)

    def _word(self, word: str) -> None:
        try:
            self._chain.command(self._state, word)
        except ConfigError as error:
            raise BadLineError("command", error.finding) from None
        self._words.append(word)

    def _not_used(self, bad: BadLineError, line: Line) -> None:
        self.unused[bad.kind] += 1
        if self.unused[bad.kind] == 1:
            self._warn(Finding("live.line-not-used", line=line.number, reason=bad.finding))


def _turns(spec: NavigationSpec) -> tuple[Array | None, Array | None]:
    """Sensor axes to body, of gyros and accelerometers."""
    gyro, accel = axes_matrices(spec.axes)
    if gyro is None and spec.axes.axes is not None:
        axis, sign = parse_axes(spec.axes.axes)
        gyro = accel = np.eye(3)[axis] * np.array(sign)[:, None]
    return gyro, accel
