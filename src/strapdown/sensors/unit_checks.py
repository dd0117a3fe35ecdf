"""What a crash unit must be before anything is made of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from strapdown.exceptions import DataError, Finding
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
        raise DataError(
            "it has no accelerometer",
            file=unit.name,
            quantity="accelerometers",
            remedy="give at least one triad of accelerometers",
        )
    if unit.gyro is None:
        raise DataError(
            "it has no gyro, and a path needs the turning",
            file=unit.name,
            quantity="gyro",
            remedy="name a unit on the same vehicle in gyro_from and synchronise the units, so "
            "that its gyro is borrowed: a rigid vehicle turns everywhere alike; or state how far "
            "it may have turned, CrashUnit(assumed=Assumed(turn_sd_deg=...))",
        )
    forces = tuple(_values(unit, triad, ACCEL) for triad in unit.accelerometers)
    rates = _values(unit, unit.gyro, GYRO)
    time = _stamps(unit.accelerometers[0])
    samplings = set()
    for triad in (*unit.accelerometers, unit.gyro):
        _same_stamps(unit, triad, time)
        samplings.add(str(triad.table.attrs["sampling"]))
    if len(samplings) > 1:
        raise DataError(
            "some of its triads have instantaneous values and some means over their intervals",
            file=unit.name,
            quantity="sampling",
            remedy="bring all to the same kind when the unit is synchronised",
        )
    return UnitArrays(time, forces, rates, samplings.pop(), _gaps(unit, time))


def _values(unit: CrashUnit, triad: RecordedTriad, columns: list[str]) -> Array:
    source = f"{unit.name}, {triad.name}"
    missing = [c for c in columns if c not in triad.table.columns]
    if missing:
        raise DataError(
            f"it has no {' and no '.join(missing)}; a motion in space needs three axes",
            file=source,
            quantity=missing[0],
            remedy="give the missing axis from another part of the unit, leave this part out, or "
            "state how far its velocity may have changed along it, "
            "CrashUnit(assumed=Assumed(delta_v_sd=...))"
            if columns == ACCEL
            else "give the missing axis, or state how far the vehicle may have turned about it, "
            "CrashUnit(assumed=Assumed(turn_sd_deg=...))",
        )
    if triad.table.attrs.get("sampling") not in SAMPLINGS:
        raise DataError(
            f"attrs['sampling'] is {triad.table.attrs.get('sampling')!r}",
            file=source,
            quantity="sampling",
            remedy=f"say {' or '.join(SAMPLINGS)}",
        )
    if len(triad.table) < 2:
        raise DataError(
            f"it has {len(triad.table)} samples",
            file=source,
            quantity="time",
            remedy="give a record of the crash",
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
        f"its {own.size} stamps from {own[0]:.6g} to {own[-1]:.6g} s are not the {time.size} from "
        f"{time[0]:.6g} to {time[-1]:.6g} s of {unit.accelerometers[0].name}",
        file=f"{unit.name}, {triad.name}",
        quantity="time",
        remedy="synchronise the unit first: it brings all triads to the same stamps",
    )


def _gaps(unit: CrashUnit, time: Array) -> tuple[Finding, ...]:
    return tuple(
        Finding(
            f"{1e3 * gap.length:.4g} ms without a sample from {gap.start:.6g} s, where "
            f"{1e3 * gap.usual:.4g} ms are usual",
            file=unit.name,
            row=gap.sample + 1,
            quantity="time",
            remedy="what happened within it is bridged by a straight line; the path and delta-V "
            "after it do not know"
            if gap.end > 0.0
            else "it lies before the trigger, and only shortens what is known of the biases",
        )
        for gap in find_gaps(time)
    )
