"""Crash indices of a case: of the vehicle, from its answer, and of occupants, from its records.

The vehicle's (OLC, ASI, OIV, ORA, THIV, PHD) are those of the motion at the reference point, with
the 95 % bound by every unknown of the error budget and by the onset of the contact. The occupants'
are those of channels that a record of NHTSA or ISO MME codes as an occupant's head, chest, neck or
femur; what their sensors are uncertain by is not stated, so they have no bound.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from strapdown.constants import STANDARD_GRAVITY, TWO_SIDED_95
from strapdown.crash import indices
from strapdown.crash.reconstruction import UnitReconstruction
from strapdown.dsp.channel_class import CHANNEL_CLASSES, LEAST_RATE, cfc_filter
from strapdown.errors import DataError, Finding
from strapdown.formats.crash_record import CrashChannel, CrashRecord
from strapdown.units import FACTORS, find_unit

Array = NDArray[np.float64]


@dataclass(frozen=True)
class CrashIndex:
    """One index of a vehicle or an occupant.

    Attributes
    ----------
    name : str
        As ``HIC15``.
    of : str
        Answer of the vehicle, or occupant.
    value : float or None
        None where it is not defined; `because` says why.
    unit : str
        Empty for a number without unit.
    standard : str
        Document that defines it.
    low, high : float or None
        95 % bound; None where none is known.
    limit : float or None
        Of the standard, for this dummy.
    channels : tuple of str
        Of an occupant: channels of the record, and their class.
    detail : str
        Further: smoothing, kind of load, surface that is hit.
    at_least : bool
        The record is a part of the pulse, or clipped: the value is at least so far from zero, and
        the bound is open on that side; on both where it has either sign.
    """

    name: str
    of: str
    value: float | None
    unit: str
    standard: str
    low: float | None = None
    high: float | None = None
    limit: float | None = None
    channels: tuple[str, ...] = ()
    detail: str = ""
    at_least: bool = False
    because: Finding | None = None


# Indices of the vehicle, from the motion of its reference point.


class _Definition(NamedTuple):
    """Index of a vehicle: its key in `_evaluate`, and whether it has a sign."""

    key: str
    name: str
    unit: str
    standard: str
    detail: str
    signed: bool = False


_EN, _MASH = "EN 1317-1", "NCHRP Report 350; MASH"
_SPACE, _MEANS = "0.6 m ahead, 0.3 m aside", "means over 10 ms"
_VEHICLE = (
    _Definition("olc", "OLC", "g", "Euro NCAP TB 027", "65 mm free, 300 mm in all"),
    _Definition("asi_2010", "ASI", "", f"{_EN}:2010", "13 Hz"),
    _Definition("asi_1998", "ASI", "", f"{_EN}:1998", "means over 50 ms"),
    _Definition("oiv_x", "OIV forward", "m/s", _MASH, _SPACE, True),
    _Definition("oiv_y", "OIV right", "m/s", _MASH, _SPACE, True),
    _Definition("ora_x_g", "ORA forward", "g", _MASH, _MEANS, True),
    _Definition("ora_y_g", "ORA right", "g", _MASH, _MEANS, True),
    _Definition("thiv", "THIV", "m/s", f"{_EN}; MASH", _SPACE),
    _Definition("phd", "PHD", "g", f"{_EN}:1998; MASH", _MEANS),
)


def _evaluate(
    time: Array, accel: Array, rate: Array, start: float
) -> dict[str, float | Finding | None]:
    """All indices of a vehicle: each a number, None, or the error that prevents it."""
    found: dict[str, float | Finding | None] = {}

    def of(keys: Sequence[str], call: Callable[[], Sequence[float | None]]) -> None:
        try:
            found.update(zip(keys, call(), strict=True))
        except DataError as error:
            found.update(dict.fromkeys(keys, error.finding))

    def flail() -> Sequence[float | None]:
        space = indices.flail_space(time, accel, start=start)
        if space.at is None:
            return [None] * 4
        return [space.oiv_x, space.oiv_y, space.ora_x_g, space.ora_y_g]

    def head() -> Sequence[float | None]:
        free = indices.thiv(time, accel, rate, start=start)
        return [free.velocity, free.phd_g]

    of(["olc"], lambda: [indices.olc(time, accel[:, 0], start=start).value_g])
    of(["asi_2010"], lambda: [indices.asi(time, accel).value])
    of(["asi_1998"], lambda: [indices.asi(time, accel, average="mean_50ms").value])
    of(["oiv_x", "oiv_y", "ora_x_g", "ora_y_g"], flail)
    of(["thiv", "phd"], head)
    return found


def vehicle_indices(unit: UnitReconstruction, number: int) -> tuple[CrashIndex, ...]:
    """Indices of an event, at the reference point, with 95 % bounds.

    Parameters
    ----------
    unit : UnitReconstruction
    number : int
        Of the event, from 0.

    Notes
    -----
    The bound is linear in each unknown of the error budget: the difference of the index with the
    acceleration and yaw rate of one standard deviation more, and with the onset of the contact one
    later. To ORA and PHD, each the greatest of many means over 10 ms, what the greatest of as many
    means of white noise is expected to reach is added: sqrt(2 ln m) standard deviations of m. An
    index that is undefined after a shift has no bound.
    """
    contact = unit.body[number].contact
    time, accel = unit.acceleration.time, unit.acceleration.values
    effects, rate = unit.at_point.effects, unit.at_point.rate[:, 2]
    force, yaw = effects.force - effects.rest_force[:, None], effects.rate[:, :, 2]
    if unit.acceleration.sampling == "mean":
        # A mean over the step that ends at the stamp is that of its middle.
        time = time - 0.5 * float(np.median(np.diff(time)))
    # Without the events before and after it.
    begins = unit.events.events[number - 1].end if number else -math.inf
    later = unit.events.events[number + 1 :]
    part = (time >= begins) & (time < (later[0].time_zero if later else math.inf))
    time, accel, rate, force, yaw = (
        time[part],
        accel[part],
        rate[part],
        force[:, part],
        yaw[:, part],
    )
    start = contact.start.time
    values = _evaluate(time, accel, rate, start)
    shifted = [
        _evaluate(time, accel + f, rate + r, start)
        for f, r in zip(force, yaw, strict=True)
        if f.any() or r.any()
    ]
    shifted.append(_evaluate(time, accel, rate, start + contact.start.sd))
    frontal = unit.types[number].name == "front"
    noise = np.median(effects.force_noise[part], axis=0) / STANDARD_GRAVITY
    window, step = indices.RIDEDOWN_WINDOW, float(np.median(np.diff(time)))
    count = max((float(time[-1]) - start) / window, 2.0)
    greatest = noise * math.sqrt(min(step / window, 1.0) * 2.0 * math.log(count))
    of_noise = {"ora_x_g": greatest[0], "ora_y_g": greatest[1], "phd": float(max(greatest[:2]))}
    found = []
    for each in _VEHICLE:
        index = CrashIndex(each.name, unit.name, None, each.unit, each.standard, detail=each.detail)
        value = values[each.key]
        if each.key == "olc" and not frontal:
            value = Finding("crash.index-frontal-only", severity="note", quantity=each.name)
        elif value is None:
            value = Finding("crash.index-not-reached", severity="note", quantity=each.name)
        if isinstance(value, Finding):
            found.append(replace(index, because=value))
            continue
        others = [one[each.key] for one in shifted]
        low = high = None
        if all(isinstance(other, float) for other in others):
            half = TWO_SIDED_95 * math.dist([value] * len(others), others)  # type: ignore[arg-type]
            half += float(of_noise.get(each.key, 0.0))
            low, high = value - half, value + half
            if each.signed and each.key in of_noise and half >= abs(value):
                # The greatest by size may be that of the other sign.
                low, high = -abs(value) - half, abs(value) + half
            low = low if each.signed else max(low, 0.0)
        least = unit.body[number].event.at_least
        if least and low is not None and high is not None:
            low = low if value >= 0.0 and (low > 0.0 or not each.signed) else None
            high = high if value < 0.0 and high < 0.0 else None
        found.append(replace(index, value=value, low=low, high=high, at_least=least))
    return tuple(found)


# Indices of occupants, from the channels of a record.


class _Signal(NamedTuple):
    """Channels of one body part along the axes, filtered, with common stamps."""

    time: Array
    values: Mapping[str, Array]
    channels: tuple[str, ...]
    dummy: str


def occupant_indices(
    records: Sequence[CrashRecord], vehicles: Sequence[str]
) -> tuple[CrashIndex, ...]:
    """Indices of every occupant of some vehicles whose channels the records have.

    Parameters
    ----------
    records : sequence of CrashRecord
    vehicles : sequence of str
        `CrashChannel.vehicle` of each.

    Returns
    -------
    tuple of CrashIndex
        By occupant; of a body part with redundant sensors also by these. Channels that the
        laboratory calls failed are left out.
    """
    found: list[CrashIndex] = []
    for record in records:
        parts: dict[str, dict[tuple[str, bool], list[CrashChannel]]] = {}
        for channel in record.channels:
            who, _, part = channel.body.partition("'s ")
            if channel.vehicle in vehicles and part and not channel.failure:
                key = (_SIDES.get(channel.point[5:7], "") + part, "redundant" in channel.remarks)
                parts.setdefault(who, {}).setdefault(key, []).append(channel)
        for who, channels in parts.items():
            for (part, spare), of in channels.items():
                for index in _part_indices(part, of):
                    again = ", redundant sensors" if spare else ""
                    found.append(replace(index, of=who, detail=index.detail + again))
    return tuple(found)


# Fine location 1 of a channel code of ISO MME.
_SIDES = {"LE": "left ", "RI": "right ", "UP": "upper "}
_FMVSS = "49 CFR 571.208"


def _part_indices(part: str, channels: Sequence[CrashChannel]) -> Iterator[CrashIndex]:
    """Indices of one part of an occupant's body."""
    if part in ("head", "chest", "thoracic spine"):
        yield from _accelerations(part, [c for c in channels if c.quantity == "acceleration"])
    if part == "chest":
        yield from _deflection([c for c in channels if c.quantity == "displacement"])
    if part in ("neck", "upper neck"):
        yield from _neck(channels)
    if part in ("left femur", "right femur"):
        yield from _femur(part, [c for c in channels if c.quantity == "force"])


def _accelerations(part: str, channels: Sequence[CrashChannel]) -> Iterator[CrashIndex]:
    if not channels:
        return
    cfc, head = (1000, True) if part == "head" else (180, False)
    names = ("HIC15", "HIC36", "head 3 ms") if head else ("chest 3 ms",)
    signal = _signal(channels, "xyz", cfc)
    if isinstance(signal, Finding):
        yield from (CrashIndex(n, "", None, "", _FMVSS, because=signal) for n in names)
        return
    accel = np.column_stack([signal.values[axis] for axis in "xyz"])
    detail = f"CFC {cfc}"
    if head:
        for name, longest, limit in (("HIC15", 0.015, 700.0), ("HIC36", 0.036, 1000.0)):
            hic = indices.hic(signal.time, accel, longest=longest)
            window = f"{detail}, {1e3 * hic.begin:.1f} to {1e3 * hic.end:.1f} ms"
            yield CrashIndex(
                name,
                "",
                hic.value,
                "",
                f"{_FMVSS}, S6.2",
                limit=limit,
                detail=window,
                channels=signal.channels,
            )
    size = np.sqrt((accel * accel).sum(axis=1)) / STANDARD_GRAVITY
    level = indices.exceeded_level(signal.time, size)
    where = "ECE R94, 5.2.1" if head else f"{_FMVSS}, S6.3"
    most = None if head else 60.0
    yield CrashIndex(
        names[-1], "", level, "g", where, limit=most, detail=detail, channels=signal.channels
    )


def _deflection(channels: Sequence[CrashChannel]) -> Iterator[CrashIndex]:
    name = "chest deflection"
    if not channels:
        return
    signal = _signal(channels, "x", 600)
    if isinstance(signal, Finding):
        yield CrashIndex(name, "", None, "mm", f"{_FMVSS}, S6.4", because=signal)
        return
    limit = {"H3": 63.0, "HF": 52.0}.get(signal.dummy)
    yield CrashIndex(
        name,
        "",
        1e3 * float(np.abs(signal.values["x"]).max()),
        "mm",
        f"{_FMVSS}, S6.4",
        limit=limit,
        channels=signal.channels,
        detail="CFC 600",
    )


def _neck(channels: Sequence[CrashChannel]) -> Iterator[CrashIndex]:
    forces = [c for c in channels if c.quantity == "force" and c.axis in ("x", "z")]
    moments = [c for c in channels if find_unit(c.unit, ("moment",)) and c.axis == "y"]
    if not forces:
        return
    where = f"{_FMVSS}, S6.6"
    empty = CrashIndex("Nij", "", None, "", where)
    force = _signal(forces, "xz", 600)
    moment = _signal(moments, "y", 600)
    for signal in (force, moment):
        if isinstance(signal, Finding):
            yield replace(empty, because=signal)
            return
    assert not isinstance(force, Finding) and not isinstance(moment, Finding)
    if force.dummy not in indices.NECK_INTERCEPTS:
        why = Finding("crash.index-dummy-unknown", severity="note", quantity="Nij")
        yield replace(empty, because=why, channels=(*force.channels, *moment.channels))
        return
    about = np.interp(force.time, moment.time, moment.values["y"])
    found = indices.nij(
        force.time,
        force.values["x"],
        force.values["z"],
        about,
        intercepts=indices.NECK_INTERCEPTS[force.dummy],
    )
    told = f"CFC 600, {found.kind} at {1e3 * found.at:.1f} ms"
    together = (*force.channels, *moment.channels)
    yield replace(empty, value=found.value, limit=1.0, detail=told, channels=together)
    axial = force.values["z"]
    limits = {"H3": (4170.0, 4000.0), "HF": (2620.0, 2520.0)}[force.dummy]
    for name, value, limit in zip(
        ("neck tension", "neck compression"), (axial.max(), -axial.min()), limits, strict=True
    ):
        yield CrashIndex(
            name, "", max(float(value), 0.0), "N", where, limit=limit, channels=force.channels[-1:]
        )


def _femur(part: str, channels: Sequence[CrashChannel]) -> Iterator[CrashIndex]:
    name = f"{part} compression"
    axial = [c for c in channels if c.axis == "z"] or [c for c in channels if not c.axis]
    if not axial:
        return
    axis = axial[0].axis
    signal = _signal(axial, axis or "-", 600)
    if isinstance(signal, Finding):
        yield CrashIndex(name, "", None, "N", f"{_FMVSS}, S6.5", because=signal)
        return
    values = signal.values[axis or "-"]
    yield CrashIndex(
        name,
        "",
        max(float(-values.min()), 0.0),
        "N",
        f"{_FMVSS}, S6.5",
        limit={"H3": 10_000.0, "HF": 6805.0}.get(signal.dummy),
        channels=signal.channels,
        detail="CFC 600",
    )


def _signal(channels: Sequence[CrashChannel], axes: str, cfc: int) -> _Signal | Finding:
    """Load the channel of each axis and filter it; or say why that is not possible."""
    chosen: dict[str, CrashChannel] = {}
    for channel in channels:
        axis = channel.axis.lstrip("-") or "-"
        if axis in chosen:
            names = f"{chosen[axis].name}, {channel.name}"
            return Finding("crash.index-axis-twice", severity="note", quantity=names, axis=axis)
        chosen[axis] = channel
    missing = [axis for axis in axes if axis not in chosen]
    if missing:
        return Finding("crash.index-axis-missing", severity="note", axis=", ".join(missing))
    time: Array | None = None
    values: dict[str, Array] = {}
    for axis in axes:
        channel = chosen[axis]
        try:
            stamps, read = channel.load()
            sign = -1.0 if channel.axis.startswith("-") else 1.0
            filtered = _filtered(channel, stamps, sign * _factor(channel) * read, cfc)
        except DataError as error:
            return error.finding
        if isinstance(filtered, Finding):
            return filtered
        time = stamps if time is None else time
        values[axis] = np.interp(time, stamps, filtered)
    assert time is not None
    dummies = {c.dummy for c in chosen.values()}
    return _Signal(
        time,
        values,
        tuple(chosen[axis].name for axis in axes),
        dummies.pop() if len(dummies) == 1 else "",
    )


def _factor(channel: CrashChannel) -> float:
    """Factor to SI of a quantity that a record does not convert."""
    found = find_unit(channel.unit, ("moment",)) if channel.quantity == "other" else None
    return 1.0 if found is None else FACTORS[found[0]][found[1]]


def _filtered(channel: CrashChannel, time: Array, values: Array, cfc: int) -> Array | Finding:
    """Values in the class of the standard: one that has been applied is not repeated."""
    applied = next(
        (c for c in CHANNEL_CLASSES if f"CFC {c:g}" in channel.low_pass.split("; ")), None
    )
    if applied is not None and applied < cfc:
        return Finding(
            "crash.index-class-too-low",
            severity="note",
            quantity=channel.name,
            applied=applied,
            cfc=cfc,
        )
    if applied == cfc:
        return values
    step = indices.step_of(time)
    if 1.0 / step < LEAST_RATE * cfc * (1.0 - 1e-6):
        return Finding(
            "crash.index-rate-too-low",
            severity="note",
            quantity=channel.name,
            rate=1.0 / step,
            cfc=cfc,
            least=LEAST_RATE * cfc,
        )
    return cfc_filter(values, step, cfc)
