"""Parts of a proposed case: triads of channels with their clocks."""

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
    """Time base of a part.

    Attributes
    ----------
    column : str
        Name of the column; empty without one.
    unit : str
        Empty where it is not settled.
    why : str
        Evidence for the unit.
    step : float
        Mean, in the clock's own unit; NaN without time.
    rate : float, Hz
        In the likeliest unit.
    candidates : str
        Possible units, in words, where `unit` is empty.
    stated : bool
        The rate is stated: in a line above a table without a clock column, or for rounded stamps.
    rate_why : str
        Evidence for the rate of rounded stamps.
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
    """Triad of channels, possibly incomplete.

    Attributes
    ----------
    path : str
        Of the record, as in the case.
    kind : str
        ``acceleration``, ``rate`` or ``velocity`` (delta-v of event data recorders).
    channels : dict of str to str
        Axis to name of the channel, without missing axes.
    clock : Clock
    unit : str
        Empty where it is not settled.
    why : str
        Evidence for kind and axes.
    candidates : str
        Possible units, in words, where `unit` is empty.
    time : ndarray, (n,), s
        In the likeliest unit, where it is not settled.
    values : ndarray, (n, 3)
        In SI, by the likeliest unit where it is not settled; NaN for missing axes.
    label : str
        Distinguishes the triad from others of its record.
    unit_why : tuple of str
        Evidence for the unit, where it differs from that for the axes.
    zeroed : bool
        Gravity at rest has been subtracted.
    sampling : str
        Empty where the record does not state it.
    full_scale : float or None
        In SI, where the record states it.
    named : bool
        The record names the axes.
    place : str
        Position of the sensor, as far as the record states it.
    sensor : str
        Sensor as named in the record.
    uncertainty : dict of str to float
        Known or assumed error model, by keys of the catalogue of sensors.
    basis : str
        Grounds for the error model.
    notes : tuple of str
        Further lines for a comment.
    remarks : tuple of str
        Remarks in the record.
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
        """The available axes."""
        return [k for k, axis in enumerate("xyz") if axis in self.channels]

    @property
    def free(self) -> Array:
        """Values minus the median of each axis, (n, 3); zero along missing axes."""
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
    """Unused part of a record, with the reason."""

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
