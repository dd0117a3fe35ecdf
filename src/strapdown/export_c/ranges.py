"""What is known of a number before the program runs: its value, or its range."""

from __future__ import annotations

import ast
from collections.abc import Callable

Number = float | int
# A scalar is (v, v); a whole number of which only the range is known is (low, high).
Span = tuple[Number, Number]
Env = dict[str, Span]


ARITHMETIC: dict[type[ast.operator], Callable[[Number, Number], Number]] = {
    ast.Add: lambda a, b: a + b,
    ast.Sub: lambda a, b: a - b,
    ast.Mult: lambda a, b: a * b,
}


def _less(a: Span, b: Span) -> bool | None:
    return True if a[1] < b[0] else False if a[0] >= b[1] else None


def _equal(a: Span, b: Span) -> bool | None:
    if a[0] == a[1] == b[0] == b[1]:
        return True
    return False if a[1] < b[0] or b[1] < a[0] else None


def _not(known: bool | None) -> bool | None:
    return None if known is None else not known


COMPARISONS: dict[type[ast.cmpop], Callable[[Span, Span], bool | None]] = {
    ast.Lt: _less,
    ast.Gt: lambda a, b: _less(b, a),
    ast.GtE: lambda a, b: _not(_less(a, b)),
    ast.LtE: lambda a, b: _not(_less(b, a)),
    ast.Eq: _equal,
    ast.NotEq: lambda a, b: _not(_equal(a, b)),
}


def equality(test: ast.expr, env: Env) -> tuple[str, Number]:
    """Return name and value of a condition ``name == value`` on a name of known range."""
    if (
        isinstance(test, ast.Compare)
        and isinstance(test.left, ast.Name)
        and test.left.id in env
        and isinstance(test.ops[0], ast.Eq)
        and isinstance(test.comparators[0], ast.Constant)
    ):
        value = test.comparators[0].value
        if isinstance(value, int):
            return test.left.id, value
    return "", 0


def without(span: Span, value: Number) -> Span:
    """Leave a value at either end of a range out."""
    low, high = span
    return (low + (low == value), high - (high == value))
