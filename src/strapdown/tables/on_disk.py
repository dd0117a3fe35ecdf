"""Arrays of a long log in an unnamed file, mapped into memory: only what is in use takes memory.

A program that goes through such an array part by part, and lets go of each, needs the memory of a
part, however long the log is.
"""

from __future__ import annotations

import ctypes
import math
import mmap
import os
import tempfile
import weakref
from collections.abc import Callable, Iterator
from functools import cache
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

#: Bytes from which on an array is in a file.
LARGE = 1 << 22
#: Bytes of an array that are used at a time.
PART = 1 << 21
_MAPS: weakref.WeakSet[mmap.mmap] = weakref.WeakSet()


def room(
    shape: tuple[int, ...],
    kind: np.dtype[Any] | type[np.generic] = np.float64,
    *,
    large: int | None = None,
    most: float = math.inf,
) -> NDArray[Any]:
    """Return an array to be filled; in memory if it is small, or if the disk has no room for it.

    The file is in the folder for temporary files, without a name, and gone with the array. A
    process that forks shares it with its child. In memory on macOS and Windows.

    `large`: bytes from which on it is in a file, `LARGE` by default. `MemoryError`: it is not, and
    has more than `most` bytes.
    """
    size = np.dtype(kind).itemsize * math.prod(shape)
    if (
        size >= (LARGE if large is None else large)
        and hasattr(os, "posix_fallocate")
        and hasattr(mmap, "MADV_DONTNEED")
    ):
        try:
            with tempfile.TemporaryFile() as file:
                # A page that the disk has no room for would end the process by a signal.
                os.posix_fallocate(file.fileno(), 0, size)
                mapped = mmap.mmap(file.fileno(), size)
            _MAPS.add(mapped)
            return np.ndarray(shape, kind, buffer=mapped)
        except OSError:
            pass
    if size > most:
        raise MemoryError(size)
    return np.empty(shape, kind)


def parts_of(rows: int, width: int) -> Iterator[slice]:
    """Yield slices of so many rows, `PART` bytes of `width` doubles a row at a time."""
    some = max(1, PART // (8 * max(width, 1)))
    for begin in range(0, rows, some):
        yield slice(begin, min(begin + some, rows))


def stored(array: NDArray[Any], rows: NDArray[Any] | None = None) -> NDArray[Any]:
    """Return a copy in a `room` of its own, of all rows or of those of some indices."""
    count = len(array) if rows is None else len(rows)
    out = room((count, *array.shape[1:]), array.dtype)
    # What lies between the rows of a column of a table is read with them.
    width = max(int(np.prod(array.shape[1:])), *(abs(step) // 8 for step in array.strides[:1]))
    for part in parts_of(count, width):
        out[part] = array[part if rows is None else rows[part]]
        let_go(array)
        let_go(out)
    return out


def filled(
    count: int, numbers: Callable[[slice], NDArray[Any]], kind: type[np.generic] = np.float64
) -> NDArray[Any]:
    """Return a `room` of so many numbers, filled with those of each slice in turn."""
    out = room((count,), kind)
    for part in parts_of(count, 1):
        out[part] = numbers(part)
        let_go(out)
    return out


def step_range(time: NDArray[Any]) -> tuple[float, float]:
    """Return the smallest and the largest step of stamps, of two at least; NaN if one is NaN."""
    low, high = np.inf, -np.inf
    for part in parts_of(len(time) - 1, 1):
        steps = np.diff(time[part.start : part.stop + 1])
        low, high = np.minimum(low, steps.min()), np.maximum(high, steps.max())
        let_go(time)
    return float(low), float(high)


def let_go(array: NDArray[Any] | pd.DataFrame) -> None:
    """Give back the memory of an array of `room`, of which any is a view; others stay as they are.

    The numbers are read from the file when they are used again.
    """
    if isinstance(array, pd.DataFrame):
        let_go(array.index.to_numpy())
    base: Any = array.iloc[:, 0].to_numpy() if isinstance(array, pd.DataFrame) else array
    while isinstance(base, np.ndarray):
        base = base.base
    if isinstance(base, mmap.mmap):
        base.madvise(mmap.MADV_DONTNEED)


def let_go_of_all() -> None:
    """Give back the memory of all arrays of `room`."""
    for mapped in list(_MAPS):
        mapped.madvise(mmap.MADV_DONTNEED)


def tidy() -> None:
    """Give back all memory that is not in use, as between two stages of a run.

    What arrays in memory have left free is kept by the C library otherwise, where smaller ones lie
    between.
    """
    let_go_of_all()
    if (trim := _trim()) is not None:
        trim(0)


@cache
def _trim() -> Any:
    """The function of the GNU C library that gives back free memory; None without it."""
    try:
        return getattr(ctypes.CDLL(None), "malloc_trim", None)
    except (OSError, TypeError):
        return None
