"""Nodes of a filter, kept in memory or, where they are many, on disk."""

from __future__ import annotations

import tempfile
import weakref
from collections.abc import Iterator
from contextlib import suppress
from typing import IO

import numpy as np
from numpy.typing import NDArray

from strapdown._kernels.smoothing_rows import TIME, row_width
from strapdown.errors import ConfigError

__all__ = ["SmoothingTape"]

Array = NDArray[np.float64]

#: Nodes of a chunk: some megabytes.
CHUNK = 1024


class SmoothingTape:
    """Takes nodes, and gives them back from the last to the first.

    A node takes ``8 (11 + p (p + 1) + p)`` bytes or a little more: 2 kB with 15 errors, 5 kB with
    24. Beyond the memory that is given, they go to a file without a name, which is gone with the
    tape or with the process, whichever ends first; their times alone stay.

    Parameters
    ----------
    size : int
        Number of physical errors, p.
    memory : int, bytes

    Raises
    ------
    ConfigError
        From `take`: the folder for temporary files has no room.
    """

    def __init__(self, size: int, memory: int) -> None:
        self.size = size
        self._width = row_width(size)
        self._memory = memory
        self._chunks: list[Array] = []
        self._used = CHUNK
        self._times: list[Array] = []
        self._file: IO[bytes] | None = None
        self._written = 0

    def take(self, rows: Array) -> None:
        """Take further nodes.

        Parameters
        ----------
        rows : ndarray, (k, width)
            Of `NodeRows`.
        """
        self._times.append(rows[:, TIME].copy())
        at = 0
        while at < len(rows):
            if self._used == CHUNK:
                self._new_chunk()
            some = rows[at : at + CHUNK - self._used]
            self._chunks[-1][self._used : self._used + len(some)] = some
            self._used += len(some)
            at += len(some)

    def times(self) -> Array:
        """Return the time of each node, (count,), s."""
        self._times = [np.concatenate([np.empty(0), *self._times])]
        return self._times[0]

    def backward(self) -> Iterator[Array]:
        """Give chunks of rows, the last one first; within each they are in order of time."""
        for k in range(len(self._chunks) - 1, -1, -1):
            last = k + 1 == len(self._chunks)
            yield self._chunks[k][: self._used if last else CHUNK]
        for k in range(self._written - 1, -1, -1):
            yield self._read(k)

    def _new_chunk(self) -> None:
        most = max(self._memory // (8 * CHUNK * self._width), 1)
        if len(self._chunks) < most:
            self._chunks.append(np.empty((CHUNK, self._width)))
        else:
            self._write(self._chunks[0])
            self._chunks.append(self._chunks.pop(0))
        self._used = 0

    def _write(self, rows: Array) -> None:
        try:
            if self._file is None:
                self._file = tempfile.TemporaryFile()  # noqa: SIM115
                weakref.finalize(self, _close, self._file)
            self._file.seek(0, 2)
            self._file.write(rows.data)
            self._file.flush()
        except OSError as error:
            folder = tempfile.gettempdir()
            took = 8e-6 * CHUNK * self._width * self._written
            raise ConfigError(
                "navigation.smoother-keeps-mb-memory-took",
                quantity="smoother, memory_mb",
                memory=1e-06 * self._memory,
                folder=folder,
                took=took,
                strerror=error.strerror or error,
            ) from None
        self._written += 1

    def _read(self, number: int) -> Array:
        assert self._file is not None
        size = 8 * CHUNK * self._width
        self._file.seek(number * size)
        return np.frombuffer(self._file.read(size)).reshape(CHUNK, self._width)


def _close(file: IO[bytes]) -> None:
    """Close a file; where what it holds finds no room any more, it is not missed."""
    with suppress(OSError):
        file.close()
