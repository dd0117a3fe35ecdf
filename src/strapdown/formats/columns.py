"""Quantity and unit from the name of a column."""

from __future__ import annotations

import re
from dataclasses import dataclass

from strapdown.errors import ConfigError, check_choice
from strapdown.units import TIME_UNITS, unit_of, unit_words

__all__ = [
    "QUANTITIES",
    "ColumnName",
    "parse_axes",
    "parse_column_option",
    "read_name",
    "says_increment",
    "says_linear",
]


_AXES = "xyz"
TRIADS = {
    "gyro": [
        "gyro",
        "gyros",
        "gyr",
        "gyroscope",
        "gyroscopes",
        "imugyr",
        "imugyro",
        "angularvelocity",
        "angularvel",
        "angvel",
        "angularrate",
        "angularrates",
        "angrate",
        "turnrate",
        "rot",
        "rotationrate",
        "omega",
        "rate",
        "w",
        "g",
    ],
    "accel": [
        "accel",
        "acce",
        "acc",
        "accelerometer",
        "accelerometers",
        "accelerations",
        "acceleration",
        "linearacceleration",
        "linacc",
        "linaccel",
        "accl",
        "gforce",
        "gf",
        "imuacc",
        "imuaccel",
        "specificforce",
        "a",
        "f",
    ],
    "mag": [
        "mag",
        "magn",
        "magnet",
        "magnetometer",
        "magnetometers",
        "magneticfield",
        "imumag",
        "compass",
        "m",
    ],
}
# Names of columns that hold increments per sample.
SUMMED = {
    "gyro": ["dtheta", "deltatheta", "dangle", "deltaangle", "angleincrement", "dang"],
    "accel": ["dv", "deltav", "dvel", "deltavel", "deltavelocity", "velocityincrement"],
}
TIMES = [
    "time",
    "t",
    "timestamp",
    "timestamps",
    "timesec",
    "elapsed",
    "secondselapsed",
    "seconds",
    "sec",
    "tow",
    "sow",
    "gpssow",
    "gpstow",
    "gpstime",
    "unixtime",
    "epoch",
    "stamp",
    "elapsedtime",
    "timeelapsed",
    "timesincestart",
    "sampletime",
    "sensortime",
    "systemtime",
    "unixtimestamp",
    "datetime",
    "localtime",
    "utc",
    "utctime",
    "timeutc",
]
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
# G is also gravity.
_MAGNETIC = {"g": "gauss", "mg": "mG"}
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
_AXES_BY_INDEX = {"0": "x", "1": "y", "2": "z"}
# Words of a name: split at signs, and where capitals begin or end.
_HUMPS = re.compile(r"[A-Z]+(?![a-z])\d*|[A-Z]?[a-zµμ°]+\d*|\d+|²")
# Words that do not tell quantities apart.
_NOISE = {
    *("raw", "field", "imu", "sensor", "sensors", "data", "body", "device", "phone", "watch"),
    *("cal", "calib", "calibrated", "corrected", "meas", "measured", "value", "values", "axis"),
    *("ins", "the", "of", "in", "reading", "readings"),
}
_BRACKETS = re.compile(r"[\[(]\s*([^\])]+?)\s*[\])]\s*$")


@dataclass(frozen=True)
class ColumnName:
    """Quantity and unit of a column name.

    Attributes
    ----------
    quantity : str or None
        One of `QUANTITIES`, or a triad's name where the column holds three numbers.
    unit : str or None
        In the spelling of this package.
    loose : bool
        The quantity follows only without the words and the order of the name.
    """

    quantity: str | None
    unit: str | None
    loose: bool = False


def read_name(name: str) -> ColumnName:
    """Parse quantity and unit from a column's name.

    `name`: as ``gyro_x_rad_s``, ``Gyroscope x (rad/s)``, ``wx``, ``acc_y [g]``, ``time_ms``; or
    ``gyro[0]``, the first of an array of three. Returns none for each part that the name does not
    state.
    """
    text, index = name.strip(), ""
    if match := INDEXED.fullmatch(text):
        text, index = match.groups()
    bracket = _BRACKETS.search(text)
    unit = unit_of(bracket.group(1)) if bracket else None
    if bracket:
        text = text[: bracket.start()]
    said = ColumnName(None, unit)
    if text.startswith("field."):
        return _ros_field(text)
    # In group/sub/name the last part decides, unless the whole is a known name.
    parts = re.split(r"[/.]", text)
    for start in range(len(parts)):
        said = _read_words(" ".join(parts[start:]), unit)
        if said.quantity:
            break
    quantity = said.quantity
    if str(quantity).startswith("mag") and said.unit in _MAGNETIC:
        said = ColumnName(quantity, _MAGNETIC[said.unit], said.loose)
    if quantity in TRIADS and index in _AXES_BY_INDEX:
        quantity = f"{quantity}_{_AXES_BY_INDEX[index]}"
    if quantity == "time" and (
        (bracket and unit is None) or (said.unit is not None and said.unit not in TIME_UNITS)
    ):
        return ColumnName(None, said.unit)
    return ColumnName(quantity, said.unit, said.loose)


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
        return ColumnName(f"{triad[kind]}_{axis}", units[triad[kind]])
    return ColumnName(None, None)


def _read_words(text: str, unit: str | None) -> ColumnName:
    words = [w for w in re.split(r"[\s_\-/:]+", text.lower()) if w]
    bare, its = (words, unit) if unit else unit_words(words)
    word = "".join(bare)
    if quantity := _quantity(word):
        return ColumnName(quantity, its or CLOCKS.get(word))
    # Names in capitals without separators (latDeg), in another order (x_gyro), with words that say
    # nothing of the quantity (raw_acceleration_x).
    words = [w.lower() for w in _HUMPS.findall(text)]
    bare, its = (words, unit) if unit else unit_words(words)
    bare = [w for w in bare if w not in _NOISE]
    axes = [w for w in bare if w in _AXES]
    if len(axes) == 1:
        bare = [w for w in bare if w != axes[0]] + axes
    word = "".join(bare)
    return ColumnName(_quantity(word), its or CLOCKS.get(word), loose=True)


def _quantity(word: str) -> str | None:
    if f"rate_{word}" in BODY_RATES:
        return f"rate_{word}"
    if word in TIMES or word in CLOCKS:
        return "time"
    for table in (QUATERNIONS, EULERS):
        for quantity, names in table.items():
            if word in names:
                return quantity
    for triad, names in TRIADS.items():
        if word[-1:] in _AXES and word[:-1] in names:
            return f"{triad}_{word[-1]}"
        if word in names and len(word) > 1:
            return triad
    for triad, names in SUMMED.items():
        if word in names or (word[-1:] in _AXES and word[:-1] in names):
            return triad if word in names else f"{triad}_{word[-1]}"
    return None


def says_linear(name: str) -> bool:
    """Whether a name is of linear acceleration: without gravity on phones, with it in ROS."""
    return not name.startswith("field.") and "linear" in name.lower()


def says_increment(name: str) -> bool:
    """Whether a name states that its column holds increments per sample.

    `name`: as ``dtheta_x_rad``, ``delta_v_y (m/s)``, ``dv[2]``.
    """
    text = _BRACKETS.sub("", INDEXED.sub(r"\1", name.strip()))
    known = [n for names in SUMMED.values() for n in names]
    words, _ = unit_words([w for w in re.split(r"[\s_\-/:.]+", text.lower()) if w])
    return any(
        (word := "".join(words[start:])) in known or (word[-1:] in _AXES and word[:-1] in known)
        for start in range(len(words))
    )


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
