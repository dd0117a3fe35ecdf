"""The top of a text table: where its rows of numbers begin, and what the lines above them state.

Names and units of columns, and the sampling rate and the units of sensors in words.
"""

from __future__ import annotations

import itertools
import re
from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown.formats.columns import read_name
from strapdown.formats.text_columns import (
    JUDGED,
    MARKS,
    SEARCHED,
    UNSIGNED,
    Lines,
    are_data,
    fields_of,
    is_comment,
    is_data,
    separator_of,
)
from strapdown.formats.vocabularies import TRIADS
from strapdown.units import ACCEL_UNITS, GYRO_UNITS, MAG_UNITS, OF_TABLES, unit_of

_UNIT = re.compile(r"\s*[\[(].*")
_REMARK = re.compile(r"\s*\([^()]*\)|\s*\[[^\[\]]*\]")
# A unit in brackets; those within it, as of m/(s^2), are its own.
_ENCLOSED = re.compile(r"^[\[({]\s*(.*?)\s*[\])}]$")
_CALIBRATED = {"cal", "raw", "uncal"}
# The level behind the unit of a height.
_LEVEL = re.compile(r"(ft|feet|m)\s+(?:msl|agl|baro|wgs ?84|hae|gps)", re.I)
_NO_UNIT = ("-", "--", "none", "1")
#: Characters of the lines at the top in which the rows of numbers are searched.
SEARCHED_TEXT = 1 << 20
#: Lines below one with a word and a number in which the names of the columns are searched.
PREAMBLE = 10
#: Most lines between names and rows of which the names have another separator.
ABOVE = 4


class TableTop:
    """Names, units and separator of a table, and the lines from its first row on.

    Lines above the names are a preamble. Two lines of names are a group and its members, as
    ``Gyroscope,,`` over ``x,y,z``.

    `numbered`: lines with their rows, without the comments at the top. `kinds`: of units that a
    row under the names may have.
    """

    def __init__(self, numbered: Lines, comments: list[str], kinds: Sequence[str]) -> None:
        first, self.separator, width = _first_row(numbered, kinds)
        self.data = numbered[first:]
        #: Lines above, without those of the names.
        self.above = comments + [line for _, line in numbered[:first]]
        self.units: dict[str, str] = {}
        near = [line for _, line in numbered[max(0, first - 4) : first]][::-1]
        # A row that only says that each column is calibrated has neither names nor units.
        marks = [line for line in near[:2] if _says_calibrated(line, self.separator)]
        near = [line for line in near if line not in marks][:3]
        lines = [_named(line, self.separator, width) for line in near] + [None, None]
        names, over = lines[:2]
        if names is None and near:
            names = self._behind_a_word(near[0], width) or self._names_parted_otherwise(width)
        if names is None:
            below = self._units_in_comment(width, kinds)
            named = _above(self.above[:-1] if below else self.above, width, self.separator)
            if named is not None:
                del self.above[len(self.above) - 1 - bool(below) :]
            names = named or [f"column {k + 1}" for k in range(width)]
            below = None if named is None else below
        else:
            below = _units(near[0], self.separator, width, kinds) if over is not None else None
            if below and over is not None:
                names, over = over, lines[2]
            bare = [_UNIT.sub("", n) for n in names if n]
            grouped = len(set(bare)) < len(bare) and (
                over is not None and (_are_groups(over) or _are_runs(over))
            )
            if grouped and over is not None:
                names = [f"{g} {n}".strip() for g, n in zip(_filled(over), names, strict=True)]
            over_names = near[1:2] or comments[-1:]
            if not below and not grouped and over_names:
                below = self._units_over(over_names[0], width, kinds)
            del self.above[len(self.above) - 1 - bool(below) - grouped - len(marks) :]
        names = of_arrays(names)
        count: Counter[str] = Counter()
        self.names = []
        for name in names:
            count[name] += 1
            self.names.append(name if count[name] == 1 else f"{name} ({count[name]})")
        if below:
            self.units = {n: u for n, u in zip(self.names, below, strict=True) if u}

    def _units_over(self, line: str, width: int, kinds: Sequence[str]) -> list[str] | None:
        """Units in the line above the names, of any quantity: ``# deg, deg, ft msl, kt``.

        The level of a height, which a name says, is left out.
        """
        bare = line.strip().lstrip(MARKS)
        fields = [_LEVEL.sub(r"\1", field) for field in fields_of(bare, self.separator)]
        joined = (self.separator or " ").join(fields)
        return _units(joined, self.separator, width, tuple({*kinds, *OF_TABLES}))

    def _behind_a_word(self, line: str, width: int) -> list[str] | None:
        """Names of rows that all begin with one word, which has no name: ``Data,1,2``."""
        words = {fields_of(row, self.separator)[0] for _, row in self.data[:JUDGED]}
        if len(words) != 1 or width < 2:
            return None
        word = words.pop()
        named = _named(line, self.separator, width - 1)
        # Where the first name is not of a number, the word has it, and another is missing.
        if not named or read_name(named[0]).quantity is None:
            return None
        return [word, *named] if word and not is_data(word) else None

    def _names_parted_otherwise(self, width: int) -> list[str] | None:
        """Names that commas separate over rows that blanks do, as POSPac has them, or tabs.

        A board prints names between tabs, and its rows between commas.
        """
        between = "," if self.separator is None else "\t"
        lines = [fields_of(line, between) for line in reversed(self.above[-ABOVE:])]
        fits = (n for n in lines if len(n) == width and all(n) and not are_data(n))
        return next(fits, None)

    def _units_in_comment(self, width: int, kinds: Sequence[str]) -> list[str] | None:
        """Units in the last comment, where the one before it has the names."""
        if len(self.above) < 2 or not all(map(is_comment, self.above[-2:])):
            return None
        if _above(self.above[:-1], width, self.separator) is None:
            return None
        return _units(self.above[-1].strip().lstrip(MARKS), self.separator, width, kinds)


def _first_row(numbered: Lines, kinds: Sequence[str]) -> tuple[int, str | None, int]:
    """Return the first of rows of numbers, their separator, and their number of fields.

    They are the most frequent form, and two of the first three have it. Where every line above has
    as many fields, the first that is full names the columns.
    """
    forms: list[tuple[str | None, int]] = []
    data: list[bool] = []
    read = 0
    for _, line in numbered[:SEARCHED]:
        separator = separator_of(line)
        fields = fields_of(line, separator)
        forms.append((separator, len(fields)))
        data.append(are_data(fields))
        if (read := read + len(line)) > SEARCHED_TEXT and len(forms) > 4:
            break
    # Numbers in a preamble are fewer than the rows.
    usual = Counter(f for f, d in zip(forms, data, strict=True) if d).most_common(1)
    like = [bool(usual) and d and f == usual[0][0] for f, d in zip(forms, data, strict=True)]
    for k in np.flatnonzero(like).tolist():
        after = like[k + 1 : k + 3]
        # A line with empty fields is of a preamble if the names, all there, are soon below.
        if not all(fields_of(numbered[k][1], forms[k][0])) and any(
            forms[m] == forms[k] and not data[m] and all(fields_of(numbered[m][1], forms[m][0]))
            for m in range(k + 1, min(k + 1 + PREAMBLE, len(forms)))
        ):
            continue
        if k == 1:
            break
        if after and not any(after) and len(like) > 3:
            continue
        separator, width = forms[k]
        if k > 1 and all(form == forms[k] for form in forms[:k]):
            top = [fields_of(line, separator) for _, line in numbered[:k]]
            # Lines of a preamble may be filled up with separators.
            full = next((m for m, names in enumerate(top) if all(names)), None)
            first = 1 + (_are_groups(top[0]) if full is None else full)
            # Groups whose names are repeated, over their members.
            if full is not None and first < k and _are_runs(top[full]) and not data[first]:
                first += 1
            if first < k and _says_calibrated(numbered[first][1], separator):
                first += 1
            if first < k and _units(numbered[first][1], separator, width, kinds):
                first += 1
            return min(first, k), separator, width
        return k, separator, width - _ends_empty(numbered, forms[k], k)
    # A single line above is that of the names, and decides how many fields a row has.
    separator = separator_of(numbered[0][1])
    names = fields_of(numbered[0][1], separator)
    return 1, separator, len(names) - (len(names) > 1 and not names[-1])


def _ends_empty(numbered: Lines, form: tuple[str | None, int], first: int) -> bool:
    """Whether every row ends with a separator, and the names have no field for it."""
    separator, width = form
    above = fields_of(numbered[first - 1][1], separator) if first else []
    if len(above) == width and above[-1]:
        return False
    rows = [fields_of(line, separator) for _, line in numbered[first : first + 50]]
    return all(len(row) != width or not row[-1] for row in rows)


def _named(line: str, separator: str | None, width: int) -> list[str] | None:
    """Return the fields of a line that may name columns, or None."""
    bare = line.strip().lstrip(MARKS).strip() if is_comment(line) else line
    fields = fields_of(bare, separator)
    if bare != line and len(fields) == width - 1:
        # The mark may be the name of a column of numbers of rows.
        whole = fields_of(line.strip(), separator)
        fields = whole if len(whole) == width and not whole[0].strip(MARKS) else fields
    if bare != line and len(fields) == width and not fields[0]:
        fields = [line.strip()[: len(line.strip()) - len(bare)].strip() or "#", *fields[1:]]
    if len(fields) == width + 1 and not fields[-1]:
        fields = fields[:-1]
    return fields if len(fields) == width and any(fields) and not are_data(fields) else None


def _says_calibrated(line: str, separator: str | None) -> bool:
    """Whether a line only says of each column whether it is calibrated."""
    said = {field.strip().lower() for field in fields_of(line, separator)} - {""}
    return bool(said) and said <= _CALIBRATED


def _are_groups(fields: list[str]) -> bool:
    """Whether a line names groups of columns: some fields are empty, each name is there once."""
    full = [f for f in fields if f]
    return len(fields) > len(full) > 0 and len(set(full)) == len(full)


def _are_runs(fields: list[str]) -> bool:
    """Whether a line names groups of columns by repeating each name over its members."""
    names = [name for name, _ in itertools.groupby(fields)]
    return all(fields) and len(fields) > len(names) == len(set(names)) > 1


def _filled(fields: list[str]) -> list[str]:
    """Repeat each name over the empty fields after it."""
    out: list[str] = []
    for field in fields:
        out.append(field or (out[-1] if out else ""))
    return out


def of_arrays(names: list[str]) -> list[str]:
    """Number the values of a sensor of which the first alone has its name: ``Gyro, 1, 2``."""
    out = list(names)
    for k, name in enumerate(names):
        numbered = names[k + 1 : k + 3] == ["1", "2"] and names[k + 3 : k + 4] != ["3"]
        if numbered and read_name(name).quantity in TRIADS:
            out[k : k + 3] = [f"{name}[{j}]" for j in range(3)]
    return out


def _units(line: str, separator: str | None, width: int, kinds: Sequence[str]) -> list[str] | None:
    """Return the units of a second header line, if most fields are units known here."""
    fields = [_ENCLOSED.sub(r"\1", f.strip()) for f in fields_of(line, separator)][:width]
    fields = ["" if f.lower() in _NO_UNIT else f for f in fields]
    known = [unit_of(f, kinds) is not None for f in fields if f]
    return fields if len(fields) == width and known and 2 * sum(known) > len(known) else None


def _above(comments: list[str], width: int, separator: str | None) -> list[str] | None:
    """Return the names that the last comment gives to columns without a header, or None."""
    names = _named(comments[-1], separator, width) if comments else None
    if comments and names is None and separator is None:
        # Names over columns of blanks may be separated otherwise: "% time, x, y".
        names = _named(comments[-1], separator_of(comments[-1].strip().lstrip(MARKS)), width)
    if comments and names is None:
        # A remark in brackets may hold separators: "# time_s,force_N (sum of cells, zeroed)".
        names = _named(_REMARK.sub("", comments[-1]), separator, width)
    return None if names is None or any(is_data(n) for n in names) else names


# Sampling rate and units of sensors, stated in the lines above a table.


# "Sample Rate:,128,Hz", "// Update Rate: 100.0Hz", "Sampling frequency (Hz): 50", "ODR 100 Hz".
_RATES = (
    re.compile(
        r"(?:sampl\w*|update|output|logging|data)[ _-]*(?:rate|freq\w*)"
        rf"(?:\s*[\[(]\s*Hz\s*[\])])?\W*?({UNSIGNED})(?!\d|\s*[a-gi-z])",
        re.I,
    ),
    re.compile(rf"\b(?:fs|odr)\b\W*?({UNSIGNED})\s*Hz\b", re.I),
)
_STEP = re.compile(rf"\bdt\s*=\s*({UNSIGNED})\s*s\b", re.I)
_NAME_OF_SENSOR = re.compile(
    r"(?P<gyro>gyro(?:scopes?|s)?|ang(?:ular)?[ _-]?(?:rate|vel(?:ocity)?)s?|(?:rotation|turn)"
    r"[ _-]?rates?)|(?P<accel>acc(?:el(?:eration|erometer)?s?)?|specific[ _-]force)"
    r"|(?P<mag>mag(?:netometer|netic[ _-]?field|n)?)",
    re.I,
)
_IN = re.compile(
    r"[\s:=(\[]*(?:\b(?:units?|in|is|are|data|values?)\b[\s:=(\[]*)*"
    r"([^\s,;)\]]+(?:[ ]s\^?(?:-|−|⁻)(?:\d|[¹²]))?)",
    re.I,
)
_COUNT = r"(?:LSBs?|counts?|digits?)"
_PER_UNIT = re.compile(rf"({UNSIGNED})\s*{_COUNT}\s*(?:/|per)\s*\(?([^\s,;)]+)", re.I)
_PER_COUNT = re.compile(rf"({UNSIGNED})\s*([^\s\d,;(]+?)\s*(?:/|per)\s*{_COUNT}", re.I)
# Counts of 1 g among the settings of a flight controller: acc_1G:2048.
_ONE_G = re.compile(rf"[_ ]?1_?G\"?[\s:=,]+\"?({UNSIGNED})", re.I)
_RANGE = re.compile(r"(?:±|\+/?-|_FS[_=]?)\s*(\d+)\s*([^\s,;)]*)", re.I)
_16_BIT = re.compile(r"\bint16|\b16[ -]?bit", re.I)
_KNOWN = {"gyro": GYRO_UNITS, "accel": ACCEL_UNITS, "mag": MAG_UNITS}
#: Unit of a range that is stated without, as in the names of registers.
_OF_RANGE = {"gyro": "deg/s", "accel": "g"}


def stated_rate(above: list[str]) -> float | None:
    """Return the sampling rate (Hz) that lines above a table state."""
    rates = [float(m[1]) for line in above for form in _RATES if (m := form.search(line))]
    rates += [1.0 / float(m[1]) for line in above if (m := _STEP.search(line)) and float(m[1])]
    return rates[0] if rates and rates[0] > 0.0 else None


def stated_units(above: list[str], columns: dict[str, NDArray[Any]]) -> dict[str, str]:
    """Return the unit of each sensor that lines above a table state.

    ``gyro: deg/s``; counts by ``131 LSB/(deg/s)``, ``0.061 mg/LSB``, ``acc_1G:2048``, or by a range
    of 16 bits: ``±250 deg/s … 16 bit``. Counts are whole numbers; a range says no unit of others.
    """
    text = "\n".join(above)
    out: dict[str, str] = {}
    for line in above:
        found = [*_NAME_OF_SENSOR.finditer(line)]
        for this, after in itertools.zip_longest(found, found[1:]):
            triad = str(this.lastgroup)
            rest = line[this.end() : after.start() if after else None]
            if line[this.end() : this.end() + 1].isalpha() or triad in out:
                continue
            unit = _counts(triad, rest, bool(_16_BIT.search(text)))
            if unit is not None and not _are_counts(triad, columns):
                continue
            said = unit_of(m[1].strip(".:")) if (m := _IN.match(rest)) else None
            if unit or said in _KNOWN[triad]:
                out[triad] = unit or str(said)
    return out


def _counts(triad: str, text: str, of_16_bits: bool) -> str | None:
    """Return the unit of raw counts that a text states."""
    if triad == "accel" and (m := _ONE_G.match(text)) and float(m[1]):
        return f"g/{m[1]}"
    if m := _PER_UNIT.search(text):
        scale, unit = f"/{m[1]}", unit_of(m[2])
    elif m := _PER_COUNT.search(text):
        return f"{m[1]} {of}" if (of := unit_of(m[2])) in _KNOWN[triad] else None
    elif of_16_bits and triad in _OF_RANGE and (m := _RANGE.search(text)) and int(m[1]):
        # Names of registers have no unit.
        default = _OF_RANGE[triad] if m[0].upper().startswith("_FS") else None
        scale, unit = f"/{32768 / int(m[1]):g}", unit_of(m[2]) or default
    else:
        return None
    return f"{unit}{scale}" if unit in _KNOWN[triad] else None


def _are_counts(triad: str, columns: dict[str, NDArray[Any]]) -> bool:
    """Whether the columns of a sensor, as far as their names say it, are whole numbers."""
    held = [c for n, c in columns.items() if str(read_name(n).quantity).startswith(triad)]
    return all(
        c.dtype.kind in "iuf" and bool(np.all(~np.isfinite(c) | (c == np.rint(c)))) for c in held
    )
