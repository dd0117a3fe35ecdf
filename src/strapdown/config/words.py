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
    return _checked(text, LONGEST_NAME, "leave it out")


def word(text: str) -> str:
    """Check text of one line that may not be empty."""
    return words(_filled(text))


def file_name(text: str) -> str:
    """Check the path of a file."""
    escape = (
        "a backslash in double quotation marks begins an escape: write the path in single ones, "
        "'C:\\case\\record.csv', or with /"
    )
    return _checked(_filled(text), LONGEST_PATH, escape)


def _filled(text: str) -> str:
    if not text.strip():
        raise refuse("", "config.empty")
    return text


def _checked(text: str, longest: int, remedy: str) -> str:
    if len(text) > longest:
        what = f"it has {len(text)} characters"
        raise refuse("", what, f"shorten it to {longest} characters")
    for k, char in enumerate(text):
        if unicodedata.category(char) in _CONTROL or char in _TURNING:
            what = f"character {k + 1} is {char!a}, which cannot be shown"
            raise refuse("", what, remedy)
    return text
