"""Quantity, axis and unit from the name of a column, a key, a data set or a variable."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Sequence
from dataclasses import dataclass, replace

from strapdown.errors import ConfigError, check_choice
from strapdown.units import find_unit, unit_of, unit_words

__all__ = [
    "QUANTITIES",
    "ColumnName",
    "parse_axes",
    "parse_column_option",
    "read_name",
    "split_brackets",
]


_AXES = "xyz"
#: Beginnings of German, French, Spanish, Italian and further words, without accents, by the English
#: word that they stand for.
ABROAD = {
    english: tuple(stems.split())
    for english, stems in {
        "time": "zeit uhrzeit temps horodat tiempo tempo vrijeme vreme czas tijd",
        "acceleration": "beschl aceler accelerazion accelerometr przysp ubrz versnell",
        "gyroscope": "drehrate drehgeschw winkelgeschw giroscop gyroskop kreisel",
        "magnetometer": "magnetfeld magnetometr",
        "velocity": "geschwindigkeit vitesse velocidad velocita",
        "angular": "angulaire angolar",
        "linear": "linear lineaire lineal",
        "without": "ohne sans senza",
        "roll": "wank roulis alabeo rollio",
        "pitch": "nick tangage cabeceo beccheggio",
        "yaw": "gier lacet guinada imbardata",
    }.items()
}
#: Words for the axes of a vehicle.
DIRECTIONS = {
    "x": ("longitudinal", "longit", "langs", "laengs", "longitudinale"),
    "y": ("lateral", "quer", "laterale", "transversal"),
    "z": ("vertical", "vertikal", "hoch", "verticale"),
}
# Names of a sensor without their axis: blanks, underscores and capitals do not count.
_TRIAD_WORDS = {
    "gyro": "gyro gyros gyr gyroscope gyroscopes imugyr imugyro angularvelocity angularvel angvel "
    "velocityangular rotationvelocity velocityrotation "
    "angularrate angularrates angrate angularspeed turnrate rot rotationrate rotrate omega rate "
    "w g ω",
    "accel": "accel acce acc accelerometer accelerometers accelerations acceleration accl "
    "linearacceleration linacc linaccel lina gforce gf imuacc imuaccel specificforce a f",
    "mag": "mag magn magnet magnetic magnetometer magnetometers magneticfield magfield field "
    "imumag compass m b",
}
TRIADS = {triad: words.split() for triad, words in _TRIAD_WORDS.items()}
# Names of columns that hold increments per sample.
SUMMED = {
    "gyro": ["dtheta", "deltatheta", "dangle", "deltaangle", "angleincrement", "dang"],
    "accel": ["dv", "deltav", "dvel", "deltavel", "deltavelocity", "velocityincrement"],
}
#: Gravity by itself, as phones write it beside acceleration without it.
_GRAVITY = ("gravity", "grav", "gvec")
# Words that may accompany the name of a sensor, and repeat it or state how it is meant.
_BESIDE = {
    "gyro": {"angular", "rotation", "rotational", "rate", "rates", "velocity", "vel", "speed"},
    "accel": {"acceleration", "linear", "lin", "user", "including", "gravity", "with", "without"},
    "mag": {"magnetic", "field"},
}
_WITHOUT_GRAVITY = {"linear", "lin", "user", "without", "linacc", "linaccel", "linearacceleration"}
_WITHOUT_GRAVITY |= {"lina", "lineara", "usera"}
# A name that is a unit says the sensor: dps_x, uT_x. The letter g may be anything.
_NAMED_BY_UNIT = {
    **dict.fromkeys(("dps", "mdps", "rads", "degs"), "gyro"),
    **dict.fromkeys(("mps2", "ms2"), "accel"),
    **dict.fromkeys(("ut",), "mag"),
}
#: Axis of the body that a turn is about.
TURNS = {"roll": "x", "pitch": "y", "yaw": "z"}
_RATES = {"rate", "speed", "velocity", "vel", "dot", *TRIADS["gyro"]} - set("wgω")
_TIME_WORDS = (
    "time t ts timestamp timestamps timesec elapsed secondselapsed seconds sec tow sow gpssow "
    "gpstow gpstime unixtime epoch stamp elapsedtime timeelapsed timesincestart sampletime "
    "sensortime systemtime unixtimestamp datetime localtime utc utctime timeutc "
    "zeit zeitstempel temps tiempo tempo"
)
TIMES = _TIME_WORDS.split()
# Names of clocks that state their unit.
CLOCKS = {
    "seconds": "s",
    "secs": "s",
    "sec": "s",
    "secondselapsed": "s",
    "elapsedseconds": "s",
    "millis": "ms",
    "milliseconds": "ms",
    "micros": "us",
    "microseconds": "us",
    "nanos": "ns",
    "nanoseconds": "ns",
    "ms": "ms",
    "msec": "ms",
    "us": "us",
    "usec": "us",
    "ns": "ns",
    "nsec": "ns",
}
QUATERNIONS = {
    "q_w": ["qw", "quatw", "quaternionw", "q0"],
    "q_x": ["qx", "quatx", "quaternionx", "q1"],
    "q_y": ["qy", "quaty", "quaterniony", "q2"],
    "q_z": ["qz", "quatz", "quaternionz", "q3"],
}
EULERS = {
    "roll": ["roll", "phi"],
    "pitch": ["pitch", "theta"],
    "heading": ["heading", "yaw", "psi"],
}
QUANTITIES = [
    "time",
    *(f"{triad}_{axis}" for triad in TRIADS for axis in _AXES),
    *QUATERNIONS,
    *EULERS,
]

#: Rates about forward, right and down in the notation of flight mechanics, if all three are there:
#: a letter alone may be anything.
BODY_RATES = {"rate_p": "gyro_x", "rate_q": "gyro_y", "rate_r": "gyro_z"}
# Clocks of X-Plane's data output: of the simulated world and of all.
_XPLANE = ("_totl,_time",)
# G is also gravity.
_MAGNETIC = {"g": "gauss", "mg": "mG"}
# Arrays of PX4 (msg/SensorCombined.msg, SensorMag.msg), whose comments define their units.
_PX4 = {
    "gyro_rad": ("gyro", "rad/s"),
    "accelerometer_m_s2": ("accel", "m/s2"),
    "magnetometer_ga": ("mag", "gauss"),
}
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
_HUMPS = re.compile(r"[A-Z]+(?![a-z])\d*|[A-Z]?[^\W\d_A-Z]+\d*|[°µ]+|\d+|²")
_SIGNS = r"[\s_\-/:,;|]+"
# Words that do not distinguish quantities.
_NOISE = {
    *("raw", "imu", "sensor", "sensors", "data", "body", "device", "phone", "watch", "motion"),
    *("cal", "calib", "calibrated", "corrected", "meas", "measured", "value", "values", "axis"),
    *("ins", "the", "of", "in", "de", "del", "di", "reading", "readings", "uncal", "uncalibrated"),
}
# Words of a quantity that is about another: its spread, its error, its demand.
_ABOUT = {
    *("bias", "offset", "scale", "cov", "covariance", "std", "stddev", "stdev", "sd", "sigma"),
    *("var", "variance", "error", "err", "accuracy", "setpoint", "desired", "noise"),
}
# Text in brackets at the end, which may hold brackets: (m/(s*s)).
_BRACKETS = re.compile(r"[\[(]\s*((?:[^\[\]()]|\([^()]*\))*?)\s*[\])]\s*$")


@dataclass(frozen=True)
class ColumnName:
    """Quantity, axis and unit as read from the name of a column.

    Attributes
    ----------
    quantity : str or None
        One of `QUANTITIES`, or a triad's name where the column holds three numbers or the name ends
        in a number; ``gravity_x``, ``rate_p``.
    unit : str or None
        In the spelling of this package.
    loose : bool
        The quantity follows only without the words and the order of the name.
    family : str
        Of a sensor: the name without its axis. Columns of one sensor share it. One letter may mean
        anything.
    linear : bool
        The name says acceleration without gravity, as phones have it; in ROS it has gravity.
    increment : bool
        The name says increments per sample.
    number : int or None
        At the end of the name of a triad: ``gyro_1``.
    """

    quantity: str | None
    unit: str | None = None
    loose: bool = False
    family: str = ""
    linear: bool = False
    increment: bool = False
    number: int | None = None


def read_name(name: str) -> ColumnName:
    """Parse what the name of a column says.

    `name`: as ``gyro_x_rad_s``, ``Gyroscope x (rad/s)``, ``wx``, ``acc_y [g]``, ``time_ms``,
    ``IMU1/X-axis angular rate``, ``gyro_1``; or ``gyro[0]``, the first of an array of three.
    """
    text, index = unicodedata.normalize("NFC", name).strip(), ""
    if match := INDEXED.fullmatch(text):
        text, index = match.groups()
    if text.startswith("field."):
        return _ros_field(text)
    if index and text in _PX4:
        return _of_array(ColumnName(*_PX4[text], family=text), index)
    bare, bracket = split_brackets(text)
    unit = unit_of(bracket) if bracket else None
    if unit is None:
        bare, unit = _without_unit(bare)
    said = ColumnName(None, unit)
    if text.lower().strip() in _XPLANE:
        return ColumnName("time", "s")
    if unit and bare.lower().strip("_ ") == "sampletimefine":
        return ColumnName("time", unit)  # without a unit it counts 0.1 ms
    # In group/sub/name the last part decides, unless the whole is a known name.
    parts = re.split(r"[/.]", bare)
    if unit is None and len(parts) > 1 and parts[-1].lower() in tuple(_AXES):
        # The unit of a sensor whose axes are members: gyro_dps.x.
        parts[-2], unit = _without_unit(parts[-2])
    if not any(word in _ABOUT for word in re.split(rf"[/.]|{_SIGNS}", bare.lower())):
        for start in range(len(parts)):
            said = _read_words(" ".join(parts[start:]), unit)
            if said.quantity:
                family = f"{' '.join(parts[:start]).lower()} {said.family}".strip()
                said = replace(said, family=family if said.family else "")
                break
    quantity = said.quantity
    kind = find_unit(said.unit) if said.unit else None
    if str(quantity).startswith("mag") and said.unit in _MAGNETIC:
        said = replace(said, unit=_MAGNETIC[said.unit])
    elif quantity == "time" and (
        (bracket and unit is None and bracket.lower() not in _OF_TIME)
        or (kind and kind[0] != "time")
    ):
        return ColumnName(None, said.unit)
    elif quantity in QUANTITIES[1:] and kind and kind[0] == "time":
        return ColumnName(None, said.unit)  # gyro_x_min
    return _of_array(said, index) if index else said


def split_brackets(text: str) -> tuple[str, str]:
    """Split text in brackets off the end of a name, as a unit; empty without brackets."""
    bracket = _BRACKETS.search(text)
    return (text[: bracket.start()], bracket.group(1)) if bracket else (text, "")


def _of_array(said: ColumnName, index: str) -> ColumnName:
    """Give a triad the axis of an element of an array of three."""
    if said.quantity in TRIADS and int(index) < len(_AXES):
        return replace(said, quantity=f"{said.quantity}_{_AXES[int(index)]}", number=None)
    return said


def _ros_field(text: str) -> ColumnName:
    """Read a name of ``rostopic echo -p``: fields of a message, which define their units.

    ROS REP 103: SI units; stamps in ns.
    """
    if text == "field.header.stamp":
        return ColumnName("time", "ns")
    kind, _, axis = text.removeprefix("field.").partition(".")
    triad = {"angular_velocity": "gyro", "linear_acceleration": "accel", "magnetic_field": "mag"}
    units = {"gyro": "rad/s", "accel": "m/s2", "mag": "T"}
    if kind in triad and axis in ("x", "y", "z"):
        return ColumnName(f"{triad[kind]}_{axis}", units[triad[kind]], family=f"field.{kind}")
    return ColumnName(None)


def _without_unit(text: str) -> tuple[str, str | None]:
    """Split a unit off the end of a name, the longest first: ``acc x m/s/s``, ``P,rad/s``."""
    whole = "".join(re.split(_SIGNS, text.lower()))
    if whole in TIMES or whole in CLOCKS:
        return text, None
    for sign in re.finditer(_SIGNS, text):
        if sign.start() and (unit := unit_of(text[sign.end() :])):
            return re.sub(r"\s+in$", "", text[: sign.start()]), unit
    return text, None


def _read_words(text: str, unit: str | None) -> ColumnName:
    word = "".join(re.split(_SIGNS, text.lower()))
    if (said := _known(word)) and not said.loose:
        return replace(said, unit=unit or said.unit)
    # Names in capitals without separators (latDeg), in another order (x_gyro), with words that say
    # nothing of the quantity (raw_acceleration_x), or twice the same (gyroRotationRateX).
    words = [e for w in _HUMPS.findall(text) for e in _english(w.lower())]
    if unit is None:
        words, its = unit_words(words)
        unit = its or None
    bare = [part for w in words if not _is_model(w) for part in re.findall(r"\D+|\d+", w)]
    bare = [w for w in bare if w not in _NOISE]
    axes = [k for k, w in enumerate(bare) if w in _AXES]
    if not axes and any(w in TRIADS["accel"] for w in bare):
        bare = [next((a for a, known in DIRECTIONS.items() if w in known), w) for w in bare]
        axes = [k for k, w in enumerate(bare) if w in _AXES]
    if len(axes) == 1:
        bare.append(bare.pop(axes[0]))
    said = _known("".join(bare)) or _of_words(bare)
    said = said or _known("".join(w for w in bare if not w.isdecimal()))
    if said is None:
        return ColumnName(None, unit)
    if said.family and said.number is None:
        # All words but the axis, so that two sensors are two families.
        axis = str(said.quantity)[-1]
        rest = [w for w in words if w != axis and w not in TURNS]
        family = "".join(rest) if len(rest) < len(words) else said.family
        family = f"of {family}" if words[:1] == [axis] else family
        said = replace(said, family=f"{family}#" if len(family) < 2 else family)
    return replace(said, unit=unit or said.unit, loose=True)


def _english(word: str) -> list[str]:
    """Return a word in English, if it is one of `ABROAD`; Gierrate becomes yaw and rate."""
    plain = without_accents(word)
    for english, stems in ABROAD.items():
        stem = next((s for s in stems if plain.startswith(s)), "")
        if stem and english in TURNS:
            return [english, *(_english(plain[len(stem) :]) if plain != stem else [])]
        if stem:
            return [english]
    return [plain]


def without_accents(text: str) -> str:
    """Return the letters of a text without their accents."""
    return "".join(c for c in unicodedata.normalize("NFD", text) if not unicodedata.combining(c))


def _is_model(word: str) -> bool:
    """Whether a word of letters and digits names a unit or a chip: BMI160, imu1."""
    letters = word.rstrip("0123456789")
    return 0 < len(letters) < len(word) and not any(letters in names for names, _, _ in _NAMES)


def _known(word: str) -> ColumnName | None:
    """Read a name without blanks and signs, in lower case."""
    if f"rate_{word}" in BODY_RATES:
        return ColumnName(f"rate_{word}", family="p")
    if word in TIMES or word in CLOCKS:
        return ColumnName("time", CLOCKS.get(word))
    for quantity, known in {**QUATERNIONS, **EULERS}.items():
        if word in known:
            return ColumnName(quantity)
    sensor, axis = word[:-1], word[-1:]
    if axis not in _AXES:
        sensor, axis = (word[1:], word[:1]) if word[:1] in _AXES and len(word) > 2 else (word, "")
    turned = word[:1] == axis
    for names, triad, increment in _NAMES:
        if sensor in names and (axis or len(sensor) > 1):
            quantity = f"{triad}_{axis}" if axis and axis in _AXES else triad
            return ColumnName(
                quantity,
                unit_of(sensor) if sensor in _NAMED_BY_UNIT else None,
                loose=turned,
                family=f"of {sensor}" if turned else sensor,
                linear=sensor in _WITHOUT_GRAVITY,
                increment=increment,
            )
        # A name that ends in x, y or z without meaning an axis.
        if word in names and len(word) > 1:
            return ColumnName(triad, family=word, increment=increment)
    return None


_NAMES: tuple[tuple[Sequence[str], str, bool], ...] = (
    *((names, triad, False) for triad, names in TRIADS.items()),
    *((names, triad, True) for triad, names in SUMMED.items()),
    *(((unit,), triad, False) for unit, triad in _NAMED_BY_UNIT.items()),
    (_GRAVITY, "gravity", False),
)


def _of_words(words: list[str]) -> ColumnName | None:
    """Read the words of a name together: sensors with words beside them, turns, numbers."""
    turn = [w for w in words if w in TURNS]
    rest = [w for w in words if w not in TURNS]
    if len(turn) == 1 and rest and ("".join(rest) in _RATES or set(rest) <= _RATES):
        return ColumnName(f"gyro_{TURNS[turn[0]]}", family="".join(rest))
    axis = words[-1] if words and words[-1] in _AXES else ""
    number = words[-1] if words and words[-1].isdecimal() else ""
    bare = [w for w in (words[:-1] if axis or number else words) if not w.isdecimal()]
    for triad, beside in _BESIDE.items():
        named = [w for w in bare if w in TRIADS[triad] and len(w) > 2]
        known = "".join(bare) in TRIADS[triad]
        known = known or (bool(axis) and bare == [_SHORT[triad]])
        if not (known or (named and set(bare) <= {*named, *beside})):
            continue
        return ColumnName(
            f"{triad}_{axis}" if axis else triad,
            family="".join(bare),
            linear=bool(_WITHOUT_GRAVITY & {*bare, "".join(bare)}),
            number=int(number) if number and len(number) == 1 else None,
        )
    clock = {"time", "timestamp", "timestamps", "stamp"} & set(words) and set(words) <= _OF_TIME
    if clock or words == ["date"]:
        return ColumnName("time")
    return None


# Names that are parts of words, unless their axis is written apart: MaX, but not max.
_SHORT = {"gyro": "gy", "accel": "ac", "mag": "ma"}
# Words of the name of a clock.
_OF_TIME = {
    *("time", "timestamp", "timestamps", "stamp", "unix", "epoch", "utc", "gps", "system"),
    *(
        "gmt",
        "sample",
        "logging",
        "elapsed",
        "since",
        "start",
        "boot",
        "reboot",
        "local",
        "ros",
        "header",
    ),
}


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
    if said := _directions(text):
        return said
    parts = [p.strip().lower() for p in text.split(",")]
    names = [p.lstrip("+-") for p in parts]
    if sorted(names) != ["x", "y", "z"] or any(
        len(p) - len(n) > 1 for p, n in zip(parts, names, strict=True)
    ):
        raise ConfigError("io.axes-not-three", quantity="--axes", text=text)
    return [_AXES.index(n) for n in names], [-1.0 if p.startswith("-") else 1.0 for p in parts]


def _directions(text: str) -> tuple[list[int], list[float]] | None:
    """Convert directions of the sensor's x, y, z in words to sensor axes of the body axes."""
    words = re.split(r"[\s,\-]+", text.strip().lower())
    if len(words) != 3 or any(w not in _DIRECTIONS for w in words):
        return None
    said = [_DIRECTIONS[w] for w in words]
    if sorted(body for body, _ in said) != [0, 1, 2]:
        raise ConfigError("io.axes-name-direction-twice", quantity="--axes", text=text)
    axis = [next(k for k, (body, _) in enumerate(said) if body == b) for b in range(3)]
    return axis, [said[k][1] for k in axis]
