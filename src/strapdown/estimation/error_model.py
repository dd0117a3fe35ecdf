"""What every error model is: states, how they go on over a segment, and what they mean."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import ConfigError
from strapdown.estimation.sensor_states import SensorStates, Stacked, stack
from strapdown.estimation.states import StateBlock, StateLayout
from strapdown.mechanization.mechanization import Mechanization
from strapdown.sensors.triad_errors import Triad

Array = NDArray[np.float64]

#: Physical errors of a state of navigation: displacement, velocity as a vector, rotation.
PHYSICAL = 9


@dataclass(frozen=True, eq=False)
class Segment:
    """A piece of a run of a mechanization.

    Attributes
    ----------
    mechanization : Mechanization
    time : ndarray, (k + 1,), s
        From the start of the first step.
    history : ndarray, (k + 1, row)
    increments : ndarray, (k, 10)
        Rows of a MotionIncrements table.
    """

    mechanization: Mechanization
    time: Array
    history: Array
    increments: Array


@dataclass(frozen=True)
class ErrorModel(ABC):
    """How the errors of a mechanization and of its sensors go on; it holds no state of its own.

    Errors are what is computed or measured less the truth. Whatever its own states are, a model
    tells the same physical errors: of the state of navigation the nine of
    `mechanization.state_error.state_error`, in level axes of the mechanization, and then those of
    the sensors, in the order of `sensors`.

    Attributes
    ----------
    gyro_noise, accel_noise : triad, rad/√s and m/s/√s
        Densities of white noise: rad/s/√Hz and m/s²/√Hz are the same numbers.
    sensors : tuple of SensorStates
    """

    gyro_noise: Triad = (0.0, 0.0, 0.0)
    accel_noise: Triad = (0.0, 0.0, 0.0)
    sensors: tuple[SensorStates, ...] = field(default=())

    name: ClassVar[str]
    summary: ClassVar[str]
    source: ClassVar[str]
    core: ClassVar[tuple[StateBlock, ...]]
    #: Whether the states are the physical errors themselves.
    states_are_physical: ClassVar[bool] = False
    #: Whether it has a state of the height.
    has_height: ClassVar[bool] = True

    @cached_property
    def layout(self) -> StateLayout:
        """States: the core of the model, then the sensors."""
        return StateLayout((*self.core, *(s.block for s in self.sensors)))

    @cached_property
    def physical_size(self) -> int:
        """Number of physical errors: nine, and those of the sensors."""
        return PHYSICAL + sum(len(s.block) for s in self.sensors)

    @cached_property
    def stacked(self) -> Stacked:
        """States of the sensors side by side, as kernels take them."""
        return stack(self.sensors)

    @cached_property
    def columns_of(self) -> dict[str, slice]:
        """Place of each block of the sensors among the physical errors, by name."""
        out: dict[str, slice] = {}
        at = PHYSICAL
        for one in self.sensors:
            out[one.block.name] = slice(at, at + len(one.block))
            at += len(one.block)
        return out

    @abstractmethod
    def transition(self, segment: Segment, step: float) -> tuple[Array, Array]:
        """Return how errors go from the start of a segment to its end.

        Parameters
        ----------
        segment : Segment
        step : float, s
            Longest time over which attitude and force are taken by their means; increments
            themselves are never divided.

        Returns
        -------
        Phi : ndarray, (n, n)
        Q : ndarray, (n, n)
            Covariance that the noise adds.
        """

    @abstractmethod
    def to_physical(self, mechanization: Mechanization, time: float, row: Array) -> Array:
        """Return T of ``physical = T x``, (`physical_size`, n), at a row of a history."""

    @abstractmethod
    def from_physical(self, mechanization: Mechanization, time: float, row: Array) -> Array:
        """Return E of ``x = E physical``, (n, `physical_size`): ``T E = 1`` on what x can tell.

        What the model does not hold, such as a height that is kept, is lost; what is nothing
        physical, such as the norm of a quaternion, is zero.
        """


def refuse_damped_height(mechanization: Mechanization) -> None:
    """Refuse a mechanization whose height has a loop of its own.

    Parameters
    ----------
    mechanization : Mechanization

    Raises
    ------
    ConfigError
        Its height is damped.
    """
    if mechanization.height == "damped":
        raise ConfigError("estimation.error-model-no-states-loop", quantity="height")
