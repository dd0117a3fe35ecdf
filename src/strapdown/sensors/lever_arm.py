"""Lever arm correction: specific force at another point of a rigid body."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from strapdown.dsp.derivative import LocalSlope, local_slope
from strapdown.errors import ConfigError
from strapdown.rotation import cross_matrix
from strapdown.sensors.pre_crash import PreparedUnit
from strapdown.sensors.triad_errors import triple
from strapdown.tables import ACCEL, GYRO, check_imu, imu_table
from strapdown.tables.checks import Array, check_columns


@dataclass(frozen=True, eq=False)
class MovedImu:
    """Readings of an ideal accelerometer at another point of the body.

    `imu`: Imu table; the rates are those given. `lever_arm` ((3,), m): from the original to the new
    point, body axes. `angular_acceleration` ((n, 3), rad/s²). `added` ((n, 3, 3), (m/s²)²):
    covariance that gyro noise adds to each sample. Neighboring samples are correlated: `slope` has
    the weights. `bandwidth` (Hz): bandwidth of the angular acceleration; for faster rotation the
    correction is too small. `slope`: differentiation filter used.
    """

    imu: pd.DataFrame
    lever_arm: Array
    angular_acceleration: Array
    added: Array
    bandwidth: float
    slope: LocalSlope

    @cached_property
    def turning(self) -> Array:
        """Rates at which the angular acceleration is evaluated, (n, 3), rad/s."""
        return self.slope.value_of(self.imu[GYRO].to_numpy(dtype=np.float64))

    @cached_property
    def lever(self) -> Array:
        """Sensitivity of each sample to the lever arm, (n, 3, 3), 1/s²."""
        return lever_matrix(self.angular_acceleration, self.turning)

    def of_rate(self, rate: Array) -> Array:
        """Specific force error due to small rate errors through the lever arm.

        `rate` ((n, 3), rad/s). Returns (n, 3), m/s².
        """
        by_value = rate_effect(self.turning, self.lever_arm)
        turned = np.einsum("nij,nj->ni", by_value, self.slope.value_of(rate))
        return np.asarray(np.cross(self.slope.slope_of(rate), self.lever_arm) + turned)

    def of_rates_in_sums(self, weights: Array) -> Array:
        """Weights of the rate errors in sums of the specific force.

        `weights` ((m, n)): weights of the specific force samples in each of m sums. Returns (m, n,
        3, 3): from an error of each rate to each axis of each sum.
        """
        by_slope = self.slope.weighted(weights)[0]
        out = np.einsum("an,ij->anij", by_slope, -cross_matrix(self.lever_arm))
        by_value = rate_effect(self.turning, self.lever_arm)
        for axis in range(3):
            for other in range(3):
                rows = weights * by_value[:, axis, other]
                out[:, :, axis, other] += self.slope.weighted(rows)[1]
        return np.asarray(out)


def move_imu(
    imu: pd.DataFrame,
    lever_arm: ArrayLike,
    *,
    gyro_noise: ArrayLike = 0.0,
    window: float | None = None,
    gyro_delay: float = 0.0,
) -> MovedImu:
    """Move the specific force of an Imu table from point S to point P.

    Parameters
    ----------
    imu : DataFrame
        Imu table with acceleration, in any body-fixed axes.
    lever_arm : array_like, (3,), m
        From S to P in those axes.
    gyro_noise : array_like, rad/s
        Standard deviation of a sample, white: a number, (3,), (n, 3) standard deviations, or (n, 3,
        3) covariances. For a gyro interpolated from a lower rate, multiply by the root of the ratio
        of the steps, and let the window cover several of its original steps.
    window : float, s, optional
        As `local_slope`: window of the polynomial whose slope is the angular acceleration.
    gyro_delay : float, s
        Delay of the gyro relative to the accelerometer: the difference of the group delays of their
        filters, ``1 / (2 pi bandwidth)`` for a single pole.

    Notes
    -----
    ``f_P = f_S + dω/dt × r + ω × (ω × r)``. The correction is linear in r: with the same window, S
    to P to S restores the input to rounding. For mean samples, ``ω × (ω × r)`` of the mean rate is
    smaller than its mean by ``|r| α² dt² / 12``. The body must be rigid between S and P.

    Raises
    ------
    DataError
        The table is not an Imu table with acceleration.
    ConfigError
        The lever arm is not three finite numbers; as `local_slope`.
    """
    check_imu(imu)
    check_columns(imu, ACCEL, imu.attrs.get("source"))
    r = np.asarray(lever_arm, dtype=np.float64)
    if r.shape != (3,) or not np.isfinite(r).all():
        raise ConfigError(
            "sensors.not-three-finite-numbers", quantity="lever arm", lever_arm=lever_arm
        )
    time = imu.index.to_numpy(dtype=np.float64)
    gyro = np.ascontiguousarray(imu[GYRO].to_numpy(dtype=np.float64))
    slope = local_slope(time, window=window, delay=gyro_delay)
    alpha, omega = slope.slope_of(gyro), slope.value_of(gyro)
    force = imu[ACCEL].to_numpy(dtype=np.float64) + lever_matrix(alpha, omega) @ r
    moved = imu_table(
        time, gyro, force, sampling=str(imu.attrs["sampling"]), source=imu.attrs.get("source")
    )
    noise = _covariances(gyro_noise, time.size)
    return MovedImu(moved, r, alpha, _added(slope, omega, r, noise), slope.bandwidth, slope)


def move_unit(
    prepared: PreparedUnit,
    point: ArrayLike,
    *,
    window: float | None = None,
    gyro_delay: float = 0.0,
) -> MovedImu:
    """Move a prepared unit from its position to a point of the vehicle.

    `point` ((3,), m): in vehicle axes from the vehicle's origin. `window`, `gyro_delay`: as
    `move_imu`. The result is in vehicle axes.
    """
    noise = prepared.gyro_noise_covariance
    place = triple(point, "point", "sensors.point-not-three-numbers")
    arm = np.asarray(place) - np.asarray(prepared.unit.mounting.position)
    return move_imu(prepared.imu, arm, gyro_noise=noise, window=window, gyro_delay=gyro_delay)


def lever_matrix(alpha: Array, omega: Array) -> Array:
    """Matrices that map a lever arm to a specific force difference.

    `alpha`, `omega` ((n, 3), rad/s² and rad/s). Returns (n, 3, 3), 1/s²: ``[α×] + [ω×]²``; times r,
    ``α × r + ω × (ω × r)``.
    """
    turning = cross_matrix(omega)
    return cross_matrix(alpha) + turning @ turning


def rate_effect(omega: Array, r: Array) -> Array:
    """Derivative of ``ω × (ω × r)`` with respect to the rate.

    `omega` ((n, 3), rad/s). `r` ((3,), m). Returns (n, 3, 3), m/s: ``(ω·r) I + ω rᵀ - 2 r ωᵀ``.
    """
    along = np.einsum("ni,i->n", omega, r)[:, None, None] * np.eye(3)
    return np.asarray(along + omega[:, :, None] * r - 2.0 * r[:, None] * omega[:, None, :])


def _added(slope: LocalSlope, omega: Array, r: Array, noise: Array) -> Array:
    by_slope, by_rate = -cross_matrix(r), rate_effect(omega, r)
    gains = (slope.slope**2).sum(axis=1), (slope.value**2).sum(axis=1)
    both = (slope.slope * slope.value).sum(axis=1)
    mixed = by_slope @ noise @ by_rate.transpose(0, 2, 1)
    return np.asarray(
        gains[0][:, None, None] * (by_slope @ noise @ by_slope.T)
        + gains[1][:, None, None] * (by_rate @ noise @ by_rate.transpose(0, 2, 1))
        + both[:, None, None] * (mixed + mixed.transpose(0, 2, 1))
    )


def _covariances(noise: ArrayLike, n: int) -> Array:
    given = np.asarray(noise, dtype=np.float64)
    if given.ndim == 3:
        if given.shape != (n, 3, 3):
            raise ConfigError(
                "sensors.covariances-shape-do-not-go", quantity="gyro_noise", shape=given.shape, n=n
            )
        return given
    try:
        sd = np.broadcast_to(given, (n, 3))
    except ValueError:
        raise ConfigError(
            "sensors.standard-deviations-shape-do-not",
            quantity="gyro_noise",
            shape=given.shape,
            n=n,
        ) from None
    if not (np.isfinite(sd).all() and (sd >= 0.0).all() and math.isfinite(float(sd.sum()))):
        raise ConfigError("sensors.standard-deviation-negative-or-not", quantity="gyro_noise")
    return np.asarray(sd[:, :, None] ** 2 * np.eye(3), dtype=np.float64)
