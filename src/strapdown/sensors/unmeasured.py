"""Units with unmeasured axes, completed by stated assumptions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.errors import DataError, Finding
from strapdown.sensors.crash_unit import CrashUnit, RecordedTriad
from strapdown.sensors.triad_errors import Triad
from strapdown.sensors.uncertainty import TriadUncertainty
from strapdown.tables import ACCEL, GYRO

Array = NDArray[np.float64]


AXES = ("forward", "right", "down")
TURNS = ("roll", "pitch", "heading")
ALL = (0, 1, 2)
NO_GYRO = "no gyro"
# Smallest squared cosine with which a missing axis makes a vehicle axis an assumed one.
PART = 0.1


def with_filled_axes(unit: CrashUnit) -> CrashUnit:
    """Fill missing axes with zeros where an assumption is given for them.

    Returns its triads list those axes in `absent`, with zero stated errors. The gravity component
    is added where the attitude at rest is known (`prepare_unit`). A unit without missing axes, or
    without `assumed`, is returned unchanged. DataError: its ranges miss different axes, or an
    accelerometer has no axis.
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
    absent = () if unit.gyro is None or unit.lender is not None else unit.gyro.absent
    if absent:
        kept = [
            n for n, p in zip(TURNS, np.diagonal(unmeasured_turns(unit)), strict=True) if p > PART
        ]
        found.append(
            Finding(
                "sensors.roll-assumed" if "roll" in kept else "sensors.turning-assumed",
                severity="note",
                file=unit.name,
                quantity="gyro",
                missing=["gyro"] if len(absent) == 3 else [GYRO[k] for k in absent],
                sd=_said(assumed.sd_of("turn_sd_deg"), kept, TURNS),
                axes=kept,
                begin=assumed.over[0],
                end=assumed.over[1],
                because=because,
            )
        )
    absent = unit.accelerometers[0].absent
    if absent:
        names = [ACCEL[k] for k in absent]
        kept = [
            n for n, p in zip(AXES, np.diagonal(unmeasured_axes(unit)), strict=True) if p > PART
        ]
        found.append(
            Finding(
                "sensors.velocity-change-assumed",
                severity="note",
                file=unit.name,
                quantity=names[0],
                missing=names,
                sd=_said(assumed.sd_of("delta_v_sd"), kept, AXES),
                axes=kept,
                begin=assumed.over[0],
                end=assumed.over[1],
                because=because,
            )
        )
    return found


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
    u = triad.uncertainty
    keep = np.array([k not in absent for k in range(3)])

    def left(name: str) -> Triad:
        x, y, z = np.where(keep, u.axis(name), 0.0)
        return float(x), float(y), float(z)

    x, y, z = np.where(keep, u.axis("full_scale"), np.inf)
    told = replace(
        u,
        full_scale=(float(x), float(y), float(z)),
        noise_density=left("noise_density"),
        bias=left("bias"),
        scale=left("scale"),
        misalignment=left("misalignment"),
        nonlinearity_2=left("nonlinearity_2"),
        g_sensitivity=left("g_sensitivity"),
        vibration_rectification=left("vibration_rectification"),
        quantization=left("quantization"),
    )
    return replace(triad, table=table, uncertainty=told, absent=absent)


def _projection(C: Array, absent: Sequence[int]) -> Array:
    columns = C[:, list(absent)]
    return np.asarray(columns @ columns.T)


def _said(sds: Triad, kept: Sequence[str], names: Sequence[str]) -> list[float]:
    """Return one standard deviation for each axis that is kept, or one for all."""
    numbers = [sds[names.index(n)] for n in kept]
    return numbers[:1] if len(set(numbers)) == 1 else numbers
