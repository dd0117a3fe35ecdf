"""Configurations in the studio: proposed from files, checked, changed key by key, and run.

A configuration is the text of a TOML file, as ``strapdown init`` writes it; a change of a key keeps
every comment. Commands that are configured by options alone have a file of the same kind here, of
which `command_of` makes the options.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import tomlkit
from tomlkit.exceptions import TOMLKitError

from strapdown.bundle import named_paths, names_file
from strapdown.config.reading import FileSpec
from strapdown.config.toml_file import (
    DEEPEST,
    KeyPath,
    TomlFile,
    key_lines,
    parse_toml,
    place_of,
)
from strapdown.config.toml_text import Asked
from strapdown.errors import ConfigError, DataError, Finding, check_choice
from strapdown.studio.folder import Folder, plain_name
from strapdown.studio.kinds import KINDS, Kind
from strapdown.studio.questions import offered_question, open_question
from strapdown.studio.reading_process import told

#: Configurations of the folder that are offered at most.
MOST_READY = 5
#: Code of a value that is still a question mark.
OPEN = "config.open-value"
#: Longest text of a configuration, characters; keys that are changed at once.
LONGEST, MOST = 1 << 20, 200


def propose(
    folder: Path,
    kind: str,
    names: Sequence[str],
    log: Mapping[str, Any],
    axes: str | None,
    answers: Mapping[str, Any],
) -> dict[str, Any]:
    """Propose a configuration from files of the folder.

    Parameters
    ----------
    folder : Path
        Of the studio.
    kind : str
        Of `KINDS`.
    names : sequence of str
        Of files in the folder.
    log : mapping
        Keys of ``[log]``: how the files are read, and the part to use.
    axes : str, optional
    answers : mapping
        Values by key path, which are set in what is proposed.

    Returns
    -------
    dict
        ``toml``, ``questions``, ``findings``; ``found``: what it rests on; ``others``: of further
        vehicles. ``choose``: questions about the files, without whose answers ``toml`` is empty;
        ``ready``: configurations in the folder that read these files and have no fault, the latest
        first: ``name``, ``title``, ``what``, ``toml``; ``offers``: whether tables apply that are
        comments; ``again``: questions whose answers are keys of ``[log]`` for another proposal.
    """
    one = _kind(kind)
    place = Folder(folder)
    paths = [place.file(name) for name in names]
    if not paths:
        raise ConfigError("studio.nothing-named")
    drafts = one.draft([path.relative_to(place.path) for path in paths], dict(log), axes)
    first, *others = drafts
    text = edited(first.text, answers)
    return {
        "toml": text,
        "questions": [q for q in _questions(text, first.asked) if q["key"] not in answers],
        "to_check": _questions(text, first.to_check),
        "assumed": _questions(text, _assumed(text, first.to_check)),
        "findings": [told(finding) for finding in first.findings],
        "found": list(first.found),
        "choose": list(first.choose),
        "ready": list(_ready(place, one, names)),
        "offers": [offered_question(one) for one in first.offers],
        "again": list(first.again),
        "others": [
            {"toml": other.text, "name": str(other.name or k)}
            for k, other in enumerate(others, start=2)
        ],
    }


def _ready(place: Folder, kind: Kind, names: Sequence[str]) -> Iterator[dict[str, Any]]:
    """Yield the configurations of the folder for such a run over these files."""
    root = [Path(one.path) for one in place.entries()]
    folders = {path if path.is_dir() else path.parent for path in map(place.file, names)}
    beside = [path for one in folders - {place.path} for path in one.glob("*.toml")]
    written = [path for path in (*root, *beside) if path.suffix == ".toml"]
    count = 0
    for path in sorted(written, key=lambda one: one.stat().st_mtime, reverse=True)[:MOST]:
        with suppress(ConfigError, DataError, OSError, UnicodeDecodeError):
            if path.stat().st_size > LONGEST:
                continue
            text = path.read_text(encoding="utf-8")
            if path.parent != place.path:
                text = _from_root(place, path, text)
            table = parse_toml(path, text).table
            read = [Path(name) for name in named_paths(table)]
            if not any(one.is_relative_to(name) for one in read for name in names):
                continue
            spec = checked(place.path, kind, text, path.stem)
            said = {key: str(getattr(spec, key, "") or "") for key in ("title", "description")}
            yield {
                "name": place.name_of(path),
                "title": said["title"],
                "what": said["description"],
                "toml": text,
            }
            count += 1
        if count == MOST_READY:
            return


def _from_root(place: Folder, path: Path, text: str) -> str:
    """Return a configuration in a folder with its files named from that of the studio."""
    table, inside = parse_toml(path, text).table, place.name_of(path.parent)
    document = tomlkit.parse(text)
    for keys, value in _flat(table, ()):
        if names_file(str(keys[-1]), value):
            _change(document, dotted(keys), f"{inside}/{value}", tomlkit.table)
    return tomlkit.dumps(document)


def check(
    folder: Path, kind: str, toml: str, changes: Mapping[str, Any], name: str = ""
) -> dict[str, Any]:
    """Change keys of a configuration, and say what is wrong with it.

    Returns
    -------
    dict
        ``toml``; ``values`` by key path, as they are written; ``was``: those that were found before
        they were set by hand; ``errors``: line, key, path, text and remedy; ``name``: what is wrong
        with the name of the run, or None.
    """
    one = _kind(kind)
    refused = refused_name(name)
    named = None if refused is None else told(refused)
    text = edited(toml, changes)
    errors: list[dict[str, Any]] = []
    try:
        table = parse_toml(_path(folder, name), text).table
    except ConfigError as error:
        faults = list(_faults(error.finding, {}))
        return {"toml": text, "values": {}, "was": {}, "errors": faults, "name": named}
    try:
        checked(folder, one, text, name)
    except ConfigError as error:
        errors = list(_faults(error.finding, key_lines(text)))
        if any(one["code"] == OPEN for one in errors):
            for fault in one.form.faults_of_stated(parse_toml(_path(folder, name), text)):
                errors += _faults(fault, key_lines(text))
    values = {dotted(path): value for path, value in _flat(table, ())}
    was = _found_before(text)
    return {"toml": text, "values": values, "was": was, "errors": errors, "name": named}


def dotted(path: KeyPath) -> str:
    """Return a key path as the front end writes it: ``units.0.position_m``."""
    return ".".join(map(str, path))


def command(
    folder: Path, kind: str, name: str, toml: str, options: Sequence[str]
) -> dict[str, Any]:
    """Return the command that runs a configuration, as words after ``strapdown``.

    ``file`` is the name of the configuration file that it reads; empty if it reads none.
    ConfigError: the configuration is wrong, or an option is not of this command.
    """
    one = _kind(kind)
    for option in options:
        check_choice("studio.unknown-option", one.options, quantity=kind, option=option)
    spec = checked(folder, one, toml, name)
    words, file = one.command(spec, name)
    return {"words": [*words, "--out", name, *dict.fromkeys(options)], "file": file}


def checked(
    folder: Path, kind: Kind, toml: str, name: str = "", changes: Mapping[str, Any] | None = None
) -> FileSpec:
    """Return the specification of a configuration whose files are in the folder.

    `changes`: values that replace those of the text, as `edited`, in less time. ConfigError: it is
    wrong, or names a file outside of the folder.
    """
    file = parse_toml(_path(folder, name), _short(toml))
    for place, value in (changes or {}).items():
        _change(file.table, place, value, dict)
    refuse_outside(Folder(folder), file)
    return kind.form.of_file(file)


def refuse_outside(place: Folder, file: TomlFile) -> None:
    """Refuse a configuration that names a file outside of the folder: ConfigError."""
    for name in named_paths(file.table):
        place.refuse_outside(name, "path")
    # Any other text may be the name of a file, too, for a key that takes words or a file.
    for path, value in _flat(file.table, ()):
        for text in value if isinstance(value, list) else [value]:
            if isinstance(text, str) and _exists(place.path, text):
                place.refuse_outside(text, dotted(path))


def _exists(folder: Path, text: str) -> bool:
    try:
        return len(text) < 1000 and (folder / text).exists()
    except (OSError, ValueError):
        return False


def edited(text: str, changes: Mapping[str, Any]) -> str:
    """Return the text of a TOML file with values changed; comments and order are kept.

    Parameters
    ----------
    text : str
    changes : mapping of str to object
        By key path, ``aiding.gnss.lever_arm_m`` or ``units.0.position_m``; None removes the key.

    Notes
    -----
    A comment that says how a value was found, measured or assumed is no longer true of another: it
    then says that the value was set by hand, and what it was. With its former value the former
    line returns.

    Raises
    ------
    ConfigError
        The text is not TOML, or a path leads through what is not a table.
    """
    _short(text)
    if not changes:
        return text
    if len(changes) > MOST:
        raise ConfigError("studio.request-too-large")
    # It refuses what is nested too deep for the other parser.
    parse_toml(Path("configuration.toml"), text)
    try:
        document = tomlkit.parse(text)
        for place, value in changes.items():
            _set_by_hand(document, place, value, text)
        return tomlkit.dumps(document)
    except (TOMLKitError, RecursionError, ValueError, TypeError) as error:
        reason = str(error)[:200] or type(error).__name__
        raise ConfigError("studio.not-changed", reason=reason) from None


#: How a proposal, or the case of a simulation, begins the remark on where a value is from.
GROUNDS = re.compile(r"# *(?:found|assumed|yours): ")
#: The remark beside a value that was set by hand: what it was, as TOML, and its former remark.
BY_HAND = re.compile(
    r"# set by hand; was (?P<was>.+?)(?:, (?P<remark>(?:found|assumed|yours): .*))?$"
)
#: Part of a remark on a value that only a person can state.
OWN = "only you know"


def _set_by_hand(document: Any, place: str, value: Any, text: str) -> None:
    """Set or remove one value of a document, and keep the remark beside it true."""
    before = _item(document, place)
    literal = "" if before is None else before.as_string().strip()
    if before is not None and value is not None and _equal(_plain(document, place), value):
        return
    _change(document, place, value, tomlkit.table)
    after = _item(document, place)
    if before is None or after is None:
        return
    remark, former = after.trivia.comment, BY_HAND.match(before.trivia.comment)
    if former is not None:
        was = _literal(former["was"])
        if was is None or not _equal(was.unwrap(), after.unwrap()):
            return
        owner, key = _owner(document, place)
        trivia = after.trivia
        owner[key] = was
        again = owner.item(key) if hasattr(owner, "item") else owner[key]
        again.trivia.comment = f"# {former['remark']}" if former["remark"] else ""
        again.trivia.comment_ws = trivia.comment_ws if former["remark"] else ""
    elif "?" in literal or OWN in remark or "\n" in literal:
        return  # An answer, which nothing was known of.
    elif GROUNDS.match(remark):
        after.trivia.comment = f"# set by hand; was {literal}, {remark.lstrip('# ')}"
    elif not remark and _grounds_above(text, place):
        after.trivia.comment_ws, after.trivia.comment = "  ", f"# set by hand; was {literal}"


def _owner(document: Any, place: str) -> tuple[Any, str | int]:
    """Return the table that holds the value of a path, and its key there.

    A number of a list has no remark of its own: then the list is meant.
    """
    parts = [_part(part) for part in place.split(".")]
    while isinstance(parts[-1], int) and len(parts) > 1:
        parts.pop()
    node = document
    for part in parts[:-1]:
        node = node[part]
    return node, parts[-1]


def _item(document: Any, place: str) -> Any:
    """Return the value of a path with its remark; None: there is none, or it is a table."""
    try:
        owner, key = _owner(document, place)
        found = owner.item(key) if hasattr(owner, "item") else owner[key]
    except (KeyError, IndexError, TypeError, TOMLKitError):
        return None
    return None if isinstance(found, dict) or not hasattr(found, "trivia") else found


def _plain(document: Any, place: str) -> Any:
    """Return the value of a path, itself a number of a list, or None."""
    node = document
    try:
        for part in place.split("."):
            node = node[_part(part)]
    except (KeyError, IndexError, TypeError):
        return None
    return node.unwrap() if hasattr(node, "unwrap") else node


def _equal(one: Any, other: Any) -> bool:
    """Whether two values are the same; a number may be written with a point or without."""
    if isinstance(one, list) and isinstance(other, list):
        return len(one) == len(other) and all(map(_equal, one, other))
    return isinstance(one, bool) == isinstance(other, bool) and bool(one == other)


def _literal(text: str) -> Any:
    """Return a value as it is written; None: it is none."""
    try:
        return tomlkit.value(text)
    except (TOMLKitError, ValueError):
        return None


def _grounds_above(text: str, place: str) -> bool:
    """Whether the comment right above a value says how it was found or assumed."""
    lines = text.split("\n")
    numbers = {dotted(path): found for path, found in key_lines(text).items()}.get(place, ())
    for k in range(min(numbers, default=1) - 2, -1, -1):
        if not lines[k].startswith("#"):
            break
        if GROUNDS.match(lines[k]):
            return True
    return False


def _found_before(text: str) -> dict[str, Any]:
    """Return the values that were found before others were set by hand, by key path."""
    lines = text.split("\n")
    found: dict[str, Any] = {}
    for path, numbers in key_lines(text).items():
        if not numbers or not path or isinstance(path[-1], int):
            continue
        former = BY_HAND.search(lines[numbers[0] - 1])
        was = None if former is None else _literal(former["was"])
        if was is not None:
            found[dotted(path)] = was.unwrap()
    return found


def _change(document: Any, place: str, value: Any, new: Callable[[], Any]) -> None:
    """Set or remove one value; `new` makes a table that is missing."""
    *tables, key = [_part(part) for part in place.split(".")]
    if len(tables) >= DEEPEST or key == "":
        raise ConfigError("studio.no-such-key", quantity=place[:100])
    node: Any = document
    for part in tables:
        if isinstance(part, int) or part in node:
            node = _at(node, part, place)
        elif value is None:
            return
        else:
            node[part] = new()
            node = node[part]
    if not isinstance(node, dict | list) or isinstance(node, list) != isinstance(key, int):
        raise ConfigError("studio.no-such-key", quantity=place[:100])
    if isinstance(node, list):
        _at(node, key, place)
    elif value is None and key not in node:
        return
    table: Any = node
    if value is None:
        del table[key]
    else:
        table[key] = value


def _part(part: str) -> str | int:
    return int(part) if part.isdecimal() and len(part) < 6 else part


def _at(node: Any, part: str | int, place: str) -> Any:
    if isinstance(node, list) and isinstance(part, int) and part < len(node):
        return node[part]
    if isinstance(node, dict) and isinstance(part, str) and part in node:
        return node[part]
    raise ConfigError("studio.no-such-key", quantity=place[:100])


def _kind(kind: str) -> Kind:
    check_choice("studio.unknown-kind", KINDS, quantity="kind", kind=kind)
    return KINDS[kind]


def _path(folder: Path, name: str) -> Path:
    """Path of a file that is not written: its name is that of the run, its folder the studio's.

    A name that cannot be one is not used: paths of the configuration begin at the studio's folder.
    """
    return folder / f"{name if name and refused_name(name) is None else 'configuration'}.toml"


def refused_name(name: str) -> Finding | None:
    """Return what is wrong with the name of a run; None: it is valid, or not yet written."""
    try:
        plain_name(name or "run")
    except ConfigError as error:
        return error.finding
    return None


def _short(text: str) -> str:
    if len(text) > LONGEST:
        raise ConfigError("studio.request-too-large")
    return text


def _flat(node: Any, path: KeyPath) -> Iterator[tuple[KeyPath, Any]]:
    """Yield every value by its path; lists of values are values."""
    if isinstance(node, dict):
        for key, value in node.items():
            yield from _flat(value, (*path, key))
    elif isinstance(node, list) and any(isinstance(part, dict) for part in node):
        for k, value in enumerate(node):
            yield from _flat(value, (*path, k))
    else:
        yield path, json.loads(json.dumps(node, default=str))


def _faults(finding: Finding, lines: Mapping[KeyPath, Sequence[int]]) -> Iterator[dict[str, Any]]:
    """Yield each fault of a configuration with its line and key; `lines`: as `key_lines`."""
    paths = {place_of(path): path for path in lines}
    several = finding.data.get("faults") or finding.data.get("values") or ()
    found = [one for one in several if isinstance(one, Finding)] or [finding]
    for one in found:
        said = told(one)
        yield {
            "line": one.line,
            "key": one.quantity,
            "path": dotted(paths[one.quantity]) if one.quantity in paths else None,
            "code": one.code,
            "text": said["text"],
            "remedy": said["remedy"],
        }


#: An example in the remark on a value: a text, a list, or numbers and what they are of.
EXAMPLE = re.compile(r"\be\.g\. (\"[^\"]*\"|\[[^\]]*\]|-?\d[^;:]*)")


def _questions(text: str, asked: Sequence[Asked]) -> list[dict[str, Any]]:
    """Return open values of a text as questions, each with its key path."""
    written = text.split("\n")
    found = []
    by_line = _paths_by_line(text)
    for one in asked:
        paths = [p for p in by_line.get(one.line, []) if p and p[-1] == one.key]
        key = dotted(paths[0]) if paths else one.key
        line = written[one.line - 1] if one.line <= len(written) else ""
        count = line.partition("#")[0].count("?") or 1
        example = EXAMPLE.search(_remark(written, one.line))
        said = "" if example is None or "e.g." in one.what else example[1].strip('"')
        value = _literal(line.partition("=")[2].partition("  # ")[0].strip())
        question = open_question(one, key, unit_of_key(one.key), count, said)
        found.append({**question, "open": None if value is None else value.unwrap()})
    return found


def _paths_by_line(text: str) -> dict[int, list[KeyPath]]:
    found: dict[int, list[KeyPath]] = {}
    for path, numbers in key_lines(text).items():
        for number in numbers:
            found.setdefault(number, []).append(path)
    return found


def _remark(written: Sequence[str], line: int) -> str:
    """Return the remark beside the value of a line, or without one the comment right above it."""
    beside = written[line - 1].rpartition("  # ")[2] if "  # " in written[line - 1] else ""
    above: list[str] = []
    for one in reversed(written[: line - 1]):
        # The source of a value begins a remark; without that a remark is of the line alone.
        if beside or not one.startswith("# ") or (above and REMARK.match(above[0])):
            break
        above.insert(0, one)
    return beside or " ".join(one.removeprefix("# ") for one in above)


#: How a remark begins that is more than words.
REMARK = re.compile(rf"# *(?:found|assumed|yours|{OWN})")


def _assumed(text: str, confirmed: Sequence[Asked]) -> list[Asked]:
    """Return what a proposal assumes and does not ask to confirm."""
    written, known = text.split("\n"), {one.line for one in confirmed}
    found = []
    for line, paths in _paths_by_line(text).items():
        said = re.match(r"assumed\b[:,]? ?(.*)", _remark(written, line))
        if said and paths[0] and line not in known and " = " in written[line - 1]:
            found.append(Asked(line, str(paths[0][-1]), said[1]))
    return found


def unit_of_key(key: str) -> str:
    """Return the unit in the name of a key, as a person writes it; empty if there is none."""
    from strapdown.studio.forms import unit_of

    return unit_of(key)
