"""Columns of numbers: stamps that are dates, named arrays of binary files, rows of errors."""

from __future__ import annotations

import datetime
import math
import re
from collections.abc import Callable, Iterable, Iterator, Sequence, Set
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
    r" ?(?:(?P<half>[AP])M|Z|UTC|GMT|(?P<zone>[+-]\d\d:?\d\d))?",
    re.I,
)
# As C writes it: Wed Dec 22 21:09:46 2021.
_MONTHS = ["jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec"]
_CTIME = re.compile(
    rf"(?:mon|tue|wed|thu|fri|sat|sun) ({'|'.join(_MONTHS)}) +(\d{{1,2}}) "
    r"(\d\d:\d\d:\d\d(?:\.\d+)?) (?:UTC |GMT )?(\d{4})",
    re.I,
)
# A month in letters: 22-May-2015 07:00:25.730.
_NAMED_MONTH = re.compile(
    rf"(\d{{1,2}})[-/ ]({'|'.join(_MONTHS)})[a-z]*[-/ ](\d{{4}}|\d\d)(?!\d)", re.I
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
    return _ONLY_DATE.fullmatch(_plain(str(field))) is not None


def is_stamp(field: str) -> bool:
    """Whether a field is a time of day, a date, or both."""
    plain = _plain(field)
    return _STAMP.fullmatch(plain) is not None or _ONLY_DATE.fullmatch(plain) is not None


def _plain(field: str) -> str:
    """Write a date with its month in letters in numbers; any other text as it is.

    The letters of another zone than UTC may be of several (EST, CST): such a text is no stamp.
    """
    if (m := _CTIME.fullmatch(field)) is not None:
        return f"{m[4]}-{_MONTHS.index(m[1].lower()) + 1}-{m[2]} {m[3]}"
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


def nanoseconds_of(texts: Iterable[object]) -> NDArray[np.int64] | None:
    """Convert dates with times of day to nanoseconds since 1970, UTC where no zone is stated.

    `texts` ((n,)): ``2024-06-19 15:27:08.576``, ``19.06.2024 15:27:08,576``, ``06/19/2024 3:27:08
    PM``. Returns (n,), or None if one is neither, or beyond 1677 to 2262. Without a date, or where
    day and month are ambiguous, since the midnight before the first, as `day_nanoseconds`.
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
    low, high = _EXCEL_DAYS
    if values.dtype.kind != "f" or values.size < 2 or not low <= values[0] <= high:
        return None
    if not np.isfinite(values).all():
        return None
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


def ticks_of(raw: RawLog, source: str, unit: str | None = None) -> tuple[NDArray[Any], bool]:
    """Return stamps as numbers; dates and times of day as nanoseconds, and True.

    Nanoseconds count from 1970, or, without a date, from a midnight. DataError: a stamp is
    neither, or of another kind than those before it.
    """
    values = raw.columns[source]
    if values.dtype.kind == "M":
        return values.astype("datetime64[ns]").astype(np.int64), True
    if values.dtype.kind != "O":
        days = excel_nanoseconds(values) if unit is None else None
        return (numbers(raw, source, "time"), False) if days is None else (days, True)
    if not is_stamp(str(values[0])):
        return numbers(raw, source, "time"), False
    if re.match(r"\d{4}-\d\d-\d\d[T ]", str(values[0])):  # a hundred times faster
        texts = pd.Series(values).str.replace(",", ".")
        dates = pd.to_datetime(texts, format="ISO8601", utc=True, errors="coerce")
        parts = texts.str.extract(r":\d\d\.(\d+)", expand=False).fillna("0")
        if not dates.isna().any() and parts.str.len().nunique() == 1:
            stamps = dates.dt.tz_localize(None).to_numpy().astype("datetime64[ns]")
            return stamps.astype(np.int64), True
    found = nanoseconds_of(values)
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
