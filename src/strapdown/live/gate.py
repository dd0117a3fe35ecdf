"""Gate of a live run: stamps far ahead wait for confirmation; impossible values are refused.

A sample whose stamp is a gap away from the one before is held: one wrong stamp must not refuse the
right ones after it. If `confirm` samples follow one another from there, the gap is real, and all of
them are used. A sample that continues where the others were contradicts them, and they are dropped.
The decision depends on the stamps alone, so that it repeats with the lines.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np

from strapdown.live.lines import BadLineError, Sample
from strapdown.sensors.uncertainty import ImuUncertainty

__all__ = ["StampGate", "ValueLimits", "value_limits"]

T = TypeVar("T")

#: A longer step is no step of a sensor: held samples further apart do not confirm each other, s.
COHERENT = 10.0
#: Samples that give the usual step, as in `navigation.preprocessing`, and its share of them.
FIRST, SHARE = 64, 0.95
#: Stamps are rounded: a step of exactly the limit is not a gap.
ROUNDED = 1.01
#: Largest stamp, s: the year 2286, where a double resolves 2 µs.
LATEST = 1e10
#: The ranges of a sensor family, as ±2 to ±16 g or ±250 to ±2000 deg/s, differ at most eightfold.
FAMILY = 8.0
#: Beyond any gyro, rad/s, and accelerometer, m/s².
FASTEST, STRONGEST = 1e4, 1e6


class StampGate(Generic[T]):
    """Hold samples after a gap until others confirm it.

    Parameters
    ----------
    confirm : int
        Samples in a row that confirm a new time, and the begin of a run.
    gap : float
        A step of more than this multiple of the usual one is a gap.

    Attributes
    ----------
    newest : float, s
        Stamp of the newest sample that passed; -inf before the first.
    dropped : list
        Stamps and items that were contradicted by the last call.
    """

    def __init__(self, confirm: int, gap: float) -> None:
        self._confirm, self._gap = confirm, gap
        self.newest = -math.inf
        self.dropped: list[tuple[float, T]] = []
        self._held: list[tuple[float, T]] = []
        self._steps: list[float] = []
        self._limit = 0.0

    @property
    def holding(self) -> bool:
        """Whether samples are held."""
        return bool(self._held)

    def take(self, time: float, item: T) -> list[tuple[float, T]]:
        """Take a sample later than `newest`; return those that can be used now, in order."""
        self.dropped = []
        if time - self.newest <= self._limit:
            self._drop()
            return self._pass([(time, item)])
        if self._held and not 0.0 < time - self._held[-1][0] <= COHERENT:
            self._drop()
        self._held.append((time, item))
        if len(self._held) < self._confirm:
            return []
        passed, self._held = self._held, []
        return self._pass(passed)

    def finish(self) -> list[tuple[float, T]]:
        """Return the samples of a run that ends before its begin is confirmed; drop others."""
        self.dropped = []
        if self.newest == -math.inf:
            passed, self._held = self._held, []
            return self._pass(passed)
        self._drop()
        return []

    def restart(self, time: float) -> None:
        """Continue from a stamp of a clock that was reset."""
        self._drop()
        self.newest = time

    def _drop(self) -> None:
        self.dropped += self._held
        self._held = []

    def _pass(self, items: list[tuple[float, T]]) -> list[tuple[float, T]]:
        for time, _ in items:
            if len(self._steps) < FIRST and self.newest > -math.inf:
                self._steps.append(time - self.newest)
                usual = float(np.quantile(self._steps, SHARE, method="lower"))
                self._limit = self._gap * ROUNDED * usual
            self.newest = time
        return items


@dataclass(frozen=True)
class ValueLimits:
    """Largest readings that a sensor can give, rad/s and m/s²."""

    rate: float = FASTEST
    force: float = STRONGEST

    def check(self, said: Sample) -> None:
        """Refuse a stamp or a reading beyond the limits."""
        if not abs(said.time) <= LATEST:
            raise BadLineError("stamp", "live.stamp-beyond-limit", time=said.time, most=LATEST)
        force, rate = said.values[-3:], said.values[:-3]
        for values, most, unit in ((rate, self.rate, "rad/s"), (force, self.force, "m/s²")):
            for value in values:
                if not abs(value) <= most:
                    raise BadLineError(
                        "value", "live.value-beyond-limit", value=value, most=most, unit=unit
                    )


def value_limits(sensors: ImuUncertainty) -> ValueLimits:
    """Return the limits by the stated full scale; a sensor may be set to its family's largest."""
    rate, force = (
        min(FAMILY * max(triad.axis("full_scale")), most)
        for triad, most in ((sensors.gyro, FASTEST), (sensors.accel, STRONGEST))
    )
    return ValueLimits(rate, force)
