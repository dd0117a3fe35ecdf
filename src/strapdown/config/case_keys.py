"""Map the keys of a user's table to the fields of its specification."""

from __future__ import annotations

from collections.abc import Iterator
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from strapdown.config.spec import TableSpec
from strapdown.config.toml_file import KeyPath, TomlFile, shown, shown_key
from strapdown.config.wanted import base_of, converted, keys_of
from strapdown.errors import ConfigError

__all__ = ["canonical"]


def canonical(
    file: TomlFile, form: type[TableSpec]
) -> tuple[dict[str, Any], dict[KeyPath, KeyPath]]:
    """Convert every quantity to the unit of its field.

    Parameters
    ----------
    file : TomlFile
    form : type
        Specification class of the table.

    Returns
    -------
    table : dict
        With the names of the fields.
    written : dict
        Path of a field to its path in the file, where the file has another unit.

    Raises
    ------
    ConfigError
        A key is unknown or lacks its unit, or two keys give one quantity.
    """
    return _Keys(file, form).read()


#: Used instead of a header for keys before the first one.
TOP = "the top of the file"


class _Keys:
    def __init__(self, file: TomlFile, form: type[TableSpec]) -> None:
        self.file = file
        self.form = form
        self.written: dict[KeyPath, KeyPath] = {}

    def read(self) -> tuple[dict[str, Any], dict[KeyPath, KeyPath]]:
        return self._table(self.file.table, self.form, ()), self.written

    def _table(self, table: dict[str, Any], form: type[TableSpec], path: KeyPath) -> dict[str, Any]:
        known = _known(form)
        found: dict[str, Any] = {}
        by: dict[str, str] = {}
        for key, value in table.items():
            name = known.get(key)
            if name is None:
                raise self._unknown(key, value, form, path)
            if name in found:
                raise self._twice(by[name], key, table, path)
            by[name] = key
            inner = table_of(form, name)
            if inner is not None and isinstance(value, dict):
                found[name] = self._part(value, form, name, (*path, key))
            elif inner is not None and isinstance(value, list):
                found[name] = [
                    self._part(part, form, name, (*path, key, k)) for k, part in enumerate(value)
                ]
            else:
                found[name] = converted(value, key, name)
            if key != name:
                self.written[*path, name] = (*path, key)
        return found

    def _part(self, value: Any, form: type[TableSpec], name: str, path: KeyPath) -> Any:
        """Table of a field; for a union, the member that the tag names."""
        if not isinstance(value, dict):
            return value
        forms = list(_forms_of(form.model_fields[name].annotation))
        if len(forms) == 1:
            return self._table(value, forms[0], path)
        named = [one for one in forms if _has_tag(one, value)]
        return self._table(value, named[0], path) if len(named) == 1 else value

    def _twice(self, first: str, second: str, table: dict[str, Any], path: KeyPath) -> ConfigError:
        return self.file.refuse(
            (*path, second),
            "config.quantity-in-two-units",
            key=second,
            given=shown(table[second]),
            other_line=self.file.line((*path, first)),
            other_key=first,
            other_given=shown(table[first]),
        )

    def _unknown(self, key: str, value: Any, form: type[TableSpec], path: KeyPath) -> ConfigError:
        known = _known(form)
        bases = [n for n in dict.fromkeys(known.values()) if len(keys_of(n)) > 1 or base_of(n) != n]
        same = [n for n in bases if key == base_of(n)]
        begun = [n for n in bases if key.startswith(f"{base_of(n)}_")]
        elsewhere = [header for header, other in self._forms() if key in _known(other)]
        at = (*path, key)
        if same:
            keys = keys_of(same[0])
            return self.file.refuse(at, "config.key-without-unit", given=shown(value), keys=keys)
        if begun:
            name = max(begun, key=lambda n: len(base_of(n)))
            return self.file.refuse(at, "config.unknown-unit", keys=keys_of(name))
        if elsewhere:
            headers = [shown_key(header) for header in elsewhere]
            return self.file.refuse(at, "config.key-in-other-table", headers=headers)
        fields = [n for n in form.model_fields if n not in form.unwritten]
        return self.file.refuse(at, "config.unknown-key", word=key[:100], known=fields, also=known)

    def _forms(self) -> Iterator[tuple[str, type[TableSpec]]]:
        yield TOP, self.form
        yield from _below(self.form, "")


def _below(form: type[TableSpec], prefix: str) -> Iterator[tuple[str, type[TableSpec]]]:
    for name in form.model_fields:
        inner = table_of(form, name)
        if inner is not None:
            header = f"{prefix}{name}"
            several = _is_list(form.model_fields[name].annotation)
            yield (f"[[{header}]]" if several else f"[{header}]"), inner
            yield from _below(inner, f"{header}.")


def table_of(form: type[TableSpec], name: str) -> type[TableSpec] | None:
    """Specification class of a field that is a table, or a list of tables."""
    return _inner(form.model_fields[name].annotation)


def _inner(annotation: Any) -> type[TableSpec] | None:
    return next(_forms_of(annotation), None)


def _forms_of(annotation: Any) -> Iterator[type[TableSpec]]:
    if isinstance(annotation, type) and issubclass(annotation, TableSpec):
        yield annotation
    elif get_origin(annotation) in (tuple, Union, UnionType, Annotated):
        for part in get_args(annotation):
            yield from _forms_of(part)


def _has_tag(form: type[TableSpec], value: dict[str, Any]) -> bool:
    """Whether a tag key shows that a table is of this form."""
    return any(
        get_origin(field.annotation) is Literal and value.get(name) in get_args(field.annotation)
        for name, field in form.model_fields.items()
    )


def _is_list(annotation: Any) -> bool:
    return get_origin(annotation) is tuple


def _known(form: type[TableSpec]) -> dict[str, str]:
    """Field name by accepted key."""
    fields = [name for name in form.model_fields if name not in form.unwritten]
    return {key: name for name in fields for key in keys_of(name)}
