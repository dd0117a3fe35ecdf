"""Triads of a text table of unknown layout, with their clock, as far as headings tell."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from strapdown.exceptions import DataError
from strapdown.formats.recording import RawLog
from strapdown.systems.crash_draft.header_words import read_heading
from strapdown.systems.crash_draft.parts import Part, Skipped
from strapdown.systems.crash_draft.table_clock import find_clock
from strapdown.systems.crash_draft.table_triads import group_columns

Array = NDArray[np.float64]

__all__ = ["LEAST_SAMPLES", "table_parts"]

#: A crash of a tenth of a second, at the slowest rate that shows it.
LEAST_SAMPLES = 8


def table_parts(path: str, raw: RawLog) -> tuple[list[Part], list[Skipped]]:
    """Find the triads of a table.

    Parameters
    ----------
    path : str
        As a case names it.
    raw : RawLog

    Returns
    -------
    parts : list of Part
    skipped : list of Skipped

    Raises
    ------
    DataError
        It holds fewer than eight samples, or no numbers.
    """
    rows = max((len(v) for v in raw.columns.values()), default=0)
    if rows < LEAST_SAMPLES:
        raise DataError(
            f"{rows} sample{'' if rows == 1 else 's'}, too few for a crash",
            file=raw.name,
            remedy=f"give the whole record: at least {LEAST_SAMPLES} samples",
        )
    columns: dict[str, Array] = {}
    skipped: list[Skipped] = []
    for name, values in raw.columns.items():
        if values.dtype.kind in "iuf":
            columns[name] = values.astype(np.float64)
        elif values.dtype.kind == "M":
            columns[name] = values.astype("datetime64[ns]").astype(np.int64) * 1e-9
        else:
            skipped.append(Skipped(path, f"column '{name}'", "it holds text", (name,)))
    if not columns:
        raise DataError(
            "no column holds numbers",
            file=raw.name,
            remedy="check that it is a record, and that its decimal sign is one for all columns",
        )
    headings = {
        name: read_heading(f"{name} [{raw.units[name]}]" if name in raw.units else name)
        for name in columns
    }
    clock, time = find_clock(columns, headings)
    others = {n: v for n, v in columns.items() if n != clock.column}
    groups, left = group_columns(others, headings)
    skipped += [Skipped(path, f"column '{name}'", why, (name,)) for name, why in left]
    stamps = np.arange(rows, dtype=np.float64) if time is None else time
    parts = []
    for group in groups:
        values = np.full((rows, 3), np.nan)
        has = [k for k, axis in enumerate("xyz") if axis in group.columns]
        for k in has:
            values[:, k] = columns[group.columns["xyz"[k]]]
        kept = np.isfinite(values[:, has]).all(axis=1)
        lost = rows - int(kept.sum())
        if int(kept.sum()) < LEAST_SAMPLES:
            names = tuple(group.columns.values())
            skipped.append(Skipped(path, ", ".join(names), "hardly a row of it is whole", names))
            continue
        parts.append(
            Part(
                path,
                group.quantity,
                group.columns,
                clock,
                group.unit,
                "axes by the headings" if group.by_heading else "axes in the order of the columns",
                stamps[kept],
                values[kept],
                label=group.label,
                named=group.by_heading,
                sampling=raw.sampling or "",
                notes=(f"{lost} rows without a value are left out",) if lost else (),
            )
        )
    return parts, skipped
