"""The time column of a table of unknown layout, and its unit."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from strapdown.constants import TIME_UNITS
from strapdown.formats.inference.clock import infer_time_unit, mean_step
from strapdown.formats.inference.conclusion import THRESHOLD
from strapdown.systems.crash_draft.header_words import Heading
from strapdown.systems.crash_draft.parts import Clock
from strapdown.systems.crash_draft.triad_kind import pulse_samples

Array = NDArray[np.float64]

__all__ = ["evenly", "find_clock", "likely_rate"]

RATES = (50.0, 100.0, 200.0, 400.0, 500.0, 1000.0, 2000.0, 5000.0, 10_000.0, 20_000.0)
# Four fifths of the power of a frontal impact, s.
USUAL_PULSE = 0.06

# Steps that differ by less than this of their mean are even; rounding moves a stamp by no more than
# twice what it moves a step, as the line goes through two that are rounded, and a step not twice.
EVEN, ROUNDED, STEP = 0.01, 2.0, 1.05
# Steps of a clock stay within this of their median, but for as many as this part of them.
REGULAR, IRREGULAR_PART = 0.5, 0.05
# Rates at which what happens in a crash is recorded; a sum that grows is no clock.
SLOWEST, FASTEST = 5.0, 200_000.0  # Hz


def find_clock(
    columns: Mapping[str, Array], headings: Mapping[str, Heading]
) -> tuple[Clock, Array | None]:
    """Find the time column.

    Parameters
    ----------
    columns : dict of str to ndarray, (n,)
        Those that hold numbers, in their order.
    headings : dict of str to Heading
        Of each.

    Returns
    -------
    clock : Clock
        With an empty `column` where there is none.
    time : ndarray, (n,), s, or None
        By the likeliest unit.

    Notes
    -----
    A column is a clock where it grows in nearly equal steps. One that is named so goes first;
    of the others one that does not count samples, then the first. A column that grows by one
    counts samples, or milliseconds at 1 kHz: that its name must tell.
    """
    growing = [name for name, values in columns.items() if _grows(values)]
    named = [name for name in growing if headings[name].quantity == "time"]
    plain = [name for name in growing if headings[name].quantity == ""]
    steady = [name for name in plain if not _counts(columns[name])]
    counts = [name for name in plain if _counts(columns[name])]
    for names, why in (
        (named, "by its heading"),
        (steady, "it grows in equal steps"),
        (counts, "it grows in steps of one"),
    ):
        if not names:
            continue
        # A clock that says its unit goes before one that does not.
        name = next((n for n in names if headings[n].unit in TIME_UNITS), names[0])
        return _clock(name, columns[name], headings[name], why)
    return Clock("", "", "no column grows in equal steps", math.nan, math.nan), None


def likely_rate(values: Array) -> float:
    """A usual rate at which the pulse lasts as long as one does, for numbers without time.

    Parameters
    ----------
    values : ndarray, (n, k)
    """
    samples = pulse_samples(values)
    return min(RATES, key=lambda rate: abs(math.log(max(samples, 1) / rate / USUAL_PULSE)))


def _clock(name: str, values: Array, heading: Heading, why: str) -> tuple[Clock, Array]:
    step = mean_step(values)
    if heading.unit in TIME_UNITS:
        factor = TIME_UNITS[heading.unit]
        rate = 1.0 / (step * factor)
        # Dates and times of day are read in ns, which no heading says.
        names_it = heading.unit != "ns" or "ns" in name.lower() or "nano" in name.lower()
        how = f"{why}, which names the unit" if names_it else f"{why}; a time of day, read in ns"
        return Clock(name, heading.unit, how, step, rate), values * factor
    said = infer_time_unit(_whole(values))
    shares = {str(v): p for v, p in ((said.value, said.confidence), *said.alternatives) if v}
    within = {u: p for u, p in shares.items() if SLOWEST <= 1.0 / (step * TIME_UNITS[u]) <= FASTEST}
    # A step of one is a count as often as it is a millisecond.
    total = sum(within.values()) + (1.0 if _counts(values) and heading.quantity != "time" else 0.0)
    best = max(within, key=lambda u: within[u], default="s")
    rate = 1.0 / (step * TIME_UNITS[best])
    told = f"{why}; a step of {step:.6g} {best} is {rate:.5g} samples a second"
    if within and within[best] >= THRESHOLD * total:
        return Clock(name, best, told, step, rate), values * TIME_UNITS[best]
    kinds = [
        f'"{u}" makes {1.0 / (step * TIME_UNITS[u]):.5g} samples a second' for u in within or ("s",)
    ]
    if _counts(values):
        kinds.append(
            "if it counts samples, delete `time` and `time_unit` and write `rate_hz` instead"
        )
    return Clock(name, "", why, step, rate, "; ".join(kinds)), values * TIME_UNITS[best]


def evenly(clock: Clock, time: Array) -> tuple[Clock, Array]:
    """Stamps that are rounded, or written late, made even; others as they are.

    Parameters
    ----------
    clock : Clock
    time : ndarray, (n,), s

    Returns
    -------
    clock : Clock
        With `stated` where the case must state the rate.
    time : ndarray, (n,), s

    Notes
    -----
    The stamps of an even clock that are rounded to q stay within q of it, and their steps differ
    by q. Several samples that are missing bend the line by more.
    """
    count = np.arange(time.size)
    steps = np.diff(time)
    mean = float((time[-1] - time[0]) / max(time.size - 1, 1))
    spread = float(np.ptp(steps)) if steps.size else 0.0
    if not clock.unit or spread <= EVEN * mean:
        return clock, time
    off = time - time[0] - count * mean
    if float(np.ptp(off)) > ROUNDED * spread or spread > STEP * mean:
        return clock, time
    told = f"its stamps are rounded: evenly spaced within {1e3 * float(np.ptp(off)):.2g} ms"
    even = replace(clock, rate=1.0 / mean, stated=True, why=f"{clock.why}; {told}", rate_why=told)
    return even, time[0] + count * mean


def _whole(values: Array) -> NDArray[np.float64] | NDArray[np.int64]:
    """Whole numbers as such: clocks that count ticks say so."""
    whole = np.round(values)
    if np.array_equal(whole, values) and np.abs(values).max(initial=0.0) < 2.0**53:
        return whole.astype(np.int64)
    return values


def _counts(values: Array) -> bool:
    return bool(np.all(np.diff(values) == 1.0))


def _grows(values: Array) -> bool:
    if values.size < 2 or not np.isfinite(values).all():
        return False
    steps = np.diff(values)
    usual = float(np.median(steps))
    if usual <= 0.0 or np.count_nonzero(steps <= 0.0) > IRREGULAR_PART * steps.size:
        return False
    off = np.count_nonzero(np.abs(steps - usual) > REGULAR * usual)
    return bool(off <= max(IRREGULAR_PART * steps.size, 0 if steps.size < 20 else 1))
