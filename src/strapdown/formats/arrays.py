"""Named arrays from binary files, laid out as columns."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import DataError, Finding
from strapdown.formats.columns import read_name
from strapdown.formats.recording import RawLog
from strapdown.tables import SAMPLINGS

RATES = ("sampling_rate", "sample_rate", "rate_hz", "fs", "freq", "frequency")
# An array is refused if it declares more than SMALL and exceeds its stored bytes by this ratio.
LARGEST_RATIO = 1000
SMALL = 64 * 1024 * 1024  # bytes


def refuse_lie(declared: int, stored: int, what: str, file: str) -> None:
    """Refuse an array that declares far more data than its file can hold.

    Parameters
    ----------
    declared, stored : int, bytes
    what : str
        Name of the array.
    file : str

    Raises
    ------
    DataError
    """
    if declared > SMALL and declared > LARGEST_RATIO * max(stored, 1):
        raise DataError(
            "io.claims-bytes-stored", file=file, quantity=what, declared=declared, stored=stored
        )


def raw_log(
    path: Path,
    arrays: dict[str, NDArray[Any]],
    units: dict[str, str],
    meta: dict[str, Any],
) -> RawLog:
    """Convert named arrays to columns of one length.

    Parameters
    ----------
    path : Path
    arrays : dict of str to ndarray
        One- and two-dimensional; a second dimension of up to 16 becomes ``name[0]``,
        ``name[1]`` …
    units : dict of str to str
        Where the file states them.
    meta : dict
        May hold ``sampling``, ``axes`` and a sampling rate.

    Returns
    -------
    RawLog

    Raises
    ------
    DataError
        No numeric array has two samples or more.
    """
    columns: dict[str, NDArray[Any]] = {}
    for name, array in arrays.items():
        columns |= _columns(name, np.squeeze(array))
    if not columns:
        raise DataError(
            "io.no-array-of-numbers",
            file=path.name,
            arrays=", ".join([*arrays, *meta]) or "nothing",
        )
    samples = _samples(columns)
    findings = _left_out(columns, samples, path.name)
    columns = {n: c for n, c in columns.items() if c.size == samples}
    sampling, axes = _text(meta.get("sampling")), _text(meta.get("axes"))
    return RawLog(
        name=path.name,
        files=(path,),
        columns=columns,
        units={n: units[b] for n in columns if (b := n.partition("[")[0]) in units},
        rate=_rate(meta),
        sampling=sampling if sampling in SAMPLINGS else None,
        axes="x,y,z" if axes == "forward-right-down" else None,
        findings=findings,
    )


def _left_out(columns: dict[str, NDArray[Any]], samples: int, file: str) -> list[Finding]:
    """List arrays whose length differs from the gyro's; refuse stamps of another length."""
    other = {n: c.size for n, c in columns.items() if c.size != samples}
    for name, size in other.items():
        if read_name(name).quantity == "time":
            raise DataError(
                "io.values-gyro-samples",
                file=file,
                quantity="time",
                name=name,
                size=size,
                samples=samples,
            )
    if not other:
        return []
    listed = ", ".join(f"{name} ({size} values)" for name, size in other.items())
    return [
        Finding(
            "io.left-out-because-gyro-samples",
            file=file,
            severity="note",
            samples=samples,
            listed=listed,
        )
    ]


def _columns(name: str, array: NDArray[Any]) -> dict[str, NDArray[Any]]:
    if array.dtype.kind not in "iufbM" or array.ndim not in (1, 2) or array.size < 2:
        return {}
    if array.ndim == 1:
        return {name: array}
    # One row per sample; MATLAB files often have one column per sample.
    rows = array.T if array.shape[0] < array.shape[1] else array
    if rows.shape[1] > 16:
        return {}
    return {f"{name}[{k}]": np.ascontiguousarray(rows[:, k]) for k in range(rows.shape[1])}


def _samples(columns: dict[str, NDArray[Any]]) -> int:
    """Return the length of the gyro's arrays, or else the most common length."""
    lengths = [c.size for n, c in columns.items() if str(read_name(n).quantity).startswith("gyro")]
    lengths = lengths or [c.size for c in columns.values()]
    return int(max(set(lengths), key=lengths.count))


def _rate(meta: dict[str, Any]) -> float | None:
    """Return the stated sampling rate, given as a number or as text with its unit."""
    for key in RATES:
        text = _text(meta.get(key)) or ""
        match = re.fullmatch(r"\s*([\d.eE+-]+)\s*(Hz)?\s*", text, re.I)
        try:
            rate = float(match.group(1)) if match else math.nan
        except ValueError:
            continue
        if math.isfinite(rate) and rate > 0:
            return rate
    return None


def _text(value: Any) -> str | None:
    if value is None:
        return None
    if isinstance(value, bytes):
        return value.decode("utf-8", "replace")
    if isinstance(value, np.ndarray):
        return _text(value.reshape(-1)[0]) if value.size else None
    return str(value)
