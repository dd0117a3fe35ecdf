"""Live run from its first line to all results of a report."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import closing, contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from strapdown.config.alignment import sensors_of
from strapdown.config.navigation import NavigationSpec
from strapdown.errors import DataError, Finding, StrapdownError
from strapdown.formats.clocks import RELATIVE, Clock
from strapdown.formats.gnss_fixes import GnssOptions, table_of_fixes
from strapdown.formats.live_journal import JOURNAL, event_streams, fixes_of, records, run_of
from strapdown.formats.sensor_streams import Event, Joined, Located
from strapdown.formats.writers import WRITERS
from strapdown.formats.writing import FileOptions
from strapdown.live.journal import Journal, Said, said_of
from strapdown.live.lines import Measured, Sample, StateLines, Word
from strapdown.live.reception import Reception
from strapdown.live.replay import Latency, MachineClock, RunClock, warm_up
from strapdown.live.sources import LineSource, ReceivedLine
from strapdown.navigation.measurements.gnss import Gnss
from strapdown.navigation.pipeline import NavigationPipeline
from strapdown.navigation.recorder import Recorder
from strapdown.navigation.replay import PipelineRun, Recording, run_batch
from strapdown.progress import Progress, silent
from strapdown.systems.navigation_run import Drive, NavigationRun, make_chain, run_navigation
from strapdown.systems.one_thread import one_thread
from strapdown.tables import ACCEL, GNSS, GYRO
from strapdown.tables.checks import values_of


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
            "gaps": self.got.gaps,
            **({"replayed": self.got.replayed} if self.got.replayed else {}),
        }


@one_thread()
def receive(
    spec: NavigationSpec,
    source: LineSource | None,
    clock: RunClock,
    write: Callable[[str], None],
    warn: Callable[[Finding], None],
    form: str = "json",
    every: float = 1.0,
    journal: Journal | None = None,
) -> LiveRun:
    """Navigate by lines until they end, an ``end`` command, or a signal.

    Parameters
    ----------
    spec : NavigationSpec
        With `live`, and without a record (`live_spec`).
    source : LineSource or None
        None for what the journal has, and no more.
    write : callable
        Called with each line of the state that follows from a received line.
    warn : callable
        Called with each finding.
    form, every
        As `StateLines`.
    journal : Journal, optional
        Takes what is received before it is used; what it has already is processed first.
    """
    with closing(source) if source is not None else nullcontext():
        chain = make_chain(spec, sensors_of(spec))
        recorder: Recorder = spec.recorder.make(ellipsoid=spec.ellipsoid)
        reader = _Reader(write)
        lines = StateLines(chain.navigator, reader.write, form, every)
        recording = Recording(chain, recorder)
        got = Reception(chain, spec, recording, clock, lines.take, warn, journal)
        if journal is not None:
            journal.warn = warn
        if journal is not None:
            reader.muted = True
            got.replay(said_by_phone(journal.run, journal.said(), phone_aid(chain)))
            reader.muted = False
            lines.begin()
        with until_a_signal() as wanted:
            if source is not None and got.error is None:
                got.token = source.token
                warm_up(chain, got.sampling)
                warn(Finding("live.listening", severity="note", source=source.name))
                source.begin()
                for line in received_lines(source, lambda: wanted() and reader.there):
                    if not got.take(line):
                        break
    try:
        got.finish()
        return LiveRun(spec, got, recording.run("received.csv"), got.error)
    except DataError as error:
        return LiveRun(spec, got, None, got.error or error)


def phone_aid(chain: NavigationPipeline) -> str | None:
    """Return the name of the receiver that the fixes of a phone are measurements of."""
    return next((aid.name for aid in chain.navigator.aids if isinstance(aid, Gnss)), None)


def said_by_phone(
    run: Mapping[str, Any], held: Iterable[Said], aid: str | None
) -> Iterator[Sample | Measured | Word]:
    """Yield what a journal holds, the events of a phone joined as when they arrived."""
    streams = event_streams(dict(run))
    for said in held:
        if not isinstance(said, Event):
            yield said
            continue
        for row in streams.take(said):
            if (one := as_said(row, aid)) is not None:
                yield one
    for row in streams.finish():
        if (one := as_said(row, aid)) is not None:
            yield one


@one_thread()
def replay_session(folder: Path, warn: Callable[[Finding], None]) -> LiveRun:
    """Navigate again what a session of `strapdown live` received, with its configuration.

    Parameters
    ----------
    folder : Path
        Of the session.
    warn : callable
        Called with each finding.

    Returns
    -------
    LiveRun
        With the states that were shown, to the bit.
    """
    run = run_of(folder)
    spec = NavigationSpec.checked(run["configuration"])
    chain = make_chain(spec, sensors_of(spec))
    recorder: Recorder = spec.recorder.make(ellipsoid=spec.ellipsoid)
    recording = Recording(chain, recorder)
    got = Reception(chain, spec, recording, MachineClock(), lambda piece: None, warn)
    payloads = (payload for _, _, payload in records(folder / JOURNAL))
    got.replay(said_by_phone(run, said_of(payloads), phone_aid(chain)))
    try:
        got.finish()
        return LiveRun(spec, got, recording.run("received.csv"), got.error)
    except DataError as error:
        return LiveRun(spec, got, None, got.error or error)


def as_said(row: Joined | Located, aid: str | None) -> Sample | Measured | None:
    """Return a sample or a fix of a phone as a line would say it; None of a fix without use."""
    if isinstance(row, Joined):
        return Sample(row.time, (*row.gyro, *row.accel))
    if aid is None:
        return None
    try:
        table = table_of_fixes(fixes_of([row], aid, Clock(RELATIVE)), GnssOptions())
    except DataError:  # without a usable position
        return None
    values = {str(name): float(table[name].iloc[0]) for name in GNSS}
    return Measured(aid, row.time, values)


def received_lines(source: LineSource, wanted: Callable[[], bool]) -> Iterator[ReceivedLine]:
    """Yield the lines of a source to its end, or as long as they are wanted."""
    while wanted():
        try:
            line = source.next()
        except TimeoutError:
            continue
        if line is None:
            return
        yield line


def result_of(
    live: LiveRun,
    folder: Path,
    file: Path | None = None,
    progress: Progress = silent,
    drive: Drive | None = None,
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
    drive : callable, optional
        Runs the pipeline over the received input once more, as `run_batch`; to replay it.

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

    return run_navigation(spec, file, progress, same if drive is None else drive)


class _Reader:
    """Reader of the state lines; when it closes the pipe, the run ends."""

    def __init__(self, write: Callable[[str], None]) -> None:
        self._write = write
        self.there = True
        #: While what was written before a kill is repeated.
        self.muted = False

    def write(self, text: str) -> None:
        try:
            if self.there and not self.muted:
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


def live_spec(spec: NavigationSpec, axes: str | None = None) -> NavigationSpec:
    """Return a specification that reads from lines instead of files.

    Parameters
    ----------
    spec : NavigationSpec
        With ``[live]``, or of a record, whose files are then ignored.
    axes : str, optional
        Axes of the device, where the specification states none.
    """
    whole = _plain(spec)
    if axes is not None and not whole.get("axes"):
        whole["axes"] = {"axes": axes}
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
