"""A triad as recorded: its curves in vehicle axes, and the ends of its range."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from strapdown.report.chart import Level, Line, curve
from strapdown.sensors.crash_unit import CrashUnit, RecordedTriad
from strapdown.tables import ACCEL, GYRO

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

__all__ = ["BUCKETS", "flags_in_vehicle_axes", "in_vehicle_axes", "near_levels", "triad_lines"]

#: Buckets of a curve, of which a report has many.
BUCKETS = 700
# A sensor's axis that is along one of the vehicle's within 18 deg has its limits there, too.
_ALONG = 0.95
_PART = 0.3
# Limits are drawn from this part of the range on: others would only make the signal small.
_NEAR = 0.5


def in_vehicle_axes(values: Array, C: Array) -> Array:
    """Turned; an axis that is missing spoils only what it has a part in."""
    parts = np.where(np.abs(C) < 0.02, 0.0, C)[None] * np.where(
        np.abs(C)[None] < 0.02, 0.0, values[:, None, :]
    )
    return np.asarray(parts.sum(axis=2))


def flags_in_vehicle_axes(flags: Flags, C: Array) -> Flags:
    """Whether a sensor's axis that has a part in one of the vehicle's is at its end."""
    return np.asarray((flags[:, None, :] & (np.abs(C)[None] > _PART)).any(axis=2))


def triad_lines(
    triad: RecordedTriad,
    flags: tuple[Array, Flags],
    unit: CrashUnit,
    offset: float,
    scale: float,
    span: tuple[float, float],
    look: tuple[str, str],
    legend: Callable[[int], bool],
) -> list[list[Line]]:
    """One triad as recorded, by vehicle axis, and a symbol where it is at its end."""
    C = unit.mounting.C_vs
    stamps = triad.table.index.to_numpy(dtype=np.float64) - offset
    inside = (stamps >= span[0]) & (stamps <= span[1])
    columns = ACCEL if set(ACCEL) & set(triad.table.columns) else GYRO
    # An axis that was not recorded has no column.
    whole = triad.table.reindex(columns=columns).to_numpy(dtype=np.float64)
    values = in_vehicle_axes(whole[inside], C) / scale
    at, ends = flags
    ends = flags_in_vehicle_axes(ends, C) & ((at >= span[0]) & (at <= span[1]))[:, None]
    out = []
    for k in range(3):
        name = f"{triad.name}, as recorded"
        line = curve(name, 1e3 * stamps[inside], values[:, k], look[0], look[1], 1.1, BUCKETS)
        lines = [replace(line, legend=legend(k))]
        held = at[ends[:, k]]
        if held.size and inside.any():
            found = np.interp(held, stamps[inside], values[:, k])
            lines.append(
                Line(
                    f"{triad.name} at the end of its range",
                    1e3 * held,
                    found,
                    look[0],
                    points=True,
                    symbol="triangle-up",
                    hollow=True,
                    size=7.0,
                )
            )
        out.append(lines)
    return out


def near_levels(
    triad: RecordedTriad, C: Array, lines: Sequence[Line], axis: int, scale: float, unit: str
) -> list[Level]:
    """Ends of the range that a signal comes near, where they are along one axis."""
    own = int(np.argmax(np.abs(C[axis])))
    if abs(C[axis, own]) < _ALONG:
        return []
    limit = triad.uncertainty.axis("full_scale")[own] / scale
    values = np.concatenate([line.y for line in lines] or [np.empty(0)])
    values = values[np.isfinite(values)]
    if not math.isfinite(limit) or not values.size:
        return []
    reached = ((1.0, float(values.max())), (-1.0, -float(values.min())))
    name = triad.name
    return [
        Level(sign * limit, f"{name}: {'+' if sign > 0 else '−'}{limit:.3g} {unit}")
        for sign, most in reached
        if most > _NEAR * limit
    ]
