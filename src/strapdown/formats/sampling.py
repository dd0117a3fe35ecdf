"""How a row of rates was sampled."""

from __future__ import annotations

from strapdown.errors import ConfigError, Finding
from strapdown.formats.recording import RawLog, ReadOptions
from strapdown.tables import SAMPLINGS

__all__ = ["sampling_of_rates"]


def sampling_of_rates(raw: RawLog, options: ReadOptions, findings: list[Finding]) -> str:
    """As stated by the user, else by the file, else at the stamps.

    Parameters
    ----------
    raw : RawLog
    options : ReadOptions
    findings : list of Finding
        What was assumed is added.

    Returns
    -------
    {'instantaneous', 'mean'}

    Raises
    ------
    ConfigError
        There is no such kind.
    """
    asked = (options.sampling or raw.sampling or "").lower()
    if not asked:
        findings.append(
            Finding(
                "io.sampling-taken-as-instantaneous",
                severity="note",
                file=raw.name,
                quantity="sampling",
            )
        )
        return "instantaneous"
    if asked not in SAMPLINGS:
        raise ConfigError(
            "io.sampling-unknown", quantity="--sampling", asked=asked, word=asked, known=SAMPLINGS
        )
    return asked
