"""What aids of a body at rest have in common: how it is found that it rests."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from strapdown.aiding.aid import Epochs, WatchingAid
from strapdown.aiding.checks import check_number
from strapdown.aiding.standstill_detectors import STANDSTILL_DETECTORS
from strapdown.aiding.standstill_thresholds import STANDSTILL_THRESHOLDS
from strapdown.aiding.view import VELOCITY, View
from strapdown.errors import ConfigError

__all__ = ["StandstillAid", "Window"]

Array = NDArray[np.float64]

# A window of fewer samples has no variance worth the name.
LEAST_SAMPLES = 3
# Part of a window that may be missing from it.
GAPS = 0.2
# Part of a window, or of an interval, by which stamps are rounded.
SLACK = 1e-3
#: Columns of what is remembered: end and length of a step, rate, force.
TIME, DT, RATE, FORCE = 0, 1, slice(2, 5), slice(5, 8)
#: Values of an epoch: number of samples, means of rate and force, variances of the rates.
COUNT, MEAN_RATE, MEAN_FORCE, RATE_VARIANCE = 0, slice(1, 4), slice(4, 7), slice(7, 10)


class Window(NamedTuple):
    """What is remembered between pieces.

    Attributes
    ----------
    samples : ndarray, (m, 8)
        The last ones: a window, and one before it.
    number : float
        Of the interval of the last sample; NaN before the first.
    rule : object
        What the rule of the threshold remembers.
    """

    samples: Array
    number: float
    rule: Any


@dataclass(frozen=True)
class StandstillAid(WatchingAid):
    """An aid that observes while a detector says that the body rests.

    The detector sees the samples of the `window` that ends at an epoch, and no later ones.

    A vehicle that glides over a smooth road looks like one that rests. So nothing is observed
    while the computed velocity is not near zero: above `largest_speed` by more than `gate` standard
    deviations of what is computed along its direction.

    Attributes
    ----------
    detector : str
        One of `STANDSTILL_DETECTORS`.
    window : float, s
    threshold : float
        The statistic of a rest is below it: one, if the noise is as stated.
    threshold_rule : str
        One of `STANDSTILL_THRESHOLDS`: what becomes of it while it goes.
    threshold_time : float, s
        For so long a rule remembers, or is patient.
    rate_sd_deg_per_s, force_sd : float, deg/s and m/s²
        Of the noise of one sample at rest, an idling engine included.
    gravity : float, m/s²
        Of the place, for detectors that use it.
    interval : float, s
        Between observations; zero: at every sample.
    largest_speed : float, m/s
        Infinite: the detector alone decides, as on a foot.
    gate : float
    gate_time : float, s
        After so long without any observation a rest is taken at any speed: a filter that is wrong
        by more than it knows would take none any more. Zero: never, as for what glides for longer.
    """

    detector: str = "force_variance"
    window: float = field(default=1.0, metadata={"unit": "s"})
    threshold: float = 3.0
    threshold_rule: str = "stated"
    threshold_time: float = field(default=10.0, metadata={"unit": "s"})
    rate_sd_deg_per_s: float = 0.2
    force_sd: float = field(default=0.05, metadata={"unit": "m_per_s2"})
    gravity: float = 9.81
    interval: float = 0.5
    largest_speed: float = 0.5
    gate: float = 4.0
    gate_time: float = field(default=0.0, metadata={"unit": "s"})

    def __post_init__(self) -> None:
        for name, code, table in (
            ("detector", "navigation.unknown-detector", STANDSTILL_DETECTORS),
            ("threshold_rule", "navigation.unknown-threshold-rule", STANDSTILL_THRESHOLDS),
        ):
            value = getattr(self, name)
            if value not in table:
                raise ConfigError(
                    code,
                    file=self.name or None,
                    quantity=name,
                    value=value,
                    word=str(value),
                    known=table,
                )
        for name in ("window", "threshold", "threshold_time"):
            check_number(self, name, low=0.0, above=True)
        for name in ("rate_sd_deg_per_s", "force_sd", "gravity"):
            check_number(self, name, low=0.0, above=True)
        for name in ("interval", "gate", "gate_time"):
            check_number(self, name, low=0.0)
        if self.largest_speed != math.inf:
            check_number(self, "largest_speed", low=0.0)

    def begin(self) -> Window:
        """Return nothing seen."""
        rule = STANDSTILL_THRESHOLDS[self.threshold_rule]
        return Window(np.empty((0, 8)), math.nan, rule.begin(self.threshold, self.threshold_time))

    def watch(self, memory: Window, time: Array, rows: Array) -> tuple[Window, Epochs]:
        """Return epochs where the window that ends there is of a rest."""
        if not len(time):
            return memory, Epochs(np.empty(0), np.empty((0, 10)))
        new = len(memory.samples)
        seen = np.empty((new + len(time), 8))
        seen[:new] = memory.samples
        seen[new:, TIME], seen[new:, DT] = time, rows[:, 0]
        np.divide(rows[:, 1:7], rows[:, :1], out=seen[new:, 2:])
        rule, remembered = STANDSTILL_THRESHOLDS[self.threshold_rule], memory.rule
        at, values = [], []
        for i in self._ends(seen, new, memory.number):
            looked = self._look(seen, int(i))
            if looked is None:
                continue
            statistic, told = looked
            remembered, threshold = rule.next(remembered, float(seen[i, TIME]), statistic)
            if statistic < threshold:
                at.append(seen[i, TIME])
                values.append(told)
        kept = self._first(seen, len(seen) - 1)
        number = self._number(seen[-1:, TIME])[0]
        after = Window(seen[max(kept - 1, 0) :].copy(), number, remembered)
        return after, Epochs(np.array(at), np.array(values).reshape(-1, 10))

    def near_rest(self, view: View) -> bool:
        """Whether what is computed may be a rest."""
        speed = float(np.linalg.norm(view.velocity))
        if speed <= self.largest_speed or 0.0 < self.gate_time <= view.unobserved:
            return True
        along = view.velocity / speed
        sd = math.sqrt(along @ view.covariance[VELOCITY, VELOCITY] @ along)
        return speed - self.largest_speed <= self.gate * sd

    def _number(self, time: Array) -> Array:
        """Number of the interval of an instant."""
        return np.floor(time / self.interval + SLACK) if self.interval else np.zeros(len(time))

    def _ends(self, seen: Array, new: int, number: float) -> NDArray[np.int64]:
        """Samples with which an interval ends."""
        if not self.interval:
            return np.arange(new, len(seen))
        numbers = self._number(seen[new:, TIME])
        before = np.concatenate([[numbers[0] if math.isnan(number) else number], numbers[:-1]])
        return new + np.flatnonzero(numbers > before)

    def _first(self, seen: Array, i: int) -> int:
        """First sample of the window that ends with one."""
        begin = seen[i, TIME] - self.window * (1.0 - SLACK)
        # Ends of steps: the first that is after the begin of the window.
        return int(seen[: i + 1, TIME].searchsorted(begin, side="right"))

    def _look(self, seen: Array, i: int) -> tuple[float, Array] | None:
        """Statistic of a window that is whole, and what it tells where it is of a rest."""
        first = self._first(seen, i)
        count = i + 1 - first
        within = np.ascontiguousarray(seen[first : i + 1])
        begun = seen[0, TIME] - seen[0, DT] <= seen[i, TIME] - self.window * (1.0 - SLACK)
        if count < LEAST_SAMPLES or not begun or within[:, DT].sum() < (1.0 - GAPS) * self.window:
            return None
        rate, force = within[:, RATE].copy(), within[:, FORCE].copy()
        statistic = STANDSTILL_DETECTORS[self.detector].statistic(
            rate, force, math.radians(self.rate_sd_deg_per_s), self.force_sd, self.gravity
        )
        told = [[count], rate.mean(axis=0), force.mean(axis=0), rate.var(axis=0, ddof=1)]
        return statistic, np.concatenate(told)
