"""The one table of units: spellings that cannot be confused, and factors."""

from __future__ import annotations

import math
from collections import Counter

import pytest

from strapdown import units
from strapdown.units import FACTORS, OF_CRASHES, OF_LOGS, OF_TABLES, find_unit, unit_of, unit_words


@pytest.mark.parametrize(
    ("among", "shared"),
    [
        # Increments of angles and of velocity have the units of angles and speeds.
        (OF_LOGS, set()),
        (OF_TABLES, set()),
        # Kilonewtons, not knots.
        (OF_CRASHES, {"kn"}),
    ],
)
def test_a_spelling_has_one_meaning(among: tuple[str, ...], shared: set[str]) -> None:
    seen = Counter(spelling for quantity in among for spelling in units._UNIT_OF[quantity])
    assert {spelling for spelling, count in seen.items() if count > 1} == shared


def test_every_unit_can_be_written_by_its_own_name() -> None:
    for quantity, table in FACTORS.items():
        for unit in table:
            # In lower case mG is milli-g.
            if not unit.startswith("-") and unit != "mG":
                assert find_unit(unit, (quantity,)) == (quantity, unit)


@pytest.mark.parametrize(
    ("text", "unit"),
    [
        ("m.s^-2", "m/s2"),
        ("m s^-2", "m/s2"),
        ("m·s⁻²", "m/s2"),
        ("meters/sec/sec", "m/s2"),
        ("G's", "g"),
        ("gs", "g"),
        ("(°/s)", "deg/s"),
        ("º/s", "deg/s"),
        ("degrees/s", "deg/s"),
        ("DPS", "deg/s"),
        ("rads/s", "rad/s"),
        ("Ga", "gauss"),
        ("g·s", "g*s"),
        ("kn", None),
        ("furlong", None),
        ("(T)", "T"),
        ("t", None),
        ("local_flux*", "local_flux"),
    ],
)
def test_spellings_of_logs(text: str, unit: str | None) -> None:
    assert unit_of(text) == unit


def test_a_unit_at_the_end_of_a_name() -> None:
    assert unit_words(["a", "m", "per", "s", "2"]) == (["a"], "m/s2")
    assert unit_words(["acc", "x", "m", "per", "s2"]) == (["acc", "x"], "m/s2")
    assert unit_words(["speed", "km", "h"], OF_TABLES) == (["speed"], "km/h")
    assert unit_words(["ms"]) == (["ms"], "")  # a name has a word before its unit


def test_factors() -> None:
    assert FACTORS["rate"]["deg/h"] == pytest.approx(math.radians(1.0) / 3600.0, rel=1e-15)
    assert FACTORS["velocity"]["kn"] * 3600.0 == pytest.approx(1852.0, rel=1e-15)
    assert FACTORS["velocity"]["mph"] * 3600.0 == pytest.approx(5280 * 0.3048, rel=1e-15)
    assert FACTORS["force"]["lbf"] == pytest.approx(0.45359237 * 9.80665, rel=1e-15)
