"""From an Imu table to the turn, the velocity and the distance of each step."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown._kernels import motion_blocks
from strapdown._kernels import motion_increments as one_step
from strapdown.errors import ConfigError, DataError
from strapdown.increments.angle import INTERPOLATIONS as BETWEEN_STAMPS
from strapdown.tables import ACCEL, GYRO, MOTION, check_imu, check_motion_increments

__all__ = ["INTERPOLATIONS", "ROWS", "motion_increments"]

Array = NDArray[np.float64]
#: `constant` is for means alone.
INTERPOLATIONS = ("constant", *BETWEEN_STAMPS)
ROWS = ("sample", "block")


def motion_increments(
    imu: pd.DataFrame, samples: int = 1, interpolation: str = "linear", rows: str = "sample"
) -> pd.DataFrame:
    """Form the motion increments between the samples of a log, with coning, sculling, scrolling.

    Parameters
    ----------
    imu : DataFrame
        An Imu table with specific force; any spacing, each step has its own length.
    samples : int
        Steps of a block, 1 to 4, over which rate and force are one polynomial: of degree
        `samples` through the ``samples + 1`` samples at the stamps, or, of means, of degree
        ``samples - 1`` with the integrals over the steps that were measured. A block ends
        before a step that is more than three times longer or shorter than its first, as beside
        a gap or in a burst. One that a gap or the end of the log cuts short borrows the steps
        before it, where they are like its own.
    interpolation : {'constant', 'linear', 'cubic'}
        For ``samples=1``. ``linear``: along the chord between two samples; of means, along the
        line whose integrals over this step and the one before it are those measured (constant
        where that one is unlike). ``cubic``: along the polynomial that the two neighbours
        share, where they are like it within a factor of two: the cubic through four samples,
        or the parabola with the integrals over three steps. It is known one sample late.
        ``constant``, for means alone: each for itself, without coning.
    rows : {'sample', 'block'}
        One row a sample, the flow of the block's polynomial over that step alone, known up to
        ``samples - 1`` samples late; or one row a block, in which these are put together.

    Returns
    -------
    DataFrame
        A MotionIncrements table of one row less than `imu`, or of one row a block. The first
        row of means belongs to an interval that begins before the log: it gives no row.

    Raises
    ------
    DataError
        As `tables.check_imu`; there is no accelerometer.
    ConfigError
        An option is unknown or does not go with another.

    Notes
    -----
    A mean belongs, on average, to half a sample before its stamp; its integral belongs to the
    interval that ends there exactly, so that no delay is left. Turn, velocity and distance
    come from one Magnus series, to fourth order with ``samples=1`` and ``linear``, and else to
    sixth (Blanes, Casas and Ros, BIT 40 (2000) 434, Eqs. (3.9), (3.11)). It holds where a step
    turns by less than about 1 rad. `motion_accuracy` has the orders.
    """
    mean = _check(imu, samples, interpolation, rows)
    time = np.ascontiguousarray(imu.index.to_numpy(dtype=np.float64))
    rate = np.ascontiguousarray(imu[GYRO].to_numpy(dtype=np.float64))
    force = np.ascontiguousarray(imu[ACCEL].to_numpy(dtype=np.float64))
    dt = np.diff(time)
    out = np.empty((len(dt), len(MOTION)))
    scratch = np.empty((motion_blocks.ROWS, motion_blocks.WIDEST))
    ends: NDArray[Any] = time[1:]
    if samples == 1 and interpolation == "linear":
        one_step.motion_increments_linear(dt, rate, force, mean, out)
    elif interpolation == "cubic":
        motion_blocks.motion_increments_neighbours(dt, rate, force, mean, scratch, out)
    else:
        motion_blocks.motion_increments_blocks(dt, rate, force, mean, samples, scratch, out)
    if rows == "block" and samples > 1:
        last = np.empty(len(dt), dtype=np.int64)
        joined = np.empty_like(out)
        count = motion_blocks.join_blocks(dt, samples, out, last, joined)
        # A step is as long as its stamps say, to the last bit.
        ends, out = ends[last[:count]], joined[:count].copy()
    table = pd.DataFrame(out, index=pd.Index(ends, name="time"), columns=MOTION, copy=False)
    table.attrs["source"] = imu.attrs.get("source")
    check_motion_increments(table)
    return table


def _check(imu: pd.DataFrame, samples: int, interpolation: str, rows: str) -> bool:
    """Whether the table holds means; everything that was asked is possible."""
    if samples not in (1, 2, 3, 4):
        raise ConfigError("mechanization.out-range", quantity="samples", samples=samples)
    for quantity, value, known in (
        ("interpolation", interpolation, INTERPOLATIONS),
        ("rows", rows, ROWS),
    ):
        if value not in known:
            raise ConfigError(
                "mechanization.no-choice",
                quantity=quantity,
                value=value,
                word=str(value),
                known=known,
            )
    if samples > 1 and interpolation != "linear":
        raise ConfigError(
            "mechanization.steps-block-share-polynomial",
            quantity="interpolation",
            samples=samples,
            interpolation=interpolation,
        )
    check_imu(imu)
    mean = bool(imu.attrs["sampling"] == "mean")
    if interpolation == "constant" and not mean:
        raise ConfigError(
            "mechanization.samples-stamps-not-constant-between", quantity="interpolation"
        )
    if ACCEL[0] not in imu.columns:
        raise DataError(
            "mechanization.no-accelerometer-without-specific-force",
            file=imu.attrs.get("source"),
            quantity="accel",
        )
    return mean
