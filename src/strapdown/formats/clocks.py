"""Clock of a table's time: seconds of a GPS week, seconds since 1970, or relative time.

``attrs`` of a table hold:

``clock``
    ``gps-seconds-of-week``, ``unix`` (seconds since 1970-01-01 UTC without leap seconds), or
    ``relative`` (from an instant that the file does not state).
``clock_origin``
    Seconds on that clock at the table's time zero; 0 where time is as in the file.
``clock_origin_stamp``
    The same as stamp and unit of the file, where it is a whole number: a double of seconds resolves
    a clock of 1970 to only 0.2 µs.
``gps_week``
    Week of the first row, counted from 1980-01-06; None if unknown.
"""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.errors import DataError, Finding, add_note, add_warning
from strapdown.formats.inference.conclusion import (
    THRESHOLD,
    differenced,
    infer_time_unit,
    wrap_of,
)
from strapdown.formats.recording import Origin
from strapdown.tables.checks import RELATIVE as RELATIVE
from strapdown.tables.checks import Array
from strapdown.tables.on_disk import filled, let_go, step_range
from strapdown.tables.sample_clock import sample_clock
from strapdown.units import TIME_UNITS, factor_of

GPS, UNIX = "gps-seconds-of-week", "unix"
WEEK = 604_800.0  # s
YEAR = 365.25 * 86400.0  # s
#: 1980-01-06, the origin of GPS weeks, in seconds since 1970.
GPS_EPOCH = 315_964_800.0
# Seconds since 1970 from which on GPS time is this many seconds ahead of UTC (IERS Bulletin C).
_LEAPS = (
    (362_793_600.0, 1),
    (394_329_600.0, 2),
    (425_865_600.0, 3),
    (489_024_000.0, 4),
    (567_993_600.0, 5),
    (631_152_000.0, 6),
    (662_688_000.0, 7),
    (709_948_800.0, 8),
    (741_484_800.0, 9),
    (773_020_800.0, 10),
    (820_454_400.0, 11),
    (867_715_200.0, 12),
    (915_148_800.0, 13),
    (1_136_073_600.0, 14),
    (1_230_768_000.0, 15),
    (1_341_100_800.0, 16),
    (1_435_708_800.0, 17),
    (1_483_228_800.0, 18),
)
_WORDS = {
    GPS: {"sow", "tow", "gpssow", "gpstow", "gpst", "gps", "itow"},
    UNIX: {"unix", "utc", "unixtime"},
}
# Lower limit of Unix time (2001); no sensor has counted that long since its start.
_MODERN = 1e9  # s
# And upper, 2045: seconds since 1904 or 1900 are beyond it.
EPOCH_END = 2_366_841_600.0  # s


@dataclass(frozen=True)
class Clock:
    """Clock of a table's time; see the module.

    `origin` (s).
    """

    name: str
    origin: float = 0.0
    week: int | None = None


#: Keys of a table's ``attrs`` that state its clock.
CLOCK = ("clock", "clock_origin", "clock_origin_stamp", "gps_week")


def clock_of(table: pd.DataFrame) -> Clock:
    """Return the clock stated in a table's ``attrs``."""
    said = table.attrs
    return Clock(
        said.get("clock", RELATIVE), float(said.get("clock_origin", 0.0)), said.get("gps_week")
    )


def with_clock(table: pd.DataFrame, clock: Clock) -> pd.DataFrame:
    """Write a clock to the ``attrs`` of a new table; return the same table."""
    table.attrs |= {"clock": clock.name, "clock_origin": clock.origin, "gps_week": clock.week}
    return table


#: Nanoseconds of a unit of whole stamps.
_NS = {"s": 1_000_000_000, "ms": 1_000_000, "us": 1000, "ns": 1}


def own_ns(table: pd.DataFrame) -> NDArray[np.int64]:
    """Return a table's stamps on its own clock, (n,), ns.

    Exact where they count from a whole stamp of the file; otherwise the shortest decimal that is
    the same double.
    """
    time = table.index.to_numpy(dtype=np.float64)
    stamp, unit = table.attrs.get("clock_origin_stamp") or (clock_of(table).origin, "s")
    if isinstance(stamp, int) and unit in _NS:
        return np.asarray(stamp * _NS[unit] + np.rint(time * 1e9).astype(np.int64))
    return _nearest_ns(time + float(stamp) * factor_of(unit, TIME_UNITS))


def _nearest_ns(seconds: Array) -> NDArray[np.int64]:
    whole = np.floor(seconds)
    rest = seconds - whole
    ns = np.rint(rest * 1e9)
    open_ = np.ones(seconds.size, dtype=bool)
    for digits in range(9):
        part = np.rint(rest * 10.0**digits) / 10.0**digits
        same = open_ & (whole + part == seconds)
        ns[same] = np.rint(part[same] * 1e9)
        open_ &= ~same
    return np.asarray(whole.astype(np.int64) * 1_000_000_000 + ns.astype(np.int64))


def time_column(table: pd.DataFrame) -> dict[str, NDArray[Any]]:
    """Return a table's stamps under a name that says clock and unit, as the readers take them.

    Seconds as in the table; whole nanoseconds if its time is counted from another origin.
    """
    clock = clock_of(table)
    name = {GPS: "gps_sow", UNIX: "unix_time"}.get(clock.name, "time")
    if clock.origin == 0.0:
        return {f"{name}_s": table.index.to_numpy(dtype=np.float64)}
    return {f"{name}_ns": own_ns(table)}


def year_of(table: pd.DataFrame) -> float | None:
    """Decimal year of a table's first stamp; None if its clock has no date."""
    clock = clock_of(table)
    seconds = float(table.index[0]) + clock.origin
    if clock.name == GPS and clock.week is not None:
        seconds = float(unix_from_gps(np.array([seconds + WEEK * clock.week]))[0])
    elif clock.name != UNIX:
        return None
    return 1970.0 + seconds / YEAR


def clock_of_name(name: str, first: float, *, dated: bool = False) -> str:
    """Infer the clock from a column's name and its first stamp.

    `name`: as ``gps_sow_s``, ``unix_time_ms``, ``t``. `first` (s): its first stamp. `dated`:
    whether the stamps are dates, or times of day. Returns `GPS`, `UNIX` or `RELATIVE`.
    """
    words = set(re.split(r"[^a-z]+", name.lower()))
    if dated:
        return UNIX if first > _MODERN else RELATIVE
    if words & _WORDS[UNIX]:
        return UNIX
    if words & _WORDS[GPS] and 0.0 <= first <= WEEK + 1.0:
        return GPS
    return UNIX if _MODERN < first < EPOCH_END and not words & _WORDS[GPS] else RELATIVE


def leap_seconds(unix: Array) -> Array:
    """Return GPS time minus UTC at given instants.

    `unix` ((n,), s): since 1970.
    """
    starts = np.array([start for start, _ in _LEAPS])
    ahead = np.array([0.0, *(float(count) for _, count in _LEAPS)])
    return np.asarray(ahead[np.searchsorted(starts, unix, side="right")])


def gps_from_unix(unix: Array) -> Array:
    """Convert UTC to GPS seconds since 1980-01-06.

    `unix` ((n,), s): since 1970, without leap seconds.
    """
    return np.asarray(unix - GPS_EPOCH + leap_seconds(unix))


def unix_from_gps(seconds: Array) -> Array:
    """Convert GPS seconds to UTC, seconds since 1970.

    `seconds` ((n,), s): GPS time since 1980-01-06.
    """
    guess = seconds + GPS_EPOCH
    return np.asarray(guess - leap_seconds(guess - leap_seconds(guess)))


def unrolled(time: Array) -> tuple[Array, list[int]]:
    """Unwrap seconds of week across the end of a week.

    `time` ((n,), s). Returns `time` ((n,), s): counted on from the first row's week. The same array
    without a rollover; `rows`: rows, from 0, that begin a week.

    A rollover is a decrease of more than half a week, from the last hour of a week to the
    first hour of the next.
    """
    if len(time) < 2 or step_range(time)[0] >= 0.0:
        return time, []
    steps = np.diff(time)
    falls = np.flatnonzero(
        (steps < -0.5 * WEEK) & (time[:-1] > WEEK - 3600.0) & (time[1:] < 3600.0)
    )
    if not falls.size or time.max() > WEEK:
        return time, []
    added = np.zeros(time.size)
    added[falls + 1] = WEEK
    return np.asarray(time + np.cumsum(added)), [int(k) + 1 for k in falls]


def on_clock_of(
    table: pd.DataFrame, imu: pd.DataFrame, source: str | None = None
) -> tuple[pd.DataFrame, Finding | None]:
    """Convert a table's time to that of the inertial sensors.

    `table`, `imu`: indexed by time; ``attrs`` state their clocks, which are unknown otherwise.
    `source`: name of `table` for messages; by default that in its ``attrs``. Returns `table`: the
    same table if its time is already on that clock, or if one of the clocks is unknown; `finding`:
    the offset that was added. DataError: one clock counts from 1970, the other is a GPS week, and
    the week is not stated.
    """
    own, other = clock_of(table), clock_of(imu)
    file = source or table.attrs.get("source")
    time = table.index.to_numpy(dtype=np.float64)
    name, ahead, kind = table.attrs.get("other_clock", ("", 0.0, ""))
    data: dict[str, Any] = {"severity": "note"}
    absolute = time + own.origin
    begin, end = imu.index[[0, -1]] + other.origin - ahead
    if kind == other.name != own.name and absolute[0] <= end and begin <= absolute[-1]:
        shift, code = own.origin + ahead - other.origin, "io.time-of-other-clock"
        data["source"] = name
        if kind == RELATIVE:  # each may count from a start of its own
            data["severity"] = "warning"
    elif RELATIVE in (own.name, other.name):
        return table, None
    elif own.name == other.name == UNIX:
        shift, code = own.origin - other.origin, "io.time-from-1970-shifted"
    elif own.name == other.name:
        weeks = 0.0 if None in (own.week, other.week) else WEEK * (own.week - other.week)  # type: ignore[operator]
        shift, code = own.origin - other.origin + weeks, "io.time-of-gps-week-shifted"
    else:
        if own.name == UNIX:
            gps = gps_from_unix(absolute[:1])[0]
            week = other.week if other.week is not None else int(gps // WEEK)
            shift = float(gps - WEEK * week) - time[0] - other.origin
        elif own.week is None:
            raise DataError("io.gps-week-not-stated", file=file, quantity="time")
        else:
            unix = unix_from_gps(absolute[:1] + WEEK * own.week)[0]
            shift = float(unix) - time[0] - other.origin
        code = "io.time-shifted-by-leap-seconds"
    if shift == 0.0:
        return table, None
    out = table.copy()
    out.index = pd.Index(time + shift, name=table.index.name)
    out.attrs = {**table.attrs, "clock": other.name, "clock_origin": other.origin}
    out.attrs["clock_origin_stamp"] = imu.attrs.get("clock_origin_stamp")
    out.attrs["gps_week"] = other.week
    return out, Finding(code, file=file, quantity="time", shift=shift, **data)


# Samples that are numbered.


#: Names of columns that number samples, without signs and blanks, in small letters.
_COUNTERS = {
    *("packetcounter", "packet", "packets", "counter", "count", "sample", "samples", "index"),
    *("idx", "seq", "sequence", "headerseq", "n", "no", "nr", "#", "frame", "framenumber"),
    *("loggingsample", "unnamed0", "packetnumber", "samplenumber", "num", ""),
}


def counted(columns: Mapping[str, NDArray[Any]]) -> tuple[str, NDArray[np.int64]] | None:
    """Return the name of the column that numbers the samples, and the numbers without wraps.

    It holds whole numbers, of which each is most often that before plus one; lost samples are
    lost numbers. None if there is none.
    """
    for name, values in columns.items():
        word = re.sub(r"[^a-z0-9#]|\(.*", "", name.lower())
        if word not in _COUNTERS or values.dtype.kind not in "iu" or values.size < 2:
            continue
        steps = np.diff(values.astype(np.int64))
        if 2 * int((steps == 1).sum()) <= steps.size:
            continue
        for bits in (8, 16, 24, 31, 32):
            if values.min() >= 0 and values.max() < 2**bits:
                # A wrap goes from the end of the range to its beginning.
                steps = np.where(steps < -(2 ** (bits - 1)), steps + 2**bits, steps)
                break
        return name, np.concatenate([[0], np.cumsum(steps)])
    return None


def is_count(stamps: NDArray[Any]) -> bool:
    """Whether stamps are growing whole numbers of which each is most often that before plus one.

    They number the samples, of which some may be lost, as well as they are a clock of one tick.
    """
    if stamps.dtype.kind not in "iuf" or stamps.size < 2 or not float(stamps[0]).is_integer():
        return False
    steps = np.diff(stamps.astype(np.float64))
    whole = (steps >= 1) & (steps == np.floor(steps))
    return bool(whole.all()) and 2 * int((steps == 1).sum()) > steps.size


# Stamps that are coarser than the samples.


#: Share of the samples that repeat the stamp before them, where bursts share a stamp and where a
#: clock is coarse; fewest stamps.
COARSE, REPEATED, FEWEST_STAMPS = 0.5, 0.01, 5
#: Of a tick of a coarse clock, how far samples at a constant rate may be outside theirs.
OFF_TICK = 0.1


@dataclass(frozen=True)
class EvenStamps:
    """Stamps at a constant rate instead of those of a coarse clock, or shared by bursts.

    `ticks` ((n,)), `step`: in the unit of the stamps, like all others. `tick`, `off`: tick of a
    coarse clock, and largest distance of a stamp from it. `spread`, `size`: standard deviation of
    the deliveries of bursts, and mean number of samples of one.
    """

    ticks: NDArray[Any]
    step: float
    tick: float = 0.0
    off: float = 0.0
    spread: float = 0.0
    size: float = 0.0

    def finding(self, factor: float, **where: Any) -> Finding:
        """Report them. `factor`: of the unit of the stamps, s."""
        if self.size:
            data = {
                "size": self.size,
                "rate_hz": 1.0 / (self.step * factor),
                "spread": self.spread * factor,
                "interval": self.size * self.step * factor,
            }
            return Finding("io.stamps-shared-by-bursts", data=data, **where)
        data = {
            "tick": self.tick * factor,
            "rate": 1.0 / (self.step * factor),
            "rate_within": self.tick / (self.step**2 * max(self.ticks.size - 1, 1) * factor),
            "off": self.off * factor,
        }
        return Finding("io.stamps-spread-evenly", data=data, **where)


def even_stamps(stamps: NDArray[Any]) -> EvenStamps | None:
    """Spread samples that share the stamps of a coarse clock, as whole seconds of a log of 50 Hz.

    Sample k is at a + k P, and its stamp is the tick that has passed by then, so that the stamps
    less k P lie within one tick: their range is smallest at the P that fits best, and a is in the
    middle of what they leave. None if stamps do not repeat, go back, or do not fit within
    `OFF_TICK`, as with bursts of different sizes.
    """
    if stamps.dtype.kind not in "iuf" or stamps.size < FEWEST_STAMPS:
        return None
    changes = int(np.count_nonzero(stamps[1:] != stamps[:-1]))
    repeats = stamps.size - 1 - changes
    if changes < FEWEST_STAMPS - 1 or repeats < max(FEWEST_STAMPS, REPEATED * (stamps.size - 1)):
        return None
    exact = differenced(stamps)
    whole = np.diff(exact).astype(np.float64)
    ends = np.flatnonzero(whole)
    tick = float(whole[ends].min())
    jumps = whole[ends] / tick
    if not tick > 0.0 or not np.allclose(jumps, np.round(jumps), rtol=0.0, atol=1e-3):
        return None
    # First and last sample of each stamp.
    at = np.unique(np.concatenate([[0], ends, ends + 1, [exact.size - 1]])).astype(np.float64)
    held = (exact[at.astype(np.int64)] - exact[0]).astype(np.float64)

    def width(step: float) -> float:
        return float(np.ptp(held - step * at))

    # Convex in the step, which is within a tick over the record of its mean.
    low, high = ((held[-1] + sign * 2.0 * tick) / at[-1] for sign in (-1.0, 1.0))
    for _ in range(80):
        left, right = low + (high - low) / 3.0, high - (high - low) / 3.0
        low, high = (low, right) if width(left) <= width(right) else (left, high)
    step = 0.5 * (low + high)
    rest = held - step * at
    off = max(0.5 * (width(step) - tick), 0.0)
    if step <= 0.0 or off > OFF_TICK * tick:
        return None
    first = 0.5 * (float(rest.max()) + float(rest.min()) + tick)
    even = first + step * np.arange(exact.size)
    if exact.dtype.kind == "i" and step > 1000.0:
        return EvenStamps(exact[0] + np.rint(even).astype(np.int64), step, tick, off)
    return EvenStamps(exact[0] + even, step, tick, off)


def spread_bursts(stamps: NDArray[Any]) -> EvenStamps | None:
    """Spread samples that are delivered together, by their clock (`tables.sample_clock`).

    None if no stamps repeat, any goes back, or the deliveries scatter by half their interval.
    """
    if stamps.dtype.kind not in "iuf" or stamps.size < FEWEST_STAMPS:
        return None
    exact = differenced(stamps)
    since = filled(len(exact), lambda part: (exact[part] - exact[0]).astype(np.float64))
    least, _ = step_range(since)
    if least < 0.0 or least > 0.0:
        return None
    steps = np.diff(since)
    shared = int(np.count_nonzero(steps == 0.0))
    if not shared:
        return None
    clock = sample_clock(since)
    size = stamps.size / (int(np.count_nonzero(steps > 0.5 * clock.step)) + 1)
    in_bursts = clock.kind == "bursts" and clock.repaired
    if not in_bursts or clock.spread > 0.5 * size * clock.step:
        return None
    whole = exact.dtype.kind == "i" and clock.step > 1000.0
    ticks = exact[0] + (np.rint(clock.time).astype(np.int64) if whole else clock.time)
    return EvenStamps(ticks, clock.step, spread=clock.spread, size=size)


# Time stamps of a log: units, faults and repairs.


# Range of steps of inertial sensors.
PLAUSIBLE_STEP = (1e-5, 0.25)  # s
#: A longer step of a log, also by so many of its least steps, is a corrupt stamp or a clock that
#: was set; more of these, or more time, are not of a clock that was set.
LONGEST_PAUSE, PAUSE_STEPS = 30.0 * 86400.0, 1000.0  # s
MOST_PAUSES, LONGEST_LOG = 3, 100.0 * 365.25 * 86400.0  # s
#: Largest stamp of a clock; nanoseconds since 1970 are 2e18.
MOST_STAMP = 1e20
#: Most successive rows whose stamps are taken for corrupt.
WILD_RUN = 3
#: Ticks of clocks that no name of a unit says.
TICKS = ("10 us", "100 us")
# Later stamps are counted from the first: a double resolves a clock of 1970 to only 0.2 µs.
EPOCH = 1e6  # s


@dataclass(frozen=True)
class Stamps:
    """Stamps in seconds, with findings.

    `seconds` ((n,)). `why`: reason for the unit. `keep` ((n,)): rows that remain when those with
    faulty stamps are dropped. `origin`: the raw stamp at time zero.
    """

    seconds: Array
    unit: str
    why: str
    keep: NDArray[np.bool_]
    origin: Origin
    findings: list[Finding]


def read_stamps(
    raw: NDArray[Any],
    unit: str | None,
    why: str,
    *,
    file: str,
    row: Callable[[int], int],
    repair: bool,
    origin: Origin | None = None,
    only_seconds: bool = False,
) -> Stamps:
    """Turn raw stamps into increasing seconds.

    `raw` ((n,)): finite numbers. `unit`: if known. `why`: source of the unit. `file`: for messages.
    `row`: maps the number of a stamp to its row in the file. `repair`: drop repeated and reversed
    stamps, and unwrap a counter. `origin`: count from here, as another log does; by default from
    zero, or from the first stamp if zero is far away. `only_seconds`: infer no unit other than
    seconds from the numbers. DataError: the unit is not stated and not evident, or time does not
    advance.
    """
    findings: list[Finding] = []
    stamps = differenced(raw)
    if repair and (wild := _wild(stamps)).any():
        good = np.flatnonzero(~wild)
        rest = read_stamps(
            stamps[good],
            unit,
            why,
            file=file,
            row=lambda k: row(int(good[k])),
            repair=repair,
            origin=origin,
            only_seconds=only_seconds,
        )
        return _with_wild(rest, wild, stamps, file, row)
    if stamps.size and not np.abs(stamps[[stamps.argmin(), stamps.argmax()]]).max() <= MOST_STAMP:
        k = int((np.abs(stamps) > MOST_STAMP).argmax())
        raise DataError(
            "io.stamp-impossible", file=file, row=row(k), quantity="time", stamp=stamps[k], count=1
        )
    if unit in (None, "s"):
        whole, weeks = unrolled(stamps.astype(np.float64, copy=False))
        if weeks:
            stamps, unit = whole, "s"
            add_note(
                findings,
                "io.seconds-of-week-unrolled",
                file=file,
                row=row(weeks[0]),
                quantity="time",
            )
    # Exact, before a factor rounds it.
    ticks = filled(len(stamps), lambda part: (stamps[part] - stamps[0]).astype(np.float64))
    let_go(stamps)
    keep = np.ones(ticks.size, dtype=bool)
    if len(ticks) > 1 and step_range(ticks)[0] <= 0.0:
        if not repair:
            raise _backward(stamps, ticks, file, row)
        keep, ticks = _repaired(stamps, ticks, file, findings)
    kept = slice(None) if keep.all() else keep
    if unit is None:
        unit, why = _evident_unit(stamps[kept], file, findings, only_seconds)
    elif (usual := _mean_step(ticks[kept]) * factor_of(unit, TIME_UNITS)) > 0 and not (
        PLAUSIBLE_STEP[0] <= usual <= 4 * PLAUSIBLE_STEP[1]
    ):
        add_warning(
            findings,
            "io.stated-time-unit-implausible",
            file=file,
            quantity="time",
            unit=unit,
            usual=1.0 / usual,
        )
    factor = factor_of(unit, TIME_UNITS)
    first = stamps[0].item()
    if origin is None:
        far = abs(first) * factor > EPOCH
        origin = Origin(first if far else 0, unit)
        if far:
            add_note(
                findings,
                "io.time-from-first-stamp",
                file=file,
                quantity="time",
                first=first,
                unit=unit,
            )
    # Exact if both count whole ticks of one unit.
    if unit == origin.unit:
        since = (first - origin.stamp) * factor
    else:
        since = first * factor - origin.stamp * factor_of(origin.unit, TIME_UNITS)
    seconds = filled(len(ticks), lambda part: since + ticks[part] * factor)
    let_go(ticks)
    # In ordinary logs no pause is longer than the log.
    if np.ptp(seconds) > LONGEST_PAUSE:
        keep = _without_pauses(seconds, keep, repair, file, row, findings)
    return Stamps(seconds, unit, why, keep, origin, findings)


def _wild(stamps: NDArray[Any]) -> NDArray[np.bool_]:
    """Find corrupt stamps: a few rows ahead of more rows that continue what was before them.

    Rows that are swapped or repeated, a counter that wraps and a clock that is set back are not.
    """
    wild = np.abs(stamps.astype(np.float64)) > MOST_STAMP
    if wild.any():
        return wild  # the others are judged without these
    steps = np.diff(stamps).astype(np.float64)
    back = np.flatnonzero(steps < 0)
    usual = usual_step(steps) if back.size else 0.0
    for k in back.tolist():
        if wrap_of(float(stamps[k]), float(steps[k]), usual):
            continue
        first = k
        while first > 0 and k - first < WILD_RUN and stamps[first - 1] > stamps[k + 1]:
            first -= 1
        ahead = k - first + 1
        after = stamps[k + 1 : k + 2 + ahead]
        if ahead <= WILD_RUN and after.size > ahead and (after <= stamps[k]).all():
            wild[first : k + 1] = True
    return wild


def _with_wild(
    rest: Stamps,
    wild: NDArray[np.bool_],
    stamps: NDArray[Any],
    file: str,
    row: Callable[[int], int],
) -> Stamps:
    """Add the rows with corrupt stamps to those of the others; they are not kept."""
    good = np.flatnonzero(~wild)
    keep = np.zeros(wild.size, dtype=bool)
    keep[good] = rest.keep
    nearest = np.minimum(np.searchsorted(good, np.arange(wild.size)), good.size - 1)
    k = int(wild.argmax())
    finding = Finding(
        "io.wild-stamps-left-out",
        file=file,
        row=row(k),
        quantity="time",
        stamp=stamps[k],
        count=int(wild.sum()),
    )
    return dataclasses.replace(
        rest, seconds=rest.seconds[nearest], keep=keep, findings=[finding, *rest.findings]
    )


def _without_pauses(
    seconds: Array,
    keep: NDArray[np.bool_],
    repair: bool,
    file: str,
    row: Callable[[int], int],
    findings: list[Finding],
) -> NDArray[np.bool_]:
    """Keep the longest part of a log between pauses that no recording has.

    DataError: there is such a pause, and rows may not be dropped.
    """
    rows = np.flatnonzero(keep)
    time = seconds[rows]
    steps = np.diff(time)
    least = float(steps.min()) if steps.size > 1 else 0.0
    ends = np.flatnonzero(steps > max(LONGEST_PAUSE, PAUSE_STEPS * least))
    alone = np.minimum(ends + 1, time.size - ends - 1) <= WILD_RUN
    if not (alone.any() or ends.size > MOST_PAUSES or steps[ends].sum() > LONGEST_LOG):
        return keep  # a clock that was set
    k = int(ends[alone][0] if alone.any() else ends[steps[ends].argmax()])
    said = Finding(
        "io.pause-impossible",
        file=file,
        row=row(int(rows[k + 1])),
        quantity="time",
        pause_days=float(steps[k]) / 86400.0,
        pauses=ends.size,
        count=int(min(k + 1, time.size - k - 1)),
    )
    if not repair:
        raise DataError(said)
    edges = np.concatenate([[0], ends + 1, [time.size]])
    longest = int(np.argmax(np.diff(edges)))
    out = np.zeros_like(keep)
    out[rows[edges[longest] : edges[longest + 1]]] = True
    left_out = int(keep.sum() - out.sum())
    findings.append(said.replace(code="io.part-between-pauses-used", count=left_out))
    return out


def _mean_step(ticks: Array) -> float:
    # Logs that arrive in bursts have a median far from the mean step.
    return float((ticks[-1] - ticks[0]) / (ticks.size - 1)) if ticks.size > 1 else 0.0


def _backward(
    stamps: NDArray[Any], ticks: Array, file: str, row: Callable[[int], int]
) -> DataError:
    """Make the error for stamps that do not advance."""
    steps = np.diff(ticks)
    bad = np.flatnonzero(steps <= 0)
    k = int(bad[0])
    here, then = stamps[k], stamps[k + 1]
    where: dict[str, Any] = {"file": file, "row": row(k + 1), "quantity": "time"}
    if steps[k] == 0 and bad.size > COARSE * steps.size:
        counts = np.diff(np.flatnonzero(steps))
        return DataError(
            "io.stamps-of-uneven-bursts",
            **where,
            then=then,
            count=bad.size,
            least=int(counts.min(initial=steps.size)),
            most=int(counts.max(initial=1)),
        )
    if steps[k] == 0:
        return DataError("io.stamp-repeated", **where, then=then, count=bad.size)
    if wrap := wrap_of(stamps[k], steps[k], usual_step(steps)):
        return DataError("io.time-counter-wraps", **where, here=here, then=then, bits=wrap[0])
    lost = int((ticks[1:] <= np.maximum.accumulate(ticks)[:-1]).sum())
    return DataError("io.time-goes-back", **where, here=here, then=then, count=bad.size, lost=lost)


def usual_step(steps: Array) -> float:
    """Return the median of the steps forward; 0 if there is none."""
    forward = steps[steps > 0]
    return float(np.median(forward)) if forward.size else 0.0


def _repaired(
    stamps: NDArray[Any], ticks: Array, file: str, findings: list[Finding]
) -> tuple[NDArray[np.bool_], Array]:
    steps = np.diff(ticks)
    usual = usual_step(steps)
    added = np.zeros(ticks.size)
    for k in np.flatnonzero(steps < 0):
        if wrap := wrap_of(stamps[k], steps[k], usual):
            added[k + 1] = wrap[1]
    if wraps := int(np.count_nonzero(added)):
        ticks = ticks + np.cumsum(added)
        add_note(findings, "io.counter-wrapped-undone", file=file, quantity="time", count=wraps)
    latest = np.maximum.accumulate(np.concatenate([[-np.inf], ticks[:-1]]))
    keep = ticks > latest
    if dropped := int((~keep).sum()):
        back = _set_back(ticks, keep, usual)
        add_warning(
            findings,
            "io.rows-not-later-left-out" if not back else "io.rows-after-step-back-left-out",
            file=file,
            quantity="time",
            severity="warning" if back or dropped > 0.1 * ticks.size else "note",
            count=dropped,
            back=back,
        )
    return keep, ticks


def _set_back(ticks: Array, keep: NDArray[np.bool_], usual: float) -> int:
    """Count how often dropped rows leave no gap, as after a clock that was set back.

    A single wrong stamp leaves one, and a repeated stamp loses no motion.
    """
    kept = np.append(np.flatnonzero(keep), ticks.size)
    count = 0
    for a, b in zip(kept[:-1][np.diff(kept) > 1], kept[1:][np.diff(kept) > 1], strict=True):
        over = b < ticks.size and ticks[b] - ticks[a] >= 0.5 * (b - a) * usual
        count += bool((np.diff(ticks[a:b]) < 0).any() and not over)
    return count


def _evident_unit(
    stamps: NDArray[Any], file: str, findings: list[Finding], only_seconds: bool
) -> tuple[str, str]:
    said = infer_time_unit(stamps)
    if said.settled and (said.value == "s" or not only_seconds):
        unit = str(said.value)
        if unit != "s":
            findings.append(said.finding("io.time-unit-inferred", file=file, quantity="time"))
        return unit, str(said)
    usual = _mean_step((stamps - stamps[0]).astype(np.float64))
    shares = {str(v): p for v, p in ((said.value, said.confidence), *said.alternatives) if v}
    choices = [
        Finding(
            "io.choice-of-time-unit",
            severity="note",
            unit=u,
            rate_hz=1.0 / (usual * factor_of(u, TIME_UNITS)),
            share=p,
        )
        for u, p in shares.items()
        if p >= 1e-3 and usual > 0
    ]
    choices += [  # of counters of microcontrollers and of makers, at a rate that sensors have
        Finding("io.choice-of-ticks", severity="note", unit=u, rate_hz=rate)
        for u in (*TICKS, "s/32768")
        if usual > 0 and 5.0 <= (rate := 1.0 / (usual * factor_of(u, TIME_UNITS))) <= 2e3
    ]
    if is_count(stamps):
        choices.append(Finding("io.choice-of-count", severity="note"))
    raise DataError(
        "io.time-unit-undecided" if choices else "io.time-unit-of-no-step",
        file=file,
        quantity="time",
        step=usual,
        threshold=THRESHOLD,
        choices=choices,
    )
