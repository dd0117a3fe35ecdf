"""Clock for the delivery of samples: that of the machine, or one controlled by a test."""

from __future__ import annotations

import time
from typing import Protocol

__all__ = ["Clock", "MachineClock"]

#: Possible delay of the end of a sleep, s; the remaining time is waited actively.
AWAKE = 1e-3


class Clock(Protocol):
    """Monotonic time in seconds."""

    def now(self) -> float:
        """Seconds since an arbitrary instant."""

    def wait_until(self, instant: float) -> None:
        """Return at an instant, or at once if it is past."""


class MachineClock:
    """The monotonic clock of the machine."""

    def now(self) -> float:
        """Seconds since an arbitrary instant."""
        return time.perf_counter()

    def wait_until(self, instant: float) -> None:
        """Return at an instant, or at once if it is past."""
        left = instant - self.now()
        if left > AWAKE:
            time.sleep(left - AWAKE)
        while self.now() < instant:
            pass
