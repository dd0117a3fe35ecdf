"""From a sample to the state that follows from it: how long, and how often too long."""

from __future__ import annotations

import math
from array import array
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

__all__ = ["Latency", "LatencyTape"]


@dataclass(frozen=True)
class Latency:
    """What the samples of a run took.

    Attributes
    ----------
    samples : int
    median, most, largest : float, s
        From the delivery of a sample to its state; `most` is what 99 of 100 do not exceed.
    mean : float, s
    missed : int or None
        States that came later than the next sample was due; None where nothing was due.
    behind : float, s, or None
        The most by which one did.
    """

    samples: int
    median: float
    most: float
    largest: float
    mean: float
    missed: int | None
    behind: float | None

    def told(self) -> Mapping[str, float | int | None]:
        """By names with units, as ``latency.json`` has them."""
        return {
            "samples": self.samples,
            "median_ms": _ms(self.median),
            "p99_ms": _ms(self.most),
            "largest_ms": _ms(self.largest),
            "mean_ms": _ms(self.mean),
            "missed_deadlines": self.missed,
            "largest_behind_ms": None if self.behind is None else _ms(self.behind),
        }


def _ms(seconds: float) -> float:
    return round(1e3 * seconds, 6)


class LatencyTape:
    """Takes when each sample was delivered, and when its state was there."""

    def __init__(self) -> None:
        self._took = array("d")
        self._late = array("d")

    def take(self, delivered: float, done: float, deadline: float = math.nan) -> None:
        """Take one sample.

        Parameters
        ----------
        delivered, done : float, s
        deadline : float, s
            When its state has to be there: when the next sample is due; not a number where
            nothing is due.
        """
        self._took.append(done - delivered)
        self._late.append(done - deadline)

    def latency(self) -> Latency | None:
        """Return what was taken; None where nothing was."""
        if not self._took:
            return None
        took, late = np.array(self._took), np.array(self._late)
        late = late[np.isfinite(late)]
        return Latency(
            samples=len(took),
            median=float(np.median(took)),
            most=float(np.percentile(took, 99.0)),
            largest=float(took.max()),
            mean=float(took.mean()),
            missed=int((late > 0.0).sum()) if late.size else None,
            behind=max(float(late.max()), 0.0) if late.size else None,
        )
