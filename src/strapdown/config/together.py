"""Several faults of one file as one error."""

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
    faults = sorted((error.finding for error in found), key=lambda f: f.line or 0)
    return ConfigError("config.several", file=faults[0].file, count=len(faults), faults=faults)
