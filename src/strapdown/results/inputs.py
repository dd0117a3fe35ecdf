"""Inputs of a run: its files, and the interpretation of each log column."""

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
        As given: a file, or a folder.
    files : tuple of Path
        Every file that was read.
    digests : tuple of str
        SHA-256 of each when it was read.
    copied : bool
        Whether a bundle copies them, whatever their size: they come from tables in memory and
        exist only there.
    """

    role: str
    path: Path
    files: tuple[Path, ...]
    digests: tuple[str, ...]
    copied: bool = False


@dataclass(frozen=True)
class Reading:
    """Interpretation of one column of a log.

    Attributes
    ----------
    source : str
        Name of the column in the file.
    quantity : str
        Table column that it became, with a sign if it was reversed.
    unit : str
        Unit in the file.
    why : str
        Reason for this interpretation.
    first : float or str
        The first value, as written in the file.
    """

    source: str
    quantity: str
    unit: str
    why: str
    first: float | str
