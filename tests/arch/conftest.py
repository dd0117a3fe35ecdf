"""The source as syntax trees, walked once for every test that reads it."""

from __future__ import annotations

import ast
import gc
from pathlib import Path

import pytest

SOURCE = Path(__file__).parents[2] / "src" / "strapdown"


@pytest.fixture(scope="session")
def nodes() -> dict[Path, tuple[ast.AST, ...]]:
    """Every node of every module by its path."""
    # Each of a million nodes lives as long as the run: no collection need look at them.
    gc.disable()
    found = {
        path: tuple(ast.walk(ast.parse(path.read_text(encoding="utf-8"))))
        for path in SOURCE.rglob("*.py")
    }
    gc.freeze()
    gc.enable()
    return found
