"""What a remedy says to type can be typed: arguments of Python parse, options exist.

Names of columns and files are from strangers: they are filled in with blanks, quotes and signs.
"""

from __future__ import annotations

import ast
import inspect
import re
import shlex
import string

import pytest
import typer
from tests.arch.test_catalogue import CATALOGUE

import strapdown as sd
from strapdown.cli.main import app
from strapdown.errors import _Sentence

HOSTILE = 'Gyro "X" (°/s)\'s'
#: Data that are words of this package: units, quantities, keys, names of formats and streams.
WORDS = {
    *("unit", "likely", "triad", "of_what", "missing_2", "meant", "example", "axes", "stream"),
    *("choices", "counts", "interpolation", "sum_of", "kind", "other_kind", "value", "assumed"),
    *("wanted", "speeds", "own", "command", "key", "entry", "table", "needed", "others", "grade"),
}
#: Names that stand for what the user knows, and what Python or numpy give.
KNOWN = {"True", "False", "None", "datetime", "UTC", "sd", "df", "Assumed", "Entry"}
#: Rooms and entries of files of keys, which no argument of Python has.
OF_FILES = re.compile(
    r"config\.|campaign\.|live\.|io\.(crash-|no-form-understood|triad-|taken-time|no-list-|sampling-interval|"
    r"unit-taken-from)|sensors\.figure-|crash\.|cli\.|io\.(advances-evenly-taken-time|ubx-clock)"
)


def rendered(template: str, words: str) -> str:
    """The template with hostile names, and numbers where it formats numbers."""
    data: dict[str, object] = {"known": ["a"], "word": "a"}
    for _, name, spec, _ in string.Formatter().parse(template):
        if name is not None:
            first = name.partition(".")[0]
            plain = "mapping" if spec == "mapping" else ""
            number = bool(re.search(r"[gfdxe%]$", spec or "")) and not plain and spec != "and"
            data[first] = 2 if number else "word" if first in WORDS else HOSTILE
            if first == "python":
                data[first] = '{"speed": "km/h"}'
            elif spec == "mapping":
                data[first] = f"accel_x={HOSTILE},accel_y=b"
            elif spec in (";", "or", "and", "list", "lines"):
                data[first] = (data[first],) if spec != "lines" else ()
    return _Sentence(words).vformat(template, (), data)


ARGUMENT = re.compile(r"(?<![\w\"'\-\[{.:/])([a-z_]\w*)=(?=\S)")


def argument_at(text: str, start: int) -> ast.keyword | None:
    """The first argument of a call that is written there and ends at a word's end."""
    for end in range(start + 1, len(text) + 1):
        if end < len(text) and text[end] not in " ,;:.)":
            continue
        try:
            call = ast.parse(f"f({text[start:end].replace('…', '...')})", mode="eval").body
        except SyntaxError:
            continue
        if isinstance(call, ast.Call) and call.keywords:
            return call.keywords[0]
    return None


def test_python_remedies_parse():
    wrong = []
    for code, entry in CATALOGUE.items():
        for part in ("remedy", "what"):
            text = rendered(entry.get(part, ""), "python")
            for found in ARGUMENT.finditer(text):
                if OF_FILES.match(code) or code == "io.hdf5-elsewhere":
                    continue
                argument = argument_at(text, found.start())
                names = (
                    [n.id for n in ast.walk(argument) if isinstance(n, ast.Name)]
                    if argument
                    else []
                )
                odd = [n for n in names if not n.isupper() and n not in KNOWN]
                if argument is None or odd:
                    wrong.append((code, part, text[found.start() :]))
            if not OF_FILES.match(code) and re.search(r"[\w]+ = \{", text):
                wrong.append((code, part, "a table of TOML"))
    assert wrong == []


@pytest.fixture(scope="module")
def options():
    """Options of each command of the command line."""
    out: dict[str, set[str]] = {}

    def walk(command, path):
        out[" ".join(path)] = {o for p in command.params for o in (*p.opts, *p.secondary_opts)}
        if hasattr(command, "list_commands"):
            context = typer.Context(command)
            for name in command.list_commands(context):
                walk(command.get_command(context, name), [*path, name])

    walk(typer.main.get_command(app), [])
    return out


VALUE = re.compile(r"(--[a-z-]+)[ =]((?:[^\s{]|\{[^}]*\})*\{[^}]*\})")
NUMBER = re.compile(r"\.?\d*[gfd]")


def test_options_of_remedies_exist_and_take_any_name(options):
    known = set().union(*options.values())
    wrong = []
    for code, entry in CATALOGUE.items():
        for part, template in entry.items():
            if part.endswith(("_studio", "_file")):
                continue
            for option in re.findall(r"(?<![\w-])(--[a-z][a-z0-9-]*)", template):
                if option not in known:
                    wrong.append((code, part, option))
            for command, rest in re.findall(r"strapdown ([a-z]+(?: [a-z]+)?)([^;:'\n]*)", template):
                path = command if command in options else command.split()[0]
                for option in re.findall(r"(?<![\w-])(--[a-z][a-z0-9-]*)", rest):
                    if option not in options.get(path, known):
                        wrong.append((code, part, f"{command} {option}"))
            for found in VALUE.finditer(template):
                for _, name, spec, _ in string.Formatter().parse(found[2]):
                    safe = name is None or spec == "shell" or NUMBER.fullmatch(spec or "")
                    if not safe and name not in WORDS:
                        wrong.append((code, part, found[0]))
    assert wrong == []


def test_names_in_options_and_arguments_survive():
    assert shlex.split(_Sentence("cli").vformat("{a:shell}", (), {"a": HOSTILE})) == [HOSTILE]
    pairs = (f"gyro_x={HOSTILE}", "gyro_y=b")
    said = _Sentence("cli").vformat("--columns {a:shell}", (), {"a": pairs})
    assert shlex.split(said) == ["--columns", ",".join(pairs)]
    said = _Sentence("python").vformat("{a:mapping}", (), {"a": pairs})
    assert ast.literal_eval(said) == {"gyro_x": HOSTILE, "gyro_y": "b"}


def test_arguments_are_of_public_functions():
    known = {
        name
        for public in sd.__all__
        if callable(function := getattr(sd, public))
        for name in _parameters(function)
    }
    asked = {"units", "columns", "axes", "repair", "datum_height_m", "rate_hz", "sampling"}
    assert asked <= known


def _parameters(function):
    try:
        return list(inspect.signature(function).parameters)
    except (TypeError, ValueError):
        return []
