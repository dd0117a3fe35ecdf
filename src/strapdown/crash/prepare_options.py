"""What may be asked of `prepare_unit`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from strapdown.exceptions import ConfigError, nearest
from strapdown.sensors.triad_numbers import check_sd, finite, triple

__all__ = ["OPTIONS", "check_options", "checked_options"]

OPTIONS = (
    "gravity",
    "rest",
    "levelling",
    "impact",
    "moving_at_impact",
    "steady_acceleration",
    "steady_rate",
    "match_gravity",
    "margin",
    "hysteresis",
    "fade",
)


def checked_options(options: Mapping[str, Any]) -> dict[str, Any]:
    """Return the options, all of them known.

    Raises
    ------
    ConfigError
        One is not.
    """
    for name in options:
        if name not in OPTIONS:
            raise ConfigError(
                f"there is no option {name!r}",
                quantity="preparation",
                remedy=nearest(str(name), OPTIONS),
            )
    return dict(options)


def check_options(unit: str, **given: Any) -> None:
    """Check the options of a unit's preparation.

    Raises
    ------
    ConfigError
        One is out of range, or of another kind.
    """
    gravity, rest, levelling = given["gravity"], given["rest"], given["levelling"]
    if not (finite(gravity) and 9.7 < gravity < 9.9):
        raise ConfigError(
            f"{gravity!r} m/s² is gravity nowhere on the ground",
            file=unit,
            quantity="gravity",
            remedy="give it in m/s², or leave it out",
        )
    if not (isinstance(rest, str) and rest == "auto") and not _is_stretch(rest):
        raise ConfigError(
            f"{rest!r} is no stretch",
            file=unit,
            quantity="rest",
            remedy="say 'auto', or give its start and end in s from the trigger, as (-3, -1)",
        )
    if levelling is not None:
        how = "give roll, pitch and their standard deviation in deg, as in (0, 0, 1)"
        _, pitch, sd = triple(levelling, "levelling", how, unit)
        if abs(pitch) > 90.0 or sd < 0.0:
            raise ConfigError(
                f"{levelling!r} is no attitude with its standard deviation",
                file=unit,
                quantity="levelling",
                remedy=how,
            )
    for name in ("impact", "margin", "hysteresis", "fade"):
        if not finite(given[name]):
            raise ConfigError(
                f"{given[name]!r} is no number",
                file=unit,
                quantity=name,
                remedy="give one finite number, or leave it out",
            )
    check_sd(given["steady_acceleration"], "steady_acceleration", "m/s²", unit)
    check_sd(given["steady_rate"], "steady_rate", "rad/s", unit)


def _is_stretch(given: Any) -> bool:
    try:
        start, end = given
    except (TypeError, ValueError):
        return False
    return finite(start) and finite(end) and start < end
