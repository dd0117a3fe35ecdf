"""From the files that a user names to the text of a case."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from strapdown.config.toml_text import named_from
from strapdown.errors import ConfigError, DataError, Finding
from strapdown.formats.crash_record import CrashRecord
from strapdown.formats.crash_records import read_crash_record
from strapdown.systems.crash_draft.draft import Draft, write_draft
from strapdown.systems.crash_draft.event_table import as_accelerations
from strapdown.systems.crash_draft.group_units import group_units
from strapdown.systems.crash_draft.known_path import KnownPath, known_path
from strapdown.systems.crash_draft.laboratory import laboratory_parts
from strapdown.systems.crash_draft.parts import Part, Skipped
from strapdown.systems.crash_draft.settle_units import settle_units
from strapdown.systems.crash_draft.table_parts import table_parts

__all__ = ["draft_case", "read_records"]


def read_records(paths: Sequence[str | Path]) -> list[CrashRecord]:
    """Read the records that a case shall be drafted of.

    Parameters
    ----------
    paths : sequence of str or Path

    Returns
    -------
    list of CrashRecord

    Raises
    ------
    ConfigError
        There is no such file, or one is named twice.
    DataError
        One cannot be read.
    """
    seen: dict[Path, str] = {}
    records = []
    for given in paths:
        record = read_crash_record(given)
        for file in record.files or (Path(given),):
            real = file.resolve()
            if real in seen:
                raise ConfigError(
                    "crash.record-named-twice-differently"
                    if seen[real] != str(given)
                    else "crash.record-named-twice",
                    file=file.name,
                    quantity="RECORD",
                    seen=seen[real],
                    given=given,
                )
        seen |= {file.resolve(): str(given) for file in record.files or (Path(given),)}
        records.append(record)
    return records


def draft_case(records: Sequence[CrashRecord], *, folder: str | Path = ".") -> Draft:
    """Draft a case of records.

    Parameters
    ----------
    records : sequence of CrashRecord
    folder : str or Path
        Of the case file, from which it names the records.

    Returns
    -------
    Draft
        Its text is TOML that `read_case_spec` takes when every ``"?"`` is answered.

    Raises
    ------
    DataError
        There is no record, or none holds an accelerometer; the message says what was found.
    """
    parts: list[Part] = []
    skipped: list[Skipped] = []
    settled: list[Part] = []
    findings: list[Finding] = []
    paths: list[KnownPath] = []
    for record in records:
        path = named_from(record.path, Path(folder))
        # What the reader concluded of the clock is stated in the case.
        findings += [f for f in record.findings if f.quantity != "time"]
        known = known_path(path, record)
        if known is not None:
            paths.append(known)
            continue
        tabular = all(c.samples is not None for c in record.channels)
        found, left = (table_parts if tabular else laboratory_parts)(path, record)
        skipped += left
        (parts if tabular else settled).extend(found)
    for part in settle_units(parts):
        settled.append(as_accelerations(part) if part.kind == "velocity" else part)
    units, more = group_units(settled)
    skipped += more
    if not units:
        raise _nothing(records, settled, skipped)
    facts = next((r.facts for r in records if r.facts), {})
    title = next((r.title for r in records if r.facts and r.title), "")
    return write_draft(units, skipped, title=title, facts=facts, findings=findings, paths=paths)


def _nothing(
    records: Sequence[CrashRecord], parts: Sequence[Part], skipped: Sequence[Skipped]
) -> DataError:
    told = [f"{', '.join(p.channels.values())}: {p.kind}" for p in parts]
    told += [f"{s.what}: {s.why}" for s in skipped]
    return DataError(
        "crash.no-accelerometer-found" if told else "crash.nothing-in-record",
        file=", ".join(r.path.name for r in records[:3]),
        parts=told[:8] + ["…"] * (len(told) > 8),
    )
