"""What is found in records before a case is written of it: triads of channels on their clocks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import Finding

Array = NDArray[np.float64]

__all__ = ["Clock", "Part", "Skipped"]


@dataclass(frozen=True)
class Clock:
    """Where the time of a part comes from.

    Attributes
    ----------
    column : str
        Name of the column; empty where there is none.
    unit : str
        Empty where it is not known to be one.
    why : str
        What it was concluded from.
    step : float
        Mean, in the clock's own unit; NaN where there is no time.
    rate : float, Hz
        By the likeliest unit.
    candidates : str
        Units that it may be, in words, where `unit` is empty.
    stated : bool
        There is no column, and a line above the table states the rate; or its stamps are rounded.
    rate_why : str
        What the rate of rounded stamps was concluded from.
    """

    column: str
    unit: str
    why: str
    step: float
    rate: float
    candidates: str = ""
    stated: bool = False
    rate_why: str = ""


@dataclass(frozen=True, eq=False)
class Part:
    """A triad, or what there is of one.

    Attributes
    ----------
    path : str
        As the case names the record.
    kind : str
        ``acceleration``, ``rate`` or ``velocity`` (a change of it, as event data recorders keep).
    channels : dict of str to str
        Axis to name of the channel; axes that are missing are left out.
    clock : Clock
    unit : str
        Empty where it is not known.
    why : str
        How kind and axes are known.
    candidates : str
        Units that it may be, in words, where `unit` is empty.
    time : ndarray, (n,), s
        By the likeliest unit, where it is not known.
    values : ndarray, (n, 3)
        In SI, by the likeliest unit where it is not known; NaN for axes that are missing.
    label : str
        What tells it from the others of its record.
    unit_why : tuple of str
        How the unit is known, where it is not with the axes.
    zeroed : bool
        Gravity at rest has been taken off.
    sampling : str
        Where the record tells; else empty.
    full_scale : float or None
        In SI, where the record states it.
    named : bool
        The record names the axes.
    place : str
        Where the sensor sits, as far as the record tells.
    sensor : str
        What the record says of the part.
    uncertainty : dict of str to float
        What is known or assumed of the part, by keys of the catalogue of sensors.
    basis : str
        Why.
    notes : tuple of str
        What else belongs in a comment.
    remarks : tuple of str
        Lines that the record has for people.
    """

    path: str
    kind: str
    channels: dict[str, str]
    clock: Clock
    unit: str
    why: str
    time: Array
    values: Array
    candidates: str = ""
    label: str = ""
    unit_why: tuple[str, ...] = ()
    zeroed: bool = False
    sampling: str = ""
    full_scale: float | None = None
    named: bool = False
    place: str = ""
    sensor: str = ""
    uncertainty: Mapping[str, float] = field(default_factory=dict)
    basis: str = ""
    notes: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()

    @property
    def axes(self) -> list[int]:
        """Which of the three there are."""
        return [k for k, axis in enumerate("xyz") if axis in self.channels]

    @property
    def free(self) -> Array:
        """Values less the median of each axis, (n, 3); zero along axes that are missing."""
        out = np.zeros_like(self.values)
        has = self.axes
        out[:, has] = self.values[:, has] - np.median(self.values[:, has], axis=0)
        return out

    @property
    def step(self) -> float:
        """Median step, s; zero for a single sample."""
        return float(np.median(np.diff(self.time))) if self.time.size > 1 else 0.0


@dataclass(frozen=True)
class Skipped:
    """What of a record was left out, and why."""

    path: str
    what: str
    reason: str | Finding
    names: tuple[str, ...] = field(default=())

    @property
    def why(self) -> str:
        """The reason in words, with its row."""
        if isinstance(self.reason, str):
            return self.reason
        row = "" if self.reason.row is None else f" in row {self.reason.row}"
        return f"{self.reason.sentence('file')}{row}"
