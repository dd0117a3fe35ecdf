"""Differences between two specifications, as text."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from strapdown.config.spec import Spec
from strapdown.config.toml_file import shown, shown_key

__all__ = ["changed_options"]


def changed_options(
    before: Spec | Mapping[str, Any], after: Spec | Mapping[str, Any]
) -> tuple[str, ...]:
    """List the options that differ.

    Parameters
    ----------
    before, after : Spec or dict
        Specifications, or their stored plain data.

    Returns
    -------
    tuple of str
        Such as ``entry, speed_m_per_s: 7.1 before, 8.1 now``, in the order of `after`. Tables in a
        list are matched by name at any position, otherwise by number. A missing key equals None,
        and a list equals a tuple.
    """
    return tuple(_changed(_plain(before), _plain(after), ()))


def _plain(given: Any) -> Any:
    if isinstance(given, Spec):
        return _plain(given.model_dump())
    if isinstance(given, Mapping):
        return {str(key): _plain(value) for key, value in given.items()}
    if isinstance(given, list | tuple):
        return [_plain(value) for value in given]
    return given


def _changed(before: Any, after: Any, place: tuple[str, ...]) -> Iterator[str]:
    if isinstance(before, dict) and isinstance(after, dict):
        for key in dict.fromkeys((*after, *before)):
            inner = (*place, shown_key(key))
            yield from _changed(before.get(key), after.get(key), inner)
    elif _tables(before) and _tables(after) and (before or after):
        yield from _changed_list(before, after, place)
    elif not _same(before, after):
        where = ", ".join(place)
        # Tables are not written out.
        if before is None:
            yield f"{where}: not there before{_now(after)}"
        elif after is None:
            yield f"{where}: {_value(before)} before, not there now"
        else:
            yield f"{where}: {_value(before)} before, {_value(after)} now"


def _changed_list(
    before: list[dict[str, Any]], after: list[dict[str, Any]], place: tuple[str, ...]
) -> Iterator[str]:
    one = place[-1].removesuffix("s")
    old, new = _by_name(before), _by_name(after)
    if old is None or new is None:
        old, new = dict(enumerate(before)), dict(enumerate(after))
    for name in dict.fromkeys((*new, *old)):
        said = f"{one} {name + 1}" if isinstance(name, int) else f"{one} {shown(name)}"
        if name not in old:
            yield f"{', '.join((*place[:-1], said))}: not there before"
        elif name not in new:
            yield f"{', '.join((*place[:-1], said))}: no longer there"
        else:
            yield from _changed(old[name], new[name], (*place[:-1], said))
    kept = [name for name in new if name in old]
    if kept != [name for name in old if name in new]:
        # Without combination, the first unit gives the main result.
        was = ", ".join(shown(name) for name in old if name in new)
        now = ", ".join(shown(name) for name in kept)
        yield f"order of {', '.join(place)}: {was} before, {now} now"


def _by_name(tables: list[dict[str, Any]]) -> dict[str | int, dict[str, Any]] | None:
    """Tables by name; None if a name is missing or repeated."""
    named = {table["name"]: table for table in tables if isinstance(table.get("name"), str)}
    return dict(named) if len(named) == len(tables) and "" not in named else None


def _tables(given: Any) -> bool:
    return isinstance(given, list) and all(isinstance(part, dict) for part in given)


def _same(before: Any, after: Any) -> bool:
    # Python treats True as 1; a configuration does not.
    if isinstance(before, bool) != isinstance(after, bool):
        return False
    return bool(before == after)


def _now(value: Any) -> str:
    return "" if isinstance(value, dict) else f", {_value(value)} now"


def _value(given: Any) -> str:
    return "a table" if isinstance(given, dict) else shown(given)
