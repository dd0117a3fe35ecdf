"""How a row of rates was sampled."""

from __future__ import annotations

from strapdown.exceptions import ConfigError, Finding, nearest
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
                "each row is taken as the rate at its stamp: nothing says that it is a mean",
                file=raw.name,
                quantity="sampling",
                remedy="say --sampling mean for a sensor that averages over its interval",
            )
        )
        return "instantaneous"
    if asked not in SAMPLINGS:
        raise ConfigError(
            f"'{asked}' is no kind of sampling",
            quantity="--sampling",
            remedy=nearest(asked, SAMPLINGS),
        )
    return asked
