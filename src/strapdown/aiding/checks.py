"""Options of aids that are no numbers, or out of range."""

from __future__ import annotations

import math

from strapdown.aiding.aid import Aid
from strapdown.aiding.view import View
from strapdown.errors import ConfigError
from strapdown.tables.checks import is_number

__all__ = ["check_block", "check_number", "check_numbers", "check_other_name"]


def check_number(
    aid: Aid, name: str, *, low: float = -math.inf, high: float = math.inf, above: bool = False
) -> None:
    """Refuse an option that is no number within limits.

    Parameters
    ----------
    aid : Aid
    name : str
        Of the option.
    low, high : float
    above : bool
        Whether it must be more than `low`.

    Raises
    ------
    ConfigError
        It is not.
    """
    value = getattr(aid, name)
    good = is_number(value) and math.isfinite(value) and low <= value <= high
    if not good or (above and value == low):
        if high < math.inf:
            code = "navigation.option-not-between"
        elif low == -math.inf:
            code = "navigation.option-not-finite"
        else:
            code = "navigation.option-not-above" if above else "navigation.option-below"
        raise ConfigError(
            code, file=aid.name or None, quantity=name, value=value, least=low, most=high
        )


def check_numbers(aid: Aid, name: str, count: int, *, low: float = -math.inf) -> None:
    """Refuse an option that is not so many finite numbers; keep them as a tuple of float.

    Parameters
    ----------
    aid : Aid
    name : str
    count : int
    low : float

    Raises
    ------
    ConfigError
        It is not.
    """
    value = getattr(aid, name)
    try:
        given = list(value)
    except TypeError:
        given = []
    if len(given) != count or not all(
        is_number(x) and math.isfinite(x) and x >= low for x in given
    ):
        raise ConfigError(
            "navigation.no-numbers" if low == -math.inf else "navigation.no-numbers-from",
            file=aid.name or None,
            quantity=name,
            value=value,
            count=count,
            least=low,
        )
    object.__setattr__(aid, name, tuple(float(x) for x in given))


def check_block(view: View, name: str) -> None:
    """Refuse a block of states that the filter does not have.

    Parameters
    ----------
    view : View
    name : str

    Raises
    ------
    ConfigError
        It is not there; what is is named.
    """
    view.model.layout[name]


def check_other_name(aid: Aid, name: str) -> None:
    """Refuse an option that is no name of another aid; nothing is one.

    Parameters
    ----------
    aid : Aid
    name : str
        Of the option.

    Raises
    ------
    ConfigError
        It is no text, or the aid's own name.
    """
    value = getattr(aid, name)
    if not isinstance(value, str) or (value and value == aid.name):
        raise ConfigError(
            "navigation.other-aid-name-invalid", file=aid.name or None, quantity=name, value=value
        )
