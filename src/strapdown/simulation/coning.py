"""Coning: an axis of the body that runs around a cone, in closed form."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown import rotation
from strapdown.errors import ConfigError
from strapdown.simulation.flat_motion import FlatMotion

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Coning(FlatMotion):
    """Classical coning: tilted by a constant angle about an axis that itself turns.

    ``q(t) = q_nb exp(β e(t))`` with ``e(t) = u cos Ωt + v sin Ωt``; u, v and the cone axis n are
    right-handed. The cone axis is the same in the body and in the mean attitude, and the body
    comes back after each cycle, while each gyro on its own sees a steady turn about n.

    Attributes
    ----------
    half_angle : float, deg
        β, between 0 and 180.
    frequency : float, Hz
    duration : float, s
    axis : tuple of float
        n, in body axes; any length but zero.
    q_nb : tuple of float
        Mean attitude, scalar first.

    Raises
    ------
    ConfigError
        A number is out of its range.

    Notes
    -----
    The body rate is ``Ω sin β (v cos Ωt - u sin Ωt) - 2 Ω sin²(β/2) n``, from
    ``2 q* dq/dt``. Its last term is what the naive sum takes for a turn about n.
    """

    half_angle: float
    frequency: float
    duration: float
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0)
    q_nb: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        for name, value, most, unit in (
            ("half_angle", self.half_angle, 180.0, "deg"),
            ("frequency", self.frequency, np.inf, "Hz"),
            ("duration", self.duration, np.inf, "s"),
        ):
            if not 0.0 < value < most:
                raise ConfigError(
                    "simulation.cone-out-of-range"
                    if np.isfinite(most)
                    else "simulation.cone-not-positive",
                    quantity=name,
                    value=value,
                    unit=unit,
                    most=most,
                )
        length = float(np.linalg.norm(self.axis))
        if not (np.isfinite(length) and length > 0.0):
            raise ConfigError("simulation.no-direction", quantity="axis", axis=self.axis)

    def rate(self, time: ArrayLike) -> Array:
        """Body rate.

        Parameters
        ----------
        time : array_like, (n,), s

        Returns
        -------
        ndarray, (n, 3), rad/s
        """
        u, v, n = self._triad()
        cos, sin = self._cycle(time)
        side = self._omega * np.sin(self._beta)
        rate: Array = side * (cos * v - sin * u) - self._steady * n
        return rate

    def angle(self, time: ArrayLike) -> Array:
        """Integral of the body rate from time zero, in closed form.

        Parameters
        ----------
        time : array_like, (n,), s

        Returns
        -------
        ndarray, (n, 3), rad
        """
        u, v, n = self._triad()
        cos, sin = self._cycle(time)
        t = np.asarray(time, dtype=np.float64)[:, None]
        side = np.sin(self._beta) * (sin * v + (cos - 1.0) * u)
        angle: Array = side - self._steady * t * n
        return angle

    def attitude(self, time: ArrayLike) -> Array:
        """Exact attitude.

        Parameters
        ----------
        time : array_like, (n,), s

        Returns
        -------
        ndarray, (n, 4)
        """
        u, v, _ = self._triad()
        cos, sin = self._cycle(time)
        tilt = rotation.quaternion_from_rotation_vector(self._beta * (cos * u + sin * v))
        return rotation.compose(np.asarray(self.q_nb, dtype=np.float64), tilt)

    def acceleration(self, time: ArrayLike) -> Array:
        """Zero: the body stays in its place; (n, 3), m/s²."""
        return np.zeros((np.size(time), 3))

    def velocity(self, time: ArrayLike) -> Array:
        """Zero: the body stays in its place; (n, 3), m/s."""
        return np.zeros((np.size(time), 3))

    def position(self, time: ArrayLike) -> Array:
        """Zero: the body stays in its place; (n, 3), m."""
        return np.zeros((np.size(time), 3))

    @property
    def _beta(self) -> float:
        return float(np.radians(self.half_angle))

    @property
    def _omega(self) -> float:
        return 2.0 * np.pi * self.frequency

    @property
    def _steady(self) -> float:
        return float(2.0 * self._omega * np.sin(0.5 * self._beta) ** 2)

    def _cycle(self, time: ArrayLike) -> tuple[Array, Array]:
        # Whole cycles are taken away before pi makes them inexact.
        cycles = np.fmod(np.asarray(time, dtype=np.float64) * self.frequency, 1.0)
        phase = 2.0 * np.pi * cycles[:, None]
        return np.cos(phase), np.sin(phase)

    def _triad(self) -> tuple[Array, Array, Array]:
        n = np.asarray(self.axis, dtype=np.float64)
        n = n / np.linalg.norm(n)
        # u in the plane of n and the body axis after n's largest: forward for a cone about down.
        u = np.zeros(3)
        u[(int(np.argmax(np.abs(n))) + 1) % 3] = 1.0
        u -= (u @ n) * n
        u /= np.linalg.norm(u)
        return u, np.cross(n, u), n
