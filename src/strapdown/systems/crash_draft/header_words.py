"""Meaning of a crash record's column headings, in several languages."""

from __future__ import annotations

import re
from dataclasses import dataclass

from strapdown.formats.columns import read_name, unit_of

__all__ = ["Heading", "read_heading"]

# Words and beginnings of words, longest first where one begins another.
_TIME = ("zeit", "temps", "tiempo", "tempo", "vrijeme", "vreme", "czas", "stamp", "clock", "time")
_COUNTER = ("n", "nr", "no", "num", "number", "index", "idx", "sample", "count", "counter", "row")
_OTHER = (
    "temp",
    "tmp",
    "batt",
    "volt",
    "spannung",
    "druck",
    "press",
    "humid",
    "feucht",
    "mag",
    "magn",
    "kompass",
    "compass",
    "lat",
    "lon",
    "alt",
    "satell",
    "status",
    "flag",
    "valid",
    "quality",
    "speed",
    "geschw",
    "vitesse",
    "brems",
    "brake",
    "throttle",
    "engine",
    "rpm",
)
_ACCEL = (
    "acc",
    "accel",
    "beschl",
    "accél",
    "aceler",
    "przysp",
    "ubrz",
    "versnell",
    "specificforce",
    "lowg",
    "highg",
    "gforce",
    "nd",
    "hd",
)
_RATE = (
    "gyro",
    "gyr",
    "rate",
    "omega",
    "angular",
    "drehrate",
    "winkelg",
    "gier",
    "wank",
    "nick",
    "yaw",
    "roll",
    "pitch",
    "rot",
)
_VELOCITY = ("deltav", "dv", "delta-v")
_AXES = {
    "x": (
        "x",
        "longitudinal",
        "longit",
        "long",
        "laengs",
        "längs",
        "forward",
        "fwd",
        "roll",
        "wank",
    ),
    "y": ("y", "lateral", "quer", "right", "transv", "pitch", "nick"),
    "z": ("z", "vertical", "vertikal", "vert", "hoch", "down", "yaw", "gier"),
}
# Rotation words used in compounds: Gierrate, Nickwinkel.
_TURNS = {"wank": "x", "roll": "x", "nick": "y", "pitch": "y", "gier": "z", "yaw": "z"}
_NO_AXIS = ("hz", "khz", "mhz", "max", "idx", "index", "mux", "aux", "fix")
_UNITS = {"grad/s": "deg/s", "km/h": "km/h", "kmh": "km/h", "kph": "km/h", "mph": "mph"}
_BRACKET = re.compile(r"[\[(]\s*([^\])]*?)\s*[\])]")
_WORD = re.compile(r"[^\W\d_]+|\d+")


@dataclass(frozen=True)
class Heading:
    """Meaning of a column heading.

    Attributes
    ----------
    quantity : str
        ``time``, ``counter``, ``acceleration``, ``rate``, ``velocity``, ``other``; empty where
        not stated.
    axis : str
        ``x``, ``y``, ``z`` or empty.
    unit : str
        In this package's spelling, ``km/h`` or ``mph``; empty where not stated.
    stem : str
        The heading without axis and unit: channels of one triad share it.
    reversed : bool
        The axis points the other way: left, rearward, up.
    """

    quantity: str
    axis: str
    unit: str
    stem: str
    reversed: bool = False


def read_heading(name: str) -> Heading:
    """Parse a column heading.

    Parameters
    ----------
    name : str
        As ``Beschl. HD X [g]``, ``gyro_z_deg_s``, ``a2``, ``yaw rate``.

    Notes
    -----
    A single ``g`` with an axis means acceleration to some makers and gyro to others: only the axis
    is returned.
    """
    said = read_name(name)
    unit = said.unit or _unit(name)
    plain = _BRACKET.sub(" ", name).lower()
    words = [w for w in _WORD.findall(plain) if w]
    quantity, axis = _known(said.quantity)
    stem_words = words
    if words and not axis:
        axis, stem_words = _axis(words)
    elif axis:
        _, stem_words = _axis(words)
    joined = "".join(words)
    if joined in ("gx", "gy", "gz"):
        quantity = ""
    if not quantity or quantity == "other":
        quantity = _quantity(words, joined) or quantity
    if unit in ("m/s2", "g", "mg") and quantity != "other":
        quantity = "acceleration"
    elif unit in ("rad/s", "deg/s", "mrad/s", "mdeg/s") and quantity != "other":
        quantity = "rate"
    elif unit in ("km/h", "m/s", "mph") and quantity == "velocity":
        pass
    elif unit in ("s", "ms", "us", "ns") and quantity not in ("other", "counter"):
        quantity = "time"
    return Heading(
        quantity,
        axis if quantity in ("", "acceleration", "rate", "velocity") else "",
        unit,
        " ".join(stem_words),
    )


def _known(quantity: str | None) -> tuple[str, str]:
    if quantity is None:
        return "", ""
    if quantity == "time":
        return "time", ""
    triad, _, axis = quantity.partition("_")
    kind = {"accel": "acceleration", "gyro": "rate"}.get(triad, "other")
    return kind, axis if axis in ("x", "y", "z") else ""


def _unit(name: str) -> str:
    bracket = _BRACKET.search(name)
    if not bracket:
        return ""
    text = bracket.group(1).lower().replace(" ", "")
    return unit_of(text) or _UNITS.get(text, "")


def _quantity(words: list[str], joined: str) -> str:
    if any(joined.startswith(v.replace("-", "")) for v in _VELOCITY):
        return "velocity"
    if words and words[-1] in ("ax", "ay", "az"):
        return "acceleration"
    if words and words[-1] in ("wx", "wy", "wz"):
        return "rate"
    for word in words:
        if any(word.startswith(o) for o in _OTHER):
            return "other"
    for kind, known in (("rate", _RATE), ("acceleration", _ACCEL)):
        if any(word.startswith(k) if len(k) > 2 else word == k for word in words for k in known):
            return kind
    if any(word.startswith(t) or word.endswith(t) for word in words for t in _TIME):
        return "time"
    if joined in _COUNTER or (words and words[-1] in _COUNTER):
        return "counter"
    return ""


def _axis(words: list[str]) -> tuple[str, list[str]]:
    """Axis of the last word that is one, or ends in one; and the other words."""
    for k in range(len(words) - 1, -1, -1):
        for axis, known in _AXES.items():
            if words[k] in known:
                return axis, words[:k] + words[k + 1 :]
    for k in range(len(words) - 1, -1, -1):
        word = words[k]
        turn = next((t for t in _TURNS if word.startswith(t)), "")
        if turn:
            return _TURNS[turn], [*words[:k], word[len(turn) :], *words[k + 1 :]]
        if 1 < len(word) <= 5 and word[-1] in _AXES and word not in _NO_AXIS:
            return word[-1], [*words[:k], word[:-1], *words[k + 1 :]]
    return "", words
