"""The catalogue of sentences and the code that names its entries fit each other."""

from __future__ import annotations

import ast
import re
import string
import tomllib
from collections import defaultdict
from pathlib import Path

import pytest

from strapdown import errors
from strapdown.errors import Finding

SOURCE = Path(__file__).parents[2] / "src" / "strapdown"
CATALOGUE = {
    f"{file.stem}.{code}": entry
    for file in sorted((SOURCE / "messages").glob("*.toml"))
    for code, entry in tomllib.loads(file.read_text(encoding="utf-8")).items()
}
ROOMS = {file.stem for file in (SOURCE / "messages").glob("*.toml")}
CODE = re.compile(r"[a-z_]+\.[a-z0-9]+(?:-[a-z0-9]+)*")
PARTS = {
    "what",
    "remedy",
    *(f"{p}_{w}" for p in ("what", "remedy") for w in ("cli", "file", "studio")),
}
LOCATION = {"severity", "file", "row", "quantity", "line", "data"}
#: Entries whose data have a `nearest` of another meaning.
OWN_NEAREST = {"attitude.hz-asked-hz"}
#: Functions that append a finding to their first argument; its code is the second.
APPENDED = {"add_note", "add_warning"}
RAISED = {"Finding", "DataError", "ConfigError", "DivergenceError", "check_choice", *APPENDED}
#: Methods of logs, headers and channels that add no more than the location to a code and data.
LOCATED = {"fault", "_fault", "note", "warn"}


def _name(node: ast.Call) -> str:
    return str(getattr(node.func, "id", getattr(node.func, "attr", "")))


def _first(node: ast.Call) -> ast.expr:
    """The argument that is, or chooses, the code."""
    return node.args[_name(node) in APPENDED]


@pytest.fixture(scope="module")
def raised(nodes):
    """Every call that names a code: path, node."""
    return [
        (path, node)
        for path, inside in nodes.items()
        for node in inside
        if isinstance(node, ast.Call) and node.args
        if _name(node) in (RAISED | LOCATED if isinstance(node.func, ast.Attribute) else RAISED)
    ]


def _is_code(text: object) -> bool:
    return isinstance(text, str) and bool(CODE.fullmatch(text)) and text.split(".")[0] in ROOMS


def _codes(node: ast.AST) -> list[str]:
    return [n.value for n in ast.walk(node) if isinstance(n, ast.Constant) and _is_code(n.value)]


def _placeholders(template: str) -> set[str]:
    names = set()
    for _, name, spec, _ in string.Formatter().parse(template):
        if name is not None:
            names.add(name.split(".")[0])
            names |= _placeholders(spec or "")
    return names


def test_every_entry_says_something_in_known_words():
    for code, entry in CATALOGUE.items():
        assert CODE.fullmatch(code), code
        assert entry["what"].strip(), code
        assert set(entry) <= PARTS, code


#: Rooms of which a page of the studio shows messages, and those of them that it cannot meet: they
#: are of writing logs, of simulations, and of what only a command line or a server's start takes.
OF_STUDIO = {
    *("alignment", "allan", "attitude", "bundle", "calibrate", "config", "crash", "doctor", "dsp"),
    *("estimation", "geodesy", "io", "mechanization", "navigation", "prefilter", "sensors"),
    "tables",
}
NEVER_MET = re.compile(
    r"io\.(written-.*|exists|no-writer-for-ending|stream-of-own-file|crash-json-other-format)"
    r"|attitude\.(named-twice-trial-does-not|recorded-log-sensor|reference-clock-differs)"
    r"|bundle\.(no-key-file|no-secret-key|no-public-key|.*-schema|unknown-form)"
)
COMMANDS = "doctor|init|navigate|align|attitude|allan|calibrate|convert|crash|sensors|modules|sign"
OPTION = re.compile(rf"(?<![\w-])--[a-z]|\bstrapdown ({COMMANDS})\b")


def test_the_studio_names_no_option_of_the_command_line():
    """Whoever reads it has a page before him, and no command line."""
    found = []
    for code, entry in CATALOGUE.items():
        if code.partition(".")[0] not in OF_STUDIO or NEVER_MET.fullmatch(code):
            continue
        for part in ("what", "remedy"):
            forms = [part + form for form in (*errors._FORMS["studio"], "") if part + form in entry]
            if forms and OPTION.search(entry[forms[0]]):
                found.append((code, forms[0]))
    assert found == []


def test_every_placeholder_has_a_format_that_names_can_have():
    """A comma is of numbers alone: names were refused when the sentence was to be said."""
    wrong = [
        code
        for code, entry in CATALOGUE.items()
        for template in entry.values()
        for _, name, spec, _ in string.Formatter().parse(template)
        if name is not None and "," in (spec or "")
    ]
    assert wrong == []


def test_the_nearest_word_is_a_sentence_of_its_own_that_alone_lists_the_known_ones():
    """`{nearest}` lists the known words: another list of them said all twice, without a space."""
    joined, twice = [], []
    for code, entry in CATALOGUE.items():
        parts = [part for text in entry.values() for part in string.Formatter().parse(text)]
        # Of an entry that fills `nearest` itself it is a word like others.
        if code in OWN_NEAREST:
            continue
        names = [name.split(".")[0] for _, name, _, _ in parts if name is not None]
        if "nearest" in names and "known" in names:
            twice.append(code)
        joined += [
            code
            for text in entry.values()
            for before in [text.partition("{nearest}")[0]]
            if "{nearest}" in text and before and not before.endswith((". ", "? "))
        ]
    assert (joined, twice) == ([], [])


def test_every_code_that_is_raised_has_its_entry(raised):
    missing = [
        f"{path.name}:{node.lineno} {code}"
        for path, node in raised
        for code in _codes(_first(node))
        if code not in CATALOGUE
    ]
    assert missing == []


def test_no_sentence_stands_where_a_code_belongs(raised):
    texts = []
    for path, node in raised:
        first = _first(node)
        said = "".join(
            str(n.value)
            for n in ast.walk(first)
            if isinstance(first, ast.Constant | ast.JoinedStr | ast.BinOp)
            and isinstance(n, ast.Constant)
        )
        names = {k.arg for k in node.keywords}
        if " " in said or "remedy" in names:
            texts.append(f"{path.name}:{node.lineno}")
    assert texts == []


def test_no_entry_is_left_behind(nodes):
    """An entry is named in full, or by the constant parts of a text that is put together."""
    whole: set[str] = set()
    parts: list[re.Pattern[str]] = []
    for inside in nodes.values():
        for node in inside:
            if isinstance(node, ast.JoinedStr):
                shape = "".join(
                    re.escape(str(v.value)) if isinstance(v, ast.Constant) else "[a-z0-9_.-]*"
                    for v in node.values
                )
                if re.match(r"([a-z_]+\\\.|\[a-z0-9_\.-\]\*\\-)", shape):
                    parts.append(re.compile(shape))
            elif isinstance(node, ast.Constant) and isinstance(node.value, str):
                whole.add(node.value)
    left = [c for c in CATALOGUE if c not in whole and not any(p.fullmatch(c) for p in parts)]
    assert left == []


def test_what_a_sentence_shows_is_given_where_it_is_raised(raised):
    """Direct calls with literal codes; what a helper adds is covered by the tests of bad input."""
    lacking = []
    for path, node in raised:
        names = {k.arg for k in node.keywords}
        if _name(node) == "check_choice":
            names |= {"word", "known"}
        if None in names or "data" in names:
            continue
        for code in _codes(_first(node)) if not isinstance(_first(node), ast.Call) else ():
            wanted: set[str] = set()
            for template in CATALOGUE.get(code, {}).values():
                wanted |= _placeholders(template)
            if "nearest" in wanted - names:
                wanted = (wanted - {"nearest"}) | {"word", "known"}
            if wanted - names:
                lacking.append(f"{path.name}:{node.lineno} {code} {sorted(wanted - names)}")
    assert lacking == []


#: Where findings are shown to people: a terminal, a page, the comments of a proposed case file.
SHOWN = ("cli", "studio", "report", "api", "crash/template", "crash/record_parts")
ON_REQUEST = ("__str__", "__repr__")


def test_sentences_are_read_only_where_they_are_shown(nodes):
    """A sentence may be shown, never searched: other floors know codes and data."""
    read = defaultdict(list)
    for path, inside in nodes.items():
        name = path.relative_to(SOURCE).as_posix()
        if name.startswith(SHOWN) or name == "errors.py":
            continue
        shown = {
            id(inner)
            for node in inside
            if isinstance(node, ast.FunctionDef) and node.name in ON_REQUEST
            for inner in ast.walk(node)
        }
        for node in inside:
            called = isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute)
            if called and node.func.attr in {"sentence", "advice"} and id(node) not in shown:
                read[name].append(node.lineno)
            of_error = isinstance(node, ast.Attribute) and isinstance(node.value, ast.Attribute)
            if of_error and node.value.attr == "finding" and node.attr in {"what", "remedy"}:
                read[name].append(node.lineno)
    assert dict(read) == {}


@pytest.mark.parametrize("words", ["python", "cli", "file", "studio"])
def test_templates_are_sound(words):
    """Every template can be filled by data of any kind that has its names."""

    class Anything(dict):
        def __missing__(self, name):
            return 1.0

    for code, entry in CATALOGUE.items():
        for template in entry.values():
            for _, name, spec, conversion in string.Formatter().parse(template):
                assert name is None or name, f"{code}: a placeholder without a name"
                assert conversion in (None, "r", "s", "a"), code
                assert spec is None or "{" not in spec or _placeholders(spec), code


def test_a_finding_is_data_and_does_not_change():
    """Arrays become tuples, and what was given can change without changing the finding."""
    import numpy as np

    given = [1.0, 2.0]
    one = Finding("io.x", row=3, values=given, size=np.float64(2.5), table=np.eye(2))
    given.append(3.0)
    assert one.data == {"values": (1.0, 2.0), "size": 2.5, "table": ((1.0, 0.0), (0.0, 1.0))}
    assert type(one.data["size"]) is float
    with pytest.raises(AttributeError):
        one.row = 4  # type: ignore[misc]
    moved = one.replace(row=7, severity="note")
    assert (moved.row, moved.severity, moved.data, one.row) == (7, "note", one.data, 3)
    assert moved != one and hash(moved.replace(row=3, severity="warning")) == hash(one)


def test_an_entry_alone_is_that_of_the_whole_catalogue():
    assert {code: errors._entry(code) for code in CATALOGUE} == CATALOGUE
    assert [f"{r}.{name}" for r in sorted(ROOMS) for name in errors._entries(r)] == list(CATALOGUE)
