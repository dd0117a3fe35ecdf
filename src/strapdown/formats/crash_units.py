"""Units of crash records: text to quantity and factor to SI."""

from __future__ import annotations

from strapdown.constants import ACCEL_UNITS, GYRO_UNITS, TIME_UNITS
from strapdown.errors import ConfigError
from strapdown.formats.unit_words import UNIT_OF
from strapdown.formats.unit_words import unit_of as plain_unit_of

__all__ = ["FACTORS", "factor_of", "state_unit", "unit_of"]

#: Units of each quantity, with the factor to SI. Mile, foot, inch and pound are those of the
#: international agreement of 1959: 0.3048 m per foot, 0.45359237 kg per pound.
FACTORS: dict[str, dict[str, float]] = {
    "acceleration": dict(ACCEL_UNITS),
    "rate": dict(GYRO_UNITS),
    "velocity": {"m/s": 1.0, "km/h": 1.0 / 3.6, "mph": 0.44704, "ft/s": 0.3048, "mm/s": 1e-3},
    "displacement": {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "in": 0.0254, "ft": 0.3048},
    "force": {"N": 1.0, "kN": 1e3, "lbf": 4.4482216152605},
    "time": dict(TIME_UNITS),
}
_QUANTITY = {unit: quantity for quantity, units in FACTORS.items() for unit in units}
# Spellings of crash laboratories and recorders, in addition to those of other logs.
_SPELLINGS = {
    "m/s2": "m/(s*s) m/(s^2) m/s*s m/ss m/sec2 m/sec^2 m/s**2 meters/sec/sec",
    "g": "g's g`s g-force gn g_n",
    "rad/s": "radians/s radians/sec 1/s*rad",
    "deg/s": "degrees/s degrees/sec degree/s deg/second °/sec",
    "m/s": "meters/second metres/second",
    "km/h": "km/h kph kmh km/hr kmph km_h km_per_h km·h-1",
    "mph": "mph mi/h mile/h miles/h miles/hour mi/hr",
    "ft/s": "ft/s ft/sec fps feet/s ft_s",
    "mm/s": "mm/s",
    "m": "m meter metre meters metres",
    "cm": "cm",
    "mm": "mm millimeter millimetre millimeters millimetres",
    "in": "in inch inches",
    "ft": "ft feet foot",
    "N": "n newton newtons nwt",
    "kN": "kn kilonewton kilonewtons",
    "lbf": "lbf lbs",
}
_UNIT_OF = {
    **{text: unit for text, unit in UNIT_OF.items() if unit in _QUANTITY},
    **{spelling: unit for unit, text in _SPELLINGS.items() for spelling in text.split()},
}


def unit_of(text: str) -> tuple[str, str] | None:
    """Parse a unit as written in a file.

    Parameters
    ----------
    text : str
        As ``m/(s*s)``, ``G's``, ``km/h``, ``[deg/s]``.

    Returns
    -------
    (str, str) or None
        The quantity, a key of `FACTORS`, and the unit, a key of its table; None if the unit is
        unknown.
    """
    plain = text.lower().replace(" ", "").strip("[]\t")
    unit = _UNIT_OF.get(plain) or _UNIT_OF.get(plain.strip("()")) or plain_unit_of(plain)
    return (_QUANTITY[unit], unit) if unit in _QUANTITY else None


def factor_of(quantity: str, unit: str) -> float | None:
    """Return the factor to SI, or None if the quantity does not have the unit."""
    return FACTORS.get(quantity, {}).get(unit)


def state_unit(text: str, quantity: str, key: str = "unit") -> str:
    """Check a unit stated in a case.

    Parameters
    ----------
    text : str
    quantity : str
        A key of `FACTORS`.
    key : str
        Key of the case, for the message.

    Returns
    -------
    str
        In the spelling of this package.

    Raises
    ------
    ConfigError
        The quantity does not have this unit.
    """
    known = FACTORS[quantity]
    if text in known:
        return text
    found = unit_of(text)
    if found is None or found[0] != quantity:
        raise ConfigError(
            "io.crash-unit-of-other-quantity" if found else "io.crash-unit-unknown",
            quantity=key,
            is_of=found[0] if found else None,
            needed=quantity,
            word=text,
            known=known,
        )
    return found[1]
