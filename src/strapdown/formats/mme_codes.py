"""Channel codes of ISO MME: sixteen characters, decoded field by field.

The fields are test object (1), position (1), main location (4), fine locations 1, 2 and 3 (2 each),
physical dimension (2), direction (1) and filter class (1). Codes and meanings are those of RED B
1.6.2 of ISO/TS 13499 (2020). Codes that are not in the tables are shown unchanged, never guessed.

Directions X, Y and Z follow SAE J211 and SAE J1733: X forward, Y from left to right, Z down, and
right-handed rotations, as our axes. RED B reserves directions 1, 2 and 3 for signs that differ from
SAE J211: their axis is not known.
"""

from __future__ import annotations

import string
import tomllib
from dataclasses import dataclass
from pathlib import Path

LENGTH = 16
#: Letter of a channel without a filter class.
NO_CLASS = "X"
_WORDS = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
_POSITIONS = _WORDS["POSITIONS"] | {k: f"seat {k}" for k in string.ascii_uppercase}
_FINE = _WORDS["FINE"] | {f"{k:02d}": f"no. {k}" for k in range(1, 100)}
#: Filter class of the samples.
FILTERS: dict[str, str] = _WORDS["FILTERS"]
#: Third fine location of a channel of a dummy.
DUMMIES: tuple[str, ...] = tuple(code for code in _WORDS["FINE_3"] if code != "PO")
_OBJECTS = _WORDS["OBJECTS"] | {str(k): f"vehicle {k}" for k in range(1, 10)}
#: Physical dimension: in words, and as a quantity of a crash record.
DIMENSIONS: dict[str, tuple[str, str]] = {
    code: (said, "other") if isinstance(said, str) else (said[0], said[1])
    for code, said in _WORDS["DIMENSIONS"].items()
}
#: Parts of the structure, each with the kind of crash that pushes it in (`crash_record.DEFORMS`).
_STRUCTURE = {code: kind for kind, codes in _WORDS["STRUCTURE"].items() for code in codes.split()}
_VEHICLES = "123456789"
# Mobile barrier, sled, linear impactor and pendulum move as vehicles do.
_OBJECTS_IN_MOTION = "MSHP"
_LOCATIONS = ("BODY_PARTS", "VEHICLE_PARTS", "CRITERIA", "OTHER_PLACES")


@dataclass(frozen=True)
class MmeCode:
    """A decoded channel code."""

    #: As given, in capitals.
    code: str
    #: `test_object`, `position`, `location`, `dimension`, `direction`, `filter`: in words; a code
    #: that is not in the tables is quoted.
    test_object: str
    position: str
    location: str
    #: Fine locations in words, without unused ones.
    fine: tuple[str, ...]
    dimension: str
    direction: str
    filter: str
    #: A key of `crash_record.QUANTITIES`.
    quantity: str
    #: ``x y z`` for the directions X, Y, Z; else empty.
    axis: str
    #: Test object with its own motion, by its code: ``1``, ``M``; else empty.
    vehicle: str
    #: Body of that object that the sensor is fixed to: ``vehicle`` for its structure, or another in
    #: words: ``front left occupant's head``, ``engine``.
    body: str
    #: Position and locations as coded, of a redundant sensor those of the primary one.
    point: str
    #: Key of `crash_record.DEFORMS` for a part that some crash pushes in; else empty.
    deforms: str
    redundant: bool
    #: Whether the main location is in the tables.
    listed: bool
    #: Fields not in the tables, as ``main location 'QQQQ'``.
    unknown: tuple[str, ...]

    @property
    def place(self) -> str:
        """Position, main location and fine locations."""
        return ", ".join(p for p in (self.position, self.location, *self.fine) if p)


def decode_mme(code: str) -> MmeCode | None:
    """Decode a channel code; None unless it has sixteen letters and digits."""
    text = code.strip().upper()
    if len(text) != LENGTH or not (text.isascii() and text.isalnum()):
        return None
    unknown: list[str] = []

    def words(field: str, part: str, *tables: dict[str, str]) -> str:
        for table in tables:
            if part in table:
                return table[part]
        unknown.append(f"{field} '{part}'")
        return f"'{part}'"

    main = text[2:6]
    test_object = words("test object", text[0], _OBJECTS)
    position = words("position", text[1], _POSITIONS)
    owner = {"1": "customer's", "2": "laboratory's"}.get(main[0], "")
    if owner:
        location = f"the {owner} own place '{main[1:]}'"
    else:
        location = words("main location", main, *(_WORDS[table] for table in _LOCATIONS))
    fine = tuple(
        words(f"fine location {k}", text[4 + 2 * k : 6 + 2 * k], _FINE, _WORDS[f"FINE_{k}"])
        for k in (1, 2, 3)
    )
    dimension, quantity = DIMENSIONS.get(text[12:14], ("", "other"))
    if not dimension:
        unknown.append(f"physical dimension '{text[12:14]}'")
        dimension = f"'{text[12:14]}'"
    direction = text[14]
    # The fine locations are the fields of two after position and main location.
    point = text[1:6] + "".join(
        _WORDS["PRIMARY"].get(field, field) for field in (text[6:8], text[8:10], text[10:12])
    )
    return MmeCode(
        code=text,
        test_object=test_object,
        position=position,
        location="" if main == "0000" else location,
        fine=tuple(f for f in fine if f),
        dimension=dimension,
        direction=words("direction", direction, _WORDS["DIRECTIONS"]),
        filter=words("filter class", text[15], FILTERS),
        quantity=quantity,
        axis=direction.lower() if direction in "XYZ" else "",
        vehicle=text[0] if text[0] in _VEHICLES + _OBJECTS_IN_MOTION else "",
        body=_body(text, test_object, position, location),
        point=point,
        deforms="" if (kind := _STRUCTURE.get(main, "rigid")) == "rigid" else kind,
        redundant=point != text[1:12],
        listed=any(main in _WORDS[table] for table in _LOCATIONS),
        unknown=tuple(unknown),
    )


def _body(text: str, test_object: str, position: str, location: str) -> str:
    main, numbered = text[2:6], text[0] in _VEHICLES
    if main in _WORDS["BODY_PARTS"]:
        who = f"{position} occupant" if position else "occupant"
        return f"{who}'s {location}" if numbered else f"{location} of the {test_object}"
    if numbered or text[0] in _OBJECTS_IN_MOTION:
        # A part that is not in the tables is fixed to the structure, as far as is known, unless it
        # belongs to a seat.
        unlisted = not position and not any(main in _WORDS[table] for table in _LOCATIONS)
        fixed = main in _STRUCTURE or unlisted
        return "vehicle" if fixed else " ".join(f"{position} {location}".split())
    # On the ground, or on an object whose motion is not stated.
    return (
        test_object if main == "0000" or location == test_object else f"{location}, {test_object}"
    )
