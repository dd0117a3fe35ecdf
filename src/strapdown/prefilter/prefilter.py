"""Common base of all prefilters: screened, decimated samples from chunks of any length."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.constants import Indices
from strapdown.dsp.outliers import KEPT, REPLACED, Screened
from strapdown.dsp.samples import check_segment, even_step
from strapdown.errors import ConfigError, DataError, Finding, add_note, add_warning
from strapdown.tables import ACCEL, GYRO, MOTION, check_imu, check_motion_increments
from strapdown.tables.checks import Array, index_of, source_of, values_of

CHANNELS = [*GYRO, *ACCEL]
# Samples processed at a time. This bounds memory, and every record is processed in chunks.
PIECE = 32_768


@dataclass(frozen=True)
class Grid:
    """Evenly spaced stamps of the samples of a record.

    Attributes
    ----------
    start : float, s
        Stamp of the first sample.
    step : float, s
    means : bool
        Whether a sample is the mean over the step ending at its stamp.
    """

    start: float
    step: float
    means: bool

    def time(self, number: int | NDArray[np.int64]) -> Any:
        """Stamp of a sample, counted from zero, s."""
        return self.start + self.step * number


@dataclass(frozen=True, eq=False)
class Portion:
    """Output of one chunk.

    Attributes
    ----------
    time : ndarray, (m,), s
    values : ndarray, (m, c)
        Samples at these stamps, of the kind given by `Prefilter.sampling`.
    rows : ndarray, (m, 10) or (0, 10)
        Motion increments ending at these stamps, if the prefilter forms them itself.
    """

    time: Array
    values: Array
    rows: Array
    changed: Changed


@dataclass(frozen=True, eq=False)
class Prefiltered:
    """A prefiltered record.

    Attributes
    ----------
    imu : DataFrame
        Imu table.
    increments : DataFrame
        MotionIncrements table over the same time, the input of a mechanization.
    """

    imu: pd.DataFrame
    increments: pd.DataFrame
    report: PrefilterReport


@dataclass(frozen=True)
class Prefilter(ABC):
    """Reduce samples of a high rate to the navigation rate; holds no state."""

    name: ClassVar[str]
    summary: ClassVar[str]
    source: ClassVar[str]

    @abstractmethod
    def begin(self, grid: Grid, channels: int = 6) -> Any:
        """Return the state before the first sample.

        Parameters
        ----------
        channels : int
            Three gyros, then three accelerometers if present.
        """

    @abstractmethod
    def advance(self, state: Any, values: Array, last: bool = False) -> tuple[Any, Portion]:
        """Process a further chunk of samples.

        Parameters
        ----------
        state
            From `begin` or an earlier call; not changed.
        values : ndarray, (k, c)
            rad/s and m/s²; k may be one.
        last : bool
            Whether the record ends here; outputs still waiting for later samples are then completed
            without them.

        Returns
        -------
        state
        portion : Portion
            Bit-identical however the record is divided.
        """

    @abstractmethod
    def figures(self, grid: Grid) -> dict[str, float]:
        """Delay, latency, noise factor and band of the filter: the floats of `PrefilterReport`."""

    @abstractmethod
    def sampling(self, grid: Grid) -> str:
        """Kind of the output samples: 'instantaneous' or 'mean'."""

    def apply(self, imu: pd.DataFrame) -> Prefiltered:
        """Filter a record.

        Parameters
        ----------
        imu : DataFrame
            Imu table with even stamps, with or without accelerometers.

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
    """Return the evenly spaced stamps of a table."""
    time = index_of(imu)
    try:
        step = even_step(time)
    except DataError as error:
        raise error.replaced(file=source_of(imu)) from None
    return Grid(float(time[0]), step, imu.attrs["sampling"] == "mean")


def whole_factor(rate: float, grid: Grid, name: str) -> int:
    """Samples per output."""
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


# Report of a prefilter: changed samples, and its effect on time, noise and frequencies.


# Flagged samples with fewer samples between them belong to one event.
APART = 32
# A larger share of outliers is not a rare fault.
USUAL_SHARE = 0.01
# Events of one channel that are listed individually.
MOST_TOLD = 3


@dataclass(frozen=True, eq=False)
class Changed:
    """Outlying samples of a chunk.

    Attributes
    ----------
    number : ndarray of int64, (k,)
        Sample number, from zero.
    channel : ndarray of int64, (k,)
    value, by : ndarray, (k,)
        Measured value and its replacement; equal where the sample was kept.
    flag : ndarray of int8, (k,)
    """

    number: Indices
    channel: Indices
    value: Array
    by: Array
    flag: NDArray[np.int8]

    @classmethod
    def none(cls) -> Changed:
        """No outliers."""
        no = np.empty(0, dtype=np.int64)
        return cls(no, no, np.empty(0), np.empty(0), np.empty(0, np.int8))

    @classmethod
    def of(cls, part: Screened) -> Changed:
        """Outliers of one chunk."""
        row, channel = np.nonzero(part.flags)
        at = (row, channel)
        return cls(row + part.first, channel, part.raw[at], part.values[at], part.flags[at])

    @classmethod
    def joined(cls, parts: Sequence[Changed]) -> Changed:
        """Outliers of several chunks."""
        names = ("number", "channel", "value", "by", "flag")
        return cls(*(np.concatenate([getattr(p, n) for p in parts]) for n in names))


@dataclass(frozen=True, eq=False)
class PrefilterReport:
    """Changes that a prefilter made to a record.

    Attributes
    ----------
    delay : float, s
        Group delay of the filter, the same for all channels and frequencies; the output stamps are
        corrected for it.
    latency : float, s
        From an output's stamp to the last sample it needs.
    noise_factor : float
        Standard deviation of an output divided by that of the samples, for white noise.
    passband, stopband : float, Hz
        Gain 1 up to `passband` and 0 from `stopband` on, both to within `attenuation`.
    attenuation : float, dB
    replaced : DataFrame
        One row per replaced sample: time (s), row (from 1), channel, value, by.
    kept : DataFrame
        As `replaced`, for outlying samples that were kept because one side confirms them.
    share : dict
        Replaced fraction of each channel.
    """

    name: str
    delay: float
    latency: float
    noise_factor: float
    passband: float
    stopband: float
    attenuation: float
    replaced: pd.DataFrame = field(repr=False)
    kept: pd.DataFrame = field(repr=False)
    share: dict[str, float]
    findings: tuple[Finding, ...]


#: Code of the caution that a prefilter cannot separate outliers from mechanical shocks.
LOW_RATE = "prefilter.rate-too-low-for-knocks"
# A shock lasts some milliseconds; at higher sample rates it shows in more than one sample.
SHORTEST_KNOCK = 2e-3  # s


def report_of(
    name: str,
    figures: dict[str, float],
    grid: Any,
    changed: Changed,
    columns: Sequence[str],
    samples: int,
    source: str | None,
) -> PrefilterReport:
    """Compile the report of a record."""
    names = np.array(columns, dtype=object)

    def table(flag: int) -> pd.DataFrame:
        at = changed.flag == flag
        return pd.DataFrame(
            {
                "time": grid.time(changed.number[at]),
                "row": changed.number[at] + 1,
                "channel": names[changed.channel[at]],
                "value": changed.value[at],
                "by": changed.by[at],
            }
        )

    replaced = table(REPLACED)
    share = {c: float((replaced["channel"] == c).sum()) / samples for c in columns}
    found = [
        *_bursts(changed, grid, columns, source),
        *_too_many(share, samples, source),
        *_knocks(replaced, grid, source),
    ]
    return PrefilterReport(
        name=name,
        replaced=replaced,
        kept=table(KEPT),
        share=share,
        findings=tuple(found),
        **figures,
    )


def _bursts(
    changed: Changed, grid: Any, columns: Sequence[str], source: str | None
) -> list[Finding]:
    """Find events with more samples than are bridged, other than steps."""
    found: list[Finding] = []
    for c, column in enumerate(columns):
        of = changed.channel == c
        number, flag = changed.number[of], changed.flag[of]
        told, left = 0, 0
        for event in np.split(np.arange(len(number)), np.flatnonzero(np.diff(number) > APART) + 1):
            kept = number[event][flag[event] == KEPT]
            # A step gives outliers at one instant: at one sample or two adjacent ones.
            if (np.diff(kept) > 1).sum() < 1:
                continue
            if told == MOST_TOLD:
                left += 1
                continue
            told += 1
            a, b = int(number[event[0]]), int(number[event[-1]])
            add_warning(
                found,
                "prefilter.outliers-too-close",
                file=source,
                row=a + 1,
                quantity=column,
                time=grid.time(a),
                time_2=grid.time(b),
                a=a + 1,
                b=b + 1,
                count=len(kept),
            )
        if left:
            add_note(found, "prefilter.more-bursts", file=source, quantity=column, left=left)
    return found


def _too_many(share: dict[str, float], samples: int, source: str | None) -> list[Finding]:
    return [
        Finding(
            "prefilter.many-outliers",
            file=source,
            quantity=column,
            part=100.0 * part,
            samples=samples,
        )
        for column, part in share.items()
        if part > USUAL_SHARE
    ]


def _knocks(replaced: pd.DataFrame, grid: Any, source: str | None) -> list[Finding]:
    if replaced.empty or grid.step <= SHORTEST_KNOCK:
        return []
    first = replaced.iloc[0]
    return [
        Finding(
            LOW_RATE,
            file=source,
            row=int(first["row"]),
            quantity=str(first["channel"]),
            count=len(replaced),
            rate=1.0 / grid.step,
        )
    ]


# Pass-through prefilter.


@dataclass(frozen=True)
class NoPrefilter(Prefilter):
    """Pass every sample unchanged, at the input rate."""

    name: ClassVar[str] = "none"
    summary: ClassVar[str] = "samples as they come"
    source: ClassVar[str] = "-"

    def begin(self, grid: Grid, channels: int = 6) -> tuple[Grid, int]:
        """As `Prefilter.begin`."""
        return grid, 0

    def advance(
        self, state: tuple[Grid, int], values: Array, last: bool = False
    ) -> tuple[tuple[Grid, int], Portion]:
        """As `Prefilter.advance`."""
        grid, given = state
        check_segment(values, given)
        after = given + len(values)
        time = grid.time(np.arange(given, after))
        return (grid, after), Portion(time, values.copy(), np.empty((0, 10)), Changed.none())

    def figures(self, grid: Grid) -> dict[str, float]:
        """As `Prefilter.figures`."""
        half = 0.5 / grid.step
        return {
            "delay": 0.0,
            "latency": 0.0,
            "noise_factor": 1.0,
            "passband": half,
            "stopband": half,
            "attenuation": 0.0,
        }

    def sampling(self, grid: Grid) -> str:
        """Same as the input samples."""
        return "mean" if grid.means else "instantaneous"
