"""Errors and findings: a code, its data and where it is; sentences are made where they are shown.

A `Finding` says in a form that programs can read what a stage noticed; an error is a finding that
ended the work. Neither holds a sentence. The sentences are in one catalogue, `messages/*.toml`,
a file for each room: ``code = {what, remedy}`` as templates over the data, with the words of an
interface where they differ (``remedy_cli`` for options, ``remedy_file`` for the keys of a
configuration, which is given to a command: without words of its own it takes those of options;
``remedy_studio`` for the pages of the studio, which have these keys).
`Finding.sentence` and `Finding.advice` fill them in. No logic reads them: it
reads `code`, `severity` and `data`.

Templates are those of `str.format`, and besides:

* a sequence is joined by ", "; ``{names:or}``, ``{names:and}``, ``{names:;}`` join by that word or
  sign, ``{names:list}`` shows it as Python does;
* ``{name:shell}`` quotes a name or a sequence for a shell; ``{columns:mapping}`` shows
  ``a=b,c=d`` as a dictionary of Python;
* a finding among the data gives its sentence, and ``{reason.remedy}`` its remedy;
* ``{faults:lines}`` lists findings of one file, each on a line of its own with its location, its
  sentence and, below it, its remedy;
* what is not printable in a text of the data, an escape sequence or a mark of direction, is shown
  escaped (`printable`), as names and values are from files;
* ``{nearest}`` suggests the known word (data `known`, `also`) that is nearest to the data `word`.
"""

from __future__ import annotations

import difflib
import re
import string
from collections.abc import Collection, Iterable, Mapping, Sequence
from copy import copy
from functools import cache
from importlib import resources
from os import PathLike, fspath
from typing import Any, Literal, Self

#: A note informs, a warning speaks against a result, an error ended the work.
Severity = Literal["note", "warning", "error"]
#: Whose words a sentence speaks: arguments, options, the keys of a configuration, or what the pages
#: of the studio name.
Words = Literal["python", "cli", "file", "studio"]

_LOCATION = ("file", "row", "quantity", "line")


class Finding:
    """Something that a reader or a stage noticed and a person should know. Immutable.

    Parameters
    ----------
    code : str
        Names it in the catalogue: ``room.what-is-wrong``.
    severity : {'warning', 'note', 'error'}
    file : str, optional
        Name of the file or source that it concerns.
    row : int, optional
        Row of the file, counted from 1 and including any header, as an editor
        or a spreadsheet counts; for binary files the sample, counted from 1.
    quantity : str, optional
        The column or quantity.
    line : int, optional
        Line of a file that a person wrote, counted from 1; such a file has no rows.
    data : mapping, optional
        More of `values`, with names that are not identifiers or equal those of parameters.
    **values
        Numbers, texts, sequences of them, or findings that explain this one; what the sentence
        shows, and `shown`, a value as the user wrote it, shown before the sentence.
    """

    __slots__ = ("code", "data", "file", "line", "quantity", "row", "severity")

    code: str
    severity: Severity
    file: str | None
    row: int | None
    quantity: str | None
    line: int | None
    data: Mapping[str, Any]

    def __init__(
        self,
        code: str,
        *,
        severity: Severity = "warning",
        file: str | None = None,
        row: int | None = None,
        quantity: str | None = None,
        line: int | None = None,
        data: Mapping[str, Any] | None = None,
        **values: Any,
    ) -> None:
        put = object.__setattr__
        put(self, "code", code)
        put(self, "severity", severity)
        put(self, "file", file)
        put(self, "row", row)
        put(self, "quantity", quantity)
        put(self, "line", line)
        given: dict[str, Any] = {**(data or {}), **values}
        # Of a table of choices the names are data, and not what they name.
        given |= {k: tuple(given[k]) for k in ("known", "also") if k in given}
        put(self, "data", {k: _plain(v) for k, v in given.items()})

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError(f"a Finding is immutable: make another by replace({name}=...)")

    __delattr__ = __setattr__  # type: ignore[assignment]

    def replace(self, **changes: Any) -> Finding:
        """Return it with another location, severity or code, and with data added or changed."""
        kept = {name: changes.pop(name, getattr(self, name)) for name in _LOCATION}
        code = changes.pop("code", self.code)
        severity = changes.pop("severity", self.severity)
        return Finding(code, severity=severity, data={**self.data, **changes}, **kept)

    def explains(self, code: str, **data: Any) -> Finding:
        """Return another finding at its location, of which it is the reason."""
        where = {name: getattr(self, name) for name in _LOCATION}
        return Finding(code, severity=self.severity, data={"reason": self}, **{**where, **data})

    def sentence(self, words: Words = "python") -> str:
        """Return what was found, with the numbers that show it."""
        text = _text(self, "what", words)
        shown = self.data.get("shown")
        return text if shown is None else f"{printable(str(shown))}: {text}"

    def advice(self, words: Words = "python") -> str | None:
        """Return what the user can do about it."""
        return _text(self, "remedy", words) or None

    @property
    def what(self) -> str:
        """The sentence in the words of Python. For people; logic reads `code`."""
        return self.sentence()

    @property
    def remedy(self) -> str | None:
        """The remedy in the words of Python. For people; logic reads `code`."""
        return self.advice()

    def text(self, words: Words = "python") -> str:
        """Return where it is, the sentence, and the remedy on a line of its own."""
        where = ", ".join([*([printable(self.file)] if self.file else []), *self._in_file()])
        remedy = self.advice(words)
        text = ": ".join(part for part in (where, self.sentence(words)) if part)
        return f"{text}\n  Remedy: {remedy}" if remedy else text

    def listed(self, words: Words = "python") -> str:
        """Return it as one of several of a file: indented, and without the name of the file."""
        remedy = self.advice(words)
        text = ": ".join(p for p in (", ".join(self._in_file()), self.sentence(words)) if p)
        return f"  {text}\n    {remedy}" if remedy else f"  {text}"

    def _in_file(self) -> list[str]:
        where = [f"row {self.row}"] if self.row is not None else []
        where += [f"line {self.line}"] if self.line is not None else []
        return [*where, printable(self.quantity)] if self.quantity else where

    def plain(self, words: Words | None = None) -> dict[str, Any]:
        """Return it as data for JSON: code, severity, location, data.

        `words`: with its sentence and remedy in these words, for people.
        """
        where = {n: getattr(self, n) for n in _LOCATION if getattr(self, n) is not None}
        said = {"sentence": self.sentence(words), "remedy": self.advice(words)} if words else {}
        data = {"data": _json(self.data), **said}
        return {"code": self.code, "severity": self.severity, **where, **data}

    def __str__(self) -> str:
        return self.text()

    def __repr__(self) -> str:
        parts = [repr(self.code), f"severity={self.severity!r}"]
        parts += [f"{n}={getattr(self, n)!r}" for n in _LOCATION if getattr(self, n) is not None]
        return f"Finding({', '.join([*parts, *(f'{k}={v!r}' for k, v in self.data.items())])})"

    def _key(self) -> tuple[object, ...]:
        where = (self.file, self.row, self.quantity, self.line)
        return (self.code, self.severity, *where, repr(sorted(self.data.items(), key=str)))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Finding) and self._key() == other._key()

    def __hash__(self) -> int:
        return hash(self._key())

    def __reduce__(self) -> tuple[Any, ...]:
        where = {name: getattr(self, name) for name in _LOCATION}
        return (_remade, (self.code, {"severity": self.severity, **where, "data": self.data}))


def _remade(code: str, fields: dict[str, Any]) -> Finding:
    return Finding(code, **fields)


def add_note(findings: list[Finding], code: str, **data: Any) -> None:
    """Append a note; `data`: as `Finding`."""
    findings.append(Finding(code, severity="note", **data))


def add_warning(findings: list[Finding], code: str, **data: Any) -> None:
    """Append a warning, unless `data` have another severity; `data`: as `Finding`."""
    findings.append(Finding(code, **data))


class StrapdownError(Exception):
    """Root of every error that strapdown raises on purpose.

    Parameters
    ----------
    code : str or Finding
        As of a `Finding`, or one that is taken as it is.
    file, row, quantity, line, data, **values
        As in `Finding`.
    """

    exit_code = 1
    finding: Finding

    def __init__(self, code: str | Finding, **values: Any) -> None:
        if isinstance(code, Finding):
            self.finding = code.replace(severity="error", **values)
        else:
            self.finding = Finding(code, severity="error", **values)
        super().__init__(self.finding)

    def __str__(self) -> str:
        return str(self.finding)

    def replaced(self, **changes: Any) -> Self:
        """Return the error with another location or more data, as `Finding.replace`."""
        other = copy(self)
        other.finding = self.finding.replace(**changes)
        other.args = (other.finding,)
        return other


class DataError(StrapdownError):
    """The data cannot be used as they are."""

    exit_code = 3


class ConfigError(StrapdownError):
    """The request cannot be met, or was not understood."""

    exit_code = 4


class DivergenceError(StrapdownError):
    """A computation left the range in which its result means anything."""

    exit_code = 5


def check_choice(
    code: str,
    known: Collection[str],
    *,
    quantity: str,
    file: str | None = None,
    **choice: Any,
) -> None:
    """Refuse a choice that is not known.

    Parameters
    ----------
    code : str
        Of the `ConfigError`.
    known : collection of str
        Choices, or the table whose keys they are.
    quantity, file : str
        As in `Finding`.
    **choice
        The choice, by its name in the data of the finding.
    """
    ((name, chosen),) = choice.items()
    if chosen not in known:
        raise ConfigError(
            code,
            file=file,
            quantity=quantity,
            data={name: chosen, "word": str(chosen)},
            known=known,
        )


def nearest(word: str, known: Iterable[str], also: Iterable[str] = ()) -> str:
    """Return a sentence that helps with an unknown name.

    `word`: what was not understood. `known`: the words that would have been. `also`: further such
    words, too many to be listed. Returns ``"did you mean 'x'? Known: a, b, c"``, or the list alone
    when none is near.
    """
    words = list(known)
    close = difflib.get_close_matches(str(word), [*words, *also], n=1, cutoff=0.5)
    hint = f"did you mean '{close[0]}'? " if close else ""
    return f"{hint}Known: {', '.join(words)}."


@cache
def _entries(room: str) -> Mapping[str, str]:
    file = resources.files("strapdown").joinpath("messages", f"{room}.toml")
    _, *parts = re.split(r"(?m)^\[([\w-]+)\]$", file.read_text(encoding="utf-8"))
    return dict(zip(parts[::2], parts[1::2], strict=True))


@cache
def _entry(code: str) -> Mapping[str, str]:
    """Entry of the catalogue; a whole room takes longer to parse than a log of 2,000 rows."""
    import tomllib

    room, _, name = code.partition(".")
    return tomllib.loads(_entries(room)[name])


#: Endings of the templates of each vocabulary, the first that an entry has; then that of Python.
_FORMS: Mapping[Words, tuple[str, ...]] = {
    "python": (),
    "cli": ("_cli",),
    "file": ("_file", "_cli"),
    "studio": ("_studio", "_file", "_cli"),
}


def _text(finding: Finding, part: str, words: Words) -> str:
    entry = _entry(finding.code)
    forms = _FORMS[words]
    template = next((entry[part + form] for form in (*forms, "") if part + form in entry), "")
    return _Sentence(words).vformat(template, (), finding.data) if template else ""


class _Sentence(string.Formatter):
    """Templates over the data of a finding."""

    _JOINTS = {"": ", ", "or": " or ", "and": " and ", ";": "; "}  # noqa: RUF012

    def __init__(self, words: Words) -> None:
        self._words = words

    def get_field(self, name: str, args: Sequence[Any], kwargs: Mapping[str, Any]) -> Any:
        first, _, part = name.partition(".")
        if first == "nearest" and "nearest" not in kwargs:
            known = nearest(kwargs["word"], kwargs["known"], kwargs.get("also", ()))
            return known, first
        value = kwargs[first]
        if isinstance(value, Finding) and part == "remedy":
            value = value.advice(self._words) or ""
        return value, first

    def format_field(self, value: Any, spec: str) -> str:
        if isinstance(value, Finding):
            return value.sentence(self._words)
        if spec == "shell":
            import shlex

            return printable(
                shlex.quote(",".join(value) if isinstance(value, tuple) else str(value))
            )
        if spec == "mapping":
            pairs = value if isinstance(value, tuple) else str(value).split(",")
            return printable(str(dict(pair.partition("=")[::2] for pair in pairs)))
        if isinstance(value, tuple):
            if spec == "list":
                return str(list(value))
            if spec == "lines":
                return "\n".join(one.listed(self._words) for one in value)
            if spec in self._JOINTS:
                return self._JOINTS[spec].join(self.format_field(one, "") for one in value)
            return ", ".join(self.format_field(one, spec) for one in value)
        return printable(str(format(value, spec)))


# Characters that are not printable as `str.isprintable` says, but for the blanks of all scripts.
_ODD = re.compile("[^ -~\u00a0\u1680\u2000-\u200a\u202f\u205f\u3000]")


def printable(text: str, *, lines: bool = False, json: bool = False) -> str:
    r"""Return a text in which nothing steers a terminal or a page, or hides.

    Parameters
    ----------
    text : str
        From a file, the name of a file, or a user.
    lines : bool
        Whether line ends and tabs are kept.
    json : bool
        Whether the text is JSON, whose strings are to keep their values.

    Returns
    -------
    str
        With ``\x1b``, ``\n`` or ``\u202e`` for such characters, and ``\xff`` for a byte of a file
        name that is not text.
    """
    if text.isascii() and text.isprintable():
        return text

    def escaped(found: re.Match[str]) -> str:
        char = found[0]
        if char.isprintable() or (lines and char in "\n\t"):
            return char
        if json:
            units = char.encode("utf-16-be", "surrogatepass").hex()
            return "".join(f"\\u{units[k : k + 4]}" for k in range(0, len(units), 4))
        if "\udc80" <= char <= "\udcff":
            return f"\\x{ord(char) - 0xDC00:02x}"
        return char.encode("unicode_escape").decode()

    return _ODD.sub(escaped, text)


def _plain(value: Any) -> Any:
    """The value as data: no arrays, no views, no value that changes later."""
    if value is None or isinstance(value, Finding):
        return value
    if isinstance(value, bool | int | float | str):
        # A subclass, as a float of numpy, is shown by another repr.
        if type(value).__module__ == "builtins":
            return value
        return value.item() if hasattr(value, "item") else str(value)
    if hasattr(value, "tolist"):
        return _plain(value.tolist())
    if isinstance(value, PathLike):
        return fspath(value)
    if isinstance(value, Mapping):
        # Of a table the names are data; arrays behind them would fill a message and a bundle.
        return tuple(str(k) for k in value)
    if isinstance(value, set | frozenset):
        return tuple(sorted(_plain(v) for v in value))
    if isinstance(value, Iterable):
        return tuple(_plain(v) for v in value)
    if isinstance(value, StrapdownError):
        return value.finding
    return str(value)


def _json(value: Any) -> Any:
    if isinstance(value, Finding):
        return value.plain()
    if isinstance(value, Mapping):
        return {k: _json(v) for k, v in value.items()}
    if isinstance(value, tuple):
        return [_json(v) for v in value]
    return value
