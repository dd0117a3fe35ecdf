"""Crash records written as text tables: the unit in each heading, and the rest in comments."""

from __future__ import annotations

import csv as quoting
import io
import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import DataError
from strapdown.formats.crash_attributes import attributes_of
from strapdown.formats.crash_record import CrashRecord
from strapdown.formats.crash_text import clean

Array = NDArray[np.float64]

__all__ = ["NOTE", "write_crash_csv"]

#: Before what a comment says of a column.
NOTE = "# channel: "


def write_crash_csv(path: str | Path, record: CrashRecord) -> tuple[Path, ...]:
    """Write a record as text tables.

    Parameters
    ----------
    path : str or Path
        Of the table. Channels with other stamps go into tables of their own, beside it: with
        ``_2``, ``_3`` after the name.
    record : CrashRecord
        Values are written in SI, each number in the fewest digits that give it back exactly.

    Returns
    -------
    tuple of Path
        The tables.

    Raises
    ------
    DataError
        The record has no channel.
    """
    groups: dict[bytes, list[tuple[dict[str, Any], Array]]] = {}
    stamps: dict[bytes, Array] = {}
    for channel in record.channels:
        if channel.quantity == "time":
            continue
        time, values = channel.load()
        key = time.tobytes()
        stamps[key] = time
        groups.setdefault(key, []).append((attributes_of(channel), values))
    if not groups:
        raise DataError("io.record-without-channels", file=record.path.name)
    first = Path(path)
    paths = []
    for k, (key, members) in enumerate(groups.items(), start=1):
        paths.append(first if k == 1 else first.with_stem(f"{first.stem}_{k}"))
        _write(paths[-1], record.title, stamps[key], members)
    return tuple(paths)


def _write(
    path: Path, title: str, time: Array, members: list[tuple[dict[str, Any], Array]]
) -> None:
    import pyarrow as pa
    import pyarrow.csv as pa_csv

    comments = [f"# title: {clean(title)}"]
    headings = ["time [s]"]
    columns = {"0": pa.array(time)}
    for k, (said, values) in enumerate(members, start=1):
        unit = clean(said["unit"])
        headings.append(clean(said["name"]) + (f" [{unit}]" if unit else ""))
        comments.append(NOTE + json.dumps({"column": k + 1, **said}, ensure_ascii=True))
        columns[str(k)] = pa.array(values)
    line = io.StringIO()
    quoting.writer(line, lineterminator="\n").writerow(headings)
    with path.open("wb") as stream:
        stream.write(("\n".join(comments) + "\n" + line.getvalue()).encode())
        pa_csv.write_csv(pa.table(columns), stream, pa_csv.WriteOptions(include_header=False))
