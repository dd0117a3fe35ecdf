"""A motion that remembers its answers."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown.simulation.motion import Motion

Array = NDArray[np.float64]


class RememberedMotion:
    """A motion that several triads ask the same, and that is worked out once.

    Parameters
    ----------
    motion : Motion
        Its rates and specific forces are kept for every array of instants that was asked for.
    """

    def __init__(self, motion: Motion) -> None:
        self.motion = motion
        self.duration = motion.duration
        self.cuts = tuple(getattr(motion, "cuts", ()))
        self.found: dict[tuple[str, bytes], Array] = {}

    def _ask(self, name: str, time: ArrayLike) -> Array:
        key = (name, np.asarray(time).tobytes())
        if key not in self.found:
            self.found[key] = getattr(self.motion, name)(time)
        return self.found[key]

    def rate(self, time: ArrayLike) -> Array:
        """Body rate, as of `Motion`."""
        return self._ask("rate", time)

    def specific_force(self, time: ArrayLike) -> Array:
        """What an ideal accelerometer reads, as of `Motion`."""
        return self._ask("specific_force", time)

    def angle(self, time: ArrayLike) -> Array:
        """Integral of the body rate, as of `Motion`."""
        return self.motion.angle(time)

    def attitude(self, time: ArrayLike) -> Array:
        """Attitude, as of `Motion`."""
        return self.motion.attitude(time)
