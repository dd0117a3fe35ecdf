"""The kernels that Python calls, and the types with which it does: one line each.

``ned.ned_advance(f8[:], f8[:,:], f8, (i8, b1))``: scalars, contiguous arrays, tuples; an array of any
strides has an ``s`` before its bracket.
"""

from __future__ import annotations

import re
from pathlib import Path

from strapdown.export.types_of_c import Type, is_array, is_tuple

_TOKEN = re.compile(r"\s*(?:([a-z]\d)(s?)(\[[:,]*\])?|([(),]))")


def parse(line: str) -> tuple[str, tuple[Type, ...]]:
    """Return the name of the kernel, and the types of its arguments."""
    name, _, rest = line.partition("(")
    tokens = _TOKEN.findall(f"({rest}")
    at = 0

    def one() -> Type:
        nonlocal at
        scalar, strided, bracket, sign = tokens[at]
        at += 1
        if scalar:
            return ("A", scalar, bracket.count(":"), "A" if strided else "C") if bracket else scalar
        assert sign == "("
        parts = []
        while tokens[at][3] != ")":
            if tokens[at][3] == ",":
                at += 1
                continue
            parts.append(one())
        at += 1
        return ("T", *parts)

    return name.strip(), one()[1:]


def text(name: str, kinds: tuple[Type, ...]) -> str:
    """Write a line."""
    return f"{name}({', '.join(_text(k) for k in kinds)})"


def _text(kind: Type) -> str:
    if is_array(kind):
        return f"{kind[1]}{'' if kind[3] == 'C' else 's'}[{','.join(':' * kind[2])}]"
    if is_tuple(kind):
        return f"({', '.join(_text(k) for k in kind[1:])})"
    return str(kind)


def read(path: Path) -> dict[str, list[tuple[Type, ...]]]:
    """Read the file of signatures."""
    made: dict[str, list[tuple[Type, ...]]] = {}
    for line in path.read_text(encoding="utf-8").splitlines():
        if line.strip() and not line.startswith("#"):
            name, kinds = parse(line)
            made.setdefault(name, []).append(kinds)
    return made
