"""Triads of channels in crash records: axes, clock, kind and unit, from headings and numbers."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from strapdown.constants import STANDARD_GRAVITY
from strapdown.errors import ConfigError, DataError, Finding
from strapdown.formats.aid_table import read_aid_table, read_reference_path
from strapdown.formats.clocks import EPOCH
from strapdown.formats.columns import parse_axes, read_name, split_brackets
from strapdown.formats.crash_edr import KMH, rounding
from strapdown.formats.crash_record import (
    CrashChannel,
    CrashRecord,
    position_of,
    refuse_impossible,
)
from strapdown.formats.crash_samples import (
    last_midnight,
    mean_accelerations_of,
    means_from_zero,
    past_midnight,
)
from strapdown.formats.inference.conclusion import (
    THRESHOLD,
    Steps,
    infer_accel,
    infer_time_unit,
    posterior,
)
from strapdown.formats.inference.rotation_rate import infer_gyro
from strapdown.formats.triad_units import mirrored
from strapdown.formats.vocabularies import AXIS_WORDS, CRASHES, without_accents
from strapdown.sensors.saturation import find_limits
from strapdown.tables.checks import Array
from strapdown.units import (
    ACCEL_UNITS,
    FACTORS,
    GYRO_UNITS,
    INFERRED,
    SPEEDS,
    TIME_UNITS,
    find_unit,
)

Left = list[tuple[str, str]]


@dataclass(frozen=True)
class Clock:
    """Time base of a part.

    `column` is empty without one, `unit` where not settled: `candidates` then names the possible
    ones; `step`, in the clock's own unit, NaN without time; `rate`, Hz, in the likeliest unit, with
    the evidence `rate_why` for rounded stamps; `stated`: the case must state the rate.
    """

    column: str
    unit: str
    why: str
    step: float
    rate: float
    candidates: str = ""
    stated: bool = False
    rate_why: str = ""


@dataclass(frozen=True, eq=False)
class Part:
    """Triad of channels, possibly incomplete.

    `path` as in the case; `kind` is ``acceleration``, ``rate`` or ``velocity`` (delta-V of event
    data recorders); `channels`: axis to name, without missing axes; `unit` is empty where not
    settled, with `candidates`, and `unit_why` is its evidence; `time`, (n,), s, and `values`, (n,
    3), SI, by the likeliest units, NaN for missing axes; `label` distinguishes triads of one
    record; `zeroed`: gravity at rest has been subtracted; `named`: the record names the axes;
    `of_vehicle`: why they are the vehicle's, where the record defines them so, else empty;
    `axes_stated`: where a person says that they point, as `parse_axes` takes it, empty without;
    `uncertainty`: error model by keys of the sensor catalogue, with its grounds `basis`;
    `velocities`: the channels of delta-V of which the accelerations are means; `vehicle` and
    `point` as of `CrashChannel`.
    """

    path: str
    kind: str
    channels: dict[str, str]
    clock: Clock
    unit: str
    why: str
    time: Array
    values: Array
    candidates: str = ""
    label: str = ""
    unit_why: tuple[str, ...] = ()
    zeroed: bool = False
    sampling: str = ""
    named: bool = False
    of_vehicle: str = ""
    axes_stated: str = ""
    place: str = ""
    uncertainty: Mapping[str, float] = field(default_factory=dict)
    basis: str = ""
    notes: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()
    velocities: tuple[CrashChannel, ...] = ()
    vehicle: str = ""
    point: str = ""

    @property
    def axes(self) -> list[int]:
        """The available axes."""
        return [k for k, axis in enumerate("xyz") if axis in self.channels]

    @property
    def free(self) -> Array:
        """Values minus the median of each axis, (n, 3); zero along missing axes."""
        out, has = np.zeros_like(self.values), self.axes
        out[:, has] = self.values[:, has] - np.median(self.values[:, has], axis=0)
        return out

    @property
    def step(self) -> float:
        """Median step, s; zero for a single sample."""
        return float(np.median(np.diff(self.time))) if self.time.size > 1 else 0.0


@dataclass(frozen=True)
class Skipped:
    """Unused part of a record, with the reason; `vehicle` as of `CrashChannel`, empty of none."""

    path: str
    what: str
    reason: str | Finding
    names: tuple[str, ...] = ()
    vehicle: str = ""

    @property
    def why(self) -> str:
        """The reason in words, with its row."""
        if isinstance(self.reason, str):
            return self.reason
        row = "" if self.reason.row is None else f" in row {self.reason.row}"
        return f"{self.reason.sentence('file')}{row}"


# Triads of a table.


class Heading(NamedTuple):
    """Meaning of a column heading; empty where not stated.

    `quantity` is ``time``, ``counter``, ``acceleration``, ``rate``, ``velocity`` or ``other``;
    `stem` is the heading without axis and unit, which channels of one triad share; `reversed`: the
    axis points left, rearward or up.
    """

    quantity: str
    axis: str
    unit: str
    stem: str
    reversed: bool = False


#: A crash of a tenth of a second, at the slowest useful rate.
LEAST_SAMPLES = 8
# Ticks beyond this are counted from the first before conversion to floats.
FAR = 2.0**40
# The reader's name for a column without a heading.
_NUMBERED = re.compile(r"column \d+")
_KINDS = ("acceleration", "rate", "velocity", "time")
# A sensor's largest deviation in a crash exceeds this many of its usual steps; a temperature's mean
# is far from zero relative to its spread, a sensor's is not.
FEELS, FAR_MEAN = 6.0, 10.0


class Group(NamedTuple):
    """Columns of one triad by axis, with what their headings state."""

    columns: dict[str, str]
    quantity: str
    unit: str
    by_heading: bool
    label: str


def table_parts(path: str, record: CrashRecord) -> tuple[list[Part], list[Skipped]]:
    """Find the triads of a table: values as recorded, kind and unit as far as headings state them.

    `path` as in the case. `DataError`: fewer than eight samples, time that does not advance, or an
    invalid sensor value.
    """
    columns: dict[str, Array] = {}
    headings: dict[str, Heading] = {}
    origins: dict[str, float] = {}
    skipped: list[Skipped] = []
    for channel in record.channels:
        heading, name = _heading(channel), channel.name
        try:
            raw = channel.samples() if channel.samples is not None else channel.load()[1]
        except DataError as error:
            if heading.quantity in _KINDS:
                raise
            skipped.append(Skipped(path, f"column '{name}'", error.finding, (name,)))
            continue
        headings[name] = heading
        if channel.quantity in ("acceleration", "rate"):
            refuse_impossible(channel, raw)
        if heading.quantity == "time":
            raw = past_midnight(raw, heading.unit if heading.unit in TIME_UNITS else "")
        if raw.dtype.kind in "iu" and raw.size and abs(int(raw[0])) > FAR:
            origins[name] = float(raw[0])
            raw = raw.astype(np.int64) - np.int64(raw[0])
        factor = FACTORS.get(channel.quantity, {}).get(channel.unit)
        columns[name] = raw.astype(np.float64)
        if factor is not None and channel.quantity != "time":
            columns[name] /= factor
    rows = max((len(v) for v in columns.values()), default=0)
    if rows < LEAST_SAMPLES:
        raise DataError(
            "crash.one-sample" if rows == 1 else "crash.too-few-samples",
            file=record.path.name,
            rows=rows,
            least_samples=LEAST_SAMPLES,
        )
    clock, stamps = _stamps(record, columns, headings, origins, rows)
    others = {n: v for n, v in columns.items() if n != clock.column}
    groups, left = group_columns(others, headings)
    skipped += [Skipped(path, f"column '{name}'", why, (name,)) for name, why in left]
    parts = []
    for group in groups:
        values, channels = np.full((rows, 3), np.nan), {}
        has = ["xyz".index(axis) for axis in group.columns]
        for axis, name in group.columns.items():
            turned = headings[name].reversed
            values[:, "xyz".index(axis)] = -columns[name] if turned else columns[name]
            channels[axis] = f"-{name}" if turned else name
        kept = np.isfinite(values[:, has]).all(axis=1)
        lost = rows - int(kept.sum())
        names = tuple(group.columns.values())
        if rows - lost < LEAST_SAMPLES:
            skipped.append(Skipped(path, ", ".join(names), "hardly any complete row", names))
            continue
        if not np.ptp(values[kept][:, has], axis=0).any():
            skipped.append(Skipped(path, ", ".join(names), "they are constant", names))
            continue
        members = tuple(record.channel(name) for name in names)
        kinds = {c.sampling for c in members}
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
            of_vehicle=_of_vehicle(group),
            sampling=(kinds.pop() or "") if len(kinds) == 1 else "",
            notes=(f"{lost} of {rows} rows have no value",) if lost else (),
            remarks=record.remarks,
            velocities=members if group.quantity == "velocity" else (),
        )
        parts.append(part)
    return parts, skipped


def _of_vehicle(group: Group) -> str:
    """Why the axes of a group are the vehicle's: all headings name directions, not letters."""
    for axis, name in group.columns.items():
        words = re.findall(r"[^\W\d_]+", without_accents(split_brackets(name)[0].lower()))
        known = tuple(w for w, of in AXIS_WORDS.items() if of.endswith(axis) and len(w) > 1)
        if not any(word.startswith(known) for word in words):
            return ""
    return "its headings name directions of the vehicle" if group.by_heading else ""


def _stamps(
    record: CrashRecord,
    columns: Mapping[str, Array],
    headings: Mapping[str, Heading],
    origins: Mapping[str, float],
    rows: int,
) -> tuple[Clock, Array]:
    """Clock and time of a table, s; without a column by the stated or the likeliest rate."""
    clock, time = find_clock(columns, headings)
    if time is None:
        stated = stated_rate(record.remarks)
        if stated:
            why = f"stated above the table: '{stated[1]}'"
            clock = replace(clock, unit="s", rate=stated[0], stated=True, why=why)
        else:
            whole = np.column_stack([v for v in columns.values() if np.isfinite(v).all()])
            clock = replace(clock, rate=likely_rate(whole))
        return clock, np.arange(rows, dtype=np.float64) / clock.rate
    own = columns[clock.column]
    coarse = coarse_rate(own)
    if coarse is None:
        _check_advances(record.channel(clock.column), own)
    factor = 1.0 / (clock.rate * clock.step)
    origin = origins.get(clock.column, 0.0)
    # As the case reader does: a clock with a distant origin counts from midnight.
    if abs(origin * factor + time[0]) > EPOCH:
        raw = origin + float(own[0])
        start = (raw - last_midnight(raw, factor)) * factor
        return evenly(clock, time - time[0] + start)
    return evenly(clock, time + origin * factor)


def _check_advances(channel: CrashChannel, stamps: Array) -> None:
    back = np.flatnonzero(np.diff(stamps) <= 0.0)
    if back.size:
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


def _heading(channel: CrashChannel) -> Heading:
    """Meaning of a heading: the reader's where it finds a unit, else by other languages."""
    if _NUMBERED.fullmatch(channel.name) and not channel.unit:
        return Heading("", "", "", "")
    said = read_name(channel.name, CRASHES)
    unit = said.unit if said.unit and find_unit(said.unit, tuple(FACTORS)) else ""
    quantity, axis = said.quantity or "", channel.axis or said.axis
    if not quantity and unit in TIME_UNITS:
        quantity = "time"
    # A lone g means acceleration to some makers, gyro to others.
    if channel.quantity in _KINDS and (channel.unit or (not quantity and said.family != "g")):
        quantity, unit = channel.quantity, channel.unit
    elif channel.quantity in ("displacement", "force"):
        quantity = "other"
    return Heading(quantity, axis.lstrip("-"), unit, said.family, axis.startswith("-"))


def group_columns(
    columns: Mapping[str, Array], headings: Mapping[str, Heading]
) -> tuple[list[Group], Left]:
    """Group columns in file order, without the clock, into triads; and those left, with reasons."""
    left: Left = []
    open_: dict[str, Array] = {}
    for name, values in columns.items():
        quantity, finite = headings[name].quantity, values[np.isfinite(values)]
        if quantity == "time":
            left.append((name, "a second clock, or one that goes back"))
        elif quantity == "counter":
            left.append((name, "a count of samples"))
        elif quantity == "other":
            left.append((name, "its heading names something else"))
        elif not finite.size:
            left.append((name, "it is empty"))
        elif np.ptp(finite) == 0.0 and not headings[name].axis:
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
    # Roll, pitch and yaw form one triad, though their stems differ.
    found: dict[tuple[str, str], dict[str, str]] = {}
    spoiled: set[tuple[str, str]] = set()
    for name in columns:
        said = headings[name]
        if said.axis:
            axes = found.setdefault((said.quantity, said.stem), {})
            if said.axis in axes:
                spoiled.add((said.quantity, said.stem))
            axes[said.axis] = name
    groups: list[Group] = []
    rest = dict(columns)
    for (quantity, stem), axes in found.items():
        units = {headings[c].unit for c in axes.values()} - {""}
        # A lone letter that its neighbors show not to be an axis is left to the numbers.
        alone = len(axes) < 2 and not quantity
        if (quantity, stem) in spoiled or alone or len(units) > 1:
            continue
        group = Group(axes, quantity, next(iter(units), ""), True, stem)
        for column in axes.values():
            rest.pop(column)
        # Single channels of one quantity with different axes join into a triad.
        mate = next((k for k, other in enumerate(groups) if _joins(other, group)), None)
        if mate is None:
            groups.append(group)
        else:
            other = groups[mate]
            groups[mate] = other._replace(columns={**other.columns, **group.columns})
    ordered = ({a: g.columns[a] for a in "xyz" if a in g.columns} for g in groups)
    return [g._replace(columns=c) for g, c in zip(groups, ordered, strict=True)], rest


def _joins(other: Group, group: Group) -> bool:
    same = (other.quantity, other.unit) == (group.quantity, group.unit)
    return len(group.columns) == 1 and same and not set(other.columns) & set(group.columns)


def _by_order(
    columns: Mapping[str, Array], headings: Mapping[str, Heading]
) -> tuple[list[Group], Left]:
    """Triads of adjacent columns; of surplus columns, those with the least motion are dropped."""
    names = list(columns)
    dropped: Left = []
    dull = [n for n in names if not headings[n].quantity and _is_dull(columns[n])]
    while len(names) % 3 and dull:
        name = dull.pop()
        names.remove(name)
        dropped.append((name, "nothing happens in it when the others feel the crash"))
    runs: list[list[str]] = []
    for name in names:
        said = headings[name]
        before = headings[runs[-1][-1]] if runs else None
        if before and (before.quantity, before.unit) == (said.quantity, said.unit):
            runs[-1].append(name)
        else:
            runs.append([name])
    groups: list[Group] = []
    for run in runs:
        for k in range(0, len(run), 3):
            three = run[k : k + 3]
            said = headings[three[0]]
            if len(three) < 3 and not said.quantity:
                dropped += [(n, "it makes no three with its neighbours") for n in three]
                continue
            label = said.stem.rstrip("0123456789 ") if len(three) == 3 else said.stem
            axes = dict(zip("xyz", three, strict=False))
            groups.append(Group(axes, said.quantity, said.unit, False, label))
    return groups, dropped


def _is_dull(values: Array) -> bool:
    kept = values[np.isfinite(values)]
    spread = float(kept.std())
    if spread == 0.0:
        return True
    steps = np.abs(np.diff(kept))
    usual = max(float(np.median(steps)), float(steps[steps > 0.0].min(initial=np.inf)))
    if not np.isfinite(usual):
        return True
    far = abs(float(kept.mean())) > FAR_MEAN * spread
    return float(steps.max()) < FEELS * usual and far


# The time column of a table, and its unit.

RATES = (50.0, 100.0, 200.0, 400.0, 500.0, 1000.0, 2000.0, 5000.0, 10_000.0, 20_000.0)
# Typical duration of four fifths of the power of a frontal impact, s.
USUAL_PULSE = 0.06
# Limits for even steps: spread of the steps relative to their mean; spread of the stamps about the
# line through both end points, relative to that of the steps, as rounding moves both ends of the
# line; spread of rounded steps relative to their mean.
EVEN, ROUNDED, STEP = 0.01, 2.0, 1.05
# Tolerance of clock steps about their median, and the largest share of steps outside it.
REGULAR, IRREGULAR_PART = 0.5, 0.05
# Sampling rates of crash records; a column outside them is a sum, not a clock.
SLOWEST, FASTEST = 5.0, 200_000.0  # Hz


def find_clock(
    columns: Mapping[str, Array], headings: Mapping[str, Heading]
) -> tuple[Clock, Array | None]:
    """Find the time column, and the time in its likeliest unit, s; None where there is none.

    A clock increases in nearly equal steps. A column named as a clock has priority; of the others
    one that does not count samples, then the first. A column that increases by one counts samples,
    or milliseconds at 1 kHz: only its name can decide.
    """
    growing = [name for name, values in columns.items() if _grows(values)]
    plain = [name for name in growing if headings[name].quantity == ""]
    for names, why in (
        ([n for n in growing if headings[n].quantity == "time"], "by its heading"),
        ([n for n in plain if not _counts(columns[n])], "it grows in equal steps"),
        ([n for n in plain if _counts(columns[n])], "it grows in steps of one"),
        (
            [n for n, v in columns.items() if headings[n].quantity == "time" and _advances(v)],
            "by its heading, though its steps are uneven",
        ),
    ):
        if names:
            # A clock with a stated unit has priority.
            name = next((n for n in names if headings[n].unit in TIME_UNITS), names[0])
            return _clock(name, columns[name], headings[name], why)
    for name, values in columns.items():
        unit = headings[name].unit
        if headings[name].quantity == "time" and unit in TIME_UNITS and values.size:
            time = values * TIME_UNITS[unit]
            if found := coarse_rate(time):
                why = f"by its heading; its stamps are whole, {found:.5g} samples to the second"
                clock = Clock(name, unit, why, 1.0 / (found * TIME_UNITS[unit]), found)
                # As the case reader counts: evenly from the first stamp.
                even = time[0] + np.arange(time.size) / found
                return replace(clock, stated=True, rate_why=why), even
    return Clock("", "", "no column grows in equal steps", math.nan, math.nan), None


def _advances(values: Array) -> bool:
    return values.size > 1 and bool(np.isfinite(values).all() and (np.diff(values) > 0.0).all())


def coarse_rate(time: Array) -> float | None:
    """Rate of stamps, (n,), s, that repeat because they are whole seconds, say, Hz.

    From their first change to their last. None where fewer than a third repeat the one before,
    where they go back, or change less than twice.
    """
    steps = np.diff(time)
    repeated = np.count_nonzero(steps == 0.0)
    if not np.isfinite(steps).all() or 3 * repeated < steps.size or (steps < 0.0).any():
        return None
    at = np.flatnonzero(steps > 0.0) + 1
    if at.size < 2:
        return None
    return float((at[-1] - at[0]) / (time[at[-1]] - time[at[0]]))


def likely_rate(values: Array) -> float:
    """Likeliest sampling rate of (n, k) numbers without time, by the usual duration of a pulse."""
    samples = pulse_samples(values)
    return min(RATES, key=lambda rate: abs(math.log(max(samples, 1) / rate / USUAL_PULSE)))


def _clock(name: str, values: Array, heading: Heading, why: str) -> tuple[Clock, Array]:
    step = Steps.of(values).mean
    rates = {u: 1.0 / (step * factor) for u, factor in TIME_UNITS.items()}
    if heading.unit in TIME_UNITS:
        # Dates and times of day are read in ns, a unit that the heading does not name.
        names_it = heading.unit != "ns" or "ns" in name.lower() or "nano" in name.lower()
        how = f"{why}, which names the unit" if names_it else f"{why}; a time of day, read in ns"
        clock = Clock(name, heading.unit, how, step, rates[heading.unit])
        return clock, values * TIME_UNITS[heading.unit]
    whole = np.round(values)
    # Whole numbers count ticks.
    ticks = np.array_equal(whole, values) and np.abs(values).max(initial=0.0) < 2.0**53
    said = infer_time_unit(whole.astype(np.int64) if ticks else values)
    shares = {str(v): p for v, p in ((said.value, said.confidence), *said.alternatives) if v}
    within = {u: p for u, p in shares.items() if SLOWEST <= rates[u] <= FASTEST}
    # A step of one is a sample count as often as a millisecond.
    total = math.fsum(within.values()) + (
        1.0 if _counts(values) and heading.quantity != "time" else 0.0
    )
    best = max(within, key=lambda u: within[u], default="s")
    time = values * TIME_UNITS[best]
    if within and within[best] >= THRESHOLD * total:
        told = f"{why}; a step of {step:.6g} {best} is {rates[best]:.5g} samples a second"
        return Clock(name, best, told, step, rates[best]), time
    kinds = [f'"{u}" makes {rates[u]:.5g} samples a second' for u in within or ("s",)]
    if _counts(values):
        kinds.append(
            "if it counts samples, delete `time` and `time_unit` and write `rate_hz` instead"
        )
    return Clock(name, "", why, step, rates[best], "; ".join(kinds)), time


def evenly(clock: Clock, time: Array) -> tuple[Clock, Array]:
    """Make rounded or late stamps, (n,), s, even; return others unchanged.

    The stamps of an even clock rounded to q deviate by at most q, and their steps differ by q.
    Several missing samples bend the line by more.
    """
    count = np.arange(time.size)
    steps = np.diff(time)
    mean = float((time[-1] - time[0]) / max(time.size - 1, 1))
    spread = float(np.ptp(steps)) if steps.size else 0.0
    if not clock.unit or spread <= EVEN * mean:
        return clock, time
    off = float(np.ptp(time - time[0] - count * mean))
    if off > ROUNDED * spread or spread > STEP * mean:
        return clock, time
    told = f"its stamps are rounded: evenly spaced within {1e3 * off:.2g} ms"
    even = replace(clock, rate=1.0 / mean, stated=True, why=f"{clock.why}; {told}", rate_why=told)
    return even, time[0] + count * mean


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


_HERTZ = re.compile(
    r"(?<![\w.,])(\d+(?:[.,]\d+)?)\s*(k?)\s*(?:hz|sps|s/s|samples?\s*(?:/|per)\s*s)", re.I
)
# The limit of a filter is in Hz, too.
_FILTER = re.compile(
    r"filter|cfc|band ?width|bandbreite|cut.?off|grenzfrequenz|low.?pass|tiefpass", re.I
)


def stated_rate(remarks: Sequence[str]) -> tuple[float, str] | None:
    """Sampling rate, Hz, stated in the lines above a table, and the line.

    None where no line states one, or two state different ones.
    """
    found: dict[float, str] = {}
    for line in remarks:
        for said in () if _FILTER.search(line) else _HERTZ.finditer(line):
            # A comma before three digits separates thousands in some countries, decimals in others.
            if re.fullmatch(r"\d+[.,]\d{3}", said[1]):
                return None
            rate = float(said[1].replace(",", ".")) * (1000.0 if said[2] else 1.0)
            if SLOWEST <= rate <= FASTEST:
                found.setdefault(rate, line)
    return next(iter(found.items())) if len(found) == 1 else None


# Kind and unit of three columns of numbers: accelerometer or gyro.

# A rest ends at a sample that deviates by this many times the usual step.
BURST = 15.0
LEAST_QUIET = 10  # samples
# Noise and zero-rate offset of MEMS gyros of crash recorders, peak rate in a crash: decades about
# these, with a standard deviation that covers an order of magnitude either way twice (the peak: a
# factor of four).
USUAL_NOISE, USUAL_OFFSET, DECADES = math.radians(0.1), math.radians(1.0), 0.7
USUAL_PEAK, PEAK_DECADES = math.radians(120.0), 0.6
# Least correlation between two ranges of one sensor, or two recorders.
LEAST_CORRELATION = 0.8
# In logarithm: noise flattens the slope, and the next unit is a factor of 9.8 away.
SCALE_TOLERANCE = 0.35
# Full scales of accelerometers, in g, and their tolerance.
FULL_SCALES = (
    *(1.2, 1.5, 1.7, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 12.0, 16.0, 18.0, 20.0, 24.0, 25.0, 30.0),
    *(35.0, 37.0, 40.0, 50.0, 55.0, 64.0, 70.0, 75.0, 100.0, 120.0, 150.0, 200.0, 250.0, 400.0),
    *(500.0, 1000.0, 2000.0),
)
ROUND = 0.003
# Duration of four fifths of the power of a crash; least ratio of a pulse to the noise.
PULSE, LEAST_PULSE = (0.008, 0.8), 8.0  # s
# Share of the largest reading beyond which a saturated low range cannot be compared; share below
# which values are mostly noise.
NEAR_END, MOVES = 0.98, 0.15
# Least overlap for comparing two records, as a share of the shorter one.
OVERLAP = 0.5
# A rest below this share of the peak has no gravity.
ZEROED = 0.05


class Quiet(NamedTuple):
    """Rest of a triad before the event: samples from the first on, mean and sd of each axis."""

    samples: int
    mean: Array
    sd: Array


class Answer(NamedTuple):
    """Likeliest unit with its evidence; `gravity`: probability that gravity is measured."""

    unit: str
    confidence: float
    why: str
    gravity: float = 0.0


def quiet_part(values: Array) -> Quiet:
    """Return the samples of (n, k) values before the first burst of any column."""
    steps = np.abs(np.diff(values, axis=0))
    # A coarse converter repeats most values; its step is the unit of change.
    least = np.array([s[s > 0].min(initial=np.inf) if (s > 0).any() else np.inf for s in steps.T])
    limit = BURST * np.maximum(np.median(steps, axis=0), least)
    bursts = np.flatnonzero((steps > limit).any(axis=1))
    count = int(bursts[0]) if bursts.size else len(values)
    count = max(count, min(LEAST_QUIET, len(values)))
    part = values[:count]
    return Quiet(count, part.mean(axis=0), part.std(axis=0))


def accel_unit(values: Array, step: float, quiet: Quiet) -> Answer:
    """Unit of an accelerometer, (n, 3), by the magnitude of its rest.

    Confidence 0 where gravity is not measured. Counts of a converter may be 1024 per g, nearly as
    many as mg; saturation distinguishes them: full scales are round in g, and converters end at a
    power of two.
    """
    length = float(np.linalg.norm(quiet.mean))
    said, form, gravity, _ = infer_accel(values[: quiet.samples], step if step > 0 else None)
    pairs = [(str(v), p) for v, p in ((said.value, said.confidence), *said.alternatives) if v]
    there = gravity.confidence if gravity.value == "present" else 0.0
    there = min(there, form.confidence if form.value == "rate" else 0.0)
    likeliest, sure = pairs[0] if pairs else ("m/s2", 0.0)
    told = f"at rest its length is {length:.4g}, that of gravity in {likeliest}"
    if there >= THRESHOLD and sure < THRESHOLD and (end := _round_end(values, likeliest)):
        told += f", and it ends at {end:g} g"
        sure = THRESHOLD
    return Answer(likeliest, min(sure, there), told, there)


def _round_end(values: Array, unit: str) -> float | None:
    """Full scale in g, where values end at a number that is round in g and no power of two."""
    time = np.arange(len(values), dtype=np.float64) * 1e-3
    limits = find_limits(time, values, np.full(3, np.inf), np.zeros(3))
    ends = [abs(e) for e in (*limits.lower, *limits.upper) if np.isfinite(e)]
    if not ends:
        return None
    end = max(ends)
    power = 2.0 ** round(math.log2(end))
    in_g = end * ACCEL_UNITS[unit] / STANDARD_GRAVITY
    near = min(FULL_SCALES, key=lambda f: abs(in_g / f - 1.0))
    if abs(in_g / near - 1.0) > ROUND or abs(end / power - 1.0) <= ROUND:
        return None
    return near


def pulse_samples(values: Array) -> int:
    """Samples in the middle four fifths of the power of the shortest pulse of (n, k) values.

    0 without a pulse. Columns that increase evenly, as a clock does, and those without a pulse are
    ignored. A gyro that turns long after the impact does not lengthen the pulse.
    """
    lengths = []
    for column in values.T:
        free = np.abs(column - np.median(column))
        noise = max(float(np.median(free)), float(np.sort(free)[int(0.7 * free.size)]))
        if np.ptp(np.diff(column)) == 0.0 or not free.max() > LEAST_PULSE * noise:
            continue
        # Without the noise, which has more power than the pulse in a long record.
        power = np.cumsum(np.where(free > 3.0 * noise, free, 0.0) ** 2)
        edges = np.searchsorted(power, np.array([0.1, 0.9]) * power[-1])
        lengths.append(int(edges[1] - edges[0]))
    return min(lengths, default=0)


def gyro_unit(time: Array, values: Array, quiet: Quiet) -> Answer:
    """Unit of a gyro by its peak, rest and noise.

    The probabilities of `formats.inference` from the largest rates are combined with peak, offset
    and noise at rest, each as a broad normal distribution of the logarithm.
    """
    crash = slice(
        max(quiet.samples - 1, 0) if quiet.samples < len(values) - LEAST_QUIET else 0, None
    )
    said, *_, _ = infer_gyro(time[crash] - time[crash][0], values[crash], None, {"s": 1.0})
    prior = {str(v): p for v, p in ((said.value, said.confidence), *said.alternatives) if v}
    peak = float(np.abs(values - quiet.mean).max())
    offset = float(np.abs(quiet.mean).max())
    noise = float(np.sqrt(np.mean(quiet.sd**2)))
    weights = {}
    for unit in ("rad/s", "deg/s"):
        log = math.log(max(prior.get(unit, 1e-6), 1e-6))
        for size, usual, decades in (
            (peak, USUAL_PEAK, PEAK_DECADES),
            (offset, USUAL_OFFSET, DECADES),
            (noise, USUAL_NOISE, DECADES),
        ):
            if size > 0.0:
                log -= 0.5 * (math.log10(size * GYRO_UNITS[unit] / usual) / decades) ** 2
        weights[unit] = log
    found = posterior(weights)
    unit = next(iter(found))
    factor = GYRO_UNITS[unit] / GYRO_UNITS["deg/s"]
    told = (
        f"in {unit} its largest is {peak * factor:.4g} deg/s, its rest {offset * factor:.3g} deg/s "
        f"and its noise {noise * factor:.3g} deg/s"
    )
    return Answer(unit, found[unit], told)


def regress(known: Array, other: Array) -> tuple[float, float]:
    """Scale of one triad to another, (n, k), that may have a shorter range, and correlation.

    The scale is 0 where it cannot be determined; for the correlation `other` is clipped where
    `known` saturates.
    """
    x, y = (v - np.median(v, axis=0) for v in (known, other))
    largest = np.abs(x).max(axis=0)
    margin = (1.0 - NEAR_END) * np.ptp(x, axis=0)
    inside = (x > x.min(axis=0) + margin) & (x < x.max(axis=0) - margin)
    moves = inside & (np.abs(x) > MOVES * largest.max())
    x_in, y_in = x[moves], y[moves]
    power, own = float(y_in @ y_in), float(x_in @ x_in)
    if power <= 0.0 or own <= 0.0:
        return 0.0, 0.0
    # Both are noisy: the geometric mean of the two regression slopes is not biased to zero.
    scale = math.copysign(math.sqrt(own / power), float(x_in @ y_in))
    cut = np.clip(scale * y, x.min(axis=0), x.max(axis=0))
    power, own = float((cut * cut).sum()), float((x * x).sum())
    if power <= 0.0:
        return 0.0, 0.0
    return scale, float((cut * x).sum()) / math.sqrt(power * own)


def agreement(a: Part, b: Part, axes: Sequence[int] = (0, 1, 2)) -> tuple[float, float]:
    """`regress` of two parts over their common time, at the stamps of the slower one."""
    start, end = max(a.time[0], b.time[0]), min(a.time[-1], b.time[-1])
    slow, fast = (a, b) if a.step >= b.step else (b, a)
    rows = (slow.time >= start) & (slow.time <= end)
    at = slow.time[rows]
    moved = np.column_stack([np.interp(at, fast.time, fast.values[:, k]) for k in axes])
    own = slow.values[rows][:, list(axes)]
    return regress(own, moved) if slow is a else regress(moved, own)


def settle_units(parts: Sequence[Part]) -> list[Part]:
    """Determine kind and unit of every triad: by heading, rest, or one with the same motion.

    From values as recorded to values in SI, in the same order; in the likeliest unit where
    `Part.unit` is empty. Delta-V of event data recorders become mean accelerations.
    """
    parts = [_timed(p) for p in parts]
    out: list[Part | None] = [_stated(p) for p in parts]
    order = sorted(range(len(parts)), key=lambda k: _off_gravity(parts[k]))
    for step in (_by_gravity, _by_another, _by_gravity_alone, _by_another, _by_elimination):
        for k in order:
            if out[k] is None:
                known = [q for q in out if q is not None and q.kind == "acceleration"]
                out[k] = step(parts[k], known)
    settled = [p for p in out if p is not None]
    return [_as_accelerations(p) if p.kind == "velocity" else p for p in settled]


def _off_gravity(part: Part) -> float:
    """Smallest relative difference of its rest from gravity over all units."""
    length = float(np.linalg.norm(quiet_part(part.values).mean)) if len(part.axes) == 3 else 0.0
    if length <= 0.0:
        return math.inf
    known = (STANDARD_GRAVITY / s for u in INFERRED["accel"] if (s := ACCEL_UNITS[u]) > 0.0)
    return min(abs(math.log(length / g)) for g in known)


def _timed(part: Part) -> Part:
    """Settle the unit of a clock by the duration of the crash, if only one makes it plausible."""
    clock = part.clock
    if clock.unit or not clock.column:
        return part
    samples = pulse_samples(part.values[:, part.axes])
    lasts = {u: samples * f * clock.step for u, f in TIME_UNITS.items()}
    fits = [u for u, length in lasts.items() if PULSE[0] <= length <= PULSE[1]]
    if samples < 3 or len(fits) != 1:
        return part
    unit = fits[0]
    factor, was = TIME_UNITS[unit], 1.0 / (clock.step * clock.rate)
    why = (
        f"{clock.why}; in {unit} four fifths of the pulse last {lasts[unit]:.2g} s, as a crash "
        "does, in any other unit a thousand times less or more"
    )
    clock = replace(clock, unit=unit, why=why, rate=1.0 / (clock.step * factor), candidates="")
    return replace(part, clock=clock, time=part.time * (factor / was))


class StatedReading(NamedTuple):
    """Axes of a record that a person states, as `parse_axes` takes them, and units; or empty."""

    axes: str = ""
    accel_unit: str = ""
    gyro_unit: str = ""

    def of(self, part: Part) -> Part:
        """Return a part with it; of left-handed axes the third channel is reversed."""
        unit = {"acceleration": self.accel_unit, "rate": self.gyro_unit}.get(part.kind, "")
        if unit and not part.unit:
            part = replace(part, unit=unit, unit_why=("stated",))
        if not self.axes:
            return part
        channels, values = dict(part.channels), part.values
        if mirrored(*parse_axes(self.axes)):
            values = values * np.array([1.0, 1.0, -1.0])
            if third := channels.get("z"):
                channels["z"] = third[1:] if third.startswith("-") else f"-{third}"
        return replace(part, channels=channels, values=values, axes_stated=self.axes)


_TABLES = {"acceleration": ACCEL_UNITS, "rate": GYRO_UNITS, "velocity": SPEEDS}


def _stated(part: Part) -> Part | None:
    if part.unit in _TABLES.get(part.kind, {}):
        # The evidence for a unit that a person states is there already.
        why = () if part.unit_why else ("unit by the heading",)
        return _scaled(part, part.kind, part.unit, *why)
    return None


def _weighed(part: Part, known: Sequence[Part]) -> Answer | None:
    # A gyro bias may equal gravity in some unit: beside an accelerometer it must agree.
    if not part.kind and any(q.path == part.path for q in known):
        return None
    if part.kind not in ("", "acceleration") or len(part.axes) < 3:
        return None
    return accel_unit(part.values, part.step, quiet_part(part.values))


def _by_gravity(part: Part, known: Sequence[Part]) -> Part | None:
    said = _weighed(part, known)
    if said is None or said.confidence < THRESHOLD:
        return None
    return _scaled(part, "acceleration", said.unit, said.why)


def _by_gravity_alone(part: Part, known: Sequence[Part]) -> Part | None:
    """Accelerometer by gravity at rest, in a unit that is not settled."""
    said = _weighed(part, known)
    if said is None or said.gravity < THRESHOLD:
        return None
    return _asked(part, "acceleration", said.unit)


def overlaps(a: Part, b: Part) -> bool:
    """Whether two parts are compared: over their common time, in seconds of both."""
    start, end = max(a.time[0], b.time[0]), min(a.time[-1], b.time[-1])
    return bool(end - start >= OVERLAP * min(np.ptp(a.time), np.ptp(b.time)))


def _by_another(part: Part, known: Sequence[Part]) -> Part | None:
    if part.kind not in ("", "acceleration"):
        return None
    scales = {u: s for u in INFERRED["accel"] if (s := ACCEL_UNITS[u]) > 0.0}
    for other in sorted(known, key=lambda q: q.path != part.path):
        slope, correlation = agreement(other, part) if overlaps(other, part) else (0.0, 0.0)
        if correlation < LEAST_CORRELATION or slope <= 0.0:
            continue
        unit = min(scales, key=lambda u: abs(math.log(slope / scales[u])))
        ratio = slope / scales[unit]
        if abs(math.log(ratio)) > SCALE_TOLERANCE:
            continue
        file = "" if other.path == part.path else f"{other.path}: "
        told = (
            f"in {unit} it agrees with {file}{', '.join(other.channels.values())} (correlation "
            f"{correlation:.2f}, scale {ratio:.3f})"
        )
        if not other.unit:
            # In the same unit, whichever it is.
            return _asked(part, "acceleration", unit, told)
        return _scaled(part, "acceleration", unit, told)
    return None


def _by_elimination(part: Part, known: Sequence[Part]) -> Part | None:
    values = part.values[:, part.axes]
    quiet = quiet_part(values)
    if part.kind == "velocity":
        return _asked(part, "velocity", "km/h")
    beside = any(q.path == part.path or overlaps(q, part) for q in known)
    if part.kind == "rate" or (not part.kind and beside and len(part.axes) == 3):
        said = gyro_unit(part.time, values, quiet)
        why = "" if part.kind else "it does not follow the accelerations, and rests near zero"
        if said.confidence >= THRESHOLD:
            return _scaled(part, "rate", said.unit, "; ".join(filter(None, (why, said.why))))
        return _asked(part, "rate", said.unit, why)
    # Without gravity by the peak: a crash has tens of g, so more than two hundred is not in g.
    peak = float(np.nanmax(np.abs(part.values)))
    unit = "g" if peak < 100.0 else "m/s2" if peak < 5000.0 else "mg"
    if len(part.axes) == 3:
        unit = accel_unit(part.values, part.step, quiet).unit
    zeroed = bool(np.abs(quiet.mean).max() < ZEROED * np.abs(values).max())
    return replace(_asked(part, "acceleration", unit), zeroed=zeroed)


def _scaled(part: Part, kind: str, unit: str, *why: str) -> Part:
    values = part.values * _TABLES[kind][unit]
    rest = float(np.linalg.norm(quiet_part(values[:, part.axes]).mean))
    zeroed = kind == "acceleration" and rest < 0.3 * STANDARD_GRAVITY and len(part.axes) == 3
    return replace(
        part, kind=kind, unit=unit, values=values, zeroed=zeroed, unit_why=(*part.unit_why, *why)
    )


#: Units that no recorder of a crash has.
UNLIKELY = ("mrad/s", "mdeg/s", "deg/h", "cm/s", "kn")


def _asked(part: Part, kind: str, unit: str, why: str = "") -> Part:
    """In the likeliest unit, with what each possible unit would mean."""
    words: dict[str, Callable[[Part, float], str]]
    words = {"acceleration": _accelerations, "rate": _rates, "velocity": _speeds}
    table = _TABLES[kind]
    units = [u for u in table if table[u] > 0.0 and u not in UNLIKELY]
    return replace(
        part,
        kind=kind,
        unit="",
        candidates="; ".join(f'"{u}" makes {words[kind](part, table[u])}' for u in units),
        values=part.values * table[unit],
        unit_why=(*part.unit_why, why) if why else part.unit_why,
    )


def _peak_change(part: Part, factor: float) -> tuple[float, float]:
    """Largest value, and largest change of its integral, of any axis."""
    values = part.values[:, part.axes]
    values = (values - quiet_part(values).mean) * factor
    sums = np.abs(np.cumsum(values, axis=0) * part.step)
    return float(np.abs(values).max()), float(sums.max())


def _accelerations(part: Part, factor: float) -> str:
    peak, change = _peak_change(part, factor)
    return f"a peak of {peak / STANDARD_GRAVITY:.3g} g and {change * 3.6:.3g} km/h"


def _rates(part: Part, factor: float) -> str:
    peak, turn = _peak_change(part, factor)
    return f"a peak of {np.degrees(peak):.3g} deg/s and a turn of {np.degrees(turn):.3g} deg"


def _speeds(part: Part, factor: float) -> str:
    return f"{float(np.nanmax(np.abs(part.values))) * factor * 3.6:.3g} km/h"


# Event data recorders. 49 CFR 563.8, Table III: delta-V to ±10 %, in steps of 1 km/h, from −100 to
# 100 km/h at least (`formats.crash_edr.DELTA_V_RANGE`: a table that stops there is a finding); an
# acceleration as its maker states. Table I: each 10 ms from time zero to 250 ms. Time zero (563.5):
# wake-up of the algorithm, or the first point of the 20 ms in which 0.8 km/h (lateral: 5 ms) are
# reached, so that up to 0.8 km/h may come before it. 563.8(b): accelerations are filtered; a filter
# delays delta-V, and does not change its sum. Alignment: fixed to the body, as a control unit is.
RECORDER = {"scale_bound_percent": 10.0, "misalignment_sd_deg": 2.0}
BEFORE_ZERO = 0.8 * KMH


def recorder_model(
    time: Array, change: Array, channels: Sequence[CrashChannel], offset: float
) -> dict[str, float]:
    """Error model of a table of delta-V, by keys of the sensor catalogue.

    `time`, (n,), s; `change`, (n, k), m/s, of the `channels`; `offset`, m/s: value at time zero.
    Absolute terms - rounding (uniform over a step), change before time zero and value at time
    zero (bounds) - become the bias that has the same effect until the largest change.
    """
    largest = np.abs(change).max(axis=1)
    until = max(float(time[int(np.argmax(largest))]), float(np.median(np.diff(time))))
    steps = []
    for column, channel in zip(change.T, channels, strict=True):
        factor = SPEEDS.get(channel.unit, KMH)
        apart = np.diff(np.unique(np.round(column, 9)))
        # Decimals may be those of a conversion from whole km/h, which Table III allows.
        steps.append(max(rounding(column / factor) * factor, min(apart.min(initial=KMH), KMH)))
    absolute = math.sqrt(max(steps) ** 2 / 12.0 + BEFORE_ZERO**2 / 3.0 + offset**2 / 3.0)
    bias = absolute / until / (1e-3 * STANDARD_GRAVITY)
    return {**RECORDER, "bias_sd_mg": round(bias, 1)}


def _as_accelerations(part: Part) -> Part:
    """Mean accelerations over the intervals of a table of delta-V, m/s."""
    time, notes, offset = part.time, part.notes, 0.0
    own: dict[int, tuple[Array, Array]] = {}
    for k, channel in zip(part.axes, part.velocities, strict=True):
        if not channel.from_zero:
            own[k] = mean_accelerations_of(time, part.values[:, k])
            continue
        found = means_from_zero(time, part.values[:, k], channel)
        own[k], offset = (found.time, found.mean), max(offset, abs(found.offset))
        if found.late:
            notes = (*notes, f"it begins {found.late:.3g} s after time zero; its sum is kept")
        if found.offset:
            notes = (*notes, f"{found.offset / KMH:.3g} km/h at its time zero widen the bound")
    # Steps before the first row that only one axis has are zero for the others.
    stamps = max((t for t, _ in own.values()), key=len)
    values = np.full((stamps.size, 3), np.nan)
    for k, (ends, mean) in own.items():
        values[:, k] = 0.0
        values[stamps.size - ends.size :, k] = mean
    return replace(
        part,
        kind="acceleration",
        time=stamps,
        values=values,
        zeroed=True,
        sampling="",
        uncertainty=recorder_model(time, part.values[:, part.axes], part.velocities, offset),
        basis="what 49 CFR 563.8 asks of a recorder, 10 % of the change of velocity; as a bias its "
        "rounding, and what may come before time zero",
        notes=(*notes, "changes of velocity; converted to mean accelerations"),
    )


def record_parts(path: str, record: CrashRecord) -> tuple[list[Part], list[Skipped], bool]:
    """Find the triads of a record; also whether kind and unit are still to be settled.

    A record that names measuring points and has stamps is one of a laboratory; a table is searched
    by its headings, each vehicle by itself.
    """
    sensed = [c for c in record.channels if c.quantity != "time"]
    coded = all((c.vehicle or c.point) and c.clock for c in sensed)
    if coded or any(c.samples is None for c in record.channels):
        return *laboratory_parts(path, record), False
    parts: list[Part] = []
    skipped: list[Skipped] = []
    for vehicle in dict.fromkeys(c.vehicle for c in sensed):
        kept = tuple(c for c in record.channels if c.quantity == "time" or c.vehicle == vehicle)
        found, left = table_parts(path, replace(record, channels=kept))
        parts += [replace(part, vehicle=vehicle) for part in found]
        skipped += [replace(one, vehicle=vehicle) for one in left]
    return parts, skipped, True


# Triads of a laboratory test: one per sensor position on the vehicle, of primary channels.

# Sensors of crash laboratories, after calibration by SAE J211: unit of the full scale, and error
# model. Zeroed channels have lost gravity with their bias.
LABORATORY = {
    "acceleration": (
        "full_scale_g",
        STANDARD_GRAVITY,
        {"bias_sd_mg": 1020.0, "scale_sd_percent": 1.0, "misalignment_sd_deg": 1.0},
    ),
    "rate": (
        "full_scale_deg_per_s",
        GYRO_UNITS["deg/s"],
        {"bias_sd_deg_per_s": 1.0, "scale_sd_percent": 1.0, "misalignment_sd_deg": 1.0},
    ),
}


class _Place(NamedTuple):
    """Attributes that the channels of one triad share."""

    vehicle: str
    quantity: str
    point: str


def laboratory_parts(path: str, record: CrashRecord) -> tuple[list[Part], list[Skipped]]:
    """Find the triads of a test, and the failed, redundant and foreign channels.

    A triad is one quantity at one measuring point of one vehicle.
    """
    places: dict[_Place, list[CrashChannel]] = {}
    skipped: list[Skipped] = []
    elsewhere: dict[tuple[str, str], list[str]] = {}
    for channel in record.channels:
        sensed = channel.quantity in LABORATORY
        if not sensed or not channel.axis:
            what = "no axis" if sensed else channel.quantity
            why = f"no sensor of a vehicle's motion ({what})"
            elsewhere.setdefault((channel.vehicle, why), []).append(channel.name)
        elif channel.body != "vehicle":
            why = f"it {'moves with' if channel.vehicle else 'is fixed to'} the {channel.body}"
            elsewhere.setdefault((channel.vehicle, why), []).append(channel.name)
        elif channel.failure:
            why = f"the laboratory says so: {channel.failure}"
            skipped.append(
                Skipped(path, f"channel {channel.name}", why, (channel.name,), channel.vehicle)
            )
        else:
            # Without codes, the position is common to the channels of one block.
            point = channel.point or position_of(channel.place) or "vehicle"
            place = _Place(channel.vehicle, channel.quantity, point)
            places.setdefault(place, []).append(channel)
    for (vehicle, why), names in elsewhere.items():
        what = f"channels {', '.join(names)}"
        skipped.append(Skipped(path, what, why, tuple(names), vehicle))
    found = (_block(path, place, channels, skipped) for place, channels in places.items())
    return [part for part in found if part is not None], skipped


def _block(
    path: str, at: _Place, channels: Sequence[CrashChannel], skipped: list[Skipped]
) -> Part | None:
    chosen: dict[str, CrashChannel] = {}
    curves: dict[str, tuple[Array, Array]] = {}
    # Without a position in words, such as the one word for all, its code names it.
    place = position_of(channels[0].place) or at.point
    spare: list[str] = []
    twins: list[str] = []
    unread: list[Skipped] = []
    for channel in sorted(channels, key=lambda c: "redundant" in c.remarks):
        axis = channel.axis.lstrip("-")
        if axis in chosen:
            (spare if "redundant" in channel.remarks else twins).append(channel.name)
            continue
        try:
            curves[axis] = channel.load()
            refuse_impossible(channel, curves[axis][1])
        except DataError as error:
            what = f"channel {channel.name}"
            unread.append(Skipped(path, what, error.finding, (channel.name,), at.vehicle))
            continue
        chosen[axis] = channel
    skipped += unread
    for names, why in (
        (spare, "redundant"),
        (twins, "another sensor of the same axis, not distinguished from the first in the record,"),
    ):
        if names:
            why = f"{why} at '{place}'; to use it, write it in place of the primary one"
            what = f"channels {', '.join(names)}"
            skipped.append(Skipped(path, what, why, tuple(names), at.vehicle))
    if not chosen:
        return None
    axes = [a for a in "xyz" if a in chosen]
    signs = {a: "-" if chosen[a].axis.startswith("-") else "" for a in axes}
    time = curves[axes[0]][0]
    values = np.full((time.size, 3), np.nan)
    for axis in axes:
        sign = -1.0 if signs[axis] else 1.0
        values[:, "xyz".index(axis)] = sign * np.interp(time, *curves[axis])
    step = float(np.median(np.diff(time))) if time.size > 1 else math.nan
    key, unit, model = LABORATORY[at.quantity]
    scales = [c.full_scale for c in chosen.values() if c.full_scale]
    return Part(
        path,
        at.quantity,
        {a: f"{signs[a]}{chosen[a].name}" for a in axes},
        Clock("", "s", "the record has its own", step, 1.0 / step),
        chosen[axes[0]].unit,
        "axes and unit by the record",
        time,
        values,
        label=place,
        zeroed=at.quantity == "acceleration",
        named=True,
        of_vehicle="its format defines x, y, z as forward, right, down of the vehicle (SAE J211)",
        place=place,
        uncertainty=model | ({key: round(min(scales) / unit, 6)} if scales else {}),
        basis="of a sensor of a crash laboratory, calibrated by SAE J211; zeroed before the "
        "impact, so that gravity is in its bias; its full scale is that of the record",
        notes=tuple(
            f"{a} is channel {chosen[a].name}: {'; '.join(chosen[a].remarks)}"
            + (f"; {chosen[a].low_pass}" if chosen[a].low_pass else "")
            for a in axes
        ),
        vehicle=at.vehicle,
        point=at.point,
    )


# A path measured by another instrument among the records: a reference for the result.

# A path that counts from the trigger contains it within this.
LONGEST = 10.0  # s


class KnownPath(NamedTuple):
    """Path as named in the case, and its time, s."""

    path: str
    name: str
    start: float
    end: float

    @property
    def at_trigger(self) -> bool:
        """Whether its time may count from the trigger."""
        return self.start <= 0.0 <= self.end and self.end - self.start < LONGEST


class KnownForce(NamedTuple):
    """A file of the force on a vehicle, as named in the case, and the column of the force.

    `asked`: its unit is not stated.
    """

    path: str
    name: str
    column: str
    asked: bool


def known_force(path: str, record: CrashRecord) -> KnownForce | None:
    """Read a record as the force on a vehicle, if that is all it has beside its time."""
    forces = [c.name for c in record.channels if c.quantity == "force" or "force" in c.name.lower()]
    if len(record.files) != 1 or len(forces) != 1 or len(record.channels) > 2:
        return None
    try:
        table = read_aid_table(record.path, {"force": "N"}, names={"force": forces[0]})
    except (ConfigError, DataError):
        return None
    asked = any(f.code == "io.unit-assumed" for f in table.attrs["findings"])
    return KnownForce(path, record.path.stem, forces[0], asked)


def known_path(path: str, record: CrashRecord) -> KnownPath | None:
    """Read a record as the path of a point, if it has time, north, east and down."""
    heads = (re.split(r"[\[(]|_m", c.name.lower())[0].strip() for c in record.channels)
    if len(record.files) != 1 or not {"north", "east", "down"} <= set(heads):
        return None
    try:
        table = read_reference_path(record.path)
    except (ConfigError, DataError):
        return None
    return KnownPath(path, record.path.stem, float(table.index[0]), float(table.index[-1]))
