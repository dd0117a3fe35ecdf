"""Motion increments of samples that arrive in chunks of any length."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from strapdown._kernels import motion_increments as kernel
from strapdown.errors import ConfigError

Array = NDArray[np.float64]

STREAMED = ("linear", "cubic")


@dataclass(frozen=True, eq=False)
class IncrementStreamState:
    """State between chunks.

    `mean`: whether samples are means over the step ending at their stamp. `time` ((k,), s): newest
    stamps, as many as the next step needs. `values` ((k, 6)). `done`: steps between these stamps
    already returned.
    """

    mean: bool
    time: Array
    values: Array
    done: int


@dataclass(frozen=True)
class IncrementStream:
    """Stream the rows of `motion_increments`, bit-identical to processing the whole record.

    `interpolation` ({'linear', 'cubic'}): see `motion_increments`. ``linear`` returns each step
    with the sample that ends it, ``cubic`` one sample later. ConfigError: the interpolation is
    unknown.
    """

    interpolation: str = "linear"

    def __post_init__(self) -> None:
        if self.interpolation not in STREAMED:
            raise ConfigError(
                "mechanization.no-choice-2",
                quantity="interpolation",
                interpolation=self.interpolation,
                word=str(self.interpolation),
                known=STREAMED,
            )

    def begin(self, sampling: str = "instantaneous") -> IncrementStreamState:
        """Return the state before the first sample.

        `sampling` ({'instantaneous', 'mean'}): as `tables.imu_table`.
        """
        return IncrementStreamState(sampling == "mean", np.empty(0), np.empty((0, 6)), 0)

    def advance(
        self, state: IncrementStreamState, time: Array, values: Array, last: bool = False
    ) -> tuple[IncrementStreamState, Array, Array]:
        """Process further samples.

        `state`: not changed. `time` ((k,), s): stamps, increasing, after the previous ones; k may
        be zero. `values` ((k, 6)): rates in rad/s and specific forces in m/s². `last`: whether no
        sample follows; steps still waiting for one are then returned without it. Returns `state`;
        `ends` ((m,), s): ends of the steps; `rows` ((m, 10)): rows of a MotionIncrements table.
        """
        stamps = np.concatenate([state.time, time])
        samples = np.concatenate([state.values, values])
        dt = np.diff(stamps)
        rate, force = (np.ascontiguousarray(samples[:, k : k + 3]) for k in (0, 3))
        out = np.empty((dt.size, 10))
        if self.interpolation == "linear":
            kernel.motion_increments_linear(dt, rate, force, state.mean, out)
            upto = dt.size
        else:
            scratch = np.empty((kernel.ROWS, kernel.WIDEST))
            kernel.motion_increments_neighbours(dt, rate, force, state.mean, scratch, out)
            upto = dt.size if last else max(dt.size - 1, state.done)
        # Keep the step before the next one: it gives the slope of a mean, and is its neighbor.
        keep = max(upto - 1, 0)
        after = IncrementStreamState(
            state.mean, stamps[keep:].copy(), samples[keep:].copy(), min(upto, 1)
        )
        return after, stamps[1:][state.done : upto], out[state.done : upto]
