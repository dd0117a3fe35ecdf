"""Increments of velocity of units at a common point, and the covariance of their differences."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from strapdown.crash.unit_at_point import UnitAtPoint, root_of
from strapdown.exceptions import ConfigError, DataError
from strapdown.sensors.lever_arm import cross_matrix

Array = NDArray[np.float64]

__all__ = ["VelocityIncrements", "common_edges", "sum_weights", "velocity_increments"]


@dataclass(frozen=True, eq=False)
class VelocityIncrements:
    """Integrals of a unit's specific force over pieces of time.

    Attributes
    ----------
    edges : ndarray, (m + 1,), s
    values : ndarray, (m, 3), m/s
    covariance : ndarray, (3 m, 3 m), (m/s)²
        Noise and every contributor, but not what is not known of position and mounting angles.
    lever : ndarray, (3 m, 3), 1/s
        What an error of the position (true minus stated) does to them.
    position_sd : float, m
    angles_sd : float, rad
        Of each mounting angle.
    turned : ndarray, (m, 3), rad
        Integrals of the rates.
    turned_covariance : ndarray, (3 m, 3 m), rad²
        Noise and bias of the gyro, but not the mounting angles.
    """

    edges: Array
    values: Array
    covariance: Array
    lever: Array
    position_sd: float
    angles_sd: float
    turned: Array
    turned_covariance: Array

    @property
    def whole(self) -> Array:
        """Covariance with the shares of position and mounting angles."""
        place = self.position_sd**2 * (self.lever @ self.lever.T)
        return np.asarray(self.without_position + place)

    @property
    def without_position(self) -> Array:
        """Covariance with the share of the mounting angles."""
        tilt = cross_matrix(self.values).reshape(-1, 3)
        return np.asarray(self.covariance + self.angles_sd**2 * (tilt @ tilt.T))

    @property
    def without_angles(self) -> Array:
        """Covariance with the share of the position."""
        return np.asarray(self.covariance + self.position_sd**2 * (self.lever @ self.lever.T))


def common_edges(
    units: Sequence[UnitAtPoint], window: tuple[float, float] | None, pieces: int
) -> Array:
    """Edges of equal pieces over a window that all units cover.

    Raises
    ------
    DataError
        The units have no common time, or do not cover the window.
    ConfigError
        A piece is shorter than two samples of a unit.
    """
    if len(units) < 2:
        raise DataError(
            f"{len(units)} unit, and a comparison needs two",
            quantity="units",
            remedy="give another unit on the same vehicle",
        )
    first = max(float(u.time[0]) for u in units)
    last = min(float(u.time[-1]) for u in units)
    start, end = (max(first, -0.1), min(last, 0.75)) if window is None else window
    if not first <= start < end <= last:
        raise DataError(
            f"{', '.join(u.name for u in units)} share {first:.5g} to {last:.5g} s, which does not "
            f"cover {start:.5g} to {end:.5g} s",
            quantity="window",
            remedy="give a window within what they share, and look whether the clocks agree",
        )
    coarsest = max(float(np.median(np.diff(u.time))) for u in units)
    most = int((end - start) / (2.0 * coarsest))
    if most < 3:
        raise ConfigError(
            f"{end - start:.4g} s at steps of {coarsest:.4g} s cannot be cut into three pieces of "
            "two samples",
            quantity="window",
            remedy="give a longer one",
        )
    return np.linspace(start, end, min(pieces, most) + 1)


def sum_weights(time: Array, edges: Array, sampling: str) -> Array:
    """Weights of the samples in the integrals between edges.

    Parameters
    ----------
    time : ndarray, (n,), s
    edges : ndarray, (m + 1,), s
        Within the record.
    sampling : {'instantaneous', 'mean'}
        Straight lines between the samples, or each the mean over the interval that ends there.

    Returns
    -------
    ndarray, (m, n), s
    """
    n, steps = time.size, np.diff(time)
    k = np.clip(np.searchsorted(time, edges, side="right") - 1, 0, n - 2)
    since = edges - time[k]
    rows = np.arange(n)
    whole = np.zeros(n)
    cumulative = np.zeros((edges.size, n))
    if sampling == "mean":
        whole[1:] = steps
        cumulative = np.where(rows <= k[:, None], whole, 0.0)
        cumulative[np.arange(edges.size), k + 1] = since
        return np.diff(cumulative, axis=0)
    left, right = np.r_[0.5 * steps, 0.0], np.r_[0.0, 0.5 * steps]
    cumulative = np.where(rows < k[:, None], left, 0.0) + np.where(rows <= k[:, None], right, 0.0)
    part = 0.5 * since**2 / steps[k]
    cumulative[np.arange(edges.size), k] += since - part
    cumulative[np.arange(edges.size), k + 1] += part
    return np.diff(cumulative, axis=0)


def velocity_increments(unit: UnitAtPoint, edges: Array) -> VelocityIncrements:
    """Integrate a unit's specific force between edges, with the covariance of the result.

    Parameters
    ----------
    unit : UnitAtPoint
    edges : ndarray, (m + 1,), s

    Returns
    -------
    VelocityIncrements
        In body axes, which turn: what two units on one body share at every instant.
    """
    unit = unit.within(float(edges[0]), float(edges[-1]))
    weights = sum_weights(unit.time, edges, str(unit.imu.attrs["sampling"]))
    m = len(weights)
    covariance = unit.noise_of_sums(weights)
    for c in unit.contributors:
        effect = np.einsum("an,nik->aik", weights, c.effect).reshape(3 * m, -1)
        covariance = covariance + effect @ c.covariance @ effect.T
    lever = np.einsum("an,nik->aik", weights, unit.lever()).reshape(3 * m, 3)
    constant = np.kron(weights.sum(axis=1)[:, None], np.diag(unit.gyro_bias_sd))
    spread = np.einsum("an,nik->aink", weights, root_of(unit.gyro_noise)).reshape(3 * m, -1)
    return VelocityIncrements(
        edges,
        weights @ unit.force,
        np.asarray(0.5 * (covariance + covariance.T)),
        lever,
        unit.position_sd,
        unit.angles_sd,
        weights @ unit.rate,
        np.asarray(spread @ spread.T + constant @ constant.T),
    )
