"""The most operations that a call of a function for a device can take."""

from __future__ import annotations

import ast
import math
from collections import Counter
from collections.abc import Mapping
from typing import Any

from strapdown.constants import CORTEX_M4F_CYCLES
from strapdown.export.kernels import refused
from strapdown.export.sources import Constant, Fma, Kernel
from strapdown.export.translate import MATH, walk

OPERATORS = {ast.Add: "add", ast.Sub: "add", ast.Mult: "multiply", ast.Div: "divide"}
#: Calls of the math library that are not like a sine; abs, max, min and tests of a number cost what
#: a comparison does, which is not counted.
LIBRARY = {"sqrt": "sqrt", "hypot": "sqrt", "fmod": "divide"}

#: Most rounds of a loop by a condition; a series has at most ten.
MOST_ROUNDS = 100


def most_operations(kernel: Kernel, largest: Mapping[str, int] | None = None) -> dict[str, int]:
    """Count the operations of a function of `Kernels` on its longest way, with all that it calls.

    Of the branches of a condition each kind counts with its larger number; loops count with the
    bounds that they have for the sizes of the file. Operations are those of
    `arithmetic.Counted`: on numbers, not on indices and not on constants alone; subtractions count
    as additions, and a fused product as a product and a sum. `largest`: of integers that a kernel
    reads from its state.
    """
    found = _Longest(kernel, {}, largest or {}, {}).block(kernel.node.body)
    return {kind: found[kind] for kind in CORTEX_M4F_CYCLES}


class _Longest:
    """One call of a function, with the values of its integers as far as they are known."""

    def __init__(
        self,
        kernel: Kernel,
        whole: Mapping[str, int | None],
        largest: Mapping[str, int],
        made: dict[Any, Counter[str]],
    ) -> None:
        self.names: dict[str, Any] = kernel.namespace
        #: What calls with the same integers took; see `most_operations`.
        self.made, self.largest = made, largest
        #: Integers: a value, or None where it is not known.
        self.whole = dict(whole)
        loops = (n for n in walk(kernel.node.body) if isinstance(n, ast.For))
        self.whole |= {ast.unparse(n.target): None for n in loops}

    def block(self, body: list[ast.stmt]) -> Counter[str]:
        """Count statements."""
        total: Counter[str] = Counter()
        for k, node in enumerate(body):
            if not isinstance(node, ast.If):
                total += self.statement(node)
                if isinstance(node, ast.Return):
                    break
                continue
            total += self.of(node.test)
            before = dict(self.whole)
            first = self.block(node.body)
            after, self.whole = self.whole, before
            # `|` is the larger of both for each kind.
            if isinstance(node.body[-1], ast.Return):
                return total + (first | self.block([*node.orelse, *body[k + 1 :]]))
            total += first | self.block(node.orelse)
            for name in after.keys() | self.whole.keys():
                if after.get(name) != self.whole.get(name):
                    self.whole[name] = None
        return total

    def statement(self, node: ast.stmt) -> Counter[str]:
        """Count one statement."""
        if isinstance(node, ast.For):
            return self.loop(node)
        if isinstance(node, ast.While):
            return self.rounds(node)
        total: Counter[str] = Counter()
        for value in (n for n in ast.iter_child_nodes(node) if isinstance(n, ast.expr)):
            total += self.of(value)
        if isinstance(node, ast.AugAssign) and not self.is_whole(node.target):
            total[OPERATORS[type(node.op)]] += 1
        if isinstance(node, ast.AugAssign) and isinstance(node.target, ast.Name):
            name = node.target.id
            sum_of = ast.BinOp(ast.Name(name, ast.Load()), node.op, node.value)
            if self.is_whole(sum_of):
                self.whole[name] = self.value(sum_of)
        if isinstance(node, ast.Assign):
            for target in node.targets:
                self.assign(target, node.value)
        return total

    def assign(self, target: ast.expr, value: ast.expr) -> None:
        """Remember integers."""
        if isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple):
            for part, one in zip(target.elts, value.elts, strict=True):
                self.assign(part, one)
        elif isinstance(target, ast.Name):
            self.whole.pop(target.id, None)
            if self.is_whole(value):
                self.whole[target.id] = self.largest.get(target.id, self.value(value))

    def rounds(self, node: ast.While) -> Counter[str]:
        """Count the rounds of a loop as long as its condition, of known integers, holds."""
        total: Counter[str] = Counter()
        for _ in range(MOST_ROUNDS):
            holds = self.value(node.test)
            if holds is None:
                break
            total += self.of(node.test)
            if not holds:
                return total
            total += self.block(node.body)
        raise refused("a loop without a bound", node)

    def loop(self, node: ast.For) -> Counter[str]:
        """Count the rounds of a loop, each with its own value of the variable."""
        assert isinstance(node.iter, ast.Call) and isinstance(node.target, ast.Name)
        bounds = [self.value(bound) for bound in node.iter.args]
        total = sum((self.of(bound) for bound in node.iter.args), Counter[str]())
        if None in bounds:
            self.whole[node.target.id] = None
            if self.block(node.body):
                raise refused("a loop without a bound", node)
            return total
        for value in range(*bounds):  # type: ignore[arg-type]
            self.whole[node.target.id] = value
            total += self.block(node.body)
        return total

    # Expressions.

    def of(self, node: ast.expr) -> Counter[str]:
        """Count an expression."""
        if isinstance(node, ast.IfExp):
            return self.of(node.test) + (self.of(node.body) | self.of(node.orelse))
        total: Counter[str] = Counter()
        for part in ast.iter_child_nodes(node):
            if isinstance(part, ast.expr) and not isinstance(node, ast.Attribute):
                total += self.of(part)
        if isinstance(node, ast.BinOp) and not (self.is_whole(node) or self.is_constant(node)):
            total["multiply" if isinstance(node.op, ast.Pow) else OPERATORS[type(node.op)]] += 1
        if isinstance(node, ast.Call):
            total += self.call(node)
        return total

    def call(self, node: ast.Call) -> Counter[str]:
        """Count what a call does."""
        name = node.func.attr if isinstance(node.func, ast.Attribute) else ast.unparse(node.func)
        held = self.names.get(name)
        if isinstance(held, Kernel):
            pairs = zip(held.parameters, node.args, strict=True)
            whole = {p: self.value(a) for p, a in pairs if self.is_whole(a)}
            key = (held, *whole.items())
            if key not in self.made:
                inside = _Longest(held, whole, self.largest, self.made)
                self.made[key] = inside.block(held.node.body)
            return self.made[key]
        if isinstance(held, Fma):
            return Counter(add=1, multiply=1)
        if name not in MATH or name in ("copysign", "rint"):
            return Counter()
        return Counter({LIBRARY.get(name, "trig"): 1})

    def is_whole(self, node: ast.expr) -> bool:
        """Whether an expression is an integer."""
        if isinstance(node, ast.Name):
            held = self.names.get(node.id)
            constant = isinstance(held, Constant) and isinstance(held.value, int)
            return node.id in self.whole or constant
        if isinstance(node, ast.BinOp):
            sides = self.is_whole(node.left) and self.is_whole(node.right)
            return sides and not isinstance(node.op, ast.Div)
        if isinstance(node, ast.UnaryOp):
            return self.is_whole(node.operand)
        if isinstance(node, ast.Call):
            held = self.names.get(ast.unparse(node.func))
            if not isinstance(held, Kernel):
                return ast.unparse(node.func) == "int"
            inside = _Longest(held, {}, {}, {})
            given = [n.value for n in walk(held.node.body) if isinstance(n, ast.Return)]
            return all(value is not None and inside.is_whole(value) for value in given)
        return isinstance(node, ast.Constant) and isinstance(node.value, int)

    def is_constant(self, node: ast.expr) -> bool:
        """Whether the compiler knows an expression."""
        leaves = [n for n in ast.walk(node) if isinstance(n, ast.Name | ast.Subscript | ast.Call)]
        known = {"math", "np"}
        return all(
            isinstance(n, ast.Name)
            and (isinstance(self.names.get(n.id), Constant) or n.id in known)
            for n in leaves
        )

    def value(self, node: ast.expr) -> int | None:
        """Value of an integer, if it is known."""
        names = {n.id for n in ast.walk(node) if isinstance(n, ast.Name)}
        values: dict[str, Any] = {"math": math}
        for name in names:
            held = self.names.get(name)
            values[name] = held.value if isinstance(held, Constant) else self.whole.get(name)
        if None in values.values() or any(isinstance(n, ast.Subscript) for n in ast.walk(node)):
            return None
        text = compile(ast.fix_missing_locations(ast.Expression(node)), "bound", "eval")
        return int(eval(text, {"__builtins__": {"int": int}}, values))
