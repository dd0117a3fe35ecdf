"""Tables of what a crash report rests on: records, recorders, sensors, files."""

from __future__ import annotations

import math

import numpy as np

from strapdown.config.crash_case import TriadSpec
from strapdown.constants import STANDARD_GRAVITY, TWO_SIDED_95
from strapdown.report.crash_values import GAP, instant, plain
from strapdown.report.document import TableBlock
from strapdown.sensors.crash_unit import RecordedTriad
from strapdown.systems.crash_case import CaseResult

__all__ = ["inputs_table", "records_table", "sensors_table", "units_table"]

DEG = math.degrees(1.0)


def records_table(result: CaseResult) -> TableBlock:
    """Return what was taken from each record, for which recorder."""
    rows = []
    for spec, unit in zip(result.spec.units, result.units, strict=True):
        for triad_spec, triad in zip(spec.accelerometers, unit.accelerometers, strict=True):
            name = triad.name if "accel" in triad.name else f"{triad.name} accelerometer"
            rows.append(_taken(result, unit.name, name, triad_spec, triad))
        if spec.gyro is not None and unit.gyro is not None:
            rows.append(_taken(result, unit.name, "gyro", spec.gyro, unit.gyro))
    return TableBlock(
        ("recorder", "sensors", "record", "format", "channels", "samples", "rate, Hz", "from, to"),
        tuple(rows),
        text=(0, 1, 2, 3, 4, 7),
        caption="What was taken from each record; channels along the axes x, y, z of the recorder. "
        "Times are those of its own clock.",
    )


def _taken(
    result: CaseResult, unit: str, name: str, spec: TriadSpec, triad: RecordedTriad
) -> tuple[str, ...]:
    record = result.records[spec.path]
    time = triad.table.index.to_numpy(dtype=np.float64)
    given = [
        f"{axis}:{GAP}{spec.channels[axis]}" for axis in ("x", "y", "z") if axis in spec.channels
    ]
    return (
        unit,
        name,
        record.path.name,
        record.format,
        ", ".join(given) or "by their names",
        str(len(time)),
        _rate(triad),
        f"{instant(float(time[0]))} to {instant(float(time[-1]))}",
    )


def _rate(triad: RecordedTriad) -> str:
    rate = 1.0 / float(np.median(np.diff(triad.table.index.to_numpy())))
    return f"{round(rate):d}" if rate >= 1000.0 else f"{rate:.4g}"


def units_table(result: CaseResult) -> TableBlock:
    """Where each recorder sits and how its clock is tied."""
    rows = []
    for unit, at in zip(result.units, result.reconstruction.synchronised.units, strict=True):
        mounting = unit.mounting
        rows.append(
            (
                unit.name,
                " ".join(plain(v, 3) for v in mounting.position)
                + f" ± {TWO_SIDED_95 * mounting.position_sd:.2g}",
                " ".join(plain(v, 1) for v in mounting.angles_deg)
                + f" ± {TWO_SIDED_95 * mounting.angles_sd_deg:.2g}",
                "–" if unit.trigger is None else instant(unit.trigger),
                f"{1e3 * TWO_SIDED_95 * at.time_sd:.2g}",
                at.how,
                unit.gyro_from or ("own" if unit.gyro is not None else "none: assumed"),
            )
        )
    return TableBlock(
        (
            "recorder",
            "forward right down, m",
            "roll pitch heading, deg",
            "trigger on its clock",
            "± ms",
            "clock",
            "gyro",
        ),
        tuple(rows),
        text=(0, 1, 2, 5, 6),
        caption="Mounting points from the vehicle's origin; angles turn vehicle axes into the "
        "recorder's. Bounds hold 95 %.",
    )


def sensors_table(result: CaseResult) -> TableBlock:
    """What is stated of each triad of sensors."""
    rows = []
    for spec, unit in zip(result.spec.units, result.units, strict=True):
        for triad_spec, triad in zip(spec.accelerometers, unit.accelerometers, strict=True):
            rows.append(_sensor(unit.name, triad_spec.sensor, triad, STANDARD_GRAVITY, "g"))
        if spec.gyro is not None and unit.gyro is not None:
            rows.append(_sensor(unit.name, spec.gyro.sensor, unit.gyro, 1.0 / DEG, "°/s"))
    return TableBlock(
        (
            "recorder",
            "triad",
            "sensor",
            "rate, Hz",
            "range, ±",
            "bias",
            "scale, %",
            "misalignment, mrad",
            "noise of a sample",
        ),
        tuple(rows),
        text=(0, 1, 2),
        caption="Standard deviations as stated in the case or its sensors' data sheets, before a "
        "rest has told more; the largest of the three axes.",
    )


def _sensor(
    unit: str, sensor: str | None, triad: RecordedTriad, size: float, symbol: str
) -> tuple[str, ...]:
    stated = triad.uncertainty
    step = float(np.median(np.diff(triad.table.index.to_numpy())))
    full = max(stated.axis("full_scale"))
    return (
        unit,
        triad.name,
        "stated in the case" if sensor is None else sensor.replace("\\", "/").rsplit("/", 1)[-1],
        _rate(triad),
        "not stated" if math.isinf(full) else f"{full / size:.3g} {symbol}",
        f"{max(stated.axis('bias')) / size:.2g} {symbol}",
        f"{100.0 * max(stated.axis('scale')):.2g}",
        f"{1e3 * max(stated.axis('misalignment')):.2g}",
        f"{max(stated.axis('noise_density')) / math.sqrt(step) / size:.2g} {symbol}",
    )


def inputs_table(result: CaseResult) -> TableBlock:
    """Return the files that the report rests on."""
    rows = []
    for item in result.inputs:
        for file, digest in zip(item.files, item.digests, strict=True):
            rows.append((item.role, file.name, digest))
    return TableBlock(
        ("role", "file", "SHA-256"),
        tuple(rows),
        text=(0, 1, 2),
        caption="Copies stand in the folder of the report under inputs/.",
    )
