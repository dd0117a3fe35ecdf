"""Timing by turns, so that a busy moment of the machine falls on both sides of a ratio."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Ratio:
    """One row of the table: ours against theirs, and the limit that we set ourselves.

    `limit` is the most that ours / theirs may be; None where the number is only told.
    """

    what: str
    ours: float
    against: str
    theirs: float
    unit: str
    limit: float | None

    @property
    def value(self) -> float:
        return self.ours / self.theirs


def by_turns(
    ours: Callable[[], object], theirs: Callable[[], object], rounds: int = 15
) -> tuple[float, float]:
    """Median seconds of each, run alternately `rounds` times after one unmeasured round."""
    taken: tuple[list[float], list[float]] = ([], [])
    for number in range(rounds + 1):
        for job, times in zip((ours, theirs), taken, strict=True):
            start = time.perf_counter()
            job()
            if number:
                times.append(time.perf_counter() - start)
    return statistics.median(taken[0]), statistics.median(taken[1])
