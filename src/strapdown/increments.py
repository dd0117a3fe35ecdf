"""Angle, velocity and position increments from samples of angular rate and specific force."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from strapdown._kernels import increments as angle_kernel
from strapdown._kernels import motion_increments as kernel
from strapdown.constants import Array
from strapdown.errors import ConfigError, DataError, check_choice
from strapdown.tables import (
    ACCEL,
    GYRO,
    MOTION,
    check_imu,
    imu_table,
    increments_table,
)
from strapdown.tables.checks import (
    as_array,
    check_rows,
    check_same_length,
    check_time,
    source_of,
    values_of,
    view_of,
)

#: Of rates at the stamps.
BETWEEN_STAMPS = ("linear", "cubic")
#: `constant` applies to mean samples only.
INTERPOLATIONS = ("constant", *BETWEEN_STAMPS)
ROWS = ("sample", "block")


def increments_from_imu(imu: pd.DataFrame, interpolation: str = "linear") -> pd.DataFrame:
    """Form the angular increments between the samples of a log.

    Parameters
    ----------
    imu : DataFrame
        An Imu table; any spacing, each step has its own length.
    interpolation : {'linear', 'cubic'}
        Rate between the stamps. ``linear``: the trapezoid rule (Alexiev 2021, Eq. (2)), second
        order in the step. ``cubic``: the cubic through the two samples and their neighbors, fourth
        order on smooth motion; beside a gap or in a burst only neighbors whose steps agree within a
        factor of two are used. The cubic needs the sample after the step, which delays live output
        by one sample. Ignored for mean rates.

    Returns
    -------
    DataFrame
        An Increments table with one row less than `imu`. A mean rate is multiplied by its step; its
        first row is omitted because that interval begins before the log.

    Raises
    ------
    DataError
        As `tables.check_imu`.
    ConfigError
        `interpolation` is unknown.
    """
    check_choice(
        "mechanization.no-interpolation",
        BETWEEN_STAMPS,
        quantity="interpolation",
        interpolation=interpolation,
    )
    check_imu(imu)
    time = np.ascontiguousarray(imu.index.to_numpy(dtype=np.float64))
    rate = values_of(imu, GYRO)
    dt = np.diff(time)
    theta = np.empty((len(dt), 3))
    dtheta = np.empty_like(theta)
    mean = imu.attrs["sampling"] == "mean"
    if interpolation == "cubic" and not mean:
        angle_kernel.increments_cubic(dt, rate, theta, dtheta)
    else:
        angle_kernel.increments(dt, rate, mean, theta, dtheta)
    table = increments_table(time[1:], dt, theta, dtheta)
    table.attrs["source"] = imu.attrs.get("source")
    return table


def motion_increments(
    imu: pd.DataFrame, samples: int = 1, interpolation: str = "linear", rows: str = "sample"
) -> pd.DataFrame:
    """Form the motion increments between the samples of a log, with coning, sculling, scrolling.

    Parameters
    ----------
    imu : DataFrame
        An Imu table with specific force; any spacing, each step has its own length.
    samples : int
        Steps per block, 1 to 4. Over a block, rate and specific force are one polynomial: of degree
        `samples` through the ``samples + 1`` samples at the stamps, or, for means, of degree
        ``samples - 1`` with the measured integrals over the steps. A block ends before a step that
        is more than three times longer or shorter than its first, as beside a gap or in a burst. A
        block cut short by a gap or the end of the log borrows the preceding steps where their
        lengths are similar.
    interpolation : {'constant', 'linear', 'cubic'}
        For ``samples=1``. ``linear``: the chord between two samples; for means, the line with the
        measured integrals over this step and the previous one (constant where their lengths
        differ). ``cubic``: the polynomial that also uses the two neighbors, where their steps agree
        within a factor of two: the cubic through four samples, or the parabola with the integrals
        over three steps. It is delayed by one sample. ``constant``, for means only: each mean by
        itself, without coning.
    rows : {'sample', 'block'}
        One row per sample, integrating the block's polynomial over that step alone, delayed by up
        to ``samples - 1`` samples; or one row per block, the composition of these.

    Returns
    -------
    DataFrame
        A MotionIncrements table with one row less than `imu`, or one row per block. The first row
        of means gives no increment because its interval begins before the log.

    Raises
    ------
    DataError
        As `tables.check_imu`, or the table has no accelerometer.
    ConfigError
        An option is unknown or conflicts with another.

    Notes
    -----
    A mean is centered half a sample before its stamp, but its integral covers exactly the interval
    that ends there, so no delay remains. Rotation, velocity and position increments come from one
    Magnus series, to fourth order for ``samples=1`` with ``linear``, otherwise to sixth (Blanes,
    Casas and Ros, BIT 40 (2000) 434, Eqs. (3.9), (3.11)). It is valid where a step rotates by less
    than about 1 rad. `motion_accuracy` gives the orders.
    """
    mean = _check(imu, samples, interpolation, rows)
    time = np.ascontiguousarray(imu.index.to_numpy(dtype=np.float64))
    values = np.ascontiguousarray(view_of(imu, [*GYRO, *ACCEL]))
    dt = np.diff(time)
    out = np.empty((len(dt), len(MOTION)))
    scratch = np.empty((kernel.ROWS, kernel.WIDEST))
    ends: NDArray[Any] = time[1:]
    if samples == 1 and interpolation == "linear":
        kernel.motion_increments_linear(dt, values, mean, out)
    elif interpolation == "cubic":
        kernel.motion_increments_neighbours(dt, values, mean, scratch, out)
    else:
        kernel.motion_increments_blocks(dt, values, mean, samples, scratch, out)
    if rows == "block" and samples > 1:
        last = np.empty(len(dt), dtype=np.int64)
        joined = np.empty_like(out)
        count = kernel.join_blocks(dt, samples, out, last, joined)
        # The step length equals the stamp difference, to the last bit.
        ends, out = ends[last[:count]], joined[:count].copy()
    index = pd.Index(ends, name="time", copy=False)
    table = pd.DataFrame(out, index=index, columns=MOTION, copy=False)
    table.attrs["source"] = imu.attrs.get("source")
    check_rows(out, MOTION, source_of(imu))
    return table


def _check(imu: pd.DataFrame, samples: int, interpolation: str, rows: str) -> bool:
    """Check table and options; return whether the samples are means."""
    if samples not in (1, 2, 3, 4):
        raise ConfigError("mechanization.out-range", quantity="samples", samples=samples)
    for quantity, value, known in (
        ("interpolation", interpolation, INTERPOLATIONS),
        ("rows", rows, ROWS),
    ):
        check_choice("mechanization.no-choice", known, quantity=quantity, value=value)
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


# The same for samples that arrive in chunks of any length.

STREAMED = ("linear", "cubic")


@dataclass(frozen=True, eq=False)
class IncrementStreamState:
    """State between chunks.

    `mean`: whether samples are means over the step ending at their stamp. `time` ((k,), s): newest
    stamps, as many as the next step needs. `values` ((k, 6)). `done`: steps between these stamps
    already returned.
    """

    mean: bool
    time: Array
    values: Array
    done: int


@dataclass(frozen=True)
class IncrementStream:
    """Stream the rows of `motion_increments`, bit-identical to processing the whole record.

    `interpolation` ({'linear', 'cubic'}): see `motion_increments`. ``linear`` returns each step
    with the sample that ends it, ``cubic`` one sample later. ConfigError: the interpolation is
    unknown.
    """

    interpolation: str = "linear"

    def __post_init__(self) -> None:
        check_choice(
            "mechanization.no-interpolation",
            STREAMED,
            quantity="interpolation",
            interpolation=self.interpolation,
        )

    def begin(self, sampling: str = "instantaneous") -> IncrementStreamState:
        """Return the state before the first sample.

        `sampling` ({'instantaneous', 'mean'}): as `tables.imu_table`.
        """
        return IncrementStreamState(sampling == "mean", np.empty(0), np.empty((0, 6)), 0)

    def advance(
        self, state: IncrementStreamState, time: Array, values: Array, last: bool = False
    ) -> tuple[IncrementStreamState, Array, Array]:
        """Process further samples.

        `state`: not changed. `time` ((k,), s): stamps, increasing, after the previous ones; k may
        be zero. `values` ((k, 6)): rates in rad/s and specific forces in m/s². `last`: whether no
        sample follows; steps still waiting for one are then returned without it. Returns `state`;
        `ends` ((m,), s): ends of the steps; `rows` ((m, 10)): rows of a MotionIncrements table.
        """
        stamps = np.concatenate([state.time, time])
        samples = np.concatenate([state.values, values])
        dt = np.diff(stamps)
        out = np.empty((dt.size, 10))
        if self.interpolation == "linear":
            kernel.motion_increments_linear(dt, samples, state.mean, out)
            upto = dt.size
        else:
            scratch = np.empty((kernel.ROWS, kernel.WIDEST))
            kernel.motion_increments_neighbours(dt, samples, state.mean, scratch, out)
            upto = dt.size if last else max(dt.size - 1, state.done)
        # Keep the step before the next one: it gives the slope of a mean, and is its neighbor.
        keep = max(upto - 1, 0)
        after = IncrementStreamState(
            state.mean, stamps[keep:].copy(), samples[keep:].copy(), min(upto, 1)
        )
        return after, stamps[1:][state.done : upto], out[state.done : upto]


# Orders of accuracy of motion increments, as data; the tests fit each one.


@dataclass(frozen=True)
class MotionAccuracy:
    """Powers of the step with which errors decrease on smooth motion, at the ends of blocks.

    Attributes
    ----------
    attitude, velocity, position : int
        For equal steps in a block.
    unequal : int
        For all three with unequal steps: with an even number of steps, one error term cancels
        between the halves of a block only where these are equal.
    """

    attitude: int
    velocity: int
    position: int
    unequal: int


def _orders(equal: int, unequal: int) -> MotionAccuracy:
    return MotionAccuracy(equal, equal, equal, unequal)


# By number of steps and interpolation. The error of the polynomial is a multiple of the product of
# distances to its nodes. For n steps these are n + 1 stamps, for samples and for the running sums
# of means alike, and the integral of that product over equal steps is zero where n is even.
_BLOCKS = {2: _orders(4, 3), 3: _orders(4, 4), 4: _orders(6, 5)}
ORDERS: dict[tuple[str, int, str], MotionAccuracy] = {
    ("instantaneous", 1, "linear"): _orders(2, 2),
    ("instantaneous", 1, "cubic"): _orders(4, 4),
    ("mean", 1, "constant"): _orders(2, 2),
    ("mean", 1, "linear"): _orders(3, 3),
    ("mean", 1, "cubic"): _orders(4, 4),
    **{(s, n, "linear"): o for s in ("instantaneous", "mean") for n, o in _BLOCKS.items()},
}


def motion_accuracy(
    sampling: str, samples: int = 1, interpolation: str = "linear"
) -> MotionAccuracy:
    """Look up the orders of accuracy of `motion_increments`.

    Parameters
    ----------
    sampling : {'instantaneous', 'mean'}
    samples, interpolation
        As `motion_increments`.

    Raises
    ------
    ConfigError
        The combination is unknown.
    """
    try:
        return ORDERS[sampling, samples, interpolation]
    except KeyError:
        raise ConfigError(
            "mechanization.no-motion-increments-made-samples",
            quantity="accuracy",
            sampling=sampling,
            samples=samples,
            interpolation=interpolation,
        ) from None


# Sensors that integrate: increments of angle and velocity as means over their steps.


def imu_from_increments(
    time: ArrayLike,
    theta: ArrayLike,
    dv: ArrayLike | None = None,
    dt: float | None = None,
    source: str | None = None,
) -> pd.DataFrame:
    """Make an Imu table from increments that a sensor integrated since its last sample.

    Parameters
    ----------
    time : array_like, (n,), s
        Stamps: the end of each sample's interval, which begins at the previous stamp.
    theta : array_like, (n, 3), rad
        Integral of the rate over the interval, axis by axis, without coning correction.
    dv : array_like, (n, 3), m/s, optional
        Integral of the specific force, axis by axis, without sculling correction.
    dt : float, s, optional
        Length of the first interval, which the stamps do not give; default, the median step.
    source : str, optional
        Name for messages.

    Returns
    -------
    DataFrame
        An Imu table of means: each increment divided by its step.

    Raises
    ------
    DataError
        As `tables.imu_table`; `dt` is not positive.
    """
    stamps = as_array(time, None, "time", source)
    angle = as_array(theta, 3, "theta", source)
    velocity = None if dv is None else as_array(dv, 3, "dv", source)
    check_same_length(source, time=stamps, theta=angle)
    if velocity is not None:
        check_same_length(source, time=stamps, dv=velocity)
    check_time(stamps, source)
    if len(stamps) < 2 and dt is None:
        # The table raises the error for a single sample.
        return imu_table(stamps, angle, velocity, sampling="mean", source=source)
    first = float(np.median(np.diff(stamps))) if dt is None else float(dt)
    if not (np.isfinite(first) and first > 0.0):
        raise DataError(
            "mechanization.first-step-none", file=source, row=1, quantity="dt", first=first
        )
    steps = np.concatenate([[first], np.diff(stamps)])[:, None]
    return imu_table(
        stamps,
        angle / steps,
        None if velocity is None else velocity / steps,
        sampling="mean",
        source=source,
    )
