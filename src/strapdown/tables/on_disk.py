"""Arrays of a long log in an unnamed file, mapped into memory: only what is in use takes memory.

A program that goes through such an array part by part, and lets go of each, needs the memory of a
part, however long the log is.
"""

from __future__ import annotations

import mmap
import os
import tempfile
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

__all__ = ["LARGE", "let_go", "room"]

#: Bytes from which on an array is in a file.
LARGE = 1 << 26


def room(shape: tuple[int, ...]) -> NDArray[np.float64]:
    """Return an array to be filled; in memory if it is small, or if the disk has no place for it.

    The file is in the folder for temporary files, without a name, and gone with the array.
    """
    size = 8 * int(np.prod(shape))
    if size >= LARGE and hasattr(os, "posix_fallocate") and hasattr(mmap, "MADV_DONTNEED"):
        try:
            with tempfile.TemporaryFile() as file:
                # A page that the disk has no place for would end the process by a signal.
                os.posix_fallocate(file.fileno(), 0, size)
                return np.ndarray(shape, np.float64, buffer=mmap.mmap(file.fileno(), size))
        except OSError:
            pass
    return np.empty(shape)


def let_go(array: NDArray[np.float64] | pd.DataFrame) -> None:
    """Give back the memory of an array of `room`, of which any is a view; others stay as they are.

    The numbers are read from the file when they are used again.
    """
    base: Any = array.iloc[:, 0].to_numpy() if isinstance(array, pd.DataFrame) else array
    while isinstance(base, np.ndarray):
        base = base.base
    if isinstance(base, mmap.mmap):
        base.madvise(mmap.MADV_DONTNEED)
