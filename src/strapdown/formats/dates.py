"""Dates and times of day as stamps: texts in the orders that people write, days of spreadsheets."""

from __future__ import annotations

import datetime
import re
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "day_nanoseconds",
    "excel_nanoseconds",
    "is_date",
    "is_day_time",
    "is_stamp",
    "nanoseconds_of",
]

_DATE = r"\d{1,4}[./-]\d{1,2}[./-]\d{1,4}"
_STAMP = re.compile(
    rf"(?:(?P<date>{_DATE})(?:[T,]|[ T,] ?))?"
    r"(?P<h>\d{1,2}):(?P<m>[0-5]\d):(?P<s>[0-5]\d)(?:[.,:](?P<part>\d{1,9}))?"
    r" ?(?:(?P<half>[AP])M|Z|UTC|GMT|(?P<zone>[+-]\d\d:?\d\d))?",
    re.I,
)
# As C writes it: Wed Dec 22 21:09:46 2021.
_MONTHS = ["jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec"]
_CTIME = re.compile(
    rf"(?:mon|tue|wed|thu|fri|sat|sun) ({'|'.join(_MONTHS)}) +(\d{{1,2}}) "
    r"(\d\d:\d\d:\d\d(?:\.\d+)?) (\d{4})",
    re.I,
)
_ONLY_DATE = re.compile(_DATE)
_DAY = 86_400 * 10**9
# A decrease of more than half a day is midnight.
_HALF_DAY = _DAY // 2
# Days since 1899-12-30, as spreadsheets count them: 1982 to 2064; and a step (0.26 s) that
# in seconds no inertial sensor has.
_EXCEL_DAYS, _EXCEL_STEP = (30_000.0, 60_000.0), 3e-6
_EXCEL_EPOCH = 25_569  # days from 1899-12-30 to 1970-01-01


def is_day_time(field: object) -> bool:
    """Whether a field is a time of day, with seconds, without a date."""
    return (m := _STAMP.fullmatch(str(field))) is not None and not m["date"]


def is_date(field: object) -> bool:
    """Whether a field is a date alone."""
    return _ONLY_DATE.fullmatch(str(field)) is not None


def is_stamp(field: str) -> bool:
    """Whether a field is a time of day, a date, or both."""
    return _STAMP.fullmatch(_plain(field)) is not None or is_date(field)


def _plain(field: str) -> str:
    """Write a date of C in numbers; any other text as it is."""
    m = _CTIME.fullmatch(field)
    return field if m is None else f"{m[4]}-{_MONTHS.index(m[1].lower()) + 1}-{m[2]} {m[3]}"


def day_nanoseconds(texts: Iterable[object]) -> NDArray[np.int64] | None:
    """Convert times of day to nanoseconds since the midnight before the first.

    `texts` ((n,)). Returns (n,), or None, none if one is not a time of day. Counting continues past
    midnight; dates are ignored.
    """
    found = _matches(texts)
    return None if found is None else _past_midnight(_of_day(found))


def nanoseconds_of(texts: Iterable[object]) -> NDArray[np.int64] | None:
    """Convert dates with times of day to nanoseconds since 1970, UTC where no zone is stated.

    `texts` ((n,)): ``2024-06-19 15:27:08.576``, ``19.06.2024 15:27:08,576``, ``06/19/2024 3:27:08
    PM``. Returns (n,), or None if one is neither. Without a date, or where day and month are
    ambiguous, since the midnight before the first, as `day_nanoseconds`.
    """
    found = _matches(texts)
    if found is None:
        return None
    whole = _of_day(found)
    days = _days({m["date"] for m in found})
    if days is None:
        return _past_midnight(whole)
    zones = {z: _zone(z) for z in {m["zone"] for m in found}}
    since = [days[m["date"]] * _DAY - zones[m["zone"]] for m in found]
    return np.asarray(whole + np.array(since, dtype=np.int64), dtype=np.int64)


def _matches(texts: Iterable[object]) -> list[re.Match[str]] | None:
    found: list[re.Match[str]] = []
    for text in texts:
        m = None if text is None else _STAMP.fullmatch(_plain(str(text).strip()))
        if m is None or int(m["h"]) > 23:
            return None
        found.append(m)
    return found or None


def _of_day(found: Sequence[re.Match[str]]) -> NDArray[np.int64]:
    """Return nanoseconds since midnight."""

    def hour(m: re.Match[str]) -> int:
        return int(m["h"]) if not m["half"] else int(m["h"]) % 12 + 12 * (m["half"] in "pP")

    return np.array(
        [
            (hour(m) * 3600 + int(m["m"]) * 60 + int(m["s"])) * 10**9
            + int((m["part"] or "0").ljust(9, "0"))
            for m in found
        ],
        dtype=np.int64,
    )


def _past_midnight(whole: NDArray[np.int64]) -> NDArray[np.int64]:
    fell = np.concatenate([[0], np.cumsum(np.diff(whole) < -_HALF_DAY)])
    return np.asarray(whole + fell * _DAY, dtype=np.int64)


def _days(dates: set[str | None]) -> dict[str | None, int] | None:
    """Return the days since 1970 of dates; None if they do not decide between day and month."""
    if None in dates:
        return None
    parts = {d: [int(p) for p in re.split(r"[./-]", str(d))] for d in dates}
    if all(p[0] > 31 for p in parts.values()):
        order = (0, 1, 2)
    elif any("." in str(d) for d in dates) or any(p[0] > 12 for p in parts.values()):
        order = (2, 1, 0)
    elif any(p[1] > 12 for p in parts.values()):
        order = (2, 0, 1)
    else:
        return None
    out: dict[str | None, int] = {}
    for text, part in parts.items():
        year, month, day = (part[k] for k in order)
        try:
            date = datetime.date(year + 2000 * (year < 100), month, day)
        except ValueError:
            return None
        out[text] = (date - datetime.date(1970, 1, 1)).days
    return out


def _zone(text: str | None) -> int:
    """Return how far a zone is ahead of UTC, in nanoseconds."""
    if text is None:
        return 0
    minutes = int(text[1:3]) * 60 + int(text[-2:])
    return (-1 if text[0] == "-" else 1) * minutes * 60 * 10**9


def excel_nanoseconds(values: NDArray[Any]) -> NDArray[np.int64] | None:
    """Convert days as spreadsheets count them to nanoseconds since 1970; None if they are none.

    `values` ((n,)). The step decides: as seconds, no inertial sensor would have it.
    """
    if values.dtype.kind != "f" or values.size < 2 or not np.isfinite(values).all():
        return None
    low, high = _EXCEL_DAYS
    steps = np.diff(values)
    forward = steps[steps > 0.0]
    if not (low <= values.min() and values.max() <= high and forward.size):
        return None
    if float(np.median(forward)) > _EXCEL_STEP:
        return None
    whole = np.floor(values)
    return np.asarray(
        (whole.astype(np.int64) - _EXCEL_EPOCH) * _DAY
        + np.rint((values - whole) * _DAY).astype(np.int64)
    )
