"""Several things that are wrong in one file, told at once."""

from __future__ import annotations

from collections.abc import Sequence

from strapdown.errors import ConfigError

__all__ = ["together"]


def together(found: Sequence[ConfigError]) -> ConfigError:
    """Return several errors as one.

    Parameters
    ----------
    found : sequence of ConfigError
        One or more, of one file.

    Returns
    -------
    ConfigError
        In the order of the lines; a single one as it is.
    """
    if len(found) == 1:
        return found[0]
    lines = []
    for error in sorted(found, key=lambda e: e.finding.line or 0):
        f = error.finding
        place = ", ".join(str(p) for p in (f.line and f"line {f.line}", f.quantity) if p)
        lines += [f"  {place}: {f.what}" if place else f"  {f.what}", f"    {f.remedy}"]
    return ConfigError(
        "config.message",
        file=found[0].finding.file,
        message="\n".join([f"{len(found)} things do not fit:", *lines]),
        remedy_text="mend each of them",
    )
