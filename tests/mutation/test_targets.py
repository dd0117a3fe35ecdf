"""The lists of mutation testing name sources, tests, texts and mutants that exist."""

from __future__ import annotations

import ast
import importlib.util
import sys
import tomllib
from pathlib import Path

import pytest

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
TARGETS = tomllib.loads((HERE / "targets.toml").read_text(encoding="utf-8"))["target"]
SURVIVORS = tomllib.loads((HERE / "survivors.toml").read_text(encoding="utf-8"))["survivor"]


@pytest.fixture(scope="module")
def program():
    spec = importlib.util.spec_from_file_location("mutants_of_a_source", HERE / "mutants.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    yield module
    del sys.modules[spec.name]


def test_each_source_is_named_once():
    sources = [target["source"] for target in TARGETS]
    assert sorted(sources) == sorted(set(sources))


@pytest.mark.parametrize("target", TARGETS, ids=lambda target: target["source"])
def test_a_target_names_what_exists(target, program):
    source = (ROOT / target["source"]).read_text(encoding="utf-8")
    assert target["tests"]
    assert all((ROOT / name).is_file() for name in target["tests"])
    for before, after in target.get("known", []):
        assert program.stated(source, before, after).text != source
    for name in target.get("deselect", []):
        file, function = name.split("::")
        assert file in target["tests"]
        tree = ast.parse((ROOT / file).read_text(encoding="utf-8"))
        assert function in {
            node.name for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)
        }


@pytest.mark.parametrize("entry", SURVIVORS, ids=lambda entry: entry["before"])
def test_an_explained_survivor_is_a_mutant_of_its_source(entry, program):
    source = (ROOT / entry["source"]).read_text(encoding="utf-8")
    assert entry["why"]
    assert entry["source"] in {target["source"] for target in TARGETS}
    assert (entry["before"], entry["after"]) in {
        (mutant.before, mutant.after) for mutant in program.mutants(source)
    }
