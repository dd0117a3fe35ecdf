"""Writers of crash records: ISO MME (ISO/TS 13499), tests of NHTSA, tables of recorders, paths."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd

from strapdown.errors import DataError
from strapdown.formats import csv, nhtsa
from strapdown.formats.crash_nhtsa import code_of_place
from strapdown.formats.crash_record import (
    CHANGE_NOTE,
    QUANTITIES,
    CrashChannel,
    CrashRecord,
    clean,
    position_of,
)
from strapdown.formats.mme_codes import FILTERS, LENGTH, NO_CLASS, decode_mme
from strapdown.formats.mme_reader import (
    AXIS_NOTE,
    BODY_NOTE,
    FILTER_NOTE,
    NO_VEHICLE,
    PLACE_NOTE,
    POINT_NOTE,
    SAMPLING_NOTE,
    VEHICLE_NOTE,
    even_stamps,
)
from strapdown.tables import ACCEL, EULER, GYRO, NED, POSITION_SD, VELOCITY
from strapdown.tables.checks import Array
from strapdown.units import GYRO_UNITS, si_of

NOVALUE = "NOVALUE"
_DIMENSIONS = {
    "acceleration": "AC",
    "rate": "AV",
    "velocity": "VE",
    "displacement": "DS",
    "force": "FO",
    "time": "TI",
    "other": "00",
}
_UNITS = {**QUANTITIES, "acceleration": "m/(s*s)"}
# RED B reserves digits for signs that differ from those of SAE J211.
_DIRECTIONS = {"x": "X", "y": "Y", "z": "Z", "-x": "1", "-y": "2", "-z": "3"}
# Locations by a word that occurs in them, if the word is as specific as the code.
_PLACES = {
    "engine": "ENGN",
    "head": "HEAD",
    "chest": "CHST",
    "pelvis": "PELV",
    "crossmember": "CRME",
    "tunnel": "TUNN",
    "b-pillar": "BPIL",
    "sill": "SILB",
    "barrier": "FBAR",
    "sled": "SLED",
}
_NUMBERS = tuple("123456789MSHP")
_FILE_NAME = re.compile(r"[^A-Za-z0-9_-]+")
_SHORTEST = "record"
LONGEST_FILE_NAME = 40
MOST_CHANNELS = 999


def write_mme(
    folder: str | Path, record: CrashRecord, *, name: str | None = None
) -> dict[str, str]:
    """Write a record as a test in ISO MME.

    Parameters
    ----------
    folder : str or Path
        Output folder: ``NAME.mme``, ``Channel/NAME.chn`` and ``Channel/NAME.001`` and so on.
    record : CrashRecord
        Values are written in SI units with the fewest digits that reproduce each exactly. Stamps
        are written as first stamp and interval if exact, else as a channel of stamps.
    name : str, optional
        Base name of the files; by default that of the record.

    Returns
    -------
    dict of str to str
        Name of each channel to its channel code. A name that is a code is kept; others are
        written to `Laboratory channel code`.

    Raises
    ------
    DataError
        The record has no channels, more than 999, or an infinite value.
    """
    channels = _written(record)
    stem = _FILE_NAME.sub("_", name if name is not None else record.path.stem).strip("_")
    stem = stem[:LONGEST_FILE_NAME] or _SHORTEST
    codes = _codes(channels)
    texts: list[tuple[str, str, str]] = []
    clocks: dict[bytes, str] = {}
    for channel in channels:
        time, values = channel.load()
        _check(channel, time, values)
        even = _even(time)
        clock = ""
        if even is None:
            clock = clocks.setdefault(time.tobytes(), f"10TIRS{len(clocks):02d}0000TI00")
            if clock not in {code for code, _, _ in texts}:
                texts.append((clock, "stamps", _file(_stamps_head(clock, time), time)))
        head = _head(channel, codes[channel.name], values, even, clock)
        texts.append((codes[channel.name], channel.name, _file(head, values)))
    inner = Path(folder) / "Channel"
    inner.mkdir(parents=True, exist_ok=True)
    (Path(folder) / f"{stem}.mme").write_bytes(_lines(_test(record)))
    index = {"Instrumentation standard": NOVALUE, "Number of channels": str(len(texts))}
    for k, (code, title, text) in enumerate(texts, start=1):
        index[f"Name of channel {k:03d}"] = f"{code} / {clean(title)}"
        (inner / f"{stem}.{k:03d}").write_bytes(text.encode())
    (inner / f"{stem}.chn").write_bytes(_lines(index))
    return codes


def _written(record: CrashRecord) -> list[CrashChannel]:
    """Return the channels but those of stamps, which are written with the channels that use them.

    DataError: there are none, or more than a test can number.
    """
    channels = [c for c in record.channels if c.quantity != "time"]
    if not channels or len(channels) > MOST_CHANNELS:
        raise DataError(
            "io.channels-iso-mme-holds",
            file=record.path.name,
            quantity="channels",
            count=len(channels),
            most_channels=MOST_CHANNELS,
        )
    return channels


def _codes(channels: list[CrashChannel]) -> dict[str, str]:
    """Assign a unique code to each channel; names that are codes are kept."""
    codes = {c.name: c.name for c in channels if _is_code(c.name)}
    taken = {code.upper() for code in codes.values()}
    points: dict[str, list[str]] = {}
    letters = {words: letter for letter, words in FILTERS.items()}
    for channel in channels:
        if channel.name in codes:
            continue
        start = _object_and_place(channel)
        end = _DIMENSIONS[channel.quantity] + _DIRECTIONS.get(channel.axis, "0")
        end += letters.get(channel.low_pass, NO_CLASS)
        # Points of one location differ in their numbers, whatever axes each has.
        of_start = points.setdefault(start, [])
        point = channel.point or position_of(channel.place)
        if point not in of_start:
            of_start.append(point)
        number = of_start.index(point)
        while (code := f"{start}{number // 100:02d}{number % 100:02d}00{end}") in taken:
            number += 1
        taken.add(code)
        codes[channel.name] = code
    return codes


def _is_code(name: str) -> bool:
    known = decode_mme(name)
    return known is not None and not known.unknown and name == known.code and len(name) == LENGTH


def _object_and_place(channel: CrashChannel) -> str:
    body = channel.body.lower()
    said = f"{body} {channel.place.lower()}" if body != "vehicle" else channel.place.lower()
    main = next((code for word, code in _PLACES.items() if word in said), "VEHC")
    seat = "1" if body.startswith("driver") else "3" if body.startswith("front passenger") else "0"
    number = channel.vehicle if channel.vehicle in _NUMBERS else "1" if not channel.vehicle else "0"
    return f"{'B' if body == 'barrier' else number}{seat}{main}"


def _check(channel: CrashChannel, time: Array, values: Array) -> None:
    bad = np.flatnonzero(np.isinf(values) | ~np.isfinite(time))
    if bad.size or not values.size:
        raise DataError(
            "io.not-finite-number" if bad.size else "io.no-samples-2",
            **channel.where,
            row=channel.row(int(bad[0])) if bad.size else None,
            values=values[bad[0]] if bad.size else None,
        )


def _even(time: Array) -> tuple[str, str] | None:
    """Return first stamp and interval if they reproduce every stamp exactly."""
    first = _number(float(time[0]))
    if time.size == 1:
        return first, "1.0"
    mean = float(time[-1] - time[0]) / (time.size - 1)
    if not mean > 0.0:
        return None
    rounded = [_number(float(f"{mean:.{digits}g}")) for digits in (3, 6, 9, 12)]
    for interval in dict.fromkeys((*rounded, _number(mean), _number(float(time[1] - time[0])))):
        if np.array_equal(even_stamps(first, interval, time.size), time):
            return first, interval
    return None


def _head(
    channel: CrashChannel, code: str, values: Array, even: tuple[str, str] | None, clock: str
) -> dict[str, str]:
    known = decode_mme(code)
    assert known is not None
    unit = _UNITS[channel.quantity] or clean(channel.unit)
    letter_says = FILTERS.get(code[-1], "")
    notes = []
    if channel.sampling:
        notes.append(SAMPLING_NOTE + channel.sampling)
    if channel.axis != known.axis and channel.axis:
        notes.append(AXIS_NOTE + channel.axis)
    if channel.body != known.body:
        notes.append(BODY_NOTE + clean(channel.body))
    if channel.vehicle != known.vehicle:
        notes.append(VEHICLE_NOTE + (clean(channel.vehicle) or NO_VEHICLE))
    if channel.point != known.point and channel.point:
        notes.append(POINT_NOTE + clean(channel.point))
    if channel.place:
        notes.append(PLACE_NOTE + clean(channel.place))
    if channel.low_pass and channel.low_pass != letter_says:
        notes.append(FILTER_NOTE + clean(channel.low_pass))
    # A velocity is noted as a change, so that a reader does not subtract its first value.
    remarks = [r for r in channel.remarks if r != CHANGE_NOTE]
    notes += [CHANGE_NOTE] if channel.quantity == "velocity" else []
    notes += [clean(r) for r in remarks]
    cut_off = channel.bandwidth
    return {
        "Test object number": clean(channel.vehicle) or code[0],
        "Name of the channel": clean(channel.place) or clean(channel.name),
        "Laboratory channel code": clean(channel.name),
        "Customer channel code": NOVALUE,
        "Channel code": code,
        "Location": NOVALUE,
        "Dimension": known.dimension,
        "Direction": known.direction,
        "Channel frequency class": clean(channel.low_pass) or NOVALUE,
        "Unit": unit or NOVALUE,
        "Reference system": NOVALUE,
        "Transducer type": NOVALUE,
        "Transducer id": NOVALUE,
        "Pre-filter type": NOVALUE,
        "Cut off frequency": NOVALUE if cut_off is None else _number(cut_off),
        "Channel amplitude class": NOVALUE
        if channel.full_scale is None
        else _number(channel.full_scale),
        "Reference channel": "explicit" if clock else "implicit",
        "Reference channel name": clock or NOVALUE,
        "Data source": NOVALUE,
        "Data status": NOVALUE,
        "Sampling interval": NOVALUE if even is None else even[1],
        "Bit resolution": NOVALUE,
        "Time of first sample": NOVALUE if even is None else even[0],
        "Number of samples": str(values.size),
        **_extremes(values),
        **{f"Comments#{k}": note for k, note in enumerate(notes)},
    }


def _extremes(values: Array) -> Mapping[str, str]:
    there = values[np.isfinite(values)]
    if not there.size:
        return {}
    return {
        "First global maximum value": _number(float(there.max())),
        "First global minimum value": _number(float(there.min())),
    }


def _stamps_head(code: str, time: Array) -> dict[str, str]:
    return {
        "Test object number": "1",
        "Name of the channel": "stamps",
        "Channel code": code,
        "Dimension": "time",
        "Unit": "s",
        "Reference channel": "explicit",
        "Reference channel name": code,
        "Number of samples": str(time.size),
    }


def _test(record: CrashRecord) -> dict[str, str]:
    numbers = [int(n) for n in record.vehicles if n.isdecimal()]
    head = {
        "Data format edition number": "1.6",
        "Laboratory name": NOVALUE,
        "Laboratory test ref. number": clean(record.facts.get("test", "")) or NOVALUE,
        "Customer name": NOVALUE,
        "Title": clean(record.title) or NOVALUE,
        "Medium No./number of media": "1/1",
        "Timestamp": NOVALUE,
        "Type of the test": NOVALUE,
        "Date of the test": NOVALUE,
        "Number of test objects": str(max(numbers, default=1)),
    }
    for number, facts in sorted(record.vehicles.items()) or [("1", {})]:
        spoken = {"vehicle": "Name of", "speed_m_per_s": "Velocity", "mass_kg": "Mass"}
        more = {key: clean(key) for key in facts if key not in spoken}
        for key, name in (spoken | more).items():
            head[f"{name} test object {number}"] = clean(facts.get(key, "")) or NOVALUE
    return head


def _file(head: Mapping[str, str], values: Array) -> str:
    lines = [NOVALUE if np.isnan(v) else _number(v) for v in values.tolist()]
    return _lines(head).decode() + "\n".join(lines) + "\n"


def _lines(head: Mapping[str, str]) -> bytes:
    return "".join(f"{k.partition('#')[0]:<28}:{v}\n" for k, v in head.items()).encode()


def _number(value: float) -> str:
    """Format a number with the fewest digits that reproduce it exactly."""
    return repr(float(value))


# Tests of the NHTSA vehicle database: the EV5 header, and a file of stamps and values per channel.

# Sensor and unit by quantity. Units with the factor 1 keep every bit.
_EV5_KINDS = {
    "acceleration": ("AC", "M/S2"),
    "rate": ("AV", "RAD/S"),
    "velocity": ("VL", "KPH"),
    "displacement": ("DS", "MM"),
    "force": ("LC", "NWT"),
    "other": ("OT", "OTH"),
}
_EV5_NAME = re.compile(r"make (.*), model (.*), (\d{4}|year unknown)")


def write_nhtsa(
    folder: str | Path, record: CrashRecord, *, name: str | None = None
) -> dict[str, str]:
    """Write a record as a test of the NHTSA vehicle database.

    Parameters
    ----------
    folder : str or Path
        Output folder: ``NAME.EV5``, and ``NAME.001`` and so on.
    record : CrashRecord
        Evenly sampled, with a sample at zero or a whole number of steps from it. Accelerations,
        rates, forces and stamps keep every bit; a channel along a negative axis is reversed. The
        layout has no field for classes of filters and for points beyond location codes.
    name : str, optional
        Base name of the files; by default ``v`` and the number of the test.

    Returns
    -------
    dict of str to str
        Name of each channel to its number in the test.

    Raises
    ------
    DataError
        The record has no channels, more than 999, a value that is not finite, uneven stamps, or a
        channel on a moving part for which the database has no code.
    """
    channels = _written(record)
    test = "".join(c for c in record.facts.get("test", "") if c.isdecimal())
    stem = _FILE_NAME.sub("_", name or f"v{int(test or 1):05d}").strip("_") or _SHORTEST
    numbers = _curves(channels)
    objects = _object_numbers(record, channels)
    rows = []
    Path(folder).mkdir(parents=True, exist_ok=True)
    for channel in channels:
        time, values = channel.load()
        number = numbers[channel.name]
        grounded = not channel.vehicle and channel.body != "vehicle"
        vehicle = 0 if grounded else objects[channel.vehicle]
        rows.append(_ev5_channel(channel, number, vehicle, time, values))
        *_, factor = si_of(_EV5_KINDS[channel.quantity][1]) or ("", 1.0)
        written = (-values if channel.axis.startswith("-") else values) / factor
        pairs = zip(time.tolist(), written.tolist(), strict=True)
        text = "".join(f"{_number(t)}\t{_number(v)}\n" for t, v in pairs)
        (Path(folder) / f"{stem}.{number:03d}").write_bytes(text.encode())
    sections = {
        "EV5": [],
        "TEST": [_ev5_test(record, len(rows))],
        "VEHICLE": [
            _ev5_vehicle(number, record.vehicles.get(vehicle, {}))
            for vehicle, number in objects.items()
        ],
        "INSTRUMENTATION": [row for _, row in sorted(zip(numbers.values(), rows, strict=True))],
        "END": [],
    }
    lines = [
        line
        for section, held in sections.items()
        for line in (
            f"----- {section} -----",
            *("|".join(clean(t).replace("|", "/") for t in row) for row in held),
        )
    ]
    head = "".join(f"{line}\n" for line in lines)
    (Path(folder) / f"{stem}.EV5").write_bytes(head.encode("latin-1", "replace"))
    return {name: str(number) for name, number in numbers.items()}


def _curves(channels: list[CrashChannel]) -> dict[str, int]:
    """Number of each channel: its name where that is one, else the next that is free."""
    numbers = {
        c.name: int(c.name)
        for c in channels
        if c.name.isdecimal() and str(int(c.name)) == c.name and 0 < int(c.name) <= MOST_CHANNELS
    }
    free = (k for k in range(1, MOST_CHANNELS + 1) if k not in set(numbers.values()))
    return {c.name: numbers.get(c.name) or next(free) for c in channels}


def _object_numbers(record: CrashRecord, channels: list[CrashChannel]) -> dict[str, int]:
    """Number of each vehicle."""
    named = sorted({c.vehicle for c in channels if c.vehicle} | set(record.vehicles))
    numbers = {v: int(v) for v in named if v.isdecimal() and 0 < int(v) < MOST_CHANNELS}
    free = (k for k in range(1, MOST_CHANNELS) if k not in set(numbers.values()))
    # What moves with a vehicle that has no number gets one; 0 is what belongs to none.
    moving = any(not c.vehicle and c.body == "vehicle" for c in channels)
    return {v: numbers.get(v) or next(free) for v in ([""] if moving else []) + named}


def _ev5_channel(
    channel: CrashChannel, number: int, vehicle: int, time: Array, values: Array
) -> list[str]:
    _check(channel, time, values)
    if np.isnan(values).any():
        k = int(np.flatnonzero(np.isnan(values))[0])
        raise DataError(
            "io.not-finite-number", **channel.where, row=channel.row(k), values=values[k]
        )
    first, interval = _ev5_steps(channel, time)
    location, seat = code_of_place(channel.point, channel.body, channel.place)
    if not location:
        raise DataError("io.part-without-location-code", **channel.where, body=channel.body)
    kind, unit = _EV5_KINDS[channel.quantity]
    *_, factor = si_of(unit) or ("", 1.0)
    axis = channel.axis.lstrip("-").upper()
    status = next((r.split()[1].strip(",") for r in channel.remarks if _STATUS.match(r)), "AM")
    numbers = {
        "prefilter": "" if channel.bandwidth is None else f"{channel.bandwidth:.10g}",
        "rating": "" if channel.full_scale is None else _number(channel.full_scale / factor),
    }
    return [
        *(str(vehicle), str(number), kind, seat or "NA", location),
        *(f"{axis}{'L' if seat else 'G'}" if axis else "NA", "SEC", unit, numbers["prefilter"]),
        *("", "", numbers["rating"], "", "", str(first), str(first + time.size - 1), interval),
        *(status, "R" if "redundant" in channel.remarks else "P"),
        f"{channel.place} {axis}".strip() or "NO COMMENTS",
    ]


_STATUS = re.compile(r"status [A-Z]{2}\b")


def _ev5_steps(channel: CrashChannel, time: Array) -> tuple[int, str]:
    """Number of the first sample, and the interval in µs, that give every stamp."""
    mean = float(time[-1] - time[0]) / (time.size - 1) if time.size > 1 else 0.0
    if mean > 0.0:
        for digits in (3, 6, 9, 12):
            interval = _number(float(f"{mean * 1e6:.{digits}g}"))
            step = float(interval) * 1e-6
            first = round(float(time[0]) / step)
            off = np.abs(time - step * (first + np.arange(time.size)))
            if off.max() <= nhtsa.STAMP_ROUNDING:
                return first, interval
    raise DataError("io.stamps-not-even", **channel.where, interval=mean)


def _ev5_test(record: CrashRecord, count: int) -> list[str]:
    facts = record.facts
    row = [""] * nhtsa.TEST_FIELDS
    row[0], row[1], row[18] = "V5", record.title, str(count)
    for at, key in (
        (2, "objective"),
        (3, "date"),
        (4, "laboratory"),
        (6, "contract"),
        (15, "impact angle, deg"),
        (19, "recorder"),
    ):
        row[at] = facts.get(key, "")
    row[14] = _in_unit(facts.get("closing speed, m/s", ""), nhtsa.KMH)
    return row


def _ev5_vehicle(number: int, facts: Mapping[str, str]) -> list[str]:
    row = [""] * (nhtsa.VEHICLE_FIELDS + 1)
    row[0], row[1] = str(number), facts.get("vehicle", "")
    if match := _EV5_NAME.fullmatch(row[1]):
        row[1], row[2], row[3] = match[1], match[2], match[3] if match[3].isdecimal() else ""
    row[6], row[10], row[42] = (facts.get(key, "") for key in ("vin", "mass_kg", "crab_deg"))
    for at, key in (
        (12, "wheelbase_m"),
        (13, "length_m"),
        (14, "width_m"),
        (15, "cg_behind_front_axle_m"),
    ):
        row[at] = _in_unit(facts.get(key, ""), nhtsa.MM)
    row[41] = _in_unit(facts.get("speed_m_per_s", ""), nhtsa.KMH)
    return row


def _in_unit(text: str, unit: float) -> str:
    """Write a number in SI in another unit; facts have ten digits."""
    return f"{float(text) / unit:.12g}" if text else ""


# Recorder exports: one text table per triad or path, with units in the headings.


TIME = "time [s]"
ACCEL_HEADINGS = ("ax [m/s2]", "ay [m/s2]", "az [m/s2]")
GYRO_HEADINGS = ("wx [deg/s]", "wy [deg/s]", "wz [deg/s]")


def write_recorder_csv(path: Path, table: pd.DataFrame) -> None:
    """Write one triad of a recorder.

    `table`: index ``time``, s; columns ``accel_x accel_y accel_z``, m/s², or ``gyro_x gyro_y
    gyro_z``, rad/s. Accelerations and stamps are reproduced to the last bit; rates, written in
    deg/s, within rounding.
    """
    turns = set(GYRO) <= set(table.columns)
    values = table[GYRO if turns else ACCEL].to_numpy(dtype=np.float64)
    if turns:
        values = values / GYRO_UNITS["deg/s"]
    headings = GYRO_HEADINGS if turns else ACCEL_HEADINGS
    columns = {TIME: table.index.to_numpy(dtype=np.float64)}
    columns |= {name: values[:, k] for k, name in enumerate(headings)}
    csv.write(path, columns, {})


def write_path_csv(path: Path, table: pd.DataFrame) -> None:
    """Write the path of a point.

    `table`: index ``time``, s; columns ``north east down`` and, if available, ``north_sd east_sd
    down_sd``, m, ``VN VE VD``, m/s, and ``roll pitch heading``, deg.
    """
    columns = {TIME: table.index.to_numpy(dtype=np.float64)}
    for names, unit in ((NED, "m"), (POSITION_SD, "m"), (VELOCITY, "m/s"), (EULER, "deg")):
        there = [name for name in names if name in table.columns]
        columns |= {f"{n} [{unit}]": table[n].to_numpy(dtype=np.float64) for n in there}
    csv.write(path, columns, {})
