"""Texts from files that nobody vouches for: what may stand in a name or a message."""

from __future__ import annotations

import unicodedata

__all__ = ["LONGEST_NAME", "LONGEST_TEXT", "clean", "unique"]

LONGEST_NAME = 120
LONGEST_TEXT = 400


def clean(text: str, longest: int = LONGEST_TEXT) -> str:
    """Text on one line, without characters that steer a terminal or turn the direction of reading.

    Parameters
    ----------
    text : str
    longest : int
        What is longer is cut, and ends with three dots.

    Returns
    -------
    str
        Markup stays: it is for who writes a page to escape it.
    """
    # Of a very long text no more than can be kept is looked at.
    kept = "".join(
        " " if c.isspace() else "\N{REPLACEMENT CHARACTER}" if _steers(c) else c
        for c in text[: 4 * longest]
    )
    kept = " ".join(kept.split())
    return kept if len(kept) <= longest else kept[: longest - 1] + "…"


def _steers(character: str) -> bool:
    return unicodedata.category(character) in ("Cc", "Cf", "Cs", "Co", "Cn")


def unique(names: list[str]) -> list[str]:
    """The same names, each one once: a second ``ax`` is ``ax (2)``."""
    taken: set[str] = set()
    out = []
    for name in names:
        other, count = name, 1
        while other in taken:
            count += 1
            other = f"{name} ({count})"
        taken.add(other)
        out.append(other)
    return out
