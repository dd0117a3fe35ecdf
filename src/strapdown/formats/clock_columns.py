"""One clock of the columns of a table whose stamps are in parts, in digits, or of another epoch.

A date and a time of day; whole seconds and the part of a second; year, month, day, hour, minute and
second; digits as 20240506093015; numbers of a name that states a multiple of a unit (``time_10us``)
or an epoch (``LabVIEW time``). Joined columns are reported.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from datetime import datetime
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import Finding, add_note
from strapdown.formats.arrays import is_date, is_day_time, is_stamp
from strapdown.formats.columns import LONGEST, read_name
from strapdown.units import unit_of

Columns = dict[str, NDArray[Any]]
_DAY, _LAST = 86_400, 5e9  # s
_HALF = _DAY // 2


def with_one_clock(
    columns: Mapping[str, NDArray[Any]], units: dict[str, str], findings: list[Finding], file: str
) -> Columns:
    """Join the columns of a clock in parts.

    `units`: the unit of the joined column is added. `findings`: what was joined is added. `file`:
    for messages.
    """
    out = dict(columns)
    if max(map(len, out), default=0) > LONGEST:
        return out  # no pattern is searched in the names of a damaged file
    for join in (_components, _date_and_time, _whole_and_part, _one_number):
        out = join(out, units, findings, file)
    return out


def _joined(findings: list[Finding], file: str, names: list[str], how: str) -> None:
    add_note(findings, "io.clock-joined", file=file, quantity="time", names=names, how=how)


def _replaced(columns: Columns, old: list[str], name: str, values: NDArray[Any]) -> Columns:
    """Put one column in the position of the first of several."""
    return {
        (name if n == old[0] else n): (values if n == old[0] else c)
        for n, c in columns.items()
        if n not in old[1:]
    }


# Whole seconds and the part of a second.


#: Parts of a second that a name states, and their number in one.
_PARTS = {"ms": 10**3, "us": 10**6, "ns": 10**9}
_PART_WORDS = {
    "nanosec": "ns",
    "nanosecs": "ns",
    "microsec": "us",
    "millisec": "ms",
    "millis": "ms",
}
_SECONDS = re.compile(r"[\s_./]*(?:secs?|seconds|s)\W*$", re.I)
#: The end of a time of day in whole seconds, before which its part is put.
_WHOLE_TEXT = re.compile(r":\d\d(?=(?:\s*[ap]\.?m\.?)?$)", re.I)
#: Names of whole seconds in a clock.
_WHOLE_WORDS = ("sec", "secs", "seconds")


def _whole_and_part(
    columns: Columns, units: dict[str, str], findings: list[Finding], file: str
) -> Columns:
    """Join whole seconds, or times of day in whole seconds, with a column of their part.

    The part is below one second, and goes back where the seconds go on and nowhere else: a second
    clock is not one.
    """
    wholes = [n for n in columns if _is_whole(n, columns[n], units)]
    for part, unit in [(n, u) for n in columns if (u := _part_unit(n, columns[n], units))]:
        for whole in wholes:
            if whole == part or whole not in columns or part not in columns:
                continue
            held, ticks = columns[whole], columns[part].astype(np.int64)
            bare = _SECONDS.sub("", whole.strip())
            # Stamps of ROS may be out of order.
            named = unit == "ns" and re.fullmatch(
                r"[\s_./]*n(?:ano)?secs?", part.strip().removeprefix(bare), re.I
            )
            if not (named and ticks.max() < _PARTS[unit]) and not _is_part_of(
                held, ticks, _PARTS[unit]
            ):
                continue
            name = bare if bare and bare not in columns else whole
            if read_name(name).quantity != "time" or read_name(name).unit:
                name = "stamp" if "stamp" not in columns else whole
            if held.dtype.kind == "M":
                since = ticks * (10**9 // _PARTS[unit])
                values: NDArray[Any] = held.astype("datetime64[ns]") + since.astype(
                    "timedelta64[ns]"
                )
                name = whole
            elif held.dtype.kind == "O":
                digits = len(str(_PARTS[unit])) - 1
                values = np.array(
                    [
                        _WHOLE_TEXT.sub(rf"\g<0>.{p:0{digits}d}", str(t))
                        for t, p in zip(held, ticks, strict=True)
                    ],
                    dtype=object,
                )
                name = whole
            else:
                values = held.astype(np.int64) * _PARTS[unit] + ticks
                units[name] = unit
            columns = _replaced(columns, [whole, part], name, values)
            _joined(findings, file, [whole, part], f"seconds and {unit}")
    return columns


def _is_whole(name: str, values: NDArray[Any], units: Mapping[str, str]) -> bool:
    """Whether a column has whole seconds of a clock, or times of day in whole seconds."""
    if values.dtype.kind == "M":
        return bool((values == values.astype("datetime64[s]")).all())
    if values.dtype.kind == "O":
        first = str(values[0]) if values.size else ""
        return _WHOLE_TEXT.search(first) is not None and is_stamp(first)
    last = re.split(r"[\s_./]+", name.strip().lower())[-1]
    said = read_name(name)
    unit = unit_of(units[name]) if name in units else said.unit
    timed = said.quantity == "time" or last in _WHOLE_WORDS
    # Later stamps are none of seconds since 1900.
    return timed and unit in (None, "s") and _is_counted(values) and values.max() < _LAST


def _part_unit(name: str, values: NDArray[Any], units: Mapping[str, str]) -> str | None:
    """Return the unit of a column that may be the part of a second; None if it is none."""
    last = re.split(r"[\s_./]+", name.strip().lower())[-1]
    said = read_name(name)
    unit = unit_of(units[name]) if name in units else said.unit
    unit = _PART_WORDS.get(last) or unit_of(last, ("time",)) or unit
    timed = said.quantity in (None, "time")
    return unit if timed and unit in _PARTS and _is_counted(values) else None


def _is_counted(values: NDArray[Any]) -> bool:
    """Whether a column has whole numbers that are not negative."""
    if values.dtype.kind == "f":
        return bool(np.isfinite(values).all() and (values >= 0).all() and (values % 1 == 0).all())
    return values.dtype.kind in "iu" and bool((values >= 0).all())


def _is_part_of(held: NDArray[Any], ticks: NDArray[np.int64], most: int) -> bool:
    """Whether ticks begin anew where the seconds go on, and nowhere else."""
    if ticks.size < 2 or ticks.max() >= most:
        return False
    if held.dtype.kind in "OM":
        on = held[1:] != held[:-1]
    else:
        steps = np.diff(held.astype(np.int64))
        if (steps <= 0).all():  # rows in descending order
            steps, ticks = -steps[::-1], ticks[::-1]
        on = steps > 0
        if (steps < 0).any():
            return False
    # A clock of its own would not stay below a second while the seconds go on.
    return not bool(((np.diff(ticks) < 0) & ~on).any())


# Year, month, day, hour, minute, second.


_COMPONENTS = {
    "year": ("year", "yyyy", "yr", "jahr", "año", "ano", "annee", "année", "anno"),
    "month": ("month", "mon", "mo", "monat", "mes", "mois", "mese"),
    "day": ("day", "dd", "tag", "dia", "día", "jour", "giorno", "dom"),
    "hour": ("hour", "hours", "hh", "hr", "hrs", "h", "stunde", "hora", "heure", "ora"),
    "minute": ("minute", "minutes", "min", "mins", "mm", "minuto"),
    "second": ("second", "seconds", "sec", "secs", "ss", "s", "sekunde", "segundo", "seconde"),
    "ms": ("ms", "msec", "millisecond", "milliseconds", "millis", "fff", "mmm"),
    "us": ("us", "usec", "microsecond", "microseconds", "micros"),
}
#: Least and most of each.
_RANGES = {
    "year": (2000, 2045),
    "month": (1, 12),
    "day": (1, 31),
    "hour": (0, 23),
    "minute": (0, 59),
    "second": (0, 60.999999999),
    "ms": (0, 999.999999),
    "us": (0, 999_999.999),
}
_BEFORE = re.compile(r"^(?:utc|gps|gnss|rtc|time|date|local|nav)[\s_.]*(?=.)", re.I)


def _components(
    columns: Columns, units: dict[str, str], findings: list[Finding], file: str
) -> Columns:
    """Join hours, minutes and seconds in columns, with a date or without."""
    names: dict[str, str] = {}
    for name, values in columns.items():
        word = _BEFORE.sub("", re.sub(r"\W*\(?utc\)?$", "", name.strip().lower()))
        part = next((p for p, words in _COMPONENTS.items() if word in words), None)
        if part is None or part in names or values.dtype.kind not in "iuf":
            continue
        low, high = _RANGES[part]
        if np.isfinite(values).all() and values.min() >= low and values.max() <= high:
            names[part] = name
    if not {"hour", "minute", "second"} <= names.keys():
        return columns
    others = [n for n in columns if read_name(n).quantity == "time" and n not in names.values()]
    if others and not {"ms", "us"} & names.keys() and _is_counted(columns[names["second"]]):
        return columns  # of the start, or coarser than the other clock
    dated = {"year", "month", "day"} <= names.keys()
    used = [p for p in _COMPONENTS if p in names and (dated or p not in ("year", "month", "day"))]
    held = {p: columns[names[p]] for p in used}
    nanoseconds = np.rint(held["second"] * 1e9).astype(np.int64)
    for part, factor in (("hour", 3600 * 10**9), ("minute", 60 * 10**9)):
        nanoseconds += held[part].astype(np.int64) * factor
    for part, factor in (("ms", 10**6), ("us", 10**3)):
        if part in held:
            nanoseconds += np.rint(held[part] * factor).astype(np.int64)
    if dated:
        months = (held["year"].astype(np.int64) - 1970) * 12 + held["month"].astype(np.int64) - 1
        days = months.astype("datetime64[M]").astype("datetime64[D]").astype(np.int64)
        days += held["day"].astype(np.int64) - 1
        stamps: NDArray[Any] = (days * _DAY * 10**9 + nanoseconds).astype("datetime64[ns]")
    else:
        fell = np.diff(nanoseconds) < -_HALF * 10**9
        stamps = nanoseconds + np.concatenate([[0], np.cumsum(fell)]) * _DAY * 10**9
    old = [n for n in columns if n in {names[p] for p in used}]
    name = "time" if "time" not in columns else "clock time"
    if not dated:
        units[name] = "ns"
    _joined(findings, file, old, ", ".join(used))
    return _replaced(columns, old, name, stamps)


# A date and a time of day, as texts or as digits.


#: Words of a date of birth, or of another event, beside a clock.
_OTHER_DATE = re.compile(r"birth|dob|expir|export|creat|modif|nacim|geburt", re.I)


def _date_and_time(
    columns: Columns, units: dict[str, str], findings: list[Finding], file: str
) -> Columns:
    """Join a date and a time of day that are two columns."""
    digits = _digits_of_clock(columns)
    for name in [n for n, c in digits.items() if _says(n, "date") and not is_date(c[0])]:
        first = digits[name][0]
        add_note(
            findings, "io.date-of-digits-open", file=file, quantity="time", source=name, first=first
        )
    columns = columns | digits
    texts = {n: c for n, c in columns.items() if c.dtype.kind == "O" and c.size}
    dates = [n for n, c in texts.items() if is_date(c[0]) and not _OTHER_DATE.search(n)]
    times = [n for n, c in texts.items() if is_day_time(c[0])]
    for found in (dates, times):
        clocks = [n for n in found if read_name(n).quantity == "time" or _says(n, "date")]
        found[:] = clocks if len(found) > 1 and len(clocks) == 1 else found
    if len(dates) != 1 or len(times) != 1:
        return columns
    days, of_day = columns[dates[0]], columns[times[0]]
    both = [None if None in pair else " ".join(pair) for pair in zip(days, of_day, strict=True)]
    return {
        n: np.array(both, dtype=object) if n == times[0] else c
        for n, c in columns.items()
        if n != dates[0]
    }


def _digits_of_clock(columns: Mapping[str, NDArray[Any]]) -> Columns:
    """Return a time of day that is a number of digits, 93015.2, and a date, 20240506, as texts.

    Beside a date its name is enough; alone, a time of day goes on from 59 to 100: as a number of
    seconds it jumps by 40 more at each full minute. A date of six digits whose order neither its
    name (``ddmmyy``) nor its numbers decide becomes none: 240506 may be of 2024 or of 2006, and
    the time counts from midnight. Nine digits have milliseconds: 093015200.
    """
    numeric = [n for n in columns if columns[n].dtype.kind in "iuf" and columns[n].size]
    dates = [n for n in numeric if _says(n, "date")]
    clocks = [n for n in numeric if _says(n, "time")]
    if len(clocks) != 1 or len(dates) > 1:
        return {}
    of_day = columns[clocks[0]].astype(np.float64)
    if not np.isfinite(of_day).all():
        return {}
    day = columns[dates[0]].astype(np.float64) if dates else np.empty(0)
    dated = bool(dates) and bool(np.isfinite(day).all())
    # A time without milliseconds has at most six digits.
    named = re.sub(r"[\W_]", "", clocks[0].lower()).startswith("hhmmss")
    number = of_day
    if of_day.max() >= 240_000 and (dated or named) and (of_day % 1 == 0).all():
        of_day = of_day / 1000.0
    whole = np.floor(of_day)
    parts = [whole // 10_000, whole // 100 % 100, whole % 100]
    if any((v < 0).any() or (v >= most).any() for v, most in zip(parts, (24, 60, 60), strict=True)):
        return {}
    second = of_day - 100.0 * (whole // 100)
    seconds = 3600.0 * parts[0] + 60.0 * parts[1] + second
    if not named and _jumps_at_minutes(seconds, number):
        return {}  # seconds, or milliseconds, of a day
    if not dates and not named and not _jumps_at_minutes(of_day, seconds):
        return {}
    times = [
        f"{int(h):02d}:{int(m):02d}:{s:09.6f}"
        for h, m, s in zip(parts[0], parts[1], second, strict=True)
    ]
    out = {clocks[0]: np.array(times, dtype=object)}
    if dated:
        name = re.sub(r"[\W_]", "", dates[0].lower())
        days = {d: _day_of_digits(int(d), name) for d in np.unique(day).tolist()}
        if all(days.values()):
            out[dates[0]] = np.array([days[d] for d in day.tolist()], dtype=object)
        else:
            out[dates[0]] = np.array([f"{int(d):06d}" for d in day.tolist()], dtype=object)
    return out


#: Orders of the digits of a date that a name states.
_ORDERS = {"ddmmyy": "%d%m%y", "yymmdd": "%y%m%d", "mmddyy": "%m%d%y"}
_ORDERS |= {"ddmmyyyy": "%d%m%Y", "yyyymmdd": "%Y%m%d", "mmddyyyy": "%m%d%Y"}


def _day_of_digits(digits: int, name: str) -> str:
    """Return a date of digits as year-month-day; empty if their order is open.

    `name`: of its column, in small letters without signs.
    """
    order = _ORDERS.get(name, "%Y%m%d" if digits >= 20_000_000 else "")
    try:
        date = datetime.strptime(f"{digits:0{8 if '%Y' in order else 6}d}", order)
    except ValueError:
        return ""
    return f"{date:%Y-%m-%d}" if 2000 <= date.year <= 2045 else ""


def _jumps_at_minutes(digits: NDArray[np.float64], seconds: NDArray[np.float64]) -> bool:
    """Whether stamps are even as a time of day, and as numbers at full minutes alone not."""
    if digits.size < 3:
        return False
    steps, jumps = np.diff(seconds), np.diff(digits)
    usual = float(np.median(jumps))
    odd = np.abs(jumps - usual) > 0.5 * usual
    even = np.abs(steps - usual) <= 0.5 * usual
    return usual > 0.0 and bool(odd.any() and even[odd].all() and not (odd & ~even).any())


_SAYS = {
    "date": "date datum day fecha data дата 日期 日付 tarih dato ddmmyy yymmdd mmddyy ddmmyyyy "
    "yyyymmdd mmddyyyy",
    "time": "time hhmmss hora uhrzeit zeit heure ora tijd czas tid время 时间 時刻 saat čas "
    "hhmmssfff hhmmsssss hhmmsszzz hhmmssmmm",
}


def _says(name: str, word: str) -> bool:
    """Whether a name is a word, alone or with UTC beside it: DATE, utc_time."""
    plain = re.sub(r"[\W_]", "", name.lower())
    said = re.sub("utc|gps|gmt", "", plain)
    return said in (word * 2, *_SAYS[word].split()) or (word == "time" and plain in ("utc", "gmt"))


# One number: digits of a date with its time, a multiple of a unit, seconds of a named epoch.


_MULTIPLE = re.compile(
    r"(?P<name>.*?)[\s_\[(]+(?P<count>\d+(?:\.\d+)?)[\s_]*(?P<unit>s|ms|us|µs|μs|ns)[\])]?$", re.I
)
_NAMED = re.compile(
    r"\b(h|hr|hrs|hours|d|days)\W*$|_(h|hr|hrs|hours|d|days)$|ntp|labview|c[of]", re.I
)
_LONG = re.compile(r"(?P<name>.*?)[\s_\[(]+(?P<unit>h|hr|hrs|hours|d|days)[\])]?$", re.I)
_OF_DAY = re.compile(r"of[\s_]?day|\bsod\b", re.I)
#: Seconds from the origin of a clock to 1970, by words of its name.
_ORIGINS = {
    re.compile(r"labview|1904", re.I): 2_082_844_800,
    re.compile(r"\bntp|1900", re.I): 2_208_988_800,
    re.compile(r"cocoa|cfabsolute|referencedate|2001", re.I): -978_307_200,
}
#: 2000 to 2045, in seconds since 1970.
_YEARS = (946_684_800.0, 2_366_841_600.0)


def _one_number(
    columns: Columns, units: dict[str, str], findings: list[Finding], file: str
) -> Columns:
    for name, values in list(columns.items()):
        if values.dtype.kind not in "iuf" or not values.size or name in units:
            continue
        # Most columns are none of these, and long.
        digits = 2.0e13 <= float(values[0]) < 2.046e16
        if not (digits or re.search(r"\d|of.?day|sod", name) or _NAMED.search(name)):
            continue
        if not np.isfinite(values).all():
            continue
        multiple, long = _MULTIPLE.fullmatch(name.strip()), _LONG.fullmatch(name.strip())
        if multiple and read_name(multiple["name"]).quantity == "time":
            unit = str(unit_of(multiple["unit"], ("time",)))
            count = float(multiple["count"])
            ns = {"s": 10**9, **{u: 10**9 // n for u, n in _PARTS.items()}}[unit] * count
            exact = values.dtype.kind in "iu" and ns % 1 == 0 and abs(values).max() < 2**62 / ns
            bare = multiple["name"] if multiple["name"] not in columns else name
            held = values * int(ns) if exact else values * ns
            columns = _replaced(columns, [name], bare, held)
            units[bare] = "ns"
            _joined(findings, file, [name], f"counts of {multiple['count']} {unit}")
        elif long and read_name(long["name"]).quantity == "time":
            factor = 86_400.0 if long["unit"].lower().startswith("d") else 3600.0
            bare = long["name"] if long["name"] not in columns else name
            columns = _replaced(columns, [name], bare, values * factor)
            units[bare] = "s"
        elif _OF_DAY.search(name) and read_name(name).quantity == "time":
            fell = np.diff(values.astype(np.float64)) < -_HALF
            if fell.any() and values.min() >= 0 and values.max() <= _DAY:
                since = values + np.concatenate([[0], np.cumsum(fell)]) * _DAY
                columns = {n: since if n == name else c for n, c in columns.items()}
        elif (dates := _date_of_digits(values)) is not None:
            columns = {n: dates if n == name else c for n, c in columns.items()}
            _joined(findings, file, [name], "digits of year, month, day, hour, minute and second")
        else:
            for words, origin in _ORIGINS.items():
                since = values.astype(np.float64) - origin
                if words.search(name) and _YEARS[0] <= since.min() <= since.max() <= _YEARS[1]:
                    ns_ = np.rint((values - np.floor(values)) * 1e9).astype(np.int64)
                    whole = np.floor(values).astype(np.int64) - origin
                    stamps = (whole * 10**9 + ns_).astype("datetime64[ns]")
                    columns = {n: stamps if n == name else c for n, c in columns.items()}
                    year = 1970 - round(origin / 31_556_952)
                    _joined(findings, file, [name], f"seconds since {year}")
                    break
    return columns


def _date_of_digits(values: NDArray[Any]) -> NDArray[Any] | None:
    """Return stamps of 14 digits, 20240506093015, or 17 with milliseconds, as dates; else None."""
    low, high = float(values.min()), float(values.max())
    scale = next((s for s in (1, 1000) if 2.0e13 * s <= low and high < 2.046e13 * s), 0)
    if not scale:
        return None
    whole = np.floor(values).astype(np.int64)
    parts, rest = [], whole // scale
    for _ in range(5):
        parts.append(rest % 100)
        rest = rest // 100
    second, minute, hour, day, month = parts
    fits = (month >= 1) & (month <= 12) & (day >= 1) & (day <= 31)
    if not (fits & (hour < 24) & (minute < 60) & (second < 61)).all():
        return None
    months = (rest - 1970) * 12 + month - 1
    days = months.astype("datetime64[M]").astype("datetime64[D]").astype(np.int64) + day - 1
    ns = (days * _DAY + hour * 3600 + minute * 60 + second) * 10**9 + whole % scale * 10**6
    ns += np.rint((values - np.floor(values)) * 1e9 / scale).astype(np.int64)
    return np.asarray(ns.astype("datetime64[ns]"))
