"""Latitudes and longitudes as people write them, as signed degrees.

Degrees, minutes and seconds in a text; hemispheres by a letter, behind the number or in a column of
its own; degrees and minutes in one number, as NMEA 0183 has them; and whole numbers of 1e-7 deg, as
receivers of u-blox and MAVLink send them.
"""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import DataError
from strapdown.formats.arrays import numbers
from strapdown.formats.find_columns import Found
from strapdown.formats.recording import RawLog
from strapdown.tables.checks import POSITION_SD, VELOCITY_SD, Array

#: Quantities, their largest degrees, and the letters of their hemispheres, the negative one last.
_ANGLES = {"lat": (90.0, "NS"), "lon": (180.0, "EW")}
#: Of a part of text: degrees, minutes, seconds; a comma may be the sign of decimals.
_NUMBER = r"(\d+(?:[.,]\d*)?)"
_TEXT = re.compile(
    rf"(?P<before>[NSEW])?\s*(?P<sign>[-+−])?\s*{_NUMBER}\s*(?:[°º:d]|deg)?\s*"
    rf"(?:{_NUMBER}\s*(?:['′’:m]|min)?\s*)?"
    rf"(?:{_NUMBER}\s*(?:[\"″”]|''|′′|s(?=\s*[NSEW]))?\s*)?(?P<behind>[NSEW])?",
    re.I,
)
#: Least height of which whole numbers beside 1e-7 deg are mm: as meters it is above all aircraft.
_HIGH = 2e4


def with_degrees(raw: RawLog, found: Mapping[str, Found]) -> RawLog:
    """Write the columns of latitude and longitude as signed degrees; other columns as they are.

    `found`: quantity to column. Another form than degrees is reported. DataError: a text is not an
    angle, or the unit of heights beside whole numbers of 1e-7 deg is open.
    """
    if raw.stated or not _ANGLES.keys() <= found.keys():
        return raw
    if any(found[q].factor != 1.0 for q in _ANGLES):  # radians
        return raw
    changed: dict[str, NDArray[Any]] = {}
    for quantity, (_, letters) in _ANGLES.items():
        source = found[quantity].source
        values = raw.columns[source]
        if values.dtype.kind == "O" and any(c in str(values[0]).upper() for c in letters + "°:'"):
            changed[source] = _of_texts(raw, source, quantity, letters)
        side = _sides(raw, source, letters)
        if side is not None:
            size = changed[source] if source in changed else numbers(raw, source, quantity)
            changed[source] = side * np.abs(np.asarray(size, dtype=np.float64))
    places = {q: changed.get(found[q].source, raw.columns[found[q].source]) for q in _ANGLES}
    if all(v.dtype.kind in "iuf" for v in places.values()):
        if not any(found[q].stated for q in _ANGLES):
            _refuse_radians_open(raw, places)
        form, scaled = _in_one_number(places)
        changed |= {found[q].source: v for q, v in scaled.items()}
        # A name that says it (latitudeE7) says that heights are not scaled likewise.
        if form == "1e-7 deg" and not found["lat"].source.lower().endswith("e7"):
            _refuse_open_scale(raw, scaled)
            changed |= _heights_in_mm(raw, found)
            _refuse_accuracies_open(raw, found)
        if form:
            raw.note(
                "io.coordinates-in-one-number",
                "lat, lon",
                form=form,
                lat=float(scaled["lat"][0]),
                lon=float(scaled["lon"][0]),
            )
    if not changed:
        return raw
    columns = {name: changed.get(name, values) for name, values in raw.columns.items()}
    return dataclasses.replace(raw, columns=columns)


def _of_texts(raw: RawLog, source: str, quantity: str, letters: str) -> Array:
    """Return degrees of texts, (n,): ``48°12'30.5"N``, ``48 12.508 N``, ``N48.2085``."""
    out = np.full(raw.columns[source].size, np.nan)
    for k, text in enumerate(raw.columns[source]):
        plain = "" if text is None else str(text).strip()
        if plain.lower() in ("", "nan"):
            continue
        match = _TEXT.fullmatch(plain)
        side = "".join(filter(None, (match["before"], match["behind"]))).upper() if match else "??"
        parts = [float(p.replace(",", ".")) for p in match.groups()[2:5] if p] if match else []
        # Minutes and seconds are up to 60, by rounding, and what is before them is whole.
        fits = all(p <= 60.0 for p in parts[1:]) and all(p % 1.0 == 0.0 for p in parts[:-1])
        if match is None or not fits or len(side) > 1 or side not in letters:
            raise raw.fault("io.no-coordinate", quantity, sample=k, text=plain, source=source)
        size = sum(part / 60.0**power for power, part in enumerate(parts))
        out[k] = -size if side == letters[1] or match["sign"] in ("-", "−") else size
    return out


#: Words of hemispheres, by their letter; of the letter O the language says whether it is east.
_WORDS = {
    word: letter
    for letter, words in {
        "N": "n north nord norte",
        "S": "s south sud sur sul süd zuid",
        "E": "e east est este ost leste",
        "W": "w west ouest oeste ovest",
    }.items()
    for word in words.split()
}
#: A hemisphere of negative angles at the end of a name: longitude (W), lat_S.
_IN_NAME = re.compile(r"(?:lat|lon|lng)[a-z]*[\s_(\[]+([SW])[\])]?$", re.I)
#: Names of columns of hemispheres, which need not be beside their angle.
_OF_SIDES = re.compile(r"n/?s|e/?w|hemi|dir|ref|lat|lon|lng", re.I)


def _sides(raw: RawLog, source: str, letters: str) -> Array | None:
    """Return the signs by a column of hemispheres, the nearest behind, or by the name; or None.

    A name with S or W turns angles that have no sign of their own. DataError: a column has the
    letter O beside no other, which is east or west.
    """
    named = _IN_NAME.search(source.strip()[-20:])
    if named and named[1].upper() == letters[1]:
        size = np.asarray(raw.columns[source])
        return np.array(-1.0) if size.dtype.kind in "iuf" and np.nanmin(size) >= 0.0 else None
    names = list(raw.columns)
    at = names.index(source)
    for name in names[at + 1 :] + names[:at]:
        values, beside = raw.columns[name], abs(names.index(name) - at) == 1
        first = str(values[0]).strip().lower() if values.dtype.kind == "O" else "no text"
        if first not in {*_WORDS, "o", "", "none"} or not (beside or _OF_SIDES.search(name)):
            continue
        said = ["" if v is None else str(v).strip().lower() for v in values]
        there = set(said) - {""}
        if there == {"o"} and letters == "EW":
            raise raw.fault("io.hemisphere-open", "lon", source=name)
        known = {w: _WORDS.get(w, "W" if w == "o" and "e" in there else "") for w in there}
        if there and set(known.values()) <= set(letters):
            return np.array([-1.0 if known.get(w) == letters[1] else 1.0 for w in said])
    return None


def _in_one_number(places: Mapping[str, NDArray[Any]]) -> tuple[str, dict[str, Array]]:
    """Return the form of numbers that no degrees are, and their degrees; empty if they may be."""
    values = {q: np.asarray(v, dtype=np.float64) for q, v in places.items()}
    known = {q: np.abs(v[np.isfinite(v)]) for q, v in values.items()}
    if any(not v.size for v in known.values()):
        return "", {}
    if all(known[q].max() <= most for q, (most, _) in _ANGLES.items()):
        return "", {}
    if (
        known["lat"].max() <= 90.0
        and known["lon"].max() <= 360.0
        and not (values["lon"] < 0.0).any()
    ):
        turned = values["lon"] - np.where(values["lon"] > 180.0, 360.0, 0.0)
        return "degrees, longitudes from 0 to 360", {"lat": values["lat"], "lon": turned}
    if all(
        (v % 1.0 == 0.0).all() and v.max() <= 1e7 * _ANGLES[q][0] for q, v in known.items()
    ) and (max(known["lat"].max(), known["lon"].max()) > 1e5):
        return "1e-7 deg", {q: v * 1e-7 for q, v in values.items()}
    if all((v % 100.0 < 60.0).all() and v.max() <= 100.0 * _ANGLES[q][0] for q, v in known.items()):
        whole = {q: np.trunc(v / 100.0) for q, v in values.items()}
        return "ddmm.mmmm", {q: whole[q] + (v - 100.0 * whole[q]) / 60.0 for q, v in values.items()}
    return "", {}


#: Largest latitude and longitude in radians; as degrees they are in the sea off Guinea. Nearer to
#: zero than this, which is 1 km in degrees, either may be an origin.
_RADIANS, _ORIGIN = {"lat": 0.5 * np.pi, "lon": np.pi}, 0.01


def _refuse_radians_open(raw: RawLog, places: Mapping[str, NDArray[Any]]) -> None:
    """Ask for the unit of coordinates that are as well in radians, somewhere on the Earth."""
    size = {q: np.abs(np.asarray(v, dtype=np.float64)) for q, v in places.items()}
    if all(v.size and np.isfinite(v).any() for v in size.values()):
        largest = {q: float(np.nanmax(v)) for q, v in size.items()}
        whole = all((v[np.isfinite(v)] % 1.0 == 0.0).all() for v in size.values())
        inside = all(v <= _RADIANS[q] for q, v in largest.items())
        if inside and not whole and max(largest.values()) > _ORIGIN:
            first = {q: float(v[np.isfinite(v)][0]) for q, v in places.items()}
            raise raw.fault("io.degrees-or-radians", "lat, lon", lat=first["lat"], lon=first["lon"])


def _refuse_open_scale(raw: RawLog, degrees: Mapping[str, Array]) -> None:
    """Refuse whole numbers that are within the Earth's range in 1e-6 deg as well as in 1e-7."""
    if all(float(np.nanmax(np.abs(degrees[q]))) <= 0.1 * _ANGLES[q][0] for q in _ANGLES):
        raise raw.fault(
            "io.coordinate-scale-open",
            "lat, lon",
            lat=float(degrees["lat"][0]),
            lon=float(degrees["lon"][0]),
            lat_10=10.0 * float(degrees["lat"][0]),
            lon_10=10.0 * float(degrees["lon"][0]),
        )


def _heights_in_mm(raw: RawLog, found: Mapping[str, Found]) -> dict[str, Array]:
    """Return heights in m that are whole numbers of mm; ask where meters are as likely."""
    out = {}
    for quantity in ("alt", "alt_msl"):
        one = found.get(quantity)
        if one is None or one.stated:
            continue
        heights = np.asarray(numbers(raw, one.source, quantity), dtype=np.float64)
        known = heights[np.isfinite(heights)]
        if not known.size or (known % 1.0 != 0.0).any():
            continue
        if np.median(np.abs(known)) < _HIGH:
            raise height_unit_open(raw, "io.height-unit-open", quantity, one, float(known[0]))
        out[one.source] = heights * 1e-3
    return out


#: Quantities that are whole numbers of mm, or mm/s, where coordinates are of 1e-7 deg.
_ACCURACIES = ("horizontal_accuracy", "vertical_accuracy", *POSITION_SD)
_ACCURACIES_OF_SPEED = ("speed_sd", *VELOCITY_SD)


def _refuse_accuracies_open(raw: RawLog, found: Mapping[str, Found]) -> None:
    """Ask for the unit of accuracies that are whole numbers, as the coordinates are."""
    asked: dict[str, tuple[Found, float]] = {}
    for quantity in (*_ACCURACIES, *_ACCURACIES_OF_SPEED):
        one = found.get(quantity)
        if one is None or one.stated:
            continue
        values = np.asarray(numbers(raw, one.source, quantity), dtype=np.float64)
        known = values[np.isfinite(values)]
        if known.size and (known % 1.0 == 0.0).all() and (known > 1.0).any():
            asked[quantity] = one, float(known[0])
    if asked:
        units = {q: "mm" if q in _ACCURACIES else "mm/s" for q in asked}
        column, first = next(iter(asked.values()))
        raise raw.fault(
            "io.accuracy-unit-open",
            ", ".join(asked),
            source=column.source,
            first=first,
            python="{" + ", ".join(f'"{q}": "{u}"' for q, u in units.items()) + "}",
            flags="--gnss-units " + ",".join(f"{q}={u}" for q, u in units.items()),
            keys="units = {" + ", ".join(f'{q} = "{u}"' for q, u in units.items()) + "}",
        )


def height_unit_open(
    raw: RawLog, code: str, quantity: str, column: Found, height: float
) -> DataError:
    """Return the question for the unit of a column of heights, of which `height` is the first."""
    return raw.fault(
        code,
        quantity,
        of_what=quantity,
        source=column.source,
        height=height,
        flags=f"--gnss-units {quantity}=mm",
        keys=f'units = {{{quantity} = "mm"}}',
    )
