"""Seventeen states: velocity in a wander azimuth, two quaternions, and the biases of the sensors."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from strapdown import rotation
from strapdown._kernels import wander as rows
from strapdown._kernels import wander_errors as kernel
from strapdown._kernels.level import ALT, AXIS, LEVEL, V_L, curvatures
from strapdown.ellipsoids import find_ellipsoid
from strapdown.estimation.error_model import PHYSICAL, Array, ErrorModel, Segment
from strapdown.estimation.sensor_states import stacked
from strapdown.estimation.states import StateBlock
from strapdown.exceptions import ConfigError
from strapdown.mechanization.mechanization import Mechanization
from strapdown.mechanization.wander_azimuth import WanderAzimuth

COMPONENTS = ("w", "x", "y", "z")
#: States of the core: of velocity, and of the two quaternions.
CORE = 11
VELOCITY, BODY, PLACE = slice(0, 3), slice(3, 7), slice(7, 11)
# Where the variables of the kernel stand.
THETA = slice(kernel.THETA, kernel.THETA + 3)
DV = slice(kernel.DV, kernel.DV + 3)
EPS = slice(kernel.EPS, kernel.EPS + 3)


@dataclass(frozen=True)
class QuaternionModel(ErrorModel):
    """Errors of what a wander-azimuth mechanization reckons, component by component.

    The states of Chernodarov (2009), (3): the errors of the three components of velocity in the
    axes xi, eta, zeta, of the four of the quaternion body to inertial, and of the four of the
    quaternion level to Earth; with gyro and accelerometer biases 17. ``A = dF/dY`` of (1), (2),
    (4), with the standard skew-symmetric matrix in (1), whose print is not. There is no state of
    the height: with a height that is held the vertical velocity has no error; with a free one it
    has, and what gravity gives away with height is left out.

    Three directions are nothing physical: the norms of the two quaternions, and a turn of the level
    axes about zeta together with the velocity's components. `from_physical` gives them zero, and
    they stay zero: norms are kept by the equations, and at the end of every segment the level axes
    of the truth are taken to be those without a turn about zeta.

    Inertial axes are those of the Earth at time zero. To first order in the errors; over a step of
    attitude and force by their means. Regular at the poles.

    Attributes
    ----------
    gyro_noise, accel_noise, sensors
        As `ErrorModel`.
    """

    name: ClassVar[str] = "quaternions"
    summary: ClassVar[str] = "17 states: velocity and two quaternions by components, biases"
    source: ClassVar[str] = "Chernodarov (2009) (3)"
    has_height: ClassVar[bool] = False
    core: ClassVar[tuple[StateBlock, ...]] = (
        StateBlock("velocity", ("xi", "eta", "zeta"), "m/s"),
        StateBlock("q_ib", COMPONENTS, "1"),
        StateBlock("q_ew", COMPONENTS, "1"),
    )

    def transition(self, segment: Segment, step: float) -> tuple[Array, Array]:
        """Return how errors go over a segment, as `ErrorModel.transition`.

        Parameters
        ----------
        segment : Segment
            Of a `WanderAzimuth`; its times are those of one clock throughout a run.
        step : float, s

        Raises
        ------
        ConfigError
            The mechanization has no wander azimuth, or damps its height by a loop that has states
            of its own.
        """
        used = _checked(segment.mechanization)
        k = self.layout.size - CORE
        n = PHYSICAL + k
        levels = used.levels(segment.history)
        phi, q = np.empty((n, n)), np.empty((n, n))
        gyro, accel, decay, drive = stacked(self.sensors, k)
        kernel.wander_transitions(
            levels,
            segment.increments,
            step,
            gyro,
            accel,
            decay,
            drive,
            np.array(self.gyro_noise),
            np.array(self.accel_noise),
            used.height == "held",
            find_ellipsoid(used.ellipsoid).parameters(),
            phi,
            q,
            np.empty((PHYSICAL, n)),
            np.empty((n, n)),
            np.empty((n, n)),
            np.empty((n, 6 + k)),
            np.empty((n, n)),
            np.empty((15, 3)),
            np.empty(LEVEL),
        )
        fixed = _without_gauge(levels[-1], n)
        begin = self._components(used, segment.time[0], segment.history[0])
        end = self._components(used, segment.time[-1], segment.history[-1])
        Phi = end[:, :n] @ (fixed @ phi) @ _inverse(begin)[:n] + end[:, n:] @ _inverse(begin)[n:]
        half = end[:, :n] @ fixed
        Q = half @ q @ half.T
        return Phi, 0.5 * (Q + Q.T)

    def to_physical(self, mechanization: Mechanization, time: float, row: Array) -> Array:
        """Return T, as `ErrorModel.to_physical`: its row of the vertical displacement is zero."""
        used = _checked(mechanization)
        level = used.levels(row[None])[0]
        tensor = _curvature(used, level)
        n = self.physical_size
        out = np.zeros((n, n))
        # The normal turns by theta x zeta, and the displacement turns it so.
        out[0:2, THETA] = np.linalg.solve(tensor, [[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
        out[3:6, DV] = np.eye(3)
        out[3:6, THETA] = -_cross(level[V_L : V_L + 3])
        out[6:9, EPS] = np.eye(3)
        out[PHYSICAL:, PHYSICAL:] = np.eye(n - PHYSICAL)
        return out @ _inverse(self._components(used, time, row))[:n]

    def from_physical(self, mechanization: Mechanization, time: float, row: Array) -> Array:
        """Return E, as `ErrorModel.from_physical`: a vertical displacement is lost."""
        used = _checked(mechanization)
        level = used.levels(row[None])[0]
        n = self.physical_size
        out = np.zeros((n, n))
        out[THETA, 0:2] = [[0.0, -1.0], [1.0, 0.0], [0.0, 0.0]] @ _curvature(used, level)
        out[DV, 3:6] = np.eye(3)
        out[DV, 0:2] = _cross(level[V_L : V_L + 3]) @ out[THETA, 0:2]
        if used.height == "held":
            out[kernel.DV + 2] = 0.0
        out[EPS, 6:9] = np.eye(3)
        out[PHYSICAL:, PHYSICAL:] = np.eye(n - PHYSICAL)
        return self._components(used, time, row)[:, :n] @ out

    def null_directions(self, mechanization: Mechanization, time: float, row: Array) -> Array:
        """Return what is nothing physical.

        Parameters
        ----------
        mechanization : Mechanization
        time : float, s
        row : ndarray

        Returns
        -------
        ndarray, (3, n)
            Norm of ``q_ib``, norm of ``q_ew``, and a turn of the level axes about zeta by 1 rad.
        """
        used = _checked(mechanization)
        level = used.levels(row[None])[0]
        n = self.physical_size
        components = self._components(used, time, row)
        gauge = np.zeros(n)
        gauge[kernel.THETA + 2] = 1.0
        gauge[kernel.DV : kernel.DV + 2] = level[V_L + 1], -level[V_L]
        return np.stack([components[:, n], components[:, n + 1], components[:, :n] @ gauge])

    def _components(self, used: Mechanization, time: float, row: Array) -> Array:
        """States of the variables of the kernel, and last of the two norms."""
        n = self.physical_size
        place, body = row[rows.Q_EW : rows.Q_EW + 4], row[rows.Q_WB : rows.Q_WB + 4]
        half = 0.5 * find_ellipsoid(used.ellipsoid).rotation_rate * time
        of_earth = np.array([math.cos(half), 0.0, 0.0, math.sin(half)])
        units = np.eye(4)
        # Columns: the quaternion times, or between two, each of 1, i, j, k.
        left = rotation.compose(place, units).T
        around = rotation.compose(
            rotation.compose(rotation.compose(of_earth, place), units), body
        ).T
        out = np.zeros((n + 2, n + 2))
        out[VELOCITY, DV] = np.eye(3)
        out[BODY, EPS], out[BODY, n] = 0.5 * around[:, 1:], 0.5 * around[:, 0]
        out[PLACE, THETA], out[PLACE, n + 1] = 0.5 * left[:, 1:], 0.5 * left[:, 0]
        out[CORE:, PHYSICAL:n] = np.eye(n - PHYSICAL)
        return out


def _inverse(components: Array) -> Array:
    """Inverse of `_components`: columns are orthogonal, those of quaternions half as long."""
    out = components.T.copy()
    out[:, BODY] *= 4.0
    out[:, PLACE] *= 4.0
    return out


def _without_gauge(level: Array, n: int) -> Array:
    """Take the turn of the level axes about zeta out of the variables of the kernel."""
    out = np.eye(n)
    turn = kernel.THETA + 2
    out[turn, turn] = 0.0
    out[kernel.DV, turn], out[kernel.DV + 1, turn] = -level[V_L + 1], level[V_L]
    return out


def _curvature(used: Mechanization, level: Array) -> Array:
    """Turn of the normal, xi and eta, over a horizontal displacement, 1/m."""
    earth = find_ellipsoid(used.ellipsoid)
    across, along = curvatures(
        level[AXIS + 2], level[ALT], earth.semi_major_axis, earth.eccentricity_squared
    )
    k = level[AXIS : AXIS + 2]
    return across * np.eye(2) + along * np.outer(k, k)


def _cross(v: Array) -> Array:
    out: Array = rotation.cross_matrix(v[None])[0]
    return out


def _checked(mechanization: Mechanization) -> Mechanization:
    if not isinstance(mechanization, WanderAzimuth):
        raise ConfigError(
            f"error model '{QuaternionModel.name}' is of a wander azimuth, and '"
            f"{mechanization.name}' has none",
            quantity="mechanization",
            remedy=f"use mechanization '{WanderAzimuth.name}', or error model 'rotation_vector'",
        )
    if mechanization.height == "damped":
        raise ConfigError(
            "an error model has no states for the loop that damps the height",
            quantity="height",
            remedy="use height='held' or 'free', and give heights as measurements",
        )
    return mechanization
