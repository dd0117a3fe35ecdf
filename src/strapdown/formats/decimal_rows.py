"""Fast writing of rows of numbers with fixed decimals."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

__all__ = ["write_decimals"]

Array = NDArray[np.float64]
# Rows converted to text at once.
PIECE = 1 << 15


def write_decimals(
    path: Path,
    columns: Sequence[Array],
    decimals: Sequence[int],
    *,
    separator: str = " ",
    head: str = "",
) -> None:
    """Write columns of numbers as lines.

    Parameters
    ----------
    path : Path
    columns : sequence of ndarray, (n,)
        Finite numbers.
    decimals : sequence of int
        Decimals of each column, 0 to 15. The error of a number is at most half a unit of its
        last decimal, plus the precision of a double.
    separator : str
        One ASCII character.
    head : str
        Header text, with its line feeds.
    """
    from strapdown._kernels.decimal_text import WIDTH, decimal_text

    count = columns[0].size
    places = np.array(decimals, dtype=np.int64)
    text = np.empty(min(count, PIECE) * len(columns) * WIDTH, dtype=np.uint8)
    with path.open("wb") as stream:
        stream.write(head.encode())
        for first in range(0, count, PIECE):
            rows = np.column_stack([c[first : first + PIECE] for c in columns])
            written = decimal_text(rows, places, ord(separator), text)
            if written < 0:
                # A number of more than 15 digits.
                form = separator.join(f"%.{d}f" for d in decimals) + "\n"
                stream.write("".join(form % tuple(row) for row in rows.tolist()).encode())
            else:
                stream.write(text[:written].data)
