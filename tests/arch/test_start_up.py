"""What is loaded when, seen in sys.modules of a fresh process."""

from __future__ import annotations

import json
import subprocess
import sys
from importlib import import_module
from types import ModuleType

import pytest

# Typer itself loads pydantic where a command has options.
HEAVY = ("numba", "pandas", "typst", "jinja2", "scipy", "h5py", "pyarrow")


def loaded_after(code: str) -> set[str]:
    """Heavy packages in sys.modules after `code`."""
    tell = f"import json, sys\nprint(json.dumps([m for m in {HEAVY!r} if m in sys.modules]))"
    text = f"{code}\n{tell}"
    done = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, check=True)
    return set(json.loads(done.stdout.splitlines()[-1]))


def test_import_strapdown_loads_nothing_heavy():
    assert loaded_after("import strapdown") == set()


def test_dir_and_an_unknown_name_load_nothing_either():
    code = "import strapdown\ndir(strapdown)\ntry:\n strapdown.nothing\nexcept AttributeError: pass"
    assert loaded_after(code) == set()


@pytest.mark.slow
@pytest.mark.parametrize(
    "arguments",
    [
        ["--help"],
        ["align", "--help"],
        ["attitude", "--help"],
        ["crash", "--help"],
        ["init", "align", "--help"],
        ["init", "navigate", "--help"],
        ["navigate", "--help"],
        ["coast", "--help"],
        ["init", "crash", "--help"],
        ["verify", "--help"],
        ["--version"],
    ],
)
def test_help_loads_nothing_heavy(arguments):
    code = (
        f"import sys\nsys.argv = ['strapdown', *{arguments!r}]\n"
        "from strapdown.cli.main import run\ntry:\n run()\nexcept SystemExit: pass"
    )
    assert loaded_after(code) == set()


def test_the_public_names_are_there():
    import strapdown

    for name in strapdown.__all__:
        assert getattr(strapdown, name) is not None


ROOMS = (
    "alignment",
    "crash",
    "dsp",
    "estimation",
    "evaluation",
    "navigation",
    "sensors",
    "simulation",
)


@pytest.mark.parametrize("room", ROOMS)
def test_a_room_exports_what_it_says_and_no_module_in_its_place(room):
    package = import_module(f"strapdown.{room}")
    for name in package.__all__:
        home = package.__dict__["_homes"][name]
        # The module first, as an import from inside does: its name must not hide the function's.
        module = import_module(f"strapdown.{room}.{home}")
        assert getattr(package, name) is getattr(module, name)
        assert not isinstance(getattr(package, name), ModuleType)
    with pytest.raises(AttributeError, match="nothing"):
        _ = package.nothing


def test_an_empty_room_loads_nothing():
    code = "; ".join(f"import strapdown.{room}" for room in ROOMS)
    assert loaded_after(code) == set()
