"""The kernels that one algorithm needs, with its options put in as constants.

The kernels take their options as numbers. Here a kernel is read as a syntax tree and followed from
its first function: conditions that the options decide are decided, what they exclude is
dropped, and so are parameters and variables that are then of no use. What remains are the same
formulas in the same order. Nothing here knows C.
"""

from __future__ import annotations

import ast
import copy
from typing import TYPE_CHECKING

from strapdown.export_c.ranges import ARITHMETIC, COMPARISONS, Env, Span, equality, without
from strapdown.export_c.syntax import Put, UntranslatableError, like

if TYPE_CHECKING:
    from strapdown.export_c.kernels import Kernels


class Specialiser:
    """One function, with what is known of its names."""

    def __init__(self, kernels: Kernels, env: Env) -> None:
        self.kernels, self.env = kernels, env

    # --- statements -----------------------------------------------------------------------

    def block(self, body: list[ast.stmt]) -> list[ast.stmt]:
        """Specialise statements, up to the first that returns."""
        done: list[ast.stmt] = []
        for node in body:
            done += self.statement(node)
            if done and isinstance(done[-1], ast.Return):
                break
        return done

    def statement(self, node: ast.stmt) -> list[ast.stmt]:
        """Specialise one statement: into none, one or several."""
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
        elif isinstance(node, ast.Return) and node.value is not None:
            new = ast.Return(self.expression(node.value))
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
        """Specialise what a value is given to."""
        for part in ast.walk(node):
            if (
                isinstance(part, ast.Name)
                and isinstance(part.ctx, ast.Store)
                and part.id in self.env
            ):
                raise UntranslatableError("an option is given another value", node)
        return self.expression(node)

    def remember(self, target: ast.expr) -> None:
        """Note the range of a name that has one."""
        if isinstance(target, ast.Name) and target.id in self.kernels.ranges:
            self.env[target.id] = self.kernels.ranges[target.id]

    def each(self, node: ast.For, values: ast.Tuple) -> list[ast.stmt]:
        """Write a loop over a tuple out."""
        if not isinstance(node.target, ast.Name):
            raise UntranslatableError("loop over more than one name", node)
        out: list[ast.stmt] = []
        for value in values.elts:
            out += self.block(
                [Put(node.target.id, value).visit(copy.deepcopy(s)) for s in node.body]
            )
        return out

    def branch(self, node: ast.If) -> list[ast.stmt]:
        """Decide a condition, or follow both ways with what each of them knows."""
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
        # What follows is reached only by the other way.
        self.env = otherwise if body and isinstance(body[-1], ast.Return) else before
        return [like(ast.If(test, body, orelse), node)]

    # --- expressions ----------------------------------------------------------------------

    def expression(self, node: ast.expr) -> ast.expr:
        """Put in what is known."""
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
        """Leave out the terms that are known and do not matter."""
        rest = [self.expression(v) for v in node.values if self.truth(v) is None]
        return rest[0] if len(rest) == 1 else ast.copy_location(ast.BoolOp(node.op, rest), node)

    def call(self, node: ast.Call) -> ast.expr:
        """Call the function that is specialised for what is known of the arguments."""
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

    # --- what is known --------------------------------------------------------------------

    def depends(self, node: ast.expr) -> bool:
        """Whether an option has a part in it; formulas of constants alone stay as written."""
        return any(isinstance(p, ast.Name) and p.id in self.env for p in ast.walk(node))

    def span(self, node: ast.expr) -> Span | None:
        """Value or range of an expression, where the options or the constants tell."""
        if isinstance(node, ast.Constant) and isinstance(node.value, int | float):
            return node.value, node.value
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
        """Whether a condition holds, where the options tell."""
        if isinstance(node, ast.BoolOp):
            known = [self.truth(v) for v in node.values]
            decides = isinstance(node.op, ast.Or)
            if decides in known:
                return decides
            return None if None in known else not decides
        if isinstance(node, ast.Compare) and len(node.ops) == 1 and self.depends(node):
            a, b = self.span(node.left), self.span(node.comparators[0])
            if a and b:
                return COMPARISONS[type(node.ops[0])](a, b)
        span = self.env.get(node.id) if isinstance(node, ast.Name) else None
        return bool(span[0]) if span and span[0] == span[1] else None
