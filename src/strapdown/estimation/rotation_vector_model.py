"""Fifteen states: displacement, velocity, rotation vector, and the biases of the sensors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from strapdown._kernels import psi_model as kernel
from strapdown._kernels.growth import growth_arrays, growth_room, padded_width
from strapdown.ellipsoids import find_ellipsoid
from strapdown.estimation.error_model import (
    PHYSICAL,
    Array,
    ErrorModel,
    Segment,
    refuse_damped_height,
)
from strapdown.estimation.states import StateBlock
from strapdown.mechanization.mechanization import Mechanization

AXES = ("x", "y", "z")


@dataclass(frozen=True)
class RotationVectorModel(ErrorModel):
    """Errors as vectors relative to the Earth: the psi-angle model, in level axes.

    Its nine core states are the physical errors themselves, whatever mechanization they are of:
    those of `mechanization.state_error.state_error`. With gyro and accelerometer biases it has 15
    states. Regular everywhere, the poles included, where the mechanization is.

    To first order in the errors; over a step of attitude and force by their means.

    Attributes
    ----------
    gyro_noise, accel_noise, sensors
        As `ErrorModel`.
    """

    name: ClassVar[str] = "rotation_vector"
    summary: ClassVar[str] = "15 states: displacement, velocity, rotation vector, biases"
    source: ClassVar[str] = "Benson (1975), psi-angle"
    states_are_physical: ClassVar[bool] = True
    core: ClassVar[tuple[StateBlock, ...]] = (
        StateBlock("displacement", AXES, "m"),
        StateBlock("velocity", AXES, "m/s"),
        StateBlock("rotation", AXES, "rad"),
    )

    def transition(self, segment: Segment, step: float) -> tuple[Array, Array]:
        """Return how errors go over a segment, as `ErrorModel.transition`.

        Raises
        ------
        ConfigError
            The height of the mechanization is damped: its loop has states of its own.
        """
        used = segment.mechanization
        refuse_damped_height(used)
        n = self.layout.size
        phi, q = np.empty((n, n)), np.empty((n, n))
        sensors = self.stacked
        kernel.psi_transitions(
            used.levels(segment.history),
            segment.increments,
            used.level_up,
            step,
            sensors.gyro_terms,
            sensors.accel_terms,
            sensors.decay,
            sensors.drive,
            np.array(self.gyro_noise),
            np.array(self.accel_noise),
            used.height == "held",
            find_ellipsoid(used.ellipsoid).parameters(),
            phi,
            q,
            np.empty((PHYSICAL, padded_width(n))),
            np.empty((n, n)),
            np.empty((n, n)),
            growth_arrays(n),
            growth_room(n),
            np.empty((n, n)),
            np.empty((6, 3)),
        )
        return phi, q

    def to_physical(self, mechanization: Mechanization, time: float, row: Array) -> Array:
        """Return the identity: the states are the physical errors."""
        return np.eye(self.layout.size)

    def from_physical(self, mechanization: Mechanization, time: float, row: Array) -> Array:
        """Return the identity."""
        return np.eye(self.layout.size)
