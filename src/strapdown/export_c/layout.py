"""How a comment, a statement and a number stand in the C file."""

from __future__ import annotations

import textwrap

WIDTH = 100


def comment(text: str, indent: str = "") -> list[str]:
    """Lines of a C comment."""
    paragraphs = [" ".join(p.split()) for p in text.strip().split("\n\n")]
    room = WIDTH - len(indent) - 3
    if len(paragraphs) == 1 and len(paragraphs[0]) <= room - 3:
        return [f"{indent}/* {paragraphs[0]} */"]
    lines: list[str] = []
    for paragraph in paragraphs:
        lines += [*([""] if lines else []), *textwrap.wrap(paragraph, room)]
    return [
        f"{indent}/* {lines[0]}",
        *(f"{indent} * {line}".rstrip() for line in lines[1:]),
        f"{indent} */",
    ]


# A blank at which no line is broken.
TIE = "\0"


def wrapped(text: str, indent: str) -> list[str]:
    """One statement, broken at blanks where it is too long."""
    lines = textwrap.wrap(
        text,
        WIDTH,
        initial_indent=indent,
        subsequent_indent=indent + "    ",
        break_long_words=False,
        break_on_hyphens=False,
    )
    return [line.replace(TIE, " ") for line in lines]


def number(value: float) -> str:
    """A literal: whole numbers as such, others as R(...), which is of the precision chosen."""
    if isinstance(value, int):
        return str(int(value))
    return f"R({value!r})"
