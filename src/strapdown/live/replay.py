"""Replay a record by a clock, each sample when it is due: clock, latency, warm-up, replay."""

from __future__ import annotations

import math
import time
from array import array
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
import pandas as pd

from strapdown.constants import STANDARD_GRAVITY
from strapdown.errors import ConfigError, StrapdownError
from strapdown.nav_state import NavState
from strapdown.navigation.measurements.gnss import Gnss
from strapdown.navigation.measurements.measurement import Measurement
from strapdown.navigation.modes import KnownStart, Navigation
from strapdown.navigation.pipeline import NavigationPipeline
from strapdown.navigation.preprocessing import GapPolicy
from strapdown.navigation.recorder import Recorder
from strapdown.navigation.replay import PipelineRun, Recording, pieces_by_sample, run_by_sample
from strapdown.progress import Progress, silent
from strapdown.tables import gnss_table, imu_table
from strapdown.tables.checks import source_of

#: Possible delay of the end of a sleep, s; the remaining time is waited actively.
AWAKE = 1e-3


class RunClock(Protocol):
    """Monotonic time in seconds."""

    def now(self) -> float:
        """Seconds since an arbitrary instant."""

    def wait_until(self, instant: float) -> None:
        """Return at an instant, or at once if it is past."""


class MachineClock:
    """The monotonic clock of the machine."""

    def now(self) -> float:
        """Seconds since an arbitrary instant."""
        return time.perf_counter()

    def wait_until(self, instant: float) -> None:
        """Return at an instant, or at once if it is past."""
        left = instant - self.now()
        if left > AWAKE:
            time.sleep(left - AWAKE)
        while self.now() < instant:
            pass


# Latency from a sample to its state, and missed deadlines.


@dataclass(frozen=True)
class Latency:
    """Latency of the samples of a run.

    Attributes
    ----------
    median, most, largest : float, s
        From the delivery of a sample to its state; `most` is the 99th percentile.
    mean : float, s
    missed : int or None
        States later than the next sample's due time; None without due times.
    behind : float, s, or None
        The largest such delay.
    """

    samples: int
    median: float
    most: float
    largest: float
    mean: float
    missed: int | None
    behind: float | None

    def told(self) -> Mapping[str, float | int | None]:
        """Values by names with units, as in ``latency.json``."""
        return {
            "samples": self.samples,
            "median_ms": _ms(self.median),
            "p99_ms": _ms(self.most),
            "largest_ms": _ms(self.largest),
            "mean_ms": _ms(self.mean),
            "missed_deadlines": self.missed,
            "largest_behind_ms": None if self.behind is None else _ms(self.behind),
        }


def _ms(seconds: float) -> float:
    return round(1e3 * seconds, 6)


#: Latencies that are kept, of all samples until there are more, then evenly of one in 2, 4, …
KEPT = 1 << 16


class LatencyTape:
    """Collect the times of delivery and of the state of each sample, in bounded memory.

    Quantiles beyond 65 536 samples are of every second, fourth, … sample; all else is of all.
    """

    def __init__(self) -> None:
        self._took = array("d")
        self._each = 1
        self._count = self._due = self._missed = 0
        self._sum, self._largest, self._behind = 0.0, -math.inf, -math.inf

    def take(self, delivered: float, done: float, deadline: float = math.nan) -> None:
        """Add one sample.

        Parameters
        ----------
        delivered, done : float, s
        deadline : float, s
            Due time of the next sample, by which the state is needed; NaN without due times.
        """
        took, late = done - delivered, done - deadline
        if self._count % self._each == 0:
            self._took.append(took)
            if len(self._took) == KEPT:
                self._took, self._each = self._took[::2], 2 * self._each
        self._count += 1
        self._sum += took
        self._largest = max(self._largest, took)
        if math.isfinite(late):
            self._due += 1
            self._missed += late > 0.0
            self._behind = max(self._behind, late)

    def latency(self) -> Latency | None:
        """Return the collected latency; None without samples."""
        if not self._count:
            return None
        return Latency(
            samples=self._count,
            median=float(np.median(self._took)),
            most=float(np.percentile(self._took, 99.0)),
            largest=self._largest,
            mean=self._sum / self._count,
            missed=self._missed if self._due else None,
            behind=max(self._behind, 0.0) if self._due else None,
        )


# Compile and load everything before the first sample.


#: Samples of a rest: more than a preprocessor needs before the first step.
ROWS, STEP = 80, 0.01


def warm_up(chain: NavigationPipeline, sampling: str = "mean") -> None:
    """Navigate a rest of less than a second with a copy of a pipeline, and discard the result.

    Parameters
    ----------
    sampling : {'instantaneous', 'mean'}
    """
    time = STEP * np.arange(ROWS)
    force = np.tile([0.0, 0.0, -STANDARD_GRAVITY], (ROWS, 1))
    # Some detectors do not accept constant readings as a rest.
    force[1::2, 0] += 1e-3
    imu = imu_table(time, 1e-5 * force[:, [0, 0, 0]], force, sampling=sampling)
    here = NavState.from_degrees(45.0, 20.0, 0.0)
    start = KnownStart(here, (10.0,) * 3, (1.0,) * 3, (1.0,) * 3, at_first_sample=True)
    own = replace(
        chain,
        modes=(Navigation(),),
        start=start,
        commands=(),
        intake=replace(chain.intake, gaps=GapPolicy()),
    )
    # An error on this rest does not mean an error on the record.
    with suppress(StrapdownError):
        run_by_sample(own, imu, _fixes(chain))


def _fixes(chain: NavigationPipeline) -> dict[str, pd.DataFrame]:
    """Two fixes of each receiver, the first in the middle of the rest."""
    at = 0.5 * ROWS * STEP
    return {
        aid.name: gnss_table(
            np.array([at, at + 2.0 * STEP]) + aid.time_offset,
            np.tile([45.0, 20.0, 0.0], (2, 1)),
            np.zeros((2, 3)),
            (1.0,) * 3,
            (0.1,) * 3,
            np.full(2, float(aid.qualities[0])),
        )
        for aid in chain.navigator.aids
        if isinstance(aid, Gnss)
    }


# Replay a record to a pipeline sample by sample, each when it is due.


#: Interval of progress reports, s of the record.
TOLD = 1.0


def parse_pace(text: str) -> float:
    """Parse a pace.

    Parameters
    ----------
    text : str
        Seconds of the record per second; ``max`` for as many as possible.

    Returns
    -------
    float
        Infinite for ``max``.
    """
    if text.strip().lower() == "max":
        return math.inf
    try:
        pace = float(text)
    except ValueError:
        pace = math.nan
    if not 0.0 < pace < math.inf:
        raise ConfigError("live.bad-pace", quantity="--pace", text=text)
    return pace


class Replay:
    """Run a pipeline by a clock; passed to `run_navigation` instead of `run_batch`.

    A sample is delivered when its stamp is due, or as soon as the one before it is processed;
    measurement rows precede the first sample that is not before them. The numbers equal those of
    `run_batch` to the last bit.

    Parameters
    ----------
    pace : float
        Seconds of the record per second; infinite for no limit.
    clock : RunClock, optional
        That of the machine, if not given.
    """

    def __init__(self, pace: float, clock: RunClock | None = None) -> None:
        self.pace = pace
        self.tape = LatencyTape()
        self._clock = clock or MachineClock()

    def __call__(
        self,
        chain: NavigationPipeline,
        imu: pd.DataFrame,
        tables: Mapping[str, pd.DataFrame] | None = None,
        recorder: Recorder | None = None,
        progress: Progress = silent,
    ) -> PipelineRun:
        """Run a pipeline, as `navigation.replay.run_batch`."""
        warm_up(chain, imu.attrs["sampling"])
        recording, clock = Recording(chain, recorder), self._clock
        stamps = imu.index.to_numpy(dtype=np.float64)
        pieces = pieces_by_sample(chain, imu, tables, _ahead(chain, tables or {}))
        begin, told = clock.now(), -math.inf
        due = begin + (stamps - stamps[0]) / self.pace
        length = max(float(stamps[-1] - stamps[0]), 1e-9)
        for k, stamp in enumerate(stamps.tolist()):
            clock.wait_until(float(due[k]))
            delivered = clock.now()
            piece = next(pieces)
            recording.take(piece)
            done = clock.now()
            follows = self.pace < math.inf and k + 1 < len(stamps)
            self.tape.take(delivered, done, float(due[k + 1]) if follows else math.nan)
            if stamp >= told + TOLD:
                told = stamp
                progress(piece.mode, (stamp - float(stamps[0])) / length)
        return recording.run(source_of(imu))


def _ahead(chain: NavigationPipeline, tables: Mapping[str, pd.DataFrame]) -> float:
    """Time by which rows must precede their stamps, as they may measure an earlier instant."""
    return max((before_stamp(chain.navigator.by_name[name]) for name in tables), default=0.0)


def before_stamp(aid: Measurement) -> float:
    """Time by which a measurement precedes its stamp, s: known offsets and delays."""
    offset, delay = (float(getattr(aid, n, 0.0)) for n in ("time_offset", "velocity_delay"))
    return max(offset + delay, 0.0)
