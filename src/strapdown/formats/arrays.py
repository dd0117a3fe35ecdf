"""Columns of numbers: stamps that are dates, named arrays of binary files, rows of errors."""

from __future__ import annotations

import datetime
import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence, Set
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.errors import DataError, Finding
from strapdown.formats.columns import read_name
from strapdown.formats.recording import RawLog, stated_by

_DATE = r"\d{1,4}[./-]\d{1,2}[./-]\d{1,4}"
_STAMP = re.compile(
    rf"(?:(?P<date>{_DATE})(?:[T,]|[ T,] ?))?"
    r"(?P<h>\d{1,2}):(?P<m>[0-5]?\d):(?P<s>[0-5]?\d)(?:[.,:](?P<part>\d{1,9}))?"
    r" ?(?:(?P<half>[AP])\.? ?M\.?|Z|(?:UTC|GMT)?(?P<zone>[+-]\d\d:?\d\d)|UTC|GMT)?",
    re.I,
)
# The basic form of ISO 8601: 20260304T091530.250Z; and minutes and seconds: 15:30.250.
_BASIC = re.compile(
    r"(\d{4})(\d\d)(\d\d)T(\d\d)(\d\d)(\d\d)((?:[.,]\d{1,9})?(?:Z|[+-]\d\d:?\d\d)?)"
)
_MINUTES = re.compile(r"([0-5]?\d:[0-5]\d[.,]\d{1,9})")
# As C writes it: Wed Dec 22 21:09:46 2021.
_MONTHS = ["jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec"]
_CTIME = re.compile(
    rf"(?:mon|tue|wed|thu|fri|sat|sun) ({'|'.join(_MONTHS)}) +(\d{{1,2}}) "
    r"(\d\d:\d\d:\d\d(?:\.\d+)?) (?:UTC |GMT )?(\d{4})",
    re.I,
)
# As browsers write it: Wed Dec 22 2021 21:09:46 GMT+0100 (Central European Standard Time).
_BROWSER = re.compile(
    rf"(?:mon|tue|wed|thu|fri|sat|sun) ({'|'.join(_MONTHS)}) (\d\d) (\d{{4}}) "
    r"(\d\d:\d\d:\d\d(?:\.\d+)? GMT[+-]\d{4})(?: \(.*\))?",
    re.I,
)
# A duration of pandas, of which the days are those of the clock: 0 days 00:00:00.01.
_DURATION = re.compile(r"\d+ days? (\d\d:\d\d:\d\d(?:\.\d{1,9})?)")
# A month in letters: 22-May-2015 07:00:25.730.
_NAMED_MONTH = re.compile(
    rf"(\d{{1,2}})[-/ ]({'|'.join(_MONTHS)})[a-z]*[-/ ](\d{{4}}|\d\d)(?!\d)", re.I
)
_ONLY_DATE = re.compile(_DATE)
_DAY = 86_400 * 10**9
# A decrease of more than half a day is midnight.
_HALF_DAY = _DAY // 2
# Clocks that count other units from other instants, each by what a clock counts at 1970 and in one
# second: no inertial sensor has such steps or stamps in seconds or their parts.
_MJD = "days of the modified Julian date"
_EPOCHS: dict[str, tuple[float, float]] = {
    "days since 1899-12-30, as spreadsheets": (25_569.0, 1 / 86_400),
    "days since the year 0, as MATLAB (datenum)": (719_529.0, 1 / 86_400),
    "days of the Julian date": (2_440_587.5, 1 / 86_400),
    _MJD: (40_587.0, 1 / 86_400),
    "100 ns since the year 1, as .NET": (621_355_968_000_000_000, 1e7),
    "100 ns since 1601, as Windows": (116_444_736_000_000_000, 1e7),
    "2^-32 s since 1900, as NTP": (2_208_988_800 * 2**32, 2.0**32),
}
#: 2000 to 2045, s since 1970; the most days that a step of a log has, 0.26 s, and one of fixes,
#: 43 s.
_YEARS, _MOST_STEP, STEP_OF_FIXES = (946_684_800, 2_366_841_600), 3e-6, 5e-4


def is_day_time(field: object) -> bool:
    """Whether a field is a time of day, with seconds, without a date."""
    return (m := _STAMP.fullmatch(_plain(str(field)))) is not None and not m["date"]


def is_date(field: object) -> bool:
    """Whether a field is a date alone."""
    return _ONLY_DATE.fullmatch(_plain(str(field))) is not None


def is_stamp(field: str) -> bool:
    """Whether a field is a time of day, a date, or both."""
    plain = _plain(field)
    return _STAMP.fullmatch(plain) is not None or _ONLY_DATE.fullmatch(plain) is not None


def _plain(field: str) -> str:
    """Write a date with its month in letters in numbers; any other text as it is.

    The letters of another zone than UTC may be of several (EST, CST): such a text is not a stamp.
    """
    if (m := _BASIC.fullmatch(field)) is not None:
        return f"{m[1]}-{m[2]}-{m[3]} {m[4]}:{m[5]}:{m[6]}{m[7]}"
    if _MINUTES.fullmatch(field) is not None:
        return f"0:{field}"
    if (m := _CTIME.fullmatch(field)) is not None:
        return f"{m[4]}-{_MONTHS.index(m[1].lower()) + 1}-{m[2]} {m[3]}"
    if (m := _BROWSER.fullmatch(field)) is not None:
        return f"{m[3]}-{_MONTHS.index(m[1].lower()) + 1}-{m[2]} {m[4]}"
    if (m := _DURATION.fullmatch(field)) is not None:
        return m[1]
    m = _NAMED_MONTH.match(field)
    if m is None:
        return field
    year = int(m[3]) + 2000 * (len(m[3]) == 2)
    return f"{year}-{_MONTHS.index(m[2].lower()) + 1}-{m[1]}{field[m.end() :]}"


def day_nanoseconds(texts: Iterable[object]) -> NDArray[np.int64] | None:
    """Convert times of day to nanoseconds since the midnight before the first.

    `texts` ((n,)). Returns (n,), or None, none if one is not a time of day. Counting continues past
    midnight; dates are ignored.
    """
    found = _matches(texts)
    return None if found is None else _past_midnight(_of_day(found))


def nanoseconds_of(texts: Iterable[object], order: str | None = None) -> NDArray[np.int64] | None:
    """Convert dates with times of day to nanoseconds since 1970, UTC where no zone is stated.

    `texts` ((n,)): ``2024-06-19 15:27:08.576``, ``19.06.2024 15:27:08,576``, ``06/19/2024 3:27:08
    PM``. `order`: of their dates (`units.DATE_ORDERS`), if stated. Returns (n,), or None if one is
    neither, or beyond 1677 to 2262. Without a date, or where day and month are ambiguous, since the
    midnight before the first, as `day_nanoseconds`.
    """
    found = _matches(texts)
    if found is None:
        return None
    whole = _of_day(found)
    days = _days({m["date"] for m in found}, order)
    if days is None:
        return _past_midnight(whole)
    zones = {z: _zone(z) for z in {m["zone"] for m in found}}
    since = [days[m["date"]] * _DAY - zones[m["zone"]] for m in found]
    if max(map(abs, since), default=0) >= 2**63 - 2 * _DAY:
        return None
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

    whole = [(hour(m) * 3600 + int(m["m"]) * 60 + int(m["s"])) * 10**9 for m in found]
    parts = [m["part"] or "0" for m in found]
    scale = _MILLI if _are_milliseconds(whole, parts) else None
    return np.array(
        [
            w + (int(p) * scale if scale else int(p.ljust(9, "0")))
            for w, p in zip(whole, parts, strict=True)
        ],
        dtype=np.int64,
    )


_MILLI = 10**6


def _are_milliseconds(whole: Sequence[int], parts: Sequence[str]) -> bool:
    """Whether the digits behind seconds count milliseconds, without leading zeros: 1.5 is 1.005 s.

    As decimals they go back where they pass 100 ms, and as counts they do not.
    """
    if max(map(len, parts), default=0) > 3 or len({*map(len, parts)}) < 2:
        return False
    if any(p[0] == "0" and p != "0" for p in parts):
        return False
    decimals = np.array([w + int(p.ljust(9, "0")) for w, p in zip(whole, parts, strict=True)])
    counts = np.array([w + int(p) * _MILLI for w, p in zip(whole, parts, strict=True)])
    back = [
        np.count_nonzero((d := np.diff(t)) < 0) - np.count_nonzero(d < -_HALF_DAY)
        for t in (decimals, counts)
    ]
    return bool(back[0] > 0 and back[1] == 0)


def _past_midnight(whole: NDArray[np.int64]) -> NDArray[np.int64]:
    fell = np.concatenate([[0], np.cumsum(np.diff(whole) < -_HALF_DAY)])
    return np.asarray(whole + fell * _DAY, dtype=np.int64)


#: Orders of day, month and year of a date: numbers of its parts.
_YMD, _DMY, _MDY = (0, 1, 2), (2, 1, 0), (2, 0, 1)


def _days(dates: set[str | None], order: str | None = None) -> dict[str | None, int] | None:
    """Return the days since 1970 of dates; None if they do not decide between day and month.

    `order`: as stated, of `units.DATE_ORDERS`. A part above 12 decides, and so do two dates that
    follow each other in one order alone.
    """
    if None in dates:
        return None
    parts = {d: [int(p) for p in re.split(r"[./-]", str(d))] for d in dates}
    if all(p[0] > 31 for p in parts.values()):
        return _in_order(parts, _YMD)
    if order is not None:
        return _in_order(parts, _DMY if order == "d/m/y" else _MDY)
    if any("." in str(d) for d in dates) or any(p[0] > 12 for p in parts.values()):
        return _in_order(parts, _DMY)
    if any(p[1] > 12 for p in parts.values()):
        return _in_order(parts, _MDY)
    both = [_in_order(parts, order) for order in (_DMY, _MDY)]
    spans = [max(d.values()) - min(d.values()) if d else math.inf for d in both]
    if both[0] == both[1]:
        return both[0]
    near = [k for k, span in enumerate(spans) if span < len(dates)]
    return both[near[0]] if len(dates) > 1 and len(near) == 1 else None


def _in_order(
    parts: Mapping[str | None, Sequence[int]], order: Sequence[int]
) -> dict[str | None, int] | None:
    """Return the days since 1970 of dates in an order of their parts; None if one is not a date."""
    out: dict[str | None, int] = {}
    for text, part in parts.items():
        year, month, day = (part[k] for k in order)
        try:
            date = datetime.date(year + 2000 * (year < 100), month, day)
        except ValueError:
            return None
        out[text] = (date - datetime.date(1970, 1, 1)).days
    return out


def open_dates(texts: NDArray[Any]) -> dict[str, str]:
    """Return the two readings, `first` and `second`, of a date whose day and month are open."""
    if texts.dtype.kind != "O" or (found := _matches(texts)) is None:
        return {}
    dates = {m["date"] for m in found}
    if None in dates or _days(dates) is not None:
        return {}
    year, month, day = (
        int(p) for p in (re.split(r"[./-]", str(found[0]["date"]))[k] for k in _DMY)
    )
    year += 2000 * (year < 100)
    both = f"{year}-{month:02d}-{day:02d}", f"{year}-{day:02d}-{month:02d}"
    return dict(zip(("first", "second"), both, strict=True))


def _zone(text: str | None) -> int:
    """Return how far a zone is ahead of UTC, in nanoseconds."""
    if text is None:
        return 0
    minutes = int(text[1:3]) * 60 + int(text[-2:])
    return (-1 if text[0] == "-" else 1) * minutes * 60 * 10**9


def epoch_of(values: NDArray[Any], column: str = "", most_step: float = _MOST_STEP) -> str | None:
    """Return the clock of `_EPOCHS` that stamps are of; None if of none.

    `values` ((n,)). `column`: its name. Stamps of 2000 to 2045 decide; of days, also the step, at
    most `most_step`: as seconds, no sensor would have it.
    """
    if values.dtype.kind not in "iuf" or values.size < 2 or not values[0] > 36_525.0:
        return None  # as of most logs
    if not np.isfinite(values).all():
        return None
    low, high = float(values.min()), float(values.max())
    modified = re.search(r"mjd|modified", column, re.I) is not None
    for name, (zero, rate) in _EPOCHS.items():
        if modified and name != _MJD:
            continue
        if not zero + rate * _YEARS[0] <= low <= high <= zero + rate * _YEARS[1]:
            continue
        if rate > 1.0:
            return name
        steps = np.diff(values)
        forward = steps[steps > 0.0]
        if values.dtype.kind == "f" and forward.size and np.median(forward) <= most_step:
            return name
    return None


def nanoseconds_of_epoch(values: NDArray[Any], epoch: str) -> NDArray[np.int64]:
    """Convert stamps of a clock of `_EPOCHS` to nanoseconds since 1970."""
    zero, rate = _EPOCHS[epoch]
    if rate < 1.0:
        whole = np.floor(values)
        days = whole - math.floor(zero)
        part = (values - whole) - (zero - math.floor(zero))
        return np.asarray(days.astype(np.int64) * _DAY + np.rint(part * _DAY).astype(np.int64))
    if values.dtype.kind == "f":
        return np.asarray(np.rint((values - zero) / rate * 1e9).astype(np.int64))
    if rate == 1e7:
        return np.asarray((values.astype(np.int64) - int(zero)) * 100)
    since = values.astype(np.uint64) - np.uint64(zero)
    whole, part = since >> np.uint64(32), since & np.uint64(2**32 - 1)
    ns = np.rint(part.astype(np.float64) * 2.0**-32 * 1e9).astype(np.int64)
    return np.asarray(whole.astype(np.int64) * 10**9 + ns)


# Numbers of columns, and named arrays of binary files.


RATES = ("sampling_rate", "sample_rate", "rate_hz", "fs", "freq", "frequency")


def raw_log(
    path: Path, arrays: dict[str, NDArray[Any]], units: dict[str, str], meta: dict[str, Any]
) -> RawLog:
    """Convert named arrays to columns of one length.

    `arrays`: One- and two-dimensional; a second dimension of up to 16 becomes ``name[0]``,
    ``name[1]`` …. `units`: where the file states them. `meta`: may hold ``sampling``, ``axes`` and
    a sampling rate. DataError: no numeric array has two samples or more.
    """
    squeezed = {name: np.squeeze(array) for name, array in arrays.items()}
    stamps = {
        array.size
        for name, array in squeezed.items()
        if array.ndim == 1 and read_name(name).quantity == "time"
    }
    columns: dict[str, NDArray[Any]] = {}
    for name, array in squeezed.items():
        columns |= _columns(name, array, stamps)
    if not columns:
        raise DataError(
            "io.no-array-of-numbers",
            file=path.name,
            arrays=", ".join([*arrays, *meta]) or "nothing",
        )
    # The length of the gyro's arrays, or else the most common length.
    rates = [c.size for n, c in columns.items() if str(read_name(n).quantity).startswith("gyro")]
    lengths = rates or [c.size for c in columns.values()]
    samples = int(max(set(lengths), key=lengths.count))
    findings = _left_out(columns, samples, path.name)
    columns = {n: c for n, c in columns.items() if c.size == samples}
    return RawLog(
        name=path.name,
        files=(path,),
        columns=columns,
        units={n: units[b] for n in columns if (b := n.partition("[")[0]) in units},
        rate=_rate(meta),
        findings=findings,
        **stated_by({key: _text(value) for key, value in meta.items()}),
    )


def _left_out(columns: dict[str, NDArray[Any]], samples: int, file: str) -> list[Finding]:
    """List arrays whose length differs from the gyro's; refuse stamps of another length."""
    other = {n: c.size for n, c in columns.items() if c.size != samples}
    for name, size in other.items():
        if read_name(name).quantity == "time":
            raise DataError(
                "io.values-gyro-samples",
                file=file,
                quantity="time",
                name=name,
                size=size,
                samples=samples,
            )
    if not other:
        return []
    listed = ", ".join(f"{name} ({size} values)" for name, size in other.items())
    return [
        Finding(
            "io.left-out-because-gyro-samples",
            file=file,
            severity="note",
            samples=samples,
            listed=listed,
        )
    ]


def _columns(name: str, array: NDArray[Any], stamps: Set[int]) -> dict[str, NDArray[Any]]:
    """Columns of an array; `stamps`: lengths of the columns of time."""
    if array.dtype.kind not in "iufbM" or array.ndim not in (1, 2) or array.size < 2:
        return {}
    if array.ndim == 1:
        return {name: array}
    # One row per sample, as many as there are stamps; MATLAB often has one column per sample.
    first, second = array.shape
    across = second in stamps if (first in stamps) != (second in stamps) else first < second
    rows = array.T if across else array
    if rows.shape[1] > 16:
        return {}
    return {f"{name}[{k}]": np.ascontiguousarray(rows[:, k]) for k in range(rows.shape[1])}


def _rate(meta: dict[str, Any]) -> float | None:
    """Return the stated sampling rate, given as a number or as text with its unit."""
    for key in RATES:
        text = _text(meta.get(key)) or ""
        match = re.fullmatch(r"\s*([\d.eE+-]+)\s*(Hz)?\s*", text, re.I)
        try:
            rate = float(match.group(1)) if match else math.nan
        except ValueError:
            continue
        if math.isfinite(rate) and rate > 0:
            return rate
    return None


def _text(value: Any) -> str | None:
    if value is None:
        return None
    if isinstance(value, bytes):
        return value.decode("utf-8", "replace")
    if isinstance(value, np.ndarray):
        return _text(value.reshape(-1)[0]) if value.size else None
    return str(value)


def numbers(raw: RawLog, source: str, quantity: str) -> NDArray[Any]:
    """Return the values of a column as numbers.

    `source`: the column. `quantity`: for messages. Returns (n,), integers or floats, as in the
    file; NaN for missing values. DataError: a value is not a number.
    """
    values = raw.columns[source]
    if values.dtype.kind in "iufb":
        return values
    texts = pd.Series(values)
    found = pd.to_numeric(texts, errors="coerce").to_numpy(dtype=np.float64)
    bad = np.flatnonzero(np.isnan(found) & texts.notna().to_numpy())
    if bad.size:
        raise raw.fault(
            "io.value-not-a-number",
            quantity,
            sample=int(bad[0]),
            values=values[bad[0]],
            source=source,
        )
    return found


def as_rows(parts: Sequence[NDArray[Any]]) -> NDArray[np.float64] | None:
    """Return columns of doubles that are successive rows of one array as these rows, (k, n).

    None if they are not, or may not be written.
    """
    base = parts[0].base
    if not isinstance(base, np.ndarray) or base.ndim != 2 or base.dtype != np.float64:
        return None
    if not (base.flags.c_contiguous and base.flags.writeable and base.size):
        return None
    if any(p.base is not base or p.shape != parts[0].shape or p.ndim != 1 for p in parts):
        return None
    begin = base.__array_interface__["data"][0]
    at = [p.__array_interface__["data"][0] - begin for p in parts]
    row = at[0] // base.strides[0]
    rows = base[row : row + len(parts), : parts[0].size]
    same = [k * base.strides[0] for k in range(row, row + len(parts))] == at
    return rows if same and all(p.strides == (8,) for p in parts) else None


def ticks_of(
    raw: RawLog,
    source: str,
    unit: str | None = None,
    order: str | None = None,
    most_step: float = _MOST_STEP,
) -> tuple[NDArray[Any], bool]:
    """Return stamps as numbers; dates and times of day as nanoseconds, and True.

    `unit`: that of the column, if stated. `order`: of dates (`units.DATE_ORDERS`), if stated.
    `most_step`: as of `epoch_of`. Nanoseconds count from 1970, or, without a date, from a midnight.
    DataError: a stamp is neither, or of another kind than those before it.
    """
    values = raw.columns[source]
    if values.dtype.kind == "M":
        return values.astype("datetime64[ns]").astype(np.int64), True
    if values.dtype.kind != "O":
        epoch = epoch_of(values, source, most_step) if unit is None else None
        if epoch is None:
            return numbers(raw, source, "time"), False
        return nanoseconds_of_epoch(values, epoch), True
    if not is_stamp(str(values[0])):
        return numbers(raw, source, "time"), False
    if re.match(r"\d{4}-\d\d-\d\d[T ]", str(values[0])):  # a hundred times faster
        texts = pd.Series(values).str.replace(",", ".")
        dates = pd.to_datetime(texts, format="ISO8601", utc=True, errors="coerce")
        parts = texts.str.extract(r":\d\d\.(\d+)", expand=False).fillna("0")
        if not dates.isna().any() and parts.str.len().nunique() == 1:
            stamps = dates.dt.tz_localize(None).to_numpy().astype("datetime64[ns]")
            return stamps.astype(np.int64), True
    found = nanoseconds_of(values, order)
    if found is None:
        first = next((k for k, v in enumerate(values) if nanoseconds_of([v]) is None), 0)
        raise raw.fault(
            "io.not-date-time-like-those", "time", sample=first, values=values[first], source=source
        )
    return found, True


@contextmanager
def told_by_file_rows(name: str, row_of: Callable[[int], int | None]) -> Iterator[None]:
    """Re-raise errors of a table with the row of its file.

    `name`: file name. `row_of`: maps a row of the table, from 0, to a row of the file.
    """
    try:
        yield
    except DataError as error:
        row = error.finding.row
        raise DataError(
            error.finding, file=name, row=None if row is None else row_of(row - 1)
        ) from None
