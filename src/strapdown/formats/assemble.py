"""Assemble the columns of a file into a recording in body axes and SI units."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown.constants import TIME_UNITS
from strapdown.errors import ConfigError, DataError, Finding
from strapdown.formats.assemble_truth import truth_of_log
from strapdown.formats.body_axes import Axes, body_axes
from strapdown.formats.clocks import RELATIVE, Clock, clock_of_name, with_clock
from strapdown.formats.find_columns import AXES, Column, find_columns, require_gyro
from strapdown.formats.inference import Inference
from strapdown.formats.judge import UNITS
from strapdown.formats.numbers import ticks_of
from strapdown.formats.recording import Origin, RawLog, Reading, ReadOptions, Recording
from strapdown.formats.stamps import Stamps, read_stamps
from strapdown.formats.summed import SUMS, intervals, sampling_of_sums
from strapdown.formats.triad_units import told_by_numbers, units_of_triads, values_of_triads
from strapdown.formats.unit_words import factor_of, parse_unit
from strapdown.tables import SAMPLINGS, find_gaps, imu_table

__all__ = [
    "assemble",
    "clock_of_log",
    "finite_rows",
    "sampling_of_rates",
    "stamps_of_log",
    "time_reading",
]


Array = NDArray[np.float64]


def assemble(raw: RawLog, options: ReadOptions) -> Recording:
    """Convert raw columns to a recording.

    Parameters
    ----------
    raw : RawLog
    options : ReadOptions
        The user's statements override those of the file, which override column names.

    Returns
    -------
    Recording

    Raises
    ------
    DataError
        A value, a stamp or a unit cannot be used; the message names file, row and remedy.
    ConfigError
        An option names a column that does not exist.
    """
    found = find_columns(raw, options)
    require_gyro(raw, found)
    findings = list(raw.findings)
    values = values_of_triads(raw, found, findings)
    ticks, dated = ticks_of(raw, found["time"]) if "time" in found else (None, False)
    said = told_by_numbers(raw, found, options, values, ticks, dated)
    axes = body_axes(raw, options, said, findings)
    units = units_of_triads(raw, found, options, values, said, findings)
    values = {t: values[t] for t in units}
    finite = finite_rows(raw, found, ticks, values, options, findings)
    stamps = stamps_of_log(raw, found, ticks, dated, options, finite, said, findings)
    kept = np.flatnonzero(finite)[stamps.keep]
    time = stamps.seconds[stamps.keep]
    if time.size < 2:
        raise DataError(
            "io.too-few-samples",
            file=raw.name,
            quantity="time",
            size=time.size,
        )
    readings = [time_reading(raw, found, stamps, int(kept[0]))]
    body: dict[str, Array] = {}
    summed = {t for t, (unit, _) in units.items() if unit in SUMS[t]}
    for triad, (unit, why) in units.items():
        first = values[triad][kept[0]].copy()
        body[triad] = _turned(
            values, triad, axes, factor_of(unit, {**UNITS[triad], **SUMS[triad]}), kept
        )
        if triad in summed:
            body[triad] /= intervals(time, kept)
        readings += _readings_of_triad(found, triad, axes, (unit, why), first)
    if summed:
        sampling = sampling_of_sums(summed, set(units), options.sampling, raw.name, findings)
    else:
        sampling = sampling_of_rates(raw, options, findings)
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
    with_clock(imu, clock_of_log(raw, found, stamps, dated))
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


def _turned(
    values: dict[str, Array], triad: str, axes: Axes, factor: float, kept: NDArray[np.int64]
) -> Array:
    """Take a triad out of `values`: used rows, in body axes and SI units."""
    # In place and without a copy: a long log takes a large part of the memory.
    block = values.pop(triad)
    turned = block[:, axes.axis]
    del block
    turned *= np.array(axes.sign)
    turned *= factor
    return turned if kept.size == len(turned) else turned[kept]


def _readings_of_triad(
    found: dict[str, Column], triad: str, axes: Axes, unit: tuple[str, str], first: Array
) -> list[Reading]:
    """List how the columns of a triad were read, one reading per body axis."""
    readings = []
    for j, (axis, sign) in enumerate(zip(axes.axis, axes.sign, strict=True)):
        column = found[f"{triad}_{AXES[axis]}"]
        readings.append(
            Reading(
                column.source,
                ("-" if sign < 0 else "") + f"{triad}_{AXES[j]}",
                unit[0],
                f"{column.why}; unit {unit[1]}; axes {axes.why}",
                float(first[axis]),
            )
        )
    return readings


# Time of a log: unit, stamps and clock.


def stamps_of_log(
    raw: RawLog,
    found: dict[str, Column],
    ticks: NDArray[Any] | None,
    dated: bool,
    options: ReadOptions,
    finite: NDArray[np.bool_],
    said: dict[str, Inference],
    findings: list[Finding],
) -> Stamps:
    """Convert the stamps of the finite rows to seconds.

    Parameters
    ----------
    raw : RawLog
    found : dict of str to Column
    ticks : ndarray or None, (n,)
        Stamps as in the file.
    dated : bool
        Whether they were dates, now converted to ns.
    options : ReadOptions
    finite : ndarray of bool, (n,)
        From `finite_rows`.
    said : dict of str to Inference
        Inferences from the numbers.
    findings : list of Finding
        Inferences and repairs are appended.

    Raises
    ------
    DataError
        Time is missing, or cannot be used.
    ConfigError
        The stated rate is invalid.
    """
    rows = np.flatnonzero(finite)
    rate = options.rate or raw.rate
    if options.rate is not None and not (np.isfinite(options.rate) and options.rate > 0):
        raise ConfigError("io.rate-not-positive", quantity="--rate", rate=options.rate)
    if ticks is None:
        if rate is None:
            raise DataError("io.time-column-missing", file=raw.name, quantity="time")
        everything = np.ones(rows.size, dtype=bool)
        why = f"no time column: {rate:g} Hz as stated"
        return Stamps(rows / rate, "s", why, everything, Origin(0, "s"), [])
    column = found["time"]
    if options.rate is not None:
        findings.append(
            Finding(
                "io.rate-not-used",
                file=raw.name,
                quantity="time",
                severity="note",
                rate=options.rate,
                source=column.source,
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
                said["time_unit"].finding("io.time-unit-inferred", file=raw.name, quantity="time")
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


def time_reading(raw: RawLog, found: dict[str, Column], stamps: Stamps, sample: int) -> Reading:
    """Describe how the time column was read, with its value at the first sample used."""
    if "time" not in found:
        return Reading("(none)", "time", "s", stamps.why, 0.0)
    source = found["time"].source
    value = raw.columns[source][sample]
    first = float(value) if raw.columns[source].dtype.kind in "iufb" else str(value)
    return Reading(source, "time", stamps.unit, f"{found['time'].why}; unit {stamps.why}", first)


def clock_of_log(raw: RawLog, found: dict[str, Column], stamps: Stamps, dated: bool) -> Clock:
    """Return the clock of a log's stamps."""
    if "time" not in found:
        return Clock(RELATIVE)
    origin = float(stamps.origin.stamp) * TIME_UNITS[stamps.origin.unit]
    first = origin + float(stamps.seconds[0])
    name = raw.clock or clock_of_name(found["time"].source, first, dated=dated)
    return Clock(name, origin)


# Sampling of the rates: instantaneous or mean.


def sampling_of_rates(raw: RawLog, options: ReadOptions, findings: list[Finding]) -> str:
    """Return the sampling stated by the user, else by the file, else instantaneous.

    Parameters
    ----------
    raw : RawLog
    options : ReadOptions
    findings : list of Finding
        Assumptions are appended.

    Returns
    -------
    {'instantaneous', 'mean'}

    Raises
    ------
    ConfigError
        The sampling is unknown.
    """
    asked = (options.sampling or raw.sampling or "").lower()
    if not asked:
        findings.append(
            Finding(
                "io.sampling-taken-as-instantaneous",
                severity="note",
                file=raw.name,
                quantity="sampling",
            )
        )
        return "instantaneous"
    if asked not in SAMPLINGS:
        raise ConfigError(
            "io.sampling-unknown", quantity="--sampling", asked=asked, word=asked, known=SAMPLINGS
        )
    return asked


# Plausibility of a log's numbers.

PLAUSIBILITY_AXES = "xyz"

# Upper limit of any rate; squares of larger ones soon overflow a double.
IMPOSSIBLE_RATE = 1e6  # rad/s
# No body that is carried, driven or flown turns this fast for a twentieth of a log.
LASTING_RATE = 20.0  # rad/s, 3 turns a second
# No gyro in a phone, a toy, a car or an aircraft reads this; a wrong unit does.
ABSURD_RATE = 100.0  # rad/s, 16 turns a second
# Common full scales of gyros, deg/s. A run of equal readings at a full scale is clipped.
FULL_SCALES = (125.0, 250.0, 400.0, 450.0, 500.0, 1000.0, 2000.0, 4000.0)
CUT_OFF_RUN = 3  # samples

# A gap from this length on hides motion.
LONG_GAP = 1.0  # s


def report_gaps(name: str, time: Array, gyro: Array, findings: list[Finding]) -> None:
    """Report gaps in time, and the rotation that the longest may hide."""
    gaps = find_gaps(time)
    if not gaps:
        return
    worst = max(gaps, key=lambda g: g.length)
    speed = np.sqrt((gyro[worst.sample - 1 : worst.sample + 1] ** 2).sum(axis=1)).max()
    missed = float(np.degrees(speed * worst.length))
    findings.append(
        Finding(
            "io.long-gap" if worst.length >= LONG_GAP else "io.gaps",
            file=name,
            quantity="time",
            severity="warning" if worst.length >= LONG_GAP else "note",
            count=len(gaps),
            length=worst.length,
            start=worst.start,
            end=worst.end,
            usual=worst.usual,
            missed_deg=missed,
        )
    )


def report_absurd(
    name: str, gyro: Array, row: Callable[[int], int], findings: list[Finding]
) -> None:
    """Report rates that are implausible, or clipped at the sensor's full scale.

    Raises
    ------
    DataError
        A rate is beyond the limit of any rotating body.
    """
    largest = np.abs(gyro).max(axis=0)
    k = int(largest.argmax())
    if largest[k] > IMPOSSIBLE_RATE:
        at = int(np.abs(gyro[:, k]).argmax())
        raise DataError(
            "io.rate-impossible",
            file=name,
            row=row(at),
            quantity=f"gyro_{PLAUSIBILITY_AXES[k]}",
            gyro=gyro[at, k],
        )
    lasting = float(np.quantile(np.sqrt((gyro * gyro).sum(axis=1)), 0.95))
    if LASTING_RATE < lasting <= largest[k] <= ABSURD_RATE:
        findings.append(
            Finding(
                "io.rate-absurd-for-long",
                file=name,
                quantity="gyro",
                lasting=lasting,
                lasting_2=lasting / (2 * np.pi),
            )
        )
    if largest[k] > ABSURD_RATE:
        at = int(np.abs(gyro[:, k]).argmax())
        findings.append(
            Finding(
                "io.rate-absurd",
                file=name,
                row=row(at),
                quantity=f"gyro_{PLAUSIBILITY_AXES[k]}",
                gyro=gyro[at, k],
                largest=largest[k] / (2 * np.pi),
            )
        )
    for k in range(3):
        reading = float(np.degrees(largest[k]))
        # The largest 16-bit reading is one step below the full scale.
        scale = next((s for s in FULL_SCALES if s * (1 - 1e-3) <= reading <= s * 1.0001), None)
        if scale is None:
            continue
        full = np.abs(gyro[:, k]) == largest[k]
        run = np.convolve(full, np.ones(CUT_OFF_RUN), mode="valid") == CUT_OFF_RUN
        if run.any():
            findings.append(
                Finding(
                    "io.rate-at-full-scale",
                    file=name,
                    row=row(int(run.argmax())),
                    quantity=f"gyro_{PLAUSIBILITY_AXES[k]}",
                    full=int(full.sum()),
                    reading=reading,
                )
            )


# Rows of a log in which every used value is a number.


def finite_rows(
    raw: RawLog,
    found: dict[str, Column],
    ticks: NDArray[Any] | None,
    values: dict[str, Array],
    options: ReadOptions,
    findings: list[Finding],
) -> NDArray[np.bool_]:
    """Select the rows in which every used value is a number.

    Parameters
    ----------
    raw : RawLog
    found : dict of str to Column
    ticks : ndarray or None, (n,)
        Stamps as in the file.
    values : dict of str to ndarray, (n, 3)
        Values of the triads used.
    options : ReadOptions
        Whether rows may be dropped.
    findings : list of Finding
        The number of dropped rows is appended.

    Returns
    -------
    ndarray of bool, (n,)

    Raises
    ------
    DataError
        A row cannot be used and may not be dropped, or no row is left.
    """
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
                "io.not-finite-in-rows",
                file=raw.name,
                row=raw.row(row),
                quantity=quantity,
                block=block[row, column],
                source=found[quantity].source,
                count=count,
            )
        findings.append(
            Finding(
                "io.rows-without-number-left-out",
                file=raw.name,
                row=raw.row(row),
                quantity=quantity,
                severity="note",
                count=count,
            )
        )
        keep &= ~bad.any(axis=1)
    if not keep.any():
        raise DataError("io.no-usable-row", file=raw.name)
    return keep
