"""A unit at the common point of a vehicle, with everything that may make it differ there."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from strapdown.sensors.lever_arm import (
    MovedImu,
    cross_matrix,
    lever_matrix,
    move_unit,
    rate_effect,
)
from strapdown.sensors.prepared_unit import PreparedUnit
from strapdown.tables import ACCEL, GYRO

Array = NDArray[np.float64]

__all__ = ["Contributor", "UnitAtPoint", "unit_at_point"]


@dataclass(frozen=True, eq=False)
class Contributor:
    """One error of a unit that lasts over the record.

    Attributes
    ----------
    name : str
        As ``scale of low-G``.
    effect : ndarray, (n, 3, k)
        What each of its k numbers does to the specific force at the point, vehicle axes.
    covariance : ndarray, (k, k)
    """

    name: str
    effect: Array
    covariance: Array


@dataclass(frozen=True, eq=False)
class UnitAtPoint:
    """A unit, moved to a point.

    Attributes
    ----------
    name : str
    imu : DataFrame
        Imu table, vehicle axes, at the point.
    noise : ndarray, (n, 3, 3), (m/s²)²
        Covariance of each sample of the specific force as measured; samples are independent.
    gyro_noise : ndarray, (n, 3, 3), (rad/s)²
    contributors : tuple of Contributor
        Independent of one another.
    position : ndarray, (3,), m
        Where the unit sits, vehicle axes.
    position_sd : float, m
        Of each coordinate.
    angles_sd : float, rad
        Of each mounting angle.
    gyro_bias_sd : ndarray, (3,), rad/s
        What is left of it, vehicle axes.
    moved : MovedImu, optional
        How it came to the point; None for a unit that sits there.
    """

    name: str
    imu: pd.DataFrame
    noise: Array
    gyro_noise: Array
    contributors: tuple[Contributor, ...] = ()
    position: Array = field(default_factory=lambda: np.zeros(3))
    position_sd: float = 0.0
    angles_sd: float = 0.0
    gyro_bias_sd: Array = field(default_factory=lambda: np.zeros(3))
    moved: MovedImu | None = None

    @property
    def time(self) -> Array:
        """Stamps, (n,), s."""
        return np.asarray(self.imu.index.to_numpy(), dtype=np.float64)

    @property
    def force(self) -> Array:
        """Specific force, (n, 3), m/s²."""
        return np.ascontiguousarray(self.imu[ACCEL].to_numpy(dtype=np.float64))

    @property
    def rate(self) -> Array:
        """Rates, (n, 3), rad/s."""
        return np.ascontiguousarray(self.imu[GYRO].to_numpy(dtype=np.float64))

    def lever(self) -> Array:
        """What an error of its position (true minus stated) does, (n, 3, 3), 1/s²."""
        if self.moved is None:
            return np.zeros((len(self.imu), 3, 3))
        alpha = self.moved.angular_acceleration
        return lever_matrix(alpha, self.moved.slope.value_of(self.rate))

    def within(self, start: float, end: float) -> UnitAtPoint:
        """The part of the record that integrals from start to end need, s."""
        width = 2 if self.moved is None else self.moved.slope.slope.shape[1] + 2
        a = max(int(np.searchsorted(self.time, start)) - width, 0)
        b = min(int(np.searchsorted(self.time, end)) + width, len(self.imu))
        rows = slice(a, b)
        moved = self.moved
        if moved is not None:
            slope = moved.slope
            # Rows whose windows are cut here lie outside start and end.
            first = np.clip(slope.first[rows] - a, 0, max(b - a - slope.slope.shape[1], 0))
            moved = replace(
                moved,
                imu=moved.imu.iloc[rows],
                angular_acceleration=moved.angular_acceleration[rows],
                added=moved.added[rows],
                slope=replace(slope, first=first, slope=slope.slope[rows], value=slope.value[rows]),
            )
        return replace(
            self,
            imu=self.imu.iloc[rows],
            noise=self.noise[rows],
            gyro_noise=self.gyro_noise[rows],
            contributors=tuple(replace(c, effect=c.effect[rows]) for c in self.contributors),
            moved=moved,
        )

    def noise_of_sums(self, weights: Array) -> Array:
        """Covariance of weighted sums of the specific force from the noise of the samples.

        Parameters
        ----------
        weights : ndarray, (m, n)

        Returns
        -------
        ndarray, (3 m, 3 m)
            Ordered by sum, then axis. What the gyro's noise does through the lever arm is in
            it, with its correlation from sample to sample: it all but cancels in a delta-V.
        """
        m = len(weights)
        spread = np.einsum("an,nik->aink", weights, root_of(self.noise)).reshape(3 * m, -1)
        out = spread @ spread.T
        if self.moved is None or not self.moved.lever_arm.any():
            return np.asarray(out)
        slope, arm = self.moved.slope, self.moved.lever_arm
        turn = rate_effect(slope.value_of(self.rate), arm)
        by_slope = slope.weighted(weights)[0]
        effect = np.einsum("an,ij->anij", by_slope, -cross_matrix(arm))
        for axis in range(3):
            for other in range(3):
                rows = weights * turn[:, axis, other]
                effect[:, :, axis, other] += slope.weighted(rows)[1]
        half = np.einsum("anij,njk->aink", effect, root_of(self.gyro_noise)).reshape(3 * m, -1)
        return np.asarray(out + half @ half.T)


def unit_at_point(
    prepared: PreparedUnit,
    point: ArrayLike,
    *,
    window: float | None = None,
    gyro_delay: float = 0.0,
) -> UnitAtPoint:
    """Move a prepared unit to a point and state what it does not know of itself.

    Parameters
    ----------
    prepared : PreparedUnit
    point : array_like, (3,), m
        In vehicle axes from the vehicle's origin.
    window, gyro_delay
        As `move_imu`.

    Returns
    -------
    UnitAtPoint
        Its contributors are, per range: bias, scale factor, misalignment, nonlinearity, each
        where that range spoke; and the trigger. Position and mounting angles are kept apart,
        since a comparison looks for them. Vibration rectification
        is left out. Errors of the levelling are all units' alike on one vehicle and no
        reason to differ.
    """
    moved = move_unit(prepared, point, window=window, gyro_delay=gyro_delay)
    unit = prepared.unit
    C = unit.mounting.C_vs
    own = prepared.imu[ACCEL].to_numpy(dtype=np.float64) @ C
    found: list[Contributor] = []
    for j, triad in enumerate(unit.accelerometers):
        speaks = (prepared.range_spoken == j).astype(np.float64)
        found += _of_range(prepared, j, triad.name, own, speaks, C)
    angles = math.radians(unit.mounting.angles_sd_deg)
    if unit.trigger_sd > 0.0:
        at = moved.imu[ACCEL].to_numpy(dtype=np.float64)
        change = np.gradient(at, moved.imu.index.to_numpy(dtype=np.float64), axis=0)
        found.append(Contributor("trigger", change[:, :, None], np.array([[unit.trigger_sd**2]])))
    return UnitAtPoint(
        name=unit.name,
        imu=moved.imu,
        noise=np.einsum("ij,nj,kj->nik", C, prepared.noise**2, C),
        gyro_noise=np.einsum("ij,nj,kj->nik", C, prepared.gyro_noise**2, C),
        contributors=tuple(found),
        position=np.asarray(unit.mounting.position),
        position_sd=unit.mounting.position_sd,
        angles_sd=angles,
        gyro_bias_sd=np.sqrt(C**2 @ np.asarray(prepared.gyro_bias_sd) ** 2),
        moved=moved,
    )


def root_of(covariances: Array) -> Array:
    """Matrices whose product with their transpose is the covariance of each sample."""
    values, vectors = np.linalg.eigh(covariances)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0))[:, None, :])


def _of_range(
    prepared: PreparedUnit, j: int, name: str, own: Array, speaks: Array, C: Array
) -> list[Contributor]:
    u = prepared.unit.accelerometers[j].uncertainty
    spoken = C[None] * speaks[:, None, :]
    found: list[Contributor] = []
    origin = prepared.bias_from[j]
    if j == 0 or origin is None:
        stated = prepared.bias_sd[j] if origin is not None else u.axis("bias")
        covariance = np.diag(np.asarray(stated) ** 2)
        if j == 0 and prepared.gravity_matched and prepared.rest is not None:
            covariance = _without_vertical(prepared, covariance, C)
        # All ranges hang on the lowest one's bias, but for those that have none to hang on.
        hanging = np.zeros_like(speaks)
        for k in range(len(prepared.unit.accelerometers)):
            if _hangs_on(prepared, k) == j:
                hanging += prepared.range_spoken == k
        found.append(Contributor(f"bias of {name}", C[None] * hanging[:, None, :], covariance))
    else:
        covariance = np.diag(np.asarray(prepared.bias_sd[j]) ** 2)
        found.append(Contributor(f"bias of {name}", spoken, covariance))
    # What the scale makes of gravity at rest was taken off with the bias.
    from_rest = own
    if prepared.rest is not None and (prepared.gravity_matched or j > 0):
        assert prepared.rest.accel_mean is not None
        from_rest = own - C.T @ np.asarray(prepared.rest.accel_mean)
    if any(u.axis("scale")):
        found.append(
            Contributor(
                f"scale of {name}",
                spoken * from_rest[:, None, :],
                np.diag(np.asarray(u.scale) ** 2),
            )
        )
    for axis, sd in enumerate(u.axis("misalignment")):
        others = [k for k in range(3) if k != axis]
        if sd > 0.0:
            found.append(
                Contributor(
                    f"misalignment of {name} {'xyz'[axis]}",
                    spoken[:, :, axis, None] * own[:, None, others],
                    sd**2 * np.eye(2),
                )
            )
    if any(u.axis("nonlinearity_2")):
        full = np.where(np.isfinite(u.full_scale), u.full_scale, 1.0)
        found.append(
            Contributor(
                f"nonlinearity of {name}",
                spoken * (own**2 / full)[:, None, :],
                np.diag(np.asarray(u.nonlinearity_2) ** 2),
            )
        )
    return found


def _hangs_on(prepared: PreparedUnit, k: int) -> int:
    """The range on whose own bias a range hangs."""
    origin = prepared.bias_from[k]
    while k > 0 and origin is not None and origin >= 0:
        k = origin
        origin = prepared.bias_from[k]
    return k


def _without_vertical(prepared: PreparedUnit, covariance: Array, C: Array) -> Array:
    """Bias covariance after the length at rest was made gravity's: the part across it."""
    assert prepared.rest is not None and prepared.rest.accel_mean is not None
    up = C.T @ np.asarray(prepared.rest.accel_mean)
    up = up / np.linalg.norm(up)
    across = np.eye(3) - np.outer(up, up)
    return np.asarray(across @ covariance @ across)
