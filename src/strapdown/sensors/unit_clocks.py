"""How the clocks of units on one vehicle relate: by the common trigger, or by what they felt."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from strapdown.dsp.delay import Delay, EvenSignal, find_delay
from strapdown.errors import DataError, Finding
from strapdown.sensors.crash_unit import CrashUnit, RecordedTriad
from strapdown.sensors.low_pass import time_constant
from strapdown.sensors.triad_channels import TriadChannels
from strapdown.sensors.triad_numbers import check_sd

Array = NDArray[np.float64]

__all__ = ["UnitClock", "clocks_by_correlation", "clocks_by_trigger"]

# Triggers and correlation that differ by more standard deviations contradict each other.
CONTRADICTION = 4.0
# A trigger that is farther outside of its record is one of another clock.
OUTSIDE = 1.0  # s
FORCE, RATES = "specific force", "rates"


@dataclass(frozen=True)
class UnitClock:
    """A unit's clock against the common one.

    Attributes
    ----------
    offset : float, s
        Common time is the unit's stamp less this.
    sd : float, s
    how : str
        For people.
    """

    offset: float
    sd: float
    how: str


@dataclass(frozen=True, eq=False)
class UnitChannels:
    """A unit and the channels of its triads."""

    unit: CrashUnit
    accelerometers: tuple[TriadChannels, ...]
    gyro: TriadChannels | None


def clocks_by_trigger(units: Sequence[UnitChannels]) -> list[UnitClock]:
    """Take each unit's own trigger as zero.

    Raises
    ------
    DataError
        A unit has none.
    """
    return [UnitClock(_trigger_within(u), u.unit.trigger_sd, "trigger") for u in units]


def clocks_by_correlation(
    units: Sequence[UnitChannels], reference: UnitChannels
) -> tuple[list[UnitClock], list[Finding]]:
    """Lay each unit's specific force, or rates, over the reference unit's.

    Parameters
    ----------
    units : sequence of UnitChannels
    reference : UnitChannels
        One of them; its trigger is the common zero.

    Returns
    -------
    clocks : list of UnitClock
        The delays less what each part's stated bandwidth accounts for. The reference unit's has
        the standard deviation 0: what its trigger is off by, all share.
    findings : list of Finding

    Raises
    ------
    DataError
        The reference unit has no trigger, or a unit has too little in common with it, or the
        motion repeats itself.
    """
    zero = _trigger(reference.unit)
    clocks, findings = [], []
    for u in units:
        if u is reference:
            clocks.append(UnitClock(zero, 0.0, "reference"))
            continue
        delay, what = _delay(reference, u)
        clock = UnitClock(
            zero + delay.delay - (_lag(u, what) - _lag(reference, what)),
            delay.sd,
            f"correlation of the {what}",
        )
        clocks.append(clock)
        if u.unit.trigger is None:
            continue
        off = u.unit.trigger - clock.offset
        sd = math.hypot(clock.sd, math.hypot(u.unit.trigger_sd, reference.unit.trigger_sd))
        if abs(off) > CONTRADICTION * sd:
            findings.append(
                Finding(
                    "sensors.trigger-lies-ms-put-standard",
                    file=u.unit.name,
                    quantity="trigger",
                    off=1000.0 * off,
                    what=what,
                    sd=1000.0 * sd,
                )
            )
    return clocks, findings


def _trigger(unit: CrashUnit) -> float:
    if unit.trigger is None or not math.isfinite(unit.trigger):
        raise DataError(
            "sensors.no-trigger" if unit.trigger is None else "sensors.trigger-not-finite",
            file=unit.name,
            quantity="trigger",
            trigger=unit.trigger,
        )
    check_sd(unit.trigger_sd, "trigger_sd", "s", unit.name)
    return unit.trigger


def _trigger_within(u: UnitChannels) -> float:
    trigger = _trigger(u.unit)
    parts = (*u.accelerometers, *(() if u.gyro is None else (u.gyro,)))
    start, end = min(c.start for c in parts), max(c.end for c in parts)
    if not start - OUTSIDE <= trigger <= end + OUTSIDE:
        raise DataError(
            "sensors.trigger-not-within-record",
            file=u.unit.name,
            quantity="trigger",
            trigger=trigger,
            start=start,
            end=end,
        )
    return trigger


def _lag(u: UnitChannels, what: str) -> float:
    """What the part's own low-pass delays slow signals by: the time constant of its single pole."""
    triad = u.unit.gyro if what == RATES else u.unit.accelerometers[-1]
    assert triad is not None
    bandwidth = triad.uncertainty.bandwidth
    return time_constant(bandwidth) if 0.0 < bandwidth < math.inf else 0.0


def _delay(reference: UnitChannels, u: UnitChannels) -> tuple[Delay, str]:
    """Best of what both have: lengths do not know of mountings, and bodies turn everywhere alike.

    The widest range is used, as what is held at the end of a range has no shape.
    """
    pairs = [(FORCE, reference.accelerometers, u.accelerometers)]
    if not _lacks(reference.unit.gyro) and not _lacks(u.unit.gyro):
        assert reference.gyro is not None and u.gyro is not None
        pairs.append((RATES, (reference.gyro,), (u.gyro,)))
    found, errors = [], []
    for what, first, second in pairs:
        if not (first and second):
            continue
        try:
            found.append((find_delay(_length(first[-1]), _length(second[-1])), what))
        except DataError as error:
            errors.append(error.finding.replace(shown=what))
    if not found:
        raise DataError(
            "sensors.cannot-laid-over" if errors else "sensors.no-triads-to-lay-over",
            file=u.unit.name,
            quantity="time",
            name=reference.unit.name,
            errors=errors,
        )
    return min(found, key=lambda f: f[0].sd)


def _lacks(gyro: RecordedTriad | None) -> bool:
    """Whether there is no gyro, or none about all axes: the length of its rates is then another."""
    return gyro is None or bool(gyro.absent)


def _length(channels: TriadChannels) -> EvenSignal:
    """Length of the vector on an even grid, on the unit's clock."""
    step = max(g.step for g in channels.groups)
    n = int((channels.end - channels.start) / step * (1.0 + 1e-9)) + 1
    time = channels.start + step * np.arange(n)
    square = np.zeros(n)
    for g in channels.groups:
        for values in g.values.T:
            square += np.interp(time, g.time, values) ** 2
    shift = 0.5 * step if channels.sampling == "mean" else 0.0
    return EvenSignal(channels.start - shift, step, np.sqrt(square)[:, None])
