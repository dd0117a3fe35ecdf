"""From the columns of a file to a recording in body axes and SI."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import DataError
from strapdown.formats.assemble_truth import truth_of_log
from strapdown.formats.body_axes import Axes, body_axes
from strapdown.formats.clocks import with_clock
from strapdown.formats.find_columns import AXES, Column, find_columns, require_gyro
from strapdown.formats.judge import UNITS
from strapdown.formats.log_stamps import clock_of_log, stamps_of_log, time_reading
from strapdown.formats.numbers import ticks_of
from strapdown.formats.plausibility import report_absurd, report_gaps
from strapdown.formats.recording import RawLog, ReadOptions, Recording
from strapdown.formats.sampling import sampling_of_rates
from strapdown.formats.summed import SUMS, intervals, sampling_of_sums
from strapdown.formats.triad_units import told_by_numbers, units_of_triads
from strapdown.formats.triad_values import values_of_triads
from strapdown.formats.unit_words import factor_of
from strapdown.formats.usable_rows import finite_rows
from strapdown.results.inputs import Reading
from strapdown.tables import imu_table

__all__ = ["assemble"]

Array = NDArray[np.float64]


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
    """Take a triad out of `values`: its rows that are used, in body axes and SI."""
    # A long log is a large part of the memory there is: in place, and nothing kept beside it.
    block = values.pop(triad)
    turned = block[:, axes.axis]
    del block
    turned *= np.array(axes.sign)
    turned *= factor
    return turned if kept.size == len(turned) else turned[kept]


def _readings_of_triad(
    found: dict[str, Column], triad: str, axes: Axes, unit: tuple[str, str], first: Array
) -> list[Reading]:
    """What the columns of a triad were taken for, a reading each body axis."""
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
