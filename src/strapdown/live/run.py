"""A live run, from its first line to everything that a report tells."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator, Mapping
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from strapdown.config.choice import make_choice
from strapdown.config.navigation import NavigationSpec
from strapdown.config.navigation_modules import given_of, sensors_of
from strapdown.config.slots import SLOTS
from strapdown.errors import DataError, Finding, StrapdownError
from strapdown.live.clock import Clock
from strapdown.live.latency import Latency
from strapdown.live.received import write_received
from strapdown.live.reception import Reception
from strapdown.live.shown import StateLines
from strapdown.live.sources import LineSource
from strapdown.live.warm_up import warm_up
from strapdown.navigation.recorder import Recorder
from strapdown.systems.one_thread import one_thread
from strapdown.systems.progress import Progress, silent
from strapdown.systems.sins.build import make_chain
from strapdown.systems.sins.chain import Chain
from strapdown.systems.sins.drive import ChainRun, Recording, run_batch
from strapdown.systems.sins.result import NavigationResult
from strapdown.systems.sins.run import run_navigation
from strapdown.tables import ACCEL, GYRO
from strapdown.tables.checks import values_of

__all__ = ["LiveRun", "receive", "result_of"]


@dataclass(frozen=True, eq=False)
class LiveRun:
    """What was received, and what the chain made of it.

    Attributes
    ----------
    spec : NavigationSpec
    got : Reception
    run : ChainRun or None
        None where navigation never began.
    error : StrapdownError or None
        What ended it before its time.
    """

    spec: NavigationSpec
    got: Reception
    run: ChainRun | None
    error: StrapdownError | None

    @property
    def latency(self) -> Latency | None:
        """From the line that made a sample due to its state."""
        return self.got.tape.latency()

    def told(self) -> Mapping[str, Any]:
        """What ``latency.json`` says of it."""
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
    clock: Clock,
    write: Callable[[str], None],
    warn: Callable[[Finding], None],
    form: str = "json",
    every: float = 1.0,
) -> LiveRun:
    """Navigate by lines until they end, an ``end`` is commanded, or a signal comes.

    Parameters
    ----------
    spec : NavigationSpec
        With `live`, and without record (`live_spec`).
    source : LineSource
    clock : Clock
    write : callable
        Given each line of the state.
    warn : callable
        Given each finding.
    form, every
        As `StateLines`.

    Returns
    -------
    LiveRun

    Raises
    ------
    ConfigError
        The chain cannot be made.
    """
    with closing(source):
        chain = make_chain(spec, sensors_of(spec))
        recorder: Recorder = make_choice(spec.recorder, SLOTS["recorder"], given_of(spec))
        reader = _Reader(write)
        lines = StateLines(chain.navigator, reader.write, form, every)
        recording = Recording(chain, recorder)
        got = Reception(chain, spec, recording, clock, lines.take, warn)
        with _until_a_signal() as wanted:
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
) -> NavigationResult:
    """Write what was received, and return the result of the run over it.

    Parameters
    ----------
    live : LiveRun
        With a run.
    folder : Path
        For what was received.
    file : Path, optional
        The configuration.
    progress : callable, optional

    Returns
    -------
    NavigationResult
        Of the states that were computed while the samples came. Where the record would be read to
        other numbers, of the record: the result is always what can be run again.

    Raises
    ------
    StrapdownError
        As `run_navigation`.
    """
    spec = write_received(live.spec, live.got, folder)

    def same(
        chain: Chain,
        imu: pd.DataFrame,
        tables: Mapping[str, pd.DataFrame],
        recorder: Recorder,
        told: Progress,
    ) -> ChainRun:
        read = np.column_stack([imu.index.to_numpy(), values_of(imu, [*GYRO, *ACCEL])])
        if live.run is not None and np.array_equal(read, live.got.samples):
            return live.run
        return run_batch(chain, imu, tables, recorder, told)

    return run_navigation(spec, file, progress, same)


class _Reader:
    """Who reads the lines; when nobody does, the run ends."""

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
def _until_a_signal() -> Iterator[Callable[[], bool]]:
    """Let the first of SIGINT and SIGTERM end the run in good order; the next one ends it all."""
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
