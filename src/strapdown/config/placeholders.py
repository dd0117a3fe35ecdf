"""What a case leaves open: values that only the user can know, written as a question mark."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

from strapdown.config.case_wanted import wanted_at
from strapdown.config.toml_file import TomlFile, place_of
from strapdown.config.toml_lines import KeyPath
from strapdown.errors import ConfigError, Finding

__all__ = ["PLACEHOLDER", "refuse_placeholders"]

#: Stands where only the user can know.
PLACEHOLDER = "?"
#: More of them are counted, not listed.
MOST = 60


def refuse_placeholders(file: TomlFile, wanted_of: Callable[[KeyPath], str] = wanted_at) -> None:
    """Name every value that is still open.

    Raises
    ------
    ConfigError
        There are some; the message has the line of each, and what is wanted there.
    """
    # A vector that is open in each component is one.
    open_keys = list(dict.fromkeys(_open(file.table, ())))
    if not open_keys:
        return
    values = [
        Finding(
            "config.open-value",
            line=file.line(path),
            quantity=place_of(path),
            wanted=wanted_of(path),
        )
        for path in open_keys[:MOST]
    ]
    count = len(open_keys)
    code = "config.open-values" if count > 1 else "config.one-open-value"
    if count > MOST:
        code = "config.many-open-values"
    raise ConfigError(
        code,
        file=file.path.name,
        count=count,
        more=count - len(values),
        values=values,
        placeholder=PLACEHOLDER,
    )


def _open(node: Any, path: KeyPath) -> Iterator[KeyPath]:
    if isinstance(node, dict):
        for key, value in node.items():
            yield from _open(value, (*path, key))
    elif isinstance(node, list):
        for k, value in enumerate(node):
            if isinstance(value, dict):
                yield from _open(value, (*path, k))
            else:
                yield from (path for _ in _open(value, path))
    elif isinstance(node, str) and node.strip() == PLACEHOLDER:
        yield path
