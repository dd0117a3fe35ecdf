"""The unit of a triad: as the record says it, as the case states it, or as its numbers tell it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import ConfigError, DataError, Finding
from strapdown.formats.crash_record import QUANTITIES, CrashChannel, CrashRecord
from strapdown.formats.crash_units import FACTORS, factor_of, state_unit
from strapdown.formats.inference import Signals, infer_signals
from strapdown.formats.judge import what_numbers_say

Array = NDArray[np.float64]

__all__ = ["triad_factor"]

_TRIAD = {"acceleration": "accel", "rate": "gyro"}
# What is shown of numbers that tell no unit.
_CHOICES = {"acceleration": ("g", "m/s2"), "rate": ("deg/s", "rad/s")}


def triad_factor(
    record: CrashRecord,
    axes: Mapping[str, tuple[CrashChannel, Array]],
    time: Array,
    quantity: str,
    stated: str | None,
    findings: list[Finding],
) -> tuple[dict[str, float], str]:
    """Factors that turn the values of each axis into SI.

    Parameters
    ----------
    record : CrashRecord
    axes : dict of str to (CrashChannel, ndarray)
        Values are SI where the channel's unit is known, else as recorded.
    time : ndarray, (n,), s
    quantity : {'acceleration', 'rate'}
    stated : str or None
        By the case.
    findings : list of Finding
        What was concluded is added.

    Returns
    -------
    factors : dict of str to float
    unit : str
        As recorded, or stated.

    Raises
    ------
    ConfigError
        What is stated is no unit of the quantity, or contradicts the record.
    DataError
        Nothing tells the unit.
    """
    own = {a: c.unit for a, (c, _) in axes.items() if _known(c)}
    velocity = {c.quantity == "velocity" for c, _ in axes.values()}
    kind = "velocity" if velocity == {True} else quantity
    wanted = state_unit(stated, kind) if stated else ""
    for axis, unit in own.items():
        if wanted and unit != wanted:
            channel = axes[axis][0]
            raise ConfigError(
                "io.unit-stated-record-says",
                file=record.path.name,
                quantity="unit",
                stated=stated,
                unit=unit,
                name=channel.name,
            )
    open_axes = [a for a in axes if a not in own]
    if not open_axes:
        return dict.fromkeys(axes, 1.0), " ".join(dict.fromkeys(own.values()))
    if not wanted:
        if len(set(own.values())) == 1:
            # One axis says it for the triad: a header is often filled in once.
            wanted = next(iter(own.values()))
            without = ", ".join(axes[a][0].name for a in open_axes)
            other = axes[next(iter(own))][0].name
            findings.append(
                Finding(
                    "io.unit-taken-from-other-axis",
                    file=record.path.name,
                    quantity="unit",
                    without=without,
                    wanted=wanted,
                    other=other,
                )
            )
        else:
            wanted = _evident(record, axes, time, kind, findings)
    for axis in open_axes:
        channel = axes[axis][0]
        if channel.unit:
            findings.append(
                Finding(
                    "io.record-says-not-known-read",
                    file=channel.file or None,
                    quantity=f"channel {channel.name}",
                    severity="note",
                    unit=channel.unit,
                    wanted=wanted,
                )
            )
    return {a: 1.0 if a in own else FACTORS[kind][wanted] for a in axes}, wanted


def _known(channel: CrashChannel) -> bool:
    """Whether the values are in SI already."""
    return factor_of(channel.quantity, channel.unit) is not None


def _evident(
    record: CrashRecord,
    axes: Mapping[str, tuple[CrashChannel, Array]],
    time: Array,
    quantity: str,
    findings: list[Finding],
) -> str:
    block = [v for _, v in axes.values()]
    names = ", ".join(c.name for c, _ in axes.values())
    unit = None
    if quantity in _TRIAD and len(block) == 3 and all(b.shape == time.shape for b in block):
        values = np.column_stack(block)
        triad = _TRIAD[quantity]
        signals = Signals(
            time,
            gyro=values if triad == "gyro" else None,
            accel=values if triad == "accel" else None,
            time_unit="s",
        )
        said = {i.quantity: i for i in infer_signals(signals)}
        unit, form = said.get(f"{triad}_unit"), said.get(f"{triad}_form")
        if unit is not None and unit.settled and (form is None or form.value == "rate"):
            findings.append(
                unit.finding(
                    "io.crash-unit-inferred",
                    file=record.path.name,
                    quantity=f"unit of {names}",
                )
            )
            return str(unit.value)
    raise DataError(
        "io.crash-unit-not-stated" if unit is None else "io.crash-unit-undecided",
        file=record.path.name,
        quantity=names,
        choices=_choices(block, quantity),
        **what_numbers_say(unit),
    )


def _choices(block: list[Array], quantity: str) -> list[Finding]:
    """The units that it may have, with the largest value in each."""
    largest = max(float(np.nanmax(np.abs(b), initial=0.0)) for b in block)
    units = _CHOICES.get(quantity, tuple(FACTORS[quantity])[:3])
    return [
        Finding(
            "io.crash-choice-of-unit",
            severity="note",
            unit=unit,
            largest=largest,
            value=largest * FACTORS[quantity][unit],
            si=QUANTITIES[quantity],
        )
        for unit in units
    ]
