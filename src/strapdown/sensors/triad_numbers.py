"""Three numbers of a person, or one."""

from __future__ import annotations

import math
from typing import Any

from strapdown.errors import ConfigError
from strapdown.sensors.triad_errors import Triad
from strapdown.tables.checks import is_number

#: No point of a road vehicle is farther from another: beyond it, a place is in mm.
FARTHEST = 30.0  # m


def triple(given: Any, quantity: str, code: str, file: str | None = None, **values: Any) -> Triad:
    """Three finite numbers.

    Parameters
    ----------
    given : object
    quantity : str
    code : str
        Of the error, whose data hold `given` and `values`.
    file : str, optional
    **values
        Further data of the error.

    Raises
    ------
    ConfigError
        They are others.
    """
    try:
        x, y, z = (float(v) for v in given)
    except (TypeError, ValueError):
        x = y = z = math.nan
    if isinstance(given, str) or not (math.isfinite(x) and math.isfinite(y) and math.isfinite(z)):
        raise ConfigError(code, file=file, quantity=quantity, data={**values, "given": repr(given)})
    return x, y, z


def finite(given: Any) -> bool:
    """Whether this is one real and finite number."""
    return is_number(given) and math.isfinite(given)


def check_sd(given: Any, quantity: str, unit: str, file: str | None = None) -> None:
    """Check a standard deviation.

    Raises
    ------
    ConfigError
        It is no number, negative or not finite.
    """
    if not finite(given) or given < 0.0:
        raise ConfigError(
            "sensors.standard-deviation-invalid",
            file=file,
            quantity=quantity,
            given=given,
            unit=unit,
        )
