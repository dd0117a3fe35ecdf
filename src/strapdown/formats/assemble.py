"""From the columns of a file to a recording in body axes and SI."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown.constants import ACCEL_UNITS, GYRO_UNITS
from strapdown.exceptions import ConfigError, DataError, Finding, nearest
from strapdown.formats.assemble_truth import truth_of_log
from strapdown.formats.columns import parse_axes, parse_unit
from strapdown.formats.find_columns import AXES, Column, find_columns, require_gyro
from strapdown.formats.numbers import numbers, ticks_of
from strapdown.formats.plausibility import report_absurd, report_gaps
from strapdown.formats.recording import Origin, RawLog, ReadOptions, Recording
from strapdown.formats.stamps import Stamps, read_stamps
from strapdown.results import Reading
from strapdown.tables import SAMPLINGS, imu_table

Array = NDArray[np.float64]
UNITS = {"gyro": GYRO_UNITS, "accel": ACCEL_UNITS}


@dataclass(frozen=True)
class Axes:
    """Which sensor axis each body axis is, with its sign, and why."""

    axis: list[int]
    sign: list[float]
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
    found = find_columns(raw, options)
    require_gyro(raw, found)
    findings = list(raw.findings)
    axes = _axes(raw, options, findings)
    values, units = _triads(raw, found, options, findings)
    ticks, dated = ticks_of(raw, found["time"]) if "time" in found else (None, False)
    finite = _finite_rows(raw, found, ticks, values, options, findings)
    stamps = _stamps(raw, found, ticks, dated, options, finite, findings)
    kept = np.flatnonzero(finite)[stamps.keep]
    time = stamps.seconds[stamps.keep]
    if time.size < 2:
        raise DataError(
            f"{time.size} usable sample: attitude is the integral of a rate, and needs at least "
            "two",
            file=raw.name,
            quantity="time",
            remedy="record for longer, or check that the right file was given",
        )
    readings = [_time_reading(raw, found, stamps, int(kept[0]))]
    body: dict[str, Array] = {}
    for triad, (unit, why) in units.items():
        factor = UNITS[triad][unit]
        body[triad] = (values[triad][:, axes.axis] * np.array(axes.sign) * factor)[kept]
        for j, (axis, sign) in enumerate(zip(axes.axis, axes.sign, strict=True)):
            column = found[f"{triad}_{AXES[axis]}"]
            readings.append(
                Reading(
                    column.source,
                    ("-" if sign < 0 else "") + f"{triad}_{AXES[j]}",
                    unit,
                    f"{column.why}; unit {why}; axes {axes.why}",
                    float(values[triad][kept[0], axis]),
                )
            )
    sampling = _sampling(raw, options, findings)
    report_gaps(raw.name, time, body["gyro"], findings)
    report_absurd(raw.name, body["gyro"], lambda k: raw.row(int(kept[k])), findings)
    imu = imu_table(time, body["gyro"], body.get("accel"), sampling=sampling, source=raw.name)
    truth, scored = truth_of_log(raw, found, time, kept, (axes.axis, axes.sign), readings, findings)
    return Recording(
        raw.name, raw.files, stamps.origin, imu, truth, scored, tuple(readings), tuple(findings)
    )


# --- rates and specific force -----------------------------------------------------------


def _triads(
    raw: RawLog, found: dict[str, Column], options: ReadOptions, findings: list[Finding]
) -> tuple[dict[str, Array], dict[str, tuple[str, str]]]:
    """Values as they stand in the file, and the unit of each triad with its reason."""
    values = {"gyro": _triad(raw, found, "gyro")}
    units = {"gyro": _unit(raw, found, "gyro", options, values["gyro"])}
    if not any(f"accel_{a}" in found for a in AXES):
        return values, units
    # The gyro alone makes an attitude; an accelerometer that cannot be used is left out.
    try:
        missing = [f"accel_{a}" for a in AXES if f"accel_{a}" not in found]
        if missing:
            raise DataError(f"{', '.join(missing)} is not there")
        accel = _triad(raw, found, "accel")
        if not np.isfinite(accel).any():
            raise DataError("it holds no number")
        unit = _unit(raw, found, "accel", options, accel)
    except DataError as error:
        said = error.finding
        findings.append(
            Finding(
                f"left out: {said.what}",
                file=raw.name,
                row=said.row,
                quantity="accel",
                remedy=said.remedy,
            )
        )
    else:
        values["accel"], units["accel"] = accel, unit
    return values, units


def _triad(raw: RawLog, found: dict[str, Column], triad: str) -> Array:
    parts = [numbers(raw, found[f"{triad}_{a}"], f"{triad}_{a}").astype(np.float64) for a in AXES]
    return np.column_stack(parts)


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


# --- rows and stamps --------------------------------------------------------------------


def _finite_rows(
    raw: RawLog,
    found: dict[str, Column],
    ticks: NDArray[Any] | None,
    values: dict[str, Array],
    options: ReadOptions,
    findings: list[Finding],
) -> NDArray[np.bool_]:
    """Rows in which every value that is used is a number."""
    blocks = dict(values)
    if ticks is not None:
        blocks = {"time": ticks[:, None].astype(np.float64)} | blocks
    keep = np.ones(len(values["gyro"]), dtype=bool)
    for name, block in blocks.items():
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
                row=raw.row(row),
                quantity=quantity,
                remedy="--repair leaves such rows out and integrates across them",
            )
        findings.append(
            Finding(
                f"{count} row{'s' if count > 1 else ''} left out that held no finite number; "
                "integrated across",
                file=raw.name,
                row=raw.row(row),
                quantity=quantity,
            )
        )
        keep &= ~bad.any(axis=1)
    if not keep.any():
        raise DataError("no row can be used", file=raw.name, remedy="look at the file")
    return keep


def _stamps(
    raw: RawLog,
    found: dict[str, Column],
    ticks: NDArray[Any] | None,
    dated: bool,
    options: ReadOptions,
    finite: NDArray[np.bool_],
    findings: list[Finding],
) -> Stamps:
    """Stamps of the finite rows."""
    rows = np.flatnonzero(finite)
    rate = options.rate or raw.rate
    if options.rate is not None and not (np.isfinite(options.rate) and options.rate > 0):
        raise ConfigError(
            f"{options.rate:g} Hz is no rate", quantity="--rate", remedy="use a positive number"
        )
    if ticks is None:
        if rate is None:
            raise DataError(
                "no column was recognised as time",
                file=raw.name,
                quantity="time",
                remedy="name it with --columns time=NAME, or state the rate with --rate HZ",
            )
        everything = np.ones(rows.size, dtype=bool)
        why = f"no time column: {rate:g} Hz as stated"
        return Stamps(rows / rate, "s", why, everything, Origin(0, "s"), [])
    column = found["time"]
    if options.rate is not None:
        findings.append(
            Finding(
                f"--rate {options.rate:g} is not used: the log has stamps (column "
                f"'{column.source}')",
                file=raw.name,
                quantity="time",
            )
        )
    unit, why = column.unit, "in its name"
    if dated:
        unit, why = "ns", "dates and times of ISO 8601"
    elif options.time_unit:
        unit, why = parse_unit(options.time_unit, "time"), "stated by --time-unit"
    elif column.why == "stated by the file":
        why = "stated by the file"
    stamps = read_stamps(
        ticks[rows],
        unit,
        why,
        file=raw.name,
        row=lambda k: raw.row(int(rows[k])),
        repair=options.repair,
    )
    findings += stamps.findings
    return stamps


def _time_reading(raw: RawLog, found: dict[str, Column], stamps: Stamps, sample: int) -> Reading:
    if "time" not in found:
        return Reading("(none)", "time", "s", stamps.why, 0.0)
    source = found["time"].source
    value = raw.columns[source][sample]
    first = float(value) if raw.columns[source].dtype.kind in "iufb" else str(value)
    return Reading(source, "time", stamps.unit, f"{found['time'].why}; unit {stamps.why}", first)


# --- axes and sampling ------------------------------------------------------------------


def _axes(raw: RawLog, options: ReadOptions, findings: list[Finding]) -> Axes:
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
        return Axes([0, 1, 2], [1.0, 1.0, 1.0], "as they are")
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
    why = f"{text} {'by --axes' if options.axes else 'of this kind of recording'}"
    return Axes(axis, sign, why)


def _sampling(raw: RawLog, options: ReadOptions, findings: list[Finding]) -> str:
    asked = (options.sampling or raw.sampling or "").lower()
    if not asked:
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
