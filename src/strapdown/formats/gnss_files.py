"""GNSS fixes from files, and from tables with column names."""

from __future__ import annotations

import dataclasses
import re
import shlex
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.errors import ConfigError, DataError, Finding, StrapdownError, check_choice
from strapdown.formats import comma2k19, open_stream
from strapdown.formats.arrays import STEP_OF_FIXES, epoch_of, numbers, open_dates
from strapdown.formats.clocks import GPS, RELATIVE, UNIX, WEEK, Clock
from strapdown.formats.columns import read_name
from strapdown.formats.find_columns import (
    Found,
    fix_columns,
    is_clock,
    names_of_quantities,
    plain_name,
)
from strapdown.formats.gnss_fixes import (
    NOWHERE,
    RADIUS,
    UNSTATED_VERTICAL,
    Fixes,
    at_zero,
    table_of_fixes,
    utm_zone,
)
from strapdown.formats.gnss_fixes import GnssOptions as GnssOptions
from strapdown.formats.gnss_pos import QUALITY
from strapdown.formats.recording import RawLog
from strapdown.formats.trajectory_readers import EARTH
from strapdown.formats.vocabularies import FIXES
from strapdown.frames import geodetic_from_ecef, geodetic_from_ned, geodetic_from_utm
from strapdown.tables.checks import POSITION_SD, VELOCITY, VELOCITY_SD, Array, height_words
from strapdown.tables.gnss import LEAST_STEPS, SPEEDS_OF_OTHERS, along_course, clock_factor, fitting
from strapdown.units import DATE_ORDERS, OF_TABLES, SPEEDS, TIME_UNITS, unit_of

# --- latitudes and longitudes as people write them, as signed degrees --------------------
# Degrees, minutes and seconds in a text; hemispheres by a letter, behind the number or in a column
# of its own; degrees and minutes in one number, as NMEA 0183 has them; and whole numbers of 1e-7
# deg, as receivers of u-blox and MAVLink send them.

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


# GNSS fixes from tables with column names: text, Parquet.


def fixes_of_columns(raw: RawLog, options: GnssOptions) -> Fixes:
    """Convert named columns to fixes.

    Names may carry a unit, as ``lat_deg``, ``vN [km/h]``, ``sdU_m``; the default units are those of
    a Gnss table; `options.units` precede them. A column ``Q`` has the codes of RTKLIB,
    ``quality`` those of NMEA. A position is geodetic, Earth-centered Earth-fixed (ECEF), or local:
    north, east, up of an origin that the user states. Velocities without any position are at that
    origin, which no fix measures. DataError: time or the position is missing, two columns fit one
    quantity, or a unit is unknown.
    """
    found = _of_ublox(raw, fix_columns(raw, options.columns))
    found = _in_units(raw, found, options.units)
    raw = _rows_of_fixes(with_degrees(raw, found), found)
    alone = _velocities_alone(found)
    _refuse_missing(raw, found, alone=alone, stated=options.datum_height is not None)

    used = {found["time"].source}

    def values(quantity: str) -> Array:
        used.add(found[quantity].source)
        return found[quantity].values(raw, quantity)

    def block(names: Sequence[str]) -> Array | None:
        there = [name for name in names if name in found]
        if there == list(names[:2]):  # down is unknown
            level = [values(name) for name in there]
            return np.column_stack([*level, np.full(level[0].size, np.nan)])
        if there and len(there) < len(names):
            missing = next(name for name in names if name not in found)
            raise raw.fault(
                "io.missing-while-column", missing, there=there[0], source=found[there[0]].source
            )
        return np.column_stack([values(name) for name in names]) if there else None

    options, zone = _with_zone(raw, found, options)
    used.add(zone)
    place, datum = _at_origin(raw, options) if alone else _place(raw, found, values, options)
    time, clock = _time(raw, found["time"], options.units.get("time"))
    if time.size > 2 and (np.diff(time) < 0.0).all():
        return fixes_of_columns(raw.backward(), options)
    if "week" in found and clock.name == RELATIVE:
        clock = Clock(GPS)
    sound = np.where(at_zero(place)[:, None], np.nan, place)
    if "week" in found and clock.name == GPS:
        week = values("week")
        time = time + WEEK * (week - week[0])
        clock = Clock(GPS, 0.0, int(week[0]))
    level = found.keys() & {*VELOCITY[:2]}  # a climb alone is beside a speed and a course
    velocity, velocity_sd = block(VELOCITY) if level else None, block(VELOCITY_SD)
    position_sd = block(POSITION_SD)
    if velocity is not None and velocity_sd is None and "speed_sd" in found:
        velocity_sd = _sd_of_speed(raw, found, values)
    if velocity is None and {"speed", "course"} <= found.keys():
        velocity, velocity_sd = _over_ground(raw, found, values, (time, sound))
    if velocity is not None:
        if clock.name == RELATIVE:
            _refuse_unit_of_clock(raw, found["time"], time, sound, velocity)
        _refuse_unit_of_speed(raw, found, time, sound, velocity)
    position_sd = _accuracy(raw, found, values) if position_sd is None else position_sd
    quality, satellites = _quality(raw, found, values), _satellites(raw)
    _say_unused(raw, found, used | {satellites})
    return Fixes(
        name=raw.name,
        time=time,
        place=place,
        rows=np.arange(1, time.size + 1) if raw.rows is None else raw.rows,
        placed=not alone,
        clock=clock,
        other_clock=_other_clock(raw, time, clock, options),
        velocity=velocity,
        position_sd=position_sd,
        velocity_sd=velocity_sd,
        quality=quality,
        satellites=np.asarray(raw.columns[satellites], dtype=float) if satellites else None,
        heights_from=_level(raw, found, datum, options),
        height_source=found[datum].source if datum in found else "",
        findings=raw.findings,
    )


#: Units of whole numbers in UBX-NAV-PVT of u-blox (Interface Description, NAV-PVT), by name.
_NAV_PVT = {
    **dict.fromkeys(("height", "hmsl", "hacc", "vacc"), "mm"),
    **dict.fromkeys(("veln", "vele", "veld", "gspeed", "sacc"), "mm/s"),
    "headmot": "1e-5 deg",
}
#: Fields that no other table has under these names; and the fewest of all that say it.
_OF_NAV_PVT, _LEAST_FIELDS = {"itow", "gspeed", "headmot", "headacc", "fixtype", "hmsl"}, 3


def _of_ublox(raw: RawLog, found: dict[str, Found]) -> dict[str, Found]:
    """Give the columns of a table of UBX-NAV-PVT, in whole numbers, their units, and report it.

    Programs scale some and leave others: a course that is none of whole numbers is in deg,
    and all others are whole, or none is taken so.
    """
    names = {plain_name(name) for name in raw.columns}
    if raw.stated or not names & _OF_NAV_PVT or len(names & _NAV_PVT.keys()) < _LEAST_FIELDS:
        return found
    out, units, whole = dict(found), {}, []
    for quantity, one in found.items():
        unit = "ms" if quantity == "time" else _NAV_PVT.get(plain_name(one.source))
        if unit is None or one.stated or raw.columns[one.source].dtype.kind not in "iuf":
            continue
        if unit == "mm/s" and "cacc" in names:  # of UBX-NAV-VELNED, which has no other unit
            unit = "cm/s"
        values = np.asarray(numbers(raw, one.source, quantity), dtype=np.float64)
        known = values[np.isfinite(values)]
        are_whole = bool((known % 1.0 == 0.0).all())
        if quantity == "time":  # seconds of a week do not go so far
            if are_whole and known.size and WEEK < known.max() < 1e3 * WEEK:
                out[quantity] = Found(one.source, one.factor * 1e-3, True)
                units[one.source] = unit
            continue
        if quantity != "course":
            whole.append(are_whole)
        if are_whole:
            factor = FIXES.quantities[quantity].units[unit]
            out[quantity] = Found(one.source, one.factor * factor, True)
            units[one.source] = unit
    if not units or not all(whole):
        return found
    raw.note("io.units-of-ublox", units=[f"{name} {unit}" for name, unit in units.items()])
    return out


def _in_units(raw: RawLog, found: dict[str, Found], units: Mapping[str, str]) -> dict[str, Found]:
    """Replace the units of columns by those that the user states."""
    stated = {}
    for quantity, unit in units.items():
        if quantity not in found:
            raise ConfigError(
                "io.unit-of-missing-column", file=raw.name, quantity="units", of_what=quantity
            )
        if quantity == "time" and unit in DATE_ORDERS:
            continue
        known = FIXES.quantities[quantity].units
        bare = unit.strip()
        # A minus is of a column that counts the other way: VD=-m/s of a velocity up.
        sign = -1.0 if bare.startswith("-") and known else 1.0
        bare = bare[1:] if sign < 0.0 else bare
        spelled = unit_of(bare, OF_TABLES) or bare
        check_choice("io.unknown-unit", known, quantity=f"units {quantity}", unit=spelled)
        sign *= -1.0 if found[quantity].factor < 0.0 else 1.0
        stated[quantity] = Found(found[quantity].source, sign * known[spelled], True)
    return found | stated


#: Columns of a position, each set with its order; heights of a geodetic position, the first counts.
_GEODETIC, _ECEF, _LOCAL = ("lat", "lon"), ("ecef_x", "ecef_y", "ecef_z"), ("north", "east")
_HEIGHTS = ("alt", "alt_msl", "alt_take_off", "alt_unstated")
_LEVELS = {"alt_msl": "sea", "alt_take_off": "take-off", "alt_unstated": "unstated", "": NOWHERE}
#: Names of heights that say that they count from the ellipsoid.
_OVER_ELLIPSOID = re.compile(r"ell|wgs|hae", re.I)


def _level(raw: RawLog, found: dict[str, Found], kind: str, options: GnssOptions) -> str:
    """Return the level from which heights count, of `Fixes`; ``open`` for those of a bare name.

    `kind`: quantity of the heights. Computed heights, those that the user names ``alt``, and those
    of a Gnss table (`docs/case.md`), known by the names of its standard deviations, count from the
    ellipsoid.
    """
    if kind != "alt":
        return _LEVELS[kind]
    if raw.heights is not None:
        return "" if raw.heights == height_words(as_stated=False) else "as stated"
    if raw.stated or "alt" in options.columns or "alt" not in found or "alt_msl" in found:
        return ""
    own = all(q in found and found[q].source in (q, f"{q}_m") for q in POSITION_SD)
    return "" if own or _OVER_ELLIPSOID.search(found["alt"].source) else "open"


def _velocities_alone(found: Mapping[str, Found]) -> bool:
    """Whether columns have the velocity over ground, and none has a part of a position."""
    moving = {"VN", "VE"} <= found.keys() or {"speed", "course"} <= found.keys()
    return moving and not found.keys() & {*_GEODETIC, *_ECEF, *_LOCAL}


def _at_origin(raw: RawLog, options: GnssOptions) -> tuple[Array, str]:
    """Return the stated origin as the place of every row of velocities alone, as of `_place`."""
    origin = options.origin
    if origin is None or isinstance(origin, str):  # a zone of UTM is no place
        raise raw.fault("io.fixes-velocities-alone", "lat, lon", columns=list(raw.columns))
    lat, lon, height = origin
    raw.warn("io.fixes-placed-by-origin", "lat, lon", lat=lat, lon=lon, height=height)
    return np.tile(origin, (next(iter(raw.columns.values())).size, 1)), "alt"


def _refuse_missing(raw: RawLog, found: dict[str, Found], *, alone: bool, stated: bool) -> None:
    """Refuse a table without time or position; ask what nameless coordinates are.

    `alone`: as of `_velocities_alone`. `stated`: whether the user states a height, which a table
    without any then has.
    """
    missing = [q for q in ("time",) if q not in found]
    if not alone and not any(set(one) <= found.keys() for one in (_GEODETIC, _ECEF, _LOCAL)):
        # Columns that are called x, y, z may be coordinates.
        bare = {m[1].lower(): n for n in raw.columns if (m := _AXIS.fullmatch(n.strip()))}
        if not missing and len(bare) == 3:
            x, y, z = axes = [bare[axis] for axis in "xyz"]
            xyz = np.column_stack([numbers(raw, c, c) for c in axes])
            far = np.nanmedian(np.linalg.norm(np.asarray(xyz, dtype=np.float64), axis=1))
            if _NEAR_EARTH[0] < far < _NEAR_EARTH[1]:
                columns = f"ecef_x={x},ecef_y={y},ecef_z={z}"
                raise raw.fault(
                    "io.positions-likely-ecef",
                    ", ".join(axes),
                    distance=far,
                    flags=f"--gnss-columns {shlex.quote(columns)}",
                    keys=f'columns = {{ecef_x = "{x}", ecef_y = "{y}", ecef_z = "{z}"}}',
                )
            raise raw.fault("io.positions-without-origin", ", ".join(axes), x=x, y=y, z=z)
        missing += [q for q in _GEODETIC if q not in found]
    if set(_GEODETIC) <= found.keys() and not set(_HEIGHTS) & found.keys() and not stated:
        missing.append("alt")
    if missing:
        raise raw.fault(
            "io.fixes-without-height" if missing == ["alt"] else "io.missing-columns-2",
            missing=missing,
            columns=list(raw.columns),
            missing_2=missing[0],
        )


#: Distances from the center of the Earth that a position on it, or near it, may have, m.
_NEAR_EARTH = (6.3e6, 6.5e6)
_AXIS = re.compile(r"(?:p|pos|position)?[\s_.]*([xyz])\b[\s_.]*(?:[\[(]?m[\])]?)?", re.I)


def _place(
    raw: RawLog, found: dict[str, Found], values: Callable[[str], Array], options: GnssOptions
) -> tuple[Array, str]:
    """Return geodetic positions, and the quantity of their heights."""
    local = not set(_GEODETIC) <= found.keys() and not set(_ECEF) <= found.keys()
    if options.origin is not None and not local:
        raise ConfigError("io.origin-beside-positions", file=raw.name, quantity="origin")
    if set(_GEODETIC) <= found.keys():
        kind = next((q for q in _HEIGHTS if q in found), "")
        if not kind:
            level = np.column_stack([values("lat"), values("lon")])
            return np.column_stack([level, np.zeros(len(level))]), kind
        if "alt_msl" in found and "geoid" in found:
            kind = "alt"
        return np.column_stack([values("lat"), values("lon"), _height(found, values, raw)]), kind
    if not local:
        return geodetic_from_ecef(np.column_stack([values(q) for q in _ECEF])), "alt"
    if options.origin is None:
        _refuse_zone_open(raw, found, values)
        raise raw.fault(
            "io.local-positions-origin-open", ", ".join(found[q].source for q in _LOCAL)
        )
    if isinstance(options.origin, str):
        zone, south = utm_zone(options.origin)
        level = geodetic_from_utm(values("east"), values("north"), zone, south=south)
        kind = next((q for q in _HEIGHTS if q in found), "")
        if not kind and "up" not in found:
            raise _without_up(raw)
        heights = _height(found, values, raw) if kind else values("up")
        return np.column_stack([level, heights]), kind or "alt"
    if "up" not in found:
        raise _without_up(raw)
    ned = np.column_stack([values("north"), values("east"), -values("up")])
    return geodetic_from_ned(ned, options.origin), "alt"


#: Names of a column with the zone of UTM, with the letter of its band: C to M south, N to X north.
_ZONES, _ZONE = (
    ("zone", "utmzone", "zoneutm", "gridzone"),
    re.compile(r"(\d{1,2}) ?([C-HJ-NP-X])", re.I),
)


def _with_zone(
    raw: RawLog, found: dict[str, Found], options: GnssOptions
) -> tuple[GnssOptions, str]:
    """Take the zone of UTM of a column, which is the same in all rows; and its name, or none.

    33S may be the band between 32 and 40 deg north, or the south, and is left open.
    """
    if options.origin is not None or not set(_LOCAL) <= found.keys():
        return options, ""
    if set(_GEODETIC) <= found.keys() or set(_ECEF) <= found.keys():
        return options, ""
    for name in raw.columns:
        texts = (
            {str(text).strip() for text in raw.columns[name]} if plain_name(name) in _ZONES else {}
        )
        match = _ZONE.fullmatch(next(iter(texts))) if len(texts) == 1 else None
        if match and match[2].upper() != "S" and 1 <= int(match[1]) <= 60:
            zone = f"{match[1]}{'N' if match[2].upper() >= 'N' else 'S'}"
            raw.note(
                "io.utm-zone-by-column",
                ", ".join(found[q].source for q in _LOCAL),
                source=name,
                zone=zone,
            )
            return dataclasses.replace(options, origin=zone), name
    return options, ""


def _without_up(raw: RawLog) -> DataError:
    return raw.fault(
        "io.missing-columns-2", missing=["up"], columns=list(raw.columns), missing_2="up"
    )


#: Eastings and northings of UTM, m, but for northings just off the equator.
_EASTINGS, _NORTHINGS = (1e5, 9e5), (1e5, 1e7)


def _refuse_zone_open(raw: RawLog, found: dict[str, Found], values: Callable[[str], Array]) -> None:
    """Refuse coordinates as of UTM, whose zone the user has to state."""
    east, north = (float(np.nanmedian(values(q))) for q in ("east", "north"))
    if not (_EASTINGS[0] < east < _EASTINGS[1] and _NORTHINGS[0] < north < _NORTHINGS[1]):
        return
    of = ", ".join(found[q].source for q in _LOCAL)
    raise raw.fault("io.utm-zone-open", of, east=east, north=north)


#: Height above which no aircraft flies, m.
_HIGHEST = 1e5


def _height(found: dict[str, Found], values: Callable[[str], Array], raw: RawLog) -> Array:
    for quantity in _HEIGHTS:
        one = found.get(quantity)
        read = one is not None and not one.stated
        heights = one.values(raw, quantity) if one is not None and read else np.empty(0)
        known = heights[np.isfinite(heights)]
        if one is not None and known.size and float(np.median(np.abs(known))) > _HIGHEST:
            raise height_unit_open(raw, "io.height-too-large", quantity, one, float(known[0]))
    if "alt_msl" not in found or "geoid" not in found:
        return values(next(q for q in _HEIGHTS if q in found))
    raw.note(
        "io.height-over-ellipsoid-over-sea",
        quantity="alt",
        source=found["alt_msl"].source,
        source_2=found["geoid"].source,
    )
    return np.asarray(values("alt_msl") + values("geoid"))


def _rows_of_fixes(raw: RawLog, found: dict[str, Found]) -> RawLog:
    """Leave out rows of a table of inertial samples that have no fix, or the last one again."""
    of_samples = {"gyro_x", "accel_x"} & names_of_quantities(raw)
    if not {"lat", "lon"} <= found.keys() or not of_samples:
        return raw
    place = [
        np.asarray(numbers(raw, found[q].source, q), dtype=np.float64)
        for q in ("lat", "lon", *_HEIGHTS, "speed", "course", *VELOCITY)
        if q in found
    ]
    known = np.isfinite(place[0]) & np.isfinite(place[1])
    rows = np.flatnonzero(known)
    new = np.zeros(rows.size, dtype=bool)
    for values in place:
        step = np.diff(values[rows])
        new[1:] |= (step != 0.0) & np.isfinite(step)
    new[:1] = True
    keep = rows[new]
    if not keep.size or keep.size == known.size:
        return raw
    finding = Finding(
        "io.rows-of-samples-without-new-fix",
        severity="note",
        file=raw.name,
        used=keep.size,
        count=known.size,
    )
    return dataclasses.replace(
        raw,
        columns={name: column[keep] for name, column in raw.columns.items()},
        rows=keep + 2 if raw.rows is None else raw.rows[keep],
        findings=[*raw.findings, finding],
    )


def _over_ground(
    raw: RawLog,
    found: dict[str, Found],
    values: Callable[[str], Array],
    positions: tuple[Array, Array],
) -> tuple[Array | None, Array | None]:
    """Return velocity by speed and course, and its standard deviation; down as far as there is one.

    Phones write -1 for a speed or a course that they do not know; None where they never do. Other
    courses below zero are those of angles from -180 deg. `positions`: seconds, (n,), and deg, deg,
    m, (n, 3): they show the unit and the sense of a course of which the file states none.
    """
    speed, course = values("speed"), values("course")
    ahead = np.sign(found["speed"].factor)  # a minus is of a user, where courses point backward
    known = (ahead * speed >= 0.0) & np.isfinite(course)
    known &= (course >= 0.0) | (found["course"].factor < 0.0) | _is_signed(course)
    never = not known.any()
    speed = np.where(known, speed, np.nan)
    none = np.full(speed.size, np.nan)
    raw.note(
        "io.speed-and-course-never-known"
        if never
        else "io.velocity-by-speed-course-and-climb"
        if "VD" in found
        else "io.velocity-by-speed-and-course",
        quantity=", ".join(VELOCITY),
        source=found["speed"].source,
        source_2=found["course"].source,
    )
    if never:
        return None, None
    if not (raw.stated or found["course"].stated):
        _refuse_unit_of_course(raw, found, speed, course, positions)
    sd = None
    if "speed_sd" in found:
        stated = values("speed_sd")
        sd = np.where(known & (stated > 0.0), stated, np.nan)
        sd = np.column_stack([sd, sd, none])
    down = values("VD") if "VD" in found else none
    return np.column_stack([along_course(speed, np.radians(course)), down]), sd


def _is_signed(course: Array) -> bool:
    """Whether courses below zero are angles, and not all the -1 of a phone."""
    below = course[course < 0.0]
    return bool(below.size and (below != -1.0).any())


#: Ways in which a course is written, by the statement that says it: factor to deg, and offset.
_COURSES = {
    "deg": (1.0, 0.0),
    "rad": (np.degrees(1.0), 0.0),
    "cdeg": (1e-2, 0.0),
    "1e-5 deg": (1e-5, 0.0),
    "-deg": (-1.0, 0.0),
    "-rad": (-np.degrees(1.0), 0.0),
    "": (1.0, 180.0),
    "from east": (-1.0, 90.0),
    "from east in rad": (-np.degrees(1.0), 90.0),
}
#: Standard deviation of positions that state none, m; more than a turn, deg.
_UNSTATED_SD, _TURN = 5.0, 360.5


def _refuse_unit_of_course(
    raw: RawLog,
    found: dict[str, Found],
    speed: Array,
    course: Array,
    positions: tuple[Array, Array],
) -> None:
    """Refuse courses without a unit that the positions show to be in none, or of another sense."""
    time, place = positions
    known = np.isfinite(place).all(axis=1) & np.isfinite(speed * course) & np.isfinite(time)
    later = np.flatnonzero(known)
    later = later[np.diff(np.maximum.accumulate(time[later]), prepend=-np.inf) > 0.0]
    largest = float(np.abs(course[known]).max(initial=0.0))
    units = ("m/s",) if found["speed"].stated else ("m/s", *SPEEDS_OF_OTHERS)
    at = place[later]
    readings = {
        f"{way},{unit}": (
            along_course(SPEEDS[unit] * speed[later], np.radians(factor * course[later] + zero)),
            at,
        )
        for way, (factor, zero) in _COURSES.items()
        for unit in units
    }
    sd = np.full(later.size, _UNSTATED_SD)
    fit = fitting(time[later], sd, readings) if later.size > LEAST_STEPS else None
    way, _, unit = (fit.name if fit else "").partition(",")
    if way == "deg" or (not unit and largest <= _TURN):
        return
    beyond = not unit
    if beyond:
        way, unit = "cdeg" if largest <= 100.0 * _TURN else "1e-5 deg", "m/s"
    stated = {} if unit == "m/s" else {"speed": unit}
    if way == "":
        stated["speed"] = f"-{unit}"
    elif "east" not in way:
        stated["course"] = way
    said: dict[str, Any] = {
        "python": "{" + ", ".join(f'"{q}": "{u}"' for q, u in stated.items()) + "}",
        "flags": "--gnss-units " + shlex.quote(",".join(f"{q}={u}" for q, u in stated.items())),
        "keys": "units = {" + ", ".join(f'{q} = "{u}"' for q, u in stated.items()) + "}",
    }
    code = "io.course-unit-not-stated"
    if beyond:
        code = "io.course-beyond-turn"
    elif "east" in way:
        code = "io.course-from-east"
    elif way == "":
        code = "io.course-points-back"
    raise raw.fault(
        code, "course", source=found["course"].source, largest=largest, unit=way, **said
    )


def _sd_of_speed(raw: RawLog, found: dict[str, Found], values: Callable[[str], Array]) -> Array:
    """Return the accuracy of the speed as the standard deviation of each part of the velocity."""
    stated = values("speed_sd")
    raw.note(
        "io.velocity-sd-by-speed", quantity=", ".join(VELOCITY_SD), source=found["speed_sd"].source
    )
    return np.column_stack([np.where(stated > 0.0, stated, np.nan)] * 3)


def _refuse_unit_of_clock(
    raw: RawLog, found: Found, time: Array, place: Array, velocity: Array
) -> None:
    """Refuse stamps with which the positions move as the velocity only in another unit.

    `time` ((n,), s). `place` ((n, 3)): deg, deg, m. `velocity` ((n, 3)): m/s.
    """
    known = np.isfinite(place).all(axis=1) & np.isfinite(velocity[:, :2]).all(axis=1)
    later = np.flatnonzero(known & np.isfinite(time))
    later = later[np.diff(np.maximum.accumulate(time[later]), prepend=-np.inf) > 0.0]
    if later.size <= LEAST_STEPS:
        return
    sd = np.full(later.size, _UNSTATED_SD)
    factor = clock_factor(time[later], sd, velocity[later, :2], place[later])
    scale = found.factor * factor
    unit = next((u for u in ("s", "ms", "us", "ns") if np.isclose(TIME_UNITS[u], scale)), "")
    if factor == 1.0 or not unit:
        return
    raise raw.fault(
        "io.time-unit-unlike-speed",
        "time",
        source=found.source,
        unit=unit,
        factor=factor,
        python=f'{{"time": "{unit}"}}',
        flags=f"--gnss-units time={unit}",
        keys=f'units = {{time = "{unit}"}}',
    )


#: Steps between fixes from which a speed is computed, s, and the least distance in them, m.
_STEPS, _WAY = (0.05, 10.0), 50.0
#: How near the ratio to the speed of the positions is that of a unit.
_NEAR = 0.04


def _refuse_unit_of_speed(
    raw: RawLog, found: dict[str, Found], time: Array, place: Array, velocity: Array
) -> None:
    """Refuse a velocity without a unit that fits the positions in another one than m/s.

    `time` ((n,), s). `place` ((n, 3)): deg, deg, m. `velocity` ((n, 3)): taken as m/s. The way
    between two fixes, regressed on the mean velocity at its ends, has its noise in the way alone.
    """
    names = [q for q in ("speed", *VELOCITY) if q in found and not found[q].stated]
    names = [q for q in names if q != "speed" or "VN" not in found]
    if not names or raw.stated:
        return
    known = np.isfinite(place).all(axis=1) & np.isfinite(velocity[:, :2]).all(axis=1)
    known &= np.isfinite(time)
    at, v, t = np.radians(place[known, :2]), velocity[known, :2], time[known]
    step = np.diff(t)
    use = (step > _STEPS[0]) & (step < _STEPS[1])
    meters = EARTH * np.column_stack([np.ones(len(at)), np.cos(at[:, 0])])
    turn = np.diff(at, axis=0)
    turn[:, 1] = np.remainder(turn[:, 1] + np.pi, 2 * np.pi) - np.pi
    way = (turn * meters[1:])[use].ravel()
    asked = (0.5 * (v[1:] + v[:-1]) * step[:, None])[use].ravel()
    size = float(asked @ asked)
    if np.abs(way).sum() < _WAY or not size > 0.0:
        return
    ratio = float(asked @ way) / size
    off = way - ratio * asked
    sd = float(np.sqrt(off @ off / max(off.size - 1, 1) / size))
    unit = next((u for u in SPEEDS_OF_OTHERS if abs(ratio / SPEEDS[u] - 1.0) < _NEAR), None)
    if unit is None or 2.0 * sd > _NEAR * ratio:
        return
    answer = dict.fromkeys(names, unit)
    raise raw.fault(
        "io.speed-unit-not-stated",
        ", ".join(names),
        source=found[names[0]].source,
        ratio=1.0 / ratio,
        unit=unit,
        name=names[0],
        python="{" + ", ".join(f'"{q}": "{u}"' for q, u in answer.items()) + "}",
        flags="--gnss-units " + ",".join(f"{q}={u}" for q, u in answer.items()),
        keys="units = {" + ", ".join(f'{q} = "{u}"' for q, u in answer.items()) + "}",
    )


def _accuracy(raw: RawLog, found: dict[str, Found], values: Callable[[str], Array]) -> Array | None:
    """Return standard deviations by the accuracies that a phone states, or None.

    Horizontal: the radius that holds 68 % (Android, Location.getAccuracy). A negative accuracy
    means that the position is not valid.
    """
    if "horizontal_accuracy" not in found:
        return None
    radius = values("horizontal_accuracy")
    horizontal = np.where(radius > 0.0, radius, np.nan) / RADIUS
    if "vertical_accuracy" in found:
        down = values("vertical_accuracy")
        vertical = np.where(down > 0.0, down, np.nan)
    else:
        vertical = UNSTATED_VERTICAL * horizontal
    raw.note(
        "io.sd-by-accuracy",
        quantity=", ".join(POSITION_SD),
        source=found["horizontal_accuracy"].source,
        unstated_vertical=None if "vertical_accuracy" in found else UNSTATED_VERTICAL,
    )
    return np.column_stack([horizontal, horizontal, vertical])


#: Seconds since 1970 of 2000 and 2045: dates of a receiver's fixes.
_DATES = (9.467e8, 2.367e9)
#: Most seconds that a device may have counted since its start, three years.
_SINCE_START = 1e8


def _time(raw: RawLog, found: Found, stated: str | None) -> tuple[Array, Clock]:
    """Return stamps, s, and their clock. `stated`: their unit or the order of their dates."""
    order = stated if stated in DATE_ORDERS else None
    time, name, dated = found.stamps(raw, order)
    values, source = raw.columns[found.source], found.source
    if dated and (epoch := epoch_of(values, source, STEP_OF_FIXES)) is not None:
        raw.note("io.stamps-of-epoch", "time", source=source, epoch=epoch)
    if dated and order is None and (readings := open_dates(values)):
        raw.warn("io.date-order-open", "time", source=source, date=values[0], **readings)
    first = float(time[np.isfinite(time)][0]) if np.isfinite(time).any() else 0.0
    if name != GPS and not (raw.clock or dated or found.stated) and first > 1e11:
        step = float(np.median(np.abs(np.diff(time)))) if time.size > 1 else np.nan
        # A receiver gives 100 fixes a second to one in two minutes: this, not the stamp, separates
        # a clock of 1970 in ms from one in ns that counts from the start of a phone.
        # Of neither clock is a stamp between them, or beyond: 46,000 years of 1.4e15 ms.
        fits = [
            u
            for u in ("ms", "us", "ns")
            if 0.005 <= step * TIME_UNITS[u] <= 120.0
            and (first * (k := TIME_UNITS[u]) < _SINCE_START or _DATES[0] < first * k < _DATES[1])
        ]
        by_date = [u for u in ("ms", "us", "ns") if _DATES[0] < first * TIME_UNITS[u] < _DATES[1]]
        unit = (fits or by_date or ["ms"])[0]
        if len(fits) == 1 and _DATES[0] < first * TIME_UNITS[unit] < _DATES[1]:
            raw.note(
                "io.time-unit-by-date",
                quantity="time",
                unit=unit,
                year=1970.0 + np.floor(first * TIME_UNITS[unit] / 31556952.0),
                step=step * TIME_UNITS[unit],
            )
            return time * TIME_UNITS[unit], Clock(UNIX)
        raise raw.fault(
            "io.stamp-no-date-clock-tells",
            "time",
            sample=0,
            first=first,
            source=found.source,
            flags=f"--gnss-units time={unit}",
            keys=f'units = {{time = "{unit}"}}',
        )
    return time, Clock(name)


#: Largest difference of two clocks of the same fixes from one offset, s, as a median.
_ONE_OFFSET = 0.1


def _other_clock(
    raw: RawLog, time: Array, clock: Clock, options: GnssOptions
) -> tuple[str, float, str] | None:
    """Return a clock of another kind beside that of the fixes: column, seconds ahead, kind.

    The inertial sensors may be on it. `time` (s): by `clock`.
    """
    if "time" in options.columns or raw.stated or time.size < 2:
        return None
    for name in raw.columns:
        said = read_name(name, FIXES)
        if said.quantity != "time" or not is_clock(raw, name):
            continue
        for unit in [said.unit] if said.unit else ["s", "ms", "us", "ns"]:
            try:
                own, kind, _ = Found(name, TIME_UNITS.get(str(unit), 1.0), True).stamps(raw)
            except DataError:
                break
            ahead = own - time
            offset = float(np.nanmedian(ahead))
            fits = float(np.nanmedian(np.abs(ahead - offset))) < _ONE_OFFSET
            if fits and offset != 0.0 and RELATIVE in (kind, clock.name) and kind != clock.name:
                return name, offset, kind
    return None


def _quality(raw: RawLog, found: dict[str, Found], values: Callable[[str], Array]) -> Array | None:
    if "quality" in found:
        return values("quality")
    if "Q" not in found:
        return None
    codes = values("Q")
    known = np.isin(codes, list(QUALITY))
    if not known.all():
        k = int(np.argmin(known))
        raise raw.fault("io.solution-kind-unknown", "Q", sample=k, codes=codes[k])
    raw.note("io.column-taken-codes-rtklib-fix", quantity="quality", source=found["Q"].source)
    return np.array([QUALITY[int(q)] for q in codes], dtype=np.float64)


#: Names of a column with the satellites of a fix, without case and separators.
_SATELLITES = ("satellites", "satellitesused", "numsatellites", "numsv", "nsats", "nsat", "sats")


def _satellites(raw: RawLog) -> str:
    """Column of the satellites of each fix, for display; empty if none has them as numbers."""
    names = {re.sub(r"\W|_", "", name.lower()): name for name in raw.columns}
    for known in _SATELLITES:
        column = raw.columns.get(names.get(known, ""))
        if column is not None and column.dtype.kind in "fiu":
            return names[known]
    return ""


def _say_unused(raw: RawLog, found: dict[str, Found], used: set[str]) -> None:
    """List the columns that no quantity of a fix takes; in a log, those of fixes among them."""
    if raw.stated:
        return
    in_log = "gyro_x" in names_of_quantities(raw)
    names = [one.source for one in found.values()] if in_log else list(raw.columns)
    if names := [name for name in names if name and name not in used]:
        raw.note("io.columns-not-used", names=names)


def open_fixes(path: str | Path) -> RawLog | Fixes | None:
    """Open the stream of fixes of a recording, for `read_gnss`; None if it has none."""
    try:
        raw = open_stream(path, "gnss")
        if isinstance(raw, RawLog) and not {"time", "lat", "lon"} <= fix_columns(raw, {}).keys():
            return None
    except StrapdownError:
        return None
    assert isinstance(raw, RawLog | Fixes)
    return raw


def read_gnss(
    path: str | Path, options: GnssOptions | None = None, raw: RawLog | Fixes | None = None
) -> pd.DataFrame:
    """Read the fixes of a GNSS receiver.

    `options`: user's statements about the file. `raw`: its stream of fixes, if it was opened before
    (`open_fixes`), which is used up. A Gnss table with the time of the file; ``attrs`` has the
    clock (`clocks`), ``source`` and ``findings``. A missing velocity has an infinite standard
    deviation. ConfigError: the file or format does not exist, or `options` names a column that it
    does not have. DataError: the file cannot be used; the message names file, row, quantity and
    remedy.
    """
    path, asked = Path(path), options or GnssOptions()
    if path.is_file() and comma2k19.belongs(path):
        raise DataError("io.fixes-comma-k-segment-two", file=path.name, parent=path.parent)
    stream = open_stream(path, "gnss", asked.format) if raw is None else raw
    fixes = fixes_of_columns(stream, asked) if isinstance(stream, RawLog) else stream
    assert isinstance(fixes, Fixes)  # of a format with fixes
    return table_of_fixes(fixes, asked)
