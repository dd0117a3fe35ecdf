"""What `strapdown outage` cannot use, and what it says."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest
from bad_navigate import undrawn, write_drive

__all__ = ["COAST_CASES", "navigated_drive", "outage_said", "outage_section"]

HEAD = """## strapdown outage

`drive-navigate` is the folder that `strapdown navigate` writes of the drive above, which takes
80 s.

"""


@dataclass(frozen=True)
class CoastCase:
    """What is given, and the exit code."""

    title: str
    source: str
    options: tuple[str, ...] = ()
    code: int = 4
    change: Callable[[Path], None] | None = None
    what: str = ""


def _lost(folder: Path) -> None:
    (folder / "inputs" / "log" / "drive.csv").unlink()


def _changed(folder: Path) -> None:
    log = folder / "inputs" / "log" / "drive.csv"
    log.write_text(log.read_text().replace("0.0", "0.1", 1))


def _of_another(folder: Path) -> None:
    manifest = json.loads((folder / "manifest.json").read_text())
    manifest["command"] = "align"
    (folder / "manifest.json").write_text(json.dumps(manifest))


def _no_bundle(folder: Path) -> None:
    (folder / "manifest.json").unlink()


DRIVE = "drive-navigate"
COAST_CASES = (
    CoastCase("A sensor that is not known", "adis16740"),
    CoastCase("An accelerometer alone", "lis302dlh"),
    CoastCase("No outage", "adis16470", ("--outage", "0")),
    CoastCase("An outage of less than nothing", "adis16470", ("--outage", "-60")),
    CoastCase("An outage of weeks", "adis16470", ("--outage", "1e6")),
    CoastCase("No number", "adis16470", ("--outage", "nan")),
    CoastCase("A standard deviation below zero", "adis16470", ("--heading-sd", "-1")),
    CoastCase("A turn of what stands", "adis16470", ("--turn-rate", "3")),
    CoastCase("A turn that throws it off", "adis16470", ("--speed", "60", "--turn-rate", "120")),
    CoastCase("An aid that is away", "adis16470", ("--with", "gnss")),
    CoastCase("An option of an aid", "adis16470", ("--with", "no_slip:lateral_sd=0.1")),
    CoastCase("Places of a sensor", "adis16470", ("--places", "5")),
    CoastCase("A speed of a run", DRIVE, ("--speed", "15")),
    CoastCase("An outage longer than the record", DRIVE, ("--outage", "600")),
    CoastCase("An outage beyond the end of the record", DRIVE, ("--at", "70", "--outage", "30")),
    CoastCase(
        "The log is gone",
        DRIVE,
        code=3,
        change=_lost,
        what="`inputs/log/drive.csv` was removed from the folder.",
    ),
    CoastCase(
        "The log has changed",
        DRIVE,
        code=3,
        change=_changed,
        what="In `inputs/log/drive.csv` a number was changed.",
    ),
    CoastCase(
        "A folder of another command",
        DRIVE,
        code=3,
        change=_of_another,
        what="The folder is one that `strapdown align` wrote.",
    ),
    CoastCase(
        "A folder that nothing wrote",
        DRIVE,
        code=3,
        change=_no_bundle,
        what="`manifest.json` was removed from the folder.",
    ),
    CoastCase("A log in place of a run", "drive.csv"),
    CoastCase("A file that is not there", "drive.toml"),
)


def navigated_drive(folder: Path, run_cli) -> None:
    """Write the drive, and navigate over it."""
    write_drive(folder)
    with pytest.MonkeyPatch.context() as patch:
        undrawn(patch)
        done = run_cli("navigate", folder / "navigate.toml", "-q", "--out", folder / DRIVE)
    assert done.code == 0, done.err


def outage_section(mktemp, run_cli) -> str:
    """What `strapdown outage` says of each case, as the page has it."""
    root = mktemp("outage-drive")
    navigated_drive(root, run_cli)
    parts = [HEAD]
    for case in COAST_CASES:
        said, code = outage_said(case, root, mktemp("outage"), run_cli)
        given = " ".join((case.source, *case.options))
        told = f"{case.what}\n\n" if case.what else ""
        parts.append(
            f"### {case.title}\n\n{told}`strapdown outage {given}`\n\n"
            f"```text\n{said}```\n\nExit code {code}.\n\n"
        )
    return "".join(parts)


def outage_said(case: CoastCase, root: Path, folder: Path, run_cli) -> tuple[str, int]:
    """Run a case; whether anything is left behind is looked at here."""
    source: str | Path = case.source
    if case.source.startswith("drive"):
        source = folder / case.source
        if (root / case.source).is_dir():
            shutil.copytree(root / case.source, source)
        elif (root / case.source).is_file():
            shutil.copyfile(root / case.source, source)
        if case.change is not None:
            case.change(folder / case.source)
    before = sorted(p.name for p in folder.rglob("*"))
    done = run_cli("outage", source, "--out", folder / "out", *case.options)
    assert "Traceback" not in done.err, done.err
    assert done.code == case.code, (case.title, done.code, done.err)
    assert sorted(p.name for p in folder.rglob("*")) == before, "something was left behind"
    assert done.out == ""
    return done.err.replace(str(folder) + os.sep, ""), done.code
