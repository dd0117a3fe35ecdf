"""What was noticed in the records of a case, and what a record says of itself."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from strapdown.errors import Finding
from strapdown.formats.crash_record import CrashRecord
from strapdown.report.crash_values import MEAN
from strapdown.systems.crash_case import CaseResult

__all__ = ["notes", "record_facts"]

# A number whose digits beyond the sixth tell nothing, as 15.858333333.
LONG = re.compile(r"-?\d+\.\d{5,}")
# Keys of a record that end with their unit.
UNITS = {"_m_per_s": "m/s", "_kg": "kg", "_m": "m", "_deg": "deg"}


def notes(
    findings: Sequence[Finding], result: CaseResult, *, remedies: bool = True
) -> tuple[tuple[str, str], ...]:
    """Return findings as items, one for all files and recorders of which the same is said.

    Parameters
    ----------
    findings : sequence of Finding
    result : CaseResult
        Whose mean of the recorders is called that.
    remedies : bool
        Whether each says what can be done about it.

    Returns
    -------
    tuple of (str, str)
        Where, and what, with what can be done about it.
    """
    combined = result.reconstruction.combined
    told: dict[tuple[str, str], list[str]] = {}
    alike_by: dict[tuple[str, str], Finding] = {}
    for finding in findings:
        file = finding.file or ""
        if combined is not None:
            file = file.replace(combined.name, MEAN)
        rest = [
            None if finding.row is None else f"row {finding.row}",
            None if finding.line is None else f"line {finding.line}",
            finding.quantity,
        ]
        remedy = finding.advice("file") or "" if remedies else ""
        text = _sentence(finding.sentence("file")) + (f" {_sentence(remedy)}" if remedy else "")
        place = ", ".join(r for r in rest if r)
        key = place, text
        alike = [k for k in told if _alike(alike_by[k], finding)]
        alike_by[key] = finding
        if file == MEAN and alike:
            # What differs from the mean's in its numbers alone is said once, with those of it.
            files = [f for k in alike for f in told.pop(k)]
            told[key] = [*files, file]
        else:
            told.setdefault(key, []).append(file)
    return tuple(
        (": ".join(p for p in (_places(files), place) if p), text)
        for (place, text), files in told.items()
    )


def _alike(first: Finding, second: Finding) -> bool:
    """Whether two say the same with other numbers."""
    return (
        first.code == second.code
        and first.quantity == second.quantity
        and _words(first.data) == _words(second.data)
    )


def _words(data: object) -> object:
    """Return data without their numbers."""
    if isinstance(data, Mapping):
        return {key: _words(value) for key, value in data.items()}
    if isinstance(data, tuple):
        return tuple(_words(value) for value in data)
    if isinstance(data, Finding):
        return data.code, _words(data.data)
    return None if isinstance(data, int | float) else data


def _places(files: Sequence[str]) -> str:
    named = list(dict.fromkeys(f for f in files if f))
    if len(named) > 1 and named[-1] == MEAN:
        return f"{MEAN}, and each by itself"
    return ", ".join(named)


def _sentence(text: str) -> str:
    found = text.strip()
    return found[:1].upper() + found[1:] + ("" if found.endswith((".", "!", "?")) else ".")


def record_facts(record: CrashRecord) -> tuple[tuple[str, str], ...]:
    """Return what a record says of the test, once, with units.

    Parameters
    ----------
    record : CrashRecord

    Returns
    -------
    tuple of (str, str)
        Empty where it says nothing but the name of its file.
    """
    rows = []
    if record.title and record.title != record.path.stem:
        rows.append(("title", record.title))
    for key, value in record.facts.items():
        name, unit = str(key), ""
        for ending, symbol in UNITS.items():
            if name.endswith(ending):
                name, unit = name.removesuffix(ending), f" {symbol}"
                break
        rows.append((name.replace("_", " "), LONG.sub(_short, str(value)) + unit))
    return tuple(rows)


def _short(found: re.Match[str]) -> str:
    return f"{float(found.group()):.6g}"
