"""Tests in ISO MME (ISO/TS 13499) as crash records: folder, header, index, channels."""

from __future__ import annotations

import re
from pathlib import Path

from strapdown.exceptions import DataError, Finding
from strapdown.formats.crash_record import CrashRecord
from strapdown.formats.crash_text import LONGEST_NAME, clean, unique
from strapdown.formats.mme_channel import MmeFile, channel_of, is_bad, read_mme_file
from strapdown.formats.mme_text import MmeHeader, read_header

__all__ = ["detect", "read"]

MOST_FILES = 20_000
_NUMBERED = re.compile(r"\.(\d{3,4})$")
_LISTED = re.compile(r"name of channel (\d+)")
_TITLES = ("title", "type of the test", "laboratory test ref. number", "test name")


def detect(path: Path) -> bool:
    """Tell whether it is a header of a test, or a folder that holds one."""
    if path.is_dir():
        return any(p.suffix.lower() == ".mme" for p in path.iterdir())
    return path.suffix.lower() == ".mme"


def read(path: Path) -> CrashRecord:
    """Read a test; its channels read their samples when they are asked.

    Parameters
    ----------
    path : Path
        The ``.mme`` file, or the folder that holds it.

    Returns
    -------
    CrashRecord

    Raises
    ------
    DataError
        There is no header, or more than one; no channel; a header is damaged.
    """
    head = _head(path)
    header = read_header(head)
    findings: list[Finding] = []
    objects = _objects(header)
    index, listed = _index(head, findings)
    numbered = _numbered(head, findings)
    absent = [n for n in listed if n not in numbered]
    if absent:
        shown = ", ".join(f"{n:03d}" for n in absent[:12]) + (" …" if len(absent) > 12 else "")
        findings.append(
            Finding(
                f"{len(absent)} of {len(listed)} listed channels are not in the folder: {shown}",
                file=index.name if index else head.name,
                quantity="channels",
                remedy="nothing, if they are not needed; else get them from the laboratory",
            )
        )
    if not numbered:
        raise DataError(
            "the test has no channel files (.001, .002 …)",
            file=head.name,
            quantity="channels",
            remedy="put them beside it or into its folder Channel",
        )
    files = [read_mme_file(p, listed.get(n, ""), objects) for n, p in sorted(numbered.items())]
    names = unique([f.code or f.path.name for f in files])
    others = {
        f.code.upper(): (n, f) for n, f in reversed(list(zip(names, files, strict=True))) if f.code
    }
    findings += [f for file in files for f in _told(file, listed)]
    return CrashRecord(
        path=path,
        format="mme",
        title=next((t for k in _TITLES if (t := header.text(k))), clean(head.stem)),
        facts=_facts(header),
        channels=tuple(channel_of(f, n, others) for n, f in zip(names, files, strict=True)),
        files=(head, *([index] if index else []), *(f.path for f in files)),
        findings=tuple(findings),
    )


def _head(path: Path) -> Path:
    if not path.is_dir():
        return path
    heads = sorted(p for p in path.iterdir() if p.suffix.lower() == ".mme" and p.is_file())
    if len(heads) != 1:
        held = ", ".join(clean(p.name, LONGEST_NAME) for p in heads[:6])
        raise DataError(
            f"the folder holds {len(heads)} tests: {held}" if heads else "there is no .mme file",
            file=path.resolve().name,
            remedy="give the .mme file of one test",
        )
    return heads[0]


def _folders(head: Path) -> list[Path]:
    """Where channels may stand: in the folder Channel, or beside the header."""
    beside = head.parent
    named = sorted(p for p in beside.iterdir() if p.name.lower() == "channel" and p.is_dir())
    return [*named, beside]


def _inside(path: Path, head: Path) -> bool:
    """Whether a file is in the folder of the test, and no link to elsewhere."""
    return path.resolve().is_relative_to(head.parent.resolve())


def _left_out(path: Path) -> Finding:
    return Finding(
        "left out: it is a link to a file outside the folder of the test",
        file=clean(path.name, LONGEST_NAME),
        remedy="copy the file into the folder, if it belongs there",
    )


def _index(head: Path, findings: list[Finding]) -> tuple[Path | None, dict[int, str]]:
    """The index of channels, and the code of each number in it."""
    found = [
        p
        for folder in _folders(head)
        for p in sorted(folder.iterdir())
        if p.suffix.lower() == ".chn" and p.is_file()
    ]
    same = [p for p in found if p.stem.lower() == head.stem.lower()] or found
    if not same:
        findings.append(
            Finding(
                "there is no index of channels (.chn): the files tell their codes",
                file=head.name,
                quantity="channels",
            )
        )
        return None, {}
    index = same[0]
    if not _inside(index, head):
        findings.append(_left_out(index))
        return None, {}
    header = read_header(index)
    listed = {
        int(m[1]): clean(value.split("/")[0], LONGEST_NAME)
        for key, (value, _) in header.values.items()
        if (m := _LISTED.fullmatch(key)) and len(m[1]) <= 5
    }
    promised = header.number("number of channels")
    if promised is not None and promised != len(listed):
        findings.append(
            Finding(
                f"it promises {promised:g} channels and lists {len(listed)}",
                file=index.name,
                row=header.line("number of channels"),
                quantity="number of channels",
                remedy="if one is missing that is needed, get the test again",
            )
        )
    return index, listed


def _numbered(head: Path, findings: list[Finding]) -> dict[int, Path]:
    """Files of channels by their number."""
    for folder in _folders(head):
        found = [p for p in sorted(folder.iterdir()) if _NUMBERED.search(p.name) and p.is_file()]
        same = [p for p in found if p.stem.lower() == head.stem.lower()]
        stems = sorted({p.stem for p in found})
        tests = {p.stem.lower() for p in head.parent.iterdir() if p.suffix.lower() == ".mme"}
        if not same and (len(stems) > 1 or any(s.lower() in tests for s in stems)):
            shown = ", ".join(clean(s, 40) for s in stems[:6])
            raise DataError(
                f"the channels there are of other tests, and none has its name: {shown}",
                file=head.name,
                quantity="channels",
                remedy="put each test into a folder of its own",
            )
        kept: dict[int, Path] = {}
        for path in (same or found)[:MOST_FILES]:
            if not _inside(path, head):
                findings.append(_left_out(path))
                continue
            kept.setdefault(int(path.suffix[1:]), path)
        if kept:
            return kept
    return {}


def _objects(header: MmeHeader) -> int:
    stated = header.number("number of test objects")
    return 1 if stated is None or stated < 1 else int(min(stated, 99))


def _facts(header: MmeHeader) -> dict[str, str]:
    facts = {clean(key, LONGEST_NAME): header.text(key) for key in header.values}
    spoken = {
        "test": "laboratory test ref. number",
        "date": "date of the test",
        "laboratory": "laboratory name",
    }
    facts |= {name: header.text(key) for name, key in spoken.items()}
    if _objects(header) == 1:
        # Quantities of the header are in SI.
        for name, key in (
            ("mass_kg", "mass test object 1"),
            ("speed_m_per_s", "velocity test object 1"),
        ):
            if (value := header.number(key)) is not None:
                facts[name] = f"{value:.10g}"
        facts["vehicle"] = header.text("name of test object 1")
    return {k: v for k, v in facts.items() if v}


def _told(file: MmeFile, listed: dict[int, str]) -> list[Finding]:
    told = []
    name = clean(file.path.name, LONGEST_NAME)
    number = int(file.path.suffix[1:])
    if file.known is None:
        told.append(
            Finding(
                f"'{file.code}' is no channel code of sixteen letters and figures"
                if file.code
                else "it has no channel code",
                file=name,
                row=file.header.line("channel code"),
                quantity="channel code",
                remedy="nothing tells its axis: check which one it is",
            )
        )
    if is_bad(file):
        told.append(
            Finding(
                f"the laboratory gives its status as {file.header.text('data status')}",
                file=name,
                row=file.header.line("data status"),
                quantity=f"channel {file.code or name}",
                remedy="do not use it without looking at it",
            )
        )
    indexed = listed.get(number, "")
    if indexed and file.code and indexed.upper() != file.code.upper():
        told.append(
            Finding(
                f"the index has {indexed} for it, and the file says {file.code}, which is taken",
                file=name,
                row=file.header.line("channel code"),
                quantity="channel code",
                remedy="ask the laboratory which one it is",
            )
        )
    return told
