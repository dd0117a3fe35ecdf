"""Units of one vehicle prepared together: who has no rest is levelled by who has."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from strapdown.crash.at_point import AtPoint, at_point
from strapdown.crash.entry import Entry
from strapdown.crash.path import reconstruct_path
from strapdown.crash.prepare import prepare_unit
from strapdown.crash.prepare_options import checked_options
from strapdown.errors import DataError, Finding
from strapdown.sensors.synchronise import SynchronisedUnit, SynchronisedUnits

# Over which the attitude that is lent is read, in samples.
READ = 2


def prepare_together(
    together: SynchronisedUnits,
    point: Sequence[float],
    gravity: float,
    options: Mapping[str, Any],
) -> list[AtPoint]:
    """Prepare units and move them to a point.

    Parameters
    ----------
    together : SynchronisedUnits
        Each over what it covers itself.
    point : sequence of float, (3,), m
        Vehicle axes, from the vehicle's origin.
    gravity : float, m/s²
    options : mapping
        Of `prepare_unit`, for all; under the name of a unit, a mapping of its own ones.

    Returns
    -------
    list of AtPoint
        In the order of the units. A unit that borrows its gyro and is not levelled by an option,
        and whose record begins after the lender's rest, is levelled by the lender: its roll and
        pitch carried on by the gyro to where the borrower's record begins, with their standard
        deviation.

    Raises
    ------
    DataError, ConfigError
        As `prepare_unit`.
    """
    names = {u.unit.name for u in together.units}
    common = {k: v for k, v in options.items() if k not in names}
    turning = [u.unit.name for u in together.units if u.lender is None and _turns(u)]
    done: dict[str, AtPoint] = {}
    for unit in sorted(together.units, key=lambda u: u.lender is not None):
        own = {"gravity": gravity, **common, **options.get(unit.unit.name, {})}
        if unit.lender is not None and own.get("levelling") is None:
            lent = _attitude_at_start(unit, done[unit.lender])
            if lent is not None:
                own["levelling"] = lent
        hint = _gyro_to_borrow(unit, turning)
        try:
            prepared = prepare_unit(unit.unit, **checked_options(own))
        except DataError as error:
            if hint is None or error.finding.quantity != "gyro":
                raise
            raise DataError(
                "crash.no-gyro-for-path",
                file=error.finding.file,
                row=error.finding.row,
                quantity="gyro",
                reason=error.finding,
                hint=hint,
            ) from None
        if hint is not None:
            prepared = replace(prepared, findings=(*prepared.findings, hint))
        done[unit.unit.name] = at_point(prepared, point, time_sd=unit.time_sd)
    return [done[u.unit.name] for u in together.units]


def _turns(unit: SynchronisedUnit) -> bool:
    """Whether it has a gyro that measures something, and is no stand-in for an assumption."""
    gyro = unit.unit.gyro
    return gyro is not None and len(gyro.absent) < 3


def _gyro_to_borrow(unit: SynchronisedUnit, turning: Sequence[str]) -> Finding | None:
    """For a unit without gyro that takes none from another, of which there are some."""
    if unit.lender is not None or _turns(unit) or not turning:
        return None
    return Finding(
        "crash.gyro-not-borrowed" if len(turning) == 1 else "crash.gyros-not-borrowed",
        file=unit.unit.name,
        quantity="gyro",
        turning=turning,
        lender=turning[0],
    )


def _attitude_at_start(
    unit: SynchronisedUnit, lender: AtPoint
) -> tuple[float, float, float] | None:
    """Roll, pitch and their sd in deg where a record begins, or None where it has its own rest."""
    begin = float(unit.accelerometers[0].triad.table.index[0])
    rest = lender.rest
    if rest is None or rest.grade == "steady" or begin <= rest.end:
        return None
    step = float(lender.imu.index[1] - lender.imu.index[0])
    still = Entry(time=begin, velocity=(0.0, 0.0, 0.0), heading_deg=0.0)
    path = reconstruct_path(
        lender.imu,
        lender.effects,
        lender.levelling,
        rest.end,
        still,
        window=(begin, begin + READ * step),
        zeroed_at_rest=True,
    )
    attitude, sd = path.table.iloc[path.anchor], path.sd.iloc[path.anchor]
    return (
        float(attitude["roll"]),
        float(attitude["pitch"]),
        math.hypot(float(sd["roll"]), float(sd["pitch"])) / math.sqrt(2.0),
    )
