"""One record from several units at a common point."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from strapdown.crash.unit_at_point import Contributor, UnitAtPoint
from strapdown.exceptions import ConfigError, DataError
from strapdown.sensors.lever_arm import cross_matrix
from strapdown.tables import imu_table

Array = NDArray[np.float64]

__all__ = ["COMBINATIONS", "combine_units"]

COMBINATIONS = ("weighted", "median")
# Relative to the largest variance: what a perfect unit is given, so that it can be inverted.
FLOOR = 1e-12


def combine_units(units: Sequence[UnitAtPoint], method: str = "weighted") -> UnitAtPoint:
    """Combine units that were moved to one point.

    Parameters
    ----------
    units : sequence of UnitAtPoint
        Of one vehicle, at one point; the stamps of the first are kept, where all have samples,
        and the others are interpolated linearly.
    method : {'weighted', 'median'}
        Each sample weighed by the inverse of its covariance (noise, contributors, position); or,
        of three units or more, the median of each axis, which one unit gone astray does not move
        far.

    Returns
    -------
    UnitAtPoint
        With the noise and all contributors of its parts, each with its weight. Rates are weighed
        by their noise. What two units share, as a borrowed gyro, is taken as independent.

    Raises
    ------
    DataError
        There are fewer than two units, or fewer than two common samples.
    ConfigError
        The method is unknown, or the median is asked of two.
    """
    if method not in COMBINATIONS:
        raise ConfigError(
            f"{method!r} is no way to combine units",
            quantity="method",
            remedy=f"use {' or '.join(COMBINATIONS)}",
        )
    if len(units) < 2 or (method == "median" and len(units) < 3):
        raise ConfigError(
            f"{len(units)} units cannot be combined by {method}",
            quantity="units",
            remedy="give two units or more, three or more for a median",
        )
    first = max(float(u.time[0]) for u in units)
    last = min(float(u.time[-1]) for u in units)
    time = units[0].time
    time = time[(time >= first) & (time <= last)]
    if time.size < 2:
        raise DataError(
            f"the units share {time.size} samples",
            quantity="units",
            remedy="look whether their clocks agree",
        )
    at = [_at(u, time) for u in units]
    force = np.array([u.force for u in at])
    weights = _inverse_weights(at) if method == "weighted" else _median_weights(force)
    noise = np.zeros((time.size, 3, 3))
    contributors: list[Contributor] = []
    for u, w in zip(at, weights, strict=True):
        noise += w @ _with_lever(u) @ w.transpose(0, 2, 1)
        for c in _all_contributors(u):
            contributors.append(Contributor(f"{u.name}: {c.name}", w @ c.effect, c.covariance))
    total = np.einsum("unij,unj->ni", weights, force)
    quiet = np.array([1.0 / max(float(np.einsum("nii->", u.gyro_noise)), 1e-30) for u in at])
    quiet = quiet / quiet.sum()
    rate = np.tensordot(quiet, np.array([u.rate for u in at]), axes=1)
    gyro_noise = np.tensordot(quiet**2, np.array([u.gyro_noise for u in at]), axes=1)
    name = f"{method} of {', '.join(u.name for u in units)}"
    return UnitAtPoint(
        name=name,
        imu=imu_table(time, rate, total, sampling=str(units[0].imu.attrs["sampling"]), source=name),
        noise=noise,
        gyro_noise=gyro_noise,
        contributors=tuple(contributors),
        gyro_bias_sd=np.sqrt(
            np.tensordot(quiet**2, np.array([u.gyro_bias_sd**2 for u in at]), axes=1)
        ),
    )


def _at(unit: UnitAtPoint, time: Array) -> UnitAtPoint:
    """A unit at other stamps, on straight lines between its own."""
    own = unit.time
    if own.size == time.size and np.array_equal(own, time):
        return unit

    def at(values: Array) -> Array:
        flat = values.reshape(own.size, -1)
        columns = [np.interp(time, own, flat[:, k]) for k in range(flat.shape[1])]
        return np.stack(columns, axis=1).reshape(time.size, *values.shape[1:])

    # The noise of a value between two samples is less than theirs; theirs is kept.
    return replace(
        unit,
        imu=imu_table(
            time,
            at(unit.rate),
            at(unit.force),
            sampling=str(unit.imu.attrs["sampling"]),
            source=unit.name,
        ),
        noise=at(_with_lever(unit)),
        gyro_noise=at(unit.gyro_noise),
        contributors=tuple(replace(c, effect=at(c.effect)) for c in _all_contributors(unit)),
        position_sd=0.0,
        angles_sd=0.0,
        moved=None,
    )


def _with_lever(unit: UnitAtPoint) -> Array:
    """Noise of a sample with what the gyro adds through the lever arm."""
    return unit.noise if unit.moved is None else unit.noise + unit.moved.added


def _all_contributors(unit: UnitAtPoint) -> tuple[Contributor, ...]:
    more: list[Contributor] = []
    if unit.moved is not None and unit.position_sd > 0.0:
        more.append(Contributor("position", unit.lever(), unit.position_sd**2 * np.eye(3)))
    if unit.angles_sd > 0.0:
        tilt = cross_matrix(unit.force)
        more.append(Contributor("mounting angles", tilt, unit.angles_sd**2 * np.eye(3)))
    return (*unit.contributors, *more)


def _inverse_weights(units: Sequence[UnitAtPoint]) -> Array:
    information = []
    for u in units:
        covariance = _with_lever(u).copy()
        for c in _all_contributors(u):
            covariance += c.effect @ c.covariance @ c.effect.transpose(0, 2, 1)
        floor = max(FLOOR * float(np.einsum("nii->n", covariance).max()), 1e-30)
        information.append(np.linalg.inv(covariance + floor * np.eye(3)))
    total = np.linalg.inv(np.sum(information, axis=0))
    return np.array([total @ i for i in information])


def _median_weights(force: Array) -> Array:
    """One for the unit in the middle, a half for each of two in the middle; per sample and axis."""
    count = len(force)
    order = np.argsort(force, axis=0, kind="stable")
    weights = np.zeros((*force.shape, 3))
    middle = {(count - 1) // 2, count // 2}
    n, axes = np.indices(force.shape[1:])
    for place in middle:
        weights[order[place], n, axes, axes] = 1.0 / len(middle)
    return weights
