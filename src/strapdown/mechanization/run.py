"""Navigation over a whole log, or over chunks."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import NoReturn

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from strapdown._kernels import sample as kernel
from strapdown._kernels.compilation import ARGUMENT_ERRORS
from strapdown._kernels.motion_increments import largest_turn
from strapdown._kernels.ned import LARGEST_TURN, LEAP, POLE
from strapdown.ellipsoids import find_ellipsoid
from strapdown.errors import ConfigError, DataError, DivergenceError, Finding
from strapdown.increments import IncrementStream, IncrementStreamState
from strapdown.mechanization.mechanization import Mechanization
from strapdown.mechanization.ned import NorthEastDown
from strapdown.nav_state import NavState
from strapdown.tables import (
    ACCEL,
    GYRO,
    MOTION,
    PHI,
    check_imu,
    check_sampling_kind,
)
from strapdown.tables.checks import (
    Array,
    check_columns,
    check_rows,
    check_steps,
    check_time,
    checked_values,
    index_of,
    is_number,
    source_of,
    values_of,
)

# A step with a larger rotation, rad, is poorly described by its samples.
LARGEST_STEP_ROTATION = 1.0
# The longest step, s, over which two samples describe the motion between them. The user decides on
# longer gaps.
LONGEST_STEP = 1.0
# Allowed delay of the next step as a fraction of a step: stamps are rounded, a lost step is whole.
LOST = 0.5


@dataclass(frozen=True, eq=False)
class NavigationRun:
    """Result of a mechanization run over a log.

    Attributes
    ----------
    mechanization : Mechanization
    start, end : NavState
        The given state, and that at the other end: the last, or of a backward run the first.
    time : ndarray, (n,), s
        Stamps of the states: both sides of every step.
    history : ndarray, (n, `mechanization.row`)
        The states as the kernels have them: `Mechanization.advance`.
    findings : tuple of Finding
        Findings about the increments and the states.
    source : str, optional
        Name of the log.
    """

    mechanization: Mechanization
    start: NavState
    end: NavState
    time: Array = field(repr=False)
    history: Array = field(repr=False)
    findings: tuple[Finding, ...] = ()
    source: str | None = None

    @cached_property
    def trajectory(self) -> pd.DataFrame:
        """Trajectory table, the start included; made at its first use."""
        return self.mechanization.trajectory(self.time, self.history, self.source)


def run_mechanization(
    mechanization: Mechanization,
    start: NavState,
    increments: pd.DataFrame,
    *,
    heights: ArrayLike | None = None,
    backward: bool = False,
    longest_step: float = LONGEST_STEP,
) -> NavigationRun:
    """Navigate over a log.

    Parameters
    ----------
    start : NavState
        At the start of the first step; of a backward run at the end of the last.
    increments : DataFrame
        A MotionIncrements table.
    heights : array_like, (n,), m, optional
        As `Mechanization.advance`.
    backward : bool
        From the end of the log to its start.
    longest_step : float, s
        A longer step is a gap in the data, and refused.

    Raises
    ------
    DataError
        The table is not valid, a step is too long, there is a gap between two steps, or `start`
        is not at the time where the increments begin.
    ConfigError
        `longest_step` is not a valid time.
    """
    source = source_of(increments)
    rows = np.ascontiguousarray(checked_values(increments, MOTION))
    ends, dt = index_of(increments), rows[:, 0].copy()
    check_steps(ends, dt, source)
    if increments.empty:
        raise DataError("mechanization.no-increment", file=source, quantity="increments")
    _refuse_holes(ends, dt, longest_step, source)
    begin = float(ends[0] - dt[0])
    _check_start(start, float(ends[-1]) if backward else begin, dt[0], source)
    state = mechanization.begin(start)
    history = np.empty((len(rows) + 1, mechanization.row))
    history[-1 if backward else 0] = state[: mechanization.row]
    others = history[:-1] if backward else history[1:]
    mechanization.advance_into(state, rows, increments, heights, others, backward=backward)
    time = np.concatenate([[begin], ends])
    return NavigationRun(
        mechanization=mechanization,
        start=start,
        end=mechanization.nav_state(state, begin if backward else float(ends[-1])),
        time=time,
        history=history,
        findings=(
            *_large_turns(ends, rows, source),
            *_wide_steps(ends, dt, source),
            *mechanization.remarks(time, history),
        ),
        source=source,
    )


def navigate_segments(
    mechanization: Mechanization,
    start: NavState,
    segments: Iterable[pd.DataFrame] | pd.DataFrame,
    *,
    longest_step: float = LONGEST_STEP,
) -> Iterator[pd.DataFrame]:
    """Navigate over a log in chunks, in constant memory.

    The result equals that of a run over the whole log to the last bit.

    Parameters
    ----------
    mechanization : Mechanization
        Its height free or held.
    start : NavState
        At the first sample.
    segments : iterable of DataFrame, or DataFrame
        Imu tables, one after the other, of any lengths.
    longest_step : float, s
        As `run_mechanization`.

    Yields
    ------
    DataFrame
        Trajectory table of each segment, at its samples; of the first from its second sample on.
    """
    pieces = [segments] if isinstance(segments, pd.DataFrame) else segments
    state = mechanization.begin(start)
    stream = IncrementStream()
    steps: IncrementStreamState | None = None
    begun = False
    for segment in pieces:
        if segment.empty:
            continue
        _check_segment(segment, np.empty(0) if steps is None else steps.time[-1:])
        if steps is None:
            steps = stream.begin(segment.attrs["sampling"])
        stamps, values = index_of(segment), values_of(segment, [*GYRO, *ACCEL])
        steps, ends, rows = stream.advance(steps, stamps, values)
        if not ends.size:
            continue
        increments = pd.DataFrame(rows, index=pd.Index(ends, name="time"), columns=MOTION)
        increments.attrs["source"] = segment.attrs.get("source")
        source = source_of(segment)
        if not begun:
            _check_start(start, float(ends[0] - rows[0, 0]), rows[0, 0], source)
            begun = True
        _refuse_holes(ends, rows[:, 0], longest_step, source)
        state, history = mechanization.advance(state, increments)
        yield mechanization.trajectory(ends, history, segment.attrs.get("source"))


def check_longest_step(longest: float) -> None:
    """Refuse an invalid length of time."""
    if not is_number(longest) or not longest > 0.0:
        raise ConfigError(
            "mechanization.longest-step-none", quantity="longest_step", longest=longest
        )


def _check_segment(segment: pd.DataFrame, newest: Array) -> None:
    """Refuse a chunk that is not an Imu table, or does not follow the previous one."""
    source = source_of(segment)
    check_columns(segment, [*GYRO, *ACCEL], source)
    if len(segment) > 1:
        check_imu(segment)
    else:
        check_rows(values_of(segment, [*GYRO, *ACCEL]), [*GYRO, *ACCEL], source)
    check_time(np.concatenate([newest, index_of(segment)]), source)


def _check_start(start: NavState, begin: float, dt: float, source: str | None) -> None:
    if abs(start.time - begin) > 0.5 * dt:
        raise DataError(
            "mechanization.state-increments-begin",
            file=source,
            quantity="time",
            time=start.time,
            begin=begin,
        )


def _refuse_holes(ends: Array, dt: Array, longest: float, source: str | None) -> None:
    """Refuse a gap between two steps, and a step that is too long."""
    check_longest_step(longest)
    between = np.diff(ends) - dt[1:]
    if between.size and between.max() > LOST * dt.min():
        holes = np.flatnonzero(between > LOST * dt[1:])
        if holes.size:
            at = int(holes[0])
            raise DataError(
                "mechanization.no-increment-body-did-then",
                file=source,
                row=at + 2,
                quantity="dt",
                ends=ends[at],
                ends_2=ends[at] + between[at],
                size=holes.size,
            )
    long = np.flatnonzero(dt > longest)
    if long.size:
        row = int(long[0])
        raise DataError(
            "mechanization.gap-body-did-not-known",
            file=source,
            quantity="dt",
            dt=dt[row],
            end=float(ends[row] - dt[row]),
            end_2=float(ends[row]),
            size=long.size,
            dt_2=float(dt.max()),
        )


def _wide_steps(ends: Array, dt: Array, source: str | None) -> tuple[Finding, ...]:
    # The usual step is at least the shortest: this test suffices for most logs.
    if dt.max() <= 3.0 * dt.min():
        return ()
    usual = float(np.median(dt))
    wide = np.flatnonzero(dt > 3.0 * usual)
    if not wide.size:
        return ()
    row = int(wide[np.argmax(dt[wide])])
    return (
        Finding(
            "mechanization.steps-more-than-three-times",
            file=source,
            quantity="dt",
            size=wide.size,
            usual=usual,
            dt=dt[row],
            index=float(ends[row]),
        ),
    )


def _large_turns(ends: Array, rows: Array, source: str | None) -> tuple[Finding, ...]:
    row, axis = largest_turn(rows)
    phi = rows[row, 1 + axis]
    if abs(phi) <= LARGEST_STEP_ROTATION:
        return ()
    return (
        Finding(
            "mechanization.step-ending-body-turns-rad",
            file=source,
            quantity=PHI[axis],
            index=float(ends[row]),
            phi=phi,
        ),
    )


# Navigation sample by sample, as it runs on a device or live.

# Looked up once: attribute lookup is a significant part of a call of a microsecond.
_ndarray = np.ndarray


class NavTracker:
    """Navigate from samples, one call per sample.

    Its result equals, to the last bit, that of a run over the same samples with
    `increments.motion_increments` at its defaults.

    Parameters
    ----------
    start : NavState
        At the first sample.
    mechanization : NorthEastDown or WanderAzimuth, optional
        North-east-down on WGS 84 with a free height, if not given.
    sampling : {'instantaneous', 'mean'}
        Sample type: the value at its stamp, or its mean over the interval that ends there.
    longest_step : float, s
        A longer step is a gap in the data, and refused; so is a first sample that is farther
        than this from the time of `start`.

    Raises
    ------
    ConfigError
        `sampling` is unknown, `longest_step` is not a valid time, or the mechanization differs.
    """

    __slots__ = ("_mechanization", "_record", "_state", "_update")

    def __init__(
        self,
        start: NavState,
        mechanization: Mechanization | None = None,
        sampling: str = "instantaneous",
        longest_step: float = LONGEST_STEP,
    ) -> None:
        check_longest_step(longest_step)
        check_sampling_kind(sampling)
        used: object = NorthEastDown() if mechanization is None else mechanization
        update = used.sample_kernel() if isinstance(used, Mechanization) else None
        if not isinstance(used, Mechanization) or update is None:
            raise ConfigError(
                "mechanization.tracker-steps-northeastdown-or-wanderazimuth",
                quantity="mechanization",
                used=used,
            )
        begin = used.begin(start)
        record = np.zeros(kernel.STATE + len(begin))
        record[kernel.TIME] = start.time
        record[kernel.LONGEST] = longest_step
        record[kernel.MEAN] = float(sampling == "mean")
        record[kernel.EARTH : kernel.OPTIONS] = find_ellipsoid(used.ellipsoid).parameters()
        record[kernel.OPTIONS : kernel.STATE] = used.kernel_options()
        record[kernel.STATE :] = begin
        self._mechanization = used
        self._record = record
        self._state = record[kernel.STATE :]
        self._update = update

    def update(
        self,
        time: float,
        gyro: Array | Sequence[float],
        accel: Array | Sequence[float],
        height: float = float("nan"),
    ) -> None:
        """Process one sample.

        `time` (s): later than that of the sample before. `gyro` ((3,), rad/s): body rate relative
        to inertial space, forward-right-down. `accel` ((3,), m/s²): specific force in the same
        axes. `height` (m): reference height now, for a damped height; NaN for a missing one.
        DataError: time does not advance, or leaps; or rate and force are not three finite numbers
        each. DivergenceError: the state would diverge, or come too near to a pole.

        A sample that raises an error is ignored; the state is as before it.
        """
        try:
            if gyro.__class__ is not _ndarray:
                gyro = np.asarray(gyro, dtype=np.float64)
            if accel.__class__ is not _ndarray:
                accel = np.asarray(accel, dtype=np.float64)
            why = self._update(self._record, time, gyro, accel, height)
        except ARGUMENT_ERRORS:
            # Of a type that cannot be compiled for, or not numbers.
            why = kernel.BAD_SAMPLE
        if why:
            self._refuse(why, time, gyro, accel)

    def _refuse(self, why: int, time: float, gyro: ArrayLike, accel: ArrayLike) -> NoReturn:
        row = int(self._record[kernel.SAMPLES]) + 1
        if why == kernel.BAD_TIME:
            raise DataError(
                "mechanization.time-does-not-advance-followed",
                row=row,
                quantity="time",
                record=self._record[kernel.TIME],
                time=time,
            )
        if why == kernel.BAD_START:
            raise DataError(
                "mechanization.state-first-sample",
                row=row,
                quantity="time",
                record=self._record[kernel.TIME],
                time=time,
            )
        if why == kernel.BAD_HEIGHT:
            raise DataError(
                "mechanization.reference-height-height-or-infinite",
                row=row,
                quantity="height",
                height=self._mechanization.height,
            )
        if why == kernel.GAP:
            raise DataError(
                "mechanization.gap-before-body-did-not",
                row=row,
                quantity="time",
                time=time - self._record[kernel.TIME],
                time_2=time,
            )
        rate, force = (v.tolist() if isinstance(v, np.ndarray) else v for v in (gyro, accel))
        given = f"time {time}, rate {rate}, force {force}"
        if why == kernel.BAD_SAMPLE:
            raise DataError(
                "mechanization.time-three-finite-rates-three",
                row=row,
                quantity="gyro, accel",
                given=given,
            )
        if why == POLE:
            raise DivergenceError(
                "mechanization.step-comes-nearer-pole-than",
                row=row,
                quantity="lat",
                time=time,
                latitude_limit_deg=self._mechanization.latitude_limit_deg,
            )
        if why == LEAP:
            raise DivergenceError(
                "mechanization.step-place-would-move-more",
                row=row,
                quantity="state",
                time=time,
                largest_turn=LARGEST_TURN,
            )
        raise DivergenceError(
            "mechanization.state-would-diverge", row=row, quantity="state", given=given
        )

    @property
    def state(self) -> NavState:
        """Position, velocity and attitude at the last sample."""
        return self._mechanization.nav_state(self._state, self._record.item(kernel.TIME))
