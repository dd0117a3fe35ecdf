"""Specialized kernel functions and their sources."""

from __future__ import annotations

import ast
import copy
import inspect
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field

from strapdown._kernels.arithmetic import SOURCES, kernel_module, kernels_of


@dataclass
class Function:
    """One function of a kernel, specialized.

    `name`: name of the kernel; a second version has a number appended. `doc`: first paragraphs of
    its docstring. `parameters`: parameters that are still used. `body`: statements; ``comment`` of
    each holds the comment lines above it. `results`: number of returned values.
    """

    name: str
    doc: str
    parameters: list[str]
    body: list[ast.stmt]
    results: int


@dataclass(frozen=True)
class Constant:
    """A constant of a kernel module with the comment above it."""

    name: str
    value: Number
    comment: str


@dataclass
class Kernels:
    """The sources of all kernels, and the functions required so far.

    `home`: module of the algorithm's kernels (`attitude_algorithms.cost.kernel_home`). `ranges`:
    for a variable with an integer value at run time: the least and the greatest. `fixed`: numbers
    of the state and calls, as they are written, whose value is known. `functions`: in the order of
    definition.
    """

    home: str
    ranges: dict[str, tuple[int, int]] = field(default_factory=dict)
    fixed: dict[str, float] = field(default_factory=dict)
    functions: list[Function] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._sources: dict[str, ast.FunctionDef] = {}
        self._constants: dict[str, Constant] = {}
        self._made: dict[tuple[object, ...], Function] = {}
        for name in dict.fromkeys((*SOURCES, self.home)):
            module = kernel_module(name)
            tree = kernels_of(name)
            attach_comments(tree, inspect.getsource(module).splitlines())
            for node in tree.body:
                if isinstance(node, ast.FunctionDef):
                    self._sources[node.name] = node
                elif isinstance(node, ast.Assign):
                    for target in ast.walk(node.targets[0]):
                        if isinstance(target, ast.Name):
                            value, about = getattr(module, target.id), getattr(node, "comment", "")
                            self._constants[target.id] = Constant(target.id, value, about)

    def constants(self) -> list[Constant]:
        """Return the constants that the functions use, in the order of the sources."""
        used = {name for f in self.functions for name in loaded(f.body)}
        return [c for c in self._constants.values() if c.name in used]

    def require(
        self, name: str, options: Env | None = None, keep: tuple[int, ...] | None = None
    ) -> Function:
        """Specialize a function and all functions that it calls.

        `name`: a function of a kernel module. `options`: known values of its parameters. `keep`:
        results to keep, by position; by default all.
        """
        options = options or {}
        key = (name, tuple(sorted(options.items())), keep)
        if key not in self._made:
            node = self._sources[name]
            body = Specialiser(self, dict(options)).block(without_docstring(node.body))
            if keep is not None:
                body = [Keep(keep).visit(s) for s in body]
            body = without_unused(body)
            used = loaded(body)
            versions = sum(made[0] == name for made in self._made)
            self._made[key] = function = Function(
                name=f"{name}_{versions + 1}" if versions else name,
                doc=ast.get_docstring(node) or "",
                parameters=[a.arg for a in node.args.args if a.arg in used],
                body=body,
                results=self._results(body),
            )
            self.functions.append(function)
        return self._made[key]

    def named(self, name: str) -> Function | None:
        """Return the specialized function of that name."""
        return next((f for f in self.functions if f.name == name), None)

    def is_kernel(self, name: str) -> bool:
        """Whether there is a kernel of that name."""
        return name in self._sources

    def parameters(self, name: str) -> list[str]:
        """Return the parameters that a kernel has in the source."""
        return [a.arg for a in self._sources[name].args.args]

    def span(self, name: str) -> Span | None:
        """Return the value of a module constant."""
        constant = self._constants.get(name)
        return (constant.value, constant.value) if constant else None

    def _results(self, body: list[ast.stmt]) -> int:
        for node in walk(body):
            if isinstance(node, ast.Return):
                value = node.value
                if isinstance(value, ast.Tuple):
                    return len(value.elts)
                if isinstance(value, ast.Call) and isinstance(value.func, ast.Name):
                    other = self.named(value.func.id)
                    return other.results if other else 1
                return 1 if value is not None else 0
        return 0


# Specialization of the kernels of one algorithm, with its options as constants.
#
# The kernels take their options as numbers. A kernel is read as a syntax tree and followed from
# its first function: conditions on options are decided, and excluded branches and unused
# parameters and variables are dropped. The same formulas remain in the same order. This part is
# independent of C.


class Specialiser:
    """One function, with the known values of its names."""

    def __init__(self, kernels: Kernels, env: Env) -> None:
        self.kernels, self.env = kernels, env

    # --- statements -----------------------------------------------------------------------

    def block(self, body: list[ast.stmt]) -> list[ast.stmt]:
        """Specialize statements up to the first return."""
        done: list[ast.stmt] = []
        for node in body:
            done += self.statement(node)
            if done and isinstance(done[-1], ast.Return):
                break
        return done

    def statement(self, node: ast.stmt) -> list[ast.stmt]:
        """Specialize one statement into none, one or several."""
        if isinstance(node, ast.If):
            return self.branch(node)
        new: ast.stmt
        if isinstance(node, ast.Assign) and len(node.targets) == 1:
            new = ast.Assign([self.target(node.targets[0])], self.expression(node.value))
            self.remember(node.targets[0])
        elif isinstance(node, ast.AugAssign):
            target = self.target(node.target)
            if not isinstance(target, ast.Name | ast.Subscript):
                raise UntranslatableError("statement outside the subset", node)
            new = ast.AugAssign(target, node.op, self.expression(node.value))
        elif isinstance(node, ast.Return):
            new = ast.Return(None if node.value is None else self.expression(node.value))
        elif isinstance(node, ast.Expr) and isinstance(node.value, ast.Call):
            new = ast.Expr(self.expression(node.value))
        elif isinstance(node, ast.For) and isinstance(node.iter, ast.Tuple):
            return self.each(node, node.iter)
        elif isinstance(node, ast.For):
            new = ast.For(node.target, self.expression(node.iter), self.block(node.body), [])
        elif isinstance(node, ast.While):
            new = ast.While(self.expression(node.test), self.block(node.body), [])
        else:
            raise UntranslatableError("statement outside the subset", node)
        return [like(new, node)]

    def target(self, node: ast.expr) -> ast.expr:
        """Specialize the target of an assignment."""
        for part in ast.walk(node):
            if (
                isinstance(part, ast.Name)
                and isinstance(part.ctx, ast.Store)
                and part.id in self.env
            ):
                raise UntranslatableError("an option is given another value", node)
        return self.expression(node)

    def remember(self, target: ast.expr) -> None:
        """Store the range of a name that has one."""
        if isinstance(target, ast.Name) and target.id in self.kernels.ranges:
            self.env[target.id] = self.kernels.ranges[target.id]

    def each(self, node: ast.For, values: ast.Tuple) -> list[ast.stmt]:
        """Unroll a loop over a tuple."""
        if not isinstance(node.target, ast.Name):
            raise UntranslatableError("loop over more than one name", node)
        out: list[ast.stmt] = []
        for value in values.elts:
            out += self.block(
                [Put(node.target.id, value).visit(copy.deepcopy(s)) for s in node.body]
            )
        return out

    def branch(self, node: ast.If) -> list[ast.stmt]:
        """Decide a condition, or follow both branches with the knowledge of each."""
        truth = self.truth(node.test)
        if truth is not None:
            return self.block(node.body if truth else node.orelse)
        before = dict(self.env)
        test = self.expression(node.test)
        name, value = equality(node.test, self.env)
        if name:
            self.env[name] = (value, value)
        body = self.block(node.body)
        self.env = otherwise = dict(before)
        if name:
            otherwise[name] = without(before[name], value)
        orelse = self.block(node.orelse)
        # The following statements are reached only through the other branch.
        self.env = otherwise if body and isinstance(body[-1], ast.Return) else before
        return [like(ast.If(test, body, orelse), node)]

    # --- expressions ----------------------------------------------------------------------

    def expression(self, node: ast.expr) -> ast.expr:
        """Substitute known values."""
        fixed = self.fixed(node)
        if fixed is not None:
            return ast.copy_location(ast.Constant(fixed), node)
        if self.depends(node):
            span = self.span(node)
            if span and span[0] == span[1]:
                return ast.copy_location(ast.Constant(span[0]), node)
        if isinstance(node, ast.Call):
            return self.call(node)
        if isinstance(node, ast.IfExp):
            truth = self.truth(node.test)
            if truth is not None:
                return self.expression(node.body if truth else node.orelse)
        if isinstance(node, ast.BoolOp):
            return self.boolean(node)
        new = copy.copy(node)
        for name, value in ast.iter_fields(node):
            if isinstance(value, ast.expr):
                setattr(new, name, self.expression(value))
            elif isinstance(value, list):
                setattr(
                    new, name, [self.expression(v) if isinstance(v, ast.expr) else v for v in value]
                )
        return new

    def boolean(self, node: ast.BoolOp) -> ast.expr:
        """Drop known terms that do not matter."""
        rest = [self.expression(v) for v in node.values if self.truth(v) is None]
        return rest[0] if len(rest) == 1 else ast.copy_location(ast.BoolOp(node.op, rest), node)

    def call(self, node: ast.Call) -> ast.expr:
        """Call the function specialized for the known arguments."""
        if not isinstance(node.func, ast.Name) or not self.kernels.is_kernel(node.func.id):
            return ast.copy_location(
                ast.Call(node.func, [self.expression(a) for a in node.args], []), node
            )
        names = self.kernels.parameters(node.func.id)
        arguments = dict(zip(names, node.args, strict=True))
        known = {n: s for n, a in arguments.items() if self.depends(a) and (s := self.span(a))}
        function = self.kernels.require(node.func.id, known)
        values = [self.expression(arguments[n]) for n in function.parameters]
        return ast.copy_location(ast.Call(ast.Name(function.name, ast.Load()), values, []), node)

    # --- known values ---------------------------------------------------------------------

    def depends(self, node: ast.expr) -> bool:
        """Whether an option takes part; formulas of constants alone stay as written."""
        return any(isinstance(p, ast.Name) and p.id in self.env for p in ast.walk(node))

    def fixed(self, node: ast.expr) -> float | None:
        """Value of a number of the state, or of a call, that is known; of others None."""
        read = isinstance(node, ast.Call) or (
            isinstance(node, ast.Subscript) and isinstance(node.ctx, ast.Load)
        )
        return self.kernels.fixed.get(ast.unparse(node)) if read else None

    def span(self, node: ast.expr) -> Span | None:
        """Value or range of an expression, if options or constants determine it."""
        if isinstance(node, ast.Constant) and isinstance(node.value, int | float):
            return node.value, node.value
        fixed = self.fixed(node)
        if fixed is not None:
            return fixed, fixed
        if isinstance(node, ast.Name):
            return self.env.get(node.id) or self.kernels.span(node.id)
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and len(node.args) == 1:
            kind = {"int": int, "float": float}.get(node.func.id)
            inside = self.span(node.args[0])
            return (kind(inside[0]), kind(inside[1])) if kind and inside else None
        if isinstance(node, ast.BinOp):
            a, b = self.span(node.left), self.span(node.right)
            operation = ARITHMETIC.get(type(node.op))
            if a and b and operation:
                corners = [operation(p, q) for p in a for q in b]
                return min(corners), max(corners)
        return None

    def truth(self, node: ast.expr) -> bool | None:
        """Value of a condition, if the options determine it."""
        if isinstance(node, ast.BoolOp):
            known = [self.truth(v) for v in node.values]
            decides = isinstance(node.op, ast.Or)
            if decides in known:
                return decides
            return None if None in known else not decides
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
            inside = self.truth(node.operand)
            return None if inside is None else not inside
        if isinstance(node, ast.Compare) and len(node.ops) == 1 and self.known(node):
            a, b = self.span(node.left), self.span(node.comparators[0])
            if a and b:
                return COMPARISONS[type(node.ops[0])](a, b)
        fixed = self.fixed(node)
        if fixed is not None:
            return bool(fixed)
        span = self.env.get(node.id) if isinstance(node, ast.Name) else None
        return bool(span[0]) if span and span[0] == span[1] else None

    def known(self, node: ast.expr) -> bool:
        """Whether an option, or a number of the state that is known, takes part."""
        parts = (p for p in ast.walk(node) if isinstance(p, ast.expr))
        return self.depends(node) or any(self.fixed(p) is not None for p in parts)


# Knowledge of a number before the program runs: its value, or its range.


Number = float | int
# A scalar is (v, v); an integer known only by range is (low, high).
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
    """Exclude a value at either end of a range."""
    low, high = span
    return (low + (low == value), high - (high == value))


# Analysis and transformation of kernel syntax trees.


class UntranslatableError(Exception):
    """A kernel is outside the subset of Python that can be translated."""

    def __init__(self, what: str, node: ast.AST) -> None:
        super().__init__(f"line {getattr(node, 'lineno', '?')}: {what}: {ast.unparse(node)}")


class Put(ast.NodeTransformer):
    """Replace a name by an expression."""

    def __init__(self, name: str, value: ast.expr) -> None:
        self.name, self.value = name, value

    def visit_Name(self, node: ast.Name) -> ast.expr:
        """Replace the name."""
        return self.value if node.id == self.name else node


class Keep(ast.NodeTransformer):
    """Return only some of the results."""

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
    """Give a new statement the position and the comment of the old one."""
    ast.copy_location(new, old)
    new.comment = getattr(old, "comment", "")  # type: ignore[attr-defined]
    return new


def walk(body: Iterable[ast.AST]) -> Iterator[ast.AST]:
    """Iterate over every node of some statements."""
    for node in body:
        yield from ast.walk(node)


def loaded(body: Iterable[ast.AST]) -> set[str]:
    """Return the names that are read; targets of augmented assignments are included."""
    names = set()
    for node in walk(body):
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load):
            names.add(node.id)
        elif isinstance(node, ast.AugAssign) and isinstance(node.target, ast.Name):
            names.add(node.target.id)
    return names


def without_docstring(body: list[ast.stmt]) -> list[ast.stmt]:
    """Statements of a function after its docstring."""
    first = body[0]
    is_doc = isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant)
    return body[1:] if is_doc else body


def without_unused(body: list[ast.stmt]) -> list[ast.stmt]:
    """Drop assignments to unused names, repeatedly."""
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
    """Attach to each statement the comment lines directly above it."""
    for node in ast.walk(tree):
        if isinstance(node, ast.stmt) and not isinstance(node, ast.FunctionDef):
            at = node.lineno - 2
            found: list[str] = []
            while at >= 0 and lines[at].lstrip().startswith("# ") and "# ---" not in lines[at]:
                found.insert(0, lines[at].strip()[2:])
                at -= 1
            node.comment = " ".join(found)  # type: ignore[attr-defined]


# --- declaration of variables -------------------------------------------------------------


def first_uses(body: list[ast.stmt], names: set[str]) -> dict[int, set[str]]:
    """For each name, find the innermost block with all its uses, and its first statement there."""
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
    """Names that are assigned."""
    for node in walk(body):
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            yield node.id


def plain_name(node: ast.expr) -> str:
    """The name that an expression consists of, or an empty string."""
    return node.id if isinstance(node, ast.Name) else ""


def name_of(node: ast.expr) -> str:
    """The name of an expression that must be a name."""
    if not isinstance(node, ast.Name):
        raise UntranslatableError("a plain name is expected", node)
    return node.id
