"""What all specifications share: their form, and what is said where one does not fit."""

from __future__ import annotations

from typing import Any, ClassVar, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError, model_validator
from pydantic_core import PydanticCustomError

from strapdown.errors import ConfigError

__all__ = ["Spec", "TableSpec", "refuse", "specify"]


class Spec(BaseModel):
    """Frozen, and strict about names."""

    # A command uses a few of the specifications: each is built when it is first used.
    model_config = ConfigDict(frozen=True, extra="forbid", defer_build=True)

    def plain(self) -> dict[str, Any]:
        """Return it as plain data, as it is sealed: what is not stated is left out."""
        return self.model_dump(mode="json", exclude_none=True, serialize_as_any=True)


class TableSpec(Spec):
    """A table that a person writes: a key that is not known is answered with the nearest."""

    #: Fields that no person writes.
    unwritten: ClassVar[tuple[str, ...]] = ()

    @model_validator(mode="before")
    @classmethod
    def _known(cls, data: Any) -> Any:
        for key in data if isinstance(data, dict) else ():
            if key not in cls.model_fields:
                known = [name for name in cls.model_fields if name not in cls.unwritten]
                raise refuse(key, "config.no-such-key", word=key, known=known)
        return data


def refuse(key: str, what: str, remedy: str) -> PydanticCustomError:
    """What a validator raises about one of its keys, with a remedy of its own."""
    return PydanticCustomError(
        "refused",
        "{what}",
        {"key": key, "what": what, "remedy": remedy},
    )


S = TypeVar("S", bound=Spec)


def specify(form: type[S], **values: Any) -> S:
    """Make a specification, or say which value does not fit.

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
        A value is of the wrong kind or out of range.
    """
    try:
        return form(**values)
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(part) for part in first["loc"])
        raise ConfigError(
            "config.does-not-fit", quantity=place, first=first["input"], lower=first["msg"].lower()
        ) from None
