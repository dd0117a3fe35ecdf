"""The manual's examples print what the manual shows."""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@pytest.mark.slow
def test_every_example_of_the_manual(recordings):
    data = recordings("mpu6050_turns").parent
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    done = subprocess.run(
        [sys.executable, str(ROOT / "docs" / "run_examples.py")],
        env=os.environ | {"PATH": path, "STRAPDOWN_DATA": str(data)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr


def runner():
    """The script that runs the manual's examples, as a module."""
    spec = importlib.util.spec_from_file_location("run_examples", ROOT / "docs/run_examples.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.slow
def test_the_tutorial_for_investigators(capsys, monkeypatch):
    monkeypatch.setenv("PATH", f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}")
    page = ROOT / "docs" / "crash_tutorial.md"
    assert runner().check(page, write=False) == 0, capsys.readouterr().out


NOTEBOOKS = sorted((ROOT / "docs" / "notebooks").glob("*.md"))


@pytest.mark.parametrize("page", NOTEBOOKS, ids=lambda page: page.stem)
def test_every_notebook_prints_what_it_shows(page, capsys):
    assert runner().check(page, write=False) == 0, capsys.readouterr().out


@pytest.mark.parametrize("page", NOTEBOOKS, ids=lambda page: page.stem)
def test_a_notebook_says_how_jupytext_opens_it(page):
    head = page.read_text(encoding="utf-8").split("---\n")[1]
    assert "format_name: myst" in head
    assert "name: python3" in head


def test_a_cell_that_prints_something_else_is_found_and_mended(tmp_path, capsys):
    page = tmp_path / "page.md"
    cells = ["x = 2\n", "print('a')\nx + 1\n", "1 / 0\n"]
    shown = [None, "a\n5\n", "nothing\n"]
    page.write_text(
        "".join(
            f"```{{code-cell}} ipython3\n{cell}```\n"
            + (f"\n```text\n{out}```\n" if out else "")
            + "\nwords\n\n"
            for cell, out in zip(cells, shown, strict=True)
        )
    )
    assert runner().check(page, write=True) == 2
    text = page.read_text()
    assert "```text\na\n3\n```\n\nwords\n" in text
    assert "ZeroDivisionError" in text
    assert text.count("words") == 3
    assert "x + 1" in capsys.readouterr().out
    assert runner().check(page, write=False) == 0
