"""The manual's examples print what the manual shows, and its pages are found."""

from __future__ import annotations

import importlib.util
import os
import re
import sys
import tomllib
from pathlib import Path

import pytest

import strapdown
from strapdown.cli.main import COMMANDS

ROOT = Path(__file__).parents[2]
CATALOGUE = ROOT / "src/strapdown/messages"


def runner():
    """The script that runs the manual's examples, as a module."""
    spec = importlib.util.spec_from_file_location("run_examples", ROOT / "docs/run_examples.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


RUNNER = runner()
PAGES = [page for page in RUNNER.pages() if any(map(RUNNER.is_run, RUNNER.examples(page)))]
#: Pages whose examples take more than 4 s of processor time; `make examples` runs them.
SLOW = {
    "align",
    "allan",
    "answer",
    "attitude",
    "calibrate",
    "campaign",
    "car",
    "compare",
    "consistency",
    "convert",
    "crash_tutorial",
    "doctor",
    "export",
    "extrinsics",
    "navigate",
    "outage",
    "prefilter",
    "references",
    "scenarios",
    "seal",
    "sins1000",
    "smoothing",
    "start",
    "trust",
    "walking",
    "wearable",
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
            # Pages of messages and modules are made of the code when the manual is built.
            room = re.fullmatch(r"messages/(\w+)\.md", target)
            source = CATALOGUE / f"{room[1]}.toml" if room else page.parent / target
            assert target == "modules.md" or source.exists(), (page.name, target)


def test_every_room_of_messages_is_listed():
    page = (ROOT / "docs/messages.md").read_text(encoding="utf-8")
    rooms = re.findall(r"^\| \[(\w+)\]\(messages/\1\.md\) \|", page, re.M)
    assert sorted(rooms) == sorted(room.stem for room in CATALOGUE.glob("*.toml"))


def test_every_command_is_on_the_page_that_chooses_one():
    page = (ROOT / "docs/which_command.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\|.*?\|.*?\| `strapdown ([\w-]+)", page, re.M)
    assert sorted(rows) == sorted(COMMANDS)
    for name in re.findall(r"\{py:obj\}`\w+ <strapdown\.(\w+)>`", page):
        assert name in strapdown.__all__, name


def test_every_public_name_has_its_page():
    page = (ROOT / "docs/api.md").read_text(encoding="utf-8")
    # Sphinx takes a name that does not exist for an error, here and among the building blocks.
    names = re.findall(r"^   ([\w.]+)$", page, re.M)
    public = [name for name in names if name in strapdown.__all__]
    assert sorted(public) == sorted(set(strapdown.__all__) - {"__version__"})
    assert sorted(set(names) - set(public)) == ["errors", "plugins.plugin", "plugins.plugins"]


NOTEBOOKS = [page for page in RUNNER.pages() if page.read_text("utf-8").startswith("---\n")]


@pytest.mark.parametrize("page", NOTEBOOKS, ids=lambda page: page.stem)
def test_a_notebook_says_how_jupytext_opens_it(page):
    head = page.read_text(encoding="utf-8").split("---\n")[1]
    assert "format_name: myst" in head
    assert "name: python3" in head


def test_a_cell_that_prints_something_else_is_found_and_mended(tmp_path, capsys):
    page = tmp_path / "page.md"
    cells = ["x = 2\n", "print('a')\nx + 1\n", "1 / 0\n", "!echo $((1 + 2))\n"]
    shown = [None, "a\n5\n", "nothing\n", None]
    page.write_text(
        "".join(
            f"```{{code-cell}} ipython3\n{cell}```\n"
            + (f"\n```text\n{out}```\n" if out else "")
            + "\nwords\n\n"
            for cell, out in zip(cells, shown, strict=True)
        )
    )
    assert RUNNER.check(page, write=True) == 3
    text = page.read_text()
    assert "```{code-cell} ipython3\n!echo $((1 + 2))\n```\n\n```text\n3\n```\n" in text
    assert "```text\na\n3\n```\n\nwords\n" in text
    assert "ZeroDivisionError" in text
    assert text.count("words") == 4
    assert "x + 1" in capsys.readouterr().out
    assert RUNNER.check(page, write=False) == 0


#: Words of the manual by hand, at most: of the commands up to `extrinsics`, of campaigns, of
#: comparisons, of the studio with what stops its attackers, of `live`, of more formats, of runs
#: that are repeated, larger studies and references in the studio, of positions as people write
#: them, of what widens bounds (a unit outside of its type, a turning, structure), and of clocks,
#: layouts and printed lines.
MOST_WORDS = 45_000 + 1_000 + 700 + 600 + 250 + 700 + 200 + 300 + 100 + 600 + 200


def words_by_hand() -> dict[str, int]:
    """Words of each page of docs/ outside of fenced code blocks.

    A word is what blanks part, a link or a cell of a table included. What is in a fence does not
    count, except a list-table or a note (so the entries of the glossary, a directive, do not). Left
    out are pages that the build generates (`.gitignore` names them), the decisions, and
    `performance.md`, which `make bench` writes.
    """
    ignored = (ROOT / ".gitignore").read_text(encoding="utf-8")
    left_out = ("decisions/", "performance.md", *re.findall(r"^docs/(.+)$", ignored, re.M))
    prose = r"(?!\{(?:list-table|note|warning|tip|admonition|dropdown)\})"
    fence = rf"^(`{{3,}}|~{{3,}}){prose}.*?^\1\s*$"
    found = {}
    for page in sorted((ROOT / "docs").rglob("*.md")):
        name = str(page.relative_to(ROOT / "docs"))
        if not name.startswith(left_out):
            text = re.sub(fence, "", page.read_text(encoding="utf-8"), flags=re.M | re.S)
            found[name] = len(text.split())
    return found


def test_the_manual_is_short():
    found = words_by_hand()
    longest = sorted(found.items(), key=lambda one: -one[1])[:10]
    assert sum(found.values()) <= MOST_WORDS, (sum(found.values()), longest)
