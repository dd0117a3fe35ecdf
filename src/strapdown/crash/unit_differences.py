"""Velocity increments of units at a common point, and the covariance of their differences."""

from __future__ import annotations

import itertools
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from strapdown.crash.at_point import PointKinematics
from strapdown.crash.window_weights import window_weights
from strapdown.errors import ConfigError, DataError

__all__ = [
    "TINY",
    "NoiseOfSums",
    "VelocityIncrements",
    "chi_square_tail",
    "common_edges",
    "difference_covariance",
    "floored",
    "joint_covariance",
    "noise_of_sums",
    "velocity_increments",
]


Array = NDArray[np.float64]

# Relative to the largest variance: smaller covariances are rounding.
FLOOR, TINY = 1e-12, 1e-30


@dataclass(frozen=True, eq=False)
class VelocityIncrements:
    """Integrals of a unit's specific force and rates over intervals.

    Rows of the matrices are ordered by interval, then axis.

    Attributes
    ----------
    edges : ndarray, (m + 1,), s
    values : ndarray, (m, 3), m/s
    turned : ndarray, (m, 3), rad
        Integrals of the rates.
    names, contributors : tuple of str
        Of p unknowns, as in `SampleEffects`.
    effects : ndarray, (3 m, p), m/s
        Effect of one standard deviation of each on the values.
    turned_effects : ndarray, (3 m, p), rad
        The same for `turned`.
    noise : NoiseOfSums
    lever : ndarray, (3 m, 3), 1/s
        Effect of a position error (true minus stated) on the values.
    """

    edges: Array
    values: Array
    turned: Array
    names: tuple[str, ...]
    contributors: tuple[str, ...]
    effects: Array
    turned_effects: Array
    noise: NoiseOfSums
    lever: Array

    def of_pieces(self, kept: NDArray[np.bool_]) -> VelocityIncrements:
        """Select some of the intervals; the edges remain those of all.

        Parameters
        ----------
        kept : ndarray of bool, (m,)
        """
        if kept.all():
            return self
        rows = np.repeat(kept, 3)
        return replace(
            self,
            values=self.values[kept],
            turned=self.turned[kept],
            effects=self.effects[rows],
            turned_effects=self.turned_effects[rows],
            noise=self.noise.of_rows(rows),
            lever=self.lever[rows],
        )

    def borrows(self, other: VelocityIncrements) -> bool:
        """Whether both share one gyro, so that their rates agree by construction."""
        return self.noise.gyro == other.noise.gyro


def joint_covariance(
    increments: Sequence[VelocityIncrements],
    *,
    of: str = "force",
    without: Collection[str] = (),
) -> Array:
    """Covariance of the increments of several units together.

    Parameters
    ----------
    increments : sequence of VelocityIncrements
        For k units, between the same edges.
    of : {'force', 'rate'}
    without : collection of str
        Contributors to leave out.

    Returns
    -------
    ndarray, (3 m k, 3 m k)
        Unknowns of the same name are one unknown, and the noise of a gyro that several units
        borrow is common, as far as they use the same samples.
    """
    columns: dict[str, int] = {}
    gyros: dict[tuple[str, int], list[int]] = {}
    for k, unit in enumerate(increments):
        for name, contributor in zip(unit.names, unit.contributors, strict=True):
            if contributor not in without:
                columns.setdefault(name, len(columns))
        gyros.setdefault((unit.noise.gyro, unit.noise.turned.shape[1]), []).append(k)
    size = increments[0].values.size
    spread = np.zeros((len(increments), size, len(columns)))
    out = np.zeros((len(increments), size, len(increments), size))
    for k, unit in enumerate(increments):
        kept = [i for i, c in enumerate(unit.contributors) if c not in without]
        given = unit.effects if of == "force" else unit.turned_effects
        spread[k][:, [columns[unit.names[i]] for i in kept]] = given[:, kept]
        if of == "force":
            out[k, :, k] += unit.noise.of_force
    for of_one in gyros.values():
        for i in of_one:
            for j in of_one:
                one, other = increments[i].noise, increments[j].noise
                if of == "force":
                    out[i, :, j] += one.through_arm @ other.through_arm.T
                else:
                    out[i, :, j] += one.turned @ other.turned.T
    whole = len(increments) * size
    flat = spread.reshape(whole, -1)
    return np.asarray(out.reshape(whole, whole) + flat @ flat.T)


def difference_covariance(
    first: VelocityIncrements,
    second: VelocityIncrements,
    *,
    of: str = "force",
    without: Collection[str] = (),
    turn: Array | None = None,
) -> Array:
    """Covariance of the increments of one unit minus those of another.

    Parameters
    ----------
    first, second : VelocityIncrements
        Between the same edges.
    of, without
        As `joint_covariance`.
    turn : ndarray, (..., 3, 3), optional
        Rotation applied to the increments of the second unit.

    Returns
    -------
    ndarray, (..., 3 m, 3 m)
        Common errors cancel.
    """
    size, pieces = first.values.size, len(first.values)
    turned = np.eye(3) if turn is None else turn
    blocks = np.einsum("ab,...ij->...aibj", np.eye(pieces), turned)
    blocks = blocks.reshape(*turned.shape[:-2], size, size)
    back = np.swapaxes(blocks, -1, -2)
    both = joint_covariance((first, second), of=of, without=without)
    mixed = both[:size, size:] @ back
    out = both[:size, :size] + blocks @ both[size:, size:] @ back
    out = out - mixed - np.swapaxes(mixed, -1, -2)
    return np.asarray(0.5 * (out + np.swapaxes(out, -1, -2)))


def floored(covariance: Array) -> Array:
    """Make a covariance invertible: raise it by the rounding of its largest variance.

    Parameters
    ----------
    covariance : ndarray, (..., k, k)
        One, or several with one floor.
    """
    largest = float(np.diagonal(covariance, axis1=-2, axis2=-1).max())
    return np.asarray(covariance + max(FLOOR * largest, TINY) * np.eye(covariance.shape[-1]))


def common_edges(
    units: Sequence[PointKinematics], window: tuple[float, float] | None, pieces: int
) -> Array:
    """Edges of equal intervals over a window that all units cover.

    Raises
    ------
    DataError
        The units have no common time, or do not cover the window.
    ConfigError
        An interval is shorter than two samples of a unit.
    """
    if len(units) < 2:
        raise DataError("crash.unit-comparison-needs-two", quantity="units", count=len(units))
    first = max(float(u.time[0]) for u in units)
    last = min(float(u.time[-1]) for u in units)
    start, end = (max(first, -0.1), min(last, 0.75)) if window is None else window
    if not first <= start < end <= last:
        begins = next(u.name for u in units if u.time[0] == first)
        ends = next(u.name for u in units if u.time[-1] == last)
        wanted = (-0.1, 0.75) if window is None else window
        raise DataError(
            "crash.share-does-not-cover-begins",
            quantity="window",
            units=[u.name for u in units],
            first=first,
            last=last,
            wanted=wanted[0],
            wanted_2=wanted[1],
            begins=begins,
            ends=ends,
        )
    coarsest = max(float(np.median(np.diff(u.time))) for u in units)
    most = int((end - start) / (2.0 * coarsest))
    if most < 3:
        raise ConfigError(
            "crash.steps-cannot-cut-into-three",
            quantity="window",
            end=end - start,
            coarsest=coarsest,
        )
    return np.linspace(start, end, min(pieces, most) + 1)


def velocity_increments(unit: PointKinematics, edges: Array) -> VelocityIncrements:
    """Integrate a unit's specific force and rates between edges.

    Parameters
    ----------
    unit : PointKinematics
    edges : ndarray, (m + 1,), s

    Returns
    -------
    VelocityIncrements
        In body axes, which rotate; two units on one body share them at every instant.
    """
    sampling = str(unit.imu.attrs["sampling"])
    weights = np.array(
        [window_weights(unit.time, *piece, sampling) for piece in itertools.pairwise(edges)]
    )
    effects, size = unit.effects, 3 * len(weights)
    within = weights.any(axis=0)
    few = weights[:, within]
    if unit.moved is None:
        lever = np.zeros((size, 3))
    else:
        lever = np.einsum("an,nik->aik", few, unit.moved.lever[within]).reshape(size, 3)
    return VelocityIncrements(
        edges,
        weights @ unit.force,
        weights @ unit.rate,
        effects.names,
        effects.contributors,
        np.einsum("an,pni->aip", few, effects.force[:, within], optimize=True).reshape(size, -1),
        np.einsum("an,pni->aip", few, effects.rate[:, within], optimize=True).reshape(size, -1),
        noise_of_sums(unit, weights),
        lever,
    )


def chi_square_tail(chi_square: float, freedom: int) -> float:
    """Probability of a chi-square at least this large; `freedom` may be zero."""
    from scipy.stats import chi2

    return float(chi2.sf(chi_square, freedom)) if freedom else 1.0


# Effect of the sample noise of a unit on weighted sums of samples.


@dataclass(frozen=True, eq=False)
class NoiseOfSums:
    """Noise of m weighted sums of specific force and rates; rows by sum, then axis.

    Attributes
    ----------
    of_force : ndarray, (3 m, 3 m), (m/s)²
        Covariance of the sums of the specific force from accelerometer noise.
    through_arm : ndarray, (3 m, q), m/s
        Effect of one standard deviation of each of q independent numbers, the gyro noise, on
        the sums through the lever arm.
    turned : ndarray, (3 m, q), rad
        The same for the sums of the rates.
    gyro : str
        Name of the unit that has the gyro: units that borrow it have the same numbers.
    """

    of_force: Array
    through_arm: Array
    turned: Array
    gyro: str

    def of_rows(self, rows: NDArray[np.bool_]) -> NoiseOfSums:
        """Some of the rows, (3 m,)."""
        return NoiseOfSums(
            self.of_force[np.ix_(rows, rows)], self.through_arm[rows], self.turned[rows], self.gyro
        )


def noise_of_sums(at_point: PointKinematics, weights: Array) -> NoiseOfSums:
    """Compute the effect of the sample noise on weighted sums of samples.

    Parameters
    ----------
    at_point : PointKinematics
        A unit, or a combination, whose samples are taken as independent.
    weights : ndarray, (m, n), s

    Returns
    -------
    NoiseOfSums
        Gyro noise through the lever arm keeps its correlation from sample to sample: it nearly
        cancels in a change of velocity.
    """
    m = len(weights)
    prepared, moved, effects = at_point.prepared, at_point.moved, at_point.effects
    within = _touched(at_point, weights)
    few = weights[:, within]
    if prepared is None or moved is None:
        own = _diagonal(effects.force_noise[within])
        turning = _root(_diagonal(effects.rate_noise[within]))
    else:
        own = prepared.noise_covariance[within]
        turning = _root(prepared.gyro_noise_covariance[within])
    blocks = np.einsum("an,nij,bn->aibj", few, own, few, optimize=True)
    turned = np.einsum("an,nik->aink", few, turning).reshape(3 * m, -1)
    if moved is None or not moved.lever_arm.any():
        arm = np.zeros_like(turned)
    else:
        by_rate = moved.of_rates_in_sums(weights)[:, within]
        arm = np.einsum("anij,njk->aink", by_rate, turning).reshape(3 * m, -1)
    return NoiseOfSums(blocks.reshape(3 * m, 3 * m), arm, turned, at_point.gyro)


def _touched(at_point: PointKinematics, weights: Array) -> slice:
    """Samples with weight in a sum, and those used for their angular acceleration."""
    used = np.flatnonzero(weights.any(axis=0))
    if not used.size:
        return slice(0, 0)
    wide = 0 if at_point.moved is None else at_point.moved.slope.slope.shape[1]
    return slice(max(int(used[0]) - wide, 0), int(used[-1]) + wide + 1)


def _diagonal(sd: Array) -> Array:
    return np.asarray(sd[:, :, None] ** 2 * np.eye(3))


def _root(covariances: Array) -> Array:
    """Matrices whose product with their transpose is the covariance of each sample."""
    values, vectors = np.linalg.eigh(covariances)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0))[:, None, :])
