"""Group triads into recorders, and assign gyros to recorders without one."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import PurePath

import numpy as np
from numpy.typing import NDArray

from strapdown.constants import ACCEL_UNITS, GYRO_UNITS, STANDARD_GRAVITY, TIME_UNITS
from strapdown.formats.crash_record import FACTORS
from strapdown.formats.inference.conclusion import THRESHOLD
from strapdown.sensors.catalogue import SENSORS, load_sensor
from strapdown.sensors.saturation import find_limits
from strapdown.systems.crash_draft.impact import Impact, find_impact
from strapdown.systems.crash_draft.parts import Part, Skipped
from strapdown.systems.crash_draft.triad_kind import (
    FULL_SCALES,
    Answer,
    accel_unit,
    clock_by_pulse,
    gyro_unit,
    quiet_part,
    regress,
    same_quantity,
)

__all__ = ["RangeEnds", "Unit", "group_units", "range_ends", "settle_units", "stated_of"]


# Impacts on one clock differ by less than this, or by three steps of the slower.
SAME_INSTANT = 0.01  # s
STEPS = 3.0
# Least correlation of two ranges of one housing.
SAME_PLACE = 0.8
SAME_SCALE = 0.25
# A gyro shares the accelerometer's clock if it begins to turn within this of the impact.
TURNS_WITHIN = 0.15  # s
TURNS = 8.0
_RANGE_WORDS = re.compile(
    r"(?<![a-z])(low|high|lo|hi|lg|hg|nd|hd|acc\w*|gyr\w*|gyro|imu|rate\w*|drehrate\w*|beschl\w*"
    r"|\d+ ?g|a|w|g)(?![a-z])"
)


@dataclass(frozen=True, eq=False)
class Unit:
    """Recorder found in the records.

    Attributes
    ----------
    name : str
    accelerometers : tuple of Part
        In order of increasing range.
    gyro : Part or None
    gyro_from : str
        Name of the unit whose gyro it uses; empty if it has its own or none.
    impact : Impact or None
        None where no accelerometer has a time base.
    ends : dict of int to RangeEnds
        Of each accelerometer by index; of the gyro under -1.
    why : tuple of str
        Grounds for the grouping.
    """

    name: str
    accelerometers: tuple[Part, ...]
    gyro: Part | None
    gyro_from: str
    impact: Impact
    ends: dict[int, RangeEnds]
    why: tuple[str, ...] = field(default=())


def group_units(parts: Sequence[Part]) -> tuple[list[Unit], list[Skipped]]:
    """Group triads into units.

    Parameters
    ----------
    parts : sequence of Part
        Accelerations and rates, with kind and likeliest unit settled.

    Returns
    -------
    units : list of Unit
        In order of their first triad.
    skipped : list of Skipped
        Gyros that fit no unit.
    """
    open_: list[list[Part]] = []
    reasons: list[list[str]] = []
    for part in (p for p in parts if p.kind == "acceleration"):
        for k, group in enumerate(open_):
            told = _one_recorder(group, part)
            if told:
                group.append(part)
                reasons[k].append(told)
                break
        else:
            open_.append([part])
            reasons.append([])
    drafts = []
    for group, why in zip(open_, reasons, strict=True):
        ordered = sorted(group, key=_reach)
        drafts.append((ordered, find_impact(ordered[-1], ordered[0]), why))
    gyros: dict[int, Part] = {}
    skipped: list[Skipped] = []
    for gyro in (p for p in parts if p.kind == "rate"):
        owner, told = _owner(gyro, drafts, gyros)
        if owner is None:
            skipped.append(Skipped(gyro.path, _of(gyro), told, tuple(gyro.channels.values())))
            continue
        gyros[owner] = gyro
        if told:
            drafts[owner][2].append(told)
    names = _names([d[0] for d in drafts], [gyros.get(k) for k in range(len(drafts))])
    units = []
    lenders = [names[k] for k in gyros]
    for k, (accelerometers, impact, why) in enumerate(drafts):
        own = gyros.get(k)
        if own is not None:
            impact = find_impact(accelerometers[-1], accelerometers[0], own)
        ends = {j: range_ends(p) for j, p in enumerate(accelerometers)}
        if own is not None:
            ends[-1] = range_ends(own)
        lender = "" if own is not None or not lenders else lenders[0]
        units.append(Unit(names[k], tuple(accelerometers), own, lender, impact, ends, tuple(why)))
    return units, skipped


def _reach(part: Part) -> float:
    ends = range_ends(part)
    known = [e for e in ends.ends if e is not None]
    return max(known) if known else float(np.nanmax(np.abs(part.values)))


def _one_recorder(group: Sequence[Part], part: Part) -> str:
    """Why a triad belongs to a group; empty where it does not."""
    for other in group:
        if other.channels.keys() != part.channels.keys() or not _overlap(other, part):
            continue
        if other.path == part.path and other.clock.column != part.clock.column:
            continue
        low, high = sorted((other, part), key=_reach)
        apart = abs(_instant(low, _reach(low)) - _instant(high, _reach(low)))
        one_file = other.path == part.path
        if not one_file and apart > max(SAME_INSTANT, STEPS * max(other.step, part.step)):
            continue
        ends = range_ends(low)
        reached = float(np.nanmax(np.abs(high.values)))
        goes_on = ends.saturated and _reach(low) < 0.8 * reached
        named = _low_and_high(low, high)
        if not (goes_on or named):
            continue
        slope, correlation = _agreement(low, high)
        if correlation < SAME_PLACE or abs(slope - 1.0) > SAME_SCALE:
            continue
        told = f"{_of(low)} and {_of(high)} are low and high range of one recorder: "
        if goes_on:
            told += (
                f"the first stands at its end of {in_words(_reach(low), 'acceleration')}, where "
                f"the second goes on to {in_words(reached, 'acceleration')}; "
            )
        return told + (
            f"below it they agree (correlation {correlation:.2f}, scale {slope:.2f}) on one clock"
        )
    return ""


def _low_and_high(low: Part, high: Part) -> bool:
    words = [set(re.findall(r"[a-z]+", _text(p))) for p in (low, high)]
    return bool(words[0] & {"low", "lo", "lg", "nd"} and words[1] & {"high", "hi", "hg", "hd"})


def _text(part: Part) -> str:
    return f"{PurePath(part.path).stem} {part.label}".lower().replace("_", " ")


def _agreement(low: Part, high: Part) -> tuple[float, float]:
    start, end = max(low.time[0], high.time[0]), min(low.time[-1], high.time[-1])
    slow, fast = (low, high) if low.step >= high.step else (high, low)
    rows = (slow.time >= start) & (slow.time <= end)
    at = slow.time[rows]
    has = low.axes
    moved = np.column_stack([np.interp(at, fast.time, fast.values[:, k]) for k in has])
    own = slow.values[rows][:, has]
    return regress(own, moved) if slow is low else regress(moved, own)


def _overlap(a: Part, b: Part) -> bool:
    if a.clock.column == "" or b.clock.column == "":
        return a.path == b.path
    start, end = max(a.time[0], b.time[0]), min(a.time[-1], b.time[-1])
    return bool(end - start >= 0.5 * min(np.ptp(a.time), np.ptp(b.time)))


def _instant(part: Part, reach: float) -> float:
    """Time of half of the lower range's peak, on the triad's clock."""
    size = np.abs(part.free).max(axis=1)
    over = size > 0.5 * min(reach, float(size.max()))
    return float(part.time[int(np.argmax(over))])


def _owner(
    gyro: Part, drafts: Sequence[tuple[list[Part], Impact, list[str]]], taken: dict[int, Part]
) -> tuple[int | None, str]:
    """Unit that a gyro belongs to, and why."""
    free = [k for k in range(len(drafts)) if k not in taken]
    for k in free:
        if any(p.path == gyro.path for p in drafts[k][0]):
            return k, ""
    near = []
    for k in free:
        parts, impact, _ = drafts[k]
        if not _overlap(parts[0], gyro):
            continue
        if _turns_at(gyro, impact.trigger):
            near.append(k)
    if not near:
        return None, (
            "its clock fits no accelerometer: it does not begin to turn where one is struck; if it "
            "belongs to a unit, bring it to the clock of that unit's file"
        )
    stem = _stem(gyro)
    near.sort(key=lambda k: -len(_shared([stem, _stem(drafts[k][0][0])])))
    k = near[0]
    told = (
        f"{_of(gyro)} is its gyro: it is on the same clock, and begins to turn when "
        f"{_of(drafts[k][0][0])} is struck"
    )
    return k, told


def _turns_at(gyro: Part, impact: float) -> bool:
    """Whether it turns more after the impact than before, starting there."""
    values = gyro.values[:, gyro.axes]
    before = (gyro.time < impact - TURNS_WITHIN) & (gyro.time > impact - 3.0)
    if before.sum() < 5:
        return True
    base = values[before]
    sd = np.maximum(base.std(axis=0), 1e-9)
    moved = (np.abs(values - base.mean(axis=0)) > TURNS * sd).any(axis=1)
    starts = gyro.time[moved & (gyro.time > impact - 3.0)]
    return bool(starts.size and abs(starts[0] - impact) <= TURNS_WITHIN)


def _names(groups: Sequence[Sequence[Part]], gyros: Sequence[Part | None]) -> list[str]:
    """Short unit names: of the files, else of the columns."""
    stems = []
    for group, gyro in zip(groups, gyros, strict=True):
        files = dict.fromkeys(PurePath(p.path).stem for p in (*group, *((gyro,) if gyro else ())))
        common = _shared(list(files)).strip(" _-.")
        stems.append(common if len(common) >= 2 else next(iter(files)))
    names: list[str] = []
    for k, stem in enumerate(stems):
        label = groups[k][0].label
        place = groups[k][0].place
        name = f"{stem} {label}".strip() if stems.count(stem) > 1 else stem
        n = 2
        base = place or name or "unit"
        name = base
        while name in names:
            name, n = f"{base} {n}", n + 1
        names.append(name)
    return names


def _shared(names: Sequence[str]) -> str:
    """Common beginning of all names."""
    together = itertools.takewhile(lambda chars: len(set(chars)) == 1, zip(*names, strict=False))
    return "".join(chars[0] for chars in together)


def _stem(part: Part) -> str:
    return _RANGE_WORDS.sub(" ", PurePath(part.path).stem.lower().replace("_", " ")).strip()


def _of(part: Part) -> str:
    names = list(part.channels.values())
    shown = ", ".join(names)
    return f"{shown} of {PurePath(part.path).name}"


# Kind and unit of each triad: by its heading, its rest, or a triad with the same motion.


Array = NDArray[np.float64]

# Least overlap for comparing two records, as a share of the shorter one.
OVERLAP = 0.5
# A rest below this share of the peak has no gravity.
ZEROED = 0.05


def settle_units(parts: Sequence[Part]) -> list[Part]:
    """Determine kind and unit of every triad.

    Parameters
    ----------
    parts : sequence of Part
        With values as recorded, and kind and unit as far as the headings state them.

    Returns
    -------
    list of Part
        In the same order, with values in SI; in the likeliest unit where `Part.unit` is empty.
    """
    parts = [_timed(p) for p in parts]
    out: list[Part | None] = [_by_heading(p) for p in parts]
    order = sorted(range(len(parts)), key=lambda k: _off_gravity(parts[k]))
    for step in (_by_gravity, _by_another, _by_gravity_alone, _by_another, _by_elimination):
        for k in order:
            part = parts[k]
            if out[k] is None:
                known = [q for q in out if q is not None and q.kind == "acceleration"]
                out[k] = step(part, known)
    return [p for p in out if p is not None]


def _off_gravity(part: Part) -> float:
    """Smallest relative difference of its rest from gravity over all units."""
    if len(part.axes) < 3:
        return math.inf
    length = float(np.linalg.norm(quiet_part(part.values).mean))
    if length <= 0.0:
        return math.inf
    known = (STANDARD_GRAVITY / s for s in ACCEL_UNITS.values() if s > 0.0)
    return min(abs(math.log(length / g)) for g in known)


def _timed(part: Part) -> Part:
    """Settle the unit of a clock by the duration of the crash."""
    clock = part.clock
    if clock.unit or not clock.column:
        return part
    found = clock_by_pulse(clock, part.values[:, part.axes])
    if found is None:
        return part
    unit, why = found
    factor = TIME_UNITS[unit]
    was = 1.0 / (clock.step * clock.rate)
    settled = replace(
        clock, unit=unit, why=f"{clock.why}; {why}", rate=1.0 / (clock.step * factor), candidates=""
    )
    return replace(part, clock=settled, time=part.time * (factor / was))


def _by_heading(part: Part) -> Part | None:
    for kind, table in (
        ("acceleration", ACCEL_UNITS),
        ("rate", GYRO_UNITS),
        ("velocity", FACTORS["velocity"]),
    ):
        if part.kind == kind and part.unit in table:
            return _scaled(part, kind, part.unit, table[part.unit], "unit by the heading")
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
    if said is None or not said.settled:
        return None
    return _scaled(part, "acceleration", said.unit, ACCEL_UNITS[said.unit], said.why)


def _by_gravity_alone(part: Part, known: Sequence[Part]) -> Part | None:
    """Accelerometer by gravity at rest, in a unit that is not settled."""
    said = _weighed(part, known)
    if said is None or said.gravity < THRESHOLD:
        return None
    return _asked(part, "acceleration", said.unit, ACCEL_UNITS, _accelerations)


def _by_another(part: Part, known: Sequence[Part]) -> Part | None:
    if part.kind not in ("", "acceleration"):
        return None
    for other in sorted(known, key=lambda q: q.path != part.path):
        together = _together(other, part)
        found = same_quantity(*together) if together else None
        if found:
            unit, ratio, correlation = found
            told = (
                f"in {unit} it agrees with {_named(other, part)} (correlation "
                f"{correlation:.2f}, scale {ratio:.3f})"
            )
            if not other.unit:
                # In the same unit, whichever it is.
                return _asked(part, "acceleration", unit, ACCEL_UNITS, _accelerations, told)
            return _scaled(part, "acceleration", unit, ACCEL_UNITS[unit], told)
    return None


def _by_elimination(part: Part, known: Sequence[Part]) -> Part | None:
    values = part.values[:, part.axes]
    quiet = quiet_part(values)
    if part.kind == "velocity":
        return _asked(part, "velocity", "km/h", FACTORS["velocity"], _speeds)
    beside = any(q.path == part.path or _together(q, part) for q in known)
    if part.kind == "rate" or (not part.kind and beside and len(part.axes) == 3):
        said = gyro_unit(part.time, values, quiet)
        why = "" if part.kind else "it does not follow the accelerations, and rests near zero"
        if said.settled:
            return _scaled(
                part,
                "rate",
                said.unit,
                GYRO_UNITS[said.unit],
                "; ".join(filter(None, (why, said.why))),
            )
        return _asked(part, "rate", said.unit, GYRO_UNITS, _rates, why)
    said = accel_unit(part.values, part.step, quiet) if len(part.axes) == 3 else _likeliest(part)
    zeroed = bool(np.abs(quiet.mean).max() < ZEROED * np.abs(values).max())
    return replace(
        _asked(part, "acceleration", said.unit, ACCEL_UNITS, _accelerations),
        zeroed=zeroed,
    )


def _likeliest(part: Part) -> Answer:
    """Likeliest unit by the peak: a crash has tens of g, so more than two hundred is not in g."""
    peak = float(np.nanmax(np.abs(part.values)))
    return Answer("g" if peak < 100.0 else "m/s2" if peak < 5000.0 else "mg", 0.0, "by its size")


def _scaled(part: Part, kind: str, unit: str, factor: float, why: str) -> Part:
    values = part.values * factor
    quiet = quiet_part(values[:, part.axes])
    zeroed = kind == "acceleration" and (
        float(np.linalg.norm(quiet.mean)) < 0.3 * STANDARD_GRAVITY and len(part.axes) == 3
    )
    return replace(
        part, kind=kind, unit=unit, values=values, zeroed=zeroed, unit_why=(*part.unit_why, why)
    )


def _asked(
    part: Part,
    kind: str,
    unit: str,
    table: dict[str, float],
    words: Callable[[Part, str, float], str],
    why: str = "",
) -> Part:
    units = [u for u in table if table[u] > 0.0 and u not in ("mrad/s", "mdeg/s", "deg/h")]
    told = "; ".join(words(part, u, table[u]) for u in units)
    return replace(
        part,
        kind=kind,
        unit="",
        candidates=told,
        values=part.values * table[unit],
        unit_why=(*part.unit_why, *((why,) if why else ())),
    )


def _peak_change(part: Part, factor: float) -> tuple[float, float]:
    """Largest value, and largest change of its integral, of any axis."""
    values = part.values[:, part.axes]
    values = (values - quiet_part(values).mean) * factor
    step = part.step
    sums = np.abs(np.cumsum(values, axis=0) * step)
    return float(np.abs(values).max()), float(sums.max())


def _accelerations(part: Part, unit: str, factor: float) -> str:
    peak, change = _peak_change(part, factor)
    return f'"{unit}" makes a peak of {peak / STANDARD_GRAVITY:.3g} g and {change * 3.6:.3g} km/h'


def _rates(part: Part, unit: str, factor: float) -> str:
    peak, turn = _peak_change(part, factor)
    turned = f"a turn of {np.degrees(turn):.3g} deg"
    return f'"{unit}" makes a peak of {np.degrees(peak):.3g} deg/s and {turned}'


def _speeds(part: Part, unit: str, factor: float) -> str:
    return f'"{unit}" makes {float(np.nanmax(np.abs(part.values))) * factor * 3.6:.3g} km/h'


def _together(known: Part, other: Part) -> tuple[Array, Array] | None:
    """Both at the stamps of the slower one, over their common time."""
    start, end = max(known.time[0], other.time[0]), min(known.time[-1], other.time[-1])
    shorter = min(np.ptp(known.time), np.ptp(other.time))
    if end - start < OVERLAP * shorter:
        return None
    slow, fast = (known, other) if known.step >= other.step else (other, known)
    rows = (slow.time >= start) & (slow.time <= end)
    at = slow.time[rows]
    moved = np.column_stack([np.interp(at, fast.time, fast.values[:, k]) for k in range(3)])
    own = slow.values[rows]
    return (own, moved) if slow is known else (moved, own)


def _named(other: Part, part: Part) -> str:
    names = ", ".join(other.channels.values())
    return names if other.path == part.path else f"{other.path}: {names}"


# Error model of a part without a data sheet: noise from the record, the rest assumed.


GYRO_SCALES = (90.0, 125.0, 250.0, 300.0, 500.0, 1000.0, 2000.0, 4000.0, 8000.0, 20000.0)
# Wide enough for an uncalibrated MEMS part: data sheets give 3 % and 2 % as bounds of the first
# two (MPU-6050 and LSM6DSO), and a zero error of 20 to 100 mg and 1 to 20 deg/s.
SCALE_PERCENT, MISALIGNMENT_DEG = 2.0, 1.0
BIAS_MG, BIAS_DEG_PER_S, G_SENSITIVITY = 60.0, 5.0, 0.1
# A record that was zeroed at rest has lost gravity with its bias.
ZEROED_G = 1.0
# The range ends at least this factor above the largest reading.
HEADROOM = 1.01


def stated_of(
    part: Part, ends: RangeEnds, impact: Impact, finest: Part
) -> tuple[dict[str, float], str]:
    """Error model by keys of the sensor catalogue, and its grounds.

    Parameters
    ----------
    part : Part
        With values in SI.
    ends : RangeEnds
        Range ends of the part.
    impact : Impact
        Impact of its unit.
    finest : Part
        The accelerometer of the lowest range of the unit.
    """
    values = part.values[:, part.axes]
    quiet = quiet_part(values)
    step = float(np.median(np.diff(part.time)))
    # From differences between samples, which contain no motion.
    moved = np.diff(values[: max(quiet.count, 3)], axis=0)
    density = float(np.sqrt(np.mean(moved**2) / 2.0) * math.sqrt(step))
    reached = max(p for p in ends.peak if p == p)
    known = [e for e in ends.ends if e is not None]
    if part.kind == "rate":
        unit = GYRO_UNITS["deg/s"]
        offset = float(np.abs(quiet.mean).max()) / unit
        full = _next(max([reached * HEADROOM, *known]) / unit, GYRO_SCALES)
        numbers = {
            "noise_density_deg_per_s_per_sqrt_hz": density / unit,
            "bias_sd_deg_per_s": max(BIAS_DEG_PER_S, math.ceil(offset)),
            "scale_sd_percent": SCALE_PERCENT,
            "misalignment_sd_deg": MISALIGNMENT_DEG,
            "g_sensitivity_sd_deg_per_s_per_g": G_SENSITIVITY,
            "full_scale_deg_per_s": full,
        }
        return numbers, f"{_why()}; it rests at {offset:.2g} deg/s"
    g = STANDARD_GRAVITY
    offset = 0.0
    told = ""
    if part is not finest and len(part.axes) == 3 and not part.zeroed:
        off = quiet.mean - impact.base
        offset = float(np.abs(off).max()) / g
        told = f"; at rest it is {offset:.2g} g off the finer range, which corrects it"
    elif part.zeroed:
        offset = ZEROED_G
        told = "; it was zeroed at rest, so that gravity is in its bias"
    full = _next(max([reached * HEADROOM, *known]) / g, FULL_SCALES)
    numbers = {
        "noise_density_ug_per_sqrt_hz": density / (1e-6 * g),
        "bias_sd_mg": max(BIAS_MG, 100.0 * math.ceil(10.0 * offset)),
        "scale_sd_percent": SCALE_PERCENT,
        "misalignment_sd_deg": MISALIGNMENT_DEG,
        "full_scale_g": full,
    }
    return numbers, _why() + told


def _why() -> str:
    return (
        "wide enough for a cheap part without a calibration; the noise was found in the record, "
        "the full scale is the next usual one above what it reached"
    )


def _next(value: float, usual: tuple[float, ...]) -> float:
    return next((u for u in usual if u >= value * (1.0 - 1e-6)), float(math.ceil(value)))


# Saturation of a triad, and sensors of the catalogue with that full scale.


# Tolerance of a full scale: converters end a step or two below it, and scale factors are a few
# percent off.
SAME_END = 0.03


@dataclass(frozen=True)
class RangeEnds:
    """Peak readings of a triad, and the range end where it saturated.

    Attributes
    ----------
    peak : tuple of float, (3,)
        Largest magnitude of each axis, SI; NaN where it is missing.
    ends : tuple of float or None, (3,)
        End of the range, where it was found.
    samples : int
        Number of saturated samples.
    sensors : tuple of str
        Sensors of the catalogue with this full scale; where no end was found, those whose range
        includes the peaks.
    """

    peak: tuple[float, ...]
    ends: tuple[float | None, ...]
    samples: int
    sensors: tuple[str, ...]

    @property
    def saturated(self) -> bool:
        """Whether an axis saturated."""
        return any(e is not None for e in self.ends)


def range_ends(part: Part) -> RangeEnds:
    """Find the ends of a triad's range.

    Parameters
    ----------
    part : Part
        Accelerations or rates, with values in SI.
    """
    has = part.axes
    values = part.values[:, has]
    infinite = np.full(len(has), np.inf)
    limits = find_limits(part.time, values, infinite, np.zeros(len(has)))
    peak, ends = [float("nan")] * 3, [None] * 3
    for j, k in enumerate(has):
        peak[k] = float(np.abs(values[:, j]).max())
        if limits.found[j]:
            sizes = [abs(e) for e in (limits.lower[j], limits.upper[j]) if np.isfinite(e)]
            ends[k] = float(max(sizes))  # type: ignore[call-overload]
    fits = [
        name
        for name, full in _full_scales(part.kind).items()
        if all(_fits(peak[k], ends[k], full[k]) for k in has)
    ]
    samples = int(limits.clipped[:, limits.found].any(axis=1).sum()) if limits.found.any() else 0
    return RangeEnds(tuple(peak), tuple(ends), samples, tuple(fits))


def _fits(peak: float, end: float | None, full: float) -> bool:
    if end is not None:
        return abs(end / full - 1.0) <= SAME_END
    return peak <= (1.0 + SAME_END) * full


@cache
def _full_scales(kind: str) -> dict[str, tuple[float, ...]]:
    """Full scales of all sensors of the catalogue with such a triad, SI."""
    found = {}
    for name in SENSORS:
        sensor = load_sensor(name)
        triad = sensor.imu_errors.accel if kind == "acceleration" else sensor.imu_errors.gyro
        own = "accel" if kind == "acceleration" else "gyro"
        if triad is not None and any(f.key.startswith(f"{own}.") for f in sensor.sources):
            found[name] = tuple(float(v) for v in triad.axis("full_scale"))
    return found


def in_words(value: float, kind: str) -> str:
    """Write a magnitude in its customary unit."""
    if kind == "acceleration":
        return f"{value / STANDARD_GRAVITY:.3g} g"
    return f"{value / GYRO_UNITS['deg/s']:.4g} deg/s"
