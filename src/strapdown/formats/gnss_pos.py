"""Fixes from solutions of RTKLIB (``.pos``).

Lines of ``%`` at the top describe the file; the last names the columns, and its first word
is the time system. Time is a date, or a GPS week with its seconds; the position is in degrees, in
degrees, minutes and seconds, or Cartesian. ``sdne`` and similar are the square root of the
magnitude of a covariance, with its sign. Layout: RTKLIB 2.4.3 manual, appendix B.1.
"""

from __future__ import annotations

import codecs
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.errors import DataError, Finding, add_note, add_warning
from strapdown.formats.clocks import GPS, WEEK, Clock, leap_seconds
from strapdown.formats.gnss_fixes import Fixes
from strapdown.formats.signs import Signs
from strapdown.formats.text_columns import columns_at_once, decoded
from strapdown.frames import geodetic_from_ecef, q_ne

Array = NDArray[np.float64]
#: Receivers of Emlid write it with the second ending, and without a line of names.
SUFFIXES = (".pos", ".llh")
#: RTKLIB's Q (1 fix, 2 float, 3 SBAS, 4 DGPS, 5 single, 6 PPP, 7 dead reckoning) to field 6 of
#: NMEA 0183 GGA, as RTKLIB writes it; SBAS is differential.
QUALITY = {0: 0, 1: 4, 2: 5, 3: 2, 4: 2, 5: 1, 6: 3, 7: 6}
# Offset that converts a time system to UTC, in s; GPST needs no conversion.
_TO_UTC = {"UTC": 0.0, "JST": -9.0 * 3600.0}
_HEAD = re.compile(r"%\s*(GPST|UTC|JST)\b[\s,;\t]*(.*)", re.I)
_DAYS_OF_1980 = 3657  # from 1970-01-01 to 1980-01-06
_XYZ = ["x-ecef(m)", "y-ecef(m)", "z-ecef(m)"]


# The line that names the columns.
detect = Signs(
    named=SUFFIXES,
    text=r"^%[ \t]*(?i:GPST|UTC|JST)\b.*(?:latitude\(|x-ecef\(|e-baseline\(|longitude\()",
)


def _header(line: str) -> re.Match[str] | None:
    match = _HEAD.match(line.strip())
    known = ("latitude(", "x-ecef(", "e-baseline(", "longitude(")
    return match if match and any(k in match[2] for k in known) else None


@dataclass(frozen=True)
class _Layout:
    """Content of the header."""

    system: str
    names: list[str]
    separator: str
    row: int
    over_sea: bool = False


def read(path: Path) -> Fixes:
    """Read the fixes of an RTKLIB solution.

    Time in seconds of the GPS week of the first row: UTC is converted with its leap seconds, JST
    with nine more hours. DataError: no line names the columns, and the rows are not as RTKLIB
    writes them; the solution is a baseline, the datum is another, or a row is damaged.
    """
    text, findings = _decoded(path)
    lines = text.splitlines()
    layout = _layout(lines, path.name, findings)
    columns, rows = _columns(lines, layout, text.endswith(("\n", "\r")), path.name, findings)
    time, week = _time(columns, layout, path.name, rows)
    named = {n: columns[n] for n in layout.names if n in columns}
    fixes = _ecef(named) if "x-ecef(m)" in named else _level(named, columns)
    place, velocity, position_sd, velocity_sd = fixes
    quality = columns["Q"]
    known = np.isin(quality, list(QUALITY))
    if not known.all():
        k = int(np.argmin(known))
        raise DataError(
            "io.solution-kind-unknown-2",
            file=path.name,
            row=int(rows[k]),
            quantity="Q",
            quality=quality[k],
        )
    return Fixes(
        name=path.name,
        time=time,
        place=place,
        rows=rows,
        clock=Clock(GPS, 0.0, week),
        velocity=velocity,
        position_sd=position_sd,
        velocity_sd=velocity_sd,
        quality=np.array([QUALITY[int(q)] for q in quality], dtype=np.float64),
        satellites=columns.get("ns"),
        zero_is_unknown=True,
        heights_from="sea" if layout.over_sea else "",
        height_source="height(m), geodetic",
        findings=findings,
    )


def _decoded(path: Path) -> tuple[str, list[Finding]]:
    data = path.read_bytes()
    if not data:
        raise DataError("io.file-empty-2", file=path.name)
    if data.startswith(codecs.BOM_UTF8):
        data = data[3:]
    return decoded(data, path.name)


def _layout(lines: list[str], file: str, findings: list[Finding]) -> _Layout:
    headers = (
        (row, match)
        for row, line in enumerate(lines, 1)
        if line.startswith("%") and (match := _header(line))
    )
    row, match = next(headers, (0, None))
    if match is None:
        return _without_header(lines, file, findings)
    top = " ".join(line for line in lines[:row] if line.startswith("%"))
    told = re.search(r"lat/lon/height=(\w+)/(\w+)", top)
    if told and told[1] != "WGS84":
        raise DataError("io.places-refer-datum", file=file, quantity="lat, lon", told=told[1])
    if "e-baseline(" in match[2]:
        raise DataError("io.holds-way-base-station-no", file=file, row=row, quantity="lat, lon")
    separator = next((s for s in ",;\t" if s in match[2]), " ")
    names = [n for n in re.split(r"[\s,;]+", match[2].strip()) if n]
    form = next((f for f in ("(deg)", "(d'\")") if f"latitude{f}" in names), "")
    places = [f"latitude{form}", f"longitude{form}", "height(m)"] if form else _XYZ
    missing = [p for p in (*places, "Q") if p not in names]
    if missing or len(set(names)) < len(names):
        raise DataError(
            "io.line-names-columns-damaged-names",
            file=file,
            row=row,
            quantity=", ".join(missing) or None,
            names=names,
        )
    over_sea = bool(told and told[2] == "geodetic")
    return _Layout(match[1].upper(), names, separator, row, over_sea)


def _without_header(lines: list[str], file: str, findings: list[Finding]) -> _Layout:
    """Find the layout by the first row; RTKLIB writes its columns in one order.

    The number of decimals identifies positions: nine in degrees, four in meters. Time system and
    heights, which the header would state, are the defaults of RTKLIB.
    """
    row, first = next(
        ((k, line) for k, line in enumerate(lines, 1) if line.strip() and line[0] not in "%#"),
        (0, ""),
    )
    separator = next((s for s in ",;\t" if s in first), " ")
    fields = [f for f in re.split(r"[\s,;]+", first.strip()) if f]
    dated = len(fields) > 1 and "/" in fields[0] and ":" in fields[1]
    weeks = len(fields) > 1 and fields[0].isdecimal() and "." in fields[1]
    rest = fields[2:] if dated or weeks else []
    if any(_HEAD.match(line.strip()) for line in lines[:row]):
        rest = []  # a header that names other columns
    if len(rest) in (_PLAIN, _PLAIN + len(_VELOCITY)) and re.fullmatch(r"[0-7]", rest[3]):
        xyz = np.array([float(f) if _FLOAT.fullmatch(f) else np.nan for f in rest[:3]])
        decimals = [len(f.partition(".")[2]) for f in rest[:2]]
        level = min(decimals) >= 7 and abs(xyz[0]) <= 90.0
        if level or 6.3e6 < np.linalg.norm(xyz) < 6.5e6:
            names = [*(_LEVEL_NAMES if level else _ECEF_NAMES), "age(s)", "ratio"]
            names[3:3] = ["Q", "ns"]
            if len(rest) > _PLAIN:
                names += _VELOCITY if level else _ECEF_VELOCITY
            add_warning(findings, "io.pos-without-header", file=file, row=row)
            return _Layout("GPST", names, separator, row)
    places = [f for f in fields[:2] if _FLOAT.fullmatch(f) and "." in f and abs(float(f)) <= 180.0]
    code = "io.list-of-stations" if len(places) == 2 else "io.no-line-names-columns-gpst"
    raise DataError(code, file=file, row=row or None, first=" ".join(fields[:4]))


_FLOAT = re.compile(r"[+-]?\d+\.?\d*")
#: Columns behind the time as RTKLIB writes them (manual, appendix B.1), and without velocity.
_LEVEL_NAMES = ["latitude(deg)", "longitude(deg)", "height(m)"]
_LEVEL_NAMES += ["sdn(m)", "sde(m)", "sdu(m)", "sdne(m)", "sdeu(m)", "sdun(m)"]
_ECEF_NAMES = [*_XYZ, "sdx(m)", "sdy(m)", "sdz(m)", "sdxy(m)", "sdyz(m)", "sdzx(m)"]
_VELOCITY = ["vn(m/s)", "ve(m/s)", "vu(m/s)", "sdvn", "sdve", "sdvu", "sdvne", "sdveu", "sdvun"]
_ECEF_VELOCITY = ["vx(m/s)", "vy(m/s)", "vz(m/s)", "sdvx", "sdvy", "sdvz"]
_ECEF_VELOCITY += ["sdvxy", "sdvyz", "sdvzx"]
_PLAIN = 13


def _columns(
    lines: list[str], layout: _Layout, ended: bool, file: str, findings: list[Finding]
) -> tuple[dict[str, Array], NDArray[np.int64]]:
    """Return numbers by name; a date has six, degrees with minutes and seconds three."""
    held = [(k, line) for k, line in enumerate(lines, 1) if line.strip() and line[0] != "%"]
    if not held:
        raise DataError("io.header-no-solution-under", file=file, row=layout.row)
    dated = "/" in held[0][1].split()[0]
    names = ["year", "month", "day", "hour", "minute", "second"] if dated else ["week", "tow"]
    for name in layout.names:
        if "d'\"" in name:
            names += [f"{name[:3]}{part}" for part in ("_deg", "_min", "_sec")]
        else:
            names.append(name)
    table = str.maketrans({layout.separator: " "} | ({"/": " ", ":": " "} if dated else {}))
    plain = [(row, line.translate(table)) for row, line in held]
    widths = [len(line.split()) for _, line in plain]
    if widths[-1] < len(names) and (not ended or len(plain) > 1):
        add_note(findings, "io.last-line-cut-left-out", file=file, row=plain[-1][0])
        plain, widths = plain[:-1], widths[:-1]
    if not plain:
        raise DataError("io.only-line-under-header-cut", file=file, row=held[0][0])
    for (row, _), width in zip(plain, widths, strict=True):
        if width != len(names):
            raise DataError(
                "io.numbers-header-names", file=file, row=row, width=width, count=len(names)
            )
    rows = np.array([row for row, _ in plain], dtype=np.int64)
    text = "".join(f"{' '.join(line.split())}\n" for _, line in plain)
    # An integer zero loses its sign, and the sign of the degrees is the hemisphere.
    body = text.replace(" -0 ", " -0.0 ").encode()
    columns = columns_at_once(body, len(names), None) if body.isascii() else None
    if columns is None or any(c.dtype.kind not in "iuf" for c in columns):
        _refuse_words(plain, names, file)
        columns = list(np.array(body.split(), dtype=np.float64).reshape(-1, len(names)).T)
    return {n: np.asarray(c, dtype=np.float64) for n, c in zip(names, columns, strict=True)}, rows


def _refuse_words(plain: list[tuple[int, str]], names: list[str], file: str) -> None:
    for row, line in plain:
        for name, text in zip(names, line.split(), strict=True):
            try:
                # Python takes digits of other scripts and 1_000 for numbers, too.
                float(text if text.isascii() and "_" not in text else "")
            except ValueError:
                raise DataError(
                    "io.text-with-decimal-comma" if "," in text else "io.text-not-a-number",
                    file=file,
                    row=row,
                    quantity=name,
                    text=text,
                ) from None


def _time(
    columns: dict[str, Array], layout: _Layout, file: str, rows: NDArray[np.int64]
) -> tuple[Array, int]:
    """Return seconds of the GPS week of the first row, and that week."""
    if "week" in columns:
        weeks, seconds = columns["week"], columns["tow"]
    else:
        year, month, day = columns["year"], columns["month"], columns["day"]
        dated = (np.abs(year - 2090.0) <= 110.0) & (np.abs(month - 6.5) <= 5.5)
        dated &= np.abs(day - 16.0) <= 15.0
        if not dated.all():
            row = int(rows[int(np.argmin(dated))])
            raise DataError("io.time-no-date-since-no", file=file, row=row, quantity="time")
        months = (12.0 * (year - 1970.0) + month - 1.0).astype(np.int64)
        begin = months.astype("datetime64[M]").astype("datetime64[D]").astype(np.int64)
        days = begin + day - 1.0 - _DAYS_OF_1980
        weeks = np.floor(days / 7.0)
        seconds = 86400.0 * (days - 7.0 * weeks) + 3600.0 * columns["hour"]
        seconds = seconds + 60.0 * columns["minute"] + columns["second"]
    if layout.system in _TO_UTC:
        utc = WEEK * weeks + seconds + 86400.0 * _DAYS_OF_1980 + _TO_UTC[layout.system]
        # Whole seconds: their sum is exact.
        seconds = seconds + _TO_UTC[layout.system] + leap_seconds(utc)
    bad = np.flatnonzero(~np.isfinite(weeks + seconds) | (weeks < 0.0))
    if bad.size:
        raise DataError(
            "io.time-no-date-since-no", file=file, row=int(rows[bad[0]]), quantity="time"
        )
    first = weeks[0] + np.floor(seconds[0] / WEEK)
    return np.asarray(WEEK * (weeks - first) + seconds), int(first)


def _stack(named: dict[str, Array], names: list[str]) -> Array | None:
    return np.column_stack([named[n] for n in names]) if all(n in named for n in names) else None


def _degrees(columns: dict[str, Array], name: str) -> Array:
    if f"{name}_deg" not in columns:
        return columns[next(n for n in columns if n.startswith(f"{name}") and "(deg)" in n)]
    whole, minute, second = (columns[f"{name}_{p}"] for p in ("deg", "min", "sec"))
    # Between the equator and one degree south the sign is that of a zero.
    return np.asarray(np.copysign(np.abs(whole) + minute / 60.0 + second / 3600.0, whole))


_Four = tuple[Array, Array | None, Array | None, Array | None]


def _level(named: dict[str, Array], columns: dict[str, Array]) -> _Four:
    place = np.column_stack(
        [_degrees(columns, "lat"), _degrees(columns, "lon"), named["height(m)"]]
    )
    velocity = _stack(named, ["vn(m/s)", "ve(m/s)", "vu(m/s)"])
    return (
        place,
        None if velocity is None else velocity * [1.0, 1.0, -1.0],
        _stack(named, ["sdn(m)", "sde(m)", "sdu(m)"]),
        _stack(named, ["sdvn", "sdve", "sdvu"]),
    )


def _ecef(named: dict[str, Array]) -> _Four:
    xyz = _stack(named, _XYZ)
    assert xyz is not None
    place = geodetic_from_ecef(xyz)
    to_level = q_ne(place[:, 0], place[:, 1])
    velocity = _stack(named, ["vx(m/s)", "vy(m/s)", "vz(m/s)"])
    pairs = ["sdxy(m)", "sdyz(m)", "sdzx(m)"]
    return (
        place,
        None if velocity is None else rotation.rotate(to_level, velocity),
        _turned_sd(named, ["sdx(m)", "sdy(m)", "sdz(m)"], pairs, to_level),
        _turned_sd(named, ["sdvx", "sdvy", "sdvz"], ["sdvxy", "sdvyz", "sdvzx"], to_level),
    )


def _turned_sd(
    named: dict[str, Array], own: list[str], pairs: list[str], to_level: Array
) -> Array | None:
    """Rotate a covariance from Earth axes; return standard deviations north, east, down."""
    sd, between = _stack(named, own), _stack(named, pairs)
    if sd is None:
        return None
    P = np.zeros((len(sd), 3, 3))
    for k in range(3):
        P[:, k, k] = sd[:, k] ** 2
    if between is not None:
        signed = between * np.abs(between)
        for column, (i, j) in enumerate(((0, 1), (1, 2), (2, 0))):
            P[:, i, j] = P[:, j, i] = signed[:, column]
    C = rotation.dcm_from_quaternion(to_level)
    turned = np.einsum("nij,njk,nik->ni", C, P, C)
    # A zero in any of the three means unknown, and therefore unknown in all rotated axes.
    turned[(sd == 0.0).any(axis=1)] = 0.0
    return np.asarray(np.sqrt(np.maximum(turned, 0.0)))
