"""Latency from a sample to its state, and missed deadlines."""

from __future__ import annotations

import math
from array import array
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

__all__ = ["Latency", "LatencyTape"]


@dataclass(frozen=True)
class Latency:
    """Latency of the samples of a run.

    Attributes
    ----------
    samples : int
    median, most, largest : float, s
        From the delivery of a sample to its state; `most` is the 99th percentile.
    mean : float, s
    missed : int or None
        States later than the next sample's due time; None without due times.
    behind : float, s, or None
        The largest such delay.
    """

    samples: int
    median: float
    most: float
    largest: float
    mean: float
    missed: int | None
    behind: float | None

    def told(self) -> Mapping[str, float | int | None]:
        """Values by names with units, as in ``latency.json``."""
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
    """Collect the times of delivery and of the state of each sample."""

    def __init__(self) -> None:
        self._took = array("d")
        self._late = array("d")

    def take(self, delivered: float, done: float, deadline: float = math.nan) -> None:
        """Add one sample.

        Parameters
        ----------
        delivered, done : float, s
        deadline : float, s
            Due time of the next sample, by which the state is needed; NaN without due times.
        """
        self._took.append(done - delivered)
        self._late.append(done - deadline)

    def latency(self) -> Latency | None:
        """Return the collected latency; None without samples."""
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
