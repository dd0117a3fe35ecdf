"""What a run read: its files, and what each column of a log was taken for."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

__all__ = ["InputFiles", "Reading"]


@dataclass(frozen=True)
class InputFiles:
    """Files that a result depends on.

    Attributes
    ----------
    role : str
        ``log``, ``truth``, ``gyro-bias``, ``reference-log`` or ``sensor``.
    path : Path
        As it was given: a file, or a folder.
    files : tuple of Path
        Every file that was read.
    digests : tuple of str
        SHA-256 of each when it was read.
    copied : bool
        Whether a bundle copies them, whatever their size: they are of tables in memory, and exist
        nowhere else.
    """

    role: str
    path: Path
    files: tuple[Path, ...]
    digests: tuple[str, ...]
    copied: bool = False


@dataclass(frozen=True)
class Reading:
    """What a reader took one column of a log for.

    Attributes
    ----------
    source : str
        Name of the column in the file.
    quantity : str
        Column of the table that it became, with a sign where it was reversed.
    unit : str
        Unit in the file.
    why : str
        What that was concluded from.
    first : float or str
        The first value, as it stands in the file.
    """

    source: str
    quantity: str
    unit: str
    why: str
    first: float | str
