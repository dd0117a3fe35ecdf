"""One simulated crash, sealed once for every test that reads or harms it."""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path

import pytest


@dataclass(frozen=True)
class Sealed:
    """A folder that `strapdown crash` wrote, and what it said."""

    records: Path
    folder: Path
    out: str
    err: str


@pytest.fixture(scope="session")
def sealed_crash(tmp_path_factory, run_cli) -> Sealed:
    root = tmp_path_factory.mktemp("crash")
    made = run_cli("simulate", "pole", "-q", "--out", root / "pole")
    assert (made.code, made.out, made.err) == (0, "", "")
    case = root / "pole" / "case.toml"
    done = run_cli("crash", case, "--out", root / "pole-crash")
    assert done.code == 0, done.err
    return Sealed(root / "pole", root / "pole-crash", done.out, done.err)


@pytest.fixture(scope="session")
def light_case(sealed_crash) -> Path:
    """The case by one of its recorders and without drawn paths, where any case will do."""
    folder = Path(shutil.copytree(sealed_crash.records, sealed_crash.records.with_name("light")))
    case = folder / "case.toml"
    text = case.read_text(encoding="utf-8")
    second = text.index("[[units]]", text.index("[[units]]") + 1)
    text = text[:second] + text[text.index("[[references]]") :]
    case.write_text(text.replace("monte_carlo_runs = 2000", "monte_carlo_runs = 0"))
    return case


@pytest.fixture
def copied_crash(sealed_crash, tmp_path) -> Path:
    return Path(shutil.copytree(sealed_crash.folder, tmp_path / "pole-crash"))
