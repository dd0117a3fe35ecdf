"""Nodes of a filter, kept in memory or, where they are many, on disk."""

from __future__ import annotations

import tempfile
import weakref
from collections.abc import Iterator
from contextlib import suppress
from typing import IO

import numpy as np
from numpy.typing import NDArray

from strapdown._kernels.smoothing import BEGIN, CORE, GROWTH, UPDATE, pack
from strapdown.exceptions import ConfigError
from strapdown.navigation.node import Node

__all__ = ["Chunk", "SmoothingTape"]

Array = NDArray[np.float64]

#: Nodes of a chunk: some megabytes.
CHUNK = 1024
#: Places in a row: time, kind, turn to level axes; then covariance, move and what was taken.
TIME, KIND, TURN, START = 0, 1, slice(2, 11), 11


class Chunk:
    """Some nodes, one after the other.

    Parameters
    ----------
    rows : ndarray, (k, room)
    size : int
        Number of physical errors, p.
    """

    def __init__(self, rows: Array, size: int) -> None:
        half = size * (size + 1) // 2
        self.time, self.kind = rows[:, TIME], rows[:, KIND]
        self.turn = rows[:, TURN].reshape(-1, 3, 3)
        self.covariance = rows[:, START : START + half]
        self.taken = rows[:, START + half : START + half + size]
        self.move = rows[:, START + half + size :]


class SmoothingTape:
    """Takes nodes, and gives them back from the last to the first.

    A node takes ``8 (11 + p (p + 1) + p)`` bytes or a little more: 2 kB with 15 errors, 5 kB with
    24. Beyond the memory that is given, they go to a file without a name, which is gone with the
    tape or with the process, whichever ends first.

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
        self.count = 0
        self._half = size * (size + 1) // 2
        width = START + self._half + size + max(self._half, CORE * size + size - CORE)
        self._memory = memory
        self._chunks: list[Array] = []
        self._used = CHUNK
        self._width = width
        self._file: IO[bytes] | None = None
        self._written = 0

    def take(self, node: Node) -> None:
        """Take a further node."""
        if self._used == CHUNK:
            self._new_chunk()
        row = self._chunks[-1][self._used]
        row[:] = 0.0
        row[TIME], row[TURN] = node.time, node.turn.ravel()
        half, size = self._half, self.size
        pack(node.covariance, row[START : START + half])
        move = row[START + half + size :]
        if node.taken is not None and node.before is not None:
            row[KIND] = UPDATE
            row[START + half : START + half + size] = node.taken
            pack(node.before, move[:half])
        elif node.transition is not None:
            row[KIND] = GROWTH
            move[: CORE * size] = node.transition[:CORE].ravel()
            move[CORE * size : CORE * size + size - CORE] = np.diagonal(node.transition)[CORE:]
        else:
            row[KIND] = BEGIN
        self._used += 1
        self.count += 1

    def times(self) -> Array:
        """Return the time of each node, (count,), s."""
        parts = [chunk.time.copy() for chunk in self.backward()]
        return np.concatenate(parts[::-1]) if parts else np.empty(0)

    def backward(self) -> Iterator[Chunk]:
        """Give the chunks, the last one first; within each the nodes are in order of time."""
        for k in range(len(self._chunks) - 1, -1, -1):
            last = k + 1 == len(self._chunks)
            rows = self._chunks[k][: self._used if last else CHUNK]
            yield Chunk(rows, self.size)
        for k in range(self._written - 1, -1, -1):
            yield Chunk(self._read(k), self.size)

    def _new_chunk(self) -> None:
        most = max(self._memory // (8 * CHUNK * self._width), 1)
        if len(self._chunks) >= most:
            self._write(self._chunks.pop(0))
        self._chunks.append(np.empty((CHUNK, self._width)))
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
                f"the smoother keeps {1e-6 * self._memory:.4g} MB in memory, and {folder} took "
                f"{took:.3g} MB of what is more: {error.strerror or error}",
                quantity="smoother, memory_mb",
                remedy="free some space there, name another folder in TMPDIR, or give more "
                "memory_mb",
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
