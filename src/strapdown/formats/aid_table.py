"""Aiding measurements from tables with named columns, and surveyed control points."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.errors import ConfigError, DataError, Finding, add_note
from strapdown.formats import csv, data_sets, holds, open_stream, read_raw, reader_of, table_files
from strapdown.formats.arrays import ticks_of
from strapdown.formats.clocks import CLOCK, GPS, RELATIVE, Clock, on_clock_of, unrolled, with_clock
from strapdown.formats.columns import parse_axes
from strapdown.formats.find_columns import find_quantities
from strapdown.formats.recording import NoStreamError, RawLog, Recording
from strapdown.formats.triad_units import axes_matrix
from strapdown.formats.vocabularies import DATED, Quantity, Vocabulary, spread_of
from strapdown.tables import MAG, NED, POSITION_SD
from strapdown.tables.checks import Array
from strapdown.units import (
    ANGLES,
    FORCES,
    GYRO_UNITS,
    LENGTHS,
    MAG_UNITS,
    OF_TABLES,
    PRESSURES,
    SPEEDS,
    TIME_UNITS,
)

#: Unit of a table's column to the units accepted in a file, with their factors to it.
UNITS: dict[str, Mapping[str, float]] = {
    "": {},
    "m": LENGTHS,
    "m/s": SPEEDS,
    "deg": ANGLES,
    "rad/s": GYRO_UNITS,
    "Pa": PRESSURES,
    "uT": MAG_UNITS,
    "N": FORCES,
}
#: Synonyms of a column, without blanks and underscores. Those of opposite sign are excluded.
SYNONYMS: dict[str, tuple[str, ...]] = {
    "speed": (
        *("velocity", "vel", "v", "wheelspeed", "vehiclespeed", "odometerspeed", "odospeed"),
        *("obdspeed", "canspeed", "carspeed"),
    ),
    "distance": ("odometer", "odo", "mileage", "way"),
    "pulses": ("pulse", "ticks", "counts", "count"),
    "alt": ("altitude", "height", "h", "baroaltitude", "baroheight", "hbaro"),
    "height": ("altitude", "alt", "h", "baroaltitude", "baroheight", "hbaro"),
    "pressure": ("p", "baro", "barometer", "airpressure", "staticpressure"),
    "force": ("f", "fx", "totalforce", "forcesum", "sumofforces", "barrierforce"),
    "mag_x": ("magx", "magneticx", "mx", "bx"),
    "mag_y": ("magy", "magneticy", "my", "by"),
    "mag_z": ("magz", "magneticz", "mz", "bz"),
    "heading": ("yaw", "psi", "azimuth", "course", "hdg"),
}
_SD = "_sd"


def read_aid_table(
    path: str | Path,
    columns: Mapping[str, str],
    *,
    optional: Sequence[str] = (),
    instead: tuple[str, str] | None = None,
    names: Mapping[str, str] | None = None,
    repair: bool = False,
    stream: str = "",
) -> pd.DataFrame:
    """Read the measurements of an aiding sensor.

    `path`: text table or Parquet with column names, which may carry a unit: ``speed_km_h``,
    ``Pressure [hPa]``, ``heading_sd_deg``; or a recording with the `stream`. `columns`: required
    column to its unit, a key of `UNITS`. A column that ends in ``_sd`` is the standard deviation of
    the column before it, and must be positive where given. `optional`: those of `columns` that may
    be missing. `instead`: column, and its unit, that is read where the first one is missing.
    `names`: column of the table to its name in the file, or its number, from 1. `repair`: drop and
    count rows that cannot be used, instead of refusing the file. `stream`: of `formats.STREAMS`,
    read from a recording that holds it. Returns indexed by ``time`` s, with the `columns` that were
    found, in their units; ``attrs`` has the clock (`clocks`), ``source`` and ``findings``.
    ConfigError: the file does not exist, or `names` names a column that it does not have.
    DataError: a column is missing, a unit does not fit, a value is not a number, a standard
    deviation is not positive, or time does not advance; the message names the row.
    """
    path = Path(path)
    raw = _raw(path, stream)
    wanted = {**columns, **dict([instead] if instead is not None else [])}
    units = {c: u for c, (_, u) in raw.stated.items() if u is not None}
    stated = {q: c for c, (q, _) in raw.stated.items() if q == "time" or q in wanted}
    known = {name: Quantity(_words(name), UNITS[unit]) for name, unit in wanted.items()}
    # Of a force kN is its unit, and not that of a speed.
    kinds = (*(["force"] if "force" in wanted else []), *OF_TABLES, "magnetic field")
    vocabulary = Vocabulary({"time": DATED, **known}, kinds)
    asked = {**stated, **(names or {})}
    found = find_quantities(raw.columns, vocabulary, asked, raw.name, {**raw.units, **units})
    if instead is not None:
        of = next(iter(columns))
        if of in found:
            found.pop(instead[0], None)
        elif instead[0] in found:
            columns = {instead[0]: instead[1], **{q: u for q, u in columns.items() if q != of}}
    missing = [q for q in ("time", *columns) if q not in found and q not in optional]
    if missing:
        needed = [q for q in ("time", *columns) if q not in optional]
        raise raw.fault(
            "io.missing-columns",
            missing=missing,
            columns=list(raw.columns),
            needed=needed,
            missing_2=missing[0],
        )
    findings = list(raw.findings)
    time, name, _ = found["time"].stamps(raw)
    if name in (GPS, RELATIVE) and np.isfinite(time).all():
        time, _ = unrolled(time)
    clock = _clock(raw, name)
    there = [name for name in columns if name in found]
    values = {name: found[name].values(raw, name) for name in there}
    for name, unit in columns.items():
        if name in values and UNITS[unit] and not found[name].stated:
            add_note(findings, "io.unit-assumed", file=raw.name, quantity=name, unit=unit)
    keep = _usable(raw, time, values, repair, findings)
    table = pd.DataFrame(
        {name: block[keep] for name, block in values.items()},
        index=pd.Index(time[keep], name="time"),
    )
    rows = np.flatnonzero(keep)
    first, last = raw.row(int(rows[0])), raw.row(int(rows[-1]))
    table.attrs |= {"source": raw.name, "findings": tuple(findings), "axes": raw.axes}
    table.attrs["first_row"] = first if last - first == len(rows) - 1 else None
    return with_clock(table, clock)


def _clock(raw: RawLog, name: str) -> Clock:
    """Clock of stamps, with the GPS week of the first if the file states it."""
    source = next((c for c, (q, _) in raw.stated.items() if q == "week"), None)
    return Clock(name, week=None if source is None else int(raw.columns[source][0]))


#: Units of the quantities of other sensors, with the one that a table has.
_STREAM_UNITS = {
    "mag": (MAG_UNITS, "uT"),
    "pressure": (PRESSURES, "Pa"),
    "speed": (SPEEDS, "m/s"),
    "height": (LENGTHS, "m"),
    "heading": (ANGLES, "deg"),
    "baseline": (LENGTHS, "m"),
}


def stream_beside(
    path: str | Path, stream: str, form: str | None, imu: pd.DataFrame
) -> pd.DataFrame | None:
    """Read a stream that a log of inertial samples may have, on their clock; None without it.

    `path`, `stream`, `form`: as `open_stream`.
    """
    try:
        return on_clock_of(read_stream(path, stream, form), imu)[0]
    except (DataError, ConfigError):
        return None


def temperature_of(recording: Recording, path: str | Path, form: str | None) -> pd.Series | None:
    """Temperature of a log, °C, by the time of its inertial samples; None without two values.

    A column of the log, else that of its barometer. `path`, `form`: as of `open_stream`.
    """
    found = recording.temperature
    if found is None and holds(Path(path), "barometer"):
        table = stream_beside(path, "barometer", form, recording.imu)
        found = None if table is None else table.get("temperature")
    found = None if found is None else found.dropna()
    return found if found is not None and len(found) > 1 else None


def wheel_table(recording: Recording) -> pd.DataFrame:
    """Speed of the wheels in columns of a log, m/s, on the clock of its samples."""
    assert recording.wheel is not None  # asked before
    table = recording.wheel.to_frame("speed")
    table.attrs = {k: recording.imu.attrs[k] for k in CLOCK if k in recording.imu.attrs}
    table.attrs |= {"source": recording.name, "findings": (), "units": {"speed": "m/s"}}
    return table


def but_temperature(findings: Iterable[Finding], recording: Recording) -> Iterator[Finding]:
    """Findings, of which the one about columns without a use does not list the temperature."""
    used = None if recording.temperature is None else str(recording.temperature.name)
    for one in findings:
        if one.code != "io.columns-not-used":
            yield one
        elif names := [name for name in one.data["names"] if name != used]:
            yield one.replace(names=names)


def read_stream(path: str | Path, stream: str, form: str | None = None) -> pd.DataFrame:
    """Read a stream of another sensor: ``magnetometer``, ``barometer``, ``wheel`` or ``heading``.

    `path`, `stream`, `form`: as `open_stream`. Returns indexed by ``time`` s, on the file's clock,
    with what the file states: ``mag_x mag_y mag_z`` in µT, ``pressure`` in Pa, ``speed`` in m/s,
    ``heading heading_sd`` in deg, ``baseline`` in m, ``temperature`` in °C; along the sensor's own
    axes. ``attrs`` has the clock, ``source``,
    ``findings``, and ``units`` by column. NoStreamError: the recording does not have it.
    DataError: it has no stamps, or as `open_stream`.
    """
    raw = open_stream(path, stream, form)
    stated = {q: (c, u) for c, (q, u) in raw.stated.items()} if isinstance(raw, RawLog) else {}
    if not isinstance(raw, RawLog) or "time" not in stated:
        _, reader = reader_of(Path(path))
        title = reader.title if reader is not None else ""
        raise NoStreamError(Path(path).resolve().name, stream, title, ["imu"])
    name, unit = stated.pop("time")
    ticks, dated = ticks_of(raw, name, unit)
    time = np.asarray(ticks * (1e-9 if dated else TIME_UNITS.get(unit or "s", 1.0)), np.float64)
    values, units = {}, {}
    clock = _clock(raw, raw.clock or RELATIVE)
    if clock.name == GPS and np.isfinite(time).all():
        time, _ = unrolled(time)
    stated.pop("week", None)
    for quantity, (source, own) in stated.items():
        known, si = _STREAM_UNITS.get(quantity.partition("_")[0], ({}, own))
        factor = known.get(own or "")
        column = raw.columns[source]
        values[quantity] = column if factor is None else column * factor
        units[quantity] = own if factor is None else si
    table = pd.DataFrame(values, index=pd.Index(time, name="time"))
    table.attrs |= {"source": raw.name, "findings": tuple(raw.findings), "units": units}
    return with_clock(table, clock)


def along_body(table: pd.DataFrame, axes: str = "") -> pd.DataFrame:
    """Turn the magnetic field of a file along the axes of the body.

    `axes`: as ``x,-y,-z``; those that the file states, if empty. DataError: neither states them.
    """
    axes = axes or table.attrs.get("axes") or ""
    if not axes:
        raise DataError("io.field-without-axes", file=table.attrs.get("source"), quantity="axes")
    turned = table[MAG].to_numpy(dtype=np.float64) @ axes_matrix(*parse_axes(axes)).T
    out = pd.DataFrame(turned, index=table.index, columns=MAG)
    out.attrs = dict(table.attrs)
    return out


#: Refusals of a file that is not a table; a table that is damaged says why.
_NO_TABLE = ("io.ending-no-known-format", "io.foreign-format", "io.no-stream")


def _raw(path: Path, stream: str) -> RawLog:
    if not path.exists():
        raise ConfigError("io.no-such-file", file=str(path))
    if stream and holds(path, stream):
        raw = open_stream(path, stream)
        assert isinstance(raw, RawLog)  # of a sensor
        return raw
    if path.is_dir():
        raise DataError(
            "io.folder",
            file=path.resolve().name,
            suffixes=(*csv.SUFFIXES, *table_files.PARQUET_SUFFIXES),
            suffix=path.suffix,
        )
    if table_files.detect_parquet(path) or csv.detect(path):
        return (
            table_files.read_parquet(path) if table_files.detect_parquet(path) else csv.read(path)
        )
    try:
        return read_raw(path)
    except DataError as error:
        if error.finding.code not in _NO_TABLE:
            raise
        raise DataError(
            "io.aid-file-ending",
            file=path.name,
            suffixes=(*csv.SUFFIXES, *table_files.PARQUET_SUFFIXES),
            suffix=path.suffix,
        ) from None


def read_reference_path(path: str | Path) -> pd.DataFrame:
    """Read the path of a point from cameras or a survey.

    `path`: a table with the columns ``time north east down`` and, if not exact, ``north_sd east_sd
    down_sd``; s and m, unless a column states another unit. Returns indexed by time in s, positions
    in m. ConfigError: the file does not exist. DataError: as `read_aid_table`, or a standard
    deviation is missing beside another.
    """
    columns = dict.fromkeys([*NED, *POSITION_SD], "m")
    table = read_aid_table(path, columns, optional=POSITION_SD)
    has_sd = [name for name in POSITION_SD if name in table]
    if has_sd and len(has_sd) < len(POSITION_SD):
        missing = next(name for name in POSITION_SD if name not in table)
        raise DataError(
            "io.missing-while-another-standard-deviation",
            file=table.attrs["source"],
            quantity=missing,
        )
    return table[[*NED, *has_sd]]


def _words(name: str) -> tuple[str, ...]:
    if name.endswith(_SD):
        return spread_of(*_words(name.removesuffix(_SD)))
    return (name.lower().replace("_", ""), *SYNONYMS.get(name, ()))


def _usable(
    raw: RawLog, time: Array, values: dict[str, Array], repair: bool, findings: list[Finding]
) -> NDArray[np.bool_]:
    """Select rows of numbers that are later than every row before them."""
    keep = np.ones(time.size, dtype=bool)
    for name, block in {"time": time, **values}.items():
        bad = ~np.isfinite(block)
        code = "io.aid-no-number"
        if name.endswith(_SD) and not bad.any():
            bad, code = ~(block > 0.0), "io.aid-sd-not-positive"
        _refuse_or_say(raw, name, bad, code, repair, findings)
        keep &= ~bad
    latest = np.maximum.accumulate(np.where(keep, time, -np.inf))
    late = keep & np.concatenate([[False], time[1:] <= latest[:-1]])
    _refuse_or_say(raw, "time", late, "io.aid-not-later", repair, findings)
    keep &= ~late
    if not keep.any():
        raise raw.fault("io.no-usable-row")
    return keep


def _refuse_or_say(
    raw: RawLog, name: str, bad: NDArray[np.bool_], code: str, repair: bool, findings: list[Finding]
) -> None:
    rows = np.flatnonzero(bad)
    if not rows.size:
        return
    fault = Finding(code, file=raw.name, row=raw.row(int(rows[0])), quantity=name, count=rows.size)
    if not repair:
        raise DataError(fault)
    add_note(findings, "io.left-out", file=fault.file, row=fault.row, quantity=name, reason=fault)


#: Columns, m.
POINT = ["north", "east"]


def read_control_points(path: str | Path, names: Mapping[str, str] | None = None) -> pd.DataFrame:
    """Read control points.

    Parameters
    ----------
    path : str or Path
        A text table or Parquet with columns ``time north east``, s and m, from any origin and
        in any direction; or the log of a foot-mounted unit that has them (`foot_mounted`).
    names : dict of str to str, optional
        Column of the table to its name in the file.

    Returns
    -------
    DataFrame
        By ``time`` s: ``north``, ``east`` m.

    Raises
    ------
    ConfigError
        The file does not exist.
    DataError
        The file cannot be used, or it has fewer than two points, which leave the heading open.
    """
    path = Path(path)
    if path.is_file() and data_sets.detect_foot_points(path):
        time, places = data_sets.read_foot_points(path)
        table = pd.DataFrame(places, index=pd.Index(time, name="time"), columns=POINT)
        table.attrs |= {"source": path.name, "findings": ()}
        table = with_clock(table, Clock(RELATIVE))
    else:
        table = read_aid_table(path, dict.fromkeys(POINT, "m"), names=names)
    if len(table) < 2:
        raise DataError("io.control-point-origin-heading-fit", file=path.name, count=len(table))
    return table
