"""Stamps of crash records in seconds, and mean accelerations from velocity changes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown.errors import DataError, Finding, add_note, add_warning
from strapdown.formats.clocks import EPOCH
from strapdown.formats.crash_record import CrashChannel
from strapdown.formats.inference.conclusion import infer_time_unit
from strapdown.formats.triad_units import what_numbers_say
from strapdown.tables.checks import Array
from strapdown.units import TIME_UNITS

DAY = 86_400.0  # s


@dataclass(frozen=True, eq=False)
class Clock:
    """A column of stamps, as recorded.

    `name`: name of the column. `stamps` ((n,)): integer or not, as recorded. `unit`: a key of
    `TIME_UNITS`, or empty if not stated. `row`: maps the number of a stamp to its row in the file.
    """

    name: str
    stamps: NDArray[Any]
    unit: str
    file: str
    row: Callable[[int], int]


def seconds_of(clock: Clock) -> tuple[Array, list[Finding]]:
    """Convert stamps to increasing seconds.

    Returns `seconds` ((n,)): from the origin of the recorder. Where that is more than 1e6 s away (a
    clock of 1970), from the last midnight of that clock before the first stamp, so that records of
    one clock that start at different times keep a common time. DataError: a stamp is missing, time
    does not advance, or the unit is not stated and not evident.
    """
    findings: list[Finding] = []
    stamps = past_midnight(clock.stamps, clock.unit)
    stamps = stamps.astype(np.int64) if stamps.dtype.kind in "iub" else stamps.astype(np.float64)
    missing = np.flatnonzero(~np.isfinite(stamps))
    if missing.size:
        k = int(missing[0])
        raise DataError(
            "io.no-stamp-such",
            file=clock.file,
            row=clock.row(k),
            quantity=f"time ({clock.name})",
            stamps=clock.stamps[k],
            size=missing.size,
        )
    ticks = (stamps - stamps[0]).astype(np.float64)
    back = np.flatnonzero(np.diff(ticks) <= 0.0)
    if back.size:
        k = int(back[0])
        same = ticks[k] == ticks[k + 1]
        raise DataError(
            "io.crash-stamp-repeated" if same else "io.time-goes-back-in-record",
            file=clock.file,
            row=clock.row(k + 1),
            quantity=f"time ({clock.name})",
            stamps=stamps[k + 1],
            stamps_2=stamps[k],
        )
    unit = clock.unit or _evident(clock, stamps, findings)
    factor = TIME_UNITS[unit]
    if abs(float(stamps[0])) * factor <= EPOCH:
        return stamps.astype(np.float64) * factor, findings
    midnight = last_midnight(stamps[0].item(), factor)
    add_note(
        findings,
        "io.crash-time-from-midnight",
        file=clock.file,
        quantity=f"time ({clock.name})",
        midnight=midnight,
        unit=unit,
    )
    return (stamps - midnight).astype(np.float64) * factor, findings


def last_midnight(stamp: float, factor: float) -> float:
    """Return the stamp of the last midnight of a clock before a stamp.

    `stamp`: in ticks; integers stay integers. `factor` (s): duration of a tick.
    """
    day = round(DAY / factor)
    return stamp // day * day


# A step over midnight is no longer than so many others: a longer one joins two records.
LONGEST_STEP = 10.0


def past_midnight(stamps: NDArray[Any], unit: str) -> NDArray[Any]:
    """Continue stamps of the time of day past midnight, where they begin again at zero.

    `stamps`: in ticks; integers stay integers. `unit`: a key of `TIME_UNITS`, or empty: then the
    one whose day makes the step over midnight like the others. Others are returned unchanged.
    """
    if stamps.dtype.kind not in "iuf" or stamps.size < 3 or not np.isfinite(stamps).all():
        return stamps
    steps = np.diff(stamps.astype(np.float64))
    back = np.flatnonzero(steps < 0.0)
    if back.size != 1 or steps.max() <= 0.0:
        return stamps
    # Whole seconds repeat.
    usual = float(np.median(steps[steps > 0.0]))
    for factor in [TIME_UNITS[unit]] if unit else TIME_UNITS.values():
        day = round(DAY / factor)
        over = float(steps[back[0]]) + day
        if 0.0 < over <= LONGEST_STEP * usual and stamps.min() >= 0 and stamps.max() < day:
            moved = stamps.copy()
            moved[int(back[0]) + 1 :] += day
            return moved
    return stamps


def _evident(clock: Clock, stamps: NDArray[Any], findings: list[Finding]) -> str:
    said = infer_time_unit(stamps)
    where = {"file": clock.file, "quantity": f"time ({clock.name})"}
    if said.settled:
        findings.append(said.finding("io.crash-time-unit-inferred", **where))
        return str(said.value)
    raise DataError("io.crash-time-unit-undecided", **where, **what_numbers_say(said))


# Mean accelerations from a table of cumulative velocity changes.


# A table that begins one step after time zero omits the row of zeros.
ONE_STEP = 1.5


def mean_acceleration(channel: CrashChannel) -> tuple[Array, Array]:
    """Compute the mean acceleration over each interval of a velocity channel.

    Parameters
    ----------
    channel : CrashChannel
        Of quantity ``velocity``.

    Returns
    -------
    time : ndarray, (n,), s
        End of each interval, as for sampling ``mean``.
    acceleration : ndarray, (n,), m/s²
        Change of velocity over the interval divided by its length; exact for any motion within
        it.

    Raises
    ------
    DataError
        The quantity is not velocity, there are fewer than two samples, or a value is missing.
    """
    if channel.quantity != "velocity":
        raise DataError(
            "io.holds-change-velocity-needed",
            file=channel.file or None,
            quantity=channel.name,
            of_what=channel.quantity,
        )
    time, velocity = channel.load()
    bad = np.flatnonzero(~np.isfinite(velocity))
    if bad.size or velocity.size < 2:
        k = int(bad[0]) if bad.size else None
        raise DataError(
            "io.not-finite-number-2" if k is not None else "io.fewer-than-two-samples",
            file=channel.file or None,
            row=channel.row(k) if k is not None else None,
            quantity=channel.name,
            velocity=velocity[k] if k is not None else None,
        )
    from_zero = channel.from_zero and 0.0 < time[0] <= ONE_STEP * (time[1] - time[0])
    return mean_accelerations_of(time, velocity, from_zero=bool(from_zero))


# Largest share of the maximum that a change since time zero may have at time zero: its bound grows
# by it. More is another quantity, or another time zero.
MOST_AT_ZERO = 0.2


class FromZero(NamedTuple):
    """Mean accelerations of a change of velocity that counts from time zero.

    `time`, (n,), s: ends of the intervals; the first has mean zero, its end is where the change
    counts from. `mean`, (n,). `late`, s: time before the first sample where it is more than a step,
    else 0: only the sum is known there. `offset`: value at time zero, which should be zero.
    """

    time: Array
    mean: Array
    late: float
    offset: float


def means_from_zero(time: ArrayLike, velocity: ArrayLike, channel: CrashChannel) -> FromZero:
    """Compute mean accelerations whose sum is the recorded change at every stamp.

    The change is zero at time zero by definition (49 CFR 563.5, delta-V). A table that begins one
    step later includes the step from there; one that begins more than a step later has its first
    value evenly over the steps before. `velocity`: in any unit. DataError: it is not near zero at
    time zero, or fewer than two samples.
    """
    t = np.asarray(time, dtype=np.float64)
    v = np.asarray(velocity, dtype=np.float64)
    where = channel.where
    if t.size < 2:
        raise DataError("io.sample-no-change-velocity", size=t.size, **where)
    step = float(np.median(np.diff(t)))
    largest = float(np.max(np.abs(v)))
    # An axis that is still zero after one step has that step, too, as the others of its table.
    if t[0] > 0.5 * step and (v[0] != 0.0 or t[0] <= ONE_STEP * step):
        count = max(round(t[0] / step), 1)
        late = float(t[0]) if t[0] > ONE_STEP * step else 0.0
        part = np.arange(count) / count
        t, v = np.concatenate([part * t[0], t]), np.concatenate([part * v[0], v])
        offset = 0.0
    else:
        late, offset = 0.0, float(v[0])
        if abs(offset) > MOST_AT_ZERO * largest:
            raise DataError(
                "io.delta-v-not-zero-at-start",
                row=channel.row(0),
                start=float(t[0]),
                share=100.0 * abs(offset) / largest,
                **where,
            )
        if offset:
            t, v = np.concatenate([[t[0] - step], t]), np.concatenate([[0.0], v])
    return FromZero(t, np.concatenate([[0.0], np.diff(v) / np.diff(t)]), late, offset)


def of_start(found: FromZero, channel: CrashChannel, unit: float = 1.0) -> list[Finding]:
    """Findings of a table that begins late, or not at zero; `unit`: factor to m/s."""
    where = channel.where
    findings: list[Finding] = []
    if found.late:
        add_warning(findings, "io.delta-v-begins-late", **where, first=found.late)
    if found.offset:
        offset = found.offset * unit * 3.6
        add_warning(findings, "io.delta-v-offset-at-start", **where, offset=offset)
    return findings


def mean_accelerations_of(
    time: ArrayLike, velocity: ArrayLike, *, from_zero: bool = False
) -> tuple[Array, Array]:
    """Compute the mean acceleration over each interval.

    `time` ((n,), s): increasing. `velocity` ((n,), m/s). `from_zero`: whether the velocity is a
    change since time zero: the interval from there to the first stamp then counts, too. Returns
    `time` ((n - 1,) or (n,), s): end of each interval; `acceleration` (m/s²).
    """
    t = np.asarray(time, dtype=np.float64)
    v = np.asarray(velocity, dtype=np.float64)
    if from_zero:
        t, v = np.concatenate([[0.0], t]), np.concatenate([[0.0], v])
    return t[1:], np.diff(v) / np.diff(t)
