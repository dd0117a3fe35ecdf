"""From the columns of a file to a recording in body axes and SI."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.constants import ACCEL_UNITS, GYRO_UNITS
from strapdown.exceptions import ConfigError, DataError, Finding, nearest
from strapdown.formats.columns import (
    EULERS,
    QUATERNIONS,
    TRIADS,
    UNIT_OF,
    parse_axes,
    parse_unit,
    read_name,
)
from strapdown.formats.recording import RawLog, ReadOptions, Recording
from strapdown.formats.stamps import Stamps, read_stamps
from strapdown.results import Reading
from strapdown.tables import SAMPLINGS, attitude_table, find_gaps, imu_table

Array = NDArray[np.float64]
AXES = "xyz"
UNITS = {"gyro": GYRO_UNITS, "accel": ACCEL_UNITS}

# No gyro in a phone, a toy, a car or an aircraft reads this; a unit that is wrong does.
ABSURD_RATE = 100.0  # rad/s, 16 turns a second
# Full scales that gyros are made with, deg/s. A run of equal readings at one of them was cut off.
FULL_SCALES = (125.0, 250.0, 400.0, 450.0, 500.0, 1000.0, 2000.0, 4000.0)
CUT_OFF_RUN = 3  # samples

# A gap this long holds a motion that nothing tells of.
LONG_GAP = 1.0  # s


@dataclass(frozen=True)
class Column:
    """A column of the file that a quantity was found in."""

    source: str
    unit: str | None
    why: str


def assemble(raw: RawLog, options: ReadOptions) -> Recording:
    """Turn raw columns into a recording.

    Parameters
    ----------
    raw : RawLog
    options : ReadOptions
        What the user says goes before what the file says, and that before what names suggest.

    Returns
    -------
    Recording

    Raises
    ------
    DataError
        A value, a stamp or a unit cannot be used; the message names file, row and remedy.
    ConfigError
        An option names what is not there.
    """
    found = _find_columns(raw, options)
    _require_gyro(raw, found)
    findings = list(raw.findings)
    axis, sign, axes_why = _axes(raw, options, findings)

    triads = ["gyro"] + (["accel"] if all(f"accel_{a}" in found for a in AXES) else [])
    if "accel" not in triads and any(f"accel_{a}" in found for a in AXES):
        findings.append(
            Finding("not all three axes are there; left out", file=raw.name, quantity="accel")
        )
    values = {t: _triad(raw, found, t) for t in triads}
    stamps, time_reading, keep = _time(raw, found, options, values, findings)

    readings = [time_reading]
    columns: dict[str, Array] = {}
    for triad in triads:
        unit, why = _unit(raw, found, triad, options, values[triad])
        names = [found[f"{triad}_{AXES[i]}"].source for i in axis]
        columns[triad] = (values[triad][:, axis] * np.array(sign) * UNITS[triad][unit])[keep]
        readings += [
            Reading(
                name,
                ("-" if sign[j] < 0 else "") + f"{triad}_{AXES[j]}",
                unit,
                f"{found[f'{triad}_{AXES[axis[j]]}'].why}; unit {why}; axes {axes_why}",
                float(values[triad][0, axis[j]]),
            )
            for j, name in enumerate(names)
        ]
    time = stamps.seconds[keep]
    if time.size < 2:
        raise DataError(
            f"{time.size} usable sample: attitude is the integral of a rate, and needs at least "
            "two",
            file=raw.name,
            quantity="time",
            remedy="record for longer, or check that the right file was given",
        )
    sampling = _sampling(raw, options, findings)
    _report_gaps(raw, time, columns["gyro"], findings)
    _report_absurd(raw, columns["gyro"], findings)
    imu = imu_table(time, columns["gyro"], columns.get("accel"), sampling=sampling, source=raw.name)
    truth, scored = _truth(raw, found, time, keep, (axis, sign), readings, findings)
    return Recording(raw.name, raw.files, imu, truth, scored, tuple(readings), tuple(findings))


# --- which column is which --------------------------------------------------------------


def _find_columns(raw: RawLog, options: ReadOptions) -> dict[str, Column]:
    found: dict[str, Column] = {}
    for source, (quantity, unit) in raw.stated.items():
        found[quantity] = Column(source, unit, "stated by the file")
    if not raw.stated:
        found |= _by_name(raw, options)
    for quantity, source in options.columns.items():
        for q, name in _asked(raw, quantity, source):
            stated = found[q].unit if q in found and found[q].source == name else None
            found[q] = Column(name, _unit_of(raw, name) or stated, "stated by --columns")
    return found


def _by_name(raw: RawLog, options: ReadOptions) -> dict[str, Column]:
    candidates: dict[str, list[str]] = {}
    for name in raw.columns:
        said = read_name(name)
        if said.quantity in TRIADS:
            continue
        if said.quantity:
            candidates.setdefault(said.quantity, []).append(name)
    asked = {q for key in options.columns for q in _members(key)}
    found = {}
    for quantity, names in candidates.items():
        if quantity in asked:
            continue
        if len(names) > 1:
            raise ConfigError(
                f"{len(names)} columns could be it: {', '.join(names)}",
                file=raw.name,
                quantity=quantity,
                remedy=f"choose one with --columns {quantity}={names[0]}",
            )
        found[quantity] = Column(names[0], _unit_of(raw, names[0]), "by its name")
    return found


def _unit_of(raw: RawLog, column: str) -> str | None:
    if column in raw.units:
        return UNIT_OF.get(raw.units[column].strip().lower())
    return read_name(column).unit


def _members(quantity: str) -> list[str]:
    return [f"{quantity}_{a}" for a in AXES] if quantity in TRIADS else [quantity]


def _asked(raw: RawLog, quantity: str, source: str) -> list[tuple[str, str]]:
    """Resolve one ``quantity=source`` of the user to columns that exist."""
    names = list(raw.columns)
    if quantity in TRIADS:
        if members := _three_of(raw, quantity, source):
            return list(zip(_members(quantity), members, strict=True))
    elif source in raw.columns:
        return [(quantity, source)]
    elif source.isdigit() and 1 <= int(source) <= len(names):
        return [(quantity, names[int(source) - 1])]
    raise ConfigError(
        f"there is no column '{source}'",
        file=raw.name,
        quantity=f"--columns {quantity}",
        remedy=nearest(source, names),
    )


def _three_of(raw: RawLog, quantity: str, source: str) -> list[str]:
    """Columns of an array of three, of three in a wider array, or of three names in x, y, z."""
    base, _, index = source.partition("[")
    width = sum(name.startswith(f"{base}[") for name in raw.columns)
    if width > 3 and not index:
        raise ConfigError(
            f"'{source}' has {width} columns",
            file=raw.name,
            quantity=f"--columns {quantity}",
            remedy=f"say with which of them it begins, as in {quantity}={source}[{width - 3}]",
        )
    if width >= 3 and (not index or index.rstrip("]").isdigit()):
        first = int(index.rstrip("]")) if index else 0
        members = [f"{base}[{first + k}]" for k in range(3)]
        return members if all(m in raw.columns for m in members) else []
    by_axis = [
        n for a in AXES for n in raw.columns if n.startswith(source) and n.lower().endswith(a)
    ]
    return by_axis if len(by_axis) == 3 else []


def _require_gyro(raw: RawLog, found: dict[str, Column]) -> None:
    missing = [f"gyro_{a}" for a in AXES if f"gyro_{a}" not in found]
    if missing:
        raise DataError(
            f"no column was recognised as {', '.join(missing)}; it has: "
            f"{', '.join(raw.columns) or 'none'}",
            file=raw.name,
            remedy="name them, as in --columns time=t,gyro_x=wx,gyro_y=wy,gyro_z=wz (a number "
            "counts columns from 1)",
        )


# --- numbers ----------------------------------------------------------------------------


def _numbers(raw: RawLog, column: Column, quantity: str) -> NDArray[Any]:
    values = raw.columns[column.source]
    if values.dtype.kind in "iufb":
        return values
    texts = pd.Series(values)
    numbers = pd.to_numeric(texts, errors="coerce").to_numpy(dtype=np.float64)
    bad = np.flatnonzero(np.isnan(numbers) & texts.notna().to_numpy())
    if bad.size:
        raise DataError(
            f"'{values[bad[0]]}' is not a number (column '{column.source}')",
            file=raw.name,
            row=raw.first_row + int(bad[0]),
            quantity=quantity,
            remedy="correct or delete that row, or choose another column with --columns",
        )
    return numbers


def _ticks(raw: RawLog, column: Column) -> tuple[NDArray[Any], bool]:
    """Stamps as numbers; dates and times of day as nanoseconds since 1970, and True."""
    values = raw.columns[column.source]
    if values.dtype.kind == "O" and re.match(r"\d{4}-\d\d-\d\d[T ]\d\d:", str(values[0])):
        dates = pd.to_datetime(pd.Series(values), format="ISO8601", utc=True, errors="coerce")
        bad = np.flatnonzero(dates.isna().to_numpy())
        if bad.size:
            raise DataError(
                f"'{values[bad[0]]}' is not a date and time like those before it (column "
                f"'{column.source}')",
                file=raw.name,
                row=raw.first_row + int(bad[0]),
                quantity="time",
                remedy="correct or delete that row",
            )
        stamps = dates.dt.tz_localize(None).to_numpy().astype("datetime64[ns]")
        return stamps.astype(np.int64), True
    return _numbers(raw, column, "time"), False


def _triad(raw: RawLog, found: dict[str, Column], triad: str) -> Array:
    parts = [_numbers(raw, found[f"{triad}_{a}"], f"{triad}_{a}").astype(np.float64) for a in AXES]
    return np.column_stack(parts)


def _time(
    raw: RawLog,
    found: dict[str, Column],
    options: ReadOptions,
    values: dict[str, Array],
    findings: list[Finding],
) -> tuple[Stamps, Reading, NDArray[np.bool_]]:
    """Return stamps in seconds, what they were read from, and the rows that can be used."""
    samples = len(values["gyro"])
    if "time" in found:
        if options.rate:
            findings.append(
                Finding(
                    f"--rate {options.rate:g} is not used: the log has stamps (column "
                    f"'{found['time'].source}')",
                    file=raw.name,
                    quantity="time",
                )
            )
        ticks, dated = _ticks(raw, found["time"])
    elif rate := options.rate or raw.rate:
        ticks = np.arange(samples) / rate
    else:
        raise DataError(
            "no column was recognised as time",
            file=raw.name,
            quantity="time",
            remedy="name it with --columns time=NAME, or state the rate with --rate HZ",
        )
    keep = _finite_rows(
        raw, found, {"time": ticks[:, None].astype(np.float64)} | values, options, findings
    )
    usable = np.flatnonzero(keep)
    if not usable.size:
        raise DataError("no row can be used", file=raw.name, remedy="look at the file")
    if "time" not in found:
        stamps = Stamps(ticks, "s", "", np.ones(samples, dtype=bool), [])
        why = f"no time column: {options.rate or raw.rate:g} Hz as stated"
        return stamps, Reading("(none)", "time", "s", why, 0.0), keep
    unit, why = found["time"].unit, "in its name"
    if dated:
        unit, why = "ns", "dates and times of ISO 8601"
    elif options.time_unit:
        unit, why = parse_unit(options.time_unit, "time"), "stated by --time-unit"
    elif found["time"].why == "stated by the file":
        why = "stated by the file"
    contiguous = ticks[keep]
    rows = raw.first_row + int(usable[0])
    stamps = read_stamps(
        contiguous, unit, why, file=raw.name, first_row=rows, repair=options.repair
    )
    findings += stamps.findings
    seconds = np.full(samples, np.nan)
    seconds[keep] = stamps.seconds
    keep = keep.copy()
    keep[usable] = stamps.keep
    reading = Reading(
        found["time"].source,
        "time",
        stamps.unit,
        f"{found['time'].why}; unit {stamps.why}",
        str(raw.columns[found["time"].source][0]) if dated else float(ticks[0]),
    )
    return Stamps(seconds, stamps.unit, stamps.why, keep, []), reading, keep


def _finite_rows(
    raw: RawLog,
    found: dict[str, Column],
    values: dict[str, Array],
    options: ReadOptions,
    findings: list[Finding],
) -> NDArray[np.bool_]:
    keep = np.ones(len(values["gyro"]), dtype=bool)
    for name, block in values.items():
        bad = ~np.isfinite(block)
        if not bad.any():
            continue
        row, column = (int(i) for i in np.argwhere(bad)[0])
        quantity = name if name == "time" else f"{name}_{AXES[column]}"
        count = int(bad.any(axis=1).sum())
        if not options.repair:
            raise DataError(
                f"{block[row, column]} is not a finite number (column '{found[quantity].source}'; "
                f"{count} such row{'s' if count > 1 else ''} in all)",
                file=raw.name,
                row=raw.first_row + row,
                quantity=quantity,
                remedy="--repair leaves such rows out and integrates across them",
            )
        findings.append(
            Finding(
                f"{count} row{'s' if count > 1 else ''} left out that held no finite number; "
                "integrated across",
                file=raw.name,
                row=raw.first_row + row,
                quantity=quantity,
            )
        )
        keep &= ~bad.any(axis=1)
    return keep


# --- units, axes, sampling --------------------------------------------------------------


def _unit(
    raw: RawLog, found: dict[str, Column], triad: str, options: ReadOptions, values: Array
) -> tuple[str, str]:
    asked = options.gyro_unit if triad == "gyro" else options.accel_unit
    if asked:
        return parse_unit(asked, triad), f"stated by --{triad}-unit"
    columns = [found[f"{triad}_{a}"] for a in AXES]
    units = {c.unit for c in columns}
    if len(units) == 1 and (unit := columns[0].unit) in UNITS[triad]:
        stated = columns[0].why == "stated by the file"
        return unit, "stated by the file" if stated else "in its name"
    largest = float(np.nanmax(np.abs(np.where(np.isfinite(values), values, np.nan)), initial=0.0))
    choices = ("rad/s", "deg/s") if triad == "gyro" else ("m/s2", "g")
    told = " or ".join(
        f"{u} (the largest value, {largest:.4g}, is then "
        f"{_in_plain_words(triad, largest * UNITS[triad][u])})"
        for u in choices
    )
    raise DataError(
        f"the unit is not stated{' for all three axes alike' if len(units) > 1 else ''}",
        file=raw.name,
        quantity=triad,
        remedy=f"state it with --{triad}-unit: {told}",
    )


def _in_plain_words(triad: str, value: float) -> str:
    if triad == "gyro":
        return f"{np.degrees(value) / 360.0:.3g} turns a second"
    return f"{value:.3g} m/s²"


def _axes(
    raw: RawLog, options: ReadOptions, findings: list[Finding]
) -> tuple[list[int], list[float], str]:
    text = options.axes or raw.axes
    if text is None:
        findings.append(
            Finding(
                "the sensor's x, y, z are taken as the body's forward, right, down: nothing says "
                "otherwise",
                file=raw.name,
                quantity="axes",
                remedy="state them with --axes, as in --axes x,-y,-z for forward, left, up",
            )
        )
        return [0, 1, 2], [1.0, 1.0, 1.0], "as they are"
    axis, sign = parse_axes(text)
    mirrored = np.linalg.det(np.eye(3)[axis] * np.array(sign)[:, None]) < 0
    if options.axes and mirrored:
        findings.append(
            Finding(
                f"--axes {text} is a mirror image, which turns no right-handed sensor into "
                "another; it is right only for a sensor whose own axes are left-handed",
                file=raw.name,
                quantity="axes",
            )
        )
    return axis, sign, f"{text} {'by --axes' if options.axes else 'of this kind of recording'}"


def _sampling(raw: RawLog, options: ReadOptions, findings: list[Finding]) -> str:
    asked = options.sampling or raw.sampling
    if asked is None:
        findings.append(
            Finding(
                "each row is taken as the rate at its stamp: nothing says that it is a mean",
                file=raw.name,
                quantity="sampling",
                remedy="say --sampling mean for a sensor that averages over its interval",
            )
        )
        return "instantaneous"
    if asked not in SAMPLINGS:
        raise ConfigError(
            f"'{asked}' is no kind of sampling",
            quantity="--sampling",
            remedy=nearest(asked, SAMPLINGS),
        )
    return asked


def _report_gaps(raw: RawLog, time: Array, gyro: Array, findings: list[Finding]) -> None:
    gaps = find_gaps(time)
    if not gaps:
        return
    worst = max(gaps, key=lambda g: g.length)
    speed = np.sqrt((gyro[worst.sample - 1 : worst.sample + 1] ** 2).sum(axis=1)).max()
    missed = float(np.degrees(speed * worst.length))
    what = (
        f"{len(gaps)} gap{'s' if len(gaps) > 1 else ''} in time; the longest is "
        f"{worst.length:.3g} s, from {worst.start:.6g} to {worst.end:.6g} s, where 95 % of the "
        f"steps are at most {worst.usual:.3g} s. At the rate on its edges {missed:.3g}° were "
        "turned in it, and how is a guess"
    )
    remedy = None
    if worst.length >= LONG_GAP:
        remedy = "split the log there, or put a reference point on each side of it"
    findings.append(Finding(what, file=raw.name, quantity="time", remedy=remedy))


def _report_absurd(raw: RawLog, gyro: Array, findings: list[Finding]) -> None:
    """Say where a rate is more than can be, or is cut off at the sensor's full scale."""
    largest = np.abs(gyro).max(axis=0)
    k = int(largest.argmax())
    if largest[k] > ABSURD_RATE:
        row = int(np.abs(gyro[:, k]).argmax())
        findings.append(
            Finding(
                f"{gyro[row, k]:.4g} rad/s is {largest[k] / (2 * np.pi):.3g} turns a second",
                file=raw.name,
                row=raw.first_row + row,
                quantity=f"gyro_{AXES[k]}",
                remedy="if the sensor was not spun like that, the unit is another: --gyro-unit",
            )
        )
    for k in range(3):
        reading = float(np.degrees(largest[k]))
        # A 16-bit reading ends one step short of the full scale.
        scale = next((s for s in FULL_SCALES if s * (1 - 1e-3) <= reading <= s * 1.0001), None)
        if scale is None:
            continue
        full = np.abs(gyro[:, k]) == largest[k]
        run = np.convolve(full, np.ones(CUT_OFF_RUN), mode="valid") == CUT_OFF_RUN
        if run.any():
            findings.append(
                Finding(
                    f"{int(full.sum())} samples stand at {reading:.6g} deg/s, a full scale: the "
                    "rate was cut off there, and what it was beyond is not known",
                    file=raw.name,
                    row=raw.first_row + int(run.argmax()),
                    quantity=f"gyro_{AXES[k]}",
                    remedy="use a larger range of the gyro; do not trust the attitude from there",
                )
            )


# --- truth that came with the log -------------------------------------------------------


def assemble_attitude(raw: RawLog, options: ReadOptions) -> pd.DataFrame | None:
    """Read an attitude truth out of raw columns.

    Parameters
    ----------
    raw : RawLog
    options : ReadOptions
        Its columns, its unit of time and whether to repair are used.

    Returns
    -------
    DataFrame or None
        An Attitude table of the rows in which it is known; None where there is none.

    Raises
    ------
    DataError
        Time cannot be used.
    """
    found = _find_columns(raw, options)
    q, _ = _quaternions(raw, found)
    if q is None or "time" not in found:
        return None
    ticks = _numbers(raw, found["time"], "time")
    known = np.isfinite(q).all(axis=1) & np.isfinite(ticks.astype(np.float64))
    if not known.any():
        return None
    unit = options.time_unit or found["time"].unit
    stamps = read_stamps(
        ticks[known],
        parse_unit(unit, "time") if unit else None,
        "",
        file=raw.name,
        first_row=raw.first_row + int(np.argmax(known)),
        repair=options.repair,
    )
    return attitude_table(stamps.seconds[stamps.keep], q[known][stamps.keep], raw.name)


def _quaternions(raw: RawLog, found: dict[str, Column]) -> tuple[Array | None, list[str]]:
    """Attitude of each row, NaN where unknown, and the columns it came from."""
    if all(n in found for n in QUATERNIONS):
        parts = [_numbers(raw, found[n], n).astype(np.float64) for n in QUATERNIONS]
        return np.column_stack(parts), list(QUATERNIONS)
    if not all(n in found for n in EULERS):
        return None, []
    angles = np.column_stack([_numbers(raw, found[n], n) for n in EULERS]).astype(np.float64)
    units = {found[n].unit for n in EULERS}
    if units == {"rad"}:
        angles = np.degrees(angles)
    elif units != {"deg"}:
        raise DataError(
            "the unit of the angles is not stated",
            file=raw.name,
            quantity=", ".join(EULERS),
            remedy="name them with it, as in roll_deg, pitch_deg, heading_deg",
        )
    finite = np.isfinite(angles).all(axis=1)
    q = np.full((len(angles), 4), np.nan)
    q[finite] = rotation.quaternion_from_euler(angles[finite])
    return q, list(EULERS)


def _truth(
    raw: RawLog,
    found: dict[str, Column],
    time: Array,
    keep: NDArray[np.bool_],
    axes: tuple[list[int], list[float]],
    readings: list[Reading],
    findings: list[Finding],
) -> tuple[pd.DataFrame | None, NDArray[np.bool_] | None]:
    if raw.truth is not None:
        q_nb = _turned(raw.truth.q_ns[keep], raw, axes)
        scored = raw.truth.scored[keep]
    else:
        q, names = _quaternions(raw, found) if raw.axes else (None, [])
        if q is None:
            _mention_attitude(raw, found, findings)
            return None, None
        for name in names:
            column = found[name]
            first = float(_numbers(raw, column, name)[0])
            readings.append(Reading(column.source, name, column.unit or "", column.why, first))
        q_nb, scored = q[keep], np.ones(int(keep.sum()), dtype=bool)
    known = np.isfinite(q_nb).all(axis=1)
    if not known.any():
        return None, None
    return attitude_table(time[known], q_nb[known], raw.name), scored[known]


def _mention_attitude(raw: RawLog, found: dict[str, Column], findings: list[Finding]) -> None:
    """An attitude of unknown frames, as a phone computes one, is no truth unless it is said."""
    if not raw.axes and any(set(names) <= set(found) for names in (QUATERNIONS, EULERS)):
        findings.append(
            Finding(
                "it also holds an attitude, which is not used: nothing says whose it is and in "
                "which frames",
                file=raw.name,
                quantity="attitude",
                remedy="if it is body to north-east-down and better than the gyro, give the file "
                "as --reference too",
            )
        )


def _turned(q_ns: Array, raw: RawLog, axes: tuple[list[int], list[float]]) -> Array:
    """Turn truth of the sensor's axes into truth of the body's."""
    axis, sign = axes
    C_bs = np.eye(3)[axis] * np.array(sign)[:, None]
    if np.linalg.det(C_bs) < 0:
        raise ConfigError(
            "the axes stated are a mirror image of the sensor's, and its truth cannot be turned "
            "into it",
            file=raw.name,
            quantity="--axes",
            remedy="state a right-handed set, as in x,-y,-z",
        )
    known = np.isfinite(q_ns).all(axis=1)
    out = np.full(q_ns.shape, np.nan)
    out[known] = rotation.compose(q_ns[known], rotation.quaternion_from_dcm(C_bs.T))
    return out
