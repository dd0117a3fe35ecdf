"""Crash tests of the NHTSA database as crash records and tables."""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from strapdown.constants import STANDARD_GRAVITY
from strapdown.errors import DataError, Finding
from strapdown.formats.crash_record import (
    DEFORMS,
    LONGEST_NAME,
    QUANTITIES,
    CrashChannel,
    CrashRecord,
    clean,
    compact,
    position_of,
)
from strapdown.formats.nhtsa import KINDS, Channel, CrashTest, Vehicle, read_nhtsa
from strapdown.tables import imu_table
from strapdown.tables.checks import Array
from strapdown.units import find_unit, si_of

_CODES = tomllib.loads(Path(__file__).with_name("nhtsa_codes.toml").read_text(encoding="utf-8"))
_SEATS, _OCCUPANT, _MOVING = (_CODES[table] for table in ("seats", "occupant", "moving"))
#: Parts of the structure by their codes: in words, and which crash pushes them in, if any.
_STRUCTURE: dict[str, tuple[str, str]] = {
    code: (words, group)
    for group, parts in _CODES["structure"].items()
    for code, words in parts.items()
}
_PLACES = {**_OCCUPANT, **_MOVING, **{code: words for code, (words, _) in _STRUCTURE.items()}}
# Objects with their own motion beside the numbered vehicles.
_OBJECTS = ("SLED", "IMCG", "PEND", "ROLC")
# A comment states a position if it has a word of those of the codes.
_WORDS = {
    word
    for words in (*_PLACES.values(), "seat rear crossmember rocker tunnel trunk cg top bottom base")
    for word in re.findall(r"[a-z]{2,}", words.replace("-pillar", " pillar"))
} - {"of", "and", "the", "vehicle", "other", "nine", "arm", "event", "signal", "test", "device"}
# Codes that name no position.
_NO_CODE = ("", "NA", "OTHR", "OTHER", "UN")
_NO_SEAT = ("", "NA", "00", "OT", "AP")
_STATUS = _CODES["status"]


def read(path: Path) -> CrashRecord:
    """Read a test; samples are read when a channel is used.

    `path`: the header, or its folder. With the channels whose files exist.
    """
    test = read_nhtsa(path)
    there = [c for c in test.channels if c.path is not None]
    vehicles = {v.number for v in test.vehicles} or {c.vehicle for c in there} - {0}
    points = _points(there, vehicles)
    # The only vehicle met a rigid barrier.
    rigid = [fields[0].upper() for fields in test.barrier if fields] == ["R"]
    against = {"against": "barrier"} if rigid and len(test.vehicles) == 1 else {}
    dummies = {
        (fields[0], fields[1]): _DUMMIES.get((fields[2], fields[8]), "")
        for fields in test.occupants
        if len(fields) > 8
    }
    return CrashRecord(
        path=path,
        format="nhtsa",
        title=clean(test.title),
        facts=_facts(test),
        channels=tuple(
            _channel(c, points[c.number], dummies.get((str(c.vehicle), c.occupant), ""))
            for c in there
        ),
        files=(test.path, *(c.path for c in there if c.path is not None)),
        findings=(*test.findings, *_unknown_codes(there, test.path)),
        vehicles={str(v.number): _stated(_vehicle(v) | against) for v in test.vehicles},
    )


def _facts(test: CrashTest) -> dict[str, str]:
    number = "".join(c for c in test.path.stem if c.isdigit())
    return _stated(
        {
            "test": number.lstrip("0"),
            "objective": test.objective,
            "date": test.date,
            "laboratory": test.performer,
            "contract": test.reference,
            "recorder": test.comment,
            "closing speed, m/s": _plain(test.closing_speed),
            "impact angle, deg": _plain(test.impact_angle_deg),
        }
    )


def _stated(facts: dict[str, str]) -> dict[str, str]:
    return {k: clean(v) for k, v in facts.items() if v not in ("", "nan")}


def _vehicle(vehicle: Vehicle) -> dict[str, str]:
    name = f"make {vehicle.make}, model {vehicle.model}, {vehicle.year or 'year unknown'}"
    if not vehicle.model and vehicle.year is None:
        # Words, not codes of the database.
        name = vehicle.make
    return {
        "vehicle": name,
        "vin": "" if vehicle.vin.upper() in ("NA", "UN", "UNKNOWN") else vehicle.vin,
        "mass_kg": _plain(vehicle.mass),
        "length_m": _plain(vehicle.length),
        "width_m": _plain(vehicle.width),
        "wheelbase_m": _plain(vehicle.wheelbase),
        "cg_behind_front_axle_m": _plain(vehicle.cg_behind_front_axle),
        "speed_m_per_s": _plain(vehicle.speed),
        "crab_deg": _plain(vehicle.crab_deg) if vehicle.crab_deg else "",
    }


def _plain(value: float) -> str:
    """Format a number as in the header, without rounding errors of its factor to SI."""
    return "" if math.isnan(value) else f"{value:.10g}"


class _Point(NamedTuple):
    """Where a channel was measured: vehicle and point as in `CrashChannel`, position in words."""

    vehicle: str
    body: str
    point: str
    place: str


def _points(channels: Sequence[Channel], vehicles: set[int]) -> dict[int, _Point]:
    """Measuring point of each channel, by its number.

    Channels with one location code are at one point, unless their comments name several positions.
    """
    comments = _positions(channels)
    blocks: dict[tuple[int, str, str], list[Channel]] = {}
    for channel in channels:
        blocks.setdefault((channel.vehicle, *_code(channel)), []).append(channel)
    out = {}
    for (_, location, seat), block in blocks.items():
        spelled: dict[str, str] = {}
        for channel in block:
            spelled.setdefault(compact(comments[channel.number]), comments[channel.number])
        named = [key for key in spelled if key]
        for channel in block:
            place = comments[channel.number]
            point = f"{location}/{seat}" if seat else location
            if location in _NO_CODE and not place:
                # Nothing says what it has in common with another channel.
                point = f"{point or 'channel'} {channel.number}"
            elif len(named) > 1 or location in _NO_CODE:
                point += f"/{compact(place)}"
            elif named:
                place = spelled[named[0]]
            words = _PLACES.get(location, "" if location in _NO_CODE else location)
            vehicle, body = _body(channel, vehicles)
            out[channel.number] = _Point(
                vehicle, body, clean(point), clean(place or words or point)
            )
    return out


def code_of_place(point: str, body: str, place: str) -> tuple[str, str]:
    """Location code and seat for a channel, as `CrashChannel` has its point, body and position.

    The code is ``OTHR`` for the structure at a position without a code; empty for a moving part
    without one.
    """
    location, seat = (*point.split("/"), "")[:2]
    if re.fullmatch(r"[A-Z0-9]{4}", location) and (location in _PLACES or body == "vehicle"):
        return location, seat if re.fullmatch(r"[A-Z0-9]{2}", seat) else ""
    if body == "vehicle":
        words = {compact(text): code for code, (text, _) in _STRUCTURE.items()}
        return words.get(compact(place), "OTHR"), ""
    if body in ("barrier", "fixed barrier"):
        return "OTHR", ""
    for code, text in _MOVING.items():
        if text == body:
            return code, ""
    for number, who in _SEATS.items():
        for code, text in _OCCUPANT.items():
            if body == f"{who}'s {text}":
                return code, number
    return "", ""


def _code(channel: Channel) -> tuple[str, str]:
    """Location and seat of a channel; the seat is empty where it has none."""
    seat = channel.occupant.upper()
    return channel.location.upper(), "" if seat in _NO_SEAT else seat


def _positions(channels: Sequence[Channel]) -> dict[int, str]:
    """Position that the comment of each channel names; empty where it names none.

    A text used for several location codes of a vehicle names no position.
    """
    texts: dict[int, str] = {}
    codes: dict[tuple[int, str], set[tuple[str, str]]] = {}
    for channel in channels:
        text = position_of(channel.comment)
        if _WORDS.isdisjoint(re.findall(r"[a-z]{2,}", text.lower())):
            text = ""
        texts[channel.number] = text
        codes.setdefault((channel.vehicle, compact(text)), set()).add(_code(channel))
    shared = {key for key, used in codes.items() if len(used) > 1}
    for channel in channels:
        if (channel.vehicle, compact(texts[channel.number])) in shared:
            texts[channel.number] = ""
    return texts


def _unknown_codes(channels: Sequence[Channel], file: Path) -> list[Finding]:
    """Say which sensors of motion are fixed to parts that may not be rigid."""
    codes: dict[str, list[str]] = {}
    for c in channels:
        location, seat = _code(c)
        if c.kind in ("AC", "AV") and location not in _PLACES and not seat and c.vehicle:
            codes.setdefault(location or "none", []).append(str(c.number))
    return [
        Finding(
            "io.location-code-unknown",
            severity="note",
            file=file.name,
            quantity=f"channels {', '.join(numbers)}",
            word=clean(code, LONGEST_NAME),
        )
        for code, numbers in codes.items()
    ]


# Type and percentile of a dummy in the header, and its code of ISO MME.
_DUMMIES = {("H3", "50"): "H3", ("H3", "05"): "HF", ("H3", "95"): "HM", ("TH", "50"): "TH"}


def _channel(channel: Channel, at: _Point, dummy: str) -> CrashChannel:
    assert channel.path is not None
    known = find_unit(channel.unit, KINDS)
    quantity, _, factor = si_of(channel.unit, KINDS) or ("other", "", 1.0)
    axis = channel.axis[:1].lower()
    hz = channel.prefilter_hz
    low_pass = "" if math.isnan(hz) else f"{hz:g} Hz before the sampler"
    return CrashChannel(
        name=str(channel.number),
        quantity=quantity if quantity in QUANTITIES else "other",
        axis=axis if axis in ("x", "y", "z") else "",
        unit=known[1] if known else clean(channel.unit, LONGEST_NAME),
        load=_loader(channel),
        sampling="instantaneous",
        place=at.place,
        body=at.body,
        vehicle=at.vehicle,
        point=at.point,
        low_pass=low_pass,
        remarks=tuple(clean(r) for r in _remarks(channel)),
        full_scale=None if math.isnan(channel.rating) else channel.rating * factor,
        bandwidth=None if math.isnan(hz) or hz <= 0.0 else hz,
        file=channel.path.name,
        dummy=dummy,
    )


def _body(channel: Channel, vehicles: set[int]) -> tuple[str, str]:
    """Vehicle of a channel, empty for what is fixed to the ground, and its body."""
    location, seat = _code(channel)
    place = _PLACES.get(location, f"part {channel.location}")
    if channel.vehicle not in vehicles:
        # Objects that the header does not list as vehicles move where their codes say so.
        if location in _OBJECTS:
            return str(channel.vehicle), "vehicle"
        zero = channel.vehicle == 0
        return "", "barrier" if zero else f"object {channel.vehicle}, which is no listed vehicle"
    number = str(channel.vehicle)
    if location in _OCCUPANT or (seat and location not in _PLACES):
        who = _SEATS.get(seat, f"occupant {seat}".strip())
        return number, clean(f"{who}'s {place}")
    return number, place if location in _MOVING else "vehicle"


def _remarks(channel: Channel) -> list[str]:
    known = _STATUS.get(channel.status.upper(), "")
    remarks = [f"status {channel.status}" + (f", {known}" if known else "")]
    remarks.append("primary" if channel.primary else "redundant")
    location = _code(channel)[0]
    words = f" ({_PLACES[location]})" if location in _PLACES else ""
    remarks.append(f"location {channel.location}{words}, axis {channel.axis}")
    if DEFORMS.get(_STRUCTURE.get(location, ("", ""))[1]):
        remarks.append(DEFORMS[_STRUCTURE[location][1]])
    if channel.maker:
        remarks.append(channel.maker)
    if channel.calibrated:
        remarks.append(f"calibrated {channel.calibrated}")
    if channel.comment:
        bad = channel.status != "AM"
        remarks.append(f"{'the laboratory says' if bad else 'comment'}: {channel.comment}")
    return remarks


def _loader(channel: Channel) -> Callable[[], tuple[Array, Array]]:
    def load() -> tuple[Array, Array]:
        time, values = channel.recorded
        *_, factor = si_of(channel.unit, KINDS) or ("", 1.0)
        return time, values * factor

    return load


# Selection of crash test channels by location and axis, and of six as an Imu table.


def accelerations(
    test: CrashTest,
    location: str | None = None,
    *,
    axis: str | None = None,
    occupant: str | None = None,
    vehicle: int | None = None,
) -> tuple[Channel, ...]:
    """Select accelerometers whose samples are available.

    Parameters
    ----------
    test : CrashTest
    location : str, optional
        Code of the location, or its beginning: ``FLLR``, ``FL``.
    axis : str, optional
        ``X``, ``Y``, ``Z``, or the code with its frame, ``XG``.
    occupant : str, optional
        ``01``, ``02``; ``NA`` for the vehicle itself.
    vehicle : int, optional

    Returns
    -------
    tuple of Channel
        In the order of the header; including failed ones, see their `status`.

    Raises
    ------
    DataError
        No channel fits.
    """
    found = tuple(
        c
        for c in test.channels
        if c.kind == "AC"
        and c.present
        and (location is None or c.location.startswith(location.upper()))
        and (axis is None or c.axis.startswith(axis.upper()))
        and (occupant is None or c.occupant == occupant)
        and (vehicle is None or c.vehicle == vehicle)
    )
    if not found:
        places = dict.fromkeys(c.location for c in test.channels if c.kind == "AC" and c.present)
        raise DataError(
            "io.nhtsa-no-such-channel",
            file=test.path.name,
            quantity="location",
            location=location or "any place",
            axis=axis or "any",
            occupant=occupant or "any",
            word=(location or "").upper(),
            known=places,
        )
    return found


def imu_of(
    test: CrashTest,
    accel: tuple[int, int, int],
    gyro: tuple[int, int, int],
    *,
    rest_force: tuple[float, float, float] = (0.0, 0.0, -STANDARD_GRAVITY),
    until: float = 0.0,
) -> pd.DataFrame:
    """Combine six channels of one body into an Imu table.

    Parameters
    ----------
    test : CrashTest
    accel, gyro : triple of int
        Numbers of the channels along X, Y and Z.
    rest_force : triple, m/s², optional
        Specific force of the body before the impact, in its axes. The channels are zeroed there,
        so it is added after subtracting their own mean before `until`. It sets the attitude of
        the body; the default is upright.
    until : float, s
        End of the initial interval, in which the body is stationary or at constant velocity.

    Returns
    -------
    DataFrame
        An Imu table; time from the impact.

    Raises
    ------
    DataError
        A channel is not an accelerometer or an angular rate sensor, the stamps differ, or there
        are fewer than two samples before `until`.
    """
    values = []
    for numbers, unit in ((gyro, "rad/s"), (accel, "m/s2")):
        for number in numbers:
            channel = test.channel(number)
            if channel.si_unit != unit:
                raise DataError(
                    "io.needed-2",
                    file=test.path.name,
                    quantity=f"channel {number}",
                    name=channel.name,
                    unit=channel.unit,
                    unit_2=unit,
                )
            values.append(channel.table["value"])
    time = values[0].index.to_numpy(dtype=np.float64)
    for series, number in zip(values, (*gyro, *accel), strict=True):
        if not np.array_equal(series.index.to_numpy(), time):
            raise DataError(
                "io.stamps-not-those-channel",
                file=test.path.name,
                quantity=f"channel {number}",
                gyro=gyro[0],
            )
    table = np.column_stack([s.to_numpy(dtype=np.float64) for s in values])
    before = time < until
    if before.sum() < 2:
        raise DataError(
            "io.samples-before",
            file=test.path.name,
            quantity="time",
            before=int(before.sum()),
            until=until,
        )
    table -= table[before].mean(axis=0)
    table[:, 3:] += np.asarray(rest_force, dtype=np.float64)
    return imu_table(time, table[:, :3], table[:, 3:], source=test.path.name)
