"""The papers use strapdown as anybody would: by what its packages export."""

from __future__ import annotations

import ast
from importlib import import_module
from pathlib import Path

import pytest

PAPERS = Path(__file__).parents[1]
FILES = sorted(PAPERS.rglob("*.py"))


def beyond_the_public_api(source: str) -> list[str]:
    """Imports of strapdown that reach below a package, or for a name that it does not export."""
    found = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            found += [a.name for a in node.names if a.name.startswith("strapdown.")]
        if not isinstance(node, ast.ImportFrom) or not node.module:
            continue
        home, *below = node.module.split(".")
        if home != "strapdown":
            continue
        names = [a.name for a in node.names]
        if len(below) > 1 or any(part.startswith("_") for part in below):
            found.append(node.module)
            continue
        module = import_module(node.module)
        # Of the modules beside the packages, each is one file and public as a whole.
        single = not hasattr(module, "__path__")
        found += [
            f"{node.module}.{name}"
            for name in names
            if (name.startswith("_") if single else not _exported(module, name))
            and name != "__version__"
        ]
    return found


def _exported(module, name: str) -> bool:
    if name in module.__all__:
        return True
    if module.__name__ != "strapdown":
        return False
    return not hasattr(import_module(f"strapdown.{name}"), "__path__") or name == "rotation"


@pytest.mark.parametrize("path", FILES, ids=lambda p: str(p.relative_to(PAPERS)))
def test_papers_import_only_what_is_exported(path):
    assert beyond_the_public_api(path.read_text(encoding="utf-8")) == []


@pytest.mark.parametrize(
    "line",
    [
        "from strapdown.crash.entry import Entry",
        "from strapdown.crash import entry",
        "from strapdown._kernels import level",
        "from strapdown.constants import _PRIVATE",
        "from strapdown import crash",
        "import strapdown.crash.entry",
    ],
)
def test_an_import_from_inside_is_found(line):
    assert beyond_the_public_api(line)
