"""What every prefilter is: samples in, fewer and better ones out, in segments of any length."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.dsp.samples import even_step
from strapdown.errors import ConfigError, DataError
from strapdown.prefilter.report import Changed, PrefilterReport, report_of
from strapdown.tables import ACCEL, GYRO, MOTION, check_imu, check_motion_increments
from strapdown.tables.checks import index_of, source_of, values_of

Array = NDArray[np.float64]

__all__ = ["CHANNELS", "Grid", "Portion", "Prefilter", "Prefiltered", "grid_of", "whole_factor"]

CHANNELS = [*GYRO, *ACCEL]
# Samples that are taken at a time: memory stays small, and a record is always in pieces.
PIECE = 32_768


@dataclass(frozen=True)
class Grid:
    """Even stamps of a record's samples.

    Attributes
    ----------
    start : float, s
        Stamp of the first.
    step : float, s
    means : bool
        Whether a sample is the mean over the step that ends at its stamp.
    """

    start: float
    step: float
    means: bool

    def time(self, number: int | NDArray[np.int64]) -> Any:
        """Stamp of a sample, counted from zero."""
        return self.start + self.step * number


@dataclass(frozen=True, eq=False)
class Portion:
    """What came out of a segment.

    Attributes
    ----------
    time : ndarray, (m,), s
    values : ndarray, (m, c)
        Samples at these stamps, of `Prefilter.sampling`.
    rows : ndarray, (m, 10) or (0, 10)
        Motion increments that end at these stamps, of a prefilter that makes them itself.
    changed : Changed
    """

    time: Array
    values: Array
    rows: Array
    changed: Changed


@dataclass(frozen=True, eq=False)
class Prefiltered:
    """A record after a prefilter.

    Attributes
    ----------
    imu : DataFrame
        Imu table.
    increments : DataFrame
        MotionIncrements table over the same time: what a mechanization takes.
    report : PrefilterReport
    """

    imu: pd.DataFrame
    increments: pd.DataFrame
    report: PrefilterReport


@dataclass(frozen=True)
class Prefilter(ABC):
    """Turns samples of a high rate into those that are navigated by; it holds no state."""

    name: ClassVar[str]
    summary: ClassVar[str]
    source: ClassVar[str]

    @abstractmethod
    def begin(self, grid: Grid, channels: int = 6) -> Any:
        """Return the state before the first sample.

        Parameters
        ----------
        grid : Grid
        channels : int
            Three gyros, and three accelerometers if there are.
        """

    @abstractmethod
    def advance(self, state: Any, values: Array, last: bool = False) -> tuple[Any, Portion]:
        """Take a further segment of samples.

        Parameters
        ----------
        state
            Of `begin` or an earlier call; it is not changed.
        values : ndarray, (k, c)
            rad/s and m/s²; k may be one.
        last : bool
            Whether the record ends with them: what waits for later samples is given as well as
            it can be.

        Returns
        -------
        state
        portion : Portion
            The same numbers, to the bit, however the record is cut.
        """

    @abstractmethod
    def figures(self, grid: Grid) -> dict[str, float]:
        """What it does to time, noise and frequencies: the floats of `PrefilterReport`."""

    @abstractmethod
    def sampling(self, grid: Grid) -> str:
        """What the outputs are: 'instantaneous' or 'mean'."""

    def apply(self, imu: pd.DataFrame) -> Prefiltered:
        """Filter a record.

        Parameters
        ----------
        imu : DataFrame
            Imu table with even stamps, with or without accelerometers.

        Returns
        -------
        Prefiltered

        Raises
        ------
        DataError
            A value is not finite, stamps are not even, or the record is too short.
        """
        check_imu(imu)
        source = source_of(imu)
        columns = [c for c in CHANNELS if c in imu.columns]
        grid = grid_of(imu)
        values = values_of(imu, columns)
        state, portions = self.begin(grid, len(columns)), []
        for k in range(0, len(values), PIECE):
            state, portion = self.advance(state, values[k : k + PIECE], k + PIECE >= len(values))
            portions.append(portion)
        time, out, rows = (
            np.concatenate([getattr(p, name) for p in portions])
            for name in ("time", "values", "rows")
        )
        changed = Changed.joined([p.changed for p in portions])
        if len(time) < 2:
            raise DataError(
                "prefilter.too-few-samples",
                file=source,
                quantity="time",
                count=len(values),
                step=grid.step * len(values),
                count_2=len(time),
                name=self.name,
                figures=self.figures(grid)["delay"],
            )
        table = pd.DataFrame(out, index=pd.Index(time, name="time"), columns=columns)
        table.attrs = {**imu.attrs, "sampling": self.sampling(grid)}
        report = report_of(
            self.name, self.figures(grid), grid, changed, columns, len(values), source
        )
        return Prefiltered(table, self._increments(table, rows), report)

    def _increments(self, table: pd.DataFrame, rows: Array) -> pd.DataFrame:
        from strapdown.increments import motion_increments

        if not len(rows):
            if ACCEL[0] not in table.columns:
                return pd.DataFrame(columns=MOTION, dtype=float)
            return motion_increments(table, interpolation="cubic")
        out = pd.DataFrame(rows, index=table.index.copy(), columns=MOTION)
        out.attrs["source"] = source_of(table)
        check_motion_increments(out)
        return out


def grid_of(imu: pd.DataFrame) -> Grid:
    """Even stamps of a table.

    Raises
    ------
    DataError
        They are not even: the row is named.
    """
    time = index_of(imu)
    try:
        step = even_step(time)
    except DataError as error:
        raise error.replaced(file=source_of(imu)) from None
    return Grid(float(time[0]), step, imu.attrs["sampling"] == "mean")


def whole_factor(rate: float, grid: Grid, name: str) -> int:
    """Samples per output.

    Raises
    ------
    ConfigError
        The rate does not divide that of the samples.
    """
    own = 1.0 / grid.step
    if not (math.isfinite(rate) and rate > 0.0):
        raise ConfigError("prefilter.rate-not-positive", quantity="rate", rate=rate)
    factor = round(own / rate)
    if factor < 1 or abs(own / rate - factor) > 1e-3 * factor:
        near = own / max(1, factor)
        raise ConfigError(
            "prefilter.rate-not-a-whole-part",
            quantity="rate",
            name=name,
            rate=rate,
            own=own,
            near=near,
        )
    return factor
