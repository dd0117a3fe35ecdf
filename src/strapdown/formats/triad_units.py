"""Units and axes of gyro, accelerometer, magnetometer: stated, named, or inferred; their checks."""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown.constants import STANDARD_GRAVITY, Array
from strapdown.errors import ConfigError, DataError, Finding, add_note, add_warning, check_choice
from strapdown.formats.arrays import as_rows
from strapdown.formats.columns import parse_axes, read_name
from strapdown.formats.find_columns import AXES, Column, reference, stated_word
from strapdown.formats.inference.conclusion import THRESHOLD, Inference
from strapdown.formats.inference.infer import Signals, infer_signals
from strapdown.formats.recording import Questions, RawLog, ReadOptions
from strapdown.formats.vocabularies import APPLE
from strapdown.tables import SAMPLINGS
from strapdown.tables.checks import all_finite
from strapdown.tables.on_disk import let_go, room
from strapdown.units import (
    ACCEL_SUMS,
    ACCEL_UNITS,
    COUNTS,
    GYRO_SUMS,
    GYRO_UNITS,
    INFERRED,
    MAG_UNITS,
    RELATIVE_FIELDS,
    factor_of,
    parse_unit,
)

#: Units of a triad, and of its increments.
UNITS = {"gyro": GYRO_UNITS, "accel": ACCEL_UNITS, "mag": MAG_UNITS}
SUMS: dict[str, dict[str, float]] = {"gyro": GYRO_SUMS, "accel": ACCEL_SUMS, "mag": {}}
#: Unit choices for a name that states increments without a unit.
OPEN = {triad: " or ".join(units) for triad, units in SUMS.items()}
# Unit of the increments for each unit of rate.
_SUM_OF = {"rad/s": "rad", "deg/s": "deg", "m/s2": "m/s", "g": "g*s"}
#: Least probability of an answer that is proposed.
LIKELY = 0.9


@dataclass
class LogInUse:
    """A log on its way to a recording: what is stated, found and inferred.

    `found`: column of each quantity. `findings`, `questions`: what is reported and asked. `values`
    ((n, 3)): of each usable triad, as in the file. `said`: inferences from them, by quantity.
    """

    raw: RawLog
    options: ReadOptions
    questions: Questions
    found: dict[str, Column]
    findings: list[Finding]
    values: dict[str, Array] = field(default_factory=dict)
    said: dict[str, Inference] = field(default_factory=dict)

    def note(self, code: str, quantity: str, **data: Any) -> None:
        """Add a note about the log."""
        add_note(self.findings, code, file=self.raw.name, quantity=quantity, **data)

    def warn(self, code: str, quantity: str, **data: Any) -> None:
        """Add a warning about the log, unless `data` have another severity."""
        add_warning(self.findings, code, file=self.raw.name, quantity=quantity, **data)

    def columns(self, triad: str) -> list[Column]:
        """Return the columns of the three axes."""
        return [self.found[f"{triad}_{a}"] for a in AXES]


def told_by_numbers(log: LogInUse, ticks: NDArray[Any] | None, dated: bool) -> dict[str, Inference]:
    """Run the inference on the numbers; by quantity.

    `ticks` ((n,)): stamps as in the file. `dated`: whether they were dates, now converted to ns.
    """
    unit = "ns" if dated else None
    if ticks is not None and not dated:
        asked = log.options.time_unit
        unit = parse_unit(asked, "time") if asked else log.found["time"].unit
    rate = log.options.rate or log.raw.rate
    triads = {t: _in_usual_unit(log, t) for t in ("gyro", "accel", "mag")}
    signals = Signals(ticks, **triads, time_unit=unit, rate=rate)
    said = {i.quantity: i for i in infer_signals(signals)}
    up = said.get("up_axis")
    if up is not None and up.value is not None:
        stated = _stated_unit(log, "accel")
        if stated and factor_of(stated[0], {**UNITS["accel"], **SUMS["accel"]}) < 0.0:
            said["up_axis"] = _reversed(up)
    return said


def _in_usual_unit(log: LogInUse, triad: str) -> Array | None:
    """Return the values of a triad; in SI where they are stated in a unit that none infers."""
    values = log.values.get(triad)
    if values is None or triad not in UNITS or _usual(log, triad):
        return values
    unit, _ = _stated_unit(log, triad) or ("", "")
    return np.asarray(values * factor_of(unit, UNITS[triad]))


def _usual(log: LogInUse, triad: str) -> bool:
    """Whether the unit of a triad is not stated, or one that numbers alone may show."""
    stated = _stated_unit(log, triad)
    rare = UNITS[triad].keys() - {*INFERRED[triad]}
    return stated is None or stated[0] not in rare


def _opposite(axis: str) -> str:
    return axis[1:] if axis.startswith("-") else f"-{axis}"


def _reversed(up: Inference) -> Inference:
    """Return which axis points up for a sensor that reads -1 g upward."""
    axis, (first, *rest) = str(up.value), up.evidence
    other = _opposite(axis)
    said = (first.replace(axis=other), *rest)
    shares = tuple((axis, share) for _, share in up.alternatives)
    return replace(up, value=other, evidence=said, alternatives=shares)


#: Questions about an accelerometer that its numbers do not answer.
_OPEN = {"io.counts-unit-not-stated", "io.counts-unit-undecided", "io.file-leaves-open-whether"}


def units_of_triads(log: LogInUse) -> dict[str, tuple[str, str]]:
    """Return the unit of each usable triad, with the reason.

    Dropped triads and inferences are reported; an unknown unit of the gyro, and statements that the
    numbers contradict, are asked.
    """
    units: dict[str, tuple[str, str]] = {}
    asked: set[str] = set()
    gyro_asked = mixed = _axis_in_other_unit(log, stated=bool(log.options.gyro_unit))
    for triad in log.values:
        if triad == "gyro" and mixed:
            units[triad] = log.options.gyro_unit or "rad/s", "asked"
            continue
        if triad == "accel" and _without_gravity(log):
            log.note("io.left-out-linear-acceleration", triad)
            continue
        stated = _stated_unit(log, triad)
        likely = log.said.get(f"{triad}_unit")
        _report_overruled(log, triad, likely)
        if stated is None or log.raw.checked or getattr(log.options, f"{triad}_unit", None):
            asked.add(triad)
        try:
            if stated is None:
                _refuse_open(log, triad)
            units[triad] = stated or _inferred_unit(log, triad)
        except DataError as error:
            code = error.finding.code
            sure = likely is not None and likely.value and likely.confidence >= LIKELY
            unit = str(likely.value) if likely is not None and sure else "UNIT"
            counts = unit_of_counts(likely)
            if triad == "accel" and code in ("io.unit-unknown-word", "io.unit-not-sure"):
                log.questions.ask(error.finding, accel_unit=counts or unit)
                continue
            if triad != "gyro":
                # Beside a gyro whose unit is asked, that of its accelerometer is asked, too.
                if triad == "accel" and gyro_asked:
                    if code in _OPEN:
                        log.questions.ask(error.finding, accel_unit=counts or "UNIT")
                    elif code == "io.unit-undecided" and sure:
                        log.questions.ask(error.finding, accel_unit=unit)
                _leave_out(log, triad, error)
                continue
            unit = counts or unit
            if code == "io.unit-not-stated-of-increments":
                unit = str(error.finding.data["sum_of"]).split(" or ")[0]
            log.questions.ask(error.finding, gyro_unit=unit)
            units[triad] = "rad/s" if unit == "UNIT" else unit, "asked"
            gyro_asked = True
    plain = {t: u for t, (u, _) in units.items()}
    if mixed:
        return units
    _report_noise_of_axes(log)
    _report_contradictions(log, plain, asked)
    _ask_beyond_full_scale(log, plain, asked)
    if not any(q.quantity == "gyro" for q in log.questions.questions):
        _report_scale_of_gyro(log, plain["gyro"])
    if "accel" in plain and not any(q.quantity == "accel" for q in log.questions.questions):
        _report_scale_of_force(log, plain["accel"])
    return units


#: A gyro beyond these of what gravity shows, and a steady force beyond these of gravity, are of
#: another scale: 3 % and 80 mg are those of consumer sensors (MPU-6050 data sheet, section 6.2); an
#: arm in step with its rotation adds to the first.
GYRO_SCALES, FORCE_SCALES = (0.8, 1.25), (0.88, 1.12)
#: Causes of a scale, by what the right values are relative to those read: powers of two are
#: sensitivities of other full scales, in deg/s or in g.
_RANGES = tuple(2.0**k for k in (-5, -4, -3, -2, -1, 1, 2, 3, 4, 5))


def _cause(low: float, high: float) -> Finding:
    """Return what may have made a factor between two bounds, as a note."""
    for factor in (np.degrees(1.0), np.radians(1.0)):
        if low < factor < high:
            return Finding("io.cause-degrees", severity="note", factor=float(factor))
    factor = next((f for f in _RANGES if low < f < high), None)
    code = "io.cause-unknown" if factor is None else "io.cause-range"
    return Finding(code, severity="note", factor=factor)


def _axis_in_other_unit(log: LogInUse, *, stated: bool) -> bool:
    """Ask about a gyro of which one axis is in another unit than the others, by turning gravity.

    `stated`: whether the user states the unit of all three, so that it is a warning.
    """
    scale = log.said.get("gyro_scale")
    said = scale.evidence[0] if scale is not None else None
    if said is None or said.code != "io.evidence-axis-in-other-unit":
        return False
    column = log.found[f"gyro_{said.data['axis']}"]
    fault = Finding(
        "io.gyro-axis-in-other-unit",
        severity="warning" if stated else "error",
        file=log.raw.name,
        quantity=f"gyro_{said.data['axis']}",
        name=column.source,
        unit=said.data["unit"],
        others=said.data["others"],
        reason=said,
    )
    if stated:
        log.findings.append(fault)
    else:
        log.questions.ask(fault)
    return True


#: Samples of a piece whose noise is measured, the most pieces, and the fewest.
_OF_NOISE, _PIECES, _FEWEST_PIECES = 50, 400, 8
#: How far the noise of one axis may be from 57.3 times that of the others, or a 57.3th, and that of
#: those from each other: gyros of one chip agree within 2, a vibrating car makes 9 of it.
_NOISE_OF_UNIT, _NOISE_ALIKE = 2.0, 3.0


def _report_noise_of_axes(log: LogInUse) -> None:
    """Warn of a gyro whose one axis has the noise of another unit, where gravity does not turn."""
    scale, gyro = log.said.get("gyro_scale"), log.values["gyro"]
    count = len(gyro) // _OF_NOISE
    if (scale is not None and scale.value is not None) or count < _FEWEST_PIECES:
        return
    pieces = gyro[: count * _OF_NOISE].reshape(count, _OF_NOISE, 3)[:: 1 + count // _PIECES]
    steps = np.median(np.abs(np.diff(pieces.astype(np.float64), n=2, axis=1)), axis=1)
    # The calmer pieces have the least of the motion.
    steps = steps[np.isfinite(steps).all(axis=1)]
    noise = np.quantile(steps, 0.25, axis=0) if len(steps) >= _FEWEST_PIECES else np.zeros(3)
    if not (noise > 0.0).all():
        return
    for k in range(3):
        others = np.delete(noise, k)
        ratio = float(noise[k] / np.sqrt(others.prod()))
        off = np.degrees(1.0) / max(ratio, 1.0 / ratio)
        alike = others.max() < _NOISE_ALIKE * others.min()
        if alike and 1.0 / _NOISE_OF_UNIT < off < _NOISE_OF_UNIT:
            units = ("deg/s", "rad/s") if ratio > 1.0 else ("rad/s", "deg/s")
            log.warn(
                "io.gyro-axis-noise-of-other-unit",
                f"gyro_{AXES[k]}",
                name=log.found[f"gyro_{AXES[k]}"].source,
                ratio=ratio,
                unit=units[0],
                others=units[1],
            )


def _report_scale_of_gyro(log: LogInUse, unit: str) -> None:
    """Warn of a gyro that explains the turning of gravity at another scale alone."""
    scale = log.said.get("gyro_scale")
    if scale is None or scale.value is None or unit in SUMS["gyro"]:
        return
    # In SI already, where the unit is one that none infers.
    of_unit = factor_of(unit, GYRO_UNITS) if _usual(log, "gyro") else 1.0
    said = scale.evidence[0].data
    factor, low, high = (float(said[k]) / of_unit for k in ("scale", "low", "high"))
    if low > GYRO_SCALES[1] or high < GYRO_SCALES[0]:
        log.warn(
            "io.gyro-scale",
            "gyro",
            factor=factor,
            low=low,
            high=high,
            percent=said["percent"],
            unit=unit,
            cause=_cause(low, high),
        )


#: Length of a piece that may be steady, s, the largest spread of its norm, the fewest pieces, also
#: as a share of all, and the spread of the middle half of their norms.
_PIECE, _QUIET, _FEWEST, _OF_ALL, _ALIKE = 0.5, 0.02, 10, 0.1, 0.05
#: Sizes of a steady force, relative to gravity, that are those of another scale; less is of none.
_OTHER_SCALES = (0.2, 40.0)


def _report_scale_of_force(log: LogInUse, unit: str) -> None:
    """Warn of an accelerometer whose force, where its size is steady, is not gravity."""
    rate, gravity = log.said.get("rate"), log.said.get("gravity")
    removed = gravity is not None and gravity.value == "removed"
    if rate is None or rate.value is None or removed or unit in SUMS["accel"]:
        return
    values = log.values["accel"]
    size = max(round(_PIECE * float(rate.value)), 5)
    count = len(values) // size
    some = 1 + count // 2000
    pieces = values[: count * size].reshape(count, size, 3)[::some]
    if len(pieces) < _FEWEST:
        return
    norms = np.linalg.norm(pieces, axis=2)
    norm = norms.mean(axis=1)
    quiet = np.isfinite(norm) & (norms.std(axis=1) < _QUIET * norm)
    if quiet.sum() < max(_FEWEST, _OF_ALL * len(pieces)):
        return
    low, middle, high = map(float, np.quantile(norm[quiet], (0.25, 0.5, 0.75)))
    if high - low > _ALIKE * middle:
        return
    usual = middle * abs(factor_of(unit, ACCEL_UNITS))
    of_gravity = usual / STANDARD_GRAVITY
    if FORCE_SCALES[0] < of_gravity < FORCE_SCALES[1] or not (
        _OTHER_SCALES[0] < of_gravity < _OTHER_SCALES[1]
    ):
        return
    low, high = FORCE_SCALES[0] / of_gravity, FORCE_SCALES[1] / of_gravity
    log.warn(
        "io.force-scale",
        "accel",
        size=usual,
        seconds=float(quiet.sum()) * some * _PIECE,
        unit=unit,
        factor=1.0 / of_gravity,
        cause=_cause(low, high),
    )


def _without_gravity(log: LogInUse) -> bool:
    """Whether a column named linear acceleration has no gravity, as far as numbers decide.

    Beside an angular velocity the name is that of ROS, whose linear acceleration has gravity (REP
    145), so that less is needed to believe it.
    """
    column, gravity = log.found["accel_x"], log.said.get("gravity")
    if column.basis != "name" or not read_name(column.source).linear:
        return False
    if gravity is None or gravity.value != "present":
        return True
    of_ros = "angular" in log.found["gyro_x"].source.lower()
    return not gravity.settled and not (of_ros and gravity.confidence >= LIKELY)


def _refuse_open(log: LogInUse, triad: str) -> None:
    """Refuse a unit that the file leaves open: the numbers cannot decide between f and -f.

    Refused is also one that the file states in a word which is not known.
    """
    raw, column = log.raw, log.found[f"{triad}_x"]
    unit = column.unit
    # A clock may be local, too, so that this is a unit of nothing else.
    local = re.search(r"\blocal\b", f"{column.source} {raw.units.get(column.source)}")
    if unit in RELATIVE_FIELDS or (triad == "mag" and unit is None and local):
        raise raw.fault("io.mag-unit-relative", triad, source=column.source)
    word = next((w for c in log.columns(triad) if (w := stated_word(raw, c.source, triad))), "")
    if word.lower() in COUNTS:
        raise DataError(
            _undecided(triad, log.said.get(f"{triad}_unit"), log.values[triad]).replace(
                file=raw.name, quantity=triad
            )
        )
    if word:
        raise raw.fault("io.unit-unknown-word", triad, source=column.source, text=word, triad=triad)
    plain = {re.sub(r"\W", "", name).lower() for name in raw.columns}
    # Gravity under the short name of Core Motion, and the force that was summed from it.
    summed = any(one.code == "io.force-of-linear-and-gravity" for one in raw.findings)
    apple = (summed and "grx" in plain) or not plain.isdisjoint(APPLE)
    if triad == "accel" and unit is None and apple:
        unit = "-g or g"  # that of CoreMotion, or turned by the application
    if unit is None and read_name(column.source).increment:
        unit = OPEN[triad]
    if unit and " or " in unit:
        raise raw.fault("io.file-leaves-open-whether", triad, unit=unit, triad=triad)


def _report_overruled(log: LogInUse, triad: str, likely: Inference | None) -> None:
    """Warn where the user states another unit than the columns, and the numbers do not."""
    asked, columns = getattr(log.options, f"{triad}_unit", None), log.columns(triad)
    stated = {c.unit for c in columns} - {None}
    if not asked or not stated or not stated <= set(UNITS[triad]):
        return
    unit = parse_unit(asked, triad)
    by_numbers = likely is not None and likely.value == unit and likely.confidence >= LIKELY
    # A sign is that of the axes, and no other unit.
    if by_numbers or {str(one).lstrip("-") for one in stated} == {unit.lstrip("-")}:
        return
    of_file = ", ".join(sorted(map(str, stated)))
    log.warn(
        "io.unit-stated-otherwise", triad, unit=unit, file_unit=of_file, source=columns[0].source
    )


def _stated_unit(log: LogInUse, triad: str) -> tuple[str, str] | None:
    # A magnetometer has no such option.
    if asked := getattr(log.options, f"{triad}_unit", None):
        return parse_unit(asked, triad), log.options.why(f"{triad}_unit")
    columns = log.columns(triad)
    units = {c.unit for c in columns}
    known = set(UNITS[triad])
    # Degrees often mean degrees per second: only a name that states increments is trusted.
    if all(read_name(c.source).increment for c in columns):
        known |= set(SUMS[triad])
    unit = columns[0].unit
    if unit is not None and (units == {unit} or len(units) > 1) and units <= known:
        return unit, columns[0].why if columns[0].basis == "file" else "in its name"
    if units == {None} and triad in log.raw.triad_units:
        return parse_unit(log.raw.triad_units[triad], triad), "stated above the table"
    return None


def values_of_triads(log: LogInUse) -> dict[str, Array]:
    """Return the raw values of each usable triad; (n, 3).

    Others are dropped and reported, except the gyro, which suffices for an attitude. DataError: the
    values of the gyro cannot be used.
    """
    values = {"gyro": _triad(log, "gyro")}
    for triad in ("accel", "mag"):
        missing = [f"{triad}_{a}" for a in AXES if f"{triad}_{a}" not in log.found]
        if len(missing) == len(AXES):
            continue
        if missing:
            log.note("io.left-out-without-axes", triad, missing=missing)
            continue
        try:
            block = _triad(log, triad)
        except DataError as error:
            _leave_out(log, triad, error)
            continue
        bad = np.zeros(1, dtype=bool) if all_finite(block) else ~np.isfinite(block)
        if bad.all():
            log.note("io.left-out-without-number", triad)
        elif triad == "mag" and bad.any() and triad not in log.raw.sparse:
            empty = int(bad.any(axis=1).sum())
            log.note("io.left-out-rows-without-number", triad, count=empty)
        else:
            values[triad] = block
    return values


def _triad(log: LogInUse, triad: str) -> Array:
    columns = log.columns(triad)
    parts = [
        column.values(log.raw, f"{triad}_{a}") for column, a in zip(columns, AXES, strict=True)
    ]
    stated, known = [str(c.unit) for c in columns], UNITS[triad]
    by_user = getattr(log.options, f"{triad}_unit", None)
    if len({*stated}) > 1 and known.keys() >= {*stated} and not by_user:
        first = stated[0]
        parts = [p * (known[u] / known[first]) for p, u in zip(parts, stated, strict=True)]
        log.note("io.axes-in-units-of-their-own", triad, triad=triad, units=stated, unit=first)
    # Column by column, as it came and as the Imu table has it.
    rows = as_rows(parts)
    if rows is None:
        rows = room((3, parts[0].size))
        for row, part in zip(rows, parts, strict=True):
            row[:] = part
            let_go(rows)
    return rows.T


def _leave_out(log: LogInUse, triad: str, error: DataError) -> None:
    """Report that a triad is not used, with the reason."""
    fault = error.finding
    log.warn("io.left-out-unusable", triad, row=fault.row, reason=fault)


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


# Axes with each axis of the sensor up.
_EXAMPLES = {"z": "x,-y,-z", "y": "-z,x,-y", "-y": "z,x,y", "x": "y,z,-x", "-x": "y,-z,x"}


def body_axes(log: LogInUse) -> Axes:
    """Return the axes stated by the user, else by the file, else the sensor's own.

    Whether gravity agrees with them, or shows others, is reported.
    """
    options, up = log.options, log.said.get("up_axis")
    text = options.axes or log.raw.axes
    if text is None:
        if up is None or up.value is None or up.confidence < 0.5:
            log.note("io.axes-not-stated", "axes")
        else:
            axis, percent = str(up.value), up.evidence[0].data["percent"]
            if axis == "-z":
                data = {"percent": percent, "probability": up.confidence}
                log.note("io.axes-not-stated", "axes", data=data)
            elif options.axes_by_gravity:
                example = _EXAMPLES[axis]
                data = {"axes": example, "up": axis, "percent": percent}
                log.note("attitude.axes-by-gravity", "axes", data=data)
                log.options = replace(options, axes=example)
                return body_axes(log)
            else:
                code = {"z": "io.axes-not-stated-z-up", "y": "io.axes-not-stated-y-up"}.get(axis)
                log.warn(
                    code or "io.axes-not-stated-other-up",
                    "axes",
                    up=axis,
                    percent=percent,
                    down=_opposite(axis),
                    example=_EXAMPLES[axis],
                )
        return Axes([0, 1, 2], [1.0, 1.0, 1.0], "as they are", stated=False)
    axis_of, sign = parse_axes(text)
    if options.axes or text == "x,y,z":
        down = ("-" if sign[2] < 0 else "") + AXES[axis_of[2]]
        if up is not None and up.value == down and up.confidence >= 0.8:
            log.warn("io.axes-upside-down", "axes", axis=down, evidence=up.evidence[0])
    if options.axes and mirrored(axis_of, sign):
        log.note("io.axes-mirrored", "axes", text=text)
    why = f"{text} {'by --axes' if options.axes else 'of this kind of recording'}"
    return Axes(axis_of, sign, why)


# Statements of a log and its user against the numbers.


# Sensor suggested for raw counts, that of most boards (InvenSense, MPU-6000 and MPU-6050 Product
# Specification, revision 3.4, sections 6.1 and 6.2).
_COUNTS = {"gyro": "io.example-gyro-counts", "accel": "io.example-accel-counts"}
_LIKELY_COUNTS = {"gyro": "io.likely-gyro-counts", "accel": "io.likely-accel-counts"}
# Values shown for a unit that the numbers leave open.
_CHOICES = {"gyro": ("rad/s", "deg/s"), "accel": ("m/s2", "g", "mg"), "mag": ("uT", "gauss")}


def _inferred_unit(log: LogInUse, triad: str) -> tuple[str, str]:
    """Infer the unit of a triad, which is not stated, from its numbers; the inference is reported.

    DataError: the probability does not reach 0.99, or the numbers are increments.
    """
    file, unit, form = log.raw.name, log.said.get(f"{triad}_unit"), log.said.get(f"{triad}_form")
    if form is not None and form.value == "increment" and form.confidence > 0.5:
        raise DataError(
            "io.unit-not-stated-of-increments",
            file=file,
            quantity=triad,
            evidence=form.evidence,
            confidence=form.confidence,
            triad=triad,
            sum_of=_sum_of(str(unit.value) if unit is not None and unit.settled else None, triad),
        )
    if unit is not None and unit.settled and (form is None or form.value == "rate"):
        code = "io.mag-unit-inferred" if triad == "mag" else "io.unit-inferred"
        log.findings.append(unit.finding(code, file=file, quantity=f"unit of {triad}", triad=triad))
        return str(unit.value), str(unit)
    undecided = _undecided(triad, unit, log.values[triad])
    raise DataError(undecided.replace(file=file, quantity=triad))


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
        of_count = unit_of_counts(unit)
        example = _COUNTS[triad] if of_count is None else _LIKELY_COUNTS[triad]
        counts = Finding(example, severity="note", unit=of_count)
    else:
        code = "io.unit-not-stated" if unit is None else "io.unit-undecided"
    choices = [_choice(triad, u, largest) for u in _CHOICES[triad]]
    return Finding(code, triad=triad, choices=choices, counts=counts, **what_numbers_say(unit))


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
    data: dict[str, Any] = {"unit": unit, "largest": largest}
    if triad == "gyro":
        turns = np.degrees(value) / 360.0
        return Finding("io.choice-of-gyro-unit", severity="note", **data, turns=turns)
    si = "µT" if triad == "mag" else "m/s²"
    return Finding("io.choice-of-unit", severity="note", **data, value=value, si=si)


def _report_contradictions(log: LogInUse, units: dict[str, str], asked: set[str]) -> None:
    """Report where the numbers contradict a file or a name; a contradiction in a unit is asked.

    `units`: triad to the unit that it is read in. `asked`: triads whose unit the user stated or the
    numbers gave; these are not checked.
    """
    said = log.said
    for triad, unit in units.items():
        other = said.get(f"{triad}_unit")
        form = said.get(f"{triad}_form")
        if triad in asked or other is None or not _usual(log, triad):
            continue
        code, why = "io.contradicts-unit", other
        data: dict[str, Any] = {"file": log.raw.name, "quantity": triad, "triad": triad}
        data["unit"] = unit
        if (
            triad == "gyro"
            and not other.settled
            and (instead := _instead(unit, other, said.get("gyro_scale")))
        ):
            fault = Finding("io.contradicts-unit", **data, likely=instead, reason=other.finding())
            log.questions.ask(fault, gyro_unit=instead)
        elif triad == "gyro" and "accel" in units and (stood := _stood_still(unit, other)):
            log.warn("io.gravity-stood-still", "accel", reason=stood)
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
        if unit in SUMS[triad]:
            if kind != "rate" or form is None:
                continue
            code, why = "io.looks-like-rates", form
        elif kind == "increment" and form is not None:
            code, why = "io.looks-like-increments", form
            likely = _sum_of(likely, triad)
        elif other.value != unit.lstrip("-") and (form is None or form.value == "rate"):
            code = "io.mag-contradicts-unit" if triad == "mag" else code
        else:
            continue
        fault = Finding(code, **data, likely=likely, reason=why.finding())
        if triad == "mag":
            log.findings.append(fault)
        else:
            log.questions.ask(fault, **{f"{triad}_unit": likely})
    gravity = said.get("gravity")
    if "accel" in units and gravity is not None and gravity.settled and gravity.value == "removed":
        log.warn("io.no-gravity", "accel", reason=gravity.finding())
    axes = said.get("gyro_axes")
    if axes is None or not axes.settled or axes.value == "x,y,z":
        return
    reversed_sense, stated = axes.value == "-x,-y,-z", log.options.axes
    # Left-handed axes that the user states turn the sense of rotation.
    if reversed_sense and stated is not None and mirrored(*parse_axes(stated)):
        return
    log.warn(
        "io.gyro-turns-against-gravity" if reversed_sense else "io.gyro-axes-differ",
        "gyro",
        axes=axes.value,
        columns=_other_columns(log, str(axes.value)),
        reason=axes.finding(),
    )


def _other_columns(log: LogInUse, axes: str) -> str:
    """Return the statement by which the gyro has the axes of the accelerometer: ``x,y,-z``.

    Of columns by quantity, with a minus before one that counts the other way.
    """
    columns = []
    for axis, along in zip(AXES, axes.split(","), strict=True):
        if axis != along:
            of = log.found[f"gyro_{along[-1]}"]
            reversed_ = (of.sign < 0.0) != along.startswith("-")
            minus = "-" if reversed_ else ""
            columns.append(f"gyro_{axis}={minus}{reference(log.raw, of.source)}")
    return ",".join(columns)


def _stood_still(unit: str, inferred: Inference) -> Finding | None:
    """Return the evidence that gravity stood still where a gyro in this unit turns it."""
    of_unit = (e for e in inferred.evidence if e.data.get("unit") == unit)
    return next((e for e in of_unit if e.code == "io.evidence-gravity-stood-still"), None)


def _instead(unit: str, inferred: Inference, scale: Inference | None = None) -> str | None:
    """Return the most probable unit of a gyro if gravity that stood still excludes the stated one.

    The numbers need not settle which of the others it is.
    """
    if _stood_still(unit, inferred) is None:
        return None
    shares = dict(((inferred.value, inferred.confidence), *inferred.alternatives))
    others = [str(u) for u in shares if u not in (unit, None)]
    if not others or shares.get(unit, 0.0) >= 1.0 - THRESHOLD:
        return None
    # None of them, where gravity that turned shows a factor that none has.
    said = scale.evidence[0].data if scale is not None and scale.value is not None else None
    fits = said is None or said["low"] < GYRO_UNITS[others[0]] < said["high"]
    return others[0] if fits else "UNIT"


# Full scale of most gyros, 2000 deg/s per axis, and seconds beyond it. Bodies that turn so fast are
# rare, and gravity then shows their unit.
_FULL_SCALE, _LASTING = np.radians(2000.0), 2.0


def _ask_beyond_full_scale(log: LogInUse, units: dict[str, str], asked: set[str]) -> None:
    """Ask for a unit by which a gyro is beyond its full scale for seconds.

    Gravity may turn too little, or accelerations hide it, so that no other unit is settled.
    """
    gyro, rate = log.values["gyro"], log.said.get("rate")
    other, unit = log.said.get("gyro_unit"), units.get("gyro", "")
    if "gyro" in asked or unit not in INFERRED["gyro"] or other is None or other.settled:
        return
    if _instead(unit, other):  # asked already
        return
    if other.value is None or other.value == unit or rate is None or rate.value is None:
        return
    # A sensor at its full scale is not beyond it.
    full, likely = 1.001 * _FULL_SCALE, GYRO_UNITS[str(other.value)]
    largest = np.maximum(gyro.max(axis=1), -gyro.min(axis=1))
    largest = largest[np.isfinite(largest)]
    beyond = largest[largest * GYRO_UNITS[unit] > full]
    seconds = beyond.size / float(rate.value)
    if seconds < _LASTING or float(np.median(beyond)) * likely > full:
        return
    usual = float(np.median(beyond))
    fault = Finding(
        "io.rates-beyond-full-scale",
        file=log.raw.name,
        quantity="gyro",
        triad="gyro",
        unit=unit,
        likely=other.value,
        seconds=seconds,
        usual=usual * GYRO_UNITS[unit],
        otherwise=usual * likely,
        reason=other.finding(),
    )
    log.questions.ask(fault, gyro_unit=str(other.value))


# Increments of angle and velocity, converted to means over their steps.


def _sum_of(unit: str | None, triad: str) -> str:
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


def sampling_of(log: LogInUse, units: dict[str, tuple[str, str]]) -> str:
    """Return the sampling stated by the user, else by the file, else instantaneous.

    Increments are always means. Conversions and assumptions are reported. ConfigError: the sampling
    is unknown, or the user states instantaneous values of increments.
    """
    asked = (log.options.sampling or "").lower()
    plain = [t for t in ("gyro", "accel") if t in units]
    names = [t for t in plain if units[t][0] in SUMS[t]]
    if names:
        if asked and asked != "mean":
            raise ConfigError(
                "io.sampling-against-increments",
                quantity="--sampling",
                asked=log.options.sampling,
                names=names,
            )
        rest = [t for t in plain if t not in names]
        log.note(
            "io.increments-made-means-with-rates" if rest else "io.increments-made-means",
            "sampling",
            names=names,
            rest=rest,
        )
        return "mean"
    if not (asked := asked or (log.raw.sampling or "").lower()):
        log.note("io.sampling-taken-as-instantaneous", "sampling")
        return "instantaneous"
    check_choice("io.sampling-unknown", SAMPLINGS, quantity="--sampling", asked=asked)
    return asked
