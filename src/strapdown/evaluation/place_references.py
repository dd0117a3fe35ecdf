"""Reference points of position, in words: where the sensor was at rest, and what is known of it.

::

    12.5 same place as 3.0
    end same place as start sd 0.01
    12.5 moved 0.30 0 0 m since 3.0

Both instants lie within rests. A displacement is along the axes of the run's local level: ahead
in the direction that the run calls north, to the right of it, and down.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from strapdown.errors import ConfigError
from strapdown.evaluation.reference_points import INSTANT, NUMBER, instant

__all__ = ["PlaceReference", "is_place", "parse_place"]

_UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3}
_SD = rf"(?:\s+sd\s+(?P<sd>{NUMBER})(?:\s*(?P<sd_unit>mm|cm|m))?)?"
_SAME = re.compile(
    rf"(?P<at>{INSTANT})\s+same\s+place\s+as\s+(?P<since>{INSTANT}){_SD}", re.IGNORECASE
)
_MOVED = re.compile(
    rf"(?P<at>{INSTANT})\s+moved\s+(?P<x>{NUMBER})\s+(?P<y>{NUMBER})\s+(?P<z>{NUMBER})\s*"
    rf"(?P<unit>mm|cm|m)\s+since\s+(?P<since>{INSTANT}){_SD}",
    re.IGNORECASE,
)
_HOW = "write '12.5 same place as 3.0', or '12.5 moved 0.30 0 0 m since 3.0 sd 0.01'"


@dataclass(frozen=True)
class PlaceReference:
    """What is known of a displacement.

    Attributes
    ----------
    time, since : float, s
    moved : tuple of float, m
        Along the axes of the run's local level (north, east, down by its own heading).
    sd : float or None, m
        How well it is known, root mean square of the length.
    """

    time: float
    since: float
    moved: tuple[float, float, float]
    sd: float | None = None

    def __str__(self) -> str:
        at, since = (f"{t:.3f}".rstrip("0").rstrip(".") for t in (self.time, self.since))
        if not any(self.moved):
            return f"{at} s: same place as at {since} s"
        return f"{at} s: moved {' '.join(f'{m:g}' for m in self.moved)} m since {since} s"


def is_place(text: str) -> bool:
    """Tell whether a sentence speaks of a place and not of an attitude.

    Parameters
    ----------
    text : str

    Returns
    -------
    bool
    """
    return re.search(r"same[ -]place|\bmoved\b", text, re.IGNORECASE) is not None


def parse_place(text: str, start: float, end: float) -> PlaceReference:
    """Read one reference point of position.

    Parameters
    ----------
    text : str
        As in the module's text; ``same-place-as``, commas, colons and equals signs are
        understood, too.
    start, end : float, s
        What these words stand for, and the span in which instants must lie.

    Returns
    -------
    PlaceReference

    Raises
    ------
    ConfigError
        It is not understood.
    DataError
        An instant lies outside the log.
    """
    plain = re.sub(r"same-place-as", "same place as", text.partition("#")[0], flags=re.IGNORECASE)
    plain = re.sub(r"[:=,]", " ", plain).strip()
    match = _SAME.fullmatch(plain) or _MOVED.fullmatch(plain)
    if match is None:
        raise ConfigError("evaluation.not-understood", quantity="reference", text=text)
    said = match.groupdict()
    unit = _UNITS[(said.get("unit") or "m").lower()]
    x, y, z = (float(said.get(axis) or 0.0) * unit for axis in "xyz")
    sd = None
    if said["sd"] is not None:
        sd = float(said["sd"]) * _UNITS[(said["sd_unit"] or "m").lower()]
        if not sd > 0.0:
            raise ConfigError(
                "evaluation.standard-deviation-not-positive", quantity="reference", text=text
            )
    at, since = (instant(said[key], start, end, text) for key in ("at", "since"))
    if since >= at:
        raise ConfigError(
            "evaluation.compares-not-before", quantity="reference", text=text, at=at, since=since
        )
    return PlaceReference(at, since, (x, y, z), sd)
