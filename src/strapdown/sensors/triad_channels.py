"""Validated channels of a recorded triad: axes, stamps, values, units of measurement."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pandas as pd

from strapdown.constants import STANDARD_GRAVITY
from strapdown.errors import DataError, Finding, add_warning
from strapdown.sensors.crash_unit import CrashUnit, RecordedTriad
from strapdown.tables import ACCEL, GYRO, check_table_sampling, find_gaps
from strapdown.tables.checks import Array, check_rows, check_time

LEAST_SAMPLES = 6
# Mean magnitude of the specific force at rest that indicates g as unit, and one without gravity.
IN_G = (0.85, 1.15)
NO_GRAVITY = 2.0  # m/s²
# Largest bias that could cause either.
BIAS_SPEAKS = 1.0  # m/s²
# Vehicles rotate more slowly; 100 deg/s occurs in a severe crash.
FASTEST_TURN = 50.0  # rad/s
OVER_RANGE = 1.05
# A longer sample interval, such as 100 ms, does not resolve a crash.
SLOWEST_STEP = 0.1  # s
DEGREES = 180.0 / math.pi
# Attribute of `Assumed` that replaces a missing axis, by kind of triad.
_ASSUMED = {ACCEL[0]: "delta_v_sd", GYRO[0]: "turn_sd_deg"}


@dataclass(frozen=True, eq=False)
class AxisGroup:
    """Axes that share their stamps.

    `axes`: 0, 1, 2 for x, y, z. `time` ((n,), s). `values` ((n, len(axes))). `step` (s): nominal
    sample interval.
    """

    axes: tuple[int, ...]
    time: Array
    values: Array
    step: float


@dataclass(frozen=True, eq=False)
class TriadChannels:
    """A triad ready for resampling.

    `source`: unit and part, for messages. `groups`: one group if all axes were sampled together.
    """

    source: str
    groups: tuple[AxisGroup, ...]
    sampling: str
    findings: tuple[Finding, ...]

    @property
    def start(self) -> float:
        """First stamp common to all axes, s."""
        return float(max(g.time[0] for g in self.groups))

    @property
    def end(self) -> float:
        """Last stamp common to all axes, s."""
        return float(min(g.time[-1] for g in self.groups))


def triad_channels(unit: CrashUnit, triad: RecordedTriad, columns: list[str]) -> TriadChannels:
    """Check a triad and extract its channels.

    `triad`: its table may hold axes with different rates and starts, with NaN in rows where an axis
    has no sample. `columns`: `ACCEL` or `GYRO`. DataError: an axis is missing, time does not
    increase, a value is not finite, a gap occurs, there are fewer than six samples, or the units of
    measurement are evidently wrong.
    """
    source = f"{unit.name}, {triad.name}"
    table = triad.table
    missing = [c for c in columns if c not in table.columns]
    if missing:
        raise DataError(
            "sensors.triad-without-axes" if len(missing) == 3 else "sensors.axes-missing",
            file=source,
            quantity=missing[0],
            missing=missing,
            columns=table.columns,
            assumed=_ASSUMED[columns[0]],
        )
    check_table_sampling(table, source)
    if table.index.dtype.kind not in "fiu":
        raise DataError(
            "sensors.table-index-holds-not-seconds",
            file=source,
            quantity="time",
            dtype=table.index.dtype,
        )
    stamps = np.asarray(table.index.to_numpy(), dtype=np.float64)
    check_time(stamps, source)
    values = np.column_stack([_numbers(table[c], c, source) for c in columns])
    check_rows(np.where(np.isnan(values), 0.0, values), columns, source)
    groups, findings = _groups(source, stamps, values, columns)
    judge = _judge_force if columns == ACCEL else _judge_rate
    return TriadChannels(
        source, groups, table.attrs["sampling"], (*findings, *judge(source, unit, triad, groups))
    )


def _groups(
    source: str, stamps: Array, values: Array, columns: list[str]
) -> tuple[tuple[AxisGroup, ...], list[Finding]]:
    there = ~np.isnan(values)
    patterns: dict[bytes, list[int]] = {}
    for axis in range(3):
        patterns.setdefault(there[:, axis].tobytes(), []).append(axis)
    groups = tuple(
        _group(source, stamps, values, columns, tuple(axes)) for axes in patterns.values()
    )
    if len(groups) == 1:
        return groups, []
    parts = [
        Finding(
            "sensors.axes-sampled",
            severity="note",
            columns=[columns[a] for a in g.axes],
            rate=1.0 / g.step,
            begin=g.time[0],
            end=g.time[-1],
        )
        for g in groups
    ]
    return groups, [
        Finding("sensors.axes-not-sampled-together", file=source, quantity="time", parts=parts)
    ]


def _group(
    source: str, stamps: Array, values: Array, columns: list[str], axes: tuple[int, ...]
) -> AxisGroup:
    names = [columns[a] for a in axes]
    block = values[:, list(axes)]
    rows = np.flatnonzero(~np.isnan(block[:, 0]))
    time, block = stamps[rows], np.ascontiguousarray(block[rows])
    if rows.size >= 2:
        # NaN rows belong to other axes; a gap is a missing sample of this axis.
        steps = np.diff(time)
        hole = (np.diff(rows) > 1) & (steps > 1.5 * np.median(steps))
        if hole.any():
            row = int(rows[int(np.argmax(hole))]) + 1
            raise DataError(
                "sensors.nan-between-samples-axis",
                file=source,
                row=row + 1,
                quantity=names[0],
                stamps=stamps[row],
            )
    if len(time) < LEAST_SAMPLES:
        raise DataError(
            "sensors.samples-needed",
            file=source,
            quantity=names[0],
            count=len(time),
            least_samples=LEAST_SAMPLES,
        )
    step = float(np.median(np.diff(time)))
    if step > SLOWEST_STEP:
        raise DataError(
            "sensors.samples-apart-too-far-crash",
            file=source,
            row=int(rows[1]) + 1,
            quantity="time",
            step=step,
        )
    gaps = find_gaps(time)
    if gaps:
        worst = max(gaps, key=lambda g: g.length)
        raise DataError(
            "sensors.gap" if len(gaps) == 1 else "sensors.gaps",
            file=source,
            row=worst.sample + 1,
            quantity="time",
            count=len(gaps),
            length=1000.0 * worst.length,
            start=worst.start,
            usual=1000.0 * worst.usual,
        )
    return AxisGroup(axes, time, block, step)


def _numbers(column: pd.Series, name: str, source: str) -> Array:
    try:
        return np.asarray(column.to_numpy(dtype=np.float64))
    except (TypeError, ValueError):
        bad = pd.to_numeric(column, errors="coerce").isna().to_numpy() & column.notna().to_numpy()
        row = int(np.argmax(bad))
        raise DataError(
            "sensors.sample-not-a-number",
            file=source,
            row=row + 1,
            quantity=name,
            iloc=column.iloc[row],
        ) from None


def _judge_force(
    source: str, unit: CrashUnit, triad: RecordedTriad, groups: tuple[AxisGroup, ...]
) -> list[Finding]:
    found = _over_range(source, triad, groups, "sensors.acceleration-beyond-range")
    if triad.absent:
        # Gravity may be along the absent axis.
        return found
    # Mean before the trigger; of the first tenth without a trigger or with too few samples.
    mean = np.zeros(3)
    for g in groups:
        before = g.time < (math.inf if unit.trigger is None else unit.trigger - 10.0 * g.step)
        if unit.trigger is None or before.sum() < 10:
            before = np.arange(len(g.time)) < max(10, len(g.time) // 10)
        mean[list(g.axes)] = g.values[before].mean(axis=0)
    length = float(np.linalg.norm(mean))
    if IN_G[0] <= length <= IN_G[1]:
        if max(triad.uncertainty.axis("bias")) < BIAS_SPEAKS:
            raise DataError(
                "sensors.specific-force-in-g", file=source, quantity="accel", length=length
            )
        add_warning(
            found,
            "sensors.specific-force-in-g-or-bias",
            file=source,
            quantity="accel",
            length=length,
        )
    elif length < NO_GRAVITY and max(triad.uncertainty.axis("bias")) < STANDARD_GRAVITY:
        # Of channels that were zeroed, gravity is in the bias, if that is stated so large.
        add_warning(
            found,
            "sensors.specific-force-before-crash-length",
            file=source,
            quantity="accel",
            length=length,
        )
    return found


def _judge_rate(
    source: str, unit: CrashUnit, triad: RecordedTriad, groups: tuple[AxisGroup, ...]
) -> list[Finding]:
    largest = max(float(np.abs(g.values).max()) for g in groups)
    limit = max(triad.uncertainty.axis("full_scale"))
    stated = math.isfinite(limit)
    if largest > (5.0 * limit if stated else FASTEST_TURN):
        raise DataError(
            "sensors.rates-beyond-range" if stated else "sensors.rates-beyond-vehicle",
            file=source,
            quantity="gyro",
            largest=largest,
            limit=limit,
            as_deg=largest / DEGREES,
        )
    return _over_range(source, triad, groups, "sensors.rate-beyond-range")


def _over_range(
    source: str, triad: RecordedTriad, groups: tuple[AxisGroup, ...], code: str
) -> list[Finding]:
    limits = np.array(triad.uncertainty.axis("full_scale"))
    peak = np.zeros(3)
    for g in groups:
        peak[list(g.axes)] = np.abs(g.values).max(axis=0)
    over = peak > OVER_RANGE * limits
    if not over.any():
        return []
    axis = int(np.argmax(peak / limits))
    return [
        Finding(
            code,
            file=source,
            quantity="full_scale",
            axis="xyz"[axis],
            peak=peak[axis],
            limit=limits[axis],
        )
    ]
