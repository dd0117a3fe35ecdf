"""The sources of the kernels, and the functions that were asked of them."""

from __future__ import annotations

import ast
import importlib
import inspect
from dataclasses import dataclass, field

from strapdown._kernels.arithmetic import PACKAGE, SOURCES
from strapdown.export_c.ranges import Env, Number, Span
from strapdown.export_c.specialise import Specialiser
from strapdown.export_c.syntax import (
    Keep,
    attach_comments,
    loaded,
    walk,
    without_docstring,
    without_unused,
)


@dataclass
class Function:
    """One function of a kernel, specialised.

    Attributes
    ----------
    name : str
        That of the kernel; a second version of it has a number behind it.
    doc : str
        First paragraphs of its docstring.
    parameters : list of str
        Those that are still used.
    body : list of stmt
        Its statements; ``comment`` of each are the comment lines above it.
    results : int
        Numbers that it returns.
    """

    name: str
    doc: str
    parameters: list[str]
    body: list[ast.stmt]
    results: int


@dataclass(frozen=True)
class Constant:
    """A constant of a kernel module with the comment that stands above it."""

    name: str
    value: Number
    comment: str


@dataclass
class Kernels:
    """The sources of all kernels, and what was asked of them so far.

    Attributes
    ----------
    ranges : dict
        For a variable that holds a whole number at run time: the least and the greatest.
    functions : list of Function
        In the order in which they must be defined.
    """

    ranges: dict[str, tuple[int, int]] = field(default_factory=dict)
    functions: list[Function] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._sources: dict[str, ast.FunctionDef] = {}
        self._constants: dict[str, Constant] = {}
        self._made: dict[tuple[object, ...], Function] = {}
        for name in SOURCES:
            module = importlib.import_module(f"{PACKAGE}.{name}")
            text = inspect.getsource(module)
            tree = ast.parse(text)
            attach_comments(tree, text.splitlines())
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
        """Specialise a function and all that it calls.

        Parameters
        ----------
        name : str
            A function of a kernel module.
        options : dict
            What is known of its parameters.
        keep : tuple of int
            The results that are wanted, by position; all where not given.
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
        """Return the specialised function of that name."""
        return next((f for f in self.functions if f.name == name), None)

    def is_kernel(self, name: str) -> bool:
        """Whether there is a kernel of that name."""
        return name in self._sources

    def parameters(self, name: str) -> list[str]:
        """Return the parameters that a kernel has in the source."""
        return [a.arg for a in self._sources[name].args.args]

    def span(self, name: str) -> Span | None:
        """Return the value of a module's constant."""
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
