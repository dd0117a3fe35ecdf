"""Kernels with their options as constants: what a file for a device is made of.

The kernels take their options as numbers. A kernel is read as a syntax tree and followed from its
first function: conditions on options are decided, and excluded branches and unused parameters and
variables are dropped. The same formulas remain in the same order. This part is independent of C.
"""

from __future__ import annotations

import ast
import copy
import functools
import itertools
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from strapdown import _kernels
from strapdown._kernels.arithmetic import PACKAGE, SOURCES
from strapdown.export.sources import CONSTANTS, Constant, Fma, Kernel, load
from strapdown.export.translate import Translator, UntranslatableError, loaded, stored, walk
from strapdown.export.types_of_c import Type

# Knowledge of a number before the program runs: its value (v, v), or the range of an integer.
Number = float | int
Span = tuple[Number, Number]
Env = dict[str, Span]


@functools.cache
def _modules(*names: str) -> dict[str, dict[str, Any]]:
    return load(Path(_kernels.__file__).parent, names)


@dataclass
class Kernels:
    """The kernels of a module and those that it imports, and the functions required so far.

    `home`: module of the kernels (`arithmetic.kernel_home`), `others` further ones.
    `ranges`: for a variable with an integer value at run time: the least and the greatest. `fixed`:
    numbers of the state and calls, as they are written, whose value is known. `functions`: in the
    order of definition.
    """

    home: str
    ranges: dict[str, tuple[int, int]] = field(default_factory=dict)
    fixed: dict[str, float] = field(default_factory=dict)
    functions: list[Kernel] = field(default_factory=list)
    others: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        self.home = self.home.removeprefix(f"{PACKAGE}.")
        self._homes = (self.home, *self.others, *SOURCES)
        self._modules = _modules(*self._homes)
        self._made: dict[tuple[object, ...], Kernel] = {}
        self._widths: dict[Kernel, dict[str, int]] = {}
        #: Meaning of the names in specialized functions: functions and constants.
        self.namespace: dict[str, Any] = {}

    def source(self, name: str) -> Kernel:
        """Return a kernel of the home, or of the modules that all files use."""
        for module in self._homes:
            if isinstance(held := self._modules[module].get(name), Kernel):
                return held
        raise KeyError(name)

    def constants(self) -> list[Constant]:
        """Return the constants that the functions use, in the order of the sources."""
        used = loaded([f.node for f in self.functions])
        held = {n: c for n, c in self.namespace.items() if isinstance(c, Constant) and n in used}
        spaces = [space[CONSTANTS].values() for space in self._modules.values()]
        place = {id(c): k for k, c in enumerate(itertools.chain(*spaces))}
        rows = sorted(held.items(), key=lambda row: place[id(row[1])])
        return [Constant(c.module, name, c.value, c.comment) for name, c in rows]

    def require(
        self,
        name: str,
        options: Env | None = None,
        keep: tuple[int, ...] | None = None,
        sizes: Mapping[str, tuple[int, ...]] | None = None,
    ) -> Kernel:
        """Specialize a kernel, by its name, and all that it calls: see `specialised`.

        `sizes`: of its arrays, by parameter.
        """
        options, sizes = options or {}, sizes or {}
        for array, shape in sizes.items():
            options |= {f"{array}.shape[{k}]": (n, n) for k, n in enumerate(shape)}
        function = self.specialised(self.source(name), options, keep)
        self._widths[function] = {n: shape[1] for n, shape in sizes.items() if len(shape) == 2}
        return function

    def specialised(
        self, kernel: Kernel, options: Env | None = None, keep: tuple[int, ...] | None = None
    ) -> Kernel:
        """Specialize a kernel and all functions that it calls.

        `options`: known values of its parameters, and sizes of its arrays (``x.shape[0]``). `keep`:
        results to keep, by position; by default all.
        """
        options = options or {}
        key = (kernel, tuple(sorted(options.items())), keep)
        if key not in self._made:
            body = Specialiser(self, kernel, dict(options)).block(
                without_docstring(kernel.node.body)
            )
            if keep is not None:
                body = [Keep(keep).visit(s) for s in body]
            body = without_unused(body)
            used = loaded(body)
            name, versions = kernel.name, 1
            while name in self.namespace:
                versions += 1
                name = f"{kernel.name}_{versions}"
            arguments = [ast.arg(a) for a in kernel.parameters if a in used]
            doc = ast.get_docstring(kernel.node)
            node = ast.FunctionDef(
                name=name,
                args=ast.arguments([], arguments, None, [], [], None, []),
                body=[*([ast.Expr(ast.Constant(doc))] if doc else []), *body],
                decorator_list=[],
            )
            function = Kernel("", name, ast.fix_missing_locations(node), self.namespace)
            self._made[key] = self.namespace[name] = function
            self.functions.append(function)
        return self._made[key]

    def constant_name(self, constant: Constant) -> str:
        """Return the name that a constant of a module has in the file."""
        name = constant.name
        held = self.namespace.setdefault(name, constant)
        if (held.module, held.name) != (constant.module, constant.name):
            # Of two modules with one name for two numbers.
            name = f"{constant.module.upper()}_{constant.name}"
            self.namespace[name] = constant
        return name

    def in_c(self, translator: Translator) -> list[str]:
        """Translate all functions by a `device_translator`; return their texts."""
        made = translator.order
        # Callers first: they give the types of what they call.
        for function in reversed(self.functions):
            if not any(m.kernel is function for m in made):
                translator.function(function, self._kinds(function), True)
        place = {id(function): k for k, function in enumerate(self.functions)}
        return [m.text for m in sorted(made, key=lambda m: place[id(m.kernel)])]

    def _kinds(self, function: Kernel) -> list[Type]:
        arrays, widths = self._arrays(function), self._widths.get(function, {})
        return [
            ("A", "f8", 2, "C", widths[p])
            if p in widths
            else ("A", "f8", 1, "C")
            if p in arrays
            else "f8"
            for p in function.parameters
        ]

    def _arrays(self, function: Kernel) -> set[str]:
        """Names with an index here, or that are passed to where they have one."""
        arrays = set()
        for node in walk(function.node.body):
            if isinstance(node, ast.Subscript) and isinstance(node.value, ast.Name):
                arrays.add(node.value.id)
            elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
                other = self.namespace.get(node.func.id)
                if isinstance(other, Kernel):
                    inner = self._arrays(other)
                    pairs = zip(other.parameters, node.args, strict=True)
                    arrays |= {a.id for p, a in pairs if p in inner and isinstance(a, ast.Name)}
        return arrays


class Specialiser:
    """One function, with the known values of its names."""

    def __init__(self, kernels: Kernels, kernel: Kernel, env: Env) -> None:
        self.kernels, self.kernel, self.env = kernels, kernel, env
        self.own = {*kernel.parameters, *stored(kernel.node.body)}
        self.stores = Counter(
            n.id
            for n in walk(kernel.node.body)
            if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)
        )

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
        if isinstance(node, ast.Pass | ast.Break | ast.Continue):
            return [node]
        old = node
        if isinstance(node, ast.Assign):
            if self.makes_arrays(node.value):
                return self.inlined(node)
            known = self.without_known(node)
            if known is None:
                return []
            node = known
            targets = [self.target(t) for t in node.targets]
            new = ast.Assign(targets, self.expression(node.value))
            self.remember(node.targets[0])
        elif isinstance(node, ast.AugAssign):
            target = self.target(node.target)
            if not isinstance(target, ast.Name | ast.Subscript):
                raise refused("statement outside the subset", node)
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
            raise refused("statement outside the subset", node)
        return [like(new, old)]

    def target(self, node: ast.expr) -> ast.expr:
        """Specialize the target of an assignment."""
        for part in ast.walk(node):
            if (
                isinstance(part, ast.Name)
                and isinstance(part.ctx, ast.Store)
                and part.id in self.env
            ):
                raise refused("an option is given another value", node)
        return self.expression(node)

    def remember(self, target: ast.expr) -> None:
        """Store the range of a name that has one."""
        if isinstance(target, ast.Name) and target.id in self.kernels.ranges:
            self.env[target.id] = self.kernels.ranges[target.id]

    def without_known(self, node: ast.Assign) -> ast.Assign | None:
        """Store sizes and options that an assignment gives to names; return what else it does."""
        target, value = node.targets[0], node.value
        if isinstance(value, ast.Attribute) and value.attr == "shape":
            axes = range(len(target.elts)) if isinstance(target, ast.Tuple) else ()
            value = ast.Tuple(
                [ast.parse(f"{ast.unparse(value)}[{k}]", mode="eval").body for k in axes]
            )
        each = isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple)
        pairs = zip(target.elts, value.elts, strict=True) if each else [(target, value)]  # type: ignore[attr-defined]
        left = []
        for name, part in pairs:
            if isinstance(name, ast.Name):
                fixed = self.fixed(part)
                if fixed is not None and self.stores[name.id] == 1:
                    self.env[name.id] = (fixed, fixed)
                    continue
                self.env |= self.sizes(name.id, part)
            left.append((name, part))
        if each and left:
            new = ast.Assign(
                [ast.Tuple([n for n, _ in left], ast.Store())],
                ast.Tuple([v for _, v in left], ast.Load()),
            )
            return ast.copy_location(new, node)
        return node if left else None

    def makes_arrays(self, node: ast.expr) -> bool:
        """Whether an expression calls a kernel that makes arrays and returns them."""
        kernel = self.held(node.func) if isinstance(node, ast.Call) else None
        if not isinstance(kernel, Kernel):
            return False
        last = kernel.node.body[-1]
        parts = (
            last.value.elts
            if isinstance(last, ast.Return) and isinstance(last.value, ast.Tuple)
            else []
        )
        names = {part.id for part in parts if isinstance(part, ast.Name)}
        assigned = (n for n in walk(kernel.node.body) if isinstance(n, ast.Assign))
        return any("np." in ast.unparse(n.value) and names & stored([n]) for n in assigned)

    def inlined(self, node: ast.Assign) -> list[ast.stmt]:
        """Replace the call of a kernel that returns arrays by its statements."""
        target, call = node.targets[0], node.value
        assert isinstance(call, ast.Call) and isinstance(target, ast.Tuple)
        kernel: Kernel = self.held(call.func)
        if kernel.namespace is not self.kernel.namespace:
            raise refused("arrays of another module", node)
        body = copy.deepcopy(without_docstring(kernel.node.body))
        own = stored(body)
        names = {name: f"{name}_" for name in own & self.own}
        returned: Any = body[-1].value  # type: ignore[attr-defined]
        for part, place in zip(returned.elts, target.elts, strict=True):
            if isinstance(part, ast.Name) and part.id in own and isinstance(place, ast.Name):
                names[part.id] = place.id
        values = dict(zip(kernel.parameters, call.args, strict=True))
        body = [Named(names, values).visit(statement) for statement in body]
        self.own |= stored(body)
        self.stores.update(
            n.id for n in walk(body) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)
        )
        *done, last = self.block(body)
        assert isinstance(last, ast.Return) and isinstance(last.value, ast.Tuple)
        for place, part in zip(target.elts, last.value.elts, strict=True):
            if ast.unparse(place) != ast.unparse(part):
                done.append(like(ast.Assign([place], part), node))
        return done

    def each(self, node: ast.For, values: ast.Tuple) -> list[ast.stmt]:
        """Unroll a loop over a tuple."""
        if not isinstance(node.target, ast.Name):
            raise refused("loop over more than one name", node)
        out: list[ast.stmt] = []
        for value in values.elts:
            out += self.block(
                [Named({}, {node.target.id: value}).visit(copy.deepcopy(s)) for s in node.body]
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
        """Substitute known values, and the names that constants of modules have in the file."""
        constant = self.constant(node)
        if constant is not None:
            known = ast.Name(self.kernels.constant_name(constant), ast.Load())
            return ast.copy_location(known, node)
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
        kernel = self.held(node.func)
        if isinstance(kernel, Fma):
            self.kernels.namespace["fma"] = kernel
        if not isinstance(kernel, Kernel):
            return ast.copy_location(
                ast.Call(node.func, [self.expression(a) for a in node.args], node.keywords), node
            )
        arguments = dict(zip(kernel.parameters, node.args, strict=True))
        known = {n: s for n, a in arguments.items() if self.depends(a) and (s := self.span(a))}
        for name, argument in arguments.items():
            known |= self.sizes(name, argument)
        function = self.kernels.specialised(kernel, known)
        values = [self.expression(arguments[n]) for n in function.parameters]
        return ast.copy_location(ast.Call(ast.Name(function.name, ast.Load()), values, []), node)

    def held(self, node: ast.expr) -> Any:
        """Return what a name of the module holds, which is none of the function."""
        if not isinstance(node, ast.Name) or node.id in self.own:
            return None
        return self.kernel.namespace.get(node.id)

    def constant(self, node: ast.expr) -> Constant | None:
        """Return the constant of a module that a name means."""
        if isinstance(node, ast.Name) and node.id not in self.own and node.id not in self.env:
            known: Constant | None = self.kernel.namespace[CONSTANTS].get(node.id)
            return known
        return None

    def sizes(self, name: str, node: ast.expr) -> Env:
        """Return the sizes of an array, as those of a name that it gets."""
        if isinstance(node, ast.Call) and ast.unparse(node.func) in ("np.empty", "np.zeros"):
            shape = node.args[0]
            spans = [
                self.span(n) for n in (shape.elts if isinstance(shape, ast.Tuple) else [shape])
            ]
            return {f"{name}.shape[{k}]": span for k, span in enumerate(spans) if span}
        rows = isinstance(node, ast.Subscript) and not isinstance(node.slice, ast.Slice | ast.Tuple)
        base = node.value if rows else node  # type: ignore[attr-defined]
        found = {}
        for axis in range(rows, 2):
            known = self.env.get(f"{ast.unparse(base)}.shape[{axis}]")
            if known:
                found[f"{name}.shape[{axis - rows}]"] = known
        return found

    # --- known values ---------------------------------------------------------------------

    def depends(self, node: ast.expr) -> bool:
        """Whether an option takes part; formulas of constants alone stay as written."""
        return any(isinstance(p, ast.Name) and p.id in self.env for p in ast.walk(node))

    def fixed(self, node: ast.expr) -> float | None:
        """Value of a number of the state, or of a call, that is known; of others None."""
        read = isinstance(node, ast.Call) or (
            isinstance(node, ast.Subscript) and isinstance(node.ctx, ast.Load)
        )
        if not read:
            return None
        text = ast.unparse(node)
        return self.env[text][0] if text in self.env else self.kernels.fixed.get(text)

    def span(self, node: ast.expr) -> Span | None:
        """Value or range of an expression, if options or constants determine it."""
        if isinstance(node, ast.Constant) and isinstance(node.value, int | float):
            return node.value, node.value
        fixed = self.fixed(node)
        if fixed is not None:
            return fixed, fixed
        if isinstance(node, ast.Name) and node.id in self.env:
            return self.env[node.id]
        constant = self.constant(node)
        if constant is not None and isinstance(constant.value, int | float):
            return constant.value, constant.value
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and len(node.args) == 1:
            kind = {"int": int, "float": float}.get(node.func.id)
            inside = self.span(node.args[0])
            return (kind(inside[0]), kind(inside[1])) if kind and inside else None
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
            inside = self.span(node.operand)
            return (-inside[1], -inside[0]) if inside else None
        if isinstance(node, ast.BinOp):
            a, b = self.span(node.left), self.span(node.right)
            operation = ARITHMETIC.get(type(node.op))
            if a and b and operation and (type(node.op) is not ast.Mod or a[0] == a[1]):
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


ARITHMETIC: dict[type[ast.operator], Callable[[Number, Number], Number]] = {
    ast.Add: lambda a, b: a + b,
    ast.Sub: lambda a, b: a - b,
    ast.Mult: lambda a, b: a * b,
    ast.Mod: lambda a, b: a % b,
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


def refused(what: str, node: ast.AST) -> UntranslatableError:
    """The error of a kernel that is outside the subset of Python that can be translated."""
    line = getattr(node, "lineno", "?")
    return UntranslatableError(f"line {line}: {what}: {ast.unparse(node)}")


class Named(ast.NodeTransformer):
    """Give variables other names, and put values for parameters."""

    def __init__(self, names: dict[str, str], values: dict[str, ast.expr]) -> None:
        self.names, self.values = names, values

    def visit_Name(self, node: ast.Name) -> ast.expr:
        """Replace the name."""
        if node.id in self.values:
            return copy.deepcopy(self.values[node.id])
        return ast.copy_location(ast.Name(self.names.get(node.id, node.id), node.ctx), node)


class Keep(ast.NodeTransformer):
    """Return only some of the results."""

    def __init__(self, keep: tuple[int, ...]) -> None:
        self.keep = keep

    def visit_Return(self, node: ast.Return) -> ast.Return:
        """Choose from a tuple."""
        if not isinstance(node.value, ast.Tuple):
            raise refused("results that cannot be chosen from", node)
        values = [node.value.elts[i] for i in self.keep]
        node.value = values[0] if len(values) == 1 else ast.Tuple(values, ast.Load())
        return node


def like(new: ast.stmt, old: ast.stmt) -> ast.stmt:
    """Give a new statement the position and the comment of the old one."""
    ast.copy_location(new, old)
    new.comment = getattr(old, "comment", "")  # type: ignore[attr-defined]
    return new


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
        elif isinstance(node, ast.Assign) and len(node.targets) == 1:
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
