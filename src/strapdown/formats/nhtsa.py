"""Crash tests of the NHTSA vehicle database: the EV5 header and its channels in ASCII.

The order of the fields is that of the NHTSA Test Reference Guide, Version 5, Volume I: Vehicle
Tests (November 2014). Axes are those of SAE J211, as ours: X forward, Y to the right, Z down. A
frontal impact gives negative X, and a nod of the head is a rotation about -Y.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.errors import DataError, Finding, add_note
from strapdown.formats.crash_record import header_of
from strapdown.units import FACTORS, SPEEDS, TIME_UNITS, find_unit, si_of

TEST_FIELDS, CHANNEL_FIELDS, VEHICLE_FIELDS = 20, 20, 42
MM = 1e-3


@dataclass(frozen=True)
class Vehicle:
    """A vehicle of a test, in SI units; NaN where not stated.

    `year`: none where not stated. `make`, `model`, `body`: codes of the database. `mass`: as
    tested. `wheelbase`, `length`, `width` (m). `cg_behind_front_axle` (m). `speed` (m/s): before
    the impact. `crab_deg` (deg): between its heading and its direction of travel.
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
    crab_deg: float


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
        Includes the channels whose files are missing.
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

        DataError: the channel does not exist.
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
            numbers=min(numbers, default=None),
            numbers_2=max(numbers, default=None),
        )


def read_nhtsa(path: str | Path) -> CrashTest:
    """Read a crash test.

    Parameters
    ----------
    path : str or Path
        The header, ``v10146.EV5``, or its folder. The channels, ``v10146.001`` and so on, are
        beside it and are read when `Channel.table` is first used.

    Raises
    ------
    DataError
        The header is missing, empty, truncated, or not in EV5 format; or its number of curves
        differs from its rows.
    """
    file = header_of(Path(path), ".ev5", "io.folder-holds-headers", "io.folder-holds-no-ev-header")
    rows = sections(file)
    if len(rows["TEST"]) != 1:
        raise DataError(
            "io.rows-section-needed",
            file=file.name,
            quantity="TEST",
            count=len(rows["TEST"]),
            section="TEST",
        )
    test, listed = rows["TEST"][0], rows["INSTRUMENTATION"]
    if len(test.fields) < TEST_FIELDS:
        raise test.of_width("TEST", TEST_FIELDS)
    promised = test.whole(18, "count of curves")
    if promised != len(listed):
        raise test.fault(
            "io.promises-curves-lists", "count of curves", promised=promised, count=len(listed)
        )
    present = {p.name.lower(): p for p in file.parent.iterdir()}
    channels = tuple(_channel(row, present) for row in listed)
    seen: set[int] = set()
    for row, channel in zip(listed, channels, strict=True):
        if channel.number in seen:
            raise row.fault("io.channel-listed-twice", "channel", number=channel.number)
        seen.add(channel.number)
    return CrashTest(
        file,
        title=test.fields[1],
        objective=test.fields[2],
        date=test.fields[3],
        performer=test.fields[4],
        reference=test.fields[6],
        comment=test.fields[19],
        closing_speed=test.number(14, "closing speed", KMH),
        impact_angle_deg=test.number(15, "impact angle"),
        vehicles=tuple(_vehicle(row) for row in rows["VEHICLE"]),
        channels=channels,
        occupants=tuple(row.fields for row in rows["OCCUPANT"]),
        restraints=tuple(row.fields for row in rows["RESTRAINT"]),
        barrier=tuple(row.fields for row in rows["BARRIER"]),
        findings=tuple(_findings(channels, file)),
    )


def _channel(row: _Row, present: dict[str, Path]) -> Channel:
    fields = row.fields
    if len(fields) != CHANNEL_FIELDS:
        raise row.of_width("INSTRUMENTATION", CHANNEL_FIELDS)
    curve = row.whole(1, "channel")
    first, last = row.whole(14, "first sample"), row.whole(15, "last sample")
    interval = row.number(16, "interval")
    if last < first or not interval > 0.0:
        data = {"first": first, "last": last, "interval": interval}
        raise row.fault("io.samples-every-no-record", f"channel {curve}", **data)
    return Channel(
        vehicle=row.whole(0, "vehicle"),
        number=curve,
        kind=fields[2],
        occupant=fields[3],
        location=fields[4],
        axis=fields[5],
        time_unit=fields[6].upper(),
        unit=fields[7],
        prefilter_hz=row.number(8, "prefilter"),
        maker=fields[9],
        calibrated=fields[10],
        rating=row.number(11, "rating"),
        used_percent=row.number(12, "share of the rating used"),
        initial_velocity=row.number(13, "initial velocity", KMH),
        first=first,
        last=last,
        interval=interval * 1e-6,
        status=fields[17],
        primary=fields[18].upper() != "R",
        comment=fields[19],
        path=present.get(f"{row.file.stem.lower()}.{curve:03d}"),
    )


def _vehicle(row: _Row) -> Vehicle:
    fields = row.fields
    if len(fields) < VEHICLE_FIELDS:
        raise row.of_width("VEHICLE", VEHICLE_FIELDS)
    year = row.number(3, "year")
    return Vehicle(
        number=row.whole(0, "vehicle"),
        make=fields[1],
        model=fields[2],
        year=None if math.isnan(year) else int(year),
        body=fields[5],
        vin=fields[6],
        mass=row.number(10, "test mass"),
        wheelbase=row.number(12, "wheelbase", MM),
        length=row.number(13, "length", MM),
        width=row.number(14, "width", MM),
        cg_behind_front_axle=row.number(15, "center of gravity", MM),
        speed=row.number(41, "speed", KMH),
        crab_deg=row.number(42, "crab angle") if len(fields) > VEHICLE_FIELDS else math.nan,
    )


def _findings(channels: tuple[Channel, ...], file: Path) -> list[Finding]:
    findings: list[Finding] = []
    absent = [c.number for c in channels if not c.present]
    if absent:
        add_note(
            findings,
            "io.listed-channels-not-folder-2",
            file=file.name,
            quantity="channels",
            count=len(absent),
            count_2=len(channels),
            ranges=_ranges(absent),
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
    """Format numbers as ranges: 7-46, 53-92."""
    parts: list[list[int]] = []
    for n in sorted(numbers):
        if parts and n == parts[-1][1] + 1:
            parts[-1][1] = n
        else:
            parts.append([n, n])
    return ", ".join(f"{a}" if a == b else f"{a}-{b}" for a, b in parts)


# Header of a crash test of the NHTSA database: sections, rows, fields, numbers.


SECTIONS = ("EV5", "TEST", "VEHICLE", "BARRIER", "OCCUPANT", "RESTRAINT", "INSTRUMENTATION", "END")
# Size limit: some hundred bytes per channel, and less than a hundred thousand channels.
LARGEST_HEADER = 50_000_000


@dataclass(frozen=True)
class _Row:
    """Fields of a line of a header, which bars separate."""

    fields: tuple[str, ...]
    file: Path
    line: int

    def number(self, at: int, what: str, factor: float = 1.0) -> float:
        """Convert a field to a number, NaN if not stated; refuse other text."""
        text = self.fields[at]
        if text in ("", "NA", "UN"):
            return math.nan
        try:
            value = float(text)
        except ValueError:
            value = math.inf
        if not math.isfinite(value):
            raise self.fault("io.no-number-4", what, text=text)
        return value * factor

    def whole(self, at: int, what: str) -> int:
        """Convert a field to an integer; refuse other text or an empty field."""
        value = self.number(at, what)
        if not math.isfinite(value) or value != int(value):
            raise self.fault("io.no-number-4", what, text=self.fields[at])
        return int(value)

    def fault(self, code: str, quantity: str, **data: Any) -> DataError:
        """Make an error of this line."""
        return DataError(code, file=self.file.name, row=self.line, quantity=quantity, **data)

    def of_width(self, section: str, needed: int) -> DataError:
        """Make the error for a row with too few or too many fields."""
        data = {"found": len(self.fields), "section": section, "needed": needed}
        return self.fault("io.fields-between-bars-row", section, **data)


def sections(file: Path) -> dict[str, list[_Row]]:
    """Split a header into sections of rows.

    DataError: the file is missing, empty, far too large, truncated, or in another format.
    """
    if not file.is_file():
        raise DataError("io.no-such-file", file=str(file))
    size = file.stat().st_size
    if size == 0 or size > LARGEST_HEADER:
        raise DataError(
            "io.file-empty-5" if not size else "io.bytes-no-ev-header", file=file.name, size=size
        )
    rows: dict[str, list[_Row]] = {name: [] for name in SECTIONS}
    section = ""
    seen: set[str] = set()
    for k, line in enumerate(file.read_bytes().decode("latin-1").splitlines(), start=1):
        text = line.strip()
        if not text or text.startswith("#"):
            continue
        if text.startswith("-----"):
            section = text.strip("- ").upper()
            if section not in rows:
                raise DataError(
                    "io.no-section-ev",
                    file=file.name,
                    row=k,
                    quantity="section",
                    section=section,
                    word=section,
                    known=SECTIONS,
                )
            seen.add(section)
        elif section in ("", "EV5", "END"):
            raise DataError("io.stands-no-section", file=file.name, row=k, text=text[:40])
        else:
            fields = tuple(f.strip() for f in line.split("|"))
            rows[section].append(_Row(fields, file, k))
    missing = [name for name in ("EV5", "TEST", "INSTRUMENTATION", "END") if name not in seen]
    if missing:
        raise DataError("io.no-section", file=file.name, quantity="section", missing=missing)
    return rows


KMH = SPEEDS["km/h"]
#: Quantities of the channels that are read; others, such as volts, are refused on reading.
KINDS = ("acceleration", "rate", "force", "moment", "velocity", "displacement")
# Stamps have six decimals: two steps may differ by 1 µs.
STAMP_ROUNDING = 1.1e-6  # s
# Limit of a row of two numbers; a far larger file does not match its header.
LONGEST_ROW = 64  # bytes


@dataclass(frozen=True)
class Channel:
    """A channel as described by its header row; `table` reads its samples on first use.

    Attributes
    ----------
    vehicle : int
        Number of the vehicle in the test; 0 for the barrier.
    number : int
        Number of the curve, and of its file.
    kind : str
        The database's code of the sensor: AC accelerometer, AV angular velocity, LC load cell,
        DS displacement.
    occupant : str
        Code of the seat (01 driver, 02 front passenger), or NA.
    location : str
        Code of the location: HDCG head, FLLR floor left rear, ENGN engine.
    axis : str
        XL, YL, ZL local to the part; XG, YG, ZG of the vehicle.
    time_unit, unit : str
        As recorded.
    prefilter_hz : float, Hz
        Of the analog filter before sampling; NaN if not stated.
    maker, calibrated : str
    rating : float
        Full scale, in the recorded unit; NaN if not stated.
    used_percent : float, %
        Fraction of the rating, as stated by the laboratory.
    initial_velocity : float, m/s
        Of the part along the axis before the impact, with the sign of the file: positive for
        a vehicle that drives forward; NaN if not stated.
    first, last : int
        Numbers of the first and last sample, counted from the impact.
    interval : float, s
    status : str
        The database's code: AM as measured, CF channel failed, NO no data.
    primary : bool
        P, not R for redundant.
    comment : str
    path : Path or None
        File of the samples; None if the folder lacks it.
    """

    vehicle: int
    number: int
    kind: str
    occupant: str
    location: str
    axis: str
    time_unit: str
    unit: str
    prefilter_hz: float
    maker: str
    calibrated: str
    rating: float
    used_percent: float
    initial_velocity: float
    first: int
    last: int
    interval: float
    status: str
    primary: bool
    comment: str
    path: Path | None

    @property
    def name(self) -> str:
        """Number and comment, for messages and tables."""
        return f"channel {self.number} ({self.comment})"

    def _fault(self, code: str, row: int | None = None, **data: Any) -> DataError:
        """Make an error of its file, by default about its samples."""
        file = None if self.path is None else self.path.name
        return DataError(
            code, row=row, **{"file": file, "quantity": f"channel {self.number}"} | data
        )

    @property
    def present(self) -> bool:
        """Whether the folder holds its samples."""
        return self.path is not None

    @property
    def samples(self) -> int:
        """Number of samples according to the header."""
        return self.last - self.first + 1

    @property
    def si_unit(self) -> str:
        """Unit of `table`.

        DataError: the recorded unit is not known.
        """
        return self._si()[0]

    @property
    def rating_si(self) -> float:
        """Full scale in the unit of `table`."""
        return self.rating * self._si()[1]

    @cached_property
    def table(self) -> pd.DataFrame:
        """Samples in SI units: index ``time`` in s from the impact, column ``value``.

        Accelerations are as recorded: the channels are zeroed before the impact, so they exclude
        gravity of the state before it.

        DataError: the file is missing, empty, truncated, or differs from the header; a value is not
        a finite number; time does not advance; or the unit is unknown.
        """
        time, values = self.recorded
        assert self.path is not None
        unit, factor = self._si()
        table = pd.DataFrame(
            {"value": values * factor}, index=pd.Index(time, name="time"), copy=False
        )
        table.attrs = {"source": self.path.name, "unit": unit, "sampling": "instantaneous"}
        return table

    @cached_property
    def recorded(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Stamps in s from the impact, and samples in the unit as recorded."""
        if self.path is None:
            raise self._fault("io.listed-header-file-not-folder", name=self.name)
        known = find_unit(self.time_unit, ("time",))
        if known is None:
            unit = self.time_unit
            raise self._fault(
                "io.time-unit-not-known",
                quantity="time",
                time_unit=unit,
                word=unit,
                known=TIME_UNITS,
            )
        pairs = _read_pairs(self)
        time = pairs[:, 0] * TIME_UNITS[known[1]]
        _check_time(self, time)
        return time, pairs[:, 1].copy()

    def _si(self) -> tuple[str, float]:
        found = si_of(self.unit, KINDS)
        if found is None:
            raise self._fault(
                "io.unit-not-known",
                unit=self.unit,
                name=self.name,
                word=self.unit.upper(),
                known=[u.upper() for k in KINDS for u in FACTORS[k]],
            )
        return found[1:]


def _read_pairs(channel: Channel) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    path = channel.path
    assert path is not None
    size = path.stat().st_size
    if size == 0:
        raise channel._fault("io.file-empty-4")
    if size > LONGEST_ROW * (channel.samples + 1):
        raise channel._fault("io.bytes-too-many-samples-header", size=size, samples=channel.samples)
    lines = path.read_bytes().decode("ascii", "replace").splitlines()
    pairs: list[tuple[float, float]] = []
    for k, line in enumerate(lines):
        try:
            time, value = map(float, line.split())
        except ValueError:
            raise channel._fault("io.not-time-value", k + 1, at_line=line[:60]) from None
        if not (math.isfinite(time) and math.isfinite(value)):
            of_time = {} if math.isfinite(time) else {"quantity": "time"}
            raise channel._fault(
                "io.not-finite-number-3", k + 1, **of_time, strip=line.strip()[:60]
            )
        pairs.append((time, value))
    if len(lines) != channel.samples:
        cut = len(lines) < channel.samples
        raise channel._fault(
            "io.samples-header-row-says" if cut else "io.samples-header-row-says-2",
            len(lines) if cut else channel.samples + 1,
            count=len(lines),
            samples=channel.samples,
            first=channel.first,
            last=channel.last,
        )
    return np.array(pairs)


def _check_time(channel: Channel, time: np.ndarray[tuple[int], np.dtype[np.float64]]) -> None:
    steps = np.diff(time)
    back = np.flatnonzero(steps <= 0.0)
    if back.size:
        k = int(back[0]) + 1
        pair = {"time": time[k - 1], "time_2": time[k]}
        raise channel._fault("io.time-goes-4", k + 1, quantity="time", **pair)
    expected = channel.interval * (channel.first + np.arange(time.size))
    off = np.flatnonzero(np.abs(time - expected) > STAMP_ROUNDING)
    if off.size:
        k = int(off[0])
        raise channel._fault(
            "io.stamp-header-sample-every",
            k + 1,
            quantity="time",
            time=time[k],
            first=channel.first + k,
            interval=channel.interval * 1000000.0,
            expected=expected[k],
        )
