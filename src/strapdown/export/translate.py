"""Translate kernels to C99: same formulas, same order of operations, hence the same bits.

A kernel is translated once for each combination of types with which it is called. Types are found
from those of the arguments, by passes over the function until the types of its variables no longer
change. Where a name holds unlike things in turn (a number, then a tuple), it becomes two variables;
so it does for numbers of different types, unless one expression reads either (as in numba).
"""

from __future__ import annotations

import ast
import math
from collections.abc import Iterable
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np

from strapdown.export.sources import Fma, Kernel
from strapdown.export.types_of_c import (
    SCALARS,
    TIE,
    Names,
    Type,
    arithmetic,
    is_array,
    is_float,
    is_list,
    is_tuple,
    unify,
    wrapped,
)

# Precedences of C.
ATOM, UNARY, PRODUCT, SUM, SHIFT, ORDER, EQUAL, BIT_AND, BIT_OR, AND, OR, CHOICE = (
    20, 14, 13, 12, 11, 10, 9, 8, 6, 5, 4, 3,
)  # fmt: skip
RESERVED = set(
    "auto break case char const continue default do double else enum extern float for goto if inline "  # noqa: SIM905
    "int long register restrict return short signed sizeof static struct switch typedef union "
    "unsigned void volatile while bool true false I NAN INFINITY sqrt sin cos atan2 hypot fmod "
    "copysign floor exp expm1 fabs rint cbrt fma pow isnan isfinite memcpy memset".split()
)
#: Functions of `math` and numpy that C has under the same name.
MATH = set(
    "sqrt sin cos tan atan2 hypot fmod copysign exp expm1 log asin acos rint cbrt".split()  # noqa: SIM905
)
DTYPES = {
    "float64": "f8",
    "float32": "f4",
    "int64": "i8",
    "uint8": "u1",
    "uint64": "u8",
    "bool_": "b1",
}


class UntranslatableError(Exception):
    """A construct outside the subset."""


@dataclass(frozen=True)
class Value:
    """An expression in C."""

    text: str
    kind: Type
    strength: int = ATOM
    #: The expressions of a tuple that was written out, not yet a struct.
    parts: tuple[Value, ...] | None = None
    constant: Any = None

    def within(self, strength: int) -> str:
        return f"({self.text})" if self.strength < strength else self.text


@dataclass
class Function:
    """A translated kernel for one combination of types."""

    kernel: Kernel
    kinds: tuple[Type, ...]
    ieee: bool
    name: str
    result: Type = None
    text: str = ""
    head: str = ""
    can_raise: bool = False
    #: Indices of the parameters whose arrays it changes.
    changes: frozenset[int] = frozenset()


class Translator:
    """Translates kernels and all that they call.

    `body`: what writes a function, for another kind of C than that of the library. `names`: names
    of its types. `lines`: whether each statement has the line of the kernel's source.
    """

    def __init__(
        self, body: type[Body] | None = None, names: Names | None = None, lines: bool = False
    ) -> None:
        self.body, self.names, self.lines = body or Body, names or Names(), lines
        self.integer = self.names("i8")
        self.made: dict[Any, Function] = {}
        self.order: list[Function] = []
        self.taken: set[str] = set()
        self.warnings: list[str] = []

    def function(self, kernel: Kernel, kinds: Iterable[Type], ieee: bool) -> Function:
        """Return the translation for arguments of some types."""
        kinds = tuple(kinds)
        ieee = ieee if kernel.inline else kernel.ieee_division
        key = (kernel, kinds, ieee)
        if key not in self.made:
            name, number = kernel.c_name, 1
            while name in self.taken:
                number += 1
                name = f"{kernel.c_name}_{number}"
            self.taken.add(name)
            function = Function(kernel, kinds, ieee, name)
            self.body(self, function).translate()
            self.made[key] = function
            self.order.append(function)
        return self.made[key]


class Body:
    """The body of one function."""

    def __init__(self, all_: Translator, function: Function) -> None:
        self.all, self.function, self.kernel = all_, function, function.kernel
        self.parameters = [a.arg for a in self.kernel.node.args.args]
        if len(self.parameters) != len(function.kinds):
            raise UntranslatableError(
                f"{self.kernel.name}: {len(self.parameters)} parameters, {len(function.kinds)} given"
            )
        self.variables: dict[tuple[str, Any], Type] = {}
        #: Types of numbers that share a variable: name and type to the common one.
        self.joined: dict[tuple[str, str], str] = {}
        #: What names may hold at the end of a loop's body, by loop.
        self.at_end: dict[int, dict[str, frozenset[Any]]] = {}
        self.result: list[Type] = []
        self.at: ast.AST = self.kernel.node

    # One pass after another.

    def translate(self) -> None:
        """Fill the function's text and result."""
        body = self.kernel.node.body
        self.note = ""
        if isinstance(body[0], ast.Expr) and isinstance(body[0].value, ast.Constant):
            self.note, body = str(body[0].value.value), body[1:]
        self.body = body
        loops = [n for n in walk(body) if isinstance(n, ast.For)]
        # Not those over a tuple, or that the body of a loop sets.
        others = [n.target for n in loops if not isinstance(n.iter, ast.Call)]
        names = stored(n.target for n in loops) - _names(others)
        for n in loops:
            if stored([n.target]) & stored(n.body):
                names -= stored([n.target])
        #: Variables that are declared in the head of their loops.
        self.headed = {x for x in names if not self._read_elsewhere(x)}
        own = stored(body) - set(self.parameters) - self.headed
        self.declare_at, self.new = first_uses(body, own), set[str]()
        try:
            for _ in range(20):
                before = (
                    dict(self.variables),
                    list(self.result),
                    dict(self.joined),
                    dict(self.at_end),
                )
                self._pass()
                self.variables = {k: v for k, v in self.variables.items() if k in self.seen}
                if before == (self.variables, self.result, self.joined, self.at_end):
                    break
            else:
                raise UntranslatableError("types do not settle")
        except UntranslatableError as error:
            if not getattr(error, "placed", False):
                line = getattr(self.at, "lineno", 0)
                home = f"{self.kernel.module}.py, " if self.kernel.module else ""
                error.args = (
                    f"{home}line {line} of {self.kernel.name}: {error}: "
                    f"{ast.unparse(self.at)[:100]}",
                )
                error.placed = True  # type: ignore[attr-defined]
            raise
        self._write()

    def _pass(self) -> None:
        self.lines: list[str] = []
        self.depth, self.temporaries, self.guarded = 1, 0, 0
        self.env: dict[str, frozenset[Any]] = {}
        self.ends: list[list[dict[str, frozenset[Any]]]] = []
        self.breaks: list[list[dict[str, frozenset[Any]]]] = []
        self.seen: set[tuple[str, Any]] = set()
        self.allocates = False
        self.buffers: list[str] = []
        self.can_raise = self.fuses = False
        self.changed: set[str] = set()
        self.alias: dict[str, set[str]] = {}
        for name, kind in zip(self.parameters, self.function.kinds, strict=True):
            self.alias[name] = {name}
            self._declare(name, kind)
        self._block(self.body)

    def _declare(self, name: str, kind: Type) -> str:
        """Note that a variable takes a value; return its name in C."""
        cls = self._class(name, kind)
        key = (name, cls)
        if cls[0] == "number":
            kind = cls[1]
        known = self.variables.get(key)
        joined = kind if known is None else unify(known, kind)
        if joined is None:
            raise UntranslatableError(f"{name} is {known}, then {kind}")
        self.variables[key] = joined
        self.seen.add(key)
        self.env[name] = frozenset([cls])
        return self._c_name(name, cls)

    def _class(self, name: str, kind: Type) -> Any:
        """Which of a name's variables holds a type."""
        if isinstance(kind, str):
            while (name, kind) in self.joined:
                kind = self.joined[name, kind]
            return ("number", kind)
        return kind[:3] if is_array(kind) else (kind[0], len(kind)) if is_tuple(kind) else kind[:1]

    def _join(self, name: str, classes: frozenset[Any]) -> Any:
        """Make one variable of those that an expression may read."""
        if any(c[0] != "number" for c in classes):
            raise UntranslatableError(f"{name} may be of two kinds")
        kinds = sorted({self._class(name, c[1])[1] for c in classes})
        common = kinds[0]
        for kind in kinds[1:]:
            common = unify(common, kind)
        for kind in kinds:
            if kind != common:
                self.joined[name, kind] = common
        cls = ("number", common)
        self.variables.setdefault((name, cls), common)
        self.seen.add((name, cls))
        return cls

    @staticmethod
    def _merged(*envs: dict[str, frozenset[Any]]) -> dict[str, frozenset[Any]]:
        made: dict[str, frozenset[Any]] = {}
        for env in envs:
            for name, classes in env.items():
                made[name] = made.get(name, frozenset()) | classes
        return made

    def _c_name(self, name: str, cls: Any) -> str:
        classes = [c for n, c in self.variables if n == name]
        number = classes.index(cls)
        text = f"{name}_" if name in RESERVED or name == "_" else name
        return text if number == 0 else f"{text}_{number + 1}"

    def _write(self) -> None:
        function = self.function
        result = None
        if self.result:
            result = self.result[0]
        function.result, function.can_raise = result, self.can_raise
        function.changes = frozenset(
            k
            for k, n in enumerate(self.parameters)
            if any(n in self._roots(c) for c in self.changed)
        )
        type_of = self.all.names
        heads, begin = [], []
        for name, kind in zip(self.parameters, function.kinds, strict=True):
            cls = self._class(name, kind)
            own = self.variables[name, cls]
            text = self._c_name(name, cls)
            if own == kind:
                heads.append(f"{type_of(kind)} {text}")
            else:
                heads.append(f"{type_of(kind)} {text}_in")
                begin.append(f"    {self._cast_text(own, kind, f'{text}_in', text)}")
        begin += [f"    {b}" for b in self.buffers]
        if self.frees():
            begin.append("    const sd_mark mark_ = sd_begin();")
        lines = list(self.lines)
        if self.frees() and not (lines and lines[-1].strip().startswith("return")):
            lines.append("    sd_end(mark_);")
        result_text = type_of(result)
        inline = "SD_FUSES " if self.fuses else "ALWAYS_INLINE " if self.kernel.inline else ""
        function.head = (
            f"{inline}static {result_text} {function.name}({', '.join(heads) or 'void'})"
        )
        note = "\n".join(
            f" * {line}".rstrip() for line in self.note.replace("*/", "* /").splitlines()
        )
        function.text = "\n".join([f"/*{note[2:]} */", function.head, "{", *begin, *lines, "}", ""])

    def _roots(self, name: str) -> set[str]:
        seen: set[str] = set()
        todo = [name]
        while todo:
            n = todo.pop()
            if n not in seen:
                seen.add(n)
                todo += self.alias.get(n, ())
        return seen

    def frees(self) -> bool:
        """Whether the function gives its memory back (not where it returns some)."""
        return self.allocates and not any(holds_memory(k) for k in self.result)

    def _cast_text(self, to: Type, kind: Type, source: str, target: str) -> str:
        return f"{self.all.names(to)} {target} = {self.cast(Value(source, kind), to).text};"

    # Statements.

    def emit(self, text: str) -> None:
        if self.all.lines and hasattr(self.at, "lineno"):
            self.lines.append(f'#line {self.at.lineno} "{self.kernel.module}.py"')
        self.lines.append("    " * self.depth + text)

    def _block(self, statements: Iterable[ast.stmt]) -> bool:
        """Translate statements; return whether the last one leaves the block."""
        outer, left = self.new, False
        for statement in statements:
            self.at, self.new = statement, set(self.declare_at.get(id(statement), ()))
            method = getattr(self, f"_{type(statement).__name__}", None)
            if method is None:
                raise UntranslatableError(f"statement {type(statement).__name__}")
            self._comment(statement)
            begin = len(self.lines)
            left = bool(method(statement))
            self.lines[begin:begin] = self._declarations(self.new)
            if left:
                break
        self.new = outer
        return left

    def _comment(self, statement: ast.stmt) -> None:
        """Write what is above a statement."""

    def _is_const(self, name: str) -> bool:
        """Whether nothing changes what an array's name points to."""
        return False

    def _declarations(self, names: set[str]) -> list[str]:
        """Declare variables that a statement does not begin with."""
        rows: dict[str, list[str]] = {}
        for (name, cls), kind in self.variables.items():
            if name in names:
                text = self.all.names.declared(kind, self._c_name(name, cls), self._is_const(name))
                head, _, last = text.rpartition(TIE)
                rows.setdefault(head, []).append(last)
        texts = (f"{head} {', '.join(sorted(last))};" for head, last in sorted(rows.items()))
        return [line for text in texts for line in wrapped(text, "    " * self.depth)]

    def _Pass(self, node: ast.Pass) -> None:
        pass

    def _Continue(self, node: ast.Continue) -> bool:
        self.ends[-1].append(dict(self.env))
        self.emit("continue;")
        return True

    def _Break(self, node: ast.Break) -> bool:
        self.breaks[-1].append(dict(self.env))
        self.emit("break;")
        return True

    def _Expr(self, node: ast.Expr) -> None:
        if isinstance(node.value, ast.Constant):
            return
        call = node.value
        if isinstance(call, ast.Call) and isinstance(call.func, ast.Attribute):
            base = call.func.value
            if (
                isinstance(base, ast.Name)
                and base.id in self.env
                and call.func.attr in ("append", "clear")
            ):
                self._of_list(base.id, call)
                return
        value = self.expr(node.value)
        self.emit(f"{'' if value.kind is None else '(void)'}{value.text};")

    def _of_list(self, name: str, call: ast.Call) -> None:
        held = self.name(name)
        assert isinstance(call.func, ast.Attribute)
        if call.func.attr == "clear":
            self.emit(f"{held.text}.n0 = 0;")
            return
        item = self.struct(self.cast(self.expr(call.args[0]), held.kind[1]))
        self.allocates = self.can_raise = True
        size = f"sizeof *{held.text}.data"
        self.emit(f"SD_GROW({held.text}, {size});")
        self.emit(f"{held.text}.data[{held.text}.n0++] = {item.text};")

    def _Return(self, node: ast.Return) -> bool:
        if node.value is None or (
            isinstance(node.value, ast.Constant) and node.value.value is None
        ):
            if self.frees():
                self.emit("sd_end(mark_);")
            self.emit("return;")
            return True
        value = self.expr(node.value)
        if not self.result:
            self.result = [value.kind]
        joined = unify(self.result[0], value.kind)
        if joined is None:
            raise UntranslatableError(f"returns {self.result[0]} and {value.kind}")
        self.result = [joined]
        value = self.struct(self.cast(value, joined))
        if self.frees():
            self.emit(f"const {self.all.names(joined)} result_ = {value.text};")
            self.emit("sd_end(mark_);")
            self.emit("return result_;")
            if self.depth > 1:
                return True
        else:
            self.emit(f"return {value.text};")
        return True

    def _If(self, node: ast.If) -> bool:
        test = self.truth(self.expr(node.test))
        self.emit(f"if ({test.text}) {{")
        before = dict(self.env)
        self.depth += 1
        left = self._block(node.body)
        after, self.env = self.env, dict(before)
        self.depth -= 1
        gone = False
        if node.orelse:
            self.emit("} else {")
            self.depth += 1
            gone = self._block(node.orelse)
            self.depth -= 1
        self.emit("}")
        if left and gone:
            return True
        if gone:
            self.env = after
        elif not left:
            self.env = self._merged(self.env, after)
        return False

    @contextmanager
    def _body_of(self, node: ast.stmt) -> Any:
        """Translate the body of a loop: it begins with what is before it, or at its end."""
        before = dict(self.env)
        self.env = self._merged(before, self.at_end.get(id(node), {}))
        self.ends.append([])
        self.breaks.append([])
        yield
        if not self._block(node.body):  # type: ignore[attr-defined]
            self.ends[-1].append(self.env)
        self.at_end[id(node)] = self._merged(*self.ends.pop())
        self.env = self._merged(before, self.at_end[id(node)], *self.breaks.pop())

    def _While(self, node: ast.While) -> None:
        if node.orelse:
            raise UntranslatableError("while ... else")
        with self._body_of(node):
            at = len(self.lines)
            test = self.truth(self.expr(node.test))
            hoisted = self.lines[at:]
            del self.lines[at:]
            if hoisted:
                self.emit("for (;;) {")
                self.lines += ["    " + h for h in hoisted]
                self.depth += 1
                self.emit(f"if (!({test.text})) break;")
            else:
                self.emit(f"while ({test.text}) {{")
                self.depth += 1
        self.depth -= 1
        self.emit("}")

    def _For(self, node: ast.For) -> None:
        if node.orelse or not isinstance(node.target, ast.Name):
            raise UntranslatableError("for")
        name = node.target.id
        call = node.iter
        if isinstance(call, ast.Tuple):
            values = [self.expr(e) for e in call.elts]
            kind = values[0].kind
            for v in values[1:]:
                kind = unify(kind, v.kind)
            items = self.temporary("items")
            texts = ", ".join(self.cast(v, kind).text for v in values)
            const = "static " if all(v.constant is not None for v in values) else ""
            self.emit(f"{const}const {self.all.names(kind)} {items}[] = {{{texts}}};")
            text = self._declare(name, kind)
            self.target = self.env[name]
            counter = self.temporary("k")
            self.emit(
                f"for ({self.all.integer} {counter} = 0; {counter} < {len(values)}; {counter}++) {{"
            )
            self._loop(node, f"{text} = {items}[{counter}];")
            return
        if not (
            isinstance(call, ast.Call)
            and isinstance(call.func, ast.Name)
            and call.func.id == "range"
        ):
            raise UntranslatableError("for over something else than range or a tuple")
        bounds = [self.expr(a) for a in call.args]
        start = bounds[0] if len(bounds) > 1 else Value("0", "i8", constant=0)
        stop = bounds[1] if len(bounds) > 1 else bounds[0]
        step = 1
        if len(bounds) == 3:
            if not isinstance(bounds[2].constant, int) or bounds[2].constant == 0:
                raise UntranslatableError("step of a range that is not a constant")
            step = bounds[2].constant
        stop_node = call.args[1] if len(bounds) > 1 else call.args[0]
        fixed = not any(
            (isinstance(n, ast.Call | ast.Subscript) and not _is_shape(n))
            or (isinstance(n, ast.Name) and n.id in (stored(node.body) | {name}))
            for n in ast.walk(stop_node)
        )
        if not fixed:
            end = self.temporary("end")
            self.emit(f"const {self.all.integer} {end} = {stop.text};")
            stop = Value(end, "i8")
        text = self._declare(name, "i8")
        self.target = self.env[name]
        signs = "<" if step > 0 else ">"
        move = {1: "++", -1: "--"}.get(
            step, f" += {bounds[-1].text}" if step > 0 else f" -= {-step}"
        )
        if name in self.headed:
            self.emit(
                f"for ({self.all.integer} {text} = {start.text}; {text} {signs} {stop.within(SUM)}; {text}{move}) {{"
            )
            self._loop(node, "")
        else:
            counter = self.temporary("k")
            self.emit(
                f"for ({self.all.integer} {counter} = {start.text}; {counter} {signs} {stop.within(SUM)};"
                f" {counter}{move}) {{"
            )
            self._loop(node, f"{text} = {counter};")

    def _loop(self, node: ast.For, first: str) -> None:
        self.depth += 1
        if first:
            self.emit(first)
        with self._body_of(node):
            # Its variable has its value of this time.
            assert isinstance(node.target, ast.Name)
            self.env[node.target.id] = self.target
        self.depth -= 1
        self.emit("}")

    def _read_elsewhere(self, name: str) -> bool:
        """Whether a name is used outside the loops over it."""

        def visit(node: ast.AST) -> bool:
            if (
                isinstance(node, ast.For)
                and isinstance(node.target, ast.Name)
                and node.target.id == name
            ):
                return visit(node.iter)
            if isinstance(node, ast.Name) and node.id == name:
                return True
            return any(visit(child) for child in ast.iter_child_nodes(node))

        return name in self.parameters or any(visit(s) for s in self.body)

    def _Assign(self, node: ast.Assign) -> None:
        value_node = node.value
        if len(node.targets) > 1:
            value = self.expr(value_node)
            if value.constant is None:
                value = self.hoist(value)
            for target in node.targets:
                self.assign(target, value)
            return
        target = node.targets[0]
        if isinstance(target, ast.Tuple) and isinstance(value_node, ast.Tuple):
            self._assign_parts(target.elts, value_node.elts)
            return
        self.assign(target, self.expr(value_node), value_node)

    def _assign_parts(self, targets: list[ast.expr], nodes: list[ast.expr]) -> None:
        if len(targets) != len(nodes):
            raise UntranslatableError("tuples of different lengths")
        values = [self.expr(n) for n in nodes]
        names = [t.id if isinstance(t, ast.Name) else None for t in targets]
        clash = False
        for k, name in enumerate(names):
            for later in nodes[k + 1 :]:
                read = {n.id for n in ast.walk(later) if isinstance(n, ast.Name)}
                calls = any(isinstance(n, ast.Call) for n in ast.walk(later))
                if name is None:
                    clash |= calls or any(isinstance(n, ast.Subscript) for n in ast.walk(later))
                else:
                    clash |= name in read
        if clash:
            values = [v if v.constant is not None else self.hoist(v) for v in values]
        for target, value, node in zip(targets, values, nodes, strict=True):
            self.assign(target, value, node)

    def assign(self, target: ast.expr, value: Value, node: ast.expr | None = None) -> None:
        """Assign a value to a name, an element, a part of an array, or to several of these."""
        if isinstance(target, ast.Tuple):
            kinds = self.kinds_of(value)
            if len(kinds) != len(target.elts):
                raise UntranslatableError("unpacks another number of values")
            if value.parts is None:
                value = self.hoist(value)
            parts = value.parts or [
                Value(f"{value.text}.f{k}", kind) for k, kind in enumerate(kinds)
            ]
            for one, part in zip(target.elts, parts, strict=True):
                if isinstance(one, ast.Name) and self._unread(one.id):
                    continue
                self.assign(one, part)
            return
        if isinstance(target, ast.Name):
            self._assign_name(target.id, value, node)
            return
        if not isinstance(target, ast.Subscript):
            raise UntranslatableError("target")
        base = self.expr(target.value)
        self._changed(target.value)
        index = self._index(target.slice)
        if any(isinstance(i, ast.Slice) for i in index) or len(index) < base.kind[2]:
            self._fill(base, index, value)
            return
        place = self.element(base, index)
        self.emit(f"{place.text} = {self.cast(value, place.kind).text};")

    def _changed(self, node: ast.expr) -> None:
        while isinstance(node, ast.Subscript):
            node = node.value
        if isinstance(node, ast.Name):
            self.changed.add(node.id)

    def _assign_name(self, name: str, value: Value, node: ast.expr | None) -> None:
        if value.kind is None:
            raise UntranslatableError("value of a function without one")
        if node is not None:
            # Arrays with which an array or a tuple of arrays may share memory.
            self._alias(name, node)
        text = self._declare(name, value.kind)
        kind = self.variables[name, self._class(name, value.kind)]
        value = self.struct(self.cast(value, kind))
        if value.text != text:
            self.emit(f"{self._place(name, text, kind)} = {value.text};")

    def _place(self, name: str, text: str, kind: Type) -> str:
        """The left side of an assignment to a name, which is `text` in C; where it begins there."""
        alone = sum(n == name for n, _ in self.variables) == 1
        if name not in self.new or not alone:
            return text
        self.new.discard(name)
        return self.all.names.declared(kind, text, self._is_const(name)).replace(TIE, " ")

    def _unread(self, name: str) -> bool:
        """Whether a result that is assigned to a name is not used."""
        return name == "_"

    def _alias(self, name: str, node: ast.expr) -> None:
        self.alias.setdefault(name, set()).update(
            n.id for n in ast.walk(node) if isinstance(n, ast.Name)
        )

    def _fill(self, base: Value, index: list[ast.expr], value: Value) -> None:
        part = self.hoist(self.view(base, index))
        n = part.kind[2]
        counters = [self.temporary("k") for _ in range(n)]
        if is_array(value.kind):
            value = self.hoist(value)
            if value.kind[2] != n:
                raise UntranslatableError("assigns an array of other dimensions")
        elif value.constant is None:
            value = self.hoist(value)
        for k, c in enumerate(counters):
            self.emit(f"for ({self.all.integer} {c} = 0; {c} < {part.text}.n{k}; {c}++) {{")
            self.depth += 1
        item = value
        if is_array(value.kind):
            item = Value(_at(value.text, value.kind, counters), value.kind[1])
        self.emit(f"{_at(part.text, part.kind, counters)} = {self.cast(item, part.kind[1]).text};")
        for _ in counters:
            self.depth -= 1
            self.emit("}")

    def _AugAssign(self, node: ast.AugAssign) -> None:
        target = node.target
        value = self.expr(node.value)
        if isinstance(target, ast.Name):
            place = self.name(target.id)
        else:
            assert isinstance(target, ast.Subscript)
            self._changed(target.value)
            place = self.element(self.expr(target.value), self._index(target.slice))
        simple = isinstance(node.op, ast.Add | ast.Sub | ast.Mult) or (
            isinstance(node.op, ast.Div) and self._plain_division(value)
        )
        made = self.binary(node.op, place, value)
        if isinstance(target, ast.Name):
            self._declare(target.id, made.kind)
            after = self.name(target.id)
            simple = simple and after == place
            place = after
        if simple and made.kind == place.kind and place.kind in ("f8", "i8"):
            sign = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/"}[type(node.op)]
            if is_float(place.kind):
                value = self._float_side(value, place.kind)
            self.emit(f"{place.text} {sign}= {value.text};")
        else:
            self.emit(f"{place.text} = {self.cast(made, place.kind).text};")

    # Helpers of statements.

    def temporary(self, name: str) -> str:
        self.temporaries += 1
        return f"{name}_{self.temporaries}_"

    def hoist(self, value: Value) -> Value:
        """Put a value into a constant of its own before the statement."""
        if value.text.isidentifier() and value.text.endswith("_"):
            return value
        if self.guarded and "(" in value.text and not value.text.startswith("("):
            raise UntranslatableError("a call that may not be made, which needs a variable")
        value = self.struct(value)
        name = self.temporary("t")
        self.emit(f"const {self.all.names(value.kind)} {name} = {value.text};")
        return Value(name, value.kind)

    def struct(self, value: Value) -> Value:
        """Write a tuple as a struct."""
        if value.parts is None:
            return value
        parts = [self.struct(p) for p in value.parts]
        kind = ("T", *(p.kind for p in parts))
        return Value(f"({self.all.names(kind)}){{{', '.join(p.text for p in parts)}}}", kind)

    def cast(self, value: Value, kind: Type) -> Value:
        """Convert to a type that holds it."""
        if value.kind == kind:
            return value
        if isinstance(kind, str) and isinstance(value.kind, str):
            if value.constant is not None and kind == "f8":
                return Value(_number(float(value.constant)), "f8", constant=float(value.constant))
            if value.constant is not None and kind == "f4":
                return self.constant(np.float32(value.constant))
            return Value(f"({self.all.names(kind)}){value.within(UNARY)}", kind, UNARY)
        if is_array(kind) and is_array(value.kind) and kind[3] == "A":
            strided = self.all.names(kind)
            self.all.names(value.kind)
            return Value(f"SD_STRIDED{kind[2]}({strided}, {value.text})", kind)
        if is_tuple(kind) and is_tuple(value.kind):
            if value.parts is None:
                value = self.hoist(value)
                parts = [Value(f"{value.text}.f{k}", one) for k, one in enumerate(value.kind[1:])]
            else:
                parts = list(value.parts)
            cast = tuple(self.cast(p, one) for p, one in zip(parts, kind[1:], strict=True))
            return Value("", kind, parts=cast)
        raise UntranslatableError(f"{value.kind} as {kind}")

    def kinds_of(self, value: Value) -> list[Type]:
        if not is_tuple(value.kind):
            raise UntranslatableError(f"unpacks {value.kind}")
        return list(value.kind[1:])

    @contextmanager
    def perhaps(self) -> Any:
        """Translate what may not be evaluated."""
        self.guarded += 1
        yield
        self.guarded -= 1

    # Expressions.

    def expr(self, node: ast.expr) -> Value:
        method = getattr(self, f"_e_{type(node).__name__}", None)
        if method is None:
            raise UntranslatableError(f"expression {type(node).__name__}")
        value: Value = method(node)
        return value

    def constant(self, value: Any) -> Value:
        if isinstance(value, bool | np.bool_):
            return Value("true" if value else "false", "b1", constant=bool(value))
        if isinstance(value, np.uint8 | np.uint64):
            kind = "u1" if isinstance(value, np.uint8) else "u8"
            return Value(str(int(value)), kind, constant=int(value))
        if isinstance(value, int | np.integer):
            value = int(value)
            text = str(value) if abs(value) < 2**31 else f"INT64_C({value})"
            return Value(text, "i8", ATOM if value >= 0 else UNARY, constant=value)
        if isinstance(value, np.float32):
            text = _number(float(value))
            text = f"{text}f" if text[-1].isdigit() else f"(float){text}"
            return Value(text, "f4", ATOM if value >= 0 else UNARY, constant=value)
        if isinstance(value, float | np.floating):
            value = float(value)
            return Value(_number(value), "f8", ATOM if value >= 0 else UNARY, constant=value)
        if isinstance(value, tuple):
            parts = tuple(self.constant(v) for v in value)
            return Value("", ("T", *(p.kind for p in parts)), parts=parts)
        raise UntranslatableError(f"constant {value!r}")

    def _e_Constant(self, node: ast.Constant) -> Value:
        return self.constant(node.value)

    def name(self, name: str) -> Value:
        if name in self.env:
            classes = frozenset(
                self._class(name, c[1]) if c[0] == "number" else c for c in self.env[name]
            )
            cls = next(iter(classes)) if len(classes) == 1 else self._join(name, classes)
            if (name, cls) not in self.variables:
                self.variables[name, cls] = cls[1]
            self.seen.add((name, cls))
            return Value(self._c_name(name, cls), self.variables[name, cls])
        if any(n == name for n, _ in self.variables):
            raise UntranslatableError(f"{name} may have no value, or of two kinds")
        return self._of_module(name)

    def _of_module(self, name: str) -> Value:
        """A constant of the module."""
        if name not in self.kernel.namespace:
            raise UntranslatableError(f"unknown name {name}")
        return self.constant(self.kernel.namespace[name])

    def _e_Name(self, node: ast.Name) -> Value:
        return self.name(node.id)

    def _e_Tuple(self, node: ast.Tuple) -> Value:
        parts = tuple(self.arguments(node.elts))
        return Value("", ("T", *(p.kind for p in parts)), parts=parts)

    def _e_List(self, node: ast.List) -> Value:
        items = [self.struct(self.expr(e)) for e in node.elts]
        kind = ("L", items[0].kind)
        self.allocates = self.can_raise = True
        name = self.temporary("list")
        self.emit(f"{self.all.names(kind)} {name} = {{0}};")
        for item in items:
            self.emit(f"SD_GROW({name}, sizeof *{name}.data);")
            self.emit(f"{name}.data[{name}.n0++] = {item.text};")
        return Value(name, kind)

    def arguments(self, nodes: list[ast.expr]) -> list[Value]:
        values: list[Value] = []
        for node in nodes:
            if isinstance(node, ast.Starred):
                held = self.expr(node.value)
                if held.parts is not None:
                    values += held.parts
                    continue
                held = self.hoist(held)
                values += [
                    Value(f"{held.text}.f{k}", kind) for k, kind in enumerate(self.kinds_of(held))
                ]
            else:
                values.append(self.expr(node))
        return values

    def _e_Attribute(self, node: ast.Attribute) -> Value:
        if isinstance(node.value, ast.Name) and node.value.id in ("math", "np", "_np"):
            return self.constant(
                getattr({"math": math, "np": np, "_np": np}[node.value.id], node.attr)
            )
        base = self.expr(node.value)
        if is_array(base.kind) and node.attr == "shape":
            parts = tuple(Value(f"{base.text}.n{k}", "i8") for k in range(base.kind[2]))
            return Value("", ("T", *["i8"] * len(parts)), parts=parts)
        if is_array(base.kind) and node.attr == "size":
            text = " * ".join(f"{base.text}.n{k}" for k in range(base.kind[2]))
            return Value(text, "i8", ATOM if base.kind[2] == 1 else PRODUCT)
        raise UntranslatableError(f"attribute {node.attr}")

    def _e_UnaryOp(self, node: ast.UnaryOp) -> Value:
        value = self.expr(node.operand)
        if isinstance(node.op, ast.Not):
            value = self.truth(value)
            return Value(f"!{value.within(UNARY)}", "b1", UNARY)
        if not isinstance(node.op, ast.USub):
            raise UntranslatableError("unary operator")
        if value.constant is not None:
            return self.constant(-value.constant)
        kind = "i8" if value.kind == "b1" else value.kind
        return Value(f"-{value.within(UNARY + 1)}", kind, UNARY)

    def _plain_division(self, value: Value) -> bool:
        return self.function.ieee or (value.constant is not None and value.constant != 0)

    def _e_BinOp(self, node: ast.BinOp) -> Value:
        return self.binary(node.op, self.expr(node.left), self.expr(node.right))

    def binary(self, op: ast.operator, a: Value, b: Value) -> Value:
        """An arithmetic operation."""
        folded = self._folded(op, a, b)
        if folded is not None:
            return self.constant(folded)
        if isinstance(op, ast.Pow):
            return self._power(a, b)
        if not (isinstance(a.kind, str) and isinstance(b.kind, str)):
            raise UntranslatableError(f"{type(op).__name__} of {a.kind} and {b.kind}")
        kind = arithmetic(a.kind, b.kind)
        if isinstance(op, ast.Add | ast.Sub | ast.Mult):
            if is_float(kind):
                a, b = self._float_side(a, kind), self._float_side(b, kind)
            sign, strength = {ast.Add: ("+", SUM), ast.Sub: ("-", SUM), ast.Mult: ("*", PRODUCT)}[
                type(op)
            ]
            right = b.within(strength + 1)
            if right.startswith("-"):
                right = f"({right})"
            return Value(f"{a.within(strength)} {sign} {right}", kind, strength)
        if isinstance(op, ast.Div):
            if not is_float(kind):
                kind = "f8"
            a, b = self.cast(a, kind), self.cast(b, kind)
            if self._plain_division(b):
                right = b.within(PRODUCT + 1)
                return Value(
                    f"{a.within(PRODUCT)} / {right if right[0] != '-' else f'({right})'}",
                    kind,
                    PRODUCT,
                )
            self.can_raise = True
            return Value(f"sd_divided{'_f4' if kind == 'f4' else ''}({a.text}, {b.text})", kind)
        if isinstance(op, ast.FloorDiv | ast.Mod):
            if is_float(kind):
                raise UntranslatableError("// or % of floats")
            sign = "/" if isinstance(op, ast.FloorDiv) else "%"
            if kind == "u8":
                return Value(
                    f"{self.cast(a, kind).within(PRODUCT)} {sign} {self.cast(b, kind).within(UNARY)}",
                    kind,
                    PRODUCT,
                )
            return self._whole(sign, a, b)
        bits = {ast.BitOr: ("|", BIT_OR), ast.BitAnd: ("&", BIT_AND), ast.LShift: ("<<", SHIFT)}
        if type(op) in bits and not is_float(kind):
            sign, strength = bits[type(op)]
            left = self.cast(a, "i8") if sign == "<<" else a
            kind = "b1" if a.kind == b.kind == "b1" and sign != "<<" else kind
            return Value(f"{left.within(ATOM)} {sign} {b.within(ATOM)}", kind, strength)
        raise UntranslatableError(f"operator {type(op).__name__}")

    def _folded(self, op: ast.operator, a: Value, b: Value) -> Any:
        """The number that an operation on two constants gives, or None."""
        kinds = {str(a.kind), str(b.kind)}
        if a.constant is None or b.constant is None or kinds & {"u1", "u8"}:
            return None
        if (a.kind == "f4") != (b.kind == "f4"):
            return None
        return _fold(op, a.constant, b.constant)

    def _whole(self, sign: str, a: Value, b: Value) -> Value:
        """Quotient or remainder of integers."""
        return Value(
            f"{'sd_quotient' if sign == '/' else 'sd_remainder'}({a.text}, {b.text})", "i8"
        )

    def _float_side(self, value: Value, kind: str) -> Value:
        # C converts integers itself; a constant is written as a float.
        return (
            self.cast(value, kind)
            if value.constant is not None and not is_float(value.kind)
            else value
        )

    def _power(self, a: Value, b: Value) -> Value:
        if b.constant == 2 and b.kind == "i8":
            if not a.text.isidentifier():
                a = self.hoist(a)
            return Value(f"{a.text} * {a.text}", a.kind, PRODUCT)
        if is_array(b.kind) and b.kind[2] == 1 and a.kind == "f8":
            made = self.hoist(self._new("empty", [Value(f"{b.text}.n0", "i8")], "f8"))
            k = self.temporary("k")
            self.emit(
                f"for ({self.all.integer} {k} = 0; {k} < {made.text}.n0; {k}++) "
                f"{made.text}.data[{k}] = pow({a.text}, (double){_at(b.text, b.kind, [k])});"
            )
            return made
        raise UntranslatableError("power")

    def truth(self, value: Value) -> Value:
        if value.kind == "b1":
            return value
        if isinstance(value.kind, str):
            zero = {"f8": "0.0", "f4": "0.0f"}.get(value.kind, "0")
            return Value(f"{value.within(EQUAL + 1)} != {zero}", "b1", EQUAL)
        raise UntranslatableError(f"{value.kind} as a condition")

    def _e_BoolOp(self, node: ast.BoolOp) -> Value:
        sign, strength = ("&&", AND) if isinstance(node.op, ast.And) else ("||", OR)
        values = [self.expr(node.values[0])]
        with self.perhaps():
            values += [self.expr(v) for v in node.values[1:]]
        if any(v.kind != "b1" for v in values[:-1]) or values[-1].kind != "b1":
            values = [self.truth(v) for v in values]
        # Parentheses where another operator is inside: without them compilers warn.
        texts = [v.within(EQUAL if v.strength not in (AND, OR) else ATOM) for v in values]
        return Value(f" {sign} ".join(texts), "b1", strength)

    def _e_Compare(self, node: ast.Compare) -> Value:
        left = self.expr(node.left)
        texts = []
        for op, right_node in zip(node.ops, node.comparators, strict=True):
            if isinstance(op, ast.In | ast.NotIn):
                items = self.expr(right_node)
                assert items.parts is not None
                if not left.text.isidentifier():
                    left = self.hoist(left)
                text = " || ".join(
                    f"{left.within(ORDER)} == {p.within(ORDER)}" for p in items.parts
                )
                texts.append(f"({text})" if isinstance(op, ast.In) else f"!({text})")
                continue
            right = self.expr(right_node)
            if not (isinstance(left.kind, str) and isinstance(right.kind, str)):
                raise UntranslatableError(f"compares {left.kind} and {right.kind}")
            if is_float(left.kind) != is_float(right.kind):
                left, right = self._float_side(left, "f8"), self._float_side(right, "f8")
            sign, _ = {
                ast.Lt: ("<", ORDER), ast.LtE: ("<=", ORDER), ast.Gt: (">", ORDER),
                ast.GtE: (">=", ORDER), ast.Eq: ("==", EQUAL), ast.NotEq: ("!=", EQUAL),
            }[type(op)]  # fmt: skip
            texts.append(f"{left.within(SHIFT)} {sign} {right.within(SHIFT)}")
            left = right
        if len(texts) == 1:
            return Value(
                texts[0], "b1", EQUAL if " == " in texts[0] or " != " in texts[0] else ORDER
            )
        return Value(" && ".join(texts), "b1", AND)

    def _e_IfExp(self, node: ast.IfExp) -> Value:
        test = self.truth(self.expr(node.test))
        with self.perhaps():
            a, b = self.expr(node.body), self.expr(node.orelse)
        kind = unify(a.kind, b.kind)
        if kind is None:
            raise UntranslatableError(f"{a.kind} or {b.kind}")
        a, b = self.struct(self.cast(a, kind)), self.struct(self.cast(b, kind))
        return Value(f"{test.within(OR)} ? {a.within(CHOICE)} : {b.within(CHOICE)}", kind, CHOICE)

    # Elements and views of arrays.

    @staticmethod
    def _index(node: ast.expr) -> list[ast.expr]:
        return list(node.elts) if isinstance(node, ast.Tuple) else [node]

    def _e_Subscript(self, node: ast.Subscript) -> Value:
        base = self.expr(node.value)
        if is_tuple(base.kind):
            return self._item(base, self.expr(node.slice))
        if not is_array(base.kind):
            raise UntranslatableError(f"subscript of {base.kind}")
        index = self._index(node.slice)
        if any(isinstance(i, ast.Slice) for i in index) or len(index) < base.kind[2]:
            return self.view(base, index)
        return self.element(base, index)

    def _item(self, base: Value, index: Value) -> Value:
        kinds = base.kind[1:]
        if isinstance(index.constant, int):
            k = index.constant % len(kinds)
            return base.parts[k] if base.parts else Value(f"{base.within(ATOM)}.f{k}", kinds[k])
        if len(set(kinds)) > 1:
            raise UntranslatableError("index of a tuple of unlike values")
        name = self.all.names(base.kind)
        base = self.struct(base)
        if not base.text.isidentifier():
            base = self.hoist(base)
        return (
            Value(f"((const {self.all.names(kinds[0])} *)&{base.text})[{index.text}]", kinds[0])
            if name
            else base
        )

    def _position(self, base: Value, node: ast.expr, axis: int) -> str:
        value = self.expr(node)
        if value.kind == "b1":
            value = self.cast(value, "i8")
        if value.kind not in ("i8", "u8", "u1"):
            raise UntranslatableError(f"index of type {value.kind}")
        if isinstance(value.constant, int) and value.constant < 0:
            return f"{base.text}.n{axis} - {-value.constant}"
        return value.text

    def element(self, base: Value, index: list[ast.expr]) -> Value:
        if not is_array(base.kind) or len(index) != base.kind[2]:
            raise UntranslatableError(f"element of {base.kind}")
        base = self._simple(base)
        places = [self._position(base, i, k) for k, i in enumerate(index)]
        return Value(_at(base.text, base.kind, places), base.kind[1])

    def _simple(self, base: Value) -> Value:
        return base if base.text.replace(".", "_").isidentifier() else self.hoist(base)

    def view(self, base: Value, index: list[ast.expr]) -> Value:
        """A part of an array with fewer dimensions, or smaller ones."""
        base = self._simple(base)
        _, scalar, n, layout = base.kind
        full = [*index, *[ast.Slice()] * (n - len(index))]
        stride = [
            f"{base.text}.s{k}"
            if layout == "A"
            else " * ".join(f"{base.text}.n{j}" for j in range(k + 1, n)) or "1"
            for k in range(n)
        ]
        offsets, sizes, strides = [], [], []
        contiguous = layout == "C"
        begun = False
        for k, (node, step) in enumerate(zip(full, stride, strict=True)):
            factor = "" if step == "1" else f" * {step}"
            length = f"{base.text}.n{k}"
            if isinstance(node, ast.Slice):
                if node.step is not None:
                    raise UntranslatableError("slice with a step")
                whole = node.lower is None and node.upper is None
                if begun and not whole:
                    contiguous = False
                begun = True
                if whole:
                    sizes.append(length)
                else:
                    low = self.expr(node.lower) if node.lower else Value("0", "i8", constant=0)
                    high = self.expr(node.upper).text if node.upper else length
                    if low.constant == 0:
                        sizes.append(f"sd_clip({high}, {length})")
                    else:
                        offsets.append(f"sd_clip({low.text}, {length}){factor}")
                        sizes.append(f"sd_length({low.text}, {high}, {length})")
                strides.append(step)
            else:
                if begun:
                    contiguous = False
                place = self._position(base, node, k)
                offsets.append(f"SD_AT({place}, {length}){factor}")
        kind = ("A", scalar, len(sizes), "C" if contiguous else "A")
        data = " + ".join([f"{base.text}.data", *offsets])
        fields = [data, *sizes, *([] if contiguous else strides)]
        return Value(f"({self.all.names(kind)}){{{', '.join(fields)}}}", kind)

    # Calls.

    def _e_Call(self, node: ast.Call) -> Value:
        function = node.func
        if isinstance(function, ast.Attribute):
            if isinstance(function.value, ast.Name) and function.value.id in ("math", "np", "_np"):
                return self._library(function.attr, node)
            return self._method(self.expr(function.value), function.attr, node)
        assert isinstance(function, ast.Name)
        held = self.kernel.namespace.get(function.id)
        if isinstance(held, Kernel):
            return self._kernel_call(held, node)
        if function.id == "float" and isinstance(node.args[0], ast.Constant):
            return self.constant(float(node.args[0].value))  # type: ignore[arg-type]
        values = self.arguments(node.args)
        if isinstance(held, Fma):
            return self._fused(values)
        return self._built_in(function.id, values)

    def _fused(self, values: list[Value]) -> Value:
        self.fuses = True
        return Value(f"fma({', '.join(self.cast(v, 'f8').text for v in values)})", "f8")

    def _kernel_call(self, kernel: Kernel, node: ast.Call) -> Value:
        if node.keywords:
            raise UntranslatableError("keywords")
        values = self.arguments(node.args)
        called = self.all.function(kernel, [v.kind for v in values], self.function.ieee)
        self.can_raise |= called.can_raise
        for k in called.changes:
            if k < len(node.args):
                for n in ast.walk(node.args[k]):
                    if isinstance(n, ast.Name):
                        self.changed.add(n.id)
        if holds_memory(called.result):
            self.allocates = True
        texts = []
        for v in values:
            v = self.struct(v)
            texts.append(v.text)
        return Value(f"{called.name}({', '.join(texts)})", called.result)

    def _method(self, base: Value, name: str, node: ast.Call) -> Value:
        if is_array(base.kind) and name == "copy":
            sizes = [Value(f"{base.text}.n{k}", "i8") for k in range(base.kind[2])]
            made = self.hoist(self._new("empty", sizes, base.kind[1]))
            counters = [self.temporary("k") for _ in sizes]
            loops = "".join(
                f"for ({self.all.integer} {c} = 0; {c} < {made.text}.n{k}; {c}++) "
                for k, c in enumerate(counters)
            )
            self.emit(
                f"{loops}{_at(made.text, made.kind, counters)} = {_at(base.text, base.kind, counters)};"
            )
            return made
        if is_array(base.kind) and name == "max" and base.kind[2] == 1 and base.kind[1] == "i8":
            most, k = self.temporary("most"), self.temporary("k")
            self.emit(f"int64_t {most} = {_at(base.text, base.kind, ['0'])};")
            item = _at(base.text, base.kind, [k])
            self.emit(
                f"for ({self.all.integer} {k} = 1; {k} < {base.text}.n0; {k}++) if ({item} > {most}) {most} = {item};"
            )
            return Value(most, "i8")
        if is_array(base.kind) and name == "reshape" and base.kind[2:] == (1, "C"):
            sizes = self.arguments(node.args)
            kind = ("A", base.kind[1], len(sizes), "C")
            base = self._simple(base)
            return Value(
                f"({self.all.names(kind)}){{{base.text}.data, {', '.join(s.text for s in sizes)}}}",
                kind,
            )
        raise UntranslatableError(f"method {name} of {base.kind}")

    def _new(self, name: str, sizes: list[Value], scalar: str) -> Value:
        kind = ("A", scalar, len(sizes), "C")
        self.all.names(kind)
        constants = [s.constant for s in sizes]
        self.allocates = self.can_raise = True
        fill = {"empty": "sd_new", "zeros": "sd_zeros", "ones": "sd_ones_" + scalar}[name]
        if all(isinstance(c, int) for c in constants) and not constants:
            raise UntranslatableError("array of no dimensions")
        texts = [s.text for s in sizes]
        count = " * ".join(s.within(PRODUCT + 1) for s in sizes)
        item = "" if name == "ones" else f", sizeof({SCALARS[scalar]})"
        return Value(f"({self.all.names(kind)}){{{fill}({count}{item}), {', '.join(texts)}}}", kind)

    def _library(self, name: str, node: ast.Call) -> Value:
        if name in ("empty", "zeros", "ones"):
            scalar = "f8"
            for keyword in node.keywords:
                if keyword.arg != "dtype" or not isinstance(keyword.value, ast.Attribute):
                    raise UntranslatableError("keyword of a new array")
                scalar = DTYPES[keyword.value.attr]
            shape = node.args[0]
            nodes = shape.elts if isinstance(shape, ast.Tuple) else [shape]
            return self._new(name, [self.expr(n) for n in nodes], scalar)
        if name == "float32" and isinstance(node.args[0], ast.Constant):
            return self.constant(np.float32(node.args[0].value))  # type: ignore[arg-type]
        values = self.arguments(node.args)
        if name in ("uint8", "uint64", "int64", "float64", "float32"):
            return self.cast(values[0], DTYPES[name])
        if name in ("isnan", "isfinite"):
            return Value(f"{name}({self.cast(values[0], 'f8').text}) != 0", "b1", EQUAL)
        if name == "floor":
            return Value(f"(int64_t)floor({self.cast(values[0], 'f8').text})", "i8", UNARY)
        if name in MATH and all(v.kind == "f4" for v in values):
            return Value(f"{name}f({', '.join(v.text for v in values)})", "f4")
        if name in MATH:
            return Value(f"{name}({', '.join(self.cast(v, 'f8').text for v in values)})", "f8")
        raise UntranslatableError(f"function {name}")

    def _built_in(self, name: str, values: list[Value]) -> Value:
        kinds = [v.kind for v in values]
        if name == "len":
            if is_tuple(kinds[0]):
                return self.constant(len(kinds[0]) - 1)
            return Value(f"{values[0].text}.n0", "i8")
        if not all(isinstance(k, str) for k in kinds):
            raise UntranslatableError(f"{name} of {kinds}")
        if name == "abs":
            text = values[0].text
            function = {"f8": "fabs", "f4": "fabsf"}.get(str(kinds[0]), "sd_abs")
            return Value(f"{function}({text})", kinds[0])
        if name == "float":
            return self.cast(values[0], "f8")
        if name == "int":
            return self.cast(values[0], "i8")
        if name == "bool":
            return self.truth(values[0])
        if name in ("max", "min"):
            total = values[0]
            for other in values[1:]:
                kind = unify(total.kind, other.kind)
                a, b = self.cast(total, kind), self.cast(other, kind)
                total = Value(f"sd_{name}_{kind}({a.text}, {b.text})", kind)
            return total
        raise UntranslatableError(f"function {name}")


def holds_memory(kind: Type) -> bool:
    if is_array(kind) or is_list(kind):
        return True
    return is_tuple(kind) and any(holds_memory(k) for k in kind[1:])


def _at(text: str, kind: Type, places: list[str]) -> str:
    """An element of an array."""
    n = kind[2]
    head = "AT" if kind[3] == "C" else "STRIDED"
    return f"{head}{n}({text}, {', '.join(places)})"


def _is_shape(node: ast.AST) -> bool:
    return (
        isinstance(node, ast.Subscript)
        and isinstance(node.value, ast.Attribute)
        and node.value.attr == "shape"
    )


def _number(value: float) -> str:
    if math.isnan(value):
        return "(double)NAN"
    if math.isinf(value):
        return "(double)INFINITY" if value > 0 else "-(double)INFINITY"
    return repr(value)


def _fold(op: ast.operator, a: Any, b: Any) -> Any:
    operations: dict[type[ast.operator], Any] = {
        ast.Add: lambda: a + b, ast.Sub: lambda: a - b, ast.Mult: lambda: a * b,
        ast.Div: lambda: a / b if b else None, ast.FloorDiv: lambda: a // b if b else None,
        ast.Mod: lambda: a % b if b else None, ast.LShift: lambda: a << b, ast.BitOr: lambda: a | b,
    }  # fmt: skip
    return operations[type(op)]() if type(op) in operations else None


# Where variables begin.


def first_uses(body: list[ast.stmt], names: set[str]) -> dict[int, set[str]]:
    """For each name, find the innermost block with all its uses, and its first statement there."""
    places: dict[int, set[str]] = {}
    _place(body, names, places)
    return places


def _place(block: list[ast.stmt], names: set[str], places: dict[int, set[str]]) -> None:
    """Add the first statements of names that are used nowhere but in a block."""
    holding: dict[str, list[ast.stmt]] = {name: [] for name in names}
    for node in block:
        for name in names & _names([node]):
            holding[name].append(node)
    for first in block:
        alone = {name for name in names if holding[name] == [first]}
        heads = _names(_heads(first))
        used = [(b, alone & _names(b)) for b in _blocks(first)] if alone else []
        for k, (inner, own) in enumerate(used):
            elsewhere = heads.union(*(others for j, (_, others) in enumerate(used) if j != k))
            # In a loop only what each round sets before it reads it: else it is of the round
            # before.
            deeper = {
                name
                for name in own - elsewhere
                if isinstance(first, ast.If) or _sets_first(inner, name)
            }
            alone -= deeper
            if deeper:
                _place(inner, deeper, places)
        later = {name for name in names if holding[name][:1] == [first] and holding[name][1:]}
        if alone or later:
            places.setdefault(id(first), set()).update(alone | later)


def _sets_first(block: list[ast.stmt], name: str) -> bool:
    """Whether statements set a name before they read it."""
    holding = [node for node in block if name in _names([node])]
    begin = holding[0]
    if isinstance(begin, ast.For) and len(holding) == 1 and name not in _names([begin.iter]):
        return name in stored([begin.target]) or _sets_first(begin.body, name)
    return isinstance(begin, ast.Assign) and name in stored([begin]) - loaded([begin])


def _heads(node: ast.stmt) -> list[ast.AST]:
    if isinstance(node, ast.For):
        return [node.target, node.iter]
    return [node.test] if isinstance(node, ast.If | ast.While) else []


def _blocks(node: ast.stmt) -> list[list[ast.stmt]]:
    if isinstance(node, ast.If):
        return [node.body, node.orelse]
    return [node.body] if isinstance(node, ast.For | ast.While) else []


def _names(body: Iterable[ast.AST]) -> set[str]:
    return {n.id for n in walk(body) if isinstance(n, ast.Name)}


def walk(body: Iterable[ast.AST]) -> Iterable[ast.AST]:
    """Iterate over every node of some statements."""
    for node in body:
        yield from ast.walk(node)


def stored(body: Iterable[ast.AST]) -> set[str]:
    """Return the names that are assigned."""
    return {n.id for n in walk(body) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)}


def loaded(body: Iterable[ast.AST]) -> set[str]:
    """Return the names that are read; targets of augmented assignments are included."""
    names: set[str] = set()
    for n in walk(body):
        if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Load):
            names.add(n.id)
        elif isinstance(n, ast.AugAssign) and isinstance(n.target, ast.Name):
            names.add(n.target.id)
    return names
