"""Quantities whose keys tell their unit: which units there are, and what they are in ours."""

from __future__ import annotations

import math
from typing import Any

from strapdown.constants import STANDARD_GRAVITY

__all__ = ["base_of", "converted", "keys_of"]

# By the ending of a key of a specification, the endings that are understood in its place, and the
# number to multiply with and the one to divide by: 600 mm are 0.6 m to the last bit.
UNITS: dict[str, dict[str, tuple[float, float]]] = {
    "_m_per_s2": {"_m_per_s2": (1.0, 1.0), "_g": (STANDARD_GRAVITY, 1.0)},
    "_m_per_s": {"_m_per_s": (1.0, 1.0), "_km_per_h": (1.0, 3.6), "_mph": (0.44704, 1.0)},
    "_m": {
        "_m": (1.0, 1.0),
        "_mm": (1.0, 1000.0),
        "_cm": (1.0, 100.0),
        "_in": (0.0254, 1.0),
        "_ft": (0.3048, 1.0),
    },
    "_s": {"_s": (1.0, 1.0), "_ms": (1.0, 1000.0)},
    "_kg": {"_kg": (1.0, 1.0), "_lb": (0.45359237, 1.0)},
    "_deg_per_s": {"_deg_per_s": (1.0, 1.0)},
    "_deg": {"_deg": (1.0, 1.0)},
    "_hz": {"_hz": (1.0, 1.0)},
}


def _ending(name: str) -> str | None:
    fits = [ending for ending in UNITS if name.endswith(ending)]
    found = max(fits, key=len, default=None)
    # The s of a rate or of a square root is no time.
    of_another = found is not None and name.removesuffix(found).endswith(("_per", "_sqrt"))
    return None if of_another else found


def base_of(name: str) -> str:
    """A key of a specification without its unit: ``speed`` of ``speed_m_per_s``."""
    return name.removesuffix(_ending(name) or "")


def keys_of(name: str) -> tuple[str, ...]:
    """The keys under which a person may give a field, the field's own first."""
    ending = _ending(name)
    if ending is None:
        return (name,)
    return tuple(base_of(name) + unit for unit in UNITS[ending])


def converted(value: Any, key: str, name: str) -> Any:
    """A value as a key gives it, in the unit of a field.

    Parameters
    ----------
    value : object
        A number, or lists of them; what is none is returned as it is.
    key : str
        One of `keys_of` the field.
    name : str
        Of the field.
    """
    ending = _ending(name)
    if key == name or ending is None:
        return value
    if isinstance(value, list):
        return [converted(part, key, name) for part in value]
    if isinstance(value, bool) or not isinstance(value, int | float):
        return value
    multiply, divide = UNITS[ending][key.removeprefix(base_of(name))]
    try:
        return value * multiply / divide
    except OverflowError:
        return math.inf if value > 0 else -math.inf
