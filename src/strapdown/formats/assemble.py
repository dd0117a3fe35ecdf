"""Assemble the columns of a file into a recording in body axes and SI units."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.constants import STANDARD_GRAVITY, Array
from strapdown.dsp.samples import constant_beside_noise
from strapdown.errors import ConfigError, DataError, Finding, add_note, add_warning
from strapdown.formats.arrays import as_rows, epoch_of, numbers, open_dates, ticks_of
from strapdown.formats.clocks import (
    RELATIVE,
    Clock,
    Stamps,
    clock_of_name,
    counted,
    even_stamps,
    is_count,
    read_stamps,
    spread_bursts,
    with_clock,
)
from strapdown.formats.columns import LONGEST, OF_BROWSER, parse_axes, read_name
from strapdown.formats.find_columns import (
    AXES,
    Column,
    advances,
    find_columns,
    is_of_series,
    names_of_fixes,
    names_of_velocities,
    reference,
    steady_triads,
    unit_stated,
    without_gyro,
)
from strapdown.formats.inference.conclusion import infer_accel, infer_time_unit
from strapdown.formats.join import join
from strapdown.formats.known_formats import rows_of_kinds
from strapdown.formats.recording import (
    AXES_OF_SENSOR,
    Origin,
    Questions,
    RawLog,
    Reading,
    ReadOptions,
    Recording,
)
from strapdown.formats.triad_units import (
    LIKELY,
    SUMS,
    UNITS,
    LogInUse,
    axes_matrix,
    body_axes,
    intervals,
    mirrored,
    sampling_of,
    told_by_numbers,
    unit_of_counts,
    units_of_triads,
    values_of_triads,
)
from strapdown.formats.vocabularies import EULERS, QUATERNIONS
from strapdown.formats.wheel_columns import names_of_wheels, wheel_speed
from strapdown.tables import ACCEL, GYRO, attitude_table, find_gaps, imu_of_columns
from strapdown.tables.checks import IMPOSSIBLE_FORCE, IMPOSSIBLE_RATE, all_finite
from strapdown.tables.on_disk import filled, let_go, room, step_range, stored
from strapdown.units import DATE_ORDERS, TIME_UNITS, factor_of, parse_unit


def assemble(raw: RawLog, options: ReadOptions, *, keep: bool = False) -> Recording:
    """Convert raw columns to a recording, which may take their memory.

    `options`: the user's statements override those of the file, which override column names.
    `keep`: whether the columns are used again, and left as they are.
    DataError: a value, a stamp or a unit cannot be used; the message names file, row and remedy.
    ConfigError: an option names a column that does not exist.
    """
    questions = Questions(raw.name)
    raw = _with_force_of_parts(raw, options)
    found = find_columns(raw, options, questions)
    missing = [q for q in GYRO if q not in found]
    # Of columns that the user names, the rows may be those of other sensors, too.
    asked = not missing and found["gyro_x"].basis in ("option", "open")
    if (missing or asked) and (kinds := rows_of_kinds(raw, asked=asked)):
        raise kinds
    if missing:
        raise without_gyro(raw, missing)
    if options.accel_unit is not None and not set(ACCEL) & set(found):
        _refuse_unit_of_nothing(raw, found, options.accel_unit)
    unused = _unused(raw, found)
    if parts := _by_sensor(raw, found):
        raw = dataclasses.replace(
            join(parts, raw.name, raw.files),
            axes=raw.axes,
            sampling=raw.sampling,
            clock=raw.clock,
            triad_units=raw.triad_units,
        )
        found = find_columns(raw, dataclasses.replace(options, columns={}))
    findings = [*raw.findings, *unused]
    if found["gyro_x"].source not in raw.stated:
        findings = [f for f in findings if f.code != "io.first-of-monitors"]
    log = LogInUse(raw, options, questions, found, findings)
    _report_browser(log)
    values = log.values = values_of_triads(log)
    try:
        _take_out_codes(log)
    except DataError as error:
        questions.ask(error.finding, **_repair(error.finding, len(values["gyro"])))
        questions.refuse()
    if not keep:
        _take_memory(log)
    let_go(values["gyro"])
    order = options.time_unit if options.time_unit in DATE_ORDERS else None
    ticks, dated = (
        ticks_of(raw, found["time"].source, found["time"].unit, order)
        if "time" in found
        else (None, False)
    )
    if ticks is not None and ticks.size > 2 and raw.truth is None and step_range(ticks)[1] < 0:
        return assemble(raw.backward(), options, keep=keep)
    if ticks is not None and raw.truth is None and (in_time := _even_order(ticks)) is not None:
        return assemble(raw.in_order(in_time, "io.rows-out-of-order"), options, keep=keep)
    if ticks is not None and dated:
        _report_dates(log, found["time"].source)
    even = None
    if ticks is not None and not _written_twice(ticks, values):
        even = even_stamps(ticks) or spread_bursts(ticks)
        ticks = ticks if even is None else even.ticks
    log.said = told_by_numbers(log, ticks, dated)
    let_go(values["gyro"])
    axes = body_axes(log)
    units = units_of_triads(log)
    if "accel" in units and (turned := _in_world_axes(log)) is not None:
        log.warn("io.left-out-world-axes", "accel", **turned)
        del units["accel"]
    values = log.values = {t: values[t] for t in units}
    try:
        finite = _finite_rows(log, ticks)
    except DataError as error:
        if error.finding.code not in REPAIRABLE:
            raise
        questions.ask(error.finding, **_repair(error.finding, len(values["gyro"])))
        questions.refuse()
        raise
    let_go(values["gyro"])
    try:
        stamps = _stamps_of_log(log, ticks, dated, finite)
    except DataError as error:
        code, choices = error.finding.code, error.finding.data.get("choices")
        if code in REPAIRABLE:
            questions.ask(error.finding, **_repair(error.finding, len(finite)))
        elif code == "io.time-unit-undecided" and choices:
            best = choices[0].data
            unit = str(best["unit"]) if best["share"] >= LIKELY else "UNIT"
            counts = any(c.code == "io.choice-of-count" for c in choices)
            questions.ask(error.finding, **({"rate": "HZ"} if counts else {"time_unit": unit}))
        elif code == "io.time-unit-named-too-fast":
            questions.ask(error.finding, time_unit=str(error.finding.data["likely"]))
        elif code == "io.time-column-missing":
            name = _likely_clock(raw, found)
            questions.ask(error.finding, **({"time": name} if name else {"rate": "HZ"}))
        else:
            questions.refuse()
            raise
    questions.refuse()
    whole = bool(finite.all() and stamps.keep.all())
    if whole:
        kept = filled(finite.size, lambda part: np.arange(part.start, part.stop), np.int64)
        time = stamps.seconds
    else:
        kept = stored(np.flatnonzero(finite)[stamps.keep])
        time = stored(stamps.seconds, np.flatnonzero(stamps.keep))
    if time.size < 2:
        raise raw.fault("io.too-few-samples", "time", size=time.size)
    # A median of steps is at most twice their mean.
    faster = 2.0 * (time[-1] - time[0]) <= SLOWEST * (time.size - 1)
    slow = 0.0 if faster else float(np.median(np.diff(time)))
    if slow > SLOWEST and options.time_unit is None and options.rate is None:
        raise raw.fault(
            "io.too-slow-for-a-gyro",
            "time",
            size=time.size,
            length=time[-1] - time[0],
            step=slow,
            unit=stamps.unit,
        )
    if even is not None:
        factor = factor_of(stamps.unit, TIME_UNITS)
        findings.append(even.finding(factor, file=raw.name, quantity="time"))
    clock, of_time = _clock_of_log(log, stamps, dated, int(kept[0]))
    readings = [of_time]
    body, block = _block(values, units, kept.size, keep)
    begins = {triad: values[triad][kept[0]].copy() for triad in units}
    factors = {t: factor_of(unit, {**UNITS[t], **SUMS[t]}) for t, (unit, _) in units.items()}
    as_they_are = (axes.axis, axes.sign) == AS_THEY_ARE
    changed = [  # a triad may be where its body axes go, and already in these and in SI units
        t
        for t in units
        if not (as_they_are and factors[t] == 1.0)
        or values[t].__array_interface__ != body[t].__array_interface__
    ]
    for begin in range(0, kept.size if changed else 0, AT_ONCE):
        rows = slice(begin, begin + AT_ONCE)
        used = {
            # A copy, as the body axes may take the memory of the sensor's.
            triad: values[triad][rows].copy(order="K") if whole else values[triad][kept[rows]]
            for triad in changed
        }
        for triad in changed:
            for j, (axis, sign) in enumerate(zip(axes.axis, axes.sign, strict=True)):
                with np.errstate(over="ignore"):  # what is no force or rate is refused below
                    sensed = used[triad][:, axis]
                    np.multiply(sensed, sign * factors[triad], out=body[triad][rows, j])
            let_go(values[triad])
        let_go(block)
        let_go(kept)
    del values
    log.values = {}
    for triad, (unit, why) in units.items():
        if unit in SUMS[triad]:
            body[triad] /= intervals(time, kept)
        for j, (axis, sign) in enumerate(zip(axes.axis, axes.sign, strict=True)):
            column = found[f"{triad}_{AXES[axis]}"]
            to = ("-" if sign < 0 else "") + f"{triad}_{AXES[j]}"
            because = f"{column.why}; unit {why}; axes {axes.why}"
            first = float(begins[triad][axis])
            readings.append(Reading(column.written, to, unit, because, first))
    sampling = sampling_of(log, units)
    _report_gaps(log, time, body["gyro"])
    _report_beyond_limits(log, body, kept)
    _report_constant(log, body, axes.axis)
    let_go(block)
    _report_weightless(log, body.get("accel"))
    columns = [f"{triad}_{a}" for triad in units for a in AXES]
    sparse = any(not all_finite(body[triad]) for triad in raw.sparse if triad in body)
    imu = imu_of_columns(time, block, columns, sampling=sampling, source=raw.name, sparse=sparse)
    if not axes.stated:
        imu.attrs["axes"] = AXES_OF_SENSOR
    imu.attrs["sensor_axes"] = ",".join(
        ("-" if sign < 0 else "") + AXES[axis]
        for axis, sign in zip(axes.axis, axes.sign, strict=True)
    )
    with_clock(imu, clock)
    if raw.epoch == 0.0:
        imu.attrs["clock_origin_stamp"] = (stamps.origin.stamp, stamps.origin.unit)
    if raw.calibrated is not None:
        imu.attrs["calibrated"] = raw.calibrated
    first_row, last_row = raw.row(int(kept[0])), raw.row(int(kept[-1]))
    imu.attrs["first_row"] = first_row if last_row - first_row == len(kept) - 1 else None
    truth, scored = _truth_of_log(log, time, kept, (axes.axis, axes.sign), readings)
    wheel = wheel_speed(raw, time, kept, log.findings)
    return Recording(
        name=raw.name,
        files=raw.files,
        origin=stamps.origin,
        imu=imu,
        truth=truth,
        scored=scored,
        readings=tuple(readings),
        findings=tuple(log.findings),
        start=raw.start,
        temperature=_temperature(raw, time, kept),
        wheel=wheel,
    )


#: Share by which the length of gravity varies, and of it the most that is left in an acceleration
#: without gravity, as a median.
STEADY, LEFT = 0.02, 0.2


def _of_names(raw: RawLog, axes: Mapping[str, str]) -> Array:
    return np.column_stack([raw.columns[axes[a]].astype(np.float64) for a in AXES])


def _is_beside_gravity(gravity: Array, accel: Array) -> bool:
    """Whether vectors are gravity, and accelerations beside it have none."""
    size = np.linalg.norm(gravity, axis=1)
    usual = float(np.nanmedian(size))
    if not usual > 0.0 or np.nanmean(np.abs(size - usual) > STEADY * usual) > STEADY:
        return False
    along = np.einsum("ij,ij->i", gravity, accel) / usual
    return bool(abs(float(np.nanmedian(along))) < LEFT * usual)


def _with_force_of_parts(raw: RawLog, options: ReadOptions) -> RawLog:
    """Return a log whose force is linear acceleration plus gravity, where it has no other.

    Both as phones write them, in one unit. A name of Core Motion, user acceleration, is left: its
    sign is a question of its own. Acceleration whose name does not say it is without gravity is
    so where gravity beside it is as long all the time, and is not in it.
    """
    if raw.stated or any(q.startswith("accel") for q in options.columns):
        return raw
    parts: dict[bool, dict[str, str]] = {True: {}, False: {}}
    named = True
    for name, column in raw.columns.items():
        said = read_name(name)
        triad, _, axis = str(said.quantity).partition("_")
        if triad not in ("accel", "gravity") or not axis:
            continue
        is_gravity = triad == "gravity"
        if axis in parts[is_gravity]:
            return raw  # one that is there twice
        if "user" in said.family or column.dtype.kind not in "iuf":
            return raw
        parts[is_gravity][axis] = name
        named &= is_gravity or said.linear
    gravity, linear = parts[True], parts[False]
    names = [*linear.values(), *gravity.values()]
    units = {unit_stated(raw, name) for name in names}
    if not len(gravity) == len(linear) == len(AXES) or len(units) != 1:
        return raw
    if not (named or _is_beside_gravity(*(_of_names(raw, part) for part in (gravity, linear)))):
        return raw  # an accelerometer of its own
    used = names if named else linear.values()
    columns = {name: column for name, column in raw.columns.items() if name not in used}
    sums = {f"accel_{a}": raw.columns[linear[a]] + raw.columns[gravity[a]] for a in AXES}
    unit = units.pop()
    stated = dict.fromkeys(sums, unit) if unit else {}
    finding = Finding(
        "io.force-of-linear-and-gravity",
        severity="note",
        file=raw.name,
        quantity="accel",
        names=names,
    )
    return dataclasses.replace(
        raw,
        columns={**columns, **sums},
        units={**raw.units, **stated},
        findings=[*raw.findings, finding],
    )


#: Names of columns with a temperature; those of raw counts or of another part; degrees Fahrenheit.
_TEMPERATURE = re.compile(r"(?<![a-z])temp(erature)?(?![a-z])", re.I)
_OTHER_TEMPERATURE = re.compile(r"raw|lsb|adc|count|batt|cpu|ambient|baro", re.I)
_FAHRENHEIT = re.compile(r"fahrenheit|(deg|°|_) ?f(?![a-z])", re.I)


def _temperature(raw: RawLog, time: Array, kept: NDArray[np.int64]) -> pd.Series | None:
    """Temperature of the sensor at the samples, °C; of several columns the first."""
    stated = {source for source, (quantity, _) in raw.stated.items() if quantity == "temperature"}
    for source, values in raw.columns.items():
        named = _TEMPERATURE.search(source) and not _OTHER_TEMPERATURE.search(source)
        if values.dtype.kind not in "iuf" or not (source in stated or named):
            continue
        written = f"{source} {raw.units.get(source, '')}"
        factor, zero = (5.0 / 9.0, 32.0) if _FAHRENHEIT.search(written) else (1.0, 0.0)
        degrees = stored(values, kept).astype(np.float64)
        degrees -= zero
        degrees *= factor
        return pd.Series(degrees, pd.Index(time, name="time", copy=False), name=source, copy=False)
    return None


#: Numbers that loggers and spreadsheets write for a missing value, and those among whole numbers,
#: of which -32768 is a reading at the end of a range; so many times beyond all others of a channel.
MISSING = (999.0, 999.25, 9999.0, 99_999.0, 999_999.0, 32_768.0, 1e20, 1e30)
MISSING_COUNTS, BEYOND = MISSING[2:5], 4.0


def _take_out_codes(log: LogInUse) -> None:
    """Replace the numbers that mean a missing value by NaN.

    DataError: there are some, and rows may not be dropped.
    """
    for triad, block in log.values.items():
        codes: dict[float, NDArray[np.bool_]] = {}
        for k in range(3):
            channel = block[:, k]
            for extreme in {float(channel.min()), float(channel.max())}:
                if abs(extreme) not in MISSING:
                    continue
                known = channel != extreme
                if abs(extreme) not in MISSING_COUNTS and not (channel[known] % 1 != 0).any():
                    continue
                rest = float(np.abs(channel[known]).max(initial=0.0))
                if known.any() and rest * BEYOND < abs(extreme) and 2 * known.sum() > known.size:
                    codes[extreme] = codes.get(extreme, np.zeros(len(block), bool)) | ~known
        for code, rows in codes.items():
            row, count = int(rows.argmax()), int(rows.sum())
            where = {"value": code, "count": count}
            if not log.options.repair:
                raise log.raw.fault("io.missing-value-code", triad, sample=row, **where)
            log.note("io.missing-values-left-out", triad, row=log.raw.row(row), **where)
            block = np.where(block == code, np.nan, block)
        if codes:
            log.values[triad] = block


def _report_dates(log: LogInUse, source: str) -> None:
    """Report stamps of another epoch than 1970, and dates whose day and month are open."""
    values = log.raw.columns[source]
    if (epoch := epoch_of(values, source)) is not None:
        log.note("io.stamps-of-epoch", "time", source=source, epoch=epoch)
    if log.options.time_unit not in DATE_ORDERS and (readings := open_dates(values)):
        log.warn("io.date-order-open", "time", source=source, date=values[0], **readings)


def _take_memory(log: LogInUse) -> None:
    """Replace the columns of the log by those of triads that were copied."""
    for triad, block in log.values.items():
        for column, values in zip(log.columns(triad), block.T, strict=True):
            if column.sign > 0.0 and log.raw.columns[column.source].dtype == values.dtype:
                log.raw.columns[column.source] = values


def _report_browser(log: LogInUse) -> None:
    """Say which axes the rates of a browser are taken about: its documents name two orders."""
    names = [log.found[q].source for q in GYRO]
    if all(map(OF_BROWSER.fullmatch, names)):
        alpha, beta, gamma = (reference(log.raw, name) for name in names)
        other = f"gyro_x={beta},gyro_y={gamma},gyro_z={alpha}"
        log.note("io.rates-of-browser", "gyro", names=names, columns=other)


#: Largest difference of a step of rows put in order from the usual one, relative to it.
EVEN = 0.5


def _even_order(ticks: NDArray[Any]) -> NDArray[np.int64] | None:
    """Return the order of rows that are out of order, if they then are those of one log.

    Their stamps are distinct, and follow each other evenly; those of two logs one below the other
    do not, nor those of a clock that was set.
    """
    if ticks.size < 4 or step_range(ticks)[0] >= 0 or not np.isfinite(ticks).all():
        return None
    order = np.argsort(ticks, kind="stable")
    steps = np.diff(np.asarray(ticks)[order].astype(np.float64))
    usual = float(np.median(steps))
    even = usual > 0.0 and bool((np.abs(steps - usual) <= EVEN * usual).all())
    return order if even else None


def _written_twice(ticks: NDArray[Any], values: Mapping[str, Array]) -> bool:
    """Whether most rows that repeat the stamp before them repeat its values, too."""
    if ticks.dtype.kind not in "iuf":
        return False
    again = np.flatnonzero(ticks[1:] == ticks[:-1])
    if not again.size:
        return False
    same = [np.all(v[again] == v[again + 1], axis=1) for v in values.values()]
    return bool(np.all(same, axis=0).mean() > 0.5)


def _likely_clock(raw: RawLog, found: dict[str, Column]) -> str:
    """Return the column that advances evenly as a clock does; empty if there is not just one."""
    used = {column.source for column in found.values()}
    likely = []
    for name, values in raw.columns.items():
        if name in used or values.dtype.kind not in "iuf" or is_of_series(raw, name):
            continue
        if advances(values):
            likely.append(name)
    return likely[0] if len(likely) == 1 and not set(",=") & set(likely[0]) else ""


#: Faults of rows that `ReadOptions.repair` leaves out.
REPAIRABLE = {
    "io.missing-value-code",
    "io.not-finite-in-rows",
    "io.pause-impossible",
    "io.stamp-impossible",
    "io.stamp-repeated",
    "io.time-goes-back",
    "io.time-counter-wraps",
}


#: Largest share of the rows whose loss is proposed. Rows that arrive in bursts with one stamp are
#: no faults of rows.
MOST_REPAIRED = 0.1


def _repair(fault: Finding, count: int) -> dict[str, str]:
    """Return the answer to faults of rows, if it does not cost much of the log."""
    rows = fault.data.get("lost", fault.data.get("count", 1))
    return {"repair": "true"} if rows <= MOST_REPAIRED * count else {}


#: Longest usual step of a log with a gyro, s. Between samples that are farther apart any turn may
#: be hidden; such rows are of another sensor's rate, or of another unit of time.
SLOWEST = 2.0
#: Rate up to which the name of a clock is believed against its steps, Hz: crash units take 20 kHz.
FASTEST = 21e3


def _unused(raw: RawLog, found: dict[str, Column]) -> list[Finding]:
    """List the columns that neither a quantity takes nor a fix."""
    used = {column.source for column in found.values()}
    if not (names := [name for name in raw.columns if name and name not in used]):
        return []
    others = {*names_of_fixes(raw), *names_of_wheels(raw)}
    if not (names := [name for name in names if name not in others]):
        return []
    out: list[Finding] = []
    if velocities := names_of_velocities(raw):
        add_note(out, "io.velocities-in-log", file=raw.name, names=velocities)
        names = [name for name in names if name not in velocities]
    if names:
        add_note(out, "io.columns-not-used", file=raw.name, names=names)
    clocks = [n for n in names if _is_clock(n)]
    if clocks and "time" in found and not raw.stated:
        add_note(
            out,
            "io.clock-of-several",
            file=raw.name,
            quantity="time",
            source=found["time"].source,
            names=clocks,
            other=clocks[0],
        )
    if not set(ACCEL) & set(found):
        forces = [n for n in names if read_name(n).quantity in ACCEL]
        if {read_name(n).quantity for n in forces} == set(ACCEL):
            named = {read_name(n).quantity: n for n in reversed(forces)}
            likely = _as_accelerometer(raw, [named[q] for q in ACCEL])
            add_warning(
                out,
                "io.accelerometer-not-read",
                file=raw.name,
                quantity="accel",
                names=forces,
                **likely,
            )
        elif not forces:
            for three, norm in steady_triads(raw, names):
                data = {"names": three, "norm": norm, **_as_accelerometer(raw, three)}
                add_warning(
                    out,
                    "io.columns-like-accelerometer",
                    file=raw.name,
                    quantity="accel",
                    data=data,
                )
    return out


def _is_clock(name: str) -> bool:
    """Whether a name is that of a clock; a date alone is none, and a lone T is a temperature."""
    said = read_name(name)
    return said.quantity == "time" and said.loose < 2 and name.strip() != "T"


def _as_accelerometer(raw: RawLog, three: list[str]) -> dict[str, Any]:
    """Return three columns as ``columns``, and the likely ``unit`` of an accelerometer in them."""
    columns = (f"accel_{a}={reference(raw, n)}" for a, n in zip(AXES, three, strict=True))
    numeric = all(raw.columns[n].dtype.kind in "iuf" for n in three)
    values = np.column_stack([raw.columns[n].astype(float) for n in three]) if numeric else None
    unit = None
    if values is not None and len(values := values[np.isfinite(values).all(axis=1)]):
        inferred, *_ = infer_accel(values, None)
        likely = inferred.value if inferred.confidence >= LIKELY else None
        unit = unit_of_counts(inferred) or likely
    return {"columns": ",".join(columns), "unit": str(unit or "UNIT")}


def _refuse_unit_of_nothing(raw: RawLog, found: dict[str, Column], unit: str) -> None:
    """Refuse a unit that the user states for an accelerometer without a column.

    A reader that left the accelerometer out has said so.
    """
    if any(f.quantity == "accel" for f in raw.findings):
        return
    used = {column.source for column in found.values()}
    names = [name for name in raw.columns if name and name not in used]
    likely = next(iter(steady_triads(raw, names)), None)
    raise ConfigError(
        "io.unit-without-column",
        file=raw.name,
        quantity="--accel-unit",
        unit=unit,
        names=names or ["none"],
        columns=_as_accelerometer(raw, likely[0])["columns"]
        if likely
        else ",".join(f"accel_{a}=NAME" for a in AXES),
    )


#: A table whose sensors have their own rows leaves out at least this share of one sensor.
OWN_ROWS = 0.2


def _by_sensor(raw: RawLog, found: dict[str, Column]) -> list[RawLog]:
    """Take apart a wide table whose sensors have rows of their own, with the other cells empty.

    Empty if every triad has a value in most rows, or the table has no time.
    """
    clocks = _own_clocks(raw, found)
    if ("time" not in found and not clocks) or raw.sparse:
        return []
    there: dict[str, NDArray[np.bool_]] = {}
    for triad in ("gyro", "accel", "mag"):
        columns = [raw.columns[found[q].source] for a in AXES if (q := f"{triad}_{a}") in found]
        if len(columns) == 3 and all(c.dtype.kind == "f" for c in columns):
            if all(all_finite(c) for c in columns):
                there[triad] = np.ones(columns[0].size, dtype=bool)
            else:
                there[triad] = ~np.logical_and.reduce([np.isnan(c) for c in columns])
    left_out: list[Finding] = []
    if "accel" in there and found["accel_x"].basis == "name":
        # Rows may say their sensor in a column of text: linear acceleration has no gravity.
        texts = [c[there["accel"]] for c in raw.columns.values() if c.dtype.kind == "O"]
        kinds = [set(map(str, c)) for c in texts]
        if any(len(k) == 1 and read_name(f"{k.pop()} x").linear for k in kinds):
            del there["accel"]
            code = "io.left-out-linear-acceleration"
            left_out = [Finding(code, file=raw.name, quantity="accel", severity="note")]
    shares = [float(rows.mean()) for rows in there.values()]
    if "gyro" not in there or (min(shares) > 1.0 - OWN_ROWS and not clocks) or min(shares) == 0.0:
        return []
    rows = np.arange(1, there["gyro"].size + 1) if raw.rows is None else raw.rows
    parts = []
    for triad, keep in there.items():
        clock = clocks[triad] if clocks else found["time"]
        keep = keep & np.isfinite(raw.columns[clock.source]) if clocks else keep
        mine = [clock, *(found[f"{triad}_{a}"] for a in AXES)]
        names = ["time", *(f"{triad}_{a}" for a in AXES)]
        values = {c.written: raw.columns[c.source][keep] for c in mine}
        parts.append(
            RawLog(
                name=raw.name,
                files=raw.files,
                columns=values | {c.written: -values[c.written] for c in mine if c.sign < 0.0},
                rows=rows[keep],
                stated={c.written: (n, c.unit) for c, n in zip(mine, names, strict=True)},
                findings=[*raw.findings, *left_out] if triad == "gyro" else [],
            )
        )
    return parts


#: A name that ends in that of a clock, behind the name of a sensor, and before a unit.
_OWN_CLOCK = re.compile(
    r"(?:^|.*[\s_.])(?:t|time|timestamp|stamp|X(?= ?\[s\]))(?:[\s_.\[(]*(s|sec|ms|us|ns)[\])]?)?"
    r"(?: \(\d+\))?",
    re.I,
)


def _own_clocks(raw: RawLog, found: dict[str, Column]) -> dict[str, Column]:
    """Return the clock of each triad in a table of sensors side by side, each behind its own.

    Empty if the triads have one clock, or clocks whose stamps do not overlap: they are of others.
    """
    names, usual = list(raw.columns), found.get("time")
    likely = [n for n in names if raw.columns[n].dtype.kind in "iuf" and len(n) < LONGEST]
    clocks = [n for n in likely if _OWN_CLOCK.fullmatch(n)]
    out: dict[str, Column] = {}
    for triad in ("gyro", "accel", "mag"):
        if f"{triad}_x" not in found:
            continue
        before = names[: names.index(found[f"{triad}_x"].source)]
        clock = next((n for n in reversed(before) if n in clocks), None)
        if clock is None:
            return {}
        match = _OWN_CLOCK.fullmatch(clock)
        unit = (match and match[1]) or (usual.unit if usual else None)
        out[triad] = Column(clock, unit, "name")
    stamps = [raw.columns[c.source] for c in out.values()]
    if len(stamps) < 2 or len({c.source for c in out.values()}) < 2:
        return {}
    if usual and any(np.array_equal(stamps[0], s) for s in stamps[1:]):
        return {}
    for stamp in (s[np.isfinite(s)] for s in stamps):
        if stamp.size < 2 or (np.diff(stamp) < 0).any() or stamp[0] == stamp[-1]:
            return {}  # a name that ends in t may be that of a temperature
    first, last = max(map(np.nanmin, stamps)), min(map(np.nanmax, stamps))
    return out if first < last else {}


def require_accel(recording: Recording) -> None:
    """Refuse a log without specific force; the message says what became of its columns.

    DataError: no accelerometer was recognized, or none with gravity.
    """
    found = {f.code: f for f in recording.findings}
    if ACCEL[0] not in recording.imu.columns:
        left_out = [
            f
            for f in recording.findings
            if f.code.startswith("io.left-out") or f.code == "io.force-without-gravity"
        ]
        unused = found.get("io.columns-not-used")
        code = "io.no-accelerometer-left-out" if left_out else "io.no-accelerometer"
        if not left_out and unused is None:
            code = "io.no-accelerometer-in-file"
        raise DataError(
            code,
            file=recording.name,
            quantity="accel",
            left_out=left_out,
            names=unused.data["names"] if unused else ["none"],
        )
    if "io.no-gravity" in found:
        raise DataError(
            "io.no-specific-force",
            file=recording.name,
            quantity="accel",
            reason=found["io.no-gravity"],
        )


#: Samples that are converted at a time.
AT_ONCE = 1 << 16


def _block(
    values: Mapping[str, Array], triads: Iterable[str], count: int, keep: bool
) -> tuple[dict[str, Array], Array]:
    """Return where the triads of a table go, by name, and all of it, (count, 3 k).

    Column by column in one array, which the table keeps: a long log takes a large part of the
    memory. The array of the log itself, if all its rows are used and these columns are together.
    """
    names = list(triads)
    columns = [values[triad].T[k] for triad in names for k in range(3)]
    columns.sort(key=lambda one: int(one.__array_interface__["data"][0]))
    rows = as_rows(columns) if columns[0].size == count and not keep else None
    block = (room((3 * len(names), count)) if rows is None else rows).T
    return {triad: block[:, 3 * k : 3 * k + 3] for k, triad in enumerate(names)}, block


def _stamps_of_log(
    log: LogInUse, ticks: NDArray[Any] | None, dated: bool, finite: NDArray[np.bool_]
) -> Stamps:
    """Convert the stamps of the finite rows to seconds; inferences and repairs are reported.

    `ticks` ((n,)): stamps as in the file. `dated`: whether they were dates, now converted to ns.
    `finite` ((n,)): from `_finite_rows`. DataError: time is missing, or cannot be used.
    ConfigError: the stated rate is invalid.
    """
    raw, options = log.raw, log.options
    rows = np.flatnonzero(finite) if ticks is None or not finite.all() else None
    rate = options.rate or raw.rate
    if options.rate is not None and not (np.isfinite(options.rate) and options.rate > 0):
        raise ConfigError("io.rate-not-positive", quantity="--rate", rate=options.rate)
    where: dict[str, Any] = {
        "file": raw.name,
        "row": lambda k: raw.row(k if rows is None else int(rows[k])),
        "repair": options.repair,
    }
    if ticks is None:
        assert rows is not None
        if rate is None:
            raise raw.fault("io.time-column-missing", "time")
        if numbered := counted(raw.columns):
            name, count = numbered
            lost = int(count[-1]) + 1 - count.size
            log.note("io.time-from-counter", "time", source=name, rate=rate, lost=lost)
            why = f"samples as numbered by {name!r}, {rate:g} Hz as stated"
            return read_stamps(count[rows] / rate, "s", why, **where)
        why = f"no time column: {rate:g} Hz as stated"
        everything = np.ones(rows.size, dtype=bool)
        return Stamps(rows / rate, "s", why, everything, Origin(0, "s"), [])
    column, inferred = log.found["time"], log.said.get("time_unit")
    open_unit = column.unit is None and column.basis != "file" and not (dated or options.time_unit)
    if rate is not None and open_unit and is_count(ticks):
        lost = int(ticks[-1] - ticks[0]) + 1 - ticks.size
        log.note("io.time-from-counter", "time", source=column.source, rate=rate, lost=lost)
        why = f"samples as numbered by {column.source!r}, {rate:g} Hz as stated"
        return read_stamps((ticks if rows is None else ticks[rows]) / rate, "s", why, **where)
    if options.rate is not None:
        log.note("io.rate-not-used", "time", rate=options.rate, source=column.source)
    unit, why = column.unit, "in its name"
    if dated:
        unit, why = "ns", "dates or times of day"
    elif options.time_unit:
        unit, why = parse_unit(options.time_unit, "time"), options.why("time_unit")
        if unit in DATE_ORDERS:
            raise ConfigError(
                "io.unknown-unit", quantity="--time-unit", unit=unit, word=unit, known=TIME_UNITS
            )
    elif column.basis == "file":
        why = column.why
    elif unit is None and inferred is not None and inferred.settled:
        unit, why = str(inferred.value), str(inferred)
        if unit != "s":
            said = inferred.finding("io.time-unit-inferred", file=raw.name, quantity="time")
            log.findings.append(said)
    ticks = ticks if rows is None else ticks[rows]
    if unit == column.unit and not (dated or options.time_unit) and column.basis != "file":
        _check_named_step(log, ticks)
    stamps = read_stamps(ticks, unit, why, **where)
    log.findings += stamps.findings
    return stamps


def _check_named_step(log: LogInUse, ticks: NDArray[Any]) -> None:
    """Ask for the unit of time where the named one makes a rate that inertial sensors have not.

    DataError: and the steps by themselves are of another unit.
    """
    column = log.found["time"]
    if column.unit is None or ticks.size < 3:
        return
    # Unsigned stamps may go back.
    step = (float(ticks[-1]) - float(ticks[0])) / (ticks.size - 1)
    if step <= 0.0 or (rate := 1.0 / (step * factor_of(column.unit, TIME_UNITS))) <= FASTEST:
        return
    likely = infer_time_unit(ticks)
    if likely.settled and likely.value not in (None, column.unit):
        unit = str(likely.value)
        raise log.raw.fault(
            "io.time-unit-named-too-fast",
            "time",
            source=column.source,
            unit=column.unit,
            step=step,
            rate_hz=rate,
            likely=unit,
            likely_hz=1.0 / (step * factor_of(unit, TIME_UNITS)),
        )


def _clock_of_log(log: LogInUse, stamps: Stamps, dated: bool, sample: int) -> tuple[Clock, Reading]:
    """Return the clock of a log, and how its stamps were read, with the one of the first sample."""
    if "time" not in log.found:
        return Clock(RELATIVE), Reading("(none)", "time", "s", stamps.why, 0.0)
    raw, column = log.raw, log.found["time"]
    origin = raw.epoch + float(stamps.origin.stamp) * factor_of(stamps.origin.unit, TIME_UNITS)
    since = origin + float(stamps.seconds[0])
    name = raw.clock or clock_of_name(column.source, since, dated=dated)
    values = raw.columns[column.source]
    first = float(values[sample]) if values.dtype.kind in "iufb" else str(values[sample])
    why = f"{column.why}; unit {stamps.why}"
    return Clock(name, origin), Reading(column.source, "time", stamps.unit, why, first)


# No body that is carried, driven or flown turns this fast for a twentieth of a log.
LASTING_RATE = 20.0  # rad/s, 3 turns a second
# No gyro in a phone, a toy, a car or an aircraft reads this; a wrong unit does.
ABSURD_RATE = 100.0  # rad/s, 16 turns a second
# Common full scales of gyros, deg/s. A run of equal readings at a full scale is clipped.
FULL_SCALES = (125.0, 250.0, 400.0, 450.0, 500.0, 1000.0, 2000.0, 4000.0)
CUT_OFF_RUN = 3  # samples

# A gap from this length on hides motion.
LONG_GAP = 1.0  # s


def _report_gaps(log: LogInUse, time: Array, gyro: Array) -> None:
    """Report gaps in time, and the rotation that the longest may hide."""
    gaps = find_gaps(time)
    if not gaps:
        return
    worst = max(gaps, key=lambda g: g.length)
    speed = np.sqrt((gyro[worst.sample - 1 : worst.sample + 1] ** 2).sum(axis=1)).max()
    missed = float(np.degrees(speed * worst.length))
    log.warn(
        "io.long-gap" if worst.length >= LONG_GAP else "io.gaps",
        "time",
        severity="warning" if worst.length >= LONG_GAP else "note",
        count=len(gaps),
        length=worst.length,
        start=worst.start,
        end=worst.end,
        usual=worst.usual,
        missed_deg=missed,
    )


def _report_beyond_limits(
    log: LogInUse, body: Mapping[str, Array], kept: NDArray[np.int64]
) -> None:
    """Report rates that are implausible, or clipped at the sensor's full scale.

    DataError: a value is beyond the limits of any body; names row and column.
    """
    limits = {
        "gyro": ("io.rate-impossible", IMPOSSIBLE_RATE),
        "accel": ("io.force-impossible", IMPOSSIBLE_FORCE),
    }
    sizes: dict[str, Array] = {}
    for triad, (code, limit) in limits.items():
        if triad not in body:
            continue
        # Largest magnitude of each channel; NaN where one is NaN.
        sizes[triad] = np.empty(3)
        for k, channel in enumerate(body[triad].T):
            sizes[triad][k] = np.maximum(channel.max(), -channel.min())
            let_go(body[triad])
        if not sizes[triad].max() <= limit:
            at, k = (int(i) for i in np.argwhere(~(np.abs(body[triad]) <= limit))[0])
            raise DataError(
                code,
                file=log.raw.name,
                row=log.raw.row(int(kept[at])),
                quantity=f"{triad}_{AXES[k]}",
                value=body[triad][at, k],
            )
    gyro, largest = body["gyro"], sizes["gyro"]
    k = int(largest.argmax())
    lasting = 0.0
    if LASTING_RATE < largest[k] <= ABSURD_RATE:
        lasting = float(np.quantile(np.sqrt((gyro * gyro).sum(axis=1)), 0.95))
    if LASTING_RATE < lasting <= largest[k]:
        turns = lasting / (2 * np.pi)
        log.warn("io.rate-absurd-for-long", "gyro", lasting=lasting, lasting_2=turns)
    if largest[k] > ABSURD_RATE:
        at = int(np.abs(gyro[:, k]).argmax())
        log.warn(
            "io.rate-absurd",
            f"gyro_{AXES[k]}",
            row=log.raw.row(int(kept[at])),
            gyro=gyro[at, k],
            largest=largest[k] / (2 * np.pi),
        )
    for k in range(3):
        reading = float(np.degrees(largest[k]))
        # The largest 16-bit reading is one step below the full scale.
        if not any(s * (1 - 1e-3) <= reading <= s * 1.0001 for s in FULL_SCALES):
            continue
        full = np.abs(gyro[:, k]) == largest[k]
        run = np.convolve(full, np.ones(CUT_OFF_RUN), mode="valid") == CUT_OFF_RUN
        if run.any():
            log.warn(
                "io.rate-at-full-scale",
                f"gyro_{AXES[k]}",
                row=log.raw.row(int(kept[int(run.argmax())])),
                full=int(full.sum()),
                reading=reading,
            )


# Half of a log of a body that is carried, driven or flown has more force than this: only a fall
# has less.
WEIGHTLESS = 0.3 * STANDARD_GRAVITY  # m/s²
# And more than this for so long only on a centrifuge.
HEAVY = 4.0 * STANDARD_GRAVITY  # m/s²
#: Rows, spread evenly over a log, of which this is judged.
SOME = 100_000


#: Fewest samples of a channel that never changes; a few may be alike by chance.
LASTING = 100


def _report_constant(log: LogInUse, body: Mapping[str, Array], axis: Sequence[int]) -> None:
    """Warn of a channel that never changes beside others that have the noise of a sensor.

    `axis`: of the sensor, for each of the body.
    """
    for triad in ("gyro", "accel"):
        if triad not in body:
            continue
        channels = list(body[triad].T)
        constant = constant_beside_noise(channels, LASTING, SOME)
        for k in np.flatnonzero(constant).tolist():
            log.warn(
                "io.channel-constant",
                f"{triad}_{AXES[k]}",
                name=log.found[f"{triad}_{AXES[axis[k]]}"].source,
                value=float(channels[k][0]) + 0.0,
                count=len(channels[k]),
            )


def _report_weightless(log: LogInUse, accel: Array | None) -> None:
    """Report a specific force too small or too large for that of gravity, as of a wrong unit."""
    if accel is None or any(f.code == "io.no-gravity" for f in log.findings):
        return
    some = np.empty((len(range(0, len(accel), 1 + len(accel) // SOME)), 3))
    for k, channel in enumerate(accel.T):
        some[:, k] = channel[:: 1 + len(accel) // SOME]
        let_go(accel)
    with np.errstate(over="ignore"):  # of a corrupt log, which is refused where it is
        usual = float(np.sqrt(np.median((some * some).sum(axis=1))))
    if usual < WEIGHTLESS:
        reason = Finding("io.evidence-force-too-small", severity="note", usual=usual)
        log.warn("io.no-gravity", "accel", reason=reason)
    elif usual > HEAVY:
        log.warn("io.force-absurd-for-long", "accel", usual=usual, ratio=usual / STANDARD_GRAVITY)


def _finite_rows(log: LogInUse, ticks: NDArray[Any] | None) -> NDArray[np.bool_]:
    """Select the rows in which every used value is a number; (n,).

    `ticks` ((n,)): stamps as in the file. The number of dropped rows is reported. DataError: a row
    cannot be used and may not be dropped, or no row is left.
    """
    raw, blocks = log.raw, dict(log.values)
    if ticks is not None:
        blocks = {"time": ticks[:, None].astype(np.float64, copy=False)} | blocks
    keep = np.ones(len(blocks["gyro"]), dtype=bool)
    for name, block in blocks.items():
        if name in raw.sparse or all_finite(block):
            continue
        bad = ~np.isfinite(block)
        row, column = (int(i) for i in np.argwhere(bad)[0])
        quantity = name if name == "time" else f"{name}_{AXES[column]}"
        count = int(bad.any(axis=1).sum())
        if not log.options.repair:
            raise raw.fault(
                "io.not-finite-in-rows",
                quantity,
                sample=row,
                block=block[row, column],
                source=log.found[quantity].source,
                count=count,
            )
        log.note("io.rows-without-number-left-out", quantity, row=raw.row(row), count=count)
        keep &= ~bad.any(axis=1)
    if not keep.any():
        raise raw.fault("io.no-usable-row")
    return keep


# Attitude truth, from the log itself or from a file of its own.

Turn = tuple[list[int], list[float]]

AS_THEY_ARE: Turn = ([0, 1, 2], [1.0, 1.0, 1.0])

# Optical systems write a zero quaternion while their markers are lost.
LOST = 1e-6


def _truth_of_log(
    log: LogInUse, time: Array, kept: NDArray[np.int64], axes: Turn, readings: list[Reading]
) -> tuple[pd.DataFrame | None, NDArray[np.bool_] | None]:
    """Return the truth of a log, in the body axes that the log is read in.

    `time` ((n,), s): stamps of the rows used. `kept` ((n,)): those rows. `axes`: sensor axis of
    each body axis, and its sign. `readings`: its source columns are appended. Returns `scored` (or
    None): rows of `truth` that count for errors. ConfigError: the axes are a mirror image, for
    which no attitude exists.
    """
    raw, found = log.raw, log.found
    if raw.truth is not None:
        q_ns, scored = raw.truth.q_ns[kept], raw.truth.scored[kept]
    else:
        # The frames of an attitude are unknown unless the file states those of our own logs.
        q, names = _quaternions(raw, found) if raw.axes == "x,y,z" else (None, [])
        if q is None:
            # An attitude of unknown frames, as from a phone, is not used as truth.
            if raw.axes != "x,y,z" and any(
                set(names) <= set(found) for names in (QUATERNIONS, EULERS)
            ):
                log.note("io.attitude-not-used", "attitude")
            return None, None
        # Avoid copies of a long log.
        q = q if kept.size == len(q) else q[kept]
        if not _known(q).any():
            return None, None
        for name in names:
            column = found[name]
            values = numbers(raw, column.source, name)
            first = float(values[kept[np.argmax(np.isfinite(values[kept]))]])
            readings.append(Reading(column.source, name, column.unit or "", column.why, first))
        q_ns, scored = q, np.ones(kept.size, dtype=bool)
        del q
    known = _known(q_ns)
    if not known.any():
        return None, None
    q_nb = q_ns if known.all() else q_ns[known]
    if axes != AS_THEY_ARE:
        q_nb = rotation.compose(q_nb, _sensor_from_body(raw, axes))
    return attitude_table(time[known], q_nb, raw.name), scored[known]


def truth_of_file(raw: RawLog, options: ReadOptions, origin: Origin) -> pd.DataFrame | None:
    """Return the truth of a separate file, on the clock of a log.

    `options`: of these, `repair` is used, and the axes of the log where the attitude is that of its
    sensor. `origin`: origin of the log's time. Returns an Attitude table of the rows with known
    attitude; None if there is none. DataError: time cannot be used.
    """
    found = find_columns(raw, ReadOptions())
    if raw.truth is not None:
        q: Array | None = _of_body(raw, raw.truth.q_ns, options.axes)
    else:
        q, _ = _quaternions(raw, found)
    if q is None or "time" not in found:
        return None
    ticks, dated = ticks_of(raw, found["time"].source, found["time"].unit)
    rows = np.flatnonzero(_known(q) & np.isfinite(ticks.astype(np.float64)))
    if not rows.size:
        return None
    unit = "ns" if dated else found["time"].unit
    try:
        stamps = read_stamps(
            ticks[rows],
            parse_unit(unit, "time") if unit else None,
            "",
            file=raw.name,
            row=lambda k: raw.row(int(rows[k])),
            repair=options.repair,
            origin=origin,
            only_seconds=True,
        )
    except DataError as error:
        if unit is not None:
            raise
        # The options that would state it are those of the log.
        raise DataError(
            "io.truth-time-unusable",
            file=raw.name,
            row=error.finding.row,
            quantity="time",
            reason=error.finding,
        ) from None
    return attitude_table(stamps.seconds[stamps.keep], q[rows][stamps.keep], raw.name)


def _of_body(raw: RawLog, q_ns: Array, text: str | None) -> Array:
    """Convert the attitude of the sensor to that of the body axes of a log."""
    axes = parse_axes(text) if text else AS_THEY_ARE
    if axes == AS_THEY_ARE:
        return q_ns
    known = _known(q_ns)
    q = np.full_like(q_ns, np.nan)
    q[known] = rotation.compose(q_ns[known], _sensor_from_body(raw, axes))
    return q


def _known(q: Array) -> NDArray[np.bool_]:
    large = (q.max(axis=1) > LOST) | (q.min(axis=1) < -LOST)
    known: NDArray[np.bool_] = np.isfinite(q).all(axis=1) & large
    return known


def _quaternions(raw: RawLog, found: dict[str, Column]) -> tuple[Array | None, list[str]]:
    """Return the attitude of each row, NaN where unknown, and its source columns."""
    if all(n in found for n in QUATERNIONS):
        parts = [numbers(raw, found[n].source, n) for n in QUATERNIONS]
        return np.column_stack(parts).astype(np.float64, copy=False), list(QUATERNIONS)
    if not all(n in found for n in EULERS):
        return None, []
    angles = np.column_stack([numbers(raw, found[n].source, n) for n in EULERS]).astype(np.float64)
    units = {found[n].unit for n in EULERS}
    if units == {"rad"}:
        angles = np.degrees(angles)
    elif units != {"deg"}:
        raise raw.fault("io.unit-angles-not-stated", ", ".join(EULERS))
    finite = np.isfinite(angles).all(axis=1)
    q = np.full((len(angles), 4), np.nan)
    q[finite] = rotation.quaternion_from_euler(angles[finite])
    return q, list(EULERS)


#: Parts of a log whose mean forces are compared; least tilt, as its sine, by the attitude beside
#: them; most spread of a force as it stands, relative to that of the force turned by the attitude.
_PARTS, _TILTED, _STEADIER = 100, 0.1, 0.5
#: Most samples of a log that are turned for it.
MOST_TURNED = 20_000


def _in_world_axes(log: LogInUse) -> dict[str, Any] | None:
    """Return the spreads of a force that is steady as it stands, and not by the attitude beside it.

    The force of a sensor turns with it, and the attitude, whichever way it is meant, turns it back:
    gravity is then steady. A table of motions may have it turned already. A body that banks in its
    turns looks the same: columns that the user names are the sensor's.
    """
    raw, named = log.raw, log.found["accel_x"].basis == "option"
    if raw.stated or raw.truth is not None or raw.axes is not None or named:
        return None
    with suppress(DataError):
        q, names = _quaternions(raw, log.found)
        if q is None:
            return None
        rows = _known(q) & np.isfinite(log.values["accel"]).all(axis=1)
        some = slice(None, None, 1 + int(rows.sum()) // MOST_TURNED)
        force, q = log.values["accel"][rows][some].astype(np.float64), q[rows][some]
        if len(force) < _PARTS:
            return None
        # About one direction, as that of gravity, even a force across it is steady as it stands.
        mean = rotation.dcm_from_quaternion(q).mean(axis=0)
        tilt = np.sqrt(max(0.0, 1.0 - float(np.linalg.norm(mean, 2)) ** 2))
        back = q * [1.0, -1.0, -1.0, -1.0]
        plain, *turned = map(
            _spread, (force, rotation.rotate(q, force), rotation.rotate(back, force))
        )
        if tilt > _TILTED and plain < _STEADIER * min(turned):
            columns = [log.found[name].source for name in names]
            return {"plain": plain, "turned": min(turned), "columns": columns}
    return None


def _spread(force: Array) -> float:
    """Return the root mean square change of a force between parts of a log, by its size."""
    parts = force[: len(force) // _PARTS * _PARTS].reshape(_PARTS, -1, 3).mean(axis=1)
    size = float(np.linalg.norm(parts, axis=1).mean())
    change = float(np.sqrt(np.square(parts - parts.mean(axis=0)).sum(axis=1).mean()))
    return change / size if size > 0.0 else 0.0


def _sensor_from_body(raw: RawLog, axes: Turn) -> Array:
    """Return the quaternion ``q_sb`` from body axes to the axes of the file's truth."""
    if mirrored(*axes):
        raise ConfigError("io.truth-axes-mirrored", file=raw.name, quantity="--axes")
    return rotation.quaternion_from_dcm(axes_matrix(*axes).T)
