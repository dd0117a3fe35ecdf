"""Results of a campaign in words: names of its cells and scalars, numbers and shares."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from strapdown.campaign.summary import DECADES
from strapdown.report.values import GAP, MINUS, decimals, plain, share_words
from strapdown.units import named_unit

Cell = Mapping[str, Any]

_ACRONYMS = ("nees", "nis", "rms", "gnss", "imu")


@dataclass(frozen=True)
class Results:
    """A campaign with its summary.

    Attributes
    ----------
    frozen : mapping
        Content of ``campaign.json``.
    summary : mapping
        From `summarise`, or read from its JSON.
    """

    frozen: Mapping[str, Any]
    summary: Mapping[str, Any]

    @cached_property
    def cells(self) -> list[Cell]:
        """Summaries of the cells with cases."""
        return [
            {**one, "parameters": {k: _word(v) for k, v in one["parameters"].items()}}
            for one in self.summary["cells"]
            if one["count"]
        ]

    @cached_property
    def is_fleet(self) -> bool:
        """Whether a case is a log."""
        return "logs" in self.summary

    @cached_property
    def case_noun(self) -> str:
        """Name of a case."""
        alone = self.is_fleet and (self.frozen.get("cases") or {}).get("draws", 1) == 1
        return "log" if alone and len(self.cells) < 2 else "case"

    @cached_property
    def scalars(self) -> list[str]:
        """Names of the scalars."""
        return list(self.cells[0]["scalars"]) if self.cells else []

    @cached_property
    def grid(self) -> dict[str, list[Any]]:
        """Values of each grid parameter that varies, in order of the cells."""
        if not self.cells:
            return {}
        values = {
            key: list(dict.fromkeys(cell["parameters"][key] for cell in self.cells))
            for key in self.cells[0]["parameters"]
        }
        return {key: found for key, found in values.items() if len(found) > 1}

    @cached_property
    def drawn(self) -> list[str]:
        """Names of the drawn parameters."""
        given = self.frozen.get("parameters") or ()
        return [str(one["name"]) for one in given if one.get("draw")]

    @cached_property
    def cases_words(self) -> str:
        """How many cases there are."""
        run, planned = self.summary["cases"]["run"], self.summary["cases"]["planned"]
        words = counted(run, self.case_noun)
        if planned and planned != run:
            words += f" of {planned:,} planned"
        if len(self.cells) > 1:
            words += f" in {len(self.cells)} cells"
        return words

    def unit(self, parameter: str) -> str:
        """Unit of a parameter."""
        keys = [
            str(one.get("key", ""))
            for one in self.frozen.get("parameters") or ()
            if one["name"] == parameter
        ]
        return next(filter(None, (named_unit(one)[1] for one in (parameter, *keys))), "")

    def parameter(self, name: str) -> str:
        """Name of a parameter with its unit."""
        words, unit = named_unit(name)[0], self.unit(name)
        return f"{words}, {unit}" if unit else words

    def value(self, name: str, value: Any) -> str:
        """A value of a parameter with its name, or alone if it is a word."""
        if isinstance(value, str):
            return value
        return f"{named_unit(name)[0]} {with_unit(f'{value:g}', self.unit(name))}"

    def cell_name(self, cell: Cell, without: Sequence[str] = ()) -> str:
        """Name of a cell by the parameters that vary."""
        own = cell["parameters"]
        names = [self.value(key, own[key]) for key in self.grid if key not in without]
        return ", ".join(names) or "all"

    def listed_cells(self, cells: Sequence[Cell]) -> str:
        """Names of the first cells, or the one value that all these and no others have."""
        for key, values in self.grid.items():
            for value in values:
                own = [cell for cell in self.cells if cell["parameters"][key] == value]
                if len(own) > 1 and own == list(cells):
                    return self.value(key, value)
        names = [self.cell_name(cell) for cell in cells]
        more = f"; and {len(names) - 4} more" if len(names) > 5 else ""
        return "; ".join(names[:4] if more else names) + more


# Numbers and shares.


def number(value: Any) -> float:
    """A number of the summary; NaN for null."""
    return math.nan if value is None else float(value)


def shown(value: Any, half: float = math.nan) -> str:
    """A number, rounded by the half width of its interval if it has one, else to three digits."""
    own = number(value)
    if not math.isfinite(own):
        return "–"
    size = abs(half) if math.isfinite(half) and half else abs(own)
    if own and (abs(own) < 1e-4 or abs(own) >= 1e7):
        mantissa, _, power = f"{own:.2e}".partition("e")
        return f"{plain(float(mantissa), 2)}e{plain(int(power), 0)}"
    digits = 2 if math.isfinite(half) and half else 3
    return plain(own, decimals(size, digits)) if size else "0"


def between(value: Any, low: Any, high: Any) -> str:
    """A number with its interval: ``3.14 (2.91 to 3.40)``."""
    half = 0.5 * (number(high) - number(low))
    if not math.isfinite(half):
        return shown(value)
    return f"{shown(value, half)} ({shown(low, half)} to {shown(high, half)})"


def percent(low: Any, high: Any) -> str:
    """An interval of a share: ``93.1 to 95.8 %``."""
    ends = 100.0 * number(low), 100.0 * number(high)
    # Of many cases a small share has more decimals.
    sizes = (ends[1], 100.0 - ends[0])
    places = min(decimals(part, 2, least=1, most=4) for part in sizes if part > 0.0)
    return f"{plain(ends[0], places)} to {plain(ends[1], places)}{GAP}%"


def share(one: Mapping[str, Any]) -> str:
    """A share with its 95 % interval."""
    if not one["of"]:
        return "–"
    return f"{share_words(number(one['share']))} ({percent(one['low'], one['high'])})"


def counted(count: int, noun: str) -> str:
    """A number of things."""
    return f"{count:,}{GAP}{noun}{'' if count == 1 else 's'}"


def with_unit(value: str, unit: str) -> str:
    """A number with its unit, if it has one."""
    return f"{value}{GAP}{unit}" if unit else value


def quantile(scalar: Mapping[str, Any], level: float) -> Mapping[str, Any]:
    """A quantile of a scalar, with its interval."""
    return next(one for one in scalar["quantiles"] if one["level"] == level)


def over_decades(values: Sequence[float]) -> bool:
    """Whether positive values span so much that a logarithmic axis shows them better."""
    there = [v for v in values if math.isfinite(v)]
    return bool(there) and min(there) > 0.0 and max(there) > DECADES * min(there)


# Names.


def words_and_unit(name: str) -> tuple[str, str]:
    """Name of a scalar in words, and its unit."""
    words, unit = named_unit(name)
    return " ".join(w.upper() if w in _ACRONYMS else w for w in words.split()), unit


def label(name: str) -> str:
    """Name of a scalar with its unit: ``end error, m``."""
    words, unit = words_and_unit(name)
    return f"{words}, {unit}" if unit else words


def listed(value: Any) -> str:
    """Values of a parameter in words."""
    if isinstance(value, list | tuple):
        return ", ".join(map(listed, value))
    if isinstance(value, bool):
        return "true" if value else "false"
    return f"{value:g}".replace("-", MINUS) if is_number(value) else str(value)


def is_number(value: Any) -> bool:
    """Whether a value of a parameter is a number."""
    return isinstance(value, int | float) and not isinstance(value, bool)


def _word(value: Any) -> Any:
    """A value of a parameter as a number or a word."""
    return value if is_number(value) or isinstance(value, str) else listed(value)
