"""Units and axes of gyro, accelerometer, magnetometer: stated, named, or inferred; their checks."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import ConfigError, DataError, Finding, add_note, add_warning
from strapdown.formats.arrays import as_rows, numbers
from strapdown.formats.columns import parse_axes, read_name
from strapdown.formats.find_columns import AXES, Column
from strapdown.formats.inference.conclusion import THRESHOLD, Inference
from strapdown.formats.inference.infer import Signals, infer_signals
from strapdown.formats.recording import Questions, RawLog, ReadOptions
from strapdown.formats.vocabularies import APPLE
from strapdown.tables.checks import all_finite
from strapdown.tables.on_disk import let_go, room
from strapdown.units import (
    ACCEL_SUMS,
    ACCEL_UNITS,
    GYRO_SUMS,
    GYRO_UNITS,
    MAG_UNITS,
    RELATIVE_FIELDS,
    factor_of,
    parse_unit,
)

Array = NDArray[np.float64]


def told_by_numbers(
    raw: RawLog,
    found: dict[str, Column],
    options: ReadOptions,
    values: dict[str, Array],
    ticks: NDArray[Any] | None,
    dated: bool,
) -> dict[str, Inference]:
    """Run the inference on the numbers.

    `values` ((n, 3)): from `values_of_triads`. `ticks` ((n,)): stamps as in the file. `dated`:
    whether they were dates, now converted to ns. Returns by quantity.
    """
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
        findings += _overruled(raw, found, triad, options, said.get(f"{triad}_unit"))
        if stated is None or raw.checked or getattr(options, f"{triad}_unit", None):
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
    if (beyond := _beyond_full_scale(said, plain, asked, values["gyro"])) is not None:
        questions.ask(beyond.replace(file=raw.name), gyro_unit=str(beyond.data["likely"]))
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
    # A clock may be local, too, so that this is a unit of nothing else.
    local = re.search(r"\blocal\b", f"{column.source} {raw.units.get(column.source)}")
    if unit in RELATIVE_FIELDS or (triad == "mag" and unit is None and local):
        raise DataError("io.mag-unit-relative", file=raw.name, quantity=triad, source=column.source)
    apple = any(re.sub(r"\W", "", name).lower() in APPLE for name in raw.columns)
    if triad == "accel" and unit is None and apple:
        unit = "-g or g"  # that of CoreMotion, or turned by the application
    if unit is None and read_name(column.source).increment:
        unit = OPEN[triad]
    if unit and " or " in unit:
        raise DataError(
            "io.file-leaves-open-whether", file=raw.name, quantity=triad, unit=unit, triad=triad
        )


def _overruled(
    raw: RawLog,
    found: dict[str, Column],
    triad: str,
    options: ReadOptions,
    likely: Inference | None,
) -> list[Finding]:
    """A warning where the user states another unit than the columns, and the numbers do not."""
    asked = getattr(options, f"{triad}_unit", None)
    columns = [found[f"{triad}_{a}"] for a in AXES]
    stated = {c.unit for c in columns} - {None}
    if not asked or not stated or not stated <= set(UNITS[triad]):
        return []
    unit = parse_unit(asked, triad)
    by_numbers = likely is not None and likely.value == unit and likely.confidence >= LIKELY
    # A sign is that of the axes, and no other unit.
    if by_numbers or {str(one).lstrip("-") for one in stated} == {unit.lstrip("-")}:
        return []
    return [
        Finding(
            "io.unit-stated-otherwise",
            severity="warning",
            file=raw.name,
            quantity=triad,
            unit=unit,
            file_unit=", ".join(sorted(map(str, stated))),
            source=columns[0].source,
        )
    ]


def _stated_unit(
    raw: RawLog, found: dict[str, Column], triad: str, options: ReadOptions
) -> tuple[str, str] | None:
    # A magnetometer has no such option.
    asked = getattr(options, f"{triad}_unit", None)
    if asked:
        return parse_unit(asked, triad), options.why(f"{triad}_unit")
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
        bad = np.zeros(1, dtype=bool) if all_finite(block) else ~np.isfinite(block)
        if bad.all():
            findings.append(_not_used(raw, triad, "io.left-out-without-number"))
        elif triad == "mag" and bad.any() and triad not in raw.sparse:
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
    rows = as_rows(parts)
    if rows is None:
        rows = room((3, parts[0].size))
        for row, part in zip(rows, parts, strict=True):
            row[:] = part
            let_go(rows)
    return rows.T


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
        add_note(findings, "io.axes-mirrored", file=raw.name, quantity="axes", text=text)
    why = f"{text} {'by --axes' if options.axes else 'of this kind of recording'}"
    return Axes(axis, sign, why)


# Statements of a log and its user against the numbers.


UNITS = {"gyro": GYRO_UNITS, "accel": ACCEL_UNITS, "mag": MAG_UNITS}
# Sensor suggested for raw counts, that of most boards (InvenSense, MPU-6000 and MPU-6050 Product
# Specification, revision 3.4, sections 6.1 and 6.2).
_COUNTS = {"gyro": "io.example-gyro-counts", "accel": "io.example-accel-counts"}
_LIKELY_COUNTS = {"gyro": "io.likely-gyro-counts", "accel": "io.likely-accel-counts"}
#: Least probability of an answer that is proposed.
LIKELY = 0.9
# Axes with each axis of the sensor up.
_EXAMPLES = {"z": "x,-y,-z", "y": "-z,x,-y", "-y": "z,x,y", "x": "y,z,-x", "-x": "y,-z,x"}
# Values shown for a unit that the numbers leave open.
_CHOICES = {"gyro": ("rad/s", "deg/s"), "accel": ("m/s2", "g"), "mag": ("uT", "gauss")}


def inferred_unit(
    triad: str, said: dict[str, Inference], values: Array, file: str, findings: list[Finding]
) -> tuple[str, str]:
    """Infer the unit of a triad, which is not stated, from its numbers.

    `triad` ({'gyro', 'accel', 'mag'}). `said`: by quantity. `values` ((n, 3)). `findings`:
    inferences are appended. DataError: the probability does not reach 0.99, or the numbers are
    increments.
    """
    unit = said.get(f"{triad}_unit")
    form = said.get(f"{triad}_form")
    if form is not None and form.value == "increment" and form.confidence > 0.5:
        raise DataError(
            "io.unit-not-stated-of-increments",
            file=file,
            quantity=triad,
            evidence=form.evidence,
            confidence=form.confidence,
            triad=triad,
            sum_of=sum_of(str(unit.value) if unit is not None and unit.settled else None, triad),
        )
    if unit is not None and unit.settled and (form is None or form.value == "rate"):
        code = "io.mag-unit-inferred" if triad == "mag" else "io.unit-inferred"
        findings.append(unit.finding(code, file=file, quantity=f"unit of {triad}", triad=triad))
        return str(unit.value), str(unit)
    raise DataError(_undecided(triad, unit, values).replace(file=file, quantity=triad))


def _undecided(triad: str, unit: Inference | None, values: Array) -> Finding:
    """Make the error for a unit that the user must state, with the values in likely units.

    Raw counts are integers. The unit of a magnetometer has no option.
    """
    finite = np.where(np.isfinite(values), values, np.nan)
    # The evidence for a unit of the gyro is about the rate of the three axes together.
    sizes = np.linalg.norm(finite, axis=1) if triad == "gyro" else np.abs(finite)
    largest = float(np.nanmax(sizes, initial=0.0))
    counts = None
    if triad == "mag":
        code = "io.mag-unit-not-stated" if unit is None else "io.mag-unit-undecided"
    elif bool((values == np.round(values)).all()):
        code = "io.counts-unit-not-stated" if unit is None else "io.counts-unit-undecided"
        unit_of_count = unit_of_counts(unit)
        counts = Finding(
            _COUNTS[triad] if unit_of_count is None else _LIKELY_COUNTS[triad],
            severity="note",
            unit=unit_of_count,
        )
    else:
        code = "io.unit-not-stated" if unit is None else "io.unit-undecided"
    return Finding(
        code,
        triad=triad,
        choices=[_choice(triad, u, largest) for u in _CHOICES[triad]],
        counts=counts,
        **what_numbers_say(unit),
    )


def unit_of_counts(unit: Inference | None) -> str | None:
    """Return the unit of raw counts that the numbers make likely: ``g/16384``."""
    for said in unit.evidence if unit is not None else ():
        if said.code == "io.evidence-counts" and said.data["share"] >= LIKELY:
            return str(said.data["unit"])
    return None


def what_numbers_say(unit: Inference | None) -> dict[str, Any]:
    """Return the data for the message on a unit that the numbers leave open."""
    if unit is None:
        return {}
    return {"threshold": THRESHOLD, "evidence": unit.evidence, "shares": unit.shares()}


def _choice(triad: str, unit: str, largest: float) -> Finding:
    value = largest * UNITS[triad][unit]
    if triad == "gyro":
        turns = np.degrees(value) / 360.0
        return Finding(
            "io.choice-of-gyro-unit", severity="note", unit=unit, largest=largest, turns=turns
        )
    si = "µT" if triad == "mag" else "m/s²"
    return Finding(
        "io.choice-of-unit", severity="note", unit=unit, largest=largest, value=value, si=si
    )


def report_contradictions(
    said: dict[str, Inference],
    units: dict[str, str],
    asked: set[str],
    mirrored: bool,
    file: str,
    findings: list[Finding],
    questions: Questions,
) -> None:
    """Report where the numbers contradict a file or a name.

    `units`: triad to the unit that it is read in. `asked`: triads whose unit the user stated or the
    numbers gave; these are not checked. `mirrored`: the user stated left-handed sensor axes.
    `questions`: a contradiction in a unit, which the user has to decide.
    """
    for triad, unit in units.items():
        other = said.get(f"{triad}_unit")
        form = said.get(f"{triad}_form")
        if triad in asked or other is None:
            continue
        if triad == "gyro" and not other.settled and (likely := _instead(unit, other)):
            fault = Finding(
                "io.contradicts-unit",
                file=file,
                quantity=triad,
                triad=triad,
                unit=unit,
                likely=likely,
                reason=other.finding(),
            )
            questions.ask(fault, gyro_unit=likely)
        if not other.settled:
            continue
        # Sizes of rates alone do not contradict a statement: gravity that rotated with them
        # is, and the steps of a sensor.
        turned = "gyro_axes" in said and said["gyro_axes"].settled
        stepped = any(e.code == "io.evidence-steps-of-sensor" for e in other.evidence)
        if triad == "gyro" and not (turned or stepped):
            continue
        likely = str(other.value)
        kind = form.value if form is not None and form.settled else None
        reason = other
        if unit in SUMS[triad]:
            if kind != "rate" or form is None:
                continue
            code, reason = "io.looks-like-rates", form
        elif kind == "increment" and form is not None:
            code, reason = "io.looks-like-increments", form
            likely = sum_of(likely, triad)
        elif other.value != unit.lstrip("-") and (form is None or form.value == "rate"):
            code = "io.mag-contradicts-unit" if triad == "mag" else "io.contradicts-unit"
        else:
            continue
        fault = Finding(
            code,
            file=file,
            quantity=triad,
            triad=triad,
            unit=unit,
            likely=likely,
            reason=reason.finding(),
        )
        if triad == "mag":
            findings.append(fault)
        else:
            questions.ask(fault, **{f"{triad}_unit": likely})
    gravity = said.get("gravity")
    if "accel" in units and gravity is not None and gravity.settled and gravity.value == "removed":
        add_warning(
            findings, "io.no-gravity", file=file, quantity="accel", reason=gravity.finding()
        )
    axes = said.get("gyro_axes")
    if axes is None or not axes.settled or axes.value == "x,y,z":
        return
    reversed_sense = axes.value == "-x,-y,-z"
    if reversed_sense and mirrored:
        return
    add_warning(
        findings,
        "io.gyro-turns-against-gravity" if reversed_sense else "io.gyro-axes-differ",
        file=file,
        quantity="gyro",
        axes=axes.value,
        reason=axes.finding(),
    )


def _instead(unit: str, inferred: Inference) -> str | None:
    """Return the most probable unit of a gyro if gravity that stood still excludes the stated one.

    The numbers need not settle which of the others it is.
    """
    if not any(
        e.code == "io.evidence-gravity-stood-still" and e.data["unit"] == unit
        for e in inferred.evidence
    ):
        return None
    shares = dict(((inferred.value, inferred.confidence), *inferred.alternatives))
    others = [str(u) for u in shares if u not in (unit, None)]
    return others[0] if others and shares.get(unit, 0.0) < 1.0 - THRESHOLD else None


# Full scale of most gyros, 2000 deg/s per axis, and seconds beyond it. Bodies that turn so fast are
# rare, and gravity then shows their unit.
_FULL_SCALE, _LASTING = np.radians(2000.0), 2.0


def _beyond_full_scale(
    said: dict[str, Inference], units: dict[str, str], asked: set[str], gyro: Array
) -> Finding | None:
    """Doubt a unit by which a gyro is beyond its full scale for seconds; None if it may be right.

    Gravity may turn too little, or accelerations hide it, so that no other unit is settled.
    """
    other, unit, rate = said.get("gyro_unit"), units.get("gyro", ""), said.get("rate")
    if "gyro" in asked or unit not in GYRO_UNITS or other is None or other.settled:
        return None
    if _instead(unit, other):  # asked already
        return None
    if other.value is None or other.value == unit or rate is None or rate.value is None:
        return None
    # A sensor at its full scale is not beyond it.
    full, likely = 1.001 * _FULL_SCALE, GYRO_UNITS[str(other.value)]
    largest = np.maximum(gyro.max(axis=1), -gyro.min(axis=1))
    largest = largest[np.isfinite(largest)]
    beyond = largest[largest * GYRO_UNITS[unit] > full]
    seconds = beyond.size / float(rate.value)
    if seconds < _LASTING or float(np.median(beyond)) * likely > full:
        return None
    usual = float(np.median(beyond))
    return Finding(
        "io.rates-beyond-full-scale",
        quantity="gyro",
        triad="gyro",
        unit=unit,
        likely=other.value,
        seconds=seconds,
        usual=usual * GYRO_UNITS[unit],
        otherwise=usual * likely,
        reason=other.finding(),
    )


def axes_against_gravity(said: dict[str, Inference]) -> Finding:
    """Check by gravity whether axes taken as forward, right, down are correct.

    Returns a note if gravity agrees, with its ``probability``, or is inconclusive.
    """
    up = said.get("up_axis")
    if up is None or up.value is None or up.confidence < 0.5:
        return Finding("io.axes-not-stated", severity="note")
    if up.value == "-z":
        data = {"percent": up.evidence[0].data["percent"], "probability": up.confidence}
        return Finding("io.axes-not-stated", severity="note", data=data)
    axis = str(up.value)
    down = axis[1:] if axis.startswith("-") else f"-{axis}"
    code = {"z": "io.axes-not-stated-z-up", "y": "io.axes-not-stated-y-up"}.get(axis)
    return Finding(
        code or "io.axes-not-stated-other-up",
        up=axis,
        percent=up.evidence[0].data["percent"],
        down=down,
        example=_EXAMPLES[axis],
    )


def report_upside_down(
    said: dict[str, Inference], axis: str, file: str, findings: list[Finding]
) -> None:
    """Report that the stated axes have the sensor upside down.

    `axis`: the sensor axis stated to point down.
    """
    up = said.get("up_axis")
    if up is None or up.value != axis or up.confidence < 0.8:
        return
    add_warning(
        findings,
        "io.axes-upside-down",
        file=file,
        quantity="axes",
        axis=axis,
        evidence=up.evidence[0],
    )


# Increments of angle and velocity, converted to means over their steps.

#: Units of increments, by triad.
SUMS: dict[str, dict[str, float]] = {"gyro": GYRO_SUMS, "accel": ACCEL_SUMS, "mag": {}}
#: Unit choices for a name that states increments without a unit.
OPEN = {triad: " or ".join(units) for triad, units in SUMS.items()}
# Unit of the increments for each unit of rate.
_SUM_OF = {"rad/s": "rad", "deg/s": "deg", "m/s2": "m/s", "g": "g*s"}


def sum_of(unit: str | None, triad: str) -> str:
    """Return the unit of the increments of a rate, or the choice if the unit is unknown."""
    return _SUM_OF.get(unit or "", OPEN[triad])


def intervals(time: Array, kept: NDArray[np.int64]) -> Array:
    """Compute the integration time of each sample; (n, 1), s.

    `time` ((n,), s): stamps of the samples used; at least two. `kept` ((n,)): their indices in the
    log. After a dropped sample an increment still belongs to its own step, not to the gap.
    """
    steps = np.diff(time)
    usual = float(np.median(steps))
    alone = np.diff(kept) > 1
    length = np.concatenate([[usual], np.where(alone, np.minimum(steps, usual), steps)])
    return np.asarray(length[:, None])


def sampling_of_sums(
    summed: set[str], triads: set[str], asked: str | None, file: str, findings: list[Finding]
) -> str:
    """Return the sampling of increments: always means, regardless of the file.

    `summed`: triads that hold increments; not empty. `triads`: triads used. `asked`: sampling
    stated by the user. `findings`: the conversion is appended. ConfigError: the user states
    instantaneous values.
    """
    names = [t for t in ("gyro", "accel") if t in summed]
    if asked and asked.lower() != "mean":
        raise ConfigError(
            "io.sampling-against-increments", quantity="--sampling", asked=asked, names=names
        )
    rest = [t for t in ("gyro", "accel") if t in triads - summed]
    add_note(
        findings,
        "io.increments-made-means-with-rates" if rest else "io.increments-made-means",
        file=file,
        quantity="sampling",
        names=names,
        rest=rest,
    )
    return "mean"
