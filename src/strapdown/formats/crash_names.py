"""What the name of a column says in a crash record: quantity, axis and unit.

Recorders in vehicles name their columns in words (``Longitudinal Delta-V (MPH)``), loggers in
letters (``ax [g]``). Longitudinal is positive forward, lateral from left to right, vertical down,
as SAE J1698 and SAE J211 have it.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from strapdown.formats.columns import INDEXED, TRIADS, read_name
from strapdown.formats.crash_units import unit_of

__all__ = ["ChannelName", "read_channel_name"]

_BRACKETS = re.compile(r"[\[(]\s*([^\[\]]+?)\s*[\])]\s*$")
_AXIS = {
    "x": "x",
    "longitudinal": "x",
    "long": "x",
    "longi": "x",
    "forward": "x",
    "fwd": "x",
    "y": "y",
    "lateral": "y",
    "lat": "y",
    "right": "y",
    "transverse": "y",
    "z": "z",
    "vertical": "z",
    "vert": "z",
    "down": "z",
    "normal": "z",
}
# Axes that point the other way than ours.
_REVERSED = {"backward": "-x", "rearward": "-x", "left": "-y", "up": "-z"}
_TURNS = {"roll": "x", "pitch": "y", "yaw": "z"}
_WORDS = {
    "acceleration": ("acceleration", "accel", "acc", "accelerations", "accelerometer"),
    "rate": ("rate", "gyro", "gyr", "gyroscope", "angular"),
    "velocity": ("velocity", "vel", "deltav", "dv", "deltavelocity"),
    "displacement": ("displacement", "crush"),
    "force": ("force", "load"),
}
# A gyro to the makers of phones, an acceleration in g to those of crash recorders.
_EITHER = ("gx", "gy", "gz")
_OF_TRIAD = {"accel": "acceleration", "gyro": "rate"}
_TRIAD_NAMES = {name: triad for triad, names in TRIADS.items() for name in names if len(name) > 1}


@dataclass(frozen=True)
class ChannelName:
    """What a name says.

    Attributes
    ----------
    quantity : str
        A key of `crash_record.QUANTITIES`.
    axis : str
        ``x y z``, with a minus where the name says so, or empty.
    unit : str
        In this package's spelling, or as it stands there where it is not known; or empty.
    change : bool
        Of a velocity: the name says that it is a change since time zero.
    contradiction : str
        What in the name speaks against its unit, or empty.
    """

    quantity: str
    axis: str = ""
    unit: str = ""
    change: bool = False
    contradiction: str = ""


def read_channel_name(name: str, unit: str = "") -> ChannelName:
    """Read quantity, axis and unit from a column's name.

    Parameters
    ----------
    name : str
        As ``ax [g]``, ``Gyr_X (deg/s)``, ``Lateral Delta-V (km/h)``, ``Yaw rate``.
    unit : str
        What a row of units under the header says of it.

    Returns
    -------
    ChannelName
        The unit decides what the quantity is; the words, where there is no unit.
    """
    said = read_name(name)
    text = name.strip()
    bracket = _BRACKETS.search(text)
    if bracket:
        unit, text = unit or bracket.group(1), text[: bracket.start()]
    known = unit_of(unit) if unit else None
    if not unit and said.unit:
        known = unit_of(said.unit)
    words = _words(text)
    change = _says_change(words)
    spoken = _quantity(words, said.quantity, change)
    if spoken == "time" and (known is None or known[0] == "time") and (known or not unit):
        return ChannelName("time", "", known[1] if known else "")
    written = known[1] if known else unit
    if "speed" in words or "speeds" in words:
        return ChannelName("other", "", written)
    quantity = known[0] if known else spoken if spoken != "time" and not unit else "other"
    if quantity == "time":
        stamps = "time" in words and not change
        return ChannelName("time" if stamps or spoken == "time" else "other", "", written)
    against = ""
    if known and spoken not in ("other", quantity):
        against = f"its name says {spoken}, and its unit is one of {quantity}"
    axis = _axis(words, quantity, said.quantity)
    return ChannelName(quantity, axis, written, change and quantity == "velocity", against)


def _words(text: str) -> list[str]:
    text = INDEXED.sub(r"\1", text)
    # accX, GyroY: a capital after a small letter begins a word.
    text = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", text)
    return [w for w in re.split(r"[^a-z0-9]+", text.lower()) if w]


def _says_change(words: list[str]) -> bool:
    joined = " ".join(words)
    return bool(
        re.search(
            r"\b(delta ?v|dv|delta velocity|delta vel|velocity change|geschwindigkeits)", joined
        )
    )


def _quantity(words: list[str], triad: str | None, change: bool) -> str:
    if triad == "time":
        return "time"
    if change:
        return "velocity"
    if "".join(words) in _EITHER:
        return "other"
    base = str(triad).partition("_")[0]
    if base in _OF_TRIAD:
        return _OF_TRIAD[base]
    for quantity, known in _WORDS.items():
        if any(w in known for w in words):
            return quantity
    return "other"


def _axis(words: list[str], quantity: str, triad: str | None) -> str:
    if quantity == "rate":
        for word, axis in _TURNS.items():
            if word in words:
                return axis
    if triad and triad[-2:] in ("_x", "_y", "_z"):
        return triad[-1]
    if quantity == "other":
        return next((w for w in words if w in ("x", "y", "z")), "")
    found = {(_AXIS | _REVERSED)[w] for w in words if w in _AXIS or w in _REVERSED}
    if not found:
        # accx, gyroz: a known word with its axis at the end.
        found = {w[-1] for w in words if w[-1] in "xyz" and w[:-1] in _TRIAD_NAMES}
    return found.pop() if len(found) == 1 else ""
