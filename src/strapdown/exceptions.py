"""What strapdown raises and what it reports: one root, one form of message.

Every message answers four questions: in which file, at which row or line, about
which quantity, and what to do now.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from dataclasses import dataclass

__all__ = [
    "ConfigError",
    "DataError",
    "DivergenceError",
    "Finding",
    "StrapdownError",
    "nearest",
]


@dataclass(frozen=True)
class Finding:
    """Something a reader or a stage noticed and a person should know.

    Attributes
    ----------
    what : str
        What was found, with the numbers that show it.
    file : str, optional
        Name of the file or source that it concerns.
    row : int, optional
        Row of the file, counted from 1 and including any header, as an editor
        or a spreadsheet counts; for binary files the sample, counted from 1.
    quantity : str, optional
        The column or quantity.
    remedy : str, optional
        What the user can do about it.
    line : int, optional
        Line of a file that a person wrote, counted from 1; such a file has no rows.
    """

    what: str
    file: str | None = None
    row: int | None = None
    quantity: str | None = None
    remedy: str | None = None
    line: int | None = None

    def __str__(self) -> str:
        place = [self.file] if self.file else []
        if self.row is not None:
            place.append(f"row {self.row}")
        if self.line is not None:
            place.append(f"line {self.line}")
        if self.quantity:
            place.append(self.quantity)
        text = f"{', '.join(place)}: {self.what}" if place else self.what
        return f"{text}\n  Remedy: {self.remedy}" if self.remedy else text


class StrapdownError(Exception):
    """Root of every error that strapdown raises on purpose.

    Parameters
    ----------
    what : str
        What is wrong, with the numbers that show it.
    file, row, quantity, remedy, line
        As in `Finding`.
    """

    exit_code = 1

    def __init__(
        self,
        what: str,
        *,
        file: str | None = None,
        row: int | None = None,
        quantity: str | None = None,
        remedy: str | None = None,
        line: int | None = None,
    ) -> None:
        self.finding = Finding(what, file, row, quantity, remedy, line)
        super().__init__(str(self.finding))


class DataError(StrapdownError):
    """The data cannot be used as they are."""

    exit_code = 3


class ConfigError(StrapdownError):
    """What was asked for cannot be done, or was not understood."""

    exit_code = 4


class DivergenceError(StrapdownError):
    """A computation left the range in which its result means anything."""

    exit_code = 5


def nearest(name: str, known: Iterable[str], also: Iterable[str] = ()) -> str:
    """Return a sentence that helps with an unknown name.

    Parameters
    ----------
    name : str
        The word that was not understood.
    known : iterable of str
        The words that would have been.
    also : iterable of str
        Further such words, too many to be listed.

    Returns
    -------
    str
        ``"did you mean 'x'? Known: a, b, c"``, or the list alone when nothing
        is near.
    """
    words = list(known)
    close = difflib.get_close_matches(name, [*words, *also], n=1, cutoff=0.5)
    hint = f"did you mean '{close[0]}'? " if close else ""
    return f"{hint}Known: {', '.join(words)}."
