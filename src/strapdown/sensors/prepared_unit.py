"""A unit after preparation: common clock, vehicle axes, one range, biases taken off."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.errors import Finding
from strapdown.results.rests import RestStretch
from strapdown.sensors.crash_unit import CrashUnit
from strapdown.sensors.triad_errors import Triad

Array = NDArray[np.float64]

# In `PreparedUnit.bias_from`: from gravity in the stated attitude.
FROM_GRAVITY = -1


@dataclass(frozen=True)
class Levelling:
    """Roll and pitch of the vehicle at rest, and how they are known.

    Attributes
    ----------
    roll_deg, pitch_deg : float, deg
    sd_deg : float, deg
        Of each, without what a bias of the accelerometer does: noise of the mean and what the
        user states. The bias's share is a contributor of its own, since it also acts later.
    from_rest : bool
        Found from the accelerometers at rest (or at constant velocity); otherwise stated.
    """

    roll_deg: float
    pitch_deg: float
    sd_deg: float
    from_rest: bool


@dataclass(frozen=True, eq=False)
class PreparedUnit:
    """What a unit says after everything that is done before navigation.

    Attributes
    ----------
    unit : CrashUnit
        As recorded.
    imu : DataFrame
        Imu table in vehicle axes, at the unit's own place, time from the common trigger in s;
        biases that were found are taken off.
    range_spoken : ndarray of int8, (n, 3)
        Which of `unit.accelerometers` spoke, in each sensor axis.
    clipped : ndarray of bool, (n, 3)
        Whether even the one that spoke was at its end, in each sensor axis.
    gyro_clipped : ndarray of bool, (n, 3)
    noise : ndarray, (n, 3), m/s²
        Standard deviation of each sample of the specific force, in sensor axes.
    gyro_noise : ndarray, (n, 3), rad/s
        The same of the rates.
    rest : RestStretch or None
        The stationary (or steady) stretch before the crash, as measured by the lowest range, in
        vehicle axes, common clock.
    rest_accel_sd : float, m/s²
        What is not known of the vehicle's own acceleration over it, each axis: zero at rest.
    levelling : Levelling
    gyro_bias_sd : triad, rad/s
        Left after the rest; sensor axes of the unit that has the gyro.
    bias_from : tuple of int or None
        For every range, the range that its bias was taken from, `FROM_GRAVITY` where it was
        taken from gravity in the stated attitude, None where its own is left.
    bias_sd : tuple of triad, m/s²
        How well that difference is known (noise of the means), for every range.
    gravity_matched : bool
        Whether a correction along the specific force at rest makes its length gravity's.
    gravity_correction : float, m/s²
        That was added along the specific force at rest.
    findings : tuple of Finding
    """

    unit: CrashUnit
    imu: pd.DataFrame
    range_spoken: NDArray[np.int8]
    clipped: NDArray[np.bool_]
    gyro_clipped: NDArray[np.bool_]
    noise: Array
    gyro_noise: Array
    rest: RestStretch | None
    rest_accel_sd: float
    levelling: Levelling
    gyro_bias_sd: Triad
    bias_from: tuple[int | None, ...]
    bias_sd: tuple[Triad, ...]
    gravity_matched: bool
    gravity_correction: float = 0.0
    findings: tuple[Finding, ...] = ()

    @property
    def noise_covariance(self) -> Array:
        """Covariance of each sample of the specific force, vehicle axes, (n, 3, 3), (m/s²)²."""
        return self._in_vehicle_axes(self.noise)

    @property
    def gyro_noise_covariance(self) -> Array:
        """Covariance of each sample of the rates, vehicle axes, (n, 3, 3), (rad/s)²."""
        return self._in_vehicle_axes(self.gyro_noise)

    def _in_vehicle_axes(self, sd: Array) -> Array:
        C = self.unit.mounting.C_vs
        return np.asarray(np.einsum("ij,nj,kj->nik", C, sd**2, C))
