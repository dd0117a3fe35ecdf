"""Which triads are one recorder, and which recorders lend each other a gyro."""

from __future__ import annotations

import itertools
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import PurePath

import numpy as np

from strapdown.systems.crash_draft.impact import Impact, find_impact
from strapdown.systems.crash_draft.parts import Part, Skipped
from strapdown.systems.crash_draft.range_ends import RangeEnds, in_words, range_ends
from strapdown.systems.crash_draft.triad_kind import regress

__all__ = ["Unit", "group_units"]

# Impacts on one clock are felt this near to each other, or within three steps of the slower.
SAME_INSTANT = 0.01  # s
STEPS = 3.0
# Two ranges of one housing feel the same.
SAME_PLACE = 0.8
SAME_SCALE = 0.25
# A gyro's clock is that of the accelerometer where it begins to turn within this of the impact.
TURNS_WITHIN = 0.15  # s
TURNS = 8.0
_RANGE_WORDS = re.compile(
    r"(?<![a-z])(low|high|lo|hi|lg|hg|nd|hd|acc\w*|gyr\w*|gyro|imu|rate\w*|drehrate\w*|beschl\w*"
    r"|\d+ ?g|a|w|g)(?![a-z])"
)


@dataclass(frozen=True, eq=False)
class Unit:
    """A recorder, as far as it was made out.

    Attributes
    ----------
    name : str
    accelerometers : tuple of Part
        The lowest range first.
    gyro : Part or None
    gyro_from : str
        Name of the unit that lends one; empty where there is none.
    impact : Impact or None
        None where nothing of it can be read against time.
    ends : dict of int to RangeEnds
        Of each accelerometer, and of the gyro under -1.
    why : tuple of str
        Why these triads are one unit, and no other is in it.
    """

    name: str
    accelerometers: tuple[Part, ...]
    gyro: Part | None
    gyro_from: str
    impact: Impact
    ends: dict[int, RangeEnds]
    why: tuple[str, ...] = field(default=())


def group_units(parts: Sequence[Part]) -> tuple[list[Unit], list[Skipped]]:
    """Put triads together to units.

    Parameters
    ----------
    parts : sequence of Part
        Accelerations and rates, with kind and likeliest unit settled.

    Returns
    -------
    units : list of Unit
        In the order of their first triad.
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
    """When it first felt half of what the lower range reaches, on its clock."""
    size = np.abs(part.free).max(axis=1)
    over = size > 0.5 * min(reach, float(size.max()))
    return float(part.time[int(np.argmax(over))])


def _owner(
    gyro: Part, drafts: Sequence[tuple[list[Part], Impact, list[str]]], taken: dict[int, Part]
) -> tuple[int | None, str]:
    """Whose gyro it is, and why."""
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
    """Whether it turns more after the impact than before, and does so there."""
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
    """Short names, one a unit: of the files, else of the columns."""
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
    """With what all names begin."""
    together = itertools.takewhile(lambda chars: len(set(chars)) == 1, zip(*names, strict=False))
    return "".join(chars[0] for chars in together)


def _stem(part: Part) -> str:
    return _RANGE_WORDS.sub(" ", PurePath(part.path).stem.lower().replace("_", " ")).strip()


def _of(part: Part) -> str:
    names = list(part.channels.values())
    shown = ", ".join(names)
    return f"{shown} of {PurePath(part.path).name}"
