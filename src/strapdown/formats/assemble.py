"""From the columns of a file to a recording in body axes and SI."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown.constants import TIME_UNITS
from strapdown.exceptions import ConfigError, DataError, Finding, nearest
from strapdown.formats.assemble_truth import truth_of_log
from strapdown.formats.clocks import RELATIVE, Clock, clock_of_name, with_clock
from strapdown.formats.columns import parse_axes, says_increment
from strapdown.formats.find_columns import AXES, Column, find_columns, require_gyro
from strapdown.formats.inference import Inference, Signals, infer_signals
from strapdown.formats.judge import (
    UNITS,
    inferred_unit,
    report_contradictions,
    report_upside_down,
    told_of_up,
)
from strapdown.formats.numbers import numbers, ticks_of
from strapdown.formats.plausibility import report_absurd, report_gaps
from strapdown.formats.recording import Origin, RawLog, ReadOptions, Recording
from strapdown.formats.stamps import Stamps, read_stamps
from strapdown.formats.summed import OPEN, SUMS, intervals, sampling_of_sums
from strapdown.formats.unit_words import factor_of, parse_unit
from strapdown.results import Reading
from strapdown.tables import SAMPLINGS, imu_table

Array = NDArray[np.float64]
# Left out where they cannot be used, for the gyro alone makes an attitude.
OPTIONAL = ("accel", "mag")


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
    values = _values(raw, found, findings)
    ticks, dated = ticks_of(raw, found["time"]) if "time" in found else (None, False)
    said = _said(raw, found, options, values, ticks, dated)
    axes = _axes(raw, options, said, findings)
    units = _units(raw, found, options, values, said, findings)
    values = {t: values[t] for t in units}
    finite = _finite_rows(raw, found, ticks, values, options, findings)
    stamps = _stamps(raw, found, ticks, dated, options, finite, said, findings)
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
    summed = {t for t, (unit, _) in units.items() if unit in SUMS[t]}
    for triad, (unit, why) in units.items():
        factor = factor_of(unit, {**UNITS[triad], **SUMS[triad]})
        # A long log is a large part of the memory there is: in place, and nothing kept beside it.
        block = values.pop(triad)
        first = block[kept[0]].copy()
        turned = block[:, axes.axis]
        del block
        turned *= np.array(axes.sign)
        turned *= factor
        body[triad] = turned if kept.size == len(turned) else turned[kept]
        del turned
        if triad in summed:
            body[triad] /= intervals(time, kept)
        for j, (axis, sign) in enumerate(zip(axes.axis, axes.sign, strict=True)):
            column = found[f"{triad}_{AXES[axis]}"]
            readings.append(
                Reading(
                    column.source,
                    ("-" if sign < 0 else "") + f"{triad}_{AXES[j]}",
                    unit,
                    f"{column.why}; unit {why}; axes {axes.why}",
                    float(first[axis]),
                )
            )
    if summed:
        sampling = sampling_of_sums(summed, set(units), options.sampling, raw.name, findings)
    else:
        sampling = _sampling(raw, options, findings)
    report_gaps(raw.name, time, body["gyro"], findings)
    report_absurd(raw.name, body["gyro"], lambda k: raw.row(int(kept[k])), findings)
    imu = imu_table(
        time,
        body.pop("gyro"),
        body.pop("accel", None),
        body.pop("mag", None),
        sampling=sampling,
        source=raw.name,
    )
    with_clock(imu, _clock(raw, found, stamps, dated))
    first, last = raw.row(int(kept[0])), raw.row(int(kept[-1]))
    imu.attrs["first_row"] = first if last - first == len(kept) - 1 else None
    truth, scored = truth_of_log(raw, found, time, kept, (axes.axis, axes.sign), readings, findings)
    return Recording(
        name=raw.name,
        files=raw.files,
        origin=stamps.origin,
        imu=imu,
        truth=truth,
        scored=scored,
        readings=tuple(readings),
        findings=tuple(findings),
        start=raw.start,
    )


# --- rates and specific force -----------------------------------------------------------


def _values(raw: RawLog, found: dict[str, Column], findings: list[Finding]) -> dict[str, Array]:
    """Values of the triads as they stand in the file."""
    values = {"gyro": _triad(raw, found, "gyro")}
    for triad in OPTIONAL:
        if not any(f"{triad}_{a}" in found for a in AXES):
            continue
        try:
            missing = [f"{triad}_{a}" for a in AXES if f"{triad}_{a}" not in found]
            if missing:
                raise DataError(f"{', '.join(missing)} is not there")
            block = _triad(raw, found, triad)
            if not np.isfinite(block).any():
                raise DataError("it holds no number")
            empty = int((~np.isfinite(block)).any(axis=1).sum())
            if triad == "mag" and empty:
                raise DataError(f"{empty} rows hold no number of it")
        except DataError as error:
            findings.append(_left_out(raw, triad, error))
        else:
            values[triad] = block
    return values


def _triad(raw: RawLog, found: dict[str, Column], triad: str) -> Array:
    parts = [numbers(raw, found[f"{triad}_{a}"], f"{triad}_{a}") for a in AXES]
    return np.column_stack(parts).astype(np.float64, copy=False)


def _left_out(raw: RawLog, triad: str, error: DataError) -> Finding:
    said = error.finding
    return Finding(
        f"left out: {said.what}", file=raw.name, row=said.row, quantity=triad, remedy=said.remedy
    )


def _said(
    raw: RawLog,
    found: dict[str, Column],
    options: ReadOptions,
    values: dict[str, Array],
    ticks: NDArray[Any] | None,
    dated: bool,
) -> dict[str, Inference]:
    """What the numbers say; of a gyro alone whose unit is stated, nothing is asked."""
    if set(values) == {"gyro"} and _stated_unit(found, "gyro", options):
        return {}
    unit = "ns" if dated else None
    if ticks is not None and not dated:
        asked = options.time_unit
        unit = parse_unit(asked, "time") if asked else found["time"].unit
    signals = Signals(
        ticks,
        values["gyro"],
        values.get("accel"),
        values.get("mag"),
        time_unit=unit,
        rate=options.rate or raw.rate,
    )
    return {i.quantity: i for i in infer_signals(signals)}


def _units(
    raw: RawLog,
    found: dict[str, Column],
    options: ReadOptions,
    values: dict[str, Array],
    said: dict[str, Inference],
    findings: list[Finding],
) -> dict[str, tuple[str, str]]:
    """The unit of each triad that can be used, with its reason."""
    units: dict[str, tuple[str, str]] = {}
    asked: set[str] = set()
    for triad, block in values.items():
        stated = _stated_unit(found, triad, options)
        if stated is None or stated[1].startswith("stated by --"):
            asked.add(triad)
        try:
            if stated is None:
                _refuse_open(raw, found, triad)
            units[triad] = stated or inferred_unit(triad, said, block, raw.name, findings)
        except DataError as error:
            if triad == "gyro":
                raise
            findings.append(_left_out(raw, triad, error))
    mirrored = options.axes is not None and _determinant(*parse_axes(options.axes)) < 0
    plain = {t: u for t, (u, _) in units.items()}
    report_contradictions(said, plain, asked, mirrored, raw.name, findings)
    return units


def _refuse_open(raw: RawLog, found: dict[str, Column], triad: str) -> None:
    """Refuse a unit that the file leaves open: of f and -f the numbers cannot tell which.

    Raises
    ------
    DataError
    """
    column = found[f"{triad}_x"]
    unit = column.unit
    if unit is None and says_increment(column.source):
        unit = OPEN[triad]
    if unit and " or " in unit:
        raise DataError(
            f"the file leaves open whether it is in {unit}",
            file=raw.name,
            quantity=triad,
            remedy=f"state it with --{triad}-unit",
        )


def _stated_unit(
    found: dict[str, Column], triad: str, options: ReadOptions
) -> tuple[str, str] | None:
    asked = {"gyro": options.gyro_unit, "accel": options.accel_unit}.get(triad)
    if asked:
        return parse_unit(asked, triad), f"stated by --{triad}-unit"
    columns = [found[f"{triad}_{a}"] for a in AXES]
    units = {c.unit for c in columns}
    known = set(UNITS[triad])
    # Degrees in a name are often meant a second: only a name that says increments is believed.
    if all(says_increment(c.source) for c in columns):
        known |= set(SUMS[triad])
    unit = columns[0].unit
    if len(units) == 1 and unit is not None and unit in known:
        stated = columns[0].why == "stated by the file"
        return unit, "stated by the file" if stated else "in its name"
    return None


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
    said: dict[str, Inference],
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
    elif unit is None and "time_unit" in said and said["time_unit"].settled:
        unit, why = str(said["time_unit"].value), str(said["time_unit"])
        if unit != "s":
            findings.append(
                Finding(why, file=raw.name, quantity="time", remedy="if not, say --time-unit")
            )
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


def _clock(raw: RawLog, found: dict[str, Column], stamps: Stamps, dated: bool) -> Clock:
    if "time" not in found:
        return Clock(RELATIVE)
    origin = float(stamps.origin.stamp) * TIME_UNITS[stamps.origin.unit]
    first = origin + float(stamps.seconds[0])
    name = raw.clock or clock_of_name(found["time"].source, first, dated=dated)
    return Clock(name, origin)


# --- axes and sampling ------------------------------------------------------------------


def _determinant(axis: list[int], sign: list[float]) -> float:
    return float(np.linalg.det(np.eye(3)[axis] * np.array(sign)[:, None]))


def _axes(
    raw: RawLog, options: ReadOptions, said: dict[str, Inference], findings: list[Finding]
) -> Axes:
    text = options.axes or raw.axes
    if text is None:
        up = None if options.accel_unit else told_of_up(said)
        what, remedy = up or (
            "",
            "state them with --axes, as in --axes x,-y,-z for forward, left, up",
        )
        findings.append(
            Finding(
                "the sensor's x, y, z are taken as the body's forward, right, down: nothing says "
                f"otherwise{what}",
                file=raw.name,
                quantity="axes",
                remedy=remedy,
            )
        )
        return Axes([0, 1, 2], [1.0, 1.0, 1.0], "as they are")
    axis, sign = parse_axes(text)
    if options.axes and not options.accel_unit:
        down = ("-" if sign[2] < 0 else "") + AXES[axis[2]]
        report_upside_down(said, down, raw.name, findings)
    if options.axes and _determinant(axis, sign) < 0:
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
