"""Whether two ranges of one unit feel the same motion along the same axes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from strapdown.constants import STANDARD_GRAVITY
from strapdown.errors import Finding
from strapdown.sensors.crash_unit import CrashUnit
from strapdown.sensors.saturation import RangeLimits
from strapdown.sensors.unit_checks import UnitArrays

Array = NDArray[np.float64]

__all__ = ["agreement_findings", "regress_range"]

# Rows of the regression that are known worse than this say nothing.
MOST_SD = 0.1
# An element this far from the unit matrix is another axis or another sign, no scale factor.
OTHER_AXIS = 0.5
LEAST_SAMPLES = 20
# An axis that moves by less than this part of what another does is told by the other's errors.
LEAST_PART = 0.05
# Scale factors make less of a difference than this.
NEAR_G = 0.15


def regress_range(higher: Array, lower: Array) -> tuple[Array, Array]:
    """Each axis of the higher range as a sum of the lower one's axes.

    Parameters
    ----------
    higher, lower : ndarray, (n, 3)
        Where both are clear of their ends.

    Returns
    -------
    matrix : ndarray, (3, 3)
        Least squares of ``higher = matrix lower + constant``; the identity where they agree.
    sd : ndarray, (3, 3)
        From the residuals; infinite where the lower one did not vary.
    """
    x = lower - lower.mean(axis=0)
    y = higher - higher.mean(axis=0)
    normal = x.T @ x
    # An axis that does not move has no word in it.
    values, vectors = np.linalg.eigh(normal)
    seen = values > 1e-12 * max(float(values[-1]), 1e-300)
    inverse = (vectors[:, seen] / values[seen]) @ vectors[:, seen].T
    matrix = (inverse @ (x.T @ y)).T
    left = y - x @ matrix.T
    freedom = max(len(x) - 4, 1)
    variance = (left**2).sum(axis=0) / freedom
    # Filters and steps make residuals that hang together: so many are independent.
    hangs = _correlation(left)
    variance = variance * (1.0 + hangs) / (1.0 - hangs)
    sd = np.sqrt(np.maximum(variance, 1e-300)[:, None] * np.diag(inverse)[None, :])
    unseen = (vectors[:, ~seen] ** 2).sum(axis=1) > 1e-6
    sd[:, unseen] = np.inf
    return matrix, sd


def _correlation(left: Array) -> Array:
    power = (left**2).sum(axis=0)
    lag = (left[1:] * left[:-1]).sum(axis=0) / np.maximum(power, 1e-300)
    return np.asarray(np.clip(lag, 0.0, 0.99), dtype=np.float64)


def agreement_findings(
    unit: CrashUnit,
    data: UnitArrays,
    limits: Sequence[RangeLimits],
    noise: Sequence[Array],
) -> list[Finding]:
    """Ranges with swapped or inverted axes, or that are never both within their range.

    Parameters
    ----------
    unit : CrashUnit
    data : UnitArrays
    limits : sequence of RangeLimits
    noise : sequence of ndarray, (n, 3), m/s²

    Returns
    -------
    list of Finding
        Empty where the motion does not tell: gravity alone cannot, since the higher range's
        bias may be as large.
    """
    found: list[Finding] = []
    for j in range(1, len(limits)):
        low, high = unit.accelerometers[j - 1], unit.accelerometers[j]
        source = f"{unit.name}, {high.name}"
        clear = np.asarray(~(limits[j - 1].clipped | limits[j].clipped).any(axis=1))
        clear[1:-1] &= clear[:-2] & clear[2:]
        if int(clear.sum()) < LEAST_SAMPLES:
            found.append(
                Finding(
                    "sensors.samples-both-clear-their-ends",
                    file=source,
                    quantity="accel",
                    clear=int(clear.sum()),
                    name=low.name,
                )
            )
            continue
        upper, lower = data.accelerometers[j][clear], data.accelerometers[j - 1][clear]
        # Noise in the lower range pulls the slope towards zero: only what moves well above it.
        swing = lower.std(axis=0)
        moved = swing > np.maximum(3.0 * np.median(noise[j - 1], axis=0), LEAST_PART * swing.max())
        matrix, sd = regress_range(upper, lower)
        for row, axis in enumerate("xyz"):
            told = (sd[row] < MOST_SD) & moved
            if low.absent:
                # What moves along the axis that is not there leaks into the others.
                told &= np.arange(3) == row
            wrong = told & (np.abs(matrix[row] - np.eye(3)[row]) > OTHER_AXIS)
            if not wrong.any():
                continue
            column = int(np.argmax(np.where(told, np.abs(matrix[row]), 0.0)))
            sign = "-" if matrix[row, column] < 0.0 else "+"
            felt = abs(matrix[row, column]) > OTHER_AXIS
            if _in_g(abs(float(matrix[row, row]))):
                code, column = "sensors.range-in-g", row
            elif felt:
                code = "sensors.range-follows-other-axis"
            else:
                code, column = "sensors.range-does-not-follow", row
            found.append(
                Finding(
                    code,
                    file=source,
                    quantity=f"accel_{axis}",
                    name=low.name,
                    axis="xyz"[column],
                    sign=sign,
                    ratio=matrix[row, column],
                    sd=sd[row, column],
                )
            )
    return found


def _in_g(ratio: float) -> bool:
    """Whether a ratio of two accelerations is that of their units."""
    size = max(ratio, 1.0 / ratio) if ratio > 0.0 else 1.0
    return abs(size / STANDARD_GRAVITY - 1.0) < NEAR_G
