"""What the README shows is what the commands print."""

from __future__ import annotations

import re
import shlex
import tomllib
from pathlib import Path

import pytest

import strapdown

README = (Path(__file__).parent.parent / "README.md").read_text(encoding="utf-8")
RUNS = re.findall(r"```text\n\$ strapdown (.*?)\n…\n(.*?)```", README, re.S)


def test_there_are_runs_to_hold():
    assert len(RUNS) == 3


@pytest.mark.slow
@pytest.mark.parametrize(("command", "shown"), RUNS, ids=["attitude", "crash", "navigate"])
def test_the_output_shown_is_the_output(command, shown, run_cli, tmp_path, monkeypatch):
    words = shlex.split(command.replace("\\\n", " "))
    (tmp_path / "docs").symlink_to(Path(__file__).parent.parent / "docs")
    monkeypatch.chdir(tmp_path)
    if words[0] == "crash":
        assert "    strapdown simulate pole --out records" in README
        assert run_cli("simulate", "pole", "--out", "records").code == 0
    found = run_cli(*words, "--out", tmp_path / "out")
    assert found.code == 0
    printed = {line.rstrip() for line in (found.out + found.err).splitlines()}
    # An ellipsis stands for lines that are left out.
    for line in (line.rstrip() for line in shown.splitlines()):
        assert line in printed or line in ("", "…")


@pytest.mark.slow
def test_the_python_shown_runs(tmp_path, monkeypatch):
    import doctest

    (tmp_path / "docs").symlink_to(Path(__file__).parent.parent / "docs")
    monkeypatch.chdir(tmp_path)
    shown = "\n".join(re.findall(r"```python\n(.*?)```", README, re.S))
    test = doctest.DocTestParser().get_doctest(shown, {}, "README", "README.md", 0)
    said: list[str] = []
    failures, _ = doctest.DocTestRunner().run(test, out=said.append)
    assert failures == 0, "".join(said)


def test_links_lead_somewhere():
    for target in re.findall(r"\]\(([^)#]+)\)", README):
        assert (Path(__file__).parent.parent / target).exists(), target


def test_versions_agree():
    root = Path(__file__).parent.parent
    project = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert project["version"] == strapdown.__version__
    # The newest section of the changelog with a date is the newest release.
    changes = (root / "CHANGELOG.md").read_text(encoding="utf-8")
    released = re.findall(r"^## \[(\d+\.\d+\.\d+)\] - \d{4}-\d\d-\d\d$", changes, re.M)
    assert f"\nversion: {released[0]}\n" in (root / "CITATION.cff").read_text(encoding="utf-8")
