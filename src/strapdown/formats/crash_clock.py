"""Stamps and values of one channel, from what the record has and what a case states of it."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import ConfigError, DataError, Finding
from strapdown.formats.crash_record import CrashChannel, CrashRecord
from strapdown.formats.crash_stamps import Clock, last_midnight, seconds_of
from strapdown.formats.crash_units import state_unit
from strapdown.formats.stamps import EPOCH

Array = NDArray[np.float64]

__all__ = ["triad_stamps"]

# How far a stated rate may be from that of the stamps.
RATE_AGREES = 0.01


def triad_stamps(
    record: CrashRecord,
    channel: CrashChannel,
    time: str | None,
    time_unit: str | None,
    rate_hz: float | None,
    findings: list[Finding],
) -> tuple[Array, Array]:
    """Stamps in s and values of a channel.

    Parameters
    ----------
    record : CrashRecord
    channel : CrashChannel
    time, time_unit, rate_hz
        As of `triad_of_channels`.
    findings : list of Finding
        What was concluded is added.

    Returns
    -------
    time, values : ndarray, (n,)

    Raises
    ------
    ConfigError
        What is stated contradicts the record, or itself.
    DataError
        Nothing tells the stamps, or time does not advance.
    """
    if rate_hz is not None and not (math.isfinite(rate_hz) and rate_hz > 0.0):
        raise ConfigError("io.crash-rate-not-positive", quantity="rate_hz", rate_hz=rate_hz)
    if time is None and time_unit is None and rate_hz is None:
        stamps, values = channel.load()
        _check_advances(channel, stamps)
        # What was concluded on the way is told again.
        if channel.clock and (own := _clock_of(record, channel.clock, None)).unit == "":
            findings.extend(seconds_of(own)[1])
        return stamps, values
    if time is None and not channel.clock and rate_hz is None:
        raise ConfigError(
            "io.time-unit-stated-record-no"
            if channel.samples is not None
            else "io.time-unit-stated-record-stamps",
            file=record.path.name,
            quantity="time_unit",
            time_unit=time_unit,
        )
    name = time if time is not None else channel.clock
    values = channel.samples() if channel.samples is not None else channel.load()[1]
    values = np.asarray(values, dtype=np.float64)
    if rate_hz is None:
        return _same_length(channel, *_stated(record, name, time_unit, findings), values)
    return _even(record, channel, name, time_unit, rate_hz, findings, values), values


def _clock_of(record: CrashRecord, name: str, time_unit: str | None) -> Clock:
    held = record.channel(name)
    read = held.samples or (lambda: held.load()[1])
    recorded = held.unit if held.quantity == "time" else ""
    if held.quantity not in ("time", "other"):
        raise DataError(
            "io.holds-stamps-needed",
            file=held.file or record.path.name,
            quantity=f"channel {name}",
            of_what=held.quantity,
        )
    stated = state_unit(time_unit, "time", "time_unit") if time_unit else ""
    if stated and recorded and stated != recorded:
        raise ConfigError(
            "io.time-unit-stated-record-says",
            file=record.path.name,
            quantity="time_unit",
            time_unit=time_unit,
            recorded=recorded,
        )
    return Clock(name, read(), recorded or stated, held.file or record.path.name, held.row)


def _stated(
    record: CrashRecord, name: str, time_unit: str | None, findings: list[Finding]
) -> tuple[Array, str]:
    seconds, told = seconds_of(_clock_of(record, name, time_unit))
    findings += told
    return seconds, name


def _same_length(
    channel: CrashChannel, stamps: Array, name: str, values: Array
) -> tuple[Array, Array]:
    if stamps.size != values.size:
        raise DataError(
            "io.samples-channel-stamps",
            file=channel.file or None,
            quantity=f"channel {channel.name}",
            size=values.size,
            name=name,
            size_2=stamps.size,
        )
    return stamps, values


def _even(
    record: CrashRecord,
    channel: CrashChannel,
    name: str,
    time_unit: str | None,
    rate_hz: float,
    findings: list[Finding],
    values: Array,
) -> Array:
    """Evenly spaced stamps, from the first recorded one where there is one."""
    count = np.arange(values.size, dtype=np.float64)
    start, span = 0.0, 0.0
    if name:
        clock = _clock_of(record, name, time_unit)
        stamps = _same_length(channel, clock.stamps.astype(np.float64), name, values)[0]
        ends = stamps[[0, -1]]
        seconds = _ends(clock, ends, rate_hz, values.size)
        start, span = float(seconds[0]), float(seconds[1] - seconds[0])
        if abs(start) > EPOCH:
            start -= last_midnight(start, 1.0)
    elif channel.samples is None:
        stamps = channel.load()[0]
        start, span = float(stamps[0]), float(stamps[-1] - stamps[0])
    if (name or channel.samples is None) and values.size > 1:
        recorded = (values.size - 1) / span if span > 0.0 else math.inf
        if not abs(recorded / rate_hz - 1.0) <= RATE_AGREES:
            raise ConfigError(
                "io.rate-hz-stated-stamps-record",
                file=record.path.name,
                quantity="rate_hz",
                rate_hz=rate_hz,
                recorded=recorded,
            )
        findings.append(
            Finding(
                "io.stamps-evenly-spaced-hz-first",
                file=record.path.name,
                quantity="time",
                severity="note",
                rate_hz=rate_hz,
            )
        )
    return start + count / rate_hz


def _ends(clock: Clock, ends: Array, rate_hz: float, count: int) -> Array:
    """First and last stamp in s; of a clock without a unit, in the one that fits the rate."""
    from strapdown.constants import TIME_UNITS

    if not np.isfinite(ends).all():
        raise DataError(
            "io.first-or-last-stamp-missing",
            file=clock.file,
            row=clock.row(0 if not np.isfinite(ends[0]) else count - 1),
            quantity=f"time ({clock.name})",
        )
    if clock.unit:
        return ends * TIME_UNITS[clock.unit]
    span = float(ends[1] - ends[0])
    for factor in TIME_UNITS.values():
        if span > 0.0 and abs((count - 1) / (span * factor) / rate_hz - 1.0) <= RATE_AGREES:
            return ends * factor
    return ends


def _check_advances(channel: CrashChannel, stamps: Array) -> None:
    bad = np.flatnonzero(~(np.diff(stamps) > 0.0)) if stamps.size > 1 else np.array([], int)
    if stamps.size == 0 or bad.size or not np.isfinite(stamps[0]):
        k = int(bad[0]) + 1 if bad.size else 0
        raise DataError(
            "io.time-goes" if bad.size else "io.no-stamps",
            file=channel.file or None,
            row=channel.row(k),
            quantity=f"time of channel {channel.name}",
            stamps=stamps[k - 1] if bad.size else None,
            stamps_2=stamps[k] if bad.size else None,
        )
