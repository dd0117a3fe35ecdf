"""Units with unmeasured axes, completed by stated assumptions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd

from strapdown.errors import DataError, Finding
from strapdown.sensors.crash_unit import CrashUnit, RecordedTriad
from strapdown.sensors.uncertainty import TriadUncertainty
from strapdown.tables import ACCEL, GYRO
from strapdown.tables.checks import Array

AXES = ("forward", "right", "down")
TURNS = ("roll", "pitch", "heading")
ALL = (0, 1, 2)
NO_GYRO = "no gyro"
# Smallest squared cosine with which a missing axis makes a vehicle axis an assumed one.
PART = 0.1


def with_filled_axes(unit: CrashUnit) -> CrashUnit:
    """Fill missing axes with zeros where an assumption is given for them.

    Its triads list those axes in `absent`, with zero stated errors. The gravity component is added
    where the attitude at rest is known (`prepare_unit`). A unit without missing axes, or without
    `assumed`, is returned unchanged. DataError: its ranges miss different axes, or an accelerometer
    has no axis.
    """
    if unit.assumed is None:
        return unit
    gyro = unit.gyro
    forces = unit.accelerometers
    if unit.assumed.delta_v_sd is not None:
        missing = {t.name: _missing(t, ACCEL) for t in forces}
        if len(set(missing.values())) > 1:
            name = next(n for n, m in missing.items() if m)
            raise DataError(
                "sensors.no-another-range-unit",
                file=f"{unit.name}, {name}",
                quantity=ACCEL[missing[name][0]],
                accel=ACCEL[missing[name][0]],
            )
        forces = tuple(_filled(t, ACCEL) for t in forces)
    if gyro is not None and unit.assumed.turn_sd_deg is not None:
        gyro = _filled(gyro, GYRO)
    return replace(unit, accelerometers=forces, gyro=gyro)


def with_gyro(unit: CrashUnit) -> CrashUnit:
    """Add a gyro with zero rate to a unit without one, if `assumed` allows for it."""
    if unit.gyro is not None or unit.gyro_from is not None or not unit.accelerometers:
        return unit
    if unit.assumed is None or unit.assumed.turn_sd_deg is None:
        return unit
    like = unit.accelerometers[0].table
    still = pd.DataFrame(np.zeros((len(like), 3)), index=like.index, columns=GYRO)
    still.attrs = dict(like.attrs)
    return replace(unit, gyro=RecordedTriad(still, TriadUncertainty(), NO_GYRO, absent=ALL))


def unmeasured_axes(unit: CrashUnit) -> Array:
    """Projection onto directions that no accelerometer measures, vehicle axes, (3, 3)."""
    absent = unit.accelerometers[0].absent if unit.accelerometers else ()
    return _projection(unit.mounting.C_vs, absent)


def unmeasured_turns(unit: CrashUnit) -> Array:
    """Projection onto the directions no gyro, own or borrowed, measures, (3, 3)."""
    lender = unit.lender or unit
    absent = () if lender.gyro is None else lender.gyro.absent
    return _projection(lender.mounting.C_vs, absent)


def axis_names(axes: Array, turns: Array) -> tuple[str, ...]:
    """Names of the assumed vehicle axes: forward right down, roll pitch heading."""
    return tuple(
        name
        for names, projection in ((AXES, axes), (TURNS, turns))
        for name, part in zip(names, np.diagonal(projection), strict=True)
        if part > PART
    )


def assumed_findings(unit: CrashUnit) -> list[Finding]:
    """Report the assumptions made for a unit."""
    found = []
    assumed = unit.assumed
    if assumed is None:
        return []
    because = (
        [Finding("sensors.assumed-because", severity="note", because=assumed.because)]
        if assumed.because
        else []
    )
    own = () if unit.gyro is None or unit.lender is not None else unit.gyro.absent
    for absent, columns, directions, names, name in (
        (own, GYRO, unmeasured_turns(unit), TURNS, "turn_sd_deg"),
        (unit.accelerometers[0].absent, ACCEL, unmeasured_axes(unit), AXES, "delta_v_sd"),
    ):
        if not absent:
            continue
        kept = [n for n, p in zip(names, np.diagonal(directions), strict=True) if p > PART]
        sds = [assumed.sd_of(name)[names.index(n)] for n in kept]
        missing = [columns[k] for k in absent]
        if columns is ACCEL:
            code, quantity = "sensors.velocity-change-assumed", missing[0]
        else:
            code = "sensors.roll-assumed" if "roll" in kept else "sensors.turning-assumed"
            quantity, missing = "gyro", ["gyro"] if len(absent) == 3 else missing
        found.append(
            Finding(
                code,
                severity="note",
                file=unit.name,
                quantity=quantity,
                missing=missing,
                # One number for all, where they are equal.
                sd=sds[:1] if len(set(sds)) == 1 else sds,
                axes=kept,
                begin=assumed.over[0],
                end=assumed.over[1],
                because=because,
            )
        )
    return found


def with_common_assumptions(units: Sequence[CrashUnit]) -> list[CrashUnit]:
    """State the same of the vehicle in all its units: the largest of what they assume of an axis.

    Its turning, and the change of velocity of its point along an axis, are one unknown in however
    many units they are stated. Of units prepared by `with_filled_axes` and `with_gyro`, as far as
    each lacks the axis.
    """
    turns, axes = np.zeros(3), np.zeros(3)
    for unit in units:
        if unit.assumed is not None:
            lacks_turn = np.diagonal(unmeasured_turns(unit)) > PART
            if unit.lender is None:
                turns = np.maximum(turns, lacks_turn * unit.assumed.sd_of("turn_sd_deg"))
            lacks_axis = np.diagonal(unmeasured_axes(unit)) > PART
            axes = np.maximum(axes, lacks_axis * unit.assumed.sd_of("delta_v_sd"))
    return [_with_at_least(unit, turns, axes) for unit in units]


def _with_at_least(unit: CrashUnit, turns: Array, axes: Array) -> CrashUnit:
    lender = None if unit.lender is None else _with_at_least(unit.lender, turns, axes)
    if lender is not unit.lender:
        unit = replace(unit, lender=lender)
    assumed = unit.assumed
    if assumed is None:
        return unit
    for name, least, lacks in (
        ("turn_sd_deg", turns, unmeasured_turns(unit)),
        ("delta_v_sd", axes, unmeasured_axes(unit)),
    ):
        stated = np.asarray(assumed.sd_of(name))
        larger = np.where(np.diagonal(lacks) > PART, np.maximum(stated, least), stated)
        if getattr(assumed, name) is not None and (larger > stated).any():
            larger_sds: Any = tuple(larger.tolist())
            assumed = replace(assumed, **{name: larger_sds})
    return unit if assumed is unit.assumed else replace(unit, assumed=assumed)


def _missing(triad: RecordedTriad, columns: Sequence[str]) -> tuple[int, ...]:
    return triad.absent or tuple(k for k, c in enumerate(columns) if c not in triad.table.columns)


def _filled(triad: RecordedTriad, columns: list[str]) -> RecordedTriad:
    absent = _missing(triad, columns)
    # Without any of its columns it is a triad of another kind, which is rejected later.
    if not absent or triad.absent or len(absent) == 3:
        return triad
    table = triad.table.copy()
    there = next(c for k, c in enumerate(columns) if k not in absent)
    for k in absent:
        # Rows missing for another axis are missing for this one as well.
        table[columns[k]] = table[there] * 0.0
    table = table[[*columns, *(c for c in triad.table.columns if c not in columns)]]
    table.attrs = dict(triad.table.attrs)
    keep = np.array([k not in absent for k in range(3)])
    told = triad.uncertainty.mapped(
        lambda sd: np.where(keep, sd, 0.0),
        np.where(keep, triad.uncertainty.axis("full_scale"), np.inf),
    )
    return replace(triad, table=table, uncertainty=told, absent=absent)


def _projection(C: Array, absent: Sequence[int]) -> Array:
    columns = C[:, list(absent)]
    return np.asarray(columns @ columns.T)
