"""Live run from its first line to all results of a report."""

from __future__ import annotations

import math
import signal
from collections import Counter, deque
from collections.abc import Callable, Iterator, Mapping
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.config.alignment import sensors_of
from strapdown.config.navigation import CommandTable, LiveTable, NavigationSpec
from strapdown.errors import ConfigError, DataError, Finding, StrapdownError
from strapdown.formats.clocks import EPOCH
from strapdown.formats.columns import parse_axes
from strapdown.formats.writers import WRITERS
from strapdown.formats.writing import FileOptions
from strapdown.live.lines import (
    END,
    AidRows,
    BadLineError,
    Measured,
    Sample,
    StateLines,
    Word,
    parse_line,
)
from strapdown.live.replay import Latency, LatencyTape, RunClock, warm_up
from strapdown.live.sources import LineSource, ReceivedLine
from strapdown.navigation.engine import SAME_INSTANT
from strapdown.navigation.measurements.measurement import TabulatedMeasurement
from strapdown.navigation.modes import PipelineChunk
from strapdown.navigation.pipeline import NavigationPipeline
from strapdown.navigation.record import GrowingRows
from strapdown.navigation.recorder import Recorder
from strapdown.navigation.replay import PipelineRun, Recording, run_batch
from strapdown.progress import Progress, silent
from strapdown.systems.alignment_source import axes_matrices
from strapdown.systems.navigation_run import NavigationRun, make_chain, run_navigation
from strapdown.systems.one_thread import one_thread
from strapdown.tables import ACCEL, GYRO
from strapdown.tables.checks import values_of

__all__ = ["LiveRun", "Reception", "live_spec", "receive", "result_of", "write_received"]


@dataclass(frozen=True, eq=False)
class LiveRun:
    """Received input and result of a live run.

    Attributes
    ----------
    run : PipelineRun or None
        None if navigation never began.
    error : StrapdownError or None
        Error that ended the run early.
    """

    spec: NavigationSpec
    got: Reception
    run: PipelineRun | None
    error: StrapdownError | None

    @property
    def latency(self) -> Latency | None:
        """From the line that made a sample due to its state."""
        return self.got.tape.latency()

    def told(self) -> Mapping[str, Any]:
        """Content of ``latency.json``."""
        latency = self.latency
        return {
            **({} if latency is None else latency.told()),
            "lines": self.got.lines,
            "not_used": dict(self.got.unused),
            "late": dict(self.got.late),
        }


@one_thread()
def receive(
    spec: NavigationSpec,
    source: LineSource,
    clock: RunClock,
    write: Callable[[str], None],
    warn: Callable[[Finding], None],
    form: str = "json",
    every: float = 1.0,
) -> LiveRun:
    """Navigate by lines until they end, an ``end`` command, or a signal.

    Parameters
    ----------
    spec : NavigationSpec
        With `live`, and without a record (`live_spec`).
    write : callable
        Called with each line of the state.
    warn : callable
        Called with each finding.
    form, every
        As `StateLines`.
    """
    with closing(source):
        chain = make_chain(spec, sensors_of(spec))
        recorder: Recorder = spec.recorder.make(ellipsoid=spec.ellipsoid)
        reader = _Reader(write)
        lines = StateLines(chain.navigator, reader.write, form, every)
        recording = Recording(chain, recorder)
        got = Reception(chain, spec, recording, clock, lines.take, warn)
        with until_a_signal() as wanted:
            warm_up(chain, got.sampling)
            warn(Finding("live.listening", severity="note", source=source.name))
            source.begin()
            while wanted() and reader.there:
                try:
                    line = source.next()
                except TimeoutError:
                    continue
                if line is None or not got.take(line):
                    break
    try:
        got.finish()
        return LiveRun(spec, got, recording.run("received.csv"), got.error)
    except DataError as error:
        return LiveRun(spec, got, None, got.error or error)


def result_of(
    live: LiveRun, folder: Path, file: Path | None = None, progress: Progress = silent
) -> NavigationRun:
    """Write the received input, and return the result of the run over it.

    Parameters
    ----------
    live : LiveRun
        With a run.
    folder : Path
        Destination of the received input.
    file : Path, optional
        The configuration.
    progress : callable, optional

    Returns
    -------
    NavigationRun
        From the states computed in real time. If reading the record back gives other numbers, from
        the record: the result can always be reproduced.
    """
    spec = write_received(live.spec, live.got, folder)

    def same(
        chain: NavigationPipeline,
        imu: pd.DataFrame,
        tables: Mapping[str, pd.DataFrame],
        recorder: Recorder,
        told: Progress,
    ) -> PipelineRun:
        read = np.column_stack([imu.index.to_numpy(), values_of(imu, [*GYRO, *ACCEL])])
        if live.run is not None and np.array_equal(read, live.got.samples):
            return live.run
        return run_batch(chain, imu, tables, recorder, told)

    return run_navigation(spec, file, progress, same)


class _Reader:
    """Reader of the state lines; when it closes the pipe, the run ends."""

    def __init__(self, write: Callable[[str], None]) -> None:
        self._write = write
        self.there = True

    def write(self, text: str) -> None:
        try:
            if self.there:
                self._write(text)
        except BrokenPipeError:
            self.there = False


@contextmanager
def until_a_signal() -> Iterator[Callable[[], bool]]:
    """End the run in order at the first SIGINT or SIGTERM, and at once at the next one."""
    came: list[int] = []
    before: dict[int, Any] = {}

    def note(number: int, frame: object) -> None:
        came.append(number)
        signal.signal(number, before[number])

    for asked in (signal.SIGINT, signal.SIGTERM):
        before[asked] = signal.getsignal(asked)
    try:
        for asked in (signal.SIGINT, signal.SIGTERM):
            signal.signal(asked, note)
        yield lambda: not came
    finally:
        for asked in (signal.SIGINT, signal.SIGTERM):
            signal.signal(asked, before[asked])


# The received input as a record, which reproduces the numbers in batch.


SAMPLES = "received.csv"


def _plain(spec: NavigationSpec) -> dict[str, Any]:
    whole = spec.plain()
    for name in spec.aiding:
        aid = whole["aiding"][name]
        for key in ("path", "columns", "repair"):
            aid.pop(key, None)
    return whole


def live_spec(spec: NavigationSpec) -> NavigationSpec:
    """Return a specification that reads from lines instead of files.

    Parameters
    ----------
    spec : NavigationSpec
        With ``[live]``, or of a record, whose files are then ignored.
    """
    whole = _plain(spec)
    whole.pop("simulation", None)
    log = whole.pop("log", {})
    sampling = log.get("sampling")
    whole.setdefault("live", {} if sampling is None else {"sampling": sampling})
    return NavigationSpec.checked(whole)


def write_received(spec: NavigationSpec, got: Reception, folder: Path) -> NavigationSpec:
    """Write the input of a pipeline, and return the specification of a run over it.

    Parameters
    ----------
    spec : NavigationSpec
        Specification of the live run.
    folder : Path
        Destination: ``received.csv`` in body axes, and a file for each measurement.

    Returns
    -------
    NavigationSpec
        Measurements without a row have no file.
    """
    whole = _plain(spec)
    samples = got.samples
    imu = pd.DataFrame(samples[:, 1:], index=samples[:, 0], columns=[*GYRO, *ACCEL])
    imu.attrs["sampling"] = got.sampling
    # As it is: what came is kept where it is too little to be a record.
    WRITERS["csv"].function(folder / SAMPLES, {"imu": imu}, FileOptions())
    # Without properties that the reader infers from the numbers: they are known.
    whole["log"] = {
        "path": str(folder / SAMPLES),
        "sampling": got.sampling,
        "gyro_unit": "rad/s",
        "accel_unit": "m/s2",
        "time_unit": "s",
    }
    whole["axes"] = {}
    for name, rows in got.rows.items():
        if rows.count:
            path = folder / f"{name}.csv"
            rows.write(path)
            whole["aiding"][name]["path"] = str(path)
    if not all(rows.count for rows in got.rows.values()):
        # A measurement without rows cannot be withheld.
        whole.pop("withhold", None)
    commands = [one.model_dump(mode="json") for one in got.commands]
    whole["commands"] = [*whole.get("commands", []), *commands]
    return NavigationSpec.checked(whole)


# From lines to the pipeline: timely, late and invalid lines.


Array = NDArray[np.float64]


class Reception:
    """Pass the samples of lines to a pipeline, and record its input.

    A sample waits until one arrives that is `hold_s` later, by the stamps, not by a clock:
    measurements that arrive meanwhile are still in time, and the numbers do not depend on the load
    of the machine. Later ones are counted, not used; so a run over the recorded input gives the
    same numbers.

    Parameters
    ----------
    spec : NavigationSpec
        With `live`.
    show : callable
        Called with the output chunk of each sample.
    warn : callable
        Called with a finding for each first unused line of its kind.

    Attributes
    ----------
    tape : LatencyTape
        From the line that made a sample due to its state.
    unused : Counter
        Unused lines, by kind.
    late : Counter
        Measurement rows that arrived too late, by name.
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
    ) -> None:
        self._live = spec.live or LiveTable()
        self._chain, self._recording, self._clock = chain, recording, clock
        self._show, self._warn = show, warn
        self._gyro, self._accel = _turns(spec)
        self._state = chain.begin(self._live.sampling, "received.csv")
        given = spec.aiding
        self.rows = {
            aid.name: AidRows(aid, given[aid.name])
            for aid in chain.navigator.aids
            if isinstance(aid, TabulatedMeasurement)
        }
        self._origin = self._first = math.nan
        self._waiting: deque[tuple[float, Array]] = deque()
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
        """Stamps and values passed to the pipeline, body axes, (n, 7)."""
        return self._samples.rows

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
        """Process the waiting samples, and end the run of the pipeline."""
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
        self._waiting.append((time, values))
        self._newest = time
        # Stamps are rounded decimal fractions.
        while self._waiting and self._waiting[0][0] <= time - self._live.hold_s + SAME_INSTANT:
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
        self._samples = self._samples.and_then(np.concatenate([[stamp], values])[None, :])

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

    def _not_used(self, bad: BadLineError, line: ReceivedLine) -> None:
        self.unused[bad.kind] += 1
        if self.unused[bad.kind] == 1:
            self._warn(Finding("live.line-not-used", line=line.number, reason=bad.finding))


def _turns(spec: NavigationSpec) -> tuple[Array | None, Array | None]:
    """Rotation from sensor to body axes, of gyros and accelerometers."""
    gyro, accel = axes_matrices(spec.axes)
    if gyro is None and spec.axes.axes is not None:
        axis, sign = parse_axes(spec.axes.axes)
        gyro = accel = np.eye(3)[axis] * np.array(sign)[:, None]
    return gyro, accel
