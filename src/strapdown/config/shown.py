"""What a file says, in a message: short, and without what a terminal would obey."""

from __future__ import annotations

from typing import Any

__all__ = ["LONGEST", "shown", "shown_key"]

#: Longer values are cut in a message.
LONGEST = 80


def shown(value: Any) -> str:
    """A value as a file would write it, cut where it is long."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        text = repr(value[: LONGEST + 1])
    elif isinstance(value, list | tuple) and len(value) > LONGEST:
        text = repr(value[:LONGEST])
    elif isinstance(value, int) and abs(value) >= 10**LONGEST:
        return f"an integer of {value.bit_length()} bits"
    else:
        try:
            text = repr(value)
        except (RecursionError, ValueError):
            return f"a {type(value).__name__}"
    return text if len(text) <= LONGEST else f"{text[: LONGEST - 1]}…"


def shown_key(key: str) -> str:
    """A key as it is, but for what cannot be printed."""
    text = key if key.isprintable() and key else repr(key[: LONGEST + 1])
    return text if len(text) <= LONGEST else f"{text[: LONGEST - 1]}…"
