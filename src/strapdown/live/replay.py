"""Replay a record to a pipeline sample by sample, each when it is due."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
import pandas as pd

from strapdown.errors import ConfigError
from strapdown.live.clock import Clock, MachineClock
from strapdown.live.latency import LatencyTape
from strapdown.live.warm_up import warm_up
from strapdown.navigation.measurements.measurement import Measurement
from strapdown.navigation.pipeline import NavigationPipeline
from strapdown.navigation.recorder import Recorder
from strapdown.navigation.replay import PipelineRun, Recording, pieces_by_sample
from strapdown.progress import Progress, silent
from strapdown.tables.checks import source_of

__all__ = ["Replay", "before_stamp", "parse_pace"]

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

    Raises
    ------
    ConfigError
        The text is not a pace.
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
    clock : Clock, optional
        That of the machine, if not given.
    """

    def __init__(self, pace: float, clock: Clock | None = None) -> None:
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
    """Time by which a measurement precedes its stamp, s: known offsets and delays.

    Parameters
    ----------
    aid : Aid
    """
    offset, delay = (float(getattr(aid, n, 0.0)) for n in ("time_offset", "velocity_delay"))
    return max(offset + delay, 0.0)
