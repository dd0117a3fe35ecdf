"""Sealed results as they are compared: their folders, resolved options, inputs and findings."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path, PurePosixPath
from typing import Any

from strapdown.bundle import (
    LARGEST,
    MANIFEST,
    TIMING,
    names_file,
    read_manifest,
    sha256,
    unsealed_changes,
)
from strapdown.errors import DataError, Finding
from strapdown.report.content import json_of

#: By command the JSON of its answer.
ANSWERS = {
    "navigate": "navigation.json",
    "align": "align.json",
    "attitude": "attitude.json",
    "crash": "crash.json",
    "outage": "outage.json",
    "allan": "allan.json",
    "calibrate": "calibrate.json",
    "extrinsics": "extrinsics.json",
    "doctor": "doctor.json",
    "sensors": "sensors.json",
    "simulate": "scenario.json",
    "campaign": "summary.json",
    "compare": "compare.json",
    "crash-live": "detections.json",
}
#: By command the table of its configuration that has the options.
OWN_TABLE = {
    "navigate": "navigation",
    "align": "alignment",
    "crash": "case",
    "outage": "outage",
    "allan": "allan",
    "calibrate": "calibrate",
    "extrinsics": "extrinsics",
    "doctor": "doctor",
    "sensors": "sensors",
    "campaign": "campaign",
}
#: Table of the run whose outage was predicted.
RUN = OWN_TABLE["navigate"]
#: Names and texts that describe a run and do not change it.
DESCRIPTIONS = ("title", "number", "author", "description")
#: Deepest table of a configuration, and longest word of a result that is compared.
DEEPEST, LONGEST = 24, 300
#: Digits of a digest that distinguish files of one name.
DIGITS = 8


@dataclass(frozen=True, eq=False)
class RunPart:
    """One sealed folder; a crash of several vehicles has one for each.

    Attributes
    ----------
    label : str
        ``vehicle 1``, … of several; empty for the only one.
    manifest : dict
        From `read_manifest`.
    seal : str
        SHA-256 of the manifest.
    changed : tuple of Finding
        Files that differ from the seal.
    """

    label: str
    root: Path
    manifest: dict[str, Any]
    seal: str
    changed: tuple[Finding, ...]

    def has(self, name: str) -> bool:
        """Whether a file is among the sealed results, and is there."""
        sealed = any(item["name"] == name for item in self.manifest["outputs"])
        return sealed and (self.root / name).is_file()

    def json(self, name: str) -> dict[str, Any]:
        """Return a file of the result as data; empty if the result has no such file.

        DataError: the file is damaged, or was removed.
        """
        path = self.root / name
        if not self.has(name):
            if any(item["name"] == name for item in self.manifest["outputs"]):
                raise DataError("compare.file-missing", file=str(path))
            return {}
        try:
            if path.stat().st_size > LARGEST:
                raise ValueError(f"{path.stat().st_size} bytes")
            found = json_of(path.read_text(encoding="utf-8"))
        except (ValueError, RecursionError) as error:
            raise DataError("compare.file-damaged", file=str(path), reason=error) from None
        if not isinstance(found, dict):
            raise DataError("compare.file-damaged", file=str(path), reason="no table")
        return found

    @property
    def files(self) -> tuple[Path, ...]:
        """Every file in the folder, with those beside the seal."""
        return tuple(sorted(p for p in self.root.rglob("*") if p.is_file()))

    @cached_property
    def answer(self) -> dict[str, Any]:
        """The JSON of the answer, as `json`."""
        return self.json(ANSWERS.get(self.manifest["command"], ""))


@dataclass(frozen=True, eq=False)
class SealedRun:
    """A result that is compared.

    Attributes
    ----------
    name : str
        Shown name: that of the folder or file, with the folder above it where two are alike.
    path : Path
        Its folder.
    ran : bool
        Whether it was run for the comparison: its folder is then a temporary one.
    """

    name: str
    path: Path
    parts: tuple[RunPart, ...]
    ran: bool = False

    @property
    def command(self) -> str:
        """Command that made it."""
        return str(self.parts[0].manifest["command"])

    @property
    def changed(self) -> tuple[Finding, ...]:
        """Files that differ from the seal."""
        return tuple(one for part in self.parts for one in part.changed)


def open_run(path: Path, name: str, *, ran: bool = False) -> SealedRun:
    """Open a result folder, and hold its files against its seal.

    A folder without a manifest that has those of vehicles, ``1``, ``2`` …, is one of a crash.

    DataError: it is not a folder of a result, its manifest is damaged, or it has symbolic links,
    which are not followed.
    """
    roots = [path]
    if not (path / MANIFEST).is_file() and (path / "1" / MANIFEST).is_file():
        numbers = (path / str(k) for k in range(1, 100))
        roots = [root for root in numbers if (root / MANIFEST).is_file()]
    several = len(roots) > 1
    parts = tuple(open_part(root, f"vehicle {root.name}" if several else "") for root in roots)
    return SealedRun(name, path, parts, ran)


def open_part(root: Path, label: str = "") -> RunPart:
    """Open one sealed folder; DataError as `open_run`."""
    manifest = read_manifest(root)
    # An input that is referred to may be any file of this machine; its digest is compared alone.
    own = [item for item in manifest["inputs"] if item["kept"] == "copy"]
    changed = unsealed_changes(root, {**manifest, "inputs": own})
    links = [str(one.file) for one in changed if one.code == "bundle.a-link"]
    if links:
        raise DataError("compare.links", file=str(root), names=links)
    return RunPart(label, root, manifest, sha256(root / MANIFEST), tuple(changed))


def shown_names(paths: Sequence[Path]) -> list[str]:
    """Return a name for each path: its last part, and as many parts above it as they need."""
    parts = [path.absolute().parts for path in paths]
    longest = max(map(len, parts), default=0)
    for count in range(1, longest):
        names = ["/".join(one[-count:]) for one in parts]
        if len(set(names)) == len(names):
            return names
    return [str(path) for path in paths]


# Options: the resolved configurations, side by side.


@dataclass(frozen=True)
class OptionRow:
    """An option that differs: its key, and its value in each run, None where it has none."""

    key: str
    values: tuple[Any, ...]


def option_rows(runs: Sequence[SealedRun]) -> tuple[tuple[OptionRow, ...], int]:
    """Return the options that differ, and how many are equal.

    Sealed configurations have every default, so that a default that one states is not a
    difference. The files of inputs are compared by `input_rows`; a file that stands for a name of
    a catalogue is compared by its digest. Of runs of different commands, the options that all
    have.
    """
    every = [options_of(run) for run in runs]
    several = len({run.command for run in runs}) > 1
    if several:
        every = [{k.removeprefix(f"{RUN}."): v for k, v in one.items()} for one in every]
    keys = list(dict.fromkeys(key for one in every for key in one))
    if several:
        keys = [k for k in keys if all(k in one for one in every) and k not in DESCRIPTIONS]
    rows, equal = [], 0
    for key in keys:
        values = tuple(one.get(key) for one in every)
        if all(_same(values[0], value) for value in values[1:]):
            equal += 1
        else:
            rows.append(OptionRow(key, tuple(_file_name(value) for value in values)))
    return tuple(rows), equal


@dataclass(frozen=True)
class _File:
    """A file that an option names."""

    name: str
    digest: str

    def __str__(self) -> str:
        return self.name


def _same(one: Any, other: Any) -> bool:
    if isinstance(one, _File) and isinstance(other, _File):
        return one.digest == other.digest
    # Python takes True for 1; a configuration does not.
    return bool(one == other) and isinstance(one, bool) == isinstance(other, bool)


def _file_name(value: Any) -> Any:
    return f"{value.name} (sha256 {value.digest[:DIGITS]}…)" if isinstance(value, _File) else value


def options_of(run: SealedRun) -> dict[str, Any]:
    """Return every option of a run by its key, without paths of inputs and the name of the folder.

    Keys are dotted, with the name or the number of a table of a list in brackets; a file that
    stands for a name of a catalogue, such as that of a sensor, has its name as text.
    """
    found: dict[str, Any] = {}
    for part in run.parts:
        whole = part.manifest["configuration"]
        if not isinstance(whole, dict):
            raise DataError("bundle.malformed", file=str(part.root / MANIFEST))
        digests = {item["name"]: item["sha256"] for item in part.manifest["inputs"]}
        own = OWN_TABLE.get(run.command, "")
        head = f"{part.label}: " if part.label else ""
        for name, value in whole.items():
            if name in ("name", "report", "pdf") or (part.label and name in ("partners", "number")):
                continue
            if isinstance(value, dict) and name in (own, RUN):
                value = {k: v for k, v in value.items() if k != "name"}
            place = "" if name == own else name
            found |= {f"{head}{k}": v for k, v in _leaves(value, place, name, digests, 0)}
    return found


def _leaves(
    value: Any, place: str, key: str, digests: Mapping[str, str], depth: int
) -> Iterator[tuple[str, Any]]:
    """Yield every value of a table with its key; tables of a list by their names, if they have."""
    if depth > DEEPEST:
        yield place, json.dumps(value)[:LONGEST]
    elif isinstance(value, dict):
        for name, item in value.items():
            inner = f"{place}.{name}" if place else name
            yield from _leaves(item, inner, name, digests, depth + 1)
    elif isinstance(value, list) and value and all(isinstance(one, dict) for one in value):
        names = [one.get("name") for one in value]
        named = all(isinstance(n, str) for n in names) and len(set(map(str, names))) == len(names)
        for k, one in enumerate(value):
            inner = {n: v for n, v in one.items() if n != "name"} if named else one
            at = f"{place}[{names[k] if named else k + 1}]"
            yield from _leaves(inner, at, key, digests, depth + 1)
        if named:
            yield f"{place}, order", [str(n) for n in names]
    elif names_file(key, value):
        if not key.endswith("path"):
            yield place, _File(PurePosixPath(value).name, digests.get(value, ""))
    elif value is not None:
        yield place, value


# Inputs: the same file by its digest, under another name, or with another content.


@dataclass(frozen=True)
class InputRow:
    """An input in each run, against that of the first run that has it.

    Attributes
    ----------
    files : tuple of (str, str, int) or None
        Name, SHA-256 and bytes in each run; None where it has no such input.
    status : tuple of str
        ``first``, ``same``, ``renamed``, ``changed`` or ``missing``.
    """

    role: str
    files: tuple[tuple[str, str, int] | None, ...]
    status: tuple[str, ...]

    @property
    def same(self) -> bool:
        """Whether all runs read the same bytes."""
        return set(self.status) <= {"first", "same", "renamed"}


def input_rows(runs: Sequence[SealedRun]) -> tuple[InputRow, ...]:
    """Pair the inputs of the runs: by role, then by digest, by name, and by order."""
    every = [_inputs(run) for run in runs]
    rows = []
    for role in dict.fromkeys(role for one in every for role in one):
        table: list[list[tuple[str, str, int] | None]] = []
        for k, one in enumerate(every):
            left = list(one.get(role, ()))
            for row in table:
                row.append(None)
            for alike in (1, 0, None):
                for row in table:
                    if row[k] is None:
                        first = next(f for f in row if f is not None)
                        row[k] = _taken(left, first, alike)
            table += [[*(None for _ in range(k)), file] for file in left]
        rows += [InputRow(role, tuple(row), _status(row)) for row in table]
    return tuple(rows)


def _taken(
    left: list[tuple[str, str, int]], wanted: tuple[str, str, int], alike: int | None
) -> tuple[str, str, int] | None:
    """Take the first file that is alike in its digest (1) or its name (0), or the first."""
    for file in left:
        if alike is None or file[alike] == wanted[alike]:
            left.remove(file)
            return file
    return None


def _status(row: Iterable[tuple[str, str, int] | None]) -> tuple[str, ...]:
    first: tuple[str, str, int] | None = None
    out = []
    for file in row:
        if file is None:
            out.append("missing")
        elif first is None:
            first = file
            out.append("first")
        elif file[1] != first[1]:
            out.append("changed")
        else:
            out.append("same" if file[0] == first[0] else "renamed")
    return tuple(out)


def _inputs(run: SealedRun) -> dict[str, list[tuple[str, str, int]]]:
    found: dict[str, list[tuple[str, str, int]]] = {}
    for part in run.parts:
        for item in part.manifest["inputs"]:
            role = str(item.get("role", "input"))
            role = f"{part.label}: {role}" if part.label else role
            name = PurePosixPath(item["name"].replace("\\", "/")).name
            found.setdefault(role, []).append((name, item["sha256"], item["bytes"]))
    return found


# Versions and platform.


@dataclass(frozen=True)
class Condition:
    """A version, or a property of the machine, that differs: its value in each run."""

    name: str
    values: tuple[str | None, ...]


def conditions(runs: Sequence[SealedRun]) -> tuple[Condition, ...]:
    """Return versions and platform that differ; other installed packages are counted."""
    every = []
    for run in runs:
        manifest = run.parts[0].manifest
        machine = {f"platform, {k}": v for k, v in manifest["platform"].items()}
        every.append({**manifest["versions"], **machine})
    rows = [
        Condition(name, tuple(one.get(name) for one in every))
        for name in dict.fromkeys(name for one in every for name in one)
    ]
    found = [row for row in rows if len(set(row.values)) > 1]
    first = set(runs[0].parts[0].manifest["environment"])
    known = {name.lower() for one in every for name in one}
    counts = []
    for run in runs:
        other = first ^ set(run.parts[0].manifest["environment"])
        counts.append(len({line.partition("==")[0] for line in other} - known))
    if any(counts):
        words = ["", *(f"{n} others" if n else "as the first" for n in counts[1:])]
        found.append(Condition("further packages", tuple(w or None for w in words)))
    return tuple(found)


# Findings of the runs.


@dataclass(frozen=True)
class FoundCode:
    """A finding of the runs.

    Attributes
    ----------
    counts : tuple of int
        How often each run has it.
    sentence : str
        Of the first, as the result has it; for people.
    """

    code: str
    severity: str
    counts: tuple[int, ...]
    sentence: str

    @property
    def differs(self) -> bool:
        """Whether some runs have it and others do not."""
        return any(self.counts) and not all(self.counts)


def found_codes(runs: Sequence[SealedRun]) -> tuple[FoundCode, ...]:
    """Return the findings of all runs by their codes."""
    counts: dict[str, list[int]] = {}
    said: dict[str, tuple[str, str]] = {}
    for k, run in enumerate(runs):
        for part in run.parts:
            for one in _findings(part.answer):
                code = str(one.get("code", ""))[:LONGEST]
                sentence = str(one.get("sentence", ""))[: 4 * LONGEST]
                said.setdefault(code, (str(one.get("severity", ""))[:20], sentence))
                counts.setdefault(code, [0] * len(runs))[k] += 1
    return tuple(FoundCode(c, said[c][0], tuple(counts[c]), said[c][1]) for c in counts)


def _findings(answer: Mapping[str, Any]) -> Iterator[Mapping[str, Any]]:
    """Yield the findings of a result, then those of its verdict that are not among them."""
    places = [answer.get("findings"), answer.get("between")]
    for log in answer.get("logs", ()) if isinstance(answer.get("logs"), list) else ():
        if isinstance(log, dict):
            places += [log.get(key) for key in ("questions", "faults", "notes")]
    seen = set()
    trust = answer.get("trust")
    places.append(trust.get("against") if isinstance(trust, dict) else None)
    for k, place in enumerate(places):
        for one in place if isinstance(place, list) else ():
            if not isinstance(one, dict) or not isinstance(one.get("code"), str):
                continue
            if k + 1 < len(places) or one["code"] not in seen:
                yield one
            if k + 1 < len(places):
                seen.add(one["code"])


# Times, which are outside of the seal.


def seconds(run: SealedRun) -> dict[str, float]:
    """Return the seconds of each stage; empty where they were not recorded."""
    found: dict[str, float] = {}
    for part in run.parts:
        try:
            path = part.root / TIMING
            if path.stat().st_size > LARGEST:
                continue
            stages = json_of(path.read_text(encoding="utf-8"))["seconds"]
            for stage, value in stages.items():
                if isinstance(value, int | float) and 0.0 <= value < 1e9:
                    found[str(stage)[:LONGEST]] = found.get(stage, 0.0) + float(value)
        except (OSError, ValueError, RecursionError, KeyError, TypeError, AttributeError):
            continue
    return found
