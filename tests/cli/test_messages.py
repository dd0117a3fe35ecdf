"""What is said about bad input, word for word: the manual's page is the expectation.

`make messages` writes the page anew; read the difference before you commit it.
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
from bad_coast import coast_section
from bad_crash import CRASH_CALLS
from bad_crash_case import CRASH_CASES
from bad_crash_records import RECORD_CALLS
from bad_init import init_section
from bad_inputs import CASES
from bad_navigate import navigate_section
from bad_navigation import CALLS

from strapdown.errors import StrapdownError

PAGE = Path(__file__).parents[2] / "docs" / "messages.md"
HEAD = """# What is said about bad input

Each message names the file, the row as an editor counts it, the quantity, and what to do. Where
a log cannot be used, nothing is written and the exit code is not 0; where it can, a note says what
was done, and stands in the report too. This page is written by the tests, which hold every word
of it.

"""

PYTHON = """## From Python: navigation

Here `TIME` is a minute at 100 Hz, `STILL` and `LEVEL` what the sensors read at rest, and `HOME`
a state at 55° north, 37° east.

"""

CRASH = """## From Python: a crash

Here `UNIT` is what the recorder IMU1 of Tadic and Vukajlovic (2016) writes of a simulated impact
on a pole (`record_crash`, `paper_units`), 7 s before it and 1 s after it, `SECOND` what IMU2
writes; LOW, HIGH and GYRO are the parts. `record` gives the same of another crash, `changed`
applies a function to the table of a part or of all, `after` cuts what is before an instant from
the trigger, and `ENTRY` is 7.1 ± 0.2 m/s. Where a record can be used, the notes stand in
`findings`.

"""

CASE_FILE = """## A crash case file

Each message names the line of the key; where two keys contradict each other, the lines and values
of both. Here the differences are from this file, whose records are beside it:

"""

CRASH_COMMAND = """## strapdown crash

Each is the folder that `strapdown simulate pole` writes, with one thing changed, given to
`strapdown crash case.toml`. Where it can be used, the notes stand in the report, too.

"""

RECORDS = """## From Python: crash records

Each record is a small file with one fault; its channels are asked for as a case asks for them, by
`triad_of_channels`. Where the record can be used, the notes stand in `attrs["findings"]`.

"""


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
            # What every log without further words is told is said once, at the end.
            said = "\n".join(_without_usual(said.splitlines())) + "\n"
        words = " ".join(f"'{o}'" if " " in o else o for o in case.options)
        sections.append(
            f"## {case.title}\n\n"
            + (f"With `{words}`:\n\n" if words else "")
            + f"```text\n{said}```\n\nExit code {result.code}.\n\n"
        )
    sections.append(alignment_section(tmp_path_factory.mktemp, run_cli))
    sections.append(navigate_section(tmp_path_factory.mktemp, run_cli))
    sections.append(coast_section(tmp_path_factory.mktemp, run_cli))
    sections.append(init_section(tmp_path_factory.mktemp, run_cli))
    return HEAD + "".join(sections) + _crash_cases(crash_said) + _from_python()


@pytest.fixture(scope="module")
def crash_said(tmp_path_factory, run_cli):
    """What `strapdown crash` says of each case, and its exit code."""
    import strapdown.report.crash_case as module

    root = tmp_path_factory.mktemp("crash-cases")
    assert run_cli("simulate", "pole", "-q", "--out", root / "pole").code == 0
    said = []
    with pytest.MonkeyPatch.context() as patch:
        # The drawing says nothing, and takes most of the time.
        patch.setattr(module, "draw_stills", lambda document: ["<svg/>"] * 99)
        patch.setattr(module, "document_page", lambda document, stills: "<html></html>")
        patch.setattr(module, "write_pdf", lambda document, path, stills: path.write_bytes(b""))
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


def _without_usual(lines: list[str]) -> list[str]:
    kept, skip = [], False
    for line in lines:
        if line.startswith("note: "):
            skip = "nothing says otherwise" in line or "nothing says that it is a mean" in line
        if not skip:
            kept.append(line)
    return kept


@pytest.mark.slow
def test_every_message_is_as_the_manual_has_it(page):
    if os.environ.get("STRAPDOWN_WRITE_MESSAGES"):
        PAGE.write_text(page, encoding="utf-8")
    assert page == PAGE.read_text(encoding="utf-8"), "run `make messages` and read the difference"
