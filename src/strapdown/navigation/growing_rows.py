"""Rows that are added to, without a copy of those that are there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["GrowingRows"]

Array = NDArray[np.float64]

FIRST_ROOM = 64


@dataclass
class _Room:
    buffer: Array
    used: int


@dataclass(frozen=True, eq=False)
class GrowingRows:
    """Rows of numbers: a value that never changes, whose further growth shares its memory.

    Adding to the newest value costs as much as what is added; adding to an older one copies it.

    Attributes
    ----------
    count : int
    """

    room: _Room
    count: int = 0

    @classmethod
    def of(cls, columns: int) -> GrowingRows:
        """Return no rows of so many columns."""
        return cls(_Room(np.empty((0, columns)), 0))

    @property
    def rows(self) -> Array:
        """All of them, (`count`, columns); not to be written to."""
        return self.room.buffer[: self.count]

    def and_then(self, rows: Array) -> GrowingRows:
        """Return these rows and further ones, (k, columns)."""
        room, count = self.room, self.count + len(rows)
        if room.used != self.count or count > len(room.buffer):
            size = max(FIRST_ROOM, count + count // 2)
            room = _Room(np.empty((size, room.buffer.shape[1])), self.count)
            room.buffer[: self.count] = self.rows
        room.buffer[self.count : count] = rows
        room.used = count
        return GrowingRows(room, count)

    def without_first(self, number: int) -> GrowingRows:
        """Return them without the first ones; the memory of these is given back."""
        left = self.rows[number:].copy()
        return GrowingRows(_Room(left, len(left)), len(left))
