"""Time stamps of a log: units, faults and repairs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown.constants import TIME_UNITS
from strapdown.errors import DataError, Finding
from strapdown.formats.clocks import unrolled
from strapdown.formats.inference.clock import infer_time_unit, wrap_bits
from strapdown.formats.inference.conclusion import THRESHOLD
from strapdown.formats.recording import Origin

Array = NDArray[np.float64]

# Range of steps of inertial sensors.
PLAUSIBLE_STEP = (1e-5, 0.25)  # s
# Later stamps are counted from the first: a double resolves a clock of 1970 to only 0.2 µs.
EPOCH = 1e6  # s


@dataclass(frozen=True)
class Stamps:
    """Stamps in seconds, with findings.

    Attributes
    ----------
    seconds : ndarray, (n,)
    unit : str
    why : str
        Reason for the unit.
    keep : ndarray of bool, (n,)
        Rows that remain when those with faulty stamps are dropped.
    origin : Origin
        The raw stamp at time zero.
    findings : list of Finding
    """

    seconds: Array
    unit: str
    why: str
    keep: NDArray[np.bool_]
    origin: Origin
    findings: list[Finding]


def read_stamps(
    raw: NDArray[Any],
    unit: str | None,
    why: str,
    *,
    file: str,
    row: Callable[[int], int],
    repair: bool,
    origin: Origin | None = None,
    only_seconds: bool = False,
) -> Stamps:
    """Turn raw stamps into increasing seconds.

    Parameters
    ----------
    raw : ndarray, (n,)
        Finite numbers.
    unit : str or None
        If known.
    why : str
        Source of the unit.
    file : str
        For messages.
    row : callable
        Maps the number of a stamp to its row in the file.
    repair : bool
        Drop repeated and reversed stamps, and unwrap a counter.
    origin : Origin, optional
        Count from here, as another log does; by default from zero, or from the first stamp if
        zero is far away.
    only_seconds : bool
        Infer no unit other than seconds from the numbers.

    Returns
    -------
    Stamps

    Raises
    ------
    DataError
        The unit is not stated and not evident, or time does not advance.
    """
    findings: list[Finding] = []
    # Small and unsigned integers would overflow for negative steps.
    stamps = raw.astype(np.int64) if raw.dtype.kind in "iub" else raw.astype(np.float64)
    if unit in (None, "s"):
        whole, weeks = unrolled(stamps.astype(np.float64, copy=False))
        if weeks:
            stamps, unit = whole, "s"
            findings.append(
                Finding(
                    "io.seconds-of-week-unrolled",
                    file=file,
                    row=row(weeks[0]),
                    quantity="time",
                    severity="note",
                )
            )
    ticks = (stamps - stamps[0]).astype(np.float64)  # exact, before a factor rounds it
    if not repair:
        _refuse_backward(stamps, ticks, file, row)
    keep, ticks = _repaired(stamps, ticks, file, findings)
    if unit is None:
        unit, why = _evident_unit(stamps[keep], file, findings, only_seconds)
    elif (usual := _mean_step(ticks[keep]) * TIME_UNITS[unit]) > 0 and not (
        PLAUSIBLE_STEP[0] <= usual <= 4 * PLAUSIBLE_STEP[1]
    ):
        findings.append(
            Finding(
                "io.stated-time-unit-implausible",
                file=file,
                quantity="time",
                unit=unit,
                usual=1.0 / usual,
            )
        )
    factor = TIME_UNITS[unit]
    first = stamps[0].item()
    if origin is None:
        far = abs(first) * factor > EPOCH
        origin = Origin(first if far else 0, unit)
        if far:
            findings.append(
                Finding(
                    "io.time-from-first-stamp",
                    file=file,
                    quantity="time",
                    severity="note",
                    first=first,
                    unit=unit,
                )
            )
    return Stamps(_since(first, unit, origin) + ticks * factor, unit, why, keep, origin, findings)


def _since(stamp: float, unit: str, origin: Origin) -> float:
    """Return seconds from an origin to a stamp; exact if both count whole ticks of one unit."""
    if unit == origin.unit:
        return (stamp - origin.stamp) * TIME_UNITS[unit]
    return stamp * TIME_UNITS[unit] - origin.stamp * TIME_UNITS[origin.unit]


def _mean_step(ticks: Array) -> float:
    # Logs that arrive in bursts have a median far from the mean step.
    return float((ticks[-1] - ticks[0]) / (ticks.size - 1)) if ticks.size > 1 else 0.0


def _refuse_backward(
    stamps: NDArray[Any], ticks: Array, file: str, row: Callable[[int], int]
) -> None:
    steps = np.diff(ticks)
    bad = np.flatnonzero(steps <= 0)
    if not bad.size:
        return
    k = int(bad[0])
    here, then = stamps[k], stamps[k + 1]
    if steps[k] == 0:
        raise DataError(
            "io.stamp-repeated",
            file=file,
            row=row(k + 1),
            quantity="time",
            then=then,
            count=bad.size,
        )
    if bits := wrap_bits(stamps[k], steps[k], _usual_step(steps)):
        raise DataError(
            "io.time-counter-wraps",
            file=file,
            row=row(k + 1),
            quantity="time",
            here=here,
            then=then,
            bits=bits,
        )
    raise DataError(
        "io.time-goes-back",
        file=file,
        row=row(k + 1),
        quantity="time",
        here=here,
        then=then,
        count=bad.size,
    )


def _usual_step(steps: Array) -> float:
    forward = steps[steps > 0]
    return float(np.median(forward)) if forward.size else 0.0


def _repaired(
    stamps: NDArray[Any], ticks: Array, file: str, findings: list[Finding]
) -> tuple[NDArray[np.bool_], Array]:
    steps = np.diff(ticks)
    usual = _usual_step(steps)
    added = np.zeros(ticks.size)
    for k in np.flatnonzero(steps < 0):
        if bits := wrap_bits(stamps[k], steps[k], usual):
            added[k + 1] = 2.0**bits
    if wraps := int(np.count_nonzero(added)):
        ticks = ticks + np.cumsum(added)
        findings.append(
            Finding(
                "io.counter-wrapped-undone",
                file=file,
                quantity="time",
                severity="note",
                count=wraps,
            )
        )
    latest = np.maximum.accumulate(np.concatenate([[-np.inf], ticks[:-1]]))
    keep = ticks > latest
    if dropped := int((~keep).sum()):
        findings.append(
            Finding(
                "io.rows-not-later-left-out",
                file=file,
                quantity="time",
                severity="note",
                count=dropped,
            )
        )
    return keep, ticks


def _evident_unit(
    stamps: NDArray[Any], file: str, findings: list[Finding], only_seconds: bool
) -> tuple[str, str]:
    said = infer_time_unit(stamps)
    if said.settled and (said.value == "s" or not only_seconds):
        unit = str(said.value)
        if unit != "s":
            findings.append(said.finding("io.time-unit-inferred", file=file, quantity="time"))
        return unit, str(said)
    usual = _mean_step((stamps - stamps[0]).astype(np.float64))
    shares = {str(v): p for v, p in ((said.value, said.confidence), *said.alternatives) if v}
    choices = [
        Finding(
            "io.choice-of-time-unit",
            severity="note",
            unit=u,
            rate_hz=1.0 / (usual * TIME_UNITS[u]),
            share=p,
        )
        for u, p in shares.items()
        if p >= 1e-3 and usual > 0
    ]
    raise DataError(
        "io.time-unit-undecided" if choices else "io.time-unit-of-no-step",
        file=file,
        quantity="time",
        step=usual,
        threshold=THRESHOLD,
        choices=choices,
    )
