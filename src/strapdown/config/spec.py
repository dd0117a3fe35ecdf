"""Base class and types of all configuration: strict values, and units in the names of the keys.

A key states its unit: ``speed_m_per_s``. A user may write any unit of `UNITS` in its place
(``speed_km_per_h``); values arrive in the unit of the field. Errors of pydantic become findings
with the key, the value as written and a remedy: all of a table at once (`refusal`).
"""

from __future__ import annotations

import math
import operator
import re
import unicodedata
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib import import_module
from typing import Annotated, Any, ClassVar, Literal, Self, TypeVar, get_args, get_origin

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    TypeAdapter,
    ValidationError,
    model_validator,
)
from pydantic.fields import FieldInfo
from pydantic_core import PydanticCustomError

from strapdown.config.toml_file import KeyPath, TomlFile, place_of, shown, shown_key
from strapdown.constants import STANDARD_GRAVITY
from strapdown.errors import ConfigError, Finding
from strapdown.units import FORCES, LENGTHS

# --- units of keys ------------------------------------------------------------------------

#: By the unit ending of a field, the endings that a key may have, each with the number to multiply
#: with and the one to divide by: 600 mm are 0.6 m to the last bit.
UNITS: dict[str, dict[str, tuple[float, float]]] = {
    "_m_per_s2": {"_m_per_s2": (1.0, 1.0), "_g": (STANDARD_GRAVITY, 1.0)},
    "_m_per_s": {
        "_m_per_s": (1.0, 1.0),
        "_km_per_h": (1.0, 3.6),
        "_mph": (0.44704, 1.0),
        "_ft_per_s": (0.3048, 1.0),
    },
    "_m": {
        "_m": (1.0, 1.0),
        "_mm": (1.0, 1000.0),
        "_cm": (1.0, 100.0),
        "_in": (0.0254, 1.0),
        "_ft": (0.3048, 1.0),
    },
    "_s": {"_s": (1.0, 1.0), "_ms": (1.0, 1000.0)},
    "_n_per_m2": {
        "_n_per_m2": (1.0, 1.0),
        "_kn_per_m2": (1e3, 1.0),
        "_lb_per_in2": (FORCES["lbf"] / LENGTHS["in"] ** 2, 1.0),
    },
    "_n_per_m": {
        "_n_per_m": (1.0, 1.0),
        "_kn_per_m": (1e3, 1.0),
        "_lb_per_in": (FORCES["lbf"] / LENGTHS["in"], 1.0),
    },
    "_kg": {"_kg": (1.0, 1.0), "_lb": (0.45359237, 1.0)},
    "_deg_per_s": {"_deg_per_s": (1.0, 1.0)},
    "_deg": {"_deg": (1.0, 1.0)},
    "_hz": {"_hz": (1.0, 1.0)},
}
#: Units that are accepted and not suggested.
_SELDOM = ("_in", "_ft", "_ft_per_s", "_lb", "_g", "_lb_per_in", "_lb_per_in2")


@cache
def _parts(name: str) -> tuple[str, str]:
    """A field without its unit, and the unit; none for the s of a rate or of a square root."""
    unit = max((u for u in UNITS if name.endswith(u)), key=len, default="")
    base = name.removesuffix(unit)
    return (name, "") if base.endswith(("_per", "_sqrt")) else (base, unit)


@cache
def keys_of(name: str) -> tuple[str, ...]:
    """Keys that a user may write for a field, the field itself first."""
    base, unit = _parts(name)
    return tuple(base + other for other in UNITS[unit]) if unit else (name,)


def _factors(key: str, name: str) -> tuple[float, float]:
    base, unit = _parts(name)
    return UNITS[unit][key.removeprefix(base)] if unit and key != name else (1.0, 1.0)


def _converted(value: Any, key: str, name: str) -> Any:
    """Value of a key in the unit of a field; what is not a number is returned unchanged."""
    if isinstance(value, list | tuple):
        return [_converted(part, key, name) for part in value]
    if isinstance(value, bool) or not isinstance(value, int | float):
        return value
    multiply, divide = _factors(key, name)
    try:
        return value * multiply / divide
    except OverflowError:
        return math.inf if value > 0 else -math.inf


# --- faults: findings about keys ----------------------------------------------------------


@dataclass(frozen=True)
class At:
    """A value elsewhere in the configuration, for the sentence of a fault."""

    path: KeyPath
    default: Any = None


@dataclass(frozen=True)
class Fault:
    """Finding about a key, before its position in the file is known.

    Attributes
    ----------
    path : tuple
        Of the field.
    what : str or Finding
        Code of the finding, or a finding of a lower layer about this value.
    data : mapping
        Of the finding; each `At` becomes the value as written, with its line. With ``other``, a
        value that contradicts this one, ``mine`` is added.
    shows_value : bool
        Whether the sentence begins with the value as written.
    """

    path: KeyPath
    what: str | Finding
    data: Mapping[str, Any] = field(default_factory=dict)
    shows_value: bool = False

    @classmethod
    def of(cls, path: KeyPath, code: str, /, **data: Any) -> Self:
        """Create a fault of a value, which its sentence begins with."""
        return cls(path, code, data, shows_value=True)


def refuse(key: str, what: str | Finding, /, **data: Any) -> PydanticCustomError:
    """Return the error that a validator raises about one of its keys (empty: about the table)."""
    fault = Fault((key,) if key else (), what, data)
    return PydanticCustomError("refused", "{fault}", {"fault": fault})


def refused(path: KeyPath, make: Any, *arguments: Any) -> Iterator[Fault]:
    """Call a function of a lower layer; its refusal is the fault of a key."""
    try:
        make(*arguments)
    except ConfigError as error:
        yield Fault(path, error.finding)


def accepted_by(check: Callable[..., Any], *arguments: Any) -> AfterValidator:
    """Validator of a value that a function of a lower layer must accept."""

    def accepted(value: Any) -> Any:
        for fault in refused((), check, value, *arguments):
            assert isinstance(fault.what, Finding)
            raise refuse("", fault.what.replace(quantity=None))
        return value

    return AfterValidator(accepted)


def missing(form: type[Spec], path: KeyPath, code: str, **data: Any) -> Fault:
    """Return the fault of a required key that is not written, with how to write it."""
    return Fault(path, code, {**data, "wanted": _wanted(form, path)})


# --- the base -----------------------------------------------------------------------------


@dataclass(frozen=True)
class _Unknown:
    """Value of a key that a form does not have."""

    form: type[Spec]
    value: Any


class Spec(BaseModel):
    """Frozen table of a configuration; unknown keys are refused, units converted."""

    # A command uses few of the specifications: each is built on first use.
    model_config = ConfigDict(frozen=True, extra="forbid", defer_build=True)

    #: Fields that users do not write.
    unwritten: ClassVar[tuple[str, ...]] = ()

    @model_validator(mode="before")
    @classmethod
    def _as_fields(cls, data: Any) -> Any:
        if not isinstance(data, Mapping) or all(key in cls.model_fields for key in data):
            return data
        names = {key: name for name in cls.model_fields for key in keys_of(name)}
        out: dict[Any, Any] = {}
        by: dict[str, str] = {}
        for key, value in data.items():
            name = names.get(key)
            if name is None:
                out[key] = _Unknown(cls, value)
            elif name in by:
                raise refuse(key, "config.quantity-in-two-units", other=At((by[name],)))
            else:
                out[name], by[name] = _converted(value, key, name), key
        return out

    def plain(self) -> dict[str, Any]:
        """Return the plain data for storage, without unstated values."""
        return self.model_dump(mode="json", exclude_none=True, serialize_as_any=True)


S = TypeVar("S", bound=Spec)


def specify(form: type[S], /, **values: Any) -> S:
    """Create a specification from Python values.

    Raises
    ------
    ConfigError
        Values are unknown, of the wrong type or out of range; the quantity names the key.
    """
    try:
        return form.model_validate(values)
    except ValidationError as error:
        raise refusal(faults_of(error, form, values), values) from None


# --- from errors of pydantic to faults ----------------------------------------------------

_LIMITS = {
    "gt": "config.not-above",
    "ge": "config.below-least",
    "lt": "config.not-below",
    "le": "config.above-most",
}
_MISFITS = {
    "string_type": "config.not-text",
    "float_type": "config.not-a-number",
    "int_type": "config.not-a-whole-number",
    "int_from_float": "config.not-a-whole-number",
    "bool_type": "config.not-true-or-false",
    "finite_number": "config.not-finite",
}


def faults_of(error: ValidationError, form: type[Spec], written: Mapping[str, Any]) -> list[Fault]:
    """Convert the errors of a validation.

    `form`: the specification. `written`: the table as the user wrote it: its own values, in its own
    units, are shown.
    """
    errors = error.errors(include_url=False)
    faulty = {one["loc"][:end] for one in errors for end in range(len(one["loc"]))}
    begun = {one["loc"] for one in errors if one["type"] == "extra_forbidden"}

    def follows(one: Any) -> bool:
        """A list with a faulty element is not also too short, a key in a wrong unit not missing."""
        path, name = one["loc"][:-1], _parts(str(one["loc"][-1]))[0] if one["loc"] else ""
        beside = [str(other[-1]) for other in begun if other[:-1] == path]
        return (one["type"] == "too_short" and one["loc"] in faulty) or (
            one["type"] == "missing" and any(f"{key}_".startswith(f"{name}_") for key in beside)
        )

    return [_fault(one, form, written) for one in errors if not follows(one)]


def _fault(error: Any, form: type[Spec], written: Mapping[str, Any]) -> Fault:
    path, context, kind = tuple(error["loc"]), error.get("ctx", {}), error["type"]
    if kind == "refused":
        own: Fault = context["fault"]
        data = {
            k: At((*path, *v.path), v.default) if isinstance(v, At) else v
            for k, v in own.data.items()
        }
        return Fault((*path, *own.path), own.what, data)
    if kind.startswith("union_tag"):
        path = (*path, context["discriminator"].strip("'"))
    elif path[-1:] == ("[key]",):
        path = path[:-1]
    found, given = value_at(written, path)
    if not found or error["loc"][-1:] == ("[key]",):
        given = error["input"].value if isinstance(error["input"], _Unknown) else error["input"]
    key = next((part for part in reversed(path) if isinstance(part, str)), "")

    def fault(code: str, **data: Any) -> Fault:
        return Fault(path, code, data)

    match kind:
        case "missing" if isinstance(path[-1], int):
            return fault("config.component-missing")
        case "missing":
            return Fault(path, _wanted(form, path))
        case "extra_forbidden":
            return Fault(path, _unknown(key, given, error["input"].form, form))
        case "union_tag_not_found":
            tags = [tag for one in fields_at(form, path) for tag in get_args(one.annotation)]
            return fault("config.choice-missing", key=key, known=list(dict.fromkeys(tags)))
        case "union_tag_invalid" | "literal_error":
            known = re.findall(r"'([^']+)'", context.get("expected_tags") or context["expected"])
            return fault("config.unknown-choice", given=shown(given), word=str(given), known=known)
        case "model_type" | "dict_type" | "model_attributes_type":
            return fault("config.not-a-table", given=shown(given), header=_header(path))
        case "tuple_type" | "list_type" if isinstance(given, dict):
            return fault("config.one-table-for-list", header=_header(path))
        case "tuple_type" | "list_type":
            return fault("config.not-a-list", given=shown(given), key=shown_key(key) or "key")
        case "too_short" if isinstance(given, list):
            least = context["min_length"]
            return fault("config.list-too-short", given=shown(given), count=len(given), least=least)
        case "string_type" if isinstance(given, int | float):
            return fault("config.number-for-text", key=shown_key(key), given=shown(given))
    for limit, code in _LIMITS.items():
        if isinstance(context.get(limit), int | float):
            other = value_at(written, (*path[:-1], "lon_deg"))[1]
            if key == "lat_deg" and is_number(other) and abs(other) <= 90.0:
                return fault("config.latitude-longitude-exchanged", given=shown(given))
            return fault(code, given=shown(given), **_limited(limit, context[limit], path, written))
    code = _MISFITS.get(kind, "config.value-does-not-fit")
    return fault(code, given=shown(given), reason=error["msg"].lower())


def _limited(kind: str, limit: float, path: KeyPath, table: Mapping[str, Any]) -> dict[str, Any]:
    """A limit in the unit of the key, and keys of other units in which the value is allowed."""
    name = [str(part) for part in path if isinstance(part, str)][-1]
    key = [str(part) for part in written_path(table, path) if isinstance(part, str)][-1]
    given = value_at(table, path)[1]
    if key not in keys_of(name) or not isinstance(given, int | float) or limit == 0.0:
        return {"limit": limit, "hint": ""}
    keys = [
        other
        for other in keys_of(name)
        if not other.endswith(_SELDOM)
        and getattr(operator, kind)(_converted(given, other, name), limit)
    ]
    multiply, divide = _factors(key, name)
    hint = Finding("config.in-another-unit", keys=keys) if keys else ""
    return {"limit": limit * divide / multiply, "hint": hint}


def _unknown(key: str, given: Any, form: type[Spec], root: type[Spec]) -> Finding:
    names = [name for name in form.model_fields if name not in form.unwritten]
    units = [name for name in names if _parts(name)[1]]
    if same := [name for name in units if key == _parts(name)[0]]:
        return Finding("config.key-without-unit", given=shown(given), keys=keys_of(same[0]))
    if begun := [name for name in units if key.startswith(f"{_parts(name)[0]}_")]:
        name = max(begun, key=lambda n: len(_parts(n)[0]))
        return Finding("config.unknown-unit", keys=keys_of(name))
    headers = {
        header: None
        for header, other in _tables(root)
        if any(key in keys_of(n) for n in other.model_fields if n not in other.unwritten)
    }
    if headers:
        return Finding("config.key-in-other-table", headers=[*headers][:MOST_KEYS])
    return Finding(
        "config.unknown-key",
        word=key[:100],
        known=names,
        also=[other for name in names for other in keys_of(name)],
    )


def _wanted(form: type[Spec], path: KeyPath) -> Finding:
    """How to write a missing key, and its meaning."""
    found = fields_at(form, path)
    said = found[0].description if found else None
    meaning = f" ({said})" if said else ""
    if found and any(_forms_of(found[0])):
        header = _header(path)
        header = f"[[{header}]]" if get_origin(found[0].annotation) is tuple else f"[{header}]"
        return Finding("config.table-missing", header=header, meaning=meaning)
    keys = [key for key in keys_of(str(path[-1])) if not key.endswith(_SELDOM)]
    return Finding("config.key-missing", key=keys[0], keys=keys, meaning=meaning)


def _header(path: KeyPath) -> str:
    return ".".join(shown_key(part) for part in path if isinstance(part, str))


# --- forms by path ------------------------------------------------------------------------


def _forms(annotation: Any) -> Iterator[type[Spec]]:
    """Specifications in an annotation: of a table, a list of tables, or a union."""
    if isinstance(annotation, type) and issubclass(annotation, Spec):
        yield annotation
    if get_origin(annotation) is not Literal:
        for part in get_args(annotation):
            yield from _forms(part)
    if isinstance(annotation, BeforeValidator) and hasattr(annotation.func, "forms"):
        yield from annotation.func.forms()


def _forms_of(one: FieldInfo) -> Iterator[type[Spec]]:
    for part in (one.annotation, *one.metadata):
        yield from _forms(part)


@dataclass(frozen=True)
class Later:
    """Validator of a table whose forms are imported when there is one.

    Attributes
    ----------
    module, name : str
        Module of the forms, and what it calls them: a form, or a union.
    """

    module: str
    name: str

    def __call__(self, value: Any) -> Any:
        """Return the table as its form."""
        return TypeAdapter(self._annotation()).validate_python(value)

    def forms(self) -> Iterator[type[Spec]]:
        """Yield the forms."""
        return _forms(self._annotation())

    def _annotation(self) -> Any:
        return getattr(import_module(self.module), self.name)


def fields_at(form: type[Spec], path: KeyPath) -> list[FieldInfo]:
    """Fields of a path, one for each form of a union that has it.

    Below a table of free keys, the field of that table.
    """
    forms: list[type[Spec]] = [form]
    found: list[FieldInfo] = []
    named = False
    for part in path:
        if isinstance(part, int) or named:
            named = False
            continue
        here = [
            one for of in forms for name, one in of.model_fields.items() if part in keys_of(name)
        ]
        if not here and forms:
            # The tag of a union, or no field.
            forms = [
                of
                for of in forms
                if any(part in get_args(one.annotation) for one in of.model_fields.values())
            ]
            if not forms:
                return []
            continue
        found = here or found
        forms = [inner for one in here for inner in _forms_of(one)]
        named = bool(forms) and get_origin(here[0].annotation) is dict
    return found


def _tables(form: type[Spec], prefix: str = "") -> Iterator[tuple[str, type[Spec]]]:
    """Headers of a file, with the form of each table."""
    if not prefix:
        yield "the top of the file", form
    for name, one in form.model_fields.items():
        # Slots are not searched: their modules share keys with many others.
        searched = _forms_of(one) if one.annotation is Any else _forms(one.annotation)
        for inner in dict.fromkeys(searched):
            kind = get_origin(one.annotation)
            header = f"{prefix}{name}.NAME" if kind is dict else f"{prefix}{name}"
            yield (f"[[{header}]]" if kind is tuple else f"[{header}]"), inner
            yield from _tables(inner, f"{header}.")


# --- from faults to errors with lines -----------------------------------------------------


def written_path(table: Any, path: KeyPath) -> KeyPath:
    """Path of a field in a table as written: keys in other units, without tags of unions."""
    kept: list[str | int] = []
    for k, part in enumerate(path):
        key: Any = None
        if isinstance(table, Mapping):
            key = next((one for one in keys_of(str(part)) if one in table), None)
        elif isinstance(table, list | tuple) and isinstance(part, int) and part < len(table):
            key = part
        if key is not None:
            table = table[key]
        if key is not None or (k == len(path) - 1 and [part] != kept[-1:]):
            kept.append(part if key is None else key)
    return tuple(kept)


def value_at(table: Any, path: KeyPath) -> tuple[bool, Any]:
    """Whether a table has a field, and its value as written.

    A single value where several are allowed is that of each.
    """
    for part in written_path(table, path):
        if isinstance(table, str):
            break
        try:
            table = table[part]
        except (KeyError, IndexError, TypeError):
            return False, None
    return True, table


def refusal(
    faults: Sequence[Fault], table: Mapping[str, Any], file: TomlFile | None = None
) -> ConfigError:
    """Return all faults as one error.

    `faults`: one or more. `table`: as the user wrote it. `file`: its lines, in whose order the
    faults are listed; without it they are located by keys alone.
    """
    found = [located(one, table, file) for one in faults]
    if len(found) == 1:
        return ConfigError(found[0])
    found = list(dict.fromkeys(found))
    found.sort(key=lambda one: one.line or 0)
    name = None if file is None else file.path.name
    return ConfigError("config.several", file=name, count=len(found), faults=found)


def located(fault: Fault, table: Mapping[str, Any], file: TomlFile | None) -> Finding:
    """Return a fault with its position in the file, or in the table alone, as `refusal`."""
    path, what = fault.path, fault.what
    if isinstance(what, Finding):
        # A lower layer may name a part of the value.
        said = [part.strip() for part in (what.quantity or "").split(",")]
        inner = tuple(part for part in said if part and part not in path)
        path = (*path, *inner) if inner and value_at(table, (*path, *inner))[0] else path
        finding = what.replace(row=None)
    else:
        data = {k: _said(v, table, file) if isinstance(v, At) else v for k, v in fault.data.items()}
        there, value = value_at(table, path)
        if "other" in data:
            data["mine"] = _equation(written_path(table, path), value)
        elif there and fault.shows_value and not (isinstance(value, dict | None) or _big(value)):
            data["shown"] = shown(value)
        finding = Finding(what, data=data)
    path = written_path(table, path)
    finding = finding.replace(file=None, line=None, severity="error")
    if file is None:
        return finding.replace(quantity=", ".join(str(part) for part in path))
    return finding.replace(quantity=place_of(path), file=file.path.name, line=file.line(path))


def _said(at: At, table: Mapping[str, Any], file: TomlFile | None) -> Finding:
    """A value with its line, for a sentence."""
    path = written_path(table, at.path)
    there, value = value_at(table, at.path)
    if not there:
        return Finding("config.not-written", key=str(path[-1]), given=shown(at.default))
    line, said = None if file is None else file.line(path), _equation(path, value)
    if line is None:
        return Finding("config.written", said=said)
    home = place_of(path[:-1]) or "general"
    return Finding("config.written-in-line", said=said, at=line, table=home)


#: Number of keys of a table that a message shows.
MOST_KEYS = 4


def _equation(path: KeyPath, value: Any) -> str:
    name = next((shown_key(part) for part in reversed(path) if isinstance(part, str)), "")
    if _big(value):
        return name
    if not isinstance(value, dict):
        return f"{name} = {shown(value)}"
    pairs = [f"{shown_key(key)} = {shown(part)}" for key, part in value.items()]
    more = ", …" if len(pairs) > MOST_KEYS else ""
    return f"{name} = {{ {', '.join(pairs[:MOST_KEYS])}{more} }}"


def _big(value: Any) -> bool:
    """A table that contains tables, or a list of tables."""
    parts = list(value.values()) if isinstance(value, dict) else value
    return isinstance(parts, list) and any(isinstance(part, dict) for part in parts)


# --- types of values ----------------------------------------------------------------------

#: Maximum length of a title or a name, and of the path of a file.
LONGEST_NAME, LONGEST_PATH = 200, 4096
# Control characters, surrogates, line and paragraph separators.
_CONTROL = {"Cc", "Cs", "Zl", "Zp"}
# Bidirectional controls: they could make a name look like another.
_TURNING = frozenset("\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069")


def one_line(text: str, longest: int = LONGEST_NAME, code: str = "") -> str:
    """Return text of one line; refuse characters that cannot be shown."""
    if len(text) > longest:
        raise refuse("", "config.text-too-long", length=len(text), longest=longest)
    for k, char in enumerate(text):
        if unicodedata.category(char) in _CONTROL or char in _TURNING:
            code = code or "config.unprintable-character"
            raise refuse("", code, position=k + 1, character=ascii(char))
    return text


def _filled(text: str) -> str:
    if not text.strip():
        raise refuse("", "config.text-empty")
    return text


def is_number(value: Any) -> bool:
    """Whether a value is a finite number, and not true or false."""
    try:
        number = isinstance(value, int | float) and not isinstance(value, bool)
        return number and math.isfinite(float(value))
    except OverflowError:
        return False


def _one_or_three(value: Any) -> Any:
    several = value if isinstance(value, list | tuple) and len(value) == 3 else [value]
    if not all(is_number(part) for part in several):
        raise refuse("", "config.not-one-or-three-numbers", given=shown(value))
    return tuple(float(v) for v in several) if len(several) == 3 else float(several[0])


def _sizes(value: Any) -> Any:
    if min(value if isinstance(value, tuple) else (value,)) < 0.0:
        raise refuse("", "config.negative-size", given=shown(value))
    return value


# A number in quotation marks, or true for 1, is rejected.
Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Positive = Annotated[Number, Field(gt=0.0)]
NotNegative = Annotated[Number, Field(ge=0.0)]
Angle = Annotated[Number, Field(ge=-360.0, le=360.0)]
Latitude = Annotated[Number, Field(ge=-90.0, le=90.0)]
Longitude = Annotated[Number, Field(ge=-360.0, le=360.0)]
Pair = tuple[Number, Number]
Triple = tuple[Number, Number, Number]
OneOrThree = Annotated[float | Triple, BeforeValidator(_one_or_three)]
Sizes = Annotated[OneOrThree, AfterValidator(_sizes)]
#: One line of text, suitable for titles, tables and file names.
Words = Annotated[str, AfterValidator(one_line)]
Word = Annotated[Words, AfterValidator(_filled)]
FileName = Annotated[
    str,
    AfterValidator(_filled),
    AfterValidator(
        lambda text: one_line(text, LONGEST_PATH, "config.unprintable-character-in-path")
    ),
]
#: Channels of some records are numbered.
Channel = Annotated[
    Word,
    BeforeValidator(lambda v: str(v) if isinstance(v, int) and not isinstance(v, bool) else v),
]
#: One text where several are allowed.
Several = BeforeValidator(lambda value: [value] if isinstance(value, str) else value)


class AngleWaveSpec(Spec):
    """One sine component of an angle."""

    amplitude_deg: Number
    period_s: Positive
    phase_deg: Number = 0.0


class Position(Spec):
    """Geodetic position."""

    lat_deg: Latitude = Field(description="geodetic latitude, north positive")
    lon_deg: Longitude = Field(description="longitude, east positive")
    alt_m: Annotated[Number, Field(ge=-1e4, le=1e5)] = Field(
        default=0.0, description="height over the ellipsoid"
    )
