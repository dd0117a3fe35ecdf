"""Forms of the configurations, from their specifications: sections of fields with unit and help."""

from __future__ import annotations

import types
from collections.abc import Iterable, Iterator
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel, BeforeValidator
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from strapdown.config.choice import ChoiceSpec, Kinds
from strapdown.config.spec import UNITS, Spec
from strapdown.sensors.catalogue import SENSORS
from strapdown.studio.kinds import KINDS

#: Units as a person writes them, by the ending of a key.
SHOWN = {
    "_km_per_h": "km/h",
    "_mph": "mph",
    "_ft_per_s": "ft/s",
    "_mm": "mm",
    "_cm": "cm",
    "_in": "in",
    "_ft": "ft",
    "_ms": "ms",
    "_lb": "lb",
    "_g": "g",
    "_m_per_s2": "m/s²",
    "_m_per_s": "m/s",
    "_m": "m",
    "_s": "s",
    "_n_per_m2": "N/m²",
    "_n_per_m": "N/m",
    "_kg": "kg",
    "_deg_per_s": "deg/s",
    "_deg_per_h": "deg/h",
    "_ug": "µg",
    "_mg": "mg",
    "_ut": "µT",
    "_db": "dB",
    "_mb": "MB",
    "_deg": "deg",
    "_hz": "Hz",
    "_percent": "%",
}
#: How deep tables lie in one another.
DEEPEST = 4
#: Of which table the keys that a page sets by other means are not shown.
HIDDEN = {"name", "simulation", "live", "states"}


def unit_of(key: str) -> str:
    """Return the unit in the name of a key, as a person writes it; empty if there is none."""
    ending = _ending(key, SHOWN)
    base = key.removesuffix(ending)
    return "" if base.endswith(("_per", "_sqrt")) else SHOWN.get(ending, "")


def _ending(key: str, among: Iterable[str]) -> str:
    return max((end for end in among if key.endswith(end)), key=len, default="")


def kinds(_: Path) -> list[dict[str, Any]]:
    """List what can be run, each with its form."""
    return [
        {
            "kind": name,
            "title": one.title,
            "what": one.what,
            "needs": one.needs,
            "options": list(one.options),
            "schema": form_of(one.form),
        }
        for name, one in KINDS.items()
    ]


@cache
def form_of(form: type[Spec]) -> list[dict[str, Any]]:
    """Return the sections of a specification, those of the file itself first.

    Returns
    -------
    list of dict
        ``key``: path of the table, ``[]`` after that of a list, ``*`` for a name of one's own;
        ``title``, ``help``, ``many``, and ``fields``: ``key``, ``path``, ``label``, ``unit``,
        ``type`` (``number``, ``text``, ``choice``, ``flag``, ``list``), ``choices``, ``default``,
        ``required``, ``help``.
    """
    return list(_sections(form, (), 0))


def _sections(form: type[BaseModel], path: tuple[str, ...], deep: int) -> Iterator[dict[str, Any]]:
    fields, below = [], []
    for name, info in form.model_fields.items():
        if name in getattr(form, "unwritten", ()) or (not path and name in HIDDEN):
            continue
        table, form_of_table = _table(info.annotation, info)
        if table is None:
            fields.append(_field(name, info, (*path, name)))
        elif deep < DEEPEST:
            own = {"one": (name,), "list": (f"{name}[]",), "named": (name, "*")}[form_of_table]
            below += list(_sections(table, (*path, *own), deep + 1))
    if fields:
        title = path[-1].removesuffix("[]") if path else ""
        many = bool(path) and (path[-1].endswith("[]") or path[-1] == "*")
        yield {
            "key": ".".join(path),
            "title": _label(path[-2] if title == "*" else title),
            "help": (form.__doc__ or "").strip().partition("\n")[0],
            "many": many,
            "fields": fields,
        }
    yield from below


def _table(hint: Any, info: FieldInfo | None = None) -> tuple[type[BaseModel] | None, str]:
    """Table that a field takes, and whether it is one, a list, or named ones; None for a value."""
    for part in info.metadata if info is not None else ():
        if isinstance(part, BeforeValidator) and isinstance(part.func, Kinds):
            return _choices(part.func), "one"
    origin, parts = get_origin(hint), get_args(hint)
    if origin is Annotated:
        for part in parts[1:]:
            if isinstance(part, BeforeValidator) and isinstance(part.func, Kinds):
                return _choices(part.func), "one"
        return _table(parts[0])
    if origin in (Union, types.UnionType):
        found = [_table(part) for part in parts if part is not type(None)]
        return next((one for one in found if one[0] is not None), (None, ""))
    if origin in (tuple, list) and parts:
        table, _ = _table(parts[0])
        return table, "list"
    if origin is dict and len(parts) == 2:
        table, _ = _table(parts[1])
        return table, "named"
    if isinstance(hint, type) and issubclass(hint, BaseModel):
        return hint, "one"
    return None, ""


@cache
def _choices(of: Kinds) -> type[BaseModel]:
    """Return one table with the options of every kind; ``kind`` chooses between them."""
    from pydantic import create_model

    names = [form.model_fields["kind"].default for form in of.forms()]
    known: dict[str, Any] = {"kind": (Literal[tuple(names)], of.default or names[0])}
    for form in of.forms():
        for name, info in form.model_fields.items():
            if name != "kind":
                known.setdefault(name, (info.annotation, info))
    doc = "" if of.base is ChoiceSpec else of.base.__doc__
    return create_model(of.slot, __base__=BaseModel, __doc__=doc, **known)


def _field(name: str, info: FieldInfo, path: tuple[str, ...]) -> dict[str, Any]:
    kind, choices = _kind(info.annotation)
    if name == "sensor":
        kind, choices = "text", sorted(SENSORS)
    default = None if info.default is PydanticUndefined else info.default
    if isinstance(default, tuple):
        default = list(default)
    if not isinstance(default, str | int | float | bool | list | type(None)):
        default = None
    return {
        "key": name,
        "path": ".".join(path),
        "label": _label(name),
        "unit": unit_of(name),
        "type": kind,
        "choices": choices,
        "default": default,
        "required": info.is_required(),
        "help": info.description or _help(path),
    }


@cache
def _helps() -> dict[str, dict[str, str]]:
    import tomllib

    text = files("strapdown.studio").joinpath("help.toml").read_text(encoding="utf-8")
    found: dict[str, dict[str, str]] = tomllib.loads(text)
    return found


def _help(path: tuple[str, ...]) -> str:
    """Description of a field without one of its own: by its path, else by its name."""
    by = _helps()
    whole = ".".join(path)
    named = (by["name"].get(".".join(path[-n:])) for n in (2, 1))
    return by["path"].get(whole) or next((text for text in named if text), "")


def _kind(hint: Any) -> tuple[str, list[Any]]:
    """Type of an input for a field, and its choices."""
    origin, parts = get_origin(hint), get_args(hint)
    if origin is Annotated:
        return _kind(parts[0])
    if origin is Literal:
        return "choice", list(parts)
    if origin in (Union, types.UnionType):
        found = [_kind(part) for part in parts if part is not type(None)]
        kinds_ = [kind for kind, _ in found]
        return found[0] if len(found) == 1 or kinds_[0] != "number" else ("number", [])
    if origin in (tuple, list, dict):
        return "list", []
    if hint is bool:
        return "flag", []
    if hint in (int, float):
        return "number", []
    return "text", []


def _label(name: str) -> str:
    """Name of a key in words, without its unit."""
    words = name.removesuffix(_ending(name, (*UNITS, *SHOWN))) if unit_of(name) else name
    return words.replace("_", " ").capitalize().replace("gnss", "GNSS").replace("Gnss", "GNSS")
