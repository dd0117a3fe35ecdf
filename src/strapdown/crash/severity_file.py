"""Injury-risk model from a TOML file transcribed from a publication."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from strapdown.crash.severity_model import SPEEDS, TRANSFORMS, SeverityModel, Term
from strapdown.errors import ConfigError

__all__ = ["load_severity_model"]

TEXTS = ("title", "author", "table", "outcome")
TOP = (*TEXTS, "year", "intercept", "terms", "validity", "applies", "note")
NUMBER_TERM = ("input", "unit", "coefficient", "transform")
CATEGORY_TERM = ("input", "equals", "coefficient")


def load_severity_model(path: str | Path) -> SeverityModel:
    """Read an injury-risk model.

    Parameters
    ----------
    path : str or Path
        A TOML file; its name is that of the model. ``title``, ``author``, ``year``, ``table`` and
        ``outcome`` give the outcome and the source; ``intercept`` and ``[[terms]]`` are the logit.
        Each term has ``input``, ``unit`` and ``coefficient`` (and ``transform``: identity, log or
        square), or, for a category, ``input``, ``equals`` and ``coefficient``. ``[validity]`` gives
        ``input = [least, greatest]`` in the unit of its term, ``[applies]`` gives
        ``input = ["category", ...]``.

    Returns
    -------
    SeverityModel

    Raises
    ------
    ConfigError
        The file is missing or not in this form; the message names the key.
    """
    file = Path(path)
    table = _table(file)
    _known(file, table, TOP, "")
    texts = {key: _text(file, table, key) for key in TEXTS}
    year = table.get("year")
    if isinstance(year, bool) or not isinstance(year, int):
        raise _bad(file, "year", "crash.year-not-whole", year=year)
    note = table.get("note", "")
    if not isinstance(note, str):
        raise _bad(file, "note", "crash.no-text")
    terms = _terms(file, table)
    return SeverityModel(
        name=file.stem,
        year=year,
        intercept=_number(file, table.get("intercept"), "intercept"),
        terms=terms,
        validity=_validity(file, table.get("validity", {}), terms),
        applies=_applies(file, table.get("applies", {})),
        note=note,
        **texts,
    )


def _table(file: Path) -> dict[str, Any]:
    if not file.is_file():
        raise ConfigError("crash.no-such-file", file=str(file))
    try:
        return tomllib.loads(file.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ConfigError("crash.no-toml", file=file.name, error=error) from None


def _terms(file: Path, table: Mapping[str, Any]) -> tuple[Term, ...]:
    rows = table.get("terms")
    if not isinstance(rows, list) or not rows or not all(isinstance(r, dict) for r in rows):
        raise _bad(file, "terms", "crash.terms-missing")
    terms: list[Term] = []
    for k, row in enumerate(rows, start=1):
        place = f"terms {k}"
        category = "equals" in row
        _known(file, row, CATEGORY_TERM if category else NUMBER_TERM, f"{place}.")
        name = _text(file, row, "input", f"{place}.")
        coefficient = _number(file, row.get("coefficient"), f"{place}.coefficient")
        if category:
            term = Term(name, coefficient, equals=_text(file, row, "equals", f"{place}."))
        else:
            transform = row.get("transform", "identity")
            if transform not in TRANSFORMS:
                raise _bad(
                    file,
                    f"{place}.transform",
                    "crash.transform-unknown",
                    transform=transform,
                    word=str(transform),
                    known=TRANSFORMS,
                )
            term = Term(name, coefficient, _text(file, row, "unit", f"{place}."), transform)
        for other in terms:
            _refuse_clash(file, place, term, other)
        terms.append(term)
    return tuple(terms)


def _refuse_clash(file: Path, place: str, term: Term, other: Term) -> None:
    if term.input != other.input:
        return
    if (term.equals is None) != (other.equals is None):
        code = "crash.term-number-and-category"
    elif term.unit != other.unit:
        code = "crash.term-in-two-units"
    elif (term.transform, term.equals) == (other.transform, other.equals):
        code = "crash.term-twice"
    else:
        return
    units = {"unit": term.unit, "before": other.unit, "speeds": SPEEDS.keys()}
    raise _bad(file, place, code, input=term.input, **units)


def _validity(file: Path, given: Any, terms: tuple[Term, ...]) -> dict[str, tuple[float, float]]:
    if not isinstance(given, dict):
        raise _bad(file, "validity", "crash.validity-not-a-table")
    numbers = {t.input: t for t in terms if t.equals is None}
    ranges: dict[str, tuple[float, float]] = {}
    for name, pair in given.items():
        place = f"validity.{name}"
        if name not in numbers:
            raise _bad(file, place, "crash.no-term-number-input", word=name, known=numbers)
        if not isinstance(pair, list) or len(pair) != 2:
            raise _bad(file, place, "crash.validity-not-a-pair", pair=pair, name=name)
        low, high = (_number(file, value, place) for value in pair)
        if not low < high:
            raise _bad(file, place, "crash.no-range", low=low, high=high)
        ranges[name] = (low, high)
    return ranges


def _applies(file: Path, given: Any) -> dict[str, tuple[str, ...]]:
    if not isinstance(given, dict):
        raise _bad(file, "applies", "crash.applies-not-a-table")
    for name, words in given.items():
        if not isinstance(words, list) or not words or not all(isinstance(w, str) for w in words):
            raise _bad(
                file, f"applies.{name}", "crash.categories-not-texts", words=words, name=name
            )
    return {name: tuple(words) for name, words in given.items()}


def _number(file: Path, value: Any, key: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise _bad(file, key, "crash.coefficient-not-a-number", value=value)
    return float(value)


def _text(file: Path, table: Mapping[str, Any], key: str, prefix: str = "") -> str:
    value = table.get(key)
    if not isinstance(value, str) or not value.strip():
        code = {"table": "crash.table-missing", "unit": "crash.unit-missing"}
        said = {"name": key, "speeds": SPEEDS.keys()}
        raise _bad(file, f"{prefix}{key}", code.get(key, "crash.text-missing"), **said)
    return value


def _known(file: Path, table: Mapping[str, Any], known: tuple[str, ...], prefix: str) -> None:
    for key in table:
        if key not in known:
            raise _bad(file, f"{prefix}{key}", "crash.no-such-key", word=key, known=known)


def _bad(file: Path, key: str, code: str, **values: Any) -> ConfigError:
    return ConfigError(code, file=file.name, quantity=key, data=values)
