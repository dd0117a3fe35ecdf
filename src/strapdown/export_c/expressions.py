"""From an expression of a kernel to one of C, with parentheses where C needs them."""

from __future__ import annotations

import ast

from strapdown.export_c.kernels import Function
from strapdown.export_c.kinds import Kinds
from strapdown.export_c.layout import TIE, number
from strapdown.export_c.syntax import UntranslatableError, name_of, plain_name, walk

FUNCTIONS = {
    **{name: name for name in ("sqrt", "sin", "cos", "atan2", "hypot", "fmod", "copysign")},
    "abs": "fabs",
    "max": "fmax",
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


class Expressions:
    """The expressions of one function."""

    def __init__(self, kinds: Kinds, function: Function) -> None:
        self.all, self.function = kinds, function
        self.types = kinds.types(function)

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
            self._note_size(node)
            return f"{self.text(node.value)}[{self.text(node.slice)}]", _ATOM
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
            return f"-{self.text(node.operand, over=_UNARY)}", _UNARY
        if isinstance(node, ast.BinOp):
            sign, strength = BINARY[type(node.op)]
            left = self.text(node.left, over=strength)
            # Not regrouped: floating point is not associative.
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
        if name == "max":
            text = arguments[0]
            for other in arguments[1:]:
                text = f"{macro}({text}, {other})"
            return text
        return f"{macro}({', '.join(arguments)})"

    def _note_size(self, node: ast.Subscript) -> None:
        if name_of(node.value) == "state":
            self.all.state_size = max(self.all.state_size, 1 + self.highest(node.slice))

    def highest(self, node: ast.expr) -> int:
        """Return the highest value that an index can have."""
        if isinstance(node, ast.Constant) and isinstance(node.value, int):
            return node.value
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add | ast.Mult):
            a, b = self.highest(node.left), self.highest(node.right)
            return a + b if isinstance(node.op, ast.Add) else a * b
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
