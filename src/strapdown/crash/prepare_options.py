"""What may be asked of `prepare_unit`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from strapdown.errors import ConfigError
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
                "crash.preparation-option-unknown",
                quantity="preparation",
                name=name,
                word=str(name),
                known=OPTIONS,
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
            "crash.gravity-nowhere-ground", file=unit, quantity="gravity", gravity=gravity
        )
    if not (isinstance(rest, str) and rest == "auto") and not _is_stretch(rest):
        raise ConfigError("crash.no-stretch", file=unit, quantity="rest", rest=rest)
    if levelling is not None:
        code = "crash.levelling-not-three-numbers"
        _, pitch, sd = triple(levelling, "levelling", code, unit)
        if abs(pitch) > 90.0 or sd < 0.0:
            raise ConfigError(
                "crash.levelling-out-of-range",
                file=unit,
                quantity="levelling",
                levelling=repr(levelling),
            )
    for name in ("impact", "margin", "hysteresis", "fade"):
        if not finite(given[name]):
            raise ConfigError(
                "crash.preparation-not-a-number", file=unit, quantity=name, given=given[name]
            )
    check_sd(given["steady_acceleration"], "steady_acceleration", "m/s²", unit)
    check_sd(given["steady_rate"], "steady_rate", "rad/s", unit)


def _is_stretch(given: Any) -> bool:
    try:
        start, end = given
    except (TypeError, ValueError):
        return False
    return finite(start) and finite(end) and start < end
