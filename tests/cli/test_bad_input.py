"""What is found in bad input: the code of each finding, where it is, and the exit code.

`make codes` writes the list anew; read the difference before you commit it. Sentences are not
part of it: they may be reworded at any time.
"""

from __future__ import annotations

import os
import shutil
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from bad_alignment import alignment_section
from bad_case import CASE_FILES, TEXT
from bad_crash import CRASH_CALLS
from bad_crash_case import CRASH_CASES
from bad_crash_records import RECORD_CALLS
from bad_init import init_section
from bad_inputs import CASES
from bad_navigate import navigate_section
from bad_navigation import CALLS
from bad_outage import outage_section

from strapdown.errors import Finding, StrapdownError

LIST = Path(__file__).with_name("bad_input_codes.md")
HEAD = """# Bad input and the codes of what is found in it

Written by `make codes`.

"""
PYTHON = "## From Python: navigation\n\n"
CRASH = "## From Python: a crash\n\n"
CASE_FILE = "## A crash case file\n\n"
CRASH_COMMAND = "## strapdown crash\n\n"
RECORDS = "## From Python: crash records\n\n"


@pytest.fixture(scope="module", autouse=True)
def codes_for_sentences():
    """Show every finding as its code and its location."""

    def code(finding, words="python"):
        where = [finding.file, finding.row, finding.line, finding.quantity]
        shown = ", ".join(Path(str(w)).name for w in where if w is not None)
        inner = [
            one
            for value in finding.data.values()
            for one in (value if isinstance(value, tuple) else (value,))
            if isinstance(one, Finding)
        ]
        more = f" <- {', '.join(one.code for one in inner)}" if inner else ""
        return f"{finding.severity} {finding.code} ({shown}){more}"

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Finding, "text", code)
        yield


@pytest.fixture(scope="module")
def page(tmp_path_factory, run_cli, crash_said):
    """The page as the command line would fill it now."""
    sections = []
    for number, case in enumerate(CASES):
        folder = tmp_path_factory.mktemp(f"case{number}")
        source = case.make(folder)
        before = sorted(p.name for p in folder.rglob("*"))
        result = run_cli(case.command, source, "--out", folder / "out", *case.options)
        said = result.err.replace(str(folder) + os.sep, "")
        assert "Traceback" not in said
        if case.fails:
            assert result.code in (3, 4), case.title
            assert sorted(p.name for p in folder.rglob("*")) == before, "something was left behind"
        else:
            assert result.code == 0, (case.title, said)
            assert (folder / "out" / "report.html").is_file()
        words = " ".join(f"'{o}'" if " " in o else o for o in case.options)
        sections.append(
            f"## {case.title}\n\n"
            + (f"With `{words}`:\n\n" if words else "")
            + f"```text\n{said}```\n\nExit code {result.code}.\n\n"
        )
    sections.append(alignment_section(tmp_path_factory.mktemp, run_cli))
    sections.append(navigate_section(tmp_path_factory.mktemp, run_cli))
    sections.append(outage_section(tmp_path_factory.mktemp, run_cli))
    sections.append(init_section(tmp_path_factory.mktemp, run_cli))
    return HEAD + "".join(sections) + _crash_cases(crash_said) + _from_python()


@pytest.fixture(scope="module")
def crash_said(tmp_path_factory, run_cli):
    """What `strapdown crash` says of each case, and its exit code."""
    import strapdown.report.document_html as module
    import strapdown.report.document_pdf as paper

    root = tmp_path_factory.mktemp("crash-cases")
    assert run_cli("simulate", "pole", "-q", "--out", root / "pole").code == 0
    said = []
    with pytest.MonkeyPatch.context() as patch:
        # The drawing says nothing, and takes most of the time.
        patch.setattr(module, "draw_stills", lambda document: ["<svg/>"] * 99)
        patch.setattr(module, "document_page", lambda document, stills=(): "<html></html>")
        patch.setattr(paper, "write_pdf", lambda document, path, stills: path.write_bytes(b""))
        for number, bad in enumerate(CRASH_CASES):
            folder = root / str(number)
            case = bad.make(root / "pole", folder)
            before = sorted(p.name for p in root.rglob("*"))
            done = run_cli("crash", case, "--out", root / "out")
            assert done.code == bad.code, (bad.title, done.err)
            assert "Traceback" not in done.err
            if bad.code:
                assert sorted(p.name for p in root.rglob("*")) == before, "something was left"
                assert done.out == ""
            else:
                assert (root / "out" / "manifest.json").is_file()
                shutil.rmtree(root / "out")
            said.append((bad, done.err.replace(str(folder) + os.sep, ""), done.code))
            shutil.rmtree(folder)
    return said


def _crash_cases(crash_said):
    return CRASH_COMMAND + "".join(
        f"### {bad.title}\n\n{bad.what}\n\n```text\n{said}```\n\nExit code {code}.\n\n"
        for bad, said, code in crash_said
    )


def _from_python() -> str:
    parts = [CASE_FILE, f"```toml\n{TEXT}```\n\n"]
    for file in CASE_FILES:
        parts.append(
            f"### {file.title}\n\n```diff\n{file.difference}\n```\n\n```text\n{file.said}\n```\n\n"
        )
    parts.append(PYTHON)
    for case in CALLS:
        with pytest.raises(StrapdownError) as caught:
            case.call()
        parts.append(
            f"### {case.title}\n\n```python\n{case.source}\n```\n\n"
            f"```text\n{type(caught.value).__name__}: {caught.value}\n```\n\n"
        )
    parts.append(CRASH)
    for case in CRASH_CALLS:
        parts.append(
            f"### {case.title}\n\n```python\n{case.source}\n```\n\n```text\n{case.said}\n```\n\n"
        )
    parts.append(RECORDS)
    for record in RECORD_CALLS:
        parts.append(f"### {record.title}\n\n```python\n{record.source}\n```\n\n")
        parts.append(f"```text\n{record.said}\n```\n\n")
    return "".join(parts).rstrip("\n") + "\n"


@pytest.mark.slow
def test_bad_input_is_refused_for_the_reason_that_is_listed(page):
    if os.environ.get("STRAPDOWN_WRITE_CODES"):
        LIST.write_text(page, encoding="utf-8")
    assert page == LIST.read_text(encoding="utf-8"), "run `make codes` and read the difference"
