"""Lines that a program prints: of every sample the same words, with other numbers between them.

``Gyro: (0.1, 0.2, 0.3) rad/s``, ``ax=0.1 ay=0.2``, samples in several lines, lines of a serial
monitor (``14:22:07.010 -> 1,2``) and sentences (``$VNYMR,1.5,…*69``) become rows under names.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence

import numpy as np

from strapdown.formats.columns import read_name, split_brackets
from strapdown.formats.text_columns import (
    SEARCHED,
    UNSIGNED,
    Lines,
    are_data,
    fields_of,
    separator_of,
)
from strapdown.units import unit_of

#: Time of arrival that the serial monitor of a development environment puts before a line.
_ARRIVAL = re.compile(r"(\d\d:\d\d:\d\d\.\d+) -> ?")
# A sentence with its name and checksum: "$VNYMR,1.5,…*69".
SENTENCE = re.compile(r"(\$\w+)(,[^*]*)\*[0-9A-Fa-f]{2}\s*")
# "IMU: 20, 0.1, …": one word before the numbers of every row.
_TAGGED = re.compile(r"\s*([A-Za-z]\w*):[ \t]*(?=[+-]?[\d.][^:=]*$)")
# Stamps and numbers between words. A digit of a name or a unit is none, nor one whose sign may be
# a part of the word before it.
_PRINTED = re.compile(
    r"(?<![\w.])(?:(?:\d{4}-\d\d-\d\d|\d{1,2}/\d{1,2}/\d{4})[ T])?\d{1,2}:\d\d:\d\d"
    r"(?:[.,]\d+(?:,\d{3})?)?(?:Z|[+-]\d\d:?\d\d)?(?!\w|:\d)"
    rf"|(?<![\w.^])[+-]{UNSIGNED}|(?<![\w.^+-]){UNSIGNED}|(?<![\w<])[+-]?(?:nan|inf)(?![\w>])",
    re.I,
)
# Signs between the values of a vector, at the end of a label, and between its words.
_BETWEEN = re.compile(r"[,;/| \t-]+")
_LABEL = re.compile(r"[^\W\d_].*[:=]\s*[\[({<]?$|[^\W\d_].*[\[({<]$|[|,;]\s*[A-Za-z][\w ]*$", re.S)
# A number as numpy prints it within a list or a dictionary.
_TYPE = re.compile(r"\b(?:np|numpy)\.\w+\(([^()]*)\)")
#: Labels of a latitude and a longitude.
_POSITIONS = {"location", "position", "gps", "coordinates", "coords", "latlng", "latlon"}
# A unit in brackets behind a value.
_BEHIND = re.compile(r"\s*[\[(]([^\[\]()]*(?:\([^()]*\))?[^\[\]()]*)[\])]")
#: Between the lines of a sample that are joined.
_NEXT_LINE = " ~ "
_MARKS_OF_PRINT = re.compile(r"([:=\[\](){}<>,;|~]|\s-\s)")
_CLOSED = re.compile(r"[\])}>\s]*")
_FIRST_WORD = re.compile(r"([^\s,;|:=\[\](){}<>]+)(.*)", re.S)
_TRIMMED = " \t'\"*#>-"
#: Levels of the log of a microcontroller's framework, whose stamps are in ms: "I (5310) imu: …".
_LEVELS = {"E", "W", "I", "D", "V"}
#: Longest line above the rows that is understood, and of labelled values.
LONGEST = 2000
#: Name of a number before or behind all labels, and of one that is not a clock.
LEADING, COUNTED = "time", "number"
#: Fewest values of a line that is taken for a row, and of a sample in several lines.
LABELS, OF_SEVERAL = 3, 6
#: Most lines of a sample.
MOST_TURNS = 80
Printed = tuple[tuple[str, ...], list[str]]


def as_rows(numbered: Lines) -> Lines:
    """Return lines of labelled values, or with the time of arrival before them, as rows.

    The same object if there are none.
    """
    numbered = _channels_named(numbered)
    top = numbered[:SEARCHED]
    if any(_TYPE.search(line) for _, line in top if len(line) < LONGEST):
        numbered = [(row, _TYPE.sub(r"\1", line)) for row, line in numbered]
        top = numbered[:SEARCHED]
    # A semicolon that ends a line of commas, as of a program's statement.
    if all(line.count(";") == 1 and "," in line and line.rstrip()[-1] == ";" for _, line in top):
        numbered = [(row, line.rstrip().removesuffix(";")) for row, line in numbered]
        top = numbered[:SEARCHED]
    sentences = {m[1] if m else "" for m in (SENTENCE.fullmatch(line) for _, line in top)}
    if len(sentences) == 1 and "" not in sentences:
        numbered = [(row, SENTENCE.sub(r"\1\2", line)) for row, line in numbered]
        numbered = with_names(numbered, sentences.pop())
        top = numbered[:SEARCHED]
    # Names may stand under the word, too.
    named = bool(top) and re.match(r"\s*([A-Za-z]\w*):[ \t]*[A-Za-z]", top[0][1])
    rest = top[1:] if named else top
    tags = {m[1] if m else "" for m in (_TAGGED.match(line) for _, line in rest)}
    if named and tags == {named[1]} and "," in top[0][1]:
        numbered = [(row, line.replace(f"{named[1]}:", "", 1)) for row, line in numbered]
        top = numbered[:SEARCHED]
    if named:
        tags = {""}
    if len(tags) == 1 and "" not in tags:
        # Three numbers are a vector of that name.
        between = separator_of(top[0][1])
        if between is not None and top[0][1].count(between) > 2:
            numbered = [(row, _TAGGED.sub(rf"\1{between}", line)) for row, line in numbered]
            top = numbered[:SEARCHED]
    stamped = sum(_ARRIVAL.match(line) is not None for _, line in top)
    if 2 * stamped > len(top):
        stamps = [_ARRIVAL.match(line) for _, line in numbered]
        bare = [
            (row, line[m.end() :] if m else line)
            for m, (row, line) in zip(stamps, numbered, strict=True)
        ]
        rows = _unlabelled(bare)
        by_row = {row: m[1] for m, (row, _) in zip(stamps, numbered, strict=True) if m}
        return [(row, _with_arrival(line, by_row.get(row))) for row, line in rows if line.strip()]
    parted = [_printed(line) for _, line in top]
    joined = _one_line_a_sample(numbered, [texts for texts, _ in parted])
    return _unlabelled(joined, parted if joined is numbered else None)


#: A channel in the first line of RaceCapture: "AccelX"|"G"|-3.0|3.0|25.
_CHANNEL = re.compile(r'"([^"|,]+)"\|"([^"|,]*)"(?:\|[^"|,]*)*')


def _channels_named(numbered: Lines) -> Lines:
    """Name the channels of a first line that has their ranges and rates, too, with their units.

    ``Interval`` counts since power was switched on. The same object if there are none.
    """
    first = numbered[0][1].strip() if numbered else ""
    if '"|"' not in first:
        return numbered
    channels = [_CHANNEL.fullmatch(cell.strip()) for cell in first.split(",")]
    if len(channels) < LABELS or None in channels:
        return numbered
    said = [("time" if m[1].strip() == "Interval" else m[1], m[2]) for m in channels if m]
    names = [f"{name} [{unit}]" if unit else name for name, unit in said]
    return [(numbered[0][0], ",".join(names)), *numbered[1:]]


def _with_arrival(line: str, stamp: str | None) -> str:
    """Put the time of arrival into the first field; it is the clock of a table without one."""
    separator = separator_of(line)
    fields = fields_of(line, separator)
    if not are_data(fields):
        other = any(read_name(name).quantity == "time" for name in fields)
        stamp = "arrival" if other else "time"
    return line if stamp is None else f"{stamp}{separator or ' '}{line.lstrip()}"


def _printed(line: str) -> Printed:
    """Return the texts before, between and behind the numbers of a line, and the numbers.

    Of a text the blanks at its ends are left out: a sign takes the room of one.
    """
    texts, values, end = [], [], 0
    for m in _PRINTED.finditer(line) if len(line) < LONGEST else ():
        texts.append(line[end : m.start()])
        values.append(re.sub(r"(:\d\d\.\d{3}),(\d{3})$", r"\1\2", m[0]))  # 09:59:58.123,456
        end = m.end()
    texts.append(line[end:])
    return tuple(" ".join(text.split()) or text[:1] for text in texts), values


def _one_line_a_sample(numbered: Lines, keys: Sequence[tuple[str, ...]]) -> Lines:
    """Join the lines of samples that are printed in several, of which each is followed by the next.

    `keys`: texts between the numbers of the first lines. The same object if they are not.
    """
    period = next((k for k in range(1, min(MOST_TURNS, len(keys))) if keys[k] == keys[0]), 0)
    turns = keys[:period]
    if len(set(turns)) < 2 or len(keys) < 3 * period or len(sum(turns, ())) < period + OF_SEVERAL:
        return numbered
    regular = sum(key == turns[k % period] for k, key in enumerate(keys))
    labels = sum(_LABEL.search(text) is not None for key in turns for text in key[:-1])
    if 10 * regular < 9 * len(keys) or labels < 2:
        return numbered
    out: Lines = []
    sample: Lines = []
    for row, line in numbered:
        key = _printed(line)[0]
        # Where a line is lost, the sample is not whole.
        if key == turns[0] or len(sample) == period or key != turns[len(sample)]:
            sample = []
        if key == turns[len(sample)]:
            sample.append((row, line.strip()))
        if len(sample) == period:
            out.append((sample[0][0], _NEXT_LINE.join(said for _, said in sample)))
    return out


def _unlabelled(numbered: Lines, top: list[Printed] | None = None) -> Lines:
    """Return lines of labelled values as rows under their labels.

    `top`: the first lines, where they are parted already. The same object unless most of them are
    such.
    """
    top = top or [_printed(line) for _, line in numbered[:SEARCHED]]
    usual = Counter(texts for texts, values in top if len(values) >= LABELS).most_common(1)
    # Sentences between them have no numbers.
    if not usual or 2 * usual[0][1] <= sum(bool(values) for _, values in top):
        return numbered
    texts = usual[0][0]
    names = _names(texts, [values for said, values in top if said == texts])
    if names is None:
        return numbered
    out: Lines = []
    named = False
    for row, line in numbered:
        said, values = _printed(line)
        # A line that was cut has fewer values.
        if values and (said == texts or said[: len(values)] == texts[: len(values)]):
            if not named:
                out.append((row, "\t".join(names)))
                named = True
            line = "\t".join(values)
        out.append((row, line))
    return out


def _names(texts: tuple[str, ...], rows: list[list[str]]) -> list[str] | None:
    """Return names of the values between some texts, with units; None if few have a label.

    ``Gyro: (0.1, 0.2, 0.3) rad/s`` is a vector, ``acc {x: 1, y: 2}`` a name said once. `rows`: of
    values between these texts.
    """
    # Values of one label: a text without a letter before the others.
    runs: list[list[int]] = []
    for k, text in enumerate(texts[:-1]):
        same = k and _BETWEEN.fullmatch(text) and (len(runs[-1]) == 1 or text == texts[k - 1])
        if same and any(letter.isalpha() for letter in texts[runs[-1][0]]):
            runs[-1].append(k)
        else:
            runs.append([k])
    # One value behind those that have a label each, as a stamp that ends a line.
    if len(runs) > 1 and len(runs[-1]) == 2 and max(map(len, runs[:-1])) == 1:
        runs.append([runs[-1].pop()])
    labelled = sum(len(run) for run in runs if _LABEL.search(texts[run[0]]))
    if labelled < LABELS:
        return None
    said: list[tuple[str, str]] = []
    bases = [""]
    for run in [*runs, [len(texts) - 1]]:
        unit, label, base = _label(texts[run[0]], bases[-1])
        # The unit behind the last axis of a name is that of all.
        last = read_name(said[-1][0]) if said else read_name("")
        for k in reversed(range(len(said) if unit else 0)):
            # ax, ay and az are of one sensor, too.
            family = last.family and read_name(said[k][0]).family == last.family
            if said[k][1] or not (bases[k + 1] == bases[-1] or family):
                break
            said[k] = (said[k][0], unit)
        # 0,12 may be a number with a decimal comma.
        pointed = any("." in row[k] for row in rows for k in run if k < len(row))
        if len(run) % 2 == 0 and texts[run[1]] == "," and not pointed:
            return None
        inside, own = split_brackets(label)
        said.append((inside.strip(), own))
        bases.append(base)
    del said[-1]
    timed = any(read_name(name).quantity == "time" for name, _ in said)
    clocks = [
        j for j, run in enumerate(runs) if not said[j][0] and _is_clock([r[run[0]] for r in rows])
    ]
    # Of several, as of lines that each have one, that of the gyro.
    gyro = next((j for j, (name, _) in enumerate(said) if _is_turn(name)), len(runs))
    clock = next((j for j in reversed(clocks) if j < gyro), clocks[0] if clocks else -1)
    names: list[str] = []
    for j, (run, (name, unit)) in enumerate(zip(runs, said, strict=True)):
        if not name:
            name = LEADING if j == clock and not timed else COUNTED
        elif len(run) == 2 and re.sub(r"\W", "", name).lower() in _POSITIONS:
            names += ["lat", "lon"]
            continue
        elif len(run) == 6 and name.lower() == "a/g":  # as an example for MPU-6050 prints them
            names += [f"{sensor}_{axis}" for sensor in ("accel", "gyro") for axis in "xyz"]
            continue
        elif name in _LEVELS and texts[run[0]].endswith("("):
            name, unit = LEADING, unit or "ms"
        ends = {1: [""], 3: [" x", " y", " z"]}.get(len(run), [f" {k}" for k in range(len(run))])
        names += [f"{name}{end} [{unit}]" if unit else f"{name}{end}" for end in ends]
    return names


def _label(text: str, base: str) -> tuple[str, str, str]:
    """Split a text between two numbers: the unit of the first, the label of the second, its base.

    `base`: of the label before, which an axis alone continues: ``Accel X: 1, Y: 2``.
    """
    unit = ""
    text = text[_CLOSED.match(text).end() :]  # type: ignore[union-attr]
    if (m := _BEHIND.match(text)) and (found := unit_of(m[1])) is not None:
        unit, text = found, text[m.end() :]
    # A label of one letter may be spelled as a unit: then it is next to the number.
    m = _FIRST_WORD.match(text)
    found = unit_of(m[1]) if m else None
    if m and found and (any(map(str.isalpha, m[2])) or not _LABEL.search(text)):
        unit, text = found, m[2]
    own = ""
    for m in re.finditer(r"\(([^()]*(?:\([^()]*\)[^()]*)*)\)|\[([^\[\]]*)\]", text):
        if (found := unit_of(m[1] or m[2] or "")) is not None:
            own, text = found, text[: m.start()] + " " + text[m.end() :]
            break
    parts = _MARKS_OF_PRINT.split(text)
    words = [
        (mark, part.strip(_TRIMMED))
        for mark, part in zip(["", *parts[1::2]], parts[::2], strict=True)
    ]
    words = [(mark, word) for mark, word in words if any(map(str.isalpha, word))]
    if not words:
        return unit, "", base
    mark, label = words[-1]
    if mark == "=" and " " in label:
        label = label.rpartition(" ")[2]  # behind a value in words: host=pi ax=
    if label.lower() in ("x", "y", "z", "w"):
        base = words[-2][1] if len(words) > 1 else base
        label = f"{base} {label}".strip()
    elif label[-2:-1] == " " and label[-1] in "xX":
        base = label[:-2]
    else:
        base = label
    return unit, f"{label} [{own}]" if own else label, base


def _is_turn(name: str) -> bool:
    """Whether a label is of a gyro, alone or with an axis."""
    return any(str(read_name(n).quantity).startswith("gyro") for n in (name, f"{name} x"))


def _is_clock(values: list[str]) -> bool:
    """Whether values are stamps, or numbers that grow otherwise than by one a line."""
    try:
        steps = np.diff([float(v) for v in values])
    except ValueError:
        return True
    return bool(
        steps.size and np.all(steps >= 0.0) and np.any(steps > 0.0) and np.any(steps != 1.0)
    )


# Sentences whose fields their maker defines.


_SENSED = [
    f"{name}_{axis} [{unit}]"
    for name, unit in (("mag", "gauss"), ("accel", "m/s2"), ("gyro", "rad/s"))
    for axis in "xyz"
]
_YAW = ["yaw [deg]", "pitch [deg]", "roll [deg]"]
#: Fields of sentences (VectorNav, Interface Control Documents of VN-100 and VN-200).
SENTENCES = {
    "$VNIMU": [*_SENSED, "temperature", "pressure"],
    "$VNYMR": [*_YAW, *_SENSED],
    "$VNQMR": ["quat_x", "quat_y", "quat_z", "quat_w", *_SENSED],
    "$VNMAR": _SENSED,
    "$VNYBA": [*_YAW, *[f"linear {n}" for n in _SENSED[3:6]], *_SENSED[6:]],
}


def with_names(numbered: Lines, sentence: str) -> Lines:
    """Put the names of its fields over the rows of a known sentence."""
    names = SENTENCES.get(sentence)
    if names is None or not numbered or numbered[0][1].count(",") != len(names):
        return numbered
    return [(numbered[0][0], ",".join(["sentence", *names])), *numbered]
