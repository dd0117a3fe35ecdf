"""Coning and sculling motions in closed form."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown import rotation
from strapdown.errors import ConfigError
from strapdown.simulation.motion import FlatMotion

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Coning(FlatMotion):
    """Classical coning: a tilt of constant angle about a rotating axis.

    ``q(t) = q_nb exp(β e(t))`` with ``e(t) = u cos Ωt + v sin Ωt``; u, v and the cone axis n are
    right-handed. The cone axis is the same in the body and in the mean attitude. The body returns
    to its attitude after each cycle, while the mean gyro rate about n is not zero.

    Attributes
    ----------
    half_angle : float, deg
        β, between 0 and 180.
    frequency : float, Hz
    duration : float, s
    axis : tuple of float
        n, in body axes; any nonzero length.
    q_nb : tuple of float
        Mean attitude, scalar first.

    Raises
    ------
    ConfigError
        A number is out of its range.

    Notes
    -----
    The body rate is ``Ω sin β (v cos Ωt - u sin Ωt) - 2 Ω sin²(β/2) n``, from ``2 q* dq/dt``.
    Summing rates without coning correction takes its last term for a rotation about n.
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
        """Body rate; (n, 3), rad/s."""
        u, v, n = self._triad()
        cos, sin = self._cycle(time)
        side = self._omega * np.sin(self._beta)
        rate: Array = side * (cos * v - sin * u) - self._steady * n
        return rate

    def angle(self, time: ArrayLike) -> Array:
        """Integral of the body rate from time zero, in closed form; (n, 3), rad."""
        u, v, n = self._triad()
        cos, sin = self._cycle(time)
        t = np.asarray(time, dtype=np.float64)[:, None]
        side = np.sin(self._beta) * (sin * v + (cos - 1.0) * u)
        angle: Array = side - self._steady * t * n
        return angle

    def attitude(self, time: ArrayLike) -> Array:
        """Exact attitude; (n, 4)."""
        u, v, _ = self._triad()
        cos, sin = self._cycle(time)
        tilt = rotation.quaternion_from_rotation_vector(self._beta * (cos * u + sin * v))
        return rotation.compose(np.asarray(self.q_nb, dtype=np.float64), tilt)

    def acceleration(self, time: ArrayLike) -> Array:
        """Zero, (n, 3), m/s²: the position is constant."""
        return np.zeros((np.size(time), 3))

    def velocity(self, time: ArrayLike) -> Array:
        """Zero, (n, 3), m/s: the position is constant."""
        return np.zeros((np.size(time), 3))

    def position(self, time: ArrayLike) -> Array:
        """Zero, (n, 3), m: the position is constant."""
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
        # Whole cycles are removed before the multiplication by pi rounds them.
        cycles = np.fmod(np.asarray(time, dtype=np.float64) * self.frequency, 1.0)
        phase = 2.0 * np.pi * cycles[:, None]
        return np.cos(phase), np.sin(phase)

    def _triad(self) -> tuple[Array, Array, Array]:
        n = np.asarray(self.axis, dtype=np.float64)
        n = n / np.linalg.norm(n)
        # u lies in the plane of n and the body axis after n's largest: forward for a cone about
        # down.
        u = np.zeros(3)
        u[(int(np.argmax(np.abs(n))) + 1) % 3] = 1.0
        u -= (u @ n) * n
        u /= np.linalg.norm(u)
        return u, np.cross(n, u), n


# Sculling: angular vibration about one axis and linear vibration along another, in closed form.

Complex = NDArray[np.complex128]
Whole = NDArray[np.int64]
# Harmonics kept on each side: J_m(pi) of the next is under 1e-24.
HARMONICS = 28


@dataclass(frozen=True)
class Sculling(FlatMotion):
    """An angular vibration and a linear vibration of the same frequency along a perpendicular axis.

    The body rotates by ``α sin Ωt`` about n. Along the body axis e, perpendicular to n, it is
    accelerated by ``B sin(Ωt + ψ)``. In phase (ψ = 0) this gives a steady acceleration ``B J1(α)``
    along n x e, although no accelerometer has a steady output; in quadrature (ψ = 90°) the residual
    of a cycle is a distance.

    Attributes
    ----------
    swing : float, deg
        α, above 0 and at most 180.
    push : float, m/s²
        B.
    frequency : float, Hz
    duration : float, s
    phase : float, deg
        ψ.
    swing_axis, push_axis : tuple of float
        n and e in body axes, perpendicular; any nonzero length.
    q_nb : tuple of float
        Mean attitude, scalar first.

    Raises
    ------
    ConfigError
        A number is out of its range, or the axes are not perpendicular.

    Notes
    -----
    With ``z = e + i (n x e)`` the acceleration is ``B exp(iα sin Ωt) sin(Ωt + ψ)``, by the
    Jacobi-Anger expansion (DLMF 10.12.1) a sum of ``B/2i (J[m-1](α) exp(iψ) - J[m+1](α)
    exp(-iψ)) exp(imΩt)``, whose integrals are closed.
    """

    swing: float
    push: float
    frequency: float
    duration: float
    phase: float = 0.0
    swing_axis: tuple[float, float, float] = (1.0, 0.0, 0.0)
    push_axis: tuple[float, float, float] = (0.0, 1.0, 0.0)
    q_nb: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        for name, value, most, unit in (
            ("swing", self.swing, 180.0, "deg"),
            ("push", self.push, np.inf, "m/s2"),
            ("frequency", self.frequency, np.inf, "Hz"),
            ("duration", self.duration, np.inf, "s"),
        ):
            if not (0.0 < value <= most and np.isfinite(value)):
                raise ConfigError(
                    "simulation.sculling-out-of-range"
                    if np.isfinite(most)
                    else "simulation.sculling-not-positive",
                    quantity=name,
                    value=value,
                    unit=unit,
                    most=most,
                )
        if not np.isfinite(self.phase):
            raise ConfigError("simulation.no-angle", quantity="phase", phase=self.phase)
        n, e = np.asarray(self.swing_axis), np.asarray(self.push_axis)
        length = float(np.linalg.norm(n) * np.linalg.norm(e))
        if not (np.isfinite(length) and length > 0.0 and abs(n @ e) <= 1e-9 * length):
            raise ConfigError(
                "simulation.do-not-stand-across-each",
                quantity="push_axis",
                swing_axis=self.swing_axis,
                push_axis=self.push_axis,
            )

    @property
    def drift(self) -> float:
        """Steady acceleration along n x e, ``B J1(α) cos ψ``, m/s²."""
        from scipy.special import j1

        return float(self.push * j1(self._alpha) * np.cos(self._psi))

    def rate(self, time: ArrayLike) -> Array:
        """Body rate, (n, 3), rad/s, at instants (n,) in s."""
        phase = self._cycle(time)
        return np.asarray(self._alpha * self._omega * np.cos(phase)[:, None] * self._triad[0])

    def angle(self, time: ArrayLike) -> Array:
        """Integral of the body rate from time zero, (n, 3), rad."""
        phase = self._cycle(time)
        return np.asarray(self._alpha * np.sin(phase)[:, None] * self._triad[0])

    def shake(self, time: ArrayLike) -> Array:
        """Acceleration in body axes, (n, 3), m/s²: specific force without gravity."""
        phase = self._cycle(time) + self._psi
        return np.asarray(self.push * np.sin(phase)[:, None] * self._triad[1])

    def shake_sum(self, time: ArrayLike) -> Array:
        """Integral of `shake` from time zero, axis by axis, (n, 3), m/s."""
        phase = self._cycle(time) + self._psi
        swept = (np.cos(self._psi) - np.cos(phase)) / self._omega
        return np.asarray(self.push * swept[:, None] * self._triad[1])

    def attitude(self, time: ArrayLike) -> Array:
        """Exact attitude ``q_nb``, (n, 4)."""
        turn = rotation.quaternion_from_rotation_vector(self.angle(time))
        return rotation.compose(np.asarray(self.q_nb, dtype=np.float64), turn)

    def acceleration(self, time: ArrayLike) -> Array:
        """Exact acceleration, north-east-down, (n, 3), m/s²."""
        return rotation.rotate(self.attitude(time), self.shake(time))

    def velocity(self, time: ArrayLike) -> Array:
        """Exact velocity since time zero, north-east-down, (n, 3), m/s."""
        t, m, g, turned = self._harmonics(time)
        return self._local(t * g[HARMONICS] + turned @ np.where(m == 0, 0.0, g))

    def position(self, time: ArrayLike) -> Array:
        """Exact position since time zero, north-east-down, (n, 3), m."""
        t, m, g, turned = self._harmonics(time)
        # The integral of a velocity term (exp(imp) - 1)/(im Omega) is the term over im Omega, minus
        # t over im Omega.
        slow = np.where(m == 0, 0.0, g / (1j * np.where(m == 0, 1, m) * self._omega))
        return self._local(0.5 * t * t * g[HARMONICS] + turned @ slow - t * slow.sum())

    def _harmonics(self, time: ArrayLike) -> tuple[Array, Whole, Complex, Complex]:
        """Times, harmonic numbers, their amplitudes, and ``int exp(im Omega t) dt``."""
        from scipy.special import jv

        t = np.asarray(time, dtype=np.float64)
        m = np.arange(-HARMONICS, HARMONICS + 1)
        turn = np.exp(1j * self._psi)
        g = self.push / 2j * (jv(m - 1, self._alpha) * turn - jv(m + 1, self._alpha) / turn)
        full = np.exp(1j * np.outer(self._cycle(t), m)) - 1.0
        return t, m, g, full / (1j * np.where(m == 0, 1, m) * self._omega)

    def _local(self, z: Complex) -> Array:
        _, e, side = self._triad
        body = z.real[:, None] * e + z.imag[:, None] * side
        return rotation.rotate(np.asarray(self.q_nb, dtype=np.float64), body)

    @property
    def _alpha(self) -> float:
        return float(np.radians(self.swing))

    @property
    def _psi(self) -> float:
        return float(np.radians(self.phase))

    @property
    def _omega(self) -> float:
        return 2.0 * np.pi * self.frequency

    def _cycle(self, time: ArrayLike) -> Array:
        # Whole cycles are removed before the multiplication by pi rounds them.
        cycles = np.fmod(np.asarray(time, dtype=np.float64) * self.frequency, 1.0)
        return np.asarray(2.0 * np.pi * cycles)

    @cached_property
    def _triad(self) -> tuple[Array, Array, Array]:
        n = np.asarray(self.swing_axis, dtype=np.float64)
        e = np.asarray(self.push_axis, dtype=np.float64)
        n, e = n / np.linalg.norm(n), e / np.linalg.norm(e)
        return n, e, np.cross(n, e)
