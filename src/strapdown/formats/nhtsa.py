"""Crash tests of the NHTSA vehicle database: the EV5 header and its channels in ASCII.

The order of the fields is that of the NHTSA Test Reference Guide, Version 5, Volume I: Vehicle
Tests (November 2014). Axes are those of SAE J211: X forward, Y to the right, Z down, which is
ours; a hit from the front gives negative X, and a nod of the head turns about -Y.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from strapdown.errors import DataError, Finding
from strapdown.formats.nhtsa_channel import KMH, Channel
from strapdown.formats.nhtsa_header import only, row_error, sections, to_number, to_whole

__all__ = ["Channel", "CrashTest", "Vehicle", "header_of", "read_nhtsa"]

TEST_FIELDS, CHANNEL_FIELDS, VEHICLE_FIELDS = 20, 20, 42
MM = 1e-3


@dataclass(frozen=True)
class Vehicle:
    """A vehicle of a test, in SI; NaN where the header does not say.

    Attributes
    ----------
    number : int
    year : int or None
        None where not stated.
    make, model, body : str
        Codes of the database.
    vin : str
    mass : float, kg
        As tested.
    wheelbase, length, width : float, m
    cg_behind_front_axle : float, m
    speed : float, m/s
        Before the impact.
    """

    number: int
    make: str
    model: str
    year: int | None
    body: str
    vin: str
    mass: float
    wheelbase: float
    length: float
    width: float
    cg_behind_front_axle: float
    speed: float


@dataclass(frozen=True)
class CrashTest:
    """A crash test as its header describes it.

    Attributes
    ----------
    path : Path
    title, objective, date, performer, reference, comment : str
    closing_speed : float, m/s
    impact_angle_deg : float, deg
        Clockwise from the front of the vehicle, in its plane.
    vehicles : tuple of Vehicle
    channels : tuple of Channel
        In the order of the header.
    occupants, restraints, barrier : tuple of tuple of str
        Rows of these sections, field by field.
    findings : tuple of Finding
        Among others which channels the folder does not hold.
    """

    path: Path
    title: str
    objective: str
    date: str
    performer: str
    reference: str
    comment: str
    closing_speed: float
    impact_angle_deg: float
    vehicles: tuple[Vehicle, ...]
    channels: tuple[Channel, ...]
    occupants: tuple[tuple[str, ...], ...]
    restraints: tuple[tuple[str, ...], ...]
    barrier: tuple[tuple[str, ...], ...]
    findings: tuple[Finding, ...]

    def channel(self, number: int) -> Channel:
        """Return a channel by its number.

        Raises
        ------
        DataError
            There is none.
        """
        for channel in self.channels:
            if channel.number == number:
                return channel
        numbers = [c.number for c in self.channels]
        raise DataError(
            "io.no-channel-3" if numbers else "io.no-channel-4",
            file=self.path.name,
            quantity="channel",
            number=number,
            numbers=min(numbers),
            numbers_2=max(numbers),
        )


def read_nhtsa(path: str | Path) -> CrashTest:
    """Read a crash test.

    Parameters
    ----------
    path : str or Path
        The header, ``v10146.EV5``, or the folder that holds it; the channels, ``v10146.001`` and
        so on, stand beside it and are read when their `Channel.table` is first asked for.

    Returns
    -------
    CrashTest

    Raises
    ------
    DataError
        The header is missing, empty, cut, or not in the form of EV5; its count of curves is not
        that of its rows.
    """
    file = header_of(Path(path))
    rows = sections(file)
    test, line = only(rows, "TEST", file)
    if len(test) < TEST_FIELDS:
        raise row_error(file, line, "TEST", len(test), TEST_FIELDS)
    promised = to_whole(test[18], file, line, "count of curves")
    listed = rows["INSTRUMENTATION"]
    if promised != len(listed):
        raise DataError(
            "io.promises-curves-lists",
            file=file.name,
            row=line,
            quantity="count of curves",
            promised=promised,
            count=len(listed),
        )
    present = {p.name.lower(): p for p in file.parent.iterdir()}
    channels = tuple(_channel(fields, file, at, present) for fields, at in listed)
    _refuse_twins(channels, file, [at for _, at in listed])
    return CrashTest(
        file,
        title=test[1],
        objective=test[2],
        date=test[3],
        performer=test[4],
        reference=test[6],
        comment=test[19],
        closing_speed=to_number(test[14], file, line, "closing speed") * KMH,
        impact_angle_deg=to_number(test[15], file, line, "impact angle"),
        vehicles=tuple(_vehicle(fields, file, at) for fields, at in rows["VEHICLE"]),
        channels=channels,
        occupants=tuple(tuple(fields) for fields, _ in rows["OCCUPANT"]),
        restraints=tuple(tuple(fields) for fields, _ in rows["RESTRAINT"]),
        barrier=tuple(tuple(fields) for fields, _ in rows["BARRIER"]),
        findings=tuple(_findings(channels, file)),
    )


def header_of(path: Path) -> Path:
    """Return the header of a test, given as itself or as its folder.

    Raises
    ------
    DataError
        The folder holds none, or more than one.
    """
    if not path.is_dir():
        return path
    headers = sorted(p for p in path.iterdir() if p.suffix.lower() == ".ev5")
    if len(headers) != 1:
        held = ", ".join(p.name for p in headers[:6])
        raise DataError(
            "io.folder-holds-headers" if headers else "io.folder-holds-no-ev-header",
            file=path.resolve().name,
            count=len(headers),
            held=held,
        )
    return headers[0]


def _channel(fields: list[str], file: Path, line: int, present: dict[str, Path]) -> Channel:
    if len(fields) != CHANNEL_FIELDS:
        raise row_error(file, line, "INSTRUMENTATION", len(fields), CHANNEL_FIELDS)

    def number(at: int, what: str) -> float:
        return to_number(fields[at], file, line, what)

    def whole(at: int, what: str) -> int:
        return to_whole(fields[at], file, line, what)

    curve = whole(1, "channel")
    first, last, interval = (
        whole(14, "first sample"),
        whole(15, "last sample"),
        number(16, "interval"),
    )
    if last < first or not interval > 0.0:
        raise DataError(
            "io.samples-every-no-record",
            file=file.name,
            row=line,
            quantity=f"channel {curve}",
            first=first,
            last=last,
            interval=interval,
        )
    return Channel(
        vehicle=whole(0, "vehicle"),
        number=curve,
        kind=fields[2],
        occupant=fields[3],
        location=fields[4],
        axis=fields[5],
        time_unit=fields[6].upper(),
        unit=fields[7],
        prefilter_hz=number(8, "prefilter"),
        maker=fields[9],
        calibrated=fields[10],
        rating=number(11, "rating"),
        used_percent=number(12, "share of the rating used"),
        initial_velocity=number(13, "initial velocity") * KMH,
        first=first,
        last=last,
        interval=interval * 1e-6,
        status=fields[17],
        primary=fields[18].upper() != "R",
        comment=fields[19],
        path=present.get(f"{file.stem.lower()}.{curve:03d}"),
    )


def _vehicle(fields: list[str], file: Path, line: int) -> Vehicle:
    if len(fields) < VEHICLE_FIELDS:
        raise row_error(file, line, "VEHICLE", len(fields), VEHICLE_FIELDS)

    def number(at: int, what: str, factor: float = 1.0) -> float:
        return to_number(fields[at], file, line, what) * factor

    year = number(3, "year")
    return Vehicle(
        number=to_whole(fields[0], file, line, "vehicle"),
        make=fields[1],
        model=fields[2],
        year=None if math.isnan(year) else int(year),
        body=fields[5],
        vin=fields[6],
        mass=number(10, "test mass"),
        wheelbase=number(12, "wheelbase", MM),
        length=number(13, "length", MM),
        width=number(14, "width", MM),
        cg_behind_front_axle=number(15, "centre of gravity", MM),
        speed=number(41, "speed", KMH),
    )


def _refuse_twins(channels: tuple[Channel, ...], file: Path, lines: list[int]) -> None:
    seen: set[int] = set()
    for channel, line in zip(channels, lines, strict=True):
        if channel.number in seen:
            raise DataError(
                "io.channel-listed-twice",
                file=file.name,
                row=line,
                quantity="channel",
                number=channel.number,
            )
        seen.add(channel.number)


def _findings(channels: tuple[Channel, ...], file: Path) -> list[Finding]:
    findings = []
    absent = [c.number for c in channels if not c.present]
    if absent:
        findings.append(
            Finding(
                "io.listed-channels-not-folder-2",
                severity="note",
                file=file.name,
                quantity="channels",
                count=len(absent),
                count_2=len(channels),
                ranges=_ranges(absent),
            )
        )
    findings += [
        Finding(
            "io.laboratory-gives-status-2",
            file=file.name,
            quantity=f"channel {c.number}",
            status=c.status,
            comment=c.comment,
        )
        for c in channels
        if c.present and c.status != "AM"
    ]
    return findings


def _ranges(numbers: list[int]) -> str:
    """Numbers as ranges: 7-46, 53-92."""
    parts: list[list[int]] = []
    for n in sorted(numbers):
        if parts and n == parts[-1][1] + 1:
            parts[-1][1] = n
        else:
            parts.append([n, n])
    return ", ".join(f"{a}" if a == b else f"{a}-{b}" for a, b in parts)
