"""Records of which `strapdown init crash` can make no case, and what it says of them."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import pytest

__all__ = ["INIT_CASES", "init_section"]

HEAD = """## strapdown init crash

Each is given to `strapdown init crash`. Nothing is written then.

"""
TABLE = "time_s,ax_g,ay_g,az_g\n" + "".join(f"{k / 200:.3f},{k % 3},0,-1\n" for k in range(60))


@dataclass(frozen=True)
class InitCase:
    """Files of a folder, and what the command is given of them."""

    title: str
    files: dict[str, str | bytes]
    given: tuple[str, ...]
    what: str = ""
    code: int = 3
    also: tuple[str, ...] = field(default=())


INIT_CASES = (
    InitCase("A record that is not there", {"left.csv": TABLE}, ("lefd.csv",), code=4),
    InitCase("A record named twice", {"left.csv": TABLE}, ("left.csv", "left.csv"), code=4),
    InitCase("An empty record", {"left.csv": ""}, ("left.csv",)),
    InitCase(
        "A letter in place of a record",
        {"letter.txt": "Dear colleague,\nthe record follows.\n"},
        ("letter.txt",),
    ),
    InitCase(
        "A row that is short",
        {"left.csv": TABLE.replace("0.020,1,0,-1", "0.020,1,-1")},
        ("left.csv",),
    ),
    InitCase(
        "Time that goes back",
        {"left.csv": TABLE.replace("0.025,", "0.005,")},
        ("left.csv",),
    ),
    InitCase(
        "A few samples",
        {"left.csv": "".join(TABLE.splitlines(keepends=True)[:4])},
        ("left.csv",),
    ),
    InitCase(
        "No accelerometer",
        {
            "climate.csv": "time_s,temperature,humidity\n"
            + "".join(f"{k / 10},{20 + k},{40 + k}\n" for k in range(12))
        },
        ("climate.csv",),
    ),
    InitCase(
        "A folder of photographs",
        {"car/1.jpg": b"\xff\xd8\0\0", "car/2.jpg": b"\xff\xd8"},
        ("car",),
    ),
    InitCase("A spreadsheet", {"left.xlsx": b"PK\x03\x04\0\0\0\0"}, ("left.xlsx",)),
    InitCase(
        "A case that is there already",
        {"left.csv": TABLE, "case.toml": 'title = "mine"\n'},
        ("left.csv",),
        code=4,
    ),
)


def init_section(make_folder: Callable[[str], Path], run_cli: Callable[..., object]) -> str:
    """The section of the manual's page, as the command line would fill it now."""
    parts = [HEAD]
    for number, case in enumerate(INIT_CASES):
        folder = make_folder(f"init{number}")
        for name, content in case.files.items():
            path = folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content if isinstance(content, bytes) else content.encode())
        before = {p: p.read_bytes() for p in folder.rglob("*") if p.is_file()}
        with pytest.MonkeyPatch.context() as patch:
            patch.chdir(folder)
            done = run_cli("init", "crash", *case.given, *case.also)
        assert done.code == case.code, (case.title, done.err)
        assert done.out == ""
        assert "Traceback" not in done.err
        after = {p: p.read_bytes() for p in folder.rglob("*") if p.is_file()}
        assert after == before, "something was left behind"
        said = done.err.replace(str(folder) + os.sep, "")
        given = " ".join(case.given)
        parts.append(
            f"### {case.title}\n\n```console\n$ strapdown init crash {given}\n{said}```\n\n"
        )
        parts.append(f"Exit code {done.code}.\n\n")
    return "".join(parts)
