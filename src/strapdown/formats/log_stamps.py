"""Time of a log: its unit, its stamps, and the clock that they belong to."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown.constants import TIME_UNITS
from strapdown.errors import ConfigError, DataError, Finding
from strapdown.formats.clocks import RELATIVE, Clock, clock_of_name
from strapdown.formats.find_columns import Column
from strapdown.formats.inference import Inference
from strapdown.formats.recording import Origin, RawLog, ReadOptions
from strapdown.formats.stamps import Stamps, read_stamps
from strapdown.formats.unit_words import parse_unit
from strapdown.results.inputs import Reading

__all__ = ["clock_of_log", "stamps_of_log", "time_reading"]


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
    """Stamps of the finite rows.

    Parameters
    ----------
    raw : RawLog
    found : dict of str to Column
    ticks : ndarray or None, (n,)
        Stamps as they stand in the file.
    dated : bool
        They were dates, and are ns now.
    options : ReadOptions
    finite : ndarray of bool, (n,)
        From `finite_rows`.
    said : dict of str to Inference
        What the numbers say.
    findings : list of Finding
        What was concluded or repaired is added.

    Raises
    ------
    DataError
        There is no time, or it cannot be used.
    ConfigError
        The rate that was stated is none.
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
    """What the column of time was taken for, with its value at the first sample used."""
    if "time" not in found:
        return Reading("(none)", "time", "s", stamps.why, 0.0)
    source = found["time"].source
    value = raw.columns[source][sample]
    first = float(value) if raw.columns[source].dtype.kind in "iufb" else str(value)
    return Reading(source, "time", stamps.unit, f"{found['time'].why}; unit {stamps.why}", first)


def clock_of_log(raw: RawLog, found: dict[str, Column], stamps: Stamps, dated: bool) -> Clock:
    """What the stamps of a log count, and from when."""
    if "time" not in found:
        return Clock(RELATIVE)
    origin = float(stamps.origin.stamp) * TIME_UNITS[stamps.origin.unit]
    first = origin + float(stamps.seconds[0])
    name = raw.clock or clock_of_name(found["time"].source, first, dated=dated)
    return Clock(name, origin)
