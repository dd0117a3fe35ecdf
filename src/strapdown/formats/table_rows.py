"""Translation of errors from table rows to file rows."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from strapdown.errors import DataError

__all__ = ["told_by_file_rows"]


@contextmanager
def told_by_file_rows(name: str, row_of: Callable[[int], int | None]) -> Iterator[None]:
    """Re-raise errors of a table with the row of its file.

    Parameters
    ----------
    name : str
        File name.
    row_of : callable
        Maps a row of the table, from 0, to a row of the file.

    Raises
    ------
    DataError
        As raised within, with the row of the file.
    """
    try:
        yield
    except DataError as error:
        row = error.finding.row
        raise DataError(
            error.finding, file=name, row=None if row is None else row_of(row - 1)
        ) from None
