"""What the numbers say against, or instead of, what a log and its user state."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from strapdown.constants import ACCEL_UNITS, GYRO_UNITS, MAG_UNITS
from strapdown.errors import DataError, Finding
from strapdown.formats.inference import THRESHOLD, Inference
from strapdown.formats.summed import SUMS, sum_of

Array = NDArray[np.float64]
UNITS = {"gyro": GYRO_UNITS, "accel": ACCEL_UNITS, "mag": MAG_UNITS}
# Of numbers that may be raw counts; the sensor is that of most boards (InvenSense, MPU-6000 and
# MPU-6050 Product Specification, revision 3.4, sections 6.1 and 6.2).
_COUNTS = {
    "gyro": "as in deg/s/131 (an MPU-6050 at ±250 deg/s; 65.5, 32.8, 16.4 at its wider ranges)",
    "accel": "as in g/16384 (an MPU-6050 at ±2 g; 8192, 4096, 2048 at its wider ranges)",
}
# What is shown of the numbers of a unit that nothing tells.
_CHOICES = {"gyro": ("rad/s", "deg/s"), "accel": ("m/s2", "g"), "mag": ("uT", "gauss")}


def inferred_unit(
    triad: str, said: dict[str, Inference], values: Array, file: str, findings: list[Finding]
) -> tuple[str, str]:
    """The unit of a triad that nothing states, from its numbers.

    Parameters
    ----------
    triad : {'gyro', 'accel', 'mag'}
    said : dict of str to Inference
        By quantity.
    values : ndarray, (n, 3)
    file : str
    findings : list of Finding
        What was concluded is added.

    Returns
    -------
    unit, why : str

    Raises
    ------
    DataError
        The numbers do not tell it to 0.99, or they are increments.
    """
    unit = said.get(f"{triad}_unit")
    form = said.get(f"{triad}_form")
    if form is not None and form.value == "increment" and form.confidence > 0.5:
        raise DataError(
            "io.unit-not-stated-these-look",
            file=file,
            quantity=triad,
            evidence=form.evidence,
            confidence=form.confidence,
            flag=_flag(triad),
            sum_of=sum_of(_likely(unit), triad),
        )
    if unit is not None and unit.settled and (form is None or form.value == "rate"):
        findings.append(
            Finding(
                "io.message",
                file=file,
                quantity=f"unit of {triad}",
                message=str(unit),
                remedy_text=f"if not, state it with {_flag(triad)}",
            )
        )
        return str(unit.value), str(unit)
    raise DataError(
        "io.message",
        file=file,
        quantity=triad,
        message=not_told(unit),
        remedy_text=_choices(triad, values),
    )


def _likely(unit: Inference | None) -> str | None:
    return str(unit.value) if unit is not None and unit.settled else None


def _flag(triad: str) -> str:
    return "the column's name" if triad == "mag" else f"--{triad}-unit"


def not_told(unit: Inference | None) -> str:
    """What is said of a unit that the numbers do not tell."""
    if unit is None:
        return "the unit is not stated"
    pairs = [(v, p) for v, p in ((unit.value, unit.confidence), *unit.alternatives) if p > 0.005]
    shares = ", ".join(f"{v or 'none of those known'} {p:.2g}" for v, p in pairs)
    return (
        f"the unit is not stated, and the numbers do not tell it to {THRESHOLD:g} "
        f"({'; '.join(unit.evidence)}; probability: {shares})"
    )


def _choices(triad: str, values: Array) -> str:
    largest = float(np.nanmax(np.abs(np.where(np.isfinite(values), values, np.nan)), initial=0.0))
    told = " or ".join(
        f"{u} (the largest value, {largest:.4g}, is then "
        f"{_in_plain_words(triad, largest * UNITS[triad][u])})"
        for u in _CHOICES[triad]
    )
    if triad not in _COUNTS or not bool((values == np.round(values)).all()):
        return f"state it with {_flag(triad)}: {told}"
    return (
        f"state it with {_flag(triad)}: {told}; all are whole numbers: if they are raw counts, say "
        f"how many are a unit, {_COUNTS[triad]}"
    )


def _in_plain_words(triad: str, value: float) -> str:
    if triad == "gyro":
        return f"{np.degrees(value) / 360.0:.3g} turns a second"
    return f"{value:.3g} {'µT' if triad == 'mag' else 'm/s²'}"


def report_contradictions(
    said: dict[str, Inference],
    units: dict[str, str],
    asked: set[str],
    mirrored: bool,
    file: str,
    findings: list[Finding],
) -> None:
    """Say where the numbers speak against what a file or a name states.

    Parameters
    ----------
    said : dict of str to Inference
    units : dict of str to str
        Triad to the unit that it is read with.
    asked : set of str
        Triads whose unit the user stated or the numbers gave: of these nothing is said.
    mirrored : bool
        The user said that the sensor's axes are left-handed.
    file : str
    findings : list of Finding
    """
    for triad, unit in units.items():
        other = said.get(f"{triad}_unit")
        # The numbers of a gyro speak only where gravity was seen to turn with it.
        heard = triad != "gyro" or _settled(said, "gyro_axes")
        form = said.get(f"{triad}_form")
        if triad in asked or not heard or other is None or not other.settled:
            continue
        value = str(other.value)
        told = form.value if form is not None and form.settled else None
        if unit in SUMS[triad]:
            if told != "rate":
                continue
            what = f"the numbers look like rates, not increments of each sample; {form}"
        elif told == "increment":
            what = f"the numbers look like increments of each sample, not rates; {form}"
            value = sum_of(value, triad)
        elif other.value != unit.lstrip("-") and (form is None or form.value == "rate"):
            what = f"the numbers contradict {unit}, which is stated; {other}"
        else:
            continue
        remedy = f"if the statement is wrong, say {_flag(triad)} {value}"
        findings.append(
            Finding("io.message", file=file, quantity=triad, message=what, remedy_text=remedy)
        )
    gravity = said.get("gravity")
    if "accel" in units and gravity is not None and gravity.settled and gravity.value == "removed":
        findings.append(Finding("io.gravity-not", file=file, quantity="accel", gravity=gravity))
    axes = said.get("gyro_axes")
    if axes is None or not axes.settled or axes.value == "x,y,z":
        return
    if axes.value == "-x,-y,-z":
        if mirrored:
            return
        what = "turns the other way than gravity does in the accelerometer: its sense of rotation "
        what += "is reversed, or the sensor's axes are left-handed"
        remedy = "for left-handed axes say so with --axes, as in --axes x,y,-z"
    else:
        what = f"its {axes.value} stand along x,y,z of the accelerometer"
        remedy = "correct the columns that are reversed or exchanged (--columns exchanges them)"
    findings.append(
        Finding(
            "io.message", file=file, quantity="gyro", message=f"{what}; {axes}", remedy_text=remedy
        )
    )


def _settled(said: dict[str, Inference], quantity: str) -> bool:
    return quantity in said and said[quantity].settled


def told_of_up(said: dict[str, Inference]) -> tuple[str, str] | None:
    """What gravity says of axes that are taken for forward, right, down; None if it agrees.

    Parameters
    ----------
    said : dict of str to Inference

    Returns
    -------
    what, remedy : str, or None
    """
    up = said.get("up_axis")
    if up is None or up.value is None or up.value == "-z" or up.confidence < 0.5:
        return None
    axis = str(up.value)
    down = axis[1:] if axis.startswith("-") else f"-{axis}"
    examples = {
        "-z": "x,-y,-z (forward, left, up) or y,x,-z (right, forward, up, as a phone on its back)",
        "-y": "-z,x,-y (a phone upright, its screen to the rear)",
        "y": "z,x,y",
        "-x": "y,z,-x",
        "x": "y,-z,x",
    }
    share = up.evidence[0].rsplit(" in ", 1)[-1]
    what = (
        f"; but the sensor's {axis} points up in {share}, by gravity (a sensor that reports it "
        "with the other sign, as iOS does, is read as upside down)"
    )
    remedy = (
        f"which axis is forward gravity cannot say; down is {down} then: state --axes, as in "
        f"--axes {examples[down]}; or state --accel-unit -m/s2 or -g"
    )
    return what, remedy


def report_upside_down(
    said: dict[str, Inference], axis: str, file: str, findings: list[Finding]
) -> None:
    """Say that the stated axes have the sensor upside down.

    Parameters
    ----------
    said : dict of str to Inference
    axis : str
        The sensor axis that is stated to point down.
    file : str
    findings : list of Finding
    """
    up = said.get("up_axis")
    if up is None or up.value != axis or up.confidence < 0.8:
        return
    findings.append(
        Finding(
            "io.axes-points-down-sensor-upside",
            file=file,
            quantity="axes",
            axis=axis,
            evidence=up.evidence[0],
        )
    )
