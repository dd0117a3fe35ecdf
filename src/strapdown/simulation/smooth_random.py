"""Smooth random motion in a given band, from rest to rest."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.polynomial import polynomial
from numpy.typing import ArrayLike, NDArray

from strapdown.errors import ConfigError
from strapdown.simulation.minimum_jerk import minimum_jerk
from strapdown.simulation.motion import FlatMotion, Quaternion, euler_attitude, euler_body_rate
from strapdown.simulation.rate_integral import RateIntegral, integrate_rate

Array = NDArray[np.float64]

# Instants per batch, so that the intermediate arrays stay in the cache.
_CHUNK = 16384


@dataclass(frozen=True)
class SmoothRandom(FlatMotion):
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

    def rate(self, time: ArrayLike) -> Array:
        """Body rate.

        Returns (n, 3), rad/s, exactly zero at rest.
        """
        angles, rates, _ = self._evaluate(time, self._angle_series)
        return euler_body_rate(angles, rates)

    def angle(self, time: ArrayLike) -> Array:
        """Integral of the body rate from time zero.

        `time` ((n,), s): before zero and after the end the integral is held constant. Returns (n,
        3), rad, within 1e-14 rad, plus rounding (`rate_integral.integrate_rate`).
        """
        return self._integral(time)

    def attitude(self, time: ArrayLike) -> Array:
        """Exact attitude.

        Returns
        -------
        ndarray, (n, 4)
            ``q_nb``, continuous in sign.
        """
        return euler_attitude(self._evaluate(time, self._angle_series)[0], self.q_nb)

    def acceleration(self, time: ArrayLike) -> Array:
        """Acceleration without gravity; (n, 3), north-east-down, m/s²."""
        return self._evaluate(time, self._position_series)[2]

    def velocity(self, time: ArrayLike) -> Array:
        """Velocity; (n, 3), north-east-down, m/s."""
        return self._evaluate(time, self._position_series)[1]

    def position(self, time: ArrayLike) -> Array:
        """Position; (n, 3), north-east-down, m."""
        return self._evaluate(time, self._position_series)[0]

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

    @cached_property
    def _integral(self) -> RateIntegral:
        ramps = (self.rest, self.rest + self.ramp)
        breaks = [0.0, *ramps, *(self.duration - r for r in ramps), self.duration]
        return integrate_rate(self.rate, breaks)
