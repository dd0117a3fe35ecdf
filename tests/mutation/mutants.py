"""Mutants of a source text: one small change each, made on its syntax tree.

The rest of the text stays as it is, to the letter, so that line numbers hold.
"""

from __future__ import annotations

import ast
import random
from collections.abc import Iterator
from dataclasses import dataclass

SWAPS: dict[type, type] = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.Lt: ast.LtE,
    ast.LtE: ast.Lt,
    ast.Gt: ast.GtE,
    ast.GtE: ast.Gt,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
    ast.And: ast.Or,
    ast.Or: ast.And,
}


@dataclass(frozen=True)
class Mutant:
    """One change of a source text.

    Attributes
    ----------
    line : int
        From 1, of the first line that changes.
    kind : str
        The operator that made it.
    before, after : str
        The changed line or lines, stripped; they identify the mutant where line numbers move.
    text : str
        The whole source with the change.
    """

    line: int
    kind: str
    before: str
    after: str
    text: str


def mutants(source: str) -> list[Mutant]:
    """All mutants of a source text, in the order of the text."""
    tree = ast.parse(source)
    lines = source.splitlines(keepends=True)
    starts = [0]
    for line in lines:
        starts.append(starts[-1] + len(line.encode()))
    raw = source.encode()
    result = []
    for kind, node, new in _changes(tree):
        begin = starts[node.lineno - 1] + node.col_offset
        end = starts[node.end_lineno - 1] + node.end_col_offset
        text = (raw[:begin] + new.encode() + raw[end:]).decode()
        old_part = "".join(lines[node.lineno - 1 : node.end_lineno]).strip()
        grown = new.count("\n") - raw[begin:end].decode().count("\n")
        changed = text.splitlines(keepends=True)[node.lineno - 1 : node.end_lineno + grown]
        result.append(Mutant(node.lineno, kind, old_part, "".join(changed).strip(), text))
    return sorted(result, key=lambda m: (m.line, m.kind, m.after))


def sample(source: str, path: str, count: int, seed: int) -> list[Mutant]:
    """A sample that depends on the text, its path and the seed alone."""
    every = mutants(source)
    chosen = random.Random(f"{seed}:{path}").sample(range(len(every)), min(count, len(every)))
    return [every[k] for k in sorted(chosen)]


def stated(source: str, before: str, after: str) -> Mutant:
    """The mutant that replaces one stated piece of text, which must occur once.

    Raises
    ------
    ValueError
        The text does not occur, or more than once.
    """
    if source.count(before) != 1:
        raise ValueError(f"{before!r} occurs {source.count(before)} times")
    line = source[: source.index(before)].count("\n") + 1
    return Mutant(line, "stated", before, after, source.replace(before, after))


def _changes(tree: ast.Module) -> Iterator[tuple[str, ast.AST, str]]:
    """Kind, node that is replaced, and its new text; parentheses keep the precedence."""
    for node in _code(tree):
        match node:
            case ast.BinOp(op=ast.Add() | ast.Sub() | ast.Mult() | ast.Div()) if not _text(node):
                yield "arithmetic", node, f"({_with(node, op=SWAPS[type(node.op)]())})"
            case ast.AugAssign(op=ast.Add() | ast.Sub() | ast.Mult() | ast.Div()):
                yield "arithmetic", node, _with(node, op=SWAPS[type(node.op)]())
                yield "deleted update", node, "pass"
            case ast.Assign(targets=[ast.Name(id=name)]) if _reads(node.value, name):
                yield "deleted update", node, "pass"
            case ast.Expr(value=ast.Call()):
                yield "deleted call", node, "pass"
            case ast.Compare(ops=[op]) if type(op) in SWAPS:
                yield "comparison", node, f"({_with(node, ops=[SWAPS[type(op)]()])})"
            case ast.Compare(ops=[first, *rest]) if rest and type(first) in SWAPS:
                yield "comparison", node, f"({_with(node, ops=[SWAPS[type(first)](), *rest])})"
            case ast.BoolOp():
                yield "logic", node, f"({_with(node, op=SWAPS[type(node.op)]())})"
            case ast.UnaryOp(op=ast.USub() | ast.Not()):
                yield "dropped sign", node, f"({ast.unparse(node.operand)})"
            case ast.Constant(value=value) if type(value) is float:
                yield "constant", node, repr(1.5 * value if value else 1.0)
            case ast.Constant(value=value) if type(value) is int:
                yield "constant", node, repr(value + 1)
        if isinstance(node, ast.If | ast.IfExp):
            yield "condition", node.test, f"(not ({ast.unparse(node.test)}))"


def _code(node: ast.AST) -> Iterator[ast.AST]:
    """Nodes that compute: no annotations, decorators, messages, indices or lists of names."""
    for name, field in ast.iter_fields(node):
        if name in ("annotation", "returns", "decorator_list", "slice"):
            continue
        for child in field if isinstance(field, list) else [field]:
            if isinstance(child, ast.Raise | ast.JoinedStr) or not isinstance(child, ast.AST):
                continue
            if isinstance(child, ast.If) and "TYPE_CHECKING" in ast.unparse(child.test):
                continue
            if hasattr(child, "lineno"):
                yield child
            yield from _code(child)


def _with(node: ast.AST, **changed: object) -> str:
    fields = dict(ast.iter_fields(node)) | changed
    return ast.unparse(type(node)(**fields))


def _text(node: ast.BinOp) -> bool:
    """Whether the operands are text or lists by their look."""
    kinds = (ast.JoinedStr, ast.List, ast.Tuple)
    return any(
        isinstance(x, kinds) or (isinstance(x, ast.Constant) and isinstance(x.value, str))
        for x in (node.left, node.right)
    )


def _reads(value: ast.AST, name: str) -> bool:
    return any(isinstance(x, ast.Name) and x.id == name for x in ast.walk(value))
