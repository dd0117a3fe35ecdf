"""Progress reports of a long run."""

from __future__ import annotations

from collections.abc import Callable

#: Called with a stage and the share of the whole that is done.
Progress = Callable[[str, float], None]


def silent(stage: str, share: float) -> None:
    """Ignore progress."""
