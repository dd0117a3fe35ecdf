"""Errors of a table told by the rows of the file that it was read from."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from strapdown.errors import DataError

__all__ = ["told_by_file_rows"]


@contextmanager
def told_by_file_rows(name: str, row_of: Callable[[int], int | None]) -> Iterator[None]:
    """Tell errors of a table by the rows of its file.

    Parameters
    ----------
    name : str
        Of the file.
    row_of : callable
        Row of the file by that of the table, from 0.

    Raises
    ------
    DataError
        As within, with the row of the file.
    """
    try:
        yield
    except DataError as error:
        row = error.finding.row
        raise DataError(
            error.finding, file=name, row=None if row is None else row_of(row - 1)
        ) from None
