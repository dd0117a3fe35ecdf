"""What is said of a row of a table, said of the row of the file that it was read from."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager

import pandas as pd

from strapdown.errors import DataError, DivergenceError, Finding
from strapdown.tables.checks import source_of

__all__ = ["in_file", "said_of_file"]


def in_file(findings: Iterable[Finding], *tables: pd.DataFrame) -> tuple[Finding, ...]:
    """Count rows as their file does.

    Parameters
    ----------
    findings : iterable of Finding
        Their rows count from 1 in a table.
    *tables : DataFrame
        Tables whose ``attrs`` may have a ``first_row``: the row of the file in which their first
        one stands, or None where rows between were left out.

    Returns
    -------
    tuple of Finding
        Without a row where it is not known.
    """
    known = {t.attrs.get("source"): t.attrs["first_row"] for t in tables if "first_row" in t.attrs}
    return tuple(
        one.replace(row=_moved(one.row, known[one.file]))
        if one.row is not None and one.file in known
        else one
        for one in findings
    )


def _moved(row: int, first: int | None) -> int | None:
    return None if first is None else first + row - 1


@contextmanager
def said_of_file(*tables: pd.DataFrame) -> Iterator[None]:
    """Errors that are raised within name rows of the file, and the first table's file at least."""
    try:
        yield
    except DivergenceError as error:
        said = error.finding
        if said.file is not None or not tables:
            raise
        raise error.replaced(file=source_of(tables[0])) from None
    except DataError as error:
        said = error.finding
        (moved,) = in_file((said,), *tables)
        if moved == said:
            raise
        raise error.replaced(row=moved.row) from None
