"""Translate a specialized kernel to a C function: same names, same formulas, same order."""

from __future__ import annotations

import ast
import textwrap
from collections.abc import Iterable, Iterator

from strapdown.export.kernels import (
    Function,
    Kernels,
    UntranslatableError,
    first_uses,
    loaded,
    name_of,
    plain_name,
    stored,
    walk,
)

# Translation of kernel expressions to C, with parentheses where C needs them.


FUNCTIONS = {
    **{name: name for name in ("sqrt", "sin", "cos", "atan2", "hypot", "fmod", "copysign")},
    "abs": "fabs",
    "max": "fmax",
    "min": "fmin",
}
BINARY: dict[type[ast.operator], tuple[str, int]] = {
    ast.Add: ("+", 12),
    ast.Sub: ("-", 12),
    ast.Mult: ("*", 13),
    ast.Div: ("/", 13),
    ast.Mod: ("%", 13),
}
_COMPARE: dict[type[ast.cmpop], str] = {
    ast.Lt: "<",
    ast.LtE: "<=",
    ast.Gt: ">",
    ast.GtE: ">=",
    ast.Eq: "==",
    ast.NotEq: "!=",
}
_UNARY, _ATOM = 14, 20


class _Body:
    """Translate one function."""

    def __init__(self, kinds: Translator, function: Function) -> None:
        self.all, self.function = kinds, function
        self.types = kinds.types(function)
        own = set(stored(function.body)) - set(function.parameters)
        loops = {name_of(n.target) for n in walk(function.body) if isinstance(n, ast.For)}
        self.declare_at = first_uses(function.body, own - loops)

    def text(self, node: ast.expr, places: list[str] | None = None, over: int = 0) -> str:
        """Write an expression, in parentheses where it binds more weakly than `over`."""
        text, strength = self._text(node, places or [])
        return f"({text})" if strength < over else text

    def _text(self, node: ast.expr, places: list[str]) -> tuple[str, int]:
        if isinstance(node, ast.Name):
            return node.id, _ATOM
        if isinstance(node, ast.Constant) and isinstance(node.value, int | float):
            return number(node.value), _ATOM
        if isinstance(node, ast.Attribute) and node.attr == "pi":
            return "PI", _ATOM
        if isinstance(node, ast.Subscript):
            if name_of(node.value) == "state":
                self.all.state_size = max(self.all.state_size, 1 + self.highest(node.slice))
            return f"{self.text(node.value)}[{self.text(node.slice)}]", _ATOM
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
            return f"-{self.text(node.operand, over=_UNARY)}", _UNARY
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
            return f"!{self.text(node.operand, over=_UNARY)}", _UNARY
        if isinstance(node, ast.BinOp):
            sign, strength = BINARY[type(node.op)]
            left = self.text(node.left, over=strength)
            # Not regrouped: floating-point arithmetic is not associative.
            return f"{left} {sign}{TIE}{self.text(node.right, over=strength + 1)}", strength
        if isinstance(node, ast.Compare) and len(node.ops) == 1:
            sides = [self.text(n, over=12) for n in (node.left, node.comparators[0])]
            return f" {_COMPARE[type(node.ops[0])]}{TIE}".join(sides), 9
        if isinstance(node, ast.BoolOp):
            sign = f" &&{TIE}" if isinstance(node.op, ast.And) else f" ||{TIE}"
            return sign.join(self.text(v, over=9) for v in node.values), 5
        if isinstance(node, ast.IfExp):
            parts = [self.text(n, over=9) for n in (node.test, node.body, node.orelse)]
            return f"{parts[0]} ?{TIE}{parts[1]} :{TIE}{parts[2]}", 3
        if isinstance(node, ast.Call):
            return self.call(node, places), _ATOM
        raise UntranslatableError("expression outside the subset", node)

    def call(self, node: ast.Call, places: list[str]) -> str:
        """Write a call of a kernel, a conversion, or a function of the math library."""
        name = node.func.attr if isinstance(node.func, ast.Attribute) else name_of(node.func)
        if self.all.callee(node):
            return f"{name}({', '.join([*(self.text(a) for a in node.args), *places])})"
        arguments = [self.text(a) for a in node.args]
        if name in ("int", "float"):
            inside = self.text(node.args[0], over=_UNARY)
            return f"({'int' if name == 'int' else 'real_t'}){inside}"
        if name not in FUNCTIONS:
            raise UntranslatableError("function outside the subset", node)
        macro = FUNCTIONS[name].upper()
        if name in ("max", "min"):
            text = arguments[0]
            for other in arguments[1:]:
                text = f"{macro}({text}, {other})"
            return text
        return f"{macro}({', '.join(arguments)})"

    def highest(self, node: ast.expr) -> int:
        """Return the highest value that an index can have."""
        if isinstance(node, ast.Constant) and isinstance(node.value, int):
            return node.value
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add | ast.Mult):
            a, b = self.highest(node.left), self.highest(node.right)
            return a + b if isinstance(node.op, ast.Add) else a * b
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Mod):
            return self.highest(node.right) - 1
        if isinstance(node, ast.Name):
            span = self.all.kernels.span(node.id) or self.all.kernels.ranges.get(node.id)
            if span:
                return int(span[1])
            for other in walk(self.function.body):
                if isinstance(other, ast.For) and name_of(other.target) == node.id:
                    return self._last(other)
                if isinstance(other, ast.Assign) and plain_name(other.targets[0]) == node.id:
                    return self.highest(other.value)
        raise UntranslatableError("index whose range is not known", node)

    def _last(self, loop: ast.For) -> int:
        bounds = [ast.unparse(a) for a in loop.iter.args] if isinstance(loop.iter, ast.Call) else []
        if not all(b.isdigit() for b in bounds):
            return 0  # up to a count, which is bound by what was written before
        return range(*(int(b) for b in bounds))[-1]

    # --- statements -----------------------------------------------------------------------

    def lines(self) -> list[str]:
        out = comment(self.function.doc) if self.function.doc else []
        out += wrapped(self.all.prototype(self.function), "")
        return [*out, "{", *self.block(self.function.body, "    ", last=True), "}"]

    def block(self, body: list[ast.stmt], indent: str, last: bool = False) -> list[str]:
        out: list[str] = []
        for i, node in enumerate(body):
            text = getattr(node, "comment", "")
            out += comment(text, indent) if text else []
            new = self.declare_at.get(id(node), set())
            out += self.statement(node, indent, new, last and i == len(body) - 1)
        return out

    def statement(self, node: ast.stmt, indent: str, new: set[str], last: bool) -> list[str]:
        if isinstance(node, ast.Assign):
            return self.assign(node, indent, new)
        out = self.declared(sorted(new), indent)
        if isinstance(node, ast.AugAssign):
            sign = BINARY[type(node.op)][0]
            text = f"{self.text(node.target)} {sign}= {self.text(node.value)};"
            return [*out, *wrapped(text, indent)]
        if isinstance(node, ast.Return):
            if node.value is None:
                return [*out, f"{indent}return;"]
            return out + self.give(node.value, indent, last)
        if isinstance(node, ast.Expr):
            return [*out, *wrapped(f"{self.text(node.value)};", indent)]
        if isinstance(node, ast.If):
            return out + self.branch(node, indent, last)
        if isinstance(node, ast.For | ast.While):
            head = (
                self.loop(node) if isinstance(node, ast.For) else f"while ({self.text(node.test)})"
            )
            inside = self.block(node.body, indent + "    ")
            return [*out, *wrapped(f"{head} {{", indent), *inside, f"{indent}}}"]
        raise UntranslatableError("statement outside the subset", node)

    def branch(self, node: ast.If, indent: str, last: bool) -> list[str]:
        inner = indent + "    "
        out = wrapped(f"if ({self.text(node.test)}) {{", indent)
        out += self.block(node.body, inner, last)
        rest = node.orelse
        while rest:
            other = rest[0]
            if len(rest) == 1 and isinstance(other, ast.If) and id(other) not in self.declare_at:
                out += wrapped(f"}} else if ({self.text(other.test)}) {{", indent)
                out += self.block(other.body, inner, last)
                rest = other.orelse
            else:
                out += [f"{indent}}} else {{", *self.block(rest, inner, last)]
                break
        return [*out, f"{indent}}}"]

    def loop(self, node: ast.For) -> str:
        if not isinstance(node.iter, ast.Call) or name_of(node.iter.func) != "range":
            raise UntranslatableError("loop over something else than a range", node)
        bounds = [self.text(a) for a in node.iter.args]
        first, end, step = [["0", *bounds, "1"], [*bounds, "1"], bounds][len(bounds) - 1]
        k = name_of(node.target)
        advance = f"{k}++" if step == "1" else f"{k} += {step}"
        return f"for (int {k} = {first}; {k} < {end}; {advance})"

    # --- assignments ----------------------------------------------------------------------

    def declared(self, names: Iterable[str], indent: str) -> list[str]:
        out = []
        for kind in ("int", "real_t"):
            these = [n for n in names if self.types.get(n, "real_t") == kind]
            if these:
                out += wrapped(f"{kind} {', '.join(these)};", indent)
        return out

    def assign(self, node: ast.Assign, indent: str, new: set[str]) -> list[str]:
        target, value = node.targets[0], node.value
        callee = self.all.callee(value)
        if isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple):
            return self.assign_each(target.elts, value.elts, indent, new)
        if isinstance(target, ast.Tuple):
            if callee is None or callee.results != len(target.elts) or callee.results > POINTERS:
                raise UntranslatableError("results of something else than a kernel", node)
            out = self.declared([n for n in map(plain_name, target.elts) if n in new], indent)
            places = [f"&{self.text(t)}" for t in target.elts]
            return out + wrapped(f"{self.text(value, places)};", indent)
        if callee and callee.results > POINTERS:
            return [
                f"{indent}real_t {name_of(target)}[{callee.results}];",
                *wrapped(f"{self.text(value, [name_of(target)])};", indent),
            ]
        if isinstance(target, ast.Name) and target.id in new and target.id not in loaded([value]):
            kind = self.types.get(target.id, "real_t")
            return wrapped(f"{kind} {target.id} = {self.text(value)};", indent)
        out = self.declared(sorted(new), indent)
        return [*out, *wrapped(f"{self.text(target)} = {self.text(value)};", indent)]

    def assign_each(
        self, targets: list[ast.expr], values: list[ast.expr], indent: str, new: set[str]
    ) -> list[str]:
        written: set[str] = set()
        for target, value in zip(targets, values, strict=True):
            if {
                self.text(p) for p in ast.walk(value) if isinstance(p, ast.Name | ast.Subscript)
            } & (written):
                raise UntranslatableError("reads what the same assignment writes", value)
            written.add(self.text(target))
        pairs = [
            f"{self.text(t)}{TIE}={TIE}{self.text(v)}" for t, v in zip(targets, values, strict=True)
        ]
        if all(plain_name(t) in new for t in targets):
            kinds = {self.all.kind(v, self.types) for v in values}
            if kinds == {"real_t"}:
                return wrapped(f"real_t {', '.join(pairs)};", indent)
        out: list[str] = []
        for target, value, pair in zip(targets, values, pairs, strict=True):
            kind = f"{self.all.kind(value, self.types)} " if plain_name(target) in new else ""
            out += wrapped(f"{kind}{pair};", indent)
        return out

    def give(self, value: ast.expr, indent: str, last: bool) -> list[str]:
        results = self.function.results
        if results == 1:
            return wrapped(f"return {self.text(value)};", indent)
        many = results > POINTERS
        if isinstance(value, ast.Tuple):
            places = [f"out[{i}]" if many else f"*out{i + 1}" for i in range(results)]
            out: list[str] = []
            for place, part in zip(places, value.elts, strict=True):
                out += wrapped(f"{place} = {self.text(part)};", indent)
        else:
            names = ["out"] if many else [f"out{i + 1}" for i in range(results)]
            out = wrapped(f"{self.text(value, names)};", indent)
        return out if last else [*out, f"{indent}return;"]


# C types of the names in the specialized kernels, and function prototypes.

# Up to this number results are returned through pointers, otherwise in one array.
POINTERS = 4


class Translator:
    """Translate the required functions, with the C types of all their names.

    `state_size`: count of state numbers that the functions written so far use.
    """

    def __init__(self, kernels: Kernels) -> None:
        self.kernels = kernels
        self.state_size = 0
        self._types: dict[str, dict[str, str]] = {}
        self._returns: dict[str, str] = {}
        self._changed: dict[str, set[str]] = {}
        for function in kernels.functions:  # callees precede their callers
            self._changed[function.name] = set(self._written(function))
            self._type_arrays(function)
        for function in kernels.functions:
            self._type_result(function)
        for function in reversed(kernels.functions):
            self._type_arguments(function)

    def types(self, function: Function) -> dict[str, str]:
        """Return the type of each name: 'real_t', 'int', or 'array'."""
        return self._types.setdefault(function.name, {})

    def changes(self, name: str, parameter: str) -> bool:
        """Whether a function writes into an array argument."""
        return parameter in self._changed[name]

    def _written(self, function: Function) -> Iterator[str]:
        for node in walk(function.body):
            if isinstance(node, ast.Subscript) and isinstance(node.ctx, ast.Store):
                yield name_of(node.value)
            elif isinstance(node, ast.Call) and (other := self.callee(node)):
                for parameter, argument in zip(other.parameters, node.args, strict=True):
                    if parameter in self._changed[other.name]:
                        yield name_of(argument)

    def callee(self, node: ast.expr) -> Function | None:
        """Return the kernel that an expression calls."""
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            return self.kernels.named(node.func.id)
        return None

    def _type_arrays(self, function: Function) -> None:
        """Find arrays: names with an index here, or passed to an array parameter."""
        types = self.types(function)
        for node in walk(function.body):
            if isinstance(node, ast.Subscript) and isinstance(node.value, ast.Name):
                types[node.value.id] = "array"
            elif isinstance(node, ast.Call) and (other := self.callee(node)):
                for parameter, argument in zip(other.parameters, node.args, strict=True):
                    if self.types(other).get(parameter) == "array":
                        types[name_of(argument)] = "array"

    def _type_result(self, function: Function) -> None:
        """Find a result that is a condition, before its callers use it."""
        for node in walk(function.body):
            if isinstance(node, ast.Return) and isinstance(node.value, ast.Compare | ast.BoolOp):
                self._returns[function.name] = "int"

    def _type_arguments(self, function: Function) -> None:
        """Find the types of the locals, then of the parameters of called functions."""
        types = self.types(function)
        for node in walk(function.body):
            if isinstance(node, ast.For):
                types[name_of(node.target)] = "int"
        for node in walk(function.body):
            if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
                types.setdefault(node.targets[0].id, self.kind(node.value, types))
        for node in walk(function.body):
            other = self.callee(node) if isinstance(node, ast.expr) else None
            if other and isinstance(node, ast.Call):
                for parameter, argument in zip(other.parameters, node.args, strict=True):
                    self.types(other).setdefault(parameter, self.kind(argument, types))
            if isinstance(node, ast.Return) and node.value is not None:
                self._returns[function.name] = self.kind(node.value, types)

    def kind(self, node: ast.expr, types: dict[str, str]) -> str:
        """Return the type of an expression."""
        if isinstance(node, ast.Name):
            span = self.kernels.span(node.id)
            return "int" if span and isinstance(span[0], int) else types.get(node.id, "real_t")
        if isinstance(node, ast.Constant):
            return "int" if isinstance(node.value, int) else "real_t"
        if isinstance(node, ast.Compare | ast.BoolOp):
            return "int"
        if isinstance(node, ast.BinOp):
            both = {self.kind(node.left, types), self.kind(node.right, types)}
            return "int" if both == {"int"} and not isinstance(node.op, ast.Div) else "real_t"
        if isinstance(node, ast.Call):
            name = plain_name(node.func)
            return "int" if name == "int" else self._returns.get(name, "real_t")
        return "real_t"

    def returns(self, function: Function) -> str:
        """Return the result type of a C function: one number, or void."""
        return self._returns.get(function.name, "real_t") if function.results == 1 else "void"

    def prototype(self, function: Function) -> str:
        """Return the prototype of a function, on one line."""
        types, arguments = self.types(function), []
        for p in function.parameters:
            if types.get(p) == "array":
                const = "" if self.changes(function.name, p) else "const "
                arguments.append(f"{const}real_t *{p}".replace(" ", TIE))
            else:
                arguments.append(f"{types.get(p, 'real_t')}{TIE}{p}")
        if function.results > POINTERS:
            arguments.append(f"real_t{TIE}out[{function.results}]")
        elif function.results > 1:
            arguments += [f"real_t{TIE}*out{i + 1}" for i in range(function.results)]
        return f"static {self.returns(function)} {function.name}({', '.join(arguments)})"

    def function(self, function: Function) -> list[str]:
        """Return the lines of a function's definition."""
        return _Body(self, function).lines()


# Layout of comments, statements and numbers in the C file.

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
    """A literal: integers as such, others as R(...) in the chosen precision."""
    if isinstance(value, int):
        return str(int(value))
    return f"R({value!r})"
