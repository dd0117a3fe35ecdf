"""The names in docs/design.md exist in the source, and its floors are those of the linter."""

from __future__ import annotations

import ast
import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs/design.md").read_text()
#: Folders and files beside the source, and symbols.
ELSEWHERE = {
    "analytic",
    "property",
    "contracts",
    "reference",
    "unit",
    "arch",
    "src",
    "constraints",
    "pyproject",
}
ELSEWHERE |= {"omega_ib_b", "b_g", "b_a"}


def names_of_the_source(nodes) -> set[str]:
    names = set(ELSEWHERE)
    for path, inside in nodes.items():
        names |= {path.stem, path.parent.name}
        for node in inside:
            match node:
                case ast.FunctionDef(name=name) | ast.ClassDef(name=name):
                    names.add(name)
                case ast.Name(id=name) | ast.arg(arg=name) | ast.Attribute(attr=name):
                    names.add(name)
    return names


def test_every_name_on_the_page_is_in_the_source(nodes) -> None:
    named = set(re.findall(r"`([A-Za-z_]\w*)(?:\.\w+)?`", PAGE))
    assert len(named) > 60
    assert sorted(named - names_of_the_source(nodes)) == []


def test_the_floors_are_those_of_the_linter() -> None:
    rows = re.findall(r"^\| (`\w+`(?:, `\w+`)*) \|", PAGE, re.MULTILINE)
    shown = [name for row in rows for name in re.findall(r"\w+", row)]
    contract = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]
    layers = [n for row in contract["contracts"][0]["layers"] for n in row.split(" : ")]
    assert set(layers) - set(shown) == {"progress", "nav_state", "lazy_names"}
    lowest = shown.index("_kernels")
    assert [n for n in shown[:lowest] if n in layers[: layers.index("tables")]] == [
        n for n in layers[: layers.index("tables")] if n in shown
    ]
