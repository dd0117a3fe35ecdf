"""Checks of the statements of a log and its user against the numbers; sums as means."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import ConfigError, DataError, Finding
from strapdown.formats.inference import THRESHOLD, Inference
from strapdown.formats.recording import Questions
from strapdown.units import ACCEL_SUMS, ACCEL_UNITS, GYRO_SUMS, GYRO_UNITS, MAG_UNITS

__all__ = ["OPEN", "SUMS", "intervals", "sampling_of_sums", "sum_of"]


Array = NDArray[np.float64]
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
        if triad in asked or other is None or not other.settled:
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
        findings.append(
            Finding("io.no-gravity", file=file, quantity="accel", reason=gravity.finding())
        )
    axes = said.get("gyro_axes")
    if axes is None or not axes.settled or axes.value == "x,y,z":
        return
    reversed_sense = axes.value == "-x,-y,-z"
    if reversed_sense and mirrored:
        return
    findings.append(
        Finding(
            "io.gyro-turns-against-gravity" if reversed_sense else "io.gyro-axes-differ",
            file=file,
            quantity="gyro",
            axes=axes.value,
            reason=axes.finding(),
        )
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
    findings.append(
        Finding(
            "io.axes-upside-down",
            file=file,
            quantity="axes",
            axis=axis,
            evidence=up.evidence[0],
        )
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
    findings.append(
        Finding(
            "io.increments-made-means-with-rates" if rest else "io.increments-made-means",
            file=file,
            quantity="sampling",
            severity="note",
            names=names,
            rest=rest,
        )
    )
    return "mean"
