"""Other ways in which a direction of force is written."""

from __future__ import annotations

import math
from dataclasses import dataclass

from strapdown.errors import ConfigError

__all__ = [
    "CONVENTIONS",
    "PdofConvention",
    "clock_of",
    "direction_of_clock",
    "from_convention",
    "to_convention",
]


@dataclass(frozen=True)
class PdofConvention:
    """How a horizontal direction is written.

    Attributes
    ----------
    meaning : str
        For people, with the source.
    to : bool
        The direction in which the force pushes, and not that which it comes from.
    clockwise : bool
        Seen from above.
    full_turn : bool
        In [0, 360), and not in (-180, 180].
    """

    meaning: str
    to: bool = False
    clockwise: bool = True
    full_turn: bool = False


#: Zero is ahead in all of them.
CONVENTIONS: dict[str, PdofConvention] = {
    "strapdown": PdofConvention(
        "the direction the force came from, clockwise, -180 to 180: 90 from the right"
    ),
    "nhtsa": PdofConvention(
        "the direction the force came from, clockwise, 0 to 360: 90 from the right, 350 from "
        "the front and a little from the left (degrees of the NASS CDS, CIREN and CISS files, "
        "whose clock is that of SAE J224)",
        full_turn=True,
    ),
    "counterclockwise": PdofConvention(
        "the direction the force came from, counterclockwise, -180 to 180: 90 from the left (axes "
        "forward-left-up, as of ISO 8855)",
        clockwise=False,
    ),
    "delta-v": PdofConvention(
        "the direction of the change of velocity, clockwise, -180 to 180: a frontal impact has "
        "180, one from the right -90",
        to=True,
    ),
    "delta-v counterclockwise": PdofConvention(
        "the direction of the change of velocity in axes forward-left-up, -180 to 180: one from "
        "the right has 90",
        to=True,
        clockwise=False,
    ),
    "tadic-2016": PdofConvention(
        "taken as strapdown's: Tadic and Vukajlovic (2016), Table 2, prints signed angles near "
        "zero for a frontal impact, and says neither which side is positive nor the range"
    ),
}


def _convention(name: str) -> PdofConvention:
    if name not in CONVENTIONS:
        raise ConfigError(
            "crash.no-convention-direction-force",
            quantity="convention",
            name=name,
            word=name,
            known=CONVENTIONS,
        )
    return CONVENTIONS[name]


def to_convention(horizontal_deg: float, name: str) -> float:
    """Write a direction in another convention.

    Parameters
    ----------
    horizontal_deg : float, deg
        The direction the force came from, clockwise from the front.
    name : str
        A key of `CONVENTIONS`.

    Returns
    -------
    float, deg

    Raises
    ------
    ConfigError
        The name is unknown, or the angle is not finite.
    """
    how = _convention(name)
    angle = _finite(horizontal_deg) + (180.0 if how.to else 0.0)
    return _wrapped(angle if how.clockwise else -angle, how.full_turn)


def from_convention(angle_deg: float, name: str) -> float:
    """Read a direction that is written in another convention.

    Parameters
    ----------
    angle_deg : float, deg
    name : str
        A key of `CONVENTIONS`.

    Returns
    -------
    float, deg
        The direction the force came from, clockwise from the front, in (-180, 180].

    Raises
    ------
    ConfigError
        As `to_convention`.
    """
    how = _convention(name)
    angle = _finite(angle_deg) if how.clockwise else -_finite(angle_deg)
    return _wrapped(angle - (180.0 if how.to else 0.0), False)


def clock_of(horizontal_deg: float) -> int:
    """Hour that a force came from, 1 to 12.

    Parameters
    ----------
    horizontal_deg : float, deg
        Clockwise from the front.

    Returns
    -------
    int
        The nearest hour, each 30 deg wide: 12 is the front, 3 the right (the clock of the
        Collision Deformation Classification, SAE J224, columns 1 and 2). A direction on the
        border belongs to the hour clockwise of it: 15 deg is 1 o'clock, 345 deg is 12.

    Raises
    ------
    ConfigError
        The angle is not finite.
    """
    return (math.floor(_finite(horizontal_deg) / 30.0 + 0.5) - 1) % 12 + 1


def direction_of_clock(hour: int) -> float:
    """Middle of an hour, deg, in (-180, 180].

    Parameters
    ----------
    hour : int
        1 to 12.

    Returns
    -------
    float, deg
        Within 15 deg of the direction that was coded.

    Raises
    ------
    ConfigError
        It is no hour.
    """
    if hour not in range(1, 13):
        raise ConfigError("crash.no-hour", quantity="clock", hour=hour)
    return _wrapped(30.0 * hour, False)


def _wrapped(angle: float, full_turn: bool) -> float:
    turned = math.fmod(angle, 360.0)
    if full_turn:
        turned += 360.0 if turned < 0.0 else 0.0
        # A tiny negative angle is rounded up to 360.
        return 0.0 if turned >= 360.0 else turned + 0.0
    if turned > 180.0:
        turned -= 360.0
    elif turned <= -180.0:
        turned += 360.0
    return turned + 0.0


def _finite(angle: float) -> float:
    if not math.isfinite(angle):
        raise ConfigError("crash.no-angle", quantity="direction", angle=angle)
    return float(angle)
