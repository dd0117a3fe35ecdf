"""Results of a reconstruction as a small table and as text lines."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from strapdown.constants import TWO_SIDED_95
from strapdown.crash.pdof import NedPdof
from strapdown.tables import NED

if TYPE_CHECKING:
    from strapdown.crash.delta_v_bound import VelocityChange
    from strapdown.crash.path import CrashPath
    from strapdown.crash.unit_reconstruction import UnitReconstruction

__all__ = ["change_line", "path_line", "summary_table", "unit_line"]

Row = tuple[str, str, float, float, float]


def summary_table(units: Sequence[UnitReconstruction]) -> pd.DataFrame:
    """Changes of velocity, directions of force and ends of the path, with 95 % bounds.

    Parameters
    ----------
    units : sequence of UnitReconstruction

    Returns
    -------
    DataFrame
        Indexed by ``unit``, ``part`` (number and type of the event, or ``path``) and
        ``quantity``; ``value``, ``low`` and ``high`` in the unit that the quantity names, with
        95 % bounds.
    """
    index, rows = [], []
    for unit in units:
        for part, quantity, value, low, high in _unit_rows(unit):
            index.append((unit.name, part, quantity))
            rows.append((value, low, high))
    return pd.DataFrame(
        rows,
        index=pd.MultiIndex.from_tuples(index, names=["unit", "part", "quantity"]),
        columns=["value", "low", "high"],
        dtype=np.float64,
    )


def _unit_rows(unit: UnitReconstruction) -> list[Row]:
    rows: list[Row] = []
    for k, (changes, kind) in enumerate(zip(unit.body, unit.types, strict=True), start=1):
        part = f"{k} {kind.name}"
        whole, peak = changes.event, changes.peak
        event = unit.events.events[k - 1]
        sd = TWO_SIDED_95 * event.time_zero_sd
        rows.append((part, "time zero s", *_about(event.time_zero, sd)))
        for name, value, half in zip(
            ("delta-V forward m/s", "delta-V right m/s", "delta-V down m/s"),
            whole.delta_v.vector.tolist(),
            whole.bound.half_width,
            strict=True,
        ):
            rows.append((part, name, *_about(value, half)))
        length = 1e3 * (peak.delta_v.end - peak.delta_v.start)
        for name, change in (
            ("delta-V resultant m/s", whole),
            (f"largest in {length:.3g} ms m/s", peak),
        ):
            rows.append((part, name, *_about(change.resultant, change.resultant_bound)))
        rows.append((part, "PDOF deg", *_direction(whole)))
    path = unit.path
    ends = TWO_SIDED_95 * path.sd.iloc[-1]
    for axis in NED:
        value = float(path.table[axis].iloc[-1])
        rows.append(("path", f"end {axis} m", *_about(value, float(ends[axis]))))
    return rows


def _about(value: float, half: float) -> tuple[float, float, float]:
    return value, value - half, value + half


def _direction(change: VelocityChange) -> tuple[float, float, float]:
    """Horizontal direction and its bounds, deg; bounds within half a turn of the direction."""
    across = change.interval.horizontal
    at = change.pdof.azimuth_deg if isinstance(change.pdof, NedPdof) else change.pdof.horizontal_deg
    turn = 360.0 * round((at - 0.5 * (across.low_deg + across.high_deg)) / 360.0)
    return at, across.low_deg + turn, across.high_deg + turn


def change_line(change: VelocityChange) -> str:
    """One change of velocity as a line of text."""
    axes = "north, east, down" if change.delta_v.frame == "ned" else "forward, right, down"
    parts = ", ".join(
        f"{v:.2f} ± {b:.2f}"
        for v, b in zip(change.delta_v.vector, change.bound.half_width, strict=True)
    )
    at, low, high = _direction(change)
    name = "azimuth" if change.delta_v.frame == "ned" else "PDOF"
    direction = (
        "not determined"
        if change.interval.horizontal.undetermined
        else f"{at:.1f} deg ({low:.1f} to {high:.1f})"
    )
    return (
        f"{change.window} {change.delta_v.start:.4f} to {change.delta_v.end:.4f} s: {axes} "
        f"{parts} m/s; {name} {direction}"
    )


def path_line(path: CrashPath) -> str:
    """End point of a path as a line of text."""
    sd = TWO_SIDED_95 * path.sd[NED].iloc[-1].to_numpy()
    ends = ", ".join(
        f"{v:.2f} ± {s:.2f}" for v, s in zip(path.table[NED].iloc[-1], sd, strict=True)
    )
    return (
        f"path {path.time[0]:.4g} to {path.time[-1]:.4g} s, ends north, east, down {ends} m from "
        f"its entry at {path.entry.time:.4g} s"
    )


def unit_line(unit: UnitReconstruction) -> str:
    """Results of one unit: a line for each event, and one for the path."""
    lines = [
        f"{unit.name}, event {k}, {kind.name}: delta-V {c.event.resultant:.2f} ± "
        f"{c.event.resultant_bound:.2f} m/s; {change_line(c.event)}"
        for k, (c, kind) in enumerate(zip(unit.body, unit.types, strict=True), start=1)
    ]
    if not lines:
        size, axis = unit.events.largest_change, unit.events.largest_axis
        lines = [f"{unit.name}: no event, at most {size:.2f} m/s ({axis})"]
    return "\n".join([*lines, f"{unit.name}, {path_line(unit.path)}"])
