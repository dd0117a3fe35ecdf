"""What a crash unit must be before anything is made of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import DataError, Finding
from strapdown.sensors.crash_unit import CrashUnit, RecordedTriad
from strapdown.tables import ACCEL, GYRO, SAMPLINGS, find_gaps
from strapdown.tables.checks import check_rows, check_time

Array = NDArray[np.float64]

__all__ = ["UnitArrays", "check_unit"]

# Stamps that agree to this part of a step are the same.
SAME_STAMP = 1e-3


@dataclass(frozen=True, eq=False)
class UnitArrays:
    """The numbers of a unit whose triads share their stamps.

    Attributes
    ----------
    time : ndarray, (n,), s
    accelerometers : tuple of ndarray, (n, 3), m/s²
    gyro : ndarray, (n, 3), rad/s
    sampling : str
    findings : tuple of Finding
    """

    time: Array
    accelerometers: tuple[Array, ...]
    gyro: Array
    sampling: str
    findings: tuple[Finding, ...]


def check_unit(unit: CrashUnit) -> UnitArrays:
    """Check a unit and take out its numbers.

    Parameters
    ----------
    unit : CrashUnit
        On the common clock, all triads at the same stamps.

    Returns
    -------
    UnitArrays

    Raises
    ------
    DataError
        There is no accelerometer or no gyro, an axis is missing, a value is not finite, time
        does not advance, or the triads' stamps or kinds of sampling differ.
    """
    if not unit.accelerometers:
        raise DataError("sensors.no-accelerometer", file=unit.name, quantity="accelerometers")
    if unit.gyro is None:
        raise DataError("sensors.no-gyro-path-needs-turning", file=unit.name, quantity="gyro")
    forces = tuple(_values(unit, triad, ACCEL) for triad in unit.accelerometers)
    rates = _values(unit, unit.gyro, GYRO)
    time = _stamps(unit.accelerometers[0])
    samplings = set()
    for triad in (*unit.accelerometers, unit.gyro):
        _same_stamps(unit, triad, time)
        samplings.add(str(triad.table.attrs["sampling"]))
    if len(samplings) > 1:
        raise DataError(
            "sensors.some-triads-instantaneous-values-some", file=unit.name, quantity="sampling"
        )
    return UnitArrays(time, forces, rates, samplings.pop(), _gaps(unit, time))


def _values(unit: CrashUnit, triad: RecordedTriad, columns: list[str]) -> Array:
    source = f"{unit.name}, {triad.name}"
    missing = [c for c in columns if c not in triad.table.columns]
    if missing:
        raise DataError(
            "sensors.accelerometer-axes-missing"
            if columns == ACCEL
            else "sensors.gyro-axes-missing",
            file=source,
            quantity=missing[0],
            missing=missing,
        )
    if triad.table.attrs.get("sampling") not in SAMPLINGS:
        raise DataError(
            "sensors.attrs-sampling",
            file=source,
            quantity="sampling",
            get=triad.table.attrs.get("sampling"),
            samplings=SAMPLINGS,
        )
    if len(triad.table) < 2:
        raise DataError(
            "sensors.too-few-samples-of-unit", file=source, quantity="time", count=len(triad.table)
        )
    check_time(_stamps(triad), source)
    values = np.ascontiguousarray(triad.table[columns].to_numpy(dtype=np.float64))
    check_rows(values, columns, source)
    return values


def _stamps(triad: RecordedTriad) -> Array:
    return np.asarray(triad.table.index.to_numpy(), dtype=np.float64)


def _same_stamps(unit: CrashUnit, triad: RecordedTriad, time: Array) -> None:
    own = _stamps(triad)
    slack = SAME_STAMP * float(np.median(np.diff(time)))
    if own.size == time.size and float(np.abs(own - time).max()) <= slack:
        return
    raise DataError(
        "sensors.triad-stamps-differ",
        file=f"{unit.name}, {triad.name}",
        quantity="time",
        size=own.size,
        own=own[0],
        own_2=own[-1],
        size_2=time.size,
        time=time[0],
        time_2=time[-1],
        name=unit.accelerometers[0].name,
    )


def _gaps(unit: CrashUnit, time: Array) -> tuple[Finding, ...]:
    return tuple(
        Finding(
            "sensors.gap-after-trigger" if gap.end > 0.0 else "sensors.gap-before-trigger",
            file=unit.name,
            row=gap.sample + 1,
            quantity="time",
            length=1000.0 * gap.length,
            start=gap.start,
            usual=1000.0 * gap.usual,
        )
        for gap in find_gaps(time)
    )
