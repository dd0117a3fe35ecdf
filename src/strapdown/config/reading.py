"""Configuration files: read, resolve the files that they name, check, and report all faults."""

from __future__ import annotations

import difflib
import json
from collections.abc import Iterator, Mapping
from itertools import islice
from pathlib import Path, PurePosixPath
from typing import Any, ClassVar, Self

from pydantic import ValidationError

from strapdown.bundle import names_file
from strapdown.config.spec import Fault, Spec, faults_of, fields_at, located, refusal, written_path
from strapdown.config.toml_file import KeyPath, TomlFile, place_of, read_toml, shown, shown_key
from strapdown.errors import ConfigError, Finding

#: Value that only the user knows.
PLACEHOLDER = "?"
#: Stand for the folder and the name of a log, in the configuration of a campaign over logs.
OF_LOG = ("{folder}", "{stem}")
#: Above this number of open values they are counted, not listed.
MOST_OPEN = 60


class FileSpec(Spec):
    """Specification of a run, from a file or from plain data."""

    unwritten: ClassVar[tuple[str, ...]] = ("name",)
    #: Name in messages.
    called: ClassVar[str] = "run"
    #: Whether `faults` looks into files.
    looks_into_files: ClassVar[bool] = False

    name: str

    def faults(self) -> Iterator[Fault]:
        """Yield what its values contradict, beyond their form."""
        yield from ()

    @classmethod
    def checked(cls, table: Mapping[str, Any], file: TomlFile | None = None) -> Self:
        """Create a specification from plain data, as from a command or a sealed folder.

        `file`: the file that it was read from, for the lines of messages. ConfigError: keys are
        unknown or missing, values do not fit, or contradict each other; each with its key and a
        remedy.
        """
        return cls._checked(table, table if file is None else file.table, file)

    @classmethod
    def read(cls, path: str | Path, *, files: bool = True, **instead: Any) -> Self:
        """Read a configuration file; the specification is named after it.

        Parameters
        ----------
        path : str or Path
        files : bool
            Whether the files that it names must exist and become absolute paths.
        **instead
            Values that replace those of the file; None keeps them.

        Raises
        ------
        ConfigError
            The file is missing or not TOML, a value is still ``"?"``, or as `checked`; the message
            names the lines.
        """
        return cls.of_file(read_toml(Path(path)), files=files, **instead)

    @classmethod
    def of_file(cls, file: TomlFile, *, files: bool = True, **instead: Any) -> Self:
        """Return the specification of a file that was read, or is not written yet, as `read`."""
        if "name" in file.table:
            raise file.refuse(("name",), "config.named-after-file", kind=cls.called)
        _refuse_placeholders(file, cls)
        table, faults = _with_absolute_paths(file) if files else (file.table, [])
        given = {key: value for key, value in instead.items() if value is not None}
        named = {**table, **given, "name": file.path.stem}
        return cls._checked(named, {**file.table, **given}, file, faults, files)

    @classmethod
    def faults_of_stated(cls, file: TomlFile) -> list[Finding]:
        """Faults of the values of a file of which others are still ``"?"``, without its files."""
        open_keys = set(_open(file.table, ()))
        try:
            cls.model_validate({**file.table, "name": file.path.stem})
        except ValidationError as error:
            faults = faults_of(error, cls, file.table)
        else:
            return []
        found = []
        for fault in faults:
            path = written_path(file.table, fault.path)
            # A table with an open value may be wrong by it alone.
            if not any(key[: len(path)] == path[: len(key)] for key in open_keys):
                found.append(located(fault, file.table, file))
        return found

    @classmethod
    def _checked(
        cls,
        table: Mapping[str, Any],
        written: Mapping[str, Any],
        file: TomlFile | None,
        faults: list[Fault] | None = None,
        files: bool = True,
    ) -> Self:
        found = list(faults or ())
        there = {one.path for one in found}
        try:
            spec = cls.model_validate(table)
        except ValidationError as error:
            more = faults_of(error, cls, written)
        else:
            more = list(spec.faults()) if files or not cls.looks_into_files else []
        found += [one for one in more if one.path not in there]
        if found:
            raise refusal(found, written, file)
        return spec


# --- open values: known only to the user, written as a question mark ----------------------


def _refuse_placeholders(file: TomlFile, form: type[Spec]) -> None:
    # A vector with all components open counts as one.
    open_keys = list(dict.fromkeys(_open(file.table, ())))
    if not open_keys:
        return
    values = []
    for path in open_keys[:MOST_OPEN]:
        fields = fields_at(form, path)
        meaning = (fields[0].description if fields else None) or ""
        line, place = file.line(path), place_of(path)
        values.append(Finding("config.open-value", wanted=meaning, line=line, quantity=place))
    count = len(open_keys)
    code = "config.open-values" if count > 1 else "config.one-open-value"
    raise ConfigError(
        "config.many-open-values" if count > MOST_OPEN else code,
        file=file.path.name,
        count=count,
        more=count - len(values),
        values=values,
        placeholder=PLACEHOLDER,
    )


def _open(node: Any, path: KeyPath) -> Iterator[KeyPath]:
    if isinstance(node, dict):
        for key, value in node.items():
            yield from _open(value, (*path, key))
    elif isinstance(node, list):
        for k, value in enumerate(node):
            if isinstance(value, dict):
                yield from _open(value, (*path, k))
            else:
                yield from (path for _ in _open(value, path))
    elif isinstance(node, str) and node.strip() == PLACEHOLDER:
        yield path


# --- files that a configuration names, from its folder ------------------------------------

#: Largest number of names in a folder that are searched for a similar one.
MOST_NAMES = 10_000


def _with_absolute_paths(file: TomlFile) -> tuple[dict[str, Any], list[Fault]]:
    """The table, with an absolute path for every key that names a file."""
    faults: list[Fault] = []

    def resolved(node: Any, path: KeyPath) -> Any:
        if isinstance(node, dict):
            return {key: resolved(value, (*path, key)) for key, value in node.items()}
        if isinstance(node, list):
            return [resolved(value, (*path, k)) for k, value in enumerate(node)]
        # What cannot name a file is refused by the form.
        if not isinstance(node, str) or not node.isprintable() or not node.strip():
            return node
        # Of each log of a fleet: its path is known when the log is.
        if any(word in node for word in OF_LOG):
            return node
        key = next((k for k in reversed(path) if isinstance(k, str)), "")
        if not names_file(key, node):
            return node
        found = _find(file.path, path, node)
        if isinstance(found, str):
            return found
        faults.append(found)
        return node

    return {key: resolved(value, (key,)) for key, value in file.table.items()}, faults


def absolute_table(file: TomlFile) -> dict[str, Any]:
    """Return the table of a file with an absolute path for every key that names a file.

    ConfigError: a file that it names is missing; the message names the line.
    """
    table, faults = _with_absolute_paths(file)
    if faults:
        raise refusal(faults, file.table, file)
    return table


def _find(file: Path, path: KeyPath, given: str) -> str | Fault:
    wanted = file.parent.absolute() / given
    try:
        if wanted.exists():
            return str(wanted)
        kept = beside_sealed_case(file, path, given)
        if kept is not None:
            return str(kept)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        data = {"given": shown(given), "reason": reason}
        return Fault(path, "config.named-file-unreadable", data)
    try:
        names = [p.name for p in islice(wanted.parent.iterdir(), MOST_NAMES)]
    except (OSError, ValueError):
        names = []
    close = difflib.get_close_matches(wanted.name[:255], sorted(names), n=1)
    if close and close[0].isprintable():
        # With its folder as given, so that it can be pasted.
        folder = given.removesuffix(wanted.name) if given.endswith(wanted.name) else ""
        near = folder + close[0]
        data = {"given": shown(given), "near": near}
        return Fault(path, "config.named-file-missing-near", data)
    return Fault(path, "config.named-file-missing", {"given": shown(given)})


# Upper limit of the manifest size, bytes: one with hundreds of records is smaller.
LARGEST = 50_000_000


def beside_sealed_case(case: Path, key: KeyPath, given: str) -> Path | None:
    """Find the copy of a file that a case names, where the case is itself a copy.

    `case`: as ``FOLDER/inputs/case/case.toml``. `key`: of the value in the case. `given`: the
    value. None if the case is not in a sealed folder, or the folder has no copy for this
    key with this file name.
    """
    home = case.absolute().parent
    if home.parent.name != "inputs":
        return None
    root = home.parent.parent
    manifest = root / "manifest.json"
    try:
        if not manifest.is_file() or manifest.stat().st_size > LARGEST:
            return None
        node: Any = json.loads(manifest.read_text(encoding="utf-8"))["configuration"]["case"]
        for step in key:
            node = node[step]
        if not isinstance(node, str):
            return None
        kept = (root / node).resolve()
        if not kept.is_relative_to((root / "inputs").resolve()) or not kept.exists():
            return None
    except (OSError, ValueError, KeyError, IndexError, TypeError, RecursionError):
        return None
    # An edited case may name another record under this key.
    named = PurePosixPath(given.replace("\\", "/")).name
    return kept if kept.name in (named, PurePosixPath(given).parent.name) else None


# --- differences between two specifications, as text ---------------------------------------


def changed_options(
    before: Spec | Mapping[str, Any], after: Spec | Mapping[str, Any]
) -> tuple[str, ...]:
    """List the options that differ.

    Parameters
    ----------
    before, after : Spec or dict
        Specifications, or their stored plain data.

    Returns
    -------
    tuple of str
        Such as ``entry, speed_m_per_s: 7.1 before, 8.1 now``, in the order of `after`. Tables in a
        list are matched by name at any position, otherwise by number. A missing key equals None,
        and a list equals a tuple.
    """
    return tuple(_changed(_plain_data(before), _plain_data(after), ()))


def _plain_data(given: Any) -> Any:
    if isinstance(given, Spec):
        return _plain_data(given.model_dump())
    if isinstance(given, Mapping):
        return {str(key): _plain_data(value) for key, value in given.items()}
    if isinstance(given, list | tuple):
        return [_plain_data(value) for value in given]
    return given


def _changed(before: Any, after: Any, place: tuple[str, ...]) -> Iterator[str]:
    if isinstance(before, dict) and isinstance(after, dict):
        for key in dict.fromkeys((*after, *before)):
            inner = (*place, shown_key(key))
            yield from _changed(before.get(key), after.get(key), inner)
    elif _is_tables(before) and _is_tables(after) and (before or after):
        yield from _changed_list(before, after, place)
    # Python treats True as 1; a configuration does not.
    elif before != after or isinstance(before, bool) != isinstance(after, bool):
        where = ", ".join(place)
        # Tables are not written out.
        if before is None:
            now = "" if isinstance(after, dict) else f", {_shown_value(after)} now"
            yield f"{where}: not there before{now}"
        elif after is None:
            yield f"{where}: {_shown_value(before)} before, not there now"
        else:
            yield f"{where}: {_shown_value(before)} before, {_shown_value(after)} now"


def _changed_list(
    before: list[dict[str, Any]], after: list[dict[str, Any]], place: tuple[str, ...]
) -> Iterator[str]:
    one = place[-1].removesuffix("s")
    old, new = _by_name(before), _by_name(after)
    if old is None or new is None:
        old, new = dict(enumerate(before)), dict(enumerate(after))
    for name in dict.fromkeys((*new, *old)):
        said = f"{one} {name + 1}" if isinstance(name, int) else f"{one} {shown(name)}"
        if name not in old:
            yield f"{', '.join((*place[:-1], said))}: not there before"
        elif name not in new:
            yield f"{', '.join((*place[:-1], said))}: no longer there"
        else:
            yield from _changed(old[name], new[name], (*place[:-1], said))
    kept = [name for name in new if name in old]
    if kept != [name for name in old if name in new]:
        # Without combination, the first unit gives the main result.
        was = ", ".join(shown(name) for name in old if name in new)
        now = ", ".join(shown(name) for name in kept)
        yield f"order of {', '.join(place)}: {was} before, {now} now"


def _by_name(tables: list[dict[str, Any]]) -> dict[str | int, dict[str, Any]] | None:
    """Tables by name; None if a name is missing or repeated."""
    named = {table["name"]: table for table in tables if isinstance(table.get("name"), str)}
    return dict(named) if len(named) == len(tables) and "" not in named else None


def _is_tables(given: Any) -> bool:
    return isinstance(given, list) and all(isinstance(part, dict) for part in given)


def _shown_value(given: Any) -> str:
    return "a table" if isinstance(given, dict) else shown(given)
