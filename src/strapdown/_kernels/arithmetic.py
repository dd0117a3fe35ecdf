"""The kernels' formulas in another arithmetic: single precision, or counted.

The kernels are written once, in double precision. An embedded processor runs them in single
precision, and a designer needs the number of operations. Both are made from the sources of the
kernels: for single precision each constant and each conversion becomes ``np.float32``, so that
numba compiles every operation on floats; for counting they run as plain Python on counting numbers.
"""

from __future__ import annotations

import ast
import functools
import hashlib
import importlib
import math
import os
import sys
import tempfile
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any, Self

SOURCES = ("rotation", "increments", "attitude", "rotation_vector", "orientation")
#: Further ones of the package that are delivered in single precision.
FURTHER = ("crash_trigger",)
PACKAGE = "strapdown._kernels"
FORMULAS = tuple(f"{PACKAGE}.{name}" for name in SOURCES)
SINGLE = "_strapdown_single"
LARGEST_SINGLE = 3e38


class _InSingle(ast.NodeTransformer):
    """Make every constant and every conversion a float32."""

    def visit_Constant(self, node: ast.Constant) -> ast.expr:
        small = isinstance(node.value, float) and abs(node.value) < LARGEST_SINGLE
        return _single(node) if small else node

    def visit_Attribute(self, node: ast.Attribute) -> ast.expr:
        return _single(node) if node.attr == "pi" else node

    def visit_Name(self, node: ast.Name) -> ast.expr:
        return _float32() if node.id == "float" else node

    def visit_Assign(self, node: ast.Assign) -> ast.AST:
        if node.col_offset > 0 or isinstance(node.value, ast.Tuple):
            return self.generic_visit(node)
        # A constant of the module is worked out in double precision, and rounded once.
        if _is_inexact(node.value):
            node.value = _single(node.value)
            return node
        return self.generic_visit(node)

    def visit_ImportFrom(self, node: ast.ImportFrom) -> ast.AST:
        if node.module in FORMULAS:
            node.module = SINGLE + node.module.removeprefix(PACKAGE)
        return node


def _is_inexact(node: ast.expr) -> bool:
    return any(
        isinstance(part, ast.Constant)
        and isinstance(part.value, float)
        and abs(part.value) < LARGEST_SINGLE
        for part in ast.walk(node)
    )


def _float32() -> ast.expr:
    return ast.Attribute(ast.Name("_np", ast.Load()), "float32", ast.Load())


def _single(value: ast.expr) -> ast.expr:
    return ast.Call(_float32(), [value], [])


def single_source(module: str) -> str:
    """Source of a kernel module in single precision."""
    tree = _InSingle().visit(kernels_of(module))
    tree.body.insert(2, ast.parse("import numpy as _np").body[0])
    return ast.unparse(ast.fix_missing_locations(tree)) + "\n"


@functools.cache
def single_precision(module: str) -> ModuleType:
    """Return a kernel module compiled in single precision.

    Of the package's own modules, what is called from Python is delivered compiled. Otherwise numba
    compiles; the sources are written beside its compiled kernels, because it keeps compiled code
    for what has a file alone; where nothing can be written they are compiled anew.

    Parameters
    ----------
    module : str
        One of `SOURCES`, or the full name of a plug-in's module, which is loaded already.

    Returns
    -------
    module
    """
    from strapdown._kernels.compilation import delivered

    kernels = delivered(f"single_{module.removeprefix(PACKAGE + '.')}")
    if kernels:
        made = ModuleType(f"{SINGLE}.{module}")
        vars(made).update(kernels)
        return made
    if SINGLE not in sys.modules:
        package = ModuleType(SINGLE)
        package.__path__ = [str(_written({n: single_source(n) for n in SOURCES}))]
        sys.modules[SINGLE] = package
    name = module.replace(".", "_")
    if module not in SOURCES:
        sys.modules[SINGLE].__path__.append(str(_written({name: single_source(module)})))
    return importlib.import_module(f"{SINGLE}.{name}")


def kernel_home(kernel: Callable[..., Any]) -> str:
    """Module of a kernel: one of `SOURCES`, or a plug-in's."""
    return kernel.__module__.removeprefix(f"{PACKAGE}.")


def single_kernel(kernel: Callable[..., Any]) -> Callable[..., Any]:
    """Return a kernel compiled in single precision."""
    single: Callable[..., Any] = getattr(single_precision(kernel_home(kernel)), kernel.__name__)
    return single


def _written(sources: dict[str, str]) -> Path:
    from strapdown._kernels import cache_folder

    digest = hashlib.sha256("".join(sources.values()).encode()).hexdigest()[:16]
    base = os.environ.get("NUMBA_CACHE_DIR") or cache_folder()
    folder = Path(base) / f"single-{digest}"
    try:
        if not base:
            raise OSError("no home")
        folder.mkdir(parents=True, exist_ok=True)
        for name, text in sources.items():
            if not (folder / f"{name}.py").exists():
                _write(folder / f"{name}.py", text)
    except OSError:
        folder = Path(tempfile.mkdtemp(prefix="strapdown-"))
        for name, text in sources.items():
            _write(folder / f"{name}.py", text)
    return folder


def _write(path: Path, text: str) -> None:
    # Whole or not at all: another process may be writing the same.
    with tempfile.NamedTemporaryFile(
        "w", dir=path.parent, delete=False, encoding="utf-8", newline="\n"
    ) as file:
        file.write(text)
    Path(file.name).replace(path)


def kernel_module(module: str) -> ModuleType:
    """Import a kernel module in double precision, named as in `single_precision`."""
    return importlib.import_module(f"{PACKAGE}.{module}" if module in SOURCES else module)


def kernels_of(module: str) -> ast.Module:
    """Syntax tree of a kernel module; of a plug-in's without its classes and what it imports.

    Parameters
    ----------
    module : str
        As in `single_precision`.
    """
    path = Path(__file__).with_name(f"{module.removeprefix(f'{PACKAGE}.')}.py")
    if path.exists():
        return ast.parse(path.read_text(encoding="utf-8"))
    tree = ast.parse(Path(str(sys.modules[module].__file__)).read_text(encoding="utf-8"))
    kept = [node for node in tree.body if _of_kernels(node)]
    docstring = ast.Expr(ast.Constant("Kernels of a plug-in."))
    future = ast.parse("from __future__ import annotations").body
    return ast.fix_missing_locations(ast.Module([docstring, *future, *kept], []))


def _of_kernels(node: ast.stmt) -> bool:
    if isinstance(node, ast.ImportFrom):
        return bool(node.module) and str(node.module).startswith((PACKAGE, "numba"))
    if isinstance(node, ast.Import):
        return all(item.name in ("math", "numpy", "numba") for item in node.names)
    return isinstance(node, ast.FunctionDef | ast.Assign)


class Counted(float):
    """A number that notes every operation on it; it compares and converts as its value."""

    __slots__ = ("count",)
    count: Counter[str]

    def __new__(cls, value: float, count: Counter[str]) -> Self:
        number = super().__new__(cls, value)
        number.count = count
        return number


def counting(kind: str, operation: Callable[..., float]) -> Callable[..., float]:
    """Return an operation that is noted as one of `kind`, if its first number is `Counted`.

    Without a kind it costs nothing: a change of sign is part of what follows.
    """

    def counted(first: float, *others: float) -> float:
        value = operation(first, *others)
        if not isinstance(first, Counted):
            return value
        if kind:
            first.count[kind] += 1
        return Counted(value, first.count)

    return counted


for _kind, _names in {
    "add": "add radd sub rsub",
    "multiply": "mul rmul",
    "divide": "truediv rtruediv",
    "": "neg abs",
}.items():
    for _name in _names.split():
        setattr(Counted, f"__{_name}__", counting(_kind, getattr(float, f"__{_name}__")))

#: The functions of `math` that kernels call.
COUNTED_MATH = {
    "sqrt": counting("sqrt", math.sqrt),
    **{name: counting("trig", getattr(math, name)) for name in ("sin", "cos", "atan2")},
    "fmod": counting("divide", math.fmod),
    "copysign": math.copysign,
    "pi": math.pi,
}


@functools.cache
def counted_kernels(module: str) -> SimpleNamespace:
    """Return a kernel module as plain Python, for numbers of `Counted`.

    Parameters
    ----------
    module : str
        As in `single_precision`.
    """
    tree = kernels_of(module)
    namespace: dict[str, object] = {}
    for node in list(tree.body):
        if isinstance(node, ast.ImportFrom):
            tree.body.remove(node)
            if node.module in FORMULAS:
                other = vars(counted_kernels(node.module.rpartition(".")[2]))
                namespace |= {item.name: other[item.name] for item in node.names}
        elif isinstance(node, ast.FunctionDef):
            node.decorator_list = []
    exec(compile(tree, f"{module} (counted)", "exec"), namespace)
    # Only now, so that the constants of the module are numbers.
    namespace["math"] = namespace["np"] = SimpleNamespace(**COUNTED_MATH)
    return SimpleNamespace(**namespace)
