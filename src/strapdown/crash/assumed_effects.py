"""The unknowns of what is assumed of axes and turning that a unit does not measure."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from strapdown.crash.sample_effects import MISSING_AXIS, NO_TURNING
from strapdown.sensors.assumed import SHAPES, Assumed, assumed_shapes
from strapdown.sensors.prepared_unit import PreparedUnit
from strapdown.sensors.unmeasured import AXES, TURNS, unmeasured_axes, unmeasured_turns
from strapdown.tables import ACCEL

Array = NDArray[np.float64]

__all__ = ["AssumedEffect", "assumed_effects"]


@dataclass(frozen=True, eq=False)
class AssumedEffect:
    """What one standard deviation of an unknown adds to the samples, vehicle axes.

    Attributes
    ----------
    name, contributor : str
    force : ndarray, (n, 3), m/s², or None
    rate : ndarray, (n, 3), rad/s, or None
    """

    name: str
    contributor: str
    force: Array | None
    rate: Array | None


def assumed_effects(prepared: PreparedUnit) -> Iterator[AssumedEffect]:
    """List the unknowns of what is assumed of a unit.

    Parameters
    ----------
    prepared : PreparedUnit

    Yields
    ------
    AssumedEffect
        Of the vehicle: units that lack the same have the same unknowns. About each of the vehicle's
        axes two in time (`Assumed`), and of a turn what its square does; along each two.

    Notes
    -----
    A specific force f that is turned by φ about e keeps ``f - φ²/2 (f - e (e·f))`` to second
    order: turns of 5 deg shorten a change of velocity by 0.4 %, always, where the first order
    turns it aside. ``φ²/2`` has the mean ``sd²/2`` and the standard deviation ``sd²/√2``. The
    means of all axes are taken as one unknown about zero, the deviations as one each, so that the
    mean square of the whole is right; as it is one-sided, 6.5 % of it are beyond the bound of
    95 %. Products of a turn and a missing axis are left out: 4 deg and 0.8 m/s make 0.03 m/s.
    """
    unit = prepared.unit
    time = prepared.imu.index.to_numpy(dtype=np.float64)
    sampling = str(prepared.imu.attrs["sampling"])
    turning = (unit.lender or unit).assumed
    turns, axes = unmeasured_turns(unit), unmeasured_axes(unit)
    if turning is not None and turns.any():
        force = prepared.imu[ACCEL].to_numpy(dtype=np.float64)
        yield from _of_turning(turning, turns, time, sampling, force)
    if unit.assumed is not None and axes.any():
        shapes = assumed_shapes(time, unit.assumed.over, sampling)
        for name, along in _directions(unit.assumed.sd_of("delta_v_sd"), axes, AXES):
            for shape, how in zip(shapes, SHAPES, strict=True):
                yield AssumedEffect(
                    f"assumed velocity {name} {how}", MISSING_AXIS, np.outer(shape, along), None
                )


def _of_turning(
    assumed: Assumed, turns: Array, time: Array, sampling: str, force: Array
) -> Iterator[AssumedEffect]:
    shapes = assumed_shapes(time, assumed.over, sampling)
    steps = np.diff(time, prepend=2.0 * time[0] - time[1])
    turned = (np.cumsum(shapes * steps, axis=1) ** 2).sum(axis=0)
    means = np.zeros_like(force)
    for name, degrees in _directions(assumed.sd_of("turn_sd_deg"), turns, TURNS):
        about = np.radians(degrees)
        for shape, how in zip(shapes, SHAPES, strict=True):
            yield AssumedEffect(f"assumed {name} {how}", NO_TURNING, None, np.outer(shape, about))
        variance = float(about @ about)
        axis = about / math.sqrt(variance)
        across = force - np.outer(force @ axis, axis)
        mean = -0.5 * variance * turned[:, None] * across
        means += mean
        yield AssumedEffect(f"assumed {name} squared", NO_TURNING, math.sqrt(2.0) * mean, None)
    if means.any():
        yield AssumedEffect("assumed turns squared", NO_TURNING, means, None)


def _directions(
    sds: tuple[float, float, float], unmeasured: Array, names: tuple[str, ...]
) -> Iterator[tuple[str, Array]]:
    """What one standard deviation about each of the vehicle's axes is along what is assumed."""
    for axis, (name, sd) in enumerate(zip(names, sds, strict=True)):
        along = sd * unmeasured[:, axis]
        if along.any():
            yield name, along
