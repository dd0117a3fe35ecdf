"""Time stamps of a log: their unit, their faults, and what can be done about them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown.constants import TIME_UNITS
from strapdown.exceptions import DataError, Finding

Array = NDArray[np.float64]

# Stamps without a stated unit are read as seconds only where that makes a rate at which
# inertial sensors are logged.
PLAUSIBLE_STEP = (1e-5, 0.25)  # s
# Stamps later than this are counted from the first: a double holds a clock of 1970 to no
# better than 0.2 µs.
EPOCH = 1e6  # s
# Counters that wrap in phones and microcontrollers.
COUNTER_BITS = (16, 24, 31, 32)


@dataclass(frozen=True)
class Stamps:
    """Seconds, and what was found on the way to them.

    Attributes
    ----------
    seconds : ndarray, (n,)
    unit : str
    why : str
        What the unit was concluded from.
    keep : ndarray of bool, (n,)
        Rows that are left when those with faulty stamps are dropped.
    findings : list of Finding
    """

    seconds: Array
    unit: str
    why: str
    keep: NDArray[np.bool_]
    findings: list[Finding]


def read_stamps(
    raw: NDArray[Any],
    unit: str | None,
    why: str,
    *,
    file: str,
    first_row: int,
    repair: bool,
) -> Stamps:
    """Turn raw stamps into increasing seconds.

    Parameters
    ----------
    raw : ndarray, (n,)
        Finite numbers.
    unit : str or None
        Where it is known.
    why : str
        How it is known.
    file : str
        For messages.
    first_row : int
        Row of the file of the first stamp.
    repair : bool
        Drop repeated and reversed stamps and undo the wrapping of a counter.

    Returns
    -------
    Stamps

    Raises
    ------
    DataError
        The unit is neither stated nor evident, or time does not advance.
    """
    findings: list[Finding] = []
    ticks = raw - raw[0]  # exact for integers, before a factor can round them
    if not repair:
        _refuse_backward(raw, ticks.astype(np.float64), file, first_row)
    keep, ticks = _repaired(raw, ticks.astype(np.float64), file, findings)
    if unit is None:
        unit, why = _evident_unit(ticks[keep], file)
    factor = TIME_UNITS[unit]
    origin = float(raw[0]) * factor
    if abs(origin) > EPOCH:
        findings.append(
            Finding(
                f"stamps count from a distant origin; time here counts from the first of them, "
                f"{raw[0]} {unit}",
                file=file,
                quantity="time",
            )
        )
        origin = 0.0
    return Stamps(origin + ticks * factor, unit, why, keep, findings)


def _refuse_backward(raw: NDArray[Any], ticks: Array, file: str, first_row: int) -> None:
    steps = np.diff(ticks)
    bad = np.flatnonzero(steps <= 0)
    if not bad.size:
        return
    k = int(bad[0])
    row = first_row + k + 1
    if steps[k] == 0:
        raise DataError(
            f"the stamp {raw[k + 1]} repeats that of the row before ({_times(bad.size)} in all)",
            file=file,
            row=row,
            quantity="time",
            remedy="--repair keeps the first row of each stamp and says how many it dropped",
        )
    if bits := _wrap_bits(ticks, k, raw):
        raise DataError(
            f"time falls from {raw[k]} to {raw[k + 1]}, as a counter of {bits} bits does when it "
            "wraps",
            file=file,
            row=row,
            quantity="time",
            remedy="--repair adds the counter's range from there on",
        )
    raise DataError(
        f"time goes back from {raw[k]} to {raw[k + 1]} ({_times(bad.size)} in all)",
        file=file,
        row=row,
        quantity="time",
        remedy="--repair drops the rows that are not later than every row before them; if two "
        "logs were joined, split them",
    )


def _times(count: int) -> str:
    return "once" if count == 1 else f"{count} times"


def _usual_step(ticks: Array) -> float:
    steps = np.diff(ticks)
    forward = steps[steps > 0]
    return float(np.median(forward)) if forward.size else 0.0


def _wrap_bits(ticks: Array, k: int, raw: NDArray[Any]) -> int | None:
    """Return the width of the counter that wrapped between sample k and the next, if one did."""
    step = float(ticks[k + 1] - ticks[k])
    usual = _usual_step(ticks)
    for bits in COUNTER_BITS:
        if 0.0 < step + 2.0**bits <= 50.0 * usual and float(raw[k]) < 2.0**bits:
            return bits
    return None


def _repaired(
    raw: NDArray[Any], ticks: Array, file: str, findings: list[Finding]
) -> tuple[NDArray[np.bool_], Array]:
    ticks = ticks.copy()
    wraps = 0
    for k in np.flatnonzero(np.diff(ticks) < 0):
        if bits := _wrap_bits(ticks, int(k), raw):
            ticks[k + 1 :] += 2.0**bits
            wraps += 1
    if wraps:
        findings.append(
            Finding(f"the counter wrapped {_times(wraps)}; undone", file=file, quantity="time")
        )
    latest = np.maximum.accumulate(np.concatenate([[-np.inf], ticks[:-1]]))
    keep = ticks > latest
    if dropped := int((~keep).sum()):
        findings.append(
            Finding(
                f"{dropped} row{'s' if dropped > 1 else ''} left out, whose stamp is not later "
                "than every one before",
                file=file,
                quantity="time",
            )
        )
    return keep, ticks


def _evident_unit(ticks: Array, file: str) -> tuple[str, str]:
    steps = np.diff(ticks)
    # Logs that arrive in bursts have a median far from the mean step.
    usual = float(steps.mean()) if steps.size else 0.0
    if PLAUSIBLE_STEP[0] <= usual <= PLAUSIBLE_STEP[1]:
        return "s", f"no unit stated; read as seconds, {1.0 / usual:.4g} Hz on average"
    fitting = [
        u for u, f in TIME_UNITS.items() if PLAUSIBLE_STEP[0] <= usual * f <= PLAUSIBLE_STEP[1]
    ]
    told = (
        "; ".join(
            f"--time-unit {u} makes it {1.0 / (usual * TIME_UNITS[u]):.4g} Hz" for u in fitting
        )
        or "state it with --time-unit, or check that this is the time column"
    )
    raise DataError(
        f"no unit stated, and a mean step of {usual:.6g} is no step in seconds that an inertial "
        "log would have",
        file=file,
        quantity="time",
        remedy=told,
    )
