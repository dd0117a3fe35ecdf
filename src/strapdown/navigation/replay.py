"""Run a pipeline over a whole record in chunks, or sample by sample."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.constants import STANDARD_GRAVITY
from strapdown.errors import ConfigError, DivergenceError
from strapdown.navigation.engine import SAME_INSTANT
from strapdown.navigation.modes import Aligned, PipelineChunk
from strapdown.navigation.pipeline import NavigationPipeline, PipelineState
from strapdown.navigation.record import Event, NavigationRecord, Span
from strapdown.navigation.recorder import FullRecorder, Recorder
from strapdown.navigation.smoother import Smoothing
from strapdown.progress import Progress, silent
from strapdown.sensors.uncertainty import ImuUncertainty
from strapdown.tables import ACCEL, GYRO, check_imu, on_disk
from strapdown.tables.checks import check_columns, source_of, values_of

Array = NDArray[np.float64]

#: Length of a chunk of a record, s.
CHUNK = 60.0
CHANNELS = [*GYRO, *ACCEL]
#: Share of a variance from which on what is neglected counts.
COUNTS = 0.1
#: Change of smoothed states, in standard deviations, at which passes end: of the change by the next
#: one it is of second order.
SETTLED = 0.1


@dataclass(frozen=True, eq=False)
class PipelineRun:
    """Result of a pipeline run.

    Attributes
    ----------
    aligned : tuple of Aligned
        Result of each alignment mode.
    smoothed : NavigationRecord or None
        Smoothed solution, where the navigator has a smoother.
    smoothing : Smoothing or None
        Of which it is.
    moved : float
        By how many standard deviations the last pass moved the smoothed states (`Smoothing.moved`);
        zero without another pass.
    """

    record: NavigationRecord
    aligned: tuple[Aligned, ...]
    smoothed: NavigationRecord | None = None
    smoothing: Smoothing | None = None
    moved: float = 0.0


class Recording:
    """Collect the output chunks of a pipeline in a recorder.

    Parameters
    ----------
    recorder : Recorder, optional
        All samples, if not given.
    """

    def __init__(self, chain: NavigationPipeline, recorder: Recorder | None = None) -> None:
        smoother = chain.navigator.smoother
        self._smoothing = None if smoother is None else smoother.begin(chain.navigator)
        self._tape = (recorder or FullRecorder()).begin(chain.navigator)
        self._aligned: list[Aligned] = []
        self._events: list[Event] = []
        self._modes: list[Span] = []
        self._outages: list[tuple[str, Span]] = []

    def take(self, piece: PipelineChunk) -> None:
        """Append a chunk."""
        for navigation in piece.navigation:
            self._tape.take(navigation)
            if self._smoothing is not None:
                self._smoothing.take(navigation)
        self._aligned += piece.aligned
        self._events += piece.events
        self._modes += piece.modes
        self._outages += piece.outages

    def run(self, source: str | None = None) -> PipelineRun:
        """Return the collected run.

        Parameters
        ----------
        source : str, optional
            Name for messages.
        """
        names = dict.fromkeys(name for name, _ in self._outages)
        record = partial(
            self._tape.record,
            source,
            events=tuple(sorted(self._events, key=lambda one: one.time)),
            modes=tuple(self._modes),
            outages={
                name: tuple(span for of, span in self._outages if of == name) for name in names
            },
        )
        smoothed = None
        if self._smoothing is not None:
            on_disk.tidy()
            smoothed = record(smoothing=self._smoothing)
            self._smoothing.release()
            on_disk.tidy()
        return PipelineRun(record(), tuple(self._aligned), smoothed, self._smoothing)


def run_batch(
    chain: NavigationPipeline,
    imu: pd.DataFrame,
    tables: Mapping[str, pd.DataFrame] | None = None,
    recorder: Recorder | None = None,
    progress: Progress = silent,
    chunk: float = CHUNK,
) -> PipelineRun:
    """Run a pipeline over a record.

    Parameters
    ----------
    imu : DataFrame
        Imu table.
    tables : mapping of str to DataFrame, optional
        By name of the measurement.
    recorder : Recorder, optional
        All samples, if not given.
    progress : callable, optional
        Called with the mode and the share that is done.
    chunk : float, s
        Length of the chunks of the record; limits the size of copies.
    """
    recording = Recording(chain, recorder)
    begin, end = float(imu.index[0]), float(imu.index[-1])
    for piece in pieces_of(chain, imu, tables, chunk):
        recording.take(piece)
        share = (piece.time - begin) / max(end - begin, 1e-9)
        progress(piece.mode, float(np.clip(share, 0.0, 1.0)))
    return recording.run(source_of(imu))


def relinearized(
    chain: NavigationPipeline,
    imu: pd.DataFrame,
    tables: Mapping[str, pd.DataFrame] | None,
    recorder: Recorder | None,
    run: PipelineRun,
    progress: Progress = silent,
    chunk: float = CHUNK,
    *,
    filtered: bool = False,
) -> PipelineRun:
    """Repeat a smoothed run about its smoothed states, until these stay where they are.

    Parameters
    ----------
    chain, imu, tables, recorder, progress, chunk
        As `run_batch`.
    run : PipelineRun
        Of this pipeline over this record.
    filtered : bool
        The filter's solution is that of the last pass, too, as `starts_far` wants it.

    Returns
    -------
    PipelineRun
        With another smoothed solution; otherwise what the filter found remains. A pass that
        diverges, or moves farther than the one before, ends it: its result is not used.
    """
    smoother, moved = chain.navigator.smoother, math.inf
    for _ in range(smoother.passes - 1 if smoother is not None else 0):
        about = run.smoothing.reference() if run.smoothing is not None else None
        if about is None:
            return run
        again = replace(chain, navigator=replace(chain.navigator, about=about))
        try:
            found = run_batch(again, imu, tables, recorder, progress, chunk)
        except DivergenceError:
            return replace(run, moved=math.inf)
        assert found.smoothed is not None
        assert found.smoothing is not None
        assert run.smoothed is not None
        before, moved = moved, found.smoothing.moved()
        if moved > before:
            return replace(run, moved=moved)
        own = replace(found.smoothed, innovations=run.smoothed.innovations)
        on_disk.tidy()
        own = replace(own, events=run.smoothed.events, outages=run.smoothed.outages)
        record = run.record
        if filtered:
            record = replace(found.record, events=record.events, outages=record.outages)
        run = replace(run, record=record, smoothed=own, smoothing=found.smoothing, moved=moved)
        if moved < SETTLED:
            return run
    return run


def starts_far(record: NavigationRecord, sensors: ImuUncertainty) -> bool:
    """Return whether navigation begins with an attitude too uncertain for a linear filter.

    The filter then takes its corrections for knowledge: what is observed before and after them is
    of different trajectories, and the tilt against the bias that hides it seems to be observed
    (Huang, Mourikis and Roumeliotis, Int. J. Robotics Research 29 (2010) 502). A correction of the
    tilts x and y changes gravity along the vertical axis by ``g (x² + y²)/2``, and one of the
    heading z turns a tilt away from its bias, ``g x z`` and ``g y z``. Their variance
    ``g² (tr(T²)/2 + tr(T) H)``, with the covariance T of the tilts and the variance H of the
    heading, counts beside that of the accelerometers from a tenth of it on. Of a tilt by their
    biases alone that is a heading unknown by 13 deg.

    Parameters
    ----------
    record : NavigationRecord
        Of the filter.
    sensors : ImuUncertainty
    """
    P = record.covariance[0]
    tilt, heading = P[6:8, 6:8], float(P[8, 8])
    force = np.array([0.0, 0.0, -STANDARD_GRAVITY])
    known = sensors.accel_bias_variance() + sensors.accel.variance_by_input(force)
    second = 0.5 * float(np.sum(tilt * tilt)) + float(np.trace(tilt)) * heading
    return STANDARD_GRAVITY**2 * second > COUNTS * float(known.mean())


def run_by_sample(
    chain: NavigationPipeline,
    imu: pd.DataFrame,
    tables: Mapping[str, pd.DataFrame] | None = None,
    recorder: Recorder | None = None,
    ahead: float = 0.0,
) -> PipelineRun:
    """Run a pipeline over a record as in real time: sample by sample, each fix when it is due.

    Parameters
    ----------
    chain, imu, tables, recorder
        As `run_batch`, whose numbers it reproduces to the last bit.
    ahead : float, s
        Time by which table rows precede the samples of their stamps; at least the known delay of a
        measurement with late stamps.
    """
    recording = Recording(chain, recorder)
    for piece in pieces_by_sample(chain, imu, tables, ahead):
        recording.take(piece)
    return recording.run(source_of(imu))


def pieces_of(
    chain: NavigationPipeline,
    imu: pd.DataFrame,
    tables: Mapping[str, pd.DataFrame] | None = None,
    chunk: float = CHUNK,
) -> Iterator[PipelineChunk]:
    """Run a pipeline over a record in chunks, and yield the output chunks; see `run_batch`."""
    if not chunk > 0.0:
        raise ConfigError("navigation.chunk-not-positive", quantity="chunk", chunk=chunk)
    check_columns(imu, CHANNELS, source_of(imu))
    state = _begun(chain, imu)
    for name, table in (tables or {}).items():
        state = chain.tell(state, name, table)
    time = imu.index.to_numpy(dtype=np.float64)
    span = max(float(time[-1] - time[0]), 0.0) if len(time) else 0.0
    size = len(time) if span <= chunk else max(1, int(len(time) * chunk / span))
    for at in range(0, len(time), size):
        last = at + size >= len(time)
        values = values_of(imu.iloc[at : at + size], CHANNELS)
        on_disk.let_go(imu)
        state, piece = chain.advance(state, time[at : at + size], values, last)
        yield piece


def pieces_by_sample(
    chain: NavigationPipeline,
    imu: pd.DataFrame,
    tables: Mapping[str, pd.DataFrame] | None = None,
    ahead: float = 0.0,
    each: Callable[[PipelineState, float], PipelineState] | None = None,
) -> Iterator[PipelineChunk]:
    """Run a pipeline sample by sample; see `run_by_sample`.

    Parameters
    ----------
    chain, imu, tables, ahead
        As `run_by_sample`.
    each : callable, optional
        Called with the state and the stamp before each sample; returns the state. Commands are
        given here.
    """
    check_columns(imu, CHANNELS, source_of(imu))
    state = _begun(chain, imu)
    tables = tables or {}
    stamps = {name: table.index.to_numpy(dtype=np.float64) for name, table in tables.items()}
    told = dict.fromkeys(tables, 0)
    time, values = imu.index.to_numpy(dtype=np.float64), values_of(imu, CHANNELS)
    for k in range(len(time)):
        for name, table in tables.items():
            upto = time[k] + ahead + SAME_INSTANT
            first, end = told[name], int(stamps[name].searchsorted(upto, side="right"))
            if end > first:
                rows = table.iloc[first:end]
                rows.attrs = dict(table.attrs)
                state = chain.tell(state, name, rows)
                told[name] = end
        if each is not None:
            state = each(state, float(time[k]))
        last = k + 1 == len(time)
        state, piece = chain.advance(state, time[k : k + 1], values[k : k + 1], last)
        yield piece


def _begun(chain: NavigationPipeline, imu: pd.DataFrame) -> PipelineState:
    check_imu(imu)
    return chain.begin(imu.attrs["sampling"], source_of(imu))
