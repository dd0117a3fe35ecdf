"""What each name of the specialised kernels is in C, and the heads of the functions."""

from __future__ import annotations

import ast
from collections.abc import Iterator

from strapdown.export_c.kernels import Function, Kernels
from strapdown.export_c.layout import TIE
from strapdown.export_c.syntax import name_of, plain_name, walk

# Results up to this number go where pointers say; more of them into one array.
POINTERS = 4


class Kinds:
    """The kinds of all names in the functions that were asked of the kernels.

    Attributes
    ----------
    state_size : int
        Numbers of the state that the functions written so far touch.
    """

    def __init__(self, kernels: Kernels) -> None:
        self.kernels = kernels
        self.state_size = 0
        self._types: dict[str, dict[str, str]] = {}
        self._returns: dict[str, str] = {}
        self._changed: dict[str, set[str]] = {}
        for function in kernels.functions:  # callees stand before their callers
            self._changed[function.name] = set(self._written(function))
            self._type_arrays(function)
        for function in reversed(kernels.functions):
            self._type_arguments(function)

    def types(self, function: Function) -> dict[str, str]:
        """Return the kind of each name: 'real_t', 'int', or 'array'."""
        return self._types.setdefault(function.name, {})

    def changes(self, name: str, parameter: str) -> bool:
        """Whether a function writes into an array that it is given."""
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
        """Find what is an array: it has an index here, or where it is handed on to."""
        types = self.types(function)
        for node in walk(function.body):
            if isinstance(node, ast.Subscript) and isinstance(node.value, ast.Name):
                types[node.value.id] = "array"
            elif isinstance(node, ast.Call) and (other := self.callee(node)):
                for parameter, argument in zip(other.parameters, node.args, strict=True):
                    if self.types(other).get(parameter) == "array":
                        types[name_of(argument)] = "array"

    def _type_arguments(self, function: Function) -> None:
        """Find the kinds of the locals, then of the parameters of what is called."""
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
        """Return the kind of an expression."""
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
        """Return what a C function returns: one number, or nothing."""
        return self._returns.get(function.name, "real_t") if function.results == 1 else "void"

    def prototype(self, function: Function) -> str:
        """Return the head of a function, on one line."""
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
