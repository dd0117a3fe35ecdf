"""Units and axes of gyro, accelerometer and magnetometer: stated, named, or inferred."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import DataError, Finding
from strapdown.formats.arrays import numbers
from strapdown.formats.columns import parse_axes, read_name
from strapdown.formats.find_columns import AXES, Column
from strapdown.formats.inference import Inference, Signals, infer_signals
from strapdown.formats.judge import (
    LIKELY,
    OPEN,
    SUMS,
    UNITS,
    axes_against_gravity,
    inferred_unit,
    report_contradictions,
    report_upside_down,
    unit_of_counts,
)
from strapdown.formats.recording import Questions, RawLog, ReadOptions
from strapdown.formats.vocabularies import APPLE
from strapdown.units import factor_of, parse_unit

__all__ = [
    "Axes",
    "axes_matrix",
    "body_axes",
    "left_out",
    "mirrored",
    "told_by_numbers",
    "units_of_triads",
    "values_of_triads",
]


Array = NDArray[np.float64]


def told_by_numbers(
    raw: RawLog,
    found: dict[str, Column],
    options: ReadOptions,
    values: dict[str, Array],
    ticks: NDArray[Any] | None,
    dated: bool,
) -> dict[str, Inference]:
    """Run the inference on the numbers; skipped for a gyro alone with a stated unit.

    `values` ((n, 3)): from `values_of_triads`. `ticks` ((n,)): stamps as in the file. `dated`:
    whether they were dates, now converted to ns. Returns by quantity.
    """
    if set(values) == {"gyro"} and _stated_unit(raw, found, "gyro", options):
        return {}
    unit = "ns" if dated else None
    if ticks is not None and not dated:
        asked = options.time_unit
        unit = parse_unit(asked, "time") if asked else found["time"].unit
    signals = Signals(
        ticks,
        values["gyro"],
        values.get("accel"),
        values.get("mag"),
        time_unit=unit,
        rate=options.rate or raw.rate,
    )
    said = {i.quantity: i for i in infer_signals(signals)}
    up = said.get("up_axis")
    if up is not None and up.value is not None:
        stated = _stated_unit(raw, found, "accel", options)
        if stated and factor_of(stated[0], {**UNITS["accel"], **SUMS["accel"]}) < 0.0:
            said["up_axis"] = _reversed(up)
    return said


def _reversed(up: Inference) -> Inference:
    """Return which axis points up for a sensor that reads -1 g upward."""
    axis, (first, *rest) = str(up.value), up.evidence
    other = axis[1:] if axis.startswith("-") else f"-{axis}"
    said = (first.replace(axis=other), *rest)
    shares = tuple((axis, share) for _, share in up.alternatives)
    return replace(up, value=other, evidence=said, alternatives=shares)


#: Questions about an accelerometer that its numbers do not answer.
_OPEN = {
    "io.counts-unit-not-stated",
    "io.counts-unit-undecided",
    "io.file-leaves-open-whether",
}


def units_of_triads(
    raw: RawLog,
    found: dict[str, Column],
    options: ReadOptions,
    values: dict[str, Array],
    said: dict[str, Inference],
    findings: list[Finding],
    questions: Questions,
) -> dict[str, tuple[str, str]]:
    """Return the unit of each usable triad, with the reason.

    `values` ((n, 3)). `said`: from `told_by_numbers`. `findings`: dropped triads and inferences are
    appended. `questions`: an unknown unit of the gyro, and statements that the numbers contradict.
    """
    units: dict[str, tuple[str, str]] = {}
    asked: set[str] = set()
    gyro_asked = False
    for triad, block in values.items():
        if triad == "accel" and _without_gravity(found, said):
            findings.append(_not_used(raw, triad, "io.left-out-linear-acceleration"))
            continue
        stated = _stated_unit(raw, found, triad, options)
        if stated is None or raw.checked or _asked_unit(triad, options):
            asked.add(triad)
        try:
            if stated is None:
                _refuse_open(raw, found, triad)
            units[triad] = stated or inferred_unit(triad, said, block, raw.name, findings)
        except DataError as error:
            likely, code = said.get(f"{triad}_unit"), error.finding.code
            sure = likely is not None and likely.value and likely.confidence >= LIKELY
            unit = str(likely.value) if likely is not None and sure else "UNIT"
            counts = unit_of_counts(likely)
            if triad != "gyro":
                # Beside a gyro whose unit is asked, that of its accelerometer is asked, too.
                if triad == "accel" and gyro_asked:
                    if code in _OPEN:
                        questions.ask(error.finding, accel_unit=counts or "UNIT")
                    elif code == "io.unit-undecided" and sure:
                        questions.ask(error.finding, accel_unit=unit)
                findings.append(left_out(raw, triad, error))
                continue
            unit = counts or unit
            if code == "io.unit-not-stated-of-increments":
                unit = str(error.finding.data["sum_of"]).split(" or ")[0]
            questions.ask(error.finding, gyro_unit=unit)
            units[triad] = "rad/s" if unit == "UNIT" else unit, "asked"
            gyro_asked = True
    mirror = options.axes is not None and mirrored(*parse_axes(options.axes))
    plain = {t: u for t, (u, _) in units.items()}
    report_contradictions(said, plain, asked, mirror, raw.name, findings, questions)
    return units


def _without_gravity(found: dict[str, Column], said: dict[str, Inference]) -> bool:
    """Whether a column named linear acceleration has no gravity, as far as numbers decide.

    Beside an angular velocity the name is that of ROS, whose linear acceleration has gravity (REP
    145), so that less is needed to believe it.
    """
    column, gravity = found["accel_x"], said.get("gravity")
    if column.basis != "name" or not read_name(column.source).linear:
        return False
    if gravity is None or gravity.value != "present":
        return True
    of_ros = "angular" in found["gyro_x"].source.lower()
    return not gravity.settled and not (of_ros and gravity.confidence >= LIKELY)


def _refuse_open(raw: RawLog, found: dict[str, Column], triad: str) -> None:
    """Refuse a unit that the file leaves open: the numbers cannot decide between f and -f."""
    column = found[f"{triad}_x"]
    unit = column.unit
    apple = any(re.sub(r"\W", "", name).lower() in APPLE for name in raw.columns)
    if triad == "accel" and unit is None and apple:
        unit = "-g or g"  # that of CoreMotion, or turned by the application
    if unit is None and read_name(column.source).increment:
        unit = OPEN[triad]
    if unit and " or " in unit:
        raise DataError(
            "io.file-leaves-open-whether", file=raw.name, quantity=triad, unit=unit, triad=triad
        )


def _asked_unit(triad: str, options: ReadOptions) -> str | None:
    """Return the unit stated by the user."""
    return {"gyro": options.gyro_unit, "accel": options.accel_unit}.get(triad)


def _stated_unit(
    raw: RawLog, found: dict[str, Column], triad: str, options: ReadOptions
) -> tuple[str, str] | None:
    asked = _asked_unit(triad, options)
    if asked:
        return parse_unit(asked, triad), f"stated by --{triad}-unit"
    columns = [found[f"{triad}_{a}"] for a in AXES]
    units = {c.unit for c in columns}
    known = set(UNITS[triad])
    # Degrees often mean degrees per second: only a name that states increments is trusted.
    if all(read_name(c.source).increment for c in columns):
        known |= set(SUMS[triad])
    unit = columns[0].unit
    if len(units) == 1 and unit is not None and unit in known:
        return unit, columns[0].why if columns[0].basis == "file" else "in its name"
    if units == {None} and triad in raw.triad_units:
        return parse_unit(raw.triad_units[triad], triad), "stated above the table"
    return None


# Unusable triads are dropped, except the gyro, which suffices for an attitude.
OPTIONAL = ("accel", "mag")


def values_of_triads(
    raw: RawLog, found: dict[str, Column], findings: list[Finding]
) -> dict[str, Array]:
    """Return the raw values of each usable triad; (n, 3).

    `findings`: dropped triads are appended. DataError: the values of the gyro cannot be used.
    """
    values = {"gyro": _triad(raw, found, "gyro")}
    for triad in OPTIONAL:
        if not any(f"{triad}_{a}" in found for a in AXES):
            continue
        missing = [f"{triad}_{a}" for a in AXES if f"{triad}_{a}" not in found]
        if missing:
            findings.append(_not_used(raw, triad, "io.left-out-without-axes", missing=missing))
            continue
        try:
            block = _triad(raw, found, triad)
        except DataError as error:
            findings.append(left_out(raw, triad, error))
            continue
        bad = np.zeros(1, dtype=bool) if np.isfinite(block.sum()) else ~np.isfinite(block)
        if bad.all():
            findings.append(_not_used(raw, triad, "io.left-out-without-number"))
        elif triad == "mag" and bad.any():
            empty = int(bad.any(axis=1).sum())
            findings.append(_not_used(raw, triad, "io.left-out-rows-without-number", count=empty))
        else:
            values[triad] = block
    return values


def _not_used(raw: RawLog, triad: str, code: str, **data: Any) -> Finding:
    return Finding(code, file=raw.name, quantity=triad, severity="note", **data)


def _triad(raw: RawLog, found: dict[str, Column], triad: str) -> Array:
    parts = [numbers(raw, found[f"{triad}_{a}"].source, f"{triad}_{a}") for a in AXES]
    # Column by column, as it came and as the Imu table has it.
    return np.stack(parts, dtype=np.float64, casting="unsafe").T


def left_out(raw: RawLog, triad: str, error: DataError) -> Finding:
    """Make the finding that a triad is not used, with the reason."""
    return Finding(
        "io.left-out-unusable",
        file=raw.name,
        row=error.finding.row,
        quantity=triad,
        reason=error.finding,
    )


@dataclass(frozen=True)
class Axes:
    """Sensor axis of each body axis, with its sign and the reason."""

    axis: list[int]
    sign: list[float]
    why: str
    stated: bool = True


def axes_matrix(axis: list[int], sign: list[float]) -> Array:
    """Return the matrix ``C_bs`` from sensor axes to body axes."""
    return np.asarray(np.eye(3)[axis] * np.array(sign)[:, None])


def mirrored(axis: list[int], sign: list[float]) -> bool:
    """Whether axes are a mirror image of the sensor's."""
    return bool(np.linalg.det(axes_matrix(axis, sign)) < 0)


def body_axes(
    raw: RawLog, options: ReadOptions, said: dict[str, Inference], findings: list[Finding]
) -> Axes:
    """Return the axes stated by the user, else by the file, else the sensor's own.

    `said`: inferences from the numbers. `findings`: assumptions and doubts are appended.
    """
    text = options.axes or raw.axes
    if text is None:
        findings.append(axes_against_gravity(said).replace(file=raw.name, quantity="axes"))
        return Axes([0, 1, 2], [1.0, 1.0, 1.0], "as they are", stated=False)
    axis, sign = parse_axes(text)
    if options.axes or text == "x,y,z":
        down = ("-" if sign[2] < 0 else "") + AXES[axis[2]]
        report_upside_down(said, down, raw.name, findings)
    if options.axes and mirrored(axis, sign):
        findings.append(
            Finding(
                "io.axes-mirrored",
                file=raw.name,
                quantity="axes",
                severity="note",
                text=text,
            )
        )
    why = f"{text} {'by --axes' if options.axes else 'of this kind of recording'}"
    return Axes(axis, sign, why)
