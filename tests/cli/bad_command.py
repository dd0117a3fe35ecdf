"""Run a command on what it cannot use, and look at what it leaves behind."""

from __future__ import annotations

import os
from pathlib import Path

import pytest


def whole_runs_slow(cases) -> list:
    """Cases as parameters; those that are done with a warning are whole runs, and slow."""
    return [
        pytest.param(one, marks=() if one.code else pytest.mark.slow, id=one.title) for one in cases
    ]


def said_by(command: str, case, folder: Path, options, run_cli) -> tuple[str, int]:
    """What a command says of the source of a case in a folder, and its exit code."""
    before = sorted(p.name for p in folder.rglob("*"))
    done = run_cli(command, folder / case.source, "--out", folder / "out", *options)
    assert "Traceback" not in done.err, done.err
    assert done.code == case.code, (case.title, done.code, done.err)
    if case.code:
        assert sorted(p.name for p in folder.rglob("*")) == before, "something was left behind"
        assert done.out == ""
    else:
        assert (folder / "out" / "manifest.json").is_file()
    return done.err.replace(str(folder) + os.sep, ""), done.code
