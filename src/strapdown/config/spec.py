"""Base classes of the specifications, and their validation errors."""

from __future__ import annotations

import unicodedata
from typing import Any, ClassVar, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError, model_validator
from pydantic_core import PydanticCustomError

from strapdown.config.toml_file import shown
from strapdown.errors import ConfigError, Finding

__all__ = ["Spec", "TableSpec", "file_name", "misfit", "refuse", "specify", "word", "words"]


class Spec(BaseModel):
    """Frozen specification that rejects unknown names."""

    # A command uses few of the specifications: each is built on first use.
    model_config = ConfigDict(frozen=True, extra="forbid", defer_build=True)

    def plain(self) -> dict[str, Any]:
        """Return the plain data for storage, without unstated values."""
        return self.model_dump(mode="json", exclude_none=True, serialize_as_any=True)


class TableSpec(Spec):
    """A table written by a user; an error on an unknown key suggests the nearest."""

    #: Fields that users do not write.
    unwritten: ClassVar[tuple[str, ...]] = ()

    @model_validator(mode="before")
    @classmethod
    def _known(cls, data: Any) -> Any:
        for key in data if isinstance(data, dict) else ():
            if key not in cls.model_fields:
                known = [name for name in cls.model_fields if name not in cls.unwritten]
                raise refuse(key, "config.unknown-key", word=key, known=known)
        return data


def refuse(key: str, code: str, /, **data: Any) -> PydanticCustomError:
    """Return the error that a validator raises about one of its keys."""
    return PydanticCustomError(
        "refused", "{finding}", {"key": key, "finding": Finding(code, **data)}
    )


#: Codes of type errors, by pydantic's name.
_MISFITS = {
    "string_type": "config.not-text",
    "float_type": "config.not-a-number",
    "int_type": "config.not-a-whole-number",
    "bool_type": "config.not-true-or-false",
    "finite_number": "config.not-finite",
}
#: Codes of range errors, by pydantic's name of the limit.
_LIMITS = {
    "gt": "config.not-above",
    "ge": "config.below-least",
    "lt": "config.not-below",
    "le": "config.above-most",
}


def misfit(error: Any, given: Any = None) -> Finding:
    """Return a pydantic error about a value as a finding without a location.

    Parameters
    ----------
    error : dict
        One of `ValidationError.errors`.
    given : object, optional
        The value as the user wrote it, where it was converted.
    """
    context = error.get("ctx", {})
    if error["type"] == "refused":
        refused: Finding = context["finding"]
        return refused
    value = shown(error["input"] if given is None else given)
    for key, code in _LIMITS.items():
        if key in context and isinstance(context[key], int | float):
            return Finding(code, given=value, limit=context[key])
    code = _MISFITS.get(error["type"], "config.value-does-not-fit")
    return Finding(code, given=value, reason=error["msg"].lower())


S = TypeVar("S", bound=Spec)


def specify(form: type[S], **values: Any) -> S:
    """Create a specification, or report the value that does not fit.

    Parameters
    ----------
    form : type
        One of the specifications here.
    **values
        Its fields.

    Returns
    -------
    Spec

    Raises
    ------
    ConfigError
        A value is of the wrong type or out of range.
    """
    try:
        return form(**values)
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(part) for part in first["loc"])
        raise ConfigError(misfit(first), quantity=place) from None


# Text for titles, tables and file names, and the characters excluded from it.


#: Maximum length of a title, a name, or the path of a file.
LONGEST_NAME = 200
LONGEST_PATH = 4096
# Control characters, surrogates, line and paragraph separators.
_CONTROL = {"Cc", "Cs", "Zl", "Zp"}
# Bidirectional controls: they could make a name look like another.
_TURNING = frozenset("\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069")


def words(text: str) -> str:
    """Check text of one line, which may be empty."""
    return _checked(text, LONGEST_NAME, "config.unprintable-character")


def word(text: str) -> str:
    """Check text of one line that may not be empty."""
    return words(_filled(text))


def file_name(text: str) -> str:
    """Check the path of a file."""
    return _checked(_filled(text), LONGEST_PATH, "config.unprintable-character-in-path")


def _filled(text: str) -> str:
    if not text.strip():
        raise refuse("", "config.text-empty")
    return text


def _checked(text: str, longest: int, unprintable: str) -> str:
    if len(text) > longest:
        raise refuse("", "config.text-too-long", length=len(text), longest=longest)
    for k, char in enumerate(text):
        if unicodedata.category(char) in _CONTROL or char in _TURNING:
            raise refuse("", unprintable, position=k + 1, character=ascii(char))
    return text
