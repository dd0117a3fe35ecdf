"""The rate of a record without time, where a line above its table states one."""

from __future__ import annotations

import re
from collections.abc import Sequence

__all__ = ["stated_rate"]

_RATE = re.compile(
    r"(?<![\w.,])(\d+(?:[.,]\d+)?)\s*(k?)\s*(?:hz|sps|s/s|samples?\s*(?:/|per)\s*s)", re.I
)
# Rates at which crashes are recorded, Hz.
SLOWEST, FASTEST = 5.0, 200_000.0
# A filter's limit is in Hz, too.
_OTHER = re.compile(
    r"filter|cfc|band ?width|bandbreite|cut.?off|grenzfrequenz|low.?pass|tiefpass", re.I
)


def stated_rate(remarks: Sequence[str]) -> tuple[float, str] | None:
    """Find the samples a second that lines above a table state.

    Parameters
    ----------
    remarks : sequence of str

    Returns
    -------
    (rate, line) or None
        In Hz; None where no line states one, or two state different ones.
    """
    found: dict[float, str] = {}
    for line in remarks:
        if _OTHER.search(line):
            continue
        for said in _RATE.finditer(line):
            # A comma of three digits parts thousands in one country and decimals in another.
            if re.fullmatch(r"\d+[.,]\d{3}", said[1]):
                return None
            rate = float(said[1].replace(",", ".")) * (1000.0 if said[2] else 1.0)
            if SLOWEST <= rate <= FASTEST:
                found.setdefault(rate, line)
    return next(iter(found.items())) if len(found) == 1 else None
