"""Cleaning of untrusted texts from files, for names and messages."""

from __future__ import annotations

import unicodedata

__all__ = ["LONGEST_NAME", "LONGEST_TEXT", "clean", "unique"]

LONGEST_NAME = 120
LONGEST_TEXT = 400


def clean(text: str, longest: int = LONGEST_TEXT) -> str:
    """Reduce a text to one line, without control or bidirectional formatting characters.

    Parameters
    ----------
    text : str
    longest : int
        Longer texts are cut and end with three dots.

    Returns
    -------
    str
        Markup is kept; escaping is left to the code that writes a page.
    """
    # Of a very long text only the part that can be kept is processed.
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
