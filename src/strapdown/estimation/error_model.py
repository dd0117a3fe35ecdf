"""Interface of every error model: states, propagation over a segment, physical meaning."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from functools import cached_property
from typing import ClassVar

import numpy as np

from strapdown._kernels import psi_model as kernel
from strapdown._kernels import wander_errors
from strapdown._kernels.growth import growth_arrays, growth_room, padded_width
from strapdown._kernels.level import LEVEL
from strapdown.ellipsoids import find_ellipsoid
from strapdown.errors import ConfigError
from strapdown.estimation.sensor_states import SensorStates, Stacked, StateBlock, StateLayout, stack
from strapdown.mechanization.mechanization import Mechanization
from strapdown.mechanization.wander_azimuth import WanderAzimuth
from strapdown.sensors.triad_errors import Triad
from strapdown.tables.checks import Array

#: Physical errors of a state of navigation: displacement, velocity as a vector, rotation.
PHYSICAL = 9


@dataclass(frozen=True, eq=False)
class Segment:
    """A segment of a run of a mechanization.

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
    """Propagation of the errors of a mechanization and of its sensors; stateless.

    Error = computed or measured − truth. Whatever its own states are, a model gives the same
    physical errors: first the nine of the navigation state as in
    `mechanization.state_error.state_error`, in level axes of the mechanization, then those of
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
    #: Whether the height error is a state.
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
        """Position of each block of the sensors among the physical errors, by name."""
        out: dict[str, slice] = {}
        at = PHYSICAL
        for one in self.sensors:
            out[one.block.name] = slice(at, at + len(one.block))
            at += len(one.block)
        return out

    @abstractmethod
    def transition(self, segment: Segment, step: float) -> tuple[Array, Array]:
        """Return the transition of the errors from the start of a segment to its end.

        `step` (s): longest time over which attitude and force are taken by their means; increments
        themselves are never divided. Returns `Phi` ((n, n)); `Q` ((n, n)): covariance that the
        noise adds.
        """

    @abstractmethod
    def to_physical(self, mechanization: Mechanization, time: float, row: Array) -> Array:
        """Return T of ``physical = T x``, (`physical_size`, n), at a row of a history."""

    @abstractmethod
    def from_physical(self, mechanization: Mechanization, time: float, row: Array) -> Array:
        """Return E of ``x = E physical``, (n, `physical_size`): ``T E = 1`` on the states' range.

        Errors without a state in the model, such as that of a held height, are lost; states without
        physical meaning, such as the norm of a quaternion, are zero.
        """

    def estimated(self, mechanization: Mechanization) -> tuple[bool, ...]:
        """Return which of the nine physical errors have states, in their order.

        The covariance of the others is not that of an error: it is zero, or of other errors.
        """
        return (True,) * PHYSICAL


def refuse_damped_height(mechanization: Mechanization) -> None:
    """Refuse a mechanization with a height loop of its own.

    ConfigError: its height is damped.
    """
    if mechanization.height == "damped":
        raise ConfigError("estimation.error-model-no-states-loop", quantity="height")


# Fifteen states: displacement, velocity, rotation vector, and the biases of the sensors.


AXES = ("x", "y", "z")


@dataclass(frozen=True)
class RotationVectorModel(ErrorModel):
    """Errors as vectors relative to the Earth: the psi-angle model, in level axes.

    Its nine core states are the physical errors themselves, for any mechanization: those of
    `mechanization.state_error.state_error`. With gyro and accelerometer biases it has 15
    states. Regular wherever the mechanization is, including the poles.

    To first order in the errors; a step uses mean attitude and force.

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
        """Return the transition of the errors over a segment, as `ErrorModel.transition`.

        ConfigError: the height of the mechanization is damped: its loop has states of its own.
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


# Seventeen states: velocity in a wander azimuth, two quaternions, biases of the sensors.


COMPONENTS = ("w", "x", "y", "z")
#: Number of states before those of the sensors.
STATES = wander_errors.STATES


@dataclass(frozen=True)
class QuaternionModel(ErrorModel):
    """Errors of a wander-azimuth mechanization, component by component.

    The states of Chernodarov (2009), (3): the errors of the three components of velocity in the
    axes xi, eta, zeta, of the four of the quaternion body to inertial, and of the four of the
    quaternion level to Earth; with gyro and accelerometer biases 17. ``A = dF/dY`` of (1), (2),
    (4), with the standard skew-symmetric matrix in (1), where the printed one is not. The height
    has no state: with a height that is held the vertical velocity has no error; with a free one it
    has, and the change of gravity with height is neglected.

    Three directions have no physical meaning: the norms of the two quaternions, and a turn of the
    level axes about zeta together with the velocity's components. `from_physical` gives them zero,
    and they stay zero: norms are kept by the equations, and at the end of every segment the level
    axes of the truth are taken to be those without a turn about zeta.

    Inertial axes are those of the Earth at time zero. To first order in the errors; a step uses
    mean attitude and force. Regular at the poles.

    Attributes
    ----------
    gyro_noise, accel_noise, sensors
        As `ErrorModel`.
    """

    name: ClassVar[str] = "quaternions"
    summary: ClassVar[str] = (
        "17 states: velocity and two quaternions by components, biases; none of the height, which "
        "no aid corrects"
    )
    source: ClassVar[str] = "Chernodarov (2009) (3)"
    has_height: ClassVar[bool] = False
    core: ClassVar[tuple[StateBlock, ...]] = (
        StateBlock("velocity", ("xi", "eta", "zeta"), "m/s"),
        StateBlock("q_ib", COMPONENTS, "1"),
        StateBlock("q_ew", COMPONENTS, "1"),
    )

    def transition(self, segment: Segment, step: float) -> tuple[Array, Array]:
        """Return the transition of the errors over a segment, as `ErrorModel.transition`.

        `segment`: of a `WanderAzimuth`; its times are those of one clock throughout a run. `step`
        (s). ConfigError: the mechanization has no wander azimuth, or damps its height by a loop
        that has states of its own.
        """
        used = _checked(segment.mechanization)
        k = self.layout.size - STATES
        n = PHYSICAL + k
        levels = used.levels(segment.history)
        phi, q = np.empty((n, n)), np.empty((n, n))
        sensors = self.stacked
        earth = find_ellipsoid(used.ellipsoid).parameters()
        wander_errors.wander_transitions(
            levels,
            segment.increments,
            step,
            sensors.gyro_terms,
            sensors.accel_terms,
            sensors.decay,
            sensors.drive,
            np.array(self.gyro_noise),
            np.array(self.accel_noise),
            used.height == "held",
            earth,
            phi,
            q,
            np.empty((PHYSICAL, padded_width(n))),
            np.empty((n, n)),
            np.empty((n, n)),
            growth_arrays(n),
            growth_room(n),
            np.empty((n, n)),
            np.empty((15, 3)),
            np.empty(LEVEL),
        )
        end = levels[-1]
        wander_errors.fix_gauge(end, phi)
        wander_errors.fix_gauge(end, q)
        wander_errors.fix_gauge(end, q.T)
        _, back = _columns(used, segment.time[0], segment.history[0])
        forth, _ = _columns(used, segment.time[-1], segment.history[-1])
        core = forth[:, :PHYSICAL]
        Phi, Q = np.zeros((2, n + 2, n + 2))
        Phi[:STATES, :STATES] = (
            core @ phi[:PHYSICAL, :PHYSICAL] @ back[:PHYSICAL]
            + forth[:, PHYSICAL:] @ back[PHYSICAL:]
        )
        Phi[:STATES, STATES:] = core @ phi[:PHYSICAL, PHYSICAL:]
        Phi[STATES:, STATES:] = phi[PHYSICAL:, PHYSICAL:]
        of_core = core @ q[:PHYSICAL, :PHYSICAL] @ core.T
        Q[:STATES, :STATES] = 0.5 * (of_core + of_core.T)
        Q[:STATES, STATES:] = core @ q[:PHYSICAL, PHYSICAL:]
        Q[STATES:, :STATES] = Q[:STATES, STATES:].T
        Q[STATES:, STATES:] = q[PHYSICAL:, PHYSICAL:]
        return Phi, Q

    def to_physical(self, mechanization: Mechanization, time: float, row: Array) -> Array:
        """Return T, as `ErrorModel.to_physical`: its row of the vertical displacement is zero."""
        used = _checked(mechanization)
        core = np.empty((PHYSICAL, PHYSICAL))
        earth = find_ellipsoid(used.ellipsoid).parameters()
        wander_errors.physical_of_variables(used.levels(row[None])[0], earth, core)
        _, back = _columns(used, time, row)
        k = self.layout.size - STATES
        out = np.zeros((PHYSICAL + k, STATES + k))
        out[:PHYSICAL, :STATES] = core @ back[:PHYSICAL]
        out[PHYSICAL:, STATES:] = np.eye(k)
        return out

    def from_physical(self, mechanization: Mechanization, time: float, row: Array) -> Array:
        """Return E, as `ErrorModel.from_physical`: a vertical displacement is lost.

        With a height that is held a vertical velocity is lost, too.
        """
        used = _checked(mechanization)
        core = np.empty((PHYSICAL, PHYSICAL))
        earth = find_ellipsoid(used.ellipsoid).parameters()
        held = used.height == "held"
        wander_errors.variables_of_physical(used.levels(row[None])[0], earth, held, core)
        forth, _ = _columns(used, time, row)
        k = self.layout.size - STATES
        out = np.zeros((STATES + k, PHYSICAL + k))
        out[:STATES, :PHYSICAL] = forth[:, :PHYSICAL] @ core
        out[STATES:, PHYSICAL:] = np.eye(k)
        return out

    def estimated(self, mechanization: Mechanization) -> tuple[bool, ...]:
        """Return all but the height, and the vertical velocity of one that is held."""
        return (True, True, False, True, True, mechanization.height != "held", True, True, True)

    def null_directions(self, mechanization: Mechanization, time: float, row: Array) -> Array:
        """Return the directions without physical meaning.

        `time` (s). `row` ((12,)). Returns (3, n), twice the norm of ``q_ib`` and of ``q_ew`` by 1,
        and a turn of the level axes about zeta by 1 rad.
        """
        used = _checked(mechanization)
        forth, _ = _columns(used, time, row)
        turn = np.zeros(PHYSICAL)
        turn[wander_errors.THETA + 2] = 1.0
        wander_errors.turn_gauge(
            used.levels(row[None])[0], 1.0, turn[wander_errors.DV : wander_errors.DV + 3]
        )
        out = np.zeros((3, self.layout.size))
        out[:2, :STATES] = forth[:, PHYSICAL:].T
        out[2, :STATES] = forth[:, :PHYSICAL] @ turn
        return out


def _columns(used: Mechanization, time: float, row: Array) -> tuple[Array, Array]:
    """States of the variables of the kernel and of the two norms, and the inverse."""
    forth, back = np.empty((2, STATES, STATES))
    turn = find_ellipsoid(used.ellipsoid).rotation_rate * time
    wander_errors.component_columns(row, turn, forth)
    wander_errors.invert_columns(forth, back)
    return forth, back


def _checked(mechanization: Mechanization) -> Mechanization:
    if not isinstance(mechanization, WanderAzimuth):
        raise ConfigError(
            "estimation.error-model-wander-azimuth-none",
            quantity="mechanization",
            name=QuaternionModel.name,
            name_2=mechanization.name,
            name_3=WanderAzimuth.name,
        )
    refuse_damped_height(mechanization)
    return mechanization


ERROR_MODELS: dict[str, type[ErrorModel]] = {
    "rotation_vector": RotationVectorModel,
    "quaternions": QuaternionModel,
}
