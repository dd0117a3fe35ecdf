"""C for a device: the translation of `translate`, in what an embedded developer reads.

Numbers have one precision (``real_t``), arrays are pointers to memory of the caller, constants keep
their names, variables are declared where they begin, and comments are where the kernel has them.
"""

from __future__ import annotations

import ast
import math
import re
import textwrap
from collections.abc import Iterable
from typing import Any

from strapdown.export.sources import Constant
from strapdown.export.translate import (
    ATOM,
    MATH,
    PRODUCT,
    SUM,
    UNARY,
    Body,
    Translator,
    UntranslatableError,
    Value,
    loaded,
)
from strapdown.export.types_of_c import TIE, WIDTH, Names, Type, is_array, is_tuple, wrapped


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


RESULT = re.compile(rf"{TIE}={TIE}t\d+_\.f\d+;$")


def number(value: float) -> str:
    """A literal: integers as such, others as R(...) in the chosen precision."""
    if isinstance(value, int):
        return str(int(value))
    if math.isfinite(value):
        return f"R({value!r})"
    return "R(NAN)" if math.isnan(value) else f"{'-' if value < 0.0 else ''}R(INFINITY)"


def unpacked(call: str, targets: Iterable[str], indent: str = "    ") -> str:
    """Statements that assign the results of a function."""
    targets = list(targets)
    lines = wrapped(f"const real{len(targets)} result = {call};", indent)
    texts = (f"{t} = result.f{k};".replace(" ", TIE) for k, t in enumerate(targets))
    rows = textwrap.wrap(" ".join(texts), WIDTH - len(indent))
    return "\n".join([*lines, *(indent + row.replace(TIE, " ") for row in rows)])


class DeviceNames(Names):
    """Types of a device's C: one kind of number, ``int``, pointers."""

    scalars = {"f8": "real_t", "i8": "int", "b1": "int"}  # noqa: RUF012

    def declared(self, kind: Type, name: str, const: bool = False) -> str:
        """Declare a variable or a parameter; a matrix, of a type ``(..., width)``, by its rows."""
        if not is_array(kind):
            return super().declared(kind, name)
        if kind[2] == 1:
            return f"{f'const{TIE}' if const else ''}{self(kind[1])}{TIE}*{name}"
        # Not constant: C99 has no conversion to an array of constants.
        return f"{self(kind[1])}{TIE}(*{name})[{kind[4]}]"

    def _define(self, kind: Type) -> str:
        if not is_tuple(kind):
            raise UntranslatableError(f"a value of type {kind}")
        inner = [self(part) for part in kind[1:]]
        alike = set(inner) == {"real_t"}
        name = f"{'real' if alike else 'values'}{len(inner)}"
        while name in self.known.values():
            name += "_"
        fields = ", ".join(f"f{k}" for k in range(len(inner)))
        rows = [f"real_t {fields};"] if alike else [f"{t} f{k};" for k, t in enumerate(inner)]
        self.text += wrapped(f"typedef struct {{ {' '.join(rows)} }} {name};", "")
        return name


class DeviceBody(Body):
    """The body of one function."""

    def translate(self) -> None:
        """Fill the function's text and result."""
        self.used, self.written = loaded(self.kernel.node.body), set[str]()
        super().translate()

    def _pass(self) -> None:
        super()._pass()
        self.written = {root for name in self.changed for root in self._roots(name)}

    def _write(self) -> None:
        function, names = self.function, self._type_names()
        function.result = self.result[0] if self.result else None
        function.changes = frozenset(k for k, n in enumerate(self.parameters) if n in self.written)
        heads = []
        for name, kind in zip(self.parameters, function.kinds, strict=True):
            cls = self._class(name, kind)
            if self.variables[name, cls] != kind:
                raise UntranslatableError(f"{name} takes values of another type")
            heads.append(names.declared(kind, self._c_name(name, cls), name not in self.written))
        function.head = (
            f"static {names(function.result)} {function.name}({', '.join(heads) or 'void'})"
        )
        function.text = "\n".join(
            [
                *(comment(self.note) if self.note else []),
                *wrapped(function.head, ""),
                "{",
                *self.lines,
                "}",
                "",
            ]
        )

    def _type_names(self) -> DeviceNames:
        assert isinstance(self.all.names, DeviceNames)
        return self.all.names

    # Statements: wrapped, with comments, and with declarations.

    def emit(self, text: str) -> None:
        """Add a statement."""
        self.lines += wrapped(text, "    " * self.depth)

    def temporary(self, name: str) -> str:
        """Return a name that is none of the kernel's."""
        self.temporaries += 1
        return f"{name}{self.temporaries}_"

    def _comment(self, statement: ast.stmt) -> None:
        if text := getattr(statement, "comment", ""):
            self.lines += comment(text, "    " * self.depth)

    def _is_const(self, name: str) -> bool:
        return name not in self.written

    def _c_name(self, name: str, cls: Any) -> str:
        text = super()._c_name(name, cls)
        return f"{text}_" if text == "R" else text  # that of the literals

    def _If(self, node: ast.If) -> bool:
        at, indent = len(self.lines), "    " * self.depth
        left = super()._If(node)
        if f"{indent}}} else {{" in self.lines[at:] and isinstance(node.orelse[0], ast.If):
            at = self.lines.index(f"{indent}}} else {{", at)
            first, *rest = self.lines[at + 1 : -1]
            if first.startswith(f"{indent}    if (") and len(node.orelse) == 1:
                other = [f"{indent}}} else {first.strip()}", *(line[4:] for line in rest)]
                self.lines[at:] = other
        return left

    def _Assign(self, node: ast.Assign) -> None:
        at = len(self.lines)
        super()._Assign(node)
        # Numbers that begin together are declared together; results are assigned in a row.
        indent, head = "    " * self.depth, f"real_t{TIE}"
        rows = [row.strip().replace(" ", TIE) for row in self.lines[at:]]
        while rows and not (rows[0].startswith(head) or RESULT.search(rows[0])):
            at, rows = at + 1, rows[1:]
        if len(rows) > 1 and all(row.startswith(head) and row.endswith(";") for row in rows):
            del self.lines[at:]
            names = (row.removeprefix(head).removesuffix(";") for row in rows)
            self.emit(f"real_t {', '.join(names)};")
        elif len(rows) > 1 and all(RESULT.search(row) for row in rows):
            lines = textwrap.wrap(" ".join(rows), WIDTH - len(indent))
            self.lines[at:] = [indent + line.replace(TIE, " ") for line in lines]

    def _unread(self, name: str) -> bool:
        return name not in self.used

    def _assign_name(self, name: str, value: Value, node: ast.expr | None) -> None:
        if not value.text.startswith(NEW):
            super()._assign_name(name, value, node)
            return
        # An array of the function: it begins where it is declared.
        if name not in self.new:
            raise UntranslatableError(f"{name} is made where it does not begin")
        self.new.discard(name)
        text = self._declare(name, value.kind)
        self.changed.add(name)
        self.emit(f"{self.all.names(value.kind[1])} {text}{value.text.removeprefix(NEW)};")

    def _fill(self, base: Value, index: list[ast.expr], value: Value) -> None:
        raise UntranslatableError("assigns to a part of an array")

    # Values.

    def struct(self, value: Value) -> Value:
        """Write a tuple as a struct of its own, because C++ has no compound literals."""
        if value.parts is None:
            return value
        if self.guarded:
            raise UntranslatableError("a tuple that may not be needed")
        parts = [self.struct(p) for p in value.parts]
        kind = ("T", *(p.kind for p in parts))
        name = self.temporary("t")
        texts = ", ".join(p.text for p in parts)
        self.emit(f"const {self.all.names(kind)} {name} = {{{texts}}};")
        return Value(name, kind)

    def constant(self, value: Any) -> Value:
        """Write a number of the kernel."""
        if isinstance(value, bool):
            return Value(str(int(value)), "b1", constant=value)
        if isinstance(value, float):
            return Value(number(float(value)), "f8", constant=float(value))
        return super().constant(value)

    def _of_module(self, name: str) -> Value:
        held = self.kernel.namespace.get(name)
        if not isinstance(held, Constant):
            raise UntranslatableError(f"unknown name {name}")
        kind = self.constant(held.value).kind
        return Value(name, kind, constant=held.value if kind == "i8" else None)

    def cast(self, value: Value, kind: Type) -> Value:
        """Convert to a type that holds it."""
        if isinstance(kind, str) and isinstance(value.kind, str) and kind != value.kind:
            if self.all.names(kind) == self.all.names(value.kind):
                return Value(value.text, kind, value.strength)
            if value.constant is not None and not value.text.isidentifier() and kind == "f8":
                return self.constant(float(value.constant))
            return Value(f"({self.all.names(kind)}){value.within(UNARY)}", kind, UNARY)
        return super().cast(value, kind)

    def _float_side(self, value: Value, kind: str) -> Value:
        return self.cast(value, kind)

    def _folded(self, op: ast.operator, a: Value, b: Value) -> Any:
        return None

    def _whole(self, sign: str, a: Value, b: Value) -> Value:
        return Value(f"{a.within(PRODUCT)} {sign} {b.within(PRODUCT + 1)}", "i8", PRODUCT)

    def _e_Attribute(self, node: ast.Attribute) -> Value:
        if node.attr == "pi":
            return Value("PI", "f8")
        if node.attr in ("shape", "size"):
            raise UntranslatableError("size of an array that is not known")
        return super()._e_Attribute(node)

    # Arrays.

    def _simple(self, base: Value) -> Value:
        return base

    def element(self, base: Value, index: list[ast.expr]) -> Value:
        """Write an element of an array."""
        if not is_array(base.kind) or len(index) != base.kind[2]:
            raise UntranslatableError(f"element of {base.kind}")
        places = "".join(f"[{self._position(base, i, k)}]" for k, i in enumerate(index))
        return Value(f"{base.within(ATOM)}{places}", base.kind[1])

    def view(self, base: Value, index: list[ast.expr]) -> Value:
        """Write a row of a matrix, or an array from an element on."""
        if base.kind[2] == 2 and len(index) == 1 and not isinstance(index[0], ast.Slice):
            kind = ("A", base.kind[1], 1, "C")
            return Value(f"{base.within(ATOM)}[{self._position(base, index[0], 0)}]", kind)
        part = index[0]
        if base.kind[2] == 1 and isinstance(part, ast.Slice) and part.lower and not part.upper:
            first = self.expr(part.lower).within(SUM + 1)
            return Value(f"{base.within(SUM)} + {first}", base.kind, SUM)
        raise UntranslatableError("part of an array")

    def _new(self, name: str, sizes: list[Value], scalar: str) -> Value:
        if name == "ones" or scalar != "f8" or not all(isinstance(s.constant, int) for s in sizes):
            raise UntranslatableError("array whose size is not known")
        kind = ("A", scalar, len(sizes), "C", *[s.constant for s in sizes[1:]])
        zeros = " = {0}" if name == "zeros" else ""
        return Value(f"{NEW}{''.join(f'[{s.constant}]' for s in sizes)}{zeros}", kind)

    # Functions of the math library, with a macro for each precision.

    def _library(self, name: str, node: ast.Call) -> Value:
        if name in MATH:
            values = [self.cast(v, "f8").text for v in self.arguments(node.args)]
            return Value(f"{name.upper()}({', '.join(values)})", "f8")
        return super()._library(name, node)

    def _fused(self, values: list[Value]) -> Value:
        return Value(f"FMA({', '.join(self.cast(v, 'f8').text for v in values)})", "f8")

    def _built_in(self, name: str, values: list[Value]) -> Value:
        if name not in ("abs", "max", "min"):
            return super()._built_in(name, values)
        texts = [self.cast(v, "f8").text for v in values]
        if all(v.kind != "f8" for v in values):
            raise UntranslatableError(f"{name} of integers")
        total = texts[0] if len(texts) > 1 else f"FABS({texts[0]})"
        for text in texts[1:]:
            total = f"F{name.upper()}({total}, {text})"
        return Value(total, "f8")


#: Begins the text of an array that a function makes.
NEW = "\0"


def device_translator() -> Translator:
    """Return a translator that writes C for a device."""
    return Translator(DeviceBody, DeviceNames())
