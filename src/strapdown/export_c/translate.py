"""From a specialised kernel to a C function: same names, same formulas, same order."""

from __future__ import annotations

import ast
from collections.abc import Iterable

from strapdown.export_c.expressions import BINARY, Expressions
from strapdown.export_c.kernels import Function
from strapdown.export_c.kinds import POINTERS, Kinds
from strapdown.export_c.layout import TIE, comment, wrapped
from strapdown.export_c.syntax import (
    UntranslatableError,
    first_uses,
    loaded,
    name_of,
    plain_name,
    stored,
    walk,
)


class Translator(Kinds):
    """Translate the functions that were asked of the kernels."""

    def function(self, function: Function) -> list[str]:
        """Return the lines of a function's definition."""
        return _Body(self, function).lines()


class _Body(Expressions):
    """The statements of one function."""

    def __init__(self, kinds: Kinds, function: Function) -> None:
        super().__init__(kinds, function)
        own = set(stored(function.body)) - set(function.parameters)
        loops = {name_of(n.target) for n in walk(function.body) if isinstance(n, ast.For)}
        self.declare_at = first_uses(function.body, own - loops)

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
        if isinstance(node, ast.Return) and node.value is not None:
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
