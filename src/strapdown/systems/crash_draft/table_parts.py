"""Find the triads of a table of unknown layout and their clock, from its headings."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from strapdown.constants import TIME_UNITS
from strapdown.errors import DataError
from strapdown.formats.clocks import EPOCH
from strapdown.formats.crash_record import CrashChannel, CrashRecord, factor_of
from strapdown.formats.crash_samples import last_midnight
from strapdown.formats.inference.conclusion import THRESHOLD, infer_time_unit, mean_step
from strapdown.systems.crash_draft.header_words import Heading, read_heading
from strapdown.systems.crash_draft.parts import Clock, Part, Skipped
from strapdown.systems.crash_draft.triad_kind import pulse_samples

__all__ = [
    "LEAST_SAMPLES",
    "Group",
    "evenly",
    "find_clock",
    "group_columns",
    "likely_rate",
    "stated_rate",
    "table_parts",
]


Array = NDArray[np.float64]

#: A crash of a tenth of a second, at the slowest useful rate.
LEAST_SAMPLES = 8
# Ticks beyond this are counted from the first before conversion to floats.
FAR = 2.0**40
# The reader's name for a column without a heading.
_NUMBERED = re.compile(r"column \d+")
_KINDS = ("acceleration", "rate", "velocity", "time")


@dataclass(frozen=True)
class _Table:
    columns: Mapping[str, Array]
    headings: Mapping[str, Heading]
    origins: Mapping[str, float]


def table_parts(path: str, record: CrashRecord) -> tuple[list[Part], list[Skipped]]:
    """Find the triads of a table.

    Parameters
    ----------
    path : str
        As in the case.
    record : CrashRecord
        With columns as channels.

    Returns
    -------
    parts : list of Part
        Values as recorded; kind and unit as far as the headings state them.
    skipped : list of Skipped

    Raises
    ------
    DataError
        Fewer than eight samples, time that does not advance, or an invalid sensor value.
    """
    table, skipped = _columns(path, record)
    rows = max((len(v) for v in table.columns.values()), default=0)
    if rows < LEAST_SAMPLES:
        raise DataError(
            "crash.one-sample" if rows == 1 else "crash.too-few-samples",
            file=record.path.name,
            rows=rows,
            least_samples=LEAST_SAMPLES,
        )
    clock, time = find_clock(table.columns, table.headings)
    if time is None:
        whole = np.column_stack([v for v in table.columns.values() if np.isfinite(v).all()])
        said = stated_rate(record.remarks)
        clock = (
            replace(
                clock,
                unit="s",
                rate=said[0],
                stated=True,
                why=f"stated above the table: '{said[1]}'",
            )
            if said
            else replace(clock, rate=likely_rate(whole))
        )
        stamps = np.arange(rows, dtype=np.float64) / clock.rate
    else:
        _check_advances(record.channel(clock.column), table.columns[clock.column])
        factor = 1.0 / (clock.rate * clock.step)
        origin = table.origins.get(clock.column, 0.0) * factor
        # As the case reader does: a clock with a distant origin counts from midnight.
        raw = table.origins.get(clock.column, 0.0) + float(table.columns[clock.column][0])
        far = abs(origin + time[0]) > EPOCH
        stamps = (
            time - time[0] + (raw - last_midnight(raw, factor)) * factor if far else time + origin
        )
        clock, stamps = evenly(clock, stamps)
    others = {n: v for n, v in table.columns.items() if n != clock.column}
    groups, left = group_columns(others, table.headings)
    skipped += [Skipped(path, f"column '{name}'", why, (name,)) for name, why in left]
    parts = []
    for group in groups:
        values, channels = np.full((rows, 3), np.nan), {}
        has = [k for k, axis in enumerate("xyz") if axis in group.columns]
        for k in has:
            name = group.columns["xyz"[k]]
            turned = table.headings[name].reversed
            values[:, k] = -table.columns[name] if turned else table.columns[name]
            channels["xyz"[k]] = f"-{name}" if turned else name
        kept = np.isfinite(values[:, has]).all(axis=1)
        lost = rows - int(kept.sum())
        names = tuple(group.columns.values())
        if rows - lost < LEAST_SAMPLES:
            skipped.append(Skipped(path, ", ".join(names), "hardly a row of it is whole", names))
            continue
        if not np.ptp(values[kept][:, has], axis=0).any():
            skipped.append(Skipped(path, ", ".join(names), "they are constant", names))
            continue
        part = Part(
            path,
            group.quantity,
            channels,
            clock,
            group.unit,
            "axes by the headings" if group.by_heading else "axes in the order of the columns",
            stamps[kept],
            values[kept],
            label=group.label,
            named=group.by_heading,
            notes=(f"{lost} of {rows} rows have no value of it",) if lost else (),
            remarks=record.remarks,
        )
        parts.append(replace(part, sampling=_sampling(record, group.columns.values())))
    return parts, skipped


def _check_advances(channel: CrashChannel, stamps: Array) -> None:
    back = np.flatnonzero(np.diff(stamps) <= 0.0)
    if not back.size:
        return
    k = int(back[0]) + 1
    stays = stamps[k] == stamps[k - 1]
    raise DataError(
        f"crash.time-{'stays' if stays else 'goes-back'}{'' if back.size == 1 else '-often'}",
        file=channel.file or None,
        row=channel.row(k),
        quantity=f"time ({channel.name})",
        before=stamps[k - 1],
        time=stamps[k],
        count=back.size,
    )


def _sampling(record: CrashRecord, names: object) -> str:
    kinds = {c.sampling for c in record.channels if c.name in set(names)}  # type: ignore[call-overload]
    only = kinds.pop() if len(kinds) == 1 else None
    return only or ""


def _columns(path: str, record: CrashRecord) -> tuple[_Table, list[Skipped]]:
    """Columns as recorded, without unreadable ones, which are listed with the reason."""
    columns: dict[str, Array] = {}
    headings: dict[str, Heading] = {}
    origins: dict[str, float] = {}
    skipped: list[Skipped] = []
    for channel in record.channels:
        try:
            raw = channel.samples() if channel.samples is not None else channel.load()[1]
        except DataError as error:
            if _heading(channel).quantity in _KINDS:
                raise
            skipped.append(
                Skipped(path, f"column '{channel.name}'", error.finding, (channel.name,))
            )
            continue
        headings[channel.name] = _heading(channel)
        if raw.dtype.kind in "iu" and raw.size and abs(int(raw[0])) > FAR:
            origins[channel.name] = float(raw[0])
            raw = raw.astype(np.int64) - np.int64(raw[0])
        values = raw.astype(np.float64)
        factor = factor_of(channel.quantity, channel.unit)
        if factor is not None and channel.quantity != "time":
            values = values / factor
        columns[channel.name] = values
    return _Table(columns, headings, origins), skipped


def _heading(channel: CrashChannel) -> Heading:
    """Meaning of a heading: the reader's where it finds a unit, else by other languages."""
    if _NUMBERED.fullmatch(channel.name) and not channel.unit:
        return Heading("", "", "", "")
    own = read_heading(channel.name)
    axis, turned = channel.axis.lstrip("-"), channel.axis.startswith("-")
    if axis:
        own = replace(own, axis=axis, reversed=turned)
    if channel.quantity in _KINDS and (channel.unit or not own.quantity):
        # A lone g means acceleration to some makers, gyro to others.
        if channel.unit or own.stem != "g":
            own = replace(own, quantity=channel.quantity, unit=channel.unit)
    elif channel.quantity in ("displacement", "force"):
        own = replace(own, quantity="other")
    return own


# Grouping of a table's columns into triads.


# A sensor's largest deviation in a crash exceeds this many of its usual steps; a temperature's mean
# is far from zero relative to its spread, a sensor's is not.
FEELS, TABLE_TRIADS_FAR = 6.0, 10.0


@dataclass(frozen=True)
class Group:
    """Columns of one triad.

    Attributes
    ----------
    columns : dict of str to str
        Axis to column.
    quantity : str
        ``acceleration``, ``rate``, ``velocity``, or empty where the headings do not state it.
    unit : str
        Of the headings; empty where they do not state it.
    by_heading : bool
        Whether the headings state the axes.
    label : str
        Distinguishes the triad from others.
    """

    columns: dict[str, str]
    quantity: str
    unit: str
    by_heading: bool
    label: str


def group_columns(
    columns: Mapping[str, Array], headings: Mapping[str, Heading]
) -> tuple[list[Group], list[tuple[str, str]]]:
    """Group columns into triads.

    Parameters
    ----------
    columns : dict of str to ndarray
        Without the clock, in file order.
    headings : dict of str to Heading

    Returns
    -------
    groups : list of Group
    left : list of (str, str)
        Ungrouped columns, with reasons.
    """
    left: list[tuple[str, str]] = []
    open_: dict[str, Array] = {}
    for name, values in columns.items():
        quantity = headings[name].quantity
        if quantity in ("other", "time", "counter"):
            what = {
                "time": "a second clock, or one that goes back",
                "counter": "a count of samples",
            }
            left.append((name, what.get(quantity, "its heading names something else")))
        elif not np.isfinite(values).any():
            left.append((name, "it is empty"))
        elif np.ptp(values[np.isfinite(values)]) == 0.0 and not headings[name].axis:
            left.append((name, "it is constant"))
        else:
            open_[name] = values
    groups, rest = _by_heading(open_, headings)
    more, dropped = _by_order(rest, headings)
    order = {name: k for k, name in enumerate(columns)}
    groups = sorted([*groups, *more], key=lambda g: min(order[c] for c in g.columns.values()))
    return groups, [*left, *dropped]


def _by_heading(
    columns: Mapping[str, Array], headings: Mapping[str, Heading]
) -> tuple[list[Group], dict[str, Array]]:
    found: dict[tuple[str, str], dict[str, str]] = {}
    spoiled: set[tuple[str, str]] = set()
    for name in columns:
        said = headings[name]
        if not said.axis:
            continue
        # Roll, pitch and yaw form one triad, though their stems differ.
        key = (said.quantity, said.stem)
        axes = found.setdefault(key, {})
        if said.axis in axes:
            spoiled.add(key)
        axes[said.axis] = name
    groups: list[Group] = []
    rest = dict(columns)
    for key, axes in found.items():
        quantity, stem = key
        # A lone letter that its neighbors show not to be an axis is left to the numbers.
        if key in spoiled or (len(axes) < 2 and not quantity):
            continue
        units = {headings[c].unit for c in axes.values()} - {""}
        if len(units) > 1:
            continue
        ordered = {a: axes[a] for a in "xyz" if a in axes}
        groups.append(Group(ordered, quantity, next(iter(units), ""), True, stem))
        for column in axes.values():
            rest.pop(column)
    return _joined(groups, headings), rest


def _joined(groups: list[Group], headings: Mapping[str, Heading]) -> list[Group]:
    """Join single channels of one quantity with different axes into a triad."""
    out: list[Group] = []
    for group in groups:
        mate = next(
            (
                k
                for k, other in enumerate(out)
                if len(group.columns) == 1
                and other.quantity == group.quantity
                and other.unit == group.unit
                and not set(other.columns) & set(group.columns)
            ),
            None,
        )
        if mate is None:
            out.append(group)
            continue
        other = out[mate]
        both = {**other.columns, **group.columns}
        ordered = {a: both[a] for a in "xyz" if a in both}
        out[mate] = Group(ordered, group.quantity, group.unit, True, other.label)
    return out


def _by_order(
    columns: Mapping[str, Array], headings: Mapping[str, Heading]
) -> tuple[list[Group], list[tuple[str, str]]]:
    """Triads of adjacent columns; of surplus columns, those with the least motion are dropped."""
    names = list(columns)
    dropped: list[tuple[str, str]] = []
    dull = [n for n in names if not headings[n].quantity and _is_dull(columns[n])]
    while len(names) % 3 and dull:
        name = dull.pop()
        names.remove(name)
        dropped.append((name, "nothing happens in it when the others feel the crash"))
    groups: list[Group] = []
    for run in _runs(names, headings):
        for k in range(0, len(run) - len(run) % 3, 3):
            three = run[k : k + 3]
            said = headings[three[0]]
            groups.append(
                Group(
                    dict(zip("xyz", three, strict=True)),
                    said.quantity,
                    said.unit,
                    False,
                    said.stem.rstrip("0123456789 "),
                )
            )
        over = run[len(run) - len(run) % 3 :]
        if over and headings[over[0]].quantity:
            axes = dict(zip("xyz", over, strict=False))
            said = headings[over[0]]
            groups.append(Group(axes, said.quantity, said.unit, False, said.stem))
        else:
            dropped += [(n, "it makes no three with its neighbours") for n in over]
    return groups, dropped


def _runs(names: Sequence[str], headings: Mapping[str, Heading]) -> list[list[str]]:
    """Adjacent columns of one quantity and unit, as far as the headings state them."""
    runs: list[list[str]] = []
    for name in names:
        said = headings[name]
        before = headings[runs[-1][-1]] if runs else None
        if before and (before.quantity, before.unit) == (said.quantity, said.unit):
            runs[-1].append(name)
        else:
            runs.append([name])
    return runs


def _is_dull(values: Array) -> bool:
    kept = values[np.isfinite(values)]
    spread = float(kept.std())
    if spread == 0.0:
        return True
    steps = np.abs(np.diff(kept))
    nonzero = steps[steps > 0.0]
    usual = max(float(np.median(steps)), float(nonzero.min(initial=np.inf)))
    if not np.isfinite(usual):
        return True
    return (
        float(steps.max()) < FEELS * usual and abs(float(kept.mean())) > TABLE_TRIADS_FAR * spread
    )


# The time column of a table of unknown layout, and its unit.


RATES = (50.0, 100.0, 200.0, 400.0, 500.0, 1000.0, 2000.0, 5000.0, 10_000.0, 20_000.0)
# Typical duration of four fifths of the power of a frontal impact, s.
USUAL_PULSE = 0.06

# Limits for even steps: spread of the steps relative to their mean; spread of the stamps about the
# line through both end points, relative to that of the steps, as rounding moves both ends of the
# line; spread of rounded steps relative to their mean.
EVEN, ROUNDED, STEP = 0.01, 2.0, 1.05
# Clock steps stay within this of their median, except for at most this share of them.
REGULAR, IRREGULAR_PART = 0.5, 0.05
# Sampling rates of crash records; a column outside them is a sum, not a clock.
SLOWEST, FASTEST = 5.0, 200_000.0  # Hz


def find_clock(
    columns: Mapping[str, Array], headings: Mapping[str, Heading]
) -> tuple[Clock, Array | None]:
    """Find the time column.

    Parameters
    ----------
    columns : dict of str to ndarray, (n,)
        Numeric columns, in file order.
    headings : dict of str to Heading

    Returns
    -------
    clock : Clock
        `column` is empty where there is none.
    time : ndarray, (n,), s, or None
        In the likeliest unit.

    Notes
    -----
    A clock column increases in nearly equal steps. A column named as a clock has priority; of the
    others one that does not count samples, then the first. A column that increases by one counts
    samples, or milliseconds at 1 kHz: only its name can decide.
    """
    growing = [name for name, values in columns.items() if _grows(values)]
    named = [name for name in growing if headings[name].quantity == "time"]
    plain = [name for name in growing if headings[name].quantity == ""]
    steady = [name for name in plain if not _counts(columns[name])]
    counts = [name for name in plain if _counts(columns[name])]
    for names, why in (
        (named, "by its heading"),
        (steady, "it grows in equal steps"),
        (counts, "it grows in steps of one"),
    ):
        if not names:
            continue
        # A clock with a stated unit has priority.
        name = next((n for n in names if headings[n].unit in TIME_UNITS), names[0])
        return _clock(name, columns[name], headings[name], why)
    return Clock("", "", "no column grows in equal steps", math.nan, math.nan), None


def likely_rate(values: Array) -> float:
    """Likeliest sampling rate of numbers without time, by the usual duration of a pulse.

    Parameters
    ----------
    values : ndarray, (n, k)
    """
    samples = pulse_samples(values)
    return min(RATES, key=lambda rate: abs(math.log(max(samples, 1) / rate / USUAL_PULSE)))


def _clock(name: str, values: Array, heading: Heading, why: str) -> tuple[Clock, Array]:
    step = mean_step(values)
    if heading.unit in TIME_UNITS:
        factor = TIME_UNITS[heading.unit]
        rate = 1.0 / (step * factor)
        # Dates and times of day are read in ns, a unit that the heading does not name.
        names_it = heading.unit != "ns" or "ns" in name.lower() or "nano" in name.lower()
        how = f"{why}, which names the unit" if names_it else f"{why}; a time of day, read in ns"
        return Clock(name, heading.unit, how, step, rate), values * factor
    said = infer_time_unit(_whole(values))
    shares = {str(v): p for v, p in ((said.value, said.confidence), *said.alternatives) if v}
    within = {u: p for u, p in shares.items() if SLOWEST <= 1.0 / (step * TIME_UNITS[u]) <= FASTEST}
    # A step of one is a sample count as often as a millisecond.
    total = sum(within.values()) + (1.0 if _counts(values) and heading.quantity != "time" else 0.0)
    best = max(within, key=lambda u: within[u], default="s")
    rate = 1.0 / (step * TIME_UNITS[best])
    told = f"{why}; a step of {step:.6g} {best} is {rate:.5g} samples a second"
    if within and within[best] >= THRESHOLD * total:
        return Clock(name, best, told, step, rate), values * TIME_UNITS[best]
    kinds = [
        f'"{u}" makes {1.0 / (step * TIME_UNITS[u]):.5g} samples a second' for u in within or ("s",)
    ]
    if _counts(values):
        kinds.append(
            "if it counts samples, delete `time` and `time_unit` and write `rate_hz` instead"
        )
    return Clock(name, "", why, step, rate, "; ".join(kinds)), values * TIME_UNITS[best]


def evenly(clock: Clock, time: Array) -> tuple[Clock, Array]:
    """Make rounded or late stamps even; return others unchanged.

    Parameters
    ----------
    clock : Clock
    time : ndarray, (n,), s

    Returns
    -------
    clock : Clock
        With `stated` where the case must state the rate.
    time : ndarray, (n,), s

    Notes
    -----
    The stamps of an even clock rounded to q stay within q of it, and their steps differ by q.
    Several missing samples bend the line by more.
    """
    count = np.arange(time.size)
    steps = np.diff(time)
    mean = float((time[-1] - time[0]) / max(time.size - 1, 1))
    spread = float(np.ptp(steps)) if steps.size else 0.0
    if not clock.unit or spread <= EVEN * mean:
        return clock, time
    off = time - time[0] - count * mean
    if float(np.ptp(off)) > ROUNDED * spread or spread > STEP * mean:
        return clock, time
    told = f"its stamps are rounded: evenly spaced within {1e3 * float(np.ptp(off)):.2g} ms"
    even = replace(clock, rate=1.0 / mean, stated=True, why=f"{clock.why}; {told}", rate_why=told)
    return even, time[0] + count * mean


def _whole(values: Array) -> NDArray[np.float64] | NDArray[np.int64]:
    """Convert whole numbers to integers, for clocks that count ticks."""
    whole = np.round(values)
    if np.array_equal(whole, values) and np.abs(values).max(initial=0.0) < 2.0**53:
        return whole.astype(np.int64)
    return values


def _counts(values: Array) -> bool:
    return bool(np.all(np.diff(values) == 1.0))


def _grows(values: Array) -> bool:
    if values.size < 2 or not np.isfinite(values).all():
        return False
    steps = np.diff(values)
    usual = float(np.median(steps))
    if usual <= 0.0 or np.count_nonzero(steps <= 0.0) > IRREGULAR_PART * steps.size:
        return False
    off = np.count_nonzero(np.abs(steps - usual) > REGULAR * usual)
    return bool(off <= max(IRREGULAR_PART * steps.size, 0 if steps.size < 20 else 1))


# Sampling rate of a record without time, where a line above its table states one.


_RATE = re.compile(
    r"(?<![\w.,])(\d+(?:[.,]\d+)?)\s*(k?)\s*(?:hz|sps|s/s|samples?\s*(?:/|per)\s*s)", re.I
)
# The limit of a filter is in Hz, too.
_OTHER = re.compile(
    r"filter|cfc|band ?width|bandbreite|cut.?off|grenzfrequenz|low.?pass|tiefpass", re.I
)


def stated_rate(remarks: Sequence[str]) -> tuple[float, str] | None:
    """Find the sampling rate stated in the lines above a table.

    Parameters
    ----------
    remarks : sequence of str

    Returns
    -------
    (rate, line) or None
        In Hz; None where no line states one, or two state different ones.
    """
    found: dict[float, str] = {}
    for line in remarks:
        if _OTHER.search(line):
            continue
        for said in _RATE.finditer(line):
            # A comma before three digits separates thousands in some countries, decimals in others.
            if re.fullmatch(r"\d+[.,]\d{3}", said[1]):
                return None
            rate = float(said[1].replace(",", ".")) * (1000.0 if said[2] else 1.0)
            if SLOWEST <= rate <= FASTEST:
                found.setdefault(rate, line)
    return next(iter(found.items())) if len(found) == 1 else None
