"""Record of a navigation run: its states, covariance and innovations."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import Any, NamedTuple, overload

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from strapdown.errors import DivergenceError, Finding
from strapdown.estimation.covariance import Innovations, Observation
from strapdown.nav_state import NavState
from strapdown.rotation import euler_sd
from strapdown.tables import (
    TRAJECTORY_ERROR,
    check_trajectory_error,
    on_disk,
)
from strapdown.tables.checks import Array, as_array


@dataclass(frozen=True)
class Event:
    """An event at an instant.

    Attributes
    ----------
    time : float, s
    kind : str
        ``mode``, ``outage``, ``recovered``, ``rejected``, ``late``, ``gap``, ``command``.
    finding : Finding
        Description, with its numbers.
    """

    time: float
    kind: str
    finding: Finding

    @classmethod
    def of(cls, time: float, kind: str, code: str, **values: Any) -> Event:
        """Return an event described by a finding of the catalogue, ``navigation.event-CODE``."""
        return cls(time, kind, Finding(f"navigation.event-{code}", severity="note", **values))


@dataclass(frozen=True)
class Span:
    """A time interval of a condition: a mode, an outage of an aid.

    Attributes
    ----------
    begin, end : float, s
    """

    name: str
    begin: float
    end: float


@dataclass(frozen=True, eq=False)
class NavigationRecord:
    """A recorded run of navigation.

    Attributes
    ----------
    trajectory : DataFrame
        Trajectory table at the rate of the recorder.
    sd : DataFrame
        TrajectoryError table of standard deviations, by time of the marks.
    covariance : ndarray, (m, 9, 9)
        At the marks: displacement m, velocity m/s, rotation rad, north-east-down
        (`mechanization.state_error.state_error`). Here and in `sd` NaN for what the error model
        does not estimate (`not_estimated`).
    sensors, sensors_sd : DataFrame
        By time of the marks: estimates of the errors of sensors and aids, in SI, and their
        standard deviations; columns as ``gyro_bias_x``, ``rtk.lever_arm_x``.
    units : mapping of str to str
        Unit of each of these columns.
    innovations : mapping of str to DataFrame
        By name of the observation, by time: for each component ``nu LABEL`` (innovation:
        computed − observed − predicted), ``s LABEL`` (its predicted variance),
        ``weight LABEL``.
    events : tuple of Event
        In the order of time.
    outages : mapping of str to tuple of Span
        By name of the aid.
    """

    trajectory: pd.DataFrame
    sd: pd.DataFrame
    covariance: Array
    sensors: pd.DataFrame
    sensors_sd: pd.DataFrame
    units: Mapping[str, str]
    innovations: Mapping[str, pd.DataFrame]
    events: tuple[Event, ...] = ()
    modes: tuple[Span, ...] = ()
    outages: Mapping[str, tuple[Span, ...]] = field(default_factory=dict)

    @property
    def not_estimated(self) -> tuple[str, ...]:
        """Columns of `sd` of which the error model has no state, as a height in 17 states."""
        return tuple(str(c) for c in self.sd.columns[self.sd.isna().all().to_numpy()])


def standard_deviations(
    time: ArrayLike, covariance: Array, euler: Array, source: str | None = None
) -> pd.DataFrame:
    """Return a TrajectoryError table of the standard deviations of covariances.

    Parameters
    ----------
    time : array_like, (n,), s
    covariance : ndarray, (n, 9, 9)
        NaN in the rows and columns of what is not estimated, which is NaN in the table, too.
    euler : ndarray, (n, 3), deg
        Roll, pitch, heading.
    source : str, optional
        Name for messages.

    Raises
    ------
    DivergenceError
        A variance is negative: of a smoother, after a filter that falsely was certain.
    """
    sd = on_disk.room((len(covariance), len(TRAJECTORY_ERROR)))
    without = np.empty(sd.shape, dtype=np.bool_)
    for part in on_disk.parts_of(len(covariance), 81):
        P = covariance[part]
        variance = np.diagonal(P, axis1=1, axis2=2)
        without[part] = np.isnan(variance)
        with np.errstate(invalid="ignore"):
            sd[part] = np.sqrt(np.where(without[part], 0.0, variance))
            sd[part, 6:] = euler_sd(euler[part], P[:, 6:, 6:])
        lost = (np.isnan(sd[part]) & ~without[part]).any(axis=1)
        if lost.any():
            at = float(np.asarray(time)[part][np.argmax(lost)])
            raise DivergenceError("navigation.covariance-lost", quantity="covariance", time=at)
        on_disk.let_go(covariance)
    index = pd.Index(as_array(time, None, "time", source), name="time", copy=False)
    table = pd.DataFrame(sd, index=index, columns=TRAJECTORY_ERROR, copy=False)
    table.attrs["source"] = source
    check_trajectory_error(table)
    sd[without] = np.nan
    return table


def state_of_row(row: Array) -> NavState:
    """Position, velocity and attitude of the numbers, (9,), of a row of a Trajectory table."""
    lat, lon, alt, _, _, _, roll, pitch, heading = row.tolist()
    return NavState.from_degrees(
        lat, lon, alt, v_n=row[3:6], roll_deg=roll, pitch_deg=pitch, heading_deg=heading
    )


# Output of a navigator for a chunk of a log.


class InnovationRecord(NamedTuple):
    """One observation at an epoch.

    Attributes
    ----------
    time : float, s
    name : str
        Of the observation: ``rtk.position``.
    labels : tuple of str
        Of its components, with units.
    innovations : Innovations
        Innovation: computed − observed − predicted; its predicted variance; weight.
    observation : Observation, optional
        Of the state before any update of this epoch, with open-loop estimates subtracted; None
        for a single receiver in a compiled loop.
    """

    time: float
    name: str
    labels: tuple[str, ...]
    innovations: Innovations
    observation: Observation | None = None


class InnovationColumns(NamedTuple):
    """Observations of one name, by columns: m instants, c components.

    Attributes
    ----------
    name, labels
        As of an `InnovationRecord`.
    time : ndarray, (m,), s
    innovations : Innovations
        Arrays (m, c).
    observation : Observation, optional
        Of a single one.
    """

    name: str
    labels: tuple[str, ...]
    time: Array
    innovations: Innovations
    observation: Observation | None = None

    def each(self) -> Iterator[InnovationRecord]:
        """Return the single observations."""
        told = self.innovations
        for at, *rows in zip(self.time.tolist(), told.nu, told.s, told.weight, strict=True):
            yield InnovationRecord(at, self.name, self.labels, Innovations(*rows), self.observation)


@dataclass(frozen=True, eq=False)
class InnovationRecords(Sequence[InnovationRecord]):
    """Observations of a chunk, in the order of time; those of one instant in that of the parts."""

    parts: Sequence[InnovationColumns] = ()

    @cached_property
    def _each(self) -> list[InnovationRecord]:
        every = (one for part in self.parts for one in part.each())
        return sorted(every, key=lambda one: one.time)

    def by_name(self) -> Iterator[InnovationColumns]:
        """Return the observations of each name, by its components."""
        found: dict[tuple[str, tuple[str, ...]], list[InnovationColumns]] = {}
        for part in self.parts:
            found.setdefault((part.name, part.labels), []).append(part)
        for (name, labels), of in found.items():
            told = [(one.innovations.nu, one.innovations.s, one.innovations.weight) for one in of]
            columns = map(np.concatenate, zip(*told, strict=True))
            time = np.concatenate([one.time for one in of])
            yield InnovationColumns(name, labels, time, Innovations(*columns))

    def __len__(self) -> int:
        return sum(len(part.time) for part in self.parts)

    @overload
    def __getitem__(self, k: int) -> InnovationRecord: ...

    @overload
    def __getitem__(self, k: slice) -> list[InnovationRecord]: ...

    def __getitem__(self, k: int | slice) -> InnovationRecord | list[InnovationRecord]:
        return self._each[k]


def innovation_labels(innovations: pd.DataFrame) -> list[str]:
    """Return the labels of the components in a table of innovations, with units.

    Its columns are ``nu LABEL``, ``s LABEL`` and ``weight LABEL`` of each.
    """
    return [str(c)[3:] for c in innovations.columns if str(c).startswith("nu ")]


class CovarianceSnapshot(NamedTuple):
    """Covariance and estimates at an instant, after the update then.

    After a while without observations there is another one before the update, with a time stamp
    a microsecond earlier: there an outage ends, and the uncertainty is largest.

    Attributes
    ----------
    time : float, s
    covariance : ndarray, (9, 9)
        Of the errors of the state in north-east-down: displacement m, velocity m/s, rotation rad
        (`mechanization.state_error.state_error`).
    sensors : ndarray, (k,)
        Estimates of the errors of the sensors and of the aids.
    sensors_sd : ndarray, (k,)
    """

    time: float
    covariance: Array
    sensors: Array
    sensors_sd: Array


@dataclass(frozen=True, eq=False)
class CovarianceSnapshots(Sequence[CovarianceSnapshot]):
    """Snapshots of a chunk, by columns: the attributes of one, (m, …) each."""

    time: Array
    covariance: Array
    sensors: Array
    sensors_sd: Array

    @classmethod
    def joined(cls, parts: Sequence[CovarianceSnapshots], same: float) -> CovarianceSnapshots:
        """Join parts, in order; of snapshots within `same` seconds the last one counts."""
        parts = [part for part in parts if len(part)]
        if not parts:
            return cls(np.empty(0), np.empty((0, 9, 9)), np.empty((0, 0)), np.empty((0, 0)))
        names = [one.name for one in fields(cls)]
        columns = [[getattr(part, name) for part in parts] for name in names]
        whole = [of[0] if len(of) == 1 else np.concatenate(of) for of in columns]
        newer = np.append(np.diff(whole[0]) > same, True)
        return cls(*(whole if newer.all() else (of[newer] for of in whole)))

    def __len__(self) -> int:
        return len(self.time)

    @overload
    def __getitem__(self, k: int) -> CovarianceSnapshot: ...

    @overload
    def __getitem__(self, k: slice) -> CovarianceSnapshots: ...

    def __getitem__(self, k: int | slice) -> CovarianceSnapshot | CovarianceSnapshots:
        columns = self.covariance[k], self.sensors[k], self.sensors_sd[k]
        if isinstance(k, slice):
            return CovarianceSnapshots(self.time[k], *columns)
        return CovarianceSnapshot(float(self.time[k]), *columns)


@dataclass(frozen=True, eq=False)
class NavigationChunk:
    """Result of a chunk of a log.

    Attributes
    ----------
    time : ndarray, (n,), s
        Ends of the steps.
    history : ndarray, (n, row)
        Rows of the mechanization then, with the estimates subtracted.
    seen : InnovationRecords
        In the order of time.
    marks : CovarianceSnapshots
        At every epoch, and at least as often as the navigator's `mark_interval`; where an outage
        ends, before it, too. The newest sample has one by `Navigator.finish`.
    late : tuple of (str, float)
        Epochs of aids that came when the navigator was beyond their time, and were not used.
    nodes : tuple of ndarray, (k, width)
        Smoother history, if the navigator has a smoother: rows of `NodeRows`.
    left : ndarray, (k, 9)
        At each node, in level axes: estimated errors of `history` that are not subtracted from it,
        where it is about a reference; otherwise (0, 9).
    """

    time: Array
    history: Array
    seen: InnovationRecords
    marks: CovarianceSnapshots
    late: tuple[tuple[str, float], ...] = ()
    nodes: tuple[Array, ...] = ()
    left: Array = field(default_factory=lambda: np.empty((0, 9)))


# Rows that grow without copying earlier ones.


FIRST_ROOM = 64


@dataclass
class _Room:
    buffer: Array
    used: int


@dataclass(frozen=True, eq=False)
class GrowingRows:
    """Rows of numbers: an immutable value; longer values share its memory.

    Appending to the newest value costs only the new rows; appending to an older one copies it. Many
    rows are in a file (`on_disk.room`), of which the newest are in memory.
    """

    room: _Room
    count: int = 0

    @classmethod
    def of(cls, columns: int) -> GrowingRows:
        """Return an empty value of so many columns."""
        return cls(_Room(np.empty((0, columns)), 0))

    @property
    def rows(self) -> Array:
        """All rows, (`count`, columns); read-only."""
        return self.room.buffer[: self.count]

    def and_then(self, rows: Array) -> GrowingRows:
        """Return these rows with further ones, (k, columns), appended."""
        room, count = self.room, self.count + len(rows)
        width = room.buffer.shape[1]
        if room.used != self.count or count > len(room.buffer):
            size = max(FIRST_ROOM, count + count // 2)
            room = _Room(on_disk.room((size, width)), self.count)
            for part in on_disk.parts_of(self.count, width):
                room.buffer[part] = self.rows[part]
                on_disk.let_go(self.room.buffer)
                on_disk.let_go(room.buffer)
        room.buffer[self.count : count] = rows
        if 8 * width * self.count // on_disk.PART < 8 * width * count // on_disk.PART:
            on_disk.let_go(room.buffer)
        room.used = count
        return GrowingRows(room, count)

    def without_first(self, number: int) -> GrowingRows:
        """Return the rows without the first ones, whose memory is freed."""
        left = self.rows[number:].copy()
        return GrowingRows(_Room(left, len(left)), len(left))
