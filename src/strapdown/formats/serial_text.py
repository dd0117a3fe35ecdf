"""Texts of serial monitors that are no table yet: several lines a sample, and sentences.

`one_line_a_sample` joins lines that come in turns, as a board prints its sensors one below the
other; `with_names` puts the names over sentences whose fields their maker defines.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from strapdown.units import unit_of

Lines = list[tuple[int, str]]

#: Most lines of a sample, lines in which turns are searched, and the longest that is understood.
MOST_TURNS, SEARCHED, LONGEST = 8, 400, 400
#: Fewest labelled values of a line of a sensor, and lines of sensors of a sample.
AXES, SENSORS = 3, 2
_NUMBER = r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?"
# "Acceleration X: 0.08," and, at the end of a line, its unit: "Z: 9.83 m/s^2".
_VALUE = re.compile(rf"\s*([A-Za-z][\w ]{{0,40}}?)\s*[:=]\s*({_NUMBER})[ \t]*[,;|]?")
_UNIT = re.compile(r"\s*([^\s\d,;|:=][^,;|:=]{0,20}?)\s*")


def _labelled(line: str) -> tuple[tuple[str, ...], list[str]]:
    """Return the names, with the unit at the end, and the values of a line; or its letters."""
    values, end = [], 0
    if len(line) <= LONGEST:
        while m := _VALUE.match(line, end):
            values.append((m[1], m[2]))
            end = m.end()
    rest = line[end:].strip()
    unit = unit_of(m[1]) if (m := _UNIT.fullmatch(rest)) else None
    if not values or (rest and unit is None):
        return (re.sub(r"[^A-Za-z]", "", line[:LONGEST]),), []
    # "Accel X: 1, Y: 2, Z: 3": the name is said once.
    first, _, axis = values[0][0].rpartition(" ")
    names = [
        n if len(n) > 1 or not first or axis not in ("X", "x") else f"{first} {n}"
        for n, _ in values
    ]
    return tuple(f"{n} [{unit}]" if unit else n for n in names), [v for _, v in values]


def one_line_a_sample(numbered: Lines) -> Lines:
    """Return lines of labelled values that come in turns as one row a sample, under their names.

    The same object if they do not: a sample has two lines of three values at least, and each is
    followed by the next.
    """
    said = [_labelled(line) for _, line in numbered[:SEARCHED]]
    keys = [names for names, _ in said]
    period = next(
        (k for k in range(1, min(MOST_TURNS, len(keys) - 1) + 1) if keys[k] == keys[0]), 0
    )
    if period < SENSORS or len(keys) < 3 * period:
        return numbered
    turns = keys[:period]
    sensors = [k for k, (_, values) in enumerate(said[:period]) if len(values) >= AXES]
    regular = sum(key == turns[k % period] for k, key in enumerate(keys))
    if len(sensors) < SENSORS or len(set(turns)) < period or 10 * regular < 9 * len(keys):
        return numbered
    held = [k for k in range(period) if said[k][1]]
    out: Lines = [(numbered[0][0], "\t".join(name for k in held for name in turns[k]))]
    sample: list[list[str]] = []
    begin = 0
    for row, line in numbered:
        names, values = _labelled(line)
        if names == turns[0]:
            sample, begin = [], row
        if len(sample) < period and names == turns[len(sample)]:
            sample.append(values)
        else:
            sample = []  # a line is lost: the sample is not whole
        if len(sample) == period:
            out.append((begin, "\t".join(v for part in sample for v in part)))
            sample = []
    return out


def _axes(name: str, unit: str) -> list[str]:
    return [f"{name}_{axis} [{unit}]" for axis in "xyz"]


_SENSED = [*_axes("mag", "gauss"), *_axes("accel", "m/s2"), *_axes("gyro", "rad/s")]
_YAW = ["yaw [deg]", "pitch [deg]", "roll [deg]"]
#: Fields of sentences (VectorNav, Interface Control Documents of VN-100 and VN-200).
SENTENCES = {
    "$VNIMU": [*_SENSED, "temperature", "pressure"],
    "$VNYMR": [*_YAW, *_SENSED],
    "$VNQMR": ["quat_x", "quat_y", "quat_z", "quat_w", *_SENSED],
    "$VNMAR": _SENSED,
    "$VNYBA": [*_YAW, *[f"linear {n}" for n in _axes("accel", "m/s2")], *_axes("gyro", "rad/s")],
}


def with_names(numbered: Lines, sentences: Sequence[str]) -> Lines:
    """Put the names of its fields over the rows of one known sentence."""
    names = SENTENCES.get(sentences[0]) if len(sentences) == 1 else None
    if names is None or not numbered or numbered[0][1].count(",") != len(names):
        return numbered
    return [(numbered[0][0], ",".join(["sentence", *names])), *numbered]
