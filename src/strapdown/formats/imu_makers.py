"""Exports of the programs of makers of inertial units: APDM, MicroStrain, x-IMU3, Xsens."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import DataError, Finding, add_note
from strapdown.formats import csv
from strapdown.formats.arrays import numbers
from strapdown.formats.clocks import GPS, UNIX, WEEK, usual_step
from strapdown.formats.columns import read_name
from strapdown.formats.hdf5 import SIGNATURE, outline, read_arrays
from strapdown.formats.known_formats import column, lacking, selected, stated_by, under
from strapdown.formats.recording import RawLog
from strapdown.formats.signs import Signs, first_bytes, head
from strapdown.formats.text_columns import fields_of
from strapdown.units import TIME_UNITS, unit_of

# APDM Opal: CSV and HDF5 of Motion Studio, one or several monitors.
#
# CSV: ``Test Name:`` and ``Sample Rate:`` above the names ``Monitor/Angular Velocity/X`` …, their
# units under them, and rows that may have one more, empty field. HDF5 (attribute
# ``FileFormatVersion``): ``Sensors/<id>/`` with ``Time`` in µs since 1970, ``Accelerometer`` in
# m/s², ``Gyroscope`` in rad/s and ``Magnetometer`` in µT, each (n, 3); before version 5
# ``<id>/Calibrated/Accelerometers`` … and ``<id>/Time`` (APDM, Motion Studio user guide, "Working
# with HDF5"). The first monitor is read, or the one of which a column is named; in HDF5 those of
# the others are ``<id>/gyro_x``. Axes are those printed on the monitor.


APDM_TITLE = "APDM Opal"
APDM_TRIADS = {"Angular Velocity": "gyro", "Acceleration": "accel", "Magnetic Field": "mag"}
SETS = {
    "gyro": ("Gyroscope", "rad/s"),
    "accel": ("Accelerometer", "m/s2"),
    "mag": ("Magnetometer", "uT"),
}


def _has_monitor(path: Path) -> bool:
    """Whether there are lines of Motion Studio above a table, or its groups in HDF5."""
    if first_bytes(path, 8) == SIGNATURE:
        return bool(_groups(path))
    text = head(path)
    return text.startswith("Test Name:") and "/Angular Velocity/X" in text


detect_apdm = Signs(
    first=rb"\A(?:" + re.escape(SIGNATURE) + rb"|(?:\xef\xbb\xbf)?Test Name:|\xff\xfe|\xfe\xff)",
    also=_has_monitor,
)


def read_apdm(path: Path) -> RawLog:
    """Read the first monitor."""
    with path.open("rb") as stream:
        return _hdf5(path) if stream.read(8) == SIGNATURE else _csv(path)


def _csv(path: Path) -> RawLog:
    lines = head(path, 1 << 16).splitlines()
    top = next((k for k, line in enumerate(lines) if line.startswith("Time,")), None)
    if top is None or len(lines) < top + 3:
        raise DataError("io.csv-without-rows", file=path.name, row=len(lines))
    names, units = (fields_of(lines[top + k], ",") for k in (0, 1))
    # Rows may end in a comma, which the names do not.
    more = fields_of(lines[top + 2], ",")[len(names) :]
    header = ",".join([*names, *(f"unnamed {k}" for k in range(len(more)))])
    raw = under(path, top, header=header, drop=1)
    said = dict(zip(names, units, strict=False))
    monitors = list(dict.fromkeys(n.split("/")[0] for n in names if "/Angular Velocity/" in n))
    raw.columns = {n: c for n, c in raw.columns.items() if not n.startswith("unnamed ")}
    raw.units = {
        n: u for n, said_unit in said.items() if (u := unit_of(said_unit.replace("^", "")))
    }
    stated: list[dict[str, tuple[str, str | None]]] = []
    for monitor in monitors:
        of_monitor: dict[str, tuple[str, str | None]] = {"Time": ("time", unit_of(said["Time"]))}
        for kind, triad in APDM_TRIADS.items():
            for axis in "XYZ":
                if (name := f"{monitor}/{kind}/{axis}") in raw.columns:
                    if not stated:
                        column(raw, name)
                    of_monitor[name] = (f"{triad}_{axis.lower()}", raw.units.get(name))
        stated.append(of_monitor)
    return _of_monitors(raw, stated, monitors, "/Angular Velocity")


def _of_monitors(
    raw: RawLog, stated: list[dict[str, tuple[str, str | None]]], names: list[str], gyro: str
) -> RawLog:
    """State the columns of each monitor; `gyro`: behind the name of one, its rates."""
    raw.stated, *raw.other_units = stated
    if len(names) > 1:
        raw.warn("io.first-of-monitors", quantity="gyro", monitors=names, other=f"{names[1]}{gyro}")
    return raw


def _groups(path: Path) -> dict[str, str]:
    """Return the monitors of an HDF5 file, each with its group; none if it is of another kind."""
    names, attributes = outline(path)
    if "Sensors" in names and "FileFormatVersion" in attributes:
        inside = sorted(n.removeprefix("Sensors/") for n in names if n.startswith("Sensors/"))
        return {name: f"Sensors/{name}" for name in inside if "/" not in name}
    end = "/Calibrated/Gyroscopes"
    old = sorted(n.removesuffix(end) for n in names if n.endswith(end))
    return {name: name for name in old if "/" not in name}


def _hdf5(path: Path) -> RawLog:
    groups = _groups(path)
    count = 0
    columns: dict[str, Any] = {}
    stated: list[dict[str, tuple[str, str | None]]] = []
    for monitor, group in groups.items():
        inside = "{}" if group.startswith("Sensors/") else "Calibrated/{}s"
        sets = {t: f"{group}/{inside.format(n)}" for t, (n, _) in SETS.items()}
        arrays, _, _ = read_arrays(path, (f"{group}/Time", *sets.values()))
        if f"{group}/Time" not in arrays or sets["gyro"] not in arrays:
            if stated:
                continue
            raise lacking(path, "imu", APDM_TITLE, [])
        time = np.ravel(arrays[f"{group}/Time"])
        count = count or time.size
        # Columns of a log have as many rows; a monitor of another number is left out.
        if stated and any(len(a) != count for a in arrays.values()):
            continue
        top = f"{monitor}/" if stated else ""
        columns[f"{top}time"] = time
        of_monitor: dict[str, tuple[str, str | None]] = {f"{top}time": ("time", "us")}
        for triad, name in sets.items():
            if name in arrays:
                block = arrays[name]
                if block.shape != (count, 3):
                    raise DataError(
                        "io.rows-not-those-of-stamps",
                        file=path.name,
                        quantity=triad,
                        size=len(block),
                        count=count,
                    )
                for k, axis in enumerate("xyz"):
                    columns[f"{top}{triad}_{axis}"] = block[:, k]
                    of_monitor[f"{top}{triad}_{axis}"] = (f"{triad}_{axis}", SETS[triad][1])
        stated.append(of_monitor)
    raw = RawLog(path.resolve().name, (path,), columns, clock=UNIX)
    return _of_monitors(raw, stated, list(groups), "/gyro")


# MicroStrain CSV (MIP Monitor, SensorConnect): lines about the session, ``DATA_START``, a table.
#
# ``GPS TFlags, GPS Week, GPS TOW, X Accel [x8004], …``: numbers in brackets are the fields of the
# MIP protocol (MicroStrain MIP data reference, set 0x80): 0x8004 scaled acceleration in g, 0x8005
# rates in rad/s, 0x8006 magnetic field in gauss, 0x8007 and 0x8008 increments in rad and g s,
# 0x8017 pressure in mbar. SensorConnect and MSCL name the same channels ``scaledAccelX``,
# ``scaledGyroX``, ``deltaThetaX``, ``deltaVelX`` …; in files of SensorConnect the name of the
# node goes before, and ``Time`` has dates. Axes are those printed on the unit.


MICROSTRAIN_TITLE = "MicroStrain CSV"
START = "DATA_START"
FIELDS = {
    "gyro": (re.compile(r"([XYZ]) Gyro \[x8005\]|.*scaledGyro([XYZ])"), "rad/s"),
    "accel": (re.compile(r"([XYZ]) Accel \[x8004\]|.*scaledAccel([XYZ])"), "g"),
    "mag": (re.compile(r"([XYZ]) Mag \[x8006\]|.*scaledMag([XYZ])"), "gauss"),
}
SUMS = {
    "gyro": (
        re.compile(r"(?:([XYZ]) )?Delta Theta(?: ([XYZ]))? \[x8007\]|.*deltaTheta([XYZ])"),
        "rad",
    ),
    "accel": (
        re.compile(r"(?:([XYZ]) )?Delta Vel(?: ([XYZ]))? \[x8008\]|.*deltaVel([XYZ])"),
        "g*s",
    ),
}
PRESSURE = re.compile(r"(?:Ambient )?Pressure \[x8017\]|.*scaledAmbientPressure")


detect_microstrain = Signs(text=rf"^[ ,;\r]*{START}[ ,;\r]*$")


def _top(path: Path) -> int | None:
    lines = head(path, 1 << 16).splitlines()
    return next((k + 1 for k, line in enumerate(lines) if line.strip(" ,;\r") == START), None)


def read_microstrain(path: Path) -> RawLog:
    """Read rates and specific force, or increments where the file has those alone."""
    raw = under(path, _top(path) or 0)
    for fields in (FIELDS, {**FIELDS, **SUMS}):
        stated = _stated(raw, fields)
        if {f"gyro_{a}" for a in "xyz"} <= {quantity for quantity, _ in stated.values()}:
            time, raw.clock = _time(raw)
            for name in stated:
                column(raw, name)
            raw.columns["time"], unit = time["time"]
            raw.stated = {"time": ("time", unit), **stated}
            raw.sampling = None if fields is FIELDS else "mean"
            return raw
    raise lacking(path, "imu", MICROSTRAIN_TITLE, ["barometer"] if _pressure(raw) else [])


def read_microstrain_barometer(path: Path) -> RawLog:
    """Read the pressure."""
    raw = under(path, _top(path) or 0)
    time, clock = _time(raw)
    if (name := _pressure(raw)) is None:
        raise lacking(path, "barometer", MICROSTRAIN_TITLE, ["imu"] if _stated(raw, FIELDS) else [])
    return stated_by(raw, time | {"pressure": (column(raw, name), "mbar")}, clock=clock)


def _pressure(raw: RawLog) -> str | None:
    return next((name for name in raw.columns if PRESSURE.fullmatch(name)), None)


def _stated(raw: RawLog, fields: dict[str, Any]) -> dict[str, tuple[str, str | None]]:
    """Return the columns of the sensors; their names distinguish increments from rates."""
    stated: dict[str, tuple[str, str | None]] = {}
    for name in raw.columns:
        for triad, (pattern, unit) in fields.items():
            match = pattern.fullmatch(name)
            axis = next((g for g in match.groups() if g), None) if match else None
            if axis is not None:
                stated[name] = (f"{triad}_{axis.lower()}", unit)
    return stated


def _time(raw: RawLog) -> tuple[dict[str, tuple[NDArray[Any], str | None]], str]:
    if {"GPS Week", "GPS TOW"} <= raw.columns.keys():
        week, tow = column(raw, "GPS Week"), column(raw, "GPS TOW")
        return {"time": (np.asarray(tow + WEEK * (week - week[0])), "s")}, GPS
    if "Time" in raw.columns:
        return {"time": (raw.columns["Time"], None)}, UNIX
    raise raw.fault("io.microstrain-without-stamps", "time")


# x-IMU3 of x-io Technologies: CSV of its software, a folder of tables or one table.
#
# ``Inertial.csv``: ``Timestamp (us)`` (or ``Time (s)``), ``Gyroscope X (deg/s)`` …,
# ``Accelerometer X (g)`` …; ``Magnetometer.csv``: ``Magnetometer X (a.u.)`` …, in units of the
# calibrated field (https://github.com/xioTechnologies/x-IMU3-Software, MIT). A message that
# arrived by two connections has two rows. Axes are those printed on the unit.


NAMES = {f"gyro_{a}": (f"Gyroscope {a.upper()} (deg/s)", "deg/s") for a in "xyz"}
NAMES |= {f"accel_{a}": (f"Accelerometer {a.upper()} (g)", "g") for a in "xyz"}
TIMES = {"Timestamp (us)": "us", "Time (s)": "s"}
TABLE = "Inertial.csv"


def _has_names_of_xio(path: Path) -> bool:
    """Whether the table, or that of a folder, has the inertial names."""
    line = head(path / TABLE if path.is_dir() else path, 4096).partition("\n")[0]
    names = [n.strip() for n in line.split(",")]
    return any(t in names for t in TIMES) and all(n in names for n, _ in NAMES.values())


detect_xio = Signs(
    text=r"\A.*Gyroscope X \(deg/s\)", also=_has_names_of_xio, folder=_has_names_of_xio
)


def files_of_xio(path: Path) -> tuple[Path, ...]:
    """List the table that is read."""
    return (path / TABLE,) if path.is_dir() and detect_xio(path) else ()


def read_xio(path: Path) -> RawLog:
    """Read rates and specific force, without rows that repeat the one before."""
    raw = under(path / TABLE if path.is_dir() else path)
    time = next(t for t in TIMES if t in raw.columns)
    held = {q: column(raw, n) for q, (n, _) in NAMES.items()}
    raw.stated = {time: ("time", TIMES[time])} | {n: (q, u) for q, (n, u) in NAMES.items()}
    rows = np.column_stack([column(raw, time).astype(np.float64), *held.values()])
    own = np.ones(len(rows), dtype=bool)
    own[1:] = (rows[1:] != rows[:-1]).any(axis=1)
    if own.all():
        return raw
    finding = Finding(
        "io.rows-repeat-sample-before-stamp",
        file=raw.name,
        row=raw.row(int(np.argmin(own))),
        quantity="time",
        severity="note",
        repeated=int((~own).sum()),
        size=own.size,
    )
    raw.findings.append(finding)
    return selected(raw, own)


# Text exports of Xsens MT Manager (MTi, MTx, MTw Awinda) and of Xsens DOT.
#
# Lines of ``//`` at the top, among them ``// Update Rate: 100.0Hz``; then names as
# ``PacketCounter SampleTimeFine Acc_X … Gyr_X … Mag_X …``. Acceleration (with gravity) is in
# m/s², rates in rad/s for an MTi or MTw and deg/s for a DOT, the magnetic field in units of that
# at the factory (MTw Awinda User Manual, table of exported data). ``SampleTimeFine`` counts 0.1
# ms in an MTi (MTi User Manual, section "Time stamp (Sample Time Fine)") and 1 µs in a DOT (Xsens
# DOT User Manual, section 4.2.5); it has 32 bits, and ``PacketCounter`` 16 or 32. Where
# ``SampleTimeFine`` is empty in every row, the counter and the update rate are the stamps.


COUNTER, STAMP = "PacketCounter", "SampleTimeFine"
XSENS_TRIADS = {"Gyr": ("gyro", "rad/s"), "Acc": ("accel", "m/s2")}
_RATE = re.compile(r"//\s*Update Rate:\s*([\d.]+)\s*Hz", re.I)
# Ticks of the two clocks, in µs, and relative tolerance of the stated rate.
TICKS = (100, 1)
LEAST_AGREEMENT = 0.2
# Range of sampling rates of this maker's sensors.
RATES = (1.0, 2000.0)  # Hz
HEAD = 4096  # bytes


def _has_names_of_xsens(path: Path) -> bool:
    """Whether the names are under the comments at the top of a table."""
    if not csv.detect(path):
        return False
    for line in head(path, HEAD).splitlines():
        fields = set(fields_of(line))
        if {COUNTER, STAMP} & fields:
            return any({f"{t}_{a}" for a in "XYZ"} <= fields for t in XSENS_TRIADS)
    return False


detect_xsens = Signs(text=f"{COUNTER}|{STAMP}", also=_has_names_of_xsens)


def read_xsens(path: Path) -> RawLog:
    """Read rates and specific force, with stamps from the counters.

    Stamps in µs of ``SampleTimeFine``; without it, of ``PacketCounter`` and the stated rate.
    """
    data = path.read_bytes()
    raw = csv.parse(data, path.name, (path,))
    if missing := [f"Gyr_{a}" for a in "XYZ" if f"Gyr_{a}" not in raw.columns]:
        raise DataError(
            "io.xsens-columns-missing", file=path.name, quantity="gyro", missing=missing
        )
    match = _RATE.search(data[:HEAD].decode("utf-8-sig", "replace"))
    rate = float(match[1]) if match else None
    rate = rate if rate else None
    stated: dict[str, tuple[str, str | None]] = {
        f"{name}_{axis}": (f"{triad}_{axis.lower()}", unit)
        for name, (triad, unit) in XSENS_TRIADS.items()
        for axis in "XYZ"
        if f"{name}_{axis}" in raw.columns
    }
    findings = list(raw.findings)
    if "Mag_X" in raw.columns:
        add_note(findings, "io.xsens-mag-not-used", file=path.name, quantity="mag")
    columns = dict(raw.columns)
    source, stamps = _stamps(raw, rate, findings)
    if source is not None:
        columns[source] = stamps
        stated[source] = ("time", "us")
    # By the usual step, for a counter that wraps is unwrapped.
    in_us = source == STAMP and usual_step(np.diff(stamps.astype(np.float64))) == usual_step(
        np.diff(raw.columns[STAMP].astype(np.float64))
    )
    if source is None or in_us:
        # A DOT, which counts µs, writes deg/s; without its preamble the numbers have to show it.
        unit = "deg/s" if _is_of_dot(raw) else None
        stated |= {f"Gyr_{axis}": (f"gyro_{axis.lower()}", unit) for axis in "XYZ"}
    return dataclasses.replace(raw, columns=columns, stated=stated, rate=rate, findings=findings)


def _stamps(
    raw: RawLog, rate: float | None, findings: list[Finding]
) -> tuple[str | None, NDArray[Any]]:
    """Return stamps in µs, and the column that they come from."""
    if STAMP in raw.columns and not _is_empty(raw.columns[STAMP]):
        ticks = _unwrapped(raw, STAMP, (32,), findings)
        tick = 1 if _is_of_dot(raw) else _tick(raw, ticks, rate or _rate_by_other_clock(raw))
        if tick != 1:
            add_note(
                findings,
                "io.xsens-tick",
                file=raw.name,
                quantity="time",
                column=STAMP,
                tick_us=tick,
            )
        return STAMP, ticks * tick
    if rate is None or COUNTER not in raw.columns:
        return None, np.empty(0)
    count = _unwrapped(raw, COUNTER, (16, 32), findings)
    add_note(
        findings,
        "io.stamps-over-hz-top-file",
        file=raw.name,
        quantity="time",
        counter=COUNTER,
        rate=rate,
    )
    return COUNTER, np.asarray((count - count[0]) * (1e6 / rate))


def _is_of_dot(raw: RawLog) -> bool:
    """Whether the preamble is that of the application of a DOT."""
    return any(line.startswith("DeviceTag") for line in raw.above)


def _rate_by_other_clock(raw: RawLog) -> float | None:
    """Return the rate, Hz, by a further column of the table that is a clock of a known unit."""
    for name, values in raw.columns.items():
        said = read_name(name)
        if name == STAMP or said.quantity != "time" or values.dtype.kind not in "iuf":
            continue
        length = float(values[-1] - values[0]) * TIME_UNITS.get(said.unit or "", 0.0)
        if length > 0.0:
            return (values.size - 1) / length
    return None


def _is_empty(stamps: NDArray[Any]) -> bool:
    """Whether a column is in the header alone."""
    if stamps.dtype.kind == "f":
        return bool(np.isnan(stamps).all())
    return stamps.dtype.kind == "O" and not any(str(s).strip() for s in stamps)


def _unwrapped(
    raw: RawLog, name: str, widths: tuple[int, ...], findings: list[Finding]
) -> NDArray[Any]:
    """Unwrap a counter that overflows."""
    count = numbers(raw, name, "time")
    if count.dtype.kind not in "iu":
        return count
    count = count.astype(np.int64)
    steps = np.diff(count)
    for bits in widths:
        if count.size and int(count.max()) < 2**bits:
            falls = np.flatnonzero(steps < -(2 ** (bits - 1)))
            if falls.size:
                count[1:] += np.cumsum(steps < -(2 ** (bits - 1))) * 2**bits
                add_note(
                    findings,
                    "io.wrapped-bits-all-undone",
                    file=raw.name,
                    row=raw.row(int(falls[0]) + 1),
                    quantity="time",
                    name=name,
                    bits=bits,
                    size=falls.size,
                )
            break
    return count


def _tick(raw: RawLog, ticks: NDArray[Any], rate: float | None) -> int:
    """Determine the tick in µs: the one that matches the stated rate, or a plausible one."""
    step = float(np.median(np.diff(ticks))) if ticks.size > 1 else 0.0
    if not step > 0.0:
        return TICKS[0]
    found = {tick: 1e6 / (step * tick) for tick in TICKS}
    if rate is not None:
        fits = [t for t, r in found.items() if abs(r / rate - 1.0) <= LEAST_AGREEMENT]
    else:
        fits = [t for t, r in found.items() if RATES[0] <= r <= RATES[1]]
    if len(fits) == 1:
        return fits[0]
    raise raw.fault(
        "io.xsens-tick-undecided" if rate is None else "io.xsens-tick-against-rate",
        STAMP,
        step=step,
        rate_hz=rate,
        choices=[
            Finding("io.choice-of-tick", severity="note", rate_hz=r, tick_us=tick)
            for tick, r in found.items()
        ],
    )
