"""Text from outside as text that shows what it is: no character acts, none is invisible."""

from __future__ import annotations

import unicodedata

__all__ = ["plain_text"]

_CUT = "… ({} characters)"
# More of them on one letter would run over the lines above and below.
_MOST_COMBINING = 3
# Control, format (direction, zero width), lone surrogates, private use: none has its own shape.
_SHAPELESS = frozenset({"Cc", "Cf", "Cs", "Co"})
_COMBINING = frozenset({"Mn", "Me"})


def plain_text(text: str, limit: int = 4000, *, lines: bool = False) -> str:
    r"""Text in which every character is seen and none commands.

    Parameters
    ----------
    text : str
        From a file, a case or a person.
    limit : int
        Longest result; a longer text is cut and says how long it was.
    lines : bool
        Whether ends of lines stay; otherwise they are spaces, as are tabs.

    Returns
    -------
    str
        Characters without a shape (``\x00``, the override of direction U+202E, the joiner of zero
        width U+200D, a lone surrogate) stand as ``[U+202E]``; so does what follows the third
        combining mark on one letter. Plain text is unchanged, so that a second pass does nothing.
    """
    marked = _marked(text[:limit].replace("\r\n", "\n"), "\n" if lines else " ")
    if len(text) <= limit and len(marked) <= limit:
        return marked
    count = _CUT.format(len(text))
    return marked[: max(0, limit - len(count))] + count


def _marked(text: str, end_of_line: str) -> str:
    # What is printable has a shape; only a heap of combining marks can be wrong with it.
    if text.isprintable() and (text.isascii() or not _COMBINING & _kinds(text)):
        return text
    out: list[str] = []
    combining = 0
    for char in text:
        kind = unicodedata.category(char)
        combining = combining + 1 if kind in _COMBINING else 0
        if char in "\n\r\u2028\u2029":
            out.append(end_of_line)
        elif char == "\t":
            out.append(" ")
        elif kind in _SHAPELESS or _is_no_character(char) or combining > _MOST_COMBINING:
            out.append(f"[U+{ord(char):04X}]")
        else:
            out.append(char)
    return "".join(out)


def _kinds(text: str) -> set[str]:
    return set(map(unicodedata.category, set(text)))


def _is_no_character(char: str) -> bool:
    code = ord(char)
    return code & 0xFFFE == 0xFFFE or 0xFDD0 <= code <= 0xFDEF
