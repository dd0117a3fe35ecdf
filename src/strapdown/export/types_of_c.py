"""Types of the subset, and their names in C.

A scalar is a string; an array ``("A", scalar, dimensions, layout)`` with the layout "C" (contiguous)
or "A" (any strides, counted in elements); a tuple ``("T", type, ...)``; a list ``("L", type)``.
"""

from __future__ import annotations

import re
import textwrap
from typing import Any

Type = Any

WIDTH = 100
#: A blank at which no line is broken.
TIE = "\xa0"
OPERATOR = re.compile(r"(?<= )([-+*/%<>?:]|[<>=!]=|&&|\|\|) ")


def wrapped(text: str, indent: str) -> list[str]:
    """One statement, broken at blanks, before operators, where it is too long."""
    lines = textwrap.wrap(
        OPERATOR.sub(rf"\1{TIE}", text),
        WIDTH,
        initial_indent=indent,
        subsequent_indent=indent + "    ",
        break_long_words=False,
        break_on_hyphens=False,
    )
    return [line.replace(TIE, " ") for line in lines]


SCALARS = {
    "f8": "double",
    "f4": "float",
    "i8": "int64_t",
    "u8": "uint64_t",
    "u1": "uint8_t",
    "i1": "int8_t",
    "b1": "bool",
}
_ORDER = ("b1", "u1", "i1", "i8", "u8", "f4", "f8")


def is_array(kind: Type) -> bool:
    return isinstance(kind, tuple) and kind[0] == "A"


def is_tuple(kind: Type) -> bool:
    return isinstance(kind, tuple) and kind[0] == "T"


def is_list(kind: Type) -> bool:
    return isinstance(kind, tuple) and kind[0] == "L"


def is_float(kind: Type) -> bool:
    return kind in ("f8", "f4")


def unify(a: Type, b: Type) -> Type:
    """Return the type that holds values of both, as numba joins them; None for none."""
    if a == b:
        return a
    if isinstance(a, str) and isinstance(b, str):
        if {a, b} == {"f4", "i8"} or {a, b} == {"i8", "u8"}:
            return "f8"
        return max(a, b, key=_ORDER.index)
    if is_array(a) and is_array(b) and a[1:3] == b[1:3]:
        return (*a[:3], "A")
    if is_tuple(a) and is_tuple(b) and len(a) == len(b):
        parts = tuple(unify(x, y) for x, y in zip(a[1:], b[1:], strict=True))
        return None if None in parts else ("T", *parts)
    return None


def arithmetic(a: str, b: str) -> str:
    """Type of a sum or product of two scalars, as in numba."""
    if is_float(a) or is_float(b):
        return "f4" if {a, b} <= {"f4", "b1", "u1", "i1"} else "f8"
    if a in ("u1", "u8") and b in ("u1", "u8"):
        return "u8"
    if "u8" in (a, b) and "i8" in (a, b):
        return "f8"
    return "i8"


class Names:
    """Names in C of the types used, and their definitions in order."""

    scalars = SCALARS

    def __init__(self) -> None:
        self.known: dict[Type, str] = {}
        self.text: list[str] = []

    def __call__(self, kind: Type) -> str:
        if kind is None:
            return "void"
        if isinstance(kind, str):
            return self.scalars[kind]
        if kind not in self.known:
            self.known[kind] = self._define(kind)
        return self.known[kind]

    def declared(self, kind: Type, name: str, const: bool = False) -> str:
        """Declare a variable, or a parameter."""
        return f"{self(kind)}{TIE}{name}"

    def _define(self, kind: Type) -> str:
        if is_array(kind):
            _, scalar, n, layout = kind
            name = f"{'array' if layout == 'C' else 'strided'}{n}_{scalar}"
            sizes = ", ".join(f"n{k}" for k in range(n))
            strides = (
                "" if layout == "C" else " int64_t " + ", ".join(f"s{k}" for k in range(n)) + ";"
            )
            self.text.append(
                f"typedef struct {{ {SCALARS[scalar]} *data; int64_t {sizes};{strides} }} {name};"
            )
            return name
        if is_list(kind):
            inner = self(kind[1])
            name = f"list_{inner}"
            self.text.append(f"typedef struct {{ {inner} *data; int64_t n0, room; }} {name};")
            return name
        parts = [self(part) for part in kind[1:]]
        if len(set(kind[1:])) == 1 and isinstance(kind[1], str):
            name = f"{kind[1]}x{len(kind) - 1}"
        else:
            name = f"tuple{len([k for k in self.known.values() if k.startswith('tuple')]) + 1}"
            self.known[kind] = name
        fields = " ".join(f"{part} f{k};" for k, part in enumerate(parts))
        self.text.append(f"typedef struct {{ {fields} }} {name};")
        return name
