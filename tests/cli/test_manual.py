"""The manual's examples print what the manual shows, and its pages are found."""

from __future__ import annotations

import importlib.util
import os
import re
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


def runner():
    """The script that runs the manual's examples, as a module."""
    spec = importlib.util.spec_from_file_location("run_examples", ROOT / "docs/run_examples.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


RUNNER = runner()
PAGES = [page for page in RUNNER.pages() if any(map(RUNNER.is_run, RUNNER.examples(page)))]
#: Pages whose examples take more than 8 s; `make examples` runs them.
SLOW = {
    "align",
    "alignment",
    "allan",
    "answer",
    "attitude",
    "coast",
    "consistency",
    "convert",
    "crash",
    "crash_tutorial",
    "doctor",
    "error_models",
    "health",
    "mechanization",
    "navigate",
    "prefilter",
    "references",
    "results",
    "scenarios",
    "sins1000",
    "smoothing",
    "start",
    "trajectories",
    "trust",
    "walking",
}
DOCUMENTS = [*sorted((ROOT / "docs").glob("*.md")), ROOT / "CONTRIBUTING.md"]


@pytest.mark.parametrize(
    "page",
    [
        pytest.param(page, marks=[pytest.mark.slow] if page.stem in SLOW else [], id=page.stem)
        for page in PAGES
    ],
)
def test_every_example_of_a_page_prints_what_the_page_shows(page, capsys, monkeypatch, recordings):
    if "STRAPDOWN_DATA" in page.read_text(encoding="utf-8"):
        monkeypatch.setenv("STRAPDOWN_DATA", str(recordings("mpu6050_turns").parent))
    monkeypatch.setenv("PATH", f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}")
    assert RUNNER.check(page, write=False) == 0, capsys.readouterr().out


@pytest.mark.parametrize("page", DOCUMENTS, ids=lambda page: page.stem)
def test_every_example_is_run_or_says_why_it_is_not(page):
    if page.stem == "CONTRIBUTING":
        assert not [block["code"] for block in RUNNER.examples(page) if block["reason"] is None]
        return
    left = [block for block in RUNNER.examples(page) if not RUNNER.is_run(block)]
    assert [block["code"] for block in left if block["reason"] is None] == []
    # Every such block is seen, whatever stands around it.
    fences = re.findall(r"^```(?:console|python|sh|bash|\{code-cell\}.*)$", page.read_text(), re.M)
    assert len(fences) == len(RUNNER.examples(page))


@pytest.mark.parametrize("page", DOCUMENTS, ids=lambda page: page.stem)
def test_every_table_of_settings_can_be_read(page):
    for block in re.findall(r"^```toml\n(.*?)^```$", page.read_text(encoding="utf-8"), re.M | re.S):
        tomllib.loads(block)


@pytest.mark.parametrize("page", DOCUMENTS, ids=lambda page: page.stem)
def test_no_formula_leaves_it_to_tex_to_part_digits(page):
    # What sets formulas for browsers takes \frac12 x for 12 over x.
    assert re.findall(r"frac\d\d", page.read_text(encoding="utf-8")) == []


def test_every_page_is_listed_and_no_link_leads_nowhere():
    docs = ROOT / "docs"
    index = (docs / "index.md").read_text(encoding="utf-8")
    listed = "\n".join(re.findall(r"```\{toctree\}\n(.*?)```", index, re.S)).split()
    tables = index[index.index("## All pages") :]
    for page in RUNNER.pages():
        name = str(page.relative_to(docs).with_suffix(""))
        if name != "index":
            assert name in listed, name
            assert f"]({name}.md)" in tables, name
    # Anchors are the builder's affair, which takes a wrong one for an error.
    for page in DOCUMENTS:
        for target in re.findall(r"\]\(([^)#:\s]+\.\w+)[)#]", page.read_text(encoding="utf-8")):
            # The page of messages is made of the catalogue when the manual is built.
            assert target == "messages.md" or (page.parent / target).exists(), (page.name, target)


NOTEBOOKS = sorted((ROOT / "docs" / "notebooks").glob("*.md"))


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
    assert RUNNER.check(page, write=True) == 2
    text = page.read_text()
    assert "```text\na\n3\n```\n\nwords\n" in text
    assert "ZeroDivisionError" in text
    assert text.count("words") == 3
    assert "x + 1" in capsys.readouterr().out
    assert RUNNER.check(page, write=False) == 0
