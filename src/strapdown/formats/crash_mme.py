"""Tests in ISO MME (ISO/TS 13499) as crash records: folder, header, index, channels."""

from __future__ import annotations

import re
from pathlib import Path

from strapdown.errors import DataError, Finding
from strapdown.formats.crash_record import CrashRecord
from strapdown.formats.crash_text import LONGEST_NAME, clean, unique
from strapdown.formats.mme_file import (
    MmeFile,
    MmeHeader,
    channel_of,
    is_bad,
    read_header,
    read_mme_file,
)

__all__ = ["detect", "read"]

MOST_FILES = 20_000
_NUMBERED = re.compile(r"\.(\d{3,4})$")
_LISTED = re.compile(r"name of channel (\d+)")
_TITLES = ("title", "type of the test", "laboratory test ref. number", "test name")


def detect(path: Path) -> bool:
    """Whether the path is a test header, or a folder that holds one."""
    if path.is_dir():
        return any(p.suffix.lower() == ".mme" for p in path.iterdir())
    return path.suffix.lower() == ".mme"


def read(path: Path) -> CrashRecord:
    """Read a test; samples are read when a channel is used.

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
        There is no header, or more than one; there is no channel; or a header is damaged.
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
                "io.listed-channels-not-folder",
                severity="note",
                file=index.name if index else head.name,
                quantity="channels",
                count=len(absent),
                count_2=len(listed),
                value_shown=shown,
            )
        )
    if not numbered:
        raise DataError("io.test-no-channel-files", file=head.name, quantity="channels")
    files = [read_mme_file(p, listed.get(n, ""), objects) for n, p in sorted(numbered.items())]
    names = unique([f.code or f.path.name for f in files])
    others = {
        f.code.upper(): (n, f) for n, f in reversed(list(zip(names, files, strict=True))) if f.code
    }
    facts = _facts(header, findings)
    findings += [f for file in files for f in _told(file, listed)]
    return CrashRecord(
        path=path,
        format="mme",
        title=next((t for k in _TITLES if (t := header.text(k))), clean(head.stem)),
        facts=facts,
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
            "io.folder-holds-tests" if heads else "io.no-mme-file",
            file=path.resolve().name,
            count=len(heads),
            held=held,
        )
    return heads[0]


def _folders(head: Path) -> list[Path]:
    """List the folders that may hold channels: Channel, and that of the header."""
    beside = head.parent
    named = sorted(p for p in beside.iterdir() if p.name.lower() == "channel" and p.is_dir())
    return [*named, beside]


def _inside(path: Path, head: Path) -> bool:
    """Whether a file is in the folder of the test, not linked from elsewhere."""
    return path.resolve().is_relative_to(head.parent.resolve())


def _left_out(path: Path) -> Finding:
    return Finding("io.left-out-link-file-outside", file=clean(path.name, LONGEST_NAME))


def _index(head: Path, findings: list[Finding]) -> tuple[Path | None, dict[int, str]]:
    """Read the channel index: its path, and the code of each channel number."""
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
                "io.no-index-channels-chn-files",
                file=head.name,
                quantity="channels",
                severity="note",
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
                "io.promises-channels-lists",
                file=index.name,
                row=header.line("number of channels"),
                quantity="number of channels",
                promised=promised,
                count=len(listed),
            )
        )
    return index, listed


def _numbered(head: Path, findings: list[Finding]) -> dict[int, Path]:
    """Find the channel files by their number."""
    for folder in _folders(head):
        found = [p for p in sorted(folder.iterdir()) if _NUMBERED.search(p.name) and p.is_file()]
        same = [p for p in found if p.stem.lower() == head.stem.lower()]
        stems = sorted({p.stem for p in found})
        tests = {p.stem.lower() for p in head.parent.iterdir() if p.suffix.lower() == ".mme"}
        if not same and (len(stems) > 1 or any(s.lower() in tests for s in stems)):
            shown = ", ".join(clean(s, 40) for s in stems[:6])
            raise DataError(
                "io.channels-other-tests-none-name",
                file=head.name,
                quantity="channels",
                value_shown=shown,
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


def _facts(header: MmeHeader, findings: list[Finding]) -> dict[str, str]:
    facts = {clean(key, LONGEST_NAME): header.text(key) for key in header.values}
    spoken = {
        "test": "laboratory test ref. number",
        "date": "date of the test",
        "laboratory": "laboratory name",
    }
    facts |= {name: header.text(key) for name, key in spoken.items()}
    if _objects(header) == 1:
        # The header's quantities are in SI units.
        for name, key in (
            ("mass_kg", "mass test object 1"),
            ("speed_m_per_s", "velocity test object 1"),
        ):
            try:
                value = header.number(key)
            except DataError as error:
                # Unusable data of the vehicle only affects the report: keep the record.
                fault = error.finding
                findings.append(
                    Finding(
                        "io.left-out-unusable",
                        file=fault.file,
                        row=fault.row,
                        quantity=fault.quantity,
                        reason=fault,
                    )
                )
                continue
            if value is not None:
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
                "io.channel-code-malformed" if file.code else "io.channel-code-missing",
                file=name,
                row=file.header.line("channel code"),
                quantity="channel code",
                word=file.code,
            )
        )
    if is_bad(file):
        told.append(
            Finding(
                "io.laboratory-gives-status",
                file=name,
                row=file.header.line("data status"),
                quantity=f"channel {file.code or name}",
                text=file.header.text("data status"),
            )
        )
    indexed = listed.get(number, "")
    if indexed and file.code and indexed.upper() != file.code.upper():
        told.append(
            Finding(
                "io.index-file-says-taken",
                file=name,
                row=file.header.line("channel code"),
                quantity="channel code",
                indexed=indexed,
                word=file.code,
            )
        )
    return told
