"""Named arrays, as binary files hold them, laid out as columns."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown.exceptions import DataError
from strapdown.formats.columns import read_name
from strapdown.formats.recording import RawLog

RATES = ("sampling_rate", "sample_rate", "rate_hz", "fs", "freq", "frequency")
# What a small file may unfold to; a longer log is honest about its size.
LARGEST_RATIO = 1000
SMALL = 64 * 1024 * 1024  # bytes


def refuse_lie(declared: int, stored: int, what: str, file: str) -> None:
    """Refuse an array that claims far more than its file can hold.

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
            f"it claims {declared} bytes, and {stored} are stored",
            file=file,
            quantity=what,
            remedy="the archive is damaged or made to mislead; get it again from its source",
        )


def raw_log(
    path: Path,
    arrays: dict[str, NDArray[Any]],
    units: dict[str, str],
    meta: dict[str, Any],
) -> RawLog:
    """Lay arrays out as columns of one length.

    Parameters
    ----------
    path : Path
    arrays : dict of str to ndarray
        One- and two-dimensional; a second dimension of up to 16 becomes ``name[0]``,
        ``name[1]`` …
    units : dict of str to str
        Where the file states them.
    meta : dict
        ``sampling``, ``axes`` and a sampling rate are understood.

    Returns
    -------
    RawLog

    Raises
    ------
    DataError
        There is no numeric array of two samples or more.
    """
    columns: dict[str, NDArray[Any]] = {}
    for name, array in arrays.items():
        columns |= _columns(name, np.squeeze(array))
    lengths = [c.size for c in columns.values()]
    if not lengths:
        raise DataError(
            f"no array of numbers in it; it holds: {', '.join(arrays) or 'nothing'}",
            file=path.name,
            remedy="export the log as arrays of one row a sample",
        )
    samples = _samples(columns, lengths)
    columns = {n: c for n, c in columns.items() if c.size == samples}
    return RawLog(
        name=path.name,
        files=(path,),
        columns=columns,
        units={n: units[b] for n in columns if (b := n.partition("[")[0]) in units},
        rate=_rate(meta),
        sampling=_text(meta.get("sampling")),
        axes="x,y,z" if _text(meta.get("axes")) == "forward-right-down" else None,
    )


def _columns(name: str, array: NDArray[Any]) -> dict[str, NDArray[Any]]:
    if array.dtype.kind not in "iufb" or array.ndim not in (1, 2) or array.size < 2:
        return {}
    if array.ndim == 1:
        return {name: array}
    # One row a sample; MATLAB often keeps one column a sample.
    rows = array.T if array.shape[0] < array.shape[1] else array
    if rows.shape[1] > 16:
        return {}
    return {f"{name}[{k}]": np.ascontiguousarray(rows[:, k]) for k in range(rows.shape[1])}


def _samples(columns: dict[str, NDArray[Any]], lengths: list[int]) -> int:
    """Length of the gyro's arrays, or else the most common length."""
    for name, column in columns.items():
        if str(read_name(name).quantity).startswith("gyro"):
            return int(column.size)
    return max(set(lengths), key=lengths.count)


def _rate(meta: dict[str, Any]) -> float | None:
    for key in RATES:
        if key in meta:
            rate = float(np.asarray(meta[key]).reshape(-1)[0])
            return rate if np.isfinite(rate) and rate > 0 else None
    return None


def _text(value: Any) -> str | None:
    if value is None:
        return None
    if isinstance(value, bytes):
        return value.decode("utf-8", "replace")
    if isinstance(value, np.ndarray):
        return _text(value.reshape(-1)[0]) if value.size else None
    return str(value)
