"""What is read from, and changed in, the syntax trees of kernels."""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator


class UntranslatableError(Exception):
    """A kernel has left the subset of Python that can be translated."""

    def __init__(self, what: str, node: ast.AST) -> None:
        super().__init__(f"line {getattr(node, 'lineno', '?')}: {what}: {ast.unparse(node)}")


class Put(ast.NodeTransformer):
    """Put an expression in the place of a name."""

    def __init__(self, name: str, value: ast.expr) -> None:
        self.name, self.value = name, value

    def visit_Name(self, node: ast.Name) -> ast.expr:
        """Replace the name."""
        return self.value if node.id == self.name else node


class Keep(ast.NodeTransformer):
    """Return some of the results alone."""

    def __init__(self, keep: tuple[int, ...]) -> None:
        self.keep = keep

    def visit_Return(self, node: ast.Return) -> ast.Return:
        """Choose from a tuple."""
        if not isinstance(node.value, ast.Tuple):
            raise UntranslatableError("results that cannot be chosen from", node)
        values = [node.value.elts[i] for i in self.keep]
        node.value = values[0] if len(values) == 1 else ast.Tuple(values, ast.Load())
        return node


def like(new: ast.stmt, old: ast.stmt) -> ast.stmt:
    """Give a new statement the place and the comment of the old one."""
    ast.copy_location(new, old)
    new.comment = getattr(old, "comment", "")  # type: ignore[attr-defined]
    return new


def walk(body: Iterable[ast.AST]) -> Iterator[ast.AST]:
    """Every node of some statements."""
    for node in body:
        yield from ast.walk(node)


def loaded(body: Iterable[ast.AST]) -> set[str]:
    """Return the names that are read; what an augmented assignment changes is read, too."""
    names = set()
    for node in walk(body):
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load):
            names.add(node.id)
        elif isinstance(node, ast.AugAssign) and isinstance(node.target, ast.Name):
            names.add(node.target.id)
    return names


def without_docstring(body: list[ast.stmt]) -> list[ast.stmt]:
    """The statements of a function after its docstring."""
    first = body[0]
    is_doc = isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant)
    return body[1:] if is_doc else body


def without_unused(body: list[ast.stmt]) -> list[ast.stmt]:
    """Drop assignments to names that nobody reads, until there are none."""
    while True:
        used = loaded(body)
        shorter = _assignments_to(body, used)
        if loaded(shorter) == used:
            return shorter
        body = shorter


def _assignments_to(body: list[ast.stmt], used: set[str]) -> list[ast.stmt]:
    out: list[ast.stmt] = []
    for node in body:
        if isinstance(node, ast.If | ast.For | ast.While):
            node.body = _assignments_to(node.body, used)
            node.orelse = _assignments_to(node.orelse, used)
        elif isinstance(node, ast.Assign):
            target, value = node.targets[0], node.value
            if isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple):
                pairs = [
                    (t, v)
                    for t, v in zip(target.elts, value.elts, strict=True)
                    if not (isinstance(t, ast.Name) and t.id not in used)
                ]
                if not pairs:
                    continue
                target.elts, value.elts = [t for t, _ in pairs], [v for _, v in pairs]
            elif isinstance(target, ast.Name) and target.id not in used:
                continue
        out.append(node)
    return out


def attach_comments(tree: ast.Module, lines: list[str]) -> None:
    """Note with each statement the comment lines right above it."""
    for node in ast.walk(tree):
        if isinstance(node, ast.stmt) and not isinstance(node, ast.FunctionDef):
            at = node.lineno - 2
            found: list[str] = []
            while at >= 0 and lines[at].lstrip().startswith("# ") and "# ---" not in lines[at]:
                found.insert(0, lines[at].strip()[2:])
                at -= 1
            node.comment = " ".join(found)  # type: ignore[attr-defined]


# --- where a variable is declared ---------------------------------------------------------


def first_uses(body: list[ast.stmt], names: set[str]) -> dict[int, set[str]]:
    """Find for each name the innermost block that holds it all, and its first statement there."""
    places: dict[int, set[str]] = {}
    for name in names:
        block = body
        while True:
            holding = [node for node in block if name in _names([node])]
            first = holding[0]
            inner = [b for b in _blocks(first) if name in _names(b)]
            outside = isinstance(first, ast.If | ast.While) and name in _names([first.test])
            if len(holding) > 1 or len(inner) != 1 or outside:
                break
            block = inner[0]
        places.setdefault(id(first), set()).add(name)
    return places


def _blocks(node: ast.stmt) -> list[list[ast.stmt]]:
    if isinstance(node, ast.If):
        return [node.body, node.orelse]
    return [node.body] if isinstance(node, ast.For | ast.While) else []


def _names(body: Iterable[ast.AST]) -> set[str]:
    return {n.id for n in walk(body) if isinstance(n, ast.Name)}


def stored(body: Iterable[ast.AST]) -> Iterator[str]:
    """The names that are given a value."""
    for node in walk(body):
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            yield node.id


def plain_name(node: ast.expr) -> str:
    """The name that an expression is, or nothing."""
    return node.id if isinstance(node, ast.Name) else ""


def name_of(node: ast.expr) -> str:
    """The name that an expression must be."""
    if not isinstance(node, ast.Name):
        raise UntranslatableError("a plain name is expected", node)
    return node.id
