"""Read the kernels' sources: functions with their decorators, and the values of their modules.

No kernel is compiled and numba is not imported: the modules are executed with a decorator that
collects.
"""

from __future__ import annotations

import ast
import hashlib
import sys
from collections.abc import Iterable
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
    """A kernel's source; of one that is made from it for a device, `module` is empty."""

    module: str
    name: str
    node: ast.FunctionDef
    namespace: dict[str, Any] = field(repr=False)
    #: True where division by zero gives infinity or NaN, False where it is an error.
    ieee_division: bool = True
    #: numba's "always": it has the caller's division.
    inline: bool = False
    nogil: bool = False

    @property
    def c_name(self) -> str:
        """Name of its function in C."""
        return f"{self.module}_{self.name}" if self.module else self.name

    @property
    def parameters(self) -> list[str]:
        """Names of its parameters."""
        return [a.arg for a in self.node.args.args]


@dataclass(frozen=True)
class Constant:
    """A number of a kernel module, with the comment above it."""

    module: str
    name: str
    value: Any
    comment: str


#: In the namespace of a module: where its numbers were defined, by their names in it.
CONSTANTS = "constants of the module"


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


def load(folder: Path, wanted: Iterable[str] | None = None) -> dict[str, dict[str, Any]]:
    """Execute modules of kernels; return the values of each, with functions as `Kernel`.

    `wanted`: names of modules, of which also those are read from which they import; that of a
    plug-in, which is loaded already, in full. By default all, and those in single precision.
    """
    modules: dict[str, dict[str, Any]] = {}
    in_place = {"cache": True, "error_model": "numpy"}

    def njit(**options: Any) -> Any:
        return lambda function: SimpleNamespace(function=function, options=options)

    arithmetic = _arithmetic(folder)
    single_home = arithmetic.SINGLE if arithmetic else "_"

    def source(stem: str) -> tuple[ast.Module, list[str]]:
        if stem.startswith(SINGLE):
            name = stem.removeprefix(SINGLE)
            home = name if name in arithmetic.SOURCES else f"{PACKAGE}.{name}"
            return ast.parse(arithmetic.single_source(home)), []
        path = folder / f"{stem}.py"
        if path.exists():
            text = path.read_text(encoding="utf-8")
            return ast.parse(text), text.splitlines()
        text = Path(str(sys.modules[stem].__file__)).read_text(encoding="utf-8")
        tree = arithmetic.kernels_of(stem)
        # Its decorator, which is numba's or ours, is replaced below.
        tree.body = [
            n for n in tree.body if not ast.unparse(n).startswith(("from numba", "import numba"))
        ]
        for node in tree.body:
            if isinstance(node, ast.FunctionDef):
                node.decorator_list = [ast.parse("njit()", mode="eval").body]
        return ast.fix_missing_locations(tree), text.splitlines()

    def read(stem: str) -> dict[str, Any]:
        if stem in modules:
            return modules[stem]
        known: dict[str, Constant] = {}
        space: dict[str, Any] = {"__name__": f"{PACKAGE}.{stem}", CONSTANTS: known, "njit": njit}
        modules[stem] = space
        tree, lines = source(stem)
        attach_comments(tree, lines)
        for statement in tree.body:
            if stem == "compilation":
                used = ("dot", "sources_digest")
                if not (isinstance(statement, ast.FunctionDef) and statement.name in used):
                    continue
                space.update(IN_PLACE=in_place, fma=Fma(), hashlib=hashlib, Path=Path)
                space.update(__file__=str(folder / "compilation.py"))
            home = str(statement.module) if isinstance(statement, ast.ImportFrom) else ""
            if isinstance(statement, ast.ImportFrom) and home.startswith((PACKAGE, single_home)):
                single = SINGLE if home.startswith(single_home) else ""
                other = read(single + home.rpartition(".")[2])
                for item in statement.names:
                    name = item.asname or item.name
                    space[name] = other[item.name]
                    if item.name in other[CONSTANTS]:
                        known[name] = other[CONSTANTS][item.name]
                continue
            code = compile(ast.Module([statement], []), f"{stem}.py", "exec")
            exec(code, space)
            if isinstance(statement, ast.FunctionDef):
                made = space[statement.name]
                if isinstance(made, SimpleNamespace):
                    space[statement.name] = _kernel(
                        made.function, statement, stem, space, made.options
                    )
            elif isinstance(statement, ast.Assign):
                for node in ast.walk(statement.targets[0]):
                    if isinstance(node, ast.Name):
                        known[node.id] = Constant(
                            stem, node.id, space[node.id], getattr(statement, "comment", "")
                        )
        return space

    if wanted is not None:
        for stem in wanted:
            read(stem)
        return modules
    for path in sorted(folder.glob("*.py")):
        if path.stem not in OTHERS:
            read(path.stem)
    if arithmetic:
        for name in (*arithmetic.SOURCES, *arithmetic.FURTHER):
            read(SINGLE + name)
    return modules


def attach_comments(tree: ast.Module, lines: list[str]) -> None:
    """Attach to each statement the comment lines directly above it."""
    for node in ast.walk(tree) if lines else ():
        if isinstance(node, ast.stmt) and not isinstance(node, ast.FunctionDef):
            at = node.lineno - 2
            found: list[str] = []
            while 0 <= at < len(lines) and lines[at].lstrip().startswith("# "):
                if "# ---" in lines[at]:
                    break
                found.insert(0, lines[at].strip()[2:])
                at -= 1
            node.comment = " ".join(found)  # type: ignore[attr-defined]


def _arithmetic(folder: Path) -> Any:
    """Load the module that rewrites kernels in single precision, without the package."""
    if not (folder / "arithmetic.py").exists():
        return None
    spec = spec_from_file_location("kernels_arithmetic", folder / "arithmetic.py")
    assert spec and spec.loader
    module: Any = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
