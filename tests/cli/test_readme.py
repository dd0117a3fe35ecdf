"""What the README shows is what the program prints."""

from __future__ import annotations

import doctest
import re
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow
ROOT = Path(__file__).parents[2]
README = ROOT / "README.md"


@pytest.fixture
def beside(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with the examples, in which the process is."""
    (tmp_path / "docs").symlink_to(ROOT / "docs")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_its_python_prints_what_it_shows(beside: Path) -> None:
    # A fence under an output is none of it.
    text = re.sub(r"^```\w*$", "", README.read_text(encoding="utf-8"), flags=re.M)
    shown = doctest.DocTestParser().get_doctest(text, {}, README.name, str(README), 0)
    found = doctest.DocTestRunner().run(shown)
    assert found.attempted > 8 and found.failed == 0


def test_its_commands_print_what_it_shows(beside: Path) -> None:
    text = README.read_text(encoding="utf-8")
    command = [sys.executable, "-m", "strapdown"]
    subprocess.run([*command, "simulate", "pole", "--out", "records"], check=True)
    blocks = re.findall(r"```text\n\$ strapdown ([^\n]+)\n(.*?)```", text, re.S)
    assert len(blocks) == 3
    for words, shown in blocks:
        out = subprocess.run(
            [*command, *words.split()], capture_output=True, text=True, check=True
        ).stdout
        printed = iter(line.rstrip() for line in out.splitlines())
        for line in shown.splitlines():
            # In this order; a rule is as wide as its table.
            if line != "…" and not set(line) <= {" ", "─"}:
                assert line.rstrip() in printed, (words, line)
