"""Motion increments of samples that come in pieces of any length."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from strapdown._kernels import motion_blocks
from strapdown._kernels import motion_increments as one_step
from strapdown.errors import ConfigError

__all__ = ["IncrementStream", "IncrementStreamState"]

Array = NDArray[np.float64]

STREAMED = ("linear", "cubic")


@dataclass(frozen=True, eq=False)
class IncrementStreamState:
    """Between pieces.

    Attributes
    ----------
    mean : bool
        Whether samples are means over the step that ends at their stamp.
    time : ndarray, (k,), s
        Newest stamps, as many as the next step needs.
    values : ndarray, (k, 6)
    done : int
        Steps between these stamps that were given already.
    """

    mean: bool
    time: Array
    values: Array
    done: int


@dataclass(frozen=True)
class IncrementStream:
    """Rows of motion increments as `motion_increments` makes them of the whole, to the last bit.

    Attributes
    ----------
    interpolation : {'linear', 'cubic'}
        Between samples: see `motion_increments`. ``linear`` gives each step with the sample that
        ends it, ``cubic`` one sample later.

    Raises
    ------
    ConfigError
        There is no such interpolation.
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

        Parameters
        ----------
        sampling : {'instantaneous', 'mean'}
            As `tables.imu_table`.
        """
        return IncrementStreamState(sampling == "mean", np.empty(0), np.empty((0, 6)), 0)

    def advance(
        self, state: IncrementStreamState, time: Array, values: Array, last: bool = False
    ) -> tuple[IncrementStreamState, Array, Array]:
        """Take further samples.

        Parameters
        ----------
        state : IncrementStreamState
            It is not changed.
        time : ndarray, (k,), s
            Stamps, increasing, after those before; k may be nought.
        values : ndarray, (k, 6)
            Rates in rad/s and specific forces in m/s².
        last : bool
            Whether no sample follows: what waits for one is given as well as it can be.

        Returns
        -------
        state : IncrementStreamState
        ends : ndarray, (m,), s
            Ends of the steps.
        rows : ndarray, (m, 10)
            Rows of a MotionIncrements table.
        """
        stamps = np.concatenate([state.time, time])
        samples = np.concatenate([state.values, values])
        dt = np.diff(stamps)
        rate, force = (np.ascontiguousarray(samples[:, k : k + 3]) for k in (0, 3))
        out = np.empty((dt.size, 10))
        if self.interpolation == "linear":
            one_step.motion_increments_linear(dt, rate, force, state.mean, out)
            upto = dt.size
        else:
            scratch = np.empty((motion_blocks.ROWS, motion_blocks.WIDEST))
            motion_blocks.motion_increments_neighbours(dt, rate, force, state.mean, scratch, out)
            upto = dt.size if last else max(dt.size - 1, state.done)
        # The step before the next one tells how a mean changes over it, and is its neighbour.
        keep = max(upto - 1, 0)
        after = IncrementStreamState(
            state.mean, stamps[keep:].copy(), samples[keep:].copy(), min(upto, 1)
        )
        return after, stamps[1:][state.done : upto], out[state.done : upto]
