"""Crash tests of the NHTSA database as crash records and tables."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.constants import STANDARD_GRAVITY
from strapdown.errors import DataError
from strapdown.formats.crash_record import LONGEST_NAME, CrashChannel, CrashRecord, clean
from strapdown.formats.nhtsa import UNITS, Channel, CrashTest, Vehicle, read_nhtsa
from strapdown.formats.signs import Signs
from strapdown.tables import imu_table

__all__ = ["accelerations", "detect", "imu_of", "read"]


Array = NDArray[np.float64]

# SI unit to quantity; moments and others are "other".
_QUANTITY = {
    "m/s2": "acceleration",
    "rad/s": "rate",
    "m/s": "velocity",
    "m": "displacement",
    "N": "force",
}
# In the spelling of this package, where it has one.
_SPELLED = {"G'S": "g", "G": "g", "M/S2": "m/s2", "DPS": "deg/s", "DEG/SEC": "deg/s"} | {
    "RAD/S": "rad/s",
    "NWT": "N",
    "N": "N",
    "MM": "mm",
    "KPH": "km/h",
}
# Seats and locations of the NHTSA Test Reference Guide, Version 5, Volume I, tables of codes, where
# the meaning is plain; other codes are shown unchanged.
_SEATS = {"01": "driver", "02": "front passenger", "03": "front centre passenger"} | {
    "04": "left rear passenger",
    "05": "centre rear passenger",
    "06": "right rear passenger",
}
_PLACES = {
    "HDCG": "head",
    "CHST": "chest",
    "PVCN": "pelvis",
    "NEKU": "upper neck",
    "NEKL": "lower neck",
    "FMRL": "left femur",
    "FMRR": "right femur",
    "ENGN": "engine",
    "FLLR": "floor, left rear",
    "FLRR": "floor, right rear",
    "VECG": "centre of gravity",
}
_STATUS = {"AM": "as measured", "CF": "channel failed", "NO": "no data"}


detect = Signs(named=(".ev5",), first=rb"\A.{0,4081}?----- EV5 -----", inside="*.ev5")


def read(path: Path) -> CrashRecord:
    """Read a test; samples are read when a channel is used.

    Parameters
    ----------
    path : Path
        The header, or its folder.

    Returns
    -------
    CrashRecord
        With the channels whose files exist.
    """
    test = read_nhtsa(path)
    there = [c for c in test.channels if c.path is not None]
    vehicles = {v.number for v in test.vehicles} or {c.vehicle for c in there} - {0}
    return CrashRecord(
        path=path,
        format="nhtsa",
        title=clean(test.title),
        facts=_facts(test),
        channels=tuple(_channel(c, vehicles) for c in there),
        files=(test.path, *(c.path for c in there if c.path is not None)),
        findings=test.findings,
    )


def _facts(test: CrashTest) -> dict[str, str]:
    number = "".join(c for c in test.path.stem if c.isdigit())
    facts = {
        "test": number.lstrip("0"),
        "objective": test.objective,
        "date": test.date,
        "laboratory": test.performer,
        "contract": test.reference,
        "recorder": test.comment,
        "closing speed, m/s": _plain(test.closing_speed),
        "impact angle, deg": _plain(test.impact_angle_deg),
    }
    for vehicle in test.vehicles:
        one = "" if len(test.vehicles) == 1 else f"vehicle {vehicle.number}: "
        facts |= {one + key: value for key, value in _vehicle(vehicle).items()}
    return {k: clean(v) for k, v in facts.items() if v not in ("", "nan")}


def _vehicle(vehicle: Vehicle) -> dict[str, str]:
    return {
        "vehicle": f"make {vehicle.make}, model {vehicle.model}, {vehicle.year or 'year unknown'}",
        "vin": vehicle.vin,
        "mass_kg": _plain(vehicle.mass),
        "length_m": _plain(vehicle.length),
        "width_m": _plain(vehicle.width),
        "wheelbase_m": _plain(vehicle.wheelbase),
        "cg_behind_front_axle_m": _plain(vehicle.cg_behind_front_axle),
        "speed_m_per_s": _plain(vehicle.speed),
    }


def _plain(value: float) -> str:
    """Format a number as in the header, without rounding errors of its factor to SI."""
    return "" if math.isnan(value) else f"{value:.10g}"


def _channel(channel: Channel, vehicles: set[int]) -> CrashChannel:
    assert channel.path is not None
    unit = channel.unit.upper()
    si, factor = UNITS.get(unit, ("", 1.0))
    axis = channel.axis[:1].lower()
    hz = channel.prefilter_hz
    low_pass = "" if math.isnan(hz) else f"{hz:g} Hz before the sampler"
    return CrashChannel(
        name=str(channel.number),
        quantity=_QUANTITY.get(si, "other"),
        axis=axis if axis in ("x", "y", "z") else "",
        unit=_SPELLED.get(unit, clean(channel.unit, LONGEST_NAME)),
        load=_loader(channel),
        sampling="instantaneous",
        place=clean(channel.comment) or clean(channel.location),
        body=_body(channel, vehicles),
        low_pass=low_pass,
        remarks=tuple(clean(r) for r in _remarks(channel)),
        full_scale=None if math.isnan(channel.rating) else channel.rating * factor,
        bandwidth=None if math.isnan(hz) or hz <= 0.0 else hz,
        file=channel.path.name,
    )


def _body(channel: Channel, vehicles: set[int]) -> str:
    if channel.vehicle not in vehicles:
        return "barrier" if channel.vehicle == 0 else f"vehicle {channel.vehicle}"
    whole = "vehicle" if len(vehicles) == 1 else f"vehicle {channel.vehicle}"
    place = _PLACES.get(channel.location, f"part {channel.location}")
    if channel.occupant not in ("", "NA", "00"):
        who = _SEATS.get(channel.occupant, f"occupant {channel.occupant}")
        return clean(f"{who}'s {place}" + ("" if whole == "vehicle" else f", {whole}"))
    # An engine moves in its mounts and is pushed back.
    return clean(f"engine of {whole}") if channel.location == "ENGN" else whole


def _remarks(channel: Channel) -> list[str]:
    known = _STATUS.get(channel.status, "")
    remarks = [f"status {channel.status}" + (f", {known}" if known else "")]
    remarks.append("primary" if channel.primary else "redundant")
    remarks.append(f"location {channel.location}, axis {channel.axis}")
    if channel.maker:
        remarks.append(channel.maker)
    if channel.calibrated:
        remarks.append(f"calibrated {channel.calibrated}")
    if channel.status != "AM" and channel.comment:
        remarks.append(f"the laboratory says: {channel.comment}")
    return remarks


def _loader(channel: Channel) -> Callable[[], tuple[Array, Array]]:
    def load() -> tuple[Array, Array]:
        time, values = channel.recorded
        factor = UNITS.get(channel.unit.upper(), ("", 1.0))[1]
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
