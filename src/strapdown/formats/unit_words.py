"""Spellings of units, and units of raw counts."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping

from strapdown.constants import (
    ACCEL_SUMS,
    ACCEL_UNITS,
    GYRO_SUMS,
    GYRO_UNITS,
    MAG_UNITS,
    TIME_UNITS,
)
from strapdown.errors import ConfigError

__all__ = ["UNIT_OF", "factor_of", "parse_unit", "unit_of"]

# Each spelling to its canonical word.
_SPELLINGS = {
    "rad/s": "rad/s rad_s rads rad_per_s rad/sec radps rad·s-1 rad*s^-1 rad.s-1",
    "mrad/s": "mrad/s mrad_s",
    "deg/s": "deg/s deg_s degs dps °/s °_s º/s deg_per_s deg/sec degps",
    "mdeg/s": "mdeg/s mdps mdeg_s",
    "deg/h": "deg/h deg/hr deg_h deg_per_h °/h",
    "m/s2": "m/s2 m/s^2 m/s² m_s2 ms2 ms-2 mps2 m_per_s2 m/s/s m·s-2 m*s^-2",
    "g": "g g0 gs",
    "m/s": "m/s m_s mps m_per_s m/sec m·s-1 m*s^-1",
    "g*s": "g*s g·s g_s",
    "mg": "mg",
    "uT": "ut µt μt microtesla",
    "nT": "nt nanotesla",
    "gauss": "gauss",
    "mG": "mgauss milligauss",
    "T": "tesla",
    "s": "s sec secs second seconds",
    "ms": "ms msec millis milliseconds",
    "us": "us µs μs usec micros microseconds",
    "ns": "ns nsec nanos nanoseconds",
    "min": "min minutes",
    "deg": "deg ° degree degrees",
    "rad": "rad radian radians",
}
UNIT_OF = {spelling: unit for unit, text in _SPELLINGS.items() for spelling in text.split()}
# Powers of a second, with any separator of the factors: rad s^-1, m·s⁻².
_POWERS = {
    "rads-1": "rad/s",
    "mrads-1": "mrad/s",
    "degs-1": "deg/s",
    "°s-1": "deg/s",
    "ms-2": "m/s2",
    "ms-1": "m/s",
}
_RAISED = str.maketrans({"⁻": "-", "−": "-", "¹": "1", "²": "2"})
_NUMBER = r"\d+(?:\.\d*)?(?:[eE][+-]?\d+)?"
# Counts per unit, as in deg/s/131; or units per count, as in 1/131 deg/s.
_PARTS = re.compile(rf"(?P<unit>.*\D)/\s*(?P<counts>{_NUMBER})")
_TIMES = re.compile(rf"(?P<up>{_NUMBER})(?:\s*/\s*(?P<down>{_NUMBER}))?\s*[ *·]\s*(?P<unit>\D.*)")


def unit_of(text: str) -> str | None:
    """Parse the spelling of a unit.

    Parameters
    ----------
    text : str
        As ``rad/s``, ``[deg/s]``, ``m s^-2``, in any case.

    Returns
    -------
    str or None
        In the spelling of this package.
    """
    word = re.sub(r"\s+", "", text.strip().strip("[]()").lower())
    if word in UNIT_OF:
        return UNIT_OF[word]
    return _POWERS.get(re.sub(r"[·*.^]", "", word.translate(_RAISED)))


def parse_unit(text: str, kind: str) -> str:
    """Check a unit that the user stated.

    Parameters
    ----------
    text : str
        A unit; for a gyro or an accelerometer also one of raw counts, as ``deg/s/131`` or
        ``g/16384`` (counts per unit), or ``1/131 deg/s`` or ``0.061 deg/s`` (units per
        count).
    kind : {'gyro', 'accel', 'mag', 'time'}

    Returns
    -------
    str
        In the spelling of this package; `factor_of` has its factor.

    Raises
    ------
    ConfigError
        The text is not a unit of that kind.
    """
    known = {
        "gyro": {**GYRO_UNITS, **GYRO_SUMS},
        "accel": {**ACCEL_UNITS, **ACCEL_SUMS},
        "mag": MAG_UNITS,
        "time": TIME_UNITS,
    }[kind]
    unit = _word(text)
    if unit in known:
        return unit
    counted = kind in ("gyro", "accel")
    scale, of = _taken_apart(text) if counted else (None, "")
    if scale is None or (unit := _word(of)) not in known:
        raise ConfigError(
            "io.unknown-unit-or-counts" if counted else "io.unknown-unit",
            quantity=f"--{kind}-unit",
            word=text,
            known=known,
            example="deg/s/131" if kind == "gyro" else "g/16384",
        )
    counts = f"{1.0 / scale:g}"
    exact = math.isclose(float(counts) * scale, 1.0, rel_tol=1e-12)
    return f"{unit}/{counts}" if exact else f"{scale!r} {unit}"


def factor_of(unit: str, known: Mapping[str, float]) -> float:
    """Return the factor from a unit to SI.

    Parameters
    ----------
    unit : str
        As returned by `parse_unit`.
    known : mapping of str to float
        Factors of plain units.

    Returns
    -------
    float
    """
    if unit in known:
        return known[unit]
    scale, of = _taken_apart(unit)
    return float(scale or 1.0) * known[of]


def _word(text: str) -> str:
    """Return the unit of a text, or the text; for accelerometers also with the sign of iOS."""
    bare = text.strip()
    if bare.startswith("-") and (unit := unit_of(bare[1:])):
        return f"-{unit}"
    return unit_of(bare) or bare


def _taken_apart(text: str) -> tuple[float | None, str]:
    """Parse how much of which unit a count is; None if the text has no such form."""
    bare = text.strip()
    if match := _PARTS.fullmatch(bare):
        up, down, unit = 1.0, float(match["counts"]), match["unit"]
    elif match := _TIMES.fullmatch(bare):
        up, down, unit = float(match["up"]), float(match["down"] or 1.0), match["unit"]
    else:
        return None, ""
    scale = up / down if down > 0.0 else math.inf
    return (scale if 0.0 < scale < math.inf else None), unit
