"""Text that stands in a title, a table or the name of a file, and what may not be in it."""

from __future__ import annotations

import unicodedata

from strapdown.config.spec import refuse

__all__ = ["file_name", "word", "words"]

#: Characters that a title or a name, and the path of a file, may have.
LONGEST_NAME = 200
LONGEST_PATH = 4096
# Control characters, halves of pairs, ends of lines and of paragraphs.
_CONTROL = {"Cc", "Cs", "Zl", "Zp"}
# They turn the order of what follows: a name could show as another one.
_TURNING = frozenset("\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069")


def words(text: str) -> str:
    """Check text of one line, which may be empty."""
    return _checked(text, LONGEST_NAME, "config.unprintable-character")


def word(text: str) -> str:
    """Check text of one line that may not be empty."""
    return words(_filled(text))


def file_name(text: str) -> str:
    """Check the path of a file."""
    return _checked(_filled(text), LONGEST_PATH, "config.unprintable-character-in-path")


def _filled(text: str) -> str:
    if not text.strip():
        raise refuse("", "config.text-empty")
    return text


def _checked(text: str, longest: int, unprintable: str) -> str:
    if len(text) > longest:
        raise refuse("", "config.text-too-long", length=len(text), longest=longest)
    for k, char in enumerate(text):
        if unicodedata.category(char) in _CONTROL or char in _TURNING:
            raise refuse("", unprintable, position=k + 1, character=ascii(char))
    return text
