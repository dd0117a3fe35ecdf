"""The clock by which samples are delivered: that of the machine, or one that a test turns."""

from __future__ import annotations

import time
from typing import Protocol

__all__ = ["Clock", "MachineClock"]

#: A sleep may end so much later than it was asked to; the rest is waited for awake, s.
AWAKE = 1e-3


class Clock(Protocol):
    """Seconds that never go back."""

    def now(self) -> float:
        """Seconds since any instant."""

    def wait_until(self, instant: float) -> None:
        """Return at an instant, or at once where it is past."""


class MachineClock:
    """The monotonic clock of the machine."""

    def now(self) -> float:
        """Seconds since any instant."""
        return time.perf_counter()

    def wait_until(self, instant: float) -> None:
        """Return at an instant, or at once where it is past."""
        left = instant - self.now()
        if left > AWAKE:
            time.sleep(left - AWAKE)
        while self.now() < instant:
            pass
