"""Stamps of a crash record in seconds: unit, order, origin; faults name their row."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown.constants import TIME_UNITS
from strapdown.errors import DataError, Finding
from strapdown.formats.inference.clock import infer_time_unit
from strapdown.formats.judge import what_numbers_say
from strapdown.formats.stamps import EPOCH

Array = NDArray[np.float64]

__all__ = ["Clock", "last_midnight", "seconds_of"]

DAY = 86_400.0  # s


@dataclass(frozen=True, eq=False)
class Clock:
    """A column of stamps, as recorded.

    Attributes
    ----------
    name : str
        Name of the column.
    stamps : ndarray, (n,)
        Integer or not, as recorded.
    unit : str
        A key of `TIME_UNITS`, or empty if not stated.
    file : str
    row : callable
        Maps the number of a stamp to its row in the file.
    """

    name: str
    stamps: NDArray[Any]
    unit: str
    file: str
    row: Callable[[int], int]


def seconds_of(clock: Clock) -> tuple[Array, list[Finding]]:
    """Convert stamps to increasing seconds.

    Parameters
    ----------
    clock : Clock

    Returns
    -------
    seconds : ndarray, (n,)
        From the origin of the recorder. Where that is more than 1e6 s away (a clock of 1970),
        from the last midnight of that clock before the first stamp, so that records of one
        clock that start at different times keep a common time.
    findings : list of Finding

    Raises
    ------
    DataError
        A stamp is missing, time does not advance, or the unit is not stated and not evident.
    """
    findings: list[Finding] = []
    stamps = clock.stamps
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
    findings.append(
        Finding(
            "io.crash-time-from-midnight",
            file=clock.file,
            quantity=f"time ({clock.name})",
            severity="note",
            midnight=midnight,
            unit=unit,
        )
    )
    return (stamps - midnight).astype(np.float64) * factor, findings


def last_midnight(stamp: float, factor: float) -> float:
    """Return the stamp of the last midnight of a clock before a stamp.

    Parameters
    ----------
    stamp : float or int
        In ticks; integers stay integers.
    factor : float, s
        Duration of a tick.
    """
    day = round(DAY / factor)
    return stamp // day * day


def _evident(clock: Clock, stamps: NDArray[Any], findings: list[Finding]) -> str:
    said = infer_time_unit(stamps)
    where = {"file": clock.file, "quantity": f"time ({clock.name})"}
    if said.settled:
        findings.append(said.finding("io.crash-time-unit-inferred", **where))
        return str(said.value)
    raise DataError("io.crash-time-unit-undecided", **where, **what_numbers_say(said))
