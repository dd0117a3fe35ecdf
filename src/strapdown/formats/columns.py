"""Quantity and unit from the name of a column."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass

from strapdown.constants import (
    ACCEL_SUMS,
    ACCEL_UNITS,
    GYRO_SUMS,
    GYRO_UNITS,
    MAG_UNITS,
    TIME_UNITS,
)
from strapdown.errors import ConfigError, check_choice

__all__ = [
    "QUANTITIES",
    "UNIT_OF",
    "ColumnName",
    "factor_of",
    "parse_axes",
    "parse_column_option",
    "parse_unit",
    "read_name",
    "says_increment",
    "says_linear",
    "unit_of",
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
    bare, its = (words, unit) if unit else _split_unit(words)
    word = "".join(bare)
    if quantity := _quantity(word):
        return ColumnName(quantity, its or CLOCKS.get(word))
    # Names in capitals without separators (latDeg), in another order (x_gyro), with words that say
    # nothing of the quantity (raw_acceleration_x).
    words = [w.lower() for w in _HUMPS.findall(text)]
    bare, its = (words, unit) if unit else _split_unit(words)
    bare = [w for w in bare if w not in _NOISE]
    axes = [w for w in bare if w in _AXES]
    if len(axes) == 1:
        bare = [w for w in bare if w != axes[0]] + axes
    word = "".join(bare)
    return ColumnName(_quantity(word), its or CLOCKS.get(word), loose=True)


def _split_unit(words: list[str]) -> tuple[list[str], str | None]:
    """Split a unit off the end, the longest first: ``m s2``, ``rad s``, ``s``."""
    for take in (3, 2, 1):
        if len(words) > take:
            spelled = "_".join(words[-take:])
            if spelled in UNIT_OF:
                return words[:-take], UNIT_OF[spelled]
    return words, None


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
    words, _ = _split_unit([w for w in re.split(r"[\s_\-/:.]+", text.lower()) if w])
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


# Spellings of units, and units of raw counts.


# Each spelling to its canonical word.
_SPELLINGS = {
    "rad/s": "rad/s rad_s rads rad_per_s rad_per_sec rad/sec radps rad·s-1 rad*s^-1 rad.s-1",
    "mrad/s": "mrad/s mrad_s",
    "deg/s": "deg/s deg_s degs dps °/s °_s º/s deg_per_s deg_per_sec deg/sec degps",
    "mdeg/s": "mdeg/s mdps mdeg_s",
    "deg/h": "deg/h deg/hr deg_h deg_per_h °/h",
    "m/s2": "m/s2 m/s^2 m/s² m_s2 ms2 ms^2 ms-2 mps2 m_per_s2 m_per_s_2 m/s/s m/sec2 m/sec^2 "
    "m·s-2 m*s^-2",
    "g": "g g0 gs",
    "m/s": "m/s m_s mps m_per_s m/sec m·s-1 m*s^-1",
    "g*s": "g*s g·s g_s",
    "mg": "mg",
    "uT": "ut µt μt microtesla",
    "nT": "nt nanotesla",
    "gauss": "gauss",
    "mG": "mgauss milligauss",
    "T": "tesla",
    "s": "s sec secs second seconds",
    "ms": "ms msec millis milliseconds",
    "us": "us µs μs usec micros microseconds",
    "ns": "ns nsec nanos nanoseconds",
    "min": "min minutes",
    "deg": "deg ° degree degrees",
    "rad": "rad radian radians",
}
UNIT_OF = {spelling: unit for unit, text in _SPELLINGS.items() for spelling in text.split()}
# Powers of a second, with any separator of the factors: rad s^-1, m·s⁻².
_POWERS = {
    "rads-1": "rad/s",
    "mrads-1": "mrad/s",
    "degs-1": "deg/s",
    "°s-1": "deg/s",
    "ms-2": "m/s2",
    "ms-1": "m/s",
}
_RAISED = str.maketrans({"⁻": "-", "−": "-", "¹": "1", "²": "2"})
_NUMBER = r"\d+(?:\.\d*)?(?:[eE][+-]?\d+)?"
# Counts per unit, as in deg/s/131; or units per count, as in 1/131 deg/s.
_PARTS = re.compile(rf"(?P<unit>.*\D)/\s*(?P<counts>{_NUMBER})")
_TIMES = re.compile(rf"(?P<up>{_NUMBER})(?:\s*/\s*(?P<down>{_NUMBER}))?\s*[ *·]\s*(?P<unit>\D.*)")


def unit_of(text: str) -> str | None:
    """Parse the spelling of a unit.

    `text`: as ``rad/s``, ``[deg/s]``, ``m s^-2``, in any case. Returns in the spelling of this
    package.
    """
    word = re.sub(r"\s+", "", text.strip().strip("[]()").lower())
    if word in UNIT_OF:
        return UNIT_OF[word]
    return _POWERS.get(re.sub(r"[·*.^]", "", word.translate(_RAISED)))


def parse_unit(text: str, kind: str) -> str:
    """Check a unit that the user stated.

    `text`: a unit; for a gyro or an accelerometer also one of raw counts, as ``deg/s/131`` or
    ``g/16384`` (counts per unit), or ``1/131 deg/s`` or ``0.061 deg/s`` (units per count). `kind`
    ({'gyro', 'accel', 'mag', 'time'}). Returns in the spelling of this package; `factor_of` has its
    factor. ConfigError: the text is not a unit of that kind.
    """
    known = {
        "gyro": {**GYRO_UNITS, **GYRO_SUMS},
        "accel": {**ACCEL_UNITS, **ACCEL_SUMS},
        "mag": MAG_UNITS,
        "time": TIME_UNITS,
    }[kind]
    unit = _word(text)
    if unit in known:
        return unit
    counted = kind in ("gyro", "accel")
    scale, of = _taken_apart(text) if counted else (None, "")
    if scale is None or (unit := _word(of)) not in known:
        raise ConfigError(
            "io.unknown-unit-or-counts" if counted else "io.unknown-unit",
            quantity=f"--{kind}-unit",
            word=text,
            known=known,
            example="deg/s/131" if kind == "gyro" else "g/16384",
        )
    counts = f"{1.0 / scale:g}"
    exact = math.isclose(float(counts) * scale, 1.0, rel_tol=1e-12)
    return f"{unit}/{counts}" if exact else f"{scale!r} {unit}"


def factor_of(unit: str, known: Mapping[str, float]) -> float:
    """Return the factor from a unit to SI.

    `unit`: as returned by `parse_unit`. `known`: factors of plain units.
    """
    if unit in known:
        return known[unit]
    scale, of = _taken_apart(unit)
    return float(scale or 1.0) * known[of]


def _word(text: str) -> str:
    """Return the unit of a text, or the text; for accelerometers also with the sign of iOS."""
    bare = text.strip()
    if bare.startswith("-") and (unit := unit_of(bare[1:])):
        return f"-{unit}"
    return unit_of(bare) or bare


def _taken_apart(text: str) -> tuple[float | None, str]:
    """Parse how much of which unit a count is; None if the text has no such form."""
    bare = text.strip()
    if match := _PARTS.fullmatch(bare):
        up, down, unit = 1.0, float(match["counts"]), match["unit"]
    elif match := _TIMES.fullmatch(bare):
        up, down, unit = float(match["up"]), float(match["down"] or 1.0), match["unit"]
    else:
        return None, ""
    scale = up / down if down > 0.0 else math.inf
    return (scale if 0.0 < scale < math.inf else None), unit
