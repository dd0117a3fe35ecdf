"""Rotations from rest to rest or periodic: coning, sculling, smooth random, gestures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.polynomial import polynomial
from numpy.typing import ArrayLike, NDArray

from strapdown import rotation
from strapdown.errors import ConfigError
from strapdown.simulation.motion import (
    STILL,
    EulerMotion,
    FlatMotion,
    Quaternion,
    Track,
    check_numbers,
    minimum_jerk,
)
from strapdown.tables.checks import Array


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
        check_numbers(self, positive="half_angle frequency duration")
        if not self.half_angle < 180.0:
            raise ConfigError("simulation.cone-out-of-range", quantity="half_angle")
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
        check_numbers(self, positive="swing push frequency duration", finite="phase")
        if not self.swing <= 180.0:
            raise ConfigError("simulation.sculling-out-of-range", quantity="swing")
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


# Instants per batch, so that the intermediate arrays stay in the cache.
_CHUNK = 16384


@dataclass(frozen=True)
class SmoothRandom(EulerMotion):
    """Random-phase Fourier series for the 3-2-1 angles and the position.

    The spectra of the three angle rates and the three accelerations are flat over the band: equal
    amplitudes at all multiples of one cycle per moving time. A minimum-jerk ramp starts the motion
    from rest and returns it to exactly the same pose.

    Attributes
    ----------
    duration : float, s
        Including both rests.
    seed : int
        Seed of the phases; the same seed gives the same motion on every machine.
    rms_rate : float, deg/s
        Root mean square length of (roll', pitch', heading') under the full ramp. The three are
        independent, so the body rate has the same value in the mean over seeds.
    rms_acceleration : float, m/s²
        Root mean square length of the acceleration under the full ramp.
    band : tuple of float, Hz
        Lowest and highest frequency of the series. The body rate, a product of several series,
        extends slightly above.
    ramp : float, s
        Duration of the ramp from rest to full motion, and back.
    rest : float, s
        Rest before the first ramp, and after the last.
    q_nb : tuple of float
        Initial attitude, scalar first.

    Raises
    ------
    ConfigError
        Ramps and rests do not fit, or the band contains no multiple of a cycle per moving time.
    """

    duration: float
    seed: int
    rms_rate: float
    rms_acceleration: float = 0.0
    band: tuple[float, float] = (0.1, 2.0)
    ramp: float = 2.0
    rest: float = 2.0
    q_nb: Quaternion = (1.0, 0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        if not (self.ramp > 0.0 <= self.rest and 2.0 * self.ramp <= self._moving < np.inf):
            raise ConfigError(
                "simulation.two-rests-two-ramps-do",
                quantity="duration",
                rest=self.rest,
                ramp=self.ramp,
                duration=self.duration,
                rest_2=2.0 * (self.rest + self.ramp),
            )
        first, last = self._orders
        if not 1 <= first <= last:
            raise ConfigError(
                "simulation.no-multiple-hz-cycle-moving",
                quantity="band",
                moving=1.0 / self._moving,
                band=self.band[0],
                band_2=self.band[1],
            )

    def turned(self, time: ArrayLike) -> tuple[Array, Array, Array]:
        """As `EulerMotion.turned`."""
        return self._evaluate(time, self._angle_series)

    def moved(self, time: ArrayLike) -> tuple[Array, Array, Array]:
        """As `FlatMotion.moved`."""
        return self._evaluate(time, self._position_series)

    @property
    def breaks(self) -> Sequence[float]:
        """Ends of the motion and of the ramps, s."""
        ramps = (self.rest, self.rest + self.ramp)
        return [0.0, *ramps, *(self.duration - r for r in ramps), self.duration]

    @property
    def _moving(self) -> float:
        return self.duration - 2.0 * self.rest

    @property
    def _orders(self) -> tuple[int, int]:
        """First and last multiple of a cycle per moving time within the band."""
        # A band limit that is itself a multiple is included, independent of rounding.
        first = np.ceil(self.band[0] * self._moving * (1.0 - 1e-12))
        last = np.floor(self.band[1] * self._moving * (1.0 + 1e-12))
        return int(first), int(last)

    @property
    def _omega(self) -> Array:
        first, last = self._orders
        orders = np.arange(first, last + 1, dtype=np.float64)[:, None]
        omega: Array = 2.0 * np.pi * orders / self._moving
        return omega

    @cached_property
    def _phases(self) -> NDArray[np.complex128]:
        first, last = self._orders
        uniform = np.random.Generator(np.random.PCG64(self.seed)).random((last - first + 1, 6))
        out: NDArray[np.complex128] = np.exp(2j * np.pi * uniform)
        return out

    @property
    def _angle_series(self) -> NDArray[np.complex128]:
        """Complex amplitudes of the angles, deg."""
        # K terms of amplitude a on each of three axes have the mean square 3 K a²/2.
        amplitude = self.rms_rate / np.sqrt(1.5 * len(self._omega))
        out: NDArray[np.complex128] = amplitude / self._omega * self._phases[:, :3]
        return out

    @property
    def _position_series(self) -> NDArray[np.complex128]:
        """Complex amplitudes of the position, m."""
        amplitude = self.rms_acceleration / np.sqrt(1.5 * len(self._omega))
        out: NDArray[np.complex128] = amplitude / self._omega**2 * self._phases[:, 3:]
        return out

    def _evaluate(
        self, time: ArrayLike, series: NDArray[np.complex128]
    ) -> tuple[Array, Array, Array]:
        """Ramp times series, and the first two derivatives, (n, 3) each."""
        t = np.asarray(time, dtype=np.float64) - self.rest
        i_omega = 1j * self._omega
        # One polynomial in exp(i 2π t / moving) for the series and its two derivatives.
        columns = np.hstack([series, i_omega * series, i_omega * i_omega * series])
        out = np.empty((9, t.size))
        for start in range(0, t.size, _CHUNK):
            part = t[start : start + _CHUNK]
            cycles = np.fmod(part / self._moving, 1.0)
            z = np.exp(2j * np.pi * cycles)
            lowest = np.exp(2j * np.pi * np.fmod(self._orders[0] * cycles, 1.0))
            f = (polynomial.polyval(z, columns) * lowest).real
            w, dw, ddw = self._window(part)
            f0, f1, f2 = f[:3], f[3:6], f[6:]
            out[:3, start : start + _CHUNK] = w * f0
            out[3:6, start : start + _CHUNK] = dw * f0 + w * f1
            out[6:, start : start + _CHUNK] = ddw * f0 + 2.0 * dw * f1 + w * f2
        return out[:3].T, out[3:6].T, out[6:].T

    def _window(self, since: Array) -> tuple[Array, Array, Array]:
        late = since > 0.5 * self._moving
        w, first, second = minimum_jerk(np.where(late, self._moving - since, since) / self.ramp)
        return w, np.where(late, -first, first) / self.ramp, second / self.ramp**2


@dataclass(frozen=True)
class Gesture(EulerMotion):
    """Six coordinates, each following a minimum-jerk profile from value to value.

    Where all tracks are constant, rate, velocity and acceleration are exactly zero. Where the
    values equal those of another rest, or differ by whole turns, the pose is identical to the last
    bit (the quaternion except for its sign).

    Attributes
    ----------
    duration : float, s
    roll, pitch, heading : Track, deg
        3-2-1 angles from the initial attitude; any number of turns.
    north, east, down : Track, m
    q_nb : tuple of float
        Initial attitude, scalar first.

    Raises
    ------
    ConfigError
        The duration is not positive.
    """

    duration: float
    roll: Track = STILL
    pitch: Track = STILL
    heading: Track = STILL
    north: Track = STILL
    east: Track = STILL
    down: Track = STILL
    q_nb: Quaternion = (1.0, 0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        check_numbers(self, positive="duration")

    def turned(self, time: ArrayLike) -> tuple[Array, Array, Array]:
        """As `EulerMotion.turned`."""
        return _evaluate((self.roll, self.pitch, self.heading), time)

    def moved(self, time: ArrayLike) -> tuple[Array, Array, Array]:
        """As `FlatMotion.moved`."""
        return _evaluate((self.north, self.east, self.down), time)

    @property
    def breaks(self) -> Sequence[float]:
        """Ends of the motion and of all moves of the angles, s."""
        knots = [*self.roll.times, *self.pitch.times, *self.heading.times]
        return [0.0, *(t for t in knots if 0.0 < t < self.duration), self.duration]


def gesture(poses: Sequence[Sequence[float]], duration: float) -> Gesture:
    """Make a gesture from a list of poses with a stop at each.

    Parameters
    ----------
    poses : sequence of (time, roll, pitch, heading, north, east, down)
        s, deg, m; rising times.
    duration : float, s
    """
    times, *columns = (tuple(float(x) for x in column) for column in zip(*poses, strict=True))
    roll, pitch, heading, north, east, down = (Track(times, values) for values in columns)
    return Gesture(duration, roll, pitch, heading, north, east, down)


def _evaluate(tracks: tuple[Track, Track, Track], time: ArrayLike) -> tuple[Array, Array, Array]:
    values, first, second = zip(*(track.evaluate(time) for track in tracks), strict=True)
    return np.column_stack(values), np.column_stack(first), np.column_stack(second)


@dataclass(frozen=True)
class Handling(EulerMotion):
    """Random gestures, each from a pose on the table and back to exactly that pose.

    Between gestures the phone rests for 1.5 to 5 s. A gesture has three to seven minimum-jerk moves
    of 0.6 to 1.6 s, to rolls of up to ±60°, pitches of up to ±70°, headings of up to ±120°, and
    positions up to 0.3 m north or south, east or west, and 0.1 to 0.5 m above the table; then it
    returns in 1 to 1.5 s.

    Attributes
    ----------
    duration : float, s
        At least 5; the last rest takes the time that no gesture fits into.
    seed : int
        The same seed gives the same motion on every machine.

    Raises
    ------
    ConfigError
        The duration is under 5 s.
    """

    duration: float
    seed: int

    def __post_init__(self) -> None:
        if not 5.0 <= self.duration < np.inf:
            raise ConfigError(
                "simulation.no-gesture-fits-into", quantity="duration", duration=self.duration
            )

    @cached_property
    def gestures(self) -> Gesture:
        """The generated motion."""
        draw = np.random.Generator(np.random.PCG64(self.seed)).integers
        home = (0.0,) * 6
        poses: list[tuple[float, ...]] = [(0.0, *home)]
        tenths = 0  # integers, so that times are identical on every machine
        while True:
            tenths += int(draw(15, 51))
            rows: list[tuple[float, ...]] = [(tenths / 10, *home)]
            for _ in range(int(draw(3, 8))):
                tenths += int(draw(6, 17))
                turned = (draw(-60, 61), draw(-70, 71), draw(-120, 121))
                moved = (draw(-30, 31) / 100, draw(-30, 31) / 100, draw(-50, -9) / 100)
                rows.append((tenths / 10, *(float(x) for x in (*turned, *moved))))
            tenths += int(draw(10, 16))
            rows.append((tenths / 10, *home))
            if tenths / 10 > self.duration - 1.5:
                return gesture(poses, self.duration)
            poses += rows

    def turned(self, time: ArrayLike) -> tuple[Array, Array, Array]:
        """As `EulerMotion.turned`."""
        return self.gestures.turned(time)

    def moved(self, time: ArrayLike) -> tuple[Array, Array, Array]:
        """As `FlatMotion.moved`."""
        return self.gestures.moved(time)

    @property
    def q_nb(self) -> Quaternion:  # type: ignore[override]
        """Initial attitude: level, heading north."""
        return self.gestures.q_nb

    @property
    def breaks(self) -> Sequence[float]:
        """Ends of the motion and of all moves of the angles, s."""
        return self.gestures.breaks
