"""Sampling rate and units of sensors, stated in the lines above a table."""

from __future__ import annotations

import itertools
import re
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown.formats.columns import read_name
from strapdown.units import ACCEL_UNITS, GYRO_UNITS, MAG_UNITS, unit_of

_META = re.compile(r"(?:[#%]|//)\s*(\w+)\s*:\s*(.+?)\s*$")
# "Sample Rate:,128,Hz", "// Update Rate: 100.0Hz", "Sampling frequency (Hz): 50", "ODR 100 Hz".
_RATES = (
    re.compile(
        r"(?:sampl\w*|update|output|logging|data)[ _-]*(?:rate|freq\w*)"
        r"(?:\s*[\[(]\s*Hz\s*[\])])?\W*(\d+(?:\.\d*)?)(?!\d|\s*[a-gi-z])",
        re.I,
    ),
    re.compile(r"\b(?:fs|odr)\b\W*(\d+(?:\.\d*)?)\s*Hz\b", re.I),
)
_STEP = re.compile(r"\bdt\s*=\s*(\d*\.?\d+(?:e-?\d+)?)\s*s\b", re.I)
_SENSOR = re.compile(
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
_PER_UNIT = re.compile(rf"(\d+(?:\.\d*)?)\s*{_COUNT}\s*(?:/|per)\s*\(?([^\s,;)]+)", re.I)
_PER_COUNT = re.compile(rf"(\d*\.?\d+)\s*([^\s\d,;(]+?)\s*(?:/|per)\s*{_COUNT}", re.I)
_RANGE = re.compile(r"(?:±|\+/?-|_FS[_=]?)\s*(\d+)\s*([^\s,;)]*)", re.I)
_16_BIT = re.compile(r"\bint16|\b16[ -]?bit", re.I)
_KNOWN = {"gyro": GYRO_UNITS, "accel": ACCEL_UNITS, "mag": MAG_UNITS}
#: Unit of a range that is stated without, as in the names of registers.
_OF_RANGE = {"gyro": "deg/s", "accel": "g"}


def stated_by_keys(above: list[str]) -> dict[str, str]:
    """Return what comments of the form ``# key: value`` state, as strapdown writes them."""
    return {m[1]: m[2] for line in above if (m := _META.match(line))}


def stated_rate(above: list[str]) -> float | None:
    """Return the sampling rate (Hz) that lines above a table state."""
    rates = [float(m[1]) for line in above for form in _RATES if (m := form.search(line))]
    rates += [1.0 / float(m[1]) for line in above if (m := _STEP.search(line)) and float(m[1])]
    return rates[0] if rates and rates[0] > 0.0 else None


def stated_units(above: list[str], columns: dict[str, NDArray[Any]]) -> dict[str, str]:
    """Return the unit of each sensor that lines above a table state.

    ``gyro: deg/s``; counts by ``131 LSB/(deg/s)``, ``0.061 mg/LSB``, or by a range of 16 bits:
    ``±250 deg/s … 16 bit``. Counts are whole numbers; a range says no unit of others.
    """
    text = "\n".join(above)
    out: dict[str, str] = {}
    for line in above:
        found = [*_SENSOR.finditer(line)]
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
