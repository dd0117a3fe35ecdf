"""Read the kernels' sources: functions with their decorators, and the values of their modules.

No kernel is compiled and numba is not imported: the modules are executed with a decorator that
collects.
"""

from __future__ import annotations

import ast
import hashlib
import sys
from dataclasses import dataclass, field
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import SimpleNamespace
from typing import Any

PACKAGE = "strapdown._kernels"
#: Not kernels: how they are compiled, their formulas in another arithmetic, and the package.
OTHERS = ("__init__", "arithmetic", "compilation")


#: Begins the names of modules in single precision.
SINGLE = "single_"


@dataclass(frozen=True, eq=False)
class Kernel:
    """A kernel's source."""

    module: str
    name: str
    node: ast.FunctionDef
    namespace: dict[str, Any] = field(repr=False)
    #: True where division by zero gives infinity or NaN, False where it is an error.
    ieee_division: bool
    #: numba's "always": it has the caller's division.
    inline: bool
    nogil: bool

    @property
    def c_name(self) -> str:
        return f"{self.module}_{self.name}"


class Fma:
    """Stands for `compilation.fma`."""


def _kernel(function: Any, tree: ast.FunctionDef, module: str, space: Any, options: Any) -> Kernel:
    return Kernel(
        module,
        tree.name,
        tree,
        space,
        options.get("error_model") == "numpy",
        options.get("inline") == "always" or options.get("forceinline", False),
        options.get("nogil", False),
    )


def load(folder: Path) -> dict[str, dict[str, Any]]:
    """Execute every module of kernels; return the values of each, with functions as `Kernel`."""
    modules: dict[str, dict[str, Any]] = {}
    in_place = {"cache": True, "error_model": "numpy"}

    def njit(**options: Any) -> Any:
        return lambda function: SimpleNamespace(function=function, options=options)

    arithmetic = _arithmetic(folder)
    single_home = arithmetic.SINGLE if arithmetic else "_"

    def read(stem: str) -> dict[str, Any]:
        if stem in modules:
            return modules[stem]
        space: dict[str, Any] = {"__name__": f"{PACKAGE}.{stem}"}
        modules[stem] = space
        if stem.startswith(SINGLE):
            name = stem.removeprefix(SINGLE)
            if name in arithmetic.FURTHER and f"{PACKAGE}.{name}" not in sys.modules:
                # It reads the file of a loaded module.
                stands_for: Any = SimpleNamespace(__file__=str(folder / f"{name}.py"))
                sys.modules[f"{PACKAGE}.{name}"] = stands_for
            text = arithmetic.single_source(
                name if name in arithmetic.SOURCES else f"{PACKAGE}.{name}"
            )
            if isinstance(sys.modules.get(f"{PACKAGE}.{name}"), SimpleNamespace):
                del sys.modules[f"{PACKAGE}.{name}"]
        else:
            text = (folder / f"{stem}.py").read_text(encoding="utf-8")
        tree = ast.parse(text)
        for statement in tree.body:
            if stem == "compilation":
                used = ("dot", "sources_digest")
                if not (isinstance(statement, ast.FunctionDef) and statement.name in used):
                    continue
                space.update(njit=njit, IN_PLACE=in_place, fma=Fma(), hashlib=hashlib, Path=Path)
                space.update(__file__=str(folder / "compilation.py"))
            home = str(statement.module) if isinstance(statement, ast.ImportFrom) else ""
            if isinstance(statement, ast.ImportFrom) and home.startswith((PACKAGE, single_home)):
                single = SINGLE if home.startswith(single_home) else ""
                other = read(single + home.rpartition(".")[2])
                for item in statement.names:
                    space[item.asname or item.name] = other[item.name]
                continue
            code = compile(ast.Module([statement], []), f"{stem}.py", "exec")
            exec(code, space)
            if isinstance(statement, ast.FunctionDef):
                made = space[statement.name]
                if isinstance(made, SimpleNamespace):
                    space[statement.name] = _kernel(
                        made.function, statement, stem, space, made.options
                    )
        return space

    for path in sorted(folder.glob("*.py")):
        if path.stem not in OTHERS:
            read(path.stem)
    if arithmetic:
        for name in (*arithmetic.SOURCES, *arithmetic.FURTHER):
            read(SINGLE + name)
    return modules


def _arithmetic(folder: Path) -> Any:
    """Load the module that rewrites kernels in single precision, without the package."""
    if not (folder / "arithmetic.py").exists():
        return None
    spec = spec_from_file_location("kernels_arithmetic", folder / "arithmetic.py")
    assert spec and spec.loader
    module: Any = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
