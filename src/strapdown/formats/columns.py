"""Quantity and unit from the name of a column."""

from __future__ import annotations

import re
from dataclasses import dataclass

from strapdown.constants import TIME_UNITS
from strapdown.errors import ConfigError
from strapdown.formats.unit_words import UNIT_OF, unit_of

__all__ = [
    "QUANTITIES",
    "ColumnName",
    "parse_axes",
    "parse_column_option",
    "read_name",
    "says_increment",
]

_AXES = "xyz"
TRIADS = {
    "gyro": [
        "gyro",
        "gyr",
        "gyroscope",
        "gyroscopes",
        "imugyr",
        "imugyro",
        "angularvelocity",
        "angularrate",
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
        "acceleration",
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
    """

    quantity: str | None
    unit: str | None


def read_name(name: str) -> ColumnName:
    """Parse quantity and unit from a column's name.

    Parameters
    ----------
    name : str
        As ``gyro_x_rad_s``, ``Gyroscope x (rad/s)``, ``wx``, ``acc_y [g]``, ``time_ms``; or
        ``gyro[0]``, the first of an array of three.

    Returns
    -------
    ColumnName
        None for each part that the name does not state.
    """
    text, index = name.strip(), ""
    if match := INDEXED.fullmatch(text):
        text, index = match.groups()
    bracket = _BRACKETS.search(text)
    unit = unit_of(bracket.group(1)) if bracket else None
    if bracket:
        text = text[: bracket.start()]
    said = ColumnName(None, unit)
    # In group/sub/name the last part decides, unless the whole is a known name.
    parts = re.split(r"[/.]", text)
    for start in range(len(parts)):
        said = _read_words(" ".join(parts[start:]), unit)
        if said.quantity:
            break
    quantity = said.quantity
    if str(quantity).startswith("mag") and said.unit in _MAGNETIC:
        said = ColumnName(quantity, _MAGNETIC[said.unit])
    if quantity in TRIADS and index in _AXES_BY_INDEX:
        quantity = f"{quantity}_{_AXES_BY_INDEX[index]}"
    if quantity == "time" and (
        (bracket and unit is None) or (said.unit is not None and said.unit not in TIME_UNITS)
    ):
        return ColumnName(None, said.unit)
    return ColumnName(quantity, said.unit)


def _read_words(text: str, unit: str | None) -> ColumnName:
    words = [w for w in re.split(r"[\s_\-/:]+", text.lower()) if w]
    if unit is None:
        words, unit = _split_unit(words)
    word = "".join(words)
    return ColumnName(_quantity(word), unit or CLOCKS.get(word))


def _split_unit(words: list[str]) -> tuple[list[str], str | None]:
    """Split a unit off the end, the longest first: ``m s2``, ``rad s``, ``s``."""
    for take in (3, 2, 1):
        if len(words) > take:
            spelled = "_".join(words[-take:])
            if spelled in UNIT_OF:
                return words[:-take], UNIT_OF[spelled]
    return words, None


def _quantity(word: str) -> str | None:
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


def says_increment(name: str) -> bool:
    """Whether a name states that its column holds increments per sample.

    Parameters
    ----------
    name : str
        As ``dtheta_x_rad``, ``delta_v_y (m/s)``, ``dv[2]``.
    """
    text = _BRACKETS.sub("", INDEXED.sub(r"\1", name.strip()))
    known = [n for names in SUMMED.values() for n in names]
    words, _ = _split_unit([w for w in re.split(r"[\s_\-/:.]+", text.lower()) if w])
    return any(
        (word := "".join(words[start:])) in known or (word[-1:] in _AXES and word[:-1] in known)
        for start in range(len(words))
    )


def parse_column_option(items: list[str]) -> dict[str, str]:
    """Parse ``--columns`` as quantity to column.

    Parameters
    ----------
    items : list of str
        Each ``quantity=column``, several joined by commas.

    Returns
    -------
    dict of str to str

    Raises
    ------
    ConfigError
        The syntax is wrong or the quantity is unknown.
    """
    known = [*QUANTITIES, *TRIADS]
    out: dict[str, str] = {}
    for item in (part for text in items for part in text.split(",") if part.strip()):
        quantity, equals, column = (piece.strip() for piece in item.partition("="))
        if not equals or not column:
            raise ConfigError("io.no-form-understood", quantity="--columns", item=item)
        if quantity not in known:
            raise ConfigError(
                "io.unknown-quantity",
                quantity="--columns",
                of_what=quantity,
                word=quantity,
                known=known,
            )
        out[quantity] = column
    return out


def parse_axes(text: str) -> tuple[list[int], list[float]]:
    """Parse which sensor axis points forward, right and down.

    Parameters
    ----------
    text : str
        Three of ``x y z`` with an optional sign, as in ``x,-y,-z``; or the directions of the
        sensor's x, y and z: ``forward-left-up``, which is equivalent.

    Returns
    -------
    axis : list of int
        Sensor axis of each body axis, 0 to 2.
    sign : list of float

    Raises
    ------
    ConfigError
        The text is not a signed permutation of three axes.
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
