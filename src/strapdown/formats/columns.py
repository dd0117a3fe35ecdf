"""Meaning of the name of a column: quantity, axis, unit and sensor, by a vocabulary."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache

from strapdown.errors import ConfigError, check_choice
from strapdown.formats.vocabularies import (
    ABOUT,
    ABROAD,
    AXIS_WORDS,
    BESIDE,
    BY_UNIT,
    CAMERA,
    CHANGE,
    CHIP,
    CLOCKS,
    COUNTERS,
    CRASHES,
    DIRECTIONS,
    LOGS,
    MAGNETIC,
    NAMED_BY_UNIT,
    NO_AXIS,
    NOISE,
    OF_TIME,
    OTHER_QUANTITY,
    PARTS,
    PLACES,
    PX4,
    QUANTITIES,
    RATES,
    ROS,
    SENSORS,
    SHORT,
    TRIADS,
    TURN_STEMS,
    TURNS,
    WITH_AXIS,
    WITHOUT_GRAVITY,
    Vocabulary,
    without_accents,
)
from strapdown.units import ACCEL_UNITS, FACTORS, OF_LOGS, find_unit, unit_of, unit_words

_AXES = "xyz"
#: Axes of the body about which its angles turn: Yaw (deg/s) is a rate.
_TURN_OF = {"roll": "x", "pitch": "y", "heading": "z"}
#: Axes with a letter of the body or the vehicle: AngleRate Xv of OXTS.
_FRAMED = {f"{axis}{frame}": axis for axis in _AXES for frame in "bv"}
#: A column of an array: its name and its number.
INDEXED = re.compile(r"(.*)\[(\d+)\]")
# Word to the axis of the body and its sign.
_DIRECTIONS = {
    "forward": (0, 1.0),
    "back": (0, -1.0),
    "backward": (0, -1.0),
    "right": (1, 1.0),
    "left": (1, -1.0),
    "down": (2, 1.0),
    "up": (2, -1.0),
}
# Words of a name: split at signs, and where capitals begin or end.
# An axis may precede a rate (gyroXrate), and the word axis another word without a sign between.
_HUMPS = re.compile(
    r"[xyzXYZ](?=rate)|[轴軸축]|[A-Z]+(?![a-z])\d*|[A-Z]?[^\W\d_A-Z]+\d*|[°µ]+|\d+|²"
)
# Between a script of Asia and a letter, which is an axis.
_SCRIPTS = re.compile(r"(?<=[\u2e80-\uffef])(?=[a-zA-Z])|(?<=[a-zA-Z])(?=[\u2e80-\uffef])")
_SIGNS = r"[\s_\-/:,;|.#]+"
_SIGNS_AND_BRACKETS = r"[\s_\-/:,;|.#()\[\]]+"
# Text in brackets at the end, which may hold brackets: (m/(s*s)).
_BRACKETS = re.compile(r"[\[(]\s*((?:[^\[\]()]|\([^()]*\))*?)\s*[\])]\s*$")
# A unit before the axis: Angular velocity (deg/s) X, of a heading in two rows.
_UNIT_INSIDE = re.compile(r"(.*?\S)\s*[\[(]([^\[\]()]+)[\])]\W*([xyzXYZ])")
# The hemisphere behind an angle: LATITUDE N/S, longitude (W).
_HEMISPHERE = re.compile(
    r"((?:^|.*[\s_])(?:lat|lon|lng)[a-z]*)[\s_(\[]+(?:N/S|E/W|[NSEW])[\])]?$", re.I
)
#: What is before the last part of the name of a member.
_MEMBER = re.compile(r"^.*[./:](?=\w{3})")
#: The datum of a latitude and a longitude.
_DATUM = re.compile(r"\W*(?:WGS[-_ ]?84|[EI]TRF?\d*|ETRS[-_ ]?89)\W*", re.I)
# Clocks of X-Plane's data output: of the simulated world and of all.
_XPLANE = ("_totl,_time",)
# Delsys: NAME: GYRO.X 1 (IM) [°/s], each behind its clock, X[s]; a browser: rotationRate.alpha.
_DELSYS = re.compile(
    r"(?P<of>.*):\s*(?P<triad>ACC|GYRO|MAG)[. ]?(?P<axis>[XYZ])(?P<rest>\s*\d*(?:\s*\([^()]*\))?)"
    r"\s*(?:\[(?P<unit>[^\[\]]+)\])?"
)
DELSYS_CLOCK = re.compile(r"X ?\[s\](?: \(\d+\))?")
#: Rates of turn of a browser's event: about x, y, z as Chromium and WebKit write them.
OF_BROWSER = re.compile(r"(.*rotation[_ ]?rate)[._ ]?(alpha|beta|gamma)", re.I)
# Words and numbers of a heading, whose capitals may begin words.
_WORD = re.compile(r"[^\W\d_]+|\d+")


#: Evidence of a name that has words of which nobody knows what they say of the sensor.
UNKNOWN_WORDS = 3


@dataclass(frozen=True)
class ColumnName:
    """Quantity, axis and unit as read from the name of a column."""

    #: Of the vocabulary; of a sensor with its axis, ``gyro_x``, or a triad's name where the column
    #: holds three numbers or the name ends in a number.
    quantity: str | None
    #: In the spelling of this package; as written where it is none of the vocabulary's.
    unit: str | None = None
    #: Evidence: 0 for a name that is known as it is, 1 behind a word such as ``gps_``, in another
    #: order, or with an axis that is only likely, 2 if only some words are known, 3
    #: (`UNKNOWN_WORDS`) if a sensor and an axis are among words that are not.
    loose: int = 0
    #: Of a sensor: the name without its axis. Columns of one sensor share it. One letter may mean
    #: anything.
    family: str = ""
    #: The name says acceleration without gravity, as phones have it; in ROS it has gravity.
    linear: bool = False
    #: The name says increments per sample.
    increment: bool = False
    #: At the end of the name of a triad: ``gyro_1``.
    number: int | None = None
    #: -1 for the opposite of the quantity: a velocity up.
    sign: float = 1.0
    #: In a crash record: ``x y z``, with a minus if the name states it, or empty.
    axis: str = ""
    #: In a crash record: a velocity that is a change since time zero.
    change: bool = False
    #: In a crash record: the quantity that the words say, where the unit is of another one.
    spoken: str = ""


def read_name(name: str, of: Vocabulary = LOGS, unit: str = "") -> ColumnName:
    """Parse what the name of a column says.

    `name`: as ``gyro_x_rad_s``, ``Gyroscope x (rad/s)``, ``wx``, ``acc_y [g]``, ``time_ms``,
    ``IMU1/X-axis angular rate``, ``gyro_1``; or ``gyro[0]``, the first of an array of three;
    ``gps_lat``, ``Lateral Delta-V (km/h)``. `of`: vocabulary of its file. `unit`: stated apart from
    the name, as in a row of units; counts where the name has none, and first in a crash record.
    """
    if len(name) > MOST_LETTERS:
        return ColumnName(None)
    return (_read_once if len(name) <= LONGEST else _read_name)(name, of, unit)


def _read_name(name: str, of: Vocabulary, unit: str) -> ColumnName:
    text, index = unicodedata.normalize("NFC", name).strip(), ""
    if match := INDEXED.fullmatch(text):
        text, index = match.groups()
        if not of.sensors:
            # q[0] is a part of an array, not a column q in units of 0.
            part = _FIX_OF_BLACKBOX.get(index) if text.lower() == "gps_coord" else None
            return ColumnName(part if part in of.quantities else None)
        if _DEMANDED.fullmatch(text):
            return ColumnName(None)
    if of.stems and (code := _of_code(text, unit)) is not None:
        return code
    if not of.sensors and len(text) <= LONGEST:
        text = _HEMISPHERE.sub(r"\1", text)
    if of.sensors and "/" in text:
        for words, axis in CAMERA.items():
            text = text.replace(words, axis)
    said = _of_format(text, index) if of.sensors else None
    inside = _UNIT_INSIDE.fullmatch(text) if of.sensors else None
    if inside and find_unit(inside[2], of.kinds):
        text = f"{inside[1]} {inside[3]} ({inside[2]})"
    if said is None:
        bare, bracket = split_brackets(text)
        if of.sensors and bracket.lower() in tuple(_AXES):
            bare, bracket = f"{bare} {bracket}", ""  # ACC (X)
        # A recorder may write one heading, with both units, over two columns.
        own = bracket if not of.stems and find_unit(bracket, of.kinds) else ""
        written = own or unit or bracket
        said = _read(bare, bracket if of.stems else written, of)
        if index and said.quantity in TRIADS and int(index) < len(_AXES):
            said = replace(said, quantity=f"{said.quantity}_{_AXES[int(index)]}", number=None)
    else:
        bare, written = text, ""
    return _of_heading(bare, written or unit, said, of) if of.stems else said


#: Of the blackbox of flight controllers: the rate that is demanded, and the position of the fix.
_DEMANDED = re.compile(r"axis_?rate", re.I)
_FIX_OF_BLACKBOX = {"0": "lat", "1": "lon"}
#: Names of up to so many letters are kept with their meaning: a table asks for each several times.
LONGEST = 100
#: Longer names have no meaning: those of a damaged file, in which searching takes minutes.
MOST_LETTERS = 2000
_read_once = lru_cache(maxsize=1 << 14)(_read_name)


def split_brackets(text: str) -> tuple[str, str]:
    """Split text in brackets off the end of a name, as a unit; empty without brackets.

    Brackets behind a division or a power are part of a unit: ``m/(s^2)``.
    """
    bracket = _BRACKETS.search(text)
    if bracket is None or text[: bracket.start()].rstrip().endswith(("/", "^")):
        return text, ""
    return text[: bracket.start()], bracket.group(1)


def _of_code(text: str, unit: str) -> ColumnName | None:
    """Read a channel code of ISO MME, which a table has as a name; None for another name.

    What moves with a body of its own, as an occupant's head, is none of the vehicle.
    """
    from strapdown.formats.mme_codes import DIMENSIONS, decode_mme

    bare, bracket = split_brackets(text)
    code = decode_mme(bare)
    if code is None or not code.vehicle or code.code[12:14] not in DIMENSIONS:
        return None
    return ColumnName(
        code.quantity if code.body == "vehicle" else "other",
        unit_of(bracket or unit, CRASHES.kinds),
        family=code.code[:12].lower(),
        axis=code.axis,
    )


def _of_format(text: str, index: str) -> ColumnName | None:
    """Read names whose format defines quantity and unit; None for another name.

    PX4; X-Plane; fields of a message as of ``rostopic echo -p``, with stamps in ns.
    """
    if index and text in PX4 and int(index) < len(_AXES):
        triad, unit = PX4[text]
        return ColumnName(f"{triad}_{_AXES[int(index)]}", unit, family=text)
    if text.lower() in _XPLANE or DELSYS_CLOCK.fullmatch(text):
        return ColumnName("time", "s")
    if len(text) <= LONGEST and (match := _DELSYS.fullmatch(text)):
        triad = {"ACC": "accel", "GYRO": "gyro", "MAG": "mag"}[match["triad"]]
        of_column = unit_of(match["unit"] or "")
        return ColumnName(f"{triad}_{match['axis'].lower()}", of_column, family=match["of"])
    if len(text) <= LONGEST and (match := OF_BROWSER.fullmatch(text)):
        axis = {"alpha": "x", "beta": "y", "gamma": "z"}[match[2].lower()]
        return ColumnName(f"gyro_{axis}", "deg/s", family=match[1].lower())
    if not text.startswith("field."):
        return None
    if text == "field.header.stamp":
        return ColumnName("time", "ns")
    kind, _, axis = text.removeprefix("field.").partition(".")
    if kind not in ROS or axis not in tuple(_AXES):
        return ColumnName(None)
    triad, unit = ROS[kind]
    return ColumnName(f"{triad}_{axis}", unit, family=f"field.{kind}")


def _read(bare: str, written: str, of: Vocabulary) -> ColumnName:
    """Read a name without its unit in brackets, which is `written`."""
    unit = unit_of(written, of.kinds) if written else None
    if not written or (unit is None and of.sensors):
        bare, unit = _without_unit(bare, of)
    said = ColumnName(None, unit)
    if unit and bare.lower().strip("_ ") == "sampletimefine":
        return ColumnName("time", unit)  # without a unit it counts 0.1 ms
    # In group/sub/name the last part decides, unless the whole is a known name.
    parts = re.split(r"[/.:]", bare) if of.sensors else [bare]
    if unit is None and len(parts) > 1 and parts[-1].lower() in tuple(_AXES):
        # The unit of a sensor whose axes are members: gyro_dps.x.
        parts[-2], unit = _without_unit(parts[-2], of)
    about = any(word in ABOUT for word in re.split(_SIGNS, bare.lower()))
    if not (about and of.sensors):
        read = [_read_words(" ".join(parts[k:]), unit, of, about) for k in range(len(parts))]
        # Words of a group may be unknown where the last part is a name.
        order = sorted(range(len(parts)), key=lambda k: read[k].loose == UNKNOWN_WORDS)
        for start in order:
            said = read[start]
            if said.quantity:
                family = f"{' '.join(parts[:start]).lower()} {said.family}".strip()
                said = replace(said, family=family if said.family else "")
                break
    if said.quantity is None and of.sensors and not of.stems:
        said = _by_unit(bare, written, said)
    if written and unit is None and said.quantity == "time":
        # Of which clock, before its unit: Time (GPS s).
        words, its = unit_words(written.lower().split(), ("time",))
        if its and set(words) <= OF_TIME:
            return replace(said, unit=its)
    if written and unit is None and not of.sensors:
        # The datum of an angle or a height is a part of its name: Alt (HAE), latitude (WGS84).
        level = _read_words(f"{bare} {written}", None, of, about)
        if level.quantity or _DATUM.fullmatch(written):
            return level if level.quantity else said
    quantity = said.quantity
    kind = find_unit(said.unit) if said.unit else None
    if str(quantity).startswith("mag") and said.unit in MAGNETIC:
        return replace(said, unit=MAGNETIC[said.unit])
    if quantity == "time" and (
        (written and unit is None and written.lower() not in OF_TIME)
        or (kind and kind[0] != "time")
    ):
        # A temperature or an angle is not a clock; a text in brackets may be anything: time (of
        # day).
        said = replace(said, quantity=None if of.sensors or kind else quantity)
    elif of.sensors and quantity in _TURN_OF and kind and kind[0] == "rate":
        return replace(said, quantity=f"gyro_{_TURN_OF[str(quantity)]}", loose=2, family="turn")
    elif of.sensors and quantity in QUANTITIES[1:] and kind and kind[0] == "time":
        return ColumnName(None, said.unit)  # gyro_x_min
    if written and unit is None and not of.sensors and written.lower() not in OF_TIME:
        said = replace(said, unit=re.sub(r"\s+", "", written.strip("[]() ").lower()))
    return said


def _by_unit(bare: str, written: str, said: ColumnName) -> ColumnName:
    """Read a name of which its unit alone says the sensor: ``x-axis (deg/s)``, ``AsX(°/s)``.

    A rate may have words that are not known; an acceleration may be one without gravity, and a
    field in capitals (mG) is as often one in thousandths of g, so those have an axis alone.
    """
    words = _words_of(bare)
    axes = [w for w in words if w in _AXES]
    other = [w for w in words if w not in _AXES and w not in (*NOISE, said.unit)]
    if len(axes) != 1 and said.unit in ACCEL_UNITS:
        axes = [a for a, known in DIRECTIONS.items() for w in other if w in known]
        other = [w for w in other if not any(w in known for known in DIRECTIONS.values())]
    if len(axes) != 1 or OTHER_QUANTITY & {*other} or TURNS.keys() & {*other}:
        return said
    triad = next((t for t, units in BY_UNIT.items() if said.unit in units), "")
    if not triad or (triad != "gyro" and (other or "G" in written)):
        return said
    family = " ".join(other) or str(said.unit)
    return replace(said, quantity=f"{triad}_{axes[0]}", loose=2, family=family)


def _without_unit(text: str, of: Vocabulary) -> tuple[str, str | None]:
    """Split a unit off the end of a name, the longest first: ``acc x m/s/s``, ``P,rad/s``."""
    if "".join(re.split(_SIGNS, text.lower())) in (LOGS if of.sensors else of).index:
        return text, None
    for sign in re.finditer(_SIGNS, text):
        rest = text[sign.end() :]
        # A letter, or "in", is a unit of a crash record in brackets alone.
        kinds = OF_LOGS if of.stems and len(rest) < 3 else of.kinds
        member = of.sensors and sign[0] == "."
        if sign.start() and not member and (unit := unit_of(rest, kinds)):
            return re.sub(r"\s+in$", "", text[: sign.start()]), unit
    return text, None


def clocks_with_unit(names: list[str], has_unit: Callable[[str], bool]) -> list[str]:
    """Return those of several clocks that state their unit; all if none does."""
    return [name for name in names if has_unit(name)] or names


def _read_words(text: str, unit: str | None, of: Vocabulary, about: bool) -> ColumnName:
    # Brackets before those of the unit hold a word of the name: GPS (Lat.) [deg].
    word = "".join(re.split(_SIGNS if of.sensors else _SIGNS_AND_BRACKETS, text.lower()))
    if (said := _known(word, of)) and not said.loose:
        return replace(said, unit=unit or said.unit)
    rest = word
    while of.before is not None and (match := of.before.match(rest)):
        rest = rest[match.end() :]
        if said := _known(rest, of):
            return replace(said, unit=unit or said.unit, loose=1)
    if not of.sensors and (member := _MEMBER.search(text)):
        # The member of a message: field.latitude, OSD.altitude.
        said = _read_words(text[member.end() :], unit, of, about)
        if said.quantity and not said.loose:
            return replace(said, loose=1)
    # Names in capitals without separators (latDeg), in another order (x_gyro), with words that say
    # nothing of the quantity (raw_acceleration_x), or twice the same (gyroRotationRateX).
    text, chip = _without_chip(text) if of.sensors else (text, "")
    words = _words_of(text)
    if unit is None:
        words, its = unit_words(words, OF_LOGS if of.stems else of.kinds)
        unit = its or None
    if not of.sensors:
        whole = "".join(words)
        said = None if about or len(whole) < 3 else _known(whole, of)
        if said is None:
            behind = of.before is not None and of.before.match("".join(words))
            bare = words[1:] if behind else words  # location timestamp
            clock = "time" in of.quantities and _is_clock(bare)
            return ColumnName("time" if clock else None, unit, loose=2)
        return replace(said, unit=unit or said.unit, loose=2)
    bare = [part for w in words if not _is_model(w) for part in re.findall(r"\D+|\d+", w)]
    bare = [_FRAMED.get(w, w) for w in bare if w not in NOISE]
    axes = [k for k, w in enumerate(bare) if w in _AXES]
    force = [k for k in range(len(bare) - 1) if bare[k : k + 2] == ["g", "force"]]
    for k in force:
        bare[k : k + 2] = ["gforce"]
    if not axes and any(w in TRIADS["accel"] for w in bare):
        bare = [next((a for a, known in DIRECTIONS.items() if w in known), w) for w in bare]
        axes = [k for k, w in enumerate(bare) if w in _AXES]
    if len(axes) == 1:
        bare.append(bare.pop(axes[0]))
    said = _known("".join(bare), of) or _of_words(bare)
    said = said or _known("".join(w for w in bare if not w.isdecimal()), of)
    if said is None and PLACES & {*bare}:
        said = _of_words([w for w in bare if w not in PLACES])
        # A letter behind a place may be anything: foot_f_x.
        if said is None or str(said.quantity)[-2:-1] != "_" or len(said.family) < 2:
            said = None
    if said is None and not of.stems:
        said = _among_words(bare)
    if said is None:
        return ColumnName(None, unit)
    if said.family and said.number is None:
        # All words but the axis, so that two sensors are two families.
        axis = str(said.quantity)[-1]
        other = [w for w in words if w != axis and w not in TURNS]
        family = "".join(other) if len(other) < len(words) else said.family
        family = f"of {family}{chip}" if words[:1] == [axis] else f"{family}{chip}"
        said = replace(said, family=f"{family}#" if len(family) < 2 else family)
    return replace(said, unit=unit or said.unit, loose=max(said.loose, 2))


def _among_words(words: list[str]) -> ColumnName | None:
    """Read the name of one sensor and one axis among words that are not known, at last."""
    triads = {t for t, names in TRIADS.items() for w in words if len(w) > 2 and w in names}
    axes = [w for w in words if w in _AXES]
    if len(triads) != 1 or len(axes) != 1 or OTHER_QUANTITY & {*words} or TURNS.keys() & {*words}:
        return None
    triad, family = triads.pop(), " ".join(w for w in words if w not in _AXES)
    if triad == "accel" and {"angular", "ang"} & {*words}:
        return None
    linear = bool(WITHOUT_GRAVITY & {*words})
    return ColumnName(f"{triad}_{axes[0]}", loose=UNKNOWN_WORDS, family=family, linear=linear)


def _without_chip(text: str) -> tuple[str, str]:
    """Split off the name of a chip, and a letter of its version, beside the name of a sensor."""
    kept: list[str] = []
    chip: list[str] = []
    for part in re.split(_SIGNS, text):
        version = bool(chip) and len(part) == 1 and part.lower() not in tuple(_AXES)
        (chip if version or CHIP.fullmatch(part.lower()) else kept).append(part)
    return (" ".join(kept), "".join(chip).lower()) if kept and chip else (text, "")


def _words_of(text: str) -> list[str]:
    """Return the words of a name, in lower case and in English where they are known."""
    plain = _SCRIPTS.sub(" ", without_accents(text))  # an accent parts no word: Längs
    return [e for w in _HUMPS.findall(plain) for e in _english(w.lower())]


def parts_in(name: str) -> frozenset[str]:
    """Return the words of a name that say on which part of a body a sensor is."""
    return frozenset(_words_of(split_brackets(name)[0])) & PARTS


def _english(word: str) -> tuple[str, ...]:
    """Return a word in English, if it is one of `ABROAD`; Gierrate becomes yaw and rate.

    Längsbeschleunigung becomes the word of `DIRECTIONS` and acceleration.
    """
    plain = without_accents(word)
    for english, stems in ABROAD.items():
        stem = next((s for s in stems if plain.startswith(s)), "")
        if stem and english in TURNS:
            return (english, *(_english(plain[len(stem) :]) if plain != stem else ()))
        if stem:
            return (english,)
    for stem in (name for names in DIRECTIONS.values() for name in names):
        rest = plain.removeprefix(stem)
        if rest not in ("", plain) and (behind := _english(rest)) != (rest,):
            return (stem, *behind)
    return (plain,)


def _is_model(word: str) -> bool:
    """Whether a word of letters and digits names a unit or a chip: BMI160, imu1."""
    letters = word.rstrip("0123456789")
    return (
        0 < len(letters) < len(word)
        and letters not in ABOUT
        and not any(letters in names for names, _, _ in SENSORS)
    )


def _known(word: str, of: Vocabulary) -> ColumnName | None:
    """Read a name without blanks and signs, in lower case."""
    # Names of sensors in a crash record are those in a log.
    exact = (LOGS if of.sensors else of).index.get(word)
    if exact is not None:
        quantity, sign = exact
        unit = CLOCKS.get(word) if quantity == "time" else None
        return ColumnName(
            quantity, unit, sign=sign, family="p" if quantity.startswith("rate_") else ""
        )
    if not of.sensors:
        return None
    sensor, axis = word[:-1], word[-1:]
    if axis not in _AXES:
        sensor, axis = (word[1:], word[:1]) if word[:1] in _AXES and len(word) > 2 else (word, "")
    turned = bool(axis) and sensor == word[1:]
    for names, triad, increment in SENSORS:
        if sensor in names and (axis or (len(sensor) > 1 and sensor not in WITH_AXIS)):
            quantity = f"{triad}_{axis}" if axis and axis in _AXES else triad
            return ColumnName(
                quantity,
                unit_of(sensor) if sensor in NAMED_BY_UNIT else None,
                loose=int(turned),
                family=f"of {sensor}" if turned else sensor,
                linear=sensor in WITHOUT_GRAVITY,
                increment=increment,
            )
        # A name that ends in x, y or z without meaning an axis.
        if word in names and len(word) > 1 and word not in WITH_AXIS:
            return ColumnName(triad, family=word, increment=increment)
    return None


def _of_words(words: list[str]) -> ColumnName | None:
    """Read the words of a name together: sensors with words beside them, turns, numbers."""
    turn = [w for w in words if w in TURNS]
    rest = [w for w in words if w not in TURNS]
    if len(turn) == 1 and rest and ("".join(rest) in RATES or set(rest) <= RATES):
        return ColumnName(f"gyro_{TURNS[turn[0]]}", family="".join(rest))
    axis = words[-1] if words and words[-1] in _AXES else ""
    number = words[-1] if words and words[-1].isdecimal() else ""
    bare = [w for w in (words[:-1] if axis or number else words) if not w.isdecimal()]
    for triad, beside in BESIDE.items():
        named = [w for w in bare if w in TRIADS[triad] and len(w) > 2]
        name = "".join(bare)
        known = name in TRIADS[triad] and (bool(axis) or name not in WITH_AXIS)
        known = known or (bool(axis) and bare == [SHORT[triad]])
        if not (known or (named and set(bare) <= {*named, *beside})):
            continue
        return ColumnName(
            f"{triad}_{axis}" if axis else triad,
            family="".join(bare),
            linear=bool(WITHOUT_GRAVITY & {*bare, "".join(bare)}),
            number=int(number) if number and len(number) == 1 else None,
        )
    return ColumnName("time") if _is_clock(words) else None


def _is_clock(words: list[str]) -> bool:
    clock = {"time", "timestamp", "timestamps", "stamp"} & set(words) and set(words) <= OF_TIME
    letter = words[:1] == ["t"] and len(words) > 1 and set(words[1:]) <= OF_TIME  # t_unix
    return bool(clock) or letter or words == ["date"]


def _of_heading(text: str, written: str, said: ColumnName, of: Vocabulary) -> ColumnName:
    """Read the heading of a crash record: the unit decides, then the words.

    `said`: what it says as the name of a sensor.
    """
    text = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", text)  # accX: a capital begins a word
    words = _WORD.findall(without_accents(text.lower()))
    known = find_unit(written or said.unit or "", of.kinds)
    unit = known[1] if known else written or None
    change = CHANGE.search(" ".join(words)) is not None
    triad = str(said.quantity).partition("_")[0]
    if said.quantity == "time" and not (known and known[0] != "time") and (known or not written):
        return ColumnName("time", unit)
    if {"speed", "speeds"} & set(words) and triad not in of.sensors:
        return ColumnName("other", unit)
    # For phone makers gx is of a gyro, for makers of crash recorders an acceleration in g.
    either = "".join(words) in ("gx", "gy", "gz")
    exact = (q for q, k in of.quantities.items() if any(w in k.words for w in words))
    spoken = "velocity" if change else "" if either else of.sensors.get(triad) or next(exact, "")
    spoken = "time" if said.quantity == "time" else spoken
    by_stems, loose = ("", 0) if either else _by_stems(words, said, of)
    quantity: str | None = spoken or by_stems or None
    if by_stems == "other" and spoken != "time" and not (change or triad in of.sensors):
        quantity = "other"  # gyro temp
    loose = 0 if spoken or known else loose
    if known and known[0] == "time":
        quantity = None if by_stems in ("", "time") and not spoken else "other"
        quantity = "time" if "time" in words and not change else quantity
    elif known:
        quantity = known[0]
    elif not spoken and written and find_unit(written, tuple(FACTORS)):
        quantity = "other"
    axis, sure, family = _axis(words, quantity, said)
    return ColumnName(
        quantity,
        unit,
        loose or int(not sure),
        family,
        axis=axis,
        change=change and quantity == "velocity",
        spoken=spoken if known and quantity not in (spoken, "other", None) else "",
    )


def _by_stems(words: list[str], said: ColumnName, of: Vocabulary) -> tuple[str, int]:
    """Return the quantity by beginnings of words, of several languages, and how loosely."""
    for quantity, stems in of.stems.items():
        long = tuple(s for s in stems if len(s) > 2)
        for word in words:
            if word.startswith(long):
                # A beginning of some letters is one of other words, too: accuracy.
                sure = word.startswith(tuple({s for s in stems if len(s) > 4} - TURN_STEMS.keys()))
                return quantity, 0 if quantity == "other" or (sure and quantity != "time") else 2
            if word in stems or (quantity == "time" and word.endswith(long)):
                return quantity, 2
    if words and {words[-1], "".join(words)} & set(COUNTERS):
        return "counter", 0
    # A lone b or m is a second accelerometer more often than a magnetometer.
    mag = str(said.quantity).startswith("mag") and said.loose
    return ("other", 0) if said.quantity and not mag else ("", 0)


def _axis(words: list[str], quantity: str | None, said: ColumnName) -> tuple[str, bool, str]:
    """Return the axis, whether it is sure, and the other words: what columns of a triad share."""
    axes = {AXIS_WORDS[w]: k for k, w in enumerate(words) if w in AXIS_WORDS}
    at = max((k for k, w in enumerate(words) if w in {*AXIS_WORDS, *TURN_STEMS}), default=-1)
    turned = next((k for k, w in enumerate(words) if w.startswith(tuple(TURN_STEMS))), -1)
    ends = [
        k for k, w in enumerate(words) if w[-1] in _AXES and 1 < len(w) < 4 and w not in NO_AXIS
    ]
    rest, loosely = list(words), ""
    if at >= 0:
        del rest[at]
    elif turned >= 0:
        stem = next(s for s in TURN_STEMS if words[turned].startswith(s))
        loosely, rest[turned] = TURN_STEMS[stem], words[turned][len(stem) :]
    elif ends:
        loosely, rest[ends[-1]] = words[ends[-1]][-1], words[ends[-1]][:-1]
    turn = next((TURNS[w] for w in words if w in TURNS), "") if quantity == "rate" else ""
    triad = str(said.quantity)[-1] if str(said.quantity)[-2:] in ("_x", "_y", "_z") else ""
    sensors = {w[-1] for w in words if w[-1] in _AXES and any(w[:-1] in n for n in _NAMED)}
    if turn or triad:
        axis = turn or triad
    elif quantity == "other" or (quantity is None and {*words} & {*_AXES}):
        axis = next((w for w in words if w in tuple(_AXES)), "")
    elif axes or len(sensors) == 1:
        axis = next(iter(axes or sensors)) if len(axes or sensors) == 1 else ""
    else:
        axis = loosely or (TURN_STEMS[words[at]] if at >= 0 and quantity != "time" else "")
        return axis, not axis, " ".join(rest)
    return axis, True, " ".join(rest)


#: Names of sensors of more than a letter.
_NAMED = [[n for n in names if len(n) > 1] for names in TRIADS.values()]


def parse_column_option(items: list[str]) -> dict[str, str]:
    """Parse ``--columns`` as quantity to column.

    `items`: each ``quantity=column``, several joined by commas. ConfigError: the syntax is wrong or
    the quantity is unknown.
    """
    known = [*QUANTITIES, *TRIADS]
    out: dict[str, str] = {}
    for item in (part for text in items for part in text.split(",") if part.strip()):
        quantity, equals, column = (piece.strip() for piece in item.partition("="))
        if not equals or not column:
            raise ConfigError("io.no-form-understood", quantity="--columns", item=item)
        check_choice("io.unknown-quantity", known, quantity="--columns", of_what=quantity)
        out[quantity] = column
    return out


def parse_axes(text: str) -> tuple[list[int], list[float]]:
    """Parse which sensor axis points forward, right and down.

    `text`: three of ``x y z`` with an optional sign, as in ``x,-y,-z``; or the directions of the
    sensor's x, y and z: ``forward-left-up``, which is equivalent. Returns `axis`: sensor axis of
    each body axis, 0 to 2. ConfigError: the text is not a signed permutation of three axes.
    """
    words = re.split(r"[\s,\-]+", text.strip().lower())
    if len(words) == 3 and all(w in _DIRECTIONS for w in words):
        said = [_DIRECTIONS[w] for w in words]
        if sorted(body for body, _ in said) != [0, 1, 2]:
            raise ConfigError("io.axes-name-direction-twice", quantity="--axes", text=text)
        axis = [next(k for k, (body, _) in enumerate(said) if body == b) for b in range(3)]
        return axis, [said[k][1] for k in axis]
    parts = [p.strip().lower() for p in text.split(",")]
    names = [p.lstrip("+-") for p in parts]
    if sorted(names) != ["x", "y", "z"] or any(
        len(p) - len(n) > 1 for p, n in zip(parts, names, strict=True)
    ):
        raise ConfigError("io.axes-not-three", quantity="--axes", text=text)
    return [_AXES.index(n) for n in names], [-1.0 if p.startswith("-") else 1.0 for p in parts]
