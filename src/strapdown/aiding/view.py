"""What an aid sees of a navigator at the instant of an epoch."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from strapdown import rotation
from strapdown._kernels.compensation import errors_of_states, true_inputs
from strapdown._kernels.level import OMEGA_EL, Q_LB, V_L
from strapdown.ellipsoids import Ellipsoid, find_ellipsoid
from strapdown.estimation.error_model import PHYSICAL, ErrorModel
from strapdown.mechanization.mechanization import Mechanization
from strapdown.nav_state import NavState

__all__ = ["View"]

Array = NDArray[np.float64]

#: Columns of the physical errors: displacement, velocity, rotation.
DISPLACEMENT, VELOCITY, ROTATION = slice(0, 3), slice(3, 6), slice(6, 9)


@dataclass(frozen=True, eq=False)
class View:
    """The computed state, and what the body does, at an epoch.

    Attributes
    ----------
    mechanization : Mechanization
    model : ErrorModel
    time : float, s
    state : ndarray
        Of the mechanization.
    row : ndarray
        Of a history: the same instant.
    sensors : ndarray, (k,)
        Estimates of the errors of the sensors, in the order of the model's `sensors`.
    rate : ndarray, (3,), rad/s
        Of the body relative to inertial space, body axes: the mean over the step that ends here,
        estimated errors taken off.
    force : ndarray, (3,), m/s²
        Specific force, the same.
    covariance_of : callable, optional
        Makes the covariance of the physical errors at this instant; it costs something.
    steady : ndarray, (6,), optional
        Rate and force as fading means over some tenths of a second, as the sensors gave them, in
        the axes of the body of now; for an aid that wants them (`Aid.wants_steady`).
    unobserved : float, s
        Since anything was observed.
    """

    mechanization: Mechanization
    model: ErrorModel
    time: float
    state: Array
    row: Array
    sensors: Array
    rate: Array
    force: Array
    covariance_of: Callable[[], Array] | None = None
    steady: Array | None = None
    unobserved: float = 0.0

    @cached_property
    def covariance(self) -> Array:
        """Of the physical errors, level axes, (columns, columns); zero where it is not known."""
        if self.covariance_of is None:
            return np.zeros((self.columns, self.columns))
        return self.covariance_of()

    @cached_property
    def level(self) -> Array:
        """Level row of this instant, (14,): `_kernels.level`."""
        level: Array = self.mechanization.levels(self.row[None, :])[0]
        return level

    @cached_property
    def here(self) -> NavState:
        """Place, velocity and attitude."""
        return self.mechanization.nav_state(self.state, self.time)

    @cached_property
    def ellipsoid(self) -> Ellipsoid:
        """That of the mechanization."""
        return find_ellipsoid(self.mechanization.ellipsoid)

    @cached_property
    def C_lb(self) -> Array:  # noqa: N802
        """Body to level axes, (3, 3)."""
        return rotation.dcm_from_quaternion(self.level[Q_LB : Q_LB + 4])

    @cached_property
    def C_ln(self) -> Array:  # noqa: N802
        """North-east-down to level axes, (3, 3)."""
        return self.mechanization.level_from_ned(self.row)

    @cached_property
    def velocity(self) -> Array:
        """Relative to the Earth, level axes, (3,), m/s."""
        return self.level[V_L : V_L + 3]

    @cached_property
    def turn_of_level(self) -> Array:
        """Rate of the level relative to the Earth, level axes, (3,), rad/s."""
        return self.level[OMEGA_EL : OMEGA_EL + 3]

    @property
    def columns(self) -> int:
        """Number of the physical errors: of the columns of an observation's H."""
        return self.model.physical_size

    def has(self, name: str) -> bool:
        """Whether the filter has such a block of states."""
        return name in self.model.layout

    def place(self, name: str) -> slice:
        """Columns of a block of states of the sensors or of an aid."""
        return self.model.columns_of[name]

    def labels(self, name: str) -> tuple[str, ...]:
        """Labels of a block of states."""
        return next(s.block.labels for s in self.model.sensors if s.block.name == name)

    def without_errors(self, readings: Array) -> Array:
        """Rate and force that were read, (6,), with the estimated errors taken off."""
        stacked, errors, out = self.model.stacked, np.empty((2, 7, 3)), np.empty(6)
        errors_of_states(stacked.gyro_terms, self.sensors, errors[0])
        errors_of_states(stacked.accel_terms, self.sensors, errors[1])
        true_inputs(readings, errors[0], errors[1], out)
        return out

    def estimate(self, name: str) -> Array:
        """Estimate of a block: error of what was assumed, as its block is defined."""
        at = self.place(name)
        return self.sensors[at.start - PHYSICAL : at.stop - PHYSICAL]
